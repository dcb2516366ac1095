//! The maps of a body that changes its shape: one at each of some instants, and a cubic in time between them. A body that
//! switches has one for each of its shapes.

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

/// The most maps that are kept of a body that switches.
const MOST_SHAPES: usize = 8;

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
    /// Whether the body says when it is the same, as one does that is at rest but for some instants.
    pub switches: bool,
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
    maps: Vec<Arc<VolumeMap>>,
    /// The maps of a body that switches, each with a time, s, at which it held. They are made once.
    shapes: Vec<(f64, Arc<VolumeMap>)>,
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
            shapes: Vec::new(),
            weights: [0.0; KEYS],
            rates: [0.0; KEYS],
        };
        changing.move_to(time);
        (changing.maps.len() == if shape.switches { 1 } else { KEYS }).then_some(changing)
    }

    /// Makes the maps around a time, s. They depend on the time alone, so a resumed run with the same end
    /// continues with the same maps.
    pub fn move_to(&mut self, time: f64) {
        if time == self.time {
            return;
        }
        let before = std::mem::replace(&mut self.time, time);
        if self.shape.switches {
            return self.switch(before);
        }
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
            let Some(map) = self.map(at) else { return };
            self.maps.push(map);
        }
        let x = time / interval - first as f64;
        self.weights = cubic(x);
        self.rates = cubic_slopes(x).map(|slope| slope / interval);
        if let Some(present) = Spline::new(&self.lattice) {
            self.present = present;
        }
    }

    /// The map of the body at an instant, s; `None` if it has too many cells.
    fn map(&self, at: f64) -> Option<Arc<VolumeMap>> {
        let body = self.shape.body.during(at, at);
        Some(Arc::new(VolumeMap::on(&self.lattice, &self.stencil, vec![body.into()])?))
    }

    /// Takes the map of the shape that the body has now, and had not at the time `before`, s. What is there at once does not
    /// come with a velocity.
    fn switch(&mut self, before: f64) {
        let is_same = |at: f64| self.shape.body.is_same(at, self.time);
        if !self.maps.is_empty() && is_same(before) {
            return;
        }
        let map = match self.shapes.iter().find(|(at, _)| is_same(*at)) {
            Some((_, map)) => map.clone(),
            None => {
                let Some(map) = self.map(self.time) else { return };
                if self.shapes.len() < MOST_SHAPES {
                    self.shapes.push((self.time, map.clone()));
                }
                map
            }
        };
        self.maps = vec![map];
        (self.weights, self.rates) = ([1.0, 0.0, 0.0, 0.0], [0.0; KEYS]);
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
        let shapes = self.shapes.iter().map(|(_, map)| map);
        let maps = self.maps.iter().filter(|_| !self.shape.switches);
        maps.chain(shapes).map(|map| map.bytes()).sum()
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
