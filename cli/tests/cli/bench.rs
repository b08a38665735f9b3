//! `resample bench`: tables on stdout.

use super::{Bench, stderr};

#[test]
fn the_papers_table_has_the_checker_box_without_any_data() {
    let bench = Bench::new();
    let output = bench.run("bench paper --reps 1 --pictures out --quiet");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let text = String::from_utf8_lossy(&output.stdout);
    let row = text
        .lines()
        .find(|line| line.starts_with("| Checker Box "))
        .expect("the row of the formula");
    assert!(
        row.contains("1000000 (1000000)"),
        "all voxels are visible: {row}"
    );
    // The share of splats in the mixed view is the paper's 46.60 % to half a percent.
    let share: f64 = row
        .split(", ")
        .nth(1)
        .and_then(|s| s.split(" %").next()?.parse().ok())
        .expect("a share");
    assert!((share - 46.60).abs() < 0.5, "{row}");
    assert!(
        text.contains("Left out, because no file was found: Engine, Lobster, Aneurism, Skull"),
        "{text}"
    );
    let names = [
        "checker-box-all-points.png",
        "checker-box-all-splats.png",
        "checker-box-mixed.png",
    ];
    assert_eq!(bench.written(), names);
}

#[test]
fn a_folder_that_is_not_there_is_refused() {
    let bench = Bench::new();
    let output = bench.run("bench paper --data absent");
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("absent"), "{}", stderr(&output));
}

#[test]
fn tables_over_built_in_scenes_have_a_row_for_each_setting() {
    let bench = Bench::new();
    for (table, rows) in [
        ("footprint", 12),
        ("orders", 15),
        ("texture", 8),
        ("warp", 6),
    ] {
        let output = bench.run(&format!("bench {table} --reps 1 --size 48x36 --quiet"));
        assert_eq!(
            output.status.code(),
            Some(0),
            "{table}: {}",
            stderr(&output)
        );
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(
            text.starts_with("resample "),
            "{table}: version, date and machine come first: {text}"
        );
        let found = text
            .lines()
            .filter(|line| line.starts_with("| `--"))
            .count();
        assert_eq!(found, rows, "{table}: {text}");
        let same = text
            .lines()
            .filter(|line| line.contains("| same |"))
            .count();
        assert!(
            table != "footprint" || same >= 2,
            "the exact footprint is its own reference: {text}"
        );
    }
}
