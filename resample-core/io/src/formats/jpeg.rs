//! Checks that a JPEG is complete: decoders draw missing parts in grey, without an error.
//!
//! The end of an image is marked, and no byte of its data looks like that mark. Thumbnails lie before the data, in segments that are
//! passed over by their lengths.

/// Marks of the beginning of data and of the image's end; each follows a byte of ones.
const DATA: u8 = 0xda;
const END: u8 = 0xd9;

/// Refuses a JPEG whose data breaks off. What is not even begun is left to the decoder.
pub(crate) fn check_whole(bytes: &[u8]) -> Result<(), String> {
    let Some(data) = data_of(bytes) else {
        return Ok(());
    };
    match data.windows(2).any(|pair| pair == [0xff, END]) {
        true => Ok(()),
        false => Err("the JPEG breaks off: its end is missing".into()),
    }
}

/// The bytes between the last segment and the first data.
fn data_of(bytes: &[u8]) -> Option<&[u8]> {
    let mut rest = bytes.strip_prefix(b"\xff\xd8")?;
    loop {
        let [0xff, kind, after @ ..] = rest else {
            return None;
        };
        match kind {
            // Filling before a mark.
            0xff => rest = &rest[1..],
            &DATA => return Some(after),
            _ => {
                let length = u16::from_be_bytes([*after.first()?, *after.get(1)?]);
                rest = after.get(usize::from(length)..)?;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jpegs_that_break_off_are_refused() {
        let noise = |k: u32| (k.wrapping_mul(0x9e37_79b1) >> 24) as u8;
        let picture = image::RgbImage::from_fn(64, 48, |x, y| {
            image::Rgb([noise(x), noise(y), noise(x + y)])
        });
        let mut file = std::io::Cursor::new(Vec::new());
        let written = picture.write_to(&mut file, image::ImageFormat::Jpeg);
        written.expect("memory");
        let whole = file.into_inner();
        assert_eq!(check_whole(&whole), Ok(()));
        let followed = [whole.as_slice(), b"more"].concat();
        assert_eq!(check_whole(&followed), Ok(()), "bytes after the end");
        for length in [whole.len() - 1, whole.len() - 40, whole.len() / 2] {
            let gate = crate::Gate::default();
            let decoded = crate::whole_picture::decode(&whole[..length], None, &gate);
            assert!(
                decoded.is_err_and(|what| what.contains("breaks off")),
                "{length} of {} bytes",
                whole.len()
            );
        }
    }
}
