//! Scenes with one mistake, and what the messages suggest.

use super::{program, read};

/// The scene that a line of [`SCENES`] changes: a line replaces the one with its key, or is added.
const SCENE: [(&str, &str); 5] = [
    ("box", "box { max: [1, 1, 1] }"),
    ("fluid", "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm }"),
    ("obstacle", "obstacle { solid: post }"),
    ("method", "method: wcsph"),
    ("run", "run { until: 1 s }"),
];

const SCENES: &[&str] = &[
    "obstacle sphere(0.1)",
    "probe q { flux { point: [0.5, 0, 0], normal: x } }",
    "obstacle cylinder(0.1, 0.2).move([0.5, 0.5, 0]).rotate_z(3 deg)",
    "container box([0, 0, 0], [1, 1, 0.9])",
    "gravity: [0 0 -9.81]",
    "run { until: 1 s, dt: auto }",
    "run { until: 1 s, write_interval: 0.1 s }",
    "kernel: wendland",
    "fluid { shape: box([-5, 0.45, 0.5], [1, 0.55, 0.9]), spacing: 2 cm }",
    "gravity: off",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm, viscosity: 1 mPas\n}",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), viscosity: 1 cPs\nspacing: 5 cm }",
    "fluid { shape: ball([5, 5, 5], 0.2) }",
    "fluid { shape: z <= -1 }",
    "fluid { shape: ball([0.5, 0.5, 1], 0.2), spacing: 5 cm }",
    "fluid { shape: box([-1, 0, 0.5], [1, 1, 2]), spacing: 5 cm }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 }",
    "fluid { shape: box([0.3, 0.3, 0.5], [0.7, 0.7, 0.9]), spacing: 5 }",
    "fluid { shape: box([0.3, 0.3, 0.5], [0.7, 0.7, 0.9]), mass: 100 kg }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 1 mm), spacing: 2 cm }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), particles: 1e9 }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), particles: 500, spacing: 5 cm }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 0.1 mm }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), particles: 2e9 }",
    "fluid { shape: ball([0.5, 0.5, 0.1], 0.1), spacing: 2 cm }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), density = 1000 }",
    "fluid = { shape: ball([0.5, 0.5, 0.7], 0.2) }",
    "fluid: { shape: ball([0.5, 0.5, 0.7], 0.2) }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), density: 1000 g }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), densty: 1000 }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), viscosity: 1 cP }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: width }",
    "box { min: [0, 0, 0], max: [1, 1, 0] }",
    "box { size: [1, 1, 1] }",
    "gravity: -9.81",
    "gravity = [0, 0, -9.81]",
    "obstacle { solid: pots }",
    "obstacle: post",
    "obstacle = post",
    "fluid: water",
    "fluid = water",
    "fluid: post",
    "fluid = post",
    "fluid = ball([0.5, 0.5, 0.7], 0.2)",
    "box = [2, 2, 2]",
    "run = 2 s",
    "method: sph",
    "method: pcisph",
    "run { dt: 10 }",
    "run { until: 1 s, save_every: 2 s }",
    "run { until: 1 s, save_every: 1e-9 s }",
    "run { until: 1 s, save_every: 10 us }",
    "run { until: 5 mm }",
    "run { end: 1 s }",
    "probe g { height: [0.5, 0.5, 0] }",
    "probe g { flux: [0.5, 0.5, 0.5] }",
    "probe g { energy: air }",
    "run { until: 1 s, checkpoint_every: 5 s }",
    "picture { camera: [0, 0, 0] }",
    "picture { camera: 45 deg }",
    "picture { cut: 0.5 }",
    "picture { cut: y <= x }",
    "picture { cut: 0.2 <= y <= 0.5 }",
    "picture { cut: y <= 5 kg }",
    "picture { cut: y == 0.5 }",
    "picture { cut: half }",
    "picture { hide: pots }",
    "picture { hide: [post, 3] }",
    "picture { view: [0, -1, 0] }",
    "picture: [0, -1, 0]",
    "camera: [0, -1, 0]",
    "until: 1 s",
    "gravity: 9.81",
    "fluid { shape: box([0.45, 0.45, 0.1], [0.55, 0.55, 0.2]), particles: 200 }",
    "obstacle { post }",
    "obstacle post\n  gravity: [0, 0, 0]",
    "obstacle post",
    "fluid oil\n  gravity: [0, 0, 0]",
    "obstacle { solid: post, velocity: [1, 0, 0] }",
    "obstacle { solid: post, density: 500 }",
    "inlet { velocity: [1, 0, 0] }",
    "time_step: 0.001 s",
    "box: [0, 0, 0] .. [1, 1, 1]",
    "box: [0, 0, 0], [1, 1, 1]",
    "run { until: sqrt(2) s }",
    "probe load { force: post, known: [0, 0, -490.5*sqrt(2) N] }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm, nu: 1e-6 }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm, viscosity: 1e-6 m^2/s }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm, viscosity: 1 mPa s }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm, viscosity: 0.001 Pa.s }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm, density: 1000 kg/m3 }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm, density: 1000 kg m^-3 }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm, surface_tension: 72 dyn/cm }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm, temperature: 20 C }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm, support_radius: 1 mm }",
    "run { until: 1 s, save_every: 1 ns }",
    "run { until: 1 s, fps: 25 }",
    "picture { cut: z = 0.5 }",
    "box { max: 1 }",
    "boundary: periodic",
    "\"box\": { \"max\": [1, 1, 1] }",
    "container { solid: post }",
    "fluid { shape: 5, spacing: 5 cm }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 2*width; }",
    "box { max: [1, 2 3] }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm, density: 1 000 }",
    "box { min: [-0.5, -0.5, 0], size: [1, 1.1, 1] }",
    "box { min: [-width, -0.5, 0], size: [1, 1, 1] }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm, velocity: [t, 0, 0] }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm, velocity: [0, 0, -1] m/s }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm, velocity: [0 m/s, 0 m/s, -1 m/s] m/s }",
    "gravity: [0, 0, -9.81] m/s^2\n  tolerance: 1e-6",
    "let q = 3",
    "solid q = sphere(1)",
    "fn f(a) = a^2",
    "probe \"my gauge\" { height: [0.5, 0.5] }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm \"of water\" }",
    "obstacle gate { solid: post }",
    "box room { max: [1, 1, 1] }",
    "obstacle { solid: post }\n  obstacle { solid: post }",
    "picture { look_at: [5, 0, 0] }",
    "run { until: 1 s, checkpoint_every: 1e-9 s }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm, density: 1e-9 }",
    "fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm, viscosity: 1e9 }",
];

