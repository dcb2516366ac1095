//! `rfm check --slice`: a plot of ω in a plane.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use glam::DVec2;

use super::args::{Check, Shared};
use super::failure::{Failure, warn};
use super::output::Shown;
use super::{choose, output};
use rfm::diagnostic::Code;
use rfm::field::Field;
use rfm::geom::Aabb;
use rfm::slice::{self, Plane, Window};
use rfm::solid::Bounds;
use rfm::{Program, Solid};

/// Points along each side of the window at which a section is sought.
const SOUGHT: usize = 200;

/// Plots a solid in a plane. Returns whether the plane meets the solid; if not, this has been said.
pub(super) fn plot(
    shared: &Shared,
    options: &Check,
    program: &Program,
    plane: Plane,
) -> Result<bool, Failure> {
    let solid = choose::solid(shared, program, options.solid.as_deref())?.at(options.time);
    let window = match options.window {
        Some([u0, v0, u1, v1]) => Window::new(DVec2::new(u0, v0), DVec2::new(u1, v1)),
        None => plane.window(&around(&solid)?),
    };
    let meets = meets(&solid, plane, window);
    // if no program keeps the tolerance, which was reported, the solid's own ω is drawn
    let chosen = program.within_tolerance(&solid).and_then(Result::ok);
    let field: &dyn Field = chosen.as_ref().map_or(&solid as &dyn Field, |chosen| chosen);
    if options.term {
        // drawn to memory first, so that a reader who leaves early is no error of the drawing
        let mut drawing = Vec::new();
        let colour = std::io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none();
        slice::terminal::draw(field, solid.name(), plane, window, 78, colour, &mut drawing)
            .map_err(Failure::usage)?;
        let mut out = anstream::stdout();
        out.write_all(&drawing)?;
        out.flush()?;
        if options.output.is_none() {
            return Ok(meets);
        }
    }
    let path = match &options.output {
        Some(path) => path.clone(),
        None => PathBuf::from(format!("{}.{}.svg", solid.name(), plane.to_string().replace(' ', ""))),
    };
    let picture = picture(field, solid.name(), plane, window, &path)?;
    output::write(&path, |out| out.write_all(&picture))?;
    if !shared.json {
        say!("slice {plane} of {} written to {}", solid.name(), path.shown());
    }
    Ok(meets)
}

/// Whether a plot shows any of the solid. If not, warns and says where the solid is.
fn meets(solid: &Solid, plane: Plane, window: Window) -> bool {
    let cell = window.size() / SOUGHT as f64;
    let at = |k: usize| {
        let place = DVec2::new((k % SOUGHT) as f64 + 0.5, (k / SOUGHT) as f64 + 0.5);
        plane.point(window.min + cell * place)
    };
    if (0..SOUGHT * SOUGHT).any(|k| solid.omega(at(k)) > 0.0) {
        return true;
    }
    let name = solid.name();
    let axis = plane.axis.index();
    let where_it_is = match solid.bounds() {
        Bounds::Empty => "it is empty".to_string(),
        Bounds::Unbounded => "another plane or --window may show it".to_string(),
        Bounds::Within(bounds) => {
            // rounded, so that bounds which are proven and not exact look as they are meant
            let [low, high] = [bounds.min[axis], bounds.max[axis]].map(|at| (1e5 * at).round() / 1e5 + 0.0);
            format!("it lies between {0} = {low} and {0} = {high}", plane.axis.name())
        }
    };
    let corners = [window.min, window.max].map(|corner| plane.point(corner));
    let message = if solid.range(&Aabb::new(corners[0], corners[1])).hi < 0.0 {
        format!("the plane {plane} does not meet `{name}` in the picture: {where_it_is}")
    } else {
        format!(
            "the section of `{name}` by {plane} is thinner than a pixel, or outside the picture: {where_it_is}"
        )
    };
    warn(Code::NO_SECTION, message);
    false
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
