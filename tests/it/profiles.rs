//! Outlines with curves, and tubes: against circles, ellipses, counts of turns and distances from chains of segments.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use rfm::diagnostic::Source;
use rfm::files::{Files, Reader, Unread};
use rfm::geom::Aabb;
use rfm::glam::{DVec2, DVec3};
use rfm::lower::Options;
use rfm::solid::Bounds;
use rfm::{Engine, Program, Solid};

use crate::random::Random;

/// One file, whatever its name.
struct OneFile(String);

impl Reader for OneFile {
    fn read(&self, _: &str) -> Result<Vec<u8>, Unread> {
        Ok(self.0.clone().into_bytes())
    }
}

fn solid(definition: &str) -> Solid {
    with_file(definition, "", Engine::Auto)
}

fn with_file(definition: &str, file: &str, engine: Engine) -> Solid {
    let options = Options { files: Files::new(Arc::new(OneFile(file.into()))), ..Options::default() };
    let text = format!("rfm 1\nsolid s = {definition}");
    let program = Program::check(Source::file("t.rfm", text), options);
    program.unwrap_or_else(|e| panic!("{definition}: {e}")).solid_with("s", engine).unwrap()
}

fn mistake(definition: &str) -> String {
    match Program::from_source("t.rfm", format!("rfm 1\nsolid s = {definition}")) {
        Ok(_) => panic!("{definition} is accepted"),
        Err(e) => e.to_string(),
    }
}

/// The sign of a profile is that of a distance from the true outline, but for points closer to it than a
/// tolerance; each tolerance is needed: somewhere the chords are a tenth of it away.
#[track_caller]
fn follows(definition: &str, truth: impl Fn(DVec2) -> f64, tolerance: f64) {
    let found = solid(definition);
    let mut random = Random(5);
    let over = Aabb::new(DVec3::new(-4.0, -4.0, 0.0), DVec3::new(4.0, 4.0, 1.0));
    let (mut near, mut farthest) = (0, 0.0);
    for i in 0..20_000 {
        let mut p = random.in_box(&over);
        if i % 2 == 0 {
            // towards the outline
            for _ in 0..8 {
                let slope = |axis: DVec3| {
                    (truth((p + 1e-6 * axis).truncate()) - truth((p - 1e-6 * axis).truncate())) / 2e-6
                };
                let gradient = DVec3::new(slope(DVec3::X), slope(DVec3::Y), 0.0);
                p -= 0.7 * gradient * truth(p.truncate()) / gradient.length_squared().max(1e-3);
            }
            p += tolerance * 3.0 * (DVec3::new(random.unit(), random.unit(), 0.5) - DVec3::splat(0.5));
        }
        let (omega, distance) = (found.omega(p), truth(p.truncate()));
        near += usize::from(distance.abs() < 3.0 * tolerance);
        if (omega > 0.0) != (distance > 0.0) {
            farthest = f64::max(farthest, distance.abs());
        }
        if distance.abs() > tolerance {
            assert!(
                omega != 0.0 && (omega > 0.0) == (distance > 0.0),
                "{definition} at {p}: {omega} {distance}"
            );
        }
    }
    assert!(near > 1000, "{definition}: {near} points near the outline");
    assert!(farthest > 0.1 * tolerance, "{definition}: the chords are {farthest} away");
}

#[test]
fn arcs_follow_their_circles() {
    let disc = |centre: DVec2, radius: f64| move |p: DVec2| radius - p.distance(centre);
    let centre = DVec2::new(0.3, -0.2);
    follows("polygon(arc([0.3, -0.2], 2, 0°, 360°))", disc(centre, 2.0), 2.01e-3);
    follows("polygon(arc([0.3, -0.2], 2, 90°, -270°, 0.02))", disc(centre, 2.0), 2.01e-2);
    // a half-disc, closed by its chord
    let half = move |p: DVec2| disc(centre, 2.0)(p).min(p.y - centre.y);
    follows("polygon(arc([0.3, -0.2], 2, 0°, 180°))", half, 2.01e-3);
    follows("polygon(arc([2.3, -0.2], [0.3, 1.8], [-1.7, -0.2]))", half, 2.01e-3);
    follows("polygon([arc([2.3, -0.2], [0.3, 1.8], [-1.7, -0.2])])", half, 2.01e-3);
}

