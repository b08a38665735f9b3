//! Many files: their order, their place, and what makes a series unfit.

use resample_io::Gate;

use crate::Error;
use crate::input::formats::dicom::tests::files::{EXPLICIT, Elements, IMPLICIT, SLICE, Slice};
use crate::input::test_files::Folder;
use crate::input::{Format, LoadOptions, format_of, load};
use crate::volume::{Volume, Voxels};

/// Writes slices as 0.dcm, 1.dcm and so on, and loads the folder.
fn loaded(slices: &[Slice], options: &LoadOptions) -> Result<Volume, Error> {
    let folder = Folder::new();
    folder.write("README.txt", &[b"not a slice"]);
    folder.write(
        "report.dcm",
        &[&Elements::new(EXPLICIT).text(0x0020_000E, "9").file()],
    );
    for (index, slice) in slices.iter().enumerate() {
        folder.write(&format!("{index}.dcm"), &[&slice.file()]);
    }
    assert_eq!(
        format_of(&folder.path("")).expect("readable"),
        Some(Format::Dicom)
    );
    load(&folder.path(""), options)
}

fn at(position: &'static str, value: u16) -> Slice {
    Slice {
        position,
        values: [value; 4],
        ..SLICE
    }
}

fn refusal(slices: &[Slice]) -> String {
    loaded(slices, &LoadOptions::default())
        .expect_err("these slices are no volume")
        .to_string()
}

#[test]
fn slices_are_sorted_along_their_normal_and_never_mirrored() {
    let slices = [at("0\\0\\6", 3), at("0\\0\\2", 1), at("0\\0\\4", 2)];
    let volume = loaded(&slices, &LoadOptions::default()).expect("even");
    assert_eq!(volume.dims, [2, 2, 3]);
    assert_eq!([0, 4, 8].map(|index| volume.value(index)), [1.0, 2.0, 3.0]);
    assert_eq!(
        volume.world_from_index.translation.to_array(),
        [0.0, 0.0, 2.0]
    );
    assert_eq!(
        volume.spacing(),
        [2.0, 3.0, 2.0],
        "the step of the positions, not the thickness"
    );
    // Rows that run up turn the normal down: the order of the slices turns with it.
    let upward = slices.map(|slice| Slice {
        orientation: "1\\0\\0\\0\\-1\\0",
        ..slice
    });
    let volume = loaded(&upward, &LoadOptions::default()).expect("even");
    assert_eq!([0, 4, 8].map(|index| volume.value(index)), [3.0, 2.0, 1.0]);
    assert!(
        volume.world_from_index.matrix3.determinant() > 0.0,
        "a mirrored patient"
    );
    assert_eq!(
        volume.world_from_index.matrix3.z_axis.to_array(),
        [0.0, 0.0, -2.0]
    );
}

#[test]
fn a_tilted_gantry_shears_the_lattice() {
    // The slices are turned around x, and the table moves along z.
    let tilted = |position, value| Slice {
        orientation: "1\\0\\0\\0\\0.8\\-0.6",
        ..at(position, value)
    };
    let slices = [
        tilted("0\\0\\0", 1),
        tilted("0\\0\\5", 2),
        tilted("0\\0\\10", 3),
    ];
    let volume = loaded(&slices, &LoadOptions::default()).expect("even");
    let map = volume.world_from_index.matrix3;
    assert_eq!(
        map.z_axis.to_array(),
        [0.0, 0.0, 5.0],
        "the step is not along the normal"
    );
    assert!(
        (map.y_axis - glam::DVec3::new(0.0, 2.4, -1.8)).length() < 1e-12,
        "{}",
        map.y_axis
    );
    assert_eq!([0, 4, 8].map(|index| volume.value(index)), [1.0, 2.0, 3.0]);
}

