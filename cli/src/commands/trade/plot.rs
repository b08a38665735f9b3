//! The scatter of error against time as a picture for papers.

use anyhow::{Result, anyhow};
use kuva::PngBackend;
use kuva::plot::LinePlot;
use kuva::plot::scatter::{MarkerShape, ScatterPlot};
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use kuva::render::render::render_multiple;
use serde_json::Value;

use super::record::{Report, Row};

/// Colours of the groups: Okabe and Ito's eight, told apart with any kind of colour vision.
const COLOURS: [&str; 8] = [
    "#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442", "#000000",
];

/// Shapes of the marks: another one each time that the colours are used up.
const SHAPES: [MarkerShape; 3] = [
    MarkerShape::Circle,
    MarkerShape::Triangle,
    MarkerShape::Square,
];

/// Pixels of the picture per unit of the plot: twice as sharp as a screen needs.
const SCALE: f32 = 2.0;

/// The plot of an error over CPU time as a PNG; `None` where fewer than two settings can be drawn on a logarithmic
/// scale.
pub(super) fn scatter(report: &Report, figure: &str) -> Result<Option<Vec<u8>>> {
    let at = |row: &Row| {
        let error = row.error.get(figure).and_then(Value::as_f64)?;
        (error > 0.0 && row.cost.cpu_ms > 0.0).then_some((row.cost.cpu_ms, error))
    };
    let mut front: Vec<(f64, f64)> = report
        .rows
        .iter()
        .filter(|row| row.pareto)
        .filter_map(at)
        .collect();
    front.sort_by(|a, b| a.0.total_cmp(&b.0));
    if report.rows.iter().filter_map(at).count() < 2 {
        return Ok(None);
    }
    let mut plots = vec![Plot::Line(
        LinePlot::new().with_data(front).with_color("#999999"),
    )];
    let mut groups: Vec<&str> = report.rows.iter().map(|row| row.group.as_str()).collect();
    groups.dedup();
    for (index, group) in groups.iter().enumerate() {
        let points: Vec<(f64, f64)> = report
            .rows
            .iter()
            .filter(|row| row.group == *group)
            .filter_map(at)
            .collect();
        if !points.is_empty() {
            let scatter = ScatterPlot::new()
                .with_data(points)
                .with_color(COLOURS[index % COLOURS.len()])
                .with_marker(SHAPES[index / COLOURS.len() % SHAPES.len()])
                .with_size(4.0)
                .with_legend(*group);
            plots.push(Plot::Scatter(scatter));
        }
    }
    let layout = Layout::auto_from_plots(&plots)
        .with_log_scale()
        .with_x_label("CPU time of a frame, ms")
        .with_y_label(figure.to_uppercase());
    let scene = render_multiple(plots, layout).with_background(Some("white"));
    let png = PngBackend::new().with_scale(SCALE).render_scene(&scene);
    png.map(Some)
        .map_err(|error| anyhow!("the plot of {figure} cannot be drawn: {error:?}"))
}
