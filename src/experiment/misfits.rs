//! Whether the particles of a scene fit its obstacles: walls and gaps that are too thin for them, and obstacles that no
//! fluid can meet.

use glam::DVec3;

use super::{Experiment, is_out_of_reach};
use crate::Solid;
use crate::diagnostic::{Code, Diagnostic, Diagnostics};
use crate::geom::to_thousandths;
use crate::lower::{Obstacle, Scene};
use crate::solid::{ProgramKind, ThinPart};
use crate::sph::Probe;

/// Part of the spacing by which an obstacle may reach into the room and count as outside of it.
const DEPTH: f64 = 0.5;

/// For obstacles with more operations it is not tested whether the fluid can meet them: that would take seconds.
const MOST_OPERATIONS: usize = 2000;

/// Maximum number of operations that are spent on the walls and gaps of all obstacles together: less than a second.
const THIN_OPERATIONS: usize = 250_000_000;

/// Walls that are thinner than this part of the spacing are reported. A particle stays half a spacing away
/// from each face: through such a wall it is nearer to those on the other side than to its own second
/// neighbours.
const THIN_WALL: f64 = 0.5;

/// Walls whose load a probe measures are reported below this part of the spacing. The kernels of particles
/// before a thinner wall reach beyond it, where nothing presses back: with still water on one side loads are
/// 5 % too large at 1.4 spacings.
const LOADED_WALL: f64 = 1.5;

/// Gaps that are thinner than this part of the spacing are reported. Particles stay half a spacing away from each face
/// and fill what is left in whole layers: under a head of thirty spacings a gap of 1 spacing holds 51 % of what it
/// should, of 1.5 spacings 66 %, of 2 spacings 93 %, and of 2.5 spacings 99 %.
const THIN_GAP: f64 = 2.0;

/// The least number of spacings across an obstacle with which its shape is seen.
const SPACINGS_ACROSS: f64 = 4.0;

/// Walls and gaps as wide as this part of the limit are wide enough.
const ALMOST: f64 = 0.999;

/// Walls, gaps and reach are not looked at in scenes with more obstacles: each obstacle would need a map of the box.
pub const MOST_OBSTACLES: usize = 50;

impl Experiment {
    /// Warnings about obstacles whose walls or gaps are too thin for the particles of the scene, and about those that no
    /// fluid can meet. Of scenes with more than [`MOST_OBSTACLES`] there are none.
    pub fn misfits(&self) -> Diagnostics {
        let (scene, spacing) = (self.scene(), self.parameters().spacing());
        let containers = usize::from(scene.container.is_some()).min(self.bodies().len());
        let (outside, obstacles) = self.bodies().split_at(containers);
        let outside = outside.first().map(|body| &body.solid);
        let (mut found, mut operations) = (Vec::new(), THIN_OPERATIONS);
        if scene.obstacles.len() > MOST_OBSTACLES {
            return self.diagnostics(found);
        }
        for (k, (obstacle, body)) in scene.obstacles.iter().zip(obstacles).enumerate() {
            found.extend(out_of_reach((scene, spacing), obstacle, (&body.solid, outside)));
            let wall = wall_limit(scene, containers + k);
            found.extend(too_fine((scene, spacing), obstacle, (&body.solid, wall), |lengths| {
                body.solid.thin_parts(lengths, &scene.domain, &mut operations)
            }));
        }
        self.diagnostics(found)
    }
}

/// A warning if no fluid can meet an obstacle.
pub fn out_of_reach(
    (scene, spacing): (&Scene, f64),
    obstacle: &Obstacle,
    (solid, outside): (&Solid, Option<&Solid>),
) -> Option<Diagnostic> {
    if solid.graph(ProgramKind::Value).0.len() > MOST_OPERATIONS {
        return None;
    }
    let is_out = is_out_of_reach(solid, outside, &scene.domain, scene.run.until, DEPTH * spacing);
    is_out.then(|| {
        let (room, help) = match &scene.container {
            Some(container) => (
                format!("the container `{}`", container.name),
                "where its face lies on the container's, both act on the fluid: let the container reach beyond it",
            ),
            None => ("the box".to_owned(), "move it into the box, or make the box larger"),
        };
        let message = format!("obstacle `{}` lies outside {room}: no fluid can be in its place", obstacle.name);
        Diagnostic::warning(Code::OUT_OF_REACH, obstacle.span, message).help(help)
    })
}

/// Warnings about what particles do not show of an obstacle: all of it, or its thinnest wall and gap, which are looked for
/// below the lengths that are handed to `thin_parts`.
pub fn too_fine(
    (scene, spacing): (&Scene, f64),
    obstacle: &Obstacle,
    (solid, of_wall): (&Solid, f64),
    thin_parts: impl FnOnce([f64; 3]) -> [Option<ThinPart>; 2],
) -> Vec<Diagnostic> {
    match too_small((scene, spacing), obstacle, solid) {
        Some(warning) => vec![warning],
        None => {
            let parts = thin_parts(thin_lengths(of_wall, spacing));
            too_thin((scene, spacing), obstacle, of_wall, parts).collect()
        }
    }
}

