//! Volumes larger than memory: the picture of a volume that stays in its file is that of the volume in memory, to the bit,
//! and what the work holds at once stays within what was allowed, by its own account.

mod scene;

use glam::DVec3;
use resample_tests::choices::with_field;
use resample_tests::volumes::scenes::{perspective, transfer};
use std::ops::Range;
use std::path::Path;
use volsplat::{
    Blend, Clip, ClipPlane, DepthPlane, Described, Error, GradientOpacity, Histogram, Isosurface,
    LargeVolume, LoadOptions, NanPolicy, RawOptions, RenderOptions, Renderer, Shading,
    TransferFunction, VoxelType, load,
};

use scene::{BUDGET, DIMS, Scene, bits, cameras, dense, middle, open, places, scene, value, write};

/// Renders these views in memory and from the file; returns what the last frame from the file read.
fn compare(
    scene: &Scene,
    options: &RenderOptions,
    transfer: &TransferFunction,
    views: Range<usize>,
) -> u64 {
    let volume = load(&scene.path, &scene.options).expect("a valid file");
    let mut memory = Renderer::new(&volume, transfer, options).expect("valid options");
    let large = open(scene, BUDGET);
    let mut stored =
        Renderer::from_file(&large, transfer, options, &mut |_| {}).expect("valid options");
    assert_eq!(
        memory.non_transparent(),
        stored.non_transparent(),
        "visible voxels"
    );
    assert_eq!(
        memory.visible_bounds_in_world(),
        stored.visible_bounds_in_world(),
        "framing"
    );
    let mut read = 0;
    for &(name, camera) in &cameras()[views] {
        let expected = memory.render(&camera).expect("a valid camera");
        let got = stored.render(&camera).expect("a valid camera");
        assert!(
            expected.image.rgba.iter().any(|p| p[3] > 0.1),
            "{name}: the picture is empty"
        );
        assert!(
            bits(&expected.image) == bits(&got.image),
            "{name}: the picture differs from the one in memory"
        );
        let held = got.stats.resident_bytes;
        assert!(
            held > 0 && held <= BUDGET,
            "{name}: {held} bytes were held of {BUDGET}"
        );
        read = got.stats.bricks_read;
    }
    read
}

#[test]
fn the_picture_is_that_of_the_volume_in_memory() {
    let options = RenderOptions {
        depth: DepthPlane::Expected,
        ..RenderOptions::default()
    };
    assert!(
        compare(&scene(), &options, &dense(), 0..7) > 0,
        "nothing was read from the file"
    );
}

#[test]
fn shaded_and_clipped_pictures_agree_too() {
    let planes = vec![ClipPlane {
        normal: DVec3::new(0.3, -0.2, 1.0),
        offset: 50.0,
    }];
    let clip = Clip {
        planes,
        ..Clip::default()
    };
    let options = RenderOptions {
        shading: Shading::Phong,
        clip,
        ..RenderOptions::default()
    };
    compare(&scene(), &options, &dense(), 4..6);
}

#[test]
fn statistics_of_rays_and_surfaces_agree_too() {
    let planes = vec![ClipPlane {
        normal: DVec3::new(0.3, -0.2, 1.0),
        offset: 50.0,
    }];
    let clip = Clip {
        planes,
        ..Clip::default()
    };
    // The least of most rays is next to nothing, and seen too.
    let all = transfer(
        &[(0.0, [0.2, 0.4, 1.0]), (4000.0, [1.0, 0.3, 0.1])],
        &[(0.0, 0.3), (4000.0, 0.9)],
    );
    let surface = |opacity| {
        Blend::Isosurface(Isosurface {
            value: 2000.0,
            colour: None,
            opacity,
        })
    };
    for blend in [
        Blend::Maximum,
        Blend::Minimum,
        Blend::Average,
        surface(1.0),
        surface(0.4),
    ] {
        let shading = if matches!(blend, Blend::Isosurface(_)) {
            Shading::Lambert
        } else {
            Shading::None
        };
        let options = with_field(
            RenderOptions {
                shading,
                clip: clip.clone(),
                ..RenderOptions::default()
            },
            |field| field.blend = blend,
        );
        let read = compare(&scene(), &options, &all, 4..6);
        assert!(read > 0, "{blend:?}: nothing was read from the file");
    }
}

