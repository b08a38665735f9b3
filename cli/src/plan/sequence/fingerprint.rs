//! Fingerprints of numbered pictures: a run that is taken up again keeps what the same options would draw, nothing else.
//!
//! Takes the settings of a run, the files that it reads and a camera, gives sixteen hexadecimal digits that go into the
//! picture's file. Two runs agree if version, settings and cameras agree, and the files in size and in samples of their
//! bytes; neither the names of files nor the machine matter. The digits are no proof: 64 bits of the standard library's
//! hash, which another compiler may change, and a change between two samples of a large file is not seen.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use resample_core::Camera;
use resample_io::files;
use serde_json::Value;

use crate::process::report::RunStats;

/// Bytes of a sample, a page of most systems.
const SAMPLE_BYTES: u64 = 4096;

/// Samples of a file, evenly spread: half a megabyte, under a millisecond where the file has just been read. A guess.
const SAMPLES: u64 = 128;

/// The common part of all pictures of a run.
#[derive(Clone, Debug)]
pub(crate) struct Fingerprint(DefaultHasher);

impl Fingerprint {
    /// The fingerprint of a run that draws with `stats.settings` and reads `files`.
    pub(crate) fn new(stats: &RunStats, files: &[PathBuf]) -> Self {
        let mut settings = stats.settings.clone();
        if let Some(Value::Object(picture)) = settings.get_mut("picture") {
            picture.remove("output");
        }
        let mut hasher = DefaultHasher::new();
        stats.version.hash(&mut hasher);
        settings.to_string().hash(&mut hasher);
        for file in files {
            // Standard input cannot be read twice; a file that is gone was read all the same.
            let _ = sample(file, &mut hasher);
        }
        Self(hasher)
    }

    /// The digits of the picture that `camera` sees.
    pub(crate) fn of_picture(&self, camera: &Camera) -> String {
        let mut hasher = self.0.clone();
        format!("{camera:?}").hash(&mut hasher);
        format!("{:016x}", hasher.finish())
    }
}

/// Adds the size of a file and samples of its bytes, all of them where it is small.
fn sample(path: &Path, hasher: &mut DefaultHasher) -> io::Result<()> {
    let (mut file, length) = files::open_regular(path)?;
    let step = (length / SAMPLES).max(SAMPLE_BYTES);
    length.hash(hasher);
    let mut bytes = Vec::new();
    for start in (0..length).step_by(usize::try_from(step).unwrap_or(usize::MAX)) {
        bytes.clear();
        file.seek(SeekFrom::Start(start))?;
        file.by_ref().take(SAMPLE_BYTES).read_to_end(&mut bytes)?;
        bytes.hash(hasher);
    }
    Ok(())
}
