//! PlayCanvas' compressed PLY: Gaussians of 16 bytes, in chunks of 256 that say the ranges of their numbers.
//!
//! Takes a path, gives Gaussians. The element `chunk` has the least and the most of positions, of the logarithms of standard
//! deviations and, in newer files, of colours. `vertex` has four words: position and scale of 11, 10 and 11 bits from the top;
//! rotation with the place of the largest of w x y z in 2 bits and the others in 10 bits each, within +-sqrt(1/2); red, green,
//! blue and opacity in 8 bits each. `sh` has the other coefficients, all of red, then green, then blue, a byte for -4 to 4.
//! Source: the format as PlayCanvas' SplatTransform and SuperSplat document and write it.

use resample_core::narrow;
use resample_core::narrow::single;
use std::path::Path;

use glam::{Quat, Vec3};
use resample_io::Gate;
use resample_io::ply::{Element, Header, Rows};

use super::ply::{self, Opened};
use super::sink::{self, MOST_DEGREE, Sink, Stored};
use crate::Error;
use crate::gaussians::Gaussians;
use crate::input::Fault;

/// Gaussians of a chunk.
const CHUNK: usize = 256;

/// The ranges of a chunk: least and most position, then least and most logarithm of the scale.
const RANGES: [&str; 12] = [
    "min_x",
    "min_y",
    "min_z",
    "max_x",
    "max_y",
    "max_z",
    "min_scale_x",
    "min_scale_y",
    "min_scale_z",
    "max_scale_x",
    "max_scale_y",
    "max_scale_z",
];

/// The ranges of colours, which older files do not have.
const COLOUR_RANGES: [&str; 6] = ["min_r", "min_g", "min_b", "max_r", "max_g", "max_b"];

const WORDS: [&str; 4] = [
    "packed_position",
    "packed_rotation",
    "packed_scale",
    "packed_color",
];

/// Returns true if the vertices are packed Gaussians.
pub(crate) fn begins(header: &Header) -> bool {
    let is_marked = |element: &Element| element.column(WORDS[0]).is_some();
    header.element("vertex").is_some_and(is_marked)
}

/// Reads a file.
pub(crate) fn load(path: &Path, gate: &Gate, notes: &mut Vec<String>) -> Result<Gaussians, Error> {
    let opened = ply::open(path)?;
    let tables = tables(opened, gate, notes);
    let read = tables.and_then(|tables| tables.gaussians(notes));
    read.map_err(|fault| fault.at(path))
}

/// The range of each chunk, and the words and coefficients of each Gaussian.
#[derive(Default)]
struct Tables {
    chunks: Vec<[f32; 18]>,
    words: Vec<[u32; 4]>,
    degree: usize,
    coefficients: Vec<u8>,
}

fn tables(opened: Opened, gate: &Gate, notes: &mut Vec<String>) -> Result<Tables, Fault> {
    let Opened {
        header,
        mut file,
        bytes,
    } = opened;
    let count = |name: &str| header.element(name).map_or(0, |element| element.count);
    let (vertices, chunks, harmonics) = (count("vertex"), count("chunk"), count("sh"));
    if chunks != vertices.div_ceil(CHUNK as u64) {
        return Err(Fault::Invalid(format!(
            "it has {chunks} chunks for {vertices} Gaussians: expected one for each {CHUNK}"
        )));
    }
    if header.element("sh").is_some() && harmonics != vertices {
        return Err(Fault::Invalid(format!(
            "it has {harmonics} rows of coefficients for {vertices} Gaussians"
        )));
    }
    let mut rows = Rows::new(&mut file, &header, bytes);
    let mut tables = Tables::default();
    for element in &header.elements {
        rows.check(element)?;
        match element.name.as_str() {
            "chunk" => tables.read_chunks(&mut rows, element)?,
            "vertex" => {
                sink::ask(
                    gate,
                    MOST_DEGREE,
                    vertices,
                    vertices.saturating_mul(16 + 45),
                )?;
                tables.read_words(&mut rows, element)?;
            }
            "sh" => tables.read_coefficients(&mut rows, element, notes)?,
            _ => rows.pass(element)?,
        }
    }
    Ok(tables)
}

/// The columns of names; the error names the one that is missing.
fn columns(element: &Element, names: &[&str]) -> Result<Vec<usize>, Fault> {
    let place = |name: &&str| {
        let missing = || {
            Fault::Invalid(format!(
                "its element '{}' has no property '{name}'",
                element.name
            ))
        };
        element.column(name).ok_or_else(missing)
    };
    names.iter().map(place).collect()
}

