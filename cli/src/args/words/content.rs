//! Finds the command of a file by its content.
//!
//! Takes names as they are typed, gives the application. Gaussians are asked first, because they come within files of other kinds;
//! then volumes, whose marks are the surest, then scans that have a mark, meshes, pictures; at last rows of numbers, and Gaussians in a
//! file without a mark. An ending decides nothing.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::{Arg, ArgMatches, Args, Command, CommandFactory, FromArgMatches};
use image::{ColorType, ImageDecoder, ImageFormat, ImageReader};
use resample_cloud::input::{CloudFormat, cloud_format_of};
use resample_io::{exr, files};
use volsplat::GaussianFormat;
use volsplat::input::Format;

use crate::args::{Cli, Drawing, GaussiansArgs, PointsArgs, TexmapArgs, VolsplatArgs, Warp3dArgs};
use crate::values::input_file::InputFile;

/// The content of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Content {
    /// A volume, or slices of one.
    Volume,
    /// 3-D Gaussians.
    Gaussians,
    /// A mesh.
    Mesh,
    /// A scan of points.
    Points,
    /// A picture or a depth.
    Picture,
    /// One plane of numbers: a volume of one slice, or a depth.
    Plane,
    /// Colours and depth in one file.
    PictureAndDepth,
    /// Nothing that is known; a headerless volume has no mark.
    Unknown,
}

/// Bytes that tell the format of a picture.
const HEAD_BYTES: u64 = 64;

impl Content {
    /// The content of a file, a folder or a pattern.
    pub(crate) fn of(path: &Path) -> Result<Self> {
        let gaussians = gaussian_format(path)?;
        if gaussians.is_some_and(|format| format != GaussianFormat::Splat) {
            return Ok(Self::Gaussians);
        }
        match volsplat::input::format_of(path)? {
            Some(Format::Tiff) if path.is_file() => return Ok(of_tiff(path)),
            Some(Format::Npy) => return of_array(path),
            Some(_) => return Ok(Self::Volume),
            None if path.is_dir() => return Ok(Self::Volume),
            None => {}
        }
        // Rows of numbers have no mark, and are asked for last.
        let scan = cloud_format_of(path)?;
        if scan.is_some_and(|format| format != CloudFormat::Xyz) {
            return Ok(Self::Points);
        }
        if texmap::input::format_of(path)?.is_some() {
            return Ok(Self::Mesh);
        }
        let head = files::first_bytes(path, HEAD_BYTES)?;
        if head.starts_with(b"PF") || head.starts_with(b"Pf") {
            return Ok(Self::Picture);
        }
        Ok(match image::guess_format(&head) {
            Ok(ImageFormat::OpenExr) if exr::channels_of(path)?.has_colour_and_depth => {
                Self::PictureAndDepth
            }
            Ok(_) => Self::Picture,
            Err(_) if scan.is_some() => Self::Points,
            Err(_) if gaussians.is_some() => Self::Gaussians,
            Err(_) => Self::Unknown,
        })
    }
}

/// The format of a file of Gaussians, or of a folder; patterns name none.
fn gaussian_format(path: &Path) -> Result<Option<GaussianFormat>> {
    if !path.exists() {
        return Ok(None);
    }
    Ok(volsplat::gaussian_format_of(path)?)
}

/// The application that draws what the words name, and the words with its files: names come before options.
pub(crate) fn drawn(words: &[OsString]) -> Result<(Application, Vec<OsString>)> {
    let is_name = |word: &&OsString| !word.to_string_lossy().starts_with('-');
    let names: Vec<&OsString> = words.iter().take_while(is_name).collect();
    let is = |application| Ok((application, words.to_vec()));
    let Some(&first) = names.first() else {
        return is(Application::Volume);
    };
    let is_headerless = words
        .iter()
        .any(|word| word.to_string_lossy().starts_with("--dims"));
    let path = InputFile::of(first.clone()).path;
    // The command that reads it says best why it cannot.
    let content = Content::of(&path).ok().filter(|_| !is_headerless);
    let Some(content) = content else {
        return is(Application::Volume);
    };
    let name = path.display();
    match (content, names.len()) {
        (Content::Volume | Content::Unknown, _) => is(Application::Volume),
        (Content::Gaussians, _) => is(Application::Gaussians),
        (Content::Mesh, _) => is(Application::Mesh),
        (Content::Points, _) => is(Application::Points),
        (Content::PictureAndDepth, 1) => {
            let mut both = words.to_vec();
            both.insert(1, path.into_os_string());
            Ok((Application::Depth, both))
        }
        (Content::Picture | Content::Plane | Content::PictureAndDepth, 2) => is(Application::Depth),
        (Content::Picture, 1) => bail!(
            "{name}: a photograph needs a depth map, as in resample warp3d {name} DEPTH --depth-kind relative --stereo 0.06; \
             of a volume's slices give the folder or a pattern in quotes"
        ),
        (Content::Plane, 1) => bail!(
            "{name}: one plane of numbers is a volume of one slice (resample volsplat {name}) or a depth (resample warp3d \
             PICTURE {name} --from CAM): say which"
        ),
        // Two are a picture and its depth, more are slices.
        _ => is(Application::Volume),
    }
}

