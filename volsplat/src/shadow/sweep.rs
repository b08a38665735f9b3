//! Columns of light, carried from slice to slice.

use glam::DVec3;
use rayon::prelude::*;

use resample_core::narrow::{floor, single};

use crate::bricks::cells::Table;
use crate::look::clip::GridClip;
use crate::shadow::medium::Medium;
use crate::shadow::slices::{Axes, LayerTables, Stack, VertexBox};

/// Steps of a column from one slice to the next. The field bends where a column passes from cell to cell: with one step a flat face of an
/// engine had stripes that an eye sees, with two they are below 1/128.
const STEPS: usize = 2;

/// Optical depths from here on let less through than the least byte tells.
const MOST_DEPTH: f32 = 14.0;

/// The columns of one direction, of which one stands at each whole place of the first slice.
struct Columns {
    axes: Axes,
    within: VertexBox,
    /// Towards the light, the slices rise or fall.
    rises: bool,
    /// How far a column moves from one slice to the next, vertices.
    shift: [f64; 2],
    /// Place of the first column in the first slice, and how many there are.
    first: [i64; 2],
    count: [usize; 2],
    /// Length of a step, opacity units.
    length: f32,
}

/// Where the columns stand in a slice: whole vertices and a share.
#[derive(Clone, Copy)]
struct Offset {
    whole: [i64; 2],
    share: [f32; 2],
}

/// A row of columns.
struct Row<'a> {
    depth: &'a mut [f32],
    /// The number in the slice before; NaN where nothing is shown.
    before: &'a mut [f32],
    /// Square root of the transmittance.
    root: &'a mut [f32],
}

impl Columns {
    /// `step` goes from slice to slice away from the light, in the grid; `length` is its length in opacity units.
    fn new(axes: Axes, within: VertexBox, step: DVec3, length: f64) -> Self {
        let slices = within.len(axes.along);
        let shift = axes.across.map(|axis| step[axis]);
        let mut first = [0; 2];
        let mut count = [0; 2];
        for side in 0..2 {
            let end = shift[side] * (slices - 1) as f64;
            let last = within.len(axes.across[side]) as f64 - 1.0;
            first[side] = floor((-end).min(0.0));
            let top = -floor(end.min(0.0) - last);
            count[side] = index(top - first[side] + 1);
        }
        Self {
            axes,
            within,
            rises: step[axes.along] < 0.0,
            shift,
            first,
            count,
            length: single(length / STEPS as f64),
        }
    }

    /// The slice of the stack that is the `number`-th on the way from the light.
    fn slice(&self, number: usize) -> usize {
        match self.rises {
            true => self.within.len(self.axes.along) - 1 - number,
            false => number,
        }
    }

    /// Where the columns stand after so many slices.
    fn offset(&self, slices: f64) -> Offset {
        let moved = self.shift.map(|shift| shift * slices);
        Offset {
            whole: moved.map(floor),
            share: moved.map(|moved| single(moved - moved.floor())),
        }
    }

    /// The kept part of each column, in numbers of slices; empty where nothing is cut.
    fn kept(&self, clip: &GridClip, step: DVec3) -> Vec<[f32; 2]> {
        if clip.is_whole() {
            return Vec::new();
        }
        let low = self.within.low;
        let place = |index: usize| {
            let (x, y) = (index % self.count[0], index / self.count[0]);
            let mut origin = DVec3::ZERO;
            for (side, at) in [x, y].into_iter().enumerate() {
                let axis = self.axes.across[side];
                origin[axis] = low[axis] as f64 + self.first[side] as f64 + at as f64;
            }
            let along = self.axes.along;
            origin[along] = (low[along] + self.slice(0)) as f64;
            clip.interval(origin, step).map(single)
        };
        (0..self.count[0] * self.count[1])
            .into_par_iter()
            .map(place)
            .collect()
    }
}

/// The numbers at the vertices of a slice.
#[derive(Clone)]
struct Slice {
    width: usize,
    numbers: Vec<f32>,
}

