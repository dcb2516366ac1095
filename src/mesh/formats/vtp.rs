//! VTK polygonal data (`.vtp`) with appended raw data, for ParaView.
//!
//! Positions are `double`, since exact vertices are the point of this mesher; normals are `float`.
//!
//! Invariant: everything is little-endian; the same mesh gives the same bytes.

use std::io::{self, Write};

use super::super::Mesh;

/// Writes a mesh as VTP with one normal for each vertex.
///
/// # Errors
/// What the writer reports.
pub fn write(mesh: &Mesh, out: &mut impl Write) -> io::Result<()> {
    let (points, polys) = (mesh.positions.len(), mesh.triangles.len());
    // each array is its length in bytes, as u64, and its bytes
    let sizes = [12 * points, 24 * points, 12 * polys, 4 * polys];
    let offsets = [0, 1, 2, 3].map(|i| sizes[..i].iter().map(|size| size + 8).sum::<usize>());
    let array = |kind: &str, name: &str, components: usize, i: usize| {
        format!(
            r#"<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" format="appended" offset="{}"/>"#,
            offsets[i]
        )
    };
    write!(
        out,
        r#"<?xml version="1.0"?>
<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<PolyData>
<Piece NumberOfPoints="{points}" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="{polys}">
<PointData Normals="normals">
{}
</PointData>
<Points>
{}
</Points>
<Polys>
{}
{}
</Polys>
</Piece>
</PolyData>
<AppendedData encoding="raw">
_"#,
        array("Float32", "normals", 3, 0),
        array("Float64", "points", 3, 1),
        array("Int32", "connectivity", 1, 2),
        array("Int32", "offsets", 1, 3),
    )?;
    let length = |i: usize| (sizes[i] as u64).to_le_bytes();
    out.write_all(&length(0))?;
    for normal in &mesh.normals {
        normal.to_array().iter().try_for_each(|&x| out.write_all(&(x as f32).to_le_bytes()))?;
    }
    out.write_all(&length(1))?;
    for position in &mesh.positions {
        position.to_array().iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
    }
    out.write_all(&length(2))?;
    for triangle in &mesh.triangles {
        triangle.iter().try_for_each(|&v| out.write_all(&(v as i32).to_le_bytes()))?;
    }
    out.write_all(&length(3))?;
    for index in 1..=polys {
        out.write_all(&((3 * index) as i32).to_le_bytes())?;
    }
    out.write_all(b"\n</AppendedData>\n</VTKFile>\n")
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
            write(&mesh, &mut bytes).unwrap();
            let vtk = vtkio::Vtk::parse_xml(&bytes[..]).unwrap();
            let DataSet::PolyData { pieces, .. } = vtk.data else { panic!("another kind of data") };
            let piece = pieces.into_iter().next().unwrap().into_loaded_piece_data(None).unwrap();
            let flat: Vec<f64> = mesh.positions.iter().flat_map(|p| p.to_array()).collect();
            assert_eq!(piece.points.into_vec::<f64>().unwrap(), flat);
            let Some(VertexNumbers::XML { connectivity, offsets }) = piece.polys else { panic!("no polygons") };
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
