//! The shadow on the bottom of the box, which shows whether a thing lies there or flies.
//!
//! The light comes from straight above, and from a wide part of the sky. The shadow of a low thing is dark
//! with a sharp border; the shadow of a high thing is pale and wide. A map keeps the height of the lowest
//! thing over each of its cells.
//!
//! Invariant: the lowest of several heights does not depend on their order.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{Cut, camera::Camera, mesh::MeshView, particles::ParticlesView};
use crate::geom::Aabb;

/// Cells of the map along the longer side of the floor.
const CELLS: f64 = 192.0;
/// Two kinds of shadow, each with three numbers: the height above which a thing casts none, over the diagonal
/// of the box; its darkness for a thing on the floor; and the reach of its blur, over the diagonal of the
/// box.
const SHADOWS: [(f64, f32, f64); 2] = [(0.03, 0.30, 0.006), (0.45, 0.24, 0.03)];
/// Largest difference from the floor's nearness that counts as the floor, as a part of it. The floor is drawn
/// behind its place by twice this.
const SLACK: f64 = 0.5e-4;

/// The floor, and the heights of the things over it.
#[derive(Debug, Clone)]
pub(super) struct Floor {
    low: DVec2,
    level: f64,
    diagonal: f64,
    /// The side of a cell, m.
    cell: f64,
    columns: usize,
    rows: usize,
    /// The heights over the floor of the lowest things, m.
    heights: Vec<f32>,
    /// The nearness of the floor at (x, y) on the screen: a + b·x + c·y.
    nearness: [f64; 3],
}

impl Floor {
    /// The empty floor of a box; `None` if it is not seen from above.
    pub fn new(bounds: &Aabb, camera: &Camera) -> Option<Self> {
        let plane = Cut { normal: DVec3::Z, offset: bounds.min.z };
        let nearness = camera.nearness_of(&plane).filter(|_| camera.is_beyond(&plane))?;
        let size = bounds.size();
        let cell = size.truncate().max_element() / CELLS;
        let count = |length: f64| ((length / cell).ceil() as usize).clamp(1, CELLS as usize + 1);
        if cell.is_nan() || cell <= 0.0 {
            return None;
        }
        let (columns, rows) = (count(size.x), count(size.y));
        Some(Self {
            low: bounds.min.truncate(),
            level: bounds.min.z,
            diagonal: size.length(),
            cell,
            columns,
            rows,
            heights: vec![f32::INFINITY; columns * rows],
            nearness,
        })
    }

    /// Adds the undersides of balls.
    pub fn add_balls(&mut self, particles: &ParticlesView<'_>) {
        let radius = if particles.radius.is_finite() { particles.radius.max(0.0) } else { 0.0 };
        let cell = self.cell;
        for i in 0..particles.positions.len() {
            let p = particles.positions.get(i);
            let middle = (p.truncate() - self.low) / cell;
            let reach = radius / cell;
            let height = p.z - self.level;
            let is_low = (-radius..=SHADOWS[1].0 * self.diagonal + radius).contains(&height);
            if !p.is_finite() || !is_low {
                continue;
            }
            self.lower(middle - reach, middle + reach, |at| {
                // a ball that lies between the middles of cells counts for the cell that it is in
                let off = at.distance_squared(middle).min(reach * reach) * cell * cell;
                Some(p.z - (radius * radius - off).max(0.0).sqrt())
            });
        }
    }

    /// Adds the undersides of a mesh. Clear meshes cast no shadow, and neither do parts that are cut away.
    pub fn add_mesh(&mut self, mesh: &MeshView<'_>) {
        if mesh.material.is_clear() {
            return;
        }
        for triangle in mesh.triangles {
            let corners = triangle.map(|k| mesh.vertices.get(k as usize).copied());
            let [Some(a), Some(b), Some(c)] = corners else { continue };
            let is_below = a.max(b).max(c).z < self.level;
            let is_away = is_below || mesh.cut.is_some_and(|cut| cut.beyond((a + b + c) / 3.0) > 0.0);
            if is_away || ![a, b, c].into_iter().all(DVec3::is_finite) {
                continue;
            }
            let [a, b, c] = [a, b, c].map(|p| ((p.truncate() - self.low) / self.cell).extend(p.z));
            let area = (b - a).truncate().perp_dot((c - a).truncate());
            let lowest = a.z.min(b.z).min(c.z);
            let (low, high) = (a.min(b).min(c).truncate(), a.max(b).max(c).truncate());
            let is_small = (high - low).max_element() < 1.0;
            self.lower(low, high, |at| {
                let part = |p: DVec3, q: DVec3| (q - p).truncate().perp_dot(at - p.truncate()) / area;
                let weights = [part(b, c), part(c, a), part(a, b)];
                if is_small || area == 0.0 {
                    // it may lie between the middles of cells
                    return Some(lowest);
                }
                let is_over = weights.iter().all(|weight| *weight >= 0.0);
                is_over.then(|| weights[0] * a.z + weights[1] * b.z + weights[2] * c.z)
            });
        }
    }

