//! VTK PolyData files (`.vtp`): the positions of their points, the arrays of numbers at them, their triangles.

use glam::DVec3;
use roxmltree::{Document, Node};

use super::error::FrameError;
use super::storage::{Storage, number};
use crate::mesh::Mesh;

/// An array of numbers at the points of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct PointArray {
    /// Its name, for example `speed`.
    pub name: String,
    /// How many numbers each point has.
    pub components: usize,
    /// The numbers of all points, in their order.
    pub values: Vec<f64>,
}

/// Reads the positions of all points from the bytes of a file, in their order. NaN and infinite coordinates
/// are kept.
///
/// # Errors
/// [`FrameError`] if the file is no PolyData, is stored in an unknown way, or is damaged.
pub fn read_points(file: &[u8]) -> Result<Vec<DVec3>, FrameError> {
    let mut points = Vec::new();
    for_each_piece(file, |piece, storage| {
        points.extend(positions(piece, storage)?);
        Ok(())
    })?;
    Ok(points)
}

/// Reads the positions of all points and the arrays at them. If a file has several pieces, an array is kept if all
/// of them have it.
///
/// # Errors
/// See [`read_points`].
pub fn read_arrays(file: &[u8]) -> Result<(Vec<DVec3>, Vec<PointArray>), FrameError> {
    let (mut points, mut arrays) = (Vec::new(), Vec::<PointArray>::new());
    for_each_piece(file, |piece, storage| {
        let is_first = points.is_empty();
        let own = positions(piece, storage)?;
        let data = piece.children().filter(|node| node.has_tag_name("PointData"));
        for array in data.flat_map(|node| node.children()).filter(|node| node.has_tag_name("DataArray")) {
            let components: usize = match array.attribute("NumberOfComponents") {
                None => 1,
                Some(_) => number(array, "NumberOfComponents")?,
            };
            let name = array.attribute("Name").unwrap_or_default();
            let values = storage.numbers(array)?;
            let expected = own.len().checked_mul(components).ok_or(FrameError::Malformed("an array"))?;
            if values.len() != expected {
                return Err(FrameError::Count { expected, found: values.len() });
            }
            match arrays.iter_mut().find(|known| known.name == name && known.components == components) {
                Some(known) => known.values.extend(values),
                None if is_first => arrays.push(PointArray { name: name.into(), components, values }),
                None => {}
            }
        }
        points.extend(own);
        Ok(())
    })?;
    arrays.retain(|array| array.values.len() == points.len() * array.components);
    Ok((points, arrays))
}

/// Reads a mesh of triangles. Its normals are those of the file's array `normals`, and otherwise those of the
/// triangles.
///
/// # Errors
/// Those of [`read_points`], and if a face is no triangle or has a corner that does not exist.
pub fn read_mesh(file: &[u8]) -> Result<Mesh, FrameError> {
    let mut triangles = Vec::new();
    let mut before = 0;
    for_each_piece(file, |piece, storage| {
        let count: usize = number(piece, "NumberOfPoints")?;
        let polys = piece.children().find(|node| node.has_tag_name("Polys"));
        let array = |name: &str| {
            let arrays = polys.into_iter().flat_map(|node| node.children());
            arrays.into_iter().find(|node| node.attribute("Name") == Some(name))
        };
        let (Some(corners), Some(ends)) = (array("connectivity"), array("offsets")) else { return Ok(()) };
        let (corners, ends) = (storage.numbers(corners)?, storage.numbers(ends)?);
        let are_triangles = corners.len() == 3 * ends.len()
            && ends.iter().enumerate().all(|(i, &end)| end == 3.0 * (i as f64 + 1.0));
        if !are_triangles {
            return Err(FrameError::Unsupported("a face that is no triangle".into()));
        }
        if corners.iter().any(|&corner| !(corner >= 0.0 && corner < count as f64)) {
            return Err(FrameError::Malformed("a face"));
        }
        let index = |corner: f64| before + corner as u32;
        triangles.extend(corners.chunks_exact(3).map(|t| [index(t[0]), index(t[1]), index(t[2])]));
        let count = u32::try_from(count).ok().and_then(|count| count.checked_add(before));
        before = count.ok_or(FrameError::Malformed("the number of points"))?;
        Ok(())
    })?;
    let (positions, arrays) = read_arrays(file)?;
    let normals = arrays.into_iter().find(|array| array.name == "normals" && array.components == 3);
    Ok(match normals {
        Some(array) => {
            let normals = array.values.chunks_exact(3).map(DVec3::from_slice).collect();
            Mesh { positions, normals, triangles, ..Mesh::default() }
        }
        None => Mesh::from_triangles(positions, triangles),
    })
}

/// Hands the pieces of a file to a reader, with the way in which the file stores its arrays.
fn for_each_piece(
    file: &[u8],
    mut read: impl FnMut(Node<'_, '_>, &Storage<'_>) -> Result<(), FrameError>,
) -> Result<(), FrameError> {
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
    root.descendants().filter(|node| node.has_tag_name("Piece")).try_for_each(|piece| read(piece, &storage))
}

/// The positions of a piece.
fn positions(piece: Node<'_, '_>, storage: &Storage<'_>) -> Result<Vec<DVec3>, FrameError> {
    let count: usize = number(piece, "NumberOfPoints")?;
    let array = piece
        .children()
        .find(|node| node.has_tag_name("Points"))
        .and_then(|node| node.children().find(|node| node.has_tag_name("DataArray")));
    let array = match array {
        Some(array) => array,
        None if count == 0 => return Ok(Vec::new()),
        None => return Err(FrameError::Missing("positions")),
    };
    if array.attribute("NumberOfComponents").is_some_and(|n| n.trim() != "3") {
        return Err(FrameError::Malformed("an array of positions that are not three numbers each"));
    }
    if let Some(kind) = array.attribute("type").filter(|kind| kind.contains("Int")) {
        return Err(FrameError::Unsupported(format!("positions of the type {kind}")));
    }
    let coordinates = storage.numbers(array)?;
    let expected = count.checked_mul(3).ok_or(FrameError::Malformed("the number of points"))?;
    if coordinates.len() != expected {
        return Err(FrameError::Count { expected, found: coordinates.len() });
    }
    Ok(coordinates.chunks_exact(3).map(DVec3::from_slice).collect())
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
