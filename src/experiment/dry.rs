//! Wedges between walls in which no particle finds room, so that nothing presses on the walls.
//!
//! A particle keeps half a spacing from walls, so the wedge below a cylinder that lies on a floor stays empty
//! over √(2Rs) of its way. The load that is missing there is found from points on the surface: those in the
//! fluid's shape beside which no particle has room, or near which there is none at the start, each weighted by its
//! depth. Scenes so large that there are too many points are not looked at.

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

/// A particle has room where everything nearer than this is free, and is beside a wall up to that distance from it, in
/// spacings. In an edge of 60° the nearest place with room is one away.
const ROOM: f64 = 0.5;
const BESIDE: f64 = 1.0;

/// Squares of whole numbers that differ by less than this are the same.
const ROUNDING: f64 = 1e-6;

/// Missing loads above this part get a warning.
const MUCH: f64 = 0.02;

/// Distances between points, in spacings: the first for which there are not too many. The last is too coarse to see where a
/// particle has room, so that only those at the start count.
const STEPS: [f64; 3] = [1.0 / 6.0, 1.0 / 3.0, 0.5];

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
        let mut surroundings = Surroundings::of(self, body)?;
        let (mut all, mut missing, mut force) = (0.0, 0.0, DVec3::ZERO);
        let mut deepest = (0.0, DVec3::ZERO);
        for n in 0..surroundings.inside.len() {
            let Some(area) = surroundings.area(n) else { continue };
            let at = surroundings.lattice.at(n);
            let load = load(at);
            all += load;
            if !near.has(at) || !surroundings.has_room_near(n) {
                missing += load;
                force += load * area;
                if load > deepest.0 {
                    deepest = (load, at);
                }
            }
        }
        let part = missing / all;
        (part > MUCH).then(|| {
            let spacing = self.parameters.spacing();
            let newtons = match &self.scene.gravity {
                Gravity::Still(gravity) => self.scene.fluid.density * gravity.length() * force.length(),
                Gravity::Turning(_) | Gravity::Field(_) => 0.0,
            };
            let newtons = match newtons > 0.0 {
                true => format!(", a force of {} N", rounded(newtons)),
                false => String::new(),
            };
            let message = format!(
                "no particle finds room beside `{}` at {}, where the fluid's shape is: at least {:.0} % of the load of a \
                 fluid at rest is missing there{newtons}",
                body.solid.name(),
                place(deepest.1, spacing),
                100.0 * part
            );
            Diagnostic::warning(Code::DRY_WALL, self.scene.fluid.shape_span, message)
                .help("a smaller spacing leaves less: a quarter of it leaves half where walls touch, and a quarter in a wedge")
        })
    }
}

/// What lies at the points of a lattice around a body.
struct Surroundings {
    lattice: Lattice,
    /// In the body.
    inside: Vec<bool>,
    /// In the box, and outside all bodies.
    free: Vec<bool>,
    /// Free, and in the fluid's shape.
    wet: Vec<bool>,
    /// Whether a particle has room at a free point, where that was asked.
    room: Vec<Option<bool>>,
    /// From a point to those that must be free where a particle has room, and to those at which one is beside it.
    of_particle: Vec<[i64; 3]>,
    beside: Vec<[i64; 3]>,
}

impl Surroundings {
    /// The surroundings of a body; `None` if the fluid's shape does not meet it, or if there would be too many points.
    fn of(experiment: &Experiment, body: &Body) -> Option<Self> {
        let (spacing, domain) = (experiment.parameters.spacing(), experiment.scene.domain);
        let shape = experiment.fluid.bounds().aabb().unwrap_or(domain);
        let of_body = body.solid.bounds().aabb().map_or(domain, |bounds| bounds.grown(spacing));
        let region = shape.intersection(&domain).intersection(&of_body);
        if region.size().cmple(DVec3::ZERO).any() {
            return None;
        }
        let region = region.grown((BESIDE + ROOM) * spacing);
        let lattice_of =
            |step: f64| Lattice { region, counts: (region.size() / (step * spacing)).ceil().max(DVec3::ONE) };
        let few = |step: &f64| lattice_of(*step).counts.element_product() <= MOST_POINTS;
        let step = STEPS.into_iter().find(few)?;
        let lattice = lattice_of(step);
        let meets = |other: &&Body| {
            let bounds = other.solid.bounds().aabb().unwrap_or(domain);
            !std::ptr::eq(*other, body) && bounds.intersection(&region).size().cmpge(DVec3::ZERO).all()
        };
        let others: Vec<&Body> = experiment.bodies.iter().filter(meets).collect();
        let (mut inside, mut free, mut wet) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..lattice.counts.z as usize {
            let [x, y, z] = lattice.plane(k);
            let mut sign = vec![0.0; x.len()];
            let mut holds = |solid: &Solid| -> Vec<bool> {
                solid.sign_many([&x, &y, &z], &mut sign);
                sign.iter().map(|sign| *sign >= 0.0).collect()
            };
            let in_body = holds(&body.solid);
            let mut is_free: Vec<bool> =
                (0..x.len()).map(|n| !in_body[n] && domain.contains(DVec3::new(x[n], y[n], z[n]))).collect();
            for other in &others {
                let covered = holds(&other.solid);
                is_free.iter_mut().zip(covered).for_each(|(free, covered)| *free &= !covered);
            }
            let in_shape = holds(&experiment.fluid);
            wet.extend(in_shape.iter().zip(&is_free).map(|(wet, free)| *wet && *free));
            inside.extend(in_body);
            free.extend(is_free);
        }
        let room = vec![None; free.len()];
        let beside = ball(BESIDE / step);
        // a place with room lies between points, too, so that one at the very distance may be a wall
        let nearer = |step_to: &[i64; 3]| length_squared(step_to) < (ROOM / step).powi(2) - ROUNDING;
        let of_particle = beside.iter().copied().filter(nearer).collect();
        Some(Self { lattice, inside, free, wet, room, of_particle, beside })
    }

