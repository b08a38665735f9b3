//! Zarr: small stores of both versions, every compression and cut, written here and read back.

use std::path::Path;

use crate::input::test_files::{Dice, Folder, check_components, gzip, zip_archive, zlib};
use crate::input::{Format, ImageChannel, LoadOptions, axes_of, format_of, load, open_unread};
use crate::source::Region;
use crate::volume::{Volume, Voxels};

/// 3x4x5 voxels (z, y, x) in chunks of 2x3x4.
const SHAPE: [usize; 3] = [3, 4, 5];
const CHUNK: [usize; 3] = [2, 3, 4];

fn value(z: usize, y: usize, x: usize) -> u16 {
    (1000 * z + 100 * y + x) as u16
}

fn expected() -> Voxels {
    let places = (0..60).map(|i| (i / 20, i / 5 % 4, i % 5));
    Voxels::U16(places.map(|(z, y, x)| value(z, y, x)).collect())
}

/// The bytes of a chunk that begins at a voxel; what lies beyond the array is 7.
fn chunk(first: [usize; 3], size: [usize; 3]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for z in first[0]..first[0] + size[0] {
        for y in first[1]..first[1] + size[1] {
            for x in first[2]..first[2] + size[2] {
                let inside = z < SHAPE[0] && y < SHAPE[1] && x < SHAPE[2];
                bytes.extend(if inside { value(z, y, x) } else { 7 }.to_le_bytes());
            }
        }
    }
    bytes
}

fn write(path: &Path, bytes: &[u8]) {
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
    std::fs::write(path, bytes).expect("written");
}

/// Writes the chunks of an array, packed; `prefix` and `separator` make their names.
fn write_chunks(
    array: &Path,
    (prefix, separator): (&str, &str),
    pack: impl Fn(Vec<u8>) -> Vec<u8>,
) {
    for i in 0..8 {
        let index = [i >> 2, i >> 1 & 1, i & 1];
        let first = [
            index[0] * CHUNK[0],
            index[1] * CHUNK[1],
            index[2] * CHUNK[2],
        ];
        let name = format!(
            "{prefix}{}",
            index.map(|n: usize| n.to_string()).join(separator)
        );
        write(&array.join(name), &pack(chunk(first, CHUNK)));
    }
}

fn array_2(compressor: &str) -> String {
    format!(
        r#"{{"zarr_format": 2, "shape": [3,4,5], "chunks": [2,3,4], "dtype": "<u2", "order": "C", "filters": null,
            "fill_value": 0, "dimension_separator": "/", "compressor": {compressor}}}"#
    )
}

fn array_3(chunk: &str, codecs: &str) -> String {
    format!(
        r#"{{"zarr_format": 3, "node_type": "array", "shape": [3,4,5], "data_type": "uint16", "fill_value": 9,
            "chunk_grid": {{"name": "regular", "configuration": {{"chunk_shape": {chunk}}}}},
            "chunk_key_encoding": {{"name": "default"}}, "codecs": {codecs}}}"#
    )
}

const BYTES: &str = r#"{"name": "bytes", "configuration": {"endian": "little"}}"#;

/// A Blosc container of one block, by its flags; the block is packed by `pack`, after bytes were shuffled.
fn blosc(bytes: &[u8], flags: u8, pack: impl Fn(&[u8]) -> Vec<u8>) -> Vec<u8> {
    let count = bytes.len() / 2;
    let shuffled: Vec<u8> = (0..2)
        .flat_map(|byte| (0..count).map(move |i| bytes[2 * i + byte]))
        .collect();
    let block = pack(if flags & 1 == 1 { &shuffled } else { bytes });
    let mut out = vec![2, 1, flags, 2];
    let length = |n: usize| (n as u32).to_le_bytes();
    for n in [bytes.len(), bytes.len(), 16 + 4 + 4 + block.len()] {
        out.extend(length(n));
    }
    out.extend(length(20));
    out.extend(length(block.len()));
    out.extend(block);
    out
}

