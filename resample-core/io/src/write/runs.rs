//! One line of an EXR picture, packed by run lengths.
//!
//! Takes the numbers of a line, gives the bytes that the format prescribes: the even bytes of all numbers, then the odd
//! ones, each as its difference from the one before, in runs of equal bytes and stretches of unequal ones. Runs are looked for
//! eight bytes at a time, and the bytes are those of the crate `exr`, which looks at each alone. Source: `ImfRle.cpp` of OpenEXR.

/// The numbers of a channel.
#[derive(Clone, Copy)]
pub(crate) enum Values<'a> {
    /// One of the four numbers of each pixel.
    Colour(&'a [[f32; 4]], usize),
    Plane(&'a [f32]),
}

/// Fewest equal bytes that are a run.
const LEAST_RUN: usize = 3;

/// Most bytes of a run, and of a stretch without runs.
const MOST_RUN: usize = 128;
const MOST_UNEQUAL: usize = 127;

/// Storage for a line.
#[derive(Default)]
pub(crate) struct LineWork {
    separated: Vec<u8>,
    differences: Vec<u8>,
}

impl Values<'_> {
    /// All numbers.
    pub(crate) fn to_vec(self) -> Vec<f32> {
        match self {
            Self::Colour(pixels, k) => pixels.iter().map(|pixel| pixel[k]).collect(),
            Self::Plane(values) => values.to_vec(),
        }
    }

    /// Calls `each` for the numbers from `first` on, as bits, and as many of `out`.
    fn each<T>(self, first: usize, out: impl Iterator<Item = T>, each: impl Fn(u32, T)) {
        match self {
            Self::Colour(pixels, k) => {
                let bits = pixels[first..].iter().map(|pixel| pixel[k].to_bits());
                bits.zip(out).for_each(|(bits, out)| each(bits, out));
            }
            Self::Plane(values) => {
                let bits = values[first..].iter().map(|value| value.to_bits());
                bits.zip(out).for_each(|(bits, out)| each(bits, out));
            }
        }
    }
}

/// Packs line `y` of channels that are `width` wide; unpacked bytes where that would be longer.
pub(crate) fn packed_line(
    channels: &[Values],
    (width, y): (usize, usize),
    work: &mut LineWork,
) -> Vec<u8> {
    let bytes = 4 * width * channels.len();
    let first = y * width;
    work.separate(channels, width, first);
    work.take_differences();
    let packed = packed(&work.differences);
    if packed.len() < bytes {
        return packed;
    }
    let mut plain = vec![0; bytes];
    for (channel, line) in channels.iter().zip(plain.chunks_exact_mut(4 * width)) {
        channel.each(
            first,
            line.as_chunks_mut().0.iter_mut(),
            |bits, out: &mut [u8; 4]| {
                *out = bits.to_le_bytes();
            },
        );
    }
    plain
}

impl LineWork {
    fn separate(&mut self, channels: &[Values], width: usize, first: usize) {
        self.separated.resize(4 * width * channels.len(), 0);
        let (even, odd) = self.separated.split_at_mut(2 * width * channels.len());
        let lines = even
            .chunks_exact_mut(2 * width)
            .zip(odd.chunks_exact_mut(2 * width));
        for (channel, (even, odd)) in channels.iter().zip(lines) {
            let pairs =
                |line| -> std::slice::IterMut<[u8; 2]> { <[u8]>::as_chunks_mut(line).0.iter_mut() };
            channel.each(first, pairs(even).zip(pairs(odd)), |bits, (even, odd)| {
                let [a, b, c, d] = bits.to_le_bytes();
                (*even, *odd) = ([a, c], [b, d]);
            });
        }
    }

    fn take_differences(&mut self) {
        self.differences.resize(self.separated.len(), 0);
        let pairs = self.separated.windows(2);
        for (out, pair) in self.differences.iter_mut().skip(1).zip(pairs) {
            *out = pair[1].wrapping_sub(pair[0]).wrapping_add(128);
        }
        if let (Some(out), Some(&first)) = (self.differences.first_mut(), self.separated.first()) {
            *out = first;
        }
    }
}