/// A slot with round ends: straight pieces and arcs that begin where the others end, written and computed.
#[test]
fn pieces_are_joined() {
    let slot = |p: DVec2| 1.0 - p.distance(DVec2::new(p.x.clamp(-1.0, 2.0), 0.5));
    for outline in [
        "polygon([[-1, -0.5], [2, -0.5], arc([2, 0.5], 1, -90°, 90°), [2, 1.5], arc([-1, 0.5], 1, 90°, 270°)])",
        "polygon([arc([2, 0.5], 1, -90°, 90°), arc([-1, 0.5], 1, 90°, 270°)])",
        "polygon([[-1, 1.5], arc([-1, 1.5], [-2, 0.5], [-1, -0.5]), arc([2, -0.5], [3, 0.5], [2, 1.5]), [-1, 1.5]])",
    ] {
        follows(outline, slot, 1.01e-3);
    }
    // an arc that bends inwards
    let bitten = |p: DVec2| {
        let square = 2.0 - p.x.abs().max(p.y.abs());
        square.min(p.distance(DVec2::new(2.0, 0.0)) - 1.0)
    };
    follows("polygon([[-2, -2], [2, -2], arc([2, -1], [1, 0], [2, 1]), [2, 2], [-2, 2]])", bitten, 1.01e-3);
}

/// Through 24 points of an ellipse the spline is at most 1e-3 away.
#[test]
fn splines_follow_smooth_outlines() {
    let ellipse = |p: DVec2| {
        // by Newton's method from the nearest of many points: the distance from the ellipse 3 cos a, 1.5 sin a
        let at = |a: f64| DVec2::new(3.0 * a.cos(), 1.5 * a.sin());
        let nearest = (0..90)
            .map(|i| TAU * f64::from(i) / 90.0)
            .min_by(|a, b| p.distance(at(*a)).partial_cmp(&p.distance(at(*b))).unwrap());
        let mut a = nearest.unwrap();
        for _ in 0..6 {
            let tangent = DVec2::new(-3.0 * a.sin(), 1.5 * a.cos());
            let slope = (at(a) - p).dot(tangent);
            let bend = tangent.length_squared() - (at(a) - p).dot(at(a));
            a -= if bend > 0.0 { slope / bend } else { 0.0 };
        }
        let inside = (p.x / 3.0).powi(2) + (p.y / 1.5).powi(2) <= 1.0;
        if inside { p.distance(at(a)) } else { -p.distance(at(a)) }
    };
    let points: String = (0..24)
        .map(|i| {
            let a = TAU * f64::from(i) / 24.0;
            format!("[{:?}, {:?}], ", 3.0 * a.cos(), 1.5 * a.sin())
        })
        .collect();
    let spline = format!("polygon(spline([{points}[3, 0]]))");
    // chords: 6/2000
    follows(&spline, ellipse, 4e-3);
    let fine = format!("polygon(spline([{points}[3, 0]], 1e-4))");
    follows(&fine, ellipse, 1.1e-3);
}

/// The half of a disc turned around z is a ball; a disc between two planes is a cylinder.
#[test]
fn curved_profiles_are_turned_and_extruded() {
    let mut random = Random(7);
    let over = Aabb::new(DVec3::splat(-2.5), DVec3::splat(2.5));
    let ball = solid("polygon([arc([0, 0], 2, -90°, 90°), [-0.1, 2], [-0.1, -2]]).revolve()");
    let disc = solid("polygon(arc([0.5, 0], 1.5, 0°, 360°)).extrude(-1, 2)");
    for _ in 0..50_000 {
        let p = random.in_box(&over);
        let to_ball = 2.0 - p.length();
        let to_disc = (1.5 - DVec2::new(p.x - 0.5, p.y).length()).min((p.z + 1.0).min(2.0 - p.z));
        for (found, truth) in [(&ball, to_ball), (&disc, to_disc)] {
            if truth.abs() > 2.01e-3 {
                assert_eq!(found.omega(p) > 0.0, truth > 0.0, "{p}");
            }
        }
    }
}

