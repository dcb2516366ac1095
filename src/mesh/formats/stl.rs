//! STL: triangles with their own normals in `f32`, as binary records or as text.
//!
//! Invariant: normals are computed from the triangles in `f64`, before corners are rounded, so slivers keep a
//! direction. A triangle without area gets the zero normal, which readers take as "compute it". Different vertices have
//! different numbers, as far as a few steps of the last digit allow, because readers know vertices by their numbers
//! alone: a mesh that is closed and manifold is so in the file, unless it is too small and too far away for `f32`.

use std::io::{self, Write};

use glam::DVec3;
use rustc_hash::FxHashMap;

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
    let places = places(mesh, unit);
    for triangle in &mesh.triangles {
        let mut record = [0; 50];
        let numbers = facet(mesh, &places, *triangle).into_iter().flatten();
        for (bytes, number) in record.chunks_exact_mut(4).zip(numbers) {
            bytes.copy_from_slice(&number.to_le_bytes());
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
    let places = places(mesh, unit);
    for triangle in &mesh.triangles {
        let [[x, y, z], corners @ ..] = facet(mesh, &places, *triangle);
        writeln!(out, "facet normal {x:e} {y:e} {z:e}\nouter loop")?;
        for [x, y, z] in corners {
            writeln!(out, "vertex {x:e} {y:e} {z:e}")?;
        }
        writeln!(out, "endloop\nendfacet")?;
    }
    writeln!(out, "endsolid rfm")
}

/// The normal and the corners of a triangle.
fn facet(mesh: &Mesh, places: &[[f32; 3]], triangle: [u32; 3]) -> [[f32; 3]; 4] {
    let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
    let normal = unit((b - a).cross(c - a)).unwrap_or(DVec3::ZERO);
    let [a, b, c] = triangle.map(|v| places[v as usize]);
    [normal.as_vec3().to_array(), a, b, c]
}

/// The vertices in single precision. One that falls onto an earlier one is put as few steps of the last digit away as
/// are free, if it can be on the side on which it lies: triangles between the two then keep their directions.
fn places(mesh: &Mesh, length: LengthUnit) -> Vec<[f32; 3]> {
    let mut taken: FxHashMap<[u32; 3], usize> = FxHashMap::default();
    let mut places = Vec::with_capacity(mesh.positions.len());
    for (vertex, p) in mesh.positions.iter().enumerate() {
        // −0 is 0 for readers that compare numbers, and not for those that compare bits
        let rounded = (length.per_metre * *p).as_vec3().to_array().map(|c| c + 0.0);
        let earlier = taken.get(&rounded.map(f32::to_bits)).map(|&earlier| mesh.positions[earlier]);
        let place = match earlier.filter(|_| rounded.iter().all(|c| c.is_finite())) {
            None => rounded,
            Some(earlier) => {
                let mut free = beside(rounded, *p - earlier);
                free.find(|near| {
                    near.iter().all(|c| c.is_finite()) && !taken.contains_key(&near.map(f32::to_bits))
                })
                .unwrap_or(rounded)
            }
        };
        taken.entry(place.map(f32::to_bits)).or_insert(vertex);
        places.push(place);
    }
    places
}

/// The most steps of the last digit by which a vertex is moved.
const MOST_STEPS: u8 = 8;

/// The numbers near a place, the nearest ones first: a step of the last digit along the axis along which `towards`
/// is longest, on its side, then along the others, then on the other side; then two steps, and so on. A step is that
/// of the largest coordinate: smaller ones beside zero are lost in what readers do with them.
fn beside(place: [f32; 3], towards: DVec3) -> impl Iterator<Item = [f32; 3]> {
    let largest = place.iter().fold(0.0_f32, |largest, c| largest.max(c.abs())).max(f32::MIN_POSITIVE);
    let mut axes = [0, 1, 2];
    axes.sort_by(|&i, &j| towards[j].abs().total_cmp(&towards[i].abs()));
    let own = towards.to_array().map(|c| if c < 0.0 { -1.0 } else { 1.0 });
    (1..=MOST_STEPS).flat_map(move |steps| {
        [1.0, -1.0].into_iter().flat_map(move |side| {
            axes.into_iter().map(move |axis| {
                let mut near = place;
                near[axis] += side * own[axis] * f32::from(steps) * (largest.next_up() - largest);
                near
            })
        })
    })
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

    #[test]
    fn vertices_that_fall_together_in_single_precision_stay_apart() {
        // a tetrahedron two of whose corners differ in the ninth digit
        let corners = [[10.0, 1.0, 0.0], [10.0, 1.0 + 1e-9, 0.0], [11.0, 1.0, 0.0], [10.0, 1.0, 1.0]];
        let triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let mesh = Mesh::from_triangles(corners.map(DVec3::from_array).to_vec(), triangles);
        // and one whose corners coincide altogether, but for the sign of a zero
        let mut thin = mesh.clone();
        thin.positions[1] = DVec3::new(10.0, 1.0, -0.0);
        for (of, ascii) in [(&mesh, false), (&mesh, true), (&thin, false), (&thin, true)] {
            let mut bytes = Vec::new();
            let write = if ascii { write_ascii } else { write };
            write(of, LengthUnit::MILLIMETRE, &mut bytes).unwrap();
            let read = stl_io::read_stl(&mut std::io::Cursor::new(bytes)).unwrap();
            assert_eq!(read.vertices.len(), 4);
            assert!(
                read.faces.iter().all(|f| f.vertices[0] != f.vertices[1] && f.vertices[1] != f.vertices[2])
            );
            if std::ptr::eq(of, &mesh) {
                read.validate().unwrap(); // no triangle without area
            }
        }
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
