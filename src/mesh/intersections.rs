//! Triangles of a mesh that pass through one another.
//!
//! Two triangles cross if a side of one pierces or ends in the other, or if they overlap in one plane.
//! Triangles with a common corner or side cross only beyond it, so a fold is a crossing and a roof is none.
//! Corners at one point count as common whether or not they are one vertex. Triangles without area cross
//! nothing.
//!
//! Invariant: a pair is found once, with the smaller number first, and pairs ascend.

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

use super::Mesh;
use crate::geom::Aabb;

/// Pairs of triangles that cross, ascending. A mesh without any bounds a solid without overlaps.
pub fn self_intersections(mesh: &Mesh) -> Vec<[u32; 2]> {
    let extents = mesh.triangles.iter().map(|t| {
        let bounds = bounds_of(corners(&mesh.positions, *t));
        if bounds.is_finite() { bounds.size().max_element() } else { 0.0 }
    });
    let (sum, largest) = extents.fold((0.0, 0.0), |(sum, most), x| (sum + x, f64::max(most, x)));
    let mean = sum / mesh.triangles.len().max(1) as f64;
    let all: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
    crossing_pairs(&mesh.positions, &mesh.triangles, &all, mean.max(largest / MOST_CUBES))
}

/// The most cubes that a triangle may reach over on one axis.
const MOST_CUBES: f64 = 64.0;

pub(super) type Triangle = [DVec3; 3];

pub(super) fn corners(positions: &[DVec3], t: [u32; 3]) -> Triangle {
    t.map(|v| positions[v as usize])
}

pub(super) fn bounds_of([a, b, c]: Triangle) -> Aabb {
    Aabb::new(a.min(b).min(c), a.max(b).max(c))
}

/// The pairs that cross and hold one of the suspects, which ascend. `size` is the side of the cubes by which
/// neighbours are found, about the size of a triangle.
pub(super) fn crossing_pairs(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    suspects: &[u32],
    size: f64,
) -> Vec<[u32; 2]> {
    if suspects.is_empty() || !(size > 0.0 && size.is_finite()) {
        return Vec::new();
    }
    let cubes = Cubes::new(CUBE * size);
    let mut is_suspect = vec![false; triangles.len()];
    suspects.iter().for_each(|&t| is_suspect[t as usize] = true);
    let mut places = places(positions, triangles, (suspects, 0.0), &cubes);
    places.par_sort_unstable();
    let by_cube: Vec<&[(Cube, u32)]> = places.chunk_by(|a, b| a.0 == b.0).collect();
    let found: Vec<Vec<[u32; 2]>> = by_cube
        .par_chunks(CUBES_PER_TASK)
        .map_init(Vec::new, |members: &mut Vec<(u32, bool, Aabb)>, part| {
            let mut found = Vec::new();
            for list in part {
                members.clear();
                members.extend(list.iter().map(|&(_, t)| {
                    (t, is_suspect[t as usize], bounds_of(corners(positions, triangles[t as usize])))
                }));
                let cube = list[0].0;
                for (i, (s, suspect, own)) in members.iter().enumerate() {
                    for (t, other_suspect, bounds) in &members[i + 1..] {
                        // a pair that shares several cubes is looked at in the first
                        if (*suspect | *other_suspect)
                            && overlap(own, bounds)
                            && cubes.of(own.min.max(bounds.min)) == cube
                            && cross(
                                &corners(positions, triangles[*s as usize]),
                                &corners(positions, triangles[*t as usize]),
                            )
                        {
                            found.push([*s, *t]);
                        }
                    }
                }
            }
            found
        })
        .collect();
    let mut found = found.concat();
    found.par_sort_unstable();
    found
}

const CUBES_PER_TASK: usize = 64;
const TRIANGLES_PER_TASK: usize = 4096;

/// The side of the cubes, in sizes of triangles. Smaller ones hold fewer pairs, but triangles lie in more.
const CUBE: f64 = 1.5;