/// Runs and stretches of `bytes`.
fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(bytes.len() + bytes.len() / MOST_UNEQUAL + 1);
    let mut start = 0;
    let mut next_run = next_run(bytes, 0);
    while start < bytes.len() {
        let left = &bytes[start..];
        if next_run == start {
            let most = left.len().min(MOST_RUN);
            let unequal = left[..most].iter().position(|byte| *byte != left[0]);
            let count = unequal.unwrap_or(most);
            out.extend([(count - 1) as u8, left[0]]);
            start += count;
        } else {
            // Two equal bytes at the start are a part of the stretch, whatever follows.
            let least = 1 + usize::from(left.len() > 1 && left[1] == left[0]);
            if next_run < start + least {
                next_run = self::next_run(bytes, start + least);
            }
            let end = (start + MOST_UNEQUAL).min(next_run);
            out.push((start as isize - end as isize) as u8);
            out.extend_from_slice(&bytes[start..end]);
            start = end;
        }
        if next_run < start {
            next_run = self::next_run(bytes, start);
        }
    }
    out
}

/// The start of the first run at or after `start`; the number of bytes if no run follows.
fn next_run(bytes: &[u8], start: usize) -> usize {
    const LOW: u64 = 0x7f7f_7f7f_7f7f_7f7f;
    let mut at = start;
    while let Some(ten) = bytes.get(at..at + 8 + LEAST_RUN - 1) {
        let eight = |from: usize| {
            ten[from..]
                .first_chunk()
                .map_or(0, |b| u64::from_le_bytes(*b))
        };
        let unequal = (eight(0) ^ eight(1)) | (eight(1) ^ eight(2));
        // The highest bit of each byte: whether the byte is 0.
        let equal = !(((unequal & LOW) + LOW) | unequal | LOW);
        if equal != 0 {
            return at + equal.trailing_zeros() as usize / 8;
        }
        at += 8;
    }
    let rest = bytes.get(at..).unwrap_or(&[]);
    let found = rest
        .windows(LEAST_RUN)
        .position(|bytes| bytes[0] == bytes[1] && bytes[1] == bytes[2]);
    found.map_or(bytes.len(), |k| at + k)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same as [`packed`], byte by byte.
    fn packed_slowly(bytes: &[u8]) -> Vec<u8> {
        let (mut out, mut start) = (Vec::new(), 0);
        let run = |at: usize| {
            let same = bytes[at..].iter().take_while(|byte| **byte == bytes[at]);
            same.count().min(MOST_RUN)
        };
        while start < bytes.len() {
            let count = run(start);
            if count >= LEAST_RUN {
                out.extend([(count - 1) as u8, bytes[start]]);
                start += count;
                continue;
            }
            let mut end = start + count;
            while end < bytes.len() && run(end) < LEAST_RUN && end - start < MOST_UNEQUAL {
                end += 1;
            }
            out.push((256 - (end - start)) as u8);
            out.extend(&bytes[start..end]);
            start = end;
        }
        out
    }

    fn unpacked(mut packed: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        while let Some((&count, rest)) = packed.split_first() {
            let count = count as i8;
            let (from, times) = if count < 0 {
                (usize::from(count.unsigned_abs()), 1)
            } else {
                (1, count as usize + 1)
            };
            (0..times).for_each(|_| out.extend(&rest[..from]));
            packed = &rest[from..];
        }
        out
    }

    #[test]
    fn every_mix_of_runs_is_packed_as_byte_by_byte_and_comes_back() {
        let mut state = 1u32;
        let mut random = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) % below
        };
        let mut runs = 0;
        for case in 0..2000 {
            let mut bytes = Vec::new();
            for _ in 0..random(12) {
                // Runs of all lengths around the limits, between stretches of few and of many values.
                let values = [2, 3, 256][case % 3];
                let stretch = random(200);
                bytes.extend((0..stretch).map(|_| random(values) as u8));
                let run = [0, 2, 3, 127, 128, 129, 256, 300][random(8) as usize];
                bytes.extend(std::iter::repeat_n(random(256) as u8, run));
            }
            let packed = packed(&bytes);
            assert!(packed == packed_slowly(&bytes), "case {case}: other bytes");
            assert!(unpacked(&packed) == bytes, "case {case} does not come back");
            runs += usize::from(packed.len() < bytes.len());
        }
        assert!(runs > 100, "only {runs} cases hold runs");
    }
}
