//! Gaussians in PLY, as the code of INRIA writes them and nearly all programs read them.
//!
//! Takes a path, gives Gaussians. The element `vertex` has x y z, `f_dc_0` to `f_dc_2`, `f_rest_N` (all coefficients of red, then
//! of green, then of blue), `opacity` (log odds), `scale_0` to `scale_2` (natural logarithms) and `rot_0` to `rot_3` (w x y z).
//! Properties stand in any order and have any scalar type; further properties and elements are passed over.
//! Source: the code of "3D Gaussian Splatting for Real-Time Radiance Field Rendering" (Kerbl et al. 2023).
//! Limits: harmonics of degree 4 and more are left out, with a note.

use resample_core::narrow::single;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use glam::{DVec3, Quat, Vec3};
use resample_io::Gate;
use resample_io::ply::{Element, Header, Rows};

use super::sink::{self, C0, MOST_DEGREE, Sink, Stored};
use crate::Error;
use crate::gaussians::Gaussians;
use crate::input::{Fault, open_sized};

/// The properties of every Gaussian, in the order in which [`gaussian`] takes them.
const PROPERTIES: [&str; 14] = [
    "x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2",
    "rot_0", "rot_1", "rot_2", "rot_3",
];

/// Properties that no table has that holds anything but Gaussians.
const MARKS: [&str; 4] = ["scale_0", "rot_0", "opacity", "f_dc_0"];

/// Returns true if the vertices are Gaussians.
pub(crate) fn begins(header: &Header) -> bool {
    let is_marked = |element: &Element| MARKS.iter().all(|name| element.column(name).is_some());
    header.element("vertex").is_some_and(is_marked)
}

/// A file behind its header.
pub(super) struct Opened {
    pub(super) header: Header,
    pub(super) file: BufReader<File>,
    /// Bytes of the whole file.
    pub(super) bytes: u64,
}

pub(super) fn open(path: &Path) -> Result<Opened, Error> {
    let (file, bytes) = open_sized(path)?;
    let mut file = BufReader::with_capacity(1 << 20, file);
    let header = Header::read(&mut file).map_err(|fault| Fault::from(fault).at(path))?;
    Ok(Opened {
        header,
        file,
        bytes,
    })
}

/// Reads a file.
pub(crate) fn load(path: &Path, gate: &Gate, notes: &mut Vec<String>) -> Result<Gaussians, Error> {
    let opened = open(path)?;
    read(opened, gate, notes).map_err(|fault| fault.at(path))
}

fn read(opened: Opened, gate: &Gate, notes: &mut Vec<String>) -> Result<Gaussians, Fault> {
    let Opened {
        header,
        mut file,
        bytes,
    } = opened;
    let mut rows = Rows::new(&mut file, &header, bytes);
    for element in &header.elements {
        if element.name != "vertex" {
            rows.pass(element)?;
            continue;
        }
        let Columns { places, degree } = Columns::of(element, notes)?;
        rows.check(element)?;
        sink::ask(gate, degree, element.count, 0)?;
        let mut sink = Sink::with_capacity(degree, element.count);
        let per_channel = sink::coefficients_of(degree) / 3;
        let mut coefficients = vec![0.0; 3 * per_channel];
        rows.each(element, &places, &mut |row| {
            let (head, rest) = row.split_at(PROPERTIES.len());
            interleave(rest, &mut coefficients);
            sink.push(&gaussian(head), &coefficients);
            Ok(())
        })?;
        return sink.finish(notes);
    }
    Err(Fault::Invalid(
        "it has no element 'vertex': expected Gaussians".to_owned(),
    ))
}

/// The columns of the properties, and of the coefficients that are kept.
struct Columns {
    places: Vec<usize>,
    degree: usize,
}

