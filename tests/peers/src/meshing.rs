//! Comparison of meshers, each on one thread, in turns: their time, and how far the mesh is from the surface.
//!
//! All work in one box that is a little larger than [0, 3]³, so that no face of an obstacle lies in a plane
//! of the grid. `rfm::mesh::Reference` measures the meshes without knowing which program made them. Volumes
//! are compared with quadrature of the profiles if that is known.

use std::time::{Duration, Instant};

use fidget::jit::JitShape;
use fidget::mesh::{Octree, Settings};
use fidget::shape::BoundShape;
use isosurface::distance::Signed;
use isosurface::extractor::IndexedVertices;
use isosurface::math::Vec3;
use isosurface::sampler::Sampler;
use isosurface::source::ScalarSource;
use nalgebra::{Matrix4, Vector3};
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::mesh::{
    Grid, Mesh, Quality, Reference, Resolution, Unwatched, dual_contouring, is_closed_manifold,
    marching_cubes, shells,
};
use rfm::solid::Depth;
use rfm::{Engine, Program};

use crate::fidget::{self as peer, Joins};
use crate::scenes;

/// Lowest coordinate of the box, and its side.
const CORNER: f64 = -0.07;
const SIDE: f64 = 3.12;

/// Time for a scene after which no further turn begins.
const PATIENCE: Duration = Duration::from_secs(4);
const TURNS: usize = 15;

/// An obstacle in the notation of every library.
struct Scene {
    name: &'static str,
    text: String,
    /// Expressions for Fidget, under the names of their forms.
    trees: Vec<(&'static str, fidget::context::Tree)>,
    /// ω in `f32`, written the way a person would.
    hand: Option<fn([f32; 3]) -> f32>,
    volume: Option<f64>,
    cells: &'static [usize],
    /// Number of cells along a side. The reference mesh, whose vertices stand for the surface, has cells half
    /// as large; `None` if finding them takes minutes.
    measured_in: Option<usize>,
}

/// A mesher on a scene.
struct Row<'a> {
    name: &'static str,
    work: Box<dyn FnMut() -> Mesh + 'a>,
    /// Milliseconds of each turn.
    times: Vec<f64>,
    found: Mesh,
}

/// Measures all scenes whose name contains a text and prints a table of each.
pub fn run(only: &str) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    pool.install(|| {
        for scene in scenes().iter().filter(|scene| scene.name.contains(only)) {
            for &cells in scene.cells {
                measure(scene, cells);
            }
        }
    });
}

fn scenes() -> Vec<Scene> {
    let balls = scenes::balls(500);
    let forms = |tree: fn(Joins) -> fidget::context::Tree| {
        vec![("Fidget, R0", tree(Joins::R0)), ("Fidget, min/max", tree(Joins::MinMax))]
    };
    vec![
        Scene {
            name: "pawn",
            text: scenes::PAWN.into(),
            trees: forms(peer::pawn),
            hand: Some(pawn),
            volume: Some(0.442701),
            cells: &[128, 256],
            measured_in: Some(256),
        },
        Scene {
            name: "bishop",
            text: scenes::BISHOP.into(),
            trees: forms(peer::bishop),
            hand: Some(bishop),
            volume: Some(0.601689),
            cells: &[128, 256],
            measured_in: Some(256),
        },
        Scene {
            name: "500 balls",
            text: scenes::balls_text(&balls),
            // Joined by R₀ they take Fidget minutes, so only its best forms are here.
            trees: vec![
                ("Fidget, min/max of r² − d²", peer::balls(&balls, Joins::MinMax, false)),
                ("Fidget, min/max of r − d", peer::balls(&balls, Joins::MinMax, true)),
            ],
            hand: None,
            volume: None,
            cells: &[512],
            measured_in: None,
        },
    ]
}

