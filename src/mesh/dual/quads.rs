//! From crossed edges to triangles. Each crossed edge gives a quad through the vertices of the four cells
//! around it.
//!
//! A quad is cut along the diagonal that follows the surface better, which at a crease is the one along it.
//! Two kinds of quads become fans around their hits instead. Where two edges of the mesh would join the same
//! vertices (see `loops`), each edge gets a vertex of its own in the middle. Where a cell has a ring of
//! vertices at the end of a tunnel, a quad has two of them.
//!
//! Invariant: the triangles of a quad, fans included, have its sides as their border, so the mesh is as
//! closed and manifold as the quads are.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;

use super::super::{
    crossings::{self, Crossed, Task},
    normals::{GradientColumns, unit},
    prune::BRICK,
    signs::Signs,
};
use super::loops::Sheets;
use super::place::Placed;
use super::vertices::{Hit, Hits, NONE, Rings, Vertex, VertexKind, Vertices};
use crate::field::Field;

/// The quads around all crossed edges.
pub(super) struct Quads<'a> {
    pub field: &'a dyn Field,
    signs: &'a [Signs],
    crossed: &'a Crossed<Sheets>,
    hits: &'a Hits,
    rings: &'a Rings,
    /// Vertices in the middle of sides that two quads would share with two others, by hit and ends.
    middles: BTreeMap<(u32, [u32; 2]), u32>,
    /// The second vertex of a cell at a hit, by hit and first vertex.
    seconds: BTreeMap<(u32, u32), u32>,
}

/// A quad: its hit, and its corners counter-clockwise as seen from the fluid.
type Quad = (u32, [u32; 4]);

/// The triangles of all quads. `triangles` has two for each hit, which are [`NOTHING`] if there is no quad or
/// a fan.
#[derive(Default)]
pub(super) struct Cut {
    pub triangles: Vec<[u32; 3]>,
    /// Vertices with triangles that lie upside down for either diagonal.
    pub spoilt: Vec<u32>,
    /// The corners of fans, around their hits.
    fans: Vec<(u32, Vec<u32>)>,
    /// Quads that are not on a smooth surface, in the order of their hits.
    doubtful: Vec<Quad>,
    pub gradients: u64,
}

/// No triangle.
const NOTHING: [u32; 3] = [NONE; 3];

impl<'a> Quads<'a> {
    /// Joins the vertices around each hit. Adds the vertices that lie between two cells.
    pub fn join(
        field: &'a dyn Field,
        signs: &'a [Signs],
        crossed: &'a Crossed<Sheets>,
        (hits, rings): (&'a Hits, &'a Rings),
        placed: &[Placed],
        vertices: &mut Vertices,
    ) -> Self {
        let mut twice: Vec<_> = placed.iter().flat_map(|part| part.twice.iter().copied()).collect();
        twice.sort_unstable();
        let mut middles = BTreeMap::new();
        for pair in twice.chunk_by(|a, b| a.segment == b.segment).filter(|pair| pair.len() == 2) {
            let middle = vertices.len() as u32;
            let ends = pair[0].segment.map(|hit| hits.get(hit).position);
            let position = ends[0].midpoint(ends[1]);
            vertices.push(Vertex { position, normal: DVec3::ZERO, kind: VertexKind::Sharp });
            for hit in pair[0].segment {
                middles.insert((hit, [pair[0].vertex, pair[1].vertex]), middle);
            }
        }
        let seconds = placed.iter().flat_map(|part| part.seconds.iter().copied()).collect();
        Self { field, signs, crossed, hits, rings, middles, seconds }
    }

