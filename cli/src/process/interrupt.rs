//! Ctrl-C, SIGTERM, SIGHUP: the picture in work is finished, or the program ends at once; either way no half file stays behind.
//!
//! Takes the signal, gives a flag that is read between pictures. While pictures are drawn one after another, the
//! first Ctrl-C only sets the flag; a second one, or one at any other time, removes the temporary files and ends
//! the process. The files are listed here because a process that ends runs no destructors.
//! Limits: a process that is killed (SIGKILL) can leave a temporary file, named `.resample-*.tmp`; the next run into its
//! folder removes it.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use anyhow::{Context, Result};
use resample_io::write::remove_all_and_exit;

use crate::process::report;

/// The exit code after Ctrl-C: 128 and the number of the signal, as shells have it.
pub(crate) const EXIT_INTERRUPTED: u8 = 130;

/// Set by Ctrl-C, read between pictures.
static ASKED: AtomicBool = AtomicBool::new(false);

/// Set while the viewer runs, which says itself that it stops.
static IS_VIEWER: AtomicBool = AtomicBool::new(false);

/// How many loops are running that read the flag.
static PATIENT: AtomicUsize = AtomicUsize::new(0);

/// Why a run ended early. Its text says what there is and how to go on.
#[derive(Debug)]
pub struct Interrupted {
    /// The finished part, for people.
    pub state: String,
}

impl std::fmt::Display for Interrupted {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "interrupted: {}", self.state)
    }
}

impl std::error::Error for Interrupted {}

/// While one of these lives, the first Ctrl-C only sets the flag.
pub(crate) struct Patience(());

/// Listens for Ctrl-C from now on.
pub(crate) fn watch() -> Result<()> {
    ctrlc::set_handler(pressed).context("cannot listen for Ctrl-C")
}

/// Has everything that looks for Ctrl-C end, for programs that hear of it in their own way.
pub fn ask() {
    ASKED.store(true, Ordering::SeqCst);
}

/// Forgets a Ctrl-C of the past.
pub fn forget() {
    ASKED.store(false, Ordering::SeqCst);
}

/// Returns true if Ctrl-C was pressed.
pub(crate) fn asked() -> bool {
    ASKED.load(Ordering::SeqCst)
}

/// As [`patience`], for the viewer.
pub(crate) fn patience_of_viewer() -> Patience {
    IS_VIEWER.store(true, Ordering::SeqCst);
    patience()
}

/// Promises to read [`asked`] soon, for as long as the returned value lives.
pub(crate) fn patience() -> Patience {
    PATIENT.fetch_add(1, Ordering::SeqCst);
    Patience(())
}

impl Drop for Patience {
    fn drop(&mut self) {
        PATIENT.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Runs on a thread of its own, so it may lock and write.
fn pressed() {
    let again = ASKED.swap(true, Ordering::SeqCst);
    if !again && PATIENT.load(Ordering::SeqCst) > 0 {
        if !IS_VIEWER.load(Ordering::SeqCst) {
            report::say("Ctrl-C: ending after this picture; press again to end at once");
        }
        return;
    }
    remove_all_and_exit(i32::from(EXIT_INTERRUPTED))
}
