//! No popping (the paper, Figure 7): a box of checkers turns through 45 degrees in 64 steps, and no frame differs from
//! the one before by much more than its neighbours do. Sheets aligned to a volume axis would jump where the axis that
//! faces the eye changes; sheets aligned to the image, and samples in depth order, have nothing that changes there.

use glam::{DQuat, DVec3};
use resample_core::Image;
use resample_tests::scenes::{perspective, transfer};
use volsplat::procedural::{CHECKER_VALUES, checker_box};
use volsplat::{RenderOptions, Renderer, TransferFunction, Volume};

const STEPS: u32 = 64;

/// From the diagonal on both sides, degrees: the changes of a smooth turn stay alike over so short an arc.
const ARC_DEG: f64 = 16.0;

/// What a jump would be: largest over median change from frame to frame.
const JUMP: f64 = 1.5;

/// Red and white cells, so dense that a change of order would show.
fn checkers() -> (Volume, TransferFunction) {
    let volume = checker_box(25, 5).expect("a good size");
    let [low, high] = CHECKER_VALUES.map(f64::from);
    let look = transfer(&[(low, [0.9, 0.1, 0.1]), (high, [0.9; 3])], &[(low, 0.1), (high, 0.3)]);
    (volume, look)
}

/// Mean absolute difference over all pixels and channels.
fn change(a: &Image, b: &Image) -> f64 {
    let channels = a.rgba.iter().flatten().zip(b.rgba.iter().flatten());
    let sum: f64 = channels.map(|(a, b)| f64::from((a - b).abs())).sum();
    sum / (4 * a.rgba.len()) as f64
}

fn hold_smooth(name: &str, options: &RenderOptions) {
    let (volume, look) = checkers();
    let mut renderer = Renderer::new(&volume, &look, options).expect("valid options");
    let frames: Vec<Image> = (0..=STEPS)
        .map(|step| {
            let angle_deg = 45.0 + ARC_DEG * (2.0 * f64::from(step) / f64::from(STEPS) - 1.0);
            let eye = DQuat::from_rotation_y(angle_deg.to_radians()) * DVec3::new(0.0, 1.3, -5.0);
            renderer.render(&perspective(eye, DVec3::ZERO, 40.0, [96, 96])).expect("a valid camera").image
        })
        .collect();
    let mut changes: Vec<f64> = frames.windows(2).map(|pair| change(&pair[0], &pair[1])).collect();
    changes.sort_by(f64::total_cmp);
    let (median, largest) = (changes[changes.len() / 2], changes[changes.len() - 1]);
    let ratio = largest / median;
    println!("{name}: median change {median:.2e}, largest {largest:.2e}, ratio {ratio:.2}");
    assert!(median > 1e-4, "{name}: nothing moves, so nothing is tested");
    assert!(ratio < JUMP, "{name}: a frame differs {ratio} times as much as usual from the one before");
}

#[test]
fn image_sheets_do_not_pop() {
    hold_smooth("image sheets", &RenderOptions::default());
}

#[test]
fn every_sample_does_not_pop() {
    hold_smooth("every sample", &RenderOptions::every_sample());
}