#[test]
fn opacity_by_the_gradient_agrees_too() {
    let options = RenderOptions {
        gradient_opacity: Some(GradientOpacity::ramp(50.0, 400.0)),
        ..RenderOptions::default()
    };
    compare(&scene(), &options, &dense(), 2..4);
}

#[test]
fn bricks_behind_opaque_tiles_are_not_read() {
    let scene = scene();
    let wall = transfer(&[(0.0, [0.5; 3])], &[(0.0, 0.99), (4000.0, 0.99)]);
    let large = open(&scene, BUDGET);
    let options = RenderOptions::default();
    let mut stored =
        Renderer::from_file(&large, &wall, &options, &mut |_| {}).expect("valid options");
    let front = perspective(
        middle() - DVec3::new(0.0, 0.0, 500.0),
        middle(),
        40.0,
        [64, 64],
    );
    let stats = stored.render(&front).expect("a valid camera").stats;
    let all = DIMS
        .map(|n| (n - 1).div_ceil(8) as u64)
        .iter()
        .product::<u64>();
    assert!(
        stats.bricks * 3 < all,
        "{} of {all} bricks were looked at, of which the front hides most",
        stats.bricks
    );
    assert!(
        stats.bricks_read <= stats.bricks,
        "more was read than looked at"
    );
}

#[test]
fn what_fits_stays_in_memory() {
    let scene = scene();
    let sparse = transfer(&[(0.0, [0.5; 3])], &[(3700.0, 0.0), (4000.0, 0.5)]);
    let large = open(&scene, BUDGET);
    let options = RenderOptions::default();
    let mut stored =
        Renderer::from_file(&large, &sparse, &options, &mut |_| {}).expect("valid options");
    let volume = load(&scene.path, &scene.options).expect("a valid file");
    let mut memory = Renderer::new(&volume, &sparse, &options).expect("valid options");
    let (_, camera) = cameras()[0];
    let (expected, got) = (
        memory.render(&camera).expect("valid"),
        stored.render(&camera).expect("valid"),
    );
    assert!(
        expected.image.rgba.iter().any(|p| p[3] > 0.0),
        "the picture is empty"
    );
    assert!(
        bits(&expected.image) == bits(&got.image),
        "the picture differs from the one in memory"
    );
    assert_eq!(got.stats.bricks_read, 0, "a small visible part is kept");
}

/// Volumes of types with few and with many values.
fn described(scene: &Scene) -> (LargeVolume, volsplat::Volume) {
    (
        open(scene, BUDGET),
        load(&scene.path, &scene.options).expect("a valid file"),
    )
}

#[test]
fn the_survey_tells_what_the_volume_tells() {
    let float = |at| 1e-3 * f32::from(value(at)) - 1.0;
    for scene in [
        scene(),
        write(
            places().flat_map(|at| float(at).to_le_bytes()),
            VoxelType::F32,
        ),
    ] {
        let (large, volume) = described(&scene);
        assert_eq!(
            Described::value_range(&large),
            volume.value_range(),
            "range"
        );
        assert_eq!(
            large.histogram(),
            Histogram::of_volume(&volume),
            "histogram"
        );
        assert_eq!(large.lattice(), volume.lattice(), "place");
        assert_eq!(large.voxel_type(), Described::voxel_type(&volume), "type");
    }
}

