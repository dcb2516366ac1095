//! Names of other files: `chess.pawn`, `chess.rook(3)`; and files that are read as tables.

use std::sync::Arc;

use super::lowering::Lowering;
use super::names::Kind;
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, Source, SourceId, Span, nearest};
use crate::files::Files;
use crate::ir::{Axis, Expr as Operation, Lookup, Part};
use crate::quantity::parse_unit;
use crate::syntax::Ast;
use crate::syntax::ast::{Argument, Expr, ExprKind, Import, Name};
use crate::table::Table;
use crate::triangles::{self, TriangleSolid};

/// A file that others import, read and parsed.
#[derive(Debug, Clone)]
pub struct Imported {
    /// Its text. Its name is the one by which [`Files`] knows it.
    pub source: Source,
    /// Its items.
    pub ast: Ast,
    /// The name in front of its params, as in `chess.height`.
    pub qualified: String,
}

impl<'a> Lowering<'a> {
    /// Defines the name of an import. One that could not be read was reported when it was looked for.
    pub fn import(&mut self, import: &'a Import) {
        if !self.may_define(&import.name) {
            return;
        }
        let name = Files::name(&import.path, self.name_of(self.scope.source));
        let found = self.imported.iter().find(|(known, _)| **known == *name).map(|&(_, id)| id);
        let kind = found.map_or(Kind::Value(Value::Failed), Kind::Import);
        self.names.define(self.scope.source, &import.name, kind);
    }

    /// The name of the text of a source.
    fn name_of(&self, source: SourceId) -> &str {
        let imported = self.imported.iter().find(|&&(_, id)| id == source);
        imported.map_or(&self.file_name, |(name, _)| name)
    }

