//! The pilot: small windows of the pictures, drawn with the exact setting and with candidates.
//!
//! Takes an opened scene, gives for any setting the errors in the windows and the counts of the whole picture. A coarse
//! picture shows what is covered and where contrast is; windows stand there. Counts of the whole picture under a
//! setting are those of the coarse picture times the ratio of both settings' counts in the windows, which varies far
//! less than the counts themselves.

mod thin;
mod took;

use anyhow::Result;
use resample_core::{Camera, Image};

use self::thin::Limit;
use self::took::Took;
use super::estimate::{ViewErrors, WindowError};
use super::ladders;
use super::look::{self, Effort, Part, WindowCost};
use super::model::{COUNTS, Counts, Model, OF_FRAME, counts, milliseconds};
use super::windows::{self, Window, Windows};
use crate::args::Command;
use crate::commands::{Opened, Parts};
use crate::words;

/// A scene under the settings of a command.
pub(super) struct Scene {
    pub(super) opened: Opened,
    /// What a part of its pictures is.
    pub(super) parts: Parts,
    /// The command without the options of the planner.
    pub(super) words: Vec<String>,
}

/// What was drawn.
struct Sight {
    image: Image,
    counts: Counts,
    cpu_ms: f64,
    /// Under the settings of this kind of work.
    path: String,
}

/// The windows of some of the pictures, and what the exact setting shows in them.
pub(super) struct Pilot {
    views: Vec<View>,
    /// Pictures of the whole sequence.
    pub(super) pictures: usize,
    /// Rim of a window that does not count, px.
    guard_px: usize,
    /// The exact setting in the windows.
    pub(super) exact: Option<Found>,
    /// CPU time of all that the pilot has drawn, ms: measured, and by the model.
    pub(super) cpu_ms: f64,
    pub(super) model_ms: f64,
    model: Model,
    /// What coarse pictures and their windows took.
    took: Took,
    /// What the windows may take under the exact setting.
    limit: Limit,
}

struct View {
    camera: Camera,
    windows: Windows,
    /// Counts of the whole coarse picture and of its windows, where both were drawn.
    coarse: Option<(Counts, Vec<Counts>)>,
    /// Contrast of the coarse picture per covered pixel.
    unrest: f64,
    exact: Vec<Image>,
}

/// How a coarse look is taken.
struct Coarse {
    command: Command,
    /// It shows every so many pixels.
    step: u32,
    /// Most pictures of a sequence that are looked at.
    looks: usize,
}

/// What the pilot found of a setting.
#[derive(Clone, Debug)]
pub(super) struct Found {
    /// The kind of work.
    pub(super) path: String,
    /// Errors of each view.
    pub(super) errors: Vec<ViewErrors>,
    /// Counts of each view's whole picture.
    pub(super) frames: Vec<Counts>,
    /// CPU time and counts of all windows together.
    pub(super) windows_cpu_ms: f64,
    pub(super) windows_counts: Counts,
    /// What all windows take by the model.
    pub(super) windows_model_ms: f64,
    /// How many windows there are, and the CPU time of each that does not depend on what it shows.
    pub(super) windows: usize,
    pub(super) fixed_cpu_ms: f64,
    /// CPU time of each view's whole picture by the windows alone.
    pub(super) frames_cpu_ms: Vec<f64>,
}

impl Scene {
    /// The command under a setting.
    pub(super) fn command(&self, setting: &[String]) -> Result<Command> {
        Ok(words::parsed(&words::with(&self.words, setting))?.command)
    }

    fn draw(&mut self, command: &Command, camera: &Camera) -> Result<Sight> {
        let drawn = self.opened.draw(command, camera)?;
        let pixels = f64::from(camera.width) * f64::from(camera.height);
        Ok(Sight {
            image: drawn.image,
            counts: counts(&drawn.account.keys, pixels),
            cpu_ms: milliseconds(&drawn.account.keys, "cpu_ms"),
            path: ladders::path(command),
        })
    }
}

