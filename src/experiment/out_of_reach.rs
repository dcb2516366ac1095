//! Obstacles that no fluid can meet: they lie outside the box, or in the wall of the container.

use super::room::{part_in_box, samples};
use crate::field::is_flat;
use crate::geom::Aabb;
use crate::solid::{ProgramKind, Solid};

/// Limits of the search for an obstacle that reaches into the room: the number of boxes, and of operations of
/// its formula that are evaluated for them. Together they take some tenths of a second.
const MOST: (usize, usize) = (200_000, 20_000_000);

/// Whether, at all times from 0 to `until`, s, an obstacle covers no place where fluid could be without it.
/// An obstacle that reaches into the room by less than `depth`, m, may count as out of reach. `outside` is
/// the outside of the container.
///
/// Returns false also where the search takes too long, and inside a container that moves.
pub fn is_out_of_reach(
    obstacle: &Solid,
    outside: Option<&Solid>,
    domain: &Aabb,
    until: f64,
    depth: f64,
) -> bool {
    let obstacle = obstacle.between(0.0, until);
    let outside = outside.map(|solid| solid.between(0.0, until));
    let Some(part) = part_in_box(&obstacle, domain) else { return false };
    if is_flat(&part) {
        return true;
    }
    if outside.as_ref().is_some_and(|outside| outside.moves()) {
        return false;
    }
    // most obstacles are seen at once
    let is_free = |p| outside.as_ref().is_none_or(|outside| outside.omega(p) < 0.0);
    if samples(&part).any(|p| obstacle.omega(p) > 0.0 && is_free(p)) {
        return false;
    }
    let middle = domain.grown(-depth);
    let mut left = vec![part];
    let operations = |solid: &Solid| solid.graph(ProgramKind::Value).0.len();
    let operations = operations(&obstacle) + outside.as_ref().map_or(0, operations);
    for _ in 0..MOST.0.min(MOST.1 / operations.max(1)) {
        let Some(place) = left.pop() else { return true };
        if obstacle.range(&place).hi <= 0.0 {
            continue;
        }
        let wall = outside.as_ref().map(|outside| outside.range(&place));
        if wall.is_some_and(|wall| wall.lo >= 0.0) {
            continue;
        }
        if place.size().max_element() > depth {
            left.extend(place.halves());
        } else if middle.intersection(&place) == place
            && (wall.is_none_or(|wall| wall.hi < 0.0) || is_free(place.centre()))
        {
            return false; // away from all walls, and the obstacle may be there
        }
    }
    false
}
