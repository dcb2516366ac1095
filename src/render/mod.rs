//! Pictures of a simulation: the box, the obstacle's mesh and the particles, which are coloured by their
//! speed or another value.
//!
//! ```text
//! Camera, box, mesh ──Backdrop::new──▶ Backdrop ──frame(particles)──▶ Image ──write_png──▶ PNG
//!                                                                       └──Apng, Gif──▶ a film
//! ```
//!
//! Clear things are blended over opaque ones (`glass`). Then folds are darkened, as found from the depth of
//! the picture (`occlusion`), and the floor is shadowed by the things over it (`floor`).
//!
//! Everything is drawn on the processor at twice the size and averaged down. Rows are cut into bands of fixed
//! height, which are drawn in parallel. Within a band the order is fixed, so ties in depth are always settled
//! in the same way.
//!
//! Invariant: a band depends on its inputs alone, so a picture has the same bits on any number of threads.
//! This module takes plain slices, opens no file and reads no clock.

mod backdrop;
mod camera;
mod colour;
mod cut;
mod facet;
mod film;
mod floor;
mod gif_film;
mod glass;
mod hidden;
mod image;
mod mesh;
mod occlusion;
mod overlay;
mod particles;
mod raster;
mod section;
mod shade;
mod spare;

use std::{fmt, io};

use self::colour::Rgb;
pub use self::{
    backdrop::{Backdrop, Moving},
    camera::{Camera, Projection},
    colour::ColourMap,
    cut::Cut,
    film::Apng,
    gif_film::{Gif, Palette},
    hidden::hidden,
    image::Image,
    mesh::MeshView,
    overlay::{Caption, Legend, Scale, digits_of_time},
    particles::ParticlesView,
    shade::{Material, OBSTACLE},
};
use crate::geom::Aabb;

/// The reason why a backdrop could not be drawn, or a picture could not be written.
#[derive(Debug)]
pub enum RenderError {
    /// The box to look at is empty, infinite or a point.
    Bounds(Aabb),
    /// Width and height of the picture, outside 16 ..= 8192.
    Size(u32, u32),
    /// The rasteriser refused the legend, which is a bug of ours.
    Legend(String),
    /// The output could not be written.
    Io(io::Error),
}

impl fmt::Display for RenderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bounds(Aabb { min, max }) => {
                write!(f, "cannot look at the box {min} .. {max}: expected finite sides, not all zero")
            }
            Self::Size(width, height) => {
                write!(f, "cannot draw {width} × {height} pixels: expected 16 to 8192 each way")
            }
            Self::Legend(reason) => write!(f, "the legend is not valid: {reason}"),
            Self::Io(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for RenderError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        if let Self::Io(error) = self { Some(error) } else { None }
    }
}

impl From<io::Error> for RenderError {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}
