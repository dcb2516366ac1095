//! Boxes within boxes: the triangle that is nearest to a point, and the triangles that a ray passes.
//!
//! Groups of equally many triangles keep the tree low whatever the triangles are. Each branch has four of them.

use std::ops::Range;

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::boxes::{Boxes, View, WIDTH};
use super::nearest::{Nearest, on_triangle};
use super::surface::Surface;
use crate::geom::Aabb;

/// The most triangles of a leaf.
const LEAF: usize = 2;

/// More than what waits on the way down in a tree of 2²⁶ triangles: three boxes on each of its levels.
const DEEPEST: usize = 64;

/// Boxes with more triangles near them are too large for their normals to say much.
const MOST_NORMALS: usize = 64;

/// Triangles count as within a distance if they exceed it by at most this.
const SLACK: f64 = 1.0 + 1e-12;

/// Where a ray begins on a triangle, relative to the size of the surface.
const TOUCHING: f64 = 1e-12;

/// What files in single precision round coordinates by, some times over, relative to the size of the surface.
pub(super) const ROUNDED: f64 = 1e-6;

/// Edges that reach less far through a triangle, relative to the size of the surface, are let pass: beside a triangle
/// that is as narrow as it is rounded, its neighbours may fold over each other by some times that.
const SHALLOW: f64 = 2e-5;

/// The least width of a triangle that edges are tested for, in terms of that.
const NARROW: f64 = 5.0;

/// No two components are in a ratio that surfaces are likely to have.
const DIRECTIONS: [DVec3; 4] = [
    DVec3::new(0.531_742_918_3, 0.284_619_577_1, 0.797_633_205_4),
    DVec3::new(-0.712_390_114_7, 0.437_175_902_6, 0.549_008_371_2),
    DVec3::new(0.298_047_663_9, -0.861_205_347_8, 0.411_764_150_7),
    DVec3::new(-0.403_881_206_5, -0.590_412_738_1, -0.698_790_035_6),
];

pub struct Tree {
    branches: Vec<Branch>,
    /// The triangles in the order of the leaves.
    pieces: Vec<Piece>,
    /// Their corners, in the order in which the leaves list them.
    places: Vec<DVec3>,
    root: Child,
}

#[repr(align(64))]
struct Branch {
    boxes: Boxes,
    children: [Child; WIDTH],
}

/// A triangle of a leaf.
struct Piece {
    /// Numbers of its corners in the tree.
    corners: [u32; 3],
    /// Its number in the surface.
    triangle: u32,
}

/// Where a branch or a leaf is, in few bytes.
#[derive(Clone, Copy)]
struct Child(u32);

enum Found {
    Branch(usize),
    /// Triangles in the tree's order.
    Leaf(Range<usize>),
}

impl Child {
    const NOTHING: Self = Self::leaf(0, 0);
    /// Bits of the number of a branch or of a leaf's first triangle; those above are one more than the number of
    /// triangles, and 0 for a branch.
    const BITS: u32 = 28;

    const fn leaf(first: usize, count: usize) -> Self {
        Self(first as u32 | (count as u32 + 1) << Self::BITS)
    }

    const fn branch(place: usize) -> Self {
        Self(place as u32)
    }

    fn found(self) -> Found {
        let first = (self.0 & ((1 << Self::BITS) - 1)) as usize;
        match self.0 >> Self::BITS {
            0 => Found::Branch(first),
            more => Found::Leaf(first..first + more as usize - 1),
        }
    }
}

/// What a ray passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossings {
    /// How often it leaves the solid, less how often it enters it.
    pub winding: i32,
    pub direction: DVec3,
    /// Whether it begins on a triangle.
    pub touches: bool,
}

/// A triangle while the tree is made.
#[derive(Clone, Copy)]
struct Member {
    triangle: u32,
    centre: DVec3,
}

/// Triangles and the place of the first of them in the tree.
type Group<'m> = (usize, &'m mut [Member]);

