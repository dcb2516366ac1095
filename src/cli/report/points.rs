//! The points at which programs are timed and their errors measured.

use glam::DVec3;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};

use rfm::geom::Aabb;
use rfm::{Precision, Solid};

/// Points of a timed batch: enough to fill the pipelines, and few enough to stay in the nearest cache.
const TIMED: usize = 4096;

/// Random points at which errors are measured. Each costs some 100 µs of 120-digit arithmetic.
const JUDGED: usize = 600;

/// Points on the surface at which errors are measured.
const ON_SURFACE: usize = 400;

pub(super) struct SamplePoints {
    pub over: Aabb,
    pub random: Vec<DVec3>,
    /// The number of random points at which errors are measured. They come first.
    pub random_judged: usize,
    /// Points as near to ω = 0 as `f64` allows.
    pub surface: Vec<DVec3>,
}

impl SamplePoints {
    /// Chooses points. Equal solids and boxes get equal points.
    pub fn choose(solid: &Solid, over: Aabb) -> Self {
        let mut generator = Pcg64::seed_from_u64(1);
        let mut unit = || (generator.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        let mut inside = |aabb: &Aabb| aabb.min + aabb.size() * DVec3::new(unit(), unit(), unit());
        let random: Vec<DVec3> = (0..TIMED).map(|_| inside(&over)).collect();
        let near = solid.bounds().aabb().map_or(over, |b| b.intersection(&over));
        let near = if near.is_empty() { over } else { near };
        let mut surface = Vec::new();
        for _ in 0..50 * ON_SURFACE {
            let (a, b) = (inside(&near), inside(&over));
            if surface.len() < ON_SURFACE && solid.sign(a) > 0.0 && solid.sign(b) < 0.0 {
                surface.push(bisect(solid, a, b));
            }
        }
        Self { over, random, random_judged: JUDGED, surface }
    }

    /// The points at which errors are measured, random ones first, rounded to a precision.
    pub fn judged(&self, precision: Precision) -> impl Iterator<Item = DVec3> + '_ {
        let points = self.random[..self.random_judged].iter().chain(&self.surface);
        points.map(move |p| match precision {
            Precision::F32 => p.as_vec3().as_dvec3(),
            Precision::F64 => *p,
        })
    }
}

/// The last point outside the solid between a point inside and a point outside.
fn bisect(solid: &Solid, mut inside: DVec3, mut outside: DVec3) -> DVec3 {
    for _ in 0..60 {
        let middle = 0.5 * (inside + outside);
        if solid.sign(middle) > 0.0 {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    outside
}
