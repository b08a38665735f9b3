//! Small pictures of many files, and the sheet of them.

use super::{Bench, assert_good, read_png, stderr};

#[test]
fn every_file_has_a_thumbnail_and_faults_come_at_the_end() {
    let bench = Bench::new();
    bench.write("cells.ome.tif", &super::channels::ome_tiff());
    bench.write(
        "square.obj",
        b"v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n",
    );
    bench.write("broken.nrrd", b"NRRD0004\ntype: short\n");
    std::fs::create_dir_all(bench.path("b")).expect("a folder");
    bench.write("b/square.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let files = "cells.ome.tif square.obj b/square.obj";
    assert_good(&bench.run(&format!("thumbnails {files} -o out/a --size 64")));
    let shown = |name: &str| {
        let (width, height, rgba) = read_png(&bench.path(name));
        assert_eq!((width, height), (64, 64), "{name}");
        rgba.chunks(4).filter(|pixel| pixel[3] > 0).count()
    };
    for name in ["cells.ome.tif.png", "square.obj.png", "b-square.obj.png"] {
        assert!(shown(&format!("out/a/{name}")) > 300, "{name}");
    }
    let (width, height, _) = read_png(&bench.path("out/a/contact-sheet.png"));
    assert_eq!((width, height), (11 + 2 * 75, 11 + 2 * 97));
    // As the file's own command draws it.
    assert_good(&bench.run("square.obj -o out/alone.png --size 64x64"));
    assert!(
        read_png(&bench.path("out/alone.png")) == read_png(&bench.path("out/a/square.obj.png"))
    );
    // Options behind two dashes are those of that command.
    let turned = "square.obj -o out/c --size 64 -- --orbit 60,0 --shade unlit";
    assert_good(&bench.run(&format!("thumbnails {turned}")));
    let alone = "square.obj -o out/turned.png --size 64x64 --orbit 60,0 --shade unlit";
    assert_good(&bench.run(alone));
    assert!(
        read_png(&bench.path("out/turned.png")) == read_png(&bench.path("out/c/square.obj.png"))
    );
    let done =
        bench.run("thumbnails broken.nrrd square.obj absent.vti -o out/b --size 64 --columns 1");
    assert_eq!(done.status.code(), Some(1));
    let said = stderr(&done);
    assert!(
        said.contains("wrote 1 thumbnails") && said.contains("2 of 3 files"),
        "{said}"
    );
    assert!(
        said.contains("broken.nrrd: ") && said.contains("absent.vti: "),
        "{said}"
    );
    assert!(bench.path("out/b/square.obj.png").exists());
}