impl Tables {
    fn read_chunks(&mut self, rows: &mut Rows, element: &Element) -> Result<(), Fault> {
        let mut places = columns(element, &RANGES)?;
        let has_colours = element.column(COLOUR_RANGES[0]).is_some();
        if has_colours {
            places.extend(columns(element, &COLOUR_RANGES)?);
        }
        self.chunks.reserve_exact(narrow::count(element.count));
        rows.each(element, &places, &mut |row| {
            let mut chunk = [0.0; 18];
            chunk[15..].fill(1.0);
            for (to, from) in chunk.iter_mut().zip(row) {
                *to = single(*from);
            }
            self.chunks.push(chunk);
            Ok(())
        })?;
        Ok(())
    }

    fn read_words(&mut self, rows: &mut Rows, element: &Element) -> Result<(), Fault> {
        let places = columns(element, &WORDS)?;
        self.words.reserve_exact(narrow::count(element.count));
        rows.each(element, &places, &mut |row| {
            self.words
                .push(std::array::from_fn(|at| narrow::code32(row[at])));
            Ok(())
        })?;
        Ok(())
    }

    fn read_coefficients(
        &mut self,
        rows: &mut Rows,
        element: &Element,
        notes: &mut Vec<String>,
    ) -> Result<(), Fault> {
        let count = element.properties.len();
        let degree = ply::degree_of(count)?;
        self.degree = degree.min(MOST_DEGREE);
        if self.degree < degree {
            notes.push(format!(
                "its spherical harmonics have degree {degree}; those beyond degree 3 are left out"
            ));
        }
        let kept = sink::coefficients_of(self.degree) / 3;
        let names = (0..3).flat_map(|channel| {
            (0..kept).map(move |number| format!("f_rest_{}", channel * count / 3 + number))
        });
        let names: Vec<String> = names.collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let places = columns(element, &names)?;
        self.coefficients
            .reserve_exact(narrow::count(element.count) * places.len());
        rows.each(element, &places, &mut |row| {
            self.coefficients
                .extend(row.iter().map(|code| narrow::code8(*code)));
            Ok(())
        })?;
        Ok(())
    }

    fn gaussians(self, notes: &mut Vec<String>) -> Result<Gaussians, Fault> {
        let per_gaussian = sink::coefficients_of(self.degree);
        let mut sink = Sink::with_capacity(self.degree, self.words.len() as u64);
        let mut rest = vec![0.0; per_gaussian];
        let mut channels = vec![0.0; per_gaussian];
        for (index, words) in self.words.iter().enumerate() {
            let codes = &self.coefficients[per_gaussian * index..][..per_gaussian];
            for (value, code) in channels.iter_mut().zip(codes) {
                *value = coefficient(*code);
            }
            ply::interleave(&channels, &mut rest);
            sink.push(&gaussian(words, &self.chunks[index / CHUNK]), &rest);
        }
        sink.finish(notes)
    }
}

/// A coefficient from its byte: the ends of the range are exact, the others stand for the middle of their step.
fn coefficient(code: u8) -> f64 {
    let part = match code {
        0 => 0.0,
        255 => 1.0,
        code => (f64::from(code) + 0.5) / 256.0,
    };
    8.0 * (part - 0.5)
}

/// The lowest bits of a word as a part of their largest value.
fn part(word: u32, bits: u32) -> f32 {
    let most = (1u32 << bits) - 1;
    (word & most) as f32 / most as f32
}

fn parts_11_10_11(word: u32) -> Vec3 {
    Vec3::new(part(word >> 21, 11), part(word >> 11, 10), part(word, 11))
}

