//! The fluid: particles, drawn as balls that cut into each other where they overlap.

use rayon::prelude::*;

use super::{
    camera::Camera,
    overlay::Scale,
    raster::{BAND_ROWS, Band},
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
    /// The nearness of the front of the ball, minus that of its middle.
    bulge: f32,
    colour: [f32; 3],
}

/// The smallest radius in sub-pixels. Smaller discs could fall between the middles of sub-pixels and flicker.
const MIN_RADIUS: f32 = 0.9;

/// Finds the discs of all particles, in their order; `None` for those that the camera does not see.
pub fn discs(particles: &ParticlesView<'_>, camera: &Camera, scale: &Scale, found: &mut Vec<Option<Disc>>) {
    let radius = if particles.radius.is_finite() { particles.radius.max(0.0) } else { 0.0 };
    let disc = |i: usize| {
        let seen = camera.look(particles.positions.get(i))?;
        let value = particles.values.get(i).copied().unwrap_or(f64::NAN);
        Some(Disc {
            x: seen.at.x as f32,
            y: seen.at.y as f32,
            radius: (camera.magnification(seen.nearness) * radius).min(1e6) as f32,
            nearness: seen.nearness as f32,
            // a ball is small beside its distance
            bulge: (radius * camera.growth(seen.nearness)) as f32,
            colour: scale.colour(value).map(f32::from),
        })
    };
    (0..particles.positions.len()).into_par_iter().map(disc).collect_into_vec(found);
}

/// The columns of a band's sub-pixels that discs may reach; empty without discs.
pub(super) fn columns(discs: &[Disc]) -> (i64, i64) {
    let none = (i64::MAX, i64::MIN);
    discs.iter().fold(none, |all, disc| {
        // `as` saturates
        let (left, right) = (disc.x - disc.reach() - 1.0, disc.x + disc.reach() + 1.0);
        (all.0.min(left as i64), all.1.max(right as i64))
    })
}

/// Draws discs, near ones first. In a crowd most discs are hidden by those in front, and are skipped.
pub(super) fn draw(discs: &[Disc], band: &mut Band<'_>) {
    let mut hidden = Hidden { left: band.left, farthest: vec![0.0; band.width.div_ceil(TILE)] };
    let mut next = FIRST_LOOK;
    for (k, disc) in discs.iter().enumerate() {
        if k == next {
            hidden.look(band);
            next *= 2;
        }
        if !hidden.hides(disc) {
            disc.draw(band);
        }
    }
}

/// Number of columns of a band that form a tile.
const TILE: usize = 16;
/// Number of discs that are drawn before the first update of the limits that hide others.
const FIRST_LOOK: usize = 128;

/// The limits that hide discs in a band: the least nearness in each of its tiles at the last update. They
/// stay valid, because nearness only grows.
struct Hidden {
    left: usize,
    farthest: Vec<f32>,
}

impl Hidden {
    fn look(&mut self, band: &Band<'_>) {
        self.farthest.fill(f32::INFINITY);
        for line in band.nearness.chunks_exact(band.width) {
            for (farthest, part) in self.farthest.iter_mut().zip(line.chunks(TILE)) {
                *farthest =
                    part.iter().fold(*farthest, |least, near| if *near < least { *near } else { least });
            }
        }
    }

    /// Whether a disc lies behind the limits everywhere. Discs beside the band are not drawn.
    fn hides(&self, disc: &Disc) -> bool {
        let reach = disc.reach() + 1.0;
        // `as` rounds down and saturates
        let tile = |x: f32| (x as usize).saturating_sub(self.left) / TILE;
        let (first, last) = (tile(disc.x - reach), tile(disc.x + reach));
        let foremost = disc.nearness + disc.bulge;
        self.farthest.iter().take(last.saturating_add(1)).skip(first).all(|farthest| foremost <= *farthest)
    }
}

/// Puts into `found` the discs that may reach each band, near ones first, because most of the others are then
/// hidden and need no shading. Equally near ones keep their order. `order` is working memory.
pub(super) fn by_band(
    discs: &[Option<Disc>],
    bands: usize,
    order: &mut Vec<u64>,
    found: &mut Vec<Vec<Disc>>,
) {
    // nearness is positive, so its bits sort as it does; the index makes every key unique
    let key = |(i, disc): (usize, &Option<Disc>)| {
        disc.as_ref().map(|disc| u64::from(!disc.nearness.to_bits()) << 32 | i as u64)
    };
    order.clear();
    order.extend(discs.iter().enumerate().filter_map(key));
    order.par_sort_unstable();
    found.resize_with(bands, Vec::new);
    found.iter_mut().for_each(Vec::clear);
    for key in order {
        let Some(disc) = discs[(*key & u64::from(u32::MAX)) as usize] else { continue };
        // `as` rounds down and saturates
        let band = |y: f32| (y / BAND_ROWS as f32) as usize;
        if disc.y + disc.reach() + 1.0 < 0.0 {
            continue;
        }
        let (first, last) = (band(disc.y - disc.reach() - 1.0), band(disc.y + disc.reach() + 1.0));
        found.iter_mut().take(last.saturating_add(1)).skip(first).for_each(|list| list.push(disc));
    }
}

impl Disc {
    fn reach(&self) -> f32 {
        self.radius.max(MIN_RADIUS)
    }

    pub fn draw(&self, band: &mut Band<'_>) {
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
