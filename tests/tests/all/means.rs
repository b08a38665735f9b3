//! Means of pixels, corrected by their neighbours: against their formula in f64, and against what they may not do.
//!
//! A picture of as many pixels as there were sub-pixels is drawn with one sample each; the formula is made of its pixels.

use glam::{DAffine3, DVec3};
use resample_core::{Camera, Image};
use resample_tests::volumes::scenes::{perspective, transfer, volume};
use volsplat::{RenderOptions, Renderer, Subpixels, TransferFunction, Volume};

const SIDE_VOXELS: usize = 28;

/// Lumps from 0 to 255 that reach the faces of the volume.
fn lumps() -> Volume {
    volume([SIDE_VOXELS; 3], DAffine3::IDENTITY, |p| {
        127.5 + 63.7 * ((0.41 * p.x).sin() + (0.37 * p.y + 0.3 * p.z).cos())
    })
}

fn ramp() -> TransferFunction {
    transfer(
        &[(0.0, [0.1, 0.2, 1.0]), (255.0, [1.0, 0.3, 0.1])],
        &[(110.0, 0.0), (250.0, 0.6)],
    )
}

/// From where a voxel has about so many pixels.
fn camera(voxel_px: f64) -> Camera {
    let middle = DVec3::splat(0.5 * (SIDE_VOXELS - 1) as f64);
    let size = 60;
    let focal_px = 0.5 * f64::from(size) / 20f64.to_radians().tan();
    let eye = middle + focal_px / voxel_px * DVec3::new(0.5, 0.4, -0.76).normalize();
    perspective(eye, middle, 40.0, [size; 2])
}

fn drawn(camera: &Camera, subpixels: Subpixels) -> Image {
    let options = RenderOptions {
        subpixels,
        ..RenderOptions::default()
    };
    let (volume, look) = (lumps(), ramp());
    let mut renderer = Renderer::new(&volume, &look, &options).expect("valid options");
    renderer.render(camera).expect("a valid camera").image
}

/// The mean of a rectangle of pixels.
fn mean(fine: &Image, [x, y]: [usize; 2], [across, down]: [usize; 2]) -> [f64; 4] {
    let mut sum = [0.0; 4];
    for at in 0..across * down {
        let pixel = fine.pixel(x + at % across, y + at / across);
        for (sum, value) in sum.iter_mut().zip(pixel) {
            *sum += f64::from(value) / (across * down) as f64;
        }
    }
    sum
}

/// The corrected mean of a pixel, from the halves that meet at its sides.
fn corrected(fine: &Image, [x, y]: [usize; 2], n: usize, size: [usize; 2]) -> [f64; 4] {
    let half = n.div_ceil(2);
    let apart = if n == 1 { 1.0 } else { 0.5 };
    let own = [x * n, y * n];
    let mut pixel = mean(fine, own, [n, n]);
    for axis in 0..2 {
        if [x, y][axis] == 0 || [x, y][axis] + 1 == size[axis] {
            continue;
        }
        let mut shape = [n, n];
        shape[axis] = half;
        let at = |from_own: isize| {
            let mut corner = own;
            corner[axis] = (own[axis] as isize + from_own) as usize;
            mean(fine, corner, shape)
        };
        let (n_i, half_i) = (n as isize, half as isize);
        let [before, first, last, after] = [-half_i, 0, n_i - half_i, n_i].map(at);
        for k in 0..4 {
            let slopes = [(first[k] - before[k]) / apart, (after[k] - last[k]) / apart];
            pixel[k] += (slopes[1] - slopes[0]) / (24 * n * n) as f64;
        }
    }
    pixel
}

/// The greatest difference from the formula for so many sub-pixels.
fn departure(image: &Image, camera: &Camera, n: u32) -> f64 {
    let fine = camera
        .resized(camera.width * n, camera.height * n)
        .expect("a small picture");
    let fine = drawn(&fine, Subpixels::Fixed(1));
    let size = [image.width, image.height];
    let mut worst = 0.0_f64;
    for y in 0..image.height {
        for x in 0..image.width {
            let wanted = corrected(&fine, [x, y], n as usize, size);
            for (got, wanted) in image.pixel(x, y).iter().zip(wanted) {
                worst = worst.max((f64::from(*got) - wanted).abs());
            }
        }
    }
    worst
}

#[test]
fn automatic_sub_pixels_have_corrected_means() {
    for (voxel_px, n) in [(4.0, 1), (1.0, 2), (0.45, 4)] {
        let camera = camera(voxel_px);
        let image = drawn(&camera, Subpixels::Auto);
        let own = drawn(&camera, Subpixels::Fixed(n));
        let (near, far) = (departure(&image, &camera, n), departure(&own, &camera, n));
        println!("{voxel_px} px a voxel, {n}: {near:.1e} from the formula, {far:.1e} without it");
        assert!(near < 2e-6, "{n} sub-pixels: {near:.1e} from the formula");
        assert!(far > 1e-3, "{n} sub-pixels: the formula changes something");
    }
}

#[test]
fn a_corrected_mean_stays_between_the_samples_around_it() {
    let camera = camera(4.0);
    let samples = drawn(&camera, Subpixels::Fixed(1));
    let image = drawn(&camera, Subpixels::Auto);
    for y in 0..image.height {
        for x in 0..image.width {
            let columns = x.saturating_sub(1)..(x + 2).min(image.width);
            let rows = y.saturating_sub(1)..(y + 2).min(image.height);
            let around = rows.flat_map(|y| columns.clone().map(move |x| [x, y]));
            let around: Vec<[f32; 4]> = around.map(|[x, y]| samples.pixel(x, y)).collect();
            for (k, value) in image.pixel(x, y).into_iter().enumerate() {
                let of = |pixel: &[f32; 4]| pixel[k];
                let least = around.iter().map(of).fold(f32::INFINITY, f32::min);
                let greatest = around.iter().map(of).fold(0.0, f32::max);
                assert!(
                    (least - 1e-6..=greatest + 1e-6).contains(&value),
                    "{x}, {y}: {value} of {least} to {greatest}"
                );
            }
        }
    }
}
