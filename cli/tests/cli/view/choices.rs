//! Choices that exclude one another: the page's are newer than those that were typed, and its newest wins.

use serde_json::{Value, json};
use tungstenite::Message;

use super::super::{BALL, Bench};
use super::assert_same;
use super::browser;
use super::page::{Viewer, view, with};

/// Typed words, and changes of the page that cannot stand beside them.
const CONTRARY: [(&str, &str, &str); 12] = [
    ("--shade phong", "blend", "maximum"),
    ("--shade lambert", "preset", "brightest"),
    ("--blend maximum", "shade", "lambert"),
    ("--blend average", "preset", "solid"),
    ("--iso 100", "blend", "minimum"),
    ("--iso 100", "preset", "brightest"),
    ("--occlusion", "blend", "maximum"),
    ("--occlusion=3", "iso", "100"),
    ("--light 1,2,3 --shadows --light-size 5", "blend", "average"),
    ("--light 1,2,3 --shadows --light-size 5", "shadows", "off"),
    ("--light 1,2,3", "shadows", "on"),
    ("--light 1,2,3 --shadows", "iso", "100"),
];

#[test]
fn changes_of_the_page_replace_typed_options_that_exclude_them() {
    let bench = Bench::new();
    for (words, name, value) in CONTRARY {
        let more = json!({ "changes": { name: [value] } });
        assert_same(&bench, &format!("ball.raw {BALL} {words}"), more);
    }
}

#[test]
fn every_preset_has_its_picture_whatever_was_typed() {
    let bench = Bench::new();
    for words in [
        "--shade phong",
        "--shadows --light 1,1,1",
        "--blend maximum",
        "--iso 100",
    ] {
        let viewer = Viewer::start(&bench, &format!("ball.raw {BALL} {words}"));
        let mut page = viewer.page();
        let scene = page.hear("scene");
        let view = view(&scene, json!({}));
        let presets = scene["volume"]["presets"].as_array().expect("a list");
        assert!(presets.len() > 5);
        for preset in presets {
            let name = &preset["name"];
            page.say(&with(&view, json!({ "type": "thumbnail", "preset": name })));
            loop {
                match page.read() {
                    Message::Binary(bytes) => {
                        assert_eq!(&page.shown(&bytes).0["name"], name, "{words}");
                        break;
                    }
                    Message::Text(text) => panic!("{words}, {name}: {text}"),
                    _ => {}
                }
            }
        }
    }
}

#[test]
fn a_preset_that_cannot_be_drawn_is_passed_over() {
    let bench = Bench::new();
    let viewer = Viewer::start(&bench, &format!("ball.raw {BALL}"));
    let mut page = viewer.page();
    let scene = page.hear("scene");
    let view = view(&scene, json!({}));
    page.say(&with(
        &view,
        json!({ "type": "thumbnail", "preset": "no such" }),
    ));
    assert_eq!(page.hear("no-thumbnail")["preset"], "no such");
}

#[test]
fn shadows_and_occlusion_are_switches() {
    let bench = Bench::new();
    let Some((_viewer, mut browser)) = browser::open(&bench, "--preset solid") else {
        return;
    };
    let first = browser.picture();
    let click = |browser: &mut browser::Browser, label: &str| {
        browser.value(&format!("document.getElementById('field-{label}').click()"));
        browser.wait_rest();
        browser.picture()
    };
    let occluded = click(&mut browser, "occlusion");
    assert_ne!(occluded, first);
    let both = click(&mut browser, "shadows");
    assert_ne!(both, occluded);
    // Blendings without light take them off.
    choose(&mut browser, "blend", "maximum");
    let status = "document.getElementById('status')";
    assert_eq!(
        browser.value(&format!("{status}.classList.contains('bad')")),
        false
    );
    browser.value("undo()");
    browser.wait_rest();
    assert_eq!(browser.picture(), both);
}

/// Chooses a word in the list behind a label.
fn choose(browser: &mut browser::Browser, label: &str, word: &str) {
    browser.value(&format!(
        "(() => {{ const s = document.getElementById('field-{label}'); s.value = {word:?}; s.dispatchEvent(new Event('change')); }})()"
    ));
    browser.wait_rest();
}

