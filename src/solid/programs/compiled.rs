//! Calls into generated code: the only place that turns an address into a function.
//!
//! Everything unsafe about a call is checked here first: the number of outputs, the lengths of the columns.

use glam::DVec3;

use super::columns::{ColumnPlace, Frame};
use super::number::Number;
use crate::codegen::{self, Code, CodegenError, Form, Forms, Request, Rounding, Shape};
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::{Expr, Graph, Node};
use crate::precision::Precision;

/// The largest number of outputs of a program: distance, normal and curvature.
const MAX_OUTPUTS: usize = 5;

/// Maximum number of points in one vector.
const MAX_LANES: usize = 4;

/// How many uniforms a graph has.
fn uniforms_of(graph: &Graph) -> usize {
    let number = |expr| if let Expr::Uniform(i) = expr { i as usize + 1 } else { 0 };
    graph.exprs().iter().map(|&expr| number(expr)).max().unwrap_or(0)
}

/// Machine code for the outputs of a graph in the numbers `T`, and how many uniforms it reads.
fn compile<T: Number>(
    graph: &Graph,
    outputs: &[Node],
    forms: &Forms,
    shape: Shape,
) -> Result<(Code, usize), CodegenError> {
    let uniforms = uniforms_of(graph);
    let request = Request {
        graph,
        inputs: &[],
        outputs,
        precision: T::PRECISION,
        shape,
        forms,
        parameters: false,
        uniforms: uniforms > 0,
    };
    Ok((codegen::compile(request)?, uniforms))
}

/// A compiled program for one point, in the numbers `T`.
#[derive(Debug)]
pub struct PointProgram<T> {
    code: Code,
    uniforms: usize,
    lane: std::marker::PhantomData<T>,
}

impl<T: Number> PointProgram<T> {
    /// Compiles the outputs of a graph.
    ///
    /// # Errors
    /// Those of [`codegen::compile`].
    pub fn compile(graph: &Graph, outputs: &[Node], forms: &Forms) -> Result<Self, CodegenError> {
        let (code, uniforms) = compile::<T>(graph, outputs, forms, Shape::Point)?;
        Ok(Self { code, uniforms, lane: std::marker::PhantomData })
    }

    /// All outputs at a point, in the order in which they were asked for.
    ///
    /// # Panics
    /// If `out` is not as long as the program's outputs, or `uniforms` not as long as its uniforms.
    #[inline]
    pub fn call(&self, [x, y, z]: [T; 3], uniforms: &[T], out: &mut [T]) {
        assert_eq!(out.len(), self.code.outputs, "outputs of the program");
        assert_eq!(uniforms.len(), self.uniforms, "uniforms of the program");
        type Entry<T> = unsafe extern "C" fn(T, T, T, *mut T, *const T);
        // SAFETY: `compile` asked for a point program of this precision, whose entry has this signature (the
        // last argument is unused without uniforms), and `self.code` keeps it mapped while it runs.
        let entry = unsafe { std::mem::transmute::<*const u8, Entry<T>>(self.code.entry()) };
        // SAFETY: the program writes `outputs` numbers to `out` and reads its uniforms; both lengths were
        // checked.
        unsafe { entry(x, y, z, out.as_mut_ptr(), uniforms.as_ptr()) }
    }
}

/// A block that begins with the given numbers, of which there is at least one. The last of them fills the rest: a point
/// that was asked for costs no more where a table is looked up, and the origin may cost a walk through all of it.
pub(super) fn padded<T: Copy, const LENGTH: usize>(given: &[T]) -> [T; LENGTH] {
    let mut block = [given[given.len() - 1]; LENGTH];
    block[..given.len()].copy_from_slice(given);
    block
}

/// A compiled program for many points given by columns, in the numbers `T`.
#[derive(Debug)]
pub struct BatchProgram<T> {
    code: Code,
    uniforms: usize,
    lane: std::marker::PhantomData<T>,
}

impl<T: Number> BatchProgram<T> {
    /// Compiles the outputs of a graph.
    ///
    /// # Errors
    /// Those of [`codegen::compile`].
    pub fn compile(graph: &Graph, outputs: &[Node], forms: &Forms) -> Result<Self, CodegenError> {
        let (code, uniforms) = compile::<T>(graph, outputs, forms, Shape::Batch)?;
        Ok(Self { code, uniforms, lane: std::marker::PhantomData })
    }

