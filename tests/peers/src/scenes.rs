//! Obstacles that every library evaluates, written for rfm; `fidget.rs` has them in Fidget's notation.

use std::fmt::Write;

/// Side of the box [0, 3]³ that all scenes stand in.
pub const SIDE: f64 = 3.0;

/// Sphere with ω = r2 − |p − centre|².
#[derive(Clone)]
pub struct Sphere {
    pub centre: [f64; 3],
    pub r2: f64,
}

/// Order in which a union of many is taken; R₀ is not associative in value.
#[derive(Clone, Copy, PartialEq)]
pub enum Order {
    Left,
    Balanced,
}

pub const PAWN: &str = include_str!("../../../examples/pawn.rfm");
pub const BISHOP: &str = include_str!("../../../examples/bishop.rfm");
pub const CUBE: &str = include_str!("../../../examples/cube.rfm");
/// One node whose two operands are given.
pub const AND: &str = "rfm 1\nsolid both = x and y\n";

/// Reproducible sequence of numbers in [0, 1).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Spheres all over the box, with about equal total volume whatever their number. All numbers are multiples
/// of 2⁻¹⁶ below 4, so that `f32` holds them and a decimal text gives them exactly.
pub fn spheres(n: usize) -> Vec<Sphere> {
    let mut random = Random(n as u64);
    let mut grid = |scale: f64| (random.next() * scale * 65536.0).round() / 65536.0;
    let size = (n as f64).powf(-2.0 / 3.0); // Size of r².
    (0..n)
        .map(|_| Sphere {
            centre: [grid(SIDE), grid(SIDE), grid(SIDE)],
            r2: 1.0 / 65536.0 + grid(size) + (size * 16384.0).round() / 65536.0,
        })
        .collect()
}

/// Folds a list, from the left or as a balanced tree.
pub fn fold<T: Clone>(list: &[T], order: Order, join: &impl Fn(T, T) -> T) -> T {
    match order {
        Order::Left => list[1..].iter().cloned().fold(list[0].clone(), join),
        Order::Balanced if list.len() == 1 => list[0].clone(),
        Order::Balanced => {
            let (a, b) = list.split_at(list.len().div_ceil(2));
            join(fold(a, order, join), fold(b, order, join))
        }
    }
}

/// Writes a file with the union of spheres as its solid `union`.
pub fn union_text(spheres: &[Sphere], order: Order) -> String {
    let leaf = |s: &Sphere| {
        let [a, b, c] = s.centre;
        format!("{} - (x - {a})^2 - (y - {b})^2 - (z - {c})^2", s.r2)
    };
    let mut text = String::from("rfm 1\n");
    let mut add = |part: &str, sphere: &Sphere| {
        write!(text, "{part}{}", leaf(sphere)).expect("a string takes everything");
    };
    match order {
        // Each step has a name, because a chain of `or` is one operation, which is evaluated as a balanced
        // tree.
        Order::Left => {
            let last = spheres.len() - 1;
            for (i, sphere) in spheres.iter().enumerate() {
                let item = if i == last { "solid union".to_string() } else { format!("let u{i}") };
                let former = if i == 0 { String::new() } else { format!("u{} or ", i - 1) };
                add(&format!("\n{item} = {former}"), sphere);
            }
        }
        Order::Balanced => {
            for (i, sphere) in spheres.iter().enumerate() {
                add(if i == 0 { "solid union = " } else { "\n  or " }, sphere);
            }
        }
    }
    text.push('\n');
    text
}

/// Ball whose radius itself is given.
#[derive(Clone)]
pub struct Ball {
    pub centre: [f64; 3],
    pub radius: f64,
}

/// Balls at random places in the box, all inside it, many of them overlapping.
pub fn balls(n: usize) -> Vec<Ball> {
    let mut random = Random(11);
    (0..n)
        .map(|_| Ball {
            centre: [(); 3].map(|()| 0.2 + 2.6 * random.next()),
            radius: 0.05 + 0.05 * random.next(),
        })
        .collect()
}

/// Writes a file with the union of balls as its solid `balls`.
pub fn balls_text(balls: &[Ball]) -> String {
    let leaf = |Ball { centre: [x, y, z], radius }: &Ball| format!("ball([{x}, {y}, {z}], {radius})");
    let list: Vec<String> = balls.iter().map(leaf).collect();
    format!("rfm 1\nsolid balls = {}\n", list.join("\n or "))
}