#[test]
fn floats_and_their_gaps_agree_too() {
    let float = |at: [usize; 3]| {
        if at == [7, 100, 70] {
            f32::NAN
        } else {
            1e-3 * f32::from(value(at))
        }
    };
    let mut scene = write(
        places().flat_map(|at| float(at).to_le_bytes()),
        VoxelType::F32,
    );
    let refused = LargeVolume::open(&scene.path, &scene.options, BUDGET, &mut |_| {})
        .expect_err("a gap")
        .to_string();
    assert!(
        refused.contains("(7, 100, 70)") && refused.contains("--nan-as"),
        "{refused}"
    );
    scene.options.nan = NanPolicy::Replace(0.5);
    let colours = [(0.0, [0.1, 0.2, 1.0]), (4.0, [1.0, 0.3, 0.1])];
    compare(
        &scene,
        &RenderOptions::default(),
        &transfer(&colours, &[(0.5, 0.0), (2.5, 0.1), (4.0, 0.9)]),
        2..4,
    );
}

fn refusal(path: &Path, options: &LoadOptions, budget: u64) -> String {
    LargeVolume::open(path, options, budget, &mut |_| {})
        .expect_err("refused")
        .to_string()
}

#[test]
fn what_cannot_be_done_is_refused_with_a_reason() {
    let scene = scene();
    assert!(
        refusal(&scene.path, &scene.options, 1000).contains("1000 bytes of memory are too little")
    );
    let wrong = LoadOptions {
        raw: Some(RawOptions::new([10, 10, 10], VoxelType::U16)),
        ..LoadOptions::default()
    };
    assert!(refusal(&scene.path, &wrong, BUDGET).contains("need 2000 bytes"));
    let large = open(&scene, BUDGET);
    let options = RenderOptions::every_sample();
    let refused =
        Renderer::from_file(&large, &dense(), &options, &mut |_| {}).expect_err("needs all voxels");
    assert!(
        matches!(&refused, Error::Option(text) if text.contains("raise the memory limit")),
        "{refused}"
    );
    // A file that is cut off later is an error of reading, not a crash.
    let mut stored = Renderer::from_file(&large, &dense(), &RenderOptions::default(), &mut |_| {})
        .expect("valid");
    std::fs::OpenOptions::new()
        .write(true)
        .open(&scene.path)
        .expect("ours")
        .set_len(1000)
        .expect("shorter");
    let gone = stored
        .render(&cameras()[0].1)
        .expect_err("the file was cut");
    assert!(matches!(gone, Error::Read { .. }), "{gone}");
}

#[test]
fn plain_headers_are_read_in_parts_and_packed_ones_are_not() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let data: Vec<u8> = (0..20 * 18 * 17u32).map(|i| (i * 37 % 251) as u8).collect();
    let heads = [
        (
            "a.nrrd",
            "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 20 18 17\nspacings: 1 2 3\nencoding: raw\n\n",
        ),
        (
            "a.mha",
            "NDims = 3\nDimSize = 20 18 17\nElementType = MET_UCHAR\nElementSpacing = 1 2 3\nElementDataFile = LOCAL\n",
        ),
    ];
    for (name, head) in heads {
        let path = folder.path().join(name);
        std::fs::write(&path, [head.as_bytes(), &data].concat()).expect("room");
        let options = LoadOptions::default();
        let large = LargeVolume::open(&path, &options, 1 << 20, &mut |_| {})
            .expect("valid")
            .expect("plain");
        let volume = load(&path, &options).expect("valid");
        assert_eq!(large.lattice(), volume.lattice(), "{name}");
        assert_eq!(large.histogram(), volume.histogram(), "{name}");
    }
    let text = folder.path().join("t.nrrd");
    std::fs::write(
        &text,
        "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: text\n\n1 2 3 4 5 6 7 8\n",
    )
    .expect("room");
    let packed =
        LargeVolume::open(&text, &LoadOptions::default(), 1 << 20, &mut |_| {}).expect("valid");
    assert!(packed.is_none(), "text is read as a whole");
}
