//! VTK polygonal data (`.vtp`) with its numbers as base64, for ParaView.
//!
//! Positions are `double`, because vertices are exact; normals are `float`.
//!
//! Invariant: everything is little-endian. Equal meshes give equal bytes.

use std::io::{self, Write};

use base64::prelude::BASE64_STANDARD;
use base64::write::EncoderWriter;

use super::super::Mesh;
use super::format::{Format, in_metres};
use super::unit::LengthUnit;

/// The entry of the table of formats.
pub const FORMAT: Format = Format {
    ending: "vtp",
    purpose: "For ParaView",
    only_metres: true,
    single: false,
    write,
    write_text: None,
};

/// Writes a mesh as VTP with one normal for each vertex, in metres as the frames of runs are.
///
/// # Errors
/// Those of the stream.
pub fn write(mesh: &Mesh, unit: LengthUnit, out: &mut dyn Write) -> io::Result<()> {
    write_with(mesh, None, unit, out)
}

/// Writes several meshes as one, as [`write()`] does. Each vertex also has the number of its mesh, from 0, in the array
/// `body`.
///
/// # Errors
/// Those of the stream.
pub fn write_bodies(meshes: &[Mesh], unit: LengthUnit, out: &mut dyn Write) -> io::Result<()> {
    let numbered = (0..).zip(meshes);
    let bodies = numbered.flat_map(|(number, mesh)| std::iter::repeat_n(number, mesh.positions.len()));
    write_with(&Mesh::joined(meshes), Some(bodies.collect()), unit, out)
}

fn write_with(
    mesh: &Mesh,
    bodies: Option<Vec<i32>>,
    unit: LengthUnit,
    out: &mut dyn Write,
) -> io::Result<()> {
    in_metres(unit)?;
    let (points, polys) = (mesh.positions.len(), mesh.triangles.len());
    write!(
        out,
        r#"<?xml version="1.0"?>
<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<PolyData>
<Piece NumberOfPoints="{points}" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="{polys}">
<PointData Normals="normals">
"#
    )?;
    let normals = mesh.normals.iter().flat_map(|n| n.to_array()).map(|x| (x as f32).to_le_bytes());
    array(out, "Float32", "normals", 3, normals)?;
    if let Some(bodies) = bodies {
        array(out, "Int32", "body", 1, bodies.into_iter().map(i32::to_le_bytes))?;
    }
    writeln!(out, "</PointData>\n<Points>")?;
    let positions = mesh.positions.iter().flat_map(|p| p.to_array()).map(f64::to_le_bytes);
    array(out, "Float64", "points", 3, positions)?;
    writeln!(out, "</Points>\n<Polys>")?;
    let corners = mesh.triangles.iter().flatten().map(|&v| (v as i32).to_le_bytes());
    array(out, "Int32", "connectivity", 1, corners)?;
    let ends = (1..=polys).map(|triangle| (3 * triangle as i64).to_le_bytes());
    array(out, "Int64", "offsets", 1, ends)?;
    writeln!(out, "</Polys>\n</Piece>\n</PolyData>\n</VTKFile>")
}

/// Writes an array as base64: the number of its bytes, then its bytes.
fn array<const N: usize>(
    out: &mut dyn Write,
    kind: &str,
    name: &str,
    components: usize,
    numbers: impl Iterator<Item = [u8; N]>,
) -> io::Result<()> {
    writeln!(
        out,
        r#"<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" format="binary">"#
    )?;
    let bytes: Vec<u8> = numbers.flatten().collect();
    let mut encoder = EncoderWriter::new(&mut *out, &BASE64_STANDARD);
    encoder.write_all(&(bytes.len() as u64).to_le_bytes())?;
    encoder.write_all(&bytes)?;
    encoder.finish()?;
    drop(encoder);
    writeln!(out, "\n</DataArray>")
}

#[cfg(test)]
mod tests {
    use vtkio::model::{Attribute, DataSet, VertexNumbers};

    use super::*;
    use crate::mesh::tests::pawn_mesh;

    #[test]
    fn vtp_reads_back() {
        for mesh in [pawn_mesh(), Mesh::default()] {
            let mut bytes = Vec::new();
            write(&mesh, LengthUnit::METRE, &mut bytes).unwrap();
            let vtk = vtkio::Vtk::parse_xml(&bytes[..]).unwrap();
            let DataSet::PolyData { pieces, .. } = vtk.data else { panic!("another kind of data") };
            let piece = pieces.into_iter().next().unwrap().into_loaded_piece_data(None).unwrap();
            let flat: Vec<f64> = mesh.positions.iter().flat_map(|p| p.to_array()).collect();
            assert_eq!(piece.points.into_vec::<f64>().unwrap(), flat);
            let Some(VertexNumbers::XML { connectivity, offsets }) = piece.polys else {
                panic!("no polygons")
            };
            let indices: Vec<u64> = mesh.triangles.iter().flatten().map(|&v| u64::from(v)).collect();
            assert_eq!(connectivity, indices);
            let ends: Vec<u64> = (1..=mesh.triangles.len() as u64).map(|i| 3 * i).collect();
            assert_eq!(offsets, ends);
            let [Attribute::DataArray(normals)] = &piece.data.point[..] else { panic!("no normals") };
            let flat: Vec<f32> = mesh.normals.iter().flat_map(|n| n.to_array()).map(|x| x as f32).collect();
            assert_eq!((normals.name.as_str(), normals.data.cast_into::<f32>().unwrap()), ("normals", flat));
        }
    }
}
