//! 3MF, for printers: a zip archive with the triangles as XML, which states their unit.
//!
//! Invariant: every number is written with the fewest digits that read back to the same `f64`, but for what
//! rounding has left of zeros. Equal meshes give equal bytes, because the archive holds no date.

use std::io::{self, Cursor, Write};

use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

use super::super::Mesh;
use super::format::{Format, places};
use super::unit::LengthUnit;

const CONTENT_TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>
"#;

const RELATIONSHIPS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Target="/3D/3dmodel.model" Id="model" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>
"#;

/// The entry of the table of formats.
pub const FORMAT: Format = Format {
    ending: "3mf",
    purpose: "For printers",
    only_metres: false,
    single: false,
    write,
    write_text: None,
};

/// Writes a mesh as 3MF. A mesh without triangles becomes a model without objects.
///
/// # Errors
/// Those of the stream.
pub fn write(mesh: &Mesh, unit: LengthUnit, out: &mut dyn Write) -> io::Result<()> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for (name, text) in [("[Content_Types].xml", CONTENT_TYPES), ("_rels/.rels", RELATIONSHIPS)] {
        archive.start_file(name, options)?;
        archive.write_all(text.as_bytes())?;
    }
    archive.start_file("3D/3dmodel.model", options.large_file(mesh.triangles.len() > 1 << 25))?;
    model(mesh, unit, &mut io::BufWriter::new(&mut archive))?;
    out.write_all(archive.finish()?.get_ref())
}

fn model(mesh: &Mesh, unit: LengthUnit, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, r#"<?xml version="1.0" encoding="UTF-8"?>"#)?;
    write!(out, r#"<model unit="{}" xml:lang="en-US" "#, unit.in_3mf)?;
    writeln!(out, r#"xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>"#)?;
    let is_empty = mesh.triangles.is_empty();
    if !is_empty {
        writeln!(out, r#"<object id="1" type="model"><mesh><vertices>"#)?;
        for p in places(mesh, unit) {
            writeln!(out, r#"<vertex x="{}" y="{}" z="{}"/>"#, p.x, p.y, p.z)?;
        }
        writeln!(out, "</vertices><triangles>")?;
        for [a, b, c] in &mesh.triangles {
            writeln!(out, r#"<triangle v1="{a}" v2="{b}" v3="{c}"/>"#)?;
        }
        writeln!(out, "</triangles></mesh></object>")?;
    }
    let item = if is_empty { "" } else { r#"<item objectid="1"/>"# };
    writeln!(out, "</resources><build>{item}</build></model>")?;
    out.flush()
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;
    use crate::mesh::tests::pawn_mesh;

    fn part(bytes: &[u8], name: &str) -> String {
        let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
        let mut text = String::new();
        archive.by_name(name).unwrap().read_to_string(&mut text).unwrap();
        text
    }

    #[test]
    fn threemf_reads_back() {
        let mesh = pawn_mesh();
        let mut bytes = Vec::new();
        write(&mesh, LengthUnit::METRE, &mut bytes).unwrap();
        // from the package's root to the model, as a reader does
        let relations = part(&bytes, "_rels/.rels");
        let relations = roxmltree::Document::parse(&relations).unwrap();
        let target = relations.descendants().find_map(|n| n.attribute("Target")).unwrap();
        let model = part(&bytes, target.trim_start_matches('/'));
        let types = part(&bytes, "[Content_Types].xml");
        assert!(roxmltree::Document::parse(&types).is_ok());
        let model = roxmltree::Document::parse(&model).unwrap();
        assert_eq!(model.root_element().attribute("unit"), Some("meter"));
        let rows = |tag: &str, names: [&str; 3]| -> Vec<[f64; 3]> {
            let found = model.descendants().filter(|n| n.has_tag_name(tag));
            let found = found.map(|n| names.map(|name| n.attribute(name).unwrap().parse().unwrap()));
            found.collect()
        };
        let model_name = ("http://schemas.microsoft.com/3dmanufacturing/core/2015/02", "model");
        assert!(model.root_element().has_tag_name(model_name));
        let positions: Vec<[f64; 3]> = places(&mesh, LengthUnit::METRE).map(|p| p.to_array()).collect();
        assert_eq!(rows("vertex", ["x", "y", "z"]), positions);
        let triangles: Vec<[f64; 3]> = mesh.triangles.iter().map(|t| t.map(f64::from)).collect();
        assert_eq!(rows("triangle", ["v1", "v2", "v3"]), triangles);
    }

    #[test]
    fn nothing_is_a_model_without_objects() {
        let mut bytes = Vec::new();
        write(&Mesh::default(), LengthUnit::MILLIMETRE, &mut bytes).unwrap();
        let model = part(&bytes, "3D/3dmodel.model");
        let model = roxmltree::Document::parse(&model).unwrap();
        assert_eq!(model.root_element().attribute("unit"), Some("millimeter"));
        assert!(!model.descendants().any(|n| n.tag_name().name() == "object"));
    }
}
