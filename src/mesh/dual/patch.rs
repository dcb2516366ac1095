//! The part of a mesh that is mended, and the measure of what is wrong with it.
//!
//! Invariant: replacing the triangles of a pair by others with the same border leaves the mesh as closed as
//! it was.

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::super::intersections::{Cubes, Neighbours, Triangle, bounds_of, corners, cross, overlap};
use super::super::normals::unit;
use super::care::Care;
use super::vertices::{Vertex, VertexKind, Vertices};
use crate::field::Field;
use crate::geom::Aabb;

/// Triangles whose normals agree less than this with the surface below them (cosine) count as folded, and the
/// more so the less they agree.
pub(super) const FACING: f64 = 0.3;

/// Maximum number of steps of Newton's method from the middle of a triangle to the surface below, and the
/// step, in cells, after which no other is needed. Only the direction of the surface is sought, not its exact
/// position.
pub(super) const STEPS: usize = 4;
pub(super) const NEAR: f64 = 0.01;

/// The points at which an edge is compared with the surface, as shares of its length.
const SHARES: [f64; 3] = [0.5, 0.25, 0.75];

/// The distance from the edges to mend over which changes may spread, in edges.
const RINGS: usize = 3;

/// A triangle whose height is at most this share of its longest side is flat.
const FLAT: f64 = 1e-9;

/// The mesh around the edges to mend.
pub(super) struct Patch<'a> {
    pub field: &'a dyn Field,
    /// The grid's box. Vertices on its border stay where they are.
    pub bounds: &'a Aabb,
    /// The shortest side of a cell.
    pub size: f64,
    pub vertices: &'a mut Vertices,
    pub triangles: &'a mut Vec<[u32; 3]>,
    /// The triangles around each vertex of the patch.
    fans: FxHashMap<u32, Vec<u32>>,
    /// The triangles near those of the patch, some of which may have moved away; `None` where triangles may cross.
    near: Option<Neighbours>,
    /// Evaluations of ω and ∇ω.
    pub count: u64,
}

/// The two triangles at an edge a–b: (a, b, c) and (b, a, d).
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    pub places: [u32; 2],
    pub ends: [u32; 2],
    pub apexes: [u32; 2],
}

impl Pair {
    pub fn triangles(&self) -> [[u32; 3]; 2] {
        let ([a, b], [c, d]) = (self.ends, self.apexes);
        [[a, b, c], [b, a, d]]
    }

    /// The two triangles if the edge joins the apexes instead.
    pub fn turned(&self) -> [[u32; 3]; 2] {
        let ([a, b], [c, d]) = (self.ends, self.apexes);
        [[a, d, c], [d, b, c]]
    }

    /// The four triangles if the edge is cut at a vertex.
    pub fn cut(&self, m: u32) -> [[u32; 3]; 4] {
        let ([a, b], [c, d]) = (self.ends, self.apexes);
        [[a, m, c], [b, m, d], [m, b, c], [m, a, d]]
    }

    pub fn corners(&self) -> [u32; 4] {
        let ([a, b], [c, d]) = (self.ends, self.apexes);
        [a, b, c, d]
    }

    /// The edges around both triangles.
    pub fn rim(&self) -> [[u32; 2]; 4] {
        let ([a, b], [c, d]) = (self.ends, self.apexes);
        [[a, c], [b, c], [a, d], [b, d]]
    }
}

