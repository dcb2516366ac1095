//! Wavefront OBJ, as text.
//!
//! Invariant: every number is written with the fewest digits that read back to the same `f64`.

use std::io::{self, Write};

use super::super::Mesh;
use super::format::Format;

/// The entry of the table of formats.
pub const FORMAT: Format =
    Format { ending: "obj", purpose: "Shared vertices with normals, text", write, write_text: None };

/// Writes a mesh as OBJ with one normal for each vertex.
///
/// # Errors
/// Those of the stream.
pub fn write(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "# rfm, metres, outward normals")?;
    for p in &mesh.positions {
        writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
    }
    for n in &mesh.normals {
        writeln!(out, "vn {} {} {}", n.x, n.y, n.z)?;
    }
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| v + 1);
        writeln!(out, "f {a}//{a} {b}//{b} {c}//{c}")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::mesh::tests::pawn_mesh;

    #[test]
    fn obj_text_reads_back_exactly() {
        let mesh = pawn_mesh();
        let mut bytes = Vec::new();
        write(&mesh, &mut bytes).unwrap();
        let load = tobj::load_obj_buf(&mut &bytes[..], &tobj::LoadOptions::default(), |_| {
            Ok((Vec::new(), Default::default()))
        });
        let (models, _) = load.unwrap();
        let [model] = &models[..] else { panic!("{} models", models.len()) };
        // the reader numbers vertices in the order of faces
        let corner = |flat: &[f64], index: u32| DVec3::from_slice(&flat[3 * index as usize..]);
        assert_eq!(model.mesh.indices.len(), 3 * mesh.triangles.len());
        for (i, v) in mesh.triangles.iter().flatten().enumerate() {
            let (place, normal) = (model.mesh.indices[i], model.mesh.normal_indices[i]);
            assert_eq!(corner(&model.mesh.positions, place), mesh.positions[*v as usize]);
            assert_eq!(corner(&model.mesh.normals, normal), mesh.normals[*v as usize]);
        }
    }
}
