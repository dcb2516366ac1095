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
