//! Clear things: obstacles of glass and the surface of the fluid, blended over the things seen through them.
//!
//! A pixel keeps the nearest and the farthest of the clear triangles that its ray meets: the front and the
//! back of a thing. Triangles between them, such as the inner sides of a thick wall, would only darken the
//! picture.
//!
//! Invariant: sheets are blended from far to near, and equally near ones in their order, so the order of
//! triangles does not matter.

use super::{
    raster::{Band, Corner, Frame},
    shade::Veil,
};

/// The foremost and the hindmost clear triangle at each sub-pixel of a part of a band. Nearness 0 means that
/// there is none.
#[derive(Debug, Clone)]
pub(super) struct Sheet {
    pub frame: Frame,
    front: Vec<(f32, Veil)>,
    back: Vec<(f32, Veil)>,
}

impl Sheet {
    pub fn new(frame: Frame) -> Self {
        let none = vec![(0.0, [0; 4]); frame.rows().len() * frame.columns().len()];
        Self { frame, front: none.clone(), back: none }
    }

    /// Adds a triangle. `veil` takes the weights of the corners, and gives `None` where the triangle is cut
    /// away.
    pub fn hang(&mut self, corners: &[Corner; 3], veil: impl Fn([f32; 3]) -> Option<Veil>) {
        let (front, back) = (&mut self.front, &mut self.back);
        self.frame.fragments(corners, |at, near, weights| {
            let (is_front, is_back) = (near > front[at].0, back[at].0 == 0.0 || near < back[at].0);
            let Some(veil) = (is_front || is_back).then(|| veil(weights)).flatten() else { return };
            if is_front {
                front[at] = (near, veil);
            }
            if is_back {
                back[at] = (near, veil);
            }
        });
    }

    /// The veils at a sub-pixel in front of a nearness: the back, and then the front if it is another
    /// triangle.
    fn before(&self, x: usize, y: usize, nearness: f32) -> impl Iterator<Item = (f32, Veil)> {
        let (columns, rows) = (self.frame.columns(), self.frame.rows());
        let is_here = columns.contains(&x) && rows.contains(&y);
        let pair = is_here.then(|| {
            let at = (y - rows.start) * columns.len() + (x - columns.start);
            let (back, front) = (self.back[at], self.front[at]);
            [Some(back), (front.0 != back.0).then_some(front)]
        });
        pair.into_iter().flatten().flatten().filter(move |(near, _)| *near > nearness)
    }
}

/// Maximum number of veils at a sub-pixel: two for each of the sheets of still and of moving things of glass
/// and of water.
const MOST: usize = 8;

/// Blends sheets over a band.
pub(super) fn blend(sheets: &[&Sheet], band: &mut Band<'_>) {
    let Some(columns) = sheets
        .iter()
        .map(|sheet| sheet.frame.columns())
        .reduce(|a, b| a.start.min(b.start)..a.end.max(b.end))
    else {
        return;
    };
    let columns = columns.start.max(band.left)..columns.end.min(band.left + band.width);
    for y in band.top..band.bottom() {
        for x in columns.clone() {
            let at = band.index(x, y);
            let mut veils = [(0.0, [0; 4]); MOST];
            let mut count = 0;
            for found in sheets.iter().flat_map(|sheet| sheet.before(x, y, band.nearness[at])).take(MOST) {
                // few, and nearly in order
                let mut place = count;
                while place > 0 && veils[place - 1].0 > found.0 {
                    veils[place] = veils[place - 1];
                    place -= 1;
                }
                veils[place] = found;
                count += 1;
            }
            for (_, [r, g, b, opacity]) in &veils[..count] {
                let (opacity, colour) = (u16::from(*opacity), [*r, *g, *b]);
                let over = |under: u8, over: u8| {
                    ((u16::from(over) * opacity + u16::from(under) * (255 - opacity) + 127) / 255) as u8
                };
                let under = band.colour[at];
                band.colour[at] = std::array::from_fn(|i| over(under[i], colour[i]));
            }
        }
    }
}
