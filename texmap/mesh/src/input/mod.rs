//! Reads mesh files: detects the format by the content and returns a checked [`crate::Scene`].
//!
//! Takes a path and what the user says about it, gives a scene and notes about what was left out. All formats end in one
//! check (`finish`), so that what a scene promises does not depend on its format. What a file has and a scene
//! does not need is left out with a note; what would make the picture wrong is an error, and so is a picture that is named and
//! cannot be read.
//! Limits: glTF 2.0, OBJ with MTL, PLY and STL.

mod options;
mod files;
mod pictures;
#[cfg(feature = "compressed")]
mod ktx2;
mod gltf;
mod obj;
mod ply;
mod stl;
mod finish;

use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use resample_io::Gate;
use resample_io::files::{cannot_read, open};

use crate::input::files::{Names, text_of};
pub use crate::input::finish::set_origin;
pub use crate::input::gltf::{Animation, Contents};
use crate::input::options::Notes;
pub use crate::input::options::{LightMaps, LoadOptions, Loaded, Pose, SceneChoice, Unreadable};
pub use crate::input::pictures::load_picture;
use crate::{Error, Scene};

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
    let format = detect(&bytes).map_err(at)?;
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
    if detect(&bytes).map_err(at)? != Format::Gltf {
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
    finish::indices(&scene).map_err(|what| Error::Input(format!("{}: {what}", name.display())))?;
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
        finish::bind_texture(&mut scene, load_picture(texture, &options.gate)?).map_err(
            |what| Error::Option(format!("{}: the given texture: {what}", path.display())),
        )?;
    }
    if let Some(environment) = &options.environment {
        scene.surroundings = Some(Arc::new(pictures::surroundings(
            environment,
            &options.gate,
        )?));
    }
    let scene = finish::scene(scene, &mut notes).map_err(at)?;
    Ok(Loaded {
        scene,
        notes: notes.said,
    })
}

// The format of a mesh file, detected by its content.
//
// Takes the bytes of a file, or a path whose beginning is read. A binary glTF and a PLY have a mark, a binary STL has the
// length that its count says, JSON begins with a brace, and an OBJ is a text of lines that begin with one of its words.

/// The formats that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// glTF 2.0, as text or binary.
    Gltf,
    /// OBJ, with its materials beside it.
    Obj,
    /// PLY, as text or binary.
    Ply,
    /// STL, as text or binary.
    Stl,
}

/// Bytes that tell a format: comments at the top of an OBJ can be long.
const HEAD_BYTES: u64 = 1 << 16;

impl Format {
    /// The usual name.
    ///
    /// ```
    /// use resample_mesh::input::Format;
    ///
    /// assert_eq!(Format::Obj.name(), "OBJ");
    /// ```
    pub fn name(self) -> &'static str {
        match self {
            Self::Gltf => "glTF",
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Stl => "STL",
        }
    }

    /// A format that has neither scenes nor animations.
    fn plain_name(self) -> Option<&'static str> {
        match self {
            Self::Gltf => None,
            Self::Obj => Some("an OBJ"),
            Self::Ply => Some("a PLY"),
            Self::Stl => Some("an STL"),
        }
    }
}

/// The format of a file; `None` where nothing of a mesh is found.
///
/// # Errors
///
/// [`Error::Input`] where the file cannot be read.
///
/// ```
/// use resample_mesh::input::{Format, format_of};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let path = std::env::temp_dir().join("resample-mesh-format.obj");
/// std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")?;
/// assert_eq!(format_of(&path)?, Some(Format::Obj));
/// # std::fs::remove_file(&path)?;
/// # Ok(())
/// # }
/// ```
pub fn format_of(path: &Path) -> Result<Option<Format>, Error> {
    let (file, length) = open(path)?;
    let mut head = Vec::new();
    let read = file.take(HEAD_BYTES).read_to_end(&mut head);
    read.map_err(|error| cannot_read(path, &error))?;
    Ok(of_head(&head, length).filter(|&format| format != Format::Gltf || is_gltf(&head)))
}

/// JSON is also the form of cameras and of transfer functions; glTF must state its asset.
fn is_gltf(head: &[u8]) -> bool {
    const WORD: &[u8] = b"\"asset\"";
    gltf::is_binary(head) || head.windows(WORD.len()).any(|part| part == WORD)
}

/// The format of the bytes of a file. The error says what they are instead.
fn detect(bytes: &[u8]) -> Result<Format, String> {
    const EXPECTED: &str = "expected glTF 2.0 (.gltf, .glb), OBJ, PLY or STL";
    if let Some(format) = of_head(bytes, bytes.len() as u64) {
        return Ok(format);
    }
    Err(match foreign_mark(bytes) {
        Some(name) => format!("this is {name}: {EXPECTED}"),
        None if text_of(bytes).is_empty() => format!("the file is empty: {EXPECTED}"),
        None => format!("no mesh of a known format: {EXPECTED}"),
    })
}

/// The format of a file of `length` bytes that begins with `head`.
fn of_head(head: &[u8], length: u64) -> Option<Format> {
    if gltf::is_binary(head) {
        return Some(Format::Gltf);
    }
    if ply::looks_like(head) {
        return Some(Format::Ply);
    }
    if foreign_mark(head).is_some() {
        return None;
    }
    if stl::looks_like(head, length) {
        return Some(Format::Stl);
    }
    match text_of(head).first() {
        Some(b'{') => Some(Format::Gltf),
        Some(_) if obj::looks_like(head) => Some(Format::Obj),
        Some(_) | None => None,
    }
}

/// Formats that people have and this crate does not read.
fn foreign_mark(bytes: &[u8]) -> Option<&'static str> {
    let marks: [(&[u8], &str); 4] = [
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
mod tests {
    use super::*;
    use crate::input::options::MAX_NOTES;

    fn refusal(content: &[u8]) -> String {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("model");
        std::fs::write(&path, content).expect("written");
        let error = load(&path, &LoadOptions::default())
            .expect_err("no good mesh")
            .to_string();
        assert!(
            error.starts_with(&path.display().to_string()),
            "the file is named first: {error}"
        );
        error
    }

    #[test]
    fn foreign_files_are_called_by_their_names() {
        for (content, said) in [
            (&b""[..], "empty"),
            (b"  \n", "empty"),
            (b"ply\nformat ascii 1.0\n", "PLY"),
            (b"solid cube\n", "STL"),
            (b"Kaydara FBX Binary", "FBX"),
            (b"PK\x03\x04abcd", "ZIP"),
            (b"\x89PNG\r\n", "picture"),
            (b"\x00\x01\x02\x03", "known format"),
            (b"glTF", "cut"),
            (b"{", "glTF"),
        ] {
            let error = refusal(content);
            assert!(
                error.contains(said),
                "{content:?}: expected '{said}' in '{error}'"
            );
        }
    }

    #[test]
    fn folders_and_missing_files_are_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        for path in [folder.path().to_owned(), folder.path().join("nothing.glb")] {
            let error = load(&path, &LoadOptions::default())
                .expect_err("no file")
                .to_string();
            assert!(error.contains("cannot read"), "{error}");
        }
    }

    #[test]
    fn notes_are_said_once_and_come_to_an_end() {
        let mut notes = Notes::default();
        (0..1000).for_each(|i| notes.say(format!("note {}", i / 2)));
        assert_eq!(notes.said.len(), MAX_NOTES + 1, "as many as anybody reads");
        assert_eq!(notes.said[1], "note 1", "each once");
    }
}
