//! Points in PLY: vertices without faces, with colours, normals, intensities, classes and radii as programs name them.
//!
//! Takes a path, gives points. The rows come from `resample_io::ply`; properties are found by their names, with CloudCompare's
//! `scalar_` before those of its own. Limits: faces are left out, with a note.

use resample_core::narrow::{code8, code16, single};
use std::io::BufReader;
use std::path::Path;

use glam::DVec3;
use resample_io::files::open_regular;
use resample_io::ply::{Element, Header, Rows, Scalar};

use super::collect::{Collector, Colours, Has, Point};
use super::file::{CloudLoadOptions, PointCloudFile};

/// Names of each attribute, the first that is there counts; case and a leading `scalar_` do not.
const COLOURS: [&[&str]; 3] = [
    &["red", "r", "diffuse_red"],
    &["green", "g", "diffuse_green"],
    &["blue", "b", "diffuse_blue"],
];
const NORMALS: [&[&str]; 3] = [
    &["nx", "normal_x"],
    &["ny", "normal_y"],
    &["nz", "normal_z"],
];
const INTENSITY: &[&str] = &["intensity", "reflectance", "reflectivity"];
const CLASS: &[&str] = &["classification", "class", "label"];
const RADIUS: &[&str] = &["radius", "point_radius"];

/// Properties of files of Gaussians, which are no scans.
const GAUSSIANS: [&str; 2] = ["scale_0", "packed_position"];

/// Returns true if the vertices are points of a scan: they have places, and there are no faces.
pub(super) fn is_scan(header: &Header) -> bool {
    let rows = |name: &str| header.element(name).map_or(0, |element| element.count);
    let is_one = |element: &Element| {
        let has = |name: &&str| element.column(name).is_some();
        ["x", "y", "z"].iter().all(has) && !GAUSSIANS.iter().any(has)
    };
    rows("face") == 0 && rows("tristrips") == 0 && header.element("vertex").is_some_and(is_one)
}

/// Reads a file.
pub(super) fn load(path: &Path, options: &CloudLoadOptions) -> Result<PointCloudFile, String> {
    let (file, bytes) = open_regular(path).map_err(|error| format!("cannot be read: {error}"))?;
    let mut file = BufReader::with_capacity(1 << 20, file);
    let header = Header::read(&mut file).map_err(|fault| fault.to_string())?;
    let mut rows = Rows::new(&mut file, &header, bytes);
    for element in &header.elements {
        if element.name != "vertex" {
            rows.pass(element).map_err(|fault| fault.to_string())?;
            continue;
        }
        rows.check(element).map_err(|fault| fault.to_string())?;
        let columns = Columns::of(element)?;
        let mut collector = Collector::new(element.count, columns.has, 0, options)?;
        let read = rows.each(element, &columns.places, &mut |row| {
            if collector.wants_next() {
                collector.take(&columns.point(row));
            }
            Ok(())
        });
        read.map_err(|fault| fault.to_string())?;
        return collector.finish();
    }
    Err("it has no element 'vertex': expected points".to_owned())
}

/// The columns that are read: the place first, then what there is of the attributes.
struct Columns {
    places: Vec<usize>,
    has: Has,
    /// The factor that makes 8 bits of a colour.
    colour_scale: f64,
}

fn column(element: &Element, names: &[&str]) -> Option<usize> {
    let is_named = |property: &str, name: &str| {
        let property = property.to_ascii_lowercase();
        property.strip_prefix("scalar_").unwrap_or(&property) == name
    };
    let find = |name: &&str| {
        let mut properties = element.properties.iter();
        properties.position(|p| p.length.is_none() && is_named(&p.name, name))
    };
    names.iter().find_map(find)
}

fn columns<const N: usize>(element: &Element, names: [&[&str]; N]) -> Option<[usize; N]> {
    let found: Option<Vec<usize>> = names.iter().map(|names| column(element, names)).collect();
    found?.try_into().ok()
}

