//! Filling of holes: pixels that no reference shows.
//!
//! A hole that opens behind a surface shows what is behind, so only the far side of its rim says what it may look like: the
//! farther end of the shortest lines across, where one end is nearer than the other. Of two leaves before a wall, the gap
//! that opens behind the first one shows the second one if that lay beside it, and not the wall.
//! `Background` takes the mean of the far rim pixels that are nearest to a disc around the pixel, which grows with the
//! distance from them, so that no single rim pixel draws a line across the hole; `Natural` interpolates between the far
//! rim pixels by natural neighbours (Sibson 1981), and falls back to `Background` outside their hull. Pixels beyond the
//! frames of the references are continued from the known pixels that are nearest (`beyond`). A mask says what was filled,
//! 1 minus what was seen.

use rayon::prelude::*;
use resample_core::narrow::{index32, single};
use resample_core::simd::Vectors;
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};

use crate::fill::extrapolate::{Disc, GROWTH, NOWHERE, View, beyond, nearest_known};
use crate::options::Fill;
use crate::view::layer::Layer;

/// From this coverage on a pixel is known and may be a rim.
const SOLID: f32 = 0.99;

/// A rim's colour is that of one surface if that surface has this share of it.
const PURE: f32 = 0.97;

/// Depths within this ratio of the farthest rim count as far as well. A guess: surfaces behind are rarely flat.
const FAR_RATIO: f32 = 1.15;

/// A rim pixel is one of a surface if this many of its eight neighbours are known at about its depth: a corner of the picture has
/// three. A stray pixel has fewer.
const LEAST_NEIGHBOURS: usize = 3;

/// Least radius of the disc over which far rims are averaged, px: next to the rim the fill goes on as it is.
const LEAST_RADIUS_PX: f64 = 1.0;

/// Lines across a hole that are up to this many times as long as the shortest one count as well: the diagonal of a gap is
/// 1.4 times as long as its width. With 3, a fifth more of the pixels have a foreign hue.
const LONGER: f32 = 1.5;

/// Steps along x and y of the eight directions.
const DIRECTIONS: [[isize; 2]; 8] = [
    [1, 0],
    [-1, 0],
    [0, 1],
    [0, -1],
    [1, 1],
    [-1, 1],
    [1, -1],
    [-1, -1],
];

/// Steps to every other pixel of the five times five around one, and itself.
const AROUND: [[isize; 2]; 13] = [
    [-2, -2],
    [0, -2],
    [2, -2],
    [-1, -1],
    [1, -1],
    [-2, 0],
    [0, 0],
    [2, 0],
    [-1, 1],
    [1, 1],
    [-2, 2],
    [0, 2],
    [2, 2],
];

/// The directions that are opposite to one another.
const OPPOSITE: [[usize; 2]; 4] = [[0, 1], [2, 3], [4, 7], [5, 6]];

/// The known pixels around those that are not.
struct Rims {
    /// For each direction and pixel that is not known, the known one met first when going against the direction, [`NOWHERE`] without one.
    met: Vec<Vec<u32>>,
    /// The number of a pixel among those that are not known, [`NOWHERE`] for a known one.
    number: Vec<u32>,
    width: usize,
}

/// Colour and depth of a filled pixel.
type Filled = ([f32; 3], f32);

/// A far rim pixel in the triangulation.
struct Site {
    at: Point2<f64>,
    pixel: usize,
}

impl HasPosition for Site {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.at
    }
}

