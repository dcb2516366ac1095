//! The probes of a scene: what is measured while it runs, and how often.
//!
//! Invariant: every place lies in the scene's box, and every normal has length one.

use glam::DVec3;

use super::lowering::Lowering;
use super::names::Kind;
use super::scene::declaration::{SceneKey, declare_keys, names};
use super::scene::run::times_as_written;
use super::scene::{AskedMean, Block, SceneProbe};
use crate::diagnostic::{Code, Diagnostic, SourceId};
use crate::geom::Aabb;
use crate::quantity::Dimension;
use crate::sph::Probe;
use crate::syntax::ast::{Entry, Expr, ExprKind};

const MEASURED: [&str; 7] = ["height", "pressure", "velocity", "force", "flux", "energy", "audit"];

declare_keys! {
    /// Keys of a probe.
    mod keys {
        HEIGHT = "height", Other, Required,
            "measures the height of the surface, or of dry ground, in m, above a place [x, y], in m";
        PRESSURE = "pressure", Other, Required,
            "measures the pressure, in Pa, at a place, in m";
        VELOCITY = "velocity", Other, Required,
            "measures the velocity, in m/s, at a place, in m";
        FORCE = "force", Other, Required,
            "measures the force on an obstacle, in N, and its torque, in N·m";
        FLUX = "flux", Block(super::flux_keys::ALL), Required,
            "the block for a plane: measures how much flows through it, in kg/s";
        ENERGY = "energy", Other, Required,
            "measures the energies of the fluid with this name, in J; gravity that depends on the place has no potential energy here";
        AUDIT = "audit", Other, Required,
            "tells how far energy, volume and compression of the fluid with this name are off";
        ABOUT = "about", Vector(Dimension::LENGTH), Is3([0.0, 0.0, 0.0]),
            "the point about which the torque of a `force` is taken";
        EVERY = "every", Number(Dimension::TIME, Bound::Positive), Text("that of the frames"),
            "the simulated time between samples";
        FROM = "from", Number(Dimension::TIME, Bound::NotNegative), Text("no mean"),
            "asks for the mean of all samples from this time on, with its standard error";
        KNOWN = "known", Measured, Text("nothing"),
            "what the mean is to be: the run says how far off it is";
    }
}

declare_keys! {
    /// Keys of a flux.
    mod flux_keys {
        POINT = "point", Vector(Dimension::LENGTH), Required,
            "a point of the plane";
        NORMAL = "normal", Vector(Dimension::NONE), Required,
            "the direction in which the flow counts as positive; of any length";
    }
}

/// What the probes of a scene may refer to.
pub(super) struct Surroundings<'a> {
    pub domain: Aabb,
    /// Names of the bodies, in the order of their numbers.
    pub bodies: Vec<&'a str>,
    pub fluid: &'a str,
    /// The end of the run, s.
    pub until: f64,
}

impl<'a> Lowering<'a> {
    pub(super) fn probes(&mut self, scene: &Block<'a>, around: &Surroundings<'_>) -> Vec<SceneProbe> {
        let mut probes: Vec<SceneProbe> = Vec::new();
        for (label, entries, span) in scene.blocks("probe") {
            let Some(label) = label else {
                self.report(
                    Diagnostic::error(Code::SCENE_MISSING, span, "a probe needs a name: that of its file")
                        .help("write `probe gauge { height: [1, 0.5] }`"),
                );
                continue;
            };
            if let Some(first) = probes.iter().find(|probe| probe.name == label.text) {
                let message = format!("two probes are named `{}`", label.text);
                self.report(
                    Diagnostic::error(Code::SCENE_REPEATED, label.span, message)
                        .label(first.span, "the first"),
                );
            }
            let block = self.block(entries, "a probe", span, keys::ALL, &[]);
            let every = self.stated_number(&block, &keys::EVERY);
            if let (Some(Some(every)), Some((_, value))) = (every, block.setting(keys::EVERY.name))
                && every > around.until
            {
                let [until, every] = times_as_written([around.until, every]);
                let message =
                    format!("a sample every {every} in a run of {until}: only its start is measured");
                let help = "without this key there is a sample with every frame";
                self.report(Diagnostic::warning(Code::FRAMES, value.span, message).help(help));
            }
            let Some(measured) = self.measured(&block, around) else { continue };
            if let (Some(every), Some(mean)) = (every, self.mean(&block, measured, around.until)) {
                probes.push(SceneProbe { name: label.text.clone(), span: label.span, measured, every, mean });
            }
        }
        probes
    }

