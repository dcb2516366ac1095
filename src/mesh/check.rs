//! What a mesh is worth: its topology, its size, and how far its vertices are from the field's surface.
//!
//! Invariant: nothing here relies on how the mesh was made; any mesh over any field can be checked.

use glam::DVec3;
use rayon::prelude::*;

use super::{
    Mesh,
    normals::{gradients, unit},
    shells::{Roots, shells},
};
use crate::field::Field;

/// The findings about a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    pub vertices: usize,
    pub triangles: usize,
    /// Every edge is run along equally often in both directions: the mesh has no border.
    pub closed: bool,
    /// Every edge lies in exactly two triangles, which run along it in opposite directions, and the triangles
    /// around every vertex form one fan.
    pub manifold: bool,
    /// Connected parts of the mesh, cavities included.
    pub components: usize,
    /// Connected solids: parts whose volume is positive. Walls of cavities are negative.
    pub solids: usize,
    /// Signed volume of each part, in the order of their first vertices, in cubic metres.
    pub component_volumes: Vec<f64>,
    /// Vertices − edges + triangles.
    pub euler: i64,
    /// Triangles of which two vertices coincide.
    pub degenerate: usize,
    /// Cubic metres.
    pub volume: f64,
    /// Square metres.
    pub area: f64,
    /// Largest distance of a vertex from ω = 0, cap vertices left out, in metres. Infinite where it cannot be
    /// told.
    pub max_distance: f64,
    /// Root of the mean squared distance.
    pub rms_distance: f64,
    /// Evaluations of ω that making the mesh took.
    pub evaluations: u64,
}

/// Examines a mesh of the surface of `field`.
pub fn check(mesh: &Mesh, field: &dyn Field) -> Report {
    let shells = shells(mesh);
    let edges = Edges::of(mesh);
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
        euler: used as i64 - edges.count as i64 + mesh.triangles.len() as i64,
        degenerate: mesh.triangles.iter().filter(|t| coincide(t)).count(),
        volume: shells.iter().map(|shell| shell.volume).sum(),
        area: shells.iter().map(|shell| shell.area).sum(),
        max_distance,
        rms_distance,
        evaluations: mesh.work.evaluations,
    }
}

/// Findings about a mesh's edges.
struct Edges {
    count: usize,
    closed: bool,
    two_sided: bool,
    /// Fans of triangles around vertices, joined across edges; as many as vertices on a manifold.
    fans: usize,
}

/// One triangle's side: its ends in ascending order, whether the triangle runs up along it, and its corner
/// (3·triangle + place) at the lower and at the higher end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    ends: (u32, u32),
    runs_up: bool,
    corners: [u32; 2],
}

impl Edges {
    fn of(mesh: &Mesh) -> Self {
        let side = |triangle: usize, place: usize| {
            let (from, to) = (mesh.triangles[triangle][place], mesh.triangles[triangle][(place + 1) % 3]);
            let corners = [place, (place + 1) % 3].map(|p| (3 * triangle + p) as u32);
            let runs_up = from < to;
            let (ends, corners) =
                if runs_up { ((from, to), corners) } else { ((to, from), [corners[1], corners[0]]) };
            Side { ends, runs_up, corners }
        };
        let mut sides: Vec<Side> =
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

/// Largest and root-mean-square distance of the vertices, caps left out.
fn distances(mesh: &Mesh, field: &dyn Field) -> (f64, f64) {
    let mut is_cap = vec![false; mesh.positions.len()];
    mesh.caps.iter().for_each(|&v| is_cap[v as usize] = true);
    let on_surface: Vec<DVec3> =
        mesh.positions.iter().zip(&is_cap).filter(|(_, cap)| !**cap).map(|(p, _)| *p).collect();
    let parts: Vec<(f64, f64)> = on_surface
        .par_chunks(BATCH)
        .map(|part| {
            let distances = project(field, part);
            distances.iter().fold((0.0, 0.0), |(max, sum), d| (f64::max(max, *d), sum + d * d))
        })
        .collect();
    let (max, sum) = parts.iter().fold((0.0, 0.0), |(max, sum), part| (f64::max(max, part.0), sum + part.1));
    (max, (sum / on_surface.len().max(1) as f64).sqrt())
}

/// Newton steps; where ω is smooth two are enough, a double root gains one bit with each.
const NEWTON_STEPS: usize = 8;

/// Distance of each point from ω = 0: the way that Newton's method along ∇ω takes to the surface, or the
/// distance within which ω changes sign if that is shorter or Newton's method gets nowhere.
fn project(field: &dyn Field, points: &[DVec3]) -> Vec<f64> {
    let mut at = points.to_vec();
    let mut directions = vec![DVec3::ZERO; points.len()];
    for step in 0..NEWTON_STEPS {
        let mut moved = false;
        for (i, (omega, gradient)) in gradients(field, &at).into_iter().enumerate() {
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
    let residuals = gradients(field, &at);
    (0..points.len())
        .map(|i| {
            let way = at[i].distance(points[i]);
            let left = residuals[i].0.abs() / residuals[i].1.length();
            let converged = residuals[i].0 == 0.0 || left <= 1e-3 * way || left <= rounding(points[i]);
            if converged && way <= 1e3 * rounding(points[i]) {
                return way;
            }
            let newton = if converged { way } else { f64::INFINITY };
            newton.min(sign_change_distance(field, points[i], directions[i]))
        })
        .collect()
}

/// The rounding of a point's coordinates.
fn rounding(p: DVec3) -> f64 {
    f64::EPSILON * p.abs().max_element()
}

/// The least radius, up to a factor of two, at which ω has both signs on the axes and the gradient's line
/// around a point: a bound for the distance that holds for flat and kinked fields too. Infinite if there is no
/// change of sign within the size of the point's coordinates.
fn sign_change_distance(field: &dyn Field, p: DVec3, direction: DVec3) -> f64 {
    let mut radius = rounding(p);
    for _ in 0..52 {
        let ways = [direction, DVec3::X, DVec3::Y, DVec3::Z];
        let around = ways.into_iter().flat_map(|way| [p + radius * way, p - radius * way]);
        let inside = around.map(|q| field.omega(q) > 0.0).filter(|inside| *inside).count();
        let expected = 2 * ways.len();
        if inside > 0 && inside < expected {
            return radius;
        }
        radius *= 2.0;
    }
    f64::INFINITY
}
