//! Distances against all triangles, one after the other, and signs against the solid angles that they fill.

use super::*;

struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// In the cube from −1 to 1.
    fn place(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - DVec3::ONE
    }
}

type Soup = Vec<[DVec3; 3]>;

/// A ball of rings and sectors, whose radius differs from direction to direction.
fn ball(rings: usize, sectors: usize, radius: impl Fn(DVec3) -> f64) -> Soup {
    let at = |i: usize, j: usize| {
        let (sin, cos) = (std::f64::consts::PI * i as f64 / rings as f64).sin_cos();
        let (s, c) = (std::f64::consts::TAU * (j % sectors) as f64 / sectors as f64).sin_cos();
        // the poles are one point each, to the bit
        let unit = match i {
            0 => DVec3::Z,
            i if i == rings => -DVec3::Z,
            _ => DVec3::new(sin * c, sin * s, cos),
        };
        unit * radius(unit)
    };
    let mut soup = Soup::new();
    for i in 0..rings {
        for j in 0..sectors {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            if i + 1 < rings {
                soup.push([a, b, c]);
            }
            if i > 0 {
                soup.push([a, c, d]);
            }
        }
    }
    soup
}

/// A prism over a polygon that is seen whole from its first corner.
fn prism(corners: &[[f64; 2]], height: f64) -> Soup {
    let at = |i: usize, z: f64| DVec3::new(corners[i % corners.len()][0], corners[i % corners.len()][1], z);
    let mut soup = Soup::new();
    for i in 0..corners.len() {
        soup.push([at(i, 0.0), at(i + 1, 0.0), at(i + 1, height)]);
        soup.push([at(i, 0.0), at(i + 1, height), at(i, height)]);
    }
    for i in 1..corners.len() - 1 {
        soup.push([at(0, height), at(i, height), at(i + 1, height)]);
        soup.push([at(0, 0.0), at(i + 1, 0.0), at(i, 0.0)]);
    }
    soup
}

fn moved(soup: &Soup, by: DVec3) -> Soup {
    soup.iter().map(|triangle| triangle.map(|p| p + by)).collect()
}

fn turned_over(soup: &Soup) -> Soup {
    soup.iter().map(|&[a, b, c]| [a, c, b]).collect()
}

/// The part of all directions that the surface fills, seen from a point: 1 inside and 0 outside (Van Oosterom and
/// Strackee 1983).
fn winding(p: DVec3, soup: &Soup) -> f64 {
    let angle = |triangle: &[DVec3; 3]| {
        let [a, b, c] = triangle.map(|corner| corner - p);
        let [la, lb, lc] = [a, b, c].map(DVec3::length);
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(below)
    };
    soup.iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// The distance from one triangle: from its plane if the foot of the point lies within it, else from its edges.
fn from_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a);
    let foot = p - normal * (normal.dot(p - a) / normal.length_squared());
    let within = [[a, b], [b, c], [c, a]].iter().all(|&[u, v]| normal.dot((v - u).cross(foot - u)) >= 0.0);
    let from_edge = |u: DVec3, v: DVec3| {
        let part = ((p - u).dot(v - u) / (v - u).length_squared()).clamp(0.0, 1.0);
        p.distance(u + part * (v - u))
    };
    let edges = from_edge(a, b).min(from_edge(b, c)).min(from_edge(c, a));
    if within { edges.min(p.distance(foot)) } else { edges }
}