#[test]
fn a_file_of_points_is_an_outline() {
    // half a turn of a circle from a file, closed by a straight edge or smoothly
    let rows: String =
        (0..=12).map(|i| f64::from(i) * PI / 12.0).map(|a| format!("{}, {}\n", a.cos(), a.sin())).collect();
    let found = with_file("polygon(spline(points(\"half.csv\")*2)).extrude(0, 1)", &rows, Engine::Auto);
    let mut random = Random(11);
    for _ in 0..20_000 {
        let p = random.in_box(&Aabb::new(DVec3::new(-2.5, -1.0, 0.1), DVec3::new(2.5, 2.5, 0.9)));
        // the ends of an open spline are straight, so it is a little off there
        let truth = (2.0 - p.truncate().length()).min(p.y);
        if truth.abs() > 0.02 {
            assert_eq!(found.omega(p) > 0.0, truth > 0.0, "{p}");
        }
    }
}

/// A path from a file that ends where it began is closed for all that follow it, and an outline all the same.
#[test]
fn a_path_from_a_file_is_closed_by_its_last_point() {
    let rows = "0, 0, 0\n1, 0, 0\n1, 1, 0\n0, 1, 0\n0, 0, 0\n";
    let middle = DVec3::new(0.0, 0.5, 0.0);
    for path in ["points(\"c.csv\")", "rounded(points(\"c.csv\"), 0.2)"] {
        assert_eq!(with_file(&format!("sweep({path}, 0.1)"), rows, Engine::Auto).sign(middle), 1.0, "{path}");
    }
    // as smooth at its end as elsewhere
    let ring = with_file("sweep(spline(points(\"c.csv\")), 0.1)", rows, Engine::Auto);
    assert_eq!([-0.2, 1.2].map(|y| ring.sign(DVec3::new(0.5, y, 0.0))), [1.0, 1.0]);
    let plate = with_file("polygon(points(\"c.csv\")).extrude(0, 1)", "0 0\n1 0\n1 1\n0 0\n", Engine::Auto);
    assert_eq!(plate.sign(DVec3::new(0.8, 0.4, 0.5)), 1.0);
    let numbers = with_file("sphere(count(points(\"c.csv\")))", "1\n2\n1\n", Engine::Auto);
    assert_eq!(numbers.sign(DVec3::new(2.9, 0.0, 0.0)), 1.0);
}

/// At the sharp edge of a wing a closed spline would go on round, and cross itself.
#[test]
fn a_spline_has_a_corner_where_its_points_turn_back() {
    let rows = "1, 0\n0.5, 0.06\n0.1, 0.05\n0, 0\n0.1, -0.04\n0.5, -0.03\n1, 0\n";
    let wing = with_file("polygon(spline(points(\"c.csv\"))).extrude(0, 1)", rows, Engine::Auto);
    let Bounds::Within(bounds) = *wing.bounds() else { panic!("{:?}", wing.bounds()) };
    assert!((bounds.max.x - 1.0).abs() < 1e-6, "{bounds:?}");
}