    /// Lowers the cells between two corners, in cells, to the heights at their middles.
    fn lower(&mut self, low: DVec2, high: DVec2, height: impl Fn(DVec2) -> Option<f64>) {
        // `as` rounds down and saturates
        let range = |low: f64, high: f64, count: usize| {
            let end = if high >= 0.0 { (high as usize).saturating_add(1).min(count) } else { 0 };
            (low as usize).min(end)..end
        };
        for y in range(low.y, high.y, self.rows) {
            for x in range(low.x, high.x, self.columns) {
                if let Some(z) = height(DVec2::new(x as f64 + 0.5, y as f64 + 0.5)) {
                    let lowest = &mut self.heights[y * self.columns + x];
                    *lowest = lowest.min((z - self.level).max(0.0) as f32);
                }
            }
        }
    }

    /// The light on each cell of the floor, 0 … 1.
    fn light(&self) -> Vec<f32> {
        let mut light = vec![1.0; self.heights.len()];
        for (highest, dark, blur) in SHADOWS {
            let highest = (highest * self.diagonal) as f32;
            let mut shadow: Vec<f32> =
                self.heights.iter().map(|height| (1.0 - height / highest).max(0.0)).collect();
            let cells = (blur * self.diagonal / self.cell).round() as usize;
            // twice, for smoother borders
            for _ in 0..2 {
                shadow = self.blurred(&shadow, cells);
            }
            light.iter_mut().zip(&shadow).for_each(|(light, shadow)| *light *= 1.0 - dark * shadow);
        }
        light
    }

    /// The means over squares that reach the given number of cells from their middle. Beyond the floor there
    /// is no shadow.
    fn blurred(&self, values: &[f32], reach: usize) -> Vec<f32> {
        let width = self.columns;
        let mut across = vec![0.0; values.len()];
        for (from, to) in values.chunks_exact(width).zip(across.chunks_exact_mut(width)) {
            means(from.iter().copied(), reach, |x, mean| to[x] = mean);
        }
        let mut found = vec![0.0; values.len()];
        for x in 0..width {
            let column = across.iter().skip(x).step_by(width).copied();
            means(column, reach, |y, mean| found[y * width + x] = mean);
        }
        found
    }

    /// Darkens the pixels of a picture that show the floor. `nearness` is that of the nearest sub-pixel of
    /// each pixel.
    pub fn shade(&self, camera: &Camera, nearness: &[f32], light: &mut [f32], width: usize) {
        let map = self.light();
        let [a, b, c] = self.nearness;
        // a pixel has the greatest nearness of its four sub-pixels, whose middles are half a sub-pixel from
        // its own
        let nearest = 0.5 * (b.abs() + c.abs());
        light.par_chunks_mut(width).zip(nearness.par_chunks(width)).enumerate().for_each(
            |(row, (light, near))| {
                for (column, (light, near)) in light.iter_mut().zip(near).enumerate() {
                    let at = DVec2::new(2.0 * column as f64 + 1.0, 2.0 * row as f64 + 1.0);
                    let floor = a + b * at.x + c * at.y;
                    if *near > 0.0 && f64::from(*near) < (floor + nearest) * (1.0 - SLACK) {
                        *light *= self.at(&map, camera.place(at, floor).truncate());
                    }
                }
            },
        );
    }

    /// The light at a place of the floor, between the middles of cells.
    fn at(&self, map: &[f32], place: DVec2) -> f32 {
        let cells = (place - self.low) / self.cell - 0.5;
        let most = DVec2::new((self.columns - 1) as f64, (self.rows - 1) as f64);
        let cells = cells.clamp(DVec2::ZERO, most);
        let (x, y) = (cells.x as usize, cells.y as usize);
        let (u, v) = ((cells.x - x as f64) as f32, (cells.y - y as f64) as f32);
        let (right, up) = ((x + 1).min(self.columns - 1), (y + 1).min(self.rows - 1));
        let value = |x: usize, y: usize| map[y * self.columns + x];
        let (low, high) =
            ((1.0 - u) * value(x, y) + u * value(right, y), (1.0 - u) * value(x, up) + u * value(right, up));
        (1.0 - v) * low + v * high
    }
}

