//! Mesh files: tells the format by the content and gives a checked [`Scene`].
//!
//! Takes a path and what the user says about it, gives a scene and notes about what was left out. All formats end in one
//! check (`checked`), so that what a scene promises does not depend on its format. What a file has and a scene
//! does not need is left out with a note; what would make the picture wrong is an error.
//! Limits: glTF 2.0 and OBJ with MTL.

mod checked;
mod files;
mod gltf;
mod obj;
pub mod picture;

use std::path::{Path, PathBuf};

use crate::Error;
use crate::scene::Scene;

pub use picture::load_picture;

/// What a caller says about a mesh file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Which scene of the file is read; without it the file's default, or its first.
    pub scene: Option<SceneChoice>,
    /// Picture for meshes that have texture coordinates and no texture.
    pub texture: Option<PathBuf>,
}

/// A scene by its name, or by its number from 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneChoice(pub String);

/// A scene that was read.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene: at least one triangle, every index in range, every number finite.
    pub scene: Scene,
    /// What was left out or could not be had, one sentence each, for people.
    pub notes: Vec<String>,
}

/// Notes, each said once.
#[derive(Debug, Default)]
struct Notes(Vec<String>);

/// Most notes that are kept: nobody reads more, and a broken file could make any number.
const MAX_NOTES: usize = 20;

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
                "{path}: an OBJ file has no scenes: leave out --scene"
            )));
        }
        Format::Obj => obj::load(&bytes, folder, &mut notes).map_err(at)?,
    };
    if let Some(texture) = &options.texture {
        checked::bind(&mut scene, load_picture(texture)?)
            .map_err(|what| Error::Option(format!("{}: --texture: {what}", path.display())))?;
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

impl Notes {
    fn say(&mut self, note: String) {
        if self.0.contains(&note) || self.0.len() > MAX_NOTES {
            return;
        }
        let full = self.0.len() == MAX_NOTES;
        self.0.push(if full {
            "more notes are left out".to_owned()
        } else {
            note
        });
    }
}

#[cfg(test)]
mod tests;
