//! Kinds of made data; real ones are judged in the tests package.

use glam::DAffine3;
use resample_volume::volume::{Modality, Volume, Voxels};

use crate::Shading;
use crate::look::transfer::{DataKind, DefaultLook, Histogram};

const SIDE: usize = 40;

/// A cube of values by place, 0 to 1 along each axis.
fn cube(value: impl Fn([f64; 3]) -> f64) -> Vec<f64> {
    let place = |i: usize| i as f64 / (SIDE - 1) as f64;
    (0..SIDE.pow(3))
        .map(|i| value([i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE].map(place)))
        .collect()
}

fn volume(voxels: Voxels) -> Volume {
    Volume::new([SIDE; 3], voxels, DAffine3::IDENTITY).expect("valid")
}

fn kind(volume: &Volume) -> DataKind {
    DataKind::of_volume(volume, &Histogram::of_volume(volume))
}

fn radius([x, y, z]: [f64; 3]) -> f64 {
    let square = |v: f64| (v - 0.5) * (v - 0.5);
    (square(x) + square(y) + square(z)).sqrt()
}

/// A body in Hounsfield units: air, a skin of fat, muscle, a bone.
fn body(place: [f64; 3]) -> f64 {
    match radius(place) {
        r if r < 0.1 => 900.0 - 4000.0 * r,
        r if r < 0.35 => 50.0,
        r if r < 0.4 => -100.0,
        _ => -1000.0,
    }
}

#[test]
fn hounsfield_units_are_told_by_range_air_and_tissue() {
    let ct = volume(Voxels::I16(cube(body).iter().map(|&v| v as i16).collect()));
    assert_eq!(kind(&ct), DataKind::Hounsfield);
    let look = DefaultLook::of(DataKind::Hounsfield, &Histogram::of_volume(&ct));
    assert_eq!(look.shading, Shading::Phong);
    assert_eq!(look.function.opacity(-1000.0), 0.0, "air is clear");
    let as_singles = volume(Voxels::F32(cube(body).iter().map(|&v| v as f32).collect()));
    assert_eq!(kind(&as_singles), DataKind::Hounsfield, "NIfTI has singles");
    // The same range filled evenly is a temperature or the like.
    let even = cube(|[x, y, z]| -1000.0 + 3000.0 * (x + 40.0 * y + 1600.0 * z) / 1641.0);
    assert_eq!(kind(&volume(Voxels::F64(even))), DataKind::Field);
    let shifted: Vec<u16> = cube(body).iter().map(|&v| (v + 1000.0) as u16).collect();
    assert_eq!(
        kind(&volume(Voxels::U16(shifted))),
        DataKind::Field,
        "no unit known"
    );
}

#[test]
fn a_file_that_names_its_scanner_is_believed() {
    let mut mr = volume(Voxels::I16(cube(body).iter().map(|&v| v as i16).collect()));
    mr.modality = Some(Modality::Mr);
    assert_eq!(kind(&mr), DataKind::Scan);
    // Bone fills most of it.
    let dense = cube(|p| if radius(p) < 0.45 { 700.0 } else { -1000.0 });
    let mut ct = volume(Voxels::I16(dense.iter().map(|&v| v as i16).collect()));
    ct.modality = Some(Modality::Ct);
    assert_eq!(kind(&ct), DataKind::Hounsfield);
}

#[test]
fn a_patient_without_negative_values_is_a_scan() {
    let bright = cube(|p| 1000.0 * (0.9 - radius(p)).max(0.0) + p[0]);
    let mut scan = volume(Voxels::F64(bright));
    assert_eq!(kind(&scan), DataKind::Field);
    scan.space = Some("right-anterior-superior".to_owned());
    assert_eq!(kind(&scan), DataKind::Scan);
}

#[test]
fn labels_are_few_whole_values_in_large_equal_regions() {
    let regions = |[x, y, z]: [f64; 3]| {
        let inside = radius([x, y, z]) < 0.45;
        let part = (x * 3.0) as usize + 3 * (y * 3.0) as usize;
        if inside {
            [
                4.0, 17.0, 3.0, 9.0, 250.0, 2.0, 41.0, 8.0, 77.0, 1.0, 5.0, 6.0, 7.0, 10.0, 11.0,
                12.0,
            ][part]
        } else {
            0.0
        }
    };
    let labels = cube(regions);
    assert_eq!(
        kind(&volume(Voxels::F64(labels.clone()))),
        DataKind::Labels,
        "as NIfTI scales them"
    );
    let mut bytes = volume(Voxels::U8(labels.iter().map(|&v| v as u8).collect()));
    bytes.space = Some("left-posterior-superior".to_owned());
    assert_eq!(kind(&bytes), DataKind::Labels, "in a patient's space too");
    let half = labels.iter().map(|v| v * 0.5).collect();
    assert_eq!(
        kind(&volume(Voxels::F64(half))),
        DataKind::Field,
        "not whole"
    );
}

#[test]
fn masks_and_smooth_fields_of_few_values_are_no_labels() {
    let mask = cube(|p| f64::from(radius(p) < 0.4));
    let mask = volume(Voxels::U8(mask.iter().map(|&v| v as u8).collect()));
    assert_eq!(
        kind(&mask),
        DataKind::Field,
        "a mask is smooth when it is interpolated"
    );
    let steps = cube(|p| (20.0 * (0.8 - radius(p))).max(0.0).floor());
    let steps = volume(Voxels::U8(steps.iter().map(|&v| v as u8).collect()));
    assert_eq!(
        kind(&steps),
        DataKind::Field,
        "a field of few levels goes level by level"
    );
    let one = volume(Voxels::U8(vec![7; SIDE.pow(3)]));
    assert_eq!(kind(&one), DataKind::Field);
    let look = DefaultLook::of(DataKind::Field, &Histogram::of_volume(&one));
    assert_eq!(look.shading, Shading::None, "one value has no surface");
}
