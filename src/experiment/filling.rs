//! Fills the shape of a fluid with particles so that they have its mass.
//!
//! A lattice seldom divides a shape. Its cells are therefore fitted: in a box that the fluid fills they are
//! stretched along each axis so that whole layers reach from face to face, and where a number of particles is
//! stated, some rows hold one more than the others ([`Rows`]). Elsewhere they are stretched to fit several
//! levels ([`Chords`]), or their size is varied until their number times their volume is that of the fluid,
//! or the stated number of sites is taken, the deepest. What is left of the difference goes into the mass of
//! the particles: m = ρ₀·V/N, with the volume V of the shape in the box and outside all bodies.
//!
//! A fluid without a surface that must not be compressed is packed once it is placed, and loses some of its mass: see
//! [`Parameters::fills_vessel`](crate::sph::Parameters::fills_vessel).
//!
//! A scene that states both the number of particles and their size has no such freedom. It is filled from
//! below or from the middle, as it states.

use glam::DVec3;
use smallvec::SmallVec;

use super::{
    Experiment,
    layers::{Chords, Layers},
    refuse,
    room::{LEAST_ROOM, part_in_box, quick_field, quick_fields},
};
use crate::compile::Error;
use crate::diagnostic::{Code, Diagnostic};
use crate::field::{Field, Region};
use crate::geom::Aabb;
use crate::lower::Scene;
use crate::sph::{Carved, FluidBlock, FluidShape, Obstacle, Particles, Rows, carve, carve_cells, make_room};
use crate::{Engine, Program, Solid};

/// Least distance of particles from obstacles at the start, over the spacing.
const CLEARANCE: f64 = 0.5;

/// Difference between the volume of a fluid and that of its cells at which the search for a spacing ends.
const GOOD_ENOUGH: f64 = 1e-3;

/// Masses of a particle that differ by less than this part cannot be distinguished from errors of the volume.
const SAME: f64 = 3e-4;

/// Maximum number of lattices that are tried for one shape.
const TRIALS: usize = 8;

/// Stretched cells are used only if they put at least this part of the fluid into a better place than cubes
/// do.
const WORTH_STRETCHING: f64 = 0.01;

/// Where a number of particles is stated and the other sites stay vacant: the search for a better lattice
/// goes on if at least this part of the sites is vacant.
const MANY_VACANCIES: f64 = 0.02;

/// Largest change of a particle's mass or of the spacing that counts as rounding of the lattice. Larger
/// changes are not made.
const TOO_FAR: f64 = 0.1;

/// A fluid at the start.
pub(super) struct Filling {
    pub particles: Particles,
    /// What carving removed.
    pub carved: Carved,
    /// Mass of a particle, kg.
    pub mass: f64,
    /// Volume of the fluid's shape in the box and outside all bodies, m³; `None` if it does not count.
    pub volume: Option<f64>,
    /// Whether that is all the room that there is around it, for a fluid that must not be compressed.
    pub fills_vessel: bool,
}

/// Where particles may be placed.
#[derive(Clone, Copy)]
enum Sites {
    /// On a lattice with the stated spacing.
    Stated,
    /// On a lattice with cells of this size, m.
    Cells(DVec3),
    /// The wanted number of sites of a lattice with cells of this size, m, taken where the shape is deepest.
    Deepest(DVec3, usize),
    /// In rows that fill a box.
    Rows(Rows),
}

/// Particles on a lattice, what was carved, and the size of the lattice's cells, m.
type Placed = (Particles, Carved, DVec3);

/// The spacing of the particles of a scene at rest, m: the cube root of a particle's volume.
///
/// # Errors
/// [`Error::Codegen`] if the engine is not available.
pub fn spacing(program: &Program, scene: &Scene, engine: Engine) -> Result<f64, Error> {
    let fluid = program.compile(&scene.fluid.name, scene.fluid.shape, engine)?;
    let mass = mass_by_number(scene, &fluid).unwrap_or(scene.fluid.mass);
    Ok((mass / scene.fluid.density).cbrt())
}

