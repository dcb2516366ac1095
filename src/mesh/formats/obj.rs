//! Wavefront OBJ, as text.
//!
//! Vertices are shared, so programs see a closed mesh; normals have numbers of their own, as the format
//! provides and Blender and Assimp write them: that is what modellers, MeshLab and viewers of the web read.
//! Programs with one normal for a vertex do something else at creases: VTK makes a point of each corner,
//! trimesh one of each normal unless `maintain_order` is set, and meshio refuses the file. PLY has one normal
//! for a vertex, and is closed for all of them.
//!
//! Invariant: every number is written with the fewest digits that read back to the same `f64`, but for what
//! rounding has left of zeros.

use std::io::{self, Write};

use super::super::Mesh;
use super::creases::split_creases;
use super::format::{Format, places, without_rounding};
use super::unit::LengthUnit;

/// The entry of the table of formats.
pub const FORMAT: Format = Format {
    ending: "obj",
    purpose: "Shared vertices with normals of corners, text; meshio and others with one normal for a vertex read .ply",
    only_metres: false,
    single: false,
    write,
    write_text: None,
};

/// Writes a mesh as OBJ. A vertex at a crease has a normal for each of the faces that meet there.
///
/// # Errors
/// Those of the stream.
pub fn write(mesh: &Mesh, unit: LengthUnit, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "# rfm, {}, outward normals", unit.plural)?;
    for p in places(mesh, unit) {
        writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
    }
    let split = split_creases(mesh);
    for n in split.normals.iter().map(|n| without_rounding(*n, 1.0)) {
        writeln!(out, "vn {} {} {}", n.x, n.y, n.z)?;
    }
    for (places, normals) in mesh.triangles.iter().zip(&split.triangles) {
        let ([a, b, c], [k, l, m]) = (places.map(|v| v + 1), normals.map(|v| v + 1));
        writeln!(out, "f {a}//{k} {b}//{l} {c}//{m}")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::mesh::tests::pawn_mesh;

    #[test]
    fn numbers_are_in_the_unit_that_is_asked_for() {
        let mesh = Mesh::from_triangles(vec![DVec3::new(0.5, 0.25, 0.127); 3], vec![[0, 1, 2]]);
        for (unit, expected) in [
            ("m", "v 0.5 0.25 0.127"),
            ("mm", "v 500 250 127"),
            ("in", "v 19.68503937007874 9.84251968503937 5\n"),
        ] {
            let mut text = Vec::new();
            write(&mesh, LengthUnit::named(unit).unwrap(), &mut text).unwrap();
            let text = String::from_utf8(text).unwrap();
            assert!(text.contains(expected), "{text}");
        }
    }

    #[test]
    fn obj_text_reads_back_exactly() {
        let mesh = pawn_mesh();
        let mut bytes = Vec::new();
        write(&mesh, LengthUnit::METRE, &mut bytes).unwrap();
        let load = tobj::load_obj_buf(&mut &bytes[..], &tobj::LoadOptions::default(), |_| {
            Ok((Vec::new(), Default::default()))
        });
        let (models, _) = load.unwrap();
        let [model] = &models[..] else { panic!("{} models", models.len()) };
        // the reader numbers vertices in the order of faces
        let corner = |flat: &[f64], index: u32| DVec3::from_slice(&flat[3 * index as usize..]);
        assert_eq!(model.mesh.indices.len(), 3 * mesh.triangles.len());
        let written: Vec<DVec3> = places(&mesh, LengthUnit::METRE).collect();
        assert!(written.iter().zip(&mesh.positions).all(|(p, q)| p.distance(*q) < 1e-14));
        let split = split_creases(&mesh);
        assert!(split.normals.len() > mesh.normals.len(), "the pawn has creases");
        for (i, v) in mesh.triangles.iter().flatten().enumerate() {
            let (place, normal) = (model.mesh.indices[i], model.mesh.normal_indices[i]);
            assert_eq!(corner(&model.mesh.positions, place), written[*v as usize]);
            let own = split.normals[split.triangles[i / 3][i % 3] as usize];
            assert_eq!(corner(&model.mesh.normals, normal), without_rounding(own, 1.0));
        }
    }
}