    /// All outputs at many points: whole blocks straight from and to the caller's columns, the rest through
    /// one padded block on the stack.
    ///
    /// # Panics
    /// If the columns differ in length, or if there are not as many output columns or uniforms as the program
    /// has.
    pub fn call<const N: usize>(&self, points: [&[T]; 3], uniforms: &[T], mut out: [&mut [T]; N]) {
        let count = points[0].len();
        assert_eq!(uniforms.len(), self.uniforms, "uniforms of the program");
        assert_eq!(N, self.code.outputs, "outputs of the program");
        assert!(
            points.iter().all(|c| c.len() == count) && out.iter().all(|c| c.len() == count),
            "columns differ in length: x, y, z have {:?} and the answers {:?} numbers",
            points.map(<[_]>::len),
            out.each_ref().map(|column| column.len())
        );
        let lanes = T::PRECISION.lanes();
        let whole = count / lanes * lanes;
        if whole > 0 {
            let columns = points.map(<[T]>::as_ptr);
            self.blocks(columns, uniforms, out.each_mut().map(|c| c.as_mut_ptr()), whole / lanes);
        }
        if whole < count {
            let inputs: [[T; MAX_LANES]; 3] = points.map(|column| padded(&column[whole..]));
            let mut outputs = [[T::default(); MAX_LANES]; N];
            let inputs = inputs.each_ref().map(|c| c.as_ptr());
            self.blocks(inputs, uniforms, outputs.each_mut().map(|c| c.as_mut_ptr()), 1);
            for (column, padded) in out.iter_mut().zip(outputs) {
                column[whole..].copy_from_slice(&padded[..count - whole]);
            }
        }
    }

    /// The columns hold at least `blocks` whole blocks and there are all uniforms: both callers above have
    /// seen to it.
    fn blocks<const N: usize>(&self, points: [*const T; 3], uniforms: &[T], out: [*mut T; N], blocks: usize) {
        let mut columns = [std::ptr::null_mut::<T>(); 3 + MAX_OUTPUTS];
        for (column, point) in columns.iter_mut().zip(points) {
            *column = point.cast_mut(); // the program only reads the first three
        }
        columns[3..3 + N].copy_from_slice(&out);
        type Entry<T> = unsafe extern "C" fn(*const *mut T, usize, *const T);
        // SAFETY: `compile` asked for a batch program of this precision, whose entry has this signature (the
        // last argument is unused without uniforms), and `self.code` keeps it mapped while it runs.
        let entry = unsafe { std::mem::transmute::<*const u8, Entry<T>>(self.code.entry()) };
        // SAFETY: the program reads `blocks` blocks of the first three columns and writes as many of the next
        // N, all of them long enough; it needs no alignment; outputs are exclusive borrows, so nothing
        // overlaps.
        unsafe { entry(columns.as_ptr(), blocks, uniforms.as_ptr()) }
    }
}

/// A piece of a program over blocks: arithmetic that reads some columns and writes others.
#[derive(Debug)]
pub struct SegmentProgram<T> {
    code: Code,
    inputs: usize,
    parameters: usize,
    uniforms: usize,
    lane: std::marker::PhantomData<T>,
}

impl<T: Number> SegmentProgram<T> {
    /// Compiles a piece that reads the columns of `inputs` and writes those of `outputs`.
    ///
    /// # Errors
    /// Those of [`codegen::compile`].
    pub fn compile(
        graph: &Graph,
        inputs: &[Node],
        outputs: &[Node],
        parameters: usize,
    ) -> Result<Self, CodegenError> {
        let (precision, shape, forms) = (T::PRECISION, Shape::Batch, &Forms::all(Form::Stable));
        let request =
            Request { graph, inputs, outputs, precision, shape, forms, parameters: true, uniforms: true };
        let code = codegen::compile(request)?;
        let uniforms = uniforms_of(graph);
        Ok(Self { code, inputs: inputs.len(), parameters, uniforms, lane: std::marker::PhantomData })
    }

