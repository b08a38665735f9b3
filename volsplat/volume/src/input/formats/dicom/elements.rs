//! Reads the elements of a DICOM file: sequences, and fragments of packed pictures; looks them up by their tags, as text and numbers.
//!
//! Takes the whole file in memory and returns a tree of slices of it. Nothing is copied and nothing is allocated by a
//! length that the file claims: a value is a slice, so a length beyond the end is found when the slice is taken.
//! Source: DICOM PS3.5 (encoding of data sets) and PS3.10 (file format).
//! Limits: elements after the picture are not read; a sequence of known length inside implicit encoding is only entered if
//! its tag is one that is needed here.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::Read;

use resample_io::Gate;

use crate::input::file::{Fault, excerpt, unsupported};
use crate::volume::Endian;

const TRANSFER_SYNTAX: Tag = 0x0002_0010;
const META_LENGTH: Tag = 0x0002_0000;
const ITEM: Tag = 0xFFFE_E000;
const ITEM_END: Tag = 0xFFFE_E00D;
const SEQUENCE_END: Tag = 0xFFFE_E0DD;

/// A length that is not given; the value ends with a tag of its own.
const UNDEFINED: u32 = 0xFFFF_FFFF;

/// Bytes before the first element: a preamble that means nothing, and the mark.
const PREAMBLE_BYTES: usize = 128;

/// The mark behind the preamble.
const MARK: &[u8] = b"DICM";

/// The class of DICOMDIR, an index of other files, and that of segmentations.
const INDEX_CLASS: &[u8] = b"1.2.840.10008.1.3.10";
const SEGMENTATION_CLASS: &[u8] = b"1.2.840.10008.5.1.4.1.1.66.4";

/// The syntaxes of elements without a head.
const IMPLICIT: &str = "1.2.840.10008.1.2";
const EXPLICIT: &str = "1.2.840.10008.1.2.1";

/// Elements that must follow one another at the start of a file without a mark. A guess: each has 4 bytes that say nothing but that.
const FEWEST_ELEMENTS: usize = 3;

/// Sequences within sequences that are entered. Enhanced pictures need three; more than this is a forgery.
const MAX_DEPTH: usize = 12;

/// Sequences that are needed: shared and per-frame functional groups, what places a frame, scales its values and gives its window, and segments.
const NEEDED_SEQUENCES: [Tag; 9] = [
    0x0062_0002,
    0x0062_000A,
    0x5200_9229,
    0x5200_9230,
    0x0020_9113,
    0x0020_9116,
    0x0028_9110,
    0x0028_9132,
    0x0028_9145,
];

/// Returns true if a file that begins with `head` is DICOM.
pub(crate) fn begins(head: &[u8]) -> bool {
    has_mark(head) || bare_syntax(head).is_some()
}

fn has_mark(head: &[u8]) -> bool {
    head.get(PREAMBLE_BYTES..)
        .is_some_and(|rest| rest.starts_with(MARK))
}

/// Returns true if a file that begins with `head` lists other files.
pub(crate) fn is_index(head: &[u8]) -> bool {
    has_class(head, INDEX_CLASS)
}

/// Returns true if a file that begins with `head` holds segments.
pub(crate) fn is_segmentation(head: &[u8]) -> bool {
    has_class(head, SEGMENTATION_CLASS)
}

/// The head names the class of the file's object.
fn has_class(head: &[u8], class: &[u8]) -> bool {
    has_mark(head)
        && head[PREAMBLE_BYTES..]
            .windows(class.len())
            .any(|part| part == class)
}

/// The syntax of a file that begins with its elements, as some archives write it: groups 2 or 8 first, tags that rise, lengths that lead to the next.
fn bare_syntax(head: &[u8]) -> Option<&'static str> {
    let begins_so = |is_explicit: bool| {
        let encoding = Encoding {
            endian: Endian::Little,
            is_explicit,
        };
        let mut cursor = Cursor {
            bytes: head,
            at: 0,
            encoding,
        };
        let mut last = 0;
        for number in 0..FEWEST_ELEMENTS {
            let Ok(tag) = cursor.tag() else {
                return false;
            };
            let Ok((kind, length)) = cursor.kind_and_length() else {
                return false;
            };
            let is_first_group = matches!(tag >> 16, 2 | 8);
            let is_kind = kind.is_none_or(|kind| kind.iter().all(u8::is_ascii_uppercase));
            if !is_kind || tag <= last || (number == 0 && !is_first_group) || length % 2 == 1 {
                return false;
            }
            last = tag;
            if cursor.take(tag, length).is_err() {
                return false;
            }
        }
        true
    };
    if begins_so(true) {
        Some(EXPLICIT)
    } else {
        begins_so(false).then_some(IMPLICIT)
    }
}