/// The distance from a chain of segments.
fn distance(p: DVec3, chain: &[DVec3]) -> f64 {
    let to = |pair: &[DVec3]| {
        let along = pair[1] - pair[0];
        let at = ((p - pair[0]).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        (p - pair[0] - along * at).length()
    };
    chain.windows(2).map(to).fold(f64::INFINITY, f64::min)
}

fn written(chain: &[DVec3]) -> String {
    let points: Vec<String> = chain.iter().map(|p| format!("[{:?}, {:?}, {:?}]", p.x, p.y, p.z)).collect();
    format!("[{}]", points.join(", "))
}

#[test]
fn tubes_are_all_points_near_their_path() {
    let mut random = Random(13);
    let over = Aabb::new(DVec3::splat(-3.0), DVec3::splat(3.0));
    let straight = vec![DVec3::ZERO, DVec3::Z, DVec3::new(0.0, 2.0, 1.0), DVec3::new(0.0, 2.0, -1.0)];
    let mut paths = vec![straight];
    for count in [2, 3, 7, 50] {
        paths.push((0..count).map(|_| 0.7 * random.in_box(&over)).collect());
    }
    for path in paths {
        let radius = 0.1 + 0.2 * random.unit();
        let found = solid(&format!("sweep({}, {radius})", written(&path)));
        for i in 0..20_000 {
            let mut p = random.in_box(&over);
            if i % 2 == 0 {
                // close to the surface
                let at = (random.unit() * (path.len() - 1) as f64) as usize;
                let on = path[at].lerp(path[at + 1], 1.4 * random.unit() - 0.2);
                p = on + (p - on).normalize() * radius * (0.9 + 0.2 * random.unit());
            }
            let d = distance(p, &path);
            let (omega, gradient) = found.omega_grad(p);
            let expected = (radius * radius - d * d) / (2.0 * radius);
            assert!((omega - expected).abs() <= 1e-12 * (1.0 + d * d / radius), "{p}: {omega} {expected}");
            // of length d/r everywhere, at joints too
            assert!((gradient.length() - d / radius).abs() <= 1e-9 * (1.0 + d / radius), "{p}: {gradient}");
            let contact = found.contact(p);
            if (d - radius).abs() < 0.1 * radius {
                assert!((contact.distance - (d - radius)).abs() <= 1e-9, "{p}: {contact:?} {}", d - radius);
            }
        }
        let Bounds::Within(bounds) = *found.bounds() else { panic!("{:?}", found.bounds()) };
        let truth = path.iter().fold(Aabb::EMPTY, |all, p| all.union(&Aabb::new(*p, *p))).grown(radius);
        assert!(bounds.union(&truth.grown(-1e-9)) == bounds, "{bounds:?} {truth:?}");
        assert!(
            truth.grown(0.05 * radius + 1e-6).union(&bounds) == truth.grown(0.05 * radius + 1e-6),
            "{bounds:?} {truth:?}"
        );
    }
}

#[test]
fn a_helix_is_a_tube_around_its_line() {
    let spring = solid("sweep(helix(1, 0.5, 3), 0.1)");
    let left = solid("sweep(helix(1, 0.5, -3), 0.1)");
    let exact: Vec<DVec3> = (0..=30_000)
        .map(|i| 3.0 * f64::from(i) / 30_000.0)
        .map(|turn| DVec3::new((TAU * turn).cos(), (TAU * turn).sin(), 0.5 * turn))
        .collect();
    let mut random = Random(17);
    for _ in 0..300 {
        let p = random.in_box(&Aabb::new(DVec3::new(-1.2, -1.2, -0.2), DVec3::new(1.2, 1.2, 1.7)));
        let truth = 0.1 - distance(p, &exact);
        if truth.abs() > 1.01e-3 {
            assert_eq!(spring.omega(p) > 0.0, truth > 0.0, "{p}");
            let mirrored = DVec3::new(p.x, -p.y, p.z);
            assert_eq!(left.omega(mirrored) > 0.0, truth > 0.0, "{p}");
        }
    }
    // along the line itself
    for p in exact.iter().step_by(100) {
        assert!(spring.omega(*p) > 0.049);
    }
}

/// Between two circles a loft is a cone, with its distance from the wall.
#[test]
fn a_loft_between_circles_is_a_cone() {
    let cone = solid("loft(2 - sqrt(x^2 + y^2), 1 - sqrt(x^2 + y^2), -1, 1)");
    let mut random = Random(19);
    let over = Aabb::new(DVec3::splat(-2.5), DVec3::splat(2.5));
    for _ in 0..20_000 {
        let mut p = random.in_box(&over);
        let wall = |p: DVec3| (1.5 - 0.5 * p.z - p.truncate().length()) / 1.25f64.sqrt();
        let truth = wall(p).min(p.z + 1.0).min(1.0 - p.z);
        if truth.abs() > 1e-9 {
            assert_eq!(cone.omega(p) > 0.0, truth > 0.0, "{p}");
        }
        // on the wall
        p.z = p.z.clamp(-0.9, 0.9);
        let out = (p * DVec3::new(1.0, 1.0, 0.0)).normalize();
        p = out * (1.5 - 0.5 * p.z) + p.z * DVec3::Z;
        let (omega, gradient) = cone.omega_grad(p);
        let normal = -(out + 0.5 * DVec3::Z) / 1.25f64.sqrt();
        assert!(omega.abs() < 1e-14 && (gradient - normal).length() < 1e-9, "{p}: {omega} {gradient}");
        let contact = cone.contact(p + 0.05 * normal);
        assert!((contact.distance.abs() - 0.05).abs() < 2e-3, "{contact:?}");
    }
    let Bounds::Within(bounds) = *cone.bounds() else { panic!("{:?}", cone.bounds()) };
    let allowed = Aabb::new(DVec3::new(-2.0, -2.0, -1.0), DVec3::new(2.0, 2.0, 1.0)).grown(0.02);
    assert!(allowed.union(&bounds) == allowed, "{bounds:?}");
}

/// From a star to a disc that stands beside its middle: the sign is that of the weighed distances, and the
/// gradient is that of differences.
#[test]
fn a_loft_weighs_two_outlines() {
    let star =
        "polygon([[2, 0], [0.5, 0.5], [0, 2], [-0.5, 0.5], [-2, 0], [-0.5, -0.5], [0, -2], [0.5, -0.5]])";
    let disc = "polygon(arc([0.5, 0], 1, 0°, 360°))";
    let [a, b] = [star, disc].map(|profile| solid(&format!("{profile}.distance()")));
    let loft = solid(&format!("{star}.loft({disc}, 0.5, 2)"));
    let Bounds::Within(bounds) = *loft.bounds() else { panic!("{:?}", loft.bounds()) };
    let mut random = Random(23);
    let mut compared = 0;
    for _ in 0..20_000 {
        let p = random.in_box(&bounds.grown(0.3));
        let s = ((p.z - 0.5) / 1.5).clamp(0.0, 1.0);
        let side = (1.0 - s) * a.omega(p) + s * b.omega(p);
        let truth = side.min(p.z - 0.5).min(2.0 - p.z);
        let (omega, gradient) = loft.omega_grad(p);
        if truth.abs() > 1e-12 {
            assert_eq!(omega > 0.0, truth > 0.0, "{p}");
            assert!(truth < 0.0 || bounds.contains(p));
        }
        let h = 1e-6;
        let slope = |axis: DVec3| (loft.omega(p + h * axis) - loft.omega(p - h * axis)) / (2.0 * h);
        let differences = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z));
        // differences across a crease say nothing: there are few of those
        compared += usize::from((gradient - differences).length() < 1e-4 * (1.0 + gradient.length()));
    }
    assert!(compared > 19_900, "{compared}");
}

