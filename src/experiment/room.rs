//! How much room a scene has for its fluid, and the messages if that is too little.

use glam::DVec3;

use super::{Body, Experiment, refuse};
use crate::Solid;
use crate::compile::Error;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::field::{Everywhere, Field, Region, Walls, is_flat};
use crate::geom::{Aabb, to_thousandths};
use crate::lower::Scene;
use crate::solid::Bounds;
use crate::sph::{MAX_SITES, SeedError};

/// Points along the longest side of a box whose volume is estimated by sampling.
const SAMPLES: f64 = 40.0;

/// Number of halvings that find the border of an empty slab, to a part in 10¹² of the box.
const HALVINGS: usize = 40;

/// If the room of a scene is at least this many times the volume of its fluid, the fluid has a surface.
pub(super) const LEAST_ROOM: f64 = 1.03;

/// How far room is looked for around a fluid, over its longest side.
const AROUND: f64 = 0.25;

/// The least part of a fluid outside the box that is worth a warning: less is an edge between samples.
const PART_OUTSIDE: f64 = 0.02;

/// Solids that are asked at many places whether these lie in one of them. Bounds answer most of the questions: many
/// solids are small.
pub(super) struct Crowd<'a> {
    solids: Vec<(&'a Solid, Option<Aabb>)>,
}

/// So few solids are asked themselves: to find the bounds of one may take longer than all that is asked of it.
const FEW: usize = 4;

/// Number of particles that a run of minutes has.
const USUAL_SITES: f64 = 1e5;

impl<'a> Crowd<'a> {
    pub fn of(solids: impl Iterator<Item = &'a Solid>) -> Self {
        let solids: Vec<&Solid> = solids.collect();
        let is_crowd = solids.len() > FEW;
        let bounds = |solid: &Solid| if is_crowd { solid.bounds().aabb() } else { None };
        Self { solids: solids.into_iter().map(|solid| (solid, bounds(solid))).collect() }
    }

    /// Whether a place is proven to lie outside of all.
    pub fn is_free(&self, at: DVec3) -> bool {
        let is_outside = |solid: &Solid| solid.omega(at) < 0.0;
        let mut solids = self.solids.iter();
        solids.all(|(solid, bounds)| bounds.is_some_and(|bounds| !bounds.contains(at)) || is_outside(solid))
    }

    /// Whether a place is proven to lie in one of them, or on its surface.
    pub fn takes(&self, at: DVec3) -> bool {
        let is_in = |solid: &Solid| solid.omega(at) >= 0.0;
        let mut solids = self.solids.iter();
        solids.any(|(solid, bounds)| bounds.is_none_or(|bounds| bounds.contains(at)) && is_in(solid))
    }
}

/// The rest of a box without slabs along its faces in which a field is proven to be negative; the whole box
/// if the field is negative in all of it. For a half-space such as `z <= 0.5`, the part inside the box
/// remains.
fn without_empty_sides(field: &dyn Field, whole: Aabb) -> Aabb {
    if field.range(&whole).hi < 0.0 {
        return whole;
    }
    let mut left = whole;
    for axis in 0..3 {
        for low in [true, false] {
            let size = left.size()[axis];
            // the box from its lower or upper face to the part `from..to` of the side
            let cut = |from: f64, to: f64| {
                let mut cut = left;
                let [near, far] = if low { [from, to] } else { [1.0 - to, 1.0 - from] };
                (cut.min[axis], cut.max[axis]) = (left.min[axis] + near * size, left.min[axis] + far * size);
                cut
            };
            // the empty slab ends between what is proven and what is not
            let (mut empty, mut doubtful) = (0.0, 1.0);
            for _ in 0..HALVINGS {
                let part = 0.5 * (empty + doubtful);
                let is_empty = field.range(&cut(0.0, part)).hi < 0.0;
                *(if is_empty { &mut empty } else { &mut doubtful }) = part;
            }
            if empty > 0.0 {
                let end = left.min[axis] + if low { empty * size } else { (1.0 - empty) * size };
                *(if low { &mut left.min[axis] } else { &mut left.max[axis] }) = end;
            }
        }
    }
    left
}

