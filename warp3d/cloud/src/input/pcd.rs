//! PCD, the point clouds of PCL: text, binary and packed binary.
//!
//! Takes a path, gives points with colours (`rgb`, `rgba`), intensities, classes (`label`) and normals. The header names the fields, their
//! types and counts; packed files have one field after another, packed by LZF. The viewpoint is where the sensor stood, and
//! changes no place. Source: the description of the format by PCL, version 0.7. Limits: little-endian files.

use resample_core::narrow;
use resample_core::narrow::{code8, single};
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use glam::DVec3;
use resample_io::files::open_regular;
use resample_io::refused::excerpt;

use super::collect::{Collector, Colours, Has, Point};
use super::file::{CloudLoadOptions, PointCloudFile};
use super::las_header::bytes_at;
use super::lzf;

/// Longest header that is read, bytes: a guess, far beyond the 500 of usual ones.
const MAX_HEADER_BYTES: u64 = 1 << 16;

/// Bytes of rows that are read at once.
const PIECE_BYTES: usize = 1 << 18;

/// Longest line of a row of text.
const MAX_LINE_BYTES: u64 = 1 << 16;

/// How the rows are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Storage {
    Text,
    Binary,
    Packed,
}

/// A column.
#[derive(Clone, Debug)]
struct Field {
    name: String,
    /// I, U or F.
    kind: u8,
    bytes: usize,
    count: usize,
}

/// The facts of the header.
#[derive(Debug)]
struct Header {
    fields: Vec<Field>,
    points: u64,
    storage: Storage,
}

/// Returns true if a file that begins with these bytes is PCD: its first line that is no comment names the version or the fields.
pub(super) fn begins(head: &[u8]) -> bool {
    let mut lines = head
        .split(|byte| *byte == b'\n')
        .filter(|line| !line.starts_with(b"#"));
    lines.next().is_some_and(|line| {
        [b"VERSION ".as_slice(), b"FIELDS ", b"COLUMNS "]
            .iter()
            .any(|word| line.starts_with(word))
    })
}

impl Header {
    fn read(file: &mut BufReader<File>) -> Result<(Self, u64), String> {
        let mut lines = file.take(MAX_HEADER_BYTES);
        let (mut names, mut sizes, mut kinds, mut counts) = (vec![], vec![], vec![], vec![]);
        let (mut points, mut area, mut bytes) = (None, [0u64, 1], 0);
        loop {
            let mut line = Vec::new();
            let got = lines.read_until(b'\n', &mut line);
            bytes += got.map_err(|error| format!("cannot be read: {error}"))? as u64;
            if !line.ends_with(b"\n") {
                return Err("its header has no line 'DATA': the file is cut off".to_owned());
            }
            let line = String::from_utf8_lossy(&line).into_owned();
            let (word, rest) = line.trim().split_once(' ').unwrap_or((line.trim(), ""));
            let words = || {
                rest.split_whitespace()
                    .map(str::to_owned)
                    .collect::<Vec<_>>()
            };
            let number = || {
                rest.trim().parse::<u64>().map_err(|_| {
                    format!(
                        "its header says '{}': expected a number",
                        excerpt(line.trim())
                    )
                })
            };
            match word {
                "FIELDS" | "COLUMNS" => names = words(),
                "SIZE" => sizes = words(),
                "TYPE" => kinds = words(),
                "COUNT" => counts = words(),
                "WIDTH" => area[0] = number()?,
                "HEIGHT" => area[1] = number()?,
                "POINTS" => points = Some(number()?),
                "DATA" => {
                    let header = Self {
                        fields: fields(&names, &sizes, &kinds, &counts)?,
                        points: points.unwrap_or(area[0].saturating_mul(area[1])),
                        storage: storage(rest.trim())?,
                    };
                    return Ok((header, bytes));
                }
                _ => {}
            }
        }
    }

