//! Where a fluid starts: particles on a lattice with the rest spacing, inside a shape, the box and outside
//! obstacles.
//!
//! Invariant: no two particles coincide for any jitter, because each stays within its own lattice cell. The
//! same input gives the same particles.

use std::{error, fmt};

use glam::DVec3;
use rand_pcg::{
    Pcg64,
    rand_core::{Rng, SeedableRng},
};

use crate::{
    field::{Face, Faces, Field, nearest},
    geom::Aabb,
};

use super::{params::Parameters, particles::Particles, walls::Obstacle};

/// More lattice sites than this are a mistake in the scene, not a fluid.
pub const MAX_SITES: f64 = 5e7;

/// Distances from an obstacle that differ by less than this part of the spacing count as equal.
const SAME_DISTANCE: f64 = 1e-6;

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
    /// A ball around a centre, as large as the number of particles makes it.
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

/// Why a fluid cannot be placed.
#[derive(Debug, Clone, PartialEq)]
pub enum SeedError {
    /// The shape, cut with the container, has room for fewer particles than wanted.
    DoesNotFit {
        /// Number of particles wanted.
        wanted: usize,
        /// Number of particles that fit.
        room: usize,
    },
    /// A drop has no number of particles.
    NoCount,
    /// The jitter is not in 0..1.
    Jitter(f64),
    /// The shape is infinite, or would hold more particles than a machine does.
    TooLarge {
        /// Number of lattice sites; infinite for an infinite shape.
        sites: f64,
    },
    /// The shape or an obstacle has no value at a lattice site.
    Undefined {
        /// The site, m.
        at: DVec3,
    },
    /// Carving left no particle.
    NothingLeft(Carved),
}

impl fmt::Display for SeedError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::DoesNotFit { wanted, room } => {
                write!(f, "{wanted} particles do not fit: the shape in its container has room for {room}")
            }
            Self::NoCount => write!(f, "a drop needs a number of particles"),
            Self::Jitter(found) => write!(f, "jitter is {found}, expected a number from 0 to below 1"),
            Self::TooLarge { sites } => write!(f, "the shape would hold {sites:.1e} particles"),
            Self::Undefined { at } => write!(f, "the formula of a shape has no value at {at}"),
            Self::NothingLeft(carved) => write!(
                f,
                "no particle is left: {} lay in obstacles, {} too close to them, {} outside the box",
                carved.inside, carved.too_close, carved.outside_box
            ),
        }
    }
}

impl error::Error for SeedError {}

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

/// How many particles carving removed, by reason, and how many it kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Carved {
    /// Removed: in an obstacle or on its surface (ω ≥ 0).
    pub inside: usize,
    /// Removed: in the fluid, but nearer to an obstacle than the clearance.
    pub too_close: usize,
    /// Removed: outside the box.
    pub outside_box: usize,
    /// Particles that are left.
    pub kept: usize,
}

/// Removes particles that lie outside the box, in an obstacle, or nearer to one than `clearance`, m. The
/// distance is that of the nearest face, unless a ball of that radius is proven to be free. The remaining
/// particles get new ids from 0 on.
///
/// # Errors
/// [`SeedError::NothingLeft`] if no particle is left, [`SeedError::Undefined`] where an obstacle has no
/// value.
pub fn carve(
    particles: &mut Particles,
    domain: &Aabb,
    obstacles: &[Obstacle],
    clearance: f64,
) -> Result<Carved, SeedError> {
    let mut carved = Carved::default();
    let mut kept = Particles::default();
    'particles: for i in 0..particles.len() {
        let p = particles.position.get(i);
        if !domain.contains(p) {
            carved.outside_box += 1;
            continue;
        }
        for obstacle in obstacles {
            let w = obstacle.field.omega(p);
            if w.is_nan() {
                return Err(SeedError::Undefined { at: p });
            }
            if w >= 0.0 {
                carved.inside += 1;
                continue 'particles;
            }
            if surface(obstacle, p, clearance)?.is_some_and(|face| face.distance < clearance) {
                carved.too_close += 1;
                continue 'particles;
            }
        }
        kept.push(p, particles.velocity.get(i));
    }
    carved.kept = kept.len();
    *particles = kept;
    if carved.kept == 0 { Err(SeedError::NothingLeft(carved)) } else { Ok(carved) }
}

