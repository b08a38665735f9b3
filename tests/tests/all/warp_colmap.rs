//! Lens distortion against COLMAP's own undistortion of a real model.
//!
//! The model and its undistorted twin hold the same points in the same order, each in its own pixels. So the twin's
//! pinhole and our reading of the lens must lead from a point of the twin to the point of the model.

use glam::DVec2;
use resample_tests::data::data_file;
use warp3d::input::cameras::{self, Hints};

/// The points of every image of `images.bin`, px.
fn points(bytes: &[u8]) -> Vec<Vec<DVec2>> {
    let number = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().expect("8 bytes"));
    let count = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().expect("8 bytes"));
    let mut at = 8;
    let mut images = Vec::new();
    for _ in 0..count(0) {
        // Number, pose and camera, then the name up to its zero byte.
        at += 4 + 7 * 8 + 4;
        at += bytes[at..]
            .iter()
            .position(|&byte| byte == 0)
            .expect("an end")
            + 1;
        let points = (0..count(at) as usize)
            .map(|i| DVec2::new(number(at + 8 + 24 * i), number(at + 16 + 24 * i)))
            .collect();
        at += 8 + 24 * count(at) as usize;
        images.push(points);
    }
    images
}

#[test]
fn the_points_of_a_model_and_of_its_undistorted_twin_agree() {
    let test = "the_points_of_a_model_and_of_its_undistorted_twin_agree";
    let Some(curved) = data_file(test, "found/colmap/sparse/0/images.bin") else {
        return;
    };
    let Some(plain) = data_file(test, "found/colmap/dense/0/sparse/images.bin") else {
        return;
    };
    let read = |path: &std::path::Path| {
        let set = cameras::read(path, &Hints::default()).expect("a good model");
        let bytes = std::fs::read(path).expect("readable");
        (set.expect("a known format").entries, points(&bytes))
    };
    let ((curved, curved_points), (plain, plain_points)) = (read(&curved), read(&plain));
    assert_eq!((curved.len(), plain.len()), (23, 23), "images");
    let (mut worst, mut compared) = (0.0f64, 0);
    for (index, (curved, plain)) in curved.iter().zip(&plain).enumerate() {
        assert_eq!(curved.name, plain.name);
        let distortion = curved.distortion.expect("SIMPLE_RADIAL");
        assert_eq!(plain.distortion, None, "PINHOLE");
        let (from, to) = (&plain.camera, &curved.camera);
        for (&seen, &expected) in plain_points[index].iter().zip(&curved_points[index]) {
            let ray = (seen - DVec2::new(from.cx, from.cy)) / DVec2::new(from.fx, from.fy);
            let put = distortion.distort(ray).expect("within reach");
            let found = put * DVec2::new(to.fx, to.fy) + DVec2::new(to.cx, to.cy);
            worst = worst.max((found - expected).length());
            compared += 1;
        }
    }
    println!("{compared} points, worst {worst:.2e} px of 3031 x 2006");
    assert!(compared > 10_000, "{compared} points");
    // COLMAP's own inverse is iterative, to about 1e-10 of the tangent.
    assert!(worst < 1e-3, "{worst} px");
}
