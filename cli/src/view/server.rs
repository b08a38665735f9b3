//! The listener: gives the page, and hands each socket its own thread.

use std::io::{ErrorKind, Write};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use anyhow::{Context, Result};

use super::http::{Door, Head, Refusal, Wanted};
use super::mailbox::Mailbox;
use super::{page, socket};
use crate::args::ServeArgs;

/// Connections at once; a browser opens six at most.
const MOST_CONNECTIONS: usize = 32;

/// Time in which the head of a request must come.
const PATIENCE: Duration = Duration::from_secs(10);

/// A port that is listened at.
pub(super) struct Server {
    listener: TcpListener,
    door: Door,
    address: SocketAddr,
}

impl Server {
    /// Takes a port.
    pub(super) fn bind(args: &ServeArgs) -> Result<Self> {
        let address = args.bind.unwrap_or(IpAddr::V4(Ipv4Addr::LOCALHOST));
        let port = args.port.unwrap_or(0);
        let listener = TcpListener::bind((address, port)).with_context(|| {
            format!("cannot listen at {address}, port {port}: choose another with --port or --bind")
        })?;
        let mut hosts = args.allow_host.clone();
        if !address.is_loopback() && !address.is_unspecified() {
            hosts.push(address.to_string());
        }
        Ok(Self {
            address: listener.local_addr()?,
            listener,
            door: Door::new(hosts)?,
        })
    }

    /// The address of the page.
    pub(super) fn address(&self) -> String {
        format!("http://{}/{}/", self.address, self.door.token)
    }

    /// Listens from now on, on threads of its own. Requests of the page arrive in the mailbox.
    pub(super) fn start(self) -> Result<Mailbox> {
        let mailbox = Mailbox::default();
        let (to, door) = (mailbox.clone(), Arc::new(self.door));
        let open = Arc::new(AtomicUsize::new(0));
        std::thread::Builder::new()
            .name("listener".to_owned())
            .spawn(move || {
                for stream in self.listener.incoming() {
                    let Ok(stream) = stream else { continue };
                    if open.load(Ordering::SeqCst) >= MOST_CONNECTIONS {
                        continue;
                    }
                    let (to, door, open) = (to.clone(), door.clone(), open.clone());
                    open.fetch_add(1, Ordering::SeqCst);
                    let served = std::thread::Builder::new()
                        .name("connection".to_owned())
                        .spawn({
                            let open = open.clone();
                            move || {
                                // A connection that breaks off is nobody's fault.
                                let _ = serve(stream, &door, &to);
                                open.fetch_sub(1, Ordering::SeqCst);
                            }
                        });
                    if served.is_err() {
                        open.fetch_sub(1, Ordering::SeqCst);
                    }
                }
            })?;
        Ok(mailbox)
    }
}

fn serve(mut stream: TcpStream, door: &Door, mailbox: &Mailbox) -> Result<()> {
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_nodelay(true)?;
    let Ok(head) = Head::read(&mut stream) else {
        return answer(&mut stream, "400 Bad Request", &[], b"");
    };
    match door.wanted(&head) {
        Ok(Wanted::Page) => {
            let page = page::page()?;
            answer(&mut stream, "200 OK", &page.headers, page.html.as_bytes())
        }
        Ok(Wanted::Moved) => {
            let to = format!("Location: {}/", door.token);
            answer(&mut stream, "308 Permanent Redirect", &[to], b"")
        }
        Ok(Wanted::Socket(key)) => socket::serve(stream, &key, mailbox),
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
