//! The connections whose request is still arriving: few at a time, and none of them for long.
//!
//! Takes new connections, gives readers that end at one deadline for the whole head of a request, however slowly its bytes
//! come. A browser sends its head in one piece, so that the connection that has waited longest is the least likely to be one:
//! where too many are open, the oldest is closed for the newest. Somebody without the token can thus neither hold connections
//! for long nor keep a page from being opened.

use std::collections::VecDeque;
use std::io::{Error, ErrorKind, Read};
use std::net::{Shutdown, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Heads that may be open at once; a browser opens six connections at most.
const MOST_HEADS: usize = 32;

/// Time in which the whole head of a request must come.
const PATIENCE: Duration = Duration::from_secs(10);

#[derive(Default)]
struct Open {
    count: u64,
    /// Number and stream of each, the oldest first.
    streams: VecDeque<(u64, TcpStream)>,
}

/// All connections whose request is still arriving.
#[derive(Clone, Default)]
pub(crate) struct OpenHeads(Arc<Mutex<Open>>);

/// A connection whose request is still arriving: reads its bytes until the deadline.
pub(crate) struct Arriving {
    number: u64,
    stream: TcpStream,
    end: Instant,
    open: OpenHeads,
}

impl OpenHeads {
    /// Admits a connection; where too many are open, the oldest is closed.
    pub(crate) fn admit(&self, stream: TcpStream) -> std::io::Result<Arriving> {
        let own = stream.try_clone()?;
        let mut open = self.lock();
        open.count += 1;
        let number = open.count;
        open.streams.push_back((number, own));
        if open.streams.len() > MOST_HEADS
            && let Some((_, oldest)) = open.streams.pop_front()
        {
            // It may have been closed by the other side already.
            let _ = oldest.shutdown(Shutdown::Both);
        }
        drop(open);
        Ok(Arriving {
            number,
            stream,
            end: Instant::now() + PATIENCE,
            open: self.clone(),
        })
    }

    fn lock(&self) -> MutexGuard<'_, Open> {
        // The list is sound whatever a thread did that panicked.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Read for Arriving {
    fn read(&mut self, to: &mut [u8]) -> std::io::Result<usize> {
        let left = self.end.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(Error::from(ErrorKind::TimedOut));
        }
        self.stream.set_read_timeout(Some(left))?;
        self.stream.read(to)
    }
}

impl Drop for Arriving {
    fn drop(&mut self) {
        let number = self.number;
        self.open
            .lock()
            .streams
            .retain(|(other, _)| *other != number);
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::net::TcpListener;

    use super::*;
    use crate::view::serve::http::Head;

    /// Both ends of a connection.
    fn pair() -> (TcpStream, TcpStream) {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("an address");
        let client = TcpStream::connect(address).expect("it listens");
        (listener.accept().expect("a connection").0, client)
    }

    #[test]
    fn bytes_that_trickle_do_not_move_the_deadline() {
        let (server, mut client) = pair();
        let mut arriving = OpenHeads::default().admit(server).expect("a connection");
        arriving.end = Instant::now() + Duration::from_millis(300);
        let trickle = std::thread::spawn(move || {
            // Fewer bytes than a head may have, so that only the deadline ends it.
            for _ in 0..10_000 {
                if client.write_all(b"x").is_err() {
                    return;
                }
                std::thread::sleep(Duration::from_millis(20));
            }
        });
        let error = Head::read(&mut arriving).expect_err("it never ends");
        let kind = error.downcast_ref::<Error>().map(Error::kind);
        let late = [ErrorKind::TimedOut, ErrorKind::WouldBlock];
        assert!(kind.is_some_and(|kind| late.contains(&kind)), "{error:#}");
        drop(arriving);
        trickle.join().expect("it ends with the connection");
    }

    #[test]
    fn the_oldest_makes_room_for_the_newest() {
        let heads = OpenHeads::default();
        let (mut kept, mut clients) = (Vec::new(), Vec::new());
        for _ in 0..=MOST_HEADS {
            let (server, client) = pair();
            kept.push(heads.admit(server).expect("a connection"));
            clients.push(client);
        }
        assert_eq!(heads.lock().streams.len(), MOST_HEADS);
        let mut byte = [0; 1];
        assert_eq!(clients[0].read(&mut byte).expect("closed"), 0, "the oldest");
        clients[1].write_all(b"x").expect("open");
        assert_eq!(kept[1].read(&mut byte).expect("open"), 1, "the others");
        kept.clear();
        assert!(heads.lock().streams.is_empty());
    }
}