/// Takes those particles of a lattice that obstacles leave no room for: as many as the obstacles' volume in the fluid's shape
/// has cells. Where obstacles cut cells, those sites stay that are farthest out; at equal distances some stay, evenly. At
/// most a tenth of a spacing inside an obstacle they may stay, too. Particles nearer than `clearance`, m, move out to there,
/// those inside half as far. (If all sites outside stayed and no other, a ball of five spacings
/// would take 5 % more than its volume, and the fluid around it would be 0.4 % too dense: more than a weakly compressible
/// fluid is compressed by its weight.)
///
/// # Errors
/// [`SeedError::NothingLeft`] if no particle is left, [`SeedError::Undefined`] where an obstacle has no
/// value.
pub fn carve_cells(
    particles: &mut Particles,
    domain: &Aabb,
    obstacles: &[Obstacle],
    (spacing, clearance): (f64, f64),
    cells: usize,
) -> Result<Carved, SeedError> {
    let (within, deepest) = (0.75 * spacing, -0.1 * spacing);
    let mut carved = Carved::default();
    let mut near: Vec<(f64, usize)> = Vec::new();
    let mut leaves = vec![false; particles.len()];
    for (i, p) in particles.position.iter().enumerate() {
        if !domain.contains(p) {
            carved.outside_box += 1;
            leaves[i] = true;
            continue;
        }
        let distance = distance(obstacles, p, within)?;
        if distance < deepest {
            carved.inside += 1;
            leaves[i] = true;
        } else if distance < within {
            near.push((distance, i));
        }
    }
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let surplus = cells.saturating_sub(carved.inside).min(near.len());
    if let Some(&(last, _)) = surplus.checked_sub(1).and_then(|k| near.get(k)) {
        let same = SAME_DISTANCE * spacing;
        let first = near.partition_point(|&(distance, _)| distance < last - same);
        let end = near.partition_point(|&(distance, _)| distance <= last + same);
        let (shell, some) = (end - first, surplus - first);
        let chosen = (0..shell).filter(|k| (k + 1) * some / shell > k * some / shell).map(|k| first + k);
        for k in (0..first).chain(chosen) {
            let (distance, i) = near[k];
            leaves[i] = true;
            *(if distance <= 0.0 { &mut carved.inside } else { &mut carved.too_close }) += 1;
        }
    }
    let mut kept = Particles::default();
    for (i, _) in leaves.iter().enumerate().filter(|(_, leaves)| !**leaves) {
        kept.push(particles.position.get(i), particles.velocity.get(i));
    }
    move_out(&mut kept, domain, obstacles, clearance, spacing);
    *particles = kept;
    // beside edges and where obstacles meet, the estimate of a distance may be wrong
    let last = carve(particles, domain, obstacles, 0.4 * clearance)?;
    carved.inside += last.inside;
    carved.too_close += last.too_close;
    carved.outside_box += last.outside_box;
    carved.kept = last.kept;
    Ok(carved)
}

/// The distance, m, of a point from the nearest obstacle; negative inside, infinite if it is proven to be more than
/// `most`.
fn distance(obstacles: &[Obstacle], p: DVec3, most: f64) -> Result<f64, SeedError> {
    let mut least = f64::INFINITY;
    for obstacle in obstacles {
        least = surface(obstacle, p, most)?.map_or(least, |face| least.min(face.distance));
    }
    Ok(least)
}

