//! Describes a scan of points, read as `resample points` reads it.

use std::collections::BTreeMap;

use anyhow::{Result, anyhow};
use glam::DVec3;
use resample_cloud::input::{CloudLoadOptions, PointCloudFile, class_name, cloud_format_of, load};
use resample_cloud::usual_spacing;
use serde_json::{Value, json};

use super::words::{Line, between, line, short, sides};
use crate::args::InfoArgs;
use crate::open::points::scan::span;
use crate::process::report;

/// Most memory of a picture over the points, bytes: measured with 5 million points that have all attributes of LAS, at 1920x1080.
const POINT_BYTES: u64 = 105;

/// Reads the scan and describes it.
pub(super) fn facts(args: &InfoArgs) -> Result<(Vec<Line>, Value)> {
    let path = &args.input.path;
    let options = CloudLoadOptions {
        gate: args.volume.reading.gate(),
        points: None,
    };
    let format = cloud_format_of(path)?.ok_or_else(|| anyhow!("{}: no scan", path.display()))?;
    let file = load(path, &options)?;
    report::say_notes(&file.notes);
    let facts = Facts {
        format: format.name(),
        bounds: span(&file),
        spacing: usual_spacing(&file.positions),
        classes: counts(&file),
        file,
    };
    Ok((facts.lines(), facts.json()))
}

struct Facts {
    format: &'static str,
    file: PointCloudFile,
    /// Of the box around all points, world units.
    bounds: [DVec3; 2],
    /// The usual distance between neighbours, world units.
    spacing: Option<f64>,
    /// Points of each class.
    classes: BTreeMap<u8, usize>,
}

impl Facts {
    fn attributes(&self) -> Vec<&'static str> {
        let file = &self.file;
        let all = [
            ("colour", file.colours.is_some()),
            ("intensity", file.intensities.is_some()),
            ("class", file.classes.is_some()),
            ("normal", file.normals.is_some()),
            ("radius", file.radii_in_world.is_some()),
        ];
        all.iter()
            .filter(|(_, has)| *has)
            .map(|(name, _)| *name)
            .collect()
    }

    /// Bytes that drawing the scan takes at most.
    fn memory(&self) -> u64 {
        POINT_BYTES * self.file.positions.len() as u64
    }

    fn lines(&self) -> Vec<Line> {
        let size = self.bounds[1] - self.bounds[0];
        let attributes = match self.attributes() {
            all if all.is_empty() => "none".to_owned(),
            all => all.join(", "),
        };
        let mut lines = vec![
            line("format", self.format),
            line("points", self.file.positions.len().to_string()),
            line("attributes", attributes),
            line("extent", sides(size)),
            line("", between(self.bounds)),
        ];
        if let Some(spacing) = self.spacing {
            lines.push(line(
                "spacing",
                format!("about {} between neighbours", short(spacing)),
            ));
        }
        let classes = self.classes.iter().enumerate();
        lines.extend(classes.map(|(place, (&class, count))| {
            let name = class_name(class).unwrap_or("without a name in LAS");
            let title = if place == 0 { "classes" } else { "" };
            line(title, format!("{class} {name}: {count}"))
        }));
        lines.push(line(
            "memory",
            format!(
                "about {:.0} MB to draw it",
                (self.memory() as f64 / 1e6).ceil()
            ),
        ));
        lines
    }

    fn json(&self) -> Value {
        let classes = self.classes.iter();
        json!({
            "kind": "scan",
            "format": self.format,
            "points": self.file.positions.len(),
            "attributes": self.attributes(),
            "extent": self.bounds.map(|corner| corner.to_array()),
            "spacing": self.spacing,
            "classes": classes.map(|(&class, count)| json!({
                "class": class, "name": class_name(class), "points": count
            })).collect::<Vec<_>>(),
            "memory_bytes": self.memory(),
        })
    }
}

/// How many points each class has.
fn counts(file: &PointCloudFile) -> BTreeMap<u8, usize> {
    let mut counts = BTreeMap::new();
    for &class in file.classes.iter().flatten() {
        *counts.entry(class).or_insert(0) += 1;
    }
    counts
}
