//! λ and K between the nodes of a lattice, as a spline whose coefficients lie in bricks.

use std::{
    ops::Range,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
};

use glam::{DMat3, DVec3};

use super::{
    super::symmetric::Symmetric,
    fractions::{Fractions, TILE, Tile},
    lattice::Lattice,
    sparse::Sparse,
    stencil::{REACH, Row, SIDE, Stencil},
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
}

impl Taken {
    /// What turned bodies take.
    pub fn turned(&self, rotation: &DMat3) -> Self {
        let Self { part, gradient, moment } = *self;
        Self { part, gradient: *rotation * gradient, moment: moment.turned(rotation) }
    }
}

/// Coefficients of the spline.
struct Brick {
    part: [f64; BRICK * BRICK * BRICK],
    moment: [[f32; 8]; BRICK * BRICK * BRICK],
}

/// A brick without bodies near.
static NOTHING: Brick = Brick { part: [0.0; 64], moment: [[0.0; 8]; 64] };

/// A map of λ and K.
pub(super) struct VolumeMap {
    lattice: Lattice,
    stencil: Stencil,
    fractions: Fractions,
    /// `None` where no body is near.
    bricks: Sparse<Option<Box<Brick>>>,
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
        let lattice = Lattice::new(domain, h);
        let fractions = Fractions::new(bodies, &lattice)?;
        let bricks = Sparse::new(lattice.cells.map(|n| (n + 3) / BRICK + 1))?;
        let stencil = Stencil::new(&lattice, h);
        Some(Self { stencil, lattice, fractions, bricks, bytes: AtomicUsize::new(0) })
    }

    /// Memory of what has been made so far, bytes.
    pub fn bytes(&self) -> usize {
        self.bytes.load(Ordering::Relaxed)
    }

    /// Whether the map holds a place.
    pub fn reaches(&self, p: DVec3) -> bool {
        self.lattice.domain.contains(p)
    }

    /// What the bodies take of the kernel at a place in the box; `None` if none is near.
    pub fn at(&self, p: DVec3) -> Option<Taken> {
        let Lattice { domain, step, cells } = &self.lattice;
        let u = (p - domain.min) / step;
        let cell: [usize; 3] = std::array::from_fn(|axis| (u[axis].max(0.0) as usize).min(cells[axis] - 1));
        // the nodes cell − 1 to cell + 2 along each axis have the indices cell to cell + 3, in one or two bricks
        let first = cell.map(|n| n / BRICK);
        let mut is_near = false;
        let bricks: [&Brick; 8] = std::array::from_fn(|corner| {
            let is_second: [usize; 3] = std::array::from_fn(|axis| corner >> axis & 1);
            let is_touched = (0..3).all(|axis| is_second[axis] == 0 || !cell[axis].is_multiple_of(BRICK));
            let brick = if is_touched {
                self.brick(std::array::from_fn(|axis| first[axis] + is_second[axis]))
            } else {
                None
            };
            is_near |= brick.is_some();
            brick.unwrap_or(&NOTHING)
        });
        if !is_near {
            return None;
        }
        let t = [0, 1, 2].map(|axis| weights(u[axis] - cell[axis] as f64));
        let sums = Sums::over(&bricks, cell.map(|n| n % BRICK), &t);
        // a spline overshoots where it fades away
        (sums.part > 0.0).then(|| {
            let [xx, yy, zz, yz, zx, xy, ..] = sums.moment.map(f64::from);
            Taken {
                part: sums.part,
                gradient: DVec3::from_array(sums.gradient) / *step,
                moment: Symmetric::new(DVec3::new(xx, yy, zz), DVec3::new(yz, zx, xy)),
            }
        })
    }

    fn brick(&self, at: [usize; 3]) -> Option<&Brick> {
        self.bricks.get(at, || self.make(at)).as_deref()
    }

    /// Makes a brick from the cells around it.
    fn make(&self, at: [usize; 3]) -> Option<Box<Brick>> {
        // the first cell that its first node depends on, which may lie before the lattice
        let first = at.map(|n| (n * BRICK) as isize - (BEFORE + REACH) as isize);
        let rows = self.block(first)?;
        self.bytes.fetch_add(size_of::<Brick>(), Ordering::Relaxed);
        let mut brick = Box::new(Brick { part: [0.0; 64], moment: [[0.0; 8]; 64] });
        for node in 0..BRICK * BRICK * BRICK {
            let [i, j, k] = [node % BRICK, node / BRICK % BRICK, node / BRICK / BRICK];
            let mut sums = [0.0f32; 8];
            for c in 0..SIDE {
                for b in 0..SIDE {
                    self.stencil.add([b, c], i, &rows[j + b + BLOCK * (k + c)], &mut sums);
                }
            }
            brick.part[node] = f64::from(sums[0]);
            brick.moment[node][..6].copy_from_slice(&sums[1..7]);
        }
        Some(brick)
    }

    /// How far the cells of a block from `first` on are filled, in rows along x; `None` if all are empty.
    fn block(&self, first: [isize; 3]) -> Option<Vec<Row>> {
        let spans: [_; 3] = std::array::from_fn(|axis| {
            let low = first[axis].max(0) as usize;
            let high = (first[axis] + BLOCK as isize).clamp(0, self.lattice.cells[axis] as isize) as usize;
            low..high
        });
        let [is, js, ks] = spans;
        let tiles = |span: &Range<usize>| span.start / TILE..span.end.div_ceil(TILE);
        let within =
            |span: &Range<usize>, tile: usize| span.start.max(tile * TILE)..span.end.min((tile + 1) * TILE);
        let mut rows = Vec::new();
        // tiles that follow one another along x do so in the order in which rows are filled
        for [ti, tj, tk] in places(tiles(&is), tiles(&js), tiles(&ks)) {
            let tile = self.fractions.tile(&self.lattice, [ti, tj, tk]);
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

/// The cubic B-spline of the four nodes around a place t between the second and the third, and its derivative.
fn weights(t: f64) -> [(f64, f64); 4] {
    let s = 1.0 - t;
    let inner = |t: f64| 2.0 / 3.0 - t * t + 0.5 * t * t * t;
    let slope = |t: f64| -2.0 * t + 1.5 * t * t;
    [
        (s.powi(3) / 6.0, -0.5 * s * s),
        (inner(t), slope(t)),
        (inner(s), -slope(s)),
        (t.powi(3) / 6.0, 0.5 * t * t),
    ]
}

/// Sums over the 64 nodes around a place.
#[derive(Default)]
struct Sums {
    part: f64,
    /// By cells.
    gradient: [f64; 3],
    moment: [f32; 8],
}

impl Sums {
    /// The sums over nodes in two by two by two bricks, which begin at `at` in the first of them.
    fn over(bricks: &[&Brick; 8], at: [usize; 3], [x, y, z]: &[[(f64, f64); 4]; 3]) -> Self {
        let mut sums = Self::default();
        for (k, (wz, dz)) in z.iter().enumerate() {
            for (j, (wy, dy)) in y.iter().enumerate() {
                let (j, k) = (at[1] + j, at[2] + k);
                let corner = 2 * (j / BRICK) + 4 * (k / BRICK);
                let row = BRICK * (j % BRICK + BRICK * (k % BRICK));
                // along x first
                let (mut value, mut slope, mut moment) = (0.0, 0.0, [0.0f32; 8]);
                for (i, (wx, dx)) in x.iter().enumerate() {
                    let i = at[0] + i;
                    let (brick, node) = (bricks[corner + i / BRICK], row + i % BRICK);
                    value += wx * brick.part[node];
                    slope += dx * brick.part[node];
                    let wx = *wx as f32;
                    for (sum, m) in moment.iter_mut().zip(&brick.moment[node]) {
                        *sum += wx * m;
                    }
                }
                let w = wy * wz;
                sums.part += w * value;
                sums.gradient[0] += w * slope;
                sums.gradient[1] += dy * wz * value;
                sums.gradient[2] += wy * dz * value;
                let w = w as f32;
                for (sum, m) in sums.moment.iter_mut().zip(&moment) {
                    *sum += w * m;
                }
            }
        }
        sums
    }
}
