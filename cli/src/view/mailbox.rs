//! The requests of the page that is open: of views to draw only the newest counts, all else is kept in order.

use std::collections::VecDeque;
use std::net::TcpStream;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use anyhow::Result;
use resample_core::Stop;
use tungstenite::protocol::{Role, WebSocket};
use tungstenite::{Bytes, Message};

use crate::view::message::{Asked, Motion, View};

/// Most requests beside views that wait; a page sends a handful.
const MOST_WAITING: usize = 64;

/// The next work.
#[derive(Debug)]
pub(crate) enum Next {
    /// A page was opened; it takes the place of the one before.
    Opened(Sender),
    /// A request beside views.
    Asked(Asked),
    /// The newest view.
    Draw(u32, Motion, View),
}

#[derive(Default)]
struct Inside {
    opened: Option<Sender>,
    /// Counts the pages, so that what an old one still says is not heard.
    page: u64,
    waiting: VecDeque<Asked>,
    newest: Option<(u32, Motion, View)>,
    /// True if the page wants the picture in work no longer.
    is_cancelled: bool,
    shown: Option<u32>,
}

/// Shared by the threads that listen and the one that draws.
#[derive(Clone, Default)]
pub(crate) struct Mailbox(Arc<(Mutex<Inside>, Condvar)>, Stop);

impl Mailbox {
    /// A page was opened. The number is for [`Mailbox::put`].
    pub(crate) fn open(&self, sender: Sender) -> u64 {
        let mut inside = self.lock();
        *inside = Inside {
            opened: Some(sender),
            page: inside.page + 1,
            ..Inside::default()
        };
        self.1.ask();
        self.0.1.notify_all();
        inside.page
    }

    /// Asks for the end of a resting picture as soon as something newer waits. Call it before such a picture.
    pub(crate) fn stop(&self) -> Stop {
        self.1.clear();
        if self.has_newer() {
            self.1.ask();
        }
        self.1.clone()
    }

    /// Takes a request; false if another page has been opened since.
    pub(crate) fn put(&self, page: u64, asked: Asked) -> bool {
        let mut inside = self.lock();
        if inside.page != page {
            return false;
        }
        match asked {
            Asked::Draw { id, motion, view } => {
                inside.newest = Some((id, motion, view));
                self.1.ask();
            }
            Asked::Cancel => {
                if !inside.is_cancelled {
                    inside.waiting.push_front(Asked::Cancel);
                }
                inside.is_cancelled = true;
                self.1.ask();
            }
            Asked::Shown { id } => inside.shown = Some(id),
            other if inside.waiting.len() < MOST_WAITING => inside.waiting.push_back(other),
            _ => {}
        }
        self.0.1.notify_all();
        true
    }

    /// Waits for something to do; `None` if there is nothing for that long.
    pub(crate) fn next(&self, longest: Duration) -> Option<Next> {
        let end = Instant::now() + longest;
        let mut inside = self.lock();
        loop {
            if let Some(sender) = inside.opened.take() {
                return Some(Next::Opened(sender));
            }
            inside.is_cancelled = false;
            if let Some(asked) = inside.waiting.pop_front() {
                return Some(Next::Asked(asked));
            }
            if let Some((id, motion, view)) = inside.newest.take() {
                return Some(Next::Draw(id, motion, view));
            }
            inside = self.wait(inside, end)?;
        }
    }

    /// Waits until a picture is on the screen, but no longer than that.
    pub(crate) fn wait_shown(&self, id: u32, longest: Duration) {
        let end = Instant::now() + longest;
        let mut inside = self.lock();
        while inside.shown != Some(id) && inside.opened.is_none() {
            match self.wait(inside, end) {
                Some(again) => inside = again,
                None => return,
            }
        }
    }

    /// Returns true if a view or another page waits, or the page wants the picture in work no longer.
    pub(crate) fn has_newer(&self) -> bool {
        let inside = self.lock();
        inside.newest.is_some() || inside.opened.is_some() || inside.is_cancelled
    }

    fn wait<'a>(
        &self,
        inside: MutexGuard<'a, Inside>,
        end: Instant,
    ) -> Option<MutexGuard<'a, Inside>> {
        let left = end.checked_duration_since(Instant::now())?;
        let waited = self.0.1.wait_timeout(inside, left);
        Some(waited.unwrap_or_else(PoisonError::into_inner).0)
    }

    fn lock(&self) -> MutexGuard<'_, Inside> {
        // The lists are sound whatever a thread did that panicked.
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Sends to a page.
pub(crate) struct Sender(WebSocket<TcpStream>);

impl std::fmt::Debug for Sender {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Sender")
    }
}

impl Sender {
    /// On a stream whose head has been exchanged.
    pub(crate) fn new(stream: TcpStream) -> Self {
        Self(WebSocket::from_raw_socket(stream, Role::Server, None))
    }

    /// Sends a text.
    pub(crate) fn text(&mut self, text: String) -> Result<()> {
        Ok(self.0.send(Message::text(text))?)
    }

    /// Sends bytes.
    pub(crate) fn bytes(&mut self, bytes: Vec<u8>) -> Result<()> {
        Ok(self.0.send(Message::Binary(Bytes::from(bytes)))?)
    }
}
