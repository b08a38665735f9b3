//! Texels beyond the borders of a picture.

use resample_mesh::scene::Wrap;

/// The texel inside 0..count that lies at `index`.
#[inline(always)]
pub(crate) fn wrapped(index: i32, count: usize, wrap: Wrap) -> usize {
    if (index as usize) < count {
        return index as usize;
    }
    let count_i = count as i32;
    match wrap {
        Wrap::Clamp => index.clamp(0, count_i - 1) as usize,
        Wrap::Repeat if count.is_power_of_two() => index as usize & (count - 1),
        Wrap::Repeat => index.rem_euclid(count_i) as usize,
        Wrap::Mirror => {
            let folded = index.rem_euclid(2 * count_i);
            folded.min(2 * count_i - 1 - folded) as usize
        }
    }
}
