//! The figures of a comparison as the commands name them, and the picture of its errors.
//!
//! Takes what `resample_core::metrics` measured, gives names, JSON and colours.

use resample_core::metrics::Comparison;
use resample_core::{Image, metrics};
use serde_json::{Map, Value, json};

/// Name of a figure, whether more is better, and how it is read off a comparison.
pub(crate) type Metric = (&'static str, Better, fn(&Comparison) -> f64);

/// The figures.
pub(crate) const METRICS: [Metric; 10] = [
    ("rmse", Better::Less, |c| c.rmse),
    ("psnr", Better::More, |c| c.psnr_db),
    ("alpha-psnr", Better::More, |c| c.alpha_psnr_db),
    ("bias", Better::Less, |c| c.mean_signed.abs()),
    ("max", Better::Less, |c| c.max_abs),
    ("p99", Better::Less, |c| c.p99_abs),
    ("p999", Better::Less, |c| c.p999_abs),
    ("ssim", Better::More, |c| c.ssim),
    ("flip", Better::Less, |c| c.flip.mean),
    ("flip-max", Better::Less, |c| c.flip.max),
];

/// The figure over time, known for animations only.
pub(crate) const FLICKER: &str = "flicker";

/// The good direction of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Better {
    /// Less is better.
    Less,
    /// More is better.
    More,
}

/// All figures of a comparison by name, and the number of pixels.
pub(crate) fn record(comparison: &Comparison) -> Map<String, Value> {
    let mut figures: Map<String, Value> = METRICS
        .iter()
        .map(|(name, _, of)| ((*name).to_owned(), number(of(comparison))))
        .collect();
    figures.insert("pixels".into(), json!(comparison.pixel_count));
    figures
}

/// JSON has no infinity: equal pictures have no finite PSNR, and get null.
fn number(value: f64) -> Value {
    if value.is_finite() {
        json!(value)
    } else {
        Value::Null
    }
}

/// The errors in the colours of a well-known map, dark for none.
pub(crate) fn heatmap(map: &metrics::ScalarMap) -> Image {
    let colour = |&error: &f64| {
        let c = colorous::MAGMA.eval_continuous(error.clamp(0.0, 1.0));
        let linear = |code: u8| resample_core::image::linear_from_srgb(f32::from(code) / 255.0);
        [linear(c.r), linear(c.g), linear(c.b), 1.0]
    };
    let rgba = map.values.iter().map(colour).collect();
    Image {
        width: map.width,
        height: map.height,
        rgba,
        depth: None,
        planes: Vec::new(),
    }
}
