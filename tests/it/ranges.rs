//! Guaranteed ranges: no point is ever outside, in machine code and in the interpreter.

use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::{Engine, Field, Program, Solid};

const MORE: &str = "rfm 1
solid mixed = (torus(1, 0.3).rotate_x(0.4) or cone(1, 2) \\ cylinder(0.3, 3)) and abs(x - y/3) <= 2 - z
  or capsule(0.2, 1).move([1, 1, 0]) or x*y*z <= -1 and 2*x^3 - x*y + 0.1 >= z/7 and -1.5 <= x + y <= 2
";

fn solids() -> Vec<[Solid; 2]> {
    let example = |name: &str| {
        let path = format!("{}/examples/{name}.rfm", env!("CARGO_MANIFEST_DIR"));
        (Program::from_path(path).unwrap_or_else(|e| panic!("{e}")), name.to_string())
    };
    let more = Program::from_source("more.rfm", MORE).unwrap_or_else(|e| panic!("{e}"));
    let all = [example("cube"), example("pawn"), example("bishop"), (more, "mixed".to_string())];
    all.map(|(program, name)| {
        [Engine::Jit, Engine::Interpreter].map(|engine| program.solid_with(&name, engine).unwrap())
    })
    .into()
}

struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A box of any size from 1e-9 to 10 somewhere within 5 of the origin; some are flat or single points.
    fn aabb(&mut self) -> Aabb {
        let size = 10f64.powf(10.0 * self.unit() - 9.0);
        let min = 10.0 * DVec3::new(self.unit(), self.unit(), self.unit()) - 5.0;
        let side = |r: f64| if r < 0.1 { 0.0 } else { size * r };
        let size = DVec3::new(side(self.unit()), side(self.unit()), side(self.unit()));
        Aabb::new(min, min + size)
    }
}

#[test]
fn no_point_is_outside_its_range() {
    let mut random = Random(3);
    for [jit, interpreter] in solids() {
        for _ in 0..20_000 {
            let over = random.aabb();
            let (fast, slow) = (jit.range(&over), interpreter.range(&over));
            let (twin, slow_twin) = (jit.twin().range(&over), interpreter.twin().range(&over));
            for _ in 0..4 {
                let at = DVec3::new(random.unit(), random.unit(), random.unit());
                let p = (over.min + over.size() * at).clamp(over.min, over.max);
                let omega = jit.omega(p);
                assert!(
                    fast.contains(omega) && slow.contains(omega),
                    "{jit:?} over {over:?}: {omega} {fast:?} {slow:?}"
                );
                let omega = Field::omega(&jit.twin(), p);
                assert!(
                    twin.contains(omega) && slow_twin.contains(omega),
                    "{jit:?} over {over:?}: {omega} {twin:?}"
                );
            }
            // machine code is not wider than a few roundings
            for (fast, slow) in [(fast, slow), (twin, slow_twin)] {
                let slack = 1e-12 * (1.0 + slow.lo.abs().max(slow.hi.abs()));
                let close = fast.lo >= slow.lo - slack && fast.hi <= slow.hi + slack;
                assert!(close, "{jit:?} over {over:?}: {fast:?} {slow:?}");
            }
        }
    }
}

#[test]
fn most_cells_of_the_pawn_are_decided() {
    let [pawn, _] = &solids()[1];
    let twin = pawn.twin();
    let side = 3.0 / 32.0;
    let (mut decided, mut near) = (0, 0);
    for i in 0..32 * 32 * 32 {
        let corner = DVec3::new(f64::from(i % 32), f64::from(i / 32 % 32), f64::from(i / 1024)) * side;
        let range = twin.range(&Aabb::new(corner, corner + side));
        if range.lo > 0.0 || range.hi < 0.0 { decided += 1 } else { near += 1 }
    }
    // the monotone rule: 98 % of the cells at depth five
    assert!(decided * 100 >= 98 * (decided + near), "{decided} decided, {near} not");
}

#[test]
fn odd_boxes_have_an_answer() {
    for [jit, interpreter] in solids() {
        let infinite = Aabb::new(DVec3::NEG_INFINITY, DVec3::INFINITY);
        let far = Aabb::new(DVec3::splat(1e12), DVec3::splat(2e12));
        let nan = Aabb::new(DVec3::NAN, DVec3::ONE);
        for over in [infinite, far, nan, Aabb::EMPTY] {
            let range = jit.range(&over);
            assert_eq!(range, interpreter.range(&over));
            assert!(range.lo <= range.hi);
        }
    }
}