/// An obstacle's face near a point, inside or outside; `None` if it is proven to be farther away than `reach`, m. A point
/// so deep inside that no face is known is infinitely deep.
fn surface(obstacle: &Obstacle, p: DVec3, reach: f64) -> Result<Option<Face>, SeedError> {
    if obstacle.field.clearance(p, reach) >= reach {
        return Ok(None);
    }
    let w = obstacle.field.omega(p);
    if w.is_nan() {
        return Err(SeedError::Undefined { at: p });
    }
    let mut faces = Faces::new();
    obstacle.field.faces(p, reach, &mut faces);
    // ω knows the side for sure, a face far from its edges the distance
    let on_its_side = |face: Face| Face {
        distance: if w < 0.0 { face.distance.max(0.0) } else { face.distance.min(0.0) },
        ..face
    };
    let is_known = |face: &Face| face.distance.is_finite() && face.normal.is_finite();
    if let Some(face) = nearest(&faces).filter(is_known) {
        return Ok(Some(on_its_side(face)));
    }
    let deep = Face { distance: f64::NEG_INFINITY, normal: DVec3::ZERO, mean_curvature: 0.0 };
    Ok((w >= 0.0).then_some(deep))
}

/// Moves particles that are nearer to an obstacle than `clearance`, m, to that distance. A lattice that a
/// surface cuts keeps its volume this way; if those particles were removed, a gap would remain along the
/// wall.
pub fn make_room(particles: &mut Particles, domain: &Aabb, obstacles: &[Obstacle], clearance: f64) {
    move_out(particles, domain, obstacles, clearance, 0.0);
}