    /// Cuts all quads.
    pub fn cut(&self, vertices: &Vertices) -> Cut {
        let mut triangles: Vec<[u32; 3]> =
            rayon::iter::repeat_n(NOTHING, 2 * self.hits.positions.len()).collect();
        let counts = self.crossed.tasks.iter().map(|task| 2 * task.vertices);
        let jobs = self.crossed.tasks.par_iter().zip(crossings::parts(&mut triangles, counts));
        let parts: Vec<Cut> = jobs
            .map_init(GradientColumns::default, |gradients, (task, triangles)| {
                let mut cut = Cut::default();
                let mut doubtful = Vec::new();
                let first = task.first as u32;
                self.for_each_quad(task, |quad, rim| {
                    let pair = &mut triangles[2 * (quad.0 - first) as usize..][..2];
                    match rim {
                        Some(rim) => cut.fans.push((quad.0, rim)),
                        None => match self.cut_smooth(vertices, quad) {
                            Some(along_first) => pair.copy_from_slice(&halves(quad.1, along_first)),
                            None => doubtful.push(quad),
                        },
                    }
                });
                self.cut_doubtful(vertices, &doubtful, gradients, &mut cut, |hit, pair| {
                    triangles[2 * (hit - first) as usize..][..2].copy_from_slice(&pair);
                });
                cut.doubtful = doubtful;
                cut
            })
            .collect();
        let mut cut = Cut { triangles, ..Cut::default() };
        for part in parts {
            cut.spoilt.extend(part.spoilt);
            cut.fans.extend(part.fans);
            cut.doubtful.extend(part.doubtful);
            cut.gradients += part.gradients;
        }
        cut
    }

    /// Cuts the quads around vertices that have moved again. `moved` ascend and none of them is smooth, so
    /// their quads are doubtful ones, or lie on a cap where nothing changes.
    pub fn cut_again(&self, vertices: &Vertices, moved: &[u32], cut: &mut Cut) {
        let is_moved = |v: &u32| moved.binary_search(v).is_ok();
        let touched = cut.doubtful.iter().filter(|quad| quad.1.iter().any(is_moved));
        let touched: Vec<Quad> = touched.copied().collect();
        let mut triangles = std::mem::take(&mut cut.triangles);
        cut.spoilt.clear();
        self.cut_doubtful(vertices, &touched, &mut GradientColumns::default(), cut, |hit, pair| {
            triangles[2 * hit as usize..][..2].copy_from_slice(&pair);
        });
        cut.triangles = triangles;
    }

    /// All triangles, those of fans last. Adds the middles of the fans to the vertices.
    pub fn triangles(&self, cut: Cut, vertices: &mut Vertices) -> Vec<[u32; 3]> {
        let Cut { mut triangles, fans, .. } = cut;
        if !fans.is_empty() || triangles.contains(&NOTHING) {
            triangles.retain(|t| *t != NOTHING);
        }
        for (hit, rim) in fans {
            let centre = vertices.len() as u32;
            let Hit { position, normal, .. } = self.hits.get(hit);
            vertices.push(Vertex { position, normal, kind: VertexKind::Sharp });
            let next = rim.iter().cycle().skip(1);
            triangles.extend(rim.iter().zip(next).map(|(&a, &b)| [centre, a, b]));
        }
        triangles
    }

    /// Calls `visit(quad, rim)` for each crossed edge that has a vertex in each of the four cells around it.
    /// The rim is given if there are more vertices.
    fn for_each_quad(&self, task: &Task<Sheets>, mut visit: impl FnMut(Quad, Option<Vec<u32>>)) {
        for brick in &task.bricks {
            let inside = &self.signs[brick.number];
            let mut hit = brick.first;
            brick.for_each_edge(|_, [x, y, z]| {
                let around = self.rings.get(hit);
                if !around.contains(&NONE) {
                    // counter-clockwise as seen from the high end, where the fluid is if the low end
                    // is inside
                    let [a, b, c, d] = around;
                    let is_inside = inside[z] >> (BRICK * y + x) & 1 == 1;
                    let corners = if is_inside { [d, c, a, b] } else { [b, a, c, d] };
                    visit((hit, corners), self.rim((hit, corners)));
                }
                hit += 1;
            });
        }
    }

    /// The corners and middles around a quad. `None` if there are only four.
    fn rim(&self, (hit, corners): Quad) -> Option<Vec<u32>> {
        if self.middles.is_empty() && self.seconds.is_empty() {
            return None;
        }
        let mut rim = Vec::new();
        for i in 0..4 {
            let (a, b) = (corners[i], corners[(i + 1) % 4]);
            rim.push(a);
            rim.extend(self.seconds.get(&(hit, a)));
            rim.extend(self.middles.get(&(hit, [a.min(b), a.max(b)])));
        }
        (rim.len() > 4).then_some(rim)
    }

