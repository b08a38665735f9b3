//! Gaussians in glTF, with the extension `KHR_gaussian_splatting`: points with a rotation, a scale, an opacity and harmonics.
//!
//! Takes a path of a `.gltf` or `.glb` file, gives the Gaussians of the scene that it shows, in the world.
//! Rotations are x y z w, standard deviations and opacities plain numbers, coefficients in vectors of red, green and blue.
//! Drafts of the extension had logarithms of the deviations: a primitive with one below 0 is read so.
//! Source: the extension's release candidate by Khronos. Limits: the kernel `ellipse` alone; nothing packed by SPZ or meshopt.

mod document;
mod numbers;
mod nodes;
mod placement;

use std::io::Read;
use std::path::Path;

use glam::{Quat, Vec3};
use resample_io::Gate;
use serde::Deserialize;
use serde_json::Value;

use super::sink::{self, C0, MOST_DEGREE, Sink, Stored};
use crate::Error;
use crate::gaussians::{BlendSpace, Gaussians};
use crate::input::{Fault, cannot_read, open_sized, unsupported};
use document::{Document, EXTENSION, JSON_AT, MAGIC, Primitive, not_read};
use numbers::{Integers, Numbers};
use placement::Placement;

/// How much of a text is searched for the name of the extension, bytes: a guess beyond all files with their data inside.
const MOST_SEARCHED: u64 = 1 << 30;

/// Returns true if a file that begins with these bytes may be glTF, binary or text.
pub(crate) fn may_begin(head: &[u8]) -> bool {
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
    head.starts_with(MAGIC) || text.trim_ascii_start().starts_with(b"{")
}

/// Returns true if the JSON of a file names the extension.
pub(crate) fn begins(path: &Path) -> bool {
    let searched = || {
        let (mut file, _) = open_sized(path).ok()?;
        let mut head = Vec::new();
        let at = (&mut file).take(JSON_AT as u64).read_to_end(&mut head);
        let json = match at.ok()? {
            JSON_AT if head.starts_with(MAGIC) => {
                u64::from(u32::from_le_bytes([head[12], head[13], head[14], head[15]]))
            }
            _ => MOST_SEARCHED,
        };
        let name = format!("\"{EXTENSION}\"");
        holds(head.as_slice().chain(file.take(json)), name.as_bytes()).ok()
    };
    searched().unwrap_or(false)
}

/// Returns true if a file holds a text.
fn holds(mut file: impl Read, text: &[u8]) -> std::io::Result<bool> {
    const PIECE: u64 = 1 << 20;
    let mut window = Vec::new();
    loop {
        // A text may lie across two pieces.
        window.drain(..window.len().saturating_sub(text.len() - 1));
        if file.by_ref().take(PIECE).read_to_end(&mut window)? == 0 {
            return Ok(false);
        }
        let mut rest = window.as_slice();
        while let Some(at) = rest.iter().position(|byte| *byte == text[0]) {
            if rest[at..].starts_with(text) {
                return Ok(true);
            }
            rest = &rest[at + 1..];
        }
    }
}

/// Reads a file.
pub(crate) fn load(path: &Path, gate: &Gate, notes: &mut Vec<String>) -> Result<Gaussians, Error> {
    let (file, held) = open_sized(path)?;
    let asked = gate.ask(held, "the bytes of the file");
    asked.map_err(|what| Fault::Invalid(what).at(path))?;
    let mut bytes = Vec::new();
    let all = file.take(held).read_to_end(&mut bytes);
    all.map_err(|source| cannot_read(path, source))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let read =
        Document::open(&bytes, folder, gate).and_then(|document| gaussians(&document, gate, notes));
    read.map_err(|fault| fault.at(path))
}

