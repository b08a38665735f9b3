//! Options of `resample view`.
//!
//! The first word is the file; all that follows are options of the command that draws it. `view/words.rs` reads them once
//! the file has said which command that is.

use std::ffi::OsString;
use std::net::IpAddr;

use clap::Args;

/// Options of `resample view`.
#[derive(Args, Clone, Debug)]
pub struct ViewArgs {
    /// How the page is served.
    #[command(flatten)]
    pub serve: ServeArgs,
    /// A volume, a mesh, or a picture and its depth; then any options of volsplat, texmap or warp3d
    #[arg(value_name = "FILE [OPTIONS]", required = true, num_args = 1.., trailing_var_arg = true, allow_hyphen_values = true)]
    pub words: Vec<OsString>,
}

/// How the page is served.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Page")]
pub struct ServeArgs {
    /// Do not open a browser; only print the address
    #[arg(long)]
    pub no_open: bool,
    /// Port of the page [default: any that is free]
    #[arg(long, value_name = "N")]
    pub port: Option<u16>,
    /// Address to listen at; any other than the default can be reached by other machines [default: 127.0.0.1]
    #[arg(long, value_name = "ADDRESS")]
    pub bind: Option<IpAddr>,
    /// Additional host name to accept, e.g. behind a reverse proxy; repeatable
    #[arg(long, value_name = "NAME")]
    pub allow_host: Vec<String>,
}

impl ServeArgs {
    /// These options, with `others` as fallback.
    pub(crate) fn or(self, other: Self) -> Self {
        Self {
            no_open: self.no_open || other.no_open,
            port: self.port.or(other.port),
            bind: self.bind.or(other.bind),
            allow_host: [self.allow_host, other.allow_host].concat(),
        }
    }
}
