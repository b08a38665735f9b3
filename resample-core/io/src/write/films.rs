//! Animations: all pictures of a run in one file, an animated PNG, WebP or GIF, or a video.
//!
//! Takes pictures of one size, one after another, and gives a file that appears whole or not at all. An animated
//! PNG or WebP keeps transparency and every bit; a GIF has 256 colours a picture and is opaque; a video is made by the program `ffmpeg`, and is opaque. The kind
//! follows from the extension. Limits: a video needs `ffmpeg` on the PATH and an even width and height.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use png::Writer;
use resample_core::narrow::code16;
use resample_core::{Camera, Error, Image};
use tempfile::NamedTempFile;

use super::failure::WriteFailure;
use super::gif::Gif;
use super::pieces::{Left, PIECE_PICTURES, Pieces, folder};
use super::png::Depth;
use super::temporary::{Listed, folder_of, is_stdout, temporary_file};
use super::webp::WebP;
use super::{gif, png as picture_png, webp};
use crate::film::{Coding, Container, FrameRate, Original, Spatial, Writer as Video, check_tool};

/// Kind of an animation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilmKind {
    /// Animated PNG.
    Png(Depth),
    /// WebP without loss; of one picture, a plain one.
    WebP,
    /// GIF of 256 colours a picture, opaque.
    Gif,
    /// Video, made by `ffmpeg`.
    Video(Container),
}

impl FilmKind {
    /// Returns true if its pictures have no transparency.
    pub fn is_opaque(self) -> bool {
        matches!(self, Self::Gif | Self::Video(_))
    }
}

/// An animation to make.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmPlan {
    /// Its file.
    pub path: PathBuf,
    /// Its kind.
    pub kind: FilmKind,
    /// Pictures per second.
    pub rate: FrameRate,
    /// The film that it is made from.
    pub original: Option<Original>,
    /// The marks by which players know its views.
    pub spatial: Spatial,
}

/// An animation in the making. Dropped before [`Film::finish`], it leaves nothing.
pub struct Film {
    // The order matters: what writes to the file ends before the file is removed.
    sink: Sink,
    file: NamedTempFile,
    _listed: Listed,
    plan: FilmPlan,
}

enum Sink {
    Png(Box<Writer<File>>, Depth),
    WebP(WebP),
    Gif(Box<Gif<File>>),
    Video(Video, Depth),
    Pieces(Box<Pieces>, Depth),
}

/// Default of pictures per second, as films in Europe have it.
pub const DEFAULT_FPS: u16 = 25;

