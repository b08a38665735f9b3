//! No popping (the paper, Figure 7): a box of checkers turns through 45 degrees in 64 steps, and no frame differs from
//! the one before by much more than its neighbours do. Sheets aligned to a volume axis jump where the axis that faces
//! the eye changes, as they must: that shows that the measure sees it. Sheets aligned to the image, and samples in depth
//! order, have nothing that changes there.

use resample_core::KernelShape;
use resample_tests::choices::with_samples;
use resample_tests::volumes::popping::{Changes, STEPS, Turn, checkers};
use volsplat::RenderOptions;

/// What a jump would be: largest over median change from frame to frame.
const JUMP: f64 = 1.5;

/// What axis-aligned sheets must show at least.
const SPIKE: f64 = 3.0;

fn changes(name: &str, options: &RenderOptions) -> Changes {
    let (volume, look) = checkers(25);
    let changes = Changes::measure((&volume, &look), &Turn::around_unit_box(96), options);
    let Changes {
        median,
        largest,
        at,
    } = changes;
    println!(
        "{name}: median {median:.2e}, largest {largest:.2e} at step {at}, ratio {:.2}",
        changes.ratio()
    );
    assert!(median > 1e-4, "{name}: nothing moves, so nothing is tested");
    changes
}

fn hold_smooth(name: &str, options: &RenderOptions) {
    let ratio = changes(name, options).ratio();
    assert!(
        ratio < JUMP,
        "{name}: a frame differs {ratio} times as much as usual from the one before"
    );
}

#[test]
fn image_sheets_do_not_pop() {
    hold_smooth("image sheets", &RenderOptions::default());
}

#[test]
fn every_sample_does_not_pop() {
    hold_smooth("every sample", &RenderOptions::every_sample());
    hold_smooth("every sample, voxels", &RenderOptions::paper());
}

#[test]
fn axis_sheets_pop_at_45_degrees() {
    let polynomial = changes("axis sheets, polynomial", &RenderOptions::axis_sheets()).ratio();
    assert!(
        polynomial > JUMP,
        "axis-aligned sheets must jump, but the ratio is {polynomial}"
    );
    // Westover's own kernel, with which they jump higher.
    let gaussian = with_samples(RenderOptions::axis_sheets(), |samples| {
        samples.kernel = KernelShape::Gaussian
    });
    let changes = changes("axis sheets", &gaussian);
    assert!(
        changes.ratio() > SPIKE,
        "axis-aligned sheets must jump, but the ratio is {}",
        changes.ratio()
    );
    // The eye is above the box, so that the axes change places a little off the middle of the turn.
    let off = changes.at.abs_diff(STEPS / 2);
    assert!(
        off <= 2,
        "the jump is expected at 45 degrees, but it is {off} steps away"
    );
}
