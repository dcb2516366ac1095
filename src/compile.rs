//! The driver: text → solids and scenes, each stage inspectable.
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

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::sync::Arc;

use crate::codegen::CodegenError;
use crate::diagnostic::{Code, Diagnostic, Diagnostics, Severity, Source, nearest};
use crate::geom::Aabb;
use crate::ir::Node;
use crate::lower::{self, Module, Options, Scene, Tolerance};
use crate::solid::{Bounds, Chosen, Engine, Solid};
use crate::sph::Method;
use crate::syntax::{self, Ast};

/// Why a file gives no solid.
#[derive(Debug)]
pub enum Error {
    /// The file could not be read.
    File {
        /// As it was given.
        path: String,
        /// Why.
        error: std::io::Error,
    },
    /// The file has mistakes; prints as the compiler's own messages.
    Diagnostics(Diagnostics),
    /// The file has no solid or scene of this name.
    UnknownName {
        /// `solid` or `scene`.
        kind: &'static str,
        /// What was asked for.
        name: String,
        /// What the file has instead.
        known: Vec<String>,
    },
    /// No machine code could be made, and the interpreter was not allowed.
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
    ast: Arc<Ast>,
    syntax_messages: Arc<[Diagnostic]>,
    options: Options,
    module: Arc<Module>,
    warnings: Vec<Diagnostic>,
}

impl Program {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// If it cannot be read as UTF-8 text, or has mistakes.
    pub fn from_path(path: impl AsRef<Path>) -> Result<Self, Error> {
        let name = path.as_ref().display().to_string();
        let text = std::fs::read(path.as_ref())
            .and_then(text_of)
            .map_err(|error| Error::File { path: name.clone(), error })?;
        Self::from_source(name, text)
    }

    /// Checks a text; the name stands in its messages.
    ///
    /// # Errors
    /// If the text has mistakes.
    pub fn from_source(name: impl Into<Arc<str>>, text: impl Into<Arc<str>>) -> Result<Self, Error> {
        Self::check(Source::file(name, text), Options::default()).map_err(Error::Diagnostics)
    }

    /// Checks a text with params overridden and limits set.
    ///
    /// # Errors
    /// All messages, warnings included, if one of them is an error.
    pub fn check(source: Source, options: Options) -> Result<Self, Diagnostics> {
        let (ast, syntax_messages) = syntax::parse(&source);
        let sources = Arc::from([source, lower::prelude_source()]);
        Self::lowered(sources, Arc::new(ast), syntax_messages.into(), options)
    }

    fn lowered(
        sources: Arc<[Source]>,
        ast: Arc<Ast>,
        syntax_messages: Arc<[Diagnostic]>,
        options: Options,
    ) -> Result<Self, Diagnostics> {
        let mut list = syntax_messages.to_vec();
        let broken = list.iter().any(|d| d.severity == Severity::Error);
        let (module, messages) = lower::lower(&ast, &options);
        // names of items that do not parse are missing: what follows from that would mislead
        let follows = |d: &Diagnostic| {
            [Code::UNKNOWN_NAME, Code::OVERRIDE, Code::UNUSED, Code::SCENE_MISSING].contains(&d.code)
        };
        list.extend(messages.into_iter().filter(|d| !(broken && follows(d))));
        if list.iter().any(|d| d.severity == Severity::Error) {
            return Err(Diagnostics { list, sources });
        }
        Ok(Self { sources, ast, syntax_messages, options, module: Arc::new(module), warnings: list })
    }

    /// The same file with another value for one of its params.
    ///
    /// # Errors
    /// If the file declares no such param, or the value makes it wrong.
    pub fn with(&self, param: &str, value: f64) -> Result<Self, Error> {
        let mut options = self.options.clone();
        options.overrides.insert(param.to_string(), value);
        self.lowered_again(options)
    }

    /// The same file with all its scenes run by a method, whichever they state.
    ///
    /// # Errors
    /// If a scene has a key that the method does not know.
    pub fn with_method(&self, method: Method) -> Result<Self, Error> {
        self.lowered_again(Options { method: Some(method), ..self.options.clone() })
    }

    fn lowered_again(&self, options: Options) -> Result<Self, Error> {
        Self::lowered(self.sources.clone(), self.ast.clone(), self.syntax_messages.clone(), options)
            .map_err(Error::Diagnostics)
    }

