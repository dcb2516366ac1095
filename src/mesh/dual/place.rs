//! Where the vertex of a loop goes: onto the surface, and onto its crease or corner where the loop encloses one.
//!
//! Loops whose hits face nearly the same way take the mean of the hits, moved onto the surface by Newton's method,
//! all of a brick together. For the others the candidates are tried in turn: the minimiser of the quadratic error if
//! it lies on the surface already (plane faces, tips of cones), the crease of the two or three faces that the hits
//! show, the minimiser moved onto the surface, the mean of the hits.
//!
//! Invariant: a vertex lies within [`SLIDE`] of its cell or of the mean of its hits, on the border if its cell is in the
//! ring.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::super::{
    cases::{EDGES, tube},
    crossings::{Crossed, Task},
    normals::{Gradients, unit},
    patches::cell_low,
    prune::{BRICK, Lattice},
    signs::{
        Brick, SLOT_OF_EDGE, Signs, VertexTable, crossed_cells, edge_slot, inside_corners, set_positions,
        vertex_table,
    },
};
use super::crease::{self, Face};
use super::loops::{CellLoops, LOOPS, Loop, Sheets};
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

/// A step of Newton's method onto a smooth surface that needs no other after it, in cells: what it leaves is the step's
/// square times the curvature per cell, which is below 1/3 in a cell with normals within [`NEARLY_FLAT`].
const LAST_STEP: f64 = 3e-6;

/// How far from a face into its cell the ends of a tunnel lie, as a share of the way to the middle.
const INTO_CELL: f64 = 0.25;

/// A distance from the surface that is none, in cells: plane faces give 1e-15.
const ON_SURFACE: f64 = 1e-11;

/// A vertex of the mesh.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vertex {
    pub position: DVec3,
    /// Outward unit normal; zero on creases and where there is none.
    pub normal: DVec3,
    pub kind: Kind,
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

/// Vertices by their numbers.
#[derive(Default)]
pub(super) struct Vertices {
    pub positions: Vec<DVec3>,
    pub normals: Vec<DVec3>,
    pub kinds: Vec<Kind>,
}

impl Vertices {
    pub fn new(count: usize) -> Self {
        // rayon writes the zeros, so each thread touches memory of its own for the first time
        let zeros = || rayon::iter::repeat_n(DVec3::ZERO, count).collect();
        Self { positions: zeros(), normals: zeros(), kinds: vec![Kind::Smooth; count] }
    }

    pub fn len(&self) -> usize {
        self.positions.len()
    }

    pub fn get(&self, v: u32) -> Vertex {
        let v = v as usize;
        Vertex { position: self.positions[v], normal: self.normals[v], kind: self.kinds[v] }
    }

    pub fn push(&mut self, vertex: Vertex) {
        self.positions.push(vertex.position);
        self.normals.push(vertex.normal);
        self.kinds.push(vertex.kind);
    }
}

/// Where the surface crosses an edge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hit {
    pub position: DVec3,
    /// Outward unit normal; zero where the field has none.
    pub normal: DVec3,
    /// Whether the edge leaves the grid: the hit lies on the border inside the solid.
    pub is_cap: bool,
}

/// Hits by the numbers of their edges.
#[derive(Default)]
pub(super) struct Hits {
    pub positions: Vec<DVec3>,
    pub normals: Vec<DVec3>,
    pub is_cap: Vec<bool>,
}

impl Hits {
    pub fn get(&self, number: u32) -> Hit {
        let i = number as usize;
        Hit { position: self.positions[i], normal: self.normals[i], is_cap: self.is_cap[i] }
    }
}

/// The vertices of the four cells around each crossed edge, by the edge's place in the cell.
pub(super) struct Rings(Vec<[AtomicU32; 4]>);

/// A place without a vertex; only a field whose ranges contradict its values leaves one.
pub(super) const NONE: u32 = u32::MAX;

impl Rings {
    pub fn new(count: usize) -> Self {
        let empty = |_| [const { AtomicU32::new(NONE) }; 4];
        Self((0..count).into_par_iter().map(empty).collect())
    }

    pub fn get(&self, hit: u32) -> [u32; 4] {
        self.0[hit as usize].each_ref().map(|vertex| vertex.load(Ordering::Relaxed))
    }