fn loaded(path: &Path) -> Volume {
    load(path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn differences_and_shuffled_bytes_are_undone() {
    let differences = |bytes: Vec<u8>| -> Vec<u8> {
        let own = bytes
            .chunks_exact(2)
            .map(|b| u16::from_le_bytes([b[0], b[1]]));
        let own: Vec<u16> = own.collect();
        let before = [0].into_iter().chain(own.clone());
        let steps = own
            .into_iter()
            .zip(before)
            .map(|(own, before)| own.wrapping_sub(before));
        steps.flat_map(u16::to_le_bytes).collect()
    };
    let shuffled = |bytes: Vec<u8>| -> Vec<u8> {
        let half = |at: usize| bytes.iter().skip(at).step_by(2).copied();
        half(0).chain(half(1)).collect()
    };
    let delta = r#"{"id": "delta", "dtype": "<u2", "astype": "<u2"}"#;
    let shuffle = r#"{"id": "shuffle", "elementsize": 2}"#;
    let list = |filters: &str| {
        let meta = array_2(r#"{"id": "zlib", "level": 1}"#);
        meta.replace("\"filters\": null", &format!("\"filters\": [{filters}]"))
    };
    type Pack<'a> = &'a dyn Fn(Vec<u8>) -> Vec<u8>;
    let cases: [(String, Pack); 3] = [
        (list(delta), &|bytes| zlib(&differences(bytes))),
        (list(shuffle), &|bytes| zlib(&shuffled(bytes))),
        (list(&format!("{delta}, {shuffle}")), &|bytes| {
            zlib(&shuffled(differences(bytes)))
        }),
    ];
    for (meta, pack) in cases {
        let folder = Folder::new();
        let array = folder.path("a.zarr");
        write(&array.join(".zarray"), meta.as_bytes());
        write_chunks(&array, ("", "/"), pack);
        assert_eq!(loaded(&array).voxels, expected(), "{meta}");
    }
    for (filters, part) in [
        (
            r#"{"id": "delta", "dtype": "<i4"}"#.to_owned(),
            "another type",
        ),
        (format!("{shuffle}, {delta}"), "filter 'delta'"),
        (
            r#"{"id": "shuffle", "elementsize": 0}"#.to_owned(),
            "0 bytes",
        ),
        (r#"{"id": "quantize"}"#.to_owned(), "'quantize'"),
    ] {
        let folder = Folder::new();
        let array = folder.path("a.zarr");
        write(&array.join(".zarray"), list(&filters).as_bytes());
        let complaint = load(&array, &LoadOptions::default())
            .expect_err(part)
            .to_string();
        assert!(complaint.contains(part), "{complaint}");
    }
}

#[test]
fn every_compression_of_version_2_reads_back() {
    type Pack = fn(Vec<u8>) -> Vec<u8>;
    let lz4: Pack = |bytes| blosc(&bytes, 1 | 1 << 5 | 16, lz4_flex::block::compress);
    let blosc_zlib: Pack = |bytes| blosc(&bytes, 3 << 5 | 16, zlib);
    let stored: Pack = |bytes| {
        [
            &[2, 1, 2, 2][..],
            &[48, 0, 0, 0, 48, 0, 0, 0, 64, 0, 0, 0],
            &bytes,
        ]
        .concat()
    };
    let plain_lz4: Pack =
        |bytes| [&48u32.to_le_bytes()[..], &lz4_flex::block::compress(&bytes)].concat();
    let cases: [(&str, Pack); 7] = [
        ("null", |bytes| bytes),
        (r#"{"id": "zlib", "level": 1}"#, |bytes| zlib(&bytes)),
        (r#"{"id": "gzip", "level": 1}"#, |bytes| gzip(&bytes)),
        (r#"{"id": "blosc", "cname": "lz4"}"#, lz4),
        (r#"{"id": "blosc", "cname": "zlib"}"#, blosc_zlib),
        (r#"{"id": "blosc", "cname": "lz4"}"#, stored),
        (r#"{"id": "lz4"}"#, plain_lz4),
    ];
    for (compressor, pack) in cases {
        let folder = Folder::new();
        let array = folder.path("a.zarr");
        write(&array.join(".zarray"), array_2(compressor).as_bytes());
        write_chunks(&array, ("", "/"), pack);
        assert_eq!(format_of(&array).expect("readable"), Some(Format::Zarr));
        let volume = loaded(&array);
        assert_eq!(
            (volume.dims, volume.voxels),
            ([5, 4, 3], expected()),
            "{compressor}"
        );
    }
}

#[test]
fn version_3_reads_back_and_absent_chunks_hold_the_fill_value() {
    let folder = Folder::new();
    let array = folder.path("a.zarr");
    write(
        &array.join("zarr.json"),
        array_3("[2,3,4]", &format!("[{BYTES}, {{\"name\": \"gzip\"}}]")).as_bytes(),
    );
    write_chunks(&array, ("c/", "/"), |bytes| gzip(&bytes));
    assert_eq!(loaded(&array).voxels, expected());
    std::fs::remove_file(array.join("c/1/1/1")).expect("there");
    let with_gap = loaded(&array);
    assert_eq!(
        (with_gap.value(59), with_gap.value(0)),
        (9.0, 0.0),
        "the last voxel is the fill value"
    );
}

/// The description of an array in one shard, whose bytes go through `outer` codecs as well, and the shard before those.
fn sharded(outer: &str) -> (String, Vec<u8>) {
    let sharding = format!(
        r#"[{{"name": "sharding_indexed", "configuration": {{"chunk_shape": [2,3,4], "codecs": [{BYTES}],
            "index_codecs": [{BYTES}, {{"name": "crc32c"}}]}}}}{outer}]"#
    );
    let (mut shard, mut index) = (Vec::new(), Vec::new());
    for i in 0..8usize {
        let part = chunk([i >> 2 << 1, (i >> 1 & 1) * 3, (i & 1) * 4], CHUNK);
        index.extend((shard.len() as u64).to_le_bytes());
        index.extend((part.len() as u64).to_le_bytes());
        shard.extend(part);
    }
    (
        array_3("[4,6,8]", &sharding),
        [shard, index, vec![0; 4]].concat(),
    )
}

/// A shard that was compressed as a whole is undone, but no further than a shard of this shape can be long.
#[test]
fn shards_that_were_compressed_as_a_whole_read_back_and_bombs_are_refused() {
    let folder = Folder::new();
    type Pack = fn(&[u8]) -> Vec<u8>;
    let outer: [(&str, &str, Pack); 3] = [
        ("gzip", r#", {"name": "gzip"}"#, gzip),
        (
            "twice",
            r#", {"name": "gzip"}, {"name": "gzip"}"#,
            |bytes| gzip(&gzip(bytes)),
        ),
        ("blosc", r#", {"name": "blosc"}"#, |bytes| {
            blosc(bytes, 1 | 1 << 5 | 16, lz4_flex::block::compress)
        }),
    ];
    for (name, codec, pack) in outer {
        let array = folder.path(name);
        let (meta, shard) = sharded(codec);
        write(&array.join("zarr.json"), meta.as_bytes());
        let place = array.join("c/0/0/0");
        write(&place, &pack(&shard));
        assert_eq!(loaded(&array).voxels, expected(), "{name}");
        write(&place, &pack(&vec![0; 1 << 26]));
        let refused = load(&array, &LoadOptions::default())
            .expect_err("64 MB of zeros")
            .to_string();
        assert!(
            refused.contains("at most") && refused.contains("c/0/0/0"),
            "{name}: {refused}"
        );
    }
}

#[test]
fn shards_and_transposed_chunks_read_back() {
    let folder = Folder::new();
    let array = folder.path("a.zarr");
    let (meta, shard) = sharded("");
    write(&array.join("zarr.json"), meta.as_bytes());
    write(&array.join("c/0/0/0"), &shard);
    assert_eq!(loaded(&array).voxels, expected(), "a shard");

    let transposed = folder.path("t.zarr");
    let codecs =
        format!(r#"[{{"name": "transpose", "configuration": {{"order": [2,1,0]}}}}, {BYTES}]"#);
    write(
        &transposed.join("zarr.json"),
        array_3("[3,4,5]", &codecs).as_bytes(),
    );
    let bytes: Vec<u8> = (0..60)
        .flat_map(|i: usize| value(i % 3, i / 3 % 4, i / 12).to_le_bytes())
        .collect();
    write(&transposed.join("c/0/0/0"), &bytes);
    assert_eq!(loaded(&transposed).voxels, expected(), "x slowest");
}

/// An image of two levels, two points in time and three channels; every voxel is 10 t + c, level 1 adds 100.
fn image(folder: &Folder) -> std::path::PathBuf {
    let image = folder.path("image.zarr");
    let scale = |s: &str| {
        format!(
            r#"[{{"type": "scale", "scale": {s}}}, {{"type": "translation", "translation": [0,0,4,2,1]}}]"#
        )
    };
    let attributes = format!(
        r#"{{"multiscales": [{{"version": "0.4", "axes": [{{"name": "t", "type": "time"}}, {{"name": "c", "type": "channel"}},
            {{"name": "z", "type": "space"}}, {{"name": "y", "type": "space"}}, {{"name": "x", "type": "space"}}],
            "datasets": [{{"path": "0", "coordinateTransformations": {}}}, {{"path": "1", "coordinateTransformations": {}}}]}}],
            "omero": {{"channels": [{{"label": "DAPI", "color": "0000FF", "window": {{"start": 1, "end": 9}}}},
            {{"label": "GFP", "color": "00ff80ff", "active": false}}, {{"label": "RFP", "color": "red"}}]}}}}"#,
        scale("[1,1,3,2,0.5]"),
        scale("[1,1,3,4,1]")
    );
    write(&image.join(".zgroup"), br#"{"zarr_format": 2}"#);
    write(&image.join(".zattrs"), attributes.as_bytes());
    for level in 0..2 {
        let meta = r#"{"zarr_format": 2, "shape": [2,3,1,2,2], "chunks": [1,1,1,2,2], "dtype": "|u1", "order": "C",
            "filters": null, "fill_value": 0, "compressor": null}"#;
        write(&image.join(format!("{level}/.zarray")), meta.as_bytes());
        for (t, c) in (0..6).map(|i| (i / 3, i % 3)) {
            let held = 100 * level + 10 * t + c;
            write(
                &image.join(format!("{level}/{t}.{c}.0.0.0")),
                &[held as u8; 4],
            );
        }
    }
    image
}

