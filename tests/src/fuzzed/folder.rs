//! The folder in which a reader finds its files: one for each thread, in memory where the system has such.

use std::cell::OnceCell;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

/// A folder with a handful of files, written again and again.
pub(super) struct Folder(TempDir);

/// The mark before the name of each file that is packed into one.
pub(super) const MARK: &[u8] = b"\n@@";

impl Folder {
    fn new() -> Self {
        // A file system in memory spares the disk millions of writes.
        let memory = Path::new("/dev/shm");
        let folder = if memory.is_dir() {
            tempfile::tempdir_in(memory)
        } else {
            tempfile::tempdir()
        };
        Self(folder.expect("a temporary folder"))
    }

    pub(super) fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).expect("a file in a temporary folder");
        path
    }

    pub(super) fn remove(&self, name: &str) {
        let _ = std::fs::remove_file(self.0.path().join(name));
    }

    /// Writes the files that `bytes` hold, each behind a line with a mark and its name, into an empty folder.
    pub(super) fn unpack(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let root = self.0.path().join(name);
        let _ = std::fs::remove_dir_all(&root);
        std::fs::create_dir_all(&root).expect("a folder in a temporary folder");
        for file in split(bytes, MARK).skip(1) {
            let end = file.iter().position(|&byte| byte == b'\n');
            let Some(end) = end else { continue };
            if let Some(path) = inside(&root, &file[..end]) {
                let folder = path.parent().unwrap_or(&root);
                // A name that is a file and a folder at once is left out.
                let _ = std::fs::create_dir_all(folder);
                let _ = std::fs::write(&path, &file[end + 1..]);
            }
        }
        root
    }
}

/// Calls `read` with the folder of this thread.
pub(super) fn with_folder<T>(read: impl FnOnce(&Folder) -> T) -> T {
    thread_local!(static FOLDER: OnceCell<Folder> = const { OnceCell::new() });
    FOLDER.with(|folder| read(folder.get_or_init(Folder::new)))
}

/// The path of a file below `root`; names that could lead elsewhere are none.
fn inside(root: &Path, name: &[u8]) -> Option<PathBuf> {
    let name = std::str::from_utf8(name).ok()?;
    let is_plain = |part: &str| {
        let known = |c: char| c.is_ascii_alphanumeric() || ".-_".contains(c);
        (1..=16).contains(&part.len()) && part != "." && part != ".." && part.chars().all(known)
    };
    let parts: Vec<&str> = name.split('/').collect();
    (parts.len() <= 8 && parts.iter().all(|part| is_plain(part))).then(|| root.join(name))
}

/// The pieces of `bytes` between marks.
fn split<'a>(bytes: &'a [u8], mark: &'a [u8]) -> impl Iterator<Item = &'a [u8]> {
    let mut rest = Some(bytes);
    std::iter::from_fn(move || {
        let now = rest?;
        let at = now.windows(mark.len()).position(|window| window == mark);
        rest = at.map(|at| &now[at + mark.len()..]);
        Some(at.map_or(now, |at| &now[..at]))
    })
}
