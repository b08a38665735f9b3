//! The viewer's server: takes connections, hands over the messages of the page.
//!
//! `server` listens, `heads` limits connections whose request is still arriving, `http` checks a request, `page` is the answer, and
//! `socket` carries messages.

pub(crate) mod server;
pub(crate) mod heads;
pub(crate) mod http;
