//! Holds the volume readers to real files of every format: sizes, places in the world and sums of the voxels.
//!
//! The expected numbers (`expected.rs`) come from independent readers: SimpleITK for MetaImage, nibabel for NIfTI, VTK
//! for its ImageData, tifffile for TIFF, pydicom for DICOM. Sums are over the voxels as f64. Every file of a folder is
//! either loaded or refused for the reason given there; a file that this test does not know fails it. NRRD has a test of
//! its own, `nrrd_real.rs`.

use std::path::{Path, PathBuf};

use resample_io::Gate;
use resample_tests::data::{data_dir, skipped};
use volsplat::{LoadOptions, Volume, load};

mod expected;

use expected::{DICOMS, Expected, META_IMAGES, NIFTIS, REFUSED, TIFF_FOLDER, TIFFS, VTIS};

#[test]
fn every_real_meta_image_is_as_itk_says() {
    check_folder("mhd", &META_IMAGES);
    check_folder("mha", &META_IMAGES);
}

#[test]
fn every_real_nifti_is_as_nibabel_says() {
    check_folder("nifti", &NIFTIS);
}

#[test]
fn every_real_vti_is_as_vtk_says() {
    check_folder("vti", &VTIS);
}

#[test]
fn components_and_arrays_of_a_real_vti_are_chosen() {
    let Some(folder) = volumes("vti") else { return };
    for component in 0..4 {
        let options = LoadOptions {
            array: Some("Scalars_".to_owned()),
            component: Some(component),
            ..LoadOptions::default()
        };
        let volume = load(&folder.join("vase_4comp.vti"), &options).expect("chosen");
        check(
            &Expected {
                file: "vti/vase_4comp.vti",
                ..VTIS[3]
            },
            &volume,
        );
    }
}

#[test]
fn real_ome_zarr_images_are_as_zarr_python_says() {
    let Some(folder) = volumes("zarr") else {
        return;
    };
    let image = "example_data_zarr3/6001240_labels_v0.5.zarr";
    let labels = format!("{image}/labels/0");
    // Name, level and channel; size; sum, and sums weighted with x and with z.
    type Case<'a> = (&'a str, [usize; 2], [usize; 3], [f64; 3]);
    let cases: [Case; 6] = [
        (
            "lobster_omezarr_v0.4.zarr",
            [0, 0],
            [301, 324, 56],
            [71_284_695.0, 10_186_621_738.0, 1_812_404_300.0],
        ),
        (
            "lobster_omezarr_v0.4.zarr",
            [1, 0],
            [150, 162, 28],
            [8_909_953.0, 634_387_486.0, 111_027_324.0],
        ),
        (
            "lobster_omezarr_v0.4.zarr",
            [2, 0],
            [75, 81, 14],
            [1_113_700.0, 39_369_403.0, 6_657_392.0],
        ),
        (
            image,
            [0, 1],
            [67, 68, 236],
            [97_075_283.0, 3_825_816_103.0, 11_200_796_355.0],
        ),
        (
            image,
            [0, 0],
            [67, 68, 236],
            [71_687_754.0, f64::NAN, f64::NAN],
        ),
        (
            &labels,
            [2, 0],
            [67, 68, 236],
            [2_519_289.0, 108_834_713.0, 378_718_417.0],
        ),
    ];
    for (name, [level, channel], dims, sums) in cases {
        let options = LoadOptions {
            level: Some(level),
            component: Some(channel),
            ..LoadOptions::default()
        };
        let volume = load(&folder.join(name), &options).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(volume.dims, dims, "{name}");
        let mut found = [0.0; 3];
        for i in 0..volume.len() {
            let value = volume.value(i);
            let weights = [1.0, (i % dims[0]) as f64, (i / (dims[0] * dims[1])) as f64];
            found
                .iter_mut()
                .zip(weights)
                .for_each(|(sum, weight)| *sum += weight * value);
        }
        for (found, expected) in found
            .into_iter()
            .zip(sums)
            .filter(|(_, expected)| !expected.is_nan())
        {
            assert_eq!(found, expected, "{name}, level {level}, channel {channel}");
        }
    }
    let lobster = load(
        &folder.join("lobster_omezarr_v0.4.zarr"),
        &LoadOptions::default(),
    )
    .expect("level 0");
    assert_eq!(lobster.spacing(), [1.0, 1.0, 1.4], "spacing");
    let refused = load(&folder.join(image), &LoadOptions::default())
        .expect_err("two channels")
        .to_string();
    assert!(
        refused.contains("2 channels (0 LaminB1, 1 Dapi)"),
        "{refused}"
    );
}

