//! Storage that a task reuses from tile to tile, on the heap.

/// Makes the storage of a task.
///
/// Rayon divides work by recursion, and a thread that waits runs other parts on top of its own, so that the locals of a task are on
/// its stack some thirty times. A value of 60 kB overflows a stack of 2 MB there, boxed or not where the compiler builds it in the
/// caller's frame: this function is never part of its caller.
#[inline(never)]
pub fn on_heap<T: Default>() -> Box<T> {
    Box::default()
}