/// The mass of a particle, kg, for a scene that states a number of them and not how large they are; `None` for
/// other scenes.
pub(super) fn mass_by_number(scene: &Scene, shape: &Solid) -> Option<f64> {
    let number = scene.fluid.particles.filter(|_| scene.fluid.size_span.is_none())?;
    let within = part_in_box(shape, &scene.domain)?;
    let shape = quick_field(shape, within);
    let volume = Region { shape: &*shape, bodies: Vec::new(), within }.volume();
    (volume > 0.0 && volume.is_finite()).then(|| scene.fluid.density * volume / number as f64)
}

impl Experiment {
    /// Places the particles.
    pub(super) fn fill(&self, obstacles: &[Obstacle]) -> Result<Filling, Error> {
        let fluid = &self.scene.fluid;
        let mass = self.parameters.particle_mass;
        let within = self.reach()?.intersection(&self.scene.domain);
        let as_stated = || {
            let (particles, carved) = self.place(obstacles, Sites::Stated, fluid.particles, None)?;
            Ok(Filling { particles, carved, mass, volume: None, fills_vessel: false })
        };
        if fluid.particles.is_some() && fluid.size_span.is_some() {
            return as_stated();
        }
        let quick = quick_fields(self.bodies.iter().map(|body| &body.solid), within);
        let bodies = quick.iter().map(|field| &**field as &dyn Field).collect();
        let shape = quick_field(&self.fluid, within);
        let volume = Region { shape: &*shape, bodies, within }.volume();
        let is_measured = volume > 0.0 && volume.is_finite();
        if !is_measured {
            // a shape too thin for its volume to be found may still hold sites of a lattice
            return as_stated();
        }
        // other methods do not ask, and many bodies take time
        let fills_vessel = self.parameters.keeps_density()
            && (self.has_no_more_room(&within, LEAST_ROOM * volume)
                || self.fills_its_chamber(&within, volume));
        let alone = Region { shape: &*shape, bodies: Vec::new(), within }.volume();
        let taken = (alone - volume).max(0.0);
        let (mut particles, mut carved, cell) = self.fit(obstacles, within, volume, taken)?;
        if let Some(number) = fluid.particles {
            particles = thinned(&particles, number);
            carved.kept = particles.len();
        }
        let fitted = fluid.density * volume / particles.len() as f64;
        // a fluid of a few particles is not a lattice, and the volume itself is known to a part in ten thousand
        let is_lattice = fluid.particles.is_some()
            || (fitted / (fluid.density * cell.element_product()) - 1.0).abs() < TOO_FAR;
        let is_same = (fitted / mass - 1.0).abs() < SAME;
        let mass = if is_lattice && !is_same { fitted } else { mass };
        Ok(Filling { particles, carved, mass, volume: Some(volume), fills_vessel })
    }

    /// Places particles on the lattice that best fits the fluid's volume, m³. Bodies take the volume `taken`
    /// of the shape.
    fn fit(&self, obstacles: &[Obstacle], within: Aabb, volume: f64, taken: f64) -> Result<Placed, Error> {
        // slightly smaller than the box, whose faces have ω = 0
        let is_box = self.fluid.range(&within.grown(-1e-6 * within.size().min_element())).lo > 0.0;
        let best = if is_box { self.fit_box(obstacles, within, volume, taken)? } else { None };
        match (best, self.scene.fluid.particles) {
            (Some((error, placed)), _) if error < MANY_VACANCIES => Ok(placed),
            (best, Some(wanted)) => self.fit_number(obstacles, within, best, (volume, taken), wanted),
            (_, None) => self.fit_shape(obstacles, within, volume, taken),
        }
    }

