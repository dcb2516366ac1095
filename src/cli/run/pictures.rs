//! The pictures of a run: from where it is seen, and which obstacles are cut open or left out so that they do not hide
//! the fluid.
//!
//! Invariant: what is cut or left out is found from the scene at its start and not from particles, so all pictures of a
//! run agree, resumed or not. Their colours are chosen there, too; if they do not fit the fluid, all pictures are drawn
//! again at the end.

use std::path::Path;

use glam::DVec3;
use rayon::prelude::*;

use super::super::args::{CutFlag, Run};
use super::super::{Failure, note, output};
use crate::cli::output::Shown;
use crate::cli::render::Surface;
use crate::cli::scenery::{self, Drawn, Viewpoint, half, out_of_the_way, projection};
use rfm::experiment;
use rfm::field::Walls;
use rfm::fluid_surface::Reconstruction;
use rfm::geom::Aabb;
use rfm::lower::Opening;
use rfm::mesh::Mesh;
use rfm::render::{self, Camera, Cut, MeshView, Scale};
use rfm::sph::Simulation;
use rfm::{Experiment, Solid};

/// Points along each side of the fluid's bounds that stand for the fluid.
const SAMPLES: usize = 14;

/// Size of the picture in which hidden points are sought.
const SMALL: (u32, u32) = (320, 240);

/// The speed that is drawn red, as a part of the speed of a fall through the whole box: obstacles stop most particles
/// long before.
const FASTEST: f64 = 0.6;

/// Colours fit a fluid whose greatest speed lies between these parts of the speed at their end. They are chosen before
/// anything is known of its motion.
const FITTING: std::ops::Range<f64> = 0.5..1.2;

/// Options of pictures, besides what the scene states.
#[derive(Debug, Clone, Copy)]
pub(in crate::cli) struct Look<'a> {
    pub camera: Option<Viewpoint>,
    pub cut: Option<&'a CutFlag>,
    pub hide: &'a [String],
    pub glass: &'a [String],
    /// How the surface of the fluid is drawn, if it is.
    pub surface: Option<Surface>,
    /// The speed at the end of the colours, m/s, in place of the one that the scene states or lets expect.
    pub fastest: Option<f64>,
}

/// The fluid at an instant, as pictures show it.
pub(in crate::cli) struct Seen {
    pub places: Vec<DVec3>,
    /// The speed of each particle, m/s.
    pub speeds: Vec<f64>,
    pub time: f64,
    pub step: Option<u64>,
}

impl Seen {
    pub fn of(simulation: &Simulation) -> Self {
        let particles = simulation.particles();
        Self {
            places: particles.position.iter().collect(),
            speeds: particles.velocity.iter().map(DVec3::length).collect(),
            time: simulation.time(),
            step: Some(simulation.steps()),
        }
    }
}

impl<'a> Look<'a> {
    /// What the flags of a run ask for.
    pub fn of(options: &'a Run) -> Self {
        let Run { camera, cut, hide, glass, surface, .. } = options;
        Self { camera: *camera, cut: cut.as_ref(), hide, glass, surface: *surface, fastest: None }
    }
}

/// What all pictures of a run share.
pub(in crate::cli) struct Pictures {
    /// The scene that is drawn, with the box, the obstacles that stand still and the legend.
    scene: render::Backdrop,
    /// The other obstacles, where they are now.
    moving: Vec<(Drawn, Mesh)>,
    domain: Aabb,
    radius: f64,
    /// The simulated time between frames, s.
    every: f64,
    bodies: Vec<Body>,
    /// How the surface of the fluid is drawn in place of the particles, and the plane that cuts it open.
    surface: Option<(Surface, Option<Cut>)>,
    /// The speed at the end of the colours, m/s, if it was only expected: `None` where they do not show speeds, and
    /// where it is stated.
    pub expected: Option<f64>,
    pub(in crate::cli) count: usize,
}

/// An obstacle in pictures.
struct Body {
    solid: Solid,
    drawn: Drawn,
    /// Its surface, if it stands still and has so many faces that it pays to ask first whether one is near.
    near: Option<Box<dyn Walls>>,
}

