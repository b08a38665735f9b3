//! Sub-pixels sorted by the triangle that they show, so that those of one triangle are computed together.

use crate::screen::padded_tile::{NONE, SPAN_WIDTH};

/// Sub-pixels that stand beside each other in a row and show one triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Run {
    /// Place of the triangle in the tile's list.
    pub(crate) id: u32,
    /// The first sub-pixel, by its place in the tile's span.
    pub(crate) subpixel: u32,
    /// Where the colour of the first one goes; those of the others follow.
    pub(crate) place: u32,
    /// How many they are.
    pub(crate) len: u32,
}

/// Runs of sub-pixels, triangle by triangle.
#[derive(Clone, Debug, Default)]
pub(crate) struct ByTriangle {
    /// As they came.
    runs: Vec<Run>,
    sorted: Vec<Run>,
    /// By triangle: how many runs it has, then where its next one goes; 0 for those that are not shown.
    next: Vec<u32>,
    shown: Vec<u32>,
}

impl ByTriangle {
    /// Forgets all runs.
    pub(crate) fn clear(&mut self) {
        self.runs.clear();
    }

    /// Adds the runs of a row: of the wanted sub-pixels that show something.
    #[inline(always)]
    pub(crate) fn push_row(&mut self, ids: &[u32], wanted: &[bool], [subpixel, place]: [u32; 2]) {
        let (ids, wanted) = (&ids[..SPAN_WIDTH], &wanted[..SPAN_WIDTH]);
        let mut column = 0;
        while column < SPAN_WIDTH {
            let (first, id) = (column, ids[column]);
            column += 1;
            if !wanted[first] || id == NONE {
                continue;
            }
            while column < SPAN_WIDTH && wanted[column] && ids[column] == id {
                column += 1;
            }
            self.runs.push(Run {
                id,
                subpixel: subpixel + first as u32,
                place: place + first as u32,
                len: (column - first) as u32,
            });
        }
    }

    /// Sorts the runs: triangle by triangle, in the order in which these came first. The tile's list has so many triangles.
    pub(crate) fn sort(&mut self, triangles: usize) -> &[Run] {
        let Self {
            runs,
            sorted,
            next,
            shown,
        } = self;
        if next.len() < triangles {
            next.resize(triangles, 0);
        }
        shown.clear();
        for run in &*runs {
            let count = &mut next[run.id as usize];
            if *count == 0 {
                shown.push(run.id);
            }
            *count += 1;
        }
        let mut start = 0;
        for &id in &*shown {
            start += std::mem::replace(&mut next[id as usize], start);
        }
        sorted.resize(runs.len(), Run::default());
        for run in &*runs {
            let at = &mut next[run.id as usize];
            sorted[*at as usize] = *run;
            *at += 1;
        }
        shown.iter().for_each(|&id| next[id as usize] = 0);
        sorted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_a_triangle_stand_together_in_their_order() {
        let mut by_triangle = ByTriangle::default();
        let mut ids = [NONE; SPAN_WIDTH];
        ids[2..9].copy_from_slice(&[7, 7, 2, 2, 2, NONE, 7]);
        ids[SPAN_WIDTH - 1] = 0;
        let mut wanted = [true; SPAN_WIDTH];
        wanted[5] = false;
        let run = |id, subpixel, len| Run {
            id,
            subpixel,
            place: subpixel + 1000,
            len,
        };
        // Storage is used again.
        for _ in 0..2 {
            by_triangle.clear();
            by_triangle.push_row(&ids, &wanted, [100, 1100]);
            by_triangle.push_row(&[2; SPAN_WIDTH], &[true; SPAN_WIDTH], [300, 1300]);
            let last = 100 + SPAN_WIDTH as u32 - 1;
            let sorted = [
                run(7, 102, 2),
                run(7, 108, 1),
                run(2, 104, 1),
                run(2, 106, 1),
                run(2, 300, SPAN_WIDTH as u32),
                run(0, last, 1),
            ];
            assert_eq!(by_triangle.sort(8), sorted);
        }
    }
}
