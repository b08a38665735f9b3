//! Sheets of lines: all lines of a direction that stand in the same row of each slice.
//!
//! A sheet needs nothing of its neighbours, and its sums over the slices within a radius stay in the cache.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::{DVec3, Vec3};
use resample_core::narrow::{floor, single};
use resample_core::simd::exp2;

use crate::look::clip::GridClip;
use crate::shadow::vertices::{Around, LANES, Soft, Vertices, lanes, mix};

/// A pair of opposite directions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    /// The axis across which slices lie.
    pub(super) along: usize,
    /// From one slice to the next, vertices; 1 along the axis.
    pub(super) step: DVec3,
    /// The way from slice to slice, opacity units.
    pub(super) length: f32,
    /// Whole slices within the radius, and a share of one.
    pub(super) reach: usize,
    pub(super) fraction: f32,
    /// Share of the sky around each of the two directions.
    pub(super) weight: f32,
    /// In the world, of length 1.
    pub(super) direction: Vec3,
}

/// A row of vertices by its number, and their shares of the sky.
pub(super) type SheetRow<'a> = Option<(usize, &'a mut [f32])>;

/// How lines pass from slice to slice. Each stands at a whole vertex in each of them.
pub(super) struct Course<'a> {
    line: &'a Line,
    /// For each slice, the column of its first vertex, and the sheet of its first row.
    firsts: Vec<[usize; 2]>,
    /// Vertices along a row, and rows of a slice.
    sides: [usize; 2],
    /// The axis from row to row of a slice.
    across: usize,
    /// Columns up to whole vectors.
    width: usize,
}

impl<'a> Course<'a> {
    pub(super) fn new(vertices: &Vertices, line: &'a Line) -> Self {
        let [fast, row, slice] = vertices.axes;
        let across = if line.along == slice { row } else { slice };
        let slices = vertices.within.len(line.along);
        // Halves are rounded away from 0, so that directions to both sides are alike.
        let moved = |slice: usize| {
            [fast, across].map(|axis| {
                let shift = line.step[axis];
                let moved = floor(shift.abs() * slice as f64 + 0.5);
                if shift < 0.0 { -moved } else { moved }
            })
        };
        let end = moved(slices - 1);
        let firsts = (0..slices).map(|slice| {
            let moved = moved(slice);
            [0, 1].map(|side| usize::try_from(end[side].max(0) - moved[side]).unwrap_or(0))
        });
        let sides = [fast, across].map(|axis| vertices.within.len(axis));
        let more = usize::try_from(end[0].abs()).unwrap_or(0);
        Self {
            line,
            firsts: firsts.collect(),
            sides,
            across,
            width: (sides[0] + more).next_multiple_of(LANES),
        }
    }

    pub(super) fn slices(&self) -> usize {
        self.firsts.len()
    }

    /// Number of sheets.
    pub(super) fn sheets(&self) -> usize {
        let [first, last] = [0, self.slices() - 1].map(|slice: usize| self.firsts[slice][1]);
        self.sides[1] + first.max(last)
    }

    /// Returns true if both have the same rows in their sheets.
    pub(super) fn has_sheets_of(&self, other: &Self) -> bool {
        let [own, its] = [self, other].map(|course| (course.line.along, course.line.step));
        own.0 == its.0 && own.1[self.across] == its.1[self.across]
    }

    /// The columns of the vertices that see a slice.
    fn window(&self, slice: usize) -> [usize; 2] {
        let last = self.slices() - 1;
        let reach = self.line.reach + 1;
        let [a, b] =
            [slice.saturating_sub(reach), slice + reach].map(|end| self.firsts[end.min(last)][0]);
        whole_vectors([a.min(b), a.max(b) + self.sides[0]])
    }

    /// The sheet that a row of vertices lies in, and its slice.
    pub(super) fn sheet_of_row(&self, vertices: &Vertices, row: usize) -> [usize; 2] {
        let [place, slice] = vertices.place_of_row(row, self.across);
        [place + self.firsts[slice][1], slice]
    }
}

/// Sums along the lines of a sheet.
pub(super) struct Sums {
    /// At the slice before, at the slice, and at the one after it.
    around: [Slice; 3],
    /// Optical depth up to the middle between the slice and the one after it, in log2.
    whole: Vec<f32>,
    /// Optical depth up to slices that follow each other, in log2, as many as lie within the radius and one more; the slice n is the n-th,
    /// counted round.
    depths: Vec<Vec<f32>>,
    light: Vec<f32>,
    skins: Vec<f32>,
    /// Normals of an isosurface, and optical depths in front of its vertices.
    soft: [Vec<f32>; 4],
}