    /// The values of params that were set.
    pub fn overrides(&self) -> &BTreeMap<String, f64> {
        &self.options.overrides
    }

    /// Compiles a solid by name.
    ///
    /// # Errors
    /// If there is no such solid.
    pub fn solid(&self, name: &str) -> Result<Solid, Error> {
        self.solid_with(name, Engine::Auto)
    }

    /// Compiles a solid for an engine.
    ///
    /// # Errors
    /// If there is no such solid, or the engine is not to be had.
    pub fn solid_with(&self, name: &str, engine: Engine) -> Result<Solid, Error> {
        let found = self.module.solids.iter().find(|solid| solid.name == name);
        let Some(solid) = found else {
            let known = self.module.solids.iter().map(|solid| solid.name.clone()).collect();
            return Err(Error::UnknownName { kind: "solid", name: name.into(), known });
        };
        self.compile(&solid.name, solid.node, engine)
    }

    /// A scene by name.
    ///
    /// # Errors
    /// If there is no such scene.
    pub fn scene(&self, name: &str) -> Result<&Scene, Error> {
        let found = self.module.scenes.iter().find(|scene| scene.name == name);
        found.ok_or_else(|| {
            let known = self.module.scenes.iter().map(|scene| scene.name.clone()).collect();
            Error::UnknownName { kind: "scene", name: name.into(), known }
        })
    }

    /// Compiles any shape of the file's graph, such as the shape of a scene's fluid.
    ///
    /// `shape` must come from this very program's [`module`](Self::module): after [`with`](Self::with) a node of
    /// the former program names another expression.
    ///
    /// # Errors
    /// If the engine is not to be had.
    pub fn compile(&self, name: &str, shape: Node, engine: Engine) -> Result<Solid, Error> {
        Ok(Solid::new(name, &self.module.graph, shape, engine)?)
    }

    /// The box in which a solid is looked at: that of the first scene with it as an obstacle, or of the only scene;
    /// without a scene the solid's bounds and half their longest side around them.
    pub fn domain(&self, solid: &Solid) -> Option<Aabb> {
        let scenes = &self.module.scenes;
        let used = scenes.iter().find(|scene| scene.obstacles.iter().any(|o| o.name == solid.name()));
        let only = if let [only] = &scenes[..] { Some(only) } else { None };
        match used.or(only) {
            Some(scene) => Some(scene.domain),
            None => solid.bounds().aabb().map(|bounds| bounds.grown(0.5 * bounds.size().max_element())),
        }
    }

    /// The tolerance that the file states for a solid: its own, or that of the first scene with it as an obstacle.
    pub fn tolerance(&self, solid: &str) -> Option<Tolerance> {
        let named = self.module.solids.iter().find(|named| named.name == solid);
        let uses = |scene: &&Scene| scene.obstacles.iter().any(|o| o.name == solid);
        let of_scene = || self.module.scenes.iter().find(uses).and_then(|scene| scene.tolerance);
        named.and_then(|named| named.tolerance).or_else(of_scene)
    }

    /// The cheapest program that keeps the tolerance of a solid in its [`domain`](Self::domain); nothing if the file
    /// states no tolerance for it, or it is empty.
    ///
    /// # Errors
    /// If no program is certified to keep it.
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
                over.min,
                over.max,
                best.bound,
                best.variant.name()
            )),
            Err(_) => refused(format!("no bound of the error is known in {:.3} … {:.3}", over.min, over.max)),
        }
    }

    /// What the file defines.
    pub fn module(&self) -> &Module {
        &self.module
    }

    /// The syntax tree, as the text was read.
    pub fn ast(&self) -> &Ast {
        &self.ast
    }

    /// The texts that spans point into: the file and the standard solids.
    pub fn sources(&self) -> &Arc<[Source]> {
        &self.sources
    }

    /// Messages that do not keep the file from being used.
    pub fn warnings(&self) -> Diagnostics {
        Diagnostics { list: self.warnings.clone(), sources: self.sources.clone() }
    }
}

/// Bytes as text, or an error that says where they stop being text.
///
/// # Errors
/// If the bytes are not UTF-8.
pub fn text_of(bytes: Vec<u8>) -> std::io::Result<String> {
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let message = format!("it is not a UTF-8 text (byte {at} does not belong to a character)");
        std::io::Error::new(std::io::ErrorKind::InvalidData, message)
    })
}
