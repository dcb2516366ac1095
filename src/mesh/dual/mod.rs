//! Manifold dual contouring: one vertex for each sheet of the surface in a cell, placed on creases
//! and corners.
//!
//! [`dual_contouring`] has five stages:
//! 1. [`Crossing::find`]: the cells that the surface passes and its hits on their edges, as for marching
//!    cubes; `loops` finds which hits belong together.
//! 2. [`place`](fn@place): a vertex for each loop, by `place`, `sharp`, `qef` and `crease`.
//! 3. [`join`]: triangles. `quads` joins the four vertices around each hit and cuts the quad in two.
//! 4. `refine`: edges that are still too far from the surface are cut.
//! 5. `mend`: edges that stay far off and triangles that lie upside down are treated one by one.
//!
//! If many triangles cross after stage 3 or 4, or any in the end, what follows stage 3 is done with care:
//! `secure` makes fans of quads that cross, in stage 4 cuts move back to the middles of their edges where
//! triangles would cross, and stage 5 changes nothing that would make them cross, as far as a budget allows.
//!
//! The vertices are those of the dual of the marching-cubes mesh (Schaefer, Ju, Warren: Manifold dual
//! contouring, IEEE TVCG 13, 2007), so the topology is that of marching cubes. The quadratic error is that of
//! Ju, Losasso, Schaefer, Warren: Dual contouring of Hermite data, SIGGRAPH 2002. In addition, vertices at
//! creases are moved onto them by probes beside them, so they are exact also where faces are curved.
//!
//! Invariant: bricks are numbered in order and each task writes to its own part of the mesh, so the mesh is
//! the same for any number of threads.

mod bends;
mod care;
mod crease;
mod draft;
mod loops;
mod mend;
mod patch;
mod place;
mod project;
mod qef;
mod quads;
mod refine;
mod secure;
mod sharp;
#[cfg(test)]
mod tests;
mod vertices;

use glam::DVec3;
use rayon::prelude::*;

use self::draft::Draft;
use self::loops::Sheets;
use self::place::{Placed, Placement, Slots};
use self::quads::{Cut, Quads};
use self::secure::Surface;
use self::vertices::{Hits, Rings, Vertices};
use super::{
    Grid, Mesh, MeshError, Watch, Work,
    crossings::{self, BRICKS_PER_TASK, Crossed, EdgeScratch, OnEdges, ProgressPart},
    normals::GradientColumns,
    prune::{Bricks, Lattice},
    signs::Signs,
};
use crate::field::Field;

/// The surface ω = 0 of a field as a closed mesh with sharp creases. It is empty if no node of the grid
/// lies inside.
///
/// Inside is strictly ω > 0. Everything outside the grid counts as outside, so a solid cut by the border is
/// closed by faces on it (see [`Mesh::caps`]). `watch` receives the share of the surface that is found, and
/// may end the work. Sources: Ju, Losasso, Schaefer, Warren, SIGGRAPH 2002; Schaefer, Ju, Warren, IEEE TVCG
/// 13, 2007.
///
/// # Errors
/// [`MeshError::NotANumber`] if ω is NaN at a node or on an edge that crosses the surface,
/// [`MeshError::TooManyVertices`] beyond [`Mesh::MAX_VERTICES`], [`MeshError::Ended`] if `watch` ends the work.
pub fn dual_contouring(field: &dyn Field, grid: &Grid, watch: &dyn Watch) -> Result<Mesh, MeshError> {
    let lattice = Lattice::new(grid);
    let near = Bricks::classify(field, &lattice);
    let mut work = Work::default();

    let crossing = Crossing::find(field, &lattice, &near, watch, &mut work)?;
    let rings = Rings::new(crossing.crossed.vertices);
    let placed_and_joined = |work: &mut Work| {
        let (vertices, placed) = place(&crossing.placement(field, &lattice, &rings, grid.spacing()), watch)?;
        crossings::ended(watch)?;
        Ok(join((field, &lattice), &crossing, &rings, &placed, vertices, grid, work))
    };
    let mut joined = placed_and_joined(&mut work)?;
    crossings::ended(watch)?;
    let crossings = joined.crossings();
    let is_clear = crossings.is_empty();
    let mut kept = None;
    if crossings.len() > MENDABLE {
        kept = Some(joined);
    } else {
        let triangles = if is_clear {
            joined.into_triangles()
        } else {
            let triangles = joined.triangles();
            kept = Some(joined);
            triangles
        };
        match Attempt::make(Draft::new(field, grid, triangles, work, watch), is_clear, watch)? {
            Attempt::Clear(mesh) => return Ok(mesh),
            // without the cuts nothing crosses
            Attempt::Crossing { cut: Some((mut draft, far)), work: spent } => {
                draft.count(spent);
                return apart(draft, far, watch);
            }
            Attempt::Crossing { cut: None, work: spent } => work = spent,
        }
    }
    let joined = kept.map_or_else(|| placed_and_joined(&mut work), Ok)?;
    crossings::ended(watch)?;
    let triangles = joined.triangles_apart(crossings, &mut work, watch)?;
    let mut draft = Draft::new(field, grid, triangles, work, watch);
    let far = draft.cut()?;
    apart(draft, far, watch)
}