impl Columns {
    fn of(element: &Element) -> Result<Self, String> {
        let place = columns(element, [&["x"], &["y"], &["z"]]);
        let place = place.ok_or("its vertices have no x, y and z: expected points")?;
        let mut places = place.to_vec();
        let mut has = Has::default();
        let mut colour_scale = 1.0;
        if let Some(colours) = columns(element, COLOURS) {
            has.colours = Colours::Bits8;
            let scalar = element.properties[colours[0]].scalar;
            colour_scale = 255.0 / scalar.largest();
            if scalar == Scalar::I32 || scalar == Scalar::U32 {
                colour_scale = 1.0;
            }
            places.extend(colours);
        }
        if let Some(normals) = columns(element, NORMALS) {
            has.normals = true;
            places.extend(normals);
        }
        for (names, flag) in [
            (INTENSITY, &mut has.intensities),
            (CLASS, &mut has.classes),
            (RADIUS, &mut has.radii),
        ] {
            let found = column(element, names);
            *flag = found.is_some();
            places.extend(found);
        }
        Ok(Self {
            places,
            has,
            colour_scale,
        })
    }

    fn point(&self, row: &[f64]) -> Point {
        let mut numbers = row.iter().copied();
        let mut next = || numbers.next().unwrap_or(0.0);
        let mut point = Point {
            place: DVec3::new(next(), next(), next()),
            ..Point::default()
        };
        if self.has.colours != Colours::None {
            // Beyond 255 the number stays at the end.
            point.colour = [next(), next(), next()].map(|part| code16(part * self.colour_scale));
        }
        if self.has.normals {
            point.normal = [next(), next(), next()].map(single);
        }
        if self.has.intensities {
            point.intensity = single(next());
        }
        if self.has.classes {
            point.class = code8(next());
        }
        if self.has.radii {
            point.radius = single(next());
        }
        point
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_files::{Dir, survive_damage};
    use super::*;

    fn text(properties: &str, rows: &str) -> String {
        let count = rows.lines().count();
        format!("ply\nformat ascii 1.0\nelement vertex {count}\n{properties}end_header\n{rows}")
    }

    fn read(text: &str) -> Result<PointCloudFile, String> {
        let dir = Dir::new();
        load(
            &dir.write("a", text.as_bytes()),
            &CloudLoadOptions::default(),
        )
    }

    #[test]
    fn attributes_are_found_by_name() {
        let places = "property float x\nproperty float y\nproperty double z\n";
        let more = "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float nx\n\
             property float ny\nproperty float nz\nproperty float scalar_Intensity\n\
             property float scalar_Classification\nproperty float radius\n";
        let rows = "1 2 3 9 8 7 0 0 1 500 2 0.5\n4 5 6 255 0 1 0 1 0 60000 6 0.25\n";
        let file = read(&text(&format!("{places}{more}"), rows)).expect("good");
        assert_eq!(file.positions, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        assert_eq!(file.colours, Some(vec![[9, 8, 7], [255, 0, 1]]));
        assert_eq!(file.normals, Some(vec![[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]));
        assert_eq!(file.intensities, Some(vec![500, 60_000]));
        assert_eq!(file.classes, Some(vec![2, 6]));
        assert_eq!(file.radii_in_world, Some(vec![0.5, 0.25]));
        assert!(file.notes.is_empty(), "{:?}", file.notes);
        let bare = read(&text(places, "1 2 3\nnan 0 0\n")).expect("good");
        assert_eq!(bare.positions.len(), 1);
        assert!(bare.notes[0].contains("1 points without"));
        let floats = places.to_owned() + "property float r\nproperty float g\nproperty float b\n";
        let file = read(&text(&floats, "1 2 3 0 0.5 1\n")).expect("good");
        assert_eq!(file.colours, Some(vec![[0, 128, 255]]));
    }

    #[test]
    fn damaged_files_are_refused() {
        let why = read(&text("property float x\n", "1\n")).expect_err("no y");
        assert!(why.contains("x, y and z"), "{why}");
        let good = text(
            "property float x\nproperty float y\nproperty float z\n",
            "1 2 3\n4 5 6\n",
        );
        let forged = good.replace("vertex 2", "vertex 99999999999999");
        assert!(
            read(&forged)
                .expect_err("forged")
                .contains("99999999999999 rows")
        );
        survive_damage(good.as_bytes(), load);
    }
}
