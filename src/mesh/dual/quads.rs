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

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;
use rayon::prelude::*;

use super::super::{
    crossings::{self, Crossed, Task},
    normals::{GradientColumns, unit},
    prune::{BRICK, Lattice},
    signs::Signs,
};
use super::loops::Sheets;
use super::place::Placed;
use super::vertices::{Hit, Hits, NONE, Rings, Vertex, VertexKind, Vertices};
use crate::field::Field;
use crate::geom::Aabb;

/// The quads around all crossed edges.
pub(super) struct Quads<'a> {
    pub field: &'a dyn Field,
    pub lattice: &'a Lattice,
    signs: &'a [Signs],
    crossed: &'a Crossed<Sheets>,
    pub hits: &'a Hits,
    rings: &'a Rings,
    /// Vertices in the middle of sides, by hit and ends: of those that two quads would share with two others,
    /// and of those that are bent into the faces of cells (see `secure`).
    pub middles: BTreeMap<(u32, [u32; 2]), u32>,
    /// The second vertex of a cell at a hit, by hit and first vertex.
    pub seconds: BTreeMap<(u32, u32), u32>,
    /// Where the vertices at the ends of tunnels began: in their cells, at the passages.
    pub tunnels: BTreeMap<u32, DVec3>,
    /// For each vertex of a cell, whether it lies outside that cell or in one with other vertices.
    is_away: Vec<bool>,
}

/// A quad around a crossed edge of the grid.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quad {
    pub hit: u32,
    /// Counter-clockwise as seen from the fluid.
    pub corners: [u32; 4],
    /// The edge's axis, and the extended indices of its low end.
    pub axis: usize,
    pub low: [usize; 3],
    /// Whether the low end is inside.
    pub is_inside: bool,
}

/// The triangles of all quads. `triangles` has two for each hit, which are [`NOTHING`] if there is no quad or
/// a fan.
#[derive(Default)]
pub(super) struct Cut {
    pub triangles: Vec<[u32; 3]>,
    /// Vertices with triangles that lie upside down for either diagonal.
    pub spoilt: Vec<u32>,
    /// The corners of fans, by their hits.
    pub fans: BTreeMap<u32, Vec<u32>>,
    /// Quads that are not on a smooth surface, in the order of their hits.
    pub doubtful: Vec<Quad>,
    /// Quads on a smooth surface with a corner outside its own cell, or in a cell with other vertices.
    pub astray: Vec<u32>,
    pub gradients: u64,
}

/// No triangle.
pub(super) const NOTHING: [u32; 3] = [NONE; 3];