/// Fills the holes of `layer` and gives the mask of what was filled, 0 to 1.
pub(crate) fn fill(layer: &mut Layer, view: &View<'_>, how: Fill) -> Vec<f32> {
    let width = view.camera.width as usize;
    let mut mask = vec![0.0; layer.rgba.len()];
    let known = layer.rgba.iter().any(|p| p[3] >= SOLID);
    if how == Fill::None || !known {
        return mask;
    }
    let pixels = (0..layer.rgba.len()).into_par_iter();
    let holes: Vec<usize> = pixels.filter(|&i| layer.rgba[i][3] < SOLID).collect();
    if holes.is_empty() {
        return mask;
    }
    let pixels = (0..layer.rgba.len()).into_par_iter();
    let is_known: Vec<bool> = pixels.map(|i| is_rim(layer, i)).collect();
    let rims = Rims::new(&is_known, width);
    let far_rims = FarRims::new(layer, &rims, &holes, view.level);
    let beyond = beyond(layer, view, &is_known, &holes);
    // What lies beyond the frames is taken from there.
    let behind = |(&hole, beyond): (&usize, &Option<Filled>)| {
        beyond.or_else(|| far_rims.behind(layer, &rims, hole))
    };
    let background = holes.par_iter().zip(&beyond).map(behind);
    let background: Vec<Option<Filled>> = background.collect();
    let natural = match how {
        Fill::Natural => natural(layer, &far_rims.is_site, &holes, width),
        _ => vec![None; holes.len()],
    };
    let inside = beyond.into_iter().zip(natural).zip(background);
    for (&i, ((beyond, natural), background)) in holes.iter().zip(inside) {
        let Some((rgb, depth)) = beyond.or(natural).or(background) else {
            continue;
        };
        let pixel = &mut layer.rgba[i];
        let missing = 1.0 - pixel[3];
        for (c, v) in pixel.iter_mut().zip([rgb[0], rgb[1], rgb[2], 1.0]) {
            *c += missing * v;
        }
        mask[i] = missing;
        if missing > 0.5 {
            layer.depth[i] = depth;
        }
    }
    mask
}

/// Returns true if a pixel shows one surface alone, so that it may be the rim of a hole.
fn is_rim(layer: &Layer, at: usize) -> bool {
    layer.rgba[at][3] >= SOLID && layer.purity(at) >= PURE
}

impl Rims {
    /// Of a picture of which these pixels are known.
    fn new(known: &[bool], width: usize) -> Self {
        let pixels = (0..known.len()).into_par_iter();
        let open: Vec<usize> = pixels.filter(|&pixel| !known[pixel]).collect();
        let mut number = vec![NOWHERE; known.len()];
        for (k, &pixel) in open.iter().enumerate() {
            number[pixel] = index32(k);
        }
        let height = known.len() / width;
        let sweep = |&[dx, dy]: &[isize; 2]| {
            let mut met = vec![NOWHERE; open.len()];
            let mut visit = |k: usize| {
                let (x, y) = (open[k] % width, open[k] / width);
                // The pixel before, against the direction; none beyond the picture.
                let place = x.checked_add_signed(-dx).zip(y.checked_add_signed(-dy));
                let Some((x, y)) = place.filter(|&(x, y)| x < width && y < height) else {
                    return;
                };
                let before = y * width + x;
                met[k] = match number[before] {
                    NOWHERE => index32(before),
                    open => met[open as usize],
                };
            };
            // The pixel before is visited first.
            match [dy, dx] > [0, 0] {
                true => (0..open.len()).for_each(&mut visit),
                false => (0..open.len()).rev().for_each(&mut visit),
            }
            met
        };
        Self {
            met: DIRECTIONS.par_iter().map(sweep).collect(),
            number,
            width,
        }
    }

    /// The rim pixel in a direction from `at`, which is not known.
    fn get(&self, direction: usize, at: usize) -> Option<usize> {
        let pixel = self.met[direction][self.number[at] as usize];
        (pixel != NOWHERE).then_some(pixel as usize)
    }

    /// The rim pixels around `at`.
    fn around(&self, at: usize) -> impl Iterator<Item = usize> + '_ {
        (0..DIRECTIONS.len()).filter_map(move |direction| self.get(direction, at))
    }

    /// From a pixel to another one, px.
    fn distance(&self, a: usize, b: usize) -> f32 {
        let apart = |a: usize, b: usize| a.abs_diff(b) as f32;
        let (x, y) = (
            apart(a % self.width, b % self.width),
            apart(a / self.width, b / self.width),
        );
        (x * x + y * y).sqrt()
    }

    /// The depth behind a hole, where there is a rim.
    fn depth_behind(&self, layer: &Layer, at: usize) -> Option<f32> {
        let across = OPPOSITE.map(|[one, other]| {
            let ends = [self.get(one, at)?, self.get(other, at)?];
            let [a, b] = ends.map(|end| layer.depth[end]);
            let is_told = a.min(b) * FAR_RATIO < a.max(b);
            is_told.then(|| (self.distance(ends[0], ends[1]), a.max(b)))
        });
        let across = across.iter().flatten();
        let shortest = across.clone().map(|line| line.0).fold(f32::MAX, f32::min);
        let short = across.filter(|line| line.0 <= LONGER * shortest);
        let told = short.map(|line| line.1).reduce(f32::max);
        told.or_else(|| self.around(at).map(|rim| layer.depth[rim]).reduce(f32::max))
    }
}

