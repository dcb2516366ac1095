//! The functions of an object file that others call: those of a C file, over the programs of the object.
//!
//! A function for one point is `T name(T x, T y, T z, …)`, one for columns `void name(size_t n, const T *x, const T *y,
//! const T *z, …, T *result, …)`. Between the point and the results stand the time, `double t`, and a pointer to the
//! params, where the solid depends on them. The first result of a point is returned, and the others are written to an
//! array.

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{
    AbiParam, FuncRef, Function, InstBuilder, MemFlagsData, StackSlot, StackSlotData, StackSlotKind, Type,
    UserFuncName, Value, types,
};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_module::{Linkage, Module};

use super::machine::{CodegenError, number_type};
use crate::precision::Precision;

/// Two functions of an object file: for one point, and for columns of points.
pub struct Entry {
    /// Name of the function for one point.
    pub point: String,
    /// Name of the function for columns.
    pub columns: String,
    /// The type of its numbers.
    pub precision: Precision,
    /// How many results a point has.
    pub results: usize,
    /// Whether it takes the time.
    pub moves: bool,
    /// Whether it takes a pointer to params.
    pub params: bool,
    /// The programs of the object that it calls.
    pub programs: EntryPrograms,
}

/// The names of the programs behind an [`Entry`].
pub struct EntryPrograms {
    /// [`Shape::Point`](super::Shape::Point)
    pub point: String,
    /// [`Shape::Batch`](super::Shape::Batch)
    pub blocks: String,
    /// The program that finds the uniforms from the time, which stands in the place of x, and the params; and how many
    /// they are. `None` if the others take no uniforms.
    pub uniforms: Option<(String, usize)>,
}

/// Compiles both functions.
///
/// # Errors
/// [`CodegenError::Bug`] if a generated function is refused.
pub(super) fn define(module: &mut impl Module, entry: &Entry) -> Result<(), CodegenError> {
    let pointer = module.target_config().pointer_type();
    let number = number_type(entry.precision);
    let time = entry.moves.then_some(types::F64);
    let params = entry.params.then_some(pointer);
    let between = || time.into_iter().chain(params);
    let rest = (entry.results > 1).then_some(pointer);
    let of_point: Vec<Type> = [number; 3].into_iter().chain(between()).chain(rest).collect();
    let results = std::iter::repeat_n(pointer, entry.results);
    let of_columns: Vec<Type> = [pointer; 4].into_iter().chain(between()).chain(results).collect();
    one(module, entry, (&entry.point, of_point, Some(number)), |writer, arguments| {
        writer.point(arguments);
    })?;
    one(module, entry, (&entry.columns, of_columns, None), |writer, arguments| writer.columns(arguments))
}

/// Compiles one function: its name, the types of its arguments and of what it returns, and what it does.
fn one(
    module: &mut impl Module,
    entry: &Entry,
    (name, arguments, returned): (&str, Vec<Type>, Option<Type>),
    write: impl FnOnce(&mut Writer<'_, '_>, &[Value]),
) -> Result<(), CodegenError> {
    let bug = |what: &dyn std::fmt::Display| CodegenError::Bug(what.to_string());
    let mut context = module.make_context();
    let mut signature = module.make_signature();
    signature.params = arguments.into_iter().map(AbiParam::new).collect();
    signature.returns = returned.into_iter().map(AbiParam::new).collect();
    context.func = Function::with_name_signature(UserFuncName::user(0, 0), signature.clone());
    let callees = Callees::declare(module, &mut context.func, entry).map_err(|error| bug(&error))?;
    let mut shared = FunctionBuilderContext::new();
    let mut builder = FunctionBuilder::new(&mut context.func, &mut shared);
    let block = builder.create_block();
    builder.append_block_params_for_function_params(block);
    builder.switch_to_block(block);
    let arguments = builder.block_params(block).to_vec();
    let pointer = module.target_config().pointer_type();
    write(&mut Writer { builder: &mut builder, entry, callees, pointer }, &arguments);
    builder.seal_all_blocks();
    builder.finalize(module.target_config());
    let id = module.declare_function(name, Linkage::Export, &signature).map_err(|error| bug(&error))?;
    module.define_function(id, &mut context).map_err(|error| CodegenError::Bug(format!("{error:?}")))
}

/// The programs that a function calls.
struct Callees {
    point: FuncRef,
    blocks: FuncRef,
    uniforms: Option<FuncRef>,
}

impl Callees {
    fn declare(
        module: &mut impl Module,
        function: &mut Function,
        entry: &Entry,
    ) -> Result<Self, cranelift_module::ModuleError> {
        let pointer = module.target_config().pointer_type();
        let number = number_type(entry.precision);
        let programs = &entry.programs;
        let uniforms = programs.uniforms.as_ref().map(|_| pointer);
        let params = entry.params.then_some(pointer);
        let mut declared =
            |name: &str, arguments: Vec<Type>| -> Result<FuncRef, cranelift_module::ModuleError> {
                let mut signature = module.make_signature();
                signature.params = arguments.into_iter().map(AbiParam::new).collect();
                let id = module.declare_function(name, Linkage::Hidden, &signature)?;
                Ok(module.declare_func_in_func(id, function))
            };
        let point = [number, number, number, pointer].into_iter().chain(uniforms).collect();
        let blocks = [pointer; 2].into_iter().chain(uniforms).collect();
        let of_uniforms = [types::F64, types::F64, types::F64, pointer].into_iter().chain(params).collect();
        Ok(Self {
            point: declared(&programs.point, point)?,
            blocks: declared(&programs.blocks, blocks)?,
            uniforms: match &programs.uniforms {
                Some((name, _)) => Some(declared(name, of_uniforms)?),
                None => None,
            },
        })
    }
}

