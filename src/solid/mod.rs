//! A compiled obstacle: one graph, and the programs derived from it on demand.
//!
//! Cheap to clone, usable from any thread; owns its machine code and frees it with the last clone.
//!
//! Invariant: a [`Solid`] answers for every point, every engine gives the same bits, and a program is compiled
//! only when it is first asked for.

mod blocks;
mod bounds;
mod budget;
mod cell_map;
mod cells;
mod compiled;
mod dissect;
mod faces;
mod leaf;
mod logic;
mod prefix;
mod programs;
mod stretches;
mod sweep;

use std::sync::Arc;
use std::sync::OnceLock;

use glam::{DVec3, Vec3};

pub use bounds::Bounds;
pub use budget::{Chosen, OutOfBudget, Plan};
pub use cell_map::{CellMap, CellStats, Place};
pub use compiled::{BatchProgram, Lane, PointProgram, RangeProgram};
pub use dissect::{LeafInfo, Left};
pub use programs::{Engine, ProgramKind};

use crate::codegen::{CodegenError, Form, Forms, Precision};
use crate::field::{self, Entry, Faces, Field, GradientsMut, Path, Points};
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::{self, Graph, Node, RangeEvaluator};
use crate::simplify::{Applied, simplify};
use leaf::Leaves;
use logic::Logic;
use programs::{Guard, Programs};
use sweep::Sweep;

/// Up to this many leaves the twin alone is cheaper than finding out which of them matter: a leaf and its share of
/// the minima cost some 0.2 ns in a batch, a cell's look-up and call 10.
const TWIN_SUFFICES: usize = 24;

/// An obstacle, compiled.
#[derive(Clone)]
pub struct Solid {
    inner: Arc<Inner>,
}

struct Inner {
    name: String,
    engine: Engine,
    omega: Function,
    /// Same sign, no roots.
    twin: OnceLock<Function>,
    contact: OnceLock<Programs>,
    parts: OnceLock<Option<Arc<Parts>>>,
    bounds: OnceLock<Bounds>,
    applied: Applied,
}

/// A solid taken apart.
struct Parts {
    leaves: Leaves,
    /// How they are joined, in prefix form.
    words: Vec<u32>,
}

/// One scalar function of space with all that answers questions about it.
struct Function {
    value: Programs,
    guard: Guard,
    form: Form,
    /// The graph without guards, from which further programs are derived.
    graph: Graph,
    root: Node,
    range: RangeEvaluator,
    range_code: OnceLock<Option<RangeProgram>>,
    gradient: OnceLock<Programs>,
}

impl Function {
    fn new(graph: Graph, root: Node, guard: Guard, form: Form) -> Self {
        Self {
            value: Programs::new(graph.clone(), vec![root], guard, form),
            guard,
            form,
            range: RangeEvaluator::new(&graph, root),
            range_code: OnceLock::new(),
            graph,
            root,
            gradient: OnceLock::new(),
        }
    }

    #[inline]
    fn range(&self, engine: Engine, over: &Aabb) -> Interval {
        if engine != Engine::Interpreter {
            let code = self.range_code.get_or_init(|| RangeProgram::compile(&self.graph, self.root).ok());
            if let Some(range) = code.as_ref().and_then(|code| code.call(over, &[])) {
                return range;
            }
        }
        self.range.eval(over)
    }

