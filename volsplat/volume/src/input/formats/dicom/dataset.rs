//! The elements of a DICOM file by their tags, and what their bytes say.
//!
//! Takes the tree that `elements.rs` reads, whose values are slices of the file, and gives text and numbers.
//! Source: DICOM PS3.5 (encoding of data sets).

use std::collections::HashMap;

use crate::input::fault::excerpt;
use crate::volume::Endian;

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
