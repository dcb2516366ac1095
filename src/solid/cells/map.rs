//! A box divided into cells that know what matters in them: fluid, inside, or the few leaves of a surface
//! nearby.
//!
//! A part that is proven to be outside or inside is dropped from the cell and from all cells within it. A
//! point far from every surface then costs one look-up, and one near a surface the evaluation of the leaves
//! that are left there, however many the solid has. Sign, zero set and the gradient on the surface are
//! exactly those of the twin; the value off the surface is that of the leaf that decides in the cell, and
//! jumps between cells. A map with a reach also answers for distance, normal and curvature up to that
//! distance from the surface.

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::DVec3;

use super::demanded::{Demanded, Keeps};
use super::grid::{Cells, SIDE, judged};
use super::window::{Found, Known, Window};
use crate::field::{
    Entry, Faces, Field, GradientsMut, Normals, Path, Points, Sheet, Walls, clearance_by_ranges,
};
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::Unary;
use crate::solid::construction::Solid;
use crate::solid::contact::Contact;
use crate::solid::leaves::known_ranges::KnownRanges;
use crate::solid::leaves::leaf_set::{LeafTree, Leaves};
use crate::solid::leaves::pruning::Verdict;
use crate::solid::leaves::words::Word;
use crate::solid::path::sweep::Sweep;
use crate::solid::twin::Twin;

/// Points that are looked up together.
pub(super) const RUN: usize = 64;

/// At least this many neighbouring points of one cell are evaluated together.
const SHORTEST_RUN: usize = 4;

/// Cells that are looked at one by one for a range; for larger boxes all leaves are.
const MOST_TOUCHED: usize = 4096;

/// How far off the surface, in longest sides of the flat grid's cells, gradients come from the leaves nearby
/// and not from the twin, which evaluates all of them. Meshes are mended by gradients within one of their own
/// cells.
const AROUND: f64 = 1.5;

/// What a map knows of a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Proven to be outside, farther than the reach from every surface.
    Fluid,
    /// Proven to be inside, farther than the reach from every surface.
    Inside,
    /// There may be a surface within the reach.
    Near,
}

/// A solid specialised to the cells of a box.
pub struct CellMap {
    solid: Solid,
    pub(super) twin: Twin,
    pub(super) parts: Arc<LeafTree>,
    pub(super) cells: Arc<Window>,
    /// What decides within [`AROUND`] of the cells, for gradients off the surface.
    around: Demanded,
    /// What decides the value in the cells.
    pub(super) deciding: Demanded,
    reach: f64,
    has_few_leaves: bool,
    /// The length by which cells were grown, reach included: points that rounding puts into the next cell are
    /// still right.
    margin: f64,
}

/// Counts of a cell map.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CellStats {
    /// Leaves of the solid.
    pub leaves: usize,
    /// Shapes of leaves, each with programs of its own.
    pub shapes: usize,
    /// Cells proven to be outside.
    pub fluid: usize,
    /// Cells proven to be inside.
    pub inside: usize,
    /// Cells that may hold a surface.
    pub near: usize,
    /// Different trees of leaves that are left in near cells.
    pub programs: usize,
    /// Leaves in near cells, all together.
    pub leaves_in_cells: usize,
}

/// The surface that decides so far.
#[derive(Clone, Copy)]
struct Nearest {
    distance: f64,
    normal: DVec3,
    mean_curvature: f64,
    /// Whether the normal is the mean of several.
    tied: bool,
    /// The first of those that decide.
    leaf: u32,
}

/// The length by which the cells of a box are grown.
pub(super) fn margin(domain: &Aabb, reach: f64) -> f64 {
    let largest = domain.min.abs().max(domain.max.abs()).max_element();
    let cell = domain.size().max_element() / f64::from(SIDE);
    reach * (1.0 + 1e-9) + 1e-9 * cell + 64.0 * f64::EPSILON * largest
}

