//! Reads mesh files: detects the format by the content and returns a checked [`crate::Scene`].
//!
//! Takes a path and what the user says about it, gives a scene and notes about what was left out. All formats end in one
//! check (`checked`), so that what a scene promises does not depend on its format. What a file has and a scene
//! does not need is left out with a note; what would make the picture wrong is an error, and so is a picture that is named and
//! cannot be read.
//! Limits: glTF 2.0, OBJ with MTL, PLY and STL.

mod choice;
mod files;
mod format;
mod notes;
mod gltf;
mod obj;
mod ply;
mod stl;
mod pictures;
mod finish;

use std::path::Path;
use std::sync::Arc;

use resample_io::Gate;

use crate::{Error, Scene};

pub use choice::{LightMaps, LoadOptions, Loaded, Pose, SceneChoice, Unreadable};
use files::Names;
use finish::checked;
pub use finish::origin;
pub use format::{Format, format_of};
pub use gltf::{Animation, Contents};
use notes::Notes;
pub use pictures::load_picture;

/// Reads a mesh file: glTF 2.0 (.gltf, .glb), OBJ, PLY or STL.
///
/// # Errors
///
/// [`Error::Input`] names the file, the place in it, what was expected and what to do; [`Error::Option`] an option that
/// the file has no use for.
///
/// ```
/// use resample_mesh::{LoadOptions, load};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let path = std::env::temp_dir().join("resample-mesh-quad.ply");
/// let head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
/// let faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
/// std::fs::write(&path, format!("{head}{faces}0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"))?;
/// let loaded = load(&path, &LoadOptions::default())?;
/// assert_eq!(loaded.scene.meshes[0].triangles.len(), 2, "polygons become triangles");
/// # std::fs::remove_file(&path)?;
/// # Ok(())
/// # }
/// ```
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, Error> {
    let bytes = files::read(path)?;
    let folder = files::folder_of(path);
    let names = Names {
        folder,
        root: folder,
        gate: &options.gate,
    };
    let mut notes = Notes::new(options.unreadable);
    let at = |what: String| Error::Input(format!("{}: {what}", path.display()));
    let format = format::detect(&bytes).map_err(at)?;
    if let Some(name) = format.plain_name() {
        let given = [
            ("scenes", options.scene.is_some()),
            ("animations", options.pose.is_some()),
        ];
        if let Some((what, _)) = given.iter().find(|(_, is_given)| *is_given) {
            let path = path.display();
            return Err(Error::Option(format!(
                "{path}: {name} file has no {what}: name none"
            )));
        }
    }
    let scene = match format {
        Format::Gltf => gltf::load(&bytes, &names, options, &mut notes),
        Format::Obj => obj::load(&bytes, &names, &mut notes),
        Format::Ply => ply::load(&bytes, &names, &mut notes),
        Format::Stl => stl::load(&bytes, &mut notes),
    }
    .map_err(at)?;
    finished(path, scene, options, notes)
}

/// The content of a mesh file beside the drawn scene: only glTF has more than that.
///
/// # Errors
///
/// [`Error::Input`] as [`load`] has it.
///
/// ```
/// use resample_mesh::input::contents;
/// use resample_io::Gate;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let path = std::env::temp_dir().join("resample-mesh-contents.gltf");
/// std::fs::write(&path, r#"{"asset": {"version": "2.0"}, "scenes": [{"name": "all"}]}"#)?;
/// assert_eq!(contents(&path, &Gate::default())?.scenes.len(), 1);
/// # std::fs::remove_file(&path)?;
/// # Ok(())
/// # }
/// ```
pub fn contents(path: &Path, gate: &Gate) -> Result<Contents, Error> {
    let bytes = files::read(path)?;
    let at = |what: String| Error::Input(format!("{}: {what}", path.display()));
    if format::detect(&bytes).map_err(at)? != Format::Gltf {
        return Ok(Contents::default());
    }
    let folder = files::folder_of(path);
    let names = Names {
        folder,
        root: folder,
        gate,
    };
    gltf::contents(&bytes, &names).map_err(at)
}

/// A scene of memory, as if a file held it: texture and surroundings come from the options.
///
/// # Errors
///
/// As [`load`] has them; they name `name`.
///
/// ```
/// use resample_mesh::input::of_memory;
/// use resample_mesh::scene::{Material, Mesh};
/// use resample_mesh::{LoadOptions, Scene};
///
/// let mesh = Mesh {
///     positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
///     triangles: vec![[0, 1, 3]],
///     ..Mesh::default()
/// };
/// let scene = Scene {
///     meshes: vec![mesh],
///     materials: vec![Material::default()],
///     ..Scene::default()
/// };
/// let wrong = of_memory("array".as_ref(), scene, &LoadOptions::default());
/// assert!(wrong.is_err(), "there is no vertex 3");
/// ```
pub fn of_memory(name: &Path, scene: Scene, options: &LoadOptions) -> Result<Loaded, Error> {
    checked::indices(&scene).map_err(|what| Error::Input(format!("{}: {what}", name.display())))?;
    finished(name, scene, options, Notes::new(options.unreadable))
}

/// Makes what was read or given the scene that was asked for.
fn finished(
    path: &Path,
    mut scene: Scene,
    options: &LoadOptions,
    mut notes: Notes,
) -> Result<Loaded, Error> {
    let at = |what: String| Error::Input(format!("{}: {what}", path.display()));
    if let Some(texture) = &options.texture {
        checked::bind_texture(&mut scene, load_picture(texture, &options.gate)?).map_err(
            |what| Error::Option(format!("{}: the given texture: {what}", path.display())),
        )?;
    }
    if let Some(environment) = &options.environment {
        scene.surroundings = Some(Arc::new(pictures::surroundings(
            environment,
            &options.gate,
        )?));
    }
    let scene = checked::scene(scene, &mut notes).map_err(at)?;
    Ok(Loaded {
        scene,
        notes: notes.said,
    })
}

#[cfg(test)]
mod tests;
