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
