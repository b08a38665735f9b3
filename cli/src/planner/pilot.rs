//! The pilot: small windows of the pictures, drawn with the exact setting and with candidates.
//!
//! Takes an opened scene and gives, for any setting, its errors in the windows, and the work and the time of whole pictures.
//! Work is counted: it is the same on every machine, and decides how much may be looked at for an error. Time is measured:
//! it decides for a time.

use std::collections::BTreeMap;

use anyhow::Result;
use resample_core::{Camera, Image};

use crate::measure;
use crate::measure::Rendered;
use crate::open::setting::{Choices, Setting};
use crate::open::{Opened, Parts};
use crate::planner::ladder::{Ladder, Rung};
use crate::process::report::Cost;
use crate::values::{Bound, BoundMetric};
use resample_core::metrics::estimate::{MOST_VIEWS, ViewErrors, WindowError};
use resample_core::metrics::windows::{COVERED, Cells, TrialWindow, pixels};

/// A scene, its pictures, and the setting that was typed.
pub(super) struct PlannedScene<'a> {
    pub(super) opened: &'a mut Opened,
    /// At least one.
    pub(super) cameras: Vec<Camera>,
    pub(super) typed: Setting,
}

/// The windows of some of the pictures.
pub(super) struct Pilot {
    pub(super) views: Vec<View>,
    pub(super) guard_px: usize,
    /// Draws of each picture so far.
    pub(super) draws: usize,
    /// Pictures of the whole sequence.
    pub(super) pictures: usize,
    /// CPU time, ms, and work of all that the pilot has drawn.
    pub(super) cpu_ms: f64,
    pub(super) work: f64,
    /// Elapsed over CPU time of a picture.
    wall_per_cpu: f64,
    /// The choices whose change to more rays the views hold: at first those of the default.
    pub(super) compared: Choices,
    /// For each view where the default's rays were compared: its picture with twice the slab.
    pub(super) default_long: Vec<Image>,
}

/// One of the pictures that are looked at.
pub(super) struct View {
    pub(super) cells: Cells,
    pub(super) windows: Vec<TrialWindow>,
    /// The windows under the exact setting.
    exact: Vec<Image>,
}

impl View {
    /// A sum over all cells: it grows from the windows to the picture as the covered pixels do.
    fn whole(&self, parts: &[DrawnPart], of: impl Fn(&DrawnPart) -> f64) -> f64 {
        let (mut sum, mut covered) = (0.0, 0.0);
        for (window, part) in self.windows.iter().zip(parts) {
            let weight = window.draws as f64 / window.chance;
            sum += weight * of(part);
            covered += weight * part.covered;
        }
        sum * self.cells.covered_px / covered.max(1.0)
    }
}

/// The extent of a pilot: its views and previews.
pub(super) struct Effort {
    /// Pictures with windows.
    pub(super) views: usize,
    /// Pictures of which a preview is drawn.
    pub(super) previews: usize,
    pub(super) steps: Steps,
}

/// Where windows stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Steps {
    /// Also where the default changes the preview.
    Compared,
    /// Where the next dearer setting than the default changes the picture most: for the largest error.
    Ranked,
    /// On contrast alone.
    Ignored,
}

/// A preview has half of a picture's pixels along a side, and no more than this.
const MOST_PREVIEW_PX: u32 = 160;

/// Pictures with the most contrast that are looked at, and how far they are from one another: this part of the sequence.
const PEAKS: usize = 2;
const NEAR_SHARE: usize = 8;

/// Predicted times are those of the windows and this part more: they fell short by as much on scans and models.
const TIME_MARGIN: f64 = 1.2;

impl PlannedScene<'_> {
    /// Draws with a setting beyond the typed one from now on.
    pub(super) fn set(&mut self, rung: &Rung) -> Result<()> {
        self.opened.set(&self.typed.with(&rung.choices)?)
    }
}

/// The side of a window, px.
pub(super) fn side_px(scene: &PlannedScene) -> u32 {
    match scene.opened.parts() {
        Parts::Windows { side_px, .. } => side_px,
        Parts::Whole => u32::MAX,
    }
}