impl CellMap {
    /// Divides a box. `None` if the solid cannot be taken apart, or the box is not finite.
    pub fn new(solid: &Solid, domain: Aabb) -> Option<Self> {
        Self::with_reach(solid, domain, 0.0)
    }

    /// A map that also knows the surface from up to `reach` away, see [`CellMap::contact`]. Cells within
    /// reach of several parts keep them all: a large reach costs time and memory.
    ///
    /// `None` if the solid cannot be taken apart, or if the box or the reach is not finite.
    pub fn with_reach(solid: &Solid, domain: Aabb, reach: f64) -> Option<Self> {
        if domain.is_empty() || !domain.is_finite() || !(reach >= 0.0 && reach.is_finite()) {
            return None;
        }
        let parts = solid.parts()?;
        let margin = margin(&domain, reach);
        let cells = Cells::new(&parts, domain, margin, reach);
        Self::of(solid, Arc::new(Window::at_rest(cells, parts, margin)), reach)
    }

    /// A map of cells that are right for the solid's stretch of time, and were grown by [`margin`].
    pub(super) fn of(solid: &Solid, cells: Arc<Window>, reach: f64) -> Option<Self> {
        let domain = cells.domain();
        let (parts, margin) = (solid.parts()?, margin(&domain, reach));
        let beside = AROUND * domain.size().max_element() / f64::from(SIDE);
        let around = Demanded::new(domain, Keeps::Surface, beside.max(margin));
        let deciding = Demanded::new(domain, Keeps::Value, margin);
        let has_few_leaves = !solid.has_many_leaves();
        let (solid, twin) = (solid.clone(), solid.twin());
        Some(Self { solid, twin, parts, cells, around, deciding, reach, has_few_leaves, margin })
    }

    /// How the box is divided. Cells in which something moves are divided for that, as if all of them were asked for.
    pub fn stats(&self) -> CellStats {
        let (leaves, counts) = (&self.parts.leaves, self.cells.counts());
        CellStats {
            leaves: leaves.len(),
            shapes: leaves.shapes(),
            fluid: counts.fluid,
            inside: counts.inside,
            near: counts.near,
            programs: counts.programs,
            leaves_in_cells: counts.leaves_in_cells,
        }
    }

    /// What is known of a place; [`Place::Near`] for points outside the box.
    pub fn place_of(&self, p: DVec3) -> Place {
        match self.cells.find(p).map(|found| found.cell) {
            Some(Known::Fluid) => Place::Fluid,
            Some(Known::Inside) => Place::Inside,
            _ => Place::Near,
        }
    }

    /// Inside (1), on the surface (0) or outside (−1), as [`Solid::sign`] says; NaN where a leaf is not a
    /// number.
    #[inline]
    pub fn sign(&self, p: DVec3) -> f64 {
        match self.cells.find(p).map(|found| found.cell) {
            Some(Known::Fluid) => -1.0,
            Some(Known::Inside) => 1.0,
            Some(Known::Near(words)) => Unary::Sign.eval(self.run(words, p).0),
            _ => self.solid.sign(p),
        }
    }

    /// [`CellMap::sign`] of many points.
    ///
    /// # Panics
    /// If `sign` is not as long as the points.
    pub fn sign_many(&self, points: Points<'_>, sign: &mut [f64]) {
        self.evaluate(points, sign, |_| 1.0);
        sign.iter_mut().for_each(|s| *s = Unary::Sign.eval(*s));
    }

    /// What a particle needs to know of the surface, if that is nearer than the reach; otherwise an infinite
    /// distance, positive in the fluid and negative inside, without normal and curvature.
    ///
    /// It differs from [`Solid::contact`] in that leaves without a zero within reach are left out: estimates
    /// of their distance may be too small.
    #[inline]
    pub fn contact(&self, p: DVec3) -> Contact {
        let beyond =
            |sign: f64| Contact { distance: sign * f64::INFINITY, normal: DVec3::ZERO, mean_curvature: 0.0 };
        let found = match self.cells.find(p).map(|found| found.cell) {
            Some(Known::Fluid) => return beyond(1.0),
            Some(Known::Inside) => return beyond(-1.0),
            Some(Known::Near(words)) => self.solid.settled(p, self.nearest(words, &mut 0, p).contact()),
            _ => self.solid.contact(p),
        };
        if found.distance.abs() >= self.reach { beyond(found.distance.signum()) } else { found }
    }

