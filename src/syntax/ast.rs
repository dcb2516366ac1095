//! The syntax tree: what was written, with its spans. Nothing is concluded here.

use std::sync::Arc;

use crate::diagnostic::Span;

#[derive(Debug, Clone, PartialEq)]
pub struct Name {
    pub text: String,
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ast {
    pub items: Vec<Item>,
    /// The text that the spans point into, so that a message can repeat what was written.
    pub text: Arc<str>,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    Import(Import),
    Param(Param),
    Let(Definition),
    Function(Function),
    Solid(Definition),
    Scene(SceneItem),
}

/// `import "path" as name`
#[derive(Debug, Clone, PartialEq)]
pub struct Import {
    pub name: Name,
    /// The path as it is written, without the quotes.
    pub path: String,
    /// The path with its quotes.
    pub span: Span,
}

/// `param name = value in low .. high "doc"`
#[derive(Debug, Clone, PartialEq)]
pub struct Param {
    pub name: Name,
    pub value: Expr,
    pub range: Option<(Expr, Expr)>,
    pub doc: Option<String>,
}

/// `let name = value` or `@attribute(…) solid name = value`
#[derive(Debug, Clone, PartialEq)]
pub struct Definition {
    /// Attributes; only solids have them.
    pub attributes: Vec<Attribute>,
    pub name: Name,
    pub value: Expr,
}

/// `@name(arguments)`: a demand on a solid, beside its shape.
#[derive(Debug, Clone, PartialEq)]
pub struct Attribute {
    pub name: Name,
    pub arguments: Vec<Argument>,
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Function {
    pub name: Name,
    pub parameters: Vec<Parameter>,
    pub body: Expr,
}

impl Function {
    /// The name of the first parameter of a function that may be called as a method.
    pub const SHAPE: &str = "shape";

