//! Legacy VTK files: what is read, and what is refused with its place.

use glam::DVec3;

use crate::input::test_files::{Folder, check_components, survive_damage};
use crate::input::{Format, LoadOptions, format_of, load};
use crate::volume::{Volume, Voxels};

fn head(coding: &str) -> String {
    format!(
        "# vtk DataFile Version 3.0\na title\n{coding}\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 2 2\nORIGIN 1 2 3\nSPACING 0.5 1 2\n"
    )
}

fn ascii(arrays: &str) -> Vec<u8> {
    format!("{}{arrays}", head("ASCII")).into_bytes()
}

fn scalars(kind: &str, numbers: &str) -> Vec<u8> {
    ascii(&format!(
        "POINT_DATA 12\nSCALARS density {kind} 1\nLOOKUP_TABLE default\n{numbers}\n"
    ))
}

const TWELVE: &str = "0 1 2 3 4 5\n6 7 8 9 10 11";

fn chosen(file: &[u8], array: Option<&str>, component: Option<usize>) -> (Volume, Vec<String>) {
    let folder = Folder::new();
    let options = LoadOptions {
        array: array.map(str::to_owned),
        component,
        ..LoadOptions::default()
    };
    let volume = load(&folder.write("a.vtk", &[file]), &options).expect("a good file");
    (volume, options.gate.remarks())
}

#[test]
fn text_and_binary_of_every_type_read_back() {
    let folder = Folder::new();
    let floats: Vec<f32> = (0..12).map(|i| i as f32 - 1.5).collect();
    let text: String = floats.iter().map(|value| format!("{value} ")).collect();
    let binary = |kind: &str, data: Vec<u8>| {
        let arrays = format!("POINT_DATA 12\nSCALARS s {kind}\nLOOKUP_TABLE default\n");
        [
            format!("{}{arrays}", head("BINARY")).into_bytes(),
            data,
            b"\n".to_vec(),
        ]
        .concat()
    };
    let big_floats = floats
        .iter()
        .flat_map(|value| value.to_be_bytes())
        .collect();
    let shorts: Vec<i16> = (0..12).map(|i| 1000 * i - 5000).collect();
    let big_shorts = shorts
        .iter()
        .flat_map(|value| value.to_be_bytes())
        .collect();
    for (file, expected) in [
        (
            scalars("unsigned_char", TWELVE),
            Voxels::U8((0..12).collect()),
        ),
        (scalars("float", &text), Voxels::F32(floats.clone())),
        (binary("float", big_floats), Voxels::F32(floats)),
        (binary("short", big_shorts), Voxels::I16(shorts)),
        (
            binary("unsigned_char", (0..12).collect()),
            Voxels::U8((0..12).collect()),
        ),
    ] {
        let path = folder.write("a", &[&file]);
        assert_eq!(format_of(&path).expect("readable"), Some(Format::Vtk));
        let volume = load(&path, &LoadOptions::default()).expect("a good file");
        assert_eq!((volume.dims, &volume.voxels), ([3, 2, 2], &expected));
        assert_eq!(volume.spacing(), [0.5, 1.0, 2.0]);
        assert_eq!(
            volume.world_from_index.translation,
            DVec3::new(1.0, 2.0, 3.0)
        );
    }
}

#[test]
fn cells_stand_half_a_step_further() {
    let file = ascii("CELL_DATA 2\nSCALARS s unsigned_char 1\nLOOKUP_TABLE default\n7 9\n");
    let (volume, remarks) = chosen(&file, None, None);
    assert_eq!(
        (volume.dims, &volume.voxels),
        ([2, 1, 1], &Voxels::U8(vec![7, 9]))
    );
    assert_eq!(
        volume.world_from_index.translation,
        DVec3::new(1.25, 2.5, 4.0)
    );
    assert!(remarks[0].contains("cells"), "{remarks:?}");
}

