//! Telling formats apart, and notes.

use super::notes::MAX_NOTES;
use super::*;

fn refusal(content: &[u8]) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("model");
    std::fs::write(&path, content).expect("written");
    let error = load(&path, &LoadOptions::default())
        .expect_err("no good mesh")
        .to_string();
    assert!(
        error.starts_with(&path.display().to_string()),
        "the file is named first: {error}"
    );
    error
}

#[test]
fn foreign_files_are_called_by_their_names() {
    for (content, said) in [
        (&b""[..], "empty"),
        (b"  \n", "empty"),
        (b"ply\nformat ascii 1.0\n", "PLY"),
        (b"solid cube\n", "STL"),
        (b"Kaydara FBX Binary", "FBX"),
        (b"PK\x03\x04abcd", "ZIP"),
        (b"\x89PNG\r\n", "picture"),
        (b"\x00\x01\x02\x03", "known format"),
        (b"glTF", "cut"),
        (b"{", "glTF"),
    ] {
        let error = refusal(content);
        assert!(
            error.contains(said),
            "{content:?}: expected '{said}' in '{error}'"
        );
    }
}

#[test]
fn folders_and_missing_files_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    for path in [folder.path().to_owned(), folder.path().join("nothing.glb")] {
        let error = load(&path, &LoadOptions::default())
            .expect_err("no file")
            .to_string();
        assert!(error.contains("cannot read"), "{error}");
    }
}

#[test]
fn notes_are_said_once_and_come_to_an_end() {
    let mut notes = Notes::default();
    (0..1000).for_each(|i| notes.say(format!("note {}", i / 2)));
    assert_eq!(notes.said.len(), MAX_NOTES + 1, "as many as anybody reads");
    assert_eq!(notes.said[1], "note 1", "each once");
}
