//! Many points at a time, step by step over blocks of columns that stay in the first-level cache.
//!
//! A program is a list of steps (see [`plan`]): pieces of arithmetic as machine code, R₀ as loops over columns in the
//! widest vectors there are (see [`junctions`]). Against one loop with everything in it this has twice to three times
//! the throughput of roots and divisions on processors with wide vectors, no chain of dependent operations in deep
//! folds, no spilled registers, and code whose size is that of the different shapes, not of the leaves.
//!
//! Invariant: the same bits as the interpreter and the programs for one point, whatever the number of points; except in
//! the guarded form, whose choice depends on the points that are looked at together.

mod junctions;
mod plan;

use super::compiled::{Lane, SegmentProgram};
use crate::codegen::{CodegenError, Forms};
use crate::ir::{Graph, Node};
pub use junctions::Wide;
use junctions::{Kernel, WeightedKernel};
pub use plan::Place;
use plan::{Operation, Plan, Step};

/// Columns of a block take this many bytes together, as long as a block has [`SHORTEST`] points: most of a first-level
/// data cache of 32 KiB.
const CACHED_BYTES: usize = 24 << 10;

/// Points of a block, at least and at most; a multiple of every vector's lanes.
const SHORTEST: usize = 128;
const LONGEST: usize = 256;

/// A rest of points is filled up to a multiple of this: the widest vector of `f32`.
const PADDING: usize = 16;

/// The most columns that a program writes to: see `compiled`.
const MAX_OUTPUTS: usize = 5;

/// A program over blocks.
pub struct BlockProgram<T> {
    steps: Vec<Run<T>>,
    pieces: Vec<SegmentProgram<T>>,
    parameters: Vec<T>,
    columns: usize,
    block: usize,
    outputs: usize,
}

/// A step with its code.
enum Run<T> {
    Arithmetic { piece: usize, parameters: std::ops::Range<usize>, reads: Vec<Place>, writes: Vec<Place> },
    Junction { kernel: Kernel<T>, operands: [Place; 2], value: Place },
    Weighted { kernel: WeightedKernel<T>, operands: [Place; 2], results: [Place; 3] },
    Copy { from: Place, to: Place },
}

/// Working memory of a thread, kept between calls so that none of them allocates.
#[derive(Debug, Default)]
pub struct Scratch<T> {
    pub columns: Vec<T>,
    pub pointers: Vec<*mut T>,
}

/// The columns of one block: the caller's, and those that steps hand on.
pub struct Frame<'a, 'o, T> {
    /// x, y, z of the block's points.
    pub points: [&'a [T]; 3],
    pub outputs: &'a mut [&'o mut [T]],
    /// Numbers that depend on time alone.
    pub uniforms: &'a [T],
    /// Columns of [`Frame::stride`] numbers each.
    pub columns: &'a mut [T],
    pub stride: usize,
    /// For the call of a piece.
    pub pointers: &'a mut Vec<*mut T>,
}

impl<T: Lane> BlockProgram<T> {
    /// Nothing for graphs that one plain loop answers as well.
    ///
    /// # Errors
    /// As for [`crate::codegen::compile`].
    pub fn compile(graph: &Graph, outputs: &[Node], forms: &Forms) -> Result<Option<Self>, CodegenError> {
        let Some(plan) = Plan::new(graph, outputs, forms) else { return Ok(None) };
        let mut steps = Vec::with_capacity(plan.steps.len());
        for step in plan.steps {
            let Some(run) = Run::of(step) else { return Ok(None) };
            steps.push(run);
        }
        let piece = |piece: &plan::Piece| {
            let graph = piece.shape.as_ref().unwrap_or(graph);
            SegmentProgram::compile(graph, &piece.inputs, &piece.outputs, piece.parameters)
        };
        let pieces = plan.pieces.iter().map(piece).collect::<Result<_, _>>()?;
        let parameters = plan.constants.into_iter().map(T::from_f64).collect();
        let fitting = CACHED_BYTES / (size_of::<T>() * plan.columns.max(1));
        let block = (fitting / SHORTEST * SHORTEST).clamp(SHORTEST, LONGEST);
        let (columns, outputs) = (plan.columns, outputs.len());
        Ok(Some(Self { steps, pieces, parameters, columns, block, outputs }))
    }

    /// All outputs at many points, which may be any number.
    ///
    /// # Panics
    /// If the columns differ in length or there are not as many output columns as outputs.
    pub fn call<const N: usize>(&self, points: [&[T]; 3], uniforms: &[T], mut out: [&mut [T]; N]) {
        let count = points[0].len();
        assert_eq!(N, self.outputs, "outputs of the program");
        assert!(
            points.iter().all(|c| c.len() == count) && out.iter().all(|c| c.len() == count),
            "column lengths"
        );
        let whole = count / PADDING * PADDING;
        T::with_scratch(|scratch| {
            self.make_room(scratch);
            for at in (0..whole).step_by(self.block) {
                let range = at..(at + self.block).min(whole);
                let mut outputs = out.each_mut().map(|column| &mut column[range.clone()]);
                let points = points.map(|column| &column[range.clone()]);
                self.block(points, uniforms, &mut outputs, scratch);
            }
            if whole < count {
                let mut inputs = [[T::default(); PADDING]; 3];
                let mut results = [[T::default(); PADDING]; N];
                for (padded, column) in inputs.iter_mut().zip(points) {
                    padded[..count - whole].copy_from_slice(&column[whole..]);
                }
                let mut outputs = results.each_mut().map(<[T; PADDING]>::as_mut_slice);
                let inputs = inputs.each_ref().map(<[T; PADDING]>::as_slice);
                self.block(inputs, uniforms, &mut outputs, scratch);
                for (column, padded) in out.iter_mut().zip(results) {
                    column[whole..].copy_from_slice(&padded[..count - whole]);
                }
            }
        });
    }