    /// [`CellMap::contact`] of many points: distance, normal x, y, z and mean curvature.
    ///
    /// # Panics
    /// If a column is shorter than the points.
    pub fn contact_many(&self, points: Points<'_>, [distance, x, y, z, curvature]: [&mut [f64]; 5]) {
        for i in 0..points.len() {
            let found = self.contact(points.get(i));
            (distance[i], curvature[i]) = (found.distance, found.mean_curvature);
            (x[i], y[i], z[i]) = (found.normal.x, found.normal.y, found.normal.z);
        }
    }

    /// The value of a tree at a point, and the leaf that decides.
    #[inline]
    fn run(&self, words: &[u32], p: DVec3) -> (f64, (u32, bool)) {
        self.parts.leaves.decide(words, &mut 0, p)
    }

    /// What gives the gradient at a point: the tree of its cell, or what decides around it. `None` far from
    /// all surfaces and outside the box.
    #[inline]
    pub(super) fn words_for(&self, p: DVec3) -> Option<&[u32]> {
        match self.cells.find(p)?.cell {
            Known::Near(words) => Some(words),
            // surroundings of their own for each stretch of time do not pay
            _ if self.solid.moves() => None,
            Known::Fluid | Known::Inside => {
                self.around.find(&self.parts, p).map(|cell| self.around.words(&self.parts, cell))
            }
        }
    }

    /// The value of a tree at up to [`RUN`] points; `factor` is what a leaf's value is multiplied by.
    pub(super) fn run_many(
        &self,
        words: &[u32],
        at: &mut usize,
        points: [&[f64]; 3],
        factor: &impl Fn(u32) -> f64,
        out: &mut [f64],
    ) {
        let word = Word::read(words[*at]);
        *at += 1;
        let (parts, all) = match word {
            Word::Leaf { leaf, negated } => {
                self.parts.leaves.values(leaf, points, out);
                let factor = signed(factor(leaf), negated);
                return out.iter_mut().for_each(|v| *v *= factor);
            }
            Word::All(parts) => (parts, true),
            Word::Any(parts) => (parts, false),
        };
        self.run_many(words, at, points, factor, out);
        let mut other = [0.0; RUN];
        let other = &mut other[..out.len()];
        for _ in 1..parts {
            self.run_many(words, at, points, factor, other);
            for (best, next) in out.iter_mut().zip(&*other) {
                let wins = if all { *next < *best } else { *next > *best };
                if wins || next.is_nan() {
                    *best = *next;
                }
            }
        }
    }

    /// The surface nearest to a point, as a tree says: the distance to "all of" is the largest, to "any
    /// of" the smallest.
    fn nearest(&self, words: &[u32], at: &mut usize, p: DVec3) -> Nearest {
        let word = Word::read(words[*at]);
        *at += 1;
        let (parts, all) = match word {
            Word::Leaf { leaf, negated } => {
                return Nearest::of(leaf, self.parts.leaves.contact(leaf, p), negated);
            }
            Word::All(parts) => (parts, true),
            Word::Any(parts) => (parts, false),
        };
        let mut best = self.nearest(words, at, p);
        for _ in 1..parts {
            let next = self.nearest(words, at, p);
            let wins = if all { next.distance > best.distance } else { next.distance < best.distance };
            if wins || next.distance.is_nan() {
                best = next;
            } else if next.distance == best.distance {
                best = best.mean(&next);
            }
        }
        best
    }