fn shapes() -> Vec<(&'static str, Soup)> {
    let bumpy = |u: DVec3| 0.6 + 0.15 * (7.0 * u.x).sin() * (5.0 * u.y).cos() + 0.1 * (9.0 * u.z).sin();
    let arrow = [[0.0, 0.0], [0.9, -0.7], [0.35, 0.0], [0.9, 0.7]];
    // an edge of half a degree
    let knife = [[-0.9, 0.0], [0.9, -0.008], [0.9, 0.008]];
    let hollow: Soup = [ball(8, 12, |_| 0.9), turned_over(&ball(7, 9, |_| 0.4))].concat();
    let two: Soup = [ball(6, 8, |_| 0.4), moved(&ball(6, 8, |_| 0.3), DVec3::new(0.8, 0.0, 0.0))].concat();
    // two tetrahedra that share a corner
    let tetrahedron = |way: f64| {
        let [o, a, b, c] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|p| p * 0.8 * way);
        let soup = vec![[o, b, a], [o, a, c], [o, c, b], [a, b, c]];
        if way < 0.0 { turned_over(&soup) } else { soup }
    };
    let tip: Soup = [tetrahedron(1.0), tetrahedron(-1.0)].concat();
    // a cube with a corner in the middle of an edge: the triangle there has no area
    let mut seam = prism(&[[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]], 0.7);
    let [a, b, m] = [[-0.5, -0.5, 0.0], [0.5, -0.5, 0.0], [0.0, -0.5, 0.0]].map(DVec3::from_array);
    let split =
        seam.iter().position(|t| t.contains(&a) && t.contains(&b) && t.iter().any(|p| p.z > 0.0)).unwrap();
    let [u, v, w] = seam.swap_remove(split);
    let top = [u, v, w].into_iter().find(|p| p.z > 0.0).unwrap();
    seam.extend([[a, m, top], [m, b, top], [a, b, m]]);
    vec![
        ("a bumpy ball", ball(20, 30, bumpy)),
        ("an arrow", prism(&arrow, 0.8)),
        ("a knife", prism(&knife, 0.5)),
        ("a hollow ball", hollow),
        ("two balls", two),
        ("two solids that touch in a point", tip),
        ("a cube with a seam", seam),
    ]
}

#[test]
fn distances_and_signs_are_those_of_all_triangles() {
    let mut random = Random(7);
    for (name, soup) in shapes() {
        let solid = TriangleSolid::new(&soup).unwrap_or_else(|error| panic!("{name}: {error}"));
        for i in 0..4_000 {
            let p = match i % 4 {
                0 => random.place() * 1.2,
                1 => random.place() * 10.0,
                _ => {
                    // beside a triangle, an edge or a corner
                    let [a, b, c] = soup[(random.unit() * soup.len() as f64) as usize % soup.len()];
                    let (u, v) = (random.unit(), if i % 3 == 0 { 0.0 } else { random.unit() });
                    let on = a + (b - a) * (u * (1.0 - v)) + (c - a) * (if i % 5 == 0 { 0.0 } else { u * v });
                    on + random.place() * 10f64.powi(-(i % 7))
                }
            };
            let truth = soup.iter().map(|&t| from_triangle(p, t)).fold(f64::INFINITY, f64::min);
            let Sample { value, gradient } = solid.at(p);
            assert!(
                (value.abs() - truth).abs() < 1e-13 * (1.0 + p.length()),
                "{name} at {p}: {value}, {truth}"
            );
            assert!((gradient.length() - 1.0).abs() < 1e-12, "{name} at {p}: {gradient}");
            if truth > 1e-9 {
                let inside = winding(p, &soup) > 0.5;
                assert_eq!(value > 0.0, inside, "{name} at {p}: {value}");
                // the way to the surface
                let foot = solid.at(p - value * gradient).value;
                assert!(foot.abs() < 1e-12 * (1.0 + p.length()), "{name} at {p}: {foot}");
            }
        }
    }
}

/// The tree finds the triangle that a search through all of them finds, to the bit: for solids of any size,
/// far from the origin, flat ones, and points near and far.
#[test]
fn the_tree_hides_no_triangle() {
    let mut random = Random(21);
    let bumpy = |u: DVec3| 0.6 + 0.15 * (7.0 * u.x).sin() * (5.0 * u.y).cos() + 0.1 * (9.0 * u.z).sin();
    let of = |scale: DVec3, by: DVec3| {
        ball(24, 30, bumpy).into_iter().map(|t| t.map(|p| p * scale + by)).collect::<Soup>()
    };
    let soups = [
        of(DVec3::ONE, DVec3::ZERO),
        of(DVec3::ONE, DVec3::new(1e6, -2e6, 3e5)),
        of(DVec3::splat(1e-30), DVec3::ZERO),
        of(DVec3::splat(1e60), DVec3::ZERO),
        of(DVec3::new(1.0, 1e-5, 1e3), DVec3::X),
        // every point of the middle is about as far from all triangles
        ball(30, 40, |_| 1.0),
        shapes().swap_remove(6).1,
    ];
    for (number, soup) in soups.iter().enumerate() {
        let surface = Surface::new(soup).unwrap();
        let tree = Tree::new(&surface);
        let Aabb { min, max } = surface.bounds;
        let (centre, half) = (0.5 * (min + max), 0.5 * (max - min));
        let mut last = None;
        for i in 0..1500 {
            let corner = surface.corners_of((random.unit() * surface.len() as f64) as u32)[i % 3];
            let p = match i % 5 {
                0 => centre + 1.2 * half * random.place(),
                1 => centre + 1e-3 * half * random.place(),
                2 => centre + surface.size * 10f64.powi(i as i32 % 40) * random.place(),
                _ => corner + half * random.place() * 10f64.powi(-(i as i32 % 17)),
            };
            let all = (0..surface.len() as u32).map(|t| (t, nearest::on_triangle(p, surface.corners_of(t))));
            let (truth, expected) = all.reduce(|a, b| if b.1.square < a.1.square { b } else { a }).unwrap();
            let (place, found) = tree.nearest(&surface, p, last);
            assert_eq!((tree.triangle(place), found), (truth, expected), "solid {number} at {p}");
            last = Some(place);
        }
    }
}