impl Slice {
    /// Becomes the slice at this share of the way from one to another.
    fn mix(&mut self, from: &Self, to: &Self, share: f32) {
        if share == 1.0 {
            return self.numbers.copy_from_slice(&to.numbers);
        }
        let ends = from.numbers.iter().zip(&to.numbers);
        for (number, (from, to)) in self.numbers.iter_mut().zip(ends) {
            *number = from + share * (to - from);
        }
    }
}

fn signed(count: usize) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}

/// A place as an index; one before the first is the first.
fn index(place: i64) -> usize {
    usize::try_from(place).unwrap_or(0)
}

/// A light's direction in the grid.
pub(super) struct Ray {
    /// Away from the light, in the grid, one slice long.
    pub(super) step: DVec3,
    /// The length of a step, opacity units.
    pub(super) length: f64,
    pub(super) axes: Axes,
}

impl Ray {
    /// The ray towards the light that is `towards`, a vector of the grid that is one opacity unit long in the world.
    pub(super) fn new(towards: DVec3) -> Self {
        let size = towards.abs();
        let along = (0..3).fold(
            0,
            |most, axis| if size[axis] > size[most] { axis } else { most },
        );
        Self {
            step: -towards / size[along],
            length: 1.0 / size[along],
            axes: Axes::across(along),
        }
    }
}

/// The light that matter takes, and the mean of the transmittance before it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Met {
    taken: f64,
    /// Light that is taken, times the transmittance before it.
    weighted: f64,
}

impl Met {
    /// Of a column that lets this share through: the integrals of dT and of T dT.
    fn of_column(transmittance: f64) -> Self {
        Self {
            taken: 1.0 - transmittance,
            weighted: 0.5 * (1.0 - transmittance * transmittance),
        }
    }

    pub(super) fn add(&mut self, other: Self) {
        self.taken += other.taken;
        self.weighted += other.weighted;
    }

    /// The mean transmittance where light is taken: 1/2 behind an opaque surface, 1 in thin fog.
    pub(super) fn mean(&self) -> f64 {
        if self.taken > 0.0 {
            self.weighted / self.taken
        } else {
            1.0
        }
    }
}

/// The matter in the way of light.
pub(super) struct Blocking<'a> {
    /// For each brick, the numbers at its vertices.
    pub(super) numbers: &'a [Table],
    pub(super) medium: &'a Medium,
    /// How far the matter around them is skin.
    pub(super) skins: &'a [Table],
    pub(super) clip: &'a GridClip,
}

/// Adds the transmittance towards the light to each vertex of the bricks, times a weight, and returns the light of all columns.
pub(super) fn add(
    matter: &Blocking,
    (ray, stack): (&Ray, &Stack),
    (tables, weight): (&mut LayerTables, f32),
) -> Met {
    let within = stack.within;
    let columns = Columns::new(ray.axes, within, ray.step, ray.length);
    let [width, height] = columns.count;
    let kept = columns.kept(matter.clip, ray.step);
    let mut depth = vec![0.0f32; width * height];
    let mut before = vec![f32::NAN; width * height];
    let mut root = vec![1.0f32; width * height];
    let mut earlier = root.clone();
    let area = stack.area();
    let mut skins = vec![0.0; area];
    let mut slice = Slice {
        width: stack.sides()[0],
        numbers: vec![f32::NAN; area],
    };
    let [mut last, mut between] = [slice.clone(), slice.clone()];
    let mut light = LightSlices::new(area);
    for number in 0..stack.len() {
        let at = columns.slice(number);
        std::mem::swap(&mut last, &mut slice);
        stack.fill(at, matter.numbers, &mut slice.numbers);
        stack.fill(at, matter.skins, &mut skins);
        earlier.copy_from_slice(&root);
        for step in 1..=STEPS {
            let share = step as f32 / STEPS as f32;
            let slices = (number as f32 - 1.0 + share).max(0.0);
            between.mix(&last, &slice, share);
            let carried = depth
                .par_chunks_mut(width)
                .zip(before.par_chunks_mut(width))
                .zip(root.par_chunks_mut(width));
            carried
                .enumerate()
                .for_each(|(y, ((depth, before), root))| {
                    let row = Row {
                        depth,
                        before,
                        root,
                    };
                    let kept = kept.get(y * width..(y + 1) * width);
                    columns.advance(row, y, &between, (matter.medium, kept, slices));
                });
        }
        let offset = columns.offset(number as f64);
        columns.to_vertices([&root, &earlier], offset, (light.next(), &skins));
        if let Some(before) = number.checked_sub(1) {
            let roots = light.sharpened(slice.width, columns.offset(before as f64));
            add_slice(stack, columns.slice(before), &roots, (tables, weight));
        }
    }
    light.end();
    let last = stack.len() - 1;
    let roots = light.sharpened(slice.width, columns.offset(last as f64));
    let last = columns.slice(last);
    add_slice(stack, last, &roots, (tables, weight));
    let mut met = Met::default();
    for root in root {
        met.add(Met::of_column(f64::from(root * root)));
    }
    met
}

