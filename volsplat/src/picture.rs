//! The picture: tiles of sub-pixels that become pixels.
//!
//! The mean of a pixel's sub-pixels is the midpoint rule. The first term of its error, by the Euler-Maclaurin formula, is
//! h^2/24 times the change of the picture's slope over the pixel along both axes, h being the distance of sub-pixels. The slope
//! at a side is the difference of the half-pixels, or of the single samples, that meet there. All weights of sub-pixels
//! are positive, so that a mean stays among the values that it is made of.
//! Limits: at the picture's rim an axis without a neighbour is left as it is.

use std::ops::Range;

use glam::{DAffine3, DVec2, DVec3};
use rayon::prelude::*;
use resample_core::clock::{StageClock, StageTime};
use resample_core::composite::{TileCounts, TilePixels};
use resample_core::maps::TilePlane;
use resample_core::tile::TILE_PX;
use resample_core::view::largest_eigenvalue;
use resample_core::{Camera, GridView, Image};

use crate::look::options::DepthPlane;
use crate::stats::{FrameStats, SampleCounts};

/// The least of 1, 2, 4 and 8 at which samples, which stand on the lattice that `world_from_grid` places, are `least_px`
/// sub-pixels apart at this position of the lattice; 8 where even that is too few. A position behind the eye, or one that is no
/// number, gives 1.
pub(crate) fn automatic(
    camera: &Camera,
    world_from_grid: &DAffine3,
    pos_in_grid: DVec3,
    least_px: f64,
) -> u32 {
    let view = GridView::new(camera, world_from_grid);
    let gram = view.gram_px2(view.camera_from_grid.transform_point3(pos_in_grid));
    let spacing_px = largest_eigenvalue(gram).sqrt();
    [1, 2, 4]
        .into_iter()
        .find(|&n| !(f64::from(n) * spacing_px < least_px))
        .unwrap_or(8)
}

/// The camera with as many times the pixels along each side, and how many times that is: half as many, and half of that, until
/// a camera may have them.
pub(crate) fn refined(camera: &Camera, subpixels: u32) -> (Camera, u32) {
    let mut subpixels = subpixels;
    loop {
        match camera.resized(camera.width * subpixels, camera.height * subpixels) {
            Ok(fine) => return (fine, subpixels),
            Err(_) if subpixels > 1 => subpixels /= 2,
            Err(_) => return (*camera, 1),
        }
    }
}

/// One tile of the frame buffer, with what it cost.
#[derive(Clone, Debug, Default)]
pub(crate) struct TileSlot {
    /// The pixels of the tile, row by row, made when the tile first shows something: memory follows what is
    /// visible. Read it with [`TileSlot::shown`].
    pixels: Vec<ShownPixel>,
    /// Half of the differences between the halves of the pixels, along x and along y; only where means are corrected by
    /// them.
    slopes: Vec<[Values; 2]>,
    /// True if `pixels` are of this frame.
    seen: bool,
    pub(crate) entries: Vec<u64>,
    /// Items listed in the tile, where they are not in `entries`.
    listed: usize,
    pub(crate) counts: TileCounts,
    /// Counts of a field's samples.
    pub(crate) work: SampleCounts,
    pub(crate) sort_ms: f64,
    pub(crate) composite_ms: f64,
}

/// A pixel of the picture, premultiplied.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ShownPixel {
    pub(crate) rgb: [f32; 3],
    pub(crate) opacity: f32,
    /// Depth times the opacity that it was seen with.
    pub(crate) depth: f32,
}

/// How the pixels of a picture follow from sub-pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Means {
    /// As the mean of their own.
    Own,
    /// With the first term of its error taken away.
    Corrected,
}

/// Numbers of a pixel.
const VALUES: usize = 5;

/// The numbers of a pixel side by side.
type Values = [f32; VALUES];

impl ShownPixel {
    fn values(&self) -> Values {
        let [red, green, blue] = self.rgb;
        [red, green, blue, self.opacity, self.depth]
    }

