//! λ and K between the nodes of a lattice, as a spline whose coefficients lie in bricks.

use std::{
    ops::Range,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
};

use glam::{DMat3, DVec3, Vec3, Vec4};

use super::{
    super::symmetric::Symmetric,
    fractions::{Fractions, TILE, Tile},
    lattice::Lattice,
    sparse::Sparse,
    stencil::{Added, REACH, Row, Stencil},
};
use crate::{field::Walls, geom::Aabb};

/// Nodes along the side of a brick.
const BRICK: usize = 4;

/// Nodes of the spline before the first of the lattice.
const BEFORE: usize = 1;

/// Cells along the side of the block that a brick's nodes depend on.
const BLOCK: usize = BRICK - 1 + 2 * REACH;

/// What bodies take of a kernel.
#[derive(Debug, Clone, Copy)]
pub(in crate::sph) struct Taken {
    /// λ of what they take inside the box.
    pub part: f64,
    /// ∇λ, 1/m.
    pub gradient: DVec3,
    /// K = ∫ y ⊗ ∇W, y from the particle.
    pub moment: Symmetric,
    /// −∂λ/∂t, 1/s: ∇λ·v for bodies that move with the velocity v.
    pub sweep: f64,
    /// The velocity v of bodies that move with one, m/s; `None` if they do not move, or change their shape.
    pub velocity: Option<DVec3>,
}

impl Taken {
    /// What turned bodies take.
    pub fn turned(&self, rotation: &DMat3) -> Self {
        Self { gradient: *rotation * self.gradient, moment: self.moment.turned(rotation), ..*self }
    }

    /// That of two bodies beside each other, of which one may change its shape.
    pub fn beside(&self, other: &Self) -> Self {
        Self {
            part: (self.part + other.part).min(1.0),
            gradient: self.gradient + other.gradient,
            moment: self.moment + other.moment,
            sweep: self.sweep + other.sweep,
            velocity: None,
        }
    }

    /// What bodies take that move with one velocity, m/s.
    pub fn moving(&self, velocity: DVec3) -> Self {
        Self { sweep: self.gradient.dot(velocity), velocity: Some(velocity), ..*self }
    }
}

/// Nodes of a brick.
const NODES: usize = BRICK * BRICK * BRICK;

/// Coefficients of the spline.
#[repr(align(64))]
pub(super) struct Brick {
    /// x runs first.
    nodes: [Node; NODES],
}

impl Brick {
    /// The sum of bricks with weights, and with other weights the rate at which its λ changes. `None` if
    /// there are none.
    pub fn sum<'a>(terms: impl Iterator<Item = (Option<&'a Brick>, f64, f64)>) -> Option<Box<Self>> {
        let mut sum = None;
        for (brick, weight, rate) in terms {
            let Some(brick) = brick else { continue };
            let sum = sum.get_or_insert_with(|| Box::new(NOTHING));
            let (weight, rate) = (weight as f32, rate as f32);
            for (node, added) in sum.nodes.iter_mut().zip(&brick.nodes) {
                node.diagonal += weight * added.diagonal;
                node.others += weight * added.others;
                node.others.w += rate * added.diagonal.w;
            }
        }
        sum
    }
}

/// Coefficients at a node.
#[derive(Clone, Copy, Default)]
struct Node {
    /// xx, yy and zz of K, and λ.
    diagonal: Vec4,
    /// yz, zx and xy of K, and ∂λ/∂t, 1/s, of what changes its shape.
    others: Vec4,
}

/// A brick without bodies near.
const NOTHING: Brick = Brick { nodes: [Node { diagonal: Vec4::ZERO, others: Vec4::ZERO }; NODES] };

/// The nodes of a lattice, in bricks that are made on demand.
pub(super) struct Spline {
    lattice: Arc<Lattice>,
    /// `None` where no body is near.
    bricks: Sparse<Option<Box<Brick>>>,
}

impl Spline {
    /// No bricks yet. `None` if there are more than 10⁶ cells along the sides of the box.
    pub fn new(lattice: &Arc<Lattice>) -> Option<Self> {
        let bricks = Sparse::new(lattice.cells.map(|n| (n + 3) / BRICK + 1))?;
        Some(Self { lattice: lattice.clone(), bricks })
    }

