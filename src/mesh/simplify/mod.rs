//! A mesh of fewer triangles within a stated distance of the surface.
//!
//! Edges are contracted in the order of their quadric error (see `quadric`). An edge goes to the point that
//! the quadrics prefer, moved back onto ω = 0, or to one of its ends. A contraction is made only if
//! - it meets the link condition (see `collapse`), so that the mesh stays closed, manifold and of the
//!   same topology;
//! - no triangle turns over, against its former self or against the surface below it, and none becomes
//!   a sliver;
//! - every vertex of the first mesh, all of which lie on the surface, keeps a triangle within the tolerance:
//!   each is listed with the triangle nearest to it, and the lists follow every contraction;
//! - points spread over the new triangles are within the tolerance of the surface, by ω/|∇ω|.
//!
//! So the tolerance holds both ways as far as those samples show. With quadrics alone it would hold only for
//! each step. [`measure`](super::measure) checks it with other samples. Two sheets closer to one another than
//! the tolerance may come to touch. Caps at the grid's border stay as they are.
//!
//! Invariant: this runs on one thread and breaks ties by vertex numbers, so the same mesh and field give the
//! same bits.

mod quadric;

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use glam::DVec3;

use super::{
    Mesh, Stretch, Watch,
    collapse::{Fans, compact},
    normals::{GradientColumns, unit},
    quality::nearest_point,
    slivers,
};
use crate::field::Field;
use crate::geom::Aabb;
use quadric::Quadric;

/// Maximum number of passes over all edges. What a first pass had to refuse may be possible once the
/// neighbours are gone.
const PASSES: usize = 4;

/// A pass that removes less than this part of the vertices is the last.
const LEAST_GAIN: f64 = 0.01;

/// The part of the work that is left after a pass.
const LEFT_BY_A_PASS: f64 = 0.25;

/// Edges between two looks at the watch.
const PER_LOOK: usize = 1024;

/// The cosine of the largest angle by which a triangle may turn.
const LARGEST_TURN: f64 = 0.5;

/// New triangles are at least this round, or rounder than the worst that they replace (see
/// [`slivers::roundness`]).
const WORST_SHAPE: f64 = 0.2;

/// An edge is tried if quadrics give up to this many tolerances. They measure from planes, which is often
/// too much.
const HOPEFUL: f64 = 2.0;

/// Intervals between sample points along a new triangle's side.
const SPREAD: usize = 4;

/// Contracts edges of a mesh of the surface of `distance` until none is left that may be contracted. Returns
/// the number of vertices that it removed. Near the surface |ω| / |∇ω| must be about the distance from it.
/// `tolerance` is in metres; one that is not positive changes nothing. Source: Garland and Heckbert, SIGGRAPH
/// 1997, for the order of contractions.
///
/// `watch` receives the share of the work that is done, as far as the edges that are left tell. If it ends the work, the
/// mesh is within the tolerance all the same, and has more triangles.
pub fn simplify(mesh: &mut Mesh, distance: &dyn Field, tolerance: f64, watch: &dyn Watch) -> usize {
    let before = mesh.positions.len();
    if tolerance.is_nan() || tolerance <= 0.0 || mesh.triangles.is_empty() {
        return 0;
    }
    let original = mesh.positions.clone();
    let samples = OriginalVertices::of(mesh);
    let origin = mesh.positions.iter().fold(Aabb::EMPTY, |bounds, p| bounds.including(*p)).centre();
    let mut work = Contraction {
        is_fixed: fixed(mesh),
        quadrics: quadrics(mesh, origin),
        version: vec![0; before],
        fans: Fans::new(mesh, 0..before as u32),
        queue: BinaryHeap::new(),
        distance,
        tolerance,
        origin,
        original,
        samples,
        gradients: GradientColumns::default(),
    };
    let mut left = before;
    for pass in 0..PASSES {
        work.queue_all();
        // each pass leaves about a quarter of the work to the ones after it
        let [from, to] = [pass, pass + 1].map(|passes| 1.0 - LEFT_BY_A_PASS.powi(passes as i32));
        let taken = work.contract_all(&Stretch { watch, from, to });
        left -= taken;
        if (taken as f64) < LEAST_GAIN * left as f64 || watch.is_over() {
            break;
        }
    }
    watch.progress(1.0);
    let Fans { is_lost, is_dead, .. } = work.fans;
    compact(mesh, &is_lost, &is_dead);
    before - mesh.positions.len()
}

