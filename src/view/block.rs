//! Frames and meshes as blocks of bytes.

use glam::DVec3;
use serde::Serialize;

use super::levels::{Lattice, Levels};
use crate::geom::Aabb;
use crate::mesh::Mesh;

/// An instant of the particles in few bits.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Frame {
    /// The sites of the particles on a [`Lattice`].
    pub sites: Vec<[u16; 3]>,
    /// For each array the levels of the particles on its [`Levels`].
    pub levels: Vec<Vec<u8>>,
}

impl Frame {
    /// The frame of particles at these places, with numbers of one array each, and the ranges of the arrays.
    pub fn of(
        lattice: &Lattice,
        places: impl Iterator<Item = DVec3>,
        arrays: &[&[f64]],
    ) -> (Self, Vec<Levels>) {
        let range =
            |values: &[f64]| Levels::of(values.iter().copied()).unwrap_or(Levels { low: 0.0, high: 0.0 });
        let ranges: Vec<Levels> = arrays.iter().map(|values| range(values)).collect();
        let levels = |(values, range): (&&[f64], &Levels)| values.iter().map(|v| range.level(*v)).collect();
        let levels = arrays.iter().zip(&ranges).map(levels).collect();
        (Self { sites: places.map(|place| lattice.site(place)).collect(), levels }, ranges)
    }
}

/// What the head of a frame says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrameHead {
    /// The simulated time, s.
    pub time: f64,
    /// The number of steps, if it is known.
    pub step: Option<u64>,
    /// The range of each array.
    pub ranges: Vec<Levels>,
    /// The number of the obstacles' mesh at this time, in the order in which meshes are given.
    pub mesh: Option<usize>,
    /// Where each of its parts is, as the columns of its rotation and its translation, m; empty if the mesh lies right.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub poses: Vec<[f64; 12]>,
    /// The number of the fluid's surface at this time, in the order in which surfaces are given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<usize>,
    /// The number of the run that the frame belongs to; a page that hears of a new run forgets frames of
    /// older ones.
    pub run: u64,
    /// How numbers follow from velocities; `None` if they are stated without.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<Motion>,
}

impl FrameHead {
    /// The head of a frame of no particles at a time, s, without meshes.
    pub fn at(time: f64) -> Self {
        Self {
            time,
            step: None,
            ranges: Vec::new(),
            mesh: None,
            poses: Vec::new(),
            surface: None,
            run: 0,
            motion: None,
        }
    }
}

/// How the numbers of a frame follow from velocities, so that only what is left of them must be stated.
///
/// A particle is expected where the mean of its velocities, in the frame before and in this one, takes it. Its speed is
/// expected to be the length of its velocity. Both are found from levels alone, by operations that every browser rounds
/// alike.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Motion {
    /// The numbers of the arrays of velocities.
    pub velocity: [usize; 3],
    /// The number of the array of speeds.
    pub speed: Option<usize>,
    /// Steps of the lattice along each axis for 1 m/s in each of both frames.
    pub steps: [f64; 3],
}

impl Motion {
    /// The velocities of a frame along an axis, m/s.
    fn velocities<'a>(
        &self,
        axis: usize,
        ranges: &'a [Levels],
        frame: &'a Frame,
    ) -> impl Iterator<Item = f64> + 'a {
        let k = self.velocity[axis];
        frame.levels[k].iter().map(move |level| ranges[k].value(*level))
    }

    /// By how many steps particles are expected to have moved along an axis.
    fn shifts<'a>(
        &'a self,
        axis: usize,
        ranges: &'a [Levels],
        [before, now]: [&'a Frame; 2],
    ) -> impl Iterator<Item = u16> + 'a {
        let both = self.velocities(axis, ranges, before).zip(self.velocities(axis, ranges, now));
        // whole numbers of steps around the lattice do not count
        both.map(move |(then, now)| (self.steps[axis] * (then + now) + 0.5).floor() as i64 as u16)
    }

    /// The levels of the speeds that are expected, with the range of their array.
    fn speeds<'a>(
        &'a self,
        range: Levels,
        ranges: &'a [Levels],
        frame: &'a Frame,
    ) -> impl Iterator<Item = u8> + 'a {
        let [x, y, z] = [0, 1, 2].map(|axis| self.velocities(axis, ranges, frame));
        x.zip(y).zip(z).map(move |((x, y), z)| range.level_below((x * x + y * y + z * z).sqrt()))
    }
}