    /// What bodies take of the kernel at a place in the box; `None` if none is near. Bricks are made by their indices.
    #[inline]
    pub fn at(&self, p: DVec3, make: impl Fn([usize; 3]) -> Option<Box<Brick>>) -> Option<Taken> {
        let Lattice { domain, step, cells } = &*self.lattice;
        let u = (p - domain.min) / step;
        let cell: [usize; 3] = std::array::from_fn(|axis| (u[axis].max(0.0) as usize).min(cells[axis] - 1));
        // the nodes cell − 1 to cell + 2 along each axis have the indices cell to cell + 3, in one or two bricks
        let first = cell.map(|n| n / BRICK);
        let mut is_near = false;
        let bricks: [&Brick; 8] = std::array::from_fn(|corner| {
            let is_second: [usize; 3] = std::array::from_fn(|axis| corner >> axis & 1);
            let is_touched = (0..3).all(|axis| is_second[axis] == 0 || !cell[axis].is_multiple_of(BRICK));
            let brick = if is_touched {
                let at = std::array::from_fn(|axis| first[axis] + is_second[axis]);
                self.bricks.get(at, || make(at)).as_deref()
            } else {
                None
            };
            is_near |= brick.is_some();
            brick.unwrap_or(const { &NOTHING })
        });
        if !is_near {
            return None;
        }
        let weights = [0, 1, 2].map(|axis| Weights::at(u[axis] - cell[axis] as f64));
        let sums = Sums::over(&bricks, cell.map(|n| n % BRICK), &weights);
        let Sums { diagonal, others, slopes } = sums;
        // a spline overshoots where it fades away
        (diagonal.w > 0.0).then(|| Taken {
            part: f64::from(diagonal.w),
            gradient: slopes.as_dvec3() / *step,
            moment: Symmetric::new(diagonal.truncate().as_dvec3(), others.truncate().as_dvec3()),
            sweep: -f64::from(others.w),
            velocity: None,
        })
    }
}

/// A map of λ and K.
pub(super) struct VolumeMap {
    spline: Spline,
    stencil: Arc<Stencil>,
    fractions: Fractions,
    /// Memory of the bricks, bytes.
    bytes: AtomicUsize,
}

impl VolumeMap {
    /// The map of bodies in a box, for a support radius, m. `None` if there are no bodies, or more than 10⁶ cells along
    /// the sides of the box.
    pub fn new(bodies: Vec<Arc<dyn Walls>>, domain: &Aabb, h: f64) -> Option<Self> {
        if bodies.is_empty() {
            return None;
        }
        let lattice = Arc::new(Lattice::new(domain, h));
        let stencil = Arc::new(Stencil::new(&lattice, h));
        Self::on(&lattice, &stencil, bodies)
    }

    /// The map of bodies on a lattice, with its weights.
    pub fn on(lattice: &Arc<Lattice>, stencil: &Arc<Stencil>, bodies: Vec<Arc<dyn Walls>>) -> Option<Self> {
        let fractions = Fractions::new(bodies, lattice)?;
        let spline = Spline::new(lattice)?;
        Some(Self { spline, stencil: stencil.clone(), fractions, bytes: AtomicUsize::new(0) })
    }

    /// Memory of what has been made so far, bytes.
    pub fn bytes(&self) -> usize {
        self.bytes.load(Ordering::Relaxed)
    }

    /// Whether the map holds a place.
    pub fn reaches(&self, p: DVec3) -> bool {
        self.spline.lattice.domain.contains(p)
    }

    /// What the bodies take of the kernel at a place in the box; `None` if none is near.
    pub fn at(&self, p: DVec3) -> Option<Taken> {
        self.spline.at(p, |at| self.make(at))
    }

    /// A brick, by its indices; `None` where no body is near.
    pub fn brick(&self, at: [usize; 3]) -> Option<&Brick> {
        self.spline.bricks.get(at, || self.make(at)).as_deref()
    }

    /// Makes a brick from the cells around it.
    fn make(&self, at: [usize; 3]) -> Option<Box<Brick>> {
        // the first cell that its first node depends on, which may lie before the lattice
        let first = at.map(|n| (n * BRICK) as isize - (BEFORE + REACH) as isize);
        let rows = self.block(first)?;
        self.bytes.fetch_add(size_of::<Brick>(), Ordering::Relaxed);
        let mut brick = Box::new(Brick { nodes: [Node::default(); NODES] });
        for (line, nodes) in brick.nodes.chunks_mut(BRICK).enumerate() {
            let [j, k] = [line % BRICK, line / BRICK];
            let mut added = [Added::default(); BRICK];
            for line in self.stencil.lines() {
                let [b, c] = line.at;
                let row = &rows[j + b + BLOCK * (k + c)];
                if !row.is_empty() {
                    self.stencil.add(line, row, &mut added);
                }
            }
            for (node, added) in nodes.iter_mut().zip(added) {
                let [part, xx, yy, zz, yz, zx, xy] = added.total();
                *node = Node { diagonal: Vec4::new(xx, yy, zz, part), others: Vec4::new(yz, zx, xy, 0.0) };
            }
        }
        Some(brick)
    }

