//! A closer look into one cell: which faces it holds, and whether the grid knows them.

use std::cell::RefCell;

use glam::DVec3;
use smallvec::SmallVec;

use super::super::{normals::unit, prune::Lattice};
use super::edges::BrickEdges;
use super::found::ThinCells;
use crate::field::{Field, Points, Sheet};
use crate::geom::Aabb;
use crate::interval::Interval;

/// A face that agrees more than this (cosine) with one that the grid has seen nearby is known.
const KNOWN: f64 = 0.6;

/// Faces that agree less than this (cosine) back onto each other: a wall, a gap, or a wedge of 37° or less.
const OPPOSED: f64 = -0.8;

/// The number of times that a cell is halved on each axis.
const HALVINGS: u32 = 3;

/// Faces whose directions agree less than this (cosine) are not parallel.
const PARALLEL: f64 = 0.9;

/// Distances from a surface, in cells, at which ω must have both signs for one of them.
const BESIDE: [f64; 3] = [1e-2, 1e-4, 1e-6];

/// The most that outward rounding may leave of a slope that is zero.
const NO_SLOPE: f64 = f64::MIN_POSITIVE;

/// Maximum number of steps of Newton's method onto a face, and that of steps each of which is at most such a part of the
/// one before. The distance from what is much thinner than that, as a ball or a slit, is halved until it is as near.
const STEPS: usize = 8;
const STEPS_OF_HALVES: usize = 40;
const NEARLY_HALF: f64 = 0.6;

/// A point nearer to a face than this, in cells, is on it.
const ON_FACE: f64 = 1e-8;

/// Faces that agree more than this (cosine) with each other's backs are those of a wall or a gap, and others
/// those of a wedge of ten degrees or more.
const WALL: f64 = 0.985;

/// Faces that agree more than this (cosine) with each other's backs, at four degrees or less, are those of no wedge.
const NARROWEST: f64 = 0.998;

/// How far a wedge is followed, in units of the distance at which plane faces are two cells apart, and in how
/// many steps.
const FARTHER: f64 = 2.0;
const STEPS_ALONG: u32 = 32;

/// Steps along the edge of a wedge for each step away from it, in the order in which they are tried.
const SIDEWAYS: [f64; 5] = [0.0, 1.0, -1.0, 3.0, -3.0];

/// Greatest growth from one step to the next, and the thickness, in cells, from which growth is counted.
const GROWTH: f64 = 2.0;
const GROWTH_OF_CELL: f64 = 0.5;

/// Steps to its faces, and bisections of the last one.
const STEPS_TO_END: usize = 16;
const HALVED_TO_END: usize = 8;

/// Along faces that agree more than this (cosine) with a face, or with its back, there is no other way across.
const PARALLEL_TO_OWN: f64 = 0.9999;

/// A face that agrees more than this (cosine) with the way to it ends a thickness.
const BACK: f64 = 0.5;

/// The longest way in cells over which a thickness is measured, and its steps.
const THICKEST: f64 = 2.0;
const STEPS_ACROSS: usize = 64;

/// Number of points that are evaluated together.
const TOGETHER: usize = 16;

/// How far beyond the cell, in cells, a point of the surface still counts as its own: a part that passes just
/// between the nodes leaves next to nothing in the cell itself.
const BESIDE_CELL: f64 = 1.0 / 16.0;

/// Bisections of a step across. They leave a millionth of it.
const HALVED: usize = 20;

type Normals = SmallVec<[DVec3; 16]>;

/// What a face's gradient may be in a box.
type Slopes = [Interval; 3];

pub(super) fn is_decided(range: Interval) -> bool {
    range.lo > 0.0 || range.hi <= 0.0
}

/// Whether a box holds a single face that nearly keeps its direction.
pub(super) fn is_one_sheet(field: &dyn Field, over: &Aabb) -> bool {
    let (mut count, mut keeps) = (0, true);
    let all = field.sheets(over, &mut |sheet| {
        count += 1;
        keeps &= middle(&sheet).is_some_and(|way| agrees(&sheet.slopes, way, KNOWN));
    });
    all && keeps && count <= 1
}