/// A mesh made sharp without care for triangles that cross.
enum Attempt<'a> {
    /// It does not cross itself.
    Clear(Mesh),
    /// It does.
    Crossing {
        /// The mesh before it was mended, and its edges that are far from the surface, if it was clear before
        /// edges were cut, and triangles crossed then.
        cut: Option<(Draft<'a>, Vec<[u32; 2]>)>,
        work: Work,
    },
}

impl<'a> Attempt<'a> {
    /// Cuts edges, and mends what can be mended. A mesh is clear if nothing crosses before.
    ///
    /// # Errors
    /// Those of [`Draft::mend`], and [`MeshError::Ended`].
    fn make(mut draft: Draft<'a>, is_clear: bool, watch: &dyn Watch) -> Result<Self, MeshError> {
        let far = draft.cut()?;
        let is_long = far.len() > draft.triangle_count() / CHECKED;
        let may_cross = draft.is_cut() || !is_clear;
        let crossing = if is_long && may_cross { draft.crossings() } else { 0 };
        if crossing > MENDABLE {
            let work = draft.work();
            return Ok(Self::Crossing { cut: is_clear.then_some((draft, far)), work });
        }
        let cut = (crossing > 0 && is_clear).then(|| (draft.clone(), far.clone()));
        crossings::ended(watch)?;
        let changes = draft.mend(far)?;
        crossings::ended(watch)?;
        let is_known = is_clear && !changes && !draft.is_cut();
        if is_known || draft.crossings() == 0 {
            return Ok(Self::Clear(draft.finish()));
        }
        Ok(Self::Crossing { cut, work: draft.work() })
    }
}

/// The mesh without triangles that cross.
///
/// # Errors
/// Those of [`Draft::mend`], and [`MeshError::Ended`].
fn apart(mut draft: Draft<'_>, far: Vec<[u32; 2]>, watch: &dyn Watch) -> Result<Mesh, MeshError> {
    crossings::ended(watch)?;
    draft.part()?;
    crossings::ended(watch)?;
    draft.mend(far)?;
    Ok(draft.finish())
}

/// Mending is tried if at most this many pairs of triangles cross, before edges are cut or after it. In the
/// examples at 32 and 96 cells mending parted all pairs where there were at most 4 before or at most 44 after
/// cutting, and never more than 48 after it. The 156 to 957 pairs of a thousand joined parts before cutting
/// were never parted. Between these numbers, the choice affects time only, not quality.
const MENDABLE: usize = 100;

/// If fewer than one edge in this many triangles needs mending, mending takes less time than looking for
/// crossings before it.
const CHECKED: usize = 5000;

/// Where the surface crosses the edges of the grid.
struct Crossing {
    /// Signs at the nodes of all near bricks.
    signs: Vec<Signs>,
    /// The crossed bricks, with the sheets of the surface in their cells.
    crossed: Crossed<Sheets>,
    hits: Hits,
}

