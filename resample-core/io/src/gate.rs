//! The gate: which files may be read, which were, and how much memory reading them may take.
//!
//! A name inside a file is a claim of whoever wrote that file. It is followed into the folder of the file that was typed
//! and the folders below it, and nowhere else, unless the user allows it. Every file that is found through such a name is
//! noted, so that nothing that was read is written over. Before packed data is unpacked, its size is held against a budget.

use std::collections::HashSet;
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use crate::memory;

/// Permission for names inside files to lead out of their folder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Outside {
    /// They may not.
    #[default]
    Refused,
    /// They may.
    Allowed,
}

/// How much memory the data of files may take, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Budget {
    /// A share of the machine's memory; data that looks like a bomb is refused earlier.
    Usual(u64),
    /// Set explicitly; the expansion limit does not apply.
    Given(u64),
}

/// The rules of reading, and a note of the files read. A clone shares the notes.
#[derive(Clone, Debug)]
pub struct Gate {
    outside: Outside,
    budget: Budget,
    files: Arc<Mutex<Noted>>,
    remarks: Arc<Mutex<Vec<String>>>,
}

/// Files in the order in which they were first noted.
#[derive(Debug, Default)]
struct Noted {
    known: HashSet<PathBuf>,
    in_order: Vec<PathBuf>,
}

/// Unpacked data up to this size is never called a bomb, bytes. A guess: it unpacks within half a second.
const HARMLESS_BYTES: u64 = 256 << 20;

/// Data that unpacks to more times its size is called a bomb, if it is large as well. Deflate reaches 1032, on zeros alone;
/// label maps, the emptiest real volumes that were measured, reach 200.
const USUAL_EXPANSION: u64 = 500;

/// Data that does not say its size may unpack to this many times its own. Numbers of pictures reach 5, masks 15.
const UNSTATED_EXPANSION: u64 = 20;

impl Default for Gate {
    fn default() -> Self {
        Self::new(Outside::default(), None)
    }
}

/// Two gates are equal if they let the same through.
impl PartialEq for Gate {
    fn eq(&self, other: &Self) -> bool {
        (self.outside, self.budget) == (other.outside, other.budget)
    }
}

impl Gate {
    /// A gate with a budget in bytes; without one, it is three quarters of the memory that this process may use.
    ///
    /// ```
    /// use resample_io::{Gate, Outside};
    ///
    /// let gate = Gate::new(Outside::Refused, Some(1_000_000));
    /// assert!(gate.ask(2_000_000, "a large array").is_err());
    /// assert!(gate.ask(500_000, "a small array").is_ok());
    /// ```
    pub fn new(outside: Outside, max_memory: Option<u64>) -> Self {
        let budget =
            max_memory.map_or_else(|| Budget::Usual(memory::usual_budget()), Budget::Given);
        Self {
            outside,
            budget,
            files: Arc::default(),
            remarks: Arc::default(),
        }
    }

    /// The file that `name` means, which stands in a file of `folder`; relative names count from there.
    ///
    /// `root` is the folder of the file that was typed. The error says why the name is not followed, and what to do.
    pub fn named_file(&self, name: &str, folder: &Path, root: &Path) -> Result<PathBuf, String> {
        if name.contains("://") {
            return Err(format!(
                "'{}' is a network name: fetch the file first",
                shown(name)
            ));
        }
        let path = folder.join(name);
        if self.outside == Outside::Refused && leads_out(&path, name, root) {
            return Err(format!(
                "'{}' points outside {}; move the file inside or allow outside paths (--allow-outside)",
                shown(name),
                here(root).display()
            ));
        }
        self.note(&path);
        Ok(path)
    }

    /// Notes a file that is read beside the one that was typed; one that is named many times is noted once.
    pub fn note(&self, path: &Path) {
        let mut noted = self.noted();
        if noted.known.insert(path.to_owned()) {
            noted.in_order.push(path.to_owned());
        }
    }

    /// Remarks on what a reader had to decide, for the person who reads the file; each is kept once.
    ///
    /// ```
    /// use resample_io::Gate;
    ///
    /// let gate = Gate::default();
    /// gate.remark("a.nrrd: one axis is mirrored".to_owned());
    /// assert_eq!(gate.remarks().len(), 1);
    /// ```
    pub fn remark(&self, text: String) {
        let mut remarks = self.remarks.lock().unwrap_or_else(PoisonError::into_inner);
        if !remarks.contains(&text) {
            remarks.push(text);
        }
    }

    /// The remarks so far.
    pub fn remarks(&self) -> Vec<String> {
        let remarks = self.remarks.lock().unwrap_or_else(PoisonError::into_inner);
        remarks.clone()
    }

    /// How much memory the data of files may take, bytes.
    pub fn max_memory(&self) -> u64 {
        let (Budget::Usual(bytes) | Budget::Given(bytes)) = self.budget;
        bytes
    }

    /// The memory that the user allowed, bytes.
    ///
    /// ```
    /// use resample_io::Gate;
    ///
    /// assert_eq!(Gate::default().given_memory(), None);
    /// ```
    pub fn given_memory(&self) -> Option<u64> {
        match self.budget {
            Budget::Usual(_) => None,
            Budget::Given(bytes) => Some(bytes),
        }
    }

    /// The files that were noted.
    pub fn files(&self) -> Vec<PathBuf> {
        self.noted().in_order.clone()
    }

    /// Asks for memory. The error says how much there is.
    pub fn ask(&self, bytes: u64, what: &str) -> Result<(), String> {
        let budget = self.max_memory();
        if bytes <= budget {
            return Ok(());
        }
        let origin = match self.budget {
            Budget::Usual(_) => "three quarters of what this process may have",
            Budget::Given(_) => "as --max-memory says",
        };
        let (bytes, budget) = (memory::human(bytes), memory::human(budget));
        Err(format!(
            "{what} take {bytes} of memory, at most {budget} may be used ({origin}): allow more with --max-memory, or make it smaller"
        ))
    }

