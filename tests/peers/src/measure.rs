//! Times and errors. All rows of a group take turns, so that a busy machine slows each of them alike.

use std::time::{Duration, Instant};

use rfm::Solid;
use rfm::ir::exact::{self, Exact};
use rfm::solid::ProgramKind;

use crate::scenes::Random;

/// Points of one call.
pub const BATCH: usize = 4096;
/// Time for which a row repeats its call in each turn.
const SLICE: Duration = Duration::from_micros(400);
/// Time that all turns of a group may take together.
const GROUP: Duration = Duration::from_millis(2500);

/// A set of points in both precisions.
pub struct Points {
    /// Identity of this set, by which values derived from it can be kept.
    pub id: usize,
    pub double: [Vec<f64>; 3],
    pub single: [Vec<f32>; 3],
}

impl Points {
    /// Rounds points to `f32`, so that both precisions are asked one question.
    pub fn new(list: &[[f64; 3]]) -> Self {
        static NEXT: std::sync::atomic::AtomicUsize = std::sync::atomic::AtomicUsize::new(0);
        let single = [0, 1, 2].map(|axis| list.iter().map(|p| p[axis] as f32).collect::<Vec<_>>());
        let double = single.each_ref().map(|c| c.iter().map(|&x| f64::from(x)).collect());
        Self { id: NEXT.fetch_add(1, std::sync::atomic::Ordering::Relaxed), double, single }
    }

    /// Random points all over a box that begins at the origin.
    pub fn random(n: usize, side: f64, seed: u64) -> Self {
        let mut random = Random(seed);
        let list: Vec<_> = (0..n).map(|_| [0, 1, 2].map(|_| side * random.next())).collect();
        Self::new(&list)
    }

    /// Pairs of operands of all magnitudes between 2⁻²⁰ and 2²⁰ and of both signs. Their weights are within
    /// the range of `f32`.
    pub fn operands(n: usize) -> Self {
        let mut random = Random(7);
        let mut number = || {
            let size = (1.0 + random.next()) * (40.0 * random.next() - 20.0).floor().exp2();
            if random.next() < 0.5 { -size } else { size }
        };
        let list: Vec<_> = (0..n).map(|_| [number(), number(), 0.0]).collect();
        Self::new(&list)
    }

    pub fn len(&self) -> usize {
        self.double[0].len()
    }

    fn at(&self, i: usize) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.double[axis][i])
    }

    fn first(&self, n: usize) -> Self {
        let list: Vec<_> = (0..n.min(self.len())).map(|i| self.at(i)).collect();
        Self::new(&list)
    }
}

/// Answers a question at all points, and keeps the answers on request: ω, or ω and ∇ω.
pub type Work = Box<dyn FnMut(&Points, Option<&mut Vec<[f64; 4]>>)>;

/// Kind of question, which decides which errors make sense.
#[derive(Clone, Copy, PartialEq)]
pub enum Asks {
    Value,
    Gradient,
    /// Only the sign of the answer is meant.
    Sign,
    /// Only the sign is compared, and it is positive outside.
    Distance,
    /// The question is not about points.
    Other,
}