/// Whether a vertex is fixed: the caps, and the rim that they share with the surface.
fn fixed(mesh: &Mesh) -> Vec<bool> {
    let is_cap = |v: &u32| mesh.caps.binary_search(v).is_ok();
    let mut is_fixed = vec![false; mesh.positions.len()];
    if !mesh.caps.is_empty() {
        for triangle in mesh.triangles.iter().filter(|t| t.iter().any(is_cap)) {
            triangle.iter().for_each(|&v| is_fixed[v as usize] = true);
        }
    }
    is_fixed
}

/// The sum of the quadrics of the triangles around each vertex. Positions are relative to `origin`, so that
/// they keep their digits.
fn quadrics(mesh: &Mesh, origin: DVec3) -> Vec<Quadric> {
    let mut quadrics = vec![Quadric::ZERO; mesh.positions.len()];
    for triangle in &mesh.triangles {
        let of_triangle = Quadric::of_triangle(triangle.map(|v| mesh.positions[v as usize] - origin));
        for &v in triangle {
            quadrics[v as usize] = quadrics[v as usize].plus(of_triangle);
        }
    }
    quadrics
}

/// For each triangle, the vertices of the first mesh that it stands for.
struct OriginalVertices(Vec<Vec<u32>>);

impl OriginalVertices {
    fn of(mesh: &Mesh) -> Self {
        let mut of_triangle = vec![Vec::new(); mesh.triangles.len()];
        let mut is_given = vec![false; mesh.positions.len()];
        for (triangle, samples) in mesh.triangles.iter().zip(&mut of_triangle) {
            for &v in triangle {
                if !std::mem::replace(&mut is_given[v as usize], true) {
                    samples.push(v);
                }
            }
        }
        Self(of_triangle)
    }
}

/// An edge in the queue: the cheapest first, then the one with the lowest vertices.
#[derive(Debug, Clone, Copy)]
struct EdgeCandidate {
    cost: f64,
    ends: [u32; 2],
    /// The versions of the ends when the cost was found. A vertex that has changed since has another version.
    versions: [u32; 2],
}

impl Ord for EdgeCandidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.cost.total_cmp(&other.cost).then(self.ends.cmp(&other.ends))
    }
}

impl PartialOrd for EdgeCandidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for EdgeCandidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for EdgeCandidate {}

struct Contraction<'a> {
    fans: Fans<'a>,
    distance: &'a dyn Field,
    tolerance: f64,
    origin: DVec3,
    /// The vertices of the first mesh.
    original: Vec<DVec3>,
    samples: OriginalVertices,
    quadrics: Vec<Quadric>,
    is_fixed: Vec<bool>,
    /// The number of times that a vertex has changed.
    version: Vec<u32>,
    queue: BinaryHeap<Reverse<EdgeCandidate>>,
    gradients: GradientColumns,
}

/// The vertex to which an edge is contracted.
#[derive(Debug, Clone, Copy)]
struct NewVertex {
    position: DVec3,
    normal: DVec3,
}

/// The triangles around an edge before its contraction.
struct Ring {
    /// The triangles that stay, with `None` in the place of the corner that moves.
    staying: Vec<(u32, [Option<u32>; 3])>,
    /// The two triangles on the edge.
    vanishing: Vec<u32>,
    /// The vertices of the first mesh that all these triangles stand for.
    samples: Vec<u32>,
    /// The least roundness among them.
    worst_shape: f64,
}

