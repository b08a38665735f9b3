//! Where the real test data lies, and how a test says that it is not there.
//!
//! Takes the environment and gives a folder. The data is large and not part of the repository, so a test
//! that wants it asks [`data_dir`] first, and when the answer is `None` calls [`skipped`] and returns. A skip is thus
//! always visible in the output of `cargo test -- --nocapture`, and never a failure.
//!
//! Limits: only the existence of the folder is checked; a test checks its own files with [`data_file`].

use std::path::{Path, PathBuf};

/// The environment variable that names the data folder.
pub const DATA_VARIABLE: &str = "RESAMPLE_DATA";

/// Where the data lies when the variable is not set, seen from the workspace root.
const DEFAULT_FOLDER: &str = "../shared/data";

/// The folder with the real test data: `RESAMPLE_DATA` if set, else `../shared/data` beside the workspace root.
///
/// `None` if that folder does not exist. A relative path in the variable counts from the workspace root, because that
/// is where `cargo test` is typed. A variable that is set never falls back to the default folder, so that an absent
/// folder can be named on purpose to run without data.
pub fn data_dir() -> Option<PathBuf> {
    let named = std::env::var_os(DATA_VARIABLE)
        .map_or_else(|| PathBuf::from(DEFAULT_FOLDER), PathBuf::from);
    let folder = workspace_root().join(named);
    folder.is_dir().then_some(folder)
}

/// A file of the data folder by its path inside it, such as `volumes/engine/engine.nhdr`.
///
/// Prints the skip line for `test` and gives `None` if the folder or the file is absent.
pub fn data_file(test: &str, relative: &str) -> Option<PathBuf> {
    let path = data_dir()
        .map(|folder| folder.join(relative))
        .filter(|path| path.is_file());
    if path.is_none() {
        skipped(&format!(
            "{test}: {relative} is absent (set {DATA_VARIABLE} to the data folder)"
        ));
    }
    path
}

/// Prints the visible line `skipped: <what>` for a test that cannot run here.
pub fn skipped(what: &str) {
    eprintln!("skipped: {what}");
}

/// The parent of this package's folder.
fn workspace_root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_absent_file_is_none() {
        assert_eq!(
            data_file("the test of data_file", "no/such/file"),
            None,
            "an absent file must be skipped"
        );
    }

    #[test]
    fn the_workspace_root_holds_the_workspace_manifest() {
        let manifest =
            std::fs::read_to_string(workspace_root().join("Cargo.toml")).expect("root manifest");
        assert!(
            manifest.contains("[workspace]"),
            "{} is not the workspace root",
            workspace_root().display()
        );
    }
}
