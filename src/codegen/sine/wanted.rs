//! The choice of sine, cosine or both, and the names and signatures of the functions that find them.

use cranelift_codegen::ir::{AbiParam, Signature, Value, types};
use cranelift_codegen::isa::CallConv;

use crate::ir::UnaryFunction;
use crate::precision::Precision;

/// The functions that are wanted for one argument: sine, cosine or both.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct Wanted {
    pub sine: bool,
    pub cosine: bool,
}

/// Their values, as far as they are wanted.
#[derive(Debug, Clone, Copy)]
pub struct Waves {
    pub sine: Option<Value>,
    pub cosine: Option<Value>,
}

impl Wanted {
    pub fn add(&mut self, function: UnaryFunction) {
        self.sine |= function == UnaryFunction::Sin;
        self.cosine |= function == UnaryFunction::Cos;
    }

    /// The name of the function that finds them.
    pub fn symbol(self, precision: Precision) -> String {
        let functions = match (self.sine, self.cosine) {
            (true, true) => "sines_and_cosines",
            (true, false) => "sines",
            (false, true) => "cosines",
            (false, false) => unreachable!("one of them is asked for"),
        };
        format!("rfm_{functions}_{}", precision.name())
    }

    /// Its signature: one vector to one vector, or to two with the sines first.
    pub fn signature(self, precision: Precision) -> Signature {
        let vector = AbiParam::new(match precision {
            Precision::F32 => types::F32X4,
            Precision::F64 => types::F64X2,
        });
        let mut signature = Signature::new(CallConv::Fast);
        signature.params = vec![vector];
        signature.returns = self.functions().map(|_| vector).collect();
        signature
    }

    /// The functions themselves.
    pub fn functions(self) -> impl Iterator<Item = UnaryFunction> {
        let both = [(self.sine, UnaryFunction::Sin), (self.cosine, UnaryFunction::Cos)];
        both.into_iter().filter(|&(is_wanted, _)| is_wanted).map(|(_, function)| function)
    }

    /// The results of a call.
    pub fn of(self, results: &[Value]) -> Waves {
        let sine = results.first().copied().filter(|_| self.sine);
        let cosine = results.last().copied().filter(|_| self.cosine);
        Waves { sine, cosine }
    }
}

/// All functions, in the order in which object files have them.
pub fn all() -> impl Iterator<Item = (Precision, Wanted)> {
    let wanted = [(true, false), (false, true), (true, true)].map(|(sine, cosine)| Wanted { sine, cosine });
    [Precision::F32, Precision::F64]
        .into_iter()
        .flat_map(move |precision| wanted.map(|wanted| (precision, wanted)))
}

/// Whether there are instructions for a function of the mathematical library.
pub fn is_wave(function: UnaryFunction) -> bool {
    matches!(function, UnaryFunction::Sin | UnaryFunction::Cos)
}