    /// Whether it may be called as a method: its first parameter is called `shape`.
    pub fn takes_a_shape(&self) -> bool {
        self.parameters.first().is_some_and(|first| first.name.text == Self::SHAPE)
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    pub name: Name,
    pub default: Option<Expr>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct SceneItem {
    pub name: Name,
    pub entries: Vec<Entry>,
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Entry {
    Setting { key: Name, value: Expr },
    Block { key: Name, label: Option<Name>, entries: Vec<Entry>, span: Span },
}

impl Entry {
    pub fn key(&self) -> &Name {
        match self {
            Self::Setting { key, .. } | Self::Block { key, .. } => key,
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Expr {
    pub kind: ExprKind,
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq)]
pub enum ExprKind {
    Number(f64),
    /// A number with a unit, kept as written: `9.81 m/s^2`.
    Quantity {
        value: f64,
        unit: Name,
    },
    Text(String),
    Name(String),
    Vector(Vec<Expr>),
    /// A chain of one logic operator without parentheses; two operands or more.
    Logic {
        op: Logic,
        operands: Vec<Expr>,
    },
    Not(Box<Expr>),
    /// A chain of comparisons: the first operand, then one or more comparisons with the next.
    Compare {
        first: Box<Expr>,
        rest: Vec<(Comparison, Span, Expr)>,
    },
    Sum {
        first: Box<Expr>,
        rest: Vec<(AddOp, Expr)>,
    },
    Product {
        first: Box<Expr>,
        rest: Vec<(MulOp, Expr)>,
    },
    Negate(Box<Expr>),
    Power {
        base: Box<Expr>,
        exponent: Box<Expr>,
    },
    Call {
        function: Name,
        arguments: Vec<Argument>,
    },
    /// `v.x`
    Component {
        vector: Box<Expr>,
        axis: usize,
    },
    /// `chess.pawn`: a name of an imported file.
    Member {
        of: Box<Expr>,
        name: Name,
    },
    Method {
        receiver: Box<Expr>,
        method: Name,
        arguments: Vec<Argument>,
    },
    /// `list[2]`
    Index {
        list: Box<Expr>,
        index: Box<Expr>,
    },
    /// `any i in start..end: body`, `sum p in list: body` and so on.
    Fold {
        op: Fold,
        variable: Name,
        members: Members,
        body: Box<Expr>,
    },
    /// `if condition then a else b`, the same as `where(condition, a, b)`.
    Choice {
        condition: Box<Expr>,
        values: Box<[Expr; 2]>,
    },
}

#[derive(Debug, Clone, PartialEq)]
pub struct Argument {
    pub name: Option<Name>,
    pub value: Expr,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Logic {
    And,
    Or,
    /// `a \ b`: in a and not in b.
    Minus,
}

impl Logic {
    /// The word as it is written.
    pub fn word(self) -> &'static str {
        match self {
            Self::And => "and",
            Self::Or => "or",
            Self::Minus => "\\",
        }
    }
}

/// What a fold makes of its members.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fold {
    /// `any`: the members joined by *or*.
    Any,
    /// `all`: the members joined by *and*.
    All,
    Sum,
    Product,
    Min,
    Max,
    /// `list`: the members as a list.
    List,
}

impl Fold {
    /// All of them.
    pub const ALL_FOLDS: [Self; 7] =
        [Self::Any, Self::All, Self::Sum, Self::Product, Self::Min, Self::Max, Self::List];

    /// Its word in files.
    pub fn word(self) -> &'static str {
        match self {
            Self::Any => "any",
            Self::All => "all",
            Self::Sum => "sum",
            Self::Product => "product",
            Self::Min => "min",
            Self::Max => "max",
            Self::List => "list",
        }
    }

    /// Whether it has a value without members, as a sum is 0 and a list is empty.
    pub fn has_value_of_none(self) -> bool {
        matches!(self, Self::Sum | Self::Product | Self::List)
    }
}

/// What the variable of a fold stands for, one after the other.
#[derive(Debug, Clone, PartialEq)]
pub enum Members {
    /// The whole numbers `start..end`, without the end.
    Range(Box<Expr>, Box<Expr>),
    List(Box<Expr>),
}

impl Members {
    /// The expressions that say what the members are.
    pub fn exprs(&self) -> Vec<&Expr> {
        match self {
            Self::Range(start, end) => vec![start, end],
            Self::List(list) => vec![list],
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comparison {
    LessEqual,
    GreaterEqual,
    /// `<`: read as `<=`, with a warning.
    Less,
    Greater,
    /// `==` and `!=`: always errors; kept for the messages about them.
    Equal,
    NotEqual,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AddOp {
    Add,
    Subtract,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MulOp {
    Multiply,
    Divide,
}

impl Item {
    pub fn name(&self) -> &Name {
        match self {
            Self::Import(import) => &import.name,
            Self::Param(param) => &param.name,
            Self::Let(definition) | Self::Solid(definition) => &definition.name,
            Self::Function(function) => &function.name,
            Self::Scene(scene) => &scene.name,
        }
    }

    /// The first place in its expressions that is nested deeper than `levels`, or `None`.
    pub fn deeper_than(&self, levels: usize) -> Option<Span> {
        match self {
            Self::Import(_) => None,
            Self::Param(param) => {
                let range = param.range.iter().flat_map(|(low, high)| [low, high]);
                deepest(range.chain([&param.value]), levels)
            }
            Self::Let(definition) | Self::Solid(definition) => {
                let arguments = definition.attributes.iter().flat_map(|a| &a.arguments).map(|a| &a.value);
                deepest(arguments.chain([&definition.value]), levels)
            }
            Self::Function(function) => {
                let defaults = function.parameters.iter().filter_map(|p| p.default.as_ref());
                deepest(defaults.chain([&function.body]), levels)
            }
            Self::Scene(scene) => scene.entries.iter().find_map(|entry| entry.deeper_than(levels)),
        }
    }
}

impl Entry {
    /// The depth of blocks is not counted: the parser lets them nest no deeper than brackets.
    fn deeper_than(&self, levels: usize) -> Option<Span> {
        match self {
            Self::Setting { value, .. } => value.deeper_than(levels),
            Self::Block { entries, .. } => entries.iter().find_map(|entry| entry.deeper_than(levels)),
        }
    }
}

impl Expr {
    fn deeper_than(&self, levels: usize) -> Option<Span> {
        if levels == 0 { Some(self.span) } else { deepest(self.children(), levels - 1) }
    }

    /// The direct parts of this expression, in the order in which they are written.
    pub fn children(&self) -> Vec<&Self> {
        match &self.kind {
            ExprKind::Number(_) | ExprKind::Quantity { .. } | ExprKind::Text(_) | ExprKind::Name(_) => vec![],
            ExprKind::Vector(parts) | ExprKind::Logic { operands: parts, .. } => parts.iter().collect(),
            ExprKind::Not(inner)
            | ExprKind::Negate(inner)
            | ExprKind::Component { vector: inner, .. }
            | ExprKind::Member { of: inner, .. } => vec![inner],
            ExprKind::Compare { first, rest } => {
                std::iter::once(&**first).chain(rest.iter().map(|(_, _, e)| e)).collect()
            }
            ExprKind::Sum { first, rest } => {
                std::iter::once(&**first).chain(rest.iter().map(|(_, e)| e)).collect()
            }
            ExprKind::Product { first, rest } => {
                std::iter::once(&**first).chain(rest.iter().map(|(_, e)| e)).collect()
            }
            ExprKind::Power { base, exponent } => vec![base, exponent],
            ExprKind::Call { arguments, .. } => arguments.iter().map(|a| &a.value).collect(),
            ExprKind::Method { receiver, arguments, .. } => {
                std::iter::once(&**receiver).chain(arguments.iter().map(|a| &a.value)).collect()
            }
            ExprKind::Index { list, index } => vec![list, index],
            ExprKind::Fold { members, body, .. } => {
                let mut children = members.exprs();
                children.push(body);
                children
            }
            ExprKind::Choice { condition, values } => {
                let [first, second] = &**values;
                vec![condition, first, second]
            }
        }
    }
}

fn deepest<'a>(exprs: impl IntoIterator<Item = &'a Expr>, levels: usize) -> Option<Span> {
    exprs.into_iter().find_map(|expr| expr.deeper_than(levels))
}
