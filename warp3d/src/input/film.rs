//! Films of pictures with depth: pictures and depths as films, as numbered files beside a film, or as the two halves of one film.
//!
//! A film is looked through once, small, for its length, its shots and their ranges of depth; then its pictures are read in order.
//! Limits: a film from the standard input is kept in a temporary file until the run ends, since it is read twice.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use resample_io::files;
use resample_io::files::fault;
use resample_io::film::{Facts, FrameRate, Kept, Original, Reader, Want, is_film};
use resample_io::listed::files_of;
use resample_io::write::{Listed, temporary_file};
use resample_io::{Part, Picture, Plane, colour, depth};
use tempfile::NamedTempFile;

use crate::Error;
use crate::film::{Shot, Survey};
use crate::input::range::SHARE;

/// Width of the pictures that are looked through, px: enough for the colours of a shot and the ranks of its depths.
const SURVEY_WIDTH: u32 = 160;

/// The names of a film.
#[derive(Clone, Copy, Debug)]
pub struct FilmWords<'a> {
    /// Its pictures: a film, `-` for one from the standard input, or numbered files.
    pub colour: &'a str,
    /// Its depths: a film, a half of one such as `FILM#right`, or numbered files.
    pub depth: &'a str,
    /// Pictures per second; the film's own where not set.
    pub fps: Option<u16>,
    /// A file with the numbers of the pictures that begin shots, where they are known.
    pub cuts: Option<&'a Path>,
}

/// Follows a film that is looked through.
pub struct Follower<'a> {
    /// Receives a sentence on what differs from the film.
    pub note: &'a mut dyn FnMut(&str),
    /// Receives the share that is done, 0 to 1.
    pub progress: &'a mut dyn FnMut(f64),
}

/// A film and its depth.
#[derive(Clone, Debug)]
pub struct FilmInput {
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
pub struct Streams {
    colour: Place,
    depth: Place,
}

enum Place {
    Film(Reader),
    File(usize),
}

impl FilmInput {
    /// The film that the words name; `None` where they name none. Looks it through.
    ///
    /// # Errors
    /// [`Error::Input`] names the film that cannot be read, or the side without a file for each picture.
    pub fn find(words: &FilmWords, follower: &mut Follower) -> Result<Option<Self>, Error> {
        let kept = match words.colour {
            "-" => Some(Arc::new(spooled()?)),
            _ => None,
        };
        let colour = match &kept {
            Some(kept) => kept.0.path().display().to_string(),
            None => words.colour.to_owned(),
        };
        let is_depth_of_it =
            words.depth == words.colour || words.depth.starts_with(&format!("{}#", words.colour));
        let depth = match &kept {
            Some(_) if is_depth_of_it => words.depth.replacen(words.colour, &colour, 1),
            _ => words.depth.to_owned(),
        };
        let (colour, depth) = (Stream::of(&colour)?, Stream::of(&depth)?);
        let (mut colour, depth) = match (colour, depth) {
            (None, None) => return Ok(None),
            (Some(colour), None) => (
                colour,
                Stream::files(words.depth, "a film needs a depth for each picture")?,
            ),
            (None, Some(depth)) => (
                Stream::files(words.colour, "a film of depths needs a picture for each")?,
                depth,
            ),
            (Some(colour), Some(depth)) => (colour, depth),
        };
        colour.leave_to(&depth, words.depth)?;
        let rate = match (words.fps, &colour, &depth) {
            (Some(fps), ..) => FrameRate::whole(u32::from(fps)),
            (None, Stream::Film { facts, .. }, _) | (None, _, Stream::Film { facts, .. }) => {
                facts.rate
            }
            (None, Stream::Files(_), Stream::Files(_)) => return Ok(None),
        };
        colour.notes(rate, follower);
        let mut film = Self {
            colour,
            depth,
            rate,
            shots: Vec::new(),
            pictures: 0,
            _kept: kept,
        };
        let cuts = words.cuts.map(read_cuts).transpose()?;
        film.look_through(cuts.as_deref(), follower)?;
        Ok(Some(film))
    }

    /// How many pictures it has.
    pub fn pictures(&self) -> usize {
        self.pictures
    }

    /// Its shots, in order.
    pub fn shots(&self) -> &[Shot] {
        &self.shots
    }

    /// Returns true if the codes of the depth have a range of their own for each shot.
    pub fn has_ranges(&self) -> bool {
        matches!(self.depth, Stream::Film { .. })
    }

    /// Returns true if the film says that its pictures are panoramas.
    pub fn is_panorama(&self) -> bool {
        matches!(&self.colour, Stream::Film { facts, .. } if facts.is_panorama)
    }

    /// The files that it is read from.
    pub fn files(&self) -> Vec<String> {
        let of = |stream: &Stream| match stream {
            Stream::Film { path, .. } => vec![path.display().to_string()],
            Stream::Files(files) => files.clone(),
        };
        [of(&self.colour), of(&self.depth)].concat()
    }

    /// The files of its depths, where they are no film.
    pub fn depth_files(&self) -> Vec<Part> {
        match &self.depth {
            Stream::Film { .. } => Vec::new(),
            Stream::Files(files) => files.iter().map(|file| Part::from_text(file)).collect(),
        }
    }

    /// Width and height of its pictures, px.
    ///
    /// # Errors
    /// The first of numbered files cannot be read.
    pub fn size(&self) -> Result<[u32; 2], Error> {
        self.colour.size()
    }

