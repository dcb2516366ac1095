//! Cuts edges in two where the mesh is farther from the surface than it should be.
//!
//! A chord of length h misses a surface of radius R by h²/8R. A tight bend that is only a cell or two wide
//! therefore keeps a large error in a mesh that is fine elsewhere. The middle of such an edge moves onto the
//! surface. If the edge crosses a crease that no vertex has caught, its middle moves onto the crease.
//!
//! Invariant: cutting edges and the triangles beside them changes neither topology nor the order of what
//! was there.

use glam::DVec3;
use rayon::prelude::*;

use super::super::{
    MeshError, Watch,
    crossings::ended,
    normals::{GradientColumns, gradients, unit},
};
use super::crease;

use super::project;
use super::vertices::{Vertex, VertexKind, Vertices};
use crate::field::Field;

/// An edge is cut if its middle is farther from the surface than this, in cells. This bounds the error that
/// is left: the pawn in [0, 3]³ at 256³ cells has a Hausdorff distance of 0.024 cells, while chords across
/// its collar alone would make 0.08.
pub(super) const TOLERANCE: f64 = 0.025;

/// Rounds of cutting. Each round quarters the error that is left.
const ROUNDS: usize = 3;

/// Triangles in a batch.
const BATCH: usize = 2048;

/// The longest move of a middle on a smooth surface, in lengths of its edge. Beyond it triangles would
/// turn over.
const LONGEST_MOVE: f64 = 0.4;

/// The longest drop of a middle onto a crease, in lengths of its edge. An edge that bridges a narrow groove
/// drops to its bottom, and the triangles beside it then lie on the walls.
const LONGEST_DROP: f64 = 2.0;

/// The face of an edge's end is looked up at this share of the edge's length from the end.
const BESIDE: f64 = 0.1;

/// What refining a mesh has found.
pub(super) struct Refined {
    /// Edges that are not near the surface and could not be cut, ascending.
    pub left: Vec<[u32; 2]>,
    /// For each vertex that was added the ends of the edge that it cuts, in their order.
    pub ends: Vec<[u32; 2]>,
    /// The number of evaluations of ∇ω.
    pub evaluations: u64,
}

/// Cuts edges until the mesh is near the surface.
///
/// # Errors
/// [`MeshError::Ended`] if `watch` ends the work.
pub(super) fn refine(
    field: &dyn Field,
    vertices: &mut Vertices,
    triangles: &mut Vec<[u32; 3]>,
    size: f64,
    watch: &dyn Watch,
) -> Result<Refined, MeshError> {
    let (mut evaluations, mut ends) = (0, Vec::new());
    let mut left = Vec::new();
    // triangles whose edges have not been looked at yet
    let mut fresh = 0..triangles.len();
    let mut changed: Vec<u32> = Vec::new();
    for _ in 0..ROUNDS {
        let others: Vec<[u32; 3]> = changed.iter().map(|&t| triangles[t as usize]).collect();
        let found = cuts(field, vertices, (&triangles[fresh.clone()], &others), TOLERANCE * size, watch)?;
        let FoundEdges { cuts, left: uncut, evaluations: count } = found;
        evaluations += count;
        left.extend(uncut);
        if cuts.is_empty() {
            break;
        }
        let first = vertices.len() as u32;
        let numbers: Vec<([u32; 2], u32)> = cuts.iter().zip(first..).map(|(cut, v)| (cut.0, v)).collect();
        for (edge, vertex) in cuts {
            vertices.push(vertex);
            ends.push(edge);
        }
        let whole = triangles.len();
        changed = divide(vertices, triangles, &numbers);
        fresh = whole..triangles.len();
    }
    left.sort_unstable();
    left.dedup();
    Ok(Refined { left, ends, evaluations })
}

/// An edge's ends, ascending, and the vertex that cuts it.
type EdgeCut = ([u32; 2], Vertex);

/// The findings about edges.
#[derive(Default)]
struct FoundEdges {
    cuts: Vec<EdgeCut>,
    /// Edges that are too far from the surface, but for which no vertex to cut them was found.
    left: Vec<[u32; 2]>,
    evaluations: u64,
}

