//! Solids, and questions about one point.

use std::ffi::c_char;

use library::diagnostic::Diagnostics;
use library::field::Field;
use library::geom::Aabb;
use library::glam::{DVec3, Vec3};
use library::solid::{Bounds, Chosen};
use library::{Program, Solid};
use rfm_columns::Obstacle;

use crate::error::{RfmError, RfmStatus, answer, attempt, read_text};
use crate::program::{RfmProgram, hand_out};

/// A compiled obstacle.
pub struct RfmSolid {
    pub solid: Solid,
    /// The cheaper program that keeps the tolerance of the file.
    pub chosen: Option<Chosen>,
    pub obstacle: Obstacle,
    program: Program,
    over: Option<Aabb>,
}

/// What is known about the extent of a solid.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RfmBounds {
    /// The solid is empty; there is no box.
    RFM_EMPTY = 0,
    /// The solid lies in the box.
    RFM_WITHIN = 1,
    /// No box was found.
    RFM_UNBOUNDED = 2,
}

/// The surface as seen from a point: accurate near a face, an estimate far away. Before an edge or a corner that stands
/// out the distance is that of the nearest face's plane: too small by up to 1 - sin(a/2) of it before an edge with the
/// angle a of the solid, 29 % at a right angle, more at an acute one; and by more before a corner, 42 % at that of a box.
/// Inside, beside an edge that goes in, it may be too long, by up to a half between two balls that overlap.
#[repr(C)]
pub struct RfmContact {
    /// Distance, m, positive outside.
    pub distance: f64,
    /// Outward unit normal of the nearest face; the mean of two at an edge; zero where there is none.
    pub normal: [f64; 3],
    /// Mean curvature, 1/m, positive where the solid is convex.
    pub curvature: f64,
}

/// Where a path first meets a solid.
#[repr(C)]
pub struct RfmEntry {
    /// The part of the path before the entry, 0 to 1.
    pub part: f64,
    /// The place, m.
    pub point: [f64; 3],
    /// Outward unit normal; the mean of those that meet there.
    pub normal: [f64; 3],
    /// False where the path only grazes the surface within rounding errors.
    pub certain: bool,
}

impl RfmSolid {
    fn new(program: Program, solid: Solid, over: Option<Aabb>) -> Result<Self, RfmError> {
        let chosen = program
            .within_tolerance(&solid)
            .transpose()
            .map_err(|message| Diagnostics { list: vec![*message], sources: program.sources().clone() })?;
        Ok(Self { obstacle: Obstacle::new(solid.clone(), over), solid, chosen, program, over })
    }
}

/// The solid of a handle.
///
/// # Safety
/// It is null, or a solid.
// SAFETY: the caller promises what the one read needs
pub unsafe fn solid<'a>(handle: *const RfmSolid) -> Result<&'a RfmSolid, RfmError> {
    // SAFETY: null, or a solid
    unsafe { handle.as_ref() }.ok_or_else(|| RfmError::bad("solid is null"))
}

/// Compiles a solid of a program. `solid` is null after a failure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_solid(
    program: *const RfmProgram,
    name: *const c_char,
    solid: *mut *mut RfmSolid,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let compile = || {
        // SAFETY: null, or a program
        let file = unsafe { program.as_ref() }.ok_or_else(|| RfmError::bad("program is null"))?;
        // SAFETY: the caller promises a text
        let name = unsafe { read_text(name, "name") }?;
        RfmSolid::new(file.program.clone(), file.program.solid(name)?, None)
    };
    // SAFETY: null, or the caller's
    unsafe { hand_out((solid, "solid"), error, compile) }
}

/// The solid during a stretch of time, s, as a handle of its own: values are those at the end, ranges and bounds hold
/// for all of it, and paths of `rfm_first_entry` pass from its beginning to its end. Nothing is compiled again. For a
/// single time, both ends are equal. `then` is null after a failure, and is not the place of the handle given.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_solid_between(
    solid: *const RfmSolid,
    from: f64,
    to: f64,
    then: *mut *mut RfmSolid,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let look = || {
        // SAFETY: null, or a solid
        let this = unsafe { self::solid(solid) }?;
        if !(from.is_finite() && to.is_finite()) {
            return Err(RfmError::bad(format!("the times are {from} and {to} s, expected finite numbers")));
        }
        RfmSolid::new(this.program.clone(), this.solid.between(from, to), this.over)
    };
    // SAFETY: null, or the caller's
    unsafe { hand_out((then, "then"), error, look) }
}

/// The solid for particles in a box, given by its lowest and its highest corner, three numbers each, as a handle of its
/// own. All answers stay the same, but rfm_collide with a solid of many parts that has no bounds, such as a vessel with
/// posts in it, is much faster in the box.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_solid_within(
    solid: *const RfmSolid,
    low: *const f64,
    high: *const f64,
    then: *mut *mut RfmSolid,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let look = || {
        // SAFETY: null, or a solid
        let this = unsafe { self::solid(solid) }?;
        // SAFETY: null, or three numbers each
        let over = unsafe { read_box(low, high) }?;
        RfmSolid::new(this.program.clone(), this.solid.clone(), Some(over))
    };
    // SAFETY: null, or the caller's
    unsafe { hand_out((then, "then"), error, look) }
}

