//! A compiled obstacle: one graph, and the programs derived from it on demand.
//!
//! Cheap to clone, usable from any thread; owns its machine code and frees it with the last clone.
//!
//! Invariant: a [`Solid`] answers for every point, every engine gives the same bits, and a program is compiled
//! only when it is first asked for.

mod bounds;
mod compiled;
mod programs;

use std::sync::Arc;
use std::sync::OnceLock;

use glam::{DVec3, Vec3};

pub use bounds::{Bounds, prove_empty};
pub use compiled::{BatchProgram, Lane, PointProgram};
pub use programs::{Engine, ProgramKind};

use crate::codegen::CodegenError;
use crate::field::{Field, GradientsMut, Points};
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::{self, Graph, Node, RangeEvaluator};
use crate::simplify::{Applied, simplify};
use programs::Programs;

/// An obstacle, compiled.
#[derive(Clone)]
pub struct Solid {
    inner: Arc<Inner>,
}

struct Inner {
    name: String,
    engine: Engine,
    value: Programs,
    range: RangeEvaluator,
    gradient: OnceLock<Programs>,
    bounds: OnceLock<Bounds>,
    applied: Applied,
}

impl Solid {
    /// Takes a root out of a graph, simplifies it and makes it ready to be compiled.
    ///
    /// # Errors
    /// With [`Engine::Jit`] if machine code cannot be made here; with [`Engine::Auto`] the interpreter then
    /// answers instead.
    pub fn new(
        name: impl Into<String>,
        graph: &Graph,
        root: Node,
        engine: Engine,
    ) -> Result<Self, CodegenError> {
        let (graph, roots, applied) = simplify(graph, &[root]);
        let range = RangeEvaluator::new(&graph, roots[0]);
        let value = Programs::new(graph, roots);
        let inner = Inner {
            name: name.into(),
            engine,
            value,
            range,
            gradient: OnceLock::new(),
            bounds: OnceLock::new(),
            applied,
        };
        let solid = Self { inner: Arc::new(inner) };
        if engine == Engine::Jit {
            solid.inner.value.require_machine_code()?;
        }
        Ok(solid)
    }

    /// As in `solid NAME = …`.
    pub fn name(&self) -> &str {
        &self.inner.name
    }

    /// The simplified graph of a program, with its outputs.
    pub fn graph(&self, kind: ProgramKind) -> (&Graph, &[Node]) {
        let programs = self.programs(kind);
        (&programs.graph, &programs.outputs)
    }

    /// How often each simplification rule was applied.
    pub fn applied_rules(&self) -> &Applied {
        &self.inner.applied
    }

    fn programs(&self, kind: ProgramKind) -> &Programs {
        match kind {
            ProgramKind::Value => &self.inner.value,
            ProgramKind::Gradient => self.inner.gradient.get_or_init(|| {
                let mut graph = self.inner.value.graph.clone();
                let omega = self.inner.value.outputs[0];
                let [gx, gy, gz] = ir::gradient(&mut graph, omega);
                let (graph, roots, _) = simplify(&graph, &[omega, gx, gy, gz]);
                Programs::new(graph, roots)
            }),
        }
    }

    /// ω at a point.
    pub fn omega(&self, p: DVec3) -> f64 {
        let mut out = [0.0];
        self.inner.value.point(self.inner.engine, p.to_array(), &mut out);
        out[0]
    }

    /// ω and ∇ω at a point; at edges and corners ∇ω is one finite member of the limits.
    pub fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        let mut out = [0.0; 4];
        self.programs(ProgramKind::Gradient).point(self.inner.engine, p.to_array(), &mut out);
        (out[0], DVec3::new(out[1], out[2], out[3]))
    }

    /// ω in single precision throughout.
    pub fn omega_f32(&self, p: Vec3) -> f32 {
        let mut out = [0.0];
        self.inner.value.point(self.inner.engine, p.to_array(), &mut out);
        out[0]
    }

    /// ω and ∇ω in single precision throughout.
    pub fn omega_grad_f32(&self, p: Vec3) -> (f32, Vec3) {
        let mut out = [0.0; 4];
        self.programs(ProgramKind::Gradient).point(self.inner.engine, p.to_array(), &mut out);
        (out[0], Vec3::new(out[1], out[2], out[3]))
    }

    /// ω at many points given by columns; no allocation, on the caller's thread.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn omega_many<T: Lane>(&self, points: [&[T]; 3], omega: &mut [T]) {
        self.inner.value.batch(self.inner.engine, points, [omega]);
    }

    /// ω and ∇ω at many points given by columns: `out` is ω, ∂x, ∂y, ∂z.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn omega_grad_many<T: Lane>(&self, points: [&[T]; 3], out: [&mut [T]; 4]) {
        self.programs(ProgramKind::Gradient).batch(self.inner.engine, points, out);
    }

    /// Inside (1), on the surface (0) or outside (−1); NaN where ω is not defined. ω in the stable form has
    /// exactly the sign of the logic of its leaves.
    pub fn sign(&self, p: DVec3) -> f64 {
        ir::Unary::Sign.eval(self.omega(p))
    }

    /// An interval that contains ω of every point of a box.
    pub fn range(&self, over: &Aabb) -> Interval {
        self.inner.range.eval(over)
    }

    /// Where the solid is; found on first use by subdivision, then kept.
    pub fn bounds(&self) -> &Bounds {
        self.inner.bounds.get_or_init(|| bounds::find(self))
    }

    /// Whether machine code answers, rather than the interpreter.
    pub fn is_compiled(&self) -> bool {
        self.inner.value.is_compiled(self.inner.engine)
    }
}

impl std::fmt::Debug for Solid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Solid({:?}, {} nodes)", self.inner.name, self.inner.value.graph.len())
    }
}

impl Field for Solid {
    fn omega(&self, p: DVec3) -> f64 {
        self.omega(p)
    }

    fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        self.omega_grad(p)
    }

    fn omega_many(&self, points: Points<'_>, omega: &mut [f64]) {
        self.omega_many([points.x, points.y, points.z], omega);
    }

    fn omega_grad_many(&self, points: Points<'_>, out: GradientsMut<'_>) {
        self.omega_grad_many([points.x, points.y, points.z], [out.omega, out.x, out.y, out.z]);
    }

    fn range(&self, over: &Aabb) -> Interval {
        self.range(over)
    }
}
