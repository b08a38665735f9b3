//! Samples packed by the cells that may show something: the samples left out show nothing, voxels of bytes give the
//! picture of the same numbers in f32, and the counts agree with the walk.

use glam::{DAffine3, DVec3};
use resample_core::{Camera, Image};
use resample_tests::choices::with_field;
use resample_tests::twins::samples::Scene;
use resample_tests::twins::sheets::render as reference;
use resample_tests::volumes::scenes::{perspective, transfer};
use volsplat::{
    Blend, FrameStats, GradientOpacity, Isosurface, RenderOptions, Renderer, Shading, Subpixels,
    TransferFunction, Volume, Voxels,
};

/// Whole numbers from 0 to 255, as bytes and as f32.
fn volumes() -> [Volume; 2] {
    let dims = [37, 30, 33];
    let bytes: Vec<u8> = (0..dims.iter().product::<usize>())
        .map(|i| (i * i % 1009 * 7919 % 256) as u8)
        .collect();
    let floats = bytes.iter().map(|&byte| f32::from(byte)).collect();
    let of = |voxels| Volume::new(dims, voxels, DAffine3::IDENTITY).expect("a valid volume");
    [of(Voxels::U8(bytes)), of(Voxels::F32(floats))]
}

/// Two bands of scalars, so that most cells of some bricks show something and few of others.
fn bands() -> TransferFunction {
    transfer(
        &[(0.0, [1.0, 0.2, 0.1]), (255.0, [0.1, 0.4, 1.0])],
        &[
            (20.0, 0.0),
            (40.0, 0.2),
            (60.0, 0.0),
            (225.0, 0.0),
            (255.0, 0.6),
        ],
    )
}

fn camera() -> Camera {
    perspective(
        DVec3::new(31.0, 25.0, -17.0),
        DVec3::splat(16.0),
        75.0,
        [50, 39],
    )
}

fn drawn(volume: &Volume, options: &RenderOptions) -> (Image, FrameStats) {
    let mut renderer = Renderer::new(volume, &bands(), options).expect("valid options");
    let frame = renderer.render(&camera()).expect("a valid camera");
    (frame.image, frame.stats)
}

#[test]
fn bytes_are_read_as_the_same_numbers_in_f32() {
    let [bytes, floats] = volumes();
    for shading in [Shading::None, Shading::Phong] {
        let options = RenderOptions {
            shading,
            subpixels: Subpixels::Fixed(2),
            ..RenderOptions::default()
        };
        let [of_bytes, of_floats] = [&bytes, &floats].map(|v| drawn(v, &options).0);
        assert!(of_bytes.rgba.iter().any(|pixel| pixel[3] > 0.0));
        assert!(of_bytes.rgba == of_floats.rgba, "{shading:?}");
    }
}

#[test]
fn bytes_agree_with_the_reference() {
    let [bytes, floats] = volumes();
    let options = RenderOptions {
        subpixels: Subpixels::Fixed(1),
        min_transmittance: 0.0,
        ..RenderOptions::default()
    };
    let (image, _) = drawn(&bytes, &options);
    let truth = reference(&Scene {
        volume: &floats,
        transfer: &bands(),
        camera: &camera(),
        options: &options,
    });
    let worst = image
        .rgba
        .iter()
        .zip(&truth)
        .flat_map(|(got, wanted)| {
            let off = |k: usize| (f64::from(got[k]) - wanted.rgb[k]).abs() - wanted.slack;
            [off(0), off(1), off(2)]
        })
        .fold(f64::NEG_INFINITY, f64::max);
    assert!(worst < 1e-5, "{worst:.1e} more than the table allows");
}

#[test]
fn counts_say_what_was_done() {
    let [bytes, floats] = volumes();
    let options = RenderOptions {
        subpixels: Subpixels::Fixed(2),
        ..RenderOptions::default()
    };
    let counts = |volume: &Volume| {
        let stats = drawn(volume, &options).1;
        let all = [
            stats.samples_contributed,
            stats.samples_shown,
            stats.lanes_computed,
            stats.pixels_touched,
        ];
        assert!(all[0] > 0 && all.is_sorted(), "{all:?}");
        all
    };
    assert_eq!(counts(&bytes), counts(&floats));
}

/// Channels mixed, statistics of them, surfaces and segments of shells are counted as packed samples are.
#[test]
fn every_rule_counts_its_samples() {
    let [bytes, _] = volumes();
    let of_field = |blend: Blend| with_field(RenderOptions::default(), |field| field.blend = blend);
    let surface = Blend::Isosurface(Isosurface {
        value: 100.0,
        colour: None,
        opacity: 1.0,
    });
    let mixed = RenderOptions {
        gradient_opacity: Some(GradientOpacity::ramp(0.0, 20.0)),
        ..RenderOptions::default()
    };
    let shell = transfer(
        &[(0.0, [1.0; 3]), (255.0, [1.0; 3])],
        &[(99.0, 0.0), (100.0, 0.9), (101.0, 0.0)],
    );
    let bands = bands();
    for (name, look, options) in [
        ("mixed", &bands, mixed),
        ("maximum", &bands, of_field(Blend::Maximum)),
        ("surface", &bands, of_field(surface)),
        ("shell", &shell, RenderOptions::default()),
    ] {
        let mut renderer = Renderer::new(&bytes, look, &options).expect("valid options");
        let stats = renderer.render(&camera()).expect("a valid camera").stats;
        let all = [
            stats.samples_contributed,
            stats.samples_shown,
            stats.lanes_computed,
        ];
        assert!(all[0] > 0 && all.is_sorted(), "{name}: {all:?}");
    }
}