impl<'a> Patch<'a> {
    pub fn new(
        field: &'a dyn Field,
        (bounds, size, care): (&'a Aabb, f64, Care),
        vertices: &'a mut Vertices,
        triangles: &'a mut Vec<[u32; 3]>,
        edges: &[[u32; 2]],
    ) -> Self {
        let mut is_near = vec![false; vertices.len()];
        edges.iter().flatten().for_each(|&v| is_near[v as usize] = true);
        for _ in 0..RINGS {
            let beside = triangles.iter().filter(|t| t.iter().any(|&v| is_near[v as usize]));
            let beside: Vec<[u32; 3]> = beside.copied().collect();
            beside.iter().flatten().for_each(|&v| is_near[v as usize] = true);
        }
        let mut fans: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
        for (i, t) in (0..).zip(triangles.iter()) {
            for v in t.iter().filter(|&&v| is_near[v as usize]) {
                fans.entry(*v).or_default().push(i);
            }
        }
        let near = (care == Care::Apart).then(|| {
            let mut own: Vec<u32> = fans.values().flatten().copied().collect();
            own.sort_unstable();
            own.dedup();
            // vertices move by a cell at most
            Neighbours::find(&vertices.positions, triangles, (&own, size), Cubes::new(size))
        });
        Self { field, bounds, size, vertices, triangles, fans, near, count: 0 }
    }

    /// The triangles at an edge. `None` if the edge is gone, leaves the patch or touches the border.
    pub fn pair(&self, [a, b]: [u32; 2]) -> Option<Pair> {
        let runs = |t: [u32; 3], [a, b]: [u32; 2]| (0..3).any(|i| t[i] == a && t[(i + 1) % 3] == b);
        let fan = self.fans.get(&a)?;
        let find = |way: [u32; 2]| fan.iter().copied().find(|&t| runs(self.triangles[t as usize], way));
        let places = [find([a, b])?, find([b, a])?];
        let apex = |t: u32| self.triangles[t as usize].into_iter().find(|v| *v != a && *v != b);
        let pair = Pair { places, ends: [a, b], apexes: [apex(places[0])?, apex(places[1])?] };
        pair.corners().iter().all(|&v| self.is_free(v)).then_some(pair)
    }

    fn is_free(&self, v: u32) -> bool {
        let (p, Aabb { min, max }) = (self.position(v), *self.bounds);
        let is_within = p.cmpgt(min).all() && p.cmplt(max).all();
        is_within && self.fans.contains_key(&v) && self.vertices.kinds[v as usize] != VertexKind::Cap
    }

    pub fn position(&self, v: u32) -> DVec3 {
        self.vertices.positions[v as usize]
    }

    pub fn is_edge(&self, [a, b]: [u32; 2]) -> bool {
        self.fan(a).any(|t| t.contains(&b))
    }

    /// The triangles around a vertex.
    pub fn fan(&self, v: u32) -> impl Iterator<Item = [u32; 3]> {
        let fan = self.fans.get(&v).map_or(&[][..], Vec::as_slice);
        fan.iter().map(|&t| self.triangles[t as usize])
    }

    /// The vertices that edges join to a vertex.
    pub fn around(&self, v: u32) -> Vec<u32> {
        self.fan(v).filter_map(|t| (0..3).find(|&i| t[i] == v).map(|i| t[(i + 1) % 3])).collect()
    }

    /// The vertices with which a vertex may be merged: their common neighbours are the apexes of their edge,
    /// and the mesh there is not a tetrahedron.
    pub fn mergeable(&self, v: u32) -> Vec<u32> {
        let around = self.around(v);
        let has_common = |other: u32| {
            let joined = self.around(other);
            around.iter().filter(|v| joined.contains(v)).count() == 2 && around.len() > 3
        };
        around.iter().copied().filter(|&other| self.is_free(other) && has_common(other)).collect()
    }

    /// Replaces the triangles of a pair. Those that are too many go to the end.
    pub fn replace(&mut self, pair: Pair, now: &[[u32; 3]]) {
        for (place, t) in pair.places.into_iter().zip(pair.triangles()) {
            for v in t {
                self.fans.entry(v).or_default().retain(|&other| other != place);
            }
        }
        for (i, t) in now.iter().enumerate() {
            let place = pair.places.get(i).copied().unwrap_or(self.triangles.len() as u32);
            match self.triangles.get_mut(place as usize) {
                Some(old) => *old = *t,
                None => self.triangles.push(*t),
            }
            t.iter().for_each(|v| self.fans.entry(*v).or_default().push(place));
            if let Some(near) = &mut self.near {
                near.add(place, &bounds_of(corners(&self.vertices.positions, *t)));
            }
        }
    }

    /// Whether triangles would cross one another or others near them, except for those that they replace; never where
    /// no care is taken.
    pub fn cross(&self, triangles: &[[u32; 3]], replaced: &[u32]) -> bool {
        let Some(near) = &self.near else { return false };
        let positions = &self.vertices.positions;
        let new: Vec<Triangle> = triangles.iter().map(|t| corners(positions, *t)).collect();
        let meets_other = |t: &Triangle| {
            let bounds = bounds_of(*t);
            near.around(&bounds).any(|other| {
                let place = corners(positions, self.triangles[other as usize]);
                !replaced.contains(&other) && overlap(&bounds, &bounds_of(place)) && cross(t, &place)
            })
        };
        let pairs = (0..new.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        pairs.into_iter().any(|(i, j)| cross(&new[i], &new[j])) || new.iter().any(meets_other)
    }

    /// Whether the triangles around a vertex cross one another or others near them.
    pub fn crosses_around(&self, v: u32) -> bool {
        let fan = self.fans.get(&v).map_or(&[][..], Vec::as_slice);
        let triangles: Vec<[u32; 3]> = self.fan(v).collect();
        self.cross(&triangles, fan)
    }

    /// Points spread along an edge.
    pub fn along(&self, edge: [u32; 2]) -> [DVec3; 3] {
        let [p, q] = edge.map(|v| self.position(v));
        SHARES.map(|share| p.lerp(q, share))
    }

    /// What is wrong with a vertex and its triangles, as [`Self::badness`]. Infinite if more than `limit`.
    pub fn badness_around(&mut self, v: u32, limit: f64) -> f64 {
        let triangles: Vec<[u32; 3]> = self.fan(v).collect();
        let mut points: Vec<DVec3> =
            self.around(v).into_iter().flat_map(|other| self.along([v, other])).collect();
        points.push(self.position(v));
        self.badness(&triangles, &points, limit)
    }

    /// What is wrong with triangles, as a distance. It is the largest distance of their middles and of some
    /// more points from the surface, plus their folds, of which a right angle counts as about a cell.
    /// Infinite if it is more than `limit`; most changes are refused after a point or two.
    pub fn badness(&mut self, triangles: &[[u32; 3]], points: &[DVec3], limit: f64) -> f64 {
        let mut off = 0.0;
        for p in points {
            off = f64::max(off, self.distance(*p));
            if off > limit {
                return f64::INFINITY;
            }
        }
        let mut folds = 0.0;
        for t in triangles {
            let (distance, fold) = self.middle(*t);
            off = f64::max(off, distance);
            folds += fold;
            if off + self.size * folds > limit {
                return f64::INFINITY;
            }
        }
        off + self.size * folds
    }

    /// How much the agreement (cosine) of a triangle with the surface below its middle falls short of
    /// [`FACING`]. Above [`FACING`] the triangle lies upside down.
    pub fn fold(&mut self, t: [u32; 3]) -> f64 {
        self.middle(t).1
    }

    /// The distance of a triangle's middle from the surface, and the triangle's fold.
    fn middle(&mut self, t: [u32; 3]) -> (f64, f64) {
        let [a, b, c] = t.map(|v| self.position(v));
        let facing = unit((b - a).cross(c - a));
        let mut foot = (a + b + c) / 3.0;
        let (mut distance, mut fold) = (0.0, 0.0);
        for i in 0..STEPS {
            let (step, normal) = self.step(foot);
            let length = step.length();
            if i == 0 {
                distance = length;
            }
            let Some(facing) = facing else { break };
            foot -= step;
            fold = normal.map_or(fold, |normal| f64::max(fold, FACING - facing.dot(normal)));
            if length <= NEAR * self.size {
                break;
            }
        }
        (distance, fold)
    }

    /// The approximate distance of a point from the surface, and not more than a cell: the length of
    /// [`Self::step`].
    pub fn distance(&mut self, p: DVec3) -> f64 {
        self.count += 1;
        let (omega, gradient) = self.field.omega_grad(p);
        let distance = omega.abs() / gradient.length();
        if distance.is_finite() { f64::min(distance, self.size) } else { 0.0 }
    }

    /// The step of Newton's method at a point, at most a cell long, and the outward normal there.
    pub fn step(&mut self, p: DVec3) -> (DVec3, Option<DVec3>) {
        self.count += 1;
        let (omega, gradient) = self.field.omega_grad(p);
        let step = gradient * (omega / gradient.length_squared());
        let step = if step.is_finite() { step.clamp_length_max(self.size) } else { DVec3::ZERO };
        (step, unit(-gradient))
    }

    /// Whether a triangle has no area to speak of.
    fn is_flat(&self, t: [u32; 3]) -> bool {
        let [a, b, c] = corners(&self.vertices.positions, t);
        let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        (b - a).cross(c - a).length() <= FLAT * longest
    }

    /// Moves a vertex onto a neighbour, so that they can be merged, unless triangles would cross or become flat, or one
    /// of them was moved before.
    pub fn join(&mut self, kept: u32, lost: u32) {
        if !self.fans.contains_key(&kept) || !self.mergeable(lost).contains(&kept) {
            return;
        }
        let (old, new) = (self.vertices.get(lost), self.vertices.get(kept));
        self.vertices.set(lost, new);
        let stays = |t: &[u32; 3]| !t.contains(&kept);
        let flattens = self.fan(lost).filter(stays).any(|t| self.is_flat(t));
        let crosses = flattens || self.crosses_around(lost);
        self.vertices.set(lost, old);
        if !crosses {
            self.put(lost, new);
        }
    }

    /// Moves a vertex and returns the triangles around it. If it moves onto another vertex, the two are to be
    /// merged later. Both and all vertices around them then stay as they are, so that this remains possible.
    pub fn put(&mut self, v: u32, vertex: Vertex) -> Vec<[u32; 3]> {
        let fan: Vec<[u32; 3]> = self.fan(v).collect();
        let around = self.around(v);
        let met = around.iter().copied().find(|&other| self.position(other) == vertex.position);
        self.vertices.set(v, vertex);
        for &t in self.fans.get(&v).into_iter().flatten() {
            let Some(near) = &mut self.near else { break };
            near.add(t, &bounds_of(corners(&self.vertices.positions, self.triangles[t as usize])));
        }
        if let Some(met) = met {
            self.vertices.kinds[met as usize] = VertexKind::Sharp;
            let others = self.around(met);
            around.iter().chain(&others).for_each(|v| {
                self.fans.remove(v);
            });
        }
        fan
    }
}
