//! The fixed parts of a picture, which are drawn once, and the frames with particles in front of them.

use super::{
    Image, MeshView, ParticlesView, RenderError, Rgb,
    camera::{Camera, SUBPIXELS, Seen},
    image::Layer,
    mesh::Facets,
    overlay::{self, Caption, Legend, Scale},
    particles::{discs, draw},
    raster::{BAND_ROWS, Band, Canvas, Corner, mix},
};
use crate::geom::Aabb;

const PAPER: Rgb = [255, 255, 255];
const FLOOR: Rgb = [241, 240, 237];
/// The colours of the box's edges close to the eye and far from it.
const EDGE_NEAR: Rgb = [58, 58, 58];
const EDGE_FAR: Rgb = [186, 186, 186];
/// The thickness of an edge, in sub-pixels of a picture 960 high.
const EDGE_THICKNESS: f64 = 2.8;
/// The floor's nearness is reduced by this factor, so that it gives way to anything that lies on it.
const FLOOR_BEHIND: f64 = 1.0 - 1e-4;

/// The camera, the box, the obstacle and the legend, ready for frames.
#[derive(Debug)]
pub struct Backdrop {
    camera: Camera,
    scale: Scale<'static>,
    /// The floor and the mesh. The edges of the box are drawn last, over particles too, because their soft
    /// borders need the colour behind them.
    canvas: Canvas,
    edges: Vec<Edge>,
    /// The canvas and the edges as pixels.
    still: Vec<u8>,
    title: Layer,
    bar: Option<Layer>,
    /// The number of triangles of the meshes that are not drawn because a corner is not finite, lies behind the
    /// eye, or does not exist.
    pub skipped_triangles: usize,
}

