//! Whether a fluid has a free surface: whether its scene leaves it room, at the start or later.

use glam::DVec3;

use super::room::{Crowd, LEAST_ROOM};
use crate::Solid;
use crate::lower::Scene;

/// Samples in the room of a scene that show for certain whether it is full, and those that will do where it is a
/// small part of its box, of which there are no more than the last number.
const ENOUGH_SAMPLES: f64 = 4096.0;
const LEAST_SAMPLES: f64 = 1000.0;
const MOST_SAMPLES: u32 = 1 << 18;

/// Standard deviations by which the dry samples are too many for a fluid without a surface, so that no more are
/// taken.
const CERTAIN: f64 = 5.0;

/// Later instants, s, at which it is looked whether bodies that move leave room free, or take some: from the first to
/// the last, each by the same factor later than the one before, so that no period hides. They do not depend on the
/// run, which may be continued to a later end with the same method.
const LATER: [f64; 2] = [0.01, 100.0];
const INSTANTS: i32 = 24;

/// A room for fewer particles is no full one: gaps of one particle are all there is, and differences of pressure
/// fling particles through them.
const FEWEST: f64 = 200.0;

/// Whether the fluid has a free surface: whether it leaves room free, or bodies that move change the room. Found by
/// samples; if too few of them lie in the room, or too few particles of the given spacing, m, have a place there, it
/// counts as having one.
pub(super) fn has_surface<'a>(
    scene: &Scene,
    fluid: &Solid,
    bodies: impl Iterator<Item = &'a Solid>,
    spacing: f64,
) -> bool {
    if scene.fluid.particles.is_some() && scene.fluid.size_span.is_some() {
        // that many particles of that size need not fill the shape
        return true;
    }
    let (moving, still): (Vec<&Solid>, Vec<&Solid>) = bodies.partition(|body| body.moves());
    let now = all_at(&moving, 0.0);
    let (still, now) = (Crowd::of(still.into_iter()), Crowd::of(now.iter()));
    let places = (1..=MOST_SAMPLES).map(|k| scene.domain.evenly(k));
    let (mut dry, mut wet, mut samples) = (0.0, 0.0, 0);
    for at in places.clone() {
        samples += 1;
        if !(still.is_free(at) && now.is_free(at)) {
            continue;
        }
        *(if fluid.omega(at) > 0.0 { &mut wet } else { &mut dry }) += 1.0;
        let expected = (LEAST_ROOM - 1.0) * wet;
        if dry > expected + CERTAIN * (1.0 + expected.sqrt()) {
            return true;
        }
        if dry + wet >= ENOUGH_SAMPLES {
            break;
        }
    }
    let particles = scene.domain.volume() * wet / samples as f64 / spacing.powi(3);
    let room = (LEAST_ROOM - 1.0) * wet;
    let is_unsure = dry + wet < LEAST_SAMPLES || particles < FEWEST;
    // only now, because to find out how bodies will move takes longest
    is_unsure || dry + changed(&still, &now, &moving, places.take(samples)) >= room
}

fn all_at(solids: &[&Solid], time: f64) -> Vec<Solid> {
    solids.iter().map(|body| body.at(time)).collect()
}

/// By how many of some places the room changes at most when bodies move: places that they have left, less those
/// that they have entered.
fn changed(
    still: &Crowd<'_>,
    now: &Crowd<'_>,
    moving: &[&Solid],
    places: impl Iterator<Item = DVec3> + Clone,
) -> f64 {
    if moving.is_empty() {
        return 0.0;
    }
    let [first, last] = LATER;
    let factor = (last / first).powf(1.0 / f64::from(INSTANTS - 1));
    let at_instant = |k: i32| {
        let then = all_at(moving, first * factor.powi(k));
        let then = Crowd::of(then.iter());
        let open = places.clone().filter(|at| still.is_free(*at));
        open.map(|at| f64::from(then.is_free(at)) - f64::from(now.is_free(at))).sum::<f64>()
    };
    (0..INSTANTS).map(at_instant).map(f64::abs).fold(0.0, f64::max)
}
