//! The positions of the points of a VTK PolyData file (`.vtp`).
//!
//! All ways in which such files store arrays without compression can be read: as text, as base64 in the
//! element, and appended behind the document, raw or as base64; in either byte order, with 32- or 64-bit
//! lengths and floats. Everything except `Points` is skipped.
//!
//! Invariant: a length that the file states is not trusted before the bytes are there.

use std::fmt;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use glam::DVec3;
use roxmltree::{Document, Node};

/// Why a file is no frame.
#[derive(Debug, Clone, PartialEq)]
pub enum FrameError {
    /// The file is not an XML document, or one of another kind. The text says what was found.
    NotPolyData(String),
    /// The file stores arrays in a way that cannot be read. The text names it.
    Unsupported(String),
    /// Something is missing. The text names it.
    Missing(&'static str),
    /// A number or a block cannot be read. The text names it.
    Malformed(&'static str),
    /// The file ends before its data.
    Truncated,
    /// The array has another length than the piece states.
    Count {
        /// The number of coordinates that the piece states.
        expected: usize,
        /// The number of coordinates in the array.
        found: usize,
    },
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotPolyData(found) => write!(f, "it is not VTK PolyData: {found}"),
            Self::Unsupported(what) => write!(f, "{what} cannot be read; write it without"),
            Self::Missing(what) => write!(f, "it has no {what}"),
            Self::Malformed(what) => write!(f, "{what} cannot be read"),
            Self::Truncated => write!(f, "it ends before its data: it was cut off"),
            Self::Count { expected, found } => {
                write!(f, "it should have {expected} coordinates and has {found}")
            }
        }
    }
}

impl std::error::Error for FrameError {}

/// Reads the positions of all points from the bytes of a file, in their order. NaN and infinite coordinates
/// are kept.
///
/// # Errors
/// [`FrameError`] if the file is no PolyData, is stored in an unknown way, or is damaged.
pub fn read_points(file: &[u8]) -> Result<Vec<DVec3>, FrameError> {
    let (head, appended) = split(file)?;
    let document = Document::parse(&head).map_err(|error| FrameError::NotPolyData(error.to_string()))?;
    let root = document.root_element();
    if root.tag_name().name() != "VTKFile" || root.attribute("type") != Some("PolyData") {
        let found = root.attribute("type").unwrap_or(root.tag_name().name());
        return Err(FrameError::NotPolyData(format!("`{found}`")));
    }
    if let Some(compressor) = root.attribute("compressor") {
        return Err(FrameError::Unsupported(format!("compression by {compressor}")));
    }
    let storage = Storage::of(root, appended)?;
    let mut points = Vec::new();
    for piece in root.descendants().filter(|node| node.has_tag_name("Piece")) {
        let count: usize = number(piece, "NumberOfPoints")?;
        let array = piece
            .children()
            .find(|node| node.has_tag_name("Points"))
            .and_then(|node| node.children().find(|node| node.has_tag_name("DataArray")));
        let array = match array {
            Some(array) => array,
            None if count == 0 => continue,
            None => return Err(FrameError::Missing("positions")),
        };
        if array.attribute("NumberOfComponents").is_some_and(|n| n.trim() != "3") {
            return Err(FrameError::Malformed("an array of positions that are not three numbers each"));
        }
        let coordinates = storage.numbers(array)?;
        let expected = count.checked_mul(3).ok_or(FrameError::Malformed("the number of points"))?;
        if coordinates.len() != expected {
            return Err(FrameError::Count { expected, found: coordinates.len() });
        }
        points.extend(coordinates.chunks_exact(3).map(DVec3::from_slice));
    }
    Ok(points)
}

/// The document without the appended data, and the appended data.
fn split(file: &[u8]) -> Result<(String, Option<&[u8]>), FrameError> {
    const TAG: &[u8] = b"<AppendedData";
    let start = file.windows(TAG.len()).position(|window| window == TAG);
    let text = std::str::from_utf8(&file[..start.unwrap_or(file.len())])
        .map_err(|_| FrameError::NotPolyData("it is not text".into()))?;
    let Some(start) = start else { return Ok((text.to_string(), None)) };
    let after = &file[start..];
    let end_of_tag = after.iter().position(|&b| b == b'>').ok_or(FrameError::Truncated)?;
    let tag = std::str::from_utf8(&after[..end_of_tag])
        .map_err(|_| FrameError::Malformed("the appended data"))?
        .trim_end_matches('/');
    let data = &after[end_of_tag + 1..];
    let begin = data.iter().position(|&b| b == b'_').ok_or(FrameError::Truncated)?;
    Ok((format!("{text}{tag}/></VTKFile>"), Some(&data[begin + 1..])))
}

fn number<T: std::str::FromStr>(node: Node<'_, '_>, name: &'static str) -> Result<T, FrameError> {
    let text = node.attribute(name).ok_or(FrameError::Missing(name))?;
    text.trim().parse().map_err(|_| FrameError::Malformed(name))
}