impl Backdrop {
    /// Draws what does not move: the box with the corners of `bounds` in metres, and the meshes.
    ///
    /// # Errors
    /// [`RenderError::Legend`], which is a bug of ours.
    pub fn new(
        camera: Camera,
        bounds: &Aabb,
        meshes: &[MeshView<'_>],
        legend: &Legend<'_>,
    ) -> Result<Self, RenderError> {
        let (width, height) = camera.subpixels();
        let facets: Vec<Facets> = meshes.iter().map(|mesh| Facets::new(mesh, &camera)).collect();
        let edges = edges(bounds, &camera);
        let floor = floor(bounds, &camera);
        let mut canvas = Canvas::new(width, height, PAPER);
        canvas.draw(|band| {
            for corners in &floor {
                band.triangle(corners, |_| FLOOR);
            }
            facets.iter().for_each(|facets| facets.draw(band));
        });
        let mut finished = canvas.clone();
        finished.draw(|band| draw_edges(&edges, band));
        let still = pixels(&mut finished);
        let scale = unit(&camera);
        Ok(Self {
            scale: legend.scale.map_or(Scale::speeds(1.0), |scale| scale.unlabelled()),
            canvas,
            edges,
            still,
            title: overlay::title(legend.title, f64::from(camera.width) / scale, scale)?,
            bar: legend.scale.map(|values| overlay::bar(&values, scale)).transpose()?,
            skipped_triangles: facets.iter().map(|facets| facets.skipped).sum(),
            camera,
        })
    }

    /// The picture with particles in it, and the caption of its moment.
    ///
    /// Particles whose position is not finite or lies behind the eye are left out and counted in
    /// [`Image::skipped`]. Those whose value is NaN are grey.
    pub fn frame(&self, particles: &ParticlesView<'_>, moment: &Caption) -> Image {
        let discs = discs(particles, &self.camera, &self.scale);
        let total = particles.positions.len();
        let mut image = Image {
            width: self.camera.width,
            height: self.camera.height,
            pixels: self.still.clone(),
            skipped: total - discs.len(),
        };
        draw(&discs, &self.canvas, |band| draw_edges(&self.edges, band), &mut image.pixels);
        self.write_on(&mut image);
        let scale = unit(&self.camera);
        // our own digits and letters always make a caption
        if let Ok(caption) = overlay::caption(moment, total, scale) {
            let top = f64::from(image.height) - overlay::CAPTION_HEIGHT * scale;
            image.lay(&caption, 0, top.max(0.0) as usize);
        }
        image
    }

    /// The picture without particles and without a caption.
    pub fn still(&self) -> Image {
        let (width, height) = (self.camera.width, self.camera.height);
        let mut image = Image { width, height, pixels: self.still.clone(), skipped: 0 };
        self.write_on(&mut image);
        image
    }

    fn write_on(&self, image: &mut Image) {
        let scale = unit(&self.camera);
        let (width, height) = (f64::from(image.width), f64::from(image.height));
        image.lay(&self.title, 0, 0);
        if let Some(bar) = &self.bar {
            let top = 0.5 * height - 0.5 * overlay::BAR_HEIGHT * scale;
            let left = width - overlay::BAR_WIDTH * scale;
            image.lay(bar, left.max(0.0) as usize, top.max(0.0) as usize);
        }
    }
}

/// The pixels for a unit of the layout, which is made for a height of 960.
fn unit(camera: &Camera) -> f64 {
    f64::from(camera.height) / 960.0
}

fn pixels(canvas: &mut Canvas) -> Vec<u8> {
    let stride = canvas.width / SUBPIXELS;
    let mut out = vec![0; 3 * canvas.nearness.len() / (SUBPIXELS * SUBPIXELS)];
    let size = BAND_ROWS * canvas.width;
    let bands = canvas.nearness.chunks_mut(size).zip(canvas.colour.chunks_mut(size));
    for (k, (out, (nearness, colour))) in
        out.chunks_mut(3 * stride * BAND_ROWS / SUBPIXELS).zip(bands).enumerate()
    {
        let band = Band { left: 0, top: k * BAND_ROWS, width: canvas.width, nearness, colour };
        band.average(out, stride);
    }
    out
}

/// An edge of the box on the screen.
#[derive(Debug)]
struct Edge {
    ends: [Seen; 2],
    colours: [Rgb; 2],
    thickness: f64,
}

/// The twelve edges of the box. They are paler with distance.
fn edges(bounds: &Aabb, camera: &Camera) -> Vec<Edge> {
    let Some(corners) = see(bounds, camera) else { return Vec::new() };
    let nearest = corners.iter().map(|c| c.nearness).fold(f64::NEG_INFINITY, f64::max);
    let farthest = corners.iter().map(|c| c.nearness).fold(f64::INFINITY, f64::min);
    let cue = |seen: Seen| {
        let t = (seen.nearness - farthest) / (nearest - farthest).max(f64::MIN_POSITIVE);
        mix(EDGE_FAR, EDGE_NEAR, t.clamp(0.0, 1.0))
    };
    let thickness = EDGE_THICKNESS * unit(camera);
    let pairs = (0..8).flat_map(|i| (0..3).map(move |bit| (i, i | 1 << bit))).filter(|(i, j)| i != j);
    pairs
        .map(|(i, j)| [corners[i], corners[j]])
        .map(|ends| Edge { ends, colours: ends.map(cue), thickness })
        .collect()
}

fn draw_edges(edges: &[Edge], band: &mut Band<'_>) {
    for edge in edges {
        band.line(edge.ends, edge.colours, edge.thickness);
    }
}

/// The bottom of the box as two triangles. It is drawn only if it is seen from above.
fn floor(bounds: &Aabb, camera: &Camera) -> Vec<[Corner; 3]> {
    let above = camera.to_eye(bounds.min).z > 0.0;
    let Some(corners) = see(bounds, camera).filter(|_| above) else { return Vec::new() };
    let corner = |i: usize| Corner::new(Seen { nearness: FLOOR_BEHIND * corners[i].nearness, ..corners[i] });
    vec![[corner(0), corner(1), corner(3)], [corner(0), corner(3), corner(2)]]
}

fn see(bounds: &Aabb, camera: &Camera) -> Option<[Seen; 8]> {
    let seen: Vec<_> = bounds.corners().iter().filter_map(|corner| camera.look(*corner)).collect();
    seen.try_into().ok()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::field::Points;
    use crate::render::ColourMap;

    const MOMENT: Caption = Caption { time: 0.0, step: None };
    const LEGEND: Legend<'_> = Legend {
        title: "test",
        scale: Some(Scale { label: "speed, m/s", low: 0.0, high: 1.0, map: ColourMap::BlueYellowRed }),
    };

    fn cube() -> Aabb {
        Aabb::new(DVec3::splat(-1.0), DVec3::ONE)
    }

    /// A view of the cube along −x, with y to the right and z up.
    fn scene(mesh: MeshView<'_>) -> Backdrop {
        let camera = Camera::new(&cube(), DVec3::X, (320, 240)).unwrap();
        Backdrop::new(camera, &cube(), &[mesh], &LEGEND).unwrap()
    }

    fn frame(scene: &Backdrop, points: &[DVec3], speeds: &[f64]) -> Image {
        let [x, y, z] = [0, 1, 2].map(|axis| points.iter().map(|p| p[axis]).collect::<Vec<_>>());
        scene.frame(
            &ParticlesView { positions: Points::new(&x, &y, &z), values: speeds, radius: 0.2 },
            &MOMENT,
        )
    }

