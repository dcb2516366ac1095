//! Which obstacles may be near a place, so that scenes with hundreds of them ask each particle about few.
//!
//! Each obstacle has a box that holds all places nearer to it than the support radius. A grid over the domain
//! lists, for each of its cells, the obstacles at rest whose boxes meet the cell. The boxes of the others
//! change from step to step and are tested one by one. An obstacle without such a box, as a closure is, may be
//! anywhere.

use glam::{DVec3, UVec3};

use crate::geom::Aabb;

/// Cells along the longest side of the grid, at most.
const MOST_CELLS: f64 = 32.0;

/// The side of a cell, in support radii: boxes are hardly smaller.
const CELL: f64 = 2.0;

/// The obstacles that may be near a place, by their numbers.
pub(in crate::sph) struct BroadPhase {
    domain: Aabb,
    /// For each obstacle a box that holds all places of the domain nearer to it than the support radius; `None`
    /// if no such box is known.
    boxes: Vec<Option<Aabb>>,
    /// The support radius, m.
    h: f64,
    all: Vec<u32>,
    /// Those that no cell lists, in ascending order as all lists.
    unlisted: Vec<u32>,
    grid: Grid,
}

/// Lists of obstacles for cells.
#[derive(Default)]
struct Grid {
    side: UVec3,
    per_length: DVec3,
    /// Where the list of a cell begins in `listed`; one more than there are cells.
    begins: Vec<u32>,
    /// The obstacles of all cells, in ascending order for each.
    listed: Vec<u32>,
}

impl BroadPhase {
    /// Of the obstacles nothing is known: each may be anywhere.
    pub fn unknown(obstacles: usize) -> Self {
        let all: Vec<u32> = (0..obstacles as u32).collect();
        let (boxes, unlisted) = (vec![None; obstacles], all.clone());
        Self { domain: Aabb::EMPTY, boxes, h: f64::INFINITY, all, unlisted, grid: Grid::default() }
    }

    /// For a support radius h, m, and the obstacles' boxes, each with whether its obstacle is at rest. A domain
    /// without a volume, or one of numbers that are not finite, leaves everything unknown.
    pub fn new(domain: Aabb, h: f64, obstacles: impl Iterator<Item = (Option<Aabb>, bool)>) -> Self {
        let (boxes, at_rest): (Vec<Option<Aabb>>, Vec<bool>) = obstacles.unzip();
        let has_volume = domain.size().cmpgt(DVec3::ZERO).all() && domain.is_finite();
        if !(has_volume && h > 0.0 && h.is_finite()) {
            return Self::unknown(boxes.len());
        }
        let all: Vec<u32> = (0..boxes.len() as u32).collect();
        let is_listed = |k: &u32| at_rest[*k as usize] && boxes[*k as usize].is_some();
        let (listed, unlisted): (Vec<u32>, Vec<u32>) = all.iter().partition(|k| is_listed(k));
        let grid = Grid::of(&domain, h, listed.iter().filter_map(|&k| Some((k, boxes[k as usize]?))));
        Self { domain, boxes, h, all, unlisted, grid }
    }

    /// The support radius, m, for which boxes hold; infinite if none is known.
    pub fn h(&self) -> f64 {
        self.h
    }

    /// Sets the box of an obstacle that moves.
    pub fn set(&mut self, k: usize, around: Option<Aabb>) {
        self.boxes[k] = around;
    }

    /// The obstacles that may be nearer to a place than the support radius, in ascending order.
    pub fn at(&self, p: DVec3) -> impl Iterator<Item = usize> {
        let in_domain = self.domain.contains(p);
        let lists = match in_domain {
            true => Merged { listed: self.grid.at(p - self.domain.min), unlisted: &self.unlisted },
            false => Merged { listed: &[], unlisted: &self.all },
        };
        lists.filter(move |k| !in_domain || self.boxes[*k].is_none_or(|around| around.contains(p)))
    }

    /// The obstacles to which a point of a box may be nearer than the support radius, in ascending order.
    pub fn over(&self, over: Aabb) -> impl Iterator<Item = usize> {
        let in_domain = self.domain.contains(over.min) && self.domain.contains(over.max);
        let meets = move |around: Aabb| !around.intersection(&over).is_empty();
        (0..self.boxes.len()).filter(move |&k| !in_domain || self.boxes[k].is_none_or(meets))
    }
}

impl Grid {
    fn of(domain: &Aabb, h: f64, boxes: impl Iterator<Item = (u32, Aabb)> + Clone) -> Self {
        let size = domain.size();
        let cell = (CELL * h).max(size.max_element() / MOST_CELLS);
        let side = (size / cell).floor().max(DVec3::ONE).as_uvec3();
        let per_length = side.as_dvec3() / size;
        let mut grid = Self { side, per_length, ..Self::default() };
        let mut begins = vec![0u32; side.element_product() as usize + 1];
        for (_, around) in boxes.clone() {
            grid.cells_of(domain, &around).for_each(|cell| begins[cell + 1] += 1);
        }
        for cell in 1..begins.len() {
            begins[cell] += begins[cell - 1];
        }
        let mut ends = begins.clone();
        let mut listed = vec![0; begins.last().map_or(0, |all| *all as usize)];
        for (k, around) in boxes {
            for cell in grid.cells_of(domain, &around) {
                listed[ends[cell] as usize] = k;
                ends[cell] += 1;
            }
        }
        (grid.begins, grid.listed) = (begins, listed);
        grid
    }

