//! Surfaces inside volumes: meshes that texmap draws at the sub-pixels of a volume's picture, composited where rays meet them.

use glam::{DAffine3, DVec2, DVec3};
use resample_core::simd::SimdLevel;
use resample_core::{Camera, Image, Projection, Stop, Surface};
use resample_tests::frames::one_thread;
use resample_tests::meshes::shadows::{Body, Shape, first_met, scene};
use resample_tests::meshes::surroundings::Reflector;
use resample_tests::volumes::area_truth::{AreaTruth, MetSurface};
use resample_tests::volumes::scenes::{orthographic, perspective, transfer};
use texmap::Shade;
use volsplat::volume::procedural::blobs;
use volsplat::{
    Blend, DepthPlane, FieldOptions, Isosurface, Order, RenderOptions, Renderer, SampleOptions,
    Subpixels, TransferFunction, Volume, Voxels,
};

/// Voxels along the volume's sides.
const SIDE: usize = 48;

fn body(shape: Shape, base: [f64; 3]) -> Body {
    let surface = Reflector {
        base: base.into(),
        metal: 0.0,
        roughness: 1.0,
    };
    Body { shape, surface }
}

/// A ball that matter surrounds, and a rod through it.
fn bodies() -> [Body; 2] {
    [
        body(
            Shape::Ball(DVec3::new(22.0, 24.0, 27.0), 8.3),
            [0.9, 0.15, 0.1],
        ),
        body(
            Shape::Block(DVec3::new(-4.0, 21.3, 20.2), DVec3::new(52.0, 25.1, 23.9)),
            [0.1, 0.3, 0.9],
        ),
    ]
}

fn volume() -> Volume {
    let blobs = blobs(SIDE).expect("valid");
    Volume::new(blobs.dims, blobs.voxels, DAffine3::IDENTITY).expect("valid")
}

fn look(volume: &Volume, most: f64) -> TransferFunction {
    let (low, high) = volume.voxels.finite_range();
    let at = |share: f64| low + share * (high - low);
    transfer(
        &[(at(0.0), [0.9, 0.8, 0.3]), (at(1.0), [0.3, 0.9, 0.8])],
        &[(at(0.3), 0.0), (at(0.6), most), (at(1.0), most)],
    )
}

fn cameras() -> Vec<(&'static str, Camera)> {
    let middle = DVec3::splat(0.5 * (SIDE - 1) as f64);
    let towards = DVec3::new(0.5, 0.35, 0.8).normalize();
    vec![
        (
            "close",
            perspective(middle + 70.0 * towards, middle, 40.0, [80, 70]),
        ),
        (
            "far",
            perspective(middle + 400.0 * towards, middle, 9.0, [40, 40]),
        ),
        (
            "inside",
            perspective(middle + 12.0 * towards, middle, 70.0, [60, 50]),
        ),
        (
            "parallel",
            orthographic(middle + 70.0 * towards, middle, 60.0, [50, 45]),
        ),
    ]
}

/// The bodies as texmap draws them for `renderer`.
fn drawn(bodies: &[Body], renderer: &Renderer, camera: &Camera, opacity: f32) -> Surface {
    let options = texmap::RenderOptions {
        shade: Shade::Unlit,
        ..texmap::RenderOptions::default()
    };
    let mut meshes = texmap::Renderer::new(&scene(bodies), &options).expect("valid");
    let subpixels = renderer.subpixels(camera).expect("a field");
    let mut surface = meshes.surface(camera, subpixels).expect("valid");
    surface.fade(1.0 - opacity);
    surface
}

/// The surfaces that a ray meets: the first of each list of bodies, with its opacity.
fn met(lists: &[(&[Body], f64)], camera: &Camera, screen: DVec2) -> Vec<MetSurface> {
    let world_from_camera = camera.camera_from_world.inverse();
    let [x, y] = [
        (screen.x - camera.cx) / camera.fx,
        (screen.y - camera.cy) / camera.fy,
    ];
    let (from, along) = match camera.projection {
        Projection::Perspective => (DVec3::ZERO, DVec3::new(x, y, 1.0)),
        Projection::Orthographic => (DVec3::new(x, y, 0.0), DVec3::Z),
    };
    let from = world_from_camera.transform_point3(from);
    let towards = world_from_camera.transform_vector3(along);
    let surface = |&(bodies, opacity): &(&[Body], f64)| {
        let met = first_met(bodies, from, towards.normalize())?;
        let [r, g, b] = (opacity * bodies[met.body].surface.base).to_array();
        Some(MetSurface {
            z: met.distance / towards.length(),
            rgba: [r, g, b, opacity],
        })
    };
    lists.iter().filter_map(surface).collect()
}