fn measure(scene: &Scene, cells: usize) {
    let program = Program::from_source("scene.rfm", scene.text.clone()).unwrap_or_else(|e| panic!("{e}"));
    let name = if scene.hand.is_some() { scene.name } else { "balls" };
    let solid = program.solid_with(name, Engine::Jit).unwrap_or_else(|e| panic!("{e}"));
    let bounds = Aabb::new(DVec3::splat(CORNER), DVec3::splat(CORNER + SIDE));
    let grid = |cells| Grid::filling(&bounds, Resolution::Cells(cells)).unwrap_or_else(|e| panic!("{e}"));
    let here = grid(cells);
    let ours = |dual: bool| {
        let (solid, here) = (&solid, &here);
        move || {
            // The work includes what is prepared for the box (programs, cell map).
            let surface = solid.surface(bounds);
            let mesher = if dual { dual_contouring } else { marching_cubes };
            mesher(&*surface, here, &Unwatched).unwrap_or_else(|e| panic!("{e}"))
        }
    };
    let mut rows = vec![
        row("rfm marching cubes, exact roots", Box::new(ours(false))),
        row("rfm dual contouring", Box::new(ours(true))),
    ];
    for &(name, ref tree) in &scene.trees {
        let shape = JitShape::from(-tree.clone());
        rows.push(row(name, Box::new(move || fidget_mesh(&shape, cells))));
    }
    if let Some(hand) = scene.hand {
        rows.push(row("isosurface, marching cubes", Box::new(move || by_isosurface(hand, cells))));
        rows.push(row("fast-surface-nets", Box::new(move || by_surface_nets(hand, cells))));
    }
    let started = Instant::now();
    for _ in 0..TURNS {
        for row in &mut rows {
            let (start, before) = (Instant::now(), processor_time());
            row.found = (row.work)();
            let spent = processor_time().zip(before).map(|(after, before)| after - before);
            row.times.push(1e3 * spent.unwrap_or_else(|| start.elapsed().as_secs_f64()));
        }
        if started.elapsed() > PATIENCE {
            break;
        }
    }
    let surface = solid.surface(bounds);
    let depth = Depth(&solid);
    let reference = scene
        .measured_in
        .map(|cells| Reference::new(&*surface, &depth, &grid(cells), &Unwatched).unwrap_or_else(|e| panic!("{e}")));
    print(scene, cells, &rows, reference.as_ref());
}

/// Seconds that this thread has run, without waiting; `None` if the system does not report it.
fn processor_time() -> Option<f64> {
    let line = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    line.split(' ').next()?.parse::<f64>().ok().map(|nanoseconds| 1e-9 * nanoseconds)
}

fn row<'a>(name: &'static str, work: Box<dyn FnMut() -> Mesh + 'a>) -> Row<'a> {
    Row { name, work, times: Vec::new(), found: Mesh::default() }
}

