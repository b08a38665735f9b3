//! Samples: the voxels that a transfer function leaves visible, stored compactly, brick by brick.
//!
//! Takes a volume and a transfer function (pre-classification: the function is applied to the voxel), gives bricks of
//! 16^3 voxels that hold only what is not transparent: two bytes of place and four floats of colour and strength a
//! sample, and three of its gradient where it is lit. Memory and every later cost follow the visible voxels, not the grid. Bricks are in Morton order, so that a
//! run of bricks is compact in space and touches few screen tiles.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use resample_core::OpacityMode;

use crate::clip::{Clip, GridClip};
use crate::grid::Grid;
use crate::sample_light::set_gradients;
use crate::scene::Scene;
use crate::transfer::TransferFunction;
use crate::volume::{Volume, Voxels, with_voxels};

/// Voxels along a brick's side. 16^3 samples project in one batch that fits the first-level cache; a brick of them is
/// large enough to be worth a visibility test and small enough to hug a surface.
pub const BRICK_SIDE: usize = 16;

/// Bits of a sample's place in its brick, per axis.
const PLACE_BITS: u32 = BRICK_SIDE.trailing_zeros();
const _: () = assert!(BRICK_SIDE.is_power_of_two() && 3 * PLACE_BITS <= u16::BITS);

/// Extinction of a fully opaque voxel, per opacity unit: exp(-87) is the edge of what f32 holds as a normal number,
/// so more would change no pixel.
const MAX_EXTINCTION: f64 = 87.0;

/// The visible voxels of a volume.
#[derive(Clone, Debug)]
pub struct Samples {
    /// Bricks that hold at least one sample, in Morton order.
    pub bricks: Vec<Brick>,
    /// Bricks that hold none, and were dropped.
    pub empty: u64,
    /// Voxels of the volume.
    pub voxels: u64,
    /// Samples in all bricks.
    pub count: u64,
    /// From the indices of samples to the world.
    pub world_from_index: DAffine3,
    /// A sample's index is its voxel's times the first plus the second, along each axis.
    pub index_from_voxel: [f64; 2],
}

/// The visible voxels of one brick.
#[derive(Clone, Debug)]
pub struct Brick {
    /// Where the samples lie.
    pub bounds: Bounds,
    /// Place of each sample in the brick, see [`place`].
    pub places: Vec<u16>,
    /// Linear red, green, blue, and the strength: extinction per opacity unit, or with linear opacity the opacity.
    pub values: Vec<[f32; 4]>,
    /// The gradient of the scalar at each sample, per world unit; none where nothing asks for it.
    pub gradients: Vec<[f32; 3]>,
}

/// Where the samples of a brick lie.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Index of the brick's first voxel.
    pub corner: [u32; 3],
    /// Least place along each axis that holds a sample.
    least: [u8; 3],
    /// Greatest such place.
    greatest: [u8; 3],
}

/// Packs a place in a brick.
pub(crate) fn pack_place([x, y, z]: [usize; 3]) -> u16 {
    (x | y << PLACE_BITS | z << (2 * PLACE_BITS)) as u16
}

/// The place (x, y, z) in a brick of a packed place.
#[inline(always)]
pub fn place(packed: u16) -> [u16; 3] {
    const MASK: u16 = BRICK_SIDE as u16 - 1;
    [
        packed & MASK,
        packed >> PLACE_BITS & MASK,
        packed >> (2 * PLACE_BITS),
    ]
}

impl Samples {
    /// Classifies every voxel of a scene and keeps those with opacity above 0 that the mask shows.
    pub(crate) fn of_scene(scene: &Scene, opacity: OpacityMode) -> Self {
        if let Some((volume, transfer)) = scene.single() {
            return Self::classify(volume, transfer, opacity);
        }
        let volume = scene.grid();
        let corners = brick_corners(volume.dims, BRICK_SIDE);
        let all = corners.len();
        let bricks: Vec<Brick> = corners
            .into_par_iter()
            .filter_map(|corner| {
                let sample = |index: usize| scene.voxel(index, opacity);
                brick_from(volume.dims, corner, sample)
            })
            .collect();
        Self::of_voxels(volume, bricks, all)
    }

    /// Applies the transfer function to every voxel and keeps those with opacity above 0.
    pub fn classify(volume: &Volume, transfer: &TransferFunction, opacity: OpacityMode) -> Self {
        let corners = brick_corners(volume.dims, BRICK_SIDE);
        let classifier = Classifier::new(volume, transfer, opacity);
        let all = corners.len();
        let bricks: Vec<Brick> = corners
            .into_par_iter()
            .filter_map(|corner| classifier.brick(volume, corner))
            .collect();
        Self::of_voxels(volume, bricks, all)
    }