#[test]
fn uneven_slices_are_resampled_with_a_remark() {
    let gate = Gate::default();
    let options = LoadOptions {
        gate: gate.clone(),
        ..LoadOptions::default()
    };
    // One slice is missing.
    let slices = [
        at("0\\0\\0", 10),
        at("0\\0\\2", 20),
        at("0\\0\\6", 40),
        at("0\\0\\8", 5),
    ];
    let volume = loaded(&slices, &options).expect("resampled");
    assert_eq!((volume.dims, volume.spacing()[2]), ([2, 2, 5], 2.0));
    let values = [0, 4, 8, 12, 16].map(|index| volume.value(index));
    assert_eq!(values, [10.0, 20.0, 30.0, 40.0, 5.0]);
    let said = gate.remarks().join(" ");
    assert!(
        said.contains("0 to 1 are 2.00 mm apart, 1 to 2 are 4.00 mm apart"),
        "{said}"
    );
    assert!(
        said.contains("resampled to 5 slices 2.00 mm apart"),
        "{said}"
    );
    // A step aside is no gap.
    let bent = ["0\\0\\0", "0\\0\\2", "3\\0\\4"].map(|position| at(position, 1));
    assert!(refusal(&bent).contains("a folder of their own"));
    let text = refusal(&["0\\0\\0", "0\\0\\0", "0\\0\\2"].map(|position| at(position, 1)));
    assert!(
        text.contains("slices 0 and 1 lie at the same place"),
        "{text}"
    );
    let rounded = ["0\\0\\0", "0\\0\\1.0004", "0\\0\\2"].map(|position| at(position, 1));
    assert!(
        loaded(&rounded, &LoadOptions::default()).is_ok(),
        "rounding is no gap"
    );
}

#[test]
fn slices_that_do_not_belong_together_are_refused() {
    let turned = Slice {
        orientation: "0\\1\\0\\0\\0\\1",
        ..at("0\\0\\2", 1)
    };
    assert!(refusal(&[at("0\\0\\0", 1), turned]).contains("is turned against"));
    let signed = Slice {
        is_signed: true,
        ..at("0\\0\\2", 1)
    };
    let text = refusal(&[at("0\\0\\0", 1), signed]);
    assert!(text.contains("1.dcm") && text.contains("signed"), "{text}");
    let nowhere = at("", 1);
    assert!(
        refusal(&[at("0\\0\\0", 1), nowhere])
            .contains("1 of 2 slices have no ImagePositionPatient")
    );
    assert!(refusal(&[nowhere, nowhere]).contains("their order is not known"));
}

#[test]
fn slices_without_positions_follow_their_instance_numbers() {
    let gate = Gate::default();
    let options = LoadOptions {
        gate: gate.clone(),
        ..LoadOptions::default()
    };
    let numbered = |instance, value| Slice {
        instance,
        ..at("", value)
    };
    let slices = [numbered("10", 3), numbered("2", 1), numbered("3", 2)];
    let volume = loaded(&slices, &options).expect("in order");
    assert_eq!([0, 4, 8].map(|index| volume.value(index)), [1.0, 2.0, 3.0]);
    assert!(
        gate.remarks()[0].contains("instance numbers"),
        "{:?}",
        gate.remarks()
    );
    let twice = [numbered("1", 3), numbered("1", 1)];
    assert!(refusal(&twice).contains("their order is not known"));
}

#[test]
fn of_several_series_the_largest_is_taken_or_the_one_that_was_asked_for() {
    let other = |position| Slice {
        series: "4.5.6",
        ..at(position, 9)
    };
    let slices = [
        at("0\\0\\0", 1),
        other("0\\0\\0"),
        at("0\\0\\2", 2),
        other("0\\0\\3"),
        other("0\\0\\6"),
    ];
    let gate = Gate::default();
    let options = LoadOptions {
        gate: gate.clone(),
        ..LoadOptions::default()
    };
    let largest = loaded(&slices, &options).expect("one of them");
    assert_eq!((largest.dims[2], largest.value(0)), (3, 9.0));
    let text = gate.remarks().join(" ");
    assert!(
        text.contains("series=UID") && text.contains("1.2.3 (2 slices, 'a name')"),
        "{text}"
    );
    assert!(text.contains("the largest was taken, 4.5.6"), "{text}");
    let of = |uid: &str| {
        loaded(
            &slices,
            &LoadOptions {
                series: Some(uid.to_owned()),
                ..LoadOptions::default()
            },
        )
    };
    assert_eq!(of("1.2.3").expect("chosen").dims, [2, 2, 2]);
    assert_eq!(of("4.5.6").expect("chosen").spacing()[2], 3.0);
    for unknown in ["7", "a name"] {
        assert!(matches!(of(unknown), Err(Error::Option(_))), "{unknown}");
    }
    // A name that only one series has chooses it, too.
    let one = loaded(
        &slices[..1],
        &LoadOptions {
            series: Some("A Name".to_owned()),
            ..LoadOptions::default()
        },
    );
    assert_eq!(one.expect("chosen").dims, [2, 2, 1]);
}