/// Whether time occurs in the formula.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_moves(solid: *const RfmSolid) -> bool {
    // SAFETY: null, or a solid
    unsafe { solid.as_ref() }.is_some_and(|this| answer(false, || this.solid.moves()))
}

/// The smallest known box around a solid: its lowest and its highest corner, m. They are written only if there is
/// one; RFM_UNBOUNDED for null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_bounds(solid: *const RfmSolid, low: *mut f64, high: *mut f64) -> RfmBounds {
    // SAFETY: null, or a solid
    let Some(this) = (unsafe { solid.as_ref() }) else { return RfmBounds::RFM_UNBOUNDED };
    match answer(Bounds::Unbounded, || *this.solid.bounds()) {
        Bounds::Empty => RfmBounds::RFM_EMPTY,
        Bounds::Unbounded => RfmBounds::RFM_UNBOUNDED,
        Bounds::Within(found) => {
            // SAFETY: null, or three numbers of the caller
            unsafe {
                write(low, found.min.to_array());
                write(high, found.max.to_array());
            }
            RfmBounds::RFM_WITHIN
        }
    }
}

/// The least and the greatest value that omega may have in a box, guaranteed; infinite where nothing is known.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_range(
    solid: *const RfmSolid,
    low: *const f64,
    high: *const f64,
    range: *mut f64,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let find = || {
        // SAFETY: null, or a solid
        let this = unsafe { self::solid(solid) }?;
        if range.is_null() {
            return Err(RfmError::bad("the range is null"));
        }
        // SAFETY: null, or three numbers each
        let over = unsafe { read_box(low, high) }?;
        let found = this.solid.range(&over);
        // SAFETY: and room for two
        unsafe { write(range, [found.lo, found.hi]) };
        Ok(())
    };
    // SAFETY: null, or the caller's
    unsafe { attempt(error, find) }
}

/// A box of the caller.
///
/// # Safety
/// Its corners are null, or have three numbers each.
// SAFETY: the caller promises what the two reads need
pub unsafe fn read_box(low: *const f64, high: *const f64) -> Result<Aabb, RfmError> {
    if low.is_null() || high.is_null() {
        return Err(RfmError::bad("a corner of the box is null"));
    }
    // SAFETY: the caller promises three numbers each
    let (low, high) = unsafe { (*low.cast::<[f64; 3]>(), *high.cast::<[f64; 3]>()) };
    let over = Aabb::new(DVec3::from_array(low), DVec3::from_array(high));
    if over.is_empty() || !over.is_finite() {
        return Err(RfmError::bad("the box is empty or not finite"));
    }
    Ok(over)
}

/// Writes numbers to the caller, unless there is nowhere to write to.
///
/// # Safety
/// `to` is null, or has room.
// SAFETY: the caller promises what the one write needs
unsafe fn write<T, const N: usize>(to: *mut T, numbers: [T; N]) {
    if !to.is_null() {
        // SAFETY: there is room
        unsafe { to.cast::<[T; N]>().write_unaligned(numbers) };
    }
}

/// omega at a point; NaN for null, and where the formula has no value. If the file states a tolerance, it is computed
/// by the cheapest program that keeps it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_omega(solid: *const RfmSolid, x: f64, y: f64, z: f64) -> f64 {
    // SAFETY: null, or a solid
    let Some(this) = (unsafe { solid.as_ref() }) else { return f64::NAN };
    let p = DVec3::new(x, y, z);
    answer(f64::NAN, || match &this.chosen {
        None => this.solid.omega(p),
        Some(chosen) => chosen.omega(p),
    })
}

/// `rfm_omega` in single precision throughout.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_omega_f32(solid: *const RfmSolid, x: f32, y: f32, z: f32) -> f32 {
    // SAFETY: null, or a solid
    let Some(this) = (unsafe { solid.as_ref() }) else { return f32::NAN };
    answer(f32::NAN, || this.solid.omega_f32(Vec3::new(x, y, z)))
}

/// omega at a point, and its gradient, three numbers, which may be null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_gradient(
    solid: *const RfmSolid,
    x: f64,
    y: f64,
    z: f64,
    gradient: *mut f64,
) -> f64 {
    // SAFETY: null, or a solid
    let found = unsafe { solid.as_ref() }
        .map(|this| answer((f64::NAN, DVec3::NAN), || this.solid.omega_grad(DVec3::new(x, y, z))));
    let (omega, found) = found.unwrap_or((f64::NAN, DVec3::NAN));
    // SAFETY: null, or three numbers of the caller
    unsafe { write(gradient, found.to_array()) };
    omega
}

