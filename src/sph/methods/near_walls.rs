//! What is known of the walls near particles, found once for all passes of a step.

use rayon::prelude::*;

use crate::sph::{core::Core, particles::CHUNK};

/// A table of the particles near walls.
pub(super) struct NearWalls<T> {
    /// Index into `found` of each particle; [`NONE`] if no wall is near.
    place: Vec<u32>,
    /// For each particle near walls its index, and what is known.
    found: Vec<(u32, T)>,
}

impl<T> Default for NearWalls<T> {
    fn default() -> Self {
        Self { place: Vec::new(), found: Vec::new() }
    }
}

/// Index of a particle that has no wall near it.
const NONE: u32 = u32::MAX;

impl<T: Send + Sync> NearWalls<T> {
    /// Finds the walls near all particles at their present positions; `of` says what is near a particle.
    pub fn find(&mut self, core: &Core, of: impl Fn(usize) -> Option<T> + Sync) {
        let n = core.particles.len();
        self.found.clear();
        let near = |i: usize| of(i).map(|near| (i as u32, near));
        self.found.par_extend((0..n).into_par_iter().with_min_len(CHUNK / 4).filter_map(near));
        self.place.clear();
        self.place.resize(n, NONE);
        for (place, (i, _)) in self.found.iter().enumerate() {
            self.place[*i as usize] = place as u32;
        }
    }

    /// What is near a particle; `None` if no wall is.
    #[inline]
    pub fn near(&self, i: usize) -> Option<&T> {
        let place = self.place[i];
        (place != NONE).then(|| &self.found[place as usize].1)
    }

    /// The particles near walls, by their indices.
    pub fn found(&self) -> &[(u32, T)] {
        &self.found
    }

    /// Memory of this table, bytes.
    pub fn bytes(&self) -> usize {
        4 * self.place.capacity() + size_of::<(u32, T)>() * self.found.capacity()
    }
}
