//! Polygons as triangles.

use glam::{DVec2, DVec3};

/// Corners up to which a polygon with notches is cut into triangles: the work may grow with their cube.
const MOST_CORNERS: usize = 4000;

/// Areas below this part of the square of a polygon's size are rounding of its corners.
const ROUNDING: f64 = 1e-6;

/// Cuts a polygon into triangles wound as it is, which have all of its corners: those that share the first
/// corner or, where one of them would lie outside of it, as in a polygon with a notch, ears cut off one after
/// the other. Corners need not lie exactly in one plane. A polygon without area, or whose outline crosses
/// itself, is cut from its first corner.
///
/// # Errors
/// What is wrong with the polygon, in a few words.
pub fn cut(corners: &[DVec3], out: &mut Vec<[DVec3; 3]>) -> Result<(), String> {
    let [first, rest @ ..] = corners else { return Ok(()) };
    let fan = rest.windows(2).map(|pair| [*first, pair[0], pair[1]]);
    let facing = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
    let normal: DVec3 = fan.clone().map(facing).sum();
    let size = rest.iter().fold(0.0, |most, p| f64::max(most, p.distance_squared(*first)));
    let normal = normal.try_normalize().filter(|_| normal.length() > ROUNDING * size);
    let is_notched =
        |normal: &DVec3| fan.clone().any(|triangle| facing(triangle).dot(*normal) < -ROUNDING * size);
    let Some(normal) = normal.filter(is_notched) else {
        out.extend(fan);
        return Ok(());
    };
    if corners.len() > MOST_CORNERS {
        return Err(format!("a face with a notch has {} corners, more than {MOST_CORNERS}", corners.len()));
    }
    let (u, v) = normal.any_orthonormal_pair();
    let flat: Vec<DVec2> =
        corners.iter().map(|p| DVec2::new((p - first).dot(u), (p - first).dot(v))).collect();
    let mut left: Vec<usize> = (0..corners.len()).collect();
    let mut ears = Vec::with_capacity(corners.len());
    while left.len() > 3 {
        let Some(tip) = (0..left.len()).find(|&tip| is_ear(&flat, &left, tip)) else {
            out.extend(fan);
            return Ok(());
        };
        ears.push(around(&left, tip));
        left.remove(tip);
    }
    ears.push([left[0], left[1], left[2]]);
    out.extend(ears.into_iter().map(|ear| ear.map(|corner| corners[corner])));
    Ok(())
}

/// The corners before, at and after a place.
fn around(left: &[usize], place: usize) -> [usize; 3] {
    let n = left.len();
    [left[(place + n - 1) % n], left[place], left[(place + 1) % n]]
}

/// Whether the triangle at a corner lies inside what is left of the polygon, and touches none of its other
/// corners. A corner within a side thus becomes one of a triangle, as it is of the polygon beside it.
fn is_ear(flat: &[DVec2], left: &[usize], tip: usize) -> bool {
    let own = around(left, tip);
    let [a, b, c] = own.map(|corner| flat[corner]);
    let turn = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p);
    let touches = |p: DVec2| turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
    let is_other = |corner: &&usize| !own.contains(corner) && ![a, b, c].contains(&flat[**corner]);
    turn(a, b, c) > 0.0 && !left.iter().filter(is_other).any(|&corner| touches(flat[corner]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(outline: &[[f64; 2]], lift: impl Fn([f64; 2]) -> DVec3) -> (f64, f64, usize) {
        let corners: Vec<DVec3> = outline.iter().map(|&p| lift(p)).collect();
        let mut triangles = Vec::new();
        cut(&corners, &mut triangles).unwrap();
        let areas: Vec<DVec3> = triangles.iter().map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a)).collect();
        let sum = areas.iter().sum::<DVec3>().length();
        (sum, areas.iter().map(|area| area.length()).sum(), triangles.len())
    }

    #[test]
    fn notches_stay_empty_and_every_corner_is_used() {
        let u = [[0, 0], [3, 0], [3, 2], [2, 2], [2, 1], [1, 1], [1, 2], [0, 2]];
        // a corner within a side, beside a notch
        let with_flat = [[0, 0], [1, 0], [3, 0], [3, 2], [2, 2], [2, 1], [1, 1], [1, 2], [0, 2], [0, 1]];
        let flat = |[x, y]: [f64; 2]| DVec3::new(x, y, 0.0);
        let turned = |[x, y]: [f64; 2]| DVec3::new(0.6 * x, y, -0.8 * x);
        let numbers =
            |outline: &[[i32; 2]]| -> Vec<[f64; 2]> { outline.iter().map(|p| p.map(f64::from)).collect() };
        for outline in [numbers(&u), numbers(&with_flat)] {
            for start in 0..outline.len() {
                let mut outline = outline.clone();
                outline.rotate_left(start);
                for (all, sum, count) in [area(&outline, flat), area(&outline, turned)] {
                    assert!(
                        (all - 5.0).abs() < 1e-12 && (sum - 5.0).abs() < 1e-12,
                        "{all} {sum} from {start}"
                    );
                    assert_eq!(count, outline.len() - 2);
                }
            }
        }
    }

    #[test]
    fn a_convex_polygon_is_cut_from_its_first_corner() {
        let corners: Vec<DVec3> =
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0)).into();
        let mut triangles = Vec::new();
        cut(&corners, &mut triangles).unwrap();
        assert_eq!(triangles, [[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]]);
    }
}
