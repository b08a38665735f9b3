//! The figures of the paper's table that need no data.

use resample_tests::volumes::papers_table::{ROWS, measured};

#[test]
fn the_checker_box_has_the_papers_counts() {
    let row = ROWS.iter().find(|row| row.name == "Checker Box");
    let figures = measured(row.expect("a row"), 1).expect("a formula");
    assert_eq!(figures.visible, 1_000_000, "all voxels are visible");
    let [splats, mixed, points] = figures.splats;
    assert_eq!((splats, points), (1.0, 0.0), "near and far");
    assert!(
        (mixed - 0.4660).abs() < 0.005,
        "the paper has 46.60 %, found {mixed}"
    );
}
