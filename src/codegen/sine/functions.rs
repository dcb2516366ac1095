//! The functions that programs call, compiled once in a process or an object file.

use std::sync::OnceLock;

use cranelift_codegen::ir::{
    Function, InstBuilder, StackSlotData, StackSlotKind, Type, UserFuncName, Value, types,
};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::{FuncId, Linkage, Module, default_libcall_names};

use super::wanted::Wanted;
use crate::codegen::emitter::{Emitter, Hosts};
use crate::codegen::host_functions::{HostFunction, Library};
use crate::codegen::machine::{CodegenError, target};
use crate::ir::{Forms, Graph};
use crate::precision::Precision;

/// The address of a function, which is compiled at its first use and stays for the life of the process.
///
/// # Errors
/// Those of compilation, see `codegen::compile`.
pub fn address(precision: Precision, wanted: Wanted) -> Result<*const u8, CodegenError> {
    static ADDRESSES: [[OnceLock<Result<usize, CodegenError>>; 4]; 2] =
        [const { [const { OnceLock::new() }; 4] }; 2];
    let number = usize::from(wanted.sine) + 2 * usize::from(wanted.cosine);
    let cell = &ADDRESSES[usize::from(precision == Precision::F64)][number];
    let address = cell.get_or_init(|| Ok(compile(precision, wanted)?.expose_provenance()));
    address.clone().map(std::ptr::with_exposed_provenance)
}

/// Compiles a function into executable memory that is never freed.
fn compile(precision: Precision, wanted: Wanted) -> Result<*const u8, CodegenError> {
    let mut linker = JITBuilder::with_isa(target(0)?, default_libcall_names());
    for function in wanted.functions() {
        let function = HostFunction::Unary(function);
        linker.symbol(function.symbol(precision, Library::Rfm), function.address(precision));
    }
    let mut module = JITModule::new(linker);
    let id = define(&mut module, precision, wanted)?;
    module.finalize_definitions().map_err(|e| CodegenError::Unsupported(e.to_string()))?;
    let address = module.get_finalized_function(id);
    std::mem::forget(module);
    Ok(address)
}

/// Compiles a function into a module: one of executable memory, or an object file.
///
/// # Errors
/// [`CodegenError::Bug`] if it is refused.
pub fn define(
    module: &mut impl Module,
    precision: Precision,
    wanted: Wanted,
) -> Result<FuncId, CodegenError> {
    let bug = |e: &dyn std::fmt::Display| CodegenError::Bug(e.to_string());
    let (convention, pointer) =
        (module.target_config().default_call_conv, module.target_config().pointer_type());
    let mut context = module.make_context();
    let signature = wanted.signature(precision);
    context.func = Function::with_name_signature(UserFuncName::user(0, 0), signature.clone());
    let mut hosts = Hosts::default();
    for function in wanted.functions().map(HostFunction::Unary) {
        let signature = function.signature(convention, precision, pointer);
        let symbol = function.symbol(precision, Library::Rfm);
        let id = module.declare_function(&symbol, Linkage::Import, &signature).map_err(|e| bug(&e))?;
        hosts.functions.insert(function, module.declare_func_in_func(id, &mut context.func));
    }
    let mut shared = FunctionBuilderContext::new();
    let mut builder = FunctionBuilder::new(&mut context.func, &mut shared);
    emit(&mut builder, (precision, wanted), (&hosts, pointer));
    builder.finalize(module.target_config());
    let id = module
        .declare_function(&wanted.symbol(precision), Linkage::Local, &signature)
        .map_err(|e| bug(&e))?;
    module.define_function(id, &mut context).map_err(|e| CodegenError::Bug(format!("{e:?}")))?;
    Ok(id)
}

/// The whole function.
fn emit(
    builder: &mut FunctionBuilder<'_>,
    (precision, wanted): (Precision, Wanted),
    (hosts, pointer): (&Hosts, Type),
) {
    let [entry, rare, common] = std::array::from_fn(|_| builder.create_block());
    builder.set_cold_block(rare);
    builder.append_block_params_for_function_params(entry);
    builder.switch_to_block(entry);
    let x = builder.block_params(entry)[0];
    let (graph, forms) = (Graph::default(), Forms::default());
    // the common part is computed in `f64` for both precisions
    let mut emitter = Emitter::new(builder, (Precision::F64, 2), (&graph, &forms), hosts);
    let (is_rare, results) = match precision {
        Precision::F64 => {
            let quadrants = emitter.double_quadrants(x);
            (quadrants.rare, emitter.choose(x, &quadrants, wanted))
        }
        Precision::F32 => {
            let halves = emitter.halves(x);
            let quadrants = halves.map(|half| emitter.single_quadrants(half));
            let [low, high] = [0, 1].map(|i| emitter.choose(halves[i], &quadrants[i], wanted));
            let results = std::iter::zip(low, high).map(|(low, high)| emitter.joined([low, high])).collect();
            let [low, high] = quadrants.map(|quadrants| quadrants.rare);
            (emitter.builder.ins().bor(low, high), results)
        }
    };
    let any_rare = emitter.builder.ins().vany_true(is_rare);
    emitter.builder.ins().brif(any_rare, rare, &[], common, &[]);

    emitter.builder.switch_to_block(common);
    emitter.builder.ins().return_(&results);

    builder.switch_to_block(rare);
    let results = call_by_lanes(builder, (precision, wanted), (hosts, pointer), x);
    builder.ins().return_(&results);
    builder.seal_all_blocks();
}

/// Calls the functions of the mathematical library in each lane. The lanes wait in memory. Otherwise the
/// vector would be saved even if nothing is called.
fn call_by_lanes(
    builder: &mut FunctionBuilder<'_>,
    (precision, wanted): (Precision, Wanted),
    (hosts, pointer): (&Hosts, Type),
    x: Value,
) -> Vec<Value> {
    let (lane, vector) = match precision {
        Precision::F32 => (types::F32, types::F32X4),
        Precision::F64 => (types::F64, types::F64X2),
    };
    let slot = StackSlotData::new(StackSlotKind::ExplicitSlot, vector.bytes(), 4);
    let arguments = builder.create_sized_stack_slot(slot.clone());
    builder.ins().stack_store(pointer, x, arguments, 0);
    let mut found = Vec::new();
    for function in wanted.functions().map(HostFunction::Unary) {
        let results = builder.create_sized_stack_slot(slot.clone());
        for offset in (0..vector.bytes() as i32).step_by(lane.bytes() as usize) {
            let argument = builder.ins().stack_load(pointer, lane, arguments, offset);
            let call = builder.ins().call(hosts.functions[&function], &[argument]);
            let result = builder.inst_results(call)[0];
            builder.ins().stack_store(pointer, result, results, offset);
        }
        found.push(results);
    }
    found.into_iter().map(|results| builder.ins().stack_load(pointer, vector, results, 0)).collect()
}