/// The cuts of the edges of some triangles, ascending by their ends.
///
/// # Errors
/// [`MeshError::Ended`].
fn cuts(
    field: &dyn Field,
    vertices: &Vertices,
    (fresh, changed): (&[[u32; 3]], &[[u32; 3]]),
    tolerance: f64,
    watch: &dyn Watch,
) -> Result<FoundEdges, MeshError> {
    let parts: Result<Vec<FoundEdges>, MeshError> = fresh
        .par_chunks(BATCH)
        .chain(changed.par_chunks(BATCH))
        .map_init(
            || (Vec::new(), GradientColumns::default()),
            |(edges, gradients), triangles| {
                ended(watch)?;
                edges.clear();
                triangles.iter().for_each(|t| add_bulging(vertices, *t, tolerance, edges));
                Ok(cuts_of(field, vertices, edges, gradients, tolerance))
            },
        )
        .collect();
    let mut all = FoundEdges::default();
    for part in parts? {
        all.cuts.extend(part.cuts);
        all.left.extend(part.left);
        all.evaluations += part.evaluations;
    }
    all.cuts.sort_unstable_by_key(|cut| cut.0);
    Ok(all)
}

/// The cuts among the edges that may bulge, in no particular order.
fn cuts_of(
    field: &dyn Field,
    vertices: &Vertices,
    edges: &[[u32; 2]],
    gradients: &mut GradientColumns,
    tolerance: f64,
) -> FoundEdges {
    let middle_of = |edge: &[u32; 2]| {
        let [a, b] = edge.map(|v| vertices.positions[v as usize]);
        0.5 * (a + b)
    };
    let middles: Vec<DVec3> = edges.iter().map(middle_of).collect();
    let mut count = middles.len() as u64;
    let (mut bends, mut others, mut near) = (Vec::new(), Vec::new(), Vec::new());
    for (&edge, (omega, gradient)) in edges.iter().zip(gradients.at(field, &middles)) {
        if omega.abs() > tolerance * gradient.length() {
            match Bend::new(vertices, edge, (omega, gradient)) {
                Some(bend) => bends.push(bend),
                None => others.push(edge),
            }
        } else {
            near.push(edge);
        }
    }
    let mut left = far_beside(field, vertices, near.into_iter(), tolerance, &mut count);
    let mut cut = Vec::with_capacity(bends.len() + others.len());
    for (bend, settled) in settle(field, bends, tolerance, &mut count) {
        if settled {
            cut.extend(bend.cut(tolerance));
        } else {
            others.push(bend.edge);
        }
    }
    for edge in others {
        match middle(field, edge.map(|v| vertices.get(v)), tolerance, &mut count) {
            Middle::Near => {}
            Middle::At(vertex) => cut.push((edge, vertex)),
            Middle::Nowhere => left.push(edge),
        }
    }
    FoundEdges { cuts: cut, left, evaluations: count }
}

/// Edges that leave the surface although their middles are near it, because they enter a wall or a gap that
/// is thinner than a cell.
fn far_beside(
    field: &dyn Field,
    vertices: &Vertices,
    edges: impl Iterator<Item = [u32; 2]>,
    tolerance: f64,
    count: &mut u64,
) -> Vec<[u32; 2]> {
    let is_sharp = |v: u32| vertices.kinds[v as usize] == VertexKind::Sharp;
    let normal = |v: u32| vertices.normals[v as usize];
    let doubtful: Vec<[u32; 2]> =
        edges.filter(|&[a, b]| is_sharp(a) || is_sharp(b) || normal(a).dot(normal(b)) < 0.5).collect();
    let points: Vec<DVec3> = doubtful
        .iter()
        .flat_map(|edge| {
            let [p, q] = edge.map(|v| vertices.positions[v as usize]);
            [0.25, 0.75].map(|share| p.lerp(q, share))
        })
        .collect();
    *count += points.len() as u64;
    let found = gradients(field, &points);
    let off = |(omega, gradient): &(f64, DVec3)| omega.abs() > 2.0 * tolerance * gradient.length();
    doubtful
        .into_iter()
        .zip(found.chunks_exact(2))
        .filter(|(_, pair)| pair.iter().any(off))
        .map(|(edge, _)| edge)
        .collect()
}