/// Slices as a hospital's disc has them: a folder for each series in folders, and an index of all.
fn disc() -> Folder {
    let folder = Folder::new();
    let index = Elements::new(EXPLICIT).file();
    let class = b"1.2.840.10008.1.3.10";
    // The class stands in the head, which the mark begins.
    let mark = 128 + 4;
    let index = [
        &index[..mark],
        &[2, 0, 2, 0],
        b"UI",
        &[20, 0],
        class,
        &index[mark..],
    ]
    .concat();
    for (inner, slices) in [
        ("P/S/A", vec![at("0\\0\\0", 1), at("0\\0\\2", 2)]),
        ("P/S/B", vec![at("0\\0\\0", 9)]),
    ] {
        std::fs::create_dir_all(folder.path(inner)).expect("a folder");
        for (number, slice) in slices.into_iter().enumerate() {
            let series = if inner == "P/S/A" { "1.2" } else { "3.4" };
            let slice = Slice { series, ..slice };
            folder.write(&format!("{inner}/IM{number}"), &[&slice.file()]);
        }
    }
    folder.write("DICOMDIR", &[&index]);
    folder
}

#[test]
fn the_folders_and_the_index_of_a_disc_lead_to_its_series() {
    let folder = disc();
    for name in ["", "P", "DICOMDIR"] {
        let path = folder.path(name);
        assert_eq!(format_of(&path).expect(name), Some(Format::Dicom), "{name}");
        let volume = load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!((volume.dims[2], volume.value(0)), (2, 1.0), "{name}");
    }
    // A folder without any is refused as before.
    std::fs::create_dir_all(folder.path("E/F")).expect("a folder");
    let complaint = load(&folder.path("E"), &LoadOptions::default()).expect_err("empty");
    assert!(complaint.to_string().contains("without slices"));
}

#[test]
fn files_without_a_head_are_known_by_their_elements() {
    for syntax in [EXPLICIT, IMPLICIT] {
        let first = Elements::new(syntax)
            .text(0x0008_0005, "ISO_IR 100")
            .text(0x0008_0016, "1.2.840.10008.5.1.4.1.1.2")
            .text(0x0008_0018, "1.2.3.4");
        let slice = Slice { syntax, ..SLICE };
        let file = slice.file();
        // Behind the preamble, the mark and the head, which names the syntax in as many bytes as it has.
        let rest = slice.elements().bytes;
        let pixels = file[file.len() - 8 - if syntax == EXPLICIT { 12 } else { 8 }..].to_vec();
        let folder = Folder::new();
        let path = folder.write("bare", &[&first.bytes, &rest, &pixels]);
        assert_eq!(format_of(&path).expect("readable"), Some(Format::Dicom));
        let volume = load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(volume.voxels, Voxels::U16(vec![1, 2, 3, 4000]), "{syntax}");
        // Numbers that look like a tag are no file.
        let raw = folder.write("raw", &[&first.bytes[..16], &[7; 200]]);
        assert_eq!(format_of(&raw).expect("readable"), None);
    }
}

#[test]
fn a_broken_slice_is_left_out_with_a_remark() {
    let positions = ["0\\0\\0", "0\\0\\2", "0\\0\\4", "0\\0\\6", "0\\0\\8"];
    let write = |broken: &[usize]| {
        let folder = Folder::new();
        for (number, position) in positions.into_iter().enumerate() {
            let file = at(position, 10 * number as u16).file();
            let held = file.len() - if broken.contains(&number) { 5 } else { 0 };
            folder.write(&format!("{number}"), &[&file[..held]]);
        }
        folder
    };
    let options = LoadOptions::default();
    let volume = load(&write(&[2]).path(""), &options).unwrap_or_else(|e| panic!("{e}"));
    // Its neighbours' mean stands in its place.
    assert_eq!((volume.dims[2], volume.value(2 * 4)), (5, 20.0));
    let text = options.gate.remarks().join("\n");
    assert!(
        text.contains("1 of 5 files") && text.contains("cut off"),
        "{text}"
    );
    let complaint = load(&write(&[1, 2, 3]).path(""), &options).expect_err("too many");
    assert!(complaint.to_string().contains("cut off"), "{complaint}");
}