    /// The file that an expression names, and the name.
    pub fn import_of<'e>(&mut self, expr: &'e Expr) -> Option<(&'e str, SourceId)> {
        let ExprKind::Name(name) = &expr.kind else { return None };
        if self.scope.locals.iter().any(|local| local.name == *name) {
            return None;
        }
        Some((name, self.names.import(self.scope.source, name)?))
    }

    /// Whether an expression is the name of an item that failed, which was reported: an import that cannot be read.
    pub fn has_failed(&self, expr: &Expr) -> bool {
        let ExprKind::Name(name) = &expr.kind else { return false };
        let is_local = self.scope.locals.iter().any(|local| local.name == *name);
        let global = self.names.of(self.scope.source, name).map(|global| &global.kind);
        !is_local && matches!(global, Some(Kind::Value(Value::Failed)))
    }

    /// `chess.pawn`
    pub fn member(&mut self, of: &Expr, name: &Name) -> Value {
        let Some((file, source)) = self.import_of(of) else {
            if let Some(foreign) = self.value_of_a_module(of, name) {
                return self.fail(foreign);
            }
            let value = self.expr(of);
            if value == Value::Failed {
                return Value::Failed;
            }
            let message = format!("{} has no part `{}`", value.describe(), name.text);
            let diagnostic = Diagnostic::error(Code::WRONG_TYPE, name.span, message);
            if let ExprKind::Quantity { unit, .. } = &of.kind
                && parse_unit(&name.text).is_some()
            {
                let units = format!("the parts of a unit are joined by `·`: `{}·{}`", unit.text, name.text);
                return self.fail(diagnostic.help(format!("{units}; a viscosity may also be in `kg/m/s`")));
            }
            if self.is_shape(of) {
                let methods = super::vocabulary::methods().map(|(method, _)| method);
                let near = nearest(&name.text, methods).unwrap_or("move");
                let message = format!("a shape has no part `{}`", name.text);
                let help = format!("a method is called with brackets: `.{near}(…)`");
                return self.fail(Diagnostic::error(Code::WRONG_TYPE, name.span, message).help(help));
            }
            return self.fail(match value {
                Value::Vector(_) | Value::List(_) => diagnostic.help("a vector has .x, .y and .z"),
                Value::Number(_) | Value::Text(_) | Value::Failed => {
                    diagnostic.help(format!("a method is called with brackets: `.{}(…)`", name.text))
                }
            });
        };
        match self.names.of(source, &name.text).map(|global| global.kind.clone()) {
            Some(Kind::Value(value) | Kind::Solid(value)) => value,
            Some(Kind::Function(_)) => {
                let message = format!("`{file}.{}` is a function", name.text);
                let diagnostic = Diagnostic::error(Code::NOT_A_FUNCTION, name.span, message);
                self.fail(
                    diagnostic.at("used without arguments").help(format!("write `{file}.{}(…)`", name.text)),
                )
            }
            Some(Kind::Scene | Kind::Import(_)) | None => self.not_offered(file, source, name),
        }
    }

    /// `chess.rook(3)`
    pub fn call_imported(
        &mut self,
        (file, source): (&str, SourceId),
        name: &Name,
        arguments: &[Argument],
        span: Span,
    ) -> Value {
        match self.names.of(source, &name.text).map(|global| global.kind.clone()) {
            Some(Kind::Function(function)) => self.call_function(function, source, arguments, span),
            Some(Kind::Value(Value::Failed) | Kind::Solid(Value::Failed)) => Value::Failed,
            Some(Kind::Value(_) | Kind::Solid(_)) => {
                let message = format!("`{file}.{}` is not a function", name.text);
                let diagnostic = Diagnostic::error(Code::NOT_A_FUNCTION, name.span, message).at("a value");
                self.fail(diagnostic.help(format!("write `{file}.{}` without brackets", name.text)))
            }
            Some(Kind::Scene | Kind::Import(_)) | None => self.not_offered(file, source, name),
        }
    }

    /// `chess` alone.
    pub fn file_as_value(&mut self, name: &str, span: Span) -> Value {
        let message = format!("`{name}` is a file, not a value");
        let help = format!("write `{name}.…` with the name of something that it defines");
        self.fail(Diagnostic::error(Code::WRONG_TYPE, span, message).help(help))
    }

    fn not_offered(&mut self, file: &str, source: SourceId, name: &Name) -> Value {
        let offered = self.names.offered(source);
        let message = match self.names.of(source, &name.text).map(|global| &global.kind) {
            Some(Kind::Import(_)) => format!("`{file}` does not hand on its import `{}`", name.text),
            // scenes of other files are not read
            Some(Kind::Scene | Kind::Value(_) | Kind::Solid(_) | Kind::Function(_)) | None => {
                format!("`{file}` has no `{}`", name.text)
            }
        };
        let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, name.span, message);
        let diagnostic = if offered.is_empty() {
            diagnostic.help("it defines nothing that can be used")
        } else {
            diagnostic.help(format!("it has {}", offered.join(", ")))
        };
        self.fail(diagnostic.suggest(&name.text, offered.iter().map(String::as_str)))
    }

    /// `mesh("part.stl")`, or with the length of one of the file's units: `mesh("part.stl", 1 mm)`.
    pub fn mesh(&mut self, values: &[Value], arguments: &[Argument]) -> Value {
        let span = self.user_span(arguments[0].value.span);
        let Some(path) = self.path(&values[0], "mesh(\"part.stl\")", span) else { return Value::Failed };
        let unit = self.factor(values.get(1).zip(arguments.get(1)), "the unit of a mesh");
        let Some(unit) = unit else { return Value::Failed };
        if !(unit > 0.0 && unit.is_finite()) {
            let message = format!("the unit of a mesh must be positive and finite, found {unit}");
            return self.fail(Diagnostic::error(
                Code::OUT_OF_RANGE,
                self.user_span(arguments[1].value.span),
                message,
            ));
        }
        match self.triangles(&path, unit, span) {
            Ok(table) => self.table(&table, span),
            Err(diagnostic) => self.fail(diagnostic),
        }
    }

    /// The constant number that is an argument, 1 if it is left out.
    pub fn factor(&mut self, given: Option<(&Value, &Argument)>, what: &str) -> Option<f64> {
        let Some((value, argument)) = given else { return Some(1.0) };
        let at = argument.value.span;
        let node = self.as_number(value, at)?;
        self.as_constant(node, at, what)
    }

    /// The path that is an argument; anything else is reported.
    pub fn path(&mut self, value: &Value, call: &str, span: Span) -> Option<String> {
        if let Value::Text(path) = value {
            return Some(path.clone());
        }
        let message = format!("expected the path of a file in quotes, found {}", value.describe());
        self.report(Diagnostic::error(Code::WRONG_TYPE, span, message).help(format!("write `{call}`")));
        None
    }

    /// The bytes of a file that the code which is evaluated names.
    pub fn read_file(&self, path: &str, span: Span) -> Result<Arc<[u8]>, Diagnostic> {
        self.files.read(&self.name_of_file(path)).map_err(|error| unread(path, &error, span))
    }

    /// The name of a file that the code which is evaluated names by a path.
    pub fn name_of_file(&self, path: &str) -> String {
        Files::name(path, self.name_of(self.scope.source))
    }

    fn triangles(&self, path: &str, unit: f64, span: Span) -> Result<Arc<dyn Table>, Diagnostic> {
        let name = self.name_of_file(path);
        if !triangles::is_known(path) {
            let read = triangles::FORMATS.join(", .");
            let message = format!("meshes are read from files whose names end in .{read}, not from `{path}`");
            return Err(Diagnostic::error(Code::MESH, span, message)
                .help("save the mesh as STL, OBJ or PLY in the program that it comes from"));
        }
        let bytes = self.read_file(path, span)?;
        let help = match bytes.is_empty() {
            true => "write it once more: the program that it comes from has put nothing into it",
            false => "repair it in the program that it comes from; `rfm explain E0217` says what is needed",
        };
        let refused = |message: String| Diagnostic::error(Code::MESH, span, message).help(help);
        self.files.table(format!("mesh {:x} {name}", unit.to_bits()), || {
            let mut triangles = triangles::read(path, &bytes)
                .map_err(|reason| refused(format!("`{path}` cannot be read as a mesh: {reason}")))?;
            if unit != 1.0 {
                triangles.iter_mut().flatten().for_each(|corner| *corner *= unit);
            }
            let solid = TriangleSolid::new(&triangles)
                .map_err(|reason| refused(format!("`{path}` encloses no solid: {reason}")))?;
            Ok(Arc::new(solid) as Arc<dyn Table>)
        })
    }

    /// The field of a table.
    pub fn table(&mut self, table: &Arc<dyn Table>, span: Span) -> Value {
        let at = Axis::SPACE.map(|axis| self.module.graph.coordinate(axis));
        let lookup = Lookup { table: self.module.graph.table(table), part: Part::Value };
        Value::Number(self.node(Operation::Lookup(lookup, at), span))
    }
}

/// The message about a file that cannot be read.
pub fn unread(path: &str, error: &crate::files::Unread, span: Span) -> Diagnostic {
    use crate::files::Unread;
    let diagnostic = Diagnostic::error(Code::FILE, span, format!("`{path}` cannot be read: {error}"));
    match error {
        Unread::NoReader => diagnostic
            .help("load the file by its path; a program that gives the text sets `Options::files` as well"),
        Unread::Outside => {
            diagnostic.help("move it beside the file, or allow it: --allow-outside on the command line")
        }
        Unread::Failed(_) => {
            let paths = "paths begin at the folder of the file in which they are written";
            let is_bare = std::path::Path::new(path).extension().is_none();
            diagnostic.help(if is_bare { format!("write `{path}.rfm`? {paths}") } else { paths.to_string() })
        }
    }
}
