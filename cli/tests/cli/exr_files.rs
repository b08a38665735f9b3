//! EXR files: their channels, and the stats beside them.

use exr::prelude::{AnyChannel, FlatSamples, ReadChannels, ReadLayers};

use super::good_runs::stats;
use super::{Bench, SIDE, assert_good, stderr};

/// The channels of `out/a.exr`.
fn channels(bench: &Bench) -> Vec<AnyChannel<FlatSamples>> {
    let read = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels();
    let read = read
        .first_valid_layer()
        .all_attributes()
        .from_file(bench.path("out/a.exr"))
        .expect("an EXR");
    read.layer_data.channel_data.list.to_vec()
}

#[test]
fn layers_are_channels_of_an_exr() {
    let bench = Bench::new();
    assert_good(&bench.draw("--size 16x16 -o out/a.exr --layers samples,first-hit,normal"));
    let channels = channels(&bench);
    let names: Vec<_> = channels
        .iter()
        .map(|channel| channel.name.to_string())
        .collect();
    let expected = [
        "A",
        "B",
        "G",
        "R",
        "Z",
        "depth.first",
        "normal.X",
        "normal.Y",
        "normal.Z",
        "samples",
    ];
    assert_eq!(names, expected, "channels");
    let middle = |channel: usize| {
        channels[channel]
            .sample_data
            .values_as_f32()
            .nth(8 * 16 + 8)
    };
    let (mean, first) = (middle(4).expect("a pixel"), middle(5).expect("a pixel"));
    assert!(
        first < mean,
        "the ball is met at {first}, before its mean depth {mean}"
    );
    let bench = Bench::new();
    for (words, complaint) in [
        (
            "-o out/a.png --layers normal",
            "--layers: only a name that ends in .exr",
        ),
        (
            "-o out/a.exr --layers normal,normal",
            "--layers: normal is named twice",
        ),
        ("-o out/a.exr --layers normal --select points", "--layers"),
        (
            "-o out/a.exr --layers normal --kernel gaussian --order image-sheets",
            "--layers",
        ),
    ] {
        let output = bench.draw(words);
        assert_eq!(
            output.status.code(),
            Some(2),
            "{words}: {}",
            stderr(&output)
        );
        assert!(
            stderr(&output).contains(complaint),
            "{words}: {}",
            stderr(&output)
        );
    }
    assert!(
        bench.written().is_empty(),
        "nothing is written: {:?}",
        bench.written()
    );
}

#[test]
fn exr_has_colour_and_depth_and_the_stats_count_every_voxel() {
    let bench = Bench::new();
    assert_good(&bench.draw(
        "--size 64x64 -o out/a.exr --stats out/s.json --threads 2 --kernel polynomial --cells off",
    ));
    assert_eq!(bench.written(), ["a.exr", "s.json"], "two files");
    let channels = channels(&bench);
    let names: Vec<_> = channels
        .iter()
        .map(|channel| channel.name.to_string())
        .collect();
    assert_eq!(names, ["A", "B", "G", "R", "Z"], "channels");
    let depth: Vec<f32> = channels[4].sample_data.values_as_f32().collect();
    assert!(depth[32 * 64 + 32].is_finite(), "the ball has a depth");
    assert_eq!(depth[0], f32::INFINITY, "nothing is infinitely far away");
    let stats = stats(&bench);
    let count = |key: &str| {
        stats[key]
            .as_u64()
            .unwrap_or_else(|| panic!("{key} in {stats}"))
    };
    assert_eq!(count("voxels"), (SIDE as u64).pow(3), "all voxels");
    assert!(
        count("non_transparent") > 0 && count("non_transparent") < count("voxels"),
        "some are seen"
    );
    assert_eq!(
        (
            count("threads"),
            &stats["settings"]["render"]["order"]["samples"]["kernel"]
        ),
        (2, &"polynomial".into()),
        "settings"
    );
    let frame = &stats["frames"][0];
    assert_eq!(
        (&frame["file"], &frame["width"]),
        (&"out/a.exr".into(), &64.into()),
        "frame"
    );
    assert_eq!(
        stats["settings"]["render"]["order"]["samples"]["order"], "every-sample",
        "the kernel is an option of that order"
    );
    let drawn: u64 = ["points", "splats", "culled", "hidden"]
        .iter()
        .filter_map(|key| frame[*key].as_u64())
        .sum();
    assert_eq!(
        drawn,
        count("non_transparent"),
        "each visible voxel is a point, a splat, culled or hidden"
    );
}
