//! Wavefront OBJ, as text.
//!
//! Invariant: every number is written with the fewest digits that read back to the same `f64`.

use std::io::{self, Write};

use super::Mesh;

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
        let text = String::from_utf8(bytes).unwrap();
        let numbers = |tag: &str| -> Vec<Vec<f64>> {
            let lines = text.lines().filter_map(|line| line.strip_prefix(tag));
            lines
                .map(|line| line.split(' ').map(|n| n.split('/').next().unwrap().parse().unwrap()).collect())
                .collect()
        };
        let as_vectors = |tag| numbers(tag).iter().map(|n| DVec3::from_slice(n)).collect::<Vec<_>>();
        assert_eq!(as_vectors("v "), mesh.positions);
        assert_eq!(as_vectors("vn "), mesh.normals);
        let first_face = mesh.triangles[0].map(|v| f64::from(v + 1));
        assert_eq!((numbers("f ").len(), &numbers("f ")[0][..]), (mesh.triangles.len(), &first_face[..]));
    }
}
