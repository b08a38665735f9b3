//! Volumes of 2x3x4 voxels.

use super::arrays;
use super::binary::{deflate, floats, gzip, shorts, zlib};
use super::{Seed, pictures};

pub(super) const WORDS: [&str; 50] = [
    "define Lattice ",
    "(HxByteRLE,",
    "CDF\x01",
    "missing_value",
    "# vtk DataFile Version 3.0",
    "STRUCTURED_POINTS",
    "DIMENSIONS ",
    "POINT_DATA ",
    "CELL_DATA ",
    "SCALARS ",
    "LOOKUP_TABLE ",
    "FIELD ",
    "unsigned_short",
    "NRRD0005",
    "type: ",
    "dimension: ",
    "sizes: ",
    "encoding: ",
    "endian: ",
    "spacings: ",
    "space directions: ",
    "space origin: ",
    "kinds: ",
    "data file: LIST",
    "byte skip: ",
    "line skip: ",
    "gzip",
    "bzip2",
    "hex",
    "ascii",
    "NDims = ",
    "DimSize = ",
    "ElementType = MET_",
    "ElementDataFile = LOCAL",
    "CompressedData = True",
    "ElementNumberOfChannels = ",
    "TransformMatrix = ",
    "<VTKFile",
    "type=\"ImageData\"",
    "header_type=\"UInt64\"",
    "WholeExtent=\"",
    "format=\"appended\"",
    "compressor=\"vtkZLibDataCompressor\"",
    "<DataArray",
    "NumberOfComponents=\"",
    "\\x93NUMPY\\x01\\x00",
    "fortran_order",
    "DICM",
    "1.2.840.10008.1.2.4.90",
    "n+1\\x00",
];

const VALUES: usize = 24;

pub(super) fn bytes() -> Vec<u8> {
    (0..VALUES as u8).collect()
}

fn real_numbers() -> Vec<u8> {
    floats(&std::array::from_fn::<f32, VALUES, _>(|i| i as f32 - 3.5))
}

fn headed(head: &str, data: &[u8]) -> Vec<u8> {
    [head.as_bytes(), data].concat()
}

pub(super) fn files() -> Vec<Seed> {
    let mut files = nrrd();
    files.extend(meta_image());
    files.extend(vti());
    files.extend(vtk());
    files.extend(dicom());
    files.extend(arrays::files());
    files.extend([
        ("nifti.nii", nifti()),
        ("nifti.nii.gz", gzip(&nifti())),
        ("nifti.times", nifti_series()),
        ("nifti.rgb", nifti_colours()),
        ("mgh", mgh()),
        ("mgz", gzip(&mgh())),
        (
            "npy",
            pictures::npy("<i2", "(4, 3, 2)", &shorts(&[7; VALUES])),
        ),
        ("npy.f8", pictures::npy(">f8", "(2, 2, 2)", &[64; 64])),
        (
            "npy.fortran",
            pictures::ordered_npy("<i2", "True", "(4, 3, 2)", &shorts(&[7; VALUES])),
        ),
        ("tiff", pictures::tiff_pages()),
    ]);
    files
}

fn nrrd() -> Vec<Seed> {
    let head = "NRRD0005\ntype: uint8\ndimension: 3\nsizes: 2 3 4\nencoding: ";
    let space = "NRRD0004\ntype: float\ndimension: 3\nspace: left-posterior-superior\nsizes: 2 3 4\n\
                 space directions: (1,0,0) (0,1,0) (0,0,2)\nspace origin: (5,6,7)\nendian: little\nencoding: raw\n\n";
    let list = "NRRD0005\ntype: uint8\ndimension: 4\nsizes: 3 2 2 2\nkinds: vector space space space\nencoding: ";
    let text: String = (0..VALUES).map(|i| format!("{i} ")).collect();
    let hex: String = bytes().iter().map(|byte| format!("{byte:02x}")).collect();
    vec![
        ("nrrd.raw", headed(&format!("{head}raw\n\n"), &bytes())),
        (
            "nrrd.gz",
            headed(&format!("{head}gzip\nbyte skip: 0\n\n"), &gzip(&bytes())),
        ),
        (
            "nrrd.ascii",
            headed(
                &format!("{head}ascii\nspacings: 1 2 3\n\n"),
                text.as_bytes(),
            ),
        ),
        (
            "nrrd.hex",
            headed(&format!("{head}hex\n\n"), hex.as_bytes()),
        ),
        ("nrrd.space", headed(space, &real_numbers())),
        ("nrrd.vector", headed(&format!("{list}raw\n\n"), &bytes())),
        (
            "nhdr.cut",
            headed(
                &format!("{head}raw\ndata file: volume\nbyte skip: -1\n"),
                &bytes(),
            ),
        ),
    ]
}

