//! `resample bench`: tables on stdout.

use super::{Bench, stderr};

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
