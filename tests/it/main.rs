//! One test binary: one link of the code generator.

mod agreement;
mod contact;
mod ranges;