fn meta_image() -> Vec<Seed> {
    let head = "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nElementSpacing = 1 1 2\n\
                TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 0 0\nDimSize = 2 3 4\n";
    let small =
        |rest: &str, data: &[u8]| headed(&format!("{head}{rest}ElementDataFile = LOCAL\n"), data);
    let packed = zlib(&bytes());
    let size = format!(
        "CompressedData = True\nCompressedDataSize = {}\nElementType = MET_UCHAR\n",
        packed.len()
    );
    vec![
        ("mha", small("ElementType = MET_UCHAR\n", &bytes())),
        ("mha.z", small(&size, &packed)),
        (
            "mha.float",
            small("ElementType = MET_FLOAT\n", &real_numbers()),
        ),
        (
            "mha.two",
            small(
                "ElementNumberOfChannels = 2\nElementType = MET_UCHAR\n",
                &[bytes(), bytes()].concat(),
            ),
        ),
    ]
}

fn vti() -> Vec<Seed> {
    let wrapped = |attributes: &str, array: &str, appended: &str| {
        format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" {attributes}>\n\
             <ImageData WholeExtent=\"0 1 0 2 0 3\" Origin=\"0 0 0\" Spacing=\"1 1 1\">\n<Piece Extent=\"0 1 0 2 0 3\">\n\
             <PointData Scalars=\"s\">\n{array}\n</PointData>\n</Piece>\n</ImageData>\n{appended}</VTKFile>\n"
        )
    };
    let text: String = (0..VALUES).map(|i| format!("{i} ")).collect();
    let ascii = format!("<DataArray type=\"UInt8\" Name=\"s\" format=\"ascii\">{text}</DataArray>");
    let base64 = "<DataArray type=\"UInt8\" Name=\"s\" format=\"binary\">GAAAAAAAAAAAAQIDBAUGBwgJCgsMDQ4PEBESExQVFhc=</DataArray>";
    let array = "<DataArray type=\"UInt8\" Name=\"s\" format=\"appended\" offset=\"0\"/>";
    let long = "header_type=\"UInt64\"";
    let raw = |attributes: &str, data: &[u8]| {
        let file = wrapped(
            attributes,
            array,
            "<AppendedData encoding=\"raw\">\n_@</AppendedData>\n",
        );
        let at = file.find("_@").expect("the place of the data") + 1;
        [&file.as_bytes()[..at], data, &file.as_bytes()[at + 1..]].concat()
    };
    let plain = [(VALUES as u64).to_le_bytes().as_slice(), &bytes()].concat();
    let packed = zlib(&bytes());
    let head: Vec<u8> = [1, VALUES as u64, 0, packed.len() as u64]
        .iter()
        .flat_map(|n| n.to_le_bytes())
        .collect();
    let zipped = "header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\"";
    vec![
        ("vti.ascii", wrapped("", &ascii, "").into_bytes()),
        ("vti.base64", wrapped(long, base64, "").into_bytes()),
        ("vti.raw", raw(long, &plain)),
        ("vti.zlib", raw(zipped, &[head, packed].concat())),
    ]
}

fn vtk() -> Vec<Seed> {
    let head = |coding: &str| {
        format!(
            "# vtk DataFile Version 3.0\nt\n{coding}\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 3 4\nORIGIN 0 0 0\nSPACING 1 1 2\n"
        )
    };
    let text: String = (0..VALUES).map(|i| format!("{i} ")).collect();
    let ascii = format!(
        "{}POINT_DATA 24\nSCALARS s short 1\nLOOKUP_TABLE default\n{text}\nVECTORS v float\n{text}{text}{text}\n\
         FIELD f 1\nb 1 24 int\n{text}\n",
        head("ASCII")
    );
    let cells = format!(
        "{}CELL_DATA 6\nSCALARS s float\nLOOKUP_TABLE default\n",
        head("BINARY")
    );
    let bytes_each = format!(
        "{}POINT_DATA 24\nSCALARS s unsigned_char 1\nLOOKUP_TABLE default\n",
        head("BINARY")
    );
    vec![
        ("vtk.ascii", ascii.into_bytes()),
        ("vtk.cells", headed(&cells, &real_numbers()[..24])),
        ("vtk.bytes", headed(&bytes_each, &bytes())),
    ]
}

