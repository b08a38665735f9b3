//! VTK ImageData: small files in every storage, written here and read back.

use crate::Error;
use crate::input::test_files::{Folder, survive_damage};
use crate::input::{Format, LoadOptions, format_of, load};
use crate::volume::{Volume, Voxels};

mod storage;

/// Attributes and content of a file; the image has 2x1x3 points and one array "a" unless a test changes it.
struct File {
    root: String,
    image: String,
    piece: String,
    data: String,
}

impl File {
    /// One array of 16-bit integers as text.
    fn new() -> Self {
        Self {
            root: "type=\"ImageData\" byte_order=\"LittleEndian\"".to_owned(),
            image: "WholeExtent=\"0 1 0 0 0 2\" Origin=\"1 2 3\" Spacing=\"2 3 4\"".to_owned(),
            piece: "0 1 0 0 0 2".to_owned(),
            data: points(
                "<DataArray type=\"Int16\" Name=\"a\" format=\"ascii\">1 -2 3\n4 5 6</DataArray>",
            ),
        }
    }

    fn bytes(&self) -> Vec<u8> {
        let Self {
            root,
            image,
            piece,
            data,
        } = self;
        format!(
            "<?xml version=\"1.0\"?>\n<VTKFile {root}>\n<ImageData {image}>\n<Piece Extent=\"{piece}\">\n{data}\n\
             </Piece>\n</ImageData>\n</VTKFile>\n"
        )
        .into_bytes()
    }

    fn load(&self) -> Volume {
        Folder::new()
            .load(&[&self.bytes()])
            .unwrap_or_else(|error| panic!("{error}"))
    }

    fn refusal(&self) -> String {
        Folder::new().refusal(&[&self.bytes()])
    }
}

fn points(arrays: &str) -> String {
    format!("<PointData Scalars=\"a\">{arrays}</PointData><CellData></CellData>")
}

#[test]
fn text_is_read_and_the_lattice_is_the_files() {
    let volume = File::new().load();
    assert_eq!(
        (volume.dims, &volume.voxels),
        ([2, 1, 3], &Voxels::I16(vec![1, -2, 3, 4, 5, 6]))
    );
    assert_eq!(volume.spacing(), [2.0, 3.0, 4.0]);
    assert_eq!(
        volume.world_from_index.translation.to_array(),
        [1.0, 2.0, 3.0]
    );
}

#[test]
fn an_extent_that_does_not_begin_at_0_moves_the_first_voxel() {
    let extent = "5 6 -1 -1 10 12".to_owned();
    let image = format!(
        "WholeExtent=\"{extent}\" Origin=\"1 2 3\" Spacing=\"2 3 4\" Direction=\"0 -1 0 1 0 0 0 0 1\""
    );
    let volume = File {
        image,
        piece: extent,
        ..File::new()
    }
    .load();
    let map = volume.world_from_index;
    assert_eq!(
        map.matrix3.x_axis.to_array(),
        [0.0, 2.0, 0.0],
        "the first column of Direction"
    );
    assert_eq!(map.matrix3.y_axis.to_array(), [-3.0, 0.0, 0.0]);
    // Origin plus 5 steps of the first axis, -1 of the second, 10 of the third.
    assert_eq!(
        map.translation.to_array(),
        [1.0 + 3.0, 2.0 + 10.0, 3.0 + 40.0]
    );
}

#[test]
fn values_of_cells_stand_at_their_centres() {
    let data = "<PointData/><CellData Scalars=\"c\"><DataArray type=\"UInt8\" Name=\"c\" format=\"ascii\">7 8</DataArray>\
                </CellData>"
        .to_owned();
    let volume = File {
        data,
        ..File::new()
    }
    .load();
    assert_eq!(
        (volume.dims, &volume.voxels),
        ([1, 1, 2], &Voxels::U8(vec![7, 8]))
    );
    assert_eq!(
        volume.world_from_index.translation.to_array(),
        [2.0, 2.0, 5.0],
        "half a step along x and z"
    );
}

#[test]
fn the_array_is_the_active_one_the_only_one_or_the_named_one() {
    let array = |name: &str, value: u8| {
        format!(
            "<DataArray type=\"UInt8\" Name=\"{name}\" format=\"ascii\">{}</DataArray>",
            format!("{value} ").repeat(6)
        )
    };
    let both = array("b", 2) + &array("a", 1);
    let of = |data: String, name: Option<&str>| {
        let folder = Folder::new();
        let path = folder.write(
            "x.vti",
            &[&File {
                data,
                ..File::new()
            }
            .bytes()],
        );
        load(
            &path,
            &LoadOptions {
                array: name.map(str::to_owned),
                ..LoadOptions::default()
            },
        )
    };
    assert_eq!(of(points(&both), None).expect("active").value(0), 1.0);
    assert_eq!(of(points(&both), Some("b")).expect("named").value(0), 2.0);
    let passive = format!("<PointData>{both}</PointData>");
    let text = of(passive, None).expect_err("two").to_string();
    assert!(text.contains("array=NAME, of b, a"), "{text}");
    assert_eq!(
        of(format!("<PointData>{}</PointData>", array("b", 2)), None)
            .expect("only")
            .value(0),
        2.0
    );
    let error = of(points(&both), Some("z")).expect_err("absent");
    assert!(
        matches!(error, Error::Option(_)) && error.to_string().contains("there are: b, a"),
        "{error}"
    );
    assert!(
        of("<PointData/>".to_owned(), None)
            .expect_err("none")
            .to_string()
            .contains("no array")
    );
}

