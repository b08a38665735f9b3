//! PLY as a table: the header, and the rows of an element as numbers.
//!
//! Takes a reader at the first byte of a file, gives its [`Header`]; [`Rows`] then hands over chosen columns of one element after
//! another, row by row, so that no column is held twice. Text and binary of either byte order, properties in any order and of
//! any scalar type. Source: the format's description by G. Turk, 1994.
//! Limits: lists are passed over; faces are the business of the readers of meshes.

use std::io::{BufRead, Read};

use crate::refused::{Refused, excerpt};

/// Longest header that is read. The longest of known programs has 5 kB; this is a guess beyond it.
const MAX_HEADER_BYTES: u64 = 1 << 20;

/// Longest line of a row of text, bytes. A guess: a row of Gaussians has 1 kB.
const MAX_LINE_BYTES: u64 = 1 << 20;

/// Rows of binary files are read in pieces of about this size, bytes: they stay in the processor's second cache.
const PIECE_BYTES: usize = 1 << 18;

/// Returns true if a file that begins with these bytes is PLY.
///
/// ```
/// assert!(resample_io::ply::begins(b"ply\nformat ascii 1.0\n"));
/// ```
pub fn begins(head: &[u8]) -> bool {
    head.starts_with(b"ply\n") || head.starts_with(b"ply\r\n")
}

/// How the rows are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// A line of text for each.
    Text,
    /// Binary, the lowest byte first.
    LittleEndian,
    /// Binary, the highest byte first.
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    /// 8 bits, signed.
    I8,
    /// 8 bits.
    U8,
    /// 16 bits, signed.
    I16,
    /// 16 bits.
    U16,
    /// 32 bits, signed.
    I32,
    /// 32 bits.
    U32,
    /// 32 bits, floating point.
    F32,
    /// 64 bits, floating point.
    F64,
}

impl Scalar {
    fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of a number in a binary file.
    pub fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The largest value of a whole number; 1 for floating point.
    pub fn largest(self) -> f64 {
        match self {
            Self::I8 => f64::from(i8::MAX),
            Self::U8 => f64::from(u8::MAX),
            Self::I16 => f64::from(i16::MAX),
            Self::U16 => f64::from(u16::MAX),
            Self::I32 => f64::from(i32::MAX),
            Self::U32 => f64::from(u32::MAX),
            Self::F32 | Self::F64 => 1.0,
        }
    }
}

/// A column of an element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Property {
    /// Its name.
    pub name: String,
    /// The type of its numbers.
    pub scalar: Scalar,
    /// For a list, the type of its length.
    pub length: Option<Scalar>,
}

/// A table of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Element {
    /// Its name.
    pub name: String,
    /// Rows.
    pub count: u64,
    /// Columns.
    pub properties: Vec<Property>,
}

impl Element {
    /// The place of the first column of this name that is no list.
    pub fn column(&self, name: &str) -> Option<usize> {
        let is_named = |p: &Property| p.name == name && p.length.is_none();
        self.properties.iter().position(is_named)
    }

    /// Fewest bytes that a row takes: a number of text has a digit and what parts it from the next.
    fn least_row_bytes(&self, encoding: Encoding) -> u64 {
        let bytes = |p: &Property| match encoding {
            Encoding::Text => 2,
            _ => p.length.unwrap_or(p.scalar).bytes() as u64,
        };
        self.properties.iter().map(bytes).sum()
    }

    fn has_lists(&self) -> bool {
        self.properties.iter().any(|p| p.length.is_some())
    }
}

/// The beginning of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Header {
    /// How the rows are written.
    pub encoding: Encoding,
    /// The tables, in the order in which their rows follow.
    pub elements: Vec<Element>,
    /// The comments, without the word.
    pub comments: Vec<String>,
    /// Bytes of the header.
    pub bytes: u64,
}

