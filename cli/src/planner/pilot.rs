//! The pilot: small windows of the pictures, drawn with the exact setting and with candidates.
//!
//! Takes an opened scene, gives for any setting the errors in the windows and the counts of the whole picture. A coarse
//! picture shows the covered part and its contrast; windows stand there. Counts of the whole picture under a setting are
//! those of the coarse picture times the ratio of both settings' counts in the windows, which varies far less than the
//! counts themselves.

use anyhow::Result;
use resample_core::{Camera, Image};

use super::estimate::{ViewErrors, WindowError};
use super::fixed_cost::FixedCost;
use super::ladder::{self, Ladder};
use super::look::{self, Effort, Look, Part, WindowCost, places};
use super::model::{COUNTS, Counts, Model, OF_FRAME, Work, counts};
use super::subsample_windows::{Limit, ViewShare};
use super::windows::{self, Window, Windows};
use crate::measure;
use crate::opened::{Opened, Parts};
use crate::setting::Setting;

/// A scene, and the setting that was typed.
pub(super) struct Scene {
    pub(super) opened: Opened,
    pub(super) typed: Setting,
}

/// A picture or a window of one, and its work.
struct Rendered {
    image: Image,
    work: Work,
    cpu_ms: f64,
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

struct View {
    camera: Camera,
    windows: Windows,
    /// Counts of the whole coarse picture and of its windows, where both were drawn.
    coarse: Option<(Counts, Vec<Counts>)>,
    /// Contrast of the coarse picture per covered pixel.
    contrast: f64,
    exact: Vec<Image>,
}

/// How a coarse look is taken.
struct Coarse {
    setting: Setting,
    /// It shows every so many pixels.
    step: u32,
    /// Most pictures of a sequence that are looked at.
    looks: usize,
}

/// A setting in the windows.
#[derive(Clone, Debug)]
pub(super) struct Found {
    /// Errors of each view.
    pub(super) errors: Vec<ViewErrors>,
    /// The work of each view's whole picture.
    pub(super) frames: Vec<Work>,
    /// CPU time of each view's whole picture by the windows alone.
    pub(super) frames_cpu_ms: Vec<f64>,
    /// The work and the CPU time of all windows together, and their number.
    pub(super) windows_work: Work,
    pub(super) windows_cpu_ms: f64,
    pub(super) windows: usize,
    /// The CPU time of each window that does not depend on its content.
    pub(super) fixed_cpu_ms: f64,
}

impl Scene {
    /// Draws with a setting beyond what was typed.
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
        let mut found = Found {
            errors: Vec::new(),
            frames: Vec::new(),
            frames_cpu_ms: Vec::new(),
            windows_work: Work {
                kind: ladder::kind(&scene.typed.with(setting)?),
                counts: [0.0; COUNTS],
            },
            windows_cpu_ms: 0.0,
            windows: 0,
            fixed_cpu_ms: self.fixed_cost.fixed_ms(),
        };
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

impl Found {
    fn add(&mut self, view: &View, drawn: &[Rendered], parts: Parts) {
        let guard_px = match parts {
            Parts::Windows { guard_px, .. } => guard_px,
            Parts::Whole => 0,
        };
        let windows = &view.windows.list;
        let pairs = windows.iter().zip(drawn).enumerate();
        let errors = pairs.map(|(index, (window, part))| {
            let exact = view.exact.get(index).unwrap_or(&part.image);
            window_error(window, (&part.image, exact), guard_px)
        });
        self.errors.push(ViewErrors {
            windows: errors.collect(),
            covered_px: view.windows.covered_px,
            cells: view.windows.cells,
        });
        let draws: usize = windows.iter().map(|window| window.draws).sum();
        let mean = |of: &dyn Fn(usize) -> f64| -> f64 {
            let list = windows.iter().enumerate();
            let sum: f64 = list.map(|(k, w)| w.draws as f64 * of(k) / w.chance).sum();
            sum / draws.max(1) as f64
        };
        let mut counts = [0.0; COUNTS];
        for (i, count) in counts.iter_mut().enumerate() {
            *count = if i < OF_FRAME {
                drawn.first().map_or(0.0, |part| part.work.counts[i])
            } else if i == COUNTS - 1 {
                pixels(&view.camera)
            } else {
                let own = mean(&|k| drawn[k].work.counts[i]);
                own * view.coarse.as_ref().map_or(1.0, |(whole, windows)| {
                    let coarse = mean(&|k| windows[k][i]);
                    if coarse > 0.0 { whole[i] / coarse } else { 1.0 }
                })
            };
        }
        self.frames.push(Work {
            kind: self.windows_work.kind.clone(),
            counts,
        });
        self.frames_cpu_ms.push(mean(&|k| drawn[k].cpu_ms));
        self.windows += drawn.len();
        for part in drawn {
            self.windows_cpu_ms += part.cpu_ms;
            for (sum, count) in self.windows_work.counts.iter_mut().zip(part.work.counts) {
                *sum += count;
            }
        }
    }
}

/// Errors inside the rim of a window, the squares as if the rim were like the inside.
fn window_error(window: &Window, (image, exact): (&Image, &Image), guard_px: usize) -> WindowError {
    let (mut squares, mut max, mut inside) = (0.0, 0.0_f64, 0_usize);
    let (width, height) = (image.width, image.height);
    // A part that is nothing but rim counts whole.
    let guard = if width.min(height) > 2 * guard_px {
        guard_px
    } else {
        0
    };
    for y in guard..height - guard {
        let row = y * width + guard..(y + 1) * width - guard;
        for (pixel, exact) in image.rgba[row.clone()].iter().zip(&exact.rgba[row]) {
            inside += 1;
            for k in 0..3 {
                let change = f64::from(pixel[k]) - f64::from(exact[k]);
                max = max.max(change.abs());
                // As in the figures of a comparison under the mask of the exact picture.
                if exact[3] > 1.0 / 255.0 {
                    squares += change * change;
                }
            }
        }
    }
    squares *= (width * height) as f64 / inside.max(1) as f64;
    WindowError {
        squares,
        max,
        chance: window.chance,
        draws: window.draws,
    }
}

fn pixels(camera: &Camera) -> f64 {
    f64::from(camera.width) * f64::from(camera.height)
}
