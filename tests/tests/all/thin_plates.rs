//! Volumes whose axes are of unlike length: a plate seen obliquely has a million planes between its near and its far corner,
//! and each ray meets a few of them. The cost follows these, and none of their samples is lost.

use glam::{DAffine3, DVec3};
use resample_core::Camera;
use resample_tests::choices::with_field;
use resample_tests::twins::samples::Scene;
use resample_tests::twins::sheets::render as reference;
use resample_tests::volumes::scenes::{coloured, perspective, random_volume};
use volsplat::{Blend, RenderOptions, Renderer, Subpixels};

/// Voxels of the plate.
const DIMS: [usize; 3] = [7, 9, 6];

fn plate(thickness: f64) -> volsplat::Volume {
    random_volume(DIMS, DAffine3::from_scale(DVec3::new(1.0, 0.7, thickness)))
}

fn camera() -> Camera {
    perspective(
        DVec3::new(12.0, 9.0, 14.0),
        DVec3::new(3.0, 2.8, 0.0),
        40.0,
        [24, 20],
    )
}

fn options(blend: Blend) -> RenderOptions {
    let options = RenderOptions {
        subpixels: Subpixels::Fixed(1),
        min_transmittance: 0.0,
        ..RenderOptions::default()
    };
    with_field(options, |field| field.blend = blend)
}

/// Pixels and planes that were looked at, and samples that lay in the plate.
fn counts(thickness: f64, blend: Blend) -> [u64; 2] {
    let options = options(blend);
    let mut renderer =
        Renderer::new(&plate(thickness), &coloured(0.3), &options).expect("a good volume");
    let stats = renderer.render(&camera()).expect("a good camera").stats;
    [stats.pixels_touched, stats.samples_shown]
}

#[test]
fn the_cost_of_a_plate_does_not_follow_its_thinness() {
    for blend in [Blend::Emission, Blend::Maximum] {
        let [touched, shown] = counts(1e-2, blend);
        assert!(shown > 500, "{blend:?}: {shown} samples");
        for thickness in [1e-4, 1e-6] {
            let thin = counts(thickness, blend);
            println!("{blend:?}, {thickness:e}: {thin:?}, {touched} and {shown} at 1e-2");
            // A ray meets as many planes of a thinner plate: its angle to the plate is the same. At 1e-6 the tile's far pixels
            // are 8e6 voxels apart, positions are known to 7 voxels, and so much is looked at before and behind six voxels.
            assert!(thin[0] < 4 * touched, "{blend:?}, {thickness}: {thin:?}");
            let change = thin[1] as f64 / shown as f64 - 1.0;
            assert!(change.abs() < 0.02, "{blend:?}, {thickness}: {thin:?}");
        }
    }
}

#[test]
fn a_thin_plate_is_the_reference() {
    let (transfer, camera, options) = (coloured(0.3), camera(), options(Blend::Emission));
    for thickness in [1e-2, 1e-3] {
        let volume = plate(thickness);
        let truth = reference(&Scene {
            volume: &volume,
            transfer: &transfer,
            camera: &camera,
            options: &options,
        });
        let mut renderer = Renderer::new(&volume, &transfer, &options).expect("a good volume");
        let image = renderer.render(&camera).expect("a good camera").image;
        let mut worst = 0.0f64;
        for (got, truth) in image.rgba.iter().zip(&truth) {
            let [r, g, b] = truth.rgb;
            for (got, truth) in got.iter().zip([r, g, b, 1.0 - truth.transmittance]) {
                worst = worst.max((f64::from(*got) - truth).abs());
            }
        }
        // Positions count voxels from the tile's first pixel: neighbouring pixels are 0.5 / thickness voxels apart, and a
        // tile's far one 16 times that; f32 keeps such a number to half of 2^-23 of itself, in some five steps. Opacity changes
        // by 0.1 from voxel to voxel at most, over a few samples.
        let admitted = 16.0 * 0.5 / thickness * 2f64.powi(-24) * 5.0;
        println!("thickness {thickness}: off by {worst:.1e}, admitted {admitted:.1e}");
        assert!(worst < admitted, "{thickness}: {worst}");
    }
}