impl Pictures {
    /// Prepares the pictures. `meshes` are those of the bodies at the start.
    pub fn new(look: Look<'_>, experiment: &Experiment, meshes: &[Mesh]) -> Result<Self, Failure> {
        let domain = experiment.domain();
        scenery::tell_of_aim(&domain, look.camera.and_then(|flag| flag.look_at));
        let camera = camera(look, experiment, Camera::SIZE)?;
        let opened = opened(look, experiment, meshes)?;
        let title = title(experiment, &opened);
        let stated = look.fastest.or(experiment.scene().picture.fastest);
        let fastest = stated.unwrap_or_else(|| end_of_colours(experiment));
        let body = |(solid, drawn): (&Solid, Drawn)| {
            let near = (!solid.moves() && solid.has_many_leaves()).then(|| solid.surface(domain));
            Body { solid: solid.clone(), drawn, near }
        };
        let solids = experiment.bodies().iter().map(|body| &body.solid);
        let bodies: Vec<Body> = solids.zip(opened).map(body).collect();
        let scale = look.surface.is_none().then(|| Scale::speeds(fastest));
        let legend = render::Legend { title: &title, scale };
        let still = bodies.iter().zip(meshes).filter(|(body, _)| !body.solid.moves());
        let scene =
            scenery::backdrop(&camera, &domain, &legend, still.map(|(body, mesh)| (body.drawn, mesh)))?;
        Ok(Self {
            scene,
            moving: moving(&domain, &bodies, meshes),
            domain,
            radius: 0.5 * experiment.parameters().spacing(),
            every: experiment.scene().run.save_every,
            bodies,
            surface: look.surface.map(|surface| (surface, plane(look, experiment, &camera))),
            expected: (look.surface.is_none() && stated.is_none()).then_some(fastest),
            count: 0,
        })
    }

    /// The speed at which the colours should end, m/s, if they do not fit fluid with this greatest speed.
    pub fn better_end(&self, fastest: f64) -> Option<f64> {
        let expected = self.expected.filter(|_| self.count > 0 && fastest > 0.0)?;
        let rounded = format!("{fastest:.1e}").parse().unwrap_or(fastest);
        (!FITTING.contains(&(fastest / expected))).then_some(rounded)
    }

    /// Puts the obstacles where they are now.
    pub fn show(&mut self, meshes: &[Mesh]) {
        self.moving = moving(&self.domain, &self.bodies, meshes);
    }

    pub fn save(&mut self, path: &Path, seen: Seen) -> Result<(), Failure> {
        let image = self.image(seen)?;
        output::write(path, |mut out| image.write_png(&mut out))?;
        self.count += 1;
        Ok(())
    }

    pub fn image(&self, seen: Seen) -> Result<render::Image, Failure> {
        let water = self.water(&seen.places)?;
        let [x, y, z] = columns(&self.lifted(seen.places, seen.time));
        let particles = render::ParticlesView {
            positions: rfm::field::Points::new(&x, &y, &z),
            values: &seen.speeds,
            radius: self.radius,
        };
        let moment = render::Caption { time: seen.time, every: self.every, step: seen.step };
        let mut meshes = scenery::views(&self.moving);
        if let (Some((surface, cut)), Some(water)) = (self.surface, &water) {
            meshes.push(MeshView { cut, ..scenery::surface(water, surface.material()) });
        }
        let moving = render::Moving { meshes: &meshes, particles, balls: self.surface.is_none() };
        Ok(self.scene.frame_with(&moving, &moment))
    }

    /// The surface of a fluid with particles at these places, if it is drawn.
    fn water(&self, places: &[DVec3]) -> Result<Option<Mesh>, Failure> {
        if self.surface.is_none() {
            return Ok(None);
        }
        let places: Vec<DVec3> = places.iter().copied().filter(|p| p.is_finite()).collect();
        let within = Reconstruction { vessel: Some(self.domain), ..Reconstruction::of_radius(self.radius) };
        let made = within.mesh(&places);
        made.map(Some).map_err(|error| Failure::usage(format!("--surface: {error}")))
    }

