//! Keys of blocks: each must be known, stand once, and have the unit, range or word that it asks for.

use glam::DVec3;

use super::super::lowering::Lowering;
use super::super::names::Kind;
use super::super::value::Value;
use super::declaration::{KeyValue, SceneKey, names};
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::ir::Node;
use crate::quantity::{Bound, Dimension, parse_unit};
use crate::sph::{KeyBlock, Method};
use crate::syntax::ast::{Entry, Expr, ExprKind, Name};
use crate::syntax::{block_form, foreign};

/// What there is to say to a kinematic viscosity.
const DYNAMIC: &str =
    "`viscosity` is the dynamic one, that is the kinematic one times the density: water has `1e-3 Pa·s`";

/// What there is to say to a kernel by name.
const KERNEL: &str = "each method has its own kernel, which cannot be chosen; \
    how far it reaches is the `support_radius` of the fluid";

/// Keys that other programs have in a block and this one does not, each with what takes its place.
const ABSENT: [(&str, &[&str], &str); 11] = [
    ("a fluid", &["kernel"], KERNEL),
    ("a solver", &["kernel"], KERNEL),
    ("a scene", &["kernel"], KERNEL),
    (
        "a run",
        &["fps", "frame_rate", "framerate"],
        "the time between frames is stated: 25 in a second are `save_every: 0.04 s`",
    ),
    (
        "a run",
        &["steps", "max_steps", "n_steps", "nsteps", "num_steps", "iterations"],
        "a run ends at a time, `until: 1 s`; `rfm run FILE --steps 100` ends it after so many steps",
    ),
    ("a fluid", &["nu", "kinematic_viscosity"], DYNAMIC),
    (
        "an obstacle",
        &["velocity", "motion", "speed", "angular_velocity", "omega"],
        "a solid moves by the time t: `solid gate = box().move([0, 0, 0.1*t])`, or `.rotate_z(pi*t)`",
    ),
    (
        "an obstacle",
        &["density", "mass", "inertia"],
        "obstacles rest, or move as their formula says: they neither float nor fall",
    ),
    (
        "a scene",
        &["inlet", "outlet", "inflow", "outflow", "source", "sink", "emitter", "periodic", "boundary"],
        NO_OPENINGS,
    ),
    ("a box", &["periodic", "boundary", "boundaries", "open", "periodicity"], NO_OPENINGS),
    (
        "a fluid",
        &["color", "colour", "material", "name"],
        "pictures colour particles by their speed; `rfm render` and `rfm view` choose otherwise",
    ),
];

/// What is said of walls that fluid passes.
const NO_OPENINGS: &str =
    "there are no inlets, outlets and periodic boxes: begin with the fluid that is needed";

/// Keys of the scene that are often written in one of its blocks.
const OUTER: [&str; 3] = ["walls", "gravity", "method"];

/// The entries of a block. Unknown and repeated keys have been reported.
pub(in crate::lower) struct Block<'a> {
    pub entries: &'a [Entry],
    /// The name that follows the key, as in `fluid water { … }`.
    pub label: Option<&'a Name>,
    what: &'static str,
    pub span: Span,
}

/// The blocks one level further in that have a key, in the order in which they are declared.
fn blocks_with(key: &str, declared: &[SceneKey]) -> Vec<&'static str> {
    let of_methods = |block: &str| {
        let block = [KeyBlock::Fluid, KeyBlock::Solver].into_iter().find(|known| known.name() == block);
        block.is_some_and(|block| !Method::with_key(block, key).is_empty())
    };
    let has_key = |block: &&SceneKey| {
        let own = block.block();
        own.is_some_and(|keys| names(keys).any(|name| name == key) || of_methods(block.name))
    };
    declared.iter().filter(has_key).map(|block| block.name).collect()
}

