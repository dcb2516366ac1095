//! Names: what is defined, where, and whether it is used.

use std::collections::HashMap;

use super::value::Value;
use crate::diagnostic::{SourceId, Span};
use crate::syntax::ast::{Function, Name};

/// Names with a meaning of their own. [`TIME`] can be given another one.
pub(super) const RESERVED: [&str; 5] = ["x", "y", "z", TIME, "pi"];

/// The name of the time, unless a file in which nothing moves gives it to a param, a value, a parameter of a
/// function or the variable of a fold.
pub(super) const TIME: &str = "t";

/// What a name stands for.
#[derive(Debug, Clone)]
pub(super) enum Kind<'a> {
    Value(Value),
    Solid(Value),
    Function(&'a Function),
    Scene,
    /// Another file.
    Import(SourceId),
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
            Kind::Function(_) | Kind::Value(_) | Kind::Solid(_) | Kind::Scene | Kind::Import(_) => None,
        }
    }
}

/// The items of one text.
type Table<'a> = HashMap<String, Global<'a>>;

/// The items of all texts. Those of a file shadow those of the prelude, but not inside the prelude itself;
/// files see one another through their imports alone.
#[derive(Debug, Default)]
pub(super) struct Names<'a> {
    prelude: Table<'a>,
    file: Table<'a>,
    imports: HashMap<u16, Table<'a>>,
    /// All names of the file that is being read, for messages about a name that is used too early.
    all: HashMap<String, Span>,
}

impl<'a> Names<'a> {
    pub fn define(&mut self, source: SourceId, name: &Name, kind: Kind<'a>) {
        let global = Global { kind, span: name.span, source, used: false };
        self.table(source).insert(name.text.clone(), global);
    }

    /// Makes the names of a file known, before any of them is defined.
    pub fn announce(&mut self, names: impl IntoIterator<Item = &'a Name>) {
        self.all.clear();
        for name in names {
            self.all.entry(name.text.clone()).or_insert(name.span);
        }
    }

    /// Where a name that is not defined yet will be.
    pub fn defined_later(&self, source: SourceId, name: &str) -> Option<Span> {
        let later = self.all.get(name).copied().filter(|later| later.source == source);
        later.filter(|_| self.of(source, name).is_none())
    }

