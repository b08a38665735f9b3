//! Trajectories: Open3D's and Redwood's log, and TUM's list of poses.
//!
//! Both hold camera-to-world poses with axes x right, y down, z forward, and no lens; the lens and the picture size
//! come from the user. A log has, per camera, a line of three whole numbers and a 4 x 4 matrix; the first number is
//! the name. A TUM line is `time tx ty tz qx qy qz qw`; the time as it is written is the name, and
//! a time within 20 ms of it names it too. Sources: Open3D's documentation of its camera trajectory, and the TUM RGB-D
//! benchmark's file formats.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::entry::{CameraSet, Hints, Names, lens_from_hints};

pub(super) fn is_log(text: &str) -> bool {
    let mut lines = content(text).map(|(_, words)| words.len());
    lines.next() == Some(3) && lines.next() == Some(4)
}

pub(super) fn is_tum(text: &str) -> bool {
    let first = content(text).next();
    first.is_some_and(|(_, words)| words.len() == 8 && numbers(&words).is_some())
}

pub(super) fn read_log(text: &str, hints: &Hints) -> Result<CameraSet, String> {
    let model = lens_from_hints(hints, "trajectory")?;
    let lines: Vec<_> = content(text).collect();
    let entries = lines.chunks(5).map(|lines| {
        let (number, head) = &lines[0];
        let wrong =
            || format!("line {number}: expected three numbers and then four lines of a 4x4 matrix");
        let [name, _, _] = head.as_slice() else {
            return Err(wrong());
        };
        let rows: Option<Vec<Vec<f64>>> = lines[1..]
            .iter()
            .map(|(_, words)| numbers(words).filter(|row| row.len() == 4))
            .collect();
        let rows = rows.filter(|rows| rows.len() == 4).ok_or_else(wrong)?;
        let column = |i: usize| DVec3::new(rows[0][i], rows[1][i], rows[2][i]);
        let world_from_camera = DAffine3 {
            matrix3: DMat3::from_cols(column(0), column(1), column(2)),
            translation: column(3),
        };
        let entry = model.entry((*name).to_owned(), inverse(world_from_camera));
        entry.map_err(|what| format!("line {number}: {what}"))
    });
    Ok(CameraSet {
        format: "trajectory",
        entries: entries.collect::<Result<_, _>>()?,
        pair: None,
        names: Names::Words,
    })
}

pub(super) fn read_tum(text: &str, hints: &Hints) -> Result<CameraSet, String> {
    let model = lens_from_hints(hints, "TUM trajectory")?;
    let entries = content(text).map(|(number, words)| {
        let wrong = || format!("line {number}: expected time tx ty tz qx qy qz qw");
        let values = numbers(&words).ok_or_else(wrong)?;
        let &[_, tx, ty, tz, qx, qy, qz, qw] = values.as_slice() else {
            return Err(wrong());
        };
        let rotation = rotation(DQuat::from_xyzw(qx, qy, qz, qw))
            .map_err(|what| format!("line {number}: {what}"))?;
        let world_from_camera =
            DAffine3::from_rotation_translation(rotation, DVec3::new(tx, ty, tz));
        let entry = model.entry(words[0].to_owned(), world_from_camera.inverse());
        entry.map_err(|what| format!("line {number}: {what}"))
    });
    Ok(CameraSet {
        format: "TUM trajectory",
        entries: entries.collect::<Result<_, _>>()?,
        pair: None,
        names: Names::Times,
    })
}

/// A quaternion of a file as a rotation: any length but 0.
pub(super) fn rotation(quaternion: DQuat) -> Result<DQuat, String> {
    let length = quaternion.length();
    if length > 1e-6 && length.is_finite() {
        Ok(quaternion / length)
    } else {
        Err("a quaternion of length 0 is no rotation".into())
    }
}

/// The inverse of a rigid pose; the transpose is exact where the general inverse would spread rounding.
pub(super) fn inverse(pose: DAffine3) -> DAffine3 {
    let rotation = super::entry::upright(pose.matrix3).transpose();
    DAffine3 {
        matrix3: rotation,
        translation: rotation * -pose.translation,
    }
}

/// Numbered lines that hold something, as words.
pub(super) fn content(text: &str) -> impl Iterator<Item = (usize, Vec<&str>)> {
    let numbered = text
        .lines()
        .enumerate()
        .map(|(index, line)| (index + 1, line.trim()));
    numbered
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
        .map(|(number, line)| (number, line.split_whitespace().collect()))
}

/// All words as finite numbers.
pub(super) fn numbers(words: &[&str]) -> Option<Vec<f64>> {
    words
        .iter()
        .map(|word| word.parse().ok().filter(|value: &f64| value.is_finite()))
        .collect()
}
