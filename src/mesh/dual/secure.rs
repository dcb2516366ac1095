//! A mesh of quads that does not cross itself.
//!
//! The grid's edge and two neighbouring corners of its quad span a tetrahedron. If every corner lies in its
//! own cell, the four tetrahedra around an edge fill the quad's envelope, and envelopes of different edges
//! have no inner point in common, because those within a cell are pyramids over different parts of its faces.
//! So quads within their envelopes cannot cross (Ju, Udeshi: Intersection-free contouring on an octree grid,
//! Pacific Graphics 2006). Smooth surfaces with their corners in their cells do not need that test: around
//! each corner they are a graph over its tangent plane.
//!
//! All other quads are compared with the triangles near them. Where some cross, the vertices of their cells
//! retreat: into their cells first, then to the mean of their hits. Their quads become fans around the hits,
//! and sides are bent so that they pass through the faces between cells. Each triangle then lies in one cell,
//! and those of a cell are a cone over a closed curve on its faces. Wherever the tip of the cone is in the
//! cell, it does not cross itself, so that tips and bends are put on the surface; where sheets share a cell
//! and cross, they go back. The vertices at the ends of a tunnel go back together, to where they began in
//! their cell.
//!
//! Invariant: retreats change no topology, and they spread until nothing crosses.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};
use smallvec::SmallVec;

use super::super::{MeshError, Watch, crossings::ended, intersections::crossing_pairs};
use super::project;
use super::quads::{Cut, NOTHING, Quad, Quads};
use super::vertices::{Vertex, VertexKind, Vertices};
use crate::field::Field;
use crate::geom::Aabb;

/// Maximum number of rounds of retreats. From the third on they spread to the cells around.
const ROUNDS: usize = 8;

/// Number of rounds in which vertices in retreat, and the bends of sides, are projected onto the surface.
const SETTLING: usize = 4;

/// Vertices in retreat keep this distance from the faces of their cells, in cells.
const INSET: f64 = 0.05;

