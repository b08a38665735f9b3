//! The files of a Zarr store: in a folder, or the members of a ZIP archive (`.zarr.zip`, `.ozx`).
//!
//! Takes the path of either; files of an archive are named as if it were a folder. All members may lie in one folder within the archive.
//! Source: the ZipStore of zarr-python, and RFC-9 of OME-NGFF for `.ozx`. Limits: archives up to 4 GiB, members stored or deflated.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use resample_io::Gate;
use resample_io::files::{first_bytes, open_regular, read_small, read_whole};

use crate::Error;
use crate::input::cannot_read;
use crate::input::decode::zip::{Archive, MAGIC};
use crate::input::file::Fault;

/// Files whose presence makes a folder a Zarr store.
const MARKS: [&str; 4] = ["zarr.json", ".zarray", ".zgroup", ".zattrs"];

/// Endings of the names of archives that are looked into.
const ENDINGS: [&str; 2] = ["zip", "ozx"];

/// The files of a store.
pub(crate) struct Store {
    root: PathBuf,
    archive: Option<Members>,
}

/// The members of an archive.
struct Members {
    archive: Mutex<Archive>,
    gate: Gate,
    /// Unpacked bytes by name.
    bytes: HashMap<String, u64>,
    /// The folder of the archive that everything lies in, with a slash behind it; or nothing.
    within: String,
}

/// Returns true if a folder or an archive is a Zarr store.
pub(crate) fn begins(path: &Path) -> bool {
    if path.is_dir() {
        return MARKS.iter().any(|mark| path.join(mark).is_file());
    }
    is_archive(path) && Members::open(path, &Gate::default()).is_ok_and(|found| found.is_some())
}

/// Returns true if a path's ending is that of an archive.
fn is_archive(path: &Path) -> bool {
    let ending = path.extension().and_then(|ending| ending.to_str());
    ending.is_some_and(|ending| ENDINGS.iter().any(|of| ending.eq_ignore_ascii_case(of)))
}

impl Store {
    /// The store at a path.
    pub(crate) fn open(path: &Path, gate: &Gate) -> Result<Self, Error> {
        let archive = match is_archive(path) && !path.is_dir() {
            true => Members::open(path, gate).map_err(|fault| fault.at(path))?,
            false => None,
        };
        Ok(Self {
            root: path.to_owned(),
            archive,
        })
    }

    /// The folder or the archive.
    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// Returns true if there is a file at a path that begins with the store's own.
    pub(crate) fn holds(&self, path: &Path) -> bool {
        match &self.archive {
            Some(members) => members.bytes.contains_key(&self.name(members, path)),
            None => path.is_file(),
        }
    }

    /// Bytes of a file.
    pub(crate) fn bytes(&self, path: &Path) -> Result<u64, Error> {
        if let Some(members) = &self.archive {
            let bytes = members.bytes.get(&self.name(members, path));
            return Ok(bytes.copied().unwrap_or(0));
        }
        let file = std::fs::metadata(path).map_err(|source| cannot_read(path, source))?;
        Ok(file.len())
    }

    /// The bytes of a file.
    pub(crate) fn read(&self, path: &Path) -> Result<Vec<u8>, Error> {
        match &self.archive {
            Some(members) => members
                .read(&self.name(members, path))
                .map_err(|fault| fault.at(&self.root)),
            None => read_whole(path).map_err(|source| cannot_read(path, source)),
        }
    }

    /// The bytes of a file of at most so many; `None` where it is missing.
    pub(crate) fn read_small(&self, path: &Path, most: u64) -> Result<Option<Vec<u8>>, Error> {
        if self.archive.is_some() {
            let fits = self.holds(path) && self.bytes(path)? <= most;
            return fits.then(|| self.read(path)).transpose();
        }
        match read_small(path, most) {
            Ok(text) => Ok(Some(text)),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(source) => Err(cannot_read(path, source)),
        }
    }

    /// The member of a path.
    fn name(&self, members: &Members, path: &Path) -> String {
        let below = path.strip_prefix(&self.root).unwrap_or(path);
        let parts: Vec<_> = below.iter().map(|part| part.to_string_lossy()).collect();
        format!("{}{}", members.within, parts.join("/"))
    }
}

impl Members {
    /// The members of an archive; `None` where it is no Zarr store.
    fn open(path: &Path, gate: &Gate) -> Result<Option<Self>, Fault> {
        let broken = |error: std::io::Error| Fault::Invalid(error.to_string());
        let head = first_bytes(path, MAGIC.len() as u64);
        if head.map_err(|error| Fault::Invalid(error.to_string()))? != MAGIC {
            return Ok(None);
        }
        let (file, held) = open_regular(path).map_err(broken)?;
        let archive = Archive::open(file, held)?;
        let bytes: HashMap<String, u64> = archive
            .members()
            .map(|(name, bytes)| (name.to_owned(), bytes))
            .collect();
        let is_root = |within: &str| {
            MARKS
                .iter()
                .any(|mark| bytes.contains_key(&format!("{within}{mark}")))
        };
        let folder = archive.members().next().and_then(|(name, _)| {
            let (folder, _) = name.split_once('/')?;
            Some(format!("{folder}/"))
        });
        let within = [String::new()].into_iter().chain(folder);
        let found = within.into_iter().find(|within| is_root(within));
        Ok(found.map(|within| Self {
            archive: Mutex::new(archive),
            gate: gate.clone(),
            bytes,
            within,
        }))
    }

    fn read(&self, name: &str) -> Result<Vec<u8>, Fault> {
        let archive = self.archive.lock();
        archive
            .unwrap_or_else(PoisonError::into_inner)
            .read(name, &self.gate)
    }
}