/// Adds those edges of a triangle whose middles may be farther than `tolerance` from the surface, as far as
/// the ends show. Only edges that the triangle runs along in ascending order are added; each edge of a closed
/// mesh is such an edge of one triangle.
fn add_bulging(vertices: &Vertices, t: [u32; 3], tolerance: f64, edges: &mut Vec<[u32; 2]>) {
    let [a, b, c] = t.map(|v| v as usize);
    let Vertices { positions, normals, kinds, .. } = vertices;
    let positions = [positions[a], positions[b], positions[c]];
    let normals = [normals[a], normals[b], normals[c]];
    let kinds = [kinds[a], kinds[b], kinds[c]];
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        let chord = positions[j] - positions[i];
        let bulges = (normals[j] - normals[i]).dot(chord).abs() > 4.0 * tolerance;
        let may_bulge = match (kinds[i], kinds[j]) {
            (VertexKind::Smooth, VertexKind::Smooth) => bulges,
            // a cap is no part of ω = 0
            (VertexKind::Cap, _) | (_, VertexKind::Cap) => false,
            // sheets that touch
            (VertexKind::Sharp, VertexKind::Smooth | VertexKind::Sharp)
            | (VertexKind::Smooth, VertexKind::Sharp) => chord != DVec3::ZERO,
        };
        // half of all edges ascend, so a branch on that alone could not be predicted
        if may_bulge & (t[i] < t[j]) {
            edges.push([t[i], t[j]]);
        }
    }
}

/// An edge over a smooth bend. The normal below its middle is about the mean of the normals at its ends,
/// while across a crease it would be one of them.
struct Bend {
    edge: [u32; 2],
    start: DVec3,
    /// The edge's length.
    length: f64,
    /// The mean of the normals at the ends.
    mean: DVec3,
    position: DVec3,
    normal: DVec3,
}

impl Bend {
    /// The bend of an edge after one step of Newton's method. `None` if the edge is not over a smooth bend.
    /// `found` are ω and ∇ω at its middle.
    fn new(vertices: &Vertices, edge: [u32; 2], found: (f64, DVec3)) -> Option<Self> {
        let [a, b] = edge.map(|v| vertices.get(v));
        if a.kind != VertexKind::Smooth || b.kind != VertexKind::Smooth {
            return None;
        }
        let (mean, normal) = (unit(a.normal + b.normal)?, unit(-found.1)?);
        // the cosine of half the way from the mean to an end: within it the normal is nearer to the mean than
        // to either end
        let half_way = unit(mean + a.normal)?.dot(mean).min(unit(mean + b.normal)?.dot(mean));
        let start = 0.5 * (a.position + b.position);
        let mut bend =
            Self { edge, start, length: a.position.distance(b.position), mean, position: start, normal };
        let is_bend = normal.dot(mean) > half_way && a.normal.dot(b.normal) > 0.0;
        is_bend.then(|| {
            bend.step(found);
            bend
        })
    }

    /// Makes one step of Newton's method and returns its length.
    fn step(&mut self, (omega, gradient): (f64, DVec3)) -> f64 {
        let step = gradient * (omega / gradient.length_squared());
        self.position -= step;
        step.length()
    }

    /// The cut at the point that was found. `None` if the surface is near after all.
    fn cut(&self, tolerance: f64) -> Option<EdgeCut> {
        let Self { edge, start, position, normal, .. } = *self;
        (position.distance(start) > tolerance)
            .then_some((edge, Vertex { position, normal, kind: VertexKind::Smooth }))
    }
}

/// Maximum number of steps of Newton's method on bends.
const STEPS: usize = 6;

