//! One tile of 16x16 px, with an apron: visibility, then the blend, then coverage.
//!
//! Takes the splats of a tile, returns colour and depth of its pixels. The front is, at each pixel, the least depth of
//! a disc there plus the disc's tolerance; a disc before it belongs to the visible surface, and all that do are blended. A pixel whose
//! neighbours are all covered is opaque. Else subpixels, of it and of its neighbours, say whether a disc covers
//! them, and the pixel's Gaussian sums them.

use resample_core::Projection;
use resample_core::narrow::single;
use resample_core::point::PIXEL_SIGMA_PX;
use resample_core::tile::TILE_PX;

use crate::cloud::options::Blend;
use crate::cloud::project::{APRON_PX, REACH_SIGMAS, Splat, grown};

/// Side of the tile with its apron, px.
const SIDE: usize = TILE_PX + 2 * APRON_PX;

/// Most subpixels of a pixel along one axis: a mask has 64 bits. With 4, an edge along an axis is known to 1/8 px, its coverage to
/// that times the greatest density of the pixel's Gaussian, 0.8 per px: 0.1.
const MOST_SUB: usize = 8;

/// A linear fit moves the colour by at most this many standard deviations of the offsets of the discs: beyond them it
/// extrapolates. A guess.
const MOST_SHIFT: f32 = 1.0;

/// Weights below this are rounding.
const LEAST_WEIGHT: f32 = 1e-12;

/// The sums of one pixel of the blend: of each disc the weight, its colour and depth, and their moments with the offset.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    weight: f32,
    /// Red, green, blue, depth less the front's.
    values: [f32; 4],
    offset: [f32; 2],
    /// xx, xy, yy.
    square: [f32; 3],
    /// Values times the offset along x and along y.
    slopes: [[f32; 4]; 2],
}

/// The buffers of a tile.
#[derive(Clone, Debug)]
pub(crate) struct TileScratch {
    /// The farthest depth of the visible surface, of the tile with its apron; infinite where no disc is.
    front: [f32; SIDE * SIDE],
    /// Covered subpixels.
    masks: [u64; SIDE * SIDE],
    sums: [Sums; TILE_PX * TILE_PX],
    /// Subpixels of a pixel along one axis.
    sub: usize,
    /// Weights of the subpixels of three pixels along one axis.
    kernel: [f32; 3 * MOST_SUB],
}

/// Where a tile lies and how it is drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileJob {
    /// First pixel column and row.
    pub(crate) first: [usize; 2],
    /// Columns and rows in the picture.
    pub(crate) size: [usize; 2],
    /// Columns and rows of the picture.
    pub(crate) picture: [usize; 2],
    pub(crate) projection: Projection,
    pub(crate) blend: Blend,
}

/// A drawn pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pixel {
    /// Linear premultiplied colour and alpha.
    pub(crate) rgba: [f32; 4],
    /// Camera z; infinite where nothing is.
    pub(crate) depth: f32,
}

const EMPTY: Pixel = Pixel {
    rgba: [0.0; 4],
    depth: f32::INFINITY,
};

/// A disc at one pixel: its depth and, for perspective, that over the depth of its middle.
struct Met {
    z: f32,
    ratio: f32,
}

impl TileScratch {
    /// Buffers for so many subpixels along one axis of a pixel, at most 8.
    pub(crate) fn new(sub: usize) -> Self {
        let middle = 0.5 * (3 * sub) as f64 - 0.5;
        let weight = |i: usize| {
            let d = (i as f64 - middle) / (sub as f64 * PIXEL_SIGMA_PX);
            (-0.5 * d * d).exp()
        };
        let sum: f64 = (0..3 * sub).map(weight).sum();
        Self {
            front: [f32::INFINITY; SIDE * SIDE],
            masks: [0; SIDE * SIDE],
            sums: [Sums::default(); TILE_PX * TILE_PX],
            sub,
            kernel: std::array::from_fn(|i| single(weight(i) / sum)),
        }
    }

