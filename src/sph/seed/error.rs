//! What carving took from a fluid, and why a fluid cannot be placed.

use std::{error, fmt};

use glam::DVec3;

/// How many particles carving removed, by reason, and how many it kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Carved {
    /// Removed: in an obstacle or on its surface (ω ≥ 0).
    pub inside: usize,
    /// Removed: in the fluid, but nearer to an obstacle than the clearance.
    pub too_close: usize,
    /// Removed: outside the box.
    pub outside_box: usize,
    /// Particles that are left.
    pub kept: usize,
}

/// Why a fluid cannot be placed.
#[derive(Debug, Clone, PartialEq)]
pub enum SeedError {
    /// The shape, cut with the container, has room for fewer particles than wanted.
    DoesNotFit {
        /// Number of particles wanted.
        wanted: usize,
        /// Number of particles that fit.
        room: usize,
    },
    /// A drop has no number of particles.
    NoCount,
    /// The jitter is not in 0..1.
    Jitter(f64),
    /// The shape is infinite, or would hold more particles than a machine does.
    TooLarge {
        /// Number of lattice sites; infinite for an infinite shape.
        sites: f64,
    },
    /// The shape or an obstacle has no value at a lattice site.
    Undefined {
        /// The site, m.
        at: DVec3,
    },
    /// Carving left no particle.
    NothingLeft(Carved),
}

impl fmt::Display for SeedError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::DoesNotFit { wanted, room } => {
                write!(f, "{wanted} particles do not fit: the shape in its container has room for {room}")
            }
            Self::NoCount => write!(f, "a drop needs a number of particles"),
            Self::Jitter(found) => write!(f, "jitter is {found}, expected a number from 0 to below 1"),
            Self::TooLarge { sites } => write!(f, "the shape would hold {sites:.1e} particles"),
            Self::Undefined { at } => write!(f, "the formula of a shape has no value at {at}"),
            Self::NothingLeft(carved) => write!(
                f,
                "no particle is left: {} lay in obstacles, {} too close to them, {} outside the box",
                carved.inside, carved.too_close, carved.outside_box
            ),
        }
    }
}

impl error::Error for SeedError {}
