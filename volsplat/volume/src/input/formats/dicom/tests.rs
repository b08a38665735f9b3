//! DICOM: small files in every plain encoding, series, enhanced pictures, written here and read back.

use crate::Error;
use crate::input::test_files::{Folder, survive_damage};
use crate::input::{Format, LoadOptions, format_of, load};
use crate::volume::Voxels;

mod files;
mod series;

use files::{BIG_ENDIAN, DEFLATED, EXPLICIT, Elements, IMPLICIT, JPEG_LS, RLE, SLICE, Slice};

#[test]
fn every_encoding_gives_the_same_volume() {
    for syntax in [EXPLICIT, IMPLICIT, DEFLATED, BIG_ENDIAN, RLE, JPEG_LS] {
        let slice = Slice { syntax, ..SLICE };
        let file = match syntax {
            RLE => slice.rle_file(),
            JPEG_LS => slice.jpeg_ls_file(),
            _ => slice.file(),
        };
        let folder = Folder::new();
        let path = folder.write("x", &[&file]);
        assert_eq!(format_of(&path).expect("readable"), Some(Format::Dicom));
        let volume = load(&path, &LoadOptions::default())
            .unwrap_or_else(|error| panic!("{syntax}: {error}"));
        assert_eq!(
            (volume.dims, &volume.voxels),
            ([2, 2, 1], &Voxels::U16(vec![1, 2, 3, 4000])),
            "{syntax}"
        );
        assert_eq!(
            volume.spacing(),
            [2.0, 3.0, 5.0],
            "columns, rows, and the thickness of the only slice"
        );
        assert_eq!(
            volume.world_from_index.translation.to_array(),
            [10.0, 20.0, 30.0]
        );
        assert_eq!(volume.up_hint, Some(glam::DVec3::Z), "the head is up");
    }
}

#[test]
fn a_file_that_is_a_tiff_file_as_well_is_read_as_dicom() {
    let mut file = SLICE.file();
    file[..4].copy_from_slice(b"II*\0");
    assert_eq!(Folder::new().load(&[&file]).expect("valid").dims, [2, 2, 1]);
}

#[test]
fn signs_unused_bits_and_the_scale_are_applied() {
    let signed = Slice {
        is_signed: true,
        values: [0, 0xffff, 0x8000, 5],
        ..SLICE
    };
    assert_eq!(signed.load().voxels, Voxels::I16(vec![0, -1, -32768, 5]));
    // The four upper bits hold an overlay.
    let twelve = Slice {
        bits_stored: 12,
        values: [0xf001, 0x1fff, 0x0800, 5],
        ..SLICE
    };
    assert_eq!(twelve.load().voxels, Voxels::U16(vec![1, 0xfff, 0x800, 5]));
    let both = Slice {
        is_signed: true,
        ..twelve
    };
    assert_eq!(both.load().voxels, Voxels::I16(vec![1, -1, -2048, 5]));
    let hounsfield = Slice {
        intercept: "-1024",
        ..SLICE
    };
    assert_eq!(
        hounsfield.load().voxels,
        Voxels::I16(vec![-1023, -1022, -1021, 2976])
    );
    let fraction = Slice {
        slope: "0.5",
        ..SLICE
    };
    assert_eq!(
        fraction.load().voxels,
        Voxels::F32(vec![0.5, 1.0, 1.5, 2000.0])
    );
    assert!(
        Slice {
            slope: "0",
            ..SLICE
        }
        .refusal()
        .contains("RescaleSlope is 0")
    );
}

#[test]
fn frames_of_an_enhanced_file_are_placed_by_their_groups() {
    let syntax = IMPLICIT;
    let new = || Elements::new(syntax);
    let frame = |z: &str| {
        new().items(
            0x0020_9113,
            &[new().text(0x0020_0032, &format!("0\\0\\{z}"))],
        )
    };
    let shared = new()
        .items(0x0020_9116, &[new().text(0x0020_0037, "0\\1\\0\\-1\\0\\0")])
        .items(0x0028_9110, &[new().text(0x0028_0030, "7\\6")])
        .items(
            0x0028_9132,
            &[new()
                .text(0x0028_1050, "40\\700")
                .text(0x0028_1051, "80\\3200")],
        )
        .open_items(
            0x0028_9145,
            &[new().text(0x0028_1052, "100").text(0x0028_1053, "2")],
        );
    let elements = new()
        .text(0x0028_0008, "3")
        .short(0x0028_0010, 1)
        .short(0x0028_0011, 1)
        .short(0x0028_0100, 8)
        .items(0x5200_9229, &[shared])
        .open_items(0x5200_9230, &[frame("4"), frame("0"), frame("2")])
        .bytes(0x7FE0_0010, b"OB", &[3, 1, 2]);
    let volume = Folder::new()
        .load(&[&elements.file()])
        .unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(
        (volume.dims, &volume.voxels),
        ([1, 1, 3], &Voxels::U8(vec![102, 104, 106])),
        "sorted and scaled"
    );
    let map = volume.world_from_index.matrix3;
    assert_eq!(map.x_axis.to_array(), [0.0, 6.0, 0.0]);
    assert_eq!(map.y_axis.to_array(), [-7.0, 0.0, 0.0]);
    assert_eq!(map.z_axis.to_array(), [0.0, 0.0, 2.0]);
    assert_eq!(volume.window, Some([0.0, 79.0]), "the first of two");
}

