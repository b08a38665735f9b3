//! The figures of docs/results/view.md: frames a second and latencies in a real browser. Measured by hand, on a quiet machine:
//!
//! ```text
//! RESAMPLE_VIEW="engine.raw --dims 256,256,128 --type u8" \
//!     cargo test --release -p resample-cli --test cli view::figures -- --ignored --nocapture
//! ```

use std::f64::consts::TAU;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::super::{BALL, Bench};
use super::browser::{Browser, HELD};
use super::page::Viewer;

/// Time from one motion of the pointer to the next: that of a mouse that tells 80 places a second.
const MOTION: Duration = Duration::from_millis(12);

/// Notes when the page asks for moving pictures and when it shows them.
const NOTES: &str = "
    window.asked = {}; window.notes = [];
    const plainSend = send, plainShow = show;
    send = (m) => { if (m.type === 'draw') asked[m.id] = performance.now(); plainSend(m); };
    show = (bitmap, head, blob) => {
        plainShow(bitmap, head, blob);
        const now = performance.now();
        if (head.kind === 'moving') notes.push([now, now - asked[head.id], head.width]);
    };";

#[test]
#[ignore = "a measurement, printed; see above"]
fn figures() {
    let words = std::env::var("RESAMPLE_VIEW").unwrap_or(format!("ball.raw {BALL}"));
    let bench = Bench::new();
    let viewer = Viewer::start(&bench, &words);
    let Some(mut browser) = Browser::open(&viewer.address(), [1100, 800]) else {
        println!("skipped: no Chromium");
        return;
    };
    browser.wait_rest();
    browser.value(NOTES);
    println!("{words}");
    let middle = browser.middle("#picture");
    println!("turning: {}", motion(&mut browser, middle, [250.0, 60.0]));
    let start = Instant::now();
    browser.wait_rest();
    println!("refined: {:.2} s", start.elapsed().as_secs_f64());
    if browser.value("Boolean(document.getElementById('curve'))") == true {
        let curve = browser.middle("#curve");
        println!("curve: {}", motion(&mut browser, curve, [50.0, 45.0]));
    }
}

/// Holds the pointer and moves it around a place for four seconds.
fn motion(browser: &mut Browser, around: [f64; 2], reach: [f64; 2]) -> String {
    browser.value("notes.length = 0");
    let held: Value = serde_json::from_str(HELD).expect("JSON");
    browser.mouse("mousePressed", around, held.clone());
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(4) {
        let seconds = start.elapsed().as_secs_f64();
        let at = [
            around[0] + reach[0] * (0.35 * TAU * seconds).sin(),
            around[1] + reach[1] * (0.55 * TAU * seconds).sin(),
        ];
        browser.mouse("mouseMoved", at, held.clone());
        std::thread::sleep(MOTION);
    }
    browser.mouse("mouseReleased", around, held);
    let text = browser.value("JSON.stringify(notes)");
    let notes: Vec<[f64; 3]> =
        serde_json::from_str(text.as_str().expect("a text")).expect("numbers");
    assert!(notes.len() > 1, "no picture was shown");
    let seconds = (notes[notes.len() - 1][0] - notes[0][0]) / 1e3;
    json!({
        "frames_a_second": ((notes.len() - 1) as f64 / seconds).round(),
        "width_px": median(&notes, 2),
        "latency_ms": median(&notes, 1).round(),
    })
    .to_string()
}

fn median(notes: &[[f64; 3]], column: usize) -> f64 {
    let mut values: Vec<f64> = notes.iter().map(|note| note[column]).collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