impl Columns {
    /// Carries a row of columns a step on, so many slices from the first.
    fn advance(
        &self,
        row: Row,
        y: usize,
        slice: &Slice,
        (medium, kept, slices): (&Medium, Option<&[[f32; 2]]>, f32),
    ) {
        const STEP: f32 = 1.0 / STEPS as f32;
        let offset = self.offset(f64::from(slices));
        let height = slice.numbers.len() / slice.width;
        let [share_x, share_y] = offset.share;
        let beside = |share: f32| usize::from(share > 0.0);
        let above = usize::try_from(self.first[1] + signed(y) + offset.whole[1]);
        let Some(above) = above.ok().filter(|above| above + beside(share_y) < height) else {
            row.before.fill(f32::NAN);
            return;
        };
        let line = |y: usize| &slice.numbers[y * slice.width..][..slice.width];
        let (near, far) = (line(above), line(above + beside(share_y)));
        // Columns that stand in the slice.
        let first = self.first[0] + offset.whole[0];
        let end = signed(slice.width - beside(share_x)) - first;
        let [start, end] = [-first, end].map(|end| index(end).min(self.count[0]));
        // The vertex of the first of them.
        let vertex = index(first);
        row.before[..start].fill(f32::NAN);
        row.before[end..].fill(f32::NAN);
        for column in start..end {
            let x = column - start + vertex;
            let next = x + beside(share_x);
            let mix = |line: &[f32]| line[x] + share_x * (line[next] - line[x]);
            let (a, b) = (mix(near), mix(far));
            let value = a + share_y * (b - a);
            let last = std::mem::replace(&mut row.before[column], value);
            if value.is_nan() || last.is_nan() || row.depth[column] >= MOST_DEPTH {
                continue;
            }
            let part = kept.map_or(1.0, |kept| {
                let [from, to] = kept[column];
                (to.min(slices) - from.max(slices - STEP)).clamp(0.0, STEP) / STEP
            });
            let added = medium.mean(last, value) * self.length * part;
            if added > 0.0 {
                row.depth[column] += added;
                row.root[column] = (-0.5 * row.depth[column]).exp();
            }
        }
    }

    /// The square root of the transmittance at the vertices of a slice, between the columns around each; of skin, by the light one slice
    /// earlier.
    fn to_vertices(
        &self,
        [root, earlier]: [&[f32]; 2],
        offset: Offset,
        (vertices, skins): (&mut [f32], &[f32]),
    ) {
        // The column at the first vertex, or before it where columns stand beside vertices, and how far on the vertex is.
        let place = |side: usize| {
            let back = i64::from(offset.share[side] > 0.0);
            let column = -offset.whole[side] - back - self.first[side];
            let share = if back == 1 {
                1.0 - offset.share[side]
            } else {
                0.0
            };
            (index(column), usize::from(share > 0.0), share)
        };
        let ((x, next_x, share_x), (y, next_y, share_y)) = (place(0), place(1));
        let width = self.within.len(self.axes.across[0]);
        let lines = vertices.par_chunks_mut(width).enumerate();
        lines.for_each(|(line, vertices)| {
            let skins = &skins[line * width..][..width];
            let rows = [root, earlier].map(|root| {
                [line, line + next_y].map(|y_row| {
                    let first = x + (y + y_row) * self.count[0];
                    &root[first..][..width + next_x]
                })
            });
            let at = |[near, far]: [&[f32]; 2], number: usize| {
                let mix =
                    |line: &[f32]| line[number] + share_x * (line[number + next_x] - line[number]);
                let (a, b) = (mix(near), mix(far));
                a + share_y * (b - a)
            };
            for (number, vertex) in vertices.iter_mut().enumerate() {
                *vertex = at(rows[0], number);
                let skin = skins[number];
                // It is NaN where nothing is shown.
                if skin > 0.0 {
                    let of_skin = SKIN_ROOT * at(rows[1], number);
                    *vertex += skin * (of_skin - *vertex);
                }
            }
        });
    }
}

