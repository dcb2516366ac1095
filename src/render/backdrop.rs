//! The fixed parts of a picture, which are drawn once, and the frames with particles in front of them.

use std::ops::Range;

use rayon::prelude::*;

use super::{
    Image, MeshView, ParticlesView, RenderError, Rgb,
    camera::{Camera, SUBPIXELS, Seen},
    floor::Floor,
    glass::{self, Sheet},
    image::Layer,
    mesh::Facets,
    occlusion::Balls,
    overlay::{self, Caption, Legend, Scale},
    particles::{self, Disc, by_band, columns, discs},
    raster::{BAND_ROWS, Band, Canvas, Corner, Frame, Scratch, mix},
    shade::Material,
    spare::{Spare, Workspace},
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
/// The materials that get sheets, one sheet for each.
const CLEAR: [Material; 2] = [Material::Glass, Material::ClearWater];

/// The camera, the box, the obstacles that stand still and the legend, ready for frames.
#[derive(Debug)]
pub struct Backdrop {
    camera: Camera,
    scale: Scale<'static>,
    /// The floor and the opaque meshes. The edges of the box are drawn last, over particles too, because
    /// their soft borders need the colour behind them.
    canvas: Canvas,
    /// The clear meshes in each band, by their material.
    glass: Vec<[Option<Sheet>; 2]>,
    edges: Vec<Edge>,
    /// The whole backdrop as pixels, without light and shadow, and the nearness of the foremost sub-pixel of
    /// each.
    pixels: Vec<u8>,
    nearness: Vec<f32>,
    floor: Option<Floor>,
    balls: Balls,
    title: Layer,
    bar: Option<Layer>,
    spare: Spare,
    /// The number of triangles of the meshes that are not drawn because a corner is not finite, lies behind
    /// the eye, or does not exist.
    pub skipped_triangles: usize,
}

/// The contents of a picture that change from frame to frame.
#[derive(Debug, Clone, Copy)]
pub struct Moving<'a> {
    /// Obstacles that move, and the surface of the fluid.
    pub meshes: &'a [MeshView<'a>],
    /// The particles.
    pub particles: ParticlesView<'a>,
    /// Whether particles are drawn. If not, they are only counted.
    pub balls: bool,
}

/// Things that are drawn over a canvas.
#[derive(Default)]
struct Actors<'a> {
    meshes: Vec<Facets>,
    discs: &'a [Vec<Disc>],
}