    /// Asks for the memory of data that `packed` bytes unpack to.
    pub fn ask_unpacked(&self, unpacked: u64, packed: u64, what: &str) -> Result<(), String> {
        self.ask(unpacked, what)?;
        let is_usual = unpacked <= HARMLESS_BYTES.max(packed.saturating_mul(USUAL_EXPANSION));
        if is_usual || self.given_memory().is_some() {
            return Ok(());
        }
        Err(format!(
            "{what} take {} unpacked, more than {USUAL_EXPANSION} times the {} of the file: if that is meant, allow it with \
             --max-memory",
            memory::human(unpacked),
            memory::human(packed)
        ))
    }

    /// The most bytes that `packed` bytes may unpack to, for data that does not say its size.
    pub fn most_unpacked(&self, packed: u64) -> u64 {
        match self.budget {
            Budget::Usual(budget) => packed
                .saturating_mul(UNSTATED_EXPANSION)
                .max(HARMLESS_BYTES)
                .min(budget),
            Budget::Given(budget) => budget,
        }
    }

    fn noted(&self) -> std::sync::MutexGuard<'_, Noted> {
        // A list of names is sound whatever a thread did that panicked.
        self.files.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Returns true if a path lies outside of a folder: as the system resolves it, or as it is spelt where nothing is there yet.
fn leads_out(path: &Path, name: &str, root: &Path) -> bool {
    match (path.canonicalize(), here(root).canonicalize()) {
        (Ok(path), Ok(root)) => !path.starts_with(root),
        _ => !stays_below(Path::new(name)),
    }
}

/// Returns true if a relative name never climbs above where it starts.
fn stays_below(name: &Path) -> bool {
    let mut depth = 0i32;
    name.components().all(|component| {
        depth += match component {
            Component::Normal(_) => 1,
            Component::CurDir => 0,
            Component::ParentDir => -1,
            Component::RootDir | Component::Prefix(_) => return false,
        };
        depth >= 0
    })
}

/// The folder of a bare name is the current one.
fn here(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    }
}

/// The start of a name, short enough for a message.
fn shown(name: &str) -> String {
    const LONGEST: usize = 80;
    match name.char_indices().nth(LONGEST) {
        Some((at, _)) => format!("{}...", &name[..at]),
        None => name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_in_the_folder_of_the_file_that_was_typed() {
        let folder = tempfile::tempdir().expect("a folder");
        let root = folder.path().join("model");
        std::fs::create_dir_all(root.join("tex")).expect("folders");
        for file in ["outside.png", "model/a.png", "model/tex/b.png"] {
            std::fs::write(folder.path().join(file), "").expect("written");
        }
        let gate = Gate::default();
        let named = |name: &str, from: &Path| gate.named_file(name, from, &root);
        assert!(named("a.png", &root).is_ok() && named("tex/b.png", &root).is_ok());
        assert!(
            named("../a.png", &root.join("tex")).is_ok(),
            "up, and still inside"
        );
        for bad in [
            "../outside.png",
            "/etc/passwd",
            "../absent.png",
            "http://host/a.png",
            "tex/../../outside.png",
        ] {
            assert!(named(bad, &root).is_err(), "{bad} leads out");
        }
        assert_eq!(gate.files().len(), 3, "refused names are not read");
        (0..1000).for_each(|_| assert!(named("a.png", &root).is_ok()));
        assert_eq!(gate.files().len(), 3, "each file is noted once");
        let open = Gate::new(Outside::Allowed, None);
        assert!(
            open.named_file("../outside.png", &root, &root).is_ok(),
            "allowed"
        );
    }

    #[cfg(unix)]
    #[test]
    fn a_link_that_leads_out_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let root = folder.path().join("model");
        std::fs::create_dir(&root).expect("a folder");
        std::fs::write(folder.path().join("secret"), "").expect("written");
        std::os::unix::fs::symlink(folder.path().join("secret"), root.join("a.raw"))
            .expect("a link");
        let refused = Gate::default().named_file("a.raw", &root, &root);
        assert!(refused.is_err_and(|what| what.contains("--allow-outside")));
    }

    #[test]
    fn data_that_does_not_say_its_size_gets_a_share_of_its_file() {
        let given = Gate::new(Outside::Refused, Some(5 << 30));
        assert_eq!(given.most_unpacked(1), 5 << 30, "as was typed");
        let usual = Gate::default();
        assert_eq!(
            usual.most_unpacked(1),
            HARMLESS_BYTES.min(usual.max_memory())
        );
        assert_eq!(usual.most_unpacked(u64::MAX), usual.max_memory());
    }

    #[test]
    fn bombs_are_refused_until_memory_is_given() {
        let (usual, given) = (Gate::default(), Gate::new(Outside::Refused, Some(8 << 30)));
        let (packed, unpacked) = (1 << 20, 1 << 30);
        let asked = usual.ask_unpacked(unpacked, packed, "the voxels");
        assert!(
            asked.is_err_and(|what| what.contains("--max-memory")),
            "1024 times"
        );
        assert!(
            usual.ask_unpacked(HARMLESS_BYTES, 1, "the voxels").is_ok(),
            "small"
        );
        assert!(
            given.ask_unpacked(unpacked, packed, "the voxels").is_ok(),
            "given"
        );
        assert!(
            given.ask(9 << 30, "the voxels").is_err(),
            "beyond what is given"
        );
    }
}