/// The camera of a picture's preview.
pub(super) fn preview_camera(camera: &Camera) -> Result<Camera> {
    let long_px = u64::from(camera.width.max(camera.height));
    let small = |px: u32| {
        let most = (u64::from(px) * u64::from(MOST_PREVIEW_PX)).div_ceil(long_px);
        px.div_ceil(2).min(most as u32)
    };
    Ok(camera.resized(small(camera.width), small(camera.height))?)
}

/// Small pictures by their places in the sequence.
struct Previews {
    candidate: Candidate,
    side_px: u32,
    seen: BTreeMap<usize, Cells>,
}

impl Previews {
    /// Two pictures of a sequence with the most contrast, far from one another: a flat object shows its narrow side twice in a turn.
    /// The search starts at evenly spaced pictures and goes on at both sides of the best, at half the distance each time. `draw` draws the
    /// preview of a picture, and keeps one that was drawn before.
    fn most_contrast(
        &mut self,
        pictures: usize,
        count: usize,
        mut draw: impl FnMut(&mut Self, usize) -> Result<()>,
    ) -> Result<Vec<usize>> {
        for place in places(pictures, count) {
            draw(self, place)?;
        }
        let near = pictures.div_ceil(NEAR_SHARE);
        let mut peaks = Vec::new();
        while peaks.len() < PEAKS
            && let Some(mut peak) = self.most(|place| {
                let is_far = |peak: &usize| place.abs_diff(*peak) > near;
                peaks.iter().all(is_far)
            })
        {
            let mut step = pictures / count;
            while step > 1 {
                step = step.div_ceil(2);
                draw(self, peak.saturating_sub(step))?;
                draw(self, (peak + step).min(pictures - 1))?;
                let about = peak;
                peak = self
                    .most(|place| place.abs_diff(about) <= step)
                    .unwrap_or(peak);
            }
            peaks.push(peak);
        }
        Ok(peaks)
    }

    /// The place of the one with the most contrast, among some.
    fn most(&self, among: impl Fn(usize) -> bool) -> Option<usize> {
        let seen = self.seen.iter().filter(|(place, _)| among(**place));
        let most = seen.max_by(|(_, a), (_, b)| a.contrast.total_cmp(&b.contrast));
        most.map(|(&place, _)| place)
    }
}

/// Numbers below `len`, evenly spaced.
fn places(len: usize, count: usize) -> Vec<usize> {
    let count = count.min(len);
    (0..count)
        .map(|k| (2 * k + 1) * len / (2 * count))
        .collect()
}

impl Pilot {
    /// Looks at small previews, and chooses the pictures with windows: evenly spaced, and the one with the most contrast for
    /// each covered pixel, because a thing that is seen from its narrow side has the largest error.
    pub(super) fn new(scene: &mut PlannedScene, ladder: &Ladder, effort: &Effort) -> Result<Self> {
        let cameras = scene.cameras.clone();
        let guard_px = match scene.opened.parts() {
            Parts::Windows { guard_px, .. } => guard_px,
            Parts::Whole => 0,
        };
        let mut pilot = Self {
            views: Vec::new(),
            guard_px,
            draws: 0,
            pictures: cameras.len(),
            cpu_ms: 0.0,
            work: 0.0,
            // Other work on the machine lengthens elapsed time alone.
            wall_per_cpu: 1.0,
            compared: ladder.default.choices.clone(),
            default_long: Vec::new(),
        };
        let mut previews = Previews {
            candidate: Candidate::new(&ladder.preview),
            side_px: side_px(scene),
            seen: BTreeMap::new(),
        };
        scene.set(&ladder.preview)?;
        let mut chosen = places(cameras.len(), effort.views);
        let draw = |previews: &mut Previews, place| pilot.preview(scene, previews, place);
        for most in previews.most_contrast(cameras.len(), effort.previews, draw)? {
            if let Some(nearest) = chosen.iter_mut().min_by_key(|place| place.abs_diff(most)) {
                *nearest = most;
            }
        }
        for place in chosen {
            pilot.preview(scene, &mut previews, place)?;
            let Some(mut cells) = previews.seen.remove(&place) else {
                continue;
            };
            if cells.count() > 0 {
                cells = match effort.steps {
                    Steps::Compared => pilot.compared(scene, ladder, &cells)?,
                    Steps::Ranked => pilot.ranked(scene, ladder, &cells)?,
                    Steps::Ignored => cells,
                };
                pilot.views.push(View {
                    cells,
                    windows: Vec::new(),
                    exact: Vec::new(),
                });
            }
        }
        Ok(pilot)
    }

