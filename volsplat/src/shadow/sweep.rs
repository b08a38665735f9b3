//! Columns of light, carried from slice to slice.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use resample_core::dispatch;
use resample_core::narrow::{floor, single};
use resample_core::simd::{Vectors, exp2};

use crate::look::clip::GridClip;
use crate::shadow::medium::{Medium, Places};
use crate::shadow::sharpen::{MEAN, Sharpening};
use crate::shadow::vertices::{Around, LANES, PaddedRow, Soft, Vertices, lanes, mix};

/// Steps of a column from one slice to the next. The field bends where a column passes from cell to cell: with one step a flat face of an
/// engine had stripes that an eye sees, with two they are below 1/128.
const STEPS: usize = 2;

/// Optical depths from here on let less through than the least byte tells, after the layer around an isosurface is subtracted.
const MOST_DEPTH: f32 = 14.0 + MOST_SOFT;

/// Greatest optical depth of the layer that is subtracted: light at 3 degrees to the surface passes that much.
const MOST_SOFT: f32 = 16.0;

/// Cosines with the normal up to which an isosurface is less lit: what turns away from the light is dark.
const TURNED_AWAY: f32 = 0.05;

/// Rows of a slice that a thread takes at once, at least.
const ROWS: usize = 16;

/// A light's direction in the grid.
pub(super) struct Ray {
    /// Away from the light, in the grid, one slice long.
    step: DVec3,
    /// The length of a step, opacity units.
    length: f64,
    /// The axis across which slices lie.
    pub(super) along: usize,
    /// Towards the light, in the world, of length 1.
    towards: Vec3,
}

impl Ray {
    /// The ray towards the light that is `towards`, a vector of the grid that is one opacity unit long in the world.
    pub(super) fn new(towards: DVec3, in_world: Vec3) -> Self {
        let size = towards.abs();
        let along = (0..3).fold(
            0,
            |most, axis| if size[axis] > size[most] { axis } else { most },
        );
        Self {
            step: -towards / size[along],
            length: 1.0 / size[along],
            along,
            towards: in_world,
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
#[derive(Clone, Copy)]
pub(super) struct Blocking<'a> {
    /// Numbers are NaN where nothing is shown. No row lies along the light's axis.
    pub(super) matter: Around<'a>,
    pub(super) medium: &'a Medium,
    pub(super) clip: &'a GridClip,
    pub(super) level: Vectors,
}

/// The columns of one direction, of which one stands at each whole place of the first slice.
struct Columns {
    /// Axes along rows, from row to row, and from slice to slice.
    axes: [usize; 3],
    /// Vertices along them.
    sides: [usize; 3],
    /// Least vertex of the slices.
    low: [usize; 3],
    /// Towards the light, the slices rise or fall.
    rises: bool,
    /// How far a column moves from one slice to the next, vertices.
    shift: [f64; 2],
    /// Place of the first column in the first slice, and how many there are.
    first: [i64; 2],
    count: [usize; 2],
    /// Length of a step, opacity units.
    length: f32,
    /// Towards the light, in the world.
    towards: Vec3,
    /// Least extinction that only matter behind an isosurface has; infinite where matter is drawn.
    behind: f32,
}

/// Where the columns stand in a slice: whole vertices and a share.
#[derive(Clone, Copy)]
struct Offset {
    whole: [i64; 2],
    share: [f32; 2],
}

/// A row of a slice.
struct Line {
    /// NaN where nothing is shown.
    numbers: PaddedRow,
    /// Vertices from the first to the last that are shown, and the one behind it.
    shown: [usize; 2],
}

impl Line {
    fn new(width: usize) -> Self {
        Self {
            numbers: PaddedRow::new(width),
            shown: [0; 2],
        }
    }

    fn take(&mut self, vertices: &Vertices, row: usize, numbers: &[f32]) {
        vertices.fill(Some(row), numbers, self.numbers.inner());
        self.shown = match vertices.runs(row) {
            [] => [0; 2],
            [first, .., last] | [first @ last] => [first.first, last.first + last.len],
        };
    }
}

/// From the least first to the greatest end of ranges that are not empty.
fn hull(ranges: [[usize; 2]; 4]) -> [usize; 2] {
    let ranges = ranges.into_iter().filter(|[first, end]| first < end);
    let hull = ranges.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]);
    hull.unwrap_or([0; 2])
}

