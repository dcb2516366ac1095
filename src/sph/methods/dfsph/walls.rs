//! Walls near particles, found once for all passes of a step.

use glam::DMat3;

use super::super::near_walls::NearWalls;
use super::rigid::Rigid;
use crate::sph::{
    core::Core,
    particles::Vectors,
    walls::{Carried, Coverage, WallDrag},
};

/// The parts that walls take of the kernels of the particles near them, each with M = (1 − K)⁻¹.
#[derive(Default)]
pub(super) struct Walls(NearWalls<(WallsNear, DMat3)>);

/// The part that walls take of the kernel of one particle.
pub(super) type WallsNear = Coverage<WallDrag, Carried>;

impl Walls {
    /// Finds the walls near all particles at their present positions.
    pub fn find(&mut self, core: &Core) {
        self.0.find(core, |i| {
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
        self.0.near(i).map(|(wall, completion)| (wall, completion))
    }

    /// Writes M·a of each particle to `completed`.
    pub fn complete(&self, a: &Vectors, completed: &mut Vectors) {
        completed.clone_from(a);
        for &(i, (_, completion)) in self.0.found() {
            completed.set(i as usize, completion * a.get(i as usize));
        }
    }

    /// Writes r + M·(v − r) of each particle to `completed`, where r is the velocity behind the walls. Across
    /// the walls it is their velocity, and along them that of the fluid as a whole.
    pub fn complete_velocities(&self, v: &Vectors, (at, whole): (&Vectors, &Rigid), completed: &mut Vectors) {
        completed.clone_from(v);
        for (i, (wall, completion)) in self.0.found() {
            let i = *i as usize;
            let behind = wall.velocity_behind(whole.at(at.get(i)));
            completed.set(i, behind + *completion * (v.get(i) - behind));
        }
    }

    /// The particles near walls: the index of each, the part that walls take of its kernel, and its M.
    pub fn found(&self) -> &[(u32, (WallsNear, DMat3))] {
        self.0.found()
    }

    /// Memory of this table, bytes.
    pub fn bytes(&self) -> usize {
        self.0.bytes()
    }
}
