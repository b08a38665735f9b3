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

/// Damaged copies of each seed.
const COPIES: u32 = 400;

#[test]
fn damaged_copies_of_every_seed_are_read_or_refused() {
    for reader in Reader::ALL {
        for (name, bytes) in seeds::of(reader) {
            for copy in 0..COPIES {
                let damaged = damaged(&bytes, copy);
                let read = std::panic::catch_unwind(|| reader.read(&damaged));
                assert!(
                    read.is_ok(),
                    "{} {name}, copy {copy}: {damaged:?}",
                    reader.name()
                );
            }
        }
    }
}

/// A copy with up to four bytes changed, a piece left out or repeated, or its end cut off: the same for the same number.
fn damaged(bytes: &[u8], copy: u32) -> Vec<u8> {
    // The generator of Knuth's MMIX.
    let mut state = u64::from(copy) + 1;
    let mut dice = |sides: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % sides.max(1)
    };
    let mut damaged = bytes.to_vec();
    let (at, length) = (dice(bytes.len()), dice(16) + 1);
    let end = (at + length).min(bytes.len());
    match copy % 4 {
        0 => damaged.truncate(at),
        1 => drop(damaged.drain(at..end)),
        2 => drop(damaged.splice(at..at, bytes[at..end].to_vec())),
        _ => {}
    }
    for _ in 0..=copy % 4 {
        let at = dice(damaged.len());
        if let Some(byte) = damaged.get_mut(at) {
            // Ends of ranges break more than other values do.
            *byte = [0, 1, 0x7F, 0x80, 0xFF, b'0', b'9', b'-'][dice(8)];
        }
    }
    damaged
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
