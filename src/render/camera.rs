//! The view: a mild perspective, or parallel lines, that show the whole box, with z upwards.
//!
//! Screen coordinates are sub-pixels, two per pixel each way, with x to the right and y down. Nearness is linear on the
//! screen along lines and planes: in a perspective the inverse of the depth along the view, and among parallel lines
//! the tangent to that at the distance D of the box's middle, (2D − depth)/D².

use glam::{DVec2, DVec3};

use super::overlay::unit;
use super::{Cut, RenderError};
use crate::geom::Aabb;

/// Sub-pixels per pixel in each direction.
pub(super) const SUBPIXELS: usize = 2;

/// The distance of the eye from the centre of the box, in diagonals of the box. Parallel lines stay
/// nearly parallel.
const DISTANCE: f64 = 3.0;

/// That distance where lines are parallel. What is seen does not depend on it, only how even the nearness is (more so with a
/// larger one) and how finely single precision resolves it (with a smaller one).
const PARALLEL_DISTANCE: f64 = 12.0;

/// The margins around the box in units of the layout: left, top, right (colour bar), bottom (caption).
const MARGINS: [f64; 4] = [48.0, 56.0, 150.0, 72.0];

/// How lines that are parallel in space are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Projection {
    /// They meet far away: what is nearer is larger.
    #[default]
    Perspective,
    /// They stay parallel: lengths across the view can be measured in the picture.
    Parallel,
}

/// A view of a box.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// The picture's width in pixels.
    pub(super) width: u32,
    /// The picture's height in pixels.
    pub(super) height: u32,
    /// The place of the eye. Among parallel lines it stands for their direction, and for where depth begins.
    eye: DVec3,
    /// The distance of the eye from the middle of the box if lines are parallel; `None` in a perspective.
    parallel: Option<f64>,
    right: DVec3,
    up: DVec3,
    /// The direction from the scene to the eye.
    back: DVec3,
    /// Sub-pixels per unit length at depth one, or at any depth times the distance of the eye.
    focal: f64,
    /// The point where the axis of the view meets the screen.
    centre: DVec2,
}

/// A point as the camera sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Seen {
    pub at: DVec2,
    pub nearness: f64,
}

impl Camera {
    /// The usual picture size: width and height in pixels.
    pub const SIZE: (u32, u32) = (1280, 960);

    /// The three-quarter view of a box: x to the right, y away from the eye, from a little above. `size` is
    /// the picture's width and height in pixels.
    ///
    /// # Errors
    /// Those of [`Camera::new`].
    pub fn three_quarter(bounds: &Aabb, size: (u32, u32)) -> Result<Self, RenderError> {
        Self::new(bounds, DVec3::ZERO, Projection::Perspective, size)
    }

    /// A view of the whole box from the direction `towards_eye`, which may have any length. If it is zero or
    /// not finite, the view is from the direction of the three-quarter one. `size` is the picture's width and height in
    /// pixels.
    ///
    /// # Errors
    /// [`RenderError::Bounds`] for a box that is empty, infinite or a point; [`RenderError::Size`] for a
    /// picture with a side outside 16 ..= 8192.
    pub fn new(
        bounds: &Aabb,
        towards_eye: DVec3,
        projection: Projection,
        size: (u32, u32),
    ) -> Result<Self, RenderError> {
        let diagonal = bounds.size().length();
        if bounds.is_empty() || !diagonal.is_finite() || diagonal <= 0.0 {
            return Err(RenderError::Bounds(*bounds));
        }
        let (width, height) = size;
        if !(16..=8192).contains(&width) || !(16..=8192).contains(&height) {
            return Err(RenderError::Size(width, height));
        }
        let back = towards_eye.try_normalize().unwrap_or(DVec3::new(0.48, -1.0, 0.46).normalize());
        // in a view straight from above or below, y points up in the picture
        let right = DVec3::Z.cross(back).try_normalize().unwrap_or(DVec3::X);
        let up = back.cross(right);
        let (distance, parallel) = match projection {
            Projection::Perspective => (DISTANCE * diagonal, None),
            Projection::Parallel => (PARALLEL_DISTANCE * diagonal, Some(PARALLEL_DISTANCE * diagonal)),
        };
        let eye = bounds.centre() + distance * back;
        let mut camera =
            Self { width, height, eye, parallel, right, up, back, focal: 1.0, centre: DVec2::ZERO };
        camera.fit(bounds);
        Ok(camera)
    }

