//! The share of the sky that each vertex of the bricks sees: the mean, over directions, of the transmittance up to a radius.
//!
//! Directions come in pairs along lines of vertices. Depths are summed along each line once, and the depth between two vertices is the
//! difference of their sums, which serves both of them: one looks ahead and one looks back.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use resample_core::dispatch;
use resample_core::narrow::{count, floor, single, whole};
use resample_core::simd::{Vectors, exp2};

use crate::bricks::cells::{CellField, TABLE_LEN, Table, VERTEX_SIDE};
use crate::look::clip::{Cut, GridClip};
use crate::shadow::slices::{Axes, LayerTables, Stack, VertexRow};

/// A pair of opposite directions.
#[derive(Clone, Copy, Debug)]
struct Line {
    /// The axis across which slices lie.
    along: usize,
    /// From one slice to the next, vertices; 1 along the axis.
    step: DVec3,
    /// The way from slice to slice, opacity units.
    length: f32,
    /// Whole slices within the radius, and a share of one.
    reach: usize,
    fraction: f32,
    /// Share of the sky around each of the two directions.
    weight: f32,
}

/// The sky around the vertices of a field.
pub(super) struct Sky<'a> {
    pub(super) field: &'a CellField,
    /// For each brick, the mean extinction around its vertices, per opacity unit.
    pub(super) strengths: &'a [Table],
    /// How far the matter around them is skin.
    pub(super) skins: &'a [Table],
    pub(super) clip: &'a GridClip,
    pub(super) world_from_grid: DMat3,
    /// World units.
    pub(super) radius: f64,
    pub(super) opacity_unit: f64,
    pub(super) level: Vectors,
}

