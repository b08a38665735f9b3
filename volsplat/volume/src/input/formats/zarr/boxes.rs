//! Boxes in arrays of any number of axes, the last axis fastest.

/// A part of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Span {
    pub(crate) first: usize,
    pub(crate) size: usize,
}

/// Number of elements of an array; `None` where it overflows.
pub(crate) fn len(shape: &[usize]) -> Option<usize> {
    shape
        .iter()
        .try_fold(1usize, |count, &size| count.checked_mul(size))
}

/// An array, as its bytes and its shape, and a place in it.
pub(crate) struct PlaceIn<'a, B> {
    pub(crate) bytes: B,
    pub(crate) shape: &'a [usize],
    pub(crate) at: &'a [usize],
}

/// Copies a box of `size` elements from a place in one array to a place in another. The box lies in both.
pub(crate) fn copy_box(
    from: &PlaceIn<&[u8]>,
    to: &mut PlaceIn<&mut [u8]>,
    size: &[usize],
    element_bytes: usize,
) {
    let Some((&row, outer)) = size.split_last() else {
        return;
    };
    let rows: usize = outer.iter().product();
    let row_bytes = row * element_bytes;
    let mut at = vec![0; size.len()];
    for number in 0..rows {
        let mut rest = number;
        for axis in (0..outer.len()).rev() {
            at[axis] = rest % outer[axis];
            rest /= outer[axis];
        }
        let source_at = element_bytes * place(from.shape, from.at, &at);
        let target_at = element_bytes * place(to.shape, to.at, &at);
        to.bytes[target_at..target_at + row_bytes]
            .copy_from_slice(&from.bytes[source_at..source_at + row_bytes]);
    }
}

/// Puts the elements of an array, stored with its axes in this order (the slowest first), into the usual order.
pub(crate) fn reordered(
    stored: &[u8],
    shape: &[usize],
    order: &[usize],
    element_bytes: usize,
) -> Vec<u8> {
    let mut strides = vec![0; shape.len()];
    let mut stride = element_bytes;
    for &axis in order.iter().rev() {
        strides[axis] = stride;
        stride *= shape[axis];
    }
    let mut bytes = Vec::with_capacity(stored.len());
    let mut at = vec![0; shape.len()];
    for _ in 0..stored.len() / element_bytes {
        let place: usize = at.iter().zip(&strides).map(|(i, stride)| i * stride).sum();
        bytes.extend_from_slice(&stored[place..place + element_bytes]);
        for axis in (0..shape.len()).rev() {
            at[axis] += 1;
            if at[axis] < shape[axis] {
                break;
            }
            at[axis] = 0;
        }
    }
    bytes
}

fn place(shape: &[usize], first: &[usize], at: &[usize]) -> usize {
    shape
        .iter()
        .zip(first)
        .zip(at)
        .fold(0, |place, ((size, first), at)| place * size + first + at)
}
