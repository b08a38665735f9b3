//! DICOM's run-length encoding: planes of bytes, each packed like PackBits.
//!
//! A fragment begins with the number of planes and where each begins; the plane of the most significant bytes comes
//! first. Source: DICOM PS3.5, Annex G.

/// Bytes of the table in front of the planes: their number and fifteen places.
const TABLE_BYTES: usize = 64;

/// Unpacks a frame of `values` numbers of `bytes` bytes each; the result is little-endian.
pub(crate) fn unpack(fragment: &[u8], values: usize, bytes: usize) -> Result<Vec<u8>, String> {
    let number = |at: usize| -> Option<usize> {
        let four = fragment.get(4 * at..4 * at + 4)?;
        Some(u32::from_le_bytes(four.try_into().ok()?) as usize)
    };
    if number(0) != Some(bytes) || fragment.len() < TABLE_BYTES {
        return Err(format!(
            "the RLE table is broken: expected {bytes} plane(s)"
        ));
    }
    // Two packed bytes give at most 128.
    if values.saturating_mul(bytes) > fragment.len().saturating_mul(64) {
        return Err(format!(
            "{} packed bytes cannot hold {values} values: the frame is cut off",
            fragment.len()
        ));
    }
    let mut frame = vec![0; values * bytes];
    for plane in 0..bytes {
        let begin = number(1 + plane).filter(|&begin| begin >= TABLE_BYTES);
        let packed = begin.and_then(|begin| fragment.get(begin..));
        let packed =
            packed.ok_or_else(|| "a plane of the RLE table lies outside the frame".to_owned())?;
        let mut places = (bytes - 1 - plane..frame.len()).step_by(bytes);
        unpack_plane(
            packed,
            &mut |byte| places.next().map(|place| frame[place] = byte).is_some(),
            values,
        )?;
    }
    Ok(frame)
}

/// Hands out `count` bytes; `put` says whether there was a place for the byte.
fn unpack_plane(
    mut packed: &[u8],
    put: &mut dyn FnMut(u8) -> bool,
    count: usize,
) -> Result<(), String> {
    let cut = || "an RLE plane is cut off".to_owned();
    let mut done = 0;
    while done < count {
        let (&control, rest) = packed.split_first().ok_or_else(cut)?;
        let length = usize::from(control);
        match length {
            0..=127 => {
                let (literal, after) = rest.split_at_checked(length + 1).ok_or_else(cut)?;
                done += literal.iter().filter(|&&byte| put(byte)).count();
                packed = after;
            }
            128 => packed = rest,
            _ => {
                let (&byte, after) = rest.split_first().ok_or_else(cut)?;
                done += (0..257 - length).filter(|_| put(byte)).count();
                packed = after;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fragment(planes: &[&[u8]]) -> Vec<u8> {
        let mut table = vec![planes.len() as u32];
        let mut at = TABLE_BYTES as u32;
        for plane in planes {
            table.push(at);
            at += plane.len() as u32;
        }
        table.resize(16, 0);
        table
            .iter()
            .flat_map(|n| n.to_le_bytes())
            .chain(planes.concat())
            .collect()
    }

    #[test]
    fn runs_and_literals_of_two_planes_are_woven() {
        // High bytes: three times 1, then 2. Low bytes: 5 6 7 8, and an ignored 128.
        let packed = fragment(&[&[254, 1, 0, 2], &[128, 3, 5, 6, 7, 8]]);
        assert_eq!(
            unpack(&packed, 4, 2).expect("valid"),
            [5, 1, 6, 1, 7, 1, 8, 2]
        );
        assert_eq!(
            unpack(&fragment(&[&[255, 9, 0]]), 2, 1).expect("a run to the end"),
            [9, 9]
        );
    }

    #[test]
    fn broken_frames_are_refused() {
        assert!(
            unpack(&fragment(&[&[254, 1]]), 4, 1)
                .expect_err("short")
                .contains("cut off")
        );
        assert!(
            unpack(&fragment(&[&[254, 1]]), 4, 2)
                .expect_err("planes")
                .contains("expected 2 plane")
        );
        assert!(
            unpack(&fragment(&[&[1, 1]]), 1 << 20, 1)
                .expect_err("claim")
                .contains("cannot hold")
        );
        assert!(unpack(&[1, 0], 1, 1).is_err(), "no table");
        let mut outside = fragment(&[&[0, 1]]);
        outside[4..8].copy_from_slice(&900u32.to_le_bytes());
        assert!(
            unpack(&outside, 1, 1)
                .expect_err("outside")
                .contains("outside")
        );
    }
}
