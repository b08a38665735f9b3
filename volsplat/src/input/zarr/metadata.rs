//! Files of metadata.

use std::path::Path;

use serde_json::Value;

use crate::Error;
use crate::input::{cannot_read, invalid};

/// Reads a file of metadata; `None` where the file is missing.
pub(super) fn json(path: &Path) -> Result<Option<Value>, Error> {
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(cannot_read(path, source)),
    };
    serde_json::from_str(&text)
        .map(Some)
        .map_err(|error| invalid(path, format!("not JSON: {error}")))
}
