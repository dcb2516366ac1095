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
    /// The end of the run, s. The time after it is looked at only if a simulation goes beyond it.
    pub until: f64,
    /// Equal intervals of the run, at least three, between which the body is looked at. Its surface should
    /// move by at most an eighth of the support radius in any of them.
    pub intervals: u64,
}

impl ChangingShape {
    /// The length of an interval, s.
    fn interval(&self) -> f64 {
        self.until / self.intervals as f64
    }

    /// The instant, s, after the given number of intervals.
    fn instant(&self, number: u64) -> f64 {
        // a formula need not hold even a rounding error behind the end
        if number == self.intervals { self.until } else { number as f64 * self.interval() }
    }
}

/// The maps around the present time.
pub(super) struct Changing {
    shape: ChangingShape,
    lattice: Arc<Lattice>,
    stencil: Arc<Stencil>,
    /// The present time, s. Not a number before the first maps are made.
    time: f64,
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
            time: f64::NAN,
            first: 0,
            maps: Vec::new(),
            weights: [0.0; KEYS],
            rates: [0.0; KEYS],
        };
        changing.move_to(time);
        (changing.maps.len() == KEYS).then_some(changing)
    }

    /// Makes the maps around a time, s. They depend on the time alone, so a resumed run with the same end
    /// continues with the same maps.
    pub fn move_to(&mut self, time: f64) {
        if time == self.time {
            return;
        }
        self.time = time;
        let interval = self.shape.interval();
        // a formula need not hold for times before the start and after the end
        let mut first = ((time / interval) as u64).saturating_sub(1);
        if time <= self.shape.until {
            first = first.min((self.shape.intervals + 1).saturating_sub(KEYS as u64));
        }
        let kept =
            if first >= self.first { (first - self.first).min(self.maps.len() as u64) } else { u64::MAX };
        self.maps.drain(..self.maps.len().min(kept as usize));
        self.first = first;
        while self.maps.len() < KEYS {
            let at = self.shape.instant(first + self.maps.len() as u64);
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
        // between maps of which two have a wall and two do not, a cubic goes beyond what the wall can take
        self.present.at(p, |at| self.blended(at)).map(|taken| Taken { part: taken.part.min(1.0), ..taken })
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
