//! The listener: gives the page, which is one text without any address, and listens to each socket on a thread of its own.
//!
//! A socket takes messages of the page and puts them into the mailbox, until it is closed or another page is opened.

use std::io::{ErrorKind, Read, Write};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result};
use tungstenite::Message;
use tungstenite::handshake::derive_accept_key;
use tungstenite::protocol::{Role, WebSocket, WebSocketConfig};

use crate::args::ServeArgs;
use crate::view::mailbox::{Mailbox, Sender};
use crate::view::message::Asked;
use crate::view::serve::heads::OpenHeads;
use crate::view::serve::http::{Door, Head, Refusal, Wanted, name_of_host};

/// Time after which a client that takes no more bytes of an answer is given up.
const WRITE_PATIENCE: Duration = Duration::from_secs(10);

/// Default port of the page, where it is free: browsers keep named looks by port, so the next command finds them. A guess: Debian's list of
/// services names none for it.
const USUAL_PORT: u16 = 7467;

/// A port that is listened at.
pub(crate) struct Server {
    listener: TcpListener,
    door: Door,
    address: SocketAddr,
}

impl Server {
    /// Takes a port.
    pub(crate) fn bind(args: &ServeArgs) -> Result<Self> {
        let address = args.bind.unwrap_or(IpAddr::V4(Ipv4Addr::LOCALHOST));
        let port = args.port.unwrap_or(USUAL_PORT);
        let listener = match TcpListener::bind((address, port)) {
            Err(_) if args.port.is_none() => TcpListener::bind((address, 0)),
            bound => bound,
        };
        let listener = listener.with_context(|| {
            format!("cannot listen at {address}, port {port}: choose another with --port or --bind")
        })?;
        let mut hosts = args.allow_host.clone();
        if !address.is_loopback() && !address.is_unspecified() {
            hosts.push(address.to_string());
        }
        Ok(Self {
            address: listener.local_addr()?,
            listener,
            door: Door::new(hosts, args.token_file.as_deref())?,
        })
    }

    /// The address of the page.
    pub(crate) fn address(&self) -> String {
        format!("http://{}/{}/", self.address, self.door.token)
    }

    /// The command that brings the page to another machine.
    pub(crate) fn tunnel(&self) -> String {
        let port = self.address.port();
        format!(
            "from another machine: ssh -L {port}:127.0.0.1:{port} THIS_MACHINE, then open the address there"
        )
    }

    /// Listens from now on, on threads of its own. Requests of the page arrive in the mailbox.
    pub(crate) fn start(self) -> Result<Mailbox> {
        let mailbox = Mailbox::default();
        let (to, door) = (mailbox.clone(), Arc::new(self.door));
        let open = OpenHeads::default();
        std::thread::Builder::new()
            .name("listener".to_owned())
            .spawn(move || {
                for stream in self.listener.incoming() {
                    let Ok(stream) = stream else { continue };
                    let (to, door, open) = (to.clone(), door.clone(), open.clone());
                    // A connection that breaks off, or finds no thread, is nobody's fault.
                    let _ = std::thread::Builder::new()
                        .name("connection".to_owned())
                        .spawn(move || serve(stream, &open, &door, &to));
                }
            })?;
        Ok(mailbox)
    }
}

fn serve(mut stream: TcpStream, open: &OpenHeads, door: &Door, mailbox: &Mailbox) -> Result<()> {
    stream.set_write_timeout(Some(WRITE_PATIENCE))?;
    stream.set_nodelay(true)?;
    let head = Head::read(&mut open.admit(stream.try_clone()?)?);
    let Ok(head) = head else {
        return answer(&mut stream, "400 Bad Request", &[], b"");
    };
    match door.wanted(&head) {
        Ok(Wanted::Page) => {
            let page = page(&door.hosts)?;
            answer(&mut stream, "200 OK", &page.headers, page.html.as_bytes())
        }
        Ok(Wanted::Moved) => {
            let to = format!("Location: {}/", door.token);
            answer(&mut stream, "308 Permanent Redirect", &[to], b"")
        }
        Ok(Wanted::Socket(key)) => listen(stream, &key, mailbox),
        Err(Refusal::NotFound) => answer(&mut stream, "404 Not Found", &[], b"not found: open the whole address, with its token\n"),
        Err(Refusal::Forbidden) => answer(
            &mut stream,
            "403 Forbidden",
            &[],
            b"not by this name: open the address as it was printed, or start with --allow-host NAME\n",
        ),
    }
}

