//! LZF, with which PCD files are packed.
//!
//! Takes packed bytes, gives exactly so many unpacked ones. A byte below 32 is followed by that many literal bytes and one more;
//! any other has a length in its upper 3 bits (7: one more byte of length) and, with the next byte, how far back the copy begins.
//! Source: the format of M. Lehmann's LibLZF.

/// Unpacks; the caller has asked for the memory of `size` bytes.
pub(super) fn unpack(packed: &[u8], size: usize) -> Result<Vec<u8>, String> {
    let damaged = || "its packed points are damaged".to_owned();
    let mut bytes = Vec::with_capacity(size);
    let mut rest = packed.iter();
    while let Some(control) = rest.next() {
        let control = usize::from(*control);
        if control < 32 {
            let literal = rest.as_slice().get(..control + 1).ok_or_else(damaged)?;
            bytes.extend_from_slice(literal);
            rest.nth(control);
        } else {
            let mut length = control >> 5;
            if length == 7 {
                length += usize::from(*rest.next().ok_or_else(damaged)?);
            }
            let low = usize::from(*rest.next().ok_or_else(damaged)?);
            let back = ((control & 31) << 8 | low) + 1;
            let from = bytes.len().checked_sub(back).ok_or_else(damaged)?;
            // One after another, because a copy may reach into itself.
            for at in from..from + length + 2 {
                bytes.push(bytes[at]);
            }
        }
        if bytes.len() > size {
            return Err(damaged());
        }
    }
    match bytes.len() == size {
        true => Ok(bytes),
        false => Err(damaged()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_and_copies_are_unpacked() {
        assert_eq!(unpack(&[2, 1, 2, 3], 3), Ok(vec![1, 2, 3]));
        // Three bytes from one back: a run.
        assert_eq!(unpack(&[0, 9, 0x20, 0], 4), Ok(vec![9; 4]));
        // 7 + 4 + 2 bytes from two back.
        let long = unpack(&[1, 1, 2, 0xe0, 4, 1], 15).expect("good");
        assert_eq!(long, [1, 2, 1, 2, 1, 2, 1, 2, 1, 2, 1, 2, 1, 2, 1]);
    }

    #[test]
    fn damage_is_noticed() {
        for bad in [
            [5, 1].as_slice(),
            &[0x20],
            &[0x20, 0],
            &[0, 1, 0x20, 1],
            &[0xe0],
        ] {
            assert!(unpack(bad, 4).is_err(), "{bad:?}");
        }
        assert!(unpack(&[2, 1, 2, 3], 2).is_err(), "too long");
        assert!(unpack(&[2, 1, 2, 3], 4).is_err(), "too short");
    }
}