    fn centre(image: &Image, scene: &Backdrop) -> Rgb {
        let at = scene.camera.look(DVec3::ZERO).unwrap().at / SUBPIXELS as f64;
        image.pixel(at.x as u32, at.y as u32).unwrap()
    }

    fn is_red([r, g, b]: Rgb) -> bool {
        r > g.saturating_add(60) && r > b.saturating_add(60)
    }

    #[test]
    fn the_nearer_particle_hides_the_farther_whatever_the_order() {
        let scene = scene(MeshView::default());
        let (near, far) = (DVec3::X * 0.5, DVec3::X * -0.5);
        for (points, speeds) in [([near, far], [1.0, 0.0]), ([far, near], [0.0, 1.0])] {
            assert!(is_red(centre(&frame(&scene, &points, &speeds), &scene)));
        }
        assert!(!is_red(centre(&frame(&scene, &[near, far], &[0.0, 1.0]), &scene)));
    }

    #[test]
    fn the_mesh_hides_what_is_behind_it_and_is_drawn_from_both_sides() {
        let vertices = [(-0.9, -0.9), (0.9, -0.9), (0.0, 0.9)].map(|(y, z)| DVec3::new(0.0, y, z));
        for triangles in [[[0, 1, 2]], [[0, 2, 1]]] {
            let scene = scene(MeshView { vertices: &vertices, triangles: &triangles, ..MeshView::default() });
            assert!(is_red(centre(&frame(&scene, &[DVec3::X * 0.5], &[1.0]), &scene)));
            let [r, g, b] = centre(&frame(&scene, &[DVec3::X * -0.5], &[1.0]), &scene);
            assert!(r.abs_diff(b) < 40 && (100..230).contains(&g), "the mesh is grey: {r} {g} {b}");
        }
    }

    #[test]
    fn bad_positions_speeds_and_triangles_are_skipped_and_counted() {
        let vertices = [DVec3::ZERO, DVec3::Y, DVec3::NAN];
        let triangles = [[0, 1, 2], [0, 1, 9], [1, 1, 1]];
        let scene = scene(MeshView { vertices: &vertices, triangles: &triangles, ..MeshView::default() });
        assert_eq!(scene.skipped_triangles, 2);
        let points = [DVec3::NAN, DVec3::X * 1e9, DVec3::ZERO, DVec3::new(0.0, f64::INFINITY, 0.0)];
        let image = frame(&scene, &points, &[0.0, 0.0, f64::NAN]);
        assert_eq!(image.skipped, 3);
        let [r, g, b] = centre(&image, &scene);
        assert!(r.abs_diff(g) < 12 && g.abs_diff(b) < 12, "an unknown speed is grey: {r} {g} {b}");
    }

    #[test]
    fn no_particles_and_odd_radii_make_a_picture() {
        let scene = scene(MeshView::default());
        assert_eq!(frame(&scene, &[], &[]).pixels.len(), 3 * 320 * 240);
        for radius in [f64::NAN, -1.0, 0.0, 1e300] {
            let one = [0.0];
            let particles = ParticlesView { positions: Points::new(&one, &one, &one), values: &one, radius };
            assert_eq!(scene.frame(&particles, &MOMENT).skipped, 0);
        }
    }

    #[test]
    fn particles_beside_the_picture_leave_it_as_it_is() {
        let scene = scene(MeshView::default());
        let nothing = frame(&scene, &[], &[]).pixels;
        let far = [DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
        for z in [-1.0, 0.0, 1.0] {
            let points = far.map(|p| 30.0 * p + z * DVec3::ONE);
            let mut image = frame(&scene, &points, &[0.0; 4]);
            // the captions differ in the number of particles
            image.pixels.truncate(3 * 320 * 220);
            assert!(image.pixels == nothing[..3 * 320 * 220]);
        }
    }

    #[test]
    fn frames_have_the_same_bits_on_one_and_two_threads() {
        let vertices = [DVec3::ZERO, DVec3::Y, DVec3::Z];
        let wave = |i: i32, k: f64| (f64::from(i) * k).sin();
        let points: Vec<_> = (0..500).map(|i| DVec3::new(wave(i, 1.3), wave(i, 2.1), wave(i, 3.7))).collect();
        let speeds: Vec<_> = (0..500).map(|i| wave(i, 0.7).abs()).collect();
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let scene =
                    scene(MeshView { vertices: &vertices, triangles: &[[0, 1, 2]], ..MeshView::default() });
                frame(&scene, &points, &speeds)
            })
        };
        assert!(on(1) == on(2));
    }
}