fn print(scene: &Scene, cells: usize, rows: &[Row<'_>], reference: Option<&Reference<'_>>) {
    println!("\n{} in {cells}³ cells\n", scene.name);
    println!("| | ms | / ours | triangles | Hausdorff | rms to surface | volume error | closed manifold |");
    println!("|---|--:|--:|--:|--:|--:|--:|---|");
    for row in rows {
        let quality: Option<Quality> = reference.map(|reference| reference.measure(&row.found, &Unwatched));
        let volume: f64 = shells(&row.found).iter().map(|shell| shell.volume).sum();
        let error = scene.volume.map(|truth| format!("{:+.3} %", 100.0 * (volume / truth - 1.0)));
        let metres = |of: fn(&Quality) -> f64| quality.as_ref().map(|quality| format!("{:.1e}", of(quality)));
        let [hausdorff, rms, error] = [metres(Quality::hausdorff), metres(|q| q.to_surface.rms), error]
            .map(|figure| figure.unwrap_or_else(|| "–".into()));
        // Quotients are taken turn by turn, because other work of the machine disturbs both.
        let ratio =
            crate::measure::median(row.times.iter().zip(&rows[0].times).map(|(t, o)| t / o).collect());
        println!(
            "| {} | {:.1} | {ratio:.1} | {} | {hausdorff} | {rms} | {error} | {} |",
            row.name,
            row.times.iter().copied().fold(f64::INFINITY, f64::min),
            row.found.triangles.len(),
            if is_closed_manifold(&row.found) { "yes" } else { "no" },
        );
    }
}

/// Fidget's octree of 2ⁿ cells along a side. It wants the inside negative.
fn fidget_mesh(shape: &JitShape, cells: usize) -> Mesh {
    let (half, middle) = (0.5 * SIDE as f32, (CORNER + 0.5 * SIDE) as f32);
    let to_world = Matrix4::new_translation(&Vector3::repeat(middle)) * Matrix4::new_scaling(half);
    let settings = Settings {
        depth: cells.ilog2() as u8,
        world_to_model: to_world,
        threads: None,
        ..Settings::default()
    };
    let bound = BoundShape::try_from(shape.clone()).expect("no further variables");
    let found = Octree::build(&bound, &settings).expect("nobody cancels").walk_dual();
    let positions = found.vertices.iter().map(|v| [v.x, v.y, v.z].map(f64::from).into()).collect();
    let triangles = found.triangles.iter().map(|t| [t.x, t.y, t.z].map(|v| v as u32)).collect();
    Mesh::from_triangles(positions, triangles)
}

struct ByHand(fn([f32; 3]) -> f32);

impl ScalarSource for ByHand {
    fn sample_scalar(&self, p: Vec3) -> Signed {
        let place = |x: f32| CORNER as f32 + SIDE as f32 * x;
        Signed(-self.0([place(p.x), place(p.y), place(p.z)]))
    }
}

fn by_isosurface(hand: fn([f32; 3]) -> f32, cells: usize) -> Mesh {
    let (mut vertices, mut indices) = (Vec::new(), Vec::new());
    let source = ByHand(hand);
    isosurface::MarchingCubes::<Signed>::new(cells + 1)
        .extract(&Sampler::new(&source), &mut IndexedVertices::new(&mut vertices, &mut indices));
    let place = |x: &f32| CORNER + SIDE * f64::from(*x);
    let position = |p: &[f32]| DVec3::new(place(&p[0]), place(&p[1]), place(&p[2]));
    let positions = vertices.chunks_exact(3).map(position).collect();
    outward(positions, indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect())
}

fn by_surface_nets(hand: fn([f32; 3]) -> f32, cells: usize) -> Mesh {
    use fast_surface_nets::ndshape::{RuntimeShape, Shape};
    let nodes = cells as u32 + 1;
    let shape = RuntimeShape::<u32, 3>::new([nodes; 3]);
    let step = SIDE / cells as f64;
    let place = |i: u32| (CORNER + step * f64::from(i)) as f32;
    let mut samples = Vec::with_capacity(shape.usize());
    for k in 0..nodes {
        for j in 0..nodes {
            samples.extend((0..nodes).map(|i| -hand([place(i), place(j), place(k)])));
        }
    }
    let mut buffer = fast_surface_nets::SurfaceNetsBuffer::default();
    fast_surface_nets::surface_nets(&samples, &shape, [0; 3], [nodes - 1; 3], &mut buffer);
    let position = |p: &[f32; 3]| DVec3::from(p.map(|x| CORNER + step * f64::from(x)));
    let positions = buffer.positions.iter().map(position).collect();
    outward(positions, buffer.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect())
}

/// Orders triangles so that the volume is positive, because crates differ in what they call the front.
fn outward(positions: Vec<DVec3>, mut triangles: Vec<[u32; 3]>) -> Mesh {
    let corner = |v: u32| positions[v as usize];
    let six_volumes: f64 = triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c)))).sum();
    if six_volumes < 0.0 {
        triangles.iter_mut().for_each(|t| t.swap(0, 1));
    }
    Mesh::from_triangles(positions, triangles)
}

fn and(u: f32, v: f32) -> f32 {
    u + v - (u * u + v * v).sqrt()
}

fn or(u: f32, v: f32) -> f32 {
    u + v + (u * u + v * v).sqrt()
}

fn pawn([x, y, z]: [f32; 3]) -> f32 {
    let r2 = (x - 1.5).powi(2) + (y - 1.5).powi(2);
    let waist = 1.0 + 10.0 * (z - 0.75).powi(2) - 20.0 * r2;
    let collar = 0.125 - (r2 + 20.0 * (1.0 - z).powi(2));
    let head = 0.05 - (r2 + (1.25 - z).powi(2));
    or(and(and(0.25 - r2, z * (1.0 - z)), waist), or(collar, head))
}

fn bishop([x, y, z]: [f32; 3]) -> f32 {
    let r2 = (x - 1.5).powi(2) + (y - 1.5).powi(2);
    let waist = 1.0 + 10.0 * (z - 0.85).powi(2) - 20.0 * r2;
    let collar = 0.2 - (r2 + 20.0 * (1.25 - z).powi(2));
    let head = 0.2 - (5.0 * (x - 1.5).powi(2) + 4.0 * (y - 1.5).powi(2) + (1.4 - z).powi(2));
    or(and(and(0.25 - r2, z * (1.25 - z)), waist), or(collar, head))
}