/// A warning if an obstacle is smaller than a particle, or a rod that is thinner than half of one.
fn too_small((scene, spacing): (&Scene, f64), obstacle: &Obstacle, solid: &Solid) -> Option<Diagnostic> {
    let mut sides = solid.bounds().aabb()?.size().to_array();
    sides.sort_by(f64::total_cmp);
    let [_, width, length] = sides;
    let (size, what) = match () {
        () if length < ALMOST * spacing => (length, "smaller than a particle: its longest side is"),
        () if width < ALMOST * THIN_WALL * spacing => {
            (width, "thinner than half of a particle: its width is")
        }
        () => return None,
    };
    let message = format!(
        "obstacle `{}` is {what} {size:.2e} m, with {spacing:.2e} m between particles, so that it hardly holds the fluid \
         up, and loads on it are too small",
        obstacle.name
    );
    let needed = rounded_down(size / SPACINGS_ACROSS);
    let help = format!("{} shows its shape; or leave the obstacle out", spacing_of(scene, spacing, needed));
    Some(Diagnostic::warning(Code::THIN_FOR_PARTICLES, obstacle.span, message).help(help))
}

/// A smaller spacing in words, and how many particles have it.
fn spacing_of(scene: &Scene, spacing: f64, needed: f64) -> String {
    let number = scene.fluid.particles.map_or_else(String::new, |n| {
        format!(", that of {:.1e} particles,", n as f64 * (spacing / needed).powi(3))
    });
    format!("a spacing of {needed:.1e} m{number}")
}

/// Messages about the thinnest wall and the thinnest gap of an obstacle.
fn too_thin(
    scene: (&Scene, f64),
    obstacle: &Obstacle,
    of_wall: f64,
    [wall, gap]: [Option<ThinPart>; 2],
) -> impl Iterator<Item = Diagnostic> {
    [(wall, "wall", of_wall), (gap, "gap", THIN_GAP)]
        .into_iter()
        .filter_map(move |(part, what, of_spacing)| thin(scene, obstacle, &part?, (what, of_spacing)))
}

/// The thicknesses, m, below which walls and gaps are reported, and the room that a fluid needs.
fn thin_lengths(of_wall: f64, spacing: f64) -> [f64; 3] {
    [of_wall * spacing, THIN_GAP * spacing, spacing]
}

fn thin(
    (scene, spacing): (&Scene, f64),
    obstacle: &Obstacle,
    part: &ThinPart,
    (what, of_spacing): (&str, f64),
) -> Option<Diagnostic> {
    let spacings = part.thickness / spacing;
    // of a search that ends a little below the limit
    if spacings > ALMOST * of_spacing {
        return None;
    }
    let how_thin = match (what, spacings) {
        ("wall", THIN_WALL..) => format!("{spacings:.1} times"),
        ("wall", _) => "less than half of".to_owned(),
        (_, 1.0..) => format!("{spacings:.1} times"),
        _ => "less than".to_owned(),
    };
    let consequence = match (what, spacings) {
        ("wall", THIN_WALL..) => {
            "; loads on it by a fluid on one side are too large, by 5 % at 1.4 times, 15 % at 1, 40 % at 0.7"
        }
        ("wall", _) => ", so that fluids on its two sides push one another through it",
        (_, 1.0..) => ", so that it holds less than it should: about 93 % at 2 times, 66 % at 1.5, 51 % at 1",
        _ => ", so that it holds half of what it should, or nothing",
    };
    let DVec3 { x, y, z } = to_thousandths(part.at);
    let point = format!("[{x:.3}, {y:.3}, {z:.3}]");
    let message = format!(
        "a {what} of obstacle `{}` is {:.2e} m wide at {}: {how_thin} the {spacing:.2e} m between particles{consequence}",
        obstacle.name, part.thickness, point
    );
    // so that it is shown
    let needed = rounded_down(part.thickness / of_spacing);
    let help = format!("{} is small enough; or make the {what} wider", spacing_of(scene, spacing, needed));
    Some(Diagnostic::warning(Code::THIN_FOR_PARTICLES, obstacle.span, message).help(help))
}

/// A length, m, rounded down to two digits.
fn rounded_down(length: f64) -> f64 {
    let unit = 10_f64.powf(length.log10().floor() - 1.0);
    // an exact number of units may lie a rounding error below it
    (length / unit * (1.0 + 1e-9)).floor() * unit
}

/// The part of the spacing below which a wall of a body, given by its number, is reported.
pub fn wall_limit(scene: &Scene, number: usize) -> f64 {
    let is_loaded = scene
        .probes
        .iter()
        .any(|probe| matches!(probe.measured, Probe::Force { obstacle, .. } if obstacle == number));
    if is_loaded { LOADED_WALL } else { THIN_WALL }
}
