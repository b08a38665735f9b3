//! The files of `docs/examples`: each is read and draws something.

use std::fs;
use std::path::Path;

use super::{Bench, assert_good, read_png, stderr};

#[test]
fn every_example_file_draws() {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/examples"));
    let entries = fs::read_dir(folder).expect("the examples");
    let mut names: Vec<String> = entries
        .map(|entry| {
            entry
                .expect("readable")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .filter(|name| name != "README.md")
        .collect();
    names.sort();
    let listed = fs::read_to_string(folder.join("README.md")).expect("the list");
    for name in &names {
        assert!(
            listed.contains(&format!("`{name}`")),
            "{name} is not listed"
        );
        let bench = Bench::new();
        let path = folder.join(name);
        let path = path.display();
        let words = match name.as_str() {
            "camera.json" | "calibrated.json" => format!("--camera {path} -o out/a.png"),
            "path.json" => format!("--path {path} --fps 20 --size 48x48 -o out/a_%d.png"),
            _ => format!("--transfer {path} --size 48x48 -o out/a.png"),
        };
        let output = bench.draw(&words);
        assert_good(&output);
        assert!(
            !stderr(&output).contains("warning"),
            "{name}: {}",
            stderr(&output)
        );
        let first = bench.path(&format!("out/{}", bench.written()[0]));
        let (_, _, pixels) = read_png(&first);
        let seen = pixels.chunks(4).filter(|pixel| pixel[3] > 0).count();
        assert!(seen > 20, "{name}: {seen} pixels show something");
    }
    assert!(names.len() >= 7, "{names:?}");
}