#[derive(Serialize)]
struct Head<'a, T> {
    kind: &'static str,
    count: usize,
    /// Whether numbers are differences from the frame before.
    follows: bool,
    #[serde(flatten)]
    rest: &'a T,
}

/// The block of a frame. If `before` has as many particles, numbers are differences from it: the reader of
/// the block must have it. Its ranges must be those of the head if the head has a [`Motion`].
pub fn pack_frame(head: &FrameHead, frame: &Frame, before: Option<&Frame>) -> Vec<u8> {
    let fits = |before: &&Frame| {
        before.sites.len() == frame.sites.len() && before.levels.len() == frame.levels.len()
    };
    let before = before.filter(fits);
    let count = frame.sites.len();
    let FrameHead { motion, ranges, .. } = head;
    let head = Head { kind: "frame", count, follows: before.is_some(), rest: head };
    let mut out = begin(&head);
    out.reserve(count * (6 + frame.levels.len()));
    for axis in 0..3 {
        let differences: Vec<u16> = match before {
            Some(before) => {
                let pairs = frame.sites.iter().zip(&before.sites);
                let moved = pairs.map(|(now, then)| now[axis].wrapping_sub(then[axis]));
                match &motion {
                    Some(motion) => {
                        let shifts = motion.shifts(axis, ranges, [before, frame]);
                        moved.zip(shifts).map(|(moved, shift)| folded(moved.wrapping_sub(shift))).collect()
                    }
                    None => moved.map(folded).collect(),
                }
            }
            None => frame.sites.iter().map(|site| site[axis]).collect(),
        };
        planes(&mut out, &differences);
    }
    for (k, levels) in frame.levels.iter().enumerate() {
        if let Some(motion) = motion.as_ref().filter(|motion| motion.speed == Some(k)) {
            let expected = motion.speeds(ranges[k], ranges, frame);
            out.extend(levels.iter().zip(expected).map(|(level, expected)| level.wrapping_sub(expected)));
            continue;
        }
        match before {
            Some(before) => {
                out.extend(levels.iter().zip(&before.levels[k]).map(|(now, then)| now.wrapping_sub(*then)));
            }
            None => out.extend(levels),
        }
    }
    out
}

/// What a mesh is that of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshRole {
    /// Obstacles, or a solid alone.
    Solids,
    /// Obstacles that are where frames say, besides others of one instant alone.
    Carried,
}

/// What the head of a mesh says.
#[derive(Serialize)]
struct MeshHead {
    triangles: usize,
    /// The numbers of triangles of its parts, which are one after the other.
    parts: Vec<usize>,
    min: [f64; 3],
    max: [f64; 3],
    time: f64,
    run: u64,
}

/// The block of a mesh: positions and normals with 16 bits for each coordinate, then the corners of
/// triangles. `time` is the instant at which what moves stands so, s, and `run` the number of the run that
/// the mesh belongs to.
pub fn pack_mesh(mesh: &Mesh, time: f64, run: u64) -> Vec<u8> {
    pack_parts(std::slice::from_ref(mesh), MeshRole::Solids, time, run)
}