impl Sky<'_> {
    /// For each brick, the share that its vertices see.
    pub(super) fn shares(&self) -> Vec<Table> {
        let mut sums: Vec<Table> = vec![[0.0; TABLE_LEN]; self.field.bricks.len()];
        let lines = self.lines();
        for along in 0..3 {
            let Some(stack) = Stack::new(self.field, Axes::across(along)) else {
                continue;
            };
            let mut tables = stack.tables();
            for line in lines.iter().filter(|line| line.along == along) {
                self.add(&stack, line, &mut tables);
            }
            stack.add_to_bricks(&tables, &mut sums);
        }
        sums
    }

    fn lines(&self) -> Vec<Line> {
        let spacing = [0, 1, 2].map(|axis| self.world_from_grid.col(axis).length());
        let mut lines = Vec::new();
        let mut directions = Vec::new();
        // One of each two opposite neighbours of a vertex: 13 of 26.
        for number in 14..27 {
            let signs = [number % 3 - 1, number / 3 % 3 - 1, number / 9 - 1].map(f64::from);
            // Along the diagonals of a cube in the world.
            let step = DVec3::from([0, 1, 2].map(|axis| signs[axis] / spacing[axis]));
            let most = step.abs().max_element();
            // Slices across z and y are rows side by side.
            let along = (0..3)
                .rev()
                .find(|axis| step[*axis].abs() > 0.999 * most)
                .unwrap_or(2);
            let step = step / step[along];
            let in_world = self.world_from_grid * step;
            directions.push(in_world.normalize_or_zero());
            let slices = self.radius / in_world.length();
            lines.push(Line {
                along,
                step,
                length: single(in_world.length() / self.opacity_unit),
                reach: count(whole(slices.floor())),
                fraction: single(slices - slices.floor()),
                weight: 0.0,
            });
        }
        for (line, share) in lines.iter_mut().zip(shares_of_sky(&directions)) {
            line.weight = single(0.5 * share);
        }
        lines
    }

    fn add(&self, stack: &Stack, line: &Line, tables: &mut LayerTables) {
        let slices = stack.len();
        let mut ahead = Sums::new(stack, (line, self.clip), 1.0 - line.fraction);
        let mut behind = Sums::new(stack, (line, self.clip), line.fraction);
        for number in 0..=slices + line.reach {
            self.advance(stack, number, &mut ahead);
            if let Some(next) = number.checked_sub(line.reach) {
                self.advance(stack, next, &mut behind);
            }
            let before = number.checked_sub(line.reach + 1);
            if let Some(last) = before.filter(|last| *last < slices) {
                let ends = [&behind.before, &behind.sums, &ahead.parts];
                let columns = ahead.columns(last);
                self.look(stack, (last, columns), (ends, line.weight), tables);
            }
            if number < slices {
                let ends = [&ahead.sums, &ahead.before, &behind.parts];
                let columns = ahead.columns(number);
                self.look(stack, (number, columns), (ends, line.weight), tables);
            }
        }
    }

    /// Goes on to a slice, or beyond the last.
    fn advance(&self, stack: &Stack, slice: usize, sums: &mut Sums) {
        if slice == 0 {
            self.take(stack, 0, sums);
        }
        sums.around.rotate_left(1);
        sums.around[2].fill(f32::NAN);
        if let Some([at, after]) = &mut sums.kept {
            std::mem::swap(at, after);
        }
        if slice + 1 < stack.len() {
            self.take(stack, slice + 1, sums);
        }
        sums.advance(slice.min(stack.len() - 1), self.level);
    }

    /// Takes the extinction of the slice that comes next.
    fn take(&self, stack: &Stack, slice: usize, sums: &mut Sums) {
        let [x, y] = sums.firsts[slice];
        let rows = sums.around[2].chunks_exact_mut(sums.width);
        for row in rows.skip(y).take(sums.slice_height) {
            row[x..][..sums.slice_width].fill(0.0);
        }
        let plane = (&mut sums.around[2][..], sums.width);
        stack.place(slice, self.strengths, plane, [x, y]);
        if sums.kept.is_some() {
            self.cut(stack, slice, sums);
        }
    }

    /// Finds how much of the way before and after each vertex of the slice that comes next is kept.
    fn cut(&self, stack: &Stack, slice: usize, sums: &mut Sums) {
        let (columns, step) = (sums.columns(slice), sums.step_in_grid);
        let Some([_, [before, after]]) = &mut sums.kept else {
            return;
        };
        before.fill(0.5);
        after.fill(0.5);
        for brick in stack.bricks_of(slice) {
            if matches!(self.clip.cut(&self.field.bricks[brick].bounds), Cut::By(0)) {
                continue;
            }
            for row in stack.rows(brick, slice) {
                let first = columns.place(row);
                let mut at = stack.in_grid(row, slice);
                for column in first..first + row.count {
                    let [from, to] = self.clip.interval(at, step);
                    before[column] = single((to.min(0.0) - from.max(-0.5)).clamp(0.0, 0.5));
                    after[column] = single((to.min(0.5) - from.max(0.0)).clamp(0.0, 0.5));
                    at[stack.axes.across[0]] += 1.0;
                }
            }
        }
    }

    /// Adds the transmittance from the vertices of a slice to the end of the radius, times a weight; the sums are those at the slice, at the
    /// next one on the way, and at the end.
    fn look(
        &self,
        stack: &Stack,
        (slice, columns): (usize, Columns),
        ([at, next, end], weight): ([&Vec<f32>; 3], f32),
        tables: &mut LayerTables,
    ) {
        stack.change(slice, tables, |brick, table| {
            let mut depths = [0.0; SLICE_LEN];
            let mut len = 0;
            for row in stack.rows(brick, slice) {
                let first = columns.place(row);
                let sums = [at, next, end].map(|sums| &sums[first..][..row.count]);
                let mut skins = [0.0; VERTEX_SIDE];
                for (number, skin) in skins[..row.count].iter_mut().enumerate() {
                    *skin = self.skins[brick][row.place + number * row.stride];
                }
                let depths = &mut depths[len..][..row.count];
                // Rows of a known length become vector instructions.
                if row.count == VERTEX_SIDE {
                    let sums = sums.map(|sums| &sums[..VERTEX_SIDE]);
                    depths_of_row(sums, &skins, &mut depths[..VERTEX_SIDE]);
                } else {
                    depths_of_row(sums, &skins, depths);
                }
                len += row.count;
            }
            dispatch!(self.level, simd => transmittances(simd, &mut depths, weight));
            let mut rest = &depths[..];
            for row in stack.rows(brick, slice) {
                let (line, after) = rest.split_at(row.count);
                rest = after;
                let table = &mut table[row.place..];
                if row.stride == 1 && row.count == VERTEX_SIDE {
                    add_row(&mut table[..VERTEX_SIDE], &line[..VERTEX_SIDE]);
                    continue;
                }
                for (number, share) in line.iter().enumerate() {
                    table[number * row.stride] += share;
                }
            }
        });
    }
}

#[inline(always)]
fn add_row(sums: &mut [f32], shares: &[f32]) {
    for (sum, share) in sums.iter_mut().zip(shares) {
        *sum += share;
    }
}

