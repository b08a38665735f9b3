//! E57: the points of all scans of a file, at their poses, with colours and intensities.
//!
//! Takes a path, gives points. The crate `e57` reads the pages and turns ranges with angles into places; what it would loop or
//! allocate by is held against the file first, and a panic of it is an error. Source: ASTM E2807.
//! Limits: pictures are left out; intensities have the range that their scan says.

use resample_core::narrow::{code16, count};
use std::fs::File;
use std::io::BufReader;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use ::e57::{CartesianCoordinate, E57Reader, PointCloud, RecordDataType};
use glam::DVec3;
use resample_io::files::open_regular;

use super::collect::{CELL_BYTES, Collector, Colours, Has, Point, Station};
use super::file::{CloudLoadOptions, PointCloudFile};

/// The first bytes of a file.
pub(super) const MAGIC: &[u8] = b"ASTM-E57";

/// Bytes that a packet of points may take in memory: 64 kB in queues of 16 bytes a number of one bit.
const QUEUE_BYTES: u64 = (64 << 13) * 16;

/// Reads a file.
pub(super) fn load(path: &Path, options: &CloudLoadOptions) -> Result<PointCloudFile, String> {
    let (file, held) = open_regular(path).map_err(|error| format!("cannot be read: {error}"))?;
    let read = catch_unwind(AssertUnwindSafe(|| read(file, held, options)));
    read.unwrap_or_else(|_| Err("its points are damaged".to_owned()))
}

fn read(file: File, held: u64, options: &CloudLoadOptions) -> Result<PointCloudFile, String> {
    let opened = E57Reader::new(BufReader::new(file));
    let mut reader = opened.map_err(|error| format!("no whole E57 file: {error}"))?;
    let scans = reader.pointclouds();
    let mut total = 0u64;
    for scan in &scans {
        check(scan, held)?;
        total = total.saturating_add(scan.records);
    }
    let any = |has: fn(&PointCloud) -> bool| scans.iter().any(has);
    let has = Has {
        colours: if any(PointCloud::has_color) {
            Colours::Bits8
        } else {
            Colours::None
        },
        intensities: any(PointCloud::has_intensity),
        ..Has::default()
    };
    let cells = scans
        .iter()
        .filter_map(Cells::of)
        .map(|cells| cells.count());
    let beside = QUEUE_BYTES + CELL_BYTES.saturating_mul(cells.max().unwrap_or(0));
    let mut collector = Collector::new(total, has, beside, options)?;
    let mut unplaced = 0u64;
    for (number, scan) in scans.iter().enumerate() {
        let located = |error: ::e57::Error| format!("scan {number}: {error}");
        let mut points = reader.pointcloud_simple(scan).map_err(located)?;
        // A scan without colours stays grey.
        points.intensity_to_color(true);
        let cells = Cells::of(scan);
        let mut station = cells.map(|cells| Station::empty(cells.size.map(count)));
        for point in points {
            let stored = point.map_err(located)?;
            let point = taken(&stored);
            let mut taken = None;
            if collector.wants_next() {
                unplaced += u64::from(point.place.is_nan());
                taken = collector.take(&point);
            }
            if let (Some(cells), Some(station)) = (&cells, &mut station)
                && let Some(cell) = cells.cell(&stored)
            {
                station.set(cell, point.place - cells.scanner, taken);
            }
        }
        if let Some(station) = &station {
            collector.end_station(station);
        }
    }
    if scans.len() > 1 {
        collector.note(format!(
            "the points of its {} scans are put together",
            scans.len()
        ));
    }
    if unplaced > 0 {
        collector.note(format!("{unplaced} of its directions have no return"));
    }
    collector.finish()
}

/// The grid of a scan.
#[derive(Clone, Copy)]
struct Cells {
    /// First column and row.
    first: [i64; 2],
    /// Columns and rows.
    size: [u64; 2],
    /// The place of the scanner.
    scanner: DVec3,
}

