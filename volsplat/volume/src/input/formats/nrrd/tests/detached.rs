//! Detached data: single files, lists, series, and what is skipped before the data.

use crate::Error;
use crate::input::formats::nrrd::tests::{Folder, bzip2, gzip};
use crate::input::{LoadOptions, load};
use crate::volume::Voxels;

const HEAD: &str = "NRRD0005\ntype: uint8\ndimension: 3\nsizes: 2 1 2\n";

fn voxels(folder: &Folder, fields: &str) -> Voxels {
    let path = folder.write("test.nhdr", &[HEAD.as_bytes(), fields.as_bytes()]);
    load(&path, &LoadOptions::default())
        .unwrap_or_else(|error| panic!("{fields}: {error}"))
        .voxels
}

fn refusal(folder: &Folder, fields: &str) -> Error {
    let path = folder.write("test.nhdr", &[HEAD.as_bytes(), fields.as_bytes()]);
    load(&path, &LoadOptions::default()).expect_err("this header must be refused")
}

#[test]
fn one_file_relative_or_absolute() {
    let folder = Folder::new();
    let data = folder.write("my data.raw", &[&[1, 2, 3, 4]]);
    let expected = Voxels::U8(vec![1, 2, 3, 4]);
    assert_eq!(
        voxels(&folder, "encoding: raw\ndata file: my data.raw\n"),
        expected
    );
    assert_eq!(
        voxels(&folder, "encoding: raw\ndatafile: ./my data.raw\n\nignored"),
        expected
    );
    assert_eq!(
        voxels(
            &folder,
            &format!("encoding: raw\ndata file: {}", data.display())
        ),
        expected
    );
}

#[test]
fn lines_and_bytes_are_skipped_before_or_behind_the_packing() {
    let folder = Folder::new();
    let expected = Voxels::U8(vec![1, 2, 3, 4]);
    folder.write("skip.raw", &[b"one\ntwo\nxy", &[1, 2, 3, 4]]);
    assert_eq!(
        voxels(
            &folder,
            "encoding: raw\nline skip: 2\nbyte skip: 2\ndata file: skip.raw\n"
        ),
        expected
    );
    assert_eq!(
        voxels(
            &folder,
            "encoding: raw\nbyteskip: -1\ndata file: skip.raw\n"
        ),
        expected
    );
    folder.write("skip.gz", &[b"one\n", &gzip(&[9, 9, 1, 2, 3, 4])]);
    assert_eq!(
        voxels(
            &folder,
            "encoding: gzip\nlineskip: 1\nbyte skip: 2\ndata file: skip.gz\n"
        ),
        expected,
        "lines are skipped before unpacking, bytes after it"
    );
    folder.write("skip.bz2", &[&bzip2(&[9, 9, 1, 2, 3, 4])]);
    assert_eq!(
        voxels(
            &folder,
            "encoding: bzip2\nbyte skip: 2\ndata file: skip.bz2\n"
        ),
        expected
    );
    folder.write("skip.txt", &[b"a title\n1 2 3 4\n"]);
    assert_eq!(
        voxels(
            &folder,
            "encoding: text\nline skip: 1\ndata file: skip.txt\n"
        ),
        expected
    );
    let text = refusal(
        &folder,
        "encoding: raw\nline skip: 9\ndata file: skip.txt\n",
    )
    .to_string();
    assert!(text.contains("there are only 2 lines"), "{text}");
    let text = refusal(
        &folder,
        "encoding: bzip2\nbyte skip: 99\ndata file: skip.bz2\n",
    )
    .to_string();
    assert!(text.contains("unpacked data has 6 bytes"), "{text}");
}

#[test]
fn lists_and_series_are_joined_in_order() {
    let folder = Folder::new();
    folder.write("a.raw", &[&[1, 2]]);
    folder.write("b 2.raw", &[&[3, 4]]);
    let expected = Voxels::U8(vec![1, 2, 3, 4]);
    assert_eq!(
        voxels(&folder, "encoding: raw\ndata file: LIST\na.raw\nb 2.raw\n"),
        expected
    );
    assert_eq!(
        voxels(
            &folder,
            "encoding: raw\ndata file: LIST 3\r\na.raw\r\nb 2.raw\r\n"
        ),
        expected
    );
    folder.write("s 010.gz", &[&gzip(&[1, 2])]);
    folder.write("s 008.gz", &[&gzip(&[3, 4])]);
    assert_eq!(
        voxels(&folder, "encoding: gzip\ndata file: s %03d.gz 10 8 -2\n"),
        expected
    );
    assert_eq!(
        voxels(&folder, "encoding: gzip\ndata file: s %03d.gz 10 8 -2 2\n"),
        expected
    );
    folder.write("n9.raw", &[&[1, 2]]);
    folder.write("n10.raw", &[&[3, 4]]);
    assert_eq!(
        voxels(&folder, "encoding: raw\ndata file: n%d.raw 9 10 1 1\n"),
        expected
    );
}

#[test]
fn faulty_data_files_are_refused_by_name() {
    let folder = Folder::new();
    folder.write("a.raw", &[&[1, 2]]);
    let error = refusal(&folder, "encoding: raw\ndata file: absent.raw\n");
    assert!(
        matches!(&error, Error::Read { path, .. } if path.ends_with("absent.raw")),
        "{error}"
    );
    let cases = [
        (
            "encoding: raw\ndata file: a.raw\n",
            "a.raw: 4 values of u8 need 4 bytes after skipping 0, there are 2",
        ),
        (
            "encoding: raw\ndata file: LIST\na.raw\n",
            "names 1 files of dimension 2",
        ),
        (
            "encoding: raw\ndata file: LIST 4\na.raw\n",
            "must be 1 to 3",
        ),
        ("encoding: raw\ndata file: x%03d 1 9 1\n", "names 9 files"),
        (
            "encoding: raw\ndata file: x%03d 1 2000000000 1\n",
            "at most 100000",
        ),
        ("encoding: raw\ndata file: x%03d 1 9 0\n", "never reaches"),
        ("encoding: raw\ndata file: x%03d 9 1 2\n", "never reaches"),
        (
            "encoding: raw\ndata file: x%s 1 2 1\n",
            "expected one such as %03d",
        ),
        (
            "encoding: raw\ndata file: x%0999999999d 1 2 1\n",
            "expected one such as %03d",
        ),
        ("encoding: raw\ndata file:\n", "expected a file name"),
    ];
    for (fields, expected) in cases {
        let text = refusal(&folder, fields).to_string();
        assert!(text.contains(expected), "{fields}: {text}");
    }
}