    /// Each place is written by one cell.
    fn set(&self, hit: u32, edge: u8, vertex: u32) {
        self.0[hit as usize][usize::from(edge & 3)].store(vertex, Ordering::Relaxed);
    }
}

/// Where the vertices of a task go.
pub(super) struct Slots<'a> {
    /// The number of the first.
    pub first: u32,
    pub positions: &'a mut [DVec3],
    pub normals: &'a mut [DVec3],
    pub kinds: &'a mut [Kind],
}

/// What the cells of a task give besides vertices.
#[derive(Default)]
pub(super) struct Placed {
    /// For vertices that are not smooth where they go if the triangles around cannot do with their place, ascending.
    pub fallbacks: Vec<(u32, DVec3)>,
    pub twice: Vec<Twice>,
    /// By hit and vertex: at the end of a tunnel a cell has two vertices at a hit, the one where the loop goes on and
    /// this one, where it came from.
    pub seconds: Vec<((u32, u32), u32)>,
    /// Triangles of tunnels.
    pub tubes: Vec<[u32; 3]>,
    pub gradients: u64,
}

/// A passage of a loop through a face that it passes twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Twice {
    /// The hits where it enters and leaves, ascending.
    pub segment: [u32; 2],
    pub vertex: u32,
}

/// Memory that a thread keeps from task to task.
pub(super) struct Scratch {
    table: Box<VertexTable>,
    gradients: Gradients,
    hits: Vec<Hit>,
}

impl Default for Scratch {
    fn default() -> Self {
        Self { table: vertex_table(), gradients: Gradients::default(), hits: Vec::new() }
    }
}

/// What all tasks read, and the rings that they fill.
pub(super) struct Scene<'a> {
    pub field: &'a dyn Field,
    pub lattice: &'a Lattice,
    pub signs: &'a [Signs],
    pub crossed: &'a Crossed<Sheets>,
    pub hits: &'a Hits,
    pub rings: &'a Rings,
    /// Side lengths of a cell.
    pub spacing: DVec3,
}