impl Cells {
    /// The grid that a scan says; `None` where it says none, or one of many more cells than it has points.
    fn of(scan: &PointCloud) -> Option<Self> {
        /// Most cells for a point: a scanner sees the sky in about half of the directions.
        const MOST: u64 = 8;
        let bounds = scan
            .index_bounds
            .as_ref()
            .filter(|_| scan.has_row_column())?;
        let first = [bounds.column_min?, bounds.row_min?];
        let last = [bounds.column_max?, bounds.row_max?];
        let side = |axis: usize| {
            u64::try_from(last[axis].checked_sub(first[axis])?)
                .ok()?
                .checked_add(1)
        };
        let size = [side(0)?, side(1)?];
        let moved = scan.transform.as_ref().map(|pose| &pose.translation);
        let cells = size[0].checked_mul(size[1])?;
        (cells <= MOST.saturating_mul(scan.records)).then(|| Self {
            first,
            size,
            scanner: moved.map_or(DVec3::ZERO, |at| DVec3::new(at.x, at.y, at.z)),
        })
    }

    fn count(&self) -> u64 {
        self.size[0] * self.size[1]
    }

    /// Column and row of a point.
    fn cell(&self, point: &::e57::Point) -> Option<[usize; 2]> {
        let column = usize::try_from(point.column.checked_sub(self.first[0])?).ok()?;
        let row = usize::try_from(point.row.checked_sub(self.first[1])?).ok()?;
        Some([column, row])
    }
}

/// Refuses more points than the bits of the file can hold, and numbers that take no bits at all.
fn check(scan: &PointCloud, held: u64) -> Result<(), String> {
    let has_bits = |kind: &RecordDataType| match kind {
        RecordDataType::Integer { min, max } | RecordDataType::ScaledInteger { min, max, .. } => {
            min < max
        }
        RecordDataType::Single { .. } | RecordDataType::Double { .. } => true,
    };
    let is_stored = scan
        .prototype
        .iter()
        .any(|record| has_bits(&record.data_type));
    if !is_stored || scan.records > held.saturating_mul(8) {
        return Err(format!(
            "its header says {} points, more than a file of {held} bytes can hold",
            scan.records
        ));
    }
    Ok(())
}

