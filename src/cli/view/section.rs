//! ω of all solids of a scene in a plane, as a block for the page.

use rfm::Solid;
use rfm::geom::Aabb;
use rfm::slice::{self, Plane};
use rfm::view::{SliceHead, pack_slice};

/// Nodes along the longer side of a slice.
const NODES: usize = 320;

/// The block of the slice of solids at an instant in a plane across a box. Where solids overlap, ω is the greatest of
/// theirs. `None` without solids.
///
/// # Errors
/// A box without area across the axis.
pub(super) fn block(
    solids: &[Solid],
    over: &Aabb,
    plane: Plane,
    run: u64,
) -> Result<Option<Vec<u8>>, String> {
    let window = plane.window(over);
    let mut joined: Option<slice::Samples> = None;
    for solid in solids {
        let samples = slice::sample(solid, plane, window, NODES).map_err(|error| error.to_string())?;
        joined = Some(match joined {
            None => samples,
            Some(mut joined) => {
                joined.omega.iter_mut().zip(&samples.omega).for_each(|(w, other)| *w = w.max(*other));
                joined
            }
        });
    }
    let Some(samples) = joined else { return Ok(None) };
    let head = SliceHead {
        axis: plane.axis.index(),
        at: plane.value,
        columns: samples.columns,
        rows: samples.rows,
        min: window.min.to_array(),
        max: window.max.to_array(),
        levels: slice::levels(&samples),
        run,
    };
    Ok(Some(pack_slice(&head, &samples.omega)))
}