/// How a file stores its arrays.
struct Storage<'a> {
    big_endian: bool,
    /// Whether lengths have eight bytes, and not four.
    wide_lengths: bool,
    appended: Option<&'a [u8]>,
    appended_is_raw: bool,
}

impl<'a> Storage<'a> {
    fn of(root: Node<'_, '_>, appended: Option<&'a [u8]>) -> Result<Self, FrameError> {
        let encoding = root
            .children()
            .find(|node| node.has_tag_name("AppendedData"))
            .and_then(|node| node.attribute("encoding"));
        Ok(Self {
            big_endian: root.attribute("byte_order") == Some("BigEndian"),
            wide_lengths: match root.attribute("header_type") {
                None | Some("UInt32") => false,
                Some("UInt64") => true,
                Some(other) => return Err(FrameError::Unsupported(format!("lengths of the type {other}"))),
            },
            appended,
            appended_is_raw: match encoding {
                Some("raw") => true,
                None | Some("base64") => false,
                Some(other) => return Err(FrameError::Unsupported(format!("the encoding {other}"))),
            },
        })
    }

    /// The numbers of an array of floats.
    fn numbers(&self, array: Node<'_, '_>) -> Result<Vec<f64>, FrameError> {
        let wide = match array.attribute("type") {
            Some("Float32") => false,
            Some("Float64") => true,
            other => {
                let other = other.unwrap_or("nothing");
                return Err(FrameError::Unsupported(format!("positions of the type {other}")));
            }
        };
        let text = || array.text().unwrap_or_default().as_bytes();
        let bytes = match array.attribute("format") {
            None | Some("ascii") => return words(array.text().unwrap_or_default(), wide),
            Some("binary") => self.block(&base64_bytes(text(), usize::MAX)?)?.to_vec(),
            Some("appended") => {
                let appended = self.appended.ok_or(FrameError::Missing("appended data"))?;
                let from = appended.get(number(array, "offset")?..).ok_or(FrameError::Truncated)?;
                if self.appended_is_raw {
                    self.block(from)?.to_vec()
                } else {
                    // offsets count characters; other arrays follow, so the length is read first
                    let head = base64_bytes(from, self.length_size())?;
                    let bytes = self.length(&head)?.saturating_add(self.length_size());
                    self.block(&base64_bytes(from, bytes)?)?.to_vec()
                }
            }
            Some(other) => return Err(FrameError::Unsupported(format!("the format {other}"))),
        };
        let size = if wide { 8 } else { 4 };
        if bytes.len() % size != 0 {
            return Err(FrameError::Malformed("an array that ends within a number"));
        }
        Ok(bytes.chunks_exact(size).map(|chunk| self.float(chunk)).collect())
    }

    fn float(&self, bytes: &[u8]) -> f64 {
        let bits = bytes.iter().enumerate().fold(0_u64, |bits, (i, &byte)| {
            let place = if self.big_endian { bytes.len() - 1 - i } else { i };
            bits | u64::from(byte) << (8 * place)
        });
        if bytes.len() == 4 { f64::from(f32::from_bits(bits as u32)) } else { f64::from_bits(bits) }
    }

    fn length_size(&self) -> usize {
        if self.wide_lengths { 8 } else { 4 }
    }

    fn length(&self, bytes: &[u8]) -> Result<usize, FrameError> {
        let bytes = bytes.get(..self.length_size()).ok_or(FrameError::Truncated)?;
        let length = bytes.iter().enumerate().fold(0_u64, |length, (i, &byte)| {
            let place = if self.big_endian { bytes.len() - 1 - i } else { i };
            length | u64::from(byte) << (8 * place)
        });
        usize::try_from(length).map_err(|_| FrameError::Truncated)
    }

    /// The bytes of an array, which follow their length.
    fn block<'b>(&self, bytes: &'b [u8]) -> Result<&'b [u8], FrameError> {
        let length = self.length(bytes)?;
        bytes[self.length_size()..].get(..length).ok_or(FrameError::Truncated)
    }
}

fn words(text: &str, wide: bool) -> Result<Vec<f64>, FrameError> {
    let number = |word: &str| {
        let number: f64 = word.parse().map_err(|_| FrameError::Malformed("a coordinate"))?;
        Ok(if wide { number } else { f64::from(number as f32) })
    };
    text.split_ascii_whitespace().map(number).collect()
}

/// Decodes base64, which may consist of several padded parts, until the text ends or at least `most` bytes
/// are found.
fn base64_bytes(text: &[u8], most: usize) -> Result<Vec<u8>, FrameError> {
    let mut bytes = Vec::new();
    let mut group = Vec::with_capacity(4);
    for &character in text.iter().filter(|c| !c.is_ascii_whitespace()) {
        if character == b'<' || bytes.len() >= most {
            break;
        }
        group.push(character);
        if group.len() == 4 {
            let decoded = BASE64_STANDARD.decode(&group).map_err(|_| FrameError::Malformed("base64 data"))?;
            bytes.extend(decoded);
            group.clear();
        }
    }
    Ok(bytes)
}