    /// How far the cells of a block from `first` on are filled, in rows along x; `None` if all are empty.
    fn block(&self, first: [isize; 3]) -> Option<Vec<Row>> {
        let spans: [_; 3] = std::array::from_fn(|axis| {
            let low = first[axis].max(0) as usize;
            let high =
                (first[axis] + BLOCK as isize).clamp(0, self.spline.lattice.cells[axis] as isize) as usize;
            low..high
        });
        let [is, js, ks] = spans;
        let tiles = |span: &Range<usize>| span.start / TILE..span.end.div_ceil(TILE);
        let within =
            |span: &Range<usize>, tile: usize| span.start.max(tile * TILE)..span.end.min((tile + 1) * TILE);
        let mut rows = Vec::new();
        // tiles that follow one another along x do so in the order in which rows are filled
        for [ti, tj, tk] in places(tiles(&is), tiles(&js), tiles(&ks)) {
            let tile = self.fractions.tile(&self.spline.lattice, [ti, tj, tk]);
            if matches!(tile, Tile::Empty) {
                continue;
            }
            rows.resize_with(BLOCK * BLOCK, Row::default);
            for at in places(within(&is, ti), within(&js, tj), within(&ks, tk)) {
                let [a, b, c] = [0, 1, 2].map(|axis| (at[axis] as isize - first[axis]) as usize);
                rows[b + BLOCK * c].push(a, tile.cell(at.map(|n| n % TILE)));
            }
        }
        (!rows.is_empty()).then_some(rows)
    }
}

/// All places with indices in these ranges, the first index fastest.
fn places(is: Range<usize>, js: Range<usize>, ks: Range<usize>) -> impl Iterator<Item = [usize; 3]> {
    ks.flat_map(move |k| {
        let is = is.clone();
        js.clone().flat_map(move |j| is.clone().map(move |i| [i, j, k]))
    })
}

/// The cubic B-spline of four nodes and its derivative at a place.
struct Weights {
    values: [f32; 4],
    slopes: [f32; 4],
}

impl Weights {
    /// At t between the second and the third node.
    #[inline]
    fn at(t: f64) -> Self {
        let s = 1.0 - t;
        let inner = |t: f64| 2.0 / 3.0 - t * t + 0.5 * t * t * t;
        let slope = |t: f64| -2.0 * t + 1.5 * t * t;
        let single = |weights: [f64; 4]| weights.map(|weight| weight as f32);
        Self {
            values: single([s * s * s / 6.0, inner(t), inner(s), t * t * t / 6.0]),
            slopes: single([-0.5 * s * s, slope(t), -slope(s), 0.5 * t * t]),
        }
    }
}

/// Sums over the 64 nodes around a place.
#[derive(Default)]
struct Sums {
    diagonal: Vec4,
    others: Vec4,
    /// The derivatives of λ, by cells.
    slopes: Vec3,
}

impl Sums {
    /// The sums over nodes in two by two by two bricks, which begin at `at` in the first of them.
    #[inline]
    fn over(bricks: &[&Brick; 8], at: [usize; 3], [x, y, z]: &[Weights; 3]) -> Self {
        let mut sums = Self::default();
        let mut of_slopes = [Vec4::ZERO; 3];
        for k in 0..4 {
            let in_z = at[2] + k;
            for j in 0..4 {
                let in_y = at[1] + j;
                let corner = 2 * (in_y / BRICK) + 4 * (in_z / BRICK);
                let row = BRICK * (in_y % BRICK + BRICK * (in_z % BRICK));
                // along x first
                let [mut diagonal, mut others, mut slope] = [Vec4::ZERO; 3];
                for i in 0..4 {
                    let in_x = at[0] + i;
                    let node = &bricks[corner + in_x / BRICK].nodes[row + in_x % BRICK];
                    diagonal += x.values[i] * node.diagonal;
                    others += x.values[i] * node.others;
                    slope += x.slopes[i] * node.diagonal;
                }
                let weight = y.values[j] * z.values[k];
                sums.diagonal += weight * diagonal;
                sums.others += weight * others;
                of_slopes[0] += weight * slope;
                of_slopes[1] += y.slopes[j] * z.values[k] * diagonal;
                of_slopes[2] += y.values[j] * z.slopes[k] * diagonal;
            }
        }
        sums.slopes = Vec3::from_array(of_slopes.map(|sum| sum.w));
        sums
    }
}
