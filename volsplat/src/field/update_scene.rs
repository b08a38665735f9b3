//! Another look at the same voxels: what a viewer changes between two pictures.
//!
//! Takes the scene and the options as they are now. Where all bricks of cells are kept, they are asked again what is shown
//! of them, and the tables beside them are made anew. The pictures are those of a renderer that is prepared for this look.

use std::sync::Arc;

use super::driver::{FieldPipeline, Source};
use crate::Error;
use crate::bricks::plan::{plan, support};
use crate::field::setup::prepare;
use crate::look::options::RenderOptions;
use crate::look::scene::Scene;
use crate::slabs::channel::{ChannelSettings, check};
use resample_core::Reuse;

impl FieldPipeline {
    /// Draws a scene of the voxels and the mask that this was prepared with, by these options.
    /// [`Error::Option`] where the scene does not suit them; nothing has changed then.
    pub(crate) fn update_scene(
        &mut self,
        scene: &Scene,
        options: &RenderOptions,
    ) -> Result<Reuse, Error> {
        let (Source::Cells(field), Some(transfers), Some(choices)) =
            (&mut self.source, scene.transfers(), options.field())
        else {
            return Ok(Reuse::NeedsRenderer);
        };
        if !self.is_whole || transfers.len() != self.channels.len() {
            return Ok(Reuse::NeedsRenderer);
        }
        let channels: Arc<[ChannelSettings]> = transfers
            .iter()
            .zip(self.channels.iter())
            .map(|(transfer, before)| {
                ChannelSettings::of_transfer(transfer, before.value_range, options.opacity)
            })
            .collect();
        check(&channels, options)?;
        field.show(&plan(scene, options)?.tabulated(&channels));
        self.kept = scene
            .single()
            .map(|(_, transfer)| support(transfer, options));
        self.seen = None;
        self.iso = prepare::iso(scene.channels[0].look, options);
        self.channels = channels;
        self.choices = choices.clone();
        self.options = options.clone();
        self.update_clip(&options.clip);
        Ok(Reuse::Kept)
    }
}
