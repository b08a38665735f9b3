//! Measuring one setting: its time beside the default's, its picture.
//!
//! Frames of the setting and of the default alternate, and what counts is the median of the ratios of neighbours: what
//! disturbs the machine for longer than two frames hits both.

use std::time::Instant;

use anyhow::Result;
use cpu_time::ProcessTime;
use resample_core::{Camera, Image};
use serde_json::{Map, Value};

use super::probe::Alone;
use super::record::Cost;
use crate::commands::Prepared;
use crate::picture::Render;
use crate::report;

/// Steps of the flicker's camera: sixteen of a sixteenth of a pixel are one pixel.
const FLICKER_STEPS: u32 = 16;

/// Elapsed and CPU time of a frame, ms.
#[derive(Clone, Copy, Debug)]
pub(super) struct Time {
    pub(super) wall_ms: f64,
    pub(super) cpu_ms: f64,
}

/// What a setting gave.
pub(super) struct Measured {
    pub(super) cost: Cost,
    pub(super) image: Image,
    pub(super) counts: Map<String, Value>,
}

/// The default's renderer and its time, which others are measured beside.
pub(super) struct Baseline<'a> {
    pub(super) render: &'a mut Render<'static>,
    pub(super) time: Time,
}

/// Prepares a setting, draws `reps` frames beside the default's, and gives the picture. `alone` is what it took by itself.
pub(super) fn setting(
    prepare: impl FnOnce() -> Result<Prepared>,
    camera: &Camera,
    (reps, alone): (u16, Alone),
    baseline: &mut Baseline,
) -> Result<(Measured, Prepared)> {
    let mut prepared = prepare()?;
    let first = (prepared.render)(camera)?;
    let (mut wall, mut cpu) = (Vec::new(), Vec::new());
    for _ in 0..reps {
        let default = timed(baseline.render, camera)?;
        let own = timed(&mut *prepared.render, camera)?;
        wall.push(own.wall_ms / default.wall_ms);
        cpu.push(own.cpu_ms / default.cpu_ms);
    }
    let [cpu_low, cpu_middle, cpu_high] = quartiles(cpu);
    let cost = Cost {
        wall_ms: quartiles(wall)[1] * baseline.time.wall_ms,
        cpu_ms: cpu_middle * baseline.time.cpu_ms,
        spread: 0.5 * (cpu_high - cpu_low) / cpu_middle,
        cold_ms: alone.cold_ms,
        peak_bytes: alone.peak_bytes,
    };
    let counts = numbers(first.account.keys);
    Ok((
        Measured {
            cost,
            image: first.image,
            counts,
        },
        prepared,
    ))
}

/// The median time of a renderer, alone.
pub(super) fn alone(render: &mut Render, camera: &Camera, reps: u16) -> Result<Time> {
    let times: Vec<Time> = (0..reps)
        .map(|_| timed(render, camera))
        .collect::<Result<_>>()?;
    let median = |of: fn(&Time) -> f64| quartiles(times.iter().map(of).collect())[1];
    Ok(Time {
        wall_ms: median(|t| t.wall_ms),
        cpu_ms: median(|t| t.cpu_ms),
    })
}

/// The views of the flicker: the camera moved along the picture's rows by less than a pixel at a time.
pub(super) fn flicker_cameras(camera: &Camera) -> Vec<Camera> {
    let moved = |step: u32| Camera {
        cx: camera.cx + f64::from(step) / f64::from(FLICKER_STEPS),
        ..*camera
    };
    (0..FLICKER_STEPS).map(moved).collect()
}

fn timed(render: &mut Render, camera: &Camera) -> Result<Time> {
    let (start, cpu) = (Instant::now(), ProcessTime::try_now().ok());
    render(camera)?;
    let wall_ms = report::ms_since(start);
    let elapsed = cpu.and_then(|cpu| cpu.try_elapsed().ok());
    // Where the system keeps no CPU clock, elapsed time stands in.
    Ok(Time {
        wall_ms,
        cpu_ms: elapsed.map_or(wall_ms, |elapsed| 1e3 * elapsed.as_secs_f64()),
    })
}

/// First quartile, median and third quartile; of few values the nearest.
fn quartiles(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_unstable_by(f64::total_cmp);
    let last = values.len().saturating_sub(1) as f64;
    [0.25, 0.5, 0.75].map(|share| {
        values
            .get((share * last).round() as usize)
            .copied()
            .unwrap_or(0.0)
    })
}

/// The numbers at the top of a renderer's account, without the times.
fn numbers(keys: Value) -> Map<String, Value> {
    let Value::Object(keys) = keys else {
        return Map::new();
    };
    keys.into_iter()
        .filter(|(name, value)| value.is_number() && !name.ends_with("_ms"))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_are_the_nearest_values() {
        assert_eq!(quartiles(vec![5.0, 1.0, 3.0, 2.0, 4.0]), [2.0, 3.0, 4.0]);
        assert_eq!(quartiles(vec![7.0]), [7.0; 3]);
    }

    #[test]
    fn times_are_no_counts() {
        let keys = serde_json::json!({"points": 3, "wall_ms": 2.5, "stages": {"cull": 1}});
        assert_eq!(
            numbers(keys),
            Map::from_iter([("points".to_owned(), Value::from(3))])
        );
    }
}
