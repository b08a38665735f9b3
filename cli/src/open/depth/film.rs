//! Films that are warped: pictures and depths as films, as numbered files beside a film, or as the two halves of one film.
//!
//! A film is looked through once, small, for its length, its shots and their ranges of depth; then its pictures are read in order.
//! Limits: a film from the standard input is kept in a temporary file until the run ends, since it is read twice.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use resample_io::Stored;
use resample_io::files;
use resample_io::film::{Facts, FrameRate, Kept, Original, Reader, Want, is_film};
use resample_io::listed::files_of;
use tempfile::NamedTempFile;
use warp3d::args::MethodName;
use warp3d::film::{Shot, Survey};
use warp3d::input::{DepthKind, Part, Picture, Plane, RANGE_SHARE, colour, depth};
use warp3d::{Fill, WarpArgs};

use crate::args::Warp3dArgs;
use crate::cameras::viewpoint;
use crate::cameras::viewpoint::Viewpoint;
use crate::output::temporary_file;
use crate::process::report;
use crate::process::report::{Progress, watch};
use crate::values::input_file::{HeldPicture, HeldPictures, Source};
use resample_io::write::Listed;

/// Width of the pictures that are looked through, px: enough for the colours of a shot and the ranks of its depths.
const SURVEY_WIDTH: u32 = 160;

/// The lens of a film that says nothing of it, degrees from top to bottom: 38 mm before a picture of 36 mm by 24 mm, between the usual ones of cinema.
const FOV: &str = "fov:35";

/// Default surface tolerance of relative depth in a film. The noise of a network and of a film's coding makes smaller jumps within one surface. On films with truth,
/// 0.02 to 0.05 have the error of the automatic tolerance, or up to 0.7 dB less, in half of its time.
const TOLERANCE: f32 = 0.03;

/// A film and its depth.
#[derive(Clone, Debug)]
pub(crate) struct FilmInput {
    colour: Stream,
    depth: Stream,
    rate: FrameRate,
    shots: Vec<Shot>,
    pictures: usize,
    /// The file that holds the standard input.
    _kept: Option<Arc<(NamedTempFile, Listed)>>,
}

/// Pictures one after another.
#[derive(Clone, Debug)]
enum Stream {
    Film {
        path: PathBuf,
        facts: Facts,
        kept: Kept,
    },
    Files(Vec<String>),
}

/// The place in both streams.
pub(crate) struct Streams {
    colour: Place,
    depth: Place,
}

enum Place {
    Film(Reader),
    File(usize),
}

impl FilmInput {
    /// The film that the words name; `None` where they name none. Looks it through.
    pub(crate) fn find(args: &Warp3dArgs, progress: Progress) -> Result<Option<Self>> {
        let kept = match args.colour.as_str() {
            "-" => Some(Arc::new(spooled()?)),
            _ => None,
        };
        let colour = match &kept {
            Some(kept) => kept.0.path().display().to_string(),
            None => args.colour.clone(),
        };
        let is_depth_of_it =
            args.depth == args.colour || args.depth.starts_with(&format!("{}#", args.colour));
        let depth = match &kept {
            Some(_) if is_depth_of_it => args.depth.replacen(&args.colour, &colour, 1),
            _ => args.depth.clone(),
        };
        let (colour, depth) = (Stream::of(&colour)?, Stream::of(&depth)?);
        let (mut colour, depth) = match (colour, depth) {
            (None, None) => return Ok(None),
            (Some(colour), None) => (
                colour,
                Stream::files(&args.depth, "a film needs a depth for each picture")?,
            ),
            (None, Some(depth)) => (
                Stream::files(&args.colour, "a film of depths needs a picture for each")?,
                depth,
            ),
            (Some(colour), Some(depth)) => (colour, depth),
        };
        colour.leave_to(&depth, &args.depth)?;
        let rate = match (args.sequence.fps, &colour, &depth) {
            (Some(fps), ..) => FrameRate::whole(u32::from(fps)),
            (None, Stream::Film { facts, .. }, _) | (None, _, Stream::Film { facts, .. }) => {
                facts.rate
            }
            (None, Stream::Files(_), Stream::Files(_)) => return Ok(None),
        };
        colour.notes(rate);
        let mut film = Self {
            colour,
            depth,
            rate,
            shots: Vec::new(),
            pictures: 0,
            _kept: kept,
        };
        let cuts = args.sequence.cuts.as_deref().map(read_cuts).transpose()?;
        film.look_through(cuts.as_deref(), progress)?;
        Ok(Some(film))
    }

