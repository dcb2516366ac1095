//! The fluid: particles, drawn as balls that cut into each other where they overlap.

use rayon::prelude::*;

use super::{
    camera::{Camera, SUBPIXELS},
    overlay::Scale,
    raster::{BAND_ROWS, Band, Canvas},
    shade,
};
use crate::field::Points;

/// Particles by reference.
#[derive(Debug, Clone, Copy)]
pub struct ParticlesView<'a> {
    /// The positions in metres.
    pub positions: Points<'a>,
    /// The values that choose the colours, in the unit of the [`Scale`]. Particles without a value are grey.
    pub values: &'a [f64],
    /// The radius of every ball in metres. Neighbours touch if it is half their spacing.
    pub radius: f64,
}

/// A ball on the screen: a disc in sub-pixels with the front side of a ball.
#[derive(Debug, Clone, Copy)]
pub struct Disc {
    x: f32,
    y: f32,
    radius: f32,
    nearness: f32,
    /// The nearness of the front of the ball, less that of its middle.
    bulge: f32,
    colour: [f32; 3],
}

/// The least radius in sub-pixels. Smaller discs could fall between the middles of sub-pixels and flicker.
const MIN_RADIUS: f32 = 0.9;

/// The discs of all particles that the camera sees, in the particles' order.
pub fn discs(particles: &ParticlesView<'_>, camera: &Camera, scale: &Scale) -> Vec<Disc> {
    let radius = if particles.radius.is_finite() { particles.radius.max(0.0) } else { 0.0 };
    let disc = |i: usize| {
        let seen = camera.look(particles.positions.get(i))?;
        let value = particles.values.get(i).copied().unwrap_or(f64::NAN);
        Some(Disc {
            x: seen.at.x as f32,
            y: seen.at.y as f32,
            radius: (camera.magnification(seen.nearness) * radius).min(1e6) as f32,
            nearness: seen.nearness as f32,
            // the derivative of 1/depth, because a ball is small beside its distance
            bulge: (radius * seen.nearness * seen.nearness) as f32,
            colour: scale.colour(value).map(f32::from),
        })
    };
    let seen: Vec<_> = (0..particles.positions.len()).into_par_iter().map(disc).collect();
    seen.into_iter().flatten().collect()
}

/// Draws discs over the canvas, and then what `finish` adds. Only the `pixels` near discs change, so they
/// must already hold the finished picture of the canvas.
pub fn draw(discs: &[Disc], canvas: &Canvas, finish: impl Fn(&mut Band<'_>) + Sync, pixels: &mut [u8]) {
    let stride = canvas.width / SUBPIXELS;
    let height = canvas.nearness.len() / canvas.width;
    let by_band = by_band(discs, height.div_ceil(BAND_ROWS));
    pixels.par_chunks_mut(3 * stride * BAND_ROWS / SUBPIXELS).enumerate().for_each(|(k, out)| {
        let rows = k * BAND_ROWS..((k + 1) * BAND_ROWS).min(height);
        let here = &by_band[k];
        let left = here.iter().map(|d| d.x - d.reach()).fold(f32::INFINITY, f32::min);
        let right = here.iter().map(|d| d.x + d.reach()).fold(f32::NEG_INFINITY, f32::max);
        // whole pixels; the rest of the row stays as it is
        let even = |x: f32| (x.max(0.0) as usize).min(canvas.width) / SUBPIXELS * SUBPIXELS;
        let columns = even(left)..(even(right + 1.0) + SUBPIXELS).min(canvas.width);
        if here.is_empty() || columns.is_empty() {
            return;
        }
        let (mut nearness, mut colour) = canvas.copy(rows.clone(), columns.clone());
        let mut band = Band {
            left: columns.start,
            top: rows.start,
            width: columns.len(),
            nearness: &mut nearness,
            colour: &mut colour,
        };
        for disc in here {
            disc.draw(&mut band);
        }
        finish(&mut band);
        band.average(out, stride);
    });
}

/// The discs that may reach each band, near ones first: most of the others are then hidden and need no shading. Equally
/// near ones keep their order.
fn by_band(discs: &[Disc], bands: usize) -> Vec<Vec<Disc>> {
    // nearness is positive, so its bits have its order; the index makes every key another one
    let key = |(i, disc): (usize, &Disc)| u64::from(!disc.nearness.to_bits()) << 32 | i as u64;
    let mut keys: Vec<u64> = discs.par_iter().enumerate().map(key).collect();
    keys.par_sort_unstable();
    let mut found = vec![Vec::new(); bands];
    for key in keys {
        let disc = discs[(key & u64::from(u32::MAX)) as usize];
        // `as` saturates
        let band = |y: f32| (y / BAND_ROWS as f32).floor().max(0.0) as usize;
        if disc.y + disc.reach() + 1.0 < 0.0 {
            continue;
        }
        let (first, last) = (band(disc.y - disc.reach() - 1.0), band(disc.y + disc.reach() + 1.0));
        found.iter_mut().take(last.saturating_add(1)).skip(first).for_each(|list| list.push(disc));
    }
    found
}

impl Disc {
    fn reach(&self) -> f32 {
        self.radius.max(MIN_RADIUS)
    }

    fn draw(&self, band: &mut Band<'_>) {
        let reach = self.reach();
        let scale = 1.0 / reach;
        let foremost = self.nearness + self.bulge;
        let rows = band.rows(f64::from(self.y - reach) - 1.0, f64::from(self.y + reach));
        for y in rows {
            let v = (y as f32 + 0.5 - self.y) * scale;
            let half = f64::from(reach * (1.0 - v * v).max(0.0).sqrt());
            let columns = band.columns(f64::from(self.x) - half - 1.0, f64::from(self.x) + half);
            let start = band.index(columns.start, y);
            // most rows of a crowd are hidden altogether, and this loop takes many pixels at a time
            let line = &band.nearness[start..start + columns.len()];
            if !line.iter().fold(false, |open, near| open | (*near < foremost)) {
                continue;
            }
            for (x, at) in columns.zip(start..) {
                let u = (x as f32 + 0.5 - self.x) * scale;
                let flat = u * u + v * v;
                if flat > 1.0 || foremost <= band.nearness[at] {
                    continue;
                }
                let front = (1.0 - flat).sqrt();
                let near = self.nearness + self.bulge * front;
                if near > band.nearness[at] {
                    band.nearness[at] = near;
                    band.colour[at] = shade::ball(self.colour, [u, -v, front]);
                }
            }
        }
    }
}
