//! TIFF stacks: small files of every type and packing, written by the crate's encoder and read back.

use std::io::Cursor;
use std::path::PathBuf;

use tiff::encoder::{Compression, DeflateLevel, Rational, TiffEncoder, TiffValue, colortype};
use tiff::tags::{ResolutionUnit, Tag};

use crate::Error;
use crate::input::test_files::{Folder, survive_damage};
use crate::input::{
    Format, ImageAxes, LoadOptions, axes_of, format_of, load, load_colours, load_components,
};
use crate::volume::{Volume, Voxels};

/// A stack of pages of 3x2 pixels; page p begins with the value 10 p.
fn stack<C: colortype::ColorType>(
    pages: usize,
    packing: Compression,
    value: impl Fn(usize) -> C::Inner,
) -> Vec<u8>
where
    [C::Inner]: TiffValue,
{
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes)
        .expect("encoder")
        .with_compression(packing);
    for page in 0..pages {
        let samples = 6 * C::BITS_PER_SAMPLE.len();
        let values: Vec<C::Inner> = (0..samples).map(|i| value(10 * page + i)).collect();
        encoder.write_image::<C>(3, 2, &values).expect("page");
    }
    bytes.into_inner()
}

/// Two pages with a description and 4 pixels per unit.
fn described(description: &str) -> Vec<u8> {
    hyperstack(description, 2, None)
}

/// Pages of their own numbers with a description, 4 pixels per unit and the metadata of ImageJ.
fn hyperstack(description: &str, pages: u8, image_j: Option<(&[u32], &[u8])>) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).expect("encoder");
    for page in 0..pages {
        let mut image = encoder.new_image::<colortype::Gray8>(3, 2).expect("page");
        image.resolution(ResolutionUnit::Inch, Rational { n: 4, d: 1 });
        image
            .encoder()
            .write_tag(Tag::ImageDescription, description)
            .expect("tag");
        if let Some((lengths, entries)) = image_j {
            let tags = image.encoder();
            tags.write_tag(Tag::Unknown(50838), lengths).expect("tag");
            tags.write_tag(Tag::Unknown(50839), entries).expect("tag");
        }
        image.write_data(&[page; 6]).expect("data");
    }
    bytes.into_inner()
}

fn loaded(bytes: &[u8]) -> Volume {
    Folder::new()
        .load(&[bytes])
        .unwrap_or_else(|error| panic!("{error}"))
}

fn refusal(bytes: &[u8]) -> String {
    Folder::new().refusal(&[bytes])
}

