//! Findings about a mesh: its topology, its size, and how far its vertices are from the field's surface.
//!
//! Invariant: nothing here relies on how the mesh was made; any mesh over any field can be checked.

use glam::DVec3;
use rayon::prelude::*;

use super::{
    Mesh,
    normals::{GradientColumns, unit},
    shells::{Roots, shells},
};
use crate::field::Field;
use crate::geom::{Aabb, directions};

/// The findings about a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The number of vertices.
    pub vertices: usize,
    /// The number of triangles.
    pub triangles: usize,
    /// True if triangles run along every edge equally often in both directions: the mesh has no border.
    pub closed: bool,
    /// True if every edge lies in exactly two triangles, which run along it in opposite directions, and the
    /// triangles around every vertex form one fan.
    pub manifold: bool,
    /// The number of connected parts of the mesh, with the walls of cavities.
    pub components: usize,
    /// The number of connected parts with a positive volume. Walls of cavities have a negative one.
    pub solids: usize,
    /// The signed volume of each part in m³, in the order of their first vertices.
    pub component_volumes: Vec<f64>,
    /// The box around each part, in the same order, m.
    pub component_bounds: Vec<Aabb>,
    /// The Euler characteristic: vertices that triangles use − edges + triangles.
    pub euler: i64,
    /// The number of triangles with two vertices at one point.
    pub degenerate: usize,
    /// The volume in m³, less that of cavities.
    pub volume: f64,
    /// The area in m².
    pub area: f64,
    /// The largest distance of a vertex from ω = 0 in metres, cap vertices left out. Infinite if it could not
    /// be found for some vertex.
    pub max_distance: f64,
    /// The root of the mean squared distance in metres, cap vertices left out.
    pub rms_distance: f64,
    /// The number of evaluations of ω that it took to make the mesh.
    pub evaluations: u64,
}

/// Examines a mesh of the surface of `field`. The field is used for distances only.
pub fn check(mesh: &Mesh, field: &dyn Field) -> Report {
    let shells = shells(mesh);
    let edges = EdgeFindings::of(mesh);
    let used: usize = shells.iter().map(|shell| shell.vertices).sum();
    let (max_distance, rms_distance) = distances(mesh, field);
    let coincide = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        a == b || b == c || c == a
    };
    Report {
        vertices: mesh.positions.len(),
        triangles: mesh.triangles.len(),
        closed: edges.closed,
        manifold: edges.two_sided && edges.fans == used,
        components: shells.len(),
        solids: shells.iter().filter(|shell| shell.is_solid()).count(),
        component_volumes: shells.iter().map(|shell| shell.volume).collect(),
        component_bounds: shells.iter().map(|shell| shell.bounds).collect(),
        euler: used as i64 - edges.count as i64 + mesh.triangles.len() as i64,
        degenerate: mesh.triangles.iter().filter(|t| coincide(t)).count(),
        volume: shells.iter().fold(0.0, |sum, shell| sum + shell.volume), // `sum` of an empty iterator is −0
        area: shells.iter().fold(0.0, |sum, shell| sum + shell.area),
        max_distance,
        rms_distance,
        evaluations: mesh.work.evaluations,
    }
}

/// Whether a mesh is closed and manifold, as [`Report`] defines it.
pub fn is_closed_manifold(mesh: &Mesh) -> bool {
    let edges = EdgeFindings::of(mesh);
    let used: usize = shells(mesh).iter().map(|shell| shell.vertices).sum();
    edges.closed && edges.two_sided && edges.fans == used
}

/// Findings about a mesh's edges.
struct EdgeFindings {
    count: usize,
    closed: bool,
    two_sided: bool,
    /// The number of fans of triangles around vertices, joined across edges. A manifold has one for each
    /// vertex.
    fans: usize,
}

/// A side of a triangle: its ends in ascending order, whether the triangle runs up along it, and the corners
/// (3·triangle + place) of the triangle at the lower and at the higher end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct TriangleSide {
    ends: (u32, u32),
    runs_up: bool,
    corners: [u32; 2],
}

