//! Where windows of a volume stand: the whole picture under two settings shows where it changes.
//!
//! For a root mean square, cells count by their contrast under the default and by the change to one with other rays and steps, and what
//! windows miss of that change raises the error that they show; for a largest error those come first that change most.

use anyhow::Result;
use resample_core::{Camera, Image};
use volsplat::Subpixels;

use super::candidate::Candidate;
use super::ladder::{Ladder, Rung};
use super::pilot::{MOST_PREVIEW_PX, Pilot, Scene, View, preview_camera};
use super::windows::{Cells, pixels};
use crate::open::setting::{Choices, Setting, VolumeChoice};

/// Where the default changes a preview, it has all of a picture's pixels, up to this many along a side: at half of them the rims of
/// plates have other contrast than in the picture, and windows missed them. Beyond, these previews would cost more than windows.
const MOST_COMPARED_PX: u32 = 256;

/// Work of the setting that ranks cells for a largest error, of the default's: with half of the slab and twice the sub-pixels along each
/// side it errs neither in steps nor in rays where the default does.
const RANKING_WORK: f64 = 8.0;

/// Most sub-pixels along a pixel's side.
const MOST_SUBPIXELS: u32 = 16;

impl Pilot {
    /// The cells of a picture by its contrast under the default, and by the change from there to a dearer setting.
    pub(super) fn compared(
        &mut self,
        scene: &mut Scene,
        ladder: &Ladder,
        cells: &Cells,
    ) -> Result<Cells> {
        let camera = preview_camera(cells.camera(), 1, MOST_COMPARED_PX)?;
        let (own, work) = self.under_default(scene, ladder, &camera)?;
        let other = crossed(scene, ladder, &ladder.default, work)?;
        let other = self.under(scene, ladder, &other, &camera)?;
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
        let (own, work) = self.under_default(scene, ladder, &camera)?;
        let other = self.under(scene, ladder, ladder.at_work(RANKING_WORK * work), &camera)?;
        Ok(cells.ranked(&own, &other))
    }

    /// Has the change from a setting to one with other rays and steps stand for what windows miss from now on.
    pub(super) fn recompare(
        &mut self,
        scene: &mut Scene,
        ladder: &Ladder,
        rung: &Rung,
    ) -> Result<()> {
        let other = crossed(scene, ladder, rung, rung.work)?;
        for number in 0..self.views.len() {
            let camera = preview_camera(self.views[number].cells.camera(), 1, MOST_COMPARED_PX)?;
            let own = self.under(scene, ladder, rung, &camera)?;
            let other = self.under(scene, ladder, &other, &camera)?;
            let View { cells, windows, .. } = &mut self.views[number];
            cells.recompare(&own, &other);
            for window in windows {
                window.change = cells.change_at(window.at);
            }
        }
        Ok(())
    }

    /// A picture under the default, and the place of the default on the ladder: its work beside that of a preview.
    fn under_default(
        &mut self,
        scene: &mut Scene,
        ladder: &Ladder,
        camera: &Camera,
    ) -> Result<(Image, f64)> {
        let small = preview_camera(camera, 2, MOST_PREVIEW_PX)?;
        let (_, cheap) = self.drawn(scene, &Candidate::new(&ladder.preview), &small)?;
        scene.set(&ladder.default)?;
        let (own, work) = self.drawn(scene, &Candidate::new(&ladder.default), camera)?;
        let cheap_each = (cheap.growing / pixels(&small)).max(f64::MIN_POSITIVE);
        let own_each = work.growing / pixels(camera);
        Ok((own.image, ladder.preview.work * own_each / cheap_each))
    }

    /// A picture under another setting.
    fn under(
        &mut self,
        scene: &mut Scene,
        ladder: &Ladder,
        rung: &Rung,
        camera: &Camera,
    ) -> Result<Image> {
        scene.set(rung)?;
        let (seen, _) = self.drawn(scene, &Candidate::new(rung), camera)?;
        scene.set(&ladder.preview)?;
        Ok(seen.image)
    }
}

/// A setting of twice this work, whose rays and steps both lie elsewhere than those of another one: twice the slab, and twice the
/// sub-pixels along each side. One with the same rays shares the other's error at narrow peaks and rims, and does not show it.
/// Where the typed options leave no such choice, the next one of twice the work on the ladder.
fn crossed(scene: &Scene, ladder: &Ladder, rung: &Rung, work: f64) -> Result<Rung> {
    let Setting::Volume(own) = scene.typed.with(&rung.choices)? else {
        return Ok(ladder.at_work(2.0 * work).clone());
    };
    let slab = own.options.field.slab_voxels;
    let subpixels = match own.options.subpixels {
        Subpixels::Fixed(count) => count,
        // Work is sub-pixels along two sides over the slab.
        Subpixels::Auto => (slab * work).max(1.0).sqrt().log2().round().exp2() as u32,
    };
    let choices = Choices::of([
        VolumeChoice::Slab(2.0 * slab),
        VolumeChoice::Subpixels(Subpixels::Fixed((2 * subpixels).min(MOST_SUBPIXELS))),
    ]);
    let choices = choices.without(&scene.typed);
    let is_choice = scene.typed.with(&choices)?.is_legal();
    Ok(match is_choice {
        true => Rung {
            choices,
            work: 2.0 * work,
        },
        false => ladder.at_work(2.0 * work).clone(),
    })
}