    fn gradient(&self) -> &Programs {
        self.gradient.get_or_init(|| {
            let mut graph = self.graph.clone();
            let [gx, gy, gz] = ir::gradient(&mut graph, self.root);
            let (graph, roots, _) = simplify(&graph, &[self.root, gx, gy, gz]);
            Programs::new(graph, roots, self.guard, self.form)
        })
    }
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
        Self::with_form(name, graph, root, engine, Form::Stable)
    }

    /// A solid whose machine code evaluates R₀ in another form; for comparing their speed and error.
    ///
    /// # Errors
    /// As for [`Solid::new`].
    pub fn with_form(
        name: impl Into<String>,
        graph: &Graph,
        root: Node,
        engine: Engine,
        form: Form,
    ) -> Result<Self, CodegenError> {
        let (graph, roots, applied) = simplify(graph, &[root]);
        let inner = Inner {
            name: name.into(),
            engine,
            omega: Function::new(graph, roots[0], Guard::Infinite, form),
            twin: OnceLock::new(),
            contact: OnceLock::new(),
            parts: OnceLock::new(),
            bounds: OnceLock::new(),
            applied,
        };
        let solid = Self { inner: Arc::new(inner) };
        if engine == Engine::Jit {
            solid.inner.omega.value.require_machine_code()?;
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

    /// ω as one expression: the simplified graph without the guards of its programs.
    pub fn formula(&self) -> (&Graph, Node) {
        (&self.inner.omega.graph, self.inner.omega.root)
    }

    /// The forms in which the programs of one kind evaluate R₀.
    pub fn forms(&self, kind: ProgramKind, precision: Precision) -> &Forms {
        self.programs(kind).forms(precision)
    }

    /// What the simplification rules did.
    pub fn applied_rules(&self) -> &Applied {
        &self.inner.applied
    }

    #[inline]
    fn programs(&self, kind: ProgramKind) -> &Programs {
        match kind {
            ProgramKind::Value => &self.inner.omega.value,
            ProgramKind::Gradient => self.inner.omega.gradient(),
            ProgramKind::Sign => &self.twin_function().value,
            ProgramKind::SignGradient => self.twin_function().gradient(),
            ProgramKind::Contact => self.inner.contact.get_or_init(|| {
                let mut graph = self.inner.omega.graph.clone();
                let outputs = ir::contact(&mut graph, self.inner.omega.root);
                let (graph, outputs, _) = simplify(&graph, &outputs);
                Programs::new(graph, outputs, Guard::Infinite, Form::Stable)
            }),
        }
    }

    fn twin_function(&self) -> &Function {
        self.inner.twin.get_or_init(|| {
            let mut graph = self.inner.omega.graph.clone();
            let root = ir::twin(&mut graph, self.inner.omega.root);
            let (graph, roots, _) = simplify(&graph, &[root]);
            Function::new(graph, roots[0], Guard::FarAway, Form::Stable)
        })
    }

    /// The solid taken apart into leaves, once; nothing if that would be too large.
    fn parts(&self) -> Option<Arc<Parts>> {
        let take_apart = || {
            let omega = &self.inner.omega;
            let (logic, nodes) = Logic::of(&omega.graph, omega.root)?;
            let leaves = Leaves::new(self.inner.engine, &omega.graph, &nodes);
            let mut words = Vec::new();
            prefix::encode(&logic, &mut words);
            Some(Arc::new(Parts { leaves, words }))
        };
        self.inner.parts.get_or_init(take_apart).clone()
    }

    /// The cheapest field with exactly the sign, zero set and surface gradient of ω in a box: the twin for a few
    /// leaves, a [`CellMap`] for many. Off the surface its value is another one.
    pub fn surface(&self, over: Aabb) -> Box<dyn Field> {
        match if self.has_many_leaves() { CellMap::new(self, over) } else { None } {
            Some(map) => Box::new(map),
            None => Box::new(self.twin()),
        }
    }

    /// The field that a fluid solver needs in a box: as [`Solid::surface`], and its faces within `reach`.
    pub fn walls(&self, over: Aabb, reach: f64) -> Box<dyn Field> {
        match CellMap::with_reach(self, over, reach) {
            Some(map) => Box::new(map),
            None => Box::new(self.clone()),
        }
    }

    /// Whether so many leaves decide the sign that it pays to find out which of them matter at a place.
    pub fn has_many_leaves(&self) -> bool {
        self.leaf_count().is_some_and(|leaves| leaves > TWIN_SUFFICES)
    }

    /// How many leaves decide the sign of the solid; nothing if it cannot be taken apart.
    pub fn leaf_count(&self) -> Option<usize> {
        self.parts().map(|parts| parts.leaves.len())
    }

    /// The min/max twin as a field of its own: the sign and zero set of ω at a fraction of the cost, and on the
    /// surface the gradient of the one leaf that it lies on.
    pub fn twin(&self) -> Twin {
        Twin { solid: self.clone() }
    }

    /// ω at a point.
    #[inline]
    pub fn omega(&self, p: DVec3) -> f64 {
        let mut out = [0.0];
        self.inner.omega.value.point(self.inner.engine, p.to_array(), &mut out);
        out[0]
    }

    /// ω and ∇ω at a point; at edges and corners ∇ω is one finite member of the limits.
    #[inline]
    pub fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        let mut out = [0.0; 4];
        self.programs(ProgramKind::Gradient).point(self.inner.engine, p.to_array(), &mut out);
        (out[0], DVec3::new(out[1], out[2], out[3]))
    }

    /// ω in single precision throughout.
    #[inline]
    pub fn omega_f32(&self, p: Vec3) -> f32 {
        let mut out = [0.0];
        self.inner.omega.value.point(self.inner.engine, p.to_array(), &mut out);
        out[0]
    }

    /// ω and ∇ω in single precision throughout.
    #[inline]
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
        self.inner.omega.value.batch(self.inner.engine, points, [omega]);
    }

    /// ω and ∇ω at many points given by columns: `out` is ω, ∂x, ∂y, ∂z.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn omega_grad_many<T: Lane>(&self, points: [&[T]; 3], out: [&mut [T]; 4]) {
        self.programs(ProgramKind::Gradient).batch(self.inner.engine, points, out);
    }

    /// Inside (1), on the surface (0) or outside (−1), exactly the logic of the leaves' signs; NaN where a leaf is
    /// not a number, or farther than 1e77 from the origin.
    #[inline]
    pub fn sign(&self, p: DVec3) -> f64 {
        let mut out = [0.0];
        self.programs(ProgramKind::Sign).point(self.inner.engine, p.to_array(), &mut out);
        ir::Unary::Sign.eval(out[0])
    }

    /// What a particle at this place needs to know of the surface.
    pub fn contact(&self, p: DVec3) -> Contact {
        let mut out = [0.0; 5];
        self.programs(ProgramKind::Contact).point(self.inner.engine, p.to_array(), &mut out);
        let [distance, nx, ny, nz, mean_curvature] = out;
        Contact { distance, normal: DVec3::new(nx, ny, nz), mean_curvature }
    }

    /// The distance of [`Solid::contact`] in single precision throughout.
    pub fn distance_f32(&self, p: Vec3) -> f32 {
        let mut out = [0.0; 5];
        self.programs(ProgramKind::Contact).point(self.inner.engine, p.to_array(), &mut out);
        out[0]
    }

    /// Distance, normal x, y, z and mean curvature at many points given by columns.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn contact_many<T: Lane>(&self, points: [&[T]; 3], out: [&mut [T]; 5]) {
        self.programs(ProgramKind::Contact).batch(self.inner.engine, points, out);
    }

    /// The twin at many points: positive inside, 0 on the surface, negative outside.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn twin_many<T: Lane>(&self, points: [&[T]; 3], twin: &mut [T]) {
        self.programs(ProgramKind::Sign).batch(self.inner.engine, points, [twin]);
    }

    /// An interval that contains ω of every point of a box: the exact value and the one that [`Solid::omega`] gives,
    /// also where that overflows. [`Interval::ALL`] where ω may not be a number; points at which it is none because
    /// of their coordinates (not finite, or so large that their sum is not) are not spoken of.
    pub fn range(&self, over: &Aabb) -> Interval {
        self.inner.omega.range(self.inner.engine, over)
    }

    /// Where the straight path between two points first meets the solid; ω = 0 counts as met.
    ///
    /// Nothing of the path before the entry is in the solid, and a path without one does not touch it: proven, however
    /// thin the solid and long the path.
    pub fn first_entry(&self, from: DVec3, to: DVec3) -> Option<Entry> {
        Field::first_entry(self, &Path::new(from, to, f64::INFINITY))
    }

    /// Where the solid is; found on first use by subdivision, then kept.
    pub fn bounds(&self) -> &Bounds {
        self.inner.bounds.get_or_init(|| bounds::find(self))
    }

    /// Whether machine code answers, rather than the interpreter.
    pub fn is_compiled(&self) -> bool {
        self.inner.omega.value.is_compiled(self.inner.engine)
    }
}

