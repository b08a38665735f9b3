//! Lines of facts, and numbers as people write them.

use glam::DVec3;

/// A fact: its name and its value.
pub(super) type Line = (&'static str, String);

/// A fact.
pub(super) fn line(name: &'static str, text: impl Into<String>) -> Line {
    (name, text.into())
}

/// Where a box lies along the axes.
pub(super) fn between([low, high]: [DVec3; 2]) -> String {
    let along = |axis: usize| format!("{} to {}", short(low[axis]), short(high[axis]));
    format!("x {}, y {}, z {}", along(0), along(1), along(2))
}

/// The sides of a box.
pub(super) fn sides(size: DVec3) -> String {
    let [x, y, z] = size.to_array().map(short);
    format!("{x} x {y} x {z}")
}

/// Names with their count, the first ones where there are many.
pub(super) fn listed(names: &[String]) -> String {
    /// More would not be read.
    const MOST: usize = 12;
    let mut text = names
        .iter()
        .take(MOST)
        .cloned()
        .collect::<Vec<_>>()
        .join(", ");
    if names.len() > MOST {
        text.push_str(", ...");
    }
    match names.len() {
        0 => "none".to_owned(),
        count => format!("{count}: {text}"),
    }
}

/// A number with up to six significant digits, as people write it.
pub(super) fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    if rounded != 0.0 && !(1e-4..1e9).contains(&rounded.abs()) {
        format!("{rounded:e}")
    } else {
        rounded.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_keep_their_size() {
        for (value, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (0.1 + 0.2, "0.3"),
            (-1023.0, "-1023"),
            (3.437_500_000_000_001, "3.4375"),
            (1.5e-7, "1.5e-7"),
            (2e12, "2e12"),
            (65535.0, "65535"),
        ] {
            assert_eq!(short(value), text, "{value}");
        }
    }

    #[test]
    fn long_lists_end_in_dots() {
        assert_eq!(listed(&[]), "none");
        assert_eq!(listed(&["a".to_owned()]), "1: a");
        let many: Vec<String> = (0..20).map(|i| i.to_string()).collect();
        assert!(listed(&many).starts_with("20: 0, 1") && listed(&many).ends_with("11, ..."));
    }
}
