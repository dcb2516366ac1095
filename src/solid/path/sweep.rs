//! Where a path enters a tree of leaves: swept contact, also called continuous collision detection.
//!
//! Each leaf says on which stretches of the path it may be at least zero, and on which it surely is. Leaves
//! that are polynomials of degree two or less along the path do so in closed form, with bounds of all
//! rounding errors; others by enclosures that are narrowed around their roots. "All of" then intersects
//! stretches, "any of" unites them, and the earliest that is left is the entry. While a particle passes its
//! path, time passes too: leaves that move are functions of the path's parameter, as are leaves at rest.
//!
//! Invariant: before an [`Entry`] no point of the path is in the solid, and a path without one does not touch
//! it. This holds in exact arithmetic, for the numbers that the graph holds.

use std::cell::Cell;

use glam::DVec3;
use smallvec::SmallVec;

use super::intervals::NotNegative;
use crate::field::{Entry, Normals, Path};
use crate::solid::leaves::leaf_set::Leaves;
use crate::solid::leaves::words::{Word, is_negative, skip};

/// Undecided stretches shorter than this part of the path are not narrowed further.
const SHORTEST: f64 = 1e-12;

/// Maximum number of enclosures for one stretch of a path. A path needs a handful, or some forty where a leaf has no
/// slope at a root; what is undecided then stays possible.
const MOST_ENCLOSURES: u32 = 1_000;

/// How often a path may be halved because all enclosures were spent on it: a wheel of sixty teeth has as many places
/// without a slope, most of them behind the entry.
const MOST_HALVINGS: u32 = 32;

/// Leaves whose distances from the entry differ by less than this part of the path decide together.
const TOGETHER: f64 = 1e-9;

/// A search that has spent its budget has found the entry if a point that is surely not in the fluid follows within this
/// part of the path. Otherwise the path may be known to meet the solid, but not where.
const SOON: f64 = 1e-7;

/// A path through the leaves of a solid.
pub struct Sweep<'a> {
    leaves: &'a Leaves,
    path: &'a Path,
    /// Those that are left.
    enclosures: Cell<u32>,
    halvings: Cell<u32>,
}

impl<'a> Sweep<'a> {
    pub fn new(leaves: &'a Leaves, path: &'a Path) -> Self {
        Self { leaves, path, enclosures: Cell::new(MOST_ENCLOSURES), halvings: Cell::new(MOST_HALVINGS) }
    }

    /// Whether the whole path surely stays out of a tree, by bounds alone: cheaper than its stretches, and
    /// enough for paths that are short beside their distance from the surface.
    pub fn stays_out(&self, words: &[u32]) -> bool {
        // NaN is not less than anything
        let rise = |c: f64| if c < 0.0 { 0.0 } else { c };
        let negative = is_negative(words, &mut 0, &mut |leaf, negated| {
            let leaf = self.leaves.on_path(leaf, negated, self.path.from, self.path.to)?;
            let [a, b, c] = leaf.coefficients.map(|coefficient| coefficient.hi);
            Some(-a > (rise(b) + rise(c)) * (1.0 + 4.0 * f64::EPSILON))
        });
        negative == Some(true)
    }

    /// The first entry into a tree on a part of the path.
    pub fn first_entry(&self, words: &[u32], within: (f64, f64)) -> Option<Entry> {
        if !(self.path.from.is_finite() && self.path.to.is_finite()) {
            return Some(Entry::new(self.path, within, false, Normals::default()));
        }
        let met = self.stretches(words, &mut 0, within);
        let (t, until) = met.possible.iter().next()?;
        let certain = !met.certain.within((t, until)).is_empty();
        let is_found = !met.certain.within((t, until.min(t + SOON))).is_empty();
        let halvings = self.halvings.get();
        if !is_found && until - t > SOON && self.enclosures.get() == 0 && halvings > 0 {
            self.halvings.set(halvings - 1);
            let middle = 0.5 * (t + until);
            if let Some(entry) = self.search_anew(words, (t, middle)) {
                // what was cut off at the middle may go on
                return Some(Entry {
                    until: if entry.until < middle { entry.until } else { until },
                    ..entry
                });
            }
            return self.search_anew(words, (middle, within.1));
        }
        Some(Entry::new(self.path, (t, until), certain, self.normals(words, t)))
    }

    /// The first entry on a part of the path, with all enclosures for itself.
    fn search_anew(&self, words: &[u32], within: (f64, f64)) -> Option<Entry> {
        self.enclosures.set(MOST_ENCLOSURES);
        self.first_entry(words, within)
    }