impl Header {
    /// Reads the header and leaves the file at the first row.
    ///
    /// # Errors
    /// A header that is cut off or contradicts the format.
    pub fn read(file: &mut dyn BufRead) -> Result<Self, Refused> {
        let mut lines = file.take(MAX_HEADER_BYTES);
        let mut encoding = None;
        let (mut elements, mut comments) = (Vec::<Element>::new(), Vec::new());
        let mut bytes = 0;
        for number in 1.. {
            let mut line = Vec::new();
            let got = lines.read_until(b'\n', &mut line).map_err(broken)?;
            bytes += got as u64;
            if !line.ends_with(b"\n") {
                return Err(Refused::Invalid(format!(
                    "the header has no line 'end_header' within {bytes} bytes: the file is cut off or no PLY"
                )));
            }
            let line = String::from_utf8_lossy(&line);
            let line = line.trim();
            let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            let located = |what: String| format!("line {number} of the header: {what}");
            match word {
                "ply" if number == 1 => {}
                "format" => encoding = Some(encoding_of(rest).map_err(located)?),
                "comment" | "obj_info" => comments.push(rest.trim().to_owned()),
                "element" => elements.push(element_of(rest).map_err(located)?),
                "property" => {
                    let property = property_of(rest).map_err(located)?;
                    let none = || located("a property before the first element".to_owned());
                    let element = elements.last_mut().ok_or_else(none)?;
                    element.properties.push(property);
                }
                "" => {}
                "end_header" => break,
                other => {
                    return Err(Refused::Invalid(located(format!(
                        "'{}': expected format, comment, element, property or end_header",
                        excerpt(other)
                    ))));
                }
            }
        }
        let none = "the header has no line 'format'".to_owned();
        Ok(Self {
            encoding: encoding.ok_or(none)?,
            elements,
            comments,
            bytes,
        })
    }

    /// The first element of a name.
    pub fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|element| element.name == name)
    }
}

fn broken(error: std::io::Error) -> String {
    format!("cannot be read to its end: {error}")
}

fn encoding_of(rest: &str) -> Result<Encoding, String> {
    let name = rest.split_whitespace().next().unwrap_or("");
    match name {
        "ascii" => Ok(Encoding::Text),
        "binary_little_endian" => Ok(Encoding::LittleEndian),
        "binary_big_endian" => Ok(Encoding::BigEndian),
        other => Err(format!(
            "the format is '{}': expected ascii, binary_little_endian or binary_big_endian",
            excerpt(other)
        )),
    }
}

fn element_of(rest: &str) -> Result<Element, String> {
    let mut words = rest.split_whitespace();
    let (name, count) = (
        words.next(),
        words.next().and_then(|word| word.parse().ok()),
    );
    let (Some(name), Some(count)) = (name, count) else {
        return Err(format!(
            "'element {}': expected a name and a number of rows",
            excerpt(rest)
        ));
    };
    Ok(Element {
        name: name.to_owned(),
        count,
        properties: Vec::new(),
    })
}

fn property_of(rest: &str) -> Result<Property, String> {
    let words: Vec<&str> = rest.split_whitespace().collect();
    let (length, scalar, name) = match words[..] {
        ["list", length, scalar, name, ..] => (Some(length), scalar, name),
        [scalar, name, ..] => (None, scalar, name),
        _ => {
            return Err(format!(
                "'property {}': expected a type and a name",
                excerpt(rest)
            ));
        }
    };
    let scalar_of = |word: &str| {
        let unknown = || format!("the type '{}' is none of the format's", excerpt(word));
        Scalar::from_name(word).ok_or_else(unknown)
    };
    Ok(Property {
        name: name.to_owned(),
        scalar: scalar_of(scalar)?,
        length: length.map(scalar_of).transpose()?,
    })
}

/// The rows of a file, element by element.
pub struct Rows<'a> {
    file: &'a mut dyn BufRead,
    encoding: Encoding,
    /// Bytes of the file that are not read yet.
    left: u64,
}

impl<'a> Rows<'a> {
    /// The rows behind a header that was read from a file of so many bytes.
    pub fn new(file: &'a mut dyn BufRead, header: &Header, file_bytes: u64) -> Self {
        Self {
            file,
            encoding: header.encoding,
            left: file_bytes.saturating_sub(header.bytes),
        }
    }

    /// Refuses an element whose rows are more than the rest of the file can hold.
    ///
    /// # Errors
    /// Names the element and both numbers.
    pub fn check(&self, element: &Element) -> Result<(), Refused> {
        let Element { name, count, .. } = element;
        let name = excerpt(name);
        let least = element.least_row_bytes(self.encoding);
        if least == 0 && *count > 0 {
            return Err(Refused::Invalid(format!(
                "element '{name}' has {count} rows and no property"
            )));
        }
        // The last number of a text may end with the file.
        let spare = u64::from(self.encoding == Encoding::Text);
        if count.saturating_mul(least) > self.left.saturating_add(spare) {
            return Err(Refused::Invalid(format!(
                "the header says {count} rows of element '{name}', which take at least {} bytes, but {} are left: the file is cut \
                 off or its header is wrong",
                count.saturating_mul(least),
                self.left
            )));
        }
        Ok(())
    }

