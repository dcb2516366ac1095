//! The particles of a simulation as arrays: copies in the order of their ids, and views in the solver's order.

use std::sync::Arc;

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rfm::sph::{Particles, Vectors};

use crate::memory::view;

/// Numbers of one particle each, in the order of ids: a new array of shape (n,).
pub fn column_by_id(py: Python<'_>, column: &[f64], particles: &Particles) -> Py<PyAny> {
    let sorted = particles.order_by_id().into_iter().map(|i| column[i]);
    PyArray1::from_iter(py, sorted).into_any().unbind()
}

/// Vectors of one particle each, in the order of ids: a new array of shape (n, 3).
pub fn vectors_by_id(py: Python<'_>, vectors: &Vectors, particles: &Particles) -> PyResult<Py<PyAny>> {
    let sorted = particles.order_by_id().into_iter().flat_map(|i| vectors.get(i).to_array());
    Ok(PyArray1::from_iter(py, sorted).reshape([vectors.len(), 3])?.into_any().unbind())
}

/// Counts the views of a state that are alive.
#[derive(Clone, Default)]
pub struct Lent(Arc<()>);

impl Lent {
    /// Whether there is a view.
    pub fn is_out(&self) -> bool {
        Arc::strong_count(&self.0) > 1
    }
}

/// What views keep alive: the simulation, and the knowledge that there is a view.
#[pyclass(frozen, module = "rfm", name = "_Lease")]
pub struct Lease {
    _simulation: Py<PyAny>,
    _lent: Lent,
}

/// The columns of particles as read-only arrays. `simulation` owns the particles.
pub fn views<'py>(
    simulation: &Bound<'py, PyAny>,
    particles: &Particles,
    lent: &Lent,
) -> PyResult<Bound<'py, PyDict>> {
    let py = simulation.py();
    let lease = || Bound::new(py, Lease { _simulation: simulation.clone().unbind(), _lent: lent.clone() });
    let Particles { position, velocity, density, pressure, id } = particles;
    let columns = [
        ("x", &position.x),
        ("y", &position.y),
        ("z", &position.z),
        ("u", &velocity.x),
        ("v", &velocity.y),
        ("w", &velocity.z),
        ("density", density),
        ("pressure", pressure),
    ];
    let views = PyDict::new(py);
    for (name, column) in columns {
        // SAFETY: the lease keeps the simulation alive, and no step changes it while there is a lease
        views.set_item(name, unsafe { view(column, lease()?.into_any()) }?)?;
    }
    // SAFETY: as above
    views.set_item("id", unsafe { view(id, lease()?.into_any()) }?)?;
    Ok(views)
}
