//! A file that is written beside the viewing: the command that draws it runs on a thread of its own, with the scene read anew.
//!
//! Takes a command, gives news of it: pictures that are done, and the end. The page can cancel it.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::Instant;

use anyhow::{Result, bail};
use resample_core::Stop;

use crate::args::Drawing;
use crate::args::words::typed::Typed;
use crate::open::Opened;
use crate::picture::bands::Next;
use crate::plan::{Purpose, RunLog};
use crate::planner;
use crate::planner::Planned;
use crate::process::report::Verbosity;

/// A file that is being written.
pub(crate) struct Job {
    path: PathBuf,
    stop: Stop,
    news: Receiver<News>,
    thread: Option<JoinHandle<()>>,
}

/// News of a job.
pub(crate) enum News {
    /// Pictures that are done, and all of them.
    Progress(usize, usize),
    /// The file is there, or why it is not.
    Ended(Result<()>),
}

impl Job {
    /// Begins to draw and write.
    pub(crate) fn begin(path: PathBuf, drawing: Drawing) -> Result<Self> {
        let (to, news) = channel();
        let stop = Stop::default();
        let (own, file) = (stop.clone(), path.clone());
        let thread = std::thread::Builder::new()
            .name("writer".to_owned())
            .spawn(move || {
                let written = write(&file, drawing, &own, &to);
                // Nobody listens any more where the viewer has ended.
                let _ = to.send(News::Ended(written));
            })?;
        Ok(Self {
            path,
            stop,
            news,
            thread: Some(thread),
        })
    }

    /// The file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The next piece of news, if there is one.
    pub(crate) fn news(&self) -> Option<News> {
        self.news.try_recv().ok()
    }

    /// Asks for its end; the news say when it has come.
    pub(crate) fn cancel(&self) {
        self.stop.ask();
    }
}

impl Drop for Job {
    /// Waits for its end, so that no temporary file outlives the viewer.
    fn drop(&mut self) {
        self.cancel();
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has said so.
            let _ = thread.join();
        }
    }
}

fn write(path: &Path, drawing: Drawing, stop: &Stop, news: &Sender<News>) -> Result<()> {
    let follow = |done, total| {
        let _ = news.send(News::Progress(done, total));
        match stop.is_asked() {
            true => Next::Stop,
            false => Next::Draw,
        }
    };
    let log = RunLog {
        start: Instant::now(),
        verbosity: Verbosity::Quiet,
        follow: Some(&follow),
    };
    let planned = planner::planned(&drawing, &Typed::default(), Verbosity::Quiet)?;
    let (mut opened, record) = match planned {
        Some(Planned { opened, record }) => (opened, Some(record)),
        None => (
            Opened::read(drawing, Purpose::Draw, Verbosity::Quiet)?,
            None,
        ),
    };
    opened.stop_with(stop.clone());
    let written = opened.finish(record, log);
    if written.is_err() && stop.is_asked() {
        bail!("{}: cancelled", path.display());
    }
    written
}