#[test]
fn an_array_is_chosen_among_several() {
    let file = ascii(&format!(
        "FIELD FieldData 1\nTIME 1 1 double\n0.5\nPOINT_DATA 12\nSCALARS a unsigned_char 1\nLOOKUP_TABLE mine\n{TWELVE}\n\
         LOOKUP_TABLE mine 2\n0 0 0 1 1 1 1 1\nMETADATA\nINFORMATION 0\n\nVECTORS v float\n{}\n\
         FIELD FieldData 2\nb 1 12 short\n{TWELVE}\nc 1 12 int\n{TWELVE}\n",
        "1 2 3 ".repeat(12)
    ));
    let (volume, remarks) = chosen(&file, None, None);
    assert_eq!(volume.voxels, Voxels::U8((0..12).collect()));
    assert!(
        remarks[0].contains("the array a is read, there is also v, b, c"),
        "{remarks:?}"
    );
    assert_eq!(
        chosen(&file, Some("b"), None).0.voxels,
        Voxels::I16((0..12).collect())
    );
    assert_eq!(
        chosen(&file, Some("c"), None).0.voxels,
        Voxels::I32((0..12).collect())
    );
    assert_eq!(
        chosen(&file, Some("v"), Some(1)).0.voxels,
        Voxels::F32(vec![2.0; 12])
    );
    let options = LoadOptions {
        array: Some("d".to_owned()),
        ..LoadOptions::default()
    };
    let path = Folder::new();
    let error = load(&path.write("a.vtk", &[&file]), &options).expect_err("absent");
    assert!(
        error.to_string().contains("there are: TIME, a, v, b, c"),
        "{error}"
    );
}

#[test]
fn colours_are_bytes_also_where_a_text_has_shares() {
    let file = ascii(&format!(
        "POINT_DATA 12\nCOLOR_SCALARS c 3\n{}\n",
        "1 0.5 0 ".repeat(12)
    ));
    for (component, byte) in [(0, 255), (1, 128), (2, 0)] {
        let (volume, _) = chosen(&file, None, Some(component));
        assert_eq!(volume.voxels, Voxels::U8(vec![byte; 12]));
    }
    let folder = Folder::new();
    let path = folder.write("colours.vtk", &[&file]);
    check_components(&path, &LoadOptions::default(), 3);
    let colours = |file: &[u8]| {
        crate::input::colours_of(&folder.write("a.vtk", &[file]), &LoadOptions::default())
    };
    assert_eq!(colours(&file).expect("readable"), Some(3));
    assert_eq!(colours(&scalars("short", TWELVE)).expect("readable"), None);
}

#[test]
fn faults_name_their_place() {
    let folder = Folder::new();
    let good = String::from_utf8(scalars("unsigned_char", TWELVE)).expect("text");
    for (from, to, said) in [
        (
            "STRUCTURED_POINTS",
            "RECTILINEAR_GRID",
            "spacing changes along an axis",
        ),
        ("STRUCTURED_POINTS", "POLYDATA", "the command texmap draws"),
        (
            "STRUCTURED_POINTS",
            "SOMETHING",
            "expected STRUCTURED_POINTS",
        ),
        ("ASCII", "EBCDIC", "line 3 is 'EBCDIC'"),
        (
            "DIMENSIONS 3 2 2",
            "DIMENSIONS 3 2",
            "expected three numbers behind DIMENSIONS",
        ),
        (
            "DIMENSIONS 3 2 2",
            "DIMENSIONS 3 2 0",
            "expected three whole numbers from 1",
        ),
        (
            "DIMENSIONS 3 2 2",
            "DIMENSIONS 3 2 3",
            "has 12 values, but DIMENSIONS make 3x2x3: expected 18",
        ),
        (
            "POINT_DATA 12",
            "POINT_DATA x",
            "'POINT_DATA x': expected a number",
        ),
        ("density unsigned_char", "density bit", "of type 'bit'"),
        ("LOOKUP_TABLE default\n", "", "expected LOOKUP_TABLE"),
        ("10 11", "10", "12 values are needed, 11 are there"),
        ("10 11", "10 x", "value 11 of the data is 'x'"),
    ] {
        assert!(good.contains(from), "{from}");
        let text = folder.refusal(&[good.replacen(from, to, 1).as_bytes()]);
        assert!(text.contains(said), "{to}: {text}");
    }
    let forged = good.replace("DIMENSIONS 3 2 2", "DIMENSIONS 9999 9999 9999");
    let forged = forged.replace("POINT_DATA 12", "POINT_DATA 999700029999");
    let text = folder.refusal(&[forged.as_bytes()]);
    assert!(text.contains("GB") || text.contains("can hold"), "{text}");
}

#[test]
fn damaged_files_are_refused_and_never_panic() {
    survive_damage(
        &scalars("unsigned_char", TWELVE),
        &LoadOptions::default(),
        1000,
    );
    let arrays = "POINT_DATA 12\nSCALARS s short\nLOOKUP_TABLE default\n";
    let file = [
        format!("{}{arrays}", head("BINARY")).into_bytes(),
        vec![1; 24],
    ]
    .concat();
    survive_damage(&file, &LoadOptions::default(), 1000);
}
