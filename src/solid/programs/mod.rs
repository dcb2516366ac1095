//! The programs of one graph: made on demand, called safely, with the interpreter behind them.

pub mod block_plan;
pub mod block_program;
pub mod columns;
pub mod compiled;
pub mod kernels;
pub mod number;
pub mod on_demand;
pub mod ranges;
#[cfg(test)]
mod wave_tests;