    fn row_bytes(&self) -> usize {
        self.fields
            .iter()
            .map(|field| field.bytes * field.count)
            .sum()
    }

    /// The place of each wanted number: its field, and its first byte in a row.
    fn column(&self, names: &[&str]) -> Option<Cell> {
        let mut offset = 0;
        let mut word = 0;
        for (number, field) in self.fields.iter().enumerate() {
            if names.contains(&field.name.to_ascii_lowercase().as_str()) {
                return Some(Cell {
                    field: number,
                    offset,
                    word,
                });
            }
            offset += field.bytes * field.count;
            word += field.count;
        }
        None
    }
}

/// Where a number is: in its field, in a row of bytes, in a line of words.
#[derive(Clone, Copy, Debug)]
struct Cell {
    field: usize,
    offset: usize,
    word: usize,
}

fn storage(word: &str) -> Result<Storage, String> {
    match word {
        "ascii" => Ok(Storage::Text),
        "binary" => Ok(Storage::Binary),
        "binary_compressed" => Ok(Storage::Packed),
        other => Err(format!(
            "its data is '{}': expected ascii, binary or binary_compressed",
            excerpt(other)
        )),
    }
}

fn fields(
    names: &[String],
    sizes: &[String],
    kinds: &[String],
    counts: &[String],
) -> Result<Vec<Field>, String> {
    if names.is_empty() || sizes.len() != names.len() || kinds.len() != names.len() {
        return Err(format!(
            "its header has {} fields, {} sizes and {} types: expected as many of each",
            names.len(),
            sizes.len(),
            kinds.len()
        ));
    }
    let field = |(place, name): (usize, &String)| {
        let count = counts
            .get(place)
            .map_or(Some(1), |count| count.parse().ok());
        let (bytes, kind) = (sizes[place].parse().ok(), kinds[place].as_bytes()[0]);
        let bytes = bytes.filter(|bytes| match kind {
            b'F' => matches!(bytes, 4 | 8),
            b'I' | b'U' => matches!(bytes, 1 | 2 | 4 | 8),
            _ => false,
        });
        let field = bytes.zip(count.filter(|count| (1..=1 << 16).contains(count)));
        let field = field.map(|(bytes, count)| Field {
            name: name.clone(),
            kind,
            bytes,
            count,
        });
        field.ok_or_else(|| {
            format!(
                "field '{}' has size {} and type {}: expected I, U or F of 1 to 8 bytes",
                excerpt(name),
                excerpt(&sizes[place]),
                excerpt(&kinds[place])
            )
        })
    };
    names.iter().enumerate().map(field).collect()
}

/// The cells of the attributes.
struct Cells {
    place: [Cell; 3],
    colour: Option<Cell>,
    intensity: Option<Cell>,
    class: Option<Cell>,
    normal: Option<[Cell; 3]>,
}

impl Cells {
    fn of(header: &Header) -> Result<Self, String> {
        let three = |names: [&str; 3]| {
            let found: Option<Vec<Cell>> =
                names.iter().map(|name| header.column(&[name])).collect();
            found.and_then(|cells| <[Cell; 3]>::try_from(cells).ok())
        };
        Ok(Self {
            place: three(["x", "y", "z"]).ok_or("it has no fields x, y and z: expected points")?,
            colour: header
                .column(&["rgb", "rgba"])
                .filter(|cell| header.fields[cell.field].bytes == 4),
            intensity: header.column(&["intensity", "intensities", "reflectivity"]),
            class: header.column(&["label", "classification"]),
            normal: three(["normal_x", "normal_y", "normal_z"]),
        })
    }

    fn has(&self) -> Has {
        Has {
            colours: if self.colour.is_some() {
                Colours::Bits8
            } else {
                Colours::None
            },
            intensities: self.intensity.is_some(),
            classes: self.class.is_some(),
            normals: self.normal.is_some(),
            ..Has::default()
        }
    }

