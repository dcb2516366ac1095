//! The distance between a mesh and the surface that it stands for, both ways; the direction and the shape of
//! its triangles.
//!
//! From the mesh to the surface: points are spread over every triangle, and Newton's method moves each of
//! them to the surface. The way that it goes is at least its distance. From the surface to the mesh: points
//! of the surface, with those on creases and corners, come from a mesh in half the cells. Each has its exact
//! distance from the nearest triangle. The larger of the two maxima is the Hausdorff distance, as far as
//! samples show.
//!
//! Invariant: the samples depend on the mesh, the field and the grid alone; sums are taken in their order.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use rayon::prelude::*;
use rstar::{AABB, PointDistance, RTree, RTreeObject};
use serde::ser::{Serialize, SerializeStruct, Serializer};

use super::{
    Grid, Mesh, MeshError, Resolution, dual_contouring,
    normals::{gradients, unit},
    shells,
};
use crate::field::Field;
use crate::mesh::watch::{Stretch, Unwatched, Watch};

/// Distances of many samples in metres, or angles of many samples in degrees.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Distances {
    /// The largest.
    pub max: f64,
    /// The root of the mean square.
    pub rms: f64,
    /// The number of samples.
    pub samples: usize,
}

/// The quality of a mesh of a field's surface.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Quality {
    /// From points of the mesh to the surface. Caps at the grid's border are left out.
    pub to_surface: Distances,
    /// From points of the surface to the mesh.
    pub from_surface: Distances,
    /// The angle between a triangle and the surface below its middle, in degrees.
    pub normal_error: Distances,
    /// The volume over that of the solid, less 1. The latter is extrapolated from dual contouring in the grid's cells and
    /// in cells half as large, whose error is a quarter of that (Richardson 1911). Where there are no such cells, or the
    /// meshes differ by more than a tenth, that of the finer mesh stands for it.
    pub volume_error: f64,
    /// The area over that of the solid, less 1, found in the same way.
    pub area_error: f64,
    /// The number of triangles that face away from the surface below their middles.
    pub flipped: usize,
    /// The smallest angle of any triangle, in degrees.
    pub min_angle: f64,
    /// The smallest radius ratio. The ratio is twice a triangle's inner radius over its outer one: 1 for an
    /// equilateral triangle, 0 for one without area.
    pub min_radius_ratio: f64,
    /// The mean radius ratio.
    pub mean_radius_ratio: f64,
    /// The share of the triangles whose radius ratio is below 0.1.
    pub slivers: f64,
    /// The share of the samples that were measured both ways: 1, unless the watch ended the work. Then the largest
    /// distances and angles are at least those found until then, and more triangles may be flipped.
    pub measured: f64,
}

impl Quality {
    /// The Hausdorff distance in metres, as far as samples show: the larger of the largest distances
    /// both ways.
    pub fn hausdorff(&self) -> f64 {
        self.to_surface.max.max(self.from_surface.max)
    }
}

/// Serialises as one flat object that begins with the Hausdorff distance.
impl Serialize for Quality {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = serializer.serialize_struct("Quality", 16)?;
        object.serialize_field("hausdorff", &self.hausdorff())?;
        object.serialize_field("mesh_to_surface_max", &self.to_surface.max)?;
        object.serialize_field("mesh_to_surface_rms", &self.to_surface.rms)?;
        object.serialize_field("surface_to_mesh_max", &self.from_surface.max)?;
        object.serialize_field("surface_to_mesh_rms", &self.from_surface.rms)?;
        object.serialize_field("samples", &(self.to_surface.samples + self.from_surface.samples))?;
        object.serialize_field("normal_error_max", &self.normal_error.max)?;
        object.serialize_field("normal_error_rms", &self.normal_error.rms)?;
        object.serialize_field("volume_error", &self.volume_error)?;
        object.serialize_field("area_error", &self.area_error)?;
        object.serialize_field("flipped", &self.flipped)?;
        object.serialize_field("min_angle", &self.min_angle)?;
        object.serialize_field("min_radius_ratio", &self.min_radius_ratio)?;
        object.serialize_field("mean_radius_ratio", &self.mean_radius_ratio)?;
        object.serialize_field("slivers", &self.slivers)?;
        object.serialize_field("measured", &self.measured)?;
        object.end()
    }
}

