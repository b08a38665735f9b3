//! What stands beside and over the picture: slices, measures, handles of the crop box, and steps over time.

use serde_json::json;
use tungstenite::Message;

use super::super::time_steps::step;
use super::super::{BALL, Bench};
use super::browser::{Browser, open};
use super::page::{Viewer, run_copied, view};

#[test]
fn slices_show_the_voxels_in_the_window() {
    let bench = Bench::new();
    let viewer = Viewer::start(&bench, &format!("ball.raw {BALL}"));
    let mut page = viewer.page();
    let scene = page.hear("scene");
    assert_eq!(scene["volume"]["has_slices"], true);
    let bytes = std::fs::read(bench.path("ball.raw")).expect("the volume");
    let voxel = |x: usize, y: usize, z: usize| f64::from(bytes[x + 32 * (y + 32 * z)]);
    let [low, high] = [40.0, 140.0];
    for (axis, index) in [(0, 20), (1, 3), (2, 16)] {
        page.say(&json!({ "type": "slice", "axis": axis, "index": index, "window": [low, high] }));
        let (head, png) = loop {
            if let Message::Binary(bytes) = page.read() {
                break page.shown(&bytes);
            }
        };
        assert_eq!(
            (&head["kind"], &head["name"]),
            (&json!("slice"), &json!(axis.to_string()))
        );
        let image = image::load_from_memory(&png).expect("a PNG").to_rgb8();
        for (column, row, pixel) in image.enumerate_pixels() {
            let (column, row) = (column as usize, row as usize);
            let value = match axis {
                0 => voxel(index, column, 31 - row),
                1 => voxel(column, index, 31 - row),
                _ => voxel(column, row, index),
            };
            let expected = (255.0 * (value - low) / (high - low)).clamp(0.0, 255.0);
            for code in pixel.0 {
                let error = (f64::from(code) - expected).abs();
                assert!(
                    error <= 0.51,
                    "axis {axis}, {column}, {row}: {code}, {expected}"
                );
            }
        }
    }
    // Other pictures go on, and nonsense is refused or clamped.
    page.say(&json!({ "type": "slice", "axis": 7, "index": 9999, "window": [1.0, 1.0] }));
    let view = view(&scene, json!({}));
    assert!(!page.rest(&view).is_empty());
}

#[test]
fn a_click_chooses_the_voxel_of_the_slices() {
    let bench = Bench::new();
    let Some((_viewer, mut browser)) = open(&bench, "") else {
        return;
    };
    browser.press("slices");
    browser.wait("[0, 1, 2].every((axis) => document.getElementById(`slice-${axis}`)?.bitmap)");
    assert_eq!(browser.value("state.slices.at"), json!([16, 16, 16]));
    browser.wait_rest();
    let middle = browser.middle("#picture");
    browser.drag(middle, middle);
    browser.wait("state.slices.at.join() !== '16,16,16'");
    // The voxel lies on the ray of the click.
    let at = browser.value("onScreen(inWorld(state.slices.at))");
    let corner =
        browser.value("[canvas.getBoundingClientRect().x, canvas.getBoundingClientRect().y]");
    let voxel_px =
        browser.value("canvas.getBoundingClientRect().height / heightAtTarget(state.camera)");
    for k in 0..2 {
        let distance = at[k].as_f64().expect("px") + corner[k].as_f64().expect("px") - middle[k];
        let voxel = voxel_px.as_f64().expect("px");
        assert!(
            distance.abs() < 1.5 * voxel,
            "{distance} px, a voxel has {voxel}"
        );
    }
    // A slice is clicked: its column and row, and not its own index.
    let slice = browser.middle("#slice-2");
    let before = browser.value("state.slices.at[2]");
    browser.drag(slice, slice);
    assert_eq!(browser.value("state.slices.at"), json!([16, 16, before]));
    browser.press("hide slices");
    browser.wait("document.getElementById('slices').hidden");
}