/// A box with round edges along z, and a pipe with bends of a given radius.
#[test]
fn corners_are_rounded() {
    let square = |p: DVec2| {
        let over = (p.abs() - DVec2::new(1.5, 0.5)).max(DVec2::ZERO);
        0.5 - over.length()
    };
    follows("polygon(rounded([[-2, -1], [2, -1], [2, 1], [-2, 1], [-2, -1]], 0.5))", square, 5.1e-4);
    let bend = solid("sweep(rounded([[-2, 0, 0], [0, 0, 0], [0, 0, 2]], 1), 0.3)");
    let mut random = Random(29);
    for _ in 0..20_000 {
        let p = random.in_box(&Aabb::new(DVec3::new(-2.4, -0.5, -0.5), DVec3::new(0.5, 0.5, 2.4)));
        // two straight pieces and a quarter of a torus around [-1, ·, 1]
        let line = match p {
            p if p.x < -1.0 => distance(p, &[DVec3::new(-2.0, 0.0, 0.0), DVec3::new(-1.0, 0.0, 0.0)]),
            p if p.z > 1.0 => distance(p, &[DVec3::Z, 2.0 * DVec3::Z]),
            p => ((p.x + 1.0).hypot(p.z - 1.0) - 1.0).hypot(p.y),
        };
        let line = if p.x < -1.0 && p.z > 1.0 { f64::INFINITY } else { line };
        let truth = 0.3 - line;
        if truth.abs() > 1.01e-3 && line.is_finite() {
            assert_eq!(bend.omega(p) > 0.0, truth > 0.0, "{p}");
        }
    }
}

