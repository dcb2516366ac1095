//! Lowering: the syntax tree becomes one graph with named roots, and scenes. Names are looked up, functions
//! unrolled, ranges checked.
//!
//! Items are read in order, and a name means what was defined above it. Errors are collected. An item that
//! failed counts as defined further down, so that one mistake gives one message.
//!
//! Invariant: the graph is built as the text is written. No formula is rearranged here.

mod arguments;
mod bare_ranges;
mod bends;
mod builtins;
mod choice;
mod columns;
mod curves;
mod dimensions;
mod distances;
mod eval;
mod foreign;
mod imports;
mod joints;
mod letters;
mod lists;
mod lowering;
mod maps;
mod module;
mod names;
mod needed;
mod offsets;
mod options;
mod outline;
mod paths;
mod probes;
mod rounding;
mod scene;
mod sizes;
mod slips;
mod transforms;
mod tubes;
mod unused;
mod value;
pub mod vocabulary;

use std::sync::OnceLock;

pub use foreign::known_elsewhere;
pub use imports::{Imported, unread};
pub use module::{Module, NamedSolid, OpenParams, ParamValue, VaryingSize};
pub use options::{Options, SetBy};
pub use scene::{
    AskedMean, Bounce, Container, Fluid, Gravity, Obstacle, Opening, Picture, Run, Scene, SceneProbe, Skin,
    Solver, Tolerance, Truth,
};

use crate::diagnostic::{Code, Diagnostic, Severity, Source, SourceId, Span};
use crate::ir::Expr as Operation;
use crate::quantity::{Unit, in_unit, parse_unit};
use crate::syntax::Ast;
use crate::syntax::ast::{Argument, Attribute, Definition, Expr, ExprKind, Function, Item, Name, Param};
use bare_ranges::BareRange;
use lowering::{KnownDimension, Lowering};
use names::{Kind, RESERVED, TIME};
use value::Value;

/// Most operations to which a short file may unroll by default.
pub const MAX_NODES: usize = 1_000_000;

/// Operations for each byte of a long file by default. Lines of standard solids that are turned and moved
/// make one for two bytes, calls of functions make more, and only ranges make very many.
pub const NODES_PER_BYTE: usize = 4;

/// The source of the standard solids.
pub fn prelude_source() -> Source {
    Source {
        id: SourceId::Prelude,
        name: "<standard solids>".into(),
        text: include_str!("prelude.rfm").into(),
    }
}

fn prelude() -> &'static Ast {
    static PRELUDE: OnceLock<Ast> = OnceLock::new();
    PRELUDE.get_or_init(|| {
        let (ast, diagnostics) = crate::syntax::parse(&prelude_source());
        debug_assert!(diagnostics.is_empty(), "{diagnostics:?}");
        ast
    })
}

/// Stack of the lowering thread, bytes. It is enough for the deepest evaluation in debug builds, whatever
/// stack the caller has.
const STACK_BYTES: usize = 64 << 20;

/// Lowers a file of this name with the files that it imports, each of them after those that it imports itself. The
/// messages say which items failed; the module holds the others.
pub fn lower(
    (name, ast): (&str, &Ast),
    imported: &[Imported],
    options: &Options,
) -> (Module, Vec<Diagnostic>) {
    std::thread::scope(|scope| {
        let spawned = std::thread::Builder::new()
            .name("rfm-lower".into())
            .stack_size(STACK_BYTES)
            .spawn_scoped(scope, || lower_here((name, ast), imported, options));
        match spawned.map(std::thread::ScopedJoinHandle::join) {
            Ok(Ok(lowered)) => lowered,
            Ok(Err(panic)) => std::panic::resume_unwind(panic),
            Err(_) => lower_here((name, ast), imported, options), // no thread could be started
        }
    })
}