impl<'a> Quads<'a> {
    /// Joins the vertices around each hit. Adds the vertices that lie between two cells.
    pub fn join(
        (field, lattice): (&'a dyn Field, &'a Lattice),
        signs: &'a [Signs],
        crossed: &'a Crossed<Sheets>,
        (hits, rings): (&'a Hits, &'a Rings),
        placed: &[Placed],
        vertices: &mut Vertices,
    ) -> Self {
        for &v in placed.iter().flat_map(|part| &part.crowded) {
            vertices.doubtful[v as usize] = true;
        }
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
        let seconds: BTreeMap<(u32, u32), u32> =
            placed.iter().flat_map(|part| part.seconds.iter().copied()).collect();
        let ends: BTreeSet<u32> = seconds.values().copied().collect();
        let fallbacks = placed.iter().flat_map(|part| part.fallbacks.iter().copied());
        let tunnels = fallbacks.filter(|(v, _)| ends.contains(v)).collect();
        let mut is_away = vertices.doubtful.clone();
        for &v in placed.iter().flat_map(|part| &part.astray) {
            is_away[v as usize] = true;
        }
        Self { field, lattice, signs, crossed, hits, rings, middles, seconds, tunnels, is_away }
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
                    let pair = &mut triangles[2 * (quad.hit - first) as usize..][..2];
                    match rim {
                        Some(rim) => _ = cut.fans.insert(quad.hit, rim),
                        None => match self.cut_smooth(vertices, &quad) {
                            Some(along_first) => {
                                pair.copy_from_slice(&halves(quad.corners, along_first));
                                if quad.corners.iter().any(|&v| self.is_away[v as usize]) {
                                    cut.astray.push(quad.hit);
                                }
                            }
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
            cut.astray.extend(part.astray);
            cut.gradients += part.gradients;
        }
        cut
    }

    /// Cuts the quads around vertices that have moved again. `moved` ascend and none of them is smooth, so
    /// their quads are doubtful ones, or lie on a cap where nothing changes.
    pub fn cut_again(&self, vertices: &Vertices, moved: &[u32], cut: &mut Cut) {
        let is_moved = |v: &u32| moved.binary_search(v).is_ok();
        let touched = cut.doubtful.iter().filter(|quad| quad.corners.iter().any(is_moved));
        let touched: Vec<Quad> = touched.copied().collect();
        let mut triangles = std::mem::take(&mut cut.triangles);
        cut.spoilt.clear();
        self.cut_doubtful(vertices, &touched, &mut GradientColumns::default(), cut, |hit, pair| {
            triangles[2 * hit as usize..][..2].copy_from_slice(&pair);
        });
        cut.triangles = triangles;
    }

    /// All quads that have one of the marked corners, in the order of their hits.
    pub fn with_corners(&self, is_marked: &[bool]) -> Vec<Quad> {
        let find = |task: &Task<Sheets>| {
            let mut found = Vec::new();
            self.for_each_quad(task, |quad, _| {
                if quad.corners.iter().any(|&v| is_marked[v as usize]) {
                    found.push(quad);
                }
            });
            found
        };
        let parts: Vec<Vec<Quad>> = self.crossed.tasks.par_iter().map(find).collect();
        parts.concat()
    }

    /// The shortest side of a cell.
    pub fn size(&self) -> f64 {
        let ends = [1, 2].map(|n| self.lattice.position([n; 3]));
        (ends[1] - ends[0]).min_element()
    }

    /// The cell of a quad's corner.
    pub fn cell(&self, quad: &Quad, corner: usize) -> Aabb {
        let place = quad.places()[corner];
        let mut low = quad.low;
        low[(quad.axis + 1) % 3] -= place & 1;
        low[(quad.axis + 2) % 3] -= place >> 1;
        Aabb::new(self.lattice.position(low), self.lattice.position(low.map(|n| n + 1)))
    }

    /// Whether the corners of a quad lie in their own cells, and have them to themselves.
    pub fn is_at_home(&self, vertices: &Vertices, quad: &Quad) -> bool {
        (0..4).all(|i| {
            let (v, cell) = (quad.corners[i] as usize, self.cell(quad, i));
            let p = vertices.positions[v];
            (p.cmpge(cell.min) & p.cmple(cell.max)).all() && !vertices.doubtful[v]
        })
    }

    /// Calls `visit(quad, rim)` for each crossed edge that has a vertex in each of the four cells around it.
    /// The rim is given if there are more vertices.
    fn for_each_quad(&self, task: &Task<Sheets>, mut visit: impl FnMut(Quad, Option<Vec<u32>>)) {
        for brick in &task.bricks {
            let inside = &self.signs[brick.number];
            let mut hit = brick.first;
            brick.for_each_edge(|axis, [x, y, z]| {
                let around = self.rings.get(hit);
                if !around.contains(&NONE) {
                    let is_inside = inside[z] >> (BRICK * y + x) & 1 == 1;
                    let low = [brick.low[0] + x, brick.low[1] + y, brick.low[2] + z];
                    let mut quad = Quad { hit, corners: around, axis, low, is_inside };
                    quad.corners = quad.places().map(|place| around[place]);
                    visit(quad, self.rim(&quad).filter(|rim| rim.len() > 4));
                }
                hit += 1;
            });
        }
    }

    /// The corners and middles around a quad. `None` if no quad has middles.
    pub fn rim(&self, quad: &Quad) -> Option<Vec<u32>> {
        let Quad { hit, corners, .. } = *quad;
        if self.middles.is_empty() && self.seconds.is_empty() {
            return None;
        }
        let mut rim = Vec::new();
        for (i, a) in corners.into_iter().enumerate() {
            rim.push(a);
            rim.extend(self.seconds.get(&(hit, a)));
            rim.extend(self.middles.get(&(hit, self.side(quad, i))));
        }
        Some(rim)
    }

    /// The ends, ascending, of the side that leads on from a corner of a quad.
    pub fn side(&self, quad: &Quad, corner: usize) -> [u32; 2] {
        let (a, b) = (quad.corners[corner], quad.corners[(corner + 1) % 4]);
        let a = self.seconds.get(&(quad.hit, a)).copied().unwrap_or(a);
        [a.min(b), a.max(b)]
    }

    /// Whether the first diagonal cuts a quad on a smooth surface. `None` if the quad needs a closer look.
    fn cut_smooth(&self, vertices: &Vertices, quad: &Quad) -> Option<bool> {
        let (hit, corners) = (quad.hit, quad.corners.map(|v| v as usize));
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
            .flat_map(|quad| choices(quad.corners).map(|t| corners(t).iter().sum::<DVec3>() / 3.0))
            .collect();
        cut.gradients += middles.len() as u64;
        let mut below = gradients.at(self.field, &middles);
        for &Quad { hit, corners: quad, .. } in quads {
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

impl Quad {
    /// For each corner the place of the edge in the corner's cell: bit 0 is set if the edge lies on the high
    /// side of the cell on the axis after its own, bit 1 on the one after that.
    pub fn places(&self) -> [usize; 4] {
        // counter-clockwise as seen from the high end, where the fluid is if the low end is inside
        if self.is_inside { [3, 2, 0, 1] } else { [1, 0, 2, 3] }
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