fn gaussians(
    document: &Document,
    gate: &Gate,
    notes: &mut Vec<String>,
) -> Result<Gaussians, Fault> {
    let fields = fields(document, notes)?;
    let Some((first, _)) = fields.first() else {
        return Err(Fault::Invalid(format!(
            "no mesh that its scene shows has points with {EXTENSION}: expected Gaussians"
        )));
    };
    let blend_space = first.blend_space;
    if fields
        .iter()
        .any(|(field, _)| field.blend_space != blend_space)
    {
        return Err(unsupported(
            "its Gaussians have two colour spaces: write each in a file of its own",
        ));
    }
    let count = fields.iter().fold(0u64, |sum, (field, _)| {
        sum.saturating_add(field.count() as u64)
    });
    let degrees = fields.iter().map(|(field, _)| field.degree);
    let degree = degrees.max().unwrap_or(0);
    let in_memory = document.buffers.iter().map(|buffer| buffer.len() as u64);
    sink::ask(gate, degree, count, in_memory.sum())?;
    let mut sink = Sink::with_capacity(degree, count);
    let mut coefficients = vec![0.0; sink::coefficients_of(degree)];
    let mut logs = 0;
    for (field, placement) in &fields {
        let are_logs = field.has_logs();
        logs += u32::from(are_logs);
        for index in 0..field.count() {
            let mut stored = field.gaussian(index, &mut coefficients);
            if are_logs {
                stored.scales = stored.scales.exp();
            }
            placement.apply(&mut stored, &mut coefficients);
            sink.push(&stored, &coefficients);
        }
    }
    if logs > 0 {
        notes.push(format!(
            "its scales are logarithms, as in drafts of {EXTENSION}: a plain one is never below 0"
        ));
    }
    let mut all = sink.finish(notes)?;
    all.blend_space = blend_space;
    Ok(all)
}

/// All points that are Gaussians, with their places.
fn fields<'a>(
    document: &'a Document,
    notes: &mut Vec<String>,
) -> Result<Vec<(Field<'a>, Placement)>, Fault> {
    let mut fields = Vec::new();
    let mut others = 0;
    for shown in nodes::shown(&document.root)? {
        let Some(mesh) = document.root.meshes.get(shown.mesh) else {
            return Err(Fault::Invalid(format!(
                "mesh {} does not exist",
                shown.mesh
            )));
        };
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let Some(extension) = primitive.extensions.get(EXTENSION) else {
                others += 1;
                continue;
            };
            let located = |fault| match fault {
                Fault::Invalid(what) => {
                    Fault::Invalid(format!("mesh {}, primitive {number}: {what}", shown.mesh))
                }
                other => other,
            };
            let field = Field::new(document, primitive, extension).map_err(located)?;
            fields.push((field, Placement::new(shown.world_from_mesh)?));
        }
    }
    if others > 0 && !fields.is_empty() {
        notes.push(format!(
            "{others} primitives of its meshes hold no Gaussians and are left out"
        ));
    }
    Ok(fields)
}

/// The extension's words about a primitive.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Extension {
    kernel: Option<String>,
    color_space: Option<String>,
    projection: Option<String>,
    #[serde(default)]
    extensions: std::collections::BTreeMap<String, serde::de::IgnoredAny>,
}

impl Extension {
    /// The space in which colours are blended, if nothing else is asked for than what is drawn.
    fn blend_space(&self) -> Result<BlendSpace, Fault> {
        if let Some(name) = self.extensions.keys().next() {
            return Err(not_read(name));
        }
        let asked = [
            ("kernel", &self.kernel, "ellipse"),
            ("projection", &self.projection, "perspective"),
        ];
        for (name, value, known) in asked {
            if let Some(value) = value.as_ref().filter(|value| *value != known) {
                return Err(unsupported(format!(
                    "{name} '{value}' of Gaussians: only '{known}' is drawn"
                )));
            }
        }
        match self.color_space.as_deref() {
            None | Some("srgb_rec709_display") => Ok(BlendSpace::Srgb),
            Some("lin_rec709_display") => Ok(BlendSpace::Linear),
            Some(other) => Err(unsupported(format!(
                "colour space '{other}' of Gaussians: 'srgb_rec709_display' and 'lin_rec709_display' are read"
            ))),
        }
    }
}

/// The points of a primitive.
struct Field<'a> {
    positions: Numbers<'a, 3>,
    rotations: Numbers<'a, 4>,
    scales: Numbers<'a, 3>,
    opacities: Numbers<'a, 1>,
    constants: Numbers<'a, 3>,
    /// The coefficients of degrees 1 and more.
    rest: Vec<Numbers<'a, 3>>,
    degree: usize,
    blend_space: BlendSpace,
}

