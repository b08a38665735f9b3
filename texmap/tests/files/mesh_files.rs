//! The mesh files of the test data: takes nothing, gives their folder, and every file in it in one order.

use std::path::{Path, PathBuf};

/// The folder; `None`, and a line that says so, where it is absent.
pub(crate) fn folder() -> Option<PathBuf> {
    let data = std::env::var_os("RESAMPLE_DATA").map(PathBuf::from);
    let data =
        data.unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"));
    let folder = data.join("meshes");
    if !folder.is_dir() {
        println!("skipped: {} is not there", folder.display());
        return None;
    }
    Some(folder)
}

/// Adds the mesh files below a folder, sorted.
pub(crate) fn mesh_files(folder: &Path, files: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut paths: Vec<_> = entries
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.sort();
    for path in paths {
        let extension = path.extension().map(|e| e.to_ascii_lowercase());
        match extension.as_ref().and_then(|e| e.to_str()) {
            _ if path.is_dir() => mesh_files(&path, files),
            Some("gltf" | "glb" | "obj") => files.push(path),
            _ => {}
        }
    }
}