/// The triangles in the cubes that suspects touch, give or take a margin, with those cubes. It may hold others.
fn places(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    (suspects, margin): (&[u32], f64),
    cubes: &Cubes,
) -> Vec<(Cube, u32)> {
    let [mut filter, mut coarse] = [(); 2].map(|()| Filter(vec![0; Filter::BITS / 64]));
    for &t in suspects {
        let bounds = bounds_of(corners(positions, triangles[t as usize])).grown(margin);
        if !bounds.is_finite() {
            continue; // triangles without finite corners cross nothing
        }
        for cube in cubes.touched(&bounds) {
            filter.mark(cube);
            coarse.mark(cube.map(block_of));
        }
    }
    let clear = clear_blocks(positions, &coarse, cubes);
    let parts: Vec<Vec<(Cube, u32)>> = triangles
        .par_chunks(TRIANGLES_PER_TASK)
        .enumerate()
        .map(|(part, triangles)| {
            let first = (part * TRIANGLES_PER_TASK) as u32;
            let mut near = Vec::new();
            for (t, triangle) in (first..).zip(triangles) {
                // most triangles lie in one block, and that holds no suspect
                let [a, b, c] = *triangle;
                let blocks = [clear[a as usize], clear[b as usize], clear[c as usize]];
                if blocks[0] == blocks[1] && blocks[0] == blocks[2] && blocks[0] != NOT_CLEAR {
                    continue;
                }
                let bounds = bounds_of(corners(positions, *triangle));
                if !bounds.is_finite() {
                    continue;
                }
                near.extend(
                    cubes.touched(&bounds).filter(|cube| filter.may_hold(*cube)).map(|cube| (cube, t)),
                );
            }
            near
        })
        .collect();
    parts.concat()
}

/// A vertex in a block that may hold a suspect, or so far out that blocks have no numbers.
const NOT_CLEAR: u64 = 0;

/// For each vertex the number of its block, or [`NOT_CLEAR`].
fn clear_blocks(positions: &[DVec3], suspects: &Filter, cubes: &Cubes) -> Vec<u64> {
    const NUMBERED: i32 = 1 << 20;
    let find = |p: &DVec3| {
        let block = cubes.of(*p).map(block_of);
        let is_far = |b: &i32| !(-NUMBERED..NUMBERED).contains(b);
        if !p.is_finite() || block.iter().any(is_far) || suspects.may_hold(block) {
            return NOT_CLEAR;
        }
        let [x, y, z] = block.map(|b| (b + NUMBERED) as u64);
        1 << 63 | z << 42 | y << 21 | x
    };
    positions.par_iter().with_min_len(TRIANGLES_PER_TASK).map(find).collect()
}

/// The number of a block of cubes, by that of a cube on an axis.
fn block_of(cube: i32) -> i32 {
    cube >> 3
}

/// A division of space into cubes. Those beside a plane of zero coordinates are twice as long across it.
pub(super) struct Cubes {
    per_length: f64,
}

type Cube = [i32; 3];

impl Cubes {
    /// Cubes with sides of this length, which is positive.
    pub fn new(size: f64) -> Self {
        Self { per_length: 1.0 / size }
    }

    fn of(&self, p: DVec3) -> Cube {
        // truncation keeps the order of numbers, and needs no call as rounding down does
        let q = p * self.per_length;
        [q.x as i32, q.y as i32, q.z as i32]
    }

    /// The cubes that a box touches.
    pub fn touched(&self, bounds: &Aabb) -> Touched {
        let (low, high) = (self.of(bounds.min), self.of(bounds.max));
        let is_empty = (0..3).any(|axis| low[axis] > high[axis]);
        Touched { low, high, next: (!is_empty).then_some(low) }
    }
}

/// The cubes that a box touches, x fastest, then y.
pub(super) struct Touched {
    low: Cube,
    high: Cube,
    next: Option<Cube>,
}

impl Iterator for Touched {
    type Item = Cube;