/// Draws the outlines of a glyph as many short chords.
struct Chords {
    contours: Vec<Vec<DVec2>>,
    scale: f64,
}

impl Chords {
    fn to(&mut self, curve: impl Fn(DVec2, f64) -> DVec2, count: i32) {
        let contour = self.contours.last_mut().unwrap();
        let from = *contour.last().unwrap();
        contour.extend((1..=count).map(|i| curve(from, f64::from(i) / f64::from(count))));
    }

    fn place(&self, x: f32, y: f32) -> DVec2 {
        self.scale * DVec2::new(f64::from(x), f64::from(y))
    }
}

impl ttf_parser::OutlineBuilder for Chords {
    fn move_to(&mut self, x: f32, y: f32) {
        self.contours.push(vec![self.place(x, y)]);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let end = self.place(x, y);
        self.to(|_, _| end, 1);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let (middle, end) = (self.place(x1, y1), self.place(x, y));
        self.to(|from, t| from.lerp(middle, t).lerp(middle.lerp(end, t), t), 50);
    }

    fn curve_to(&mut self, _: f32, _: f32, _: f32, _: f32, _: f32, _: f32) {
        panic!("the font has curves of second order");
    }

    fn close(&mut self) {}
}

/// How often the outlines go round a point, and its distance from them.
fn turns_around(p: DVec2, contours: &[Vec<DVec2>]) -> (i32, f64) {
    let (mut turns, mut nearest) = (0, f64::INFINITY);
    for contour in contours {
        for (i, &a) in contour.iter().enumerate() {
            let b = contour[(i + 1) % contour.len()];
            let side = (b - a).perp_dot(p - a);
            turns += i32::from(a.y <= p.y && b.y > p.y && side > 0.0);
            turns -= i32::from(a.y > p.y && b.y <= p.y && side < 0.0);
            let along = ((p - a).dot(b - a) / (b - a).length_squared().max(1e-300)).clamp(0.0, 1.0);
            nearest = nearest.min(p.distance(a.lerp(b, along)));
        }
    }
    (turns, nearest)
}

/// Every letter that a keyboard has, and some others: the sign is that of the glyph's outlines.
#[test]
fn letters_have_the_outlines_of_the_font() {
    let face = ttf_parser::Face::parse(epaint_default_fonts::UBUNTU_LIGHT, 0).unwrap();
    let scale = 1.0 / f64::from(face.capital_height().unwrap());
    let mut random = Random(31);
    for letter in ('!'..='~').chain("äÉßΩωжЯ€".chars()) {
        let mut chords = Chords { contours: Vec::new(), scale };
        face.outline_glyph(face.glyph_index(letter).unwrap(), &mut chords).unwrap();
        let quoted = if matches!(letter, '"' | '\\') { continue } else { letter };
        let found = solid(&format!("text(\"{quoted}\", 1)"));
        let mut inside = 0;
        for _ in 0..1500 {
            let p = random.in_box(&Aabb::new(DVec3::new(-0.1, -0.4, 0.0), DVec3::new(1.4, 1.4, 1.0)));
            let (turns, away) = turns_around(p.truncate(), &chords.contours);
            if away > 1.1e-3 {
                let omega = found.omega(p);
                assert!(omega != 0.0 && (omega > 0.0) == (turns != 0), "{letter} at {p}: {omega}");
                inside += usize::from(omega > 0.0);
            }
        }
        assert!(inside > 2, "{letter}: {inside}");
    }
    let advance = scale * f64::from(face.glyph_hor_advance(face.glyph_index('H').unwrap()).unwrap());
    let (two, one) = (solid("text(\"HH\", 2)"), solid("text(\"H\", 1).scale(2)"));
    for _ in 0..5000 {
        let p = random.in_box(&Aabb::new(DVec3::new(-0.1, -0.4, 0.0), DVec3::new(5.0, 2.4, 1.0)));
        let truth = one.omega(p).max(one.omega(p - 2.0 * advance * DVec3::X));
        if truth.abs() > 1e-9 {
            assert_eq!(two.omega(p) > 0.0, truth > 0.0, "{p}");
        }
    }
}

