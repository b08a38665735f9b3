//! The report of a run: lines, notes and bars on stderr, and the stats file.
//!
//! Takes counts and times, gives text. Everything for people goes to stderr, so that stdout stays free; a closed
//! stderr is no reason to stop. The keys of the stats file are described in `docs/stats.md`.

use std::cell::RefCell;
use std::collections::HashSet;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Error;
use indicatif::{ProgressBar, ProgressStyle};
use resample_core::Image;
use resample_io::memory;
use serde::{Serialize, Serializer};
use serde_json::Value;

/// How much is said.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verbosity {
    /// Warnings and errors only.
    Quiet,
    /// One line about the written files.
    Normal,
    /// The time of each stage as well.
    Verbose,
}

impl Verbosity {
    /// Returns the visibility of progress bars.
    pub(crate) fn progress(self) -> Progress {
        if self == Self::Quiet {
            Progress::Hidden
        } else {
            Progress::Shown
        }
    }
}

/// The stats file. Field names are its keys.
#[derive(Clone, Debug, Serialize)]
pub struct RunStats {
    /// Version of this program.
    pub version: &'static str,
    /// The scene: an object whose keys depend on the command.
    #[serde(flatten)]
    pub scene: Value,
    /// Threads that were used.
    pub threads: usize,
    /// All options as they were used.
    pub settings: Value,
    /// The choice of `--max-error` or `--max-time`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub planned: Option<Value>,
    /// Elapsed time to read the input, ms.
    pub load_ms: f64,
    /// Most memory that the process held at once, bytes; none where the system does not tell.
    pub peak_bytes: Option<u64>,
    /// One entry per picture.
    pub frames: Vec<WrittenFrame>,
}

impl RunStats {
    /// Before the first picture; `settings` hold all options as they are used.
    pub(crate) fn new(scene: Value, settings: Value, load_ms: f64) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            scene,
            threads: rayon::current_num_threads(),
            settings,
            planned: None,
            load_ms,
            peak_bytes: None,
            frames: Vec::new(),
        }
    }
}

/// One picture that was written.
#[derive(Clone, Debug, Serialize)]
pub struct WrittenFrame {
    /// Its file; all pictures of an animation share one.
    #[serde(serialize_with = "name_in_stats")]
    pub file: PathBuf,
    /// Size of the file, bytes.
    pub file_bytes: u64,
    /// Width, px.
    pub width: usize,
    /// Height, px.
    pub height: usize,
    /// Counts and times.
    #[serde(flatten)]
    pub account: Account,
}

impl WrittenFrame {
    /// The record of a picture that was written to `file`.
    pub(crate) fn of(file: PathBuf, file_bytes: u64, image: &Image, account: Account) -> Self {
        Self {
            file,
            file_bytes,
            width: image.width,
            height: image.height,
            account,
        }
    }
}

/// A renderer's account of a frame.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Account {
    /// An object of counts and times; its keys depend on the renderer.
    #[serde(flatten)]
    pub keys: Value,
    /// The times of the stages and the main counts in one line, for people.
    #[serde(skip)]
    pub line: String,
    /// Its time and work, for the planner.
    #[serde(skip)]
    pub cost: Cost,
}

/// The time of a frame, and its work by the renderer's counts.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    /// Elapsed time, ms.
    pub wall_ms: f64,
    /// CPU time of all threads, ms.
    pub cpu_ms: f64,
    /// Work that grows with the visible area, in a unit of the renderer's own.
    pub growing: f64,
    /// Work that every window costs, in the same unit.
    pub fixed: f64,
    /// Sub-pixels along a pixel's side of the field of a volume; 0 elsewhere.
    pub subpixels: u32,
}

thread_local! {
    /// Captured messages, while a listener is set.
    static HEARD: RefCell<Option<Vec<String>>> = const { RefCell::new(None) };
}

/// Does something, and gives what it would have printed on stderr: for programs whose people do not look there.
pub fn heard<T>(what: impl FnOnce() -> T) -> (T, Vec<String>) {
    let listener = Listener(HEARD.replace(Some(Vec::new())));
    let done = what();
    let lines = HEARD.take().unwrap_or_default();
    drop(listener);
    (done, lines)
}

/// The list that was filled before this one; it is filled again afterwards, after a panic too, or else a pool's thread would swallow
/// the messages of its next task.
struct Listener(Option<Vec<String>>);

impl Drop for Listener {
    fn drop(&mut self) {
        HEARD.set(self.0.take());
    }
}

/// Prints remarks on a file, a line each, to stderr.
pub(crate) fn say_notes<'a>(notes: impl IntoIterator<Item = &'a String>) {
    for note in notes {
        say(&format!("note: {note}"));
    }
}

