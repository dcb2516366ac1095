//! What `rfm mesh` says about the mesh of a solid, as one JSON document or as text.

use serde::Serialize;

use super::super::output::significant;
use super::simplified::Simplified;
use rfm::mesh::{Quality, Report, ThinCells};

/// Where the time of a mesh went, in milliseconds.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Times {
    pub meshing: f64,
    /// Simplifying and measuring.
    pub measuring: f64,
    /// Checking whether the mesh is closed, and looking for what the grid has missed.
    pub checking: f64,
    pub writing: f64,
}

impl Times {
    fn total(&self) -> f64 {
        self.meshing + self.measuring + self.checking + self.writing
    }
}

/// The JSON document. Lengths are in metres, areas in m², volumes in m³.
#[derive(Serialize)]
pub(super) struct MeshSummary {
    schema: u32,
    solid: String,
    vertices: usize,
    triangles: usize,
    closed: bool,
    manifold: bool,
    /// Those of the surface: a hollow solid has two.
    components: usize,
    euler: i64,
    volume: f64,
    area: f64,
    max_distance: f64,
    rms_distance: f64,
    /// `None` where the search for them was ended.
    thin_cells: Option<usize>,
    /// Components less than two cells across, whose shape and volume are rough.
    pub small_components: usize,
    evaluations: u64,
    /// The time of the whole: to mesh, to simplify and measure, to check, and to write.
    milliseconds: f64,
    meshing_milliseconds: f64,
    /// Only with `--quality` or `--simplify`.
    #[serde(skip_serializing_if = "Option::is_none")]
    measuring_milliseconds: Option<f64>,
    method: &'static str,
    /// Only with `--quality`.
    #[serde(skip_serializing_if = "Option::is_none")]
    quality: Option<Quality>,
    /// Only with `--simplify`.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    simplified: Option<SimplifiedFigures>,
}

#[derive(Debug, Clone, Copy, Serialize)]
struct SimplifiedFigures {
    /// The number of triangles before.
    simplified_from: usize,
    /// In metres, as asked for.
    simplify_tolerance: f64,
    /// The measured Hausdorff distance from the surface, in metres; at least that much if the mesh could not be
    /// simplified because it was already farther away than the tolerance.
    simplify_error: f64,
    /// The time to simplify and to measure.
    simplify_milliseconds: f64,
    /// Whether the tolerance was refused at once, because the mesh itself is farther away.
    #[serde(skip)]
    is_refused: bool,
    #[serde(skip)]
    simplifying: f64,
    #[serde(skip)]
    measuring: f64,
}

impl From<&Simplified> for SimplifiedFigures {
    fn from(simplified: &Simplified) -> Self {
        Self {
            simplified_from: simplified.from,
            simplify_tolerance: simplified.tolerance,
            simplify_error: simplified.error,
            simplify_milliseconds: simplified.simplifying + simplified.measuring,
            is_refused: simplified.quality.is_none(),
            simplifying: simplified.simplifying,
            measuring: simplified.measuring,
        }
    }
}

impl MeshSummary {
    /// The figures of a mesh that `method` made, which misses what is thin.
    pub fn new(
        (solid, method): (&str, &'static str),
        report: &Report,
        thin: &ThinCells,
        quality: Option<Quality>,
        simplified: Option<&Simplified>,
        times: Times,
    ) -> Self {
        Self {
            schema: 1,
            solid: solid.to_string(),
            vertices: report.vertices,
            triangles: report.triangles,
            // a mesh without triangles has no hole, and is no surface either
            closed: report.closed && report.triangles > 0,
            manifold: report.manifold && report.triangles > 0,
            components: report.components,
            euler: report.euler,
            volume: report.volume,
            area: report.area,
            max_distance: report.max_distance,
            rms_distance: report.rms_distance,
            thin_cells: (!thin.ended).then_some(thin.count),
            small_components: 0,
            evaluations: report.evaluations,
            milliseconds: times.total(),
            meshing_milliseconds: times.meshing,
            measuring_milliseconds: (quality.is_some() || simplified.is_some()).then_some(times.measuring),
            method,
            quality,
            simplified: simplified.map(SimplifiedFigures::from),
        }
    }

    /// Prints the figures as text.
    pub fn print(&self) {
        let yes = |b: bool| if b { "yes" } else { "NO" };
        let measuring = self
            .measuring_milliseconds
            .map_or_else(String::new, |time| format!(" and {time:.1} ms to simplify or measure it"));
        say!(
            "{} vertices, {} triangles in {:.1} ms, {:.1} ms of them to mesh{measuring} ({} evaluations of ω)",
            self.vertices,
            self.triangles,
            self.milliseconds,
            self.meshing_milliseconds,
            self.evaluations
        );
        say!(
            "closed: {}, manifold: {}, components of the surface: {}, Euler characteristic: {}",
            yes(self.closed),
            yes(self.manifold),
            self.components,
            self.euler
        );
        say!("volume: {}, area: {}", significant(self.volume, 9), significant(self.area, 9));
        say!(
            "distance of the vertices from the surface: {:.1e} at most, {:.1e} rms",
            self.max_distance,
            self.rms_distance
        );
        if let Some(kept) = self.simplified.as_ref().filter(|simplified| simplified.is_refused) {
            say!(
                "not simplified: at least {:.2e} from the surface as it is, {:.2e} allowed",
                kept.simplify_error,
                kept.simplify_tolerance
            );
        } else if let Some(whole) = self.simplified.as_ref().filter(|s| s.simplified_from == self.triangles) {
            // its distance is that of the mesh, and no loss by the simplification
            say!(
                "not simplified: all {} triangles are needed to stay within the {:.2e} allowed",
                whole.simplified_from,
                whole.simplify_tolerance
            );
        } else if let Some(simplified) = &self.simplified {
            say!(
                "simplified from {} triangles in {:.1} ms: at most {:.2e} from the surface, as measured in {:.1} ms, {:.2e} \
                 allowed",
                simplified.simplified_from,
                simplified.simplifying,
                simplified.simplify_error,
                simplified.measuring,
                simplified.simplify_tolerance
            );
        }
        if let Some(quality) = &self.quality {
            print_quality(quality);
        }
    }
}

fn print_quality(quality: &Quality) {
    let is_part = quality.measured < 1.0;
    if is_part {
        say!(
            "quality: the time ended when {:.0} % of the samples were measured; --budget gives it more",
            (100.0 * quality.measured).floor()
        );
    }
    say!(
        "Hausdorff distance: {}{:.2e} (mesh to surface {:.2e}, rms {:.1e}; surface to mesh {:.2e}, rms {:.1e})",
        if is_part { "at least " } else { "" },
        quality.hausdorff(),
        quality.to_surface.max,
        quality.to_surface.rms,
        quality.from_surface.max,
        quality.from_surface.rms
    );
    say!(
        "volume error: {:+.1e}, area error: {:+.1e}, normals off by {:.2}° rms, {} triangles upside down",
        quality.volume_error,
        quality.area_error,
        quality.normal_error.rms,
        quality.flipped
    );
    say!(
        "triangles: least angle {:.2}°, mean radius ratio {:.3}, {:.2} % slivers",
        quality.min_angle,
        quality.mean_radius_ratio,
        100.0 * quality.slivers
    );
}
