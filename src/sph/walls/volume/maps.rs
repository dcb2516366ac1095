//! The maps of all obstacles of a scene: one of those at rest, one of each, or of each part of one, that moves without
//! deformation, and those of each that changes its shape.

use std::sync::Arc;

use glam::DVec3;

use super::{
    changing::{Changing, ChangingShape},
    map::{Taken, VolumeMap},
};
use crate::{
    field::{Moving, Walls},
    geom::{Aabb, Placement},
};

/// How far beyond the box the map of a moving body reaches, in diagonals of the box. Bodies turn about places outside.
const BEYOND: f64 = 2.0;

/// A part of an obstacle that moves without deformation, otherwise than its other parts.
#[derive(Clone)]
pub struct RigidPart {
    /// The field of the part at the time 0, ω > 0 inside.
    pub field: Arc<dyn Walls>,
    /// Its motion; `None` if it is at rest.
    pub moving: Option<Arc<dyn Moving>>,
}

/// An obstacle.
pub(in crate::sph) struct Mapped<'a> {
    /// Its field at the time 0.
    pub field: &'a Arc<dyn Walls>,
    /// `None` if it is at rest.
    pub motion: Option<&'a Arc<dyn Moving>>,
    /// The parts that move differently, if there are any.
    pub parts: &'a [RigidPart],
    /// How it changes its shape; `None` if it does not, or if that is not known.
    pub changing: Option<&'a ChangingShape>,
}

/// What obstacles take of kernels.
#[derive(Default)]
pub(in crate::sph) struct Maps {
    at_rest: Option<VolumeMap>,
    /// For each obstacle, where it is to be found.
    bodies: Vec<Body>,
    /// Whether any body moves without changing its shape.
    any_moves: bool,
    /// Whether the maps of any body are known that changes its shape.
    any_changes: bool,
}

enum Body {
    /// In the map of all that are at rest.
    AtRest,
    /// In a map of its own.
    Whole(Box<Rigid>),
    /// In a map for each part.
    Parts(Vec<Rigid>),
    /// In maps for instants.
    Changing(Box<Changing>),
    /// Nowhere.
    Unknown,
}

/// A map that was made where a body is at the time 0. It is elsewhere now.
struct Rigid {
    map: VolumeMap,
    /// `None` if it is at rest.
    motion: Option<Arc<dyn Moving>>,
    /// Where it is; `None` if it has another shape.
    placement: Option<Placement>,
    /// The field of a moving part during the present step.
    during: Option<Box<dyn Walls>>,
}

impl Rigid {
    fn new(field: &Arc<dyn Walls>, motion: Option<&Arc<dyn Moving>>, around: &Aabb, h: f64) -> Option<Self> {
        let map = VolumeMap::new(vec![field.clone()], around, h)?;
        Some(Self { map, motion: motion.cloned(), placement: Some(Placement::IDENTITY), during: None })
    }

    fn move_to(&mut self, time: f64) {
        if let Some(motion) = &self.motion {
            self.placement = motion.placement(time);
        }
    }

    /// What it takes of the kernel at a place.
    fn at(&self, p: DVec3) -> Known {
        let Some(placement) = &self.placement else { return Known::ByFaces };
        let there = placement.back(p);
        if !self.map.reaches(there) {
            return Known::ByFaces;
        }
        self.map.at(there).map_or(Known::Nothing, |taken| Known::Taken(taken.turned(&placement.rotation)))
    }

    /// The velocity of a point that it carries along, m/s.
    fn velocity(&self, p: DVec3) -> DVec3 {
        self.during.as_ref().map_or(DVec3::ZERO, |field| field.wall_velocity(p))
    }
}

/// What the maps know of an obstacle at a place.
pub(in crate::sph) enum Known {
    /// It is one of those at rest, see [`Maps::in_box`].
    AtRest,
    /// It moves as a whole.
    Taken(Taken),
    /// It changes its shape, see [`Maps::in_box`].
    Changing,
    /// What each of its parts takes, and the velocity at which this moves, m/s.
    Parts(Vec<(Taken, DVec3)>),
    /// It is not near.
    Nothing,
    /// Only its faces are known.
    ByFaces,
}