impl Pilot {
    /// Looks at the pictures coarsely, and at their windows with the exact setting; `None` where the effort does not allow
    /// a look.
    pub(super) fn new(
        scene: &mut Scene,
        family: &ladders::Family,
        (effort, model): (Effort, &Model),
    ) -> Result<Option<Self>> {
        let pictures = scene.opened.cameras().len();
        let guard_px = match scene.parts {
            Parts::Windows { guard_px, .. } => guard_px,
            Parts::Whole => 0,
        };
        let pixels = scene
            .opened
            .cameras()
            .iter()
            .map(pixels)
            .fold(0.0, f64::max);
        if effort == Effort::Affordable && !look::may_pay(scene.parts, (pictures, pixels)) {
            return Ok(None);
        }
        let mut pilot = Self {
            views: Vec::new(),
            pictures,
            guard_px,
            exact: None,
            cpu_ms: 0.0,
            model_ms: 0.0,
            model: model.clone(),
            took: Took::default(),
            limit: Limit::new(
                ladders::path(&scene.command(&family.exact)?),
                (pictures, effort),
            ),
        };
        let coarse = Coarse {
            command: scene.command(&family.coarse)?,
            step: if effort == Effort::Affordable {
                family.coarse_step
            } else {
                1
            },
            looks: family.coarse_looks,
        };
        let middle = chosen(scene.opened.cameras(), 1)[0];
        let seen = pilot.coarse(scene, &coarse, &middle)?;
        let fixed = pilot.model.fixed_share(&pilot.limit.path, &seen.counts);
        let window = |side| WindowCost {
            cells: windows::covered_cells(&middle, &seen.image, side),
            fixed,
        };
        let sides = look::sides(scene.parts, pixels);
        let Some(look) = look::closest((scene.parts, &sides), (pictures, effort), window) else {
            return Ok(None);
        };
        let cameras = match effort {
            Effort::Affordable => pilot.with_worst(scene, &coarse, look.views)?,
            Effort::Any => chosen(scene.opened.cameras(), look.views),
        };
        let mut seen = Some(seen);
        for camera in cameras {
            let sight = if camera == middle { seen.take() } else { None };
            pilot.add_view(scene, (&coarse, look.views), (camera, look.part, sight))?;
        }
        if !pilot.thinned() {
            return Ok(None);
        }
        pilot.exact = Some(pilot.found(scene, &family.exact)?);
        Ok(Some(pilot))
    }

    /// The cameras that are looked at: evenly spaced, but for the one that is nearest to the picture with the most unrest,
    /// in whose place that one is taken. A thing that is seen from its narrow side has the largest error.
    fn with_worst(
        &mut self,
        scene: &mut Scene,
        coarse: &Coarse,
        count: usize,
    ) -> Result<Vec<Camera>> {
        let cameras = scene.opened.cameras().to_vec();
        let mut views = places(cameras.len(), count);
        if count < cameras.len() && count > 1 {
            let (mut worst, mut most) = (views[0], 0.0);
            for place in places(cameras.len(), cameras.len().min(coarse.looks)) {
                let unrest = windows::unrest(&self.coarse(scene, coarse, &cameras[place])?.image);
                if unrest > most {
                    (worst, most) = (place, unrest);
                }
            }
            thin::include(&mut views, worst);
        }
        Ok(views.into_iter().map(|place| cameras[place]).collect())
    }

    /// Adds one of `views` pictures that are looked at; what was seen of it coarsely is not drawn again.
    fn add_view(
        &mut self,
        scene: &mut Scene,
        (coarse, views): (&Coarse, usize),
        (camera, part, seen): (Camera, Part, Option<Sight>),
    ) -> Result<()> {
        let Part::Windows { side_px, draws } = part else {
            let windows = windows::whole(&camera);
            self.views.push(View {
                camera,
                windows,
                coarse: None,
                unrest: 0.0,
                exact: Vec::new(),
            });
            return Ok(());
        };
        let whole = match seen {
            Some(sight) => sight,
            None => self.coarse(scene, coarse, &camera)?,
        };
        let mut windows = windows::spread(&camera, &whole.image, (side_px, draws));
        self.took.whole.add(&self.model, &whole);
        let mut counts = self.coarse_windows(scene, coarse, &windows)?;
        let fewer = self.affordable_draws(views, (&whole.counts, &counts), (scene.parts, draws));
        if fewer < draws {
            windows = windows::spread(&camera, &whole.image, (side_px, fewer));
            counts = self.coarse_windows(scene, coarse, &windows)?;
        }
        let unrest = windows::unrest(&whole.image);
        let coarse = (coarse.step == 1).then_some((whole.counts, counts));
        self.views.push(View {
            camera,
            windows,
            coarse,
            unrest,
            exact: Vec::new(),
        });
        Ok(())
    }

    /// Counts of coarse windows; none where only every so many pixels are shown.
    fn coarse_windows(
        &mut self,
        scene: &mut Scene,
        coarse: &Coarse,
        windows: &Windows,
    ) -> Result<Vec<Counts>> {
        let list = if coarse.step == 1 {
            &windows.list[..]
        } else {
            &[]
        };
        let mut counts = Vec::with_capacity(list.len());
        for window in list {
            let sight = self.drawn(scene, &coarse.command, &window.camera)?;
            self.took.windows.add(&self.model, &sight);
            counts.push(sight.counts);
        }
        Ok(counts)
    }

