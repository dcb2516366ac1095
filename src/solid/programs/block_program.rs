//! Many points at a time, step by step over blocks of columns that stay in the first-level cache.
//!
//! A program is a list of steps (see `block_plan`): pieces of arithmetic as machine code, R₀ as loops over
//! columns in the widest vectors there are (see `kernels`). Compared with one loop with everything in it,
//! roots and divisions have two to three times the throughput on processors with wide vectors. There is no
//! chain of dependent operations in deep folds and no spilled register, and the size of the code grows with
//! the number of shapes, not of leaves.
//!
//! Invariant: results have the bits of the interpreter and of the programs for one point, whatever the number
//! of points. The guarded form is the exception, because its choice depends on the points that are looked at
//! together.

use super::block_plan::{BlockPlan, BlockStep, Operation, Piece};
use super::columns::{ColumnPlace, Frame, Scratch};
use super::compiled::{SegmentProgram, padded};
use super::kernels::{Kernel, WeightedKernel};
use super::number::Number;
use crate::codegen::{CodegenError, Forms};
use crate::ir::{Graph, Node, Scalar};

/// Columns of a block take this many bytes together, as long as a block has [`SHORTEST`] points: most of a
/// first-level data cache of 32 KiB.
const CACHED_BYTES: usize = 24 << 10;

/// Least and greatest number of points of a block; a multiple of every vector's lanes.
const SHORTEST: usize = 128;
const LONGEST: usize = 256;

/// A rest of points is filled up to a multiple of this: the widest vector of `f32`.
const PADDING: usize = 16;

/// The most columns that a program writes to: see `compiled`.
const MAX_OUTPUTS: usize = 5;

/// A program over blocks.
pub struct BlockProgram<T> {
    steps: Vec<CompiledStep<T>>,
    pieces: Vec<SegmentProgram<T>>,
    /// With anything in the place of uniforms.
    parameters: Vec<T>,
    uniform_parameters: Vec<UniformParameter>,
    columns: usize,
    block: usize,
    outputs: usize,
}

/// A parameter whose value is a uniform or its negative.
struct UniformParameter {
    place: usize,
    uniform: usize,
    negated: bool,
}

/// A step with its code.
enum CompiledStep<T> {
    Arithmetic {
        piece: usize,
        parameters: std::ops::Range<usize>,
        reads: Vec<ColumnPlace>,
        writes: Vec<ColumnPlace>,
    },
    Junction {
        kernel: Kernel<T>,
        operands: [ColumnPlace; 2],
        value: ColumnPlace,
    },
    Weighted {
        kernel: WeightedKernel<T>,
        operands: [ColumnPlace; 2],
        results: [ColumnPlace; 3],
    },
    Copy {
        from: ColumnPlace,
        to: ColumnPlace,
    },
}