impl Maps {
    /// The maps of obstacles in a box, for a support radius, m, as they are at a time, s.
    pub fn new(obstacles: &[Mapped<'_>], domain: &Aabb, h: f64, time: f64) -> Self {
        let at_rest = obstacles.iter().filter(|obstacle| obstacle.motion.is_none());
        let at_rest = VolumeMap::new(at_rest.map(|obstacle| obstacle.field.clone()).collect(), domain, h);
        let around = domain.grown(BEYOND * domain.size().length());
        let body = |&Mapped { field, motion, parts, changing }: &Mapped<'_>| match motion {
            None if at_rest.is_some() => Body::AtRest,
            Some(_) if !parts.is_empty() => {
                let maps = parts.iter().map(|part| Rigid::new(&part.field, part.moving.as_ref(), &around, h));
                maps.collect::<Option<Vec<_>>>().map_or(Body::Unknown, Body::Parts)
            }
            Some(_) if changing.is_some() => {
                let changing = changing.and_then(|shape| Changing::new(shape, domain, h, time));
                changing.map_or(Body::Unknown, |changing| Body::Changing(Box::new(changing)))
            }
            Some(motion) if motion.placement(0.0).is_some() => {
                let whole = Rigid::new(field, Some(motion), &around, h);
                whole.map_or(Body::Unknown, |whole| Body::Whole(Box::new(whole)))
            }
            None | Some(_) => Body::Unknown,
        };
        let bodies: Vec<Body> = obstacles.iter().map(body).collect();
        let any_moves = bodies.iter().any(|body| matches!(body, Body::Whole(_) | Body::Parts(_)));
        let any_changes = bodies.iter().any(|body| matches!(body, Body::Changing(_)));
        let mut maps = Self { bodies, at_rest, any_moves, any_changes };
        maps.move_to(time, time);
        maps
    }

    /// Moves the bodies to where they are at the end of a step between two times, s.
    pub fn move_to(&mut self, from: f64, to: f64) {
        for body in &mut self.bodies {
            match body {
                Body::AtRest | Body::Unknown => {}
                Body::Whole(whole) => whole.move_to(to),
                Body::Changing(changing) => changing.move_to(to),
                Body::Parts(parts) => {
                    for part in parts {
                        part.move_to(to);
                        part.during = part.motion.as_ref().map(|motion| motion.during(from, to));
                    }
                }
            }
        }
    }

    /// Memory of the maps, bytes.
    pub fn bytes(&self) -> usize {
        let of_body = |body: &Body| match body {
            Body::AtRest | Body::Unknown => 0,
            Body::Whole(whole) => whole.map.bytes(),
            Body::Changing(changing) => changing.bytes(),
            Body::Parts(parts) => parts.iter().map(|part| part.map.bytes()).sum(),
        };
        self.at_rest.as_ref().map_or(0, VolumeMap::bytes) + self.bodies.iter().map(of_body).sum::<usize>()
    }

    /// Whether any body moves without changing its shape.
    pub fn any_moves(&self) -> bool {
        self.any_moves
    }

    /// The part of the kernel at any place that an obstacle takes which moves without changing its shape; 0 if it does
    /// not, or if that is not known there.
    pub fn part_of_moving(&self, k: usize, p: DVec3) -> f64 {
        let part = |rigid: &Rigid| match rigid.at(p) {
            Known::Taken(taken) => taken.part,
            Known::AtRest | Known::Changing | Known::Parts(_) | Known::Nothing | Known::ByFaces => 0.0,
        };
        match self.bodies.get(k) {
            Some(Body::Whole(whole)) => part(whole),
            Some(Body::Parts(parts)) => parts.iter().map(part).sum::<f64>().min(1.0),
            Some(Body::AtRest | Body::Changing(_) | Body::Unknown) | None => 0.0,
        }
    }

    /// What the obstacles at rest, and those of the `near` ones that change their shape, take of the part of the kernel
    /// that lies in the box: their maps end there. Those of bodies that move as they are do not.
    pub fn in_box(&self, near: impl Iterator<Item = usize>, p: DVec3) -> Option<Taken> {
        let at_rest = self.at_rest.as_ref().and_then(|map| map.at(p));
        if !self.any_changes {
            return at_rest;
        }
        let changing = near.filter_map(|k| match self.bodies.get(k) {
            Some(Body::Changing(changing)) => changing.at(p),
            Some(Body::AtRest | Body::Whole(_) | Body::Parts(_) | Body::Unknown) | None => None,
        });
        at_rest.into_iter().chain(changing).reduce(|one, other| one.beside(&other))
    }

    /// What an obstacle takes of the kernel at a place.
    pub fn of(&self, k: usize, p: DVec3) -> Known {
        match self.bodies.get(k) {
            Some(Body::AtRest) => Known::AtRest,
            Some(Body::Whole(whole)) => whole.at(p),
            Some(Body::Changing(_)) => Known::Changing,
            Some(Body::Parts(parts)) => {
                let mut taken = Vec::new();
                for part in parts {
                    match part.at(p) {
                        Known::Taken(by_part) => taken.push((by_part, part.velocity(p))),
                        Known::Nothing => {}
                        Known::AtRest | Known::Parts(_) | Known::Changing | Known::ByFaces => {
                            return Known::ByFaces;
                        }
                    }
                }
                if taken.is_empty() { Known::Nothing } else { Known::Parts(taken) }
            }
            Some(Body::Unknown) | None => Known::ByFaces,
        }
    }
}
