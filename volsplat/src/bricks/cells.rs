//! Cells: the space between eight voxels each, in bricks that hold at least one visible scalar.
//!
//! A brick stores the scalars at all its vertices side by side, so that the eight that a sample needs are a few cache lines apart: as
//! numbers, or as bytes, four in one number for each face of a cell, which a sample reads at twice. Gradients are stored at the same
//! vertices. Differences of bytes are kept as they are, whole numbers, three in four bytes; they become a gradient
//! where a sample is lit. That takes a quarter of the memory of vectors. Bricks whose cells
//! hold no visible scalar are dropped, and the others know the box of their visible cells. Further channels and a mask go
//! with the brick, in tables of the same layout.

use std::array::from_fn;

use glam::{DMat3, DVec3};
use resample_volume::volume::{Grid, VoxelType};

use crate::bricks::smooth::Smoothing;
use crate::grid::{Bounds, gradient_from_differences};
use crate::light::gradient_in_f32;

/// Cells along a brick's side: small enough to hug thin structures, large enough that finding a brick on the screen
/// costs little beside its samples. 4 and 16 were slower on both a dense and a sparse volume.
pub(crate) const CELL_SIDE: usize = 8;

/// Rows of cells of a brick, and cells.
pub(crate) const CELL_ROWS: usize = CELL_SIDE * CELL_SIDE;
pub(crate) const CELLS: usize = CELL_SIDE * CELL_ROWS;

/// Vertices along a brick's side.
pub(crate) const VERTEX_SIDE: usize = CELL_SIDE + 1;

/// Places in a brick's table.
pub(crate) const TABLE_LEN: usize = VERTEX_SIDE * VERTEX_SIDE * VERTEX_SIDE;

/// Place of a brick's last cell. A place that is held below it needs no check of its corners' places.
pub(crate) const LAST_CELL: usize = TABLE_LEN - 1 - (1 + VERTEX_SIDE + VERTEX_SIDE * VERTEX_SIDE);

/// Faces of a brick's cells across z, first those of the first layer of vertices: a cell has the face of its own number
/// and that of the next layer.
pub(crate) const FACES: usize = CELLS + CELL_ROWS;

/// The bytes at the four corners of each face, x fastest in both, the first corner lowest: two loads instead of eight, of
/// voxels that are whole numbers of eight bits.
pub(crate) type FaceBytes = [u32; FACES];

/// A value for each vertex of a brick.
pub(crate) type Table = [f32; TABLE_LEN];

/// From the place of a cell's first vertex to its eight.
pub(crate) const CELL_CORNERS: [usize; 8] = {
    let (row, layer) = (VERTEX_SIDE, VERTEX_SIDE * VERTEX_SIDE);
    [
        0,
        1,
        row,
        row + 1,
        layer,
        layer + 1,
        layer + row,
        layer + row + 1,
    ]
};

/// Scalars at the vertices of a brick, or the numbers of labels in a palette.
#[derive(Clone, Debug)]
pub(crate) enum Scalars {
    /// Voxels that are whole numbers of eight bits, by face.
    Bytes(Box<FaceBytes>),
    /// All others, x fastest, [`VERTEX_SIDE`] a row.
    Numbers(Box<Table>),
}

/// A byte for each vertex of a brick.
pub(crate) type ByteTable = [u8; TABLE_LEN];

/// The place of a cell's first vertex as the number of the cell, both x fastest.
#[inline(always)]
pub(crate) fn cell_of(vertex: usize) -> usize {
    const LAYER: usize = VERTEX_SIDE * VERTEX_SIDE;
    // Each row of cells is shorter by one than one of vertices, each layer by a row and one for each of its other rows.
    vertex - vertex / VERTEX_SIDE - CELL_SIDE * (vertex / LAYER)
}

