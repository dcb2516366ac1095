//! The maps of all obstacles of a scene: one of those at rest, and one of each that moves without deformation.

use glam::DVec3;

use super::{Taken, VolumeMap};
use crate::{
    geom::{Aabb, Placement},
    sph::walls::Obstacle,
};

/// How far beyond the box the map of a moving body reaches, in diagonals of the box. Bodies turn about places outside.
const BEYOND: f64 = 2.0;

/// What obstacles take of kernels.
#[derive(Default)]
pub(in crate::sph) struct Maps {
    at_rest: Option<VolumeMap>,
    /// For each obstacle, where it is to be found.
    bodies: Vec<Body>,
}

enum Body {
    /// In the map of all that are at rest.
    AtRest,
    /// In a map of its own, made where it is at the time 0. It is elsewhere now; `None` if it has another shape.
    Moving(Box<VolumeMap>, Option<Placement>),
    /// Nowhere.
    Unknown,
}

/// What the maps know of an obstacle at a place.
pub(in crate::sph) enum Known {
    /// It is one of those at rest, see [`Maps::at_rest`].
    AtRest,
    Taken(Taken),
    /// It is not near.
    Nothing,
    /// Only its faces tell.
    ByFaces,
}

impl Maps {
    /// The maps of obstacles in a box, for a support radius, m. Moving ones are where they are at a time, s.
    pub fn new(obstacles: &[Obstacle], domain: &Aabb, h: f64, time: f64) -> Self {
        let at_rest = obstacles.iter().filter(|obstacle| obstacle.moving.is_none());
        let at_rest = VolumeMap::new(at_rest.map(|obstacle| obstacle.field.clone()).collect(), domain, h);
        let around = domain.grown(BEYOND * domain.size().length());
        let body = |obstacle: &Obstacle| match &obstacle.moving {
            None if at_rest.is_some() => Body::AtRest,
            Some(moving) if moving.placement(0.0).is_some() => {
                match VolumeMap::new(vec![obstacle.field.clone()], &around, h) {
                    Some(map) => Body::Moving(Box::new(map), moving.placement(time)),
                    None => Body::Unknown,
                }
            }
            None | Some(_) => Body::Unknown,
        };
        Self { bodies: obstacles.iter().map(body).collect(), at_rest }
    }

    /// Moves the bodies to where they are at a time, s.
    pub fn move_to(&mut self, obstacles: &[Obstacle], time: f64) {
        for (body, obstacle) in self.bodies.iter_mut().zip(obstacles) {
            if let (Body::Moving(_, placement), Some(moving)) = (body, &obstacle.moving) {
                *placement = moving.placement(time);
            }
        }
    }

    /// Memory of the maps, bytes.
    pub fn bytes(&self) -> usize {
        let moving = self.bodies.iter().map(|body| match body {
            Body::Moving(map, _) => map.bytes(),
            Body::AtRest | Body::Unknown => 0,
        });
        self.at_rest.as_ref().map_or(0, VolumeMap::bytes) + moving.sum::<usize>()
    }

    /// What the obstacles at rest take of the kernel at a place in the box.
    pub fn at_rest(&self, p: DVec3) -> Option<Taken> {
        self.at_rest.as_ref()?.at(p)
    }

    /// What an obstacle takes of the kernel at a place.
    pub fn of(&self, k: usize, p: DVec3) -> Known {
        match self.bodies.get(k) {
            Some(Body::AtRest) => Known::AtRest,
            Some(Body::Moving(map, Some(placement))) => {
                let there = placement.back(p);
                if !map.reaches(there) {
                    return Known::ByFaces;
                }
                map.at(there).map_or(Known::Nothing, |taken| Known::Taken(taken.turned(&placement.rotation)))
            }
            Some(Body::Moving(_, None) | Body::Unknown) | None => Known::ByFaces,
        }
    }
}