    /// How many pictures it has.
    pub(crate) fn pictures(&self) -> usize {
        self.pictures
    }

    /// Its shots, in order.
    pub(crate) fn shots(&self) -> &[Shot] {
        &self.shots
    }

    /// Returns true if the codes of the depth have a range of their own for each shot.
    pub(crate) fn has_ranges(&self) -> bool {
        matches!(self.depth, Stream::Film { .. })
    }

    /// The files that it is read from.
    pub(crate) fn files(&self) -> Vec<String> {
        let of = |stream: &Stream| match stream {
            Stream::Film { path, .. } => vec![path.display().to_string()],
            Stream::Files(files) => files.clone(),
        };
        [of(&self.colour), of(&self.depth)].concat()
    }

    /// The files of its depths, where they are no film.
    pub(crate) fn depth_files(&self) -> Vec<Part> {
        match &self.depth {
            Stream::Film { .. } => Vec::new(),
            Stream::Files(files) => files.iter().map(|file| Part::from_text(file)).collect(),
        }
    }

    /// Width and height of its pictures, px.
    pub(crate) fn size(&self) -> Result<[u32; 2]> {
        self.colour.size()
    }

    /// The film whose sound and colours go along.
    pub(crate) fn original(&self) -> Option<Original> {
        match &self.colour {
            Stream::Film { path, facts, .. } => Some(Original {
                path: path.clone(),
                facts: Facts {
                    rate: self.rate,
                    ..facts.clone()
                },
            }),
            Stream::Files(_) => None,
        }
    }

    /// A picture of its size without pixels, for what needs no more.
    pub(crate) fn blank(&self) -> Result<Source<HeldPictures>> {
        let [width, height] = self.colour.size()?.map(|side| side as usize);
        let colour = Picture {
            width,
            height,
            rgb: Vec::new(),
            coverage: None,
        };
        let depth = Plane {
            width,
            height,
            values: Vec::new(),
            stored: Stored::Float,
        };
        Ok(held(HeldPicture { colour, depth }))
    }

    /// Starts to read from the beginning.
    pub(crate) fn open(&self) -> Result<Streams> {
        self.streams(None)
    }

    fn streams(&self, max_width: Option<u32>) -> Result<Streams> {
        let place = |stream: &Stream, is_colour: bool| match stream {
            Stream::Files(_) => Ok(Place::File(0)),
            Stream::Film { path, facts, kept } => {
                let want = Want {
                    kept: *kept,
                    rate: self.rate,
                    max_width,
                };
                let open = if is_colour {
                    Reader::colours
                } else {
                    Reader::numbers
                };
                Ok::<_, resample_core::Error>(Place::Film(open(path, facts, &want)?))
            }
        };
        Ok(Streams {
            colour: place(&self.colour, true)?,
            depth: place(&self.depth, false)?,
        })
    }

