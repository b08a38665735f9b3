//! Describes a mesh file: its counts, materials, textures and animations, read as `resample texmap` reads them.

use anyhow::Result;
use glam::DVec3;
use serde_json::{Value, json};
use texmap::input::{Animation, Format};
use texmap::{LoadOptions, Loaded, Scene, input};

use super::words::{Line, between, line, listed, short, sides};
use crate::args::InfoArgs;
use crate::process::report;

/// Reads the mesh and describes it.
pub(super) fn facts(args: &InfoArgs) -> Result<(Vec<Line>, Value)> {
    let gate = args.volume.reading.gate();
    let path = &args.input.path;
    let part = args.input.part.as_deref();
    let scene = part.map(|part| part.strip_prefix("scene=").unwrap_or(part).to_owned());
    let options = LoadOptions {
        scene: scene.map(input::SceneChoice),
        gate: gate.clone(),
        // Missing pictures are reported, not refused: `info` describes the file.
        unreadable: input::Unreadable::Noted,
        ..LoadOptions::default()
    };
    let Loaded { scene, notes } = texmap::load(path, &options)?;
    report::say_notes(&notes);
    let contents = input::contents(path, &gate)?;
    let facts = Facts {
        format: input::format_of(path)?,
        corners: corners(&scene),
        contents,
        scene,
    };
    Ok((facts.lines(), facts.json()))
}

struct Facts {
    format: Option<Format>,
    scene: Scene,
    contents: input::Contents,
    /// Of the box around all corners of triangles, world units.
    corners: [DVec3; 2],
}

impl Facts {
    fn format_name(&self) -> &'static str {
        self.format.map_or("mesh", Format::name)
    }

    fn triangles(&self) -> usize {
        self.scene.meshes.iter().map(|m| m.triangles.len()).sum()
    }

    fn vertices(&self) -> usize {
        self.scene.meshes.iter().map(|m| m.positions.len()).sum()
    }

    /// glTF alone says how long its unit is.
    fn units(&self) -> Option<&'static str> {
        (self.format == Some(Format::Gltf)).then_some("metres")
    }

    fn lines(&self) -> Vec<Line> {
        let scene = &self.scene;
        let size = self.corners[1] - self.corners[0];
        let named = |names: Vec<&String>| listed(&named(names));
        let mut lines = vec![
            line("format", self.format_name()),
            line(
                "triangles",
                format!(
                    "{} in {} parts, {} vertices",
                    self.triangles(),
                    scene.meshes.len(),
                    self.vertices()
                ),
            ),
            line(
                "materials",
                named(scene.materials.iter().map(|m| &m.name).collect()),
            ),
            line("textures", listed(&self.textures())),
        ];
        if self.contents.scenes.len() > 1 {
            lines.push(line("scenes", named(self.contents.scenes.iter().collect())));
        }
        if self.format == Some(Format::Gltf) {
            lines.push(line(
                "animations",
                listed(
                    &self
                        .contents
                        .animations
                        .iter()
                        .map(animation)
                        .collect::<Vec<_>>(),
                ),
            ));
            lines.push(line(
                "cameras",
                named(scene.cameras.iter().map(|c| &c.name).collect()),
            ));
        }
        lines.extend([
            line("extent", sides(size)),
            line("", between(self.corners)),
            line("units", self.units().unwrap_or("not stated by this format")),
        ]);
        lines
    }

    fn textures(&self) -> Vec<String> {
        let of = |t: &texmap::scene::Texture| {
            format!("{} {}x{}", t.name, t.width, t.height)
                .trim()
                .to_owned()
        };
        self.scene.textures.iter().map(of).collect()
    }

    fn json(&self) -> Value {
        let scene = &self.scene;
        let animations = self.contents.animations.iter();
        json!({
            "kind": "mesh",
            "format": self.format_name(),
            "triangles": self.triangles(),
            "vertices": self.vertices(),
            "meshes": scene.meshes.len(),
            "materials": scene.materials.iter().map(|m| &m.name).collect::<Vec<_>>(),
            "textures": scene.textures.iter().map(|t| json!({ "name": t.name, "size": [t.width, t.height] })).collect::<Vec<_>>(),
            "cameras": scene.cameras.iter().map(|c| &c.name).collect::<Vec<_>>(),
            "scenes": self.contents.scenes,
            "animations": animations.map(|a| json!({ "name": a.name, "seconds": a.length_s })).collect::<Vec<_>>(),
            "extent": self.corners.map(|corner| corner.to_array()),
            "units": self.units(),
        })
    }
}

/// Names, and what stands for one that is empty.
fn named(names: Vec<&String>) -> Vec<String> {
    let shown = |name: &String| {
        if name.is_empty() {
            "no name".to_owned()
        } else {
            name.clone()
        }
    };
    names.into_iter().map(shown).collect()
}

fn animation(animation: &Animation) -> String {
    let name = animation.name.as_deref().unwrap_or("no name");
    format!("{name} {} s", short(animation.length_s))
}

/// The box around all corners of triangles.
fn corners(scene: &Scene) -> [DVec3; 2] {
    let corners = scene.meshes.iter().flat_map(|mesh| {
        let corners = mesh.triangles.iter().flatten();
        corners.map(|&index| DVec3::from(mesh.positions[index as usize].map(f64::from)))
    });
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    corners
        .fold(none, |[low, high], at| [low.min(at), high.max(at)])
        .map(|corner| corner + scene.origin_in_world)
}
