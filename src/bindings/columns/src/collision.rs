//! Particles that have entered a solid: put back to its surface, and reflected.

use std::ops::Range;
use std::sync::OnceLock;

use rfm::Solid;
use rfm::field::{Field, Normals, Points, Walls};
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::solid::Bounds;
use rfm::sph::{self, Contact, Undefined, push_out};

use crate::memory::Vectors;

/// Particles whose ω is found together.
const BLOCK: usize = 512;

/// Particles of a part, where what is remembered of those that are hit should be little.
pub const PARTICLES: usize = 16 * BLOCK;

/// How a solid answers to what hits it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounce {
    restitution: f64,
    friction: f64,
    reach: f64,
}

impl Bounce {
    /// An answer by the part of the normal speed that returns; by Coulomb's coefficient, so that the tangential speed
    /// loses at most this part of the change of the normal speed; and by the farthest that a particle is moved, m.
    ///
    /// # Errors
    /// What is wrong with a number.
    pub fn new(restitution: f64, friction: f64, reach: f64) -> Result<Self, String> {
        let range = |name: &str, value: f64, fits: bool, expected: &str| match fits {
            true => Ok(()),
            false => Err(format!("{name} is {value}, expected {expected}")),
        };
        range("restitution", restitution, (0.0..=1.0).contains(&restitution), "0 to 1")?;
        range("friction", friction, (0.0..f64::INFINITY).contains(&friction), "0 or more")?;
        range("reach", reach, reach > 0.0, "a length above 0")?;
        Ok(Self { restitution, friction, reach })
    }
}

/// What became of a particle that is not outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Collision {
    /// It was inside, and has been put back.
    Hit,
    /// It is inside, and there is no way out within reach. It was left as it is.
    Stuck,
    /// Its place or its velocity is not finite, or ω has no value there. It was left as it is.
    Undefined,
}

/// Puts a particle that is not outside back to the nearest place outside, and reflects its velocity relative to the
/// surface's own. `walls` is the solid, or what has its sign and its surface.
fn collide(
    solid: &Solid,
    walls: &dyn Walls,
    bounce: &Bounce,
    position: &mut DVec3,
    velocity: &mut DVec3,
) -> Collision {
    if !(position.is_finite() && velocity.is_finite()) {
        return Collision::Undefined;
    }
    let contact = match through_one_face(walls, *position, bounce.reach) {
        Some(contact) => Ok(Some(contact)),
        None => way_out(walls, *position, bounce.reach),
    };
    let contact = match contact {
        Ok(Some(contact)) => contact,
        Ok(None) => return Collision::Stuck,
        Err(_) => return Collision::Undefined,
    };
    let wall = if solid.moves() { solid.wall_velocity(contact.point) } else { DVec3::ZERO };
    *velocity = wall + sph::bounce(*velocity - wall, &contact, bounce.restitution, bounce.friction);
    *position = contact.point;
    Collision::Hit
}

/// The place outside that Newton's method finds behind a face, within some rounding errors of its surface. Most particles
/// that are hit have passed one face: a flat one takes two gradients, a curved one four. `None` if another face is met on
/// the way, or if no such place is found within reach.
fn through_one_face(walls: &dyn Walls, from: DVec3, reach: f64) -> Option<Contact> {
    let mut here = from;
    let mut first = None;
    let mut last = f64::INFINITY;
    for _ in 0..8 {
        let (w, gradient) = walls.omega_grad(here);
        let slope = gradient.length();
        let (normal, distance) = (-gradient / slope, w / slope);
        let rounding = least_step(here);
        // steps that do not shrink fast may have gone past a gap, or the formula is far from a distance
        let is_close = distance.abs() <= rounding || distance.abs() <= 0.25 * last;
        // an undefined or vanishing gradient ends it, too
        if !(is_close && is_alike(*first.get_or_insert(normal), normal)) {
            return None;
        }
        if w < 0.0 && (-distance).min(last) <= rounding {
            let mut faces = Normals::default();
            faces.add(normal);
            let contact = Contact { fraction: 1.0, point: here, normal, faces };
            return (here.distance(from) <= reach).then_some(contact);
        }
        // a little farther than the surface, so that a flat face takes two gradients
        here += normal * (distance + 0.5 * rounding);
        last = distance.abs();
    }
    None
}

/// Some rounding errors of a place, m: a particle on the surface would never leave it with less.
fn least_step(at: DVec3) -> f64 {
    (8.0 * f64::EPSILON * at.abs().max_element()).max(f64::MIN_POSITIVE)
}

/// The nearest place outside, with all faces that are passed on the way there: in a corner of a vessel a particle is
/// behind several, and must not keep its speed towards any of them.
fn way_out(walls: &dyn Walls, from: DVec3, reach: f64) -> Result<Option<Contact>, Undefined> {
    let mut passed = Normals::default();
    let mut here = from;
    let mut found = push_out(walls, from, reach, 0.0)?;
    // a face takes Newton's method some steps, and `push_out` ends after eight
    for _ in 0..32 {
        let (w, gradient) = walls.omega_grad(here);
        // an undefined or vanishing gradient ends it, too
        let inside = w >= 0.0 && gradient.length_squared() > 0.0;
        if !inside {
            break;
        }
        let normal = -gradient.normalize();
        if !passed.iter().any(|known| is_alike(known, normal)) {
            passed.add(normal);
        }
        if found.is_none() {
            found = push_out(walls, here, reach, 0.0)?;
        }
        here += normal * (w / gradient.length()).max(least_step(here));
    }
    Ok(found.filter(|contact| contact.point.distance(from) <= reach).map(|mut contact| {
        let mut faces = Normals::default();
        passed
            .iter()
            .filter(|normal| !is_alike(*normal, contact.normal))
            .for_each(|normal| faces.add(normal));
        if !faces.is_empty() {
            contact.faces.iter().for_each(|normal| faces.add(normal));
            contact.faces = faces;
        }
        contact
    }))
}

/// Whether two normals may be those of one face that is curved.
fn is_alike(a: DVec3, b: DVec3) -> bool {
    a.dot(b) > 0.99
}

/// A solid that particles collide with.
pub struct Obstacle {
    solid: Solid,
    /// Where the particles are, if the caller has said so.
    over: Option<Aabb>,
    known: OnceLock<Known>,
}

/// What is found out once about an obstacle.
struct Known {
    /// Nothing outside this box is inside the solid.
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
    #[allow(clippy::len_without_is_empty)] // nobody asks
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
    pub fn look(&self, part: Range<usize>, obstacle: &Obstacle, bounce: &Bounce) -> Found {
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
                let collision = collide(&obstacle.solid, walls, bounce, &mut position, &mut velocity);
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