/// What there is to say to `size` in a box: `max` is the corner that lies that far from `min`.
fn size_of_box(diagnostic: Diagnostic, entries: &[Entry], size: &Entry) -> Diagnostic {
    let vector = |entry: &Entry| match entry {
        Entry::Setting { value, .. } => plain_vector(value),
        Entry::Block { .. } => None,
    };
    let min = entries.iter().find(|entry| entry.key().text == "min");
    let written = |[x, y, z]: [f64; 3]| format!("max: [{x}, {y}, {z}]");
    match (min.map(vector), vector(size)) {
        (None, Some(size)) => diagnostic.help(format!(
            "a box begins at `min`, which is [0, 0, 0] unless stated, and ends at `max`: write `{}`",
            written(size)
        )),
        (Some(Some(min)), Some(size)) => {
            // sums of decimals without the digits that their binary forms add
            let sum = |k: usize| format!("{:.12}", min[k] + size[k]).parse().unwrap_or(min[k] + size[k]);
            diagnostic.help(format!(
                "a box ends at `max`, which is `min` plus the size: write `{}`",
                written(std::array::from_fn(sum))
            ))
        }
        _ => diagnostic.help("a box ends at `max`, which is `min` plus the size"),
    }
}

/// A vector of three numbers without units.
fn plain_vector(value: &Expr) -> Option<[f64; 3]> {
    let number = |part: &Expr| match &part.kind {
        ExprKind::Number(number) => Some(*number),
        ExprKind::Negate(inner) => match inner.kind {
            ExprKind::Number(number) => Some(-number),
            _ => None,
        },
        _ => None,
    };
    match &value.kind {
        ExprKind::Vector(parts) => parts.iter().map(number).collect::<Option<Vec<f64>>>()?.try_into().ok(),
        _ => None,
    }
}

/// Where a key belongs: to the first of some blocks, all of which are listed, and perhaps to other methods alone.
fn key_of_blocks(key: &str, (block, all): (&str, &str), methods: &[&str]) -> String {
    // a probe must have a name
    let label = if block == "probe" { " gauge" } else { "" };
    let form = format!("`{block}{label} {{ {key}: … }}`");
    match methods {
        [] => format!("it is a key of {all}: write {form}"),
        [method, ..] => {
            let has = if methods.len() == 1 { "has" } else { "have" };
            format!(
                "{} {has} it as a key of {all}: leave it out, or write `method: {method}` and {form}",
                methods.join(" and ")
            )
        }
    }
}

/// The methods of a key, if it belongs to some methods alone and not to that of these entries of a scene.
fn of_other_methods(key: &str, entries: &[Entry], declared: &[SceneKey]) -> Vec<&'static str> {
    let has_key = |block: &SceneKey| block.block().is_some_and(|keys| names(keys).any(|name| name == key));
    let methods = [KeyBlock::Fluid, KeyBlock::Solver].map(|block| Method::with_key(block, key)).concat();
    let stated = entries.iter().find_map(|entry| match entry {
        Entry::Setting { key, value } if key.text == "method" => match &value.kind {
            ExprKind::Name(word) => Some(word.as_str()),
            _ => None,
        },
        Entry::Setting { .. } | Entry::Block { .. } => None,
    });
    let own = stated.unwrap_or(Method::default().name());
    if methods.contains(&own) || declared.iter().any(has_key) { Vec::new() } else { methods }
}

/// The key that a word of other programs, or of another block, stands for in a block.
fn own_key(block: &str, word: &str) -> Option<&'static str> {
    match (block, word) {
        // an obstacle has a solid, a fluid a shape
        ("a fluid", "solid") => Some("shape"),
        _ => foreign::key(word),
    }
}