    /// Computes the columns `writes` of a block from its points and the columns `reads`.
    ///
    /// # Panics
    /// If the block is no multiple of a vector, or places or parameters are not those of the program.
    #[inline]
    pub fn call(
        &self,
        frame: &mut Frame<'_, '_, T>,
        reads: &[ColumnPlace],
        writes: &[ColumnPlace],
        parameters: &[T],
    ) {
        let (length, lanes) = (frame.len(), T::PRECISION.lanes());
        let [inputs, outputs] = [reads, writes].map(<[ColumnPlace]>::len);
        assert!(length.is_multiple_of(lanes) && frame.points.iter().all(|c| c.len() == length), "length");
        assert_eq!((inputs, outputs, parameters.len()), (self.inputs, self.code.outputs, self.parameters));
        assert!(frame.uniforms.len() >= self.uniforms, "uniforms of the program");
        frame.pointers.clear();
        // the program only reads the points
        frame.pointers.extend(frame.points.iter().map(|column| column.as_ptr().cast_mut()));
        let base = frame.columns.as_mut_ptr();
        for &place in reads.iter().chain(writes) {
            let pointer = match place {
                ColumnPlace::Own(column) => {
                    let start = column as usize * frame.stride;
                    assert!(start + length <= frame.columns.len(), "no such column");
                    // SAFETY: within the columns, as was just checked.
                    unsafe { base.add(start) }
                }
                ColumnPlace::Output(i) => {
                    let output = &mut frame.outputs[i as usize];
                    assert_eq!(output.len(), length, "length of an output");
                    output.as_mut_ptr()
                }
            };
            frame.pointers.push(pointer);
        }
        type Entry<T> = unsafe extern "C" fn(*const *mut T, usize, *const T, *const T);
        // SAFETY: `compile` asked for a batch program of this precision that takes parameters and
        // uniforms, whose entry has this signature, and `self.code` keeps it mapped while it runs.
        let entry = unsafe { std::mem::transmute::<*const u8, Entry<T>>(self.code.entry()) };
        // SAFETY: the program reads and writes `length` numbers of each column, which were checked to be
        // there, and its parameters and uniforms, whose numbers were checked. Two columns in one place would
        // give wrong numbers and do no other harm: all pointers into `columns` come from one exclusive
        // borrow.
        unsafe {
            entry(frame.pointers.as_ptr(), length / lanes, parameters.as_ptr(), frame.uniforms.as_ptr())
        }
    }
}

/// How range programs are called: rounding upwards where this file knows how to ask the processor for it.
const ROUNDING: Rounding =
    if cfg!(all(target_arch = "x86_64", unix)) { Rounding::Upward } else { Rounding::Nearest };

/// A compiled range program, with parameters or without.
#[derive(Debug)]
pub struct RangeProgram {
    code: Code,
    rounding: Rounding,
    /// How many it takes; `None` if it takes no pointer to any.
    parameters: Option<usize>,
    uniforms: usize,
}

impl RangeProgram {
    /// Compiles the range of a node for boxes, rounding upwards where this processor can be asked to.
    ///
    /// # Errors
    /// [`CodegenError::Unsupported`] where there can be no machine code, and for graphs that only the
    /// interpreter knows; [`CodegenError::Bug`] if the generated function is refused.
    pub fn compile(graph: &Graph, root: Node) -> Result<Self, CodegenError> {
        Self::with_rounding(graph, root, ROUNDING)
    }

    /// Compiles the range of a node for a processor that rounds in this way. Programs that round upwards
    /// exist where [`RangeProgram::compile`] makes them.
    ///
    /// # Errors
    /// Those of [`RangeProgram::compile`].
    pub fn with_rounding(graph: &Graph, root: Node, rounding: Rounding) -> Result<Self, CodegenError> {
        if !codegen::range_is_supported(graph, root) {
            return Err(CodegenError::Unsupported("ranges of this formula".into()));
        }
        Self::new(graph, &[root], Shape::Range(rounding), None)
    }

