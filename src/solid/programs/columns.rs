//! The columns of one block of points: the caller's, and those that the steps of a program hand on.

use std::ops::Range;

use super::kernels::{Kernel, WeightedKernel};

/// Where a result is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnPlace {
    /// A column of the block's own.
    Own(u32),
    /// A column of the caller.
    Output(u32),
}

/// Working memory of a thread, kept between calls so that none of them allocates.
#[derive(Debug, Default)]
pub struct Scratch<T> {
    pub columns: Vec<T>,
    pub pointers: Vec<*mut T>,
    /// The parameters of a program whose parts take uniforms as such.
    pub parameters: Vec<T>,
}

/// The columns of one block: the caller's, and those that steps hand on.
pub struct Frame<'a, 'o, T> {
    /// x, y, z of the block's points.
    pub points: [&'a [T]; 3],
    pub outputs: &'a mut [&'o mut [T]],
    /// Numbers that depend on time alone.
    pub uniforms: &'a [T],
    /// Columns of [`Frame::stride`] numbers each.
    pub columns: &'a mut [T],
    pub stride: usize,
    /// Room for the pointers that a piece is called with.
    pub pointers: &'a mut Vec<*mut T>,
}

impl<T: Copy> Frame<'_, '_, T> {
    /// Points of the block.
    pub fn len(&self) -> usize {
        self.points[0].len()
    }

    /// Where a column lies in `columns`. Only results are written to the caller's columns, and nothing is
    /// read back from them.
    fn range(&self, place: ColumnPlace) -> Range<usize> {
        match place {
            ColumnPlace::Own(column) => {
                let start = column as usize * self.stride;
                start..start + self.len()
            }
            ColumnPlace::Output(_) => unreachable!("the planner reads no output"),
        }
    }

    pub fn junction(&mut self, kernel: Kernel<T>, operands: [ColumnPlace; 2], value: ColumnPlace) {
        let [u, v] = operands.map(|place| self.range(place));
        match value {
            ColumnPlace::Output(i) => kernel(&self.columns[u], &self.columns[v], self.outputs[i as usize]),
            ColumnPlace::Own(_) => {
                let out = self.range(value);
                if u == v {
                    let [u, out] = self.disjoint([u, out]);
                    kernel(u, u, out);
                } else {
                    let [u, v, out] = self.disjoint([u, v, out]);
                    kernel(u, v, out);
                }
            }
        }
    }

    pub fn weighted(
        &mut self,
        kernel: WeightedKernel<T>,
        operands: [ColumnPlace; 2],
        results: [ColumnPlace; 3],
    ) {
        let ([u, v], [value, by_u, by_v]) =
            (operands.map(|place| self.range(place)), results.map(|place| self.range(place)));
        if u == v {
            let [u, value, by_u, by_v] = self.disjoint([u, value, by_u, by_v]);
            kernel(u, u, [value, by_u, by_v]);
        } else {
            let [u, v, value, by_u, by_v] = self.disjoint([u, v, value, by_u, by_v]);
            kernel(u, v, [value, by_u, by_v]);
        }
    }

    pub fn copy(&mut self, from: ColumnPlace, to: ColumnPlace) {
        let from = self.range(from);
        match to {
            ColumnPlace::Output(i) => self.outputs[i as usize].copy_from_slice(&self.columns[from]),
            ColumnPlace::Own(_) => {
                let to = self.range(to);
                self.columns.copy_within(from, to.start);
            }
        }
    }

    fn disjoint<const N: usize>(&mut self, ranges: [Range<usize>; N]) -> [&mut [T]; N] {
        match self.columns.get_disjoint_mut(ranges) {
            Ok(columns) => columns,
            Err(_) => unreachable!("the planner gives results columns of their own"),
        }
    }
}
