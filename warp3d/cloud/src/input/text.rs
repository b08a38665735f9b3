//! Scans as text: PTX (grids of a scanner, with poses), PTS (a number of points, then the points), and XYZ (points alone).
//!
//! Takes a path, gives points. Columns of a line are, behind the place: of PTS and PTX an intensity, then red, green and blue; of
//! XYZ what a line of names says, or what the first lines look like: colours are 0 to 255 or 0 to 1, normals have length 1.
//! Source: Leica's description of PTX and PTS; CloudCompare's and Open3D's manuals for XYZ.
//! In PTX, cells without a return (0 0 0) are left out, and rows and columns say which points show no surface of their own.

use resample_core::narrow::{code8, code16, count, single, whole};
use std::fs::File;
use std::path::Path;

use glam::{DMat4, DVec3, DVec4};
use resample_io::files::{first_bytes, open_regular};

use super::collect::{CELL_BYTES, Collector, Colours, Has, Point, Station};
use super::file::{CloudFormat, CloudLoadOptions, PointCloudFile};
use super::lines::{self, Row};

/// Bytes that show the columns.
const HEAD_BYTES: u64 = 4096;

/// Lines of a PTX header: sizes, the scanner's place and axes, and a matrix whose rows stand for x, y, z and the place.
const PTX_HEADER: [usize; 10] = [1, 1, 3, 3, 3, 3, 4, 4, 4, 4];

/// The format of a text that begins with these bytes.
pub(super) fn format_of(head: &[u8]) -> Option<CloudFormat> {
    let is_text = |byte: &u8| matches!(byte, b'\t' | b'\n' | b'\r' | b' '..=b'~');
    if !head.iter().all(is_text) {
        return None;
    }
    let rows = rows_of(head);
    let counts: Vec<usize> = rows.iter().map(|row| row.numbers().len()).collect();
    if counts.starts_with(&PTX_HEADER) {
        return Some(CloudFormat::Ptx);
    }
    let is_whole = |row: &Row| row.numbers()[0].fract() == 0.0 && row.numbers()[0] >= 0.0;
    if counts.first() == Some(&1) {
        let is_pts =
            is_whole(&rows[0]) && counts.len() > 1 && counts[1..].iter().all(|count| *count >= 3);
        return is_pts.then_some(CloudFormat::Pts);
    }
    let columns = *counts.first()?;
    let is_known = matches!(columns, 3 | 4 | 6 | 7 | 9) || columns >= 3 && names_of(head).is_some();
    (is_known && counts.iter().all(|count| *count == columns)).then_some(CloudFormat::Xyz)
}

/// The whole lines of numbers of a file's beginning.
fn rows_of(head: &[u8]) -> Vec<Row> {
    let whole = match head.len() as u64 == HEAD_BYTES {
        true => head
            .iter()
            .rposition(|byte| *byte == b'\n')
            .map_or(0, |at| at + 1),
        false => head.len(),
    };
    let rows = head[..whole]
        .split(|byte| *byte == b'\n')
        .map(lines::row_of);
    rows.filter(|row| !row.numbers().is_empty()).collect()
}

/// The names of columns, from a first line of words that begins with x, y and z, be it a comment or not.
fn names_of(head: &[u8]) -> Option<Vec<String>> {
    let line = head.split(|byte| *byte == b'\n').next()?;
    let line = line.trim_ascii_start();
    let line = line
        .strip_prefix(b"//")
        .or_else(|| line.strip_prefix(b"#"))
        .unwrap_or(line);
    let name = |word: &[u8]| String::from_utf8_lossy(word).to_ascii_lowercase();
    let names: Vec<String> = lines::words(line).map(name).take(lines::MOST).collect();
    (names.len() >= 3 && names[..3] == ["x", "y", "z"]).then_some(names)
}

/// The meaning of the columns behind the place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Columns {
    colour: Option<usize>,
    /// The factor that makes 8 bits of a colour.
    colour_scale: f64,
    intensity: Option<usize>,
    class: Option<usize>,
    normal: Option<usize>,
}

