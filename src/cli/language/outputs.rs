//! `rfm explain outputs`: the files of a run, the keys of its summary, the columns of its tables and the arrays of its
//! frames.
//!
//! Invariant: every key, column and array that a run writes is described here, and nothing else: the tests compare the
//! page with what runs have written.

use rfm::glam::DVec3;
use rfm::sph::Probe;

/// A figure or a file: its name, its unit, and what it means.
type Entry = (&'static str, &'static str, &'static str);

const HEAD: &str = "# What a run writes

`rfm explain outputs` prints this page, and `rfm explain max_speed` an entry of it. Everything is in SI units. *Saved instants* are
those of the frames; a run with `--no-frames` has them too.

";

const FILES: [Entry; 13] = [
    ("summary.json", "", "the figures by which a run is judged, see below; `rfm run --json` prints the same"),
    ("history/energy.csv", "", "the energies of the fluid, ten times from frame to frame"),
    ("history/audit.csv", "", "the figures of the audit, ten times from frame to frame"),
    (
        "probes/*.csv",
        "",
        "the samples of each probe of the scene; `.svg` and `.png` of the same name are its plot",
    ),
    ("particles.pvd", "", "the times of the frames: what ParaView opens"),
    ("frames/particles_*.vtp", "", "the particles at a saved instant, in the order of their ids"),
    ("open_in_paraview.py", "", "a state for ParaView: frames, obstacles, colours and light"),
    ("obstacle.stl", "", "the obstacles at the start as one mesh, in m"),
    ("obstacle.vtp", "", "the same with the number of the obstacle at each point"),
    ("obstacle.pvd", "", "the times of the frames of obstacles, if one moves"),
    ("frames/obstacle_*.vtp", "", "the obstacles at a saved instant, if one moves"),
    ("pictures/frame_*.png", "", "a picture of each saved instant"),
    ("checkpoints/*", "", "the last two whole states, from which `--resume` goes on"),
];

const SUMMARY: [Entry; 45] = [
    ("schema", "", "the number of this form, 1: keys may be added to it, and none changes its meaning"),
    ("file", "", "the name of the file, without its folder"),
    ("scene", "", "the name of the scene"),
    ("method", "", "the method"),
    ("obstacles", "", "the names of the obstacles, in the order of the array `body`"),
    ("steps", "", "the number of steps from the start"),
    ("simulated_seconds", "s", "the time at the end"),
    ("time_step", "s", "the mean length of a step"),
    ("sound_speed", "m/s", "the speed of sound that the method computes with; null if it has none"),
    ("sound_speed_stated", "", "whether the scene states it; otherwise it is derived"),
    ("particles", "", "the number of particles at the end"),
    (
        "particles_carved",
        "",
        "particles removed at the start, because they were in an obstacle or too near to one",
    ),
    ("particle_mass", "kg", "the mass of one particle"),
    ("spacing", "m", "the distance of particles at rest: the cube root of the volume of one"),
    ("rest_density", "kg/m³", "the density of the fluid at rest, ρ₀"),
    ("milliseconds_per_step", "ms", "the mean time that a step took, frames and tables not included"),
    ("neighbours_per_particle", "", "the mean over the saved instants, the particle itself not included"),
    (
        "max_penetration",
        "m",
        "the largest depth of a particle in an obstacle, ω/|∇ω|, at a saved instant; 0 in a sound run",
    ),
    ("inside", "", "the most particles in an obstacle (ω > 0) at a saved instant; 0 in a sound run"),
    ("lost", "", "the most particles outside the box at a saved instant; 0 in a sound run"),
    (
        "non_finite",
        "",
        "the most particles without a finite place, velocity or density at a saved instant; 0 in a sound run",
    ),
    (
        "max_density_error",
        "part of ρ₀",
        "the largest (ρ − ρ₀)/ρ₀ of a particle at a saved instant, by the density that the method carries along and \
         takes its pressure from; at least 0. `compression_max` has the density that the places of the particles say",
    ),
    ("kinetic_energy", "J", "Σ ½mv² at the last saved instant"),
    (
        "potential_energy",
        "J",
        "at the last saved instant, from the lowest corner of the box along gravity; 0 if gravity depends on the \
         place",
    ),
    ("energy_at_start", "J", "kinetic and potential energy at the start"),
    (
        "energy_excess",
        "part of the greatest energy",
        "the worst excess after any step of kinetic and elastic energy over that at the start and the work of gravity \
         and of moving walls since: what came from nowhere. It is divided by the greatest energy so far, potential \
         energy from the lowest corner of the box included. Where walls move, it is counted from the least excess \
         before, in means over 8 steps. At least 0, and above 0.01 a finding (W0511); where walls move and their work \
         is known roughly, above 0.05. Null if it cannot be judged",
    ),
    ("energy_unjudged", "", "why the energy cannot be judged; absent if it is"),
    (
        "wall_work",
        "J",
        "the work of moving walls on the fluid, by pressure, friction and contacts; null if the energy cannot be \
         judged",
    ),
    (
        "volume_change",
        "part of the volume",
        "the largest change of the fluid's volume since the start, by the places of the particles; below 0 if it \
         shrank. Looked at every 8 steps",
    ),
    (
        "compression_mean",
        "part of ρ₀",
        "the largest mean of (ρ − ρ₀)/ρ₀ over the particles, where ρ is the density that their places say, and at \
         least ρ₀. Looked at every 8 steps, as the next two",
    ),
    ("compression_p99", "part of ρ₀", "the largest value that one particle in a hundred exceeds"),
    ("compression_max", "part of ρ₀", "the largest value of a particle"),
    (
        "crowded",
        "part of the particles",
        "the largest part, beyond that at the start, of those that were closer to another one than half a spacing: above \
         0.3 a finding (W0527). Counted every 16 steps, with `dfsph` every 2; 0 with `method: paper` and of fewer than 100",
    ),
    ("max_speed", "m/s", "the greatest speed of a particle after any step"),
    (
        "findings",
        "",
        "the codes of what the audit found, of W0511 to W0513, W0520 and W0527: `rfm explain W0511`",
    ),
    (
        "pressure_error",
        "part of the truth",
        "the deviation from the `truth` of the scene: the root of Σ(p − p′)²/Σp′² over all particles and saved \
         instants; absent if nothing is stated",
    ),
    ("velocity_error", "part of the truth", "the same of the velocity"),
    ("front_error", "part of the truth", "the same of the front on the floor, over the saved instants"),
    ("probes", "", "the means of probes with `from` or `known`, see below; absent without any"),
    ("passes", "", "the parts of a step, in their order"),
    ("box", "m", "the lowest and the highest corner of the box of the scene"),
    (
        "picture",
        "",
        "what the scene states in `picture { … }`, for later pictures: null and empty where it states nothing",
    ),
    ("threads", "", "the number of threads; results do not depend on it"),
    ("frames", "", "the number of frames that were saved"),
    ("finished", "", "whether the run reached its end; false after Ctrl-C and after an error"),
];

const MEANS: [Entry; 9] = [
    ("probes[].probe", "", "the name of the probe"),
    ("probes[].from", "s", "the time from which samples count"),
    ("probes[].samples", "", "how many count"),
    ("probes[].samples_lost", "", "samples that the table lacks after `--resume`; absent if there are none"),
    ("probes[].columns", "", "the names of the figures, with their units"),
    ("probes[].mean", "", "the mean of each figure over time; null without a sample"),
    (
        "probes[].error",
        "",
        "the standard error of each mean, correlation in time included; null with too few samples",
    ),
    ("probes[].known", "", "what the scene states in `known`; empty if it states nothing"),
    (
        "probes[].deviation",
        "part of what is known",
        "how far the means are from what is known; in their unit if that is 0; absent if nothing is known",
    ),
];

const PARTICLES: [Entry; 6] = [
    ("speed", "m/s", "the length of the velocity"),
    ("velocity", "m/s", "three components"),
    ("density", "kg/m³", "the density that the method carries along; with `dfsph` that of the places"),
    ("pressure", "Pa", "the pressure of the method"),
    ("id", "", "the number of the particle, the same in all frames"),
    ("position", "m", "the points; 64 bits where 32 would be too coarse, as far from the origin"),
];

const OBSTACLES: [Entry; 3] = [
    ("normals", "", "the outward normal of the surface"),
    ("body", "", "the number of the obstacle, in the order of `obstacles` in the summary"),
    ("points", "m", "the vertices; `connectivity` and `offsets` are the triangles"),
];

/// A probe of each kind, and what its columns mean.
fn tables() -> [(&'static str, Probe, &'static [&'static str]); 7] {
    let at = DVec3::ZERO;
    [
        (
            "energy",
            Probe::Energy,
            &[
                "kinetic energy, Σ ½mv²",
                "potential energy, from the lowest corner of the box along gravity; 0 if gravity depends on the place",
                "elastic energy: the work of pressure from the rest density on; 0 with `dfsph`",
                "their sum",
            ],
        ),
        (
            "audit",
            Probe::Audit,
            &[
                "the present excess of energy, as `energy_excess` in the summary; below 0 as long as more was dissipated, nan \
                 if it cannot be judged",
                "the present change of the volume, as `volume_change`",
                "the present compression, as `compression_mean`",
                "as `compression_p99`",
                "as `compression_max`",
                "the greatest speed of a particle at present",
            ],
        ),
        (
            "height",
            Probe::Height { x: 0.0, y: 0.0 },
            &[
                "z of the surface above the place: the highest place where half of the kernel is filled; of dry ground its z; \
                 nan in a body",
            ],
        ),
        ("pressure", Probe::Pressure { at }, &["the pressure at the place; 0 without fluid near it"]),
        (
            "velocity",
            Probe::Velocity { at },
            &[
                "the velocity at the place; nan without fluid near it",
                "its second component",
                "its third component",
            ],
        ),
        (
            "force",
            Probe::Force { obstacle: 0, about: at },
            &[
                "the mean force of the fluid on the obstacle since the last sample, by pressure, friction and contacts; of \
                 `wcsph` with `gradients: differences` the pressure is that at the sample",
                "its second component",
                "its third component",
                "the mean torque about the point `about`",
                "its second component",
                "its third component",
            ],
        ),
        (
            "flux",
            Probe::Flux { point: at, normal: DVec3::X },
            &["the mass that passes the plane along its normal"],
        ),
    ]
}

/// The page, as Markdown.
pub(in crate::cli) fn all() -> String {
    let mut page = HEAD.to_string();
    let mut list = |title: &str, entries: &[Entry]| {
        page += &format!("## {title}\n\n");
        entries.iter().for_each(|entry| page += &line(entry));
        page += "\n";
    };
    list("Files", &FILES);
    list("Keys of `summary.json`", &SUMMARY);
    list("Keys of each of `probes` in it", &MEANS);
    list("Arrays of `particles_*.vtp`", &PARTICLES);
    list("Arrays of `obstacle.vtp` and `obstacle_*.vtp`", &OBSTACLES);
    page += "## Columns of tables\n\nThe first column of each table is `time [s]`. A value that is not there is `nan`.\n";
    for (name, probe, about) in tables() {
        page += &format!("\n`{name}`, in {}:\n\n", place(&probe));
        for (column, about) in columns(&probe, about) {
            page += &format!("- `{column}`: {about}\n");
        }
    }
    page
}

/// Where the table of a kind of probe is.
fn place(probe: &Probe) -> &'static str {
    match probe {
        Probe::Energy => "`history/energy.csv`, and probes with the key `energy`",
        Probe::Audit => "`history/audit.csv`, and probes with the key `audit`",
        Probe::Height { .. }
        | Probe::Pressure { .. }
        | Probe::Velocity { .. }
        | Probe::Force { .. }
        | Probe::Flux { .. } => "probes with this key",
    }
}

fn columns<'a>(probe: &Probe, about: &'a [&str]) -> impl Iterator<Item = (String, &'a str)> {
    probe.columns().iter().zip(about).map(|((name, unit), about)| (format!("{name} [{unit}]"), *about))
}

fn line((name, unit, about): &Entry) -> String {
    let unit = if unit.is_empty() { String::new() } else { format!(" ({unit})") };
    format!("- `{name}`{unit}: {about}\n")
}

/// What is known of one key, array or column; `None` if there is none of this name.
pub(in crate::cli) fn of(word: &str) -> Option<String> {
    let lists: [&[Entry]; 4] = [&SUMMARY, &MEANS, &PARTICLES, &OBSTACLES];
    let own = |name: &str| name == word || name.rsplit('.').next() == Some(word);
    let mut found: String = lists.into_iter().flatten().filter(|(name, ..)| own(name)).map(line).collect();
    for (_, probe, about) in tables() {
        for ((name, _), (column, about)) in probe.columns().iter().zip(columns(&probe, about)) {
            if *name == word {
                found += &format!("- `{column}`: {about}\n");
            }
        }
    }
    (!found.is_empty()).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_column_of_a_table_is_described() {
        for (name, probe, about) in tables() {
            assert_eq!(probe.columns().len(), about.len(), "{name}");
        }
        assert!(of("max_speed").unwrap().contains("(m/s)") && of("deviation").unwrap().contains("known"));
        assert!(of("kinetic").unwrap().starts_with("- `kinetic [J]`: "));
        assert_eq!(of("nothing"), None);
    }
}