/// A slice on the lines of a sheet.
struct Slice {
    strengths: Vec<f32>,
    /// 1 in the box of all bricks, 0 outside of it.
    inside: Vec<f32>,
    /// Optical depths in front of the vertices around an isosurface.
    soft: Vec<f32>,
    /// The columns in that box.
    columns: [usize; 2],
    /// Columns that show something, of whole vectors: from the first to the last.
    shown: [usize; 2],
    cut: Option<Halves>,
}

/// The parts of the ways to the neighbours that a clip keeps.
struct Halves {
    /// Shares of a step, up to a half, before and after each vertex.
    kept: [Vec<f32>; 2],
    /// 1 where all of it is kept, else 0.
    are_whole: Vec<f32>,
}

impl Sums {
    pub(super) fn new(course: &Course) -> Self {
        let zeros = || vec![0.0; course.width];
        let slice = || Slice {
            strengths: zeros(),
            inside: zeros(),
            soft: zeros(),
            columns: [0; 2],
            shown: [0; 2],
            cut: None,
        };
        // What lies beyond the first or the last slice has no depth.
        let reach = course.line.reach.min(course.slices());
        Self {
            around: [slice(), slice(), slice()],
            whole: zeros(),
            depths: vec![zeros(); reach + 2],
            light: zeros(),
            skins: zeros(),
            soft: [zeros(), zeros(), zeros(), zeros()],
        }
    }

    fn reset(&mut self) {
        for slice in &mut self.around {
            slice.leave();
        }
        self.whole.fill(0.0);
        for depths in &mut self.depths {
            depths.fill(0.0);
        }
    }

    fn reach(&self) -> usize {
        self.depths.len() - 2
    }
}

impl Slice {
    /// Becomes one outside of the box.
    fn leave(&mut self) {
        let [first, end] = self.columns;
        self.strengths[first..end].fill(0.0);
        self.inside[first..end].fill(0.0);
        self.soft[first..end].fill(0.0);
        (self.columns, self.shown) = ([0; 2], [0; 2]);
    }

    /// Takes columns in that show something.
    fn show(&mut self, [first, end]: [usize; 2]) {
        let [from, to] = self.shown;
        let first = if from < to { first.min(from) } else { first };
        self.shown = whole_vectors([first, end.max(to)]);
    }
}

impl Halves {
    fn new(width: usize) -> Self {
        let halves = || vec![0.5; width];
        Self {
            kept: [halves(), halves()],
            are_whole: vec![1.0; width],
        }
    }

    fn reset(&mut self) {
        for kept in &mut self.kept {
            kept.fill(0.5);
        }
        self.are_whole.fill(1.0);
    }
}

/// Matter and lines, which the sheets of a direction share.
pub(super) struct Sheet<'a> {
    pub(super) matter: Around<'a>,
    /// The vertices of bricks that a clip cuts.
    pub(super) cut: Option<(&'a Vertices<'a>, &'a GridClip)>,
    pub(super) course: &'a Course<'a>,
}

/// Where depths end that are seen from a slice: between two slices, this share of the way back from the second.
struct End<'a> {
    depths: [&'a [f32]; 2],
    back: f32,
}