#[test]
fn distances_and_angles_are_measured() {
    let bench = Bench::new();
    let Some((_viewer, mut browser)) = open(&bench, "") else {
        return;
    };
    browser.press("distance");
    for dx in [-40.0, 40.0] {
        // The panel beside the picture may have changed its place.
        let middle = browser.middle("#picture");
        let at = [middle[0] + dx, middle[1]];
        browser.drag(at, at);
        browser.wait(&format!(
            "wanted.picked.length === {} || state.measures.length === 1",
            if dx < 0.0 { 1 } else { 2 }
        ));
    }
    browser.wait("state.measures.length === 1");
    // Both lie on the ball, as far from each other as the screen says at their depth, within a voxel and a half.
    let told = browser.value(
        "(() => { const [a, b] = state.measures[0]; const f = axes(state.camera).forward; const d = dot(sub(mul(add(a, b), 0.5), state.camera.position), f); \
         return [length(sub(b, a)), 80 * d / axes(state.camera).distance * heightAtTarget(state.camera) / canvas.getBoundingClientRect().height, length(state.scene.volume.axes[0])]; })()",
    );
    let [length, expected, voxel] = [0, 1, 2].map(|k| told[k].as_f64().expect("a number"));
    assert!(
        (length - expected).abs() < 1.5 * voxel,
        "{length}, expected {expected}"
    );
    assert_eq!(
        browser.value("measured([[1,0,0],[0,0,0],[0,2,0]])"),
        "90.0\u{b0}"
    );
    browser.press("\u{d7}");
    assert_eq!(browser.value("state.measures.length"), 0);
    // By keys alone: the cross goes from the middle to the right.
    browser.press("distance");
    browser.key("Enter", 0);
    browser.wait("wanted.picked.length === 1");
    for _ in 0..8 {
        browser.key("ArrowRight", 0);
    }
    browser.key("Enter", 0);
    browser.wait("state.measures.length === 1");
    let told = browser.value("state.measures[0].map(onScreen)");
    let at = |point: usize, axis: usize| told[point][axis].as_f64().expect("a number");
    let way = [at(1, 0) - at(0, 0), at(1, 1) - at(0, 1)];
    assert!(
        (way[0] - 32.0).abs() < 2.0 && way[1].abs() < 2.0,
        "{way:?} px"
    );
}

#[test]
fn handles_move_the_sides_of_the_crop_box() {
    let bench = Bench::new();
    let Some((_viewer, mut browser)) = open(&bench, "") else {
        return;
    };
    // So that the whole box is in sight.
    let middle = browser.middle("#picture");
    browser.mouse("mouseWheel", middle, json!({ "deltaX": 0, "deltaY": 200 }));
    browser.mouse("mouseWheel", middle, json!({ "deltaX": 0, "deltaY": 200 }));
    browser.wait_rest();
    let before = browser.picture();
    browser.value("[...document.querySelectorAll('summary')].find((s) => s.textContent === 'Crop box').click()");
    browser.wait("handles().length === 6");
    let corner =
        browser.value("[canvas.getBoundingClientRect().x, canvas.getBoundingClientRect().y]");
    let at = browser.value("onScreen(handles()[3].world)");
    let at = [0, 1].map(|k| at[k].as_f64().expect("px") + corner[k].as_f64().expect("px"));
    let aim = browser.value("onScreen(handles()[3].world.with(0, handles()[3].world[0] - 12))");
    let aim = [0, 1].map(|k| aim[k].as_f64().expect("px") + corner[k].as_f64().expect("px"));
    browser.drag(at, aim);
    browser.wait_rest();
    let moved = browser.value("state.scene.volume.corners[1][0] - cropBox()[3]");
    let moved = moved.as_f64().expect("a number");
    assert!((moved - 12.0).abs() < 0.6, "{moved} of 12");
    assert!(before != browser.picture(), "a side is cut off");
    browser.key("z", 2);
    browser.wait_rest();
    assert!(before == browser.picture(), "undone");
}

#[test]
fn figures_are_switched_on_and_copied() {
    let bench = Bench::new();
    let Some((_viewer, mut browser)) = open(&bench, "--caption typed") else {
        return;
    };
    let before = browser.picture();
    browser.value(
        "(() => { const e = document.getElementById('field-colour-bar'); e.checked = true; e.dispatchEvent(new Event('change')); })()",
    );
    browser.value(
        "(() => { const e = document.getElementById('field-axes'); e.value = 'box'; e.dispatchEvent(new Event('change')); })()",
    );
    browser.value(
        "(() => { const e = document.getElementById('field-caption'); e.value = ''; e.dispatchEvent(new Event('change')); })()",
    );
    browser.wait_rest();
    let shown = browser.picture();
    assert!(before != shown);
    let command = browser.copied();
    assert!(
        command.contains("--colour-bar") && command.contains("--axes=box"),
        "{command}"
    );
    assert!(!command.contains("--caption"), "{command}");
    assert!(
        shown == run_copied(&bench, &command),
        "the command draws the figure"
    );
}

