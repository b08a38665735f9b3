//! The lines of a text header, read one by one and counted in bytes, so that it is known where attached data begins.

use std::io::{BufRead, Read};

use crate::input::fault::Fault;

/// Longest header that is read. Diffusion data with hundreds of gradients has some hundred kB; this is a guess beyond it.
const MAX_HEADER_BYTES: u64 = 1 << 24;

/// The lines of a header, which end in LF or CR LF.
pub(crate) struct Lines<'a> {
    reader: &'a mut dyn BufRead,
    /// Bytes read so far, line ends included.
    pub(crate) bytes: u64,
}

impl<'a> Lines<'a> {
    pub(crate) fn new(reader: &'a mut dyn BufRead) -> Self {
        Self { reader, bytes: 0 }
    }

    /// The next line without its end, `None` at the end of the file.
    pub(crate) fn next(&mut self) -> Result<Option<String>, Fault> {
        let mut line = Vec::new();
        let room = MAX_HEADER_BYTES - self.bytes;
        let got = (&mut *self.reader).take(room).read_until(b'\n', &mut line);
        let got = got.map_err(|error| format!("the header cannot be read: {error}"))? as u64;
        self.bytes += got;
        if got == room && !line.ends_with(b"\n") {
            return Err(Fault::Invalid(format!(
                "the header has no end within {MAX_HEADER_BYTES} bytes"
            )));
        }
        let text = String::from_utf8_lossy(&line);
        Ok((got > 0).then(|| {
            text.trim_end_matches('\n')
                .trim_end_matches('\r')
                .to_owned()
        }))
    }
}