/// Prints one line to stderr.
pub fn say(line: &str) {
    let is_heard = HEARD.with_borrow_mut(|heard| {
        let list = heard.as_mut();
        list.map(|list| list.push(harmless(line))).is_some()
    });
    if is_heard {
        return;
    }
    // Nobody is left to tell if stderr is closed.
    let _ = writeln!(std::io::stderr(), "{}", harmless(line));
}

/// Writes a text to stdout; a reader that has seen enough and closed it is no fault.
pub fn print(text: &str) -> Result<(), Error> {
    match std::io::stdout().write_all(harmless(text).as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::new(error).context("cannot write to stdout"))
        }
        _ => Ok(()),
    }
}

/// The name of a file as text; bytes that are not Unicode become U+FFFD.
pub fn name(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// The names of files as text.
pub fn names(paths: &[PathBuf]) -> Vec<String> {
    paths.iter().map(|path| name(path)).collect()
}

fn name_in_stats<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&name(path))
}

/// An error and its causes as one line, without repeating a cause that the message before it already holds.
pub fn one_line(error: &Error) -> String {
    let mut line = String::new();
    for cause in error.chain() {
        let text = cause.to_string();
        // A parser's message has the word in front that this program puts there.
        let text = text.trim_start_matches("error: ").to_owned();
        if line.is_empty() {
            line = text;
        } else if !line.contains(&text) {
            line = format!("{line}: {text}");
        }
    }
    let line = line.lines().map(str::trim).collect::<Vec<_>>().join(" ");
    shortened(&line)
}

/// Most characters of a message. The longest of our own sentences with a long path needs some 400.
const LONGEST_MESSAGE: usize = 500;

/// A text without its middle where it is too long: the start names the file, and the end says what to do.
fn shortened(text: &str) -> String {
    let count = text.chars().count();
    if count <= LONGEST_MESSAGE {
        return text.to_owned();
    }
    let half = LONGEST_MESSAGE / 2;
    let start: String = text.chars().take(half).collect();
    let end: String = text.chars().skip(count - half).collect();
    format!("{start} ... {end}")
}

/// A text without characters that a terminal obeys, which files may put into names: each becomes its escape, `\u{1b}`.
fn harmless(text: &str) -> String {
    let obeyed = |c: char| (c.is_control() && c != '\n') || is_reordering(c);
    if !text.contains(obeyed) {
        return text.to_owned();
    }
    let shown = |c: char| match obeyed(c) {
        true => c.escape_unicode().to_string(),
        false => c.to_string(),
    };
    text.chars().map(shown).collect()
}

/// Characters that make later text run the other way, and so show another name than is there (Unicode, UAX 9).
fn is_reordering(c: char) -> bool {
    matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Milliseconds since `start`.
pub fn ms_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

/// The line at the end of a run: the files, their size, and the time.
pub fn summary(frames: &[WrittenFrame], seconds: f64) -> String {
    let [first, .., last] = frames else {
        return match frames {
            [only] => format!("wrote {} in {seconds:.2} s", described(only)),
            _ => "wrote nothing".to_owned(),
        };
    };
    if first.file == last.file {
        let (count, film) = (frames.len(), described(first));
        return format!("wrote {count} pictures as {film} in {seconds:.2} s");
    }
    let bytes = frames.iter().map(|frame| frame.file_bytes).sum();
    let (count, size) = (frames.len(), memory::human(bytes));
    let (first, last) = (first.file.display(), last.file.display());
    format!("wrote {count} pictures, {first} to {last} ({size}) in {seconds:.2} s")
}

/// A frame's file and what its renderer says about it, one line.
pub fn stage_line(frame: &WrittenFrame) -> String {
    format!("{}: {}", frame.file.display(), frame.account.line)
}

/// The high-water mark of this process's memory, bytes.
pub fn peak_bytes() -> Option<u64> {
    // Linux only; the file does not exist elsewhere.
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}

/// Memory that programs can have without pushing others out, bytes.
pub fn available_bytes() -> Option<u64> {
    // Linux only, as above.
    let info = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = info
        .lines()
        .find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}

fn described(frame: &WrittenFrame) -> String {
    let size = memory::human(frame.file_bytes);
    format!(
        "{} ({}x{}, {size})",
        frame.file.display(),
        frame.width,
        frame.height
    )
}

/// The notes that have been printed.
#[derive(Debug, Default)]
pub(crate) struct Notes(HashSet<String>);

impl Notes {
    /// Prints a note of a place, unless the same was said of this place or of another one before.
    pub(crate) fn say_of(&mut self, place: &str, text: String) {
        let line = format!("note: {place}: {text}");
        if self.0.insert(text) {
            say(&line);
        }
    }

    /// Prints a line, unless it was printed before.
    pub(crate) fn say(&mut self, line: &str) {
        if self.0.insert(line.to_owned()) {
            say(line);
        }
    }
}

/// Visibility of progress bars.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Progress {
    /// A bar, where stderr is a terminal.
    Shown,
    /// Nothing.
    Hidden,
}