    #[inline]
    fn next(&mut self) -> Option<Cube> {
        let found = self.next?;
        let mut next = found;
        for axis in 0..3 {
            if next[axis] < self.high[axis] {
                next[axis] += 1;
                self.next = Some(next);
                return Some(found);
            }
            next[axis] = self.low[axis];
        }
        self.next = None;
        Some(found)
    }
}

/// A number below a power of two, up to 2³², that differs for most cubes.
fn mixed(cube: Cube, below: usize) -> usize {
    let mix = (cube[0] as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ (cube[1] as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f)
        ^ (cube[2] as u64).wrapping_mul(0x1656_67b1_9e37_79f9);
    (mix >> 32) as usize & (below - 1)
}

/// A few bits that rule out most unmarked cubes.
struct Filter(Vec<u64>);

impl Filter {
    const BITS: usize = 1 << 18;

    fn mark(&mut self, cube: Cube) {
        let place = mixed(cube, Self::BITS);
        self.0[place / 64] |= 1 << (place % 64);
    }

    fn may_hold(&self, cube: Cube) -> bool {
        let place = mixed(cube, Self::BITS);
        self.0[place / 64] >> (place % 64) & 1 == 1
    }
}

/// The triangles in the cubes that some of them touch.
///
/// Those that were found lie side by side, ordered by a number that is mixed from their cube's. Cubes with the same
/// number share their triangles, which only makes a few more to look at: every answer compares places.
pub(super) struct Neighbours {
    cubes: Cubes,
    /// Where the triangles of each number begin; the number after the last is their end.
    starts: Vec<u32>,
    found: Vec<u32>,
    added: FxHashMap<Cube, SmallVec<[u32; 4]>>,
}

impl Neighbours {
    /// All triangles in the cubes that the suspects touch, or touch once they have moved by a margin.
    pub fn find(
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        (suspects, margin): (&[u32], f64),
        cubes: Cubes,
    ) -> Self {
        let places = places(positions, triangles, (suspects, margin), &cubes);
        let numbers = places.len().next_power_of_two();
        let mut starts = vec![0; numbers + 1];
        for (cube, _) in &places {
            starts[mixed(*cube, numbers)] += 1;
        }
        let mut end = 0;
        for start in &mut starts {
            end += *start;
            *start = end;
        }
        // from the ends of the stretches to their beginnings
        let mut found = vec![0; places.len()];
        for (cube, t) in places.into_iter().rev() {
            let start = &mut starts[mixed(cube, numbers)];
            *start -= 1;
            found[*start as usize] = t;
        }
        Self { cubes, starts, found, added: FxHashMap::default() }
    }

    /// Adds a triangle that is new or has moved. It is found by its new box and by its old one.
    pub fn add(&mut self, t: u32, bounds: &Aabb) {
        for cube in self.cubes.touched(bounds) {
            if self.found_in(cube).contains(&t) {
                continue;
            }
            let list = self.added.entry(cube).or_default();
            if !list.contains(&t) {
                list.push(t);
            }
        }
    }

    /// The triangles that were found in a cube, and perhaps others.
    fn found_in(&self, cube: Cube) -> &[u32] {
        let number = mixed(cube, self.starts.len() - 1);
        &self.found[self.starts[number] as usize..self.starts[number + 1] as usize]
    }

    /// Whether one of some triangles, each of which was found or added where it is now, crosses any other.
    pub fn any_crosses(&self, positions: &[DVec3], triangles: &[[u32; 3]], suspects: &[u32]) -> bool {
        suspects.iter().any(|&s| {
            let own = corners(positions, triangles[s as usize]);
            let bounds = bounds_of(own);
            bounds.is_finite()
                && self.around(&bounds).any(|t| {
                    let other = corners(positions, triangles[t as usize]);
                    t != s && overlap(&bounds, &bounds_of(other)) && cross(&own, &other)
                })
        })
    }

    /// The triangles that share a cube with a box, some of them more than once.
    pub fn around(&self, bounds: &Aabb) -> impl Iterator<Item = u32> + use<'_> {
        self.cubes.touched(bounds).flat_map(|cube| {
            let added = self.added.get(&cube).into_iter().flatten();
            self.found_in(cube).iter().chain(added).copied()
        })
    }
}

