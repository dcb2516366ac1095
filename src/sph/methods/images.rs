//! Walls as planes in which a fluid has images.
//!
//! At a right angle, which is the one at which surfaces under tension meet walls, a body of fluid and its images make
//! one round body. In an edge of right-angled walls a neighbour has three images, and in a corner seven: those in each
//! wall, and those of these in the others; walls that face each other mirror in turn, too, from the nearer one on. An
//! obstacle counts as one plane. Where that is none, in its own edges and where walls meet at other angles, there is
//! one image in the plane that takes as much of a kernel as they do, and normals are those of the fluid and of what the
//! walls take. (One plane in place of the walls of an edge or a corner makes the curvature of a round drop there 13 or
//! 32 % too large, and such a drop of water with a radius of 1 mm throws itself off the walls.)

use std::ops::Range;

use fearless_simd::{Simd, SimdFloat};
use glam::DVec3;
use smallvec::SmallVec;

use super::near_walls::NearWalls;
use crate::sph::{
    core::Core,
    pairs::Real,
    particles::Vectors,
    walls::{Coverage, Wall},
};

/// Most planes near one particle. There may be more in a narrow vessel, and then the nearest count.
const MOST: usize = 3;

/// Number of columns of the planes: three for the normal, and one for the distance.
pub(super) const COLUMNS: usize = 4 * MOST;

/// Number of columns of the first `count` planes.
pub(super) fn columns_of(count: usize) -> usize {
    4 * count
}

/// Walls whose normals have a cosine of less than this stand at a right angle.
const UPRIGHT: f64 = 0.3;

/// Walls whose normals have a cosine of less than minus this face each other.
const FACING: f64 = 0.95;

/// The distance of a plane whose images are out of reach, in support radii.
const OUT_OF_REACH: f64 = 2.0;

/// A wall whose part of a kernel grows towards it by less than this part of what that of a plane with the same part
/// does, is none. (For balls of four support radii it is 0.98 to 1, in an edge beside a first layer 0.86 to 0.97.)
const FLAT: f64 = 0.98;

/// Obstacles that take less than this part of a kernel are not near. Maps know it to 0.004.
const LEAST_TAKEN: f64 = 0.004;

/// A wall near a particle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Plane {
    /// Into the fluid.
    pub normal: DVec3,
    /// Distance of the particle, m.
    pub distance: f64,
}

/// The walls near a particle.
pub(super) struct Planes {
    /// One to [`MOST`].
    pub each: SmallVec<[Plane; MOST]>,
    /// What all of them add to a sum over a lattice of particles.
    pub filled: f64,
    /// How they move along what they take of the kernel, m/s: one velocity for all of them.
    velocity: DVec3,
    /// Whether fluid and images fill the kernel, as they do where each of the walls is a plane.
    pub are_mirrors: bool,
}

/// The planes near all particles.
#[derive(Default)]
pub(super) struct Mirrors {
    walls: NearWalls<Planes>,
    /// Normals, zero where there is no such plane, and distances, m, which then are out of reach.
    columns: [(Vectors, Vec<f64>); MOST],
    /// Velocities of the walls across them, m/s; zero where none is near.
    pub velocity: Vectors,
    /// Number of planes near each particle.
    count: Vec<u8>,
}

