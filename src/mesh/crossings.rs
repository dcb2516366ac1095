//! Where the surface crosses the grid's edges. Marching cubes and dual contouring both begin with this.
//!
//! Ranges find the bricks that may hold the surface. Signs at their nodes show the crossed edges, which are
//! numbered brick by brick. A root search puts a point of ω = 0 on each.
//!
//! Invariant: bricks and tasks depend on the grid and the field alone, never on the number of threads, and
//! numbers follow the order of bricks.

use std::{
    ops::Range,
    sync::atomic::{AtomicUsize, Ordering},
};

use glam::DVec3;
use rayon::prelude::*;

use super::{
    MeshError, Watch,
    collapse::AtNode,
    prune::{Bricks, Lattice},
    roots::{AxisEdges, RootFinder},
    signs::{Around, Brick, SignSampler, Signs},
};
use crate::field::Field;

/// Near bricks in a task. They have some thousand vertices, whose coordinates stay in the nearer caches.
pub(super) const BRICKS_PER_TASK: usize = 16;

/// A part of the work, and the progress that it reports.
pub(super) struct ProgressPart<'a> {
    tasks: usize,
    done: AtomicUsize,
    /// The shares of all work that are done before this part and after it.
    shares: Range<f64>,
    watch: &'a dyn Watch,
}

impl<'a> ProgressPart<'a> {
    /// A part of the work in which [`Self::run`] will be called `tasks` times.
    pub(super) fn new(tasks: usize, shares: Range<f64>, watch: &'a dyn Watch) -> Self {
        Self { tasks, done: AtomicUsize::new(0), shares, watch }
    }

    /// Does a task, unless the work is to end, and reports that it is done.
    ///
    /// # Errors
    /// Those of the task, and [`MeshError::Ended`].
    pub(super) fn run<R>(&self, task: impl FnOnce() -> Result<R, MeshError>) -> Result<R, MeshError> {
        ended(self.watch)?;
        let found = task()?;
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        let share = done as f64 / self.tasks as f64;
        self.watch.progress(self.shares.start + (self.shares.end - self.shares.start) * share);
        Ok(found)
    }
}

/// # Errors
/// [`MeshError::Ended`] if the work is to end.
pub(super) fn ended(watch: &dyn Watch) -> Result<(), MeshError> {
    if watch.is_over() { Err(MeshError::Ended) } else { Ok(()) }
}

/// Samples the signs at the nodes of all near bricks. Adds to the number of evaluations.
///
/// # Errors
/// [`MeshError::NotANumber`] at the first NaN, and [`MeshError::Ended`].
pub(super) fn sample(
    field: &dyn Field,
    lattice: &Lattice,
    bricks: &Bricks,
    evaluations: &mut u64,
    part: &ProgressPart<'_>,
) -> Result<Vec<Signs>, MeshError> {
    let mut signs = vec![Signs::default(); bricks.near.len()];
    let tasks = signs.par_chunks_mut(BRICKS_PER_TASK).zip(bricks.near.par_chunks(BRICKS_PER_TASK));
    let counts: Vec<Result<u64, MeshError>> = tasks
        .map_init(SignSampler::default, |samples, (signs, bricks)| {
            part.run(|| {
                let mut count = 0;
                for (signs, brick) in signs.iter_mut().zip(bricks) {
                    *signs = samples.take(field, lattice, brick, &mut count)?;
                }
                Ok(count)
            })
        })
        .collect();
    for count in counts {
        *evaluations += count?;
    }
    Ok(signs)
}

/// The crossed bricks of a task, in order, and what a meshing method keeps for each.
pub(super) struct Task<T> {
    pub bricks: Vec<Brick>,
    pub kept: Vec<T>,
    /// The number of the first vertex, and the number of vertices.
    pub first: usize,
    pub vertices: usize,
}

/// All bricks with crossed cells, grouped by the tasks that found them.
pub(super) struct Crossed<T> {
    pub tasks: Vec<Task<T>>,
    /// For each near brick its place among the bricks of its task, or [`Self::NONE`].
    places: Vec<u8>,
    pub vertices: usize,
}

impl<T: Send> Crossed<T> {
    const NONE: u8 = u8::MAX;

    /// Finds the crossed edges of all near bricks and numbers their vertices. `look` gives what to keep of
    /// each crossed brick, and may add inner vertices to the brick.
    pub(super) fn number(
        near: &Bricks,
        signs: &[Signs],
        look: impl Fn(&mut Brick, &Around) -> T + Sync,
    ) -> Self {
        let mut places = vec![Self::NONE; near.near.len()];
        let mut tasks: Vec<Task<T>> = places
            .par_chunks_mut(BRICKS_PER_TASK)
            .enumerate()
            .map(|(task, places)| {
                let mut found = Task { bricks: Vec::new(), kept: Vec::new(), first: 0, vertices: 0 };
                for (i, place) in places.iter_mut().enumerate() {
                    let mut brick = Brick::new(near, signs, task * BRICKS_PER_TASK + i);
                    let around = brick.around(signs);
                    if around.is_crossed() {
                        *place = found.bricks.len() as u8;
                        found.kept.push(look(&mut brick, &around));
                        found.vertices += brick.vertices();
                        found.bricks.push(brick);
                    }
                }
                found
            })
            .collect();
        let mut vertices = 0;
        for task in &mut tasks {
            task.first = vertices;
            for brick in &mut task.bricks {
                // wraps only if there are too many vertices, which is an error before the numbers are used
                brick.first = vertices as u32;
                vertices += brick.vertices();
            }
        }
        Self { tasks, places, vertices }
    }
}

