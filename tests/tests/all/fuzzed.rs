//! Readers on the files from which fuzzing begins, on damaged copies of them, and on what fuzzing found.

use std::collections::BTreeMap;

use resample_tests::fuzzed::{Reader, seeds};

#[test]
fn every_seed_is_a_good_file_unless_it_is_cut() {
    let mut wrong = BTreeMap::new();
    for reader in Reader::ALL {
        for (name, bytes) in seeds::of(reader) {
            let read = reader.read(&bytes);
            if read.is_ok() == name.ends_with(".cut") {
                wrong.insert(format!("{} {name}", reader.name()), read);
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// The message with which a file that fuzzing found is refused.
fn refusal(reader: Reader, bytes: &[u8]) -> String {
    reader.read(bytes).expect_err("this file must be refused")
}

#[test]
fn zarr_metadata_that_is_no_object_is_refused() {
    for metadata in ["\"a text\"", "7", "[]", "null"] {
        let file = seeds::packed(&[("zarr.json", metadata.as_bytes())]);
        let why = refusal(Reader::Zarr, &file);
        assert!(why.contains("expected a JSON object"), "{why}");
    }
    let file = seeds::packed(&[("zarr.json", br#"{"attributes":"a text"}"#)]);
    assert!(refusal(Reader::Zarr, &file).contains("multiscales"));
}

#[test]
fn a_binary_model_without_cameras_is_refused() {
    let why = refusal(Reader::Cameras, &[0; 8]);
    assert!(why.contains("no camera"), "{why}");
}
