//! Binary glTF 2.0, for viewers and game engines: one mesh of indexed triangles with normals, all in `f32`, and a plain
//! material. Vertices at creases are doubled, so that edges look sharp.
//!
//! glTF has y up. The one node of the file is turned so that our z points up there.
//!
//! Invariant: a mesh without triangles becomes a file without a scene, because glTF knows no empty mesh.

use std::io::{self, Write};

use glam::Vec3;
use serde_json::{Value, json};

use super::super::Mesh;
use super::creases::split_creases;
use super::format::{Format, in_metres};
use super::unit::LengthUnit;

const MAGIC: &[u8; 4] = b"glTF";
const VERSION: u32 = 2;
/// glTF's numbers for what is in a buffer.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// The entry of the table of formats.
pub const FORMAT: Format = Format {
    ending: "glb",
    purpose: "For viewers and browsers",
    only_metres: true,
    single: true,
    write,
    write_text: None,
};

/// Writes a mesh as GLB, in metres as glTF demands.
///
/// # Errors
/// Those of the stream, and [`io::ErrorKind::FileTooLarge`] beyond the 4 GiB of the format.
pub fn write(mesh: &Mesh, unit: LengthUnit, out: &mut dyn Write) -> io::Result<()> {
    in_metres(unit)?;
    let mesh = &split_creases(mesh);
    let mut binary = Vec::with_capacity(24 * mesh.positions.len() + 12 * mesh.triangles.len());
    for vectors in [&mesh.positions, &mesh.normals] {
        binary.extend(vectors.iter().flat_map(|v| v.as_vec3().to_array()).flat_map(f32::to_le_bytes));
    }
    binary.extend(mesh.triangles.iter().flatten().flat_map(|v| v.to_le_bytes()));
    let mut text = document(mesh).to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let too_large = |_| io::Error::from(io::ErrorKind::FileTooLarge);
    let length = |bytes: usize| u32::try_from(bytes).map_err(too_large);
    let has_binary = !binary.is_empty();

    out.write_all(MAGIC)?;
    out.write_all(&VERSION.to_le_bytes())?;
    let binary_chunk = if has_binary { 8 + binary.len() } else { 0 };
    out.write_all(&length(12 + 8 + text.len() + binary_chunk)?.to_le_bytes())?;
    chunk(out, b"JSON", &text, length(text.len())?)?;
    if has_binary {
        chunk(out, b"BIN\0", &binary, length(binary.len())?)?;
    }
    Ok(())
}

fn chunk(out: &mut dyn Write, kind: &[u8; 4], data: &[u8], length: u32) -> io::Result<()> {
    out.write_all(&length.to_le_bytes())?;
    out.write_all(kind)?;
    out.write_all(data)
}

fn document(mesh: &Mesh) -> Value {
    let asset = json!({ "version": "2.0", "generator": "rfm" });
    if mesh.triangles.is_empty() {
        return json!({ "asset": asset });
    }
    let (vertices, indices) = (mesh.positions.len(), 3 * mesh.triangles.len());
    let rounded = || mesh.positions.iter().map(|p| p.as_vec3());
    let (min, max) =
        (rounded().fold(Vec3::INFINITY, Vec3::min), rounded().fold(Vec3::NEG_INFINITY, Vec3::max));
    let half_turn = std::f32::consts::FRAC_1_SQRT_2;
    json!({
        "asset": asset,
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "rotation": [-half_turn, 0.0, 0.0, half_turn] }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "NORMAL": 1 }, "indices": 2, "material": 0 }] }],
        // the grey of our own pictures, without gloss
        "materials": [{
            "name": "stone",
            "pbrMetallicRoughness": { "baseColorFactor": [0.6, 0.55, 0.48, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8 },
        }],
        "buffers": [{ "byteLength": 24 * vertices + 4 * indices }],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 12 * vertices, "target": ARRAY_BUFFER },
            { "buffer": 0, "byteOffset": 12 * vertices, "byteLength": 12 * vertices, "target": ARRAY_BUFFER },
            { "buffer": 0, "byteOffset": 24 * vertices, "byteLength": 4 * indices, "target": ELEMENT_ARRAY_BUFFER },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": FLOAT, "count": vertices, "type": "VEC3",
              "min": min.to_array(), "max": max.to_array() },
            { "bufferView": 1, "componentType": FLOAT, "count": vertices, "type": "VEC3" },
            { "bufferView": 2, "componentType": UNSIGNED_INT, "count": indices, "type": "SCALAR" },
        ],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::pawn_mesh;

    #[test]
    fn glb_reads_back() {
        let mesh = pawn_mesh();
        let mut bytes = Vec::new();
        write(&mesh, LengthUnit::METRE, &mut bytes).unwrap();
        let creased = pawn_mesh().positions.len();
        let mesh = split_creases(&mesh);
        assert!(mesh.positions.len() > creased, "the pawn has creases");
        // the reader validates the whole document
        let read = gltf::Gltf::from_slice(&bytes).unwrap();
        let binary = read.blob.clone().unwrap();
        let primitive = read.meshes().next().unwrap().primitives().next().unwrap();
        let reader = primitive.reader(|_| Some(&binary));
        let positions: Vec<Vec3> = reader.read_positions().unwrap().map(Vec3::from).collect();
        assert!(positions.iter().zip(&mesh.positions).all(|(found, p)| *found == p.as_vec3()));
        let normals: Vec<Vec3> = reader.read_normals().unwrap().map(Vec3::from).collect();
        assert!(normals.iter().zip(&mesh.normals).all(|(found, n)| *found == n.as_vec3()));
        assert_eq!((positions.len(), normals.len()), (mesh.positions.len(), mesh.positions.len()));
        let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
        assert_eq!(indices, mesh.triangles.concat());
        assert_eq!(primitive.material().pbr_metallic_roughness().metallic_factor(), 0.0);
        // z points up, to y
        let (_, rotation, _) = read.nodes().next().unwrap().transform().decomposed();
        let up = glam::Quat::from_array(rotation) * Vec3::Z;
        assert!(up.distance(Vec3::Y) < 1e-6, "{up}");
    }

    #[test]
    fn nothing_is_a_file_without_a_scene() {
        let mut bytes = Vec::new();
        write(&Mesh::default(), LengthUnit::METRE, &mut bytes).unwrap();
        assert!(write(&Mesh::default(), LengthUnit::MILLIMETRE, &mut Vec::new()).is_err());
        assert_eq!(gltf::Gltf::from_slice(&bytes).unwrap().meshes().count(), 0);
    }
}