    /// Reads all rows of the element that comes next, and hands over the numbers of the chosen columns, none of which is a list.
    ///
    /// # Errors
    /// A file that ends too early, a word that is no number, and any error of the receiver; each with its row, counted from 0.
    pub fn each(
        &mut self,
        element: &Element,
        columns: &[usize],
        take: &mut dyn FnMut(&[f64]) -> Result<(), String>,
    ) -> Result<(), Refused> {
        self.check(element)?;
        match self.encoding {
            Encoding::Text => self.lines(element, columns, take),
            _ if element.has_lists() => self.uneven_rows(element, columns, take),
            _ => self.even_rows(element, columns, take),
        }
    }

    /// Passes over all rows of the element that comes next.
    ///
    /// # Errors
    /// A file that ends too early.
    pub fn pass(&mut self, element: &Element) -> Result<(), Refused> {
        self.each(element, &[], &mut |_| Ok(()))
    }

    fn even_rows(
        &mut self,
        element: &Element,
        columns: &[usize],
        take: &mut dyn FnMut(&[f64]) -> Result<(), String>,
    ) -> Result<(), Refused> {
        let widths: Vec<usize> = element
            .properties
            .iter()
            .map(|p| p.scalar.bytes())
            .collect();
        let row_bytes: usize = widths.iter().sum();
        let cells: Vec<(usize, Scalar)> = (columns.iter())
            .map(|&at| (widths[..at].iter().sum(), element.properties[at].scalar))
            .collect();
        let rows_at_once = (PIECE_BYTES / row_bytes.max(1)).max(1) as u64;
        let mut numbers = vec![0.0; cells.len()];
        let (mut piece, mut done) = (Vec::new(), 0);
        while done < element.count {
            let rows = rows_at_once.min(element.count - done);
            piece.resize(rows as usize * row_bytes, 0);
            self.fill(&mut piece, element, done)?;
            for (row, bytes) in (done..).zip(piece.chunks_exact(row_bytes)) {
                for (number, (offset, scalar)) in numbers.iter_mut().zip(&cells) {
                    *number = self.number(&bytes[*offset..], *scalar);
                }
                take(&numbers).map_err(|what| at(element, row, what))?;
            }
            done += rows;
        }
        Ok(())
    }

    fn uneven_rows(
        &mut self,
        element: &Element,
        columns: &[usize],
        take: &mut dyn FnMut(&[f64]) -> Result<(), String>,
    ) -> Result<(), Refused> {
        let mut all = vec![0.0; element.properties.len()];
        let mut numbers = vec![0.0; columns.len()];
        for row in 0..element.count {
            for (number, property) in all.iter_mut().zip(&element.properties) {
                let first = property.length.unwrap_or(property.scalar);
                let mut bytes = [0; 8];
                self.fill(&mut bytes[..first.bytes()], element, row)?;
                *number = self.number(&bytes, first);
                if property.length.is_some() {
                    self.skip(*number * property.scalar.bytes() as f64, element, row)?;
                }
            }
            for (number, &column) in numbers.iter_mut().zip(columns) {
                *number = all[column];
            }
            take(&numbers).map_err(|what| at(element, row, what))?;
        }
        Ok(())
    }

    fn lines(
        &mut self,
        element: &Element,
        columns: &[usize],
        take: &mut dyn FnMut(&[f64]) -> Result<(), String>,
    ) -> Result<(), Refused> {
        let mut line = Vec::new();
        let mut numbers = vec![0.0; columns.len()];
        let mut row = 0;
        while row < element.count {
            line.clear();
            let mut limited = (&mut *self.file).take(MAX_LINE_BYTES);
            let got = limited.read_until(b'\n', &mut line).map_err(broken)?;
            self.left = self.left.saturating_sub(got as u64);
            if got == 0 {
                return Err(Refused::Invalid(cut(element, row)));
            }
            let text = String::from_utf8_lossy(&line);
            if text.trim().is_empty() {
                continue;
            }
            let words = words_of(&text, element).map_err(|what| at(element, row, what))?;
            for (number, &column) in numbers.iter_mut().zip(columns) {
                let parsed = words[column].parse().map_err(|_| {
                    let name = excerpt(&element.properties[column].name);
                    let word = excerpt(words[column]);
                    at(
                        element,
                        row,
                        format!("{name} is '{word}': expected a number"),
                    )
                });
                *number = parsed?;
            }
            take(&numbers).map_err(|what| at(element, row, what))?;
            row += 1;
        }
        Ok(())
    }

