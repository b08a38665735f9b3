//! The WebSocket of a page: one thread listens, and the thread that draws sends.
//!
//! Both sides have their own end of the protocol. The listening one never writes, so that its answers cannot fall into the
//! middle of a picture; browsers ask for none.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use anyhow::Result;
use tungstenite::Message;
use tungstenite::handshake::derive_accept_key;
use tungstenite::protocol::{Role, WebSocket, WebSocketConfig};

use crate::view::mailbox::Mailbox;
use crate::view::message::Asked;
use crate::view::sender::Sender;

/// Longest message of the page, bytes: a transfer function of a thousand knots has 100 kB.
const MAX_MESSAGE_BYTES: usize = 1 << 20;

/// Time after which a page that takes no more bytes is given up.
const WRITE_PATIENCE: Duration = Duration::from_secs(20);

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
pub(crate) fn serve(mut stream: TcpStream, key: &str, mailbox: &Mailbox) -> Result<()> {
    let accept = derive_accept_key(key.as_bytes());
    let head = format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {accept}\r\n\r\n"
    );
    stream.write_all(head.as_bytes())?;
    stream.set_read_timeout(None)?;
    stream.set_write_timeout(Some(WRITE_PATIENCE))?;
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
        // What is not understood comes from no page of ours.
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
