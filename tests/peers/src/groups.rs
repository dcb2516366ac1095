//! The measured questions: each group asks all libraries that can answer it one question about one obstacle.

use fidget::jit::JitShape;
use rfm::codegen::Form;
use rfm::glam::DVec3;

use crate::fidget::{self as peer, Joins};
use crate::hand::{self, Width};
use crate::measure::{Asks, Group, Points, Row};
use crate::ours::{self, Precision};
use crate::scenes::{self, Order, Random, SIDE};

/// Number of cells along a side of the box: ranges are taken over cells of which 32³ fill it.
const CELLS: usize = 32;

const HAND_F32: &str = "hand textbook 128-bit f32";
const HAND_F64: &str = "hand textbook 128-bit f64";
const RAW: &str = "Fidget raw f32";

/// Distance within which contact is looked for: a centimetre, as in the notes on distance errors.
const REACH: f64 = 0.01;

pub const MAP_SIGN: &str = "ours sign by cell map f64";
pub const MAP_CONTACT: &str = "ours contact by cell map f64";

fn hand_of<T: Precision>() -> &'static str {
    if T::NAME == "f32" { HAND_F32 } else { HAND_F64 }
}

/// An obstacle in the notation of both sides.
pub struct Obstacle {
    pub title: String,
    pub text: String,
    pub name: &'static str,
    pub tree: Box<dyn Fn(Joins) -> fidget::context::Tree>,
    /// Points at edges and corners.
    pub corners: Vec<[f64; 3]>,
    /// Number of points whose 120-digit truth is computed.
    pub checked: usize,
    pub hand: Hand,
}

/// Formula written by hand for an obstacle, if any.
pub enum Hand {
    Pawn,
    Spheres(Vec<scenes::Sphere>, Order),
    Nobody,
}

pub fn obstacles() -> Vec<Obstacle> {
    let rim = |r: f64, z: f64| [[1.5 + r, 1.5, z], [1.5 - r, 1.5, z], [1.5, 1.5 + r, z], [1.5, 1.5 - r, z]];
    let of = |i: usize| [0.0, 1.5, 3.0][i % 3];
    // These are all points of a 3×3×3 lattice on the cube with at least two coordinates on its faces.
    let on_edges = |p: &[f64; 3]| p.iter().filter(|&&c| c != 1.5).count() >= 2;
    let edges: Vec<[f64; 3]> = (0..27).map(|i| [of(i), of(i / 3), of(i / 9)]).filter(on_edges).collect();
    let named = |name: &'static str, text: &str, tree: fn(Joins) -> _, corners| Obstacle {
        title: name.into(),
        text: text.into(),
        name,
        tree: Box::new(tree),
        corners,
        checked: 300,
        hand: if name == "pawn" { Hand::Pawn } else { Hand::Nobody },
    };
    let union = |n: usize, order: Order, checked: usize| {
        let spheres = scenes::spheres(n);
        let shape = if order == Order::Left { "left fold" } else { "balanced" };
        Obstacle {
            title: format!("{n} spheres, {shape}"),
            text: scenes::union_text(&spheres, order),
            name: "union",
            hand: if n == 64 { Hand::Spheres(spheres.clone(), order) } else { Hand::Nobody },
            tree: Box::new(move |joins| peer::union(&spheres, order, joins)),
            corners: Vec::new(),
            checked,
        }
    };
    vec![
        named("cube", scenes::CUBE, peer::cube, edges),
        named("pawn", scenes::PAWN, peer::pawn, rim(0.5, 0.0).to_vec()),
        named("bishop", scenes::BISHOP, peer::bishop, rim(0.5, 0.0).to_vec()),
        union(64, Order::Left, 100),
        union(64, Order::Balanced, 100),
        union(500, Order::Left, 30),
        union(500, Order::Balanced, 30),
        union(10_000, Order::Balanced, 3),
    ]
}

impl Obstacle {
    /// Approximate number of leaves.
    pub fn primitives(&self) -> usize {
        if self.name == "union" { self.text.matches("(x -").count() } else { 5 }
    }

