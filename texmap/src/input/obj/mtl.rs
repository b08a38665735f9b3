//! MTL: the materials of OBJ files.
//!
//! Takes the names of MTL files, gives materials and textures for the materials that meshes use. Colours are written as
//! on a screen and become linear. A line that cannot be read is left out with a note, and so is a file or a picture that
//! is missing; the material's plain colour then stands alone.
//! Source: the Wavefront format as the programs of today write it: names with spaces and back-slashes, `Tr` for 1 - `d`,
//! `Tr 1` alone for a surface that is there, and a black `Kd` beside a `map_Kd`, which is meant to be white. Limits: of the options of a map, `-s`, `-o` and
//! `-clamp` are followed; of materials only colour, alpha and emitted light are read.

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use glam::{DMat2, DVec2};
use resample_core::image::linear_from_srgb;

use super::super::files::{self, Names};
use super::super::notes::Notes;
use super::super::picture::{Pictures, load_picture};
use super::lines::{Line, decode_text, lines, numbers};
use super::map::{self, Map};
use crate::scene::{AlphaMode, Lighting, Magnify, Material, Sides, Texture, TextureUse, Wrap};

/// Largest MTL file, bytes. A material takes about 300, so this is 200 000 of them.
const MAX_FILE_BYTES: u64 = 64 << 20;

/// The materials of all MTL files that were named, and the textures of those that are used.
pub(super) struct Library<'a> {
    names: &'a Names<'a>,
    /// The files that were read: a file that is named again says nothing new.
    read: BTreeSet<PathBuf>,
    entries: HashMap<String, Entry>,
    places: HashMap<String, usize>,
    textures: Pictures,
    by_file: HashMap<[Option<PathBuf>; 2], Option<usize>>,
    late_notes: Vec<String>,
}

/// A material as it is written.
struct Entry {
    folder: PathBuf,
    kd: [f32; 3],
    ke: [f32; 3],
    /// `d`, and `Tr`, which counts only without it.
    opacity: Option<f32>,
    transparency: f32,
    illumination: i32,
    map_kd: Option<Map>,
    map_ke: Option<Map>,
    map_d: Option<Map>,
}

impl<'a> Library<'a> {
    /// Nothing is read yet; names count from the folder of the OBJ file.
    pub(super) fn new(names: &'a Names<'a>) -> Self {
        Self {
            names,
            read: BTreeSet::new(),
            entries: HashMap::new(),
            places: HashMap::new(),
            textures: Pictures::default(),
            by_file: HashMap::new(),
            late_notes: Vec::new(),
        }
    }

    /// Reads the MTL files that a `mtllib` line names.
    pub(super) fn read(&mut self, names: &str, notes: &mut Notes) {
        // A name may hold spaces, and a line may hold several names.
        let found: Vec<_> = match map::find(self.names, names) {
            Ok(path) => vec![Ok(path)],
            Err(_) => names
                .split_ascii_whitespace()
                .map(|name| map::find(self.names, name))
                .collect(),
        };
        for path in found {
            match path {
                Ok(path) if self.read.contains(&path) => {}
                Ok(path) => {
                    self.read_file(&path, notes);
                    self.read.insert(path);
                }
                Err(what) => notes.say(format!("material file {what}: its materials are plain")),
            }
        }
    }

    /// The place of a material among `materials`; one that no file describes is plain.
    pub(super) fn place(&mut self, name: &str, materials: &mut Vec<Material>) -> usize {
        if let Some(&place) = self.places.get(name) {
            return place;
        }
        let material = match self.entries.remove(name) {
            None => plain(name),
            Some(entry) => self.material(name, &entry),
        };
        materials.push(material);
        self.places.insert(name.to_owned(), materials.len() - 1);
        materials.len() - 1
    }

    /// The textures that materials point to, and what could not be had.
    pub(super) fn into_textures(self, notes: &mut Notes) -> Vec<Texture> {
        self.late_notes.into_iter().for_each(|note| notes.say(note));
        self.textures.into_textures()
    }

    fn read_file(&mut self, path: &Path, notes: &mut Notes) {
        let size = std::fs::metadata(path).map_or(0, |metadata| metadata.len());
        if size > MAX_FILE_BYTES {
            notes.say(format!(
                "{} is too large for a material file and is left out",
                path.display()
            ));
            return;
        }
        let bytes = match files::read(path) {
            Ok(bytes) => bytes,
            Err(error) => return notes.say(error.to_string()),
        };
        let text = decode_text(&bytes);
        let folder = files::folder_of(path);
        let mut current: Option<(String, Entry)> = None;
        for line in lines(&text) {
            if line.word == "newmtl" {
                self.entries.extend(current.take());
                current = Some((line.rest.to_owned(), Entry::new(folder)));
            } else if let Some((_, entry)) = &mut current
                && let Err(what) = entry.line(&line)
            {
                let (path, number) = (path.display(), line.number);
                notes.say(format!(
                    "{path}, line {number}: {what}: the line is left out"
                ));
            }
        }
        self.entries.extend(current);
    }

