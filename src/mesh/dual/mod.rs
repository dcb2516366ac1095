//! Manifold dual contouring: one vertex for each sheet of the surface in a cell, placed on creases and corners.
//!
//! `crossings` finds the cells that the surface passes and its hits on their edges, as for marching cubes → `loops` tells
//! which hits belong together → `place` gives each loop a vertex (`sharp`, `qef`, `crease`) → `quads` joins the four vertices
//! around each hit and cuts the quad in two → `refine` cuts edges that are still too far from the surface → `mend` looks
//! one by one at what stays far off or lies upside down.
//!
//! The vertices are those of the dual of the marching-cubes mesh (Schaefer, Ju, Warren: Manifold dual contouring, IEEE
//! TVCG 13, 2007), so the topology is the same. The quadratic error is that of Ju, Losasso, Schaefer, Warren: Dual
//! contouring of Hermite data, SIGGRAPH 2002; what is new is that vertices at creases are moved onto them by probes
//! beside them, and so are exact also where faces are curved.
//!
//! Invariant: bricks are numbered in order and each task writes to places of its own, so the mesh is the same for any
//! number of threads.

mod crease;
mod loops;
mod mend;
mod patch;
mod place;
mod project;
mod qef;
mod quads;
mod refine;
mod sharp;
#[cfg(test)]
mod tests;
mod vertices;

use glam::DVec3;
use rayon::prelude::*;

use self::loops::Sheets;
use self::mend::Aim;
use self::patch::Patch;
use self::place::{Placed, Scene, Slots};
use self::quads::Quads;
use self::vertices::{Hits, Kind, Rings, Vertices};
use super::{
    Grid, Mesh, MeshError, Work,
    collapse::{self, AtNode},
    crossings::{self, BRICKS_PER_TASK, Crossed, EdgeScratch, OnEdges, Stage},
    normals::{self, Gradients},
    prune::{Bricks, Lattice},
};
use crate::field::Field;

/// How often triangles that lie upside down are looked for, to move vertices back or to mend them.
const REPAIRS: usize = 4;

