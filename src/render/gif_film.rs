//! Films as GIF, with one palette for all pictures, so that colours do not flicker.
//!
//! Invariant: the palette depends on the given pictures alone, and a pixel's index on its colour and the
//! palette. So the bytes do not depend on the number of threads, and a pixel that stays has the same index in
//! all pictures.

use std::borrow::Cow;
use std::io::{self, Write};

use rayon::prelude::*;

use super::film::{Part, changed};
use super::{Image, Rgb};

/// Number of colours of the palette. The index after them means that a pixel keeps its colour.
const COLOURS: usize = 255;
const STAYS: u8 = 255;

/// Number of leading bits of each channel that choose the index of a pixel.
const BITS: usize = 6;

/// The colours of a film.
pub struct Palette {
    colours: Vec<Rgb>,
    /// The index for each combination of the first bits of the channels.
    index: Vec<u8>,
}

impl Palette {
    /// The colours that suit some pictures of a film. White is always exact.
    ///
    /// Groups of colours are divided where they differ most until there are as many groups as a palette
    /// holds. A colour is weighted with the root of its number of pixels, so that a few fast particles on
    /// much paper have their own colours.
    pub fn of(pictures: &[&Image]) -> Self {
        let mut cells = vec![([0_u64; 3], 0_u64); 1 << (3 * BITS)];
        for pixel in pictures.iter().flat_map(|picture| picture.pixels.chunks_exact(3)) {
            let (sum, count) = &mut cells[cell(pixel)];
            (0..3).for_each(|i| sum[i] += u64::from(pixel[i]));
            *count += 1;
        }
        let found = cells.iter().filter(|(_, count)| *count > 0).map(|(sum, count)| Shade {
            colour: sum.map(|channel| channel as f64 / *count as f64),
            weight: (*count as f64).sqrt(),
        });
        let mut parts = vec![Group::of(found.collect())];
        while parts.len() < COLOURS - 1 {
            let widest = (0..parts.len()).max_by(|a, b| parts[*a].spread.total_cmp(&parts[*b].spread));
            let Some(widest) = widest.filter(|widest| parts[*widest].spread > 0.0) else { break };
            let (low, high) = parts.swap_remove(widest).parted();
            parts.extend([low, high]);
        }
        let mut colours = vec![[255; 3]];
        colours.extend(parts.iter().filter(|part| !part.shades.is_empty()).map(Group::middle));
        let index = (0..1_usize << (3 * BITS)).into_par_iter().map(|cell| nearest(&colours, middle(cell)));
        Self { index: index.collect(), colours }
    }

    fn indices(&self, image: &Image) -> Vec<u8> {
        image.pixels.chunks_exact(3).map(|pixel| self.index[cell(pixel)]).collect()
    }
}

/// A colour of pictures.
struct Shade {
    colour: [f64; 3],
    weight: f64,
}

/// Colours that share one colour of the palette.
struct Group {
    shades: Vec<Shade>,
    /// The channel in which they differ most, their mean in it, and the weighted sum of the squares of their
    /// differences.
    channel: usize,
    mean: f64,
    spread: f64,
}

impl Group {
    fn of(shades: Vec<Shade>) -> Self {
        let total: f64 = shades.iter().map(|shade| shade.weight).sum();
        let about = |i: usize| {
            let mean = shades.iter().map(|s| s.weight * s.colour[i]).sum::<f64>() / total.max(1.0);
            let spread = shades.iter().map(|s| s.weight * (s.colour[i] - mean).powi(2)).sum::<f64>();
            // differences below one step cannot be seen
            (i, mean, if spread > 0.25 * total { spread } else { 0.0 })
        };
        let (channel, mean, spread) = [1, 2]
            .map(about)
            .into_iter()
            .fold(about(0), |best, other| if other.2 > best.2 { other } else { best });
        Self { shades, channel, mean, spread }
    }

