//! The verdict of a report in words: what to use, what is quicker, what is nearer, each with its time and its error.
//!
//! Takes the measured rows, gives a few sentences with the row of each. Errors are root mean squares, times CPU times. A row counts
//! as quicker than another only beyond [`SAME_TIME`], so that scatter gives no advice.

use super::record::{Report, Row};

/// An error that no picture of eight bits shows: a step of one.
const UNSEEN: f64 = 1.0 / 255.0;

/// Times that differ by a smaller part than this count as one: a guess, twice the usual scatter of the medians.
const SAME_TIME: f64 = 0.1;

/// One piece of advice.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Advice {
    /// One sentence.
    pub(super) words: String,
    /// The row that it names.
    pub(super) row: usize,
}

/// The advice of a report, the most important first; empty where there is nothing to compare.
pub(super) fn advice(report: &Report) -> Vec<Advice> {
    let rows = &report.rows;
    let Some(default) = rows.iter().position(|row| row.group == "default") else {
        return Vec::new();
    };
    let quickest = |keep: &dyn Fn(&Row) -> bool| {
        let kept = (0..rows.len()).filter(|&index| keep(&rows[index]));
        kept.min_by(|&a, &b| rows[a].cost.cpu_ms.total_cmp(&rows[b].cost.cpu_ms))
    };
    let at_default = rows[default].rmse();
    let better = quickest(&|row| row.rmse() <= at_default)
        .filter(|&index| is_quicker(&rows[index], &rows[default]));
    let used = better.unwrap_or(default);
    let mut all = vec![Advice {
        words: match better {
            Some(_) => format!(
                "{}; the default takes {} for no smaller an error.",
                figures("Use", &rows[used]),
                time(&rows[default])
            ),
            None => format!(
                "{}; no measured setting is quicker without a larger error.",
                figures("Use", &rows[used])
            ),
        },
        row: used,
    }];
    let quicker = quickest(&|row| row.rmse() <= UNSEEN && row.rmse() > rows[used].rmse());
    if let Some(row) = quicker.filter(|&index| is_quicker(&rows[index], &rows[used])) {
        let words = figures("Quicker, below one step of eight bits:", &rows[row]) + ".";
        all.push(Advice { words, row });
    }
    // An error that cannot be seen, where it can be now; else half of it.
    let aim = match rows[used].rmse() {
        error if error > UNSEEN => UNSEEN,
        error => 0.5 * error,
    };
    if let Some(row) = quickest(&|row| row.rmse() <= aim && row.group != "exact") {
        let words = figures("Nearer:", &rows[row]) + ".";
        all.push(Advice { words, row });
    }
    all
}

/// Rows that draw the default's picture in the default's time: no choice in this scene.
pub(super) fn without_effect(report: &Report) -> Vec<&str> {
    let default = report.rows.iter().find(|row| row.group == "default");
    let same = |row: &&Row| {
        default.is_some_and(|default| {
            !["default", "exact"].contains(&row.group.as_str())
                && row.error == default.error
                && !is_quicker(row, default)
                && !is_quicker(default, row)
        })
    };
    let names = report.rows.iter().filter(same);
    names.map(|row| row.name.as_str()).collect()
}

fn is_quicker(row: &Row, than: &Row) -> bool {
    row.cost.cpu_ms < (1.0 - SAME_TIME) * than.cost.cpu_ms
}

fn figures(verb: &str, row: &Row) -> String {
    let name = match row.group.as_str() {
        "default" => "the default".to_owned(),
        "exact" => "the most exact setting".to_owned(),
        _ => format!("\"{}\"", row.name),
    };
    let error = match row.rmse() {
        0.0 => "no error".to_owned(),
        error => format!("error {error:.1e} (1/{:.0})", 1.0 / error),
    };
    format!("{verb} {name}: {} of CPU, {error}", time(row))
}

fn time(row: &Row) -> String {
    format!("{} ms", Significant(row.cost.cpu_ms))
}

/// A number with three significant digits and no exponent.
struct Significant(f64);

impl std::fmt::Display for Significant {
    fn fmt(&self, to: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let digits = (2 - self.0.abs().max(1e-9).log10().floor() as i32).max(0);
        write!(to, "{:.*}", digits as usize, self.0)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Map, Value};

    use super::super::record::Cost;
    use super::*;

    fn row(group: &str, name: &str, cpu_ms: f64, rmse: f64) -> Row {
        Row {
            name: name.into(),
            group: group.into(),
            cost: Cost {
                cpu_ms,
                ..Cost::default()
            },
            error: Map::from_iter([("rmse".to_owned(), Value::from(rmse))]),
            ..Row::default()
        }
    }

    fn sentences(rows: &[Row]) -> Vec<String> {
        let report = Report {
            rows: rows.to_vec(),
            ..Report::default()
        };
        advice(&report)
            .into_iter()
            .map(|found| found.words)
            .collect()
    }

    #[test]
    fn the_default_is_advised_where_nothing_beats_it() {
        let rows = [
            row("default", "default", 40.0, 0.001),
            row("exact", "exact", 900.0, 0.0),
            row("slab", "slab 2", 20.0, 0.003),
            row("slab", "slab 0.5", 80.0, 0.0004),
        ];
        assert_eq!(
            sentences(&rows),
            [
                "Use the default: 40.0 ms of CPU, error 1.0e-3 (1/1000); no measured setting is quicker without a larger error.",
                "Quicker, below one step of eight bits: \"slab 2\": 20.0 ms of CPU, error 3.0e-3 (1/333).",
                "Nearer: \"slab 0.5\": 80.0 ms of CPU, error 4.0e-4 (1/2500).",
            ]
        );
    }

    #[test]
    fn a_setting_that_beats_the_default_is_advised() {
        let rows = [
            row("default", "default", 40.0, 0.01),
            row("slab", "slab 2", 20.0, 0.009),
            row("subpixels", "subpixels 4", 123.4, 0.003),
        ];
        assert_eq!(
            sentences(&rows),
            [
                "Use \"slab 2\": 20.0 ms of CPU, error 9.0e-3 (1/111); the default takes 40.0 ms for no smaller an error.",
                "Nearer: \"subpixels 4\": 123 ms of CPU, error 3.0e-3 (1/333).",
            ]
        );
    }

    #[test]
    fn rows_without_effect_are_those_of_the_default_in_all() {
        let report = Report {
            rows: vec![
                row("default", "default", 40.0, 0.01),
                row("light", "light 0,1,0", 41.0, 0.01),
                row("cells", "cells off", 20.0, 0.01),
            ],
            ..Report::default()
        };
        assert_eq!(without_effect(&report), ["light 0,1,0"]);
    }
}
