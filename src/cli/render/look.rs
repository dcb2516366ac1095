//! From where a run is seen and how its obstacles are drawn: as the flags say, and otherwise as its scene states.

use glam::DVec3;

use super::options::Render;
use crate::cli::failure::Failure;
use crate::cli::scenery::{self, Viewpoint, half_towards_eye, projection};
use crate::cli::stated::{Stated, StatedCut};
use crate::cli::values::CutFlag;
use rfm::geom::Aabb;
use rfm::render::{Camera, Cut};
use rfm::view::Levels;

/// What the flags and the scene say.
pub(super) struct Look<'a> {
    options: &'a Render,
    stated: Stated,
}

/// What is taken away of obstacles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Opened {
    /// What hides much of the fluid.
    Automatic,
    Nothing,
    By(Cut),
}

impl<'a> Look<'a> {
    /// `stated` is what the folder of a run tells of its scene.
    pub fn new(options: &'a Render, stated: Option<&Stated>) -> Self {
        Self { options, stated: stated.cloned().unwrap_or_default() }
    }

    /// The camera. One that the flags state has nothing of that of the scene.
    pub fn camera(&self, domain: &Aabb) -> Result<Camera, Failure> {
        let Self { options, stated } = self;
        if options.camera.is_some() {
            return super::solid::camera(options, domain);
        }
        let vector = |stated: Option<[f64; 3]>| stated.map(DVec3::from_array);
        let look_at = options.look_at.or(vector(stated.look_at));
        if look_at.is_some_and(|at| !at.is_finite()) {
            return Err(Failure::usage("--look-at: expected three finite lengths"));
        }
        scenery::tell_of_aim(domain, options.look_at);
        let viewpoint = Viewpoint {
            towards_eye: vector(stated.camera),
            look_at,
            zoom: options.zoom.or(stated.zoom()),
            projection: projection(stated.parallel || options.parallel),
        };
        scenery::camera(domain, viewpoint, options.size)
    }

    pub fn opened(&self, camera: &Camera) -> Opened {
        match (&self.options.cut, self.stated.cut) {
            (Some(CutFlag::Plane(plane)), _) => Opened::By(half_towards_eye(plane, camera)),
            (Some(CutFlag::None), _) | (None, StatedCut::None) => Opened::Nothing,
            (Some(CutFlag::Auto), _) | (None, StatedCut::Auto) => Opened::Automatic,
            (None, StatedCut::Half { .. }) => self.stated.cut.plane().map_or(Opened::Nothing, Opened::By),
        }
    }

    /// The names of obstacles that are not drawn: those of the flag, and those of the scene.
    pub fn hidden(&self) -> [&[String]; 2] {
        [&self.options.hide, &self.stated.hide]
    }

    /// The names of obstacles that are drawn clear, likewise.
    pub fn glass(&self) -> [&[String]; 2] {
        [&self.options.glass, &self.stated.glass]
    }

    /// The ends of the colours of an array, unless they follow from the frames.
    pub fn range(&self, array: &str) -> Option<Levels> {
        let stated = self.stated.fastest.filter(|_| array == "speed");
        let of_flag = self.options.range.map(|(low, high)| Levels { low, high });
        of_flag.or(stated.map(|high| Levels { low: 0.0, high }))
    }
}
