//! Frames for ParaView: VTK PolyData with appended raw data, and the collection that lists the frames in
//! time.
//!
//! Invariant: particles are written in the order of their ids, little-endian, as 32-bit floats, which are
//! enough for a picture; places far from the origin as 64-bit floats. The same state gives the same bytes.

use std::io::{self, Write};

use super::particles::{Particles, Vectors};
use crate::geom::Aabb;

/// Writes one frame: the positions of the particles (m) and, for each, speed (m/s), velocity (m/s), density
/// (kg/m³), pressure (Pa) and id.
///
/// # Errors
/// Errors of the writer.
pub fn write_vtp(out: &mut impl Write, particles: &Particles) -> io::Result<()> {
    let order = particles.order_by_id();
    let n = order.len();
    let scalar = |values: &[f64]| floats(order.iter().map(|&i| values[i]));
    let vector = |v: &Vectors| floats(order.iter().flat_map(|&i| v.get(i).to_array()));
    let speed = floats(order.iter().map(|&i| particles.velocity.get(i).length()));
    let ids = order.iter().flat_map(|&i| particles.id[i].to_le_bytes()).collect();
    let counting = |from: i64| (from..from + n as i64).flat_map(i64::to_le_bytes).collect();

    let mut appended = Appended::default();
    let point_data = [
        appended.array("speed", "Float32", 1, speed),
        appended.array("velocity", "Float32", 3, vector(&particles.velocity)),
        appended.array("density", "Float32", 1, scalar(&particles.density)),
        appended.array("pressure", "Float32", 1, scalar(&particles.pressure)),
        appended.array("id", "UInt32", 1, ids),
    ]
    .concat();
    let points = if are_enough(&particles.position) {
        appended.array("position", "Float32", 3, vector(&particles.position))
    } else {
        let places = order.iter().flat_map(|&i| particles.position.get(i).to_array());
        appended.array("position", "Float64", 3, places.flat_map(f64::to_le_bytes).collect())
    };
    // one vertex cell per point, so that a viewer shows them without a filter
    let cells = [
        appended.array("connectivity", "Int64", 1, counting(0)),
        appended.array("offsets", "Int64", 1, counting(1)),
    ]
    .concat();

    write!(
        out,
        r#"<?xml version="1.0"?>
<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<PolyData>
<Piece NumberOfPoints="{n}" NumberOfVerts="{n}" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="0">
<PointData Scalars="speed" Vectors="velocity">
{point_data}</PointData>
<Points>
{points}</Points>
<Verts>
{cells}</Verts>
</Piece>
</PolyData>
<AppendedData encoding="raw">
_"#
    )?;
    out.write_all(&appended.bytes)?;
    out.write_all(b"\n</AppendedData>\n</VTKFile>\n")
}

/// The largest rounding of places that is not visible, as a part of the distance between particles that fill
/// the box around them.
const UNSEEN: f64 = 1e-3;

/// Whether 32-bit floats are enough for places: they are not for particles that are much closer to one
/// another than to the origin.
fn are_enough(places: &Vectors) -> bool {
    let within = places.iter().fold(Aabb::EMPTY, |within, p| within.union(&Aabb::new(p, p)));
    if within.is_empty() || !within.is_finite() {
        return true;
    }
    let farthest = within.min.abs().max(within.max.abs()).max_element();
    let apart = within.size().max_element() / (places.len() as f64).cbrt();
    // all in one place
    apart == 0.0 || 0.5 * f64::from(f32::EPSILON) * farthest <= UNSEEN * apart
}

