//! Walls near particles, found once for all passes of a step.

use std::sync::Arc;

use glam::DMat3;

use super::super::{images::Mirrors, near_walls::NearWalls};
use super::rigid::Rigid;
use crate::sph::{
    core::Core,
    params::Parameters,
    particles::Vectors,
    walls::{Carried, Coverage, WallDrag},
};

/// The parts that walls take of the kernels of the particles near them, each with M = (1 − K)⁻¹.
#[derive(Default)]
pub(super) struct Walls {
    near: NearWalls<(WallsNear, DMat3)>,
    /// The walls as planes, where the fluid has images in them instead: M is not needed then.
    mirrors: Option<Arc<Mirrors>>,
}

/// The part that walls take of the kernel of one particle.
pub(super) type WallsNear = Coverage<WallDrag, Carried>;

/// Tension rules a fluid if it moves a drop of one spacing faster than this part of the expected speed. (A step with
/// images takes up to two and a half times as long. They calm water of 0.4 mm, where this is one, and hardly change a
/// breaking dam of particles of 4 mm, where it is a tenth.)
const RULED: f64 = 0.3;

fn is_ruled_by_tension(parameters: &Parameters) -> bool {
    let Parameters { surface_tension, rest_density, expected_speed, .. } = *parameters;
    surface_tension / (rest_density * parameters.spacing()) > (RULED * expected_speed).powi(2)
}

impl Walls {
    /// Finds the walls near all particles at their present positions. A fluid that its tension rules has images in the
    /// walls of a box without obstacles, at least two support radii wide, unless it is of another method, whose own sums
    /// have none.
    pub fn find(&mut self, core: &Core, mirrors: Option<&Arc<Mirrors>>) {
        let Parameters { method, support_radius, .. } = &core.parameters;
        let are_planes = core.boundary.is_box() && core.boundary.is_wide(*support_radius);
        let has_images =
            are_planes && method.numerics().keeps_density() && is_ruled_by_tension(&core.parameters);
        self.mirrors = mirrors.filter(|_| has_images).cloned();
        self.near.find(core, |i| {
            // without viscosity friction is not needed
            let wall: WallsNear = if core.parameters.viscosity > 0.0 {
                core.coverage_with(i)?
            } else {
                core.coverage_with::<(), Carried>(i)?.with_friction(WallDrag::default())
            };
            Some((wall, wall.completion()))
        });
    }

    /// The part that walls take of a particle's kernel, and its M; `None` if no wall is near.
    #[inline]
    pub fn near(&self, i: usize) -> Option<(&WallsNear, &DMat3)> {
        self.near.near(i).map(|(wall, completion)| (wall, completion))
    }

    /// Writes M·a of each particle to `completed`.
    pub fn complete(&self, a: &Vectors, completed: &mut Vectors) {
        completed.clone_from(a);
        for &(i, (_, completion)) in self.near.found() {
            completed.set(i as usize, completion * a.get(i as usize));
        }
    }

    /// Writes w = r + M·(v − r) of each particle to `completed`, where r is the velocity behind the walls. Across
    /// the walls it is their velocity, and along them that of the fluid as a whole. Where the part o of a gap is
    /// `open`, it is w + o·(v − w).
    pub fn complete_velocities(
        &self,
        v: &Vectors,
        (at, whole): (&Vectors, &Rigid),
        open: Option<&[f64]>,
        completed: &mut Vectors,
    ) {
        completed.clone_from(v);
        for (i, (wall, completion)) in self.near.found() {
            let i = *i as usize;
            let behind = wall.velocity_behind(whole.at(at.get(i)));
            let all = behind + *completion * (v.get(i) - behind);
            completed.set(i, open.map_or(all, |open| all + open[i] * (v.get(i) - all)));
        }
    }

    /// What walls near a particle stand for in sums by pressure; `None` if no wall is near, or the fluid has images there.
    #[inline]
    pub fn in_place_of_fluid(&self, i: usize) -> Option<(&WallsNear, &DMat3)> {
        if self.mirrors.is_some() { None } else { self.near(i) }
    }

    /// Gives the walls as mirrors back to the tension, which finds them anew.
    pub fn give_back_mirrors(&mut self) {
        self.mirrors = None;
    }

    /// The walls as mirrors, if the fluid has images in them.
    pub fn mirrors(&self) -> Option<&Mirrors> {
        self.mirrors.as_deref()
    }

    /// The particles near walls: the index of each, the part that walls take of its kernel, and its M.
    pub fn found(&self) -> &[(u32, (WallsNear, DMat3))] {
        self.near.found()
    }

    /// Memory of this table, bytes.
    pub fn bytes(&self) -> usize {
        self.near.bytes()
    }
}
