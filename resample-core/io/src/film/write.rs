//! Pictures made into a film.

use std::io;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::Stdio;

use super::child::{Running, command};
use super::facts::{ColourTags, Facts, FrameRate};

/// Kind of video file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Container {
    /// H.264 in MP4; H.265 for more than 8 bits.
    Mp4,
    /// VP9 in WebM.
    WebM,
    /// H.264 in Matroska; H.265 for more than 8 bits.
    Matroska,
}

/// The film that another one is made from: its sound goes along, and its colours mean the same.
#[derive(Clone, Debug, PartialEq)]
pub struct Original {
    /// Its file.
    pub path: PathBuf,
    /// Its facts.
    pub facts: Facts,
}

/// Writes a film, picture after picture. Dropped before [`Writer::finish`], it stops, and the file is of no use.
pub struct Writer {
    running: Running,
}

impl Writer {
    /// Starts to write to `path`, a file that exists.
    ///
    /// # Errors
    /// `ffmpeg` cannot be started.
    pub fn open(
        path: &Path,
        container: Container,
        size: [u32; 2],
        rate: FrameRate,
        original: Option<&Original>,
    ) -> io::Result<Self> {
        let bits = original.map_or(8, |original| original.facts.bits);
        let mut write = command("ffmpeg");
        write.args(["-y", "-f", "rawvideo"]);
        write.args(["-pixel_format", if bits > 8 { "rgb48le" } else { "rgb24" }]);
        let [width, height] = size;
        write.args(["-video_size", &format!("{width}x{height}")]);
        if let Some(begins_s) = original.map(|original| original.facts.begins_s) {
            write.args(["-itsoffset", &format!("{begins_s:.6}")]);
        }
        write.args(["-framerate", &rate.to_string(), "-i", "pipe:0"]);
        if let Some(original) = original {
            write.arg("-i").arg(std::path::absolute(&original.path)?);
            write.args(["-map", "0:v:0", "-map", "1:a?"]);
            write.args(["-map_metadata", "1", "-map_chapters", "1"]);
            // The film is no longer turned.
            write.args(["-metadata:s:v:0", "rotate=0"]);
            write.args(sound(container, original.facts.sound.as_deref()));
        }
        // No picture is doubled to fill the time before the first one.
        write.args(["-fps_mode", "passthrough"]);
        let plain = ColourTags::default();
        let tags = original.map_or(&plain, |original| &original.facts.colours);
        write.args(colours(tags, bits));
        write.args(encoding(container, bits));
        // An absolute name is never taken for an option or a protocol.
        write.arg(std::path::absolute(path)?);
        write.stdin(Stdio::piped());
        Ok(Self {
            running: Running::start("ffmpeg", write)?,
        })
    }

    /// Adds a picture: red, green and blue of each pixel, row by row, in bytes, or in little-endian words of 16 bits for an original of
    /// more than 8.
    ///
    /// # Errors
    /// `ffmpeg` fails; the error holds its complaint.
    pub fn add(&mut self, rgb: &[u8]) -> io::Result<()> {
        let Some(pipe) = self.running.child.stdin.as_mut() else {
            return Err(io::Error::other("ffmpeg listens no more"));
        };
        match pipe.write_all(rgb) {
            // ffmpeg exited early; its complaint says why.
            Err(error) if error.kind() == ErrorKind::BrokenPipe => {
                Err(self.running.end().err().map_or(error, io::Error::other))
            }
            other => other,
        }
    }

    /// Waits until the file is complete.
    ///
    /// # Errors
    /// `ffmpeg` fails; the error holds its complaint.
    pub fn finish(mut self) -> io::Result<()> {
        self.running.end().map_err(io::Error::other)
    }
}

/// The sound's packets are copied where the container takes them, else encoded anew.
fn sound(container: Container, codec: Option<&str>) -> Vec<&'static str> {
    let is_plain = codec.is_some_and(|codec| codec.starts_with("pcm_"));
    let fits = match container {
        Container::Matroska => true,
        Container::Mp4 => !is_plain,
        Container::WebM => matches!(codec, Some("opus" | "vorbis")),
    };
    match (fits, container) {
        (true, _) => vec!["-c:a", "copy"],
        (false, Container::WebM) => vec!["-c:a", "libopus", "-b:a", "160k"],
        (false, _) => vec!["-c:a", "aac", "-b:a", "256k"],
    }
}

/// The matrix, the range and the tags: those of the original, else BT.709, of which sRGB has the primaries.
fn colours(tags: &ColourTags, bits: u8) -> Vec<String> {
    let or = |tag: &String, plain: &str| match tag.as_str() {
        // Films of red, green and blue become luma and chroma.
        "" | "gbr" | "rgb" => plain.to_owned(),
        tag => tag.to_owned(),
    };
    let matrix = or(&tags.matrix, "bt709");
    let range = or(&tags.range, "tv");
    let format = if bits > 8 { "yuv420p10le" } else { "yuv420p" };
    // The scaler's own word for the matrix of BT.2020.
    let scaled = matrix
        .replace("bt2020nc", "bt2020")
        .replace("bt2020c", "bt2020");
    [
        "-vf",
        &format!("scale=out_color_matrix={scaled}:out_range={range},format={format}"),
        "-colorspace",
        &matrix,
        "-color_primaries",
        &or(&tags.primaries, "bt709"),
        "-color_trc",
        &or(&tags.transfer, "iec61966-2-1"),
        "-color_range",
        &range,
    ]
    .map(str::to_owned)
    .to_vec()
}

/// The encoder and the container. The qualities are those at which the encoders' guides see no loss.
fn encoding(container: Container, bits: u8) -> &'static [&'static str] {
    let deep = bits > 8;
    match container {
        Container::Mp4 if deep => &[
            "-c:v",
            "libx265",
            "-crf",
            "20",
            "-tag:v",
            "hvc1",
            "-x265-params",
            "log-level=error",
            "-f",
            "mp4",
        ],
        Container::Mp4 => &["-c:v", "libx264", "-crf", "18", "-f", "mp4"],
        Container::Matroska if deep => &[
            "-c:v",
            "libx265",
            "-crf",
            "20",
            "-x265-params",
            "log-level=error",
            "-f",
            "matroska",
        ],
        Container::Matroska => &["-c:v", "libx264", "-crf", "18", "-f", "matroska"],
        Container::WebM => &[
            "-c:v",
            "libvpx-vp9",
            "-crf",
            "20",
            "-b:v",
            "0",
            "-row-mt",
            "1",
            "-f",
            "webm",
        ],
    }
}