/// Writes the collection of frames: the time (s) and the file name of each.
///
/// # Errors
/// Errors of the writer.
pub fn write_pvd<'a>(
    out: &mut impl Write,
    frames: impl IntoIterator<Item = (f64, &'a str)>,
) -> io::Result<()> {
    writeln!(out, r#"<?xml version="1.0"?>"#)?;
    writeln!(out, r#"<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">"#)?;
    writeln!(out, "<Collection>")?;
    for (time, file) in frames {
        let file = file.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
        writeln!(out, r#"<DataSet timestep="{}" part="0" file="{file}"/>"#, short_time(time))?;
    }
    writeln!(out, "</Collection>\n</VTKFile>")
}

/// A time rounded to twelve digits: the sum of many steps is 0.04999999999999996 where 0.05 is meant.
pub fn short_time(time: f64) -> f64 {
    format!("{time:.11e}").parse().unwrap_or(time)
}

/// The raw block that follows the document: for each array its length in bytes (u64), then its bytes.
#[derive(Default)]
struct Appended {
    bytes: Vec<u8>,
}

impl Appended {
    /// Stores an array and returns the element that describes it.
    fn array(&mut self, name: &str, kind: &str, components: usize, data: Vec<u8>) -> String {
        let offset = self.bytes.len();
        self.bytes.extend((data.len() as u64).to_le_bytes());
        self.bytes.extend(data);
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" \
             format=\"appended\" offset=\"{offset}\"/>\n"
        )
    }
}

fn floats(values: impl Iterator<Item = f64>) -> Vec<u8> {
    values.flat_map(|x| (x as f32).to_le_bytes()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// The raw bytes of a named array of a frame.
    fn read_array<'a>(frame: &'a [u8], name: &str) -> &'a [u8] {
        let marker = b"<AppendedData encoding=\"raw\">\n_";
        let start = frame.windows(marker.len()).position(|w| w == marker).unwrap();
        let header = std::str::from_utf8(&frame[..start]).unwrap();
        let element = header.split("<DataArray ").find(|e| e.contains(&format!("Name=\"{name}\""))).unwrap();
        let offset: usize =
            element.split("offset=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap();
        let block = &frame[start + marker.len() + offset..];
        let length = u64::from_le_bytes(block[..8].try_into().unwrap()) as usize;
        &block[8..8 + length]
    }

    fn read_floats(frame: &[u8], name: &str) -> Vec<f32> {
        read_array(frame, name).chunks(4).map(|c| f32::from_le_bytes(c.try_into().unwrap())).collect()
    }

    #[test]
    fn a_frame_reads_back_in_the_order_of_ids() {
        let mut fluid = Particles::default();
        fluid.push(DVec3::new(1.0, 2.0, 3.0), DVec3::new(3.0, 4.0, 0.0));
        fluid.push(DVec3::new(-1.0, 0.5, 0.25), DVec3::ZERO);
        fluid.density = vec![1000.0, 500.0];
        fluid.pressure = vec![6.0, 0.0];
        fluid.id = vec![1, 0];
        let mut frame = Vec::new();
        write_vtp(&mut frame, &fluid).unwrap();
        assert_eq!(read_floats(&frame, "position"), [-1.0, 0.5, 0.25, 1.0, 2.0, 3.0]);
        assert_eq!(read_floats(&frame, "speed"), [0.0, 5.0]);
        assert_eq!(read_floats(&frame, "velocity"), [0.0, 0.0, 0.0, 3.0, 4.0, 0.0]);
        assert_eq!(read_floats(&frame, "density"), [500.0, 1000.0]);
        assert_eq!(read_floats(&frame, "pressure"), [0.0, 6.0]);
        assert_eq!(read_array(&frame, "id"), [0, 0, 0, 0, 1, 0, 0, 0]);
        assert_eq!(read_array(&frame, "offsets")[8], 2);
        assert!(frame.ends_with(b"</AppendedData>\n</VTKFile>\n"));
    }

    #[test]
    fn a_collection_lists_times_and_escaped_names() {
        let mut text = Vec::new();
        write_pvd(&mut text, [(0.0, "a.vtp"), (0.04 - 4e-17, "b&c.vtp")]).unwrap();
        let text = String::from_utf8(text).unwrap();
        assert!(text.contains(r#"<DataSet timestep="0" part="0" file="a.vtp"/>"#));
        assert!(text.contains(r#"<DataSet timestep="0.04" part="0" file="b&amp;c.vtp"/>"#));
        assert_eq!(text.matches("<DataSet").count(), 2);
    }

    #[test]
    fn places_far_from_the_origin_keep_their_digits() {
        let mut fluid = Particles::default();
        let places = [DVec3::new(1e7, 0.01, 0.0), DVec3::new(1e7 + 0.01, 0.0, 2.0)];
        for (number, place) in places.into_iter().enumerate() {
            fluid.push(place, DVec3::ZERO);
            fluid.id[number] = number as u32;
        }
        (fluid.density, fluid.pressure) = (vec![1e3; 2], vec![0.0; 2]);
        let mut frame = Vec::new();
        write_vtp(&mut frame, &fluid).unwrap();
        assert_eq!(crate::fluid_surface::read_points(&frame).unwrap(), places);
    }
}
