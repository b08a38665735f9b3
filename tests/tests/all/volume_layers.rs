//! Planes beside a volume's colour, against closed forms: a sphere, a plane, a slab of fog.

use glam::{DAffine3, DVec2, DVec3};
use resample_core::{Camera, Image};
use resample_tests::choices::{with_field, with_samples};
use resample_tests::volumes::scenes::{
    coloured, orthographic, perspective, sheared_grid, transfer, volume,
};
use volsplat::{
    Clip, ClipPlane, ColourBy, Layer, RenderOptions, Renderer, TransferFunction, Volume,
};

const ALL: [Layer; 3] = [Layer::FirstHit, Layer::Normal, Layer::Samples];

/// Opaque from 0 on.
fn solid() -> TransferFunction {
    transfer(&[(0.0, [1.0; 3])], &[(0.0, 0.0), (0.0, 1.0)])
}

struct Planes {
    first: Vec<f32>,
    normals: Vec<DVec3>,
    samples: Vec<f32>,
}

fn planes(
    volume: &Volume,
    look: &TransferFunction,
    options: &RenderOptions,
    camera: &Camera,
) -> (Planes, Image) {
    let mut renderer = Renderer::new(volume, look, options).expect("valid options");
    let image = renderer.render(camera).expect("a valid camera").image;
    let planes = renderer.layers(camera, &ALL).expect("planes");
    let names: Vec<&str> = planes.iter().map(|plane| plane.name.as_str()).collect();
    assert_eq!(
        names,
        ["depth.first", "normal.X", "normal.Y", "normal.Z", "samples"],
        "channels"
    );
    let normal = |i: usize| DVec3::from([1, 2, 3].map(|k| f64::from(planes[k].values[i])));
    let normals = (0..planes[0].values.len()).map(normal).collect();
    (
        Planes {
            first: planes[0].values.clone(),
            normals,
            samples: planes[4].values.clone(),
        },
        image,
    )
}