fn taken(point: &::e57::Point) -> Point {
    let place = match point.cartesian {
        CartesianCoordinate::Valid { x, y, z } => DVec3::new(x, y, z),
        _ => DVec3::NAN,
    };
    let colour = point.color.as_ref().map_or([0; 3], |colour| {
        [colour.red, colour.green, colour.blue].map(|part| code16(f64::from(part * 255.0)))
    });
    Point {
        place,
        colour,
        intensity: point.intensity.unwrap_or(0.0),
        ..Point::default()
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use ::e57::{E57Writer, Quaternion, Record, RecordName, RecordValue, Transform, Translation};

    use super::super::test_files::{Dir, survive_damage};
    use super::*;
    use crate::GridFate;

    /// Two scans of three points, the second turned by a quarter about z and moved.
    fn file() -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let mut writer = E57Writer::new(&mut bytes, "file").expect("a writer");
        for number in 0..2 {
            let prototype = vec![
                Record::CARTESIAN_X_F64,
                Record::CARTESIAN_Y_F64,
                Record::CARTESIAN_Z_F64,
                Record::COLOR_RED_U8,
                Record::COLOR_GREEN_U8,
                Record::COLOR_BLUE_U8,
                Record::INTENSITY_UNIT_F32,
            ];
            let mut scan = writer.add_pointcloud("scan", prototype).expect("a scan");
            if number == 1 {
                let half = std::f64::consts::FRAC_1_SQRT_2;
                scan.set_transform(Some(Transform {
                    rotation: Quaternion {
                        w: half,
                        x: 0.0,
                        y: 0.0,
                        z: half,
                    },
                    translation: Translation {
                        x: 10.0,
                        y: 0.0,
                        z: 0.0,
                    },
                }));
            }
            for point in 0..3 {
                let mut values: Vec<_> = [f64::from(point), 0.0, 1.0]
                    .map(RecordValue::Double)
                    .to_vec();
                values.extend([255, 100, 0].map(RecordValue::Integer));
                values.push(RecordValue::Single(0.25 * point as f32));
                scan.add_point(values).expect("a point");
            }
            scan.finalize().expect("whole");
        }
        writer.finalize().expect("whole");
        drop(writer);
        bytes.into_inner()
    }

    #[test]
    fn scans_are_put_together_at_their_poses() {
        let dir = Dir::new();
        let path = dir.write("a", &file());
        let file = load(&path, &CloudLoadOptions::default()).expect("a good file");
        assert_eq!(file.positions.len(), 6);
        assert_eq!(file.positions[2], [2.0, 0.0, 1.0]);
        let [x, y, z] = file.positions[5];
        assert!(
            (x - 10.0).abs() + (y - 2.0).abs() + (z - 1.0).abs() < 1e-5,
            "{x} {y} {z}"
        );
        assert_eq!(file.colours, Some(vec![[255, 100, 0]; 6]));
        assert_eq!(file.intensities.expect("there")[2], 32_768);
        assert!(file.notes[0].contains("2 scans"), "{:?}", file.notes);
        let options = CloudLoadOptions {
            points: Some(2),
            ..CloudLoadOptions::default()
        };
        assert_eq!(load(&path, &options).expect("good").positions.len(), 2);
    }

    /// A scan at (9, 0, 0) in a round room with a post; the range of one beam beside the post lies between both. Rows come first.
    fn grid() -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let mut writer = E57Writer::new(&mut bytes, "file").expect("a writer");
        let index = |name| Record {
            name,
            data_type: RecordDataType::Integer { min: 0, max: 255 },
        };
        let prototype = vec![
            Record::CARTESIAN_X_F64,
            Record::CARTESIAN_Y_F64,
            Record::CARTESIAN_Z_F64,
            index(RecordName::RowIndex),
            index(RecordName::ColumnIndex),
        ];
        let mut scan = writer.add_pointcloud("scan", prototype).expect("a scan");
        scan.set_transform(Some(Transform {
            rotation: Quaternion {
                w: 1.0,
                x: 0.0,
                y: 0.0,
                z: 0.0,
            },
            translation: Translation {
                x: 9.0,
                y: 0.0,
                z: 0.0,
            },
        }));
        for row in 0..60 {
            for column in 0..180 {
                let (sin, cos) = (2.0 * f64::from(column)).to_radians().sin_cos();
                let (up, out) = (2.0 * f64::from(row) - 59.0).to_radians().sin_cos();
                let range = match column {
                    20..=25 => 1.0,
                    26 => 2.5,
                    _ => 5.0,
                };
                let place = [range * out * cos, range * out * sin, range * up];
                let mut values: Vec<_> = place.map(RecordValue::Double).to_vec();
                values.extend([row, column].map(|index| RecordValue::Integer(i64::from(index))));
                scan.add_point(values).expect("a point");
            }
        }
        scan.finalize().expect("whole");
        writer.finalize().expect("whole");
        drop(writer);
        bytes.into_inner()
    }

    #[test]
    fn points_of_a_grid_between_two_surfaces_are_marked() {
        let dir = Dir::new();
        let path = dir.write("a", &grid());
        let file = load(&path, &CloudLoadOptions::default()).expect("a good file");
        let fates = file.of_grid.expect("marked");
        for (index, fate) in fates.iter().enumerate() {
            assert_eq!(*fate == GridFate::Mixed, index % 180 == 26, "{index}");
        }
        survive_damage(&grid(), load);
    }

    #[test]
    fn forged_and_damaged_files_are_refused() {
        let dir = Dir::new();
        let good = file();
        let why = load(&dir.write("a", &good[..1500]), &CloudLoadOptions::default());
        assert!(why.expect_err("cut").contains("E57"));
        survive_damage(&good, load);
        let mut scan = E57Reader::new(Cursor::new(&good))
            .expect("good")
            .pointclouds()
            .remove(0);
        assert!(check(&scan, good.len() as u64).is_ok());
        scan.records = u64::MAX;
        assert!(check(&scan, good.len() as u64).is_err(), "more than fit");
        scan.records = 3;
        scan.prototype
            .iter_mut()
            .for_each(|record| record.data_type = RecordDataType::Integer { min: 1, max: 1 });
        assert!(check(&scan, good.len() as u64).is_err(), "no bits");
    }
}
