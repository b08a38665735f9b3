//! Files of every format, written here byte by byte, must come back as the numbers that went in.

use std::fs::File;
use std::path::{Path, PathBuf};

use resample_core::Error;
use resample_core::image::linear_from_srgb;
use tempfile::TempDir;

use super::*;

fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn written(folder: &TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("a file in a temporary folder");
    path
}

fn part(path: &Path) -> Part {
    Part {
        path: path.to_owned(),
        name: None,
    }
}

fn refused<T: std::fmt::Debug>(result: Result<T, Error>, path: &Path, named: &str) {
    let said = result.expect_err("must be refused").to_string();
    assert!(
        said.starts_with(&path.display().to_string()),
        "the file is not named: {said}"
    );
    assert!(
        said.contains(named),
        "expected a word on '{named}', got: {said}"
    );
    assert!(!said.contains('\n'), "one line: {said}");
}

fn pfm(scale: &str, numbers: &[f32]) -> Vec<u8> {
    let mut file = format!("Pf\n3 2\n{scale}\n").into_bytes();
    let big_endian = !scale.starts_with('-');
    file.extend(numbers.iter().flat_map(|n| {
        if big_endian {
            n.to_be_bytes()
        } else {
            n.to_le_bytes()
        }
    }));
    file
}

#[test]
fn pfm_rows_run_from_the_bottom_in_either_byte_order() {
    let folder = folder();
    let from_bottom = [4.0, 5.0, 6.5, 1.0, f32::INFINITY, 3.0];
    for scale in ["-1.0", "1", "-0.003922"] {
        let path = written(&folder, "a.pfm", &pfm(scale, &from_bottom));
        let plane = depth::read(&part(&path)).expect("a good file");
        assert_eq!(
            (plane.width, plane.height, plane.stored),
            (3, 2, Stored::Float),
            "size"
        );
        assert_eq!(
            plane.values,
            [1.0, f32::INFINITY, 3.0, 4.0, 5.0, 6.5],
            "scale {scale}"
        );
    }
}

#[test]
fn damaged_pfm_files_are_refused() {
    let folder = folder();
    let good = pfm("-1", &[0.0; 6]);
    let cut = written(&folder, "cut.pfm", &good[..good.len() - 1]);
    refused(depth::read(&part(&cut)), &cut, "there are 23");
    let claim = written(&folder, "claim.pfm", b"Pf\n99999 99999\n-1\n0000");
    refused(depth::read(&part(&claim)), &claim, "99999");
    let colour = written(&folder, "colour.pfm", b"PF\n1 1\n-1\n000000000000");
    refused(depth::read(&part(&colour)), &colour, "colours");
    let empty = written(&folder, "empty.pfm", b"Pf\n0 4\n-1\n");
    refused(depth::read(&part(&empty)), &empty, "nothing");
    refused(
        depth::read(&part(&folder.path().join("absent"))),
        &folder.path().join("absent"),
        "cannot read",
    );
    refused(
        depth::read(&part(folder.path())),
        folder.path(),
        "cannot read",
    );
}

fn npy(descr: &str, fortran: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header =
        format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}\n");
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend((header.len() as u16).to_le_bytes());
    file.extend(header.bytes());
    file.extend(data);
    file
}

