//! The obstacles of pictures: which of them are whole, cut open or left out, so that they do not hide the fluid.

use glam::{BVec3, DVec3};

use super::failure::{Failure, note};
use rfm::geom::{Aabb, significant};
use rfm::mesh::{Mesh, split_creases};
use rfm::render::{self, Backdrop, Camera, Cut, Legend, Material, MeshView, Projection};
use rfm::slice::Plane;

/// An obstacle that hides more than this part of the fluid at its start is in the way.
const MOST_HIDDEN: f64 = 0.35;

/// Most obstacles that a title names; of more it gives the number.
const NAMED: usize = 3;

/// How an obstacle is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Drawn {
    Whole,
    Open(Cut),
    /// Clear, so that the fluid is seen through it; it may be cut open.
    Glass(Option<Cut>),
    Hidden,
}

/// From where a box is seen, as far as something states it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Viewpoint {
    /// The direction to the eye; `None`: from the front, right and above.
    pub towards_eye: Option<DVec3>,
    /// The place in the middle, m; `None`: that of the box.
    pub look_at: Option<DVec3>,
    /// How many times as large as if the whole box were seen.
    pub zoom: Option<f64>,
    pub projection: Projection,
}

/// The projection that a scene states.
pub(super) fn projection(parallel: bool) -> Projection {
    if parallel { Projection::Parallel } else { Projection::Perspective }
}

/// The camera of a picture of a box.
pub(super) fn camera(domain: &Aabb, from: Viewpoint, size: (u32, u32)) -> Result<Camera, Failure> {
    // a direction without a length stands for the usual one
    let towards_eye = from.towards_eye.unwrap_or(DVec3::ZERO);
    let camera = Camera::new(domain, towards_eye, from.projection, size).map_err(Failure::usage)?;
    Ok(match (from.look_at, from.zoom) {
        (None, None) => camera,
        (at, zoom) => camera.aimed(at.unwrap_or(domain.centre()), zoom.unwrap_or(1.0)),
    })
}

/// Notes a place that a flag puts into the middle of a picture, and that lies outside of the box which is drawn.
pub(super) fn tell_of_aim(domain: &Aabb, look_at: Option<DVec3>) {
    if let Some(at) = look_at.filter(|at| at.is_finite() && !domain.contains(*at)) {
        note(format!(
            "the place to look at, {at}, lies outside of the box that is drawn, {} to {}: its pictures may be empty",
            domain.min.map(significant),
            domain.max.map(significant)
        ));
    }
}

/// The scene of a picture without its particles: the box, the obstacles, the legend.
pub(super) fn backdrop<'a>(
    camera: &Camera,
    domain: &Aabb,
    legend: &Legend<'_>,
    bodies: impl Iterator<Item = (Drawn, &'a Mesh)>,
) -> Result<Backdrop, Failure> {
    let sharp = sharp(domain, bodies);
    Backdrop::new(camera.clone(), domain, &views(&sharp), legend).map_err(Failure::usage)
}

/// The meshes of the bodies that are drawn in a box, with sharp edges.
pub(super) fn sharp<'a>(
    domain: &Aabb,
    bodies: impl Iterator<Item = (Drawn, &'a Mesh)>,
) -> Vec<(Drawn, Mesh)> {
    let shown = bodies.filter(|(drawn, _)| *drawn != Drawn::Hidden);
    let sharpened = |(drawn, mesh): (Drawn, &Mesh)| match drawn {
        Drawn::Glass(_) => (drawn, split_creases(&open_at_walls(mesh, domain))),
        Drawn::Whole | Drawn::Open(_) | Drawn::Hidden => (drawn, split_creases(mesh)),
    };
    shown.map(sharpened).collect()
}

/// Triangles nearer to a wall of the box than this, in its longest sides, lie on it.
const ON_WALL: f64 = 1e-6;

/// A mesh without its triangles on the walls of a box. A body that extends behind a wall is cut off there;
/// through glass only these cuts would be seen, and not the vessel within them.
fn open_at_walls(mesh: &Mesh, domain: &Aabb) -> Mesh {
    let margin = ON_WALL * domain.size().max_element();
    let (low, high) = (domain.min + margin, domain.max - margin);
    let is_inner = |t: &&[u32; 3]| {
        let corners = t.map(|v| mesh.positions[v as usize]);
        let (below, above) = corners.iter().fold((BVec3::TRUE, BVec3::TRUE), |(below, above), p| {
            (below & p.cmple(low), above & p.cmpge(high))
        });
        !(below | above).any()
    };
    let triangles = mesh.triangles.iter().filter(is_inner).copied().collect();
    Mesh { positions: mesh.positions.clone(), normals: mesh.normals.clone(), triangles, ..Mesh::default() }
}

/// What of these meshes is seen.
pub(super) fn views(bodies: &[(Drawn, Mesh)]) -> Vec<MeshView<'_>> {
    bodies.iter().map(|(drawn, mesh)| view(mesh, *drawn)).collect()
}

fn view(mesh: &Mesh, drawn: Drawn) -> MeshView<'_> {
    let (cut, material) = match drawn {
        Drawn::Open(cut) => (Some(cut), Material::Stone),
        Drawn::Glass(cut) => (cut, Material::Glass),
        Drawn::Whole | Drawn::Hidden => (None, Material::Stone),
    };
    MeshView { cut, material, ..surface(mesh, Material::Stone) }
}

/// A whole mesh of a material.
pub(super) fn surface(mesh: &Mesh, material: Material) -> MeshView<'_> {
    let (vertices, normals) = (&mesh.positions, &mesh.normals);
    MeshView { vertices, normals, triangles: &mesh.triangles, values: &[], cut: None, material }
}

