//! Settings shared by every tile of a frame of the field, and the frame.

use std::sync::Arc;

use glam::DMat3;
use resample_core::{Camera, GridView, Stop};

use super::iso_rays::IsoSettings;
use super::ray_values::Statistic;
use crate::bricks::cells::CellBrick;
use crate::field::setup::constant_brick::{Uniform, UniformChoice};
use crate::field::setup::from_differences::FromDifferences;
use crate::look::clip::{AnchoredHalfSpace, GridClip};
use crate::picture::tiles::Means;
use crate::slabs::channel::{ChannelSettings, Reading};
use crate::slabs::section::SectionTable;
use crate::slabs::settings::{BOX_MARGIN, SheetSettings};

/// Settings shared by every tile of a frame.
#[derive(Clone, Debug)]
pub(crate) struct FieldSettings {
    pub(crate) sheets: SheetSettings,
    /// Sections of a whole brick of cells, from its middle.
    pub(crate) brick_sections: SectionTable,
    /// The clip, relative to the anchor.
    pub(crate) clip: Vec<AnchoredHalfSpace>,
    /// All channels; the table of the first is that of the sheets too.
    pub(crate) channels: Arc<[ChannelSettings]>,
    /// How differences of bytes become gradients.
    pub(crate) from_differences: FromDifferences,
    /// Where the pixels show a statistic of their rays: which.
    pub(crate) statistic: Option<Statistic>,
    /// Segments of a ray in a cell, where the transfer function is integrated between samples.
    pub(crate) segments: u32,
    /// Where a surface is drawn: which.
    pub(crate) iso: Option<IsoSettings>,
}

/// One frame's camera, at sub-pixel resolution, and settings.
pub(crate) struct FieldFrame<'a> {
    pub(crate) settings: &'a FieldSettings,
    pub(crate) view: &'a GridView,
    pub(crate) camera: &'a Camera,
    pub(crate) clip: &'a GridClip,
    pub(crate) subpixels: u32,
    pub(crate) means: Means,
    /// The bricks of one colour that are crossed in one step.
    pub(crate) uniform: Option<UniformChoice>,
    /// Tiles are left out once it is asked for.
    pub(crate) stop: &'a Stop,
}

impl FieldFrame<'_> {
    /// The colour of a brick that is crossed in one step.
    pub(crate) fn uniform(&self, brick: &CellBrick) -> Option<Uniform> {
        let choice = self.uniform.as_ref()?;
        choice.of_brick(self.view, &self.settings.sheets.table, brick)
    }
}

/// The rule for samples: the least one that the settings need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rule {
    Over,
    Shaded,
    Mixed,
    Statistic,
}

impl FieldSettings {
    /// The sections of bricks of this many cells along a side, from their middle, with the margin.
    pub(crate) fn of_bricks(camera_from_grid: DMat3, cells: usize) -> SectionTable {
        SectionTable::of_cube(camera_from_grid * (0.5 * cells as f64 + BOX_MARGIN))
    }

    /// The rule of these settings.
    pub(crate) fn rule(&self) -> Rule {
        let is_plain = self.is_one_channel() && self.sheets.gradient_ramp.is_none();
        match (
            self.statistic.is_some(),
            is_plain,
            self.sheets.shade.is_some(),
        ) {
            (true, ..) => Rule::Statistic,
            (_, false, _) => Rule::Mixed,
            (_, true, true) => Rule::Shaded,
            (_, true, false) => Rule::Over,
        }
    }

    /// Returns true if there is one channel, of scalars.
    pub(crate) fn is_one_channel(&self) -> bool {
        self.channels.len() == 1 && self.channels[0].reading == Reading::Trilinear
    }

    /// Returns true if samples are only classified and composited: not lit, mixed, or searched for a surface.
    pub(crate) fn is_plain(&self) -> bool {
        !self.walks_rays() && self.rule() == Rule::Over
    }

    /// Returns true if bricks are walked along rays, instead of plane by plane.
    pub(crate) fn walks_rays(&self) -> bool {
        let is_integrated = matches!(self.rule(), Rule::Over | Rule::Shaded)
            && self.sheets.table.integrals().is_some();
        self.iso.is_some() || is_integrated
    }
}
