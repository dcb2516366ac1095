//! Operands of one `and` or `or` whose gradients differ by a large factor.

use glam::DVec3;

use super::crossings::{FEW_NODES, Lattice};
use super::operands::{Kind, Operands};
use crate::diagnostic::Span;
use crate::solid::construction::Solid;

/// Two operands that are joined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uneven {
    /// Where the operand with the larger gradient is written.
    pub steep: Option<Span>,
    /// Where the other one is written.
    pub flat: Option<Span>,
    /// Sizes of the gradients at the surface, in units of ω over length: that of the steep operand, at its flattest,
    /// and that of the flat one, at its steepest.
    pub gradients: [f64; 2],
}

/// Gradients that differ by at least this factor are reported.
const FACTOR: f64 = 1e3;

/// Maximum number of points of the surface that are looked at, and how often an edge is halved to find one:
/// much nearer than leaves are compared.
const POINTS: usize = 400;
const HALVINGS: usize = 20;

/// Distance over which leaves are compared, as a part of a cell.
const DIFFERENCE: f64 = 1e-4;

/// Points of the surface that must have been seen of each leaf before its gradient counts.
const LEAST_POINTS: usize = 5;

impl Solid {
    /// The operands of `and` and `or` whose gradients at the surface differ by a factor of 1000 or more. Only
    /// what is seen on the surface counts.
    pub fn uneven_operands(&self) -> Vec<Uneven> {
        let (graph, root) = self.formula();
        let (Some(bounds), Some(parts)) = (self.bounds().aabb(), self.parts()) else { return Vec::new() };
        let Some(operands) = Operands::of(graph, root) else { return Vec::new() };
        let space = bounds.grown(0.01 * bounds.size().max_element());
        let mut of_leaf: Vec<Vec<f64>> = vec![Vec::new(); operands.leaves];
        let lattice = Lattice::of(self, &space, FEW_NODES);
        // a difference gives the size of a gradient well enough, and needs no program
        let step = DIFFERENCE * lattice.cell().max_element();
        for crossing in lattice.crossings(self, POINTS, HALVINGS).0 {
            let p = crossing.ends[0];
            let (_, (leaf, _)) = parts.leaves.decide(&parts.words, &mut 0, p);
            let slope = |axis: DVec3| {
                let [after, before] = [step, -step].map(|step| parts.leaves.value(leaf, p + step * axis));
                (after - before) / (2.0 * step)
            };
            let gradient = DVec3::from_array([DVec3::X, DVec3::Y, DVec3::Z].map(slope));
            of_leaf[leaf as usize].push(gradient.length());
        }
        let sizes: Vec<Option<f64>> = of_leaf.into_iter().map(median).collect();
        operands.uneven(&sizes)
    }
}

fn median(mut sizes: Vec<f64>) -> Option<f64> {
    sizes.retain(|size| size.is_finite() && *size > 0.0);
    sizes.sort_by(f64::total_cmp);
    (sizes.len() >= LEAST_POINTS).then(|| sizes[sizes.len() / 2])
}

impl Operands {
    /// Operands of very different gradients, from the gradients of the leaves.
    fn uneven(&self, of_leaf: &[Option<f64>]) -> Vec<Uneven> {
        // the least and the greatest gradient within each operand, as it is joined
        let mut ranges: Vec<Option<[f64; 2]>> = vec![None; self.all.len()];
        let mut found = Vec::new();
        for (i, operand) in self.all.iter().enumerate().rev() {
            let range = match operand.kind {
                Kind::Leaf { leaf, .. } => of_leaf[leaf as usize].map(|size| [size, size]),
                Kind::All(a, b) | Kind::Any(a, b) => {
                    found.extend(self.pair([a, b], [ranges[a], ranges[b]]));
                    match (ranges[a], ranges[b]) {
                        (Some(a), Some(b)) => Some([a[0].min(b[0]), a[1].max(b[1])]),
                        (a, b) => a.or(b),
                    }
                }
            };
            ranges[i] = range.map(|range| range.map(|size| size * operand.factor));
        }
        found.reverse();
        found
    }

    fn pair(&self, operands: [usize; 2], ranges: [Option<[f64; 2]>; 2]) -> Option<Uneven> {
        let [first, second] = [ranges[0]?, ranges[1]?];
        let [a, b] = operands.map(|i| self.all[i].span);
        if first[0] >= FACTOR * second[1] {
            Some(Uneven { steep: a, flat: b, gradients: [first[0], second[1]] })
        } else if second[0] >= FACTOR * first[1] {
            Some(Uneven { steep: b, flat: a, gradients: [second[0], first[1]] })
        } else {
            None
        }
    }
}