impl Experiment {
    /// The box in which the shape of the fluid lies, m. No particle of the stated size may be larger than the
    /// part of this box that lies in the domain.
    pub(super) fn reach(&self) -> Result<Aabb, Error> {
        let bounds = self.extent()?;
        let size = bounds.intersection(&self.scene.domain).size();
        let is_stated = self.scene.fluid.size_span.is_some();
        if is_stated && self.parameters.spacing() > size.max_element() {
            return Err(refuse(&self.program, self.too_coarse()));
        }
        Ok(bounds)
    }

    /// The box in which the shape of the fluid lies, m, whatever the size of its particles.
    fn extent(&self) -> Result<Aabb, Error> {
        let (fluid, domain) = (&self.scene.fluid, self.scene.domain);
        let no_room = |message: String| {
            let diagnostic = Diagnostic::error(Code::SCENE_NO_ROOM, fluid.shape_span, message);
            diagnostic
                .label(self.scene.domain_span, format!("the box goes from {} to {}", domain.min, domain.max))
        };
        let bounds = match self.fluid.bounds() {
            Bounds::Within(bounds) => *bounds,
            Bounds::Unbounded if self.fluid.range(&domain).hi < 0.0 => {
                return Err(refuse(
                    &self.program,
                    no_room("the shape of the fluid lies outside the box".into()),
                ));
            }
            Bounds::Unbounded => without_empty_sides(&self.fluid, domain),
            Bounds::Empty => {
                let message = "the shape of the fluid is empty";
                let empty = Diagnostic::error(Code::SCENE_NO_ROOM, fluid.shape_span, message);
                return Err(refuse(&self.program, empty));
            }
        };
        let within = bounds.intersection(&domain);
        if is_flat(&within) {
            let message = "the shape of the fluid lies outside the box".to_string();
            let reach =
                format!("it lies between {} and {}", to_thousandths(bounds.min), to_thousandths(bounds.max));
            return Err(refuse(&self.program, no_room(message).at(reach)));
        }
        Ok(bounds)
    }

