//! STL: triangles alone, as text or as 50 bytes each.

use glam::DVec3;

use super::{point, text};

/// Bytes before the triangles of a binary file: 80 of any kind, and their number.
const HEADER: usize = 84;

/// A normal, three corners, and two bytes that mean nothing.
const TRIANGLE: usize = 50;

pub fn read(bytes: &[u8]) -> Result<Vec<[DVec3; 3]>, String> {
    let count =
        bytes.get(80..HEADER).map(|count| u32::from_le_bytes([count[0], count[1], count[2], count[3]]));
    let expected = count.map(|count| HEADER as u64 + TRIANGLE as u64 * u64::from(count));
    if expected == Some(bytes.len() as u64) {
        return Ok(bytes[HEADER..].chunks_exact(TRIANGLE).map(triangle).collect());
    }
    if bytes.trim_ascii_start().starts_with(b"solid") {
        return of_text(text(bytes)?);
    }
    match expected {
        Some(expected) => Err(format!("it has {} bytes, and its header says {expected}", bytes.len())),
        None if bytes.is_empty() => Err("it is empty".into()),
        None => Err(format!(
            "it is no text that begins with `solid`, and {} bytes are too few for the {HEADER} of a binary file",
            bytes.len()
        )),
    }
}

fn triangle(bytes: &[u8]) -> [DVec3; 3] {
    let coordinate = |i: usize| {
        let at = 12 + 4 * i;
        f64::from(f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]))
    };
    [0, 3, 6].map(|i| DVec3::new(coordinate(i), coordinate(i + 1), coordinate(i + 2)))
}

fn of_text(text: &str) -> Result<Vec<[DVec3; 3]>, String> {
    let mut triangles = Vec::new();
    let mut corners = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("vertex") => corners.push(point(&mut words, i + 1)?),
            Some("endloop" | "endfacet") if !corners.is_empty() => {
                let Ok(triangle) = <[DVec3; 3]>::try_from(std::mem::take(&mut corners)) else {
                    return Err(format!("the facet that ends on line {} has not three corners", i + 1));
                };
                triangles.push(triangle);
            }
            _ => {}
        }
    }
    if corners.is_empty() { Ok(triangles) } else { Err("it ends within a facet".into()) }
}