impl Tree {
    pub fn new(surface: &Surface) -> Self {
        let member = |triangle: u32| {
            let [a, b, c] = surface.corners_of(triangle);
            Member { triangle, centre: 0.5 * (a.min(b).min(c) + a.max(b).max(c)) }
        };
        let mut members: Vec<Member> = (0..surface.len() as u32).map(member).collect();
        let mut tree =
            Self { branches: Vec::new(), pieces: Vec::new(), places: Vec::new(), root: Child::NOTHING };
        tree.root = tree.part(surface, (0, &mut members));
        let mut numbers = FxHashMap::default();
        for member in members {
            let corners = surface.numbers_of(member.triangle).map(|corner| {
                *numbers.entry(corner).or_insert_with(|| {
                    tree.places.push(surface.place(corner));
                    tree.places.len() as u32 - 1
                })
            });
            tree.pieces.push(Piece { corners, triangle: member.triangle });
        }
        tree
    }

    /// The branch or leaf of some members, which are put in the order of the leaves; `first` is the place of the first
    /// one.
    fn part(&mut self, surface: &Surface, (first, members): Group<'_>) -> Child {
        if members.len() <= LEAF {
            return Child::leaf(first, members.len());
        }
        let (low, high) = halves((first, members));
        let mut groups = Vec::with_capacity(WIDTH);
        for half in [low, high] {
            if half.1.len() <= LEAF {
                groups.push(half);
            } else {
                groups.extend(<[_; 2]>::from(halves(half)));
            }
        }
        let mut boxes = Boxes::EMPTY;
        for (lane, (_, group)) in groups.iter().enumerate() {
            let corners: Vec<[DVec3; 3]> =
                group.iter().map(|member| surface.corners_of(member.triangle)).collect();
            boxes.set(lane, &corners, surface.space());
        }
        let place = self.branches.len();
        self.branches.push(Branch { boxes, children: [Child::NOTHING; WIDTH] });
        for (lane, group) in groups.into_iter().enumerate() {
            self.branches[place].children[lane] = self.part(surface, group);
        }
        Child::branch(place)
    }

    fn corners(&self, piece: &Piece) -> [DVec3; 3] {
        piece.corners.map(|corner| self.places[corner as usize])
    }

    /// The number that the surface has for a triangle of the tree.
    pub fn triangle(&self, place: u32) -> u32 {
        self.pieces[place as usize].triangle
    }

