//! Wedges between walls in which no particle finds room, so that nothing presses on the walls.
//!
//! A particle keeps half a spacing from walls, so the wedge below a cylinder that lies on a floor stays empty
//! over √(2Rs) of its way. The load that is missing there is found from points on the surface: those in the
//! fluid's shape that have no particle near, each weighted by its depth. Scenes so large that there are too
//! many points are not looked at.

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::{Body, Experiment};
use crate::Solid;
use crate::diagnostic::{Code, Diagnostic};
use crate::geom::Aabb;
use crate::lower::Gravity;
use crate::sph::Particles;

/// A point has a particle near if one is within this distance, in spacings. On plain walls a lattice that
/// does not fit them leaves 1.5 spacings, and in their corners 1.7.
const NEAR: f64 = 2.0;

/// Missing loads above this part get a warning.
const MUCH: f64 = 0.02;

/// Distances between points, in spacings: the first for which there are not too many.
const STEPS: [f64; 2] = [0.25, 0.5];

/// The most points that are looked at.
const MOST_POINTS: f64 = 2e7;

impl Experiment {
    /// Warnings for bodies on which part of the fluid's load is missing at the start.
    pub(super) fn dry_walls(&self, particles: &Particles) -> Vec<Diagnostic> {
        let fluid = &self.scene.fluid;
        // with a number and a size the shape is only where particles may be placed
        if fluid.particles.is_some() && fluid.size_span.is_some() {
            return Vec::new();
        }
        let spacing = self.parameters.spacing();
        let near = Near::of(particles, spacing);
        let up = match &self.scene.gravity {
            Gravity::Still(gravity) => -gravity.normalize_or_zero(),
            Gravity::Turning(_) | Gravity::Field(_) => DVec3::ZERO,
        };
        let top = particles.position.iter().map(|at| up.dot(at)).fold(f64::NEG_INFINITY, f64::max);
        // without gravity all places count alike
        let load =
            |at: DVec3| if up == DVec3::ZERO { 1.0 } else { (top + 0.5 * spacing - up.dot(at)).max(0.0) };
        self.bodies.iter().filter_map(|body| self.dry_wall(body, &load, &near)).collect()
    }

    fn dry_wall(&self, body: &Body, load: &dyn Fn(DVec3) -> f64, near: &Near<'_>) -> Option<Diagnostic> {
        let (mut all, mut missing) = (0.0, 0.0);
        let mut deepest = (0.0, DVec3::ZERO);
        self.visit_wetted(body, |at| {
            let load = load(at);
            all += load;
            if !near.has(at) {
                missing += load;
                if load > deepest.0 {
                    deepest = (load, at);
                }
            }
        });
        let part = missing / all;
        (part > MUCH).then(|| {
            let spacing = self.parameters.spacing();
            let message = format!(
                "no particle finds room beside `{}` at {}, where the fluid's shape is: at least {:.0} % of the load of a \
                 fluid at rest is missing there",
                body.solid.name(),
                place(deepest.1, spacing),
                100.0 * part
            );
            Diagnostic::warning(Code::DRY_WALL, self.scene.fluid.shape_span, message)
                .help("a smaller spacing leaves less: a quarter of it leaves half where walls touch, and a quarter in a wedge")
        })
    }

    /// Visits points of a lattice that lie in the fluid's shape and outside all bodies, next to one that lies
    /// in `body`.
    fn visit_wetted(&self, body: &Body, mut visit: impl FnMut(DVec3)) {
        let spacing = self.parameters.spacing();
        let Some(shape) = self.fluid.bounds().aabb() else { return };
        let of_body = body.solid.bounds().aabb().map_or(self.scene.domain, |bounds| bounds.grown(spacing));
        let region = shape.intersection(&self.scene.domain).intersection(&of_body);
        let size = region.size();
        if size.cmple(DVec3::ZERO).any() {
            return;
        }
        let counts = |step: f64| (size / (step * spacing)).ceil().max(DVec3::ONE);
        let few = STEPS.into_iter().map(counts).find(|counts| counts.element_product() <= MOST_POINTS);
        let Some(counts) = few else { return };
        let lattice = Lattice { region, counts };
        let meets = |other: &&Body| {
            let bounds = other.solid.bounds().aabb().unwrap_or(self.scene.domain);
            !std::ptr::eq(*other, body) && bounds.intersection(&region).size().cmpge(DVec3::ZERO).all()
        };
        let others: Vec<&Body> = self.bodies.iter().filter(meets).collect();
        let mut planes: [Plane; 3] = Default::default();
        let [nx, ny, nz] = lattice.counts.to_array().map(|n| n as usize);
        for k in 0..=nz {
            planes.rotate_left(1);
            planes[2] = if k < nz { self.plane(body, &others, &lattice, k) } else { Plane::default() };
            if k == 0 {
                continue;
            }
            let [below, own, above] = &planes;
            let inside = |plane: &Plane, n: usize| plane.inside.get(n) == Some(&true);
            for n in (0..nx * ny).filter(|n| own.wet[*n]) {
                let (i, j) = (n % nx, n / nx);
                let beside = [
                    (i > 0, n.wrapping_sub(1)),
                    (i + 1 < nx, n + 1),
                    (j > 0, n.wrapping_sub(nx)),
                    (j + 1 < ny, n + nx),
                ];
                if beside.into_iter().any(|(is_there, n)| is_there && own.inside[n])
                    || inside(below, n)
                    || inside(above, n)
                {
                    visit(lattice.at(i, j, k - 1));
                }
            }
        }
    }

