//! One test binary: one link of the code generator.

mod agreement;
mod bad_input;
mod blocks;
mod cells;
mod certificates;
mod cli;
mod contact;
mod diagnostics;
mod examples;
mod fluid_surface;
mod hard_cases;
mod mesh_properties;
mod meshes;
mod moving;
mod numbers;
mod pipeline;
mod properties;
mod ranges;
mod run;
mod simplify;
mod sweep;
mod tidy;
mod tolerance;
mod tool;
mod validation;
mod walls;
