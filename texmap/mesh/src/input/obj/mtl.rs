//! MTL: the materials of OBJ files.
//!
//! Takes the names of MTL files, gives materials and textures for the materials that meshes use. Colours are written as
//! on a screen and become linear. A line that cannot be read is left out with a note. A material file that is not there
//! leaves plain materials and a note; a picture, or a file that cannot be read, is an error, or a note, as is asked for.
//! Source: the Wavefront format as the programs of today write it: names with spaces and back-slashes, `Tr` for 1 - `d`,
//! `Tr 1` alone for a surface that is there, and a black `Kd` beside a `map_Kd`, which is meant to be white. Limits: of the options of a map, `-s`, `-o` and
//! `-clamp` are followed; of materials only colour, alpha, emitted light, and metal, roughness and normals
//! are read. A map of metal or roughness stands for its number, as other programs take it.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};

use glam::{DMat2, DVec2};
use resample_core::image::linear_from_srgb;

use crate::input::files::{self, Names};
use crate::input::obj::lines::{Line, decode_text, lines, numbers};
use crate::input::obj::map::{self, Channel, Map};
use crate::input::options::Notes;
use crate::input::pictures::{Decoded, Packed, Pictures, decode_all, load_picture};
use crate::scene::{
    AlphaMode, Coat, CoatNormals, Lighting, Magnify, Material, Physical, Sheen, Sides, Texture,
    TextureUse, Wrap,
};

/// Largest MTL file, bytes. A material takes about 300, so this is 200 000 of them.
const MAX_FILE_BYTES: u64 = 64 << 20;

/// The materials of all MTL files that were named, and the textures of those that are used.
pub(super) struct Library<'a> {
    names: &'a Names<'a>,
    /// The files that were read: a file that is named again says nothing new.
    read: BTreeSet<PathBuf>,
    /// Lines that named files.
    mentioned: HashSet<String>,
    /// True if a note says that materials are plain.
    is_told: bool,
    entries: HashMap<String, Entry>,
    places: HashMap<String, usize>,
    textures: Pictures,
    /// Colour maps that are decoded already.
    ahead: Decoded<PathBuf>,
    by_file: HashMap<Source, Option<usize>>,
}

/// The files that a texture is made of.
#[derive(Clone, PartialEq, Eq, Hash)]
enum Source {
    /// Colour, and alpha.
    Colour([Option<PathBuf>; 2]),
    /// Roughness, and metal, each a channel.
    Numbers([Option<(PathBuf, Channel)>; 2]),
}

const COLOUR_ALONE: &str = "the material's colour stands alone";

impl<'a> Library<'a> {
    /// Nothing is read yet; names count from the folder of the OBJ file.
    pub(super) fn new(names: &'a Names<'a>) -> Self {
        Self {
            names,
            read: BTreeSet::new(),
            mentioned: HashSet::new(),
            is_told: false,
            entries: HashMap::new(),
            places: HashMap::new(),
            textures: Pictures::default(),
            ahead: Decoded::new(),
            by_file: HashMap::new(),
        }
    }