pub(super) fn overlap(a: &Aabb, b: &Aabb) -> bool {
    a.min.cmple(b.max).all() && b.min.cmple(a.max).all()
}

/// Distances below this share of the coordinates are rounding.
const ROUNDING: f64 = 1e-14;

/// Whether two triangles cross.
pub(super) fn cross(s: &Triangle, t: &Triangle) -> bool {
    let common = |p: &DVec3, other: &Triangle| other.contains(p);
    let shared = s.iter().filter(|p| common(p, t)).count();
    let scale = s.iter().chain(t).map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let heights = |of: &Triangle, over: &Triangle| {
        let normal = (over[1] - over[0]).cross(over[2] - over[0]);
        let length = normal.length();
        let height = |p: &DVec3| {
            if common(p, over) {
                return 0.0;
            }
            let found = normal.dot(*p - over[0]);
            if found.abs() <= ROUNDING * scale * length { 0.0 } else { found }
        };
        of.each_ref().map(height)
    };
    let is_beside = |h: [f64; 3]| h.iter().all(|h| *h > 0.0) || h.iter().all(|h| *h < 0.0);
    let has_area = |t: &Triangle| (t[1] - t[0]).cross(t[2] - t[0]) != DVec3::ZERO;
    if !has_area(s) || !has_area(t) {
        return false;
    }
    if shared == 3 {
        return true; // one lies on the other
    }
    let of_t = heights(t, s);
    if is_beside(of_t) || shared == 2 && of_t.iter().any(|h| *h != 0.0) {
        return false;
    }
    let of_s = heights(s, t);
    if is_beside(of_s) {
        return false;
    }
    if of_t == [0.0; 3] || of_s == [0.0; 3] {
        return overlap_in_plane(s, t, shared);
    }
    pierces(t, of_t, s) || pierces(s, of_s, t)
}

/// Whether a side of a triangle, whose corners have the given heights over the plane of another, passes
/// through the other's inside.
fn pierces(of: &Triangle, heights: [f64; 3], other: &Triangle) -> bool {
    (0..3).any(|i| {
        let (p, q, hp, hq) = (of[i], of[(i + 1) % 3], heights[i], heights[(i + 1) % 3]);
        let through = hp * hq < 0.0 || (hp == 0.0) != (hq == 0.0);
        if !through || (hp == 0.0 && other.contains(&p)) || (hq == 0.0 && other.contains(&q)) {
            return false;
        }
        // the signs of the tetrahedra of this line and the other's sides
        let line = q - p;
        let sides: [f64; 3] = std::array::from_fn(|k| {
            let (a, b) = (other[k] - p, other[(k + 1) % 3] - p);
            line.dot(a.cross(b))
        });
        sides.iter().all(|v| *v > 0.0) || sides.iter().all(|v| *v < 0.0)
    })
}