/// How the elements are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Encoding {
    endian: Endian,
    /// True if each element says which kind of value it has.
    is_explicit: bool,
}

/// The head of a file: how the rest is written.
pub(crate) struct Meta {
    /// The UID that says how elements and pictures are written.
    pub(crate) syntax: String,
    /// The elements behind the head, unpacked if they were packed, and how they are written.
    encoding: Encoding,
}

impl Meta {
    /// Byte order of numbers and of plain pictures.
    pub(crate) fn endian(&self) -> Endian {
        self.encoding.endian
    }
}

/// Reads the head of a file, and gives the bytes of its elements, unpacked if they are packed.
pub(crate) fn read_meta<'a>(file: &'a [u8], gate: &Gate) -> Result<(Meta, Cow<'a, [u8]>), Fault> {
    let bare = bare_syntax(file);
    let begin = match (has_mark(file), bare) {
        (true, _) => PREAMBLE_BYTES + MARK.len(),
        (false, Some(_)) => 0,
        (false, None) => {
            return Err(Fault::Invalid(
                "the mark DICM is not at byte 128".to_owned(),
            ));
        }
    };
    let encoding = Encoding {
        endian: Endian::Little,
        is_explicit: true,
    };
    let mut cursor = Cursor {
        bytes: file,
        at: begin,
        encoding,
    };
    let mut head = Dataset::default();
    // Faulty heads occur in real files: what was read until then counts.
    while cursor.peek_group() == Some(2) && cursor.element(&mut head, 0).is_ok() {}
    let length: Option<[u8; 4]> = head
        .bytes(META_LENGTH)
        .and_then(|bytes| bytes.try_into().ok());
    // The length counts from behind its own element, which has 12 bytes.
    let claimed =
        length.and_then(|bytes| (u32::from_le_bytes(bytes) as usize).checked_add(begin + 12));
    let rest = file
        .get(
            claimed
                .filter(|&claimed| claimed > cursor.at)
                .unwrap_or(cursor.at)..,
        )
        .unwrap_or_default();
    let syntax = head
        .text(TRANSFER_SYNTAX)
        .or_else(|| bare.map(str::to_owned))
        .ok_or_else(|| "the head names no transfer syntax".to_owned())?;
    let is_explicit = syntax != IMPLICIT;
    let endian = if syntax == "1.2.840.10008.1.2.2" {
        Endian::Big
    } else {
        Endian::Little
    };
    let bytes = match syntax.as_str() {
        "1.2.840.10008.1.2.1.99" => Cow::Owned(inflated(rest, gate)?),
        _ => Cow::Borrowed(rest),
    };
    Ok((
        Meta {
            syntax,
            encoding: Encoding {
                endian,
                is_explicit,
            },
        },
        bytes,
    ))
}

fn inflated(packed: &[u8], gate: &Gate) -> Result<Vec<u8>, String> {
    let (mut bytes, held) = (Vec::new(), packed.len() as u64);
    let most = gate.most_unpacked(held);
    let read = flate2::bufread::DeflateDecoder::new(packed)
        .take(most + 1)
        .read_to_end(&mut bytes);
    read.map_err(|error| format!("the packed elements cannot be unpacked: {error}"))?;
    if bytes.len() as u64 > most {
        return Err(format!(
            "{held} packed bytes unpack to more than {most}: if that is meant, allow it with --max-memory"
        ));
    }
    Ok(bytes)
}

/// Reads the elements up to and including the picture.
pub(crate) fn parse<'a>(bytes: &'a [u8], meta: &Meta) -> Result<Dataset<'a>, Fault> {
    let mut cursor = Cursor {
        bytes,
        at: 0,
        encoding: meta.encoding,
    };
    cursor.dataset(0)
}

/// A place in the elements.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    encoding: Encoding,
}

