//! The point of one triangle that is nearest to another point, and on which part of the triangle it lies.

use glam::DVec3;

/// A triangle whose height is smaller than this, relative to its longest edge, has no normal.
const LEAST_HEIGHT: f64 = 1e-12;

/// A part of a triangle. Edges are numbered by the corner that they start from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Feature {
    /// Its plane, given by this unit normal, and how far above it the other point is.
    Face {
        normal: DVec3,
        above: f64,
    },
    Edge(usize),
    Corner(usize),
}

/// The nearest point of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    pub point: DVec3,
    /// The square of the distance.
    pub square: f64,
    pub feature: Feature,
}

/// The normal of a triangle before its length is made 1, which few of those that are looked at need.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    cross: DVec3,
    area: f64,
}

impl Plane {
    /// `None` for triangles without an area.
    #[inline]
    pub fn of([a, b, c]: [DVec3; 3]) -> Option<Self> {
        let cross = (b - a).cross(c - a);
        let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        let area = cross.length();
        (area > LEAST_HEIGHT * longest).then_some(Self { cross, area })
    }

    /// The normal, of length 1.
    #[inline]
    pub fn normal(self) -> DVec3 {
        self.cross / self.area
    }
}

/// The nearest point of a triangle: the regions of Ericson (Real-Time Collision Detection, 2005, §5.1.5).
pub fn on_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> Nearest {
    let Some(plane) = Plane::of([a, b, c]) else { return on_edges(p, [a, b, c]) };
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return corner(p, a, 0);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return corner(p, b, 1);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return edge(p, a, b, 0);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return corner(p, c, 2);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return edge(p, c, a, 2);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return edge(p, b, c, 1);
    }
    let normal = plane.normal();
    let above = normal.dot(ap);
    Nearest { point: p - above * normal, square: above * above, feature: Feature::Face { normal, above } }
}

fn corner(p: DVec3, corner: DVec3, number: usize) -> Nearest {
    Nearest { point: corner, square: p.distance_squared(corner), feature: Feature::Corner(number) }
}

fn edge(p: DVec3, from: DVec3, to: DVec3, number: usize) -> Nearest {
    let along = to - from;
    let part = (p - from).dot(along) / along.length_squared();
    if part.is_nan() || part <= 0.0 {
        return corner(p, from, number);
    }
    if part >= 1.0 {
        return corner(p, to, (number + 1) % 3);
    }
    let point = from + part * along;
    Nearest { point, square: p.distance_squared(point), feature: Feature::Edge(number) }
}

/// A triangle without an area is its edges.
fn on_edges(p: DVec3, [a, b, c]: [DVec3; 3]) -> Nearest {
    let others = [edge(p, b, c, 1), edge(p, c, a, 2)];
    others
        .into_iter()
        .fold(edge(p, a, b, 0), |best, other| if other.square < best.square { other } else { best })
}
