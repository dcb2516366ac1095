//! What is known of all frames of a run together: the places of the particles and the ranges of the values at them.

use std::path::Path;

use glam::DVec3;
use rayon::prelude::*;

use super::failure::{Failure, note};
use super::output::Shown;
use super::saved::{self, RunFigures};
use rfm::fluid_surface::{FrameEntry, PointArray};
use rfm::geom::Aabb;
use rfm::view::Levels;

/// The part of the values of a frame at each end that may lie beyond the range of the levels.
const STRAY: f64 = 0.001;

/// What is known of all frames together.
pub(super) struct Survey {
    pub bounds: Aabb,
    /// Name and range of each array that all frames have.
    pub arrays: Vec<(String, Levels)>,
    /// The range of all components of the velocity, with 0 in its middle; `None` if a frame has no velocities.
    pub velocity: Option<Levels>,
    /// The number of particles of all frames together.
    pub particles: usize,
    /// That of each frame.
    pub counts: Vec<usize>,
}

/// Whether an array is that of the velocities.
pub(super) fn is_velocity(array: &PointArray) -> bool {
    array.components == 3 && array.name == "velocity"
}

impl Survey {
    pub fn of(folder: &Path, entries: &[(usize, FrameEntry)]) -> Result<Self, Failure> {
        let surveys: Result<Vec<Self>, Failure> = entries
            .par_iter()
            .map(|(_, entry)| {
                let (points, arrays) = saved::arrays(&folder.join(&entry.file))?;
                Ok(Self::of_frame(&points, &arrays))
            })
            .collect();
        let mut surveys = surveys?.into_iter();
        let mut all = surveys.next().unwrap_or(Self {
            bounds: Aabb::EMPTY,
            arrays: Vec::new(),
            velocity: None,
            particles: 0,
            counts: Vec::new(),
        });
        for next in surveys {
            all.bounds = all.bounds.union(&next.bounds);
            all.particles += next.particles;
            all.counts.extend(next.counts);
            all.velocity = all.velocity.zip(next.velocity).map(|(range, other)| range.with(other));
            all.arrays.retain_mut(|(name, range)| {
                let same = next.arrays.iter().find(|(other, _)| other == name);
                same.inspect(|(_, other)| *range = range.with(*other)).is_some()
            });
        }
        if all.bounds.is_empty() {
            all.bounds = Aabb::new(DVec3::ZERO, DVec3::ONE);
        }
        // colours of speeds begin at rest
        all.arrays.iter_mut().filter(|(name, _)| name == "speed").for_each(|(_, range)| range.low = 0.0);
        Ok(all)
    }

    fn of_frame(points: &[DVec3], arrays: &[PointArray]) -> Self {
        let finite = points.iter().filter(|p| p.is_finite());
        let scalars = arrays.iter().filter(|array| array.components == 1 && array.name != "id");
        let range = |array: &PointArray| {
            let range = Levels::of_most(array.values.iter().copied(), STRAY);
            (array.name.clone(), range.unwrap_or(Levels { low: 0.0, high: 0.0 }))
        };
        Self {
            bounds: finite.fold(Aabb::EMPTY, |all, p| all.including(*p)),
            arrays: scalars.map(range).collect(),
            velocity: arrays.iter().find(|array| is_velocity(array)).map(|array| {
                let sizes = array.values.iter().map(|component| component.abs());
                let largest = Levels::of_most(sizes, STRAY).map_or(0.0, |range| range.high);
                Levels { low: -largest, high: largest }
            }),
            particles: points.len(),
            counts: vec![points.len()],
        }
    }

    /// Says which frames do not seem to be of the run that its summary is about: a run keeps its particles.
    pub fn tell_of_other_runs(
        &self,
        folder: &Path,
        entries: &[(usize, FrameEntry)],
        figures: Option<&RunFigures>,
    ) {
        let told = figures.and_then(|figures| figures.particles);
        let expected = told.or(self.counts.first().copied()).unwrap_or_default();
        let mut others = entries.iter().zip(&self.counts).filter(|(_, count)| **count != expected);
        let Some(((_, entry), count)) = others.next() else { return };
        let more = others.count();
        let more = if more > 0 {
            format!(", and {more} more frames have another number, too")
        } else {
            String::new()
        };
        let run = if told.is_some() { "summary.json tells of" } else { "the first frame has" };
        note(format!(
            "`{}` has {count} particles, and {run} {expected}{more}: frames of another run may be among them",
            folder.join(&entry.file).shown()
        ));
    }

    /// The box of the scene if a summary states it, and otherwise that around all particles.
    pub fn domain(&self, figures: Option<&RunFigures>) -> Aabb {
        figures.and_then(RunFigures::vessel).unwrap_or(self.bounds)
    }

    /// Half the spacing of the particles, m.
    pub fn radius(&self, figures: Option<&RunFigures>, frames: usize) -> f64 {
        let volume = figures.map(RunFigures::particle_volume);
        let volume = volume.filter(|volume| volume.is_finite() && *volume > 0.0).unwrap_or_else(|| {
            // without a summary it is guessed from the box around the particles
            self.bounds.volume() / (self.particles / frames.max(1)).max(1) as f64 / 8.0
        });
        0.5 * volume.cbrt()
    }
}
