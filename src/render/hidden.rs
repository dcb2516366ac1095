//! The part of a fluid that an obstacle hides.

use glam::DVec3;

use super::{
    Scale,
    camera::Camera,
    mesh::{Facets, MeshView},
    raster::Canvas,
};

/// The part of the points that a mesh hides from the camera, 0 … 1; 0 without points.
pub fn hidden(camera: &Camera, mesh: &MeshView<'_>, points: &[DVec3]) -> f64 {
    let (width, height) = camera.subpixels();
    let facets = Facets::new(mesh, camera, &Scale::speeds(1.0));
    let mut canvas = Canvas::new(width, height, [0; 3]);
    canvas.draw(|band| facets.draw(band));
    let is_hidden = |p: &DVec3| {
        let Some(seen) = camera.look(*p) else { return false };
        let (x, y) = (seen.at.x.max(0.0) as usize, seen.at.y.max(0.0) as usize);
        x < width && y < height && canvas.nearness[y * width + x] > seen.nearness as f32
    };
    points.iter().filter(|p| is_hidden(p)).count() as f64 / points.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Aabb;
    use crate::render::{Cut, Material, Projection, Rgb, shade};

    /// A closed box as a mesh.
    fn block(low: DVec3, high: DVec3) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let vertices = Aabb::new(low, high).corners().to_vec();
        let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        (vertices, sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect())
    }

    /// The middle of the picture of a box around the origin, seen from +x.
    fn seen(cut: Option<Cut>) -> (Rgb, f64) {
        let bounds = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
        let camera = Camera::new(&bounds, DVec3::X, Projection::Perspective, (320, 240)).unwrap();
        let (vertices, triangles) = block(DVec3::splat(-0.5), DVec3::splat(0.5));
        let mesh = MeshView { vertices: &vertices, triangles: &triangles, cut, ..MeshView::default() };
        let facets = Facets::new(&mesh, &camera, &Scale::speeds(1.0));
        let (width, height) = camera.subpixels();
        let mut canvas = Canvas::new(width, height, [255; 3]);
        canvas.draw(|band| facets.draw(band));
        let at = camera.look(DVec3::new(0.0, 0.05, 0.08)).unwrap().at;
        let at = at.y as usize * width + at.x as usize;
        (canvas.colour[at], f64::from(canvas.nearness[at]))
    }

    #[test]
    fn a_cut_shows_the_inside_of_a_solid_where_it_lies() {
        let plane = |normal: DVec3, offset| Some(Cut { normal, offset });
        let camera = Camera::new(
            &Aabb::new(DVec3::splat(-1.0), DVec3::ONE),
            DVec3::X,
            Projection::Perspective,
            (320, 240),
        )
        .unwrap();
        let at = |x: f64| camera.look(DVec3::new(x, 0.05, 0.08)).unwrap().nearness;
        let stone = seen(None);
        assert!((stone.1 - at(0.5)).abs() < 1e-6);
        // the half towards the eye is gone, and the face at x = 0.1 has the colour of a section
        let open = seen(plane(DVec3::X, 0.1));
        assert_eq!(open.0, shade::section(Material::Stone, [0.0, 0.0, 1.0]));
        assert!((open.1 - at(0.1)).abs() < 1e-6, "{} {}", open.1, at(0.1));
        // a cut behind the solid removes all of it, a cut in front of it nothing
        assert_eq!(seen(plane(DVec3::X, -0.7)), ([255; 3], 0.0));
        assert_eq!(seen(plane(DVec3::X, 0.7)), stone);
        // the far half is gone: its face looks away
        assert_eq!(seen(plane(-DVec3::X, -0.1)), stone);
    }

    #[test]
    fn points_behind_a_mesh_are_hidden_until_it_is_cut() {
        let bounds = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
        let camera = Camera::new(&bounds, DVec3::X, Projection::Perspective, (320, 240)).unwrap();
        let (vertices, triangles) = block(DVec3::splat(-0.5), DVec3::splat(0.5));
        let points = [DVec3::ZERO, DVec3::new(-0.9, 0.1, 0.1), DVec3::X, DVec3::Y];
        let share = |cut| {
            hidden(
                &camera,
                &MeshView { vertices: &vertices, triangles: &triangles, cut, ..MeshView::default() },
                &points,
            )
        };
        assert_eq!(share(None), 0.5);
        assert_eq!(share(Some(Cut { normal: DVec3::X, offset: -0.2 })), 0.25);
        assert_eq!(share(Some(Cut { normal: DVec3::X, offset: -0.6 })), 0.0);
        assert_eq!(hidden(&camera, &MeshView::default(), &[]), 0.0);
    }
}