    /// The colours below their mean, and the others.
    fn parted(self) -> (Self, Self) {
        let (channel, mean) = (self.channel, self.mean);
        let (low, high) = self.shades.into_iter().partition(|shade| shade.colour[channel] < mean);
        (Self::of(low), Self::of(high))
    }

    fn middle(&self) -> Rgb {
        let total: f64 = self.shades.iter().map(|shade| shade.weight).sum();
        let mean = |i: usize| self.shades.iter().map(|s| s.weight * s.colour[i]).sum::<f64>() / total;
        [0, 1, 2].map(|i| mean(i).round() as u8)
    }
}

/// The number of the cell of colours that share their first bits with a pixel.
fn cell(pixel: &[u8]) -> usize {
    let bits = |channel: u8| usize::from(channel >> (8 - BITS));
    bits(pixel[0]) << (2 * BITS) | bits(pixel[1]) << BITS | bits(pixel[2])
}

/// The colour in the middle of a cell; black and white are exact.
fn middle(cell: usize) -> Rgb {
    [2 * BITS, BITS, 0].map(|shift| {
        let bits = cell >> shift & ((1 << BITS) - 1);
        (bits << (8 - BITS) | bits >> (2 * BITS - 8)) as u8
    })
}

fn nearest(colours: &[Rgb], colour: Rgb) -> u8 {
    let distance = |other: &Rgb| -> i32 {
        // the eye is most sensitive to green
        let weights = [2, 4, 1];
        (0..3).map(|i| weights[i] * (i32::from(other[i]) - i32::from(colour[i])).pow(2)).sum()
    };
    let found = colours.iter().enumerate().min_by_key(|(_, other)| distance(other));
    found.map_or(0, |(k, _)| k as u8)
}

/// An animated GIF that repeats endlessly.
pub struct Gif<W: Write> {
    encoder: gif::Encoder<W>,
    palette: Palette,
    size: (u16, u16),
    /// The pictures in a second, and how many there are.
    rate: u32,
    count: u32,
    /// The indices of the picture before.
    before: Option<Vec<u8>>,
}

impl<W: Write> Gif<W> {
    /// Begins a film. `size` is the width and the height in pixels, `rate` the number of pictures in a
    /// second.
    ///
    /// # Errors
    /// Those of `out`, and of a size beyond 65535.
    pub fn new(out: W, (width, height): (u32, u32), rate: u32, palette: Palette) -> io::Result<Self> {
        let side = |n: u32| u16::try_from(n).map_err(io::Error::other);
        let size = (side(width)?, side(height)?);
        let mut bytes: Vec<u8> = palette.colours.iter().flatten().copied().collect();
        bytes.resize(3 * (COLOURS + 1), 0);
        let mut encoder = gif::Encoder::new(out, size.0, size.1, &bytes).map_err(io::Error::other)?;
        encoder.set_repeat(gif::Repeat::Infinite).map_err(io::Error::other)?;
        Ok(Self { encoder, palette, size, rate: rate.max(1), count: 0, before: None })
    }

    /// Adds pictures in their order. Only the part that changes from one to the next is stored.
    ///
    /// # Errors
    /// Those of the stream, and of a picture of another size.
    pub fn add(&mut self, images: &[Image]) -> io::Result<()> {
        let size = (u32::from(self.size.0), u32::from(self.size.1));
        if images.iter().any(|image| (image.width, image.height) != size) {
            return Err(io::Error::other("the pictures of a film have one size"));
        }
        let indices: Vec<Vec<u8>> = images.par_iter().map(|image| self.palette.indices(image)).collect();
        let (last, size, count, rate) = (self.before.as_ref(), self.size, self.count, self.rate);
        let frame = |k: usize| {
            let before = if k == 0 { last } else { indices.get(k - 1) };
            let mut frame = part_of(before, &indices[k], size);
            frame.delay = delay(count + k as u32, rate);
            frame.make_lzw_pre_encoded();
            frame
        };
        let frames: Vec<gif::Frame<'static>> = (0..indices.len()).into_par_iter().map(frame).collect();
        for frame in &frames {
            self.encoder.write_lzw_pre_encoded_frame(frame).map_err(io::Error::other)?;
        }
        self.count += frames.len() as u32;
        self.before = indices.into_iter().next_back().or(self.before.take());
        Ok(())
    }
}

