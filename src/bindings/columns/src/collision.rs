//! Particles that have entered a solid: put back to its surface, and reflected.

use std::ops::Range;
use std::sync::OnceLock;

use rfm::Solid;
use rfm::field::{Field, Points, Walls};
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::solid::Bounds;
use rfm::sph::{Collision, Rebound, put_back};

use crate::memory::Vectors;

/// Particles whose ω is found together.
const BLOCK: usize = 512;

/// Particles of a part, where what is remembered of those that are hit should be little.
pub const PARTICLES: usize = 16 * BLOCK;

/// A solid that particles collide with.
pub struct Obstacle {
    solid: Solid,
    /// Where the particles are, if the caller has said so.
    over: Option<Aabb>,
    known: OnceLock<Known>,
}

/// What is found out once about an obstacle.
struct Known {
    /// Nothing outside this box is inside the solid; `None` if no such box is known.
    bounds: Option<Aabb>,
    /// What has exactly the sign and the surface of the solid, and one face after the other inside it; of a solid with
    /// many parts it knows which of them matter where.
    walls: Box<dyn Walls>,
}

impl Obstacle {
    /// A solid, and the box where the particles are. A solid of many parts that has no bounds needs it to be fast.
    pub fn new(solid: Solid, over: Option<Aabb>) -> Self {
        Self { solid, over, known: OnceLock::new() }
    }

    /// Finds out what is to be known, once. For a solid of many parts that takes a while.
    pub fn prepare(&self) {
        self.known();
    }

    fn known(&self) -> &Known {
        self.known.get_or_init(|| {
            if self.solid.moves() && !self.solid.has_many_leaves() {
                // its bounds would be searched again for every step: 5 ms for a box that turns, against 0.1
                // ms for ω of three thousand particles
                return Known { bounds: None, walls: Box::new(self.solid.twin()) };
            }
            let bounds = match *self.solid.bounds() {
                Bounds::Within(bounds) => Some(bounds),
                Bounds::Empty => Some(Aabb::EMPTY),
                Bounds::Unbounded => None,
            };
            // a little larger, because particles enter walls around the box, and are put back to places outside
            let over = if bounds == Some(Aabb::EMPTY) { None } else { bounds.or(self.over) };
            let over = over.map_or(Aabb::EMPTY, |over| over.grown(0.1 * over.size().max_element()));
            let walls = on_one_thread(|| self.solid.surface(over));
            Known { bounds, walls: walls.unwrap_or_else(|| Box::new(self.solid.clone())) }
        })
    }
}

/// Does something without the threads of the process: a host may have its own, or have been forked. `None` if there
/// is no thread to be had.
fn on_one_thread<R: Send>(work: impl FnOnce() -> R + Send) -> Option<R> {
    Some(rayon::ThreadPoolBuilder::new().num_threads(1).build().ok()?.install(work))
}

/// How many particles have met a solid.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Collisions {
    /// Particles that were inside, or on the surface, and are put back.
    pub hits: usize,
    /// Particles that are inside without a way out within reach. They stay as they are.
    pub stuck: usize,
    /// Particles whose numbers are not finite, or at which the formula has no value. They stay as they are.
    pub undefined: usize,
}

impl Collisions {
    /// The sum of two counts.
    pub fn and(self, other: Self) -> Self {
        Self {
            hits: self.hits + other.hits,
            stuck: self.stuck + other.stuck,
            undefined: self.undefined + other.undefined,
        }
    }
}

/// What became of a part of the particles, before anything is written.
#[derive(Debug, Default)]
pub struct Found {
    /// How many there are of each kind.
    pub counts: Collisions,
    /// Particles that have been hit, with their new places and velocities.
    moved: Vec<(usize, DVec3, DVec3)>,
}

impl Found {
    fn add(&mut self, i: usize, collision: Collision, position: DVec3, velocity: DVec3) {
        match collision {
            Collision::Stuck => self.counts.stuck += 1,
            Collision::Undefined => self.counts.undefined += 1,
            Collision::Hit => self.moved.push((i, position, velocity)),
        }
    }
}

/// Particles in the memory of another language.
pub struct Particles(Vectors<2>);

impl Particles {
    /// Particles by their positions and, second, their velocities.
    pub fn new(vectors: Vectors<2>) -> Self {
        Self(vectors)
    }

    /// The number of particles.
    #[allow(clippy::len_without_is_empty)] // not needed
    pub fn len(&self) -> usize {
        self.0.len()
    }

    fn velocity(&self, i: usize) -> DVec3 {
        DVec3::from_array(self.0.get(1, i))
    }

    /// What becomes of a part of the particles. Nothing is written, so that parts may be looked at together.
    ///
    /// # Panics
    /// If there are fewer particles.
    pub fn look(&self, part: Range<usize>, obstacle: &Obstacle, rebound: &Rebound) -> Found {
        assert!(part.start <= part.end && part.end <= self.len(), "a part of the particles");
        let known = obstacle.known();
        let walls = &*known.walls;
        let mut found = Found::default();
        let mut places = [[0.0; BLOCK]; 3];
        let mut omega = [0.0; BLOCK];
        for start in part.clone().step_by(BLOCK) {
            let block = start..(start + BLOCK).min(part.end);
            if !self.gather(&block, known.bounds.as_ref(), &mut places) {
                continue;
            }
            let [x, y, z] = places.each_ref().map(|column| &column[..block.len()]);
            // most particles are outside, and together they cost a fraction of what each costs alone
            Field::omega_many(walls, Points::new(x, y, z), &mut omega[..block.len()]);
            for (k, i) in block.clone().enumerate() {
                let mut velocity = self.velocity(i);
                if omega[k] < 0.0 && velocity.is_finite() {
                    continue;
                }
                let mut position = DVec3::from_array(places.each_ref().map(|column| column[k]));
                let collision = put_back(walls, rebound, &mut position, &mut velocity);
                found.add(i, collision, position, velocity);
            }
        }
        found.counts.hits = found.moved.len();
        found
    }

    /// Copies the places of a block. False if all of them are outside a box, and all numbers finite.
    fn gather(&self, block: &Range<usize>, bounds: Option<&Aabb>, places: &mut [[f64; BLOCK]; 3]) -> bool {
        let [x, y, z] = places;
        for (k, i) in block.clone().enumerate() {
            [x[k], y[k], z[k]] = self.0.get(0, i);
        }
        let Some(bounds) = bounds else { return true };
        block.clone().enumerate().any(|(k, i)| {
            let place = DVec3::new(x[k], y[k], z[k]);
            bounds.contains(place) || !(place.is_finite() && self.velocity(i).is_finite())
        })
    }

    /// Writes what [`Particles::look`] has found.
    pub fn put(&mut self, found: &Found) {
        for (i, position, velocity) in &found.moved {
            self.0.set(0, *i, position.to_array());
            self.0.set(1, *i, velocity.to_array());
        }
    }
}
