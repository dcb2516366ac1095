//! What obstacles leave of a fluid at its start: particles inside are taken away, those beside a surface keep
//! a distance.

use glam::DVec3;
use smallvec::SmallVec;

use crate::{
    field::{Face, Faces, standing_faces, surface_face},
    geom::Aabb,
};

use super::super::{particles::Particles, walls::Obstacle};
use super::error::{Carved, SeedError};

/// Distances from an obstacle that differ by less than this part of the spacing count as equal.
const SAME_DISTANCE: f64 = 1e-6;

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

/// Removes the particles of a lattice for which obstacles leave no room. Their number is the number of cells
/// in the obstacles' volume within the fluid's shape. Where obstacles cut cells, the sites farthest out stay;
/// at equal distances some stay, spread evenly. Sites up to a tenth of a spacing inside an obstacle may stay,
/// too. Particles nearer than `clearance`, m, move out to that distance, and those inside half as far. (If
/// all sites outside stayed and no other, a ball of five spacings would take 5 % more than its volume, and
/// the fluid around it would be 0.4 % too dense: more than a weakly compressible fluid is compressed by its
/// weight.)
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
    carved.too_close += move_out(&mut kept, domain, obstacles, clearance, spacing);
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

/// An obstacle's face near a point, inside or outside; `None` if there is none within `reach`, m. Where a face is not
/// known, a point outside lies at it, without a direction, and a point inside is infinitely deep.
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
    let outside = w < 0.0;
    let unknown = Face {
        distance: if outside { f64::MIN_POSITIVE } else { f64::NEG_INFINITY },
        normal: DVec3::ZERO,
        mean_curvature: 0.0,
    };
    Ok(match surface_face(&faces) {
        None => (!outside).then_some(unknown),
        Some(face) if !(face.distance.is_finite() && face.normal.is_finite()) => Some(unknown),
        // ω knows the side for sure, a face far from its edges the distance
        Some(face) if outside => Some(Face { distance: face.distance.max(f64::MIN_POSITIVE), ..face }),
        Some(face) => Some(Face { distance: face.distance.min(0.0), ..face }),
    })
}

/// Moves particles that are nearer to an obstacle than `clearance`, m, to that distance, and returns how many
/// are removed because they have no room between two walls. A lattice that a surface cuts keeps its volume
/// this way; if the others were removed, too, a gap would remain along the wall.
pub fn make_room(particles: &mut Particles, domain: &Aabb, obstacles: &[Obstacle], clearance: f64) -> usize {
    move_out(particles, domain, obstacles, clearance, 0.0)
}

/// [`make_room`] for particles that are no more than `depth`, m, inside obstacles, too.
fn move_out(
    particles: &mut Particles,
    domain: &Aabb,
    obstacles: &[Obstacle],
    clearance: f64,
    depth: f64,
) -> usize {
    let mut kept = Particles::default();
    for i in 0..particles.len() {
        let start = particles.position.get(i);
        let mut p = start;
        for obstacle in obstacles {
            // a place without a value is reported when particles are carved
            let Ok(Some(face)) = surface(obstacle, p, clearance.max(depth)) else { continue };
            // from inside a particle comes to half of the clearance, because another is farther out
            let wanted = if face.distance > 0.0 { clearance } else { 0.5 * clearance };
            if face.distance < wanted && face.distance >= -depth {
                p += (wanted - face.distance) * face.normal;
            }
        }
        // a particle that an obstacle would move out of the box stays, unless the two leave it no room
        let at = if domain.contains(p) { p } else { start };
        let slot = if p == start { None } else { slot(at, domain, obstacles, 2.0 * clearance) };
        match slot {
            None => kept.push(at, particles.velocity.get(i)),
            Some(slot) if slot.width < LEAST_SLOT * 2.0 * clearance => {}
            Some(slot) => kept.push(at + slot.to_middle, particles.velocity.get(i)),
        }
    }
    let removed = particles.len() - kept.len();
    *particles = kept;
    removed
}

/// Least room, as a part of a spacing, that two walls facing each other leave a particle. In a narrower slot
/// most of the kernel's support is wall, and the pressure of the fluid beside it would throw the particle
/// out.
const LEAST_SLOT: f64 = 0.75;