fn lower_here(
    (name, ast): (&str, &Ast),
    imported: &[Imported],
    options: &Options,
) -> (Module, Vec<Diagnostic>) {
    let bytes = ast.text.len() + imported.iter().map(|file| file.source.text.len()).sum::<usize>();
    let max_nodes = options.max_nodes.unwrap_or_else(|| MAX_NODES.max(NODES_PER_BYTE * bytes));
    let mut lowering = Lowering::new(ast.text.clone(), max_nodes);
    lowering.method = options.method;
    lowering.set_by = options.set_by;
    lowering.has_open_params = options.open.is_some();
    for item in &prelude().items {
        lowering.item(item, options);
    }
    lowering.file_name = name.into();
    lowering.files = options.files.clone();
    let needed = options.open.as_ref().and_then(|open| needed::names((ast, imported), open.solids.as_ref()?));
    let is_needed = |item: &&Item| needed.as_ref().is_none_or(|needed| needed.contains(&item.name().text));
    for file in imported {
        lowering.imported_file(file, options, is_needed);
    }
    lowering.scope.source = SourceId::File;
    lowering.announce(ast);
    for item in ast.items.iter().filter(is_needed) {
        lowering.item(item, options);
    }
    if !lowering.diagnostics.iter().any(|d| d.severity == Severity::Error) {
        lowering.unused(); // an item that failed may contain the use
        ast.items.iter().for_each(|item| lowering.unused_locals(item));
    }
    lowering.unknown_overrides((ast, imported), options);
    (lowering.module, lowering.diagnostics)
}

impl<'a> Lowering<'a> {
    /// Makes the names of a file known, before any of them is defined.
    fn announce(&mut self, ast: &'a Ast) {
        self.names.announce(ast.items.iter().map(Item::name));
        let values = ast.items.iter().filter(|item| matches!(item, Item::Param(_) | Item::Let(_)));
        if values.map(Item::name).any(|name| name.text == TIME) {
            self.without_time.insert(self.scope.source);
        }
    }

    /// Reads the items of an imported file. Its scenes are its own, and so are its solids: they have names there alone.
    fn imported_file(&mut self, file: &'a Imported, options: &Options, is_needed: impl Fn(&&Item) -> bool) {
        self.scope.source = file.source.id;
        self.qualifier = format!("{}.", file.qualified);
        self.announce(&file.ast);
        self.imported.push((file.source.name.clone(), file.source.id));
        let solids = self.module.solids.len();
        for item in file.ast.items.iter().filter(|item| !matches!(item, Item::Scene(_)) && is_needed(item)) {
            self.item(item, options);
        }
        self.module.solids.truncate(solids);
        self.qualifier.clear();
        self.bare.clear();
    }

    fn item(&mut self, item: &'a Item, options: &Options) {
        match item {
            Item::Import(import) => self.import(import),
            Item::Param(param) => self.param(param, options),
            Item::Let(definition) => self.definition(definition),
            Item::Function(function) => {
                if self.may_define(&function.name) && self.may_take(function) {
                    self.warn_of_replaced(&function.name);
                    self.names.define(self.scope.source, &function.name, Kind::Function(function));
                }
            }
            Item::Solid(definition) => self.solid(definition),
            Item::Scene(_) if options.open.is_some() => {}
            Item::Scene(scene) => {
                let named = self.may_define(&scene.name);
                if named {
                    self.names.define(self.scope.source, &scene.name, Kind::Scene);
                }
                self.in_scene = true;
                let scene = self.scene(scene);
                self.in_scene = false;
                if let Some(scene) = scene
                    && named
                {
                    self.module.scenes.push(scene);
                }
            }
        }
    }

