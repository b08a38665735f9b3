//! Exposure of references: finds by how much each is brighter than the first, and makes them alike.
//!
//! Two references that see one place give one ratio of colours a channel, in linear light. The median over many places is
//! their difference in exposure and white balance: highlights, things that moved and edges that are off are few. A reference that
//! shares too little with the first is compared with one that has been compared already.
//!
//! Limits: one factor a channel; vignetting and local tone mapping stay.

use glam::DVec2;
use resample_core::narrow::{count, single, whole};

use crate::Reference;

/// Samples of a reference that are looked up in another one, about.
const SAMPLES: usize = 20_000;

/// Places that two references must share: the median of so many is known to a few per cent of their spread.
const ENOUGH: usize = 400;

/// Depths within this part of each other are one place.
const AGREEMENT: f64 = 0.01;

/// Linear colours that count: below, codes of 8 bits are coarse; above, cameras clip.
const USABLE: std::ops::Range<f32> = 0.02..0.9;

/// Ratios up to this are left as they are: the eye does not see them, and colours stay as they were given.
const ALIKE: f64 = 0.02;

/// Scales the colours of `references` to the exposure of the first. The factors of red, green and blue by which each was
/// multiplied; 1 where it is alike within 2 %, or shares too little with others.
pub fn match_exposure(references: &mut [Reference]) -> Vec<[f32; 3]> {
    let count = references.len();
    let mut gains = vec![[1.0; 3]; count];
    let mut done: Vec<usize> = (0..count.min(1)).collect();
    while done.len() < count {
        let open = (0..count).filter(|i| !done.contains(i));
        let pairs = open.flat_map(|i| done.iter().map(move |&to| (i, to)));
        let ratios = pairs.map(|(i, to)| (i, to, ratios(&references[i], &references[to])));
        let best = ratios.max_by_key(|(_, _, [red, ..])| red.len());
        let Some((i, to, ratios)) = best else { break };
        done.push(i);
        if ratios[0].len() < ENOUGH {
            continue;
        }
        let known = gains[to];
        let [red, green, blue] = ratios.map(median);
        gains[i] = [red, green, blue].map(single);
        for (gain, known) in gains[i].iter_mut().zip(known) {
            *gain *= known;
        }
    }
    for (reference, gain) in references.iter_mut().zip(&mut gains) {
        if gain.iter().all(|&g| f64::from(g).ln().abs() <= ALIKE) {
            *gain = [1.0; 3];
            continue;
        }
        for rgb in &mut reference.colour {
            *rgb = std::array::from_fn(|c| rgb[c] * gain[c]);
        }
    }
    gains
}

/// For red, green and blue, the colours of `to` over those of `from` at places that both see.
fn ratios(from: &Reference, to: &Reference) -> [Vec<f64>; 3] {
    let mut found: [Vec<f64>; 3] = Default::default();
    let known = |z: f32| z.is_finite() && z > 0.0;
    let width = from.camera.width as usize;
    let world_from_camera = from.camera.camera_from_world.inverse();
    // An odd step takes every column.
    let step = (from.depth.len() / SAMPLES).max(1) | 1;
    let samples = from.depth.iter().enumerate().step_by(step);
    for (i, &z) in samples.filter(|(_, z)| known(**z)) {
        let pixel = DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
        let (origin, ray) = from.camera.ray_in_camera(pixel);
        let place = world_from_camera.transform_point3(origin + f64::from(z) * ray);
        let Some((rgb, seen_at)) = seen(to, place) else {
            continue;
        };
        let z = to.camera.camera_from_world.transform_point3(place).z;
        let own = from.colour[i];
        let usable = own.iter().chain(&rgb).all(|v| USABLE.contains(v));
        if usable && (seen_at - z).abs() <= AGREEMENT * z {
            for (found, (own, other)) in found.iter_mut().zip(own.iter().zip(rgb)) {
                found.push(f64::from(other) / f64::from(*own));
            }
        }
    }
    found
}

/// The colour and the camera z that a reference has where it would see a place; `None` outside.
fn seen(reference: &Reference, place: glam::DVec3) -> Option<([f32; 3], f64)> {
    let camera = &reference.camera;
    let pos_in_camera = camera.camera_from_world.transform_point3(place);
    let at = camera.screen_from_camera(pos_in_camera);
    let size = DVec2::new(f64::from(camera.width), f64::from(camera.height));
    let inside = pos_in_camera.z > 0.0 && at.cmpge(DVec2::ZERO).all() && at.cmplt(size).all();
    let index = || count(whole(at.y)) * camera.width as usize + count(whole(at.x));
    inside
        .then(index)
        .map(|i| (reference.colour[i], f64::from(reference.depth[i])))
}

/// The middle one of at least one number.
fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use resample_core::{Camera, LookAt};

    use super::*;

    /// A wall at z = 4, painted by place, from x.
    fn wall(x: f64) -> Reference {
        let pose = LookAt {
            position: [x, 0.0, 0.0].into(),
            target: [x, 0.0, 1.0].into(),
            up: [0.0, -1.0, 0.0].into(),
        };
        let camera = Camera::perspective(&pose, 0.8, [96, 64]).expect("a camera");
        let colour = (0..96 * 64).map(|i| {
            let pixel = DVec2::new(f64::from(i % 96) + 0.5, f64::from(i / 96) + 0.5);
            let (_, ray) = camera.ray_in_camera(pixel);
            let at = x + 4.0 * ray.x;
            let level = single(0.3 + 0.1 * (3.0 * at).sin());
            [level, 0.8 * level, 0.6 * level]
        });
        Reference {
            camera,
            colour: colour.collect(),
            depth: vec![4.0; 96 * 64],
        }
    }

    #[test]
    fn a_brighter_reference_is_made_alike() {
        let mut references = vec![wall(0.0), wall(0.2), wall(0.5)];
        for rgb in &mut references[1].colour {
            *rgb = [rgb[0] * 1.4, rgb[1] * 1.2, rgb[2] * 1.1];
        }
        let gains = match_exposure(&mut references);
        for (found, expected) in gains[1].iter().zip([1.4f32, 1.2, 1.1]) {
            assert!((found * expected - 1.0).abs() < 0.01, "{gains:?}");
        }
        assert_eq!(gains[0], [1.0; 3], "the first one stays");
        assert_eq!(gains[2], [1.0; 3], "one that is alike stays as it is");
        let own = wall(0.2).colour;
        for (a, b) in references[1].colour.iter().zip(&own) {
            assert!((a[0] / b[0] - 1.0).abs() < 0.01, "{a:?} for {b:?}");
        }
    }

    #[test]
    fn what_shares_nothing_stays() {
        let mut references = vec![wall(0.0), wall(50.0)];
        for rgb in &mut references[1].colour {
            *rgb = rgb.map(|v| v * 2.0);
        }
        assert_eq!(match_exposure(&mut references)[1], [1.0; 3]);
    }
}