    /// Reads `from` and `known`, which ask for a mean; the outer `None` is a mistake that was reported.
    fn mean(&mut self, block: &Block<'_>, measured: Probe, until: f64) -> Option<Option<AskedMean>> {
        let start = block.setting(keys::FROM.name).map(|(_, value)| value.span);
        let known = block.setting(keys::KNOWN.name);
        if start.is_none() && known.is_none() {
            return Some(None);
        }
        let from = self.stated_number(block, &keys::FROM).map(|from| from.unwrap_or(0.0));
        let known = match known {
            Some((_, value)) => self.known(block, value, measured),
            None => Some(Vec::new()),
        };
        if let (Some(from), Some(span)) = (from, start)
            && from >= until
        {
            let message = format!("the mean begins at {from} s, and the run ends at {until} s");
            self.report(
                Diagnostic::error(Code::OUT_OF_RANGE, span, message)
                    .help("state an earlier `from`, or a later `until` in the block `run`"),
            );
            return None;
        }
        let torque = block.setting("about").is_some();
        Some(Some(AskedMean { from: from?, known: known?, torque }))
    }

    /// Reads what is known of a mean: a number, or a vector where a probe measures one.
    fn known(&mut self, block: &Block<'_>, value: &Expr, measured: Probe) -> Option<Vec<f64>> {
        let mut number = |dimension| self.quantity_expr(value, dimension, "known").map(|known| vec![known]);
        match measured {
            Probe::Height { .. } => number(Dimension::LENGTH),
            Probe::Pressure { .. } => number(Dimension::PRESSURE),
            Probe::Flux { .. } => number(Dimension::MASS_FLOW),
            Probe::Velocity { .. } | Probe::Force { .. } => {
                let is_force = matches!(measured, Probe::Force { .. });
                let dimension = if is_force { Dimension::FORCE } else { Dimension::SPEED };
                let known = self.vector_in(block, keys::KNOWN.name, dimension)??;
                Some(known.to_array().into())
            }
            Probe::Energy | Probe::Audit => {
                let message = "`known` has no meaning for the energy and the audit";
                self.report(
                    Diagnostic::error(Code::SCENE_KEY, value.span, message)
                        .help("their means are told with `from` alone"),
                );
                None
            }
        }
    }

    fn measured(&mut self, block: &Block<'_>, around: &Surroundings<'_>) -> Option<Probe> {
        let mut stated =
            block.entries.iter().map(Entry::key).filter(|key| MEASURED.contains(&key.text.as_str()));
        let Some(key) = stated.next() else {
            if block.entries.iter().any(|entry| !names(keys::ALL).any(|key| key == entry.key().text)) {
                return None; // the misspelt key, which was reported, may be the one that is missing
            }
            let message = format!("a probe needs one of {}", MEASURED.join(", "));
            self.report(
                Diagnostic::error(Code::SCENE_MISSING, block.span, message)
                    .help("write `height: [1, 0.5]` or `pressure: [0, 0.5, 0.1]`"),
            );
            return None;
        };
        if let Some(second) = stated.find(|second| second.text != key.text) {
            self.report(
                Diagnostic::error(Code::SCENE_REPEATED, second.span, "a probe measures one thing")
                    .label(key.span, "this one already")
                    .help("write a second probe"),
            );
        }
        if let Some((about, _)) = block.setting("about").filter(|_| key.text != "force") {
            let message = format!("`about` has no meaning for `{}`", key.text);
            self.report(
                Diagnostic::error(Code::SCENE_KEY, about.span, message)
                    .help("it is the point about which the torque of a `force` is taken"),
            );
        }
        let domain = &around.domain;
        if key.text == "flux" {
            return self.flux(block, domain);
        }
        let (_, value) = block.setting(&key.text)?; // a block in place of the value was reported
        match key.text.as_str() {
            "height" => self.place_on_ground(value, domain).map(|[x, y]| Probe::Height { x, y }),
            "pressure" => self.place(block, &keys::PRESSURE, domain).map(|at| Probe::Pressure { at }),
            "velocity" => self.place(block, &keys::VELOCITY, domain).map(|at| Probe::Velocity { at }),
            "force" => {
                let body = self.one_of(value, "force", &around.bodies, "obstacle of this scene");
                let about = self.vector_key(block, &keys::ABOUT);
                Some(Probe::Force { obstacle: body?, about: about? })
            }
            "energy" => self.of_fluid(value, "energy", around).map(|()| Probe::Energy),
            "audit" => self.of_fluid(value, "audit", around).map(|()| Probe::Audit),
            // a flux is a block, and was read
            _ => None,
        }
    }

