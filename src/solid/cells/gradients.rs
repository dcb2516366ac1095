//! Gradients at many points of a cell map: the points that see the same leaves are evaluated together.
//!
//! Invariant: each point gets the bits that it gets alone.

use super::map::{CellMap, RUN, signed};
use crate::field::{Field, GradientsMut, Points};
use crate::solid::leaves::words::Word;

/// Some points, gathered in columns.
pub(super) struct Gathered {
    x: [f64; RUN],
    y: [f64; RUN],
    z: [f64; RUN],
    count: usize,
}

impl Gathered {
    pub const EMPTY: Self = Self { x: [0.0; RUN], y: [0.0; RUN], z: [0.0; RUN], count: 0 };

    pub fn fill(&mut self, points: Points<'_>, numbers: impl Iterator<Item = usize>) {
        self.count = 0;
        for i in numbers {
            (self.x[self.count], self.y[self.count], self.z[self.count]) =
                (points.x[i], points.y[i], points.z[i]);
            self.count += 1;
        }
    }

    pub fn columns(&self) -> [&[f64]; 3] {
        [&self.x[..self.count], &self.y[..self.count], &self.z[..self.count]]
    }
}

/// Values of a tree at up to [`RUN`] points, and the leaves that decide there, as words.
struct Decided {
    values: [f64; RUN],
    words: [u32; RUN],
}

impl Decided {
    const NONE: Self = Self { values: [0.0; RUN], words: [0; RUN] };
}

impl CellMap {
    /// ω and ∇ω at many points.
    pub(super) fn gradients(&self, points: Points<'_>, mut out: GradientsMut<'_>) {
        let mut gathered = Gathered::EMPTY;
        for first in (0..points.len()).step_by(RUN) {
            let count = RUN.min(points.len() - first);
            // points of one tree come together by where it lies in the memory; those of none come first
            let mut keys = [(None, 0); RUN];
            for (k, key) in keys[..count].iter_mut().enumerate() {
                *key = (self.words_for(points.get(first + k)).map(<[u32]>::as_ptr), first + k);
            }
            let keys = &mut keys[..count];
            keys.sort_unstable();
            for group in keys.chunk_by(|a, b| a.0 == b.0) {
                let numbers = group.iter().map(|key| key.1);
                let Some(words) = self.words_for(points.get(group[0].1)) else {
                    // no cell answers, but all leaves do
                    for i in numbers {
                        let (omega, gradient) = self.twin.omega_grad(points.get(i));
                        (out.omega[i], out.x[i], out.y[i], out.z[i]) =
                            (omega, gradient.x, gradient.y, gradient.z);
                    }
                    continue;
                };
                gathered.fill(points, numbers.clone());
                self.gradients_of(words, &gathered, numbers, &mut out);
            }
        }
    }

    /// ω and ∇ω at the gathered points, by one tree, for the points of these numbers.
    fn gradients_of(
        &self,
        words: &[u32],
        points: &Gathered,
        numbers: impl Iterator<Item = usize> + Clone,
        out: &mut GradientsMut<'_>,
    ) {
        let mut decided = Decided::NONE;
        self.decide_many(words, &mut 0, points, &mut decided);
        for (value, i) in decided.values.iter().zip(numbers.clone()) {
            out.omega[i] = *value;
        }
        let mut winners = [0; RUN];
        let winners = &mut winners[..points.count];
        winners.copy_from_slice(&decided.words[..points.count]);
        winners.sort_unstable();
        let mut chosen = Gathered::EMPTY;
        for same in winners.chunk_by(|a, b| a == b) {
            let Word::Leaf { leaf, negated } = Word::read(same[0]) else { continue };
            let won = |(k, i): (usize, usize)| (decided.words[k] == same[0]).then_some((k, i));
            let [x, y, z] = points.columns();
            let places = || numbers.clone().enumerate().filter_map(won);
            chosen.fill(Points::new(x, y, z), places().map(|(k, _)| k));
            let mut found = [[0.0; RUN]; 4];
            let columns = found.each_mut().map(|column| &mut column[..chosen.count]);
            self.parts.leaves.gradients(leaf, chosen.columns(), columns);
            let [_, gx, gy, gz] = &found;
            for (k, (_, i)) in places().enumerate() {
                let gradient = [gx[k], gy[k], gz[k]].map(|g| signed(g, negated));
                [out.x[i], out.y[i], out.z[i]] = gradient;
            }
        }
    }

    /// `Leaves::decide` for many points.
    fn decide_many(&self, words: &[u32], at: &mut usize, points: &Gathered, out: &mut Decided) {
        let word = words[*at];
        *at += 1;
        let count = points.count;
        let (parts, all) = match Word::read(word) {
            Word::Leaf { leaf, negated } => {
                let values = &mut out.values[..count];
                self.parts.leaves.values(leaf, points.columns(), values);
                values.iter_mut().for_each(|value| *value = signed(*value, negated));
                return out.words[..count].fill(word);
            }
            Word::All(parts) => (parts, true),
            Word::Any(parts) => (parts, false),
        };
        self.decide_many(words, at, points, out);
        let mut next = Decided::NONE;
        for _ in 1..parts {
            self.decide_many(words, at, points, &mut next);
            for k in 0..count {
                let (best, value) = (out.values[k], next.values[k]);
                let wins = if all { value < best } else { value > best };
                if wins || value.is_nan() {
                    (out.values[k], out.words[k]) = (value, next.words[k]);
                }
            }
        }
    }
}
