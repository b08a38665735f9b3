//! Checks that a picture, its depth and its camera agree.

use std::path::Path;

use glam::{DMat3, DVec2, DVec3};
use resample_core::camera::PixelCentre;
use resample_core::{Camera, Intrinsics};

use super::*;

fn refused<T: std::fmt::Debug>(result: Result<T, Error>, path: &Path, named: &str) {
    let said = result.expect_err("must be refused").to_string();
    assert!(
        said.starts_with(&path.display().to_string()),
        "the file is not named: {said}"
    );
    assert!(
        said.contains(named),
        "expected a word on '{named}', got: {said}"
    );
    assert!(!said.contains('\n'), "one line: {said}");
}

fn camera(width: u32, height: u32) -> Camera {
    let pixel_centre = PixelCentre::Half;
    let k = Intrinsics {
        width,
        height,
        fx: 4.0,
        fy: 4.0,
        cx: 1.5,
        cy: 1.0,
        pixel_centre,
    };
    Camera::from_intrinsics(&k, DMat3::IDENTITY, DVec3::ZERO, 0.1).expect("a good camera")
}

#[test]
fn sizes_must_agree_and_something_must_be_known() {
    let picture = |coverage| Picture {
        width: 3,
        height: 2,
        rgb: vec![[0.5; 3]; 6],
        coverage,
    };
    let plane = |width: usize, values: Vec<f32>| Plane {
        width,
        height: 2,
        values,
        stored: Stored::Float,
    };
    let meaning = DepthMeaning::of(DepthKind::Z);
    let file = Path::new("z.pfm");
    let all = |picture: Picture, plane: Plane, camera: Camera| {
        reference(picture, &plane, camera, &meaning, file)
    };
    let good = all(
        picture(Some(vec![1.0, 0.4, 0.5, 1.0, 0.0, 1.0])),
        plane(3, vec![2.0; 6]),
        camera(3, 2),
    );
    let known: Vec<bool> = good
        .expect("a good view")
        .depth
        .iter()
        .map(|z| !z.is_nan())
        .collect();
    assert_eq!(
        known,
        [true, false, true, true, false, true],
        "depth is known where the pixel is half covered"
    );
    refused(
        all(picture(None), plane(2, vec![2.0; 4]), camera(3, 2)),
        file,
        "2x2",
    );
    refused(
        all(picture(None), plane(3, vec![-1.0; 6]), camera(3, 2)),
        file,
        "no pixel",
    );
    let said = all(picture(None), plane(3, vec![2.0; 6]), camera(6, 4))
        .expect_err("sizes differ")
        .to_string();
    assert!(
        said.contains("6x4") && said.contains("3x2"),
        "both sizes: {said}"
    );
}

/// The ray that a lens puts at `distorted`, by fixed-point iteration.
fn undistort(distortion: &Distortion, distorted: DVec2) -> DVec2 {
    let mut at = distorted;
    for _ in 0..100 {
        at += distorted - distortion.distort(at).expect("within reach");
    }
    at
}

#[test]
fn distances_along_the_ray_are_those_of_the_undistorted_ray() {
    let taken = Camera {
        fx: 120.0,
        fy: 120.0,
        cx: 80.0,
        cy: 60.0,
        ..camera(160, 120)
    };
    let distortion = Distortion::new([0.1, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 2]);
    // A tilted wall.
    let z = |ray: DVec2| 3.0 / (1.0 - 0.4 * ray.x + 0.2 * ray.y);
    let pinhole = |index: usize| {
        let pixel = DVec2::new((index % 160) as f64, (index / 160) as f64) + 0.5;
        (pixel - DVec2::new(80.0, 60.0)) / 120.0
    };
    let stored = |index: usize| {
        let ray = undistort(distortion.as_ref().expect("distorted"), pinhole(index));
        (z(ray) * ray.extend(1.0).length()) as f32
    };
    let plane = Plane {
        width: 160,
        height: 120,
        values: (0..160 * 120).map(stored).collect(),
        stored: Stored::Float,
    };
    let picture = Picture {
        width: 160,
        height: 120,
        rgb: vec![[0.5; 3]; 160 * 120],
        coverage: None,
    };
    let with = Taken {
        camera: taken,
        distortion,
    };
    let meaning = DepthMeaning::of(DepthKind::Ray);
    let found = reference(picture, &plane, with, &meaning, Path::new("ray.exr")).expect("good");
    let known = || found.depth.iter().enumerate().filter(|(_, z)| !z.is_nan());
    assert!(
        known().count() > 160 * 120 * 8 / 10,
        "most of the picture is known"
    );
    for (index, &depth) in known() {
        let expected = z(pinhole(index));
        assert!(
            (f64::from(depth) / expected - 1.0).abs() < 1e-4,
            "{depth}, not {expected}"
        );
    }
}
