//! The listener: gives the page, and hands each socket its own thread.

use std::io::{ErrorKind, Write};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result};

use super::heads::OpenHeads;
use super::http::{Door, Head, Refusal, Wanted};
use super::{page, socket};
use crate::args::ServeArgs;
use crate::view::mailbox::Mailbox;

/// Time after which a client that takes no more bytes of an answer is given up.
const WRITE_PATIENCE: Duration = Duration::from_secs(10);

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
    pub(crate) fn address(&self) -> String {
        format!("http://{}/{}/", self.address, self.door.token)
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
            let page = page::page(&door.hosts)?;
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