    /// The place in the tree of the triangle that is nearest to a point, the first one of the surface if
    /// there are several, and its nearest point. The search begins with the triangle at `last`, which decides
    /// nothing but its cost.
    pub fn nearest(&self, surface: &Surface, p: DVec3, last: Option<u32>) -> (u32, Nearest) {
        let look = |place: usize| on_triangle(p, self.corners(&self.pieces[place]));
        let first = last.filter(|&place| (place as usize) < self.pieces.len()).unwrap_or(0);
        let mut best = (first as usize, look(first as usize));
        let view = View::new(p, surface.space());
        let mut limit = view.limit(best.1.square);
        let mut stack = [(self.root, 0.0); DEEPEST];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (child, square) = stack[height];
            if square > limit {
                continue;
            }
            match child.found() {
                Found::Leaf(places) => {
                    for place in places {
                        let found = look(place);
                        let number = |place: usize| self.pieces[place].triangle;
                        if found.square < best.1.square
                            || found.square == best.1.square && number(place) < number(best.0)
                        {
                            best = (place, found);
                            limit = view.limit(found.square);
                        }
                    }
                }
                Found::Branch(i) => {
                    let Branch { boxes, children } = &self.branches[i];
                    let base = height;
                    for (square, &child) in boxes.squares(&view).into_iter().zip(children) {
                        if square > limit {
                            continue;
                        }
                        // the nearest one is on top
                        let mut place = height;
                        while place > base && stack[place - 1].1 < square {
                            stack[place] = stack[place - 1];
                            place -= 1;
                        }
                        stack[place] = (child, square);
                        height += 1;
                    }
                }
            }
        }
        (best.0 as u32, best.1)
    }

    /// The least and the greatest components of the normals of all triangles within a distance of a point,
    /// and the sum of the normals. `None` if there are many, or if one of them has no area.
    pub fn normals_within(
        &self,
        surface: &Surface,
        p: DVec3,
        distance: f64,
    ) -> Option<(DVec3, DVec3, DVec3)> {
        let view = View::new(p, surface.space());
        let square = distance * distance;
        let limit = view.limit(square);
        let (mut low, mut high, mut sum) = (DVec3::INFINITY, DVec3::NEG_INFINITY, DVec3::ZERO);
        let mut stack = [self.root; DEEPEST];
        let (mut height, mut met) = (1, 0);
        while height > 0 {
            height -= 1;
            match stack[height].found() {
                Found::Leaf(places) => {
                    for piece in &self.pieces[places] {
                        if on_triangle(p, self.corners(piece)).square > square * SLACK {
                            continue;
                        }
                        let normal = surface.normal_of(piece.triangle)?;
                        (low, high, sum) = (low.min(normal), high.max(normal), sum + normal);
                        met += 1;
                        if met > MOST_NORMALS {
                            return None;
                        }
                    }
                }
                Found::Branch(i) => {
                    let Branch { boxes, children } = &self.branches[i];
                    for (square, &child) in boxes.squares(&view).into_iter().zip(children) {
                        if square <= limit {
                            stack[height] = child;
                            height += 1;
                        }
                    }
                }
            }
        }
        Some((low, high, sum))
    }

    /// What a ray passes, without one triangle that is left out. `None` if each ray that was tried meets an edge.
    pub fn crossings(&self, surface: &Surface, from: DVec3, without: Option<u32>) -> Option<Crossings> {
        DIRECTIONS.into_iter().find_map(|direction| self.passed(surface, (from, direction), without))
    }

    fn passed(&self, surface: &Surface, ray: (DVec3, DVec3), without: Option<u32>) -> Option<Crossings> {
        let mut found = Crossings { winding: 0, direction: ray.1, touches: false };
        let space = surface.space();
        let local = (space.local(ray.0).as_vec3().to_array(), ray.1.as_vec3().to_array());
        let mut stack = [self.root; DEEPEST];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            match stack[height].found() {
                Found::Leaf(places) => {
                    let pieces = self.pieces[places].iter();
                    for piece in pieces.filter(|piece| Some(piece.triangle) != without) {
                        let Some((side, along)) = crossing(ray, self.corners(piece))? else { continue };
                        found.touches |= along.abs() <= TOUCHING * surface.size;
                        found.winding += if along > 0.0 { side } else { 0 };
                    }
                }
                Found::Branch(i) => {
                    let Branch { boxes, children } = &self.branches[i];
                    for (is_met, &child) in boxes.are_met(local).into_iter().zip(children) {
                        if is_met {
                            stack[height] = child;
                            height += 1;
                        }
                    }
                }
            }
        }
        Some(found)
    }
}

impl Tree {
    /// Where an edge between two corners passes through a triangle that has neither of them; `None` if it passes
    /// none. What reaches through by next to nothing does not count, nor does what its ends touch.
    pub fn pierced(&self, surface: &Surface, edge: [u32; 2]) -> Option<DVec3> {
        let [from, to] = edge.map(|corner| surface.place(corner));
        let direction = (to - from).normalize_or_zero();
        let least = SHALLOW * surface.size;
        let space = surface.space();
        let local = (space.local(from).as_vec3().to_array(), direction.as_vec3().to_array());
        let view = View::new(0.5 * (from + to), space);
        let limit = view.limit(0.25 * (to - from).length_squared());
        let mut stack = [self.root; DEEPEST];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            match stack[height].found() {
                Found::Leaf(places) => {
                    let is_apart = |piece: &&Piece| {
                        !surface.numbers_of(piece.triangle).iter().any(|corner| edge.contains(corner))
                    };
                    for piece in self.pieces[places].iter().filter(is_apart) {
                        if let Some(at) = passage([from, to], self.corners(piece), least) {
                            return Some(at);
                        }
                    }
                }
                Found::Branch(i) => {
                    let Branch { boxes, children } = &self.branches[i];
                    let met = boxes.are_met(local).into_iter().zip(boxes.squares(&view));
                    for ((is_met, square), &child) in met.zip(children) {
                        if is_met && square <= limit {
                            stack[height] = child;
                            height += 1;
                        }
                    }
                }
            }
        }
        None
    }
}

