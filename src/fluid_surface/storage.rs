//! How a VTK PolyData file stores its arrays.
//!
//! All ways in which such files store arrays without compression can be read: as text, as base64 in the
//! element, and appended behind the document, raw or as base64; in either byte order, with 32- or 64-bit
//! lengths and numbers.
//!
//! Invariant: a length that the file states is not trusted before the bytes are there.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use roxmltree::Node;

use super::error::FrameError;

/// A number that an element states.
pub(super) fn number<T: std::str::FromStr>(node: Node<'_, '_>, name: &'static str) -> Result<T, FrameError> {
    let text = node.attribute(name).ok_or(FrameError::Missing(name))?;
    text.trim().parse().map_err(|_| FrameError::Malformed(name))
}

/// How a file stores its arrays.
pub(super) struct Storage<'a> {
    big_endian: bool,
    /// Whether lengths have eight bytes, and not four.
    wide_lengths: bool,
    appended: Option<&'a [u8]>,
    appended_is_raw: bool,
}

impl<'a> Storage<'a> {
    pub fn of(root: Node<'_, '_>, appended: Option<&'a [u8]>) -> Result<Self, FrameError> {
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

    /// The numbers of an array. Those of whole numbers are exact up to 2⁵³.
    pub fn numbers(&self, array: Node<'_, '_>) -> Result<Vec<f64>, FrameError> {
        let kind = Kind::of(array.attribute("type").unwrap_or("nothing"))?;
        let text = || array.text().unwrap_or_default().as_bytes();
        let bytes = match array.attribute("format") {
            None | Some("ascii") => return words(array.text().unwrap_or_default(), kind),
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
        if bytes.len() % kind.size != 0 {
            return Err(FrameError::Malformed("an array that ends within a number"));
        }
        // what runs write needs no look at every byte
        let is_plain = kind.sort == Sort::Float && !self.big_endian;
        Ok(if is_plain && kind.size == 4 {
            bytes.as_chunks().0.iter().map(|four| f32::from_le_bytes(*four).into()).collect()
        } else if is_plain {
            bytes.as_chunks().0.iter().map(|eight| f64::from_le_bytes(*eight)).collect()
        } else {
            bytes.chunks_exact(kind.size).map(|chunk| kind.number(self.bits(chunk))).collect()
        })
    }

    /// The bits of a number.
    fn bits(&self, bytes: &[u8]) -> u64 {
        bytes.iter().enumerate().fold(0_u64, |bits, (i, &byte)| {
            let place = if self.big_endian { bytes.len() - 1 - i } else { i };
            bits | u64::from(byte) << (8 * place)
        })
    }

    fn length_size(&self) -> usize {
        if self.wide_lengths { 8 } else { 4 }
    }

    fn length(&self, bytes: &[u8]) -> Result<usize, FrameError> {
        let bytes = bytes.get(..self.length_size()).ok_or(FrameError::Truncated)?;
        usize::try_from(self.bits(bytes)).map_err(|_| FrameError::Truncated)
    }

    /// The bytes of an array, which follow their length.
    fn block<'b>(&self, bytes: &'b [u8]) -> Result<&'b [u8], FrameError> {
        let length = self.length(bytes)?;
        bytes[self.length_size()..].get(..length).ok_or(FrameError::Truncated)
    }
}

/// The type of the numbers of an array.
#[derive(Clone, Copy)]
struct Kind {
    /// Bytes of a number.
    size: usize,
    sort: Sort,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Sort {
    Float,
    Signed,
    Unsigned,
}

impl Kind {
    fn of(name: &str) -> Result<Self, FrameError> {
        let (sort, size) = match name {
            "Float32" => (Sort::Float, 4),
            "Float64" => (Sort::Float, 8),
            "Int8" => (Sort::Signed, 1),
            "Int16" => (Sort::Signed, 2),
            "Int32" => (Sort::Signed, 4),
            "Int64" => (Sort::Signed, 8),
            "UInt8" => (Sort::Unsigned, 1),
            "UInt16" => (Sort::Unsigned, 2),
            "UInt32" => (Sort::Unsigned, 4),
            "UInt64" => (Sort::Unsigned, 8),
            other => return Err(FrameError::Unsupported(format!("an array of the type {other}"))),
        };
        Ok(Self { size, sort })
    }

