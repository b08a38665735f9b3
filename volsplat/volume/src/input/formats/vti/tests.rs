//! VTK ImageData: small files in every storage, written here and read back.
//!
//! Inline and appended, base64 and raw, packed and plain, either byte order, headers of 4 and 8 bytes.

use std::io::Read;

use super::Base64Reader;
use crate::Error;
use crate::input::formats::vti::head::Packing;
use crate::input::test_files::{Folder, check_components, survive_damage, zlib};
use crate::input::{Format, LoadOptions, format_of, load};
use crate::volume::{Volume, Voxels};

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
    check_components(&path.0, &LoadOptions::default(), 2);
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
    assert!(other("type=\"PImageData\"").contains("'PImageData'"));
    let compressor = "vtkLZMADataCompressor";
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
    let data = points("<DataArray type=\"Int16\" Name=\"a\" format=\"binary\">AAAA</DataArray>");
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
    assert!(other("type=\"ImageData\" byte_order=\"MiddleEndian\"").contains("MiddleEndian"));
    assert!(other("type=\"ImageData\" header_type=\"UInt16\"").contains("UInt16"));
    let piece = File {
        piece: "0 1 0 0 0 3".to_owned(),
        ..File::new()
    };
    assert!(piece.refusal().contains("reaches out of the WholeExtent"));
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
    survive_damage(&packed_file(), &LoadOptions::default(), 2000);
}

/// Six values, and their bytes in either order.
const VALUES: [i16; 6] = [1, -2, 300, 4, -500, 6];

#[derive(Clone, Copy, Debug)]
struct Storage {
    is_big: bool,
    header_bytes: usize,
    packing: Packing,
}

impl Storage {
    fn all() -> Vec<Self> {
        let flags = [false, true];
        let mut all = Vec::new();
        for is_big in flags {
            for packing in [Packing::None, Packing::Zlib, Packing::Lz4] {
                all.extend([4, 8].map(|header_bytes| Self {
                    is_big,
                    header_bytes,
                    packing,
                }));
            }
        }
        all
    }

    fn root(self) -> String {
        let order = if self.is_big {
            "BigEndian"
        } else {
            "LittleEndian"
        };
        let header = if self.header_bytes == 4 {
            "UInt32"
        } else {
            "UInt64"
        };
        let packed = match self.packing {
            Packing::None => "",
            Packing::Zlib => " compressor=\"vtkZLibDataCompressor\"",
            Packing::Lz4 => " compressor=\"vtkLZ4DataCompressor\"",
        };
        format!("type=\"ImageData\" byte_order=\"{order}\" header_type=\"{header}\"{packed}")
    }

    fn values(self) -> Vec<u8> {
        VALUES
            .iter()
            .flat_map(|v| {
                if self.is_big {
                    v.to_be_bytes()
                } else {
                    v.to_le_bytes()
                }
            })
            .collect()
    }

    fn number(self, value: u64) -> Vec<u8> {
        let mut bytes = value.to_le_bytes()[..self.header_bytes].to_vec();
        if self.is_big {
            bytes.reverse();
        }
        bytes
    }

    /// The header and the data; packed in blocks of 8 bytes, of which the last one is half full.
    fn parts(self) -> [Vec<u8>; 2] {
        let values = self.values();
        if self.packing == Packing::None {
            return [self.number(values.len() as u64), values];
        }
        let pack = match self.packing {
            Packing::Lz4 => lz4_flex::block::compress,
            Packing::Zlib | Packing::None => zlib,
        };
        let blocks: Vec<Vec<u8>> = values.chunks(8).map(pack).collect();
        let sizes = blocks.iter().map(|block| block.len() as u64);
        let head = [blocks.len() as u64, 8, 4]
            .into_iter()
            .chain(sizes)
            .flat_map(|n| self.number(n))
            .collect();
        [head, blocks.concat()]
    }

    /// VTK encodes the header of packed data on its own, that of plain data together with the data.
    fn base64(self) -> String {
        let [head, data] = self.parts();
        if self.packing != Packing::None {
            base64(&head) + &base64(&data)
        } else {
            base64(&[head, data].concat())
        }
    }
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for three in bytes.chunks(3) {
        let bits = (0..3).fold(0u32, |bits, i| {
            (bits << 8) | u32::from(*three.get(i).unwrap_or(&0))
        });
        for place in 0..4 {
            let digit = DIGITS[(bits >> (18 - 6 * place)) as usize & 63];
            text.push(if place <= three.len() {
                char::from(digit)
            } else {
                '='
            });
        }
    }
    text
}

/// The file with its data appended behind two bytes (raw) or four characters (base64) of another array.
fn appended(storage: Storage, encoding: &str) -> Vec<u8> {
    let offset = if encoding == "raw" { 2 } else { 4 };
    let array =
        format!("<DataArray type=\"Int16\" Name=\"a\" format=\"appended\" offset=\"{offset}\"/>");
    let file = File {
        root: storage.root(),
        data: points(&array),
        ..File::new()
    }
    .bytes();
    let head = String::from_utf8(file)
        .expect("text")
        .replace("</VTKFile>\n", "");
    let data = match encoding {
        "raw" => [b"_<".to_vec(), vec![b'<'], storage.parts().concat()].concat(),
        _ => format!("_AAAA{}", storage.base64()).into_bytes(),
    };
    let tag = format!("<AppendedData encoding=\"{encoding}\">\n   ");
    [
        head.into_bytes(),
        tag.into_bytes(),
        data,
        b"\n</AppendedData></VTKFile>".to_vec(),
    ]
    .concat()
}