    fn preview(
        &mut self,
        scene: &mut PlannedScene,
        previews: &mut Previews,
        place: usize,
    ) -> Result<()> {
        if previews.seen.contains_key(&place) {
            return Ok(());
        }
        let camera = scene.cameras[place];
        let long_px = u64::from(camera.width.max(camera.height));
        let small = preview_camera(&camera)?;
        let (seen, _) = self.drawn(scene, &previews.candidate, &small)?;
        let wall_per_cpu = seen.time.wall_ms / seen.time.cpu_ms.max(f64::MIN_POSITIVE);
        self.wall_per_cpu = self.wall_per_cpu.min(wall_per_cpu);
        let side_px = previews.side_px.min(long_px as u32);
        let cells = Cells::new(&camera, &seen.image, None, side_px);
        previews.seen.insert(place, cells);
        Ok(())
    }

    /// Draws, and counts the time and the work of it.
    pub(super) fn drawn(
        &mut self,
        scene: &mut PlannedScene,
        candidate: &Candidate,
        camera: &Camera,
    ) -> Result<(Rendered, Work)> {
        let seen = measure::rendered(scene.opened, camera)?;
        let work = candidate.work(&scene.typed, &seen.cost);
        self.cpu_ms += seen.time.cpu_ms;
        self.work += work.growing + work.fixed;
        Ok((seen, work))
    }

    /// Draws more windows of each picture.
    pub(super) fn add_windows(&mut self, draws: usize) {
        for view in &mut self.views {
            for draw in self.draws..self.draws + draws {
                let window = match view.cells.is_ranked() {
                    true => view.cells.next_in_rank(&view.windows),
                    false => view.cells.window(draw),
                };
                let Some(window) = window else {
                    continue;
                };
                match view
                    .windows
                    .iter_mut()
                    .find(|other| other.camera == window.camera)
                {
                    Some(same) => same.draws += 1,
                    None => view.windows.push(window),
                }
            }
        }
        self.draws += draws;
    }

    /// Draws the windows that a candidate has not been drawn in; those of the first one are what others are compared with.
    pub(super) fn measure(
        &mut self,
        scene: &mut PlannedScene,
        candidate: &mut Candidate,
    ) -> Result<()> {
        scene.set(&candidate.rung)?;
        candidate.parts.resize_with(self.views.len(), Vec::new);
        for v in 0..self.views.len() {
            for w in candidate.parts[v].len()..self.views[v].windows.len() {
                let camera = self.views[v].windows[w].camera;
                let (seen, work) = self.drawn(scene, candidate, &camera)?;
                let view = &mut self.views[v];
                let exact = view.exact.get(w).unwrap_or(&seen.image);
                let part = DrawnPart::new(&seen, work, exact, self.guard_px);
                candidate.parts[v].push(part);
                if view.exact.len() == w {
                    view.exact.push(seen.image);
                }
            }
        }
        Ok(())
    }

    /// The time that a candidate takes to draw next to nothing.
    pub(super) fn measure_fixed(
        &mut self,
        scene: &mut PlannedScene,
        candidate: &mut Candidate,
    ) -> Result<()> {
        if let Some(window) = self.views.first().and_then(|view| view.windows.first()) {
            let pixel = Camera {
                width: 1,
                height: 1,
                ..window.camera
            };
            let (seen, _) = self.drawn(scene, candidate, &pixel)?;
            candidate.fixed_ms = seen.time.cpu_ms;
        }
        Ok(())
    }

