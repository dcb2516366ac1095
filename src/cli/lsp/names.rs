//! Names of a file: where each is defined, and where it is used.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use rfm::diagnostic::Span;
use rfm::lower::vocabulary;
use rfm::syntax::Ast;
use rfm::syntax::ast::{Argument, Entry, Expr, ExprKind, Function, Item, Name};

/// Keys whose values name a fluid of the scene.
const OF_FLUIDS: [&str; 2] = ["energy", "audit"];

/// What a name stands for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Meaning {
    /// Something that the file defines, with the place of its name.
    Defined(Range<usize>),
    /// Something that an imported file defines.
    Imported(Imported),
    /// The path of an imported file.
    File(String),
    /// A standard solid, a function or a method of the language.
    Standard,
    /// A word that is the value of the key with this name.
    Word(String),
    /// A key of a scene, in the block with this name; `None` for the scene itself.
    Key(Option<String>),
    /// The unit of a quantity.
    Unit,
    /// The word that a fold begins with.
    Fold,
}

/// Something that an imported file defines.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Imported {
    /// The path of the file, as it is written.
    pub path: String,
    /// The function, if it is a parameter of one.
    pub parameter_of: Option<String>,
}

/// A name in the text.
#[derive(Debug, Clone)]
pub(super) struct Mention {
    pub place: Range<usize>,
    pub text: String,
    pub meaning: Meaning,
}

/// All names of a file, in the order of the text.
#[derive(Debug, Default)]
pub(super) struct Names {
    pub mentions: Vec<Mention>,
    /// Where the names of functions stand that are called as methods, in their definitions.
    methods: HashSet<Range<usize>>,
}

impl Names {
    pub fn of(ast: &Ast) -> Self {
        let items = ast.items.iter().map(|item| (item.name().text.as_str(), item)).rev().collect();
        let (fluids, methods) = (HashMap::new(), HashSet::new());
        let mut reader = Reader { ast, items, locals: Vec::new(), fluids, methods, found: Vec::new() };
        for item in &ast.items {
            reader.item(item);
        }
        reader.found.sort_by_key(|mention| mention.place.start);
        Self { mentions: reader.found, methods: reader.methods }
    }

    /// Whether a function of the file is called as a method.
    pub fn is_called_as_method(&self, function: &Function) -> bool {
        self.methods.contains(&function.name.span.range())
    }

    /// The name at a byte, or directly before it.
    pub fn at(&self, byte: usize) -> Option<&Mention> {
        self.mentions.iter().find(|mention| mention.place.start <= byte && byte <= mention.place.end)
    }

    /// All places of what a name stands for, its definition among them.
    pub fn uses<'a>(&'a self, of: &'a Range<usize>) -> impl Iterator<Item = &'a Mention> {
        self.mentions.iter().filter(move |mention| mention.meaning == Meaning::Defined(of.clone()))
    }
}

struct Reader<'a> {
    ast: &'a Ast,
    items: HashMap<&'a str, &'a Item>,
    /// Parameters and variables of folds that are in scope, the innermost last.
    locals: Vec<&'a Name>,
    /// Fluids of the scene that is read.
    fluids: HashMap<&'a str, &'a Name>,
    methods: HashSet<Range<usize>>,
    found: Vec<Mention>,
}

impl<'a> Reader<'a> {
    fn item(&mut self, item: &'a Item) {
        self.define(item.name());
        match item {
            Item::Import(import) => {
                let (place, path) = (import.span.range(), import.path.clone());
                self.found.push(Mention { place, text: path.clone(), meaning: Meaning::File(path) });
            }
            Item::Param(param) => {
                self.expr(&param.value);
                param.range.iter().for_each(|(low, high)| {
                    self.expr(low);
                    self.expr(high);
                });
            }
            Item::Let(definition) | Item::Solid(definition) => {
                for attribute in &definition.attributes {
                    self.arguments(&attribute.arguments, None);
                }
                self.expr(&definition.value);
            }
            Item::Function(function) => {
                for parameter in &function.parameters {
                    parameter.default.iter().for_each(|value| self.expr(value));
                }
                for parameter in &function.parameters {
                    self.define(&parameter.name);
                    self.locals.push(&parameter.name);
                }
                self.expr(&function.body);
                self.locals.clear();
            }
            Item::Scene(scene) => {
                self.fluids.clear();
                for entry in &scene.entries {
                    if let Entry::Block { key, label: Some(label), .. } = entry
                        && key.text == "fluid"
                    {
                        self.fluids.insert(&label.text, label);
                    }
                }
                self.entries(&scene.entries, None);
            }
        }
    }

    fn define(&mut self, name: &Name) {
        self.mention(name, Meaning::Defined(name.span.range()));
    }

    fn mention(&mut self, name: &Name, meaning: Meaning) {
        self.found.push(Mention { place: name.span.range(), text: name.text.clone(), meaning });
    }

    fn entries(&mut self, entries: &'a [Entry], block: Option<&str>) {
        for entry in entries {
            self.mention(entry.key(), Meaning::Key(block.map(String::from)));
            match entry {
                Entry::Setting { key, value } => self.setting(key, value),
                Entry::Block { key, label, entries, .. } => {
                    label.iter().for_each(|label| self.define(label));
                    self.entries(entries, Some(&key.text));
                }
            }
        }
    }

