//! DICOM files of a few pixels, written element by element.

use std::io::Write;

use crate::input::test_files::Folder;
use crate::volume::Volume;

pub(crate) const IMPLICIT: &str = "1.2.840.10008.1.2";
pub(crate) const EXPLICIT: &str = "1.2.840.10008.1.2.1";
pub(crate) const DEFLATED: &str = "1.2.840.10008.1.2.1.99";
pub(crate) const BIG_ENDIAN: &str = "1.2.840.10008.1.2.2";
pub(crate) const RLE: &str = "1.2.840.10008.1.2.5";
pub(crate) const JPEG_LS: &str = "1.2.840.10008.1.2.4.80";

/// The bytes of elements, written one after the other.
#[derive(Clone)]
pub(crate) struct Elements {
    pub(crate) bytes: Vec<u8>,
    pub(crate) syntax: &'static str,
}

impl Elements {
    pub(crate) fn new(syntax: &'static str) -> Self {
        Self {
            bytes: Vec::new(),
            syntax,
        }
    }

    pub(crate) fn number(&mut self, value: u32, bytes: usize) {
        let mut number = value.to_le_bytes()[..bytes].to_vec();
        if self.syntax == BIG_ENDIAN {
            number.reverse();
        }
        self.bytes.extend(number);
    }

    pub(crate) fn head(&mut self, tag: u32, kind: &[u8; 2], length: u32) {
        self.number(tag >> 16, 2);
        self.number(tag & 0xFFFF, 2);
        let is_long = matches!(kind, b"OW" | b"OB" | b"SQ" | b"UN");
        if self.syntax == IMPLICIT {
            self.number(length, 4);
        } else {
            self.bytes.extend(kind);
            self.bytes
                .extend(if is_long { [0; 2].as_slice() } else { &[] });
            self.number(length, if is_long { 4 } else { 2 });
        }
    }

    pub(crate) fn bytes(mut self, tag: u32, kind: &[u8; 2], value: &[u8]) -> Self {
        let padded = value.len() + value.len() % 2;
        self.head(tag, kind, padded as u32);
        self.bytes.extend(value);
        self.bytes.extend(if padded > value.len() {
            [b' '].as_slice()
        } else {
            &[]
        });
        self
    }

    pub(crate) fn text(self, tag: u32, text: &str) -> Self {
        self.bytes(tag, b"DS", text.as_bytes())
    }

    pub(crate) fn short(mut self, tag: u32, value: u16) -> Self {
        self.head(tag, b"US", 2);
        self.number(u32::from(value), 2);
        self
    }

    /// A sequence of known length.
    pub(crate) fn items(mut self, tag: u32, items: &[Self]) -> Self {
        let length: usize = items.iter().map(|item| item.bytes.len() + 8).sum();
        self.head(tag, b"SQ", length as u32);
        for item in items {
            self.item(0xE000, item.bytes.len() as u32);
            self.bytes.extend(&item.bytes);
        }
        self
    }

    /// A sequence whose end is marked.
    pub(crate) fn open_items(mut self, tag: u32, items: &[Self]) -> Self {
        self.head(tag, b"SQ", u32::MAX);
        for item in items {
            self.item(0xE000, u32::MAX);
            self.bytes.extend(&item.bytes);
            self.item(0xE00D, 0);
        }
        self.item(0xE0DD, 0);
        self
    }

    pub(crate) fn item(&mut self, element: u32, length: u32) {
        self.number(0xFFFE, 2);
        self.number(element, 2);
        self.number(length, 4);
    }

    /// The file: preamble, head, elements.
    pub(crate) fn file(&self) -> Vec<u8> {
        let head =
            Self::new(EXPLICIT).bytes(0x0002_0010, b"UI", format!("{}\0", self.syntax).as_bytes());
        let length =
            Self::new(EXPLICIT).bytes(0x0002_0000, b"UL", &(head.bytes.len() as u32).to_le_bytes());
        let mut elements = self.bytes.clone();
        if self.syntax == DEFLATED {
            let mut packer =
                flate2::write::DeflateEncoder::new(Vec::new(), flate2::Compression::default());
            packer.write_all(&elements).expect("in memory");
            elements = packer.finish().expect("in memory");
        }
        [
            vec![0; 128],
            b"DICM".to_vec(),
            length.bytes,
            head.bytes,
            elements,
        ]
        .concat()
    }
}

