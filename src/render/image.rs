//! A finished picture.

use std::io::{self, Write};

/// A picture of RGB pixels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// The width in pixels.
    pub width: u32,
    /// The height in pixels.
    pub height: u32,
    /// Three sRGB bytes per pixel, row by row from the top.
    pub pixels: Vec<u8>,
    /// The number of particles that are not in the picture because their position is not finite or lies
    /// behind the eye.
    pub skipped: usize,
}

impl Image {
    /// The colour of the pixel in column `x` and row `y`, counted from the upper left corner. `None` outside
    /// the picture.
    pub fn pixel(&self, x: u32, y: u32) -> Option<[u8; 3]> {
        if x >= self.width || y >= self.height {
            return None;
        }
        let at = 3 * (y as usize * self.width as usize + x as usize);
        self.pixels.get(at..at + 3)?.try_into().ok()
    }

    /// Writes the picture as PNG, compressed for speed, not for size.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_png(&self, out: &mut impl Write) -> io::Result<()> {
        let mut encoder = png::Encoder::new(out, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Fast);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.pixels)?;
        writer.finish()?;
        Ok(())
    }

    /// Lays a layer over this picture, with its upper left corner at (x, y). Parts outside are cut off.
    pub(super) fn lay(&mut self, layer: &Layer, x: usize, y: usize) {
        let columns = layer.width.min((self.width as usize).saturating_sub(x));
        for row in 0..layer.height.min((self.height as usize).saturating_sub(y)) {
            let from = &layer.rgba[4 * row * layer.width..][..4 * columns];
            let to = &mut self.pixels[3 * ((y + row) * self.width as usize + x)..][..3 * columns];
            for (pixel, over) in to.chunks_exact_mut(3).zip(from.chunks_exact(4)) {
                let through = 255 - u16::from(over[3]);
                for (channel, &colour) in pixel.iter_mut().zip(over) {
                    // premultiplied colours never exceed their opacity, so the sum fits a byte
                    let under = (u16::from(*channel) * through + 127) / 255;
                    *channel = (u16::from(colour) + under).min(255) as u8;
                }
            }
        }
    }
}

/// A picture with opacity, as premultiplied RGBA.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Layer {
    pub width: usize,
    pub height: usize,
    pub rgba: Vec<u8>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_blend_and_are_cut_off_at_the_border() {
        let mut image = Image { width: 2, height: 1, pixels: vec![100; 6], skipped: 0 };
        let half = Layer { width: 2, height: 2, rgba: [128, 0, 0, 128].repeat(4) };
        image.lay(&half, 1, 0);
        assert_eq!(image.pixels, [100, 100, 100, 178, 50, 50]);
        image.lay(&half, 5, 5);
        assert_eq!((image.pixel(0, 0), image.pixel(2, 0)), (Some([100; 3]), None));
    }

    #[test]
    fn png_decodes_to_the_same_pixels() {
        let pixels: Vec<u8> = (0..3 * 7 * 5).map(|i| (i * 37 % 251) as u8).collect();
        let image = Image { width: 7, height: 5, pixels, skipped: 0 };
        let mut bytes = Vec::new();
        image.write_png(&mut bytes).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        let mut decoded = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut decoded).unwrap();
        assert_eq!((info.width, info.height), (7, 5));
        assert!(decoded == image.pixels);
    }
}
