//! The rules: an equation read from left to right, the condition under which it holds, and the rewrite.

use super::simplifier::{Rule, Simplifier};
use crate::diagnostic::Span;
use crate::ir::{Binary, Expr, Node, Unary};

pub(super) const ALL: &[Rule] = &[
    Rule { equation: "op(constants) = constant", apply: fold },
    Rule { equation: "−(−x) = x", apply: double_negation },
    Rule { equation: "−(x − y) = y − x", apply: negated_difference },
    Rule { equation: "x + (−y) = x − y", apply: add_negated },
    Rule { equation: "x − (−y) = x + y", apply: subtract_negated },
    Rule { equation: "(−x)·y = −(x·y)", apply: multiply_negated },
    Rule { equation: "1·x = x", apply: multiply_one },
    Rule { equation: "(−1)·x = −x", apply: multiply_minus_one },
    Rule { equation: "x + 0 = x", apply: add_zero },
    Rule { equation: "0 − x = −x", apply: subtract_from_zero },
    Rule { equation: "x / 2ⁿ = x·2⁻ⁿ", apply: divide_by_power_of_two },
    Rule { equation: "¬u ∧ ¬v = ¬(u ∨ v)", apply: de_morgan },
    Rule { equation: "min(x, x) = x", apply: min_max_same },
    Rule { equation: "|−x| = |x|", apply: abs_negated },
];

/// The operand, if the node is a negation.
fn negated(s: &Simplifier, node: Node) -> Option<Node> {
    match s.graph.expr(node) {
        Expr::Unary(Unary::Neg, inner) => Some(inner),
        _ => None,
    }
}

fn is_constant(s: &Simplifier, node: Node, value: f64) -> bool {
    s.graph.as_constant(node).is_some_and(|c| c.to_bits() == value.to_bits())
}

/// One rounding now instead of the same rounding later. A NaN is left for the program to produce.
fn fold(s: &mut Simplifier, expr: Expr, _: Option<Span>) -> Option<Node> {
    let value = match expr {
        Expr::Unary(op, a) => op.eval(s.graph.as_constant(a)?),
        Expr::Binary(op, a, b) => op.eval(s.graph.as_constant(a)?, s.graph.as_constant(b)?),
        Expr::Constant(_)
        | Expr::Coordinate(_)
        | Expr::Parameter(_)
        | Expr::Uniform(_)
        | Expr::Lookup(..) => return None,
    };
    (!value.is_nan()).then(|| s.graph.constant(value))
}

fn double_negation(s: &mut Simplifier, expr: Expr, _: Option<Span>) -> Option<Node> {
    match expr {
        Expr::Unary(Unary::Neg, a) => negated(s, a),
        _ => None,
    }
}

/// Exact: rounding is symmetric.
fn negated_difference(s: &mut Simplifier, expr: Expr, span: Option<Span>) -> Option<Node> {
    let Expr::Unary(Unary::Neg, a) = expr else { return None };
    match s.graph.expr(a) {
        Expr::Binary(Binary::Sub, x, y) => Some(s.make(Expr::Binary(Binary::Sub, y, x), span)),
        _ => None,
    }
}

fn add_negated(s: &mut Simplifier, expr: Expr, span: Option<Span>) -> Option<Node> {
    let Expr::Binary(Binary::Add, a, b) = expr else { return None };
    if let Some(y) = negated(s, b) {
        return Some(s.make(Expr::Binary(Binary::Sub, a, y), span));
    }
    let x = negated(s, a)?;
    Some(s.make(Expr::Binary(Binary::Sub, b, x), span))
}

fn subtract_negated(s: &mut Simplifier, expr: Expr, span: Option<Span>) -> Option<Node> {
    let Expr::Binary(Binary::Sub, a, b) = expr else { return None };
    let y = negated(s, b)?;
    Some(s.make(Expr::Binary(Binary::Add, a, y), span))
}

/// For quotients too. Signs move outwards, where sums and further products absorb them.
fn multiply_negated(s: &mut Simplifier, expr: Expr, span: Option<Span>) -> Option<Node> {
    let Expr::Binary(op @ (Binary::Mul | Binary::Div), a, b) = expr else { return None };
    let (x, y) = match (negated(s, a), negated(s, b)) {
        (Some(x), Some(y)) => return Some(s.make(Expr::Binary(op, x, y), span)),
        (Some(x), None) => (x, b),
        (None, Some(y)) => (a, y),
        (None, None) => return None,
    };
    let product = s.make(Expr::Binary(op, x, y), span);
    Some(s.make(Expr::Unary(Unary::Neg, product), span))
}

