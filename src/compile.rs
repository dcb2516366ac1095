//! The driver of the compiler: from the text of a file to its solids and scenes. Every stage can be
//! inspected.
//!
//! ```
//! use rfm::{Program, glam::DVec3};
//!
//! let program = Program::from_source("post.rfm", "rfm 1\nparam r = 0.5\nsolid post = cylinder(r, h = 2)")?;
//! let post = program.with("r", 0.25)?.solid("post")?;
//! let (omega, gradient) = post.omega_grad(DVec3::new(0.25, 0.0, 1.0));
//! assert_eq!(omega, 0.0);
//! assert_eq!(-gradient.normalize(), DVec3::X); // the outward normal
//! # Ok::<(), rfm::Error>(())
//! ```

mod folder;
mod imports;

use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::path::Path;
use std::sync::Arc;

use crate::diagnostic::{Code, Diagnostic, Diagnostics, Label, Severity, Source, SourceId, Span, nearest};
use crate::geom::{Aabb, to_thousandths};
use crate::ir::Node;
use crate::lower::{self, Imported};
use crate::quantity::Dimension;
use crate::solid::{Bounds, Chosen, Engine, Solid};
use crate::sph::Method;
use crate::syntax::{self, Ast};

#[doc(inline)]
pub use crate::codegen::CodegenError;
#[doc(inline)]
pub use crate::lower::{
    AskedMean, Bounce, Container, Fluid, Gravity, Module, NamedSolid, Obstacle, OpenParams, Opening, Options,
    ParamValue, Picture, Run, Scene, SceneProbe, Skin, Solver, Tolerance, Truth,
};
pub use folder::files_beside;
#[doc(hidden)]
pub use folder::text_of;

/// Why a file, a solid or a scene cannot be used.
#[derive(Debug)]
pub enum Error {
    /// The file could not be read.
    File {
        /// The path as the caller gave it.
        path: String,
        /// The error of the file system.
        error: std::io::Error,
    },
    /// The file has mistakes. They print as the compiler's own messages.
    Diagnostics(Diagnostics),
    /// The file has no solid or scene of this name.
    UnknownName {
        /// What was asked for: `solid` or `scene`.
        kind: &'static str,
        /// The name that was asked for.
        name: String,
        /// The names that the file has.
        known: Vec<String>,
    },
    /// Machine code could not be made, and the interpreter was not allowed.
    Codegen(CodegenError),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File { path, error } => write!(f, "cannot read `{path}`: {error}"),
            Self::Diagnostics(diagnostics) => diagnostics.fmt(f),
            Self::UnknownName { kind, name, known } => {
                write!(f, "the file has no {kind} `{name}`")?;
                match nearest(name, known.iter().map(String::as_str)) {
                    Some(near) => write!(f, "; did you mean `{near}`?"),
                    None if known.is_empty() => write!(f, "; it defines none"),
                    None => write!(f, "; it has {}", known.join(", ")),
                }
            }
            Self::Codegen(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::File { error, .. } => Some(error),
            Self::Codegen(error) => Some(error),
            Self::Diagnostics(_) | Self::UnknownName { .. } => None,
        }
    }
}

impl From<CodegenError> for Error {
    fn from(error: CodegenError) -> Self {
        Self::Codegen(error)
    }
}

/// A checked file: its solids can be compiled and its scenes read.
#[derive(Debug, Clone)]
pub struct Program {
    sources: Arc<[Source]>,
    texts: Arc<Texts>,
    options: Options,
    module: Arc<Module>,
    warnings: Vec<Diagnostic>,
}

/// The file and all that it imports, read and parsed.
#[derive(Debug)]
struct Texts {
    ast: Ast,
    imported: Vec<Imported>,
    /// Where each of them is first imported.
    places: HashMap<SourceId, Span>,
    messages: Vec<Diagnostic>,
}

impl Program {
    /// Reads and checks a file. It may name others in its folder and below.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be read as UTF-8 text, [`Error::Diagnostics`] if it has mistakes.
    pub fn from_path(path: impl AsRef<Path>) -> Result<Self, Error> {
        let name = path.as_ref().display().to_string();
        let text = std::fs::read(path.as_ref())
            .and_then(text_of)
            .map_err(|error| Error::File { path: name.clone(), error })?;
        let files = files_beside(path, false);
        Self::check(Source::file(name, text), Options { files, ..Options::default() })
            .map_err(Error::Diagnostics)
    }

