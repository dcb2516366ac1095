//! The maps of a body that changes its shape: one at each of some instants, and a cubic in time between them.

use std::sync::Arc;

use glam::DVec3;

use super::{
    lattice::Lattice,
    map::{Brick, Spline, Taken, VolumeMap},
    stencil::Stencil,
};
use crate::{field::Moving, geom::Aabb};

/// Maps that are known at a time.
const KEYS: usize = 4;

/// A body that changes its shape, and how often it is looked at.
#[derive(Clone)]
pub struct ChangingShape {
    /// The body.
    pub body: Arc<dyn Moving>,
    /// Time between two looks, s. Its surface should move by no more than a sixth of the support radius in it.
    pub interval: f64,
    /// The end of the run, s. What follows on it is looked at only if a simulation goes on beyond it.
    pub until: f64,
}

/// The maps around the present time.
pub(super) struct Changing {
    shape: ChangingShape,
    lattice: Arc<Lattice>,
    stencil: Arc<Stencil>,
    /// The number of the first map: how many intervals after the time 0 it is.
    first: u64,
    maps: Vec<VolumeMap>,
    /// The weight of each map.
    weights: [f64; KEYS],
    /// Their derivatives, 1/s.
    rates: [f64; KEYS],
    /// What they add up to now.
    present: Spline,
}

impl Changing {
    /// The maps in a box for a support radius, m. `None` if the box has too many cells, see [`VolumeMap::new`].
    pub fn new(shape: &ChangingShape, domain: &Aabb, h: f64, time: f64) -> Option<Self> {
        let lattice = Arc::new(Lattice::new(domain, h));
        let mut changing = Self {
            shape: shape.clone(),
            stencil: Arc::new(Stencil::new(&lattice, h)),
            present: Spline::new(&lattice)?,
            lattice,
            first: 0,
            maps: Vec::new(),
            weights: [0.0; KEYS],
            rates: [0.0; KEYS],
        };
        changing.move_to(time);
        (changing.maps.len() == KEYS).then_some(changing)
    }

    /// Makes the maps around a time, s. Which these are depends on the time alone, so that a run which is resumed goes on
    /// with the same ones.
    pub fn move_to(&mut self, time: f64) {
        let ChangingShape { interval, until, .. } = self.shape;
        let spare = KEYS as u64 - 2;
        // of times before the start, and after the end, a formula need not hold
        let mut first = ((time / interval) as u64).saturating_sub(1);
        if time <= until {
            let last = (until / interval).ceil() as u64;
            first = first.min(last.saturating_sub(spare + 1));
        }
        let kept =
            if first >= self.first { (first - self.first).min(self.maps.len() as u64) } else { u64::MAX };
        self.maps.drain(..self.maps.len().min(kept as usize));
        self.first = first;
        while self.maps.len() < KEYS {
            let at = (first + self.maps.len() as u64) as f64 * interval;
            let at = if time <= until { at.min(until) } else { at };
            let body = self.shape.body.during(at, at);
            let Some(map) = VolumeMap::on(&self.lattice, &self.stencil, vec![body.into()]) else { return };
            self.maps.push(map);
        }
        let x = time / interval - first as f64;
        self.weights = cubic(x);
        self.rates = cubic_slopes(x).map(|slope| slope / interval);
        if let Some(present) = Spline::new(&self.lattice) {
            self.present = present;
        }
    }

    /// What the body takes of the kernel at a place in the box; `None` if it is not near.
    pub fn at(&self, p: DVec3) -> Option<Taken> {
        self.present.at(p, |at| self.blended(at))
    }

    fn blended(&self, at: [usize; 3]) -> Option<Box<Brick>> {
        let terms = self.maps.iter().zip(self.weights).zip(self.rates);
        Brick::sum(terms.map(|((map, weight), rate)| (map.brick(at), weight, rate)))
    }

    pub fn bytes(&self) -> usize {
        self.maps.iter().map(VolumeMap::bytes).sum()
    }
}

/// The weights of values at 0, 1, 2, 3 in the cubic through them (Lagrange).
fn cubic(x: f64) -> [f64; KEYS] {
    let [a, b, c, d] = [x, x - 1.0, x - 2.0, x - 3.0];
    [-b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0]
}

/// The derivatives of these weights.
fn cubic_slopes(x: f64) -> [f64; KEYS] {
    let [a, b, c, d] = [x, x - 1.0, x - 2.0, x - 3.0];
    let slope = |a: f64, b: f64, c: f64| a * b + b * c + c * a;
    [-slope(b, c, d) / 6.0, slope(a, c, d) / 2.0, -slope(a, b, d) / 2.0, slope(a, b, c) / 6.0]
}