    /// Samples that are voxels: the bricks that show something, of `all`.
    fn of_voxels(volume: &Volume, bricks: Vec<Brick>, all: usize) -> Self {
        Self {
            count: bricks.iter().map(|brick| brick.places.len() as u64).sum(),
            empty: (all - bricks.len()) as u64,
            bricks,
            voxels: volume.len() as u64,
            world_from_index: volume.world_from_index,
            index_from_voxel: [1.0, 0.0],
        }
    }
}

impl Samples {
    /// Gives the samples the gradients of a volume's scalars.
    pub(crate) fn set_gradients_of(&mut self, volume: &Volume) {
        let (dims, axes) = (volume.dims, &volume.world_from_index.matrix3);
        with_voxels!(&volume.voxels, slice => set_gradients(self, &Grid { voxels: slice, dims }, axes));
    }

    /// A clip of the volume in the indices of the samples.
    pub(crate) fn clip(&self, clip: &Clip) -> GridClip {
        let [scale, shift] = self.index_from_voxel;
        let moved = |corners: [DVec3; 2]| corners.map(|corner| corner * scale + shift);
        Clip {
            crop_in_grid: clip.crop_in_grid.map(moved),
            ..clip.clone()
        }
        .in_grid(&self.world_from_index)
    }
}

impl Brick {
    /// The samples whose voxel centres a clip keeps, in a brick of their own with the same bounds.
    pub(crate) fn kept(&self, clip: &GridClip) -> Self {
        let corner = DVec3::from(self.bounds.corner.map(f64::from));
        let is_kept =
            |&i: &usize| clip.keeps(corner + DVec3::from(place(self.places[i]).map(f64::from)));
        let kept: Vec<usize> = (0..self.places.len()).filter(is_kept).collect();
        Self {
            bounds: self.bounds,
            places: kept.iter().map(|&i| self.places[i]).collect(),
            values: kept.iter().map(|&i| self.values[i]).collect(),
            gradients: kept
                .iter()
                .filter_map(|&i| self.gradients.get(i).copied())
                .collect(),
        }
    }
}

impl Bounds {
    /// The bounds of no sample, in the brick with this first voxel.
    pub(crate) fn nothing(corner: [u32; 3]) -> Self {
        Self {
            corner,
            least: [u8::MAX; 3],
            greatest: [0; 3],
        }
    }

    /// The bounds with this least and greatest place along each axis.
    pub(crate) fn of_range(corner: [u32; 3], [least, greatest]: [[u8; 3]; 2]) -> Self {
        Self {
            corner,
            least,
            greatest,
        }
    }

    /// Least and greatest place along each axis.
    pub(crate) fn range(&self) -> [[u8; 3]; 2] {
        [self.least, self.greatest]
    }

    /// Takes a sample in.
    pub(crate) fn add(&mut self, place: [usize; 3]) {
        for (axis, at) in place.into_iter().enumerate() {
            self.least[axis] = self.least[axis].min(at as u8);
            self.greatest[axis] = self.greatest[axis].max(at as u8);
        }
    }

    /// The eight corners of the box of the samples' positions, grown by `margin` on all sides, in grid units.
    pub fn corners_in_grid(&self, margin: f64) -> [DVec3; 8] {
        let [least, greatest] = [self.least, self.greatest].map(|end| {
            DVec3::from(std::array::from_fn::<f64, 3, _>(|axis| {
                f64::from(self.corner[axis]) + f64::from(end[axis])
            }))
        });
        let (low, high) = (least - margin, greatest + margin);
        std::array::from_fn(|i| {
            let at = |axis: usize| {
                if i >> axis & 1 == 0 {
                    low[axis]
                } else {
                    high[axis]
                }
            };
            DVec3::new(at(0), at(1), at(2))
        })
    }
}

/// The first voxels of all bricks of `side` voxels of a grid, in Morton order.
pub(crate) fn brick_corners(dims: [usize; 3], side: usize) -> Vec<[u32; 3]> {
    let bricks = dims.map(|n| n.div_ceil(side));
    let mut corners: Vec<[u32; 3]> = (0..bricks.iter().product::<usize>())
        .map(|i| {
            [
                i % bricks[0],
                i / bricks[0] % bricks[1],
                i / (bricks[0] * bricks[1]),
            ]
        })
        .map(|brick| brick.map(|b| (b * side) as u32))
        .collect();
    corners.sort_unstable_by_key(|corner| morton(corner.map(|c| c / side as u32)));
    corners
}

/// The box, in the world, of the samples' positions that a clip keeps; `None` if there are none.
pub(crate) fn bounds_in_world(
    bounds: impl Iterator<Item = Bounds>,
    clip: &GridClip,
    world_from_index: &DAffine3,
) -> Option<[DVec3; 2]> {
    bounds
        .flat_map(|b| clip.corners(&b))
        .map(|corner| world_from_index.transform_point3(corner))
        .fold(None, |bounds, p| match bounds {
            None => Some([p, p]),
            Some([low, high]) => Some([low.min(p), high.max(p)]),
        })
}