/// Intervals between sample points along a triangle's side. With sides of a cell, neighbours are a fifth of
/// it apart.
const SPREAD: usize = 5;

/// Triangles or points in a batch.
const BATCH: usize = 256;

/// A triangle with a smaller radius ratio has no direction.
const NO_DIRECTION: f64 = 1e-6;

/// The part that making the finer mesh takes of the time for a [`Reference`], for the progress of it.
const MESHING: f64 = 0.8;

/// Meshes whose volumes or areas differ by more than this part of them do not show the same solid.
const ALIKE: f64 = 0.1;

/// The part of that for the mesh in the grid's own cells.
const COARSER: f64 = 0.2;

/// The part that the way from the mesh to the surface takes of the time to measure, for the progress of it.
const THERE: f64 = 0.8;

/// A surface against which meshes of it are measured.
pub struct Reference<'a> {
    distance: &'a dyn Field,
    /// Points all over the surface.
    points: Vec<DVec3>,
    /// The volume and the area of the solid, extrapolated.
    extent: (f64, f64),
}

impl<'a> Reference<'a> {
    /// Prepares to measure meshes of `field` in `grid`. `distance` must have the surface of `field`, and near
    /// it ω must be the distance from it or nearly so. Newton's method then finds the nearest face, while
    /// parts of unlike scale would mislead it.
    ///
    /// # Errors
    /// Those of [`dual_contouring`] in this grid and in the finer one that gives points of the surface, also if the watch ends the work
    /// on these points.
    pub fn new(
        field: &dyn Field,
        distance: &'a dyn Field,
        grid: &Grid,
        watch: &dyn Watch,
    ) -> Result<Self, MeshError> {
        let finer = Grid::filling(grid.bounds(), Resolution::Spacing(0.5 * grid.spacing().min_element()));
        // sides that are no multiples of a cell may have one more
        let is_half = |(count, own): (usize, usize)| count.abs_diff(2 * own) <= 1.max(own / 16);
        let is_halved =
            finer.as_ref().is_ok_and(|finer| finer.cells().into_iter().zip(grid.cells()).all(is_half));
        let meshing = Stretch { watch, from: 0.0, to: MESHING };
        let [first, rest] =
            [(0.0, COARSER), (COARSER, 1.0)].map(|(from, to)| Stretch { watch: &meshing, from, to });
        let coarser = extent(&dual_contouring(field, grid, &first)?);
        let finer = dual_contouring(field, finer.as_ref().unwrap_or(grid), &rest)?;
        let moving = Stretch { watch, from: MESHING, to: 1.0 };
        let points = surface_points(&finer, distance, grid, &moving).ok_or(MeshError::Ended)?;
        let finer = extent(&finer);
        // the error goes with the square of the cells, unless they are too large for a part of the solid
        let limit = |coarser: f64, finer: f64| {
            let is_resolved = (finer - coarser).abs() <= ALIKE * finer;
            if is_halved && is_resolved { finer + (finer - coarser) / 3.0 } else { finer }
        };
        Ok(Self { distance, points, extent: (limit(coarser.0, finer.0), limit(coarser.1, finer.1)) })
    }

    /// The distance from a mesh of the farthest one of some points of the surface, in metres: no more than
    /// [`Quality::hausdorff`], and found in a small part of the time. For a mesh without triangles it is 0.
    pub fn least_distance(&self, mesh: &Mesh) -> f64 {
        let some: Vec<DVec3> = self.points.iter().step_by(PER_SAMPLE).copied().collect();
        if mesh.triangles.is_empty() { 0.0 } else { surface_to_mesh(mesh, &some, &Unwatched).0.max }
    }