    fn param(&mut self, param: &'a Param, options: &Options) {
        if !self.may_be_value(&param.name) {
            return;
        }
        // a param that is defined by another one has a value of its own, and so do ranges: they fix nothing
        let fixed = self.module.fixed.clone();
        let value = if self.is_one_number(param) {
            self.constant_expr(&param.value, "the value of a param")
        } else {
            None
        };
        let range = param.range.as_ref().map(|(low, high)| {
            (
                self.constant_expr(low, "the range of a param"),
                self.constant_expr(high, "the range of a param"),
            )
        });
        self.module.fixed = fixed;
        let has_one_kind = self.range_measures_the_same(param);
        let range = match range {
            Some((Some(low), Some(high))) if has_one_kind => Some((low, high)),
            Some(_) | None => None,
        };
        self.remember_units(&param.name, &param.value);
        let qualified = format!("{}{}", self.qualifier, param.name.text);
        let overridden = options.overrides.get(&qualified).copied();
        let stated = value;
        let Some(value) = overridden.or(stated) else {
            self.names.define(self.scope.source, &param.name, Kind::Value(Value::Failed));
            return;
        };
        let unit = unit_of(&param.value).map(|(unit, text)| (unit, text.to_string()));
        let given =
            ParamValue { name: qualified, value, range, unit, doc: param.doc.clone(), span: param.name.span };
        let bare = self.bare_range(param, &given, stated);
        if let Some(bare) = &bare
            && (overridden.is_some() || bare.holds(value))
        {
            self.warn_of_bare_range(param, &given, bare);
        }
        let fits = (overridden.is_none() || self.override_fits((&given, stated), bare.as_ref(), options))
            && self.param_fits(param, &given, bare.as_ref(), overridden.map(|_| options));
        let is_open = options.open.as_ref().is_some_and(|open| !open.fixed.contains(&given.name));
        let value_now = match (fits, is_open) {
            (false, _) => Value::Failed,
            (true, false) => Value::Number(self.module.graph.constant(value)),
            (true, true) => {
                let number = self.module.params.len() as u32;
                Value::Number(self.module.graph.intern(Operation::Parameter(number), None))
            }
        };
        self.names.define(self.scope.source, &param.name, Kind::Value(value_now));
        self.module.params.push(given);
    }

    /// Remembers which names stand for a number with a unit, and which for one without.
    fn remember_units(&mut self, name: &Name, value: &Expr) {
        let stated = unit_of(value).map(|(unit, _)| unit.dimension);
        if let Some(dimension) = stated.or_else(|| self.derived_dimension(value)) {
            let known = KnownDimension { dimension, is_derived: stated.is_none() };
            if self.scope.source == SourceId::File {
                self.module.dimensions.insert(name.text.clone(), dimension);
            }
            self.dimensions.insert((self.scope.source, name.text.clone()), known);
        }
        if self.is_bare(value) {
            self.bare.insert(name.text.clone());
        }
    }

    /// Whether the unit of an override fits the one in which the file writes the param. If not, this is reported; a
    /// number without a unit is accepted with a warning.
    /// `stated` is the value in the file.
    fn override_fits(
        &mut self,
        (param, stated): (&ParamValue, Option<f64>),
        bare: Option<&BareRange>,
        options: &Options,
    ) -> bool {
        let Some((unit, text)) = &param.unit else { return true };
        let name = &param.name;
        let Some(dimension) = options.dimensions.get(name) else {
            // a range that holds the number in one of both units only shows which one is meant
            let may_be = param.range.is_none_or(|range| {
                let is_in = |(low, high): (f64, f64), value: f64| low <= value && value <= high;
                let in_unit = bare.map_or(range, BareRange::in_unit);
                is_in(range, param.value) && is_in(in_unit, param.value * unit.factor)
            });
            if unit.factor != 1.0 && param.value != 0.0 && may_be {
                let si = unit.dimension.unit().unwrap_or("in SI units");
                let message =
                    format!("`{name}` = {0} means {0} {si}, and the file writes it in {text}", param.value);
                let message = options.about_setting(name, message);
                self.report(
                    Diagnostic::warning(Code::BARE_OVERRIDE, param.span, message).at("declared here").help(
                        format!(
                            "write {}, or {} if that is meant",
                            options.written(name, &param.shown(param.value).to_string()),
                            options.written(name, &format!("{} {text}", param.value))
                        ),
                    ),
                );
            }
            return true;
        };
        if *dimension == unit.dimension {
            return true;
        }
        let message =
            format!("the unit that `{name}` is given in does not fit: the file writes it in {text}");
        let message = options.about_setting(name, message);
        self.report(
            Diagnostic::error(Code::OVERRIDE, param.span, message)
                .at("declared here")
                .help(options.setting(name, &in_unit(stated.unwrap_or(unit.factor), *unit, text))),
        );
        false
    }

