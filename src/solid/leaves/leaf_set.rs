//! The leaves of a solid: many, of few shapes.
//!
//! Leaves that differ in their constants alone share their programs: ten thousand balls are compiled as one.

use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use glam::DVec3;

use smallvec::SmallVec;

use super::known_ranges::KnownRanges;
use super::pruning::{Verdict, prune};
use super::shape::{Demand, Motion, Shape, SlopeProgram};
use super::tree::LeafNode;
use super::words::{self, Word};
use crate::field::{Path, Sheet};
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::{Contractor, Enclosure, Expr, Graph, Region, SURFACE_ROUNDING, Trust, Wanted};
use crate::solid::contact::Contact;
use crate::solid::engine::Engine;

struct Leaf {
    shape: u32,
    /// Where its constants begin.
    first: u32,
    /// Where the numbers begin that depend on time alone.
    first_uniform: u32,
    /// Whether machine code may answer for its range. For leaves that move, see [`Ranges`].
    tame: bool,
    /// What its value is multiplied by in the twin.
    factor: f64,
}

/// The leaves of a solid at all times.
pub struct LeafStore {
    engine: Engine,
    shapes: Vec<Shape>,
    leaves: Vec<Leaf>,
    constants: Vec<f64>,
    uniforms: usize,
    /// For each leaf, whether machine code may answer for its slopes.
    tame_slopes: OnceLock<Vec<bool>>,
    /// For each leaf, whether it may for its pieces.
    tame_pieces: OnceLock<Vec<bool>>,
}

/// The leaves during a stretch of time: values are those at its end, ranges hold all of it.
pub struct Leaves {
    store: Arc<LeafStore>,
    from: f64,
    to: f64,
    /// What depends on time alone, at the end.
    uniforms: Vec<f64>,
    ranges: OnceLock<Ranges>,
}

/// A solid taken apart, during a stretch of time: its leaves, and how they are joined.
pub struct LeafTree {
    pub leaves: Leaves,
    /// In prefix form, see `words`.
    pub words: Arc<[u32]>,
}

/// What depends on time alone, during the stretch.
struct Ranges {
    uniforms: Vec<Interval>,
    /// The ranges as machine code reads them.
    pairs: Vec<[f64; 2]>,
    /// For each leaf, whether machine code may answer for its range.
    tame: Vec<bool>,
}

/// Numbers of one leaf that depend on time alone.
type Uniform = SmallVec<[f64; 16]>;

impl LeafStore {
    pub fn new(engine: Engine, graph: &Graph, nodes: &[LeafNode]) -> Self {
        let mut known: HashMap<Vec<Expr>, u32> = HashMap::new();
        let (shapes, leaves, constants) = (Vec::new(), Vec::new(), Vec::new());
        let (tame_slopes, tame_pieces) = (OnceLock::new(), OnceLock::new());
        let mut out = Self { engine, shapes, leaves, constants, uniforms: 0, tame_slopes, tame_pieces };
        for &LeafNode { node, factor } in nodes {
            let factor = if factor.is_normal() { factor } else { 1.0 };
            let (shape, root, constants) = graph.parametrised(node);
            let next = out.shapes.len() as u32;
            let number = *known.entry(shape.exprs().to_vec()).or_insert(next);
            if number == next {
                out.shapes.push(Shape::new(shape, root, constants.len()));
            }
            let shape = &mut out.shapes[number as usize];
            shape.leaves += 1;
            let still = shape.motion.is_none();
            let tame = still && shape.range_stays_finite(&constants, &[]);
            let (first, first_uniform) = (out.constants.len() as u32, out.uniforms as u32);
            out.leaves.push(Leaf { shape: number, first, first_uniform, tame, factor });
            out.constants.extend(constants);
            out.uniforms += shape.uniforms();
        }
        out
    }

    #[inline]
    fn of(&self, leaf: u32) -> (&Shape, &[f64]) {
        let leaf = &self.leaves[leaf as usize];
        let shape = &self.shapes[leaf.shape as usize];
        let first = leaf.first as usize;
        (shape, &self.constants[first..first + shape.parameters])
    }