    /// Looks at a whole picture coarsely. Counts are those of all its pixels, about.
    fn coarse(&mut self, scene: &mut Scene, coarse: &Coarse, camera: &Camera) -> Result<Sight> {
        if coarse.step == 1 {
            return self.drawn(scene, &coarse.command, camera);
        }
        let small = camera.resized(
            camera.width.div_ceil(coarse.step),
            camera.height.div_ceil(coarse.step),
        )?;
        let mut sight = self.drawn(scene, &coarse.command, &small)?;
        let more = pixels(camera) / pixels(&small);
        sight.counts[OF_FRAME..]
            .iter_mut()
            .for_each(|count| *count *= more);
        sight.image = windows::enlarged(sight.image, camera);
        Ok(sight)
    }

    /// Draws, and counts what that took.
    fn drawn(&mut self, scene: &mut Scene, command: &Command, camera: &Camera) -> Result<Sight> {
        let sight = scene.draw(command, camera)?;
        self.cpu_ms += sight.cpu_ms;
        self.model_ms += self.model.likely_cpu_ms(&sight.path, &sight.counts);
        Ok(sight)
    }

    /// Draws the windows with a setting; the first one is what all others are compared with.
    pub(super) fn found(&mut self, scene: &mut Scene, setting: &[String]) -> Result<Found> {
        let command = scene.command(setting)?;
        let mut found = Found {
            path: ladders::path(&command),
            errors: Vec::new(),
            frames: Vec::new(),
            windows_cpu_ms: 0.0,
            windows_counts: [0.0; COUNTS],
            windows_model_ms: 0.0,
            windows: 0,
            fixed_cpu_ms: self.took.fixed_ms(),
            frames_cpu_ms: Vec::new(),
        };
        for k in 0..self.views.len() {
            let cameras: Vec<Camera> = self.views[k]
                .windows
                .list
                .iter()
                .map(|window| window.camera)
                .collect();
            let mut sights = Vec::with_capacity(cameras.len());
            for camera in &cameras {
                sights.push(self.drawn(scene, &command, camera)?);
            }
            let view = &mut self.views[k];
            // Of a whole picture the exact one tells what is covered.
            if let ([sight], true) = (
                &sights[..],
                view.exact.is_empty() && view.windows.cells == 1,
            ) {
                view.windows.covered_px = windows::covered_px(&sight.image);
            }
            found.add(view, &sights, self.guard_px);
            if view.exact.len() < sights.len() {
                view.exact = sights.into_iter().map(|sight| sight.image).collect();
            }
        }
        found.windows_model_ms = self.model.likely_cpu_ms(&found.path, &found.windows_counts);
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
    fn add(&mut self, view: &View, sights: &[Sight], guard_px: usize) {
        let windows = &view.windows.list;
        let exact = if view.exact.is_empty() {
            None
        } else {
            Some(&view.exact)
        };
        let errors = windows
            .iter()
            .zip(sights)
            .enumerate()
            .map(|(index, (window, sight))| {
                let exact = exact.map_or(&sight.image, |images| &images[index]);
                window_error(window, (&sight.image, exact), guard_px)
            });
        self.errors.push(ViewErrors {
            windows: errors.collect(),
            covered_px: view.windows.covered_px,
            cells: view.windows.cells,
        });
        let of = |sights: &dyn Fn(usize) -> f64| -> f64 {
            let list = windows.iter().enumerate();
            let draws: usize = windows.iter().map(|window| window.draws).sum();
            list.map(|(k, w)| w.draws as f64 * sights(k) / w.chance)
                .sum::<f64>()
                / draws.max(1) as f64
        };
        self.frames.push(std::array::from_fn(|i| {
            if i < OF_FRAME {
                return sights.first().map_or(0.0, |sight| sight.counts[i]);
            }
            let own = of(&|k| sights[k].counts[i]);
            match &view.coarse {
                _ if i == COUNTS - 1 => pixels(&view.camera),
                Some((whole, windows)) => {
                    let coarse = of(&|k| windows[k][i]);
                    if coarse > 0.0 {
                        whole[i] * own / coarse
                    } else {
                        own
                    }
                }
                None => own,
            }
        }));
        self.frames_cpu_ms.push(of(&|k| sights[k].cpu_ms));
        self.windows += sights.len();
        for sight in sights {
            self.windows_cpu_ms += sight.cpu_ms;
            self.windows_counts
                .iter_mut()
                .zip(sight.counts)
                .for_each(|(sum, count)| *sum += count);
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
                squares += if exact[3] > 1.0 / 255.0 {
                    change * change
                } else {
                    0.0
                };
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

/// Some of the cameras, evenly spaced.
fn chosen(cameras: &[Camera], count: usize) -> Vec<Camera> {
    places(cameras.len(), count)
        .into_iter()
        .map(|place| cameras[place])
        .collect()
}

/// Numbers below `len`, evenly spaced.
fn places(len: usize, count: usize) -> Vec<usize> {
    (0..count)
        .map(|k| (2 * k + 1) * len / (2 * count))
        .collect()
}

fn pixels(camera: &Camera) -> f64 {
    f64::from(camera.width) * f64::from(camera.height)
}
