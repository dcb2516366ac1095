//! From crossed edges to triangles: each crossed edge gives a quad through the vertices of the four cells around it.
//!
//! A quad is cut along the diagonal that follows the surface better: at a crease the one along it. Where two vertices
//! would be joined by two edges of the mesh (see `loops`), each of these gets a vertex of its own in the middle, and
//! the quads there become fans around their hits.
//!
//! Invariant: the triangles of a quad, fans included, have its sides as their border, so the mesh is as closed and
//! manifold as the quads are.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;

use super::super::normals::{gradients, unit};
use super::bricks::{Brick, Hit};
use super::place::{Crossing, Kind, Placed, Vertex};
use crate::field::Field;

/// Vertices of the four cells around each crossed edge, by the edge's place in the cell.
pub(super) struct Quads {
    around: Vec<[u32; 4]>,
    /// Number of the first crossed edge of each brick.
    first: Vec<usize>,
    /// Vertices in the middle of sides that two quads would share with two others: by edge and ends.
    middles: BTreeMap<(u32, [u32; 2]), u32>,
}

/// A place without a vertex; only a field whose ranges contradict its values leaves one.
const NONE: u32 = u32::MAX;

/// Triangles, and vertices that they turn upside down.
#[derive(Default)]
pub(super) struct Cut {
    pub triangles: Vec<[u32; 3]>,
    pub spoilt: Vec<u32>,
    pub gradients: u64,
}

impl Quads {
    /// Collects all vertices in the order of bricks and joins them around their edges.
    pub fn join(bricks: &[Brick], placed: Vec<Placed>, vertices: &mut Vec<Vertex>) -> Self {
        let mut first = Vec::with_capacity(bricks.len());
        let mut count = 0;
        for brick in bricks {
            first.push(count);
            count += brick.hits.len();
        }
        let number = |at: Crossing| (first[at.slot as usize] + at.number as usize) as u32;
        let mut around = vec![[NONE; 4]; count];
        let mut twice = Vec::new();
        for part in placed {
            let base = vertices.len() as u32;
            for link in &part.links {
                around[number(link.crossing) as usize][usize::from(link.place)] = base + link.vertex;
            }
            twice.extend(part.twice.iter().map(|t| (t.segment.map(number), base + t.vertex)));
            vertices.extend(part.vertices);
        }
        twice.sort_unstable();
        let mut middles = BTreeMap::new();
        for pair in twice.chunk_by(|a, b| a.0 == b.0).filter(|pair| pair.len() == 2) {
            let segment = pair[0].0;
            let ends = [pair[0].1, pair[1].1];
            let middle = vertices.len() as u32;
            let hits = segment.map(|crossing| hit(bricks, &first, crossing));
            vertices.push(between(hits));
            for crossing in segment {
                middles.insert((crossing, ends), middle);
            }
        }
        Self { around, first, middles }
    }

    /// Cuts all quads.
    pub fn cut(&self, field: &dyn Field, bricks: &[Brick], vertices: &mut Vec<Vertex>) -> Cut {
        let known: &[Vertex] = vertices;
        let parts: Vec<Part> = (0..bricks.len())
            .into_par_iter()
            .map(|slot| self.cut_brick(field, bricks, known, slot))
            .collect();
        let mut cut = Cut::default();
        for part in parts {
            cut.triangles.extend(part.cut.triangles);
            cut.spoilt.extend(part.cut.spoilt);
            cut.gradients += part.cut.gradients;
            for (rim, hit) in part.fans {
                let centre = vertices.len() as u32;
                let vertex = Vertex {
                    position: hit.position,
                    normal: hit.normal,
                    kind: Kind::Sharp,
                    fallback: hit.position,
                };
                vertices.push(vertex);
                let next = rim.iter().cycle().skip(1);
                cut.triangles.extend(rim.iter().zip(next).map(|(&a, &b)| [centre, a, b]));
            }
        }
        cut
    }

    fn cut_brick(&self, field: &dyn Field, bricks: &[Brick], vertices: &[Vertex], slot: usize) -> Part {
        let brick = &bricks[slot];
        let mut part = Part::default();
        let mut doubtful = Vec::new();
        let mut number = self.first[slot];
        let mut hits = brick.hits.iter();
        brick.for_each_crossed(|_, low| {
            let (around, Some(hit)) = (self.around[number], hits.next()) else { return };
            number += 1;
            if around.contains(&NONE) {
                return;
            }
            // counter-clockwise seen from the high end, where the fluid is if the low end is inside
            let [a, b, c, d] = around;
            let corners = if brick.is_inside(low) { [d, c, a, b] } else { [b, a, c, d] };
            if let Some(rim) = self.rim((number - 1) as u32, corners) {
                return part.fans.push((rim, *hit));
            }
            match cut_smooth(corners.map(|v| &vertices[v as usize]), hit) {
                Some(along_first) => part.cut.triangles.extend(halves(corners, along_first)),
                None => doubtful.push((corners, *hit)),
            }
        });
        part.cut_doubtful(field, vertices, &doubtful);
        part
    }

