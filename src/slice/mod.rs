//! Plots of ω in a plane: bands of colour between round levels, ω = 0 as a line, axes and a colour bar.
//!
//! ```text
//! Field ──sample──▶ Samples ──isolines──▶ outlines ──svg──▶ SVG ──png──▶ PNG
//!                      └──────terminal──▶ characters
//! ```
//!
//! Invariant: this module sees a [`Field`], and not how it was made. It opens no file and queries no
//! terminal. The same field gives the same bytes on any number of threads.

mod arrows;
mod axes;
mod colour;
mod error;
mod isolines;
mod labels;
mod numbers;
mod paths;
mod plane;
mod png;
mod sample;
mod sections;
mod sheet;
mod svg;
pub mod terminal;

use std::io;

pub use self::png::rasterise;
#[doc(hidden)]
pub use self::svg::escaped;
use self::svg::svg;
pub use self::{
    error::SliceError,
    isolines::{Polyline, isolines},
    plane::{Axis, Plane, Window},
    sample::{Samples, sample, sample_while},
    sections::Cut,
    sheet::{Panel, write_sheet_png, write_sheet_svg},
};
use crate::field::Field;

/// What a slice shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Quantity {
    /// ω, which is no length.
    #[default]
    Omega,
    /// The distance from the surface, m: positive inside, as ω is.
    Distance,
}

/// How a slice is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Style {
    /// What its field is.
    pub quantity: Quantity,
    /// Whether arrows show −∇ω, the way out.
    pub arrows: bool,
}

/// The number of samples along the longer side that makes a plot smooth at the printed size.
pub const DEFAULT_SAMPLES: usize = 320;

/// The levels between the bands of colours in a plot of samples, ascending; 0 is one of them.
pub fn levels(samples: &Samples) -> Vec<f64> {
    colour::Scale::for_samples(samples).levels().to_vec()
}

/// Writes a slice as an SVG document, with `samples` samples along the window's longer side. `name` is part
/// of the title.
///
/// # Errors
/// Those of [`sample`] and of `out`.
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

/// Writes a slice as a PNG picture: the drawing of [`write_svg`] at `scale` pixels per unit. 2 prints well.
///
/// # Errors
/// Those of [`sample`] and of `out`, and [`SliceError::Scale`].
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

    /// A ball of radius 1/2. Its slices through the middle are discs.
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
