//! The vertex of a loop: on the surface, and on its crease or corner if the loop encloses one.
//!
//! A loop whose hits face nearly the same way takes the mean of the hits, raised by half the mean height of
//! the hits' tangent planes there. Newton's method moves it onto the surface, together with the others of the
//! task. All other loops are left to `sharp`.
//!
//! Invariant: a vertex lies within [`SLIDE`] of its cell or of the point where it began, and on the border if
//! its cell is in the ring.

use glam::DVec3;
use smallvec::SmallVec;

use super::super::{
    cases::{EDGES, tube},
    crossings::{Crossed, Task},
    normals::{GradientColumns, unit},
    patches::cell_low,
    prune::{BRICK, Lattice},
    signs::{
        Brick, SLOT_OF_EDGE, Signs, VertexTable, crossed_cells, edge_slot, inside_corners, set_positions,
        vertex_table,
    },
};
use super::bends::{self, ASTRAY, Bent};
use super::loops::{CellLoops, LOOPS, Loop, Sheets};
use super::project;
use super::sharp::{self, SLIDE};
use super::vertices::{Hit, Hits, NONE, Rings, Vertex, VertexKind};
use crate::field::Field;
use crate::geom::Aabb;

/// Hits whose normals all lie within this of their mean (the cosine of 10°) belong to a smooth surface.
const NEARLY_FLAT: f64 = 0.985;

/// Maximum number of Newton steps onto a smooth surface.
const STEPS: usize = 4;

/// The step of Newton's method onto a smooth surface, in cells, after which no other is needed. It leaves its
/// square times the curvature per cell, which is below 1/3 in a cell with normals within [`NEARLY_FLAT`].
const LAST_STEP: f64 = 3e-6;

/// The ends of a tunnel lie this far from a face into the cell, as a share of the way to the middle.
const INTO_CELL: f64 = 0.25;

/// The places for the vertices of a task.
pub(super) struct Slots<'a> {
    /// The number of the first vertex.
    pub first: u32,
    pub positions: &'a mut [DVec3],
    pub normals: &'a mut [DVec3],
    pub kinds: &'a mut [VertexKind],
}

/// The results of a task besides its vertices.
#[derive(Default)]
pub(super) struct Placed {
    /// For each vertex that is not smooth, ascending, the point to which it moves if the triangles around it
    /// lie upside down.
    pub fallbacks: Vec<(u32, DVec3)>,
    pub twice: Vec<Twice>,
    /// Second vertices of a cell by hit and first vertex. At the end of a tunnel a cell has two vertices at a
    /// hit: the first is where the loop goes on, the second where it came from.
    pub seconds: Vec<((u32, u32), u32)>,
    /// The triangles of tunnels.
    pub tubes: Vec<[u32; 3]>,
    /// Vertices that share their cell with others.
    pub crowded: Vec<u32>,
    /// Vertices of smooth cells or on the border that lie outside their own cells.
    pub astray: Vec<u32>,
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
pub(super) struct PlacementScratch {
    table: Box<VertexTable>,
    gradients: GradientColumns,
    hits: Vec<Hit>,
    unsmooth: Vec<Unsmooth>,
    /// The extended indices of the low corner of each vertex's cell; [`NONE`] for those of tunnels.
    cells: Vec<[u32; 3]>,
}

impl Default for PlacementScratch {
    fn default() -> Self {
        Self {
            table: vertex_table(),
            gradients: GradientColumns::default(),
            hits: Vec::new(),
            unsmooth: Vec::new(),
            cells: Vec::new(),
        }
    }
}

/// A loop whose hits do not face the same way.
struct Unsmooth {
    /// The extended indices of the cell's low corner.
    low: [usize; 3],
    /// The numbers of the loop's hits.
    numbers: SmallVec<[usize; EDGES]>,
    /// The mean of the hits.
    mean: DVec3,
    /// The place of the vertex.
    place: usize,
}

/// What a task writes.
struct Output<'s, 'm> {
    slots: Slots<'s>,
    scratch: &'m mut PlacementScratch,
    placed: Placed,
}

impl Output<'_, '_> {
    /// Notes that the vertices at these places share a cell.
    fn crowd(&mut self, places: std::ops::Range<usize>) {
        let first = self.slots.first;
        self.placed.crowded.extend(places.map(|place| first + place as u32));
    }
}

/// What all tasks read, and the rings that they fill.
pub(super) struct Placement<'a> {
    pub field: &'a dyn Field,
    pub lattice: &'a Lattice,
    pub signs: &'a [Signs],
    pub crossed: &'a Crossed<Sheets>,
    pub hits: &'a Hits,
    pub rings: &'a Rings,
    /// The side lengths of a cell.
    pub spacing: DVec3,
}

