//! A material of an MTL file as it is written, line by line.
//!
//! Beside the words of Wavefront those of physically based materials are read (`Pr`, `Pm`, `map_Pr`, `map_Pm`, `norm`), as
//! programs of today write them. Words that change what is seen and are not read are listed for a note.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::lines::{Line, numbers};
use super::map::Map;

/// A material as it is written.
pub(super) struct Entry {
    /// The folder of its file: names count from there.
    pub folder: PathBuf,
    pub kd: [f32; 3],
    pub ke: [f32; 3],
    /// `d`, and `Tr`, which counts only without it.
    opacity: Option<f32>,
    transparency: f32,
    pub illumination: i32,
    pub map_kd: Option<Map>,
    pub map_ke: Option<Map>,
    pub map_d: Option<Map>,
    /// `Pr` and `Pm`.
    pub roughness: Option<f32>,
    pub metal: Option<f32>,
    /// Maps that stand for them.
    pub map_pr: Option<Map>,
    pub map_pm: Option<Map>,
    pub norm: Option<Map>,
    /// Words that change the light and are not read.
    pub unread: BTreeSet<&'static str>,
}

/// Words that change the light on surfaces and are not read. `Ks`, `Ns` and `Ka` are of a model of light that is not drawn.
const UNREAD: [&str; 14] = [
    "Ps", "map_Ps", "Pc", "Pcr", "aniso", "anisor", "bump", "map_bump", "map_Bump", "disp", "refl",
    "decal", "map_RMA", "map_ORM",
];

impl Entry {
    /// A material before its first line: white, because light grey would hide a missing colour.
    pub(super) fn new(folder: &Path) -> Self {
        let (kd, ke) = ([1.0; 3], [0.0; 3]);
        Self {
            folder: folder.to_owned(),
            kd,
            ke,
            opacity: None,
            transparency: 0.0,
            illumination: 2,
            map_kd: None,
            map_ke: None,
            map_d: None,
            roughness: None,
            metal: None,
            map_pr: None,
            map_pm: None,
            norm: None,
            unread: BTreeSet::new(),
        }
    }

    /// Returns true if it says anything of metal, roughness or normals.
    pub(super) fn is_physical(&self) -> bool {
        self.roughness.is_some()
            || self.metal.is_some()
            || [&self.map_pr, &self.map_pm, &self.norm]
                .iter()
                .any(|map| map.is_some())
    }

    /// Some programs write `Tr 1` and mean opaque; nobody writes a material to be invisible.
    pub(super) fn opacity(&self) -> f32 {
        match (self.opacity, self.transparency) {
            (Some(opacity), _) => opacity,
            (None, 1.0) => 1.0,
            (None, transparency) => 1.0 - transparency,
        }
    }

    pub(super) fn line(&mut self, line: &Line) -> Result<(), String> {
        match line.word {
            "Kd" => self.kd = colour(line.rest)?,
            "Ke" => self.ke = colour(line.rest)?,
            "d" => self.opacity = Some(unit(line.rest.trim_start_matches("-halo"))?),
            "Tr" => self.transparency = unit(line.rest)?,
            "illum" => {
                self.illumination = line.rest.parse().map_err(|_| "illum is no whole number")?
            }
            "map_Kd" | "map_kd" => self.map_kd = Some(Map::read(line.rest)?),
            "map_Ke" | "map_ke" => self.map_ke = Some(Map::read(line.rest)?),
            "map_d" | "map_D" => self.map_d = Some(Map::read(line.rest)?),
            "Pr" => self.roughness = Some(unit(line.rest)?),
            "Pm" => self.metal = Some(unit(line.rest)?),
            "map_Pr" => self.map_pr = Some(Map::read(line.rest)?),
            "map_Pm" => self.map_pm = Some(Map::read(line.rest)?),
            "norm" | "map_Kn" => self.norm = Some(Map::read(line.rest)?),
            word => self
                .unread
                .extend(UNREAD.into_iter().find(|unread| *unread == word)),
        }
        Ok(())
    }
}

/// Red, green and blue; one number is a grey.
fn colour(text: &str) -> Result<[f32; 3], String> {
    let [red]: [f32; 1] = numbers(text, [None])?;
    let [_, green, blue] = numbers(text, [None, Some(red), Some(red)])?;
    let colour = [red, green, blue];
    colour
        .iter()
        .all(|c| c.is_finite())
        .then_some(colour)
        .ok_or_else(|| "a colour is not finite".into())
}

fn unit(text: &str) -> Result<f32, String> {
    let [number]: [f32; 1] = numbers(text, [None])?;
    if number.is_nan() {
        Err("expected a number from 0 to 1".into())
    } else {
        Ok(number.clamp(0.0, 1.0))
    }
}