    /// Elapsed time of one whole picture, ms: of the one with the most contrast in all.
    pub(super) fn whole_ms(&self, scene: &mut PlannedScene, choices: &Choices) -> Result<f64> {
        scene.opened.set(&scene.typed.with(choices)?)?;
        let most = |cells: &Cells| cells.contrast * cells.covered_px;
        let views = self.views.iter().map(|view| &view.cells);
        let view = views.max_by(|a, b| most(a).total_cmp(&most(b)));
        let camera = *view.map_or(&scene.cameras[0], Cells::camera);
        let time = measure::rendered(scene.opened, &camera)?.time;
        Ok(time.wall_ms.min(time.cpu_ms * self.wall_per_cpu))
    }

    /// The errors of a candidate in the pictures.
    pub(super) fn errors(&self, candidate: &Candidate) -> Vec<ViewErrors> {
        // The change of the default to more rays bounds the error of the default alone: a dearer setting has a smaller one.
        let is_own = candidate.rung.choices == self.compared;
        let of_view = |(view, parts): (&View, &Vec<DrawnPart>)| ViewErrors {
            windows: view
                .windows
                .iter()
                .zip(parts)
                .map(|(window, part)| WindowError {
                    squares: part.squares,
                    max: part.max,
                    change: window.change,
                    chance: window.chance,
                    draws: window.draws,
                })
                .collect(),
            covered_px: view.cells.covered_px,
            cells: view.cells.count(),
            mean_square_change: view.cells.mean_square_change().filter(|_| is_own),
            change: view.cells.change(),
            change_behind: view.cells.change_behind(&view.windows),
        };
        self.views
            .iter()
            .zip(&candidate.parts)
            .map(of_view)
            .collect()
    }

    /// The work of a whole picture, the mean of those that are looked at.
    pub(super) fn picture_work(&self, candidate: &Candidate) -> f64 {
        let of_view = |(view, parts): (&View, &Vec<DrawnPart>)| {
            let fixed = parts.first().map_or(0.0, |part| part.work.fixed);
            fixed + view.whole(parts, |part| part.work.growing)
        };
        let all = self.views.iter().zip(&candidate.parts).map(of_view);
        all.sum::<f64>() / self.views.len().max(1) as f64
    }

    /// Elapsed time of the slowest of the pictures, ms, with a margin.
    pub(super) fn picture_ms(&self, candidate: &Candidate) -> f64 {
        let of_view = |(view, parts): (&View, &Vec<DrawnPart>)| {
            let times = parts.iter().map(|part| part.cpu_ms);
            let fixed = times.fold(candidate.fixed_ms, f64::min);
            fixed + view.whole(parts, |part| part.cpu_ms - fixed)
        };
        let all = self.views.iter().zip(&candidate.parts).map(of_view);
        TIME_MARGIN * all.fold(0.0, f64::max) * self.wall_per_cpu
    }

    /// Returns true if all pixels of the pictures that are looked at were compared under two settings.
    pub(crate) fn compared_all(&self) -> bool {
        let mut views = self.views.iter();
        views.all(|view| view.cells.mean_square_change().is_some())
    }

    /// Returns true if windows stand where whole pictures change most.
    pub(super) fn is_ranked(&self) -> bool {
        self.views.iter().all(|view| view.cells.is_ranked())
    }

    /// Returns true if anything is covered.
    pub(super) fn sees_something(&self) -> bool {
        !self.views.is_empty()
    }

    /// Pictures, windows, and the share of these pictures' pixels that the windows hold.
    pub(super) fn size(&self) -> (usize, usize, f64) {
        let windows = self.views.iter().flat_map(|view| &view.windows);
        let seen: f64 = windows.clone().map(|window| pixels(&window.camera)).sum();
        let all: f64 = self
            .views
            .iter()
            .map(|view| pixels(view.cells.camera()))
            .sum();
        (self.views.len(), windows.count(), seen / all.max(1.0))
    }
}

/// The bound that a person asked for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Asked {
    /// At most this error.
    Error(Bound),
    /// At most this time, ms.
    Time(f64),
}

/// Draws of each picture at a time.
pub(super) const DRAWS: usize = 4;

/// Part of a run under the exact setting that looking may take.
pub(super) const SHARE_OF_EXACT: f64 = 0.35;

/// Pictures of a sequence of which previews are drawn, for the one with the most contrast.
const PREVIEWS: usize = 16;

/// Pictures of a sequence that are looked at for a time.
const TIMED_VIEWS: usize = 3;