#[test]
fn arrays_come_back_in_every_type_and_order() {
    let folder = folder();
    let bytes = |numbers: &[f32]| {
        numbers
            .iter()
            .flat_map(|n| n.to_le_bytes())
            .collect::<Vec<_>>()
    };
    let rows = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    let good = |name: &str, file: Vec<u8>| {
        let path = written(&folder, name, &file);
        let plane = depth::read(&part(&path)).expect(name);
        assert_eq!((plane.width, plane.height), (3, 2), "{name}: size");
        assert_eq!(plane.values, rows, "{name}: numbers");
        plane.stored
    };
    good("c", npy("<f4", "False", "(2, 3)", &bytes(&rows)));
    good(
        "fortran",
        npy(
            "<f4",
            "True",
            "(2, 3)",
            &bytes(&[1.0, 4.0, 2.0, 5.0, 3.0, 6.0]),
        ),
    );
    good(
        "leading axis",
        npy("<f4", "False", "(1, 2, 3)", &bytes(&rows)),
    );
    let half = rows
        .iter()
        .flat_map(|&n| ::exr::prelude::f16::from_f32(n).to_bits().to_le_bytes())
        .collect::<Vec<_>>();
    good("half", npy("<f2", "False", "(2, 3)", &half));
    let double = rows
        .iter()
        .flat_map(|&n| f64::from(n).to_be_bytes())
        .collect::<Vec<_>>();
    good("double, big-endian", npy(">f8", "False", "(2, 3)", &double));
    let codes = rows
        .iter()
        .flat_map(|&n| (n as u16).to_le_bytes())
        .collect::<Vec<_>>();
    assert_eq!(
        good("codes", npy("<u2", "False", "(2, 3)", &codes)),
        Stored::Code(65_535),
        "whole numbers"
    );
    let path = written(
        &folder,
        "claim",
        &npy("<f4", "False", "(900000, 900000)", &[0; 8]),
    );
    refused(depth::read(&part(&path)), &path, "900000");
    let path = written(
        &folder,
        "colours",
        &npy("<f4", "False", "(2, 3, 3)", &[0; 72]),
    );
    refused(depth::read(&part(&path)), &path, "one number per pixel");
    let path = written(&folder, "complex", &npy("<c8", "False", "(2, 3)", &[0; 48]));
    refused(depth::read(&part(&path)), &path, "c8");
}

#[test]
fn png_is_decoded_to_linear_light_and_grey_codes_stay_as_they_are() {
    let folder = folder();
    let path = folder.path().join("a.png");
    image::RgbaImage::from_raw(2, 1, vec![0, 128, 255, 255, 10, 20, 30, 51])
        .expect("size")
        .save(&path)
        .expect("png");
    let picture = colour::read(&part(&path)).expect("a picture");
    let code = |code: u8| linear_from_srgb(f32::from(code) / 255.0);
    assert_eq!(
        picture.rgb,
        [
            [code(0), code(128), code(255)],
            [code(10), code(20), code(30)]
        ],
        "linear light"
    );
    assert_eq!(picture.coverage, Some(vec![1.0, 0.2]), "alpha");
    let path = folder.path().join("deep.png");
    let grey = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(2, 1, vec![513u16, 65_535])
        .expect("size");
    grey.save(&path).expect("png");
    let plane = depth::read(&part(&path)).expect("a depth");
    assert_eq!(
        (plane.values, plane.stored),
        (vec![513.0, 65_535.0], Stored::Code(65_535)),
        "16 bits"
    );
    refused(
        depth::read(&Part {
            path: path.clone(),
            name: Some("Z".into()),
        }),
        &path,
        "channels",
    );
}

#[test]
fn float_tiff_is_linear_and_holds_depth() {
    let folder = folder();
    let path = folder.path().join("z.tif");
    let file = File::create(&path).expect("a file");
    let mut encoder = ::tiff::encoder::TiffEncoder::new(file).expect("a TIFF");
    let numbers = [0.25f32, 1e-3, 7.0, f32::NAN, 2.0, 3.0];
    encoder
        .write_image::<::tiff::encoder::colortype::Gray32Float>(3, 2, &numbers)
        .expect("written");
    let plane = depth::read(&part(&path)).expect("a depth");
    assert_eq!(
        (plane.width, plane.height, plane.stored),
        (3, 2, Stored::Float),
        "size"
    );
    assert_eq!(plane.values[..3], numbers[..3], "numbers");
    assert!(plane.values[3].is_nan(), "NaN stays NaN");
}

#[test]
fn a_png_that_claims_more_than_it_can_hold_is_refused_at_once() {
    let folder = folder();
    let path = folder.path().join("a.png");
    image::RgbImage::new(4, 4).save(&path).expect("png");
    let mut bytes = std::fs::read(&path).expect("readable");
    // Width and height stand at bytes 16 to 23, the checksum of the header at 29 to 32.
    bytes[16..24].copy_from_slice(&[0, 0, 0x3f, 0xff, 0, 0, 0x3f, 0xff]);
    let checksum = flat_crc(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&checksum.to_be_bytes());
    let path = written(&folder, "claim.png", &bytes);
    refused(colour::read(&part(&path)), &path, "can hold");
    let text = written(&folder, "text.png", b"not a picture at all");
    refused(colour::read(&part(&text)), &text, "format");
}

