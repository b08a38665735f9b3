//! The pilot: small windows of the pictures, drawn with the exact setting and with candidates.
//!
//! Takes an opened scene, gives for any setting the errors in the windows and the work of the whole pictures ([`Found`]). A
//! coarse picture shows the covered part and its contrast; windows stand there.

use anyhow::Result;
use resample_core::Camera;

use super::fixed_cost::FixedCost;
use super::found::{Found, Rendered, View, pixels};
use super::ladder::{self, Ladder};
use super::look::{self, Effort, Look, Part, WindowCost, places};
use super::model::{Counts, Model, OF_FRAME, Work, counts};
use super::subsample_windows::{Limit, ViewShare};
use super::windows::{self, Windows};
use crate::measure;
use crate::opened::{Opened, Parts};
use crate::setting::Setting;

/// A scene, and the setting that was typed.
pub(super) struct Scene {
    pub(super) opened: Opened,
    pub(super) typed: Setting,
}

/// The windows of some of the pictures, and the exact setting in them.
pub(super) struct Pilot {
    views: Vec<View>,
    parts: Parts,
    /// Pictures of the whole sequence.
    pub(super) pictures: usize,
    /// The exact setting in the windows.
    pub(super) exact: Option<Found>,
    /// CPU time of all that the pilot has drawn, ms: measured, and by the model.
    pub(super) cpu_ms: f64,
    pub(super) model_ms: f64,
    model: Model,
    fixed_cost: FixedCost,
    /// The work that the windows may take under the exact setting.
    limit: Limit,
}

/// How a coarse look is taken.
struct Coarse {
    setting: Setting,
    /// It shows every so many pixels.
    step: u32,
    /// Most pictures of a sequence that are looked at.
    looks: usize,
}

impl Scene {
    /// Draws with a setting beyond the typed one.
    fn rendered(&mut self, setting: &Setting, camera: &Camera) -> Result<Rendered> {
        let setting = self.typed.with(setting)?;
        self.opened.set(&setting)?;
        let drawn = measure::rendered(&mut self.opened, camera)?;
        Ok(Rendered {
            work: Work {
                kind: ladder::kind(&setting),
                counts: counts(&drawn.keys, pixels(camera)),
            },
            image: drawn.image,
            cpu_ms: drawn.time.cpu_ms,
        })
    }
}

impl Pilot {
    /// Looks at the pictures coarsely, and at their windows with the exact setting; `None` where the effort does not allow
    /// a look.
    pub(super) fn new(
        scene: &mut Scene,
        ladder: &Ladder,
        (effort, model): (Effort, &Model),
    ) -> Result<Option<Self>> {
        let cameras = scene.opened.cameras().to_vec();
        let (pictures, parts) = (cameras.len(), scene.opened.parts());
        let most_pixels = cameras.iter().map(pixels).fold(0.0, f64::max);
        if effort == Effort::Affordable && !look::may_pay(parts, (pictures, most_pixels)) {
            return Ok(None);
        }
        let exact = ladder::kind(&scene.typed.with(&ladder.exact)?);
        let mut pilot = Self {
            views: Vec::new(),
            parts,
            pictures,
            exact: None,
            cpu_ms: 0.0,
            model_ms: 0.0,
            model: model.clone(),
            fixed_cost: FixedCost::default(),
            limit: Limit::new(exact, (pictures, effort)),
        };
        let coarse = Coarse {
            setting: ladder.coarse.clone(),
            step: match effort {
                Effort::Affordable => ladder.coarse_step,
                Effort::Any => 1,
            },
            looks: ladder.coarse_looks,
        };
        let middle = cameras[pictures / 2];
        let seen = pilot.coarse(scene, &coarse, &middle)?;
        let fixed = model.fixed_share(&pilot.limit.work(seen.work.counts));
        let window = |side| WindowCost {
            cells: windows::covered_cells(&middle, &seen.image, side),
            fixed,
        };
        let sides = look::sides(parts, most_pixels);
        let Some(look) = look::closest((parts, &sides), (pictures, effort), window) else {
            return Ok(None);
        };
        let mut chosen = places(pictures, look.views);
        if effort == Effort::Affordable && (2..pictures).contains(&look.views) {
            let worst = pilot.most_contrast(scene, &coarse, &cameras)?;
            if let Some(worst) = worst {
                look::include(&mut chosen, worst);
            }
        }
        let mut seen = Some(seen);
        for place in chosen {
            let camera = cameras[place];
            let whole = if camera == middle { seen.take() } else { None };
            pilot.add_view(scene, (&coarse, look), (camera, whole))?;
        }
        if !pilot.subsampled() {
            return Ok(None);
        }
        pilot.exact = Some(pilot.found(scene, &ladder.exact)?);
        Ok(Some(pilot))
    }

    /// The picture with the most contrast, of some: a thing that is seen from its narrow side has the largest error.
    fn most_contrast(
        &mut self,
        scene: &mut Scene,
        coarse: &Coarse,
        cameras: &[Camera],
    ) -> Result<Option<usize>> {
        let (mut worst, mut most) = (None, 0.0);
        for place in places(cameras.len(), cameras.len().min(coarse.looks)) {
            let seen = self.coarse(scene, coarse, &cameras[place])?;
            let contrast = windows::contrast(&seen.image);
            if contrast > most {
                (worst, most) = (Some(place), contrast);
            }
        }
        Ok(worst)
    }

