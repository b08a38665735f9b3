//! How far a long task is.

/// Called now and then with the share of a long task that is done, 0 to 1.
pub type Watch<'a> = dyn FnMut(f64) + 'a;
