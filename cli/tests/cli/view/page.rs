//! A viewer that runs, and a page without a browser.

use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

use super::super::{Bench, stderr};

/// A viewer that runs in the folder of a bench, and ends with this value.
pub(super) struct Viewer {
    process: Child,
    /// `127.0.0.1:PORT`.
    pub(super) host: String,
    pub(super) token: String,
}

impl Viewer {
    pub(super) fn start(bench: &Bench, words: &str) -> Self {
        let mut process = Command::new(env!("CARGO_BIN_EXE_resample"))
            .current_dir(bench.path(""))
            .arg("view")
            .args(words.split_whitespace())
            .arg("--no-open")
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary starts");
        let mut line = String::new();
        let stdout = process.stdout.as_mut().expect("a pipe");
        BufReader::new(stdout)
            .read_line(&mut line)
            .expect("an address");
        let rest = line.trim().strip_prefix("http://").expect("an address");
        let (host, token) = rest.split_once('/').expect("a token");
        Self {
            host: host.to_owned(),
            token: token.trim_matches('/').to_owned(),
            process,
        }
    }

    pub(super) fn address(&self) -> String {
        format!("http://{}/{}/", self.host, self.token)
    }

    /// The first line and the body of an answer.
    pub(super) fn get(&self, path: &str, headers: &str) -> (String, String) {
        let mut stream = TcpStream::connect(&self.host).expect("it listens");
        write!(stream, "GET {path} HTTP/1.1\r\n{headers}\r\n").expect("it reads");
        let mut text = String::new();
        stream.read_to_string(&mut text).expect("it answers");
        let (head, body) = text.split_once("\r\n\r\n").expect("a head");
        let status = head.lines().next().expect("a status").to_owned();
        (status, body.to_owned())
    }

    pub(super) fn page(&self) -> Page {
        let mut request = format!("ws://{}/{}/socket", self.host, self.token)
            .into_client_request()
            .expect("an address");
        let origin = format!("http://{}", self.host).parse().expect("a header");
        request.headers_mut().insert("Origin", origin);
        let stream = TcpStream::connect(&self.host).expect("it listens");
        let longest = std::time::Duration::from_secs(60);
        stream.set_read_timeout(Some(longest)).expect("a socket");
        let (socket, _) = tungstenite::client(request, stream).expect("a socket");
        Page { socket }
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// A page without a browser.
pub(super) struct Page {
    pub(super) socket: WebSocket<TcpStream>,
}

impl Page {
    pub(super) fn say(&mut self, message: &Value) {
        self.socket
            .send(Message::text(message.to_string()))
            .expect("it listens");
    }

    /// The next message. A process that was stopped and goes on finds its reading interrupted.
    pub(super) fn read(&mut self) -> Message {
        loop {
            match self.socket.read() {
                Err(tungstenite::Error::Io(error)) if error.kind() == ErrorKind::Interrupted => {}
                message => return message.expect("it answers"),
            }
        }
    }

    /// The next answer of a kind. Pictures on the way are shown.
    pub(super) fn hear(&mut self, kind: &str) -> Value {
        loop {
            match self.read() {
                Message::Text(text) => {
                    let answer: Value = serde_json::from_str(&text).expect("JSON");
                    if answer["type"] == kind {
                        return answer;
                    }
                    assert_ne!(answer["type"], "error", "{answer}");
                }
                Message::Binary(bytes) => {
                    self.shown(&bytes);
                }
                _ => {}
            }
        }
    }

    /// Head and bytes of a picture, which is on the screen from now on.
    pub(super) fn shown(&mut self, bytes: &[u8]) -> (Value, Vec<u8>) {
        let length = u32::from_le_bytes(bytes[..4].try_into().expect("four bytes")) as usize;
        let head: Value = serde_json::from_slice(&bytes[4..4 + length]).expect("JSON");
        self.say(&json!({ "type": "shown", "id": head["id"] }));
        (head, bytes[4 + length..].to_vec())
    }

    /// The last picture of a view.
    pub(super) fn rest(&mut self, view: &Value) -> Vec<u8> {
        self.say(&with(
            view,
            json!({ "type": "draw", "id": 1, "motion": "resting" }),
        ));
        loop {
            match self.read() {
                Message::Binary(bytes) => {
                    let (head, picture) = self.shown(&bytes);
                    if head["is_last"] == true {
                        return picture;
                    }
                }
                Message::Text(text) => assert!(!text.contains("\"error\""), "{text}"),
                _ => {}
            }
        }
    }

    /// Why a file is not written.
    pub(super) fn not_saved(&mut self) -> String {
        let answer = self.hear("not-saved");
        answer["text"].as_str().expect("a text").to_owned()
    }

    /// The error that a message is answered with.
    pub(super) fn refusal(&mut self, message: &Value) -> String {
        self.say(message);
        loop {
            if let Message::Text(text) = self.read() {
                let answer: Value = serde_json::from_str(&text).expect("JSON");
                if answer["type"] == "error" {
                    return answer["text"].as_str().expect("a text").to_owned();
                }
            }
        }
    }
}

/// A view of the scene from its first camera, turned a little.
pub(super) fn view(scene: &Value, more: Value) -> Value {
    let start = &scene["start"];
    let shifted: Vec<f64> = (0..3)
        .map(|k| start["position"][k].as_f64().expect("a number") * 1.01 + 0.013)
        .collect();
    let mut camera = json!({ "position": shifted, "target": start["target"], "up": start["up"] });
    for key in ["fov_y", "projection", "height"] {
        if let Some(value) = start.get(key) {
            camera[key] = value.clone();
        }
    }
    with(&json!({ "camera": camera, "size": [97, 80] }), more)
}

pub(super) fn with(view: &Value, more: Value) -> Value {
    let mut view = view.clone();
    for (key, value) in more.as_object().expect("an object") {
        view[key] = value.clone();
    }
    view
}

/// Runs the copied command in an empty place beside the files, and gives its picture.
pub(super) fn run_copied(bench: &Bench, command: &str) -> Vec<u8> {
    let binary = Path::new(env!("CARGO_BIN_EXE_resample"));
    let folder = binary.parent().expect("a folder");
    let path = format!(
        "{}:{}",
        folder.display(),
        std::env::var("PATH").unwrap_or_default()
    );
    let ran = Command::new("sh")
        .args(["-c", command])
        .current_dir(bench.path(""))
        .env("PATH", path)
        .output()
        .expect("a shell");
    assert!(ran.status.success(), "{command}\n{}", stderr(&ran));
    // One of several steps has its number in its name.
    let (_, name) = command.trim().rsplit_once("-o ").expect("a name");
    let (_, frames) = command.split_once("--frames=").unwrap_or_default();
    let number = frames.split("..").next().unwrap_or_default();
    let name = name.replace("%04d", &format!("{number:0>4}"));
    std::fs::read(bench.path(&name)).expect("a picture")
}
