//! Work on a thread of its own, while Python's other threads go on and Ctrl-C is heard.
//!
//! The thread that called waits without the interpreter's lock and wakes up often enough to ask for signals. If one came, it
//! raises at once; the work is asked to stop and ends by itself at its next band or picture.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use resample_cli::process::report;
use resample_core::camera::bands::Next;

use crate::fault;

/// Time after which signals are asked for: nobody notices it.
const PATIENCE: Duration = Duration::from_millis(20);

/// Messages between a worker and its waiter.
#[derive(Clone, Default)]
pub(crate) struct Reins(Arc<Shared>);

#[derive(Default)]
struct Shared {
    stopped: AtomicBool,
    /// The finished share, as the bits of a number.
    share: AtomicU64,
}

impl Reins {
    /// Says how much is done; whether there is still somebody who waits.
    pub(crate) fn done(&self, share: f64) -> Next {
        self.0.share.store(share.to_bits(), Ordering::Relaxed);
        match self.0.stopped.load(Ordering::Relaxed) {
            true => Next::Stop,
            false => Next::Draw,
        }
    }

    fn share(&self) -> f64 {
        f64::from_bits(self.0.share.load(Ordering::Relaxed))
    }
}

/// The result of a work, and its messages.
pub(crate) struct Done<T> {
    pub(crate) value: T,
    pub(crate) lines: Vec<String>,
}

/// Waits for a while. The exclusive borrow shows that no other thread waits as well.
fn next<T>(receiver: &mut Receiver<T>) -> Result<T, RecvTimeoutError> {
    receiver.recv_timeout(PATIENCE)
}

/// As many threads as were asked for; `None` for all processors.
pub(crate) fn pool(threads: Option<usize>) -> PyResult<Option<Arc<ThreadPool>>> {
    let made = threads.map(|count| {
        let built = ThreadPoolBuilder::new().num_threads(count).build();
        let pool = built.map(Arc::new);
        pool.map_err(|error| PyValueError::new_err(format!("threads: {error}")))
    });
    made.transpose()
}

/// Does some work, on the threads of `pool` where there is one; `progress` is called with the finished share.
pub(crate) fn work<T: Send + 'static>(
    py: Python<'_>,
    pool: Option<Arc<ThreadPool>>,
    progress: Option<&Bound<'_, PyAny>>,
    job: impl FnOnce(&Reins) -> anyhow::Result<T> + Send + 'static,
) -> PyResult<Done<T>> {
    let reins = Reins::default();
    let (sender, mut receiver) = channel();
    let own = reins.clone();
    std::thread::Builder::new()
        .name("drawing".to_owned())
        .spawn(move || {
            let heard = || report::heard(|| job(&own));
            let (value, lines) = match pool {
                Some(pool) => pool.install(heard),
                None => heard(),
            };
            // Nobody may wait any more.
            let _ = sender.send((value, lines));
        })?;
    loop {
        match py.detach(|| next(&mut receiver)) {
            Ok((value, lines)) => {
                let value = value.map_err(|error| fault::raised(&error))?;
                return Ok(Done { value, lines });
            }
            Err(RecvTimeoutError::Disconnected) => return Err(fault::broken()),
            Err(RecvTimeoutError::Timeout) => {}
        }
        let heard = py.check_signals().and_then(|()| {
            let share = reins.share();
            progress.map_or(Ok(()), |call| call.call1((share,)).map(|_| ()))
        });
        if let Err(error) = heard {
            reins.0.stopped.store(true, Ordering::Relaxed);
            return Err(error);
        }
    }
}
