//! A setting in the windows: its errors, its work and its time in each of them.

use resample_core::Image;

use super::ladder::Rung;
use super::windows::COVERED;
use crate::measure::Rendered;
use crate::open::setting::Setting;
use crate::process::report::Cost;

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

    /// The work of a picture or a part of it. A volume's counts grow with the setting; those of meshes and warps are of pixels,
    /// each of which takes the work of the rung.
    pub(super) fn work(&self, typed: &Setting, cost: &Cost) -> Work {
        let each = match typed {
            Setting::Volume(_) => 1.0,
            Setting::Mesh(_) | Setting::Depth(_) => self.rung.work,
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
