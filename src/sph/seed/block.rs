//! Where a fluid starts: particles on a lattice with the rest spacing, inside a shape and the box.
//!
//! Invariant: no two particles coincide for any jitter, because each stays within its own lattice cell. The
//! same input gives the same particles.

use glam::DVec3;
use rand_pcg::{
    Pcg64,
    rand_core::{Rng, SeedableRng},
};

use crate::{field::Field, geom::Aabb};

use super::super::{params::Parameters, particles::Particles};
use super::deepest::deepest;
use super::error::SeedError;
use super::rows::Rows;

/// Greatest number of lattice sites. More of them are a mistake in the scene.
pub const MAX_SITES: f64 = 5e7;

/// Which part of a field's shape is filled if it has room for more particles than are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Fill {
    /// The lowest sites, as a vessel is filled.
    #[default]
    Below,
    /// The sites with the largest ω: a smaller body inside the shape, such as a drop of an exact number of
    /// particles.
    Middle,
}

/// The space that a fluid fills.
#[derive(Clone, Copy)]
pub enum FluidShape<'a> {
    /// The box, m.
    Box(Aabb),
    /// The region where ω > 0, within bounds.
    Field {
        /// Positive inside the shape.
        field: &'a dyn Field,
        /// Box that is searched for the shape, m.
        bounds: Aabb,
        /// Which part is filled if there is more room than particles.
        fill: Fill,
    },
    /// The wanted number of sites of a lattice: those that lie deepest in the region where ω > 0.
    Deepest {
        /// Positive inside the shape.
        field: &'a dyn Field,
        /// The box of the lattice, m, which is a little larger than the shape.
        bounds: Aabb,
        /// How many sites are wanted.
        number: usize,
    },
    /// The box that rows fill. They have a number and a size of their own.
    Rows(Rows),
    /// A ball around a centre, whose size follows from the number of particles.
    Drop {
        /// Centre of the ball, m.
        centre: DVec3,
    },
}

/// A body of fluid at the start of a run.
#[derive(Clone, Copy)]
pub struct FluidBlock<'a> {
    /// The space that the fluid fills.
    pub shape: FluidShape<'a>,
    /// Size of the lattice's cells, m; `None`: cubes as wide as the particles' spacing.
    pub cell: Option<DVec3>,
    /// Number of particles wanted; `None` fills the shape. A box with more room is filled from below, as a
    /// vessel is, and a field as its [`Fill`] states. A drop takes the sites nearest to its centre; it needs
    /// a count, because nothing else determines its size.
    pub count: Option<usize>,
    /// Whether fewer particles are accepted if the shape has no room for `count`.
    pub allow_fewer: bool,
    /// Initial velocity, m/s.
    pub velocity: DVec3,
    /// Random displacement as a part of the spacing, from 0 (none) to below 1.
    pub jitter: f64,
    /// Seed of the jitter.
    pub seed: u64,
}

impl<'a> FluidBlock<'a> {
    /// Fluid at rest that fills a shape, on the exact lattice.
    pub fn filling(shape: FluidShape<'a>) -> Self {
        Self {
            shape,
            cell: None,
            count: None,
            allow_fewer: false,
            velocity: DVec3::ZERO,
            jitter: 0.0,
            seed: 0,
        }
    }

    /// A drop of exactly `count` particles at rest.
    pub fn drop(centre: DVec3, count: usize) -> Self {
        Self { count: Some(count), ..Self::filling(FluidShape::Drop { centre }) }
    }
}