    /// A program of a graph with uniforms. It may be called with those for which
    /// `codegen::range_stays_finite`.
    ///
    /// # Errors
    /// Those of [`RangeProgram::compile`].
    pub fn with_uniforms(graph: &Graph, root: Node) -> Result<Self, CodegenError> {
        if !codegen::range_is_known(graph) {
            return Err(CodegenError::Unsupported("ranges of this formula".into()));
        }
        Self::new(graph, &[root], Shape::Range(ROUNDING), None)
    }

    /// A program that takes its constants as parameters. It may be called with those for which
    /// `codegen::range_stays_finite`.
    ///
    /// # Errors
    /// Those of [`RangeProgram::compile`].
    pub fn with_parameters(graph: &Graph, root: Node, parameters: usize) -> Result<Self, CodegenError> {
        if !codegen::range_is_known(graph) {
            return Err(CodegenError::Unsupported("ranges of this formula".into()));
        }
        Self::new(graph, &[root], Shape::Range(ROUNDING), Some(parameters))
    }

    /// A program as of [`RangeProgram::with_parameters`] for a function and its derivatives, see
    /// [`RangeProgram::call_all`]. It has no answer for boxes in which the function may jump.
    ///
    /// # Errors
    /// Those of [`RangeProgram::compile`].
    pub(crate) fn of_slopes(
        graph: &Graph,
        outputs: [Node; 4],
        parameters: usize,
    ) -> Result<Self, CodegenError> {
        if !codegen::range_is_known(graph) {
            return Err(CodegenError::Unsupported("ranges of this formula".into()));
        }
        Self::new(graph, &outputs, Shape::Slopes(ROUNDING), Some(parameters))
    }

    fn new(
        graph: &Graph,
        outputs: &[Node],
        shape: Shape,
        parameters: Option<usize>,
    ) -> Result<Self, CodegenError> {
        let rounding = match shape {
            Shape::Range(rounding) | Shape::Slopes(rounding) => rounding,
            Shape::Point | Shape::Batch => return Err(CodegenError::Bug("not a range program".into())),
        };
        let given = parameters.unwrap_or(0);
        let is_given = |expr| !matches!(expr, Expr::Parameter(i) if i as usize >= given);
        if !graph.nodes().all(|(_, expr)| is_given(expr)) {
            return Err(CodegenError::Bug("a parameter that the program is not given".into()));
        }
        if rounding == Rounding::Upward && ROUNDING != Rounding::Upward {
            return Err(CodegenError::Unsupported("rounding upwards".into()));
        }
        let (precision, forms) = (Precision::F64, &Forms::all(Form::Stable));
        let with_parameters = parameters.is_some();
        let uniforms = uniforms_of(graph);
        let request = Request {
            graph,
            inputs: &[],
            outputs,
            precision,
            shape,
            forms,
            parameters: with_parameters,
            uniforms: uniforms > 0,
        };
        Ok(Self { code: codegen::compile(request)?, rounding, parameters, uniforms })
    }

    /// The range over a box, for uniforms within these bounds; `None` if the box reaches too far out, or a divisor
    /// may vanish in it, or a root or a function may be undefined.
    ///
    /// # Panics
    /// If there are not as many parameters or uniforms as the program has.
    #[inline]
    pub fn call(&self, over: &Aabb, parameters: &[f64], uniforms: &[[f64; 2]]) -> Option<Interval> {
        self.call_all(over, parameters, uniforms).map(|[range]| range)
    }

