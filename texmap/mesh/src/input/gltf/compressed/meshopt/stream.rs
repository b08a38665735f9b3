//! The bytes of a stream, from front to end.

/// The bytes of a stream, taken from its front.
pub(super) struct Stream<'a> {
    pub(super) left: &'a [u8],
}

impl<'a> Stream<'a> {
    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (front, left) = self.left.split_at_checked(count).ok_or("it is cut")?;
        self.left = left;
        Ok(front)
    }

    pub(super) fn byte(&mut self) -> Result<u8, String> {
        self.take(1).map(|bytes| bytes[0])
    }

    /// A number in groups of 7 bits, the lowest first.
    pub(super) fn number(&mut self) -> Result<u32, String> {
        let mut number = 0;
        // Five groups hold 32 bits.
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            number |= u32::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(number);
            }
        }
        Err("a number is longer than 32 bits".into())
    }

    pub(super) fn check_end(&self) -> Result<(), String> {
        match self.left.len() {
            0 => Ok(()),
            left => Err(format!("{left} bytes are left at its end")),
        }
    }
}

/// A difference whose sign is its lowest bit.
pub(super) fn signed(code: u32) -> u32 {
    (code >> 1) ^ (code & 1).wrapping_neg()
}