impl Placement<'_> {
    /// Places the vertices of a task's cells.
    pub fn place(&self, task: &Task<Sheets>, slots: Slots<'_>, scratch: &mut PlacementScratch) -> Placed {
        let mut output = Output { slots, scratch, placed: Placed::default() };
        output.scratch.cells.clear();
        output.scratch.cells.resize(output.slots.kinds.len(), [NONE; 3]);
        let mut next = 0;
        for (brick, sheets) in task.bricks.iter().zip(&task.kept) {
            brick.number_vertices(|number| self.crossed.get(number), &mut output.scratch.table);
            let around = brick.around(self.signs);
            let loops = &*LOOPS;
            for z in 0..BRICK {
                let corners = around.corners(z);
                for bit in set_positions(crossed_cells(&corners)) {
                    let of_cell = &loops[usize::from(inside_corners(&corners, bit))];
                    if of_cell.len() > 1 {
                        output.crowd(next..next + of_cell.len());
                    }
                    for around in of_cell {
                        self.add(brick, (z, bit), around, next, &mut output);
                        next += 1;
                    }
                }
            }
            for cell in &sheets.undecided {
                let first = next;
                for (number, of_cell) in cell.loops.iter().enumerate() {
                    if cell.opens(number) {
                        self.add_ring(cell.cell, of_cell, next, &mut output);
                    } else {
                        self.add(brick, cell.cell, of_cell, next, &mut output);
                    }
                    next += cell.vertices(number);
                }
                if next > first + 1 {
                    output.crowd(first..next);
                }
                self.add_tube(cell, first, &mut output);
            }
        }
        self.settle_smooth(&mut output);
        self.place_unsmooth(&mut output);
        let Output { slots, scratch, mut placed } = output;
        placed.fallbacks.sort_unstable_by_key(|&(v, _)| v);
        self.find_astray(&slots, &scratch.cells, &mut placed);
        placed
    }

    /// Notes the vertices that lie outside their cells.
    fn find_astray(&self, slots: &Slots<'_>, cells: &[[u32; 3]], placed: &mut Placed) {
        let places = (slots.first..).zip(&*slots.positions).zip(&*slots.kinds).zip(cells);
        for (((v, p), kind), cell) in places {
            if *kind == VertexKind::Sharp || *cell == [NONE; 3] {
                continue;
            }
            let low = cell.map(|n| n as usize);
            let (min, max) = (self.lattice.position(low), self.lattice.position(low.map(|n| n + 1)));
            let margin = ASTRAY * (max - min);
            if !(p.cmpge(min - margin) & p.cmple(max + margin)).all() {
                placed.astray.push(v);
            }
        }
    }

    /// Adds the vertex of a loop.
    fn add(
        &self,
        brick: &Brick,
        cell: (usize, usize),
        around: &Loop,
        place: usize,
        output: &mut Output<'_, '_>,
    ) {
        let Output { slots, scratch, placed } = output;
        let vertex = slots.first + place as u32;
        let base = edge_slot(0, [cell.1 % BRICK, cell.1 / BRICK, cell.0]);
        let hit = |e: u8| scratch.table[base + SLOT_OF_EDGE[usize::from(e)]];
        let (mut position, mut normal) = (DVec3::ZERO, DVec3::ZERO);
        let mut numbers = [0; EDGES];
        let count = around.edges.len();
        for (&e, number) in around.edges.iter().zip(&mut numbers) {
            *number = hit(e) as usize;
            self.rings.set(*number as u32, e, vertex);
            position += self.hits.positions[*number];
            normal += self.hits.normals[*number];
        }
        let numbers = &numbers[..count];
        for pair in &around.twice {
            let mut segment = pair.map(|i| hit(around.edges[usize::from(i)]));
            segment.sort_unstable();
            placed.twice.push(Twice { segment, vertex });
        }
        let mean = position / count as f64;
        let length = normal.length();
        let normal = normal / length;
        // over a bend the tangent planes of the hits pass as far above the surface as the mean of the hits
        // lies below it
        let (mut least_agreement, mut height) = (f64::INFINITY, 0.0);
        for &number in numbers {
            let of_hit = self.hits.normals[number];
            least_agreement = f64::min(least_agreement, of_hit.dot(normal));
            height += of_hit.dot(self.hits.positions[number] - mean);
        }
        let low = cell_low(brick.low, cell);
        scratch.cells[place] = low.map(|n| n as u32);
        let is_smooth = length > 0.0 && least_agreement > NEARLY_FLAT && !self.is_border(low);
        slots.positions[place] = mean + (0.5 * height / count as f64) * normal;
        slots.normals[place] = normal;
        if !is_smooth {
            let numbers = SmallVec::from_slice(numbers);
            scratch.unsmooth.push(Unsmooth { low, numbers, mean, place });
            slots.kinds[place] = VertexKind::Sharp;
        }
    }

    /// Moves the vertices of loops that are not smooth onto the surface: together where it only bends, and to
    /// its creases and corners, or onto the border, elsewhere.
    fn place_unsmooth(&self, output: &mut Output<'_, '_>) {
        let unsmooth = std::mem::take(&mut output.scratch.unsmooth);
        let Output { slots, scratch, placed } = output;
        let bends: Vec<Option<Bent>> =
            unsmooth.iter().map(|of| self.bent(of, slots.positions[of.place])).collect();
        let known: Vec<Bent> = bends.iter().flatten().cloned().collect();
        let size = self.spacing.min_element();
        let settled = bends::settle(self.field, &known, size, &mut scratch.gradients, &mut placed.gradients);
        let mut settled = settled.into_iter();
        for (of, bend) in unsmooth.iter().zip(bends) {
            match bend.and_then(|_| settled.next()).flatten() {
                Some(bends::Settled { position, normal }) => {
                    // no fallback: with it, meshes of gyroids crossed themselves more often
                    output.slots.set(of.place, Vertex { position, normal, kind: VertexKind::Smooth });
                }
                None => self.move_to_crease(of, output),
            }
        }
        output.scratch.unsmooth = unsmooth;
        output.scratch.unsmooth.clear();
    }

    /// The cell of a loop that is not smooth, if the surface may only bend there.
    fn bent(&self, Unsmooth { low, numbers, .. }: &Unsmooth, start: DVec3) -> Option<Bent> {
        if self.is_border(*low) {
            return None;
        }
        let cell = Aabb::new(self.lattice.position(*low), self.lattice.position(low.map(|n| n + 1)));
        Bent::new(cell, start, numbers.iter().map(|&number| self.hits.get(number as u32)))
    }

    /// Moves the vertex of a loop that is not smooth to a crease or a corner, or onto the border.
    fn move_to_crease(
        &self,
        &Unsmooth { low, ref numbers, mean, place }: &Unsmooth,
        Output { slots, scratch, placed }: &mut Output<'_, '_>,
    ) {
        scratch.hits.clear();
        scratch.hits.extend(numbers.iter().map(|&number| self.hits.get(number as u32)));
        let high = self.lattice.position(low.map(|n| n + 1));
        let cell = Aabb::new(self.lattice.position(low), high);
        let (hits, count) = (&scratch.hits, &mut placed.gradients);
        let (found, fallback) = match cell.size().min_element() > 0.0 {
            true => (sharp::at_crease(self.field, &cell, self.spacing, hits, mean, count), mean),
            false => sharp::on_border(self.field, &cell, hits, mean, count),
        };
        slots.set(place, found);
        placed.fallbacks.push((slots.first + place as u32, fallback));
    }

    /// Adds a vertex for each passage of a tunnel's end through a face. It lies at the passage, a little into
    /// the cell.
    fn add_ring(
        &self,
        cell: (usize, usize),
        around: &Loop,
        place: usize,
        Output { slots, scratch, placed }: &mut Output<'_, '_>,
    ) {
        let base = edge_slot(0, [cell.1 % BRICK, cell.1 / BRICK, cell.0]);
        let n = around.edges.len();
        let hits: Vec<u32> =
            around.edges.iter().map(|&e| scratch.table[base + SLOT_OF_EDGE[usize::from(e)]]).collect();
        let at = |i: usize| self.hits.positions[hits[i % n] as usize];
        let mean = (0..n).map(at).sum::<DVec3>() / n as f64;
        let size = self.spacing.min_element();
        for (i, (&hit, &edge)) in hits.iter().zip(&around.edges).enumerate() {
            let vertex = slots.first + (place + i) as u32;
            self.rings.set(hit, edge, vertex);
            let before = slots.first + (place + (i + n - 1) % n) as u32;
            placed.seconds.push(((hit, vertex), before));
            let start = at(i).midpoint(at(i + 1)).lerp(mean, INTO_CELL);
            let found = project::newton(self.field, start, INTO_CELL * size, &mut placed.gradients);
            let position = found.map_or(start, |face| face.point);
            slots.set(place + i, Vertex { position, normal: DVec3::ZERO, kind: VertexKind::Sharp });
            placed.fallbacks.push((vertex, start));
        }
    }

    /// Joins the rings at both ends of a tunnel. `first` is the place of the cell's first vertex.
    fn add_tube(&self, cell: &CellLoops, first: usize, Output { slots, placed, .. }: &mut Output<'_, '_>) {
        let Some(ends) = cell.tunnel else { return };
        let ring = |end: usize| {
            let before: usize = (0..end).map(|number| cell.vertices(number)).sum();
            first + before..first + before + cell.vertices(end)
        };
        let places: Vec<usize> = ends.into_iter().flat_map(ring).collect();
        let (a, b) = (ring(ends[0]).len(), ring(ends[1]).len());
        // the tube's vertices count as inner ones, because none of its cross edges lies in a face
        let numbers: Vec<usize> = (EDGES..EDGES + a + b).collect();
        // where the vertices began they surely lie in the cell, and they go back there if the tube crosses anything
        let start = |place: &usize| {
            let vertex = slots.first + *place as u32;
            let found = placed.fallbacks.iter().rev().find(|(v, _)| *v == vertex);
            found.map_or(slots.positions[*place], |(_, start)| *start)
        };
        let starts: Vec<DVec3> = places.iter().map(start).collect();
        let around = around_axis(starts.split_at(a));
        let place = |v: usize| around[v - EDGES].to_array();
        let Some((_, triangles)) = tube(&numbers[..a], &numbers[a..], &place) else { return };
        let number = |v: u8| slots.first + places[usize::from(v) - EDGES] as u32;
        placed.tubes.extend(triangles.into_iter().map(|t| t.map(number)));
    }

    /// Whether a cell lies in the ring, where it has no thickness.
    fn is_border(&self, low: [usize; 3]) -> bool {
        (0..3).any(|axis| self.lattice.is_ring(axis, low[axis]) || self.lattice.is_ring(axis, low[axis] + 1))
    }

    /// Moves the vertices of smooth cells onto the surface, together.
    fn settle_smooth(&self, Output { slots, scratch, placed }: &mut Output<'_, '_>) {
        let gradients = &mut scratch.gradients;
        let size = self.spacing.min_element();
        let mut moving: Vec<usize> =
            (0..slots.kinds.len()).filter(|&v| slots.kinds[v] == VertexKind::Smooth).collect();
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
                let slope = squared.sqrt();
                slots.positions[v] -= gradient * (omega / squared);
                let normal = -gradient / slope;
                slots.normals[v] = if normal.is_finite() { normal } else { DVec3::ZERO };
                omega.abs() > project::negligible(LAST_STEP, size, slots.positions[v]) * slope
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
                slots.set(v, Vertex { position, normal, kind: VertexKind::Sharp });
                placed.fallbacks.push((slots.first + v as u32, start));
            }
        }
    }
}

