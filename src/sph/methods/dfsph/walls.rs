//! Walls near particles, found once for all passes of a step.

use glam::DMat3;
use rayon::prelude::*;

use super::rigid::Rigid;
use crate::sph::{
    core::Core,
    particles::{CHUNK, Vectors},
    walls::{Carried, Coverage, WallDrag},
};

/// The parts that walls take of the kernels of the particles near them.
#[derive(Default)]
pub(super) struct Walls {
    /// Index into `found` of each particle; [`NONE`] if no wall is near.
    place: Vec<u32>,
    /// For each particle near walls: its index, the part that walls take of its kernel, and M = (1 − K)⁻¹.
    found: Vec<(u32, WallsNear, DMat3)>,
}

/// The part that walls take of the kernel of one particle.
pub(super) type WallsNear = Coverage<WallDrag, Carried>;

/// Index of a particle that has no wall near it.
const NONE: u32 = u32::MAX;

impl Walls {
    /// Finds the walls near all particles at their present positions.
    pub fn find(&mut self, core: &Core) {
        let n = core.particles.len();
        self.found.clear();
        self.found.par_extend((0..n).into_par_iter().with_min_len(CHUNK / 4).filter_map(|i| {
            // without viscosity friction is not needed
            let wall: WallsNear = if core.parameters.viscosity > 0.0 {
                core.coverage_with(i)?
            } else {
                core.coverage_with::<(), Carried>(i)?.with_friction(WallDrag::default())
            };
            Some((i as u32, wall, wall.completion()))
        }));
        self.place.clear();
        self.place.resize(n, NONE);
        for (place, (i, ..)) in self.found.iter().enumerate() {
            self.place[*i as usize] = place as u32;
        }
    }

    /// The part that walls take of a particle's kernel, and its M; `None` if no wall is near.
    #[inline]
    pub fn near(&self, i: usize) -> Option<(&WallsNear, &DMat3)> {
        let place = self.place[i];
        (place != NONE).then(|| {
            let (_, wall, completion) = &self.found[place as usize];
            (wall, completion)
        })
    }

    /// Writes M·a of each particle to `completed`.
    pub fn complete(&self, a: &Vectors, completed: &mut Vectors) {
        completed.clone_from(a);
        for &(i, _, completion) in &self.found {
            completed.set(i as usize, completion * a.get(i as usize));
        }
    }

    /// Writes r + M·(v − r) of each particle to `completed`, where r is the velocity behind the walls. Across
    /// the walls it is their velocity, and along them that of the fluid as a whole.
    pub fn complete_velocities(&self, v: &Vectors, (at, whole): (&Vectors, &Rigid), completed: &mut Vectors) {
        completed.clone_from(v);
        for (i, wall, completion) in &self.found {
            let i = *i as usize;
            let behind = wall.velocity_behind(whole.at(at.get(i)));
            completed.set(i, behind + *completion * (v.get(i) - behind));
        }
    }

    /// The particles near walls: the index of each, the part that walls take of its kernel, and its M.
    pub fn found(&self) -> &[(u32, WallsNear, DMat3)] {
        &self.found
    }

    /// Memory of this table, bytes.
    pub fn bytes(&self) -> usize {
        4 * self.place.capacity() + size_of::<(u32, WallsNear, DMat3)>() * self.found.capacity()
    }
}
