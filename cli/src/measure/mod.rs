//! The one way to measure: a scene drawn under a setting, with its counts and times, and its error against a reference.
//!
//! The planner's pilot, `trade` and `bench` measure through this file. Frames of a setting and of another one
//! alternate, and the median of the ratios of neighbours counts: a disturbance of the machine that is longer than two
//! frames hits both.

pub(crate) mod figures;

use anyhow::Result;
use resample_core::metrics::{Comparison, Mask};
use resample_core::{Camera, Image, metrics};
use serde_json::{Map, Value};

use crate::open::Opened;
use crate::process::report::{Account, Cost};
use resample_core::metrics::Flicker;

/// Steps of a shimmer: sixteen of a sixteenth of a pixel are one pixel.
const SHIMMER_STEPS: u32 = 16;

/// A picture, and the work it took.
pub(crate) struct Rendered {
    /// The picture.
    pub(crate) image: Image,
    /// Counts and times of the renderer.
    pub(crate) keys: Value,
    /// Its time and work.
    pub(crate) cost: Cost,
    /// Elapsed and CPU time.
    pub(crate) time: Time,
}

/// Elapsed time, and CPU time of all threads, ms.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Time {
    /// Elapsed.
    pub(crate) wall_ms: f64,
    /// Of all threads.
    pub(crate) cpu_ms: f64,
}

/// The time of a setting, from frames beside those of another one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TimeBeside {
    /// The median ratios to the other's frames, times the other's time.
    pub(crate) time: Time,
    /// Half the distance of the quartiles of the CPU ratio, over the ratio.
    pub(crate) spread: f64,
}

/// The picture that others are compared with.
pub(crate) struct Reference {
    image: Image,
    /// Where it shows something; `None` if that is nowhere.
    mask: Option<Mask>,
    /// Pictures along further cameras, whose changes are the right ones.
    moving: Vec<Image>,
}

/// Draws the picture of one camera under the present setting.
pub(crate) fn rendered(opened: &mut Opened, camera: &Camera) -> Result<Rendered> {
    let drawn = opened.draw(camera)?;
    let Account { keys, cost, .. } = drawn.account;
    Ok(Rendered {
        image: drawn.image,
        time: Time {
            wall_ms: cost.wall_ms,
            cpu_ms: cost.cpu_ms,
        },
        keys,
        cost,
    })
}

/// The pictures along several cameras.
pub(crate) fn pictures(opened: &mut Opened, cameras: &[Camera]) -> Result<Vec<Image>> {
    cameras
        .iter()
        .map(|camera| Ok(opened.draw(camera)?.image))
        .collect()
}

/// The median time of `reps` frames, after one that is cold.
pub(crate) fn time_alone(opened: &mut Opened, camera: &Camera, reps: u16) -> Result<Time> {
    rendered(opened, camera)?;
    let times: Vec<Time> = (0..reps)
        .map(|_| Ok(rendered(opened, camera)?.time))
        .collect::<Result<_>>()?;
    let middle = |of: fn(&Time) -> f64| median(times.iter().map(of).collect());
    Ok(Time {
        wall_ms: middle(|time| time.wall_ms),
        cpu_ms: middle(|time| time.cpu_ms),
    })
}

/// How many of `reps` frames are worth drawing where one takes `frame_ms`: further ones sharpen a time that is far from all others
/// anyway.
pub(crate) fn worthwhile_reps(reps: u16, frame_ms: f64) -> u16 {
    /// The most that one setting's frames take together, ms, unless two take more. A guess.
    const MOST_MS: f64 = 2000.0;
    let most = (MOST_MS / frame_ms.max(1.0)) as u16;
    reps.min(most.max(2))
}

/// The time of `own`, whose frames alternate with those of `other`, which takes `time` alone.
pub(crate) fn time_beside(
    own: &mut Opened,
    other: &mut Opened,
    time: Time,
    camera: &Camera,
    reps: u16,
) -> Result<TimeBeside> {
    let (mut wall, mut cpu) = (Vec::new(), Vec::new());
    for _ in 0..reps {
        let other = rendered(other, camera)?.time;
        let own = rendered(own, camera)?.time;
        wall.push(own.wall_ms / other.wall_ms);
        cpu.push(own.cpu_ms / other.cpu_ms);
    }
    let [low, middle, high] = quartiles(cpu);
    Ok(TimeBeside {
        time: Time {
            wall_ms: median(wall) * time.wall_ms,
            cpu_ms: middle * time.cpu_ms,
        },
        spread: 0.5 * (high - low) / middle,
    })
}