fn among(renderer: &mut Renderer, camera: &Camera, surfaces: &[Surface]) -> Image {
    let frame = renderer.render_among(camera, surfaces, &Stop::default(), &mut |_| {});
    frame.expect("valid").image
}

fn psnr_db(image: &Image, truth: &Image) -> f64 {
    let square = |(a, b): (&[f32; 4], &[f32; 4])| {
        (0..4).map(|k| f64::from(a[k] - b[k]).powi(2)).sum::<f64>() / 4.0
    };
    let sum: f64 = image.rgba.iter().zip(&truth.rgba).map(square).sum();
    -10.0 * (sum / image.rgba.len() as f64).log10()
}

/// Least ratio of signal to noise beside the truth, over all channels and opacity. The least of the scenes below is 42 dB; 46 dB of an edge
/// from white to black along a tenth of all pixels are errors of 1/60 there.
const LEAST_DB: f64 = 40.0;

#[test]
fn pictures_are_those_of_rays_that_meet_both() {
    let volume = volume();
    for most in [0.05, 0.6] {
        let look = look(&volume, most);
        let mut truth = AreaTruth::new(&volume, &look);
        truth.rays_per_side = 8;
        let mut renderer = Renderer::new(&volume, &look, &RenderOptions::default()).expect("valid");
        for (name, camera) in cameras() {
            for opacity in [1.0, 0.4] {
                let surface = drawn(&bodies(), &renderer, &camera, opacity as f32);
                let image = among(&mut renderer, &camera, &[surface]);
                let met = |screen| met(&[(&bodies(), opacity)], &camera, screen);
                let truth = truth.render_among(&camera, &met);
                let db = psnr_db(&image, &truth);
                assert!(db > LEAST_DB, "{most} {name} {opacity}: {db:.1} dB");
            }
        }
    }
}

#[test]
fn surfaces_are_sorted_at_every_pixel() {
    let volume = volume();
    let look = look(&volume, 0.2);
    let mut truth = AreaTruth::new(&volume, &look);
    truth.rays_per_side = 8;
    let mut renderer = Renderer::new(&volume, &look, &RenderOptions::default()).expect("valid");
    let [ball, rod] = bodies();
    for (name, camera) in cameras() {
        // The rod is before the ball here and behind it there.
        let veil = drawn(&[ball], &renderer, &camera, 0.5);
        let solid = drawn(&[rod], &renderer, &camera, 1.0);
        let image = among(&mut renderer, &camera, &[veil.clone(), solid.clone()]);
        assert_eq!(
            image,
            among(&mut renderer, &camera, &[solid, veil]),
            "{name}"
        );
        let met = |screen| met(&[(&[ball], 0.5), (&[rod], 1.0)], &camera, screen);
        let db = psnr_db(&image, &truth.render_among(&camera, &met));
        assert!(db > LEAST_DB, "{name}: {db:.1} dB");
    }
}

/// The scalar between voxels, which are read anew; `None` outside.
fn scalar(volume: &Volume, place: DVec3) -> Option<f64> {
    let last = DVec3::splat((SIDE - 1) as f64);
    if place.cmplt(DVec3::ZERO).any() || place.cmpgt(last).any() {
        return None;
    }
    let corner = place.floor().min(last - 1.0);
    let within = place - corner;
    let at = |x: f64, y: f64, z: f64| {
        let [x, y, z] = [corner.x + x, corner.y + y, corner.z + z].map(|v| v as usize);
        volume.value((z * SIDE + y) * SIDE + x)
    };
    let line = |y, z| (1.0 - within.x) * at(0.0, y, z) + within.x * at(1.0, y, z);
    let sheet = |z| (1.0 - within.y) * line(0.0, z) + within.y * line(1.0, z);
    Some((1.0 - within.z) * sheet(0.0) + within.z * sheet(1.0))
}

/// Step along a ray, voxels. A surface that is met and left within one is missed.
const STEP: f64 = 0.1;

