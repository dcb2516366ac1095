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
mod depth;
mod dissect;
mod faces;
mod leaf;
mod logic;
mod moment;
mod moving_map;
mod prefix;
mod programs;
mod ranges;
mod stretches;
mod sweep;

use std::sync::Arc;
use std::sync::OnceLock;

use glam::{DVec3, Vec3};

pub use bounds::Bounds;
pub use budget::{Chosen, OutOfBudget, Plan};
pub use cell_map::{CellMap, CellStats, Place};
pub use compiled::{BatchProgram, Lane, PointProgram, RangeProgram};
pub use depth::Depth;
pub use dissect::{LeafInfo, Left};
pub use moving_map::MovingMap;
pub use programs::{Engine, ProgramKind};

use crate::codegen::{CodegenError, Form, Forms, Precision};
use crate::field::{self, Entry, Faces, Field, GradientsMut, Moving, Path, Points, Walls};
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::{self, Graph, Node, Uniforms};
use crate::simplify::{Applied, simplify};
use leaf::{Leaves, Store};
use logic::Logic;
use moment::Moment;
use programs::{Guard, Programs, UniformValues};
use ranges::Ranges;
use sweep::Sweep;

/// Up to this many leaves the twin alone is cheaper than finding out which of them matter: a leaf and its share of
/// the minima cost some 0.2 ns in a batch, a cell's look-up and call 10.
const TWIN_SUFFICES: usize = 24;

/// An obstacle, compiled.
///
/// A solid that moves is looked at one time, or during a stretch of time: see [`Solid::at`] and [`Solid::between`].
#[derive(Clone)]
pub struct Solid {
    inner: Arc<Inner>,
    moment: Arc<Moment>,
}

struct Inner {
    name: String,
    engine: Engine,
    omega: Function,
    /// Same sign, no roots.
    twin: OnceLock<Function>,
    contact: OnceLock<Programs>,
    velocity: OnceLock<Programs>,
    parts: OnceLock<Option<TakenApart>>,
    applied: Applied,
}

/// The leaves of a solid at all times, and how they are joined, in prefix form.
type TakenApart = (Arc<Store>, Arc<[u32]>);

/// A solid taken apart, during a stretch of time.
struct Parts {
    leaves: Leaves,
    /// How they are joined, in prefix form.
    words: Arc<[u32]>,
}

/// One scalar function of space with all that answers questions about it.
struct Function {
    value: Programs,
    guard: Guard,
    form: Form,
    /// The graph without guards, from which further programs are derived.
    graph: Graph,
    root: Node,
    range: Ranges,
    gradient: OnceLock<Programs>,
}

impl Function {
    fn new(graph: Graph, root: Node, guard: Guard, form: Form) -> Self {
        Self {
            value: Programs::new(graph.clone(), vec![root], guard, form),
            guard,
            form,
            range: Ranges::new(&graph, root),
            graph,
            root,
            gradient: OnceLock::new(),
        }
    }