#[test]
fn curves_with_mistakes_are_explained() {
    // letters are counted and not their bytes
    solid(&format!("text(\"{}\", 1)", "Ж".repeat(600)));
    for (definition, words) in [
        ("polygon(arc([0, 0], [1, 1], [2, 2]))", "lie on a line"),
        ("polygon(arc([0, 0], 1, 0°, 0°))", "an angle up to 360°"),
        ("polygon(arc([0, 0], 1, 0°, 400°))", "an angle up to 360°"),
        ("polygon(arc([0, 0], -1, 0°, 90°))", "must be positive"),
        ("polygon(arc([0, 0], 1, 0°))", "a radius and two angles"),
        ("polygon(arc([0, 0], 1, 0 m, 90°))", "a length is not an angle"),
        ("polygon(arc([0, 0], 1, -5 mm, 90°))", "a length is not an angle"),
        ("polygon(arc([0, 0], 1, 0°, 90°, 1e-15))", "more than 10000 points"),
        ("polygon(arc([0, 0], [1, 1], [2, 0], 0.1, 0.1))", "three points and a tolerance"),
        ("polygon(arc([0, 0], [1, 1, 1], [2, 0]))", "as many as the other points"),
        ("polygon(arc([x, 0], 1, 0°, 90°))", "must be a constant"),
        ("polygon(spline([[0, 0], [1, 0], [1, 0], [0, 1]]))", "points 1 and 2 of the path are the same"),
        ("polygon(spline([[0, 0], [1, 0], [0, 0]]))", "a closed one through three"),
        ("polygon(spline([[0, 0, 0], [1, 0, 0], [0, 1, 0]]))", "a corner has two coordinates"),
        ("polygon(spline(3))", "takes a list of points"),
        ("polygon(spline([[0, 0], [1e200, 0], [0, 1]]))", "too far apart"),
        ("polygon(rounded([[0, 0], [1, 0], [1, 1], [0, 0]], 0.5))", "no room for the arc"),
        ("polygon(rounded([[0, 0], [1, 0], [0.5, 0], [0, 1]], 0.1))", "turns back on itself at point 1"),
        ("loft(x <= 1, x <= 2, 1, 1)", "the height of a loft must be positive"),
        ("text(3, 1)", "expected a text in quotes"),
        ("text(\"\", 1)", "1 to 1000 letters"),
        ("text(\"字\", 1)", "no letter for '字'"),
        ("text(\"R\", 0)", "must be positive"),
        ("sweep([[0, 0], [1, 1]], 0.1)", "three coordinates"),
        ("sweep([[0, 0, 0]], 0.1)", "two points or more"),
        ("sweep([[0, 0, 0], [1, 0, 0]], 0)", "must be positive"),
        ("sweep([[0, 0, 0], [1, 0, 0]], x)", "a tube has a radius, found a shape"),
        ("sweep([[0, 0, 0], [1, 0, 0]], 1e-162)", "scale the numbers"),
        ("sweep([[0, 0, 0], [1, 0, 0]], 1e200)", "scale the numbers"),
        ("sweep(helix(1, 1, 0), 0.1)", "cannot be 0"),
        ("sweep(helix(1, 1, 1e9), 0.1)", "more than 10000 points"),
        ("sweep([[0, 0, 0], [1e300, 0, 0]], 0.1)", "apart"),
    ] {
        let found = mistake(definition);
        assert!(found.contains(words), "{definition}: {found}");
    }
}
