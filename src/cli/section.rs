//! `rfm check --slice`: a plot of ω in a plane.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3};

use super::args::{Check, MessageFormat, Plotted};
use super::deadline::Deadline;
use super::failure::{Failure, note};
use super::hidden::hidden;
use super::mesh::LEAST_SEARCH;
use super::output::Shown;
use super::shared::Shared;
use super::{choose, output};
use rfm::diagnostic::{Code, Diagnostic, Span};
use rfm::field::Field;
use rfm::geom::Aabb;
use rfm::mesh::{Grid, MeshDistance, Resolution, Unwatched, dual_contouring, marching_cubes, thin_cells};
use rfm::slice::{self, Axis, Cut as SolidCut, Panel, Plane, Quantity, Style, Window};
use rfm::solid::{Bounds, Chosen};
use rfm::{Program, Solid};

/// Points along each side of the window at which a section is sought.
const SOUGHT: usize = 200;

/// Cells along the longest side of the mesh from which distances are measured.
const CELLS_OF_DISTANCE: usize = 192;

/// Distance beside its plane at which a section is tested, as a part of the window: less than a pixel.
const BESIDE: f64 = 1e-5;

/// Plots what the flags ask for. Returns warnings about what the plot shows.
pub(super) fn plot(shared: &Shared, options: &Check, program: &Program) -> Result<Vec<Diagnostic>, Failure> {
    let names: Vec<Option<&str>> = match &options.solid[..] {
        [] => vec![None],
        names => names.iter().map(|name| Some(name.as_str())).collect(),
    };
    let solid = |name: &Option<&str>| Ok(choose::solid(shared, program, *name)?.at(options.time));
    let solids = names.iter().map(solid).collect::<Result<Vec<Solid>, Failure>>()?;
    let is_plain = style(options) == Style::default();
    if !is_plain && solids.len() > 1 {
        return Err(Failure::usage(
            "--plot distance and --arrows show one solid: several are drawn as sections",
        ));
    }
    if !is_plain && options.term {
        return Err(Failure::usage("--term draws ω without arrows: write a picture with -o"));
    }
    match (&options.slice[..], &solids[..]) {
        ([plane], [solid]) if is_plain => plot_one(shared, options, program, (solid, *plane)),
        (planes, solids) => plot_sheet(shared, options, program, (solids, planes)),
    }
}

/// A solid as it is drawn in a plane.
struct Seen<'a> {
    /// What is drawn.
    field: Beside<'a>,
    title: String,
    /// The shift of the plane out of a face.
    is_aside: bool,
    warning: Option<Diagnostic>,
}

impl Seen<'_> {
    /// What is drawn: only what is moved needs to be.
    fn field(&self) -> &dyn Field {
        if self.is_aside { &self.field } else { self.field.field }
    }

    fn cut(&self) -> SolidCut<'_> {
        SolidCut { name: self.title.clone(), field: self.field() }
    }
}

/// Looks at a solid in a plane, in which a field of it is drawn.
fn seen<'a>(
    program: &Program,
    (solid, field): (&Solid, &'a dyn Field),
    (plane, window): (Plane, Window),
) -> Seen<'a> {
    let aside = out_of_a_face(solid, plane, window);
    let shown = Plane::new(plane.axis, plane.value + aside.unwrap_or(0.0));
    let found = match aside {
        Some(_) => Some((Code::SECTION_IN_FACE, in_a_face(solid, plane))),
        None => meets(solid, plane, window).map(|message| (Code::NO_SECTION, message)),
    };
    let named = program.module().solids.iter().find(|named| named.name == solid.name());
    let warning =
        found.zip(named).map(|((code, message), named)| Diagnostic::warning(code, named.span, message));
    let title = match aside {
        Some(_) => format!("{}, just outside its face", solid.name()),
        None => solid.name().to_string(),
    };
    let field = Beside { field, by: shown.point(DVec2::ZERO) - plane.point(DVec2::ZERO) };
    Seen { field, title, is_aside: aside.is_some(), warning }
}

/// The field that is drawn as ω: a cheaper program of it if a tolerance allows one.
fn omega_of<'a>(solid: &'a Solid, chosen: Option<&'a Chosen>) -> &'a dyn Field {
    match chosen {
        Some(chosen) => chosen,
        None => solid,
    }
}