/// The bytes at the corners of each face, of bytes at the vertices.
pub(crate) fn faces_of(bytes: &ByteTable) -> Box<FaceBytes> {
    const LAYER: usize = VERTEX_SIDE * VERTEX_SIDE;
    let mut pairs = [0u16; TABLE_LEN];
    for (pair, ends) in pairs.iter_mut().zip(bytes.windows(2)) {
        *pair = u16::from(ends[0]) | u16::from(ends[1]) << 8;
    }
    let mut faces = Box::new([0; FACES]);
    for (layer, faces) in faces.chunks_exact_mut(CELL_ROWS).enumerate() {
        for (row, faces) in faces.chunks_exact_mut(CELL_SIDE).enumerate() {
            let first = layer * LAYER + row * VERTEX_SIDE;
            let (near, far) = (&pairs[first..], &pairs[first + VERTEX_SIDE..]);
            for (x, face) in faces.iter_mut().enumerate() {
                *face = u32::from(near[x]) | u32::from(far[x]) << 16;
            }
        }
    }
    faces
}

/// The byte at a vertex.
#[inline(always)]
pub(crate) fn byte_at(faces: &FaceBytes, vertex: usize) -> u8 {
    let [x, y] = [vertex % VERTEX_SIDE, vertex / VERTEX_SIDE % VERTEX_SIDE];
    let z = vertex / (VERTEX_SIDE * VERTEX_SIDE);
    // The last vertices of a row and of a layer have no face of their own.
    let [column, row] = [x, y].map(|at| at.min(CELL_SIDE - 1));
    let face = faces[column + CELL_SIDE * (row + CELL_SIDE * z)];
    face.to_le_bytes()[x - column + 2 * (y - row)]
}

/// The trilinear mix of a cell's bytes, at this share of it along each axis.
#[inline(always)]
pub(crate) fn face_value(faces: &FaceBytes, cell: usize, [x, y, z]: [f32; 3]) -> f32 {
    let mix = |a: f32, b: f32, t: f32| (b - a).mul_add(t, a);
    let cell = cell % CELLS;
    let [front, back] = [faces[cell], faces[cell + CELL_ROWS]].map(|face| {
        let [a, b, c, d] = face.to_le_bytes().map(f32::from);
        mix(mix(a, b, x), mix(c, d, x), y)
    });
    mix(front, back, z)
}

impl Scalars {
    /// Those of bytes at the vertices.
    pub(crate) fn of_bytes(bytes: &ByteTable) -> Self {
        Self::Bytes(faces_of(bytes))
    }

    /// The scalar at a vertex.
    #[inline(always)]
    pub(crate) fn at(&self, vertex: usize) -> f32 {
        match self {
            Self::Numbers(table) => table[vertex],
            Self::Bytes(faces) => f32::from(byte_at(faces, vertex)),
        }
    }

    /// Copies the scalars of a row, from the vertex at a place on.
    pub(crate) fn copy_row(&self, first: usize, to: &mut [f32]) {
        match self {
            Self::Numbers(table) => to.copy_from_slice(&table[first..][..to.len()]),
            Self::Bytes(faces) => {
                let [x, y] = [first % VERTEX_SIDE, first / VERTEX_SIDE % VERTEX_SIDE];
                let z = first / (VERTEX_SIDE * VERTEX_SIDE);
                let row = y.min(CELL_SIDE - 1);
                let faces = &faces[CELL_SIDE * (row + CELL_SIDE * z)..][..CELL_SIDE];
                let corner = 2 * (y - row);
                for (scalar, face) in to.iter_mut().zip(&faces[x..]) {
                    *scalar = f32::from(face.to_le_bytes()[corner]);
                }
                // The last vertex of a row has no face of its own.
                if let Some(last) = to.get_mut(CELL_SIDE - x) {
                    *last = f32::from(faces[CELL_SIDE - 1].to_le_bytes()[corner + 1]);
                }
            }
        }
    }

