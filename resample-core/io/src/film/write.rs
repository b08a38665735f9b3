//! Pictures made into a film.

use std::ffi::OsString;
use std::io;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::Stdio;

use super::child::{Running, command};
use super::facts::{ColourTags, Facts, FrameRate};
use super::spatial::{Pair, Spatial};

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

/// The film that another one is made from: its sound and its subtitles go along, and its colours mean the same.
#[derive(Clone, Debug, PartialEq)]
pub struct Original {
    /// Its file.
    pub path: PathBuf,
    /// Its facts.
    pub facts: Facts,
}

impl Original {
    /// The codecs of the subtitles that a container cannot hold, in ffmpeg's words.
    pub fn lost_subtitles(&self, container: Container) -> Vec<&str> {
        let codecs = self.facts.subtitles.iter().map(String::as_str);
        codecs
            .filter(|codec| subtitle_coder(container, codec).is_none())
            .collect()
    }
}

/// The pictures of a film and their coding.
#[derive(Clone, Debug, PartialEq)]
pub struct Coding {
    /// The kind of the whole file, which sets the codec.
    pub container: Container,
    /// Width and height, px.
    pub size: [u32; 2],
    /// Pictures per second.
    pub rate: FrameRate,
    /// Bits of a channel.
    pub bits: u8,
    /// The meaning of the colours.
    pub colours: ColourTags,
    /// The marks for players.
    pub spatial: Spatial,
}

impl Coding {
    /// The coding of a film that is made from `original`, if from any.
    pub fn new(
        container: Container,
        size: [u32; 2],
        rate: FrameRate,
        original: Option<&Original>,
        spatial: Spatial,
    ) -> Self {
        let facts = original.map(|original| &original.facts);
        Self {
            container,
            size,
            rate,
            bits: facts.map_or(8, |facts| facts.bits),
            colours: facts.map_or_else(ColourTags::default, |facts| facts.colours.clone()),
            spatial,
        }
    }

    /// Returns true if the marks must come from an MP4 file: ffmpeg marks a panorama in Matroska only where the pictures that it copies carry the mark.
    pub fn takes_marks_from_mp4(&self) -> bool {
        self.container != Container::Mp4 && self.spatial.panorama.is_some()
    }
}