    /// What answers for a leaf's slopes by machine code, if it may.
    fn slope_program(&self, leaf: u32) -> Option<&SlopeProgram> {
        let program = |leaf: u32| self.of(leaf).0.slopes(self.engine);
        let is_tame = |leaf: u32| program(leaf).is_some_and(|program| program.is_tame(self.of(leaf).1));
        let all = || (0..self.leaves.len() as u32).map(is_tame).collect();
        if self.tame_slopes.get_or_init(all)[leaf as usize] { program(leaf) } else { None }
    }

    /// Whether machine code may answer for a leaf's pieces.
    fn has_tame_pieces(&self, leaf: u32) -> bool {
        let is_tame = |leaf: u32| {
            let (shape, constants) = self.of(leaf);
            shape.pieces().is_some_and(|pieces| pieces.is_tame(constants))
        };
        let all = || (0..self.leaves.len() as u32).map(is_tame).collect();
        self.tame_pieces.get_or_init(all)[leaf as usize]
    }

    /// The leaves that move, with their shapes and constants.
    fn moving(&self) -> impl Iterator<Item = (usize, &Shape, &Motion, &[f64])> {
        (0..self.leaves.len()).filter_map(|i| {
            let (shape, constants) = self.of(i as u32);
            Some((i, shape, shape.motion.as_ref()?, constants))
        })
    }

    /// The leaves during a stretch of time.
    pub fn during(self: &Arc<Self>, from: f64, to: f64) -> Leaves {
        let mut uniforms = vec![0.0; self.uniforms];
        if self.uniforms > 0 {
            for (i, shape, motion, constants) in self.moving() {
                let first = self.leaves[i].first_uniform as usize;
                motion.uniforms.fill(to, constants, &mut uniforms[first..first + shape.uniforms()]);
            }
        }
        Leaves { store: self.clone(), from, to, uniforms, ranges: OnceLock::new() }
    }
}

impl Leaves {
    /// Whether a leaf depends on time.
    pub fn moves(&self, leaf: u32) -> bool {
        self.store.of(leaf).0.motion.is_some()
    }

    #[inline]
    fn of(&self, leaf: u32) -> (&Shape, &[f64], &[f64]) {
        let (shape, constants) = self.store.of(leaf);
        let first = self.store.leaves[leaf as usize].first_uniform as usize;
        (shape, constants, &self.uniforms[first..first + shape.uniforms()])
    }

    fn ranges(&self) -> &Ranges {
        self.ranges.get_or_init(|| {
            let time = Interval::new(self.from.min(self.to), self.from.max(self.to));
            let mut uniforms = Vec::with_capacity(self.store.uniforms);
            let mut tame: Vec<bool> = self.store.leaves.iter().map(|leaf| leaf.tame).collect();
            for (i, shape, motion, constants) in self.store.moving() {
                let own = motion.uniforms.over(time, constants);
                tame[i] = shape.range_stays_finite(constants, &own);
                uniforms.extend(own);
            }
            let pairs = uniforms.iter().map(|u| [u.lo, u.hi]).collect();
            Ranges { uniforms, pairs, tame }
        })
    }

    pub fn len(&self) -> usize {
        self.store.leaves.len()
    }

    pub fn shapes(&self) -> usize {
        self.store.shapes.len()
    }

    /// What the twin multiplies a leaf's value by, a positive number.
    pub fn factor(&self, leaf: u32) -> f64 {
        self.store.leaves[leaf as usize].factor
    }

    /// The number of a leaf's shape.
    pub fn shape_of(&self, leaf: u32) -> usize {
        self.store.leaves[leaf as usize].shape as usize
    }

    /// Operations of a leaf's formula, constants and coordinates not counted.
    pub fn operations(&self, leaf: u32) -> usize {
        let (shape, ..) = self.of(leaf);
        let graph = shape.motion.as_ref().map_or(&shape.graph, |motion| &motion.graph);
        graph.nodes().filter(|(_, expr)| expr.operands().next().is_some()).count()
    }

    /// An interval that contains the leaf's value at every point of a box, at all times of the stretch.
    pub fn range(&self, leaf: u32, over: &Aabb) -> Interval {
        self.range_on(Demand::Few, leaf, over)
    }

    /// [`Self::range`] for callers that need very many ranges, by machine code where it pays. Its bounds may
    /// differ by roundings.
    pub fn range_among_many(&self, leaf: u32, over: &Aabb) -> Interval {
        self.range_on(Demand::Many, leaf, over)
    }

