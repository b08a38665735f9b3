//! Reads mesh files: detects the format by the content and gives a checked [`crate::Scene`].
//!
//! Takes a path and what the user says about it, gives a scene and notes about what was left out. All formats end in one
//! check (`checked`), so that what a scene promises does not depend on its format. What a file has and a scene
//! does not need is left out with a note; what would make the picture wrong is an error.
//! Limits: glTF 2.0 and OBJ with MTL.

mod checked;
mod choice;
mod files;
mod gltf;
mod notes;
mod obj;
mod origin;
pub mod picture;

use std::path::Path;

use crate::Error;

pub use choice::{LoadOptions, Loaded, Pose, SceneChoice};
use notes::Notes;
pub use picture::load_picture;

/// Reads a mesh file: glTF 2.0 (.gltf, .glb) or OBJ.
///
/// # Errors
///
/// [`Error::Input`] names the file, the place in it, what was expected and what to do; [`Error::Option`] an option that
/// the file has no use for.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, Error> {
    let bytes = files::read(path)?;
    let folder = files::folder_of(path);
    let mut notes = Notes::default();
    let at = |what: String| Error::Input(format!("{}: {what}", path.display()));
    let mut scene = match format_of(&bytes).map_err(at)? {
        Format::Gltf => gltf::load(&bytes, folder, options, &mut notes).map_err(at)?,
        Format::Obj if options.scene.is_some() => {
            let path = path.display();
            return Err(Error::Option(format!(
                "{path}: an OBJ file has no scenes: name none"
            )));
        }
        Format::Obj if options.pose.is_some() => {
            let path = path.display();
            return Err(Error::Option(format!(
                "{path}: an OBJ file has no animations: name no pose"
            )));
        }
        Format::Obj => obj::load(&bytes, folder, &mut notes).map_err(at)?,
    };
    if let Some(texture) = &options.texture {
        checked::bind(&mut scene, load_picture(texture)?).map_err(|what| {
            Error::Option(format!("{}: the given texture: {what}", path.display()))
        })?;
    }
    let scene = checked::scene(scene, &mut notes).map_err(at)?;
    Ok(Loaded {
        scene,
        notes: notes.0,
    })
}

enum Format {
    Gltf,
    Obj,
}

/// The format, by the first bytes: a binary glTF has a mark, JSON begins with a brace, and an OBJ is a text of lines that
/// begin with one of its words.
fn format_of(bytes: &[u8]) -> Result<Format, String> {
    if gltf::is_binary(bytes) {
        return Ok(Format::Gltf);
    }
    if let Some(name) = foreign_mark(bytes) {
        return Err(format!(
            "this is {name}: expected glTF 2.0 (.gltf, .glb) or OBJ"
        ));
    }
    let text = bytes
        .strip_prefix(b"\xef\xbb\xbf")
        .unwrap_or(bytes)
        .trim_ascii_start();
    match text.first() {
        None => Err("the file is empty: expected glTF 2.0 (.gltf, .glb) or OBJ".into()),
        Some(b'{') => Ok(Format::Gltf),
        Some(_) if obj::looks_like(bytes) => Ok(Format::Obj),
        Some(_) => Err("no mesh of a known format: expected glTF 2.0 (.gltf, .glb) or OBJ".into()),
    }
}

/// Formats that people have and this crate does not read.
fn foreign_mark(bytes: &[u8]) -> Option<&'static str> {
    let marks: [(&[u8], &str); 7] = [
        (b"ply\n", "a PLY file"),
        (b"ply\r\n", "a PLY file"),
        (b"solid ", "an STL file"),
        (b"Kaydara FBX", "an FBX file"),
        (b"PK\x03\x04", "a ZIP archive (unpack it first)"),
        (b"\x89PNG", "a picture"),
        (b"\xff\xd8\xff", "a picture"),
    ];
    marks
        .into_iter()
        .find(|(mark, _)| bytes.starts_with(mark))
        .map(|(_, name)| name)
}

#[cfg(test)]
mod tests;