/// Returns true if a rim pixel's depth is that behind a hole.
fn is_behind(depth: f32, far: f32) -> bool {
    depth * FAR_RATIO >= far && depth <= far * FAR_RATIO
}

/// The far rim pixels: those behind which a hole goes on.
struct FarRims {
    /// The depth behind each pixel, NaN where there is none.
    far: Vec<f32>,
    is_site: Vec<bool>,
    /// The nearest one of each pixel.
    nearest: Vec<u32>,
    disc: Disc,
}

impl FarRims {
    fn new(layer: &Layer, rims: &Rims, holes: &[usize], level: Vectors) -> Self {
        let width = rims.width;
        let found = |&hole: &usize| rims.depth_behind(layer, hole).unwrap_or(f32::NAN);
        let found: Vec<f32> = holes.par_iter().map(found).collect();
        let spread = |of_holes: &[f32]| {
            let mut all = vec![f32::NAN; layer.rgba.len()];
            (holes.iter().zip(of_holes)).for_each(|(&hole, &depth)| all[hole] = depth);
            all
        };
        let told = spread(&found);
        let middle = |&hole: &usize| middle(&told, width, hole);
        let far: Vec<f32> = holes.par_iter().map(middle).collect();
        let mut is_site = vec![false; layer.rgba.len()];
        let mut sites = Vec::new();
        for (&hole, far) in holes.iter().zip(&far).filter(|(_, far)| !far.is_nan()) {
            for rim in rims
                .around(hole)
                .filter(|&rim| is_behind(layer.depth[rim], *far))
            {
                if !is_site[rim] {
                    is_site[rim] = true;
                    sites.push(rim);
                }
            }
        }
        // A stray pixel says nothing of the surface behind, unless there is nothing else.
        let mut counts = vec![false; is_site.len()];
        let of_surface = |&site: &usize| is_of_surface(layer, width, site);
        let of_surface: Vec<usize> = sites
            .iter()
            .copied()
            .filter(|site| of_surface(site))
            .collect();
        let counted = if of_surface.is_empty() {
            &sites
        } else {
            &of_surface
        };
        counted.iter().for_each(|&site| counts[site] = true);
        let nearest = nearest_known(&counts, width);
        let far = spread(&far);
        Self {
            far,
            is_site,
            nearest,
            disc: Disc::new([width, layer.rgba.len() / width], level),
        }
    }

    /// Colour and depth behind a pixel; `None` where the pixel is known or has no rim.
    fn behind(&self, layer: &Layer, rims: &Rims, at: usize) -> Option<([f32; 3], f32)> {
        let far = self.far[at];
        if far.is_nan() {
            return None;
        }
        let from = self.nearest[at];
        if from == NOWHERE {
            return None;
        }
        // Depths over a power of two near the farthest: their sum stays finite.
        let unit = f32::from_bits(far.to_bits() & 0x7f80_0000).max(f32::MIN_POSITIVE);
        let radius = (GROWTH * self.disc.distance(at, from as usize)).max(LEAST_RADIUS_PX);
        let (mut sum, mut depth, mut total) = ([0.0; 3], 0.0, 0.0);
        for (pixel, weight) in self.disc.around(at, radius) {
            let known = self.nearest[pixel] as usize;
            let z = layer.depth[known];
            if !is_behind(z, far) {
                continue;
            }
            let colour = layer.rgba[known];
            sum = std::array::from_fn(|c| sum[c] + weight * colour[c]);
            depth += weight * (z / unit);
            total += weight;
        }
        if total == 0.0 {
            // The middle depth may be that of no rim around this pixel; its own is that of one.
            return background(layer, rims, at, far).or_else(|| {
                let own = rims.depth_behind(layer, at)?;
                background(layer, rims, at, own)
            });
        }
        // An infinite depth has no mean: the farthest stands for all.
        let z = if far.is_finite() {
            depth / total * unit
        } else {
            far
        };
        Some((sum.map(|v| v / total), z))
    }
}

