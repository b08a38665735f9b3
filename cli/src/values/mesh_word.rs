//! Meshes, isosurfaces and slices that stand in a volume, as they are typed or held in memory.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use texmap::Loaded;
use volsplat::ClipPlane;

use crate::values;

/// A mesh that stands in a volume, and how it is painted.
#[derive(Clone, Debug)]
pub struct MeshWord {
    /// The file, or what stands for it in messages.
    pub path: PathBuf,
    /// The mesh, where it is no file.
    pub held: Option<Arc<Loaded>>,
    /// Linear; `None` for its own colours.
    pub colour: Option<[f32; 3]>,
    /// Above 0, at most 1.
    pub opacity: f32,
}

impl MeshWord {
    /// A mesh of memory; `look` is `COLOUR`, `COLOUR,OPACITY`, `,OPACITY`, or empty for its own colours.
    pub fn of_memory(mesh: Arc<Loaded>, look: &str) -> Result<Self, String> {
        let (colour, opacity) = mesh_look(look)?;
        Ok(Self {
            path: PathBuf::from("mesh"),
            held: Some(mesh),
            colour,
            opacity,
        })
    }

    /// A file: `FILE`, `FILE:COLOUR`, `FILE:COLOUR,OPACITY` or `FILE:,OPACITY`.
    pub fn of_file(text: &str) -> Result<Self, String> {
        // Colons in names of files, as in C:\, come before a separator of folders.
        let parts = text.rsplit_once(':').filter(|(path, look)| {
            !path.is_empty() && !look.contains(['/', '\\']) && !Path::new(text).exists()
        });
        let (path, look) = parts.unwrap_or((text, ""));
        let (colour, opacity) = mesh_look(look)?;
        Ok(Self {
            path: PathBuf::from(path),
            held: None,
            colour,
            opacity,
        })
    }
}

/// An isosurface that stands in its volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IsoWord {
    /// The value of the surface.
    pub value: f64,
    /// Linear; `None` for the transfer function's colour of the value.
    pub colour: Option<[f32; 3]>,
    /// Above 0, at most 1.
    pub opacity: f32,
}

impl IsoWord {
    /// `VALUE`, `VALUE:COLOUR`, `VALUE:COLOUR,OPACITY` or `VALUE:,OPACITY`.
    pub fn of_text(text: &str) -> Result<Self, String> {
        let (value, look) = text.split_once(':').unwrap_or((text, ""));
        let value = value.parse().ok().filter(|value: &f64| value.is_finite());
        let (colour, opacity) = mesh_look(look)?;
        Ok(Self {
            value: value.ok_or(
                "expected a value, then perhaps a colon and a colour, such as 300:white,0.5",
            )?,
            colour,
            opacity,
        })
    }
}

/// A slice that stands in its volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SliceWord {
    /// Where it lies.
    pub place: SlicePlace,
    /// The values that are black and white; `None` for the usual ones.
    pub window: Option<[f64; 2]>,
}

/// Where a slice lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SlicePlace {
    /// An axis of the grid, 0 to 2, and a voxel along it.
    Voxels(usize, usize),
    /// Any plane.
    Plane(ClipPlane),
}

impl SliceWord {
    /// `z=77`, `NX,NY,NZ,D`, and either with a window: `z=77:0,400`.
    pub fn of_text(text: &str) -> Result<Self, String> {
        let (place, window) = match text.split_once(':') {
            Some((place, window)) => (place, Some(values::ascending(window)?)),
            None => (text, None),
        };
        let voxels = place.split_once('=').and_then(|(axis, index)| {
            let axis = ["x", "y", "z"].iter().position(|&name| name == axis)?;
            Some(SlicePlace::Voxels(axis, index.parse().ok()?))
        });
        let expected =
            "expected x, y or z with a voxel, such as z=77, or a plane, such as 1,0,0,40";
        let place = match voxels {
            Some(voxels) => voxels,
            None => SlicePlace::Plane(values::plane(place).map_err(|_| expected)?),
        };
        Ok(Self { place, window })
    }
}

/// The colour of a mesh and its opacity.
fn mesh_look(text: &str) -> Result<(Option<[f32; 3]>, f32), String> {
    if text.is_empty() {
        return Ok((None, 1.0));
    }
    let expected = match values::colour(text) {
        Ok(colour) => return Ok((Some(colour), 1.0)),
        Err(expected) => format!("{text}: {expected}, then perhaps a comma and an opacity"),
    };
    let (colour, opacity) = text.rsplit_once(',').ok_or_else(|| expected.clone())?;
    let colour = match colour {
        "" => None,
        colour => Some(values::colour(colour).map_err(|_| expected.clone())?),
    };
    let opacity: f32 = opacity.parse().map_err(|_| expected)?;
    if opacity > 0.0 && opacity <= 1.0 {
        Ok((colour, opacity))
    } else {
        Err(format!(
            "the opacity is {opacity}, expected above 0 and at most 1"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_has_its_colours_or_one_and_an_opacity() {
        let parts =
            |text: &str| MeshWord::of_file(text).map(|word| (word.path, word.colour, word.opacity));
        let red = Some([1.0, 0.0, 0.0]);
        for (text, path, colour, opacity) in [
            ("a.stl", "a.stl", None, 1.0),
            ("a.stl:red", "a.stl", red, 1.0),
            ("b/a.ply:#ff0000,0.25", "b/a.ply", red, 0.25),
            ("a.ply:255,0,0", "a.ply", red, 1.0),
            ("a.ply:255,0,0,0.5", "a.ply", red, 0.5),
            ("a.glb:,0.5", "a.glb", None, 0.5),
            (r"C:\scans\a.obj", r"C:\scans\a.obj", None, 1.0),
            (r"C:\scans\a.obj:red", r"C:\scans\a.obj", red, 1.0),
            ("C:/a.obj", "C:/a.obj", None, 1.0),
        ] {
            assert_eq!(
                parts(text),
                Ok((PathBuf::from(path), colour, opacity)),
                "{text}"
            );
        }
        for (text, why) in [
            ("a.stl:rot", "expected #rrggbb"),
            ("a.stl:red,x", "an opacity"),
            ("a.stl:red,0", "above 0 and at most 1"),
            ("a.stl:red,1.5", "above 0 and at most 1"),
            ("a.stl:,NaN", "above 0 and at most 1"),
        ] {
            let error = MeshWord::of_file(text).expect_err(text);
            assert!(error.contains(why), "{text}: {error}");
        }
    }

    #[test]
    fn an_isosurface_has_a_value_and_the_look_of_a_mesh() {
        let iso = |value, colour, opacity| IsoWord {
            value,
            colour,
            opacity,
        };
        let red = Some([1.0, 0.0, 0.0]);
        for (text, word) in [
            ("300", iso(300.0, None, 1.0)),
            ("-2.5e3:red", iso(-2500.0, red, 1.0)),
            ("1:255,0,0,0.5", iso(1.0, red, 0.5)),
            ("0:,0.25", iso(0.0, None, 0.25)),
        ] {
            assert_eq!(IsoWord::of_text(text), Ok(word), "{text}");
        }
        for text in ["", "bone", "inf", "3:rot", "3:red,2"] {
            assert!(IsoWord::of_text(text).is_err(), "{text}");
        }
    }
}
