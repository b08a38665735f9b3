//! Fair timing of several renderers on a machine that other work shares.
//!
//! Takes renderers and the cameras of a short animation, gives each one's CPU times and its last frame. All renderers
//! draw one camera before any draws the next, so a busy minute burdens them alike; one thread, process-CPU time, and
//! the median or the least over the frames do the rest. Limits: caches are cold for each frame, which costs all of
//! them a little; nothing else may run in the process meanwhile.

use resample_core::{Camera, Image};
use volsplat::{FrameStats, RenderOptions, Renderer, TransferFunction, Volume};

use crate::frames::one_thread;

/// A renderer in the comparison, and what it has shown so far.
pub struct Entrant {
    /// Its name in tables.
    pub name: String,
    /// Cost of every frame that was timed, in order.
    pub stats: Vec<FrameStats>,
    /// The last frame.
    pub image: Image,
    renderer: Renderer,
}

impl Entrant {
    /// Classifies the volume for these options.
    ///
    /// # Panics
    /// If the options are out of range.
    pub fn new(name: &str, subject: (&Volume, &TransferFunction), options: &RenderOptions) -> Self {
        let renderer =
            Renderer::new(subject.0, subject.1, options).expect("options within their ranges");
        Self {
            name: name.to_owned(),
            stats: Vec::new(),
            image: Image::transparent(0, 0),
            renderer,
        }
    }

    /// Median over the frames of the CPU time, ms; the upper one of an even number.
    ///
    /// # Panics
    /// Before the first frame.
    pub fn median_cpu_ms(&self) -> f64 {
        let mut times: Vec<f64> = self.stats.iter().map(|stats| stats.cpu_ms).collect();
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    }

    /// Least over the frames of some stage's time.
    pub fn least(&self, stage: impl Fn(&FrameStats) -> f64) -> f64 {
        self.stats.iter().map(stage).fold(f64::INFINITY, f64::min)
    }

    /// Counts of the last frame.
    ///
    /// # Panics
    /// Before the first frame.
    pub fn last(&self) -> &FrameStats {
        self.stats.last().expect("a frame was drawn")
    }
}

/// Draws every camera with every entrant, on one thread. The frames of the first `warm_up` cameras are not timed.
///
/// # Panics
/// If a camera is not valid.
pub fn run(entrants: &mut [Entrant], cameras: &[Camera], warm_up: usize) {
    let pool = one_thread();
    for (number, camera) in cameras.iter().enumerate() {
        for entrant in entrants.iter_mut() {
            let frame = pool
                .install(|| entrant.renderer.render(camera))
                .expect("a valid camera");
            entrant.image = frame.image;
            if number >= warm_up {
                entrant.stats.push(frame.stats);
            }
        }
    }
}
