//! The table of target languages: how each of them writes numbers, declarations and functions.
//!
//! All of them agree in how `a + b * c`, `a < b` and `f(a, b)` are written, and a choice is a call of `pick`
//! everywhere; the table holds the rest.

use super::Math;
use crate::ir::{BinaryFunction, UnaryFunction};
use crate::precision::Precision;

/// A language that formulas are printed in.
pub(super) struct Language {
    /// The types of `f64` and `f32`.
    pub types: [&'static str; 2],
    /// The type of a truth value.
    pub truth: &'static str,
    /// What names in `f32` end with, where both precisions stand in one file.
    pub single_suffix: &'static str,
    /// A number that is finite in the precision.
    pub finite: fn(f64, Precision) -> String,
    /// NaN, ∞ and −∞; `None` where the language cannot write them.
    pub non_finite: Option<fn(Precision) -> [String; 3]>,
    /// The declaration of a constant: type, name, value.
    pub declare: fn(&str, &str, &str) -> String,
    /// The head of a function: type of its result, name, parameters of one type.
    pub head: fn(Head<'_>) -> String,
    /// The last lines of a function that gives one value.
    pub give: fn(&str) -> String,
    /// The last lines of a function that gives a structure: its name and those of its fields, which are names of
    /// values as well.
    pub give_all: fn(&str, &[&str]) -> Vec<String>,
    /// A structure of numbers: its name, their type, their names.
    pub structure: fn(&str, &str, &[&str]) -> Vec<String>,
    /// The root and the magnitude.
    pub root: [&'static str; 2],
    pub magnitude: [&'static str; 2],
    /// The sign between two conditions of which one at least holds. Both are computed, so that loops stay
    /// free of branches.
    pub either: &'static str,
    /// The largest whole number that is not above a number, and the nearest one, the even one of two.
    pub floor: [&'static str; 2],
    pub round: [&'static str; 2],
    /// The call of a function of the mathematical library.
    pub function: fn(Function, Precision, Math, &[&str]) -> String,
    /// How `pick` is defined for a type, under its full name.
    pub pick: fn(&str, &str) -> String,
}

/// A function of the mathematical library.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Function {
    Unary(UnaryFunction),
    Binary(BinaryFunction),
}

impl Function {
    /// Its declaration in C, where it is not one of the system's.
    pub fn declaration(self, precision: Precision) -> String {
        let number = C.number(precision);
        let operands = match self {
            Self::Unary(_) => format!("{number} a"),
            Self::Binary(_) => format!("{number} a, {number} b"),
        };
        format!("{number} rfm_math_{}({operands});", c_name(self, precision))
    }
}

/// What stands before the body of a function.
pub(super) struct Head<'a> {
    pub result: &'a str,
    pub name: &'a str,
    pub operand: &'a str,
    pub operands: &'a [&'a str],
}

impl Language {
    /// The type of a number.
    pub fn number(&self, precision: Precision) -> &'static str {
        pair(self.types, precision)
    }

    /// What a name in a precision ends with.
    pub fn suffix(&self, precision: Precision) -> &'static str {
        match precision {
            Precision::F64 => "",
            Precision::F32 => self.single_suffix,
        }
    }

    /// A constant in a precision; `None` if the language cannot write it.
    pub fn constant(&self, value: f64, precision: Precision) -> Option<String> {
        let rounded = match precision {
            Precision::F64 => value,
            Precision::F32 => f64::from(value as f32),
        };
        if rounded.is_finite() {
            let text = (self.finite)(rounded, precision);
            return Some(if rounded.is_sign_negative() { format!("({text})") } else { text });
        }
        let [nan, plus, minus] = self.non_finite?(precision);
        Some(if rounded.is_nan() {
            nan
        } else if rounded.is_sign_positive() {
            plus
        } else {
            minus
        })
    }
}

/// The one of two that belongs to a precision.
pub(super) fn pair(both: [&'static str; 2], precision: Precision) -> &'static str {
    match precision {
        Precision::F64 => both[0],
        Precision::F32 => both[1],
    }
}

/// The shortest digits that give the number back.
fn digits(value: f64, precision: Precision) -> String {
    match precision {
        Precision::F64 => format!("{value:?}"),
        Precision::F32 => format!("{:?}", value as f32),
    }
}

pub(super) static C: Language = Language {
    types: ["double", "float"],
    truth: "int",
    single_suffix: "f",
    finite: |value, precision| digits(value, precision) + pair(["", "f"], precision),
    non_finite: Some(|_| ["NAN", "INFINITY", "(-INFINITY)"].map(String::from)),
    declare: |kind, name, value| format!("const {kind} {name} = {value};"),
    head: |head| {
        let operands: Vec<String> =
            head.operands.iter().map(|name| format!("{} {name}", head.operand)).collect();
        format!("RFM_INLINE {} {}({}) {{", head.result, head.name, operands.join(", "))
    },
    give: |value| format!("return {value};"),
    give_all: |structure, fields| {
        let mut lines = vec![format!("{structure} all;")];
        lines.extend(fields.iter().map(|field| format!("all.{field} = {field};")));
        lines.push("return all;".into());
        lines
    },
    structure: |name, kind, fields| {
        vec![format!("typedef struct {{ {kind} {}; }} {name};", fields.join(", "))]
    },
    root: ["sqrt", "sqrtf"],
    magnitude: ["fabs", "fabsf"],
    either: "|",
    floor: ["floor", "floorf"],
    round: ["rint", "rintf"],
    function: |function, precision, math, operands| {
        let library = match math {
            Math::System => "",
            Math::Rfm => "rfm_math_",
        };
        format!("{library}{}({})", c_name(function, precision), operands.join(", "))
    },
    pick: |_, name| format!("#define {name}(condition, yes, no) ((condition) ? (yes) : (no))"),
};

pub(super) static RUST: Language = Language {
    types: ["f64", "f32"],
    truth: "bool",
    single_suffix: "_f32",
    finite: |value, precision| digits(value, precision) + pair(["_f64", "_f32"], precision),
    non_finite: Some(|precision| {
        ["NAN", "INFINITY", "NEG_INFINITY"].map(|name| format!("{}::{name}", precision.name()))
    }),
    declare: |kind, name, value| format!("let {name}: {kind} = {value};"),
    head: |head| {
        let operands: Vec<String> =
            head.operands.iter().map(|name| format!("{name}: {}", head.operand)).collect();
        format!(
            "#[inline(always)]\n#[allow(unused_parens)]\nfn {}({}) -> {} {{",
            head.name,
            operands.join(", "),
            head.result
        )
    },
    give: |value| value.into(),
    give_all: |structure, fields| vec![format!("{structure} {{ {} }}", fields.join(", "))],
    structure: |name, kind, fields| {
        let fields: Vec<String> = fields.iter().map(|field| format!("{field}: {kind}")).collect();
        vec![
            "#[allow(non_camel_case_types, dead_code)]".into(),
            format!("struct {name} {{ {} }}", fields.join(", ")),
        ]
    },
    root: ["f64::sqrt", "f32::sqrt"],
    magnitude: ["f64::abs", "f32::abs"],
    either: "|",
    floor: ["f64::floor", "f32::floor"],
    round: ["f64::round_ties_even", "f32::round_ties_even"],
    function: |function, precision, math, operands| match math {
        Math::Rfm => {
            format!("libm::{}({})", c_name(function, precision), operands.join(", "))
        }
        Math::System => format!("{}::{}({})", precision.name(), rust_name(function), operands.join(", ")),
    },
    pick: |kind, name| {
        format!(
            "#[inline(always)]\nfn {name}(condition: bool, yes: {kind}, no: {kind}) -> {kind} {{\n    \
             if condition {{ yes }} else {{ no }}\n}}"
        )
    },
};

pub(super) static WGSL: Language = Language {
    types: ["f32", "f32"],
    truth: "bool",
    single_suffix: "",
    finite: |value, precision| digits(value, precision) + "f",
    non_finite: None,
    declare: |_, name, value| format!("let {name} = {value};"),
    head: |head| {
        let operands: Vec<String> =
            head.operands.iter().map(|name| format!("{name}: {}", head.operand)).collect();
        format!("fn {}({}) -> {} {{", head.name, operands.join(", "), head.result)
    },
    give: |value| format!("return {value};"),
    give_all: |structure, fields| vec![format!("return {structure}({});", fields.join(", "))],
    structure: |name, kind, fields| {
        let fields: Vec<String> = fields.iter().map(|field| format!("{field}: {kind}")).collect();
        vec![format!("struct {name} {{ {} }}", fields.join(", "))]
    },
    root: ["sqrt", "sqrt"],
    magnitude: ["abs", "abs"],
    either: "|",
    floor: ["floor", "floor"],
    round: ["round", "round"],
    function: |function, _, _, operands| shader_call(function, "atan2", operands),
    pick: |kind, name| {
        format!(
            "fn {name}(condition: bool, yes: {kind}, no: {kind}) -> {kind} {{ return select(no, yes, condition); }}"
        )
    },
};

pub(super) static GLSL: Language = Language {
    types: ["float", "float"],
    truth: "bool",
    single_suffix: "",
    finite: digits,
    non_finite: None,
    declare: |kind, name, value| format!("{kind} {name} = {value};"),
    head: |head| {
        let operands: Vec<String> =
            head.operands.iter().map(|name| format!("{} {name}", head.operand)).collect();
        format!("{} {}({}) {{", head.result, head.name, operands.join(", "))
    },
    give: |value| format!("return {value};"),
    give_all: |structure, fields| vec![format!("return {structure}({});", fields.join(", "))],
    structure: |name, kind, fields| {
        let fields: Vec<String> = fields.iter().map(|field| format!("{kind} {field};")).collect();
        vec![format!("struct {name} {{ {} }};", fields.join(" "))]
    },
    root: ["sqrt", "sqrt"],
    magnitude: ["abs", "abs"],
    either: "||",
    floor: ["floor", "floor"],
    round: ["roundEven", "roundEven"],
    function: |function, _, _, operands| shader_call(function, "atan", operands),
    pick: |kind, name| {
        format!("{kind} {name}(bool condition, {kind} yes, {kind} no) {{ return condition ? yes : no; }}")
    },
};

/// The name in the library of C.
fn c_name(function: Function, precision: Precision) -> &'static str {
    match function {
        Function::Unary(function) => function.c_name(precision),
        Function::Binary(function) => function.c_name(precision),
    }
}

fn rust_name(function: Function) -> &'static str {
    match function {
        Function::Binary(BinaryFunction::Pow) => "powf",
        Function::Unary(other) => other.name(),
        Function::Binary(other) => other.name(),
    }
}

/// Shaders have these functions under the names of C. A power of negative numbers is undefined, and sin, cos
/// and tan are of any accuracy: functions of the file itself stand for these, see `operations`.
fn shader_call(function: Function, atan2: &str, operands: &[&str]) -> String {
    let operands = operands.join(", ");
    let name = match function {
        Function::Binary(BinaryFunction::Atan2) => atan2,
        // π/2, because the arc cosine of some shaders is ten times worse than their arc sine
        Function::Unary(UnaryFunction::Acos) => return format!("(1.5707964 - asin({operands}))"),
        // log10 e, to the digits of an f32
        Function::Unary(UnaryFunction::Log10) => return format!("(log({operands}) * 0.43429448)"),
        Function::Unary(
            UnaryFunction::Sin
            | UnaryFunction::Cos
            | UnaryFunction::Tan
            | UnaryFunction::Asin
            | UnaryFunction::Atan
            | UnaryFunction::Exp
            | UnaryFunction::Ln
            | UnaryFunction::Log2
            | UnaryFunction::Sinh
            | UnaryFunction::Cosh
            | UnaryFunction::Tanh,
        )
        | Function::Binary(BinaryFunction::Pow) => c_name(function, Precision::F64),
    };
    format!("{name}({operands})")
}
