//! Lines of numbers, parsed on all processors.
//!
//! Takes a file of text, gives the numbers of one line after another. A block of whole lines is read at a time, and its pieces are
//! parsed side by side; the order stays.

use std::io::Read;

use rayon::prelude::*;

/// Most numbers of a line that count.
pub(super) const MOST: usize = 12;

/// Bytes of a block.
const BLOCK_BYTES: usize = 4 << 20;

/// The numbers of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Row {
    numbers: [f64; MOST],
    count: usize,
}

impl Row {
    /// The numbers; none of a line that is empty, a comment, or of words.
    pub(super) fn numbers(&self) -> &[f64] {
        &self.numbers[..self.count]
    }
}

/// Returns true for what parts numbers of a line.
fn parts(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b',' | b';' | b'\r')
}

/// The words of a line.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(|byte| parts(*byte))
        .filter(|word| !word.is_empty())
}

/// The numbers of a line.
pub(super) fn row_of(line: &[u8]) -> Row {
    let mut row = Row::default();
    for word in words(line).take(MOST) {
        let number = std::str::from_utf8(word)
            .ok()
            .and_then(|word| word.parse().ok());
        let Some(number) = number else {
            return Row::default();
        };
        row.numbers[row.count] = number;
        row.count += 1;
    }
    row
}

/// Bound of the number of lines.
pub(super) fn count(file: &mut impl Read) -> std::io::Result<u64> {
    let mut block = vec![0; BLOCK_BYTES];
    let mut count = 1;
    loop {
        let got = file.read(&mut block)?;
        if got == 0 {
            return Ok(count);
        }
        count += block[..got].iter().filter(|byte| **byte == b'\n').count() as u64;
    }
}

/// Hands over each line, in order.
pub(super) fn each(
    file: &mut impl Read,
    take: &mut dyn FnMut(&Row) -> Result<(), String>,
) -> Result<(), String> {
    let mut block = Vec::new();
    loop {
        let kept = block.len();
        let got = file
            .take((BLOCK_BYTES - kept) as u64)
            .read_to_end(&mut block);
        let got = got.map_err(|error| format!("cannot be read to its end: {error}"))?;
        let end = match got {
            0 => block.len(),
            _ => block
                .iter()
                .rposition(|byte| *byte == b'\n')
                .map_or(0, |at| at + 1),
        };
        if end == 0 && block.len() >= BLOCK_BYTES {
            return Err(format!(
                "a line has more than {BLOCK_BYTES} bytes: expected one point a line"
            ));
        }
        let rows: Vec<Vec<Row>> = pieces(&block[..end]).into_par_iter().map(rows_of).collect();
        rows.iter().flatten().try_for_each(&mut *take)?;
        block.drain(..end);
        if got == 0 {
            return Ok(());
        }
    }
}

fn rows_of(piece: &[u8]) -> Vec<Row> {
    piece.split(|byte| *byte == b'\n').map(row_of).collect()
}

/// Pieces of whole lines, a few for each processor; the last line end of each is left away.
fn pieces(block: &[u8]) -> Vec<&[u8]> {
    let length = block.len() / (4 * rayon::current_num_threads().max(1)) + 1;
    let mut pieces = Vec::new();
    let mut rest = block;
    while !rest.is_empty() {
        let from = length.min(rest.len());
        let end = rest[from..].iter().position(|byte| *byte == b'\n');
        let end = end.map_or(rest.len(), |at| from + at + 1);
        let (piece, later) = rest.split_at(end);
        pieces.push(piece.strip_suffix(b"\n").unwrap_or(piece));
        rest = later;
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_lines_come_in_order() {
        let text: String = (0..300_000)
            .map(|n| format!("{n} {};1e3,\t-2\r\n", 2 * n))
            .collect();
        let mut next = 0.0;
        let read = each(&mut text.as_bytes(), &mut |row| {
            if !row.numbers().is_empty() {
                assert_eq!(row.numbers(), [next, 2.0 * next, 1000.0, -2.0]);
                next += 1.0;
            }
            Ok(())
        });
        assert_eq!((read, next), (Ok(()), 300_000.0));
        assert_eq!(count(&mut text.as_bytes()).expect("in memory"), 300_001);
    }

    #[test]
    fn other_lines_have_no_numbers() {
        for line in [
            b"".as_slice(),
            b"# 1 2 3",
            b"x y z",
            b"1 2 z",
            b"  \r",
            b"\xff 1",
        ] {
            assert!(row_of(line).numbers().is_empty(), "{line:?}");
        }
        let long = vec![b'1'; BLOCK_BYTES + 1];
        let why = each(&mut long.as_slice(), &mut |_| Ok(())).expect_err("too long");
        assert!(why.contains("a line has more"), "{why}");
    }
}
