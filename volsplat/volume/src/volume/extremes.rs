//! The least and the greatest of scalars.

/// Least and greatest byte: of bytes, because the comparisons of many at once are cheap.
pub(crate) fn range_of_bytes(bytes: &[u8]) -> (f64, f64) {
    let (low, high) = bytes.iter().fold((u8::MAX, 0), |(low, high), &byte| {
        (byte.min(low), byte.max(high))
    });
    if bytes.is_empty() {
        (f64::INFINITY, f64::NEG_INFINITY)
    } else {
        (low.into(), high.into())
    }
}

/// Least and greatest scalar.
pub(crate) fn range_of(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    })
}