    /// Reads the MTL files that a `mtllib` line names.
    pub(super) fn read(&mut self, names: &str, notes: &mut Notes) -> Result<(), String> {
        if !self.mentioned.insert(names.to_owned()) {
            return Ok(());
        }
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
                    self.read_file(&path, notes)?;
                    self.read.insert(path);
                }
                // Many models come without it, and are meant to be seen with a picture of the user's.
                Err(what) => {
                    self.is_told = true;
                    notes.say(format!("material file {what}: its materials are plain"));
                }
            }
        }
        Ok(())
    }

    /// Decodes the colour maps of these materials on all threads. Faults come up when a material is placed.
    pub(super) fn decode_ahead<'m>(&mut self, materials: impl Iterator<Item = &'m str>) {
        let mut asked = HashSet::new();
        let paths = materials.filter_map(|name| {
            let entry = self.entries.get(name)?;
            let map = entry.map_kd.as_ref().filter(|_| entry.map_d.is_none())?;
            map::find(&self.names.inside(&entry.folder), &map.file).ok()
        });
        let files = paths
            .filter(|path| asked.insert(path.clone()))
            .filter_map(|path| Packed::of_file(&path).ok().map(|file| (path, file)));
        self.ahead = decode_all(files, self.names.gate);
    }

    /// The place of a material among `materials`; one that no file describes is plain.
    pub(super) fn place(
        &mut self,
        name: &str,
        materials: &mut Vec<Material>,
        notes: &mut Notes,
    ) -> Result<usize, String> {
        if let Some(&place) = self.places.get(name) {
            return Ok(place);
        }
        let material = match self.entries.remove(name) {
            None => {
                // Where a file is missing, a note says so already.
                if !name.is_empty() && !self.is_told {
                    self.is_told = true;
                    notes.say(format!(
                        "material '{}' is described by no material file: it is plain, as are others like it",
                        files::excerpt(name)
                    ));
                }
                plain(name)
            }
            Some(entry) => self
                .material(name, &entry, notes)
                .map_err(|what| format!("material '{}': {what}", files::excerpt(name)))?,
        };
        materials.push(material);
        self.places.insert(name.to_owned(), materials.len() - 1);
        Ok(materials.len() - 1)
    }

    /// The textures that materials point to.
    pub(super) fn into_textures(self) -> Vec<Texture> {
        self.textures.into_textures()
    }

    fn read_file(&mut self, path: &Path, notes: &mut Notes) -> Result<(), String> {
        let size = std::fs::metadata(path).map_or(0, |metadata| metadata.len());
        if size > MAX_FILE_BYTES {
            let what = format!("{} is too large for a material file", path.display());
            return notes.unreadable(&what, "its materials are plain");
        }
        let bytes = match files::read(path) {
            Ok(bytes) => bytes,
            Err(error) => return notes.unreadable(&error.to_string(), "its materials are plain"),
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
        Ok(())
    }

    fn material(
        &mut self,
        name: &str,
        entry: &Entry,
        notes: &mut Notes,
    ) -> Result<Material, String> {
        if !entry.unread.is_empty() {
            let words: Vec<&str> = entry.unread.iter().copied().collect();
            notes.say(format!(
                "material files say {}, which is not read: light on surfaces and its colours differ",
                words.join(", ")
            ));
        }
        let base_texture =
            self.colour(entry, entry.map_kd.as_ref(), entry.map_d.as_ref(), notes)?;
        let emissive_texture = self.colour(entry, entry.map_ke.as_ref(), None, notes)?;
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
        let physical = match entry.is_physical() {
            true => Some(self.physical(entry, notes)?),
            false => None,
        };
        Ok(Material {
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
            physical,
            ..plain(name)
        })
    }

    /// Metal, roughness, normals and layers.
    fn physical(&mut self, entry: &Entry, notes: &mut Notes) -> Result<Physical, String> {
        let maps = [entry.map_pr.as_ref(), entry.map_pm.as_ref()];
        let mut made_of = [None, None];
        for (of, map) in made_of.iter_mut().zip(maps) {
            let Some(map) = map else { continue };
            *of = self
                .found(&entry.folder, map, notes)?
                .map(|path| (path, map.channel));
        }
        let is_mapped = made_of.each_ref().map(Option::is_some);
        let texture = self.texture(Source::Numbers(made_of), notes)?;
        let placed = maps.into_iter().flatten().next();
        let number =
            |k: usize, number: Option<f32>, plain: f32| match is_mapped[k] && texture.is_some() {
                true => 1.0,
                false => number.unwrap_or(plain),
            };
        let plain = Physical::default();
        Ok(Physical {
            roughness: number(0, entry.roughness, plain.roughness),
            metal: number(1, entry.metal, plain.metal),
            metal_roughness_texture: placed.zip(texture).map(|(map, texture)| used(map, texture)),
            normal_texture: self.colour(entry, entry.norm.as_ref(), None, notes)?,
            normal_scale: entry.norm.as_ref().map_or(1.0, |map| map.strength),
            coat: (entry.coat > 0.0).then_some(Coat {
                amount: entry.coat,
                roughness: entry.coat_roughness,
                amount_texture: None,
                roughness_texture: None,
                normals: CoatNormals::Smooth,
            }),
            sheen: (entry.sheen > 0.0).then_some(Sheen {
                colour: [entry.sheen; 3],
                roughness: SHEEN_ROUGHNESS,
                colour_texture: None,
                roughness_texture: None,
            }),
            ..plain
        })
    }

    /// A texture of a colour map, with alpha from another map where there is one.
    fn colour(
        &mut self,
        entry: &Entry,
        colour: Option<&Map>,
        alpha: Option<&Map>,
        notes: &mut Notes,
    ) -> Result<Option<TextureUse>, String> {
        let Some(placed) = colour.or(alpha) else {
            return Ok(None);
        };
        let mut paths = [None, None];
        for (path, map) in paths.iter_mut().zip([colour, alpha]) {
            if let Some(map) = map {
                *path = self.found(&entry.folder, map, notes)?;
            }
        }
        let texture = self.texture(Source::Colour(paths), notes)?;
        Ok(texture.map(|texture| used(placed, texture)))
    }

    fn found(
        &self,
        folder: &Path,
        map: &Map,
        notes: &mut Notes,
    ) -> Result<Option<PathBuf>, String> {
        let path = map::find(&self.names.inside(folder), &map.file);
        if let Err(what) = &path {
            notes.unreadable(&format!("texture {what}"), COLOUR_ALONE)?;
        }
        Ok(path.ok())
    }

    /// The place of a texture that is made of these files; each is read once.
    fn texture(&mut self, source: Source, notes: &mut Notes) -> Result<Option<usize>, String> {
        if let Some(&texture) = self.by_file.get(&source) {
            return Ok(texture);
        }
        let gate = self.names.gate;
        let made = match &source {
            Source::Colour([None, None]) | Source::Numbers([None, None]) => return Ok(None),
            Source::Colour([Some(colour), None]) => match self.ahead.remove(colour) {
                Some(decoded) => decoded.map_err(|what| format!("{}: {what}", colour.display())),
                None => load_picture(colour, gate).map_err(|error| error.to_string()),
            },
            Source::Colour([colour, Some(alpha)]) => {
                map::with_alpha(colour.as_deref(), alpha, gate)
            }
            Source::Numbers(files) => map::roughness_and_metal(files, gate),
        };
        let place = match made.and_then(|texture| self.textures.add(texture, gate)) {
            Ok(place) => Some(place),
            Err(what) => {
                notes.unreadable(&what, COLOUR_ALONE)?;
                None
            }
        };
        self.by_file.insert(source, place);
        Ok(place)
    }
}

