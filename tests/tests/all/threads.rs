//! The same bytes on any number of threads and in any frame (house property: buffers, bins and sorting are ordered by
//! the source alone), and agreement between vector levels to rounding.

use glam::{DAffine3, DVec3};
use rayon::ThreadPoolBuilder;
use resample_core::simd::SimdLevel;
use resample_core::{Camera, Image, SelectMode};
use resample_tests::volumes::scenes::{
    coloured, full, orthographic, perspective, random_volume, worst_difference,
};
use volsplat::procedural::blobs;
use volsplat::{DepthPlane, RenderOptions, Renderer, Subpixels, Volume};

const MODES: [SelectMode; 4] = [
    SelectMode::Hybrid,
    SelectMode::Points,
    SelectMode::Splats,
    SelectMode::Ewa,
];

fn options(select: SelectMode) -> RenderOptions {
    RenderOptions {
        depth: DepthPlane::Expected,
        min_transmittance: 1.0 / 512.0,
        ..full(select)
    }
}

/// About 50,000 samples, so that there are several chunks; the camera crosses the threshold inside the volume.
fn scene() -> (Volume, Camera) {
    let volume = random_volume([37, 37, 37], DAffine3::IDENTITY);
    (
        volume,
        perspective(
            DVec3::new(31.0, 25.0, -17.0),
            DVec3::splat(16.0),
            75.0,
            [70, 55],
        ),
    )
}

fn renderer(volume: &Volume, options: &RenderOptions) -> Renderer {
    Renderer::new(volume, &coloured(0.2), options).expect("valid options")
}

fn frame(renderer: &mut Renderer, camera: &Camera) -> Image {
    renderer.render(camera).expect("a valid camera").image
}

/// The bits of colour and depth.
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

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let (volume, camera) = scene();
    for select in MODES {
        let on_threads = |threads| {
            let pool = ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("a thread pool");
            pool.install(|| bits(&frame(&mut renderer(&volume, &options(select)), &camera)))
        };
        let [one, two, seven] = [1, 2, 7].map(on_threads);
        assert!(
            one.iter().any(|&b| b != 0),
            "{select:?}: the picture is empty"
        );
        assert!(
            one == two,
            "{select:?}: two threads give other bytes than one"
        );
        assert!(
            one == seven,
            "{select:?}: seven threads give other bytes than one"
        );
    }
}

#[test]
fn earlier_frames_leave_no_trace() {
    let (volume, camera) = scene();
    let others = [
        orthographic(
            DVec3::new(-40.0, 30.0, 9.0),
            DVec3::splat(12.0),
            50.0,
            [120, 90],
        ),
        perspective(
            DVec3::splat(18.2),
            DVec3::new(30.0, 20.0, 18.0),
            100.0,
            [16, 8],
        ),
        perspective(DVec3::splat(100.0), DVec3::splat(200.0), 50.0, [64, 64]),
    ];
    for select in MODES {
        let mut reused = renderer(&volume, &options(select));
        let first = bits(&frame(&mut reused, &camera));
        assert!(
            first == bits(&frame(&mut reused, &camera)),
            "{select:?}: the second frame differs"
        );
        for other in &others {
            frame(&mut reused, other);
            assert!(
                first == bits(&frame(&mut reused, &camera)),
                "{select:?}: a frame of another camera left something behind"
            );
        }
    }
}

#[test]
fn vector_levels_agree_to_rounding() {
    let volume = blobs(25).expect("a good size");
    let camera = perspective(DVec3::new(1.9, 1.2, -2.3), DVec3::ZERO, 45.0, [70, 55]);
    for select in MODES {
        // Without an early end: a tile that ends one block later on another level differs by more than rounding.
        let at = |simd| {
            let options = RenderOptions {
                simd,
                ..full(select)
            };
            frame(&mut renderer(&volume, &options), &camera)
        };
        let scalar = at(SimdLevel::Baseline);
        for level in SimdLevel::ALL {
            let difference = worst_difference(&scalar, &at(level));
            println!("{select:?}, {level:?}: {difference:.1e}");
            assert!(
                difference < 1e-5,
                "{select:?}: {level:?} differs from scalar by {difference}"
            );
        }
    }
}

/// Rayon divides a frame's tiles by recursion, and a thread that waits runs other parts on top of its own: the locals of a task are
/// on its stack some thirty times. With a task's scratch among them, one picture in eight overflowed 2 MB on five threads.
#[test]
fn a_frame_fits_an_eighth_of_a_threads_stack() {
    const STACK_BYTES: usize = 1 << 18;
    let pool = ThreadPoolBuilder::new()
        .num_threads(5)
        .stack_size(STACK_BYTES)
        .build()
        .expect("threads");
    let (volume, camera) = scene();
    let camera = Camera {
        width: 160,
        height: 126,
        ..camera
    };
    let field = RenderOptions {
        subpixels: Subpixels::Fixed(8),
        ..RenderOptions::default()
    };
    let kernels = RenderOptions::kernel_sheets();
    for options in [field, options(SelectMode::Hybrid), kernels] {
        for _ in 0..4 {
            let image = pool.install(|| frame(&mut renderer(&volume, &options), &camera));
            assert!(image.rgba.iter().any(|pixel| pixel[3] > 0.0));
        }
    }
}
