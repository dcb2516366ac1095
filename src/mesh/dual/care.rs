//! What a mesh is made for: nearness to the surface, or triangles that do not cross.

/// What a mesh is made for. Few meshes cross themselves, and care against that costs sharpness and time, so
/// it is taken only where a mesh without it does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Care {
    /// Vertices are as close to the surface as possible.
    Sharp,
    /// Without triangles that cross, though rims may become blunt and vertices leave the surface.
    Apart,
}
