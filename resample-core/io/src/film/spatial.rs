//! Marks by which players know a stereo film and a panorama.
//!
//! In MP4 they are the boxes `st3d` and `sv3d` of Google's "Spherical Video V2", which video sites, headsets and ffmpeg read; in Matroska they are elements of
//! the track, which ffmpeg copies from those boxes. H.264 repeats the pair in its own stream (frame packing, ITU-T H.264 annex D), which televisions read.

use std::fs::File;
use std::io;
use std::io::{Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::Path;

/// Where the two views of a stereo film lie. The left eye's comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pair {
    /// Beside each other.
    SideBySide,
    /// Above each other.
    TopBottom,
}

/// The directions that a view of a panorama holds, longitude along x and latitude along y.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Directions {
    /// All.
    All,
    /// 180 degrees from left to right.
    Ahead,
}

/// The marks of a film: views and directions. Neither is set for a flat film of one view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Spatial {
    /// Where its two views lie.
    pub pair: Option<Pair>,
    /// The directions of its views, if they are panoramas.
    pub panorama: Option<Directions>,
}

impl Spatial {
    /// Returns true if there is nothing to mark.
    pub fn is_plain(&self) -> bool {
        *self == Self::default()
    }

    /// The boxes of MP4.
    fn boxes(&self) -> Vec<u8> {
        let pair = self.pair.map(|pair| {
            let mode = match pair {
                Pair::TopBottom => 1,
                Pair::SideBySide => 2,
            };
            of_type(b"st3d", &[&VERSION, &[mode]])
        });
        let panorama = self.panorama.map(|directions| {
            // The part that is left out at the left and at the right, in parts of 2^32 of the whole.
            let side = match directions {
                Directions::All => 0u32,
                // A quarter, rounded down.
                Directions::Ahead => (1 << 30) - 1,
            };
            let bounds = [0, 0, side, side].map(u32::to_be_bytes).concat();
            let ahead = [0; 12];
            let projection = [
                of_type(b"prhd", &[&VERSION, &ahead]),
                of_type(b"equi", &[&VERSION, &bounds]),
            ]
            .concat();
            let maker = of_type(b"svhd", &[&VERSION, b"resample\0"]);
            of_type(b"sv3d", &[&maker, &of_type(b"proj", &[&projection])])
        });
        [pair, panorama].into_iter().flatten().flatten().collect()
    }

    /// Marks the film of an MP4 file whose list of contents stands at its end, as ffmpeg writes it.
    ///
    /// # Errors
    /// The file cannot be read or written, or is no such film.
    pub fn mark(&self, path: &Path) -> io::Result<()> {
        if self.is_plain() {
            return Ok(());
        }
        let mut file = File::options().read(true).write(true).open(path)?;
        let (start, mut contents) = list_of_contents(&mut file)?;
        insert(&mut contents, &self.boxes()).ok_or_else(unexpected)?;
        file.seek(SeekFrom::Start(start))?;
        file.write_all(&contents)
    }
}

/// Version and flags of a box: none.
const VERSION: [u8; 4] = [0; 4];

/// The length and the type before the content of a box.
const HEAD: usize = 8;

/// Bytes before the codec's boxes that a description of pictures has; before the descriptions themselves stand version and count.
const DESCRIPTIONS: usize = 8;

fn unexpected() -> io::Error {
    io::Error::other(
        "ffmpeg has written an MP4 file of another order than expected: its film is not marked as stereo or panorama",
    )
}

/// A box of a type, with its content in parts.
fn of_type(name: &[u8; 4], content: &[&[u8]]) -> Vec<u8> {
    let content = content.concat();
    let length = u32::try_from(HEAD + content.len()).unwrap_or(u32::MAX);
    [&length.to_be_bytes(), &name[..], &content].concat()
}

/// The last box of a file, the list of contents, and where it starts.
fn list_of_contents(file: &mut File) -> io::Result<(u64, Vec<u8>)> {
    let end = file.metadata()?.len();
    let mut start = 0;
    while start < end {
        let mut head = [0; 16];
        file.seek(SeekFrom::Start(start))?;
        file.read_exact(&mut head)?;
        let [a, b, c, d, name @ .., _, _, _, _, _, _, _, _] = head;
        let length = match u32::from_be_bytes([a, b, c, d]) {
            // The length stands in 64 bits behind the type.
            1 => u64::from_be_bytes(head[8..].try_into().map_err(io::Error::other)?),
            short => u64::from(short),
        };
        if length < HEAD as u64 {
            return Err(unexpected());
        }
        if &name == b"moov" && start.checked_add(length) == Some(end) {
            let mut contents = Vec::new();
            file.seek(SeekFrom::Start(start))?;
            file.read_to_end(&mut contents)?;
            return Ok((start, contents));
        }
        start = start.saturating_add(length);
    }
    Err(unexpected())
}

