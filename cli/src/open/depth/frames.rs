//! Pictures with depth one after another: numbered files or lists, each with its own camera.
//!
//! Takes the words of the command line, gives the words of each single frame. Numbered names have a pattern such as
//! `%05d`; a list is a text file with a name a line, or a time in seconds and a name as in the lists of the TUM
//! benchmark, and names count from the list's folder. Limits: one picture a frame; every frame is read when it is drawn.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use resample_io::listed::{Item, items};
use resample_io::{Gate, Outside, Room};
use warp3d::Fill;
use warp3d::input::film::{FilmInput, read_cuts};
use warp3d::input::{DepthKind, Part, colour, range_of_sequence};

use crate::args::Warp3dArgs;
use crate::cameras::viewpoint;
use crate::cameras::viewpoint::{Known, Viewpoint};
use crate::open::depth::film;
use crate::open::depth::scene;
use crate::output::FrameNames;
use crate::process::report;
use crate::process::report::{Progress, watch};

/// Largest difference of the times of a picture and its depth, s: that of the TUM benchmark's own tool.
const TIME_TOLERANCE_S: f64 = 0.02;

/// The frames of a sequence.
#[derive(Clone, Debug)]
pub(crate) struct Frames {
    frames: Vec<Frame>,
    /// The range of their depths where these have no unit: one for all.
    range: Option<[f64; 2]>,
    /// The film that they are read from.
    film: Option<FilmInput>,
    /// The pictures that begin a shot, where somebody says so.
    cuts: Option<Vec<usize>>,
}

/// One picture and its depth.
#[derive(Clone, Debug, PartialEq)]
struct Frame {
    /// The number in its name, or its place in the list.
    number: usize,
    /// When it was taken, as it is written.
    time: Option<String>,
    colour: String,
    depth: String,
    from: Option<Viewpoint>,
    to: Option<Viewpoint>,
}

impl Frames {
    /// The frames that the words name; `None` where they name one picture.
    pub(crate) fn find(args: &mut Warp3dArgs, progress: Progress) -> Result<Option<Self>> {
        if let Some(film) = film::find(args, progress)? {
            film::set_defaults(args, Some(&film))?;
            return Self::of_film(args, film).map(Some);
        }
        let (colours, depths) = match (items(&args.colour)?, items(&args.depth)?) {
            (None, None) => return Ok(None),
            (Some(colours), Some(depths)) => (colours, depths),
            (Some(_), None) => bail!(
                "{}: one depth for several pictures: give a pattern such as %04d or a list",
                args.depth
            ),
            (None, Some(_)) => bail!(
                "{}: one picture for several depths: give a pattern such as %04d or a list",
                args.colour
            ),
        };
        let pictures = colours.len();
        let frames: Vec<Frame> = colours
            .into_iter()
            .filter_map(|colour| {
                let depth = partner(&colour, &depths)?.file.clone();
                Some(Frame {
                    number: colour.number,
                    time: colour.time,
                    colour: colour.file,
                    depth,
                    from: args.cameras.from.clone(),
                    to: args.cameras.to.clone(),
                })
            })
            .collect();
        let cuts = args.sequence.cuts.as_deref();
        let frames = Self {
            frames,
            range: None,
            film: None,
            cuts: cuts.map(read_cuts).transpose()?,
        };
        frames.note_missing(pictures, "depth of their number or time", &args.depth)?;
        let size = colour::size(&Part::from_text(&frames.frames[0].colour))?;
        let count = frames.len();
        let frames = frames.with_cameras(args, size)?;
        frames.note_missing(count, "camera of their time", "")?;
        Ok(Some(frames))
    }

    /// The pictures of a film.
    fn of_film(args: &Warp3dArgs, film: FilmInput) -> Result<Self> {
        let frame = |number| Frame {
            number,
            time: None,
            colour: args.colour.clone(),
            depth: args.depth.clone(),
            from: args.cameras.from.clone(),
            to: args.cameras.to.clone(),
        };
        let frames = (0..film.pictures()).map(frame).collect();
        let size = film.size()?;
        let cuts = film.shots().iter().map(|shot| shot.first).collect();
        let frames = Self {
            frames,
            range: None,
            film: Some(film),
            cuts: Some(cuts),
        };
        frames.with_cameras(args, size)
    }

    /// The film that they are read from.
    pub(crate) fn film(&self) -> Option<&FilmInput> {
        self.film.as_ref()
    }

