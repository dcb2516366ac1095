//! Reads the fluid of a scene and how it is solved: the keys of every method, and those that a method
//! declares.

use super::super::lowering::Lowering;
use super::declaration::{SceneKey, declare_keys, names as key_names};
use super::{Block, Fluid, Solver};
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::geom::significant;
use crate::ir::{Axis, Node};
use crate::precision::Precision;
use crate::quantity::{Bound, Dimension};
use crate::sph::{Fill, KeyBlock, KeyReader, Method};
use crate::syntax::ast::Entry;

/// A fluid denser than this, kg/m³, is asked about: molten osmium has 20 000.
const MOST_DENSITY: f64 = 25_000.0;

/// Surface tensions above this are asked about, N/m: molten tungsten has 2.5.
const MOST_TENSION: f64 = 5.0;

/// Densities of liquids in g/cm³. A bare one of them is asked about, because it is lighter than any liquid in kg/m³.
const IN_GRAMS: std::ops::RangeInclusive<f64> = 0.5..=25.0;

/// What a fluid has at the start and not later, and what is said where it depends on the time.
pub(super) struct Start {
    what: &'static str,
    label: &'static str,
    help: &'static str,
}

const OF_SHAPE: Start = Start {
    what: "shape",
    label: "its shape at t = 0 is filled",
    help: "to bring the fluid into motion, state its `velocity` or move an obstacle",
};

pub(super) const OF_VELOCITY: Start = Start {
    what: "velocity",
    label: "its velocity at t = 0 is that of the particles",
    help: "what drives the fluid later is `gravity`, which may depend on the time, or an obstacle that moves",
};

declare_keys! {
    /// Keys of a fluid that every method has.
    mod keys {
        SHAPE = "shape", Other, Required,
            "where the fluid is at the start: a solid";
        FILL = "fill", Words(&["below", "middle"]), Text("below"),
            "which part of the shape is filled where there are fewer particles than fit: from below, or the middle";
        PARTICLES = "particles", Count(1), Text("as the method says, or as many as fill the shape"),
            "the number of particles";
        DENSITY = "density", Number(Dimension::DENSITY, Bound::Positive), Is(998.29),
            "the density at rest";
        MASS = "mass", Number(Dimension::MASS, Bound::Positive), Is(0.02),
            "the mass of a particle, unless `spacing` stands in its place";
        SPACING = "spacing", Number(Dimension::LENGTH, Bound::Positive), Text("from the mass"),
            "the distance of neighbouring particles, from which their mass follows";
        VISCOSITY = "viscosity", Number(Dimension::VISCOSITY, Bound::NotNegative), Text("that of the method"),
            "the dynamic viscosity";
        SURFACE_TENSION = "surface_tension", Number(Dimension::TENSION, Bound::NotNegative), Text("that of the method"),
            "the surface tension";
        SUPPORT_RADIUS = "support_radius", Number(Dimension::LENGTH, Bound::Positive), Text("that of the method"),
            "how far a particle feels others: the support of the kernel";
        VELOCITY = "velocity", Formulas(Dimension::SPEED), Is3([0.0, 0.0, 0.0]),
            "the velocity at the start; may depend on x, y and z";
        JITTER = "jitter", Number(Dimension::NONE, Bound::Fraction), Is(0.0),
            "random displacement of the places at the start, as a part of the spacing, 0 … 1";
        SEED = "seed", Count(0), Is(1.0),
            "the seed of that displacement: a whole number";
    }
}

declare_keys! {
    /// Keys of a solver that every method has.
    mod solver_keys {
        PRECISION = "precision", Words(&["auto", "f32", "f64"]), Text("auto, that of the method"),
            "the precision of the sums over neighbours";
    }
}

/// What a scene states about its fluid and method.
pub(super) struct FluidAndMethod {
    pub fluid: Fluid,
    pub method: Method,
    pub solver: Solver,
}

/// How much fluid there is, and how finely it is divided.
struct Resolution {
    density: f64,
    mass: f64,
    size_span: Option<Span>,
    support_radius: Option<f64>,
}