impl Planes {
    /// The planes near a particle; `None` if no wall is.
    fn near(core: &Core, i: usize) -> Option<Self> {
        let whole = core.coverage_by_whole_walls(i)?;
        let joint = Plane::of(core.wall(), &whole);
        let is_flat = joint.is_flat(core.wall(), &whole);
        let mut each: SmallVec<[Plane; MOST]> =
            core.box_faces(i).map(|(normal, distance)| Plane { normal, distance }).collect();
        let mut are_mirrors = true;
        if let Some((obstacles, taken)) = Plane::of_obstacles(core, i, &whole) {
            are_mirrors = obstacles.is_flat(core.wall(), &taken);
            each.push(obstacles);
        }
        each.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        each.truncate(MOST);
        let alone = each.len() < 2;
        let is_mirror = |a: &Plane, b: &Plane| {
            let cosine = a.normal.dot(b.normal);
            cosine.abs() < UPRIGHT || cosine < -FACING
        };
        let mirror_in_turn =
            each.iter().enumerate().all(|(k, a)| each[k + 1..].iter().all(|b| is_mirror(a, b)));
        if alone || !mirror_in_turn || !are_mirrors {
            // of walls that look the same way one is behind the other, and both together may be a plane
            (each, are_mirrors) = (SmallVec::from_slice(&[joint]), is_flat);
        }
        let steep = whole.gradient.length_squared();
        let velocity = if steep > 0.0 { whole.sweep / steep * whole.gradient } else { DVec3::ZERO };
        Some(Self { each, filled: whole.filled, velocity, are_mirrors })
    }
}

impl Plane {
    /// The plane of what walls that are not in layers take.
    fn of(wall: &Wall, taken: &Coverage) -> Self {
        let distance = wall.h * wall.distance_of(taken.part);
        Self { normal: -taken.gradient.normalize_or_zero(), distance }
    }

    /// Whether what takes as much of the kernel as this plane is one.
    fn is_flat(&self, wall: &Wall, taken: &Coverage) -> bool {
        taken.gradient.length() * wall.h > FLAT * wall.kernel.slope(self.distance / wall.h)
    }

    /// The plane of what obstacles take of what the walls of the box leave of a kernel, and what they take.
    fn of_obstacles(core: &Core, i: usize, whole: &Coverage) -> Option<(Self, Coverage)> {
        if core.boundary.is_box() {
            return None;
        }
        let of_box = core.coverage_by_box(i);
        let left = 1.0 - of_box.part;
        let part = (whole.part - of_box.part) / left;
        if left <= 0.0 || part < LEAST_TAKEN {
            return None;
        }
        // whole = box + (1 − box)·obstacles
        let gradient = (whole.gradient - (1.0 - part) * of_box.gradient) / left;
        let taken = Coverage { part, gradient, ..Coverage::default() };
        Some((Self::of(core.wall(), &taken), taken))
    }
}

impl Mirrors {
    /// Finds the planes for the present places of the particles.
    pub fn find(&mut self, core: &Core) {
        let (n, h) = (core.particles.len(), core.parameters.support_radius);
        self.walls.find(core, |i| Planes::near(core, i));
        if !self.any() {
            return;
        }
        self.count.clear();
        self.count.resize(n, 0);
        for (normal, distance) in &mut self.columns {
            normal.components_mut().into_iter().for_each(Vec::clear);
            normal.resize(n);
            distance.clear();
            distance.resize(n, OUT_OF_REACH * h);
        }
        self.velocity.components_mut().into_iter().for_each(Vec::clear);
        self.velocity.resize(n);
        for (i, near) in self.walls.found() {
            let i = *i as usize;
            self.velocity.set(i, near.velocity);
            self.count[i] = near.each.len() as u8;
            for (plane, (normal, distance)) in near.each.iter().zip(&mut self.columns) {
                normal.set(i, plane.normal);
                distance[i] = plane.distance;
            }
        }
    }

    /// Whether a wall is near any particle.
    pub fn any(&self) -> bool {
        !self.walls.found().is_empty()
    }

    /// The most planes near one of these particles, which follow one another.
    pub fn most(&self, particles: Range<usize>) -> usize {
        self.count[particles].iter().copied().max().unwrap_or(0).into()
    }

