//! The range programs of one function: machine code where it can answer, the interpreter elsewhere.

use std::sync::OnceLock;

use super::compiled::RangeProgram;
use crate::codegen;
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::{self, Graph, Hoisted, Node, Outside, RangeEvaluator, Region};
use crate::solid::engine::Engine;

pub struct Ranges {
    /// The function without what depends on time alone; `None` for a function of space only.
    moving: Option<Hoisted>,
    evaluator: RangeEvaluator,
    code: OnceLock<Option<RangeProgram>>,
}

/// Ranges of what depends on time alone, during a stretch of time.
pub struct UniformRanges {
    intervals: Vec<Interval>,
    /// The intervals as machine code reads them.
    pairs: Vec<[f64; 2]>,
    /// Whether machine code may answer.
    tame: bool,
}

impl Ranges {
    pub fn new(graph: &Graph, root: Node) -> Self {
        let moving = graph.uses_time(root).then(|| ir::hoisted(graph, &[root], Outside::Time));
        let evaluator = match &moving {
            Some(Hoisted { graph, outputs, .. }) => RangeEvaluator::new(graph, outputs[0]),
            None => RangeEvaluator::new(graph, root),
        };
        Self { moving, evaluator, code: OnceLock::new() }
    }

    /// Whether time occurs in the function.
    pub fn moves(&self) -> bool {
        self.moving.is_some()
    }

    /// The range of the function over a box. A function of time asks `during` for the ranges of what depends
    /// on time alone, and hands it the way to find them.
    #[inline]
    pub fn over<'a>(
        &'a self,
        (graph, root): (&Graph, Node),
        engine: Engine,
        over: &Aabb,
        during: impl FnOnce(&dyn Fn(Interval) -> UniformRanges) -> &'a UniformRanges,
    ) -> Interval {
        if let Some(moving) = &self.moving {
            return self.while_moving(moving, engine, over, during(&|time| self.uniforms(moving, time)));
        }
        if engine != Engine::Interpreter {
            let code = self.code.get_or_init(|| RangeProgram::compile(graph, root).ok());
            if let Some(range) = code.as_ref().and_then(|code| code.call(over, &[], &[])) {
                return range;
            }
        }
        self.evaluator.eval(over)
    }

    fn while_moving(
        &self,
        moving: &Hoisted,
        engine: Engine,
        over: &Aabb,
        uniforms: &UniformRanges,
    ) -> Interval {
        if engine != Engine::Interpreter && uniforms.tame {
            let compile = || RangeProgram::with_uniforms(&moving.graph, moving.outputs[0]).ok();
            let code = self.code.get_or_init(compile);
            if let Some(range) = code.as_ref().and_then(|code| code.call(over, &[], &uniforms.pairs)) {
                return range;
            }
        }
        self.evaluator.eval_with(&Region { uniforms: &uniforms.intervals, ..Region::of(over) })
    }

    fn uniforms(&self, moving: &Hoisted, time: Interval) -> UniformRanges {
        let intervals = moving.uniforms.over(time, &[]);
        let numbers = Region { uniforms: &intervals, ..Region::of(&Aabb::EMPTY) };
        let tame = codegen::range_stays_finite(&moving.graph, &self.evaluator, numbers);
        let pairs = intervals.iter().map(|i| [i.lo, i.hi]).collect();
        UniformRanges { intervals, pairs, tame }
    }
}
