//! The thread that owns the scene: it takes the newest request, draws, sends, and answers questions.
//!
//! While something moves, a picture is quick and as large as `ladder` allows. At rest it is drawn twice: quickly in full
//! size, then as the command line draws it, in bands of rows, so that a new request need not wait for all of it. Every
//! band shows the pixels that the whole picture would show.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use resample_core::{Camera, Image, Stop};
use serde_json::{Value, json};

use super::ladder::Ladder;
use super::mailbox::Sender;
use super::mailbox::{Mailbox, Next as Request};
use super::message::{Asked, Exactness, Goal, Motion, PictureHead, Saved, View};
use super::message::{Job, News};
use super::save::Saving;
use super::{encode, save};
use crate::view::opened_scene::OpenedScene;
use resample_core::camera::bands;
use resample_core::camera::bands::{Next, Pace, Window};

/// Time after which the end is looked for.
const IDLE: Duration = Duration::from_millis(200);

/// Longest wait for the page to show a picture before the next is sent: a page in the background shows none.
const SHOWN_PATIENCE: Duration = Duration::from_millis(500);

/// Pixels of a band at rest: some 100 ms of work. A guess.
const BAND_PX: u32 = 160 * 1024;

/// Options of the page that a preset replaces.
const WITH_LOOK: [&str; 6] = ["window", "colormap", "preset", "shade", "blend", "light"];

/// Time between two messages on how much of a picture is done.
const PROGRESS: Duration = Duration::from_millis(500);

/// Side of a preset's picture, px.
const THUMBNAIL_PX: u32 = 96;

/// Draws what the page asks for.
pub(crate) struct Studio {
    subject: OpenedScene,
    mailbox: Mailbox,
    page: Option<Sender>,
    ladder: Ladder,
    /// The transfer function that the page was told last.
    function: Value,
    /// The last picture that was sent, until the page has shown it.
    in_flight: Option<u32>,
    /// The last picture at rest, as a PNG, and its view.
    shown: Option<(View, Vec<u8>)>,
    /// The file that is being written.
    job: Option<Job>,
    /// Returns true once the page is closed.
    is_over: IsOver,
}

/// Says whether a page is not served any more.
pub(crate) type IsOver = Box<dyn Fn() -> bool + Send>;

impl Studio {
    pub(crate) fn new(subject: OpenedScene, mailbox: Mailbox, is_over: IsOver) -> Self {
        Self {
            subject,
            mailbox,
            page: None,
            ladder: Ladder::default(),
            function: Value::Null,
            in_flight: None,
            shown: None,
            job: None,
            is_over,
        }
    }

    /// Draws until it is over.
    pub(crate) fn run(mut self) {
        while !(self.is_over)() {
            self.tell_news();
            let Some(next) = self.mailbox.next(IDLE) else {
                continue;
            };
            let done = match next {
                Request::Opened(sender) => self.opened(sender),
                Request::Asked(asked) => self.answer(&asked),
                Request::Draw(id, Motion::Moving, view) => self.moving(id, &view),
                Request::Draw(id, Motion::Resting, view) => self.resting(id, &view),
            };
            if let Err(error) = done {
                self.tell(&json!({ "type": "error", "text": self.subject.message(&error) }));
            }
        }
    }

    fn opened(&mut self, sender: Sender) -> Result<()> {
        if self.page.is_some() {
            self.tell(&json!({ "type": "elsewhere" }));
        }
        self.page = Some(sender);
        self.in_flight = None;
        let facts = self.subject.facts()?;
        self.function = facts["volume"]["function"].clone();
        self.tell(&facts);
        Ok(())
    }

    /// Sends a text. A page that has gone takes nothing more.
    fn tell(&mut self, what: &Value) {
        let sent = self.page.as_mut().map(|page| page.text(what.to_string()));
        if matches!(sent, Some(Err(_))) {
            self.page = None;
        }
    }

    /// Tells what a preset, a colour map or a window has made of the transfer function; the page knows its own.
    fn tell_function(&mut self, view: &View) {
        let function = self.subject.function();
        if view.transfer.is_none() && function != self.function {
            self.tell(&json!({ "type": "function", "function": function }));
            self.function = function;
        }
    }