/// The triangles of all quads and tubes, without crossings. Adds the middles of fans and of bent sides to the vertices.
/// `crossings` are those of [`crossings`](fn@crossings).
///
/// # Errors
/// [`MeshError::Ended`] if the watch of the surface ends the work.
pub(super) fn secure(
    (mut quads, mut cut): (Quads<'_>, Cut),
    vertices: &mut Vertices,
    tubes: &[[u32; 3]],
    surface: &mut Surface<'_>,
    mut crossings: Vec<[u32; 2]>,
) -> Result<Vec<[u32; 3]>, MeshError> {
    let size = surface.size;
    let mut suspects = suspects(&quads, &cut, vertices);
    let cell_vertices = vertices.len();
    let mut lasting = cell_vertices;
    let mut round = 0;
    loop {
        ended(surface.watch)?;
        vertices.truncate(lasting);
        let (triangles, chosen) = assemble(&quads, &cut, vertices, tubes, &suspects);
        let pairs = match round {
            0 => std::mem::take(&mut crossings),
            1..ROUNDS => crossing_pairs(&vertices.positions, &triangles, &chosen, size),
            // what still crosses does so for good
            ROUNDS.. => Vec::new(),
        };
        if pairs.is_empty() {
            return Ok(triangles);
        }
        vertices.truncate(lasting);
        let mut is_marked = vec![false; lasting];
        let crossing = pairs.iter().flatten().flat_map(|&t| triangles[t as usize]);
        crossing.filter(|&v| (v as usize) < cell_vertices).for_each(|v| is_marked[v as usize] = true);
        if round >= 2 {
            for quad in quads.with_corners(&is_marked) {
                quad.corners.iter().for_each(|&v| is_marked[v as usize] = true);
            }
        }
        mark_tunnels(tubes, &mut is_marked);
        // all others are as they were when they crossed nothing
        suspects = retreat(&mut quads, &mut cut, vertices, &is_marked, (surface, round))?;
        lasting = vertices.len();
        round += 1;
    }
}

/// Marks all vertices at both ends of a tunnel of which one is marked.
fn mark_tunnels(tubes: &[[u32; 3]], is_marked: &mut [bool]) {
    let is_cut = |t: &[u32; 3], is_marked: &[bool]| {
        let count = t.iter().filter(|v| is_marked[**v as usize]).count();
        count == 1 || count == 2
    };
    while tubes.iter().any(|t| is_cut(t, is_marked)) {
        for t in tubes {
            if is_cut(t, is_marked) {
                t.iter().for_each(|&v| is_marked[v as usize] = true);
            }
        }
    }
}

/// The hits of quads that may cross others.
fn suspects(quads: &Quads<'_>, cut: &Cut, vertices: &Vertices) -> Vec<u32> {
    let doubtful = cut.doubtful.iter().filter(|quad| !is_enveloped(quads, vertices, quad, cut));
    let (astray, fans) = (cut.astray.iter().copied(), cut.fans.keys().copied());
    doubtful.map(|quad| quad.hit).chain(astray).chain(fans).collect()
}

/// The triangles as they are, which may cross.
pub(super) fn as_joined(
    quads: &Quads<'_>,
    cut: &Cut,
    vertices: &mut Vertices,
    tubes: &[[u32; 3]],
) -> Vec<[u32; 3]> {
    assemble(quads, cut, vertices, tubes, &[]).0
}

/// [`as_joined`], if the quads are no longer needed.
pub(super) fn into_joined(
    quads: &Quads<'_>,
    cut: Cut,
    vertices: &mut Vertices,
    tubes: &[[u32; 3]],
) -> Vec<[u32; 3]> {
    if is_plain(&cut, tubes) { cut.triangles } else { as_joined(quads, &cut, vertices, tubes) }
}

/// The pairs of triangles that cross as they are.
pub(super) fn crossings(
    quads: &Quads<'_>,
    cut: &Cut,
    vertices: &mut Vertices,
    tubes: &[[u32; 3]],
) -> Vec<[u32; 2]> {
    let count = vertices.len();
    let suspects = suspects(quads, cut, vertices);
    if is_plain(cut, tubes) {
        let mut chosen: Vec<u32> = suspects.iter().flat_map(|&hit| [2 * hit, 2 * hit + 1]).collect();
        chosen.sort_unstable();
        chosen.dedup();
        return crossing_pairs(&vertices.positions, &cut.triangles, &chosen, quads.size());
    }
    let (triangles, chosen) = assemble(quads, cut, vertices, tubes, &suspects);
    let found = crossing_pairs(&vertices.positions, &triangles, &chosen, quads.size());
    vertices.truncate(count);
    found
}

/// Whether the triangles of all quads are those of the whole mesh.
fn is_plain(cut: &Cut, tubes: &[[u32; 3]]) -> bool {
    tubes.is_empty() && cut.fans.is_empty() && !cut.triangles.contains(&NOTHING)
}

/// All triangles, and the numbers of those that are to be compared with others, ascending.
fn assemble(
    quads: &Quads<'_>,
    cut: &Cut,
    vertices: &mut Vertices,
    tubes: &[[u32; 3]],
    suspects: &[u32],
) -> (Vec<[u32; 3]>, Vec<u32>) {
    let mut triangles = Vec::with_capacity(cut.triangles.len() + tubes.len());
    let mut chosen: Vec<u32> = Vec::new();
    let mut is_suspect = vec![false; cut.triangles.len() / 2];
    suspects.iter().for_each(|&hit| is_suspect[hit as usize] = true);
    if cut.fans.is_empty() && !cut.triangles.contains(&NOTHING) {
        triangles.extend_from_slice(&cut.triangles);
        chosen.extend(suspects.iter().flat_map(|&hit| [2 * hit, 2 * hit + 1]));
    } else {
        for (pair, is_suspect) in cut.triangles.chunks_exact(2).zip(&is_suspect) {
            for t in pair.iter().filter(|t| **t != NOTHING) {
                if *is_suspect {
                    chosen.push(triangles.len() as u32);
                }
                triangles.push(*t);
            }
        }
    }
    for (&number, rim) in &cut.fans {
        let centre = vertices.len() as u32;
        let hit = quads.hits.get(number);
        let kind = if hit.is_cap { VertexKind::Cap } else { VertexKind::Sharp };
        vertices.push(Vertex { position: hit.position, normal: hit.normal, kind });
        let next = rim.iter().cycle().skip(1);
        let first = triangles.len() as u32;
        triangles.extend(rim.iter().zip(next).map(|(&a, &b)| [centre, a, b]));
        if is_suspect[number as usize] {
            chosen.extend(first..triangles.len() as u32);
        }
    }
    let whole = triangles.len();
    triangles.extend_from_slice(tubes);
    chosen.extend(whole as u32..triangles.len() as u32);
    chosen.sort_unstable();
    chosen.dedup();
    (triangles, chosen)
}

/// The surface, for what is put on it.
pub(super) struct Surface<'a> {
    pub field: &'a dyn Field,
    /// The shortest side of a cell.
    pub size: f64,
    /// May end the work between two points.
    pub watch: &'a dyn Watch,
    /// Evaluations of the gradient.
    pub gradients: u64,
}