    /// The scalars at the corners of a cell, x fastest; `first` is the place of its first vertex.
    #[inline(always)]
    pub(crate) fn corners(&self, first: usize) -> [f32; 8] {
        match self {
            Self::Numbers(table) => CELL_CORNERS.map(|offset| table[first + offset]),
            Self::Bytes(faces) => {
                let cell = cell_of(first) % CELLS;
                let [a, b, c, d] = faces[cell].to_le_bytes().map(f32::from);
                let [e, f, g, h] = faces[cell + CELL_ROWS].to_le_bytes().map(f32::from);
                [a, b, c, d, e, f, g, h]
            }
        }
    }

    /// A number for each vertex.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = f32> + '_ {
        (0..TABLE_LEN).map(|vertex| self.at(vertex))
    }

    /// Bytes of memory of the scalars of a brick.
    pub(crate) fn size(are_bytes: bool) -> usize {
        if are_bytes {
            size_of::<FaceBytes>()
        } else {
            size_of::<Table>()
        }
    }
}

/// The gradients at the vertices of a brick.
#[derive(Clone, Debug)]
pub(crate) enum Gradients {
    /// Of any scalars.
    Vectors(Box<GradientTable>),
    /// Of bytes.
    Differences(Box<DifferenceTable>),
}

/// A vector for each vertex of a brick, along the world's axes, per unit in which pictures count lengths. The fourth number is 0:
/// so one load takes a vector.
pub(crate) type GradientTable = [[f32; 4]; TABLE_LEN];

/// The differences of the bytes on both sides of each vertex, of a brick, along the axes of the grid: x in the lowest 11 bits, y
/// in the next 11, z in the highest 10, each with its sign.
pub(crate) type DifferenceTable = [u32; TABLE_LEN];

/// How far the differences along each axis are shifted to the left, and then to the right, with their sign.
pub(crate) const SHIFTS: [[u32; 2]; 3] = [[21, 21], [10, 21], [0, 22]];

/// Vertices of a brick along an axis with one more on either side.
const AROUND: usize = VERTEX_SIDE + 2;
const LAYER: usize = AROUND * AROUND;

/// The values of a brick's voxels and of those around it, x fastest.
type Around<V> = [V; AROUND * AROUND * AROUND];

impl Gradients {
    /// The gradient at a vertex.
    pub(crate) fn at(&self, vertex: usize, from: &FromDifferences) -> [f32; 3] {
        match self {
            Self::Vectors(table) => {
                let [x, y, z, _] = table[vertex];
                [x, y, z]
            }
            Self::Differences(table) => {
                let along =
                    SHIFTS.map(|[left, right]| ((table[vertex] << left) as i32 >> right) as f32);
                from_fn(|part| {
                    (0..3)
                        .map(|axis| from.columns[axis][part] * along[axis])
                        .sum()
                })
            }
        }
    }
}

/// Gradients of a function of the voxels, up to the greatest vertex: central differences, one-sided by repetition at the
/// volume's faces; of blurred values, where a smoothing is given.
pub(crate) fn vectors<T: Copy + Into<f64>>(
    grid: &Grid<T>,
    value: impl Fn(f64) -> f32,
    bounds: &Bounds,
    (gradient_from_differences, smoothing): (&DMat3, Option<&Smoothing>),
) -> Gradients {
    let value = |voxel: T| value(voxel.into());
    match smoothing {
        None => {
            let around = around(grid, value, bounds);
            vectors_of(&around, bounds, gradient_from_differences)
        }
        Some(smoothing) => {
            let around = smoothing.cube::<T, AROUND>(grid, value, bounds.corner);
            vectors_of(&around, bounds, gradient_from_differences)
        }
    }
}