impl Scene<'_> {
    /// Places the vertices of a task's cells.
    pub fn place(&self, task: &Task<Sheets>, mut slots: Slots<'_>, scratch: &mut Scratch) -> Placed {
        let mut placed = Placed::default();
        let mut next = 0;
        for (brick, sheets) in task.bricks.iter().zip(&task.kept) {
            brick.number_vertices(|number| self.crossed.get(number), &mut scratch.table);
            let around = brick.around(self.signs);
            let loops = &*LOOPS;
            for z in 0..BRICK {
                let corners = around.corners(z);
                for bit in set_positions(crossed_cells(&corners)) {
                    for of_cell in &loops[usize::from(inside_corners(&corners, bit))] {
                        self.add(brick, (z, bit), of_cell, next, &mut slots, scratch, &mut placed);
                        next += 1;
                    }
                }
            }
            for cell in &sheets.undecided {
                let first = next;
                for (number, of_cell) in cell.loops.iter().enumerate() {
                    if cell.opens(number) {
                        self.add_ring(cell.cell, of_cell, next, &mut slots, scratch, &mut placed);
                    } else {
                        self.add(brick, cell.cell, of_cell, next, &mut slots, scratch, &mut placed);
                    }
                    next += cell.vertices(number);
                }
                self.add_tube(cell, first, &slots, &mut placed);
            }
        }
        self.settle_smooth(&mut slots, &mut scratch.gradients, &mut placed);
        placed
    }

    /// Adds the vertex of a loop.
    #[expect(clippy::too_many_arguments)]
    fn add(
        &self,
        brick: &Brick,
        cell: (usize, usize),
        around: &Loop,
        place: usize,
        slots: &mut Slots<'_>,
        scratch: &mut Scratch,
        placed: &mut Placed,
    ) {
        let vertex = slots.first + place as u32;
        let base = edge_slot(0, [cell.1 % BRICK, cell.1 / BRICK, cell.0]);
        let hit = |e: u8| scratch.table[base + SLOT_OF_EDGE[usize::from(e)]];
        let (mut position, mut normal) = (DVec3::ZERO, DVec3::ZERO);
        for &e in &around.edges {
            let hit = hit(e);
            self.rings.set(hit, e, vertex);
            position += self.hits.positions[hit as usize];
            normal += self.hits.normals[hit as usize];
        }
        for pair in &around.twice {
            let mut segment = pair.map(|i| hit(around.edges[usize::from(i)]));
            segment.sort_unstable();
            placed.twice.push(Twice { segment, vertex });
        }
        let mean = position / around.edges.len() as f64;
        let length = normal.length();
        let is_flat = |e: &u8| self.hits.normals[hit(*e) as usize].dot(normal) > NEARLY_FLAT * length;
        let low = cell_low(brick.low, cell);
        let is_smooth = around.edges.iter().all(is_flat) && !self.is_border(low);
        slots.positions[place] = mean;
        slots.normals[place] = normal / length;
        if !is_smooth {
            scratch.hits.clear();
            scratch.hits.extend(around.edges.iter().map(|&e| self.hits.get(hit(e))));
            let high = self.lattice.position(low.map(|n| n + 1));
            let cell = Aabb::new(self.lattice.position(low), high);
            let found = placed.vertex(self.field, &cell, self.spacing, &scratch.hits, mean);
            slots.set(place, found.0);
            placed.fallbacks.push((vertex, found.1));
        }
    }

    /// Adds a vertex for each passage of a tunnel's end through a face: where the passage is, a little into the cell.
    fn add_ring(
        &self,
        cell: (usize, usize),
        around: &Loop,
        place: usize,
        slots: &mut Slots<'_>,
        scratch: &mut Scratch,
        placed: &mut Placed,
    ) {
        let base = edge_slot(0, [cell.1 % BRICK, cell.1 / BRICK, cell.0]);
        let n = around.edges.len();
        let hits: Vec<u32> =
            around.edges.iter().map(|&e| scratch.table[base + SLOT_OF_EDGE[usize::from(e)]]).collect();
        let at = |i: usize| self.hits.positions[hits[i % n] as usize];
        let mean = (0..n).map(at).sum::<DVec3>() / n as f64;
        let size = self.spacing.min_element();
        for i in 0..n {
            let vertex = slots.first + (place + i) as u32;
            self.rings.set(hits[i], around.edges[i], vertex);
            let before = slots.first + (place + (i + n - 1) % n) as u32;
            placed.seconds.push(((hits[i], vertex), before));
            let start = at(i).midpoint(at(i + 1)).lerp(mean, INTO_CELL);
            let found = project::newton(self.field, start, INTO_CELL * size, &mut placed.gradients);
            let position = found.map_or(start, |face| face.point);
            slots.set(place + i, Vertex { position, normal: DVec3::ZERO, kind: Kind::Sharp });
            placed.fallbacks.push((vertex, start));
        }
    }

    /// Joins the rings at both ends of a tunnel. `first` is the place of the cell's first vertex.
    fn add_tube(&self, cell: &CellLoops, first: usize, slots: &Slots<'_>, placed: &mut Placed) {
        let Some(ends) = cell.tunnel else { return };
        let ring = |end: usize| {
            let before: usize = (0..end).map(|number| cell.vertices(number)).sum();
            first + before..first + before + cell.vertices(end)
        };
        let places: Vec<usize> = ends.into_iter().flat_map(ring).collect();
        let (a, b) = (ring(ends[0]).len(), ring(ends[1]).len());
        // the tube's vertices count as inner ones: none of its cross edges lies in a face
        let numbers: Vec<usize> = (EDGES..EDGES + a + b).collect();
        let low = slots.positions[places[0]];
        let place = |v: usize| ((slots.positions[places[v - EDGES]] - low) / self.spacing).to_array();
        let Some((_, triangles)) = tube(&numbers[..a], &numbers[a..], &place) else { return };
        let number = |v: u8| slots.first + places[usize::from(v) - EDGES] as u32;
        placed.tubes.extend(triangles.into_iter().map(|t| t.map(number)));
    }

    /// Whether a cell lies in the ring, where it has no thickness.
    fn is_border(&self, low: [usize; 3]) -> bool {
        (0..3).any(|axis| self.lattice.is_ring(axis, low[axis]) || self.lattice.is_ring(axis, low[axis] + 1))
    }

    /// Moves the vertices of smooth cells onto the surface, together.
    fn settle_smooth(&self, slots: &mut Slots<'_>, gradients: &mut Gradients, placed: &mut Placed) {
        let size = self.spacing.min_element();
        let mut moving: Vec<usize> =
            (0..slots.kinds.len()).filter(|&v| slots.kinds[v] == Kind::Smooth).collect();
        let hints: Vec<DVec3> = moving.iter().map(|&v| slots.normals[v]).collect();
        let starts: Vec<DVec3> = moving.iter().map(|&v| slots.positions[v]).collect();
        let smooth = moving.clone();
        let mut positions = starts.clone();
        for _ in 0..STEPS {
            placed.gradients += positions.len() as u64;
            let mut found = gradients.at(self.field, &positions);
            moving.retain(|&v| {
                let Some((omega, gradient)) = found.next() else { return false };
                let squared = gradient.length_squared();
                let step = gradient * (omega / squared);
                slots.positions[v] -= step;
                let normal = -gradient / squared.sqrt();
                slots.normals[v] = if normal.is_finite() { normal } else { DVec3::ZERO };
                step.length() > LAST_STEP * size
            });
            drop(found);
            positions.clear();
            positions.extend(moving.iter().map(|&v| slots.positions[v]));
        }
        for ((v, hint), start) in smooth.into_iter().zip(hints).zip(starts) {
            let is_near = slots.positions[v].distance(start) <= SLIDE * size;
            if !is_near || slots.normals[v].dot(hint) < NEARLY_FLAT {
                let found = project::along(self.field, start, hint, SLIDE * size, &mut placed.gradients);
                let (position, normal) = found.map_or((start, DVec3::ZERO), |face| (face.point, face.normal));
                slots.set(v, Vertex { position, normal, kind: Kind::Sharp });
                placed.fallbacks.push((slots.first + v as u32, start));
            }
        }
        placed.fallbacks.sort_unstable_by_key(|&(v, _)| v);
    }
}

