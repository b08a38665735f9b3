//! WebP without loss: sRGB, 8 bits, straight alpha; one picture, or an animation.
//!
//! Takes the bytes of pictures of one size. One picture is what the encoder writes. Of several, each picture's VP8L
//! chunk goes into a frame of the extended format, and the length of the file is filled in at the end. Source: Google,
//! "WebP Container Specification" (RIFF, VP8X, ANIM, ANMF).
//! Limits: 16384 pixels a side, four gigabytes, whole milliseconds a frame; each frame is stored whole.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};

use image_webp::{ColorType, WebPEncoder};

/// Most pixels along a side: the format has 14 bits for it.
pub const MAX_SIDE: u32 = 1 << 14;

/// An animation, or one picture, in the making.
pub struct WebP {
    file: File,
    size: [u32; 2],
    fps: u16,
    /// Frames written so far.
    frames: u64,
    kind: Kind,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Still,
    Animation,
}

/// Flags of the extended format: frames, and alpha in them.
const ANIMATED_WITH_ALPHA: u8 = 0x02 | 0x10;

/// A frame replaces the one before, and is not blended with it.
const REPLACE: u8 = 0x02;

impl WebP {
    /// Starts a file for `count` pictures of `size` pixels, width and height.
    pub fn begin(mut file: File, size: [u32; 2], fps: u16, count: u32) -> io::Result<Self> {
        let kind = if count > 1 {
            Kind::Animation
        } else {
            Kind::Still
        };
        if kind == Kind::Animation {
            let mut head = Vec::from(*b"RIFF\0\0\0\0WEBP");
            let mut extended = vec![ANIMATED_WITH_ALPHA, 0, 0, 0];
            size.iter()
                .for_each(|side| extended.extend(three_bytes(side - 1)));
            chunk(&mut head, *b"VP8X", &extended)?;
            // A transparent background, and no end of repeating.
            chunk(&mut head, *b"ANIM", &[0; 6])?;
            file.write_all(&head)?;
        }
        Ok(Self {
            file,
            size,
            fps,
            frames: 0,
            kind,
        })
    }

    /// Adds a picture: red, green, blue and alpha.
    pub fn add(&mut self, rgba: &[u8]) -> io::Result<()> {
        let mut whole = Vec::new();
        let encoder = WebPEncoder::new(&mut whole);
        let encoded = encoder.encode(rgba, self.size[0], self.size[1], ColorType::Rgba8);
        encoded.map_err(io::Error::other)?;
        if self.kind == Kind::Still {
            return self.file.write_all(&whole);
        }
        // A frame lasts until the next one begins, so that rounding does not add up.
        let start_ms = |frame: u64| (1000 * frame + u64::from(self.fps) / 2) / u64::from(self.fps);
        let duration_ms = start_ms(self.frames + 1) - start_ms(self.frames);
        let mut frame = vec![0; 6];
        self.size
            .iter()
            .for_each(|side| frame.extend(three_bytes(side - 1)));
        frame.extend(three_bytes(
            u32::try_from(duration_ms).map_err(io::Error::other)?,
        ));
        frame.push(REPLACE);
        chunk(&mut frame, *b"VP8L", lossless_part(&whole)?)?;
        let mut bytes = Vec::new();
        chunk(&mut bytes, *b"ANMF", &frame)?;
        self.frames += 1;
        self.file.write_all(&bytes)
    }

    /// Ends the file.
    pub fn finish(mut self) -> io::Result<()> {
        if self.kind == Kind::Animation {
            let bytes = self.file.seek(SeekFrom::End(0))?;
            let after_head = u32::try_from(bytes - 8).map_err(|_| {
                io::Error::other(
                    "a WebP file holds four gigabytes at most: write numbered pictures instead",
                )
            })?;
            self.file.seek(SeekFrom::Start(4))?;
            self.file.write_all(&after_head.to_le_bytes())?;
        }
        self.file.flush()
    }
}