/// A row of columns.
struct Row {
    depth: Vec<f32>,
    /// The number in the step before as a place in the table, or as it is; NaN where nothing is shown.
    before: Vec<f32>,
    /// The integral up to it.
    sums: Vec<f64>,
    rest: Vec<f32>,
    /// Square root of the transmittance, at the slice and at the one before.
    roots: [Vec<f32>; 2],
    /// True if light was taken between them.
    has_fallen: bool,
    /// The part of each column that a clip keeps, in numbers of slices; empty where nothing is cut.
    kept: Vec<[f32; 2]>,
}

impl Columns {
    fn new(vertices: &Vertices, ray: &Ray, soft: Option<&Soft>) -> Self {
        let [fast, row, slice] = vertices.axes;
        let across = if ray.along == slice { row } else { slice };
        let axes = [fast, across, ray.along];
        let sides = axes.map(|axis| vertices.within.len(axis));
        let shift = [fast, across].map(|axis| ray.step[axis]);
        let mut first = [0; 2];
        let mut count = [0; 2];
        for side in 0..2 {
            let end = shift[side] * (sides[2] - 1) as f64;
            let last = sides[side] as f64 - 1.0;
            first[side] = floor((-end).min(0.0));
            let top = -floor(end.min(0.0) - last);
            count[side] = index(top - first[side] + 1);
        }
        Self {
            axes,
            sides,
            low: vertices.within.low,
            rises: ray.step[ray.along] < 0.0,
            shift,
            first,
            count,
            length: single(ray.length / STEPS as f64),
            towards: ray.towards,
            behind: soft.map_or(f32::INFINITY, |soft| 0.5 * soft.behind),
        }
    }