#[test]
fn level_channel_and_time_are_chosen() {
    let folder = Folder::new();
    let image = image(&folder);
    let choice = |level, component, time| {
        load(
            &image,
            &LoadOptions {
                level,
                component,
                time,
                ..LoadOptions::default()
            },
        )
    };
    let second = LoadOptions {
        time: Some(1),
        ..LoadOptions::default()
    };
    check_components(&image, &second, 3);
    let axes = axes_of(&image, &second).expect("readable");
    let channel = |name: &str, rgb, window, is_shown| ImageChannel {
        name: Some(name.to_owned()),
        rgb,
        window,
        is_shown,
    };
    let channels = vec![
        channel("DAPI", Some([0, 0, 255]), Some([1.0, 9.0]), true),
        channel("GFP", Some([0, 255, 128]), None, false),
        channel("RFP", None, None, true),
    ];
    assert_eq!((axes.channels, axes.times), (channels, 2));
    let volume = choice(None, Some(2), Some(1)).expect("chosen");
    assert_eq!(
        (volume.dims, volume.voxels),
        ([2, 2, 1], Voxels::U8(vec![12; 4]))
    );
    assert_eq!(
        volume.world_from_index.translation.to_array(),
        [1.0, 2.0, 4.0],
        "translation"
    );
    let spacing = volume.world_from_index.matrix3;
    assert_eq!(
        [spacing.x_axis.x, spacing.y_axis.y, spacing.z_axis.z],
        [0.5, 2.0, 3.0],
        "scale"
    );
    assert_eq!(
        choice(Some(1), Some(0), Some(0)).expect("chosen").voxels,
        Voxels::U8(vec![100; 4])
    );
    let text = |level, component, time| {
        choice(level, component, time)
            .expect_err("refused")
            .to_string()
    };
    assert!(
        text(None, None, Some(0)).contains("(0 DAPI, 1 GFP, 2 RFP)"),
        "{}",
        text(None, None, Some(0))
    );
    let first = choice(None, Some(2), None).expect("the first time");
    assert_eq!(first.voxels, Voxels::U8(vec![2; 4]));
    assert!(text(None, Some(3), Some(0)).contains("3 channel(s)"));
    assert!(text(Some(2), Some(0), Some(0)).contains("2 level(s)"));
}

