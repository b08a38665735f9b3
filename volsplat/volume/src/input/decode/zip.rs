//! ZIP archives, as far as bundles of pictures and arrays need them: the list of members at the end, and members stored or deflated.
//!
//! Source: PKWARE's application note. Limits: no encryption, no archive of several files, none beyond 4 GiB.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};

use resample_io::Gate;

use crate::input::{Fault, unsupported};

/// The first bytes of an archive that is not empty.
pub(crate) const MAGIC: &[u8] = b"PK\x03\x04";

/// Bytes of the record at the end, and of those before the names of a member in the list and before its data.
const END_BYTES: u64 = 22;
const LISTED_BYTES: usize = 46;
const LOCAL_BYTES: usize = 30;

/// Longest comment behind the record at the end.
const MOST_COMMENT: u64 = 0xffff;

/// A member of an archive.
struct Member {
    name: String,
    /// 0 for stored, 8 for deflated.
    method: u16,
    packed: u64,
    unpacked: u64,
    /// Where its own header begins.
    place: u64,
}

/// An opened archive.
pub(crate) struct Archive {
    file: BufReader<File>,
    held: u64,
    members: Vec<Member>,
}

fn short(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

fn word(bytes: &[u8], at: usize) -> u64 {
    u64::from(u32::from_le_bytes([
        bytes[at],
        bytes[at + 1],
        bytes[at + 2],
        bytes[at + 3],
    ]))
}

fn broken(error: std::io::Error) -> Fault {
    Fault::Invalid(format!("the archive cannot be read: {error}"))
}

impl Archive {
    /// Reads the list of members.
    pub(crate) fn open(file: File, held: u64) -> Result<Self, Fault> {
        let mut file = BufReader::new(file);
        let tail_bytes = held.min(END_BYTES + MOST_COMMENT);
        let tail = bytes_at(&mut file, held - tail_bytes, tail_bytes)?;
        let ends = tail.windows(END_BYTES as usize);
        let end = ends.rev().find(|bytes| bytes.starts_with(b"PK\x05\x06"));
        let none = "the ZIP archive has no list of its members: the file is cut off";
        let end = end.ok_or_else(|| Fault::Invalid(none.to_owned()))?;
        let (bytes, place) = (word(end, 12), word(end, 16));
        if place.saturating_add(bytes) > held {
            return Err(Fault::Invalid(
                "the list of members of the ZIP archive lies behind its end: the file is damaged, or larger than 4 GiB"
                    .to_owned(),
            ));
        }
        let list = bytes_at(&mut file, place, bytes)?;
        let members = members_of(&list, usize::from(short(end, 10)))?;
        Ok(Self {
            file,
            held,
            members,
        })
    }

    /// The members in their order: name and unpacked bytes.
    pub(crate) fn members(&self) -> impl Iterator<Item = (&str, u64)> {
        self.members
            .iter()
            .map(|member| (member.name.as_str(), member.unpacked))
    }

    /// The name of the first member that is called `name`, in whatever folder.
    pub(crate) fn find(&self, name: &str) -> Option<&str> {
        let is_called = |member: &&Member| member.name.rsplit('/').next() == Some(name);
        let found = self.members.iter().find(is_called);
        found.map(|member| member.name.as_str())
    }

    /// The unpacked bytes of a member.
    pub(crate) fn read(&mut self, name: &str, gate: &Gate) -> Result<Vec<u8>, Fault> {
        let located = |what: String| Fault::Invalid(format!("member '{name}': {what}"));
        let member = self.members.iter().find(|member| member.name == name);
        let Some(member) = member else {
            return Err(located("the archive does not hold it".to_owned()));
        };
        let head = bytes_at(&mut self.file, member.place, LOCAL_BYTES as u64)?;
        if !head.starts_with(MAGIC) {
            return Err(located("its header is damaged".to_owned()));
        }
        let names = u64::from(short(&head, 26)) + u64::from(short(&head, 28));
        let data = member.place + LOCAL_BYTES as u64 + names;
        if data.saturating_add(member.packed) > self.held {
            return Err(located("it reaches behind the end of the file".to_owned()));
        }
        gate.ask_unpacked(member.unpacked, member.packed, "the members of the archive")
            .map_err(located)?;
        self.file.seek(SeekFrom::Start(data)).map_err(broken)?;
        let packed = (&mut self.file).take(member.packed);
        let mut bytes = Vec::new();
        let read = match member.method {
            0 => packed.take(member.unpacked).read_to_end(&mut bytes),
            8 => flate2::bufread::DeflateDecoder::new(packed)
                .take(member.unpacked)
                .read_to_end(&mut bytes),
            other => {
                let what = format!(
                    "member '{name}' is packed by method {other}: expected 0 (stored) or 8 (deflated)"
                );
                return Err(unsupported(what));
            }
        };
        read.map_err(|error| located(format!("it cannot be unpacked: {error}")))?;
        if bytes.len() as u64 != member.unpacked {
            let (got, unpacked) = (bytes.len(), member.unpacked);
            return Err(located(format!("it has {got} bytes, expected {unpacked}")));
        }
        Ok(bytes)
    }
}

fn bytes_at(file: &mut BufReader<File>, place: u64, count: u64) -> Result<Vec<u8>, Fault> {
    file.seek(SeekFrom::Start(place)).map_err(broken)?;
    let mut bytes = Vec::new();
    let got = file.take(count).read_to_end(&mut bytes).map_err(broken)?;
    match got as u64 == count {
        true => Ok(bytes),
        false => Err(Fault::Invalid("the ZIP archive is cut off".to_owned())),
    }
}

fn members_of(list: &[u8], count: usize) -> Result<Vec<Member>, Fault> {
    let mut members = Vec::new();
    let mut rest = list;
    for number in 0..count {
        let damaged = || Fault::Invalid(format!("member {number} of the ZIP archive is damaged"));
        if rest.len() < LISTED_BYTES || !rest.starts_with(b"PK\x01\x02") {
            return Err(damaged());
        }
        let lengths = [28, 30, 32].map(|at| usize::from(short(rest, at)));
        let name = rest.get(LISTED_BYTES..LISTED_BYTES + lengths[0]);
        members.push(Member {
            name: String::from_utf8_lossy(name.ok_or_else(damaged)?).into_owned(),
            method: short(rest, 10),
            packed: word(rest, 20),
            unpacked: word(rest, 24),
            place: word(rest, 42),
        });
        let next = LISTED_BYTES + lengths.iter().sum::<usize>();
        rest = rest.get(next..).ok_or_else(damaged)?;
    }
    Ok(members)
}