    /// The film whose sound and colours go along.
    pub fn original(&self) -> Option<Original> {
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

    /// Starts to read from the beginning.
    ///
    /// # Errors
    /// The film can no longer be read.
    pub fn open(&self) -> Result<Streams, Error> {
        self.streams(None)
    }

    fn streams(&self, max_width: Option<u32>) -> Result<Streams, Error> {
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
                Ok::<_, Error>(Place::Film(open(path, facts, &want)?))
            }
        };
        Ok(Streams {
            colour: place(&self.colour, true)?,
            depth: place(&self.depth, false)?,
        })
    }

    /// Finds the length, the shots and their ranges.
    fn look_through(
        &mut self,
        cuts: Option<&[usize]>,
        follower: &mut Follower,
    ) -> Result<(), Error> {
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
                (follower.progress)((survey.pictures() as f64 / expected).min(0.99));
            }
        }
        (follower.progress)(1.0);
        self.pictures = survey.pictures();
        if self.pictures == 0 {
            return refused(format!("{}: it has no pictures", self.files()[0]));
        }
        if let Some(expected) = expected
            && (self.pictures as f64) < expected - 2.0
        {
            (follower.note)(&format!(
                "note: {} pictures have a depth, of about {expected:.0}",
                self.pictures
            ));
        }
        self.shots = survey.shots(cuts, SHARE);
        if self.shots.len() > 1 {
            (follower.note)(&format!(
                "note: {} shots in {} pictures",
                self.shots.len(),
                self.pictures
            ));
        }
        Ok(())
    }
}

impl Stream {
    /// The film of a word; `None` where it names none.
    fn of(word: &str) -> Result<Option<Self>, Error> {
        let Part { path, name } = Part::from_text(word);
        if !is_film(&path) {
            return Ok(None);
        }
        let kept = match &name {
            None => Kept::Whole,
            Some(name) => Kept::of_word(name).ok_or_else(|| {
                let what = format!("'{name}' is no half of a film: left, right, top or bottom");
                Error::Input(format!("{word}: {what}"))
            })?,
        };
        let facts = Facts::of(&path)?;
        Ok(Some(Self::Film { path, facts, kept }))
    }

    /// The files of a pattern or a list.
    fn files(word: &str, what: &str) -> Result<Self, Error> {
        match files_of(word)? {
            Some(files) => Ok(Self::Files(files)),
            None => refused(format!(
                "{word}: {what}: give a film, a pattern such as %04d, or a list"
            )),
        }
    }

    /// Keeps the other half where the depth is one half of the same film.
    fn leave_to(&mut self, depth: &Self, depth_word: &str) -> Result<(), Error> {
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
            return refused(format!(
                "{depth_word}: picture and depth are the same film: name the half that is the depth, such as {depth_word}#right"
            ));
        }
        *kept = its_kept.other();
        Ok(())
    }

    /// Says what differs from the film.
    fn notes(&self, rate: FrameRate, follower: &mut Follower) {
        let Self::Film { path, facts, .. } = self else {
            return;
        };
        let name = path.display();
        if facts.is_uneven {
            (follower.note)(&format!(
                "note: {name}: its pictures stand at uneven times: it is read at {:.3} pictures per second",
                rate.per_second()
            ));
        }
        if ["smpte2084", "arib-std-b67"].contains(&facts.colours.transfer.as_str()) {
            (follower.note)(&format!(
                "note: {name}: colours beyond the usual range ({}) are mixed as if they were sRGB, and keep their meaning",
                facts.colours.transfer
            ));
        }
    }

    /// Width and height of its pictures, px.
    fn size(&self) -> Result<[u32; 2], Error> {
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
    ///
    /// # Errors
    /// A file cannot be read, or the film ends sooner than when it was looked through.
    pub fn next(&mut self, film: &FilmInput) -> Result<(Picture, Plane), Error> {
        let ended = || Error::Input(format!("{}: it ends sooner than before", film.files()[0]));
        let file = |stream: &Stream, number: &mut usize| match stream {
            Stream::Files(files) => {
                *number += 1;
                files.get(*number - 1).map(|file| Part::from_text(file))
            }
            Stream::Film { .. } => None,
        };
        let colour = match &mut self.colour {
            Place::Film(reader) => reader.picture()?.ok_or_else(ended)?,
            Place::File(number) => colour::read(&file(&film.colour, number).ok_or_else(ended)?)?,
        };
        let depth = match &mut self.depth {
            Place::Film(reader) => reader.plane()?.ok_or_else(ended)?,
            Place::File(number) => depth::read(&file(&film.depth, number).ok_or_else(ended)?)?,
        };
        Ok((colour, depth))
    }
}

/// The numbers of the pictures that begin shots, as a file lists them.
///
/// # Errors
/// The file cannot be read, or a word of it is no number.
pub fn read_cuts(path: &Path) -> Result<Vec<usize>, Error> {
    let text = files::read_text(path)?;
    let words = text
        .split(|c: char| c.is_whitespace() || c == ',')
        .filter(|word| !word.is_empty());
    let number = |word: &str| {
        word.parse().map_err(|_| {
            let what = format!("'{word}' is no number of a picture, counted from 0");
            fault(path, what)
        })
    };
    words.map(number).collect()
}

/// The standard input in a file of its own.
fn spooled() -> Result<(NamedTempFile, Listed), Error> {
    let mut input = std::io::stdin();
    if input.is_terminal() {
        return refused("-: the standard input is a terminal: pipe a film into it".to_owned());
    }
    let unkept = |error: std::io::Error| Error::Input(format!("-: cannot be kept: {error}"));
    let (mut file, listed) = temporary_file(&std::env::temp_dir()).map_err(unkept)?;
    std::io::copy(&mut input, &mut file).map_err(unkept)?;
    if !is_film(file.path()) {
        return refused("-: the standard input is no film that ffmpeg reads".to_owned());
    }
    Ok((file, listed))
}

fn refused<T>(text: String) -> Result<T, Error> {
    Err(Error::Input(text))
}