/// The outward direction in the middle of a face's slopes.
fn middle(sheet: &Sheet<'_>) -> Option<DVec3> {
    unit(-DVec3::from_array(sheet.slopes.map(|slope| 0.5 * slope.lo + 0.5 * slope.hi)))
}

/// Whether all outward normals that the slopes allow agree with a direction by more than a cosine below 1.
fn agrees(slopes: &[Interval; 3], way: DVec3, cosine: f64) -> bool {
    // g·w − c·|g| is concave in g, so its least value over a box is at a corner
    (0..8).all(|corner: usize| {
        let end = |axis: usize| if corner >> axis & 1 == 0 { slopes[axis].lo } else { slopes[axis].hi };
        let g = -DVec3::new(end(0), end(1), end(2));
        g.dot(way) > cosine * g.length() // false for NaN and infinity
    })
}

/// A cell to look into.
pub(super) struct Look<'a> {
    pub field: &'a dyn Field,
    pub lattice: &'a Lattice,
    /// What is known of the edges in and around its brick.
    pub edges: &'a RefCell<BrickEdges>,
    /// The extended indices of its low corner.
    pub low: [usize; 3],
    pub bounds: Aabb,
    pub is_crossed: bool,
    /// Whether the signs at its corners leave a choice.
    pub is_undecided: bool,
}

/// What the grid has seen.
struct Seen {
    /// Outward normals where the surface crosses edges of this cell and of those around it.
    around: Normals,
    /// Those of this cell alone.
    own: Normals,
}

/// What is found in a cell.
#[derive(Default)]
struct Findings {
    /// Directions of faces that are proven to be known.
    proven: Normals,
    /// Boxes in which a face is not proven to be known.
    open: SmallVec<[Aabb; 32]>,
    /// Boxes with a face.
    held: SmallVec<[Aabb; 32]>,
}

/// A point of the surface.
#[derive(Clone, Copy)]
struct Foot {
    at: DVec3,
    /// The outward unit normal.
    normal: DVec3,
}

/// What lies across a part or a gap.
#[derive(Clone, Copy)]
struct Across {
    /// m; infinite if there is nothing near.
    thickness: f64,
    /// The outward unit normal of the face there.
    normal: DVec3,
    /// The unit vector towards it.
    way: DVec3,
}

impl Across {
    const FAR: Self = Self { thickness: f64::INFINITY, normal: DVec3::ZERO, way: DVec3::ZERO };
}