impl EdgeFindings {
    fn of(mesh: &Mesh) -> Self {
        let side = |triangle: usize, place: usize| {
            let (from, to) = (mesh.triangles[triangle][place], mesh.triangles[triangle][(place + 1) % 3]);
            let corners = [place, (place + 1) % 3].map(|p| (3 * triangle + p) as u32);
            let runs_up = from < to;
            let (ends, corners) =
                if runs_up { ((from, to), corners) } else { ((to, from), [corners[1], corners[0]]) };
            TriangleSide { ends, runs_up, corners }
        };
        let mut sides: Vec<TriangleSide> =
            (0..mesh.triangles.len()).flat_map(|t| (0..3).map(move |place| side(t, place))).collect();
        sides.par_sort_unstable();

        let mut corners = Roots::new(sides.len());
        let mut found = Self { count: 0, closed: true, two_sided: true, fans: 0 };
        for edge in sides.chunk_by(|a, b| a.ends == b.ends) {
            let up = edge.iter().filter(|side| side.runs_up).count();
            found.count += 1;
            found.closed &= 2 * up == edge.len();
            found.two_sided &= edge.len() == 2 && up == 1;
            for other in &edge[1..] {
                corners.unite(edge[0].corners[0], other.corners[0]);
                corners.unite(edge[0].corners[1], other.corners[1]);
            }
        }
        found.fans = (0..sides.len() as u32).filter(|&c| corners.find(c) == c).count();
        found
    }
}

/// Vertices projected together.
const BATCH: usize = 1024;

/// The largest and the root-mean-square distance of the vertices, caps left out.
fn distances(mesh: &Mesh, field: &dyn Field) -> (f64, f64) {
    let mut is_cap = vec![false; mesh.positions.len()];
    mesh.caps.iter().for_each(|&v| is_cap[v as usize] = true);
    let on_surface: Vec<DVec3> =
        mesh.positions.iter().zip(&is_cap).filter(|(_, cap)| !**cap).map(|(p, _)| *p).collect();
    let largest = on_surface.iter().fold(0.0, |most, p| f64::max(most, p.abs().max_element()));
    let edges =
        mesh.triangles.iter().map(|t| mesh.positions[t[0] as usize].distance(mesh.positions[t[1] as usize]));
    let edge = edges.sum::<f64>() / mesh.triangles.len().max(1) as f64;
    let parts: Vec<(f64, f64)> = on_surface
        .par_chunks(BATCH)
        .map(|part| {
            let distances = project(field, part, (largest, edge));
            distances.iter().fold((0.0, 0.0), |(max, sum), d| (f64::max(max, *d), sum + d * d))
        })
        .collect();
    let (max, sum) = parts.iter().fold((0.0, 0.0), |(max, sum), part| (f64::max(max, part.0), sum + part.1));
    (max, (sum / on_surface.len().max(1) as f64).sqrt())
}

/// Maximum number of Newton steps. Two are enough where ω is smooth; a double root gains one bit with each.
const NEWTON_STEPS: usize = 8;

/// The distance of each point from ω = 0: the way that Newton's method along ∇ω takes to the surface. The
/// distance within which ω changes sign is taken if it is shorter, or if Newton's method does not converge.
/// `largest` is the largest coordinate of all points: a tip at the origin is no more exact than the rest. `edge` is the
/// mean length of the mesh's edges.
fn project(field: &dyn Field, points: &[DVec3], (largest, edge): (f64, f64)) -> Vec<f64> {
    let mut at = points.to_vec();
    let mut directions = vec![DVec3::ZERO; points.len()];
    let mut gradients = GradientColumns::default();
    for step in 0..NEWTON_STEPS {
        let mut moved = false;
        let found: Vec<(f64, DVec3)> = gradients.at(field, &at).collect();
        for (i, (omega, gradient)) in found.into_iter().enumerate() {
            let direction = unit(gradient).unwrap_or(DVec3::ZERO);
            if step == 0 {
                directions[i] = direction;
            }
            let next = at[i] - direction * (omega / gradient.length());
            if omega != 0.0 && next.is_finite() && next != at[i] {
                moved = true;
                at[i] = next;
            }
        }
        if !moved {
            break;
        }
    }
    let residuals: Vec<(f64, DVec3)> = gradients.at(field, &at).collect();
    (0..points.len())
        .map(|i| {
            let way = at[i].distance(points[i]);
            let left = residuals[i].0.abs() / residuals[i].1.length();
            let rounding = f64::EPSILON * largest;
            let converged = residuals[i].0 == 0.0 || left <= 1e-3 * way || left <= rounding;
            if converged && way <= 1e3 * rounding {
                return way;
            }
            let newton = if converged { way } else { f64::INFINITY };
            newton.min(sign_change_distance(field, points[i], directions[i], (rounding, edge)))
        })
        .collect()
}

