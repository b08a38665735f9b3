//! The page keeps everything that a person has done: undo and redo, the address, sessions, a command that is started again; and it
//! sends files to the person's machine.

use serde_json::json;

use super::super::{BALL, Bench, stderr};
use super::browser::{Browser, open};
use super::page::Viewer;

/// A port that nobody listens at.
fn free_port() -> u16 {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    listener.local_addr().expect("an address").port()
}

#[test]
fn cameras_and_looks_are_undone_and_done_again() {
    let bench = Bench::new();
    let Some((_viewer, mut browser)) = open(&bench, "") else {
        return;
    };
    let first = browser.picture();
    let middle = browser.middle("#picture");
    browser.drag(middle, [middle[0] + 80.0, middle[1] - 30.0]);
    browser.wait_rest();
    let turned = browser.picture();
    browser.mouse(
        "mouseWheel",
        [middle[0] + 90.0, middle[1]],
        json!({ "deltaX": 0, "deltaY": -240 }),
    );
    browser.wait_rest();
    let zoomed = browser.picture();
    for (key, modifiers, expected, what) in [
        ("z", 2, &turned, "the zoom is undone"),
        ("z", 2, &first, "the turn is undone"),
        ("y", 2, &turned, "the turn is done again"),
        ("Z", 10, &zoomed, "the zoom is done again"),
    ] {
        browser.key(key, modifiers);
        browser.wait_rest();
        assert!(*expected == browser.picture(), "{what}");
    }
}

#[test]
fn the_wheel_zooms_towards_the_pointer_and_never_sticks() {
    let bench = Bench::new();
    let Some((_viewer, mut browser)) = open(&bench, "") else {
        return;
    };
    let at = browser.middle("#picture");
    let at = [at[0] + 60.0, at[1] - 40.0];
    // The point of the world under the pointer, at the depth of the target.
    let below = format!(
        "(() => {{ const b = canvas.getBoundingClientRect(), a = axes(state.camera), h = heightAtTarget(state.camera) / b.height; \
         return add(state.camera.target, add(mul(a.right, ({} - b.x - b.width / 2) * h), mul(a.up, -({} - b.y - b.height / 2) * h))); }})()",
        at[0], at[1]
    );
    let before = browser.value(&below);
    browser.mouse("mouseWheel", at, json!({ "deltaX": 0, "deltaY": -200 }));
    browser.wait_rest();
    let after = browser.value(&below);
    for axis in 0..3 {
        let moved = before[axis].as_f64().expect("x") - after[axis].as_f64().expect("x");
        assert!(moved.abs() < 1e-9, "axis {axis}: {moved}");
    }
    // Through the target and on.
    let depth = "dot(sub(state.camera.position, state.start.position), axes(state.camera).forward)";
    let mut last = f64::NEG_INFINITY;
    for _ in 0..30 {
        browser.mouse("mouseWheel", at, json!({ "deltaX": 0, "deltaY": -200 }));
        browser.wait("!isPlanned");
        let now = browser.value(depth).as_f64().expect("a number");
        assert!(now > last, "it sticks at {now}");
        last = now;
    }
    let whole = browser.value("length(sub(state.start.target, state.start.position))");
    assert!(
        last > whole.as_f64().expect("a number"),
        "beyond the first target"
    );
}

#[test]
fn a_reload_and_a_restart_find_the_page_as_it_was() {
    let bench = Bench::new();
    let words = format!("ball.raw {BALL} --port {} --token-file token", free_port());
    let viewer = Viewer::start(&bench, &words);
    let Some(mut browser) = Browser::open(&viewer.address(), [900, 640]) else {
        println!("skipped: no Chromium");
        return;
    };
    browser.wait_rest();
    let middle = browser.middle("#picture");
    browser.drag(middle, [middle[0] + 70.0, middle[1]]);
    let curve = browser.middle("#curve");
    browser.drag(curve, [curve[0] + 20.0, curve[1] - 40.0]);
    browser.wait_rest();
    let shown = browser.picture();
    browser.value("location.reload()");
    std::thread::sleep(std::time::Duration::from_millis(500));
    browser.wait_rest();
    assert!(shown == browser.picture(), "after a reload");
    let address = viewer.address();
    drop(viewer);
    browser.wait("document.getElementById('status').textContent.startsWith('not connected')");
    let again = Viewer::start(&bench, &words);
    assert_eq!(again.address(), address, "the token of the file");
    browser.wait(
        "socket.readyState === 1 && !document.getElementById('status').classList.contains('bad')",
    );
    browser.wait_rest();
    assert!(shown == browser.picture(), "after a restart");
}

#[test]
fn a_session_is_opened_by_the_viewer_and_by_the_command() {
    let bench = Bench::new();
    let Some((viewer, mut browser)) = open(&bench, "--shade phong") else {
        return;
    };
    let middle = browser.middle("#picture");
    browser.drag(middle, [middle[0] - 70.0, middle[1] + 20.0]);
    let curve = browser.middle("#curve");
    browser.drag(curve, [curve[0] + 20.0, curve[1] - 40.0]);
    browser.press("add view");
    browser.wait_rest();
    let shown = browser.picture();
    browser.press("session");
    browser.press("save");
    browser.wait("document.getElementById('status').textContent === 'saved session.json'");
    let output = bench.run("volsplat --session session.json -o of-session.png");
    assert!(output.status.success(), "{}", stderr(&output));
    let drawn = std::fs::read(bench.path("of-session.png")).expect("a picture");
    assert!(shown == drawn, "the command draws what the page shows");
    drop((browser, viewer));
    let viewer = Viewer::start(&bench, "--session session.json");
    let Some(mut browser) = Browser::open(&viewer.address(), [900, 640]) else {
        return;
    };
    browser.wait_rest();
    assert!(shown == browser.picture(), "the page shows what it showed");
    assert_eq!(browser.value("state.keys.length"), 1);
    // Typed options win.
    let output = bench.run("volsplat --session=session.json --size 40x30 -o small.png");
    assert!(output.status.success(), "{}", stderr(&output));
    let small = image::open(bench.path("small.png")).expect("a picture");
    assert_eq!((small.width(), small.height()), (40, 30));
}

