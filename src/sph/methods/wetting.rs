//! How much of the walls near a particle is wet.
//!
//! A fluid under tension has a pressure up to its edge on a wall. A wall that took its whole part of a kernel
//! there would push the outermost row of particles off, as if the fluid went on beside the drop. So the wall takes as
//! much as an image of the fluid in it does: at a right angle, which is the one at which surfaces under tension meet
//! walls, drop and image are one round body. The image is that in the plane which takes as much of the kernel as the
//! walls do. In corners one image is too little, and there the fluid's own part of the kernel counts.

use fearless_simd::{Simd, SimdFloat};
use glam::DVec3;

use super::near_walls::NearWalls;
use crate::sph::{
    core::Core,
    kernel::Wendland,
    pairs::{PairPass, Real},
    particles::Vectors,
    walls::{Coverage, Wall},
};

/// The planes that mirror the fluid at particles near walls, and how far these are wet.
#[derive(Default)]
pub(super) struct Wetting {
    walls: NearWalls<Plane>,
    /// Normals of the planes, into the fluid; zero where no wall is near.
    normal: Vectors,
    /// Distances of the particles, m; out of reach where no wall is near.
    distance: Vec<f64>,
}

/// The plane that takes as much of the kernel of a particle as the walls near it do.
#[derive(Clone, Copy)]
pub(super) struct Plane {
    /// Into the fluid.
    pub normal: DVec3,
    /// Distance of the particle, m.
    pub distance: f64,
    /// What it adds to a sum over a lattice of particles.
    pub filled: f64,
}

/// The distance of a plane whose images are out of reach, in support radii.
const OUT_OF_REACH: f64 = 2.0;

/// Sums of particles in disorder are this much less than those of a lattice, in parts. What is whole up to that is whole.
const DISORDER: f64 = 0.05;

impl Plane {
    /// The plane of what walls that are not in layers take.
    fn of(wall: &Wall, taken: &Coverage) -> Self {
        let distance = wall.h * wall.distance_of(taken.part);
        Self { normal: -taken.gradient.normalize_or_zero(), distance, filled: taken.filled }
    }
}

impl Wetting {
    /// Finds the planes for the present places of the particles, and tells the core how wet the walls are.
    pub fn find(&mut self, core: &mut Core) {
        let (n, h) = (core.particles.len(), core.parameters.support_radius);
        self.walls.find(core, |i| Some(Plane::of(core.wall(), &core.coverage_by_whole_walls(i)?)));
        if !self.any() {
            return;
        }
        for component in self.normal.components_mut() {
            component.clear();
        }
        self.normal.resize(n);
        self.distance.clear();
        self.distance.resize(n, OUT_OF_REACH * h);
        for (i, plane) in self.walls.found() {
            let i = *i as usize;
            self.normal.set(i, plane.normal);
            self.distance[i] = plane.distance;
        }
        let kernel = Wendland::new(h);
        let parameters = &core.parameters;
        let volume = parameters.volume_in_sums();
        let whole = Wendland::lattice_sum(h / parameters.spacing());
        let pass = Fullness { kernel, weight: kernel.weight * volume / whole, walls: &self.walls };
        let mut wet = std::mem::take(&mut core.wet);
        wet.resize(n, 0.0);
        core.sum(&pass, self.planes(), [&mut wet]);
        core.wet = wet;
    }

    /// Whether a wall is near any particle.
    pub fn any(&self) -> bool {
        !self.walls.found().is_empty()
    }

    /// Normals and distances of the planes.
    pub fn planes(&self) -> [&[f64]; 4] {
        [&self.normal.x, &self.normal.y, &self.normal.z, &self.distance]
    }

    /// The plane at a particle; `None` if no wall is near.
    pub fn plane(&self, i: usize) -> Option<&Plane> {
        self.walls.near(i)
    }

    pub fn bytes(&self) -> usize {
        self.walls.bytes() + self.normal.bytes() + 8 * self.distance.capacity()
    }
}

/// Sums the fluid and its image. It reads the plane of each particle.
#[derive(Clone, Copy)]
struct Fullness<'a> {
    kernel: Wendland,
    /// w·V over the sum of a lattice.
    weight: f64,
    walls: &'a NearWalls<Plane>,
}

impl PairPass<4, 2, 1> for Fullness<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        plane: &[V; 4],
        _: [V; 4],
        sums: &mut [V; 2],
    ) {
        let of = V::Element::of;
        let weight = |r2: V| {
            let s = self.kernel.nearness(r2);
            let f = s * s;
            // 1 + 4q = 5 − 4s
            f * f * s.mul_add(of(-4.0), of(5.0))
        };
        let Image { r2: image, .. } = from_image(plane, d, r2);
        sums[0] += weight(r2);
        sums[1] += weight(image);
    }

    fn finish(&self, i: usize, sums: [f64; 2]) -> [f64; 1] {
        let Some(plane) = self.walls.near(i) else { return [1.0] };
        let wall = plane.filled;
        let [fluid, image] = sums.map(|sum| self.weight * sum);
        // in corners and gaps more than half a kernel may lie behind walls, and then little fluid has room
        let wet = (image / wall).max(fluid / (1.0 - wall).max(wall));
        [((1.0 + DISORDER) * wet).min(1.0)]
    }
}

/// The image of a neighbour in a plane.
pub(super) struct Image<V> {
    /// The way from it.
    pub d: [V; 3],
    /// Its square.
    pub r2: V,
    /// 1 if it is the neighbour's mirror image, 0 if the neighbour is behind the plane, as at a curved wall, and is its
    /// own image.
    pub is_mirrored: V,
}

/// The image in a plane of the neighbour from which the way `d` comes, with its square.
#[inline(always)]
pub(super) fn from_image<S: Simd, V: SimdFloat<S, Element: Real>>(
    &[x, y, z, distance]: &[V; 4],
    d: [V; 3],
    r2: V,
) -> Image<V> {
    let of = V::Element::of;
    let across = z.mul_add(d[2], y.mul_add(d[1], x * d[0]));
    let before = distance - across;
    let twice = before + before.abs();
    let way = [twice.mul_add(x, d[0]), twice.mul_add(y, d[1]), twice.mul_add(z, d[2])];
    // rounding must not make a root of less than nothing
    let square = twice.mul_add(across + across + twice, r2).max(of(0.0));
    Image { d: way, r2: square, is_mirrored: (twice * of(MANY)).min(of(1.0)) }
}

/// Makes one or more of any length, m, that is not zero.
const MANY: f64 = 1e30;
