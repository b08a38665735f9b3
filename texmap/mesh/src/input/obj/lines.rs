//! The lines of OBJ and MTL files.
//!
//! Takes bytes, gives words and numbers. Text is UTF-8, UTF-16 with a mark, or Latin-1; comments and empty lines are
//! skipped; a line that ends in a back-slash goes on in the next.

use std::borrow::Cow;
use std::str::FromStr;

use super::super::files::excerpt;

/// A line that says something.
pub(super) struct Line<'a> {
    /// Its number in the file, from 1.
    pub number: usize,
    /// Its first word.
    pub word: &'a str,
    /// The rest of the line, trimmed.
    pub rest: &'a str,
}

/// The text of a file. Bytes that are no UTF-8 are taken for Latin-1, which has a letter for each.
pub(super) fn decode_text(bytes: &[u8]) -> Cow<'_, str> {
    let sixteen = |from: fn([u8; 2]) -> u16| {
        let words: Vec<u16> = bytes[2..]
            .chunks_exact(2)
            .map(|pair| from([pair[0], pair[1]]))
            .collect();
        Cow::Owned(String::from_utf16_lossy(&words))
    };
    let text = match bytes {
        [0xff, 0xfe, ..] => sixteen(u16::from_le_bytes),
        [0xfe, 0xff, ..] => sixteen(u16::from_be_bytes),
        _ => match std::str::from_utf8(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)) {
            Ok(text) => Cow::Borrowed(text),
            Err(_) => Cow::Owned(bytes.iter().map(|&byte| char::from(byte)).collect()),
        },
    };
    // The line keeps its length in lines, so that the numbers of later ones stay right.
    match text.contains("\\\n") || text.contains("\\\r\n") {
        true => Cow::Owned(joined(&text)),
        false => text,
    }
}

/// The lines that say something.
pub(super) fn lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    text.lines().enumerate().filter_map(|(index, line)| {
        let line = line.trim_matches(|c: char| c.is_whitespace() || c == '\0');
        if line.is_empty() || line.starts_with('#') {
            return None;
        }
        let (word, rest) = line
            .split_once(|c: char| c.is_whitespace())
            .unwrap_or((line, ""));
        Some(Line {
            number: index + 1,
            word,
            rest: rest.trim(),
        })
    })
}

/// The first `N` numbers of a text; one that is missing takes its default, and is an error without one.
pub(super) fn numbers<T: FromStr + Copy + Default, const N: usize>(
    text: &str,
    defaults: [Option<T>; N],
) -> Result<[T; N], String> {
    let mut words = text.split_ascii_whitespace();
    let mut numbers = [T::default(); N];
    for (number, default) in numbers.iter_mut().zip(defaults) {
        *number = match (words.next(), default) {
            (Some(word), _) => word
                .parse()
                .map_err(|_| format!("'{}' is no number", excerpt(word)))?,
            (None, Some(default)) => default,
            (None, None) => return Err(format!("expected {N} numbers, found '{}'", excerpt(text))),
        };
    }
    Ok(numbers)
}

/// Joins lines that go on; the empty lines that make up for it come after them.
fn joined(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut swallowed = 0;
    for line in text.lines() {
        if let Some(start) = line.strip_suffix('\\') {
            out.push_str(start);
            out.push(' ');
            swallowed += 1;
        } else {
            out.push_str(line);
            out.extend(std::iter::repeat_n(
                '\n',
                1 + std::mem::take(&mut swallowed),
            ));
        }
    }
    out
}