impl<'a> Cursor<'a> {
    /// Elements up to the end of the bytes, of the item, or behind the picture.
    fn dataset(&mut self, depth: usize) -> Result<Dataset<'a>, Fault> {
        let mut dataset = Dataset {
            endian: self.encoding.endian,
            ..Dataset::default()
        };
        while self.at < self.bytes.len() {
            match self.element(&mut dataset, depth)? {
                ITEM_END => break,
                PIXEL_DATA if depth == 0 => break,
                _ => {}
            }
        }
        Ok(dataset)
    }

    /// Reads one element into `dataset` and gives its tag.
    fn element(&mut self, dataset: &mut Dataset<'a>, depth: usize) -> Result<Tag, Fault> {
        let tag = self.tag()?;
        if matches!(tag, ITEM | ITEM_END | SEQUENCE_END) {
            self.number_32()?;
            return Ok(tag);
        }
        let (kind, length) = self.kind_and_length()?;
        let is_sequence =
            kind == Some(*b"SQ") || (kind.is_none() && NEEDED_SEQUENCES.contains(&tag));
        let value = match (tag, length) {
            (PIXEL_DATA, UNDEFINED) => Value::Fragments(self.fragments()?),
            (_, UNDEFINED) => self.sequence_without_length(kind, depth)?,
            (_, length) if is_sequence => {
                let bytes = self.take(tag, length)?;
                let mut inner = Cursor {
                    bytes,
                    at: 0,
                    encoding: self.encoding,
                };
                Value::Items(inner.items(depth + 1)?)
            }
            (_, length) => Value::Bytes(self.take(tag, length)?),
        };
        dataset.elements.insert(tag, value);
        Ok(tag)
    }

    fn sequence_without_length(
        &mut self,
        kind: Option<[u8; 2]>,
        depth: usize,
    ) -> Result<Value<'a>, Fault> {
        let outer = self.encoding;
        // A sequence of unknown kind is always written the implicit way.
        if kind == Some(*b"UN") {
            self.encoding = Encoding {
                endian: Endian::Little,
                is_explicit: false,
            };
        }
        let items = self.items(depth + 1);
        self.encoding = outer;
        Ok(Value::Items(items?))
    }

    /// The items up to the end of the bytes or of the sequence.
    fn items(&mut self, depth: usize) -> Result<Vec<Dataset<'a>>, Fault> {
        if depth > MAX_DEPTH {
            return Err(unsupported(format!(
                "sequences are nested more than {MAX_DEPTH} deep"
            )));
        }
        let mut items = Vec::new();
        while self.at < self.bytes.len() {
            match (self.tag()?, self.number_32()?) {
                (ITEM, UNDEFINED) => items.push(self.dataset(depth)?),
                (ITEM, length) => {
                    let bytes = self.take(ITEM, length)?;
                    let mut inner = Cursor {
                        bytes,
                        at: 0,
                        encoding: self.encoding,
                    };
                    items.push(inner.dataset(depth)?);
                }
                (SEQUENCE_END, _) => break,
                (tag, _) => {
                    return Err(Fault::Invalid(format!(
                        "{} stands where an item must begin",
                        tag_name(tag)
                    )));
                }
            }
        }
        Ok(items)
    }

    fn fragments(&mut self) -> Result<Vec<&'a [u8]>, Fault> {
        let mut fragments = Vec::new();
        while self.at < self.bytes.len() {
            match (self.tag()?, self.number_32()?) {
                (ITEM, length) => fragments.push(self.take(ITEM, length)?),
                (SEQUENCE_END, _) => break,
                (tag, _) => {
                    return Err(Fault::Invalid(format!(
                        "{} stands where a fragment must begin",
                        tag_name(tag)
                    )));
                }
            }
        }
        Ok(fragments)
    }

    /// The kind of the value, where it is given, and the length in bytes.
    fn kind_and_length(&mut self) -> Result<(Option<[u8; 2]>, u32), String> {
        if !self.encoding.is_explicit {
            return Ok((None, self.number_32()?));
        }
        let kind: [u8; 2] = self.array()?;
        let is_long = matches!(
            &kind,
            b"OB"
                | b"OD"
                | b"OF"
                | b"OL"
                | b"OV"
                | b"OW"
                | b"SQ"
                | b"SV"
                | b"UC"
                | b"UN"
                | b"UR"
                | b"UT"
                | b"UV"
        );
        if is_long {
            self.array::<2>()?;
            return Ok((Some(kind), self.number_32()?));
        }
        Ok((Some(kind), u32::from(self.number_16()?)))
    }

    fn peek_group(&self) -> Option<u16> {
        let bytes: [u8; 2] = self.bytes.get(self.at..self.at + 2)?.try_into().ok()?;
        Some(u16::from_le_bytes(bytes))
    }

    fn tag(&mut self) -> Result<Tag, String> {
        Ok((Tag::from(self.number_16()?) << 16) | Tag::from(self.number_16()?))
    }

    fn number_16(&mut self) -> Result<u16, String> {
        Ok(self.encoding.endian.number_16(self.array()?))
    }

    fn number_32(&mut self) -> Result<u32, String> {
        Ok(self.encoding.endian.number_32(self.array()?))
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let bytes = self
            .bytes
            .get(self.at..)
            .and_then(|rest| rest.first_chunk::<N>());
        let bytes = bytes.ok_or_else(|| "the file ends inside an element".to_owned())?;
        self.at += N;
        Ok(*bytes)
    }

    fn take(&mut self, tag: Tag, length: u32) -> Result<&'a [u8], String> {
        let held = self.bytes.len() - self.at;
        let fault = || {
            format!(
                "element {} claims {length} bytes, but {held} follow: it is cut off",
                tag_name(tag)
            )
        };
        let end = self.at.checked_add(length as usize).ok_or_else(fault)?;
        let bytes = self.bytes.get(self.at..end).ok_or_else(fault)?;
        self.at = end;
        Ok(bytes)
    }
}

