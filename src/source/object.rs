//! A solid as object code: the functions that a C file would have, and their header.

use super::c_header::object_header;
use super::c_linkage::{columns_name, function_name};
use super::language::C;
use super::program::Program;
use super::{File, Math, Options, SourceError, in_file};
use crate::codegen::{
    self, CodegenError, Entry, EntryPrograms, Forms, Library, ObjectProgram, Request, Shape,
};
use crate::ir::{Axis, Expr, Graph, Node};
use crate::precision::Precision;
use crate::solid::Solid;

/// An object file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Object {
    /// The file, in the format of the machine's linker.
    pub bytes: Vec<u8>,
    /// The header in C that declares its functions.
    pub header: String,
    /// How many operations the largest function has.
    pub operations: usize,
}

/// Why there is no object file.
#[derive(Debug, Clone)]
pub enum ObjectError {
    /// The names or numbers do not fit.
    Source(SourceError),
    /// The code generator has no such machine.
    Codegen(CodegenError),
}

impl std::fmt::Display for ObjectError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Source(error) => error.fmt(f),
            Self::Codegen(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for ObjectError {}

/// Compiles a solid into an object file: for this machine, or for another one with the same kind of processor, named
/// by its triple as in `x86_64-apple-darwin`.
///
/// # Errors
/// If the prefix does not fit, or if there is no code generator for the machine.
pub fn object(solid: &Solid, options: &Options, triple: Option<&str>) -> Result<Object, ObjectError> {
    in_file(solid, false, options, |file| {
        let uniforms: Vec<Option<(Graph, Vec<Node>)>> =
            file.programs.iter().map(|program| time_as_x(file, program)).collect();
        let no_forms = Forms::default();
        let (mut programs, mut entries) = (Vec::new(), Vec::new());
        for (program, uniforms) in file.programs.iter().zip(&uniforms) {
            if let Some((graph, roots)) = uniforms {
                let request = Request {
                    graph,
                    inputs: &[],
                    outputs: roots,
                    precision: Precision::F64,
                    shape: Shape::Point,
                    forms: &no_forms,
                    parameters: !file.params.is_empty(),
                    uniforms: false,
                };
                programs.push(ObjectProgram { symbol: raw_uniforms(file, program), request });
            }
            for &precision in file.precisions {
                for shape in [Shape::Point, Shape::Batch] {
                    let request = Request {
                        graph: &program.graph,
                        inputs: &[],
                        outputs: &program.outputs,
                        precision,
                        shape,
                        forms: program.forms(precision),
                        parameters: false,
                        uniforms: program.uniforms.is_some(),
                    };
                    let blocks = shape == Shape::Batch;
                    let symbol = raw_name(file, program, precision, blocks);
                    programs.push(ObjectProgram { symbol, request });
                }
                entries.push(entry(file, program, precision));
            }
        }
        let library = match file.options.math {
            Math::System => Library::System,
            Math::Rfm => Library::Rfm,
        };
        let bytes = codegen::object(&programs, &entries, library, triple).map_err(ObjectError::Codegen)?;
        let operations = file.programs.iter().map(Program::operations).max().unwrap_or(0);
        Ok(Object { bytes, header: object_header(file), operations })
    })
    .map_err(ObjectError::Source)?
}

/// The name of the machine code of a program in an object file: for one point, or for blocks of points.
fn raw_name(file: &File<'_>, program: &Program, precision: Precision, blocks: bool) -> String {
    let blocks = if blocks { "_blocks" } else { "" };
    format!("{}_raw_{}{blocks}{}", file.prefix, program.question.name(), C.suffix(precision))
}

/// The name of the machine code that finds what depends on time and params alone.
fn raw_uniforms(file: &File<'_>, program: &Program) -> String {
    format!("{}_raw_uniforms_{}", file.prefix, program.question.name())
}

/// The functions that others call, over the machine code of a program.
fn entry(file: &File<'_>, program: &Program, precision: Precision) -> Entry {
    let uniforms = program.uniforms.is_some().then(|| (raw_uniforms(file, program), program.uniform_count()));
    let [point, blocks] = [false, true].map(|blocks| raw_name(file, program, precision, blocks));
    Entry {
        point: function_name(file, program.question, precision),
        columns: columns_name(file, program.question, precision),
        precision,
        results: program.question.results().len(),
        moves: file.moves,
        params: !file.params.is_empty(),
        programs: EntryPrograms { point, blocks, uniforms },
    }
}

/// The formulas of a program's uniforms as a program of its own: time stands in the place of x, and the params are
/// numbered as they stand in their structure.
fn time_as_x(file: &File<'_>, program: &Program) -> Option<(Graph, Vec<Node>)> {
    let (graph, roots) = program.uniforms.as_ref()?;
    let mut out = Graph::like(graph);
    let mut image: Vec<Node> = Vec::with_capacity(graph.len());
    for (node, expr) in graph.nodes() {
        let new = match expr {
            Expr::Coordinate(Axis::T) => Expr::Coordinate(Axis::X),
            Expr::Parameter(number) => {
                let place = file.params.iter().position(|open| open.number == number).unwrap_or(0);
                Expr::Parameter(place as u32)
            }
            other => other.map(|operand| image[operand.index()]),
        };
        image.push(out.intern(new, graph.span(node)));
    }
    let roots = roots.iter().map(|root| image[root.index()]).collect();
    Some((out, roots))
}
