//! `resample view`: a file, live in a browser, drawn by this machine.
//!
//! Takes the words of the command that draws the file, and serves one page on this machine. The page sends cameras and
//! options; a thread that owns the scene draws them: quickly while something moves, then exactly as the command line would.
//!
//! `words` finds the command and takes the page's changes of it; `subject` is the scene as it is drawn; `server`, `http` and
//! `socket` speak to the browser; `mailbox` keeps the newest request; `studio` draws and answers; `ladder` chooses the
//! size of moving frames; `save` writes what was found by hand.

mod encode;
mod facts;
mod http;
mod ladder;
mod mailbox;
mod message;
mod page;
mod save;
mod sender;
mod server;
mod socket;
mod studio;
mod subject;
mod words;

use anyhow::Result;

use crate::args::{ServeArgs, ViewArgs};
use crate::interrupt;
use crate::report::{self, Verbosity};
use crate::threads;

use server::Server;
use studio::Studio;
use subject::Subject;
use words::Words;

/// Reads the file, serves the page, and draws until Ctrl-C.
pub(crate) fn run(args: ViewArgs, verbosity: Verbosity) -> Result<()> {
    let words = Words::of(&args.words);
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
    let mailbox = server.start()?;
    report::print(&format!("{address}\n"))?;
    if !serve.no_open {
        open_browser(&address);
    }
    interrupt::watch()?;
    let subject = Subject::open(words, verbosity)?;
    Studio::new(subject, mailbox).run()
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