    /// The ranges of all outputs, as [`RangeProgram::call`].
    ///
    /// # Panics
    /// If there are not as many outputs, parameters or uniforms as the program has.
    #[inline]
    pub(crate) fn call_all<const N: usize>(
        &self,
        over: &Aabb,
        parameters: &[f64],
        uniforms: &[[f64; 2]],
    ) -> Option<[Interval; N]> {
        assert_eq!(N, self.code.outputs, "outputs of the range program");
        assert_eq!(parameters.len(), self.parameters.unwrap_or(0), "parameters of the range program");
        assert!(uniforms.len() >= self.uniforms, "uniforms of the range program");
        // those that a program has come first
        let uniforms = uniforms.as_ptr().cast::<f64>();
        let (third, fourth) = match self.parameters {
            Some(_) => (parameters.as_ptr(), uniforms),
            None => (uniforms, std::ptr::null()),
        };
        let reach = codegen::RANGE_REACH;
        let near = over.min.cmpge(DVec3::splat(-reach)).all() && over.max.cmple(DVec3::splat(reach)).all();
        let ordered = over.min.cmple(over.max).all();
        if !(near && ordered) {
            return None; // NaN included
        }
        let (min, max) = (over.min, over.max);
        let input = [min.x, min.y, min.z, max.x, max.y, max.z];
        let mut ranges = [[0.0; 2]; N];
        let out = ranges.as_flattened_mut();
        match self.rounding {
            Rounding::Nearest => {
                type Entry = unsafe extern "C" fn(*const f64, *mut f64, *const f64, *const f64);
                // SAFETY: `new` asked for a range program, whose entry has this signature (the last arguments
                // are unused without parameters and uniforms), and `self.code` keeps it mapped while it runs.
                let entry = unsafe { std::mem::transmute::<*const u8, Entry>(self.code.entry()) };
                // SAFETY: the program reads six numbers, its parameters and its uniforms, checked above, and
                // writes two for each output, of which there are N.
                unsafe { entry(input.as_ptr(), out.as_mut_ptr(), third, fourth) };
            }
            Rounding::Upward => self.call_rounding_upwards(&input, out, [third, fourth]),
        }
        // what the program says where it has no answer
        if ranges.as_flattened().iter().any(|bound| bound.is_nan()) {
            return None;
        }
        Some(ranges.map(|[lo, hi]| Interval::new(lo, hi)))
    }

    /// The call as one block of assembly, so that no code of Rust runs in a rounding mode that it does not
    /// expect.
    #[cfg(all(target_arch = "x86_64", unix))]
    #[inline]
    fn call_rounding_upwards(&self, input: &[f64; 6], out: &mut [f64], numbers: [*const f64; 2]) {
        /// The state at the start of every program (all exceptions masked), but rounding towards +∞ (bits 13,
        /// 14).
        static UPWARDS: u32 = 0x1f80 | 0x4000;
        // SAFETY: `new` asked for a range program, whose entry follows the C convention of this system with
        // these four pointers (the last are unused without parameters and uniforms); `self.code` keeps it
        // mapped while it runs; it reads six numbers, its parameters and its uniforms, checked by the caller,
        // writes two for each output, for which the caller has made room, and calls nothing but `find_range`, for which
        // it puts the rounding back itself. The stack is aligned at the start of the block, stays so, and is put
        // back, as is the control register, before its end.
        unsafe {
            std::arch::asm!(
                "sub rsp, 16",
                "stmxcsr [rsp]",
                "ldmxcsr [{upwards}]",
                "call {entry}",
                "ldmxcsr [rsp]",
                "add rsp, 16",
                upwards = in(reg) &raw const UPWARDS,
                entry = in(reg) self.code.entry(),
                in("rdi") input.as_ptr(),
                in("rsi") out.as_mut_ptr(),
                in("rdx") numbers[0],
                in("rcx") numbers[1],
                clobber_abi("C"),
            );
        }
    }

    /// Never called here: `new` refuses such programs.
    #[cfg(not(all(target_arch = "x86_64", unix)))]
    fn call_rounding_upwards(&self, _: &[f64; 6], out: &mut [f64], _: [*const f64; 2]) {
        out.fill(f64::NAN);
    }
}

/// A program of leaves that differ in their constants alone: for one point and for many, in `f64`.
#[derive(Debug)]
pub struct LeafProgram {
    point: Code,
    batch: Code,
    parameters: usize,
    uniforms: usize,
}

impl LeafProgram {
    /// Compiles the outputs of a leaf, for one point and for many.
    ///
    /// # Errors
    /// Those of [`codegen::compile`].
    pub fn compile(graph: &Graph, outputs: &[Node], parameters: usize) -> Result<Self, CodegenError> {
        let compile = |shape| {
            let (precision, forms) = (Precision::F64, &Forms::all(Form::Stable));
            codegen::compile(Request {
                graph,
                inputs: &[],
                outputs,
                precision,
                shape,
                forms,
                parameters: true,
                uniforms: true,
            })
        };
        let uniforms = uniforms_of(graph);
        Ok(Self { point: compile(Shape::Point)?, batch: compile(Shape::Batch)?, parameters, uniforms })
    }

