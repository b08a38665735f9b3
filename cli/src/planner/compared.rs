//! Where windows of a volume stand: the whole picture under two settings shows where it changes.
//!
//! For a root mean square, cells count by their contrast under the default and by the change to one with other rays and steps, and what
//! windows miss of that change raises the error that they show; for a largest error those come first that change most.

use anyhow::Result;
use resample_core::{Camera, Image};
use volsplat::Subpixels;

use super::candidate::Candidate;
use super::ladder::{Ladder, Rung};
use super::pilot::{Pilot, Scene, View, preview_camera};
use super::windows::Cells;
use crate::measure::{Rendered, total};
use crate::setting::Setting;

/// Where the default changes a preview, it has all of a picture's pixels, up to this many along a side: at half of them the rims of
/// plates have other contrast than in the picture, and windows missed them. Beyond, these previews would cost more than windows.
const MOST_COMPARED_PX: u32 = 256;

/// Work of the setting that ranks cells for a largest error, of the default's: with half of the slab and twice the sub-pixels along each
/// side it errs neither in steps nor in rays where the default does.
const RANKING_WORK: f64 = 8.0;

/// Most sub-pixels along a pixel's side.
const MOST_SUBPIXELS: u32 = 16;

impl Pilot {
    /// The cells of a picture by its contrast under the default, and by the change from there to one with other rays and steps.
    pub(super) fn compared(
        &mut self,
        scene: &mut Scene,
        ladder: &Ladder,
        cells: &Cells,
    ) -> Result<Cells> {
        let camera = preview_camera(cells.camera(), 1, MOST_COMPARED_PX)?;
        let [own, other] = self.crossed(scene, ladder, &ladder.default, &camera)?;
        Ok(cells.with_steps(&own, &other))
    }

    /// The cells of a picture by their largest change from the default to a dearer setting, of all of its pixels.
    pub(super) fn ranked(
        &mut self,
        scene: &mut Scene,
        ladder: &Ladder,
        cells: &Cells,
    ) -> Result<Cells> {
        let camera = *cells.camera();
        let own = self.under(scene, ladder, &ladder.default, &camera)?;
        let work =
            Rays::of(scene, &ladder.default, &own)?.map_or(f64::INFINITY, |rays| rays.work());
        let other = self.under(scene, ladder, ladder.at_work(RANKING_WORK * work), &camera)?;
        Ok(cells.ranked(&own.image, &other.image))
    }

    /// Has the change from a setting to one with other rays and steps stand for what windows miss from now on.
    pub(super) fn recompare(
        &mut self,
        scene: &mut Scene,
        ladder: &Ladder,
        rung: &Rung,
    ) -> Result<()> {
        for number in 0..self.views.len() {
            let camera = preview_camera(self.views[number].cells.camera(), 1, MOST_COMPARED_PX)?;
            let [own, other] = self.crossed(scene, ladder, rung, &camera)?;
            let View { cells, windows, .. } = &mut self.views[number];
            cells.recompare(&own, &other);
            for window in windows {
                window.change = cells.change_at(window.at);
            }
        }
        Ok(())
    }

    /// A picture under a setting and under one of twice its work whose rays and steps both lie elsewhere: twice the slab, and twice
    /// the sub-pixels along each side. One with the same rays shares the first one's error at narrow peaks and rims, and does not show
    /// it. Where the typed options leave no such choice, the next one of twice the work on the ladder.
    fn crossed(
        &mut self,
        scene: &mut Scene,
        ladder: &Ladder,
        rung: &Rung,
        camera: &Camera,
    ) -> Result<[Image; 2]> {
        let own = self.under(scene, ladder, rung, camera)?;
        let other = match Rays::of(scene, rung, &own)? {
            Some(rays) => match rays.crossed(scene)? {
                Some(crossed) => crossed,
                None => ladder.at_work(2.0 * rays.work()).clone(),
            },
            None => ladder.exact().clone(),
        };
        let other = self.under(scene, ladder, &other, camera)?;
        Ok([own.image, other.image])
    }

    /// A picture under a setting.
    fn under(
        &mut self,
        scene: &mut Scene,
        ladder: &Ladder,
        rung: &Rung,
        camera: &Camera,
    ) -> Result<Rendered> {
        scene.set(rung)?;
        let (seen, _) = self.drawn(scene, &Candidate::new(rung), camera)?;
        scene.set(&ladder.preview)?;
        Ok(seen)
    }
}

/// Where the samples of a picture of the field lie.
struct Rays {
    slab_voxels: f64,
    /// Along a pixel's side.
    subpixels: u32,
}

impl Rays {
    /// Those of a picture under a setting; `None` where it is not of the field.
    fn of(scene: &Scene, rung: &Rung, seen: &Rendered) -> Result<Option<Self>> {
        let Setting::Volume(own) = scene.typed.with(&rung.setting)? else {
            return Ok(None);
        };
        let subpixels = total(&seen.keys, "subpixels") as u32;
        Ok((subpixels > 0).then_some(Self {
            slab_voxels: own.options.field.slab_voxels,
            subpixels,
        }))
    }

    /// The place on the ladder.
    fn work(&self) -> f64 {
        f64::from(self.subpixels).powi(2) / self.slab_voxels
    }

    /// The setting with twice the slab and twice the sub-pixels; `None` where the typed options forbid it.
    fn crossed(&self, scene: &Scene) -> Result<Option<Rung>> {
        let slab_voxels = 2.0 * self.slab_voxels;
        let subpixels = (2 * self.subpixels).min(MOST_SUBPIXELS);
        let setting = Setting::volume(&["slab", "subpixels"], |args| {
            args.field.slab_voxels = slab_voxels;
            args.subpixels = Subpixels::Fixed(subpixels);
        });
        let setting = setting.without(&scene.typed);
        let is_choice = scene.typed.with(&setting)?.is_legal();
        Ok(is_choice.then_some(Rung {
            setting,
            work: f64::from(subpixels).powi(2) / slab_voxels,
        }))
    }
}