impl Backdrop {
    /// Draws the fixed parts: the box with the corners of `bounds` in metres, and the meshes.
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
        let values = legend.scale.map_or(Scale::speeds(1.0), |scale| scale.unlabelled());
        let facets: Vec<Facets> = meshes.iter().map(|mesh| Facets::new(mesh, &camera, &values)).collect();
        let floor_corners = floor_corners(bounds, &camera);
        let mut canvas = Canvas::new(width, height, PAPER);
        canvas.draw(|band| {
            for corners in &floor_corners {
                band.triangle(corners, |_| FLOOR);
            }
            facets.iter().filter(|facets| !facets.material.is_clear()).for_each(|facets| facets.draw(band));
        });
        let mut floor = Floor::new(bounds, &camera);
        if let Some(floor) = &mut floor {
            meshes.iter().for_each(|mesh| floor.add_mesh(mesh));
        }
        let bands = 0..height.div_ceil(BAND_ROWS);
        let glass = bands
            .into_par_iter()
            .map(|k| CLEAR.map(|material| sheet(&facets, material, &canvas, k)))
            .collect();
        let scale = overlay::unit(f64::from(camera.height));
        let middle = camera.look(bounds.centre()).map_or(0.0, |seen| seen.nearness);
        let pixels = camera.magnification(middle) / SUBPIXELS as f64;
        let mut backdrop = Self {
            scale: values,
            glass,
            edges: edges(bounds, &camera),
            pixels: Vec::new(),
            nearness: Vec::new(),
            spare: Spare::default(),
            floor,
            balls: Balls::new(bounds.size().length(), pixels),
            title: overlay::title(legend.title, f64::from(camera.width) / scale, scale)?,
            bar: legend.scale.map(|values| overlay::bar(&values, scale)).transpose()?,
            skipped_triangles: facets.iter().map(|facets| facets.skipped).sum(),
            camera,
            canvas,
        };
        let mut pixels = vec![0; 3 * width * height / 4];
        let mut nearness = vec![0.0; width * height / 4];
        backdrop.draw(&Actors::default(), true, &mut pixels, &mut nearness);
        (backdrop.pixels, backdrop.nearness) = (pixels, nearness);
        Ok(backdrop)
    }

    /// The backdrop with other colours of particles, which its legend need not show.
    #[must_use]
    pub fn coloured(mut self, scale: &Scale<'_>) -> Self {
        self.scale = scale.unlabelled();
        self
    }

    /// The picture with particles, and the caption of its moment.
    ///
    /// Particles whose position is not finite or lies behind the eye are left out and counted in
    /// [`Image::skipped`]. Those whose value is NaN are grey.
    pub fn frame(&self, particles: &ParticlesView<'_>, moment: &Caption) -> Image {
        self.frame_with(&Moving { meshes: &[], particles: *particles, balls: true }, moment)
    }

    /// The picture with everything that moves, and the caption of its moment. Particles are treated as in
    /// [`Backdrop::frame`]. Triangles that cannot be drawn are left out.
    pub fn frame_with(&self, moving: &Moving<'_>, moment: &Caption) -> Image {
        self.spare.lend(|workspace| self.frame_in(moving, moment, workspace))
    }

    fn frame_in(&self, moving: &Moving<'_>, moment: &Caption, workspace: &mut Workspace) -> Image {
        let total = moving.particles.positions.len();
        let Workspace { discs: found, order, by_band: bands, nearness, padded, light } = workspace;
        found.clear();
        if moving.balls {
            discs(&moving.particles, &self.camera, &self.scale, found);
        }
        let skipped = found.iter().filter(|disc| disc.is_none()).count();
        by_band(found, self.glass.len(), order, bands);
        let meshes = moving.meshes.iter().map(|mesh| Facets::new(mesh, &self.camera, &self.scale)).collect();
        let mut pixels = self.pixels.clone();
        nearness.clone_from(&self.nearness);
        self.draw(&Actors { meshes, discs: bands }, false, &mut pixels, nearness);
        let mut floor = self.floor.clone();
        if let Some(floor) = &mut floor {
            moving.meshes.iter().for_each(|mesh| floor.add_mesh(mesh));
            if moving.balls {
                floor.add_balls(&moving.particles);
            }
        }
        let mut image = self.lit(pixels, nearness, floor.as_ref(), padded, light);
        image.skipped = skipped;
        // our own digits and letters always make a caption
        let scale = overlay::unit(f64::from(self.camera.height));
        if let Ok(caption) = overlay::caption(moment, total, scale) {
            let top = f64::from(image.height) - overlay::CAPTION_HEIGHT * scale;
            image.lay(&caption, 0, top.max(0.0) as usize);
        }
        image
    }

    /// The picture without particles and without a caption.
    pub fn still(&self) -> Image {
        self.spare.lend(|Workspace { padded, light, .. }| {
            self.lit(self.pixels.clone(), &self.nearness, self.floor.as_ref(), padded, light)
        })
    }

    /// Draws over the canvas, and writes the pixels that this may change, or all pixels.
    fn draw(&self, actors: &Actors<'_>, all: bool, pixels: &mut [u8], nearness: &mut [f32]) {
        let width = self.canvas.width;
        let (stride, height) = (width / SUBPIXELS, self.canvas.nearness.len() / width);
        let size = stride * BAND_ROWS / SUBPIXELS;
        let pieces = pixels.par_chunks_mut(3 * size).zip(nearness.par_chunks_mut(size));
        pieces.enumerate().for_each_init(Scratch::default, |scratch, (k, (pixels, nearness))| {
            let rows = k * BAND_ROWS..((k + 1) * BAND_ROWS).min(height);
            let columns = if all { 0..width } else { actors.columns(k, width) };
            if columns.is_empty() {
                return;
            }
            self.canvas.copy(rows.clone(), columns.clone(), scratch);
            let mut band = Band {
                left: columns.start,
                top: rows.start,
                width: columns.len(),
                nearness: &mut scratch.nearness,
                colour: &mut scratch.colour,
            };
            let opaque = actors.meshes.iter().filter(|facets| !facets.material.is_clear());
            opaque.for_each(|facets| facets.draw(&mut band));
            if let Some(discs) = actors.discs.get(k) {
                particles::draw(discs, &mut band);
            }
            band.nearest(nearness, stride);
            let own = CLEAR.map(|material| sheet(&actors.meshes, material, &self.canvas, k));
            let sheets: Vec<&Sheet> = self.glass[k].iter().chain(&own).flatten().collect();
            glass::blend(&sheets, &mut band);
            self.edges.iter().for_each(|edge| band.line(edge.ends, edge.colours, edge.thickness));
            band.average(pixels, stride);
        });
    }

    /// The picture with light and shadow, the title and the legend.
    fn lit(
        &self,
        mut pixels: Vec<u8>,
        nearness: &[f32],
        floor: Option<&Floor>,
        padded: &mut Vec<f32>,
        light: &mut Vec<f32>,
    ) -> Image {
        let width = self.camera.width as usize;
        self.balls.light(nearness, width, padded, light);
        if let Some(floor) = floor {
            floor.shade(&self.camera, nearness, light, width);
        }
        pixels.par_chunks_mut(3 * width).zip(light.par_chunks(width)).for_each(|(row, light)| {
            for (pixel, light) in row.chunks_exact_mut(3).zip(light).filter(|(_, light)| **light < 1.0) {
                pixel.iter_mut().for_each(|channel| *channel = (f32::from(*channel) * light + 0.5) as u8);
            }
        });
        let mut image = Image { width: self.camera.width, height: self.camera.height, pixels, skipped: 0 };
        self.write_on(&mut image);
        image
    }

    fn write_on(&self, image: &mut Image) {
        let scale = overlay::unit(f64::from(self.camera.height));
        let (width, height) = (f64::from(image.width), f64::from(image.height));
        image.lay(&self.title, 0, 0);
        if let Some(bar) = &self.bar {
            let top = 0.5 * height - 0.5 * overlay::BAR_HEIGHT * scale;
            let left = width - overlay::BAR_WIDTH * scale;
            image.lay(bar, left.max(0.0) as usize, top.max(0.0) as usize);
        }
    }
}

