//! Calls into generated code: the only place that turns an address into a function.
//!
//! Everything unsafe about a call is checked here first: the number of outputs, the lengths of the columns.

use crate::codegen::{self, Code, CodegenError, Form, Forms, Precision, Request, Shape};
use crate::ir::{Graph, Interpreter, Node, Real};

use glam::DVec3;

use super::programs::{Compiled, Programs};
use crate::geom::Aabb;
use crate::interval::Interval;

/// A type that programs exist for: `f32` or `f64`.
pub trait Lane: Real + Default {
    /// Which of the two it is.
    const PRECISION: Precision;

    #[doc(hidden)]
    fn compiled(programs: &Programs) -> &Compiled<Self>;

    #[doc(hidden)]
    fn interpret(interpreter: &Interpreter, point: [Self; 3], out: &mut [Self]);
}

impl Lane for f32 {
    const PRECISION: Precision = Precision::F32;

    #[inline]
    fn compiled(programs: &Programs) -> &Compiled<Self> {
        &programs.single
    }

    fn interpret(interpreter: &Interpreter, point: [Self; 3], out: &mut [Self]) {
        interpreter.eval_f32(point, out);
    }
}

impl Lane for f64 {
    const PRECISION: Precision = Precision::F64;

    #[inline]
    fn compiled(programs: &Programs) -> &Compiled<Self> {
        &programs.double
    }

    fn interpret(interpreter: &Interpreter, point: [Self; 3], out: &mut [Self]) {
        interpreter.eval_f64(point, out);
    }
}

/// The largest number of outputs of a program: distance, normal and curvature.
const MAX_OUTPUTS: usize = 5;

/// Points in one vector, at most.
const MAX_LANES: usize = 4;

/// A compiled program for one point.
#[derive(Debug)]
pub struct PointProgram<T> {
    code: Code,
    lane: std::marker::PhantomData<T>,
}

impl<T: Lane> PointProgram<T> {
    /// # Errors
    /// As for [`codegen::compile`].
    pub fn compile(graph: &Graph, outputs: &[Node], forms: &Forms) -> Result<Self, CodegenError> {
        let request = Request {
            graph,
            outputs,
            precision: T::PRECISION,
            shape: Shape::Point,
            forms,
            parameters: false,
        };
        Ok(Self { code: codegen::compile(request)?, lane: std::marker::PhantomData })
    }

    /// All outputs at a point, in the order in which they were asked for.
    ///
    /// # Panics
    /// If `out` is not as long as the program's outputs.
    #[inline]
    pub fn call(&self, [x, y, z]: [T; 3], out: &mut [T]) {
        assert_eq!(out.len(), self.code.outputs, "outputs of the program");
        type Entry<T> = unsafe extern "C" fn(T, T, T, *mut T);
        // SAFETY: `compile` asked for a point program of this precision, whose entry has this signature, and
        // `self.code` keeps it mapped while it runs.
        let entry = unsafe { std::mem::transmute::<*const u8, Entry<T>>(self.code.entry()) };
        // SAFETY: the program writes `outputs` numbers to `out`, and its length was checked above.
        unsafe { entry(x, y, z, out.as_mut_ptr()) }
    }

    /// Bytes of machine code.
    pub fn size(&self) -> usize {
        self.code.size
    }
}

/// A compiled program for many points.
#[derive(Debug)]
pub struct BatchProgram<T> {
    code: Code,
    lane: std::marker::PhantomData<T>,
}

impl<T: Lane> BatchProgram<T> {
    /// # Errors
    /// As for [`codegen::compile`].
    pub fn compile(graph: &Graph, outputs: &[Node], forms: &Forms) -> Result<Self, CodegenError> {
        let request = Request {
            graph,
            outputs,
            precision: T::PRECISION,
            shape: Shape::Batch,
            forms,
            parameters: false,
        };
        Ok(Self { code: codegen::compile(request)?, lane: std::marker::PhantomData })
    }