#[test]
fn files_come_to_the_machine_of_the_page() {
    let bench = Bench::new();
    let Some((_viewer, mut browser)) = open(&bench, "") else {
        return;
    };
    browser.value(
        "downloaded = async (name, blob) => { window.file = [name, blob.size, [...new Uint8Array(await blob.arrayBuffer())].slice(0, 4)]; }",
    );
    browser.press("picture");
    browser.press("download");
    browser.wait("Boolean(window.file)");
    let size = browser.picture().len();
    assert_eq!(
        browser.value("window.file"),
        json!(["view.png", size, [137, 80, 78, 71]])
    );
    browser.value("window.file = null");
    browser.press("turntable");
    browser.value(
        "[...document.querySelectorAll('#dialog input')].forEach((e, i) => { e.value = ['t.gif', 40, 30, 3][i]; })",
    );
    browser.press("download");
    browser.wait("Boolean(window.file)");
    assert_eq!(browser.value("window.file[0]"), "t.gif");
    assert_eq!(
        browser.value("String.fromCharCode(...window.file[2])"),
        "GIF8"
    );
    assert_eq!(
        bench.written(),
        Vec::<String>::new(),
        "nothing stays in the folder"
    );
}

#[test]
fn the_window_is_dragged_on_the_picture_and_points_are_typed() {
    let bench = Bench::new();
    let Some((_viewer, mut browser)) = open(&bench, "") else {
        return;
    };
    let before = browser.value("windowOfCurve()");
    let middle = browser.middle("#picture");
    let held = json!({ "button": "right", "buttons": 2, "clickCount": 1 });
    browser.mouse("mousePressed", middle, held.clone());
    browser.mouse("mouseMoved", [middle[0] + 60.0, middle[1]], held.clone());
    browser.mouse("mouseReleased", [middle[0] + 60.0, middle[1]], held);
    browser.wait_rest();
    let width =
        |ends: &serde_json::Value| ends[1].as_f64().expect("x") - ends[0].as_f64().expect("x");
    let after = browser.value("windowOfCurve()");
    let factor = width(&after) / width(&before);
    assert!(
        (factor - 0.4f64.exp()).abs() < 1e-9,
        "wider by exp(60 / 150): {factor}"
    );
    let count = browser.value("spread(curve().opacities).length").as_u64();
    // A typed opacity, and a colour of its own.
    browser.value(
        "(() => { const list = document.querySelector('#point select'); list.selectedIndex = 1; list.dispatchEvent(new Event('change')); })()",
    );
    browser.value(
        "(() => { const e = document.querySelector('[aria-label=\"opacity of the point\"]'); e.value = '0.25'; e.dispatchEvent(new Event('change')); })()",
    );
    browser.value(
        "(() => { const e = document.querySelector('[aria-label=\"colour of the point\"]'); e.value = '#00ff00'; e.dispatchEvent(new Event('change')); })()",
    );
    browser.wait_rest();
    assert_eq!(browser.value("state.curve.opacities[1][1]"), 0.25);
    let green = browser.value("hex(colourAt(state.curve.opacities[1][0]))");
    assert_eq!(green, "#00ff00");
    let now = browser.value("state.curve.opacities.length").as_u64();
    assert_eq!(now, count, "no point was added");
    let command = browser.copied();
    let written = super::page::run_copied(&bench, &command);
    assert!(
        browser.picture() == written,
        "the command draws what the page shows"
    );
}

#[test]
fn a_volume_property_of_slicer_is_dropped() {
    let bench = Bench::new();
    let Some((_viewer, mut browser)) = open(&bench, "") else {
        return;
    };
    let text = "1\\n1\\n0.1\\n0.9\\n0.2\\n10\\n6 0 0 100 0.5 255 1\\n4 0 1 255 1\\n12 0 0 0 0 100 1 0.5 0 255 1 1 1\\n";
    browser.value(&format!("opened(new File([\"{text}\"], 'bone.vp'))"));
    browser.wait("state.curve?.opacities.length === 3");
    browser.wait_rest();
    assert_eq!(browser.value("state.curve.opacities[1]"), json!([100, 0.5]));
    assert_eq!(browser.value("option('shade')"), "phong");
    let status = "document.getElementById('status').textContent";
    browser.value("opened(new File(['nonsense'], 'a.vp'))");
    browser.wait(&format!(
        "{status}.startsWith('a.vp: no transfer function')"
    ));
}

#[test]
fn looks_are_kept_by_name() {
    let bench = Bench::new();
    let Some((_viewer, mut browser)) = open(&bench, "") else {
        return;
    };
    browser.value("(() => { setMap('magma'); changed({ panel: true }); })()");
    browser.wait_rest();
    let magma = browser.picture();
    browser.value("document.querySelector('[placeholder=\"name of this look\"]').value = 'mine'");
    browser.press("keep look");
    browser.press("as started");
    browser.wait_rest();
    assert!(magma != browser.picture());
    browser.press("mine");
    browser.wait_rest();
    assert!(magma == browser.picture(), "the look is as it was kept");
}