    /// Draws a tile; `splats` may be walked several times, in the order of the source.
    pub(crate) fn draw<'a, S>(&mut self, job: &TileJob, splats: impl Fn() -> S, to: &mut Vec<Pixel>)
    where
        S: Iterator<Item = &'a Splat>,
    {
        self.front.fill(f32::INFINITY);
        self.sums.fill(Sums::default());
        splats().for_each(|splat| self.find_front(job, splat));
        let needed = self.rims(job);
        if needed.is_some() {
            self.widen_front();
        }
        let farthest = self.front.iter().fold(0.0, |a: f32, &b| a.max(b));
        for splat in splats().filter(|splat| splat.z - splat.half_depth <= farthest) {
            self.add(job, splat);
        }
        if let Some(needed) = &needed {
            splats().for_each(|splat| self.cover(job, splat, needed));
        }
        to.clear();
        for y in 0..job.size[1] {
            for x in 0..job.size[0] {
                let alpha = match &needed {
                    Some(_) => self.alpha(job, x, y),
                    None => 1.0,
                };
                to.push(self.pixel(job, x, y, alpha));
            }
        }
    }

    /// Lowers the front to where a disc is, at the pixels whose centres it covers.
    fn find_front(&mut self, job: &TileJob, splat: &Splat) {
        for_each_pixel(job, &splat.disc_box, APRON_PX, |slot, centre| {
            let (dx, dy) = (centre[0] - splat.at[0], centre[1] - splat.at[1]);
            if form(&splat.disc, dx, dy) > splat.slack {
                return;
            }
            let met = splat.met(job.projection, dx, dy);
            if splat.covers(&met, dx, dy) {
                let front = &mut self.front[slot];
                *front = front.min(met.z + splat.tolerance);
            }
        });
    }

    /// The pixels of the tile with its apron whose subpixels matter: those within two of an uncovered one. `None` where every
    /// pixel is covered.
    fn rims(&mut self, job: &TileJob) -> Option<[bool; SIDE * SIDE]> {
        let mut needed = [false; SIDE * SIDE];
        let mut any = false;
        let ([left, right], [top, bottom]) = (inside_picture(job, 0), inside_picture(job, 1));
        for y in top..bottom {
            for x in left..right {
                if self.front[y * SIDE + x] < f32::INFINITY {
                    continue;
                }
                any = true;
                let columns = x.saturating_sub(2)..(x + 3).min(SIDE);
                for y in y.saturating_sub(2)..(y + 3).min(SIDE) {
                    needed[y * SIDE..][columns.clone()].fill(true);
                }
            }
        }
        for (mask, &needed) in self.masks.iter_mut().zip(&needed) {
            *mask = if needed { 0 } else { u64::MAX };
        }
        any.then_some(needed)
    }

    /// Gives an uncovered pixel, which may be covered in part, the least front of its neighbours.
    fn widen_front(&mut self) {
        let narrow = self.front;
        for y in 1..SIDE - 1 {
            for x in 1..SIDE - 1 {
                if narrow[y * SIDE + x] < f32::INFINITY {
                    continue;
                }
                let rows = (y - 1..y + 2).flat_map(|y| &narrow[y * SIDE + x - 1..y * SIDE + x + 2]);
                self.front[y * SIDE + x] = rows.fold(f32::INFINITY, |a, &b| a.min(b));
            }
        }
    }

    /// Adds a disc to the blend of the pixels where it belongs to the visible surface.
    fn add(&mut self, job: &TileJob, splat: &Splat) {
        let (front, sums) = (&self.front, &mut self.sums);
        let farthest_q = single(REACH_SIGMAS * REACH_SIGMAS);
        for_each_pixel(job, &splat.blend_box, 0, |slot, centre| {
            let (dx, dy) = (centre[0] - splat.at[0], centre[1] - splat.at[1]);
            let form = form(&splat.gaussian, dx, dy);
            if form > farthest_q * splat.slack {
                return;
            }
            let met = splat.met(job.projection, dx, dy);
            let q = met.ratio * met.ratio * form;
            let front = front[slot];
            if q > farthest_q || met.z > front {
                return;
            }
            let (x, y) = (slot % SIDE - APRON_PX, slot / SIDE - APRON_PX);
            let weight = splat.weight * exp_of_negative(-0.5 * q);
            let depth = if front < f32::INFINITY {
                met.z - front
            } else {
                met.z
            };
            let [r, g, b] = splat.rgb;
            sums[y * TILE_PX + x].add(weight, [r, g, b, depth], [-dx, -dy]);
        });
    }