impl Columns {
    fn of(element: &Element, notes: &mut Vec<String>) -> Result<Self, Fault> {
        let place = |name: &str| {
            let missing = || format!("its vertices have no property '{name}': expected Gaussians");
            element.column(name).ok_or_else(missing)
        };
        let mut places = Vec::with_capacity(PROPERTIES.len() + 45);
        for name in PROPERTIES {
            places.push(place(name)?);
        }
        let is_rest = |name: &str| name.strip_prefix("f_rest_").is_some();
        let rest = element.properties.iter().filter(|p| is_rest(&p.name));
        let count = rest.count();
        let degree = degree_of(count)?;
        let kept = degree.min(MOST_DEGREE);
        if kept < degree {
            notes.push(format!(
                "its spherical harmonics have degree {degree}; those beyond degree {kept} are left out"
            ));
        }
        for channel in 0..3 {
            for number in 0..sink::coefficients_of(kept) / 3 {
                places.push(place(&format!("f_rest_{}", channel * count / 3 + number))?);
            }
        }
        Ok(Self {
            places,
            degree: kept,
        })
    }
}

/// The degree that so many coefficients beyond the constant have.
pub(super) fn degree_of(count: usize) -> Result<usize, Fault> {
    let degree = (0..=4).find(|&degree| sink::coefficients_of(degree) == count);
    degree.ok_or_else(|| {
        Fault::Invalid(format!(
            "it has {count} coefficients f_rest_N: expected 0, 9, 24 or 45 (degrees 0 to 3)"
        ))
    })
}

/// Red, green and blue of each coefficient in turn, from all of red, all of green and all of blue.
pub(super) fn interleave(channels: &[f64], coefficients: &mut [f32]) {
    let per_channel = channels.len() / 3;
    for (number, rgb) in coefficients.chunks_exact_mut(3).enumerate() {
        for (channel, value) in rgb.iter_mut().enumerate() {
            *value = single(channels[channel * per_channel + number]);
        }
    }
}