/// Moves bends onto the surface, all together. Returns for each whether it settled.
fn settle(field: &dyn Field, bends: Vec<Bend>, tolerance: f64, count: &mut u64) -> Vec<(Bend, bool)> {
    let mut bends: Vec<(Bend, bool)> = bends.into_iter().map(|bend| (bend, false)).collect();
    for _ in 0..STEPS {
        let positions: Vec<DVec3> =
            bends.iter().filter(|(_, settled)| !settled).map(|(bend, _)| bend.position).collect();
        if positions.is_empty() {
            break;
        }
        *count += positions.len() as u64;
        let mut found = gradients(field, &positions).into_iter();
        for (bend, settled) in bends.iter_mut().filter(|(_, settled)| !settled) {
            let Some(found) = found.next() else { break };
            bend.normal = unit(-found.1).unwrap_or(DVec3::ZERO);
            *settled = bend.step(found) <= project::negligible(LAST_STEP, tolerance, bend.position);
        }
    }
    for (bend, settled) in &mut bends {
        let is_near = bend.position.distance(bend.start) <= LONGEST_MOVE * bend.length;
        *settled &= is_near && bend.normal.dot(bend.mean) > 0.0;
    }
    bends
}

/// A step in tolerances that needs no other after it. It leaves its square times the curvature, which is
/// 1e-11 of a tolerance.
const LAST_STEP: f64 = 1e-5;

/// Where an edge is cut.
enum Middle {
    At(Vertex),
    /// The surface is near after all. The field had the distance of another face.
    Near,
    /// No point of the surface is near enough to the middle.
    Nowhere,
}

/// The vertex that cuts an edge: on the crease between the faces at its ends, or on the surface.
fn middle(field: &dyn Field, [a, b]: [Vertex; 2], tolerance: f64, count: &mut u64) -> Middle {
    let (start, length) = (0.5 * (a.position + b.position), a.position.distance(b.position));
    let is_near = |p: &DVec3, reach: f64| p.distance(start) <= reach * length;
    let mut face = |p: DVec3, normal: DVec3| match unit(normal) {
        Some(normal) => project::onto_face(field, p, normal, length, count),
        None => project::newton(field, p, length, count),
    };
    let faces = [
        face(a.position.lerp(b.position, BESIDE), a.normal),
        face(b.position.lerp(a.position, BESIDE), b.normal),
    ];
    let near =
        faces.into_iter().flatten().any(|f| project::is_within(field, start, f.normal, tolerance, count));
    if near {
        return Middle::Near;
    }
    if let [Some(first), Some(second)] = faces {
        let found = crease::find(field, start, &[first, second], length, count);
        // the bottom of a groove between walls at ±angle/2 lies half a length · tan(angle/2) below the middle
        let drop = (0.5 * first.normal.angle_between(second.normal)).tan();
        if let Some(position) = found.filter(|p| is_near(p, (0.25 + 0.75 * drop).min(LONGEST_DROP))) {
            return Middle::At(Vertex { position, normal: DVec3::ZERO, kind: VertexKind::Sharp });
        }
    }
    let normal = faces.into_iter().flatten().fold(DVec3::ZERO, |sum, face| sum + face.normal);
    let found = match unit(normal) {
        Some(normal) => project::onto_face(field, start, normal, length, count),
        None => project::newton(field, start, length, count),
    };
    match found.filter(|face| is_near(&face.point, LONGEST_MOVE)) {
        Some(face) => {
            Middle::At(Vertex { position: face.point, normal: face.normal, kind: VertexKind::Smooth })
        }
        None => Middle::Nowhere,
    }
}

/// Divides triangles at cut edges. The first part takes the place of the whole, the others go to the end.
/// Returns the numbers of the triangles that were divided. `middles` are sorted by their edges.
fn divide(vertices: &Vertices, triangles: &mut Vec<[u32; 3]>, middles: &[([u32; 2], u32)]) -> Vec<u32> {
    let mut is_end = vec![false; vertices.len()];
    middles.iter().flat_map(|m| m.0).for_each(|v| is_end[v as usize] = true);
    let middle = |a: u32, b: u32| {
        if !is_end[a as usize] || !is_end[b as usize] {
            return None;
        }
        let at = middles.binary_search_by_key(&[a.min(b), a.max(b)], |m| m.0).ok()?;
        Some(middles[at].1)
    };
    let mut changed = Vec::new();
    let mut others = Vec::new();
    for t in with_cut_ends(triangles, &is_end) {
        let triangle = &mut triangles[t];
        if let Some(first) = divide_one(vertices, *triangle, middle, &mut others) {
            *triangle = first;
            changed.push(t as u32);
        }
    }
    triangles.extend(others);
    changed
}

