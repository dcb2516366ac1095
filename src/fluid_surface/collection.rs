//! The list of frames of a run: ParaView's `.pvd`.

use std::fmt;

use roxmltree::Document;

/// One frame of a run: an entry of its collection.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameEntry {
    /// The simulated time in seconds.
    pub time: f64,
    /// The frame's file, relative to the folder of the collection.
    pub file: String,
}

/// Why a file is no collection.
#[derive(Debug, Clone, PartialEq)]
pub enum CollectionError {
    /// The file is not an XML document, or one of another kind. The text says what was found.
    NotACollection(String),
    /// An entry has no file, or a time that is no number.
    Entry {
        /// The entry's index.
        index: usize,
    },
}

impl fmt::Display for CollectionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotACollection(found) => write!(f, "it is not a collection of VTK files: {found}"),
            Self::Entry { index } => write!(f, "its entry {index} has no file or no time"),
        }
    }
}

impl std::error::Error for CollectionError {}

/// Reads the entries of a collection from the text of its file, in their order.
///
/// # Errors
/// [`CollectionError`] if the text is no collection, or an entry is incomplete.
pub fn read_collection(text: &str) -> Result<Vec<FrameEntry>, CollectionError> {
    let document =
        Document::parse(text).map_err(|error| CollectionError::NotACollection(error.to_string()))?;
    let root = document.root_element();
    if root.attribute("type") != Some("Collection") {
        let found = root.attribute("type").unwrap_or(root.tag_name().name());
        return Err(CollectionError::NotACollection(format!("`{found}`")));
    }
    let sets = root.descendants().filter(|node| node.has_tag_name("DataSet"));
    sets.enumerate()
        .map(|(index, set)| {
            let time = set.attribute("timestep").and_then(|t| t.trim().parse::<f64>().ok());
            let file = set.attribute("file").map(str::to_string);
            let entry = time.zip(file).map(|(time, file)| FrameEntry { time, file });
            entry.ok_or(CollectionError::Entry { index })
        })
        .collect()
}
