//! Columns of light, carried from slice to slice.

use glam::DVec3;
use rayon::prelude::*;

use crate::bricks::cells::CellField;
use crate::look::clip::GridClip;
use crate::shadow::medium::Medium;
use crate::shadow::slices::{Axes, Layer, Numbers, VertexBox, layers_of, vertices};

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
    /// Length from one slice to the next, opacity units.
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
            first[side] = (-end).min(0.0).floor() as i64;
            let top = (last - end.min(0.0)).ceil() as i64;
            count[side] = (top - first[side] + 1) as usize;
        }
        Self {
            axes,
            within,
            rises: step[axes.along] < 0.0,
            shift,
            first,
            count,
            length: length as f32,
        }
    }

    /// The slice of the grid that is the `number`-th on the way from the light.
    fn slice(&self, number: usize) -> usize {
        let along = self.axes.along;
        match self.rises {
            true => self.within.high[along] - number,
            false => self.within.low[along] + number,
        }
    }

    fn offset(&self, number: usize) -> Offset {
        let moved = self.shift.map(|shift| shift * number as f64);
        let whole = moved.map(|moved| moved.floor());
        Offset {
            whole: whole.map(|whole| whole as i64),
            share: [0, 1].map(|side| (moved[side] - whole[side]) as f32),
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
                origin[axis] = low[axis] as f64 + (self.first[side] + at as i64) as f64;
            }
            origin[self.axes.along] = self.slice(0) as f64;
            clip.interval(origin, step).map(|end| end as f32)
        };
        (0..self.count[0] * self.count[1])
            .into_par_iter()
            .map(place)
            .collect()
    }
}

/// The numbers at the vertices of a slice.
struct Slice {
    width: usize,
    numbers: Vec<f32>,
}

impl Slice {
    fn fill(
        &mut self,
        field: &CellField,
        layers: &[Layer],
        columns: &Columns,
        slice: usize,
        numbers: &Numbers,
    ) {
        self.numbers.fill(f32::NAN);
        let [b, c] = columns.axes.across;
        let low = columns.within.low;
        for layer in layers_of(slice).filter_map(|layer| layers.get(layer)) {
            for &brick in &layer.bricks {
                let brick = &field.bricks[brick as usize];
                for (vertex, [x, y]) in vertices(brick, slice, columns.axes) {
                    let value = numbers.at(brick, vertex);
                    self.numbers[x - low[b] + self.width * (y - low[c])] = value;
                }
            }
        }
    }
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
        let across = match along {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        };
        Self {
            step: -towards / size[along],
            length: 1.0 / size[along],
            axes: Axes { across, along },
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

/// Adds the transmittance towards the light to each vertex of the layers, times a weight, and returns the light of all columns.
pub(super) fn add(
    field: &CellField,
    (medium, numbers): (&Medium, &Numbers),
    clip: &GridClip,
    ray: &Ray,
    (layers, weight): (&mut [Layer], f32),
) -> Met {
    let Some(within) = VertexBox::of(field) else {
        return Met::default();
    };
    let columns = Columns::new(ray.axes, within, ray.step, ray.length);
    let [width, height] = columns.count;
    let kept = columns.kept(clip, ray.step);
    let mut depth = vec![0.0f32; width * height];
    let mut before = vec![f32::NAN; width * height];
    let mut root = vec![1.0f32; width * height];
    let side = |axis: usize| within.len(ray.axes.across[axis]);
    let mut slice = Slice {
        width: side(0),
        numbers: vec![f32::NAN; side(0) * side(1)],
    };
    for number in 0..within.len(ray.axes.along) {
        let at = columns.slice(number);
        slice.fill(field, layers, &columns, at, numbers);
        let offset = columns.offset(number);
        let rows = depth
            .par_chunks_mut(width)
            .zip(before.par_chunks_mut(width))
            .zip(root.par_chunks_mut(width));
        rows.enumerate().for_each(|(y, ((depth, before), root))| {
            let row = Row {
                depth,
                before,
                root,
            };
            let kept = kept.get(y * width..(y + 1) * width);
            columns.advance(row, y, &slice, offset, (medium, kept, number));
        });
        for layer in layers_of(at) {
            let Some(layer) = layers.get_mut(layer) else {
                continue;
            };
            let tables = layer.values.par_iter_mut().zip(&layer.bricks);
            tables.for_each(|(table, &brick)| {
                let brick = &field.bricks[brick as usize];
                for (vertex, place) in vertices(brick, at, ray.axes) {
                    let root = columns.at_vertex(&root, place, offset);
                    table[vertex] += weight * root * root;
                }
            });
        }
    }
    let mut met = Met::default();
    for root in root {
        met.add(Met::of_column(f64::from(root * root)));
    }
    met
}

impl Columns {
    /// Carries a row of columns on to a slice.
    fn advance(
        &self,
        row: Row,
        y: usize,
        slice: &Slice,
        offset: Offset,
        (medium, kept, number): (&Medium, Option<&[[f32; 2]]>, usize),
    ) {
        let height = slice.numbers.len() / slice.width;
        let [share_x, share_y] = offset.share;
        let beside = |share: f32| usize::from(share > 0.0);
        let above = self.first[1] + y as i64 + offset.whole[1];
        let is_inside = above >= 0 && above as usize + beside(share_y) < height;
        if !is_inside {
            row.before.fill(f32::NAN);
            return;
        }
        let line = |y: usize| &slice.numbers[y * slice.width..][..slice.width];
        let (near, far) = (line(above as usize), line(above as usize + beside(share_y)));
        // Columns that stand in the slice.
        let start = -(self.first[0] + offset.whole[0]);
        let end = start + (slice.width - beside(share_x)) as i64;
        let [start, end] = [start, end].map(|end| end.clamp(0, self.count[0] as i64) as usize);
        row.before[..start].fill(f32::NAN);
        row.before[end..].fill(f32::NAN);
        for column in start..end {
            let x = (column as i64 + self.first[0] + offset.whole[0]) as usize;
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
                (to.min(number as f32) - from.max(number as f32 - 1.0)).clamp(0.0, 1.0)
            });
            let added = medium.mean(last, value) * self.length * part;
            if added > 0.0 {
                row.depth[column] += added;
                row.root[column] = (-0.5 * row.depth[column]).exp();
            }
        }
    }

    /// The square root of the transmittance at a vertex of a slice, between the columns around it.
    #[inline(always)]
    fn at_vertex(&self, root: &[f32], place: [usize; 2], offset: Offset) -> f32 {
        let mut whole = [0; 2];
        let mut share = [0.0; 2];
        for side in 0..2 {
            let low = self.within.low[self.axes.across[side]];
            // The vertex less the offset: one column back where the offset has a share.
            let back = i64::from(offset.share[side] > 0.0);
            let column = (place[side] - low) as i64 - offset.whole[side] - back - self.first[side];
            whole[side] = column.clamp(0, self.count[side] as i64 - 1) as usize;
            share[side] = if back == 1 {
                1.0 - offset.share[side]
            } else {
                0.0
            };
        }
        let width = self.count[0];
        let next = [0, 1].map(|side| (whole[side] + 1).min(self.count[side] - 1));
        let mix = |y: usize| {
            let (a, b) = (root[whole[0] + y * width], root[next[0] + y * width]);
            a + share[0] * (b - a)
        };
        let (a, b) = (mix(whole[1]), mix(next[1]));
        a + share[1] * (b - a)
    }
}