impl Crossing {
    /// Samples the signs, numbers crossed edges and sheets, and finds the hits.
    ///
    /// # Errors
    /// Those of [`dual_contouring`].
    fn find(
        field: &dyn Field,
        lattice: &Lattice,
        near: &Bricks,
        watch: &dyn Watch,
        work: &mut Work,
    ) -> Result<Self, MeshError> {
        let sampling = ProgressPart::new(near.near.len().div_ceil(BRICKS_PER_TASK), 0.0..0.5, watch);
        let signs = crossings::sample(field, lattice, near, &mut work.evaluations, &sampling)?;
        let crossed =
            Crossed::number(near, &signs, |brick, around| Sheets::find(field, lattice, brick.low, around));
        let sheets: usize = sheet_counts(&crossed).sum();
        MeshError::check_vertices(sheets.max(crossed.vertices))?;
        let hitting = ProgressPart::new(crossed.tasks.len(), 0.5..1.0, watch);
        let hits = hits(field, lattice, &crossed, work, &hitting)?;
        Ok(Self { signs, crossed, hits })
    }

    /// What the placement of vertices reads.
    fn placement<'a>(
        &'a self,
        field: &'a dyn Field,
        lattice: &'a Lattice,
        rings: &'a Rings,
        spacing: DVec3,
    ) -> Placement<'a> {
        let Self { signs, crossed, hits } = self;
        Placement { field, lattice, signs, crossed, hits, rings, spacing }
    }
}

/// The number of vertices that the sheets of each task become.
fn sheet_counts(crossed: &Crossed<Sheets>) -> impl Iterator<Item = usize> {
    crossed.tasks.iter().map(|task| task.kept.iter().map(|sheets| sheets.vertices).sum())
}

/// The points of the surface on all crossed edges, and its normals there. On the border the normal is the
/// direction of the edge.
fn hits(
    field: &dyn Field,
    lattice: &Lattice,
    crossed: &Crossed<Sheets>,
    work: &mut Work,
    stage: &ProgressPart<'_>,
) -> Result<Hits, MeshError> {
    let Vertices { mut positions, mut normals, .. } = Vertices::new(crossed.vertices);
    let counts = || crossed.tasks.iter().map(|task| task.vertices);
    let jobs = crossed
        .tasks
        .par_iter()
        .zip(crossings::parts(&mut positions, counts()))
        .zip(crossings::parts(&mut normals, counts()));
    let found: Vec<Result<OnEdges, MeshError>> = jobs
        .map_init(
            || (EdgeScratch::default(), GradientColumns::default()),
            |(edges, gradients), ((task, positions), normals)| {
                stage.run(|| {
                    let found = task.place_on_edges(field, lattice, positions, edges)?;
                    gradients.normals(field, positions, normals);
                    for cap in &found.caps {
                        normals[cap.vertex as usize - task.first] = cap.outward;
                    }
                    Ok(found)
                })
            },
        )
        .collect();
    let mut is_cap = vec![false; crossed.vertices];
    for found in found {
        let found = found?;
        found.caps.iter().for_each(|cap| is_cap[cap.vertex as usize] = true);
        work.evaluations += found.evaluations;
    }
    for sheets in crossed.tasks.iter().flat_map(|task| &task.kept) {
        work.evaluations += sheets.evaluations;
    }
    work.gradients += crossed.vertices as u64;
    Ok(Hits { positions, normals, is_cap })
}

/// Places the vertices of all cells.
///
/// # Errors
/// [`MeshError::Ended`].
fn place(placement: &Placement<'_>, watch: &dyn Watch) -> Result<(Vertices, Vec<Placed>), MeshError> {
    let counts: Vec<usize> = sheet_counts(placement.crossed).collect();
    let mut vertices = Vertices::new(counts.iter().sum());
    let mut first = 0;
    let firsts: Vec<u32> = counts
        .iter()
        .map(|count| {
            first += *count as u32;
            first - *count as u32
        })
        .collect();
    let parts = || counts.iter().copied();
    let slots = crossings::parts(&mut vertices.positions, parts())
        .into_par_iter()
        .zip(crossings::parts(&mut vertices.normals, parts()))
        .zip(crossings::parts(&mut vertices.kinds, parts()))
        .zip(firsts)
        .map(|(((positions, normals), kinds), first)| Slots { first, positions, normals, kinds });
    let tasks = placement.crossed.tasks.par_iter().zip(slots);
    let placed = tasks.map_init(place::PlacementScratch::default, |scratch, (task, slots)| {
        crossings::ended(watch)?;
        Ok(placement.place(task, slots, scratch))
    });
    let placed = placed.collect::<Result<_, _>>()?;
    Ok((vertices, placed))
}