/// Writes one function.
struct Writer<'a, 'f> {
    builder: &'a mut FunctionBuilder<'f>,
    entry: &'a Entry,
    callees: Callees,
    pointer: Type,
}

impl Writer<'_, '_> {
    fn number(&self) -> Type {
        number_type(self.entry.precision)
    }

    fn room(&mut self, bytes: u32) -> StackSlot {
        self.builder.create_sized_stack_slot(StackSlotData::new(StackSlotKind::ExplicitSlot, bytes, 4))
    }

    fn address(&mut self, room: StackSlot) -> Value {
        self.builder.ins().stack_addr(self.pointer, room, 0)
    }

    /// The time and the params of a call, and what follows them.
    fn split<'v>(&self, behind_point: &'v [Value]) -> (Option<Value>, Option<Value>, &'v [Value]) {
        let (time, behind) = behind_point.split_at(usize::from(self.entry.moves));
        let (params, behind) = behind.split_at(usize::from(self.entry.params));
        (time.first().copied(), params.first().copied(), behind)
    }

    /// The address of the uniforms for a call, in the type of its numbers.
    fn uniforms(&mut self, time: Option<Value>, params: Option<Value>) -> Option<Value> {
        let count = self.entry.programs.uniforms.as_ref()?.1;
        let function = self.callees.uniforms?;
        let wide = self.room(8 * count.max(1) as u32);
        let address = self.address(wide);
        let zero = self.builder.ins().f64const(0.0);
        let arguments: Vec<Value> =
            [time.unwrap_or(zero), zero, zero, address].into_iter().chain(params).collect();
        self.builder.ins().call(function, &arguments);
        match self.entry.precision {
            Precision::F64 => Some(address),
            Precision::F32 => {
                let narrow = self.room(4 * count.max(1) as u32);
                for i in 0..count as i32 {
                    let number = self.builder.ins().stack_load(self.pointer, types::F64, wide, 8 * i);
                    let number = self.builder.ins().fdemote(types::F32, number);
                    self.builder.ins().stack_store(self.pointer, number, narrow, 4 * i);
                }
                Some(self.address(narrow))
            }
        }
    }

    /// Asks the program for one point. Its results are in the room that is returned.
    fn ask(&mut self, point: [Value; 3], uniforms: Option<Value>) -> StackSlot {
        let out = self.room(self.number().bytes() * self.entry.results as u32);
        let address = self.address(out);
        let arguments: Vec<Value> = point.into_iter().chain([address]).chain(uniforms).collect();
        self.builder.ins().call(self.callees.point, &arguments);
        out
    }

    fn result(&mut self, out: StackSlot, i: usize) -> Value {
        let number = self.number();
        let offset = (i as u32 * number.bytes()) as i32;
        self.builder.ins().stack_load(self.pointer, number, out, offset)
    }

    fn point(&mut self, arguments: &[Value]) {
        let point = [arguments[0], arguments[1], arguments[2]];
        let (time, params, rest) = self.split(&arguments[3..]);
        let uniforms = self.uniforms(time, params);
        let out = self.ask(point, uniforms);
        if let Some(&rest) = rest.first() {
            for i in 1..self.entry.results {
                let (value, bytes) = (self.result(out, i), self.number().bytes());
                let offset = (i as u32 - 1) * bytes;
                self.builder.ins().store(MemFlagsData::new(), value, rest, offset as i32);
            }
        }
        let first = self.result(out, 0);
        self.builder.ins().return_(&[first]);
    }

    /// Whole blocks go to the program for blocks, and the points that are left to that for one point.
    fn columns(&mut self, arguments: &[Value]) {
        let (count, points) = (arguments[0], [arguments[1], arguments[2], arguments[3]]);
        let (time, params, results) = self.split(&arguments[4..]);
        let uniforms = self.uniforms(time, params);
        let all: Vec<Value> = points.into_iter().chain(results.iter().copied()).collect();
        let columns = self.room(self.pointer.bytes() * all.len() as u32);
        for (i, &column) in all.iter().enumerate() {
            let offset = (i as u32 * self.pointer.bytes()) as i32;
            self.builder.ins().stack_store(self.pointer, column, columns, offset);
        }
        let columns = self.address(columns);
        let lanes = i64::from(self.entry.precision.lanes().trailing_zeros());
        let blocks = self.builder.ins().ushr_imm_u(count, lanes);
        let call: Vec<Value> = [columns, blocks].into_iter().chain(uniforms).collect();
        self.builder.ins().call(self.callees.blocks, &call);

        let done = self.builder.ins().ishl_imm_u(blocks, lanes);
        let [body, exit] = std::array::from_fn(|_| self.builder.create_block());
        let more = self.builder.ins().icmp(IntCC::UnsignedLessThan, done, count);
        self.builder.ins().brif(more, body, &[done.into()], exit, &[]);
        let i = self.builder.append_block_param(body, self.pointer);
        self.builder.switch_to_block(body);
        let number = self.number();
        let offset = self.builder.ins().imul_imm_u(i, i64::from(number.bytes()));
        let point = points.map(|column| {
            let address = self.builder.ins().iadd(column, offset);
            self.builder.ins().load(number, MemFlagsData::new(), address, 0)
        });
        let out = self.ask(point, uniforms);
        for (k, &column) in results.iter().enumerate() {
            let value = self.result(out, k);
            let address = self.builder.ins().iadd(column, offset);
            self.builder.ins().store(MemFlagsData::new(), value, address, 0);
        }
        let next = self.builder.ins().iadd_imm_s(i, 1);
        let more = self.builder.ins().icmp(IntCC::UnsignedLessThan, next, count);
        self.builder.ins().brif(more, body, &[next.into()], exit, &[]);
        self.builder.switch_to_block(exit);
        self.builder.ins().return_(&[]);
    }
}