#[test]
fn every_real_tiff_is_as_tifffile_says() {
    check_folder("tiff", &TIFFS);
    let Some(folder) = volumes("tiff") else {
        return;
    };
    for name in ["cthead_8bit_stack", "cthead_8bit_stack/*.tif"] {
        let volume = load(&folder.join(name), &LoadOptions::default())
            .unwrap_or_else(|error| panic!("{error}"));
        check(&TIFF_FOLDER, &volume);
    }
}

#[test]
fn every_real_dicom_is_as_pydicom_says() {
    check_folder("dicom/wg04_ct_single", &DICOMS);
    check_folder("dicom/pydicom_data_multiframe", &DICOMS);
}

#[test]
fn a_real_tilted_series_is_sheared_and_made_even_where_it_is_not() {
    let Some(folder) = volumes("dicom/qa_ct_ge_tilt") else {
        return;
    };
    // Rows go down and back, tilted by 18.5 degrees; the table moves along z.
    let axes = |step| {
        [
            [0.4882812, 0.0, 0.0],
            [0.0, 0.46304863422444004, -0.15493391968164],
            [0.0, 0.0, step],
        ]
    };
    let part = |file, z, step, sum| Expected {
        file,
        dims: [512, 512, 9],
        origin: [-125.0, -123.5404569, z],
        axes: axes(step),
        sum,
    };
    for part in [
        part("0?.dcm", 5.8360586, 4.22, -1472849408.0),
        part("2?.dcm", 98.7360586, 7.38, -1823775849.0),
    ] {
        let volume = load(&folder.join(part.file), &LoadOptions::default())
            .unwrap_or_else(|error| panic!("{error}"));
        check(&part, &volume);
    }
    let gate = Gate::default();
    let options = LoadOptions {
        gate: gate.clone(),
        ..LoadOptions::default()
    };
    let Ok(whole) = load(&folder, &options) else {
        panic!("two distances are resampled");
    };
    // 13 steps of 4.22 mm, one of 1.14, 13 of 7.38: 151.94 mm in 36 steps.
    assert_eq!(whole.dims, [512, 512, 37]);
    let step = whole.world_from_index.matrix3.z_axis;
    assert!((step.z - 151.94 / 36.0).abs() < 1e-3, "{step}");
    let said = gate.remarks().join(" ");
    assert!(
        said.contains("slices 0 to 13 are 4.22 mm apart, 13 to 14 are 1.14 mm apart"),
        "{said}"
    );
    assert!(
        said.contains("14 to 27 are 7.38 mm apart") && said.contains("resampled to 37 slices"),
        "{said}"
    );
    // The first and the last slice are those of the files.
    for (number, file) in [(0, "01.dcm"), (36, "28.dcm")] {
        let Ok(slice) = load(&folder.join(file), &LoadOptions::default()) else {
            panic!("{file} is a slice");
        };
        let is_same = (0..slice.len())
            .all(|index| slice.value(index) == whole.value(number * slice.len() + index));
        assert!(is_same, "slice {number} is {file}");
    }
}

#[test]
fn a_real_folder_of_several_series_lists_them() {
    let Some(folder) = volumes("dicom/wg04_ct_single") else {
        return;
    };
    let gate = Gate::default();
    let options = LoadOptions {
        gate: gate.clone(),
        ..LoadOptions::default()
    };
    // Each of them holds one slice in several packings, so that the largest is no volume.
    let Err(error) = load(&folder, &options) else {
        panic!("eight slices at one place");
    };
    assert!(
        error.to_string().contains("lie at the same place"),
        "{error}"
    );
    let said = gate.remarks().join(" ");
    assert!(
        said.contains("the largest was taken") && said.contains("series=UID"),
        "{said}"
    );
}