/// Plots a solid in a plane.
fn plot_one(
    shared: &Shared,
    options: &Check,
    program: &Program,
    (solid, plane): (&Solid, Plane),
) -> Result<Vec<Diagnostic>, Failure> {
    let window = window(options, plane, std::slice::from_ref(solid))?;
    let chosen = program.within_tolerance(solid).and_then(Result::ok);
    let seen = seen(program, (solid, omega_of(solid, chosen.as_ref())), (plane, window));
    let (field, title) = (seen.field(), seen.title.as_str());
    let warnings = Vec::from_iter(seen.warning.clone());
    if options.term {
        // drawn to memory first, so that a reader that closes early does not count as an error of the drawing
        let mut drawing = Vec::new();
        let colour = std::io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none();
        slice::terminal::draw(field, title, plane, window, 78, colour, &mut drawing)
            .map_err(Failure::usage)?;
        let mut out = anstream::stdout();
        out.write_all(&drawing)?;
        out.flush()?;
        if options.output.is_none() {
            return Ok(warnings);
        }
    }
    let path = match &options.output {
        Some(path) => path.clone(),
        None => own_name(solid, plane),
    };
    let picture = picture(field, title, plane, window, &path)?;
    output::write(&path, |out| out.write_all(&picture))?;
    if !shared.json && options.message_format == MessageFormat::Human {
        say!("slice {plane} of {} written to {}", solid.name(), path.shown());
    }
    Ok(warnings)
}

/// How the flags ask for a slice to be drawn.
fn style(options: &Check) -> Style {
    let quantity = match options.plot {
        Plotted::Omega => Quantity::Omega,
        Plotted::Distance => Quantity::Distance,
    };
    Style { quantity, arrows: options.arrows }
}

/// The name of a slice's file if none is stated.
fn own_name(solid: &Solid, plane: Plane) -> PathBuf {
    PathBuf::from(format!("{}.{}.svg", solid.name(), plane.to_string().replace(' ', "")))
}

/// The distance from the surface of a solid, m, positive inside: that from a fine mesh of it.
struct Depth {
    distance: MeshDistance,
}

impl Depth {
    fn of(solid: &Solid) -> Result<Self, Failure> {
        let name = solid.name();
        let bounds = solid.bounds().aabb().filter(|bounds| !bounds.is_empty()).ok_or_else(|| {
            Failure::usage(format!("--plot distance measures from a mesh of `{name}`, which has no bounds: intersect it with a box"))
        })?;
        let refused = |error: &dyn std::fmt::Display| {
            Failure::usage(format!("--plot distance, a mesh of `{name}`: {error}"))
        };
        let grid =
            Grid::around(&bounds, Resolution::Cells(CELLS_OF_DISTANCE)).map_err(|error| refused(&error))?;
        let surface = solid.surface(*grid.bounds());
        let sharp = dual_contouring(&*surface, &grid, &Unwatched).map_err(|error| refused(&error))?;
        let thin =
            thin_cells(&*surface, &grid, &Deadline::after(LEAST_SEARCH)).map_err(|error| refused(&error))?;
        if thin.count > 0 {
            note(format!(
                "distances are measured from a mesh of `{name}`, which does not show all of what is thinner than two \
                 cells: {}",
                hidden(&thin, &grid)
            ));
        }
        if thin.ended {
            note(format!(
                "distances are measured from a mesh of `{name}`; whether it misses what is thin was not found out in \
                 time"
            ));
        }
        if let Ok(distance) = MeshDistance::of(&sharp) {
            return Ok(Self { distance });
        }
        // one without sharp edges never touches itself
        let plain = marching_cubes(&*surface, &grid, &Unwatched).map_err(|error| refused(&error))?;
        let distance = MeshDistance::of(&plain).map_err(|error| refused(&error))?;
        Ok(Self { distance })
    }
}

impl Field for Depth {
    fn omega(&self, p: DVec3) -> f64 {
        self.distance.at(p).0
    }

    fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        self.distance.at(p)
    }
}