impl Sheet<'_> {
    /// Adds the transmittance along both directions of the lines to the shares of the sheet's vertices.
    #[simd]
    pub(super) fn walk<S: Simd>(&self, simd: S, sums: &mut Sums, rows: &mut [SheetRow]) {
        sums.reset();
        let (reach, slices) = (sums.reach(), self.course.slices());
        self.take(&mut sums.around, rows, 0);
        for number in 0..=slices + reach {
            sums.around.rotate_left(1);
            self.take(&mut sums.around, rows, number + 1);
            advance(simd, sums, self.course, number);
            if let Some(last) = number.checked_sub(reach + 1).filter(|last| *last < slices) {
                self.look(simd, sums, (last, Way::Ahead), &mut rows[last]);
            }
            if number < slices {
                self.look(simd, sums, (number, Way::Back), &mut rows[number]);
            }
        }
    }

    /// Takes the extinction of the slice that comes next, if there is one.
    fn take(&self, [_, before, slice]: &mut [Slice; 3], rows: &[SheetRow], number: usize) {
        slice.leave();
        let Some(Some((row, _))) = rows.get(number) else {
            return;
        };
        let first = self.course.firsts[number][0];
        let columns = first..first + self.course.sides[0];
        slice.columns = [columns.start, columns.end];
        slice.inside[columns.clone()].fill(1.0);
        let vertices = self.matter.vertices;
        vertices.place(
            *row,
            self.matter.numbers,
            &mut slice.strengths[columns.clone()],
        );
        if let [first_run, .., last_run] | [first_run @ last_run] = vertices.runs(*row) {
            let ends = [first_run.first, last_run.first + last_run.len];
            slice.show(ends.map(|end| first + end));
        }
        if let Some((cut, clip)) = self.cut {
            let halves = slice
                .cut
                .get_or_insert_with(|| Halves::new(self.course.width));
            halves.reset();
            self.cut(halves, (cut, clip), (*row, first));
        }
        if let Some(soft) = self.matter.soft {
            vertices.place(*row, &soft.depths, &mut slice.soft[columns]);
            self.fill_gaps(slice, before, (*row, number), soft);
            if let Some(last) = number.checked_sub(1)
                && let Some((row, _)) = &rows[last]
            {
                self.fill_gaps(before, slice, (*row, last), soft);
            }
        }
    }

    /// Fills the gaps between a slice's runs with opaque matter where the slice beside it lies behind the surface. The bricks inside of a body are not
    /// in memory.
    fn fill_gaps(
        &self,
        slice: &mut Slice,
        beside: &Slice,
        (row, number): (usize, usize),
        soft: &Soft,
    ) {
        let first = self.course.firsts[number][0];
        let runs = self.matter.vertices.runs(row);
        let ends = runs.iter().map(|run| run.first);
        let starts = runs.iter().map(|run| run.first + run.len);
        let gaps = std::iter::once(0)
            .chain(starts)
            .zip(ends.chain([self.course.sides[0]]));
        for (start, end) in gaps {
            let columns = first + start..first + end;
            let own = slice.strengths[columns.clone()].iter_mut();
            let own = own.zip(&mut slice.soft[columns.clone()]);
            let mut is_filled = false;
            for ((strength, depth), beside) in own.zip(&beside.soft[columns.clone()]) {
                if *beside > soft.at_surface {
                    (*strength, *depth) = (soft.behind, *beside);
                    is_filled = true;
                }
            }
            if is_filled {
                slice.show([columns.start, columns.end]);
            }
        }
    }

    /// Finds how much of the way before and after each vertex of a row is kept.
    fn cut(
        &self,
        halves: &mut Halves,
        (cut, clip): (&Vertices, &GridClip),
        (row, first): (usize, usize),
    ) {
        let step = self.course.line.step;
        let fast = cut.axes[0];
        for run in cut.runs(row) {
            let mut at = cut.in_grid(row);
            at[fast] += run.first as f64;
            for column in first + run.first..first + run.first + run.len {
                let [from, to] = clip.interval(at, step);
                let before = single((to.min(0.0) - from.max(-0.5)).clamp(0.0, 0.5));
                let after = single((to.min(0.5) - from.max(0.0)).clamp(0.0, 0.5));
                (halves.kept[0][column], halves.kept[1][column]) = (before, after);
                halves.are_whole[column] = f32::from(before + after == 1.0);
                at[fast] += 1.0;
            }
        }
    }

    /// Adds the transmittance from the vertices of a slice to the end of the radius.
    #[inline(always)]
    fn look<S: Simd>(
        &self,
        simd: S,
        sums: &mut Sums,
        (slice, way): (usize, Way),
        row: &mut SheetRow,
    ) {
        let Some((row, shares)) = row else {
            return;
        };
        let (reach, line) = (sums.reach(), self.course.line);
        let count = sums.depths.len();
        // The slice that stands so far ahead of this one, or after the oldest that is kept.
        let depths = |ahead: usize| &sums.depths[(slice + ahead) % count][..];
        let (next, end) = match way {
            Way::Ahead => (
                depths(1),
                End {
                    depths: [depths(reach), depths(reach + 1)],
                    back: 1.0 - line.fraction,
                },
            ),
            Way::Back => (
                depths(count - 1),
                End {
                    depths: [depths(1), depths(2)],
                    back: line.fraction,
                },
            ),
        };
        let at = depths(0);
        let first = self.course.firsts[slice][0];
        let vertices = self.matter.vertices;
        let skins = self.matter.skins.in_rows[*row].then(|| {
            sums.skins.fill(0.0);
            vertices.place(*row, &self.matter.skins.shares, &mut sums.skins[first..]);
            &sums.skins[..]
        });
        let soft = self.matter.soft.map(|soft| {
            let lines = sums.soft.each_mut().map(|line| &mut line[first..]);
            soft.place((vertices, *row), lines);
            &sums.soft
        });
        let outwards = match way {
            Way::Ahead => line.direction,
            Way::Back => -line.direction,
        };
        for run in vertices.runs(*row) {
            let columns = first + run.first..first + run.first + run.len;
            let [from, to] = whole_vectors([columns.start, columns.end]);
            for place in (from..to).step_by(LANES) {
                let [early, late] = end.depths;
                let end = mix(
                    lanes(simd, late, place),
                    lanes(simd, early, place),
                    end.back,
                );
                let mut depth = (end - lanes(simd, at, place)).abs();
                if let Some(skins) = skins {
                    let of_skin = (end - lanes(simd, next, place)).abs() + SKIN_DEPTH;
                    depth += lanes(simd, skins, place) * (of_skin - depth);
                }
                let light = match soft {
                    Some(soft) => light_of_surface(simd, (soft, place), outwards, depth),
                    None => exp2(simd, -depth),
                };
                let light = light * line.weight;
                light.store_slice(&mut sums.light[place..][..LANES]);
            }
            let light = &sums.light[columns];
            for (share, light) in shares[vertices.in_row(*row, run)].iter_mut().zip(light) {
                *share += light;
            }
        }
    }
}