impl<T: Number> BlockProgram<T> {
    /// `None` for graphs that one plain loop answers as well.
    ///
    /// # Errors
    /// Those of [`crate::codegen::compile`].
    pub fn compile(graph: &Graph, outputs: &[Node], forms: &Forms) -> Result<Option<Self>, CodegenError> {
        let Some(plan) = BlockPlan::new(graph, outputs, forms) else { return Ok(None) };
        let mut steps = Vec::with_capacity(plan.steps.len());
        for step in plan.steps {
            let Some(run) = CompiledStep::of(step) else { return Ok(None) };
            steps.push(run);
        }
        let piece = |piece: &Piece| {
            let graph = piece.shape.as_ref().unwrap_or(graph);
            SegmentProgram::compile(graph, &piece.inputs, &piece.outputs, piece.parameters)
        };
        let pieces = plan.pieces.iter().map(piece).collect::<Result<_, _>>()?;
        let mut uniform_parameters = Vec::new();
        let parameters = (0..)
            .zip(plan.numbers)
            .map(|(place, number)| match number {
                Scalar::Constant(value) => T::from_f64(value),
                Scalar::Uniform { index, negated } => {
                    uniform_parameters.push(UniformParameter { place, uniform: index as usize, negated });
                    T::default()
                }
            })
            .collect();
        let fitting = CACHED_BYTES / (size_of::<T>() * plan.columns.max(1));
        let block = (fitting / SHORTEST * SHORTEST).clamp(SHORTEST, LONGEST);
        let (columns, outputs) = (plan.columns, outputs.len());
        Ok(Some(Self { steps, pieces, parameters, uniform_parameters, columns, block, outputs }))
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
            "columns differ in length: x, y, z have {:?} and the answers {:?} numbers",
            points.map(<[_]>::len),
            out.each_ref().map(|column| column.len())
        );
        let whole = count / PADDING * PADDING;
        T::with_scratch(|scratch| {
            self.prepare(uniforms, scratch);
            for at in (0..whole).step_by(self.block) {
                let range = at..(at + self.block).min(whole);
                let mut outputs = out.each_mut().map(|column| &mut column[range.clone()]);
                let points = points.map(|column| &column[range.clone()]);
                self.block(points, uniforms, &mut outputs, scratch);
            }
            if whole < count {
                let inputs: [[T; PADDING]; 3] = points.map(|column| padded(&column[whole..]));
                let mut results = [[T::default(); PADDING]; N];
                let mut outputs = results.each_mut().map(<[T; PADDING]>::as_mut_slice);
                let inputs = inputs.each_ref().map(<[T; PADDING]>::as_slice);
                self.block(inputs, uniforms, &mut outputs, scratch);
                for (column, padded) in out.iter_mut().zip(results) {
                    column[whole..].copy_from_slice(&padded[..count - whole]);
                }
            }
        });
    }

    /// All outputs at one point: for graphs so large that a program for single points would take too long to
    /// make.
    pub fn call_one(&self, point: [T; 3], uniforms: &[T], out: &mut [T]) {
        assert_eq!(out.len(), self.outputs, "outputs of the program");
        let inputs = point.map(|coordinate| [coordinate; PADDING]);
        let mut results = [[T::default(); PADDING]; MAX_OUTPUTS];
        let mut outputs = results.each_mut().map(<[T; PADDING]>::as_mut_slice);
        T::with_scratch(|scratch| {
            self.prepare(uniforms, scratch);
            let outputs = &mut outputs[..out.len()];
            self.block(inputs.each_ref().map(<[T; PADDING]>::as_slice), uniforms, outputs, scratch);
        });
        for (out, column) in out.iter_mut().zip(results) {
            *out = column[0];
        }
    }

    /// Fills in the parameters that are uniforms, and enlarges the columns if need be. They never shrink, because programs
    /// of different sizes take turns.
    fn prepare(&self, uniforms: &[T], scratch: &mut Scratch<T>) {
        let needed = self.columns * self.block;
        if scratch.columns.len() < needed {
            scratch.columns.resize(needed, T::default());
        }
        if !self.uniform_parameters.is_empty() {
            scratch.parameters.clear();
            scratch.parameters.extend_from_slice(&self.parameters);
            for &UniformParameter { place, uniform, negated } in &self.uniform_parameters {
                let value = uniforms[uniform];
                scratch.parameters[place] = if negated { -value } else { value };
            }
        }
    }

    fn block(&self, points: [&[T]; 3], uniforms: &[T], outputs: &mut [&mut [T]], scratch: &mut Scratch<T>) {
        let Scratch { columns, pointers, parameters: filled } = scratch;
        let parameters = if self.uniform_parameters.is_empty() { &self.parameters } else { &*filled };
        let mut frame = Frame { points, outputs, uniforms, columns, stride: self.block, pointers };
        for step in &self.steps {
            match step {
                CompiledStep::Arithmetic { piece, parameters: range, reads, writes } => {
                    self.pieces[*piece].call(&mut frame, reads, writes, &parameters[range.clone()]);
                }
                CompiledStep::Junction { kernel, operands, value } => {
                    frame.junction(*kernel, *operands, *value)
                }
                CompiledStep::Weighted { kernel, operands, results } => {
                    frame.weighted(*kernel, *operands, *results)
                }
                CompiledStep::Copy { from, to } => frame.copy(*from, *to),
            }
        }
    }
}

impl<T: Number> CompiledStep<T> {
    /// `None` for a junction that there is no loop for.
    fn of(step: BlockStep) -> Option<Self> {
        Some(match step {
            BlockStep::Arithmetic { program: piece, parameters, reads, writes } => {
                Self::Arithmetic { piece, parameters, reads, writes }
            }
            BlockStep::Junction { op, form, operands, value, weights: None } => {
                let kernel = match op {
                    Operation::Binary(op) => T::kernel(op, form)?,
                    Operation::Negate => T::negation(),
                };
                Self::Junction { kernel, operands, value }
            }
            BlockStep::Junction { op, form, operands, value, weights: Some([by_u, by_v]) } => {
                let Operation::Binary(op) = op else { return None };
                let kernel = T::weighted_kernel(op, form)?;
                Self::Weighted { kernel, operands, results: [value, by_u, by_v] }
            }
            BlockStep::Copy { from, to } => Self::Copy { from, to },
        })
    }
}