    /// Measures a mesh of the surface. For a mesh without triangles all distances are 0. If the watch ends the work, the
    /// samples taken until then count, see [`Quality::measured`].
    pub fn measure(&self, mesh: &Mesh, watch: &dyn Watch) -> Quality {
        let mut quality = shapes(mesh);
        if mesh.triangles.is_empty() {
            return quality;
        }
        let own = extent(mesh);
        quality.volume_error = own.0 / self.extent.0 - 1.0;
        quality.area_error = own.1 / self.extent.1 - 1.0;
        let (there, back) =
            (Stretch { watch, from: 0.0, to: THERE }, Stretch { watch, from: THERE, to: 1.0 });
        let measured_there = mesh_to_surface(mesh, self.distance, &mut quality, &there);
        let (from_surface, measured_back) = surface_to_mesh(mesh, &self.points, &back);
        quality.from_surface = from_surface;
        quality.measured = measured_there.min(measured_back);
        quality
    }
}

/// Measures one mesh of `field` in `grid`. Several meshes of one surface are measured faster with
/// a [`Reference`].
///
/// # Errors
/// Those of [`Reference::new`].
pub fn measure(
    mesh: &Mesh,
    field: &dyn Field,
    distance: &dyn Field,
    grid: &Grid,
) -> Result<Quality, MeshError> {
    Ok(Reference::new(field, distance, grid, &Unwatched)?.measure(mesh, &Unwatched))
}

/// Points of the surface for each that [`Reference::least_distance`] looks at: where a mesh is too coarse it is so in many
/// places.
const PER_SAMPLE: usize = 16;

/// The volume and the area of a mesh.
fn extent(mesh: &Mesh) -> (f64, f64) {
    shells(mesh).iter().fold((0.0, 0.0), |sum, shell| (sum.0 + shell.volume, sum.1 + shell.area))
}

fn corners(mesh: &Mesh, triangle: [u32; 3]) -> [DVec3; 3] {
    triangle.map(|v| mesh.positions[v as usize])
}

fn shapes(mesh: &Mesh) -> Quality {
    let shapes: Vec<(f64, f64)> = mesh
        .triangles
        .par_iter()
        .map(|&t| (radius_ratio(corners(mesh, t)), min_angle(corners(mesh, t))))
        .collect();
    let count = shapes.len().max(1) as f64;
    Quality {
        min_angle: shapes.iter().fold(60.0, |min, shape| min.min(shape.1)),
        min_radius_ratio: shapes.iter().fold(1.0, |min, shape| min.min(shape.0)),
        mean_radius_ratio: shapes.iter().fold(0.0, |sum, shape| sum + shape.0) / count,
        slivers: shapes.iter().filter(|shape| shape.0 < 0.1).count() as f64 / count,
        measured: 1.0,
        ..Quality::default()
    }
}

/// The radius ratio 2r/R = 16A²/((a + b + c)·abc) of a triangle with the sides a, b, c and the area A.
fn radius_ratio([p, q, r]: [DVec3; 3]) -> f64 {
    let (a, b, c) = (q.distance(r), r.distance(p), p.distance(q));
    let twice_area = (q - p).cross(r - p).length();
    let below = (a + b + c) * a * b * c;
    if below > 0.0 { 4.0 * twice_area * twice_area / below } else { 0.0 }
}

/// The smallest angle in degrees; 0 where two corners coincide.
fn min_angle(corners: [DVec3; 3]) -> f64 {
    let angle = |i: usize| {
        let (u, v) = (corners[(i + 1) % 3] - corners[i], corners[(i + 2) % 3] - corners[i]);
        u.cross(v).length().atan2(u.dot(v)).to_degrees()
    };
    angle(0).min(angle(1)).min(angle(2))
}

/// Sums over samples.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    max: f64,
    squares: f64,
    samples: usize,
}

impl Sums {
    fn add(&mut self, value: f64) {
        self.max = self.max.max(value);
        self.squares += value * value;
        self.samples += 1;
    }

    fn join(parts: impl Iterator<Item = Self>) -> Distances {
        let all = parts.fold(Self::default(), |all, part| Self {
            max: all.max.max(part.max),
            squares: all.squares + part.squares,
            samples: all.samples + part.samples,
        });
        Distances {
            max: all.max,
            rms: (all.squares / all.samples.max(1) as f64).sqrt(),
            samples: all.samples,
        }
    }
}