    /// Sets the focal length and the centre so that the box fills the picture except for the margins.
    fn fit(&mut self, bounds: &Aabb) {
        let corners = bounds.corners().map(|corner| self.look(corner).map_or(DVec2::ZERO, |seen| seen.at));
        let (low, high) =
            corners.iter().fold((corners[0], corners[0]), |(low, high), p| (low.min(*p), high.max(*p)));
        let (corner, end) = self.room();
        let room = end - corner;
        self.focal = (room / (high - low).max(DVec2::splat(1e-12))).min_element();
        self.centre = corner + 0.5 * room - 0.5 * self.focal * (low + high);
    }

    /// The view with a point in the middle of the area within the margins, and everything `zoom` times as
    /// large.
    #[must_use]
    pub fn aimed(mut self, at: DVec3, zoom: f64) -> Self {
        self.focal *= zoom;
        let (low, high) = self.room();
        if let Some(seen) = self.look(at) {
            self.centre += 0.5 * (low + high) - seen.at;
        }
        self
    }

    /// The corners of the part of the picture within the margins, in sub-pixels.
    fn room(&self) -> (DVec2, DVec2) {
        let page = SUBPIXELS as f64 * DVec2::new(f64::from(self.width), f64::from(self.height));
        let [left, top, right, bottom] = MARGINS.map(|m| m * SUBPIXELS as f64 * unit(f64::from(self.height)));
        let low = DVec2::new(left, top);
        (low, low + (page - DVec2::new(left + right, top + bottom)).max(0.25 * page))
    }

    /// A point on the screen. `None` for points that are not finite, and for those behind or very near
    /// the eye.
    pub(super) fn look(&self, p: DVec3) -> Option<Seen> {
        let d = p - self.eye;
        let depth = -d.dot(self.back);
        let nearness = match self.parallel {
            None => 1.0 / depth,
            Some(distance) => (2.0 * distance - depth) / (distance * distance),
        };
        let at = self.centre + self.magnification(nearness) * DVec2::new(d.dot(self.right), -d.dot(self.up));
        (nearness > 0.0 && at.abs().max_element() < 1e6).then_some(Seen { at, nearness })
    }

    /// The point that is seen at a place on the screen with a nearness.
    pub(super) fn place(&self, at: DVec2, nearness: f64) -> DVec3 {
        let (depth, wide) = match self.parallel {
            None => (1.0 / nearness, 1.0 / nearness),
            Some(distance) => (distance * (2.0 - nearness * distance), distance),
        };
        let across = (at - self.centre) * (wide / self.focal);
        self.eye + across.x * self.right - across.y * self.up - depth * self.back
    }

    /// The nearness of a plane as a function of the place on the screen: n = a + b·x + c·y. `None` if the plane is seen
    /// as a line.
    pub(super) fn nearness_of(&self, plane: &Cut) -> Option<[f64; 3]> {
        let ahead = plane.offset - plane.normal.dot(self.eye);
        let normal = self.turn(plane.normal);
        // normal·(a, b, −depth) = ahead, with a and b across the view
        let (middle, slope) = match self.parallel {
            None => {
                let normal = normal / ahead;
                (-normal.z, DVec2::new(normal.x, -normal.y) / self.focal)
            }
            Some(distance) => {
                let slope = DVec2::new(-normal.x, normal.y) / (normal.z * distance * self.focal);
                ((2.0 + ahead / (normal.z * distance)) / distance, slope)
            }
        };
        let found = [middle - slope.dot(self.centre), slope.x, slope.y];
        found.iter().all(|part| part.is_finite()).then_some(found)
    }

