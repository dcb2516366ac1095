//! Names: what is defined, where, and whether it is used.

use std::collections::HashMap;

use super::value::Value;
use crate::diagnostic::{SourceId, Span};
use crate::syntax::ast::{Function, Name};

/// Names with a meaning that no item can change.
pub(super) const RESERVED: [&str; 5] = ["x", "y", "z", "t", "pi"];

/// What a name stands for.
#[derive(Debug, Clone)]
pub(super) enum Kind<'a> {
    Value(Value),
    Solid(Value),
    Function(&'a Function),
    Scene,
}

/// A name that an item defines.
#[derive(Debug, Clone)]
pub(super) struct Global<'a> {
    pub kind: Kind<'a>,
    pub span: Span,
    pub source: SourceId,
    used: bool,
}

impl<'a> Global<'a> {
    /// The function, if it may be called as a method of its first argument.
    fn of_shapes(&self) -> Option<&'a Function> {
        match self.kind {
            Kind::Function(function) if function.takes_a_shape() => Some(function),
            Kind::Function(_) | Kind::Value(_) | Kind::Solid(_) | Kind::Scene => None,
        }
    }
}

/// The items of the prelude and of the file. Those of the file shadow those of the prelude, but not inside
/// the prelude itself.
#[derive(Debug, Default)]
pub(super) struct Names<'a> {
    prelude: HashMap<String, Global<'a>>,
    file: HashMap<String, Global<'a>>,
    /// All names of the file, for messages about a name that is used too early.
    all: HashMap<String, Span>,
}

impl<'a> Names<'a> {
    pub fn define(&mut self, source: SourceId, name: &Name, kind: Kind<'a>) {
        let global = Global { kind, span: name.span, source, used: false };
        self.table(source).insert(name.text.clone(), global);
    }

    /// Makes the names of a file known, before any of them is defined.
    pub fn announce(&mut self, names: impl IntoIterator<Item = &'a Name>) {
        for name in names {
            self.all.entry(name.text.clone()).or_insert(name.span);
        }
    }

    /// Where a name that is not defined yet will be.
    pub fn defined_later(&self, name: &str) -> Option<Span> {
        self.all.get(name).copied().filter(|_| !self.file.contains_key(name))
    }

    fn table(&mut self, source: SourceId) -> &mut HashMap<String, Global<'a>> {
        match source {
            SourceId::Prelude => &mut self.prelude,
            SourceId::File => &mut self.file,
        }
    }

    pub fn defined_at(&self, source: SourceId, name: &str) -> Option<Span> {
        match source {
            SourceId::Prelude => self.prelude.get(name),
            SourceId::File => self.file.get(name),
        }
        .map(|global| global.span)
    }

    /// What a name means in code of a source; counts as a use.
    pub fn get(&mut self, source: SourceId, name: &str) -> Option<&Global<'a>> {
        if source == SourceId::File
            && let Some(global) = self.file.get_mut(name)
        {
            global.used = true;
            return Some(global);
        }
        self.prelude.get(name)
    }

    /// A function whose first parameter is called `shape`, which may be called as a method; counts as a use.
    pub fn function_of_shapes(&mut self, source: SourceId, name: &str) -> Option<(&'a Function, SourceId)> {
        if source != SourceId::Prelude
            && let Some(global) = self.file.get_mut(name)
            && let Some(function) = global.of_shapes()
        {
            global.used = true;
            return Some((function, global.source));
        }
        let global = self.prelude.get(name)?;
        Some((global.of_shapes()?, global.source))
    }

    /// The names of functions that may be called as methods, in alphabetical order.
    pub fn functions_of_shapes(&self) -> Vec<String> {
        let all = self.file.iter().chain(&self.prelude);
        let mut names: Vec<String> =
            all.filter(|(_, g)| g.of_shapes().is_some()).map(|(name, _)| name.clone()).collect();
        names.sort_unstable();
        names.dedup();
        names
    }

    /// Whether a name means a standard solid, which no item of the file shadows.
    pub fn is_standard(&self, name: &str) -> bool {
        !self.file.contains_key(name) && self.prelude.contains_key(name)
    }

    /// Names that can be written in the file, functions or values.
    pub fn candidates(&self, functions: bool) -> Vec<String> {
        let fits = |g: &Global<'_>| match g.kind {
            Kind::Function(_) => functions,
            Kind::Value(_) | Kind::Solid(_) => !functions,
            Kind::Scene => false,
        };
        let all = self.file.iter().chain(&self.prelude);
        let mut names: Vec<String> = all.filter(|(_, g)| fits(g)).map(|(name, _)| name.clone()).collect();
        names.sort_unstable();
        names
    }

    /// Items of the file that nothing uses: name, what it is, place. Solids are what a file is for, so they
    /// are never unused.
    pub fn unused(&self) -> Vec<(String, &'static str, Span)> {
        let mut unused: Vec<_> = self
            .file
            .iter()
            .filter(|(name, global)| !global.used && !name.starts_with('_'))
            .filter_map(|(name, global)| match global.kind {
                Kind::Value(_) => Some((name.clone(), "the name", global.span)),
                Kind::Function(_) => Some((name.clone(), "the function", global.span)),
                Kind::Solid(_) | Kind::Scene => None,
            })
            .collect();
        unused.sort_by_key(|(_, _, span)| span.start);
        unused
    }
}