impl Slots<'_> {
    fn set(&mut self, place: usize, vertex: Vertex) {
        self.positions[place] = vertex.position;
        self.normals[place] = vertex.normal;
        self.kinds[place] = vertex.kind;
    }
}

impl Placed {
    /// The vertex of a loop that is not smooth or lies on the border, and where it goes otherwise.
    fn vertex(
        &mut self,
        field: &dyn Field,
        cell: &Aabb,
        spacing: DVec3,
        hits: &[Hit],
        mean: DVec3,
    ) -> (Vertex, DVec3) {
        if cell.size().min_element() == 0.0 {
            return self.on_border(field, cell, hits, mean);
        }
        (self.at_crease(field, cell, spacing, hits, mean), mean)
    }

    fn at_crease(
        &mut self,
        field: &dyn Field,
        cell: &Aabb,
        spacing: DVec3,
        hits: &[Hit],
        mean: DVec3,
    ) -> Vertex {
        let size = spacing.min_element();
        let lies_within = |p: DVec3, reach: f64| {
            p.cmpge(cell.min - reach * spacing).all() && p.cmple(cell.max + reach * spacing).all()
        };
        let sharp = |position| Vertex { position, normal: DVec3::ZERO, kind: Kind::Sharp };

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
                return Vertex { position, normal, kind: Kind::Sharp };
            }
        }
        sharp(mean)
    }

    /// The vertex of a cell of the ring: on the border, and on the surface where that meets the border in the cell.
    fn on_border(&mut self, field: &dyn Field, cell: &Aabb, hits: &[Hit], mean: DVec3) -> (Vertex, DVec3) {
        let on_surface: Vec<DVec3> = hits.iter().filter(|hit| !hit.is_cap).map(|hit| hit.position).collect();
        let clamped = |p: DVec3| p.clamp(cell.min, cell.max);
        if on_surface.is_empty() {
            let normal = unit(hits.iter().map(|hit| hit.normal).sum()).unwrap_or(DVec3::ZERO);
            let position = clamped(mean);
            return (Vertex { position, normal, kind: Kind::Cap }, position);
        }
        let mean = clamped(on_surface.iter().sum::<DVec3>() / on_surface.len() as f64);
        let free = DVec3::select(cell.size().cmpgt(DVec3::ZERO), DVec3::ONE, DVec3::ZERO);
        let size = cell.size().max_element();
        let settled = self.settle(field, mean, free, size).filter(|(p, _)| clamped(*p) == *p);
        let position = settled.map_or(mean, |(p, _)| p);
        (Vertex { position, normal: DVec3::ZERO, kind: Kind::Sharp }, mean)
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
