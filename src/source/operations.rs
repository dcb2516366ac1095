//! The operations that need more than an operator: R₀ in its forms, each written once for all languages.
//!
//! A formula is a list of lines `name = expression`; a name that ends with `?` holds a truth value. `pick(c, a, b)`
//! is a where c holds and b elsewhere. These are the operations of `ir::r0`, in their order, with the signs of a
//! disjunction worked in: so the C has the bits of the interpreter.

use super::c_waves::{self, Wave};
use super::language::{Head, Language};
use crate::ir::{Form, R0, r0};
use crate::precision::Precision;

/// A function that a file defines for its formulas.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Operation {
    /// u ∧ v or u ∨ v.
    Join(Junction, Style),
    /// u ∧ v or u ∨ v, with ∂/∂u and ∂/∂v.
    Weighted(Junction, Style),
    /// aᵇ also for negative a, for languages whose own power has positive bases only.
    Power,
    /// sin u, for shaders, whose own may be off by 2e-4.
    Sin,
    /// cos u, likewise.
    Cos,
    /// tan u, likewise.
    Tan,
    /// sin u in C, with the bits of `rfm`; NaN where the library is to be called.
    FastSin,
    /// cos u, likewise.
    FastCos,
}

/// ∧ or ∨
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Junction {
    And,
    Or,
}

/// A form of R₀ for single points, where the guarded one is the stable one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Style {
    Stable,
    Scaled,
    Textbook,
}

impl From<Form> for Style {
    fn from(form: Form) -> Self {
        match form {
            Form::Stable | Form::Guarded => Self::Stable,
            Form::Scaled => Self::Scaled,
            Form::Textbook => Self::Textbook,
        }
    }
}

impl From<R0> for Junction {
    fn from(r0: R0) -> Self {
        match r0 {
            R0::And | R0::AndWeight => Self::And,
            R0::Or | R0::OrWeight => Self::Or,
        }
    }
}

/// The fields of what a weighted operation gives.
pub(super) const WEIGHTED_FIELDS: [&str; 3] = ["value", "by_u", "by_v"];

/// What both branches of the stable form need.
const STABLE: &str = "less? = u < v
more? = v < u
low = pick(less, u, v)
high = pick(more, u, v)
sum = u + v
a = abs(u)
b = abs(v)
larger = pick(b < a, a, b)
root = sqrt(u * u + v * v)
h = pick(root < larger, larger, root)
below = larger + h
";

const STABLE_VALUE: &str = "value = pick(is_small, nearer ∓ nearer * (nearer / below), sum ∓ h)
";

const STABLE_WEIGHTED: &str = "ratio = pick(is_small, nearer, farther) / below
value = pick(is_small, nearer ∓ nearer * ratio, sum ∓ h)
tau = pick(below == {0}, {corner}, ratio)
";

const SCALED: &str = "less? = u < v
more? = v < u
low = pick(less, u, v)
high = pick(less, v, u)
sum = u + v
";

const SCALED_VALUE: &str = "m = pick(is_small, nearer, farther)
big = pick(is_small, farther, nearer)
q = pick(m == big, {1}, m / big)
k = {1} + sqrt({1} + q * q)
ratio = q / k
value = pick(is_small, m - m * ratio, big * (k + q))
";

const TEXTBOOK: &str = "h = sqrt(u * u + v * v)
value = (u + v) ∓ h
";

const TEXTBOOK_WEIGHTS: &str = "by_u = {1} ∓ u / h
by_v = {1} ∓ v / h
";

/// The weights from τ. Choices of results, and not a comparison of two truth values: compilers then keep their vectors.
const WEIGHTS: &str = "square = tau * tau
scale = {1} / ({1} + square)
rest = {1} ∓ tau
lesser = rest * rest * scale
greater = pick(is_small, square, {1}) * (scale + scale)
of_near = pick(is_small, lesser, greater)
of_far = pick(is_small, greater, lesser)
by_u = pick(u_is_near, of_near, of_far)
by_v = pick(v_is_near, of_near, of_far)
";

/// |a|ᵇ with the sign that a whole b gives it; NaN for other exponents, from the root of a negative number.
const POWER: &str = "whole? = floor(v) == v
odd? = v - {2} * floor(v / {2}) == {1}
power = pow(abs(u), v)
value = pick(u < {0}, pick(whole, pick(odd, -power, power), sqrt(u)), power)
";

