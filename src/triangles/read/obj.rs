//! OBJ: corners, and faces that name them from 1, or backwards from −1. Anything else in the file is passed over.

use glam::DVec3;

use super::{cut, point};

pub fn read(text: &str) -> Result<Vec<[DVec3; 3]>, String> {
    let mut places: Vec<DVec3> = Vec::new();
    let mut triangles = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => places.push(point(&mut words, i + 1)?),
            Some("f") => {
                let polygon: Vec<usize> =
                    words.map(|word| corner(word, places.len(), i + 1)).collect::<Result<_, _>>()?;
                if polygon.len() < 3 {
                    return Err(format!("the face on line {} has fewer than three corners", i + 1));
                }
                cut(&places, &polygon, &mut triangles)?;
            }
            _ => {}
        }
    }
    Ok(triangles)
}

/// The number of a corner, from 0: of `7`, `7/1`, `7//3` or `-2`.
fn corner(word: &str, known: usize, line: usize) -> Result<usize, String> {
    let written = word.split('/').next().unwrap_or(word);
    let number: i64 =
        written.parse().map_err(|_| format!("line {line} has `{word}` where a corner should be"))?;
    let place = if number < 0 { known as i64 + number } else { number - 1 };
    usize::try_from(place)
        .ok()
        .filter(|&place| place < known)
        .ok_or_else(|| format!("line {line} names corner {number}, and {known} are defined above it"))
}