/// The effort for a bound; `None` where a look costs more than it can save.
pub(super) fn effort(scene: &PlannedScene, asked: Asked) -> Option<Effort> {
    let pictures = scene.cameras.len();
    let views = match asked {
        Asked::Error(_) if pictures > 1 => (pictures / 4).clamp(2, MOST_VIEWS),
        Asked::Error(_) => 1,
        Asked::Time(_) => pictures.min(TIMED_VIEWS),
    };
    if matches!(asked, Asked::Error(_)) && !may_pay(scene, views) {
        return None;
    }
    let previews = match asked {
        Asked::Error(_) => pictures.min(PREVIEWS),
        Asked::Time(_) => 0,
    };
    let steps = match (asked, &scene.typed) {
        (Asked::Error(bound), Setting::Volume(_)) => match bound.metric {
            BoundMetric::Rms => Steps::Compared,
            BoundMetric::Max => Steps::Ranked,
        },
        _ => Steps::Ignored,
    };
    Some(Effort {
        views,
        previews,
        steps,
    })
}

/// Returns true if a look might be worth its cost, as far as sizes show.
fn may_pay(scene: &PlannedScene, views: usize) -> bool {
    let cameras = &scene.cameras;
    let picture = cameras.iter().map(pixels).fold(0.0, f64::max);
    let least = (DRAWS as f64 * f64::from(side_px(scene)).powi(2)).min(picture);
    views as f64 * least <= SHARE_OF_EXACT * cameras.len() as f64 * picture
}

/// A setting in the windows.
pub(super) struct Candidate {
    pub(super) rung: Rung,
    /// The pixels drawn in each window of each view.
    pub(super) parts: Vec<Vec<DrawnPart>>,
    /// CPU time of a picture of one pixel, ms.
    pub(super) fixed_ms: f64,
}

#[derive(Clone, Copy)]
pub(super) struct DrawnPart {
    pub(super) cpu_ms: f64,
    pub(super) work: Work,
    pub(super) covered: f64,
    pub(super) squares: f64,
    pub(super) max: f64,
}

/// The work of a picture or a part of it, in any unit.
#[derive(Clone, Copy)]
pub(super) struct Work {
    /// The part that grows with the visible area.
    pub(super) growing: f64,
    /// The part that every window costs.
    pub(super) fixed: f64,
}

impl Candidate {
    pub(super) fn new(rung: &Rung) -> Self {
        Self {
            rung: rung.clone(),
            parts: Vec::new(),
            fixed_ms: 0.0,
        }
    }

    /// The work of a picture or a part of it. The counts of volumes and Gaussians grow with the setting; those of meshes and warps are of pixels,
    /// each of which takes the work of the rung.
    pub(super) fn work(&self, typed: &Setting, cost: &Cost) -> Work {
        let each = match typed {
            Setting::Volume(_) | Setting::Gaussians(_) => 1.0,
            Setting::Mesh(_) | Setting::Depth(_) | Setting::Points(_) => self.rung.work,
        };
        Work {
            growing: each * cost.growing,
            fixed: cost.fixed,
        }
    }
}

impl DrawnPart {
    /// A window and its picture under the exact setting; the outermost `guard_px` pixels are not compared.
    pub(super) fn new(seen: &Rendered, work: Work, exact: &Image, guard_px: usize) -> Self {
        let (squares, max) = errors(&seen.image, exact, guard_px);
        Self {
            cpu_ms: seen.time.cpu_ms,
            work,
            covered: covered_px(&seen.image),
            squares,
            max,
        }
    }
}

/// Covered pixels.
fn covered_px(image: &Image) -> f64 {
    image.rgba.iter().filter(|pixel| pixel[3] > COVERED).count() as f64
}

/// The sum of squares over the pixels that the exact part covers, and the largest change, both inside the rim; the squares as
/// if the rim were like the inside.
fn errors(image: &Image, exact: &Image, guard_px: usize) -> (f64, f64) {
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
                if exact[3] > COVERED {
                    squares += change * change;
                }
            }
        }
    }
    (
        squares * (width * height) as f64 / inside.max(1) as f64,
        max,
    )
}

#[cfg(test)]
mod tests;
