//! VTK polygonal data (`.vtp`) as text, for ParaView.
//!
//! Invariant: every number is written with the fewest digits that read back to the same `f64`.

use std::io::{self, Write};

use super::Mesh;

/// Writes a mesh as ASCII VTP with one normal for each vertex.
///
/// # Errors
/// What the writer reports.
pub fn write(mesh: &Mesh, out: &mut impl Write) -> io::Result<()> {
    let (points, polys) = (mesh.positions.len(), mesh.triangles.len());
    writeln!(out, r#"<?xml version="1.0"?>"#)?;
    writeln!(out, r#"<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian">"#)?;
    writeln!(out, r#"<PolyData><Piece NumberOfPoints="{points}" NumberOfPolys="{polys}">"#)?;
    writeln!(out, r#"<PointData Normals="normals">"#)?;
    writeln!(out, r#"<DataArray type="Float64" Name="normals" NumberOfComponents="3" format="ascii">"#)?;
    for n in &mesh.normals {
        writeln!(out, "{} {} {}", n.x, n.y, n.z)?;
    }
    writeln!(out, "</DataArray></PointData>\n<Points>")?;
    writeln!(out, r#"<DataArray type="Float64" Name="points" NumberOfComponents="3" format="ascii">"#)?;
    for p in &mesh.positions {
        writeln!(out, "{} {} {}", p.x, p.y, p.z)?;
    }
    writeln!(out, "</DataArray></Points>\n<Polys>")?;
    writeln!(out, r#"<DataArray type="Int32" Name="connectivity" format="ascii">"#)?;
    for [a, b, c] in &mesh.triangles {
        writeln!(out, "{a} {b} {c}")?;
    }
    writeln!(out, r#"</DataArray><DataArray type="Int32" Name="offsets" format="ascii">"#)?;
    for index in 1..=polys {
        writeln!(out, "{}", 3 * index)?;
    }
    writeln!(out, "</DataArray></Polys></Piece></PolyData></VTKFile>")
}