    fn setting(&mut self, key: &Name, value: &'a Expr) {
        let ExprKind::Name(word) = &value.kind else { return self.expr(value) };
        if vocabulary::words(&key.text).contains(word) {
            // a word of the key, whatever the file defines
            let place = self.place(value.span, word);
            self.found.push(Mention { place, text: word.clone(), meaning: Meaning::Word(key.text.clone()) });
            return;
        }
        match self.fluids.get(word.as_str()).copied().filter(|_| OF_FLUIDS.contains(&key.text.as_str())) {
            Some(fluid) => {
                let place = self.place(value.span, word);
                let meaning = Meaning::Defined(fluid.span.range());
                self.found.push(Mention { place, text: word.clone(), meaning });
            }
            None => self.expr(value),
        }
    }

    /// What a name means here. Items below are found too, though the compiler refuses them.
    fn meaning(&self, name: &str) -> Option<Meaning> {
        if let Some(local) = self.locals.iter().rev().find(|local| local.text == name) {
            return Some(Meaning::Defined(local.span.range()));
        }
        if let Some(item) = self.items.get(name) {
            return Some(Meaning::Defined(item.name().span.range()));
        }
        is_standard(name).then_some(Meaning::Standard)
    }

    /// The path of the file that an expression names, if it is the name of an import.
    fn import(&self, expr: &Expr) -> Option<&'a str> {
        let ExprKind::Name(name) = &expr.kind else { return None };
        let is_local = self.locals.iter().any(|local| local.text == *name);
        match self.items.get(name.as_str()) {
            Some(Item::Import(import)) if !is_local => Some(&import.path),
            _ => None,
        }
    }

    fn function(&self, name: &str) -> Option<&'a Function> {
        match self.items.get(name) {
            Some(Item::Function(function)) => Some(function),
            _ => None,
        }
    }

    fn exprs(&mut self, exprs: impl IntoIterator<Item = &'a Expr>) {
        exprs.into_iter().for_each(|expr| self.expr(expr));
    }

    fn expr(&mut self, expr: &'a Expr) {
        match &expr.kind {
            ExprKind::Name(name) => {
                if let Some(meaning) = self.meaning(name) {
                    let place = self.place(expr.span, name);
                    self.found.push(Mention { place, text: name.clone(), meaning });
                }
            }
            ExprKind::Call { function, arguments } => {
                if let Some(meaning) = self.meaning(&function.text) {
                    self.mention(function, meaning);
                }
                let called = self.function(&function.text);
                self.arguments(arguments, called);
            }
            ExprKind::Member { of, name } => {
                self.expr(of);
                if let Some(path) = self.import(of) {
                    self.mention(name, Meaning::Imported(Imported { path: path.into(), parameter_of: None }));
                }
            }
            ExprKind::Method { receiver, method, arguments } => {
                self.expr(receiver);
                if let Some(path) = self.import(receiver) {
                    self.mention(
                        method,
                        Meaning::Imported(Imported { path: path.into(), parameter_of: None }),
                    );
                    return self.imported_arguments(arguments, path, &method.text);
                }
                let own = self.function(&method.text).filter(|function| function.takes_a_shape());
                match own {
                    Some(function) => {
                        self.methods.insert(function.name.span.range());
                        self.mention(method, Meaning::Defined(function.name.span.range()));
                    }
                    None => self.mention(method, Meaning::Standard),
                }
                self.arguments(arguments, own);
            }
            ExprKind::Quantity { unit, .. } => self.mention(unit, Meaning::Unit),
            ExprKind::Fold { op, variable, members, body } => {
                let (place, text) = (self.place(expr.span, op.word()), op.word().to_string());
                self.found.push(Mention { place, text, meaning: Meaning::Fold });
                self.exprs(members.exprs());
                self.define(variable);
                self.locals.push(variable);
                self.expr(body);
                self.locals.pop();
            }
            _ => self.exprs(expr.children()),
        }
    }

    fn arguments(&mut self, arguments: &'a [Argument], called: Option<&Function>) {
        for argument in arguments {
            if let Some(name) = &argument.name
                && let Some(parameter) =
                    called.iter().flat_map(|function| &function.parameters).find(|p| p.name.text == name.text)
            {
                self.mention(name, Meaning::Defined(parameter.name.span.range()));
            }
            self.expr(&argument.value);
        }
    }

    /// The arguments of a function that the file of a path defines.
    fn imported_arguments(&mut self, arguments: &'a [Argument], path: &str, function: &str) {
        for name in arguments.iter().filter_map(|argument| argument.name.as_ref()) {
            let parameter_of = Some(function.to_string());
            self.mention(name, Meaning::Imported(Imported { path: path.to_string(), parameter_of }));
        }
        self.exprs(arguments.iter().map(|argument| &argument.value));
    }

    /// The place of a name whose span may hold brackets and comments around it.
    fn place(&self, span: Span, name: &str) -> Range<usize> {
        let Range { start, end } = span.range();
        let text = self.ast.text.get(start..end).unwrap_or("");
        let mut at = 0;
        while let Some(c) = text[at..].chars().next() {
            if c == '#' || text[at..].starts_with("//") {
                at += text[at..].find('\n').unwrap_or(text.len() - at);
            } else if text[at..].starts_with(name) {
                return start + at..start + at + name.len();
            } else {
                at += c.len_utf8();
            }
        }
        start..end
    }
}

/// Whether the language itself has this name for a value or a function.
pub(super) fn is_standard(name: &str) -> bool {
    vocabulary::reserved().contains(&name)
        || vocabulary::builtins().any(|builtin| builtin == name)
        || vocabulary::prelude().items.iter().any(|item| item.name().text == name)
}