    fn fill(&mut self, bytes: &mut [u8], element: &Element, row: u64) -> Result<(), Refused> {
        let read = self.file.read_exact(bytes);
        read.map_err(|_| cut(element, row))?;
        self.left = self.left.saturating_sub(bytes.len() as u64);
        Ok(())
    }

    fn skip(&mut self, count: f64, element: &Element, row: u64) -> Result<(), Refused> {
        if !(count >= 0.0 && count <= self.left as f64) {
            return Err(Refused::Invalid(cut(element, row)));
        }
        let count = count as u64;
        let mut limited = (&mut *self.file).take(count);
        let passed = std::io::copy(&mut limited, &mut std::io::sink()).map_err(broken)?;
        self.left = self.left.saturating_sub(passed);
        match passed == count {
            true => Ok(()),
            false => Err(Refused::Invalid(cut(element, row))),
        }
    }

    /// The number at the beginning of some bytes.
    fn number(&self, bytes: &[u8], scalar: Scalar) -> f64 {
        let is_big = self.encoding == Encoding::BigEndian;
        match scalar {
            Scalar::I8 => f64::from(bytes[0].cast_signed()),
            Scalar::U8 => f64::from(bytes[0]),
            Scalar::I16 => f64::from(i16::from_le_bytes(ordered(bytes, is_big))),
            Scalar::U16 => f64::from(u16::from_le_bytes(ordered(bytes, is_big))),
            Scalar::I32 => f64::from(i32::from_le_bytes(ordered(bytes, is_big))),
            Scalar::U32 => f64::from(u32::from_le_bytes(ordered(bytes, is_big))),
            Scalar::F32 => f64::from(f32::from_le_bytes(ordered(bytes, is_big))),
            Scalar::F64 => f64::from_le_bytes(ordered(bytes, is_big)),
        }
    }
}

/// The first bytes, the lowest first.
#[inline(always)]
fn ordered<const N: usize>(bytes: &[u8], is_big: bool) -> [u8; N] {
    let mut ordered = [0; N];
    ordered.copy_from_slice(&bytes[..N]);
    if is_big {
        ordered.reverse();
    }
    ordered
}

/// The words of a line: of a property its number, of a list its length.
fn words_of<'t>(line: &'t str, element: &Element) -> Result<Vec<&'t str>, String> {
    let mut words = line.split_ascii_whitespace();
    let mut firsts = Vec::with_capacity(element.properties.len());
    for property in &element.properties {
        let missing = || {
            let (name, all) = (excerpt(&property.name), element.properties.len());
            format!("the line ends before {name}: expected {all} properties")
        };
        let first = words.next().ok_or_else(missing)?;
        firsts.push(first);
        if property.length.is_some() {
            let length: usize = first.parse().map_err(|_| missing())?;
            // Stops at the end of the line, whatever the length.
            if length > 0 {
                words.nth(length - 1).ok_or_else(missing)?;
            }
        }
    }
    Ok(firsts)
}

fn at(element: &Element, row: u64, what: impl std::fmt::Display) -> Refused {
    Refused::Invalid(format!(
        "element '{}', row {row}: {what}",
        excerpt(&element.name)
    ))
}

