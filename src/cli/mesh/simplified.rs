//! `--simplify`: fewer triangles within a stated distance of the surface. The distance is measured, not only
//! aimed at.

use std::time::Instant;

use super::super::args::MeshMethod;
use super::super::failure::note;
use super::super::progress;
use super::super::values::Tolerance;
use super::stopwatch::milliseconds;
use rfm::field::Field;
use rfm::geom::Aabb;
use rfm::mesh::{Mesh, Quality, Reference, simplify};

/// What was found about a simplified mesh.
pub(super) struct Simplified {
    /// `None` if the tolerance was refused at once, because the mesh itself is farther away: it is what it was.
    pub quality: Option<Quality>,
    /// The distance from the surface in metres, or what it is at least if there is no quality.
    pub error: f64,
    /// The number of triangles before.
    pub from: usize,
    /// In metres.
    pub tolerance: f64,
    /// The time to contract edges.
    pub simplifying: f64,
    /// The time to measure what came of it.
    pub measuring: f64,
}

impl Simplified {
    fn new(quality: Quality, (from, tolerance): (usize, f64), (simplifying, measuring): (f64, f64)) -> Self {
        Self { quality: Some(quality), error: quality.hausdorff(), from, tolerance, simplifying, measuring }
    }
}

impl Tolerance {
    /// The tolerance for a mesh, in metres.
    fn of(self, mesh: &Mesh) -> f64 {
        let bounds = mesh.positions.iter().fold(Aabb::EMPTY, |bounds, p| bounds.including(*p));
        match self {
            Self::Length(length) => length,
            Self::OfDiagonal(part) if bounds.is_empty() => part,
            Self::OfDiagonal(part) => part * bounds.size().length(),
        }
    }
}

/// Tolerances above this part of a mesh's thickness are reported.
const COARSE: f64 = 0.2;

/// Parts of the tolerance to aim at, in turn. The measure has other samples than the simplification, and some
/// of them lie a few hundredths further off.
const AIMS: [f64; 3] = [0.9, 0.75, 0.5];

/// Reports a tolerance, m, that is as large as the mesh is thick.
fn warn_of_coarse(mesh: &Mesh, tolerance: f64) {
    let bounds = mesh.positions.iter().fold(Aabb::EMPTY, |bounds, p| bounds.including(*p));
    let thickness = bounds.size().min_element();
    if tolerance > COARSE * thickness {
        note(format!(
            "--simplify allows {tolerance:.2e} m, and the mesh is only {thickness:.2e} m thick: little is left of its shape"
        ));
    }
}

/// Says that a mesh is farther from the surface than it may be after simplification, both in metres.
fn say_too_far(distance: f64, tolerance: f64, method: MeshMethod) {
    let advice = match method {
        MeshMethod::Mc => "try more cells, or --method dc for sharp edges",
        MeshMethod::Dc => "try more cells",
    };
    note(format!(
        "the mesh is {distance:.2e} m from the surface as it is, more than the {tolerance:.2e} m asked for, so all \
         triangles are kept; {advice}"
    ));
}

/// Simplifies a mesh as far as the tolerance allows. If its own distance is larger, or the measured one is too large
/// at every aim, the mesh stays as it was.
pub(super) fn simplified(
    mesh: &mut Mesh,
    tolerance: Tolerance,
    distance: &dyn Field,
    reference: &Reference<'_>,
    method: MeshMethod,
) -> Simplified {
    let (tolerance, from) = (tolerance.of(mesh), mesh.triangles.len());
    warn_of_coarse(mesh, tolerance);
    // asked first, because contracting edges and measuring what comes of it take most of the time
    let started = Instant::now();
    let least = reference.least_distance(mesh);
    if least > tolerance {
        say_too_far(least, tolerance, method);
        let measuring = milliseconds(started);
        return Simplified { quality: None, error: least, from, tolerance, simplifying: 0.0, measuring };
    }
    let (mut simplifying, mut measuring) = (0.0, milliseconds(started));
    let measure = |mesh: &Mesh, time: &mut f64| {
        let (started, bar) = (Instant::now(), progress::shares("measuring"));
        let quality = reference.measure(mesh, &bar);
        bar.finish_and_clear();
        *time += milliseconds(started);
        quality
    };
    let mut own = None;
    for aim in AIMS {
        let mut less = mesh.clone();
        let (started, bar) = (Instant::now(), progress::shares("simplifying"));
        simplify(&mut less, distance, aim * tolerance, &bar);
        bar.finish_and_clear();
        simplifying += milliseconds(started);
        let quality = measure(&less, &mut measuring);
        if quality.hausdorff() <= tolerance {
            *mesh = less;
            return Simplified::new(quality, (from, tolerance), (simplifying, measuring));
        }
        let own: &Quality = own.get_or_insert_with(|| measure(mesh, &mut measuring));
        if own.hausdorff() > tolerance {
            say_too_far(own.hausdorff(), tolerance, method);
            return Simplified::new(*own, (from, tolerance), (simplifying, measuring));
        }
    }
    note("no simplified mesh was found to be near enough to the surface: all triangles are kept");
    let quality = own.unwrap_or_else(|| measure(mesh, &mut measuring));
    Simplified::new(quality, (from, tolerance), (simplifying, measuring))
}