/// The corners of both rings of a tube as they are seen along its axis, both as wide as a unit circle around its
/// middle. Rings that are slanted, or of different widths, then still join corner to corner without a twist.
fn around_axis((a, b): (&[DVec3], &[DVec3])) -> Vec<DVec3> {
    let middle = |ring: &[DVec3]| ring.iter().sum::<DVec3>() / ring.len() as f64;
    let axis = unit(middle(b) - middle(a)).unwrap_or(DVec3::ZERO);
    let flat = |ring: &[DVec3]| {
        let across = |p: &DVec3| (p - middle(ring)).reject_from_normalized(axis);
        let seen: Vec<DVec3> = ring.iter().map(across).collect();
        let width = (seen.iter().map(|p| p.length_squared()).sum::<f64>() / seen.len() as f64).sqrt();
        seen.into_iter().map(move |p| if width > 0.0 { p / width } else { p })
    };
    flat(a).chain(flat(b)).collect()
}

impl Slots<'_> {
    fn set(&mut self, place: usize, vertex: Vertex) {
        self.positions[place] = vertex.position;
        self.normals[place] = vertex.normal;
        self.kinds[place] = vertex.kind;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rings of a tunnel through a cell of a gyroid, one of them far to one side of the other. With the shortest
    /// cross edges two of its triangles would cross.
    #[test]
    fn a_tube_between_unlike_rings_is_not_twisted() {
        let ring = |corners: [[f64; 3]; 3]| corners.map(DVec3::from_array);
        let a = ring([[10.20, 17.41, 2.40], [17.80, 12.55, 2.40], [10.20, 12.55, -5.16]]);
        let b = ring([[2.54, 6.63, 14.13], [-0.88, 6.63, 13.41], [2.54, -0.95, 13.41]]);
        let around = around_axis((&a, &b));
        let numbers: Vec<usize> = (EDGES..EDGES + 6).collect();
        let (_, triangles) = tube(&numbers[..3], &numbers[3..], &|v| around[v - EDGES].to_array()).unwrap();
        let mut cross_edges: Vec<[usize; 2]> = triangles
            .iter()
            .flat_map(|t| {
                let t = t.map(|v| usize::from(v) - EDGES);
                let (near, far): (Vec<usize>, Vec<usize>) = t.into_iter().partition(|v| *v < 3);
                near.into_iter().flat_map(move |v| far.clone().into_iter().map(move |w| [v, w]))
            })
            .collect();
        cross_edges.sort_unstable();
        cross_edges.dedup();
        assert_eq!(cross_edges, [[0, 3], [0, 4], [1, 3], [1, 5], [2, 4], [2, 5]]);
    }
}