    /// Checks a text. Its messages show `name` in place of a path. It may not name other files, see
    /// [`Program::from_source_with`].
    ///
    /// # Errors
    /// [`Error::Diagnostics`] if the text has mistakes.
    pub fn from_source(name: impl Into<Arc<str>>, text: impl Into<Arc<str>>) -> Result<Self, Error> {
        Self::check(Source::file(name, text), Options::default()).map_err(Error::Diagnostics)
    }

    /// Checks a text that may name other files: those of a folder ([`files_beside`]), or texts in memory
    /// ([`Files`](crate::files::Files)).
    ///
    /// ```
    /// use rfm::{Program, files::Files};
    ///
    /// let files = Files::from_memory([("parts.rfm", "rfm 1\nsolid peg = cylinder(0.1, h = 1)")]);
    /// let text = "rfm 1\nimport \"parts.rfm\" as parts\nsolid board = box([-1, -1, -0.1], [1, 1, 0]) or parts.peg";
    /// let program = Program::from_source_with("board.rfm", text, files)?;
    /// assert_eq!(program.solids().collect::<Vec<_>>(), ["board"]);
    /// # Ok::<(), rfm::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Diagnostics`] if the text has mistakes.
    pub fn from_source_with(
        name: impl Into<Arc<str>>,
        text: impl Into<Arc<str>>,
        files: crate::files::Files,
    ) -> Result<Self, Error> {
        let options = Options { files, ..Options::default() };
        Self::check(Source::file(name, text), options).map_err(Error::Diagnostics)
    }

    /// Checks a text with the overrides of params and the limits that `options` state.
    ///
    /// # Errors
    /// All messages, warnings included, if at least one of them is an error.
    pub fn check(source: Source, options: Options) -> Result<Self, Diagnostics> {
        let (ast, mut messages) = syntax::parse(&source);
        let imports::Imports { files: imported, messages: of_imports, places } =
            imports::imports(&source, &ast, &options.files);
        messages.extend(of_imports);
        let mut sources = vec![source, lower::prelude_source()];
        sources.extend(imported.iter().map(|file| file.source.clone()));
        let texts = Texts { ast, imported, places, messages };
        Self::lowered(sources.into(), Arc::new(texts), options)
    }

    fn lowered(sources: Arc<[Source]>, texts: Arc<Texts>, options: Options) -> Result<Self, Diagnostics> {
        let mut list = texts.messages.clone();
        let broken = list.iter().any(|d| d.severity == Severity::Error);
        let (module, messages) = lower::lower((&sources[0].name, &texts.ast), &texts.imported, &options);
        // names of items that do not parse are missing: what follows from that would mislead
        let follows = |d: &Diagnostic| {
            [Code::UNKNOWN_NAME, Code::OVERRIDE, Code::UNUSED, Code::SCENE_MISSING].contains(&d.code)
        };
        list.extend(messages.into_iter().filter(|d| !(broken && follows(d))));
        for message in &mut list {
            if let Some(&place) = texts.places.get(&message.primary.span.source) {
                message.secondary.push(Label { span: place, text: "imported here".into() });
            }
        }
        if list.iter().any(|d| d.severity == Severity::Error) {
            return Err(Diagnostics { list, sources });
        }
        Ok(Self { sources, texts, options, module: Arc::new(module), warnings: list })
    }

    /// Checks the same file again with another value, in SI units, for one of its params.
    ///
    /// # Errors
    /// [`Error::Diagnostics`] if the file declares no such param, or if the value makes it wrong.
    pub fn with(&self, param: &str, value: f64) -> Result<Self, Error> {
        self.with_quantities([(param, value, None)])
    }

    /// [`with`](Self::with) for several params at once: the file is checked with all of them, and may be wrong with some of
    /// them only, as one with a range `m..n` is on the way from 1..2 to 5..6. A value in SI units may have been given with
    /// a unit of some dimension.
    ///
    /// # Errors
    /// [`Error::Diagnostics`] if the file lacks one of the params, if a dimension is not that of the file, or if the values
    /// make the file wrong.
    pub fn with_quantities<'a>(
        &self,
        quantities: impl IntoIterator<Item = (&'a str, f64, Option<Dimension>)>,
    ) -> Result<Self, Error> {
        let mut options = self.options.clone();
        for (param, value, dimension) in quantities {
            // a program gives numbers in SI units, whatever the file writes
            let declared = self.module.params.iter().find(|declared| declared.name == param);
            let unit = declared.and_then(|declared| declared.unit.as_ref());
            options.overrides.insert(param.to_string(), value);
            match dimension.or(unit.map(|(unit, _)| unit.dimension)) {
                Some(dimension) => options.dimensions.insert(param.to_string(), dimension),
                None => options.dimensions.remove(param),
            };
        }
        self.lowered_again(options)
    }