    /// True if frame `index` begins a shot, false if not; `None` where nobody has said it.
    pub(crate) fn begins_shot(&self, index: usize) -> Option<bool> {
        let cuts = self.cuts.as_ref()?;
        Some(index == 0 || cuts.contains(&index))
    }

    /// The first frame of the shot that frame `index` belongs to, as far as somebody has said it.
    pub(crate) fn first_of_shot(&self, index: usize) -> usize {
        let cuts = self.cuts.iter().flatten().copied();
        cuts.filter(|&cut| cut <= index).max().unwrap_or(0)
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.frames.len()
    }

    /// The words of frame `index`, as if it were alone.
    pub(crate) fn words(&self, args: &Warp3dArgs, index: usize) -> Result<Warp3dArgs> {
        let frame = self.frames[index].clone();
        let mut words = args.clone();
        (words.colour, words.depth) = (frame.colour, frame.depth);
        (words.cameras.from, words.cameras.to) = (frame.from, frame.to);
        words.cameras.reference = self.neighbours(index, args.sequence.neighbours);
        let shot = self.film.as_ref().map_or(&[][..], FilmInput::shots);
        let shot = shot.iter().rev().find(|shot| shot.first <= index);
        let range = self.range.or(shot.and_then(|shot| shot.range));
        words.meaning.relative_range = words.meaning.relative_range.or(range);
        if let Some(film) = &self.film {
            words.source = film::blank(film)?;
        }
        Ok(words)
    }

    /// The words of the frames up to `reach` before and after frame `index` and of its shot, as further references, the nearest
    /// ones first.
    fn neighbours(&self, index: usize, reach: usize) -> Vec<String> {
        let beside = (1..=reach).flat_map(|by| [index.checked_sub(by), index.checked_add(by)]);
        let shot = |index| self.first_of_shot(index);
        let frames = beside.flatten().filter(|&other| shot(other) == shot(index));
        let words = frames.filter_map(|other| {
            let frame = self.frames.get(other)?;
            let camera = frame.from.as_ref()?.to_string();
            Some([frame.colour.clone(), frame.depth.clone(), camera])
        });
        words.flatten().collect()
    }

    /// Refuses neighbours of pictures that have no place of their own, or depth without a unit.
    pub(crate) fn check_neighbours(&self, args: &Warp3dArgs) -> Result<()> {
        let own = |frame: &Frame| frame.from != self.frames[0].from;
        let why = if args.sequence.neighbours == 0 {
            return Ok(());
        } else if self.film.is_some() {
            "pictures of a film have no cameras: leave it out"
        } else if !self.frames.iter().skip(1).all(own) {
            "every picture needs a camera of its own: give --from a file of cameras"
        } else if args.meaning.kind() == DepthKind::Relative {
            "relative depth has another unit in every picture: leave it out"
        } else if args.render.options.fill == Fill::Film || args.sequence.steady > Some(0) {
            "it takes the place of --steady and --fill film: leave them out"
        } else {
            return Ok(());
        };
        bail!("--neighbours: {why}")
    }

    /// Looks through the depths of the whole sequence where one range has to be found for all of them.
    pub(crate) fn find_range(&mut self, args: &Warp3dArgs, progress: Progress) -> Result<()> {
        if self.film.as_ref().is_some_and(FilmInput::has_ranges) {
            return Ok(());
        }
        let depths: Vec<Part> = match &self.film {
            Some(film) => film.depth_files(),
            None => (self.frames.iter())
                .map(|frame| Part::from_text(&frame.depth))
                .collect(),
        };
        let meaning = scene::meaning(&args.meaning, None);
        let room = Room(Gate::new(Outside::Refused, args.max_memory).max_memory());
        let mut watch = watch("looking through the depths", progress);
        self.range = range_of_sequence(&depths, &meaning, room, &mut watch)?;
        Ok(())
    }