/// The mean transmittance of an opaque surface is 1/2 over the light that it takes; a skin has its square root.
const SKIN_ROOT: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// The light at the vertices of three slices, one after another.
struct LightSlices {
    before: Vec<f32>,
    at: Vec<f32>,
    after: Vec<f32>,
    count: usize,
}

impl LightSlices {
    fn new(len: usize) -> Self {
        let none = || vec![1.0; len];
        Self {
            before: none(),
            at: none(),
            after: none(),
            count: 0,
        }
    }

    /// Goes on, and lends the slice that comes next.
    fn next(&mut self) -> &mut [f32] {
        std::mem::swap(&mut self.before, &mut self.at);
        std::mem::swap(&mut self.at, &mut self.after);
        if self.count == 1 {
            // Before the first slice it is as bright.
            self.before.copy_from_slice(&self.at);
        }
        self.count += 1;
        &mut self.after
    }

    /// Goes on where no slice is left.
    fn end(&mut self) {
        let last = self.after.clone();
        self.next().copy_from_slice(&last);
    }

    /// The light of the slice in the middle, less parts of its second differences. Between vertices straight lines lie above a curve by a
    /// twelfth of them along each axis in the mean. Where columns stand beside vertices, the lines between columns lie above it by
    /// s (1 - s) / 2 of them, s being the share of the way: without this a flat face had stripes where columns drift across it.
    fn sharpened(&self, width: usize, offset: Offset) -> Vec<f32> {
        const MEAN: f32 = 1.0 / 12.0;
        let [along_x, along_y] = offset.share.map(|share| MEAN + 0.5 * share * (1.0 - share));
        let height = self.at.len() / width;
        let mut sharpened = vec![0.0; self.at.len()];
        let lines = sharpened.par_chunks_mut(width).enumerate();
        lines.for_each(|(y, line)| {
            let own = line_of(&self.at, width, y);
            let rows = [y.saturating_sub(1), (y + 1).min(height - 1)];
            let rows = rows.map(|y| line_of(&self.at, width, y));
            let slices = [&self.before, &self.after].map(|slice| line_of(slice, width, y));
            for (x, to) in line.iter_mut().enumerate() {
                let root = own[x];
                let bend = |[before, after]: [f32; 2]| before + after - 2.0 * root;
                let columns = [x.saturating_sub(1), (x + 1).min(width - 1)];
                let bends = along_x * bend(columns.map(|x| own[x]))
                    + along_y * bend(rows.map(|row| row[x]))
                    + MEAN * bend(slices.map(|slice| slice[x]));
                *to = (root - bends).clamp(0.0, 1.0);
            }
        });
        sharpened
    }
}

fn line_of(slice: &[f32], width: usize, y: usize) -> &[f32] {
    &slice[y * width..][..width]
}

/// Adds the transmittance of a slice to the vertices of its bricks, times a weight.
fn add_slice(
    stack: &Stack,
    slice: usize,
    roots: &[f32],
    (tables, weight): (&mut LayerTables, f32),
) {
    let width = stack.sides()[0];
    stack.change(slice, tables, |brick, table| {
        for row in stack.rows(brick, slice) {
            let [x, y] = row.first;
            let line = &roots[x + width * y..][..row.count];
            for (number, root) in line.iter().enumerate() {
                table[row.place + number * row.stride] += weight * root * root;
            }
        }
    });
}