/// A texture where a map lays it.
fn used(placed: &Map, texture: usize) -> TextureUse {
    // With v from the top, s * v + o from the bottom is s * v + 1 - s - o.
    let [scale, offset] =
        [placed.scale, placed.offset].map(|v| DVec2::from_array(v.map(f64::from)));
    TextureUse {
        texture,
        uv_set: 0,
        uv_linear: DMat2::from_diagonal(scale),
        uv_offset: DVec2::new(offset.x, 1.0 - scale.y - offset.y),
        wrap: [if placed.clamp {
            Wrap::Clamp
        } else {
            Wrap::Repeat
        }; 2],
        magnify: Magnify::Linear,
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

// A material of an MTL file as it is written, line by line.
//
// Beside the words of Wavefront those of physically based materials are read (`Pr`, `Pm`, `map_Pr`, `map_Pm`, `norm`), as
// programs of today write them. Words that change what is seen and are not read are listed for a note.

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
    /// `Pc` and `Pcr`: a clear coat and its roughness.
    pub coat: f32,
    pub coat_roughness: f32,
    /// `Ps`.
    pub sheen: f32,
    /// Words that change the light and are not read.
    pub unread: BTreeSet<&'static str>,
}

/// The roughness of fibres, of which material files say nothing. A guess.
const SHEEN_ROUGHNESS: f32 = 0.5;

/// Words that change the light on surfaces and are not read. `Ks`, `Ns` and `Ka` are of a model of light that is not drawn.
const UNREAD: [&str; 11] = [
    "map_Ps", "aniso", "anisor", "bump", "map_bump", "map_Bump", "disp", "refl", "decal",
    "map_RMA", "map_ORM",
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
            coat: 0.0,
            coat_roughness: 0.0,
            sheen: 0.0,
            unread: BTreeSet::new(),
        }
    }

    /// Returns true if it says anything of metal, roughness, normals or layers.
    fn is_physical(&self) -> bool {
        self.coat > 0.0
            || self.sheen > 0.0
            || self.roughness.is_some()
            || self.metal.is_some()
            || [&self.map_pr, &self.map_pm, &self.norm]
                .iter()
                .any(|map| map.is_some())
    }

    /// Some programs write `Tr 1` and mean opaque; nobody writes a material to be invisible.
    fn opacity(&self) -> f32 {
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
            "Pc" => self.coat = unit(line.rest)?,
            "Pcr" => self.coat_roughness = unit(line.rest)?,
            "Ps" => self.sheen = unit(line.rest)?,
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
