//! What holds for image sheets by themselves: exact laws at faces, bytes that depend
//! on the scene alone, the bound of the early end, and convergence of second order in the slab's thickness.

use glam::{DAffine3, DVec3};
use rayon::ThreadPoolBuilder;
use resample_core::simd::SimdLevel;
use resample_core::{Camera, Image, Projection};
use resample_tests::choices::with_field;
use resample_tests::twins::samples::Scene;
use resample_tests::twins::sheets::render as reference;
use resample_tests::volumes::scenes::{
    coloured, grey, orthographic, perspective, random_volume, render, sheared_grid, transfer,
    volume, worst_difference,
};
use volsplat::procedural::blobs;
use volsplat::{DepthPlane, RenderOptions, Renderer, Subpixels, TransferFunction, Volume};

fn options() -> RenderOptions {
    RenderOptions {
        subpixels: Subpixels::Fixed(1),
        min_transmittance: 0.0,
        ..RenderOptions::default()
    }
}

/// A camera whose axes are those of the world, at `eye`, of parallel rays `spacing` apart.
fn straight(eye: DVec3, spacing: f64, size: [u32; 2]) -> Camera {
    Camera {
        projection: Projection::Orthographic,
        width: size[0],
        height: size[1],
        fx: 1.0 / spacing,
        fy: 1.0 / spacing,
        cx: 0.5,
        cy: 0.5,
        camera_from_world: DAffine3::from_translation(-eye),
        near: -1e30,
    }
}

/// Places of a volume that f32 and f64 round in their own ways.
const ORIGINS: [DVec3; 4] = [
    DVec3::ZERO,
    DVec3::new(0.1, 0.7, 0.3),
    DVec3::new(1e3, -777.7, 12_345.6),
    DVec3::new(-3.1, -33_333.3, 17.9),
];

/// Opacity everywhere the same: what is left is exp(-extinction * planes inside * slab), to rounding, at every pixel,
/// also where pixel centres run along the faces between cells and bricks and where planes lie in them.
#[test]
fn a_constant_volume_is_exact_and_has_no_seams() {
    let tau = -(-0.05f64).ln_1p();
    let mut seams = 0;
    for spacing in [
        1.0,
        0.1,
        1.0 / 3.0,
        0.7,
        0.9,
        1.1,
        1.3,
        0.05,
        3.3,
        7.7,
        0.123,
        0.377,
    ] {
        let dims = [26, 19, 35];
        let volume = volume(dims, DAffine3::from_scale(DVec3::splat(spacing)), |_| 1.0);
        for (slab_voxels, before) in [(0.25, 0.1), (0.5, 0.25), (0.5, 0.4), (1.0, 0.5), (1.0, 0.3)]
        {
            for origin in ORIGINS {
                let moved = Volume {
                    world_from_index: DAffine3::from_translation(origin) * volume.world_from_index,
                    ..volume.clone()
                };
                // One voxel a pixel, from the first cell face inside to the last one.
                let eye = origin + spacing * DVec3::new(1.0, 1.0, -before);
                let camera = straight(eye, spacing, [dims[0] as u32 - 2, dims[1] as u32 - 2]);
                let case =
                    format!("spacing {spacing}, slab {slab_voxels}, start {before}, at {origin}");
                seams += check_constant(&case, &moved, (slab_voxels, before), (&camera, tau));
            }
        }
    }
    assert_eq!(seams, 0, "pixels that leave too little or too much");
}

