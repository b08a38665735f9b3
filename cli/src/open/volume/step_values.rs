//! The values of all steps of a volume over time, for each channel.

use anyhow::{Result, bail};
use glam::DVec3;
use volsplat::volume::Steps;
use volsplat::{TransferFunction, Volume};

/// The values of all steps of each channel.
pub(crate) struct StepValues(pub(crate) Vec<Steps>);

impl StepValues {
    /// Adds the channels of a step.
    pub(crate) fn add<'a>(&mut self, channels: impl Iterator<Item = &'a Volume>) -> Result<()> {
        let channels: Vec<&Volume> = channels.collect();
        if channels.len() != self.0.len() {
            bail!("has another number of channels than the steps before it");
        }
        self.0
            .iter_mut()
            .zip(channels)
            .for_each(|(steps, volume)| steps.add(volume));
        Ok(())
    }

    /// The box in the world around all that a channel shows in any step; `None` where it shows nothing.
    pub(crate) fn shown_box(
        &self,
        channel: usize,
        function: &TransferFunction,
    ) -> Option<[DVec3; 2]> {
        let (low, high) = function.visible_range()?;
        // What rises from its end shows nothing at that end, where backgrounds often are.
        let is_shown = |value: f64| function.opacity(value) > 0.0;
        let shows =
            |least: f64, most: f64| is_shown(least) || is_shown(most) || least < high && most > low;
        self.0[channel].box_where(shows)
    }
}
