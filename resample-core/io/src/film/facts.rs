//! Size, rate, colours, sound and subtitles of a film.

use std::fmt;
use std::io::Read;
use std::path::Path;
use std::process::Stdio;

use resample_core::Error;

use super::child::{Running, check_tool, command};
use crate::files::{MAX_PIXELS, fault};

/// Pictures per second as a fraction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameRate {
    /// Its numerator, above 0.
    pub numerator: u32,
    /// Its denominator, above 0.
    pub denominator: u32,
}

/// How a film's numbers mean colours, in ffmpeg's words; empty where the film does not say.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ColourTags {
    /// The matrix, such as `bt709`.
    pub matrix: String,
    /// The primaries.
    pub primaries: String,
    /// The transfer function.
    pub transfer: String,
    /// `tv` or `pc`.
    pub range: String,
}

/// Facts about a film.
#[derive(Clone, Debug, PartialEq)]
pub struct Facts {
    /// Width and height as it is seen, px: after the rotation that phones write.
    pub size: [u32; 2],
    /// Its nominal frame rate.
    pub rate: FrameRate,
    /// True if its pictures stand at uneven times.
    pub is_uneven: bool,
    /// Bits of a channel: 8 to 16.
    pub bits: u8,
    /// True if its pixels are red, green and blue, or grey of full range, rather than luma and chroma.
    pub is_rgb: bool,
    /// Its colours.
    pub colours: ColourTags,
    /// Codec of its first sound, in ffmpeg's word.
    pub sound: Option<String>,
    /// Codec of each of its subtitles, in ffmpeg's words.
    pub subtitles: Vec<String>,
    /// Its length, s, where the file says it.
    pub seconds: Option<f64>,
    /// True if it says that its pictures are panoramas, longitude along x and latitude along y.
    pub is_panorama: bool,
    /// When its pictures begin after the file does, s: sound often begins a little earlier.
    pub begins_s: f64,
}

impl FrameRate {
    /// A whole number of pictures per second.
    pub const fn whole(per_second: u32) -> Self {
        Self {
            numerator: per_second,
            denominator: 1,
        }
    }

    /// Pictures per second.
    pub fn per_second(self) -> f64 {
        f64::from(self.numerator) / f64::from(self.denominator)
    }

    /// Reads `30000/1001`; `None` where it is no rate.
    fn of_text(text: &str) -> Option<Self> {
        let (numerator, denominator) = text.split_once('/').unwrap_or((text, "1"));
        let rate = Self {
            numerator: numerator.parse().ok()?,
            denominator: denominator.parse().ok()?,
        };
        (rate.numerator > 0 && rate.denominator > 0).then_some(rate)
    }
}

impl fmt::Display for FrameRate {
    /// As ffmpeg takes it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.numerator, self.denominator)
    }
}

/// Two rates of a film that differ by this part belong to pictures at uneven times: clocks of cameras are nearer.
const UNEVEN: f64 = 0.01;

/// Rates above this are clocks of containers, not of pictures.
const MAX_RATE: f64 = 1_000.0;

impl Facts {
    /// Asks `ffprobe` about the film at `path`.
    ///
    /// # Errors
    /// `ffprobe` is missing or fails, the file holds no pictures, or they are larger than those that are read.
    pub fn of(path: &Path) -> Result<Self, Error> {
        check_tool("ffprobe", path, "give its pictures as numbered files")?;
        let entries = "stream=width,height,pix_fmt,r_frame_rate,avg_frame_rate,color_range,color_space,\
                       color_transfer,color_primaries,start_time:stream_side_data=rotation,projection:format=start_time,duration";
        let video = asked(path, "v:0", entries)?;
        let beside = ["a:0", "s"].map(|streams| asked(path, streams, "stream=codec_name"));
        let [sound, subtitles] = beside;
        Self::of_answers(&video, &sound?, &subtitles?).map_err(|what| fault(path, what))
    }