    fn number(self, bits: u64) -> f64 {
        match (self.sort, self.size) {
            (Sort::Float, 4) => f64::from(f32::from_bits(bits as u32)),
            (Sort::Float, _) => f64::from_bits(bits),
            (Sort::Unsigned, _) => bits as f64,
            (Sort::Signed, size) => {
                let above = 64 - 8 * size as u32;
                (((bits << above) as i64) >> above) as f64
            }
        }
    }
}

fn words(text: &str, kind: Kind) -> Result<Vec<f64>, FrameError> {
    let number = |word: &str| {
        let number: f64 = word.parse().map_err(|_| FrameError::Malformed("a number"))?;
        Ok(if kind.sort == Sort::Float && kind.size == 4 { f64::from(number as f32) } else { number })
    };
    text.split_ascii_whitespace().map(number).collect()
}

/// Characters that are decoded together; a multiple of four.
const TOGETHER: usize = 4096;

/// Decodes base64, which may consist of several padded parts, until the text ends or at least `most` bytes
/// are found.
fn base64_bytes(text: &[u8], most: usize) -> Result<Vec<u8>, FrameError> {
    let mut bytes = Vec::with_capacity(text.len().min(most) / 4 * 3);
    let mut characters = Vec::with_capacity(TOGETHER);
    let decode = |characters: &mut Vec<u8>, bytes: &mut Vec<u8>| {
        let whole = characters.len() / 4 * 4;
        let decoded = BASE64_STANDARD.decode_vec(&characters[..whole], bytes);
        characters.clear();
        decoded.map_err(|_| FrameError::Malformed("base64 data"))
    };
    for &character in text.iter().filter(|c| !c.is_ascii_whitespace()) {
        if character == b'<' || bytes.len() >= most {
            break;
        }
        characters.push(character);
        let is_group = characters.len().is_multiple_of(4);
        let is_enough = bytes.len() + characters.len() / 4 * 3 >= most;
        if is_group && (character == b'=' || characters.len() == TOGETHER || is_enough) {
            decode(&mut characters, &mut bytes)?;
        }
    }
    decode(&mut characters, &mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_any_parts_and_lines_is_decoded() {
        let bytes: Vec<u8> = (0..20_000_u32).map(|i| (i * 31 % 251) as u8).collect();
        // parts of all lengths, each with its own padding, as VTK writes lengths and data
        for parts in [&[20_000][..], &[4, 19_996], &[8, 1, 2, 3, 3071, 3072, 3073], &[0, 5]] {
            let (mut text, mut from) = (String::new(), 0);
            for part in parts {
                text += &BASE64_STANDARD.encode(&bytes[from..from + part]);
                from += part;
            }
            let broken: String = text
                .chars()
                .enumerate()
                .flat_map(|(k, c)| if k % 77 == 5 { vec!['\n', ' ', c] } else { vec![c] })
                .collect();
            for text in [text.clone(), broken, format!("  {text}\n</DataArray>")] {
                assert!(base64_bytes(text.as_bytes(), usize::MAX).unwrap() == bytes[..from], "{parts:?}");
                for most in [1, 4, 8, 3072, 5000].into_iter().filter(|most| *most <= from) {
                    let found = base64_bytes(text.as_bytes(), most).unwrap();
                    assert!(found.len() >= most && found[..] == bytes[..found.len()], "{parts:?} {most}");
                    assert!(found.len() < most + 3, "no more than asked for");
                }
            }
        }
        // what is no base64 is an error, and an unfinished group is left out
        assert!(base64_bytes(b"AAA*", usize::MAX).is_err() && base64_bytes(b"A=AA", usize::MAX).is_err());
        assert_eq!(base64_bytes(b"AAAAAA", usize::MAX).unwrap(), [0; 3]);
    }
}