    /// The message for a fluid that cannot be placed.
    pub(super) fn no_fluid(&self, error: &SeedError) -> Error {
        let fluid = &self.scene.fluid;
        let spacing = self.parameters.spacing();
        let at = fluid.particles_span.unwrap_or(fluid.shape_span);
        let no_room = |span: Span, message: String| Diagnostic::error(Code::SCENE_NO_ROOM, span, message);
        let diagnostic = match error {
            SeedError::DoesNotFit { room: 0, .. } => self.too_coarse(),
            SeedError::DoesNotFit { wanted, room } => {
                let message = format!(
                    "{wanted} particles do not fit: with {} between them the shape has room for {room}",
                    length(spacing)
                );
                no_room(at, message).help(if *wanted as f64 > 0.2 * MAX_SITES {
                    format!(
                        "{}so many particles are too many in any case: leave `particles` out, or write `particles: {room}`",
                        self.why_so_large()
                    )
                } else {
                    let fits = spacing * (*room as f64 / *wanted as f64).cbrt();
                    format!(
                        "{}write `spacing: {}` in the fluid, or `particles: {room}`",
                        self.why_so_large(),
                        length(0.95 * fits)
                    )
                })
            }
            SeedError::TooLarge { .. } | SeedError::NothingLeft(_) if self.is_outside_the_container() => {
                outside_the_container(&self.scene)
            }
            SeedError::TooLarge { sites }
                if sites.is_finite() && fluid.size_span.is_none() && self.is_covered() =>
            {
                let place = if self.scene.container.is_some() {
                    "in obstacles or outside of the container"
                } else {
                    "within the obstacles"
                };
                let message = format!("the shape of the fluid lies {place}: none of it is free");
                Diagnostic::error(Code::OBSTACLE_FILLS_BOX, fluid.shape_span, message).help(
                    self.vessel_as_an_obstacle().unwrap_or_else(|| {
                        "move the shape of the fluid out of the obstacles, or make it larger".into()
                    }),
                )
            }
            SeedError::TooLarge { sites }
                if sites.is_finite() && fluid.size_span.is_none() && fluid.particles.is_some() =>
            {
                // the lattice fills the bounds of the shape, and the particles are those of its sites that lie inside
                let wanted = fluid.particles.unwrap_or_default() as f64;
                let most = rounded_down(0.98 * wanted * (MAX_SITES / sites).min(1.0));
                let message = format!(
                    "{wanted} particles are too many: of the {MAX_SITES:.0e} sites that the lattice around the shape \
                     may have, about {most:.1e} lie in it"
                );
                let fewer = rounded_down(0.2 * most);
                no_room(at, message).help(if fewer >= 1.0 {
                    format!("write for example `particles: {fewer:.0}`")
                } else {
                    "the shape is too thin for its bounds: fill a part of it".into()
                })
            }
            SeedError::TooLarge { sites } if sites.is_finite() => {
                let message = format!(
                    "with {} between particles the lattice around the shape would have {sites:.1e} sites; at most \
                     {MAX_SITES:.0e} are possible",
                    length(spacing)
                );
                let usual = spacing * (sites / USUAL_SITES).cbrt();
                let least = spacing * (sites / (0.5 * MAX_SITES)).cbrt();
                let span = fluid.size_span.unwrap_or(fluid.shape_span);
                no_room(span, message).help(format!(
                    "write for example `spacing: {}` for {USUAL_SITES:.0e} particles; {} makes {:.0e}, with which a run takes days",
                    length(usual),
                    length(least),
                    0.5 * MAX_SITES
                ))
            }
            SeedError::NothingLeft(carved)
                if carved.inside + carved.too_close + carved.outside_box == 0
                    || spacing > self.size_of_shape().max_element() =>
            {
                self.too_coarse()
            }
            SeedError::NothingLeft(carved) => {
                let message = format!("no particle is left: {}", self.reasons(carved));
                let is_in_one = !self.scene.obstacles.is_empty() && carved.inside + carved.too_close > 0;
                let help = match is_in_one {
                    false => "move the shape of the fluid into the room that it may fill".into(),
                    true => self
                        .vessel_as_an_obstacle()
                        .unwrap_or_else(|| "move the shape of the fluid out of the obstacles".into()),
                };
                Diagnostic::error(Code::OBSTACLE_FILLS_BOX, fluid.shape_span, message).help(help)
            }
            SeedError::Undefined { at } => {
                // the fluid, or one of the bodies that are asked where it is
                let obstacles = self.bodies.iter().skip(usize::from(self.scene.container.is_some()));
                let culprit = (obstacles.zip(&self.scene.obstacles))
                    .find(|(body, _)| !body.solid.omega(*at).is_finite())
                    .filter(|_| self.fluid.omega(*at).is_finite());
                let (whose, span) = match culprit {
                    Some((_, obstacle)) => (format!("obstacle `{}`", obstacle.name), obstacle.span),
                    None => ("a shape".to_string(), fluid.shape_span),
                };
                no_room(span, format!("the formula of {whose} has no value at {}", to_thousandths(*at)))
            }
            SeedError::NoCount | SeedError::Jitter(_) | SeedError::TooLarge { .. } => {
                no_room(at, error.to_string())
            }
        };
        refuse(&self.program, diagnostic)
    }

    /// Whether bodies cover all of the fluid's shape, as far as samples show.
    fn is_covered(&self) -> bool {
        self.is_covered_by(&self.bodies)
    }

    /// Whether no part of the fluid's shape lies in the container, as far as samples show.
    fn is_outside_the_container(&self) -> bool {
        self.scene.container.is_some() && self.is_covered_by(&self.bodies[..1])
    }

    /// What helps if all of the fluid lies in one obstacle, which may be its vessel.
    fn vessel_as_an_obstacle(&self) -> Option<String> {
        if self.scene.container.is_some() {
            return None;
        }
        let holds = |body: &Body| self.is_covered_by(std::slice::from_ref(body));
        let (obstacle, _) = self.scene.obstacles.iter().zip(&self.bodies).find(|(_, body)| holds(body))?;
        let name = &obstacle.name;
        Some(format!(
            "move the shape of the fluid out of it; if `{name}` is the vessel that holds the fluid, it is no `obstacle`, but a \
             `container`"
        ))
    }

    fn is_covered_by(&self, bodies: &[Body]) -> bool {
        let Ok(bounds) = self.extent() else { return false };
        let within = bounds.intersection(&self.scene.domain);
        let mut wet = samples(&within).filter(|at| self.fluid.omega(*at) > 0.0).peekable();
        let bodies = Crowd::of(bodies.iter().map(|body| &body.solid));
        // a film that no sample meets is not known to be covered
        wet.peek().is_some() && wet.all(|at| bodies.takes(at))
    }