fn check_constant(
    case: &str,
    volume: &Volume,
    (slab_voxels, before): (f64, f64),
    (camera, tau): (&Camera, f64),
) -> usize {
    let last = (volume.dims[2] - 1) as f64;
    // Planes (k + 1/2) slab - before inside 0..=last, counted with those on a face in and out.
    let count = |margin: f64| {
        let inside = |k: u32| {
            let z = (f64::from(k) + 0.5) * slab_voxels - before;
            z > margin && z < last - margin
        };
        (0..10_000).filter(|&k| inside(k)).count() as f64
    };
    let left = [1e-6, -1e-6].map(|margin| (-tau * slab_voxels * count(margin)).exp());
    let mut seams = 0;

    let options = with_field(options(), |field| field.slab_voxels = slab_voxels);
    let image = render(volume, &grey(0.05), &options, camera);
    let is_off = |pixel: &&[f32; 4]| {
        let got = 1.0 - f64::from(pixel[3]);
        got > left[0] + 1e-5 || got < left[1] - 1e-5
    };
    let off = image.rgba.iter().filter(is_off).count();
    if off > 0 {
        println!(
            "{case}: {off} of {} pixels do not leave {left:?}",
            image.rgba.len()
        );
    }
    seams += off;

    seams
}

/// The same in a pinhole, where each ray has its own length through a slab.
#[test]
fn a_constant_volume_has_no_seams_in_perspective() {
    for grid in [DAffine3::IDENTITY, sheared_grid()] {
        let volume = volume([33, 26, 26], grid, |_| 1.0);
        let middle = grid.transform_point3(DVec3::new(16.0, 12.5, 12.5));
        let eye = middle + DVec3::new(30.0, 22.0, -35.0);
        let camera = perspective(eye, middle, 40.0, [48, 48]);

        let options = options();
        let image = render(&volume, &grey(0.02), &options, &camera);
        let truth = reference(&Scene {
            volume: &volume,
            transfer: &grey(0.02),
            camera: &camera,
            options: &options,
        });
        let errors = image.rgba.iter().zip(&truth);
        let worst = errors
            .map(|(got, t)| (1.0 - f64::from(got[3]) - t.transmittance).abs() - t.slack)
            .fold(0.0, f64::max);
        println!("constant volume: {worst:.1e}");
        assert!(worst < 1e-5, "off by {worst}");
    }
}

fn busy_options() -> RenderOptions {
    RenderOptions {
        subpixels: Subpixels::Fixed(2),
        depth: DepthPlane::Expected,
        min_transmittance: 1.0 / 512.0,
        ..options()
    }
}

fn frame(renderer: &mut Renderer, camera: &Camera) -> Image {
    renderer.render(camera).expect("a valid camera").image
}

fn bits(image: &Image) -> Vec<u32> {
    let depths = image.depth.as_ref().expect("a depth plane was asked for");
    image
        .rgba
        .iter()
        .flatten()
        .chain(depths)
        .map(|x| x.to_bits())
        .collect()
}

fn busy_scene() -> (Volume, TransferFunction, Camera) {
    let volume = random_volume([37, 30, 33], DAffine3::IDENTITY);
    (
        volume,
        coloured(0.2),
        perspective(
            DVec3::new(31.0, 25.0, -17.0),
            DVec3::splat(16.0),
            75.0,
            [50, 39],
        ),
    )
}

#[test]
fn bytes_do_not_depend_on_threads() {
    let (volume, look, camera) = busy_scene();

    let [one, two, seven] = [1, 2, 7].map(|threads| {
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a thread pool");
        pool.install(|| {
            let mut renderer =
                Renderer::new(&volume, &look, &busy_options()).expect("valid options");
            bits(&frame(&mut renderer, &camera))
        })
    });
    assert!(one.iter().any(|&b| b != 0), "the picture is empty");
    assert!(
        one == two && one == seven,
        "the bytes depend on the number of threads"
    );
}

#[test]
fn earlier_frames_leave_no_trace() {
    let (volume, look, camera) = busy_scene();
    let others = [
        orthographic(
            DVec3::new(-40.0, 30.0, 9.0),
            DVec3::splat(12.0),
            50.0,
            [90, 70],
        ),
        perspective(
            DVec3::splat(18.2),
            DVec3::new(30.0, 20.0, 18.0),
            100.0,
            [16, 8],
        ),
        perspective(DVec3::splat(100.0), DVec3::splat(200.0), 50.0, [64, 64]),
    ];

    let mut renderer = Renderer::new(&volume, &look, &busy_options()).expect("valid options");
    let first = bits(&frame(&mut renderer, &camera));
    for other in &others {
        frame(&mut renderer, other);
        assert!(
            first == bits(&frame(&mut renderer, &camera)),
            "a frame left something behind"
        );
    }
}