    /// All outputs at one point: for graphs so large that a program for single points would take too long to make.
    pub fn call_one(&self, point: [T; 3], uniforms: &[T], out: &mut [T]) {
        assert_eq!(out.len(), self.outputs, "outputs of the program");
        let inputs = point.map(|coordinate| [coordinate; PADDING]);
        let mut results = [[T::default(); PADDING]; MAX_OUTPUTS];
        let mut outputs = results.each_mut().map(<[T; PADDING]>::as_mut_slice);
        T::with_scratch(|scratch| {
            self.make_room(scratch);
            let outputs = &mut outputs[..out.len()];
            self.block(inputs.each_ref().map(<[T; PADDING]>::as_slice), uniforms, outputs, scratch);
        });
        for (out, column) in out.iter_mut().zip(results) {
            *out = column[0];
        }
    }

    /// Never less than was there: programs of different sizes take turns.
    fn make_room(&self, scratch: &mut Scratch<T>) {
        let needed = self.columns * self.block;
        if scratch.columns.len() < needed {
            scratch.columns.resize(needed, T::default());
        }
    }

    fn block(&self, points: [&[T]; 3], uniforms: &[T], outputs: &mut [&mut [T]], scratch: &mut Scratch<T>) {
        let Scratch { columns, pointers } = scratch;
        let mut frame = Frame { points, outputs, uniforms, columns, stride: self.block, pointers };
        for step in &self.steps {
            match step {
                Run::Arithmetic { piece, parameters, reads, writes } => {
                    let parameters = &self.parameters[parameters.clone()];
                    self.pieces[*piece].call(&mut frame, reads, writes, parameters);
                }
                Run::Junction { kernel, operands, value } => frame.junction(*kernel, *operands, *value),
                Run::Weighted { kernel, operands, results } => frame.weighted(*kernel, *operands, *results),
                Run::Copy { from, to } => frame.copy(*from, *to),
            }
        }
    }
}

impl<T: Lane> Run<T> {
    /// Nothing for a junction that there is no loop for.
    fn of(step: Step) -> Option<Self> {
        Some(match step {
            Step::Arithmetic { program: piece, parameters, reads, writes } => {
                Self::Arithmetic { piece, parameters, reads, writes }
            }
            Step::Junction { op, form, operands, value, weights: None } => {
                let kernel = match op {
                    Operation::Binary(op) => T::kernel(op, form)?,
                    Operation::Negate => T::negation(),
                };
                Self::Junction { kernel, operands, value }
            }
            Step::Junction { op, form, operands, value, weights: Some([by_u, by_v]) } => {
                let Operation::Binary(op) = op else { return None };
                let kernel = T::weighted_kernel(op, form)?;
                Self::Weighted { kernel, operands, results: [value, by_u, by_v] }
            }
            Step::Copy { from, to } => Self::Copy { from, to },
        })
    }
}

impl<T: Lane> Frame<'_, '_, T> {
    /// Points of the block.
    pub fn len(&self) -> usize {
        self.points[0].len()
    }

    /// Where a column lies in `columns`. Only results are written to the caller's columns, and nothing is read back
    /// from them.
    fn range(&self, place: Place) -> std::ops::Range<usize> {
        match place {
            Place::Column(column) => {
                let start = column as usize * self.stride;
                start..start + self.len()
            }
            Place::Output(_) => unreachable!("the planner reads no output"),
        }
    }

    fn junction(&mut self, kernel: Kernel<T>, operands: [Place; 2], value: Place) {
        let [u, v] = operands.map(|place| self.range(place));
        match value {
            Place::Output(i) => kernel(&self.columns[u], &self.columns[v], self.outputs[i as usize]),
            Place::Column(_) => {
                let out = self.range(value);
                if u == v {
                    let [u, out] = self.disjoint([u, out]);
                    kernel(u, u, out);
                } else {
                    let [u, v, out] = self.disjoint([u, v, out]);
                    kernel(u, v, out);
                }
            }
        }
    }

    fn weighted(&mut self, kernel: WeightedKernel<T>, operands: [Place; 2], results: [Place; 3]) {
        let ([u, v], [value, by_u, by_v]) =
            (operands.map(|place| self.range(place)), results.map(|place| self.range(place)));
        if u == v {
            let [u, value, by_u, by_v] = self.disjoint([u, value, by_u, by_v]);
            kernel(u, u, [value, by_u, by_v]);
        } else {
            let [u, v, value, by_u, by_v] = self.disjoint([u, v, value, by_u, by_v]);
            kernel(u, v, [value, by_u, by_v]);
        }
    }

    fn copy(&mut self, from: Place, to: Place) {
        let from = self.range(from);
        match to {
            Place::Output(i) => self.outputs[i as usize].copy_from_slice(&self.columns[from]),
            Place::Column(_) => {
                let to = self.range(to);
                self.columns.copy_within(from, to.start);
            }
        }
    }

    fn disjoint<const N: usize>(&mut self, ranges: [std::ops::Range<usize>; N]) -> [&mut [T]; N] {
        match self.columns.get_disjoint_mut(ranges) {
            Ok(columns) => columns,
            Err(_) => unreachable!("the planner gives results columns of their own"),
        }
    }
}