impl Surface<'_> {
    /// The surface near a point, if it is there in a box.
    fn within(&mut self, start: DVec3, bounds: &Aabb) -> Option<DVec3> {
        let found = project::newton(self.field, start, self.size, &mut self.gradients)?.point;
        is_within(bounds, found).then_some(found)
    }

    /// The surface between two hits on the sides of a face between cells, on the line in the face through the middle.
    fn in_face(&mut self, [p, q]: [DVec3; 2], face: &Aabb) -> Option<DVec3> {
        let (middle, size) = (p.midpoint(q), face.size());
        let across = [DVec3::X, DVec3::Y, DVec3::Z][size.min_position()];
        let normal = across.cross(q - p).try_normalize()?;
        self.gradients += 1;
        let gradient = self.field.omega_grad(middle).1;
        let outwards = if normal.dot(gradient) > 0.0 { -normal } else { normal };
        let found =
            project::along(self.field, middle, outwards, 0.5 * p.distance(q), &mut self.gradients)?.point;
        let inset = INSET * size;
        is_within(&Aabb::new(face.min + inset, face.max - inset), found).then_some(found)
    }
}

fn is_within(bounds: &Aabb, p: DVec3) -> bool {
    (p.cmpge(bounds.min) & p.cmple(bounds.max)).all()
}

/// What is known of a cell that retreats.
struct Retreat {
    hits: DVec3,
    count: f64,
    cell: Aabb,
}

/// Sides by their ends: the hits of the quads beside each, and the face between the cells of its ends.
type Sides = BTreeMap<[u32; 2], (SmallVec<[u32; 4]>, Aabb)>;

