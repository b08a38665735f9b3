//! What independent readers say about the real files.

/// What an independent reader says about a file.
pub(crate) struct Expected {
    /// Below the folder `volumes`.
    pub(crate) file: &'static str,
    pub(crate) dims: [usize; 3],
    /// World position of the first voxel.
    pub(crate) origin: [f64; 3],
    /// World steps along x, y and z.
    pub(crate) axes: [[f64; 3]; 3],
    /// Sum of all voxels.
    pub(crate) sum: f64,
}

/// Axes along the world's, with these steps.
const fn upright(x: f64, y: f64, z: f64) -> [[f64; 3]; 3] {
    [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]
}

/// Read by SimpleITK: GetOrigin, GetDirection times GetSpacing, and the sum of GetArrayFromImage.
///
/// The sum of frogtissue.mhd is of its whole unpacked stream (Python's zlib): ITK stops after as many packed bytes as
/// the header wrongly gives and leaves the rest 0.
pub(crate) const META_IMAGES: [Expected; 5] = [
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
pub(crate) const NIFTIS: [Expected; 9] = [
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
    Expected {
        file: "nifti/FLOAT32.nii.gz",
        sum: 11398461.247137904,
        ..AVERAGE_HEAD
    },
    Expected {
        file: "nifti/FLOAT64.nii.gz",
        sum: 11398461.144353032,
        ..AVERAGE_HEAD
    },
    Expected {
        file: "nifti/INT16.nii.gz",
        sum: 11398481.212837487,
        ..AVERAGE_HEAD
    },
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
pub(crate) const VTIS: [Expected; 4] = [
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
pub(crate) const TIFFS: [Expected; 2] = [
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
pub(crate) const TIFF_FOLDER: Expected = Expected {
    file: "tiff/cthead_8bit_stack",
    dims: [256, 256, 99],
    origin: [0.0; 3],
    axes: upright(1.0, 1.0, 1.0),
    sum: 204273107.0,
};

/// Read by pydicom: pixel_array times RescaleSlope plus RescaleIntercept, ImagePositionPatient, PixelSpacing,
/// SliceThickness. JPEG 2000 in its lossy form (J2KI) is decoded by OpenJPEG there.
pub(crate) const DICOMS: [Expected; 20] = [
    Expected {
        file: "dicom/wg04_ct_single/CT1_UNC",
        ..CT1
    },
    Expected {
        file: "dicom/wg04_ct_single/CT1_RLE",
        ..CT1
    },
    Expected {
        file: "dicom/wg04_ct_single/CT1_JPLL",
        ..CT1
    },
    Expected {
        file: "dicom/wg04_ct_single/CT1_JLSL",
        ..CT1
    },
    Expected {
        file: "dicom/wg04_ct_single/CT1_JLSN",
        sum: -228357605.0,
        ..CT1
    },
    Expected {
        file: "dicom/wg04_ct_single/CT1_J2KR",
        ..CT1
    },
    Expected {
        file: "dicom/wg04_ct_single/CT1_J2KI",
        sum: -228379233.0,
        ..CT1
    },
    Expected {
        file: "dicom/wg04_ct_single/CT2_UNC",
        ..CT2
    },
    Expected {
        file: "dicom/wg04_ct_single/CT2_RLE",
        ..CT2
    },
    Expected {
        file: "dicom/wg04_ct_single/CT2_JPLL",
        ..CT2
    },
    Expected {
        file: "dicom/wg04_ct_single/CT2_JLSL",
        ..CT2
    },
    Expected {
        file: "dicom/wg04_ct_single/CT2_JLSN",
        sum: -197692377.0,
        ..CT2
    },
    Expected {
        file: "dicom/wg04_ct_single/CT2_J2KR",
        ..CT2
    },
    Expected {
        file: "dicom/wg04_ct_single/CT2_J2KI",
        sum: -197771504.0,
        ..CT2
    },
    Expected {
        file: "dicom/pydicom_data_multiframe/emri_small.dcm",
        ..FRAMES
    },
    Expected {
        file: "dicom/pydicom_data_multiframe/emri_small_RLE.dcm",
        ..FRAMES
    },
    Expected {
        file: "dicom/pydicom_data_multiframe/emri_small_big_endian.dcm",
        ..FRAMES
    },
    Expected {
        file: "dicom/pydicom_data_multiframe/emri_small_jpeg_ls_lossless.dcm",
        ..FRAMES
    },
    Expected {
        file: "dicom/pydicom_data_multiframe/emri_small_jpeg_2k_lossless.dcm",
        ..FRAMES
    },
    // The mark behind the last frame is cut off; the frames themselves are whole.
    Expected {
        file: "dicom/pydicom_data_multiframe/emri_small_jpeg_2k_lossless_too_short.dcm",
        ..FRAMES
    },
];

const CT1: Expected = Expected {
    file: "",
    dims: [512, 512, 1],
    origin: [-158.135803, -179.035797, -75.699997],
    axes: upright(0.661468, 0.661468, 5.0),
    sum: -228407043.0,
};

const CT2: Expected = Expected {
    file: "",
    dims: [512, 512, 1],
    origin: [-120.0, -120.0, -545.0],
    axes: upright(0.468, 0.468, 10.0),
    sum: -197733355.0,
};

/// Ten frames without any word on their place but SpacingBetweenSlices.
const FRAMES: Expected = Expected {
    file: "",
    dims: [64, 64, 10],
    origin: [0.0; 3],
    axes: upright(1.0, 1.0, 1.2),
    sum: 4493276.0,
};

/// Files that are refused, and the words that say why.
pub(crate) const REFUSED: [(&str, &str); 4] = [
    // Its header claims four channels and half the slices; the data has one channel and 62 slices.
    ("mhd/Teddybear.mhd", "a voxel has 4 components"),
    ("vti/vase_4comp.vti", "a voxel has 4 components"),
    ("dicom/wg04_ct_single/CT1_UNC.zst", "no known header"),
    ("dicom/wg04_ct_single/CT2_UNC.zst", "no known header"),
];
