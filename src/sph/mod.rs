//! Smoothed particle hydrodynamics around obstacles given as fields.
//!
//! A fluid is a set of particles. [`Method`] has three ways to find its pressure: that of the paper
//! (equations 7–14, table 1), a weakly compressible and a divergence-free one. Walls are fields: there are no
//! boundary particles and there is no mesh.
//!
//! ```text
//! Parameters ─┐
//! FluidBlock ─┼─▶ carve ─▶ Simulation::new ─▶ step, step, … ─▶ stats, write_vtp
//! Obstacle  ──┘
//! ```
//!
//! ```
//! use std::sync::Arc;
//! use rfm::{field::Closures, geom::Aabb, glam::DVec3, sph::*};
//!
//! let ball = Arc::new(Closures {
//!     omega: |p: DVec3| 0.25 - p.length_squared(),
//!     gradient: |p: DVec3| -2.0 * p,
//! });
//! let domain = Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0));
//! let obstacles = vec![Obstacle::at_rest(ball, 0.005)];
//! let parameters = Parameters::default();
//! let mut fluid = FluidBlock::drop(DVec3::Z * 0.8, 200).seed(&parameters, domain)?;
//! carve(&mut fluid, &domain, &obstacles, 0.01)?;
//! let mut simulation = Simulation::new(parameters, fluid, domain, obstacles)?;
//! for _ in 0..100 {
//!     simulation.step()?;
//! }
//! assert_eq!(simulation.stats().inside, 0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Invariants:
//! - An obstacle is known by [`Field`](crate::field::Field) and [`Walls`](crate::field::Walls) alone; this
//!   module knows no compiler, no file, no clock and no terminal.
//! - The same input gives the same bits for any number of threads: every sum is a gather in a fixed order.
//! - After a step every particle is finite, in the box, and in the fluid (ω < 0), or the step was an error.
//! - A step allocates nothing once the buffers have grown to the size of the flow.

mod audit;
mod checkpoint;
mod contacts;
mod core;
mod error;
mod kernel;
// loops over the few components of a register use an index: a closure of an iterator over them is not
// compiled for wide registers
#[allow(clippy::needless_range_loop)]
mod methods;
#[allow(clippy::needless_range_loop)]
mod pairs;
mod params;
mod particles;
mod pass;
mod plan;
mod probes;
mod reaction;
mod scales;
mod seed;
mod simulation;
mod stats;
mod vtp;
mod walls;

#[cfg(test)]
mod scenes;
#[cfg(test)]
mod tests;

/// A vector as a function of a place, m, and a time, s.
pub type VectorField = dyn Fn(glam::DVec3, f64) -> glam::DVec3 + Send + Sync;

/// A vector as a function of a time, s.
pub type VectorOfTime = dyn Fn(f64) -> glam::DVec3 + Send + Sync;

pub use crate::precision::Precision;
pub use audit::{Audit, Compression, Finding};
pub use checkpoint::{Checkpoint, CheckpointError};
pub use error::{Cause, ParameterError, Quantity, SetupError, StepError};
pub use kernel::Kernels;
pub use methods::*;
pub use params::Parameters;
pub(crate) use params::VISCOSITY;
pub use particles::{Particles, Vectors};
pub use pass::Pass;
pub use probes::{Gauge, Probe};
pub use scales::{Scales, Slip};
pub use seed::{
    Carved, Fill, FluidBlock, FluidShape, MAX_SITES, Rows, SeedError, carve, carve_cells, make_room,
};
pub use simulation::Simulation;
pub use stats::Stats;
#[doc(hidden)]
pub use vtp::short_time;
pub use vtp::{write_pvd, write_vtp};
pub use walls::{
    ChangingShape, Collision, Contact, Obstacle, Rebound, RigidPart, Undefined, WallKernel, bounce, collide,
    first_contact, push_out, put_back,
};
