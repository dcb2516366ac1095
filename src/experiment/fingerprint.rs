//! Fingerprints, which say whether a state belongs to a scene.

use super::Experiment;
use crate::ir::{self, Node};
use crate::sph::{Checkpoint, Parameters};

/// What a state is marked with, so that a scene can tell whether it belongs to it, and otherwise what has changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneMark {
    fingerprint: [u8; 32],
    /// What the scene consists of, as it is called in a sentence, each with a number that changes with it.
    parts: Vec<(String, u32)>,
}

/// Begins the names of columns for the parts of a scene.
const PART: &str = "scene: ";

impl SceneMark {
    /// Marks a state.
    pub fn stamp(&self, checkpoint: &mut Checkpoint) {
        checkpoint.fingerprint = self.fingerprint;
        for (name, number) in &self.parts {
            checkpoint.set(&format!("{PART}{name}"), vec![f64::from(*number)]);
        }
    }

    /// Whether a state belongs to the scene.
    pub fn fits(&self, checkpoint: &Checkpoint) -> bool {
        checkpoint.fingerprint == self.fingerprint
    }

    /// What differs between the scene and that of a state; empty if that is not known.
    pub fn differences(&self, checkpoint: &Checkpoint) -> Vec<String> {
        let marked: Vec<(&str, &[f64])> = checkpoint
            .columns()
            .filter_map(|(name, values)| Some((name.strip_prefix(PART)?, values)))
            .collect();
        if marked.is_empty() {
            return Vec::new();
        }
        let is_same = |(name, number): &&(String, u32)| marked.contains(&(name, &[f64::from(*number)]));
        let changed = self.parts.iter().filter(|part| !is_same(part)).map(|(name, _)| name.clone());
        let is_gone = |name: &&str| !self.parts.iter().any(|(own, _)| own == name);
        let gone = marked.iter().map(|(name, _)| *name).filter(is_gone).map(str::to_string);
        changed.chain(gone).collect()
    }
}

/// The first 32 bits of the hash of a text.
fn short_hash(text: &str) -> u32 {
    let [a, b, c, d, ..] = *blake3::hash(text.as_bytes()).as_bytes();
    u32::from_le_bytes([a, b, c, d])
}

impl Experiment {
    /// A fingerprint of all that determines the bits of a state: the fluid, the box, the obstacles and the
    /// method's numbers. The length of steps, the length of the run and what it saves are not part of it, so
    /// a run may continue from a [`Checkpoint`] with other ones.
    pub fn fingerprint(&self) -> [u8; 32] {
        let scene = &self.scene;
        let fluid = &scene.fluid;
        let container = scene.container.iter().map(|c| ("container", c.outside));
        let obstacles = scene.obstacles.iter().map(|o| ("obstacle", o.shape));
        let velocity = fluid.velocity.iter().map(|node| ("velocity", *node));
        let gravity = scene.gravity.formulas().into_iter().flatten().map(|node| ("gravity", *node));
        let fluid_shape = [("fluid", fluid.shape)].into_iter();
        let roots: Vec<_> =
            fluid_shape.chain(container).chain(obstacles).chain(velocity).chain(gravity).collect();
        let skins: Vec<_> = self.bodies.iter().map(|body| &body.skin).collect();
        // a gravity that turns has one value in the parameters; its formulas are among the roots
        let parameters = Parameters { time_step: 0.0, adaptive: false, ..self.parameters.clone() };
        // numbers print with all their digits
        let text = format!(
            "{}\n{:?}\n{skins:?}\n{parameters:?}\n{:?} {:?} {:?} {}",
            ir::dump(&self.program.module().graph, &roots, &[]),
            scene.domain,
            fluid.fill,
            fluid.particles,
            fluid.jitter,
            fluid.seed,
        );
        blake3::hash(text.as_bytes()).into()
    }

    /// What states of the scene are marked with.
    pub fn mark(&self) -> SceneMark {
        let parts = self.parts().into_iter().map(|(name, text)| (name, short_hash(&text))).collect();
        SceneMark { fingerprint: self.fingerprint(), parts }
    }

    /// What the scene consists of, by the words of a sentence, each as a text that changes with it. Numbers print with
    /// all their digits.
    fn parts(&self) -> Vec<(String, String)> {
        let (scene, parameters) = (&self.scene, &self.parameters);
        let fluid = &scene.fluid;
        let formulas = |nodes: &[Node]| {
            let roots: Vec<_> = nodes.iter().map(|node| ("formula", *node)).collect();
            ir::dump(&self.program.module().graph, &roots, &[])
        };
        let gravity = scene.gravity.formulas();
        let walls = (parameters.wall_restitution, parameters.wall_friction, parameters.slip);
        let of_method = (parameters.method, parameters.support_radius, parameters.precision);
        let container = scene.container.iter().map(|c| formulas(&[c.outside]) + &format!("{:?}", c.skin));
        let mut parts: Vec<(String, String)> = vec![
            ("the box".into(), format!("{:?}", scene.domain)),
            ("the walls of the box".into(), format!("{walls:?}")),
            ("the container".into(), container.collect()),
            ("the shape of the fluid".into(), format!("{} {:?}", formulas(&[fluid.shape]), fluid.fill)),
            ("the velocity of the fluid".into(), formulas(&fluid.velocity)),
            ("the density".into(), format!("{:?}", parameters.rest_density)),
            ("the viscosity".into(), format!("{:?}", parameters.viscosity)),
            ("the surface tension".into(), format!("{:?}", parameters.surface_tension)),
            (
                "the number or the size of the particles".into(),
                format!("{:?} {:?}", fluid.particles, parameters.particle_mass),
            ),
            ("`jitter` or `seed`".into(), format!("{:?} {:?}", fluid.jitter, fluid.seed)),
            (
                "gravity".into(),
                gravity.map_or_else(|| format!("{:?}", parameters.gravity), |nodes| formulas(nodes)),
            ),
            ("the method or its numbers".into(), format!("{of_method:?}")),
        ];
        let obstacles = scene.obstacles.iter().enumerate().map(|(i, obstacle)| {
            let text = formulas(&[obstacle.shape]) + &format!("{:?}", obstacle.skin);
            (format!("obstacle {} (`{}`)", i + 1, obstacle.name), text)
        });
        parts.extend(obstacles);
        parts
    }

    /// A number that says whether deviations belong to the scene's `truth`: its formulas and the time from which they
    /// hold. Zero without a truth. Checkpoints keep it as a floating-point number, so it has 32 bits.
    pub fn truth_mark(&self) -> u32 {
        let Some(truth) = self.scene.truth else { return 0 };
        let velocity = truth.velocity.into_iter().flatten().map(|node| ("velocity", node));
        let pressure = truth.pressure.into_iter().map(|node| ("pressure", node));
        let front = truth.front.into_iter().map(|node| ("front", node));
        let roots: Vec<_> = velocity.chain(pressure).chain(front).collect();
        let text = format!("{}\n{:?}", ir::dump(&self.program.module().graph, &roots, &[]), truth.from);
        short_hash(&text).max(1)
    }
}