/// The cut that takes away one side of a plane across an axis.
pub(super) fn half(axis: DVec3, at: f64, below: bool) -> Cut {
    if below { Cut { normal: -axis, offset: -at } } else { Cut { normal: axis, offset: at } }
}

/// The cut that takes away the side of a plane towards the eye.
pub(super) fn half_towards_eye(plane: &Plane, camera: &Camera) -> Cut {
    let axis = DVec3::AXES[plane.axis.index()];
    half(axis, plane.value, axis.dot(camera.towards_eye()) < 0.0)
}

/// How a body is drawn that a plane opens, or leaves as it is, or takes away. The body lies between these points.
pub(super) fn opened_by(cut: Cut, points: impl IntoIterator<Item = DVec3>) -> Drawn {
    let beyond = points.into_iter().map(|p| cut.beyond(p));
    let (least, most) = beyond.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    match () {
        () if most <= 0.0 => Drawn::Whole,
        () if least >= 0.0 => Drawn::Hidden,
        () => Drawn::Open(cut),
    }
}

/// How a body of glass is drawn that would otherwise be drawn like this.
pub(super) fn glass(drawn: Drawn) -> Drawn {
    match drawn {
        Drawn::Whole => Drawn::Glass(None),
        Drawn::Open(cut) => Drawn::Glass(Some(cut)),
        Drawn::Hidden | Drawn::Glass(_) => drawn,
    }
}

/// How a body is drawn without hiding much of the fluid, for which the samples stand: whole, without its front half, or
/// not at all.
pub(super) fn out_of_the_way(camera: &Camera, name: &str, mesh: &Mesh, samples: &[DVec3]) -> Drawn {
    let hides = |drawn| render::hidden(camera, &view(mesh, drawn), samples) > MOST_HIDDEN;
    if !hides(Drawn::Whole) {
        return Drawn::Whole;
    }
    let towards_eye = camera.towards_eye();
    let axis = towards_eye.abs().max_position();
    let bounds = samples.iter().fold(Aabb::EMPTY, |all, p| all.including(*p));
    let at = rounded(bounds.centre()[axis], bounds.size()[axis]);
    let open = Drawn::Open(half(DVec3::AXES[axis], at, towards_eye[axis] < 0.0));
    if !hides(open) {
        return open;
    }
    note(format!(
        "pictures leave out the obstacle `{name}`, which hides the fluid even when it is cut in half: --cut none draws it"
    ));
    Drawn::Hidden
}

/// A coordinate with enough digits to distinguish parts of a size.
fn rounded(at: f64, size: f64) -> f64 {
    let step = 10f64.powf(size.log10().floor() - 2.0);
    let found = (at / step).round() * step;
    // read back from digits, so that a title shows no others
    format!("{found:.9}").parse().ok().filter(|x: &f64| x.is_finite() && size > 0.0).unwrap_or(at)
}

/// What was done to obstacles, in words for a title.
pub(super) fn described(names: &[&str], drawn: &[Drawn]) -> Vec<String> {
    let mut done: Vec<(String, Vec<&str>)> = Vec::new();
    for (name, drawn) in names.iter().zip(drawn) {
        let what = match drawn {
            // that an obstacle is clear is seen
            Drawn::Whole | Drawn::Glass(None) => continue,
            Drawn::Hidden => "left out".to_string(),
            Drawn::Open(cut) | Drawn::Glass(Some(cut)) => {
                let axis = cut.normal.abs().max_position();
                format!("cut at {} = {}", ["x", "y", "z"][axis], cut.offset * cut.normal[axis] + 0.0)
            }
        };
        match done.iter_mut().find(|(known, _)| *known == what) {
            Some((_, names)) if names.contains(name) => {}
            Some((_, names)) => names.push(name),
            None => done.push((what, vec![name])),
        }
    }
    let words = done.into_iter().map(|(what, names)| {
        let few = names.len() <= NAMED;
        let who = if few { names.join(", ") } else { format!("{} obstacles", names.len()) };
        format!("{who} {what}")
    });
    words.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane cuts what lies on both of its sides, and a title says no more.
    #[test]
    fn a_plane_that_misses_a_body_does_not_cut_it() {
        let body = Aabb::new(DVec3::ZERO, DVec3::ONE).corners();
        let drawn = |at: f64| opened_by(half(DVec3::X, at, false), body);
        let words = |drawn: Drawn| described(&["blade"], &[drawn]);
        assert_eq!(words(drawn(0.5)), ["blade cut at x = 0.5"]);
        assert_eq!(words(drawn(2.0)), [""; 0]);
        assert_eq!(words(drawn(-1.0)), ["blade left out"]);
        assert_eq!(words(glass(drawn(0.5))), ["blade cut at x = 0.5"]);
        assert_eq!(words(glass(drawn(2.0))), [""; 0]);
    }

    /// A wall across a box extends behind its floor: the triangle on the floor is left out, and one that only
    /// touches it stays.
    #[test]
    fn cuts_at_the_walls_of_a_box_are_not_of_glass() {
        let corners =
            [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(DVec3::from_array);
        let mesh = Mesh::from_triangles(corners.to_vec(), vec![[0, 2, 1], [0, 1, 3], [1, 2, 3]]);
        let box_below = Aabb::new(DVec3::new(-1.0, -1.0, 0.0), DVec3::splat(2.0));
        let open = open_at_walls(&mesh, &box_below);
        assert_eq!(open.triangles, [[0, 1, 3], [1, 2, 3]]);
        assert_eq!(open_at_walls(&mesh, &box_below.grown(0.5)).triangles, mesh.triangles);
    }
}