    /// Marks the subpixels that a disc covers.
    fn cover(&mut self, job: &TileJob, splat: &Splat, needed: &[bool; SIDE * SIDE]) {
        let (masks, side) = (&mut self.masks, self.sub);
        let whole = u64::MAX >> (64 - side * side);
        // Of the place in a pixel of each column or row of subpixels.
        let places: [f32; MOST_SUB] = std::array::from_fn(|i| (i as f32 + 0.5) / side as f32 - 0.5);
        // Subpixels lie up to half a pixel from their pixel's centre.
        for_each_pixel(job, &grown(splat.disc_box), APRON_PX, |slot, centre| {
            if !needed[slot] || masks[slot] == whole {
                return;
            }
            for sub in 0..side * side {
                let dx = centre[0] + places[sub % side] - splat.at[0];
                let dy = centre[1] + places[sub / side] - splat.at[1];
                let met = splat.met(job.projection, dx, dy);
                masks[slot] |= u64::from(splat.covers(&met, dx, dy)) << sub;
            }
        });
    }

    /// The part of the pixel's Gaussian that is covered; the picture goes on past its border as it is there.
    fn alpha(&self, job: &TileJob, x: usize, y: usize) -> f32 {
        let ([left, right], [top, bottom]) = (inside_picture(job, 0), inside_picture(job, 1));
        let (mut alpha, side) = (0.0, self.sub);
        for row in 0..3 * side {
            let line = (y + row / side).clamp(top, bottom - 1) * SIDE;
            let mut sum = 0.0;
            for block in 0..3 {
                let column = (x + block).clamp(left, right - 1);
                let mask = self.masks[line + column] >> (row % side * side);
                for sub in 0..side {
                    let is_covered = mask >> sub & 1 == 1;
                    sum += if is_covered {
                        self.kernel[block * side + sub]
                    } else {
                        0.0
                    };
                }
            }
            alpha += self.kernel[row] * sum;
        }
        // The weights sum to 1 up to rounding.
        if alpha > 1.0 - 1e-5 { 1.0 } else { alpha }
    }

    fn pixel(&self, job: &TileJob, x: usize, y: usize, alpha: f32) -> Pixel {
        let sums = &self.sums[y * TILE_PX + x];
        if !(alpha > 0.0 && sums.weight > LEAST_WEIGHT) {
            return EMPTY;
        }
        let [r, g, b, depth] = sums.value(job.blend);
        let front = self.front[(y + APRON_PX) * SIDE + x + APRON_PX];
        let light = |c: f32| alpha * c.clamp(0.0, 1.0);
        Pixel {
            rgba: [light(r), light(g), light(b), alpha],
            depth: if front < f32::INFINITY {
                front + depth
            } else {
                depth
            },
        }
    }
}

impl Splat {
    #[inline(always)]
    fn met(&self, projection: Projection, dx: f32, dy: f32) -> Met {
        let change = self.slope[0] * dx + self.slope[1] * dy;
        let (nearest, farthest) = (self.z - self.half_depth, self.z + self.half_depth);
        match projection {
            // z = middle's z / (1 - change); beyond the horizon of the plane it is as far as the disc goes.
            Projection::Perspective => {
                let z = self.z / (1.0 - change).max(f32::MIN_POSITIVE);
                let z = z.clamp(nearest.max(0.0), farthest);
                Met {
                    z,
                    ratio: z / self.z,
                }
            }
            Projection::Orthographic => Met {
                z: (self.z + change).clamp(nearest, farthest),
                ratio: 1.0,
            },
        }
    }

    #[inline(always)]
    fn covers(&self, met: &Met, dx: f32, dy: f32) -> bool {
        let q = met.ratio * met.ratio * form(&self.disc, dx, dy);
        let cut = met.ratio * (self.cut[0] * dx + self.cut[1] * dy);
        q <= 1.0 && cut <= 1.0
    }
}

