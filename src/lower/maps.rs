//! Maps of space that need to know where a shape is: turns that differ from point to point, and copies.

use super::lowering::Lowering;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::geom::Aabb;
use crate::ir::{self, Axis, Binary, Node, Unary, UnaryFunction};
use crate::syntax::ast::Logic;

/// How far, as a part of a cell's size, a shape may stand out of its cell because of the rounding of its
/// bounds.
const ROUNDING: f64 = 1e-12;

impl Lowering<'_> {
    /// The shape turned about z by an angle that may differ from point to point. No point changes its distance from
    /// the axis, which bounds would not see: so the least of ω and the field of a ring of space around the shape is
    /// taken, which is positive on its surface and changes no sign.
    pub fn turned(&mut self, shape: Node, angle: Node, span: Span) -> Node {
        let [x, y, z] = Axis::SPACE.map(|axis| self.module.graph.coordinate(axis));
        let [sin, cos] =
            [UnaryFunction::Sin, UnaryFunction::Cos].map(|op| self.unary(op.into(), angle, span));
        let mut product = |a, b| self.binary(Binary::Mul, a, b, span);
        let (xc, ys, yc, xs) = (product(x, cos), product(y, sin), product(y, cos), product(x, sin));
        let u = self.binary(Binary::Add, xc, ys, span);
        let v = self.binary(Binary::Sub, yc, xs, span);
        let turned = self.module.graph.substitute(shape, [u, v, z]);
        let Some(bounds) = ir::close_reach(&self.module.graph, shape) else { return turned };
        let radius = bounds.min.abs().max(bounds.max.abs()).truncate().length();
        self.least_with_round(turned, [x, y], [0.0; 2], radius, span)
    }

    /// A field whose bounds do not follow from its formula, but are those of another one that is positive wherever
    /// it is: the least of it and the field of a ball around them.
    pub fn around(&mut self, field: Node, outer: Node, span: Span) -> Node {
        let Some(bounds) = ir::reach(&self.module.graph, outer) else { return field };
        let p = Axis::SPACE.map(|axis| self.module.graph.coordinate(axis));
        let radius = 0.5 * bounds.size().length();
        self.least_with_round(field, p, bounds.centre().to_array(), radius, span)
    }

    /// The second of two outlines, between which a loft leads from one height to another: they must not lie beside each
    /// other. Solids in their place are asked about.
    pub fn overlapping(&mut self, [a, b]: [Node; 2], heights: [Node; 2], span: Span) -> Node {
        let [x, y, z] = Axis::SPACE.map(|axis| self.module.graph.coordinate(axis));
        let [zero, one] = [0.0, 1.0].map(|number| self.constant(number));
        let rest = self.binary(Binary::Sub, one, z, span);
        let layer = self.binary(Binary::Mul, z, rest, span);
        let reach = [a, b].map(|outline| {
            let flat = self.module.graph.substitute(outline, [x, y, zero]);
            let part = self.binary(Binary::And, flat, layer, span);
            ir::reach(&self.module.graph, part)
        });
        if let [Some(first), Some(second)] = reach
            && first.intersection(&second).is_empty()
        {
            let message = "the outlines of a loft lie beside each other, and a loft holds only what lies between overlapping ones";
            let help = "move one over the other with `.move`; a tube from place to place is `sweep([[0, 0, 0], [3, 0, 1]], 0.1)`";
            self.report(Diagnostic::error(Code::OUTLINE, self.user_span(span), message).help(help));
        } else if [a, b].into_iter().any(|shape| self.ends_along_z(shape, heights)) {
            let message =
                "a loft leads from outline to outline, and here is a solid that ends along z by itself";
            self.report(
                Diagnostic::warning(Code::LOFT_OF_SOLIDS, self.user_span(span), message)
                    .help("the outline of a solid at the height 0 is `.at([x, y, 0])` of it"),
            );
        }
        b
    }

    /// Whether a shape has proven ends along z that a loft between two heights feels: one that reaches farther beyond both
    /// than the loft is high is as an outline there. An outline that turns or narrows along z has none.
    fn ends_along_z(&self, shape: Node, heights: [Node; 2]) -> bool {
        let graph = &self.module.graph;
        let Some(bounds) = ir::reach(graph, shape).filter(|_| graph.uses(shape, Axis::Z)) else {
            return false;
        };
        let [Some(z0), Some(z1)] = heights.map(|height| self.known_value(height)) else { return true };
        let room = z1 - z0;
        bounds.min.z > z0 - room || bounds.max.z < z1 + room
    }

    /// The least of a field and that of a disc or ball, which is a tenth larger than asked for, so that the surface is
    /// that of the field.
    fn least_with_round<const N: usize>(
        &mut self,
        field: Node,
        p: [Node; N],
        centre: [f64; N],
        radius: f64,
        span: Span,
    ) -> Node {
        let radius = 1.1 * radius;
        let limit = self.constant(radius * radius);
        let mut rest = limit;
        for (coordinate, middle) in p.into_iter().zip(centre) {
            let ahead = if middle == 0.0 {
                coordinate
            } else {
                let middle = self.constant(middle);
                self.binary(Binary::Sub, coordinate, middle, span)
            };
            let square = self.binary(Binary::Mul, ahead, ahead, span);
            rest = self.binary(Binary::Sub, rest, square, span);
        }
        let diameter = self.constant(2.0 * radius);
        let round = self.binary(Binary::Div, rest, diameter, span);
        self.binary(Binary::Min, field, round, span)
    }

    /// Copies of the shape, the first where it is. If it is proven to fit into one cell of the lattice, each point
    /// looks at the copy in its own cell only: then the number of copies costs nothing. Otherwise copies may reach
    /// into other cells, and they are joined by *or*. Along an axis on which the shape does not depend, all copies are
    /// the same, so there is one.
    pub fn repeated(
        &mut self,
        shape: Node,
        (step, step_at): ([f64; 3], Span),
        (counts, counts_at): ([f64; 3], Span),
        span: Span,
    ) -> Option<Node> {
        self.may_repeat((step, step_at), (counts, counts_at))?;
        let differs = Axis::SPACE.map(|axis| self.module.graph.uses(shape, axis));
        let counts = std::array::from_fn(|i| if differs[i] { counts[i] } else { 1.0 });
        let bounds = ir::reach(&self.module.graph, shape);
        let fits = |bounds: &Aabb| {
            (0..3).all(|i| counts[i] == 1.0 || bounds.size()[i] <= step[i].abs() * (1.0 + ROUNDING))
        };
        match bounds.filter(fits) {
            Some(bounds) => Some(self.in_cells(shape, &bounds, (step, counts), span)),
            None => self.copies(shape, (step, counts), span),
        }
    }

    /// Whether each direction has copies, at distances from each other. If not, this is reported.
    fn may_repeat(
        &mut self,
        (step, step_at): ([f64; 3], Span),
        (counts, counts_at): ([f64; 3], Span),
    ) -> Option<()> {
        if let Some(count) = counts.into_iter().find(|count| !(*count >= 1.0 && count.fract() == 0.0)) {
            let message = format!("a shape is repeated a whole number of times, found {count}");
            let diagnostic = Diagnostic::error(Code::OUT_OF_RANGE, self.user_span(counts_at), message);
            self.report(diagnostic.help("write 1 for a direction without copies"));
            return None;
        }
        let is_together = |i: &usize| counts[*i] > 1.0 && !(step[*i] != 0.0 && step[*i].is_finite());
        let Some(together) = (0..3).find(is_together) else { return Some(()) };
        let axis = ["x", "y", "z"][together];
        let message = format!("all {} copies along {axis} are at one place", counts[together]);
        let diagnostic = Diagnostic::error(Code::OUT_OF_RANGE, self.user_span(step_at), message);
        self.report(diagnostic.help(format!("write the distance from copy to copy along {axis}, or 1 copy")));
        None
    }

    /// Each point looks at the copy in its own cell; the cells at the ends have no end.
    fn in_cells(
        &mut self,
        shape: Node,
        bounds: &Aabb,
        (step, counts): ([f64; 3], [f64; 3]),
        span: Span,
    ) -> Node {
        let p = Axis::SPACE.map(|axis| self.module.graph.coordinate(axis));
        let centre = bounds.centre();
        let within = std::array::from_fn(|i| {
            if counts[i] == 1.0 {
                return p[i];
            }
            let [from, distance, last] =
                [centre[i] - 0.5 * step[i], step[i], counts[i] - 1.0].map(|number| self.constant(number));
            let ahead = self.binary(Binary::Sub, p[i], from, span);
            let cells = self.binary(Binary::Div, ahead, distance, span);
            let cell = self.unary(Unary::Floor, cells, span);
            let first = self.constant(0.0);
            let cell = self.binary(Binary::Min, cell, last, span);
            let cell = self.binary(Binary::Max, cell, first, span);
            let offset = self.binary(Binary::Mul, cell, distance, span);
            self.binary(Binary::Sub, p[i], offset, span)
        });
        let mut copies = self.module.graph.substitute(shape, within);
        for i in (0..3).filter(|&i| counts[i] > 1.0) {
            let (half, distance) = (0.5 * bounds.size()[i], step[i].abs());
            // between the shape and the border of its cell
            let limit = 0.5 * (half + 0.5 * distance);
            if half < 0.499 * distance {
                let strip = self.near_middles(p[i], (centre[i], distance), limit, span);
                copies = self.binary(Binary::Min, copies, strip, span);
            }
        }
        copies
    }

    /// Positive within `limit` of the middles of all cells along an axis. Ranges over a border between cells
    /// do not see that both copies are away from it. This field shows it, because it jumps in the middles
    /// instead.
    fn near_middles(&mut self, p: Node, (middle, distance): (f64, f64), limit: f64, span: Span) -> Node {
        let [middle, distance, half, limit] =
            [middle, distance, 0.5, limit - 0.5 * distance].map(|number| self.constant(number));
        let ahead = self.binary(Binary::Sub, p, middle, span);
        let cells = self.binary(Binary::Div, ahead, distance, span);
        let whole = self.unary(Unary::Floor, cells, span);
        let part = self.binary(Binary::Sub, cells, whole, span);
        let from_border = self.binary(Binary::Sub, part, half, span);
        let from_border = self.unary(Unary::Abs, from_border, span);
        let length = self.binary(Binary::Mul, from_border, distance, span);
        self.binary(Binary::Add, length, limit, span)
    }

    /// All copies joined. `None` if they are too many, which is reported.
    fn copies(&mut self, shape: Node, (step, counts): ([f64; 3], [f64; 3]), span: Span) -> Option<Node> {
        let p = Axis::SPACE.map(|axis| self.module.graph.coordinate(axis));
        // no two copies are the same, and each is joined to another one
        let least = self.module.graph.len() as f64 + 2.0 * counts.iter().product::<f64>();
        if !self.may_unroll(least, "make fewer copies", span) {
            return None;
        }
        let [nx, ny, nz] = counts.map(|count| count as u64);
        let mut all = Vec::new();
        for k in 0..nz {
            for j in 0..ny {
                for i in 0..nx {
                    if self.over_budget(span) {
                        return None;
                    }
                    let cell = [i, j, k];
                    let place = std::array::from_fn(|axis| {
                        let offset = self.constant(cell[axis] as f64 * step[axis]);
                        self.binary(Binary::Sub, p[axis], offset, span)
                    });
                    all.push(self.module.graph.substitute(shape, place));
                }
            }
        }
        Some(self.balanced(Logic::Or, &all, span))
    }
}
