//! Boxes within boxes: the triangle that is nearest to a point, and the triangles that a ray passes.
//!
//! Boxes are kept in single precision, rounded outwards. Halves of equally many triangles keep the tree low whatever
//! the triangles are.

use glam::DVec3;

use super::nearest::{Nearest, on_triangle};
use super::surface::Surface;
use crate::geom::Aabb;

/// The most triangles of a leaf.
const LEAF: usize = 4;

/// More than the levels of a tree of 2³² triangles.
const DEEPEST: usize = 48;

/// Boxes are entered if they are nearer than the best triangle times this: distances of boxes and of triangles round
/// in their own ways, and what is found must not depend on the order of the search.
const SLACK: f64 = 1.0 + 1e-12;

/// Boxes with more triangles near them are too large for their normals to say much.
const MOST_NORMALS: usize = 64;

/// Where a ray begins on a triangle, relative to the size of the surface.
const TOUCHING: f64 = 1e-12;

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
    order: Vec<u32>,
    root: Child,
}

#[derive(Clone, Copy)]
struct Branch {
    boxes: [SmallBox; 2],
    children: [Child; 2],
}

#[derive(Clone, Copy)]
struct SmallBox {
    min: [f32; 3],
    max: [f32; 3],
}

#[derive(Clone, Copy)]
enum Child {
    Branch(u32),
    /// Triangles in the tree's order.
    Leaf {
        first: u32,
        count: u32,
    },
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

impl SmallBox {
    fn around(bounds: &Aabb) -> Self {
        let down = |x: f64| {
            let near = x as f32;
            if f64::from(near) > x { near.next_down() } else { near }
        };
        let up = |x: f64| {
            let near = x as f32;
            if f64::from(near) < x { near.next_up() } else { near }
        };
        Self { min: bounds.min.to_array().map(down), max: bounds.max.to_array().map(up) }
    }

    /// The square of the distance of a point.
    fn square(&self, p: DVec3) -> f64 {
        let (min, max) = (wide(self.min), wide(self.max));
        (min - p).max(p - max).max(DVec3::ZERO).length_squared()
    }