/// The block of a mesh of several parts, as [`pack_mesh`]. A frame may say where each of them is.
pub fn pack_parts(parts: &[Mesh], role: MeshRole, time: f64, run: u64) -> Vec<u8> {
    let mesh = Mesh::joined(parts);
    let bounds = mesh.positions.iter().fold(Aabb::EMPTY, |all, p| all.including(*p));
    let bounds = if mesh.positions.is_empty() { Aabb::new(DVec3::ZERO, DVec3::ONE) } else { bounds };
    let lattice = Lattice::new(&bounds);
    let (min, max) = (lattice.bounds().min.to_array(), lattice.bounds().max.to_array());
    let parts = parts.iter().map(|part| part.triangles.len()).collect();
    let rest = MeshHead { triangles: mesh.triangles.len(), parts, min, max, time, run };
    let kind = match role {
        MeshRole::Solids => "mesh",
        MeshRole::Carried => "carried",
    };
    let head = Head { kind, count: mesh.positions.len(), follows: false, rest: &rest };
    let mut out = begin(&head);
    let unit = Lattice::new(&Aabb::new(DVec3::NEG_ONE, DVec3::ONE));
    for (lattice, vectors) in [(lattice, &mesh.positions), (unit, &mesh.normals)] {
        let sites: Vec<[u16; 3]> = vectors.iter().map(|v| lattice.site(*v)).collect();
        for axis in 0..3 {
            planes(&mut out, &differences(sites.iter().map(|site| site[axis])));
        }
    }
    // corners are near each other, and the first of a triangle is near that of the triangle before
    let mut last = 0u32;
    let corners: Vec<u32> = mesh
        .triangles
        .iter()
        .flatten()
        .map(|&corner| {
            let difference = corner.wrapping_sub(std::mem::replace(&mut last, corner));
            (difference << 1) ^ ((difference as i32 >> 31) as u32)
        })
        .collect();
    for byte in 0..4 {
        out.extend(corners.iter().map(|corner| (corner >> (8 * byte)) as u8));
    }
    out
}

/// What the head of a slice says: ω on a grid of nodes in a plane across an axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SliceHead {
    /// The number of the axis that the plane lies across.
    pub axis: usize,
    /// The plane's coordinate on it, m.
    pub at: f64,
    /// Nodes from left to right: along y where the axis is x, along x otherwise.
    pub columns: usize,
    /// Nodes upwards: along y where the axis is z, along z otherwise.
    pub rows: usize,
    /// The lower left node in the plane, m.
    pub min: [f64; 2],
    /// The upper right node, m.
    pub max: [f64; 2],
    /// The levels of the isolines, ascending; 0 is one of them.
    pub levels: Vec<f64>,
    /// The number of the run that the slice belongs to.
    pub run: u64,
}

/// The block of a slice: ω at its nodes in single precision, row by row from below.
pub fn pack_slice(head: &SliceHead, omega: &[f64]) -> Vec<u8> {
    let mut out = begin(&Head { kind: "slice", count: omega.len(), follows: false, rest: head });
    for byte in 0..4 {
        out.extend(omega.iter().map(|w| (*w as f32).to_le_bytes()[byte]));
    }
    out
}

pub(super) fn begin(head: &impl Serialize) -> Vec<u8> {
    // numbers, names and texts: all of it has a form in JSON
    let head = serde_json::to_vec(head).unwrap_or_default();
    let mut out = (head.len() as u32).to_le_bytes().to_vec();
    out.extend(head);
    out
}

/// A difference with its sign in the lowest bit, so that small ones of either sign are small numbers.
fn folded(difference: u16) -> u16 {
    (difference << 1) ^ ((difference as i16 >> 15) as u16)
}

/// The differences of numbers from those before them.
pub(super) fn differences(numbers: impl Iterator<Item = u16>) -> Vec<u16> {
    let mut last = 0;
    numbers.map(|now| folded(now.wrapping_sub(std::mem::replace(&mut last, now)))).collect()
}

/// The low bytes of all numbers, then the high ones.
pub(super) fn planes(out: &mut Vec<u8>, numbers: &[u16]) {
    out.extend(numbers.iter().map(|x| *x as u8));
    out.extend(numbers.iter().map(|x| (x >> 8) as u8));
}
