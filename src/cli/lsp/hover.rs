//! What is known of the name under the cursor.

use std::ops::Range;

use rfm::geom::{Aabb, significant};
use rfm::glam::DVec3;
use rfm::quantity::parse_unit;
use rfm::syntax::ast::{Definition, Entry, Expr, ExprKind, Item, Name};
use rfm::{Engine, Program};

use super::across::{Workspace, offered};
use super::complete::{method_around, signature};
use super::document::Document;
use super::names::{Imported, Meaning, Mention};
use crate::cli::language::{
    keys,
    words::{SIGNS, comment_above},
};

/// Lines of a definition that are shown.
const MOST_LINES: usize = 12;

/// Solids with more operations have no range shown, because a hover must answer at once.
const MOST_OPERATIONS: usize = 20_000;

/// The words about the name at a byte, in Markdown, and its place.
pub(super) fn at(workspace: &Workspace, document: &Document, byte: usize) -> Option<(String, Range<usize>)> {
    let mention = document.reading.names.at(byte)?;
    let words = match &mention.meaning {
        Meaning::Defined(place) => defined(document, mention, place),
        Meaning::Imported(of) => imported(workspace, document, mention, of)?,
        Meaning::File(path) => format!("the file `{path}`"),
        Meaning::Word(key) => keys::about_word(key, &mention.text)?,
        Meaning::Standard => standard(document, mention)?,
        Meaning::Key(block) => {
            let method = method_around(document, byte).unwrap_or_default();
            let about = keys::about(block.as_deref(), &mention.text, Some(method));
            format!("key `{}`{}", mention.text, if about.is_empty() { about } else { format!(": {about}") })
        }
        Meaning::Unit => unit(&mention.text)?,
        Meaning::Fold => SIGNS.iter().find(|(word, _)| *word == mention.text)?.1.to_string(),
    };
    Some((words, mention.place.clone()))
}

/// How large a unit is in SI units.
fn unit(text: &str) -> Option<String> {
    let parsed = parse_unit(text)?;
    let factor = significant(parsed.factor);
    Some(match parsed.dimension.unit() {
        Some(own) if own == text => format!("the unit {own}"),
        Some(own) => format!("1 {text} = {factor} {own}"),
        None => format!("1 {text} = {factor} in SI units"),
    })
}

/// What defines a name that is no item, and where.
fn inner(document: &Document, place: &Range<usize>) -> Option<String> {
    let is_it = |name: &Name| name.span.range() == *place;
    document.reading.ast.items.iter().find_map(|item| match item {
        Item::Function(function) if function.parameters.iter().any(|parameter| is_it(&parameter.name)) => {
            let parameter = function.parameters.iter().find(|parameter| is_it(&parameter.name))?;
            let default = parameter.default.as_ref();
            let default = default.and_then(|value| document.text().get(value.span.range()));
            let default = default.map_or(String::new(), |text| format!(", {text} if it is left out"));
            Some(format!("a parameter of the function `{}`{default}", function.name.text))
        }
        Item::Function(function) => variable(&function.body, &is_it),
        Item::Let(definition) | Item::Solid(definition) => variable(&definition.value, &is_it),
        Item::Scene(scene) => labelled(&scene.entries, &is_it, &scene.name.text),
        Item::Param(_) | Item::Import(_) => None,
    })
}

/// The block of a scene that a name is the label of, or the fold in it whose variable it is.
fn labelled(entries: &[Entry], is_it: &dyn Fn(&Name) -> bool, scene: &str) -> Option<String> {
    entries.iter().find_map(|entry| match entry {
        Entry::Block { key, label: Some(label), .. } if is_it(label) => Some(match key.text.as_str() {
            "probe" => {
                format!("a probe of the scene `{scene}`: a run writes it to `probes/{}.csv`", label.text)
            }
            key => format!("the {key} of the scene `{scene}`"),
        }),
        Entry::Block { entries, .. } => labelled(entries, is_it, scene),
        Entry::Setting { value, .. } => variable(value, is_it),
    })
}

/// The fold within an expression whose variable a name is.
fn variable(expr: &Expr, is_it: &dyn Fn(&Name) -> bool) -> Option<String> {
    if let ExprKind::Fold { op, variable, .. } = &expr.kind
        && is_it(variable)
    {
        return Some(format!("the variable of a fold by `{}`", op.word()));
    }
    expr.children().into_iter().find_map(|child| self::variable(child, is_it))
}

/// What is known of a name in the file that defines it.
fn imported(workspace: &Workspace, document: &Document, mention: &Mention, of: &Imported) -> Option<String> {
    let (_, file) = workspace.imported(document, &of.path)?;
    let place = offered(&file.reading, &mention.text, of.parameter_of.as_deref())?;
    Some(format!("{}\n\nin `{}`", defined(&file, mention, &place), of.path))
}

