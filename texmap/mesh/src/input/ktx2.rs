//! Pictures in KTX2, as Basis Universal compresses them: ETC1S, UASTC and ASTC, also behind Zstandard.
//!
//! Takes the bytes of a file, gives its largest level; the levels below are made anew where they are needed. The blocks are
//! decoded by the crate `basisu`.
//! Source: KTX 2.0, Khronos Group; `KHR_texture_basisu`. Limits: other contents of KTX2 and those of high dynamic range are refused.

use std::sync::Arc;

use basisu::{DecodeFlags, Error, TargetFormat, Transcoder};
use resample_io::Gate;

use crate::scene::{Texels, Texture};

/// The first bytes of each file.
const MARK: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

const WAY_OUT: &str = "export it as PNG, JPEG or WebP, or as KTX2 with UASTC or ETC1S";

/// Returns true if a file starts as a KTX2 does.
pub(super) fn is_ktx2(bytes: &[u8]) -> bool {
    bytes.starts_with(MARK)
}

/// Decodes a picture.
pub(super) fn decode(bytes: &[u8], name: &str, gate: &Gate) -> Result<Texture, String> {
    let no_picture = |what: &str| format!("KTX2 {what}: {WAY_OUT}");
    gate.ask_unpacked(unpacked_bytes(bytes), bytes.len() as u64, "the pixels")?;
    let bytes = without_keys(bytes);
    let file = Transcoder::new(&bytes)
        .map_err(|_| no_picture("of another kind than Basis Universal, or damaged"))?;
    let (width, height) = file.base_dimensions();
    let texels = file
        .transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE)
        .map_err(|error| match error {
            Error::Unsupported { .. } => no_picture("of high dynamic range"),
            Error::VideoRequiresState => no_picture("of a film"),
            _ => "KTX2 that cannot be decoded: it is damaged".into(),
        })?;
    Ok(Texture {
        name: name.to_owned(),
        width: width as usize,
        height: height as usize,
        texels: Texels::Srgb8(Arc::new(texels.as_chunks().0.to_vec())),
    })
}

/// The memory that a file asks for, bytes: its pixels, and the blocks behind Zstandard.
pub(super) fn unpacked_bytes(bytes: &[u8]) -> u64 {
    // Places in the header: width, height, and the unpacked size of the largest level.
    let word = |at: usize| {
        let word = bytes.get(at..).and_then(<[u8]>::first_chunk);
        u64::from(word.map_or(0, |word| u32::from_le_bytes(*word)))
    };
    let pixels = word(20).saturating_mul(word(24));
    let blocks = word(96).saturating_add(word(100) << 32);
    pixels.saturating_mul(4).saturating_add(blocks)
}