    /// Classifies the points of a plane of the lattice. `others` are the other bodies in the lattice's box.
    fn plane(&self, body: &Body, others: &[&Body], lattice: &Lattice, k: usize) -> Plane {
        let [x, y, z] = lattice.plane(k);
        let mut sign = vec![0.0; x.len()];
        let mut holds = |solid: &Solid| -> Vec<bool> {
            solid.sign_many([&x, &y, &z], &mut sign);
            sign.iter().map(|sign| *sign >= 0.0).collect()
        };
        let (inside, mut wet) = (holds(&body.solid), holds(&self.fluid));
        wet.iter_mut().zip(&inside).for_each(|(wet, inside)| *wet &= !inside);
        for other in others {
            let covered = holds(&other.solid);
            wet.iter_mut().zip(covered).for_each(|(wet, covered)| *wet &= !covered);
        }
        Plane { inside, wet }
    }
}

/// Points in the middles of equal cells that fill a box.
struct Lattice {
    region: Aabb,
    /// Cells along each axis, whole numbers.
    counts: DVec3,
}

impl Lattice {
    fn at(&self, i: usize, j: usize, k: usize) -> DVec3 {
        let index = DVec3::new(i as f64, j as f64, k as f64) + 0.5;
        self.region.min + self.region.size() / self.counts * index
    }

    /// The points of a plane across z, as columns.
    fn plane(&self, k: usize) -> [Vec<f64>; 3] {
        let [nx, ny, _] = self.counts.to_array().map(|n| n as usize);
        let points = (0..nx * ny).map(|n| self.at(n % nx, n / nx, k));
        let mut columns: [Vec<f64>; 3] = Default::default();
        for at in points {
            columns.iter_mut().zip(at.to_array()).for_each(|(column, x)| column.push(x));
        }
        columns
    }
}

/// The points of a plane: those in the body, and those in the fluid's shape and outside all bodies.
#[derive(Default)]
struct Plane {
    inside: Vec<bool>,
    wet: Vec<bool>,
}

/// The particles by cells that are as wide as a particle is near.
struct Near<'a> {
    particles: &'a Particles,
    width: f64,
    cells: FxHashMap<[i64; 3], Vec<u32>>,
}

impl<'a> Near<'a> {
    fn of(particles: &'a Particles, spacing: f64) -> Self {
        let width = NEAR * spacing;
        let mut cells: FxHashMap<[i64; 3], Vec<u32>> = FxHashMap::default();
        for (i, at) in particles.position.iter().enumerate() {
            cells.entry(cell(at, width)).or_default().push(i as u32);
        }
        Self { particles, width, cells }
    }

    /// Whether a particle is near a point.
    fn has(&self, at: DVec3) -> bool {
        let [x, y, z] = cell(at, self.width);
        let beside = (0..27).map(|n| [x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1]);
        let near =
            |i: &u32| self.particles.position.get(*i as usize).distance_squared(at) <= self.width.powi(2);
        beside.filter_map(|cell| self.cells.get(&cell)).any(|cell| cell.iter().any(near))
    }
}

/// A place with digits fine enough to show tenths of the spacing.
fn place(at: DVec3, spacing: f64) -> String {
    let digits = (1.0 - spacing.log10()).ceil().clamp(0.0, 9.0) as usize;
    let unit = 10_f64.powi(digits as i32);
    // rounded first, so that zero has no sign
    let [x, y, z] = at.to_array().map(|x| format!("{:.digits$}", (unit * x).round() / unit + 0.0));
    format!("[{x}, {y}, {z}]")
}

/// The cell of a point.
fn cell(at: DVec3, width: f64) -> [i64; 3] {
    (at / width).to_array().map(|x| x.floor() as i64)
}
