//! `resample trade`: the report, its page in a real browser, and going on after a stop.

use std::fs;
use std::process::Command;

use serde_json::Value;

use super::{BALL, Bench, stderr};

/// A small measurement of the ball.
fn measure(bench: &Bench, words: &str) -> Value {
    let output = bench.run(&format!(
        "trade volsplat ball.raw {BALL} --size 24x24 --reps 1 --out out {words}"
    ));
    assert_eq!(
        output.status.code(),
        Some(0),
        "`{words}`: {}",
        stderr(&output)
    );
    serde_json::from_str(&fs::read_to_string(bench.path("out/trade.json")).expect("a report"))
        .expect("JSON")
}

fn row<'a>(report: &'a Value, name: &str) -> &'a Value {
    let rows = report["rows"].as_array().expect("a list");
    rows.iter()
        .find(|row| row["name"] == name)
        .unwrap_or_else(|| panic!("a row {name}"))
}

#[test]
fn every_ladder_is_climbed_and_told_in_all_formats() {
    let bench = Bench::new();
    let report = measure(&bench, "--settings slab,subpixels");
    assert_eq!(
        row(&report, "exact")["error"]["rmse"],
        0.0,
        "the reference itself"
    );
    let rmse = |name: &str| {
        row(&report, name)["error"]["rmse"]
            .as_f64()
            .expect("a number")
    };
    assert!(rmse("slab 2") > rmse("slab 0.25"), "thin slabs are nearer");
    assert!(
        rmse("subpixels 1") > rmse("subpixels 8"),
        "sub-pixels are nearer"
    );
    assert!(
        row(&report, "slab 2, subpixels 4")["group"] == "combined",
        "the cross product is there"
    );
    assert!(
        rmse("order every-sample, cells off") > rmse("order every-sample, cells split"),
        "cells are nearer"
    );
    for name in [
        "order every-sample, cells split:0.015625",
        "order every-sample, subpixels 2",
        "order image-sheets, kernel b-spline, interpolate on",
        "order image-sheets, classify pre",
    ] {
        assert!(rmse(name) > 0.0, "{name} is measured");
    }
    let rows = report["rows"].as_array().expect("a list");
    for row in rows {
        assert!(
            row["error"]["p99"].as_f64() <= row["error"]["max"].as_f64(),
            "{row}"
        );
        assert!(row["cost"]["cold_ms"].as_f64() > Some(0.0), "{row}");
        // A program with nothing to do takes a megabyte.
        let peak = row["cost"]["peak_bytes"].as_f64();
        assert!(
            !cfg!(target_os = "linux") || peak > Some(1e6),
            "memory of its own process: {row}"
        );
    }
    let command = row(&report, "slab 2")["command"].as_str().expect("text");
    assert!(
        command.starts_with("resample volsplat ball.raw") && command.ends_with("--slab 2"),
        "{command}"
    );
    let count = report["rows"].as_array().expect("a list").len();
    let csv = fs::read_to_string(bench.path("out/trade.csv")).expect("a table");
    assert_eq!(csv.lines().count(), count + 1, "one line per row");
    let command = command
        .strip_prefix("resample ")
        .expect("the program")
        .to_owned()
        + " -o out/again.png";
    let again = bench.run(&command);
    assert_eq!(
        again.status.code(),
        Some(0),
        "the command of a row can be typed: {}",
        stderr(&again)
    );
    let same = bench.run("compare out/again.png out/slab-2_picture.png --fail-above max=0");
    assert_eq!(
        same.status.code(),
        Some(0),
        "and gives its picture: {}",
        stderr(&same)
    );
}

#[test]
fn what_was_measured_is_kept_on_resume() {
    let bench = Bench::new();
    let mut report = measure(&bench, "");
    report["rows"][2]["cost"]["cpu_ms"] = 12345.0.into();
    bench.write("out/trade.json", report.to_string().as_bytes());
    let again = measure(&bench, "--resume");
    assert_eq!(
        again["rows"][2]["cost"]["cpu_ms"], 12345.0,
        "kept, not measured again"
    );
}

