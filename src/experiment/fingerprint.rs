//! Fingerprints, which say whether a state belongs to a scene.

use super::Experiment;
use crate::ir;
use crate::sph::Parameters;

impl Experiment {
    /// A fingerprint of all that determines the bits of a state: the fluid, the box, the obstacles and the
    /// method's numbers. The length of steps, the length of the run and what it saves are not part of it, so
    /// a run may continue from a [`Checkpoint`](crate::sph::Checkpoint) with other ones.
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

    /// A number that says whether deviations belong to the scene's `truth`: its formulas and the time from which they
    /// hold. Zero without a truth. Checkpoints keep it as a floating-point number, so it has 32 bits.
    pub fn truth_mark(&self) -> u32 {
        let Some(truth) = self.scene.truth else { return 0 };
        let velocity = truth.velocity.into_iter().flatten().map(|node| ("velocity", node));
        let pressure = truth.pressure.into_iter().map(|node| ("pressure", node));
        let front = truth.front.into_iter().map(|node| ("front", node));
        let roots: Vec<_> = velocity.chain(pressure).chain(front).collect();
        let text = format!("{}\n{:?}", ir::dump(&self.program.module().graph, &roots, &[]), truth.from);
        let hash = blake3::hash(text.as_bytes());
        let [a, b, c, d, ..] = *hash.as_bytes();
        u32::from_le_bytes([a, b, c, d]).max(1)
    }
}