impl Columns {
    fn of(format: CloudFormat, head: &[u8]) -> Self {
        let rows = rows_of(head);
        let rows = match format {
            CloudFormat::Ptx => first_grid(&rows),
            CloudFormat::Pts => rows.get(1..).unwrap_or_default(),
            _ => &rows,
        };
        let count = rows
            .iter()
            .map(|row| row.numbers().len())
            .min()
            .unwrap_or(3);
        if let Some(names) = names_of(head) {
            return Self::named(&names, rows);
        }
        let mut columns = Self {
            intensity: matches!(count, 4 | 7).then_some(3),
            ..Self::default()
        };
        // Leica's files have no normals.
        let is_leica = format != CloudFormat::Xyz;
        for first in if count == 7 { vec![4] } else { vec![3, 6] } {
            if first + 3 > count || count < 6 {
                continue;
            }
            match scale_of(rows, first) {
                Some(scale)
                    if columns.colour.is_none() && (is_leica || !are_normals(rows, first)) =>
                {
                    (columns.colour, columns.colour_scale) = (Some(first), scale);
                }
                _ => columns.normal = columns.normal.or((!is_leica).then_some(first)),
            }
        }
        columns
    }

    fn named(names: &[String], rows: &[Row]) -> Self {
        let place = |wanted: &[&str]| {
            names
                .iter()
                .position(|name| wanted.contains(&name.as_str()))
        };
        let colour = place(&["r", "red"]).filter(|first| first + 3 <= names.len());
        Self {
            colour,
            colour_scale: colour
                .and_then(|first| scale_of(rows, first))
                .unwrap_or(1.0),
            intensity: place(&["i", "intensity", "scalar_intensity", "reflectance"]),
            class: place(&["class", "classification", "scalar_classification", "label"]),
            normal: place(&["nx", "normal_x"]).filter(|first| first + 3 <= names.len()),
        }
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

    fn point(&self, numbers: &[f64], place: DVec3) -> Point {
        let number = |column: usize| numbers.get(column).copied().unwrap_or(0.0);
        let three = |first: usize| [first, first + 1, first + 2].map(number);
        let colour = self.colour.map_or([0.0; 3], three);
        Point {
            place,
            colour: colour.map(|part| code16(part * self.colour_scale)),
            intensity: single(self.intensity.map_or(0.0, number)),
            class: code8(self.class.map_or(0.0, number)),
            normal: self.normal.map_or([0.0; 3], three).map(single),
            radius: 0.0,
        }
    }
}

/// The points of the first grid of a PTX file: a second one begins with a header, whose lines are shorter.
fn first_grid(rows: &[Row]) -> &[Row] {
    let points = rows.get(PTX_HEADER.len()..).unwrap_or_default();
    let count = rows[0].numbers()[0] * rows[1].numbers()[0];
    let end = points
        .iter()
        .zip(1u32..)
        .take_while(|(_, n)| f64::from(*n) <= count);
    &points[..end.count()]
}

/// Three columns of each row.
fn triples(rows: &[Row], first: usize) -> impl Iterator<Item = DVec3> {
    let triple = move |row: &Row| row.numbers().get(first..first + 3).map(DVec3::from_slice);
    rows.iter().filter_map(triple)
}

/// The factor that makes colours of 8 bits of three columns; `None` where they are no colours.
fn scale_of(rows: &[Row], first: usize) -> Option<f64> {
    let least = triples(rows, first).fold(0.0f64, |least, triple| least.min(triple.min_element()));
    let most = triples(rows, first).fold(0.0f64, |most, triple| most.max(triple.max_element()));
    let is_whole = triples(rows, first).all(|triple| triple.fract() == DVec3::ZERO);
    match () {
        () if least < 0.0 || most > 255.0 => None,
        // Whole numbers up to 1 are dark colours of 8 bits.
        () if is_whole => Some(1.0),
        () if most <= 1.0 => Some(255.0),
        () => None,
    }
}

/// Returns true if three columns have length 1 in all rows, within the digits of usual files.
fn are_normals(rows: &[Row], first: usize) -> bool {
    let is_unit = |triple: DVec3| (triple.length() - 1.0).abs() < 0.01;
    triples(rows, first).count() > 1 && triples(rows, first).all(is_unit)
}

/// Reads a file.
pub(super) fn load(path: &Path, options: &CloudLoadOptions) -> Result<PointCloudFile, String> {
    let head = first_bytes(path, HEAD_BYTES).map_err(|error| error.to_string())?;
    let format = format_of(&head).ok_or("it is no text of points")?;
    let columns = Columns::of(format, &head);
    let open = || open_regular(path).map_err(|error| format!("cannot be read: {error}"));
    let lines = lines::count(&mut open()?.0).map_err(|error| format!("cannot be read: {error}"))?;
    let beside = match format {
        CloudFormat::Ptx => CELL_BYTES.saturating_mul(lines),
        _ => 0,
    };
    let mut collector = Collector::new(lines, columns.has(), beside, options)?;
    let mut file = open()?.0;
    match format {
        CloudFormat::Ptx => grids(&mut file, &columns, &mut collector)?,
        _ => lines::each(&mut file, &mut |row| {
            // A number alone says how many points follow.
            if let [x, y, z, ..] = *row.numbers()
                && collector.wants_next()
            {
                collector.take(&columns.point(row.numbers(), DVec3::new(x, y, z)));
            }
            Ok(())
        })?,
    }
    collector.finish()
}

/// The grids of a PTX file, one after another.
fn grids(file: &mut File, columns: &Columns, collector: &mut Collector) -> Result<(), String> {
    let mut header: Vec<Vec<f64>> = Vec::new();
    let (mut left, mut grid) = (0u64, 0);
    let mut world_from_scan = DMat4::IDENTITY;
    let mut station = Station::default();
    lines::each(file, &mut |row| {
        let numbers = row.numbers();
        if numbers.is_empty() {
            return Ok(());
        }
        if left == 0 {
            if numbers.len() != PTX_HEADER[header.len()] {
                let (line, got, expected) =
                    (header.len() + 1, numbers.len(), PTX_HEADER[header.len()]);
                return Err(format!(
                    "line {line} of the header of grid {grid} has {got} numbers: expected {expected}"
                ));
            }
            header.push(numbers.to_vec());
            if header.len() == PTX_HEADER.len() {
                let size = [whole(header[0][0]), whole(header[1][0])];
                left = size[0].saturating_mul(size[1]);
                station = Station::growing(size.map(count));
                let [x, y, z, w] = [6, 7, 8, 9].map(|line| DVec4::from_slice(&header[line]));
                world_from_scan = DMat4::from_cols(x, y, z, w);
                header.clear();
                grid += 1;
            }
            return Ok(());
        }
        left -= 1;
        let [x, y, z, ..] = *numbers else {
            return Err(format!(
                "a point of grid {} has {} numbers: expected at least 3",
                grid - 1,
                numbers.len()
            ));
        };
        let place = DVec3::new(x, y, z);
        let mut point = None;
        if place != DVec3::ZERO && collector.wants_next() {
            let place = world_from_scan.transform_point3(place);
            point = collector.take(&columns.point(numbers, place));
        }
        station.push(place, point);
        if left == 0 {
            collector.end_station(&std::mem::take(&mut station));
        }
        Ok(())
    })?;
    match left {
        0 if header.is_empty() => Ok(()),
        _ => Err(format!(
            "grid {} lacks {left} of its points: the file is cut off",
            grid.max(1) - 1
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_files::{Dir, survive_damage};
    use super::*;
    use crate::GridFate;

    fn read(text: &str) -> Result<PointCloudFile, String> {
        let dir = Dir::new();
        load(
            &dir.write("a", text.as_bytes()),
            &CloudLoadOptions::default(),
        )
    }

    #[test]
    fn columns_are_told_by_what_they_look_like() {
        let file = read("1 2 3\n4 5 6").expect("good");
        assert_eq!(file.positions, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        assert_eq!(
            (file.colours, file.intensities, file.normals),
            (None, None, None)
        );
        let file = read("1,2,3,255,0,9\n4,5,6,1,2,3\n").expect("good");
        assert_eq!(file.colours, Some(vec![[255, 0, 9], [1, 2, 3]]));
        let file = read("1 2 3 0.5 0 1\n4 5 6 1 1 1\n").expect("good");
        assert_eq!(file.colours, Some(vec![[128, 0, 255], [255; 3]]));
        let file = read("1 2 3 0.6 0 0.8\n4 5 6 0 -1 0\n").expect("good");
        assert_eq!(file.normals, Some(vec![[0.6, 0.0, 0.8], [0.0, -1.0, 0.0]]));
        let file = read("1 2 3 9 8 7 0.6 0 0.8\n4 5 6 1 1 1 1 0 0\n").expect("good");
        assert_eq!(file.colours, Some(vec![[9, 8, 7], [1; 3]]));
        assert!(file.normals.is_some());
        let file = read("# made by hand\n1 2 3 300\n\n4 5 6 7\n").expect("good");
        assert_eq!(file.intensities, Some(vec![300, 7]));
    }

    #[test]
    fn names_of_columns_count() {
        let text = "//X Y Z Classification R G B Intensity\n1 2 3 6 9 8 7 500\n4 5 6 2 1 1 1 3\n";
        let file = read(text).expect("good");
        assert_eq!(file.classes, Some(vec![6, 2]));
        assert_eq!(file.colours, Some(vec![[9, 8, 7], [1; 3]]));
        assert_eq!(file.intensities, Some(vec![500, 3]));
    }

    #[test]
    fn a_number_of_points_comes_first_in_pts() {
        let file = read("2\n1 2 3 -2048 9 8 7\n4 5 6 2047 1 1 1\n").expect("good");
        assert_eq!(file.positions.len(), 2);
        assert_eq!(file.colours, Some(vec![[9, 8, 7], [1; 3]]));
        assert_eq!(file.intensities, Some(vec![0, 65_535]));
    }

    /// A grid of 2 x 2, one cell of which has no return, moved by (100, 0, 0) and turned by a quarter about z.
    const GRID: &str = "2\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n100 0 0 1\n\
         1 2 3 0.5 9 8 7\n0 0 0 0 0 0 0\n4 5 6 1 1 1 1\n7 8 9 0 255 0 0\n";

    #[test]
    fn grids_stand_at_their_poses() {
        let file = read(&GRID.repeat(2)).expect("good");
        assert_eq!(file.positions.len(), 6);
        assert_eq!(file.positions[0], [98.0, 1.0, 3.0]);
        assert_eq!(
            file.colours.expect("there")[..3],
            [[9, 8, 7], [1; 3], [255, 0, 0]]
        );
        assert_eq!(file.intensities.expect("there")[..3], [32_768, 65_535, 0]);
    }

    /// A station in a round room with a post, at 2 degrees a beam; the range of one beam beside the post lies between both.
    fn station() -> String {
        let mut text =
            "180\n60\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n9 0 0 1\n".to_owned();
        for column in 0..180 {
            for row in 0..60 {
                let (sin, cos) = f64::from(2 * column).to_radians().sin_cos();
                let (up, out) = f64::from(2 * row - 59).to_radians().sin_cos();
                let range = match column {
                    20..=25 => 1.0,
                    26 => 2.5,
                    _ => 5.0,
                };
                let place = range * DVec3::new(out * cos, out * sin, up);
                text += &format!("{:.6} {:.6} {:.6} 0.5\n", place.x, place.y, place.z);
            }
        }
        text
    }

    #[test]
    fn points_of_a_grid_between_two_surfaces_are_marked() {
        let file = read(&station().repeat(2)).expect("good");
        let fates = file.of_grid.as_ref().expect("marked");
        assert_eq!(fates.len(), 2 * 180 * 60);
        for (index, fate) in fates.iter().enumerate() {
            let is_mixed = index / 60 % 180 == 26;
            assert_eq!(*fate == GridFate::Mixed, is_mixed, "{index}");
            assert_eq!(file.is_kept(index), *fate == GridFate::Kept);
        }
        let said = file.left_by_grid();
        assert!(
            said[0].starts_with("120 of 21600 points lie between two"),
            "{said:?}"
        );
        let dir = Dir::new();
        let options = CloudLoadOptions {
            points: Some(1000),
            ..CloudLoadOptions::default()
        };
        let thin = load(&dir.write("a", station().as_bytes()), &options).expect("good");
        assert_eq!(
            thin.of_grid.map(|fates| fates.len()),
            Some(thin.positions.len())
        );
        assert_eq!(
            read(&GRID.repeat(2)).expect("good").of_grid,
            None,
            "two columns"
        );
    }

    #[test]
    fn forged_and_damaged_files_are_refused() {
        let forged = GRID.replacen("2\n2", "2\n99999999999", 1);
        assert!(read(&forged).expect_err("cut").contains("lacks"));
        let two = GRID.to_owned() + "5\n1 2 3\n";
        assert!(
            read(&two)
                .expect_err("no header")
                .contains("line 2 of the header of grid 1")
        );
        assert!(
            read("nan 0 0\n")
                .expect_err("nothing")
                .contains("finite place")
        );
        for good in [GRID, "2\n1 2 3 9\n4 5 6 7\n", "1 2 3 4 5 6\n4 5 6 7 8 9\n"] {
            survive_damage(good.as_bytes(), load);
        }
    }
}
