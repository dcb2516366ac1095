//! A solid: how it is made, at which time it is looked at, and its programs.

use std::sync::{Arc, OnceLock};

use super::engine::{Engine, ProgramKind};
use super::leaves::leaf_set::{LeafStore, LeafTree};
use super::leaves::tree::Logic;
use super::leaves::words;
use super::moment::Moment;
use super::programs::number::UniformValues;
use super::programs::on_demand::{Guard, Lane, Programs};
use super::programs::ranges::Ranges;
use crate::codegen::{CodegenError, Form, Forms};
use crate::geom::{Aabb, Placement, Twist};
use crate::interval::Interval;
use crate::ir::{self, Graph, Node, RigidMotion, Trust, Uniforms};
use crate::precision::Precision;
use crate::simplify::{Applied, simplify, simplify_with_hulls};

/// An obstacle, compiled.
///
/// Lengths are in the units of the file, times in seconds, ω in the units of its formula. A solid that moves
/// is seen at one time, or during a stretch of time: see [`Solid::at`] and [`Solid::between`].
#[derive(Clone)]
pub struct Solid {
    pub(super) inner: Arc<Inner>,
    pub(super) moment: Arc<Moment>,
}

/// The data that all clones of a solid share, at whatever time they are looked at.
pub(super) struct Inner {
    name: String,
    pub engine: Engine,
    pub omega: Function,
    /// Same sign, no roots.
    twin: OnceLock<Function>,
    contact: OnceLock<Programs>,
    trust: OnceLock<Trust>,
    velocity: OnceLock<Programs>,
    motion: OnceLock<Option<RigidMotion>>,
    parts: OnceLock<Option<LeavesAtAllTimes>>,
    /// ω with what encloses its parts, if anything does.
    with_hulls: Option<(Graph, Node)>,
    parts_with_hulls: OnceLock<Option<LeavesAtAllTimes>>,
    applied: Applied,
}

/// The leaves of a solid at all times, and how they are joined, in prefix form.
type LeavesAtAllTimes = (Arc<LeafStore>, Arc<[u32]>);

