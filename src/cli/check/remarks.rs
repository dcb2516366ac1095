//! Warnings about solids that `rfm check` finds by measuring them, and editors after a pause in typing.

use std::collections::HashSet;

use super::super::failure::Failure;
use super::super::hidden::hidden;
use super::super::lints::definition;
use super::facts::{Facts, RESOLUTION, VOLUME_CELLS};
use super::measure::measure;
use rfm::diagnostic::{Code, Diagnostic, Span};
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::ir::{Axis, Magnitudes};
use rfm::lower::{NamedSolid, VaryingSize};
use rfm::mesh::{Grid, ThinCells, Watch};
use rfm::solid::{Bounds, Unbounded};
use rfm::{Precision, Program, Solid};

/// All that `rfm check` says of a solid after it has measured it, as far as the watch lets it.
pub(in crate::cli) fn by_measuring(
    program: &Program,
    named: &NamedSolid,
    solid: &Solid,
    watch: &dyn Watch,
) -> Result<Vec<Diagnostic>, Failure> {
    let (facts, thin) = measure(solid, "", watch, &mut Vec::new())?;
    let mut found = Vec::from_iter(overflow(program, named, solid));
    found.extend(program.within_tolerance(solid).and_then(Result::err).map(|refusal| *refusal));
    found.extend(of_solid(program, named, solid, (&facts, &thin)));
    Ok(found)
}

/// A warning about a solid that has a box but shows nothing in it, as `sphere(1) and not sphere(1)`.
fn may_be_empty(named: &NamedSolid) -> Diagnostic {
    let message = format!(
        "solid `{}` may be empty, or too thin to be seen: {VOLUME_CELLS} cells along its longest side show nothing of it",
        named.name
    );
    Diagnostic::warning(Code::EMPTY_SOLID, named.span, message)
        .help(
            "look for a shape that is joined by `and` to its own outside, for a thickness of zero, or for a missing unit; \
             if its bounds are far too large, give it a box: `shape and box(…)`",
        )
}

/// Warnings about a solid that is empty, unbounded or thin.
pub(super) fn of_solid(
    program: &Program,
    named: &NamedSolid,
    solid: &Solid,
    (facts, thin): (&Facts, &ThinCells),
) -> Vec<Diagnostic> {
    let warning = |code, message| Diagnostic::warning(code, named.span, message);
    let mut found = Vec::new();
    match solid.bounds() {
        Bounds::Empty => {
            let message = format!("solid `{}` is empty: ω is nowhere positive", named.name);
            found.push(warning(Code::EMPTY_SOLID, message));
        }
        // a box would not make of values that are added or multiplied what is most likely meant
        Bounds::Unbounded if reckons_with_shapes(program, named) => {}
        Bounds::Unbounded => {
            found.push(unbounded(program, named, solid));
        }
        Bounds::Within(_) => {}
    }
    let grid = solid.bounds().aabb().and_then(|bounds| Grid::around(&bounds, RESOLUTION).ok());
    if let Some(grid) = grid.filter(|_| thin.count > 0) {
        let (what, does, help) = match (thin.is_wedge, thin.cells_needed(&grid)) {
            (true, _) => (
                "edges so sharp that",
                "show them blunt",
                "more --cells show more of them, and none shows all",
            ),
            (false, Some(_)) => {
                ("parts or gaps that", "do not show", "mesh it with more --cells, until `thin_cells` is 0")
            }
            (false, None) => (
                "parts or gaps that",
                "do not show",
                "to see the place, mesh it alone with a small --box around it",
            ),
        };
        let message = format!(
            "solid `{}` has {what} {VOLUME_CELLS} cells along its longest side {does}, {}",
            named.name,
            hidden(thin, &grid)
        );
        found.push(warning(Code::THIN_PARTS, message).help(help));
    }
    found.extend(facts.shows_nothing.then(|| may_be_empty(named)));
    found
}