    fn of_values([red, green, blue, opacity, depth]: Values) -> Self {
        Self {
            rgb: [red, green, blue],
            opacity,
            depth,
        }
    }
}

impl TileSlot {
    /// An empty tile that `listed` items touch.
    pub(crate) fn reset(&mut self, listed: usize) {
        self.seen = false;
        self.entries.clear();
        self.listed = listed;
        self.counts = TileCounts::default();
        self.work = SampleCounts::default();
        (self.sort_ms, self.composite_ms) = (0.0, 0.0);
    }

    /// Takes note of more items that touch the tile.
    pub(crate) fn list_more(&mut self, listed: usize) {
        self.listed += listed;
    }

    /// Adds to what the tile cost.
    pub(crate) fn count(&mut self, counts: TileCounts) {
        self.counts.composited += counts.composited;
        self.counts.pixels_touched += counts.pixels_touched;
    }

    /// Adds to what became of the samples of a field.
    pub(crate) fn count_samples(&mut self, work: SampleCounts) {
        self.work.computed += work.computed;
        self.work.shown += work.shown;
        self.work.contributed += work.contributed;
    }

    /// Keeps what the tile shows in this frame: the means over squares of `subpixels` on a side, and what corrects them.
    pub(crate) fn show(&mut self, pixels: &TilePixels, subpixels: usize, means: Means) {
        self.seen = true;
        let side = TILE_PX / subpixels;
        let places = (0..side * side).map(|i| [i % side, i / side]);
        self.pixels.clear();
        self.slopes.clear();
        if means == Means::Corrected && subpixels > 1 {
            let quarters = quarters(pixels, subpixels / 2);
            for at in places {
                let (mean, slopes) = mean_and_slopes(&quarters, at);
                self.pixels.push(ShownPixel::of_values(mean));
                self.slopes.push(slopes);
            }
        } else {
            let averaged = pixels.averaged(subpixels);
            let pixel = |at| ShownPixel::of_values(values_at(&averaged, at));
            self.pixels.extend(places.map(pixel));
        }
    }

    /// The pixels of the tile in this frame, row by row; `None` where nothing is seen.
    pub(crate) fn shown(&self) -> Option<&[ShownPixel]> {
        self.seen.then_some(self.pixels.as_slice())
    }

    /// A row of the tile's pixels, `side` of them, and of their slopes where there are any; `None` where it shows nothing.
    fn row(&self, y: usize, side: usize) -> Option<(&[ShownPixel], &[[Values; 2]])> {
        let pixels = &self.shown()?[y * side..][..side];
        let slopes = self.slopes.get(y * side..(y + 1) * side);
        Some((pixels, slopes.unwrap_or_default()))
    }
}

/// The numbers of a pixel of a tile.
fn values_at(pixels: &TilePixels, [x, y]: [usize; 2]) -> Values {
    let [red, green, blue] = &pixels.rgb;
    let at = |plane: &TilePlane| plane[y][x];
    let opacity = 1.0 - at(&pixels.transmittance);
    [at(red), at(green), at(blue), opacity, at(&pixels.depth)]
}

/// The means over squares of so many sub-pixels on a side, quarters of pixels.
fn quarters(pixels: &TilePixels, side: usize) -> TilePixels {
    let share = 1.0 / (side * side) as f32;
    let mean = |plane: &TilePlane| -> TilePlane {
        let mut means = [[0.0; TILE_PX]; TILE_PX];
        for (rows, means) in plane.chunks_exact(side).zip(&mut means) {
            let mut sums = [0.0; TILE_PX];
            for row in rows {
                for (sum, value) in sums.iter_mut().zip(row) {
                    *sum += value;
                }
            }
            for (mean, sums) in means.iter_mut().zip(sums.chunks_exact(side)) {
                *mean = share * sums.iter().sum::<f32>();
            }
        }
        means
    };
    TilePixels {
        transmittance: mean(&pixels.transmittance),
        rgb: [0, 1, 2].map(|k| mean(&pixels.rgb[k])),
        depth: mean(&pixels.depth),
    }
}