/// One way to answer.
pub struct Row {
    pub name: String,
    pub asks: Asks,
    /// Rows whose time this one is divided by: the hand-written one and Fidget's.
    pub against: [Option<&'static str>; 2],
    pub work: Work,
    /// Answers of one call.
    pub per_call: usize,
    /// Nanoseconds per answer, one number for each turn.
    pub times: Vec<f64>,
    pub errors: Errors,
}

/// Deviations of the answers from the truth.
#[derive(Clone, Default)]
pub struct Errors {
    /// Largest value of |found − true| / |true|. For a gradient, |·| is the length.
    pub relative: Option<f64>,
    /// Number of answers that are not a number, among all random points.
    pub nan: usize,
    /// Number of answers that are not a number, among all corners and edges, and the number of those points.
    pub nan_at_corners: Option<(usize, usize)>,
    /// Number of answers with the wrong sign, and the number of random points whose truth was computed.
    pub wrong_signs: Option<(usize, usize)>,
}

impl Row {
    pub fn new(name: impl Into<String>, asks: Asks, against: [Option<&'static str>; 2], work: Work) -> Self {
        let errors = Errors::default();
        Self { name: name.into(), asks, against, work, per_call: BATCH, times: Vec::new(), errors }
    }

    pub fn median(&self) -> f64 {
        median(self.times.clone())
    }
}

/// Rows that answer one question.
pub struct Group {
    pub title: String,
    pub rows: Vec<Row>,
}

pub fn median(mut list: Vec<f64>) -> f64 {
    list.sort_by(f64::total_cmp);
    list[list.len() / 2]
}

impl Group {
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), rows: Vec::new() }
    }

    pub fn find(&self, name: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.name == name)
    }

    /// Median over all turns of the quotient of two rows' times in a turn.
    pub fn ratio(&self, of: &str, to: &str) -> Option<f64> {
        let (a, b) = (&self.find(of)?.times, &self.find(to)?.times);
        Some(median(a.iter().zip(b).map(|(a, b)| a / b).collect()))
    }

    /// Takes the times of all rows.
    pub fn measure(&mut self, points: &Points) {
        let mut calls = Vec::new();
        let mut turn = Duration::ZERO;
        for row in &mut self.rows {
            if row.asks != Asks::Other {
                row.per_call = points.len();
            }
            (row.work)(points, None);
            let start = Instant::now();
            (row.work)(points, None);
            let once = start.elapsed().max(Duration::from_nanos(50));
            calls.push((SLICE.as_nanos() / once.as_nanos() + 1) as u32);
            turn += once * calls[calls.len() - 1];
        }
        let turns = (GROUP.as_nanos() / turn.as_nanos().max(1)).clamp(3, 41);
        for _ in 0..turns {
            for (row, &calls) in self.rows.iter_mut().zip(&calls) {
                let start = Instant::now();
                for _ in 0..calls {
                    (row.work)(points, None);
                }
                let answers = f64::from(calls) * row.per_call as f64;
                row.times.push(start.elapsed().as_secs_f64() * 1e9 / answers);
            }
        }
    }

    /// Compares the answers with the truth, which `solid` gives in 120 digits, at the first `checked` points.
    pub fn check(&mut self, solid: &Solid, points: &Points, checked: usize, corners: &[[f64; 3]]) {
        let gradient = self.rows.iter().any(|row| row.asks == Asks::Gradient);
        let kind = if gradient { ProgramKind::Gradient } else { ProgramKind::Value };
        let (graph, outputs) = solid.graph(kind);
        let first = points.first(checked);
        let truth: Vec<_> = (0..first.len()).map(|i| exact::evaluate(graph, outputs, first.at(i))).collect();
        let corners = Points::new(corners);
        for row in self.rows.iter_mut().filter(|row| row.asks != Asks::Other) {
            let mut answers = |points: &Points| {
                let mut found = Vec::new();
                (row.work)(points, Some(&mut found));
                assert_eq!(found.len(), points.len(), "{}", row.name);
                found
            };
            let is_nan = |answer: &&[f64; 4]| answer.iter().any(|c| c.is_nan());
            let all = answers(points);
            row.errors.nan = all.iter().filter(is_nan).count();
            if corners.len() > 0 && row.asks == Asks::Gradient {
                let found = answers(&corners);
                row.errors.nan_at_corners = Some((found.iter().filter(is_nan).count(), corners.len()));
            }
            let known = all.iter().zip(&truth).filter_map(|(found, truth)| Some((found, truth.as_ref()?)));
            let sign = if row.asks == Asks::Distance { -1.0 } else { 1.0 };
            let wrong = known.clone().filter(|(found, truth)| {
                let found = sign * found[0];
                f64::from(i8::from(found > 0.0) - i8::from(found < 0.0)) != truth[0].sign()
            });
            row.errors.wrong_signs = Some((wrong.count(), known.clone().count()));
            row.errors.relative = match row.asks {
                Asks::Value => Some(worst(known.map(|(found, truth)| relative(&truth[..1], found)))),
                Asks::Gradient => {
                    Some(worst(known.map(|(found, truth)| relative(&truth[1..4], &found[1..]))))
                }
                _ => None,
            };
        }
    }

    /// Largest relative error of a single component, in units of twice the rounding unit of its precision; a
    /// unit in the last place is at most this large. It serves for single nodes, whose weights are judged one
    /// by one.
    pub fn worst_component(
        &mut self,
        name: &str,
        solid: &Solid,
        points: &Points,
        components: std::ops::Range<usize>,
        epsilon: f64,
    ) -> Option<f64> {
        let (graph, outputs) = solid.graph(ProgramKind::Gradient);
        let row = self.rows.iter_mut().find(|row| row.name == name)?;
        let mut found = Vec::new();
        (row.work)(points, Some(&mut found));
        let errors = found.iter().enumerate().filter_map(|(i, found)| {
            let truth = exact::evaluate(graph, outputs, points.at(i))?;
            Some(worst(components.clone().map(|c| relative(&truth[c..=c], &found[c..=c]))))
        });
        Some(worst(errors) / epsilon)
    }
}

/// Largest error; infinite if one is not a number.
fn worst(errors: impl Iterator<Item = f64>) -> f64 {
    errors.map(|e| if e.is_nan() { f64::INFINITY } else { e }).fold(0.0, f64::max)
}

fn relative(truth: &[Exact], found: &[f64]) -> f64 {
    let length = |squares: f64| squares.sqrt();
    let error = length(truth.iter().zip(found).map(|(t, &f)| t.error_of(f).powi(2)).sum());
    let size = length(truth.iter().map(|t| t.to_f64().powi(2)).sum());
    if error == 0.0 { 0.0 } else { error / size }
}