/// Whether ω is proven to be positive far away on all sides, as a distance is that is negative inside.
fn is_all_but_a_part(solid: &Solid) -> bool {
    [1.0, 1e2, 1e4].into_iter().any(|near: f64| {
        let far = 1e3 * near;
        if solid.range(&Aabb::new(DVec3::splat(-near), DVec3::splat(near))).lo >= 0.0 {
            return false;
        }
        DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]).all(|side| {
            let others = (DVec3::ONE - side.abs()) * far;
            let (a, b) = (near * side - others, far * side + others);
            solid.range(&Aabb::new(a.min(b), a.max(b))).lo > 0.0
        })
    })
}

/// Whether it is told that the formula of a solid adds or multiplies shapes.
fn reckons_with_shapes(program: &Program, named: &NamedSolid) -> bool {
    let Some(formula) = definition(program, named) else { return false };
    program.warnings().list.iter().any(|warning| {
        let at = warning.primary.span;
        let is_within = at.source == formula.source && formula.start <= at.start && at.end <= formula.end;
        warning.code == Code::SHAPES_AS_NUMBERS && is_within
    })
}

/// A warning that says which operand of a solid was not found to end, and where.
fn unbounded(program: &Program, named: &NamedSolid, solid: &Solid) -> Diagnostic {
    let why = solid.unbounded();
    let sides = why.as_ref().map_or(String::new(), Unbounded::direction);
    let message = format!("solid `{}` could not be proven to end {sides}", named.name);
    let ends_but_along_z = why.as_ref().is_some_and(|why| why.sides == ["-z", "+z"]);
    let is_profile = ends_but_along_z && !program.module().graph.uses(named.node, Axis::Z);
    let help = match () {
        () if is_profile => {
            "it is a profile, the same at every z: `.extrude(z0, z1)` or `.revolve()` makes a solid of it"
        }
        () if is_all_but_a_part(solid) => {
            "ω is positive inside, and this one is positive everywhere far away: of a distance that is negative inside, \
             write `… <= 0`; if all but a part is meant, intersect it with a box"
        }
        () => "intersect it with a box, or mesh it with --box",
    };
    let warning = Diagnostic::warning(Code::UNBOUNDED_SOLID, named.span, message);
    let operand = why.filter(|why| !why.is_whole).and_then(|why| why.operand);
    let is_part = |call: Span| {
        operand.is_none_or(|at| at.source == call.source && at.start <= call.start && call.end <= at.end)
    };
    if let Some(VaryingSize { function, parameter, value, .. }) =
        varying_size(program, named).filter(|size| is_part(size.call))
    {
        return warning
            .label(*value, format!("`{parameter}` of `{function}` depends on the place here"))
            .help(format!("give `{parameter}` a number, such as 1, or intersect the solid with a box"));
    }
    let warning = warning.help(help);
    match operand.filter(|operand| operand.source == named.span.source) {
        Some(operand) => warning.label(operand, "this operand has no bounds"),
        None => warning,
    }
}

/// The first size of a standard solid in the formula of a solid that depends on the place.
fn varying_size<'a>(program: &'a Program, named: &NamedSolid) -> Option<&'a VaryingSize> {
    let sizes = &program.module().varying_sizes;
    if sizes.is_empty() {
        return None;
    }
    let (graph, _) = program.module().graph.extract_cone(named.node);
    let places: HashSet<Span> = graph.nodes().filter_map(|(node, _)| graph.span(node)).collect();
    sizes.iter().find(|size| places.contains(&size.call))
}

/// A warning if ω may leave the range of numbers although its leaves do not.
pub(super) fn overflow(program: &Program, named: &NamedSolid, solid: &Solid) -> Option<Diagnostic> {
    let (graph, _) = program.module().graph.extract_cone(named.node);
    let magnitudes = match program.domain(solid) {
        Some(over) => Magnitudes::over(&graph, &over),
        None => Magnitudes::within_reach(&graph),
    };
    let node = magnitudes.overflow(&graph, Precision::F64)?;
    let message = format!(
        "ω of solid `{}` may leave the range of numbers here: it doubles with each operation inside the next",
        named.name
    );
    let warning = Diagnostic::warning(Code::OVERFLOW, graph.span(node).unwrap_or(named.span), message);
    Some(warning.help("write it as one chain: it is evaluated as a balanced tree"))
}
