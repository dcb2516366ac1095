//! Questions about many points, and collisions.

use std::cell::OnceCell;

use library::glam::DVec3;
use library::solid::Distances;
use library::sph::Rebound;
use rfm_columns::{Collisions, Column, Job, Number, PARTICLES, Particles, Vectors};

use crate::error::{RfmError, RfmStatus, attempt};
use crate::solid::{RfmEntry, RfmSolid, first_entry, solid as solid_of};

/// Points as columns: the first number of each, and the distance between two, bytes.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct RfmPoints {
    /// x coordinates, m.
    pub x: *const f64,
    /// y coordinates, m.
    pub y: *const f64,
    /// z coordinates, m.
    pub z: *const f64,
    /// Distance between two numbers of a column, bytes; 8 if they follow one another.
    pub stride: isize,
}

/// Room for vectors as columns.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct RfmVectors {
    /// x components.
    pub x: *mut f64,
    /// y components.
    pub y: *mut f64,
    /// z components.
    pub z: *mut f64,
    /// Distance between two numbers of a column, bytes.
    pub stride: isize,
}

/// Room for numbers. Where `values` is null, they are not wanted.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct RfmValues {
    /// The first number.
    pub values: *mut f64,
    /// Distance between two numbers, bytes.
    pub stride: isize,
}

/// Points as columns in single precision: the first number of each, and the distance between two, bytes.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct RfmPointsF32 {
    /// x coordinates, m.
    pub x: *const f32,
    /// y coordinates, m.
    pub y: *const f32,
    /// z coordinates, m.
    pub z: *const f32,
    /// Distance between two numbers of a column, bytes; 4 if they follow one another.
    pub stride: isize,
}

/// Room for vectors as columns in single precision.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct RfmVectorsF32 {
    /// x components.
    pub x: *mut f32,
    /// y components.
    pub y: *mut f32,
    /// z components.
    pub z: *mut f32,
    /// Distance between two numbers of a column, bytes.
    pub stride: isize,
}

/// Room for numbers in single precision. Where `values` is null, they are not wanted.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct RfmValuesF32 {
    /// The first number.
    pub values: *mut f32,
    /// Distance between two numbers, bytes.
    pub stride: isize,
}

/// What became of particles.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RfmCollisions {
    /// Particles that were inside, or on the surface, and have been put back.
    pub hits: usize,
    /// Particles that are inside without a way out within reach. They were left as they are.
    pub stuck: usize,
    /// Particles whose numbers are not finite, or at which the formula has no value. They were left as they are.
    pub undefined: usize,
}

/// A column of the caller: the first number, and the distance between two, bytes.
type Given<P> = (P, isize);

/// Refuses a column that cannot have so many numbers.
fn check<T>(count: usize, is_null: bool, stride: isize, is_written: bool) -> Result<(), RfmError> {
    if count > 0 && is_null {
        return Err(RfmError::bad("a column is null"));
    }
    if is_written && count > 1 && stride.unsigned_abs() < size_of::<T>() {
        return Err(RfmError::bad(format!(
            "a column of results has a stride of {stride} bytes: its numbers overlap"
        )));
    }
    let length = count.checked_mul(stride.unsigned_abs().max(size_of::<T>()));
    match length.and_then(|length| isize::try_from(length).ok()) {
        Some(_) => Ok(()),
        None => Err(RfmError::bad(format!("no memory holds {count} numbers"))),
    }
}

/// Asks a question about many points. Results without a pointer are not wanted.
///
/// # Safety
/// The columns have `count` numbers each, and nobody else uses them meanwhile.
// SAFETY: the caller promises what the job needs
unsafe fn many<T: Number, const N: usize>(
    solid: *const RfmSolid,
    count: usize,
    points: [Given<*const T>; 3],
    results: [Given<*mut T>; N],
    error: *mut *mut RfmError,
    evaluate: impl Fn(&RfmSolid, [&[T]; 3], [&mut [T]; N]),
) -> RfmStatus {
    let work = || {
        // SAFETY: null, or a solid
        let this = unsafe { solid_of(solid) }?;
        for (start, stride) in points {
            check::<T>(count, start.is_null(), stride, false)?;
        }
        for (start, stride) in results {
            if !start.is_null() {
                check::<T>(count, false, stride, true)?;
            }
        }
        let points = points.map(|(start, stride)| Column::new(start.cast_mut(), stride));
        let results = results.map(|(start, stride)| (!start.is_null()).then_some(Column::new(start, stride)));
        // SAFETY: the caller promises the columns; there is one part
        let job = unsafe { Job::new(count, points, results) };
        job.run(0..count, &|points, results| evaluate(this, points, results));
        Ok(())
    };
    // SAFETY: null, or the caller's
    unsafe { attempt(error, work) }
}