impl Actors<'_> {
    /// The columns of sub-pixels of a band that may change, as whole pixels.
    fn columns(&self, k: usize, width: usize) -> Range<usize> {
        let parts = self.meshes.iter().map(|facets| facets.columns(k * BAND_ROWS));
        let discs = self.discs.get(k).map(|discs| columns(discs));
        let (left, right) =
            parts.chain(discs).fold((i64::MAX, i64::MIN), |all, part| (all.0.min(part.0), all.1.max(part.1)));
        let even = |x: i64| (x.max(0) as usize).min(width) / SUBPIXELS * SUBPIXELS;
        even(left)..(even(right.saturating_add(1)) + SUBPIXELS).min(width)
    }
}

/// The meshes of a clear material in a band of a canvas, if there are any.
fn sheet(facets: &[Facets], material: Material, canvas: &Canvas, k: usize) -> Option<Sheet> {
    let (top, height) = (k * BAND_ROWS, canvas.nearness.len() / canvas.width);
    let clear = || facets.iter().filter(|facets| facets.material == material);
    let (left, right) = clear()
        .map(|facets| facets.columns(top))
        .fold((i64::MAX, i64::MIN), |all, part| (all.0.min(part.0), all.1.max(part.1)));
    let columns = (left.max(0) as usize).min(canvas.width)..((right.max(-1) + 1) as usize).min(canvas.width);
    if columns.is_empty() {
        return None;
    }
    let mut sheet = Sheet::new(Frame::new(&(top..(top + BAND_ROWS).min(height)), &columns));
    clear().for_each(|facets| facets.hang(&mut sheet));
    Some(sheet)
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
    let thickness = EDGE_THICKNESS * overlay::unit(f64::from(camera.height));
    let pairs = (0..8).flat_map(|i| (0..3).map(move |bit| (i, i | 1 << bit))).filter(|(i, j)| i != j);
    pairs
        .map(|(i, j)| [corners[i], corners[j]])
        .map(|ends| Edge { ends, colours: ends.map(cue), thickness })
        .collect()
}

