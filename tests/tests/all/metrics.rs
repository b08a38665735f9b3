//! The metrics on real truth pictures: reading them, and agreement with other programs on real content.
//!
//! Takes the volume truths of the data folder, and is skipped visibly without them. The picture with one ray per pixel
//! is compared with the antialiased one. The expected figures come from NumPy 2.4 in f64, scikit-image 0.26.0 on
//! float64 arrays and flip-evaluator 1.7 (f32), all on the same files, which OpenEXR 3.5 for Python had read.

use resample_core::Image;
use resample_core::metrics::{Mask, compare};
use resample_io::rendered;
use resample_tests::data::data_file;

/// Figures of one point picture against its area picture.
struct Expected {
    scene: &'static str,
    inside_count: usize,
    psnr_db: f64,
    psnr_inside_db: f64,
    alpha_psnr_db: f64,
    p999_inside: f64,
    max_abs: f64,
    ssim: f64,
    ssim_inside: f64,
    flip: f64,
    flip_inside: f64,
}

const ENGINE_FAR: Expected = Expected {
    scene: "engine_far",
    inside_count: 8161,
    psnr_db: 48.9244046400558,
    psnr_inside_db: 36.00074931585278,
    alpha_psnr_db: 48.438110888241255,
    p999_inside: 0.14938061892986298,
    max_abs: 0.15771737694740295,
    ssim: 0.9993911440259605,
    ssim_inside: 0.9900352798326462,
    flip: 0.0014683849876746535,
    flip_inside: 0.020623777,
};

const ANEURISM_CLOSE: Expected = Expected {
    scene: "aneurism_close",
    inside_count: 58967,
    psnr_db: 42.40534110685333,
    psnr_inside_db: 38.07128212613888,
    alpha_psnr_db: 38.923772760967886,
    p999_inside: 0.08218512272834776,
    max_abs: 0.11777594685554504,
    ssim: 0.9980298072670593,
    ssim_inside: 0.9964521731645296,
    flip: 0.017184950411319733,
    flip_inside: 0.030349975,
};

#[test]
fn point_against_area_agrees_with_other_programs() {
    for expected in [ENGINE_FAR, ANEURISM_CLOSE] {
        let Some((point, area)) = truth_pair(expected.scene) else {
            return;
        };
        check(&expected, &point, &area);
    }
}

/// The point and the area picture of a scene, or `None` where the data is absent.
fn truth_pair(scene: &str) -> Option<(Image, Image)> {
    let read = |kind: &str| {
        let path = data_file(
            "metrics on truths",
            &format!("volume-truth/{scene}_400_{kind}.exr"),
        )?;
        Some(rendered::read(&path).expect("a truth picture must be readable"))
    };
    Some((read("point")?, read("area")?))
}

fn check(expected: &Expected, point: &Image, area: &Image) {
    assert_eq!(
        (point.width, point.height),
        (400, 400),
        "{}: size",
        expected.scene
    );
    let mask = Mask::from_alpha(area);
    let whole = compare(point, area, None).expect("valid pair");
    let inside = compare(point, area, Some(&mask)).expect("valid pair");
    assert_eq!(
        inside.pixel_count, expected.inside_count,
        "{}: pixels inside",
        expected.scene
    );
    // The tolerances are the printed digits for f64 programs, and 1e-4 for FLIP, whose reference computes in f32.
    let figures = [
        ("PSNR", whole.psnr_db, expected.psnr_db, 1e-8),
        ("PSNR inside", inside.psnr_db, expected.psnr_inside_db, 1e-8),
        (
            "PSNR of alpha",
            whole.alpha_psnr_db,
            expected.alpha_psnr_db,
            1e-8,
        ),
        (
            "99.9th percentile inside",
            inside.p999_abs,
            expected.p999_inside,
            1e-8,
        ),
        ("maximum", whole.max_abs, expected.max_abs, 1e-12),
        ("SSIM", whole.ssim, expected.ssim, 1e-9),
        ("SSIM inside", inside.ssim, expected.ssim_inside, 1e-9),
        ("FLIP", whole.flip.mean, expected.flip, 1e-4),
        ("FLIP inside", inside.flip.mean, expected.flip_inside, 1e-4),
    ];
    for (name, found, wanted, tolerance) in figures {
        assert!(
            (found - wanted).abs() < tolerance,
            "{}: {name} is {found}, not {wanted}",
            expected.scene
        );
    }
}
