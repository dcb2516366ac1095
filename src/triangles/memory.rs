//! The last result of a thread, kept because programs ask for ω and for the parts of ∇ω at the same point one
//! after the other, and for points beside each other.

use std::cell::RefCell;

use glam::DVec3;

use crate::table::Sample;

/// Points that are kept: those of a few vectors of a program. A power of two.
const KEPT: usize = 64;

struct Memory {
    entries: [Entry; KEPT],
    /// The solid of the last search, and the place of the triangle that it found.
    last: (u64, u32),
}

#[derive(Clone, Copy)]
struct Entry {
    solid: u64,
    point: DVec3,
    found: Sample,
}

thread_local! {
    static MEMORY: RefCell<Memory> = const {
        let found = Sample { value: 0.0, gradient: DVec3::ZERO };
        // no solid has the number 0
        let none = Entry { solid: 0, point: DVec3::ZERO, found };
        RefCell::new(Memory { entries: [none; KEPT], last: (0, 0) })
    };
}

/// What was found at a point, or what `search` finds; it receives the triangle of the last search as a hint.
pub fn remembered(solid: u64, point: DVec3, search: impl FnOnce(Option<u32>) -> (Sample, u32)) -> Sample {
    MEMORY.with_borrow_mut(|memory| {
        let entry = &mut memory.entries[place(point)];
        // zeros of either sign are one point
        if entry.solid == solid && entry.point == point {
            return entry.found;
        }
        let (found, triangle) = search((memory.last.0 == solid).then_some(memory.last.1));
        *entry = Entry { solid, point, found };
        memory.last = (solid, triangle);
        found
    })
}

fn place(point: DVec3) -> usize {
    let [x, y, z] = point.to_array().map(|c| (c + 0.0).to_bits());
    let mixed = x ^ y.rotate_left(21) ^ z.rotate_left(42);
    (mixed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (64 - KEPT.trailing_zeros())) as usize
}