fn standard(document: &Document, mention: &Mention) -> Option<String> {
    let before = document.text().get(..mention.place.start)?.trim_end();
    match mention.text.as_str() {
        "x" | "y" | "z" => return Some(format!("the coordinate {}", mention.text)),
        "t" => return Some("the time, in seconds".to_string()),
        "pi" => return Some("π = 3.14159…".to_string()),
        _ => {}
    }
    let signature = signature(document, &mention.text, before.ends_with('.'))?;
    Some(format!("```rfm\n{}\n```\n\n{}", signature.label(), signature.about))
}

fn defined(document: &Document, mention: &Mention, place: &Range<usize>) -> String {
    let text = document.text();
    let item = document.reading.ast.items.iter().find(|item| item.name().span.range() == *place);
    let Some(item) = item else {
        let what = inner(document, place);
        return what
            .map_or_else(|| format!("`{}`", mention.text), |what| format!("`{}`: {what}", mention.text));
    };
    let (keyword, end) = match item {
        Item::Param(param) => {
            ("param", param.range.as_ref().map_or(param.value.span, |(_, high)| high.span).range().end)
        }
        Item::Let(definition) => ("let", definition.value.span.range().end),
        Item::Solid(definition) => ("solid", definition.value.span.range().end),
        Item::Function(function) => ("fn", function.body.span.range().end),
        Item::Scene(scene) => ("scene", scene.name.span.range().end),
        Item::Import(import) => return format!("the file `{}` as `{}`", import.path, import.name.text),
    };
    let written = text.get(place.start..end).unwrap_or("");
    let mut shown: String = written.lines().take(MOST_LINES).collect::<Vec<_>>().join("\n");
    if written.lines().count() > MOST_LINES {
        shown.push_str("\n…");
    }
    let mut words = format!("```rfm\n{keyword} {shown}\n```");
    let mut say = |line: &str| {
        if !line.is_empty() {
            words.push_str("\n\n");
            words.push_str(line);
        }
    };
    say(&comment_above(text, place.start));
    match item {
        Item::Param(param) => {
            say(param.doc.as_deref().unwrap_or(""));
            let value = document
                .program
                .as_ref()
                .and_then(|program| program.module().params.iter().find(|value| value.name == mention.text));
            if let Some(unit) =
                value.and_then(|value| value.unit.as_ref()).and_then(|(unit, _)| unit.dimension.unit())
            {
                say(&format!("in {unit}"));
            }
        }
        Item::Solid(definition) => say(&range_of_solid(document, definition).unwrap_or_default()),
        Item::Let(definition) => say(&range_of_let(document, definition).unwrap_or_default()),
        Item::Function(_) | Item::Scene(_) | Item::Import(_) => {}
    }
    words
}

/// The range of a solid's ω, which has no unit: shapes of unlike scales are joined by it, so only its sign has
/// a meaning.
fn range_of_solid(document: &Document, definition: &Definition) -> Option<String> {
    let range = range(document.program.as_ref()?, &definition.name.text, None)?;
    Some(format!("ω {range}; ω has no unit, it is positive inside"))
}

/// The range of a name for a number or a field: as that of a solid at the end of the file.
fn range_of_let(document: &Document, definition: &Definition) -> Option<String> {
    const NAME: &str = "shown_by_the_editor";
    let dimension = document.program.as_ref()?.module().dimensions.get(&definition.name.text);
    let unit = dimension.and_then(|dimension| dimension.unit());
    range(&document.with(&format!("solid {NAME} = {}", definition.name.text))?, NAME, unit)
}

/// What a field is in the box of the scene, or around the solids of the file, in a unit if one is known.
fn range(program: &Program, name: &str, unit: Option<&str>) -> Option<String> {
    let node = program.module().solids.iter().find(|solid| solid.name == name)?.node;
    let (graph, _) = program.module().graph.extract_cone(node);
    if graph.len() > MOST_OPERATIONS {
        return None;
    }
    let solid = program.solid_with(name, Engine::Interpreter).ok()?;
    let over = match &program.module().scenes[..] {
        [scene, ..] => scene.domain,
        [] => program.domain(&solid).unwrap_or(Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0))),
    };
    let range = solid.range(&over);
    let corner = |p: DVec3| format!("({}, {}, {})", short(p.x), short(p.y), short(p.z));
    let unit = unit.map_or(String::new(), |unit| format!(" {unit}"));
    Some(if range.lo == range.hi {
        format!("= {}{unit}", range.lo)
    } else if range.lo.is_finite() || range.hi.is_finite() {
        let (low, high) = (short(range.lo), short(range.hi));
        format!("{low} … {high}{unit} for {} … {} m", corner(over.min), corner(over.max))
    } else {
        return None;
    })
}

/// A number with four digits.
fn short(number: f64) -> String {
    if number == 0.0 || !number.is_finite() {
        return number.to_string();
    }
    let digits = (3.0 - number.abs().log10().floor()).clamp(0.0, 12.0);
    let unit = 10f64.powf(digits);
    let rounded = (number * unit).round() / unit;
    rounded.to_string()
}
