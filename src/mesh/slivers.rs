//! Takes slivers out of a mesh. Edges of thin triangles are contracted to one of their ends, so every vertex
//! stays on the surface, where the mesher put it.
//!
//! Where the surface passes close to a node of the grid, marching cubes put several vertices very close to
//! one another, and thin triangles between them and those further off.
//!
//! Invariant: each step meets the link condition (see `collapse`), so the mesh stays closed, manifold and of
//! the same topology. It turns no triangle by more than [`LARGEST_TURN`], and the worst triangle that it
//! touches becomes better.

use glam::DVec3;

use super::{
    Mesh,
    collapse::{Fans, compact},
};

/// Triangles less round than this are slivers. An equilateral triangle has 1, one without area has 0.
pub(super) const SLIVER: f64 = 0.1;

/// The cosine of the largest angle by which a triangle may turn. Slivers themselves may turn freely, because
/// they hardly have a direction.
const LARGEST_TURN: f64 = 0.7;

/// Maximum number of passes over the mesh. After the third few slivers give way.
const PASSES: usize = 4;

/// The roundness 4√3 · area / (sum of the squared sides): 1 for an equilateral triangle, 0 for one
/// without area.
pub(super) fn roundness([a, b, c]: [DVec3; 3]) -> f64 {
    let sides = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
    let twice_area = (b - a).cross(c - a).length();
    if sides > 0.0 { 2.0 * 3.0_f64.sqrt() * twice_area / sides } else { 0.0 }
}

/// Contracts edges of slivers where that keeps the mesh closed, manifold and in shape. Returns the number of
/// vertices that it removed.
pub fn remove_slivers(mesh: &mut Mesh) -> usize {
    let before = mesh.positions.len();
    for _ in 0..PASSES {
        let is_sliver = |t: &[u32; 3]| roundness(t.map(|v| mesh.positions[v as usize])) < SLIVER;
        let slivers: Vec<u32> =
            (0..mesh.triangles.len() as u32).filter(|&t| is_sliver(&mesh.triangles[t as usize])).collect();
        let vertices: Vec<u32> = slivers.iter().flat_map(|&t| mesh.triangles[t as usize]).collect();
        let mut fans = Fans::new(mesh, vertices.into_iter());
        let mut contracted = 0;
        for sliver in slivers {
            contracted += usize::from(!fans.is_dead[sliver as usize] && contract_one(&mut fans, sliver));
        }
        let Fans { is_lost, is_dead, .. } = fans;
        compact(mesh, &is_lost, &is_dead);
        if contracted == 0 {
            break;
        }
    }
    before - mesh.positions.len()
}

/// Contracts the shortest edge of a sliver that may be contracted, to the better of its ends. Returns whether
/// there was one.
fn contract_one(fans: &mut Fans<'_>, sliver: u32) -> bool {
    let corners = fans.mesh.triangles[sliver as usize];
    let position = |v: u32| fans.mesh.positions[v as usize];
    if roundness(corners.map(position)) >= SLIVER {
        return false; // an earlier step has mended it
    }
    let mut edges = [0, 1, 2].map(|i| (corners[i], corners[(i + 1) % 3]));
    let length = |&(a, b): &(u32, u32)| position(a).distance_squared(position(b));
    edges.sort_by(|a, b| length(a).total_cmp(&length(b)));
    for (a, b) in edges {
        let is_cap = |v| fans.mesh.caps.binary_search(&v).is_ok();
        if is_cap(a) != is_cap(b) || !fans.meets_link_condition(b, &fans.neighbours(a)) {
            continue;
        }
        let ways = [(a, b), (b, a)]
            .into_iter()
            .filter_map(|(kept, lost)| Some((gain(fans, kept, lost)?, kept, lost)));
        if let Some((_, kept, lost)) = ways.max_by(|x, y| x.0.total_cmp(&y.0)) {
            fans.contract(kept, lost);
            return true;
        }
    }
    false
}

/// The worst roundness around `lost` once it is drawn to `kept`. `None` if that is no better than before, or
/// if a triangle turns too far.
fn gain(fans: &Fans<'_>, kept: u32, lost: u32) -> Option<f64> {
    let (mut before, mut after) = (f64::INFINITY, f64::INFINITY);
    for t in fans.fan(lost) {
        let triangle = fans.mesh.triangles[t as usize];
        let old = triangle.map(|v| fans.mesh.positions[v as usize]);
        before = before.min(roundness(old));
        if triangle.contains(&kept) {
            continue; // vanishes
        }
        let new = triangle.map(|v| fans.mesh.positions[if v == lost { kept } else { v } as usize]);
        let area = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
        let (old_area, new_area) = (area(old), area(new));
        let least = if roundness(old) < SLIVER { 0.0 } else { LARGEST_TURN };
        if old_area.dot(new_area) < least * old_area.length() * new_area.length() {
            return None;
        }
        after = after.min(roundness(new));
    }
    (after > before).then_some(after)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{Closures, Field};
    use crate::geom::Aabb;
    use crate::mesh::Unwatched;
    use crate::mesh::{Grid, Resolution, check, marching_cubes};

    fn share_of_slivers(mesh: &Mesh) -> f64 {
        let thin =
            mesh.triangles.iter().filter(|t| roundness(t.map(|v| mesh.positions[v as usize])) < SLIVER);
        thin.count() as f64 / mesh.triangles.len() as f64
    }

    #[test]
    fn equilateral_triangles_have_quality_one() {
        let corners = [DVec3::X, DVec3::Y, DVec3::Z];
        assert!((roundness(corners) - 1.0).abs() < 1e-15);
        assert_eq!(roundness([DVec3::X, DVec3::Y, 0.5 * (DVec3::X + DVec3::Y)]), 0.0);
    }

    #[test]
    fn slivers_go_and_vertices_stay_on_the_surface() {
        let ball = Closures { omega: |p: DVec3| 0.8 - p.length_squared(), gradient: |p: DVec3| -2.0 * p };
        let torus = Closures {
            omega: |p: DVec3| 0.06 - (p.x.hypot(p.y) - 0.7).powi(2) - p.z * p.z,
            gradient: |p: DVec3| {
                let r = p.x.hypot(p.y);
                let radial = -2.0 * (r - 0.7) / r;
                DVec3::new(radial * p.x, radial * p.y, -2.0 * p.z)
            },
        };
        for field in [&ball as &dyn Field, &torus] {
            let bounds = Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0));
            let grid = Grid::around(&bounds, Resolution::Cells(64)).unwrap();
            let mut mesh = marching_cubes(field, &grid, &Unwatched).unwrap();
            let (share, before) = (share_of_slivers(&mesh), check(&mesh, field));
            let removed = remove_slivers(&mut mesh);
            let after = check(&mesh, field);
            println!(
                "slivers: {:.2} % before, {:.3} % after; {removed} of {} vertices; volume changed by {:.1e}",
                100.0 * share,
                100.0 * share_of_slivers(&mesh),
                before.vertices,
                after.volume / before.volume - 1.0
            );
            assert!(share > 0.02 && share_of_slivers(&mesh) < 0.005);
            assert!(after.closed && after.manifold && after.max_distance < 1e-12);
            assert_eq!((after.euler, after.components), (before.euler, before.components));
            assert!((after.volume / before.volume - 1.0).abs() < 2e-4);
        }
    }
}
