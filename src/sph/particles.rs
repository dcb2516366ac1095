//! The fluid's particles as a structure of arrays.
//!
//! Invariant: all arrays have one length; the solver reorders particles as they move, `id` says which is which.

use glam::DVec3;

use crate::field::Points;

/// Many vectors, component by component.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Vectors {
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    pub z: Vec<f64>,
}

impl Vectors {
    pub fn len(&self) -> usize {
        self.x.len()
    }

    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    pub fn get(&self, i: usize) -> DVec3 {
        DVec3::new(self.x[i], self.y[i], self.z[i])
    }

    pub fn set(&mut self, i: usize, v: DVec3) {
        (self.x[i], self.y[i], self.z[i]) = (v.x, v.y, v.z);
    }

    pub fn push(&mut self, v: DVec3) {
        self.x.push(v.x);
        self.y.push(v.y);
        self.z.push(v.z);
    }

    pub fn resize(&mut self, len: usize) {
        self.components_mut().into_iter().for_each(|component| component.resize(len, 0.0));
    }

    pub fn clear(&mut self) {
        self.components_mut().into_iter().for_each(Vec::clear);
    }

    pub fn iter(&self) -> impl Iterator<Item = DVec3> + '_ {
        (0..self.len()).map(|i| self.get(i))
    }

    /// The same numbers as points of a field.
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

/// State of the fluid. All particles have the mass of the parameters.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Particles {
    /// m
    pub position: Vectors,
    /// m/s, at the same instant as the positions
    pub velocity: Vectors,
    /// kg/m³, from equation (8)
    pub density: Vec<f64>,
    /// Pa, from equation (9)
    pub pressure: Vec<f64>,
    /// The particle's number at seeding.
    pub id: Vec<u32>,
}

impl Particles {
    pub fn len(&self) -> usize {
        self.id.len()
    }

    pub fn is_empty(&self) -> bool {
        self.id.is_empty()
    }

    /// Adds a particle with the next free id; density and pressure are found by the first step.
    pub fn push(&mut self, position: DVec3, velocity: DVec3) {
        self.id.push(self.len() as u32);
        self.position.push(position);
        self.velocity.push(velocity);
        self.density.push(0.0);
        self.pressure.push(0.0);
    }

    /// Adds all particles of another fluid after these; ids go on counting.
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