/// One scalar function of space with all that answers questions about it.
pub(super) struct Function {
    value: Programs,
    guard: Guard,
    pub form: Form,
    /// The graph without guards, from which further programs are derived.
    pub graph: Graph,
    pub root: Node,
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
    pub fn range(&self, engine: Engine, over: &Aabb, moment: &Moment, twin: bool) -> Interval {
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
    /// The solid taken apart into leaves, once; `None` if that would be too large.
    fn parts(&self) -> Option<LeavesAtAllTimes> {
        self.parts.get_or_init(|| self.taken_apart(&self.omega.graph, self.omega.root)).clone()
    }

    fn taken_apart(&self, graph: &Graph, root: Node) -> Option<LeavesAtAllTimes> {
        let (logic, nodes) = Logic::of(graph, root)?;
        let leaves = LeafStore::new(self.engine, graph, &nodes);
        let mut words = Vec::new();
        words::encode(&logic, &mut words);
        Some((Arc::new(leaves), words.into()))
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

    /// A solid whose machine code evaluates R₀ in another form, to compare the forms' speed and error.
    ///
    /// # Errors
    /// Those of [`Solid::new`].
    pub fn with_form(
        name: impl Into<String>,
        graph: &Graph,
        root: Node,
        engine: Engine,
        form: Form,
    ) -> Result<Self, CodegenError> {
        let with_hulls = simplify_with_hulls(graph, root);
        let (graph, roots, applied) = simplify(graph, &[root]);
        let inner = Inner {
            name: name.into(),
            engine,
            omega: Function::new(graph, roots[0], Guard::Infinite, form),
            twin: OnceLock::new(),
            contact: OnceLock::new(),
            trust: OnceLock::new(),
            velocity: OnceLock::new(),
            motion: OnceLock::new(),
            parts: OnceLock::new(),
            with_hulls,
            parts_with_hulls: OnceLock::new(),
            applied,
        };
        let solid = Self { inner: Arc::new(inner), moment: Moment::new(0.0, 0.0) };
        if engine == Engine::Jit {
            solid.inner.omega.value.require_machine_code()?;
        }
        Ok(solid)
    }

    /// How far the estimates of its contacts can be trusted.
    pub(super) fn trust(&self) -> &Trust {
        let Function { graph, root, .. } = &self.inner.omega;
        self.inner.trust.get_or_init(|| Trust::of(graph, *root))
    }

    /// Whether time occurs in the formula.
    pub fn moves(&self) -> bool {
        self.inner.omega.range.moves()
    }

    /// Where the solid is at a time, s, seen from where it is at the time 0, if it moves without deformation;
    /// `None` if its formula does not show that.
    pub fn placement(&self, time: f64) -> Option<Placement> {
        self.rigid_motion()?.placement(time)
    }

    /// How the solid moves now, if it moves without deformation and its formula shows how.
    pub(super) fn twist(&self) -> Option<Twist> {
        self.moment.twist(|now| self.rigid_motion()?.twist(now))
    }

    fn rigid_motion(&self) -> Option<&RigidMotion> {
        let omega = &self.inner.omega;
        self.inner.motion.get_or_init(|| RigidMotion::of(&omega.graph, omega.root)).as_ref()
    }

    /// How many numbers of a program depend on time alone: they are found once for each time, the rest at
    /// each point. `None` for a solid at rest.
    pub fn time_dependent(&self, kind: ProgramKind) -> Option<usize> {
        self.programs(kind).uniforms.as_ref().map(Uniforms::len)
    }

    /// The time, s, that values are for: 0 unless [`Solid::at`] or [`Solid::between`] has chosen another one.
    pub fn time(&self) -> f64 {
        self.moment.to
    }

    /// The solid at a time, s. Nothing is compiled again, and a solid at rest is the same at all times. If
    /// the time is NaN, so are all values of a solid that moves.
    #[must_use]
    pub fn at(&self, time: f64) -> Self {
        self.between(time, time)
    }

    /// The solid during a stretch of time: values, gradients, signs and contacts are those at its end, ranges
    /// and bounds hold all of it, and a path is passed from its beginning to its end.
    #[must_use]
    pub fn between(&self, from: f64, to: f64) -> Self {
        if !self.moves() {
            return self.clone();
        }
        Self { inner: self.inner.clone(), moment: Moment::new(from, to) }
    }

    /// The name that the file gives it: `solid NAME = …`.
    pub fn name(&self) -> &str {
        &self.inner.name
    }

    /// The simplified graph of a program, with its outputs.
    pub fn graph(&self, kind: ProgramKind) -> (&Graph, &[Node]) {
        let programs = self.programs(kind);
        (&programs.graph, &programs.outputs)
    }

    /// The formulas of the numbers that [`Solid::graph`] has as uniforms: they depend on time alone, or on
    /// parameters. `None` if it has none.
    pub fn uniform_formulas(&self, kind: ProgramKind) -> Option<(&Graph, &[Node])> {
        self.programs(kind).uniforms.as_ref().map(Uniforms::formulas)
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

    /// What the programs of one kind need to know about the time.
    #[inline]
    fn uniforms(&self, kind: ProgramKind, programs: &Programs) -> &UniformValues {
        match &programs.uniforms {
            None => const { &UniformValues::NONE },
            Some(_) => self.moment.uniforms(kind, |time| programs.uniforms_at(time)),
        }
    }

    /// All outputs of one kind of program at a point.
    #[inline]
    pub(super) fn evaluate<T: Lane>(&self, kind: ProgramKind, p: [T; 3], out: &mut [T]) {
        let programs = self.programs(kind);
        programs.point(self.inner.engine, self.uniforms(kind, programs), p, out);
    }

    /// All outputs of one kind of program at many points.
    pub(super) fn evaluate_many<T: Lane, const N: usize>(
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

    pub(super) fn twin_function(&self) -> &Function {
        self.inner.twin.get_or_init(|| {
            let mut graph = self.inner.omega.graph.clone();
            let root = ir::twin(&mut graph, self.inner.omega.root);
            let (graph, roots, _) = simplify(&graph, &[root]);
            Function::new(graph, roots[0], Guard::FarAway, Form::Stable)
        })
    }

    /// The solid after a part of its stretch of time.
    pub(super) fn then(&self, part: f64) -> Self {
        let Moment { from, to, .. } = *self.moment;
        if part == 1.0 || from == to { self.clone() } else { self.at(from + part * (to - from)) }
    }

    /// The solid taken apart into leaves, once; `None` if that would be too large.
    pub(super) fn parts(&self) -> Option<Arc<LeafTree>> {
        self.moment.parts(|from, to| {
            let (store, words) = self.inner.parts()?;
            Some(Arc::new(LeafTree { leaves: store.during(from, to), words }))
        })
    }

    /// The solid taken apart into leaves and what encloses them, to find its bounds; `None` if that would be too large.
    pub(super) fn parts_with_hulls(&self) -> Option<Arc<LeafTree>> {
        let Some((graph, root)) = &self.inner.with_hulls else { return self.parts() };
        let parts = &self.inner.parts_with_hulls;
        let taken_apart = parts.get_or_init(|| self.inner.taken_apart(graph, *root)).clone();
        // with the hulls it may be too large, and not without them
        let Some((store, words)) = taken_apart else { return self.parts() };
        let Moment { from, to, .. } = *self.moment;
        Some(Arc::new(LeafTree { leaves: store.during(from, to), words }))
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
