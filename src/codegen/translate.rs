//! A whole program: signature, loop over blocks, nodes in order, outputs; then compilation and linking.

use rustc_hash::{FxHashMap, FxHashSet};

use cranelift_codegen::Context;
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{AbiParam, Function, InstBuilder, MemFlagsData, UserFuncName, Value};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::{FuncId, Linkage, Module, default_libcall_names};

use super::emitter::{Emitter, Hosts};
use super::host_functions::{HostFunction, Library};
use super::machine::{CodegenError, number_type, target};
use super::memory::Code;
use super::range::{self, Instructions};
use super::request::{Request, Shape, pointers};
use super::sine::{self, Wanted};
use crate::ir::{Axis, Expr, Node, Unary, UnaryFunction};

/// The texts of a program that the code generator prints.
#[derive(Debug, Clone)]
pub struct Listing {
    /// Cranelift's intermediate representation, before optimisation.
    pub clif: String,
    /// Assembly of this machine.
    pub assembly: String,
}

/// Compiles a program into executable memory.
///
/// # Errors
/// [`CodegenError::Unsupported`] where the system gives no executable memory or the processor is not known;
/// [`CodegenError::Bug`] if the generated function is refused.
pub fn compile(request: Request<'_>) -> Result<Code, CodegenError> {
    Ok(build(request, false)?.0)
}

impl Listing {
    /// The texts of a program.
    ///
    /// # Errors
    /// [`CodegenError::Unsupported`] where the system gives no executable memory or the processor is not
    /// known; [`CodegenError::Bug`] if the generated function is refused.
    pub fn of(request: Request<'_>) -> Result<Self, CodegenError> {
        Ok(build(request, true)?.1)
    }
}

fn build(request: Request<'_>, listing: bool) -> Result<(Code, Listing), CodegenError> {
    let needed = needed(request);
    let isa = target(needed.len())?;
    let mut linker = JITBuilder::with_isa(isa, default_libcall_names());
    for function in HostFunction::all() {
        let symbol = function.symbol(request.precision, Library::Rfm);
        linker.symbol(symbol, function.address(request.precision));
    }
    range::register(&mut linker);
    for wanted in waves(request, &needed).into_values() {
        linker.symbol(wanted.symbol(request.precision), sine::address(request.precision, wanted)?);
    }
    let mut module = JITModule::new(linker);
    let named = Named { name: "program", linkage: Linkage::Local, library: Library::Rfm };
    let Defined { id, size, listing } = define(&mut module, request, named, listing)?;
    module.finalize_definitions().map_err(|e| CodegenError::Unsupported(e.to_string()))?;
    let entry = module.get_finalized_function(id);
    let tables = request.graph.tables().clone();
    let code =
        Code::new((module, tables), entry, (request.precision, request.shape), request.outputs.len(), size);
    Ok((code, listing))
}

/// The declaration of a function in its module.
#[derive(Clone, Copy)]
pub(super) struct Named<'a> {
    pub name: &'a str,
    pub linkage: Linkage,
    /// The mathematical library whose functions it calls.
    pub library: Library,
}

/// A function of a module.
pub(super) struct Defined {
    id: FuncId,
    size: usize,
    listing: Listing,
}

