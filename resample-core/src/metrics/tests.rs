//! Tests of the plain figures and of what a comparison refuses.

use super::patterns::{HEIGHT, Pattern, WIDTH, disc_mask};
use super::*;

fn close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{what}: {found}, expected {expected}"
    );
}

/// Expected: NumPy 2.4 in f64: `-10 log10(mean(d^2))`, `abs(d).max()`, and `quantile(abs(d).max(-1), 0.999)` for
/// `d = test - reference`, over all pixels and then inside the disc.
#[test]
fn plain_figures_agree_with_numpy() {
    let expected = [
        (
            Pattern::Ramp,
            [17.30303244810662, 0.980392157100141, 0.9735764719191936],
        ),
        (
            Pattern::Checker,
            [10.762601902587, 0.823529414832592, 0.823529414832592],
        ),
        (
            Pattern::Noise,
            [43.076807057019295, 0.01568630337715149, 0.01568630337715149],
        ),
    ];
    let expected_in_disc = [
        [16.711661032564212, 0.9725490212440491, 0.9698196083456276],
        [10.169461890427183, 0.823529414832592, 0.823529414832592],
        [42.99904794212897, 0.01568630337715149, 0.01568630337715149],
    ];
    for ((pattern, whole), inside) in expected.into_iter().zip(expected_in_disc) {
        let (image, reference) = pattern.pair();
        let disc = disc_mask();
        for (mask, [psnr_db, max_abs, p999_abs]) in [(None, whole), (Some(&disc), inside)] {
            let found = compare(&image, &reference, mask).expect("valid pair");
            let what = format!("{pattern:?}, {} pixels", found.pixel_count);
            close(found.psnr_db, psnr_db, 1e-9, &format!("{what}: PSNR"));
            close(
                found.rmse,
                10f64.powf(-psnr_db / 20.0),
                1e-9,
                &format!("{what}: RMSE"),
            );
            close(found.max_abs, max_abs, 1e-12, &format!("{what}: maximum"));
            close(
                found.p999_abs,
                p999_abs,
                1e-9,
                &format!("{what}: 99.9th percentile"),
            );
            let p99_abs = sorted_quantile(&image, &reference, mask, 0.99);
            close(
                found.p99_abs,
                p99_abs,
                1e-12,
                &format!("{what}: 99th percentile"),
            );
        }
    }
}

/// A quantile of the largest colour difference of each pixel, the plain way.
fn sorted_quantile(image: &Image, reference: &Image, mask: Option<&Mask>, quantile: f64) -> f64 {
    let largest = |(a, b): (&[f32; 4], &[f32; 4])| {
        (0..3)
            .map(|k| (f64::from(a[k]) - f64::from(b[k])).abs())
            .fold(0.0, f64::max)
    };
    let mut all: Vec<f64> = image
        .rgba
        .iter()
        .zip(&reference.rgba)
        .map(largest)
        .collect();
    if let Some(mask) = mask {
        let mut inside = mask.inside().iter();
        all.retain(|_| inside.next() == Some(&true));
    }
    all.sort_by(f64::total_cmp);
    let rank = quantile * (all.len() - 1) as f64;
    let (low, high) = (all[rank.floor() as usize], all[rank.ceil() as usize]);
    low + rank.fract() * (high - low)
}

#[test]
fn identical_pictures_are_perfect() {
    let (image, _) = Pattern::Noise.pair();
    let found = compare(&image, &image, None).expect("valid pair");
    assert_eq!(
        found.pixel_count,
        WIDTH * HEIGHT,
        "all pixels count without a mask"
    );
    assert_eq!(
        (found.psnr_db, found.alpha_psnr_db),
        (f64::INFINITY, f64::INFINITY),
        "PSNR must be infinite"
    );
    assert_eq!(
        (found.rmse, found.max_abs, found.p99_abs, found.p999_abs),
        (0.0, 0.0, 0.0, 0.0),
        "no difference"
    );
    assert_eq!(
        (found.flip.mean, found.flip.weighted_median),
        (0.0, 0.0),
        "no FLIP error"
    );
    close(found.ssim, 1.0, 1e-12, "SSIM");
}

