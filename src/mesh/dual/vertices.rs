//! The parts of the mesh of dual contouring: vertices, and the hits on crossed edges around which they lie.
//!
//! Both are stored as columns, because most steps read positions alone or kinds alone.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::DVec3;
use rayon::prelude::*;

/// A vertex of the mesh.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vertex {
    pub position: DVec3,
    /// The outward unit normal; zero on creases and where the field has none.
    pub normal: DVec3,
    pub kind: VertexKind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum VertexKind {
    /// The surface is smooth in the cell.
    Smooth,
    /// The surface may have a crease there.
    Sharp,
    /// On the border, where the solid leaves the grid.
    Cap,
}

/// Vertices by their numbers.
#[derive(Clone, Default)]
pub(super) struct Vertices {
    pub positions: Vec<DVec3>,
    pub normals: Vec<DVec3>,
    pub kinds: Vec<VertexKind>,
    /// Whether triangles at the vertex may cross others: it shares its cell with another vertex, or lies
    /// beside its cell or on a crease.
    pub doubtful: Vec<bool>,
}

impl Vertices {
    pub fn new(count: usize) -> Self {
        // rayon writes the zeros, so each thread touches memory of its own for the first time
        let zeros = || rayon::iter::repeat_n(DVec3::ZERO, count).collect();
        let kinds = vec![VertexKind::Smooth; count];
        Self { positions: zeros(), normals: zeros(), kinds, doubtful: vec![false; count] }
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
        self.doubtful.push(vertex.kind != VertexKind::Smooth);
    }

    pub fn set(&mut self, v: u32, vertex: Vertex) {
        let v = v as usize;
        (self.positions[v], self.normals[v], self.kinds[v]) = (vertex.position, vertex.normal, vertex.kind);
    }

    /// Keeps the first vertices only.
    pub fn truncate(&mut self, count: usize) {
        self.positions.truncate(count);
        self.normals.truncate(count);
        self.kinds.truncate(count);
        self.doubtful.truncate(count);
    }
}

/// The point where the surface crosses an edge of the grid.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hit {
    pub position: DVec3,
    /// The outward unit normal; zero where the field has none.
    pub normal: DVec3,
    /// Whether the edge leaves the grid. The hit then lies on the border inside the solid.
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

/// The vertices of the four cells around each crossed edge, by the place of the edge in the cell.
pub(super) struct Rings(Vec<[AtomicU32; 4]>);

/// A place without a vertex. It stays empty only if the field's ranges contradict its values.
pub(super) const NONE: u32 = u32::MAX;

impl Rings {
    pub fn new(count: usize) -> Self {
        let empty = |_| [const { AtomicU32::new(NONE) }; 4];
        Self((0..count).into_par_iter().map(empty).collect())
    }

    pub fn get(&self, hit: u32) -> [u32; 4] {
        self.0[hit as usize].each_ref().map(|vertex| vertex.load(Ordering::Relaxed))
    }

    /// Sets the vertex of one of the four cells. Each place is written by one cell only.
    pub fn set(&self, hit: u32, edge: u8, vertex: u32) {
        self.0[hit as usize][usize::from(edge & 3)].store(vertex, Ordering::Relaxed);
    }
}