/// The surface ω = 0 of a field as a closed mesh with sharp creases; empty if no node of the grid lies inside.
///
/// Inside is strictly ω > 0; everything outside the grid counts as outside, so a solid cut by the border is closed by
/// faces on it (see [`Mesh::caps`]). `progress` is called from any thread with the share of the surface found, in (0,
/// 1], not always in ascending order.
///
/// # Errors
/// [`MeshError::NotANumber`] if ω is NaN at a node or on an edge that crosses the surface,
/// [`MeshError::TooManyVertices`] beyond [`Mesh::MAX_VERTICES`].
pub fn dual_contouring(
    field: &dyn Field,
    grid: &Grid,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Mesh, MeshError> {
    let lattice = Lattice::new(grid);
    let near = Bricks::classify(field, &lattice);
    let mut work = Work::default();
    let sampling = Stage::new(near.near.len().div_ceil(BRICKS_PER_TASK), 0.0..0.5, progress);
    let signs = crossings::sample(field, &lattice, &near, &mut work.evaluations, &|| sampling.advance())?;
    let crossed =
        Crossed::number(&near, &signs, |brick, around| Sheets::find(field, &lattice, brick.low, around));
    let counts = crossed.tasks.iter().map(|task| task.kept.iter().map(|sheets| sheets.vertices).sum());
    let counts: Vec<usize> = counts.collect();
    let found = counts.iter().sum::<usize>().max(crossed.vertices);
    if found > Mesh::MAX_VERTICES {
        return Err(MeshError::TooManyVertices { found });
    }
    let hitting = Stage::new(crossed.tasks.len(), 0.5..1.0, progress);
    let hits = hits(field, &lattice, &crossed, &mut work, &hitting)?;

    let spacing = grid.spacing();
    let size = spacing.min_element();
    let rings = Rings::new(crossed.vertices);
    let scene = Scene {
        field,
        lattice: &lattice,
        signs: &signs,
        crossed: &crossed,
        hits: &hits,
        rings: &rings,
        spacing,
    };
    let (mut vertices, placed) = place(&scene, counts);
    let quads = Quads::join(field, &signs, &crossed, (&hits, &rings), &placed, &mut vertices);
    let mut cut = quads.cut(&vertices);
    let mut fallbacks: Vec<(u32, DVec3)> =
        placed.iter().flat_map(|part| part.fallbacks.iter().copied()).collect();
    for _ in 0..REPAIRS {
        let mut spoilt = std::mem::take(&mut cut.spoilt);
        spoilt.sort_unstable();
        spoilt.dedup();
        spoilt.retain(|&v| {
            let Ok(at) = fallbacks.binary_search_by_key(&v, |&(v, _)| v) else { return false };
            let fallback = &mut fallbacks[at].1;
            if vertices.positions[v as usize] == *fallback {
                return false;
            }
            let settled = project::newton(field, *fallback, size, &mut work.gradients);
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
        quads.cut_again(&vertices, &spoilt, &mut cut);
    }
    work.gradients += cut.gradients + placed.iter().map(|part| part.gradients).sum::<u64>();
    let mut triangles = quads.triangles(cut, &mut vertices);
    triangles.extend(placed.iter().flat_map(|part| &part.tubes));
    let (left, evaluations) = refine::refine(field, &mut vertices, &mut triangles, size);
    work.gradients += evaluations;
    let (place, tolerance) = ((grid.bounds(), size), refine::TOLERANCE * size);
    if mend::is_worth(&left, &triangles) {
        let patch = Patch::new(field, place, &mut vertices, &mut triangles, &left);
        work.gradients += mend::mend(patch, left, tolerance, Aim::Distance);
    }
    if vertices.len() > Mesh::MAX_VERTICES {
        return Err(MeshError::TooManyVertices { found: vertices.len() });
    }
    work.merged = merge(&mut vertices, &mut triangles, TOO_CLOSE * size);
    for _ in 0..REPAIRS {
        let (folded, evaluations) = mend::folded(field, &vertices, &triangles, size);
        work.gradients += evaluations;
        if !mend::is_worth(&folded, &triangles) {
            break;
        }
        let patch = Patch::new(field, place, &mut vertices, &mut triangles, &folded);
        work.gradients += mend::mend(patch, folded, tolerance, Aim::Folds);
        work.merged += merge(&mut vertices, &mut triangles, 0.0);
    }

    let caps = (0..).zip(&vertices.kinds).filter(|(_, kind)| **kind == Kind::Cap).map(|(i, _)| i).collect();
    let Vertices { positions, normals, kinds } = vertices;
    let mut mesh = Mesh { positions, normals, triangles, caps, work };
    let is_unknown = |v: usize| kinds[v] != Kind::Smooth || mesh.normals[v] == DVec3::ZERO;
    let unknown: Vec<u32> = (0..kinds.len()).filter(|&v| is_unknown(v)).map(|v| v as u32).collect();
    normals::add(field, &mut mesh, &unknown);
    Ok(mesh)
}

/// The points of the surface on all crossed edges, and its normals there; on the border the edge's direction instead.
fn hits(
    field: &dyn Field,
    lattice: &Lattice,
    crossed: &Crossed<Sheets>,
    work: &mut Work,
    stage: &Stage<'_>,
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
            || (EdgeScratch::default(), Gradients::default()),
            |(edges, gradients), ((task, positions), normals)| {
                let found = task.place_on_edges(field, lattice, positions, edges)?;
                gradients.normals(field, positions, normals);
                for cap in &found.caps {
                    normals[cap.vertex as usize - task.first] = cap.outward;
                }
                stage.advance();
                Ok(found)
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

/// Places the vertices of all cells, whose number in each task is given.
fn place(scene: &Scene<'_>, counts: Vec<usize>) -> (Vertices, Vec<Placed>) {
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
    let placed = scene
        .crossed
        .tasks
        .par_iter()
        .zip(slots)
        .map_init(place::Scratch::default, |scratch, (task, slots)| scene.place(task, slots, scratch));
    let placed = placed.collect();
    (vertices, placed)
}

/// Vertices on a crease that an edge shorter than this joins are merged, in cells: two cells, or two cut edges, may
/// have come to nearly the same place.
const TOO_CLOSE: f64 = 0.1;

/// Merges vertices that coincide, and ends of edges on creases that are shorter than `too_close`; returns how many.
fn merge(vertices: &mut Vertices, triangles: &mut Vec<[u32; 3]>, too_close: f64) -> u64 {
    let sharp = (0_u32..).zip(&vertices.kinds).filter(|(_, kind)| **kind != Kind::Smooth);
    let bits = |v: u32| vertices.positions[v as usize].to_array().map(f64::to_bits);
    let mut places: Vec<([u64; 3], u32)> = sharp.map(|(v, _)| (bits(v), v)).collect();
    places.sort_unstable();
    let mut is_taken = vec![false; vertices.len()];
    let mut groups: Vec<Vec<u32>> = Vec::new();
    for group in places.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() > 1) {
        groups.push(group.iter().map(|&(_, v)| v).collect());
        group.iter().for_each(|&(_, v)| is_taken[v as usize] = true);
    }
    for t in triangles.iter() {
        let is_sharp = t.map(|v| vertices.kinds[v as usize] == Kind::Sharp);
        for i in (0..3).filter(|&i| is_sharp[i] && is_sharp[(i + 1) % 3]) {
            let pair = [t[i], t[(i + 1) % 3]];
            let [a, b] = pair.map(|v| vertices.positions[v as usize]);
            let is_free = !pair.iter().any(|&v| is_taken[v as usize]);
            if is_free && a.distance(b) < too_close {
                pair.iter().for_each(|&v| is_taken[v as usize] = true);
                groups.push(pair.to_vec());
            }
        }
    }
    let at_nodes = (0..)
        .zip(groups)
        .flat_map(|(place, group)| group.into_iter().map(move |vertex| AtNode { node: place, vertex }))
        .collect();
    let mut mesh = Mesh {
        positions: std::mem::take(&mut vertices.positions),
        normals: std::mem::take(&mut vertices.normals),
        triangles: std::mem::take(triangles),
        ..Mesh::default()
    };
    let lost = collapse::merge_coincident(&mut mesh, at_nodes).unwrap_or_default();
    let mut is_lost = lost.iter();
    vertices.kinds.retain(|_| is_lost.next() != Some(&true));
    (vertices.positions, vertices.normals, *triangles) = (mesh.positions, mesh.normals, mesh.triangles);
    mesh.work.merged
}
