//! The vertex of a loop that encloses a crease or a corner, or lies on the border.
//!
//! Four candidates are tried in turn: the minimiser of the quadratic error if it lies on the surface already
//! (plane faces, tips of cones); the crease of the two or three faces that the hits show; the minimiser moved
//! onto the surface; the mean of the hits.

use glam::DVec3;

use super::super::normals::unit;
use super::project::{FacePoint, negligible};
use super::vertices::{Hit, Vertex, VertexKind};
use super::{crease, qef};
use crate::field::Field;
use crate::geom::Aabb;

/// How far from its cell a point may slide onto the surface, in cells.
pub(super) const SLIDE: f64 = 0.5;

/// A normal that differs less than this from that of a face found before belongs to that face (the cosine
/// of 25°).
const NEW_FACE: f64 = 0.906;

/// A vertex may lie this far from its cell, in cells, because creases that curve pass a little beside the
/// hits that show them.
const REACH: f64 = 0.05;

/// A corner may lie this far from its cell, in cells, which is rounding. Otherwise two cells would place a
/// vertex in the same corner.
const CORNER_REACH: f64 = 1e-9;

/// How often a crease is sought. Its point nearest to the middle may lie outside the cell although the crease
/// cuts off one of the cell's corners. Then the crease is sought again from a point farther along it in the
/// cell, or from the cell's nearest point if it bends too much for that.
const TRIES: usize = 4;

/// Maximum number of Newton steps: twice as many as a smooth surface takes.
const STEPS: usize = 8;

/// A point nearer to the surface than this, in cells, is on it. Plane faces give 1e-15.
const ON_SURFACE: f64 = 1e-11;

/// The vertex of a loop whose hits do not face the same way. `mean` is the mean of the hits, and `count`
/// counts evaluations.
pub(super) fn at_crease(
    field: &dyn Field,
    cell: &Aabb,
    spacing: DVec3,
    hits: &[Hit],
    mean: DVec3,
    count: &mut u64,
) -> Vertex {
    let size = spacing.min_element();
    let lies_within = |p: DVec3, reach: f64| {
        let margin = spacing.map(|side| negligible(reach, side, p));
        p.cmpge(cell.min - margin).all() && p.cmple(cell.max + margin).all()
    };
    let sharp = |position| Vertex { position, normal: DVec3::ZERO, kind: VertexKind::Sharp };

    let planes = hits.iter().filter(|hit| hit.normal != DVec3::ZERO);
    let (least, rank) = qef::minimiser(planes.map(|hit| (hit.position, hit.normal)), mean);
    let reach_of = |rank: usize| if rank == 3 { CORNER_REACH } else { REACH };
    if lies_within(least, reach_of(rank)) {
        *count += 1;
        let (omega, gradient) = field.omega_grad(least);
        if omega.abs() <= negligible(ON_SURFACE, size, least) * gradient.length() {
            return sharp(least);
        }
    }
    let faces = faces(hits);
    let pairs: &[&[usize]] = match faces.len() {
        3 => &[&[0, 1, 2], &[0, 1], &[0, 2], &[1, 2]],
        2 => &[&[0, 1]],
        _ => &[],
    };
    for chosen in pairs {
        let few: Vec<FacePoint> = chosen.iter().map(|&i| faces[i]).collect();
        let mut start = mean;
        for _ in 0..TRIES {
            let Some(found) = crease::find(field, start, &few, size, count) else { break };
            if lies_within(found, reach_of(chosen.len())) {
                return sharp(found);
            }
            let &[a, b] = &few[..] else { break };
            let along = a.normal.cross(b.normal);
            start = middle_within(found, along, cell, 0.5 * REACH * spacing)
                .unwrap_or_else(|| found.clamp(cell.min, cell.max));
        }
    }
    let inside = least.clamp(cell.min, cell.max);
    for start in [inside, mean] {
        let settled = settle(field, start, DVec3::ONE, size, count);
        if let Some((position, normal)) = settled.filter(|(p, _)| lies_within(*p, SLIDE)) {
            return Vertex { position, normal, kind: VertexKind::Sharp };
        }
    }
    sharp(mean)
}