/// Points of a triangle: the middle, then others that are spread over it and its border.
fn spread([a, b, c]: [DVec3; 3]) -> impl Iterator<Item = DVec3> {
    let n = SPREAD;
    let lattice = (0..=n).flat_map(move |i| {
        (0..=n - i).map(move |j| (a * (n - i - j) as f64 + b * i as f64 + c * j as f64) / n as f64)
    });
    std::iter::once((a + b + c) / 3.0).chain(lattice)
}

/// Measures from the mesh to the surface. Returns the share of the triangles that were measured.
fn mesh_to_surface(mesh: &Mesh, field: &dyn Field, quality: &mut Quality, watch: &dyn Watch) -> f64 {
    let share = Share::of(mesh.triangles.len(), watch);
    let is_cap = |t: &[u32; 3]| t.iter().any(|v| mesh.caps.binary_search(v).is_ok());
    let parts: Vec<(Sums, Sums, usize)> = mesh
        .triangles
        .par_chunks(BATCH)
        .map(|triangles| {
            if watch.is_over() {
                return Default::default();
            }
            let each_batch = triangles.len();
            let triangles: Vec<[DVec3; 3]> =
                triangles.iter().filter(|t| !is_cap(t)).map(|&t| corners(mesh, t)).collect();
            let points: Vec<DVec3> = triangles.iter().flat_map(|&t| spread(t)).collect();
            let feet = feet(field, &points);
            let (mut distances, mut angles, mut flipped) = (Sums::default(), Sums::default(), 0);
            let each = points.len() / triangles.len().max(1);
            for (t, triangle) in triangles.iter().enumerate() {
                let [a, b, c] = *triangle;
                let facing = unit((b - a).cross(c - a)).filter(|_| radius_ratio(*triangle) > NO_DIRECTION);
                for i in t * each..(t + 1) * each {
                    distances.add(feet[i].position.distance(points[i]));
                    let (Some(facing), Some(normal)) = (facing, feet[i].normal) else { continue };
                    if i == t * each {
                        angles.add(facing.angle_between(normal).to_degrees());
                        flipped += usize::from(facing.dot(normal) < 0.0);
                    }
                }
            }
            share.add(each_batch);
            (distances, angles, flipped)
        })
        .collect();
    quality.to_surface = Sums::join(parts.iter().map(|part| part.0));
    quality.normal_error = Sums::join(parts.iter().map(|part| part.1));
    quality.flipped = parts.iter().map(|part| part.2).sum();
    share.part()
}

/// A point of the surface, with the outward unit normal that the distance has where the search began. That is
/// the normal of the nearest point, while in a narrow gap the search may end on the other wall.
#[derive(Debug, Clone, Copy)]
struct Foot {
    position: DVec3,
    normal: Option<DVec3>,
}

/// Maximum number of Newton steps. A point beside a crease jumps between its faces, nearer each time.
const STEPS: usize = 24;

/// The points of the surface to which Newton's method leads.
fn feet(field: &dyn Field, points: &[DVec3]) -> Vec<Foot> {
    let mut feet: Vec<Foot> = points.iter().map(|&position| Foot { position, normal: None }).collect();
    let mut moving: Vec<usize> = (0..points.len()).collect();
    for _ in 0..STEPS {
        let at: Vec<DVec3> = moving.iter().map(|&i| feet[i].position).collect();
        let mut found = gradients(field, &at).into_iter();
        moving.retain(|&i| {
            let Some((omega, gradient)) = found.next() else { return false };
            let step = gradient * (omega / gradient.length_squared());
            if !step.is_finite() {
                return false;
            }
            let foot = &mut feet[i];
            foot.position -= step;
            foot.normal = foot.normal.or(unit(-gradient));
            step.length()
                > 1e-9 * foot.position.distance(points[i]) + f64::EPSILON * points[i].abs().max_element()
        });
        if moving.is_empty() {
            break;
        }
    }
    feet
}

