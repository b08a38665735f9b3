//! The lattices of samples that are drawn together: voxels, or whole cells and their parts.
//!
//! A layer is a lattice with its samples and with the clip in its own indices. One kernel serves all of them: each uses it
//! at its own spacing, so that samples of half the side have a kernel of half the radius.
//!
//! A transfer function applied to a voxel misses what happens between voxels. So every cell of eight voxels is classified at
//! [`POINTS`] places a side, interpolated there, and the cell becomes one sample of the
//! mean extinction and the extinction-weighted mean colour, or none where the field gives none. A cell in which the
//! classified field varies is split instead, into samples of half its side, and those once more: each size is a lattice of
//! its own ([`Samples`]), on which the kernel has its usual radius. So memory follows what is visible and how fine it is.
//! Limits: the mean over a cell knows no direction; a detail inside a quarter of a cell is sampled once.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use resample_core::OpacityMode;
use resample_volume::volume::Volume;

use crate::Error;
use crate::bricks::cells::{
    CELL_CORNERS, CELL_SIDE, CellBrick, VERTEX_SIDE, WithGradients, cell_range,
};
use crate::bricks::fill::{FieldPlan, plan};
use crate::grid::{BRICK_SIDE, Bounds, brick_corners, pack_place};
use crate::look::clip::{Clip, GridClip, bounds_in_world};
use crate::look::options::{Cells, RenderOptions, SampleOptions, SampleOrder};
use crate::look::scene::{Channel, Look, Scene};
use crate::paper::samples::sample::{Brick, Samples};
use crate::slabs::settings::{ChannelSettings, Reading, Role, channels, weights_of_tints};

/// The samples of one lattice.
#[derive(Clone, Debug)]
pub(crate) struct Layer {
    pub(crate) samples: Samples,
    pub(crate) clip: GridClip,
    /// How often the first layer's spacing is halved.
    pub(crate) halvings: u32,
}

/// The cells that the options select in a scene: [`Cells::Auto`] decided. Cells of a single slice have no volume.
pub(crate) fn cells_of(scene: &Scene, samples: &SampleOptions) -> Cells {
    match samples.cells {
        _ if scene.grid().dims.contains(&1) => Cells::Off,
        Cells::Auto if samples.order == SampleOrder::EverySample => Cells::SPLIT,
        Cells::Auto => Cells::Off,
        chosen => chosen,
    }
}

/// The layers of a scene, coarse to fine, with the clip of the options. [`Error::Option`] where samples are to be lit that
/// have no gradient, or a label map has too many labels.
pub(crate) fn layers(
    scene: &Scene,
    options: &RenderOptions,
    samples: &SampleOptions,
) -> Result<Vec<Layer>, Error> {
    let mut lattices = match cells_of(scene, samples) {
        Cells::Split { error } => cell_samples(scene, options, Parts::Split { error })?,
        Cells::Mean => cell_samples(scene, options, Parts::Whole)?,
        Cells::Off | Cells::Auto => vec![Samples::of_scene(scene, options.opacity)],
    };
    if options.follows_gradient() {
        let volume = lit_volume(scene)?;
        lattices
            .iter_mut()
            .for_each(|samples| samples.set_gradients_of(volume));
    }
    let layer = |(halvings, samples): (_, Samples)| {
        let clip = samples.clip(&options.clip);
        Layer {
            samples,
            clip,
            halvings,
        }
    };
    Ok((0..).zip(lattices).map(layer).collect())
}

/// The scalars whose gradient lights the samples.
fn lit_volume<'a>(scene: &Scene<'a>) -> Result<&'a Volume, Error> {
    match scene.channels.as_slice() {
        &[Channel { volume, look: Look::Transfer(_) }] => Ok(volume),
        _ => Err(Error::Option(
            "samples are lit by the gradient of one channel of scalars: draw several channels and labels as a field, or leave \
             out the shading and the opacity by the gradient"
                .into(),
        )),
    }
}

/// The box, in the world, of the samples that are drawn.
pub(crate) fn layers_in_world(layers: &[Layer]) -> Option<[DVec3; 2]> {
    let boxes = layers.iter().filter_map(|layer| {
        bounds_in_world(layer.bounds(), &layer.clip, &layer.samples.world_from_index)
    });
    boxes.reduce(|[low, high], [l, h]| [low.min(l), high.max(h)])
}

impl Layer {
    /// Changes the kept part of the volume.
    pub(crate) fn update_clip(&mut self, clip: &Clip) {
        self.clip = self.samples.clip(clip);
    }

    /// The places of the layer's bricks.
    pub(crate) fn bounds(&self) -> impl Iterator<Item = Bounds> + '_ {
        self.samples.bricks.iter().map(|brick| brick.bounds)
    }
}