    fn table(&mut self, source: SourceId) -> &mut Table<'a> {
        match source {
            SourceId::Prelude => &mut self.prelude,
            SourceId::File => &mut self.file,
            SourceId::Import(number) => self.imports.entry(number).or_default(),
        }
    }

    /// An item of one text.
    pub fn of(&self, source: SourceId, name: &str) -> Option<&Global<'a>> {
        match source {
            SourceId::Prelude => self.prelude.get(name),
            SourceId::File => self.file.get(name),
            SourceId::Import(number) => self.imports.get(&number)?.get(name),
        }
    }

    /// The items that code of a source can name, those of the prelude last.
    fn known(&self, source: SourceId) -> impl Iterator<Item = (&String, &Global<'a>)> {
        let own = match source {
            SourceId::Prelude => None,
            SourceId::File => Some(&self.file),
            SourceId::Import(number) => self.imports.get(&number),
        };
        own.into_iter().flatten().chain(&self.prelude)
    }

    /// The names of one text that others may use, in alphabetical order.
    pub fn offered(&self, source: SourceId) -> Vec<String> {
        let table = match source {
            SourceId::Prelude => Some(&self.prelude),
            SourceId::File => Some(&self.file),
            SourceId::Import(number) => self.imports.get(&number),
        };
        let is_offered = |global: &Global<'a>| match global.kind {
            Kind::Value(_) | Kind::Solid(_) | Kind::Function(_) => true,
            Kind::Scene | Kind::Import(_) => false,
        };
        let all = table.into_iter().flatten().filter(|(_, global)| is_offered(global));
        let mut names: Vec<String> = all.map(|(name, _)| name.clone()).collect();
        names.sort_unstable();
        names
    }

    /// A name that a text lacks as its imports have it, such as `parts.post` for `post`.
    pub fn in_an_import(&self, source: SourceId, name: &str, is_called: bool) -> Option<String> {
        let own = match source {
            SourceId::Prelude => None,
            SourceId::File => Some(&self.file),
            SourceId::Import(number) => self.imports.get(&number),
        };
        let has_it = |(_, global): &(&String, &Global<'a>)| match global.kind {
            Kind::Import(of) => self.of(of, name).is_some_and(|global| match global.kind {
                Kind::Function(_) => is_called,
                Kind::Value(_) | Kind::Solid(_) => !is_called,
                Kind::Scene | Kind::Import(_) => false,
            }),
            Kind::Value(_) | Kind::Solid(_) | Kind::Function(_) | Kind::Scene => false,
        };
        let import = own?.iter().filter(has_it).map(|(import, _)| import).min()?;
        Some(format!("{import}.{name}"))
    }

    /// The file that a name stands for, if it is that of an import; counts as a use.
    pub fn import(&mut self, source: SourceId, name: &str) -> Option<SourceId> {
        match self.table(source).get_mut(name)? {
            Global { kind: Kind::Import(of), used, .. } => {
                *used = true;
                Some(*of)
            }
            Global { kind: Kind::Value(_) | Kind::Solid(_) | Kind::Function(_) | Kind::Scene, .. } => None,
        }
    }

    pub fn defined_at(&self, source: SourceId, name: &str) -> Option<Span> {
        self.of(source, name).map(|global| global.span)
    }

    /// Whether the prelude has a function of this name.
    pub fn is_standard_function(&self, name: &str) -> bool {
        self.prelude.get(name).is_some_and(|global| matches!(global.kind, Kind::Function(_)))
    }

    /// What a name means in code of a source; counts as a use.
    pub fn get(&mut self, source: SourceId, name: &str) -> Option<&Global<'a>> {
        if source.is_users() && self.of(source, name).is_some() {
            let global = self.table(source).get_mut(name)?;
            global.used = true;
            return Some(global);
        }
        self.prelude.get(name)
    }

    /// Counts a name as used. Returns the user's function that it stands for, if this is its first use.
    pub fn first_use(&mut self, source: SourceId, name: &str) -> Option<&'a Function> {
        let was_used = self.of(source, name).is_none_or(|global| global.used);
        match self.get(source, name)?.kind {
            Kind::Function(function) if !was_used => Some(function),
            Kind::Function(_) | Kind::Value(_) | Kind::Solid(_) | Kind::Scene | Kind::Import(_) => None,
        }
    }

    /// A function whose first parameter is called `shape`, which may be called as a method; counts as a use.
    pub fn function_of_shapes(&mut self, source: SourceId, name: &str) -> Option<(&'a Function, SourceId)> {
        if source.is_users()
            && let Some(global) = self.table(source).get_mut(name)
            && let Some(function) = global.of_shapes()
        {
            global.used = true;
            return Some((function, global.source));
        }
        let global = self.prelude.get(name)?;
        Some((global.of_shapes()?, global.source))
    }

    /// The names of functions that may be called as methods, in alphabetical order.
    pub fn functions_of_shapes(&self, source: SourceId) -> Vec<String> {
        let all = self.known(source);
        let mut names: Vec<String> =
            all.filter(|(_, g)| g.of_shapes().is_some()).map(|(name, _)| name.clone()).collect();
        names.sort_unstable();
        names.dedup();
        names
    }

    /// Whether a name means a standard solid in a text, and none of its items shadows it.
    pub fn is_standard(&self, source: SourceId, name: &str) -> bool {
        (!source.is_users() || self.of(source, name).is_none()) && self.prelude.contains_key(name)
    }

    /// Names that can be written in a text, functions or values.
    pub fn candidates(&self, source: SourceId, functions: bool) -> Vec<String> {
        let fits = |g: &Global<'_>| match g.kind {
            Kind::Function(_) => functions,
            Kind::Value(_) | Kind::Solid(_) => !functions,
            Kind::Scene | Kind::Import(_) => false,
        };
        let all = self.known(source);
        let mut names: Vec<String> = all.filter(|(_, g)| fits(g)).map(|(name, _)| name.clone()).collect();
        names.sort_unstable();
        names
    }

    /// Unused items of the file: name, kind, place. Solids are the purpose of a file, so they are never
    /// unused.
    pub fn unused(&self) -> Vec<(String, &'static str, Span)> {
        let mut unused: Vec<_> = self
            .file
            .iter()
            .filter(|(name, global)| !global.used && !name.starts_with('_'))
            .filter_map(|(name, global)| match global.kind {
                Kind::Value(_) => Some((name.clone(), "the name", global.span)),
                Kind::Function(_) => Some((name.clone(), "the function", global.span)),
                Kind::Import(_) => Some((name.clone(), "the import", global.span)),
                Kind::Solid(_) | Kind::Scene => None,
            })
            .collect();
        unused.sort_by_key(|(_, _, span)| span.start);
        unused
    }
}