    /// Whether the eye lies on the side of a plane that is cut away.
    pub fn is_beyond(&self, plane: &Cut) -> bool {
        match self.parallel {
            None => plane.normal.dot(self.eye) > plane.offset,
            Some(_) => plane.normal.dot(self.back) > 0.0,
        }
    }

    /// The direction from the scene to the eye, of length 1.
    pub fn towards_eye(&self) -> DVec3 {
        self.back
    }

    /// A direction in the camera's frame: x to the right, y up, z towards the eye.
    pub(super) fn turn(&self, direction: DVec3) -> DVec3 {
        DVec3::new(direction.dot(self.right), direction.dot(self.up), direction.dot(self.back))
    }

    /// A vector from a point towards the eye.
    pub(super) fn to_eye(&self, p: DVec3) -> DVec3 {
        match self.parallel {
            None => self.eye - p,
            Some(distance) => distance * self.back,
        }
    }

    /// Sub-pixels per unit length at a nearness.
    pub(super) fn magnification(&self, nearness: f64) -> f64 {
        self.focal * self.weight(nearness)
    }

    /// By how much the nearness grows per unit length towards the eye.
    pub(super) fn growth(&self, nearness: f64) -> f64 {
        let weight = self.weight(nearness);
        weight * weight
    }

    /// What makes a quantity that is linear in space linear on the screen, as a factor.
    pub(super) fn weight(&self, nearness: f64) -> f64 {
        match self.parallel {
            None => nearness,
            Some(distance) => 1.0 / distance,
        }
    }