#[test]
fn bias_and_alpha_have_their_own_figures() {
    let (image, mut reference) = Pattern::Checker.pair();
    reference.rgba.clone_from(&image.rgba);
    for pixel in &mut reference.rgba {
        pixel[1] -= 0.25;
        pixel[3] -= 0.5;
    }
    let found = compare(&image, &reference, None).expect("valid pair");
    close(
        found.mean_signed,
        0.25 / 3.0,
        1e-7,
        "a quarter in one of three channels",
    );
    close(
        found.alpha_psnr_db,
        20.0 * 2f64.log10(),
        1e-12,
        "half of alpha",
    );
}

#[test]
fn the_alpha_mask_is_the_disc() {
    let (image, _) = Pattern::Ramp.pair();
    assert_eq!(
        Mask::from_alpha(&image),
        disc_mask(),
        "alpha is 1 in the disc and 0 outside"
    );
    assert_eq!(disc_mask().count(), 697, "pixels in the disc");
    let mut steps = Image::transparent(2, 1);
    steps.rgba[0][3] = 1.0 / 255.0;
    steps.rgba[1][3] = 1.5 / 255.0;
    assert_eq!(
        Mask::from_alpha(&steps).inside(),
        [false, true],
        "one step of alpha is still outside"
    );
}

#[test]
fn pictures_that_do_not_fit_are_refused() {
    let (image, reference) = Pattern::Ramp.pair();
    let other = Image::transparent(WIDTH + 1, HEIGHT);
    assert!(
        matches!(
            compare(&image, &other, None),
            Err(MetricsError::SizesDiffer { .. })
        ),
        "other size"
    );
    let mask = Mask::from_alpha(&other);
    assert!(
        matches!(
            compare(&image, &reference, Some(&mask)),
            Err(MetricsError::MaskSizeDiffers { .. })
        ),
        "mask"
    );
    let mask = Mask::from_alpha(&Image::transparent(WIDTH, HEIGHT));
    assert_eq!(
        compare(&image, &reference, Some(&mask)),
        Err(MetricsError::NothingToCompare),
        "empty mask"
    );
    let empty = Image::transparent(0, 0);
    assert_eq!(
        compare(&empty, &empty, None),
        Err(MetricsError::NothingToCompare),
        "empty picture"
    );
    let mut short = image.clone();
    short.rgba.pop();
    assert!(
        matches!(
            compare(&short, &reference, None),
            Err(MetricsError::WrongLength { .. })
        ),
        "short buffer"
    );
    assert!(
        matches!(
            Mask::new(2, 2, vec![true]),
            Err(MetricsError::WrongLength { .. })
        ),
        "short mask"
    );
}

#[test]
fn values_that_are_not_finite_are_refused_with_their_place() {
    let (image, reference) = Pattern::Ramp.pair();
    let mut broken = reference.clone();
    broken.rgba[2 * WIDTH + 5][3] = f32::INFINITY;
    let error = compare(&image, &broken, Some(&disc_mask())).expect_err("infinity must be refused");
    assert!(
        error
            .to_string()
            .starts_with("pixel (5, 2) of the reference is not finite"),
        "message: {error}"
    );
}

#[test]
fn quantile_interpolates_between_ranks() {
    // Five values have ranks 0..=4; quantile 0.9 is rank 3.6, which is 0.6 of the way from 40 to 50.
    let value = interpolated_quantile(&mut [50.0, 10.0, 40.0, 20.0, 30.0], 0.9);
    assert!((value - 46.0).abs() < 1e-12, "quantile {value} is not 46");
    assert_eq!(
        interpolated_quantile(&mut [7.0], 0.999),
        7.0,
        "a single value is every quantile"
    );
    assert_eq!(
        interpolated_quantile(&mut [1.0, 2.0], 1.0),
        2.0,
        "quantile 1 is the maximum"
    );
}

#[test]
fn psnr_of_a_tenth_is_twenty_decibels() {
    assert!(
        (psnr_db(0.01) - 20.0).abs() < 1e-12,
        "a mean square of 0.01 must be 20 dB"
    );
    assert_eq!(
        psnr_db(0.0),
        f64::INFINITY,
        "no difference must be infinite"
    );
}
