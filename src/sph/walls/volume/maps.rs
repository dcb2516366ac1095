//! The maps of all obstacles of a scene: one of those at rest, and one of each that moves without deformation.

use std::sync::Arc;

use glam::DVec3;

use super::map::{Taken, VolumeMap};
use crate::{
    field::{Moving, Walls},
    geom::{Aabb, Placement},
};

/// How far beyond the box the map of a moving body reaches, in diagonals of the box. Bodies turn about places outside.
const BEYOND: f64 = 2.0;

/// An obstacle: its field at the time 0, and its motion.
pub(in crate::sph) type Mapped<'a> = (&'a Arc<dyn Walls>, Option<&'a Arc<dyn Moving>>);

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
    Moving { map: Box<VolumeMap>, motion: Arc<dyn Moving>, placement: Option<Placement> },
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
    /// The maps of obstacles in a box, for a support radius, m: of each its field at the time 0, and its motion. They are
    /// where they are at a time, s.
    pub fn new(obstacles: &[Mapped<'_>], domain: &Aabb, h: f64, time: f64) -> Self {
        let at_rest = obstacles.iter().filter(|(_, motion)| motion.is_none());
        let at_rest = VolumeMap::new(at_rest.map(|&(field, _)| field.clone()).collect(), domain, h);
        let around = domain.grown(BEYOND * domain.size().length());
        let body = |&(field, motion): &Mapped<'_>| match motion {
            None if at_rest.is_some() => Body::AtRest,
            Some(motion) if motion.placement(0.0).is_some() => {
                VolumeMap::new(vec![field.clone()], &around, h).map_or(Body::Unknown, |map| Body::Moving {
                    map: Box::new(map),
                    motion: motion.clone(),
                    placement: motion.placement(time),
                })
            }
            None | Some(_) => Body::Unknown,
        };
        Self { bodies: obstacles.iter().map(body).collect(), at_rest }
    }

    /// Moves the bodies to where they are at a time, s.
    pub fn move_to(&mut self, time: f64) {
        for body in &mut self.bodies {
            if let Body::Moving { motion, placement, .. } = body {
                *placement = motion.placement(time);
            }
        }
    }

    /// Memory of the maps, bytes.
    pub fn bytes(&self) -> usize {
        let moving = self.bodies.iter().map(|body| match body {
            Body::Moving { map, .. } => map.bytes(),
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
            Some(Body::Moving { map, placement: Some(placement), .. }) => {
                let there = placement.back(p);
                if !map.reaches(there) {
                    return Known::ByFaces;
                }
                map.at(there).map_or(Known::Nothing, |taken| Known::Taken(taken.turned(&placement.rotation)))
            }
            Some(Body::Moving { placement: None, .. } | Body::Unknown) | None => Known::ByFaces,
        }
    }
}