    /// A lattice of whole layers along each side of a box, of which bodies take a part, or rows where a
    /// number of particles is stated, with the part of its sites that stays vacant. `None` if none holds that
    /// number.
    fn fit_box(
        &self,
        obstacles: &[Obstacle],
        within: Aabb,
        volume: f64,
        taken: f64,
    ) -> Result<Option<(f64, Placed)>, Error> {
        let Some(wanted) = self.scene.fluid.particles else {
            let cell = fitted_to(within.size(), self.parameters.spacing());
            let (particles, carved) = self.place(obstacles, Sites::Cells(cell), None, Some(taken))?;
            return Ok(Some((0.0, (particles, carved, cell))));
        };
        // the bodies take a part of the box, and its number of sites is that much larger
        let mut sites = wanted as f64 * within.volume() / volume;
        let mut best: Option<(f64, Placed)> = None;
        for _ in 0..TRIALS {
            let rows = Rows::filling(within, sites.round() as usize);
            let (placed, carved) = self.place(obstacles, Sites::Rows(rows), None, Some(taken))?;
            let excess = (placed.len() as f64 / wanted as f64).ln();
            sites += wanted as f64 - placed.len() as f64;
            if excess >= 0.0 && best.as_ref().is_none_or(|(least, _)| excess < *least) {
                best = Some((excess, (placed, carved, rows.cell())));
            }
            if (0.0..GOOD_ENOUGH).contains(&excess) {
                break;
            }
        }
        Ok(best)
    }

    /// The lattice whose cells times their number come nearest to the volume of a shape of any kind, m³, of
    /// which bodies take another volume.
    fn fit_shape(
        &self,
        obstacles: &[Obstacle],
        within: Aabb,
        volume: f64,
        taken: f64,
    ) -> Result<Placed, Error> {
        let spacing = self.parameters.spacing();
        let mut size = spacing;
        let free = self.free_axes(within).len() as f64;
        let mut best: Option<(f64, Placed)> = None;
        for _ in 0..TRIALS {
            let cell = self.cell(within, size);
            let (particles, carved) = self.place(obstacles, Sites::Cells(cell), None, Some(taken))?;
            let off = (particles.len() as f64 * cell.element_product() / volume).ln();
            if best.as_ref().is_none_or(|(least, _)| off.abs() < *least) {
                best = Some((off.abs(), (particles, carved, cell)));
            }
            if off.abs() < GOOD_ENOUGH || free == 0.0 {
                break;
            }
            // a sheet thinner than the spacing gets its weight from the mass of its particles
            size = (size * (-off / free).exp()).clamp((1.0 - TOO_FAR) * spacing, (1.0 + TOO_FAR) * spacing);
        }
        let (off, placed) = best.ok_or_else(|| self.no_lattice())?;
        if free == 0.0 {
            return Ok(placed);
        }
        let chords = Chords::of(&self.fluid, within, spacing);
        let misplaced = |cell: DVec3| -> f64 {
            (0..3).map(|axis| chords.mismatch(axis, self.layers(within, axis, cell[axis]))).sum()
        };
        let mut cell = self.cell(within, spacing);
        for axis in self.free_axes(within) {
            cell[axis] = chords.fitted(axis, spacing, |width| self.layers(within, axis, width));
        }
        if misplaced(cell) + WORTH_STRETCHING > misplaced(placed.2) {
            return Ok(placed);
        }
        let Ok((particles, carved)) = self.place(obstacles, Sites::Cells(cell), None, Some(taken)) else {
            return Ok(placed);
        };
        let off_stretched = (particles.len() as f64 * cell.element_product() / volume).ln().abs();
        let gained = misplaced(placed.2) + off - misplaced(cell) - off_stretched;
        Ok(if gained > WORTH_STRETCHING { (particles, carved, cell) } else { placed })
    }