    /// The obstacles listed for a place, which is given from the domain's lowest corner.
    fn at(&self, from_corner: DVec3) -> &[u32] {
        let cell = self.number(self.cell(from_corner));
        &self.listed[self.begins[cell] as usize..self.begins[cell + 1] as usize]
    }

    /// Rounding cannot part a place from its box, because it never reverses an order.
    fn cell(&self, from_corner: DVec3) -> UVec3 {
        (from_corner * self.per_length).as_uvec3().min(self.side - 1)
    }

    fn number(&self, at: UVec3) -> usize {
        ((at.z * self.side.y + at.y) * self.side.x + at.x) as usize
    }

    /// The cells that a box meets.
    fn cells_of(&self, domain: &Aabb, around: &Aabb) -> impl Iterator<Item = usize> {
        let within = around.intersection(domain);
        let [low, high] = match within.is_empty() {
            true => [UVec3::ONE, UVec3::ZERO],
            false => [within.min, within.max].map(|corner| self.cell(corner - domain.min)),
        };
        let numbers = (low.z..=high.z).flat_map(move |z| {
            (low.y..=high.y).flat_map(move |y| (low.x..=high.x).map(move |x| UVec3::new(x, y, z)))
        });
        numbers.map(|at| self.number(at))
    }
}

/// Two lists in ascending order as one.
struct Merged<'a> {
    listed: &'a [u32],
    unlisted: &'a [u32],
}

impl Iterator for Merged<'_> {
    type Item = usize;

    fn next(&mut self) -> Option<usize> {
        let list = match (self.listed.first(), self.unlisted.first()) {
            (Some(a), Some(b)) if a < b => &mut self.listed,
            (Some(_), None) => &mut self.listed,
            (_, Some(_)) => &mut self.unlisted,
            (None, None) => return None,
        };
        let (first, rest) = list.split_first()?;
        *list = rest;
        Some(*first as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const H: f64 = 0.1;

    /// Boxes all over a domain: every third moves, every seventh is not known.
    fn obstacles(domain: &Aabb) -> Vec<(Option<Aabb>, bool)> {
        let part = |k: u32, step: u32| f64::from(k * step % 101) / 100.0;
        let of = |k: u32| {
            let corner = domain.min + domain.size() * DVec3::new(part(k, 37), part(k, 59), part(k, 83));
            let around = Aabb::new(corner, corner + DVec3::new(0.02, 0.3, 1.1) * part(k, 71));
            ((!k.is_multiple_of(7)).then_some(around), !k.is_multiple_of(3))
        };
        (1..200).map(of).collect()
    }

    #[test]
    fn no_obstacle_is_missed_at_a_place_and_those_listed_meet_its_cell() {
        let domain = Aabb::new(DVec3::new(-1.0, 0.3, 2.0), DVec3::new(2.0, 1.3, 2.7));
        let obstacles = obstacles(&domain);
        let broad = BroadPhase::new(domain, H, obstacles.iter().copied());
        let mut asked = 0;
        for n in 0..4000u32 {
            let part = |step: u32| f64::from(n * step % 401) / 400.0;
            let p = domain.min + domain.size() * DVec3::new(part(7), part(131), part(29));
            let near: Vec<usize> = broad.at(p).collect();
            assert!(near.is_sorted(), "{near:?}");
            let cell = Aabb::new(p, p).grown(1.01 * CELL * H * 1.5);
            for (k, (around, at_rest)) in obstacles.iter().enumerate() {
                let holds = |around: &Aabb| around.contains(p);
                let found = near.binary_search(&k).is_ok();
                assert!(found || around.is_some_and(|around| !holds(&around)), "{k} at {p}");
                let meets = |around: &Aabb| match at_rest {
                    true => !around.intersection(&cell).is_empty(),
                    false => holds(around),
                };
                assert!(!found || around.as_ref().is_none_or(meets), "{k} at {p}");
            }
            asked += near.len();
        }
        assert!(asked < 4000 * 50, "{asked} of {} obstacles", 4000 * obstacles.len());
    }

    #[test]
    fn outside_the_domain_each_obstacle_may_be_near() {
        let domain = Aabb::new(DVec3::ZERO, DVec3::ONE);
        let around = Some(Aabb::new(DVec3::splat(0.4), DVec3::splat(0.5)));
        let broad = BroadPhase::new(domain, H, [(around, true), (around, false), (None, true)].into_iter());
        assert_eq!(broad.at(DVec3::splat(0.45)).collect::<Vec<_>>(), [0, 1, 2]);
        assert_eq!(broad.at(DVec3::ZERO).collect::<Vec<_>>(), [2]);
        assert_eq!(broad.at(DVec3::splat(1.1)).collect::<Vec<_>>(), [0, 1, 2]);
        assert_eq!(broad.at(DVec3::NAN).collect::<Vec<_>>(), [0, 1, 2]);
        let over = |min: f64, max: f64| broad.over(Aabb::new(DVec3::splat(min), DVec3::splat(max)));
        assert_eq!(over(0.1, 0.3).collect::<Vec<_>>(), [2]);
        assert_eq!(over(0.1, 0.4).collect::<Vec<_>>(), [0, 1, 2]);
        assert_eq!(over(-0.1, 0.3).collect::<Vec<_>>(), [0, 1, 2]);
    }
}
