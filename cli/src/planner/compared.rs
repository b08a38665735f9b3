//! Where windows of a volume stand: the whole picture under two settings shows where it changes.
//!
//! For a root mean square, cells count by their contrast and by the change to more rays; no error is predicted below that change, and what
//! windows miss of it raises the error that they show; for a largest error those come first that change most.

use anyhow::Result;
use resample_core::{Camera, Image};
use volsplat::Subpixels;

use super::ladder::{Ladder, Rung};
use super::pilot::{Pilot, PlannedScene, View, preview_camera};
use crate::measure::Rendered;
use crate::open::setting::{Choices, Setting, VolumeChoice};
use crate::planner::pilot::Candidate;
use resample_core::metrics::windows::Cells;

/// Pictures of up to so many pixels along a side are compared as a whole: at half of the pixels the rims of plates have other contrast,
/// and windows missed them. Of larger ones previews are, because whole pictures would cost more than windows.
const MOST_COMPARED_PX: u32 = 256;

/// Pictures of up to so many pixels along a side are drawn as a whole under each setting that may keep a largest error.
const MOST_RANKED_ITSELF_PX: u32 = 128;

/// How many times the slab of a setting is where two settings' rays are compared: it halves the work.
const STEPS: f64 = 2.0;

/// Most sub-pixels along a pixel's side.
const MOST_SUBPIXELS: u32 = 16;

/// The camera of the pictures that are compared.
pub(super) fn compared_camera(camera: &Camera) -> Result<Camera> {
    if camera.width.max(camera.height) <= MOST_COMPARED_PX {
        return Ok(*camera);
    }
    preview_camera(camera)
}

impl Pilot {
    /// The cells of a picture by its contrast under the default, and by the change to more rays.
    pub(super) fn compared(
        &mut self,
        scene: &mut PlannedScene,
        ladder: &Ladder,
        cells: &Cells,
    ) -> Result<Cells> {
        let camera = compared_camera(cells.camera())?;
        let [own, other] = self.crossed(scene, ladder, &ladder.default, &camera)?;
        let cells = cells.with_steps(&own, &other);
        self.default_long.push(own);
        Ok(cells)
    }

    /// The cells of a picture by their largest change from a coarser setting to the default, of all of its pixels.
    pub(super) fn ranked(
        &mut self,
        scene: &mut PlannedScene,
        ladder: &Ladder,
        cells: &Cells,
    ) -> Result<Cells> {
        let camera = *cells.camera();
        let [own, coarse] = self.with_coarser(scene, ladder, &ladder.default, &camera)?;
        let mut cells = cells.of(&own);
        cells.rank(&own, &coarse, self.guard_px as u32);
        Ok(cells)
    }

    /// Ranks the cells of each picture by the change from a coarser setting to this one; of large pictures between two coarser ones, of
    /// an eighth of its work and of an eighth of that, which show where this one errs too.
    pub(super) fn rank_again(
        &mut self,
        scene: &mut PlannedScene,
        ladder: &Ladder,
        rung: &Rung,
    ) -> Result<()> {
        let coarser = match Rays::typed(scene, rung)? {
            Some(rays) => rays.coarser(scene, rung)?,
            None => None,
        };
        for number in 0..self.views.len() {
            let camera = *self.views[number].cells.camera();
            let is_small = camera.width.max(camera.height) <= MOST_RANKED_ITSELF_PX;
            let coarser = coarser.as_ref().filter(|_| !is_small).unwrap_or(rung);
            let [own, coarse] = self.with_coarser(scene, ladder, coarser, &camera)?;
            let view = &mut self.views[number];
            view.cells.rank(&own, &coarse, self.guard_px as u32);
            view.change_again();
        }
        Ok(())
    }

    /// The pictures under a setting and under one of longer steps and fewer rays, of an eighth of its work: what changes most from that
    /// one has the largest errors. Where that is no choice, the setting and the exact one.
    fn with_coarser(
        &mut self,
        scene: &mut PlannedScene,
        ladder: &Ladder,
        rung: &Rung,
        camera: &Camera,
    ) -> Result<[Image; 2]> {
        let own = self.under(scene, ladder, rung, camera)?;
        let coarser = match Rays::of(scene, rung, &own)? {
            Some(rays) => rays.coarser(scene, rung)?,
            None => None,
        };
        let coarser = coarser.unwrap_or(ladder.exact().clone());
        let other = self.under(scene, ladder, &coarser, camera)?;
        Ok([own.image, other.image])
    }

    /// Has the change from a setting to more rays stand for what windows miss from now on. Gives the picture of each view that has
    /// twice the slab.
    pub(super) fn recompare(
        &mut self,
        scene: &mut PlannedScene,
        ladder: &Ladder,
        rung: &Rung,
    ) -> Result<Vec<Image>> {
        self.compared = rung.choices.clone();
        let mut long = Vec::new();
        for number in 0..self.views.len() {
            let camera = compared_camera(self.views[number].cells.camera())?;
            let [own, other] = self.crossed(scene, ladder, rung, &camera)?;
            let view = &mut self.views[number];
            view.cells.recompare(&own, &other);
            view.change_again();
            long.push(own);
        }
        Ok(long)
    }

