//! Plots of ω in a plane: bands of colour between round levels, ω = 0 as a line, axes and a colour bar.
//!
//! ```text
//! Field ──sample──▶ Samples ──isolines──▶ outlines ──svg──▶ SVG ──png──▶ PNG
//!                      └──────terminal──▶ characters
//! ```
//!
//! Invariant: this module sees a [`Field`] and nothing of how it was made; it opens no file
//! and asks no terminal; the same field gives the same bytes on any number of threads.

mod axes;
mod colour;
mod isolines;
mod labels;
mod numbers;
mod paths;
mod plane;
mod png;
mod sample;
mod svg;
pub mod terminal;

use std::{fmt, io};

pub use self::{
    colour::{Rgb, Scale, UNDEFINED},
    isolines::{Outline, Polyline, isolines, outlines},
    plane::{Axis, Plane, Window},
    sample::{Samples, sample},
    svg::{escaped, svg},
};
use crate::field::Field;
pub use png::rasterise;

/// Samples along the longer side that make a plot smooth at the printed size.
pub const DEFAULT_SAMPLES: usize = 320;

/// Why a slice could not be drawn.
#[derive(Debug)]
pub enum SliceError {
    /// The window has no area or is not finite.
    Window(Window),
    /// The number of samples is outside 2 ..= 8192.
    Resolution(usize),
    /// The picture of this many pixels per unit of the drawing cannot be made.
    Scale(f32),
    /// The drawing that we wrote is not accepted: a bug of ours.
    Drawing(String),
    Io(io::Error),
}

impl fmt::Display for SliceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Window(Window { min, max }) => {
                write!(
                    f,
                    "nothing to draw in the window {min} .. {max}: expected finite sides longer than zero"
                )
            }
            Self::Resolution(samples) => write!(f, "{samples} samples along a side: expected 2 to 8192"),
            Self::Scale(scale) => write!(f, "cannot draw {scale} pixels per unit: expected 0.1 to 16"),
            Self::Drawing(reason) => write!(f, "the drawing is not valid: {reason}"),
            Self::Io(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for SliceError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        if let Self::Io(error) = self { Some(error) } else { None }
    }
}

impl From<io::Error> for SliceError {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// Writes a slice as an SVG document.
///
/// # Errors
/// Those of [`sample`] and of the writer.
pub fn write_svg(
    field: &dyn Field,
    name: &str,
    plane: Plane,
    window: Window,
    samples: usize,
    mut out: impl io::Write,
) -> Result<(), SliceError> {
    out.write_all(svg(field, name, &sample(field, plane, window, samples)?).as_bytes())?;
    Ok(())
}

/// Writes a slice as a PNG picture: the drawing of [`write_svg`] at `scale` pixels per unit (2 prints well).
///
/// # Errors
/// Those of [`sample`] and of the writer, and [`SliceError::Scale`].
pub fn write_png(
    field: &dyn Field,
    name: &str,
    plane: Plane,
    window: Window,
    samples: usize,
    scale: f32,
    out: impl io::Write,
) -> Result<(), SliceError> {
    png::rasterise(&svg(field, name, &sample(field, plane, window, samples)?), scale, out)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::field::Closures;

    pub fn field(omega: impl Fn(DVec3) -> f64 + Send + Sync) -> impl Field {
        Closures { omega, gradient: |_| DVec3::ZERO }
    }

    /// A ball of radius 1/2: its slices through the middle are discs.
    pub fn disc() -> impl Field {
        field(|p| 0.25 - p.length_squared())
    }

    /// The paper's pawn (its example 2), with R₀ conjunctions and disjunctions.
    pub fn pawn() -> impl Field {
        fn and(u: f64, v: f64) -> f64 {
            u + v - (u * u + v * v).sqrt()
        }
        fn or(u: f64, v: f64) -> f64 {
            u + v + (u * u + v * v).sqrt()
        }
        field(|DVec3 { x, y, z }| {
            let r2 = (x - 1.5) * (x - 1.5) + (y - 1.5) * (y - 1.5);
            let cylinder = 0.25 - r2;
            let waist = -20.0 * r2 + 1.0 + 10.0 * (z - 0.75) * (z - 0.75);
            let collar = 0.125 - r2 - 20.0 * (1.0 - z) * (1.0 - z);
            let head = 0.05 - r2 - (1.25 - z) * (1.25 - z);
            or(and(and(cylinder, z * (1.0 - z)), waist), or(collar, head))
        })
    }
}