    /// Sends a picture, once the one before is on the screen.
    fn send(&mut self, head: &PictureHead, picture: &[u8]) {
        if let Some(before) = self.in_flight.take() {
            self.mailbox.wait_shown(before, SHOWN_PATIENCE);
        }
        let sent = self
            .page
            .as_mut()
            .map(|page| page.bytes(head.with(picture)));
        match sent {
            Some(Ok(())) if head.id > 0 => self.in_flight = Some(head.id),
            Some(Err(_)) => self.page = None,
            _ => {}
        }
    }

    fn moving(&mut self, id: u32, view: &View) -> Result<()> {
        let is_new = self.subject.prepare(view, Exactness::Fast)?;
        if is_new {
            self.tell_function(view);
        }
        let smaller = View {
            size: self.ladder.size(view.size),
            ..view.clone()
        };
        let (camera, _) = self.subject.camera(&smaller)?;
        let start = Instant::now();
        let image = self.subject.draw(&camera)?;
        let draw_ms = ms(start);
        let picture = encode::jpeg(&image)?;
        if !is_new {
            self.ladder.took(ms(start));
        }
        self.send(&head(id, "moving", "image/jpeg", &image, draw_ms), &picture);
        Ok(())
    }

    fn resting(&mut self, id: u32, view: &View) -> Result<()> {
        let stop = self.mailbox.stop();
        let (camera, _) = self.subject.camera(view)?;
        self.subject.prepare(view, Exactness::Fast)?;
        let start = Instant::now();
        let Some(quick) = self.in_bands(id, &camera, &stop)? else {
            return Ok(());
        };
        let mut last = head(id, "resting", "image/png", &quick, ms(start));
        last.is_last = view.exactness == Exactness::Fast;
        self.send(&last, &encode::png(&quick)?);
        if last.is_last || self.mailbox.has_newer() {
            return Ok(());
        }
        let prepared = self
            .subject
            .until(&stop, |subject| subject.prepare(view, view.exactness))?;
        if prepared.is_none() {
            return Ok(());
        }
        let start = Instant::now();
        let Some(image) = self.in_bands(id, &camera, &stop)? else {
            return Ok(());
        };
        let mut last = head(id, "resting", "image/png", &image, ms(start));
        last.is_last = true;
        let png = encode::png(&image)?;
        self.send(&last, &png);
        self.shown = Some((view.clone(), png));
        Ok(())
    }

    /// The picture, band by band; `None` as soon as it is not wanted any more. The page hears how much is done.
    fn in_bands(&mut self, id: u32, camera: &Camera, stop: &Stop) -> Result<Option<Image>> {
        let Self {
            subject,
            mailbox,
            is_over,
            page,
            ..
        } = self;
        let mut told = Instant::now();
        let mut next = |share: f64| {
            if told.elapsed() > PROGRESS {
                told = Instant::now();
                let text = json!({ "type": "progress", "id": id, "share": share });
                // A page that has gone is noticed when the picture is sent.
                let _ = page.as_mut().map(|page| page.text(text.to_string()));
            }
            match mailbox.has_newer() || is_over() {
                true => Next::Stop,
                false => Next::Draw,
            }
        };
        let mut pace = Pace {
            band_px: BAND_PX,
            seconds: None,
        };
        let drawn = subject.until(stop, |subject| {
            if !subject.has_bands() {
                return subject.draw(camera).map(Some);
            }
            let mut draw = |band: &Window| subject.draw_window(camera, band);
            bands::in_bands(camera, &mut pace, &mut draw, &mut next)
        })?;
        Ok(drawn.flatten())
    }

    /// Sends the progress of the file that is being written, and its end.
    fn tell_news(&mut self) {
        while let Some(job) = &self.job {
            let path = job.path().display().to_string();
            match job.news() {
                None => return,
                Some(News::Progress(done, total)) => {
                    let said =
                        json!({ "type": "saving", "path": path, "done": done, "total": total });
                    self.tell(&said);
                }
                Some(News::Ended(Ok(()))) => {
                    let (file, goal) = (job.path().to_owned(), job.goal());
                    self.job = None;
                    if let Err(error) = self.saved(&file, goal) {
                        self.tell(&json!({ "type": "not-saved", "path": path, "text": self.subject.message(&error) }));
                    }
                }
                Some(News::Ended(Err(error))) => {
                    self.job = None;
                    let text = self.subject.message(&error);
                    self.tell(&json!({ "type": "not-saved", "path": path, "text": text }));
                }
            }
        }
    }

