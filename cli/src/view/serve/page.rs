//! The page: one HTML text with its style and its program, and a policy that lets nothing else in.

use anyhow::Result;

use super::http::name_of_host;

/// The page for the browser.
pub(crate) struct Page {
    pub(crate) headers: Vec<String>,
    pub(crate) html: String,
}

const HTML: &str = include_str!("page/index.html");
const STYLE: &str = include_str!("page/style.css");

/// The parts of the program, in the order in which they need one another.
const PROGRAM: [&str; 8] = [
    include_str!("page/state.js"),
    include_str!("page/camera.js"),
    include_str!("page/connection.js"),
    include_str!("page/canvas.js"),
    include_str!("page/transfer.js"),
    include_str!("page/colours.js"),
    include_str!("page/panel.js"),
    include_str!("page/main.js"),
];

/// Pages that may show this one in a frame: those of this machine (notebooks, and their proxies), and of the desktop program
/// whose notebooks are web views. Web sites cannot have an address of that scheme.
const FRAMES: &str = "'self' http://localhost:* https://localhost:* http://127.0.0.1:* https://127.0.0.1:* vscode-webview: vscode-file:";

/// The page, with a new password for its own program; pages of `hosts` may show it in a frame.
pub(crate) fn page(hosts: &[String]) -> Result<Page> {
    let mut key = [0u8; 16];
    getrandom::fill(&mut key)
        .map_err(|error| anyhow::anyhow!("no random numbers for the page: {error}"))?;
    let nonce: String = key.iter().map(|byte| format!("{byte:02x}")).collect();
    // Text that is no name would end the policy's list.
    let names = hosts.iter().filter(|host| name_of_host(host).is_some());
    let frames = names.fold(FRAMES.to_owned(), |frames, host| {
        format!("{frames} http://{host} https://{host}")
    });
    let policy = format!(
        "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; img-src blob: data:; connect-src 'self'; base-uri 'none'; \
         form-action 'none'; frame-ancestors {frames}"
    );
    let html = HTML
        .replace("{{nonce}}", &nonce)
        .replace("{{style}}", STYLE)
        .replace("{{program}}", &PROGRAM.join("\n"));
    Ok(Page {
        headers: vec![
            "Content-Type: text/html; charset=utf-8".to_owned(),
            format!("Content-Security-Policy: {policy}"),
        ],
        html,
    })
}