fn answer(stream: &mut TcpStream, status: &str, headers: &[String], body: &[u8]) -> Result<()> {
    let mut head = format!(
        "HTTP/1.1 {status}\r\nContent-Length: {}\r\nConnection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n\
         Referrer-Policy: no-referrer\r\n",
        body.len()
    );
    headers.iter().for_each(|line| {
        head.push_str(line);
        head.push_str("\r\n");
    });
    head.push_str("\r\n");
    match stream.write_all(&[head.as_bytes(), body].concat()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => Ok(written?),
    }
}

/// The page for the browser.
struct Page {
    pub(crate) headers: Vec<String>,
    pub(crate) html: String,
}

const HTML: &str = include_str!("page/index.html");
const STYLE: &str = include_str!("page/style.css");

/// The parts of the program, in the order in which they need one another.
const PROGRAM: [&str; 12] = [
    include_str!("page/state.js"),
    include_str!("page/past.js"),
    include_str!("page/camera.js"),
    include_str!("page/connection.js"),
    include_str!("page/canvas.js"),
    include_str!("page/over.js"),
    include_str!("page/slices.js"),
    include_str!("page/transfer.js"),
    include_str!("page/colours.js"),
    include_str!("page/panel.js"),
    include_str!("page/saving.js"),
    include_str!("page/main.js"),
];

/// Pages that may show this one in a frame: those of this machine (notebooks, and their proxies), and of the desktop program
/// whose notebooks are web views. Web sites cannot have an address of that scheme.
const FRAMES: &str = "'self' http://localhost:* https://localhost:* http://127.0.0.1:* https://127.0.0.1:* vscode-webview: vscode-file:";

/// The page, with a new password for its own program; pages of `hosts` may show it in a frame.
fn page(hosts: &[String]) -> Result<Page> {
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

/// Longest message of the page, bytes: a transfer function of a thousand knots has 100 kB.
const MAX_MESSAGE_BYTES: usize = 1 << 20;

/// Time after which a page that takes no more bytes is given up.
const PAGE_PATIENCE: Duration = Duration::from_secs(20);

/// A stream that is only read.
struct Listening(TcpStream);

impl Read for Listening {
    fn read(&mut self, to: &mut [u8]) -> std::io::Result<usize> {
        self.0.read(to)
    }
}

impl Write for Listening {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Agrees to the socket and listens until it is closed or another page is opened.
fn listen(mut stream: TcpStream, key: &str, mailbox: &Mailbox) -> Result<()> {
    let accept = derive_accept_key(key.as_bytes());
    let head = format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {accept}\r\n\r\n"
    );
    stream.write_all(head.as_bytes())?;
    stream.set_read_timeout(None)?;
    stream.set_write_timeout(Some(PAGE_PATIENCE))?;
    let sender = Sender::new(stream.try_clone()?);
    let bounds = WebSocketConfig::default()
        .max_message_size(Some(MAX_MESSAGE_BYTES))
        .max_frame_size(Some(MAX_MESSAGE_BYTES));
    let closing = stream.try_clone()?;
    let mut listening = WebSocket::from_raw_socket(Listening(stream), Role::Server, Some(bounds));
    let page = mailbox.open(sender);
    loop {
        let text = match listening.read() {
            Ok(Message::Text(text)) => text,
            Ok(Message::Close(_)) | Err(_) => break,
            Ok(_) => continue,
        };
        // Our page sends no message that cannot be parsed.
        let Ok(asked) = serde_json::from_str::<Asked>(&text) else {
            break;
        };
        if !mailbox.put(page, asked) {
            break;
        }
    }
    let _ = closing.shutdown(std::net::Shutdown::Both);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_usual_port_is_taken_where_it_is_free() {
        let [first, second] = [0, 1].map(|_| Server::bind(&ServeArgs::default()).expect("a port"));
        assert_ne!(first.address(), second.address());
        // The first page has it, unless another program had it before.
        TcpListener::bind((Ipv4Addr::LOCALHOST, USUAL_PORT)).expect_err("it is taken");
        let asked = ServeArgs {
            port: Some(second.address.port()),
            ..ServeArgs::default()
        };
        let error = Server::bind(&asked).err().expect("it is taken");
        assert!(error.to_string().contains("--port"), "{error}");
    }
}