#[test]
fn the_newest_choice_wins_and_the_other_is_taken_off() {
    let bench = Bench::new();
    let Some((_viewer, mut browser)) = browser::open(&bench, "") else {
        return;
    };
    let first = browser.picture();
    choose(&mut browser, "light", "lambert");
    choose(&mut browser, "blend", "maximum");
    let status = "document.getElementById('status')";
    assert_eq!(
        browser.value(&format!("{status}.classList.contains('bad')")),
        false
    );
    let said = browser.value(&format!("{status}.textContent"));
    assert!(said.to_string().contains("lambert is off"), "{said}");
    assert_eq!(
        browser.value("state.changes"),
        json!({ "blend": ["maximum"] })
    );
    choose(&mut browser, "light", "phong");
    assert_eq!(browser.value("option('blend')"), "emission");
    choose(&mut browser, "light", "");
    choose(&mut browser, "blend", "isosurface");
    let surface = browser.picture();
    choose(&mut browser, "blend", "");
    assert_eq!(browser.value("state.changes"), json!({}));
    assert!(surface != first && first == browser.picture());
}

#[test]
fn keys_of_the_picture_hold_while_a_slider_has_the_focus() {
    let bench = Bench::new();
    let Some((_viewer, mut browser)) = browser::open(&bench, "") else {
        return;
    };
    let first = browser.picture();
    let slider = browser.middle("#field-width");
    browser.drag(slider, [slider[0] - 30.0, slider[1]]);
    browser.wait_rest();
    assert!(first != browser.picture(), "the slider changes the picture");
    assert_eq!(
        browser.value("document.activeElement.type"),
        "range",
        "it has the focus"
    );
    browser.key("z", 2);
    browser.wait_rest();
    assert!(first == browser.picture(), "Ctrl-Z undoes it");
    browser.value("document.querySelector('input[type=range]').focus()");
    browser.key("3", 0);
    browser.wait_rest();
    assert!(first != browser.picture(), "a key looks along an axis");
}

#[test]
fn two_fingers_zoom_and_pan() {
    let bench = Bench::new();
    let Some((_viewer, mut browser)) = browser::open(&bench, "") else {
        return;
    };
    let axes = |browser: &mut browser::Browser| -> [f64; 4] {
        let read = "(() => { const a = axes(state.camera); return [...a.forward, a.distance]; })()";
        let list: Value = browser.value(read);
        [0, 1, 2, 3].map(|k| list[k].as_f64().expect("a number"))
    };
    let before = axes(&mut browser);
    let [x, y] = browser.middle("#picture");
    let fingers = |apart: f64| [[x - apart, y], [x + apart, y]];
    browser.touch("touchStart", &fingers(40.0));
    for step in 1..=5 {
        browser.touch("touchMove", &fingers(40.0 + 8.0 * f64::from(step)));
    }
    browser.touch("touchEnd", &[]);
    browser.wait_rest();
    let after = axes(&mut browser);
    let ratio = after[3] / before[3];
    assert!((ratio - 0.5).abs() < 0.02, "twice as near: {ratio}");
    let turned: f64 = (0..3).map(|k| (after[k] - before[k]).abs()).sum();
    assert!(turned < 1e-9, "nothing turns: {turned}");
}

/// A table whose top shades its foot: shadows change the picture, and a light without shadows takes them off.
#[test]
fn a_mesh_has_its_shadows() {
    let bench = Bench::new();
    let table = "v -1 1 -1\nv 1 1 -1\nv 1 1 1\nv -1 1 1\nv -2 0 -2\nv 2 0 -2\nv 2 0 2\nv -2 0 2\nf 4 3 2 1\nf 8 7 6 5\n";
    bench.write("table.obj", table.as_bytes());
    let viewer = Viewer::start(&bench, "table.obj");
    let Some(mut browser) = browser::Browser::open(&viewer.address(), [900, 640]) else {
        println!("skipped: no Chromium");
        return;
    };
    browser.wait_rest();
    let first = browser.picture();
    choose(&mut browser, "shadows", "ground");
    let shaded = browser.picture();
    assert_ne!(shaded, first);
    choose(&mut browser, "light", "unlit");
    let status = "document.getElementById('status')";
    let is_bad = browser.value(&format!("{status}.classList.contains('bad')"));
    assert_eq!(is_bad, false);
    let said = browser.value(&format!("{status}.textContent"));
    assert!(said.to_string().contains("goes without shadows"), "{said}");
    assert_ne!(browser.picture(), shaded);
}
