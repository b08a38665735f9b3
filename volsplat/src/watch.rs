//! How far a long task is.

/// Is told how much of a long task is done, from 0 to 1, now and then.
pub type Watch<'a> = dyn FnMut(f64) + 'a;