impl Look<'_> {
    /// The cell, if it holds a surface that the grid does not know.
    pub fn into_cell(self) -> ThinCells {
        if self.is_crossed && self.shows_all() {
            return ThinCells::NONE;
        }
        let seen = self.seen();
        let mut findings = Findings::default();
        self.divide(&self.bounds, &seen, HALVINGS, &mut findings);
        // where the signs leave a choice, walls that are seen on both sides may still have holes
        let own = if self.is_undecided { &[][..] } else { &seen.own[..] };
        let opposed = |all: &[DVec3]| has_opposed(all, own);
        if findings.open.is_empty() && !opposed(&findings.proven) {
            return ThinCells::NONE;
        }
        let is_opposed = opposed(&findings.proven);
        let boxes = if is_opposed { &findings.held } else { &findings.open };
        let mut normals: Normals = SmallVec::new();
        let mut unmeasured = ThinCells::NONE;
        for part in boxes {
            for foot in self.feet(part) {
                let is_known = is_known(foot.normal, &seen.around);
                if !normals.iter().any(|other| other.dot(foot.normal) > 0.98) {
                    normals.push(foot.normal);
                } else if is_known {
                    continue;
                }
                if !is_known || opposed(&normals) {
                    let counted = self.counted(foot, &seen);
                    if counted.count > 0 && counted.thickness.is_finite() {
                        return counted;
                    }
                    // the face at the end of a tip has nothing across, while those beside it may have
                    if unmeasured.count == 0 {
                        unmeasured = counted;
                    }
                }
            }
        }
        unmeasured
    }

    /// Whether the cell holds one face, or only faces that its own edges show. Most cells do, and need no look
    /// around.
    fn shows_all(&self) -> bool {
        let mut faces: SmallVec<[(Slopes, Option<DVec3>); 8]> = SmallVec::new();
        let all = self.field.sheets(&self.bounds, &mut |sheet| faces.push((sheet.slopes, middle(&sheet))));
        if !all {
            return false;
        }
        let is_even = |(slopes, way): &(Slopes, Option<DVec3>)| way.is_some_and(|w| agrees(slopes, w, KNOWN));
        if faces.len() <= 1 && faces.iter().all(is_even) {
            return true;
        }
        let own = self.own_normals();
        let mut ways: Normals = SmallVec::new();
        for (slopes, way) in &faces {
            if !own.iter().any(|normal| agrees(slopes, *normal, KNOWN)) {
                return false;
            }
            ways.extend(*way);
        }
        !has_opposed(&ways, if self.is_undecided { &[] } else { &own })
    }

    /// The normals where the surface crosses the edges of this cell.
    fn own_normals(&self) -> Normals {
        let Self { field, lattice, low, .. } = *self;
        let mut edges = self.edges.borrow_mut();
        let node = |corner: usize| [0, 1, 2].map(|axis: usize| low[axis] + (corner >> axis & 1));
        let inside: [bool; 8] = std::array::from_fn(|c| edges.is_inside((field, lattice), node(c)));
        let mut own: Normals = SmallVec::new();
        for corner in 0..8 {
            for axis in (0..3).filter(|axis| corner >> axis & 1 == 0) {
                if inside[corner] != inside[corner | 1 << axis] {
                    own.extend(edges.normal((field, lattice), node(corner), (axis, inside[corner])));
                }
            }
        }
        own
    }

    /// Divides a box until its faces are proven to be known, or are one or several parallel ones, or as often as
    /// `halvings` allows. An axis along which all of them run stays whole: every part would show the same.
    fn divide(&self, over: &Aabb, seen: &Seen, halvings: u32, findings: &mut Findings) {
        let range = self.field.range(over);
        if is_decided(range) {
            return;
        }
        let mut normals: Normals = SmallVec::new();
        let (mut known, mut flat) = (true, true);
        let mut varies = [false; 3];
        let all = self.field.sheets(over, &mut |sheet| {
            for (varies, slope) in varies.iter_mut().zip(sheet.slopes) {
                *varies |= slope.lo < -NO_SLOPE || slope.hi > NO_SLOPE;
            }
            let middle = middle(&sheet);
            // the middle is among what the slopes allow, so most normals are soon ruled out
            known &= middle.is_some_and(|way| {
                let mut may = seen.around.iter().filter(|normal| normal.dot(way) > KNOWN - 1e-9);
                may.any(|normal| agrees(&sheet.slopes, *normal, KNOWN))
            });
            flat &= middle.is_some_and(|way| agrees(&sheet.slopes, way, PARALLEL));
            normals.extend(middle);
        });
        if all && known {
            if !normals.is_empty() {
                findings.held.push(*over);
                for normal in normals {
                    if !findings.proven.iter().any(|other| other.dot(normal) > 0.98) {
                        findings.proven.push(normal);
                    }
                }
            }
            return;
        }
        flat &= normals.iter().all(|way| way.dot(normals[0]).abs() > PARALLEL);
        if halvings == 0 || flat || !all {
            findings.held.push(*over);
            findings.open.push(*over);
            return;
        }
        let centre = over.centre();
        for number in 0..8_usize {
            let is_upper = |axis: usize| number >> axis & 1 == 1;
            if (0..3).any(|axis| is_upper(axis) && !varies[axis]) {
                continue;
            }
            let mut part = *over;
            for axis in (0..3).filter(|&axis| varies[axis]) {
                let bound = if is_upper(axis) { &mut part.min } else { &mut part.max };
                bound[axis] = centre[axis];
            }
            self.divide(&part, seen, halvings - 1, findings);
        }
    }

    /// Points of the surface in a box or a little beside it, at most one for each face and start.
    fn feet(&self, over: &Aabb) -> SmallVec<[Foot; 8]> {
        let mut found: SmallVec<[Foot; 8]> = SmallVec::new();
        let reach = 0.5 * over.size();
        let within = Aabb::new(over.min - reach, over.max + reach);
        let size = self.bounds.size().min_element();
        let own = self.bounds.grown(BESIDE_CELL * size);
        let mut seek = |at: &dyn Fn(DVec3) -> (f64, DVec3)| {
            for start in std::iter::once(over.centre()).chain(over.corners()) {
                let Some(foot) = descend(at, start, &within, size) else { continue };
                let is_new = |other: &Foot| other.normal.dot(foot.normal) < 0.95;
                if own.contains(foot.at) && found.iter().all(is_new) && self.is_surface(&foot, size) {
                    found.push(foot);
                }
            }
        };
        let all = self.field.sheets(over, &mut |sheet| seek(sheet.at));
        if !all {
            seek(&|p| self.field.omega_grad(p));
        }
        found
    }

    /// Whether ω changes its sign at a point.
    fn is_surface(&self, foot: &Foot, size: f64) -> bool {
        BESIDE.iter().any(|beside| {
            let step = beside * size * foot.normal;
            self.omega(foot.at - step) > 0.0 && self.omega(foot.at + step) <= 0.0
        })
    }

    /// ω of the solid as the grid closes it: nothing beyond the grid lies inside.
    fn omega(&self, p: DVec3) -> f64 {
        if self.lattice.whole().contains(p) { self.field.omega(p) } else { f64::NEG_INFINITY }
    }

    /// The count of this cell, with the thickness at a point that the grid does not know. Nothing if the grid
    /// knows other faces nearby, and what the face belongs to is thicker than two cells.
    fn counted(&self, foot: Foot, seen: &Seen) -> ThinCells {
        // across the face, and along the faces beside it: a bump on a wall is as thin as it is wide
        let others = seen.around.iter().filter(|n| n.dot(foot.normal).abs() < PARALLEL_TO_OWN);
        let beside = others.filter_map(|n| unit(foot.normal - n.dot(foot.normal) * *n));
        let ways = || std::iter::once(foot.normal).chain(beside.clone());
        let least = |inside: bool| {
            let sign = if inside { -1.0 } else { 1.0 };
            let thinner = |a: Across, b: Across| if b.thickness < a.thickness { b } else { a };
            ways().map(|way| self.across(foot.at, sign * way, inside)).fold(Across::FAR, thinner)
        };
        let (wall, gap) = (least(true), least(false));
        let is_gap = gap.thickness < wall.thickness;
        let Across { thickness, normal, .. } = if is_gap { gap } else { wall };
        if thickness == f64::INFINITY && !seen.around.is_empty() {
            return ThinCells::NONE; // a step or an edge of something thick
        }
        // the edge of something that the grid knows: both faces are seen nearby, and meet at an angle
        let straight = self.across(foot.at, if is_gap { 1.0 } else { -1.0 } * foot.normal, !is_gap);
        let is_known = is_known(foot.normal, &seen.around) && is_known(normal, &seen.around);
        let is_wedge = (thickness == straight.thickness && is_known && normal.dot(foot.normal).abs() < WALL)
            || (thickness.is_finite() && self.opens(&foot, if is_gap { &gap } else { &wall }, is_gap))
            || (straight.thickness.is_finite() && self.opens(&foot, &straight, is_gap));
        ThinCells { count: 1, bounds: self.bounds, thickness, at: foot.at, is_gap, is_wedge, ended: false }
    }

    /// Whether a part, or a gap, is the edge or the tip of something that the grid shows: between the faces that meet
    /// there it grows to the thickness of two cells, and no other face comes in between. Where a third face cuts the
    /// edge off, as at a corner, that may be so only on one side, so ways towards both ends of the edge are tried too.
    fn opens(&self, foot: &Foot, opposite: &Across, is_gap: bool) -> bool {
        let outwards = if is_gap { 1.0 } else { -1.0 };
        let faces = [foot.normal, opposite.normal];
        let cosine = -faces[0].dot(faces[1]);
        let (Some(steepest), Some(across)) =
            (unit(outwards * (faces[0] + faces[1])), unit(faces[0] - faces[1]))
        else {
            return false; // a wall
        };
        if cosine >= NARROWEST {
            return false;
        }
        let edge = steepest.cross(across);
        SIDEWAYS
            .into_iter()
            .any(|sideways| self.opens_along(foot, opposite, steepest + sideways * edge, (across, is_gap)))
    }

    /// Whether it opens along one way: a step straight away from the edge, and one along it.
    fn opens_along(
        &self,
        foot: &Foot,
        opposite: &Across,
        along: DVec3,
        (across, is_gap): (DVec3, bool),
    ) -> bool {
        let outwards = if is_gap { 1.0 } else { -1.0 };
        let faces = [foot.normal, opposite.normal];
        let cosine = -faces[0].dot(faces[1]);
        let cell = self.bounds.size().max_element();
        // as far as plane faces at this angle are that thick, and as far again for curved ones
        let farthest = FARTHER * 0.5 * THICKEST * cell * ((1.0 + cosine) / (1.0 - cosine)).sqrt();
        let mut p = foot.at + 0.5 * opposite.thickness * opposite.way;
        let mut thickness = opposite.thickness;
        for _ in 0..STEPS_ALONG {
            p += along * (farthest / f64::from(STEPS_ALONG));
            // faces look away from a part and into a gap
            let ways = [-outwards * across, outwards * across];
            let ends = [0, 1].map(|side: usize| self.end(p, ways[side], faces[side], is_gap));
            let [Some(first), Some(second)] = ends else { return false };
            let grown = first + second;
            if grown > GROWTH * thickness.max(GROWTH_OF_CELL * cell) {
                return false; // a bump ends, and what it sits on begins
            }
            if grown >= THICKEST * cell {
                return true;
            }
            thickness = grown;
            p += 0.5 * (first - second) * ways[0];
        }
        false
    }

    /// How far a point in a part or in a gap is from a face in one direction, at most two cells. `None` if the point
    /// does not lie there, or another face ends it.
    fn end(&self, from: DVec3, way: DVec3, face: DVec3, is_gap: bool) -> Option<f64> {
        let is_within = |p: DVec3| (self.omega(p) > 0.0) != is_gap;
        if !is_within(from) {
            return None;
        }
        let step = THICKEST * self.bounds.size().max_element() / STEPS_TO_END as f64;
        let ends = |i: usize| step * (i + 1) as f64;
        let Some(mut far) = self.first(STEPS_TO_END, |i| from + ends(i) * way, is_gap).map(ends) else {
            return Some(step * STEPS_TO_END as f64);
        };
        let mut near = far - step;
        for _ in 0..HALVED_TO_END {
            let middle = 0.5 * (near + far);
            if is_within(from + middle * way) { near = middle } else { far = middle }
        }
        let normal = unit(-self.field.omega_grad(from + far * way).1)?;
        (normal.dot(face) > KNOWN).then_some(far)
    }

    /// The way from a point of the surface to where it is met again from inside, or from outside, if the face
    /// there turns its back. Infinite beyond two cells.
    fn across(&self, from: DVec3, way: DVec3, inside: bool) -> Across {
        let step = THICKEST * self.bounds.size().min_element() / STEPS_ACROSS as f64;
        let is_beyond = |t: f64| (self.omega(from + t * way) > 0.0) != inside;
        let ends = |i: usize| step * (i as f64 + 0.5);
        let Some(mut far) = self.first(STEPS_ACROSS, |i| from + ends(i) * way, !inside).map(ends) else {
            return Across::FAR;
        };
        let mut near = f64::max(far - step, 0.0);
        for _ in 0..HALVED {
            let middle = 0.5 * (near + far);
            if is_beyond(middle) { far = middle } else { near = middle }
        }
        let towards = if inside { way } else { -way };
        let end = unit(-self.field.omega_grad(from + far * way).1);
        match end.filter(|normal| normal.dot(towards) > BACK) {
            Some(normal) => Across { thickness: far, normal, way },
            None => Across::FAR,
        }
    }

    /// The first of some points that lies inside, or outside. They are evaluated in columns, a few at a time, because
    /// the search often ends early.
    fn first(&self, count: usize, point: impl Fn(usize) -> DVec3, inside: bool) -> Option<usize> {
        let whole = self.lattice.whole();
        let mut columns = [[0.0; TOGETHER]; 3];
        let mut omega = [0.0; TOGETHER];
        for start in (0..count).step_by(TOGETHER) {
            let size = TOGETHER.min(count - start);
            for k in 0..size {
                let p = point(start + k);
                for (column, coordinate) in columns.iter_mut().zip(p.to_array()) {
                    column[k] = coordinate;
                }
            }
            let [x, y, z] = columns.each_ref().map(|column| &column[..size]);
            let points = Points::new(x, y, z);
            self.field.omega_many(points, &mut omega[..size]);
            let is_inside = |k: usize| omega[k] > 0.0 && whole.contains(points.get(k));
            if let Some(found) = (0..size).find(|k| is_inside(*k) == inside) {
                return Some(start + found);
            }
        }
        None
    }

    /// The normals where the surface crosses the edges of this cell and of those around it.
    fn seen(&self) -> Seen {
        let mut seen = Seen { around: SmallVec::new(), own: SmallVec::new() };
        let Self { field, lattice, .. } = *self;
        // nodes from one below the cell to one above it
        let node = |i: [usize; 3]| [0, 1, 2].map(|axis: usize| self.low[axis] + i[axis] - 1);
        let mut edges = self.edges.borrow_mut();
        let mut inside = [false; 64];
        for (number, inside) in inside.iter_mut().enumerate() {
            let i = [number % 4, number / 4 % 4, number / 16];
            *inside = edges.is_inside((field, lattice), node(i));
        }
        for number in 0..64 {
            let i = [number % 4, number / 4 % 4, number / 16];
            for (axis, step) in [1, 4, 16].into_iter().enumerate() {
                if i[axis] == 3 || inside[number] == inside[number + step] {
                    continue;
                }
                let Some(normal) = edges.normal((field, lattice), node(i), (axis, inside[number])) else {
                    continue;
                };
                let beside = [(axis + 1) % 3, (axis + 2) % 3];
                if i[axis] == 1 && beside.iter().all(|&axis| i[axis] == 1 || i[axis] == 2) {
                    seen.own.push(normal);
                }
                if !seen.around.iter().any(|other| other.dot(normal) > 0.999) {
                    seen.around.push(normal);
                }
            }
        }
        seen
    }
}

