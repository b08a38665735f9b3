//! How much is looked at: pictures, previews, and what decides where windows stand.

use super::estimate::MOST_VIEWS;
use super::pilot::{Effort, PlannedScene, Steps, side_px};
use super::windows::pixels;
use crate::open::setting::Setting;
use crate::values::{Bound, BoundMetric};

/// The bound that a person asked for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Asked {
    /// At most this error.
    Error(Bound),
    /// At most this time, ms.
    Time(f64),
}

/// Draws of each picture at a time.
pub(super) const DRAWS: usize = 4;

/// Part of a run under the exact setting that looking may take.
pub(super) const SHARE_OF_EXACT: f64 = 0.35;

/// Pictures of a sequence of which previews are drawn, for the one with the most contrast.
const PREVIEWS: usize = 16;

/// Pictures of a sequence that are looked at for a time.
const TIMED_VIEWS: usize = 3;

/// The effort for a bound; `None` where a look costs more than it can save.
pub(super) fn effort(scene: &PlannedScene, asked: Asked) -> Option<Effort> {
    let pictures = scene.cameras.len();
    let views = match asked {
        Asked::Error(_) if pictures > 1 => (pictures / 4).clamp(2, MOST_VIEWS),
        Asked::Error(_) => 1,
        Asked::Time(_) => pictures.min(TIMED_VIEWS),
    };
    if matches!(asked, Asked::Error(_)) && !may_pay(scene, views) {
        return None;
    }
    let previews = match asked {
        Asked::Error(_) => pictures.min(PREVIEWS),
        Asked::Time(_) => 0,
    };
    let steps = match (asked, &scene.typed) {
        (Asked::Error(bound), Setting::Volume(_)) => match bound.metric {
            BoundMetric::Rms => Steps::Compared,
            BoundMetric::Max => Steps::Ranked,
        },
        _ => Steps::Ignored,
    };
    Some(Effort {
        views,
        previews,
        steps,
    })
}

/// Returns true if a look might be worth its cost, as far as sizes show.
fn may_pay(scene: &PlannedScene, views: usize) -> bool {
    let cameras = &scene.cameras;
    let picture = cameras.iter().map(pixels).fold(0.0, f64::max);
    let least = (DRAWS as f64 * f64::from(side_px(scene)).powi(2)).min(picture);
    views as f64 * least <= SHARE_OF_EXACT * cameras.len() as f64 * picture
}