/// A file without its keys and values, which say nothing about its pixels, and over which `basisu` 0.1.0 panics where they are damaged.
fn without_keys(bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    // The place and the length of the keys and values in the header.
    if let Some(words) = bytes.get_mut(56..64) {
        words.fill(0);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::files::data_uri;

    // 12 x 8 pixels, written by the encoder of Basis Universal 2.50 as ETC1S, as UASTC and as UASTC behind Zstandard: red rises
    // by 20 a column, green by 30 a row, blue is 40; in the second, alpha falls by 10 a column.
    const ETC1S: &str = "q0tUWCAyMLsNChoKAAAAAAEAAAAMAAAACAAAAAAAAAAAAAAAAQAAAAEAAAABAAAAaAAAACwAAACUAAAAJAAAALgAAAAAAAAAlwAA\
     AAAAAABPAQAAAAAAAAMAAAAAAAAAAAAAAAAAAAAsAAAAAAAAAAIAKACjAQIAAwMAAAgAAAAAAAAAAAA/AAAAAAAAAAAA/////x8A\
     AABLVFh3cml0ZXIAQmFzaXMgVW5pdmVyc2FsIDIuNTAAAAYAAwA1AAAADQAAAC0AAAAAAAAAAAAAAAAAAAADAAAAAAAAAAAAAAAg\
     wNQAAAAAQQA2qwROwAKIAiAAAAAAsV1hACYCAAAAAACQAAjAFAAAAABAEEQdvfeQ6QpHAASoUv0HqFL/B6hU/wcAwUQAAAAAAADy\
     X00AmAAAAAAAAEAgAiIECAAAAEBiiycCgAkAAAAAAAAEEAAYuwE=";
    const UASTC: &str = "q0tUWCAyMLsNChoKAAAAAAEAAAAMAAAACAAAAAAAAAAAAAAAAQAAAAEAAAAAAAAAaAAAACwAAACUAAAALAAAAAAAAAAAAAAAAAAA\
     AAAAAADAAAAAAAAAAGAAAAAAAAAAYAAAAAAAAAAsAAAAAAAAAAIAKACmAQIAAwMAABAAAAAAAAAAAAB/AwAAAAAAAAAA/////x8A\
     AABLVFh3cml0ZXIAQmFzaXMgVW5pdmVyc2FsIDIuNTAAAAQAAAB/fwAAKAGpMYCBEkURMlR2mLrc/igB6bDpgxJVEjJUdpi63P4o\
     kUhxdoESbRMyVHaYutz+KAHJMoB5EUURMlR2mLrc/igBCbLpexFVEjJUdpi63P4okWhydnkRbRMyVHaYutz+";
    const ZSTANDARD: &str = "q0tUWCAyMLsNChoKAAAAAAEAAAAMAAAACAAAAAAAAAAAAAAAAQAAAAEAAAACAAAAaAAAACwAAACUAAAAJAAAAAAAAAAAAAAAAAAA\
     AAAAAAC4AAAAAAAAAEYAAAAAAAAAYAAAAAAAAAAsAAAAAAAAAAIAKACmAQIAAwMAABAAAAAAAAAAAAB/AAAAAAAAAAAA/////x8A\
     AABLVFh3cml0ZXIAQmFzaXMgVW5pdmVyc2FsIDIuNTAAACi1L/0gYO0BAAQDm5LXIwAcsEoRMlR2mLrc/puSliJAO5AT25LGgwCc\
     X0pByFHZYupz+9uShoJAu5CTBABgw4BsAMZGnk0=";

    fn file(base64: &str) -> Vec<u8> {
        let bytes = data_uri(&format!("data:;base64,{base64}")).expect("a data URI");
        bytes.expect("base64")
    }

    #[test]
    fn pictures_are_those_that_were_written() {
        // UASTC of a gradient is exact to its quantum; ETC1S has one colour and four lightnesses for 4 x 4 pixels.
        for (base64, alpha_step, most) in [(UASTC, 10, 6), (ZSTANDARD, 0, 6), (ETC1S, 0, 64)] {
            let texture = decode(&file(base64), "a", &Gate::default()).expect("a picture");
            assert_eq!((texture.width, texture.height), (12, 8), "its size");
            let Texels::Srgb8(texels) = &texture.texels else {
                panic!("codes of 8 bits")
            };
            for (at, texel) in texels.iter().enumerate() {
                let (x, y) = (at % 12, at / 12);
                let expected = [20 * x, 30 * y, 40, 255 - alpha_step * x];
                for (found, expected) in texel.iter().zip(expected) {
                    let error = usize::from(*found).abs_diff(expected);
                    assert!(
                        error <= most,
                        "{texel:?} at {x}, {y}: {error} from {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn damaged_files_are_refused() {
        for base64 in [ETC1S, UASTC, ZSTANDARD] {
            let whole = file(base64);
            for length in MARK.len()..whole.len() {
                let error = decode(&whole[..length], "a", &Gate::default());
                assert!(error.is_err(), "{base64} cut to {length} bytes");
            }
            // A side of 2^30 pixels.
            let mut huge = whole.clone();
            huge[23] = 0x40;
            let error = decode(&huge, "a", &Gate::default()).expect_err("too large");
            assert!(error.contains("memory"), "{error}");
            let mut other = whole.clone();
            other[12] = 37;
            let error = decode(&other, "a", &Gate::default()).expect_err("another kind");
            assert!(error.contains("export it as PNG"), "{error}");
        }
        // Unpacked blocks of 2^56 bytes.
        let mut bomb = file(ZSTANDARD);
        bomb[103] = 1;
        assert!(decode(&bomb, "a", &Gate::default()).is_err(), "a bomb");
    }

    #[test]
    fn damaged_keys_do_not_matter() {
        let mut keys = file(UASTC);
        // The length of the first key, which runs over the end.
        keys[148] = 0x1d;
        assert!(
            decode(&keys, "a", &Gate::default()).is_ok(),
            "its pixels are whole"
        );
    }
}