    fn range_on(&self, demand: Demand, leaf: u32, over: &Aabb) -> Interval {
        let own @ (shape, constants, uniforms) = self.of(leaf);
        let whole = self.range_of_whole(demand, (leaf, own), over);
        if whole == Interval::ALL || !whole.contains(0.0) || !uniforms.is_empty() {
            return whole;
        }
        let Some(pieces) = shape.pieces() else { return whole };
        let by_code = self.store.engine != Engine::Interpreter
            && shape.pays(demand)
            && self.store.has_tame_pieces(leaf);
        let Some(range) = pieces.range(over, constants, by_code) else { return whole };
        // roundings may part them
        let (lo, hi) = (whole.lo.max(range.lo), whole.hi.min(range.hi));
        if lo <= hi { Interval::new(lo, hi) } else { whole }
    }

    /// The range of a leaf's formula as it stands.
    fn range_of_whole(
        &self,
        demand: Demand,
        (leaf, (shape, constants, uniforms)): (u32, (&Shape, &[f64], &[f64])),
        over: &Aabb,
    ) -> Interval {
        if uniforms.is_empty() {
            let by_code = self.store.engine != Engine::Interpreter && self.store.leaves[leaf as usize].tame;
            if by_code
                && let Some(range) = shape.range_code(demand).and_then(|code| code.call(over, constants, &[]))
            {
                return range;
            }
            return shape.range.eval_with(&Region { parameters: constants, ..Region::of(over) });
        }
        let ranges = self.ranges();
        let first = self.store.leaves[leaf as usize].first_uniform as usize;
        let own = first..first + uniforms.len();
        let by_code = self.store.engine != Engine::Interpreter && ranges.tame[leaf as usize];
        if by_code
            && let Some(code) = shape.range_code(demand)
            && let Some(range) = code.call(over, constants, &ranges.pairs[own.clone()])
        {
            return range;
        }
        let uniforms = &ranges.uniforms[own];
        shape.range.eval_with(&Region { parameters: constants, uniforms, ..Region::of(over) })
    }

    /// An interval that contains the value of a tree in prefix form at every point of a box, at all times of
    /// the stretch; all numbers if a leaf may be NaN. `at` is moved past the tree; `known` are ranges over the same box.
    pub fn range_of_tree(
        &self,
        words: &[u32],
        at: &mut usize,
        over: &Aabb,
        known: &mut KnownRanges,
    ) -> Interval {
        let word = Word::read(words[*at]);
        *at += 1;
        let (parts, all) = match word {
            Word::Leaf { leaf, negated } => {
                let range = known.of(leaf, || self.range_among_many(leaf, over));
                return if negated { -range } else { range };
            }
            Word::All(parts) => (parts, true),
            Word::Any(parts) => (parts, false),
        };
        let mut range = self.range_of_tree(words, at, over, known);
        for _ in 1..parts {
            let next = self.range_of_tree(words, at, over, known);
            range = match (range == Interval::ALL || next == Interval::ALL, all) {
                (true, _) => Interval::ALL,
                (false, true) => range.min(next),
                (false, false) => range.max(next),
            };
        }
        range
    }

    /// Enclosures of the leaf's derivatives over a box, at all times of the stretch.
    pub fn slopes(&self, leaf: u32, over: &Aabb) -> [Interval; 3] {
        let (shape, parameters, own) = self.of(leaf);
        if let Some(program) = self.store.slope_program(leaf)
            && let Some(slopes) = program.over(over, parameters)
        {
            return slopes;
        }
        let mut region = Region { parameters, ..Region::of(over) };
        if !own.is_empty() {
            let first = self.store.leaves[leaf as usize].first_uniform as usize;
            region.uniforms = &self.ranges().uniforms[first..first + own.len()];
        }
        shape.contractor().slopes(&region).unwrap_or([Interval::ALL; 3])
    }

