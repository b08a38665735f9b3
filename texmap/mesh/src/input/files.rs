//! Files on disk, and names of files inside other files.
//!
//! Takes paths and URIs, gives bytes. Only ordinary files are read: what a device or a pipe gives has no end that could
//! be checked. A name inside a file is relative to that file, and the gate says whether it is followed; addresses of the
//! network are not.

use std::path::{Path, PathBuf};

use resample_io::Gate;

use crate::Error;

/// The text behind a byte order mark and white space.
pub(super) fn text_of(bytes: &[u8]) -> &[u8] {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    text.trim_ascii_start()
}

/// Reads a whole file. The error names it.
pub(super) fn read(path: &Path) -> Result<Vec<u8>, Error> {
    let unreadable = |what: &dyn std::fmt::Display| {
        Error::Input(format!("{}: cannot read: {what}", path.display()))
    };
    resample_io::files::read_whole(path).map_err(|error| unreadable(&error))
}

/// Where names inside a file count from, and which of them are followed.
#[derive(Clone, Copy)]
pub(super) struct Names<'a> {
    /// The folder of the file that holds the names.
    pub folder: &'a Path,
    /// The folder of the file that was typed.
    pub root: &'a Path,
    /// The rules of reading.
    pub gate: &'a Gate,
}

impl<'a> Names<'a> {
    /// The file that a name means.
    pub(super) fn file(&self, name: &str) -> Result<PathBuf, String> {
        self.gate.named_file(name, self.folder, self.root)
    }

    /// The place of names in another file.
    pub(super) fn inside<'b>(&self, folder: &'b Path) -> Names<'b>
    where
        'a: 'b,
    {
        Names { folder, ..*self }
    }
}

/// The folder of a file; a bare name lies in the current one.
pub(super) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// The bytes of a `data:` URI, if it is one.
pub(super) fn data_uri(uri: &str) -> Option<Result<Vec<u8>, String>> {
    let rest = uri
        .get(..5)
        .filter(|start| start.eq_ignore_ascii_case("data:"))
        .map(|_| &uri[5..])?;
    let Some((head, data)) = rest.split_once(',') else {
        return Some(Err("a data URI without a comma".into()));
    };
    Some(match head.ends_with(";base64") {
        true => from_base64(data).ok_or_else(|| "a data URI that is no base64".into()),
        false => Ok(percent_decoded(data)),
    })
}

/// The file that a relative URI names.
pub(super) fn resolve(names: &Names, uri: &str) -> Result<PathBuf, String> {
    if uri
        .split_once(':')
        .is_some_and(|(scheme, _)| is_scheme(scheme))
    {
        return Err(format!(
            "'{}' is no file beside this one: only relative names are read",
            excerpt(uri)
        ));
    }
    // A name with a percent sign of its own is tried as it stands.
    if names.folder.join(uri).is_file() {
        return names.file(uri);
    }
    let decoded = String::from_utf8(percent_decoded(uri))
        .map_err(|_| format!("'{}' is no UTF-8", excerpt(uri)))?;
    if decoded.contains('\0') {
        return Err(format!("'{}' is no file name", excerpt(uri)));
    }
    names.file(&decoded)
}

/// The start of a text, short enough for a message.
pub(super) fn excerpt(text: &str) -> String {
    // Long enough for a file name with a folder.
    const LONGEST: usize = 80;
    match text.char_indices().nth(LONGEST) {
        Some((at, _)) => format!("{}...", &text[..at]),
        None => text.to_owned(),
    }
}

/// A letter is a drive of Windows, which is not a relative name either.
fn is_scheme(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic())
        && text
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.'))
}

fn percent_decoded(text: &str) -> Vec<u8> {
    let bytes = text.as_bytes();
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let code = bytes
            .get(at + 1..at + 3)
            .and_then(|hex| std::str::from_utf8(hex).ok());
        let code = code
            .filter(|_| bytes[at] == b'%')
            .and_then(|hex| u8::from_str_radix(hex, 16).ok());
        decoded.push(code.unwrap_or(bytes[at]));
        at += if code.is_some() { 3 } else { 1 };
    }
    decoded
}

/// Base64 with the usual or the URL alphabet; padding and white space are skipped.
fn from_base64(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut count) = (0u32, 0);
    for byte in text
        .bytes()
        .filter(|byte| !matches!(byte, b'=' | b' ' | b'\n' | b'\r' | b'\t'))
    {
        let six = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return None,
        };
        bits = (bits << 6) | u32::from(six);
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
        }
    }
    Some(bytes)
}

/// The names of a file that lies in no folder.
#[cfg(test)]
pub(super) fn nowhere(gate: &Gate) -> Names<'_> {
    Names {
        folder: Path::new("."),
        root: Path::new("."),
        gate,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_uris_are_decoded_or_refused() {
        let data = |uri: &str| data_uri(uri).expect("a data URI");
        assert_eq!(
            data("data:;base64,AAECAwQ="),
            Ok(vec![0, 1, 2, 3, 4]),
            "with padding"
        );
        assert_eq!(
            data("DATA:text/plain,a%20b"),
            Ok(b"a b".to_vec()),
            "percent signs"
        );
        assert!(
            data("data:;base64,A*").is_err() && data("data:;base64").is_err(),
            "broken ones"
        );
        assert!(
            data_uri("a.bin").is_none()
                && data_uri("dat").is_none()
                && data_uri("ddät:x").is_none(),
            "names"
        );
    }

    #[test]
    fn names_stay_relative() {
        let (folder, gate) = (Path::new("models"), Gate::default());
        let names = Names {
            folder,
            root: folder,
            gate: &gate,
        };
        assert_eq!(
            resolve(&names, "a%20b.png"),
            Ok(PathBuf::from("models/a b.png")),
            "decoded"
        );
        for bad in [
            "http://host/a.png",
            "../x/a.png",
            "/etc/passwd",
            "%2Fetc%2Fpasswd",
            "c:/a.png",
            "file:a.png",
            "a%00.png",
        ] {
            assert!(resolve(&names, bad).is_err(), "{bad} must be refused");
        }
        assert_eq!(
            resolve(&names, "100%.png"),
            Ok(PathBuf::from("models/100%.png")),
            "a lone percent sign"
        );
    }
}
