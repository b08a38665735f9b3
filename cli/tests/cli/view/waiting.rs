//! Nobody waits for a picture that is not wanted any more, nor for a file that is being written.

use serde_json::{Value, json};
use tungstenite::Message;

use super::super::{BALL, Bench};
use super::page::{Page, Viewer, view, with};

/// A view that takes seconds at rest.
fn slow(scene: &Value) -> Value {
    let more =
        json!({ "size": [1400, 1200], "exactness": "exact", "changes": { "shade": ["phong"] } });
    view(scene, more)
}

fn draw(view: &Value, id: u32, motion: &str) -> Value {
    with(view, json!({ "type": "draw", "id": id, "motion": motion }))
}

/// The heads of the pictures up to the first one of `id`, and that one.
fn heads_until(page: &mut Page, id: u32) -> Vec<Value> {
    let mut heads: Vec<Value> = Vec::new();
    loop {
        match page.read() {
            Message::Binary(bytes) => {
                heads.push(page.shown(&bytes).0);
                if heads.last().is_some_and(|head| head["id"] == id) {
                    return heads;
                }
            }
            Message::Text(text) => assert!(!text.contains("\"error\""), "{text}"),
            _ => {}
        }
    }
}

#[test]
fn a_newer_view_ends_the_picture_in_work() {
    let bench = Bench::new();
    let viewer = Viewer::start(&bench, &format!("ball.raw {BALL}"));
    let mut page = viewer.page();
    let scene = page.hear("scene");
    page.say(&draw(&slow(&scene), 1, "resting"));
    let quick = heads_until(&mut page, 1).pop().expect("a head");
    assert_eq!(quick["is_last"], false, "the exact one is to follow");
    let other = view(&scene, json!({}));
    page.say(&draw(&other, 2, "moving"));
    let heads = heads_until(&mut page, 2);
    assert_eq!(heads.len(), 1, "the exact one is left: {heads:?}");
    // The settings of the picture that was left are not those of the next one.
    let shown = page.rest(&other);
    let again = Viewer::start(&bench, &format!("ball.raw {BALL}"));
    let mut fresh = again.page();
    fresh.hear("scene");
    assert!(shown == fresh.rest(&other), "as if nothing had been left");
}

#[test]
fn a_picture_in_work_can_be_cancelled() {
    let bench = Bench::new();
    let viewer = Viewer::start(&bench, &format!("ball.raw {BALL}"));
    let mut page = viewer.page();
    let scene = page.hear("scene");
    page.say(&draw(&slow(&scene), 1, "resting"));
    heads_until(&mut page, 1);
    page.say(&json!({ "type": "cancel" }));
    let other = view(&scene, json!({}));
    page.say(&with(
        &other,
        json!({ "type": "thumbnail", "preset": "solid" }),
    ));
    let next = heads_until(&mut page, 0);
    assert_eq!(next.len(), 1, "the exact picture is not sent: {next:?}");
    assert_eq!(next[0]["kind"], "thumbnail");
}

#[test]
fn pictures_come_while_a_film_is_written_and_it_can_be_cancelled() {
    let bench = Bench::new();
    let viewer = Viewer::start(&bench, &format!("ball.raw {BALL}"));
    let mut page = viewer.page();
    let scene = page.hear("scene");
    let other = view(&scene, json!({}));
    let film = json!({
        "type": "save", "what": "turntable", "name": "turn.webp", "size": [400, 400],
        "detail": vec![other["camera"].clone(); 1000],
    });
    page.say(&with(&other, film));
    let begun = page.hear("saving");
    assert_eq!(
        (&begun["path"], &begun["total"]),
        (&json!("turn.webp"), &json!(1000))
    );
    page.say(&draw(&other, 1, "moving"));
    heads_until(&mut page, 1);
    let save = json!({ "type": "save", "what": "camera", "name": "c.json" });
    let why = page.refusal(&with(&other, save));
    assert!(why.contains("turn.webp is still being written"), "{why}");
    page.say(&json!({ "type": "cancel" }));
    let why = page.not_saved();
    assert!(why.contains("turn.webp: cancelled"), "{why}");
    let names = std::fs::read_dir(bench.path("")).expect("a folder").count();
    assert_eq!(names, 2, "the volume and the empty folder");
}