    /// Has the change from twice the slab of a setting to its own stand for what windows miss. Steps err in a few pixels where a peak
    /// is narrow, as rays do.
    pub(super) fn recompare_steps(
        &mut self,
        scene: &mut PlannedScene,
        ladder: &Ladder,
        rung: &Rung,
        long: &[Image],
    ) -> Result<()> {
        for (number, long) in long.iter().enumerate() {
            let camera = compared_camera(self.views[number].cells.camera())?;
            let own = self.under(scene, ladder, rung, &camera)?;
            let view = &mut self.views[number];
            view.cells.recompare_cells(&own.image, long);
            view.cells.add_steps(&own.image, long);
            view.change_again();
        }
        Ok(())
    }

    /// Two pictures with twice the slab of a setting: with its own rays, and with twice the sub-pixels along each side. Errors of rays
    /// stand at rims and narrow peaks, in few pixels, and most windows miss them; those of steps are everywhere, and would hide
    /// them. Where sub-pixels are typed, the setting and the next one of twice its work.
    fn crossed(
        &mut self,
        scene: &mut PlannedScene,
        ladder: &Ladder,
        rung: &Rung,
        camera: &Camera,
    ) -> Result<[Image; 2]> {
        let Some(long) = Rays::with_long_steps(scene, rung)? else {
            let own = self.under(scene, ladder, rung, camera)?;
            let other = self.under(scene, ladder, ladder.at_work(2.0 * rung.work), camera)?;
            return Ok([own.image, other.image]);
        };
        let own = self.under(scene, ladder, &long, camera)?;
        let other = match Rays::of(scene, &long, &own)? {
            Some(rays) => rays.doubled(scene)?,
            None => ladder.exact().clone(),
        };
        let other = self.under(scene, ladder, &other, camera)?;
        Ok([own.image, other.image])
    }

    /// A picture under a setting.
    fn under(
        &mut self,
        scene: &mut PlannedScene,
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

impl View {
    /// Gives windows the changes of their cells.
    fn change_again(&mut self) {
        for window in &mut self.windows {
            window.change = self.cells.change_at(window.at);
        }
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
    fn of(scene: &PlannedScene, rung: &Rung, seen: &Rendered) -> Result<Option<Self>> {
        let Setting::Volume(own) = scene.typed.with(&rung.choices)? else {
            return Ok(None);
        };
        let subpixels = seen.cost.subpixels;
        Ok((subpixels > 0).then_some(Self {
            slab_voxels: own.options.field.slab_voxels,
            subpixels,
        }))
    }

    /// Those of a setting that fixes its sub-pixels.
    fn typed(scene: &PlannedScene, rung: &Rung) -> Result<Option<Self>> {
        let Setting::Volume(own) = scene.typed.with(&rung.choices)? else {
            return Ok(None);
        };
        let Subpixels::Fixed(subpixels) = own.options.subpixels else {
            return Ok(None);
        };
        Ok(Some(Self {
            slab_voxels: own.options.field.slab_voxels,
            subpixels,
        }))
    }

    /// A setting with twice the slab, as far as that is not typed; `None` where sub-pixels are, or samples are drawn.
    fn with_long_steps(scene: &PlannedScene, rung: &Rung) -> Result<Option<Rung>> {
        let (Setting::Volume(typed), Setting::Volume(own)) =
            (&scene.typed, scene.typed.with(&rung.choices)?)
        else {
            return Ok(None);
        };
        let slab_voxels = STEPS * own.options.field.slab_voxels;
        let slab = Choices::of([VolumeChoice::Slab(slab_voxels)]);
        let choices = rung.choices.with(&slab).without(&scene.typed);
        let is_choice = !typed.has("subpixels") && scene.typed.with(&choices)?.is_legal();
        Ok(is_choice.then(|| Rung::aside(choices)))
    }

    /// The setting with twice the slab and half the sub-pixels along each side, as far as these are not typed. A single ray is compared
    /// with four. `None` where both are typed.
    fn coarser(&self, scene: &PlannedScene, rung: &Rung) -> Result<Option<Rung>> {
        let subpixels = match self.subpixels {
            1 => 2,
            more => more / 2,
        };
        let choices = Choices::of([
            VolumeChoice::Slab(STEPS * self.slab_voxels),
            VolumeChoice::Subpixels(Subpixels::Fixed(subpixels)),
        ]);
        let choices = rung.choices.with(&choices).without(&scene.typed);
        let setting = scene.typed.with(&choices)?;
        let is_other = !setting.draws_like(&scene.typed.with(&rung.choices)?);
        Ok((is_other && setting.is_legal()).then(|| Rung::aside(choices)))
    }

    /// The setting with as long steps and twice the sub-pixels along each side.
    fn doubled(&self, scene: &PlannedScene) -> Result<Rung> {
        let subpixels = (2 * self.subpixels).min(MOST_SUBPIXELS);
        let choices = Choices::of([
            VolumeChoice::Slab(self.slab_voxels),
            VolumeChoice::Subpixels(Subpixels::Fixed(subpixels)),
        ]);
        Ok(Rung::aside(choices.without(&scene.typed)))
    }
}
