//! A program outside, with its complaints kept.

use std::fs::File;
use std::io::{ErrorKind, Read, Seek};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};

use resample_core::Error;

use crate::files::fault;

/// Most bytes of complaints that are shown: some twenty lines, of which the first matter.
const MAX_COMPLAINT_BYTES: u64 = 2_000;

/// Checks that `tool` can be started; the error names `path`, the film that needs it.
///
/// # Errors
/// It is not on the PATH, or it fails.
pub fn check_tool(tool: &str, path: &Path, instead: &str) -> Result<(), Error> {
    let mut command = Command::new(tool);
    command
        .arg("-version")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Err(error) if error.kind() == ErrorKind::NotFound => Err(fault(
            path,
            format!(
                "{tool} was not found on the PATH, and a video needs it: install ffmpeg, or {instead}"
            ),
        )),
        Ok(status) => Err(fault(
            path,
            format!("a video needs {tool}, but `{tool} -version` fails ({status})"),
        )),
        Err(error) => Err(fault(path, format!("{tool} cannot be started: {error}"))),
    }
}

/// A running program. Dropped before it has ended, it is stopped.
pub(super) struct Running {
    pub(super) child: Child,
    tool: &'static str,
    complaints: File,
}

impl Running {
    /// Starts `command`, whose input and output are set.
    pub(super) fn start(tool: &'static str, mut command: Command) -> std::io::Result<Self> {
        let complaints = tempfile::tempfile()?;
        command.stderr(complaints.try_clone()?);
        // Ctrl-C in a terminal goes to the whole group; only this program is to decide what follows from it.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let child = command.spawn()?;
        Ok(Self {
            child,
            tool,
            complaints,
        })
    }

    /// Waits until the program has ended; the error holds its messages.
    pub(super) fn end(&mut self) -> Result<(), String> {
        drop(self.child.stdin.take());
        let status = self.child.wait().map_err(|error| error.to_string())?;
        match status.success() {
            true => Ok(()),
            false => Err(self.failure(status)),
        }
    }

    fn failure(&mut self, status: ExitStatus) -> String {
        let mut said = Vec::new();
        let rewound = self.complaints.rewind();
        let read = rewound.and_then(|()| {
            (&self.complaints)
                .take(MAX_COMPLAINT_BYTES)
                .read_to_end(&mut said)
        });
        let said = match read {
            Ok(_) => String::from_utf8_lossy(&said).trim().replace('\n', "; "),
            Err(error) => error.to_string(),
        };
        format!("{} failed ({status}): {said}", self.tool)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // Both fail only where it has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A command that reads nothing from the terminal; a file is named to it absolutely, so that no name is taken for an
/// option or a protocol.
pub(super) fn command(tool: &str) -> Command {
    let mut command = Command::new(tool);
    command.args(["-hide_banner", "-loglevel", "error"]);
    command.stdin(Stdio::null()).stdout(Stdio::null());
    command
}