    /// The point of a row whose numbers, and whose colours' bits, two functions give.
    fn point(&self, number: impl Fn(Cell) -> f64, bits: impl Fn(Cell) -> u32) -> Point {
        let three = |cells: [Cell; 3]| cells.map(&number);
        let [b, g, r, _] = self.colour.map_or(0, bits).to_le_bytes();
        Point {
            place: DVec3::from_array(three(self.place)),
            colour: [r, g, b].map(u16::from),
            intensity: single(self.intensity.map_or(0.0, &number)),
            class: code8(self.class.map_or(0.0, &number)),
            normal: self.normal.map_or([0.0; 3], three).map(single),
            radius: 0.0,
        }
    }
}

/// A number of a type at the beginning of some bytes.
fn number(bytes: &[u8], field: &Field) -> f64 {
    match (field.kind, field.bytes) {
        (b'F', 4) => f64::from(f32::from_le_bytes(bytes_at(bytes, 0))),
        (b'F', _) => f64::from_le_bytes(bytes_at(bytes, 0)),
        (b'I', 1) => f64::from(bytes[0].cast_signed()),
        (b'I', 2) => f64::from(i16::from_le_bytes(bytes_at(bytes, 0))),
        (b'I', 4) => f64::from(i32::from_le_bytes(bytes_at(bytes, 0))),
        (b'I', _) => i64::from_le_bytes(bytes_at(bytes, 0)) as f64,
        (_, 1) => f64::from(bytes[0]),
        (_, 2) => f64::from(u16::from_le_bytes(bytes_at(bytes, 0))),
        (_, 4) => f64::from(u32::from_le_bytes(bytes_at(bytes, 0))),
        _ => u64::from_le_bytes(bytes_at(bytes, 0)) as f64,
    }
}

/// Reads a file.
pub(super) fn load(path: &Path, options: &CloudLoadOptions) -> Result<PointCloudFile, String> {
    let (file, held) = open_regular(path).map_err(|error| format!("cannot be read: {error}"))?;
    let mut file = BufReader::with_capacity(PIECE_BYTES, file);
    let (header, header_bytes) = Header::read(&mut file)?;
    let cells = Cells::of(&header)?;
    let left = held.saturating_sub(header_bytes);
    let least = match header.storage {
        Storage::Text => 2 * header.fields.iter().map(|field| field.count).sum::<usize>() as u64,
        Storage::Binary => header.row_bytes() as u64,
        Storage::Packed => 0,
    };
    if header.points.saturating_mul(least) > left.saturating_add(1) {
        return Err(format!(
            "its header says {} points, which take at least {} bytes, but {left} are left: the file is cut off or its header is wrong",
            header.points,
            header.points.saturating_mul(least)
        ));
    }
    if header.storage == Storage::Packed {
        return packed(&mut file, left, &header, &cells, options);
    }
    let mut collector = Collector::new(header.points, cells.has(), 0, options)?;
    match header.storage {
        Storage::Text => text(&mut file, &header, &cells, &mut collector)?,
        _ => binary(&mut file, &header, &cells, &mut collector)?,
    }
    collector.finish()
}

fn binary(
    file: &mut BufReader<File>,
    header: &Header,
    cells: &Cells,
    collector: &mut Collector,
) -> Result<(), String> {
    let row_bytes = header.row_bytes();
    let at_once = (PIECE_BYTES / row_bytes).max(1) as u64;
    let mut piece = Vec::new();
    let mut left = header.points;
    while left > 0 {
        let count = left.min(at_once);
        piece.resize(narrow::count(count) * row_bytes, 0);
        let read = file.read_exact(&mut piece);
        read.map_err(|error| format!("the points cannot be read: {error}"))?;
        for row in piece.chunks_exact(row_bytes) {
            if collector.wants_next() {
                let number = |cell: Cell| number(&row[cell.offset..], &header.fields[cell.field]);
                let bits = |cell: Cell| u32::from_le_bytes(bytes_at(row, cell.offset));
                collector.take(&cells.point(number, bits));
            }
        }
        left -= count;
    }
    Ok(())
}

