//! Reads the files that a file imports, and those that they import.

use std::collections::HashMap;

use super::folder::text_of;
use crate::diagnostic::{Code, Diagnostic, Source, SourceId, Span};
use crate::files::Files;
use crate::lower::{Imported, unread};
use crate::syntax::{self, Ast, ast::Item};
use crate::triangles;

/// Files import one another no deeper than this.
const DEEPEST: usize = 32;

/// The most files.
const MOST: usize = 1000;

/// All files that a file imports, each after those that it imports itself; the messages; and for each file where it is
/// first imported.
pub(super) fn imports(source: &Source, ast: &Ast, files: &Files) -> Imports {
    let mut loader = Loader { files, found: Imports::default(), path: vec![Files::plain(&source.name)] };
    loader.follow(source, ast, "");
    loader.found
}

#[derive(Default)]
pub(super) struct Imports {
    pub files: Vec<Imported>,
    pub messages: Vec<Diagnostic>,
    pub places: HashMap<SourceId, Span>,
}

struct Loader<'f> {
    files: &'f Files,
    found: Imports,
    /// The files that are being read, each imported by the one before it.
    path: Vec<String>,
}

impl Loader<'_> {
    fn follow(&mut self, source: &Source, ast: &Ast, prefix: &str) {
        for item in &ast.items {
            let Item::Import(import) = item else { continue };
            let name = Files::name(&import.path, &source.name);
            let refused = |code, message: String| Diagnostic::error(code, import.span, message);
            if let Some(at) = self.path.iter().position(|open| *open == name) {
                let mut round = self.path[at..].to_vec();
                round.push(name);
                let message = format!("the file imports itself: {}", round.join(" → "));
                self.found.messages.push(
                    refused(Code::IMPORT, message)
                        .help("move what both need into a file that imports neither"),
                );
                continue;
            }
            if self.found.files.iter().any(|known| *known.source.name == *name) {
                continue;
            }
            let ending = name.rsplit_once('.').map_or("", |(_, ending)| ending).to_lowercase();
            if triangles::FORMATS.contains(&ending.as_str()) {
                let help =
                    format!("a mesh is a solid: `solid {} = mesh(\"{}\")`", import.name.text, import.path);
                let message = format!("`{}` is a mesh and no file of this language", import.path);
                self.found.messages.push(refused(Code::IMPORT, message).help(help));
                continue;
            }
            if self.path.len() > DEEPEST || self.found.places.len() >= MOST {
                let message =
                    format!("imports of more than {MOST} files, or nested more than {DEEPEST} deep");
                self.found.messages.push(refused(Code::IMPORT, message));
                continue;
            }
            let text = self.files.read(&name).and_then(|bytes| {
                text_of(bytes.to_vec()).map_err(|error| crate::files::Unread::Failed(error.to_string()))
            });
            match text {
                Ok(text) => {
                    let qualified = format!("{prefix}{}", import.name.text);
                    self.load(name, text, import.span, qualified);
                }
                Err(error) => self.found.messages.push(unread(&import.path, &error, import.span)),
            }
        }
    }

    fn load(&mut self, name: String, text: String, place: Span, qualified: String) {
        let id = SourceId::Import(self.found.places.len() as u16);
        self.found.places.insert(id, place);
        let source = Source { id, name: name.as_str().into(), text: text.into() };
        let (ast, messages) = syntax::parse(&source);
        self.found.messages.extend(messages);
        self.path.push(name);
        self.follow(&source, &ast, &format!("{qualified}."));
        self.path.pop();
        self.found.files.push(Imported { source, ast, qualified });
    }
}