#[test]
fn scenes_with_one_mistake() {
    let scene = |changed: &str| {
        let key = changed.split([':', ' ']).next().unwrap_or_default();
        let mut lines: Vec<&str> =
            SCENE.iter().map(|(name, line)| if *name == key { changed } else { *line }).collect();
        if !SCENE.iter().any(|(name, _)| *name == key) {
            lines.push(changed);
        }
        format!(
            "param width = 2 kg\nlet _width = width\nsolid post = cylinder(0.1, 0.3).move([0.5, 0.5, 0])\nscene drop {{\n  {}\n}}",
            lines.join("\n  ")
        )
    };
    read("scenes", SCENES.iter().map(|line| (line.to_string(), scene(line))));
}

#[test]
fn the_solid_that_is_proposed_for_an_obstacle_can_be_pasted() {
    let around = |obstacle: &str| {
        format!(
            "solid stone = box().move([5, 5, 5])\nsolid post = box()\nscene s {{\n  box {{ max: [1, 1, 1] }}\n  {obstacle}\n  fluid {{ shape: \
             ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm }}\n}}"
        )
    };
    for (block, shape, name) in [
        ("obstacle", "sphere(0.1)", "stone2"),
        ("obstacle", "box([0, 0, 0], [0.1, 0.1, 0.1])", "block"),
        ("obstacle", "cylinder(0.1, 0.2).move([0.5, 0.5, 0])", "post2"),
        ("container", "torus(0.8, 0.7).move([0.5, 0.5, 0.5])", "room"),
    ] {
        let refused = program(&around(&format!("{block} {shape}"))).expect_err(shape);
        let help = refused.list[0].help.clone().unwrap_or_default();
        let parts: Vec<&str> = help.split('`').skip(1).step_by(2).collect();
        let [solid, entry] = parts[..] else { panic!("{help}") };
        assert_eq!(solid, format!("solid {name} = {shape}"));
        let mended = around(entry).replace("scene s", &format!("{solid}\nscene s"));
        program(&mended).unwrap_or_else(|error| panic!("{mended}\n{error}"));
    }
}
