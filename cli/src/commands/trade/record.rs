//! The rows of the report, as JSON and as CSV.
//!
//! `trade.json` is written again after every setting, so that an interrupted run loses one setting at most.

use std::path::Path;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// A whole measurement.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
pub(super) struct Report {
    /// Version, date, machine, threads.
    pub(super) heading: String,
    /// The measured command without any setting, as it is typed.
    pub(super) command: String,
    /// The reference of the errors.
    pub(super) reference: String,
    /// Frames of each setting.
    pub(super) reps: u16,
    /// Combinations that the application refuses.
    pub(super) left_out: usize,
    /// One row per setting.
    pub(super) rows: Vec<Row>,
}

/// One setting.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
pub(super) struct Row {
    /// Its changes.
    pub(super) name: String,
    /// Its ladder.
    pub(super) group: String,
    /// The command, as it is typed.
    pub(super) command: String,
    /// Cost.
    pub(super) cost: Cost,
    /// Errors; infinite PSNR is left out.
    pub(super) error: Map<String, Value>,
    /// Counts of the frame: the same on every machine.
    pub(super) counts: Map<String, Value>,
    /// The picture, a file beside the report.
    pub(super) picture: String,
    /// Its FLIP error, a file beside the report.
    pub(super) heatmap: String,
    /// True if no other setting is both faster and nearer (CPU time, RMSE).
    #[serde(default)]
    pub(super) pareto: bool,
}

/// The cost of a setting.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
pub(super) struct Cost {
    /// Elapsed time of a frame, warm, ms: the median ratio to the default's frames beside it, times the default's.
    pub(super) wall_ms: f64,
    /// CPU time of all threads, likewise.
    pub(super) cpu_ms: f64,
    /// Half the distance of the quartiles of the ratio, over the ratio.
    pub(super) spread: f64,
    /// Elapsed time from nothing to the first picture, cold: reading, preparing, drawing once, ms.
    pub(super) cold_ms: f64,
    /// Most memory of a process that reads, prepares, and draws once, bytes; none where the system does not tell.
    pub(super) peak_bytes: Option<u64>,
}

/// Columns of the error in a row, in the order of the tables.
pub(super) const ERRORS: [&str; 9] = [
    "rmse", "psnr", "max", "p99", "p999", "ssim", "flip", "flip-max", "flicker",
];

impl Report {
    /// The rows that an earlier run of the same command left in `folder`, if there are any.
    pub(super) fn earlier(folder: &Path, command: &str) -> Result<Vec<Row>> {
        let path = folder.join("trade.json");
        if !path.exists() {
            return Ok(Vec::new());
        }
        let unusable = || {
            format!(
                "{}: not a report of trade; remove it or leave --resume out",
                path.display()
            )
        };
        let text = resample_io::files::read_text(&path).with_context(unusable)?;
        let report: Self = serde_json::from_str(&text).with_context(unusable)?;
        Ok(if report.command == command {
            report.rows
        } else {
            Vec::new()
        })
    }

    /// Marks the rows that no other beats in both CPU time and error.
    pub(super) fn mark_front(&mut self) {
        let at: Vec<(f64, f64)> = self
            .rows
            .iter()
            .map(|row| (row.cost.cpu_ms, row.rmse()))
            .collect();
        for (row, &(time, error)) in self.rows.iter_mut().zip(&at) {
            let beaten = at
                .iter()
                .any(|&(t, e)| t <= time && e <= error && (t < time || e < error));
            row.pareto = !beaten;
        }
    }

    /// The rows as comma-separated values.
    pub(super) fn csv(&self) -> String {
        let mut text = String::from("name,group,pareto,cpu_ms,wall_ms,spread,cold_ms,peak_bytes");
        ERRORS.iter().for_each(|name| text += &format!(",{name}"));
        text += ",command\n";
        for row in &self.rows {
            let Cost {
                wall_ms,
                cpu_ms,
                spread,
                cold_ms,
                peak_bytes,
            } = &row.cost;
            let peak = peak_bytes.map_or(String::new(), |bytes| bytes.to_string());
            let name = quoted(&row.name);
            text += &format!(
                "{name},{},{},{cpu_ms:.4},{wall_ms:.4},{spread:.4},{cold_ms:.2},{peak}",
                row.group, row.pareto
            );
            for name in ERRORS {
                let value = row.error.get(name).and_then(Value::as_f64);
                text += &value.map_or(",".into(), |value| format!(",{value}"));
            }
            text += &format!(",{}\n", quoted(&row.command));
        }
        text
    }
}

impl Row {
    /// Root mean square error.
    pub(super) fn rmse(&self) -> f64 {
        self.error
            .get("rmse")
            .and_then(Value::as_f64)
            .unwrap_or(f64::INFINITY)
    }
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(name: &str, cpu_ms: f64, rmse: f64) -> Row {
        let error = Map::from_iter([("rmse".to_owned(), Value::from(rmse))]);
        Row {
            name: name.into(),
            cost: Cost {
                cpu_ms,
                ..Cost::default()
            },
            error,
            ..Row::default()
        }
    }

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let rows = vec![
            row("fast", 1.0, 0.5),
            row("good", 5.0, 0.1),
            row("bad", 6.0, 0.2),
            row("same", 5.0, 0.1),
        ];
        let mut report = Report {
            rows,
            ..Report::default()
        };
        report.mark_front();
        let front: Vec<&str> = report
            .rows
            .iter()
            .filter(|r| r.pareto)
            .map(|r| r.name.as_str())
            .collect();
        assert_eq!(front, ["fast", "good", "same"]);
    }

    #[test]
    fn the_table_quotes_what_holds_commas() {
        let report = Report {
            rows: vec![row("a, \"b\"", 1.0, 0.5)],
            ..Report::default()
        };
        let csv = report.csv();
        let line = csv.lines().nth(1).expect("one row");
        assert!(
            line.starts_with("\"a, \"\"b\"\"\",,false,1.0000,"),
            "{line}"
        );
    }
}