/// The central differences of the values in and around a brick, as gradients.
fn vectors_of(around: &[f32], bounds: &Bounds, gradient_from_differences: &DMat3) -> Gradients {
    let mut table = Box::new([[0.0f32; 4]; TABLE_LEN]);
    let [_, greatest] = bounds.range().map(|end| end.map(usize::from));
    for z in 0..=greatest[2] {
        for y in 0..=greatest[1] {
            let middle = middle_of_row(y, z);
            let row = &mut table[vertex(0, y, z)..][..=greatest[0]];
            for (x, gradient) in row.iter_mut().enumerate() {
                let along =
                    |step: usize| f64::from(around[middle + x + step] - around[middle + x - step]);
                let difference = DVec3::new(along(1), along(AROUND), along(LAYER));
                let [gx, gy, gz] = gradient_in_f32(*gradient_from_differences * (0.5 * difference));
                *gradient = [gx, gy, gz, 0.0];
            }
        }
    }
    Gradients::Vectors(table)
}

/// The same differences of bytes.
pub(crate) fn differences(grid: &Grid<u8>, bounds: &Bounds) -> Gradients {
    let around = around(grid, |byte| byte, bounds);
    let mut table = Box::new([0; TABLE_LEN]);
    let [_, greatest] = bounds.range().map(|end| end.map(usize::from));
    for z in 0..=greatest[2] {
        for y in 0..=greatest[1] {
            let middle = middle_of_row(y, z);
            let row = |at: usize| &around[at..at + VERTEX_SIDE];
            // Whole rows: loops of a known length become vector instructions.
            let along = |step: usize| {
                let (below, above) = (row(middle - step), row(middle + step));
                let mut along = [0i32; VERTEX_SIDE];
                for x in 0..VERTEX_SIDE {
                    along[x] = i32::from(above[x]) - i32::from(below[x]);
                }
                along
            };
            let [x, y_along, z_along] = [along(1), along(AROUND), along(LAYER)];
            let row = &mut table[vertex(0, y, z)..][..VERTEX_SIDE];
            for k in 0..VERTEX_SIDE {
                row[k] = packed([x[k], y_along[k], z_along[k]]);
            }
        }
    }
    Gradients::Differences(table)
}

/// Three differences in one number.
#[inline(always)]
fn packed([x, y, z]: [i32; 3]) -> u32 {
    const MASK: u32 = (1 << 11) - 1;
    x as u32 & MASK | (y as u32 & MASK) << 11 | (z as u32) << 22
}

/// The place of the first vertex of a row in what is around a brick.
fn middle_of_row(y: usize, z: usize) -> usize {
    1 + (y + 1) * AROUND + (z + 1) * LAYER
}

/// Reads a brick up to one vertex beyond the greatest.
fn around<T: Copy, V: Copy + Default>(
    grid: &Grid<T>,
    value: impl Fn(T) -> V,
    bounds: &Bounds,
) -> Around<V> {
    let count: [usize; 3] = bounds.range()[1].map(|end| usize::from(end) + 3);
    // Indices in the volume along each axis.
    let indices: [[usize; AROUND]; 3] = from_fn(|axis| {
        let last = grid.dims[axis] - 1;
        from_fn(|i| {
            (bounds.corner[axis] as usize + i)
                .saturating_sub(1)
                .min(last)
        })
    });
    let mut around = [V::default(); AROUND * AROUND * AROUND];
    for (z, &index_z) in indices[2][..count[2]].iter().enumerate() {
        for (y, &index_y) in indices[1][..count[1]].iter().enumerate() {
            let voxels = grid.row([0, index_y, index_z], grid.dims[0]);
            let row = &mut around[(y + z * AROUND) * AROUND..][..AROUND];
            let first = indices[0][0];
            // Inside the volume the voxels of a row lie side by side.
            if let (true, Some(voxels)) = (
                indices[0][AROUND - 1] == first + AROUND - 1,
                voxels.get(first..first + AROUND),
            ) {
                for x in 0..AROUND {
                    row[x] = value(voxels[x]);
                }
                continue;
            }
            for (entry, &index_x) in row.iter_mut().zip(&indices[0]) {
                *entry = value(voxels[index_x]);
            }
        }
    }
    around
}

