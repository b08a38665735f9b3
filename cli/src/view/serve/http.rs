//! The head of an HTTP request, and whether it may be answered.
//!
//! Takes bytes from the network, gives one of the few things that there are. The token in the address is the key: without it
//! nothing is answered. Host and Origin must name this machine, so that a page of somebody else's, in the same browser,
//! reaches nothing even if it learns the port.

use std::fs::OpenOptions;
use std::io::{ErrorKind, Read, Write};
use std::net::{IpAddr, Ipv6Addr};
use std::path::Path;

use anyhow::{Context, Result, bail};
use resample_io::files;

use crate::output;

/// Longest head of a request, bytes. Browsers send less than 2 kB.
const MAX_HEAD_BYTES: usize = 16 << 10;

/// Random bytes of a token.
const TOKEN_BYTES: usize = 16;

/// Most lines of a head.
const MAX_HEADERS: usize = 100;

/// The resources of the server.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Wanted {
    /// The page.
    Page,
    /// The address without its last slash, which relative addresses need.
    Moved,
    /// The WebSocket; its key.
    Socket(String),
}

/// Why a request is not answered.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// The token is missing or wrong, or there is nothing of that name.
    NotFound,
    /// It comes by a name or from a page that is not allowed.
    Forbidden,
}

/// Access rules.
#[derive(Clone, Debug)]
pub(crate) struct Door {
    pub(crate) token: String,
    /// Names beside those of this machine.
    pub(crate) hosts: Vec<String>,
}

/// A head, as far as it matters.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Head {
    path: String,
    host: Option<String>,
    origin: Option<String>,
    socket_key: Option<String>,
}

impl Head {
    /// Reads a head to its empty line.
    pub(crate) fn read(stream: &mut impl Read) -> Result<Self> {
        let mut bytes = Vec::new();
        let mut part = [0; 2048];
        while !bytes.windows(4).any(|end| end == b"\r\n\r\n") {
            if bytes.len() > MAX_HEAD_BYTES {
                bail!("the head of the request is too long");
            }
            match stream.read(&mut part) {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error.into()),
                Ok(0) => bail!("the request ends in its head"),
                Ok(count) => bytes.extend(&part[..count]),
            }
        }
        Self::of(&bytes)
    }

    fn of(bytes: &[u8]) -> Result<Self> {
        let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
        let mut request = httparse::Request::new(&mut headers);
        if !request.parse(bytes)?.is_complete() || request.method != Some("GET") {
            bail!("expected a GET request");
        }
        let value = |name: &str| {
            let mut found = request
                .headers
                .iter()
                .filter(|header| header.name.eq_ignore_ascii_case(name));
            let text = found
                .next()
                .map(|header| String::from_utf8_lossy(header.value).trim().to_owned());
            // Reject repeated headers (request smuggling).
            text.filter(|_| found.next().is_none())
        };
        let is_upgrade =
            value("upgrade").is_some_and(|word| word.eq_ignore_ascii_case("websocket"));
        Ok(Self {
            path: request.path.context("a request without a path")?.to_owned(),
            host: value("host"),
            origin: value("origin"),
            socket_key: value("sec-websocket-key").filter(|_| is_upgrade),
        })
    }
}

impl Door {
    /// A door with a token that nobody can guess, or with that of a file, which is made if it is not there.
    pub(crate) fn new(hosts: Vec<String>, file: Option<&Path>) -> Result<Self> {
        let token = match file {
            Some(path) if path.exists() => kept_token(path)?,
            Some(path) => {
                let token = new_token()?;
                output::check_writable(path)?;
                keep_token(path, &token)
                    .with_context(|| format!("{}: cannot write", path.display()))?;
                token
            }
            None => new_token()?,
        };
        Ok(Self { token, hosts })
    }

