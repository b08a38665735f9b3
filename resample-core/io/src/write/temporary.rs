//! Temporary files: everything is written to one in the target's own folder, which is renamed when it is complete.
//!
//! They are listed, so that a run that is interrupted can remove them. Those that killed runs have left are swept up.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::NamedTempFile;

/// The beginning of every temporary file's name.
const PREFIX: &str = ".resample-";

/// The end of every temporary file's name.
const SUFFIX: &str = ".tmp";

/// Files that must not outlive the process.
static TEMPORARY: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// A temporary file that is listed for removal; its end takes it off the list.
#[derive(Debug)]
pub struct Listed {
    path: PathBuf,
}

/// A temporary file in a folder, removed also by a run that is interrupted.
pub fn temporary_file(folder: &Path) -> std::io::Result<(NamedTempFile, Listed)> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    // A temporary file is private by default; a picture has the permissions of any other new file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    // The list is locked meanwhile, so that no interruption can fall in between.
    let mut list = listed();
    let file = builder.tempfile_in(folder)?;
    // The lock says that somebody still writes to it. Where the system knows no locks, nothing is swept up.
    let _ = file.as_file().try_lock();
    let path = file.path().to_owned();
    list.insert(path.clone());
    Ok((file, Listed { path }))
}

/// Removes temporary files that killed runs have left in a folder: those that nobody has locked.
pub(super) fn sweep(folder: &Path) {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let is_ours = |name: &str| name.starts_with(PREFIX) && name.ends_with(SUFFIX);
    for entry in entries.filter(|entry| entry.file_name().to_str().is_some_and(is_ours)) {
        let path = entry.path();
        // To open a pipe would wait for whoever writes to it.
        if !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        let is_left = fs::File::open(&path).is_ok_and(|file| file.try_lock().is_ok());
        if is_left {
            // It may be gone already, which is as good.
            let _ = fs::remove_file(path);
        }
    }
}

/// The folder of a path; a bare name lies in the current one.
pub(super) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Returns true if a name means the standard output.
pub(super) fn is_stdout(path: &Path) -> bool {
    path == Path::new("-")
}

/// Removes every temporary file and ends the process with an exit code. No file can be made any more meanwhile.
pub fn remove_all_and_exit(code: i32) -> ! {
    let list = listed();
    for path in list.iter() {
        // It may be gone or renamed already, which is as good.
        let _ = fs::remove_file(path);
    }
    std::process::exit(code)
}

impl Drop for Listed {
    fn drop(&mut self) {
        listed().remove(&self.path);
    }
}

fn listed() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    // A set of names is sound whatever a thread did that panicked.
    TEMPORARY.lock().unwrap_or_else(PoisonError::into_inner)
}