    /// The slice that is the `number`-th on the way from the light.
    fn slice(&self, number: usize) -> usize {
        match self.rises {
            true => self.sides[2] - 1 - number,
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

    /// All columns, by row, where light enters.
    fn rows(&self, clip: &GridClip, step: DVec3) -> Vec<Row> {
        let width = self.count[0] + LANES;
        let kept = |y: usize| {
            let place = |x: usize| {
                let mut origin = DVec3::ZERO;
                for (side, at) in [x, y].into_iter().enumerate() {
                    let axis = self.axes[side];
                    origin[axis] = self.low[axis] as f64 + self.first[side] as f64 + at as f64;
                }
                let along = self.axes[2];
                origin[along] = (self.low[along] + self.slice(0)) as f64;
                clip.interval(origin, step).map(single)
            };
            (0..width).map(place).collect()
        };
        let rows = (0..self.count[1]).into_par_iter().map(|y| Row {
            depth: vec![0.0; width],
            before: vec![f32::NAN; width],
            sums: vec![0.0; width],
            rest: vec![0.0; width],
            roots: [vec![1.0; width], vec![1.0; width]],
            has_fallen: false,
            kept: if clip.is_whole() { Vec::new() } else { kept(y) },
        });
        rows.collect()
    }
}

fn signed(count: usize) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}

/// A place as an index; one before the first is the first.
fn index(place: i64) -> usize {
    usize::try_from(place).unwrap_or(0)
}

/// Adds the transmittance towards the light to each vertex, times a weight, and returns the light of all columns.
pub(super) fn add(blocking: &Blocking, ray: &Ray, (shares, weight): (&mut [f32], f32)) -> Met {
    let Around {
        vertices,
        numbers,
        skins,
        soft,
    } = blocking.matter;
    let columns = Columns::new(vertices, ray, soft);
    let [width, height, slices] = columns.sides;
    let row_of = |y: usize, slice: usize| vertices.row_at(columns.axes[1], [y, slice]);
    let mut by_slice: Vec<Vec<(usize, &mut [f32])>> = Vec::new();
    by_slice.resize_with(slices, || Vec::with_capacity(height));
    for (row, shares) in vertices.split(shares).into_iter().enumerate() {
        let [_, slice] = vertices.place_of_row(row, columns.axes[1]);
        by_slice[slice].push((row, shares));
    }
    let mut rows = columns.rows(blocking.clip, ray.step);
    let plane = || -> Vec<PaddedRow> { (0..height).map(|_| PaddedRow::new(width)).collect() };
    let lines = || -> Vec<Line> { (0..height).map(|_| Line::new(width)).collect() };
    let [mut last, mut slice] = [lines(), lines()];
    let mut light = LightSlices::new([plane(), plane(), plane()]);
    for number in 0..slices {
        let at = columns.slice(number);
        std::mem::swap(&mut last, &mut slice);
        let lines = slice.par_iter_mut().enumerate().with_min_len(ROWS);
        lines.for_each(|(y, line)| line.take(vertices, row_of(y, at), numbers));
        let carried = rows.par_iter_mut().enumerate().with_min_len(ROWS);
        carried.for_each(|(y, row)| {
            let slices = [&last, &slice].map(|slice| &slice[..]);
            dispatch!(blocking.level, simd => columns.advance(simd, (row, y), slices, (blocking.medium, number)));
        });
        let offset = columns.offset(number as f64);
        let lines = light.next().par_iter_mut().enumerate().with_min_len(ROWS);
        let padded = || [(); 4].map(|()| PaddedRow::new(width));
        lines.for_each_init(padded, |padded, (y, line)| {
            let row = row_of(y, at);
            let own = if let Some(soft) = soft {
                soft.place((vertices, row), padded.each_mut().map(PaddedRow::inner));
                Own::Soft(padded)
            } else if skins.in_rows[row] {
                let [skin, ..] = &mut *padded;
                skin.0.fill(0.0);
                vertices.place(row, &skins.shares, skin.inner());
                Own::Skin(skin)
            } else {
                Own::Matter
            };
            dispatch!(blocking.level, simd => columns.to_vertices(simd, &rows, offset, (y, line, own)));
        });
        if let Some(before) = number.checked_sub(1) {
            let rows = &mut by_slice[columns.slice(before)];
            light.add_to(blocking, rows, (columns.offset(before as f64), weight));
        }
    }
    light.end();
    let last = slices - 1;
    let of_last = &mut by_slice[columns.slice(last)];
    light.add_to(blocking, of_last, (columns.offset(last as f64), weight));
    let mut met = Met::default();
    for row in rows {
        for root in &row.roots[0][..columns.count[0]] {
            met.add(Met::of_column(f64::from(root * root)));
        }
    }
    met
}

impl Columns {
    /// Carries a row of columns on to a slice, from the one before.
    #[simd]
    fn advance<S: Simd>(
        &self,
        simd: S,
        (row, y): (&mut Row, usize),
        [last, slice]: [&[Line]; 2],
        (medium, number): (&Medium, usize),
    ) {
        for step in 1..=STEPS {
            let share = step as f32 / STEPS as f32;
            let slices = (number as f32 - 1.0 + share).max(0.0);
            let offset = self.offset(f64::from(slices));
            let [share_x, share_y] = offset.share;
            let beside = |share: f32| usize::from(share > 0.0);
            let above = usize::try_from(self.first[1] + signed(y) + offset.whole[1]);
            let above = above
                .ok()
                .filter(|above| above + beside(share_y) < slice.len());
            let Some(above) = above else {
                row.before.fill(f32::NAN);
                continue;
            };
            // Columns that stand in the slice.
            let first = self.first[0] + offset.whole[0];
            let end = signed(self.sides[0] - beside(share_x)) - first;
            let [start, end] = [-first, end].map(|end| index(end).min(self.count[0]));
            let [near, far] = [above, above + beside(share_y)];
            let of_lines = [&last[near], &last[far], &slice[near], &slice[far]];
            let shown = hull(of_lines.map(|line| line.shown));
            let [start, end] =
                shown.map(|vertex| index(signed(vertex) - first).clamp(start, end.max(start)));
            row.before[..start].fill(f32::NAN);
            row.before[end..].fill(f32::NAN);
            // The vertex of the first of them.
            let vertex = index(first + signed(start)) + LANES;
            let lines = of_lines.map(|line| &line.numbers.0[..]);
            let lines = [[lines[0], lines[1]], [lines[2], lines[3]]];
            for column in (start..end).step_by(LANES) {
                let place = vertex + column - start;
                let places = [place, place + beside(share_x)];
                let mut value = bilinear(simd, lines[1], places, offset.share);
                if share < 1.0 {
                    let before = bilinear(simd, lines[0], places, offset.share);
                    value = mix(before, value, share);
                }
                self.step(simd, (row, column), value, (medium, slices));
            }
        }
        if !std::mem::take(&mut row.has_fallen) {
            let [roots, earlier] = &mut row.roots;
            return earlier.copy_from_slice(roots);
        }
        row.roots.swap(0, 1);
        let [roots, _] = &mut row.roots;
        for column in (0..self.count[0]).step_by(LANES) {
            let depth = lanes(simd, &row.depth, column) * (-0.5 * std::f32::consts::LOG2_E);
            exp2(simd, depth).store_slice(&mut roots[column..][..LANES]);
        }
    }