    /// The places with every ball in front of the walls: a particle is a point and may touch them, and half of its ball
    /// would then be sunk.
    fn lifted(&self, mut places: Vec<DVec3>, time: f64) -> Vec<DVec3> {
        let r = self.radius;
        for body in &self.bodies {
            let solid = body.solid.at(time);
            places.par_iter_mut().filter(|p| p.is_finite()).for_each(|p| {
                if body.near.as_ref().is_some_and(|near| near.clearance(*p, r) >= r) {
                    return;
                }
                let contact = solid.contact(*p);
                // an estimate that is far off must not throw a ball about
                let lift = (r - contact.distance).clamp(0.0, 2.0 * r);
                if lift > 0.0 && contact.normal.is_finite() {
                    *p += lift * contact.normal;
                }
            });
        }
        let (low, high) = (self.domain.min + r, self.domain.max - r);
        if low.cmple(high).all() {
            let is_near = |p: DVec3| self.domain.grown(r).contains(p);
            places.iter_mut().filter(|p| is_near(**p)).for_each(|p| *p = p.clamp(low, high));
        }
        places
    }
}

/// The speed at the end of the colours, m/s, before anything is known of the motion: the one that the scene states, or
/// one that it lets expect.
pub(super) fn end_of_colours(experiment: &Experiment) -> f64 {
    // a fall is stopped on its way, what drives a fluid otherwise is not
    let share = if experiment.typical_speed() > 0.0 { FASTEST } else { 1.0 };
    let expected = (share * experiment.speed_scale()).max(experiment.start_speed());
    experiment.scene().picture.fastest.unwrap_or(expected)
}

fn columns(places: &[DVec3]) -> [Vec<f64>; 3] {
    [0, 1, 2].map(|axis| places.iter().map(|p| p[axis]).collect())
}

/// The obstacles that move, where their meshes are.
fn moving(domain: &Aabb, bodies: &[Body], meshes: &[Mesh]) -> Vec<(Drawn, Mesh)> {
    let moving = bodies.iter().zip(meshes).filter(|(body, _)| body.solid.moves());
    scenery::sharp(domain, moving.map(|(body, mesh)| (body.drawn, mesh)))
}

/// The camera that the flags or the scene ask for.
fn camera(look: Look<'_>, experiment: &Experiment, size: (u32, u32)) -> Result<Camera, Failure> {
    let stated = &experiment.scene().picture;
    let viewpoint = look.camera.unwrap_or(Viewpoint {
        towards_eye: stated.camera,
        look_at: stated.look_at,
        zoom: stated.zoom,
        projection: projection(stated.parallel),
    });
    scenery::camera(&experiment.domain(), viewpoint, size)
}

/// The plane that the flags or the scene state for all that is drawn.
fn plane(look: Look<'_>, experiment: &Experiment, camera: &Camera) -> Option<Cut> {
    match (look.cut, experiment.scene().picture.cut) {
        (Some(CutFlag::Plane(plane)), _) => Some(scenery::half_towards_eye(plane, camera)),
        (None, Opening::Half { axis, at, below }) => Some(half(DVec3::AXES[axis], at, below)),
        (Some(CutFlag::Auto | CutFlag::None), _) | (None, Opening::Automatic | Opening::None) => None,
    }
}