/// Inserts boxes at the end of the description of the first track of pictures.
fn insert(contents: &mut Vec<u8>, boxes: &[u8]) -> Option<()> {
    let whole = HEAD..contents.len();
    let tracks = children(contents, whole).filter(|(name, _)| name == b"trak");
    let places = tracks.filter_map(|(_, track)| {
        let media = child(contents, &track, b"mdia")?;
        let inside = child(contents, &media, b"minf")?;
        child(contents, &inside, b"vmhd")?;
        let tables = child(contents, &inside, b"stbl")?;
        let list = child(contents, &tables, b"stsd")?;
        let (_, described) = children(contents, list.start + DESCRIPTIONS..list.end).next()?;
        Some([track, media, inside, tables, list, described])
    });
    let around: Vec<Range<usize>> = places.flatten().take(6).collect();
    let end = around.last()?.end;
    let starts = around.iter().map(|place| place.start - HEAD);
    for start in starts.chain([0]) {
        let length = contents.get_mut(start..start + 4)?;
        let longer = u32::from_be_bytes(length.try_into().ok()?)
            .checked_add(u32::try_from(boxes.len()).ok()?)?;
        length.copy_from_slice(&longer.to_be_bytes());
    }
    contents.splice(end..end, boxes.iter().copied());
    Some(())
}

/// The content of the first box of a type inside another one.
fn child(bytes: &[u8], of: &Range<usize>, name: &[u8; 4]) -> Option<Range<usize>> {
    children(bytes, of.clone())
        .find(|(found, _)| found == name)
        .map(|(_, content)| content)
}

/// Types and contents of the boxes that follow each other in a range.
fn children(
    bytes: &[u8],
    mut range: Range<usize>,
) -> impl Iterator<Item = ([u8; 4], Range<usize>)> {
    std::iter::from_fn(move || {
        let head = bytes.get(range.start..range.start + HEAD)?;
        let (length, name) = head.split_first_chunk::<4>()?;
        let length = u32::from_be_bytes(*length) as usize;
        let end = range.start.checked_add(length)?;
        if length < HEAD || end > range.end {
            return None;
        }
        let content = range.start + HEAD..end;
        range.start = end;
        Some((name.try_into().ok()?, content))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A list of contents with a track of sound before one of pictures.
    fn contents() -> Vec<u8> {
        let described = of_type(b"avc1", &[&[7; 20]]);
        let list = of_type(b"stsd", &[&[0, 0, 0, 0, 0, 0, 0, 1], &described]);
        let track = |kind: &[u8; 4], list: &[u8]| {
            let tables = of_type(b"stbl", &[list]);
            let inside = of_type(b"minf", &[&of_type(kind, &[]), &tables]);
            of_type(b"trak", &[&of_type(b"mdia", &[&inside])])
        };
        let tracks = [track(b"smhd", &list), track(b"vmhd", &list)].concat();
        of_type(b"moov", &[&of_type(b"mvhd", &[&[1; 9]]), &tracks])
    }

    #[test]
    fn boxes_stand_in_the_description_of_pictures() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("film.mp4");
        let before = of_type(b"mdat", &[&[5; 33]]);
        std::fs::write(&path, [&before[..], &contents()].concat()).expect("written");
        let spatial = Spatial {
            pair: Some(Pair::SideBySide),
            panorama: Some(Directions::Ahead),
        };
        spatial.mark(&path).expect("marked");
        let marked = std::fs::read(&path).expect("read");
        let (data, list) = marked.split_at(before.len());
        assert_eq!(data, before, "the pictures stay");
        let whole = HEAD..list.len();
        assert_eq!(
            list[..4],
            u32::try_from(list.len()).expect("short").to_be_bytes()
        );
        let tracks: Vec<_> = children(list, whole)
            .filter(|(name, _)| name == b"trak")
            .collect();
        let described = |track: &Range<usize>| {
            let media = child(list, track, b"mdia").expect("media");
            let inside = child(list, &media, b"minf").expect("inside");
            let tables = child(list, &inside, b"stbl").expect("tables");
            let found = child(list, &tables, b"stsd").expect("descriptions");
            let (_, first) = children(list, found.start + 8..found.end)
                .next()
                .expect("one");
            first
        };
        assert_eq!(described(&tracks[0].1).len(), 20, "the sound stays");
        let film = described(&tracks[1].1);
        let behind = film.start + 20..film.end;
        let pair = child(list, &behind, b"st3d").expect("the pair");
        assert_eq!(list[pair], [0, 0, 0, 0, 2]);
        let sphere = child(list, &behind, b"sv3d").expect("the panorama");
        let projection = child(list, &sphere, b"proj").expect("its projection");
        let bounds = child(list, &projection, b"equi").expect("its bounds");
        assert_eq!(
            list[bounds][12..],
            [0x3f, 0xff, 0xff, 0xff, 0x3f, 0xff, 0xff, 0xff]
        );
    }

    #[test]
    fn other_files_are_refused_and_stay() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("film.mp4");
        let spatial = Spatial {
            pair: Some(Pair::TopBottom),
            panorama: None,
        };
        let no_film = of_type(b"moov", &[&of_type(b"mvhd", &[])]);
        let long = [&u32::MAX.to_be_bytes()[..], b"mdat01234567"].concat();
        for bytes in [&b""[..], b"\0\0\0\0moovabcdefgh", &no_film, &long] {
            std::fs::write(&path, bytes).expect("written");
            assert!(spatial.mark(&path).is_err(), "{bytes:?}");
            assert_eq!(std::fs::read(&path).expect("read"), bytes);
        }
        Spatial::default().mark(&path).expect("nothing to mark");
    }
}