/// A TIFF of colours is a picture, of many pages a volume; one grey page may be either.
fn of_tiff(path: &Path) -> Content {
    if volsplat::input::pages_of(path).is_some_and(|pages| pages > 1) {
        return Content::Volume;
    }
    match colours(path) {
        Some(colour) if colour.has_color() => Content::Picture,
        _ => Content::Plane,
    }
}

/// The colours of a picture that the crate `image` reads.
pub(crate) fn colours(path: &Path) -> Option<ColorType> {
    let (file, _) = files::open(path).ok()?;
    let reader = ImageReader::new(std::io::BufReader::new(file)).with_guessed_format();
    Some(reader.ok()?.into_decoder().ok()?.color_type())
}

fn of_array(path: &Path) -> Result<Content> {
    let (mut file, _) = files::open(path)?;
    Ok(match resample_io::npy::Header::read(&mut file) {
        Ok(header) if header.shape.len() == 2 => Content::Plane,
        // The reader says what is wrong with it.
        Ok(_) | Err(_) => Content::Volume,
    })
}

/// The words of this process, with the command put in where they begin with the name of a file.
///
/// # Errors
/// A first word that is neither a command nor a file but looks like one, and a file that several commands could mean.
pub(crate) fn with_command(
    words: Vec<OsString>,
    is_command: impl Fn(&str) -> bool,
) -> Result<Vec<OsString>> {
    let Some(at) = first_name(&words) else {
        return Ok(words);
    };
    let word = words[at].to_string_lossy().into_owned();
    if is_command(&word) {
        return Ok(words);
    }
    let path: PathBuf = InputFile::of(words[at].clone()).path;
    let is_steps = || volsplat::input::step_files(&path).is_ok_and(|steps| steps.is_some());
    let is_there = path.exists() || word.contains(['*', '?']) || is_steps();
    if !is_there {
        if word.contains(['.', '/']) {
            bail!("{word}: neither a file nor a command; resample -h lists the commands");
        }
        return Ok(words);
    }
    let (application, of_scene) = drawn(&words[at..])?;
    let own = words[..at].iter().cloned();
    let command = std::iter::once(OsString::from(application.name()));
    Ok(own.chain(command).chain(of_scene).collect())
}

/// Replaces the command by the content of its one input file: `volsplat` becomes `gaussians` for 3-D Gaussians, `warp3d` becomes
/// `points` for a scan. The command may stand behind `trade`.
pub(crate) fn of_content(mut words: Vec<OsString>) -> Vec<OsString> {
    let Some(first) = first_name(&words) else {
        return words;
    };
    let command = first + usize::from(words[first] == "trade");
    let typed = words.get(command).and_then(|word| word.to_str());
    let (content, application) = match typed {
        Some("volsplat") => (Content::Gaussians, Application::Gaussians),
        Some("warp3d") => (Content::Points, Application::Points),
        _ => return words,
    };
    let behind = &words[command + 1..];
    let is_headerless = behind.iter().any(|word| starts(word, "--dims"));
    let [name] = inputs(&words[first..command], behind)[..] else {
        return words;
    };
    let path = InputFile::of(name.clone()).path;
    if is_headerless || !Content::of(&path).is_ok_and(|found| found == content) {
        return words;
    }
    words[command] = application.name().into();
    if application == Application::Points {
        call_to_camera(&mut words[command + 1..]);
    }
    words
}

/// A scan is seen from one new camera, as a warp is with `--to`; its command calls that `--camera`.
fn call_to_camera(words: &mut [OsString]) {
    for word in words {
        let text = word.to_string_lossy().into_owned();
        if text == "--to" || text.starts_with("--to=") {
            *word = OsString::from(text.replacen("--to", "--camera", 1));
        }
    }
}

fn starts(word: &OsString, with: &str) -> bool {
    word.to_string_lossy().starts_with(with)
}

/// Those of a command's words that are neither options nor the values of options; `outer` is `trade` behind which it stands, or empty.
fn inputs<'a>(outer: &[OsString], words: &'a [OsString]) -> Vec<&'a OsString> {
    let cli = Cli::command();
    let parent = outer.iter().fold(&cli, |command, name| {
        command.find_subcommand(name).unwrap_or(command)
    });
    let commands = ["volsplat", "gaussians", "warp3d", "points"];
    let commands = commands
        .iter()
        .flat_map(|name| parent.find_subcommand(name));
    let options: Vec<&Arg> = std::iter::once(&cli)
        .chain(commands)
        .flat_map(Command::get_arguments)
        .filter(|option| option.get_action().takes_values())
        .collect();
    let takes_value = |word: &OsString| {
        let word = word.to_string_lossy();
        let names = |option: &&Arg| {
            let long = option.get_long().map(|long| format!("--{long}"));
            let short = option.get_short().map(|short| format!("-{short}"));
            [long, short].contains(&Some(word.to_string()))
        };
        options.iter().any(names)
    };
    let mut found = Vec::new();
    let mut rest = words.iter();
    while let Some(word) = rest.next() {
        if !starts(word, "-") {
            found.push(word);
        } else if takes_value(word) {
            rest.next();
        }
    }
    found
}