/// omega at many points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_omega_many(
    solid: *const RfmSolid,
    count: usize,
    points: RfmPoints,
    omega: RfmValues,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let points = [points.x, points.y, points.z].map(|start| (start, points.stride));
    let results = [(omega.values, omega.stride)];
    let work = |this: &RfmSolid, p: [&[f64]; 3], [w]: [&mut [f64]; 1]| {
        f64::omega(&this.solid, this.chosen.as_ref(), p, w)
    };
    // SAFETY: the caller promises a solid and columns
    unsafe { many::<f64, _>(solid, count, points, results, error, work) }
}

/// omega and its gradient at many points, for the price of the gradient.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_gradient_many(
    solid: *const RfmSolid,
    count: usize,
    points: RfmPoints,
    omega: RfmValues,
    gradient: RfmVectors,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let points = [points.x, points.y, points.z].map(|start| (start, points.stride));
    let results = [
        (omega.values, omega.stride),
        (gradient.x, gradient.stride),
        (gradient.y, gradient.stride),
        (gradient.z, gradient.stride),
    ];
    let work = |this: &RfmSolid, p: [&[f64]; 3], out: [&mut [f64]; 4]| this.solid.omega_grad_many(p, out);
    // SAFETY: the caller promises a solid and columns
    unsafe { many::<f64, _>(solid, count, points, results, error, work) }
}

/// Whether many points are inside (1), on the surface (0) or outside (-1), as rfm_sign; NaN where the formula has no
/// value.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_sign_many(
    solid: *const RfmSolid,
    count: usize,
    points: RfmPoints,
    sign: RfmValues,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let points = [points.x, points.y, points.z].map(|start| (start, points.stride));
    let results = [(sign.values, sign.stride)];
    let work = |this: &RfmSolid, p: [&[f64]; 3], [out]: [&mut [f64]; 1]| this.solid.sign_many(p, out);
    // SAFETY: the caller promises a solid and columns
    unsafe { many::<f64, _>(solid, count, points, results, error, work) }
}

/// The surface as seen from many points, as `rfm_contact`. Results whose pointers are null are not wanted.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_contact_many(
    solid: *const RfmSolid,
    count: usize,
    points: RfmPoints,
    distance: RfmValues,
    normal: RfmVectors,
    curvature: RfmValues,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let points = [points.x, points.y, points.z].map(|start| (start, points.stride));
    let results = [
        (distance.values, distance.stride),
        (normal.x, normal.stride),
        (normal.y, normal.stride),
        (normal.z, normal.stride),
        (curvature.values, curvature.stride),
    ];
    let work = |this: &RfmSolid, p: [&[f64]; 3], out: [&mut [f64]; 5]| this.solid.contact_many(p, out);
    // SAFETY: the caller promises a solid and columns
    unsafe { many::<f64, _>(solid, count, points, results, error, work) }
}

/// The velocity of the surface near many points, as `rfm_wall_velocity`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_wall_velocity_many(
    solid: *const RfmSolid,
    count: usize,
    points: RfmPoints,
    velocity: RfmVectors,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let points = [points.x, points.y, points.z].map(|start| (start, points.stride));
    let results = [velocity.x, velocity.y, velocity.z].map(|start| (start, velocity.stride));
    let work = |this: &RfmSolid, points: [&[f64]; 3], [x, y, z]: [&mut [f64]; 3]| {
        for i in 0..x.len() {
            [x[i], y[i], z[i]] = this.solid.wall_velocity(at(points, i)).to_array();
        }
    };
    // SAFETY: the caller promises a solid and columns
    unsafe { many::<f64, _>(solid, count, points, results, error, work) }
}

