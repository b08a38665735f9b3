//! Holds the volume readers to real files of every format: sizes, places in the world and sums of the voxels.
//!
//! The expected numbers come from independent readers: SimpleITK (MetaImage), nibabel (NIfTI), VTK (ImageData), tifffile (TIFF). Sums are over the voxels as f64.
//! Every file of a folder is either loaded or refused for the reason given here; a file that this test does not know
//! fails it. NRRD has a test of its own, `nrrd_real.rs`.

use std::path::{Path, PathBuf};

use resample_tests::data::{data_dir, skipped};
use volsplat::{LoadOptions, Volume, load};

/// What an independent reader says about a file.
struct Expected {
    /// Below the folder `volumes`.
    file: &'static str,
    dims: [usize; 3],
    /// World position of the first voxel.
    origin: [f64; 3],
    /// World steps along x, y and z.
    axes: [[f64; 3]; 3],
    /// Sum of all voxels.
    sum: f64,
}

/// Axes along the world's, with these steps.
const fn upright(x: f64, y: f64, z: f64) -> [[f64; 3]; 3] {
    [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]
}

/// Read by SimpleITK: GetOrigin, GetDirection times GetSpacing, and the sum of GetArrayFromImage.
///
/// The sum of frogtissue.mhd is of its whole unpacked stream (Python's zlib): ITK stops after as many packed bytes as
/// the header wrongly gives and leaves the rest 0.
const META_IMAGES: [Expected; 5] = [
    Expected {
        file: "mhd/Brain.mhd",
        dims: [100, 100, 38],
        origin: [0.0; 3],
        axes: upright(1.0, 1.0, 1.0),
        sum: 5770222.142043107,
    },
    Expected {
        file: "mhd/bonsai_small.mhd",
        dims: [256, 256, 91],
        origin: [0.0; 3],
        axes: upright(1.172, 1.172, 2.0),
        sum: 86293940.0,
    },
    Expected {
        file: "mha/frogtissue.mhd",
        dims: [500, 470, 136],
        origin: [0.0; 3],
        axes: upright(1.0, 1.0, 1.5),
        sum: 12279472.0,
    },
    Expected {
        file: "mha/mha.mha",
        dims: [64, 64, 37],
        origin: [-108.28100000000002, 82.37950000000001, -47.83559999999999],
        axes: upright(3.437500000000001, -3.437500000000001, 3.7999999999999994),
        sum: 79944614.0,
    },
    Expected {
        file: "mha/sox9.mhd",
        dims: [75, 150, 75],
        origin: [0.0; 3],
        axes: upright(15.5467, 15.1, 14.9333),
        sum: 54535416.0,
    },
];

/// Read by nibabel: affine, and the sum of dataobj as single precision (double for FLOAT64), which is how the values are
/// held here.
const NIFTIS: [Expected; 9] = [
    Expected {
        file: "nifti/CT_AVM.nii.gz",
        dims: [256, 242, 154],
        origin: [-73.39768981933594, -69.69419860839844, -64.11000061035156],
        axes: upright(0.719942569732666, 0.7209135890007019, 1.0),
        sum: 49383836.594276905,
    },
    Expected {
        file: "nifti/CT_pitch.nii.gz",
        dims: [175, 248, 58],
        origin: [-69.02075958251953, -134.38560485839844, -13.56882095336914],
        axes: [
            [0.8125, 0.0, 0.0],
            [0.0, 0.779041051864624, -0.23076248168945312],
            [0.0, 0.6807987689971924, 2.2983384132385254],
        ],
        sum: 95678796.0,
    },
    Expected { file: "nifti/FLOAT32.nii.gz", sum: 11398461.247137904, ..AVERAGE_HEAD },
    Expected { file: "nifti/FLOAT64.nii.gz", sum: 11398461.144353032, ..AVERAGE_HEAD },
    Expected { file: "nifti/INT16.nii.gz", sum: 11398481.212837487, ..AVERAGE_HEAD },
    Expected {
        file: "nifti/avf_float_32.nii.gz",
        dims: [74, 93, 20],
        origin: [-26.376943588256836, -33.2421760559082, -9.5],
        axes: upright(0.7226560115814209, 0.7226560115814209, 1.0),
        sum: 25368783.28780222,
    },
    Expected {
        file: "nifti/bonsai.nii.gz",
        dims: [256, 256, 256],
        origin: [-127.0, -127.0, -128.0],
        axes: upright(1.0, 1.0, 1.0),
        sum: 225901147.0,
    },
    Expected {
        file: "nifti/fuel.nii.gz",
        dims: [64, 33, 32],
        origin: [-31.0, -16.0, -16.0],
        axes: upright(1.0, 1.0, 1.0),
        sum: 509815.0,
    },
    Expected {
        file: "nifti/ras.hdr",
        dims: [62, 41, 34],
        origin: [-73.37730407714844, -65.35720825195312, -31.532268524169922],
        axes: upright(2.3852322101593018, 2.389753818511963, 2.3664863109588623),
        sum: 15024169.0,
    },
];

/// One image in three types.
const AVERAGE_HEAD: Expected = Expected {
    file: "",
    dims: [64, 79, 67],
    origin: [-75.76253509521484, -110.76253509521484, -71.76253509521484],
    axes: upright(2.3852322101593018, 2.389753818511963, 2.3664863109588623),
    sum: 0.0,
};