    /// Whether a param is not written as a vector or a text. If it is, this is reported.
    fn is_one_number(&mut self, param: &Param) -> bool {
        let (found, help) = match &param.value.kind {
            ExprKind::Vector(_) => {
                let written = self.written(&param.value).unwrap_or("[0, 0, 1]");
                let name = &param.name.text;
                ("a vector", format!("write `let {name} = {written}`, or a param for each number of it"))
            }
            ExprKind::Text(_) => {
                ("a text", "a description stands last: `param r = 1 \"radius\"`".to_string())
            }
            _ => return true,
        };
        let message = format!("a param is one number, found {found}");
        self.report(Diagnostic::error(Code::WRONG_TYPE, param.value.span, message).help(help));
        false
    }

    /// Whether a param's value is a finite number within its range. If not, this is reported. `options` are given
    /// if they have set the value.
    fn param_fits(
        &mut self,
        param: &Param,
        given: &ParamValue,
        bare: Option<&BareRange>,
        options: Option<&Options>,
    ) -> bool {
        let (value, shown) = (given.value, given.shown(given.value));
        if let Some((low, high)) = given.range
            && low > high
            && let Some((first, last)) = &param.range
        {
            let [low, high] = [low, high].map(|end| given.shown(end));
            let message = format!("the range {low} .. {high} holds no number");
            // `1 .. 10 mm`: one end has the unit that both were to have
            let one_unit = match (unit_of(first), unit_of(last)) {
                (None, Some((_, unit))) => self.written(first).map(|first| (first, unit)),
                _ => None,
            };
            let help = match (one_unit, self.written(last)) {
                (Some((first, unit)), Some(last)) => {
                    let (name, value) = (&given.name, self.written(&param.value).unwrap_or("…"));
                    format!(
                        "each end has a unit of its own: write `param {name} = {value} in {first} {unit} .. {last}`"
                    )
                }
                _ => format!("write `{high} .. {low}`"),
            };
            let at = first.span.to(last.span);
            self.report(Diagnostic::error(Code::OUT_OF_RANGE, at, message).help(help));
        } else if let Some((low, high)) = given.range
            && !(low <= value && value <= high)
        {
            let [first, last] = [low, high].map(|end| given.shown(end));
            let diagnostic = if let Some(options) = options {
                let message =
                    format!("`{}` is set to {shown}, outside its range {first} .. {last}", given.name);
                let message = options.about_setting(&given.name, message);
                let diagnostic =
                    Diagnostic::error(Code::OVERRIDE, param.name.span, message).at("declared here");
                match given
                    .unit
                    .as_ref()
                    .filter(|(unit, _)| low <= value * unit.factor && value * unit.factor <= high)
                {
                    Some((_, unit)) => diagnostic.help(format!(
                        "numbers without a unit are in SI units: {}",
                        options.setting(&given.name, &format!("{value} {unit}"))
                    )),
                    None => diagnostic,
                }
            } else {
                let message =
                    format!("`{}` = {shown} lies outside its range {first} .. {last}", param.name.text);
                let diagnostic = Diagnostic::error(Code::OUT_OF_RANGE, param.value.span, message);
                match (bare, &param.range) {
                    (Some(bare), Some((from, to))) => {
                        diagnostic.label(from.span.to(to.span), "without a unit").help(&bare.help)
                    }
                    _ => diagnostic,
                }
            };
            self.report(diagnostic);
        } else if !value.is_finite() {
            let message = format!("`{}` is {value}, which is not a finite number", param.name.text);
            let (code, at, message) = match options {
                Some(options) => {
                    (Code::OVERRIDE, param.name.span, options.about_setting(&given.name, message))
                }
                None => (Code::OUT_OF_RANGE, param.value.span, message),
            };
            self.report(Diagnostic::error(code, at, message));
        } else {
            return true;
        }
        false
    }

