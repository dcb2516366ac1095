//! What every format of meshes has: a name, a line of help and a writer.

use std::io::{self, Write};

use glam::DVec3;

use super::super::Mesh;
use super::unit::LengthUnit;

/// A file format for meshes.
#[derive(Debug, Clone, Copy)]
pub struct Format {
    /// The ending of its files, in lower case and without the dot. It is also the format's name.
    pub ending: &'static str,
    /// What the format holds or is for, as one line of help.
    pub purpose: &'static str,
    /// Whether its numbers are always metres.
    pub only_metres: bool,
    /// Whether coordinates are rounded to single precision.
    pub single: bool,
    /// Writes a mesh in this format.
    pub write: WriteMesh,
    /// Writes a mesh as text, if the format has a text form beside its binary one.
    pub write_text: Option<WriteMesh>,
}

/// Writes a mesh to a stream, in a unit. Its errors are those of the stream, the limits of the format, and
/// [`io::ErrorKind::InvalidInput`] for another unit than metres if the format has no other.
pub type WriteMesh = fn(&Mesh, LengthUnit, &mut dyn Write) -> io::Result<()>;

/// Coordinates below this part of the largest one are rounding, and zero.
const ROUNDING: f64 = 1e-15;

/// The vertices of a mesh in a unit, as text has them: what rounding has left of a zero is 0, without a sign.
pub(super) fn places(mesh: &Mesh, unit: LengthUnit) -> impl Iterator<Item = DVec3> {
    let largest = mesh.positions.iter().fold(0.0_f64, |most, p| most.max(p.abs().max_element()));
    mesh.positions.iter().map(move |p| unit.per_metre * without_rounding(*p, largest))
}

/// A vector whose components are zero where they are rounding beside the largest one of its kind.
pub(super) fn without_rounding(v: DVec3, largest: f64) -> DVec3 {
    v.map(|c| if c.abs() < ROUNDING * largest { 0.0 } else { c + 0.0 })
}

/// Refuses another unit than metres for a format that knows no other.
pub(super) fn in_metres(unit: LengthUnit) -> io::Result<()> {
    if unit == LengthUnit::METRE {
        return Ok(());
    }
    Err(io::Error::new(
        io::ErrorKind::InvalidInput,
        format!("the format is in metres, not in {}", unit.plural),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_rounding_leaves_of_zero_is_zero_in_every_text() {
        let corners = vec![DVec3::new(0.03, -0.0, -5.4e-20), DVec3::new(0.0, 1e-12, 0.0), DVec3::X * 0.01];
        let mesh = Mesh::from_triangles(corners, vec![[0, 1, 2]]);
        let found: Vec<[String; 3]> =
            places(&mesh, LengthUnit::MILLIMETRE).map(|p| p.to_array().map(|c| c.to_string())).collect();
        // what is small and no rounding stays
        assert_eq!(found, [["30", "0", "0"], ["0", "0.000000001", "0"], ["10", "0", "0"]]);
    }
}