    /// Columns for sums over pairs: those of a pass, and behind them those of the planes, which are the last [`COLUMNS`]
    /// of them all.
    pub fn columns_after<'a, const OWN: usize, const ALL: usize>(
        &'a self,
        own: [&'a [f64]; OWN],
    ) -> [&'a [f64]; ALL] {
        const { assert!(ALL == OWN + COLUMNS) };
        let mut all: [&[f64]; ALL] = [&[]; ALL];
        let (first, of_planes) = all.split_at_mut(OWN);
        first.copy_from_slice(&own);
        for (plane, (Vectors { x, y, z }, distance)) in of_planes.chunks_exact_mut(4).zip(&self.columns) {
            plane.copy_from_slice(&[x, y, z, distance]);
        }
        all
    }

    /// The planes near a particle; `None` if no wall is near.
    pub fn near(&self, i: usize) -> Option<&Planes> {
        self.walls.near(i)
    }

    pub fn bytes(&self) -> usize {
        let of = |(normal, distance): &(Vectors, Vec<f64>)| normal.bytes() + 8 * distance.capacity();
        self.walls.bytes()
            + self.velocity.bytes()
            + self.count.capacity()
            + self.columns.iter().map(of).sum::<usize>()
    }
}

/// An image of a neighbour.
#[derive(Clone, Copy)]
pub(super) struct Image<V> {
    /// The way from it.
    pub d: [V; 3],
    /// Its square.
    pub r2: V,
    /// A direction at the neighbour, mirrored with it.
    pub direction: [V; 3],
}

/// Calls `with` for each image of a neighbour in the first `count` planes, which begin at `planes[0]`.
#[inline(always)]
pub(super) fn for_each<S: Simd, V: SimdFloat<S, Element: Real>>(
    count: usize,
    planes: &[V],
    neighbour: Image<V>,
    mut with: impl FnMut(Image<V>),
) {
    for mirrored in 1..1_usize << count {
        let mut image = neighbour;
        for k in (0..count).filter(|k| mirrored >> k & 1 == 1) {
            let (normal, distance) =
                ([planes[4 * k], planes[4 * k + 1], planes[4 * k + 2]], planes[4 * k + 3]);
            image = image.in_plane(normal, distance);
        }
        with(image);
    }
}

impl<V> Image<V> {
    /// The image in a plane. A neighbour behind it, as there may be at a curved wall, is its own image.
    #[inline(always)]
    fn in_plane<S: Simd>(self, [x, y, z]: [V; 3], distance: V) -> Self
    where
        V: SimdFloat<S, Element: Real>,
    {
        let of = V::Element::of;
        let Self { d, r2, direction } = self;
        let across = z.mul_add(d[2], y.mul_add(d[1], x * d[0]));
        let before = distance - across;
        let twice = before + before.abs();
        let way = [twice.mul_add(x, d[0]), twice.mul_add(y, d[1]), twice.mul_add(z, d[2])];
        // rounding must not make a root of less than nothing
        let square = twice.mul_add(across + across + twice, r2).max(of(0.0));
        let is_mirrored = (twice * of(MANY)).min(of(1.0));
        let along = z.mul_add(direction[2], y.mul_add(direction[1], x * direction[0])) * is_mirrored;
        let back = along + along;
        let direction = [direction[0] - back * x, direction[1] - back * y, direction[2] - back * z];
        Self { d: way, r2: square, direction }
    }
}

/// Makes one or more of any length, m, that is not zero.
const MANY: f64 = 1e30;

/// A pass that counts the images of each neighbour, too.
#[derive(Clone, Copy)]
pub(super) struct WithImages<'a, P> {
    pub pass: P,
    pub mirrors: &'a Mirrors,
    /// Number of planes.
    pub count: usize,
}

impl<'a, P> WithImages<'a, P> {
    /// A pass over these planes. They are columns behind those of the pass itself.
    pub fn new(pass: P, mirrors: &'a Mirrors) -> Self {
        Self { pass, mirrors, count: 0 }
    }

    /// The pass for some particles, with as many planes as they need.
    pub fn in_block(self, particles: Range<usize>) -> Self {
        Self { count: self.mirrors.most(particles), ..self }
    }
}