    /// Places a number of particles, each as large as a cell, in a shape of any kind. If nothing fits better,
    /// it keeps the lattice that is already known, with its error.
    fn fit_number(
        &self,
        obstacles: &[Obstacle],
        within: Aabb,
        mut best: Option<(f64, Placed)>,
        (volume, taken): (f64, f64),
        wanted: usize,
    ) -> Result<Placed, Error> {
        let mut room = volume / wanted as f64;
        for _ in 0..TRIALS {
            let cell = self.cell_with_room(within, room);
            let number = wanted + (taken / cell.element_product()).round() as usize;
            let sites = Sites::Deepest(cell, number);
            let (particles, carved) = self.place(obstacles, sites, None, Some(taken))?;
            let ratio = particles.len() as f64 / wanted as f64;
            // with too few sites the number is not met; with too many some are left out, and cells that
            // differ from the room of a particle crowd it
            let off = (wanted as f64 * cell.element_product() / volume).ln().abs();
            let error = if ratio < 1.0 { f64::INFINITY } else { ratio.ln() + off };
            if best.as_ref().is_none_or(|(least, _)| error < *least) {
                best = Some((error, (particles, carved, cell)));
            }
            if error < GOOD_ENOUGH {
                break;
            }
            room *= if ratio < 1.0 { ratio.max(0.5) * (1.0 - GOOD_ENOUGH) } else { ratio.min(2.0) };
        }
        best.map(|(_, placed)| placed).ok_or_else(|| self.no_lattice())
    }

    fn no_lattice(&self) -> Error {
        let message = "no lattice fits the shape of the fluid";
        refuse(&self.program, Diagnostic::error(Code::SCENE_NO_ROOM, self.scene.fluid.shape_span, message))
    }

    /// The axes along which the fluid does not reach from wall to wall, so that the size of cells is free.
    fn free_axes(&self, within: Aabb) -> SmallVec<[usize; 3]> {
        let domain = self.scene.domain;
        (0..3).filter(|&k| within.min[k] > domain.min[k] || within.max[k] < domain.max[k]).collect()
    }

    /// Cells with about this volume, m³, of which whole layers reach from wall to wall where the fluid does.
    fn cell_with_room(&self, within: Aabb, room: f64) -> DVec3 {
        let free = self.free_axes(within);
        if free.is_empty() {
            return fitted_to(within.size(), room.cbrt());
        }
        let mut cell = self.cell(within, 1.0);
        let across: f64 = (0..3).filter(|axis| !free.contains(axis)).map(|axis| cell[axis]).product();
        let size = (room / across).powf(1.0 / free.len() as f64);
        free.iter().for_each(|&axis| cell[axis] = size);
        cell
    }

    /// Cells of about a size, m, of which whole layers reach from wall to wall where the fluid does.
    fn cell(&self, within: Aabb, size: f64) -> DVec3 {
        let free = self.free_axes(within);
        DVec3::from_array(std::array::from_fn(|axis| {
            let length = within.size()[axis];
            let layers = || (length / self.parameters.spacing()).round().max(1.0);
            if free.contains(&axis) { size } else { length / layers() }
        }))
    }

    /// The box of a lattice with these cells: it begins at a wall of the box where the fluid touches one, and lies in
    /// the middle of the fluid's bounds elsewhere, so that what is symmetric stays so.
    fn lattice_box(&self, within: Aabb, cell: DVec3) -> Aabb {
        let layers: [Layers; 3] = std::array::from_fn(|axis| self.layers(within, axis, cell[axis]));
        let min = DVec3::from_array(layers.map(|layers| layers.start));
        let number = DVec3::from_array(layers.map(|layers| layers.number));
        // slightly more room, so that rounding does not take a layer
        Aabb::new(min, min + number * cell * (1.0 + 1e-12))
    }