impl std::fmt::Debug for Solid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Solid({:?}, {} nodes)", self.inner.name, self.inner.omega.graph.len())
    }
}

impl Field for Solid {
    #[inline]
    fn omega(&self, p: DVec3) -> f64 {
        self.omega(p)
    }

    #[inline]
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

    fn first_entry(&self, path: &Path) -> Option<Entry> {
        self.twin().first_entry(path)
    }

    fn faces(&self, p: DVec3, reach: f64, faces: &mut Faces) {
        match self.parts() {
            Some(parts) => parts.leaves.add_faces(&parts.words, 0, p, reach, faces),
            None => {
                let Contact { distance, normal, mean_curvature } = self.contact(p);
                if distance < reach {
                    faces.push(field::Part::Face(field::Face { distance, normal, mean_curvature }));
                }
            }
        }
    }
}

/// The surface of a solid as seen from a point, see `ir::contact`: accurate near the surface, an estimate far away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Positive in the fluid, negative inside the solid.
    pub distance: f64,
    /// Outward unit normal of the face that is nearest; the mean of two at an edge; zero where there is none.
    pub normal: DVec3,
    /// Of that face, positive where the solid is convex: 1/R for a ball, 1/2R for a cylinder.
    pub mean_curvature: f64,
}

/// The min/max twin of a solid, see [`Solid::twin`].
#[derive(Debug, Clone)]
pub struct Twin {
    solid: Solid,
}