/// Radii are doubled this many times at once until ω changes sign, and then one by one from the last radius
/// without a change.
const STRIDE: usize = 5;

/// Doublings from the rounding of coordinates to a quarter of their size.
const DOUBLINGS: usize = 50;

/// Directions in which to look for a surface that should be farther away than an edge, starting two edges
/// inwards.
const DIRECTIONS: usize = 200;
const FINE_RADII: i32 = 8;

/// A radius at which ω has another sign on the axes or on the gradient's line through a point than at it: an upper
/// bound for the distance, also of flat and kinked fields, and mostly the least one up to a factor of two. A vertex
/// that would then be farther off than an edge lies near a surface that those lines miss, and many others are tried.
/// It is infinite without a change of sign within the size of the coordinates, whose rounding is the least radius tried.
fn sign_change_distance(field: &dyn Field, p: DVec3, direction: DVec3, (rounding, edge): (f64, f64)) -> f64 {
    let ways = [direction, DVec3::X, DVec3::Y, DVec3::Z];
    // where small parts lie apart, all around the point may be outside at one radius, and inside others at a larger one
    let inside = field.omega(p) > 0.0;
    let changes = |doublings: usize| {
        let radius = rounding * f64::exp2(doublings as f64);
        let mut around = ways.into_iter().flat_map(|way| [p + radius * way, p - radius * way]);
        around.any(|q| (field.omega(q) > 0.0) != inside).then_some(radius)
    };
    let coarse = (0..=DOUBLINGS).step_by(STRIDE).find_map(|count| Some((count, changes(count)?)));
    let radius = coarse.map_or(f64::INFINITY, |(count, radius)| {
        let finer = (count + 1).saturating_sub(STRIDE)..count;
        finer.into_iter().find_map(changes).unwrap_or(radius)
    });
    if radius <= edge {
        return radius;
    }
    let differs =
        |radius: f64| directions(DIRECTIONS).any(|way| (field.omega(p + radius * way) > 0.0) != inside);
    let finest = (0..FINE_RADII).map(|halvings| edge * f64::exp2(f64::from(1 - halvings)));
    finest.filter(|&radius| differs(radius)).fold(radius, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Closures;

    /// Corners of the tetrahedron under the plane x + y + z = 1, facing outwards, and its copy at `offset`.
    fn tetrahedron(offset: DVec3) -> Mesh {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        Mesh {
            positions: corners.map(|p| p + offset).to_vec(),
            normals: vec![DVec3::Z; 4],
            triangles: vec![[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]],
            ..Mesh::default()
        }
    }

    fn report(mesh: &Mesh) -> Report {
        check(mesh, &Closures { omega: |p: DVec3| p.x, gradient: |_| DVec3::X })
    }

    /// A vertex near the centre of a small ball, far from another one, on a mesh with short edges: at all radii that are
    /// tried first, the places around it are inside, or outside.
    #[test]
    fn the_surface_around_a_vertex_is_not_missed() {
        let ball = |p: DVec3| 0.03 * 0.03 - p.length_squared();
        let field = Closures {
            omega: |p: DVec3| ball(p).max(ball(p - DVec3::X)),
            gradient: |p: DVec3| -2.0 * if ball(p) > ball(p - DVec3::X) { p } else { p - DVec3::X },
        };
        let p = DVec3::new(0.001, 0.0005, 0.0);
        let found = sign_change_distance(&field, p, DVec3::X, (f64::EPSILON, 0.001));
        // the upper bound is mostly right up to a factor of two
        let truth = 0.03 - p.length();
        assert!((truth..2.0 * truth).contains(&found), "{found}");
    }

    #[test]
    fn tetrahedron_far_from_the_origin_keeps_its_volume() {
        let found = report(&tetrahedron(DVec3::splat(1e6)));
        assert!(found.closed && found.manifold);
        assert_eq!((found.euler, found.components, found.solids), (2, 1, 1));
        // coordinates near 1e6 are rounded to 1e-10
        assert!((found.volume - 1.0 / 6.0).abs() < 1e-9, "{}", found.volume);
        assert!((found.area - (1.5 + 0.75_f64.sqrt())).abs() < 1e-9, "{}", found.area);
    }

    #[test]
    fn missing_and_flipped_triangles_are_noticed() {
        let mut open = tetrahedron(DVec3::ZERO);
        open.triangles.pop();
        assert!(!report(&open).closed && !report(&open).manifold);
        let mut flipped = tetrahedron(DVec3::ZERO);
        flipped.triangles[0].swap(0, 1);
        assert!(!report(&flipped).closed && !report(&flipped).manifold);
        let mut inside_out = tetrahedron(DVec3::ZERO);
        inside_out.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert!(report(&inside_out).closed && report(&inside_out).manifold);
        assert_eq!(report(&inside_out).solids, 0);
    }

    #[test]
    fn edges_of_four_triangles_and_pinched_vertices_are_not_manifold() {
        // a second tetrahedron shares vertex 0, or the edge 0–1, with the first
        for (shared, translate) in [(1, [0, 4, 5, 6]), (2, [0, 1, 4, 5])] {
            let mut mesh = tetrahedron(DVec3::ZERO);
            mesh.positions.extend((shared..4).map(|i| DVec3::splat(-(i as f64))));
            let copy: Vec<[u32; 3]> =
                mesh.triangles.iter().map(|t| t.map(|v| translate[v as usize])).collect();
            mesh.triangles.extend(copy);
            let found = report(&mesh);
            assert!(found.closed && !found.manifold, "{found:?}");
            assert_eq!(found.components, 1);
        }
    }

    #[test]
    fn distance_is_true_where_the_field_is_neither_normalised_nor_smooth() {
        let wall_at_one = |omega: fn(f64) -> f64, slope: fn(f64) -> f64| {
            let field = Closures {
                omega: move |p: DVec3| omega(p.x - 1.0),
                gradient: move |p: DVec3| slope(p.x - 1.0) * DVec3::X,
            };
            project(&field, &[DVec3::new(1.001, 5.0, 7.0)], (7.0, 1.0))[0]
        };
        let plain = wall_at_one(|s| 50.0 * s, |_| 50.0);
        assert!((plain - 1e-3).abs() < 1e-12, "{plain}");
        // triple root: Newton's steps shrink by a third, and the change of sign is found within a factor
        // of two
        let flat = wall_at_one(|s| s.powi(3), |s| 3.0 * s * s);
        assert!((1e-3..=2e-3).contains(&flat) || (flat - 1e-3).abs() < 1e-4, "{flat}");
        let kinked = wall_at_one(|s| s.min(100.0 * s), |s| if s > 0.0 { 1.0 } else { 100.0 });
        assert!((kinked - 1e-3).abs() < 1e-12, "{kinked}");
        assert_eq!(wall_at_one(|_| 1.0, |_| 0.0), f64::INFINITY);
        // the tip of a cone at the origin, where the gradient vanishes and all coordinates are zero
        let cone = Closures {
            omega: |p: DVec3| p.z * p.z - p.x * p.x - p.y * p.y,
            gradient: |p: DVec3| 2.0 * DVec3::new(-p.x, -p.y, p.z),
        };
        let tip = project(&cone, &[DVec3::ZERO], (1.0, 1.0))[0];
        assert!(tip < 1e-15, "{tip}");
        // a ball beside the lines through the vertex, with a wall far behind it
        let centre = DVec3::new(0.03, 0.02, 0.01);
        let ball = Closures {
            omega: |p: DVec3| f64::max(0.01 - p.distance(centre), p.x - 0.9),
            gradient: |p: DVec3| if p.x < 0.5 { DVec3::Z } else { DVec3::X },
        };
        let beside = project(&ball, &[DVec3::ZERO], (1.0, 0.04))[0];
        let truth = centre.length() - 0.01;
        assert!((truth..2.0 * truth).contains(&beside), "{beside}");
    }
}
