//! What a picture, its depth and its camera must have in common.

use std::path::Path;

use glam::{DMat3, DVec3};
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