/// World position of a camera z on the ray through a pixel's middle.
fn on_ray(camera: &Camera, pixel: usize, camera_z: f64) -> DVec3 {
    let (x, y) = (pixel % camera.width as usize, pixel / camera.width as usize);
    let (origin, direction) = camera.ray_in_camera(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
    let in_camera = origin + (camera_z - origin.z) / direction.z * direction;
    camera
        .camera_from_world
        .inverse()
        .transform_point3(in_camera)
}

#[test]
fn a_sphere_is_met_at_its_surface_and_faces_outwards() {
    let (centre, radius) = (DVec3::new(15.0, 16.0, 14.5), 11.0);
    let ball = volume([32, 32, 30], DAffine3::IDENTITY, |p| {
        radius - p.distance(centre)
    });
    for camera in [
        perspective(DVec3::new(10.0, 40.0, -50.0), centre, 30.0, [40, 30]),
        orthographic(DVec3::new(60.0, 20.0, 40.0), centre, 30.0, [30, 30]),
    ] {
        let (planes, image) = planes(&ball, &solid(), &RenderOptions::default(), &camera);
        let mut seen = 0;
        for (pixel, &first) in planes.first.iter().enumerate() {
            if first == f32::INFINITY {
                assert_eq!(
                    planes.normals[pixel],
                    DVec3::ZERO,
                    "nothing faces anywhere at {pixel}"
                );
                continue;
            }
            let hit = on_ray(&camera, pixel, f64::from(first));
            let outwards = (hit - centre).normalize();
            let towards = (on_ray(&camera, pixel, f64::from(first) - 1.0) - hit).normalize();
            let slant = outwards.dot(towards);
            // At the rim the ray runs along the surface.
            if slant < 0.5 {
                continue;
            }
            seen += 1;
            // Trilinear between voxels, a sphere is flat by at most h^2 / (8 R) along each of two axes.
            let off = (hit.distance(centre) - radius).abs();
            assert!(
                off < 3.0 / (8.0 * radius) / slant + 1e-3,
                "pixel {pixel}: {off} off the sphere"
            );
            let facing = planes.normals[pixel].dot(outwards);
            // Within a cell the gradient turns by up to a voxel's angle.
            assert!(
                facing > (1.5f64 / radius).cos(),
                "pixel {pixel}: the normal is off, cosine {facing}"
            );
            assert!(image.rgba[pixel][3] > 0.99, "it is opaque there");
        }
        assert!(seen > 100, "{seen} pixels see the sphere");
    }
}

#[test]
fn a_plane_is_exact_in_any_grid() {
    let grid = sheared_grid();
    let (normal, offset) = (DVec3::new(0.4, -0.5, 0.768), 9.0);
    let half = volume([24, 26, 22], grid, |p| {
        offset - normal.dot(grid.transform_point3(p))
    });
    let middle = grid.transform_point3(DVec3::new(11.0, 12.0, 10.0));
    let camera = perspective(
        middle + 60.0 * normal + DVec3::new(9.0, 4.0, 0.0),
        middle,
        16.0,
        [24, 24],
    );
    let look = transfer(&[(0.0, [1.0; 3])], &[(0.0, 0.0), (1e-9, 0.3)]);
    let (planes, _) = planes(&half, &look, &RenderOptions::default(), &camera);
    // The transfer function is a table of 4096 entries over the scalars that it shows; the scalar is the distance.
    let tolerance = half.value_range().1 / 4095.0 + 1e-3;
    let mut seen = 0;
    for (pixel, &first) in planes.first.iter().enumerate() {
        let hit = on_ray(&camera, pixel, f64::from(first));
        let local = grid.inverse().transform_point3(hit);
        let inside =
            local.cmpgt(DVec3::splat(0.6)).all() && local.cmplt(DVec3::new(22.4, 24.4, 20.4)).all();
        if !first.is_finite() || !inside {
            continue;
        }
        seen += 1;
        let off = (normal.dot(hit) - offset).abs();
        assert!(
            off < tolerance,
            "pixel {pixel}: {hit} is {off} off the plane"
        );
        let unit = planes.normals[pixel] / planes.normals[pixel].length();
        assert!(
            unit.dot(normal.normalize()) > 1.0 - 1e-6,
            "pixel {pixel}: faces {unit}"
        );
        // Weighted like a colour: one minus 0.7 to the power of the way through the volume, in opacity units.
        let step = on_ray(&camera, pixel, f64::from(first) + 1.0) - hit;
        let step_in_grid = grid.inverse().transform_vector3(step);
        let ends =
            ((-local) / step_in_grid).max((DVec3::new(23.0, 25.0, 21.0) - local) / step_in_grid);
        let wanted =
            1.0 - 0.7f64.powf(ends.min_element() * step.length() / half.smallest_spacing());
        let length = planes.normals[pixel].length();
        // One sheet more or less, half a unit long at right angles; a ray ends at a transmittance of 1/512.
        assert!(
            (length - wanted).abs() < 0.25 * (1.0 - wanted) + 1.0 / 512.0,
            "pixel {pixel}: {length}, {wanted}"
        );
    }
    assert!(seen > 60, "{seen} pixels see the plane");
}

#[test]
fn samples_are_the_sheets_that_a_ray_meets() {
    let fog = volume([17, 17, 17], DAffine3::IDENTITY, |_| 0.5);
    let middle = DVec3::splat(8.0);
    let camera = orthographic(middle - 40.0 * DVec3::Z, middle, 8.0, [4, 4]);
    let options = with_field(RenderOptions::default(), |field| field.slab_voxels = 0.25);
    let (thin, _) = planes(&fog, &coloured(0.02), &options, &camera);
    assert!(
        thin.samples.iter().all(|&n| (n - 64.0).abs() <= 1.0),
        "16 voxels at 4 a voxel: {:?}",
        thin.samples
    );
    assert!(
        thin.first.iter().all(|z| (z - 32.0).abs() < 0.01),
        "its face is 32 away: {:?}",
        thin.first
    );
    let (dense, _) = planes(
        &fog,
        &transfer(&[(0.0, [1.0; 3])], &[(0.0, 1.0)]),
        &options,
        &camera,
    );
    assert!(
        dense.samples.iter().all(|&n| n == 1.0),
        "an opaque ray ends at once: {:?}",
        dense.samples
    );
    let planes_at = vec![ClipPlane {
        normal: DVec3::Z,
        offset: 5.3,
    }];
    let cut = RenderOptions {
        clip: Clip {
            planes: planes_at,
            ..Clip::default()
        },
        ..options
    };
    let (cut, _) = planes(&fog, &coloured(0.02), &cut, &camera);
    assert!(
        cut.first.iter().all(|z| (z - 37.3).abs() < 0.01),
        "the cut is the first hit: {:?}",
        cut.first
    );
}

/// The depths before which half of a pixel's opacity lies, camera z.
fn medians(scalars: &Volume, look: &TransferFunction, slab_voxels: f64) -> Vec<f32> {
    let middle = DVec3::splat(8.0);
    let camera = orthographic(middle - 40.0 * DVec3::Z, middle, 8.0, [4, 4]);
    let options = with_field(RenderOptions::default(), |field| {
        field.slab_voxels = slab_voxels
    });
    let mut renderer = Renderer::new(scalars, look, &options).expect("valid options");
    let mut planes = renderer
        .layers(&camera, &[Layer::MedianDepth])
        .expect("a plane");
    assert_eq!(planes[0].name, "depth.median", "channel");
    planes.remove(0).values
}

#[test]
fn half_of_the_opacity_lies_before_the_median_depth() {
    let fog = volume([17, 17, 17], DAffine3::IDENTITY, |_| 0.5);
    for opacity in [0.02f64, 0.3] {
        // The fog has half of the greatest opacity.
        let passed = |voxels: f64| (1.0 - 0.5 * opacity).powf(voxels);
        let half = (0.5 * (1.0 + passed(16.0))).ln() / passed(1.0).ln();
        for slab_voxels in [0.125, 0.25, 1.0] {
            let found = medians(&fog, &coloured(opacity), slab_voxels);
            // The last sheets of a ray are cut at its end: less than one is in doubt at either side.
            assert!(
                found
                    .iter()
                    .all(|&z| (f64::from(z) - 32.0 - half).abs() < 0.6 * slab_voxels),
                "half of {opacity} lies before {half}: {found:?}"
            );
        }
    }
    let nothing = medians(&fog, &coloured(0.0), 0.25);
    assert!(nothing.iter().all(|&z| z == f32::INFINITY), "{nothing:?}");
    // A veil that takes a tenth, and a wall behind it at z = 10: the wall is chosen, at every thickness.
    let veiled = volume([17, 17, 17], DAffine3::IDENTITY, |p| {
        if p.z < 10.0 { 0.25 } else { 0.75 }
    });
    let look = transfer(&[(0.0, [1.0; 3])], &[(0.0, 0.01), (0.7, 0.01), (0.75, 1.0)]);
    for slab_voxels in [0.125, 0.25, 1.0] {
        let found = medians(&veiled, &look, slab_voxels);
        assert!(
            found.iter().all(|&z| (z - 42.0).abs() < 1.1),
            "{found:?} is not the wall"
        );
    }
}

#[test]
fn other_ways_of_drawing_say_that_they_have_none() {
    let fog = volume([9, 9, 9], DAffine3::IDENTITY, |_| 0.5);
    let camera = perspective(DVec3::new(4.0, 4.0, -20.0), DVec3::splat(4.0), 30.0, [4, 4]);
    let options = RenderOptions::every_sample();
    let mut renderer = Renderer::new(&fog, &coloured(0.5), &options).expect("valid options");
    let complaint = renderer
        .layers(&camera, &ALL)
        .expect_err("no cells")
        .to_string();
    assert!(complaint.contains("first hits"), "{complaint}");
    assert!(
        renderer
            .layers(&camera, &[])
            .expect("nothing was asked for")
            .is_empty(),
        "no planes"
    );
}

/// The selection plane, and the picture painted by selection, of the paper's way from this far.
fn selection(distance: f64, size: [u32; 2]) -> (Vec<f32>, Image) {
    let fog = volume([24, 24, 24], DAffine3::IDENTITY, |_| 0.5);
    let look = transfer(&[(0.0, [0.0, 1.0, 0.0])], &[(0.0, 0.1), (1.0, 0.1)]);
    let camera = perspective(
        DVec3::new(11.5, 11.5, -distance),
        DVec3::splat(11.5),
        30.0,
        size,
    );
    let options = with_samples(RenderOptions::paper(), |samples| {
        samples.colour_by = ColourBy::Select
    });
    let mut renderer = Renderer::new(&fog, &look, &options).expect("valid options");
    let planes = renderer
        .layers(&camera, &[Layer::Selection])
        .expect("a plane");
    assert_eq!(planes[0].name, "selection", "channel");
    (
        planes[0].values.clone(),
        renderer.render(&camera).expect("a valid camera").image,
    )
}

#[test]
fn selection_is_the_share_of_points() {
    for (distance, size) in [(300.0, [16, 16]), (5.0, [64, 64]), (60.0, [64, 64])] {
        let (shares, image) = selection(distance, size);
        for (share, [red, green, ..]) in shares.iter().zip(&image.rgba) {
            // Painted red, splats give no green: the picture itself shows the shares.
            let expected = if red + green > 0.0 {
                green / (red + green)
            } else {
                0.0
            };
            assert!(
                (share - expected).abs() < 1e-5,
                "{distance} away: {share} is not {expected}"
            );
        }
    }
    let most = |shares: &[f32]| shares.iter().copied().fold(0.0, f32::max);
    let (far, near) = (selection(300.0, [16, 16]).0, selection(5.0, [64, 64]).0);
    assert!(
        (most(&far) - 1.0).abs() < 1e-5,
        "all are points from far away: {}",
        most(&far)
    );
    assert_eq!(most(&near), 0.0, "all are splats close by");
}
