//! What every tile of a frame of the field shares.

use std::sync::Arc;

use glam::DMat3;

use super::iso_rays::IsoSettings;
use super::ray_values::Statistic;
use crate::clip::AnchoredHalfSpace;
use crate::sheets::channel::{ChannelSettings, Reading};
use crate::sheets::section::SectionTable;
use crate::sheets::settings::{BOX_MARGIN, SheetSettings};

/// What every tile of a frame shares.
#[derive(Clone, Debug)]
pub(crate) struct FieldSettings {
    pub(crate) sheets: SheetSettings,
    /// Sections of a whole brick of cells, from its middle.
    pub(crate) brick_sections: SectionTable,
    /// The clip, relative to the anchor.
    pub(crate) clip: Vec<AnchoredHalfSpace>,
    /// All channels; the table of the first is that of the sheets too.
    pub(crate) channels: Arc<[ChannelSettings]>,
    /// Where the pixels show a statistic of their rays: which.
    pub(crate) statistic: Option<Statistic>,
    /// Where a surface is drawn: which.
    pub(crate) iso: Option<IsoSettings>,
}

/// What becomes of samples: the least rule that does what the settings ask for.
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
        let is_plain = self.channels.len() == 1
            && self.channels[0].reading == Reading::Trilinear
            && self.sheets.gradient_ramp.is_none();
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

    /// Whether samples are only classified and composited: not lit, mixed, or searched for a surface.
    pub(crate) fn is_plain(&self) -> bool {
        self.iso.is_none() && self.rule() == Rule::Over
    }
}