/// `rfm_gradient` in single precision throughout.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_gradient_f32(
    solid: *const RfmSolid,
    x: f32,
    y: f32,
    z: f32,
    gradient: *mut f32,
) -> f32 {
    // SAFETY: null, or a solid
    let found = unsafe { solid.as_ref() }
        .map(|this| answer((f32::NAN, Vec3::NAN), || this.solid.omega_grad_f32(Vec3::new(x, y, z))));
    let (omega, found) = found.unwrap_or((f32::NAN, Vec3::NAN));
    // SAFETY: null, or three numbers of the caller
    unsafe { write(gradient, found.to_array()) };
    omega
}

/// Whether a point is inside (1), on the surface (0) or outside (-1): exactly the logic of the parts, each by the sign of
/// its rounded formula. NaN where the formula has no value.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_sign(solid: *const RfmSolid, x: f64, y: f64, z: f64) -> f64 {
    // SAFETY: null, or a solid
    let Some(this) = (unsafe { solid.as_ref() }) else { return f64::NAN };
    answer(f64::NAN, || this.solid.sign(DVec3::new(x, y, z)))
}

/// The surface as seen from a point; all numbers are NaN for null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_contact(solid: *const RfmSolid, x: f64, y: f64, z: f64) -> RfmContact {
    let none = || RfmContact { distance: f64::NAN, normal: [f64::NAN; 3], curvature: f64::NAN };
    // SAFETY: null, or a solid
    let Some(this) = (unsafe { solid.as_ref() }) else { return none() };
    answer(none(), || {
        let found = this.solid.contact(DVec3::new(x, y, z));
        RfmContact {
            distance: found.distance,
            normal: found.normal.to_array(),
            curvature: found.mean_curvature,
        }
    })
}

/// The radius of a ball around a point that is proven not to meet the surface, m, as `rfm eval --what clearance`: never more
/// than the distance, and mostly within 1e-4 of it; positive inside, too, and finite. It takes a thousand times as long as
/// `rfm_contact`. NaN for null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_clearance(solid: *const RfmSolid, x: f64, y: f64, z: f64) -> f64 {
    // SAFETY: null, or a solid
    let Some(this) = (unsafe { solid.as_ref() }) else { return f64::NAN };
    answer(f64::NAN, || this.solid.distance(DVec3::new(x, y, z)).clearance)
}

/// The velocity of the surface near a point, m/s: three numbers, zero for a solid at rest. Of a solid that moves and turns
/// without changing its shape it is the whole velocity, of others the part along the normal.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_wall_velocity(
    solid: *const RfmSolid,
    x: f64,
    y: f64,
    z: f64,
    velocity: *mut f64,
) {
    // SAFETY: null, or a solid
    let found = unsafe { solid.as_ref() }
        .map(|this| answer(DVec3::NAN, || this.solid.wall_velocity(DVec3::new(x, y, z))));
    // SAFETY: null, or three numbers of the caller
    unsafe { write(velocity, found.unwrap_or(DVec3::NAN).to_array()) };
}

/// Where the straight path between two points, three numbers each, first meets the solid. False if it does not: it
/// is proven that nothing of the path is in the solid, however thin the solid and long the path. `entry` may be null.
/// After an error, for null, or for numbers that are not finite, the answer is false as well.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_first_entry(
    solid: *const RfmSolid,
    from: *const f64,
    to: *const f64,
    entry: *mut RfmEntry,
) -> bool {
    // SAFETY: null, or a solid
    let Some(this) = (unsafe { solid.as_ref() }) else { return false };
    if from.is_null() || to.is_null() {
        return false;
    }
    // SAFETY: the caller promises three numbers each
    let (from, to) = unsafe { (*from.cast::<[f64; 3]>(), *to.cast::<[f64; 3]>()) };
    let found = answer(None, || first_entry(this, DVec3::from_array(from), DVec3::from_array(to)));
    let Some(met) = found else { return false };
    // SAFETY: null, or room for one
    unsafe { write(entry, [met]) };
    true
}

/// Where the straight path between two points first meets a solid, as C sees it.
pub fn first_entry(this: &RfmSolid, from: DVec3, to: DVec3) -> Option<RfmEntry> {
    // nothing is known of a path from or to nowhere
    if !(from.is_finite() && to.is_finite()) {
        return None;
    }
    let found = this.solid.first_entry(from, to)?;
    let normal = found.normals.mean().unwrap_or(DVec3::ZERO).to_array();
    Some(RfmEntry { part: found.t, point: found.point.to_array(), normal, certain: found.certain })
}

/// Frees a solid; does nothing with null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_solid_free(solid: *mut RfmSolid) {
    if !solid.is_null() {
        // SAFETY: `hand_out` made it, and the caller frees it once
        answer((), || drop(unsafe { Box::from_raw(solid) }));
    }
}
