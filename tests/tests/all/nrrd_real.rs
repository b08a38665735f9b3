//! Real volumes: every NRRD file of the test data loads as an independent reader says, or is refused with a reason.
//!
//! The expected sums were made once with Python (pynrrd 1.1, numpy 2): `data, head = nrrd.read(path)`, the sum of
//! `data.astype(float64)`, and the lengths of the rows of `head['space directions']`. They are exact for integers. Also
//! here: counts of voxels in headerless files that are published, and the automatic transfer function on real histograms.

use std::path::Path;

use resample_tests::data::{data_dir, data_file, skipped};
use volsplat::{
    ColourMap, Error, Histogram, LoadOptions, RawOptions, TransferFunction, Volume, VoxelType, load,
};

/// What the independent reader gives for one file.
struct Expected {
    file: &'static str,
    dims: [usize; 3],
    spacing: [f64; 3],
    sum: f64,
}

const fn expected(file: &'static str, dims: [usize; 3], spacing: [f64; 3], sum: f64) -> Expected {
    Expected {
        file,
        dims,
        spacing,
        sum,
    }
}

const LOADED: [Expected; 12] = [
    expected("FLAIR.nrrd", [124, 160, 140], [1.0; 3], 115_231_646.0),
    expected(
        "Skull.nrrd",
        [160, 232, 160],
        [1.0, 0.898437, 0.898437],
        532_633.0,
    ),
    expected(
        "avf_float_32.nrrd",
        [74, 93, 20],
        [0.7226560115814209, 0.7226560115814209, 1.0],
        25_368_783.287_802_22,
    ),
    expected("bswap.nrrd", [2, 2, 1], [1.0; 3], 512.0),
    expected("eltype_gray_u12.nrrd", [3, 5, 1], [1.0; 3], 16_871.0),
    expected("eltype_gray_u12_hex.nrrd", [3, 5, 1], [1.0; 3], 16_871.0),
    expected(
        "fiji-stack-microns-16bit.nrrd",
        [50, 40, 30],
        [0.4, 0.4, 2.0],
        1_926_758_400.0,
    ),
    expected(
        "prostate_phantom_subvolume.nrrd",
        [82, 67, 13],
        [0.5, 0.5, 3.0],
        27_811_967.0,
    ),
    expected("small.nrrd", [10, 10, 10], [1.0; 3], 93_629.911_327_362_06),
    expected(
        "smallgz.nrrd",
        [10, 10, 10],
        [1.0; 3],
        93_629.911_327_362_06,
    ),
    expected("tooth.nhdr", [103, 94, 161], [1.0; 3], 821_287_590.0),
    expected(
        "units.nhdr",
        [10, 10, 10],
        [0.1, 0.2, 1.0],
        93_629.911_327_362_06,
    ),
];

/// Well-formed files that are no scalar volume, and a part of the reason.
const REFUSED: [(&str, &str); 2] = [
    ("eltype_rgb_u8.nrrd", "3 components"),
    ("small_time.nrrd", "5 components"),
];

/// File name, dims, type, and from which scalar on the object is surely seen; below the next number is background.
const RAW: [(&str, [usize; 3], VoxelType, f64, f64); 6] = [
    (
        "engine_256x256x128_uint8.raw",
        [256, 256, 128],
        VoxelType::U8,
        110.0,
        20.0,
    ),
    (
        "aneurism_256x256x256_uint8.raw",
        [256, 256, 256],
        VoxelType::U8,
        80.0,
        5.0,
    ),
    (
        "lobster_301x324x56_uint8.raw",
        [301, 324, 56],
        VoxelType::U8,
        80.0,
        30.0,
    ),
    (
        "walnut_128x96x114_uint16.raw",
        [128, 96, 114],
        VoxelType::U16,
        6000.0,
        2000.0,
    ),
    (
        "headsq_quarter_64x64x93_int16.raw",
        [64, 64, 93],
        VoxelType::I16,
        900.0,
        200.0,
    ),
    (
        "hydrogen_atom_128x128x128_uint8.raw",
        [128, 128, 128],
        VoxelType::U8,
        20.0,
        5.0,
    ),
];

