//! Files of metadata.

use std::path::Path;

use resample_io::files::read_small;
use serde_json::Value;

use crate::Error;
use crate::input::{cannot_read, invalid};

/// Largest file of metadata, bytes: consolidated metadata of a whole screen has a few megabytes. A guess.
const MAX_BYTES: u64 = 64 << 20;

/// Reads a file of metadata; `None` where the file is missing.
pub(crate) fn json(path: &Path) -> Result<Option<Value>, Error> {
    let text = match read_small(path, MAX_BYTES) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(cannot_read(path, source)),
    };
    let value: Value = serde_json::from_slice(&text)
        .map_err(|error| invalid(path, format!("not JSON: {error}")))?;
    if !value.is_object() {
        return Err(invalid(path, "expected a JSON object of metadata"));
    }
    Ok(Some(value))
}
