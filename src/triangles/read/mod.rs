//! Files of triangles: STL, OBJ and PLY, as text or as bytes. Messages say what is wrong and where.

mod obj;
mod ply;
mod polygon;
mod stl;

use glam::DVec3;

/// The endings of files that are read.
pub const FORMATS: [&str; 3] = ["stl", "obj", "ply"];

/// Whether the format of a file with this name is read.
pub fn is_known(name: &str) -> bool {
    name.rsplit_once('.').is_some_and(|(_, ending)| FORMATS.contains(&ending.to_ascii_lowercase().as_str()))
}

/// The corners of a file's triangles, in the order of the file; polygons are cut into triangles. The format
/// is that of the name's ending.
///
/// # Errors
/// What is wrong with the file, in a few words.
pub fn read(name: &str, bytes: &[u8]) -> Result<Vec<[DVec3; 3]>, String> {
    let ending = name.rsplit_once('.').map_or("", |(_, ending)| ending).to_ascii_lowercase();
    match ending.as_str() {
        "stl" => stl::read(bytes),
        "obj" => obj::read(text(bytes)?),
        "ply" => ply::read(bytes),
        _ => Err(format!("its name does not end in .{}", FORMATS.join(", ."))),
    }
}

fn text(bytes: &[u8]) -> Result<&str, String> {
    std::str::from_utf8(bytes)
        .map_err(|error| format!("byte {} does not belong to a character", error.valid_up_to()))
}

/// A number of a line of text.
fn number(word: Option<&str>, line: usize) -> Result<f64, String> {
    let word = word.ok_or_else(|| format!("line {line} lacks a number"))?;
    word.parse().map_err(|_| format!("line {line} has `{word}` where a number should be"))
}

/// Three numbers of a line of text.
fn point<'t>(words: &mut impl Iterator<Item = &'t str>, line: usize) -> Result<DVec3, String> {
    Ok(DVec3::new(number(words.next(), line)?, number(words.next(), line)?, number(words.next(), line)?))
}

/// The triangles of a polygon that names its corners.
fn cut(places: &[DVec3], polygon: &[usize], out: &mut Vec<[DVec3; 3]>) -> Result<(), String> {
    let at = |&i: &usize| {
        let missing = || format!("a face names corner {i}, and there are {}", places.len());
        places.get(i).copied().ok_or_else(missing)
    };
    let corners: Vec<DVec3> = polygon.iter().map(at).collect::<Result<_, _>>()?;
    polygon::cut(&corners, out)
}