/// Place of a vertex in a brick's table.
pub(crate) fn vertex(x: usize, y: usize, z: usize) -> usize {
    x + VERTEX_SIDE * (y + VERTEX_SIDE * z)
}

/// From the differences of the voxels on both sides to gradients, along the axes of the world, as `Gradients::Vectors` holds
/// them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FromDifferences {
    /// The parts of the differences along x, of those along y, and of those along z.
    pub(crate) columns: [[f32; 3]; 3],
}

impl FromDifferences {
    /// Those of a grid with these axes.
    pub(crate) fn new(world_from_index: &DMat3) -> Self {
        let half = gradient_from_differences(world_from_index) * 0.5;
        Self {
            columns: half.as_mat3().to_cols_array_2d(),
        }
    }
}

/// The bricks of a volume that hold visible cells.
#[derive(Clone, Debug)]
pub(crate) struct CellField {
    /// Those that are shown, in Morton order.
    pub(crate) bricks: Vec<CellBrick>,
    /// The others in the same order, where all are kept so that other functions may show them; else none.
    pub(crate) spare: Vec<CellBrick>,
    /// Bricks that are not shown.
    pub(crate) empty: u64,
    pub(crate) non_transparent: u64,
    pub(crate) voxels: u64,
}

/// A brick of cells.
#[derive(Clone, Debug)]
pub(crate) struct CellBrick {
    /// The box of the visible cells: the brick's first voxel, and the least and greatest vertex.
    pub(crate) bounds: Bounds,
    /// Scalars at the vertices. Of labels, their numbers in a palette.
    pub(crate) scalars: Scalars,
    /// The scalar's gradient at the vertices; only where it was asked for.
    pub(crate) gradients: Option<Gradients>,
    /// Least and greatest scalar at the vertices.
    pub(crate) range: [f32; 2],
    /// The channels after the first.
    pub(crate) more: Vec<BrickChannel>,
    /// The cells of the box that may be visible.
    pub(crate) shown: ShownCells,
    /// 1 at vertices that the mask shows, 0 at others; `None` where it shows all of them.
    pub(crate) mask: Option<Box<[u8; TABLE_LEN]>>,
}

/// A bit for each cell of a brick: a byte for each row of cells along x, rows along y first.
#[derive(Clone, Debug)]
pub(crate) struct ShownCells {
    rows: [u8; CELL_ROWS],
}

impl ShownCells {
    /// The cells of these rows.
    pub(crate) fn of_rows(rows: [u8; CELL_ROWS]) -> Self {
        Self { rows }
    }

    /// No cell.
    pub(crate) fn none() -> Self {
        Self::of_rows([0; CELL_ROWS])
    }

    /// Every cell.
    pub(crate) fn all() -> Self {
        Self {
            rows: [u8::MAX; CELL_ROWS],
        }
    }

    /// Every cell between the least and the greatest vertex.
    pub(crate) fn between(bounds: &Bounds) -> Self {
        let [least, greatest] = bounds.range().map(|end| end.map(usize::from));
        let along_x = (least[0]..greatest[0]).fold(0, |cells, x| cells | 1 << x);
        let mut rows = [0; CELL_ROWS];
        for z in least[2]..greatest[2] {
            rows[z * CELL_SIDE..][least[1]..greatest[1]].fill(along_x);
        }
        Self { rows }
    }

    /// Those that are in either.
    pub(crate) fn or(mut self, other: &Self) -> Self {
        for (row, more) in self.rows.iter_mut().zip(other.rows) {
            *row |= more;
        }
        self
    }

    /// Those that are in both.
    pub(crate) fn and(mut self, other: &Self) -> Self {
        for (row, less) in self.rows.iter_mut().zip(other.rows) {
            *row &= less;
        }
        self
    }

    /// Returns true if there is one.
    pub(crate) fn any(&self) -> bool {
        self.rows != [0; CELL_ROWS]
    }