fn packings() -> [(&'static str, Compression); 4] {
    let deflate = Compression::Deflate(DeflateLevel::Balanced);
    [
        ("plain", Compression::Uncompressed),
        ("LZW", Compression::Lzw),
        ("deflate", deflate),
        ("PackBits", Compression::Packbits),
    ]
}

#[test]
fn every_type_and_packing_reads_back() {
    macro_rules! check {
        ($colour:ident, $stored:ty, $kind:ident, $held:ty) => {
            for (name, packing) in packings() {
                let volume = loaded(&stack::<colortype::$colour>(2, packing, |i| i as $stored));
                let expected = (0..12).map(|i| (10 * (i / 6) + i % 6) as $held).collect();
                assert_eq!(
                    (volume.dims, volume.voxels),
                    ([3, 2, 2], Voxels::$kind(expected)),
                    "{name}"
                );
            }
        };
    }
    check!(Gray8, u8, U8, u8);
    check!(GrayI8, i8, I8, i8);
    check!(Gray16, u16, U16, u16);
    check!(GrayI16, i16, I16, i16);
    check!(Gray32, u32, U32, u32);
    check!(GrayI32, i32, I32, i32);
    check!(Gray64, u64, F64, f64);
    check!(GrayI64, i64, F64, f64);
    check!(Gray32Float, f32, F32, f32);
    check!(Gray64Float, f64, F64, f64);
}

#[test]
fn colours_are_read() {
    for (name, packing) in packings() {
        let folder = Folder::new();
        let bytes = stack::<colortype::RGB8>(2, packing, |i| (7 * i) as u8);
        let path = folder.write("x", &[&bytes]);
        let colours = load_colours(&path, &LoadOptions::default())
            .expect("readable")
            .expect("colours");
        for (number, volume) in colours.components.iter().enumerate() {
            let value = |i: usize| (7 * (10 * (i / 6) + 3 * (i % 6) + number)) as u8;
            let expected = Voxels::U8((0..12).map(value).collect());
            assert_eq!(volume.voxels, expected, "{name}: component {number}");
        }
        // Blue is the greatest of values that rise.
        assert_eq!(
            colours.opacity.voxels, colours.components[2].voxels,
            "{name}"
        );
    }
    let folder = Folder::new();
    let bytes = stack::<colortype::RGBA16>(1, Compression::Lzw, |i| 300 * i as u16);
    let path = folder.write("x", &[&bytes]);
    let colours = load_colours(&path, &LoadOptions::default())
        .expect("readable")
        .expect("colours");
    let alpha = (0..6).map(|i| 300 * (4 * i + 3)).collect();
    assert_eq!(colours.opacity.voxels, Voxels::U16(alpha), "alpha varies");
    assert!(
        folder.refusal(&[&bytes]).contains("component=N"),
        "a number is wanted"
    );
}

#[test]
fn big_tiff_is_read_and_told_by_content() {
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new_big(&mut bytes).expect("encoder");
    encoder
        .write_image::<colortype::Gray8>(2, 1, &[7, 8])
        .expect("page");
    let folder = Folder::new();
    let path = folder.write("x", &[&bytes.into_inner()]);
    assert_eq!(format_of(&path).expect("readable"), Some(Format::Tiff));
    let volume = load(&path, &LoadOptions::default()).expect("one page");
    assert_eq!(
        (volume.dims, volume.voxels),
        ([2, 1, 1], Voxels::U8(vec![7, 8]))
    );
    assert_eq!(volume.up_hint.map(|up| up.y), Some(-1.0), "rows run down");
}

#[test]
fn notes_of_image_j_and_ome_give_the_spacing() {
    let spacing = |text: &str| loaded(&described(text)).spacing();
    assert_eq!(
        spacing("some text"),
        [1.0; 3],
        "resolution alone is for printers"
    );
    assert_eq!(
        spacing("ImageJ=1.53\nimages=2\nslices=2\nunit=micron\nspacing=2.5\n"),
        [0.25, 0.25, 2.5]
    );
    assert_eq!(
        spacing("ImageJ=1.53\nimages=2\nspacing=-2.5\n"),
        [1.0, 1.0, 2.5]
    );
    let ome = |sizes: &str| {
        format!(
            "<?xml version=\"1.0\"?><OME xmlns=\"o\"><Image><Pixels {sizes} PhysicalSizeX=\"0.5\" \
             PhysicalSizeY=\"0.6\" PhysicalSizeZ=\"2\"/></Image></OME>"
        )
    };
    assert_eq!(spacing(&ome("SizeC=\"1\" SizeT=\"1\"")), [0.5, 0.6, 2.0]);
    for (text, named) in [
        (
            ome("SizeC=\"2\" SizeT=\"1\""),
            "2 channels (0, 1): choose one with component=N",
        ),
        (
            ome("SizeC=\"3\" SizeT=\"1\""),
            "does not say where the others are",
        ),
        (
            "ImageJ=1.53\nimages=2\nchannels=2\n".to_owned(),
            "2 channels (0, 1): choose one",
        ),
        (
            "ImageJ=1.53\nimages=2\nchannels=3\n".to_owned(),
            "no multiple",
        ),
        (
            "ImageJ=1.53\nimages=3000\nslices=3000\n".to_owned(),
            "do not lie unpacked behind them",
        ),
        ("ImageJ=1.53\nspacing=0\n".to_owned(), "above 0"),
    ] {
        let text = refusal(&described(&text));
        assert!(text.contains(named), "{named}: {text}");
    }
}

/// The first voxel of each slice of a channel at a time.
fn slices_of(bytes: &[u8], component: Option<usize>, time: Option<usize>) -> Vec<f64> {
    let folder = Folder::new();
    let path = folder.write("stack.tif", &[bytes]);
    let options = LoadOptions {
        component,
        time,
        ..LoadOptions::default()
    };
    let volume = load(&path, &options).unwrap_or_else(|error| panic!("{error}"));
    (0..volume.dims[2]).map(|z| volume.value(6 * z)).collect()
}

fn axes(bytes: &[u8]) -> ImageAxes {
    let folder = Folder::new();
    let path = folder.write("stack.tif", &[bytes]);
    axes_of(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn channels_and_times_of_image_j_are_told_apart() {
    let text = "ImageJ=1.53\nimages=12\nchannels=2\nslices=3\nframes=2\nhyperstack=true\n";
    let mut entries = Vec::new();
    // The marks of a file whose bytes come with the smallest first.
    entries.extend_from_slice(b"JIJI");
    for (name, count) in [(b"gnar", 1u32), (b"stul", 2)] {
        entries.extend_from_slice(name);
        entries.extend_from_slice(&count.to_le_bytes());
    }
    let contents = entries.len() as u32;
    for end in [1.0f64, 200.0, 5.0, 5.0] {
        entries.extend_from_slice(&end.to_le_bytes());
    }
    for last in [[255u8, 0, 128], [0, 255, 0]] {
        entries.extend(
            last.iter()
                .flat_map(|&end| (0..=255u32).map(move |i| (i * u32::from(end) / 255) as u8)),
        );
    }
    let lengths = [contents, 32, 768, 768];
    let bytes = hyperstack(text, 12, Some((&lengths, &entries)));
    // Channels are fastest, then slices, then times.
    assert_eq!(slices_of(&bytes, Some(0), None), [0.0, 2.0, 4.0]);
    assert_eq!(slices_of(&bytes, Some(1), Some(1)), [7.0, 9.0, 11.0]);
    let axes = axes(&bytes);
    assert_eq!((axes.channels.len(), axes.times), (2, 2));
    let looks = axes
        .channels
        .iter()
        .map(|channel| (channel.rgb, channel.window));
    assert_eq!(
        looks.collect::<Vec<_>>(),
        [
            (Some([255, 0, 128]), Some([1.0, 200.0])),
            (Some([0, 255, 0]), None)
        ],
        "a window of no width is none"
    );
    let folder = Folder::new();
    let path = folder.write("stack.tif", &[&bytes]);
    let of = |time| LoadOptions {
        time,
        component: Some(0),
        ..LoadOptions::default()
    };
    let error = load(&path, &of(Some(2)))
        .expect_err("two times")
        .to_string();
    assert!(error.contains("2 point(s) in time"), "{error}");
    let first = of(None);
    load(&path, &first).expect("the first");
    assert!(first.gate.remarks()[0].contains("2 volumes over time"));
    let both = load_components(&path, &of(Some(1)), &[1, 0]).expect("both channels");
    assert_eq!([both[0].value(0), both[1].value(0)], [7.0, 6.0]);
    // Metadata that is cut off anywhere tells less, and breaks nothing.
    for length in 0..entries.len() {
        let bytes = hyperstack(text, 12, Some((&lengths, &entries[..length])));
        assert_eq!(slices_of(&bytes, Some(1), None), [1.0, 3.0, 5.0]);
    }
}

#[test]
fn channels_of_ome_have_names_and_colours_and_planes_their_order() {
    let text = |order: &str, planes: &str| {
        format!(
            "<OME><Image><Pixels SizeX=\"3\" SizeY=\"2\" SizeZ=\"2\" SizeC=\"3\" SizeT=\"2\" DimensionOrder=\"{order}\">\
             <Channel Name=\"DAPI\" Color=\"65535\"/><Channel Fluor=\"GFP\" Color=\"16711935\"/><Channel Color=\"-16776961\"/>{planes}\
             </Pixels></Image></OME>"
        )
    };
    let pages = |order: &str, planes: &str| hyperstack(&text(order, planes), 12, None);
    let known = axes(&pages("XYZCT", ""));
    let channels: Vec<_> = known
        .channels
        .iter()
        .map(|channel| (channel.name.as_deref(), channel.rgb))
        .collect();
    assert_eq!(
        channels,
        [
            (Some("DAPI"), Some([0, 0, 255])),
            (Some("GFP"), Some([0, 255, 0])),
            (None, Some([255, 0, 0]))
        ]
    );
    assert_eq!(known.times, 2);
    // Of channel 1 at time 1, by the sizes 2 of z, 3 of channels and 2 of times.
    for (order, expected) in [
        ("XYZCT", [8.0, 9.0]),
        ("XYCZT", [7.0, 10.0]),
        ("XYCTZ", [4.0, 10.0]),
        ("XYZTC", [6.0, 7.0]),
        ("XYTCZ", [3.0, 9.0]),
        ("XYTZC", [5.0, 7.0]),
    ] {
        let slices = slices_of(&pages(order, ""), Some(1), Some(1));
        assert_eq!(slices, expected, "{order}");
    }
    // Planes that are listed lie where the list says: the last six first.
    let listed =
        "<TiffData IFD=\"6\" PlaneCount=\"6\"/><TiffData FirstT=\"1\" IFD=\"0\" PlaneCount=\"6\"/>";
    assert_eq!(
        slices_of(&pages("XYZCT", listed), Some(1), Some(1)),
        [2.0, 3.0]
    );
    for (planes, named) in [
        ("<TiffData IFD=\"0\"/>", "has no page in this file"),
        (
            "<TiffData FirstC=\"3\" IFD=\"0\"/>",
            "which the image does not have",
        ),
        (
            "<TiffData IFD=\"18446744073709551615\" PlaneCount=\"18446744073709551615\"/>",
            "has no page in this file",
        ),
        (
            "<TiffData IFD=\"0\"><UUID>a</UUID></TiffData><TiffData IFD=\"1\"><UUID>b</UUID></TiffData>",
            "its planes lie in 2 files without names",
        ),
    ] {
        let refused = refusal(&pages("XYZCT", planes));
        assert!(refused.contains(named), "{named}: {refused}");
    }
}

#[test]
fn planes_of_ome_are_found_in_the_files_that_its_description_names() {
    let planes = "<TiffData FirstC=\"0\" IFD=\"0\" PlaneCount=\"2\"><UUID FileName=\"a.ome.tif\">urn:a</UUID></TiffData>\
         <TiffData FirstC=\"1\" IFD=\"1\"><UUID FileName=\"b.ome.tif\">urn:b</UUID></TiffData>\
         <TiffData FirstC=\"1\" FirstZ=\"1\" IFD=\"0\"><UUID FileName=\"b.ome.tif\">urn:b</UUID></TiffData>";
    let text = |planes: &str| {
        format!(
            "<OME UUID=\"urn:a\"><Image><Pixels SizeX=\"3\" SizeY=\"2\" SizeZ=\"2\" SizeC=\"2\" SizeT=\"1\" DimensionOrder=\"XYZCT\">\
             {planes}</Pixels></Image></OME>"
        )
    };
    let folder = Folder::new();
    let first = folder.write("a.ome.tif", &[&hyperstack(&text(planes), 2, None)]);
    // The others name the file that describes them.
    let binary =
        "<OME UUID=\"urn:b\"><BinaryOnly MetadataFile=\"a.ome.tif\" UUID=\"urn:a\"/></OME>";
    let second = folder.write("b.ome.tif", &[&hyperstack(binary, 2, None)]);
    let slices = |path: &std::path::Path, component: usize| -> Result<Vec<f64>, Error> {
        let options = LoadOptions {
            component: Some(component),
            ..LoadOptions::default()
        };
        let volume = load(path, &options)?;
        Ok((0..volume.dims[2]).map(|z| volume.value(6 * z)).collect())
    };
    for path in [&first, &second] {
        assert_eq!(slices(path, 0).expect("readable"), [0.0, 1.0]);
        assert_eq!(slices(path, 1).expect("readable"), [1.0, 0.0]);
    }
    // A companion file holds the text alone.
    folder.write("set.companion.ome", &[text(planes).as_bytes()]);
    let binary = binary.replace("a.ome.tif", "set.companion.ome");
    let second = folder.write("b.ome.tif", &[&hyperstack(&binary, 2, None)]);
    assert_eq!(slices(&second, 1).expect("readable"), [1.0, 0.0]);
    // A file that was renamed after it was written is still its own.
    let renamed =
        "<TiffData IFD=\"0\" PlaneCount=\"4\"><UUID FileName=\"old.tif\">urn:a</UUID></TiffData>";
    for text in [text(renamed), text(renamed).replace(" UUID=\"urn:a\"", "")] {
        let path = folder.write("new.tif", &[&hyperstack(&text, 4, None)]);
        assert_eq!(slices(&path, 1).expect("readable"), [2.0, 3.0]);
    }
    for (bad, named) in [
        ("b.ome.tif\">", "c.ome.tif\">"),
        ("b.ome.tif\">", "../b.ome.tif\">"),
        ("IFD=\"1\"", "IFD=\"7\""),
    ]
    .map(|(from, to)| (planes.replace(from, to), to))
    {
        let path = folder.write("d.ome.tif", &[&hyperstack(&text(&bad), 2, None)]);
        let refused = slices(&path, 1).expect_err(named).to_string();
        let expected = ["c.ome.tif", "points outside", "page 7 of a file of 2 pages"];
        assert!(
            expected.iter().any(|word| refused.contains(word)),
            "{named}: {refused}"
        );
    }
}

#[test]
fn images_of_image_j_without_directories_lie_behind_the_first() {
    let text = "ImageJ=1.53\nimages=4\nchannels=2\nslices=2\n";
    let mut bytes = hyperstack(text, 1, None);
    // Directories may stand behind the first image: a strip at the end of the file makes room for the others.
    let strip = u32::try_from(bytes.len()).expect("short");
    let offset = bytes
        .windows(8)
        .position(|entry| entry[..2] == 273u16.to_le_bytes() && entry[2..4] == 4u16.to_le_bytes())
        .expect("StripOffsets");
    bytes[offset + 8..][..4].copy_from_slice(&strip.to_le_bytes());
    bytes.extend((0..24).map(|i| i / 6 + 10));
    assert_eq!(slices_of(&bytes, Some(0), None), [10.0, 12.0]);
    assert_eq!(slices_of(&bytes, Some(1), None), [11.0, 13.0]);
    let refused = refusal(&bytes[..bytes.len() - 1]);
    assert!(refused.contains("ImageJ says 4 images"), "{refused}");
}

/// A folder with the slices 1, 2 and 10, each filled with its number.
fn folder_of_slices() -> (Folder, PathBuf) {
    let folder = Folder::new();
    for number in [10, 1, 2] {
        let bytes = stack::<colortype::Gray8>(1, Compression::Lzw, |_| number);
        folder.write(&format!("img{number}.tif"), &[&bytes]);
    }
    let path = folder.path("");
    (folder, path)
}

#[test]
fn slices_of_a_folder_or_a_pattern_are_in_natural_order() {
    let (folder, path) = folder_of_slices();
    folder.write("notes.txt", &[b"not a slice"]);
    folder.write(".hidden", &[b"MM\0*"]);
    assert_eq!(format_of(&path).expect("readable"), Some(Format::Tiff));
    for path in [path, folder.path("img*.tif"), folder.path("img*")] {
        let volume = load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(volume.dims, [3, 2, 3]);
        assert_eq!(
            [0, 6, 12].map(|index| volume.value(index)),
            [1.0, 2.0, 10.0],
            "{}",
            path.display()
        );
    }
    let two = load(&folder.path("img?.tif"), &LoadOptions::default()).expect("two of three");
    assert_eq!(two.dims, [3, 2, 2]);
    let none = load(&folder.path("no*.tif"), &LoadOptions::default()).expect_err("no file");
    assert!(none.to_string().contains("of this pattern"), "{none}");
}

#[test]
fn slices_that_differ_are_refused_by_name() {
    let (folder, path) = folder_of_slices();
    let refused = |bytes: Vec<u8>| {
        folder.write("img3.tif", &[&bytes]);
        load(&path, &LoadOptions::default())
            .expect_err("this slice differs")
            .to_string()
    };
    let text = refused(stack::<colortype::Gray16>(1, Compression::Lzw, |i| {
        i as u16
    }));
    assert!(
        text.contains("img3.tif") && text.contains("3x2 pixels of 16 bits"),
        "{text}"
    );
    assert!(
        refused(stack::<colortype::GrayI8>(1, Compression::Lzw, |i| i as i8))
            .contains("another number type")
    );
    assert!(
        refused(stack::<colortype::Gray8>(2, Compression::Lzw, |i| i as u8))
            .contains("2 pages, but it is one of")
    );
    let empty = Folder::new();
    let text = load(&empty.path(""), &LoadOptions::default())
        .expect_err("empty")
        .to_string();
    assert!(text.contains("a folder without slices"), "{text}");
}

#[test]
fn colours_of_printers_are_refused() {
    let inks = stack::<colortype::CMYK8>(1, Compression::Uncompressed, |i| i as u8);
    let error = Folder::new().load(&[&inks]).expect_err("colours");
    assert!(matches!(error, Error::Unsupported { .. }), "{error}");
    assert!(
        error.to_string().contains("convert the stack to grey"),
        "{error}"
    );
}

#[test]
fn forged_sizes_are_refused_before_memory_is_taken() {
    for (name, packing) in packings() {
        let file = stack::<colortype::Gray8>(1, packing, |i| i as u8);
        // The entries of a directory are 12 bytes: tag, type, count, value. Type 4 is a number of 32 bits.
        let mut forged = file.clone();
        for (tag, value) in [(257u16, 1_000_000_000u32), (278, 1_000_000_000)] {
            let is_entry = |at: &usize| {
                file[*at..*at + 2] == tag.to_le_bytes()
                    && file[*at + 4..*at + 8] == 1u32.to_le_bytes()
            };
            let entry = (8..file.len() - 12).find(is_entry).expect("the tag");
            forged[entry + 2..entry + 4].copy_from_slice(&4u16.to_le_bytes());
            forged[entry + 8..entry + 12].copy_from_slice(&value.to_le_bytes());
        }
        let text = refusal(&forged);
        // The encoder writes PackBits in one strip per row, which the decoder counts before anything else.
        let expected = if name == "PackBits" {
            "inconsistent sizes"
        } else {
            "the pages promise 3000000000 bytes"
        };
        assert!(text.contains(expected), "{name}: {text}");
    }
}

#[test]
fn damaged_files_are_refused_and_never_panic() {
    for (_, packing) in packings() {
        survive_damage(
            &stack::<colortype::Gray16>(2, packing, |i| i as u16),
            &LoadOptions::default(),
            700,
        );
    }
    survive_damage(
        &described("ImageJ=1.53\nimages=2\nunit=mm\nspacing=2\n"),
        &LoadOptions::default(),
        700,
    );
}

/// Width and height of the page that is packed by Zstandard.
const PACKED: [usize; 2] = [5, 4];

/// A strip or a tile of the page, packed by Zstandard: rows from `top` on. The numbers of a tile are differences.
fn zstandard_part(
    [width, rows]: [usize; 2],
    (top, is_tile): (usize, bool),
    value: impl Fn(usize, usize) -> u16,
) -> Vec<u8> {
    let mut part = Vec::new();
    for y in top..top + rows {
        let mut before = 0;
        for x in 0..width {
            let own = if x < PACKED[0] && y < PACKED[1] {
                value(x, y)
            } else {
                9
            };
            let stored = if is_tile {
                own.wrapping_sub(before)
            } else {
                own
            };
            part.extend(stored.to_le_bytes());
            before = own;
        }
    }
    let level = ruzstd::encoding::CompressionLevel::Fastest;
    ruzstd::encoding::compress_to_vec(part.as_slice(), level)
}

/// A directory with these entries: tag, count, and the number or its place. All are numbers of 32 bits.
fn directory(entries: &[(u16, u32, u32)]) -> Vec<u8> {
    let mut bytes = (entries.len() as u16).to_le_bytes().to_vec();
    for (tag, count, number) in entries {
        bytes.extend(tag.to_le_bytes());
        bytes.extend([4, 0]);
        bytes.extend(count.to_le_bytes());
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend([0; 4]);
    bytes
}

/// One page of numbers of 16 bits in two strips, or in one tile of this side.
fn zstandard_page(tile: Option<usize>, value: impl Fn(usize, usize) -> u16) -> Vec<u8> {
    let [width, height] = PACKED;
    let parts = match tile {
        Some(side) => vec![zstandard_part([side, side], (0, true), value)],
        None => {
            let strip = |top, rows| zstandard_part([width, rows], (top, false), &value);
            vec![strip(0, 3), strip(3, 1)]
        }
    };
    let mut bytes = b"II\x2a\0\0\0\0\0".to_vec();
    let (mut places, mut lengths) = (Vec::new(), Vec::new());
    for part in parts {
        places.push(bytes.len() as u32);
        lengths.push(part.len() as u32);
        bytes.extend(part);
    }
    bytes.resize(bytes.len().next_multiple_of(2), 0);
    let count = places.len() as u32;
    // One number stands in its entry, several stand elsewhere.
    let mut listed = |numbers: &[u32]| match numbers {
        [only] => *only,
        _ => {
            let place = bytes.len() as u32;
            bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
            place
        }
    };
    let [places, lengths] = [places, lengths].map(|numbers| listed(&numbers));
    let mut entries = vec![
        (256, 1, width as u32),
        (257, 1, height as u32),
        (258, 1, 16),
        (259, 1, 50000),
        (262, 1, 1),
    ];
    match tile.map(|side| side as u32) {
        Some(side) => entries.extend([
            (277, 1, 1),
            (317, 1, 2),
            (322, 1, side),
            (323, 1, side),
            (324, count, places),
            (325, count, lengths),
        ]),
        None => entries.extend([
            (273, count, places),
            (277, 1, 1),
            (278, 1, 3),
            (279, count, lengths),
        ]),
    }
    let place = bytes.len() as u32;
    bytes[4..8].copy_from_slice(&place.to_le_bytes());
    bytes.extend(directory(&entries));
    bytes
}

#[test]
fn pages_packed_by_zstandard_read_back() {
    let value = |x: usize, y: usize| (60_000 * (x % 2) + 1000 * y + x) as u16;
    let expected = (0..20).map(|at| value(at % 5, at / 5)).collect();
    let expected = Voxels::U16(expected);
    for tile in [None, Some(16)] {
        let bytes = zstandard_page(tile, value);
        let volume = loaded(&bytes);
        assert_eq!((volume.dims, &volume.voxels), ([5, 4, 1], &expected));
        survive_damage(&bytes, &LoadOptions::default(), 400);
    }
}
