//! Options of reading a mesh file, the result, and the notes about what was left out.

use std::path::PathBuf;

use resample_io::Gate;

use crate::scene::Scene;

/// Options of reading a mesh file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// The scene of the file to read; by default the file's own choice, or its first.
    pub scene: Option<SceneChoice>,
    /// The moment of an animation in which nodes, skins and morph targets stand; without it the pose of the file.
    pub pose: Option<Pose>,
    /// Equirectangular picture of the light around the scene, HDR or EXR; without it the built-in studio.
    pub environment: Option<PathBuf>,
    /// Choice to read or skip the maps of light (roughness, metal, normals, occlusion).
    pub light_maps: LightMaps,
    /// The treatment of pictures and material files that the file names and that cannot be read.
    pub unreadable: Unreadable,
    /// Picture for meshes that have texture coordinates and no texture.
    pub texture: Option<PathBuf>,
    /// Rules for names inside files, and the memory their data may take.
    pub gate: Gate,
}

/// Choice to read or skip the maps of light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LightMaps {
    /// For the light of surroundings.
    #[default]
    Read,
    /// No other light needs them.
    LeftOut,
}

/// The treatment of pictures and material files that are named and cannot be read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Unreadable {
    /// An error: a surface without its picture looks like one that never had any.
    #[default]
    Refused,
    /// A note says it, and the material's plain colour stands alone.
    Noted,
}

/// A scene by its name, or by its number from 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneChoice(pub String);

/// A moment of an animation.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    /// Seconds from the animation's start; before its first key and behind its last one the animation stands still.
    pub time_s: f64,
    /// Name of the animation, or its number from 0; without it the first.
    pub animation: Option<String>,
}

/// A scene that was read.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene: at least one triangle, every index in range, every number finite.
    pub scene: Scene,
    /// Ignored or unreadable parts of the file, one sentence each, for people.
    pub notes: Vec<String>,
}

/// Notes, each said once.
#[derive(Debug, Default)]
pub(super) struct Notes {
    pub(super) said: Vec<String>,
    unreadable: Unreadable,
}

/// Most notes that are kept: nobody reads more, and a broken file could make any number.
pub(super) const MAX_NOTES: usize = 20;

impl Notes {
    /// None yet.
    pub(super) fn new(unreadable: Unreadable) -> Self {
        Self {
            said: Vec::new(),
            unreadable,
        }
    }

    /// Adds a note, unless it has been said.
    pub(super) fn say(&mut self, note: String) {
        if self.said.contains(&note) || self.said.len() > MAX_NOTES {
            return;
        }
        let full = self.said.len() == MAX_NOTES;
        self.said.push(if full {
            "more notes are left out".to_owned()
        } else {
            note
        });
    }

    /// A picture or a material file cannot be read: an error, or a note of what is drawn instead.
    pub(super) fn unreadable(&mut self, what: &str, instead: &str) -> Result<(), String> {
        match self.unreadable {
            Unreadable::Refused => Err(format!(
                "{what}: mend or fetch what is missing, or draw without pictures by --textures left-out"
            )),
            Unreadable::Noted => {
                self.say(format!("{what}: {instead}"));
                Ok(())
            }
        }
    }
}
