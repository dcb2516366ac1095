//! Ranges of functions that have no machine instruction. Programs call the rules of `ir` for them.
//!
//! These rules round to nearest. A program that rounds upwards calls them through a few instructions that
//! reset the processor's rounding for the time of the call.

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{
    AbiParam, FuncRef, Function, InstBuilder, MemFlagsData, Signature, StackSlotData, StackSlotKind, Value,
    types,
};
use cranelift_jit::JITBuilder;
use cranelift_module::{Linkage, Module, ModuleError};

use super::functions::RangeFunction;
use super::instructions::{Instruction, Instructions, LARGEST_CALL};
use super::{BoundLane, Ranges};
use crate::codegen::request::Rounding;

/// The bounds of two operands, low and high, on entry; those of the result in the first two places on return.
type Bounds = [f64; 4];

/// Finds a range. The first argument of the machine code that calls it is the address of four numbers.
extern "C" fn find_range(bounds: &mut Bounds, number: usize) {
    let [a_low, a_high, b_low, b_high] = *bounds;
    let found = match RangeFunction::all().nth(number) {
        Some(RangeFunction::Unary(function)) => function.bounds([a_low, a_high]),
        Some(RangeFunction::Binary(function)) => function.bounds([a_low, a_high], [b_low, b_high]),
        None => [f64::NAN; 2], // no program has such a number
    };
    bounds[..2].copy_from_slice(&found);
}

/// [`find_range`] for a caller that rounds upwards.
#[cfg(all(target_arch = "x86_64", unix))]
// SAFETY: only range programs call it, by the C convention of this system and with the arguments of
// `find_range`, which stay in their registers. The stack is aligned at the call and restored after it. So is
// the control register, whose state in between is that at the start of every program (0x1f80).
#[unsafe(naked)]
unsafe extern "C" fn find_range_to_nearest(bounds: &mut Bounds, number: usize) {
    std::arch::naked_asm!(
        "sub rsp, 24",
        "stmxcsr [rsp + 8]",
        "mov dword ptr [rsp + 12], 0x1f80",
        "ldmxcsr [rsp + 12]",
        "call {find}",
        "ldmxcsr [rsp + 8]",
        "add rsp, 24",
        "ret",
        find = sym find_range,
    )
}

/// Never called on this system, where programs that round upwards are refused.
#[cfg(not(all(target_arch = "x86_64", unix)))]
extern "C" fn find_range_to_nearest(bounds: &mut Bounds, _: usize) {
    bounds.fill(f64::NAN);
}

fn symbol(rounding: Rounding) -> &'static str {
    match rounding {
        Rounding::Nearest => "rfm_find_range",
        Rounding::Upward => "rfm_find_range_to_nearest",
    }
}

/// Registers the addresses of the functions with the linker.
pub(in crate::codegen) fn register(linker: &mut JITBuilder) {
    linker.symbol(symbol(Rounding::Nearest), find_range as *const u8);
    linker.symbol(symbol(Rounding::Upward), find_range_to_nearest as *const u8);
}

/// The function that a program calls for ranges, if it needs one.
pub(in crate::codegen) fn declare(
    module: &mut impl Module,
    function: &mut Function,
    Instructions(instructions): &Instructions,
    rounding: Rounding,
) -> Result<Option<FuncRef>, ModuleError> {
    if !instructions.iter().any(|instruction| matches!(instruction, Instruction::Call(..))) {
        return Ok(None);
    }
    let pointer = module.target_config().pointer_type();
    let mut signature = Signature::new(module.target_config().default_call_conv);
    signature.params = vec![AbiParam::new(pointer), AbiParam::new(pointer)];
    let id = module.declare_function(symbol(rounding), Linkage::Import, &signature)?;
    Ok(Some(module.declare_func_in_func(id, function)))
}

impl Ranges<'_, '_> {
    /// The range of a function. There is no answer where the function is undefined or very large.
    pub(super) fn call(&mut self, function: RangeFunction, operands: [Value; 2]) -> Value {
        let Some(host) = self.host else { return self.pair(f64::NAN, f64::NAN) };
        let slot = *self.bounds.get_or_insert_with(|| {
            let slot = StackSlotData::new(StackSlotKind::ExplicitSlot, 32, 4);
            self.emitter.builder.create_sized_stack_slot(slot)
        });
        let place = self.emitter.builder.ins().stack_addr(types::I64, slot, 0);
        let flags = MemFlagsData::new();
        for (offset, operand) in [0, 16].into_iter().zip(operands) {
            let bounds = self.flip(operand, BoundLane::Low);
            self.emitter.builder.ins().store(flags, bounds, place, offset);
        }
        let number = self.emitter.builder.ins().iconst(types::I64, function.number() as i64);
        self.emitter.builder.ins().call(host, &[place, number]);
        let range = self.load_pair(place, [0, 8]);
        let range = self.flip(range, BoundLane::Low);
        let (size, limit) = (self.emitter.abs(range), self.emitter.constant(LARGEST_CALL));
        // false for NaN
        let is_known = self.emitter.compare(FloatCC::LessThan, size, limit);
        let unknown = self.emitter.builder.ins().bnot(is_known);
        self.fail_where(unknown);
        range
    }
}
