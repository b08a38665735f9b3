//! Long films in pieces, so that a run that ends before its time loses little.
//!
//! Takes the pictures of a film one after another; each piece is a film without sound in a folder beside the whole one, `FILM.pieces`, and appears complete
//! or not at all. At the end they are put together without being encoded again. A later run keeps the pieces that carry the mark of its film, and its bytes are those of
//! a run that nothing interrupted.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::temporary::{Listed, sweep, temporary_file};
use crate::film::{Coding, Original, Part, Writer, join};

/// Pictures of a piece: five seconds at 25 pictures per second. Each piece begins with a picture that is coded alone, as players want it every few seconds.
pub(super) const PIECE_PICTURES: usize = 125;

/// The file of the folder that says which film the pieces are of.
const MARK: &str = "mark";

/// The treatment of pieces that an earlier run left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Left<'a> {
    /// Those of the film with this mark are kept.
    Kept(&'a str),
    /// They are in the way where they are of the film with this mark, and replaced where they are not.
    Refused(&'a str),
}

/// A film in pieces. Dropped before [`Pieces::finish`], it leaves those that are complete.
pub(super) struct Pieces {
    folder: PathBuf,
    coding: Coding,
    /// The pictures of all pieces that are complete.
    complete: usize,
    piece: Option<Piece>,
}

/// The piece that is written.
struct Piece {
    // The order matters: what writes to the file ends before the file is removed.
    writer: Writer,
    file: NamedTempFile,
    _listed: Listed,
    pictures: usize,
}

/// The folder of the pieces of a film.
pub(super) fn folder(film: &Path) -> PathBuf {
    let mut name = film.as_os_str().to_owned();
    name.push(".pieces");
    PathBuf::from(name)
}

impl Pieces {
    /// Begins a film, or goes on with one.
    pub(super) fn begin(film: &Path, coding: Coding, left: Left) -> io::Result<Self> {
        let folder = folder(film);
        let (Left::Kept(mark) | Left::Refused(mark)) = left;
        let is_same = fs::read_to_string(folder.join(MARK)).is_ok_and(|found| found == mark);
        let mut pieces = Self {
            folder,
            coding,
            complete: 0,
            piece: None,
        };
        sweep(&pieces.folder);
        if is_same {
            while pieces.file(pieces.complete).is_file() {
                pieces.complete += PIECE_PICTURES;
            }
        }
        if matches!(left, Left::Refused(_)) && pieces.complete > 0 {
            return Err(io::Error::other(format!(
                "{} pictures of this film are in {}: --resume draws the rest; to begin anew, remove that folder",
                pieces.complete,
                pieces.folder.display()
            )));
        }
        if !is_same {
            pieces.clear();
            fs::create_dir_all(&pieces.folder)?;
            fs::write(pieces.folder.join(MARK), mark)?;
        }
        Ok(pieces)
    }

    /// The pictures of the pieces that are complete.
    pub(super) fn complete(&self) -> usize {
        self.complete
    }

    /// Adds a picture.
    pub(super) fn add(&mut self, rgb: &[u8]) -> io::Result<()> {
        let mut piece = match self.piece.take() {
            Some(piece) => piece,
            None => self.begun()?,
        };
        piece.writer.add(rgb)?;
        piece.pictures += 1;
        match piece.pictures < PIECE_PICTURES {
            true => self.piece = Some(piece),
            false => self.close(piece)?,
        }
        Ok(())
    }

    fn begun(&self) -> io::Result<Piece> {
        let (file, listed) = temporary_file(&self.folder)?;
        Ok(Piece {
            writer: Writer::piece(file.path(), &self.coding)?,
            file,
            _listed: listed,
            pictures: 0,
        })
    }

    fn close(&mut self, piece: Piece) -> io::Result<()> {
        piece.writer.finish()?;
        piece.file.persist(self.file(self.complete))?;
        self.complete += piece.pictures;
        Ok(())
    }

    /// The file of the piece that begins with picture `first`.
    fn file(&self, first: usize) -> PathBuf {
        self.folder.join(format!("{first:07}.mp4"))
    }

    /// Puts the pieces together, with the sound of the film that they are made from, and removes them.
    pub(super) fn finish(mut self, path: &Path, original: Option<&Original>) -> io::Result<()> {
        if let Some(piece) = self.piece.take() {
            self.close(piece)?;
        }
        let parts: Vec<Part> = (0..self.complete)
            .step_by(PIECE_PICTURES)
            .map(|first| Part {
                path: self.file(first),
                pictures: PIECE_PICTURES.min(self.complete - first),
            })
            .collect();
        join(&parts, path, &self.coding, original)?;
        self.clear();
        Ok(())
    }

    /// Removes what pieces and marks there are, and the folder if nothing else is in it.
    fn clear(&self) {
        let entries = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        for entry in entries {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            let is_piece = name
                .strip_suffix(".mp4")
                .is_some_and(|number| number.bytes().all(|byte| byte.is_ascii_digit()));
            if is_piece || name == MARK {
                // It may be gone already, which is as good.
                let _ = fs::remove_file(entry.path());
            }
        }
        let _ = fs::remove_dir(&self.folder);
    }
}

impl Drop for Pieces {
    fn drop(&mut self) {
        self.piece = None;
        if self.complete == 0 {
            self.clear();
        }
    }
}