/// The triangles that have at least two ends of cut edges, ascending.
fn with_cut_ends(triangles: &[[u32; 3]], is_end: &[bool]) -> Vec<usize> {
    // few triangles have two such ends: counting them takes no branches
    let is_touched = |[a, b, c]: [u32; 3]| {
        u8::from(is_end[a as usize]) + u8::from(is_end[b as usize]) + u8::from(is_end[c as usize]) >= 2
    };
    let find = |(batch, part): (usize, &[[u32; 3]])| {
        let mut touched = Vec::new();
        for (i, t) in (batch * BATCH..).zip(part) {
            if is_touched(*t) {
                touched.push(i);
            }
        }
        touched
    };
    let touched: Vec<Vec<usize>> = triangles.par_chunks(BATCH).enumerate().map(find).collect();
    touched.concat()
}

/// Divides one triangle: returns its first part and adds the rest to `others`. `None` if `middle`, which
/// gives the vertex that cuts an edge, knows of no cut on its sides.
fn divide_one(
    vertices: &Vertices,
    [a, b, c]: [u32; 3],
    middle: impl Fn(u32, u32) -> Option<u32>,
    others: &mut Vec<[u32; 3]>,
) -> Option<[u32; 3]> {
    // turned so that the first side is cut if one is, and the third is whole if one is
    let turns = [[a, b, c], [b, c, a], [c, a, b]];
    let cuts = turns.map(|[p, q, _]| middle(p, q));
    let turn = match cuts.map(|m| m.is_some()) {
        [false, false, false] => return None,
        [false, true, _] => 1,
        [_, false, true] => 2,
        [true, ..] => 0,
    };
    let [a, b, c] = turns[turn];
    let ab = cuts[turn]?;
    let position = |v: u32| vertices.positions[v as usize];
    let distance = |a: u32, b: u32| position(a).distance(position(b));
    let first = match [cuts[(turn + 1) % 3], cuts[(turn + 2) % 3]] {
        [Some(bc), Some(ca)] => {
            others.extend([[ab, b, bc], [bc, c, ca], [ab, bc, ca]]);
            [a, ab, ca]
        }
        [Some(bc), None] if distance(ab, c) <= distance(a, bc) => {
            others.extend([[ab, bc, c], [a, ab, c]]);
            [ab, b, bc]
        }
        [Some(bc), None] => {
            others.extend([[a, ab, bc], [a, bc, c]]);
            [ab, b, bc]
        }
        [None, _] => {
            others.push([ab, b, c]);
            [a, ab, c]
        }
    };
    Some(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_choice_of_cut_sides_tiles_the_triangle() {
        let places =
            [DVec3::ZERO, DVec3::X, DVec3::Y, 0.5 * DVec3::X, DVec3::new(0.5, 0.5, 0.0), 0.5 * DVec3::Y];
        let mut vertices = Vertices::default();
        for position in places {
            vertices.push(Vertex { position, normal: DVec3::Z, kind: VertexKind::Smooth });
        }
        let sides = [([0, 1], 3), ([0, 2], 5), ([1, 2], 4)];
        for chosen in 0..8 {
            let middles: Vec<_> = (0..3).filter(|i| chosen >> i & 1 == 1).map(|i| sides[i]).collect();
            for triangle in [[0, 1, 2], [1, 2, 0], [2, 0, 1]] {
                let mut parts = vec![triangle];
                let changed = divide(&vertices, &mut parts, &middles);
                assert_eq!(changed.len(), usize::from(chosen != 0));
                assert_eq!(parts.len(), 1 + middles.len());
                let areas = parts.iter().map(|t| {
                    let [a, b, c] = t.map(|v| places[v as usize]);
                    0.5 * (b - a).cross(c - a).z
                });
                let areas: Vec<f64> = areas.collect();
                assert!(areas.iter().all(|&area| area > 0.0), "{chosen}: {parts:?}");
                assert_eq!(areas.iter().sum::<f64>(), 0.5);
            }
        }
    }
}