    /// All outputs at a point.
    ///
    /// # Panics
    /// If there are not as many outputs, parameters or uniforms as the program has.
    #[inline]
    pub fn call(&self, p: DVec3, parameters: &[f64], uniforms: &[f64], out: &mut [f64]) {
        assert_eq!((out.len(), parameters.len()), (self.point.outputs, self.parameters), "leaf program");
        assert!(uniforms.len() >= self.uniforms, "leaf program");
        type Entry = unsafe extern "C" fn(f64, f64, f64, *mut f64, *const f64, *const f64);
        // SAFETY: `compile` asked for a point program with parameters and uniforms in `f64`, whose entry has
        // this signature, and `self.point` keeps it mapped while it runs.
        let entry = unsafe { std::mem::transmute::<*const u8, Entry>(self.point.entry()) };
        // SAFETY: the program writes the outputs and reads parameters and uniforms; all lengths were checked
        // above.
        unsafe { entry(p.x, p.y, p.z, out.as_mut_ptr(), parameters.as_ptr(), uniforms.as_ptr()) }
    }

    /// All outputs at many points: whole blocks, then the rest through one padded block.
    ///
    /// # Panics
    /// If the columns differ in length, or the program has not N outputs, other parameters or other
    /// uniforms.
    pub fn call_many<const N: usize>(
        &self,
        points: [&[f64]; 3],
        parameters: &[f64],
        uniforms: &[f64],
        mut out: [&mut [f64]; N],
    ) {
        let count = points[0].len();
        assert!(uniforms.len() >= self.uniforms, "leaf program");
        assert_eq!((N, parameters.len()), (self.batch.outputs, self.parameters), "leaf program");
        assert!(
            points.iter().all(|c| c.len() == count) && out.iter().all(|c| c.len() == count),
            "columns differ in length: x, y, z have {:?} and the answers {:?} numbers",
            points.map(<[_]>::len),
            out.each_ref().map(|column| column.len())
        );
        const LANES: usize = Precision::F64.lanes();
        let whole = count / LANES * LANES;
        let numbers = [parameters, uniforms];
        if whole > 0 {
            let columns = out.each_mut().map(|c| c.as_mut_ptr());
            self.blocks(points.map(<[f64]>::as_ptr), columns, whole / LANES, numbers);
        }
        if whole < count {
            let inputs: [[f64; LANES]; 3] = points.map(|column| padded(&column[whole..]));
            let mut outputs = [[0.0; LANES]; N];
            let inputs = inputs.each_ref().map(|c| c.as_ptr());
            self.blocks(inputs, outputs.each_mut().map(|c| c.as_mut_ptr()), 1, numbers);
            for (column, padded) in out.iter_mut().zip(outputs) {
                column[whole..].copy_from_slice(&padded[..count - whole]);
            }
        }
    }

    /// The columns hold at least `blocks` whole blocks, and there are all parameters and uniforms: both
    /// callers above have seen to it.
    fn blocks<const N: usize>(
        &self,
        points: [*const f64; 3],
        out: [*mut f64; N],
        blocks: usize,
        numbers: [&[f64]; 2],
    ) {
        let [parameters, uniforms] = numbers.map(<[f64]>::as_ptr);
        let mut columns = [std::ptr::null_mut::<f64>(); 3 + MAX_OUTPUTS];
        for (column, point) in columns.iter_mut().zip(points) {
            *column = point.cast_mut(); // the program only reads the first three
        }
        columns[3..3 + N].copy_from_slice(&out);
        type Entry = unsafe extern "C" fn(*const *mut f64, usize, *const f64, *const f64);
        // SAFETY: `compile` asked for a batch program with parameters and uniforms in `f64`, whose entry has
        // this signature, and `self.batch` keeps it mapped while it runs.
        let entry = unsafe { std::mem::transmute::<*const u8, Entry>(self.batch.entry()) };
        // SAFETY: the program reads `blocks` blocks of three columns, its parameters and its uniforms, whose
        // numbers were checked, and writes as many blocks to N columns, which are borrowed exclusively.
        unsafe { entry(columns.as_ptr(), blocks, parameters, uniforms) }
    }
}
