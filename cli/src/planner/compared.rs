//! Where windows of a volume stand: the whole picture under two settings shows where it changes.
//!
//! For a root mean square, cells count by their contrast under the default and by the change to a dearer setting, and what
//! windows miss of that change raises the error that they show; for a largest error those come first that change most.

use anyhow::Result;
use resample_core::{Camera, Image};

use super::candidate::Candidate;
use super::ladder::Ladder;
use super::pilot::{MOST_PREVIEW_PX, Pilot, Scene, preview_camera};
use super::windows::{Cells, pixels};

/// Where the default changes a preview, it has all of a picture's pixels, up to this many along a side: at half of them the rims of
/// plates have other contrast than in the picture, and windows missed them. Beyond, these previews would cost more than windows.
const MOST_COMPARED_PX: u32 = 256;

/// Work of the setting that the default is compared with, of the default's: it halves the error of the default or more on the front of
/// four volumes (slabs of a quarter after those of a half).
const BESIDE_WORK: f64 = 2.0;

impl Pilot {
    /// The cells of a picture by its contrast under the default, and by the change from there to a dearer setting.
    pub(super) fn compared(
        &mut self,
        scene: &mut Scene,
        ladder: &Ladder,
        cells: &Cells,
    ) -> Result<Cells> {
        let camera = preview_camera(cells.camera(), 1, MOST_COMPARED_PX)?;
        let [own, other] = self.two_settings(scene, ladder, &camera)?;
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
        let [own, other] = self.two_settings(scene, ladder, &camera)?;
        Ok(cells.ranked(&own, &other))
    }

    /// A picture under the default and under a setting of twice its work or more.
    fn two_settings(
        &mut self,
        scene: &mut Scene,
        ladder: &Ladder,
        camera: &Camera,
    ) -> Result<[Image; 2]> {
        let small = preview_camera(camera, 2, MOST_PREVIEW_PX)?;
        let (_, cheap) = self.drawn(scene, &Candidate::new(&ladder.preview), &small)?;
        scene.set(&ladder.default)?;
        let (own, work) = self.drawn(scene, &Candidate::new(&ladder.default), camera)?;
        let cheap_each = cheap.growing / pixels(&small);
        let default_work = ladder.preview.work * (work.growing / pixels(camera))
            / cheap_each.max(f64::MIN_POSITIVE);
        let beside = ladder.from_work(BESIDE_WORK * default_work);
        scene.set(beside)?;
        let (other, _) = self.drawn(scene, &Candidate::new(beside), camera)?;
        scene.set(&ladder.preview)?;
        Ok([own.image, other.image])
    }
}