    /// All outputs at many points: whole blocks straight from and to the caller's columns, the rest through one
    /// padded block on the stack.
    ///
    /// # Panics
    /// If the columns differ in length or there are not as many output columns as outputs.
    pub fn call<const N: usize>(&self, points: [&[T]; 3], mut out: [&mut [T]; N]) {
        let count = points[0].len();
        assert_eq!(N, self.code.outputs, "outputs of the program");
        assert!(
            points.iter().all(|c| c.len() == count) && out.iter().all(|c| c.len() == count),
            "column lengths"
        );
        let lanes = T::PRECISION.lanes();
        let whole = count / lanes * lanes;
        if whole > 0 {
            self.blocks(points.map(<[T]>::as_ptr), out.each_mut().map(|c| c.as_mut_ptr()), whole / lanes);
        }
        if whole < count {
            let mut inputs = [[T::default(); MAX_LANES]; 3];
            let mut outputs = [[T::default(); MAX_LANES]; N];
            for (padded, column) in inputs.iter_mut().zip(points) {
                padded[..count - whole].copy_from_slice(&column[whole..]);
            }
            self.blocks(inputs.each_ref().map(|c| c.as_ptr()), outputs.each_mut().map(|c| c.as_mut_ptr()), 1);
            for (column, padded) in out.iter_mut().zip(outputs) {
                column[whole..].copy_from_slice(&padded[..count - whole]);
            }
        }
    }

    /// The columns hold at least `blocks` whole blocks: both callers above have seen to it.
    fn blocks<const N: usize>(&self, points: [*const T; 3], out: [*mut T; N], blocks: usize) {
        let mut columns = [std::ptr::null_mut::<T>(); 3 + MAX_OUTPUTS];
        for (column, point) in columns.iter_mut().zip(points) {
            *column = point.cast_mut(); // the program only reads the first three
        }
        columns[3..3 + N].copy_from_slice(&out);
        type Entry<T> = unsafe extern "C" fn(*const *mut T, usize);
        // SAFETY: `compile` asked for a batch program of this precision, whose entry has this signature, and
        // `self.code` keeps it mapped while it runs.
        let entry = unsafe { std::mem::transmute::<*const u8, Entry<T>>(self.code.entry()) };
        // SAFETY: the program reads `blocks` blocks of the first three columns and writes as many of the next N,
        // all of them long enough; it needs no alignment; outputs are exclusive borrows, so nothing overlaps.
        unsafe { entry(columns.as_ptr(), blocks) }
    }

    /// Bytes of machine code.
    pub fn size(&self) -> usize {
        self.code.size
    }
}

/// A compiled range program.
#[derive(Debug)]
pub struct RangeProgram {
    code: Code,
}

impl RangeProgram {
    /// # Errors
    /// As for [`codegen::compile`]; [`CodegenError::Unsupported`] for graphs that only the interpreter knows.
    pub fn compile(graph: &Graph, root: Node) -> Result<Self, CodegenError> {
        if !codegen::range_is_supported(graph, root) {
            return Err(CodegenError::Unsupported("ranges of this formula".into()));
        }
        let (precision, shape, forms) = (Precision::F64, Shape::Range, &Forms::all(Form::Scaled));
        let request = Request { graph, outputs: &[root], precision, shape, forms, parameters: false };
        Ok(Self { code: codegen::compile(request)? })
    }

    /// The range over a box; nothing if the box reaches too far out.
    #[inline]
    pub fn call(&self, over: &Aabb) -> Option<Interval> {
        let reach = codegen::RANGE_REACH;
        let near = over.min.cmpge(DVec3::splat(-reach)).all() && over.max.cmple(DVec3::splat(reach)).all();
        let ordered = over.min.cmple(over.max).all();
        if !(near && ordered) {
            return None; // NaN included
        }
        let (min, max) = (over.min, over.max);
        let input = [min.x, max.x, min.y, max.y, min.z, max.z];
        let mut out = [0.0; 2];
        type Entry = unsafe extern "C" fn(*const f64, *mut f64);
        // SAFETY: `compile` asked for a range program, whose entry has this signature, and `self.code` keeps it
        // mapped while it runs.
        let entry = unsafe { std::mem::transmute::<*const u8, Entry>(self.code.entry()) };
        // SAFETY: the program reads six numbers and writes two.
        unsafe { entry(input.as_ptr(), out.as_mut_ptr()) };
        Some(Interval::new(out[0], out[1]))
    }
}

