//! The twin's value at many points, from the leaves that decide it near each. It differs from the value of
//! the twin's own program by rounding, and where a leaf occurs with several factors; its sign is the same.

use glam::DVec3;

use super::gradients::Gathered;
use super::map::{CellMap, RUN};
use crate::field::{Field, Points};

impl CellMap {
    /// The twin's value at a point.
    pub(super) fn value(&self, p: DVec3) -> f64 {
        let mut omega = [0.0];
        self.values(Points::new(&[p.x], &[p.y], &[p.z]), &mut omega);
        omega[0]
    }

    /// [`CellMap::value`] at many points.
    pub(super) fn values(&self, points: Points<'_>, omega: &mut [f64]) {
        let leaves = &self.parts.leaves;
        let mut gathered = Gathered::EMPTY;
        let mut found = [0.0; RUN];
        for first in (0..points.len()).step_by(RUN) {
            let count = RUN.min(points.len() - first);
            let mut keys = [(None, 0); RUN];
            for (k, key) in keys[..count].iter_mut().enumerate() {
                *key = (self.deciding.find(&self.parts, points.get(first + k)), first + k);
            }
            let keys = &mut keys[..count];
            keys.sort_unstable();
            for group in keys.chunk_by(|a, b| a.0 == b.0) {
                let Some(cell) = group[0].0 else {
                    group.iter().for_each(|&(_, i)| omega[i] = self.twin.omega(points.get(i)));
                    continue;
                };
                gathered.fill(points, group.iter().map(|key| key.1));
                let words = self.deciding.words(&self.parts, cell);
                let found = &mut found[..group.len()];
                self.run_many(words, &mut 0, gathered.columns(), &|leaf| leaves.factor(leaf), found);
                group.iter().zip(&*found).for_each(|(&(_, i), value)| omega[i] = *value);
            }
        }
    }
}