/// The transfer function, as a table where the voxel type has few values.
enum Classifier<'a> {
    Table {
        entries: Vec<[f32; 4]>,
        lowest: f64,
    },
    Direct {
        transfer: &'a TransferFunction,
        opacity: OpacityMode,
    },
}

impl<'a> Classifier<'a> {
    fn new(volume: &Volume, transfer: &'a TransferFunction, opacity: OpacityMode) -> Self {
        // A table over all values of a type pays once the volume has more voxels than the table has entries.
        let range = match volume.voxels {
            Voxels::U8(_) => Some((0.0, 1 << 8)),
            Voxels::I8(_) => Some((-128.0, 1 << 8)),
            Voxels::U16(_) => Some((0.0, 1 << 16)),
            Voxels::I16(_) => Some((-32_768.0, 1 << 16)),
            Voxels::U32(_) | Voxels::I32(_) | Voxels::F32(_) | Voxels::F64(_) => None,
        };
        match range {
            Some((lowest, len)) if volume.len() >= len => {
                let entry = |i: usize| classified(transfer, opacity, lowest + i as f64);
                Self::Table {
                    entries: (0..len).map(entry).collect(),
                    lowest,
                }
            }
            _ => Self::Direct { transfer, opacity },
        }
    }

    #[inline(always)]
    fn sample(&self, value: f64) -> [f32; 4] {
        match self {
            Self::Table { entries, lowest } => entries[(value - lowest) as usize],
            Self::Direct { transfer, opacity } => classified(transfer, *opacity, value),
        }
    }

    fn brick(&self, volume: &Volume, corner: [u32; 3]) -> Option<Brick> {
        with_voxels!(&volume.voxels, slice => self.brick_of(slice, volume.dims, corner))
    }

    fn brick_of<T: Copy + Into<f64>>(
        &self,
        slice: &[T],
        dims: [usize; 3],
        corner: [u32; 3],
    ) -> Option<Brick> {
        let first = corner.map(|c| c as usize);
        let size: [usize; 3] = std::array::from_fn(|axis| BRICK_SIDE.min(dims[axis] - first[axis]));
        let (mut places, mut values) = (Vec::new(), Vec::new());
        let mut bounds = Bounds::nothing(corner);
        for z in 0..size[2] {
            for y in 0..size[1] {
                let start = first[0] + dims[0] * (first[1] + y + dims[1] * (first[2] + z));
                for (x, &voxel) in slice[start..start + size[0]].iter().enumerate() {
                    let value = self.sample(voxel.into());
                    if value[3] > 0.0 {
                        places.push(pack_place([x, y, z]));
                        values.push(value);
                        bounds.add([x, y, z]);
                    }
                }
            }
        }
        places.shrink_to_fit();
        values.shrink_to_fit();
        (!places.is_empty()).then_some(Brick {
            bounds,
            places,
            values,
            gradients: Vec::new(),
        })
    }
}

/// A brick of what `sample` makes of the voxel at a linear index.
fn brick_from(
    dims: [usize; 3],
    corner: [u32; 3],
    sample: impl Fn(usize) -> [f32; 4],
) -> Option<Brick> {
    let first = corner.map(|c| c as usize);
    let size: [usize; 3] = std::array::from_fn(|axis| BRICK_SIDE.min(dims[axis] - first[axis]));
    let (mut places, mut values) = (Vec::new(), Vec::new());
    let mut bounds = Bounds::nothing(corner);
    for i in 0..size.iter().product() {
        let [x, y, z] = [i % size[0], i / size[0] % size[1], i / (size[0] * size[1])];
        let value = sample(first[0] + x + dims[0] * (first[1] + y + dims[1] * (first[2] + z)));
        if value[3] > 0.0 {
            places.push(pack_place([x, y, z]));
            values.push(value);
            bounds.add([x, y, z]);
        }
    }
    (!places.is_empty()).then_some(Brick {
        bounds,
        places,
        values,
        gradients: Vec::new(),
    })
}

/// Colour and strength of a scalar.
pub(crate) fn classified(transfer: &TransferFunction, mode: OpacityMode, value: f64) -> [f32; 4] {
    let (rgb, opacity) = transfer.sample(value);
    [rgb[0], rgb[1], rgb[2], strength_of(opacity, mode)]
}

/// Strength of an opacity: extinction per opacity unit, or with linear opacity the opacity.
pub(crate) fn strength_of(opacity: f64, mode: OpacityMode) -> f32 {
    let strength = match mode {
        OpacityMode::Extinction => (-(-opacity).ln_1p()).min(MAX_EXTINCTION),
        OpacityMode::Linear => opacity,
    };
    strength as f32
}

/// The bits of three brick coordinates, interleaved.
fn morton(brick: [u32; 3]) -> u64 {
    let mut code = 0;
    for bit in 0..21 {
        for (axis, b) in brick.iter().enumerate() {
            code |= u64::from((b >> bit) & 1) << (3 * bit + axis);
        }
    }
    code
}
