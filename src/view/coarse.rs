//! Meshes with less detail, for surfaces of which a page holds very many.

use std::collections::HashMap;

use glam::DVec3;

use crate::mesh::Mesh;

/// A mesh whose vertices in each cell of a grid, m, are one: their mean. Triangles without three different corners
/// are left out (Rossignac and Borrel 1993). It is fit to be looked at, and may touch itself.
///
/// A cell that is not a positive length changes nothing.
pub fn coarse(mesh: &Mesh, cell: f64) -> Mesh {
    if !(cell > 0.0 && cell.is_finite()) {
        return mesh.clone();
    }
    let mut numbers: HashMap<[i64; 3], u32> = HashMap::new();
    let mut out = Mesh::default();
    let mut counts: Vec<f64> = Vec::new();
    let new_number = mesh.positions.iter().zip(&mesh.normals).map(|(p, normal)| {
        let key = (*p / cell).floor().to_array().map(|x| x as i64);
        let number = *numbers.entry(key).or_insert(counts.len() as u32);
        if number as usize == counts.len() {
            out.positions.push(DVec3::ZERO);
            out.normals.push(DVec3::ZERO);
            counts.push(0.0);
        }
        out.positions[number as usize] += *p;
        out.normals[number as usize] += *normal;
        counts[number as usize] += 1.0;
        number
    });
    let new_number: Vec<u32> = new_number.collect();
    for ((position, normal), count) in out.positions.iter_mut().zip(&mut out.normals).zip(counts) {
        *position /= count;
        *normal = normal.try_normalize().unwrap_or(DVec3::Z);
    }
    let corners = mesh.triangles.iter().map(|t| t.map(|vertex| new_number[vertex as usize]));
    out.triangles = corners.filter(|[a, b, c]| a != b && b != c && c != a).collect();
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Closures;
    use crate::geom::Aabb;
    use crate::mesh::Unwatched;
    use crate::mesh::{Grid, Resolution, marching_cubes};

    #[test]
    fn a_coarse_ball_is_a_ball_of_fewer_triangles() {
        let ball =
            Closures { omega: |p: DVec3| 1.0 - p.length(), gradient: |p: DVec3| -p.normalize_or_zero() };
        let domain = Aabb::new(DVec3::splat(-1.2), DVec3::splat(1.2));
        let grid = Grid::filling(&domain, Resolution::Cells(60)).unwrap();
        let mesh = marching_cubes(&ball, &grid, &Unwatched).unwrap();
        let few = coarse(&mesh, 0.1);
        assert!(5 * few.triangles.len() < mesh.triangles.len() && few.triangles.len() > 500);
        // means of points of a sphere within a cell lie below it by the height of the cap, d²/8 at most
        let off = few.positions.iter().map(|p| (p.length() - 1.0).abs()).fold(0.0, f64::max);
        assert!(off < 3.0 * 0.1 * 0.1 / 8.0, "{off}");
        assert!(few.normals.iter().zip(&few.positions).all(|(n, p)| n.dot(p.normalize()) > 0.99));
        assert_eq!(coarse(&mesh, 0.0), mesh);
    }
}