    /// Whether a ray may pass it.
    fn is_met(&self, from: DVec3, inverse: DVec3, slack: f64) -> bool {
        let (a, b) = ((wide(self.min) - from) * inverse, (wide(self.max) - from) * inverse);
        let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
        enter <= leave + slack && leave >= -slack
    }
}

fn wide(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

/// A triangle while the tree is made.
struct Member {
    triangle: u32,
    bounds: Aabb,
    centre: DVec3,
}

impl Tree {
    pub fn new(surface: &Surface) -> Self {
        let member = |triangle: u32| {
            let [a, b, c] = surface.corners_of(triangle);
            let bounds = Aabb::new(a.min(b).min(c), a.max(b).max(c));
            Member { triangle, bounds, centre: bounds.centre() }
        };
        let mut members: Vec<Member> = (0..surface.len() as u32).map(member).collect();
        let mut tree =
            Self { branches: Vec::new(), order: Vec::new(), root: Child::Leaf { first: 0, count: 0 } };
        tree.root = tree.part(&mut members);
        tree
    }

    fn part(&mut self, members: &mut [Member]) -> Child {
        if members.len() <= LEAF {
            let first = self.order.len() as u32;
            self.order.extend(members.iter().map(|member| member.triangle));
            return Child::Leaf { first, count: members.len() as u32 };
        }
        let of = |m: &[Member]| m.iter().fold(Aabb::EMPTY, |all, m| all.including(m.centre)).size();
        let size = of(members);
        let axis = (0..3).fold(0, |best, axis| if size[axis] > size[best] { axis } else { best });
        let middle = members.len() / 2;
        members.select_nth_unstable_by(middle, |a, b| {
            a.centre[axis].total_cmp(&b.centre[axis]).then(a.triangle.cmp(&b.triangle))
        });
        let (low, high) = members.split_at_mut(middle);
        let around =
            |m: &[Member]| SmallBox::around(&m.iter().fold(Aabb::EMPTY, |all, m| all.union(&m.bounds)));
        let boxes = [around(low), around(high)];
        let place = self.branches.len();
        let nothing = Child::Leaf { first: 0, count: 0 };
        self.branches.push(Branch { boxes, children: [nothing; 2] });
        let children = [self.part(low), self.part(high)];
        self.branches[place].children = children;
        Child::Branch(place as u32)
    }

    /// The triangle that is nearest to a point, the first one of several, and its nearest point. The search begins with
    /// the triangle `last`, which decides nothing but its cost.
    pub fn nearest(&self, surface: &Surface, p: DVec3, last: Option<u32>) -> (u32, Nearest) {
        let look = |t: u32| on_triangle(p, surface.corners_of(t), surface.normal_of(t));
        let first = last.filter(|&t| (t as usize) < surface.len()).unwrap_or(self.order[0]);
        let mut best = (first, look(first));
        let mut limit = best.1.square * SLACK;
        let mut stack = [(self.root, 0.0); DEEPEST];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (child, square) = stack[height];
            if square > limit {
                continue;
            }
            match child {
                Child::Leaf { first, count } => {
                    for &t in &self.order[first as usize..(first + count) as usize] {
                        let found = look(t);
                        if found.square < best.1.square || found.square == best.1.square && t < best.0 {
                            best = (t, found);
                            limit = found.square * SLACK;
                        }
                    }
                }
                Child::Branch(i) => {
                    let Branch { boxes, children } = &self.branches[i as usize];
                    let [a, b] = boxes.map(|b| b.square(p));
                    let (near, far) = if a <= b { ((0, a), (1, b)) } else { ((1, b), (0, a)) };
                    for (which, square) in [far, near] {
                        if square <= limit {
                            stack[height] = (children[which], square);
                            height += 1;
                        }
                    }
                }
            }
        }
        best
    }

    /// The least and the greatest components of the normals of all triangles within a distance of a point, and the sum of
    /// the normals. `None` if there are many, or if one of them has no area.
    pub fn normals_within(
        &self,
        surface: &Surface,
        p: DVec3,
        distance: f64,
    ) -> Option<(DVec3, DVec3, DVec3)> {
        let limit = distance * distance * SLACK;
        let (mut low, mut high, mut sum) = (DVec3::INFINITY, DVec3::NEG_INFINITY, DVec3::ZERO);
        let mut stack = [self.root; DEEPEST];
        let (mut height, mut met) = (1, 0);
        while height > 0 {
            height -= 1;
            match stack[height] {
                Child::Leaf { first, count } => {
                    for &t in &self.order[first as usize..(first + count) as usize] {
                        let normal = surface.normal_of(t);
                        if on_triangle(p, surface.corners_of(t), normal).square > limit {
                            continue;
                        }
                        let normal = normal?;
                        (low, high, sum) = (low.min(normal), high.max(normal), sum + normal);
                        met += 1;
                        if met > MOST_NORMALS {
                            return None;
                        }
                    }
                }
                Child::Branch(i) => {
                    let Branch { boxes, children } = &self.branches[i as usize];
                    for (bounds, &child) in boxes.iter().zip(children) {
                        if bounds.square(p) <= limit {
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
        let (from, direction) = ray;
        let (inverse, slack) = (direction.recip(), 1e-9 * surface.size);
        let mut found = Crossings { winding: 0, direction, touches: false };
        let mut stack = [self.root; DEEPEST];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            match stack[height] {
                Child::Leaf { first, count } => {
                    let triangles = &self.order[first as usize..(first + count) as usize];
                    for &t in triangles.iter().filter(|&&t| Some(t) != without) {
                        let Some((side, along)) = crossing(ray, surface.corners_of(t))? else { continue };
                        found.touches |= along.abs() <= TOUCHING * surface.size;
                        found.winding += if along > 0.0 { side } else { 0 };
                    }
                }
                Child::Branch(i) => {
                    let Branch { boxes, children } = &self.branches[i as usize];
                    for (bounds, &child) in boxes.iter().zip(children) {
                        if bounds.is_met(from, inverse, slack) {
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

/// Where a line passes a triangle: 1 if it leaves the solid there and −1 if it enters it, and how far along. The outer
/// `None` if it meets an edge. Both triangles at an edge find the same numbers for it, of opposite signs, so that no line
/// slips between them (Woop, Benthin and Wald 2013).
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