#[test]
fn a_value_does_not_depend_on_what_was_asked_before() {
    let soup = shapes().swap_remove(0).1;
    let [first, second] = [(); 2].map(|()| TriangleSolid::new(&soup).unwrap());
    let mut random = Random(11);
    let points: Vec<DVec3> = (0..3000).map(|_| random.place()).collect();
    let values: Vec<Sample> = points.iter().map(|&p| first.at(p)).collect();
    for (p, value) in points.iter().zip(&values).rev() {
        assert_eq!(second.at(*p), *value);
        assert_eq!(second.at(DVec3::ZERO), first.at(-DVec3::ZERO));
    }
}

#[test]
fn values_are_within_their_ranges() {
    let mut random = Random(5);
    for (name, soup) in shapes() {
        let solid = TriangleSolid::new(&soup).unwrap();
        for _ in 0..2_000 {
            let (a, b) = (random.place() * 1.5, random.place() * random.unit());
            let over = Aabb::new(a.min(a + b), a.max(a + b));
            let range = solid.range(&over);
            for _ in 0..8 {
                let part = DVec3::new(random.unit(), random.unit(), random.unit());
                let value = solid.at((over.min + part * over.size()).clamp(over.min, over.max)).value;
                assert!(range.contains(value), "{name}: {value} not in {range:?} of {over:?}");
                let gradient = solid.at((over.min + part * over.size()).clamp(over.min, over.max)).gradient;
                let slopes = solid.slopes(&over);
                assert!(
                    (0..3).all(|i| slopes[i].contains(gradient[i])),
                    "{name}: {gradient} not in {slopes:?}"
                );
            }
        }
        let all = solid.range(&Aabb::new(DVec3::NEG_INFINITY, DVec3::splat(2.0)));
        assert!(all.lo == f64::NEG_INFINITY && all.hi < 1.0);
        for _ in 0..2_000 {
            let p = random.place() * 1.2;
            let value = solid.at(p).value;
            assert!(solid.reach(value).contains(p), "{name}: {value} at {p}");
        }
    }
}

#[test]
fn solids_that_are_inside_out_are_turned() {
    let soup = turned_over(&ball(8, 12, |_| 1.0));
    assert!(TriangleSolid::new(&soup).unwrap().at(DVec3::ZERO).value > 0.9);
}

#[test]
fn what_encloses_no_solid_is_refused() {
    let refused = |soup: &Soup| TriangleSolid::new(soup).unwrap_err();
    let whole = ball(8, 12, |_| 1.0);
    let mut holed = whole.clone();
    holed.remove(40);
    holed.remove(0);
    match refused(&holed) {
        NotClosed::Holes { count: 2, largest } => {
            assert_eq!(largest.iter().map(|hole| hole.edges).sum::<usize>(), 6)
        }
        other => panic!("{other}"),
    }
    let mut turned = whole.clone();
    turned[30].swap(0, 1);
    assert!(matches!(refused(&turned), NotClosed::Winding { count: 3, .. }), "{}", refused(&turned));
    let twice: Soup = [whole.clone(), moved(&ball(8, 12, |_| 1.0), DVec3::X)].concat();
    assert!(matches!(refused(&twice), NotClosed::Overlap { .. }));
    let nested: Soup = [whole.clone(), ball(5, 7, |_| 0.4)].concat();
    assert!(matches!(refused(&nested), NotClosed::Overlap { count: 56, .. }), "{}", refused(&nested));
    let cube = prism(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], 1.0);
    let beside: Soup = [cube.clone(), moved(&cube, DVec3::new(1.0, 1.0, 0.0))].concat();
    assert!(matches!(refused(&beside), NotClosed::Branches { count: 1, .. }), "{}", refused(&beside));
    // the centres of all triangles lie outside of the other body; four edges, four diagonals and two of the cube cross
    let long = prism(&[[0.45, 0.45], [0.55, 0.45], [0.55, 0.55], [0.45, 0.55]], 9.0);
    let through: Soup = [cube.clone(), moved(&long, DVec3::new(0.1, 0.05, -4.0))].concat();
    assert!(matches!(refused(&through), NotClosed::Crossing { count: 10, .. }), "{}", refused(&through));
    // edges that meet the diagonals of faces
    let half: Soup = [cube.clone(), moved(&cube, DVec3::splat(0.5))].concat();
    let half = refused(&half);
    assert!(matches!(half, NotClosed::Crossing { .. } | NotClosed::Overlap { .. }), "{half}");
    let flat: Soup = vec![[DVec3::ZERO, DVec3::X, DVec3::Y], [DVec3::ZERO, DVec3::Y, DVec3::X]];
    assert!(matches!(refused(&flat), NotClosed::Overlap { .. }), "{}", refused(&flat));
    assert_eq!(refused(&Soup::new()), NotClosed::Empty);
    assert_eq!(refused(&vec![[DVec3::ZERO, DVec3::NAN, DVec3::X]]), NotClosed::NotFinite);
    assert!(matches!(refused(&vec![[DVec3::ZERO, DVec3::X, 2.0 * DVec3::X]; 2]), NotClosed::Winding { .. }));
}