    /// The range over a box while time is in the stretch of a moment; of ω, or of its twin.
    #[inline]
    fn range(&self, engine: Engine, over: &Aabb, moment: &Moment, twin: bool) -> Interval {
        self.range.over((&self.graph, self.root), engine, over, |find| moment.ranges(twin, find))
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

impl Inner {
    /// The solid taken apart into leaves, once; nothing if that would be too large.
    fn parts(&self) -> Option<TakenApart> {
        let take_apart = || {
            let (logic, nodes) = Logic::of(&self.omega.graph, self.omega.root)?;
            let leaves = Store::new(self.engine, &self.omega.graph, &nodes);
            let mut words = Vec::new();
            prefix::encode(&logic, &mut words);
            Some((Arc::new(leaves), words.into()))
        };
        self.parts.get_or_init(take_apart).clone()
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
            velocity: OnceLock::new(),
            parts: OnceLock::new(),
            applied,
        };
        let solid = Self { inner: Arc::new(inner), moment: Moment::new(0.0, 0.0) };
        if engine == Engine::Jit {
            solid.inner.omega.value.require_machine_code()?;
        }
        Ok(solid)
    }

    /// Whether time occurs in the formula.
    pub fn moves(&self) -> bool {
        self.inner.omega.range.moves()
    }

    /// How many numbers of a program depend on time alone: they are found once for each time, the rest at each point.
    /// Nothing for a solid at rest.
    pub fn time_dependent(&self, kind: ProgramKind) -> Option<usize> {
        self.programs(kind).uniforms.as_ref().map(Uniforms::len)
    }

    /// The time, s, that values are for: 0 unless [`Solid::at`] or [`Solid::between`] has chosen another one.
    pub fn time(&self) -> f64 {
        self.moment.to
    }

    /// The solid at a time, s. Nothing is compiled again; a solid at rest is the same at all times. Where the time is
    /// not a number, nothing is.
    #[must_use]
    pub fn at(&self, time: f64) -> Self {
        self.between(time, time)
    }

    /// The solid during a stretch of time: values, gradients, signs and contacts are those at its end, ranges and bounds
    /// hold all of it, and a path is passed from its beginning to its end.
    #[must_use]
    pub fn between(&self, from: f64, to: f64) -> Self {
        if !self.moves() {
            return self.clone();
        }
        Self { inner: self.inner.clone(), moment: Moment::new(from, to) }
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

    /// What the programs of one kind need to know of the time.
    #[inline]
    fn uniforms(&self, kind: ProgramKind, programs: &Programs) -> &UniformValues {
        match &programs.uniforms {
            None => const { &UniformValues::NONE },
            Some(_) => self.moment.uniforms(kind, |time| programs.uniforms_at(time)),
        }
    }

    /// All outputs of one kind of program at a point.
    #[inline]
    fn evaluate<T: Lane>(&self, kind: ProgramKind, p: [T; 3], out: &mut [T]) {
        let programs = self.programs(kind);
        programs.point(self.inner.engine, self.uniforms(kind, programs), p, out);
    }

    /// … and at many points.
    fn evaluate_many<T: Lane, const N: usize>(
        &self,
        kind: ProgramKind,
        points: [&[T]; 3],
        out: [&mut [T]; N],
    ) {
        let programs = self.programs(kind);
        programs.batch(self.inner.engine, self.uniforms(kind, programs), points, out);
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
            ProgramKind::Velocity => self.inner.velocity.get_or_init(|| {
                let mut graph = self.inner.omega.graph.clone();
                let outputs = ir::wall_velocity(&mut graph, self.inner.omega.root);
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

    /// The solid after a part of its stretch of time.
    fn then(&self, part: f64) -> Self {
        let Moment { from, to, .. } = *self.moment;
        if part == 1.0 || from == to { self.clone() } else { self.at(from + part * (to - from)) }
    }

    /// The solid taken apart into leaves, once; nothing if that would be too large.
    fn parts(&self) -> Option<Arc<Parts>> {
        self.moment.parts(&self.inner)
    }

    /// The cheapest field with exactly the sign, zero set and surface gradient of ω in a box: the twin for a few
    /// leaves, a [`CellMap`] for many. Off the surface its value is another one.
    pub fn surface(&self, over: Aabb) -> Box<dyn Walls> {
        match if self.has_many_leaves() { CellMap::new(self, over) } else { None } {
            Some(map) => Box::new(map),
            None => Box::new(self.twin()),
        }
    }

    /// The field that a fluid solver needs in a box: as [`Solid::surface`], and its faces within `reach`.
    pub fn walls(&self, over: Aabb, reach: f64) -> Box<dyn Walls> {
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
        self.evaluate(ProgramKind::Value, p.to_array(), &mut out);
        out[0]
    }

    /// ω and ∇ω at a point; at edges and corners ∇ω is one finite member of the limits.
    #[inline]
    pub fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        let mut out = [0.0; 4];
        self.evaluate(ProgramKind::Gradient, p.to_array(), &mut out);
        (out[0], DVec3::new(out[1], out[2], out[3]))
    }

    /// ω in single precision throughout.
    #[inline]
    pub fn omega_f32(&self, p: Vec3) -> f32 {
        let mut out = [0.0];
        self.evaluate(ProgramKind::Value, p.to_array(), &mut out);
        out[0]
    }

    /// ω and ∇ω in single precision throughout.
    #[inline]
    pub fn omega_grad_f32(&self, p: Vec3) -> (f32, Vec3) {
        let mut out = [0.0; 4];
        self.evaluate(ProgramKind::Gradient, p.to_array(), &mut out);
        (out[0], Vec3::new(out[1], out[2], out[3]))
    }

    /// ω at many points given by columns; no allocation, on the caller's thread.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn omega_many<T: Lane>(&self, points: [&[T]; 3], omega: &mut [T]) {
        self.evaluate_many(ProgramKind::Value, points, [omega]);
    }

    /// ω and ∇ω at many points given by columns: `out` is ω, ∂x, ∂y, ∂z.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn omega_grad_many<T: Lane>(&self, points: [&[T]; 3], out: [&mut [T]; 4]) {
        self.evaluate_many(ProgramKind::Gradient, points, out);
    }

    /// Inside (1), on the surface (0) or outside (−1), exactly the logic of the leaves' signs; NaN where a leaf is
    /// not a number, or farther than 1e77 from the origin.
    #[inline]
    pub fn sign(&self, p: DVec3) -> f64 {
        let mut out = [0.0];
        self.evaluate(ProgramKind::Sign, p.to_array(), &mut out);
        ir::Unary::Sign.eval(out[0])
    }

    /// What a particle at this place needs to know of the surface.
    pub fn contact(&self, p: DVec3) -> Contact {
        let mut out = [0.0; 5];
        self.evaluate(ProgramKind::Contact, p.to_array(), &mut out);
        let [distance, nx, ny, nz, mean_curvature] = out;
        Contact { distance, normal: DVec3::new(nx, ny, nz), mean_curvature }
    }

    /// The velocity of the surface near a point, in the direction of its normal: of the face that [`Solid::contact`]
    /// finds. Zero for a solid at rest. A motion within the surface itself, as of a turning cylinder, is not in ω.
    pub fn wall_velocity(&self, p: DVec3) -> DVec3 {
        if !self.moves() {
            return DVec3::ZERO;
        }
        let mut out = [0.0; 3];
        self.evaluate(ProgramKind::Velocity, p.to_array(), &mut out);
        DVec3::from_array(out)
    }

    /// The distance of [`Solid::contact`] in single precision throughout.
    pub fn distance_f32(&self, p: Vec3) -> f32 {
        let mut out = [0.0; 5];
        self.evaluate(ProgramKind::Contact, p.to_array(), &mut out);
        out[0]
    }

    /// Distance, normal x, y, z and mean curvature at many points given by columns.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn contact_many<T: Lane>(&self, points: [&[T]; 3], out: [&mut [T]; 5]) {
        self.evaluate_many(ProgramKind::Contact, points, out);
    }

    /// The twin at many points: positive inside, 0 on the surface, negative outside.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn twin_many<T: Lane>(&self, points: [&[T]; 3], twin: &mut [T]) {
        self.evaluate_many(ProgramKind::Sign, points, [twin]);
    }

