//! `--simplify`: fewer triangles within a distance of the surface that is measured, not only aimed at.

use std::time::Instant;

use super::super::args::Tolerance;
use super::super::note;
use crate::field::Field;
use crate::geom::Aabb;
use crate::mesh::{Mesh, Quality, Reference, simplify};

/// A simplified mesh and what was found about it.
pub(super) struct Simplified {
    pub mesh: Mesh,
    pub quality: Quality,
    /// Triangles before.
    pub from: usize,
    /// Metres.
    pub tolerance: f64,
    pub milliseconds: f64,
}

impl Tolerance {
    /// In metres, for a mesh.
    fn of(self, mesh: &Mesh) -> f64 {
        let bounds = mesh.positions.iter().fold(Aabb::EMPTY, |bounds, p| bounds.including(*p));
        match self {
            Self::Length(length) => length,
            Self::OfDiagonal(part) if bounds.is_empty() => part,
            Self::OfDiagonal(part) => part * bounds.size().length(),
        }
    }
}

/// Parts of the tolerance to aim at: the measure has other samples than the simplification, which lie a little further
/// off now and then.
const AIMS: [f64; 3] = [0.95, 0.8, 0.5];

/// Simplifies a mesh as far as the tolerance allows. If the measured distance is too large each time, the mesh stays
/// as it was.
pub(super) fn simplified(
    mesh: &Mesh,
    tolerance: Tolerance,
    distance: &dyn Field,
    reference: &Reference<'_>,
) -> Simplified {
    let tolerance = tolerance.of(mesh);
    let from = mesh.triangles.len();
    let started = Instant::now();
    let spent = |started: Instant| started.elapsed().as_secs_f64() * 1e3;
    let own = reference.measure(mesh);
    let reachable = tolerance.max(own.hausdorff());
    if own.hausdorff() > tolerance {
        note(format!(
            "before it is simplified the mesh is already {:.2e} m from the surface, more than the {tolerance:.2e} m \
             asked for; try more cells, or --method dc for sharp edges",
            own.hausdorff()
        ));
    }
    for aim in AIMS {
        let mut mesh = mesh.clone();
        simplify(&mut mesh, distance, aim * tolerance);
        let quality = reference.measure(&mesh);
        if quality.hausdorff() <= reachable {
            return Simplified { mesh, quality, from, tolerance, milliseconds: spent(started) };
        }
    }
    note("no simplified mesh was found to be near enough to the surface: all triangles are kept");
    Simplified { mesh: mesh.clone(), quality: own, from, tolerance, milliseconds: spent(started) }
}
