//! What is written: a graph for each question that the file answers.

use super::Options;
use crate::ir::{Forms, Graph, Node, Unary};
use crate::precision::Precision;
use crate::solid::{ProgramKind, Solid};

/// What a function of a file answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Question {
    Omega,
    Gradient,
    Sign,
    Distance,
}

impl Question {
    /// The name of its functions, behind the prefix.
    pub fn name(self) -> &'static str {
        match self {
            Self::Omega => "omega",
            Self::Gradient => "omega_gradient",
            Self::Sign => "sign",
            Self::Distance => "distance",
        }
    }

    /// The names of its answers.
    pub fn results(self) -> &'static [&'static str] {
        match self {
            Self::Omega => &["omega"],
            Self::Gradient => &["omega", "gx", "gy", "gz"],
            Self::Sign => &["sign"],
            Self::Distance => &["distance"],
        }
    }

    /// What it is, for comments.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Omega => "omega at a point",
            Self::Gradient => "omega and its gradient; the outward normal is -gradient/|gradient|",
            Self::Sign => "1 inside, 0 on the surface, -1 outside: exactly the logic of the parts",
            Self::Distance => {
                "distance from the surface, positive outside: accurate near a face, an estimate far away, and 0 \
                 where no derivative tells anything; too small by up to 1 - sin(a/2) of it before an edge of the angle a \
                 (29 % at a right angle, more at an acute one), and by more before a corner (42 % at that of a box); at an \
                 axis and on a crease of the formula it may be far off, where rfm itself compares it with signs"
            }
        }
    }

    fn kind(self) -> ProgramKind {
        match self {
            Self::Omega => ProgramKind::Value,
            Self::Gradient => ProgramKind::Gradient,
            Self::Sign => ProgramKind::Sign,
            Self::Distance => ProgramKind::Contact,
        }
    }
}

/// The graph that answers a question.
pub(super) struct Program {
    pub question: Question,
    pub graph: Graph,
    pub outputs: Vec<Node>,
    forms: [Forms; 2],
    /// The numbers that the graph takes as uniforms, as formulas of time and params.
    pub uniforms: Option<(Graph, Vec<Node>)>,
}

impl Program {
    /// The programs that the options ask for.
    pub fn of(solid: &Solid, options: &Options) -> Vec<Self> {
        let optional = [(Question::Sign, options.sign), (Question::Distance, options.distance)];
        let asked = optional.into_iter().filter(|(_, asked)| *asked).map(|(question, _)| question);
        [Question::Omega, Question::Gradient].into_iter().chain(asked).map(|q| Self::new(solid, q)).collect()
    }

    fn new(solid: &Solid, question: Question) -> Self {
        let kind = question.kind();
        let (graph, outputs) = solid.graph(kind);
        let mut graph = graph.clone();
        let outputs = match question {
            Question::Omega | Question::Gradient => outputs.to_vec(),
            // the program itself gives a number of that sign
            Question::Sign => outputs.iter().map(|&output| graph.unary(Unary::Sign, output)).collect(),
            Question::Distance => outputs[..1].to_vec(),
        };
        let forms = [Precision::F64, Precision::F32].map(|precision| solid.forms(kind, precision).clone());
        let uniforms = solid.uniform_formulas(kind).map(|(graph, roots)| (graph.clone(), roots.to_vec()));
        Self { question, graph, outputs, forms, uniforms }
    }

    /// How R₀ is evaluated in a precision.
    pub fn forms(&self, precision: Precision) -> &Forms {
        match precision {
            Precision::F64 => &self.forms[0],
            Precision::F32 => &self.forms[1],
        }
    }

    /// How many numbers the graph takes as uniforms.
    pub fn uniform_count(&self) -> usize {
        self.uniforms.as_ref().map_or(0, |(_, roots)| roots.len())
    }

    /// The numbers of the params that it depends on: they are all in the formulas of its uniforms.
    pub fn parameters(&self) -> Vec<u32> {
        let Some((graph, roots)) = &self.uniforms else { return Vec::new() };
        roots.iter().flat_map(|&root| graph.parameters(root)).collect()
    }

    /// How many nodes it computes.
    pub fn operations(&self) -> usize {
        self.graph.reachable(&self.outputs).into_iter().filter(|&used| used).count()
    }
}