/// The vertex of a cell of the ring. It lies on the border, and on the surface if that meets the border in
/// the cell.
///
/// The second result is the point to which the vertex moves if the triangles around it lie upside down.
pub(super) fn on_border(
    field: &dyn Field,
    cell: &Aabb,
    hits: &[Hit],
    mean: DVec3,
    count: &mut u64,
) -> (Vertex, DVec3) {
    let on_surface: Vec<DVec3> = hits.iter().filter(|hit| !hit.is_cap).map(|hit| hit.position).collect();
    let clamped = |p: DVec3| p.clamp(cell.min, cell.max);
    if on_surface.is_empty() {
        let normal = unit(hits.iter().map(|hit| hit.normal).sum()).unwrap_or(DVec3::ZERO);
        let position = clamped(mean);
        return (Vertex { position, normal, kind: VertexKind::Cap }, position);
    }
    let mean = clamped(on_surface.iter().sum::<DVec3>() / on_surface.len() as f64);
    let free = DVec3::select(cell.size().cmpgt(DVec3::ZERO), DVec3::ONE, DVec3::ZERO);
    let size = cell.size().max_element();
    let settled = settle(field, mean, free, size, count).filter(|(p, _)| clamped(*p) == *p);
    let position = settled.map_or(mean, |(p, _)| p);
    (Vertex { position, normal: DVec3::ZERO, kind: VertexKind::Sharp }, mean)
}

/// The surface near a point by Newton's method along the free axes, and its normal there. `None` if the
/// method leads more than `size` away or does not converge.
fn settle(
    field: &dyn Field,
    start: DVec3,
    free: DVec3,
    size: f64,
    count: &mut u64,
) -> Option<(DVec3, DVec3)> {
    let mut at = start;
    for _ in 0..STEPS {
        *count += 1;
        let (omega, gradient) = field.omega_grad(at);
        let slope = gradient * free;
        let step = slope * (omega / slope.length_squared());
        if !step.is_finite() {
            return None;
        }
        at -= step;
        if at.distance(start) > size {
            return None;
        }
        if step.length() <= negligible(ON_SURFACE, size, at) {
            return Some((at, unit(-gradient)?));
        }
    }
    None
}

/// The middle of the part of a line through `p` that lies in a box with a margin. `None` if the line
/// misses it.
fn middle_within(p: DVec3, along: DVec3, cell: &Aabb, margin: DVec3) -> Option<DVec3> {
    let (a, b) = ((cell.min - margin - p) / along, (cell.max + margin - p) / along);
    let (from, to) = (a.min(b).max_element(), a.max(b).min_element());
    let middle = p + 0.5 * (from + to) * along;
    (from <= to && middle.is_finite()).then_some(middle)
}

/// Up to three faces on which the hits lie: the two that differ most, and one that differs from both.
fn faces(hits: &[Hit]) -> Vec<FacePoint> {
    let faces: Vec<FacePoint> = hits
        .iter()
        .filter(|hit| hit.normal != DVec3::ZERO)
        .map(|hit| FacePoint { point: hit.position, normal: hit.normal })
        .collect();
    let pairs = (0..faces.len()).flat_map(|i| (0..i).map(move |j| (j, i)));
    let cosine = |(i, j): &(usize, usize)| faces[*i].normal.dot(faces[*j].normal);
    let Some((a, b)) = pairs.min_by(|p, q| cosine(p).total_cmp(&cosine(q))) else { return Vec::new() };
    let likeness = |face: &&FacePoint| face.normal.dot(faces[a].normal).max(face.normal.dot(faces[b].normal));
    let third = faces.iter().min_by(|p, q| likeness(p).total_cmp(&likeness(q)));
    let mut found = vec![faces[a], faces[b]];
    found.extend(third.filter(|face| likeness(face) < NEW_FACE));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_followed_into_a_cell() {
        let cell = Aabb::new(DVec3::ZERO, DVec3::ONE);
        let found = |p: DVec3, along: DVec3| middle_within(p, along, &cell, DVec3::ZERO);
        // cuts off the corner (1, 0): enters at x = 0.8 and leaves at y = 0.2
        let cut = found(DVec3::new(0.5, -0.3, 0.5), DVec3::new(1.0, 1.0, 0.0)).unwrap();
        assert!(cut.distance(DVec3::new(0.9, 0.1, 0.5)) < 1e-15, "{cut}");
        // along an axis, beside and through
        assert_eq!(found(DVec3::new(0.5, 1.5, 0.5), DVec3::X), None);
        assert_eq!(found(DVec3::new(7.0, 0.25, 0.5), -DVec3::X), Some(DVec3::new(0.5, 0.25, 0.5)));
        assert_eq!(found(DVec3::ZERO, DVec3::ZERO), None);
    }
}
