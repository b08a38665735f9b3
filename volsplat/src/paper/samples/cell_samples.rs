//! Samples of cells: what lies between voxels, classified before it is averaged.
//!
//! A transfer function applied to a voxel misses what happens between voxels. Here every cell of eight voxels is asked at
//! [`POINTS`] places a side: the field is interpolated there and then classified, and the cell becomes one sample of the
//! mean extinction and the extinction-weighted mean colour, or none where the field gives none. A cell in which the
//! classified field varies is split instead, into samples of half its side, and those once more: each size is a lattice of
//! its own ([`Samples`]), on which the kernel has its usual radius. So memory follows what is visible and how fine it is.
//! Limits: the mean over a cell knows no direction; what varies inside a quarter of a cell is asked once.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use resample_core::OpacityMode;

use crate::Error;
use crate::bricks::cells::{
    CELL_CORNERS, CELL_SIDE, CellBrick, VERTEX_SIDE, WithGradients, cell_range,
};
use crate::bricks::fill::FieldPlan;
use crate::bricks::plan::plan;
use crate::grid::bounds::{BRICK_SIDE, Bounds, brick_corners, pack_place};
use crate::look::options::RenderOptions;
use crate::look::scene::Scene;
use crate::paper::samples::cell_points::{
    PER_CELL, POINTS, Sum, add_points, halves_of, multiply_tints, nearest_corner,
};
use crate::paper::samples::sample::{Brick, Samples};
use crate::slabs::channel::{ChannelSettings, channels};

#[cfg(test)]
mod tests;

/// Lattices that samples may lie on: whole cells, halves, quarters.
pub(crate) const LEVELS: usize = POINTS.trailing_zeros() as usize + 1;

const _: () = assert!(
    LEVELS == 3 && CELL_SIDE <= BRICK_SIDE,
    "a cell is kept whole, in halves and in quarters"
);

/// The parts of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Parts {
    /// One sample.
    Whole,
    /// One, or those of its parts where they are farther than this from it.
    Split { error: f32 },
}

/// The samples of a scene's cells: those of whole cells first, then those of halves, then those of quarters.
///
/// [`Error::Option`] where a label map has too many labels.
pub(crate) fn cell_samples(
    scene: &Scene,
    options: &RenderOptions,
    parts: Parts,
) -> Result<Vec<Samples>, Error> {
    let channels = channels(scene, options)?;
    // Samples have gradients of their own.
    let plan = FieldPlan {
        gradients: WithGradients::No,
        ..plan(scene, options)?
    };
    let volume = scene.grid();
    let sampler = Sampler {
        plan: &plan,
        channels: &channels,
        opacity: options.opacity,
        finest: match parts {
            Parts::Whole => 0,
            Parts::Split { .. } => LEVELS - 1,
        },
        error: match parts {
            Parts::Whole => 0.0,
            Parts::Split { error } => error,
        },
    };
    let corners = brick_corners(volume.dims.map(|n| n - 1), CELL_SIDE);
    let bricks: Vec<_> = corners
        .par_iter()
        .map(|&corner| {
            plan.brick_at(corner)
                .map(|brick| sampler.bricks(&brick))
                .unwrap_or_default()
        })
        .collect();
    let mut lattices: Vec<Samples> = (0..=sampler.finest)
        .map(|level| Samples {
            bricks: Vec::new(),
            empty: 0,
            voxels: volume.len() as u64,
            count: 0,
            world_from_index: volume.world_from_index * grid_from_lattice(level),
            index_from_voxel: [f64::from(1 << level), -0.5],
        })
        .collect();
    for of_brick in bricks {
        lattices[0].empty += u64::from(of_brick.iter().all(Vec::is_empty));
        for (lattice, bricks) in lattices.iter_mut().zip(of_brick) {
            lattice.count += bricks
                .iter()
                .map(|brick| brick.places.len() as u64)
                .sum::<u64>();
            lattice.bricks.extend(bricks);
        }
    }
    Ok(lattices)
}

/// From the indices of a lattice of cells' parts to voxel indices: a sample stands in the middle of its part.
fn grid_from_lattice(level: usize) -> DAffine3 {
    let side = 0.5f64.powi(level as i32);
    DAffine3::from_scale(DVec3::splat(side)) * DAffine3::from_translation(DVec3::splat(0.5))
}

/// The input for sampling cells.
struct Sampler<'a> {
    plan: &'a FieldPlan<'a>,
    channels: &'a [ChannelSettings],
    opacity: OpacityMode,
    /// The finest lattice.
    finest: usize,
    /// Most that a part of a cell may differ from its mean.
    error: f32,
}

/// The classified field of one cell, x fastest: its mean, those of its halves, and those of its quarters, which are asked
/// once each.
struct CellMeans {
    whole: Sum,
    halves: [Sum; 8],
    quarters: [Sum; PER_CELL],
}

/// The bricks of one lattice that a brick of cells becomes, while they are filled.
struct Filling {
    /// First cell of the brick.
    corner: [u32; 3],
    level: usize,
    /// Bricks along a side.
    side: usize,
    bricks: Vec<Brick>,
}

/// A part of a cell: its place among the parts of its size.
#[derive(Clone, Copy)]
struct CellPart {
    /// How often the cell is halved.
    level: usize,
    at: [usize; 3],
}

impl CellPart {
    const WHOLE: Self = Self {
        level: 0,
        at: [0; 3],
    };
}

