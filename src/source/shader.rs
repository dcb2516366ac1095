//! Files for shaders: functions of a point in WGSL and GLSL ES 3.0, in `f32`.

use std::collections::BTreeSet;

use super::language::{self, Language};
use super::operations::{Names, Operation, WEIGHTED_FIELDS};
use super::program::{Program, Question};
use super::statements::{Own, Part, Statements, Writer};
use super::{File, Math, OpenParam, PARAMS, SourceError};
use crate::ir::Forms;
use crate::precision::Precision;

/// What the shader languages do not share with the others.
pub(super) struct Shader {
    language: &'static Language,
    /// The type of the result of a program with four outputs, and of a point.
    vectors: [&'static str; 2],
    /// A parameter of a function: type, name.
    parameter: fn(&str, &str) -> String,
    /// A function: type of its result, name, parameters.
    head: fn(&str, &str, &str) -> String,
    /// A structure with a line for each field and what is said of it.
    params: Structure,
}

/// A structure: its name, and the name and the comment of each field → lines.
type Structure = fn(&str, &[(String, String)]) -> Vec<String>;

pub(super) static WGSL: Shader = Shader {
    language: &language::WGSL,
    vectors: ["vec4<f32>", "vec3<f32>"],
    parameter: |kind, name| format!("{name}: {kind}"),
    head: |result, name, parameters| format!("fn {name}({parameters}) -> {result} {{"),
    params: |name, fields| {
        let mut lines = vec![format!("struct {name} {{")];
        lines.extend(fields.iter().map(|(field, doc)| format!("    {field}: f32, // {doc}")));
        lines.push("}".into());
        lines
    },
};

pub(super) static GLSL: Shader = Shader {
    language: &language::GLSL,
    vectors: ["vec4", "vec3"],
    parameter: |kind, name| format!("{kind} {name}"),
    head: |result, name, parameters| format!("{result} {name}({parameters}) {{"),
    params: |name, fields| {
        let mut lines = vec![format!("struct {name} {{")];
        lines.extend(fields.iter().map(|(field, doc)| format!("    float {field}; // {doc}")));
        lines.push("};".into());
        lines
    },
};

const PRECISION: Precision = Precision::F32;

/// The functions of a file.
pub(super) fn source(file: &File<'_>, shader: &Shader) -> Result<String, SourceError> {
    let names = Names { prefix: file.prefix };
    let mut lines: Vec<String> = file.title().iter().map(|line| format!("// {line}")).collect();
    lines.push("//".into());
    lines.push("// Everything is computed in f32: beyond seven digits, and in its last bits, it is not what rfm computes.".into());
    lines.extend(params(file, shader));
    let mut operations = BTreeSet::new();
    let mut functions = Vec::new();
    for program in file.programs {
        functions.extend(function(file, shader, program, &mut operations)?);
    }
    let Shader { language, .. } = shader;
    let number = language.number(PRECISION);
    lines.push(String::new());
    lines.push((language.pick)(number, &names.pick(language, PRECISION)));
    if operations.iter().any(|operation| matches!(operation, Operation::Weighted(..))) {
        lines.extend((language.structure)(&names.joint(language, PRECISION), number, &WEIGHTED_FIELDS));
    }
    for operation in operations {
        lines.push(String::new());
        lines.extend(operation.definition(language, PRECISION, &names));
    }
    lines.extend(functions);
    Ok(lines.join("\n") + "\n")
}

/// The structure of params; shaders have no constants of such a type that all of them could start from, so their
/// values stand in comments.
fn params(file: &File<'_>, shader: &Shader) -> Vec<String> {
    if file.params.is_empty() {
        return Vec::new();
    }
    let described = |OpenParam { field, param, .. }: &OpenParam<'_>| {
        let doc = param.doc.as_ref().map_or(String::new(), |doc| format!(": {doc}"));
        (field.clone(), format!("{} = {:?}{doc}", param.name, param.value))
    };
    let fields: Vec<_> = file.params.iter().map(described).collect();
    let mut lines = vec![
        String::new(),
        format!("// {PARAMS}"),
        "// Here they have the values that the file gives them.".into(),
    ];
    lines.extend((shader.params)(&format!("{}_params", file.prefix), &fields));
    lines
}

fn function(
    file: &File<'_>,
    shader: &Shader,
    program: &Program,
    operations: &mut BTreeSet<Operation>,
) -> Result<Vec<String>, SourceError> {
    let names = Names { prefix: file.prefix };
    let Shader { language, vectors: [vec4, _], .. } = shader;
    let number = language.number(PRECISION);
    let parameter = |i: u32| format!("params.{}", file.field(i));
    let uniform_names = |i: u32| format!("u{i}");
    let writer = Writer {
        language,
        precision: PRECISION,
        names: &names,
        math: Math::System,
        axes: ["p.x", "p.y", "p.z", "t"],
        parameter: &parameter,
        uniform: &uniform_names,
        gathered: None,
        values: "v",
        own: Own::Shaders,
    };
    let Program { graph, outputs, question, .. } = program;
    let part = Part { graph, inputs: &[], outputs, forms: program.forms(PRECISION) };
    let Statements { lines: statements, outputs, operations: called, .. } = writer.statements(&part)?;
    operations.extend(called);

    let arguments = arguments(file, shader);
    let result = if *question == Question::Gradient { vec4 } else { number };
    let name = format!("{}_{}", file.prefix, question.name());
    let mut lines = vec![String::new()];
    lines.push(format!(
        "// {}{}",
        question.meaning(),
        if *question == Question::Gradient { ": (gradient, omega)" } else { "" }
    ));
    lines.push((shader.head)(result, &name, &arguments.join(", ")));
    let (hoisted, called) = hoisted(program, &writer)?;
    lines.extend(hoisted);
    operations.extend(called);
    lines.extend(statements.iter().map(|line| format!("    {line}")));
    lines.push(match question {
        Question::Gradient => {
            format!("    return {vec4}({}, {}, {}, {});", outputs[1], outputs[2], outputs[3], outputs[0])
        }
        Question::Omega | Question::Sign | Question::Distance => format!("    return {};", outputs[0]),
    });
    lines.push("}".into());
    Ok(lines)
}

/// The numbers that depend on time and params alone, and the functions of the file that they call.
pub(super) fn hoisted(
    program: &Program,
    writer: &Writer<'_>,
) -> Result<(Vec<String>, BTreeSet<Operation>), SourceError> {
    let Some((graph, roots)) = &program.uniforms else { return Ok(Default::default()) };
    let (forms, number) = (Forms::default(), writer.language.number(PRECISION));
    let writer = Writer { values: "s", ..*writer };
    let made = writer.statements(&Part { graph, inputs: &[], outputs: roots, forms: &forms })?;
    let mut lines = vec!["    // what depends on time and params alone".to_string()];
    lines.extend(made.lines.iter().map(|line| format!("    {line}")));
    let values = made.outputs.iter().enumerate();
    let declared = |(i, text): (usize, &String)| (writer.language.declare)(number, &format!("u{i}"), text);
    lines.extend(values.map(|value| format!("    {}", declared(value))));
    Ok((lines, made.operations))
}

/// The parameters of every function: the point, the time of a solid that moves, open params.
pub(super) fn arguments(file: &File<'_>, shader: &Shader) -> Vec<String> {
    let mut arguments = vec![(shader.parameter)(shader.vectors[1], "p")];
    if file.moves {
        arguments.push((shader.parameter)(shader.language.number(PRECISION), "t"));
    }
    if !file.params.is_empty() {
        arguments.push((shader.parameter)(&format!("{}_params", file.prefix), "params"));
    }
    arguments
}
