//! Samples: the voxels that a transfer function leaves visible, stored compactly, brick by brick.
//!
//! Takes a volume and a transfer function (pre-classification: the function is applied to the voxel), gives bricks of
//! 16^3 voxels that hold only the samples that are not transparent: two bytes of place and four floats of colour and strength a
//! sample, and three of its gradient where it is lit. Memory and every later cost follow the visible voxels, not the grid. Bricks are in Morton order, so that a
//! run of bricks is compact in space and touches few screen tiles.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use resample_core::OpacityMode;
use resample_volume::volume::{Volume, Voxels, with_voxels};

use crate::bricks::cull::BrickOfSamples;
use crate::grid::{BRICK_SIDE, Bounds, brick_corners, pack_place, place};
use crate::look::clip::{Clip, GridClip};
use crate::look::scene::Scene;
use crate::look::transfer::TransferFunction;
use crate::look::transfer::classified;

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

impl BrickOfSamples for Brick {
    fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    fn sample_count(&self) -> usize {
        self.places.len()
    }
}
