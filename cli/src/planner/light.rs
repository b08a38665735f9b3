//! The error of a volume's shadows and occlusion, from pictures whose light is found on two grids.

use anyhow::Result;
use volsplat::LightGrid;

use super::compared::compared_camera;
use super::pilot::PlannedScene;
use crate::measure::{Reference, rendered};
use crate::open::setting::{Choices, Setting, VolumeChoice};
use crate::values::{Bound, BoundMetric};

/// Error of light that is found at each voxel, as a share of its change to that of each second one. On scenes with an f64 reference it was 0.13 to 0.7,
/// greatest in fog (docs/light.md).
const SHARE_OF_CHANGE: f64 = 0.7;

/// The error of light beside that of sampling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum LightError {
    /// Nothing blocks light, or the scene is no volume.
    None,
    /// At most so much, by the metric of the bound.
    Within(f64),
    /// Both grids give one picture, as where memory has no room for the finer one.
    Unknown,
}

impl LightError {
    /// Returns true if light may err by more than a bound.
    pub(super) fn exceeds(self, bound: Bound) -> bool {
        matches!(self, Self::Within(error) if error >= bound.value)
    }

    /// The part of a bound that remains for sampling: squares of independent errors add, and so do largest errors. A bound that light exceeds by
    /// itself stays that of sampling.
    pub(super) fn leaves(self, bound: Bound) -> Bound {
        let value = match (self, bound.metric) {
            _ if self.exceeds(bound) => bound.value,
            (Self::Within(error), BoundMetric::Rms) => (bound.value.powi(2) - error.powi(2)).sqrt(),
            (Self::Within(error), BoundMetric::Max) => bound.value - error,
            (Self::None | Self::Unknown, _) => bound.value,
        };
        Bound { value, ..bound }
    }
}

/// The error of the light of a scene, in a small picture of its first camera.
pub(super) fn error(scene: &mut PlannedScene, metric: BoundMetric) -> Result<LightError> {
    let asked = match &scene.typed {
        Setting::Volume(given) if given.options.blocks_light() => given.options.light_grid,
        _ => return Ok(LightError::None),
    };
    let camera = compared_camera(&scene.cameras[0])?;
    let mut drawn = |grid: LightGrid| {
        let choices = Choices::of([VolumeChoice::LightGrid(grid)]);
        scene.opened.set(&scene.typed.with(&choices)?)?;
        Ok::<_, anyhow::Error>(rendered(scene.opened, &camera)?.image)
    };
    let second = drawn(LightGrid::Every(2))?;
    let own = match asked {
        LightGrid::Auto | LightGrid::AtHand | LightGrid::Every(1) => None,
        LightGrid::Every(_) => Some(drawn(asked)?),
    };
    // This picture is drawn last, because the next ones need the same light.
    let each = Reference::new(drawn(LightGrid::Auto)?, Vec::new());
    let change = |image: &_| {
        let comparison = each.comparison(image)?;
        Ok::<_, anyhow::Error>(match metric {
            BoundMetric::Rms => comparison.rmse,
            BoundMetric::Max => comparison.max_abs,
        })
    };
    let finest = change(&second)?;
    if finest == 0.0 {
        return Ok(LightError::Unknown);
    }
    let beyond = own.as_ref().map_or(Ok(0.0), change)?;
    Ok(LightError::Within(SHARE_OF_CHANGE * finest + beyond))
}