#[test]
fn slices_of_different_scales_become_singles() {
    let half = Slice {
        slope: "0.5",
        intercept: "1",
        ..at("0\\0\\2", 5)
    };
    let volume = loaded(&[at("0\\0\\0", 5), half], &LoadOptions::default()).expect("even");
    assert_eq!(volume.voxels, Voxels::F32([[5.0; 4], [3.5; 4]].concat()));
}

/// Segments 1 and 300 on slices at 0 and 6 mm, 3 mm apart; the second overlaps the first in a corner.
fn segmentation(bits: u16) -> Vec<u8> {
    let new = || Elements::new(EXPLICIT);
    let frame = |z: &str, segment: u16| {
        new()
            .items(
                0x0020_9113,
                &[new().text(0x0020_0032, &format!("1\\2\\{z}"))],
            )
            .items(0x0062_000A, &[new().short(0x0062_000B, segment)])
    };
    let shared = new()
        .items(0x0020_9116, &[new().text(0x0020_0037, "1\\0\\0\\0\\1\\0")])
        .items(
            0x0028_9110,
            &[new().text(0x0018_0088, "3").text(0x0028_0030, "2\\2")],
        );
    let segment =
        |number: u16, name: &str| new().short(0x0062_0004, number).text(0x0062_0005, name);
    // 3x1 pixels: 110, 011 and 100, the first bit the lowest.
    let pixels = match bits {
        1 => vec![0b0111_0011u8, 0],
        _ => vec![200, 128, 127, 0, 255, 130, 129, 5, 4, 0],
    };
    let elements = new()
        .text(0x0008_0060, "SEG")
        .text(0x0028_0008, "3")
        .short(0x0028_0010, 1)
        .short(0x0028_0011, 3)
        .short(0x0028_0100, bits)
        .items(0x0062_0002, &[segment(1, "liver"), segment(300, "spleen")])
        .items(0x5200_9229, &[shared])
        .items(
            0x5200_9230,
            &[frame("6", 1), frame("6", 300), frame("0", 300)],
        )
        .bytes(0x7FE0_0010, b"OB", &pixels);
    let file = elements.file();
    let class = b"1.2.840.10008.5.1.4.1.1.66.4";
    let mark = 128 + 4;
    [
        &file[..mark],
        &[2, 0, 2, 0],
        b"UI",
        &[28, 0],
        class,
        &file[mark..],
    ]
    .concat()
}

#[test]
fn segments_become_labels_on_their_slices() {
    let folder = Folder::new();
    for bits in [1, 8] {
        let path = folder.write("seg.dcm", &[&segmentation(bits)]);
        let options = LoadOptions::default();
        let volume = load(&path, &options).unwrap_or_else(|error| panic!("{error}"));
        // The slice between them has no frame.
        let expected = [[300, 0, 0], [0, 0, 0], [1, 300, 300]].concat();
        assert_eq!(
            (volume.dims, volume.voxels),
            ([3, 1, 3], Voxels::U16(expected))
        );
        let map = volume.world_from_index;
        assert_eq!(
            map.transform_point3(glam::DVec3::ONE).to_array(),
            [3.0, 4.0, 3.0]
        );
        let text = options.gate.remarks().join("\n");
        assert!(
            text.contains("1 liver, 300 spleen") && text.contains("1 voxels"),
            "{text}"
        );
    }
    // Beside a scan they are not taken for slices.
    for (number, position) in ["0\\0\\0", "0\\0\\2"].into_iter().enumerate() {
        folder.write(&format!("{number}.dcm"), &[&at(position, 4).file()]);
    }
    let scan = load(&folder.path(""), &LoadOptions::default());
    assert_eq!(scan.unwrap_or_else(|e| panic!("{e}")).dims, [2, 2, 2]);
    let cut = segmentation(8);
    let complaint = folder.refusal(&[&cut[..cut.len() - 4]]);
    assert!(complaint.contains("cut off"), "{complaint}");
    crate::input::test_files::survive_damage(&segmentation(1), &LoadOptions::default(), 300);
}