impl<'a> Field<'a> {
    fn new(
        document: &'a Document,
        primitive: &Primitive,
        extension: &Value,
    ) -> Result<Self, Fault> {
        let extension = Extension::deserialize(extension);
        let extension =
            extension.map_err(|error| Fault::Invalid(format!("{EXTENSION}: {error}")))?;
        let blend_space = extension.blend_space()?;
        // Without a mode, primitives are triangles.
        let mode = primitive.mode.unwrap_or(4);
        if mode != 0 {
            return Err(Fault::Invalid(format!(
                "it has mode {mode}: expected 0, points"
            )));
        }
        let attributes = Attributes {
            document,
            primitive,
        };
        let degree = attributes.degree();
        let mut rest = Vec::new();
        for degree in 1..=degree {
            for number in 0..=2 * degree {
                let name = harmonic(degree, number);
                rest.push(attributes.numbers(&name, Integers::AsMarked)?);
            }
        }
        let field = Self {
            positions: attributes.numbers("POSITION", Integers::AsMarked)?,
            rotations: attributes.numbers(&prefixed("ROTATION"), Integers::Fractions)?,
            scales: attributes.numbers(&prefixed("SCALE"), Integers::AsMarked)?,
            opacities: attributes.numbers(&prefixed("OPACITY"), Integers::Fractions)?,
            constants: attributes.numbers(&harmonic(0, 0), Integers::AsMarked)?,
            rest,
            degree,
            blend_space,
        };
        field.check_counts()?;
        Ok(field)
    }

    fn check_counts(&self) -> Result<(), Fault> {
        let counts = [
            self.rotations.count(),
            self.scales.count(),
            self.opacities.count(),
            self.constants.count(),
        ];
        let rest = self.rest.iter().map(Numbers::count);
        match counts
            .into_iter()
            .chain(rest)
            .find(|count| *count != self.count())
        {
            Some(other) => Err(Fault::Invalid(format!(
                "its attributes have {other} and {} vectors: expected one of each for a Gaussian",
                self.count()
            ))),
            None => Ok(()),
        }
    }

    fn count(&self) -> usize {
        self.positions.count()
    }

    /// Returns true if the scales are logarithms: a plain one is never below 0.
    fn has_logs(&self) -> bool {
        let is_log = |index| self.scales.get(index).iter().any(|scale| *scale < 0.0);
        (0..self.count()).any(is_log)
    }

    /// A Gaussian in the space of its mesh, its scales as they are; coefficients that it does not have become 0.
    fn gaussian(&self, index: usize, coefficients: &mut [f32]) -> Stored {
        let zeros = std::iter::repeat([0.0; 3]);
        let rest = self.rest.iter().map(|numbers| numbers.get(index));
        for (rgb, value) in coefficients.chunks_exact_mut(3).zip(rest.chain(zeros)) {
            rgb.copy_from_slice(&value);
        }
        let [opacity] = self.opacities.get(index);
        Stored {
            centre: Vec3::from_array(self.positions.get(index)).as_dvec3(),
            rotation: Quat::from_array(self.rotations.get(index)),
            scales: Vec3::from_array(self.scales.get(index)),
            opacity,
            colour: 0.5 + C0 * Vec3::from_array(self.constants.get(index)),
        }
    }
}

fn prefixed(name: &str) -> String {
    format!("{EXTENSION}:{name}")
}

fn harmonic(degree: usize, number: usize) -> String {
    prefixed(&format!("SH_DEGREE_{degree}_COEF_{number}"))
}

/// The attributes of a primitive.
struct Attributes<'a, 'b> {
    document: &'a Document<'a>,
    primitive: &'b Primitive,
}

impl<'a> Attributes<'a, '_> {
    /// The highest degree that has a coefficient.
    fn degree(&self) -> usize {
        let has = |degree: &usize| {
            let mut names = (0..=2 * degree).map(|number| harmonic(*degree, number));
            names.any(|name| self.primitive.attributes.contains_key(&name))
        };
        (1..=MOST_DEGREE).rev().find(has).unwrap_or(0)
    }

    fn numbers<const N: usize>(
        &self,
        name: &str,
        integers: Integers,
    ) -> Result<Numbers<'a, N>, Fault> {
        let index = self.primitive.attributes.get(name);
        let missing =
            || format!("it has no attribute '{name}': expected all that {EXTENSION} demands");
        Numbers::new(self.document, (name, *index.ok_or_else(missing)?), integers)
    }
}

#[cfg(test)]
mod tests;