    /// Finds the length, the shots and their ranges.
    fn look_through(&mut self, cuts: Option<&[usize]>, progress: Progress) -> Result<()> {
        let mut watch = watch("looking through the film", progress);
        let expected = [&self.colour, &self.depth]
            .into_iter()
            .find_map(|stream| stream.expected(self.rate));
        let mut streams = self.streams(Some(SURVEY_WIDTH))?;
        let mut survey = Survey::default();
        let mut files = 0;
        loop {
            // Numbers of files may be any; their ranks are looked at where they are read.
            let colour = match &mut streams.colour {
                Place::Film(reader) => reader.picture()?,
                Place::File(_) => None,
            };
            let depth = match &mut streams.depth {
                Place::Film(reader) => reader.plane()?,
                Place::File(_) => None,
            };
            let is_film = |stream: &Stream| matches!(stream, Stream::Film { .. });
            let ended = (is_film(&self.colour) && colour.is_none())
                || (is_film(&self.depth) && depth.is_none());
            let files_end = [&self.colour, &self.depth]
                .iter()
                .any(|stream| matches!(stream, Stream::Files(names) if names.len() <= files));
            if ended || files_end {
                break;
            }
            files += 1;
            let (rgb, width) = colour.map_or((Vec::new(), 1), |c| (c.rgb, c.width));
            let (numbers, its_width) = depth.map_or((Vec::new(), 1), |d| (d.values, d.width));
            survey.add(&rgb, width, &numbers, its_width);
            if let Some(expected) = expected {
                watch((survey.pictures() as f64 / expected).min(0.99));
            }
        }
        watch(1.0);
        self.pictures = survey.pictures();
        if self.pictures == 0 {
            bail!("{}: it has no pictures", self.files()[0]);
        }
        if let Some(expected) = expected
            && (self.pictures as f64) < expected - 2.0
        {
            report::say(&format!(
                "note: {} pictures have a depth, of about {expected:.0}",
                self.pictures
            ));
        }
        self.shots = survey.shots(cuts, RANGE_SHARE);
        if self.shots.len() > 1 {
            report::say(&format!(
                "note: {} shots in {} pictures",
                self.shots.len(),
                self.pictures
            ));
        }
        Ok(())
    }
}

/// Returns true if both eyes of a pair are drawn from one picture alone, which they share their rows with.
fn is_pair(args: &Warp3dArgs) -> bool {
    let (cameras, views) = (&args.cameras, &args.views);
    let is_alone = cameras.to.is_none() && cameras.reference.is_empty();
    let is_plane = cameras.from != Some(Viewpoint::Equirectangular)
        && views.layout.is_none_or(|layout| layout.places().is_some());
    views.stereo.is_some() && is_alone && is_plane
}

/// Sets the defaults of a film, where nothing else was typed: relative depth, a lens, the surface tolerance, the method of a pair, and the
/// filling of holes.
pub(crate) fn set_defaults(args: &mut Warp3dArgs, is_relative: bool) -> Result<()> {
    if is_relative && args.meaning.depth_kind.is_none() {
        args.meaning.depth_kind = Some(DepthKind::Relative);
    }
    if args.cameras.from.is_none() && args.cameras.intrinsics.is_none() {
        args.cameras.from = Some(viewpoint::parse(FOV).map_err(anyhow::Error::msg)?);
        report::say(&format!(
            "note: the lens is unknown: it is taken as {FOV} (--from says another)"
        ));
    }
    let has_surfaces = args.render.options.method != MethodName::Nearest;
    if args.meaning.kind() == DepthKind::Relative && has_surfaces && !args.render.has("tolerance") {
        let word = TOLERANCE.to_string();
        args.render.set("tolerance", word, |options| {
            options.tolerance = Some(TOLERANCE)
        });
    }
    if is_pair(args) && !args.render.has("method") {
        let rows = |options: &mut WarpArgs| options.method = MethodName::Rows;
        args.render.set("method", "rows".to_owned(), rows);
    }
    if !args.render.has("fill") {
        let word = "film".to_owned();
        args.render
            .set("fill", word, |options| options.fill = Fill::Film);
    }
    Ok(())
}

impl Stream {
    /// The film of a word; `None` where it names none.
    fn of(word: &str) -> Result<Option<Self>> {
        let Part { path, name } = Part::from_text(word);
        if !is_film(&path) {
            return Ok(None);
        }
        let kept = match &name {
            None => Kept::Whole,
            Some(name) => Kept::of_word(name).with_context(|| {
                format!("{word}: '{name}' is no half of a film: left, right, top or bottom")
            })?,
        };
        let facts = Facts::of(&path)?;
        Ok(Some(Self::Film { path, facts, kept }))
    }

    /// The files of a pattern or a list.
    fn files(word: &str, what: &str) -> Result<Self> {
        match files_of(word)? {
            Some(files) => Ok(Self::Files(files)),
            None => bail!("{word}: {what}: give a film, a pattern such as %04d, or a list"),
        }
    }