fn packed(
    file: &mut BufReader<File>,
    left: u64,
    header: &Header,
    cells: &Cells,
    options: &CloudLoadOptions,
) -> Result<PointCloudFile, String> {
    let broken = |error| format!("the packed points cannot be read: {error}");
    let mut sizes = [0; 8];
    file.read_exact(&mut sizes).map_err(broken)?;
    let [packed, unpacked] = [0, 4].map(|at| u64::from(u32::from_le_bytes(bytes_at(&sizes, at))));
    let expected = header.points.saturating_mul(header.row_bytes() as u64);
    if unpacked != expected || packed > left {
        return Err(format!(
            "its {} points need {expected} bytes; {unpacked} bytes packed into {packed} are promised and {left} are there",
            header.points
        ));
    }
    options.gate.ask_unpacked(unpacked, packed, "the points")?;
    let mut collector = Collector::new(header.points, cells.has(), unpacked + packed, options)?;
    let mut bytes = Vec::new();
    file.take(packed).read_to_end(&mut bytes).map_err(broken)?;
    let bytes = lzf::unpack(&bytes, unpacked.try_into().unwrap_or(usize::MAX))?;
    let points = narrow::count(header.points);
    for row in 0..points {
        if !collector.wants_next() {
            continue;
        }
        let at = |cell: Cell| {
            let field = &header.fields[cell.field];
            &bytes[cell.offset * points + row * field.bytes * field.count..]
        };
        let number = |cell: Cell| number(at(cell), &header.fields[cell.field]);
        let bits = |cell: Cell| u32::from_le_bytes(bytes_at(at(cell), 0));
        collector.take(&cells.point(number, bits));
    }
    collector.finish()
}