    /// The size of the box around the fluid's shape within the domain, m.
    fn size_of_shape(&self) -> DVec3 {
        self.extent().map_or(DVec3::ZERO, |bounds| bounds.intersection(&self.scene.domain).size())
    }

    /// The message for a shape in which not one particle fits.
    fn too_coarse(&self) -> Diagnostic {
        let fluid = &self.scene.fluid;
        let spacing = self.parameters.spacing();
        let size = self.size_of_shape();
        let message = format!(
            "not one particle fits: they are {} apart, and the shape is only {} thick",
            length(spacing),
            length(size.min_element())
        );
        let span = fluid.size_span.unwrap_or(fluid.shape_span);
        Diagnostic::error(Code::SCENE_NO_ROOM, span, message).help(format!(
            "{}write for example `spacing: {}`",
            self.why_so_large(),
            length(size.min_element() / 10.0)
        ))
    }

    /// Where the spacing comes from if the scene states neither a mass nor a spacing.
    fn why_so_large(&self) -> String {
        let fluid = &self.scene.fluid;
        match fluid.size_span {
            Some(_) => String::new(),
            None => format!("the spacing follows from the default `mass: {} kg`; ", fluid.mass),
        }
    }

    /// A warning if part of the fluid's shape lies outside the box.
    pub(super) fn outside(&self, bounds: &Aabb) -> Option<Diagnostic> {
        let Bounds::Within(_) = self.fluid.bounds() else { return None };
        let domain = self.scene.domain;
        // the lattice begins half a spacing from the faces
        let grown = domain.grown(0.5 * self.parameters.spacing());
        if bounds.intersection(&grown) == *bounds {
            return None;
        }
        let (mut all, mut far) = (0.0, 0.0);
        for at in samples(bounds).filter(|at| self.fluid.omega(*at) > 0.0) {
            all += 1.0;
            far += f64::from(u8::from(!grown.contains(at)));
        }
        (far / all > PART_OUTSIDE).then(|| {
            // a box may be thinner than the samples of the shape are apart, so that it has samples of its own
            let (whole, within) = (self.volume_in(bounds), self.volume_in(&bounds.intersection(&domain)));
            let percent = (100.0 * (1.0 - within / whole)).clamp(1.0, 100.0).round();
            let share = match percent < 100.0 || within == 0.0 {
                true => format!("about {percent} %"),
                false => "more than 99 %".to_string(),
            };
            let message = format!("{share} of the fluid's shape lies outside the box, and is left out");
            let at =
                format!("it lies between {} and {}", to_thousandths(bounds.min), to_thousandths(bounds.max));
            Diagnostic::warning(Code::FLUID_OUTSIDE_BOX, self.scene.fluid.shape_span, message)
                .at(at)
                .label(self.scene.domain_span, format!("the box goes from {} to {}", domain.min, domain.max))
        })
    }

    /// The volume, m³, of the fluid's shape in a region, found by samples.
    fn volume_in(&self, region: &Aabb) -> f64 {
        let (mut held, mut all) = (0.0, 0.0);
        for at in samples(region) {
            all += 1.0;
            held += f64::from(u8::from(self.fluid.omega(at) > 0.0));
        }
        region.volume() * held / all
    }

    /// Whether bodies leave so much of the box around a fluid free at a time, s: a volume, m³. The fluid lies within
    /// the given box. Returns what they leave, if it is less. Samples answer for most scenes, but they miss a narrow
    /// vessel.
    pub fn lacks_room(&self, fluid: &Aabb, time: f64, needed: f64) -> Option<f64> {
        let bodies: Vec<_> = self.bodies.iter().map(|body| body.solid.at(time)).collect();
        let within = self.around(fluid);
        if sampled(&bodies, &within, |_| true) >= needed {
            return None;
        }
        Some(free_of(&bodies, within)).filter(|free| *free < needed)
    }

