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
