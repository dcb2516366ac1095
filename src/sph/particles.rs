//! The fluid's particles as a structure of arrays.
//!
//! Invariant: all arrays have one length. The solver reorders particles as they move; `id` identifies them.

use glam::DVec3;
use rayon::prelude::*;

use crate::field::Points;

/// Number of particles that one task of a parallel loop handles.
pub(super) const CHUNK: usize = 2048;

/// Many vectors as three columns of one length.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Vectors {
    /// x components.
    pub x: Vec<f64>,
    /// y components.
    pub y: Vec<f64>,
    /// z components.
    pub z: Vec<f64>,
}

impl Vectors {
    /// Number of vectors.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there is no vector.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// Vector `i`.
    ///
    /// # Panics
    /// If there are not more than `i` vectors.
    pub fn get(&self, i: usize) -> DVec3 {
        DVec3::new(self.x[i], self.y[i], self.z[i])
    }

    /// Their mean; zero if there are none.
    pub fn mean(&self) -> DVec3 {
        self.iter().sum::<DVec3>() / self.len().max(1) as f64
    }

    /// Replaces vector `i`.
    ///
    /// # Panics
    /// If there are not more than `i` vectors.
    pub fn set(&mut self, i: usize, v: DVec3) {
        (self.x[i], self.y[i], self.z[i]) = (v.x, v.y, v.z);
    }

    /// Adds a vector at the end.
    pub fn push(&mut self, v: DVec3) {
        self.x.push(v.x);
        self.y.push(v.y);
        self.z.push(v.z);
    }

    /// Cuts off vectors, or adds zero vectors, until there are `len`.
    pub fn resize(&mut self, len: usize) {
        self.components_mut().into_iter().for_each(|component| component.resize(len, 0.0));
    }

    /// Removes all vectors.
    pub fn clear(&mut self) {
        self.components_mut().into_iter().for_each(Vec::clear);
    }

    /// The vectors in their order.
    pub fn iter(&self) -> impl Iterator<Item = DVec3> + '_ {
        (0..self.len()).map(|i| self.get(i))
    }

    /// The vectors as points at which a field can be evaluated.
    pub fn points(&self) -> Points<'_> {
        Points::new(&self.x, &self.y, &self.z)
    }

    pub(super) fn bytes(&self) -> usize {
        8 * (self.x.capacity() + self.y.capacity() + self.z.capacity())
    }

    pub(super) fn components(&self) -> [&Vec<f64>; 3] {
        [&self.x, &self.y, &self.z]
    }

    pub(super) fn components_mut(&mut self) -> [&mut Vec<f64>; 3] {
        [&mut self.x, &mut self.y, &mut self.z]
    }
}

/// The state of a fluid. All particles have the mass that the parameters state.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Particles {
    /// Positions, m.
    pub position: Vectors,
    /// Velocities at the same instant as the positions, m/s.
    pub velocity: Vectors,
    /// Densities, kg/m³. Equation (8) of the paper gives them in its method.
    pub density: Vec<f64>,
    /// Pressures, Pa. Equation (9) of the paper gives them in its method.
    pub pressure: Vec<f64>,
    /// Numbers of the particles at seeding.
    pub id: Vec<u32>,
}

impl Particles {
    /// Number of particles.
    pub fn len(&self) -> usize {
        self.id.len()
    }

    /// Whether there is no particle.
    pub fn is_empty(&self) -> bool {
        self.id.is_empty()
    }

    /// Adds a particle with the next free id. The first step finds its density and pressure.
    pub fn push(&mut self, position: DVec3, velocity: DVec3) {
        self.id.push(self.len() as u32);
        self.position.push(position);
        self.velocity.push(velocity);
        self.density.push(0.0);
        self.pressure.push(0.0);
    }

    /// Adds all particles of another fluid after these. Their ids continue those of this fluid.
    pub fn append(&mut self, other: &Self) {
        for i in 0..other.len() {
            self.push(other.position.get(i), other.velocity.get(i));
        }
    }

    /// Indices of the particles in the order of their ids.
    pub fn order_by_id(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.len()).collect();
        order.sort_unstable_by_key(|&i| self.id[i]);
        order
    }
}

/// Sets `to` = a + b·t.
pub(super) fn set_sum(to: &mut Vectors, a: &Vectors, b: &Vectors, t: f64) {
    for (to, a, b) in [(&mut to.x, &a.x, &b.x), (&mut to.y, &a.y, &b.y), (&mut to.z, &a.z, &b.z)] {
        set_sum_column(to, a, b, t);
    }
}

/// Sets `to` = a + b·t.
pub(super) fn set_sum_column(to: &mut Vec<f64>, a: &[f64], b: &[f64], t: f64) {
    to.resize(a.len(), 0.0);
    to.par_chunks_mut(CHUNK).zip(a.par_chunks(CHUNK)).zip(b.par_chunks(CHUNK)).for_each(|((to, a), b)| {
        for ((to, a), b) in to.iter_mut().zip(a).zip(b) {
            *to = a + b * t;
        }
    });
}

/// Adds from·t to `to`.
pub(super) fn add_scaled(to: &mut Vectors, from: &Vectors, t: f64) {
    for (to, from) in [(&mut to.x, &from.x), (&mut to.y, &from.y), (&mut to.z, &from.z)] {
        add_scaled_column(to, from, t);
    }
}

/// Adds from·t to `to`.
pub(super) fn add_scaled_column(to: &mut [f64], from: &[f64], t: f64) {
    to.par_chunks_mut(CHUNK).zip(from.par_chunks(CHUNK)).for_each(|(to, from)| {
        for (to, from) in to.iter_mut().zip(from) {
            *to += from * t;
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_count_on_over_appended_fluids() {
        let mut fluid = Particles::default();
        fluid.push(DVec3::ZERO, DVec3::X);
        let mut other = fluid.clone();
        other.push(DVec3::ONE, DVec3::Y);
        fluid.append(&other);
        assert_eq!(fluid.id, [0, 1, 2]);
        assert_eq!(fluid.velocity.get(2), DVec3::Y);
    }

    #[test]
    fn order_by_id_undoes_any_sorting() {
        let fluid = Particles { id: vec![2, 0, 1], ..Particles::default() };
        assert_eq!(fluid.order_by_id(), [1, 2, 0]);
    }
}
