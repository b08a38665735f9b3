//! Light on coarse grids: its errors beside the f64 integrals, in memory and of volumes that stay in their file.

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use resample_core::Image;
use resample_tests::volumes::lit_scenes::{
    ball, camera, fog, peaks, psnr_db, shells, solid, thin, towards, vessels, white_isosurface,
};
use resample_tests::volumes::shadow_truth::ShadowTruth;
use volsplat::large::{Region, VoxelSource};
use volsplat::volume::{Described, VoxelType};
use volsplat::{
    Clip, ClipPlane, Error, LargeVolume, Light, LightGrid, Occlusion, RenderOptions, Renderer,
    Reuse, Shadow, TransferFunction, Volume, Voxels,
};

/// A hard light and a sky on this grid.
fn options(light_grid: LightGrid) -> RenderOptions {
    RenderOptions {
        light: Light::Towards(towards()),
        shadow: Some(Shadow::default()),
        occlusion: Some(Occlusion { radius: Some(8.0) }),
        light_grid,
        ..RenderOptions::default()
    }
}

fn drawn(volume: &Volume, look: &TransferFunction, options: &RenderOptions) -> Image {
    let mut renderer = Renderer::new(volume, look, options).expect("valid options");
    renderer.render(&camera()).expect("a valid camera").image
}

/// A volume that is read box by box, as if it were a file.
#[derive(Debug)]
struct Stored(Volume);

impl VoxelSource for Stored {
    fn dims(&self) -> [usize; 3] {
        self.0.dims
    }

    fn voxel_type(&self) -> VoxelType {
        Described::voxel_type(&self.0)
    }

    fn read(&self, region: &Region) -> Result<Voxels, Error> {
        let [columns, rows, _] = self.0.dims;
        let [x, y, z] = region.first;
        let across =
            (z..z + region.size[2]).flat_map(|z| (y..y + region.size[1]).map(move |y| [y, z]));
        let starts: Vec<usize> = across.map(|[y, z]| x + columns * (y + rows * z)).collect();
        Ok(self.0.voxels.pieces(&starts, region.size[0]))
    }
}

/// The same volume at twice as many voxels along each axis.
fn finer(volume: &Volume) -> Volume {
    let [columns, rows, _] = volume.dims;
    let dims = volume.dims.map(|n| 2 * n - 1);
    let value = |at: [usize; 3]| {
        volume
            .voxels
            .value(at[0] + columns * (at[1] + rows * at[2]))
    };
    let mean = |number: usize| {
        let at = [
            number % dims[0],
            number / dims[0] % dims[1],
            number / (dims[0] * dims[1]),
        ];
        let ends = |axis: usize| [at[axis] / 2, at[axis].div_ceil(2)];
        let mut sum = 0.0;
        for x in ends(0) {
            for y in ends(1) {
                for z in ends(2) {
                    sum += value([x, y, z]);
                }
            }
        }
        (sum / 8.0) as f32
    };
    let voxels = (0..dims.iter().product()).map(mean).collect();
    let world_from_index = volume.world_from_index * DAffine3::from_scale(DVec3::splat(0.5));
    Volume::new(dims, Voxels::F32(voxels), world_from_index).expect("a valid volume")
}

/// The picture of the same volume with so little memory that its bricks are read for each frame.
fn streamed(
    volume: &Volume,
    look: &TransferFunction,
    options: &RenderOptions,
    memory: u64,
) -> Image {
    let stored = Arc::new(Stored(volume.clone()));
    let large = LargeVolume::new(volume.lattice(), stored, memory, &mut |_| {}).expect("room");
    let mut renderer = Renderer::from_file(&large, look, options, &mut |_| {}).expect("room");
    assert!(renderer.reads_file(), "everything fits {memory} bytes");
    renderer.render(&camera()).expect("a valid camera").image
}

fn without(options: &RenderOptions) -> RenderOptions {
    RenderOptions {
        shadow: None,
        occlusion: None,
        ..options.clone()
    }
}

#[test]
fn coarse_grids_have_stated_errors() {
    for (name, volume, look, least_db, least_sky_db) in [
        (
            "ball",
            ball(),
            solid(),
            [39.0, 24.0, 18.5, 15.0],
            [23.5, 16.0, 16.0],
        ),
        (
            "vessels",
            vessels(),
            solid(),
            [42.5, 25.0, 18.0, 15.0],
            [25.0, 18.0, 16.0],
        ),
        (
            "fog",
            fog(),
            thin(),
            [65.0, 54.0, 43.5, 37.0],
            [57.5, 49.0, 36.5],
        ),
        (
            "shells",
            shells(),
            peaks(),
            [41.0, 26.5, 21.0, 18.0],
            [32.5, 28.5, 25.0],
        ),
    ] {
        let truth = ShadowTruth::new(&volume, &look, vec![towards()], &|_| true);
        let truth = truth.picture(&camera(), 3);
        let sun = |light_grid| RenderOptions {
            occlusion: None,
            ..options(light_grid)
        };
        let db_of = |options: &RenderOptions| psnr_db(&drawn(&volume, &look, options), &truth);
        let unlit = db_of(&without(&options(LightGrid::Auto)));
        let found = [1, 2, 4, 8].map(|step| db_of(&sun(LightGrid::Every(step))));
        eprintln!("{name}: without {unlit:.1} dB, every 1, 2, 4 and 8: {found:.1?}");
        // The planner predicts errors by 0.7 of the change from each voxel to each second one.
        let [each, second] = [1, 2].map(|step| drawn(&volume, &look, &sun(LightGrid::Every(step))));
        let predicted_db = psnr_db(&second, &each) - 20.0 * 0.7f64.log10();
        assert!(found[0] > predicted_db, "{name}: {predicted_db:.1} dB");
        // Occlusion beside that of every voxel, which its own tests compare with the truth.
        let sky = |light_grid| RenderOptions {
            shadow: None,
            ..options(light_grid)
        };
        let each = drawn(&volume, &look, &sky(LightGrid::Every(1)));
        let unlit = psnr_db(
            &drawn(&volume, &look, &without(&options(LightGrid::Auto))),
            &each,
        );
        let beside = [2, 4, 8]
            .map(|step| psnr_db(&drawn(&volume, &look, &sky(LightGrid::Every(step))), &each));
        eprintln!("{name}, occlusion: without {unlit:.1} dB, every 2, 4 and 8: {beside:.1?}");
        let all = found.into_iter().zip(least_db);
        for (db, least_db) in all.chain(beside.into_iter().zip(least_sky_db)) {
            assert!(db >= least_db, "{name}: {found:.1?}, {beside:.1?}");
        }
    }
}