/// The values that tests change in a file of 2x2 pixels.
#[derive(Clone, Copy)]
pub(crate) struct Slice {
    pub(crate) syntax: &'static str,
    pub(crate) series: &'static str,
    pub(crate) instance: &'static str,
    pub(crate) position: &'static str,
    pub(crate) orientation: &'static str,
    pub(crate) slope: &'static str,
    pub(crate) intercept: &'static str,
    pub(crate) bits_stored: u16,
    pub(crate) is_signed: bool,
    pub(crate) values: [u16; 4],
}

pub(crate) const SLICE: Slice = Slice {
    syntax: EXPLICIT,
    series: "1.2.3",
    instance: "",
    position: "10\\20\\30",
    orientation: "1\\0\\0\\0\\1\\0",
    slope: "1",
    intercept: "0",
    bits_stored: 16,
    is_signed: false,
    values: [1, 2, 3, 4000],
};

impl Slice {
    /// Everything but the picture.
    pub(crate) fn elements(&self) -> Elements {
        let high_bit = self.bits_stored - 1;
        Elements::new(self.syntax)
            .open_items(
                0x0008_1140,
                &[Elements::new(self.syntax).text(0x0008_1155, "1.9")],
            )
            .text(0x0008_103E, "a name")
            .text(0x0018_0050, "5")
            .text(0x0020_000E, self.series)
            .text(0x0020_0013, self.instance)
            .text(0x0020_0032, self.position)
            .text(0x0020_0037, self.orientation)
            .short(0x0028_0002, 1)
            .text(0x0028_0004, "MONOCHROME2")
            .short(0x0028_0010, 2)
            .short(0x0028_0011, 2)
            .text(0x0028_0030, "3\\2")
            .short(0x0028_0100, 16)
            .short(0x0028_0101, self.bits_stored)
            .short(0x0028_0102, high_bit)
            .short(0x0028_0103, u16::from(self.is_signed))
            .text(0x0028_1052, self.intercept)
            .text(0x0028_1053, self.slope)
    }

    pub(crate) fn file(&self) -> Vec<u8> {
        let mut values = Elements::new(self.syntax);
        self.values
            .iter()
            .for_each(|&value| values.number(u32::from(value), 2));
        self.elements()
            .bytes(0x7FE0_0010, b"OW", &values.bytes)
            .file()
    }

    /// The picture as one fragment of two planes of literals.
    pub(crate) fn rle_file(&self) -> Vec<u8> {
        let plane = |shift: u32| {
            let bytes = self.values.iter().map(move |value| (value >> shift) as u8);
            [3u8].into_iter().chain(bytes).collect::<Vec<u8>>()
        };
        let mut table = vec![2u32, 64, 69];
        table.resize(16, 0);
        let table: Vec<u8> = table
            .iter()
            .flat_map(|number| number.to_le_bytes())
            .collect();
        self.packed_file(RLE, &[table, plane(8), plane(0)].concat())
    }

    pub(crate) fn jpeg_ls_file(&self) -> Vec<u8> {
        let mut fragment = Vec::new();
        jpegls::encode(&self.values, 2, 2, &mut fragment).expect("four numbers");
        self.packed_file(JPEG_LS, &fragment)
    }

    /// The picture as one fragment.
    pub(crate) fn packed_file(&self, syntax: &'static str, fragment: &[u8]) -> Vec<u8> {
        let mut elements = Self { syntax, ..*self }.elements();
        let padded = fragment.len() + fragment.len() % 2;
        elements.head(0x7FE0_0010, b"OW", u32::MAX);
        elements.item(0xE000, 0);
        elements.item(0xE000, padded as u32);
        elements.bytes.extend(fragment);
        elements
            .bytes
            .resize(elements.bytes.len() + padded - fragment.len(), 0);
        elements.item(0xE0DD, 0);
        elements.file()
    }

    pub(crate) fn load(&self) -> Volume {
        Folder::new()
            .load(&[&self.file()])
            .unwrap_or_else(|error| panic!("{error}"))
    }

    pub(crate) fn refusal(&self) -> String {
        Folder::new().refusal(&[&self.file()])
    }
}
