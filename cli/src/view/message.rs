//! Messages between the page and the server: JSON texts, and pictures behind a JSON head; and the jobs that some of them start.
//!
//! A job is a file that is written beside the viewing: the command that draws it runs on a thread of its own, with the scene read anew. It
//! sends news of pictures that are done, and the page can cancel it.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::Instant;

use anyhow::{Result, bail};
use resample_core::Stop;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::args::Drawing;
use crate::args::words::typed::Typed;
use crate::open::Opened;
use crate::plan::{Purpose, RunLog};
use crate::planner;
use crate::planner::Planned;
use crate::process::report::Verbosity;
use crate::view::options_text::Changes;
use resample_core::camera::bands::Next;

/// The view that the page requests.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub(crate) struct View {
    /// A camera in the words of a camera file: position, target, up, and fov_y or projection and height.
    pub(crate) camera: Value,
    /// Width and height, px.
    pub(crate) size: [u32; 2],
    /// Options by name.
    #[serde(default)]
    pub(crate) changes: Changes,
    /// A transfer function in the form of ParaView, with display colours.
    #[serde(default)]
    pub(crate) transfer: Option<Value>,
    /// A table of labels in the form of a label file, with display colours.
    #[serde(default)]
    pub(crate) labels: Option<Value>,
    /// How exact a resting picture is.
    #[serde(default)]
    pub(crate) exactness: Exactness,
    /// The step of a volume over time.
    #[serde(default)]
    pub(crate) step: usize,
}

/// How exact a resting picture is.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Exactness {
    /// As moving pictures, at full size.
    Fast,
    /// As the command line draws.
    #[default]
    Default,
    /// With an error of at most 1/64 against the most exact setting.
    #[serde(rename = "1/64")]
    Within64,
    /// With an error of at most 1/255.
    #[serde(rename = "1/255")]
    Within255,
    /// The most exact setting.
    Exact,
}

impl Exactness {
    /// The bound of the error, in the words of `--max-error`.
    pub(crate) fn bound(self) -> Option<&'static str> {
        match self {
            Self::Within64 => Some("1/64"),
            Self::Within255 => Some("1/255"),
            Self::Fast | Self::Default | Self::Exact => None,
        }
    }
}

/// The state of the camera: moving pictures are replaced by the next, resting ones are looked at.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Motion {
    /// Quickly, and smaller if need be.
    Moving,
    /// To the end.
    Resting,
}

/// A request of the page.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub(crate) enum Asked {
    /// Draw this, and forget what was asked for before.
    Draw {
        id: u32,
        motion: Motion,
        #[serde(flatten)]
        view: View,
    },
    /// This picture is on the screen.
    Shown { id: u32 },
    /// The point under a place of the picture, px.
    Probe {
        at: [f64; 2],
        /// A word of the page's own, which comes back with the answer.
        #[serde(default)]
        purpose: Option<String>,
        #[serde(flatten)]
        view: View,
    },
    /// A small picture of a preset.
    Thumbnail {
        preset: String,
        #[serde(flatten)]
        view: View,
    },
    /// The command line that draws this.
    Command {
        #[serde(flatten)]
        view: View,
    },
    /// A slice of the volume along an axis of its grid, from 0.
    Slice {
        axis: usize,
        index: usize,
        /// Values that are black and white.
        window: [f64; 2],
    },
    /// The transfer function in the text of a file of ParaView or Slicer.
    Look { name: String, text: String },
    /// End the picture in work, and the file that is being written.
    Cancel,
    /// Write a file into the folder where the command was started.
    Save {
        what: Saved,
        name: String,
        #[serde(flatten)]
        view: View,
        /// The key frames of a path or a film, the cameras of a turntable, or the state of the page for a session.
        #[serde(default)]
        detail: Value,
        /// Where the file goes.
        #[serde(default)]
        to: Goal,
    },
}

/// Where a saved file goes.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Goal {
    /// Into the folder where the command was started.
    #[default]
    Folder,
    /// To the machine of the page.
    Page,
}

/// The kind of a saved file.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Saved {
    Picture,
    Transfer,
    Labels,
    Camera,
    Path,
    Turntable,
    Film,
    Session,
}

/// The head of a picture.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct PictureHead {
    pub(crate) id: u32,
    /// "moving", "resting", "thumbnail", "slice" or "file".
    pub(crate) kind: &'static str,
    /// Name of the preset of a thumbnail, of the axis of a slice, or of a file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) name: Option<String>,
    /// MIME type of the bytes behind the head.
    pub(crate) format: &'static str,
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// Wall time of the drawing, ms.
    pub(crate) draw_ms: f64,
    /// True if this is the last picture of the view.
    pub(crate) is_last: bool,
}

impl PictureHead {
    /// Length of the head (4 bytes, little-endian), head, picture.
    pub(crate) fn with(&self, picture: &[u8]) -> Vec<u8> {
        // A struct of numbers and words can always be written.
        let head = serde_json::to_vec(self).unwrap_or_default();
        let length = u32::try_from(head.len()).unwrap_or_default();
        [&length.to_le_bytes()[..], &head, picture].concat()
    }
}

/// A file that is being written.
pub(crate) struct Job {
    path: PathBuf,
    to: Goal,
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
    pub(crate) fn begin(path: PathBuf, to: Goal, drawing: Drawing) -> Result<Self> {
        let goal = to;
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
            to: goal,
            stop,
            news,
            thread: Some(thread),
        })
    }

    /// The file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Where the file goes.
    pub(crate) fn goal(&self) -> Goal {
        self.to
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