    /// The faces between a wet point and the body, m², as a vector into the body; `None` if there are none.
    fn area(&self, n: usize) -> Option<DVec3> {
        if !self.wet[n] {
            return None;
        }
        let (mut area, mut is_beside) = (DVec3::ZERO, false);
        let cell = self.lattice.region.size() / self.lattice.counts;
        for axis in 0..3 {
            for way in [-1, 1] {
                let mut step = [0; 3];
                step[axis] = way;
                if self.lattice.beside(n, step).is_some_and(|other| self.inside[other]) {
                    is_beside = true;
                    area[axis] += way as f64 * cell.element_product() / cell[axis];
                }
            }
        }
        is_beside.then_some(area)
    }

    /// Whether a particle has room so near to a point that it is beside it.
    fn has_room_near(&mut self, n: usize) -> bool {
        (0..self.beside.len()).any(|k| {
            self.lattice
                .beside(n, self.beside[k])
                .is_some_and(|other| self.free[other] && self.has_room(other))
        })
    }

    fn has_room(&mut self, n: usize) -> bool {
        let Self { lattice, free, of_particle, .. } = self;
        *self.room[n].get_or_insert_with(|| {
            of_particle.iter().all(|step| lattice.beside(n, *step).is_none_or(|other| free[other]))
        })
    }
}

/// The steps to all points within a distance, in units of the lattice, the shortest first.
fn ball(radius: f64) -> Vec<[i64; 3]> {
    let most = radius.floor() as i64;
    let sides = || -most..=most;
    let all = sides().flat_map(|x| sides().flat_map(move |y| sides().map(move |z| [x, y, z])));
    let mut steps: Vec<[i64; 3]> = all.filter(|step| length_squared(step) <= radius * radius).collect();
    steps.sort_by(|a, b| length_squared(a).total_cmp(&length_squared(b)));
    steps
}

fn length_squared(step: &[i64; 3]) -> f64 {
    step.iter().map(|n| n * n).sum::<i64>() as f64
}

/// Points in the middles of equal cells that fill a box.
struct Lattice {
    region: Aabb,
    /// Cells along each axis, whole numbers.
    counts: DVec3,
}

impl Lattice {
    fn sides(&self) -> [usize; 3] {
        self.counts.to_array().map(|n| n as usize)
    }

    fn at(&self, n: usize) -> DVec3 {
        let [nx, ny, _] = self.sides();
        let index = DVec3::new((n % nx) as f64, (n / nx % ny) as f64, (n / (nx * ny)) as f64) + 0.5;
        self.region.min + self.region.size() / self.counts * index
    }

    /// The point that lies so many steps from another one; `None` beyond the border.
    fn beside(&self, n: usize, step: [i64; 3]) -> Option<usize> {
        let [nx, ny, nz] = self.sides();
        let at = [n % nx, n / nx % ny, n / (nx * ny)];
        let mut there = [0; 3];
        for axis in 0..3 {
            there[axis] = at[axis].checked_add_signed(step[axis] as isize)?;
        }
        let [i, j, k] = there;
        (i < nx && j < ny && k < nz).then_some(i + nx * (j + ny * k))
    }

    /// The points of a plane across z, as columns.
    fn plane(&self, k: usize) -> [Vec<f64>; 3] {
        let [nx, ny, _] = self.sides();
        let points = (0..nx * ny).map(|n| self.at(n + nx * ny * k));
        let mut columns: [Vec<f64>; 3] = Default::default();
        for at in points {
            columns.iter_mut().zip(at.to_array()).for_each(|(column, x)| column.push(x));
        }
        columns
    }
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

/// A number with two digits.
fn rounded(number: f64) -> f64 {
    format!("{number:.1e}").parse().unwrap_or(number)
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
