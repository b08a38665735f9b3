//! Size and type of the pages of a stack, and the errors of a page.

use std::fmt;

use tiff::TiffError;

use crate::input::file::Fault;

/// Size and type of a page; all pages of a stack have the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Kind {
    /// Pixels.
    pub(crate) width: usize,
    /// Pixels.
    pub(crate) height: usize,
    /// Bits of a number.
    pub(crate) bits: u8,
    /// Numbers of a pixel: 1, or 3 and 4 of colours.
    pub(crate) components: usize,
}

impl Kind {
    /// Bytes of a page.
    pub(crate) fn bytes(self) -> u64 {
        let numbers = self.width as u64 * self.height as u64 * self.components as u64;
        numbers.saturating_mul(u64::from(self.bits / 8))
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "{}x{} pixels of {} bits",
            self.width, self.height, self.bits
        )?;
        match self.components {
            1 => Ok(()),
            components => write!(f, " in {components} colours"),
        }
    }
}

/// The error of a page.
pub(super) fn fault_of_page(page: usize, error: &TiffError) -> Fault {
    let what = format!("page {page}: {error}");
    match error {
        TiffError::UnsupportedError(_) => Fault::Unsupported(what),
        _ => Fault::Invalid(what),
    }
}