/// Two points in time.
fn nifti_series() -> Vec<u8> {
    let mut file = nifti();
    file[40..50].copy_from_slice(&shorts(&[4, 2, 3, 4, 2]));
    [file, shorts(&[5; VALUES])].concat()
}

/// Red, green and blue bytes.
fn nifti_colours() -> Vec<u8> {
    let mut file = nifti();
    file.truncate(352);
    file[70..74].copy_from_slice(&shorts(&[128, 24]));
    [file, bytes(), bytes(), bytes()].concat()
}

fn mgh() -> Vec<u8> {
    let words = [1i32, 2, 3, 4, 1, 4, 0].map(i32::to_be_bytes).concat();
    let place = [
        1.0f32, 1.0, 2.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 5.0, 6.0, 7.0,
    ];
    let mut file = [words, vec![0, 1], place.map(f32::to_be_bytes).concat()].concat();
    file.resize(284, 0);
    [file, vec![1; 2 * VALUES]].concat()
}

fn nifti() -> Vec<u8> {
    let mut head = vec![0u8; 352];
    let mut put = |at: usize, bytes: &[u8]| head[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, &348i32.to_le_bytes());
    put(40, &shorts(&[3, 2, 3, 4, 1, 1, 1, 1]));
    // Numbers of 16 bits.
    put(70, &shorts(&[4, 16]));
    put(76, &floats(&[1.0, 1.0, 1.5, 2.0]));
    put(108, &floats(&[352.0, 2.0, -1.0]));
    put(252, &shorts(&[1, 1]));
    put(
        280,
        &floats(&[1.0, 0.0, 0.0, 5.0, 0.0, 1.0, 0.0, 6.0, 0.0, 0.0, 2.0, 7.0]),
    );
    put(344, b"n+1\0");
    [head, shorts(&[9; VALUES])].concat()
}

/// An element with its value in the explicit notation.
fn element(tag: [u16; 2], kind: &[u8; 2], value: &[u8]) -> Vec<u8> {
    let mut bytes = shorts(&tag);
    bytes.extend(kind);
    let padded = value.len() + value.len() % 2;
    if matches!(kind, b"OW" | b"OB" | b"SQ" | b"UN") {
        bytes.extend([0; 2]);
        bytes.extend((padded as u32).to_le_bytes());
    } else {
        bytes.extend((padded as u16).to_le_bytes());
    }
    bytes.extend(value);
    bytes.resize(bytes.len() + padded - value.len(), b' ');
    bytes
}

fn dicom_file(syntax: &str, elements: &[Vec<u8>]) -> Vec<u8> {
    let head = element([2, 0x10], b"UI", format!("{syntax}\0").as_bytes());
    let length = element([2, 0], b"UL", &(head.len() as u32).to_le_bytes());
    let body = elements.concat();
    let body = if syntax.ends_with(".99") {
        deflate(&body)
    } else {
        body
    };
    [vec![0; 128], b"DICM".to_vec(), length, head, body].concat()
}

