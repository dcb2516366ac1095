//! The obstacle: a shaded triangle mesh as the camera sees it.

use glam::DVec3;

use super::{
    Cut,
    camera::{Camera, Seen},
    facet::Facet,
    glass::Sheet,
    raster::{BAND_ROWS, Band, Corner},
    section::SeenCut,
    shade::Material,
};

/// A triangle mesh by reference.
#[derive(Debug, Clone, Copy, Default)]
pub struct MeshView<'a> {
    /// The vertices in metres.
    pub vertices: &'a [DVec3],
    /// The outward normals of any length, one for each vertex. If there are fewer, the mesh is shaded flat.
    pub normals: &'a [DVec3],
    /// Three indices of vertices for each triangle. Both sides are drawn.
    pub triangles: &'a [[u32; 3]],
    /// The plane that cuts the mesh open, which must then be closed. Clear meshes are not cut.
    pub cut: Option<Cut>,
    /// What the mesh is made of.
    pub material: Material,
}

/// Triangles on the screen.
#[derive(Debug)]
pub struct Facets {
    facets: Vec<Facet>,
    /// The numbers of the facets that may reach each band.
    by_band: Vec<Vec<u32>>,
    pub material: Material,
    cut: Option<SeenCut>,
    /// The number of triangles with a bad index or a corner that the camera cannot see.
    pub skipped: usize,
}

impl Facets {
    pub fn new(mesh: &MeshView<'_>, camera: &Camera) -> Self {
        let seen: Vec<_> = mesh.vertices.iter().map(|vertex| camera.look(*vertex)).collect();
        let smooth = mesh.normals.len() >= mesh.vertices.len();
        let facet = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|index| index as usize);
            let corners: [Seen; 3] = [(*seen.get(a)?)?, (*seen.get(b)?)?, (*seen.get(c)?)?];
            let points = [a, b, c].map(|i| mesh.vertices[i]);
            let face = (points[1] - points[0]).cross(points[2] - points[0]);
            let given = if smooth { [a, b, c].map(|i| mesh.normals[i]) } else { [face; 3] };
            // the winding decides which side is outside only if the normals do not
            let outward = if face.dot(given[0] + given[1] + given[2]) < 0.0 { -face } else { face };
            let side = if outward.dot(camera.to_eye(points[0])) < 0.0 { -1.0 } else { 1.0 };
            let normals = given.map(|n| {
                let n = n.try_normalize().or_else(|| outward.try_normalize()).unwrap_or(DVec3::Z);
                camera.turn(side * n).as_vec3().to_array()
            });
            let beyond =
                |i: usize| mesh.cut.map_or(-1.0, |cut| (corners[i].nearness * cut.beyond(points[i])) as f32);
            let beyond = [0, 1, 2].map(beyond);
            let corners = corners.map(Corner::new);
            Some(Facet { corners, rows: Corner::rows(&corners), normals, beyond })
        };
        let facets: Vec<_> = mesh.triangles.iter().filter_map(facet).collect();
        let skipped = mesh.triangles.len() - facets.len();
        let cut = mesh.cut.and_then(|cut| SeenCut::new(&cut, camera));
        let bands = camera.subpixels().1.div_ceil(BAND_ROWS);
        Self { by_band: by_band(&facets, bands), facets, material: mesh.material, cut, skipped }
    }

    /// The facets that may reach the band that begins at a row, in their order.
    fn in_band(&self, top: usize) -> impl Iterator<Item = &Facet> + Clone {
        let here = self.by_band.get(top / BAND_ROWS).map_or(&[][..], Vec::as_slice);
        here.iter().map(|&k| &self.facets[k as usize])
    }

    /// The columns of sub-pixels between which the facets in the band that begins at a row lie; empty without any.
    pub fn columns(&self, top: usize) -> (i64, i64) {
        let none = (i64::MAX, i64::MIN);
        self.in_band(top)
            .map(|facet| Corner::columns(&facet.corners))
            .fold(none, |all, (left, right)| (all.0.min(left), all.1.max(right)))
    }

    /// Draws an opaque mesh.
    pub fn draw(&self, band: &mut Band<'_>) {
        let here = self.in_band(band.top);
        match &self.cut {
            Some(cut) => cut.draw(&here.collect::<Vec<_>>(), self.material, band),
            None => here.for_each(|facet| {
                band.triangle(&facet.corners, |weights| facet.colour(weights, self.material));
            }),
        }
    }

    /// Adds a clear mesh to sheets.
    pub fn hang(&self, sheet: &mut Sheet) {
        for facet in self.in_band(sheet.frame.top()) {
            sheet.hang(&facet.corners, |weights| facet.veil(weights, self.material));
        }
    }
}

/// The facets that may reach each band.
fn by_band(facets: &[Facet], bands: usize) -> Vec<Vec<u32>> {
    let mut found = vec![Vec::new(); bands];
    for (k, facet) in (0..).zip(facets) {
        let band = |row: i64| (row.max(0) as usize) / BAND_ROWS;
        if facet.rows.1 >= 0 {
            let here = found.iter_mut().take(band(facet.rows.1) + 1).skip(band(facet.rows.0));
            here.for_each(|list| list.push(k));
        }
    }
    found
}
