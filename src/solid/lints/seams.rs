//! Places within a solid at which ω is zero although no surface is meant there: on a line, or throughout a part of space.

use glam::DVec3;

use crate::geom::Aabb;
use crate::solid::Solid;

/// Points on each line on which seams are looked for.
const POINTS: usize = 32;

/// How far from a seam its sides are, over the size of the solid.
const BESIDE: f64 = 1e-4;

/// Most points of the bounds at which ω is looked at, and points around each zero.
const ALL_OVER: usize = 4096;
const AROUND: u32 = 16;

/// Operations that are spent on them, of which a point takes as many as the formula has.
const OPERATIONS: usize = 5_000_000;

/// How large the room is in which ω is to be zero, over the size of the solid.
const ROOM: f64 = 1e-2;

impl Solid {
    /// A place within the bounds around which ω is exactly zero, at all points that were tried. A surface has no such
    /// room: an operand is zero throughout a part of space, and decides nothing there.
    pub fn flat_room(&self) -> Option<DVec3> {
        let bounds = self.bounds().aabb()?;
        let half = DVec3::splat(ROOM * bounds.size().max_element());
        let is_zero = |p: DVec3| self.omega(p) == 0.0;
        let is_flat = |p: DVec3| {
            let room = Aabb::new(p - half, p + half);
            (1..=AROUND).all(|k| is_zero(room.evenly(k)))
        };
        let points = (OPERATIONS / self.formula().0.len()).min(ALL_OVER) as u32;
        (1..=points).map(|k| bounds.evenly(k)).find(|p| is_zero(*p) && is_flat(*p))
    }

    /// A place at which ω is exactly zero although everything around it is inside. This happens if an outline
    /// with an edge on the axis is turned about that axis. It is looked for on the axes of the scene and on
    /// those of the box around the solid, one of which is the axis of a body that was turned.
    pub fn seam(&self) -> Option<DVec3> {
        let bounds = self.bounds().aabb()?;
        let beside = BESIDE * bounds.size().max_element();
        let on_line = |through: DVec3, axis: usize| {
            let mut at = through;
            let across = [DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]];
            (0..POINTS).find_map(|k| {
                let part = (k as f64 + 0.5) / POINTS as f64;
                at[axis] = bounds.min[axis] + part * bounds.size()[axis];
                let is_inside = |side: DVec3| self.omega(at + beside * side) > 0.0;
                let is_seam = self.omega(at) == 0.0
                    && across.iter().all(|&across| is_inside(across) && is_inside(-across));
                is_seam.then_some(at)
            })
        };
        let lines = [DVec3::ZERO, 0.5 * (bounds.min + bounds.max)]
            .into_iter()
            .flat_map(|through| (0..3).map(move |axis| (through, axis)));
        lines.into_iter().find_map(|(through, axis)| on_line(through, axis))
    }
}