/// Plots several planes, or several solids, or both, in one drawing.
fn plot_sheet(
    shared: &Shared,
    options: &Check,
    program: &Program,
    (solids, planes): (&[Solid], &[Plane]),
) -> Result<Vec<Diagnostic>, Failure> {
    if options.term {
        return Err(Failure::usage("--term draws one solid in one plane: name one of each, or leave it out"));
    }
    if options.window.is_some() && planes.iter().any(|plane| plane.axis != planes[0].axis) {
        return Err(Failure::usage(
            "--window states a part of a plane, and these planes lie across different axes: plot them one by one",
        ));
    }
    let style = style(options);
    let depths: Vec<Option<Depth>> = match style.quantity {
        Quantity::Omega => solids.iter().map(|_| None).collect(),
        Quantity::Distance => {
            solids.iter().map(|solid| Depth::of(solid).map(Some)).collect::<Result<_, _>>()?
        }
    };
    let chosen: Vec<_> =
        solids.iter().map(|solid| program.within_tolerance(solid).and_then(Result::ok)).collect();
    let drawn = solids.iter().zip(&depths).zip(&chosen).map(|((solid, depth), chosen)| match depth {
        Some(depth) => depth as &dyn Field,
        None => omega_of(solid, chosen.as_ref()),
    });
    let drawn: Vec<&dyn Field> = drawn.collect();
    let mut all = Vec::new();
    for plane in planes {
        let window = window(options, *plane, solids)?;
        let of = |(solid, field): (&_, &_)| seen(program, (solid, *field), (*plane, window));
        all.push((*plane, window, solids.iter().zip(&drawn).map(of).collect::<Vec<_>>()));
    }
    let panels: Vec<Panel<'_>> = all
        .iter()
        .map(|(plane, window, seen)| Panel {
            plane: *plane,
            window: *window,
            style,
            cuts: seen.iter().map(Seen::cut).collect(),
        })
        .collect();
    let path = options.output.clone().unwrap_or_else(|| match (planes, solids) {
        ([plane], [solid]) => own_name(solid, *plane),
        _ => PathBuf::from("slices.svg"),
    });
    let names: Vec<&str> = solids.iter().map(Solid::name).collect();
    let (title, mut bytes) = (names.join(", "), Vec::new());
    let samples = slice::DEFAULT_SAMPLES;
    match output::Picture::of(&path)? {
        output::Picture::Svg => slice::write_sheet_svg(&title, &panels, samples, &mut bytes),
        output::Picture::Png => slice::write_sheet_png(&title, &panels, samples, 2.0, &mut bytes),
    }
    .map_err(Failure::usage)?;
    output::write(&path, |out| out.write_all(&bytes))?;
    if !shared.json && options.message_format == MessageFormat::Human {
        let planes: Vec<String> = planes.iter().map(ToString::to_string).collect();
        say!("slices {} of {title} written to {}", planes.join(", "), path.shown());
    }
    let all: Vec<Diagnostic> =
        all.into_iter().flat_map(|(_, _, seen)| seen).filter_map(|seen| seen.warning).collect();
    // in a sheet of several solids, a plane may miss a solid as long as another plane shows it
    let missed = |warning: &Diagnostic| warning.code == Code::NO_SECTION;
    let is_nowhere = |solid: Span| {
        all.iter().filter(|other| missed(other) && other.primary.span == solid).count() == planes.len()
    };
    let warnings = all
        .iter()
        .filter(|warning| !missed(warning) || solids.len() == 1 || is_nowhere(warning.primary.span));
    let warnings = warnings.cloned().collect();
    Ok(warnings)
}

/// The part of a plane that is drawn.
fn window(options: &Check, plane: Plane, solids: &[Solid]) -> Result<Window, Failure> {
    if let Some([u0, v0, u1, v1]) = options.window {
        return Ok(Window::new(DVec2::new(u0, v0), DVec2::new(u1, v1)));
    }
    let bounds = solids.iter().map(around).collect::<Result<Vec<Aabb>, Failure>>()?;
    Ok(plane.window(&bounds.iter().fold(Aabb::EMPTY, |all, one| all.union(one))))
}

/// A field as it is a little beside each place.
struct Beside<'a> {
    field: &'a dyn Field,
    by: DVec3,
}

impl Field for Beside<'_> {
    fn omega(&self, p: DVec3) -> f64 {
        self.field.omega(p + self.by)
    }

    fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        self.field.omega_grad(p + self.by)
    }
}

/// The points at which a section is sought.
fn sought(plane: Plane, window: Window) -> impl Iterator<Item = DVec3> {
    let cell = window.size() / SOUGHT as f64;
    (0..SOUGHT * SOUGHT).map(move |k| {
        let place = DVec2::new((k % SOUGHT) as f64 + 0.5, (k / SOUGHT) as f64 + 0.5);
        plane.point(window.min + cell * place)
    })
}

