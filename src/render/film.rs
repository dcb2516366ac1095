//! Films: the part that changes from one picture to the next, and animated PNG.

use std::io::{self, Write};

use super::Image;

/// A rectangle of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Part {
    pub left: usize,
    pub top: usize,
    pub width: usize,
    pub height: usize,
}

/// The smallest rectangle in which two pictures of the same size differ; one pixel if they are equal. A pixel
/// has `bytes` bytes.
pub(super) fn changed<T: PartialEq>(before: &[T], now: &[T], width: usize, bytes: usize) -> Part {
    let row = width * bytes;
    let rows = || before.chunks_exact(row).zip(now.chunks_exact(row)).enumerate();
    let differing = || rows().filter(|(_, (a, b))| a != b);
    let Some((top, _)) = differing().next() else { return Part { left: 0, top: 0, width: 1, height: 1 } };
    let (mut bottom, mut left, mut right) = (top, width, 0);
    for (y, (a, b)) in differing() {
        bottom = y;
        let is_other = |x: &usize| a[x * bytes..(x + 1) * bytes] != b[x * bytes..(x + 1) * bytes];
        left = (0..left).find(is_other).unwrap_or(left);
        right = (right..width).rev().find(is_other).unwrap_or(right);
    }
    Part { left, top, width: right + 1 - left, height: bottom + 1 - top }
}

/// An animated PNG. It has all colours, and programs without animation show a still picture.
pub struct Apng<W: Write> {
    writer: png::Writer<W>,
    size: (u32, u32),
    /// The pixels of the picture before.
    before: Option<Vec<u8>>,
}

impl<W: Write> Apng<W> {
    /// Begins a film of the given number of pictures, which repeats endlessly. `size` is the width and the
    /// height in pixels, `rate` the number of pictures in a second.
    ///
    /// # Errors
    /// Those of `out`, and of a film without pictures.
    pub fn new(out: W, (width, height): (u32, u32), pictures: u32, rate: u16) -> io::Result<Self> {
        let mut encoder = png::Encoder::new(out, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Fast);
        encoder.set_animated(pictures, 0)?;
        encoder.set_frame_delay(1, rate.max(1))?;
        Ok(Self { writer: encoder.write_header()?, size: (width, height), before: None })
    }

    /// Adds a picture. After the first picture, only the part that changes is stored.
    ///
    /// # Errors
    /// Those of the stream, and of a picture of another size.
    pub fn add(&mut self, image: &Image) -> io::Result<()> {
        if (image.width, image.height) != self.size {
            return Err(io::Error::other("the pictures of a film have one size"));
        }
        let width = self.size.0 as usize;
        match &self.before {
            None => self.writer.write_image_data(&image.pixels)?,
            Some(before) => {
                let part = changed(before, &image.pixels, width, 3);
                let rows = image.pixels.chunks_exact(3 * width).skip(part.top).take(part.height);
                let within: Vec<u8> =
                    rows.flat_map(|row| &row[3 * part.left..3 * (part.left + part.width)]).copied().collect();
                // the corner must fit first, and then the size
                self.writer.reset_frame_position()?;
                self.writer.set_frame_dimension(part.width as u32, part.height as u32)?;
                self.writer.set_frame_position(part.left as u32, part.top as u32)?;
                self.writer.write_image_data(&within)?;
            }
        }
        self.before = Some(image.pixels.clone());
        Ok(())
    }

    /// Ends the film.
    ///
    /// # Errors
    /// Those of the stream, and of a film with fewer pictures than were announced.
    pub fn finish(self) -> io::Result<()> {
        Ok(self.writer.finish()?)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A square that wanders over stripes.
    pub(in super::super) fn film(pictures: usize, (width, height): (usize, usize)) -> Vec<Image> {
        let picture = |k: usize| {
            let pixel = |i: usize| {
                let (x, y) = (i % width, i / width);
                let inside = (3 * k..3 * k + 9).contains(&x) && (2 * k..2 * k + 7).contains(&y);
                if inside { [190, 24, 34] } else { [255, 255, (y * 40 % 256) as u8] }
            };
            let pixels = (0..width * height).flat_map(pixel).collect();
            Image { width: width as u32, height: height as u32, pixels, skipped: 0 }
        };
        (0..pictures).map(picture).collect()
    }

    #[test]
    fn the_part_that_changes_is_found() {
        let mut now = vec![0; 3 * 8 * 6];
        let before = now.clone();
        assert_eq!(changed(&before, &now, 8, 3), Part { left: 0, top: 0, width: 1, height: 1 });
        for (x, y) in [(2, 1), (5, 4), (3, 3)] {
            now[3 * (8 * y + x) + 1] = 9;
        }
        assert_eq!(changed(&before, &now, 8, 3), Part { left: 2, top: 1, width: 4, height: 4 });
    }

    #[test]
    fn an_animated_png_decodes_to_the_same_pictures() {
        let mut images = film(5, (40, 30));
        // a picture equal to the one before it
        images.insert(2, images[1].clone());
        let mut bytes = Vec::new();
        let mut film = Apng::new(&mut bytes, (40, 30), 6, 25).unwrap();
        images.iter().for_each(|image| film.add(image).unwrap());
        film.finish().unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(&bytes)).read_info().unwrap();
        let control = reader.info().animation_control.unwrap();
        assert_eq!((control.num_frames, control.num_plays), (6, 0));
        let mut canvas = images[0].pixels.clone();
        for image in &images {
            let mut part = vec![0; reader.output_buffer_size().unwrap()];
            let info = reader.next_frame(&mut part).unwrap();
            let place = *reader.info().frame_control().unwrap();
            assert_eq!((place.delay_num, place.delay_den), (1, 25));
            for (y, row) in part[..info.buffer_size()].chunks(info.line_size).enumerate() {
                let at = 3 * ((place.y_offset as usize + y) * 40 + place.x_offset as usize);
                canvas[at..at + row.len()].copy_from_slice(row);
            }
            assert!(canvas == image.pixels);
        }
        assert!(Apng::new(Vec::new(), (40, 30), 0, 25).is_err());
    }
}