    /// Checks the same file again with one method for all its scenes, in place of the methods that they
    /// state. Keys that only the stated method has are left out.
    ///
    /// # Errors
    /// [`Error::Diagnostics`] if the method makes the file wrong.
    pub fn with_method(&self, method: Method) -> Result<Self, Error> {
        self.lowered_again(Options { method: Some(method), ..self.options.clone() })
    }

    /// Checks the same file again with open params: its solids have them as arguments, and cannot be evaluated. They
    /// are for [`source`](crate::source). Params that decide how a solid is built, such as the length of a range,
    /// remain constants; their names come second. There are no scenes.
    ///
    /// # Errors
    /// None that the file does not have with constant params.
    pub fn with_open_params(&self) -> Result<(Self, Vec<String>), Error> {
        self.opened(OpenParams::default())
    }

    /// As [`with_open_params`](Self::with_open_params), for some solids of the file, which are then its only ones
    /// besides those that they are made of: a param that decides how another solid is built stays open.
    ///
    /// # Errors
    /// None that the file does not have with constant params.
    pub fn with_open_params_of<'a>(
        &self,
        solids: impl IntoIterator<Item = &'a str>,
    ) -> Result<(Self, Vec<String>), Error> {
        let solids = solids.into_iter().map(str::to_string).collect();
        self.opened(OpenParams { solids: Some(solids), ..OpenParams::default() })
    }

    fn opened(&self, mut open: OpenParams) -> Result<(Self, Vec<String>), Error> {
        loop {
            let again = self.lowered_again(Options { open: Some(open.clone()), ..self.options.clone() })?;
            let names = again.module.fixed.iter().map(|&i| again.module.params[i as usize].name.clone());
            let known = open.fixed.len();
            open.fixed.extend(names);
            // one that is fixed may show another one that must be
            if open.fixed.len() == known {
                return Ok((again, open.fixed.into_iter().collect()));
            }
        }
    }

    fn lowered_again(&self, options: Options) -> Result<Self, Error> {
        Self::lowered(self.sources.clone(), self.texts.clone(), options).map_err(Error::Diagnostics)
    }

    /// Names of the solids, in the order of the file.
    pub fn solids(&self) -> impl Iterator<Item = &str> {
        self.module.solids.iter().map(|solid| &*solid.name)
    }

    /// Names of the scenes, in the order of the file.
    pub fn scenes(&self) -> impl Iterator<Item = &str> {
        self.module.scenes.iter().map(|scene| &*scene.name)
    }

    /// The params, in the order of the file, with the values that they have now.
    pub fn params(&self) -> &[ParamValue] {
        &self.module.params
    }

    /// The params that were set, with their values. Params with the value of the file are not among them.
    pub fn overrides(&self) -> &BTreeMap<String, f64> {
        &self.options.overrides
    }

    /// Compiles a solid by its name, with the engine [`Engine::Auto`].
    ///
    /// # Errors
    /// [`Error::UnknownName`] if the file has no such solid.
    pub fn solid(&self, name: &str) -> Result<Solid, Error> {
        self.solid_with(name, Engine::Auto)
    }

    /// Compiles a solid by its name for an engine.
    ///
    /// # Errors
    /// [`Error::UnknownName`] if the file has no such solid, [`Error::Codegen`] if the engine is not
    /// available.
    pub fn solid_with(&self, name: &str, engine: Engine) -> Result<Solid, Error> {
        let found = self.module.solids.iter().find(|solid| solid.name == name);
        let Some(solid) = found else {
            let known = self.module.solids.iter().map(|solid| solid.name.clone()).collect();
            return Err(Error::UnknownName { kind: "solid", name: name.into(), known });
        };
        self.compile(&solid.name, solid.node, engine)
    }

    /// The scene with this name, as data.
    ///
    /// # Errors
    /// [`Error::UnknownName`] if the file has no such scene.
    pub fn scene(&self, name: &str) -> Result<&Scene, Error> {
        let found = self.module.scenes.iter().find(|scene| scene.name == name);
        found.ok_or_else(|| {
            let known = self.module.scenes.iter().map(|scene| scene.name.clone()).collect();
            Error::UnknownName { kind: "scene", name: name.into(), known }
        })
    }

    /// Compiles any node of the file's graph, such as the shape of a scene's fluid.
    ///
    /// `shape` must come from the [`module`](Self::module) of this same program: after [`with`](Self::with)
    /// the same node stands for another expression.
    ///
    /// # Errors
    /// [`Error::Codegen`] if the engine is not available.
    pub fn compile(&self, name: &str, shape: Node, engine: Engine) -> Result<Solid, Error> {
        Ok(Solid::new(name, &self.module.graph, shape, engine)?)
    }

    /// The box in which a solid is plotted and judged. It is the box of the first scene with the solid as an
    /// obstacle, or else of the only scene. Without such a scene it is the solid's bounds, grown on all sides
    /// by half their longest side. `None` if there is no such scene and the solid has no bounds.
    pub fn domain(&self, solid: &Solid) -> Option<Aabb> {
        let scenes = &self.module.scenes;
        let used = scenes.iter().find(|scene| scene.obstacles.iter().any(|o| o.name == solid.name()));
        let only = if let [only] = &scenes[..] { Some(only) } else { None };
        match used.or(only) {
            Some(scene) => Some(scene.domain),
            None => solid.bounds().aabb().map(|bounds| bounds.grown(0.5 * bounds.size().max_element())),
        }
    }

    /// The tolerance that the file states for the solid with this name: its own, or else that of the first
    /// scene with it as an obstacle; `None` if there is neither.
    pub fn tolerance(&self, solid: &str) -> Option<Tolerance> {
        let named = self.module.solids.iter().find(|named| named.name == solid);
        let uses = |scene: &&Scene| scene.obstacles.iter().any(|o| o.name == solid);
        let of_scene = || self.module.scenes.iter().find(uses).and_then(|scene| scene.tolerance);
        named.and_then(|named| named.tolerance).or_else(of_scene)
    }

    /// The cheapest program that keeps the tolerance of a solid in its [`domain`](Self::domain); `None` if
    /// the file states no tolerance for the solid, or if the solid is empty.
    ///
    /// # Errors
    /// A message if no program is certified to keep the tolerance.
    pub fn within_tolerance(&self, solid: &Solid) -> Option<Result<Chosen, Box<Diagnostic>>> {
        let tolerance = self.tolerance(solid.name())?;
        let refused = |help: String| {
            let message = format!(
                "no program of `{}` is certified to keep the tolerance {:e}",
                solid.name(),
                tolerance.value
            );
            Some(Err(Box::new(Diagnostic::error(Code::TOLERANCE, tolerance.span, message).help(help))))
        };
        let Some(over) = self.domain(solid) else {
            let why = "the solid has no bounds and the file no scene: there is no box to keep it in";
            return if *solid.bounds() == Bounds::Empty { None } else { refused(why.into()) };
        };
        match solid.within(tolerance.value, over) {
            Ok(chosen) => Some(Ok(chosen)),
            Err(best) if best.bound.is_finite() => refused(format!(
                "the smallest bound of the error in {:.3} … {:.3} is {:.1e}, by {}",
                to_thousandths(over.min),
                to_thousandths(over.max),
                best.bound,
                best.variant.name()
            )),
            Err(_) => refused(format!(
                "no bound of the error is known in {:.3} … {:.3}",
                to_thousandths(over.min),
                to_thousandths(over.max)
            )),
        }
    }

    /// What the file defines, with its places there: the graph of all expressions, params, solids and scenes.
    /// If you need only names, use [`solids`](Self::solids), [`params`](Self::params) and
    /// [`scenes`](Self::scenes).
    pub fn module(&self) -> &Module {
        &self.module
    }

    /// The syntax tree of the text.
    pub fn ast(&self) -> &Ast {
        &self.texts.ast
    }

    /// The texts that spans point into: the file and the standard solids.
    pub fn sources(&self) -> &Arc<[Source]> {
        &self.sources
    }

    /// The other files that the file names, and those that they name.
    pub fn files(&self) -> &crate::files::Files {
        &self.options.files
    }

    /// Messages that do not prevent the use of the file.
    pub fn warnings(&self) -> Diagnostics {
        Diagnostics { list: self.warnings.clone(), sources: self.sources.clone() }
    }
}