/// Cosines of a direction with the normal, up to which an isosurface counts less of it: the sky around it lies partly below the surface.
/// Directions lie 35 to 55 degrees apart; that their neighbourhood reaches as far as 24 degrees is a guess.
const GRAZING: f32 = 0.4;

/// How much of a direction lies above a surface, by its cosine with the normal.
pub(super) fn part_above(cos: f32) -> f32 {
    (cos / GRAZING).clamp(0.0, 1.0)
}

/// The transmittance along a direction from vertices around an isosurface. The optical depth of a flat soft layer is subtracted first, and the
/// result is weighted by the part of the direction above the surface.
#[inline(always)]
fn light_of_surface<S: Simd>(
    simd: S,
    ([x, y, z, own], place): (&[Vec<f32>; 4], usize),
    direction: Vec3,
    depth: f32x16<S>,
) -> f32x16<S> {
    let zero = f32x16::splat(simd, 0.0);
    let cos = lanes(simd, x, place) * direction.x
        + lanes(simd, y, place) * direction.y
        + lanes(simd, z, place) * direction.z;
    let part = (cos * (1.0 / GRAZING))
        .max(zero)
        .min(f32x16::splat(simd, 1.0));
    let flat = lanes(simd, own, place) / cos.max(f32x16::splat(simd, 1e-3));
    exp2(simd, zero - (depth - flat).max(zero)) * part
}

/// To which side of a slice its vertices look.
#[derive(Clone, Copy)]
enum Way {
    Ahead,
    Back,
}

/// The vectors that hold columns from a first to an end.
fn whole_vectors([first, end]: [usize; 2]) -> [usize; 2] {
    [first - first % LANES, end.next_multiple_of(LANES)]
}

/// Mean optical depth, in log2, in front of the visible part of a skin. With it, flat ramps whose optical depth rises by 1.5 to 10 a voxel have
/// 0.91 to 1.03 of their light, lit from all directions and seen from above.
const SKIN_DEPTH: f32 = 0.82 * std::f32::consts::LOG2_E;

/// Goes on to a slice; the one after it is taken.
#[inline(always)]
fn advance<S: Simd>(simd: S, sums: &mut Sums, course: &Course, number: usize) {
    /// A step of this depth lets 2^-12 through, less than pictures tell.
    const MOST: f32 = 12.0;
    /// Sums of means around vertices are the depth up to half of the way to the next; at a vertex it is that of the cubic through the
    /// four sums around it.
    const BEND: f32 = 1.0 / 16.0;
    let length = course.line.length * std::f32::consts::LOG2_E;
    let [from, to] = course.window(number);
    let count = sums.depths.len();
    let here = &mut sums.depths[number % count];
    let shown = sums.around.each_ref().map(|slice| slice.shown);
    let shown = shown.into_iter().filter(|[first, end]| first < end);
    let Some([first, end]) = shown.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]) else {
        return here[from..to].copy_from_slice(&sums.whole[from..to]);
    };
    here[from..first].copy_from_slice(&sums.whole[from..first]);
    here[end..to].copy_from_slice(&sums.whole[end..to]);
    let [before, at, after] = &sums.around;
    let most = f32x16::splat(simd, MOST);
    for place in (first..end).step_by(LANES) {
        // Matter begins and ends at the vertices of the box's faces, not half of a step beyond them.
        let enters = lanes(simd, &before.inside, place);
        let leaves = lanes(simd, &after.inside, place);
        let is_inside = enters * lanes(simd, &at.inside, place) * leaves;
        let [of_last, own, of_next] = [
            lanes(simd, &before.strengths, place) * length,
            lanes(simd, &at.strengths, place) * length,
            lanes(simd, &after.strengths, place) * length,
        ];
        let own = own.min(most);
        let mut bend = (of_last.min(most) - of_next.min(most)) * BEND * is_inside;
        let (mut first, mut second) = (own * 0.5 * enters, own * 0.5 * leaves);
        if let Some(cut) = &at.cut {
            bend *= lanes(simd, &cut.are_whole, place);
            first = own * lanes(simd, &cut.kept[0], place) * enters;
            second = own * lanes(simd, &cut.kept[1], place) * leaves;
        }
        let whole = lanes(simd, &sums.whole, place) + first;
        (whole + bend).store_slice(&mut here[place..][..LANES]);
        (whole + second).store_slice(&mut sums.whole[place..][..LANES]);
    }
}