fn cut(element: &Element, row: u64) -> String {
    let (name, count) = (excerpt(&element.name), element.count);
    format!("the file ends in element '{name}', near row {row} of {count}: it is cut off")
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "comment made here\nelement camera 1\nproperty list uchar int parts\nproperty short id\n\
         element vertex 2\nproperty float x\nproperty double y\nproperty uchar red\nend_header\n";

    /// The columns y, x and red of each vertex.
    fn table(file: &[u8]) -> Result<Vec<[f64; 3]>, Refused> {
        let mut reader = file;
        let header = Header::read(&mut reader)?;
        let mut rows = Rows::new(&mut reader, &header, file.len() as u64);
        let mut table = Vec::new();
        for element in &header.elements {
            if element.name != "vertex" {
                rows.pass(element)?;
                continue;
            }
            let columns = ["y", "x", "red"].map(|name| element.column(name).expect("a column"));
            rows.each(element, &columns, &mut |row| {
                table.push([row[0], row[1], row[2]]);
                Ok(())
            })?;
        }
        Ok(table)
    }

    fn binary(big: bool) -> Vec<u8> {
        let name = if big { "big" } else { "little" };
        let mut file = format!("ply\nformat binary_{name}_endian 1.0\n{HEADER}").into_bytes();
        let mut put = |bytes: &[u8]| {
            let mut bytes = bytes.to_vec();
            if big {
                bytes.reverse();
            }
            file.extend(bytes);
        };
        put(&[2]);
        put(&7i32.to_le_bytes());
        put(&8i32.to_le_bytes());
        put(&(-3i16).to_le_bytes());
        for (x, y, red) in [(1.5f32, -2.25f64, 200u8), (3.0, 1e9 + 0.125, 0)] {
            put(&x.to_le_bytes());
            put(&y.to_le_bytes());
            put(&[red]);
        }
        file
    }

    const EXPECTED: [[f64; 3]; 2] = [[-2.25, 1.5, 200.0], [1e9 + 0.125, 3.0, 0.0]];

    #[test]
    fn binary_of_either_order_and_text_give_the_same_table() {
        assert_eq!(table(&binary(false)).expect("good"), EXPECTED);
        assert_eq!(table(&binary(true)).expect("good"), EXPECTED);
        let rows = "2 7 8 -3\n\n1.5 -2.25 200\r\n3 1000000000.125 0";
        let text = format!("ply\r\nformat ascii 1.0\r\n{HEADER}{rows}");
        assert_eq!(table(text.as_bytes()).expect("good"), EXPECTED);
    }

    #[test]
    fn the_header_is_read() {
        let file = binary(false);
        let header = Header::read(&mut file.as_slice()).expect("good");
        assert_eq!(header.comments, ["made here"]);
        assert_eq!(header.encoding, Encoding::LittleEndian);
        let camera = header.element("camera").expect("an element");
        assert_eq!(camera.properties[0].length, Some(Scalar::U8));
        assert_eq!(camera.column("parts"), None, "a list is no column");
        assert!(header.element("face").is_none());
    }

    fn refusal(file: &[u8]) -> String {
        table(file).expect_err("must be refused").to_string()
    }

    #[test]
    fn every_cut_is_refused() {
        let good = binary(false);
        for end in 0..good.len() {
            assert!(table(&good[..end]).is_err(), "cut at {end}");
        }
        assert!(refusal(&good[..good.len() - 1]).contains("left"));
        let text = format!("ply\nformat ascii 1.0\n{HEADER}0 0\n1 2 3\n");
        let why = refusal(text.as_bytes());
        assert!(why.contains("'vertex'"), "{why}");
        let short = format!("ply\nformat ascii 1.0\n{HEADER}0 0\n1 2     \n3 4 5\n");
        let why = refusal(short.as_bytes());
        assert!(why.contains("row 0") && why.contains("before red"), "{why}");
    }

    #[test]
    fn forged_counts_take_no_memory() {
        for count in ["18446744073709551615", "1000000000000"] {
            let head = HEADER.replace("vertex 2", &format!("vertex {count}"));
            let file = format!("ply\nformat binary_little_endian 1.0\n{head}\0\0\0");
            assert!(refusal(file.as_bytes()).contains(count));
        }
        let empty = "ply\nformat ascii 1.0\nelement vertex 99\nend_header\n";
        let header = Header::read(&mut empty.as_bytes()).expect("good");
        let mut left: &[u8] = &[];
        let mut rows = Rows::new(&mut left, &header, 0);
        assert!(rows.pass(&header.elements[0]).is_err(), "no property");
        // A list of 2^32 - 1 numbers.
        let head = "element camera 1\nproperty list uint double parts\nelement vertex 0\nproperty int x\n\
             property int y\nproperty int red\nend_header\n";
        let file = format!("ply\nformat binary_little_endian 1.0\n{head}");
        let file = [file.as_bytes(), &[0xff; 8]].concat();
        assert!(refusal(&file).contains("cut off"));
    }

    #[test]
    fn faults_of_the_header_name_their_line() {
        let bad = |header: &str| {
            let why = Header::read(&mut header.as_bytes()).expect_err("refused");
            why.to_string()
        };
        assert!(bad("ply\nformat binary 1.0\n").contains("line 2"));
        assert!(bad("ply\nformat ascii 1.0\nproperty int x\n").contains("line 3"));
        assert!(bad("ply\nelement vertex many\n").contains("number of rows"));
        assert!(bad("ply\nelement vertex 1\nproperty half x\n").contains("'half'"));
        assert!(bad("ply\nend_header\n").contains("format"));
        assert!(bad("ply\nwhat\n").contains("'what'"));
        assert!(bad(&"ply\n".repeat(3)).contains("line 2"));
        let text = format!("ply\nformat ascii 1.0\n{HEADER}0 0\n1 2 red\n3 4 5\n");
        assert!(refusal(text.as_bytes()).contains("'red': expected a number"));
    }
}
