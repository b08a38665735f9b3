//! `resample view`: a file, live in a browser, drawn by this machine.
//!
//! Takes the words of the command that draws the file, and serves one page on this machine. The page sends cameras and
//! options; a thread that owns the scene draws them: quickly while something moves, then exactly as the command line would.
//!
//! `options_text` finds the command and takes the page's changes of it; `opened_scene` is the scene as it is drawn; `serve` speaks to
//! the browser; `mailbox` keeps the newest request; `render_thread` draws and answers; `ladder` chooses the size of moving
//! frames; `save` writes files; those that need pictures are drawn by a job on a thread of its own.

pub(crate) mod options_text;
pub(crate) mod opened_scene;
mod facts;
mod encode;
mod message;
mod mailbox;
pub(crate) mod serve;
mod ladder;
pub(crate) mod render_thread;
mod save;

use std::ffi::OsString;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Result;

use crate::args::words::content::Application;
use crate::args::{ServeArgs, ViewArgs};
use crate::process::report::Verbosity;
use crate::process::{interrupt, report};
use crate::threads;
use crate::values::input_file::Held;
use crate::view::opened_scene::OpenedScene;
use crate::view::options_text::Words;
use crate::view::render_thread::Studio;
use crate::view::serve::server::Server;

/// Reads the file, serves the page, and draws until Ctrl-C.
pub(crate) fn run(args: ViewArgs, verbosity: Verbosity) -> Result<()> {
    let words = Words::of(&args.words)?;
    let serve = words.serve.clone().or(args.serve);
    check_bind(&serve)?;
    threads::start(&words.global)?;
    let server = Server::bind(&serve)?;
    let verbosity = if words.global.quiet {
        Verbosity::Quiet
    } else {
        verbosity
    };
    // The page is there at once, and says that the file is being read.
    let address = server.address();
    let tunnel = server.tunnel();
    let mailbox = server.start()?;
    report::print(&format!("{address}\n"))?;
    if !serve.no_open {
        open_browser(&address);
    }
    interrupt::watch()?;
    let subject = OpenedScene::open(words, verbosity)?;
    if serve.no_open && verbosity != Verbosity::Quiet {
        report::say(&tunnel);
    }
    let _patience = interrupt::patience_of_viewer();
    Studio::new(subject, mailbox, Box::new(interrupt::asked)).run();
    report::say("viewer stopped");
    Ok(())
}

/// A page that is served beside another program, until it is closed or dropped.
pub struct Viewer {
    address: String,
    is_over: Arc<AtomicBool>,
}

impl Viewer {
    /// Reads the scene that `words` name, or takes that of memory, and serves its page on threads of its own. The words are
    /// those of `resample view` without the program's name.
    pub fn start(application: Application, words: &[OsString], held: Option<Held>) -> Result<Self> {
        let words = Words::of_program(application, words, held)?;
        check_bind(&words.serve)?;
        let server = Server::bind(&words.serve)?;
        let address = server.address();
        let subject = OpenedScene::open(words, Verbosity::Quiet)?;
        let mailbox = server.start()?;
        let is_over = Arc::new(AtomicBool::new(false));
        let own = is_over.clone();
        std::thread::Builder::new()
            .name("studio".to_owned())
            .spawn(move || {
                let is_over = Box::new(move || own.load(Ordering::Relaxed));
                Studio::new(subject, mailbox, is_over).run();
            })?;
        Ok(Self { address, is_over })
    }

    /// The address of the page, with its token.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// Ends the drawing; the page stays as it is.
    pub fn close(&self) {
        self.is_over.store(true, Ordering::Relaxed);
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.close();
    }
}

/// Other machines reach the page only where that was asked for.
fn check_bind(serve: &ServeArgs) -> Result<()> {
    if let Some(address) = serve.bind.filter(|address| !address.is_loopback()) {
        report::say(&format!(
            "warning: --bind {address}: whoever knows the address with its token can look at this file and save pictures beside it; \
             the connection is not encrypted"
        ));
    }
    Ok(())
}

/// Asks the desktop to show the page, where there is one.
fn open_browser(address: &str) {
    let has_desktop = cfg!(not(target_os = "linux"))
        || ["DISPLAY", "WAYLAND_DISPLAY"]
            .iter()
            .any(|name| std::env::var_os(name).is_some());
    if has_desktop && open::that_detached(address).is_err() {
        report::say("no browser could be opened: open the address above in one");
    }
}