/// The mean of a pixel, and half of the differences between its halves along x and along y, from its quarters.
fn mean_and_slopes(quarters: &TilePixels, [x, y]: [usize; 2]) -> (Values, [Values; 2]) {
    let at = |right: usize, down: usize| values_at(quarters, [2 * x + right, 2 * y + down]);
    let [[a, b], [c, d]] = [[at(0, 0), at(1, 0)], [at(0, 1), at(1, 1)]];
    let (mut mean, mut slopes) = ([0.0; VALUES], [[0.0; VALUES]; 2]);
    for k in 0..VALUES {
        mean[k] = 0.25 * ((a[k] + b[k]) + (c[k] + d[k]));
        slopes[0][k] = 0.25 * ((b[k] - a[k]) + (d[k] - c[k]));
        slopes[1][k] = 0.25 * ((c[k] - a[k]) + (d[k] - b[k]));
    }
    (mean, slopes)
}

/// Adds up what the tiles cost.
pub(crate) fn tally(slots: &[TileSlot], whole: StageTime, stats: &mut FrameStats) {
    let (mut sort_ms, mut composite_ms) = (0.0, 0.0);
    for slot in slots {
        sort_ms += slot.sort_ms;
        composite_ms += slot.composite_ms;
        let listed = slot.entries.len() + slot.listed;
        stats.tile_pairs += listed as u64;
        stats.hidden_pairs += (listed - slot.counts.composited) as u64;
        stats.pixels_touched += slot.counts.pixels_touched as u64;
        stats.lanes_computed += slot.work.computed as u64;
        stats.samples_shown += slot.work.shown as u64;
        stats.samples_contributed += slot.work.contributed as u64;
    }
    [stats.stages.sort, stats.stages.composite] = whole.shared([sort_ms, composite_ms]);
}

/// Four numbers of a pixel, the last its opacity; 0 stands for nothing.
type Four = [f32; 4];

/// How pixels lie in tiles and in the picture.
#[derive(Clone, Copy, Debug)]
struct PixelGrid {
    width: usize,
    height: usize,
    /// Sub-pixels along a pixel's side.
    subpixels: usize,
}

/// The means of all pixels of a picture, corrected; `picked` takes four numbers of a pixel, or of its slopes.
fn correct(
    tiles: &[TileSlot],
    grid: PixelGrid,
    picked: impl Fn(&Values) -> Four + Sync,
    means: &mut [Four],
) {
    let (width, side) = (grid.width, TILE_PX / grid.subpixels);
    // The halves of a pixel are half a pixel apart, single samples a whole one.
    let apart = if grid.subpixels == 1 { 1.0 } else { 0.5 };
    let scale = 1.0 / (24.0 * apart * (grid.subpixels * grid.subpixels) as f32);
    let bands = means.par_chunks_mut(side * width).enumerate();
    bands.for_each_init(Band::default, |band, (number, rows)| {
        band.read(tiles, grid, number, &picked);
        for (row, means) in rows.chunks_mut(width).enumerate() {
            let y = number * side + row;
            let is_inner = y > 0 && y + 1 < grid.height;
            for columns in band.near.clone() {
                band.correct(row + 1, (columns, is_inner), scale, means);
            }
        }
    });
}

/// The rows of a row of tiles, with one above and one below.
#[derive(Default)]
struct Band {
    width: usize,
    means: Vec<Four>,
    /// Half of the difference between the halves of a pixel, along x and along y; empty where there is one sample.
    slopes: [Vec<Four>; 2],
    /// The columns of pixels in and beside the tiles that show something.
    near: Vec<Range<usize>>,
}