    /// An interval that contains ω of every point of a box: the exact value and the one that [`Solid::omega`] gives,
    /// also where that overflows. [`Interval::ALL`] where ω may not be a number; points at which it is none because
    /// of their coordinates (not finite, or so large that their sum is not) are not spoken of.
    pub fn range(&self, over: &Aabb) -> Interval {
        self.inner.omega.range(self.inner.engine, over, &self.moment, false)
    }

    /// Where the straight path between two points first meets the solid; ω = 0 counts as met.
    ///
    /// During a stretch of time, see [`Solid::between`], time passes evenly along the path.
    /// Nothing of the path before the entry is in the solid, and a path without one does not touch it: proven, however
    /// thin the solid and long the path.
    pub fn first_entry(&self, from: DVec3, to: DVec3) -> Option<Entry> {
        Walls::first_entry(self, &Path::new(from, to, f64::INFINITY))
    }

    /// Where the solid is; found on first use by subdivision, then kept.
    pub fn bounds(&self) -> &Bounds {
        self.moment.bounds(|| bounds::find(self))
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
}

impl Walls for Solid {
    fn first_entry(&self, path: &Path) -> Option<Entry> {
        self.twin().first_entry(path)
    }

    fn on_path(&self, path: &Path, t: f64) -> f64 {
        self.then(t).omega(path.at(t))
    }

    fn wall_velocity(&self, p: DVec3) -> DVec3 {
        self.wall_velocity(p)
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

impl Moving for Solid {
    fn during(&self, from: f64, to: f64) -> Box<dyn Walls> {
        Box::new(self.between(from, to))
    }

    fn moves(&self) -> bool {
        self.moves()
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
        self.solid.evaluate(ProgramKind::Sign, p.to_array(), &mut out);
        out[0]
    }

    fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        let mut out = [0.0; 4];
        self.solid.evaluate(ProgramKind::SignGradient, p.to_array(), &mut out);
        (out[0], DVec3::new(out[1], out[2], out[3]))
    }

    fn omega_many(&self, points: Points<'_>, omega: &mut [f64]) {
        self.solid.twin_many([points.x, points.y, points.z], omega);
    }

    fn omega_grad_many(&self, points: Points<'_>, out: GradientsMut<'_>) {
        let columns = [out.omega, out.x, out.y, out.z];
        self.solid.evaluate_many(ProgramKind::SignGradient, [points.x, points.y, points.z], columns);
    }

    fn range(&self, over: &Aabb) -> Interval {
        let Solid { inner, moment } = &self.solid;
        self.solid.twin_function().range(inner.engine, over, moment, true)
    }
}

impl Walls for Twin {
    fn on_path(&self, path: &Path, t: f64) -> f64 {
        self.solid.then(t).twin().omega(path.at(t))
    }

    fn wall_velocity(&self, p: DVec3) -> DVec3 {
        self.solid.wall_velocity(p)
    }

    fn faces(&self, p: DVec3, reach: f64, faces: &mut Faces) {
        self.solid.faces(p, reach, faces);
    }

    fn first_entry(&self, path: &Path) -> Option<Entry> {
        let finite = path.from.is_finite() && path.to.is_finite();
        if finite && self.range(&path.hull(path.start, 1.0)).hi < 0.0 {
            return None; // nearly all paths end here
        }
        let Some(parts) = self.solid.parts() else { return field::search_path(self, path) };
        Sweep::new(&parts.leaves, path).first_entry(&parts.words, (path.start, 1.0))
    }
}