/// Read by vtkXMLImageDataReader of VTK: GetOrigin, GetSpacing, and the sum of the array.
const VTIS: [Expected; 4] = [
    Expected {
        file: "vti/head.vti",
        dims: [256, 256, 94],
        origin: [0.0; 3],
        axes: upright(1.0, 1.0, 2.0),
        sum: 15546877.0,
    },
    Expected {
        file: "vti/hydrogen.vti",
        dims: [64, 64, 64],
        origin: [0.0; 3],
        axes: upright(1.0, 1.0, 1.0),
        sum: 4856.008970333326,
    },
    Expected {
        file: "vti/jet_vort-small.vti",
        dims: [240, 360, 60],
        origin: [0.0; 3],
        axes: upright(2.0, 2.0, 2.0),
        sum: 105772789533.0,
    },
    Expected {
        file: "vti/vase.vti",
        dims: [115, 101, 75],
        origin: [0.0; 3],
        axes: upright(1.0, 1.0, 1.0),
        sum: 10723131.0,
    },
];

/// Read by tifffile: the sum of asarray, and the tags. In embryo.tif ImageJ notes unit=inch, spacing=4.088, and the
/// resolution is 244140 pixels per 1000000 inches; the others say nothing of the kind.
const TIFFS: [Expected; 2] = [
    Expected {
        file: "tiff/embryo.tif",
        dims: [125, 80, 107],
        origin: [0.0; 3],
        axes: upright(1e6 / 244140.0, 1e6 / 244140.0, 4.088),
        sum: 7328080.0,
    },
    Expected {
        file: "tiff/mri-stack.tif",
        dims: [186, 226, 27],
        origin: [0.0; 3],
        axes: upright(1.0, 1.0, 1.0),
        sum: 40784917.0,
    },
];

/// A folder of 99 files, read like [`TIFFS`].
const TIFF_FOLDER: Expected = Expected {
    file: "tiff/cthead_8bit_stack",
    dims: [256, 256, 99],
    origin: [0.0; 3],
    axes: upright(1.0, 1.0, 1.0),
    sum: 204273107.0,
};

/// Files that are refused, and the words that say why.
const REFUSED: [(&str, &str); 2] = [
    // Its header claims four channels and half the slices; the data has one channel and 62 slices.
    ("mhd/Teddybear.mhd", "a voxel has 4 components"),
    ("vti/vase_4comp.vti", "a voxel has 4 components"),
];

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
        check(&Expected { file: "vti/vase_4comp.vti", ..VTIS[3] }, &volume);
    }
}

#[test]
fn every_real_tiff_is_as_tifffile_says() {
    check_folder("tiff", &TIFFS);
    let Some(folder) = volumes("tiff") else { return };
    for name in ["cthead_8bit_stack", "cthead_8bit_stack/*.tif"] {
        let volume =
            load(&folder.join(name), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        check(&TIFF_FOLDER, &volume);
    }
}

#[test]
fn a_channel_of_the_header_that_lies_is_refused_for_its_length() {
    let Some(folder) = volumes("mhd") else { return };
    let options = LoadOptions { component: Some(0), ..LoadOptions::default() };
    let error = load(&folder.join("Teddybear.mhd"), &options).expect_err("four channels are not there");
    assert!(error.to_string().contains("needs 4063232 bytes, the file has 1015808"), "{error}");
}

/// Loads what `expected` has in this folder and checks that every other file is refused as in [`REFUSED`].
fn check_folder(name: &str, expected: &[Expected]) {
    let Some(folder) = volumes(name) else { return };
    let mut loaded = 0;
    for path in files(&folder) {
        let file = format!("{name}/{}", path.file_name().unwrap_or_default().to_string_lossy());
        if let Some(expected) = expected.iter().find(|expected| expected.file == file) {
            let volume = load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
            check(expected, &volume);
            loaded += 1;
        } else if let Some((_, reason)) = REFUSED.iter().find(|(refused, _)| *refused == file) {
            let error =
                load(&path, &LoadOptions::default()).expect_err("this file must be refused").to_string();
            assert!(error.contains(reason) && error.contains(&file), "{error}");
        } else {
            let is_data = [".raw", ".zraw", ".readme", ".img"].iter().any(|end| file.ends_with(end));
            assert!(is_data, "{file} has no expectation here");
        }
    }
    let prefix = format!("{name}/");
    let known = expected.iter().filter(|expected| expected.file.starts_with(&prefix)).count();
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
        assert!((*got - wanted).length() < 1e-6 * wanted.length(), "{file}: axis {got}, expected {wanted}");
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
    assert!((sum - expected.sum).abs() <= tolerance, "{file}: sum {sum}, expected {}", expected.sum);
}

fn volumes(name: &str) -> Option<PathBuf> {
    let folder = data_dir().map(|folder| folder.join("volumes").join(name)).filter(|folder| folder.is_dir());
    if folder.is_none() {
        skipped(&format!("formats_real: volumes/{name} is absent"));
    }
    folder
}

/// The files of a folder in the order of their names.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("the data folder");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    paths.retain(|path| path.is_file());
    paths.sort();
    paths
}