    /// Whether bodies leave no more of the box at the start than so much, m³: neither around a fluid within the given
    /// box, nor farther away, as behind a neck.
    pub(super) fn has_no_more_room(&self, fluid: &Aabb, than: f64) -> bool {
        let bodies: Vec<_> = self.bodies.iter().map(|body| body.solid.clone()).collect();
        let around = self.around(fluid);
        let near = free_of(&bodies, around);
        near < than && near + sampled(&bodies, &self.scene.domain, |at| !around.contains(at)) < than
    }

    /// The part of the box that lies so near to a fluid within some bounds that it shows whether the fluid has room.
    fn around(&self, fluid: &Aabb) -> Aabb {
        let margin = (AROUND * fluid.size().max_element()).max(2.0 * self.parameters.spacing());
        fluid.grown(margin).intersection(&self.scene.domain)
    }

    /// How many particles the scene has at its start, found by samples and without placing any of them.
    ///
    /// # Errors
    /// [`Error::Diagnostics`] if the fluid's shape lies outside the box.
    pub fn estimated_particles(&self) -> Result<f64, Error> {
        let region = self.reach()?.intersection(&self.scene.domain);
        let (mut fluid, mut shape, mut all) = (0.0, 0.0, 0.0);
        let bodies = Crowd::of(self.bodies.iter().map(|body| &body.solid));
        for at in samples(&region) {
            all += 1.0;
            if self.fluid.omega(at) > 0.0 {
                shape += 1.0;
                fluid += f64::from(u8::from(bodies.is_free(at)));
            }
        }
        let cell = self.parameters.spacing().powi(3);
        let sites = region.volume() / cell;
        // the shape is filled first, and then obstacles carve it
        let [fits, room] = [shape, fluid].map(|count: f64| sites * count / all);
        if sites > MAX_SITES {
            return Err(self.no_fluid(&SeedError::TooLarge { sites }));
        }
        let Some(wanted) = self.scene.fluid.particles else { return Ok(room) };
        // few particles are counted when they are placed
        let is_certain = fits > 1000.0 && wanted as f64 > 1.1 * fits;
        if is_certain {
            // what fits for certain
            let room = rounded_down(0.95 * fits) as usize;
            return Err(self.no_fluid(&SeedError::DoesNotFit { wanted, room }));
        }
        Ok(room.min(wanted as f64))
    }

    /// Messages about the place of the fluid before any of its particles is placed.
    pub fn foreseen(&self) -> Vec<Diagnostic> {
        match self.estimated_particles() {
            Ok(_) => self.reach().ok().and_then(|bounds| self.outside(&bounds)).into_iter().collect(),
            Err(Error::Diagnostics(refusal)) => refusal.list,
            // the compiler's own troubles are said when the scene is run
            Err(Error::File { .. } | Error::UnknownName { .. } | Error::Codegen(_)) => Vec::new(),
        }
    }

    /// The same scene with fewer, larger particles. A run of it is short, and its cost per particle forecasts that of
    /// the scene itself.
    ///
    /// # Errors
    /// Those of [`Experiment::new`].
    pub fn coarser(&self, particles: f64, engine: crate::Engine) -> Result<Self, Error> {
        let factor = (self.estimated_particles()? / particles).max(1.0);
        let mut scene: Scene = self.scene.clone();
        scene.fluid.mass *= factor;
        scene.fluid.support_radius = scene.fluid.support_radius.map(|h| h * factor.cbrt());
        scene.fluid.particles =
            scene.fluid.particles.map(|wanted| ((wanted as f64 / factor) as usize).max(1));
        Self::of_scene(self.program.clone(), scene, engine)
    }
}

/// The box around the part of a shape that lies in a box; `None` if the shape is empty.
pub(super) fn part_in_box(shape: &Solid, domain: &Aabb) -> Option<Aabb> {
    match shape.bounds() {
        Bounds::Within(bounds) => Some(bounds.intersection(domain)),
        Bounds::Unbounded => Some(*domain),
        Bounds::Empty => None,
    }
}

/// Among many obstacles one sample in several is looked at, and one in this number at least.
const SPARSEST: usize = 30;

/// What obstacles take of a fluid's shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Taken {
    /// The part of the shape that lies in them at the start, by samples.
    pub part: f64,
    /// Whether nothing is left of it: no volume is found outside of them.
    pub is_all: bool,
}