/// Sine and cosine of what is left of u without its quarter turns, whose number is k, in single precision:
/// Cody and Waite's reduction in three parts, exact for |u| below 10⁴, and the polynomials of Moshier's
/// Cephes library.
const QUARTER: &str = "k = floor(u * {0.6366197723675814} + {0.5})
r = ((u - k * {1.5703125}) - k * {0.0004837512969970703125}) - k * {7.54978995489188216e-8}
square = r * r
sine = r + r * square * ({-0.16666654611} + square * ({0.0083321608736} - square * {0.00019515295891}))
tail = {0.04166664568298827} + square * ({-0.001388731625493765} + square * {0.00002443315711809948})
cosine = {1} - {0.5} * square + square * square * tail
is_odd? = k - {2} * floor(k / {2}) == {1}
quarter = k - {4} * floor(k / {4})
";

/// Where u is so large that nothing of its quarter turn is known, the result still lies in −1 … 1.
const SIN: &str = "raw = pick(is_odd, cosine, sine)
capped = pick(raw > {1}, {1}, raw)
size = pick(capped < -{1}, -{1}, capped)
value = pick(quarter > {1.5}, -size, size)
";

const COS: &str = "raw = pick(is_odd, sine, cosine)
capped = pick(raw > {1}, {1}, raw)
size = pick(capped < -{1}, -{1}, capped)
value = pick(abs(quarter - {1.5}) < {1}, -size, size)
";

const TAN: &str = "value = pick(is_odd, -cosine, sine) / pick(is_odd, sine, cosine)
";

impl Operation {
    /// Its name in a file, behind the prefix.
    pub fn name(self) -> String {
        let name = |junction: Junction| match junction {
            Junction::And => "and",
            Junction::Or => "or",
        };
        let style = |style: Style| match style {
            Style::Stable => "",
            Style::Scaled => "_scaled",
            Style::Textbook => "_textbook",
        };
        match self {
            Self::Join(junction, form) => format!("op_{}{}", name(junction), style(form)),
            Self::Weighted(junction, form) => format!("op_{}_weighted{}", name(junction), style(form)),
            Self::Power => "op_pow".into(),
            Self::Sin => "op_sin".into(),
            Self::Cos => "op_cos".into(),
            Self::Tan => "op_tan".into(),
            Self::FastSin => "op_fast_sin".into(),
            Self::FastCos => "op_fast_cos".into(),
        }
    }

    /// Its formula, line by line.
    fn formula(self, precision: Precision) -> String {
        let branch = |junction| match junction {
            Junction::And => "nearer = low\nfarther = high\nis_small? = sum > {0}\n",
            Junction::Or => "nearer = high\nfarther = low\nis_small? = sum < {0}\n",
        };
        let near = |junction| match junction {
            Junction::And => "u_is_near? = less\nv_is_near? = more\n",
            Junction::Or => "u_is_near? = more\nv_is_near? = less\n",
        };
        let (junction, parts): (Junction, Vec<&str>) = match self {
            Self::Join(j, Style::Stable) => (j, vec![STABLE, branch(j), STABLE_VALUE]),
            Self::Join(j, Style::Scaled) => (j, vec![SCALED, branch(j), SCALED_VALUE]),
            Self::Join(j, Style::Textbook) => (j, vec![TEXTBOOK]),
            Self::Weighted(j, Style::Stable) => {
                (j, vec![STABLE, branch(j), STABLE_WEIGHTED, near(j), WEIGHTS])
            }
            Self::Weighted(j, Style::Scaled) => {
                // with the signs of the operands in it, τ serves both operations in the form of a conjunction
                let tau = "tau = pick(is_small, ratio, -ratio)\n";
                let parts = [SCALED, branch(j), SCALED_VALUE, tau, near(j), WEIGHTS];
                return signed(&parts[..4], j) + &signed(&parts[4..], Junction::And);
            }
            Self::Weighted(j, Style::Textbook) => (j, vec![TEXTBOOK, TEXTBOOK_WEIGHTS]),
            Self::Power => (Junction::And, vec![POWER]),
            Self::Sin => (Junction::And, vec![QUARTER, SIN]),
            Self::Cos => (Junction::And, vec![QUARTER, COS]),
            Self::Tan => (Junction::And, vec![QUARTER, TAN]),
            Self::FastSin => return c_waves::formula(Wave::Sine, precision),
            Self::FastCos => return c_waves::formula(Wave::Cosine, precision),
        };
        signed(&parts, junction)
    }