    /// The value at many points: `free` gives its magnitude where there is no surface, from the cell's depth.
    fn evaluate(&self, points: Points<'_>, omega: &mut [f64], free: impl Fn(u32) -> f64) {
        let mut found: [Option<Found<'_>>; RUN] = [None; RUN];
        for first in (0..points.len()).step_by(RUN) {
            let count = RUN.min(points.len() - first);
            for (k, found) in found[..count].iter_mut().enumerate() {
                *found = self.cells.find(points.get(first + k));
            }
            let mut k = 0;
            while k < count {
                let Some(Found { cell, depth, place }) = found[k] else {
                    omega[first + k] = self.twin.omega(points.get(first + k));
                    k += 1;
                    continue;
                };
                let Known::Near(words) = cell else {
                    omega[first + k] = if matches!(cell, Known::Inside) { free(depth) } else { -free(depth) };
                    k += 1;
                    continue;
                };
                let same = |other: &&Option<Found<'_>>| other.is_some_and(|other| other.place == place);
                let length = found[k..count].iter().take_while(same).count();
                let run = first + k..first + k + length;
                if length >= SHORTEST_RUN {
                    let columns = [points.x, points.y, points.z].map(|c| &c[run.clone()]);
                    self.run_many(words, &mut 0, columns, &|_| 1.0, &mut omega[run]);
                } else {
                    for i in run {
                        omega[i] = self.run(words, points.get(i)).0;
                    }
                }
                k += length;
            }
        }
    }

    /// Whether a path that does not leave its cell surely stays in the fluid.
    fn stays_out(&self, path: &Path) -> bool {
        match (self.cells.find(path.from), self.cells.find(path.to)) {
            (Some(from), Some(to)) if from.place == to.place => match from.cell {
                Known::Near(words) => Sweep::new(&self.parts.leaves, path).stays_out(words),
                Known::Fluid => true,
                Known::Inside => false,
            },
            _ => false,
        }
    }

    /// The first entry on a path within the box, cell by cell.
    fn walk(&self, path: &Path) -> Option<Entry> {
        // half of what the cells were grown by: the next look-up is then surely in the next cell
        let beyond = 0.5 * (self.margin - self.reach);
        let step = path.to - path.from;
        let mut t = path.start;
        while let Some(Found { cell, depth, .. }) = self.cells.find(path.at(t)) {
            let bounds = self.cells.bounds_at(path.at(t), depth).grown(beyond);
            let side = DVec3::select(step.cmpgt(DVec3::ZERO), bounds.max, bounds.min);
            // a component that does not move never leaves: its quotient is infinite or NaN
            let leave = ((side - path.from) / step).to_array().into_iter().filter(|t| t.is_finite());
            let end = leave.fold(1.0, f64::min).max(t);
            match cell {
                Known::Inside => return Some(Entry::new(path, (t, end), true, Normals::default())),
                Known::Near(words) => {
                    let entry = Sweep::new(&self.parts.leaves, path).first_entry(words, (t, end));
                    match entry {
                        // the border of the cell has cut off the part that would decide it
                        Some(entry) if !entry.certain && entry.until >= end && end < 1.0 => {
                            return self.twin.first_entry(&Path { start: entry.t, ..*path });
                        }
                        Some(_) => return entry,
                        None => {}
                    }
                }
                Known::Fluid => {}
            }
            if end >= 1.0 {
                return None;
            }
            if end <= t {
                break; // the path is shorter than its rounding errors
            }
            t = end;
        }
        self.twin.first_entry(&Path { start: t, ..*path })
    }
}

impl Nearest {
    #[inline]
    fn of(leaf: u32, Contact { distance, normal, mean_curvature }: Contact, negated: bool) -> Self {
        let sign = if negated { -1.0 } else { 1.0 };
        let normal = sign * normal;
        let mean_curvature = sign * mean_curvature;
        Self { distance: sign * distance, normal, mean_curvature, tied: false, leaf }
    }

    fn mean(&self, other: &Self) -> Self {
        let normal = 0.5 * (self.normal + other.normal);
        let mean_curvature = 0.5 * (self.mean_curvature + other.mean_curvature);
        Self { distance: self.distance, normal, mean_curvature, tied: true, leaf: self.leaf }
    }