/// Two groups of equally many triangles, side by side along the axis on which their centres are farthest apart.
fn halves((first, members): Group<'_>) -> (Group<'_>, Group<'_>) {
    let size = members.iter().fold(Aabb::EMPTY, |all, m| all.including(m.centre)).size();
    let axis = (0..3).fold(0, |best, axis| if size[axis] > size[best] { axis } else { best });
    let middle = members.len() / 2;
    members.select_nth_unstable_by(middle, |a, b| {
        a.centre[axis].total_cmp(&b.centre[axis]).then(a.triangle.cmp(&b.triangle))
    });
    let (low, high) = members.split_at_mut(middle);
    ((first, low), (first + middle, high))
}

/// The least height of a triangle.
pub(super) fn width([a, b, c]: [DVec3; 3]) -> f64 {
    let longest = [b - a, c - b, a - c].into_iter().fold(0.0, |most, side| f64::max(most, side.length()));
    if longest > 0.0 { (b - a).cross(c - a).length() / longest } else { 0.0 }
}

/// Where a stretch passes through a triangle, edges included, with both ends farther from its plane than `least`.
/// `None` also for triangles that are narrower than [`NARROW`] times that: what passes through those overlaps by no more.
fn passage([from, to]: [DVec3; 2], corners: [DVec3; 3], least: f64) -> Option<DVec3> {
    let width = width(corners);
    if width <= NARROW * least {
        return None;
    }
    let sides = [0, 1, 2].map(|k| corners[(k + 1) % 3] - corners[k]);
    let normal = sides[0].cross(sides[1]);
    let [first, second] = [from, to].map(|end| {
        let (way, above) = (end - corners[0], (end - corners[0]).dot(normal) / normal.length());
        // a rounded corner turns a narrow triangle
        if above.abs() > least * (1.0 + way.length() / width) { above } else { 0.0 }
    });
    if first * second >= 0.0 {
        return None;
    }
    let at = from + first / (first - second) * (to - from);
    let is_within = |k: usize| sides[k].cross(at - corners[k]).dot(normal) >= 0.0;
    (0..3).all(is_within).then_some(at)
}

/// Where a line passes a triangle: 1 if it leaves the solid there and −1 if it enters it, and how far along.
/// The outer `None` if it meets an edge. Both triangles at an edge find the same numbers for it, of opposite
/// signs, so that no line slips between them (Woop, Benthin and Wald 2013).
fn crossing((from, direction): (DVec3, DVec3), corners: [DVec3; 3]) -> Option<Option<(i32, f64)>> {
    let [a, b, c] = corners.map(|corner| corner - from);
    let weights = [direction.dot(b.cross(c)), direction.dot(c.cross(a)), direction.dot(a.cross(b))];
    let side = if weights.iter().all(|&w| w > 0.0) {
        1
    } else if weights.iter().all(|&w| w < 0.0) {
        -1
    } else if weights.iter().any(|&w| w > 0.0) && weights.iter().any(|&w| w < 0.0) {
        return Some(None);
    } else {
        return None;
    };
    let sum: f64 = weights.iter().sum();
    let length = direction.length_squared();
    let along = [a, b, c].map(|corner| corner.dot(direction) / length);
    Some(Some((side, std::iter::zip(weights, along).map(|(w, t)| w / sum * t).sum())))
}
