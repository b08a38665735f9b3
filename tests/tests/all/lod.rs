//! Level of detail: no pixel changes by more than `--lod-error`, and culling by opacity none by more than its own bound.
//!
//! Views were not those on which the model was calibrated: other directions and distances, and volumes that the
//! calibration never saw. Real volumes are skipped where they are absent.

use glam::{DAffine3, DVec3};
use resample_core::{Camera, Image};
use resample_tests::lod_scenes::{Subject, procedural, real};
use resample_tests::scenes::{
    coloured, orthographic, perspective, random_volume, render, transfer, volume, worst_difference,
};
use volsplat::procedural::blobs;
use volsplat::{RenderOptions, Renderer, TransferFunction, Volume};

fn with(lod_error: f32) -> RenderOptions {
    RenderOptions {
        lod_error,
        ..RenderOptions::default()
    }
}

/// The default, and one that merges much more.
const BOUNDS: [f32; 2] = [1.0 / 512.0, 1.0 / 32.0];

/// Pixels a voxel: near, mixed, far, very far.
const DISTANCES: [f64; 6] = [1.3, 0.5, 0.29, 0.21, 0.125, 0.05];

fn hold(name: &str, (volume, transfer): (&Volume, &TransferFunction), cameras: &[Camera]) {
    let mut full = Renderer::new(volume, transfer, &with(0.0)).expect("valid options");
    let truths: Vec<Image> = cameras
        .iter()
        .map(|c| full.render(c).expect("a valid camera").image)
        .collect();
    for bound in BOUNDS {
        let mut less = Renderer::new(volume, transfer, &with(bound)).expect("valid options");
        let (mut worst, mut replaced) = (0.0f64, 0);
        for (camera, truth) in cameras.iter().zip(&truths) {
            let frame = less.render(camera).expect("a valid camera");
            worst = worst.max(worst_difference(&frame.image, truth));
            let [_, merged @ ..] = frame.stats.bricks_by_level;
            let [_, skipping @ ..] = frame.stats.bricks_by_stride;
            replaced += merged.iter().chain(&skipping).sum::<u64>();
        }
        println!("{name}, bound {bound:.5}: {replaced} bricks replaced, largest change {worst:.5}");
        assert!(
            worst <= f64::from(bound),
            "{name}: a pixel changes by {worst}, more than {bound}"
        );
    }
}

fn hold_subject(subject: &Subject, views: usize) {
    let cameras: Vec<Camera> = DISTANCES
        .into_iter()
        .flat_map(|px| (3..3 + views).map(move |number| subject.camera(px, number)))
        .collect();
    hold(subject.name, (&subject.volume, &subject.transfer), &cameras);
}

#[test]
fn no_pixel_of_procedural_volumes_changes_by_more_than_the_bound() {
    procedural()
        .iter()
        .for_each(|subject| hold_subject(subject, 3));
}

#[test]
fn no_pixel_of_real_volumes_changes_by_more_than_the_bound() {
    real("lod")
        .iter()
        .for_each(|subject| hold_subject(subject, 2));
}

/// Volumes of other kinds: noise, a stretched grid, translucent and opaque; and parallel rays.
#[test]
fn no_pixel_of_unseen_volumes_changes_by_more_than_the_bound() {
    let stretched = DAffine3::from_scale(DVec3::new(0.7, 0.7, 1.9));
    let soft = transfer(
        &[(0.0, [0.2, 0.5, 1.0]), (2.0, [1.0, 0.9, 0.2])],
        &[(0.2, 0.0), (2.5, 0.04)],
    );
    let constant = volume([70, 61, 66], DAffine3::IDENTITY, |p| {
        0.5 + 1e-3 * (0.3 * p.x).sin()
    });
    let made = blobs(70).expect("a good size");
    let cases = [
        (
            "noise",
            random_volume([70, 60, 65], stretched),
            coloured(0.05),
        ),
        ("nearly constant", constant, coloured(0.03)),
        (
            "opaque noise",
            random_volume([40, 40, 40], DAffine3::IDENTITY),
            coloured(0.99),
        ),
        (
            "thin blobs",
            Volume::new(made.dims, made.voxels, stretched).expect("a valid grid"),
            soft,
        ),
    ];
    for (name, volume, look) in &cases {
        let extent = DVec3::from(volume.dims.map(|n| (n - 1) as f64));
        let middle = volume.world_from_index.transform_point3(0.5 * extent);
        for side in [40u32, 17] {
            let away = DVec3::new(-0.4, 0.5, 0.9) * 300.0;
            let cameras = [
                perspective(middle + away, middle, 25.0, [side; 2]),
                orthographic(middle + DVec3::Z * 300.0, middle, 160.0, [side; 2]),
                orthographic(middle + away, middle, 160.0, [side; 2]),
            ];
            hold(&format!("{name}, {side} px"), (volume, look), &cameras);
        }
    }
}

/// What is homogeneous is the same from merged blocks: planes are counted as the cells count them.
#[test]
fn a_constant_volume_is_the_same_from_blocks() {
    let volume = volume([65, 65, 65], DAffine3::IDENTITY, |_| 0.6);
    let middle = DVec3::splat(32.0);
    for camera in [
        perspective(DVec3::new(190.0, 110.0, -220.0), middle, 25.0, [24; 2]),
        orthographic(middle - 90.0 * DVec3::Z, middle, 100.0, [24; 2]),
        orthographic(middle + DVec3::new(70.0, 0.0, 70.0), middle, 100.0, [24; 2]),
    ] {
        let look = coloured(0.05);
        let mut merged = Renderer::new(&volume, &look, &with(1.0 / 512.0)).expect("valid options");
        let frame = merged.render(&camera).expect("a valid camera");
        assert!(
            frame.stats.bricks_by_level[3] > 400,
            "{:?}",
            frame.stats.bricks_by_level
        );
        let full = render(&volume, &look, &with(0.0), &camera);
        let worst = worst_difference(&frame.image, &full);
        // Colours are kept in 16 bits: 1e-5; the rest is rounding.
        assert!(worst < 4e-5, "{:?}: off by {worst}", camera.projection);
    }
}

/// Popping: along a zoom, frames with level of detail change from one to the next as frames without it do.
#[test]
fn a_zoom_does_not_pop() {
    let scene = &procedural()[2];
    let cameras: Vec<Camera> = (0..24)
        .map(|i| scene.zoomed(8f64.powf(f64::from(i) / 63.0 + 0.5)))
        .collect();
    let frames = |lod_error: f32| -> Vec<Image> {
        let mut renderer =
            Renderer::new(&scene.volume, &scene.transfer, &with(lod_error)).expect("valid options");
        cameras
            .iter()
            .map(|c| renderer.render(c).expect("a valid camera").image)
            .collect()
    };
    let (on, off) = (frames(1.0 / 512.0), frames(0.0));
    for i in 1..cameras.len() {
        let [with, without] = [&on, &off].map(|f| worst_difference(&f[i], &f[i - 1]));
        assert!(
            with <= without + 2.0 / 512.0,
            "frame {i} changes by {with} instead of {without}"
        );
    }
}
