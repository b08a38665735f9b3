//! Colours for what lies beyond the frames of the references: the nearest known pixels go on, ever more blurred.
//!
//! A pixel lies beyond if it would be outside every reference's picture, were it as far away as the nearest known pixel.
//! Nothing hides it, so no side of a rim tells more of it than another. Each such pixel becomes a mean over a disc that
//! grows with its distance; what the disc meets beyond is taken from the known pixel that is nearest to it.

use glam::{DAffine3, DVec2};
use rayon::prelude::*;
use resample_core::Camera;

use crate::view::layer::Layer;

/// Places of the disc.
pub(crate) const PLACES: usize = 48;

/// Radius of the disc: this part of the distance to the nearest known pixel, and this many px at least. Guesses: of 0.4 to
/// 1.2 and 3 to 6, these lose least on two of three real pairs and 0.4 dB to the best on the third.
pub(crate) const GROWTH: f64 = 1.1;
const LEAST_RADIUS_PX: f64 = 6.0;

/// Turn from one place of the disc to the next, rad: the golden angle, which fills a disc evenly.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// The cameras of a picture.
#[derive(Clone, Debug)]
pub(crate) struct View<'a> {
    /// That of the new picture.
    pub(crate) camera: &'a Camera,
    /// Those of the references.
    pub(crate) references: Vec<Camera>,
}

/// The number of no pixel.
pub(crate) const NOWHERE: u32 = u32::MAX;

/// Colour and depth of the pixels of `layer` that are not `known` and lie beyond; `None` for all others.
pub(crate) fn beyond(
    layer: &Layer,
    view: &View<'_>,
    known: impl Fn(usize) -> bool + Sync,
    wanted: impl Fn(usize) -> bool + Sync,
) -> Vec<Option<([f32; 3], f32)>> {
    let width = view.camera.width as usize;
    let nearest = nearest_known(layer.rgba.len(), width, known);
    let disc = disc();
    let to_world = view.camera.camera_from_world.inverse();
    let of = |at: usize| {
        let from = nearest[at];
        if !wanted(at) || from == NOWHERE {
            return None;
        }
        let depth = layer.depth[from as usize];
        is_beyond(view, &to_world, at, depth)
            .then(|| (mean(layer, &nearest, &disc, [at, width]), depth))
    };
    (0..layer.rgba.len()).into_par_iter().map(of).collect()
}

/// Returns true if no reference shows the place at this depth behind a pixel. `to_world` leads there from the new camera.
fn is_beyond(view: &View<'_>, to_world: &DAffine3, at: usize, depth: f32) -> bool {
    let width = view.camera.width as usize;
    let pos_in_screen = DVec2::new((at % width) as f64 + 0.5, (at / width) as f64 + 0.5);
    let (origin, direction) = view.camera.ray_in_camera(pos_in_screen);
    // What is infinitely far away lies where something very far away lies.
    let in_camera = origin + f64::from(depth.min(f32::MAX)) * direction;
    let in_world = to_world.transform_point3(in_camera);
    !view.references.iter().any(|reference| {
        let pos = reference.camera_from_world.transform_point3(in_world);
        let at = reference.screen_from_camera(pos);
        let size = DVec2::new(f64::from(reference.width), f64::from(reference.height));
        pos.z > 0.0 && at.cmpge(DVec2::ZERO).all() && at.cmple(size).all()
    })
}

/// Places of a disc of radius 1, with weights that fall to its rim.
pub(crate) fn disc() -> [(DVec2, f32); PLACES] {
    let mut places = [(DVec2::ZERO, 0.0); PLACES];
    for (k, place) in places.iter_mut().enumerate() {
        let square = (k as f64 + 0.5) / PLACES as f64;
        let offset = square.sqrt() * DVec2::from_angle(k as f64 * GOLDEN_ANGLE);
        *place = (offset, (-square).exp() as f32);
    }
    places
}

/// The pixel that holds a place, inside a picture whose `last` pixel has these numbers.
#[inline(always)]
pub(crate) fn pixel_at(place: DVec2, last: [usize; 2]) -> [usize; 2] {
    // A cast rounds towards zero and keeps to its range; one to signed numbers of 32 bits is a single instruction.
    let held = |place: f64, last: usize| (place as i32).clamp(0, last as i32) as usize;
    [held(place.x, last[0]), held(place.y, last[1])]
}

