//! Names across files: the definitions of what an import offers, and all places where it is used.

use std::collections::HashMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use lsp_types::{Location, TextEdit, Uri, WorkspaceEdit};

use rfm::compile::text_of;
use rfm::diagnostic::{Source, Span};
use rfm::files::Files;
use rfm::lower::vocabulary;
use rfm::syntax::{self, KEYWORDS, ast::Function, ast::Item};

use super::buffers::Buffers;
use super::document::Document;
use super::names::{Imported, Meaning, Mention, is_standard};
use super::reading::{Encoding, Reading, uri_of};

/// The most files that are looked through for uses of a name, and entries of folders on the way to them.
const MOST_FILES: usize = 2000;
const MOST_ENTRIES: usize = 20_000;

/// The open files, and where others lie.
pub(super) struct Workspace {
    pub encoding: Encoding,
    /// Whether the editor lets the user choose what a completion replaces.
    pub may_choose: bool,
    pub buffers: Buffers,
    /// The open files by their addresses.
    pub documents: HashMap<String, Arc<Document>>,
    /// The folders that the editor works in.
    pub roots: Vec<PathBuf>,
}

/// A place in a file.
pub(super) struct Place {
    pub uri: Uri,
    file: File,
    pub bytes: Range<usize>,
}

/// A file that is open, or was read from the disk.
#[derive(Clone)]
enum File {
    Open(Arc<Document>),
    OnDisk(Arc<Reading>),
}

impl File {
    fn reading(&self) -> &Reading {
        match self {
            Self::Open(document) => &document.reading,
            Self::OnDisk(reading) => reading,
        }
    }
}

impl Place {
    pub fn location(&self) -> Location {
        Location::new(self.uri.clone(), self.file.reading().range(self.bytes.clone()))
    }
}

/// The name at a byte, if a file defines it: this one, or one that it imports.
pub(super) fn own_name(document: &Document, byte: usize) -> Option<&Mention> {
    document.reading.names.at(byte).filter(|mention| match mention.meaning {
        Meaning::Defined(_) | Meaning::Imported(_) => true,
        Meaning::File(_)
        | Meaning::Standard
        | Meaning::Key(_)
        | Meaning::Word(_)
        | Meaning::Unit
        | Meaning::Fold => false,
    })
}

impl Workspace {
    /// A file that a document imports by a path, as it is open or else as the disk has it.
    pub fn imported(&self, document: &Document, path: &str) -> Option<(Uri, Arc<Document>)> {
        let source = document.imported(path)?;
        if let Some(open) = self.open(&source.name) {
            return Some(open);
        }
        let uri = uri_of(&source.name)?;
        let read = Document::new(&uri, &source.text, None, self.encoding, &self.buffers);
        Some((uri, Arc::new(read)))
    }

    /// The open file of a path.
    fn open(&self, path: &str) -> Option<(Uri, Arc<Document>)> {
        let found = self.documents.iter().find(|(_, document)| document.reading.path() == path);
        found.and_then(|(uri, document)| Some((uri.parse().ok()?, Arc::clone(document))))
    }

    /// Where the name at a byte is defined; for the path of an import, the beginning of that file.
    pub fn definition(&self, uri: &Uri, document: &Arc<Document>, byte: usize) -> Option<Place> {
        let mention = document.reading.names.at(byte)?;
        match &mention.meaning {
            Meaning::Defined(place) => {
                let file = File::Open(Arc::clone(document));
                Some(Place { uri: uri.clone(), file, bytes: place.clone() })
            }
            Meaning::File(path) => {
                let (uri, file) = self.imported(document, path)?;
                Some(Place { uri, file: File::Open(file), bytes: 0..0 })
            }
            Meaning::Imported(Imported { path, parameter_of }) => {
                let (uri, file) = self.imported(document, path)?;
                let bytes = offered(&file.reading, &mention.text, parameter_of.as_deref())?;
                Some(Place { uri, file: File::Open(file), bytes })
            }
            Meaning::Standard | Meaning::Key(_) | Meaning::Word(_) | Meaning::Unit | Meaning::Fold => None,
        }
    }

