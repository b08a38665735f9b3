//! Light on scans of thick slices: against the formula of the scanned body, and in fields that rise evenly.

use glam::{DAffine3, DMat3, DVec3};
use resample_core::Camera;
use resample_tests::choices::with_field;
use resample_tests::volumes::scenes::{coloured, orthographic, perspective, render, volume};
use volsplat::{
    Blend, GradientFilter, GradientOpacity, Isosurface, Light, RenderOptions, Shading, Subpixels,
    Volume,
};

/// Ambient and diffuse share, as the shading's documentation gives them.
const AMBIENT: f64 = 0.3;
const DIFFUSE: f64 = 0.7;

/// Pixels are 1 mm apart, slices this many.
const SLICES_MM: f64 = 5.0;

/// Half the side of the scanned cube, mm.
const HALF_MM: f64 = 40.0;

/// A body that is inside where the distance is below 0.
struct Body {
    name: &'static str,
    /// About the distance from its surface, mm.
    distance_mm: fn(DVec3) -> f64,
    /// Most of central differences' error that smooth gradients may have.
    most: f64,
}

const BODIES: [Body; 3] = [
    Body {
        name: "ball",
        distance_mm: |p| p.length() - 30.0,
        most: 0.7,
    },
    Body {
        name: "skull",
        distance_mm: |p| {
            let bumps =
                0.8 * (7.0 * p.y.atan2(p.x)).sin() * (6.0 * p.z.atan2(p.truncate().length())).cos();
            DVec3::new(p.x / 1.1, p.y, p.z / 0.95).length() - 30.0 - bumps
        },
        most: 0.95,
    },
    Body {
        name: "rods",
        distance_mm: |p| {
            let rod =
                |through: DVec3, along: DVec3| (p - through).reject_from(along).length() - 3.5;
            let first = rod(DVec3::new(0.0, 5.0, -8.0), DVec3::new(1.0, 0.2, 0.5));
            first
                .min(rod(DVec3::new(5.0, 0.0, 14.0), DVec3::new(0.3, 1.0, -0.5)))
                .min(rod(
                    DVec3::new(-14.0, -6.0, 0.0),
                    DVec3::new(0.3, -0.1, 1.0),
                ))
        },
        most: 1.0,
    },
];

/// Scans a body: means over the thickness of a slice, under the blur of a scanner of about a millimetre.
fn scan(body: &Body) -> Volume {
    const PARTS: usize = 10;
    let (across, deep) = (
        2 * HALF_MM as usize + 1,
        (2.0 * HALF_MM / SLICES_MM) as usize + 1,
    );
    let grid = DAffine3::from_mat3_translation(
        DMat3::from_diagonal(DVec3::new(1.0, 1.0, SLICES_MM)),
        DVec3::splat(-HALF_MM),
    );
    volume([across, across, deep], grid, |voxel| {
        let middle = grid.transform_point3(voxel);
        let part = |k: usize| {
            let up = SLICES_MM * ((k as f64 + 0.5) / PARTS as f64 - 0.5);
            1.0 / (1.0 + ((body.distance_mm)(middle + up * DVec3::Z) / 0.45).exp())
        };
        (0..PARTS).map(part).sum::<f64>() / PARTS as f64
    })
}

/// The diffuse light on the body itself at each pixel's middle; `None` where its ray misses.
fn truth(body: &Body, camera: &Camera) -> Vec<Option<f64>> {
    let world_from_camera = camera.camera_from_world.inverse();
    let forward = camera.forward_in_world();
    let light = |i: u32| {
        let (x, y) = (
            f64::from(i % camera.width) + 0.5,
            f64::from(i / camera.width) + 0.5,
        );
        let at = DVec3::new(
            (x - camera.cx) / camera.fx,
            (y - camera.cy) / camera.fy,
            0.0,
        );
        let start = world_from_camera.transform_point3(at);
        let inside = |s: f64| (body.distance_mm)(start + s * forward) < 0.0;
        let hit = (0..4000)
            .map(|step| 0.05 * f64::from(step))
            .find(|&s| inside(s))?;
        let place = start + hit * forward;
        let slope = |axis: usize| {
            let step = 1e-4 * DVec3::AXES[axis];
            (body.distance_mm)(place + step) - (body.distance_mm)(place - step)
        };
        let normal = DVec3::new(slope(0), slope(1), slope(2)).normalize();
        Some(AMBIENT + DIFFUSE * normal.dot(forward).abs())
    };
    (0..camera.width * camera.height).map(light).collect()
}