/// Moves the marked vertices into their cells and makes fans of their quads, with bent sides. Returns the hits of these
/// quads.
///
/// # Errors
/// [`MeshError::Ended`].
fn retreat(
    quads: &mut Quads<'_>,
    cut: &mut Cut,
    vertices: &mut Vertices,
    is_marked: &[bool],
    (surface, round): (&mut Surface<'_>, usize),
) -> Result<Vec<u32>, MeshError> {
    let touched = quads.with_corners(is_marked);
    let (cells, sides) = around(quads, &touched, is_marked);
    into_cells(quads, vertices, cells, surface, round)?;
    bend(quads, vertices, sides, surface, round)?;
    for quad in &touched {
        cut.triangles[2 * quad.hit as usize..][..2].fill(NOTHING);
        if let Some(rim) = quads.rim(quad) {
            cut.fans.insert(quad.hit, rim);
        }
    }
    Ok(touched.iter().map(|quad| quad.hit).collect())
}

/// The cells of the marked vertices, and the sides that end in one: each side with the hits of the quads
/// beside it, and the face between its cells.
fn around(quads: &Quads<'_>, touched: &[Quad], is_marked: &[bool]) -> (BTreeMap<u32, Retreat>, Sides) {
    let mut sides = Sides::new();
    let mut cells: BTreeMap<u32, Retreat> = BTreeMap::new();
    for quad in touched {
        for i in 0..4 {
            let (a, b) = (quad.corners[i], quad.corners[(i + 1) % 4]);
            if is_marked[a as usize] {
                let new = || Retreat { hits: DVec3::ZERO, count: 0.0, cell: quads.cell(quad, i) };
                let found = cells.entry(a).or_insert_with(new);
                found.hits += quads.hits.positions[quad.hit as usize];
                found.count += 1.0;
            }
            if is_marked[a as usize] || is_marked[b as usize] {
                let face = quads.cell(quad, i).intersection(&quads.cell(quad, (i + 1) % 4));
                let ends = quads.side(quad, i);
                sides.entry(ends).or_insert_with(|| (SmallVec::new(), face)).0.push(quad.hit);
            }
        }
    }
    (cells, sides)
}

/// Moves vertices into their cells, onto the surface in the first rounds.
///
/// # Errors
/// [`MeshError::Ended`].
fn into_cells(
    quads: &Quads<'_>,
    vertices: &mut Vertices,
    cells: BTreeMap<u32, Retreat>,
    surface: &mut Surface<'_>,
    round: usize,
) -> Result<(), MeshError> {
    for (v, Retreat { hits, count, cell }) in cells {
        ended(surface.watch)?;
        let place = v as usize;
        if let Some(&position) = quads.tunnels.get(&v) {
            vertices.set(v, Vertex { position, normal: DVec3::ZERO, kind: VertexKind::Sharp });
            continue;
        }
        let is_flat = cell.size().min_element() <= 0.0;
        if is_flat || vertices.kinds[place] == VertexKind::Cap {
            continue;
        }
        let inset = INSET * cell.size();
        let within = Aabb::new(cell.min + inset, cell.max - inset);
        let mut position = if round == 0 && !vertices.doubtful[place] {
            vertices.positions[place].clamp(within.min, within.max)
        } else {
            hits / count
        };
        if round < SETTLING {
            position = surface.within(position, &within).unwrap_or(position);
        }
        if position != vertices.positions[place] {
            vertices.set(v, Vertex { position, normal: DVec3::ZERO, kind: VertexKind::Sharp });
        }
    }
    Ok(())
}

/// Gives each side a vertex in its middle, in the face that it crosses.
///
/// # Errors
/// [`MeshError::Ended`].
fn bend(
    quads: &mut Quads<'_>,
    vertices: &mut Vertices,
    sides: Sides,
    surface: &mut Surface<'_>,
    round: usize,
) -> Result<(), MeshError> {
    for (ends, (hits, face)) in sides {
        ended(surface.watch)?;
        let &[first, second] = &hits[..] else { continue };
        let [p, q] = [first, second].map(|hit| quads.hits.get(hit));
        let halfway = p.position.midpoint(q.position);
        if let Some(&middle) = quads.middles.get(&(first, ends)) {
            if round >= SETTLING {
                vertices.positions[middle as usize] = halfway;
            }
            continue;
        }
        let kind = if p.is_cap && q.is_cap { VertexKind::Cap } else { VertexKind::Sharp };
        let settled = (kind == VertexKind::Sharp && round < SETTLING)
            .then(|| surface.in_face([p.position, q.position], &face))
            .flatten();
        let middle = vertices.len() as u32;
        vertices.push(Vertex { position: settled.unwrap_or(halfway), normal: DVec3::ZERO, kind });
        for hit in [first, second] {
            quads.middles.insert((hit, ends), middle);
        }
    }
    Ok(())
}

/// Whether a quad lies in its envelope.
fn is_enveloped(quads: &Quads<'_>, vertices: &Vertices, quad: &Quad, cut: &Cut) -> bool {
    if !quads.is_at_home(vertices, quad) {
        return false;
    }
    let [u, v, w] = [1, 2, 0].map(|step| (quad.axis + step) % 3);
    let begin = quads.lattice.position(quad.low);
    let mut above = quad.low;
    above[quad.axis] += 1;
    let length = quads.lattice.coordinate(quad.axis, above[quad.axis]) - begin[quad.axis];
    let places = quad.corners.map(|corner| {
        let p = vertices.positions[corner as usize] - begin;
        DVec3::new(p[u], p[v], p[w])
    });
    // the triangles begin with the diagonal's ends
    let first = cut.triangles[2 * quad.hit as usize][0];
    let start = usize::from(first != quad.corners[0]);
    let corner = |i: usize| places[(start + i) % 4];
    let (from, to) = (corner(0), corner(2));
    let turn = |a: DVec3, b: DVec3| DVec2::new(a.x, a.y).perp_dot(DVec2::new(b.x, b.y));
    // the corner on whose side the diagonal passes the edge
    let ring = turn(corner(0), corner(1))
        + turn(corner(1), corner(2))
        + turn(corner(2), corner(3))
        + turn(corner(3), corner(0));
    let beside = if (turn(from, to) > 0.0) == (ring > 0.0) { corner(1) } else { corner(3) };
    passes_within(from, beside, to, length) && passes_within(to, beside, from, length)
}

/// Whether the line from a corner to the opposite one passes the face between the cells of the first and of
/// `beside` within the triangle of the edge, from 0 to `length` on the third axis, and the point where the
/// side between these two passes.
fn passes_within(from: DVec3, beside: DVec3, to: DVec3, length: f64) -> bool {
    // neighbours lie on different sides on one of the two axes
    let across = usize::from((from.x > 0.0) == (beside.x > 0.0));
    let along = 1 - across;
    let meet = |other: DVec3| {
        let at = from.lerp(other, from[across] / (from[across] - other[across]));
        (at[along].abs(), at.z)
    };
    let ((reach, height), (distance, found)) = (meet(beside), meet(to));
    let share = distance / reach;
    // comparisons with NaN fail
    share <= 1.0 && found >= share * height && found <= length + share * (height - length)
}
