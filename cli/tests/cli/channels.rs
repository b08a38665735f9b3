//! Images of several channels, as microscopes write them: all are drawn at once, as the file says, or as they are typed.

use serde_json::{Value, json};

use super::bad_input::assert_refused;
use super::{Bench, assert_good, read_png};

/// An OME-Zarr image of 8x8x8 voxels, two times and as many channels as `omero` describes. Channel c is a slab of 2 voxels from x = 2c on, whose
/// value is 100 at time 0 and 50 at time 1, over a background of 10.
pub(super) fn image(bench: &Bench, omero: &Value) {
    let channels = omero.as_array().expect("channels").len();
    let axes = ["t", "c", "z", "y", "x"].map(|name| match name {
        "t" => json!({ "name": name, "type": "time" }),
        "c" => json!({ "name": name, "type": "channel" }),
        _ => json!({ "name": name, "type": "space" }),
    });
    let scale = json!([{ "type": "scale", "scale": [1, 1, 1, 1, 1] }]);
    let group = json!({
        "multiscales": [{ "version": "0.4", "axes": axes, "datasets": [{ "path": "0", "coordinateTransformations": scale }] }],
        "omero": { "channels": omero },
    });
    let array = json!({ "zarr_format": 2, "shape": [2, channels, 8, 8, 8], "chunks": [1, 1, 8, 8, 8], "dtype": "|u1", "order": "C",
        "filters": null, "fill_value": 0, "compressor": null });
    std::fs::create_dir_all(bench.path("cells.zarr/0")).expect("a folder");
    bench.write("cells.zarr/.zgroup", br#"{"zarr_format": 2}"#);
    bench.write("cells.zarr/.zattrs", group.to_string().as_bytes());
    bench.write("cells.zarr/0/.zarray", array.to_string().as_bytes());
    for (time, channel) in (0..2 * channels).map(|i| (i / channels, i % channels)) {
        let voxel = |i: usize| {
            let is_inside = (i % 8) / 2 == channel;
            if is_inside { [100, 50][time] } else { 10 }
        };
        let voxels: Vec<u8> = (0..512).map(voxel).collect();
        bench.write(&format!("cells.zarr/0/{time}.{channel}.0.0.0"), &voxels);
    }
}

/// Three channels: red, green, and one of no colour that is switched off.
pub(super) fn three() -> Value {
    let window = json!({ "start": 20, "end": 100 });
    json!([
        { "label": "DAPI", "color": "FF0000", "window": window },
        { "label": "GFP", "color": "00FF00", "window": window },
        { "label": "488", "active": false },
    ])
}

/// Draws along z, and gives the colours in the middles of the four slabs.
fn colours(bench: &Bench, words: &str) -> [[u8; 4]; 4] {
    let camera = r#"{"position": [3.5, 3.5, 40], "target": [3.5, 3.5, 3.5], "up": [0, 1, 0], "projection": "orthographic", "height": 8}"#;
    bench.write("front.json", camera.as_bytes());
    assert_good(&bench.run(&format!(
        "volsplat cells.zarr -o out/a.png --size 64x64 --camera front.json {words}"
    )));
    let (width, _, rgba) = read_png(&bench.path("out/a.png"));
    [0, 1, 2, 3].map(|slab| {
        let (x, y) = (8 + 16 * slab, 32);
        let at = 4 * (y * width as usize + x);
        [0, 1, 2, 3].map(|k| rgba[at + k])
    })
}

#[test]
fn all_channels_are_drawn_as_the_file_says() {
    let bench = Bench::new();
    image(&bench, &three());
    let drawn = colours(&bench, "");
    // Full colour at the window's end; the slab of the channel that is off and the background show nothing.
    assert_eq!(drawn, [[255, 0, 0, 255], [0, 255, 0, 255], [0; 4], [0; 4]]);
    let picture = bench.path("out/a.png");
    let first = std::fs::read(&picture).expect("a picture");
    colours(&bench, "--channel dapi --channel 1");
    assert_eq!(
        std::fs::read(&picture).expect("a picture"),
        first,
        "by name and number"
    );
    colours(
        &bench,
        "--channel 0:#ff0000:20,100 --channel GFP:#00ff00:20,100:gamma=1:opacity=1 --channel 2:blue:opacity=0",
    );
    assert_eq!(
        std::fs::read(&picture).expect("a picture"),
        first,
        "as they are described, one of them hidden"
    );
    // Half the window is half the display code at gamma 1: of 50 at time 1, 30/80 of 255.
    let [red, ..] = colours(&bench, "--channel 0 --background black");
    assert_eq!(red, [255, 0, 0, 255]);
    bench.write("later", b"");
    let later = {
        let words = "volsplat cells.zarr#time=1 -o out/b.png --size 64x64 --camera front.json --channel 0 --background black";
        assert_good(&bench.run(words));
        let (width, _, rgba) = read_png(&bench.path("out/b.png"));
        rgba[4 * (32 * width as usize + 8)]
    };
    assert!(
        (i32::from(later) - 96).abs() <= 1,
        "{later}: 30/80 of 255 is 95.6"
    );
}

#[test]
fn channels_take_colour_window_gamma_and_opacity_and_add_up() {
    let bench = Bench::new();
    image(&bench, &three());
    // A name that is a number counts where there is no such channel.
    let [_, _, blue, _] = colours(&bench, "--channel 488:blue:0,100");
    assert_eq!(blue, [0, 0, 255, 255]);
    // 10 of 0 to 40 at gamma 0.5 is half the code; channels add up.
    let words = "--channel 0:red:0,40:gamma=0.5 --channel 1:blue:0,40:gamma=0.5 --background black";
    let drawn = colours(&bench, words);
    let half = |code: u8| (i32::from(code) - 128).abs() <= 1;
    assert!(drawn[0][0] == 255 && half(drawn[0][2]), "{drawn:?}");
    assert!(half(drawn[1][0]) && drawn[1][2] == 255, "{drawn:?}");
    assert!(half(drawn[3][0]) && half(drawn[3][2]), "{drawn:?}");
    // Light, or another blend, draws them with depth.
    for words in ["--shade phong", "--blend emission", "--occlusion"] {
        let [red, ..] = colours(&bench, words);
        assert!(red[0] > 40 && red[1] == 0 && red[3] > 0, "{words}: {red:?}");
    }
}

#[test]
fn what_needs_one_channel_says_which_there_are() {
    let bench = Bench::new();
    image(&bench, &three());
    let to = "cells.zarr -o out/a.png --size 64x64";
    for (words, named) in [
        ("--preset flame", "0 DAPI, 1 GFP, 2 488"),
        ("--iso 50", "cells.zarr#component=N"),
        ("--labels", "3 channels"),
        ("--channel CY5", "a name: 0 DAPI, 1 GFP, 2 488"),
        ("--channel 3", "from 0 to 2"),
        ("--channel 0:nonsense", "expected the look of a channel"),
        ("--channel 0:red:9,1", "the smaller one first"),
        ("--channel 0:red:gamma=0", "gamma"),
        ("--channel 0:red:opacity=2", "expected 0 to 1"),
        ("--channel 0:labels:1,2", "take no window"),
        ("--channel 0 --max-memory 100", "memory"),
    ] {
        assert_refused(&bench, &format!("volsplat {to} {words}"), named);
    }
    assert_good(&bench.run(&format!(
        "volsplat {}",
        to.replace("zarr", "zarr#component=0,time=1")
    )));
    assert_good(&bench.run(&format!(
        "volsplat {} --preset flame",
        to.replace("zarr", "zarr#component=0")
    )));
    let said = bench.run("info cells.zarr --json");
    let facts: Value = serde_json::from_slice(&said.stdout).expect("JSON");
    assert_eq!(facts["times"], 2);
    assert_eq!(
        facts["channels"][0],
        json!({ "name": "DAPI", "colour": "#ff0000", "window": [20.0, 100.0], "shown": true })
    );
    assert_eq!(facts["channels"][2]["shown"], false);
}

/// An OME-TIFF of 16 slices of 16x16 pixels in two channels, DAPI and GFP: a ball in each, one beside the other.
pub(super) fn ome_tiff() -> Vec<u8> {
    const SIDE: usize = 16;
    let text = "<OME><Image><Pixels SizeX=\"16\" SizeY=\"16\" SizeZ=\"16\" SizeC=\"2\" SizeT=\"1\" DimensionOrder=\"XYZCT\">\
                <Channel Name=\"DAPI\" Color=\"65535\"/><Channel Name=\"GFP\" Color=\"16711935\"/></Pixels></Image></OME>\0";
    let mut file = b"II*\0".to_vec();
    let text_at = 8 + 32 * SIDE * SIDE;
    let tables_at = (text_at + text.len()).next_multiple_of(2);
    let table_bytes = 2 + 9 * 12 + 4;
    file.extend((tables_at as u32).to_le_bytes());
    for (channel, z) in (0..2 * SIDE).map(|page| (page / SIDE, page % SIDE)) {
        for (x, y) in (0..SIDE * SIDE).map(|i| (i % SIDE, i / SIDE)) {
            let centre = [5.0, 10.0][channel];
            let offset = [x as f64 - centre, y as f64 - 7.5, z as f64 - 7.5];
            let radius = offset.iter().map(|d| d * d).sum::<f64>().sqrt();
            file.push(if radius < 5.0 { 200 } else { 10 });
        }
    }
    file.extend(text.bytes());
    file.resize(tables_at, 0);
    for page in 0..2 * SIDE {
        let text_tag = if page == 0 {
            (270, 2, text.len(), text_at)
        } else {
            (270, 2, 4, 0)
        };
        let tags = [
            (256, 4, 1, SIDE),
            (257, 4, 1, SIDE),
            (258, 3, 1, 8),
            (259, 3, 1, 1),
            (262, 3, 1, 1),
            text_tag,
            (273, 4, 1, 8 + page * SIDE * SIDE),
            (278, 4, 1, SIDE),
            (279, 4, 1, SIDE * SIDE),
        ];
        file.extend((tags.len() as u16).to_le_bytes());
        for (tag, kind, count, value) in tags {
            file.extend((tag as u16).to_le_bytes());
            file.extend((kind as u16).to_le_bytes());
            file.extend((count as u32).to_le_bytes());
            file.extend((value as u32).to_le_bytes());
        }
        let next = tables_at + (page + 1) * table_bytes;
        file.extend((if page + 1 < 2 * SIDE { next as u32 } else { 0 }).to_le_bytes());
    }
    file
}