/// Radii of balls around many points that are proven not to meet the surface, as `rfm_clearance`. What all points need of
/// the solid is found once, so that this is faster than single points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_clearance_many(
    solid: *const RfmSolid,
    count: usize,
    points: RfmPoints,
    clearance: RfmValues,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let points = [points.x, points.y, points.z].map(|start| (start, points.stride));
    let results = [(clearance.values, clearance.stride)];
    let known = OnceCell::new();
    let work = |this: &RfmSolid, points: [&[f64]; 3], [clearance]: [&mut [f64]; 1]| {
        let distances = known.get_or_init(|| Distances::new(&this.solid));
        for (i, clearance) in clearance.iter_mut().enumerate() {
            *clearance = distances.at(at(points, i)).clearance;
        }
    };
    // SAFETY: the caller promises a solid and columns
    unsafe { many::<f64, _>(solid, count, points, results, error, work) }
}

/// Point `i` of columns.
fn at(points: [&[f64]; 3], i: usize) -> DVec3 {
    DVec3::from_array(points.map(|column| column[i]))
}

/// Where many straight paths first meet the solid, as `rfm_first_entry`. `entries` has room for `count` of them; the
/// numbers of a path that does not meet the solid are NaN, and its `certain` is true: that is proven. Of a path from or
/// to what is no place nothing is known, and its `certain` is false.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_first_entry_many(
    solid: *const RfmSolid,
    count: usize,
    from: RfmPoints,
    to: RfmPoints,
    entries: *mut RfmEntry,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let work = || {
        // SAFETY: null, or a solid
        let this = unsafe { solid_of(solid) }?;
        check::<RfmEntry>(count, entries.is_null(), size_of::<RfmEntry>() as isize, true)?;
        // SAFETY: the caller promises the columns
        let paths = unsafe { vectors(count, [from, to]) }?;
        for i in 0..count {
            let [from, to] = [0, 1].map(|end| DVec3::from_array(paths.get(end, i)));
            let nowhere = [f64::NAN; 3];
            let is_path = from.is_finite() && to.is_finite();
            let none = RfmEntry { part: f64::NAN, point: nowhere, normal: nowhere, certain: is_path };
            // SAFETY: the caller promises room for that many
            unsafe { entries.add(i).write(first_entry(this, from, to).unwrap_or(none)) };
        }
        Ok(())
    };
    // SAFETY: null, or the caller's
    unsafe { attempt(error, work) }
}

/// Points of the caller, which are only read.
///
/// # Safety
/// The columns have `count` numbers each.
// SAFETY: the caller promises what the reads need
pub unsafe fn vectors<const N: usize>(count: usize, points: [RfmPoints; N]) -> Result<Vectors<N>, RfmError> {
    for given in &points {
        for start in [given.x, given.y, given.z] {
            check::<f64>(count, start.is_null(), given.stride, false)?;
        }
    }
    let columns = points
        .map(|given| [given.x, given.y, given.z].map(|start| Column::new(start.cast_mut(), given.stride)));
    // SAFETY: the caller promises the columns
    Ok(unsafe { Vectors::new(count, columns) })
}

/// `rfm_omega_many` in single precision throughout.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_omega_many_f32(
    solid: *const RfmSolid,
    count: usize,
    points: RfmPointsF32,
    omega: RfmValuesF32,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let points = [points.x, points.y, points.z].map(|start| (start, points.stride));
    let results = [(omega.values, omega.stride)];
    let work = |this: &RfmSolid, p: [&[f32]; 3], [w]: [&mut [f32]; 1]| {
        f32::omega(&this.solid, this.chosen.as_ref(), p, w)
    };
    // SAFETY: the caller promises a solid and columns
    unsafe { many::<f32, _>(solid, count, points, results, error, work) }
}