/// The weighted mean of what the disc around a pixel meets.
fn mean(
    layer: &Layer,
    nearest: &[u32],
    disc: &[(DVec2, f32)],
    [at, width]: [usize; 2],
) -> [f32; 3] {
    let height = layer.rgba.len() / width;
    let from = nearest[at] as usize;
    let place = |i: usize| DVec2::new((i % width) as f64, (i / width) as f64);
    let radius = (GROWTH * place(at).distance(place(from))).max(LEAST_RADIUS_PX);
    let last = [width - 1, height - 1];
    let (mut sum, mut total) = ([0.0; 3], 0.0);
    for (offset, weight) in disc {
        let [x, y] = pixel_at(place(at) + radius * *offset + 0.5, last);
        let known = nearest[y * width + x] as usize;
        for (sum, value) in sum.iter_mut().zip(layer.rgba[known]) {
            *sum += weight * value;
        }
        total += weight;
    }
    sum.map(|v| v / total)
}

/// The nearest known pixel of each pixel, exactly (Felzenszwalb and Huttenlocher 2012); [`NOWHERE`] if there is none.
pub(crate) fn nearest_known(
    count: usize,
    width: usize,
    known: impl Fn(usize) -> bool + Sync,
) -> Vec<u32> {
    let height = count / width;
    // In each column: the nearest known pixel above or below.
    let mut rows = vec![NOWHERE; count];
    let nearer = |rows: &mut [u32], at: usize, from: usize| {
        let (y, found) = (at / width, rows[from]);
        let away = |row: u32| (row as usize).abs_diff(y);
        if found != NOWHERE && (rows[at] == NOWHERE || away(found) < away(rows[at])) {
            rows[at] = found;
        }
    };
    for at in 0..count {
        if known(at) {
            rows[at] = (at / width) as u32;
        } else if at >= width {
            nearer(&mut rows, at, at - width);
        }
    }
    for at in (0..count.saturating_sub(width)).rev() {
        nearer(&mut rows, at, at + width);
    }
    let mut nearest = vec![NOWHERE; count];
    let lines = nearest
        .par_chunks_mut(width)
        .zip(rows.par_chunks(width))
        .enumerate();
    lines
        .take(height)
        .for_each(|(y, (to, rows))| along_row(y, rows, to));
    nearest
}

/// Of the nearest known pixels of each column, the nearest one of each pixel of row `y`.
fn along_row(y: usize, rows: &[u32], to: &mut [u32]) {
    let square = |x: usize| (f64::from(rows[x]) - y as f64).powi(2) + (x as f64).powi(2);
    // Columns that are the nearest from some place on, and the places.
    let mut columns: Vec<(usize, f64)> = Vec::new();
    for x in (0..rows.len()).filter(|&x| rows[x] != NOWHERE) {
        let mut begin = f64::NEG_INFINITY;
        while let Some(&(last, from)) = columns.last() {
            begin = (square(x) - square(last)) / (2.0 * (x - last) as f64);
            if begin > from {
                break;
            }
            columns.pop();
            begin = f64::NEG_INFINITY;
        }
        columns.push((x, begin));
    }
    let mut at = 0;
    for (x, to) in to.iter_mut().enumerate() {
        while columns
            .get(at + 1)
            .is_some_and(|(_, from)| *from <= x as f64)
        {
            at += 1;
        }
        if let Some(&(column, _)) = columns.get(at) {
            *to = rows[column] * rows.len() as u32 + column as u32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_known_pixel_is_found_as_by_trying_all() {
        let (width, height) = (23, 17);
        for step in [3, 41, 97, 1000] {
            let known = |i: usize| (i * 7 + 5).is_multiple_of(step);
            let found = nearest_known(width * height, width, known);
            for (at, &from) in found.iter().enumerate() {
                let away2 = |i: usize| {
                    (i % width).abs_diff(at % width).pow(2)
                        + (i / width).abs_diff(at / width).pow(2)
                };
                let least = (0..width * height).filter(|&i| known(i)).map(away2).min();
                let expected = (from != NOWHERE).then(|| away2(from as usize));
                assert_eq!(expected, least, "step {step}, pixel {at}");
            }
        }
    }
}
