//! The list of frames of a run: ParaView's `.pvd`.

use std::fmt;

use roxmltree::Document;

/// One file of a collection.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameEntry {
    /// Seconds.
    pub time: f64,
    /// Relative to the folder of the collection.
    pub file: String,
}

/// Why a file is no collection.
#[derive(Debug, Clone, PartialEq)]
pub enum CollectionError {
    /// Not an XML document, or one of another kind; what was found.
    NotACollection(String),
    /// An entry without file, or with a time that is no number.
    Entry { index: usize },
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

/// Reads the entries of a collection, in its order.
///
/// # Errors
/// See [`CollectionError`].
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