/// How each body is drawn.
fn opened(look: Look<'_>, experiment: &Experiment, meshes: &[Mesh]) -> Result<Vec<Drawn>, Failure> {
    let names: Vec<&str> = experiment.bodies().iter().map(|body| body.solid.name()).collect();
    let stated = &experiment.scene().picture;
    for (flag, given) in [("--hide", look.hide), ("--glass", look.glass)] {
        if let Some(unknown) = given.iter().find(|name| !names.contains(&name.as_str())) {
            let there = if names.is_empty() { "none".into() } else { names.join(", ") };
            return Err(Failure::usage(format!(
                "{flag} {unknown}: the scene `{}` has no such obstacle; there is {there}",
                experiment.scene().name
            )));
        }
    }
    let is_hidden = |name: &str| stated.hide.iter().chain(look.hide).any(|hidden| hidden == name);
    let is_glass = |name: &str| stated.glass.iter().chain(look.glass).any(|glass| glass == name);
    let small = camera(look, experiment, SMALL)?;
    let fixed = match (look.cut, stated.cut) {
        (Some(CutFlag::Plane(plane)), _) => Some(Some(scenery::half_towards_eye(plane, &small))),
        (Some(CutFlag::None), _) | (None, Opening::None) => Some(None),
        (None, Opening::Half { axis, at, below }) => Some(Some(half(DVec3::AXES[axis], at, below))),
        (Some(CutFlag::Auto), _) | (None, Opening::Automatic) => None,
    };
    let samples = if fixed.is_none() { fluid_samples(experiment) } else { Vec::new() };
    let until = experiment.scene().run.until;
    let by_plane = |cut, body: &experiment::Body, mesh: &Mesh| match body.solid.moves() {
        false => scenery::opened_by(cut, mesh.positions.iter().copied()),
        true => match body.solid.between(0.0, until).bounds().aabb() {
            Some(all_its_places) => scenery::opened_by(cut, all_its_places.corners()),
            None => Drawn::Open(cut),
        },
    };
    let drawn = |((name, body), mesh): ((&&str, &experiment::Body), &Mesh)| match fixed {
        _ if is_hidden(name) => Drawn::Hidden,
        _ if is_glass(name) => match fixed.flatten() {
            Some(cut) => scenery::glass(by_plane(cut, body, mesh)),
            None => Drawn::Glass(None),
        },
        Some(None) => Drawn::Whole,
        Some(Some(cut)) => by_plane(cut, body, mesh),
        None => out_of_the_way(&small, name, mesh, &samples),
    };
    let all: Vec<Drawn> = names.iter().zip(experiment.bodies()).zip(meshes).map(drawn).collect();
    let is_cut = |drawn: &Drawn| matches!(drawn, Drawn::Hidden | Drawn::Open(_) | Drawn::Glass(Some(_)));
    if matches!(look.cut, Some(CutFlag::Plane(_))) && !all.is_empty() && !all.iter().any(is_cut) {
        note("--cut: the plane meets no obstacle, so all of them are drawn whole");
    }
    Ok(all)
}

/// Points of the fluid as it is at the start.
fn fluid_samples(experiment: &Experiment) -> Vec<DVec3> {
    let fluid = experiment.fluid();
    let domain = experiment.domain();
    let over = fluid.bounds().aabb().map_or(domain, |bounds| bounds.intersection(&domain));
    let cell = over.size() / SAMPLES as f64;
    let at = |k: usize| {
        let index = [k % SAMPLES, k / SAMPLES % SAMPLES, k / SAMPLES / SAMPLES];
        over.min + cell * DVec3::from_array(index.map(|i| i as f64 + 0.5))
    };
    let is_free = |p: &DVec3| experiment.bodies().iter().all(|body| body.solid.sign(*p) < 0.0);
    let points = (0..SAMPLES.pow(3)).into_par_iter().map(at);
    points.filter(|p| fluid.sign(*p) > 0.0 && is_free(p)).collect()
}

/// The name of the file that a scene stands in, without its folder.
pub(super) fn file_name(experiment: &Experiment) -> String {
    let name = experiment.program().sources().first().map_or("-", |source| &source.name);
    match Path::new(name).file_name() {
        Some(name) if !["-", "<stdin>"].contains(&&*name.to_string_lossy()) => {
            name.to_string_lossy().into_owned()
        }
        Some(_) | None => "standard input".into(),
    }
}

/// What is seen: the file, the scene, the method, and what was done to the obstacles.
fn title(experiment: &Experiment, drawn: &[Drawn]) -> String {
    let scene = experiment.scene();
    let file = Path::new(&file_name(experiment)).shown();
    let mut parts = vec![file, scene.name.clone(), scene.method.name().to_string()];
    let names: Vec<&str> = experiment.bodies().iter().map(|body| body.solid.name()).collect();
    parts.extend(scenery::described(&names, drawn));
    parts.join(" · ")
}
