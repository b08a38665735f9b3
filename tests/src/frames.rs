//! Shared by measuring programs: the number of timed frames, and the one thread that they are timed on.
//!
//! Takes the program's first argument, and gives the number of frames or says how the program is used.

use rayon::ThreadPool;

/// The number of frames that the first argument asks for, or `default`; `None`, with a line on standard error, where it is
/// no whole number above 0.
pub fn frames_argument(program: &str, default: usize) -> Option<usize> {
    let frames = std::env::args()
        .nth(1)
        .map_or(Ok(default), |argument| argument.parse::<usize>());
    if let Ok(frames @ 1..) = frames {
        return Some(frames);
    }
    eprintln!("usage: {program} [FRAMES], with FRAMES a whole number above 0");
    None
}

/// A pool of one thread, so that times are those of one thread.
///
/// # Panics
/// If the system gives no thread.
pub fn one_thread() -> ThreadPool {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("one thread can be started")
}