/// Names in a sentence: `a`, `b` and `c`.
fn listed(names: &[&str]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    match &quoted[..] {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

impl<'a> Lowering<'a> {
    /// Number of errors so far.
    pub(super) fn errors(&self) -> usize {
        self.diagnostics.iter().filter(|d| d.severity == crate::diagnostic::Severity::Error).count()
    }

    /// Reports that a block lacks a key that it needs.
    pub(in crate::lower) fn missing(&mut self, block: &Block<'_>, key: &str, help: &str) {
        // in the wrong form, or by another name, which was reported
        let is_it = |text: &str| text == key || own_key(block.what, text) == Some(key);
        if block.entries.iter().any(|entry| is_it(&entry.key().text)) {
            return;
        }
        let message = format!("{} needs `{key}`", block.what);
        self.report(Diagnostic::error(Code::SCENE_MISSING, block.span, message).help(help));
    }

    /// How a block is written whose key was given a value.
    fn block_form(&self, key: &str, value: &Expr) -> String {
        let is_shape = |kind: &Kind<'_>| match kind {
            Kind::Solid(_) => true,
            Kind::Value(Value::Number(node)) => self.known_value(*node).is_none(),
            Kind::Value(_) | Kind::Function(_) | Kind::Scene | Kind::Import(_) => false,
        };
        let is_name_of_shape = match &value.kind {
            ExprKind::Name(name) => {
                self.names.of(value.span.source, name).is_some_and(|global| is_shape(&global.kind))
            }
            _ => false,
        };
        if key == "solver"
            && let ExprKind::Name(name) = &value.kind
            && let Some(method) = Method::named(name)
        {
            return format!("method: {}", method.name());
        }
        block_form(key, self.written(value).unwrap_or("…"), is_name_of_shape)
            .unwrap_or_else(|| format!("{key} {{ … }}"))
    }

    /// Makes a [`Block`], and reports unknown keys and known ones that stand twice without being
    /// `repeatable`.
    pub(in crate::lower) fn block<'b>(
        &mut self,
        entries: &'b [Entry],
        what: &'static str,
        span: Span,
        keys: &[SceneKey],
        repeatable: &[&str],
    ) -> Block<'b> {
        let known: Vec<&'static str> = names(keys).collect();
        self.block_with(entries, what, span, (keys, &known), repeatable)
    }

    /// [`Lowering::block`] with names that are known besides those of the declared keys.
    pub(super) fn block_with<'b>(
        &mut self,
        entries: &'b [Entry],
        what: &'static str,
        span: Span,
        (declared, known): (&[SceneKey], &[&'static str]),
        repeatable: &[&str],
    ) -> Block<'b> {
        let opens_block =
            |key: &str| declared.iter().any(|known| known.name == key && known.block().is_some());
        for (i, entry) in entries.iter().enumerate() {
            let key = entry.key();
            if !known.contains(&key.text.as_str()) {
                let message = format!("{what} has no key `{}`", key.text);
                let diagnostic = Diagnostic::error(Code::SCENE_KEY, key.span, message)
                    .help(format!("its keys are {}", known.join(", ")))
                    .suggest(&key.text, known.iter().copied());
                let own = own_key(what, &key.text);
                // a word of other programs may be a key of a block here
                let literal = blocks_with(&key.text, declared);
                let own = own.filter(|_| literal.is_empty());
                let elsewhere = own.filter(|own| known.contains(own));
                let inner_key = own.unwrap_or(key.text.as_str());
                let inner = own.map_or(literal, |own| blocks_with(own, declared));
                let absent = ABSENT
                    .iter()
                    .find(|(block, keys, _)| *block == what && keys.contains(&key.text.as_str()));
                let is_outer = OUTER.contains(&key.text.as_str());
                self.report(match (elsewhere, &inner[..]) {
                    (Some("max"), _) if key.text == "size" && what == "a box" => {
                        size_of_box(diagnostic, entries, entry)
                    }
                    (Some(own), _) => diagnostic
                        .help(format!("`{}` is called `{own}` here", key.text))
                        .edit(key.span, &key.text, own, false),
                    (None, [block, ..]) => diagnostic.help(key_of_blocks(
                        inner_key,
                        (block, &listed(&inner)),
                        &of_other_methods(inner_key, entries, declared),
                    )),
                    (None, []) if is_outer => diagnostic.help(format!(
                        "it is a key of the scene: write `{}: …` outside of this block",
                        key.text
                    )),
                    (None, []) => match absent {
                        Some((.., help)) => diagnostic.help(*help),
                        None => diagnostic,
                    },
                });
            } else if matches!(entry, Entry::Block { .. }) != opens_block(&key.text) {
                let (is, form) = match entry {
                    Entry::Block { .. } => ("has a value", format!("{}: …", key.text)),
                    Entry::Setting { value, .. } => ("is a block", self.block_form(&key.text, value)),
                };
                let message = format!("`{}` {is}", key.text);
                self.report(
                    Diagnostic::error(Code::SCENE_KEY, key.span, message).help(format!("write `{form}`")),
                );
            } else if let Some(first) = entries[..i].iter().find(|e| e.key().text == key.text)
                && !repeatable.contains(&key.text.as_str())
            {
                let message = format!("`{}` stands twice", key.text);
                self.report(
                    Diagnostic::error(Code::SCENE_REPEATED, key.span, message)
                        .label(first.key().span, "first stated here"),
                );
            }
        }
        Block { entries, label: None, what, span }
    }

    /// Reads the components of a vector, each a formula or a quantity.
    pub(super) fn components(&mut self, value: &Expr, key: &SceneKey) -> Option<[Node; 3]> {
        let (dimension, key) = (key.dimension(), key.name);
        let parts = match &value.kind {
            ExprKind::Vector(parts) if parts.len() == 3 => parts,
            _ => {
                let found = self.expr(value);
                self.no_scalar(&found, value, key)?;
                return self.as_vector(&found, value.span);
            }
        };
        let mut nodes = Vec::new();
        for part in parts {
            let is_quantity = match &part.kind {
                ExprKind::Quantity { .. } => true,
                ExprKind::Negate(inner) => matches!(inner.kind, ExprKind::Quantity { .. }),
                _ => false,
            };
            nodes.push(if is_quantity {
                let number = self.quantity_expr(part, dimension, key)?;
                self.module.graph.constant(number)
            } else {
                let value = self.expr(part);
                self.as_number(&value, part.span)?
            });
        }
        nodes.try_into().ok()
    }

    /// Reports a number where a vector is asked for.
    fn no_scalar(&mut self, found: &Value, value: &Expr, key: &str) -> Option<()> {
        let Value::Number(_) = found else { return Some(()) };
        let message = format!("`{key}` is a vector `[a, b, c]`, found a number");
        let diagnostic = Diagnostic::error(Code::WRONG_TYPE, value.span, message);
        let written = self.written(value).unwrap_or("1").to_string();
        // a number for gravity is how strong it is, and it points down
        let down = if key == "gravity" && !written.starts_with('-') { "-" } else { "" };
        let written = match key {
            "min" | "max" => format!("[{written}, {written}, {written}]"),
            // a direction may be said by its axis
            "normal" => match written.as_str() {
                "x" => "[1, 0, 0]".into(),
                "y" => "[0, 1, 0]".into(),
                "z" => "[0, 0, 1]".into(),
                "-x" => "[-1, 0, 0]".into(),
                "-y" => "[0, -1, 0]".into(),
                "-z" => "[0, 0, -1]".into(),
                _ => format!("[0, 0, {written}]"),
            },
            _ => format!("[0, 0, {down}{written}]"),
        };
        self.report(diagnostic.help(format!("write `{key}: {written}`")));
        None
    }

    /// Reads one of the words of a key, which have these meanings; `None` if the word is unknown, which is
    /// reported.
    pub(super) fn word_key<T: Copy>(
        &mut self,
        block: &Block<'_>,
        key: &SceneKey,
        meanings: &[T],
        default: T,
    ) -> Option<T> {
        match self.one_word(block, key.name, key.words())? {
            Some(index) => meanings.get(index).copied(),
            None => Some(default),
        }
    }

    /// Reads one of a few words, and returns its index. The outer option is `None` if the word is unknown,
    /// which is reported; the inner one if the key is absent.
    pub(super) fn one_word(&mut self, block: &Block<'_>, key: &str, words: &[&str]) -> Option<Option<usize>> {
        let Some((_, value)) = block.setting(key) else { return Some(None) };
        let found = match &value.kind {
            ExprKind::Name(word) | ExprKind::Text(word) => word.as_str(),
            _ => "",
        };
        let index = words.iter().position(|word| *word == found);
        if index.is_none() {
            let diagnostic =
                Diagnostic::error(Code::SCENE_KEY, value.span, format!("unknown value of `{key}`"));
            self.report(match foreign::value(key, found) {
                Some((ours, why)) => diagnostic.help(format!("write `{key}: {ours}`, {why}")),
                None => diagnostic
                    .help(format!("this version knows {}", words.join(", ")))
                    .suggest(found, words.iter().copied()),
            });
        }
        index.map(Some)
    }

    /// Reads a number of a key that must be present or has a number without it; `None` if the number is
    /// absent, or wrong, which is reported.
    pub(in crate::lower) fn number_key(&mut self, block: &Block<'_>, key: &SceneKey) -> Option<f64> {
        self.stated_number(block, key)?.or(key.number_without())
    }

    /// Reads a number, and checks its unit and bound. The outer option is `None` if it is wrong, which is
    /// reported; the inner one if the key is absent.
    pub(in crate::lower) fn stated_number(
        &mut self,
        block: &Block<'_>,
        key: &SceneKey,
    ) -> Option<Option<f64>> {
        self.number_in(block, key.name, key.dimension(), key.bound()?)
    }

    /// [`Lowering::stated_number`] of a key that is declared elsewhere.
    pub(super) fn number_in(
        &mut self,
        block: &Block<'_>,
        key: &str,
        dimension: Dimension,
        bound: Bound,
    ) -> Option<Option<f64>> {
        let Some((_, value)) = block.setting(key) else { return Some(None) };
        let number = self.quantity_expr(value, dimension, key)?;
        if bound.admits(number) {
            return Some(Some(number));
        }
        let message = format!("`{key}` {}, found {number}", bound.demand());
        self.report(Diagnostic::error(Code::OUT_OF_RANGE, value.span, message));
        None
    }

    /// Reads a vector of a key that must be present or has a vector without it; `None` if the vector is
    /// absent, or wrong, which is reported.
    pub(in crate::lower) fn vector_key(&mut self, block: &Block<'_>, key: &SceneKey) -> Option<DVec3> {
        self.stated_vector(block, key)?.or(key.vector_without())
    }

    /// Reads a vector of finite numbers with a unit. The outer option is `None` if it is wrong, which is
    /// reported; the inner one if the key is absent.
    pub(super) fn stated_vector(&mut self, block: &Block<'_>, key: &SceneKey) -> Option<Option<DVec3>> {
        self.vector_in(block, key.name, key.dimension())
    }

    /// [`Lowering::stated_vector`] of a key whose dimension depends on others.
    pub(in crate::lower) fn vector_in(
        &mut self,
        block: &Block<'_>,
        key: &str,
        dimension: Dimension,
    ) -> Option<Option<DVec3>> {
        let Some((_, value)) = block.setting(key) else { return Some(None) };
        let vector = if let ExprKind::Vector(parts) = &value.kind
            && let [a, b, c] = &parts[..]
        {
            let parts = [a, b, c].map(|part| self.quantity_expr(part, dimension, key));
            DVec3::new(parts[0]?, parts[1]?, parts[2]?)
        } else {
            let found = self.expr(value);
            self.no_scalar(&found, value, key)?;
            DVec3::from_array(self.constant_vector(&found, value.span, &format!("`{key}`"))?)
        };
        if vector.is_finite() {
            return Some(Some(vector));
        }
        let message = format!("`{key}` must be finite, found {vector}");
        self.report(Diagnostic::error(Code::OUT_OF_RANGE, value.span, message));
        None
    }

    /// Reads the whole number of a key. The outer option is `None` if the number is wrong, which is reported;
    /// the inner one if the key is absent and has no number without it.
    pub(super) fn count_key(&mut self, block: &Block<'_>, key: &SceneKey) -> Option<Option<usize>> {
        let KeyValue::Count(least) = key.value else { return None };
        let stated = self.count_in(block, key.name, least)?;
        Some(stated.or(key.number_without().map(|number| number as usize)))
    }

    /// Reads a whole number of at least `least`. The outer option is `None` if the number is wrong, which is
    /// reported; the inner one if the key is absent.
    pub(super) fn count_in(&mut self, block: &Block<'_>, key: &str, least: u32) -> Option<Option<usize>> {
        const MOST: f64 = 1e9;
        let Some((_, value)) = block.setting(key) else { return Some(None) };
        let number = self.quantity_expr(value, Dimension::NONE, key)?;
        if number.fract() == 0.0 && number >= f64::from(least) && number <= MOST {
            return Some(Some(number as usize));
        }
        let bound = if number > MOST { format!("at most {MOST}") } else { format!("at least {least}") };
        let message = format!("`{key}` must be a whole number of {bound}, found {number}");
        self.report(Diagnostic::error(Code::OUT_OF_RANGE, value.span, message));
        None
    }

    /// Reports a name that stands for a number with a unit of another kind.
    fn dimension_fits(&mut self, name: &str, expected: Dimension, key: &str, expr: &Expr) -> bool {
        let known = self.dimensions.get(&(self.scope.source, name.to_string()));
        // a plain number in a product may be a quantity: `2*stroke` may be two strokes a second
        let stated = known.filter(|known| !known.is_derived).map(|known| known.dimension);
        let Some(found) = stated.filter(|found| *found != expected) else { return true };
        let [found, expected] = [found.unit(), expected.unit()];
        let message = match found {
            Some(found) => format!("`{name}` is in {found}, which does not fit `{key}`"),
            None => format!("the unit of `{name}` does not fit `{key}`"),
        };
        let diagnostic = Diagnostic::error(Code::UNIT_MISMATCH, expr.span, message);
        self.report(match expected {
            Some(unit) => diagnostic.help(format!("`{key}` is in {unit}")),
            None => diagnostic.help(format!("`{key}` has no unit")),
        });
        false
    }

    /// Evaluates a constant in SI units. A unit, where one is written, must fit.
    pub(in crate::lower) fn quantity_expr(
        &mut self,
        expr: &Expr,
        expected: Dimension,
        key: &str,
    ) -> Option<f64> {
        match &expr.kind {
            ExprKind::Quantity { value, unit } => {
                let parsed = parse_unit(&unit.text)?; // the grammar admits known units only
                if parsed.dimension != expected {
                    let message = format!("`{}` is not a unit of `{key}`", unit.text);
                    let help = match expected.unit() {
                        Some(_)
                            if key == "viscosity"
                                && parse_unit("m^2/s")
                                    .is_some_and(|kinematic| kinematic.dimension == parsed.dimension) =>
                        {
                            DYNAMIC.into()
                        }
                        // a unit with a part missing, as `m/s` for an acceleration
                        Some(whole) if whole.starts_with(&unit.text) => {
                            let before = self.text.get(..expr.span.range().start).unwrap_or_default();
                            let sign = if before.ends_with('-') { "-" } else { "" };
                            format!("write `{sign}{value} {whole}`")
                        }
                        Some(unit) => format!("write for example `1 {unit}`"),
                        None => format!("`{key}` has no unit"),
                    };
                    let diagnostic = Diagnostic::error(Code::UNIT_MISMATCH, unit.span, message);
                    let is_whole =
                        (parsed.dimension, expected) == (Dimension::ENERGY, Dimension::SPECIFIC_ENERGY);
                    self.report(if is_whole {
                        let per_mass = format!("{}/kg", unit.text);
                        diagnostic
                            .help(format!("`{key}` is per kilogram: write `{per_mass}`"))
                            .edit(unit.span, &unit.text, per_mass, false)
                    } else {
                        diagnostic.help(help)
                    });
                    return None;
                }
                self.may_be_number(*value, expr).then_some(value * parsed.factor)
            }
            ExprKind::Name(name) if !self.dimension_fits(name, expected, key, expr) => None,
            ExprKind::Negate(inner) => self.quantity_expr(inner, expected, key).map(|v| -v),
            _ => {
                let value = self.expr(expr);
                if let Value::Text(_) | Value::Vector(_) | Value::List(_) = value {
                    self.as_number(&value, expr.span);
                    return None;
                }
                let node = self.as_number(&value, expr.span)?;
                self.as_constant(node, expr.span, &format!("`{key}`"))
            }
        }
    }
}

impl<'a> Block<'a> {
    /// The key and the value of a setting; `None` if the block does not state it.
    pub(in crate::lower) fn setting(&self, key: &str) -> Option<(&'a Name, &'a Expr)> {
        self.entries.iter().find_map(|entry| match entry {
            Entry::Setting { key: name, value } if name.text == key => Some((name, value)),
            _ => None,
        })
    }

    /// The inner blocks with a key, each with its label, entries and place.
    pub(in crate::lower) fn blocks(
        &self,
        key: &'static str,
    ) -> impl Iterator<Item = (Option<&'a Name>, &'a [Entry], Span)> + use<'a> {
        self.entries.iter().filter_map(move |entry| match entry {
            Entry::Block { key: name, label, entries, .. } if name.text == key => {
                Some((label.as_ref(), &entries[..], name.span))
            }
            _ => None,
        })
    }
}