fn dicom() -> Vec<Seed> {
    let number = |value: u16| value.to_le_bytes();
    let slice = |frames: &[u8]| {
        vec![
            element([8, 0x60], b"CS", b"CT"),
            element([0x18, 0x50], b"DS", b"1"),
            element([0x20, 0x0E], b"UI", b"1.2.3"),
            element([0x20, 0x32], b"DS", b"0\\0\\0"),
            element([0x20, 0x37], b"DS", b"1\\0\\0\\0\\1\\0"),
            element([0x28, 2], b"US", &number(1)),
            element([0x28, 8], b"IS", frames),
            element([0x28, 0x10], b"US", &number(3)),
            element([0x28, 0x11], b"US", &number(4)),
            element([0x28, 0x30], b"DS", b"1\\1"),
            element([0x28, 0x100], b"US", &number(16)),
            element([0x28, 0x101], b"US", &number(12)),
            element([0x28, 0x103], b"US", &number(0)),
            element([0x28, 0x1052], b"DS", b"-1024"),
            element([0x28, 0x1053], b"DS", b"1"),
        ]
    };
    let plain = element([0x7FE0, 0x10], b"OW", &shorts(&[500; VALUES]));
    let packed = |fragment: &[u8]| {
        let mut bytes = shorts(&[0x7FE0, 0x10]);
        bytes.extend(b"OB\0\0\xFF\xFF\xFF\xFF");
        for item in [&[][..], fragment] {
            bytes.extend(shorts(&[0xFFFE, 0xE000]));
            bytes.extend((item.len() as u32).to_le_bytes());
            bytes.extend(item);
        }
        bytes.extend(shorts(&[0xFFFE, 0xE0DD, 0, 0]));
        bytes
    };
    // Two planes of bytes, each a run of twelve.
    let mut runs = vec![0u8; 64];
    runs[..12].copy_from_slice(&[2, 0, 0, 0, 64, 0, 0, 0, 66, 0, 0, 0]);
    runs.extend([0xF5, 1, 0xF5, 44]);
    let with = |frames: &[u8], pixels: Vec<u8>| [slice(frames), vec![pixels]].concat();
    vec![
        (
            "dicom",
            dicom_file("1.2.840.10008.1.2.1", &with(b"2", plain.clone())),
        ),
        ("dicom.uneven", uneven_dicom(slice(b"4"))),
        (
            "dicom.deflate",
            dicom_file("1.2.840.10008.1.2.1.99", &with(b"2", plain)),
        ),
        (
            "dicom.rle",
            dicom_file("1.2.840.10008.1.2.5", &with(b"1", packed(&runs))),
        ),
        (
            "dicom.jpeg",
            dicom_file(
                "1.2.840.10008.1.2.4.50",
                &with(b"1", packed(&pictures::jpeg())),
            ),
        ),
        (
            "dicom.jpeg2000.cut",
            dicom_file("1.2.840.10008.1.2.4.90", &with(b"1", packed(&JPEG_2000))),
        ),
        (
            "dicom.jpegls.cut",
            dicom_file("1.2.840.10008.1.2.4.80", &with(b"1", packed(&JPEG_LS))),
        ),
    ]
}

/// Four frames, one of them missing between the second and the third.
fn uneven_dicom(mut elements: Vec<Vec<u8>>) -> Vec<u8> {
    let item = |bytes: &[u8]| {
        let head = shorts(&[0xFFFE, 0xE000]);
        [
            head,
            (bytes.len() as u32).to_le_bytes().to_vec(),
            bytes.to_vec(),
        ]
        .concat()
    };
    let frames = [b"0\\0\\0", b"0\\0\\1", b"0\\0\\3", b"0\\0\\4"].map(|position| {
        let place = item(&element([0x20, 0x32], b"DS", position));
        item(&element([0x20, 0x9113], b"SQ", &place))
    });
    elements.push(element([0x5200, 0x9230], b"SQ", &frames.concat()));
    elements.push(element([0x7FE0, 0x10], b"OW", &shorts(&[500; 48])));
    dicom_file("1.2.840.10008.1.2.1", &elements)
}

/// The head of a JPEG 2000 code stream of 4x3 pixels of 16 bits, and no data.
const JPEG_2000: [u8; 92] = [
    0xFF, 0x4F, 0xFF, 0x51, 0, 41, 0, 0, 0, 0, 0, 4, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    4, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 15, 1, 1, 0xFF, 0x52, 0, 12, 0, 0, 0, 1, 0, 1, 4,
    4, 0, 1, 0xFF, 0x5C, 0, 7, 0x40, 0x80, 0x88, 0x88, 0x90, 0xFF, 0x90, 0, 10, 0, 0, 0, 0, 0, 19,
    0, 1, 0xFF, 0x93, 0xC7, 0xD4, 4, 1, 2, 3, 0x80, 0x80, 0xFF, 0xD9,
];

/// A JPEG-LS picture of 4x3 pixels of 12 bits.
const JPEG_LS: [u8; 33] = [
    0xFF, 0xD8, 0xFF, 0xF7, 0, 11, 12, 0, 3, 0, 4, 1, 1, 0x11, 0, 0xFF, 0xDA, 0, 8, 1, 1, 0, 0, 0,
    0, 0x6C, 0, 0x20, 0x8E, 1, 0xC0, 0xFF, 0xD9,
];
