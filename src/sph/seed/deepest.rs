//! The sites of a lattice that fill a shape with a number of particles, each as large as a cell.
//!
//! A shape seldom has as many sites as its volume has cells. The deepest sites are taken, so some just
//! outside the surface stay, or some just inside it are left out. (If cells were made smaller until enough
//! sites lay inside, a cylinder of five spacings would hold 10 % more than its room.)

use glam::DVec3;

use super::error::SeedError;
use crate::field::Field;

/// Parts of the spacing inside and outside of the surface between which sites may be left out or stay.
const MARGIN: f64 = 0.3;

/// Depths that differ by less than this part of the spacing count as equal.
const SAME_DEPTH: f64 = 1e-6;

/// The sites, m, that lie deepest in a field, in their order. Their number may differ from that wanted where
/// the lattice has no others near the surface.
pub(super) fn deepest(
    field: &dyn Field,
    sites: Vec<DVec3>,
    spacing: f64,
    number: usize,
) -> Result<Vec<DVec3>, SeedError> {
    let margin = MARGIN * spacing;
    let mut near: Vec<(f64, usize)> = Vec::new();
    let mut stays = vec![false; sites.len()];
    let mut inner = 0;
    for (i, &at) in sites.iter().enumerate() {
        let depth = depth(field, at)?;
        if depth > margin {
            stays[i] = true;
            inner += 1;
        } else if depth > -margin {
            near.push((depth, i));
        }
    }
    near.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let more = number.saturating_sub(inner).min(near.len());
    // the shell of equal depths that holds the last one wanted
    let same = SAME_DEPTH * spacing;
    let (first, end) = match more.checked_sub(1).map(|last| near[last].0) {
        Some(last) => (
            near.partition_point(|&(depth, _)| depth > last + same),
            near.partition_point(|&(depth, _)| depth >= last - same),
        ),
        None => (0, 0),
    };
    let (shell, some) = (end - first, more - first);
    let evenly = (0..shell).filter(|k| (k + 1) * some / shell > k * some / shell).map(|k| first + k);
    for k in (0..first).chain(evenly) {
        stays[near[k].1] = true;
    }
    Ok(sites.into_iter().zip(stays).filter_map(|(at, stays)| stays.then_some(at)).collect())
}

/// The depth of a point below the surface of a field, m, to first order; negative outside.
fn depth(field: &dyn Field, at: DVec3) -> Result<f64, SeedError> {
    let (w, gradient) = field.omega_grad(at);
    if w.is_nan() {
        return Err(SeedError::Undefined { at });
    }
    let depth = w / gradient.length();
    // without a slope only the sign is known of the depth
    Ok(if depth.is_nan() { if w > 0.0 { f64::INFINITY } else { f64::NEG_INFINITY } } else { depth })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Closures;

    /// A cylinder of any radius and height gets as many sites as its volume has cells.
    #[test]
    fn a_number_of_cells_fills_a_cylinder() {
        for (radius, height) in [(5.35, 22.3), (4.8, 7.9), (6.2, 10.5)] {
            // ω is no distance
            let cylinder = Closures {
                omega: |p: DVec3| {
                    let side = radius * radius - p.x * p.x - p.y * p.y;
                    side.min(20.0 * (0.5 * height - p.z.abs()))
                },
                gradient: |p: DVec3| {
                    let side = radius * radius - p.x * p.x - p.y * p.y;
                    if side < 20.0 * (0.5 * height - p.z.abs()) {
                        DVec3::new(-2.0 * p.x, -2.0 * p.y, 0.0)
                    } else {
                        DVec3::new(0.0, 0.0, -20.0 * p.z.signum())
                    }
                },
            };
            let steps = |n: i32| (-n..=n).map(|i| f64::from(i) + 0.5);
            let sites = steps(13)
                .flat_map(|z| steps(8).flat_map(move |y| steps(8).map(move |x| DVec3::new(x, y, z))))
                .collect::<Vec<_>>();
            let inside = sites.iter().filter(|&&at| cylinder.omega(at) > 0.0).count();
            let number = (std::f64::consts::PI * radius * radius * height).round() as usize;
            let found = deepest(&cylinder, sites, 1.0, number).unwrap();
            println!("{radius} {height}: {inside} sites inside, {number} wanted, {} found", found.len());
            assert_eq!(found.len(), number);
            let farthest = found.iter().map(|p| p.truncate().length() - radius).fold(0.0, f64::max);
            // depths are right to first order
            assert!(farthest < 1.1 * MARGIN, "{farthest}");
        }
    }

    /// If not all sites of a layer at one depth are wanted, those that stay are spread evenly.
    #[test]
    fn a_layer_is_parted() {
        let sheet = Closures {
            omega: |p: DVec3| 0.1 - p.z.abs(),
            gradient: |p: DVec3| DVec3::new(0.0, 0.0, -p.z.signum()),
        };
        let sites: Vec<DVec3> =
            (0..100).map(|i| DVec3::new(f64::from(i % 10), f64::from(i / 10), 0.0)).collect();
        let found = deepest(&sheet, sites, 1.0, 20).unwrap();
        assert_eq!(found.len(), 20);
        assert!(
            (0..10).all(|row| found.iter().filter(|at| at.y == f64::from(row)).count() == 2),
            "{found:?}"
        );
    }
}
