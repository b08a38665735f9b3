//! Telling formats apart, and notes.

use glam::DVec3;
use resample_core::{Camera, LookAt};

use super::notes::MAX_NOTES;
use super::*;
use crate::{RenderOptions, Renderer, Scene};

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

/// A folded panel, as an OBJ whose vertices are that far from the origin.
fn panel(offset: f64) -> Scene {
    let corners = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.3],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.3],
    ];
    let mut text = String::from("f 1 2 3\nf 1 3 4\n");
    for [x, y, z] in corners {
        text = format!("v {} {} {z} {x} {y} 0.5\n{text}", x + offset, y - offset);
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("panel.obj");
    std::fs::write(&path, text).expect("written");
    load(&path, &LoadOptions::default())
        .expect("a good file")
        .scene
}

#[test]
fn far_from_the_origin_a_model_looks_the_same() {
    let drawn = |offset: f64| {
        let centre = DVec3::new(offset + 0.5, 0.5 - offset, 0.0);
        let pose = LookAt {
            position: centre + DVec3::new(0.4, 0.3, 2.0),
            target: centre,
            up: DVec3::Y,
        };
        let camera = Camera::perspective(&pose, 0.7, [96, 96]).expect("a camera");
        let mut renderer = Renderer::new(&panel(offset), &RenderOptions::default()).expect("good");
        renderer.render(&camera).expect("a picture").image.rgba
    };
    let here = drawn(0.0);
    assert!(here.iter().any(|pixel| pixel[3] > 0.9), "something is seen");
    for offset in [1e5, 1e6, 1e7, 1e9] {
        let there = drawn(offset);
        let pairs = here.iter().flatten().zip(there.iter().flatten());
        let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-3, "{offset:e}: a channel changes by {worst}");
    }
}