/// Whether two triangles in one plane have more than a border in common.
fn overlap_in_plane(s: &Triangle, t: &Triangle, shared: usize) -> bool {
    let normal = (s[1] - s[0]).cross(s[2] - s[0]);
    let other = (t[1] - t[0]).cross(t[2] - t[0]);
    let along = if normal.length_squared() > other.length_squared() { normal } else { other };
    let length = along.length();
    if length == 0.0 {
        return false;
    }
    let along = along / length;
    if shared == 2 {
        let apex = |of: &Triangle, other: &Triangle| of.iter().copied().find(|p| !other.contains(p));
        let mut common = s.iter().copied().filter(|p| t.contains(p));
        let (Some(a), Some(b), Some(c), Some(d)) = (common.next(), common.next(), apex(s, t), apex(t, s))
        else {
            return false;
        };
        let side = |p: DVec3| along.dot((b - a).cross(p - a));
        return side(c) * side(d) > 0.0;
    }
    // by a line between them, along one of their sides
    let is_between = |of: &Triangle, from: &Triangle| {
        let turn = along.dot((of[1] - of[0]).cross(of[2] - of[0])).signum();
        (0..3).any(|i| {
            let (a, way) = (of[i], of[(i + 1) % 3] - of[i]);
            let slack = ROUNDING * way.length() * a.abs().max_element().max(way.length());
            from.iter().all(|p| turn * along.dot(way.cross(*p - a)) <= slack)
        })
    };
    !is_between(s, t) && !is_between(t, s)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(corners: [[f64; 3]; 3]) -> Triangle {
        corners.map(DVec3::from_array)
    }

    #[test]
    fn piercing_folding_and_overlapping_are_crossings_and_touching_is_none() {
        let floor = triangle([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let turned = |t: &Triangle| [[t[0], t[1], t[2]], [t[1], t[2], t[0]], [t[2], t[0], t[1]]];
        let check = |other: [[f64; 3]; 3], expected: bool| {
            for s in turned(&floor) {
                for t in turned(&triangle(other)) {
                    assert_eq!(cross(&s, &t), expected, "{other:?}");
                    assert_eq!(cross(&t, &s), expected, "{other:?}");
                    assert_eq!(cross(&t, &[s[0], s[2], s[1]]), expected, "{other:?}");
                }
            }
        };
        // through the middle, beside it, above it
        check([[0.2, 0.2, -1.0], [0.2, 0.2, 1.0], [5.0, 5.0, 1.0]], true);
        check([[0.8, 0.8, -1.0], [0.8, 0.8, 1.0], [5.0, 5.0, 1.0]], false);
        check([[0.2, 0.2, 1.0], [0.3, 0.2, 1.0], [0.2, 0.3, 2.0]], false);
        // a common side: a roof, a fold, a continuation
        check([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.3]], false);
        check([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.3, 0.3, 0.0]], true);
        check([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.3, -0.3, 0.0]], false);
        // a common corner: through it, away from it, over it in the plane
        check([[0.0, 0.0, 0.0], [0.4, 0.3, 0.1], [0.3, 0.4, -0.1]], true);
        check([[0.0, 0.0, 0.0], [-0.4, 0.3, 0.1], [0.3, -0.4, -0.1]], false);
        check([[0.0, 0.0, 0.0], [0.2, 0.1, 0.0], [0.1, 0.2, 0.0]], true);
        check([[0.0, 0.0, 0.0], [-0.2, 0.1, 0.0], [-0.1, -0.2, 0.0]], false);
        // in the plane, apart and overlapping
        check([[0.1, 0.1, 0.0], [3.0, 0.1, 0.0], [0.1, 3.0, 0.0]], true);
        check([[1.1, 0.1, 0.0], [3.0, 0.1, 0.0], [1.1, 3.0, 0.0]], false);
    }

    #[test]
    fn few_suspects_find_the_same_pairs_as_all() {
        // sixty random triangles in a box, some of which cross
        let mut seed = 3_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut positions = Vec::new();
        for _ in 0..60 {
            let centre = 4.0 * DVec3::new(random(), random(), random());
            positions.extend((0..3).map(|_| centre + 3.0 * DVec3::new(random(), random(), random())));
        }
        let triangles: Vec<[u32; 3]> = (0..60).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mut expected = Vec::new();
        for a in 0..60_u32 {
            for b in a + 1..60 {
                let [s, t] = [a, b].map(|i| corners(&positions, triangles[i as usize]));
                if cross(&s, &t) {
                    expected.push([a, b]);
                }
            }
        }
        assert!(expected.len() > 10, "{}", expected.len());
        let mesh = Mesh { positions, triangles, ..Mesh::default() };
        assert_eq!(self_intersections(&mesh), expected);
        let suspects: Vec<u32> = (0..60).step_by(3).collect();
        let some = crossing_pairs(&mesh.positions, &mesh.triangles, &suspects, 0.7);
        expected.retain(|pair| pair.iter().any(|t| t % 3 == 0));
        assert_eq!(some, expected);
    }
}
