//! Videos, by way of the program `ffmpeg`.
//!
//! Takes opaque pictures as bytes and pipes them to an `ffmpeg` process that writes the file; its error output
//! is shown when it fails. The colours are marked as those of BT.709, of which sRGB has the primaries.
//! Source: the manual of ffmpeg, options of `rawvideo`, `scale`, `libx264` and `libvpx-vp9`.
//! Limits: 8 bits per channel, half the resolution for colour (yuv420p), which every player can show.

use std::fs::File;
use std::io::{ErrorKind, Read, Seek, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use anyhow::{Context, Result, bail};

/// Kind of video file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Container {
    /// H.264 in MP4.
    Mp4,
    /// VP9 in WebM.
    WebM,
    /// H.264 in Matroska.
    Matroska,
}

/// A running `ffmpeg`. Dropped before [`Pipe::finish`], it is stopped.
pub(super) struct Pipe {
    child: Child,
    complaints: File,
}

/// Most bytes of complaints that are shown: some twenty lines, of which the first matter.
const MAX_COMPLAINT_BYTES: u64 = 2_000;

/// Checks that `ffmpeg` is there; the error names `path` and says what to do.
pub(super) fn check_ffmpeg(path: &Path) -> Result<()> {
    let mut command = Command::new("ffmpeg");
    command
        .arg("-version")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Err(error) if error.kind() == ErrorKind::NotFound => bail!(
            "{}: ffmpeg was not found on the PATH, and a video needs it: install ffmpeg, or write an animated PNG \
             (.apng) or numbered pictures (.png)",
            path.display()
        ),
        Ok(status) => {
            bail!(
                "{}: a video needs ffmpeg, but `ffmpeg -version` fails ({status})",
                path.display()
            )
        }
        Err(error) => {
            Err(error).with_context(|| format!("{}: ffmpeg cannot be started", path.display()))
        }
    }
}

impl Pipe {
    /// Starts `ffmpeg`, which will write to `path`, a file that exists.
    pub(super) fn open(
        path: &Path,
        container: Container,
        size: [u32; 2],
        fps: u16,
    ) -> Result<Self> {
        let complaints = tempfile::tempfile()?;
        let mut command = Command::new("ffmpeg");
        command.args(["-hide_banner", "-loglevel", "error", "-nostdin", "-y"]);
        command.args(["-f", "rawvideo", "-pixel_format", "rgb24"]);
        command.args([
            "-video_size",
            &format!("{}x{}", size[0], size[1]),
            "-framerate",
            &fps.to_string(),
        ]);
        command.args([
            "-i",
            "pipe:0",
            "-vf",
            "scale=out_color_matrix=bt709:out_range=tv,format=yuv420p",
        ]);
        command.args([
            "-colorspace",
            "bt709",
            "-color_primaries",
            "bt709",
            "-color_trc",
            "iec61966-2-1",
        ]);
        command.args(encoding(container));
        // An absolute name is never taken for an option or a protocol.
        command.arg(std::path::absolute(path)?);
        command
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(complaints.try_clone()?);
        // Ctrl-C in a terminal goes to the whole group; only this program is to decide what follows from it.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let child = command.spawn().context("ffmpeg cannot be started")?;
        Ok(Self { child, complaints })
    }

    /// Adds a picture: red, green and blue of each pixel, row by row.
    pub(super) fn add(&mut self, rgb: &[u8]) -> Result<()> {
        let Some(pipe) = self.child.stdin.as_mut() else {
            bail!("ffmpeg listens no more")
        };
        match pipe.write_all(rgb) {
            // ffmpeg exited early; its stderr says why.
            Err(error) if error.kind() == ErrorKind::BrokenPipe => self.end(),
            other => Ok(other?),
        }
    }

    /// Waits until the file is complete.
    pub(super) fn finish(mut self) -> Result<()> {
        drop(self.child.stdin.take());
        match self.child.wait()?.success() {
            true => Ok(()),
            false => self.end(),
        }
    }

    /// Gives what `ffmpeg` said when it failed, as an error.
    fn end(&mut self) -> Result<()> {
        drop(self.child.stdin.take());
        let status = self.child.wait()?;
        let mut said = Vec::new();
        self.complaints.rewind()?;
        (&self.complaints)
            .take(MAX_COMPLAINT_BYTES)
            .read_to_end(&mut said)?;
        bail!(
            "ffmpeg failed ({status}): {}",
            String::from_utf8_lossy(&said).trim()
        )
    }
}

impl Drop for Pipe {
    fn drop(&mut self) {
        // Both fail only where it has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The encoder and the container. The qualities are those at which the encoders' guides see no loss.
fn encoding(container: Container) -> &'static [&'static str] {
    match container {
        Container::Mp4 => &["-c:v", "libx264", "-crf", "18", "-f", "mp4"],
        Container::Matroska => &["-c:v", "libx264", "-crf", "18", "-f", "matroska"],
        Container::WebM => &[
            "-c:v",
            "libvpx-vp9",
            "-crf",
            "20",
            "-b:v",
            "0",
            "-f",
            "webm",
        ],
    }
}