/// Depths, in log2 and below 0, from the vertices of a row to the end of the radius; `skins` are how far the vertices are skin.
#[inline(always)]
fn depths_of_row([at, next, end]: [&[f32]; 3], skins: &[f32; VERTEX_SIDE], depths: &mut [f32]) {
    for (number, depth) in depths.iter_mut().enumerate() {
        let of_skin = SKIN_DEPTH + (end[number] - next[number]).abs();
        let whole = (end[number] - at[number]).abs();
        *depth = -(whole + skins[number] * (of_skin - whole));
    }
}

/// Optical depth, in log2, of a skin in the mean over what an eye sees. With exp(-0.82) flat ramps of 1.5 to 10 a voxel, lit from all
/// directions and seen from above, have 0.91 to 1.03 of their light.
const SKIN_DEPTH: f32 = 0.82 * std::f32::consts::LOG2_E;

/// Vertices of a brick in a slice, up to whole vectors.
const SLICE_LEN: usize = 96;

/// Becomes the transmittances of depths below 0, in log2, times a weight.
#[simd]
fn transmittances<S: Simd>(simd: S, depths: &mut [f32; SLICE_LEN], weight: f32) {
    for lanes in depths.chunks_exact_mut(16) {
        let depth = f32x16::from_slice(simd, lanes);
        let share = exp2(simd, depth.min(f32x16::splat(simd, 0.0))) * f32x16::splat(simd, weight);
        share.store_slice(lanes);
    }
}

/// Sums along the lines, each of which stands at a whole vertex in each slice.
struct Sums {
    /// Vertices along the sides of a slice.
    slice_width: usize,
    slice_height: usize,
    width: usize,
    /// The line at the first vertex of each slice.
    firsts: Vec<[usize; 2]>,
    /// Extinction at the slice before, at the slice, and at the one after it; NaN outside of the box.
    around: [Vec<f32>; 3],
    /// Where a clip cuts: at the slice and at the one after it, the shares of a step, up to a half, that are kept before and after.
    kept: Option<[[Vec<f32>; 2]; 2]>,
    /// The same for a row that nothing cuts.
    halves: Vec<f32>,
    /// From one slice to the next, vertices.
    step_in_grid: DVec3,
    /// Optical depth up to the middle between the slice and the one after it, in log2.
    whole: Vec<f32>,
    /// Optical depth up to the slice, in log2.
    sums: Vec<f32>,
    /// The same, up to the slice before.
    before: Vec<f32>,
    /// The same, up to a share of the way from the slice to the one before.
    parts: Vec<f32>,
    step: Step,
}

#[derive(Clone, Copy)]
struct Step {
    /// The way from slice to slice, opacity units, in log2.
    length: f32,
    /// The share of the way back that `parts` stand at.
    back: f32,
}

/// The lines that stand at the vertices of a slice.
#[derive(Clone, Copy)]
struct Columns {
    first: [usize; 2],
    width: usize,
}

impl Columns {
    /// The line at the first vertex of a row.
    fn place(&self, row: VertexRow) -> usize {
        row.first[0] + self.first[0] + self.width * (row.first[1] + self.first[1])
    }
}

impl Sums {
    fn new(stack: &Stack, (line, clip): (&Line, &GridClip), back: f32) -> Self {
        let last = stack.len() - 1;
        // Halves are rounded away from 0, so that directions to both sides are alike.
        let moved = |slice: usize| {
            stack.axes.across.map(|axis| {
                let shift = line.step[axis];
                let moved = floor(shift.abs() * slice as f64 + 0.5);
                if shift < 0.0 { -moved } else { moved }
            })
        };
        let end = moved(last);
        let firsts = (0..=last).map(|slice| {
            let moved = moved(slice);
            [0, 1].map(|side| usize::try_from(end[side].max(0) - moved[side]).unwrap_or(0))
        });
        let [width, height] = stack.sides();
        let [more_x, more_y] = end.map(|end| usize::try_from(end.abs()).unwrap_or(0));
        let zeros = vec![0.0; (width + more_x) * (height + more_y)];
        let outside = vec![f32::NAN; zeros.len()];
        let halves = || [vec![0.5; zeros.len()], vec![0.5; zeros.len()]];
        Self {
            slice_width: width,
            slice_height: height,
            width: width + more_x,
            firsts: firsts.collect(),
            around: [outside.clone(), outside.clone(), outside],
            kept: (!clip.is_whole()).then(|| [halves(), halves()]),
            halves: vec![0.5; width + more_x],
            step_in_grid: line.step,
            whole: zeros.clone(),
            sums: zeros.clone(),
            before: zeros.clone(),
            parts: zeros,
            step: Step {
                length: line.length * std::f32::consts::LOG2_E,
                back,
            },
        }
    }