    /// The corners and middles around a quad that has middles.
    fn rim(&self, crossing: u32, corners: [u32; 4]) -> Option<Vec<u32>> {
        if self.middles.is_empty() {
            return None;
        }
        let mut rim = Vec::new();
        for i in 0..4 {
            let (a, b) = (corners[i], corners[(i + 1) % 4]);
            rim.push(a);
            rim.extend(self.middles.get(&(crossing, [a.min(b), a.max(b)])));
        }
        (rim.len() > 4).then_some(rim)
    }
}

fn hit(bricks: &[Brick], first: &[usize], crossing: u32) -> Hit {
    let slot = first.partition_point(|&f| f <= crossing as usize) - 1;
    bricks[slot].hits[crossing as usize - first[slot]]
}

fn between(hits: [Hit; 2]) -> Vertex {
    let position = 0.5 * (hits[0].position + hits[1].position);
    Vertex { position, normal: DVec3::ZERO, kind: Kind::Sharp, fallback: position }
}

/// The triangles of a quad cut along its first diagonal (from corner 0) or its second.
fn halves([a, b, c, d]: [u32; 4], along_first: bool) -> [[u32; 3]; 2] {
    if along_first { [[a, b, c], [a, c, d]] } else { [[b, c, d], [b, d, a]] }
}

/// Which diagonal cuts a quad on a smooth surface: whether it is the first; none if that needs a closer look.
fn cut_smooth(corners: [&Vertex; 4], hit: &Hit) -> Option<bool> {
    if hit.is_cap {
        return Some(true).filter(|_| corners.iter().all(|v| v.kind == Kind::Cap));
    }
    if corners.iter().any(|v| v.kind != Kind::Smooth) {
        return None;
    }
    // how far the surface bulges over a chord, from the normals at its ends
    let bulge = |i: usize, j: usize| {
        let (a, b) = (corners[i], corners[j]);
        let chord = b.position - a.position;
        ((b.normal - a.normal).dot(chord).abs(), chord.length())
    };
    let (first, second) = (bulge(0, 2), bulge(1, 3));
    let is_plane = first.0.max(second.0) < FLAT * first.1.max(second.1);
    let along_first = if is_plane { first.1 <= second.1 } else { first.0 <= second.0 };
    let faces_out = |along_first: bool| {
        halves([0, 1, 2, 3], along_first).into_iter().all(|t| {
            let [a, b, c] = t.map(|i| corners[i as usize].position);
            (b - a).cross(c - a).dot(hit.normal) > 0.0
        })
    };
    [along_first, !along_first].into_iter().find(|&first| faces_out(first))
}

/// A bulge below this share of a chord is none: the shorter diagonal makes the better triangles.
const FLAT: f64 = 1e-3;

/// What one brick adds.
#[derive(Default)]
struct Part {
    cut: Cut,
    fans: Vec<(Vec<u32>, Hit)>,
}

impl Part {
    /// Cuts quads at creases so that the triangles face as the surface does below their middles.
    fn cut_doubtful(&mut self, field: &dyn Field, vertices: &[Vertex], quads: &[([u32; 4], Hit)]) {
        let corners = |t: [u32; 3]| t.map(|v| vertices[v as usize].position);
        let choices = |quad: [u32; 4]| [true, false].map(|first| halves(quad, first)).into_iter().flatten();
        let middles: Vec<DVec3> = quads
            .iter()
            .flat_map(|(quad, _)| choices(*quad).map(|t| corners(t).iter().sum::<DVec3>() / 3.0))
            .collect();
        self.cut.gradients += middles.len() as u64;
        let mut below = gradients(field, &middles).into_iter();
        for (quad, hit) in quads {
            let agreement = choices(*quad).map(|t| {
                let [a, b, c] = corners(t);
                let facing = unit((b - a).cross(c - a)).unwrap_or(DVec3::ZERO);
                let outward = below.next().and_then(|(_, gradient)| unit(-gradient)).unwrap_or(hit.normal);
                facing.dot(if hit.is_cap { hit.normal } else { outward })
            });
            let agreement: Vec<f64> = agreement.collect();
            let (first, second) = (agreement[0].min(agreement[1]), agreement[2].min(agreement[3]));
            self.cut.triangles.extend(halves(*quad, first >= second));
            if first.max(second) < 0.0 {
                self.cut.spoilt.extend(quad.iter().filter(|&&v| vertices[v as usize].kind == Kind::Sharp));
            }
        }
    }
}