#[test]
fn every_real_nrrd_loads_as_the_independent_reader_says_or_is_refused() {
    let Some(folder) = data_dir()
        .map(|folder| folder.join("volumes/nrrd"))
        .filter(|folder| folder.is_dir())
    else {
        return skipped("every_real_nrrd: volumes/nrrd is absent");
    };
    let mut known: Vec<&str> = LOADED.iter().map(|expected| expected.file).collect();
    known.extend(REFUSED.iter().map(|(file, _)| *file));
    for entry in std::fs::read_dir(&folder).expect("the data folder") {
        let name = entry
            .expect("an entry")
            .file_name()
            .into_string()
            .expect("a plain name");
        let is_header = name.ends_with(".nrrd") || name.ends_with(".nhdr");
        assert!(
            !is_header || known.contains(&name.as_str()),
            "{name} has no expectation here"
        );
    }
    for expected in &LOADED {
        let volume = load(&folder.join(expected.file), &LoadOptions::default());
        check(expected, &volume.unwrap_or_else(|error| panic!("{error}")));
    }
    for (file, reason) in REFUSED {
        let error =
            load(&folder.join(file), &LoadOptions::default()).expect_err("not a scalar volume");
        assert!(matches!(error, Error::Unsupported { .. }), "{error}");
        assert!(error.to_string().contains(reason), "{error}");
    }
}

fn check(expected: &Expected, volume: &Volume) {
    let file = expected.file;
    assert_eq!(volume.dims, expected.dims, "{file}");
    for (got, wanted) in volume.spacing().into_iter().zip(expected.spacing) {
        assert!(
            (got - wanted).abs() < 1e-12,
            "{file}: spacing {got}, expected {wanted}"
        );
    }
    let sum: f64 = (0..volume.len()).map(|index| volume.value(index)).sum();
    // Numpy adds in pairs, we add in order: the difference is rounding, below count * epsilon.
    let tolerance = expected.sum.abs() * volume.len() as f64 * f64::EPSILON;
    assert!(
        (sum - expected.sum).abs() <= tolerance,
        "{file}: sum {sum}, expected {}",
        expected.sum
    );
}

#[test]
fn oriented_files_keep_their_world() {
    let Some(path) = data_file("oriented_files", "volumes/nrrd/FLAIR.nrrd") else {
        return;
    };
    let volume = load(&path, &LoadOptions::default()).expect("a good file");
    let map = volume.world_from_index;
    assert_eq!(
        map.translation.to_array(),
        [64.8982391357422, 110.4311447143555, -27.92553901672364]
    );
    assert_eq!(
        map.matrix3.y_axis.to_array(),
        [
            -0.01600502019006122,
            -0.9509366513904123,
            -0.30897139733494045
        ],
        "the second direction is the second column"
    );
    assert_eq!(
        volume.up_hint.map(|up| up.to_array()),
        Some([0.0, 0.0, 1.0])
    );
    assert_eq!(volume.space.as_deref(), Some("left-posterior-superior"));
}

#[test]
fn engine_and_aneurism_have_the_published_numbers_of_voxels() {
    // Yuan, Nguyen, Xu, Chen 2003, Figure 9.
    for ((file, dims, kind, ..), threshold, published) in
        [(RAW[0], 71.0, 1_160_038), (RAW[1], 25.0, 114_695)]
    {
        let Some(path) = data_file("published numbers", &format!("volumes/raw/{file}")) else {
            continue;
        };
        let volume = raw(&path, dims, kind);
        let count = (0..volume.len())
            .filter(|&index| volume.value(index) >= threshold)
            .count();
        assert_eq!(count, published, "{file}: voxels of at least {threshold}");
    }
}

#[test]
fn the_automatic_function_removes_background_and_keeps_objects() {
    for (file, dims, kind, object, background) in RAW {
        let Some(path) = data_file("automatic function", &format!("volumes/raw/{file}")) else {
            continue;
        };
        let volume = raw(&path, dims, kind);
        let histogram = Histogram::of_volume(&volume);
        let function = TransferFunction::automatic(&histogram, ColourMap::default());
        let visible = (0..volume.len())
            .filter(|&index| function.opacity(volume.value(index)) > 0.0)
            .count();
        let share = visible as f64 / volume.len() as f64;
        println!(
            "{file}: visible from {:?}, share {share:.4}",
            function.visible_range()
        );
        assert_eq!(
            function.opacity(background),
            0.0,
            "{file}: background of {background} is seen"
        );
        assert!(
            function.opacity(object) > 0.1,
            "{file}: an object of {object} is faint: {}",
            function.opacity(object)
        );
        // The objects fill from 0.4 % (vessels) to 40 % (a head) of their boxes.
        assert!(
            (0.004..0.42).contains(&share),
            "{file}: a share of {share} is seen"
        );
    }
}

fn raw(path: &Path, dims: [usize; 3], kind: VoxelType) -> Volume {
    let options = LoadOptions {
        raw: Some(RawOptions::new(dims, kind)),
        ..LoadOptions::default()
    };
    load(path, &options).unwrap_or_else(|error| panic!("{error}"))
}