/// The bottom of the box as two triangles. It is drawn only if it is seen from above.
fn floor_corners(bounds: &Aabb, camera: &Camera) -> Vec<[Corner; 3]> {
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
    use crate::render::{ColourMap, Projection};

    const MOMENT: Caption = Caption { time: 0.0, every: 0.0, step: None };
    const LEGEND: Legend<'_> = Legend {
        title: "test",
        scale: Some(Scale {
            label: "speed, m/s",
            low: 0.0,
            high: 1.0,
            open: [false; 2],
            map: ColourMap::BlueYellowRed,
        }),
    };

    fn cube() -> Aabb {
        Aabb::new(DVec3::splat(-1.0), DVec3::ONE)
    }

    /// A view of the cube along −x, with y to the right and z up.
    fn scene(mesh: MeshView<'_>) -> Backdrop {
        let camera = Camera::new(&cube(), DVec3::X, Projection::Perspective, (320, 240)).unwrap();
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

    /// A square across the view.
    fn sheet_at(x: f64) -> Vec<DVec3> {
        [(-0.8, -0.8), (0.8, -0.8), (0.8, 0.8), (-0.8, 0.8)].map(|(y, z)| DVec3::new(x, y, z)).to_vec()
    }

    fn of(vertices: &[DVec3], material: Material) -> MeshView<'_> {
        MeshView { vertices, triangles: &[[0, 1, 2], [0, 2, 3]], material, ..MeshView::default() }
    }

    #[test]
    fn what_is_behind_glass_is_seen_through_it() {
        let plate = sheet_at(0.0);
        let through = |material, x: f64| {
            let scene = scene(of(&plate, material));
            let [r, _, b] = centre(&frame(&scene, &[DVec3::X * x], &[1.0]), &scene);
            i32::from(r) - i32::from(b)
        };
        // a ball is as red before a plate as without one, less red behind glass, still less behind water, and
        // not red behind stone
        let bare = centre(
            &frame(&scene(MeshView::default()), &[DVec3::X * 0.5], &[1.0]),
            &scene(MeshView::default()),
        );
        for material in [Material::Stone, Material::Glass, Material::Water, Material::ClearWater] {
            assert_eq!(through(material, 0.5), i32::from(bare[0]) - i32::from(bare[2]), "{material:?}");
        }
        let [glass, clear] = [Material::Glass, Material::ClearWater].map(|material| through(material, -0.5));
        assert!(glass > 90 && clear > 5 && glass > clear + 30, "{glass} {clear}");
        assert!(through(Material::Stone, -0.5) < 40 && through(Material::Water, -0.5) < 0);
    }

    #[test]
    fn what_moves_is_drawn_like_what_stands_still_in_any_order() {
        let (near, far, none) = (sheet_at(0.4), sheet_at(-0.4), [0.0; 0]);
        let moment = |meshes: &[MeshView<'_>], still: &[MeshView<'_>]| {
            let camera =
                Camera::new(&cube(), DVec3::new(1.0, 0.3, 0.4), Projection::Perspective, (320, 240)).unwrap();
            let scene = Backdrop::new(camera, &cube(), still, &LEGEND).unwrap();
            let particles =
                ParticlesView { positions: Points::new(&none, &none, &none), values: &[], radius: 0.1 };
            scene.frame_with(&Moving { meshes, particles, balls: true }, &MOMENT).pixels
        };
        let nothing = moment(&[], &[]);
        for material in [Material::Stone, Material::Glass] {
            let (near, far) = (of(&near, material), of(&far, material));
            let still = moment(&[], &[near, far]);
            assert!(still != nothing);
            assert!(still == moment(&[near, far], &[]) && still == moment(&[], &[far, near]), "{material:?}");
            assert!(still == moment(&[far, near], &[]), "{material:?}");
        }
        // one still and one moving: fluid in a vessel
        let (glass, water) = (of(&near, Material::Glass), of(&far, Material::ClearWater));
        assert!(moment(&[water], &[glass]) == moment(&[water, glass], &[]));
        assert!(moment(&[water], &[glass]) != moment(&[of(&far, Material::Water)], &[glass]));
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
