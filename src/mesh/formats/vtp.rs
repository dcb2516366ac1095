//! VTK polygonal data (`.vtp`) as text, for ParaView.
//!
//! Invariant: every number is written with the fewest digits that read back to the same `f64`.

use std::io::{self, Write};

use super::super::Mesh;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::pawn_mesh;

    #[test]
    fn vtp_text_counts_agree() {
        let mesh = pawn_mesh();
        let mut bytes = Vec::new();
        write(&mesh, &mut bytes).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let document = roxmltree::Document::parse(&text).unwrap();
        let piece = document.descendants().find(|n| n.has_tag_name("Piece")).unwrap();
        let count = |name: &str| piece.attribute(name).unwrap().parse::<usize>().unwrap();
        assert_eq!(
            (count("NumberOfPoints"), count("NumberOfPolys")),
            (mesh.positions.len(), mesh.triangles.len())
        );
        let array = |name: &str| -> Vec<f64> {
            let found = piece.descendants().find(|n| n.attribute("Name") == Some(name)).unwrap();
            found.text().unwrap().split_whitespace().map(|n| n.parse().unwrap()).collect()
        };
        let flat: Vec<f64> = mesh.positions.iter().flat_map(|p| p.to_array()).collect();
        assert_eq!(array("points"), flat);
        assert_eq!(array("normals").len(), flat.len());
        let indices: Vec<f64> = mesh.triangles.iter().flatten().map(|&v| f64::from(v)).collect();
        assert_eq!(array("connectivity"), indices);
        assert_eq!(array("offsets").last(), Some(&(3.0 * mesh.triangles.len() as f64)));
    }
}