/// Places along a cell's side at which the field is asked, in the middles of as many equal parts.
const POINTS: usize = 4;

/// Places in a cell.
const PER_CELL: usize = POINTS * POINTS * POINTS;

/// Colours times strength, and strength.
pub(crate) type Sum = [f32; 4];

/// Multiplies the colours at the points of a cell by the sum of the tints there.
fn multiply_tints(
    channels: &[ChannelSettings],
    cells: &CellBrick,
    first: usize,
    points: &mut [Sum; PER_CELL],
) {
    let is_tint = |channel: &ChannelSettings| channel.role == Role::Tint;
    if !channels.iter().any(is_tint) {
        return;
    }
    let corners = |number: usize| cells.channel(number).scalars.corners(first);
    let weights = weights_of_tints(channels).map_or([1.0; 8], |(number, least)| {
        corners(number).map(|value| (value - least).max(0.0))
    });
    let sums = at_points(weights);
    let mut tints = [[0.0f32; 4]; PER_CELL];
    for (number, channel) in channels.iter().enumerate() {
        if !is_tint(channel) {
            continue;
        }
        let values = corners(number);
        let products = at_points(std::array::from_fn(|k| weights[k] * values[k]));
        for (i, tint) in tints.iter_mut().enumerate() {
            let value = products[i] / sums[i].max(f32::MIN_POSITIVE);
            for (sum, value) in tint.iter_mut().zip(channel.table.at(value)) {
                *sum += value;
            }
        }
    }
    for (point, tint) in points.iter_mut().zip(&tints) {
        for (value, factor) in point.iter_mut().zip(&tint[..3]) {
            *value *= factor;
        }
    }
}

/// The corner of the cell that is nearest to a point: which half the point lies in, along each axis.
pub(crate) fn nearest_corner(point: usize) -> usize {
    let at = [
        point % POINTS,
        point / POINTS % POINTS,
        point / (POINTS * POINTS),
    ];
    (0..3).map(|axis| (2 * at[axis] / POINTS) << axis).sum()
}

/// Adds the extinction and the colour of a channel at the points of a cell.
fn add_points(channel: &ChannelSettings, corners: [f32; 8], points: &mut [Sum; PER_CELL]) {
    let mut add = |i: usize, value: f32| {
        let [r, g, b, strength] = channel.table.at(value);
        for (sum, part) in
            points[i]
                .iter_mut()
                .zip([r * strength, g * strength, b * strength, strength])
        {
            *sum += part;
        }
    };
    if channel.reading == Reading::Nearest {
        for i in 0..PER_CELL {
            add(i, corners[nearest_corner(i)]);
        }
        return;
    }
    for (i, value) in at_points(corners).into_iter().enumerate() {
        add(i, value);
    }
}

/// The trilinear mix of the corners of a cell at its points.
fn at_points(corners: [f32; 8]) -> [f32; PER_CELL] {
    let mut values = [0.0; PER_CELL];
    let share = |i: usize| (i as f32 + 0.5) / POINTS as f32;
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    for z in 0..POINTS {
        let face: [f32; 4] = std::array::from_fn(|k| mix(corners[k], corners[k + 4], share(z)));
        for y in 0..POINTS {
            let (left, right) = (
                mix(face[0], face[2], share(y)),
                mix(face[1], face[3], share(y)),
            );
            for x in 0..POINTS {
                values[x + POINTS * (y + POINTS * z)] = mix(left, right, share(x));
            }
        }
    }
    values
}

/// Means over the halves of a cell.
fn halves_of(points: &[Sum; PER_CELL]) -> [Sum; 8] {
    let mut means = [[0.0; 4]; 8];
    for (i, point) in points.iter().enumerate() {
        for (mean, value) in means[nearest_corner(i)].iter_mut().zip(point) {
            *mean += 0.125 * value;
        }
    }
    means
}

