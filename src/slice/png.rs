//! Drawings as pixels: SVG, rasterised with the one font that is built in.
//!
//! Invariant: fonts of the system are not used, so the picture does not depend on the machine.

use std::io;

use resvg::{
    tiny_skia::{Pixmap, Transform},
    usvg::Tree,
};

use super::SliceError;

use crate::lettering;

/// Writes an SVG drawing with an opaque ground as an RGB PNG, with `scale` pixels per unit of the drawing.
///
/// # Errors
/// [`SliceError::Drawing`] if the drawing is no SVG, [`SliceError::Scale`] outside 0.1 … 16, and those
/// of `out`.
pub fn rasterise(svg: &str, scale: f32, out: impl io::Write) -> Result<(), SliceError> {
    if !(0.1..=16.0).contains(&scale) {
        return Err(SliceError::Scale(scale));
    }
    let tree = parse(svg)?;
    let [width, height] = [tree.size().width(), tree.size().height()].map(|x| (x * scale).round() as u32);
    let mut pixmap = Pixmap::new(width, height).ok_or(SliceError::Scale(scale))?;
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut pixmap.as_mut());

    // the ground is opaque, so premultiplied colours are the colours
    let rgb: Vec<u8> = pixmap.data().chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    let mut encoder = png::Encoder::new(out, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().map_err(io::Error::from)?;
    writer.write_image_data(&rgb).map_err(io::Error::from)?;
    writer.finish().map_err(io::Error::from)?;
    Ok(())
}

pub(super) fn parse(svg: &str) -> Result<Tree, SliceError> {
    lettering::tree(svg).map_err(SliceError::Drawing)
}