/// Points all over the surface and on its creases and corners, about half a cell apart, from a mesh of it; `None` if the
/// work was ended before.
fn surface_points(mesh: &Mesh, distance: &dyn Field, grid: &Grid, watch: &dyn Watch) -> Option<Vec<DVec3>> {
    let mut points = Vec::with_capacity(2 * mesh.positions.len());
    let caps: std::collections::HashSet<u32> = mesh.caps.iter().copied().collect();
    points.extend((0_u32..).zip(&mesh.positions).filter(|(v, _)| !caps.contains(v)).map(|(_, p)| *p));
    let middles: Vec<DVec3> = mesh
        .triangles
        .iter()
        .filter(|t| !t.iter().any(|v| caps.contains(v)))
        .map(|&t| corners(mesh, t).iter().sum::<DVec3>() / 3.0)
        .collect();
    let share = Share::of(middles.len(), watch);
    let parts: Option<Vec<Vec<Foot>>> = middles
        .par_chunks(BATCH)
        .map(|part| {
            if watch.is_over() {
                return None;
            }
            let found = feet(distance, part);
            share.add(part.len());
            Some(found)
        })
        .collect();
    let parts = parts?;
    points.extend(parts.iter().flatten().map(|foot| foot.position));
    // a point that Newton's method lost says nothing
    points.retain(|p| p.is_finite() && grid.bounds().contains(*p));
    Some(points)
}

/// How much of some work is done, for those who wait for it.
struct Share<'a> {
    all: usize,
    done: AtomicUsize,
    watch: &'a dyn Watch,
}

impl<'a> Share<'a> {
    fn of(all: usize, watch: &'a dyn Watch) -> Self {
        Self { all, done: AtomicUsize::new(0), watch }
    }

    fn add(&self, more: usize) {
        let done = self.done.fetch_add(more, Ordering::Relaxed) + more;
        self.watch.progress(done as f64 / self.all.max(1) as f64);
    }

    /// The part of the work that is done; all of it if there is none.
    fn part(&self) -> f64 {
        if self.all == 0 { 1.0 } else { self.done.load(Ordering::Relaxed) as f64 / self.all as f64 }
    }
}

/// A triangle in the spatial index.
struct IndexedTriangle([DVec3; 3]);

impl RTreeObject for IndexedTriangle {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        let [a, b, c] = self.0;
        AABB::from_corners(a.min(b).min(c).to_array(), a.max(b).max(c).to_array())
    }
}

impl PointDistance for IndexedTriangle {
    fn distance_2(&self, point: &[f64; 3]) -> f64 {
        let p = DVec3::from_array(*point);
        p.distance_squared(nearest_point(self.0, p))
    }
}

/// The distances of points of the surface from the mesh, and the share of the points that were measured.
fn surface_to_mesh(mesh: &Mesh, points: &[DVec3], watch: &dyn Watch) -> (Distances, f64) {
    let share = Share::of(points.len(), watch);
    let index = RTree::bulk_load(mesh.triangles.iter().map(|&t| IndexedTriangle(corners(mesh, t))).collect());
    let parts: Vec<Sums> = points
        .par_chunks(BATCH)
        .map(|points| {
            let mut sums = Sums::default();
            if watch.is_over() {
                return sums;
            }
            for p in points {
                let nearest = index.nearest_neighbor(p.to_array());
                sums.add(nearest.map_or(f64::INFINITY, |t| t.distance_2(&p.to_array()).sqrt()));
            }
            share.add(points.len());
            sums
        })
        .collect();
    (Sums::join(parts.into_iter()), share.part())
}

/// The point of a triangle nearest to `p`. It lies inside, on a side or in a corner.
pub(super) fn nearest_point([a, b, c]: [DVec3; 3], p: DVec3) -> DVec3 {
    let normal = (b - a).cross(c - a);
    let above = |from: DVec3, to: DVec3| normal.dot((to - from).cross(p - from)) >= 0.0;
    if normal != DVec3::ZERO && above(a, b) && above(b, c) && above(c, a) {
        return p - normal * (normal.dot(p - a) / normal.length_squared());
    }
    let on_side = |from: DVec3, to: DVec3| {
        let way = to - from;
        let share = way.dot(p - from) / way.length_squared();
        from + way * if share > 0.0 { share.min(1.0) } else { 0.0 }
    };
    let sides = [on_side(a, b), on_side(b, c), on_side(c, a)];
    sides.into_iter().min_by(|q, r| p.distance_squared(*q).total_cmp(&p.distance_squared(*r))).unwrap_or(a)
}

#[cfg(test)]
mod tests;