    /// Carries columns on to where the number is `value`.
    #[inline(always)]
    fn step<S: Simd>(
        &self,
        simd: S,
        (row, column): (&mut Row, usize),
        value: f32x16<S>,
        (medium, slices): (&Medium, f32),
    ) {
        const STEP: f32 = 1.0 / STEPS as f32;
        let depth = lanes(simd, &row.depth, column);
        if depth.simd_ge(f32x16::splat(simd, MOST_DEPTH)).all_true() {
            return;
        }
        let last = lanes(simd, &row.before, column);
        let mean = match medium {
            Medium::Extinction => {
                let value = self.go_on(simd, last, value);
                value.store_slice(&mut row.before[column..][..LANES]);
                (last + value) * 0.5
            }
            Medium::Scalars(integral) => {
                if !value.simd_eq(value).any_true() {
                    return row.before[column..][..LANES].fill(f32::NAN);
                }
                let to = integral.places(simd, value);
                let from = row.places(simd, column);
                row.keep(column, &to);
                integral.between(simd, &from, &to)
            }
        };
        let mut added = mean * self.length;
        if !row.kept.is_empty() {
            let mut parts = [0.0; LANES];
            for (part, [from, to]) in parts.iter_mut().zip(&row.kept[column..]) {
                *part = (to.min(slices) - from.max(slices - STEP)).clamp(0.0, STEP) / STEP;
            }
            added *= f32x16::simd_from(simd, parts);
        }
        let zero = f32x16::splat(simd, 0.0);
        // NaN, where nothing is shown, adds nothing.
        let is_taken = added.simd_gt(zero);
        row.has_fallen |= is_taken.any_true();
        let added = is_taken.select(added, zero);
        (depth + added).store_slice(&mut row.depth[column..][..LANES]);
    }

    /// The extinction of columns; behind an isosurface, where nothing is shown, as thick as it was.
    #[inline(always)]
    fn go_on<S: Simd>(&self, simd: S, last: f32x16<S>, value: f32x16<S>) -> f32x16<S> {
        let stands_behind = last.simd_gt(f32x16::splat(simd, self.behind));
        let is_shown = value.simd_eq(value);
        is_shown.select(value, stands_behind.select(last, value))
    }