/// For x / 1 too.
fn multiply_one(s: &mut Simplifier, expr: Expr, _: Option<Span>) -> Option<Node> {
    match expr {
        Expr::Binary(Binary::Mul, a, b) if is_constant(s, a, 1.0) => Some(b),
        Expr::Binary(Binary::Mul | Binary::Div, a, b) if is_constant(s, b, 1.0) => Some(a),
        _ => None,
    }
}

fn multiply_minus_one(s: &mut Simplifier, expr: Expr, span: Option<Span>) -> Option<Node> {
    let x = match expr {
        Expr::Binary(Binary::Mul, a, b) if is_constant(s, a, -1.0) => b,
        Expr::Binary(Binary::Mul | Binary::Div, a, b) if is_constant(s, b, -1.0) => a,
        _ => return None,
    };
    Some(s.make(Expr::Unary(Unary::Neg, x), span))
}

/// For x − 0 too. −0 + 0 is +0: the sign of a zero may change.
fn add_zero(s: &mut Simplifier, expr: Expr, _: Option<Span>) -> Option<Node> {
    let zero = |s: &Simplifier, node: Node| s.graph.as_constant(node) == Some(0.0);
    match expr {
        Expr::Binary(Binary::Add | Binary::Sub, a, b) if zero(s, b) => Some(a),
        Expr::Binary(Binary::Add, a, b) if zero(s, a) => Some(b),
        _ => None,
    }
}

/// 0 − 0 is +0 and −0 is not: the sign of a zero may change.
fn subtract_from_zero(s: &mut Simplifier, expr: Expr, span: Option<Span>) -> Option<Node> {
    match expr {
        Expr::Binary(Binary::Sub, a, b) if s.graph.as_constant(a) == Some(0.0) => {
            Some(s.make(Expr::Unary(Unary::Neg, b), span))
        }
        _ => None,
    }
}

/// Exact when the reciprocal is a normal number: a division costs several multiplications.
fn divide_by_power_of_two(s: &mut Simplifier, expr: Expr, span: Option<Span>) -> Option<Node> {
    let Expr::Binary(Binary::Div, a, b) = expr else { return None };
    let divisor = s.graph.as_constant(b)?;
    let mantissa = divisor.to_bits() & ((1 << 52) - 1);
    if mantissa != 0 || !divisor.is_normal() || !divisor.recip().is_normal() {
        return None;
    }
    let reciprocal = s.graph.constant(divisor.recip());
    Some(s.make(Expr::Binary(Binary::Mul, a, reciprocal), span))
}

/// Both De Morgan laws and those of the weights: bit for bit, because negation is exact and R₀ is symmetric.
fn de_morgan(s: &mut Simplifier, expr: Expr, span: Option<Span>) -> Option<Node> {
    let Expr::Binary(op, a, b) = expr else { return None };
    let (dual, negate) = match op {
        Binary::And => (Binary::Or, true),
        Binary::Or => (Binary::And, true),
        Binary::AndWeight => (Binary::OrWeight, false),
        Binary::OrWeight => (Binary::AndWeight, false),
        _ => return None,
    };
    let (u, v) = (negated(s, a)?, negated(s, b)?);
    let result = s.make(Expr::Binary(dual, u, v), span);
    Some(if negate { s.make(Expr::Unary(Unary::Neg, result), span) } else { result })
}

/// Does not hold for ∧ and ∨: u ∧ u = (2 − √2)·u.
fn min_max_same(_: &mut Simplifier, expr: Expr, _: Option<Span>) -> Option<Node> {
    match expr {
        Expr::Binary(Binary::Min | Binary::Max | Binary::PlainMin | Binary::PlainMax, a, b) if a == b => {
            Some(a)
        }
        _ => None,
    }
}

fn abs_negated(s: &mut Simplifier, expr: Expr, span: Option<Span>) -> Option<Node> {
    let Expr::Unary(Unary::Abs, a) = expr else { return None };
    let inner = negated(s, a)?;
    Some(s.make(Expr::Unary(Unary::Abs, inner), span))
}