    /// Reads the answers, a `key=value` a line.
    pub(super) fn of_answers(video: &str, sound: &str, subtitles: &str) -> Result<Self, String> {
        let value = |answer: &str, key: &str| {
            answer.lines().find_map(|line| {
                let (name, value) = line.split_once('=')?;
                (name == key && !["unknown", "N/A", ""].contains(&value)).then(|| value.to_owned())
            })
        };
        let of_video = |key: &str| value(video, key);
        let number = |key: &str| of_video(key)?.parse::<u32>().ok().filter(|&n| n > 0);
        let (Some(width), Some(height)) = (number("width"), number("height")) else {
            return Err("it holds no pictures that ffmpeg can read".into());
        };
        if u64::from(width) * u64::from(height) > MAX_PIXELS {
            return Err(format!(
                "{width}x{height} pixels, more than the {MAX_PIXELS} that are read"
            ));
        }
        let turned = of_video("rotation").and_then(|degrees| degrees.parse::<i32>().ok());
        let size = match turned.is_some_and(|degrees| degrees % 180 != 0) {
            true => [height, width],
            false => [width, height],
        };
        let rate = |key: &str| {
            let rate = FrameRate::of_text(&of_video(key)?)?;
            (rate.per_second() <= MAX_RATE).then_some(rate)
        };
        let (nominal, mean) = (rate("r_frame_rate"), rate("avg_frame_rate"));
        let is_uneven = match (nominal, mean) {
            (Some(nominal), Some(mean)) => {
                (nominal.per_second() / mean.per_second() - 1.0).abs() > UNEVEN
            }
            (nominal, _) => nominal.is_none(),
        };
        let format = of_video("pix_fmt").unwrap_or_default();
        let tag = |key: &str| of_video(key).unwrap_or_default();
        Ok(Self {
            size,
            rate: nominal.or(mean).unwrap_or(FrameRate::whole(25)),
            is_uneven,
            bits: bits_of(&format),
            is_rgb: ["rgb", "bgr", "gbr", "gray", "argb", "abgr", "pal8", "mono"]
                .iter()
                .any(|start| format.starts_with(start)),
            colours: ColourTags {
                matrix: tag("color_space"),
                primaries: tag("color_primaries"),
                transfer: tag("color_transfer"),
                range: tag("color_range"),
            },
            sound: value(sound, "codec_name"),
            subtitles: subtitles
                .lines()
                .filter_map(|line| line.strip_prefix("codec_name="))
                .map(str::to_owned)
                .collect(),
            seconds: of_video("duration")
                .and_then(|seconds| seconds.parse().ok())
                .filter(|&seconds: &f64| seconds > 0.0),
            is_panorama: of_video("projection").as_deref() == Some("equirectangular"),
            begins_s: begins_s(video),
        })
    }
}

/// When the stream of an answer begins after its file does, s; the file's line is the last.
fn begins_s(answer: &str) -> f64 {
    let starts = answer
        .lines()
        .filter_map(|line| line.strip_prefix("start_time="));
    let starts: Vec<f64> = starts.filter_map(|start| start.parse().ok()).collect();
    match starts[..] {
        [stream, file] if stream > file => stream - file,
        _ => 0.0,
    }
}

/// Bits of a channel of one of ffmpeg's pixel formats.
fn bits_of(format: &str) -> u8 {
    let name = format.trim_end_matches("le").trim_end_matches("be");
    let deep = [
        ("48", 16),
        ("64", 16),
        ("16", 16),
        ("14", 14),
        ("12", 12),
        ("10", 10),
        ("p9", 9),
        ("y9", 9),
    ];
    // nv12 has 12 bits a pixel and 8 a channel.
    if name.starts_with("nv") {
        return 8;
    }
    let found = deep.iter().find(|(end, _)| name.ends_with(end));
    found.map_or(8, |&(_, bits)| bits)
}

/// The answer of `ffprobe` to a question about a stream.
fn asked(path: &Path, stream: &str, entries: &str) -> Result<String, Error> {
    let mut ask = command("ffprobe");
    ask.args(["-select_streams", stream, "-show_entries", entries]);
    ask.args(["-of", "default=noprint_wrappers=1", "-i"]);
    ask.arg(absolute(path)?);
    ask.stdout(Stdio::piped());
    let no_start =
        |error: std::io::Error| fault(path, format!("ffprobe cannot be started: {error}"));
    let mut running = Running::start("ffprobe", ask).map_err(no_start)?;
    let mut answer = String::new();
    if let Some(output) = running.child.stdout.take() {
        // Some lines; anything longer is no answer.
        let read = output.take(1 << 16).read_to_string(&mut answer);
        read.map_err(|error| fault(path, error))?;
    }
    running.end().map_err(|what| fault(path, what))?;
    Ok(answer)
}

/// A name that no program takes for an option or a protocol.
pub(super) fn absolute(path: &Path) -> Result<std::path::PathBuf, Error> {
    std::path::absolute(path).map_err(|error| fault(path, error))
}