    fn definition(&mut self, definition: &'a Definition) {
        self.in_let = true;
        let value = self.expr(&definition.value);
        self.in_let = false;
        if self.may_be_value(&definition.name) {
            self.remember_units(&definition.name, &definition.value);
            self.names.define(self.scope.source, &definition.name, Kind::Value(value));
        }
    }

    fn solid(&mut self, definition: &'a Definition) {
        let tolerance = self.attributes(&definition.attributes);
        let node = self.shape(&definition.value);
        if !self.may_define(&definition.name) {
            return;
        }
        let value = node.map_or(Value::Failed, Value::Number);
        self.names.define(self.scope.source, &definition.name, Kind::Solid(value));
        if let Some(node) = node {
            let name = definition.name.text.clone();
            self.warn_of_constant(&format!("solid `{name}`"), node, &definition.value);
            self.module.solids.push(NamedSolid { name, node, tolerance, span: definition.name.span });
        }
    }

    /// Reads the attributes of a solid. `@tolerance` is the only one.
    fn attributes(&mut self, attributes: &'a [Attribute]) -> Option<Tolerance> {
        const KNOWN: [&str; 1] = ["tolerance"];
        let mut tolerance = None;
        for (i, attribute) in attributes.iter().enumerate() {
            let name = &attribute.name;
            if !KNOWN.contains(&name.text.as_str()) {
                let message = format!("unknown attribute `@{}`", name.text);
                let diagnostic = Diagnostic::error(Code::ATTRIBUTE, name.span, message);
                self.report(
                    diagnostic
                        .help(format!("attributes are @{}", KNOWN.join(", @")))
                        .suggest(&name.text, KNOWN),
                );
            } else if let Some(first) = attributes[..i].iter().find(|a| a.name.text == name.text) {
                let message = format!("`@{}` stands twice", name.text);
                self.report(
                    Diagnostic::error(Code::ATTRIBUTE, name.span, message)
                        .label(first.name.span, "first stated here"),
                );
            } else if let [Argument { name: None, value }] = &attribute.arguments[..] {
                tolerance = self.tolerance(value);
            } else {
                let message = format!("`@{}` takes one number", name.text);
                self.report(
                    Diagnostic::error(Code::ATTRIBUTE, attribute.span, message)
                        .help(format!("write `@{}(1e-6)`", name.text)),
                );
            }
        }
        tolerance
    }

    /// Reports parameters that share a name or have a reserved one.
    fn may_take(&mut self, function: &Function) -> bool {
        let mut fits = true;
        for (i, parameter) in function.parameters.iter().enumerate() {
            let name = &parameter.name;
            fits &= self.may_be_local(name);
            if let Some(first) = function.parameters[..i].iter().find(|p| p.name.text == name.text) {
                let message = format!("`{}` has two parameters `{}`", function.name.text, name.text);
                self.report(
                    Diagnostic::error(Code::DUPLICATE_NAME, name.span, message)
                        .label(first.name.span, "the first one"),
                );
                fits = false;
            }
        }
        if !fits {
            // a definition that failed, so that calls do not repeat the message
            self.names.define(self.scope.source, &function.name, Kind::Value(Value::Failed));
        }
        fits
    }

    /// Reports a reserved name of a parameter or of a fold's variable.
    pub(super) fn may_be_local(&mut self, name: &Name) -> bool {
        name.text == TIME || self.is_free(name)
    }