/// The room between two walls that face each other.
struct Slot {
    /// The distance between the walls, m.
    width: f64,
    /// The way from a point to the middle, m.
    to_middle: DVec3,
}

/// The narrowest slot around a point between two faces of obstacles or of the box, if it is narrower than `most`, m.
fn slot(p: DVec3, domain: &Aabb, obstacles: &[Obstacle], most: f64) -> Option<Slot> {
    let mut walls: SmallVec<[Face; 16]> = SmallVec::new();
    for axis in 0..3 {
        let mut normal = DVec3::ZERO;
        normal[axis] = 1.0;
        let low = Face { distance: p[axis] - domain.min[axis], normal, mean_curvature: 0.0 };
        let high = Face { distance: domain.max[axis] - p[axis], normal: -normal, mean_curvature: 0.0 };
        walls.extend([low, high]);
    }
    let mut faces = Faces::new();
    for obstacle in obstacles {
        faces.clear();
        obstacle.field.faces(p, most, &mut faces);
        walls.extend(standing_faces(&faces));
    }
    let near: SmallVec<[Face; 16]> =
        walls.into_iter().filter(|wall| (0.0..most).contains(&wall.distance)).collect();
    let mut narrowest: Option<Slot> = None;
    for (k, a) in near.iter().enumerate() {
        for b in &near[k + 1..] {
            let width = a.distance + b.distance;
            let is_narrower = width < narrowest.as_ref().map_or(most, |slot| slot.width);
            if is_narrower && a.normal.dot(b.normal) < OPPOSITE {
                narrowest = Some(Slot { width, to_middle: 0.5 * (b.distance - a.distance) * a.normal });
            }
        }
    }
    narrowest
}

/// Two walls face each other if the cosine between their normals is at most this.
const OPPOSITE: f64 = -0.5;

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::field::Closures;
    use crate::sph::{
        params::Parameters,
        scenes,
        seed::{FluidBlock, FluidShape},
    };

    #[test]
    fn beside_walls_so_many_stay_as_the_volume_has_cells() {
        let ball = Closures { omega: |p: DVec3| 0.25 - p.length_squared(), gradient: |p: DVec3| -2.0 * p };
        let obstacle = Obstacle::at_rest(Arc::new(ball), 0.01);
        let domain = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
        let volume = 8.0 - std::f64::consts::PI / 6.0;
        for layers in [10.0, 13.0, 20.0] {
            let spacing = 2.0 / layers;
            let parameters = Parameters::paper();
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
            let mut particles = lattice.seed(&Parameters::paper(), domain).unwrap();
            let cells = (8.0 * f64::powi(side / spacing, 3)).round() as usize;
            carve_cells(&mut particles, &domain, &[obstacle], (spacing, 0.5 * spacing), cells).unwrap();
            assert!(closest(&particles) > 0.5 * spacing, "{side}: {}", closest(&particles) / spacing);
        }
    }

    /// A particle between a floor and a slab above it: in a narrow slot there is none, in a wider one it lies
    /// in the middle.
    #[test]
    fn narrow_slots_hold_no_particle() {
        let spacing = 0.1;
        let domain = Aabb::new(DVec3::ZERO, DVec3::ONE);
        for (height, is_free) in [(0.055, false), (0.07, false), (0.08, true), (0.095, true)] {
            let slab = Closures {
                omega: move |p: DVec3| (p.z - height).min(height + 0.3 - p.z),
                gradient: move |p: DVec3| if p.z < height + 0.15 { DVec3::Z } else { -DVec3::Z },
            };
            let obstacle = Obstacle::at_rest(Arc::new(slab), 0.01);
            let lattice = FluidBlock {
                cell: Some(DVec3::splat(spacing)),
                ..FluidBlock::filling(FluidShape::Box(domain))
            };
            let mut particles = lattice.seed(&Parameters::paper(), domain).unwrap();
            carve_cells(&mut particles, &domain, &[obstacle], (spacing, 0.5 * spacing), 300).unwrap();
            let below: Vec<f64> = particles.position.iter().map(|p| p.z).filter(|z| *z < height).collect();
            assert_eq!(!below.is_empty(), is_free, "{height}: {below:?}");
            assert!(below.iter().all(|z| (z - 0.5 * height).abs() < 1e-12), "{height}: {below:?}");
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