/// If a plane lies within a face of a solid, how far beside it the section is drawn: on the side with less of
/// the solid. A face is seen by four points beside each other; an edge in the plane has no more than rows of them.
fn out_of_a_face(solid: &Solid, plane: Plane, window: Window) -> Option<f64> {
    let aside = BESIDE * window.size().max_element();
    let step = DVec3::AXES[plane.axis.index()] * aside;
    let (mut within, mut before, mut behind) = (vec![false; SOUGHT * SOUGHT], 0, 0);
    for (k, p) in sought(plane, window).enumerate() {
        let [on, low, high] = [p, p - step, p + step].map(|p| solid.omega(p));
        // the rounding of ω is far below what it is at this distance from a face
        within[k] = on.abs() < 1e-3 * low.abs().max(high.abs());
        before += usize::from(low > 0.0);
        behind += usize::from(high > 0.0);
    }
    let four = |k: usize| [k, k + 1, k + SOUGHT, k + SOUGHT + 1].iter().all(|&k| within[k]);
    let mut corners = (0..SOUGHT * (SOUGHT - 1)).filter(|k| k % SOUGHT + 1 < SOUGHT);
    corners.any(four).then_some(if before < behind { -aside } else { aside })
}

fn in_a_face(solid: &Solid, plane: Plane) -> String {
    format!(
        "the plane {plane} lies within a face of `{}`: the section just outside of that face is drawn",
        solid.name()
    )
}

/// The message about a plot that shows nothing of the solid; `None` if it shows some.
fn meets(solid: &Solid, plane: Plane, window: Window) -> Option<String> {
    if sought(plane, window).any(|p| solid.omega(p) > 0.0) {
        return None;
    }
    let name = solid.name();
    let axis = plane.axis.index();
    let where_it_is = match solid.bounds() {
        Bounds::Empty => "it is empty".to_string(),
        Bounds::Unbounded => "another plane or --window may show it".to_string(),
        Bounds::Within(bounds) => {
            // rounded, because proven bounds are not exact
            let rounded = |at: f64| (1e5 * at).round() / 1e5 + 0.0;
            let between = |axis: Axis| {
                let [low, high] = [bounds.min, bounds.max].map(|corner| rounded(corner[axis.index()]));
                format!("{0} = {low} and {0} = {high}", axis.name())
            };
            let over = plane.window(bounds);
            let is_beside = window.max.cmplt(over.min).any() || over.max.cmplt(window.min).any();
            if is_beside && (bounds.min[axis]..=bounds.max[axis]).contains(&plane.value) {
                let (right, up) = plane.axis.right_and_up();
                let [right, up] = [right, up].map(between);
                format!("the picture shows a place beside it, and it lies between {right}, and between {up}")
            } else {
                format!("it lies between {}", between(plane.axis))
            }
        }
    };
    let corners = [window.min, window.max].map(|corner| plane.point(corner));
    Some(if solid.range(&Aabb::new(corners[0], corners[1])).hi < 0.0 {
        format!("the plane {plane} does not meet `{name}` in the picture: {where_it_is}")
    } else {
        format!(
            "the section of `{name}` by {plane} is thinner than a pixel, or outside the picture: {where_it_is}"
        )
    })
}

fn picture(
    field: &dyn Field,
    name: &str,
    plane: Plane,
    window: Window,
    path: &Path,
) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    let samples = slice::DEFAULT_SAMPLES;
    match output::Picture::of(path)? {
        output::Picture::Svg => slice::write_svg(field, name, plane, window, samples, &mut bytes),
        output::Picture::Png => slice::write_png(field, name, plane, window, samples, 2.0, &mut bytes),
    }
    .map_err(Failure::usage)?;
    Ok(bytes)
}

/// The solid's bounds with a margin.
fn around(solid: &Solid) -> Result<Aabb, Failure> {
    match solid.bounds() {
        Bounds::Within(bounds) => Ok(bounds.grown(0.15 * bounds.size().max_element())),
        Bounds::Empty => {
            Err(Failure::usage("the solid is empty: say what to plot with --window U0,V0,U1,V1"))
        }
        Bounds::Unbounded => {
            Err(Failure::usage("the solid has no bounds: say what to plot with --window U0,V0,U1,V1"))
        }
    }
}
