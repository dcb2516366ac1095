//! Tables as operations: the value of a field that is looked up at a place, or one component of its gradient there.

use std::sync::Arc;

use glam::DVec3;

use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::real::Real;
use crate::table::Table;

/// The tables of a graph, by their numbers.
pub type Tables = Arc<[Arc<dyn Table>]>;

/// What is looked up, and in which table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Lookup {
    /// Number of the table in its graph.
    pub table: u32,
    /// The wanted part of its values.
    pub part: Part,
}

/// What a table has at a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Part {
    /// The field.
    Value,
    /// Its derivative along the axis with this number. It counts as constant between jumps: its own derivative is taken
    /// to be 0, as that of a plane's distance is.
    Slope(u8),
}

impl Lookup {
    /// All parts, in the order of a gradient.
    pub const PARTS: [Part; 4] = [Part::Value, Part::Slope(0), Part::Slope(1), Part::Slope(2)];

    /// The name of the operation in dumps, without its table.
    pub fn name(self) -> &'static str {
        match self.part {
            Part::Value => "table",
            Part::Slope(0) => "table_dx",
            Part::Slope(1) => "table_dy",
            Part::Slope(_) => "table_dz",
        }
    }

    /// Another part of the same table.
    pub fn with(self, part: Part) -> Self {
        Self { part, ..self }
    }

    /// Its value at a point. The table is looked up in double precision whatever the numbers are.
    pub fn eval<T: Real>(self, tables: &Tables, at: [T; 3]) -> T {
        T::from_f64(self.part.of(&*tables[self.table as usize], at.map(T::to_f64)))
    }

    /// Where it is taken of a table over a box, which is all of space if a coordinate may be no number.
    pub fn range(self, tables: &Tables, over: [Interval; 3]) -> Interval {
        match self.part {
            Part::Value => tables[self.table as usize].range(&space(over)),
            Part::Slope(axis) => self.slopes(tables, over)[usize::from(axis)],
        }
    }

    /// What the gradient of the table may be over a box.
    pub fn slopes(self, tables: &Tables, over: [Interval; 3]) -> [Interval; 3] {
        tables[self.table as usize].slopes(&space(over))
    }

    /// A box around the places whose value is at least `least`; all of space for a slope.
    pub fn reach(self, tables: &Tables, least: f64) -> Aabb {
        match self.part {
            Part::Value => tables[self.table as usize].reach(least),
            Part::Slope(_) => Aabb::new(DVec3::NEG_INFINITY, DVec3::INFINITY),
        }
    }
}

fn space(over: [Interval; 3]) -> Aabb {
    let ends = |end: fn(Interval) -> f64| DVec3::from_array(over.map(end));
    Aabb::new(ends(|axis| axis.lo), ends(|axis| axis.hi))
}

impl Part {
    /// It in a table at a point.
    pub fn of(self, table: &dyn Table, at: [f64; 3]) -> f64 {
        let sample = table.at(DVec3::from_array(at));
        match self {
            Self::Value => sample.value,
            Self::Slope(axis) => sample.gradient[usize::from(axis)],
        }
    }
}