    pub fn points(&self) -> Points {
        // Obstacles with very many primitives get fewer points, or the contact alone would take minutes.
        let n = if self.primitives() > 1000 { 256 } else { crate::measure::BATCH };
        Points::random(n, SIDE, 1)
    }

    fn hand_rows<T: Precision>(&self, rows: &mut Vec<Row>) {
        let against = [Some(hand_of::<T>()), Some(RAW)];
        for (width, bits) in
            [(Width::Bits128, "128-bit"), (Width::Bits256, "256-bit"), (Width::Plain, "plain loop")]
        {
            if !width.is_here() {
                continue;
            }
            let name = |form: &str| format!("hand {form} {bits} {}", T::NAME);
            match &self.hand {
                Hand::Pawn => {
                    let work = ours::by_hand::<T, _>(width, hand::Textbook);
                    rows.push(Row::new(name("textbook"), Asks::Value, against, work));
                    let work = ours::by_hand::<T, _>(width, hand::Stable);
                    rows.push(Row::new(name("half-angle"), Asks::Value, against, work));
                }
                Hand::Spheres(spheres, order) => {
                    let formula = hand::Spheres { list: spheres.clone(), order: *order };
                    let work = ours::by_hand::<T, _>(width, formula);
                    rows.push(Row::new(name("textbook"), Asks::Value, against, work));
                }
                Hand::Nobody => {}
            }
        }
    }

    /// ω, its sign and the contact, at all points of a batch.
    pub fn values(&self) -> Group {
        let mut group = Group::new(format!("{}: ω", self.title));
        let rows = &mut group.rows;
        self.hand_rows::<f32>(rows);
        self.hand_rows::<f64>(rows);
        let hand = |name| if matches!(self.hand, Hand::Nobody) { None } else { Some(name) };
        let shape = JitShape::from((self.tree)(Joins::R0));
        let flat = JitShape::from((self.tree)(Joins::MinMax));
        let against = [hand(HAND_F32), Some(RAW)];
        rows.push(Row::new(RAW, Asks::Value, against, peer::raw(&shape)));
        rows.push(Row::new("Fidget Shape API f32", Asks::Value, against, peer::shape_api(&shape)));
        rows.push(Row::new("Fidget raw min/max f32", Asks::Sign, against, peer::raw(&flat)));
        self.our_values::<f32>(rows, against);
        self.our_values::<f64>(rows, [hand(HAND_F64), Some(RAW)]);
        group.measure(&self.points());
        let solid = ours::solid_lazily(&self.text, self.name, Form::Stable);
        group.check(&solid, &self.points(), self.checked, &[]);
        group
    }