#[test]
fn surfaces_stand_in_the_volume_and_are_taken_out() {
    let bench = Bench::new();
    let typed = format!("ball.raw {BALL} --with-iso 200:red --with-iso 100:blue,0.5");
    for words in [
        json!(["150:#00ff00,0.5"]),
        json!(["100:blue,1", "50:,0.25", "200"]),
        json!([]),
    ] {
        super::assert_same(&bench, &typed, json!({ "changes": { "with-iso": words } }));
    }
    let Some((_viewer, mut browser)) = open(&bench, "--with-iso 200:red,0.5") else {
        return;
    };
    let first = browser.picture();
    browser.value("document.getElementById('add-surface').click()");
    browser.wait_rest();
    let both = browser.picture();
    let command = browser.copied();
    assert!(
        command.contains("--with-iso=200:#ff0000,0.5"),
        "the first is still there: {command}"
    );
    assert_eq!(command.matches("--with-iso").count(), 2, "{command}");
    assert!(both != first && both == run_copied(&bench, &command));
    let slide = "(() => { const e = document.getElementById('field-surface-1'); e.value = 60; e.dispatchEvent(new Event('input')); })()";
    browser.value(slide);
    browser.wait_rest();
    assert!(browser.copied().contains("--with-iso=60:#ff0000,0.5"));
    for _ in 0..2 {
        browser.value("document.querySelector('[aria-label=\"remove surface 1\"]').click()");
        browser.wait_rest();
    }
    let command = browser.copied();
    assert!(!command.contains("--with-iso"), "{command}");
    browser.value("undo(); undo(); undo();");
    browser.wait_rest();
    assert!(browser.picture() == first, "adding and removing is undone");
}

#[test]
fn slices_stand_in_the_volume_as_they_are_chosen() {
    let bench = Bench::new();
    let typed = format!("ball.raw {BALL} --with-slice z=3");
    for words in [
        json!(["x=16:0,255", "z=4:10,200"]),
        json!(["1,1,0,30"]),
        json!([]),
    ] {
        super::assert_same(
            &bench,
            &typed,
            json!({ "changes": { "with-slice": words } }),
        );
    }
    let Some((_viewer, mut browser)) = open(&bench, "") else {
        return;
    };
    let first = browser.picture();
    browser.press("slices");
    browser.value("document.getElementById('standing').click()");
    browser.wait_rest();
    let three = browser.picture();
    let command = browser.copied();
    assert_eq!(command.matches("--with-slice").count(), 3, "{command}");
    assert!(three != first && three == run_copied(&bench, &command));
    browser.value("setSlice(2, 5)");
    browser.wait_rest();
    assert!(browser.copied().contains("--with-slice=z=5:"));
    browser.press("hide slices");
    browser.wait_rest();
    assert!(browser.picture() == first, "they go with the slices");
    // The values on the plane that cuts the volume.
    let move_ = "(() => { const e = document.getElementById('field-depth'); e.value = 0.5; e.dispatchEvent(new Event('input')); })()";
    browser.value(move_);
    browser.value("document.getElementById('field-values-on-it').click()");
    browser.wait_rest();
    let command = browser.copied();
    assert_eq!(command.matches("--with-slice").count(), 1, "{command}");
    assert!(browser.picture() == run_copied(&bench, &command));
}

#[test]
fn steps_over_time_are_chosen_and_copied() {
    let bench = Bench::new();
    for number in 0..3u8 {
        bench.write(
            &format!("t{number:02}.npy"),
            &step(usize::from(4 * number), 60.0 + 10.0 * f32::from(number)),
        );
    }
    let viewer = Viewer::start(&bench, "t%02d.npy");
    let Some(mut browser) = Browser::open(&viewer.address(), [700, 500]) else {
        println!("skipped: no Chromium");
        return;
    };
    browser.wait_rest();
    let first = browser.picture();
    assert_eq!(
        browser.value("state.scene.volume.steps"),
        json!(["t00.npy", "t01.npy", "t02.npy"])
    );
    browser.value("(() => { const e = document.getElementById('field-step'); e.value = 2; e.dispatchEvent(new Event('input')); })()");
    browser.wait_rest();
    let third = browser.picture();
    assert!(first != third, "another step");
    let command = browser.copied();
    let written = run_copied(&bench, &command);
    // A picture of a part of a sequence says in its file which one it is.
    let pixels = |png: &[u8]| image::load_from_memory(png).expect("a PNG").to_rgba8();
    assert!(
        pixels(&third) == pixels(&written),
        "the command draws the step"
    );
    // All pictures of a turntable show the step, with the look of all steps.
    browser.value("window.file = null; downloaded = async (name, blob) => { window.file = [...new Uint8Array(await blob.arrayBuffer())]; }");
    browser.press("turntable");
    browser.value("(() => { const [name, , , steps] = document.querySelectorAll('#dialog input'); [name.value, steps.value] = ['turn.apng', 2]; })()");
    browser.press("download");
    browser.wait("Boolean(window.file)");
    let film: Vec<u8> = serde_json::from_value(browser.value("window.file")).expect("bytes");
    assert!(
        pixels(&third) == pixels(&film),
        "the turntable begins with the view"
    );
    browser.press("play");
    browser.wait("state.step === 0");
    browser.wait("state.step === 1");
    browser.press("pause");
}
