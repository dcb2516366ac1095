//! The cheapest program whose certified error keeps a tolerance, see `ir::ErrorAnalysis`.
//!
//! The tolerance bounds |computed ω − exact ω| over a box. Only values are computed the cheap way, and only
//! in the box: gradients, ranges and points beyond it get the solid's own program, signs and surfaces the
//! exact twin.

use glam::DVec3;

use super::construction::Solid;
use super::programs::number::UniformValues;
use super::programs::on_demand::{Guard, Programs, forms};
use crate::codegen::{Form, Forms, Precision};
use crate::field::{Field, GradientsMut, Points};
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::{self, Arithmetic, ErrorAnalysis, FloatType, Graph, Inputs, Magnitudes, Node};

/// One way to compute ω.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProgramVariant {
    /// The type that it computes in.
    pub precision: Precision,
    /// How R₀ is evaluated. Pairs of operands whose squares leave the range get the scaled form in any case.
    pub form: Form,
    /// Whether the centre of the box is subtracted in `f64` first.
    pub local: bool,
}

impl ProgramVariant {
    /// The variant that solids have by default.
    pub const STANDARD: Self = Self::new(Precision::F64, Form::Stable, false);

    /// All variants from the cheapest to the dearest, in the order in which they are tried. The pawn's ω in
    /// columns of `f64` costs 4.7, 7.5, 7.5, 7.3 and 10.9 ns, conversion included; the scaled form a fifth
    /// more. With more operations to a point the conversion weighs less, and the `f32` programs move away
    /// from the `f64` ones.
    pub const BY_COST: [Self; 6] = [
        Self::new(Precision::F32, Form::Textbook, false),
        Self::new(Precision::F32, Form::Stable, false),
        Self::new(Precision::F32, Form::Stable, true),
        Self::new(Precision::F64, Form::Textbook, false),
        Self::STANDARD,
        Self::new(Precision::F64, Form::Scaled, false),
    ];

    const fn new(precision: Precision, form: Form, local: bool) -> Self {
        Self { precision, form, local }
    }

    /// For messages: `f32 stable in local coordinates`.
    pub fn name(self) -> String {
        let precision = match self.precision {
            Precision::F32 => "f32",
            Precision::F64 => "f64",
        };
        let local = if self.local { " in local coordinates" } else { "" };
        format!("{precision} {}{local}", self.form.name())
    }
}

/// No program keeps the tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutOfTolerance {
    /// The smallest possible certified |computed ω − exact ω|; infinite if there is none.
    pub bound: f64,
    /// The program that has it.
    pub variant: ProgramVariant,
}

/// A solid whose ω is computed by the cheapest program that keeps a tolerance in a box.
#[derive(Clone)]
pub struct Chosen {
    solid: Solid,
    variant: ProgramVariant,
    over: Aabb,
    bound: f64,
    candidate: std::sync::Arc<Candidate>,
}

/// A program with what its certificate needs.
struct Candidate {
    graph: Graph,
    root: Node,
    origin: DVec3,
    /// `None` if the solid's own answer.
    programs: Option<Programs>,
    forms: Forms,
    inputs: Inputs,
    /// The box in the coordinates of the program.
    over: Aabb,
    precision: Precision,
    /// The solid's stretch of time.
    time: Interval,
    /// What depends on time alone, at the time of the solid.
    uniforms: UniformValues,
}

/// Points that are converted at a time.
const BLOCK: usize = 256;

impl Solid {
    /// The cheapest program whose certified |computed ω − exact ω| is at most `tolerance` everywhere in a
    /// box. The exact value is that of the simplified formula at the given point; the constants of the one
    /// and the coordinates of the other are doubles.
    ///
    /// # Errors
    /// If no program is certified to keep it.
    pub fn within(&self, tolerance: f64, over: Aabb) -> Result<Chosen, OutOfTolerance> {
        for variant in ProgramVariant::BY_COST {
            let candidate = Candidate::new(self, variant, &over);
            let enough = candidate.certify(tolerance);
            if enough <= tolerance {
                let bound = enough.min(candidate.certify(0.0));
                let candidate = candidate.with_programs(self, variant).into();
                return Ok(Chosen { solid: self.clone(), variant, over, bound, candidate });
            }
        }
        let [.., dearest] = ProgramVariant::BY_COST;
        let [standard, scaled] = [ProgramVariant::STANDARD, dearest]
            .map(|variant| OutOfTolerance { bound: self.error_bound(variant, &over), variant });
        Err(if scaled.bound < standard.bound { scaled } else { standard })
    }

    /// A certified bound of |computed ω − exact ω| of one program over a box; infinite where there is none.
    pub fn error_bound(&self, variant: ProgramVariant, over: &Aabb) -> f64 {
        Candidate::new(self, variant, over).certify(0.0)
    }
}

impl Candidate {
    fn new(solid: &Solid, variant: ProgramVariant, over: &Aabb) -> Self {
        let (graph, root) = solid.formula();
        // few digits, so that constants fold without error
        let origin = if variant.local { over.centre().as_vec3().as_dvec3() } else { DVec3::ZERO };
        let (graph, root) =
            if variant.local { ir::localised(graph, root, origin) } else { (graph.clone(), root) };
        let over = if variant.local { shifted(over, origin) } else { *over };
        // the solid's own program, unless it was compiled in another form for comparison
        let forms = if variant == ProgramVariant::STANDARD && solid.inner.omega.form == Form::Stable {
            // the graph of the program has a guard, and therefore other nodes
            let [double, _] = forms(&graph, Form::Stable);
            double
        } else {
            Magnitudes::over(&graph, &over).forms(&graph, variant.form, variant.precision)
        };
        let inputs = match (variant.precision, variant.local) {
            (Precision::F64, _) => Inputs::Exact,
            (Precision::F32, false) => Inputs::Rounded,
            (Precision::F32, true) => Inputs::Shifted,
        };
        let (time, uniforms) = (solid.moment.interval(), UniformValues::NONE);
        Self {
            graph,
            root,
            origin,
            programs: None,
            forms,
            inputs,
            over,
            precision: variant.precision,
            time,
            uniforms,
        }
    }