    /// Keeps the other half where the depth is one half of the same film.
    fn leave_to(&mut self, depth: &Self, depth_word: &str) -> Result<()> {
        let (
            Self::Film { path, kept, .. },
            Self::Film {
                path: its_path,
                kept: its_kept,
                ..
            },
        ) = (self, depth)
        else {
            return Ok(());
        };
        if path != its_path {
            return Ok(());
        }
        if *its_kept == Kept::Whole {
            bail!(
                "{depth_word}: picture and depth are the same film: name the half that is the depth, such as {depth_word}#right"
            );
        }
        *kept = its_kept.other();
        Ok(())
    }

    /// Says what differs from the film.
    fn notes(&self, rate: FrameRate) {
        let Self::Film { path, facts, .. } = self else {
            return;
        };
        let name = path.display();
        if facts.is_uneven {
            report::say(&format!(
                "note: {name}: its pictures stand at uneven times: it is read at {:.3} pictures per second",
                rate.per_second()
            ));
        }
        if ["smpte2084", "arib-std-b67"].contains(&facts.colours.transfer.as_str()) {
            report::say(&format!(
                "note: {name}: colours beyond the usual range ({}) are mixed as if they were sRGB, and keep their meaning",
                facts.colours.transfer
            ));
        }
    }

    /// Width and height of its pictures, px.
    fn size(&self) -> Result<[u32; 2]> {
        match self {
            Self::Film { facts, kept, .. } => Ok(kept.size(facts.size)),
            Self::Files(files) => Ok(colour::size(&Part::from_text(&files[0]))?),
        }
    }

    /// About how many pictures it has.
    fn expected(&self, rate: FrameRate) -> Option<f64> {
        match self {
            Self::Film { facts, .. } => Some(facts.seconds? * rate.per_second()),
            Self::Files(files) => Some(files.len() as f64),
        }
    }
}

impl Streams {
    /// The next picture and its depth.
    pub(crate) fn next(&mut self, film: &FilmInput) -> Result<Source<HeldPictures>> {
        let ended = || format!("{}: it ends sooner than before", film.files()[0]);
        let file = |stream: &Stream, number: &mut usize| match stream {
            Stream::Files(files) => {
                *number += 1;
                files.get(*number - 1).map(|file| Part::from_text(file))
            }
            Stream::Film { .. } => None,
        };
        let colour = match &mut self.colour {
            Place::Film(reader) => reader.picture()?.with_context(ended)?,
            Place::File(number) => colour::read(&file(&film.colour, number).with_context(ended)?)?,
        };
        let depth = match &mut self.depth {
            Place::Film(reader) => reader.plane()?.with_context(ended)?,
            Place::File(number) => depth::read(&file(&film.depth, number).with_context(ended)?)?,
        };
        Ok(held(HeldPicture { colour, depth }))
    }
}

/// The numbers of the pictures that begin shots, as a file lists them.
pub(crate) fn read_cuts(path: &Path) -> Result<Vec<usize>> {
    let text = files::read_text(path)?;
    let words = text
        .split(|c: char| c.is_whitespace() || c == ',')
        .filter(|word| !word.is_empty());
    let number = |word: &str| {
        word.parse().with_context(|| {
            format!(
                "{}: '{word}' is no number of a picture, counted from 0",
                path.display()
            )
        })
    };
    words.map(number).collect()
}

fn held(picture: HeldPicture) -> Source<HeldPictures> {
    Source::Memory(Arc::new(HeldPictures(vec![picture])))
}

/// The standard input in a file of its own.
fn spooled() -> Result<(NamedTempFile, Listed)> {
    let mut input = std::io::stdin();
    if input.is_terminal() {
        bail!("-: the standard input is a terminal: pipe a film into it");
    }
    let (mut file, listed) = temporary_file(&std::env::temp_dir())?;
    std::io::copy(&mut input, &mut file).context("-: cannot be kept")?;
    if !is_film(file.path()) {
        bail!("-: the standard input is no film that ffmpeg reads");
    }
    Ok((file, listed))
}
