//! Inline and appended, base64 and raw, packed and plain, either byte order, headers of 4 and 8 bytes.

use crate::input::formats::vti::tests::{File, points};
use crate::input::test_files::{Folder, zlib};
use crate::input::{LoadOptions, load};
use crate::volume::Voxels;

/// Six values, and their bytes in either order.
const VALUES: [i16; 6] = [1, -2, 300, 4, -500, 6];

#[derive(Clone, Copy, Debug)]
struct Storage {
    is_big: bool,
    header_bytes: usize,
    is_packed: bool,
}

impl Storage {
    fn all() -> Vec<Self> {
        let flags = [false, true];
        let mut all = Vec::new();
        for is_big in flags {
            for is_packed in flags {
                all.extend([4, 8].map(|header_bytes| Self {
                    is_big,
                    header_bytes,
                    is_packed,
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
        let packed = if self.is_packed {
            " compressor=\"vtkZLibDataCompressor\""
        } else {
            ""
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
        if !self.is_packed {
            return [self.number(values.len() as u64), values];
        }
        let blocks: Vec<Vec<u8>> = values.chunks(8).map(zlib).collect();
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
        if self.is_packed {
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
            is_packed: true,
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
        is_packed: false,
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
        is_packed: true,
    };
    let array = "type=\"Int16\" Name=\"a\"";
    let file = String::from_utf8_lossy(&appended(storage, "base64"))
        .replace(array, &format!("{array} NumberOfComponents=\"2\""))
        .replace("0 1 0 0 0 2", "0 0 0 0 0 2");
    let path = folder.write("x.vti", &[file.as_bytes()]);
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
        is_packed: true,
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