/// [`make_room`] for particles that are no more than `depth`, m, inside obstacles, too.
fn move_out(particles: &mut Particles, domain: &Aabb, obstacles: &[Obstacle], clearance: f64, depth: f64) {
    for i in 0..particles.len() {
        let mut p = particles.position.get(i);
        for obstacle in obstacles {
            // a place without a value is told of when particles are carved
            let Ok(Some(face)) = surface(obstacle, p, clearance.max(depth)) else { continue };
            // from inside a particle comes to half of the clearance, because another is farther out
            let wanted = if face.distance > 0.0 { clearance } else { 0.5 * clearance };
            if face.distance < wanted && face.distance >= -depth {
                p += (wanted - face.distance) * face.normal;
            }
        }
        if domain.contains(p) {
            particles.position.set(i, p);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::field::Closures;
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
        let parameters = Parameters::default();
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
        let parameters = Parameters::default();
        let block = FluidBlock { jitter: 0.99, seed: 7, ..FluidBlock::drop(DVec3::splat(1.5), 400) };
        let particles = block.seed(&parameters, scenes::BOX).unwrap();
        no_two_coincide(&particles, parameters.spacing());
        assert_eq!(block.seed(&parameters, scenes::BOX).unwrap(), particles);
        assert_ne!(FluidBlock { seed: 8, ..block }.seed(&parameters, scenes::BOX).unwrap(), particles);
        let error = FluidBlock { jitter: 1.0, ..block }.seed(&parameters, scenes::BOX).unwrap_err();
        assert_eq!(error, SeedError::Jitter(1.0));
    }

    #[test]
    fn beside_walls_so_many_stay_as_the_volume_has_cells() {
        let ball = Closures { omega: |p: DVec3| 0.25 - p.length_squared(), gradient: |p: DVec3| -2.0 * p };
        let obstacle = Obstacle::at_rest(Arc::new(ball), 0.01);
        let domain = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
        let volume = 8.0 - std::f64::consts::PI / 6.0;
        for layers in [10.0, 13.0, 20.0] {
            let spacing = 2.0 / layers;
            let parameters = Parameters::default();
            let block = FluidBlock {
                cell: Some(DVec3::splat(spacing)),
                ..FluidBlock::filling(FluidShape::Box(domain))
            };
            let mut particles = block.seed(&parameters, domain).unwrap();
            let (all, wanted) = (particles.len(), (volume / spacing.powi(3)).round() as usize);
            let room = (spacing, 0.5 * spacing);
            let carved =
                carve_cells(&mut particles, &domain, std::slice::from_ref(&obstacle), room, all - wanted)
                    .unwrap();
            assert_eq!((particles.len(), carved.kept), (wanted, wanted));
            assert_eq!(carved.inside + carved.too_close, all - wanted);
            let nearest = particles.position.iter().map(|p| p.length() - 0.5).fold(f64::INFINITY, f64::min);
            // the step along the gradient falls short of a curved surface by a part of its square
            assert!(nearest > 0.2 * spacing, "{nearest} {spacing}");
            assert!(closest(&particles) > 0.5 * spacing, "{}", closest(&particles) / spacing);
        }
    }

    /// Flat walls have whole layers of sites at one depth. Wherever they cut the lattice, no two particles come close.
    #[test]
    fn beside_flat_walls_no_two_come_close() {
        for side in [0.28, 0.31, 0.36, 0.4, 0.44, 0.5] {
            let block = move |p: DVec3| side - p.abs().max_element();
            let outward = |p: DVec3| {
                let p = p.to_array();
                let axis = (0..3).max_by(|a, b| p[*a].abs().total_cmp(&p[*b].abs())).unwrap();
                let mut normal = DVec3::ZERO;
                normal[axis] = -p[axis].signum();
                normal
            };
            let obstacle = Obstacle::at_rest(Arc::new(Closures { omega: block, gradient: outward }), 0.01);
            let domain = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
            let spacing = 0.1;
            let lattice = FluidBlock {
                cell: Some(DVec3::splat(spacing)),
                ..FluidBlock::filling(FluidShape::Box(domain))
            };
            let mut particles = lattice.seed(&Parameters::default(), domain).unwrap();
            let cells = (8.0 * f64::powi(side / spacing, 3)).round() as usize;
            carve_cells(&mut particles, &domain, &[obstacle], (spacing, 0.5 * spacing), cells).unwrap();
            assert!(closest(&particles) > 0.5 * spacing, "{side}: {}", closest(&particles) / spacing);
        }
    }

    fn closest(particles: &Particles) -> f64 {
        let mut least = f64::INFINITY;
        for (i, p) in particles.position.iter().enumerate() {
            for q in particles.position.iter().take(i) {
                least = least.min(p.distance(q));
            }
        }
        least
    }

    #[test]
    fn a_box_is_filled_from_below_and_says_how_many_fit() {
        let parameters = Parameters::default();
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
        let parameters = Parameters::default();
        let sphere = scenes::sphere(DVec3::splat(1.5), 0.2);
        let shape = FluidShape::Field { field: &*sphere, bounds: scenes::BOX, fill: Fill::Below };
        let fluid = FluidBlock::filling(shape).seed(&parameters, scenes::BOX).unwrap();
        let volume = fluid.len() as f64 * parameters.spacing().powi(3);
        assert!((volume / (4.0 / 3.0 * std::f64::consts::PI * 0.008) - 1.0).abs() < 0.02);
    }

    #[test]
    fn infinite_and_empty_shapes_are_errors_or_empty() {
        let parameters = Parameters::default();
        let all = Aabb::new(DVec3::NEG_INFINITY, DVec3::INFINITY);
        let infinite = FluidBlock::filling(FluidShape::Box(all)).seed(&parameters, all);
        assert!(matches!(infinite, Err(SeedError::TooLarge { .. })));
        let elsewhere = FluidShape::Box(Aabb::new(DVec3::splat(5.0), DVec3::splat(6.0)));
        assert!(FluidBlock::filling(elsewhere).seed(&parameters, scenes::BOX).unwrap().is_empty());
        let count = FluidBlock { count: None, ..FluidBlock::drop(DVec3::ONE, 1) };
        assert_eq!(count.seed(&parameters, scenes::BOX).unwrap_err(), SeedError::NoCount);
    }

    #[test]
    fn carving_counts_what_it_removes() {
        let sphere = scenes::sphere(DVec3::ONE, 0.5);
        let obstacle = Obstacle::at_rest(sphere, 0.005);
        let mut particles = Particles::default();
        for x in [1.0, 1.5, 1.51, 1.7, 9.0] {
            particles.push(DVec3::new(x, 1.0, 1.0), DVec3::ZERO);
        }
        let carved = carve(&mut particles, &scenes::BOX, std::slice::from_ref(&obstacle), 0.05).unwrap();
        assert_eq!(carved, Carved { inside: 2, too_close: 1, outside_box: 1, kept: 1 });
        assert_eq!((particles.position.get(0).x, particles.id[0]), (1.7, 0));
        let nothing = carve(&mut particles, &scenes::BOX, &[obstacle], 0.5);
        assert!(matches!(nothing, Err(SeedError::NothingLeft(_))));
    }
}