#[test]
fn a_volume_in_its_file_has_the_light_of_its_grid() {
    for (name, volume, look, memory) in [
        ("ball", ball(), solid(), 3 << 19),
        ("fog", fog(), thin(), 4 << 20),
        ("shells", shells(), peaks(), 3 << 20),
    ] {
        let volume = finer(&volume);
        for step in [4, 8] {
            let options = RenderOptions {
                opacity_unit: Some(1.0),
                ..options(LightGrid::Every(step))
            };
            let in_memory = drawn(&volume, &look, &options);
            let in_file = streamed(&volume, &look, &options, memory);
            let db = psnr_db(&in_file, &in_memory);
            let unlit = psnr_db(
                &streamed(&volume, &look, &without(&options), memory),
                &in_memory,
            );
            eprintln!("{name}, every {step}: {db:.1} dB, without light {unlit:.1}");
            assert!(db >= 70.0 && unlit < 20.0, "{name}: {db:.1} dB");
        }
    }
}

#[test]
fn isosurfaces_and_cuts_have_light_on_coarse_grids() {
    let (volume, look) = (finer(&ball()), solid());
    let surface = |light_grid| RenderOptions {
        order: white_isosurface(),
        opacity_unit: Some(1.0),
        ..options(light_grid)
    };
    let cut = |light_grid| RenderOptions {
        clip: Clip {
            planes: vec![ClipPlane {
                normal: DVec3::new(0.2, -1.0, 0.1),
                offset: -26.0,
            }],
            ..Clip::default()
        },
        opacity_unit: Some(1.0),
        ..options(light_grid)
    };
    for (name, options, least_db) in [
        (
            "isosurface",
            &surface as &dyn Fn(LightGrid) -> RenderOptions,
            [28.5, 21.0],
        ),
        ("cut", &cut, [31.5, 20.0]),
    ] {
        let each = drawn(&volume, &look, &options(LightGrid::Auto));
        let unlit = psnr_db(
            &drawn(&volume, &look, &without(&options(LightGrid::Auto))),
            &each,
        );
        let second = psnr_db(&drawn(&volume, &look, &options(LightGrid::Every(2))), &each);
        let fourth = drawn(&volume, &look, &options(LightGrid::Every(4)));
        let in_file = streamed(&volume, &look, &options(LightGrid::Every(4)), 3 << 19);
        let [fourth, in_file] = [(&fourth, &each), (&in_file, &fourth)].map(|(a, b)| psnr_db(a, b));
        eprintln!(
            "{name}: without {unlit:.1} dB, every 2 and 4: {second:.1}, {fourth:.1}, the file's {in_file:.1}"
        );
        assert!(
            second >= least_db[0] && fourth >= least_db[1] && in_file >= 60.0,
            "{name}"
        );
    }
}

#[test]
fn moving_pictures_take_the_light_at_hand() {
    let (volume, look) = (ball(), solid());
    let soft = |light_grid| RenderOptions {
        shadow: Some(Shadow {
            light_size_deg: 5.0,
        }),
        ..options(light_grid)
    };
    let mut renderer = Renderer::new(&volume, &look, &options(LightGrid::Auto)).expect("valid");
    let mut drawn_with = |options: &RenderOptions| {
        assert_ne!(
            renderer.update(options).expect("valid options"),
            Reuse::NeedsRenderer
        );
        renderer.render(&camera()).expect("a valid camera").image
    };
    let exact = drawn_with(&options(LightGrid::Auto));
    let moving = drawn_with(&options(LightGrid::AtHand));
    assert!(moving.rgba == exact.rgba, "light that is known is kept");
    // Another light: found quickly while pictures move, then as if it had been asked for at once.
    let moving = drawn_with(&soft(LightGrid::AtHand));
    let exact = drawn(&volume, &look, &soft(LightGrid::Auto));
    let db = psnr_db(&moving, &exact);
    assert!((15.0..40.0).contains(&db), "{db:.1} dB");
    let quick = drawn(&volume, &look, &soft(LightGrid::Every(4)));
    assert!(moving.rgba == quick.rgba, "every fourth voxel");
    assert!(drawn_with(&soft(LightGrid::Auto)).rgba == exact.rgba);
    // A renderer that began on a coarse grid leaves it when it is told to.
    let mut coarse =
        Renderer::new(&volume, &look, &soft(LightGrid::Every(2))).expect("valid options");
    let _known = coarse.render(&camera()).expect("a valid camera");
    let _same = coarse.update(&soft(LightGrid::Auto)).expect("valid");
    let image = coarse.render(&camera()).expect("a valid camera").image;
    assert!(image.rgba == exact.rgba, "on the grid that is asked for");
}