    /// Where a tree may be at least zero on a part of the path.
    fn stretches(&self, words: &[u32], at: &mut usize, within: (f64, f64)) -> NotNegative {
        let word = Word::read(words[*at]);
        *at += 1;
        match word {
            Word::Leaf { leaf, negated } => self.leaf(leaf, negated, within),
            Word::All(parts) => {
                let mut met = self.stretches(words, at, within);
                for _ in 1..parts {
                    match met.possible.hull() {
                        None => skip(words, at),
                        Some(hull) => {
                            let next = self.stretches(words, at, hull);
                            met.possible = met.possible.intersection(&next.possible);
                            met.certain = met.certain.intersection(&next.certain);
                        }
                    }
                }
                met
            }
            Word::Any(parts) => {
                let mut met = self.stretches(words, at, within);
                for _ in 1..parts {
                    let next = self.stretches(words, at, within);
                    if !next.possible.is_empty() {
                        met.possible = met.possible.union(&next.possible);
                        met.certain = met.certain.union(&next.certain);
                    }
                }
                met
            }
        }
    }

    fn leaf(&self, leaf: u32, negated: bool, within: (f64, f64)) -> NotNegative {
        if let Some(enclosure) = self.leaves.on_path(leaf, negated, self.path.from, self.path.to) {
            let met = NotNegative::of(&enclosure, (0.0, 1.0));
            return if within == (0.0, 1.0) { met } else { met.within(within) };
        }
        let mut met = NotNegative::default();
        self.narrow(leaf, negated, within, &mut met);
        met
    }

    /// Adds what a leaf says of a stretch, from left to right: what remains undecided is looked at again by
    /// itself, or in halves if it has not become much shorter.
    fn narrow(&self, leaf: u32, negated: bool, (t0, t1): (f64, f64), out: &mut NotNegative) {
        let left = self.enclosures.get();
        if left == 0 {
            return out.possible.push((t0, t1));
        }
        self.enclosures.set(left - 1);
        let enclosure = self.leaves.enclose(leaf, negated, self.path, (t0, t1));
        if t0 >= t1 {
            // one instant: nothing is left to be divided
            if enclosure.range.lo >= 0.0 {
                out.certain.push((t0, t1));
            }
            if enclosure.range.hi.is_nan() || enclosure.range.hi >= 0.0 {
                out.possible.push((t0, t1));
            }
            return;
        }
        let met = NotNegative::of(&enclosure, (t0, t1));
        let [a, b, c] = enclosure.coefficients.map(|c| c.width());
        let width = t1 - t0;
        // the enclosure is as wide as the rounding of one value: shorter stretches teach nothing
        let rounding_alone = a >= width * (b + width * c);
        let undecided = met.possible.without(&met.certain);
        let mut parts: SmallVec<[((f64, f64), bool); 8]> = SmallVec::new();
        parts.extend(undecided.iter().map(|stretch| (stretch, false)));
        parts.extend(met.certain.iter().map(|stretch| (stretch, true)));
        parts.sort_by(|a, b| a.0.0.total_cmp(&b.0.0));
        for ((begin, end), certain) in parts {
            let length = end - begin;
            if certain {
                out.certain.push((begin, end));
                out.possible.push((begin, end));
            } else if length <= SHORTEST || rounding_alone {
                out.possible.push((begin, end));
            } else if length <= 0.5 * width {
                self.narrow(leaf, negated, (begin, end), out);
            } else {
                let middle = 0.5 * (begin + end);
                self.narrow(leaf, negated, (begin, middle), out);
                self.narrow(leaf, negated, (middle, end), out);
            }
        }
    }

    /// Outward normals of the leaves that decide at t.
    fn normals(&self, words: &[u32], t: f64) -> Normals {
        let size = self.path.from.abs().max(self.path.to.abs()).max_element();
        let together = TOGETHER * self.path.from.distance(self.path.to) + 16.0 * f64::EPSILON * size;
        let (_, directions) = self.deciding(words, &mut 0, t, together);
        let mut normals = Normals::default();
        directions.into_iter().for_each(|direction| normals.add(direction));
        normals
    }

    /// The smallest or largest u/|∇u| of a tree, as the tree says, and the outward directions of the leaves
    /// there.
    fn deciding(&self, words: &[u32], at: &mut usize, t: f64, together: f64) -> (f64, SmallVec<[DVec3; 4]>) {
        let word = Word::read(words[*at]);
        *at += 1;
        let p = self.path.at(t);
        let (parts, sign) = match word {
            Word::Leaf { leaf, negated } => {
                let (value, gradient) = self.leaves.gradient_along(leaf, p, t);
                let sign = if negated { -1.0 } else { 1.0 };
                let slope = gradient.length();
                let known = slope > 0.0 && slope.is_finite();
                let distance = if known { value / slope } else { value };
                let directions = known.then_some(-sign * gradient).into_iter().collect();
                return (sign * distance, directions);
            }
            Word::All(parts) => (parts, 1.0),
            Word::Any(parts) => (parts, -1.0),
        };
        let (mut best, mut directions) = self.deciding(words, at, t, together);
        for _ in 1..parts {
            let (next, more) = self.deciding(words, at, t, together);
            let ahead = sign * (next - best);
            if ahead < -together {
                directions = more;
            } else if ahead <= together {
                directions.extend(more);
            }
            best = if ahead < 0.0 { next } else { best };
        }
        (best, directions)
    }
}