    /// The layers of that box along an axis.
    fn layers(&self, within: Aabb, axis: usize, width: f64) -> Layers {
        let domain = self.scene.domain;
        let (low, high) = (within.min[axis], within.max[axis]);
        let number = ((high - low) / width + 1e-9).floor();
        let spare = (high - low) - number * width;
        let before = match (low <= domain.min[axis], high >= domain.max[axis]) {
            (true, _) => 0.0,
            (false, true) => spare,
            (false, false) => 0.5 * spare,
        };
        Layers { start: low + before, number, width }
    }

    /// [`Self::lattice_box`] with a further layer on each side that is no wall.
    fn with_outer_layers(&self, within: Aabb, cell: DVec3) -> Aabb {
        let (domain, mut bounds) = (self.scene.domain, self.lattice_box(within, cell));
        for axis in 0..3 {
            if within.min[axis] > domain.min[axis] {
                bounds.min[axis] -= cell[axis];
            }
            if within.max[axis] < domain.max[axis] {
                bounds.max[axis] += cell[axis];
            }
        }
        bounds
    }

    /// Places particles at rest, and removes those for which obstacles leave no room. If the volume of the
    /// shape that obstacles take, m³, is known, the number removed is the number of cells in that volume.
    fn place(
        &self,
        obstacles: &[Obstacle],
        sites: Sites,
        count: Option<usize>,
        taken: Option<f64>,
    ) -> Result<(Particles, Carved), Error> {
        let (fluid, domain) = (&self.scene.fluid, &self.scene.domain);
        let reach = self.reach()?;
        let within_field = |bounds| FluidShape::Field { field: &self.fluid, bounds, fill: fluid.fill };
        let (shape, cell) = match sites {
            Sites::Stated => (within_field(reach), None),
            Sites::Cells(cell) => {
                (within_field(self.lattice_box(reach.intersection(domain), cell)), Some(cell))
            }
            Sites::Deepest(cell, number) => {
                let bounds = self.with_outer_layers(reach.intersection(domain), cell);
                (FluidShape::Deepest { field: &self.fluid, bounds, number }, Some(cell))
            }
            Sites::Rows(rows) => (FluidShape::Rows(rows), Some(rows.cell())),
        };
        let block = FluidBlock {
            shape,
            cell,
            count,
            // a number alone says how fine the fluid is; with a size it is to be met
            allow_fewer: fluid.size_span.is_none(),
            velocity: DVec3::ZERO,
            jitter: fluid.jitter,
            seed: fluid.seed,
        };
        let mut particles = block.seed(&self.parameters, *domain).map_err(|e| self.no_fluid(&e))?;
        let spacing = cell.map_or(self.parameters.spacing(), |cell| cell.element_product().cbrt());
        let mut clearance = CLEARANCE * spacing;
        let cells = taken.zip(cell).map(|(taken, cell)| (taken / cell.element_product()).round() as usize);
        let mut squeezed = 0;
        let carved = match (self.parameters.makes_room_at_start(), cells) {
            (true, Some(cells)) => {
                carve_cells(&mut particles, domain, obstacles, (spacing, clearance), cells)
            }
            (makes_room, _) => {
                if makes_room {
                    // particles that are too near may move; only those that find no place are removed
                    squeezed = make_room(&mut particles, domain, obstacles, clearance);
                    clearance *= 0.5;
                }
                carve(&mut particles, domain, obstacles, clearance)
            }
        };
        let mut carved = carved.map_err(|e| self.no_fluid(&e))?;
        carved.too_close += squeezed;
        Ok((particles, carved))
    }

    /// How many particles were carved off for each reason that there was, as "72 in an obstacle, 3 too close to one".
    pub(super) fn reasons(&self, carved: &Carved) -> String {
        let (within, near) = match (&self.scene.container, self.scene.obstacles.is_empty()) {
            (None, _) => ("in an obstacle", "too close to one"),
            (Some(_), true) => ("outside of the container", "too close to its walls"),
            (Some(_), false) => ("in an obstacle or outside of the container", "too close to their walls"),
        };
        let all =
            [(carved.inside, within), (carved.too_close, near), (carved.outside_box, "outside the box")];
        let told: Vec<String> =
            all.iter().filter(|(count, _)| *count > 0).map(|(count, why)| format!("{count} {why}")).collect();
        told.join(", ")
    }