fn gaussian([position, rotation, scale, colour]: &[u32; 4], chunk: &[f32; 18]) -> Stored {
    let range = |first: usize| Vec3::new(chunk[first], chunk[first + 1], chunk[first + 2]);
    let between = |least: usize, part: Vec3| range(least) * (1.0 - part) + range(least + 3) * part;
    let logs = between(6, parts_11_10_11(*scale));
    let rgb = Vec3::new(
        part(colour >> 24, 8),
        part(colour >> 16, 8),
        part(colour >> 8, 8),
    );
    let three = [20, 10, 0].map(|shift| (part(rotation >> shift, 10) - 0.5) * 2f32.sqrt());
    let [w, x, y, z] = sink::smallest_three(three, (rotation >> 30) as usize);
    Stored {
        centre: between(0, parts_11_10_11(*position)).as_dvec3(),
        rotation: Quat::from_xyzw(x, y, z, w),
        scales: Vec3::new(logs.x.exp(), logs.y.exp(), logs.z.exp()),
        opacity: part(*colour, 8),
        colour: between(12, rgb),
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_files::{Dir, check_damage, known, same_within};
    use super::*;

    fn code(value: f32, least: f32, most: f32, bits: u32) -> u32 {
        let largest = ((1u32 << bits) - 1) as f32;
        ((value - least) / (most - least) * largest).round() as u32
    }

    /// The words of a Gaussian in the ranges of the test's chunk.
    fn words(stored: &Stored) -> [u32; 4] {
        let [x, y, z] = stored.centre.as_vec3().to_array();
        let [sx, sy, sz] = stored.scales.to_array().map(f32::ln);
        let [i, j, k, w] = stored.rotation.to_array();
        let four = [w, i, j, k];
        let order = |a: &usize, b: &usize| four[*a].abs().total_cmp(&four[*b].abs());
        let largest = (0..4).max_by(order).expect("four");
        let mut rotation = largest as u32;
        for place in (0..4).filter(|place| *place != largest) {
            let value = four[place] * four[largest].signum();
            rotation = rotation << 10 | code(value, -0.5f32.sqrt(), 0.5f32.sqrt(), 10);
        }
        let [r, g, b] = stored
            .colour
            .to_array()
            .map(|part| code(part, -1.0, 1.0, 8));
        [
            code(x, -2.0, 2.0, 11) << 21 | code(y, -2.0, 2.0, 10) << 11 | code(z, -2.0, 2.0, 11),
            rotation,
            code(sx, -5.0, 0.0, 11) << 21 | code(sy, -5.0, 0.0, 10) << 11 | code(sz, -5.0, 0.0, 11),
            r << 24 | g << 16 | b << 8 | code(stored.opacity, 0.0, 1.0, 8),
        ]
    }

    fn file(degree: usize) -> Vec<u8> {
        let all = known(degree);
        let mut head = "ply\nformat binary_little_endian 1.0\nelement chunk 1\n".to_owned();
        for name in RANGES.iter().chain(&COLOUR_RANGES) {
            head += &format!("property float {name}\n");
        }
        head += &format!("element vertex {}\n", all.len());
        WORDS
            .iter()
            .for_each(|name| head += &format!("property uint {name}\n"));
        let count = sink::coefficients_of(degree);
        if degree > 0 {
            head += &format!("element sh {}\n", all.len());
            (0..count).for_each(|number| head += &format!("property uchar f_rest_{number}\n"));
        }
        head += "end_header\n";
        let mut file = head.into_bytes();
        for range in [-2f32, 2.0, -5.0, 0.0, -1.0, 1.0] {
            (0..3).for_each(|_| file.extend(range.to_le_bytes()));
        }
        for (stored, _) in &all {
            file.extend(words(stored).iter().flat_map(|word| word.to_le_bytes()));
        }
        for (_, rest) in &all {
            let channels = (0..count).map(|at| rest[3 * (at % (count / 3)) + at / (count / 3)]);
            file.extend(channels.map(|value| ((value / 8.0 + 0.5) * 256.0) as u8));
        }
        file
    }

    #[test]
    fn words_read_back() {
        let dir = Dir::new();
        for degree in 0..=3 {
            let path = dir.write("a", &file(degree));
            let mut notes = Vec::new();
            let read = load(&path, &Gate::default(), &mut notes).expect("a good file");
            assert!(notes.is_empty(), "{notes:?}");
            same_within(&read, &known(degree), [0.003, 0.003, 0.003, 0.005, 0.016]);
        }
    }

    #[test]
    fn ends_of_the_ranges_are_exact() {
        assert_eq!(parts_11_10_11(u32::MAX), Vec3::ONE);
        assert_eq!(parts_11_10_11(0), Vec3::ZERO);
        assert_eq!([0, 255].map(coefficient), [-4.0, 4.0]);
        assert_eq!(coefficient(128), 8.0 * 0.5 / 256.0);
    }

    #[test]
    fn forged_and_damaged_files_are_refused() {
        let dir = Dir::new();
        let good = file(1);
        let refused = |from: &str, to: &str| {
            let head = String::from_utf8_lossy(&good).into_owned();
            let at = head.find(from).expect("in the header");
            let forged = [&good[..at], to.as_bytes(), &good[at + from.len()..]].concat();
            let path = dir.write("a", &forged);
            let why = load(&path, &Gate::default(), &mut Vec::new()).expect_err("refused");
            why.to_string()
        };
        assert!(refused("chunk 1", "chunk 2").contains("2 chunks for 3"));
        assert!(refused("vertex 3", "vertex 200").contains("200 Gaussians"));
        assert!(refused("packed_scale", "packed_skale").contains("'packed_scale'"));
        assert!(refused("max_b", "max_c").contains("'max_b'"));
        assert!(refused("sh 3", "sh 2").contains("2 rows"));
        check_damage(&good, load);
    }
}
