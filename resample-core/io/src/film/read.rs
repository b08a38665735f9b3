//! The pictures of a film, one after another.

use std::io::{BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::process::{ChildStdout, Stdio};

use rayon::prelude::*;
use resample_core::Error;
use resample_core::image::linear_from_srgb;
use resample_core::narrow::code32;

use super::child::{Running, command};
use super::facts::{Facts, FrameRate, absolute};
use crate::files::fault;
use crate::{Picture, Plane, Stored};

/// The part of each picture that is kept, as films hold a picture and its depth in one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kept {
    /// All of it.
    #[default]
    Whole,
    /// The left half.
    Left,
    /// The right half.
    Right,
    /// The upper half.
    Top,
    /// The lower half.
    Bottom,
}

/// How a film is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Want {
    /// The part of each picture.
    pub kept: Kept,
    /// Pictures per second; a film of another rate repeats pictures or leaves some out.
    pub rate: FrameRate,
    /// Pictures are made smaller to at most this width, px.
    pub max_width: Option<u32>,
}

/// Reads a film from its beginning.
pub struct Reader {
    path: PathBuf,
    running: Running,
    pipe: BufReader<ChildStdout>,
    size: [usize; 2],
    numbers: Numbers,
    bytes: Vec<u8>,
    /// Linear light of every code.
    light: Vec<f32>,
}

/// The numbers that come through the pipe.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Numbers {
    channels: usize,
    /// Bytes of a number.
    width: usize,
    /// The largest code.
    largest: u32,
}

impl Kept {
    /// The part that a word behind a `#` means.
    pub fn of_word(word: &str) -> Option<Self> {
        Some(match word {
            "left" => Self::Left,
            "right" => Self::Right,
            "top" => Self::Top,
            "bottom" => Self::Bottom,
            _ => return None,
        })
    }

    /// The other half.
    pub fn other(self) -> Self {
        match self {
            Self::Whole => Self::Whole,
            Self::Left => Self::Right,
            Self::Right => Self::Left,
            Self::Top => Self::Bottom,
            Self::Bottom => Self::Top,
        }
    }

    /// Width and height of the part of a picture of this size, px.
    pub fn size(self, [width, height]: [u32; 2]) -> [u32; 2] {
        match self {
            Self::Whole => [width, height],
            Self::Left | Self::Right => [(width / 2).max(1), height],
            Self::Top | Self::Bottom => [width, (height / 2).max(1)],
        }
    }

    /// Its filter.
    fn crop(self, size: [u32; 2]) -> Option<String> {
        let [width, height] = self.size(size);
        let [x, y] = match self {
            Self::Whole => return None,
            Self::Left | Self::Top => [0, 0],
            Self::Right => [size[0] - width, 0],
            Self::Bottom => [0, size[1] - height],
        };
        Some(format!("crop={width}:{height}:{x}:{y}:exact=1"))
    }
}

impl Reader {
    /// Starts to read colours.
    ///
    /// # Errors
    /// `ffmpeg` cannot be started.
    pub fn colours(path: &Path, facts: &Facts, want: &Want) -> Result<Self, Error> {
        let deep = facts.bits > 8;
        let numbers = Numbers {
            channels: 3,
            width: if deep { 2 } else { 1 },
            largest: if deep { 0xffff } else { 0xff },
        };
        // Where a film does not say its matrix, its size does, as players hold it.
        let matrix = match facts.colours.matrix.as_str() {
            "" if facts.size[1] >= 720 => "bt709",
            "" => "bt601",
            _ => "auto",
        };
        let convert = match facts.is_rgb {
            true => String::new(),
            false => format!("in_color_matrix={matrix}:"),
        };
        let format = if deep { "rgb48le" } else { "rgb24" };
        Self::open(path, facts, want, (numbers, &convert, format))
    }

    /// Starts to read grey numbers: the luma codes as they are stored, or the grey of pictures in red, green and blue.
    ///
    /// # Errors
    /// `ffmpeg` cannot be started.
    pub fn numbers(path: &Path, facts: &Facts, want: &Want) -> Result<Self, Error> {
        let deep = facts.bits > 8;
        let stretched = facts.is_rgb && deep;
        let numbers = Numbers {
            channels: 1,
            width: if deep { 2 } else { 1 },
            largest: if stretched {
                0xffff
            } else {
                (1 << facts.bits.min(16)) - 1
            },
        };
        let format = match (deep, stretched) {
            (false, _) => "gray".to_owned(),
            (true, true) => "gray16le".to_owned(),
            (true, false) => format!("gray{}le", facts.bits),
        };
        // The range of luma is not stretched: its codes are the depth's.
        let keep = if facts.is_rgb {
            ""
        } else {
            "in_range=pc:out_range=pc:"
        };
        Self::open(path, facts, want, (numbers, keep, &format))
    }