/// Compiles a program into a module: one of executable memory, or an object file.
///
/// # Errors
/// [`CodegenError::Bug`] if the generated function is refused.
pub(super) fn define(
    module: &mut impl Module,
    request: Request<'_>,
    named: Named<'_>,
    listing: bool,
) -> Result<Defined, CodegenError> {
    let needed = needed(request);
    if needed.iter().any(|&node| request.graph.expr(node) == Expr::Coordinate(Axis::T)) {
        return Err(CodegenError::Bug("time is in the graph of a program".into()));
    }
    if named.linkage != Linkage::Local && request.graph.has_lookups(request.outputs) {
        return Err(CodegenError::Unsupported("a table cannot be written into an object file".into()));
    }
    let instructions = match request.shape {
        Shape::Range(_) | Shape::Slopes(_) => Instructions::of(request.graph)
            .ok_or_else(|| CodegenError::Bug("a range program of this formula".into()))?,
        Shape::Point | Shape::Batch => Instructions::default(),
    };
    let bug = |what: &dyn std::fmt::Display| CodegenError::Bug(what.to_string());
    let mut context = module.make_context();
    context.func = Function::with_name_signature(UserFuncName::user(0, 0), module.make_signature());
    declare_parameters(&mut context.func, module, request);

    let hosts = match request.shape {
        Shape::Point | Shape::Batch => declare_hosts(module, &mut context.func, (request, named), &needed),
        Shape::Range(_) | Shape::Slopes(_) => Ok(Hosts::default()),
    };
    let hosts = hosts.map_err(|e| bug(&e))?;
    let find_range = match request.shape {
        Shape::Point | Shape::Batch => Ok(None),
        Shape::Range(rounding) | Shape::Slopes(rounding) => {
            range::declare(module, &mut context.func, &instructions, rounding)
        }
    };
    let find_range = find_range.map_err(|e| bug(&e))?;
    let mut shared = FunctionBuilderContext::new();
    let mut builder = FunctionBuilder::new(&mut context.func, &mut shared);
    match request.shape {
        Shape::Point => point(&mut builder, request, &needed, &hosts),
        Shape::Range(_) | Shape::Slopes(_) => range::emit(&mut builder, request, &instructions, find_range),
        Shape::Batch => {
            batch(&mut builder, request, &needed, &hosts, module.target_config().pointer_type());
        }
    }
    builder.finalize(module.target_config());

    let clif = if listing { context.func.display().to_string() } else { String::new() };
    context.set_disasm(listing);
    let signature = context.func.signature.clone();
    let id = module.declare_function(named.name, named.linkage, &signature).map_err(|e| bug(&e))?;
    module.define_function(id, &mut context).map_err(|e| CodegenError::Bug(format!("{e:?}")))?;
    let (size, assembly) = compiled_texts(&context);
    Ok(Defined { id, size, listing: Listing { clif, assembly } })
}

fn compiled_texts(context: &Context) -> (usize, String) {
    context
        .compiled_code()
        .map_or((0, String::new()), |code| (code.code_buffer().len(), code.vcode.clone().unwrap_or_default()))
}

fn declare_parameters(function: &mut Function, module: &impl Module, request: Request<'_>) {
    let pointer = AbiParam::new(module.target_config().pointer_type());
    let scalar = AbiParam::new(number_type(request.precision));
    let mut parameters = match request.shape {
        Shape::Point => vec![scalar, scalar, scalar, pointer],
        Shape::Batch | Shape::Range(_) | Shape::Slopes(_) => vec![pointer, pointer],
    };
    parameters.extend([request.parameters, request.uniforms].into_iter().filter(|&is| is).map(|_| pointer));
    function.signature.params = parameters;
}

fn declare_hosts(
    module: &mut impl Module,
    function: &mut Function,
    (request, named): (Request<'_>, Named<'_>),
    needed: &[Node],
) -> Result<Hosts, cranelift_module::ModuleError> {
    let mut hosts = Hosts::default();
    let pointer = module.target_config().pointer_type();
    let waves = match named.library {
        Library::Rfm => waves(request, needed),
        Library::System => FxHashMap::default(),
    };
    for &node in needed {
        let expr = request.graph.expr(node);
        let Some(host) = HostFunction::of(expr) else { continue };
        if wave(request, node).is_some_and(|(_, argument)| waves.contains_key(&argument)) {
            continue;
        }
        if hosts.functions.contains_key(&host) {
            continue;
        }
        let signature = host.signature(module.target_config().default_call_conv, request.precision, pointer);
        let symbol = host.symbol(request.precision, named.library);
        let id = module.declare_function(&symbol, Linkage::Import, &signature)?;
        hosts.functions.insert(host, module.declare_func_in_func(id, function));
    }
    let mut declared = FxHashMap::default();
    for (argument, wanted) in waves {
        let function = match declared.get(&wanted) {
            Some(&function) => function,
            None => {
                let (symbol, signature) =
                    (wanted.symbol(request.precision), wanted.signature(request.precision));
                let id = module.declare_function(&symbol, Linkage::Import, &signature)?;
                *declared.entry(wanted).or_insert(module.declare_func_in_func(id, function))
            }
        };
        hosts.waves.insert(argument, (wanted, function));
    }
    Ok(hosts)
}

