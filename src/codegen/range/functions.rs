//! The functions whose ranges programs find by a call, and their numbers.

use crate::ir::{BinaryFunction, UnaryFunction};

/// A function whose range programs find by a call.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::codegen) enum RangeFunction {
    Unary(UnaryFunction),
    Binary(BinaryFunction),
}

impl RangeFunction {
    /// All of them, in the order of their numbers.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        let of_two = BinaryFunction::ALL.iter().copied().map(Self::Binary);
        UnaryFunction::ALL.iter().copied().map(Self::Unary).chain(of_two)
    }

    /// Its number, by which programs name it.
    pub(super) fn number(self) -> usize {
        Self::all().take_while(|other| *other != self).count()
    }
}