/// A part of a film that is put together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// Its file.
    pub path: PathBuf,
    /// How many pictures it has.
    pub pictures: usize,
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
    pub fn open(path: &Path, coding: &Coding, original: Option<&Original>) -> io::Result<Self> {
        Self::start(path, coding, original, muxer(coding.container))
    }

    /// Starts to write a part of a film, without sound, for [`join`].
    ///
    /// # Errors
    /// `ffmpeg` cannot be started.
    pub fn piece(path: &Path, coding: &Coding) -> io::Result<Self> {
        // Its times are exact, where those of Matroska are rounded to a millisecond.
        Self::start(path, coding, None, "mp4")
    }

    fn start(
        path: &Path,
        coding: &Coding,
        original: Option<&Original>,
        format: &str,
    ) -> io::Result<Self> {
        let bits = coding.bits;
        let mut write = command("ffmpeg");
        write.args(["-y", "-f", "rawvideo"]);
        write.args(["-pixel_format", if bits > 8 { "rgb48le" } else { "rgb24" }]);
        let [width, height] = coding.size;
        write.args(["-video_size", &format!("{width}x{height}")]);
        write.args(begins(original));
        write.args(["-framerate", &coding.rate.to_string(), "-i", "pipe:0"]);
        write.args(goes_along(coding.container, original)?);
        // No picture is doubled to fill the time before the first one.
        write.args(["-fps_mode", "passthrough"]);
        write.args(colours(&coding.colours, bits));
        write.args(codec(coding.container, bits));
        write.args(packing(coding));
        write.args(stereo_mode(coding));
        write.args(["-f", format]);
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

/// Puts the parts of a film together at `path`, a file that exists, with the sound of the original. Nothing is coded again.
///
/// # Errors
/// `ffmpeg` fails; the error holds its complaint.
pub fn join(
    parts: &[Part],
    path: &Path,
    coding: &Coding,
    original: Option<&Original>,
) -> io::Result<()> {
    let mut list = tempfile::NamedTempFile::new()?;
    for Part { path, pictures } in parts {
        let path = std::path::absolute(path)?.display().to_string();
        let seconds = *pictures as f64 / coding.rate.per_second();
        // A quotation mark ends the quotation, stands for itself, and begins it again. The length is given, since that in the file is rounded.
        let quoted = path.replace('\'', "'\\''");
        writeln!(list, "file '{quoted}'\nduration {seconds:.6}")?;
    }
    list.flush()?;
    let words = ["-f", "concat", "-safe", "0", "-i"].map(OsString::from);
    let pieces = words.into_iter().chain([list.path().into()]);
    if !coding.takes_marks_from_mp4() {
        return copy(pieces, path, coding, original);
    }
    let marked = tempfile::Builder::new().suffix(".mp4").tempfile()?;
    let pictures = Coding {
        container: Container::Mp4,
        ..coding.clone()
    };
    copy(pieces, marked.path(), &pictures, None)?;
    coding.spatial.mark(marked.path())?;
    let marked = ["-i".into(), marked.path().into()];
    copy(marked, path, coding, original)
}

/// Copies pictures to `path` without coding them anew, with the sound of the original. `input` holds the arguments by which ffmpeg finds them.
fn copy(
    input: impl IntoIterator<Item = OsString>,
    path: &Path,
    coding: &Coding,
    original: Option<&Original>,
) -> io::Result<()> {
    let mut copy = command("ffmpeg");
    copy.arg("-y").args(begins(original)).args(input);
    copy.args(goes_along(coding.container, original)?);
    copy.args(["-c:v", "copy"]);
    copy.args(tag(coding.container, coding.bits));
    copy.args(stereo_mode(coding));
    copy.args(["-f", muxer(coding.container)]);
    copy.arg(std::path::absolute(path)?);
    let mut running = Running::start("ffmpeg", copy)?;
    running.end().map_err(io::Error::other)
}

/// The time of the first picture.
fn begins(original: Option<&Original>) -> Vec<String> {
    let begins_s = original.map(|original| original.facts.begins_s);
    begins_s.map_or_else(Vec::new, |begins_s| {
        vec!["-itsoffset".to_owned(), format!("{begins_s:.6}")]
    })
}

/// All of the original beside its pictures: sound, subtitles, chapters, metadata.
fn goes_along(container: Container, original: Option<&Original>) -> io::Result<Vec<OsString>> {
    let Some(original) = original else {
        return Ok(Vec::new());
    };
    let path = std::path::absolute(&original.path)?;
    let words = ["-map", "0:v:0", "-map", "1:a?", "-map_metadata", "1"];
    // The film is no longer turned.
    let further = ["-map_chapters", "1", "-metadata:s:v:0", "rotate=0"];
    let sound = sound(container, original.facts.sound.as_deref());
    let words = words.into_iter().chain(further).chain(sound);
    let words = words.map(str::to_owned);
    let words = words.chain(subtitles(container, &original.facts.subtitles));
    let input = [OsString::from("-i"), path.into_os_string()];
    Ok(input.into_iter().chain(words.map(OsString::from)).collect())
}

/// The arguments for every subtitle that the container holds.
fn subtitles(container: Container, codecs: &[String]) -> Vec<String> {
    let mut words = Vec::new();
    let mut written = 0;
    for (number, codec) in codecs.iter().enumerate() {
        let Some(coder) = subtitle_coder(container, codec) else {
            continue;
        };
        words.extend(["-map".to_owned(), format!("1:s:{number}")]);
        words.extend([format!("-c:s:{written}"), coder.to_owned()]);
        written += 1;
    }
    words
}

/// The coder of a subtitle in a container: `copy` where it takes the packets; `None` where it holds no such subtitle. Only Matroska holds pictures.
fn subtitle_coder(container: Container, codec: &str) -> Option<&'static str> {
    let is_text = ["subrip", "srt", "ass", "ssa", "webvtt", "mov_text", "text"].contains(&codec);
    let is_picture = ["hdmv_pgs_subtitle", "dvd_subtitle", "dvb_subtitle"].contains(&codec);
    match (container, codec) {
        (Container::Mp4, "mov_text") | (Container::WebM, "webvtt") => Some("copy"),
        (Container::Mp4, _) => is_text.then_some("mov_text"),
        (Container::WebM, _) => is_text.then_some("webvtt"),
        (Container::Matroska, "mov_text" | "text") => Some("srt"),
        (Container::Matroska, _) => (is_text || is_picture).then_some("copy"),
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

/// The encoder. The qualities are those at which the encoders' guides see no loss.
fn codec(container: Container, bits: u8) -> Vec<&'static str> {
    let coder: &[&str] = match container {
        Container::Mp4 | Container::Matroska if bits > 8 => &[
            "-c:v",
            "libx265",
            "-crf",
            "20",
            "-x265-params",
            "log-level=error",
        ],
        Container::Mp4 | Container::Matroska => &["-c:v", "libx264", "-crf", "18"],
        Container::WebM => &[
            "-c:v",
            "libvpx-vp9",
            "-crf",
            "20",
            "-b:v",
            "0",
            "-row-mt",
            "1",
        ],
    };
    [coder, tag(container, bits)].concat()
}

/// The mark of a pair in the stream of H.264, for televisions.
fn packing(coding: &Coding) -> Vec<&'static str> {
    let is_h264 = coding.container != Container::WebM && coding.bits == 8;
    let packing = coding
        .spatial
        .pair
        .filter(|_| is_h264)
        .map(|pair| match pair {
            Pair::SideBySide => "frame-packing=3",
            Pair::TopBottom => "frame-packing=4",
        });
    packing.map_or_else(Vec::new, |packing| vec!["-x264-params", packing])
}

/// The mark of a pair in the track, where the container is no MP4.
fn stereo_mode(coding: &Coding) -> Vec<&'static str> {
    let is_matroska = coding.container != Container::Mp4;
    let mode = coding
        .spatial
        .pair
        .filter(|_| is_matroska)
        .map(|pair| match pair {
            Pair::SideBySide => "stereo_mode=left_right",
            Pair::TopBottom => "stereo_mode=top_bottom",
        });
    mode.map_or_else(Vec::new, |mode| vec!["-metadata:s:v:0", mode])
}

/// The name of H.265 in MP4 that Apple's players ask for.
fn tag(container: Container, bits: u8) -> &'static [&'static str] {
    match container {
        Container::Mp4 if bits > 8 => &["-tag:v", "hvc1"],
        _ => &[],
    }
}

/// The name by which ffmpeg knows a container.
fn muxer(container: Container) -> &'static str {
    match container {
        Container::Mp4 => "mp4",
        Container::Matroska => "matroska",
        Container::WebM => "webm",
    }
}