/// `rfm_gradient_many` in single precision throughout.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_gradient_many_f32(
    solid: *const RfmSolid,
    count: usize,
    points: RfmPointsF32,
    omega: RfmValuesF32,
    gradient: RfmVectorsF32,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let points = [points.x, points.y, points.z].map(|start| (start, points.stride));
    let results = [
        (omega.values, omega.stride),
        (gradient.x, gradient.stride),
        (gradient.y, gradient.stride),
        (gradient.z, gradient.stride),
    ];
    let work = |this: &RfmSolid, p: [&[f32]; 3], out: [&mut [f32]; 4]| this.solid.omega_grad_many(p, out);
    // SAFETY: the caller promises a solid and columns
    unsafe { many::<f32, _>(solid, count, points, results, error, work) }
}

/// `rfm_sign_many` in single precision throughout.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_sign_many_f32(
    solid: *const RfmSolid,
    count: usize,
    points: RfmPointsF32,
    sign: RfmValuesF32,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let points = [points.x, points.y, points.z].map(|start| (start, points.stride));
    let results = [(sign.values, sign.stride)];
    let work = |this: &RfmSolid, p: [&[f32]; 3], [out]: [&mut [f32]; 1]| this.solid.sign_many(p, out);
    // SAFETY: the caller promises a solid and columns
    unsafe { many::<f32, _>(solid, count, points, results, error, work) }
}

/// `rfm_contact_many` in single precision throughout.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_contact_many_f32(
    solid: *const RfmSolid,
    count: usize,
    points: RfmPointsF32,
    distance: RfmValuesF32,
    normal: RfmVectorsF32,
    curvature: RfmValuesF32,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let points = [points.x, points.y, points.z].map(|start| (start, points.stride));
    let results = [
        (distance.values, distance.stride),
        (normal.x, normal.stride),
        (normal.y, normal.stride),
        (normal.z, normal.stride),
        (curvature.values, curvature.stride),
    ];
    let work = |this: &RfmSolid, p: [&[f32]; 3], out: [&mut [f32]; 5]| this.solid.contact_many(p, out);
    // SAFETY: the caller promises a solid and columns
    unsafe { many::<f32, _>(solid, count, points, results, error, work) }
}

/// Puts particles that are inside a solid, or on its surface, back outside, at most `reach` metres away. Those that are not
/// deep in it go to the nearest place, others to where the formula's slope leads if that is within reach, otherwise the
/// shortest way found along an axis, and if there is none, one found in all directions; each may be farther.
/// Reflects their velocities relative to that of the surface: the part `restitution` of the normal speed returns, and the
/// tangential speed loses at most `friction` times the change of the normal speed. Particles that stay outside keep their
/// bits.
/// `collisions` may be null. The first call for a solid of many parts takes longer, because it finds out which of them
/// matter where; see rfm_solid_within.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_collide(
    solid: *const RfmSolid,
    count: usize,
    positions: RfmVectors,
    velocities: RfmVectors,
    restitution: f64,
    friction: f64,
    reach: f64,
    collisions: *mut RfmCollisions,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let work = || {
        // SAFETY: null, or a solid
        let this = unsafe { solid_of(solid) }?;
        for vectors in [positions, velocities] {
            for start in [vectors.x, vectors.y, vectors.z] {
                check::<f64>(count, start.is_null(), vectors.stride, true)?;
            }
        }
        let rebound = Rebound::new(restitution, friction, reach).map_err(RfmError::bad)?;
        let [positions, velocities] = [positions, velocities]
            .map(|vectors| [vectors.x, vectors.y, vectors.z].map(|start| Column::new(start, vectors.stride)));
        // SAFETY: the caller promises `count` particles
        let mut particles = Particles::new(unsafe { Vectors::new(count, [positions, velocities]) });
        let mut counts = Collisions::default();
        // a part at a time, so that little is remembered
        for start in (0..count).step_by(PARTICLES) {
            let found = particles.look(start..(start + PARTICLES).min(count), &this.obstacle, &rebound);
            particles.put(&found);
            counts = counts.and(found.counts);
        }
        let Collisions { hits, stuck, undefined } = counts;
        if !collisions.is_null() {
            // SAFETY: the caller may have it written
            unsafe { collisions.write(RfmCollisions { hits, stuck, undefined }) };
        }
        Ok(())
    };
    // SAFETY: null, or the caller's
    unsafe { attempt(error, work) }
}