fn options(filter: GradientFilter) -> RenderOptions {
    let surface = Isosurface {
        value: 0.5,
        colour: Some([1.0; 3]),
        opacity: 1.0,
    };
    with_field(
        RenderOptions {
            shading: Shading::Lambert,
            subpixels: Subpixels::Fixed(1),
            gradient_filter: filter,
            ..RenderOptions::default()
        },
        |field| field.blend = Blend::Isosurface(surface),
    )
}

#[test]
fn smooth_gradients_are_nearer_to_the_scanned_body() {
    for body in &BODIES {
        let volume = scan(body);
        let eye = 100.0 * DVec3::new(0.5, -0.8, 0.35);
        let camera = orthographic(eye, DVec3::ZERO, 2.0 * HALF_MM, [160, 160]);
        let truth = truth(body, &camera);
        let [smooth, central] = [GradientFilter::Smooth, GradientFilter::Central].map(|filter| {
            let image = render(&volume, &coloured(0.5), &options(filter), &camera);
            let pairs = image.rgba.iter().zip(&truth);
            let errors: Vec<f64> = pairs
                .filter(|(pixel, _)| pixel[3] == 1.0)
                .filter_map(|(pixel, truth)| Some(f64::from(pixel[0]) - (*truth)?))
                .collect();
            assert!(
                errors.len() > 2000,
                "{}: {} pixels",
                body.name,
                errors.len()
            );
            (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
        });
        println!(
            "{}: light off by {smooth:.4} (rms), by central differences {central:.4}: {:.2}",
            body.name,
            smooth / central
        );
        assert!(
            smooth < body.most * central,
            "{}: {smooth} and {central}",
            body.name
        );
    }
}

#[test]
fn a_field_that_rises_evenly_is_lit_alike_up_to_its_faces() {
    let gradient = DVec3::new(0.8, -0.5, 1.1);
    let grid = DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(1.0, 2.0, 6.0)));
    let volume = volume([30, 20, 9], grid, |voxel| {
        0.5 + 0.004 * gradient.dot(grid.transform_point3(voxel) - DVec3::new(14.0, 19.0, 24.0))
    });
    let end = DVec3::new(29.0, 38.0, 48.0);
    let camera = perspective(end * DVec3::new(3.0, -1.5, 2.0), 0.5 * end, 22.0, [60, 60]);
    let towards = DVec3::new(-0.2, 1.0, 0.7);
    let options = RenderOptions {
        shading: Shading::Lambert,
        light: Light::Towards(towards),
        ..RenderOptions::default()
    };
    let expected = AMBIENT + DIFFUSE * gradient.normalize().dot(towards.normalize()).abs();
    let image = render(
        &volume,
        &resample_tests::volumes::scenes::grey(0.6),
        &options,
        &camera,
    );
    let mut seen = 0;
    for pixel in image.rgba.iter().filter(|pixel| pixel[3] > 0.05) {
        seen += 1;
        let light = f64::from(pixel[0]) / f64::from(pixel[3]);
        assert!((light - expected).abs() < 2e-3, "{light}, not {expected}");
    }
    assert!(seen > 500, "{seen} pixels");
}

#[test]
fn opacity_by_the_gradient_takes_central_differences() {
    let volume = scan(&BODIES[0]);
    let camera = orthographic(DVec3::new(50.0, -80.0, 35.0), DVec3::ZERO, 80.0, [48, 48]);
    let [smooth, central] = [GradientFilter::Smooth, GradientFilter::Central].map(|filter| {
        let options = RenderOptions {
            shading: Shading::Phong,
            gradient_opacity: Some(GradientOpacity::ramp(0.01, 0.1)),
            gradient_filter: filter,
            ..RenderOptions::default()
        };
        render(&volume, &coloured(0.5), &options, &camera)
    });
    assert!(smooth == central);
    assert!(
        smooth.rgba.iter().any(|pixel| pixel[3] > 0.1),
        "nothing is seen"
    );
}