#[test]
fn the_page_works_in_a_browser() {
    let browsers = ["chromium", "chromium-browser", "google-chrome"];
    let Some(browser) = browsers
        .into_iter()
        .find(|name| Command::new(name).arg("--version").output().is_ok())
    else {
        println!("skipped: no Chromium is installed");
        return;
    };
    let bench = Bench::new();
    let mut report = measure(&bench, "");
    // Equal times, so that the page does not hang on the clock.
    for row in report["rows"].as_array_mut().expect("a list") {
        row["cost"]["cpu_ms"] = 10.0.into();
    }
    bench.write("out/trade.json", report.to_string().as_bytes());
    measure(&bench, "--resume");
    // A real click needs a driver; a click event goes through the same handler. Errors are kept where the test sees them.
    let page = fs::read_to_string(bench.path("out/index.html")).expect("a page");
    let watch = "<script>window.onerror = (what) => document.documentElement.setAttribute('data-failed', what);</script>";
    let click = "<script>[...document.querySelectorAll('circle')]\
                 .find((circle) => circle.textContent.startsWith('slab 2'))\
                 .dispatchEvent(new MouseEvent('click', { bubbles: true }));</script>";
    let page = page
        .replace("<head>", &format!("<head>{watch}"))
        .replace("</body>", &format!("{click}</body>"));
    bench.write("out/clicked.html", page.as_bytes());
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-background-networking",
        ])
        .args(["--no-first-run", "--disable-sync", "--dump-dom"])
        .arg(format!(
            "--user-data-dir={}",
            bench.path("profile").display()
        ))
        .arg(format!(
            "file://{}",
            bench.path("out/clicked.html").display()
        ))
        .output()
        .expect("the browser starts");
    let dom = String::from_utf8_lossy(&output.stdout);
    assert!(!dom.contains("data-failed=\""), "the page has an error");
    let rows = dom.matches("<tr data-row=").count();
    let points = dom.matches("<circle ").count();
    assert!(
        rows > 20 && points > rows,
        "{rows} rows, {points} points and legend marks"
    );
    assert!(dom.contains("class=\"chosen\""), "the click marks its row");
    assert!(dom.contains("Use "), "a verdict is on top");
    let table = dom.split("<tbody>").nth(1).expect("a table");
    let (rows_shown, idle) = table.split_once("</tbody>").expect("its end");
    assert!(
        idle.contains("Without effect on this scene: ")
            && !rows_shown.contains("<td>order field</td>"),
        "the default under another name is no row"
    );
    assert!(
        dom.contains("alt=\"picture of slab 2\""),
        "and shows its picture"
    );
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let bench = Bench::new();
    for (words, part) in [
        ("trade", "<COMMAND>"),
        ("trade engine.raw", "unrecognized subcommand"),
        (
            "trade volsplat absent.raw --dims 2,2,2 --type u8 --out out",
            "absent.raw",
        ),
        (
            "trade volsplat ball.raw --out out --settings sharpness",
            "no such ladder",
        ),
        ("trade volsplat ball.raw --out out -o a.png", "leave it out"),
        ("trade texmap --scene blobs --out out", "--scene"),
    ] {
        let output = bench.run(words);
        assert_eq!(
            output.status.code(),
            Some(2),
            "`{words}` is refused: {}",
            stderr(&output)
        );
        assert!(
            stderr(&output).contains(part),
            "`{words}` says {part}: {}",
            stderr(&output)
        );
        assert!(
            bench.written().is_empty(),
            "`{words}` leaves nothing: {:?}",
            bench.written()
        );
    }
    // A folder that the command would have made.
    let output = bench.run("trade volsplat absent.raw --dims 2,2,2 --type u8 --out new");
    assert!(
        output.status.code() == Some(2) && !bench.path("new").exists(),
        "no empty folder"
    );
}

#[test]
fn help_names_the_options_of_both_parts() {
    let bench = Bench::new();
    for (words, parts) in [
        (
            "trade texmap --help",
            ["--settings <NAMES>", "--out <FOLDER>", "--resume"],
        ),
        (
            "trade volsplat --help",
            ["--slab <VOXELS>", "--order <ORDER>", "--turntable <N>"],
        ),
    ] {
        let output = bench.run(words);
        assert_eq!(
            output.status.code(),
            Some(0),
            "`{words}` is no error: {}",
            stderr(&output)
        );
        let help = String::from_utf8_lossy(&output.stdout);
        for part in parts {
            assert!(help.contains(part), "`{words}` shows {part}: {help}");
        }
    }
    assert!(
        !bench.path("trade-report").exists(),
        "help measures nothing"
    );
}