/// The part of a picture that differs from the one before.
fn part_of(before: Option<&Vec<u8>>, now: &[u8], (width, height): (u16, u16)) -> gif::Frame<'static> {
    let (width, height) = (usize::from(width), usize::from(height));
    let whole = Part { left: 0, top: 0, width, height };
    let part = before.map_or(whole, |before| changed(before, now, width, 1));
    let places = (part.top..part.top + part.height)
        .flat_map(|y| (part.left..part.left + part.width).map(move |x| y * width + x));
    let stays = |at: usize| before.is_some_and(|before| before[at] == now[at]);
    let buffer: Vec<u8> = places.map(|at| if stays(at) { STAYS } else { now[at] }).collect();
    gif::Frame {
        dispose: gif::DisposalMethod::Keep,
        transparent: Some(STAYS),
        left: part.left as u16,
        top: part.top as u16,
        width: part.width as u16,
        height: part.height as u16,
        buffer: Cow::Owned(buffer),
        ..gif::Frame::default()
    }
}

/// The duration of a picture, in hundredths of a second: a whole number, such that the sum keeps the rate.
fn delay(picture: u32, rate: u32) -> u16 {
    let until = |pictures: u32| (f64::from(pictures) * 100.0 / f64::from(rate)).round();
    (until(picture + 1) - until(picture)) as u16
}

#[cfg(test)]
mod tests {
    use super::super::film::tests::film;
    use super::*;

    /// The pictures of a GIF with their durations.
    fn decoded(bytes: &[u8], (width, height): (usize, usize)) -> Vec<(Vec<u8>, u16)> {
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(bytes).unwrap();
        let mut canvas = vec![0; 3 * width * height];
        let mut pictures = Vec::new();
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            for (k, pixel) in frame.buffer.chunks_exact(4).enumerate().filter(|(_, pixel)| pixel[3] > 0) {
                let (x, y) = (k % usize::from(frame.width), k / usize::from(frame.width));
                let at = 3 * ((usize::from(frame.top) + y) * width + usize::from(frame.left) + x);
                canvas[at..at + 3].copy_from_slice(&pixel[..3]);
            }
            pictures.push((canvas.clone(), frame.delay));
        }
        pictures
    }

    fn gif_of(images: &[Image], rate: u32, size: (u32, u32), at_once: usize) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut gif = Gif::new(&mut bytes, size, rate, Palette::of(&[&images[0]])).unwrap();
        images.chunks(at_once).for_each(|images| gif.add(images).unwrap());
        drop(gif);
        bytes
    }

    #[test]
    fn a_gif_decodes_to_nearly_the_same_pictures() {
        for size in [(40, 30), (200, 120)] {
            let mut images = film(4, size);
            images.push(images[3].clone());
            let bytes = gif_of(&images, 30, (size.0 as u32, size.1 as u32), 5);
            let pictures = decoded(&bytes, size);
            assert_eq!(pictures.len(), 5);
            assert_eq!(pictures.iter().map(|(_, delay)| delay).sum::<u16>(), 17, "5/30 s");
            for ((pixels, _), image) in pictures.iter().zip(&images) {
                let worst = pixels.iter().zip(&image.pixels).map(|(a, b)| a.abs_diff(*b)).max();
                assert!(worst.unwrap() <= 16, "{worst:?}");
            }
        }
    }

    #[test]
    fn the_bytes_do_not_depend_on_batches_or_threads() {
        let images = film(6, (200, 120));
        let on = |threads, at_once| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| gif_of(&images, 25, (200, 120), at_once))
        };
        assert!(on(1, 1) == on(2, 4) && on(2, 6) == on(1, 1));
    }
}