/// Camera z at which a ray first meets the surface of `value`, by small steps and then halves.
fn crossing(volume: &Volume, value: f64, camera: &Camera, screen: DVec2) -> Option<f64> {
    let (origin, direction) = camera.ray_in_camera(screen);
    let world_from_camera = camera.camera_from_world.inverse();
    let from = world_from_camera.transform_point3(origin);
    let towards = world_from_camera.transform_vector3(direction);
    let is_inside = |z: f64| scalar(volume, from + z * towards).is_some_and(|found| found >= value);
    let step = STEP / towards.length();
    let middle = DVec3::splat(0.5 * (SIDE - 1) as f64);
    let near = (middle - from).dot(towards) / towards.length_squared() - 45.0 / towards.length();
    let steps = (90.0 / STEP) as usize;
    let begin = near.max(camera.near);
    let hit = (0..steps).find(|&i| is_inside(begin + i as f64 * step))?;
    let (mut out, mut inside) = (begin + (hit as f64 - 1.0) * step, begin + hit as f64 * step);
    for _ in 0..40 {
        let half = 0.5 * (out + inside);
        if is_inside(half) {
            inside = half;
        } else {
            out = half;
        }
    }
    Some(inside)
}

#[test]
fn an_isosurface_stands_in_its_volume() {
    let volume = volume();
    let (low, high) = volume.voxels.finite_range();
    let value = low + 0.72 * (high - low);
    let colour = [0.8, 0.1, 0.2];
    let surfaces = RenderOptions {
        order: Order::Field(FieldOptions {
            blend: Blend::Isosurface(Isosurface {
                value,
                colour: Some(colour),
                opacity: 1.0,
            }),
            ..FieldOptions::default()
        }),
        ..RenderOptions::default()
    };
    let look = look(&volume, 0.05);
    let mut truth = AreaTruth::new(&volume, &look);
    truth.rays_per_side = 8;
    let mut renderer = Renderer::new(&volume, &look, &RenderOptions::default()).expect("valid");
    let mut isosurface = Renderer::new(&volume, &look, &surfaces).expect("valid");
    for ((name, camera), opacity) in cameras().into_iter().zip([1.0, 0.4, 1.0, 0.4]) {
        let subpixels = renderer.subpixels(&camera).expect("a field");
        let mut surface = isosurface.surface(&camera, subpixels).expect("valid");
        surface.fade(1.0 - opacity as f32);
        let image = among(&mut renderer, &camera, &[surface]);
        let met = |screen| {
            let z = crossing(&volume, value, &camera, screen);
            let [r, g, b] = colour.map(|channel| opacity * f64::from(channel));
            let surface = z.map(|z| MetSurface {
                z,
                rgba: [r, g, b, opacity],
            });
            surface.into_iter().collect()
        };
        let db = psnr_db(&image, &truth.render_among(&camera, &met));
        assert!(db > LEAST_DB, "{name} {opacity}: {db:.1} dB");
    }
    assert!(
        renderer.surface(&cameras()[0].1, 1).is_err(),
        "emission is no surface"
    );
}

/// A box of fog: a value everywhere.
fn fog(side: usize) -> Volume {
    let values = vec![1.0; side.pow(3)];
    Volume::new([side; 3], Voxels::F32(values), DAffine3::IDENTITY).expect("valid")
}

/// A plane of one colour that falls away from the eye: at each sub-pixel of a picture from `camera`, the depth at the middle of the
/// volume and `slope` more for each sub-pixel to the right.
fn slope(camera: &Camera, subpixels: u32, [first, slope]: [f64; 2], rgba: [f32; 4]) -> Surface {
    let [width, height] = [camera.width, camera.height].map(|side| (side * subpixels) as usize);
    let mut image = Image::transparent(width, height);
    image.rgba.fill(rgba);
    let depth = |at: usize| (first + slope * (at % width) as f64) as f32;
    image.depth = Some((0..width * height).map(depth).collect());
    let mut surface = Surface::unseen([width, height]);
    surface.lay(&image, 0);
    surface
}