impl Band {
    /// Reads the row of tiles of this number, and the rows of pixels above and below.
    fn read(
        &mut self,
        tiles: &[TileSlot],
        grid: PixelGrid,
        number: usize,
        picked: impl Fn(&Values) -> Four,
    ) {
        let PixelGrid { width, height, .. } = grid;
        let side = TILE_PX / grid.subpixels;
        let columns = width.div_ceil(side);
        self.clear(width, width * (side + 2), grid.subpixels > 1);
        let mut shown = vec![false; columns];
        for row in 0..side + 2 {
            // Counted from the row above the tiles.
            let Some(y) = (number * side + row).checked_sub(1).filter(|&y| y < height) else {
                continue;
            };
            let of_row = &tiles[y / side * columns..][..columns];
            for (column, tile) in of_row.iter().enumerate() {
                let Some((pixels, slopes)) = tile.row(y % side, side) else {
                    continue;
                };
                shown[column] = true;
                let at = row * width + column * side;
                let range = at..(at + side).min((row + 1) * width);
                for (mean, pixel) in self.means[range.clone()].iter_mut().zip(pixels) {
                    *mean = picked(&pixel.values());
                }
                let [along_x, along_y] = &mut self.slopes;
                for (i, [x, y]) in range.zip(slopes) {
                    (along_x[i], along_y[i]) = (picked(x), picked(y));
                }
            }
        }
        self.find_near(&shown, side);
    }

    fn clear(&mut self, width: usize, count: usize, with_slopes: bool) {
        self.width = width;
        self.means.clear();
        self.means.resize(count, [0.0; 4]);
        for slopes in &mut self.slopes {
            slopes.clear();
            slopes.resize(if with_slopes { count } else { 0 }, [0.0; 4]);
        }
    }

    /// The columns of pixels in and beside these tiles.
    fn find_near(&mut self, shown: &[bool], side: usize) {
        self.near.clear();
        for (column, _) in shown.iter().enumerate().filter(|(_, shown)| **shown) {
            let start = (column * side).saturating_sub(1);
            let end = ((column + 1) * side + 1).min(self.width);
            match self.near.last_mut() {
                Some(last) if start <= last.end => last.end = end,
                _ => self.near.push(start..end),
            }
        }
    }

    /// Corrects the means of a part of a row; `is_inner` where the picture has a row above and one below.
    fn correct(
        &self,
        row: usize,
        (columns, is_inner): (Range<usize>, bool),
        scale: f32,
        means: &mut [Four],
    ) {
        let width = self.width;
        let inner = columns.start.max(1)..columns.end.min(width - 1);
        let [above, own, below] = rows_around(&self.means, row, width);
        means[columns.clone()].copy_from_slice(&own[columns.clone()]);
        for x in inner.clone() {
            add_curvature(&mut means[x], scale, [own[x - 1], own[x], own[x + 1]]);
        }
        if is_inner {
            for x in columns.clone() {
                add_curvature(&mut means[x], scale, [above[x], own[x], below[x]]);
            }
        }
        let [along_x, along_y] = &self.slopes;
        if !along_x.is_empty() {
            let [_, own, _] = rows_around(along_x, row, width);
            for x in inner {
                add_difference(&mut means[x], scale, [own[x - 1], own[x + 1]]);
            }
            let [above, _, below] = rows_around(along_y, row, width);
            for x in columns.clone().filter(|_| is_inner) {
                add_difference(&mut means[x], scale, [above[x], below[x]]);
            }
        }
        // Rounding may lead below nothing, and opacities beyond 1.
        for mean in &mut means[columns] {
            *mean = mean.map(|value| value.max(0.0));
            mean[3] = mean[3].min(1.0);
        }
    }
}

/// A row with the one above and the one below.
fn rows_around(values: &[Four], row: usize, width: usize) -> [&[Four]; 3] {
    [row - 1, row, row + 1].map(|row| &values[row * width..][..width])
}

#[inline(always)]
fn add_curvature(mean: &mut Four, scale: f32, [before, own, after]: [Four; 3]) {
    for k in 0..4 {
        mean[k] += scale * ((before[k] - own[k]) + (after[k] - own[k]));
    }
}

