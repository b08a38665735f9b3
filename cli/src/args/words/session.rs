//! Sessions: files of the words that draw a view, as the viewer saves them.
//!
//! `--session FILE` stands for these words; options that are typed as well win. Names of files count from the current folder.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::path::Path;

use anyhow::{Context, Result, bail};
use resample_io::files::read_small;
use serde::Deserialize;
use serde_json::Value;

/// The mark of a session.
pub(crate) const FORMAT: &str = "resample session 1";

/// Largest file, bytes: a transfer function of a thousand knots has 100 kB.
const MAX_BYTES: u64 = 16 << 20;

/// A session as it is stored.
#[derive(Deserialize)]
struct Session {
    format: String,
    /// The command and its words, without the name of a picture.
    words: Vec<String>,
    /// The state of the viewer's page.
    #[serde(default)]
    page: Value,
}

/// The words with those of a session in place of its name. `view` still hears the name, for the state of the page.
pub(crate) fn expanded(words: Vec<OsString>) -> Result<Vec<OsString>> {
    let Some((place, count, path)) = named(&words) else {
        return Ok(words);
    };
    let session = read(Path::new(&path))?;
    let [command, first @ ..] = session.words.as_slice() else {
        bail!("{}: a session without words", path.display());
    };
    let typed: BTreeSet<&str> = words
        .iter()
        .filter_map(|word| option(word.to_str()?))
        .collect();
    let named = words.get(1).and_then(|word| word.to_str());
    // Without a command it is that of the session.
    let (named, begin) = match named.filter(|word| !word.starts_with('-')) {
        Some(named) => (named, 2),
        None => (command.as_str(), 1),
    };
    if named != "view" && named != command {
        bail!(
            "{}: a session of `resample {command}`, not of `resample {named}`",
            path.display()
        );
    }
    let mut all = vec![words[0].clone(), named.into()];
    // Files that are typed take the place of the session's: names come before options.
    let is_name = |word: &&OsString| !word.to_string_lossy().starts_with('-');
    let files = words[begin..place].iter().take_while(is_name).count();
    all.extend_from_slice(&words[begin..begin + files]);
    let mut is_kept = files == 0;
    for word in first {
        is_kept = option(word).map_or(is_kept, |name| !typed.contains(name));
        all.extend(is_kept.then(|| word.into()));
        // Values of several words follow their option; behind `=` stands the only one.
        is_kept |= option(word).is_some() && word.contains('=');
    }
    all.extend_from_slice(&words[begin + files..place]);
    all.extend_from_slice(&words[place + count..]);
    if named == "view" {
        all.extend([OsString::from("--session"), path]);
    }
    Ok(all)
}

/// The state of the viewer's page in a session.
pub(crate) fn page(path: &Path) -> Result<Value> {
    Ok(read(path)?.page)
}

/// The place of `--session` among the words, how many words it takes, and the name of its file.
fn named(words: &[OsString]) -> Option<(usize, usize, OsString)> {
    let place = words.iter().position(|word| {
        let word = word.to_string_lossy();
        word == "--session" || word.starts_with("--session=")
    })?;
    let word = words[place].to_string_lossy();
    match word.strip_prefix("--session=") {
        Some(path) => Some((place, 1, path.into())),
        None => Some((place, 2, words.get(place + 1)?.clone())),
    }
}

/// The long name of an option, without dashes; `None` for other words.
fn option(word: &str) -> Option<&str> {
    let name = word.strip_prefix("--")?;
    Some(name.split_once('=').map_or(name, |(name, _)| name))
}

fn read(path: &Path) -> Result<Session> {
    let name = path.display().to_string();
    let bytes = read_small(path, MAX_BYTES).with_context(|| name.clone())?;
    let session: Session = serde_json::from_slice(&bytes)
        .with_context(|| format!("{name}: expected a session that `resample view` has saved"))?;
    if session.format != FORMAT {
        bail!(
            "{name}: the format is {:?}, expected {FORMAT:?}",
            session.format
        );
    }
    Ok(session)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<OsString> {
        text.split(' ').map(OsString::from).collect()
    }

    #[test]
    fn typed_options_win_over_those_of_the_session() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("s.json");
        let stored = serde_json::json!({
            "format": FORMAT,
            "words": ["volsplat", "a.nrrd", "--window=1,2", "--size=9x9", "--also", "b.nrrd", "red"],
            "page": { "keys": [1] },
        });
        std::fs::write(&path, stored.to_string()).expect("written");
        let name = path.display();
        let all = expanded(words(&format!(
            "resample volsplat --session {name} --size 5x5 -o b.png"
        )));
        assert_eq!(
            all.expect("a session"),
            words("resample volsplat a.nrrd --window=1,2 --also b.nrrd red --size 5x5 -o b.png")
        );
        let all = expanded(words(&format!("resample view --session={name}"))).expect("a session");
        let view = format!(
            "resample view a.nrrd --window=1,2 --size=9x9 --also b.nrrd red --session {name}"
        );
        assert_eq!(all, words(&view));
        assert_eq!(page(&path).expect("a page")["keys"][0], 1);
        let all = expanded(words(&format!("resample --session {name} -o b.png")));
        let drawn = "resample volsplat a.nrrd --window=1,2 --size=9x9 --also b.nrrd red -o b.png";
        assert_eq!(all.expect("the session's command"), words(drawn));
        let all = expanded(words(&format!(
            "resample volsplat c.nrrd --session {name} -o b.png"
        )));
        assert_eq!(
            all.expect("another file"),
            words(&drawn.replace("a.nrrd", "c.nrrd"))
        );
        let all = expanded(words(&format!(
            "resample volsplat --session {name} --also c.nrrd blue --window=3,4 -o b.png"
        )));
        let drawn = "resample volsplat a.nrrd --size=9x9 --also c.nrrd blue --window=3,4 -o b.png";
        assert_eq!(all.expect("options of several words"), words(drawn));
        let other = expanded(words(&format!("resample texmap --session {name} -o b.png")));
        assert!(other.is_err_and(|error| error.to_string().contains("not of `resample texmap`")));
        std::fs::write(&path, "{}").expect("written");
        assert!(page(&path).is_err_and(|error| error.to_string().contains("expected a session")));
    }
}