    /// Visits the faces of a tree in prefix form that may be part of its surface in a box, those of leaves
    /// that `known` does not hold yet.
    pub fn sheets(&self, tree: &[u32], over: &Aabb, known: &mut Vec<u32>, visit: &mut dyn FnMut(Sheet<'_>)) {
        let (mut near, mut left) = (Vec::new(), Vec::new());
        let mut slopes: Vec<(u32, [Interval; 3])> = Vec::new();
        let mut range = |leaf| {
            let (range, slopes_of) = self.range_by_slopes(leaf, over);
            slopes.push((leaf, slopes_of));
            range
        };
        if prune(tree, &mut |leaf| self.range_among_many(leaf, over), &mut near) != Verdict::Near
            || prune(&near, &mut range, &mut left) != Verdict::Near
        {
            return;
        }
        for word in left {
            let Word::Leaf { leaf, negated } = Word::read(word) else { continue };
            if known.contains(&word) {
                continue;
            }
            known.push(word);
            let Some((_, slopes)) = slopes.iter().find(|(other, _)| *other == leaf) else { continue };
            let slopes = slopes.map(|slope| if negated { -slope } else { slope });
            let at = |p: DVec3| {
                let (value, gradient) = self.gradient(leaf, p);
                if negated { (-value, -gradient) } else { (value, gradient) }
            };
            visit(Sheet { slopes, at: &at });
        }
    }

    /// The range of a leaf by the mean value theorem, and its slopes. Its error falls with the square of the
    /// box, where that of [`range`](Self::range) falls with the box.
    fn range_by_slopes(&self, leaf: u32, over: &Aabb) -> (Interval, [Interval; 3]) {
        let slopes = self.slopes(leaf, over);
        let centre = over.centre();
        let mut range = self.range_among_many(leaf, &Aabb::new(centre, centre));
        for (axis, slope) in slopes.into_iter().enumerate() {
            // programs round a formula, and so move its surface a little
            let slack = SURFACE_ROUNDING * over.min[axis].abs().max(over.max[axis].abs());
            let half = (over.max[axis] - centre[axis]).max(centre[axis] - over.min[axis]) + slack;
            range = range + slope * Interval::new(-half, half);
        }
        (range, slopes)
    }

    /// What makes boxes smaller around the points where a leaf is positive, or negative where it is negated, at
    /// some time of the stretch.
    pub fn contractor(&self, leaf: u32, negated: bool) -> (&Contractor, Wanted<'_>) {
        let (shape, parameters, own) = self.of(leaf);
        let mut region = Region { parameters, ..Region::of(&Aabb::EMPTY) };
        if !own.is_empty() {
            let first = self.store.leaves[leaf as usize].first_uniform as usize;
            region.uniforms = &self.ranges().uniforms[first..first + own.len()];
        }
        (shape.contractor(), Wanted { region, negated })
    }

    #[inline]
    pub fn value(&self, leaf: u32, p: DVec3) -> f64 {
        let (shape, constants, uniforms) = self.of(leaf);
        let mut out = [0.0];
        shape.value(self.store.engine).point(p, constants, uniforms, &mut out);
        out[0]
    }

    /// Value and gradient.
    pub fn gradient(&self, leaf: u32, p: DVec3) -> (f64, DVec3) {
        self.gradient_along(leaf, p, 1.0)
    }

    /// Value and gradient after a part of the stretch of time.
    pub fn gradient_along(&self, leaf: u32, p: DVec3, part: f64) -> (f64, DVec3) {
        let (shape, constants, at_end) = self.of(leaf);
        let mut uniforms = Uniform::from_slice(at_end);
        if let Some(motion) = &shape.motion
            && part < 1.0
        {
            motion.uniforms.fill(self.from + part * (self.to - self.from), constants, &mut uniforms);
        }
        let mut out = [0.0; 4];
        shape.gradient(self.store.engine).point(p, constants, &uniforms, &mut out);
        (out[0], DVec3::new(out[1], out[2], out[3]))
    }

    /// The value of the leaf that decides in a tree in prefix form, that leaf, and whether it is negated. The
    /// smallest decides in "all of", the largest in "any of"; the value is NaN if any leaf is.
    pub fn decide(&self, words: &[u32], at: &mut usize, p: DVec3) -> (f64, (u32, bool)) {
        let word = Word::read(words[*at]);
        *at += 1;
        let (parts, all) = match word {
            Word::Leaf { leaf, negated } => {
                let value = self.value(leaf, p);
                return (if negated { -value } else { value }, (leaf, negated));
            }
            Word::All(parts) => (parts, true),
            Word::Any(parts) => (parts, false),
        };
        let mut best = self.decide(words, at, p);
        for _ in 1..parts {
            let next = self.decide(words, at, p);
            let wins = if all { next.0 < best.0 } else { next.0 > best.0 };
            if wins || next.0.is_nan() {
                best = next;
            }
        }
        best
    }

    /// Whether a tree in prefix form is surely negative all over a box, at all times of the stretch.
    pub fn is_negative(&self, tree: &[u32], over: &Aabb) -> bool {
        let negative = words::is_negative(tree, &mut 0, &mut |leaf, negated| {
            let range = self.range(leaf, over);
            (range != Interval::ALL).then_some(if negated { range.lo > 0.0 } else { range.hi < 0.0 })
        });
        negative == Some(true)
    }

    /// Distance, outward normal and mean curvature, see `ir::contact`.
    #[inline]
    pub(super) fn estimated_contact(&self, leaf: u32, p: DVec3) -> Contact {
        let (shape, constants, uniforms) = self.of(leaf);
        let mut out = [0.0; 5];
        shape.contact(self.store.engine).point(p, constants, uniforms, &mut out);
        let [distance, x, y, z, mean_curvature] = out;
        Contact { distance, normal: DVec3::new(x, y, z), mean_curvature }
    }

    #[inline]
    pub(super) fn trust(&self, leaf: u32) -> &Trust {
        self.of(leaf).0.trust()
    }

    /// Velocity of the leaf's surface along its normal, see `ir::wall_velocity`.
    pub fn velocity(&self, leaf: u32, p: DVec3) -> DVec3 {
        let (shape, constants, uniforms) = self.of(leaf);
        let Some(motion) = &shape.motion else { return DVec3::ZERO };
        let mut out = [0.0; 3];
        motion.velocity(shape, self.store.engine).point(p, constants, uniforms, &mut out);
        DVec3::from_array(out)
    }

    pub fn values(&self, leaf: u32, points: [&[f64]; 3], out: &mut [f64]) {
        let (shape, constants, uniforms) = self.of(leaf);
        shape.value(self.store.engine).many(points, constants, uniforms, [out]);
    }

    /// Value and gradient at many points.
    pub fn gradients(&self, leaf: u32, points: [&[f64]; 3], out: [&mut [f64]; 4]) {
        let (shape, constants, uniforms) = self.of(leaf);
        shape.gradient(self.store.engine).many(points, constants, uniforms, out);
    }

    /// What a leaf is along a whole path that is passed during the stretch of time; `None` unless it is a
    /// polynomial of degree two at most.
    pub fn on_path(&self, leaf: u32, negated: bool, from: DVec3, to: DVec3) -> Option<Enclosure> {
        let (shape, constants, _) = self.of(leaf);
        let program = shape.polynomial(self.store.engine)?;
        let mut parameters: SmallVec<[f64; 16]> = SmallVec::from_slice(constants);
        parameters.extend_from_slice(&(to - from).to_array());
        parameters.extend_from_slice(&[self.to - self.from, self.from]);
        let mut out = [0.0; 6];
        program.point(from, &parameters, &[], &mut out);
        let [a, b, c, d, e, f] = out;
        let coefficients = [(a, d), (b, e), (c, f)].map(|(value, error)| {
            let value = if negated { -value } else { value };
            // an error of zero says that the value is exact
            if error == 0.0 {
                Interval::new(value, value)
            } else {
                Interval::new((value - error).next_down(), (value + error).next_up())
            }
        });
        Some(Enclosure { coefficients, range: Interval::ALL })
    }

    /// An enclosure of a leaf over a part of a path.
    pub fn enclose(&self, leaf: u32, negated: bool, path: &Path, stretch: (f64, f64)) -> Enclosure {
        let (shape, constants, _) = self.of(leaf);
        let (from, to) = (path.from.extend(self.from).to_array(), path.to.extend(self.to).to_array());
        let found = shape.enclosures().enclose(from, to, stretch, constants);
        if negated {
            Enclosure { coefficients: found.coefficients.map(|c| -c), range: -found.range }
        } else {
            found
        }
    }
}
