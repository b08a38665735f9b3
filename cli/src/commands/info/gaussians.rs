//! Describes a file of 3-D Gaussians: their number, harmonics, extent and sizes, read as `resample gaussians` reads them.

use anyhow::{Context, Result, bail};
use glam::DVec3;
use serde_json::{Value, json};
use volsplat::{BlendSpace, GaussianFormat, GaussianLoadOptions, Gaussians};

use super::words::{Line, between, line, short, sides};
use crate::args::InfoArgs;
use crate::process::report;

/// Reads the Gaussians and describes them.
pub(super) fn facts(args: &InfoArgs) -> Result<(Vec<Line>, Value)> {
    let path = &args.input.path;
    if let Some(part) = &args.input.part {
        bail!(
            "{}#{part}: a file of Gaussians has no parts",
            path.display()
        );
    }
    let options = GaussianLoadOptions {
        gate: args.volume.reading.gate(),
    };
    let (gaussians, notes) = volsplat::load_gaussians(path, &options)?;
    report::say_notes(&notes);
    let of_all = gaussians.bounds_in_world(|_| true);
    let facts = Facts {
        format: volsplat::gaussian_format_of(path)?.context("no format")?,
        bounds: of_all.with_context(|| format!("{}: there are no Gaussians", path.display()))?,
        scale: median((0..gaussians.len()).map(|index| {
            let [x, y, z] = gaussians.get(index).scales.to_array().map(f64::from);
            (x * y * z).cbrt()
        })),
        opacity: median((0..gaussians.len()).map(|index| gaussians.get(index).opacity.into())),
        gaussians,
    };
    Ok((facts.lines(), facts.json()))
}

struct Facts {
    format: GaussianFormat,
    gaussians: Gaussians,
    /// Of nearly all, world units.
    bounds: [DVec3; 2],
    /// Geometric mean of the three standard deviations of the median Gaussian, world units.
    scale: f64,
    opacity: f64,
}

impl Facts {
    fn lines(&self) -> Vec<Line> {
        let size = self.bounds[1] - self.bounds[0];
        let space = match self.gaussians.blend_space {
            BlendSpace::Srgb => "display colours (sRGB)",
            BlendSpace::Linear => "linear light",
        };
        let up = match self.format.up_in_world() {
            DVec3::Y => "y, as the format says",
            _ => "-y, as in most files of this kind; the file does not say",
        };
        let bytes = self.gaussians.bytes();
        vec![
            line("format", format!("3-D Gaussians, {}", self.format.name())),
            line(
                "count",
                format!(
                    "{} Gaussians, harmonics of degree {}",
                    self.gaussians.len(),
                    self.gaussians.degree()
                ),
            ),
            line("blended", format!("in {space}")),
            line("extent", sides(size) + ", without floaters"),
            line("", between(self.bounds)),
            line(
                "median",
                format!(
                    "standard deviation {}, opacity {}",
                    short(self.scale),
                    short(self.opacity)
                ),
            ),
            line("up", up),
            line(
                "memory",
                format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20)),
            ),
        ]
    }

    fn json(&self) -> Value {
        json!({
            "kind": "gaussians",
            "format": self.format.name(),
            "gaussians": self.gaussians.len(),
            "degree": self.gaussians.degree(),
            "blend_space": match self.gaussians.blend_space {
                BlendSpace::Srgb => "srgb",
                BlendSpace::Linear => "linear",
            },
            "extent": self.bounds.map(|corner| corner.to_array()),
            "median_scale": self.scale,
            "median_opacity": self.opacity,
            "up": self.format.up_in_world().to_array(),
            "bytes": self.gaussians.bytes(),
        })
    }
}

/// The median; 0 of no numbers.
fn median(numbers: impl Iterator<Item = f64>) -> f64 {
    let mut numbers: Vec<f64> = numbers.collect();
    let middle = numbers.len() / 2;
    if numbers.is_empty() {
        return 0.0;
    }
    *numbers.select_nth_unstable_by(middle, f64::total_cmp).1
}