#[inline(always)]
fn add_difference(mean: &mut Four, scale: f32, [before, after]: [Four; 2]) {
    for k in 0..4 {
        mean[k] += scale * (before[k] - after[k]);
    }
}

/// How tiles lie in the picture, and what their depth means.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileLayout {
    /// The camera of the picture.
    pub(crate) camera: Camera,
    /// Sub-pixels along a pixel's side that the tiles were rendered with; a tile holds its pixels' means.
    pub(crate) subpixels: u32,
    /// How pixels follow from them.
    pub(crate) means: Means,
    /// The depth of a tile.
    pub(crate) depth: TileDepth,
    /// The length in which that is counted, world units.
    pub(crate) length: f64,
}

/// The depth of a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TileDepth {
    /// Distance from the eye (perspective) or camera z.
    Distance,
    /// Camera z.
    CameraZ,
}

/// Copies the tiles into a picture.
pub(crate) fn picture(
    tiles: &[TileSlot],
    layout: &TileLayout,
    depth: DepthPlane,
    stats: &mut FrameStats,
) -> Image {
    let clock = StageClock::start();
    let (width, height) = (layout.camera.width as usize, layout.camera.height as usize);
    let mut image = Image::transparent(width, height);
    let colours = |&[red, green, blue, opacity, _]: &Values| [red, green, blue, opacity];
    take(tiles, layout, colours, &mut image.rgba);
    if depth == DepthPlane::Expected {
        let length = layout.length as f32;
        let mut depths = vec![[0.0; 4]; width * height];
        let with_opacity = |&[.., opacity, depth]: &Values| [depth, 0.0, 0.0, opacity];
        take(tiles, layout, with_opacity, &mut depths);
        let plane = depths
            .iter()
            .enumerate()
            .map(|(i, &[depth, _, _, opacity])| {
                if opacity > 0.0 {
                    depth / opacity * camera_z_per_depth(layout, i % width, i / width) * length
                } else {
                    f32::INFINITY
                }
            });
        image.depth = Some(plane.collect());
    }
    stats.stages.image = clock.stop();
    image
}

/// Takes four numbers of each pixel out of the tiles; a pixel that shows nothing is left alone.
fn take(
    tiles: &[TileSlot],
    layout: &TileLayout,
    picked: impl Fn(&Values) -> Four + Sync,
    pixels: &mut [Four],
) {
    let grid = PixelGrid {
        width: layout.camera.width as usize,
        height: layout.camera.height as usize,
        subpixels: layout.subpixels as usize,
    };
    if layout.means == Means::Corrected {
        correct(tiles, grid, picked, pixels);
        return;
    }
    let side = TILE_PX / grid.subpixels;
    let columns = grid.width.div_ceil(side);
    let rows = pixels.par_chunks_mut(grid.width).enumerate();
    rows.for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            if let Some(shown) = tiles[y / side * columns + x / side].shown() {
                *pixel = picked(&shown[y % side * side + x % side].values());
            }
        }
    });
}

/// Camera z per unit of a tile's depth, at a pixel.
fn camera_z_per_depth(layout: &TileLayout, x: usize, y: usize) -> f32 {
    if layout.depth == TileDepth::CameraZ {
        return 1.0;
    }
    let (_, direction) = layout
        .camera
        .ray_in_camera(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
    (1.0 / direction.length()) as f32
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use resample_core::LookAt;

    use super::*;

    #[test]
    fn large_pictures_get_as_many_sub_pixels_as_a_camera_may_have() {
        let pose = LookAt {
            position: DVec3::Z,
            target: DVec3::ZERO,
            up: DVec3::Y,
        };
        for (side, asked, found) in [(4096, 8, 8), (4097, 8, 4), (10_000, 8, 2), (32_768, 16, 1)] {
            let camera = Camera::perspective(&pose, 1.0, [side, 10]).expect("a camera");
            let (fine, subpixels) = refined(&camera, asked);
            assert_eq!((fine.width, subpixels), (side * found, found), "{side}");
        }
    }
}