    /// The rows, a bit for each cell.
    #[inline(always)]
    pub(crate) fn rows(&self) -> &[u8; CELL_ROWS] {
        &self.rows
    }
}

/// One channel of a brick; the fields are those of [`CellBrick`].
#[derive(Clone, Debug)]
pub(crate) struct BrickChannel {
    pub(super) scalars: Scalars,
    pub(super) gradients: Option<Gradients>,
    pub(super) range: [f32; 2],
}

/// One channel of a brick, lent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChannelCells<'a> {
    pub(crate) scalars: &'a Scalars,
    pub(crate) gradients: Option<&'a Gradients>,
    pub(crate) range: [f32; 2],
}

/// The gradients that bricks carry.
#[derive(Clone, Debug)]
pub(crate) enum WithGradients {
    No,
    /// Central differences.
    Central,
    /// Central differences of values blurred along the short axes of the grid.
    Smooth(Smoothing),
}

impl WithGradients {
    /// Bytes of memory of the gradients of a brick.
    fn bytes(&self, are_bytes: bool) -> usize {
        match self {
            Self::No => 0,
            Self::Central if are_bytes => size_of::<DifferenceTable>(),
            Self::Central | Self::Smooth(_) => size_of::<GradientTable>(),
        }
    }

    /// Voxels on either side of a brick that its gradients depend on, along each axis.
    pub(crate) fn margin(&self) -> [usize; 3] {
        match self {
            Self::No => [0; 3],
            Self::Central => [1; 3],
            Self::Smooth(smoothing) => smoothing.radius().map(|radius| radius + 1),
        }
    }
}

impl CellBrick {
    /// Bytes that a brick of one channel of scalars of this type takes.
    pub(crate) fn bytes(voxel_type: VoxelType, gradients: &WithGradients) -> u64 {
        let are_bytes = voxel_type == VoxelType::U8;
        (size_of::<Self>() + Scalars::size(are_bytes) + gradients.bytes(are_bytes)) as u64
    }

    /// A channel by its number.
    #[inline(always)]
    pub(crate) fn channel(&self, number: usize) -> ChannelCells<'_> {
        match number.checked_sub(1) {
            None => ChannelCells {
                scalars: &self.scalars,
                gradients: self.gradients.as_ref(),
                range: self.range,
            },
            Some(place) => {
                let channel = &self.more[place];
                ChannelCells {
                    scalars: &channel.scalars,
                    gradients: channel.gradients.as_ref(),
                    range: channel.range,
                }
            }
        }
    }
}

/// Least and greatest scalar of a cell's corners; `first` is the place of its first vertex.
pub(crate) fn cell_range(scalars: &Scalars, first: usize) -> [f32; 2] {
    let corners = scalars.corners(first).into_iter();
    corners.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_hold_every_byte() {
        let bytes: ByteTable = from_fn(|i| (i * 37 % 251) as u8);
        let scalars = Scalars::of_bytes(&bytes);
        let read: Vec<f32> = scalars.numbers().collect();
        assert_eq!(read, bytes.map(f32::from));
        for z in 0..CELL_SIDE {
            for y in 0..CELL_SIDE {
                for x in 0..CELL_SIDE {
                    let first = x + VERTEX_SIDE * (y + VERTEX_SIDE * z);
                    assert_eq!(cell_of(first), x + CELL_SIDE * (y + CELL_SIDE * z));
                    let plain = CELL_CORNERS.map(|offset| f32::from(bytes[first + offset]));
                    assert_eq!(scalars.corners(first), plain, "{x} {y} {z}");
                }
            }
        }
    }

    #[test]
    fn differences_keep_their_signs() {
        for difference in [
            [-255, 255, -255],
            [255, -255, 255],
            [0, -1, 1],
            [17, -130, -254],
        ] {
            let whole = packed(difference);
            let unpacked = SHIFTS.map(|[left, right]| (whole << left) as i32 >> right);
            assert_eq!(unpacked, difference);
        }
    }
}
