//! Checks of names before any work: the file can be made, and replaces nothing that is read.

use std::collections::HashSet;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use resample_core::Error;

use super::temporary::{folder_of, is_stdout, sweep, temporary_file};

/// Checks that a file can be made at `path`: the folder is there and can be written to, and only a file has
/// that name already.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    if is_stdout(path) {
        return Ok(());
    }
    check_name(path)?;
    // A device or a pipe would be replaced by the renaming, like a file.
    if path.exists() && !path.is_file() {
        return refused(format!(
            "{}: is a folder or a device, expected the name of a file to write",
            path.display()
        ));
    }
    let folder = folder_of(path);
    if !folder.is_dir() {
        return refused(format!(
            "{}: cannot write: the folder {} does not exist",
            path.display(),
            folder.display()
        ));
    }
    sweep(folder);
    temporary_file(folder).map_err(|error| {
        Error::Input(format!(
            "{}: cannot write to the folder {}: {error}",
            path.display(),
            folder.display()
        ))
    })?;
    Ok(())
}

/// Refuses names that the file system does not allow, such as names that are too long.
pub fn check_name(path: &Path) -> Result<(), Error> {
    match path.symlink_metadata() {
        Err(error) if error.kind() == ErrorKind::InvalidFilename => refused(format!(
            "{}: cannot write: {error}: choose a shorter name",
            path.display()
        )),
        // Other errors are those of the folder.
        _ => Ok(()),
    }
}

/// Checks that writing `path` would replace nothing, not even a link that leads nowhere.
pub fn check_new(path: &Path) -> Result<(), Error> {
    if path.symlink_metadata().is_ok() {
        return refused(format!("{} exists: choose another name", path.display()));
    }
    Ok(())
}

/// Checks that writing `output` would not replace a file that is read.
pub fn check_not_input(output: &Path, inputs: &[&Path]) -> Result<(), Error> {
    check_not_inputs([output].into_iter(), inputs)
}

/// Checks that writing `outputs` would not replace a file that is read, or one in a folder that is read.
///
/// Files are compared, and not their names: links and other spellings mean the same file.
pub fn check_not_inputs<'a>(
    outputs: impl Iterator<Item = &'a Path>,
    inputs: &[&Path],
) -> Result<(), Error> {
    // To open a pipe would wait for whoever writes to it.
    let is_file = |path: &&Path| path.is_file();
    let handle = |path: &Path| {
        Some(path)
            .filter(is_file)
            .map(same_file::Handle::from_path)?
            .ok()
    };
    let (folders, files): (Vec<&Path>, Vec<&Path>) = inputs.iter().partition(|path| path.is_dir());
    let files: HashSet<_> = files.into_iter().filter_map(handle).collect();
    let folders: Vec<_> = folders
        .into_iter()
        .filter_map(|folder| folder.canonicalize().ok())
        .collect();
    for output in outputs {
        // An output that does not exist yet overwrites no input.
        let Some(written) = handle(output) else {
            continue;
        };
        let is_inside = |folder: &PathBuf| {
            output
                .canonicalize()
                .is_ok_and(|written| written.starts_with(folder))
        };
        if files.contains(&written) || folders.iter().any(is_inside) {
            return refused(format!(
                "{}: would be replaced, but is read as well: choose another name",
                output.display()
            ));
        }
    }
    Ok(())
}

/// Makes a folder if it is not there; its parent must be.
pub fn make_folder(path: &Path) -> Result<(), Error> {
    if path.is_dir() {
        return Ok(());
    }
    fs::create_dir(path).map_err(|error| {
        Error::Input(format!(
            "{}: cannot make the folder: {error}",
            path.display()
        ))
    })
}

fn refused<T>(text: String) -> Result<T, Error> {
    Err(Error::Input(text))
}
