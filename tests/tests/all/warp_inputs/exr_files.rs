//! Real EXR files: damaged ones, windows that do not fit, every half, NaN and infinity.

use std::path::PathBuf;

use exr::meta::MetaData;
use resample_tests::data;
use warp3d::input::{Part, colour, depth};

use super::picture;

fn files(test: &str, folder: &str, name: impl Fn(&str) -> bool) -> Vec<PathBuf> {
    let Some(root) = data::data_dir() else {
        data::skipped(&format!("{test}: no data folder"));
        return Vec::new();
    };
    let folder = root.join("rgbd/openexr").join(folder);
    let Ok(entries) = std::fs::read_dir(&folder) else {
        data::skipped(&format!("{test}: {} is absent", folder.display()));
        return Vec::new();
    };
    let mut files: Vec<_> = entries
        .map(|entry| entry.expect("readable").path())
        .collect();
    files.retain(|path| {
        path.file_name()
            .is_some_and(|file| name(&file.to_string_lossy()))
    });
    files.sort();
    files
}

#[test]
fn damaged_files_are_errors_that_name_the_file() {
    let files = files(
        "damaged_files_are_errors_that_name_the_file",
        "Damaged",
        |name| name != "README.rst",
    );
    let mut read = Vec::new();
    for path in &files {
        let part = Part {
            path: path.clone(),
            name: None,
        };
        for result in [
            colour::read(&part).map(|p| p.rgb.len()),
            depth::read(&part).map(|p| p.values.len()),
        ] {
            match result {
                Ok(pixels) => read.push((path.clone(), pixels)),
                Err(error) => {
                    let said = error.to_string();
                    assert!(
                        said.starts_with(&path.display().to_string()),
                        "the file is not named: {said}"
                    );
                    assert_eq!(said.lines().count(), 1, "one line: {said}");
                }
            }
        }
    }
    assert!(read.is_empty(), "damaged files that pass: {read:?}");
}

#[test]
fn pictures_fill_the_display_window_and_nothing_else() {
    let files = files(
        "pictures_fill_the_display_window_and_nothing_else",
        "DisplayWindow",
        |name| name.ends_with(".exr"),
    );
    let Some(first) = files.first() else { return };
    // In t01 the windows agree, so it shows all pixels.
    let whole = picture(first);
    for path in &files {
        let meta = MetaData::read_from_file(path, false).expect("a good file");
        let header = &meta.headers[0];
        let (display, data) = (
            header.shared_attributes.display_window,
            header.own_attributes.layer_position,
        );
        let picture = picture(path);
        assert_eq!(
            (picture.width, picture.height),
            (display.size.x(), display.size.y()),
            "{}",
            path.display()
        );
        let mut wrong = 0;
        for (index, rgb) in picture.rgb.iter().enumerate() {
            let at = |along: usize, display: i32, data: i32| {
                along as i64 + i64::from(display) - i64::from(data)
            };
            let x = at(index % picture.width, display.position.x(), data.x());
            let y = at(index / picture.width, display.position.y(), data.y());
            let inside =
                (0..whole.width as i64).contains(&x) && (0..whole.height as i64).contains(&y);
            let covered = picture
                .coverage
                .as_ref()
                .is_none_or(|coverage| coverage[index] > 0.0);
            let same = !inside || *rgb == whole.rgb[y as usize * whole.width + x as usize];
            wrong += usize::from(covered != inside || !same);
        }
        assert_eq!(wrong, 0, "{}: pixels in the wrong place", path.display());
    }
}

#[test]
fn every_value_of_a_picture_is_finite() {
    for path in files("every_value_of_a_picture_is_finite", "TestImages", |name| {
        name.ends_with(".exr")
    }) {
        let picture = picture(&path);
        let finite = picture
            .rgb
            .iter()
            .flatten()
            .all(|channel| channel.is_finite());
        assert!(finite, "{}: NaN or infinity is left", path.display());
        assert!(
            picture.width > 1 && picture.height > 1,
            "{}: a picture",
            path.display()
        );
    }
}