/// The quads around all hits, cut in two, before any of them are kept apart.
struct Joined<'a> {
    quads: Quads<'a>,
    cut: Cut,
    vertices: Vertices,
    /// The triangles of tunnels.
    tubes: Vec<[u32; 3]>,
}

impl Joined<'_> {
    /// The pairs of triangles that cross as they are.
    fn crossings(&mut self) -> Vec<[u32; 2]> {
        let Self { quads, cut, vertices, tubes } = self;
        secure::crossings(quads, cut, vertices, tubes)
    }

    /// The vertices and triangles as they are.
    fn triangles(&self) -> (Vertices, Vec<[u32; 3]>) {
        let Self { quads, cut, vertices, tubes } = self;
        let mut vertices = vertices.clone();
        let triangles = secure::as_joined(quads, cut, &mut vertices, tubes);
        (vertices, triangles)
    }

    /// The vertices and triangles as they are, without a copy where none is needed.
    fn into_triangles(self) -> (Vertices, Vec<[u32; 3]>) {
        let Self { quads, cut, mut vertices, tubes } = self;
        let triangles = secure::into_joined(&quads, cut, &mut vertices, &tubes);
        (vertices, triangles)
    }

    /// The vertices and triangles, moved until no triangles cross.
    ///
    /// # Errors
    /// [`MeshError::Ended`].
    fn triangles_apart(
        self,
        crossings: Vec<[u32; 2]>,
        work: &mut Work,
        watch: &dyn Watch,
    ) -> Result<(Vertices, Vec<[u32; 3]>), MeshError> {
        let Self { quads, cut, mut vertices, tubes } = self;
        let mut surface = Surface { field: quads.field, size: quads.size(), watch, gradients: 0 };
        let triangles = secure::secure((quads, cut), &mut vertices, &tubes, &mut surface, crossings)?;
        work.gradients += surface.gradients;
        Ok((vertices, triangles))
    }
}

/// Joins the vertices around each hit to quads and cuts these.
fn join<'a>(
    place: (&'a dyn Field, &'a Lattice),
    crossing: &'a Crossing,
    rings: &'a Rings,
    placed: &[Placed],
    mut vertices: Vertices,
    grid: &Grid,
    work: &mut Work,
) -> Joined<'a> {
    let Crossing { signs, crossed, hits } = crossing;
    let quads = Quads::join(place, signs, crossed, (hits, rings), placed, &mut vertices);
    let mut cut = quads.cut(&vertices);
    let fallbacks = placed.iter().flat_map(|part| part.fallbacks.iter().copied()).collect();
    let size = grid.spacing().min_element();
    move_spoilt(&quads, &mut cut, &mut vertices, fallbacks, size, &mut work.gradients);
    work.gradients += cut.gradients + placed.iter().map(|part| part.gradients).sum::<u64>();
    let tubes = placed.iter().flat_map(|part| part.tubes.iter().copied()).collect();
    Joined { quads, cut, vertices, tubes }
}

/// How often vertices are moved back because triangles lie upside down.
const RETREATS: usize = 4;

/// Moves vertices whose triangles lie upside down either way to their fallbacks, first onto the surface
/// near them and then to the fallbacks themselves, and cuts the quads around them again. Fallbacks ascend
/// by vertex.
fn move_spoilt(
    quads: &Quads<'_>,
    cut: &mut Cut,
    vertices: &mut Vertices,
    mut fallbacks: Vec<(u32, DVec3)>,
    size: f64,
    gradients: &mut u64,
) {
    for _ in 0..RETREATS {
        let mut spoilt = std::mem::take(&mut cut.spoilt);
        spoilt.sort_unstable();
        spoilt.dedup();
        spoilt.retain(|&v| {
            let Ok(at) = fallbacks.binary_search_by_key(&v, |&(v, _)| v) else { return false };
            let fallback = &mut fallbacks[at].1;
            if vertices.positions[v as usize] == *fallback {
                return false;
            }
            let settled = project::newton(quads.field, *fallback, size, gradients);
            let (position, normal) =
                settled.map_or((*fallback, DVec3::ZERO), |face| (face.point, face.normal));
            *fallback = position;
            vertices.positions[v as usize] = position;
            vertices.normals[v as usize] = normal;
            true
        });
        if spoilt.is_empty() {
            break;
        }
        quads.cut_again(vertices, &spoilt, cut);
    }
}
