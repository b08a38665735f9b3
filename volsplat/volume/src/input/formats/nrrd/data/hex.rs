//! Hexadecimal text as a stream of bytes: two digits a byte, the high one first, white space ignored.

use std::io::{self, BufRead, Read};

/// Unpacks hexadecimal text.
pub(crate) struct HexReader<R> {
    text: R,
    /// The first digit of a byte whose second one has not come yet.
    high: Option<u8>,
}

impl<R: BufRead> HexReader<R> {
    pub(crate) fn new(text: R) -> Self {
        Self { text, high: None }
    }
}

impl<R: BufRead> Read for HexReader<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let mut written = 0;
        while written == 0 && !bytes.is_empty() {
            let text = self.text.fill_buf()?;
            if text.is_empty() {
                return if self.high.is_none() {
                    Ok(0)
                } else {
                    Err(fault("half a byte at the end"))
                };
            }
            let mut used = 0;
            for &character in text {
                if written == bytes.len() {
                    break;
                }
                used += 1;
                if character.is_ascii_whitespace() {
                    continue;
                }
                let digit = char::from(character)
                    .to_digit(16)
                    .ok_or_else(|| fault("not a hexadecimal digit"))?
                    as u8;
                match self.high.take() {
                    None => self.high = Some(digit),
                    Some(high) => {
                        bytes[written] = high << 4 | digit;
                        written += 1;
                    }
                }
            }
            self.text.consume(used);
        }
        Ok(written)
    }
}

fn fault(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, format!("hex data: {what}"))
}