impl<'a> Lowering<'a> {
    /// Reads `method`, `fluid` and `solver` of a scene.
    pub(super) fn fluid_and_method(&mut self, scene: &Block<'a>) -> Option<FluidAndMethod> {
        let all = Method::all();
        let names: Vec<&str> = all.iter().map(Method::name).collect();
        let stated = self.one_word(scene, "method", &names);
        let stated = stated.map(|stated| stated.map_or_else(Method::default, |index| all[index]));
        let fluid = self.fluid_block(scene, stated);
        let solver = self.solver_block(scene, stated);
        // a method that replaces the stated one reads the keys that both of them have
        let mut method = self.method.or(stated).unwrap_or_default();
        let before = self.errors();
        method.read(&mut MethodKeys { lowering: self, fluid: fluid.as_ref(), solver: &solver });
        let precisions = [None, Some(Precision::F32), Some(Precision::F64)];
        let precision = self.word_key(&solver, &solver_keys::PRECISION, &precisions, None);
        let fluid = self.fluid(&fluid?, &method);
        let ok = self.errors() == before;
        Some(FluidAndMethod {
            fluid: fluid?,
            method: stated.and(ok.then_some(method))?,
            solver: Solver { precision: precision? },
        })
    }

    /// The entries of the fluid. A scene must have one fluid, and this version allows no more.
    fn fluid_block(&mut self, scene: &Block<'a>, method: Option<Method>) -> Option<Block<'a>> {
        let mut fluids = scene.blocks("fluid");
        let Some((label, entries, span)) = fluids.next() else {
            let help = "write `fluid water { shape: ball([1.5, 1.5, 2], 0.4), particles: 10000 }`";
            self.missing(scene, "fluid", help);
            return None;
        };
        if let Some((_, _, second)) = fluids.next() {
            let message = "a second fluid: this version simulates one fluid";
            self.report(
                Diagnostic::error(Code::SCENE_REPEATED, second, message).label(span, "the first fluid"),
            );
        }
        let known = self.keys_of(method, KeyBlock::Fluid, keys::ALL, entries);
        let mut block = self.block_with(entries, "a fluid", span, (keys::ALL, &known), &[]);
        block.label = label;
        Some(block)
    }

    /// The entries of the solver; the block is empty if the scene has none.
    fn solver_block(&mut self, scene: &Block<'a>, method: Option<Method>) -> Block<'a> {
        let (entries, span) =
            scene.blocks("solver").next().map_or((&[][..], scene.span), |(_, entries, span)| (entries, span));
        let known = self.keys_of(method, KeyBlock::Solver, solver_keys::ALL, entries);
        self.block_with(entries, "a solver", span, (solver_keys::ALL, &known), &[])
    }

    /// The known keys of a block: those of every method and those of this one. A key that only other methods
    /// have is reported.
    fn keys_of(
        &mut self,
        method: Option<Method>,
        block: KeyBlock,
        of_every_method: &[SceneKey],
        entries: &[Entry],
    ) -> Vec<&'static str> {
        let own = |method: Method| method.info().keys.into_iter().filter(|key| key.block == block);
        let names = |method: Method| own(method).map(|key| key.name);
        let Some(method) = method else {
            // the method is unknown, so the keys of all methods are accepted
            let all = Method::all().into_iter().flat_map(names);
            let mut known: Vec<&'static str> = Vec::new();
            for key in key_names(of_every_method).chain(all) {
                if !known.contains(&key) {
                    known.push(key);
                }
            }
            return known;
        };
        let known: Vec<&'static str> = key_names(of_every_method).chain(names(method)).collect();
        for entry in entries {
            let key = entry.key();
            let methods = Method::with_key(block, &key.text);
            let is_foreign = !known.contains(&key.text.as_str()) && !methods.is_empty();
            if is_foreign {
                let message = format!("`{}` is not a key of the method {}", key.text, method.name());
                let has = if methods.len() == 1 { "has" } else { "have" };
                let help = format!(
                    "{} {has} it: leave it out, or write `method: {}`",
                    methods.join(" and "),
                    methods[0]
                );
                // the same place is not reported again as an unknown key
                self.report(Diagnostic::error(Code::SCENE_KEY, key.span, message).help(help));
            }
        }
        known
    }

    fn fluid(&mut self, block: &Block<'a>, method: &Method) -> Option<Fluid> {
        let defaults = method.fluid();
        let shape = match block.setting(keys::SHAPE.name) {
            Some((_, value)) => self.shape(value).map(|node| {
                self.warn_of_constant("the fluid's shape", node, value);
                self.warn_of_time(&OF_SHAPE, &[node], value.span);
                (node, value.span)
            }),
            None => {
                self.missing(
                    block,
                    keys::SHAPE.name,
                    "write `shape: ball([1.5, 1.5, 2], 0.4)` or any other solid",
                );
                None
            }
        };
        let fill = self.word_key(block, &keys::FILL, &[Fill::Below, Fill::Middle], Fill::Below);
        let resolution = self.resolution(block);
        let mut number =
            |key, default| self.stated_number(block, key).map(|stated| stated.unwrap_or(default));
        let viscosity = number(&keys::VISCOSITY, defaults.viscosity);
        let tension = number(&keys::SURFACE_TENSION, defaults.surface_tension);
        self.warn_of_tension(block, tension);
        let jitter = self.number_key(block, &keys::JITTER);
        let velocity = self.velocity(block);
        let particles = self.count_key(block, &keys::PARTICLES);
        let seed = self.count_key(block, &keys::SEED);
        let (shape, shape_span) = shape?;
        let Resolution { density, mass, size_span, support_radius } = resolution?;
        let stated_at = |key: &SceneKey| block.setting(key.name).map(|(_, value)| value.span);
        let particles = particles?.or(defaults.particles.filter(|_| size_span.is_none()));
        Some(Fluid {
            name: block.label.map_or_else(|| "fluid".into(), |label| label.text.clone()),
            span: block.span,
            shape,
            shape_span,
            fill: fill?,
            particles,
            particles_span: block.setting(keys::PARTICLES.name).map(|(_, value)| value.span),
            density,
            mass,
            size_span,
            viscosity: viscosity?,
            surface_tension: tension?,
            tension_span: block.setting(keys::SURFACE_TENSION.name).map(|(_, value)| value.span),
            sound_span: block.setting("sound_speed").map(|(_, value)| value.span),
            support_radius,
            viscosity_span: stated_at(&keys::VISCOSITY).or(stated_at(&keys::DENSITY)),
            support_span: stated_at(&keys::SUPPORT_RADIUS),
            velocity_span: stated_at(&keys::VELOCITY),
            velocity: velocity?,
            jitter: jitter?,
            seed: seed?? as u64,
        })
    }

    /// Warns of a surface tension that no liquid has.
    fn warn_of_tension(&mut self, block: &Block<'_>, tension: Option<f64>) {
        let Some(tension) = tension.filter(|tension| *tension > MOST_TENSION) else { return };
        let Some((_, value)) = block.setting(keys::SURFACE_TENSION.name) else { return };
        let number = significant(tension);
        let message = format!("no liquid has a surface tension of {number} N/m");
        let help = format!("water has 0.0728 N/m, mercury 0.49 N/m: is `{number} mN/m` meant?");
        self.report(Diagnostic::warning(Code::ODD_QUANTITY, value.span, message).help(help));
    }

    /// Warns of a fluid's shape or velocity that depends on the time: particles are placed once.
    pub(super) fn warn_of_time(&mut self, start: &Start, nodes: &[Node], at: Span) {
        if !nodes.iter().any(|&node| self.module.graph.uses(node, Axis::T)) {
            return;
        }
        let Start { what, label, help } = start;
        let message = format!("the fluid's {what} depends on the time, and particles are placed once");
        self.report(Diagnostic::warning(Code::FLUID_OF_TIME, at, message).at(*label).help(*help));
    }

    /// Reads density, mass and support radius of the particles. A spacing may replace the mass.
    fn resolution(&mut self, block: &Block<'_>) -> Option<Resolution> {
        let density = self.number_key(block, &keys::DENSITY);
        if let (Some(density), Some((_, value))) = (density, block.setting(keys::DENSITY.name))
            && density > MOST_DENSITY
        {
            let message = format!("a fluid of {} kg/m³ is denser than any liquid", significant(density));
            self.report(
                Diagnostic::warning(Code::HEAVY_FLUID, value.span, message)
                    .help("water has 998 kg/m³, mercury 13 546: is the unit the one that is meant? `1 g/cm^3` is 1000 kg/m³"),
            );
        }
        if let (Some(density), Some((_, value))) = (density, block.setting(keys::DENSITY.name))
            && IN_GRAMS.contains(&density)
            && self.is_bare(value)
        {
            let message = format!("a fluid of {} kg/m³ is lighter than any liquid", significant(density));
            let number = significant(density);
            let help = format!("is `{number} g/cm^3` meant? if not, write `{number} kg/m^3`");
            self.report(Diagnostic::warning(Code::HEAVY_FLUID, value.span, message).help(help));
        }
        let mass = self.number_key(block, &keys::MASS);
        let spacing = self.stated_number(block, &keys::SPACING);
        let both = (block.setting(keys::MASS.name), block.setting(keys::SPACING.name));
        if let (Some((first, _)), Some((second, _))) = both {
            let message = "`mass` and `spacing` say the same: the mass of a particle is density·spacing³";
            self.report(
                Diagnostic::error(Code::SCENE_REPEATED, second.span, message)
                    .label(first.span, "the mass is stated here"),
            );
        }
        let (mass, density) = (mass?, density?);
        let mass = spacing?.map_or(mass, |spacing| density * spacing.powi(3));
        let support_radius = self.stated_number(block, &keys::SUPPORT_RADIUS)?;
        let size_span = both.1.or(both.0).map(|(_, value)| value.span);
        Some(Resolution { density, mass, size_span, support_radius })
    }

    /// Reads the velocity at the start, which may depend on the place.
    fn velocity(&mut self, block: &Block<'_>) -> Option<[Node; 3]> {
        match block.setting(keys::VELOCITY.name) {
            Some((_, value)) => self.components(value, &keys::VELOCITY),
            None => Some([self.module.graph.constant(0.0); 3]),
        }
    }
}

/// Gives a method the keys that a scene states.
struct MethodKeys<'r, 'a> {
    lowering: &'r mut Lowering<'a>,
    /// `None` if the scene has no fluid, which was reported.
    fluid: Option<&'r Block<'a>>,
    solver: &'r Block<'a>,
}

impl<'r, 'a> MethodKeys<'r, 'a> {
    /// The block; `None` if it does not state the key.
    fn stating(&self, block: KeyBlock, key: &str) -> Option<&'r Block<'a>> {
        let block = match block {
            KeyBlock::Fluid => self.fluid?,
            KeyBlock::Solver => self.solver,
        };
        block.setting(key).map(|_| block)
    }
}

impl KeyReader for MethodKeys<'_, '_> {
    fn number(
        &mut self,
        block: KeyBlock,
        key: &'static str,
        dimension: Dimension,
        bound: Bound,
    ) -> Option<f64> {
        let block = self.stating(block, key)?;
        self.lowering.number_in(block, key, dimension, bound)?
    }

    fn count(&mut self, block: KeyBlock, key: &'static str, least: u32) -> Option<u32> {
        let block = self.stating(block, key)?;
        let count = self.lowering.count_in(block, key, least)??;
        u32::try_from(count).ok()
    }

    fn word(&mut self, block: KeyBlock, key: &'static str, words: &[&'static str]) -> Option<usize> {
        let block = self.stating(block, key)?;
        self.lowering.one_word(block, key, words)?
    }
}