/// The arguments whose sines and cosines are found by functions of `sine`.
pub(super) fn waves(request: Request<'_>, needed: &[Node]) -> FxHashMap<Node, Wanted> {
    let mut waves: FxHashMap<Node, Wanted> = FxHashMap::default();
    if matches!(request.shape, Shape::Range(_) | Shape::Slopes(_)) {
        // ranges have rules of their own
        return waves;
    }
    for (function, argument) in needed.iter().filter_map(|&node| wave(request, node)) {
        waves.entry(argument).or_default().add(function);
    }
    waves
}

/// The function and the argument of a node that may be computed by functions of `sine`.
fn wave(request: Request<'_>, node: Node) -> Option<(UnaryFunction, Node)> {
    match request.graph.expr(node) {
        Expr::Unary(Unary::Call(function), argument) if sine::is_wave(function) => Some((function, argument)),
        _ => None,
    }
}

fn point(builder: &mut FunctionBuilder<'_>, request: Request<'_>, needed: &[Node], hosts: &Hosts) {
    let block = builder.create_block();
    builder.append_block_params_for_function_params(block);
    builder.switch_to_block(block);
    builder.seal_block(block);
    let parameters = builder.block_params(block).to_vec();
    let mut emitter = Emitter::new(builder, (request.precision, 1), (request.graph, request.forms), hosts);
    let vector = emitter.vector_type();
    let coordinates: [Value; 3] =
        std::array::from_fn(|i| emitter.builder.ins().scalar_to_vector(vector, parameters[i]));
    let [given_parameters, uniforms] = pointers(request, &parameters[4..]);
    let inputs = FxHashMap::default();
    let given = Arguments { coordinates, inputs, parameters: given_parameters, uniforms };
    let values = nodes(&mut emitter, request, needed, given);
    let bytes = emitter.lane_type().bytes() as i32;
    for (i, output) in request.outputs.iter().enumerate() {
        let lane = emitter.builder.ins().extractlane(values[output], 0);
        emitter.builder.ins().store(MemFlagsData::new(), lane, parameters[3], i as i32 * bytes);
    }
    emitter.builder.ins().return_(&[]);
}

