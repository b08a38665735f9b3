//! A model far from the origin is drawn as it is near it.

use glam::DVec3;
use resample_core::{Camera, LookAt};
use texmap::{LoadOptions, RenderOptions, Renderer, Scene, load};

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
