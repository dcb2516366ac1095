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

/// Parts of the tolerance to aim at: the measure has other samples than the simplification, of which some lie a few
/// hundredths further off.
const AIMS: [f64; 3] = [0.9, 0.75, 0.5];

/// Simplifies a mesh as far as the tolerance allows. If the measured distance is too large each time, the mesh stays
/// as it was.
pub(super) fn simplified(
    mesh: &Mesh,
    tolerance: Tolerance,
    distance: &dyn Field,
    reference: &Reference<'_>,
) -> Simplified {
    let tolerance = tolerance.of(mesh);
    let started = Instant::now();
    let found = |mesh: Mesh, quality: Quality, from: usize| {
        let milliseconds = started.elapsed().as_secs_f64() * 1e3;
        Simplified { mesh, quality, from, tolerance, milliseconds }
    };
    let from = mesh.triangles.len();
    let mut own = None;
    for aim in AIMS {
        let mut less = mesh.clone();
        simplify(&mut less, distance, aim * tolerance);
        let quality = reference.measure(&less);
        if quality.hausdorff() <= tolerance {
            return found(less, quality, from);
        }
        let own: &Quality = own.get_or_insert_with(|| reference.measure(mesh));
        if own.hausdorff() > tolerance {
            note(format!(
                "before it is simplified the mesh is already {:.2e} m from the surface, more than the \
                 {tolerance:.2e} m asked for; try more cells, or --method dc for sharp edges",
                own.hausdorff()
            ));
            return found(less, quality, from);
        }
    }
    note("no simplified mesh was found to be near enough to the surface: all triangles are kept");
    let quality = own.unwrap_or_else(|| reference.measure(mesh));
    found(mesh.clone(), quality, from)
}