/// What obstacles take of a fluid's shape within a box; `None` if no sample meets the shape.
pub fn taken_by_obstacles(fluid: &Solid, obstacles: &[Solid], domain: &Aabb) -> Option<Taken> {
    let within = part_in_box(fluid, domain).filter(|within| !is_flat(within))?;
    let crowd = Crowd::of(obstacles.iter());
    // fewer places for many obstacles
    let every = 1 + obstacles.len() / 4;
    let (mut all, mut taken) = (0.0, 0.0);
    for p in samples(&within).step_by(every.min(SPARSEST)).filter(|p| fluid.omega(*p) > 0.0) {
        all += 1.0;
        taken += f64::from(u8::from(crowd.takes(p)));
    }
    if all == 0.0 {
        return None;
    }
    // a film may lie between samples
    let free = || {
        let quick = quick_fields(obstacles, within);
        let bodies = quick.iter().map(|field| &**field as &dyn Field).collect();
        Region { shape: &*quick_field(fluid, within), bodies, within }.volume()
    };
    Some(Taken { part: taken / all, is_all: taken == all && free() == 0.0 })
}

/// A field with the signs and the surface of a solid in a box, which for a solid of many parts costs less than ω
/// itself.
pub(super) fn quick_field(solid: &Solid, over: Aabb) -> Box<dyn Walls> {
    if solid.has_many_leaves() { solid.surface(over) } else { Box::new(solid.clone()) }
}

/// [`quick_field`] of several solids.
pub(super) fn quick_fields<'s>(
    solids: impl IntoIterator<Item = &'s Solid>,
    over: Aabb,
) -> Vec<Box<dyn Walls>> {
    solids.into_iter().map(|solid| quick_field(solid, over)).collect()
}

/// The part of a box, m³, that no body takes.
fn free_of(bodies: &[Solid], within: Aabb) -> f64 {
    let quick = quick_fields(bodies, within);
    let bodies = quick.iter().map(|field| &**field as &dyn Field).collect();
    Region { shape: &Everywhere, bodies, within }.volume()
}

/// [`free_of`], found by samples, of those places that count.
fn sampled(bodies: &[Solid], within: &Aabb, counts: impl Fn(DVec3) -> bool) -> f64 {
    let crowd = Crowd::of(bodies.iter());
    let (mut free, mut all) = (0.0, 0.0);
    for at in samples(within) {
        all += 1.0;
        free += f64::from(u8::from(counts(at) && crowd.is_free(at)));
    }
    within.volume() * free / all
}

/// A count with two digits, rounded down.
fn rounded_down(count: f64) -> f64 {
    let unit = 10f64.powf(count.log10().floor() - 1.0);
    unit * (count / unit).floor()
}

/// Points in the middles of equal cells that fill a box.
pub(super) fn samples(region: &Aabb) -> impl Iterator<Item = DVec3> + use<> {
    let size = region.size();
    let side = size.max_element() / SAMPLES;
    let counts = (size / side).ceil().max(DVec3::ONE);
    let [nx, ny, nz] = counts.to_array().map(|n| n as u64);
    let (min, cell) = (region.min, size / counts);
    (0..nx * ny * nz).map(move |index| {
        let (i, j, k) = (index % nx, index / nx % ny, index / (nx * ny));
        min + cell * (DVec3::new(i as f64, j as f64, k as f64) + 0.5)
    })
}

/// A length as a file writes it, with three digits: `2.5 mm`, `0.12 m`.
fn length(metres: f64) -> String {
    let rounded = |value: f64| format!("{value:.2e}").parse().unwrap_or(value);
    match metres {
        m if m >= 0.1 => format!("{} m", rounded(m)),
        m if m >= 1e-4 => format!("{} mm", rounded(1e3 * m)),
        m => format!("{} um", rounded(1e6 * m)),
    }
}

/// The message for a fluid of which nothing lies in the container.
pub fn outside_the_container(scene: &Scene) -> Diagnostic {
    let name = scene.container.as_ref().map_or("", |container| &container.name);
    let message = format!("no part of the fluid's shape lies in the container `{name}`");
    Diagnostic::error(Code::OBSTACLE_FILLS_BOX, scene.fluid.shape_span, message)
        .help("a container is the room that the fluid may fill: a solid that is its walls is an obstacle")
}