/// Lattices that samples may lie on: whole cells, halves, quarters.
const LEVELS: usize = POINTS.trailing_zeros() as usize + 1;

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

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;
    use crate::look::clip::Clip;
    use crate::look::transfer::{ColourKnot, OpacityKnot};
    use crate::{TransferFunction, Volume, Voxels};

    /// Red below 0.5, blue above; opaque in part from 0.25 on.
    fn look() -> TransferFunction {
        let colour = |value: f64, rgb: [f32; 3]| ColourKnot { value, rgb };
        let colours = vec![
            colour(0.0, [1.0, 0.0, 0.0]),
            colour(0.5, [1.0, 0.0, 0.0]),
            colour(0.5, [0.0, 0.0, 1.0]),
            colour(1.0, [0.0, 0.0, 1.0]),
        ];
        let opacity = |value: f64, opacity: f64| OpacityKnot { value, opacity };
        TransferFunction::new(
            colours,
            vec![opacity(0.25, 0.0), opacity(0.25, 0.5), opacity(1.0, 0.5)],
        )
        .expect("the knots ascend")
    }

    /// A field that rises along x from 0 at the first voxel to 1 at the last.
    fn ramp(dims: [usize; 3]) -> Volume {
        let value = |i: usize| (i % dims[0]) as f64 / (dims[0] - 1) as f64;
        let voxels = (0..dims.iter().product()).map(value).collect();
        Volume::new(dims, Voxels::F64(voxels), DAffine3::IDENTITY).expect("a valid volume")
    }

    fn samples(volume: &Volume, parts: Parts) -> Vec<Samples> {
        let options = RenderOptions::every_sample();
        cell_samples(&Scene::new(volume, &look()), &options, parts).expect("one channel")
    }

    #[test]
    fn one_cell_carries_the_mean_of_what_lies_in_it() {
        // Of four layers of places the first, at 1/8, is invisible, the second is red, the others are blue.
        let mean = samples(&ramp([2, 2, 2]), Parts::Whole);
        assert_eq!((mean.len(), mean[0].count), (1, 1), "one cell, one sample");
        let [r, g, b, strength] = mean[0].bricks[0].values[0];
        assert!(
            (f64::from(strength) - 0.75 * 2f64.ln()).abs() < 1e-6,
            "extinction {strength}"
        );
        assert!(
            (r - 1.0 / 3.0).abs() < 1e-6 && g == 0.0 && (b - 2.0 / 3.0).abs() < 1e-6,
            "colour {r} {g} {b}"
        );
        let place = mean[0].world_from_index.transform_point3(DVec3::ZERO);
        assert_eq!(
            place,
            DVec3::splat(0.5),
            "the sample stands in the middle of its cell"
        );
    }

    #[test]
    fn parts_are_split_only_where_they_differ() {
        let split = samples(&ramp([2, 2, 2]), Parts::Split { error: 0.01 });
        // The left half holds what is invisible and what is red: 16 quarters of it are seen. The right half is all blue.
        let counts: Vec<u64> = split.iter().map(|lattice| lattice.count).collect();
        assert_eq!(counts, [0, 4, 16], "whole cells, halves, quarters");
        let coarse = samples(&ramp([2, 2, 2]), Parts::Split { error: 0.9 });
        assert_eq!(
            coarse.iter().map(|l| l.count).collect::<Vec<_>>(),
            [1, 0, 0],
            "an error that allows all"
        );
        let quarter = split[2].world_from_index.transform_point3(DVec3::ZERO);
        assert_eq!(
            quarter,
            DVec3::splat(0.125),
            "the middle of the first quarter"
        );
    }

    #[test]
    fn splitting_keeps_what_there_is_of_extinction_and_colour() {
        let volume = ramp([12, 10, 9]);
        let total = |lattices: &[Samples]| {
            let mut sum = [0.0f64; 4];
            for (level, lattice) in lattices.iter().enumerate() {
                for value in lattice.bricks.iter().flat_map(|brick| &brick.values) {
                    let mass = f64::from(value[3]) * 0.125f64.powi(level as i32);
                    for (sum, part) in sum.iter_mut().zip([value[0], value[1], value[2], 1.0]) {
                        *sum += mass * f64::from(part);
                    }
                }
            }
            sum
        };
        let [mean, split] = [Parts::Whole, Parts::Split { error: 0.05 }]
            .map(|parts| total(&samples(&volume, parts)));
        for (a, b) in mean.iter().zip(split) {
            assert!(
                (a - b).abs() < 1e-5 * mean[3],
                "{mean:?} split into {split:?}"
            );
        }
    }

    #[test]
    fn a_clip_of_voxels_is_the_same_place_on_every_lattice() {
        let volume = ramp([20, 5, 5]);
        let clip = Clip {
            crop_in_grid: Some([DVec3::splat(1.0), DVec3::splat(3.0)]),
            ..Clip::default()
        };
        for lattice in samples(&volume, Parts::Split { error: 0.01 }) {
            let in_lattice = lattice.clip(&clip);
            let inverse = lattice.world_from_index.inverse();
            for (at, kept) in [(0.99, false), (1.01, true), (2.99, true), (3.01, false)] {
                let place = inverse.transform_point3(DVec3::splat(at));
                assert_eq!(in_lattice.keeps(place), kept, "voxel {at}");
            }
        }
    }
}