    fn our_values<T: Precision>(&self, rows: &mut Vec<Row>, against: [Option<&'static str>; 2]) {
        let [stable, guarded, textbook] = [Form::Stable, Form::Guarded, Form::Textbook]
            .map(|form| ours::solid_lazily(&self.text, self.name, form));
        let name = |what: &str| format!("ours {what} {}", T::NAME);
        rows.push(Row::new(name("stable"), Asks::Value, against, ours::value::<T>(&stable)));
        rows.push(Row::new(name("guarded"), Asks::Value, against, ours::value::<T>(&guarded)));
        rows.push(Row::new(name("textbook"), Asks::Value, against, ours::value::<T>(&textbook)));
        rows.push(Row::new(name("sign"), Asks::Sign, against, ours::sign::<T>(&stable)));
        rows.push(Row::new(name("contact"), Asks::Distance, against, ours::contact::<T>(&stable)));
    }

    /// Sign and contact at random points through a cell map of the box.
    pub fn through_cells(&self) -> Group {
        let mut group = Group::new(format!("{}: through the cell map", self.title));
        let shape = JitShape::from((self.tree)(Joins::R0));
        let solid = ours::solid_lazily(&self.text, self.name, Form::Stable);
        let map = ours::cell_map(&solid, REACH);
        let against = [None, Some(RAW)];
        group.rows = vec![
            Row::new(RAW, Asks::Value, against, peer::raw(&shape)),
            Row::new(MAP_SIGN, Asks::Sign, against, ours::map_sign(&map)),
            Row::new(MAP_CONTACT, Asks::Other, against, ours::map_contact(&map)),
        ];
        let points = Points::random(crate::measure::BATCH, SIDE, 1);
        group.measure(&points);
        group.check(&solid, &points, self.checked, &[]);
        group
    }

    /// ω and ∇ω at all points of a batch.
    pub fn gradients(&self) -> Group {
        let mut group = Group::new(format!("{}: ω and ∇ω", self.title));
        let rows = &mut group.rows;
        let is_pawn = matches!(self.hand, Hand::Pawn);
        if is_pawn {
            self.hand_gradients::<f32>(rows);
            self.hand_gradients::<f64>(rows);
        }
        let shape = JitShape::from((self.tree)(Joins::R0));
        let against = [is_pawn.then_some(HAND_F32), Some(RAW)];
        rows.push(Row::new(RAW, Asks::Gradient, against, peer::raw_grad(&shape)));
        self.our_gradients::<f32>(rows, against);
        self.our_gradients::<f64>(rows, [is_pawn.then_some(HAND_F64), Some(RAW)]);
        group.measure(&self.points());
        let solid = ours::solid_lazily(&self.text, self.name, Form::Stable);
        group.check(&solid, &self.points(), self.checked, &self.corners);
        group
    }

    fn hand_gradients<T: Precision>(&self, rows: &mut Vec<Row>) {
        let against = [Some(hand_of::<T>()), Some(RAW)];
        for (width, bits) in
            [(Width::Bits128, "128-bit"), (Width::Bits256, "256-bit"), (Width::Plain, "plain loop")]
        {
            if width.is_here() {
                let work = ours::by_hand::<T, _>(width, hand::TextbookGradient);
                let name = format!("hand textbook {bits} {}", T::NAME);
                rows.push(Row::new(name, Asks::Gradient, against, work));
            }
        }
    }

    fn our_gradients<T: Precision>(&self, rows: &mut Vec<Row>, against: [Option<&'static str>; 2]) {
        for (form, name) in [(Form::Stable, "stable"), (Form::Textbook, "textbook")] {
            let work = ours::gradient::<T>(&ours::solid_lazily(&self.text, self.name, form));
            rows.push(Row::new(format!("ours {name} {}", T::NAME), Asks::Gradient, against, work));
        }
    }
}

/// Values of the pawn at one point after the other.
pub fn points_of_the_pawn(pawn: &Obstacle) -> Group {
    let mut group = Group::new("pawn: one point at a time");
    let [stable, textbook] = [Form::Stable, Form::Textbook].map(|form| ours::solid(&pawn.text, "pawn", form));
    let shape = JitShape::from((pawn.tree)(Joins::R0));
    let value = [Some("hand ω f64"), Some("Fidget ω f32")];
    let gradient = [Some("hand ω and ∇ω f64"), Some("Fidget ω and ∇ω f32")];
    let single = stable.clone();
    group.rows = vec![
        Row::new("hand ω f64", Asks::Value, value, ours::each(hand::pawn_at)),
        Row::new("Fidget ω f32", Asks::Value, value, peer::point(&shape)),
        Row::new("ours ω stable f64", Asks::Value, value, ours::point(&stable)),
        Row::new("ours ω textbook f64", Asks::Value, value, ours::point(&textbook)),
        Row::new(
            "ours ω stable f32",
            Asks::Value,
            value,
            ours::each(move |x, y, z| f64::from(single.omega_f32(DVec3::new(x, y, z).as_vec3()))),
        ),
        Row::new("hand ω and ∇ω f64", Asks::Gradient, gradient, ours::each_grad(hand::pawn_grad_at)),
        Row::new("Fidget ω and ∇ω f32", Asks::Gradient, gradient, peer::point_grad(&shape)),
        Row::new("ours ω and ∇ω stable f64", Asks::Gradient, gradient, ours::point_grad(&stable)),
        Row::new("ours ω and ∇ω textbook f64", Asks::Gradient, gradient, ours::point_grad(&textbook)),
    ];
    group.measure(&pawn.points());
    group.check(&stable, &pawn.points(), pawn.checked, &pawn.corners);
    group
}

/// One bare node with operands of all magnitudes: its value and its two weights.
pub fn one_node() -> Group {
    let mut group = Group::new("one node, x and y, operands of all magnitudes: ω and its weights");
    let [stable, textbook] =
        [Form::Stable, Form::Textbook].map(|form| ours::solid(scenes::AND, "both", form));
    let raw = [None, Some(RAW)];
    group.rows = vec![
        Row::new(RAW, Asks::Gradient, raw, peer::raw_grad(&JitShape::from(peer::both(Joins::R0)))),
        Row::new("ours stable f32", Asks::Gradient, raw, ours::gradient::<f32>(&stable)),
        Row::new("ours textbook f32", Asks::Gradient, raw, ours::gradient::<f32>(&textbook)),
        Row::new("ours stable f64", Asks::Gradient, raw, ours::gradient::<f64>(&stable)),
        Row::new("ours textbook f64", Asks::Gradient, raw, ours::gradient::<f64>(&textbook)),
    ];
    let points = Points::operands(crate::measure::BATCH);
    group.measure(&points);
    group.check(&stable, &points, 1000, &[[0.0; 3], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]);
    group
}

/// Largest errors of one node in ulp: the name of the row, the error of the value, the error of a weight.
pub fn ulps(group: &mut Group) -> Vec<(String, f64, f64)> {
    let solid = ours::solid(scenes::AND, "both", Form::Stable);
    let points = Points::operands(2000);
    let names: Vec<String> = group.rows.iter().map(|row| row.name.clone()).collect();
    let mut list = Vec::new();
    for name in names {
        let epsilon = if name.ends_with("f32") { f64::from(f32::EPSILON) } else { f64::EPSILON };
        let mut of = |range| group.worst_component(&name, &solid, &points, range, epsilon);
        if let (Some(value), Some(weight)) = (of(0..1), of(1..3)) {
            list.push((name, value, weight));
        }
    }
    list
}

type Range = Box<dyn FnMut([[f64; 2]; 3]) -> [f64; 2]>;

/// Ranges of the pawn: times at random boxes, and how many of all cells are decided.
pub fn ranges(pawn: &Obstacle) -> (Group, Vec<(String, f64)>) {
    let side = SIDE / CELLS as f64;
    let mut random = Random(11);
    let mut corner = || [0, 1, 2].map(|_| (SIDE - side) * random.next());
    let boxes: Vec<_> = (0..1024).map(|_| corner().map(|low| [low, low + side])).collect();
    let solid = ours::solid(&pawn.text, "pawn", Form::Stable);
    let shape = |joins| JitShape::from((pawn.tree)(joins));
    let who: [(&str, &dyn Fn() -> Range); 4] = [
        ("Fidget interval f32", &|| Box::new(peer::range(&shape(Joins::R0)))),
        ("Fidget interval min/max f32", &|| Box::new(peer::range(&shape(Joins::MinMax)))),
        ("ours range f64", &|| Box::new(ours::range(&solid, false))),
        ("ours range of the twin f64", &|| Box::new(ours::range(&solid, true))),
    ];
    let mut group = Group::new("pawn: range of a random box of a 32³ grid's size");
    let mut decided = Vec::new();
    for (name, range) in who {
        let mut all = range();
        let cells = (0..CELLS.pow(3)).filter(|i| {
            let cell = [i % CELLS, i / CELLS % CELLS, i / CELLS / CELLS];
            let [low, high] = all(cell.map(|c| [c as f64 * side, (c + 1) as f64 * side]));
            low > 0.0 || high < 0.0
        });
        decided.push((name.to_string(), cells.count() as f64 / CELLS.pow(3) as f64));
        let (mut timed, boxes) = (range(), boxes.clone());
        let work = Box::new(move |_: &Points, _: Option<&mut Vec<[f64; 4]>>| {
            for sides in &boxes {
                std::hint::black_box(timed(*sides));
            }
        });
        let mut row = Row::new(name, Asks::Other, [None, Some("Fidget interval f32")], work);
        row.per_call = 1024;
        group.rows.push(row);
    }
    group.measure(&pawn.points());
    (group, decided)
}
