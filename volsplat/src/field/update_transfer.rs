//! Another transfer function for the same bricks: what an animation changes from picture to picture.
//!
//! The bricks of cells hold scalars, and the transfer function is a table beside them: as long as the bricks hold all that
//! the new function shows, only the table is made again, and what was made from it. A renderer that was prepared with the
//! mean of several functions can so take any of them, and any mean of them.
//! Limits: one channel of scalars, no mask, gathered sheets.

use std::sync::Arc;

use super::driver::FieldPipeline;
use crate::bricks::plan::support;
use crate::field::setup::prepare;
use crate::look::scene::Look;
use crate::look::transfer::TransferFunction;
use crate::slabs::channel::ChannelSettings;
use resample_core::Reuse;

impl FieldPipeline {
    /// Takes another transfer function.
    pub(crate) fn update_transfer(&mut self, transfer: &TransferFunction) -> Reuse {
        let Some(kept) = &self.kept else {
            return Reuse::NeedsRenderer;
        };
        let support = support(transfer, &self.options);
        if !kept.covers(&support) {
            return Reuse::NeedsRenderer;
        }
        self.seen = (!support.covers(kept)).then_some(support);
        let range = self.channels[0].value_range;
        self.channels = Arc::from([ChannelSettings::of_transfer(
            transfer,
            range,
            self.options.opacity,
        )]);
        self.iso = prepare::iso(Look::Transfer(transfer), &self.options);
        Reuse::Kept
    }
}