#[test]
fn fog_before_a_slope_has_the_opacity_of_its_depth() {
    let side = 24;
    let volume = fog(side);
    let opacity = 0.1f64;
    let look = transfer(
        &[(0.0, [1.0; 3]), (2.0, [1.0; 3])],
        &[(0.0, opacity), (2.0, opacity)],
    );
    let middle = DVec3::splat(0.5 * (side - 1) as f64);
    let camera = orthographic(middle + 60.0 * DVec3::Z, middle, 12.0, [64, 64]);
    let front = 60.0 - middle.z;
    for order in [0.5, 0.25, 1.3] {
        let options = RenderOptions {
            order: Order::Field(FieldOptions {
                slab_voxels: order,
                ..FieldOptions::default()
            }),
            subpixels: Subpixels::Fixed(1),
            depth: DepthPlane::Expected,
            ..RenderOptions::default()
        };
        let mut renderer = Renderer::new(&volume, &look, &options).expect("valid");
        let (first, rise) = (front + 1.0, 0.25);
        let black = slope(&camera, 1, [first, rise], [0.0, 0.0, 0.0, 1.0]);
        let image = among(&mut renderer, &camera, &[black]);
        for x in 0..64 {
            let depth = first + rise * f64::from(x) - front;
            let expected = 1.0 - (1.0 - opacity).powf(depth);
            let [red, _, _, alpha] = image.pixel(x as usize, 30);
            // Slabs begin on planes fixed to the eye, half a slab before or behind the face.
            let slack = 0.5 * order * -(1.0 - opacity).ln();
            assert!(
                (f64::from(red) - expected).abs() < 1.01 * slack,
                "{x}: {red} {expected}"
            );
            assert!((alpha - 1.0).abs() < 1e-6);
            if x > 0 {
                // No contours of slabs: each step deeper adds what its length holds.
                let step = f64::from(red - image.pixel(x as usize - 1, 30)[0]);
                let left = 1.0 - f64::from(red);
                let held = rise * -(1.0 - opacity).ln();
                assert!(
                    (step / (left * held) - 1.0).abs() < 0.03,
                    "{x}: {step} {}",
                    left * held
                );
            }
        }
    }
}

fn blended(blend: Blend) -> RenderOptions {
    RenderOptions {
        order: Order::Field(FieldOptions {
            blend,
            ..FieldOptions::default()
        }),
        subpixels: Subpixels::Fixed(1),
        ..RenderOptions::default()
    }
}

/// A volume whose values rise away from the eye, from 0 to 23 a voxel, its camera, and camera z of its front.
fn rising() -> (Volume, Camera, f64) {
    let side = 24;
    let values = (0..side * side * side)
        .map(|at| (at / (side * side)) as f32)
        .collect();
    let volume = Volume::new([side; 3], Voxels::F32(values), DAffine3::IDENTITY).expect("valid");
    let middle = DVec3::splat(0.5 * (side - 1) as f64);
    let camera = orthographic(middle - 60.0 * DVec3::Z, middle, 12.0, [64, 64]);
    let front = 60.0 - middle.z;
    (volume, camera, front)
}

#[test]
fn a_maximum_is_that_of_the_samples_before_the_surface() {
    let (volume, camera, front) = rising();
    let look = transfer(
        &[(0.0, [0.0; 3]), (23.0, [1.0; 3])],
        &[(0.0, 1.0), (23.0, 1.0)],
    );
    let options = blended(Blend::Maximum);
    let slab_voxels = FieldOptions::default().slab_voxels;
    let mut renderer = Renderer::new(&volume, &look, &options).expect("valid");
    let red = slope(&camera, 1, [front + 2.0, 0.25], [1.0, 0.0, 0.0, 1.0]);
    let image = among(&mut renderer, &camera, std::slice::from_ref(&red));
    for x in 0..64 {
        let depth = 2.0 + 0.25 * f64::from(x);
        let green = f64::from(image.pixel(x as usize, 30)[1]);
        // The last sample lies at most a slab before the surface; a table of 1024 colours rounds by half of one.
        assert!(
            (green - depth / 23.0).abs() < slab_voxels / 23.0 + 0.5 / 1024.0,
            "{x}: {green} {}",
            depth / 23.0
        );
    }
    let mut veil = red;
    veil.fade(0.6);
    let whole = among(&mut renderer, &camera, &[veil]);
    assert!(
        (whole.pixel(30, 30)[1] - 1.0).abs() < 0.03,
        "a veil hides nothing"
    );
}