    /// The files that the frames are read from.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        let path = |text: &String| Part::from_text(text).path;
        let cameras = |frame: &'_ Frame| {
            let words = [frame.from.clone(), frame.to.clone()].into_iter().flatten();
            words.filter_map(|word| word.path().map(Path::to_owned))
        };
        let pictures: Vec<PathBuf> = match &self.film {
            Some(film) => film.files().iter().map(path).collect(),
            None => (self.frames.iter())
                .flat_map(|frame| [path(&frame.colour), path(&frame.depth)])
                .collect(),
        };
        let cameras = self.frames.iter().flat_map(cameras);
        pictures.into_iter().chain(cameras).collect()
    }

    /// Says how many of `count` pictures are left out, and refuses where all are.
    fn note_missing(&self, count: usize, missing: &str, place: &str) -> Result<()> {
        match count - self.len() {
            0 => Ok(()),
            all if all == count => bail!("{place}: none of {count} pictures has a {missing}"),
            some => {
                report::say(&format!(
                    "note: {some} of {count} pictures are left out: there is no {missing}"
                ));
                Ok(())
            }
        }
    }

    /// The frames with the cameras that the words mean for each: of a file of several cameras the one with the frame's
    /// time, file name or place; of a pattern the file with its number. Frames without a camera of their time go.
    fn with_cameras(mut self, args: &Warp3dArgs, size: [u32; 2]) -> Result<Self> {
        for side in [Side::From, Side::To] {
            let word = match side {
                Side::From => &args.cameras.from,
                Side::To => &args.cameras.to,
            };
            let Some(Viewpoint::File { path, entry: None }) = word else {
                continue;
            };
            let count = self.len();
            let file = CameraSource::read(path, args, size)?;
            let mut kept = Vec::with_capacity(count);
            for (index, mut frame) in self.frames.into_iter().enumerate() {
                let Some(viewpoint) = file.camera_of(&frame, index, count)? else {
                    continue;
                };
                match side {
                    Side::From => frame.from = Some(viewpoint),
                    Side::To => frame.to = Some(viewpoint),
                }
                kept.push(frame);
            }
            self.frames = kept;
        }
        Ok(self)
    }
}

/// The camera of a frame.
#[derive(Clone, Copy)]
enum Side {
    From,
    To,
}

/// A file name that stands for the cameras of all frames.
struct CameraSource<'a> {
    path: &'a Path,
    kind: SourceKind,
}

enum SourceKind {
    /// A file for each frame.
    Pattern(FrameNames),
    /// One file, whose cameras have names.
    Names(viewpoint::Names),
}

impl<'a> CameraSource<'a> {
    fn read(path: &'a Path, args: &Warp3dArgs, size: [u32; 2]) -> Result<Self> {
        let pattern = if path.exists() {
            None
        } else {
            FrameNames::from_pattern(path)?
        };
        let kind = match pattern {
            Some(pattern) => SourceKind::Pattern(pattern),
            None => {
                let known = Known {
                    picture: size,
                    size: None,
                    lens: scene::lens(args, size)?,
                };
                SourceKind::Names(viewpoint::Names::of_file(path, &known)?)
            }
        };
        Ok(Self { path, kind })
    }

    /// The camera of the frame at `index` of `count`; `None` where no camera's time is near the frame's.
    fn camera_of(&self, frame: &Frame, index: usize, count: usize) -> Result<Option<Viewpoint>> {
        let names = match &self.kind {
            SourceKind::Pattern(pattern) => {
                let path = pattern.frame(frame.number);
                return Ok(Some(Viewpoint::File { path, entry: None }));
            }
            SourceKind::Names(names) => names,
        };
        let file = Path::new(&frame.colour).file_name();
        let file = file.and_then(|name| name.to_str()).unwrap_or_default();
        let entry = match &frame.time {
            _ if names.count() == 1 => None,
            Some(time) if names.are_times() => match names.find(time) {
                None => return Ok(None),
                found => found,
            },
            _ => {
                let place = if names.count() == count {
                    index
                } else {
                    frame.number
                };
                let found = names.find(file).or_else(|| names.at(place));
                Some(found.with_context(|| {
                    format!(
                        "{}: it has no camera of {}: it holds {} cameras, and there are {count} pictures",
                        self.path.display(),
                        frame.colour,
                        names.count()
                    )
                })?)
            }
        };
        Ok(Some(Viewpoint::File {
            path: self.path.to_owned(),
            entry,
        }))
    }
}

/// The depth that belongs to a picture: of the nearest time, else of the same number.
fn partner<'a>(colour: &Item, depths: &'a [Item]) -> Option<&'a Item> {
    let seconds = |item: &Item| item.time.as_deref()?.parse::<f64>().ok();
    match seconds(colour) {
        Some(time) if depths.iter().all(|depth| depth.time.is_some()) => {
            let apart = |depth: &Item| seconds(depth).map_or(f64::INFINITY, |t| (t - time).abs());
            depths
                .iter()
                .min_by(|a, b| apart(a).total_cmp(&apart(b)))
                .filter(|depth| apart(depth) <= TIME_TOLERANCE_S)
        }
        _ => depths.iter().find(|depth| depth.number == colour.number),
    }
}

#[cfg(test)]
mod tests;
