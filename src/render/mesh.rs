//! The obstacle: a shaded triangle mesh as the camera sees it.

use glam::DVec3;

use super::{
    Cut, Rgb, Scale,
    camera::{Camera, Seen},
    facet::Facet,
    glass::Sheet,
    raster::{BAND_ROWS, Band, Corner},
    section::SeenCut,
    shade::{self, Material},
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
    /// Values that choose the colours, one for each vertex, in the unit of the [`Scale`]. If there are fewer,
    /// the mesh has the colour of its material.
    pub values: &'a [f64],
    /// The plane that cuts the mesh open, which must then be closed. In clear meshes the cut has no face.
    pub cut: Option<Cut>,
    /// The material of the mesh.
    pub material: Material,
}

/// Triangles on the screen.
#[derive(Debug)]
pub struct Facets {
    facets: Vec<Facet>,
    by_band: Vec<Part>,
    /// The colours of the vertices; empty if they have the colour of the material.
    tints: Vec<[f32; 3]>,
    pub material: Material,
    cut: Option<SeenCut>,
    /// The number of triangles with a bad index or a corner that the camera cannot see.
    pub skipped: usize,
}

/// The facets that may reach a band.
#[derive(Debug, Clone)]
struct Part {
    /// Their numbers.
    facets: Vec<u32>,
    /// The columns of sub-pixels between which they lie.
    columns: (i64, i64),
}

impl Part {
    const NONE: Self = Self { facets: Vec::new(), columns: (i64::MAX, i64::MIN) };
}

impl Facets {
    pub fn new(mesh: &MeshView<'_>, camera: &Camera, scale: &Scale<'_>) -> Self {
        let seen: Vec<_> = mesh.vertices.iter().map(|vertex| camera.look(*vertex)).collect();
        let smooth = mesh.normals.len() >= mesh.vertices.len();
        let in_frame = |n: DVec3| camera.turn(n).as_vec3().to_array();
        let shown = |normal: &DVec3| normal.try_normalize().map(in_frame);
        let turned: Vec<_> = mesh.normals.iter().filter(|_| smooth).map(shown).collect();
        let facet = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|index| index as usize);
            let corners: [Seen; 3] = [(*seen.get(a)?)?, (*seen.get(b)?)?, (*seen.get(c)?)?];
            let points = [a, b, c].map(|i| mesh.vertices[i]);
            let face = (points[1] - points[0]).cross(points[2] - points[0]);
            // the winding decides which side is outside only if the normals do not
            let is_inward = smooth && face.dot(mesh.normals[a] + mesh.normals[b] + mesh.normals[c]) < 0.0;
            let outward = if is_inward { -face } else { face };
            let side = if outward.dot(camera.to_eye(points[0])) < 0.0 { -1.0 } else { 1.0 };
            let flat = || in_frame(outward.try_normalize().unwrap_or(DVec3::Z));
            let given = if smooth { [a, b, c].map(|i| turned[i]) } else { [Some(flat()); 3] };
            let normals = given.map(|normal| normal.unwrap_or_else(flat).map(|x| side * x));
            let beyond = |i: usize| {
                let weight = camera.weight(corners[i].nearness);
                mesh.cut.map_or(-1.0, |cut| (weight * cut.beyond(points[i])) as f32)
            };
            let beyond = [0, 1, 2].map(beyond);
            let corners = corners.map(Corner::new);
            Some(Facet { corners, rows: Corner::rows(&corners), vertices: *triangle, normals, beyond })
        };
        let facets: Vec<_> = mesh.triangles.iter().filter_map(facet).collect();
        let skipped = mesh.triangles.len() - facets.len();
        let cut = mesh.cut.and_then(|cut| SeenCut::new(&cut, mesh.material, camera));
        let bands = camera.subpixels().1.div_ceil(BAND_ROWS);
        let coloured = mesh.values.iter().filter(|_| mesh.values.len() >= mesh.vertices.len());
        let tints = coloured.map(|value| scale.colour(*value).map(f32::from)).collect();
        Self { by_band: by_band(&facets, bands), facets, tints, material: mesh.material, cut, skipped }
    }

    /// The facets that may reach the band that begins at a row, in their order.
    fn in_band(&self, top: usize) -> impl Iterator<Item = &Facet> + Clone {
        let here = self.by_band.get(top / BAND_ROWS).map_or(&[][..], |part| &part.facets);
        here.iter().map(|&k| &self.facets[k as usize])
    }

    /// The columns of sub-pixels between which the facets of the band that begins at a row lie; an empty
    /// range without facets.
    pub fn columns(&self, top: usize) -> (i64, i64) {
        self.by_band.get(top / BAND_ROWS).unwrap_or(&Part::NONE).columns
    }

    /// Draws an opaque mesh.
    pub fn draw(&self, band: &mut Band<'_>) {
        let here = self.in_band(band.top);
        match &self.cut {
            Some(cut) => {
                cut.draw(&here.collect::<Vec<_>>(), |facet, weights| self.colour(facet, weights), band);
            }
            None => here.for_each(|facet| {
                band.triangle(&facet.corners, |weights| self.colour(facet, weights));
            }),
        }
    }

    /// Adds a clear mesh to sheets.
    pub fn hang(&self, sheet: &mut Sheet) {
        for facet in self.in_band(sheet.frame.top()) {
            sheet.hang(&facet.corners, |weights| {
                let tint = facet.tint(weights, &self.tints);
                let veil = || shade::veil(self.material, tint, facet.normal(weights));
                (!facet.is_beyond(weights)).then(veil)
            });
        }
    }

    /// The colour of a facet at the place with these weights of its corners.
    fn colour(&self, facet: &Facet, weights: [f32; 3]) -> Rgb {
        shade::solid(self.material, facet.tint(weights, &self.tints), facet.normal(weights))
    }
}

/// The facets that may reach each band.
fn by_band(facets: &[Facet], bands: usize) -> Vec<Part> {
    let mut found = vec![Part::NONE; bands];
    for (k, facet) in (0..).zip(facets) {
        let band = |row: i64| (row.max(0) as usize) / BAND_ROWS;
        if facet.rows.1 >= 0 {
            let here = found.iter_mut().take(band(facet.rows.1) + 1).skip(band(facet.rows.0));
            let (left, right) = Corner::columns(&facet.corners);
            here.for_each(|part| {
                part.facets.push(k);
                part.columns = (part.columns.0.min(left), part.columns.1.max(right));
            });
        }
    }
    found
}
