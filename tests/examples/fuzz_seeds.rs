//! Writes the files from which fuzzing begins, and its dictionaries, into a folder for each reader.
//!
//! `cargo run -p resample-tests --example fuzz_seeds -- tests/fuzz/corpus`

use std::path::Path;

use resample_tests::fuzzed::{Reader, seeds};

fn main() -> std::io::Result<()> {
    let root = std::env::args()
        .nth(1)
        .unwrap_or_else(|| "corpus".to_owned());
    for reader in Reader::ALL {
        let folder = Path::new(&root).join(reader.name());
        std::fs::create_dir_all(&folder)?;
        for (name, bytes) in seeds::of(reader) {
            std::fs::write(folder.join(name), bytes)?;
        }
        let words = seeds::words(reader)
            .iter()
            .map(|word| format!("\"{}\"\n", word.replace('"', "\\\"")));
        std::fs::write(folder.with_extension("dict"), words.collect::<String>())?;
    }
    Ok(())
}