    /// Tells that a file is there; a file for the page is sent to it.
    fn saved(&mut self, path: &Path, to: Goal) -> Result<()> {
        let name = path
            .file_name()
            .unwrap_or(path.as_os_str())
            .to_string_lossy()
            .into_owned();
        match to {
            Goal::Folder => self.tell(&json!({ "type": "saved", "path": name })),
            Goal::Page => {
                let bytes = std::fs::read(path)?;
                std::fs::remove_file(path)?;
                let nothing = Image::transparent(0, 0);
                let mut head = head(0, "file", "application/octet-stream", &nothing, 0.0);
                head.name = Some(name);
                self.send(&head, &bytes);
            }
        }
        Ok(())
    }

    fn save(
        &mut self,
        (what, name, to): (Saved, &str, Goal),
        (view, detail): (&View, &Value),
    ) -> Result<()> {
        if let Some(job) = &self.job {
            bail!(
                "{} is still being written: wait for it, or cancel it",
                job.path().display()
            );
        }
        let shown = self.shown.as_ref();
        match save::save(&self.subject, (what, name, to), (view, detail), shown)? {
            Saving::Written(path) => self.saved(&path, to)?,
            Saving::Begun(job) => self.job = Some(job),
        }
        Ok(())
    }

    fn answer(&mut self, asked: &Asked) -> Result<()> {
        match asked {
            Asked::Thumbnail { preset, view } => {
                // A picture that nobody asked for is no reason for an error; its place stays empty.
                if self.thumbnail(preset, view).is_err() {
                    self.tell(&json!({ "type": "no-thumbnail", "preset": preset }));
                }
                Ok(())
            }
            Asked::Command { view } => {
                let text = save::command(&self.subject, view)?;
                self.tell(&json!({ "type": "command", "text": text }));
                Ok(())
            }
            Asked::Save {
                what,
                name,
                view,
                detail,
                to,
            } => self.save((*what, name, *to), (view, detail)),
            Asked::Look { name, text } => {
                let look = self.subject.look(name, text)?;
                self.tell(&json!({ "type": "look", "name": name, "look": look }));
                Ok(())
            }
            Asked::Slice {
                axis,
                index,
                window,
            } => {
                let start = Instant::now();
                let image = self.subject.slice(*axis, *index, *window)?;
                let mut head = head(0, "slice", "image/png", &image, ms(start));
                head.name = Some(axis.to_string());
                self.send(&head, &encode::png(&image)?);
                Ok(())
            }
            Asked::Cancel => {
                if let Some(job) = &self.job {
                    job.cancel();
                }
                Ok(())
            }
            Asked::Probe { at, purpose, view } => {
                let found = self.subject.probe(view, *at)?;
                self.tell(&json!({ "type": "probe", "purpose": purpose, "found": found }));
                Ok(())
            }
            // The mailbox keeps these for itself.
            Asked::Draw { .. } | Asked::Shown { .. } => Ok(()),
        }
    }

    /// The view with a preset in place of its transfer function, small.
    fn thumbnail(&mut self, preset: &str, view: &View) -> Result<()> {
        let mut small = view.clone();
        small.size = [THUMBNAIL_PX; 2];
        small.transfer = None;
        small
            .changes
            .retain(|name, _| !WITH_LOOK.contains(&name.as_str()));
        small
            .changes
            .insert("preset".to_owned(), vec![preset.to_owned()]);
        // Small pictures show the look, and a projection has no light that could be blocked.
        for switch in ["shadows", "occlusion"] {
            small
                .changes
                .insert(switch.to_owned(), vec!["off".to_owned()]);
        }
        self.subject.prepare(&small, Exactness::Fast)?;
        let (camera, _) = self.subject.camera(&small)?;
        let start = Instant::now();
        let image = self.subject.draw(&camera)?;
        let mut head = head(0, "thumbnail", "image/png", &image, ms(start));
        head.name = Some(preset.to_owned());
        self.send(&head, &encode::png(&image)?);
        Ok(())
    }
}

fn ms(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

fn head(
    id: u32,
    kind: &'static str,
    format: &'static str,
    image: &Image,
    draw_ms: f64,
) -> PictureHead {
    PictureHead {
        id,
        kind,
        name: None,
        format,
        width: image.width as u32,
        height: image.height as u32,
        draw_ms,
        is_last: false,
    }
}
