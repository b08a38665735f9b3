//! The lines at the top of a legacy VTK file: how the image lies.

use std::io::BufRead;

use glam::DVec3;

use crate::input::fault::{Fault, excerpt, unsupported};
use crate::input::lines::Lines;

/// Where the values of an array stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Centring {
    Points,
    Cells,
}

/// The facts of the top.
pub(crate) struct Head {
    /// Points along x, y and z.
    points: [usize; 3],
    pub(crate) origin: DVec3,
    pub(crate) spacing: DVec3,
    pub(crate) is_binary: bool,
}

/// The kinds of data that are no image, and what to do with them.
const OTHER_KINDS: [(&str, &str); 4] = [
    (
        "RECTILINEAR_GRID",
        "its spacing changes along an axis: resample it to an image (ParaView: Resample To Image)",
    ),
    (
        "STRUCTURED_GRID",
        "its points lie anywhere: resample it to an image (ParaView: Resample To Image)",
    ),
    (
        "UNSTRUCTURED_GRID",
        "unstructured grids are not supported; resample to an image (ParaView: Resample To Image)",
    ),
    (
        "POLYDATA",
        "it is a mesh: save it as PLY or STL, which the command texmap draws",
    ),
];

/// Most points along an axis: the library that writes this format counts them in 32 bits.
const MOST_POINTS: f64 = i32::MAX as f64;

impl Head {
    /// Reads up to the last line that places the image.
    pub(crate) fn read(bytes: &mut dyn BufRead) -> Result<Self, Fault> {
        let mut lines = Lines::new(bytes);
        let mut next = |what: &str| {
            lines
                .next()?
                .ok_or_else(|| Fault::Invalid(format!("the file ends where {what} is expected")))
        };
        // The mark, and a title of any kind.
        next("its mark")?;
        next("its title")?;
        let coding = next("ASCII or BINARY")?;
        let is_binary = match coding.trim().to_uppercase().as_str() {
            "ASCII" => false,
            "BINARY" => true,
            other => {
                return Err(Fault::Invalid(format!(
                    "line 3 is '{}': expected ASCII or BINARY",
                    excerpt(other)
                )));
            }
        };
        let (mut points, mut origin, mut spacing) = (None, None, None);
        let mut has_kind = false;
        while points.is_none() || origin.is_none() || spacing.is_none() {
            let line = next("DIMENSIONS, ORIGIN or SPACING")?;
            let mut words = line.split_ascii_whitespace();
            let Some(word) = words.next() else { continue };
            let three = || numbers(&line, word);
            match word.to_uppercase().as_str() {
                "DATASET" => {
                    check_kind(words.next().unwrap_or_default())?;
                    has_kind = true;
                }
                _ if !has_kind => {
                    return Err(Fault::Invalid(format!(
                        "'{}': expected DATASET",
                        excerpt(&line)
                    )));
                }
                "DIMENSIONS" => points = Some(three()?),
                "ORIGIN" => origin = Some(three()?),
                "SPACING" | "ASPECT_RATIO" => spacing = Some(three()?),
                _ => {
                    return Err(Fault::Invalid(format!(
                        "'{}': expected DIMENSIONS, ORIGIN or SPACING before the data",
                        excerpt(&line)
                    )));
                }
            }
        }
        let [points, origin, spacing] = [points, origin, spacing].map(Option::unwrap_or_default);
        Ok(Self {
            points: sizes(points)?,
            origin: DVec3::from_array(origin),
            spacing: DVec3::from_array(spacing),
            is_binary,
        })
    }

    /// Number of values along x, y and z, and the index of the first among the points. Cells are one less than points along
    /// an axis, and stand half a step further.
    pub(crate) fn grid(&self, centring: Centring) -> ([usize; 3], DVec3) {
        let (mut dims, mut first) = (self.points, DVec3::ZERO);
        for axis in 0..3 {
            if centring == Centring::Cells && dims[axis] > 1 {
                dims[axis] -= 1;
                first[axis] = 0.5;
            }
        }
        (dims, first)
    }
}

fn check_kind(kind: &str) -> Result<(), Fault> {
    if kind.eq_ignore_ascii_case("STRUCTURED_POINTS") {
        return Ok(());
    }
    let known = OTHER_KINDS
        .iter()
        .find(|(name, _)| kind.eq_ignore_ascii_case(name));
    Err(match known {
        Some((name, advice)) => unsupported(format!("the data set is a {name}: {advice}")),
        None => Fault::Invalid(format!(
            "the data set is '{}': expected STRUCTURED_POINTS",
            excerpt(kind)
        )),
    })
}

fn numbers(line: &str, word: &str) -> Result<[f64; 3], Fault> {
    let found: Option<Vec<f64>> = line
        .split_ascii_whitespace()
        .skip(1)
        .map(|word| word.parse().ok().filter(|value: &f64| value.is_finite()))
        .collect();
    found
        .and_then(|found| found.try_into().ok())
        .ok_or_else(|| {
            Fault::Invalid(format!(
                "'{}': expected three numbers behind {word}",
                excerpt(line)
            ))
        })
}

fn sizes(points: [f64; 3]) -> Result<[usize; 3], Fault> {
    let is_size = |size: &f64| size.fract() == 0.0 && (1.0..=MOST_POINTS).contains(size);
    if points.iter().all(is_size) {
        Ok(points.map(|size| size as usize))
    } else {
        Err(Fault::Invalid(format!(
            "DIMENSIONS are {points:?}: expected three whole numbers from 1 on"
        )))
    }
}