    fn open(
        path: &Path,
        facts: &Facts,
        want: &Want,
        (numbers, convert, format): (Numbers, &str, &str),
    ) -> Result<Self, Error> {
        let own = want.kept.size(facts.size);
        let size = match want.max_width {
            Some(most) if own[0] > most => {
                let height = f64::from(own[1]) * f64::from(most) / f64::from(own[0]);
                [most, code32(height.round()).max(1)]
            }
            _ => own,
        };
        let [width, height] = size;
        let crop = want.kept.crop(facts.size);
        let scale =
            format!("scale={width}:{height}:{convert}flags=area+accurate_rnd+full_chroma_int");
        // Time is counted from the first picture, so that films that begin at other times go together.
        let filters = crop
            .into_iter()
            .chain([scale, "setpts=PTS-STARTPTS".into()]);
        let filters: Vec<String> = filters.collect();
        let mut read = command("ffmpeg");
        read.args(["-nostdin", "-i"]).arg(absolute(path)?);
        read.args(["-map", "0:v:0", "-vf", &filters.join(",")]);
        read.args(["-fps_mode", "cfr", "-r", &want.rate.to_string()]);
        read.args(["-f", "rawvideo", "-pix_fmt", format, "pipe:1"]);
        read.stdout(Stdio::piped());
        let no_start =
            |error: std::io::Error| fault(path, format!("ffmpeg cannot be started: {error}"));
        let mut running = Running::start("ffmpeg", read).map_err(no_start)?;
        let Some(pipe) = running.child.stdout.take() else {
            return Err(fault(path, "ffmpeg gives nothing"));
        };
        let size = [width as usize, height as usize];
        let light = (0..=numbers.largest)
            .map(|code| linear_from_srgb(code as f32 / numbers.largest as f32));
        Ok(Self {
            path: path.to_owned(),
            running,
            pipe: BufReader::new(pipe),
            size,
            bytes: vec![0; size[0] * size[1] * numbers.channels * numbers.width],
            light: match numbers.channels {
                3 => light.collect(),
                _ => Vec::new(),
            },
            numbers,
        })
    }

    /// Width and height of its pictures, px.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The next picture, in linear light; `None` after the last one. For a reader of colours.
    ///
    /// # Errors
    /// `ffmpeg` fails; the error holds its complaint.
    pub fn picture(&mut self) -> Result<Option<Picture>, Error> {
        if !self.fill()? {
            return Ok(None);
        }
        let light = &self.light;
        let rgb = match self.numbers.width {
            1 => pixels(&self.bytes, 3, |bytes| {
                [0, 1, 2].map(|c| light[usize::from(bytes[c])])
            }),
            _ => pixels(&self.bytes, 6, |bytes| {
                [0, 2, 4].map(|c| light[usize::from(u16::from_le_bytes([bytes[c], bytes[c + 1]]))])
            }),
        };
        Ok(Some(Picture {
            width: self.size[0],
            height: self.size[1],
            rgb,
            coverage: None,
        }))
    }

    /// The numbers of the next picture; `None` after the last one. For a reader of numbers.
    ///
    /// # Errors
    /// `ffmpeg` fails; the error holds its complaint.
    pub fn plane(&mut self) -> Result<Option<Plane>, Error> {
        if !self.fill()? {
            return Ok(None);
        }
        let values = match self.numbers.width {
            1 => self.bytes.iter().map(|&byte| f32::from(byte)).collect(),
            _ => pixels(&self.bytes, 2, |bytes| {
                f32::from(u16::from_le_bytes([bytes[0], bytes[1]]))
            }),
        };
        Ok(Some(Plane {
            width: self.size[0],
            height: self.size[1],
            values,
            stored: Stored::Code(self.numbers.largest),
        }))
    }

    /// Reads the bytes of the next picture; false after the last one.
    fn fill(&mut self) -> Result<bool, Error> {
        let mut filled = 0;
        while filled < self.bytes.len() {
            match self.pipe.read(&mut self.bytes[filled..]) {
                Ok(0) => break,
                Ok(count) => filled += count,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(fault(&self.path, error)),
            }
        }
        if filled == self.bytes.len() {
            return Ok(true);
        }
        // The end of the film, or of ffmpeg.
        self.running.end().map_err(|what| fault(&self.path, what))?;
        match filled {
            0 => Ok(false),
            _ => Err(fault(&self.path, "it ends within a picture")),
        }
    }
}

/// A value for each pixel of `size` bytes.
fn pixels<T: Send>(bytes: &[u8], size: usize, value: impl Fn(&[u8]) -> T + Sync + Send) -> Vec<T> {
    bytes
        .par_chunks_exact(size)
        .with_min_len(1 << 12)
        .map(value)
        .collect()
}
