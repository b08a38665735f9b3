//! How far a long step is: a bar on stderr, once the step has proved to be long.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// Visibility of progress bars.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Progress {
    /// A bar, where stderr is a terminal.
    Shown,
    /// Nothing.
    Hidden,
}

/// A step that takes less shows no bar. A guess at what nobody wonders about.
const PATIENCE: Duration = Duration::from_secs(1);

/// Steps of a bar: finer than any terminal is wide.
const STEPS: u64 = 1000;

/// Takes the share of a step that is done, and shows it.
pub(crate) fn watch(step: &'static str, progress: Progress) -> impl FnMut(f64) {
    let start = Instant::now();
    let mut bar: Option<ProgressBar> = None;
    move |share| {
        if progress == Progress::Hidden || start.elapsed() < PATIENCE {
            return;
        }
        let bar = bar.get_or_insert_with(|| new_bar(step, start));
        bar.set_position((share * STEPS as f64) as u64);
        if share >= 1.0 {
            bar.finish_and_clear();
        }
    }
}

fn new_bar(step: &'static str, start: Instant) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {percent} %, {eta} left");
    ProgressBar::new(STEPS)
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        .with_message(step)
        .with_elapsed(start.elapsed())
}