#[test]
fn an_isosurface_and_shells_end_at_surfaces() {
    let (volume, camera, front) = rising();
    let plain = transfer(
        &[(0.0, [0.0, 1.0, 0.0]), (23.0, [0.0, 1.0, 0.0])],
        &[(0.0, 1.0), (23.0, 1.0)],
    );
    let surface = blended(Blend::Isosurface(Isosurface {
        value: 10.0,
        colour: None,
        opacity: 1.0,
    }));
    let shell = transfer(
        &[(0.0, [0.0, 1.0, 0.0]), (23.0, [0.0, 1.0, 0.0])],
        &[(9.9, 0.0), (9.95, 1.0), (10.05, 1.0), (10.1, 0.0)],
    );
    let thin = blended(Blend::Emission);
    for (look, options) in [(plain, surface), (shell, thin)] {
        let mut renderer = Renderer::new(&volume, &look, &options).expect("valid");
        let red = slope(&camera, 1, [front + 2.0, 0.25], [1.0, 0.0, 0.0, 1.0]);
        let image = among(&mut renderer, &camera, &[red]);
        for x in 0..64 {
            let depth = 2.0 + 0.25 * f64::from(x);
            let [red, green, ..] = image.pixel(x as usize, 30);
            // The shell is a fifth of a voxel thick.
            if depth < 9.89 {
                assert!(red == 1.0 && green == 0.0, "{x}: the red slope is nearer");
            } else if depth > 10.11 {
                assert!(
                    red < 0.5 && green > 0.5,
                    "{x}: {red} {green}, the surface is nearer"
                );
            }
        }
    }
}

#[test]
fn without_surfaces_pictures_are_the_same_and_surfaces_alone_are_seen() {
    let volume = volume();
    let look = look(&volume, 0.2);
    let mut renderer = Renderer::new(&volume, &look, &RenderOptions::default()).expect("valid");
    for (name, camera) in cameras() {
        let subpixels = renderer.subpixels(&camera).expect("a field");
        let size = [camera.width, camera.height].map(|side| (side * subpixels) as usize);
        let bare = renderer.render(&camera).expect("valid").image;
        assert_eq!(bare, among(&mut renderer, &camera, &[]), "{name}");
        let unseen = among(&mut renderer, &camera, &[Surface::unseen(size)]);
        // The means of pixels are not corrected where surfaces may stand.
        assert!(psnr_db(&unseen, &bare) > 45.0, "{name}");
        let behind = slope(&camera, subpixels, [1e6, 0.0], [0.5, 0.25, 0.125, 1.0]);
        let image = among(&mut renderer, &camera, &[behind]);
        let expected = unseen.over_background([0.5, 0.25, 0.125]);
        assert!(psnr_db(&image, &expected) > 100.0, "{name}");
    }
}

#[test]
fn vectors_and_threads_change_nothing() {
    let volume = volume();
    let look = look(&volume, 0.2);
    let (_, camera) = cameras().remove(0);
    let mut pictures = Vec::new();
    for simd in SimdLevel::ALL {
        let options = RenderOptions {
            simd,
            ..RenderOptions::default()
        };
        let mut renderer = Renderer::new(&volume, &look, &options).expect("valid");
        let surface = drawn(&bodies(), &renderer, &camera, 0.5);
        let surfaces = [surface];
        let image = among(&mut renderer, &camera, &surfaces);
        let alone = one_thread().install(|| among(&mut renderer, &camera, &surfaces));
        assert_eq!(image, alone);
        pictures.push(image);
    }
    for other in &pictures[1..] {
        assert!(psnr_db(other, &pictures[0]) > 110.0);
    }
}

#[test]
fn surfaces_that_cannot_stand_there_are_refused() {
    let volume = volume();
    let look = look(&volume, 0.2);
    let (_, camera) = cameras().remove(0);
    let mut renderer = Renderer::new(&volume, &look, &RenderOptions::default()).expect("valid");
    let odd = Surface::unseen([7, 9]);
    let refused = renderer.render_among(&camera, &[odd], &Stop::default(), &mut |_| {});
    let message = refused.expect_err("another size").to_string();
    assert!(message.contains("a surface has 7x9 pixels"), "{message}");
    let samples = RenderOptions {
        order: Order::Samples(SampleOptions::default()),
        ..RenderOptions::default()
    };
    let mut renderer = Renderer::new(&volume, &look, &samples).expect("valid");
    let message = renderer
        .subpixels(&camera)
        .expect_err("samples")
        .to_string();
    assert!(message.contains("leave out the surfaces"), "{message}");
    let own = Surface::unseen([camera.width as usize, camera.height as usize]);
    let refused = renderer.render_among(&camera, &[own], &Stop::default(), &mut |_| {});
    assert!(refused.is_err());
}