impl FluidBlock<'_> {
    /// The particles of this block inside `container`.
    ///
    /// # Errors
    /// [`SeedError`] if there is no room for the particles, a drop has no count, the jitter or the size is
    /// out of range, or the shape has no value at a site.
    pub fn seed(&self, parameters: &Parameters, container: Aabb) -> Result<Particles, SeedError> {
        if !(0.0..1.0).contains(&self.jitter) {
            return Err(SeedError::Jitter(self.jitter));
        }
        let spacing = parameters.spacing();
        let cell = self.cell.unwrap_or(DVec3::splat(spacing));
        let mut sites = match self.shape {
            FluidShape::Box(aabb) => lattice(aabb.intersection(&container), cell)?,
            FluidShape::Field { field, bounds, fill } => {
                let all = lattice(bounds.intersection(&container), cell)?;
                let mut inside = keep_inside(field, all)?;
                if fill == Fill::Middle {
                    // stable: equal ω keep the lattice's order
                    inside.sort_by(|a, b| b.0.total_cmp(&a.0));
                }
                inside.into_iter().map(|(_, at)| at).collect()
            }
            FluidShape::Deepest { field, bounds, number } => {
                let mut all = lattice(bounds, cell)?;
                all.retain(|&at| container.contains(at));
                deepest(field, all, cell.element_product().cbrt(), number)?
            }
            FluidShape::Rows(rows) => {
                let sites = rows.len() as f64;
                let affordable = sites <= MAX_SITES;
                if !affordable {
                    return Err(SeedError::TooLarge { sites });
                }
                rows.sites()
            }
            FluidShape::Drop { centre } => {
                let count = self.count.ok_or(SeedError::NoCount)?;
                let mut ball = ball(centre, spacing, count)?;
                ball.retain(|&p| container.contains(p));
                ball
            }
        };
        let wanted = self.count.unwrap_or(sites.len());
        if sites.len() < wanted && !self.allow_fewer {
            return Err(SeedError::DoesNotFit { wanted, room: sites.len() });
        }
        sites.truncate(wanted);

        let mut random = Pcg64::seed_from_u64(self.seed);
        let mut offset = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
        let mut particles = Particles::default();
        for site in sites {
            let shift = DVec3::new(offset(), offset(), offset()) * (self.jitter * spacing);
            let jittered = (site + shift).clamp(container.min, container.max);
            particles.push(jittered, self.velocity);
        }
        Ok(particles)
    }
}

/// Sites of the lattice in a box, beginning half a cell from its lower faces; lowest z first, then y, then x.
fn lattice(aabb: Aabb, cell: DVec3) -> Result<Vec<DVec3>, SeedError> {
    if aabb.is_empty() {
        return Ok(Vec::new());
    }
    // a box of whole spacings must not lose a layer to rounding
    let counts = (aabb.size() / cell + 1e-9).floor();
    let sites = counts.element_product();
    let affordable = sites <= MAX_SITES;
    if !affordable {
        return Err(SeedError::TooLarge { sites });
    }
    let [nx, ny, nz] = counts.to_array().map(|n| n as usize);
    let mut result = Vec::with_capacity(nx * ny * nz);
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                result.push(aabb.min + cell * (DVec3::new(i as f64, j as f64, k as f64) + 0.5));
            }
        }
    }
    Ok(result)
}

/// The sites where ω > 0, each with its ω.
fn keep_inside(field: &dyn Field, sites: Vec<DVec3>) -> Result<Vec<(f64, DVec3)>, SeedError> {
    let mut kept = Vec::new();
    for at in sites {
        let w = field.omega(at);
        if w.is_nan() {
            return Err(SeedError::Undefined { at });
        }
        if w > 0.0 {
            kept.push((w, at));
        }
    }
    Ok(kept)
}