    /// The lines at the vertices of a slice.
    fn columns(&self, slice: usize) -> Columns {
        Columns {
            first: self.firsts[slice],
            width: self.width,
        }
    }

    /// Goes on to a slice; the one after it is taken.
    fn advance(&mut self, slice: usize, level: Vectors) {
        let (own, step) = (self.firsts[slice], self.step);
        // Lines that have just left the box come to rest.
        let last = self.firsts[slice.saturating_sub(1)];
        let [x, y] = [0, 1].map(|side| own[side].min(last[side]));
        let width = own[0].max(last[0]) + self.slice_width - x;
        let end = own[1].max(last[1]) + self.slice_height;
        let [before, at, after] = &self.around;
        let rows = (self.sums.par_chunks_mut(self.width))
            .zip(self.parts.par_chunks_mut(self.width))
            .zip(self.whole.par_chunks_mut(self.width))
            .zip(self.before.par_chunks_mut(self.width));
        let (plane_width, kept, halves) = (self.width, &self.kept, &self.halves);
        let rows = rows.enumerate().skip(y).take(end - y);
        rows.for_each(|(row, (((sums, parts), whole), last))| {
            let first = row * plane_width + x;
            let numbers = [before, at, after].map(|plane| &plane[first..][..width]);
            let lines = [sums, parts, whole, last].map(|line| &mut line[x..][..width]);
            let halves = match kept {
                Some([kept, _]) => [0, 1].map(|half: usize| &kept[half][first..][..width]),
                None => [&halves[..width]; 2],
            };
            dispatch!(level, simd => advance(simd, lines, (numbers, halves), step));
        });
    }
}

/// Goes on to the vertices of a row. `halves` are the shares of a step that are kept before and after them, up to a half.
#[simd]
fn advance<S: Simd>(
    _simd: S,
    lines: [&mut [f32]; 4],
    (numbers, halves): ([&[f32]; 3], [&[f32]; 2]),
    step: Step,
) {
    /// A step of this depth lets 2^-12 through, less than pictures tell.
    const MOST: f32 = 12.0;
    /// Sums of means around vertices are the depth up to half of the way to the next; at a vertex it is that of the cubic through the
    /// four sums around it.
    const BEND: f32 = 1.0 / 16.0;
    let [sums, parts, whole, last] = lines;
    let [before, at, after] = numbers;
    let depth = |strength: f32| (step.length * strength).min(MOST);
    let numbers = before.iter().zip(at).zip(after);
    let numbers = numbers.zip(halves[0].iter().zip(halves[1]));
    let lines = sums.iter_mut().zip(parts).zip(whole).zip(last);
    for ((((sum, part), whole), last), (((before, at), after), halves)) in lines.zip(numbers) {
        // Matter begins and ends at the vertices of the box's faces, not half of a step beyond them.
        let [enters, leaves] = [before, after].map(|beside| beside.is_nan());
        let is_inside = !enters && !leaves && !at.is_nan();
        let is_whole = is_inside && halves.0 + halves.1 == 1.0;
        let bend = if is_whole {
            BEND * (depth(*before) - depth(*after))
        } else {
            0.0
        };
        let at = if at.is_nan() { 0.0 } else { depth(*at) };
        let first = if enters { 0.0 } else { halves.0 * at };
        let second = if leaves { 0.0 } else { halves.1 * at };
        let here = *whole + first + bend;
        *part = here - step.back * (here - *sum);
        *last = *sum;
        *sum = here;
        *whole += first + second;
    }
}

/// The share of the sphere that is nearest to each line.
fn shares_of_sky(lines: &[DVec3]) -> Vec<f64> {
    /// So many places give shares to about 1 %.
    const PLACES: u32 = 20_000;
    const TURN: f64 = 2.399_963_229_728_653;
    let mut counts = vec![0.0; lines.len()];
    for place in 0..PLACES {
        let z = (f64::from(place) + 0.5) / f64::from(PLACES) * 2.0 - 1.0;
        let (sin, cos) = (TURN * f64::from(place)).sin_cos();
        let flat = (1.0 - z * z).sqrt();
        let at = DVec3::new(flat * cos, flat * sin, z);
        let nearest = (0..lines.len()).fold(0, |nearest, line| {
            let is_nearer = lines[line].dot(at).abs() > lines[nearest].dot(at).abs();
            if is_nearer { line } else { nearest }
        });
        counts[nearest] += 1.0 / f64::from(PLACES);
    }
    counts
}