    /// The numbers of columns and rows of sub-pixels.
    pub(super) fn subpixels(&self) -> (usize, usize) {
        (SUBPIXELS * self.width as usize, SUBPIXELS * self.height as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube() -> Aabb {
        Aabb::new(DVec3::ZERO, DVec3::splat(3.0))
    }

    #[test]
    fn the_box_lies_in_the_picture_with_z_up_and_x_to_the_right() {
        let camera = Camera::three_quarter(&cube(), Camera::SIZE).unwrap();
        for corner in cube().corners() {
            let at = camera.look(corner).unwrap().at;
            assert!(
                (95.0..=2560.0 - 299.0).contains(&at.x) && (111.0..=1920.0 - 143.0).contains(&at.y),
                "{at}"
            );
        }
        let see = |x: f64, y: f64, z: f64| camera.look(DVec3::new(x, y, z)).unwrap();
        assert!(see(0.0, 0.0, 3.0).at.y < see(0.0, 0.0, 0.0).at.y);
        assert!(see(3.0, 0.0, 0.0).at.x > see(0.0, 0.0, 0.0).at.x);
        assert!(see(0.0, 0.0, 0.0).nearness > see(0.0, 3.0, 0.0).nearness);
    }

    #[test]
    fn an_aimed_view_has_its_point_in_the_middle_and_is_larger() {
        let camera = Camera::three_quarter(&cube(), (1280, 720)).unwrap();
        let point = DVec3::new(0.5, 2.0, 1.0);
        let near = camera.clone().aimed(point, 3.0);
        let (low, high) = near.room();
        assert!(near.look(point).unwrap().at.distance(0.5 * (low + high)) < 1e-9);
        let length = |camera: &Camera| {
            let see = |p: DVec3| camera.look(p).unwrap().at;
            see(point).distance(see(point + DVec3::Z))
        };
        assert!((length(&near) / length(&camera) - 3.0).abs() < 1e-9);
    }

    #[test]
    fn a_picture_is_as_high_as_the_viewer_takes_it_to_be() {
        let camera =
            Camera::new(&cube(), DVec3::new(0.6, -0.64, 0.48), Projection::Perspective, (1280, 720)).unwrap();
        let (low, high) = camera.room();
        let nearness = camera.look(DVec3::splat(1.5)).unwrap().nearness;
        let height = (high.y - low.y) / camera.magnification(nearness);
        // tests/viewer asks the page for the same figure
        assert!((height - 4.692_309_429_472).abs() < 1e-6, "{height}");
    }

    #[test]
    fn lines_meet_as_in_the_viewer_however_large_things_are() {
        let camera =
            Camera::new(&cube(), DVec3::new(0.6, -0.64, 0.48), Projection::Perspective, (1280, 720)).unwrap();
        let near = camera.clone().aimed(DVec3::new(2.0, 1.0, 0.5), 5.0);
        for camera in [camera, near] {
            let nearness = |x: f64, y: f64, z: f64| camera.look(DVec3::new(x, y, z)).unwrap().nearness;
            let ratio = nearness(3.0, 0.0, 3.0) / nearness(0.0, 3.0, 0.0);
            // tests/viewer asks the page for the same figure
            assert!((ratio - 1.396_665_022_888_28).abs() < 1e-9, "{ratio}");
        }
    }

    #[test]
    fn both_projections_know_where_a_point_is_and_where_a_plane() {
        for projection in [Projection::Perspective, Projection::Parallel] {
            let camera = Camera::new(&cube(), DVec3::new(0.6, -0.64, 0.48), projection, (1280, 720)).unwrap();
            let camera = camera.aimed(DVec3::new(2.0, 1.0, 0.5), 1.5);
            let normal = DVec3::new(0.6, 0.0, 0.8);
            let plane = Cut { normal, offset: normal.dot(DVec3::splat(1.5)) };
            let [a, b, c] = camera.nearness_of(&plane).unwrap();
            for k in 0..8 {
                let p = DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) * 2.5;
                let seen = camera.look(p).unwrap();
                assert!(camera.place(seen.at, seen.nearness).distance(p) < 1e-11);
                let on_plane = p + (plane.offset - normal.dot(p)) / normal.z * DVec3::Z;
                let seen = camera.look(on_plane).unwrap();
                assert!((a + b * seen.at.x + c * seen.at.y - seen.nearness).abs() < 1e-14);
                let step = 1e-6 * camera.towards_eye();
                let nearer =
                    camera.look(p + step).unwrap().nearness - camera.look(p - step).unwrap().nearness;
                let growth = camera.growth(camera.look(p).unwrap().nearness);
                assert!((nearer / 2e-6 / growth - 1.0).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn parallel_lines_stay_parallel_and_as_long() {
        let camera =
            Camera::new(&cube(), DVec3::new(0.6, -0.64, 0.48), Projection::Parallel, (1280, 720)).unwrap();
        let edge = |from: DVec3| camera.look(from + DVec3::Z).unwrap().at - camera.look(from).unwrap().at;
        for corner in cube().corners() {
            assert!(edge(corner).distance(edge(DVec3::ZERO)) < 1e-9);
        }
        let (low, high) = camera.room();
        let height = (high.y - low.y) / camera.magnification(1.0);
        // tests/viewer asks the page for the same figure
        assert!((height - 4.667_214_263_486).abs() < 1e-6, "{height}");
        for corner in cube().corners() {
            let at = camera.look(corner).unwrap().at;
            assert!(at.cmpge(low - 1e-6).all() && at.cmple(high + 1e-6).all(), "{at}");
        }
    }

    #[test]
    fn odd_boxes_and_views_are_errors_or_drawn() {
        let size = Camera::SIZE;
        assert!(matches!(Camera::three_quarter(&Aabb::EMPTY, size), Err(RenderError::Bounds(_))));
        let point = Aabb::new(DVec3::ONE, DVec3::ONE);
        assert!(matches!(Camera::three_quarter(&point, size), Err(RenderError::Bounds(_))));
        assert!(matches!(Camera::three_quarter(&cube(), (0, 10)), Err(RenderError::Size(0, 10))));
        let flat = Aabb::new(DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0));
        for towards_eye in [DVec3::Z, DVec3::NAN, DVec3::ZERO, DVec3::X] {
            let camera = Camera::new(&flat, towards_eye, Projection::Perspective, size).unwrap();
            assert!(camera.look(DVec3::ZERO).is_some());
            assert!(camera.look(DVec3::NAN).is_none());
            assert!(camera.look(1e9 * camera.back).is_none(), "behind the eye");
        }
    }
}