/// A step that takes less shows no bar. A guess at what nobody wonders about.
const PATIENCE: Duration = Duration::from_secs(1);

/// Steps of a bar: finer than any terminal is wide.
const STEPS: u64 = 1000;

/// Takes the share of a step that is done, and shows it.
pub(crate) fn watch(step: &'static str, progress: Progress) -> impl FnMut(f64) {
    let start = Instant::now();
    let mut bar: Option<ProgressBar> = None;
    move |share| {
        if progress == Progress::Hidden || start.elapsed() < PATIENCE {
            return;
        }
        let bar = bar.get_or_insert_with(|| new_bar(step, start));
        bar.set_position((share * STEPS as f64) as u64);
        if share >= 1.0 {
            bar.finish_and_clear();
        }
    }
}

fn new_bar(step: &'static str, start: Instant) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {percent} %, {eta} left");
    ProgressBar::new(STEPS)
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        .with_message(step)
        .with_elapsed(start.elapsed())
}

#[cfg(test)]
mod tests {
    use anyhow::anyhow;
    use serde_json::json;

    use super::*;

    fn frame(name: &str) -> WrittenFrame {
        let account = Account {
            keys: json!({ "points": 3, "stages": {} }),
            line: "3 points".into(),
            cost: Cost::default(),
        };
        WrittenFrame {
            file: name.into(),
            file_bytes: 1_500,
            width: 8,
            height: 6,
            account,
        }
    }

    #[test]
    fn causes_are_joined_without_repeating_themselves() {
        let error = anyhow!("no such file")
            .context("a.raw: cannot read: no such file")
            .context("loading\nfailed");
        assert_eq!(
            one_line(&error),
            "loading failed: a.raw: cannot read: no such file",
            "one line"
        );
        let parsed = one_line(&anyhow!("error: unexpected argument"));
        assert_eq!(parsed, "unexpected argument", "the word is put there once");
    }

    #[test]
    fn what_files_say_cannot_command_a_terminal() {
        let line = harmless("a\u{1b}]0;title\u{7}\tb\u{202e}c\u{9b}2J");
        assert_eq!(line, "a\\u{1b}]0;title\\u{7}\\u{9}b\\u{202e}c\\u{9b}2J");
        assert_eq!(harmless("Größe 5 µm"), "Größe 5 µm");
    }

    #[test]
    fn long_messages_keep_both_ends() {
        let error = anyhow!("a.vti: arrays: {}: choose one", "name, ".repeat(100_000));
        let line = one_line(&error);
        assert!(line.len() < 700 && line.starts_with("a.vti") && line.ends_with("choose one"));
    }

    #[test]
    fn summary_names_one_picture_or_the_first_and_the_last() {
        assert_eq!(
            summary(&[frame("a.png")], 0.5),
            "wrote a.png (8x6, 1.5 kB) in 0.50 s",
            "one"
        );
        let several = [frame("a_0000.png"), frame("a_0001.png")];
        let expected = "wrote 2 pictures, a_0000.png to a_0001.png (3.0 kB) in 2.00 s";
        assert_eq!(summary(&several, 2.0), expected, "several");
        let film = [frame("a.apng"), frame("a.apng")];
        let expected = "wrote 2 pictures as a.apng (8x6, 1.5 kB) in 2.00 s";
        assert_eq!(summary(&film, 2.0), expected, "an animation is one file");
    }

    #[test]
    fn frame_counts_lie_beside_the_file_name_in_the_stats() {
        let json = serde_json::to_value(frame("a.png")).expect("plain data");
        assert_eq!(
            (&json["file"], &json["points"]),
            (&"a.png".into(), &3.into()),
            "{json}"
        );
        assert!(
            json["stages"].is_object() && json.get("line").is_none(),
            "keys, but no text: {json}"
        );
        assert_eq!(
            stage_line(&frame("a.png")),
            "a.png: 3 points",
            "the line for people"
        );
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn memory_high_water_mark_is_plausible() {
        let peak = peak_bytes().expect("Linux tells");
        assert!(peak > 1 << 18, "a process holds more than {peak} bytes");
    }

    #[test]
    fn after_a_panic_messages_are_printed_again() {
        let panicked = std::panic::catch_unwind(|| heard(|| panic!("on purpose")));
        assert!(panicked.is_err());
        assert!(HEARD.with_borrow(Option::is_none));
    }

    #[test]
    fn equal_notes_are_said_once_whatever_place_they_are_of() {
        let mut notes = Notes::default();
        let (_, lines) = heard(|| {
            notes.say_of("a.png", "no unit".into());
            notes.say_of("b.png", "no unit".into());
            notes.say_of("b.png", "upside down".into());
            notes.say("warning: empty");
            notes.say("warning: empty");
        });
        assert_eq!(
            lines,
            [
                "note: a.png: no unit",
                "note: b.png: upside down",
                "warning: empty"
            ]
        );
    }
}
