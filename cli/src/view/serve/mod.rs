//! The viewer's server: takes connections, hands over the messages of the page.
//!
//! `server` listens, answers with the page and carries messages; `heads` limits connections whose request is still arriving, and `http` checks a
//! request.

pub(crate) mod server;
pub(crate) mod heads;
pub(crate) mod http;