    /// Checks the name of the fluid that a probe measures.
    fn of_fluid(&mut self, value: &Expr, key: &str, around: &Surroundings<'_>) -> Option<()> {
        self.one_of(value, key, &[around.fluid], "fluid of this scene").map(|_| ())
    }

    fn flux(&mut self, block: &Block<'_>, domain: &Aabb) -> Option<Probe> {
        let (_, entries, span) = block.blocks("flux").next()?;
        let block = self.block(entries, "a flux", span, flux_keys::ALL, &[]);
        for (key, help) in [("point", "write `point: [1, 0, 0]`"), ("normal", "write `normal: [1, 0, 0]`")] {
            if block.setting(key).is_none() {
                self.missing(&block, key, help);
                return None;
            }
        }
        let point = self.place(&block, &flux_keys::POINT, domain);
        let normal = self.vector_key(&block, &flux_keys::NORMAL)?;
        let Some(unit) = normal.try_normalize() else {
            let at = block.setting("normal").map_or(span, |(_, value)| value.span);
            let message = format!("`normal` must have a length, found {normal}");
            self.report(Diagnostic::error(Code::OUT_OF_RANGE, at, message));
            return None;
        };
        Some(Probe::Flux { point: point?, normal: unit })
    }

    /// Reads a place, which must lie in the box.
    fn place(&mut self, block: &Block<'_>, key: &SceneKey, domain: &Aabb) -> Option<DVec3> {
        let at = self.vector_in(block, key.name, Dimension::LENGTH)??;
        let (_, value) = block.setting(key.name)?;
        self.within(domain.contains(at), value, format!("{at}"), domain).then_some(at)
    }

    /// Reads a place `[x, y]`, seen from above, which must lie in the box.
    fn place_on_ground(&mut self, value: &Expr, domain: &Aabb) -> Option<[f64; 2]> {
        let ExprKind::Vector(parts) = &value.kind else {
            return self.no_pair(value);
        };
        let [x, y] = &parts[..] else { return self.no_pair(value) };
        let [x, y] = [x, y].map(|part| self.quantity_expr(part, Dimension::LENGTH, "height"));
        let (x, y) = (x?, y?);
        let inside = domain.contains(DVec3::new(x, y, domain.min.z));
        let found = format!("[x, y] = [{x}, {y}], as heights are measured along z");
        self.within(inside, value, found, domain).then_some([x, y])
    }

    fn no_pair(&mut self, value: &Expr) -> Option<[f64; 2]> {
        self.report(
            Diagnostic::error(Code::WRONG_TYPE, value.span, "`height` is measured at a place `[x, y]`")
                .help("write `height: [1, 0.5]`"),
        );
        None
    }

    fn within(&mut self, inside: bool, value: &Expr, found: String, domain: &Aabb) -> bool {
        if !inside {
            let message = format!("the probe lies outside the box: {found}");
            self.report(
                Diagnostic::error(Code::OUT_OF_RANGE, value.span, message)
                    .help(format!("the box goes from {} to {}", domain.min, domain.max)),
            );
        }
        inside
    }

    /// Reads a name, and returns its index among those that are known.
    pub(in crate::lower) fn one_of(
        &mut self,
        value: &Expr,
        key: &str,
        known: &[&str],
        what: &str,
    ) -> Option<usize> {
        let ExprKind::Name(name) = &value.kind else {
            let message = format!("`{key}` needs a name: that of the {what}");
            self.report(Diagnostic::error(Code::WRONG_TYPE, value.span, message));
            return None;
        };
        let found = known.iter().position(|other| other == name);
        if found.is_none() {
            let unnamed =
                |other: &&str| *other == "obstacle" && self.names.of(SourceId::File, other).is_none();
            let help = match known {
                [] => "it has none".to_string(),
                // the name of bodies whose solids are written in the scene
                known if known.iter().any(unnamed) => {
                    let of_file = self.names.of(SourceId::File, name).map(|global| &global.kind);
                    let named = match of_file {
                        Some(Kind::Solid(_)) => format!(", or `solid: {name}` in place of that shape"),
                        Some(_) => String::new(),
                        None => {
                            format!(
                                ", or define `solid {name} = …` above the scene and write `solid: {name}`"
                            )
                        }
                    };
                    format!(
                        "a shape that is written in the scene is called `obstacle`: write `{key}: obstacle`{named}"
                    )
                }
                known => {
                    let known: Vec<String> = known.iter().map(|other| format!("`{other}`")).collect();
                    format!("it has {}", known.join(", "))
                }
            };
            self.report(
                Diagnostic::error(Code::UNKNOWN_NAME, value.span, format!("`{name}` is no {what}"))
                    .help(help)
                    .suggest(name, known.iter().copied()),
            );
        }
        found
    }
}