impl<T> Crossed<T> {
    /// The near brick of a number; `None` if it is not crossed.
    pub(super) fn get(&self, number: u32) -> Option<&Brick> {
        let number = number as usize;
        self.tasks[number / BRICKS_PER_TASK].bricks.get(usize::from(self.places[number]))
    }
}

/// Cuts a slice into parts of the given lengths.
pub(super) fn parts<X>(mut whole: &mut [X], lengths: impl Iterator<Item = usize>) -> Vec<&mut [X]> {
    lengths.map(|length| whole.split_off_mut(..length).unwrap_or_default()).collect()
}

/// A vertex on the border, where the solid leaves the grid along an edge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cap {
    pub vertex: u32,
    /// The unit vector along that edge, out of the grid.
    pub outward: DVec3,
}

/// What the edges of a task give besides the positions of their vertices.
#[derive(Debug, Default)]
pub(super) struct OnEdges {
    /// Ascending.
    pub caps: Vec<Cap>,
    pub at_nodes: Vec<AtNode>,
    pub evaluations: u64,
}

/// Memory that a thread keeps from task to task.
#[derive(Default)]
pub(super) struct EdgeScratch {
    /// Crossed edges by axis, without those that leave the grid.
    edges: [AxisEdges; 3],
    /// For each of these edges its vertex and its low end.
    ends: [Vec<(u32, [usize; 3])>; 3],
    roots: Vec<f64>,
    finder: RootFinder,
}

impl<T> Task<T> {
    /// Puts a vertex on each crossed edge: at ω = 0, or at the border if the edge leaves the grid.
    /// `positions` are those of the task's vertices. The positions of inner vertices are not changed.
    ///
    /// # Errors
    /// [`MeshError::NotANumber`] at the first NaN.
    pub(super) fn place_on_edges(
        &self,
        field: &dyn Field,
        lattice: &Lattice,
        positions: &mut [DVec3],
        scratch: &mut EdgeScratch,
    ) -> Result<OnEdges, MeshError> {
        let EdgeScratch { edges, ends, roots, finder } = scratch;
        edges.iter_mut().for_each(AxisEdges::clear);
        ends.iter_mut().for_each(Vec::clear);
        let mut found = OnEdges::default();
        let first = self.first as u32;
        for brick in &self.bricks {
            let mut vertex = brick.first;
            brick.for_each_edge(|axis, node| {
                let low = [brick.low[0] + node[0], brick.low[1] + node[1], brick.low[2] + node[2]];
                let mut high = low;
                high[axis] += 1;
                let position = lattice.position(low);
                let leaves_below = lattice.is_ring(axis, low[axis]);
                if leaves_below || lattice.is_ring(axis, high[axis]) {
                    // the end that lies in the grid
                    let node = lattice.key(if leaves_below { high } else { low });
                    let outward = if leaves_below { -DVec3::AXES[axis] } else { DVec3::AXES[axis] };
                    positions[(vertex - first) as usize] = position;
                    found.caps.push(Cap { vertex, outward });
                    found.at_nodes.push(AtNode { node, vertex });
                } else {
                    edges[axis].low.push(position[axis]);
                    edges[axis].high.push(lattice.coordinate(axis, high[axis]));
                    edges[axis].across[0].push(position[(axis + 1) % 3]);
                    edges[axis].across[1].push(position[(axis + 2) % 3]);
                    ends[axis].push((vertex, low));
                }
                vertex += 1;
            });
        }
        for (axis, edges) in edges.iter().enumerate() {
            roots.clear();
            found.evaluations += finder.solve(field, axis, edges, roots)?;
            for (i, (&root, &(vertex, low))) in roots.iter().zip(&ends[axis]).enumerate() {
                let position = &mut positions[(vertex - first) as usize];
                position[axis] = root;
                position[(axis + 1) % 3] = edges.across[0][i];
                position[(axis + 2) % 3] = edges.across[1][i];
                // a root may lie on either end
                let mut node = low;
                node[axis] += usize::from(root == edges.high[i]);
                if root == edges.low[i] || root == edges.high[i] {
                    found.at_nodes.push(AtNode { node: lattice.key(node), vertex });
                }
            }
        }
        Ok(found)
    }
}
