//! Base64 as a stream of bytes.
//!
//! VTK encodes a header and the data behind it one after the other, each padded to its own end. So padding can stand in
//! the middle: every four characters are decoded on their own, and white space between them is passed over.

use std::io::{self, BufRead, Read};

/// Unpacks base64; the end of the text, or a `<`, is the end of the bytes.
pub(crate) struct Base64Reader<R> {
    text: R,
    /// Unpacked bytes of the last four characters that were not asked for yet: `ready[at..end]`.
    ready: [u8; 3],
    at: usize,
    end: usize,
}

impl<R: BufRead> Base64Reader<R> {
    pub(crate) fn new(text: R) -> Self {
        Self {
            text,
            ready: [0; 3],
            at: 0,
            end: 0,
        }
    }

    /// Decodes the next four characters; `end` stays at `at` where the text ends.
    fn refill(&mut self) -> io::Result<()> {
        (self.at, self.end) = (0, 0);
        let (mut bits, mut digits, mut padding) = (0u32, 0, 0);
        while digits + padding < 4 {
            let Some(character) = self.next_character()? else {
                return if digits + padding == 0 {
                    Ok(())
                } else {
                    Err(fault("it ends within four characters"))
                };
            };
            match digit(character) {
                Some(value) if padding == 0 => {
                    bits = (bits << 6) | value;
                    digits += 1;
                }
                None if character == b'=' && digits >= 2 => padding += 1,
                _ => return Err(fault("a character that is no base64")),
            }
        }
        bits <<= 6 * padding;
        self.ready = [(bits >> 16) as u8, (bits >> 8) as u8, bits as u8];
        self.end = 3 - padding;
        Ok(())
    }

    fn next_character(&mut self) -> io::Result<Option<u8>> {
        loop {
            let Some(&character) = self.text.fill_buf()?.first() else {
                return Ok(None);
            };
            if character == b'<' {
                return Ok(None);
            }
            self.text.consume(1);
            if !character.is_ascii_whitespace() {
                return Ok(Some(character));
            }
        }
    }
}

impl<R: BufRead> Read for Base64Reader<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let mut written = 0;
        while written < bytes.len() {
            if self.at == self.end {
                self.refill()?;
                if self.end == 0 {
                    break;
                }
            }
            bytes[written] = self.ready[self.at];
            self.at += 1;
            written += 1;
        }
        Ok(written)
    }
}

fn digit(character: u8) -> Option<u32> {
    let value = match character {
        b'A'..=b'Z' => character - b'A',
        b'a'..=b'z' => character - b'a' + 26,
        b'0'..=b'9' => character - b'0' + 52,
        b'+' => 62,
        b'/' => 63,
        _ => return None,
    };
    Some(u32::from(value))
}

fn fault(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, format!("base64 data: {what}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(text: &str) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        Base64Reader::new(text.as_bytes())
            .read_to_end(&mut bytes)
            .map(|_| bytes)
    }

    #[test]
    fn the_examples_of_rfc_4648_are_decoded_also_joined() {
        for (text, plain) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYmE=", "fooba"),
        ] {
            assert_eq!(decoded(text).expect("valid"), plain.as_bytes(), "{text}");
        }
        assert_eq!(
            decoded(" Zg==\nZm8=Zm9v <rest").expect("valid"),
            b"ffofoo",
            "padding in the middle"
        );
        assert_eq!(decoded("+/+/").expect("valid"), [0xfb, 0xff, 0xbf]);
        for bad in ["Z", "Zm9", "Z===", "Zg=A", "Zm9v!", "===="] {
            assert!(decoded(bad).is_err(), "{bad}");
        }
    }
}