#[test]
fn a_component_is_chosen_or_asked_for() {
    let data = points(
        "<DataArray type=\"UInt8\" Name=\"a\" NumberOfComponents=\"2\" format=\"ascii\">1 10 2 20 3 30 4 40 5 50 6 60</DataArray>",
    );
    let file = File {
        data,
        ..File::new()
    };
    assert!(
        file.refusal().contains("2 components"),
        "{}",
        file.refusal()
    );
    let path = Folder::new();
    let path = (path.write("x.vti", &[&file.bytes()]), path);
    let options = LoadOptions {
        component: Some(1),
        ..LoadOptions::default()
    };
    assert_eq!(
        load(&path.0, &options).expect("chosen").voxels,
        Voxels::U8(vec![10, 20, 30, 40, 50, 60])
    );
}

#[test]
fn what_is_not_read_is_named() {
    let other = |root: &str| {
        File {
            root: root.to_owned(),
            ..File::new()
        }
        .refusal()
    };
    assert!(other("type=\"UnstructuredGrid\"").contains("'UnstructuredGrid'"));
    assert!(other("type=\"PImageData\"").contains("one .vti file"));
    for compressor in ["vtkLZ4DataCompressor", "vtkLZMADataCompressor"] {
        let root = format!("type=\"ImageData\" compressor=\"{compressor}\"");
        assert!(
            File {
                root: root.clone(),
                ..File::new()
            }
            .load()
            .len()
                == 6,
            "text is not compressed"
        );
        let data =
            points("<DataArray type=\"Int16\" Name=\"a\" format=\"binary\">AAAA</DataArray>");
        let text = File {
            root,
            data,
            ..File::new()
        }
        .refusal();
        assert!(
            text.contains(compressor) && text.contains("save the file with zlib"),
            "{text}"
        );
    }
    assert!(other("type=\"ImageData\" byte_order=\"MiddleEndian\"").contains("MiddleEndian"));
    assert!(other("type=\"ImageData\" header_type=\"UInt16\"").contains("UInt16"));
    let piece = File {
        piece: "0 1 0 0 0 1".to_owned(),
        ..File::new()
    };
    assert!(piece.refusal().contains("as one piece"));
    let text = File {
        data: points("<DataArray type=\"String\" Name=\"a\">x</DataArray>"),
        ..File::new()
    }
    .refusal();
    assert!(text.contains("'String'"), "{text}");
}

#[test]
fn faulty_heads_are_refused_by_name() {
    let image = |image: &str| {
        File {
            image: image.to_owned(),
            ..File::new()
        }
        .refusal()
    };
    assert!(image("WholeExtent=\"0 1 0 0 0\"").contains("WholeExtent is '0 1 0 0 0'"));
    assert!(image("WholeExtent=\"1 0 0 0 0 2\"").contains("WholeExtent"));
    let extent = "WholeExtent=\"0 1 0 0 0 2\"";
    assert!(image(&format!("{extent} Spacing=\"1 1\"")).contains("Spacing has 2 numbers"));
    assert!(image(&format!("{extent} Spacing=\"1 1 0\"")).contains("length 0"));
    assert!(image(&format!("{extent} Direction=\"1 0 0\"")).contains("Direction has 3 numbers"));
    let data = |data: &str| {
        File {
            data: points(data),
            ..File::new()
        }
        .refusal()
    };
    assert!(
        data("<DataArray type=\"UInt8\" Name=\"a\" format=\"ascii\">1 2 3</DataArray>")
            .contains("6 values are needed")
    );
    assert!(
        data("<DataArray type=\"UInt8\" Name=\"a\" format=\"hex\">1</DataArray>").contains("'hex'")
    );
    assert!(
        data("<DataArray type=\"UInt8\" Name=\"a\" format=\"appended\" offset=\"0\"/>")
            .contains("no AppendedData")
    );
    assert!(data("<DataArray").contains("XML is broken"));
    let deep = points(&"<a>".repeat(100_000));
    assert!(
        File {
            data: deep,
            ..File::new()
        }
        .refusal()
        .contains("XML is broken"),
        "deep nesting is survived"
    );
}

#[test]
fn the_format_is_told_by_content() {
    let folder = Folder::new();
    let path = folder.write("x", &[b"\xef\xbb\xbf", &File::new().bytes()]);
    assert_eq!(format_of(&path).expect("readable"), Some(Format::Vti));
    assert!(
        load(&path, &LoadOptions::default()).is_ok(),
        "a byte order mark does no harm"
    );
}

#[test]
fn damaged_files_are_refused_and_never_panic() {
    survive_damage(&File::new().bytes(), &LoadOptions::default(), 1000);
    survive_damage(&storage::packed_file(), &LoadOptions::default(), 2000);
}