/// The surface of a face by Newton's method. `None` if it leaves the box or does not settle.
fn descend(at: &dyn Fn(DVec3) -> (f64, DVec3), start: DVec3, within: &Aabb, size: f64) -> Option<Foot> {
    let mut p = start;
    let mut last = f64::INFINITY;
    for number in 0..STEPS_OF_HALVES {
        let (omega, gradient) = at(p);
        let step = gradient * (omega / gradient.length_squared());
        p -= step;
        if !p.is_finite() || !within.contains(p) {
            return None;
        }
        let length = step.length();
        if length <= ON_FACE * size {
            return Some(Foot { at: p, normal: unit(-gradient)? });
        }
        if number + 1 >= STEPS && length > NEARLY_HALF * last {
            return None;
        }
        last = length;
    }
    None
}

fn is_known(normal: DVec3, seen: &[DVec3]) -> bool {
    seen.iter().any(|other| other.dot(normal) > KNOWN)
}

/// Whether two of the normals are opposed and the cell's own edges do not show both.
fn has_opposed(all: &[DVec3], own: &[DVec3]) -> bool {
    all.iter().enumerate().any(|(i, a)| {
        all[..i].iter().any(|b| a.dot(*b) < OPPOSED && !(is_known(*a, own) && is_known(*b, own)))
    })
}
