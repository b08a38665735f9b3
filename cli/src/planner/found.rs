//! A setting in the windows: its errors against the exact one, and the work of the whole pictures.
//!
//! Counts of a whole picture are those of the coarse picture times the ratio of both settings' counts in the windows,
//! which varies far less than the counts themselves.

use resample_core::{Camera, Image};

use super::estimate::{ViewErrors, WindowError};
use super::model::{COUNTS, Counts, OF_FRAME, Work};
use super::windows::{Window, Windows};
use crate::opened::Parts;

/// A picture or a window of one, and its work.
pub(super) struct Rendered {
    pub(super) image: Image,
    pub(super) work: Work,
    pub(super) cpu_ms: f64,
}

/// One of the pictures that are looked at.
pub(super) struct View {
    pub(super) camera: Camera,
    pub(super) windows: Windows,
    /// Counts of the whole coarse picture and of its windows, where both were drawn.
    pub(super) coarse: Option<(Counts, Vec<Counts>)>,
    /// Contrast of the coarse picture per covered pixel.
    pub(super) contrast: f64,
    pub(super) exact: Vec<Image>,
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

impl Found {
    /// Of no view yet; `fixed_cpu_ms` is the fixed cost of a window.
    pub(super) fn new(kind: String, fixed_cpu_ms: f64) -> Self {
        Self {
            errors: Vec::new(),
            frames: Vec::new(),
            frames_cpu_ms: Vec::new(),
            windows_work: Work {
                kind,
                counts: [0.0; COUNTS],
            },
            windows_cpu_ms: 0.0,
            windows: 0,
            fixed_cpu_ms,
        }
    }

    /// Adds the windows of a view.
    pub(super) fn add(&mut self, view: &View, drawn: &[Rendered], parts: Parts) {
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

/// Pixels of a picture.
pub(super) fn pixels(camera: &Camera) -> f64 {
    f64::from(camera.width) * f64::from(camera.height)
}