#[test]
fn what_is_no_image_is_refused_with_a_way_out() {
    let folder = Folder::new();
    let group = folder.path("plate.zarr");
    write(
        &group.join("zarr.json"),
        br#"{"zarr_format": 3, "node_type": "group", "attributes": {}}"#,
    );
    let text = load(&group, &LoadOptions::default())
        .expect_err("no image")
        .to_string();
    assert!(text.contains("name one of its folders"), "{text}");
    let cases = [
        (array_2(r#"{"id": "snappy"}"#), "compressor 'snappy'"),
        (array_2("null").replace("<u2", "<f2"), "type 'f2'"),
        (
            array_2("null").replace("[3,4,5]", "[3,4]"),
            "as many numbers",
        ),
        (
            array_2("null").replace("[3,4,5]", "[60,80,100]"),
            "chunks are there",
        ),
        (
            array_2("null").replace("[2,3,4]", "[20000,30000,40000]"),
            "larger than",
        ),
        (
            array_2("null").replace("\"zarr_format\"", "zarr_format"),
            "not JSON",
        ),
    ];
    for (meta, expected) in cases {
        let array = folder.path("bad.zarr");
        write(&array.join(".zarray"), meta.as_bytes());
        write_chunks(&array, ("", "/"), |bytes| bytes);
        let text = load(&array, &LoadOptions::default())
            .expect_err("refused")
            .to_string();
        assert!(
            text.contains(expected) && text.contains("bad.zarr"),
            "{expected}: {text}"
        );
    }
    let short = folder.path("short.zarr");
    write(&short.join(".zarray"), array_2("null").as_bytes());
    write_chunks(&short, ("", "/"), |bytes| bytes[1..].to_vec());
    let text = load(&short, &LoadOptions::default())
        .expect_err("short")
        .to_string();
    assert!(text.contains("47 bytes, and its shape needs 48"), "{text}");
}

#[test]
fn damaged_chunks_are_refused_and_never_panic() {
    let folder = Folder::new();
    let array = folder.path("d.zarr");
    let pack = |bytes: Vec<u8>| blosc(&bytes, 1 | 1 << 5 | 16, lz4_flex::block::compress);
    write(
        &array.join(".zarray"),
        array_2(r#"{"id": "blosc"}"#).as_bytes(),
    );
    write_chunks(&array, ("", "/"), pack);
    let place = array.join("0/0/0");
    let good = std::fs::read(&place).expect("written");
    let mut dice = Dice::new(1);
    let mut refused = 0;
    for _ in 0..500 {
        let mut bad = good.clone();
        match dice.below(2) {
            0 => bad.truncate(dice.below(good.len())),
            _ => bad[dice.below(good.len())] = dice.below(256) as u8,
        }
        write(&place, &bad);
        refused += usize::from(load(&array, &LoadOptions::default()).is_err());
    }
    assert!(
        refused > 200,
        "damage is noticed: {refused} of 500 were refused"
    );
}

/// The files below a folder as members of an archive, in a folder of that name.
fn zipped(store: &Path, within: &str) -> Vec<u8> {
    let mut members = Vec::new();
    let mut folders = vec![store.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let below = path.strip_prefix(store).expect("inside");
            let name = format!("{within}{}", below.to_string_lossy().replace('\\', "/"));
            members.push((name, std::fs::read(&path).expect("a file")));
        }
    }
    members.sort();
    zip_archive(&members)
}

#[test]
fn an_archive_is_read_as_the_folder_that_it_was_made_of() {
    let folder = Folder::new();
    let image = image(&folder);
    let options = LoadOptions {
        level: Some(1),
        component: Some(2),
        time: Some(1),
        ..LoadOptions::default()
    };
    let expected = load(&image, &options).unwrap_or_else(|error| panic!("{error}"));
    for (name, within) in [("a.ozx", ""), ("a.zarr.zip", ""), ("b.ZIP", "image.zarr/")] {
        let bytes = zipped(&image, within);
        let path = folder.write(name, &[&bytes]);
        assert_eq!(format_of(&path).expect("readable"), Some(Format::Zarr));
        let got = load(&path, &options).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((got.dims, &got.voxels), (expected.dims, &expected.voxels));
        assert_eq!(got.world_from_index, expected.world_from_index);
        let unread = open_unread(&path, &options, 1 << 20, &mut |_| {}).expect("readable");
        let source = unread.expect("in chunks").source;
        let whole = Region {
            first: [0; 3],
            size: got.dims,
        };
        assert_eq!(source.read(&whole).expect("unpacked"), got.voxels);
        // Cut off or damaged, it is refused, and nothing panics.
        for end in (0..bytes.len()).step_by(37) {
            let cut = folder.write("cut.ozx", &[&bytes[..end]]);
            assert!(load(&cut, &options).is_err(), "{end} of {}", bytes.len());
        }
    }
    // Another archive is told to be unpacked.
    let other = zip_archive(&[("note.txt", b"text".to_vec())]);
    let path = folder.write("other.zip", &[&other]);
    let refused = load(&path, &options).expect_err("no volume").to_string();
    assert!(refused.contains("unpack"), "{refused}");
}