    /// All places of the name at a byte, in this file and in all that import it. The definition comes first,
    /// and the others in the order of files.
    pub fn uses(&self, uri: &Uri, document: &Arc<Document>, byte: usize) -> Option<Vec<Place>> {
        let mention = own_name(document, byte)?;
        let defined = self.definition(uri, document, byte)?;
        let home = defined.file.reading();
        let of = defined.bytes.clone();
        let found_in = |uri: &Uri, file: &File, places: Vec<Range<usize>>| -> Vec<Place> {
            places.into_iter().map(|bytes| Place { uri: uri.clone(), file: file.clone(), bytes }).collect()
        };
        let at_home = home.names.uses(&of).map(|found| found.place.clone()).filter(|place| *place != of);
        let mut places =
            found_in(&defined.uri, &defined.file, std::iter::once(of.clone()).chain(at_home).collect());
        if let Some(parameter_of) = known_outside(home, &of) {
            let path = home.path();
            for (uri, file) in self.files_that_may_name(&path, &mention.text, document) {
                let uses = imported_uses(file.reading(), &path, &mention.text, parameter_of);
                places.extend(found_in(&uri, &file, uses));
            }
        }
        Some(places)
    }

    /// The edits that give another name to what stands at a byte.
    ///
    /// # Errors
    /// Why the name cannot be given, in words.
    pub fn rename(
        &self,
        uri: &Uri,
        document: &Arc<Document>,
        byte: usize,
        name: &str,
    ) -> Result<WorkspaceEdit, String> {
        let mention = own_name(document, byte).ok_or("the file defines no name here")?;
        let starts = name.starts_with(|c: char| c.is_alphabetic() || c == '_');
        if !starts || !name.chars().all(|c| c.is_alphabetic() || c.is_ascii_digit() || c == '_') {
            return Err(format!("`{name}` is no name: names have letters, digits and `_`"));
        }
        if KEYWORDS.contains(&name) || vocabulary::reserved().contains(&name) {
            return Err(format!("`{name}` is a word of the language"));
        }
        if name != mention.text && is_standard(name) {
            return Err(format!(
                "`{name}` is a standard solid or function, which would be hidden from then on"
            ));
        }
        let places = self.uses(uri, document, byte).ok_or("the file that defines it cannot be read")?;
        let taken = |other: &Mention| other.text == name && is_name(other);
        if let Some(defined) = places.first().filter(|_| name != mention.text) {
            let home = defined.file.reading();
            if let Some(why) = changes_methods(home, &defined.bytes, name) {
                return Err(why);
            }
            if home.names.mentions.iter().any(taken) {
                return Err(format!("`{name}` is used in the file already"));
            }
        }
        Ok(edits(&places, name))
    }

    /// Files that may name something of a file: open ones, and those in the folders of the editor, or in that
    /// of a document if there are none.
    fn files_that_may_name(&self, path: &str, word: &str, document: &Document) -> Vec<(Uri, File)> {
        let mut open: Vec<(&String, &Arc<Document>)> = self.documents.iter().collect();
        open.sort_unstable_by_key(|(uri, _)| *uri);
        let mut files: Vec<(Uri, File)> = open
            .into_iter()
            .filter_map(|(uri, document)| Some((uri.parse().ok()?, File::Open(Arc::clone(document)))))
            .collect();
        let folder = |path: &str| Path::new(path).parent().map(Path::to_path_buf);
        let beside = [folder(path), folder(&document.reading.path())].into_iter().flatten();
        let mut roots: Vec<PathBuf> = self.roots.iter().cloned().chain(beside).collect();
        roots.sort_unstable();
        roots.dedup();
        for path in files_below(&roots) {
            let name = path.to_string_lossy();
            if self.open(&name).is_some() {
                continue;
            }
            let text = std::fs::read(&path).and_then(text_of).unwrap_or_default();
            if !(text.contains("import") && text.contains(word)) {
                continue;
            }
            let source = Source::file(&*name, text);
            let reading = Reading::new(source.clone(), syntax::parse(&source).0, self.encoding);
            files.extend(uri_of(&name).map(|uri| (uri, File::OnDisk(Arc::new(reading)))));
        }
        files
    }
}

/// Why renaming the definition at a place would change which methods of shapes a text has; `None` if it would
/// not.
fn changes_methods(home: &Reading, place: &Range<usize>, name: &str) -> Option<String> {
    let (shape, is_here) = (Function::SHAPE, |span: Span| span.range() == *place);
    home.ast.items.iter().find_map(|item| {
        let Item::Function(function) = item else { return None };
        let own = &function.name.text;
        let is_first = function.parameters.first().is_some_and(|first| is_here(first.name.span));
        if is_first && name == shape {
            return Some(format!(
                "`{own}` would become a method: its first parameter would be called `{shape}`"
            ));
        }
        if is_first && home.names.is_called_as_method(function) {
            return Some(format!(
                "`{own}` is called as a method, and is one as its first parameter is called `{shape}`"
            ));
        }
        let is_method = is_here(function.name.span) && function.takes_a_shape();
        let hides = is_method && vocabulary::methods().any(|(known, _)| known == name);
        hides.then(|| format!("`{name}` is a method of all shapes, which would be hidden from then on"))
    })
}