    fn velocity(&self, leaves: &Leaves, p: DVec3) -> DVec3 {
        self.contact().velocity_at_foot(p, |at| leaves.velocity(self.leaf, at))
    }

    #[inline]
    fn contact(self) -> Contact {
        let normal = if self.tied { self.normal.normalize_or_zero() } else { self.normal };
        Contact { distance: self.distance, normal, mean_curvature: self.mean_curvature }
    }
}

impl Field for CellMap {
    fn omega(&self, p: DVec3) -> f64 {
        match self.cells.find(p) {
            Some(Found { cell: Known::Fluid, depth, .. }) => -self.cells.shortest_side(depth),
            Some(Found { cell: Known::Inside, depth, .. }) => self.cells.shortest_side(depth),
            Some(Found { cell: Known::Near(words), .. }) => self.run(words, p).0,
            _ => self.twin.omega(p),
        }
    }

    fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        let Some(words) = self.words_for(p) else { return self.twin.omega_grad(p) };
        let (value, (leaf, negated)) = self.run(words, p);
        let gradient = self.parts.leaves.gradient(leaf, p).1;
        (value, if negated { -gradient } else { gradient })
    }

    fn omega_grad_many(&self, points: Points<'_>, out: GradientsMut<'_>) {
        self.gradients(points, out);
    }

    fn continuous(&self, p: DVec3) -> f64 {
        self.value(p)
    }

    fn continuous_many(&self, points: Points<'_>, omega: &mut [f64]) {
        self.values(points, omega);
    }

    fn omega_many(&self, points: Points<'_>, omega: &mut [f64]) {
        self.evaluate(points, omega, |depth| self.cells.shortest_side(depth));
    }

    fn range(&self, over: &Aabb) -> Interval {
        self.range_by_cells(over).unwrap_or_else(|| {
            // leaf by leaf: a range program of thousands of leaves takes seconds to compile
            match judged(&self.parts, over, &self.parts.words).0 {
                Verdict::Inside => Interval::new(f64::MIN_POSITIVE, f64::INFINITY),
                Verdict::Outside => Interval::new(f64::NEG_INFINITY, -f64::MIN_POSITIVE),
                Verdict::Near => Interval::ALL,
            }
        })
    }

    fn sheets(&self, over: &Aabb, visit: &mut dyn FnMut(Sheet<'_>)) -> bool {
        if !self.is_within(over) {
            return self.twin.sheets(over, visit);
        }
        let (mut known, mut last) = (Vec::new(), None);
        let of_cell = &mut |cell: Known<'_>, _: u32| -> ControlFlow<()> {
            if let Known::Near(words) = cell
                && last != Some(words.as_ptr())
            {
                last = Some(words.as_ptr());
                self.parts.leaves.sheets(words, over, &mut known, visit);
            }
            ControlFlow::Continue(())
        };
        if self.cells.visit(over, MOST_TOUCHED, of_cell).is_none() {
            return self.twin.sheets(over, visit);
        }
        true
    }
}

impl CellMap {
    fn is_within(&self, over: &Aabb) -> bool {
        let domain = self.cells.domain();
        domain.union(over) == domain && !over.is_empty()
    }

    /// The range over a box from the cells that it touches: as soon as both signs are found, all numbers.
    /// `None` for a box that is not in the domain, or touches too many cells.
    fn range_by_cells(&self, over: &Aabb) -> Option<Interval> {
        if !self.is_within(over) {
            return None;
        }
        KnownRanges::with(self.parts.leaves.len(), |known| {
            let (mut all, mut last): (Option<Interval>, _) = (None, None);
            let of_cell = &mut |cell: Known<'_>, depth: u32| {
                // what stands for ω where only its sign is known
                let free = self.cells.shortest_side(depth);
                let range = match cell {
                    Known::Fluid => Interval::point(-free),
                    Known::Inside => Interval::point(free),
                    // cells beside each other often share their words
                    Known::Near(words) if last == Some(words.as_ptr()) => return ControlFlow::Continue(()),
                    Known::Near(words) => {
                        last = Some(words.as_ptr());
                        self.parts.leaves.range_of_tree(words, &mut 0, over, known)
                    }
                };
                let hull = all.map_or(range, |all| all.hull(range));
                all = Some(hull);
                if hull.lo <= 0.0 && hull.hi > 0.0 {
                    return ControlFlow::Break(());
                }
                ControlFlow::Continue(())
            };
            match self.cells.visit(over, MOST_TOUCHED, of_cell)? {
                ControlFlow::Break(()) => Some(Interval::ALL),
                ControlFlow::Continue(()) => all,
            }
        })
    }
}