/// The checksum of a PNG chunk, bit by bit.
fn flat_crc(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| {
        if crc & 1 == 1 {
            0xedb8_8320 ^ (crc >> 1)
        } else {
            crc >> 1
        }
    };
    !bytes
        .iter()
        .fold(!0u32, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), step))
}

#[test]
fn a_hash_names_a_part_unless_a_file_has_that_name() {
    let folder = folder();
    let with_hash = written(&folder, "a#Z", b"");
    let text = with_hash.to_string_lossy();
    assert_eq!(
        Part::from_text(&text),
        Part {
            path: with_hash.clone(),
            name: None
        },
        "the file wins"
    );
    let expected = Part {
        path: "ref.exr".into(),
        name: Some("left.Z".into()),
    };
    assert_eq!(Part::from_text("ref.exr#left.Z"), expected, "a channel");
    for whole in ["ref.exr", "C:\\depth.pfm", "ref.exr#", "#Z"] {
        assert_eq!(
            Part::from_text(whole),
            Part {
                path: whole.into(),
                name: None
            },
            "no part"
        );
    }
}

/// EXIF data: an orientation, and a focal length before 36 mm by 24 mm.
fn exif(orientation: u16, focal_mm: u16) -> Vec<u8> {
    let short = |tag: u16, value: u16| {
        let mut entry = [tag, 3, 1, 0, value, 0].map(u16::to_le_bytes).concat();
        entry.truncate(12);
        entry
    };
    let pointer = [0x8769u16, 4, 1, 0, 38, 0].map(u16::to_le_bytes).concat();
    let end = vec![0; 4];
    let head = b"II*\0\x08\0\0\0\x02\0".to_vec();
    let inner = [
        1u16.to_le_bytes().to_vec(),
        short(0xa405, focal_mm),
        end.clone(),
    ]
    .concat();
    [head, short(0x0112, orientation), pointer, end, inner].concat()
}

#[test]
fn photographs_are_turned_upright_and_tell_their_lens() {
    use image::codecs::jpeg::JpegEncoder;
    use image::{ExtendedColorType, ImageEncoder};
    let folder = folder();
    // 32x16 pixels, the left half white.
    let pixels: Vec<u8> = (0..32 * 16)
        .map(|i| if i % 32 < 16 { 255 } else { 0 })
        .collect();
    let photo = |orientation, focal_mm| {
        let mut bytes = Vec::new();
        let mut encoder = JpegEncoder::new_with_quality(&mut bytes, 100);
        encoder
            .set_exif_metadata(exif(orientation, focal_mm))
            .expect("a JPEG has EXIF data");
        encoder
            .write_image(&pixels, 32, 16, ExtendedColorType::L8)
            .expect("a picture");
        part(&written(&folder, "photo.jpg", &bytes))
    };
    // Where the white half lies once the picture is upright: at the left, the right, the top, the bottom.
    let (wide, tall) = ([32, 16], [16, 32]);
    for (orientation, size, white, black) in [
        (1, wide, [2, 8], [29, 8]),
        (2, wide, [29, 8], [2, 8]),
        (3, wide, [29, 8], [2, 8]),
        (6, tall, [8, 2], [8, 29]),
        (8, tall, [8, 29], [8, 2]),
    ] {
        let photo = photo(orientation, 26);
        assert_eq!(colour::size(&photo).expect("a size"), size, "{orientation}");
        assert_eq!(colour::storage(&photo).expect("a storage").size, size);
        let picture = colour::read(&photo).expect("a photograph");
        let at = |[x, y]: [usize; 2]| picture.rgb[x + size[0] as usize * y][0];
        assert!(at(white) > 0.9 && at(black) < 0.1, "{orientation}");
        // 26 mm: a diagonal of 79.5 degrees.
        let side = if size == wide { 1.0 } else { 2.0 };
        let expected = 2.0
            * (43.266 / 2.0 / 26.0 * side / 5f64.sqrt())
                .atan()
                .to_degrees();
        let found = colour::fov_y_deg(&photo)
            .expect("readable")
            .expect("a lens");
        assert!((found - expected).abs() < 0.01, "{found} {expected}");
    }
    let unknown = colour::fov_y_deg(&photo(1, 0)).expect("readable");
    assert_eq!(unknown, None, "0 is no length");
}
