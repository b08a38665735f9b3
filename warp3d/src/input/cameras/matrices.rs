//! Files of bare matrices: poses of 7-Scenes, ScanNet and KITTI, and lenses.
//!
//! A pose is camera-to-world with axes x right, y down, z forward, in rows: a file of one 4 x 4 matrix in four lines
//! (7-Scenes, ScanNet), or a line for each camera, of 12 numbers (KITTI, 3 x 4) or 16 (4 x 4). Cameras are named by
//! their number from 0. A lens is a 3 x 3 or 4 x 4 matrix in rows, with pixel centres at whole numbers. Sources: the
//! descriptions of these data sets.

use glam::{DAffine3, DMat3, DVec3};

use super::entry::{CameraSet, Hints, Names, lens_from_hints};
use super::trajectory::{content, inverse, numbers};

/// Words of every line, as numbers; nothing where a word is none.
fn rows(text: &str) -> Option<Vec<Vec<f64>>> {
    content(text).map(|(_, words)| numbers(&words)).collect()
}

/// Numbers of a line that is a pose of its own.
fn is_pose_line(words: usize) -> bool {
    words == 12 || words == 16
}

pub(super) fn is_it(text: &str) -> bool {
    let mut lines = content(text).map(|(_, words)| words.len());
    match lines.next() {
        Some(4) => lines.take(3).eq([4; 3]),
        Some(words) => is_pose_line(words),
        None => false,
    }
}

pub(super) fn read(text: &str, hints: &Hints) -> Result<CameraSet, String> {
    let lens = lens_from_hints(hints, "file of poses")?;
    let rows = rows(text).ok_or("expected matrices: a word is not a finite number")?;
    let poses: Vec<Vec<f64>> = match rows.first().map(Vec::len) {
        Some(4) => rows.chunks(4).map(<[Vec<f64>]>::concat).collect(),
        _ => rows,
    };
    let entries = poses.iter().enumerate().map(|(index, pose)| {
        let pose = pose_of(pose).map_err(|what| format!("pose {index}: {what}"))?;
        let entry = lens.entry(index.to_string(), inverse(pose));
        entry.map_err(|what| format!("pose {index}: {what}"))
    });
    Ok(CameraSet {
        format: "file of poses",
        entries: entries.collect::<Result<_, _>>()?,
        pair: None,
        names: Names::Words,
    })
}

/// The camera-to-world pose of 12 or 16 numbers in rows.
fn pose_of(numbers: &[f64]) -> Result<DAffine3, String> {
    if !is_pose_line(numbers.len()) {
        return Err(format!(
            "it has {} numbers: expected 12 or 16",
            numbers.len()
        ));
    }
    if let Some(last) = numbers.get(12..)
        && !last.is_empty()
        && last != [0.0, 0.0, 0.0, 1.0]
    {
        return Err(format!("its last row is {last:?}: expected 0 0 0 1"));
    }
    let column = |i: usize| DVec3::new(numbers[i], numbers[4 + i], numbers[8 + i]);
    Ok(DAffine3 {
        matrix3: DMat3::from_cols(column(0), column(1), column(2)),
        translation: column(3),
    })
}

/// Focal lengths and centre of a matrix in rows, `[fx, fy, cx, cy]`.
pub(super) fn lens(text: &str) -> Result<[f64; 4], String> {
    let expected = "expected a matrix fx 0 cx / 0 fy cy / 0 0 1 in lines";
    let rows = rows(text).ok_or(expected)?;
    let is_square = rows.iter().all(|row| row.len() == rows.len());
    if !(is_square && (rows.len() == 3 || rows.len() == 4)) {
        return Err(expected.into());
    }
    let is_lens = rows[1][0] == 0.0 && rows[2][..3] == [0.0, 0.0, 1.0];
    if !is_lens {
        return Err(expected.into());
    }
    Ok([rows[0][0], rows[1][1], rows[0][2], rows[1][2]])
}