/// Returns true if a rim pixel has neighbours enough of its own surface.
fn is_of_surface(layer: &Layer, width: usize, at: usize) -> bool {
    let height = layer.rgba.len() / width;
    let (x, y, z) = (at % width, at / width, layer.depth[at]);
    let is_own = |&[dx, dy]: &[isize; 2]| {
        let place = x.checked_add_signed(dx).zip(y.checked_add_signed(dy));
        let inside = place.filter(|&(x, y)| x < width && y < height);
        inside.is_some_and(|(x, y)| {
            let beside = layer.depth[y * width + x];
            layer.rgba[y * width + x][3] >= SOLID
                && (beside == z || (beside < z * FAR_RATIO && z < beside * FAR_RATIO))
        })
    };
    DIRECTIONS.iter().filter(|step| is_own(step)).count() >= LEAST_NEIGHBOURS
}

/// The middle one of the depths around a pixel that has one, so that neighbours agree; NaN for others.
fn middle(depth: &[f32], width: usize, at: usize) -> f32 {
    if depth[at].is_nan() {
        return f32::NAN;
    }
    let (x, y, height) = (at % width, at / width, depth.len() / width);
    let (mut known, mut count) = ([0.0; 13], 0);
    for [dx, dy] in AROUND {
        let place = x.checked_add_signed(dx).zip(y.checked_add_signed(dy));
        let inside = place.filter(|&(x, y)| x < width && y < height);
        let beside = inside.map_or(f32::NAN, |(x, y)| depth[y * width + x]);
        if !beside.is_nan() {
            known[count] = beside;
            count += 1;
        }
    }
    *known[..count]
        .select_nth_unstable_by(count / 2, f32::total_cmp)
        .1
}

/// Colour and depth behind a pixel from the rims around it at about this depth; `None` without one.
fn background(layer: &Layer, rims: &Rims, at: usize, far: f32) -> Option<([f32; 3], f32)> {
    // Depths over a power of two near the farthest: their sum stays finite.
    let unit = f32::from_bits(far.to_bits() & 0x7f80_0000).max(f32::MIN_POSITIVE);
    let (mut sum, mut depth, mut total) = ([0.0; 3], 0.0, 0.0);
    for rim in rims.around(at) {
        let z = layer.depth[rim];
        if !is_behind(z, far) {
            continue;
        }
        let weight = rims.distance(at, rim).powi(-2);
        let colour = layer.rgba[rim];
        sum = std::array::from_fn(|c| sum[c] + weight * colour[c]);
        depth += weight * (z / unit);
        total += weight;
    }
    // An infinite depth has no mean: the farthest stands for all.
    let depth = if far.is_finite() {
        depth / total * unit
    } else {
        far
    };
    (total > 0.0).then(|| (sum.map(|v| v / total), depth))
}

/// Natural-neighbour interpolation between all far rim pixels; `None` outside their hull.
fn natural(layer: &Layer, is_site: &[bool], holes: &[usize], width: usize) -> Vec<Option<Filled>> {
    let sites = (0..is_site.len())
        .filter(|&i| is_site[i])
        .map(|pixel| Site {
            at: Point2::new((pixel % width) as f64, (pixel / width) as f64),
            pixel,
        });
    let Ok(triangulation) = DelaunayTriangulation::<Site>::bulk_load(sites.collect()) else {
        return vec![None; holes.len()];
    };
    let neighbours = triangulation.natural_neighbor();
    // Treat infinite depth as background.
    let finite = layer.depth.iter().copied().filter(|z| z.is_finite());
    let most = finite.fold(f32::MAX.sqrt(), f32::max);
    let filled = |&hole: &usize| {
        let at = Point2::new((hole % width) as f64, (hole / width) as f64);
        let value = |of: &dyn Fn(usize) -> f32| {
            neighbours.interpolate(|v| f64::from(of(v.data().pixel)), at)
        };
        let channel = |c: usize| value(&|i| layer.rgba[i][c]).map(single);
        let depth = value(&|i| layer.depth[i].min(most)).map(single);
        Some(([channel(0)?, channel(1)?, channel(2)?], depth?))
    };
    holes.iter().map(filled).collect()
}