/// A Gaussian from the numbers of [`PROPERTIES`].
fn gaussian(row: &[f64]) -> Stored {
    let [x, y, z, r, g, b, opacity, sx, sy, sz, w, i, j, k] =
        std::array::from_fn(|place| single(row[place]));
    Stored {
        centre: match row {
            [x, y, z, ..] => DVec3::new(*x, *y, *z),
            _ => Vec3::new(x, y, z).as_dvec3(),
        },
        rotation: Quat::from_xyzw(i, j, k, w),
        scales: Vec3::new(sx.exp(), sy.exp(), sz.exp()),
        opacity: sink::from_logit(opacity),
        colour: 0.5 + C0 * Vec3::new(r, g, b),
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_files::{Dir, check_damage, known, same};
    use super::*;

    /// A file of the known Gaussians; the properties in reverse order where `is_reversed`.
    fn file(degree: usize, encoding: &str, is_reversed: bool) -> Vec<u8> {
        let count = sink::coefficients_of(degree);
        let mut names: Vec<String> = PROPERTIES.iter().map(|name| (*name).to_owned()).collect();
        names.extend((0..count).map(|number| format!("f_rest_{number}")));
        names.insert(3, "nx".to_owned());
        if is_reversed {
            names.reverse();
        }
        let all = known(degree);
        let mut file = format!("ply\nformat {encoding} 1.0\nelement vertex {}\n", all.len());
        for name in &names {
            file += &format!("property float {name}\n");
        }
        file += "element version 1\nproperty uchar version\nend_header\n";
        let mut file = file.into_bytes();
        for (gaussian, rest) in &all {
            for name in &names {
                let value = value_of(gaussian, rest, name);
                match encoding {
                    "ascii" => file.extend(format!("{value} ").into_bytes()),
                    "binary_big_endian" => file.extend(value.to_be_bytes()),
                    _ => file.extend(value.to_le_bytes()),
                }
            }
            if encoding == "ascii" {
                file.push(b'\n');
            }
        }
        file.push(b'1');
        file
    }

    fn value_of(gaussian: &Stored, rest: &[f32], name: &str) -> f32 {
        if let Some(number) = name.strip_prefix("f_rest_") {
            let number: usize = number.parse().expect("a number");
            let per_channel = rest.len() / 3;
            return rest[3 * (number % per_channel) + number / per_channel];
        }
        let [x, y, z] = gaussian.centre.as_vec3().to_array();
        let [r, g, b] = ((gaussian.colour - 0.5) / C0).to_array();
        let [sx, sy, sz] = gaussian.scales.to_array().map(f32::ln);
        let [i, j, k, w] = gaussian.rotation.to_array();
        let opacity = (gaussian.opacity / (1.0 - gaussian.opacity)).ln();
        let values = [x, y, z, r, g, b, opacity, sx, sy, sz, w, i, j, k];
        let place = PROPERTIES.iter().position(|property| *property == name);
        place.map_or(0.0, |place| values[place])
    }

    #[test]
    fn every_encoding_degree_and_order_reads_back() {
        let dir = Dir::new();
        for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
            for (degree, is_reversed) in [(0, false), (1, true), (2, false), (3, true)] {
                let path = dir.write("a", &file(degree, encoding, is_reversed));
                let mut notes = Vec::new();
                let read = load(&path, &Gate::default(), &mut notes).expect("a good file");
                assert!(notes.is_empty(), "{notes:?}");
                same(&read, &known(degree), 2e-6);
            }
        }
    }

    #[test]
    fn what_is_not_finite_is_left_out_and_counted() {
        let dir = Dir::new();
        let text = String::from_utf8(file(0, "ascii", false)).expect("text");
        let first = text.find("end_header\n").expect("an end") + "end_header\n".len();
        let end = first + text[first..].find(' ').expect("a number");
        let damaged = format!("{}nan{}", &text[..first], &text[end..]);
        let mut notes = Vec::new();
        let path = dir.write("a", damaged.as_bytes());
        let read = load(&path, &Gate::default(), &mut notes).expect("the others are good");
        assert_eq!(read.len(), known(0).len() - 1);
        assert!(notes[0].contains("number 0, centre is not"), "{notes:?}");
        let one = text.replace(&format!("vertex {}", known(0).len()), "vertex 1");
        let one = format!("{}nan{}", &one[..first], &one[end..]);
        let path = dir.write("a", one.as_bytes());
        let why = load(&path, &Gate::default(), &mut notes).expect_err("nothing left");
        assert!(why.to_string().contains("none of its 1"), "{why}");
    }

    #[test]
    fn places_far_from_the_origin_stay_exact() {
        let dir = Dir::new();
        let text = String::from_utf8(file(0, "ascii", false)).expect("text");
        let text = text.replace("property float x", "property double x");
        let first = text.find("end_header\n").expect("an end") + "end_header\n".len();
        let end = first + text[first..].find(' ').expect("a number");
        let text = format!("{}500000.125{}", &text[..first], &text[end..]);
        let path = dir.write("a", text.as_bytes());
        let read = load(&path, &Gate::default(), &mut Vec::new()).expect("good");
        assert_eq!(read.origin_in_world.x, 500_000.0);
        assert_eq!(read.centres()[0].x, 0.125);
    }

    #[test]
    fn forged_and_damaged_files_are_refused() {
        let dir = Dir::new();
        let good = file(1, "binary_little_endian", false);
        let count = format!("vertex {}", known(1).len());
        let refused = |from: &str, to: &str| {
            let head = String::from_utf8_lossy(&good).into_owned();
            let at = head.find(from).expect("in the header");
            let forged = [&good[..at], to.as_bytes(), &good[at + from.len()..]].concat();
            let path = dir.write("a", &forged);
            let why = load(&path, &Gate::default(), &mut Vec::new()).expect_err("refused");
            assert!(matches!(why, Error::Invalid { .. }), "{why}");
            why.to_string()
        };
        assert!(refused(&count, "vertex 99999999999").contains("99999999999 rows"));
        assert!(refused(&count, "vertex 0").contains("no Gaussian"));
        assert!(refused("rot_3", "rot_4").contains("no property 'rot_3'"));
        assert!(refused("f_rest_8", "g_rest_8").contains("8 coefficients"));
        let small = Gate::new(resample_io::Outside::Refused, Some(100));
        let why = load(&dir.write("a", &good), &small, &mut Vec::new()).expect_err("too large");
        assert!(why.to_string().contains("--max-memory"), "{why}");
        check_damage(&good, load);
        check_damage(&file(1, "ascii", false), load);
    }
}