/// Where a text defines a name that others may use: an item, or the parameter of a function.
pub(super) fn offered(reading: &Reading, name: &str, parameter_of: Option<&str>) -> Option<Range<usize>> {
    let item = |name: &str| reading.ast.items.iter().find(|item| item.name().text == name);
    match (item(parameter_of.unwrap_or(name))?, parameter_of) {
        (Item::Function(function), Some(_)) => {
            let found = function.parameters.iter().find(|parameter| parameter.name.text == name)?;
            Some(found.name.span.range())
        }
        (Item::Import(_) | Item::Scene(_), _) | (_, Some(_)) => None,
        (found, None) => Some(found.name().span.range()),
    }
}

/// Whether others may use what a text defines at a place. The inner value is the function, if it is a parameter of one.
fn known_outside<'r>(reading: &'r Reading, place: &Range<usize>) -> Option<Option<&'r str>> {
    reading.ast.items.iter().find_map(|item| match item {
        Item::Import(_) | Item::Scene(_) => None,
        item if item.name().span.range() == *place => Some(None),
        Item::Function(function) => {
            let is_own = function.parameters.iter().any(|parameter| parameter.name.span.range() == *place);
            is_own.then_some(Some(function.name.text.as_str()))
        }
        Item::Param(_) | Item::Let(_) | Item::Solid(_) => None,
    })
}

/// The places at which a text uses a name of the file with this path: that of an item, or of a function's parameter.
fn imported_uses(reading: &Reading, path: &str, name: &str, parameter_of: Option<&str>) -> Vec<Range<usize>> {
    let is_of_file = |written: &str| Files::name(written, &reading.source.name) == path;
    let uses = reading.names.mentions.iter().filter(|mention| match &mention.meaning {
        Meaning::Imported(of) => {
            mention.text == name && of.parameter_of.as_deref() == parameter_of && is_of_file(&of.path)
        }
        Meaning::Defined(_)
        | Meaning::File(_)
        | Meaning::Standard
        | Meaning::Key(_)
        | Meaning::Word(_)
        | Meaning::Unit
        | Meaning::Fold => false,
    });
    uses.map(|mention| mention.place.clone()).collect()
}

fn is_name(mention: &Mention) -> bool {
    match mention.meaning {
        Meaning::Defined(_) | Meaning::Standard => true,
        Meaning::Imported(_)
        | Meaning::File(_)
        | Meaning::Key(_)
        | Meaning::Word(_)
        | Meaning::Unit
        | Meaning::Fold => false,
    }
}

// the protocol keys edits by the address of their file, which never changes
#[allow(clippy::mutable_key_type)]
fn edits(places: &[Place], name: &str) -> WorkspaceEdit {
    let mut changes: HashMap<Uri, Vec<TextEdit>> = HashMap::new();
    for place in places {
        let edit = TextEdit::new(place.location().range, name.to_string());
        changes.entry(place.uri.clone()).or_default().push(edit);
    }
    WorkspaceEdit { changes: Some(changes), ..WorkspaceEdit::default() }
}

/// The files of the language in some folders and below, in the order of their paths. Hidden folders, those of runs and
/// what Cargo builds are left out, and so is what lies beyond the limits.
fn files_below(roots: &[PathBuf]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = roots.to_vec();
    let mut entries = 0;
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            entries += 1;
            if entries > MOST_ENTRIES || found.len() >= MOST_FILES {
                folders.clear();
                break;
            }
            let name = entry.file_name().to_string_lossy().into_owned();
            // a link to a folder may lead in a circle
            match entry.file_type() {
                Ok(kind) if kind.is_dir() && !name.starts_with('.') && name != "target" => {
                    // the folder of a run holds thousands of frames
                    if !entry.path().join("particles.pvd").exists() {
                        folders.push(entry.path());
                    }
                }
                // no pipe, which would be read for ever
                Ok(_) if name.ends_with(".rfm") && entry.path().is_file() => found.push(entry.path()),
                Ok(_) | Err(_) => {}
            }
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}