fn batch(
    builder: &mut FunctionBuilder<'_>,
    request: Request<'_>,
    needed: &[Node],
    hosts: &Hosts,
    pointer: cranelift_codegen::ir::Type,
) {
    let [entry, body, exit] = std::array::from_fn(|_| builder.create_block());
    builder.append_block_params_for_function_params(entry);
    builder.switch_to_block(entry);
    let arguments = builder.block_params(entry).to_vec();
    let (columns, blocks) = (arguments[0], arguments[1]);
    let column = |builder: &mut FunctionBuilder<'_>, i: usize| {
        let offset = i as i32 * pointer.bytes() as i32;
        builder.ins().load(pointer, MemFlagsData::trusted(), columns, offset)
    };
    let axes: [Value; 3] = std::array::from_fn(|i| column(builder, i));
    let given = request.inputs.len();
    let inputs: Vec<Value> = (0..given).map(|i| column(builder, 3 + i)).collect();
    let outputs: Vec<Value> = (0..request.outputs.len()).map(|i| column(builder, 3 + given + i)).collect();
    let end = builder.ins().ishl_imm_u(blocks, 4); // 16 bytes a block
    let zero = builder.ins().iconst(pointer, 0);
    let any = builder.ins().icmp_imm_u(IntCC::NotEqual, blocks, 0);
    builder.ins().brif(any, body, &[zero.into()], exit, &[]);

    let offset = builder.append_block_param(body, pointer);
    builder.switch_to_block(body);
    let mut emitter = Emitter::new(
        builder,
        (request.precision, request.precision.lanes() as u8),
        (request.graph, request.forms),
        hosts,
    );
    let vector = emitter.vector_type();
    // columns may start anywhere, so no alignment is promised
    let mut load = |base: Value| {
        let address = emitter.builder.ins().iadd(base, offset);
        emitter.builder.ins().load(vector, MemFlagsData::new(), address, 0)
    };
    let coordinates = axes.map(&mut load);
    let inputs = request.inputs.iter().copied().zip(inputs.into_iter().map(load)).collect();
    let [parameters, uniforms] = pointers(request, &arguments[2..]);
    let given = Arguments { coordinates, inputs, parameters, uniforms };
    let values = nodes(&mut emitter, request, needed, given);
    for (output, base) in request.outputs.iter().zip(outputs) {
        let address = builder.ins().iadd(base, offset);
        builder.ins().store(MemFlagsData::new(), values[output], address, 0);
    }
    let next = builder.ins().iadd_imm_s(offset, 16);
    let more = builder.ins().icmp(IntCC::UnsignedLessThan, next, end);
    builder.ins().brif(more, body, &[next.into()], exit, &[]);
    builder.seal_all_blocks();
    builder.switch_to_block(exit);
    builder.ins().return_(&[]);
}

/// The arguments of a program.
struct Arguments {
    coordinates: [Value; 3],
    inputs: FxHashMap<Node, Value>,
    /// Pointers.
    parameters: Option<Value>,
    uniforms: Option<Value>,
}

/// The values of all needed nodes, in the graph's order, in addition to those that were given.
fn nodes(
    emitter: &mut Emitter<'_, '_>,
    request: Request<'_>,
    needed: &[Node],
    given: Arguments,
) -> FxHashMap<Node, Value> {
    let Arguments { coordinates, inputs: mut values, parameters, uniforms } = given;
    for &node in needed {
        let expr = request.graph.expr(node);
        let value = match expr {
            Expr::Constant(bits) => emitter.constant(f64::from_bits(bits)),
            Expr::Coordinate(Axis::X) => coordinates[0],
            Expr::Coordinate(Axis::Y) => coordinates[1],
            Expr::Coordinate(Axis::Z) => coordinates[2],
            Expr::Coordinate(Axis::T) => unreachable!("`build` refuses time"),
            Expr::Parameter(i) => emitter.parameter(parameters, i),
            Expr::Uniform(i) => emitter.parameter(uniforms, i),
            Expr::Unary(op, a) => match wave(request, node) {
                Some((function, _)) if emitter.hosts.waves.contains_key(&a) => {
                    emitter.wave(function, (a, values[&a]))
                }
                _ => emitter.unary(op, values[&a]),
            },
            Expr::Binary(op, a, b) => emitter.binary(op, (a, values[&a]), (b, values[&b])),
            Expr::Lookup(lookup, at) => {
                emitter.lookup(lookup, request.graph.tables(), at.map(|node| values[&node]))
            }
        };
        values.insert(node, value);
    }
    values
}

/// The nodes on which the outputs of a program depend, down to its inputs but without them, in the graph's
/// order.
pub(super) fn needed(request: Request<'_>) -> Vec<Node> {
    let known: FxHashSet<Node> = request.inputs.iter().copied().collect();
    let mut seen: FxHashSet<Node> = FxHashSet::default();
    let mut found: Vec<Node> = Vec::new();
    let mut next = 0;
    let mut visit = |node: Node, found: &mut Vec<Node>| {
        if !known.contains(&node) && seen.insert(node) {
            found.push(node);
        }
    };
    request.outputs.iter().for_each(|&output| visit(output, &mut found));
    while next < found.len() {
        request.graph.expr(found[next]).operands().for_each(|operand| visit(operand, &mut found));
        next += 1;
    }
    found.sort_unstable();
    found
}