#[test]
fn vector_levels_agree_to_rounding() {
    let volume = blobs(25).expect("a good size");
    let camera = perspective(DVec3::new(1.9, 1.2, -2.3), DVec3::ZERO, 45.0, [70, 55]);

    let at = |simd| {
        render(
            &volume,
            &coloured(0.2),
            &RenderOptions { simd, ..options() },
            &camera,
        )
    };
    let scalar = at(SimdLevel::Baseline);
    for level in SimdLevel::ALL {
        let difference = worst_difference(&scalar, &at(level));
        println!("{level:?}: {difference:.1e}");
        assert!(
            difference < 1e-5,
            "{level:?} differs from scalar by {difference}"
        );
    }
}

#[test]
fn an_early_end_changes_no_pixel_by_more_than_its_bound() {
    let volume = random_volume([16, 16, 16], DAffine3::IDENTITY);
    let camera = perspective(
        DVec3::new(26.0, 21.0, -17.0),
        DVec3::splat(7.5),
        25.0,
        [48, 48],
    );

    for n in [1, 4] {
        let picture = |min_transmittance| {
            let options = RenderOptions {
                min_transmittance,
                subpixels: Subpixels::Fixed(n),
                ..options()
            };
            render(&volume, &coloured(0.5), &options, &camera)
        };
        let whole = picture(0.0);
        for bound in [1.0 / 512.0, 0.05, 0.5, 0.99] {
            let difference = worst_difference(&whole, &picture(bound));
            println!("{n} sub-pixels, end at {bound}: {difference:.1e}");
            assert!(
                difference <= f64::from(bound),
                "{difference}, more than {bound}"
            );
            assert!(
                bound < 0.5 || difference > 0.0,
                "{bound} ended nothing early"
            );
        }
    }
}

/// The plane through a slab's middle is the midpoint rule: half the slab, a quarter of the error. The truth is the
/// reference with slabs of 1/64 voxel, whose own error is 1/64 of that of the finest slab compared.
#[test]
fn error_falls_with_the_square_of_the_slab() {
    let volume = blobs(24).expect("a good size");
    let look = transfer(
        &[(0.0, [0.1, 0.2, 1.0]), (2.0, [1.0, 0.3, 0.1])],
        &[(0.0, 0.0), (3.0, 0.5)],
    );
    let eye = DVec3::new(1.9, 1.2, -2.3);
    for camera in [
        perspective(eye, DVec3::ZERO, 40.0, [32, 32]),
        orthographic(eye, DVec3::ZERO, 2.2, [32, 32]),
    ] {
        let fine = with_field(options(), |field| field.slab_voxels = 1.0 / 64.0);
        let truth = reference(&Scene {
            volume: &volume,
            transfer: &look,
            camera: &camera,
            options: &fine,
        });
        let rms = |slab_voxels| {
            let options = with_field(options(), |field| field.slab_voxels = slab_voxels);
            let image = render(&volume, &look, &options, &camera);
            let squares = image.rgba.iter().zip(&truth).map(|(got, truth)| {
                let [r, g, b] = truth.rgb;
                let pairs = got.iter().zip([r, g, b, 1.0 - truth.transmittance]);
                pairs
                    .map(|(got, t)| (f64::from(*got) - t).powi(2))
                    .sum::<f64>()
            });
            (squares.sum::<f64>() / truth.len() as f64).sqrt()
        };
        let errors = [2.0, 1.0, 0.5, 0.25].map(rms);
        let orders = errors.windows(2).map(|e| e[0] / e[1]).collect::<Vec<f64>>();
        println!(
            "{:?}: error {errors:.6?} for slabs of 2 to 1/4, falls by {orders:.2?}",
            camera.projection
        );
        assert!(
            errors[0] > 1e-3,
            "the scene is too faint to test anything: {errors:?}"
        );
        for order in orders {
            assert!(
                (3.0..6.5).contains(&order),
                "half the slab divides the error by {order}, not about 4"
            );
        }
    }
}
