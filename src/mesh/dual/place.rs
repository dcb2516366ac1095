//! Where the vertex of a loop goes: onto the surface, and onto its crease or corner where the loop encloses one.
//!
//! Loops whose hits face nearly the same way take the mean of the hits, moved onto the surface by Newton's method,
//! all of a brick together. For the others the candidates are tried in turn: the minimiser of the quadratic error if
//! it lies on the surface already (plane faces, tips of cones), the crease of the two or three faces that the hits
//! show, the minimiser moved onto the surface, the mean of the hits.
//!
//! Invariant: a vertex lies within [`SLIDE`] of its cell or of the mean of its hits, on the border if its cell is in the
//! ring.

use glam::{DVec3, UVec3};

use super::super::normals::{gradients, unit};
use super::bricks::{Brick, Frame, Hit};
use super::crease::{self, Face};
use super::loops::{LOOPS, Loop};
use super::project;
use super::qef;
use crate::field::Field;
use crate::geom::Aabb;

/// Hits whose normals all lie within this of their mean (cosine of 10°) see a smooth surface.
const NEARLY_FLAT: f64 = 0.985;

/// Normals that differ less than this from each face found so far belong to one of them (cosine of 25°).
const NEW_FACE: f64 = 0.906;

/// How far from its cell a vertex may lie, in cells: creases that curve pass a little beside the hits that show them.
const REACH: f64 = 0.05;

/// How far from its cell a point may slide onto the surface, in cells.
const SLIDE: f64 = 0.5;

/// Corners must lie in their cells up to rounding, in cells: else two cells would place a vertex in the same one.
const CORNER_REACH: f64 = 1e-9;

/// Newton steps onto a smooth surface.
const STEPS: usize = 4;

/// A distance from the surface that is none, in cells: plane faces give 1e-15.
const ON_SURFACE: f64 = 1e-11;

/// The vertex of a loop.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vertex {
    pub position: DVec3,
    /// Outward unit normal; zero on creases and where there is none.
    pub normal: DVec3,
    pub kind: Kind,
    /// Where it goes if the triangles around it cannot do with its place.
    pub fallback: DVec3,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// The surface is smooth in the cell.
    Smooth,
    /// The surface may have a crease there.
    Sharp,
    /// On the border, where the solid leaves the grid.
    Cap,
}

/// The vertices of a brick's cells, and for each the crossed edges of its loop.
#[derive(Default)]
pub(super) struct Placed {
    pub vertices: Vec<Vertex>,
    /// Brick slot and number of a crossed edge, the cell's place around it, and the vertex there.
    pub links: Vec<Link>,
    pub twice: Vec<Twice>,
    pub gradients: u64,
}

/// A crossed edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Crossing {
    pub slot: u32,
    pub number: u32,
}

/// That a vertex lies at a crossed edge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Link {
    pub crossing: Crossing,
    /// The edge's place in the cell, see `cases`.
    pub place: u8,
    /// Counted from the brick's first.
    pub vertex: u32,
}

/// A passage of a loop through a face that it passes twice.
#[derive(Debug, Clone, Copy)]
pub(super) struct Twice {
    /// The edges where it enters and leaves, ascending.
    pub segment: [Crossing; 2],
    pub vertex: u32,
}

/// Places the vertices of a brick.
pub(super) fn place(field: &dyn Field, frame: &Frame, bricks: &[Brick], slot: usize) -> Placed {
    let brick = &bricks[slot];
    let mut placed = Placed::default();
    let mut hits = Vec::new();
    let mut crossings = Vec::new();
    brick.for_each_active(|cell, inside| {
        for around in &LOOPS[usize::from(inside)] {
            hits.clear();
            crossings.clear();
            for &e in &around.edges {
                let Some((slot, number)) = brick.owner(bricks, cell, e) else { continue };
                hits.push(bricks[slot as usize].hits[number as usize]);
                crossings.push(Crossing { slot, number });
            }
            if hits.len() == around.edges.len() {
                let low = brick.low + UVec3::from_array(cell.map(|i| i as u32));
                placed.add(field, &frame.cell(low), frame.spacing, around, &hits, &crossings);
            }
        }
    });
    placed.settle_smooth(field, frame.spacing);
    placed
}