/// Crossings of the vertical line through a point, with the triangles sorted into columns: another way to the sign than
/// the tree and the pseudonormals. `None` if the line comes close to an edge.
struct Columns<'s> {
    soup: &'s Soup,
    cells: Vec<Vec<u32>>,
    count: usize,
}

impl<'s> Columns<'s> {
    fn new(soup: &'s Soup, count: usize) -> Self {
        let mut cells = vec![Vec::new(); count * count];
        for (t, triangle) in soup.iter().enumerate() {
            let ends = |of: fn(&DVec3) -> f64| {
                let all = triangle.iter().map(of);
                let (lo, hi) =
                    all.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), c| (lo.min(c), hi.max(c)));
                Self::cell(lo, count)..=Self::cell(hi, count)
            };
            for i in ends(|p| p.x) {
                for j in ends(|p| p.y) {
                    cells[i * count + j].push(t as u32);
                }
            }
        }
        Self { soup, cells, count }
    }

    fn cell(c: f64, count: usize) -> usize {
        ((c + 1.0) * 0.5 * count as f64).clamp(0.0, count as f64 - 1.0) as usize
    }

    fn winding(&self, p: DVec3) -> Option<i32> {
        let mut above = 0;
        for &t in &self.cells[Self::cell(p.x, self.count) * self.count + Self::cell(p.y, self.count)] {
            let [a, b, c] = self.soup[t as usize].map(|corner| corner - p);
            let sides = [(a, b), (b, c), (c, a)].map(|(u, v)| u.x * v.y - u.y * v.x);
            if sides.iter().any(|side| side.abs() < 1e-11) {
                return None;
            }
            if sides.iter().all(|&side| side > 0.0) || sides.iter().all(|&side| side < 0.0) {
                let sum: f64 = sides.iter().sum();
                let height = (sides[1] * a.z + sides[2] * b.z + sides[0] * c.z) / sum;
                above += if height > 0.0 { sum.signum() as i32 } else { 0 };
            }
        }
        Some(above)
    }
}

/// The bars of the project for a mesh of a hundred thousand triangles. It is long: `cargo test -- --ignored study`.
#[test]
#[ignore = "a million points"]
fn study_of_a_hundred_thousand_triangles() {
    let bumpy = |u: DVec3| 0.7 + 0.1 * (17.0 * u.x).sin() * (15.0 * u.y).cos() + 0.1 * (19.0 * u.z).sin();
    let soup = ball(158, 320, bumpy);
    assert!(soup.len() > 100_000);
    let solid = TriangleSolid::new(&soup).unwrap();
    let columns = Columns::new(&soup, 200);
    let mut random = Random(1);
    let mut judged = 0;
    for i in 0..1_000_000 {
        let p = if i % 2 == 0 {
            random.place()
        } else {
            let on = soup[(random.unit() * soup.len() as f64) as usize % soup.len()][i % 3];
            on + random.place() * 10f64.powi(-((i / 2 % 8) as i32))
        };
        let value = solid.at(p).value;
        if let Some(winding) = columns.winding(p)
            && value.abs() > 1e-10
        {
            judged += 1;
            assert_eq!(i32::from(value > 0.0), winding, "at {p}: {value}");
        }
    }
    assert!(judged > 900_000, "{judged}");
}