/// Passes to `take` the mean of each value and its neighbours up to `reach` places away. Beyond the ends the
/// values count as zero.
fn means(values: impl Iterator<Item = f32> + Clone, reach: usize, mut take: impl FnMut(usize, f32)) {
    let count = (2 * reach + 1) as f64;
    let (mut ahead, mut behind) = (values.clone(), values.clone());
    let mut sum: f64 = ahead.by_ref().take(reach).map(f64::from).sum();
    for (k, _) in values.enumerate() {
        sum += f64::from(ahead.next().unwrap_or(0.0));
        take(k, (sum / count).max(0.0) as f32);
        if k >= reach {
            sum -= f64::from(behind.next().unwrap_or(0.0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Points;
    use crate::render::Projection;

    fn cube() -> Aabb {
        Aabb::new(DVec3::ZERO, DVec3::splat(2.0))
    }

    fn above() -> Camera {
        Camera::new(&cube(), DVec3::new(0.0, -0.4, 1.0), Projection::Perspective, (320, 240)).unwrap()
    }

    /// The light at places of the floor below one ball.
    fn under(ball: DVec3, places: &[(f64, f64)]) -> Vec<f32> {
        let mut floor = Floor::new(&cube(), &above()).unwrap();
        let [x, y, z] = [[ball.x], [ball.y], [ball.z]];
        floor.add_balls(&ParticlesView { positions: Points::new(&x, &y, &z), values: &[], radius: 0.1 });
        let map = floor.light();
        places.iter().map(|(x, y)| floor.at(&map, DVec2::new(*x, *y))).collect()
    }

    #[test]
    fn a_ball_on_the_floor_has_a_dark_shadow_and_one_above_it_a_pale_one() {
        let places = [(0.5, 0.7), (0.5, 0.9), (1.5, 1.5)];
        let [lying, near, far] = under(DVec3::new(0.5, 0.7, 0.1), &places)[..] else { panic!() };
        assert!(lying < 0.7 && near > lying + 0.1 && far == 1.0, "{lying} {near} {far}");
        let [high, ..] = under(DVec3::new(0.5, 0.7, 0.8), &places)[..] else { panic!() };
        assert!(high > lying + 0.1 && high < 1.0, "{high}");
        assert_eq!(under(DVec3::new(0.5, 0.7, 1.9), &places), [1.0; 3], "too high");
        assert_eq!(under(DVec3::splat(f64::NAN), &places), [1.0; 3]);
        assert_eq!(under(DVec3::new(9.0, -9.0, 0.1), &places), [1.0; 3], "beside the floor");
        assert_eq!(under(DVec3::new(0.5, 0.7, -0.2), &places), [1.0; 3], "below the floor");
    }

    #[test]
    fn the_heights_of_a_mesh_are_those_of_its_triangles() {
        let mut floor = Floor::new(&cube(), &above()).unwrap();
        let tilted = |x: f64, y: f64| DVec3::new(x, y, 0.3 + 0.2 * x - 0.1 * y);
        let vertices = [tilted(0.1, 0.1), tilted(1.7, 0.2), tilted(0.4, 1.8), DVec3::NAN];
        floor.add_mesh(&MeshView {
            vertices: &vertices,
            triangles: &[[0, 1, 2], [0, 1, 3], [0, 1, 9]],
            ..MeshView::default()
        });
        let at = |x: f64, y: f64| {
            let (column, row) = ((x / floor.cell) as usize, (y / floor.cell) as usize);
            let middle = DVec2::new(column as f64 + 0.5, row as f64 + 0.5) * floor.cell;
            (f64::from(floor.heights[row * floor.columns + column]), tilted(middle.x, middle.y).z)
        };
        for (x, y) in [(0.5, 0.5), (1.0, 0.4), (0.6, 1.2)] {
            let (found, expected) = at(x, y);
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        }
        assert_eq!(at(1.8, 1.8).0, f64::INFINITY);
    }

    #[test]
    fn places_on_the_screen_are_those_of_the_floor_that_the_camera_sees() {
        let camera = above();
        let floor = Floor::new(&cube(), &camera).unwrap();
        for p in [DVec3::new(0.3, 1.1, 0.0), DVec3::new(1.9, 0.2, 0.0)] {
            let seen = camera.look(p).unwrap();
            let [a, b, c] = floor.nearness;
            let nearness = a + b * seen.at.x + c * seen.at.y;
            assert!((nearness - seen.nearness).abs() < 1e-12);
            assert!(camera.place(seen.at, nearness).distance(p) < 1e-9);
        }
        assert!(
            Floor::new(
                &cube(),
                &Camera::new(&cube(), DVec3::NEG_Z, Projection::Perspective, (320, 240)).unwrap()
            )
            .is_none()
        );
    }

    #[test]
    fn means_are_those_of_their_definition() {
        let values: Vec<f32> = (0..17).map(|i| ((i * 7 % 5) as f32).sqrt()).collect();
        for reach in [0, 1, 3, 20] {
            let mut found = vec![f32::NAN; values.len()];
            means(values.iter().copied(), reach, |k, mean| found[k] = mean);
            for (k, mean) in found.iter().enumerate() {
                let (low, high) = (k.saturating_sub(reach), (k + reach + 1).min(values.len()));
                let expected = values[low..high].iter().sum::<f32>() / (2 * reach + 1) as f32;
                assert!((mean - expected).abs() < 1e-5, "{reach} {k}");
            }
        }
    }
}