    /// Whether the first diagonal cuts a quad on a smooth surface. `None` if the quad needs a closer look.
    fn cut_smooth(&self, vertices: &Vertices, (hit, corners): Quad) -> Option<bool> {
        let corners = corners.map(|v| v as usize);
        if self.hits.is_cap[hit as usize] {
            return Some(true).filter(|_| corners.iter().all(|&v| vertices.kinds[v] == VertexKind::Cap));
        }
        if corners.iter().any(|&v| vertices.kinds[v] != VertexKind::Smooth) {
            return None;
        }
        // written out: `map` over four vectors becomes a call
        let [a, b, c, d] = corners;
        let [positions, normals] = [&vertices.positions, &vertices.normals];
        let positions = [positions[a], positions[b], positions[c], positions[d]];
        let normals = [normals[a], normals[b], normals[c], normals[d]];
        let chords = [positions[2] - positions[0], positions[3] - positions[1]];
        // how far the surface bulges over a chord, by the normals at its ends
        let bulges =
            [(normals[2] - normals[0]).dot(chords[0]).abs(), (normals[3] - normals[1]).dot(chords[1]).abs()];
        let squared = chords.map(|chord| chord.length_squared());
        let flat = FLAT * FLAT * squared[0].max(squared[1]);
        let is_plane = bulges[0].max(bulges[1]).powi(2) < flat;
        let along_first = if is_plane { squared[0] <= squared[1] } else { bulges[0] <= bulges[1] };
        // twice the area of the triangle after corner i on the way around
        let normal = self.hits.normals[hit as usize];
        let sides: [DVec3; 4] = std::array::from_fn(|i| positions[(i + 1) % 4] - positions[i]);
        let faces_out: [bool; 4] =
            std::array::from_fn(|i| sides[i].cross(sides[(i + 1) % 4]).dot(normal) > 0.0);
        let is_good = |along_first: bool| {
            let i = usize::from(!along_first);
            faces_out[i] & faces_out[i + 2]
        };
        [along_first, !along_first].into_iter().find(|&first| is_good(first))
    }

    /// Cuts quads at creases so that the triangles face as the surface does below their middles.
    fn cut_doubtful(
        &self,
        vertices: &Vertices,
        quads: &[Quad],
        gradients: &mut GradientColumns,
        cut: &mut Cut,
        mut write: impl FnMut(u32, [[u32; 3]; 2]),
    ) {
        let corners = |t: [u32; 3]| t.map(|v| vertices.positions[v as usize]);
        let choices = |quad: [u32; 4]| [true, false].map(|first| halves(quad, first)).into_iter().flatten();
        let middles: Vec<DVec3> = quads
            .iter()
            .flat_map(|(_, quad)| choices(*quad).map(|t| corners(t).iter().sum::<DVec3>() / 3.0))
            .collect();
        cut.gradients += middles.len() as u64;
        let mut below = gradients.at(self.field, &middles);
        for &(hit, quad) in quads {
            let Hit { normal, is_cap, .. } = self.hits.get(hit);
            let mut agreement = [0.0; 4];
            for (agreement, t) in agreement.iter_mut().zip(choices(quad)) {
                let [a, b, c] = corners(t);
                let facing = unit((b - a).cross(c - a)).unwrap_or(DVec3::ZERO);
                let outward = below.next().and_then(|(_, gradient)| unit(-gradient)).unwrap_or(normal);
                *agreement = facing.dot(if is_cap { normal } else { outward });
            }
            let (first, second) = (agreement[0].min(agreement[1]), agreement[2].min(agreement[3]));
            write(hit, halves(quad, first >= second));
            if first.max(second) < 0.0 {
                cut.spoilt.extend(quad.iter().filter(|&&v| vertices.kinds[v as usize] == VertexKind::Sharp));
            }
        }
    }
}

/// The triangles of a quad cut along its first diagonal (from corner 0) or its second.
fn halves(quad: [u32; 4], along_first: bool) -> [[u32; 3]; 2] {
    // indices instead of a branch, which would be taken in half of the cases
    let corner = |i: usize| quad[(i + usize::from(!along_first)) % 4];
    [[corner(0), corner(1), corner(2)], [corner(0), corner(2), corner(3)]]
}

/// A bulge below this share of a chord counts as flat, and the shorter diagonal makes the better triangles.
const FLAT: f64 = 1e-3;