impl Sums {
    #[inline(always)]
    fn add(&mut self, weight: f32, values: [f32; 4], [dx, dy]: [f32; 2]) {
        self.weight += weight;
        let (wx, wy) = (weight * dx, weight * dy);
        for (i, value) in values.into_iter().enumerate() {
            self.values[i] += weight * value;
            self.slopes[0][i] += wx * value;
            self.slopes[1][i] += wy * value;
        }
        self.offset[0] += wx;
        self.offset[1] += wy;
        self.square[0] += wx * dx;
        self.square[1] += wx * dy;
        self.square[2] += wy * dy;
    }

    /// The mean, or the fitted line at the pixel's centre.
    fn value(&self, blend: Blend) -> [f32; 4] {
        let scale = 1.0 / self.weight;
        let mean = self.values.map(|v| v * scale);
        if blend == Blend::Mean {
            return mean;
        }
        let [x, y] = self.offset.map(|o| o * scale);
        let [xx, xy, yy] = self.square.map(|s| s * scale);
        let (xx, xy, yy) = (xx - x * x, xy - x * y, yy - y * y);
        // A tenth of a tenth of the pixel's own variance: discs in one place have no slope.
        let ridge = 0.01 * single(PIXEL_SIGMA_PX * PIXEL_SIGMA_PX);
        let (xx, yy) = (xx + ridge, yy + ridge);
        let determinant = xx * yy - xy * xy;
        // The mean's place in standard deviations, and the weights of the slopes that lead from there to the pixel.
        let (ax, ay) = (
            (yy * x - xy * y) / determinant,
            (xx * y - xy * x) / determinant,
        );
        let shift = (ax * x + ay * y).max(0.0).sqrt();
        let part = if shift > MOST_SHIFT {
            MOST_SHIFT / shift
        } else {
            1.0
        };
        std::array::from_fn(|i| {
            let along_x = self.slopes[0][i] * scale - mean[i] * x;
            let along_y = self.slopes[1][i] * scale - mean[i] * y;
            mean[i] - part * (ax * along_x + ay * along_y)
        })
    }
}

#[inline(always)]
fn form(form: &[f32; 3], dx: f32, dy: f32) -> f32 {
    form[0] * dx * dx + form[1] * dx * dy + form[2] * dy * dy
}

/// e^x for -4 <= x <= 0 as (e^(x/16))^16 with four terms: each is wrong by (x/16)^5 / 120, all 16 by 1.3e-4 of the value at most.
#[inline(always)]
fn exp_of_negative(x: f32) -> f32 {
    let x = x * (1.0 / 16.0);
    let e = 1.0 + x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0))));
    let e = e * e;
    let e = e * e;
    let e = e * e;
    e * e
}

/// First and end, along one axis, of the places of the tile with its apron that lie in the picture.
fn inside_picture(job: &TileJob, axis: usize) -> [usize; 2] {
    let before = APRON_PX.min(job.first[axis]);
    let left = job.picture[axis] - job.first[axis];
    [
        APRON_PX - before,
        APRON_PX + left.min(job.size[axis] + APRON_PX),
    ]
}

/// Visits the pixels of a box that lie in the tile and its apron: their slot with the apron, and their centre, px.
#[inline(always)]
fn for_each_pixel(
    job: &TileJob,
    &[x0, y0, x1, y1]: &[u16; 4],
    apron: usize,
    mut visit: impl FnMut(usize, [f32; 2]),
) {
    let range = |axis: usize, first: u16, end: u16| {
        let start = job.first[axis];
        let low = usize::from(first).max(start.saturating_sub(apron));
        let high = usize::from(end)
            .min(start + job.size[axis] + apron)
            .min(job.picture[axis]);
        low..high
    };
    for y in range(1, y0, y1) {
        let row = (y + APRON_PX - job.first[1]) * SIDE;
        for x in range(0, x0, x1) {
            let slot = row + x + APRON_PX - job.first[0];
            visit(slot, [x as f32 + 0.5, y as f32 + 0.5]);
        }
    }
}