impl Walls for CellMap {
    /// The map knows no face that is farther away than its own reach.
    fn faces(&self, p: DVec3, reach: f64, faces: &mut Faces) {
        match self.cells.find(p).map(|found| found.cell) {
            Some(Known::Near(words)) => {
                self.parts.leaves.add_faces(words, 0, p, reach, faces);
            }
            Some(Known::Fluid) => {}
            _ => self.parts.leaves.add_faces(&self.parts.words, 0, p, reach, faces),
        }
    }

    fn on_path(&self, path: &Path, t: f64) -> f64 {
        if self.solid.moves() { self.twin.on_path(path, t) } else { self.omega(path.at(t)) }
    }

    fn wall_velocity(&self, p: DVec3) -> DVec3 {
        if !self.solid.moves() {
            return DVec3::ZERO;
        }
        if let Some(twist) = self.solid.twist() {
            return twist.at(p);
        }
        match self.cells.find(p).map(|found| found.cell) {
            Some(Known::Near(words)) => self.nearest(words, &mut 0, p).velocity(&self.parts.leaves, p),
            _ => self.solid.wall_velocity(p),
        }
    }

    fn clearance(&self, p: DVec3, most: f64) -> f64 {
        match self.cells.find(p).map(|found| found.cell) {
            Some(Known::Fluid) if most <= self.reach => most,
            Some(Known::Fluid) => clearance_by_ranges(self, p, most).max(self.reach),
            Some(Known::Near(words)) => {
                // a cube around the point, with its corners at the surface's distance, or with less than half
                // of that; what the cell has kept is right within the reach
                let distance = self.nearest(words, &mut 0, p).distance.min(self.reach);
                let is_proven = |radius: f64| {
                    let cube = Aabb::new(p, p).grown(radius);
                    self.parts.leaves.is_negative(words, &cube)
                };
                let radii = [0.57, 0.25].map(|part| (part * distance).min(most));
                radii.into_iter().find(|&radius| radius > 0.0 && is_proven(radius)).unwrap_or(0.0)
            }
            _ => 0.0,
        }
    }

    fn is_outside(&self, over: &Aabb) -> bool {
        // the cells that a box touches are often more than all leaves
        self.has_few_leaves && self.parts.leaves.is_negative(&self.parts.words, over)
            || self.range(over).hi < 0.0
    }

    fn is_far(&self, over: &Aabb, reach: f64) -> bool {
        let domain = self.cells.domain();
        if !(domain.contains(over.min) && domain.contains(over.max)) {
            return self.twin.is_far(over, reach);
        }
        reach <= self.reach && self.cells.is_fluid(over, MOST_TOUCHED)
    }

    fn surroundings(&self, domain: &Aabb, reach: f64) -> Option<Aabb> {
        let own = self.cells.domain();
        let is_known = reach <= self.reach && own.contains(domain.min) && own.contains(domain.max);
        is_known.then(|| self.cells.occupied())
    }

    fn first_entry(&self, path: &Path) -> Option<Entry> {
        let domain = self.cells.domain();
        if domain.contains(path.from) && domain.contains(path.to) {
            if self.stays_out(path) { None } else { self.walk(path) }
        } else {
            self.twin.first_entry(path)
        }
    }
}

#[inline]
pub(super) fn signed(value: f64, negated: bool) -> f64 {
    if negated { -value } else { value }
}