/// A file with packed data, for the test that damages it.
pub(crate) fn packed_file() -> Vec<u8> {
    appended(
        Storage {
            is_big: false,
            header_bytes: 4,
            packing: Packing::Zlib,
        },
        "raw",
    )
}

#[test]
fn every_storage_reads_back() {
    let folder = Folder::new();
    for storage in Storage::all() {
        let data = points(&format!(
            "<DataArray type=\"Int16\" Name=\"a\" format=\"binary\">\n  {}\n</DataArray>",
            storage.base64()
        ));
        let inline = File {
            root: storage.root(),
            data,
            ..File::new()
        }
        .bytes();
        for file in [
            inline,
            appended(storage, "raw"),
            appended(storage, "base64"),
        ] {
            let volume = folder
                .load(&[&file])
                .unwrap_or_else(|error| panic!("{storage:?}: {error}"));
            assert_eq!(volume.voxels, Voxels::I16(VALUES.to_vec()), "{storage:?}");
        }
    }
}

#[test]
fn the_head_is_found_behind_many_pieces_of_text() {
    let storage = Storage {
        is_big: false,
        header_bytes: 4,
        packing: Packing::None,
    };
    let file = String::from_utf8_lossy(&appended(storage, "base64")).into_owned();
    // Comments of growing length push the word AppendedData across the border between two pieces.
    for length in (1 << 16) - 460..(1 << 16) - 380 {
        let padded = file.replacen(
            "<VTKFile",
            &format!("<!--{}--><VTKFile", " ".repeat(length)),
            1,
        );
        let xml = padded.find("<!--").expect("there");
        // The mark must stand within the first bytes, so the comment goes behind the opening tag.
        let (comment, rest) = padded[xml..].split_at(length + 7);
        let tag_end = rest.find('>').expect("there") + 1;
        let moved = format!(
            "{}{}{comment}{}",
            &padded[..xml],
            &rest[..tag_end],
            &rest[tag_end..]
        );
        let volume = Folder::new()
            .load(&[moved.as_bytes()])
            .unwrap_or_else(|error| panic!("{length}: {error}"));
        assert_eq!(volume.voxels, Voxels::I16(VALUES.to_vec()));
    }
}

#[test]
fn one_component_of_packed_data_is_taken() {
    let folder = Folder::new();
    let storage = Storage {
        is_big: true,
        header_bytes: 8,
        packing: Packing::Zlib,
    };
    let array = "type=\"Int16\" Name=\"a\"";
    let file = String::from_utf8_lossy(&appended(storage, "base64"))
        .replace(array, &format!("{array} NumberOfComponents=\"2\""))
        .replace("0 1 0 0 0 2", "0 0 0 0 0 2");
    let path = folder.write("x.vti", &[file.as_bytes()]);
    check_components(&path, &LoadOptions::default(), 2);
    let options = LoadOptions {
        component: Some(1),
        ..LoadOptions::default()
    };
    assert_eq!(
        load(&path, &options).expect("chosen").voxels,
        Voxels::I16(vec![-2, 4, 6])
    );
}

#[test]
fn lengths_that_contradict_the_image_are_refused() {
    let folder = Folder::new();
    for storage in Storage::all() {
        let larger = |file: Vec<u8>| {
            String::from_utf8_lossy(&file).replace("0 1 0 0 0 2", "0 1 0 0 0 20000000")
        };
        let text = folder.refusal(&[larger(appended(storage, "base64")).as_bytes()]);
        assert!(
            text.contains("begins with the length 12") && text.contains("80000004 bytes"),
            "{text}"
        );
    }
    let storage = Storage {
        is_big: false,
        header_bytes: 8,
        packing: Packing::Zlib,
    };
    let file = appended(storage, "raw");
    let start = file.windows(2).position(|two| two == b"_<").expect("there") + 3;
    let forged = |at: usize, value: u64| {
        let mut file = file.clone();
        file[start + 8 * at..start + 8 * at + 8].copy_from_slice(&value.to_le_bytes());
        folder.refusal(&[&file])
    };
    assert!(
        forged(0, u64::MAX).contains("cannot list"),
        "{}",
        forged(0, u64::MAX)
    );
    assert!(forged(0, 1 << 20).contains("cannot list"));
    assert!(forged(1, u64::MAX).contains("begins with the length"));
    assert!(forged(3, u64::MAX).contains("cut off"));
    assert!(forged(3, 1).contains("the data"), "{}", forged(3, 1));
    let cut = file.len() - 60;
    assert!(
        !folder.refusal(&[&file[..cut]]).is_empty(),
        "a cut file must be refused"
    );
}

fn base64_decoded(text: &str) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    Base64Reader::new(text.as_bytes())
        .read_to_end(&mut bytes)
        .map(|_| bytes)
}

#[test]
fn the_examples_of_rfc_4648_are_decoded_also_joined() {
    for (text, plain) in [
        ("", ""),
        ("Zg==", "f"),
        ("Zm8=", "fo"),
        ("Zm9v", "foo"),
        ("Zm9vYmE=", "fooba"),
    ] {
        assert_eq!(
            base64_decoded(text).expect("valid"),
            plain.as_bytes(),
            "{text}"
        );
    }
    assert_eq!(
        base64_decoded(" Zg==\nZm8=Zm9v <rest").expect("valid"),
        b"ffofoo",
        "padding in the middle"
    );
    assert_eq!(base64_decoded("+/+/").expect("valid"), [0xfb, 0xff, 0xbf]);
    for bad in ["Z", "Zm9", "Z===", "Zg=A", "Zm9v!", "===="] {
        assert!(base64_decoded(bad).is_err(), "{bad}");
    }
}
