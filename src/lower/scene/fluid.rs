//! Reads the fluid of a scene and how it is solved: the keys of every method, and those that a method
//! declares.

use super::super::lowering::Lowering;
use super::{Block, Fluid, Solver};
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::ir::Node;
use crate::precision::Precision;
use crate::quantity::{Bound, Dimension};
use crate::sph::{Fill, KeyBlock, KeyReader, Method};
use crate::syntax::ast::Entry;

/// Keys of a fluid that every method has.
pub(in crate::lower) const FLUID_KEYS: [&str; 12] = [
    "shape",
    "fill",
    "particles",
    "density",
    "mass",
    "spacing",
    "viscosity",
    "surface_tension",
    "support_radius",
    "velocity",
    "jitter",
    "seed",
];

/// Keys of a solver that every method has.
pub(in crate::lower) const SOLVER_KEYS: [&str; 1] = ["precision"];

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
        let words: Vec<(&str, Method)> = all.iter().map(|method| (method.name(), *method)).collect();
        let stated = self.word_key(scene, "method", &words);
        let fluid = self.fluid_block(scene, stated);
        let solver = self.solver_block(scene, stated);
        // a method that replaces the stated one reads the keys that both of them have
        let mut method = self.method.or(stated).unwrap_or_default();
        let before = self.errors();
        method.read(&mut MethodKeys { lowering: self, fluid: fluid.as_ref(), solver: &solver });
        let precision = self.word_key(
            &solver,
            "precision",
            &[("auto", None), ("f32", Some(Precision::F32)), ("f64", Some(Precision::F64))],
        );
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
        let known = self.keys_of(method, KeyBlock::Fluid, &FLUID_KEYS, entries);
        let mut block = self.block(entries, "a fluid", span, &known, &[]);
        block.label = label;
        Some(block)
    }

    /// The entries of the solver; the block is empty if the scene has none.
    fn solver_block(&mut self, scene: &Block<'a>, method: Option<Method>) -> Block<'a> {
        let (entries, span) =
            scene.blocks("solver").next().map_or((&[][..], scene.span), |(_, entries, span)| (entries, span));
        let known = self.keys_of(method, KeyBlock::Solver, &SOLVER_KEYS, entries);
        self.block(entries, "a solver", span, &known, &[])
    }

    /// The known keys of a block: those of every method and those of this one. A key that only other methods
    /// have is reported.
    fn keys_of(
        &mut self,
        method: Option<Method>,
        block: KeyBlock,
        of_every_method: &[&'static str],
        entries: &[Entry],
    ) -> Vec<&'static str> {
        let own = |method: Method| method.info().keys.into_iter().filter(|key| key.block == block);
        let names = |method: Method| own(method).map(|key| key.name);
        let Some(method) = method else {
            // the method is unknown, so the keys of all methods are accepted
            let all = Method::all().into_iter().flat_map(names);
            return of_every_method.iter().copied().chain(all).collect();
        };
        let known: Vec<&'static str> = of_every_method.iter().copied().chain(names(method)).collect();
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
        let shape = match block.setting("shape") {
            Some((_, value)) => self.shape(value).map(|node| {
                self.warn_of_constant("the fluid's shape", node, value);
                (node, value.span)
            }),
            None => {
                self.missing(block, "shape", "write `shape: ball([1.5, 1.5, 2], 0.4)` or any other solid");
                None
            }
        };
        let fill = self.word_key(block, "fill", &[("below", Fill::Below), ("middle", Fill::Middle)]);
        let resolution = self.resolution(block);
        let mut number =
            |key, dimension, default, bound| self.number_key(block, key, dimension, Some(default), bound);
        let viscosity = number("viscosity", Dimension::VISCOSITY, defaults.viscosity, Bound::NotNegative);
        let tension =
            number("surface_tension", Dimension::TENSION, defaults.surface_tension, Bound::NotNegative);
        let jitter = number("jitter", Dimension::NONE, 0.0, Bound::Fraction);
        let velocity = self.velocity(block);
        let particles = self.count_key(block, "particles", 1);
        let seed = self.count_key(block, "seed", 0);
        let (shape, shape_span) = shape?;
        let Resolution { density, mass, size_span, support_radius } = resolution?;
        let particles = particles?.or(defaults.particles.filter(|_| size_span.is_none()));
        Some(Fluid {
            name: block.label.map_or_else(|| "fluid".into(), |label| label.text.clone()),
            span: block.span,
            shape,
            shape_span,
            fill: fill?,
            particles,
            particles_span: block.setting("particles").map(|(_, value)| value.span),
            density,
            mass,
            size_span,
            viscosity: viscosity?,
            surface_tension: tension?,
            tension_span: block.setting("surface_tension").map(|(_, value)| value.span),
            support_radius,
            velocity: velocity?,
            jitter: jitter?,
            seed: seed?.unwrap_or(1) as u64,
        })
    }

    /// Reads density, mass and support radius of the particles. A spacing may replace the mass.
    fn resolution(&mut self, block: &Block<'_>) -> Option<Resolution> {
        let mut number =
            |key, dimension, default| self.number_key(block, key, dimension, Some(default), Bound::Positive);
        let density = number("density", Dimension::DENSITY, 998.29);
        let mass = number("mass", Dimension::MASS, 0.02);
        let spacing = number("spacing", Dimension::LENGTH, 0.02);
        let both = (block.setting("mass"), block.setting("spacing"));
        if let (Some((first, _)), Some((second, _))) = both {
            let message = "`mass` and `spacing` say the same: the mass of a particle is density·spacing³";
            self.report(
                Diagnostic::error(Code::SCENE_REPEATED, second.span, message)
                    .label(first.span, "the mass is stated here"),
            );
        }
        let (mass, density) = (mass?, density?);
        let mass = if both.1.is_some() { density * spacing?.powi(3) } else { mass };
        let support_radius = match block.setting("support_radius") {
            Some(_) => {
                Some(self.number_key(block, "support_radius", Dimension::LENGTH, None, Bound::Positive)?)
            }
            None => None,
        };
        let size_span = both.1.or(both.0).map(|(_, value)| value.span);
        Some(Resolution { density, mass, size_span, support_radius })
    }

    /// Reads the velocity at the start, which may depend on the place.
    fn velocity(&mut self, block: &Block<'_>) -> Option<[Node; 3]> {
        match block.setting("velocity") {
            Some((_, value)) => self.components(value, Dimension::SPEED, "velocity"),
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
        self.lowering.number_key(block, key, dimension, None, bound)
    }

    fn count(&mut self, block: KeyBlock, key: &'static str, least: u32) -> Option<u32> {
        let block = self.stating(block, key)?;
        let count = self.lowering.count_key(block, key, least)??;
        u32::try_from(count).ok()
    }

    fn word(&mut self, block: KeyBlock, key: &'static str, words: &[&'static str]) -> Option<usize> {
        let block = self.stating(block, key)?;
        let words: Vec<(&str, usize)> =
            words.iter().enumerate().map(|(index, word)| (*word, index)).collect();
        self.lowering.word_key(block, key, &words)
    }
}
