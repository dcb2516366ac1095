//! The obstacle: a shaded triangle mesh as the camera sees it.

use glam::DVec3;

use super::{
    Cut,
    camera::{Camera, Seen},
    facet::Facet,
    raster::{Band, Corner},
    section::SeenCut,
};

/// A triangle mesh by reference.
#[derive(Debug, Clone, Copy, Default)]
pub struct MeshView<'a> {
    /// The vertices in metres.
    pub vertices: &'a [DVec3],
    /// The outward normals of any length, one for each vertex. If there are fewer, the mesh is shaded flat.
    pub normals: &'a [DVec3],
    /// Three indices of vertices for each triangle. Both sides are drawn.
    pub triangles: &'a [[u32; 3]],
    /// The plane that cuts the mesh open, which must then be closed.
    pub cut: Option<Cut>,
}

/// Triangles on the screen.
#[derive(Debug)]
pub struct Facets {
    facets: Vec<Facet>,
    cut: Option<SeenCut>,
    /// The number of triangles with a bad index or a corner that the camera cannot see.
    pub skipped: usize,
}

impl Facets {
    pub fn new(mesh: &MeshView<'_>, camera: &Camera) -> Self {
        let seen: Vec<_> = mesh.vertices.iter().map(|vertex| camera.look(*vertex)).collect();
        let smooth = mesh.normals.len() >= mesh.vertices.len();
        let facet = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|index| index as usize);
            let corners: [Seen; 3] = [(*seen.get(a)?)?, (*seen.get(b)?)?, (*seen.get(c)?)?];
            let points = [a, b, c].map(|i| mesh.vertices[i]);
            let face = (points[1] - points[0]).cross(points[2] - points[0]);
            let given = if smooth { [a, b, c].map(|i| mesh.normals[i]) } else { [face; 3] };
            // the winding decides which side is outside only if the normals do not
            let outward = if face.dot(given[0] + given[1] + given[2]) < 0.0 { -face } else { face };
            let side = if outward.dot(camera.to_eye(points[0])) < 0.0 { -1.0 } else { 1.0 };
            let normals = given.map(|n| {
                let n = n.try_normalize().or_else(|| outward.try_normalize()).unwrap_or(DVec3::Z);
                camera.turn(side * n).as_vec3().to_array()
            });
            let beyond =
                |i: usize| mesh.cut.map_or(-1.0, |cut| (corners[i].nearness * cut.beyond(points[i])) as f32);
            let beyond = [0, 1, 2].map(beyond);
            let corners = corners.map(Corner::new);
            Some(Facet { corners, rows: Corner::rows(&corners), normals, beyond })
        };
        let facets: Vec<_> = mesh.triangles.iter().filter_map(facet).collect();
        let skipped = mesh.triangles.len() - facets.len();
        let cut = mesh.cut.and_then(|cut| SeenCut::new(&cut, camera));
        Self { facets, cut, skipped }
    }

    pub fn draw(&self, band: &mut Band<'_>) {
        let (top, bottom) = (band.top as i64, band.bottom() as i64);
        let here = self.facets.iter().filter(|facet| facet.rows.0 < bottom && facet.rows.1 >= top);
        match &self.cut {
            Some(cut) => cut.draw(&here.collect::<Vec<_>>(), band),
            None => here.for_each(|facet| band.triangle(&facet.corners, |weights| facet.colour(weights))),
        }
    }
}