    fn certify(&self, enough: f64) -> f64 {
        // programs add the coordinates up to see whether they are finite
        let reach = self.over.min.abs().max(self.over.max.abs()).element_sum();
        let finite = 4.0 * reach < FloatType::of(self.precision).largest;
        if self.over.is_empty() || !finite {
            return f64::INFINITY;
        }
        let arithmetic = Arithmetic { precision: self.precision, forms: &self.forms, inputs: self.inputs };
        ErrorAnalysis::new(&self.graph, self.root, arithmetic).during(self.time).certify(&self.over, enough)
    }

    fn with_programs(mut self, solid: &Solid, variant: ProgramVariant) -> Self {
        if variant != ProgramVariant::STANDARD || solid.inner.omega.form != Form::Stable {
            let forms = [self.forms.clone(), self.forms.clone()];
            let programs = Programs::with_forms(self.graph.clone(), vec![self.root], Guard::Infinite, forms);
            self.uniforms = programs.uniforms_at(solid.time());
            self.programs = Some(programs);
        }
        self
    }
}

/// A box in coordinates relative to an origin, rounded outwards.
fn shifted(over: &Aabb, origin: DVec3) -> Aabb {
    let axes: [Interval; 3] = std::array::from_fn(|axis| {
        Interval::new(over.min[axis], over.max[axis]) - Interval::point(origin[axis])
    });
    Aabb::new(DVec3::from_array(axes.map(|a| a.lo)), DVec3::from_array(axes.map(|a| a.hi)))
}

impl Chosen {
    /// The program that was chosen.
    pub fn variant(&self) -> ProgramVariant {
        self.variant
    }

    /// The certified bound: |computed ω − exact ω| is nowhere larger in the box.
    pub fn bound(&self) -> f64 {
        self.bound
    }

    /// Where the bound holds.
    pub fn over(&self) -> &Aabb {
        &self.over
    }

    /// The solid itself.
    pub fn solid(&self) -> &Solid {
        &self.solid
    }

    /// The program's value at a point of the box.
    fn value(&self, programs: &Programs, p: DVec3) -> f64 {
        let engine = self.solid.inner.engine;
        match self.variant.precision {
            Precision::F64 => {
                let mut out = [0.0];
                programs.point(engine, &self.candidate.uniforms, p.to_array(), &mut out);
                out[0]
            }
            Precision::F32 => {
                let mut out = [0f32];
                let origin = self.candidate.origin;
                programs.point(engine, &self.candidate.uniforms, (p - origin).as_vec3().to_array(), &mut out);
                out[0].into()
            }
        }
    }

    /// The program's values at points that are rounded to `f32`, a block at a time.
    fn values_f32(&self, programs: &Programs, points: Points<'_>, omega: &mut [f64]) {
        let columns = [points.x, points.y, points.z];
        let origin = self.candidate.origin.to_array();
        let mut start = 0;
        for out in omega.chunks_mut(BLOCK) {
            let mut inputs = [[0f32; BLOCK]; 3];
            for ((input, column), origin) in inputs.iter_mut().zip(columns).zip(origin) {
                for (x, from) in input.iter_mut().zip(&column[start..start + out.len()]) {
                    *x = (from - origin) as f32;
                }
            }
            let mut values = [0f32; BLOCK];
            let values = &mut values[..out.len()];
            programs.batch(
                self.solid.inner.engine,
                &self.candidate.uniforms,
                inputs.each_ref().map(|input| &input[..out.len()]),
                [&mut *values],
            );
            for (out, value) in out.iter_mut().zip(values) {
                *out = f64::from(*value);
            }
            start += out.len();
        }
    }
}

impl Field for Chosen {
    fn omega(&self, p: DVec3) -> f64 {
        match &self.candidate.programs {
            Some(programs) if self.over.contains(p) => self.value(programs, p),
            _ => self.solid.omega(p),
        }
    }

    /// The solid's own program answers, because certificates are about values.
    fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        self.solid.omega_grad(p)
    }

    fn omega_many(&self, points: Points<'_>, omega: &mut [f64]) {
        let Some(programs) = &self.candidate.programs else {
            return Field::omega_many(&self.solid, points, omega);
        };
        match self.variant.precision {
            Precision::F32 => self.values_f32(programs, points, omega),
            Precision::F64 => {
                let (engine, uniforms) = (self.solid.inner.engine, &self.candidate.uniforms);
                programs.batch(engine, uniforms, [points.x, points.y, points.z], [&mut *omega]);
            }
        }
        for (i, value) in omega.iter_mut().enumerate() {
            let p = points.get(i);
            if !self.over.contains(p) {
                *value = self.solid.omega(p);
            }
        }
    }

    fn omega_grad_many(&self, points: Points<'_>, out: GradientsMut<'_>) {
        Field::omega_grad_many(&self.solid, points, out);
    }

    fn range(&self, over: &Aabb) -> Interval {
        self.solid.range(over)
    }
}

impl std::fmt::Debug for Chosen {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Chosen({:?}, {}, ± {:e})", self.solid.name(), self.variant.name(), self.bound)
    }
}