    /// Reports a name that has a meaning of its own.
    fn is_free(&mut self, name: &Name) -> bool {
        let reserved = RESERVED.contains(&name.text.as_str());
        if reserved {
            let message = format!("`{}` has a fixed meaning and cannot be defined", name.text);
            self.report(
                Diagnostic::error(Code::RESERVED_NAME, name.span, message).help("choose another name"),
            );
        }
        !reserved
    }

    /// Reports a name that is taken or reserved.
    fn may_define(&mut self, name: &Name) -> bool {
        self.is_free(name) && self.is_new(name)
    }

    /// Reports a name of a param or a value that is taken or reserved.
    fn may_be_value(&mut self, name: &Name) -> bool {
        self.may_be_local(name) && self.is_new(name)
    }

    /// Reports a name that is taken.
    fn is_new(&mut self, name: &Name) -> bool {
        if let Some(first) = self.names.defined_at(self.scope.source, &name.text) {
            let message = format!("`{}` is defined twice", name.text);
            self.report(
                Diagnostic::error(Code::DUPLICATE_NAME, name.span, message)
                    .at("defined again")
                    .label(first, "first defined here"),
            );
            return false;
        }
        true
    }

    fn unknown_overrides(&mut self, (ast, imported): (&Ast, &[Imported]), options: &Options) {
        let files = imported.iter().map(|file| (format!("{}.", file.qualified), &file.ast));
        let all = std::iter::once((String::new(), ast)).chain(files);
        let params = all.flat_map(|(qualifier, ast)| {
            ast.items.iter().filter_map(move |item| match item {
                Item::Param(param) => Some((format!("{qualifier}{}", param.name.text), param.name.span)),
                Item::Import(_) | Item::Let(_) | Item::Function(_) | Item::Solid(_) | Item::Scene(_) => None,
            })
        });
        let (declared, places): (Vec<String>, Vec<Span>) = params.unzip();
        for name in options.overrides.keys().filter(|name| !declared.contains(name)) {
            let message = format!("`{name}` is set, but the file declares no such param");
            let message = options.about_setting(name, message);
            let near = crate::diagnostic::nearest(name, declared.iter().map(String::as_str));
            let near = near.and_then(|near| Some((near, places[declared.iter().position(|d| d == near)?])));
            // where none has such a name, the message is about no place of the file
            let span = near.map_or(Span::new(SourceId::File, 0, 0), |(_, place)| place);
            let mut diagnostic = Diagnostic::error(Code::OVERRIDE, span, message);
            diagnostic = match near {
                Some((near, _)) => diagnostic.at("declared here").help(format!("did you mean `{near}`?")),
                None if vocabulary::is_key(name) => {
                    let set = options.setting_of_new_param(name);
                    diagnostic.help(format!(
                        "it is a key of scenes: declare a param for it, as in `param p = …` and `{name}: p`, and {set}"
                    ))
                }
                None if declared.is_empty() => diagnostic.help("the file declares no params"),
                None => diagnostic.help(format!("declared params: {}", declared.join(", "))),
            };
            // two names may be near to the same param
            self.diagnostics.push(diagnostic);
        }
    }
}

/// The unit of an expression that is one number with a unit, or a choice of two, and how it was written.
fn unit_of(expr: &Expr) -> Option<(Unit, &str)> {
    match &expr.kind {
        ExprKind::Quantity { unit, .. } => Some((parse_unit(&unit.text)?, &unit.text)),
        ExprKind::Negate(inner) => unit_of(inner),
        // both values have one unit, as in `if steep == 1 then 45 deg else 30 deg`
        ExprKind::Choice { values, .. } => {
            let [first, second] = values.each_ref().map(unit_of);
            first.filter(|(unit, _)| second.is_some_and(|(other, _)| other == *unit))
        }
        _ => None,
    }
}