impl Placed {
    fn add(
        &mut self,
        field: &dyn Field,
        cell: &Aabb,
        spacing: DVec3,
        around: &Loop,
        hits: &[Hit],
        crossings: &[Crossing],
    ) {
        let vertex = self.vertices.len() as u32;
        for (&crossing, e) in crossings.iter().zip(&around.edges) {
            self.links.push(Link { crossing, place: e & 3, vertex });
        }
        for pair in &around.twice {
            let mut segment = pair.map(|i| crossings[usize::from(i)]);
            segment.sort_unstable();
            self.twice.push(Twice { segment, vertex });
        }
        let placed = self.vertex(field, cell, spacing, hits);
        self.vertices.push(placed);
    }

    fn vertex(&mut self, field: &dyn Field, cell: &Aabb, spacing: DVec3, hits: &[Hit]) -> Vertex {
        let mean = hits.iter().fold(DVec3::ZERO, |sum, hit| sum + hit.position) / hits.len() as f64;
        let normal = unit(hits.iter().fold(DVec3::ZERO, |sum, hit| sum + hit.normal)).unwrap_or(DVec3::ZERO);
        let smooth = Vertex { position: mean, normal, kind: Kind::Smooth, fallback: mean };
        if cell.size().min_element() == 0.0 {
            return self.on_border(field, cell, hits, smooth);
        }
        if hits.iter().all(|hit| hit.normal.dot(normal) > NEARLY_FLAT) {
            return smooth;
        }
        let size = spacing.min_element();
        let lies_within = |p: DVec3, reach: f64| {
            p.cmpge(cell.min - reach * spacing).all() && p.cmple(cell.max + reach * spacing).all()
        };
        let sharp = |position| Vertex { position, normal: DVec3::ZERO, kind: Kind::Sharp, fallback: mean };

        let planes = hits.iter().filter(|hit| hit.normal != DVec3::ZERO);
        let (least, rank) = qef::minimiser(planes.map(|hit| (hit.position, hit.normal)), mean);
        let reach_of = |rank: usize| if rank == 3 { CORNER_REACH } else { REACH };
        if lies_within(least, reach_of(rank)) {
            self.gradients += 1;
            let (omega, gradient) = field.omega_grad(least);
            if omega.abs() <= ON_SURFACE * size * gradient.length() {
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
            let few: Vec<Face> = chosen.iter().map(|&i| faces[i]).collect();
            let found = crease::find(field, mean, &few, size, &mut self.gradients);
            if let Some(found) = found.filter(|p| lies_within(*p, reach_of(chosen.len()))) {
                return sharp(found);
            }
        }
        let inside = least.clamp(cell.min, cell.max);
        for start in [inside, mean] {
            let settled = self.settle(field, start, DVec3::ONE, size);
            if let Some((position, normal)) = settled.filter(|(p, _)| lies_within(*p, SLIDE)) {
                return Vertex { position, normal, kind: Kind::Sharp, fallback: mean };
            }
        }
        sharp(mean)
    }

    /// The vertex of a cell of the ring: on the border, and on the surface where that meets the border in the cell.
    fn on_border(&mut self, field: &dyn Field, cell: &Aabb, hits: &[Hit], smooth: Vertex) -> Vertex {
        let on_surface: Vec<DVec3> = hits.iter().filter(|hit| !hit.is_cap).map(|hit| hit.position).collect();
        let clamped = |p: DVec3| p.clamp(cell.min, cell.max);
        let cap = Vertex { position: clamped(smooth.position), kind: Kind::Cap, ..smooth };
        if on_surface.is_empty() {
            return Vertex { fallback: cap.position, ..cap };
        }
        let mean = clamped(on_surface.iter().sum::<DVec3>() / on_surface.len() as f64);
        let free = DVec3::select(cell.size().cmpgt(DVec3::ZERO), DVec3::ONE, DVec3::ZERO);
        let size = cell.size().max_element();
        let settled = self.settle(field, mean, free, size).filter(|(p, _)| clamped(*p) == *p);
        Vertex {
            position: settled.map_or(mean, |(p, _)| p),
            normal: DVec3::ZERO,
            kind: Kind::Sharp,
            fallback: mean,
        }
    }

    /// The surface near a point by Newton's method along the free axes, with its normal.
    fn settle(&mut self, field: &dyn Field, start: DVec3, free: DVec3, size: f64) -> Option<(DVec3, DVec3)> {
        let mut at = start;
        for _ in 0..2 * STEPS {
            self.gradients += 1;
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
            if step.length() <= ON_SURFACE * size {
                return Some((at, unit(-gradient)?));
            }
        }
        None
    }

    /// Moves the vertices of smooth cells onto the surface, together.
    fn settle_smooth(&mut self, field: &dyn Field, spacing: DVec3) {
        let size = spacing.min_element();
        let hints: Vec<DVec3> = self.vertices.iter().map(|v| v.normal).collect();
        let mut moving: Vec<usize> =
            (0..self.vertices.len()).filter(|&v| self.vertices[v].kind == Kind::Smooth).collect();
        let mut positions = Vec::with_capacity(moving.len());
        for _ in 0..STEPS {
            positions.clear();
            positions.extend(moving.iter().map(|&v| self.vertices[v].position));
            self.gradients += positions.len() as u64;
            let mut found = gradients(field, &positions).into_iter();
            moving.retain(|&v| {
                let Some((omega, gradient)) = found.next() else { return false };
                let vertex = &mut self.vertices[v];
                let step = gradient * (omega / gradient.length_squared());
                vertex.position -= step;
                vertex.normal = unit(-gradient).unwrap_or(DVec3::ZERO);
                step.length() > ON_SURFACE * size
            });
        }
        for (vertex, hint) in self.vertices.iter_mut().zip(hints).filter(|(v, _)| v.kind == Kind::Smooth) {
            let is_near = vertex.position.distance(vertex.fallback) <= SLIDE * size;
            if !is_near || vertex.normal.dot(hint) < NEARLY_FLAT {
                let found = project::along(field, vertex.fallback, hint, SLIDE * size, &mut self.gradients);
                vertex.position = found.map_or(vertex.fallback, |face| face.point);
                vertex.normal = found.map_or(DVec3::ZERO, |face| face.normal);
                vertex.kind = Kind::Sharp;
            }
        }
    }
}

/// Up to three faces that the hits lie on: the two that differ most, and one that differs from both.
fn faces(hits: &[Hit]) -> Vec<Face> {
    let faces: Vec<Face> = hits
        .iter()
        .filter(|hit| hit.normal != DVec3::ZERO)
        .map(|hit| Face { point: hit.position, normal: hit.normal })
        .collect();
    let pairs = (0..faces.len()).flat_map(|i| (0..i).map(move |j| (j, i)));
    let cosine = |(i, j): &(usize, usize)| faces[*i].normal.dot(faces[*j].normal);
    let Some((a, b)) = pairs.min_by(|p, q| cosine(p).total_cmp(&cosine(q))) else { return Vec::new() };
    let likeness = |face: &&Face| face.normal.dot(faces[a].normal).max(face.normal.dot(faces[b].normal));
    let third = faces.iter().min_by(|p, q| likeness(p).total_cmp(&likeness(q)));
    let mut found = vec![faces[a], faces[b]];
    found.extend(third.filter(|face| likeness(face) < NEW_FACE));
    found
}