#[test]
fn damaged_packed_pictures_are_refused_or_read_without_a_crash() {
    let Some(folder) = volumes("dicom/wg04_ct_single") else {
        return;
    };
    let target = tempfile::tempdir().expect("temporary folder");
    for name in ["CT2_J2KI", "CT2_JPLL"] {
        let good = std::fs::read(folder.join(name)).expect("a data file");
        let mut refused = 0;
        for copy in 0..60usize {
            let mut bytes = good.clone();
            // Hits spread over the packed picture, which is most of the file, and over its header.
            let place = good.len() - good.len() * (copy + 1) / 61;
            bytes[place] = bytes[place].wrapping_add(1 + (copy * 37 % 200) as u8);
            if copy % 3 == 0 {
                bytes.truncate(place);
            }
            let path = target.path().join(format!("{name}.{copy}"));
            std::fs::write(&path, bytes).expect("write");
            refused += usize::from(load(&path, &LoadOptions::default()).is_err());
        }
        assert!(
            refused >= 20,
            "{name}: files that are cut off must be refused, {refused} of 60 were"
        );
    }
}

#[test]
fn a_channel_of_the_header_that_lies_is_refused_for_its_length() {
    let Some(folder) = volumes("mhd") else { return };
    let options = LoadOptions {
        component: Some(0),
        ..LoadOptions::default()
    };
    let error =
        load(&folder.join("Teddybear.mhd"), &options).expect_err("four channels are not there");
    assert!(
        error
            .to_string()
            .contains("needs 4063232 bytes, the file has 1015808"),
        "{error}"
    );
}

/// Loads what `expected` has in this folder and checks that every other file is refused as in [`REFUSED`].
fn check_folder(name: &str, expected: &[Expected]) {
    let Some(folder) = volumes(name) else { return };
    let mut loaded = 0;
    for path in files(&folder) {
        let file = format!(
            "{name}/{}",
            path.file_name().unwrap_or_default().to_string_lossy()
        );
        if let Some(expected) = expected.iter().find(|expected| expected.file == file) {
            let volume =
                load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
            check(expected, &volume);
            loaded += 1;
        } else if let Some((_, reason)) = REFUSED.iter().find(|(refused, _)| *refused == file) {
            let Err(error) = load(&path, &LoadOptions::default()) else {
                panic!("{file} must be refused")
            };
            let error = error.to_string();
            assert!(error.contains(reason) && error.contains(&file), "{error}");
        } else {
            let is_data = [".raw", ".zraw", ".readme", ".img"]
                .iter()
                .any(|end| file.ends_with(end));
            assert!(is_data, "{file} has no expectation here");
        }
    }
    let prefix = format!("{name}/");
    let known = expected
        .iter()
        .filter(|expected| expected.file.starts_with(&prefix))
        .count();
    assert_eq!(loaded, known, "{name}: a file that is expected is absent");
}

fn check(expected: &Expected, volume: &Volume) {
    let file = expected.file;
    assert_eq!(volume.dims, expected.dims, "{file}");
    let map = volume.world_from_index;
    let axes = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis];
    for (got, wanted) in axes.iter().zip(expected.axes) {
        let wanted = glam::DVec3::from_array(wanted);
        // Headers hold singles, or decimals of as many digits.
        assert!(
            (*got - wanted).length() < 1e-6 * wanted.length(),
            "{file}: axis {got}, expected {wanted}"
        );
    }
    let origin = glam::DVec3::from_array(expected.origin);
    assert!(
        (map.translation - origin).length() < 1e-6 * origin.length().max(1.0),
        "{file}: {}",
        map.translation
    );
    let sum: f64 = (0..volume.len()).map(|index| volume.value(index)).sum();
    // Numpy adds in pairs, we add in order: the difference is rounding, below count * epsilon.
    let tolerance = expected.sum.abs() * volume.len() as f64 * f64::EPSILON;
    assert!(
        (sum - expected.sum).abs() <= tolerance,
        "{file}: sum {sum}, expected {}",
        expected.sum
    );
}

fn volumes(name: &str) -> Option<PathBuf> {
    let folder = data_dir()
        .map(|folder| folder.join("volumes").join(name))
        .filter(|folder| folder.is_dir());
    if folder.is_none() {
        skipped(&format!("formats_real: volumes/{name} is absent"));
    }
    folder
}

/// The files of a folder in the order of their names.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("the data folder");
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.retain(|path| path.is_file());
    paths.sort();
    paths
}
