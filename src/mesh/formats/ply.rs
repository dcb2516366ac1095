//! Binary little-endian PLY with vertex normals.
//!
//! Positions are `double`, because vertices are exact and `float` would move them by 1e-7 of their size.
//! Normals are `float`, because an error of 1e-7 radians does not matter.
//!
//! Invariant: indices are written as `int`, which more readers accept than `uint`. [`Mesh::MAX_VERTICES`]
//! fits it.

use std::io::{self, Write};

use super::super::Mesh;
use super::format::Format;
use super::unit::LengthUnit;

/// The entry of the table of formats.
pub const FORMAT: Format = Format {
    ending: "ply",
    purpose: "Shared vertices with normals, binary",
    only_metres: false,
    single: false,
    write,
    write_text: None,
};

/// Writes a mesh as PLY.
///
/// # Errors
/// Those of the stream.
pub fn write(mesh: &Mesh, unit: LengthUnit, out: &mut dyn Write) -> io::Result<()> {
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment rfm, {}, outward normals\n\
         element vertex {}\n\
         property double x\nproperty double y\nproperty double z\n\
         property float nx\nproperty float ny\nproperty float nz\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        unit.plural,
        mesh.positions.len(),
        mesh.triangles.len()
    )?;
    for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
        let mut record = [0; 36];
        let position = unit.per_metre * position;
        let (doubles, floats) = record.split_at_mut(24);
        for axis in 0..3 {
            doubles[8 * axis..][..8].copy_from_slice(&position[axis].to_le_bytes());
            floats[4 * axis..][..4].copy_from_slice(&(normal[axis] as f32).to_le_bytes());
        }
        out.write_all(&record)?;
    }
    for triangle in &mesh.triangles {
        let mut record = [3; 13];
        for (bytes, &v) in record[1..].chunks_exact_mut(4).zip(triangle) {
            bytes.copy_from_slice(&(v as i32).to_le_bytes());
        }
        out.write_all(&record)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::pawn_mesh;

    #[test]
    fn ply_reads_back() {
        use ply_rs_bw::{
            parser::Parser,
            ply::{DefaultElement, Property},
        };
        let mesh = pawn_mesh();
        let mut bytes = Vec::new();
        write(&mesh, LengthUnit::METRE, &mut bytes).unwrap();
        let read = Parser::<DefaultElement>::new().read_ply(&mut std::io::Cursor::new(bytes)).unwrap();
        let (vertices, faces) = (&read.payload["vertex"], &read.payload["face"]);
        assert_eq!((vertices.len(), faces.len()), (mesh.positions.len(), mesh.triangles.len()));
        for (i, vertex) in vertices.iter().enumerate() {
            for (axis, (place, normal)) in [("x", "nx"), ("y", "ny"), ("z", "nz")].into_iter().enumerate() {
                assert_eq!(vertex[place], Property::Double(mesh.positions[i][axis]));
                assert_eq!(vertex[normal], Property::Float(mesh.normals[i][axis] as f32));
            }
        }
        for (face, triangle) in faces.iter().zip(&mesh.triangles) {
            assert_eq!(face["vertex_indices"], Property::ListInt(triangle.map(|v| v as i32).to_vec()));
        }
    }
}