    /// The resource that a request asks for.
    pub(crate) fn wanted(&self, head: &Head) -> Result<Wanted, Refusal> {
        // A proxy may hand the page on under a longer path; the token is the last part but one.
        let path = head.path.split(['?', '#']).next().unwrap_or_default();
        let (before, last) = path.rsplit_once('/').ok_or(Refusal::NotFound)?;
        if last == self.token {
            return self.allowed(head.host.as_deref()).map(|()| Wanted::Moved);
        }
        if before.rsplit('/').next() != Some(&self.token) {
            return Err(Refusal::NotFound);
        }
        self.allowed(head.host.as_deref())?;
        match (last, &head.socket_key) {
            ("", _) => Ok(Wanted::Page),
            ("socket", Some(key)) => {
                self.allowed(head.origin.as_deref().and_then(host_of_origin))?;
                Ok(Wanted::Socket(key.clone()))
            }
            _ => Err(Refusal::NotFound),
        }
    }

    /// Refuses hosts, with or without a port, that are neither this machine nor allowed by name.
    fn allowed(&self, host: Option<&str>) -> Result<(), Refusal> {
        let host = host.ok_or(Refusal::Forbidden)?;
        let name = name_of_host(host).ok_or(Refusal::Forbidden)?;
        let is_local = name.eq_ignore_ascii_case("localhost")
            || name
                .parse::<IpAddr>()
                .is_ok_and(|address| address.is_loopback());
        let is_named = || {
            self.hosts
                .iter()
                .any(|known| name.eq_ignore_ascii_case(known) || host.eq_ignore_ascii_case(known))
        };
        if is_local || is_named() {
            Ok(())
        } else {
            Err(Refusal::Forbidden)
        }
    }
}

