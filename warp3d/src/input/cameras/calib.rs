//! Middlebury `calib.txt`: a rectified pair.
//!
//! Two cameras `cam0` (left) and `cam1` (right) with the same rotation; the right one stands at X = baseline. Axes x
//! right, y down, z forward; the world is the left camera's. Pixel centres at whole numbers, which only matters beside
//! cameras of other files. A name between 0 and 1 is a camera on the baseline between the two, with its principal
//! point between theirs: `calib.txt#0.5`. Source: the description of the 2014 data set.

use glam::{DAffine3, DVec3};
use resample_core::camera::PixelCentre;

use super::entry::{CameraSet, Entry, Hints, Lens, LensModel, Names, Pair};

/// Steps at which a camera between the two is offered, beside the two themselves.
const BETWEEN: [f64; 3] = [0.25, 0.5, 0.75];

pub(super) fn is_it(text: &str) -> bool {
    text.lines()
        .any(|line| line.trim_start().starts_with("cam0"))
}

pub(super) fn read(text: &str, hints: &Hints) -> Result<CameraSet, String> {
    let matrices = [matrix(text, "cam0")?, matrix(text, "cam1")?];
    let doffs = value(text, "doffs")?.unwrap_or(matrices[1].cx - matrices[0].cx);
    let baseline =
        value(text, "baseline")?.ok_or("no line 'baseline=': expected the distance of the eyes")?;
    if !(baseline > 0.0 && baseline.is_finite()) {
        return Err(format!(
            "a baseline of {baseline}: expected a length above 0"
        ));
    }
    let side =
        |name: &str| -> Result<Option<u32>, String> { Ok(value(text, name)?.map(|px| px as u32)) };
    let stated = side("width")?
        .zip(side("height")?)
        .map(|(width, height)| [width, height]);
    let size = stated
        .or(hints.size)
        .ok_or("no lines 'width=' and 'height=': give the picture's size")?;
    let between = |along: f64| -> Result<Entry, String> {
        let mix = |a: f64, b: f64| a + along * (b - a);
        let [left, right] = &matrices;
        let lens = Lens {
            fx: mix(left.fx, right.fx),
            fy: mix(left.fy, right.fy),
            cx: mix(left.cx, right.cx),
            cy: mix(left.cy, right.cy),
            pixel_centre: PixelCentre::Integer,
        };
        let pose = DAffine3::from_translation(DVec3::new(-along * baseline, 0.0, 0.0));
        let model = LensModel {
            lens,
            size,
            distortion: None,
        };
        model.entry(along.to_string(), pose)
    };
    let entries: Result<Vec<_>, String> =
        [0.0, 1.0].into_iter().chain(BETWEEN).map(between).collect();
    Ok(CameraSet {
        format: "calib.txt",
        entries: entries?,
        pair: Some(Pair { baseline, doffs }),
        names: Names::Words,
    })
}

/// The text behind `name=` up to the end of the line.
fn line<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let with_name = |line: &'a str| {
        line.trim_start()
            .strip_prefix(name)?
            .trim_start()
            .strip_prefix('=')
    };
    text.lines().find_map(with_name)
}

fn value(text: &str, name: &str) -> Result<Option<f64>, String> {
    let Some(word) = line(text, name) else {
        return Ok(None);
    };
    let number = word
        .trim()
        .parse::<f64>()
        .ok()
        .filter(|number| number.is_finite());
    number
        .map(Some)
        .ok_or_else(|| format!("'{name}={}': expected a number", word.trim()))
}

fn matrix(text: &str, name: &str) -> Result<Lens, String> {
    let word =
        line(text, name).ok_or_else(|| format!("no line '{name}=': expected two cameras"))?;
    let parts: Option<Vec<f64>> = word
        .split(|c: char| c.is_whitespace() || "[];,".contains(c))
        .filter(|part| !part.is_empty())
        .map(|part| part.parse().ok())
        .collect();
    match parts.as_deref() {
        Some(&[fx, _, cx, _, fy, cy, _, _, _]) => Ok(Lens {
            fx,
            fy,
            cx,
            cy,
            pixel_centre: PixelCentre::Integer,
        }),
        _ => Err(format!(
            "'{name}={}': expected [f 0 cx; 0 f cy; 0 0 1]",
            word.trim()
        )),
    }
}