    /// Its definition in a language.
    pub fn definition(self, language: &Language, precision: Precision, names: &Names<'_>) -> Vec<String> {
        let number = language.number(precision);
        let weighted = matches!(self, Self::Weighted(..));
        let joint = names.joint(language, precision);
        let result = if weighted { joint.as_str() } else { number };
        let name = names.operation(self, language, precision);
        let operands: &[&str] = match self {
            Self::Join(..) | Self::Weighted(..) | Self::Power => &["u", "v"],
            Self::Sin | Self::Cos | Self::Tan | Self::FastSin | Self::FastCos => &["u"],
        };
        // the precision that it computes in
        let inner = match self {
            Self::FastSin | Self::FastCos => Precision::F64,
            Self::Join(..) | Self::Weighted(..) | Self::Power | Self::Sin | Self::Cos | Self::Tan => {
                precision
            }
        };
        let mut lines: Vec<String> = (language.head)(Head { result, name: &name, operand: number, operands })
            .lines()
            .map(String::from)
            .collect();
        let pick = names.pick(language, precision);
        let write = |text: &str| translated(text, language, inner, &pick);
        let formula = self.formula(precision);
        for (name, value) in used_lines(&formula, weighted) {
            let (name, kind) = match name.strip_suffix('?') {
                Some(name) => (name, language.truth),
                None => (name, language.number(inner)),
            };
            lines.push(format!("    {}", (language.declare)(kind, name, &write(value))));
        }
        let last = if weighted {
            (language.give_all)(&joint, &WEIGHTED_FIELDS)
        } else {
            let converted = format!("({number})value");
            vec![(language.give)(if inner == precision { "value" } else { &converted })]
        };
        lines.extend(last.into_iter().map(|line| format!("    {line}")));
        lines.push("}".into());
        lines
    }
}

/// The names and values of a formula that its results depend on, in order.
fn used_lines(formula: &str, weighted: bool) -> Vec<(&str, &str)> {
    let results: &[&str] = if weighted { &WEIGHTED_FIELDS } else { &WEIGHTED_FIELDS[..1] };
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut read: Vec<&str> = results.to_vec();
    let mut used = Vec::new();
    for (name, value) in formula.lines().rev().filter_map(|line| line.split_once(" = ")) {
        if read.contains(&name.trim_end_matches('?')) {
            read.extend(value.split(|c| !is_word(c)));
            used.push((name, value));
        }
    }
    used.reverse();
    used
}

/// The names that a file makes for itself: they all begin with its prefix.
pub(super) struct Names<'a> {
    pub prefix: &'a str,
}

impl Names<'_> {
    pub fn operation(&self, operation: Operation, language: &Language, precision: Precision) -> String {
        format!("{}_{}{}", self.prefix, operation.name(), language.suffix(precision))
    }

    /// The structure of a value with its weights.
    pub fn joint(&self, language: &Language, precision: Precision) -> String {
        format!("{}_joint{}", self.prefix, language.suffix(precision))
    }

    pub fn pick(&self, language: &Language, precision: Precision) -> String {
        format!("{}_pick{}", self.prefix, language.suffix(precision))
    }
}

/// The parts as one text with the signs of a junction.
fn signed(parts: &[&str], junction: Junction) -> String {
    let (sign, corner) = match junction {
        Junction::And => ("-", "{-corner}"),
        Junction::Or => ("+", "{corner}"),
    };
    parts.concat().replace('∓', sign).replace("{corner}", corner)
}

/// An expression of a formula in a language.
fn translated(text: &str, language: &Language, precision: Precision, pick: &str) -> String {
    let constant = |value: f64| language.constant(value, precision).unwrap_or_default();
    let numbers = text.split('{').skip(1).filter_map(|rest| rest.split_once('}').map(|(number, _)| number));
    let numbers = numbers.filter_map(|number| Some((format!("{{{number}}}"), number.parse().ok()?)));
    let text =
        numbers.fold(text.to_string(), |text, (written, value)| text.replace(&written, &constant(value)));
    let function = |both: [&'static str; 2]| super::language::pair(both, precision).to_string() + "(";
    text.replace("{corner}", &constant(r0::SINGULAR_TAU))
        .replace("{-corner}", &constant(-r0::SINGULAR_TAU))
        .replace("pick(", &format!("{pick}("))
        .replace("sqrt(", &function(language.root))
        .replace("abs(", &function(language.magnitude))
}