    fn material(&mut self, name: &str, entry: &Entry) -> Material {
        let base_texture = self.texture_use(entry, entry.map_kd.as_ref(), entry.map_d.as_ref());
        let emissive_texture = self.texture_use(entry, entry.map_ke.as_ref(), None);
        let black = entry.kd == [0.0; 3] && entry.map_kd.is_some() && base_texture.is_some();
        let [r, g, b] = if black {
            [1.0; 3]
        } else {
            entry.kd.map(linear_from_srgb)
        };
        let emissive = if emissive_texture.is_some() && entry.ke == [0.0; 3] {
            [1.0; 3]
        } else {
            entry.ke
        };
        let opacity = entry.opacity();
        let see_through = opacity < 1.0 || (entry.map_d.is_some() && base_texture.is_some());
        Material {
            base_colour: [r, g, b, opacity],
            base_texture,
            emissive: emissive.map(linear_from_srgb),
            emissive_texture,
            alpha: if see_through {
                AlphaMode::Blend
            } else {
                AlphaMode::Opaque
            },
            // Illumination 0 is the plain colour without light.
            lighting: if entry.illumination == 0 {
                Lighting::Unlit
            } else {
                Lighting::Lit
            },
            ..plain(name)
        }
    }

    /// A texture of a colour map, with alpha from another map where there is one.
    fn texture_use(
        &mut self,
        entry: &Entry,
        colour: Option<&Map>,
        alpha: Option<&Map>,
    ) -> Option<TextureUse> {
        let placed = colour.or(alpha)?;
        let paths = [colour, alpha].map(|map| map.map(|map| self.found(&entry.folder, map)));
        let paths = paths.map(Option::flatten);
        let texture = match self.by_file.get(&paths) {
            Some(&texture) => texture,
            None => {
                let texture = self.load(&paths);
                self.by_file.insert(paths, texture);
                texture
            }
        };
        // With v from the top, s * v + o from the bottom is s * v + 1 - s - o.
        let [scale, offset] =
            [placed.scale, placed.offset].map(|v| DVec2::from_array(v.map(f64::from)));
        Some(TextureUse {
            texture: texture?,
            uv_set: 0,
            uv_linear: DMat2::from_diagonal(scale),
            uv_offset: DVec2::new(offset.x, 1.0 - scale.y - offset.y),
            wrap: [if placed.clamp {
                Wrap::Clamp
            } else {
                Wrap::Repeat
            }; 2],
            magnify: Magnify::Linear,
        })
    }

    fn found(&mut self, folder: &Path, map: &Map) -> Option<PathBuf> {
        let path = map::find(&self.names.inside(folder), &map.file);
        if let Err(what) = &path {
            let note = format!("texture {what}: the material's colour stands alone");
            self.late_notes.push(note);
        }
        path.ok()
    }

    fn load(&mut self, [colour, alpha]: &[Option<PathBuf>; 2]) -> Option<usize> {
        let texture = match (colour, alpha) {
            (None, None) => return None,
            (Some(colour), None) => {
                load_picture(colour, self.names.gate).map_err(|error| error.to_string())
            }
            (colour, Some(alpha)) => map::with_alpha(colour.as_deref(), alpha, self.names.gate),
        };
        match texture.and_then(|texture| self.textures.add(texture)) {
            Ok(place) => Some(place),
            Err(what) => {
                self.late_notes
                    .push(format!("{what}: the material's colour stands alone"));
                None
            }
        }
    }
}

impl Entry {
    /// A material before its first line: white, because light grey would hide a missing colour.
    fn new(folder: &Path) -> Self {
        let (kd, ke) = ([1.0; 3], [0.0; 3]);
        let (map_kd, map_ke, map_d) = (None, None, None);
        Self {
            folder: folder.to_owned(),
            kd,
            ke,
            opacity: None,
            transparency: 0.0,
            illumination: 2,
            map_kd,
            map_ke,
            map_d,
        }
    }

    /// Some programs write `Tr 1` and mean opaque; nobody writes a material to be invisible.
    fn opacity(&self) -> f32 {
        match (self.opacity, self.transparency) {
            (Some(opacity), _) => opacity,
            (None, 1.0) => 1.0,
            (None, transparency) => 1.0 - transparency,
        }
    }

    fn line(&mut self, line: &Line) -> Result<(), String> {
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
            _ => {}
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
        Err("an opacity is no number".into())
    } else {
        Ok(number.clamp(0.0, 1.0))
    }
}

/// An OBJ has no front sides: both are seen.
fn plain(name: &str) -> Material {
    Material {
        name: name.to_owned(),
        sides: Sides::Both,
        ..Material::default()
    }
}