/// A program of leaves that differ in their constants alone: for one point and for many, in `f64`.
#[derive(Debug)]
pub struct LeafProgram {
    point: Code,
    batch: Code,
    parameters: usize,
}

impl LeafProgram {
    /// # Errors
    /// As for [`codegen::compile`].
    pub fn compile(graph: &Graph, outputs: &[Node], parameters: usize) -> Result<Self, CodegenError> {
        let compile = |shape| {
            let (precision, forms) = (Precision::F64, &Forms::all(Form::Stable));
            codegen::compile(Request { graph, outputs, precision, shape, forms, parameters: true })
        };
        Ok(Self { point: compile(Shape::Point)?, batch: compile(Shape::Batch)?, parameters })
    }

    /// All outputs at a point.
    ///
    /// # Panics
    /// If there are not as many outputs or parameters as the program has.
    #[inline]
    pub fn call(&self, p: DVec3, parameters: &[f64], out: &mut [f64]) {
        assert_eq!((out.len(), parameters.len()), (self.point.outputs, self.parameters), "leaf program");
        type Entry = unsafe extern "C" fn(f64, f64, f64, *mut f64, *const f64);
        // SAFETY: `compile` asked for a point program with parameters in `f64`, whose entry has this signature, and
        // `self.point` keeps it mapped while it runs.
        let entry = unsafe { std::mem::transmute::<*const u8, Entry>(self.point.entry()) };
        // SAFETY: the program writes the outputs and reads the parameters; both lengths were checked above.
        unsafe { entry(p.x, p.y, p.z, out.as_mut_ptr(), parameters.as_ptr()) }
    }

    /// The one output at many points: whole blocks, then the rest through one padded block.
    ///
    /// # Panics
    /// If the columns differ in length, or the program has several outputs or other parameters.
    pub fn call_many(&self, points: [&[f64]; 3], parameters: &[f64], out: &mut [f64]) {
        let count = out.len();
        assert_eq!((1, parameters.len()), (self.batch.outputs, self.parameters), "leaf program");
        assert!(points.iter().all(|c| c.len() == count), "column lengths");
        const LANES: usize = Precision::F64.lanes();
        let whole = count / LANES * LANES;
        if whole > 0 {
            self.blocks(points.map(<[f64]>::as_ptr), out.as_mut_ptr(), whole / LANES, parameters);
        }
        if whole < count {
            let mut inputs = [[0.0; LANES]; 3];
            let mut output = [0.0; LANES];
            for (padded, column) in inputs.iter_mut().zip(points) {
                padded[..count - whole].copy_from_slice(&column[whole..]);
            }
            self.blocks(inputs.each_ref().map(|c| c.as_ptr()), output.as_mut_ptr(), 1, parameters);
            out[whole..].copy_from_slice(&output[..count - whole]);
        }
    }

    /// The columns hold at least `blocks` whole blocks: both callers above have seen to it.
    fn blocks(&self, [x, y, z]: [*const f64; 3], out: *mut f64, blocks: usize, parameters: &[f64]) {
        // the program only reads the first three
        let columns = [x.cast_mut(), y.cast_mut(), z.cast_mut(), out];
        type Entry = unsafe extern "C" fn(*const *mut f64, usize, *const f64);
        // SAFETY: `compile` asked for a batch program with parameters in `f64`, whose entry has this signature, and
        // `self.batch` keeps it mapped while it runs.
        let entry = unsafe { std::mem::transmute::<*const u8, Entry>(self.batch.entry()) };
        // SAFETY: the program reads `blocks` blocks of three columns and its parameters, whose number was checked,
        // and writes as many blocks to `out`, which is borrowed exclusively.
        unsafe { entry(columns.as_ptr(), blocks, parameters.as_ptr()) }
    }
}