    /// A warning if obstacles took particles, with the part of the fluid that this was.
    pub(super) fn carving(
        &self,
        Filling { carved, mass, volume, particles, fills_vessel: _ }: &Filling,
    ) -> Option<Diagnostic> {
        let lost = carved.inside + carved.too_close + carved.outside_box;
        let off =
            volume.map(|volume| mass * particles.len() as f64 / (self.scene.fluid.density * volume) - 1.0);
        let is_whole = off.is_some_and(|off| off.abs() < GOOD_ENOUGH);
        if lost == 0 || is_whole && lost == carved.too_close {
            // a lattice that is fitted to the room beside a wall takes nothing from the fluid
            return None;
        }
        let all = lost + carved.kept;
        let part = match 100.0 * lost as f64 / all as f64 {
            percent if percent < 1.0 => "less than 1 %".to_string(),
            percent if percent > 99.0 => "more than 99 %".to_string(),
            percent => format!("{percent:.0} %"),
        };
        let mut message = format!(
            "{lost} of {all} particles of the fluid ({part}) were carved off: {}; {} are left",
            self.reasons(carved),
            carved.kept
        );
        if let Some(off) = off {
            message += &if is_whole {
                ", as heavy as the free part of the shape".to_string()
            } else {
                format!(
                    ", {:.1} % {} than the free part of the shape",
                    100.0 * off.abs(),
                    if off > 0.0 { "heavier" } else { "lighter" }
                )
            };
        }
        Some(Diagnostic::warning(Code::FLUID_IN_OBSTACLE, self.scene.fluid.shape_span, message))
    }
}

/// Keeps the wanted number of particles, spread evenly. The others leave vacancies, which the fluid closes at
/// once. (If a top layer were left out instead, all the rest would be compressed by what it weighs.)
fn thinned(particles: &Particles, number: usize) -> Particles {
    let mut kept = Particles::default();
    let all = particles.len();
    // in whole numbers: a site stays if a further one of the wanted particles falls to it
    let before = |site: usize| (site as u128 * number.min(all) as u128 / all.max(1) as u128) as usize;
    for site in (0..all).filter(|&site| before(site + 1) > before(site)) {
        kept.push(particles.position.get(site), particles.velocity.get(site));
    }
    kept
}

/// The size of cells with a spacing about as given that fill a box.
fn fitted_to(size: DVec3, spacing: f64) -> DVec3 {
    let layers = (size / spacing).to_array().map(f64::floor);
    let badness = |counts: DVec3| {
        let cell = size / counts;
        let stretch = cell.max_element() / cell.min_element();
        stretch.ln() + (cell.element_product() / spacing.powi(3)).ln().abs()
    };
    let mut best = (f64::INFINITY, DVec3::ONE);
    for choice in 0..64 {
        // from one layer fewer to two more
        let pick = |axis: usize| (layers[axis] + f64::from(choice >> (2 * axis) & 3) - 1.0).max(1.0);
        let counts = DVec3::new(pick(0), pick(1), pick(2));
        let found = badness(counts);
        if found < best.0 {
            best = (found, counts);
        }
    }
    size / best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_fill_a_box_with_whole_layers() {
        let size = DVec3::new(1.0, 0.5, 0.26);
        let cell = fitted_to(size, 0.05);
        let counts = size / cell;
        assert_eq!(counts.round(), DVec3::new(20.0, 10.0, 5.0));
        assert!((counts - counts.round()).abs().max_element() < 1e-12);
        // a box thinner than the spacing holds one layer
        assert_eq!((DVec3::new(1.0, 1.0, 0.01) / fitted_to(DVec3::new(1.0, 1.0, 0.01), 0.1)).round().z, 1.0);
    }
}