    /// The square root of the transmittance at the vertices of a slice, between the columns around each; of skin, by the light one slice
    /// earlier; around an isosurface, without what a flat one takes.
    #[simd]
    fn to_vertices<S: Simd>(
        &self,
        simd: S,
        rows: &[Row],
        offset: Offset,
        (line, vertices, own): (usize, &mut PaddedRow, Own),
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
        let width = self.sides[0];
        let [near, far] = [&rows[y + line].roots, &rows[y + line + next_y].roots];
        let shares = [share_x, share_y];
        for vertex in (0..width).step_by(LANES) {
            let columns = [x + vertex, x + vertex + next_x];
            let mut root = bilinear(simd, [&near[0], &far[0]], columns, shares);
            if let Own::Skin(skins) = own {
                let earlier = bilinear(simd, [&near[1], &far[1]], columns, shares);
                root += lanes(simd, &skins.0, LANES + vertex) * (earlier * SKIN_ROOT - root);
            }
            if let Own::Soft(soft) = own {
                root = self.root_of_surface(simd, root, (soft, LANES + vertex));
            }
            root.store_slice(&mut vertices.0[LANES + vertex..][..LANES]);
        }
        // Beyond its ends a row is as bright.
        let [first, end] = [LANES, LANES + width];
        vertices.0[first - 1] = vertices.0[first];
        vertices.0[end] = vertices.0[end - 1];
    }
}

impl Columns {
    /// The square root of the transmittance around an isosurface, without what a flat one takes.
    #[inline(always)]
    fn root_of_surface<S: Simd>(
        &self,
        simd: S,
        root: f32x16<S>,
        ([x, y, z, own], at): (&[PaddedRow; 4], usize),
    ) -> f32x16<S> {
        let splat = |number: f32| f32x16::splat(simd, number);
        let cos = lanes(simd, &x.0, at) * self.towards.x
            + lanes(simd, &y.0, at) * self.towards.y
            + lanes(simd, &z.0, at) * self.towards.z;
        let flat = lanes(simd, &own.0, at) / cos.max(splat(1e-3));
        let of_flat = exp2(
            simd,
            flat.min(splat(MOST_SOFT * std::f32::consts::LOG2_E)) * -0.5,
        );
        let faces = (cos * (1.0 / TURNED_AWAY)).max(splat(0.0)).min(splat(1.0));
        (root / of_flat).min(splat(1.0)) * faces.sqrt()
    }
}

/// The part of their own matter that the light at vertices leaves out.
#[derive(Clone, Copy)]
enum Own<'a> {
    /// Nothing.
    Matter,
    /// Shares of skin.
    Skin(&'a PaddedRow),
    /// The layer around an isosurface: normals, and optical depths in log2.
    Soft(&'a [PaddedRow; 4]),
}

impl Row {
    /// The numbers of the step before.
    #[inline(always)]
    fn places<S: Simd>(&self, simd: S, column: usize) -> Places<S> {
        let mut sums = [0.0; LANES];
        sums.copy_from_slice(&self.sums[column..][..LANES]);
        Places {
            at: lanes(simd, &self.before, column),
            sums,
            rest: lanes(simd, &self.rest, column),
            strengths: f32x16::splat(simd, 0.0),
        }
    }

    #[inline(always)]
    fn keep<S: Simd>(&mut self, column: usize, places: &Places<S>) {
        self.sums[column..][..LANES].copy_from_slice(&places.sums);
        places.at.store_slice(&mut self.before[column..][..LANES]);
        places.rest.store_slice(&mut self.rest[column..][..LANES]);
    }
}

/// The numbers between those of two rows at two places, at these shares of the way along a row and from row to row.
#[inline(always)]
fn bilinear<S: Simd>(
    simd: S,
    [near, far]: [&[f32]; 2],
    [place, next]: [usize; 2],
    [along, across]: [f32; 2],
) -> f32x16<S> {
    let of_near = mix(lanes(simd, near, place), lanes(simd, near, next), along);
    let of_far = mix(lanes(simd, far, place), lanes(simd, far, next), along);
    mix(of_near, of_far, across)
}

/// The mean transmittance of an opaque surface is 1/2 over the light that it takes; a skin has its square root.
const SKIN_ROOT: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// The light at the vertices of three slices, one after another.
struct LightSlices {
    /// Before, at and after.
    slices: [Vec<PaddedRow>; 3],
    count: usize,
}

impl LightSlices {
    fn new(slices: [Vec<PaddedRow>; 3]) -> Self {
        Self { slices, count: 0 }
    }

    /// Goes on, and lends the slice that comes next.
    fn next(&mut self) -> &mut [PaddedRow] {
        self.slices.rotate_left(1);
        if self.count == 1 {
            // Before the first slice it is as bright.
            let [before, at, _] = &mut self.slices;
            copy(at, before);
        }
        self.count += 1;
        &mut self.slices[2]
    }

    /// Goes on where no slice is left.
    fn end(&mut self) {
        self.next();
        let [_, at, after] = &mut self.slices;
        copy(at, after);
    }

    /// Adds the transmittance of the slice in the middle to its vertices, times a weight.
    ///
    /// Its light is less by parts of its second differences. Between vertices straight lines lie above a curve by a
    /// twelfth of them along each axis in the mean. Where columns stand beside vertices, the lines between columns lie above it by
    /// s (1 - s) / 2 of them, s being the share of the way: without this a flat face had stripes where columns drift across it.
    fn add_to(
        &self,
        blocking: &Blocking,
        rows: &mut [(usize, &mut [f32])],
        (offset, weight): (Offset, f32),
    ) {
        let [along_x, along_y] = offset.share.map(|share| MEAN + 0.5 * share * (1.0 - share));
        let height = rows.len();
        let [before, at, after] = &self.slices;
        let padded = || PaddedRow(at[0].0.clone());
        let rows = rows.par_iter_mut().enumerate().with_min_len(ROWS);
        rows.for_each_init(padded, |found, (y, (row, shares))| {
            let sharp = Sharpening {
                lines: [
                    &at[y],
                    &at[y.saturating_sub(1)],
                    &at[(y + 1).min(height - 1)],
                    &before[y],
                    &after[y],
                ],
                bends: [along_x, along_y, MEAN],
            };
            for run in blocking.matter.vertices.runs(*row) {
                let ends = [run.first, run.first + run.len];
                let shares = &mut shares[blocking.matter.vertices.in_row(*row, run)];
                dispatch!(blocking.level, simd => sharp.add(simd, ends, (found, shares, weight)));
            }
        });
    }
}

fn copy(from: &[PaddedRow], to: &mut [PaddedRow]) {
    for (from, to) in from.iter().zip(to) {
        to.0.copy_from_slice(&from.0);
    }
}
