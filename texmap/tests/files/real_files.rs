//! Every mesh file of the test data: a sane scene or one error that names the file; no panic, no hang, no flood.
//!
//! Looks in `../shared/data/meshes` beside the workspace, or in `$RESAMPLE_DATA/meshes`; says that it is skipped where
//! that is absent. `cargo test -p texmap --test files real_files -- --nocapture` lists what became of each file.

use std::path::Path;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use texmap::{LoadOptions, Loaded, Scene};

use crate::mesh_files::{folder, mesh_files};

/// No file has more than 5 MB, and most have a few kB: this is a hundred times what the slowest takes.
const TIME_LIMIT: Duration = Duration::from_secs(20);

/// Models that must load, by a part of their path.
const MUST_LOAD: [&str; 5] = [
    "khronos/",
    "pytorch3d/cow_mesh",
    "viking_room",
    "trimesh/fuze",
    "spider",
];

/// Loads on a thread of its own, so that a panic or a hang is reported with the name of the file.
fn load(path: &Path) -> Result<Loaded, String> {
    let (sender, receiver) = mpsc::channel();
    let own = path.to_owned();
    std::thread::spawn(move || {
        let loaded = texmap::load(&own, &LoadOptions::default());
        // The receiver is gone after the time limit.
        let _ = sender.send(loaded.map_err(|error| error.to_string()));
    });
    receiver
        .recv_timeout(TIME_LIMIT)
        .unwrap_or_else(|error| panic!("{}: {error}: panic or hang", path.display()))
}

fn assert_sane(path: &Path, scene: &Scene) {
    let path = path.display();
    assert!(!scene.meshes.is_empty(), "{path}: a scene shows something");
    for mesh in &scene.meshes {
        let count = mesh.positions.len();
        let material = &scene.materials[mesh.material];
        assert!(
            mesh.triangles
                .iter()
                .flatten()
                .all(|&i| (i as usize) < count),
            "{path}: an index is out of range"
        );
        assert!(
            mesh.positions.iter().flatten().all(|x| x.is_finite()),
            "{path}: a position is not finite"
        );
        assert!(
            mesh.normals.is_empty() || mesh.normals.len() == count,
            "{path}: normals"
        );
        assert!(
            mesh.colours.is_empty() || mesh.colours.len() == count,
            "{path}: colours"
        );
        assert!(
            mesh.uvs.iter().all(|set| set.len() == count),
            "{path}: texture coordinates"
        );
        for used in [material.base_texture, material.emissive_texture]
            .into_iter()
            .flatten()
        {
            assert!(
                used.uv_set < mesh.uvs.len(),
                "{path}: a texture without coordinates"
            );
            let texture = &scene.textures[used.texture];
            let texels = match &texture.texels {
                texmap::scene::Texels::Srgb8(texels) => texels.len(),
                texmap::scene::Texels::LinearF32(texels) => texels.len(),
            };
            assert!(
                texels == texture.width * texture.height && texels > 0,
                "{path}: texels"
            );
        }
    }
}

#[test]
fn every_file_loads_sanely_or_says_why_not() {
    let Some(folder) = folder() else { return };
    let mut files = Vec::new();
    mesh_files(&folder, &mut files);
    let (start, mut loaded_files) = (Instant::now(), 0);
    for file in &files {
        let name = file
            .strip_prefix(&folder)
            .unwrap_or(file)
            .to_string_lossy()
            .replace('\\', "/");
        match load(file) {
            Ok(Loaded { scene, notes }) => {
                let triangles: usize = scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
                println!(
                    "{name}: {triangles} triangles, {} textures {notes:?}",
                    scene.textures.len()
                );
                assert_sane(file, &scene);
                loaded_files += 1;
            }
            Err(error) => {
                println!("{name}: ERROR {error}");
                assert!(
                    error.contains(&*file.to_string_lossy()),
                    "the error must name {name}: {error}"
                );
                assert!(!error.contains('\n'), "one line: {error}");
                let must_load = MUST_LOAD.iter().any(|part| name.contains(part));
                assert!(!must_load, "{name} must load: {error}");
            }
        }
    }
    println!(
        "{loaded_files} of {} files load, in {:.1} s",
        files.len(),
        start.elapsed().as_secs_f64()
    );
    assert!(
        loaded_files * 2 > files.len(),
        "most files are good, but only {loaded_files} load"
    );
}