fn text(
    file: &mut BufReader<File>,
    header: &Header,
    cells: &Cells,
    collector: &mut Collector,
) -> Result<(), String> {
    let words_of_row: usize = header.fields.iter().map(|field| field.count).sum();
    let mut line = String::new();
    let mut row = 0;
    while row < header.points {
        line.clear();
        let got = file.take(MAX_LINE_BYTES).read_line(&mut line);
        if got.map_err(|error| format!("point {row} cannot be read: {error}"))? == 0 {
            return Err(format!(
                "it has {row} points, its header says {}: the file is cut off",
                header.points
            ));
        }
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        if words.is_empty() {
            continue;
        }
        if words.len() < words_of_row {
            return Err(format!(
                "point {row} has {} numbers: expected {words_of_row}",
                words.len()
            ));
        }
        if collector.wants_next() {
            // A word that is no number is no place, and the point is left out.
            let number = |cell: Cell| words[cell.word].parse().unwrap_or(f64::NAN);
            let bits = |cell: Cell| match header.fields[cell.field].kind {
                b'F' => words[cell.word].parse().map_or(0, f32::to_bits),
                _ => words[cell.word].parse().unwrap_or(0),
            };
            collector.take(&cells.point(number, bits));
        }
        row += 1;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::test_files::{Dir, survive_damage};
    use super::*;

    const ROWS: [([f32; 3], u32, u16, [f32; 3]); 3] = [
        ([1.0, 2.0, 3.0], 0x00ff_8001, 500, [0.0, 0.0, 1.0]),
        ([f32::NAN, 0.0, 0.0], 0, 0, [0.0; 3]),
        ([4.0, -5.5, 6.0], 0x0001_0203, 7, [1.0, 0.0, 0.0]),
    ];

    fn header(data: &str) -> String {
        format!(
            "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb intensity normal_x normal_y normal_z _\n\
             SIZE 4 4 4 4 2 4 4 4 1\nTYPE F F F F U F F F U\nCOUNT 1 1 1 1 1 1 1 1 3\nWIDTH 3\nHEIGHT 1\n\
             VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\nDATA {data}\n"
        )
    }

    fn columns() -> Vec<Vec<Vec<u8>>> {
        let row = |(place, colour, intensity, normal): &([f32; 3], u32, u16, [f32; 3])| {
            let mut cells: Vec<Vec<u8>> = place
                .iter()
                .map(|part| part.to_le_bytes().to_vec())
                .collect();
            cells.push(colour.to_le_bytes().to_vec());
            cells.push(intensity.to_le_bytes().to_vec());
            cells.extend(normal.iter().map(|part| part.to_le_bytes().to_vec()));
            cells.push(vec![0; 3]);
            cells
        };
        ROWS.iter().map(row).collect()
    }

    fn file(data: &str) -> Vec<u8> {
        let mut file = header(data).into_bytes();
        let rows = columns();
        match data {
            "binary" => file.extend(rows.concat().concat()),
            "binary_compressed" => {
                let fields: Vec<u8> = (0..9)
                    .flat_map(|field| rows.iter().flat_map(move |row| row[field].clone()))
                    .collect();
                let packed: Vec<u8> = fields
                    .chunks(32)
                    .flat_map(|piece| [&[piece.len() as u8 - 1], piece].concat())
                    .collect();
                file.extend(
                    [packed.len() as u32, fields.len() as u32]
                        .map(u32::to_le_bytes)
                        .concat(),
                );
                file.extend(packed);
            }
            _ => {
                for ([x, y, z], colour, intensity, [i, j, k]) in ROWS {
                    let colour = f32::from_bits(colour);
                    file.extend(
                        format!("{x} {y} {z} {colour:e} {intensity} {i} {j} {k} 0 0 0\n")
                            .into_bytes(),
                    );
                }
            }
        }
        file
    }

    fn read(bytes: &[u8]) -> Result<PointCloudFile, String> {
        let dir = Dir::new();
        load(&dir.write("a", bytes), &CloudLoadOptions::default())
    }

    #[test]
    fn every_storage_reads_back() {
        for data in ["ascii", "binary", "binary_compressed"] {
            assert!(begins(&file(data)));
            let file = read(&file(data)).expect("a good file");
            assert_eq!(
                file.positions,
                [[1.0, 2.0, 3.0], [4.0, -5.5, 6.0]],
                "{data}"
            );
            assert_eq!(file.colours, Some(vec![[255, 128, 1], [1, 2, 3]]), "{data}");
            assert_eq!(file.intensities, Some(vec![500, 7]));
            assert_eq!(file.normals, Some(vec![[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]));
            assert!(file.notes[0].contains("1 points"), "{:?}", file.notes);
        }
    }

    #[test]
    fn forged_and_damaged_files_are_refused() {
        let forged = |data: &str, from: &str, to: &str| {
            let good = file(data);
            let head = String::from_utf8_lossy(&good).into_owned();
            let at = head.find(from).expect("in the header");
            let forged = [&good[..at], to.as_bytes(), &good[at + from.len()..]].concat();
            read(&forged).expect_err("refused")
        };
        assert!(forged("binary", "POINTS 3", "POINTS 99999999999").contains("99999999999 points"));
        assert!(forged("ascii", "POINTS 3", "POINTS 4").contains("3 points"));
        assert!(forged("binary_compressed", "POINTS 3", "POINTS 4").contains("4 points"));
        assert!(forged("binary", "FIELDS x", "FIELDS q").contains("x, y and z"));
        assert!(forged("binary", "SIZE 4", "SIZE 3").contains("size 3"));
        let types = forged("binary", "TYPE F F", "TYPE F");
        assert!(types.contains("expected as many of each"), "{types}");
        assert!(forged("binary", "POINTS 3", "POINTS x").contains("expected a number"));
        for data in ["ascii", "binary", "binary_compressed"] {
            survive_damage(&file(data), load);
        }
    }
}