    /// Adds one of the pictures that are looked at; its coarse picture is not drawn again.
    fn add_view(
        &mut self,
        scene: &mut Scene,
        (coarse, look): (&Coarse, Look),
        (camera, whole): (Camera, Option<Rendered>),
    ) -> Result<()> {
        let mut view = View {
            camera,
            windows: windows::whole(&camera),
            coarse: None,
            contrast: 0.0,
            exact: Vec::new(),
        };
        if let Part::Windows { side_px, draws } = look.part {
            let whole = match whole {
                Some(whole) => whole,
                None => self.coarse(scene, coarse, &camera)?,
            };
            view.contrast = windows::contrast(&whole.image);
            view.windows = windows::spread(&camera, &whole.image, (side_px, draws));
            // Counts of a picture that shows every so many pixels are no base for a ratio.
            if coarse.step == 1 {
                let growing_ms = self.model.growing_ms(&whole.work);
                self.fixed_cost.whole.add(whole.cpu_ms, growing_ms);
                let whole_counts = whole.work.counts;
                let mut counts = self.coarse_windows(scene, coarse, &view.windows)?;
                let share = self.limit.share(&self.model, whole_counts, &counts);
                let fewer = self
                    .limit
                    .draws(share * look.views as f64, self.parts, draws);
                if fewer < draws {
                    view.windows = windows::spread(&camera, &whole.image, (side_px, fewer));
                    counts = self.coarse_windows(scene, coarse, &view.windows)?;
                }
                view.coarse = Some((whole_counts, counts));
            }
        }
        self.views.push(view);
        Ok(())
    }

    /// Counts of coarse windows.
    fn coarse_windows(
        &mut self,
        scene: &mut Scene,
        coarse: &Coarse,
        windows: &Windows,
    ) -> Result<Vec<Counts>> {
        let mut counts = Vec::with_capacity(windows.list.len());
        for window in &windows.list {
            let seen = self.drawn(scene, &coarse.setting, &window.camera)?;
            let growing_ms = self.model.growing_ms(&seen.work);
            self.fixed_cost.windows.add(seen.cpu_ms, growing_ms);
            counts.push(seen.work.counts);
        }
        Ok(counts)
    }

    /// Looks at a whole picture coarsely. Counts are those of all its pixels, about.
    fn coarse(&mut self, scene: &mut Scene, coarse: &Coarse, camera: &Camera) -> Result<Rendered> {
        let small = camera.resized(
            camera.width.div_ceil(coarse.step),
            camera.height.div_ceil(coarse.step),
        )?;
        let small = if coarse.step == 1 { *camera } else { small };
        let mut seen = self.drawn(scene, &coarse.setting, &small)?;
        let more = pixels(camera) / pixels(&small);
        for count in &mut seen.work.counts[OF_FRAME..] {
            *count *= more;
        }
        seen.image = windows::enlarged(seen.image, camera);
        Ok(seen)
    }

    /// Draws, and counts the time of it.
    fn drawn(&mut self, scene: &mut Scene, setting: &Setting, camera: &Camera) -> Result<Rendered> {
        let rendered = scene.rendered(setting, camera)?;
        self.cpu_ms += rendered.cpu_ms;
        self.model_ms += self.model.likely_cpu_ms(&rendered.work);
        Ok(rendered)
    }

    /// Leaves out pictures until the windows can be afforded; whether they can.
    fn subsampled(&mut self) -> bool {
        let share = |view: &View| ViewShare {
            share: view.coarse.as_ref().map_or(0.0, |(whole, windows)| {
                self.limit.share(&self.model, *whole, windows)
            }),
            contrast: view.contrast,
        };
        let shares: Vec<ViewShare> = self.views.iter().map(share).collect();
        let Some(kept) = self.limit.kept(&shares, self.pictures) else {
            return false;
        };
        let mut place = 0..;
        self.views
            .retain(|_| place.next().is_some_and(|place| kept.contains(&place)));
        true
    }

    /// Draws the windows with a setting; all others are compared with the first one.
    pub(super) fn found(&mut self, scene: &mut Scene, setting: &Setting) -> Result<Found> {
        let kind = ladder::kind(&scene.typed.with(setting)?);
        let mut found = Found::new(kind, self.fixed_cost.fixed_ms());
        for k in 0..self.views.len() {
            let list = self.views[k].windows.list.iter();
            let cameras: Vec<Camera> = list.map(|window| window.camera).collect();
            let mut parts = Vec::with_capacity(cameras.len());
            for camera in &cameras {
                parts.push(self.drawn(scene, setting, camera)?);
            }
            let view = &mut self.views[k];
            // Of a whole picture the exact one shows what is covered.
            if let ([part], true) = (&parts[..], view.exact.is_empty() && view.windows.cells == 1) {
                view.windows.covered_px = windows::covered_px(&part.image);
            }
            found.add(view, &parts, self.parts);
            if view.exact.len() < parts.len() {
                view.exact = parts.into_iter().map(|part| part.image).collect();
            }
        }
        Ok(found)
    }

    /// Whether anything is covered.
    pub(super) fn sees_something(&self) -> bool {
        self.views.iter().any(|view| view.windows.covered_px > 0.0)
    }

    /// Views, windows, and the share of these views' pixels that the windows hold.
    pub(super) fn size(&self) -> (usize, usize, f64) {
        let windows = self.views.iter().flat_map(|view| &view.windows.list);
        let seen: f64 = windows.clone().map(|window| pixels(&window.camera)).sum();
        let all: f64 = self.views.iter().map(|view| pixels(&view.camera)).sum();
        (self.views.len(), windows.count(), seen / all.max(1.0))
    }
}
