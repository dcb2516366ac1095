//! The numbers that programs compute with, and what comes in two kinds because of them.

use std::cell::RefCell;

use super::columns::Scratch;
use super::kernels::Wide;
use crate::ir::{Given, Interpreter, Real};
use crate::precision::Precision;

/// A type that programs compute with: `f32` or `f64`.
pub trait Number: Real + Default + Wide {
    /// The name of the type.
    const PRECISION: Precision;

    /// All outputs at a point, by the interpreter.
    #[doc(hidden)]
    fn interpret(interpreter: &Interpreter, point: [Self; 3], uniforms: &[Self], out: &mut [Self]);

    /// The numbers that depend on time alone, in this precision.
    #[doc(hidden)]
    fn uniforms(values: &UniformValues) -> &[Self];

    /// Lends the working memory of this thread.
    #[doc(hidden)]
    fn with_scratch<R>(use_it: impl FnOnce(&mut Scratch<Self>) -> R) -> R;
}

/// Values of what depends on time alone, for programs of either precision: found in `f64` in any case.
#[derive(Debug, Clone, Default)]
pub struct UniformValues {
    pub double: Vec<f64>,
    pub single: Vec<f32>,
}

impl UniformValues {
    /// The values for a program that has none.
    pub const NONE: Self = Self { double: Vec::new(), single: Vec::new() };
}

macro_rules! number {
    ($t:ty, $precision:expr, $eval:ident, $uniforms:ident) => {
        impl Number for $t {
            const PRECISION: Precision = $precision;

            fn interpret(interpreter: &Interpreter, point: [Self; 3], uniforms: &[Self], out: &mut [Self]) {
                interpreter.$eval(Given { uniforms, ..Given::point(point) }, out);
            }

            #[inline]
            fn uniforms(values: &UniformValues) -> &[Self] {
                &values.$uniforms
            }

            fn with_scratch<R>(use_it: impl FnOnce(&mut Scratch<Self>) -> R) -> R {
                thread_local! {
                    static SCRATCH: RefCell<Scratch<$t>> = RefCell::default();
                }
                SCRATCH.with_borrow_mut(use_it)
            }
        }
    };
}

number!(f32, Precision::F32, eval_given_f32, single);
number!(f64, Precision::F64, eval_given, double);