/// Appends a chunk: name, length, content, and a byte more where the length is odd.
fn chunk(to: &mut Vec<u8>, name: [u8; 4], content: &[u8]) -> io::Result<()> {
    to.extend(name);
    let length = u32::try_from(content.len()).map_err(io::Error::other)?;
    to.extend(length.to_le_bytes());
    to.extend(content);
    to.resize(to.len().next_multiple_of(2), 0);
    Ok(())
}

/// The content of the VP8L chunk of a whole file.
fn lossless_part(file: &[u8]) -> io::Result<&[u8]> {
    let mut rest = file.get(12..).unwrap_or_default();
    while let Some((head, content)) = rest.split_at_checked(8) {
        let length = u32::from_le_bytes([head[4], head[5], head[6], head[7]]) as usize;
        let Some(part) = content.get(..length) else {
            break;
        };
        if head[..4] == *b"VP8L" {
            return Ok(part);
        }
        rest = content
            .get(length.next_multiple_of(2)..)
            .unwrap_or_default();
    }
    Err(io::Error::other(
        "the WebP encoder gave a file without a lossless picture",
    ))
}

/// The lower three bytes, the lowest first.
fn three_bytes(value: u32) -> [u8; 3] {
    let [a, b, c, _] = value.to_le_bytes();
    [a, b, c]
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::webp::WebPDecoder;
    use image::{AnimationDecoder, ImageDecoder};
    use std::io::{BufReader, Read};

    const SIZE: [u32; 2] = [5, 3];

    fn picture(number: u8) -> Vec<u8> {
        (0..15)
            .flat_map(|i| {
                [
                    number * 40 + i,
                    200 - i,
                    3 * i,
                    if i % 4 == 0 { 0 } else { 17 * i },
                ]
            })
            .collect()
    }

    fn written(count: u8) -> Vec<u8> {
        let mut file = tempfile::tempfile().expect("a temporary file");
        let mut webp = WebP::begin(
            file.try_clone().expect("the same file"),
            SIZE,
            30,
            count.into(),
        )
        .expect("begun");
        (0..count).for_each(|number| webp.add(&picture(number)).expect("added"));
        webp.finish().expect("ended");
        file.rewind().expect("a file");
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).expect("readable");
        bytes
    }

    #[test]
    fn an_animation_comes_back_to_the_bit() {
        let bytes = written(4);
        assert_eq!(bytes.len() % 2, 0, "chunks are padded");
        let decoder = WebPDecoder::new(BufReader::new(io::Cursor::new(&bytes))).expect("a WebP");
        assert!(
            decoder.has_animation() && decoder.dimensions() == (5, 3),
            "an animation of its size"
        );
        let frames = decoder
            .into_frames()
            .collect_frames()
            .expect("whole frames");
        assert_eq!(frames.len(), 4, "frames");
        let mut total_ms = 0.0;
        for (number, frame) in frames.iter().enumerate() {
            let (numerator, denominator) = frame.delay().numer_denom_ms();
            total_ms += f64::from(numerator) / f64::from(denominator);
            let wanted = picture(number as u8);
            for (pixel, (got, wanted)) in frame.buffer().chunks(4).zip(wanted.chunks(4)).enumerate()
            {
                // What is fully transparent has no colour.
                assert_eq!(got[3], wanted[3], "frame {number}, pixel {pixel}: alpha");
                assert!(
                    got[3] == 0 || got == wanted,
                    "frame {number}, pixel {pixel}: {got:?}, {wanted:?}"
                );
            }
        }
        assert!(
            (total_ms - 133.0).abs() < 1e-9,
            "four frames of a thirtieth of a second: {total_ms} ms"
        );
    }

    #[test]
    fn one_picture_is_a_plain_file() {
        let bytes = written(1);
        let decoder = WebPDecoder::new(BufReader::new(io::Cursor::new(&bytes))).expect("a WebP");
        assert!(!decoder.has_animation(), "one picture");
        let read = image::load_from_memory(&bytes)
            .expect("a picture")
            .to_rgba8();
        assert_eq!(read.into_raw(), picture(0), "to the bit");
    }
}