impl Field for Twin {
    #[inline]
    fn omega(&self, p: DVec3) -> f64 {
        let mut out = [0.0];
        self.solid.programs(ProgramKind::Sign).point(self.solid.inner.engine, p.to_array(), &mut out);
        out[0]
    }

    fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        let mut out = [0.0; 4];
        self.solid.programs(ProgramKind::SignGradient).point(self.solid.inner.engine, p.to_array(), &mut out);
        (out[0], DVec3::new(out[1], out[2], out[3]))
    }

    fn omega_many(&self, points: Points<'_>, omega: &mut [f64]) {
        self.solid.twin_many([points.x, points.y, points.z], omega);
    }

    fn omega_grad_many(&self, points: Points<'_>, out: GradientsMut<'_>) {
        let columns = [out.omega, out.x, out.y, out.z];
        let programs = self.solid.programs(ProgramKind::SignGradient);
        programs.batch(self.solid.inner.engine, [points.x, points.y, points.z], columns);
    }

    fn range(&self, over: &Aabb) -> Interval {
        self.solid.twin_function().range(self.solid.inner.engine, over)
    }

    fn faces(&self, p: DVec3, reach: f64, faces: &mut Faces) {
        self.solid.faces(p, reach, faces);
    }

    fn first_entry(&self, path: &Path) -> Option<Entry> {
        let Some(parts) = self.solid.parts() else { return field::search_path(self, path) };
        let finite = path.from.is_finite() && path.to.is_finite();
        if finite && self.range(&path.hull(path.start, 1.0)).hi < 0.0 {
            return None;
        }
        Sweep::new(&parts.leaves, path).first_entry(&parts.words, (path.start, 1.0))
    }
}