fn new_token() -> Result<String> {
    let mut key = [0u8; TOKEN_BYTES];
    getrandom::fill(&mut key)
        .map_err(|error| anyhow::anyhow!("no random numbers for the address: {error}"))?;
    Ok(key.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Writes a token where only its owner can read it.
fn keep_token(path: &Path, token: &str) -> std::io::Result<()> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    writeln!(options.open(path)?, "{token}")
}

/// The token of a file.
fn kept_token(path: &Path) -> Result<String> {
    let text = files::read_small(path, 1 << 10).with_context(|| path.display().to_string())?;
    let token = String::from_utf8_lossy(&text).trim().to_owned();
    let is_token = token.len() == 2 * TOKEN_BYTES && token.bytes().all(|c| c.is_ascii_hexdigit());
    if !is_token {
        bail!(
            "{}: expected {} hexadecimal digits, as --token-file writes them: remove the file, or name another",
            path.display(),
            2 * TOKEN_BYTES
        );
    }
    Ok(token)
}

/// The host of an origin, with its port: `scheme://host[:port]` of a page that came by HTTP.
fn host_of_origin(origin: &str) -> Option<&str> {
    let (scheme, host) = origin.split_once("://")?;
    ["http", "https"]
        .iter()
        .any(|known| scheme.eq_ignore_ascii_case(known))
        .then_some(host)
}

/// The name in `name[:port]`, `v4[:port]` or `[v6][:port]`; `None` for any other text, so that nothing can stand before or
/// behind a good name.
pub(crate) fn name_of_host(host: &str) -> Option<&str> {
    let (name, port) = match host.strip_prefix('[') {
        Some(rest) => {
            let (address, port) = rest.split_once(']')?;
            address.parse::<Ipv6Addr>().ok()?;
            (address, port)
        }
        None => {
            let (name, port) = host.split_at(host.find(':').unwrap_or(host.len()));
            let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._".contains(&byte);
            let is_name = !name.is_empty() && name.bytes().all(is_plain);
            (is_name.then_some(name)?, port)
        }
    };
    let is_port = match port.strip_prefix(':') {
        Some(digits) => {
            digits.bytes().all(|byte| byte.is_ascii_digit()) && digits.parse::<u16>().is_ok()
        }
        None => port.is_empty(),
    };
    is_port.then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn door() -> Door {
        Door {
            token: "abc".to_owned(),
            hosts: vec!["hub.example.org".to_owned()],
        }
    }

    fn wanted(path: &str, lines: &str) -> Result<Wanted, Refusal> {
        let text = format!("GET {path} HTTP/1.1\r\n{lines}\r\n\r\n");
        door().wanted(&Head::read(&mut text.as_bytes()).expect("a good head"))
    }

    #[test]
    fn nothing_is_answered_without_the_token() {
        let host = "Host: 127.0.0.1:99";
        assert_eq!(wanted("/abc/", host), Ok(Wanted::Page));
        assert_eq!(wanted("/abc", host), Ok(Wanted::Moved));
        assert_eq!(wanted("/proxy/99/abc/?a=/b/", host), Ok(Wanted::Page));
        for path in [
            "/",
            "/abd/",
            "/ab/c/",
            "/abc/socket",
            "/abc/other",
            "/abc/../etc/passwd",
            "/abcd/",
        ] {
            assert_eq!(wanted(path, host), Err(Refusal::NotFound), "{path}");
        }
    }

    #[test]
    fn names_must_be_this_machines_or_allowed() {
        for host in [
            "localhost:1",
            "LOCALHOST",
            "127.0.0.1",
            "127.9.9.9:80",
            "[::1]:80",
            "hub.example.org",
        ] {
            assert_eq!(
                wanted("/abc/", &format!("Host: {host}")),
                Ok(Wanted::Page),
                "{host}"
            );
        }
        for lines in [
            "Host: evil.org",
            "Host: localhost.evil.org",
            "Host: 10.0.0.1",
            "Host: [::1].evil.org",
            "Host: [::1]evil.org:80",
            "Host: [localhost]",
            "Host: localhost:80@evil.org",
            "Host: localhost@evil.org",
            "Host: 127.0.0.1:80:evil.org",
            "Host: 127.0.0.1:99999",
            "Host: localhost:+80",
            "Host: localhost:80/evil.org",
            "Host: localhost/evil.org",
            "Host: localhost#evil.org",
            "Host: hub.example.org:80@evil.org",
            "Host: ",
            "Accept: */*",
            "Host: localhost\r\nHost: localhost",
        ] {
            assert_eq!(wanted("/abc/", lines), Err(Refusal::Forbidden), "{lines}");
        }
    }

    #[test]
    fn a_socket_needs_an_origin_of_this_machine() {
        let asked = |origin: &str| {
            let lines = format!(
                "Host: localhost:5\r\nUpgrade: websocket\r\nSec-WebSocket-Key: k\r\n{origin}"
            );
            wanted("/abc/socket", &lines)
        };
        for origin in [
            "http://localhost:5",
            "http://127.0.0.1:8888",
            "https://hub.example.org",
        ] {
            assert_eq!(
                asked(&format!("Origin: {origin}")),
                Ok(Wanted::Socket("k".to_owned())),
                "{origin}"
            );
        }
        for origin in [
            "Origin: http://evil.org",
            "Origin: http://[::1].evil.org",
            "Origin: http://localhost:80@evil.org",
            "Origin: http://127.0.0.1:80:evil.org",
            "Origin: http://evil.org/http://localhost",
            "Origin: evil://localhost",
            "Origin: null",
            "Accept: */*",
        ] {
            assert_eq!(asked(origin), Err(Refusal::Forbidden), "{origin}");
        }
    }

    #[test]
    fn broken_heads_are_refused() {
        let long = format!("GET /abc/ HTTP/1.1\r\nA: {}", "x".repeat(40_000));
        for text in [
            "",
            "GET /abc/ HTTP/1.1\r\n",
            "POST /abc/ HTTP/1.1\r\n\r\n",
            "\0\0\r\n\r\n",
            &long,
        ] {
            assert!(Head::read(&mut text.as_bytes()).is_err(), "{text:.40}");
        }
    }
}
