//! STL: triangles with their own normals in `f32`, as binary records or as text.
//!
//! Invariant: normals are computed from the triangles in `f64`, before corners are rounded, so slivers keep a
//! direction. A triangle without area gets the zero normal, which readers take as "compute it".

use std::io::{self, Write};

use glam::DVec3;

use super::super::{Mesh, normals::unit};
use super::format::Format;
use super::unit::LengthUnit;

/// The entry of the table of formats.
pub const FORMAT: Format = Format {
    ending: "stl",
    purpose: "Triangles as records, for nearly every program",
    only_metres: false,
    single: true,
    write,
    write_text: Some(write_ascii),
};

/// Writes a mesh as binary STL. The file does not state the unit.
///
/// # Errors
/// Those of the stream.
pub fn write(mesh: &Mesh, unit: LengthUnit, out: &mut dyn Write) -> io::Result<()> {
    // a header that began with "solid" would be taken for the text form
    let mut header = [b' '; 80];
    let title = b"binary STL by rfm";
    header[..title.len()].copy_from_slice(title);
    out.write_all(&header)?;
    let count = u32::try_from(mesh.triangles.len()).map_err(io::Error::other)?;
    out.write_all(&count.to_le_bytes())?;
    for triangle in &mesh.triangles {
        let mut record = [0; 50];
        let numbers = facet(mesh, unit, *triangle).into_iter().flat_map(|v: DVec3| v.to_array());
        for (bytes, number) in record.chunks_exact_mut(4).zip(numbers) {
            bytes.copy_from_slice(&(number as f32).to_le_bytes());
        }
        out.write_all(&record)?;
    }
    Ok(())
}

/// Writes a mesh as STL text, which is ten times as large.
///
/// # Errors
/// Those of the stream.
pub fn write_ascii(mesh: &Mesh, unit: LengthUnit, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "solid rfm")?;
    for triangle in &mesh.triangles {
        let [n, a, b, c] = facet(mesh, unit, *triangle).map(|v| v.as_vec3());
        writeln!(out, "facet normal {:e} {:e} {:e}\nouter loop", n.x, n.y, n.z)?;
        for p in [a, b, c] {
            writeln!(out, "vertex {:e} {:e} {:e}", p.x, p.y, p.z)?;
        }
        writeln!(out, "endloop\nendfacet")?;
    }
    writeln!(out, "endsolid rfm")
}

/// The normal and the corners of a triangle.
fn facet(mesh: &Mesh, length: LengthUnit, triangle: [u32; 3]) -> [DVec3; 4] {
    let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
    let normal = unit((b - a).cross(c - a)).unwrap_or(DVec3::ZERO);
    let [a, b, c] = [a, b, c].map(|p| length.per_metre * p);
    [normal, a, b, c]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::pawn_mesh;

    #[test]
    fn stl_reads_back() {
        let mesh = pawn_mesh();
        let mut bytes = Vec::new();
        write(&mesh, LengthUnit::METRE, &mut bytes).unwrap();
        assert_eq!(bytes.len(), 84 + 50 * mesh.triangles.len());
        same_when_read(&mesh, bytes);
        let mut text = Vec::new();
        write_ascii(&mesh, LengthUnit::METRE, &mut text).unwrap();
        assert!(text.starts_with(b"solid rfm\nfacet normal "));
        same_when_read(&mesh, text);
    }

    fn same_when_read(mesh: &Mesh, bytes: Vec<u8>) {
        let read = stl_io::read_stl(&mut std::io::Cursor::new(bytes)).unwrap();
        assert_eq!((read.faces.len(), read.vertices.len()), (mesh.triangles.len(), mesh.positions.len()));
        for (face, triangle) in read.faces.iter().zip(&mesh.triangles) {
            let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
            let normal = (b - a).cross(c - a).normalize();
            for axis in 0..3 {
                assert_eq!(read.vertices[face.vertices[0]][axis], a[axis] as f32);
                assert_eq!(face.normal[axis], normal[axis] as f32);
            }
        }
    }
}
