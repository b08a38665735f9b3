//! The page in a real browser, steered by the DevTools protocol: what a hand does, and what is seen afterwards.
//!
//! Says that it was skipped where there is no Chromium.

use std::net::TcpStream;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use base64::Engine;
use serde_json::{Value, json};
use tempfile::TempDir;
use tungstenite::{Message, WebSocket};

use super::super::{BALL, Bench};
use super::page::{Viewer, run_copied};

/// Longest wait for anything, in an unoptimised build on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// The left button of a mouse, held.
pub(super) const HELD: &str = r#"{ "button": "left", "buttons": 1, "clickCount": 1 }"#;

/// A browser with one tab.
pub(super) struct Browser {
    process: Child,
    socket: WebSocket<TcpStream>,
    next: u64,
    _profile: TempDir,
}

impl Browser {
    /// Opens an address; `None` where there is no browser.
    pub(super) fn open(address: &str, size: [u32; 2]) -> Option<Self> {
        let names = ["chromium", "chromium-browser", "google-chrome"];
        let profile = tempfile::tempdir().expect("a temporary folder");
        let process = names.iter().find_map(|name| {
            Command::new(name)
                .args([
                    "--headless=new",
                    "--no-sandbox",
                    "--disable-gpu",
                    "--no-first-run",
                    "--disable-background-networking",
                ])
                .args([
                    "--disable-component-update",
                    "--disable-sync",
                    "--remote-debugging-port=0",
                ])
                .arg(format!("--user-data-dir={}", profile.path().display()))
                .arg("about:blank")
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .ok()
        })?;
        let port_file = profile.path().join("DevToolsActivePort");
        let port = wait_for(|| {
            let text = std::fs::read_to_string(&port_file).ok()?;
            Some(text.lines().next()?.to_owned())
        });
        let target = tab(&port);
        let stream = TcpStream::connect(format!("127.0.0.1:{port}")).expect("it listens");
        stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
        let (socket, _) = tungstenite::client(format!("ws://127.0.0.1:{port}{target}"), stream)
            .expect("a socket");
        let mut browser = Self {
            process,
            socket,
            next: 0,
            _profile: profile,
        };
        let [width, height] = size;
        browser.call(
            "Emulation.setDeviceMetricsOverride",
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false }),
        );
        browser.call("Page.navigate", json!({ "url": address }));
        Some(browser)
    }

    fn call(&mut self, method: &str, params: Value) -> Value {
        self.next += 1;
        let id = self.next;
        let text = json!({ "id": id, "method": method, "params": params }).to_string();
        self.socket.send(Message::text(text)).expect("it listens");
        loop {
            if let Message::Text(text) = self.socket.read().expect("it answers") {
                let answer: Value = serde_json::from_str(&text).expect("JSON");
                if answer["id"] == id {
                    assert!(answer.get("error").is_none(), "{method}: {answer}");
                    return answer["result"].clone();
                }
            }
        }
    }

    /// The value of an expression in the page.
    pub(super) fn value(&mut self, expression: &str) -> Value {
        let params =
            json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let result = self.call("Runtime.evaluate", params);
        result["result"]["value"].clone()
    }

    pub(super) fn wait(&mut self, condition: &str) {
        let end = Instant::now() + PATIENCE;
        while self.value(condition) != true {
            let status = "document.getElementById('status')?.textContent";
            assert!(Instant::now() < end, "{condition}: {}", self.value(status));
            std::thread::sleep(Duration::from_millis(30));
        }
    }

    pub(super) fn wait_rest(&mut self) {
        // Not the picture of before: rest begins a while after the last motion.
        std::thread::sleep(Duration::from_millis(250));
        self.wait(
            "document.body.dataset.kind === 'resting last' && Number(document.body.dataset.shown) === nextId - 1 && !isPlanned",
        );
    }

    pub(super) fn mouse(&mut self, kind: &str, at: [f64; 2], more: Value) {
        let mut params = json!({ "type": kind, "x": at[0], "y": at[1] });
        for (key, value) in more.as_object().expect("an object") {
            params[key] = value.clone();
        }
        self.call("Input.dispatchMouseEvent", params);
    }

    pub(super) fn drag(&mut self, from: [f64; 2], to: [f64; 2]) {
        let held: Value = serde_json::from_str(HELD).expect("JSON");
        self.mouse("mousePressed", from, held.clone());
        for step in 1..=10 {
            let share = f64::from(step) / 10.0;
            let at = [0, 1].map(|k| from[k] + share * (to[k] - from[k]));
            self.mouse("mouseMoved", at, held.clone());
        }
        self.mouse("mouseReleased", to, held);
    }

    /// Presses a key; the modifiers are those of the protocol: 2 is Ctrl.
    pub(super) fn key(&mut self, key: &str, modifiers: u8) {
        for kind in ["rawKeyDown", "keyUp"] {
            let params = json!({ "type": kind, "key": key, "modifiers": modifiers });
            self.call("Input.dispatchKeyEvent", params);
        }
    }

    /// Puts fingers to places, px.
    pub(super) fn touch(&mut self, kind: &str, fingers: &[[f64; 2]]) {
        let points: Vec<Value> = fingers
            .iter()
            .enumerate()
            .map(|(id, at)| json!({ "id": id, "x": at[0], "y": at[1] }))
            .collect();
        let params = json!({ "type": kind, "touchPoints": points });
        self.call("Input.dispatchTouchEvent", params);
    }

    /// Middle of the first element that a selector finds, px.
    pub(super) fn middle(&mut self, selector: &str) -> [f64; 2] {
        let place = self.value(&format!(
            "(() => {{ const e = document.querySelector({selector:?}); e.scrollIntoView({{ block: 'nearest' }}); const r = e.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]; }})()"
        ));
        [0, 1].map(|k| {
            place[k]
                .as_f64()
                .unwrap_or_else(|| panic!("{selector}: {place}"))
        })
    }

    /// Presses the button with this text.
    pub(super) fn press(&mut self, text: &str) {
        let found = self.value(&format!(
            "(() => {{ const b = [...document.querySelectorAll('button')].find((b) => b.textContent === {text:?}); b?.click(); return Boolean(b); }})()"
        ));
        assert_eq!(found, true, "the button {text}");
    }

    /// The command line that the page copies, which draws its picture.
    pub(super) fn copied(&mut self) -> String {
        // That of an earlier copy would be read.
        self.value("document.getElementById('dialog').replaceChildren()");
        self.press("copy command");
        self.wait("Boolean(document.querySelector('#dialog pre'))");
        let command = self.value("document.querySelector('#dialog pre').textContent");
        self.press("close");
        command.as_str().expect("a text").to_owned()
    }

    /// The file of the last resting picture.
    pub(super) fn picture(&mut self) -> Vec<u8> {
        let text = self.value("lastBlob.arrayBuffer().then((b) => btoa([...new Uint8Array(b)].map((x) => String.fromCharCode(x)).join('')))");
        let text = text.as_str().expect("a picture");
        base64::engine::general_purpose::STANDARD
            .decode(text)
            .expect("base64")
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn wait_for<T>(mut attempt: impl FnMut() -> Option<T>) -> T {
    let end = Instant::now() + PATIENCE;
    loop {
        if let Some(value) = attempt() {
            return value;
        }
        assert!(Instant::now() < end, "the browser does not start");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// The path of the first tab's socket.
fn tab(port: &str) -> String {
    use std::io::{Read, Write};
    wait_for(|| {
        let mut stream = TcpStream::connect(format!("127.0.0.1:{port}")).ok()?;
        write!(
            stream,
            "GET /json HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n"
        )
        .ok()?;
        // It keeps the connection open, whatever is asked of it.
        stream
            .set_read_timeout(Some(Duration::from_millis(300)))
            .ok()?;
        let mut bytes = Vec::new();
        let _ = stream.read_to_end(&mut bytes);
        let text = String::from_utf8(bytes).ok()?;
        let list: Value = serde_json::from_str(text.split_once("\r\n\r\n")?.1).ok()?;
        let tab = list.as_array()?.iter().find(|tab| tab["type"] == "page")?;
        let address = tab["webSocketDebuggerUrl"].as_str()?;
        Some(address.split_once(port)?.1.to_owned())
    })
}

/// A viewer of the ball, and a browser at its page; `None` where there is no browser.
pub(super) fn open(bench: &Bench, words: &str) -> Option<(Viewer, Browser)> {
    let viewer = Viewer::start(bench, &format!("ball.raw {BALL} {words}"));
    let Some(mut browser) = Browser::open(&viewer.address(), [900, 640]) else {
        println!("skipped: no Chromium");
        return None;
    };
    browser.wait_rest();
    Some((viewer, browser))
}

#[test]
fn a_hand_turns_zooms_edits_and_copies_the_command() {
    let bench = Bench::new();
    let Some((_viewer, mut browser)) = open(&bench, "") else {
        return;
    };
    let first = browser.picture();
    let middle = browser.middle("#picture");
    browser.drag(middle, [middle[0] + 80.0, middle[1] - 30.0]);
    browser.wait_rest();
    let turned = browser.picture();
    assert!(first != turned, "a drag turns");
    browser.mouse("mouseWheel", middle, json!({ "deltaX": 0, "deltaY": -240 }));
    browser.wait_rest();
    let zoomed = browser.picture();
    assert!(turned != zoomed, "the wheel zooms");

    // A point of the curve is made and dragged.
    let curve = browser.middle("#curve");
    browser.drag(
        [curve[0] - 40.0, curve[1]],
        [curve[0] - 60.0, curve[1] - 40.0],
    );
    browser.wait_rest();
    assert!(zoomed != browser.picture(), "another transfer function");
    assert_eq!(browser.value("transferFile() !== null"), true);

    let shown = browser.picture();
    let command = browser.copied();
    let written = run_copied(&bench, &command);
    assert!(shown == written, "the command draws what the page shows");

    browser.press("undo");
    browser.wait_rest();
    assert!(zoomed == browser.picture(), "the edit is undone");
    browser.press("reset view");
    browser.wait_rest();
    assert!(first == browser.picture(), "as it began");
}

#[test]
fn presets_have_pictures_and_files_are_saved() {
    let bench = Bench::new();
    let Some((_viewer, mut browser)) = open(&bench, "--shade phong") else {
        return;
    };
    let before = browser.picture();
    browser.wait("document.querySelectorAll('.presets img').length > 0");
    let preset = browser.middle(".presets button");
    browser.drag(preset, preset);
    browser.wait_rest();
    let shown = browser.picture();
    assert!(before != shown, "a preset looks different");
    let command = browser.copied();
    assert!(command.contains("--preset"), "{command}");
    assert!(
        shown == run_copied(&bench, &command),
        "as the command draws it"
    );
    browser.press("picture");
    browser.value("document.querySelector('#dialog input').value = 'mine.png'");
    browser.press("save");
    let path: PathBuf = bench.path("mine.png");
    browser.wait("document.getElementById('status').textContent.startsWith('saved')");
    assert!(std::fs::read(path).expect("a picture") == browser.picture());
    let errors = browser.value("document.getElementById('status').classList.contains('bad')");
    assert_eq!(errors, false);
}