/// The `count` lattice sites nearest to a centre, nearest first. Sites at equal distances stand in the order
/// z, y, x.
fn ball(centre: DVec3, spacing: f64, count: usize) -> Result<Vec<DVec3>, SeedError> {
    if !(count as f64 <= MAX_SITES && centre.is_finite()) {
        return Err(SeedError::TooLarge { sites: count as f64 });
    }
    // a ball of this radius holds at least `count` sites: one cell diagonal more than its volume needs
    let radius = (count as f64 * 0.75 / std::f64::consts::PI).cbrt() + 0.87;
    let n = radius.ceil() as i64;
    let mut sites = Vec::new();
    for z in -n..=n {
        for y in -n..=n {
            for x in -n..=n {
                let distance2 = x * x + y * y + z * z;
                if distance2 as f64 <= radius * radius {
                    sites.push((distance2, z, y, x));
                }
            }
        }
    }
    sites.sort_unstable();
    sites.truncate(count);
    let place =
        |(_, z, y, x): (i64, i64, i64, i64)| centre + spacing * DVec3::new(x as f64, y as f64, z as f64);
    Ok(sites.into_iter().map(place).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sph::scenes;

    fn no_two_coincide(particles: &Particles, spacing: f64) {
        let mut neighbours = 0;
        for i in 0..particles.len() {
            for j in 0..i {
                let d = particles.position.get(i).distance(particles.position.get(j));
                assert!(d > 0.0, "{i} and {j}");
                neighbours += usize::from(d < 1.01 * spacing);
            }
        }
        assert!(neighbours > 0);
    }

    #[test]
    fn a_drop_has_exactly_its_number_of_particles() {
        let parameters = Parameters::paper();
        for count in [1, 2, 7, 500] {
            let drop = FluidBlock::drop(DVec3::splat(1.5), count).seed(&parameters, scenes::BOX).unwrap();
            assert_eq!(drop.len(), count);
        }
        let drop = FluidBlock::drop(DVec3::splat(1.5), 500);
        let ball = drop.seed(&parameters, scenes::BOX).unwrap();
        let radius = ball.position.iter().map(|p| p.distance(DVec3::splat(1.5))).fold(0.0, f64::max);
        let expected = parameters.spacing() * (500.0 * 0.75 / std::f64::consts::PI).cbrt();
        assert!((radius / expected - 1.0).abs() < 0.1);
        no_two_coincide(&ball, parameters.spacing());
    }

    #[test]
    fn jitter_is_seeded_and_never_makes_particles_coincide() {
        let parameters = Parameters::paper();
        let block = FluidBlock { jitter: 0.99, seed: 7, ..FluidBlock::drop(DVec3::splat(1.5), 400) };
        let particles = block.seed(&parameters, scenes::BOX).unwrap();
        no_two_coincide(&particles, parameters.spacing());
        assert_eq!(block.seed(&parameters, scenes::BOX).unwrap(), particles);
        assert_ne!(FluidBlock { seed: 8, ..block }.seed(&parameters, scenes::BOX).unwrap(), particles);
        let error = FluidBlock { jitter: 1.0, ..block }.seed(&parameters, scenes::BOX).unwrap_err();
        assert_eq!(error, SeedError::Jitter(1.0));
    }

    #[test]
    fn a_box_is_filled_from_below_and_says_how_many_fit() {
        let parameters = Parameters::paper();
        let side = 10.0 * parameters.spacing();
        let shape = FluidShape::Box(Aabb::new(DVec3::ZERO, DVec3::splat(side)));
        let full = FluidBlock::filling(shape).seed(&parameters, scenes::BOX).unwrap();
        assert_eq!(full.len(), 1000);
        let part = FluidBlock { count: Some(100), ..FluidBlock::filling(shape) };
        let layer = part.seed(&parameters, scenes::BOX).unwrap();
        assert!(layer.position.z.iter().all(|&z| z < parameters.spacing()));
        let crowd = FluidBlock { count: Some(1001), ..part };
        let error = crowd.seed(&parameters, scenes::BOX).unwrap_err();
        assert_eq!(error, SeedError::DoesNotFit { wanted: 1001, room: 1000 });
        let fewer = FluidBlock { allow_fewer: true, ..crowd };
        assert_eq!(fewer.seed(&parameters, scenes::BOX).unwrap().len(), 1000);
    }

    #[test]
    fn a_field_bounds_its_fluid() {
        let parameters = Parameters::paper();
        let sphere = scenes::sphere(DVec3::splat(1.5), 0.2);
        let shape = FluidShape::Field { field: &*sphere, bounds: scenes::BOX, fill: Fill::Below };
        let fluid = FluidBlock::filling(shape).seed(&parameters, scenes::BOX).unwrap();
        let volume = fluid.len() as f64 * parameters.spacing().powi(3);
        assert!((volume / (4.0 / 3.0 * std::f64::consts::PI * 0.008) - 1.0).abs() < 0.02);
    }

    #[test]
    fn infinite_and_empty_shapes_are_errors_or_empty() {
        let parameters = Parameters::paper();
        let all = Aabb::new(DVec3::NEG_INFINITY, DVec3::INFINITY);
        let infinite = FluidBlock::filling(FluidShape::Box(all)).seed(&parameters, all);
        assert!(matches!(infinite, Err(SeedError::TooLarge { .. })));
        let elsewhere = FluidShape::Box(Aabb::new(DVec3::splat(5.0), DVec3::splat(6.0)));
        assert!(FluidBlock::filling(elsewhere).seed(&parameters, scenes::BOX).unwrap().is_empty());
        let count = FluidBlock { count: None, ..FluidBlock::drop(DVec3::ONE, 1) };
        assert_eq!(count.seed(&parameters, scenes::BOX).unwrap_err(), SeedError::NoCount);
    }
}