#[test]
fn a_faulty_head_is_passed_over_by_its_length() {
    let good = SLICE.file();
    // The first element behind the length gets a length beyond the head, and a transfer syntax follows the elements.
    let broken =
        Elements::new(EXPLICIT).bytes(0x0002_0010, b"UI", format!("{EXPLICIT}\0").as_bytes());
    let mut odd = Elements::new(EXPLICIT);
    odd.head(0x0002_0016, b"UI", 60_000);
    let head = [broken.bytes, odd.bytes].concat();
    let length =
        Elements::new(EXPLICIT).bytes(0x0002_0000, b"UL", &(head.len() as u32).to_le_bytes());
    let elements = &good[good.len() - SLICE.elements().bytes.len() - 20..];
    let file = [
        vec![0; 128],
        b"DICM".to_vec(),
        length.bytes,
        head,
        elements.to_vec(),
    ]
    .concat();
    let volume = Folder::new()
        .load(&[&file])
        .unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(volume.voxels, Voxels::U16(vec![1, 2, 3, 4000]));
}

#[test]
fn what_is_no_grey_picture_is_refused_with_advice() {
    let colour = SLICE
        .elements()
        .short(0x0028_0002, 3)
        .text(0x0028_0004, "RGB")
        .bytes(0x7FE0_0010, b"OW", &[0; 24]);
    let folder = Folder::new();
    let error = folder.load(&[&colour.file()]).expect_err("colours");
    assert!(
        matches!(error, Error::Unsupported { .. }) && error.to_string().contains("RGB"),
        "{error}"
    );
    let report = Elements::new(EXPLICIT).text(0x0020_000E, "1.2.3").file();
    assert!(folder.refusal(&[&report]).contains("no picture in it"));
    let unknown = Slice {
        syntax: "1.2.840.10008.1.2.4.201",
        ..SLICE
    }
    .refusal();
    assert!(
        unknown.contains("1.2.840.10008.1.2.4.201: unpack the picture first"),
        "{unknown}"
    );
}

#[test]
fn forged_lengths_cost_no_memory() {
    let folder = Folder::new();
    let mut cut = SLICE.elements();
    cut.head(0x7FE0_0010, b"OW", 0xFFFF_FFF0);
    let text = folder.refusal(&[&cut.file()]);
    assert!(
        text.contains("(7FE0,0010) claims 4294967280 bytes, but 0 follow"),
        "{text}"
    );
    let of_size = |side: u16| {
        let rows = SLICE.elements().short(0x0028_0010, side);
        rows.short(0x0028_0011, side)
    };
    let large = of_size(4000);
    let plain = |elements: Elements| elements.bytes(0x7FE0_0010, b"OW", &[0; 8]).file();
    let text = folder.refusal(&[&plain(large.clone())]);
    assert!(text.contains("do not fit the 8 bytes"), "{text}");
    let text = folder.refusal(&[&plain(of_size(65_535))]);
    assert!(text.contains("8.6 GB unpacked"), "{text}");
    for syntax in [
        RLE,
        JPEG_LS,
        "1.2.840.10008.1.2.4.70",
        "1.2.840.10008.1.2.4.90",
    ] {
        let mut packed = Elements {
            syntax,
            ..large.clone()
        };
        packed.head(0x7FE0_0010, b"OW", u32::MAX);
        packed.item(0xE000, 0);
        packed.item(0xE000, 64);
        packed
            .bytes
            .extend([2, 0, 0, 0].iter().chain([0; 60].iter()));
        let text = folder.refusal(&[&packed.file()]);
        assert!(text.contains("cannot hold"), "{syntax}: {text}");
    }
    let frames =
        SLICE
            .elements()
            .text(0x0028_0008, "4000000000")
            .bytes(0x7FE0_0010, b"OW", &[0; 8]);
    assert!(
        folder
            .refusal(&[&frames.file()])
            .contains("NumberOfFrames is 4000000000")
    );
    let mut deep = Elements::new(EXPLICIT);
    for _ in 0..10_000 {
        deep.head(0x0008_1140, b"SQ", u32::MAX);
        deep.item(0xE000, u32::MAX);
    }
    assert!(
        folder.refusal(&[&deep.file()]).contains("nested more than"),
        "deep nesting"
    );
}

#[test]
fn damaged_files_are_refused_and_never_panic() {
    for syntax in [EXPLICIT, IMPLICIT, DEFLATED, BIG_ENDIAN] {
        survive_damage(
            &Slice { syntax, ..SLICE }.file(),
            &LoadOptions::default(),
            1000,
        );
    }
    survive_damage(&SLICE.rle_file(), &LoadOptions::default(), 1000);
    survive_damage(&SLICE.jpeg_ls_file(), &LoadOptions::default(), 1000);
}