impl Contraction<'_> {
    fn position(&self, v: u32) -> DVec3 {
        self.fans.mesh.positions[v as usize]
    }

    fn queue_all(&mut self) {
        for t in 0..self.fans.mesh.triangles.len() {
            if self.fans.is_dead[t] {
                continue;
            }
            let [a, b, c] = self.fans.mesh.triangles[t];
            // the other triangle of an edge runs along it the other way
            for (from, to) in [(a, b), (b, c), (c, a)] {
                if from < to {
                    self.queue_edge(from, to);
                }
            }
        }
    }

    fn queue_edge(&mut self, a: u32, b: u32) {
        /// The share of the squared length that counts as error. In planes, where all quadrics are zero,
        /// short edges then go first.
        const LENGTH: f64 = 1e-6;
        if self.is_fixed[a as usize] && self.is_fixed[b as usize] {
            return;
        }
        let (p, q) = (self.position(a), self.position(b));
        let quadric = self.quadrics[a as usize].plus(self.quadrics[b as usize]);
        // the ends too, because the pull towards the middle moves the point a little
        let places = [quadric.least(0.5 * (p + q) - self.origin), p - self.origin, q - self.origin];
        let least = places.into_iter().fold(f64::INFINITY, |least, place| least.min(quadric.at(place)));
        if least > (HOPEFUL * self.tolerance).powi(2) * quadric.area {
            return;
        }
        let cost = least + LENGTH * quadric.area * p.distance_squared(q);
        let ends = [a.min(b), a.max(b)];
        let versions = ends.map(|v| self.version[v as usize]);
        self.queue.push(Reverse(EdgeCandidate { cost, ends, versions }));
    }

    /// Empties the queue, unless the watch ends the work. Returns the number of vertices that were removed.
    fn contract_all(&mut self, watch: &dyn Watch) -> usize {
        let (mut taken, mut tried, mut done) = (0, 0_usize, 0.0_f64);
        while let Some(Reverse(EdgeCandidate { ends, versions, .. })) = self.queue.pop() {
            tried += 1;
            if tried.is_multiple_of(PER_LOOK) {
                if watch.is_over() {
                    self.queue.clear();
                    break;
                }
                // a contraction adds edges to those that wait
                done = done.max(tried as f64 / (tried + self.queue.len()) as f64);
                watch.progress(done);
            }
            let is_fresh = (0..2).all(|i| {
                let v = ends[i] as usize;
                !self.fans.is_lost[v] && self.version[v] == versions[i]
            });
            taken += usize::from(is_fresh && self.contract(ends));
        }
        taken
    }

    fn contract(&mut self, [a, b]: [u32; 2]) -> bool {
        let around = self.fans.neighbours(a);
        if around.binary_search(&b).is_err() || !self.fans.meets_link_condition(b, &around) {
            return false;
        }
        let ring = self.ring(a, b);
        for place in self.places(a, b) {
            let Some(samples) = self.accepts(&ring, &place) else { continue };
            // a fixed vertex keeps its number, because caps refer to it
            let (kept, lost) = if self.is_fixed[b as usize] { (b, a) } else { (a, b) };
            self.fans.contract(kept, lost);
            self.fans.mesh.positions[kept as usize] = place.position;
            self.fans.mesh.normals[kept as usize] = place.normal;
            for &t in &ring.vanishing {
                self.samples.0[t as usize] = Vec::new();
            }
            for ((t, _), samples) in ring.staying.iter().zip(samples) {
                self.samples.0[*t as usize] = samples;
            }
            self.quadrics[kept as usize] = self.quadrics[a as usize].plus(self.quadrics[b as usize]);
            self.version[kept as usize] += 1;
            for neighbour in self.fans.neighbours(kept) {
                self.queue_edge(kept, neighbour);
            }
            return true;
        }
        false
    }

    fn ring(&self, a: u32, b: u32) -> Ring {
        let mut ring =
            Ring { staying: Vec::new(), vanishing: Vec::new(), samples: Vec::new(), worst_shape: 1.0 };
        let of_b = self.fans.fan(b).filter(|&t| !self.fans.mesh.triangles[t as usize].contains(&a));
        for t in self.fans.fan(a).chain(of_b) {
            let triangle = self.fans.mesh.triangles[t as usize];
            ring.samples.extend(&self.samples.0[t as usize]);
            ring.worst_shape = ring.worst_shape.min(slivers::roundness(triangle.map(|v| self.position(v))));
            if triangle.contains(&a) && triangle.contains(&b) {
                ring.vanishing.push(t);
            } else {
                ring.staying.push((t, triangle.map(|v| (v != a && v != b).then_some(v))));
            }
        }
        ring
    }

    /// Vertices to which the edge may be contracted; the one that the quadrics prefer comes first.
    fn places(&self, a: u32, b: u32) -> Vec<NewVertex> {
        let end =
            |v: u32| NewVertex { position: self.position(v), normal: self.fans.mesh.normals[v as usize] };
        match (self.is_fixed[a as usize], self.is_fixed[b as usize]) {
            (true, true) => return Vec::new(),
            (true, false) => return vec![end(a)],
            (false, true) => return vec![end(b)],
            (false, false) => {}
        }
        let quadric = self.quadrics[a as usize].plus(self.quadrics[b as usize]);
        let middle = 0.5 * (self.position(a) + self.position(b)) - self.origin;
        let mut places = vec![end(a), end(b)];
        places.extend(self.onto_surface(quadric.least(middle) + self.origin));
        let error = |place: &NewVertex| quadric.at(place.position - self.origin);
        places.sort_by(|p, q| error(p).total_cmp(&error(q)));
        places
    }

    /// The surface near a point that is about a tolerance off, by Newton's method.
    fn onto_surface(&self, start: DVec3) -> Option<NewVertex> {
        const STEPS: usize = 8;
        /// A step that is this small beside the coordinates is rounding.
        const ROUNDING: f64 = 64.0 * f64::EPSILON;
        let mut at = start;
        for _ in 0..STEPS {
            let (omega, gradient) = self.distance.omega_grad(at);
            let step = gradient * (omega / gradient.length_squared());
            at -= step;
            if !at.is_finite() || at.distance(start) > 2.0 * HOPEFUL * self.tolerance {
                return None;
            }
            if step.length() <= ROUNDING * at.abs().max_element() {
                return Some(NewVertex { position: at, normal: unit(-gradient)? });
            }
        }
        None
    }

    /// The samples of each staying triangle after the ring is drawn to a new vertex. `None` if that is
    /// not allowed.
    fn accepts(&mut self, ring: &Ring, place: &NewVertex) -> Option<Vec<Vec<u32>>> {
        let corners: Vec<[DVec3; 3]> = ring
            .staying
            .iter()
            .map(|(_, t)| t.map(|v| v.map_or(place.position, |v| self.position(v))))
            .collect();
        let least_shape = ring.worst_shape.min(WORST_SHAPE);
        for ((t, _), &new) in ring.staying.iter().zip(&corners) {
            let old = self.fans.mesh.triangles[*t as usize].map(|v| self.position(v));
            let area = |[p, q, r]: [DVec3; 3]| (q - p).cross(r - p);
            let (was, is) = (area(old), area(new));
            // slivers hardly have a direction: only the surface is compared
            let turn = if slivers::roundness(old) < slivers::SLIVER { -1.0 } else { LARGEST_TURN };
            if was.dot(is) < turn * was.length() * is.length() || slivers::roundness(new) < least_shape {
                return None;
            }
        }
        let samples = self.shared_out(ring, &corners)?;
        self.is_near_surface(ring, &corners).then_some(samples)
    }

    /// Gives each sample to the triangle nearest to it. `None` if one is not within the tolerance.
    fn shared_out(&self, ring: &Ring, corners: &[[DVec3; 3]]) -> Option<Vec<Vec<u32>>> {
        let mut shared = vec![Vec::new(); corners.len()];
        let limit = self.tolerance * self.tolerance;
        for &sample in &ring.samples {
            let p = self.original[sample as usize];
            let distances = corners.iter().map(|&t| p.distance_squared(nearest_point(t, p)));
            let (nearest, distance) = distances.enumerate().min_by(|x, y| x.1.total_cmp(&y.1))?;
            if distance.is_nan() || distance > limit {
                return None;
            }
            shared[nearest].push(sample);
        }
        Some(shared)
    }

    /// Whether new triangles lie within the tolerance of the surface and face as it does. Those of caps are
    /// not checked.
    fn is_near_surface(&mut self, ring: &Ring, corners: &[[DVec3; 3]]) -> bool {
        let is_cap = |v: &Option<u32>| v.is_some_and(|v| self.fans.mesh.caps.binary_search(&v).is_ok());
        let of_surface = || {
            let pairs = ring.staying.iter().zip(corners);
            pairs.filter_map(|((_, t), corners)| (!t.iter().any(is_cap)).then_some(*corners))
        };
        // false for what is not a number
        let is_near = |omega: f64, gradient: DVec3| omega.abs() <= self.tolerance * gradient.length();
        // most triangles that fail do so here
        let middles: Vec<DVec3> = of_surface().map(|[a, b, c]| (a + b + c) / 3.0).collect();
        let areas: Vec<DVec3> = of_surface().map(|[a, b, c]| (b - a).cross(c - a)).collect();
        let found = self.gradients.at(self.distance, &middles);
        let faces_out = |(area, (omega, gradient)): (&DVec3, (f64, DVec3))| {
            is_near(omega, gradient) && area.dot(gradient) < 0.0
        };
        if !areas.iter().zip(found).all(faces_out) {
            return false;
        }
        let points: Vec<DVec3> = of_surface().flat_map(spread).collect();
        self.gradients.at(self.distance, &points).all(|(omega, gradient)| is_near(omega, gradient))
    }
}

/// Points of a triangle without its corners, which lie on the surface.
fn spread([a, b, c]: [DVec3; 3]) -> impl Iterator<Item = DVec3> {
    let n = SPREAD;
    let lattice = (0..=n).flat_map(move |i| (0..=n - i).map(move |j| [n - i - j, i, j]));
    let between = lattice.filter(move |weights| weights.iter().all(|&w| w < n));
    between.map(move |[u, v, w]| (a * u as f64 + b * v as f64 + c * w as f64) / n as f64)
}

#[cfg(test)]
mod tests;
