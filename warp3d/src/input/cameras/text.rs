//! Camera files in lines of numbers: Middlebury's calibrations, trajectories, and bare matrices.

use glam::{DAffine3, DMat3, DQuat, DVec3};
use resample_core::camera::PixelCentre;

use crate::input::cameras::entry::{
    CameraSet, Entry, Hints, Lens, LensModel, Names, Pair, lens_from_hints,
};

// Middlebury `calib.txt`: a rectified pair.
//
// Two cameras `cam0` (left) and `cam1` (right) with the same rotation; the right one stands at X = baseline. Axes x
// right, y down, z forward; the world is the left camera's. Pixel centres at whole numbers, which only matters beside
// cameras of other files. A name between 0 and 1 is a camera on the baseline between the two, with its principal
// point between theirs: `calib.txt#0.5`. Source: the description of the 2014 data set.

/// Steps at which a camera between the two is offered, beside the two themselves.
const BETWEEN: [f64; 3] = [0.25, 0.5, 0.75];

pub(super) fn is_calib(text: &str) -> bool {
    text.lines()
        .any(|line| line.trim_start().starts_with("cam0"))
}

pub(super) fn read_calib(text: &str, hints: &Hints) -> Result<CameraSet, String> {
    let matrices = [matrix(text, "cam0")?, matrix(text, "cam1")?];
    let doffs = value(text, "doffs")?.unwrap_or(matrices[1].cx - matrices[0].cx);
    let baseline =
        value(text, "baseline")?.ok_or("no line 'baseline=': expected the distance of the eyes")?;
    if !(baseline > 0.0 && baseline.is_finite()) {
        return Err(format!(
            "a baseline of {baseline}: expected a length above 0"
        ));
    }
    let side =
        |name: &str| -> Result<Option<u32>, String> { Ok(value(text, name)?.map(|px| px as u32)) };
    let stated = side("width")?
        .zip(side("height")?)
        .map(|(width, height)| [width, height]);
    let size = stated
        .or(hints.size)
        .ok_or("no lines 'width=' and 'height=': give the picture's size")?;
    let between = |along: f64| -> Result<Entry, String> {
        let mix = |a: f64, b: f64| a + along * (b - a);
        let [left, right] = &matrices;
        let lens = Lens {
            fx: mix(left.fx, right.fx),
            fy: mix(left.fy, right.fy),
            cx: mix(left.cx, right.cx),
            cy: mix(left.cy, right.cy),
            pixel_centre: PixelCentre::Integer,
        };
        let pose = DAffine3::from_translation(DVec3::new(-along * baseline, 0.0, 0.0));
        let model = LensModel {
            lens,
            size,
            distortion: None,
        };
        model.entry(along.to_string(), pose)
    };
    let entries: Result<Vec<_>, String> =
        [0.0, 1.0].into_iter().chain(BETWEEN).map(between).collect();
    Ok(CameraSet {
        format: "calib.txt",
        entries: entries?,
        pair: Some(Pair { baseline, doffs }),
        names: Names::Words,
    })
}

/// The text behind `name=` up to the end of the line.
fn line<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let with_name = |line: &'a str| {
        line.trim_start()
            .strip_prefix(name)?
            .trim_start()
            .strip_prefix('=')
    };
    text.lines().find_map(with_name)
}

fn value(text: &str, name: &str) -> Result<Option<f64>, String> {
    let Some(word) = line(text, name) else {
        return Ok(None);
    };
    let number = word
        .trim()
        .parse::<f64>()
        .ok()
        .filter(|number| number.is_finite());
    number
        .map(Some)
        .ok_or_else(|| format!("'{name}={}': expected a number", word.trim()))
}

fn matrix(text: &str, name: &str) -> Result<Lens, String> {
    let word =
        line(text, name).ok_or_else(|| format!("no line '{name}=': expected two cameras"))?;
    let parts: Option<Vec<f64>> = word
        .split(|c: char| c.is_whitespace() || "[];,".contains(c))
        .filter(|part| !part.is_empty())
        .map(|part| part.parse().ok())
        .collect();
    match parts.as_deref() {
        Some(&[fx, _, cx, _, fy, cy, _, _, _]) => Ok(Lens {
            fx,
            fy,
            cx,
            cy,
            pixel_centre: PixelCentre::Integer,
        }),
        _ => Err(format!(
            "'{name}={}': expected [f 0 cx; 0 f cy; 0 0 1]",
            word.trim()
        )),
    }
}

// Trajectories: Open3D's and Redwood's log, and TUM's list of poses.
//
// Both hold camera-to-world poses with axes x right, y down, z forward, and no lens; the lens and the picture size
// come from the user. A log has, per camera, a line of three whole numbers and a 4 x 4 matrix; the first number is
// the name. A TUM line is `time tx ty tz qx qy qz qw`; the time as it is written is the name, and
// a time within 20 ms of it names it too. Sources: Open3D's documentation of its camera trajectory, and the TUM RGB-D
// benchmark's file formats.

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
    let rotation = crate::input::cameras::entry::upright(pose.matrix3).transpose();
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

// Files of bare matrices: poses of 7-Scenes, ScanNet and KITTI, and lenses.
//
// A pose is camera-to-world with axes x right, y down, z forward, in rows: a file of one 4 x 4 matrix in four lines
// (7-Scenes, ScanNet), or a line for each camera, of 12 numbers (KITTI, 3 x 4) or 16 (4 x 4). Cameras are named by
// their number from 0. A lens is a 3 x 3 or 4 x 4 matrix in rows, with pixel centres at whole numbers. Sources: the
// descriptions of these data sets.

/// Words of every line, as numbers; nothing where a word is none.
fn rows(text: &str) -> Option<Vec<Vec<f64>>> {
    content(text).map(|(_, words)| numbers(&words)).collect()
}

/// Numbers of a line that is a pose of its own.
fn is_pose_line(words: usize) -> bool {
    words == 12 || words == 16
}

pub(super) fn is_matrices(text: &str) -> bool {
    let mut lines = content(text).map(|(_, words)| words.len());
    match lines.next() {
        Some(4) => lines.take(3).eq([4; 3]),
        Some(words) => is_pose_line(words),
        None => false,
    }
}

pub(super) fn read_matrices(text: &str, hints: &Hints) -> Result<CameraSet, String> {
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