impl Sampler<'_> {
    /// The bricks of samples on each lattice that a brick of cells becomes.
    fn bricks(&self, cells: &CellBrick) -> [Vec<Brick>; LEVELS] {
        let mut filling: [Filling; LEVELS] =
            std::array::from_fn(|level| Filling::new(cells.bounds.corner, level));
        let [least, greatest] = cells.bounds.range().map(|end| end.map(usize::from));
        for z in least[2]..greatest[2] {
            for y in least[1]..greatest[1] {
                for x in least[0]..greatest[0] {
                    let first = x + VERTEX_SIDE * (y + VERTEX_SIDE * z);
                    if let Some(means) = self.means(cells, first) {
                        self.emit(&means, [x, y, z], CellPart::WHOLE, &mut filling);
                    }
                }
            }
        }
        filling.map(Filling::finished)
    }

    /// Adds a part of a cell, at its place among the parts of its size, or what it is split into.
    fn emit(
        &self,
        means: &CellMeans,
        cell: [usize; 3],
        part: CellPart,
        filling: &mut [Filling; LEVELS],
    ) {
        let CellPart { level, at } = part;
        let sum = means.at(level, at);
        if !(sum[3] > 0.0) {
            return;
        }
        let halves = octants(at);
        let varies = || {
            halves
                .iter()
                .any(|&half| self.differ(sum, means.at(level + 1, half)))
        };
        if level < self.finest && varies() {
            for half in halves {
                let half = CellPart {
                    level: level + 1,
                    at: half,
                };
                self.emit(means, cell, half, filling);
            }
        } else {
            filling[level].push(
                std::array::from_fn(|axis| (cell[axis] << level) + at[axis]),
                sum,
            );
        }
    }

    /// Returns true if two means show different pictures over an opacity unit: their opacities, or what they emit.
    fn differ(&self, a: Sum, b: Sum) -> bool {
        let shown = |sum: Sum| {
            let opacity = match self.opacity {
                OpacityMode::Extinction => -(-sum[3]).exp_m1(),
                OpacityMode::Linear => sum[3],
            };
            let share = opacity / sum[3].max(f32::MIN_POSITIVE);
            [sum[0] * share, sum[1] * share, sum[2] * share, opacity]
        };
        shown(a)
            .iter()
            .zip(shown(b))
            .any(|(a, b)| (a - b).abs() > self.error)
    }

    /// The means of the cell whose first vertex is at this place; `None` where the field shows nothing.
    fn means(&self, cells: &CellBrick, first: usize) -> Option<CellMeans> {
        let mut points = [[0.0f32; 4]; PER_CELL];
        let mut any = false;
        for (number, (channel, planned)) in
            self.channels.iter().zip(&self.plan.channels).enumerate()
        {
            let scalars = cells.channel(number).scalars;
            if planned.shown.meets(cell_range(scalars, first)) {
                let corners = scalars.corners(first);
                add_points(channel, corners, &mut points);
                any = true;
            }
        }
        if !any {
            return None;
        }
        multiply_tints(self.channels, cells, first, &mut points);
        if let Some(mask) = &cells.mask {
            for (i, point) in points.iter_mut().enumerate() {
                if mask[first + CELL_CORNERS[nearest_corner(i)]] == 0 {
                    *point = [0.0; 4];
                }
            }
        }
        let halves = halves_of(&points);
        let whole = std::array::from_fn(|k| halves.iter().map(|half| 0.125 * half[k]).sum());
        Some(CellMeans {
            whole,
            halves,
            quarters: points,
        })
    }
}

impl CellMeans {
    fn at(&self, level: usize, [x, y, z]: [usize; 3]) -> Sum {
        match level {
            0 => self.whole,
            1 => self.halves[x + 2 * (y + 2 * z)],
            _ => self.quarters[x + POINTS * (y + POINTS * z)],
        }
    }
}

impl Filling {
    fn new(corner: [u32; 3], level: usize) -> Self {
        let side = (CELL_SIDE << level).div_ceil(BRICK_SIDE);
        let part = (CELL_SIDE << level).min(BRICK_SIDE) as u32;
        let brick = |i: usize| {
            let at = [i % side, i / side % side, i / (side * side)];
            let corner =
                std::array::from_fn(|axis| (corner[axis] << level) + at[axis] as u32 * part);
            Brick {
                bounds: Bounds::nothing(corner),
                places: Vec::new(),
                values: Vec::new(),
                gradients: Vec::new(),
            }
        };
        Self {
            corner,
            level,
            side,
            bricks: (0..side * side * side).map(brick).collect(),
        }
    }

    /// Adds the sample at a place counted from the brick's first.
    fn push(&mut self, at: [usize; 3], sum: Sum) {
        assert!(
            at.iter().all(|&a| a < CELL_SIDE << self.level),
            "{at:?} of {:?}",
            self.corner
        );
        let [bx, by, bz] = at.map(|a| a / BRICK_SIDE);
        let brick = &mut self.bricks[bx + self.side * (by + self.side * bz)];
        let place = at.map(|a| a % BRICK_SIDE);
        let share = 1.0 / sum[3];
        brick.places.push(pack_place(place));
        brick
            .values
            .push([sum[0] * share, sum[1] * share, sum[2] * share, sum[3]]);
        brick.bounds.add(place);
    }

    fn finished(self) -> Vec<Brick> {
        let mut bricks = self.bricks;
        bricks.retain(|brick| !brick.places.is_empty());
        for brick in &mut bricks {
            brick.places.shrink_to_fit();
            brick.values.shrink_to_fit();
        }
        bricks
    }
}

/// The eight parts of half the side of a part.
fn octants(at: [usize; 3]) -> [[usize; 3]; 8] {
    std::array::from_fn(|i| std::array::from_fn(|axis| 2 * at[axis] + (i >> axis & 1)))
}