/// The kind of animation that the extension of `path` asks for; `None` if it is no animation.
///
/// A film made from a film goes to the standard output as Matroska, which can be piped.
pub fn kind_of(path: &Path, bits: Option<u8>, of_film: bool) -> Result<Option<FilmKind>, Error> {
    if of_film && is_stdout(path) {
        return Ok(Some(FilmKind::Video(Container::Matroska)));
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let container = match extension.as_deref() {
        Some("apng") => {
            let depth = if bits == Some(16) {
                Depth::Sixteen
            } else {
                Depth::Eight
            };
            return Ok(Some(FilmKind::Png(depth)));
        }
        Some(name @ ("webp" | "gif")) if bits.is_some() => {
            let name = if name == "gif" { "GIF" } else { "WebP" };
            return refused(format!(
                "{}: a {name} always has 8 bits per channel: leave --bits out",
                path.display()
            ));
        }
        Some("webp") => return Ok(Some(FilmKind::WebP)),
        Some("gif") => return Ok(Some(FilmKind::Gif)),
        Some("mp4") => Container::Mp4,
        Some("webm") => Container::WebM,
        Some("mkv") => Container::Matroska,
        _ => return Ok(None),
    };
    if bits.is_some() {
        return refused(format!(
            "{}: a video always has 8 bits per channel: leave --bits out",
            path.display()
        ));
    }
    Ok(Some(FilmKind::Video(container)))
}

/// Numerator and denominator of a rate in 16 bits, as animated PNGs have it: exact, or rounded to thousandths.
fn short(rate: FrameRate) -> [u16; 2] {
    let exact = [rate.numerator, rate.denominator].map(u16::try_from);
    match exact {
        [Ok(numerator), Ok(denominator)] => [numerator, denominator],
        _ => [code16(1_000.0 * rate.per_second()), 1_000],
    }
}

impl FilmPlan {
    /// Checks for other programs: a video needs `ffmpeg`.
    pub fn check_tools(&self) -> Result<(), Error> {
        match self.kind {
            FilmKind::Png(_) | FilmKind::WebP | FilmKind::Gif => Ok(()),
            FilmKind::Video(_) => check_tool(
                "ffmpeg",
                &self.path,
                "write an animated PNG (.apng) or numbered pictures (.png)",
            ),
        }
    }

    /// A remark on the subtitles of the original that the film cannot hold, if there are any.
    pub fn note(&self) -> Option<String> {
        let FilmKind::Video(container) = self.kind else {
            return None;
        };
        let lost = self.original.as_ref()?.lost_subtitles(container).join(", ");
        let hint = match container {
            Container::Matroska => "",
            Container::Mp4 | Container::WebM => "; .mkv holds most kinds",
        };
        let path = self.path.display();
        (!lost.is_empty()).then(|| {
            format!(
                "{path}: its format cannot hold subtitles of kind {lost}, which are left out{hint}"
            )
        })
    }

    /// Checks that all pictures have one size that the animation can have.
    pub fn check_sizes(&self, cameras: &[Camera]) -> Result<(), Error> {
        let size = |camera: &Camera| (camera.width, camera.height);
        let Some(first) = cameras.first().map(size) else {
            return Ok(());
        };
        let (path, (width, height)) = (self.path.display(), first);
        if let Some((index, other)) = cameras
            .iter()
            .map(size)
            .enumerate()
            .find(|(_, other)| *other != first)
        {
            return refused(format!(
                "{path}: the pictures of an animation must have one size, but picture 0 has {width}x{height} and \
                 picture {index} has {}x{}: give --size",
                other.0, other.1
            ));
        }
        if self.kind == FilmKind::WebP && width.max(height) > webp::MAX_SIDE {
            return refused(format!(
                "{path}: a WebP has at most {} pixels a side, not {width}x{height}",
                webp::MAX_SIDE
            ));
        }
        if self.kind == FilmKind::Gif && width.max(height) > gif::MAX_SIDE {
            return refused(format!(
                "{path}: a GIF has at most {} pixels a side, not {width}x{height}",
                gif::MAX_SIDE
            ));
        }
        if matches!(self.kind, FilmKind::Video(_)) && (width % 2 != 0 || height % 2 != 0) {
            let (even_width, even_height) = (width.next_multiple_of(2), height.next_multiple_of(2));
            return refused(format!(
                "{path}: a video needs an even width and height, not {width}x{height}: give --size \
                 {even_width}x{even_height}"
            ));
        }
        Ok(())
    }
}

impl Film {
    /// Starts an animation of `count` pictures of `size` pixels, width and height.
    pub fn begin(plan: &FilmPlan, size: [u32; 2], count: u32) -> Result<Self, WriteFailure> {
        Self::start(plan, size, count, None)
    }

    /// Starts an animation, or goes on with a long video of which an earlier run left complete pieces in a folder beside it.
    pub fn resume(
        plan: &FilmPlan,
        size: [u32; 2],
        count: u32,
        left: Left,
    ) -> Result<Self, WriteFailure> {
        Self::start(plan, size, count, Some(left))
    }

    fn start(
        plan: &FilmPlan,
        size: [u32; 2],
        count: u32,
        left: Option<Left>,
    ) -> Result<Self, WriteFailure> {
        let begun = || -> io::Result<Self> {
            let (file, listed) = temporary_file(folder_of(&plan.path))?;
            let sink = match plan.kind {
                FilmKind::Png(depth) => {
                    let mut encoder =
                        picture_png::encoder(file.as_file().try_clone()?, size, depth);
                    encoder.set_animated(count, 0)?;
                    let [numerator, denominator] = short(plan.rate);
                    encoder.set_frame_delay(denominator, numerator)?;
                    Sink::Png(Box::new(encoder.write_header()?), depth)
                }
                FilmKind::WebP => Sink::WebP(WebP::begin(
                    file.as_file().try_clone()?,
                    size,
                    short(plan.rate)[0] / short(plan.rate)[1],
                    count,
                )?),
                FilmKind::Gif => {
                    let gif = Gif::begin(file.as_file().try_clone()?, size, plan.rate)
                        .map_err(io::Error::other)?;
                    Sink::Gif(Box::new(gif))
                }
                FilmKind::Video(container) => {
                    let original = plan.original.as_ref();
                    let coding = Coding::new(container, size, plan.rate, original, plan.spatial);
                    let deep = coding.bits > 8;
                    let depth = if deep { Depth::Sixteen } else { Depth::Eight };
                    let is_in_pieces =
                        count as usize > PIECE_PICTURES || coding.takes_marks_from_mp4();
                    match left {
                        Some(left) if is_in_pieces && !is_stdout(&plan.path) => {
                            Sink::Pieces(Box::new(Pieces::begin(&plan.path, coding, left)?), depth)
                        }
                        _ => Sink::Video(Video::open(file.path(), &coding, original)?, depth),
                    }
                }
            };
            Ok(Self {
                sink,
                file,
                _listed: listed,
                plan: plan.clone(),
            })
        };
        begun().map_err(WriteFailure::of(&plan.path))
    }

    /// The pictures that stay if it is dropped now, and their folder: those of complete pieces.
    pub fn left(&self) -> Option<(usize, PathBuf)> {
        match &self.sink {
            Sink::Pieces(pieces, _) => Some((pieces.complete(), folder(&self.plan.path))),
            _ => None,
        }
    }

    /// Adds a picture.
    pub fn add(&mut self, image: &Image) -> Result<(), WriteFailure> {
        let added = match &mut self.sink {
            Sink::Png(writer, depth) => writer
                .write_image_data(&picture_png::bytes(image, *depth))
                .map_err(io::Error::from),
            Sink::WebP(webp) => webp.add(&picture_png::bytes(image, Depth::Eight)),
            Sink::Gif(gif) => gif
                .add(&picture_png::opaque_bytes(image, Depth::Eight))
                .map_err(io::Error::other),
            Sink::Video(video, depth) => {
                let bytes = picture_png::opaque_bytes(image, *depth);
                video.add(&bytes)
            }
            Sink::Pieces(pieces, depth) => pieces.add(&picture_png::opaque_bytes(image, *depth)),
        };
        added.map_err(WriteFailure::of(&self.plan.path))
    }

    /// Ends the animation, gives it its name, and gives the size of the file in bytes.
    pub fn finish(self) -> Result<u64, WriteFailure> {
        let Self {
            sink,
            file,
            _listed,
            plan,
        } = self;
        let path = plan.path;
        let finished = || -> io::Result<u64> {
            match sink {
                Sink::Png(writer, _) => writer.finish()?,
                Sink::WebP(webp) => webp.finish()?,
                // Its last byte is written when the encoder ends.
                Sink::Gif(gif) => drop(gif),
                Sink::Video(video, _) => video.finish()?,
                Sink::Pieces(pieces, _) => pieces.finish(file.path(), plan.original.as_ref())?,
            }
            if plan.kind == FilmKind::Video(Container::Mp4) {
                plan.spatial.mark(file.path())?;
            }
            let bytes = std::fs::metadata(file.path())?.len();
            if is_stdout(&path) {
                io::copy(&mut File::open(file.path())?, &mut io::stdout())?;
            } else {
                file.persist(&path)?;
            }
            Ok(bytes)
        };
        finished().map_err(WriteFailure::of(&path))
    }
}

fn refused<T>(text: String) -> Result<T, Error> {
    Err(Error::Input(text))
}