/// Where the first word stands that is no option of every command.
fn first_name(words: &[OsString]) -> Option<usize> {
    let mut at = 1;
    loop {
        match words.get(at)?.to_string_lossy().as_ref() {
            "--threads" => at += 2,
            "-q" | "--quiet" | "-v" | "--verbose" => at += 1,
            word if word.starts_with("--threads=") => at += 1,
            word if word.starts_with('-') => return None,
            _ => return Some(at),
        }
    }
}

/// The command that draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Application {
    /// `volsplat`.
    Volume,
    /// `gaussians`.
    Gaussians,
    /// `texmap`.
    Mesh,
    /// `warp3d`.
    Depth,
    /// `points`.
    Points,
}

impl Application {
    /// The name of the command.
    pub fn name(self) -> &'static str {
        match self {
            Self::Volume => "volsplat",
            Self::Gaussians => "gaussians",
            Self::Mesh => "texmap",
            Self::Depth => "warp3d",
            Self::Points => "points",
        }
    }

    /// The command's arguments, of which none has to name the picture: it is `output` unless it is typed.
    pub fn command(self, name: &'static str, output: &'static str) -> Command {
        let command = Command::new(name)
            .no_binary_name(true)
            .args_override_self(true);
        let command = match self {
            Self::Volume => VolsplatArgs::augment_args(command),
            Self::Gaussians => GaussiansArgs::augment_args(command),
            Self::Mesh => TexmapArgs::augment_args(command),
            Self::Depth => Warp3dArgs::augment_args(command),
            Self::Points => PointsArgs::augment_args(command),
        };
        command.mut_arg("output", |arg| {
            arg.required(false).default_value(output).hide(true)
        })
    }

    /// The parsed arguments as the command they belong to.
    pub fn drawing(self, matches: &ArgMatches) -> Result<Drawing, clap::Error> {
        Ok(match self {
            Self::Volume => Drawing::Volsplat(Box::new(VolsplatArgs::from_arg_matches(matches)?)),
            Self::Gaussians => {
                Drawing::Gaussians(Box::new(GaussiansArgs::from_arg_matches(matches)?))
            }
            Self::Mesh => Drawing::Texmap(Box::new(TexmapArgs::from_arg_matches(matches)?)),
            Self::Depth => Drawing::Warp3d(Box::new(Warp3dArgs::from_arg_matches(matches)?)),
            Self::Points => Drawing::Points(Box::new(PointsArgs::from_arg_matches(matches)?)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<OsString> {
        text.split(' ').map(OsString::from).collect()
    }

    #[test]
    fn commands_and_options_stay_as_they_are() {
        let is_command = |word: &str| word == "volsplat";
        for text in [
            "resample",
            "resample -h",
            "resample volsplat a.b",
            "resample volspalt x",
        ] {
            let kept = with_command(words(text), is_command).expect("no file is asked for");
            assert_eq!(kept, words(text));
        }
        let error = with_command(words("resample a/b.nrrd -o x.png"), is_command);
        let error = error.expect_err("no such file").to_string();
        assert!(
            error.contains("a/b.nrrd: neither a file nor a command"),
            "{error}"
        );
    }

    #[test]
    fn the_input_is_no_value_of_an_option() {
        let found = |outer: &[OsString], text: &str| {
            let words = words(text);
            let names = inputs(outer, &words)
                .into_iter()
                .map(|word| word.to_string_lossy());
            names.collect::<Vec<_>>().join(" ")
        };
        let measured = found(&words("trade"), "b.ply --reps 1 --out report --threads 2");
        assert_eq!(measured, "b.ply");
        let found = |text: &str| found(&[], text);
        assert_eq!(found("-o a.png --size 8x8 --resume b.ply"), "b.ply");
        assert_eq!(found("--size=8x8 b.ply -o a.png"), "b.ply");
        assert_eq!(found("a.png a.pfm --to shift:1,0,0"), "a.png a.pfm");
        assert_eq!(found("--slab-error 0.1"), "");
    }

    #[test]
    fn the_first_name_stands_behind_the_options_of_every_command() {
        assert_eq!(
            first_name(&words("resample --threads 2 -q a.glb -o b")),
            Some(4)
        );
        assert_eq!(
            first_name(&words("resample -o b a.glb")),
            None,
            "an option of a command"
        );
    }
}
