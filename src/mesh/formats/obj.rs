//! Wavefront OBJ, as text.
//!
//! Invariant: every number is written with the fewest digits that read back to the same `f64`.

use std::io::{self, Write};

use super::super::Mesh;

/// Writes a mesh as OBJ with one normal for each vertex.
///
/// # Errors
/// What the writer reports.
pub fn write(mesh: &Mesh, out: &mut impl Write) -> io::Result<()> {
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
        let as_vectors = |flat: &[f64]| flat.chunks(3).map(DVec3::from_slice).collect::<Vec<_>>();
        assert_eq!(as_vectors(&model.mesh.positions), mesh.positions);
        assert_eq!(as_vectors(&model.mesh.normals), mesh.normals);
        assert_eq!(model.mesh.indices, mesh.triangles.concat());
        assert_eq!(model.mesh.normal_indices, mesh.triangles.concat());
    }
}
