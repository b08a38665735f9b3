//! The report as one self-contained page: the scatter, the pictures behind each point, the table, the commands.
//!
//! Everything is in the one file: pictures as data, the script and the style as text. The numbers are a JSON block that
//! the script reads; without a script the page still shows the table.

use std::path::Path;

use anyhow::{Context, Result};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use serde_json::{Value, json};

use super::record::{ERRORS, Report, Row};
use super::verdict;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// The page. Pictures are read from `folder`.
pub(super) fn html(report: &Report, folder: &Path) -> Result<String> {
    let idle = verdict::without_effect(report);
    let advice = verdict::advice(report);
    let first = advice.first().map_or(0, |advice| advice.row);
    let shown = |row: &Row| !idle.contains(&row.name.as_str());
    let data = data(report, folder, &shown)?;
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width";
                title { "Speed against accuracy: " (report.command) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { "Speed against accuracy" }
                p { code { (report.command) } }
                p { (report.heading) ". Errors against " (report.reference) ", where it shows something; times are medians over "
                    (report.reps) @if report.reps == 1 { " frame" } @else { " frames" } ", each beside one of the default. "
                    @if report.left_out > 0 { (report.left_out) " combinations exclude each other and were left out." } }
                ul id="verdict" { @for advice in &advice { li data-row=(advice.row) { (advice.words) } } }
                (choices())
                div id="views" {
                    div id="plot" {}
                    div id="detail" data-first=(first) {}
                }
                p { "Choose a point or a row: its picture and its errors are shown." }
                div id="table" { (table(report, &shown)) }
                @if !idle.is_empty() { p { "Without effect on this scene: " (idle.join("; ")) ". Their figures are in trade.csv." } }
                script id="data" type="application/json" { (PreEscaped(data)) }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    Ok(page.into_string())
}

/// The choice of the axes.
fn choices() -> Markup {
    html! {
        form id="axes" {
            label { "Error " select id="error" { @for name in ERRORS { option { (name) } } } }
            label { " Cost " select id="cost" {
                option value="cpu_ms" { "CPU time, ms" }
                option value="wall_ms" { "elapsed time, ms" }
                option value="cold_ms" { "time to the first picture, ms" }
                option value="peak_bytes" { "memory, bytes" }
            } }
        }
    }
}

/// Columns that a narrow screen leaves out.
const WIDE_ONLY: &str = "wide";

fn table(report: &Report, shown: &impl Fn(&Row) -> bool) -> Markup {
    html! {
        table {
            thead { tr {
                th { "setting" } th class=(WIDE_ONLY) { "ladder" } th { "front" } th { "CPU ms" }
                @for name in ["± %", "cold ms", "MB"] { th class=(WIDE_ONLY) { (name) } }
                @for name in ERRORS { th class=[class(name)] { (name) } }
            } }
            tbody { @for (index, row) in report.rows.iter().enumerate().filter(|(_, row)| shown(row)) { (line(index, row)) } }
        }
    }
}

fn line(index: usize, row: &Row) -> Markup {
    let number = |name: &str| {
        row.error
            .get(name)
            .and_then(Value::as_f64)
            .map(short)
            .unwrap_or_default()
    };
    html! {
        tr data-row=(index) {
            td { (row.name) } td class=(WIDE_ONLY) { (row.group) }
            td { @if row.pareto { "●" } }
            td { (format!("{:.2}", row.cost.cpu_ms)) }
            td class=(WIDE_ONLY) { (format!("{:.0}", 100.0 * row.cost.spread)) }
            td class=(WIDE_ONLY) { (format!("{:.0}", row.cost.cold_ms)) }
            td class=(WIDE_ONLY) { @if let Some(bytes) = row.cost.peak_bytes { (format!("{:.1}", bytes as f64 / 1e6)) } }
            @for name in ERRORS { td class=[class(name)] { (number(name)) } }
        }
    }
}

/// The class of an error's column; a narrow screen shows two.
fn class(error: &str) -> Option<&'static str> {
    (!["rmse", "psnr"].contains(&error)).then_some(WIDE_ONLY)
}

fn short(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-3 {
        format!("{value:.1e}")
    } else {
        format!("{value:.4}")
    }
}

/// The rows with their pictures, as JSON that may stand in a script block.
fn data(report: &Report, folder: &Path, shown: &impl Fn(&Row) -> bool) -> Result<String> {
    let mut rows = Vec::with_capacity(report.rows.len());
    for (index, row) in report.rows.iter().enumerate().filter(|(_, row)| shown(row)) {
        let mut value = serde_json::to_value(row)?;
        value["index"] = json!(index);
        for (key, name) in [("picture", &row.picture), ("heatmap", &row.heatmap)] {
            let path = folder.join(name);
            let bytes = std::fs::read(&path)
                .with_context(|| format!("{}: cannot be read", path.display()))?;
            value[key] = json!(format!("data:image/png;base64,{}", STANDARD.encode(bytes)));
        }
        rows.push(value);
    }
    // A closing tag inside a string would end the block.
    Ok(serde_json::to_string(&rows)?.replace("</", "<\\/"))
}