/// Group and element number in one.
pub(crate) type Tag = u32;

/// The picture's bytes.
pub(crate) const PIXEL_DATA: Tag = 0x7FE0_0010;

/// Elements by their tags.
#[derive(Debug, Default)]
pub(crate) struct Dataset<'a> {
    pub(crate) elements: HashMap<Tag, Value<'a>>,
    pub(crate) endian: Endian,
}

/// The value of an element.
#[derive(Debug)]
pub(crate) enum Value<'a> {
    Bytes(&'a [u8]),
    Items(Vec<Dataset<'a>>),
    /// The table of offsets, then the fragments of packed pictures.
    Fragments(Vec<&'a [u8]>),
}

impl<'a> Dataset<'a> {
    pub(crate) fn value(&self, tag: Tag) -> Option<&Value<'a>> {
        self.elements.get(&tag)
    }

    pub(crate) fn bytes(&self, tag: Tag) -> Option<&'a [u8]> {
        match self.elements.get(&tag) {
            Some(Value::Bytes(bytes)) => Some(bytes),
            _ => None,
        }
    }

    /// Text without the padding at its end; absent where empty.
    pub(crate) fn text(&self, tag: Tag) -> Option<String> {
        let text = String::from_utf8_lossy(self.bytes(tag)?).into_owned();
        let text = text.trim_matches([' ', '\0', '\n', '\r']);
        (!text.is_empty()).then(|| text.to_owned())
    }

    /// A whole number of 16 bits.
    pub(crate) fn number_16(&self, tag: Tag) -> Option<u16> {
        let bytes: [u8; 2] = self.bytes(tag)?.get(..2)?.try_into().ok()?;
        Some(self.endian.number_16(bytes))
    }

    /// Decimal numbers, written as text between backslashes; an error where they are none.
    pub(crate) fn decimals<const N: usize>(&self, tag: Tag) -> Result<Option<[f64; N]>, String> {
        let Some(text) = self.text(tag) else {
            return Ok(None);
        };
        let numbers: Option<Vec<f64>> = text
            .split('\\')
            .map(|word| word.trim().parse().ok())
            .collect();
        let numbers = numbers.filter(|numbers| numbers.iter().all(|number| number.is_finite()));
        numbers
            .and_then(|numbers| numbers.try_into().ok())
            .map(Some)
            .ok_or_else(|| {
                format!(
                    "element {} is '{}': expected {N} decimal number(s)",
                    tag_name(tag),
                    excerpt(&text)
                )
            })
    }

    /// The items of a sequence; none if it is absent.
    pub(crate) fn items(&self, tag: Tag) -> &[Dataset<'a>] {
        match self.elements.get(&tag) {
            Some(Value::Items(items)) => items,
            _ => &[],
        }
    }
}

/// The way the standard writes a tag.
pub(crate) fn tag_name(tag: Tag) -> String {
    format!("({:04X},{:04X})", tag >> 16, tag & 0xFFFF)
}
