//! The sending end of a page's WebSocket.

use std::net::TcpStream;

use anyhow::Result;
use tungstenite::protocol::{Role, WebSocket};
use tungstenite::{Bytes, Message};

/// Sends to a page.
pub(crate) struct Sender(WebSocket<TcpStream>);

impl std::fmt::Debug for Sender {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Sender")
    }
}

impl Sender {
    /// On a stream whose head has been exchanged.
    pub(crate) fn new(stream: TcpStream) -> Self {
        Self(WebSocket::from_raw_socket(stream, Role::Server, None))
    }

    /// Sends a text.
    pub(crate) fn text(&mut self, text: String) -> Result<()> {
        Ok(self.0.send(Message::text(text))?)
    }

    /// Sends bytes.
    pub(crate) fn bytes(&mut self, bytes: Vec<u8>) -> Result<()> {
        Ok(self.0.send(Message::Binary(Bytes::from(bytes)))?)
    }
}