impl Reference {
    /// A picture that is known, and pictures along further cameras.
    pub(crate) fn new(image: Image, moving: Vec<Image>) -> Self {
        let mask = Mask::from_alpha(&image);
        Self {
            mask: (mask.count() > 0).then_some(mask),
            image,
            moving,
        }
    }

    /// The picture.
    pub(crate) fn image(&self) -> &Image {
        &self.image
    }

    /// How far a picture is from it, where it shows something.
    pub(crate) fn comparison(&self, image: &Image) -> Result<Comparison> {
        Ok(metrics::compare(image, &self.image, self.mask.as_ref())?)
    }

    /// Error of the change from picture to picture along the further cameras; `None` without such cameras.
    pub(crate) fn flicker(&self, moving: &[Image]) -> Option<f64> {
        let mut steps = Flicker::default();
        for (image, expected) in moving.iter().zip(&self.moving) {
            steps.add(image.clone(), expected.clone(), None);
        }
        steps.rms()
    }
}

/// The camera moved along the picture's rows by less than a pixel at a time.
pub(crate) fn sub_pixel_steps(camera: &Camera) -> Vec<Camera> {
    let moved = |step: u32| Camera {
        cx: camera.cx + f64::from(step) / f64::from(SHIMMER_STEPS),
        ..*camera
    };
    (0..SHIMMER_STEPS).map(moved).collect()
}

/// Largest over median change (root mean square) between neighbouring pictures: 1 where all change alike.
pub(crate) fn jump(pictures: &[Image]) -> Option<f64> {
    let change = |pair: &[Image]| {
        let pixels = pair[0].rgba.iter().zip(&pair[1].rgba);
        pixels
            .map(|(a, b)| (0..3).map(|k| f64::from(a[k] - b[k]).powi(2)).sum::<f64>())
            .sum::<f64>()
            .sqrt()
    };
    let changes: Vec<f64> = pictures.windows(2).map(change).collect();
    let largest = changes.iter().copied().fold(0.0, f64::max);
    let middle = median(changes);
    (middle > 0.0).then(|| largest / middle)
}

/// A number of a renderer's account; 0 where it has none of this name.
pub(crate) fn number(keys: &Value, name: &str) -> f64 {
    keys.get(name).and_then(Value::as_f64).unwrap_or(0.0)
}

/// The numbers at the top of a renderer's account, without the times.
pub(crate) fn counts(keys: Value) -> Map<String, Value> {
    let Value::Object(keys) = keys else {
        return Map::new();
    };
    keys.into_iter()
        .filter(|(name, value)| value.is_number() && !name.ends_with("_ms"))
        .collect()
}

/// The middle of a list; of an even number the upper one. 0 for none.
pub(crate) fn median(values: Vec<f64>) -> f64 {
    quartiles(values)[1]
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

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn quartiles_are_the_nearest_values() {
        assert_eq!(quartiles(vec![5.0, 1.0, 3.0, 2.0, 4.0]), [2.0, 3.0, 4.0]);
        assert_eq!(quartiles(vec![7.0]), [7.0; 3]);
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(Vec::new()), 0.0);
    }

    #[test]
    fn slow_frames_are_repeated_twice() {
        assert_eq!(worthwhile_reps(9, 10.0), 9);
        assert_eq!(worthwhile_reps(9, 500.0), 4);
        assert_eq!(worthwhile_reps(9, 1e5), 2);
        assert_eq!(worthwhile_reps(1, 1e5), 1);
        assert_eq!(worthwhile_reps(9, 0.0), 9);
    }

    #[test]
    fn times_are_no_counts() {
        let keys = json!({"points": 3, "wall_ms": 2.5, "stages": {"cull": 1}});
        assert_eq!(
            counts(keys),
            Map::from_iter([("points".to_owned(), json!(3))])
        );
    }
}
