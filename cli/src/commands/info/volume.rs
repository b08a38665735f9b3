//! Describes a volume file: its size, place and values.
//!
//! The volume is read as `resample volsplat` would read it, with the same options, so that the drawn volume is
//! the one described here.

use std::path::Path;

use anyhow::Result;
use glam::DVec3;
use resample_io::memory;
use serde_json::{Value, json};
use volsplat::input::{ImageChannel, format_of, peek};
use volsplat::large::most_brick_bytes;
use volsplat::transfer::Histogram;
use volsplat::{Described, Lattice, LoadOptions, RenderOptions, VoxelType};

use super::words::{Line, between, line, short, sides};
use crate::args::{InfoArgs, ReadingArgs};
use crate::open::volume::data::look_through;
use crate::open::volume::file::load_options;
use crate::process::report;
use crate::process::report::Progress;

/// Bars of the histogram: a line of them fits a terminal of 80 columns beside two numbers.
const BARS: usize = 48;

/// Heights of a bar, the lowest first.
const HEIGHTS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// Degrees below which an axis counts as not tilted: half of what one decimal can show.
const TILT_SHOWN_DEG: f64 = 0.05;

/// Reads the volume and describes it; of a volume over time the first step.
pub(super) fn facts(args: &InfoArgs) -> Result<(Vec<Line>, Value)> {
    let Some(steps) = volsplat::input::step_files(&args.input.path)? else {
        return facts_of_one(args);
    };
    let mut first = args.clone();
    first.input.path = steps.first().cloned().unwrap_or_default();
    let (mut lines, mut json) = facts_of_one(&first)?;
    let name = first.input.path.display();
    lines.push(line(
        "steps",
        format!("{}; the values are those of {name}", steps.len()),
    ));
    json["steps"] = json!(steps.len());
    Ok((lines, json))
}

fn facts_of_one(args: &InfoArgs) -> Result<(Vec<Line>, Value)> {
    let mut options = load_options(&args.volume, &args.input, &args.volume.reading.gate())?;
    let axes = volsplat::input::axes_of(&args.input.path, &options)?;
    let has_channels = axes.channels.len() > 1 && options.component.is_none();
    if has_channels {
        // The values below are those of the first channel.
        options.component = Some(0);
    }
    if args.volume.reading.max_memory.is_none()
        && let Some(enough) = enough_to_look_through(args, &options)?
    {
        let reading = ReadingArgs {
            max_memory: Some(enough),
            ..args.volume.reading
        };
        options.gate = reading.gate();
    }
    let colours = match has_channels {
        true => None,
        false => volsplat::input::colours_of(&args.input.path, &options)?,
    };
    if colours.is_some() {
        // The values below are those of red.
        options.component = Some(0);
    }
    let drawn = RenderOptions::default();
    let facts = match look_through(&args.input.path, &options, &drawn, Progress::Shown)? {
        Some(volume) => Facts::of(args, volume.as_ref())?,
        None => Facts::of(args, &volsplat::load(&args.input.path, &options)?)?,
    };
    options
        .gate
        .remarks()
        .iter()
        .for_each(|text| report::say(&format!("note: {text}")));
    let (mut lines, mut json) = (facts.lines(), facts.json());
    if let Some(count) = colours {
        lines.insert(
            3,
            line(
                "colours",
                format!("{count} a voxel; the values are those of red"),
            ),
        );
        json["colours"] = json!(count);
    }
    if has_channels {
        lines.push(line("channels", axes.numbered_names()));
        lines.push(line("", "the values are those of channel 0"));
        json["channels"] = axes.channels.iter().map(channel_json).collect();
    }
    if axes.times > 1 {
        let first = options.time.unwrap_or(0);
        lines.push(line(
            "times",
            format!(
                "{}; the values are those of time {first} (FILE#time=N draws one, FILE#time=all a film)",
                axes.times
            ),
        ));
        json["times"] = json!(axes.times);
    }
    if args.volume.dims.is_none() {
        add_arrays(&args.input.path, &options, &mut lines, &mut json)?;
    }
    Ok((lines, json))
}

/// Lists the arrays of a file that holds several, and marks the one that is drawn.
fn add_arrays(
    path: &Path,
    options: &LoadOptions,
    lines: &mut Vec<Line>,
    json: &mut Value,
) -> Result<()> {
    let (arrays, read) = volsplat::input::arrays_of(path)?;
    if arrays.len() < 2 {
        return Ok(());
    }
    let drawn = options.array.clone().or(read);
    let marked = |name: &String| match Some(name) == drawn.as_ref() {
        true => format!("{name} (drawn)"),
        false => name.clone(),
    };
    let names: Vec<String> = arrays.iter().map(marked).collect();
    lines.push(line(
        "arrays",
        format!("{}; FILE#array=NAME draws another", names.join(", ")),
    ));
    json["arrays"] = json!(arrays);
    json["array"] = json!(drawn);
    Ok(())
}

fn channel_json(channel: &ImageChannel) -> Value {
    json!({
        "name": channel.name,
        "colour": channel.rgb.map(|[red, green, blue]| format!("#{red:02x}{green:02x}{blue:02x}")),
        "window": channel.window,
        "shown": channel.is_shown,
    })
}

/// Memory for a volume that is only looked at, where it is larger than half of what there is: a quarter of that.
fn enough_to_look_through(args: &InfoArgs, options: &LoadOptions) -> Result<Option<u64>> {
    let Some((lattice, voxel_type)) = peek(&args.input.path, options)? else {
        return Ok(None);
    };
    let bytes = (lattice.len() as u64).saturating_mul(voxel_type.bytes() as u64);
    Ok(report::available_bytes()
        .filter(|available| bytes > available / 2)
        .map(|available| available / 4))
}

/// Facts beside the volume's own fields.
struct Facts {
    format: &'static str,
    kind: VoxelType,
    /// World corners of the box around all voxels.
    corners: [DVec3; 2],
    /// Least and greatest value.
    range: (f64, f64),
    bars: Bars,
    lattice: Lattice,
    memory: Memory,
}

/// Memory of a drawing, bytes.
struct Memory {
    voxels: u64,
    /// Beside the voxels, if all of them are visible.
    most_bricks: u64,
    /// Available memory, where the system knows it.
    available: Option<u64>,
}

/// A histogram of few bins.
struct Bars {
    low: f64,
    high: f64,
    counts: Vec<u64>,
}

impl Facts {
    fn of(args: &InfoArgs, volume: &dyn Described) -> Result<Self> {
        let lattice = volume.lattice();
        let memory = Memory {
            voxels: lattice.len() as u64 * volume.voxel_type().bytes() as u64,
            most_bricks: most_brick_bytes(&lattice, volume.voxel_type(), &RenderOptions::default()),
            available: report::available_bytes(),
        };
        let told = if args.volume.dims.is_some() {
            None
        } else {
            format_of(&args.input.path)?
        };
        Ok(Self {
            format: told.map_or("headerless", |format| format.name()),
            kind: volume.voxel_type(),
            corners: volume.lattice().bounds_in_world(),
            range: volume.value_range(),
            bars: Bars::of(&volume.histogram()),
            lattice,
            memory,
        })
    }

    fn json(&self) -> Value {
        let volume = &self.lattice;
        let map = volume.world_from_index;
        json!({
            "kind": "volume",
            "format": self.format,
            "dims": volume.dims,
            "voxels": volume.len(),
            "type": self.kind.name(),
            "bytes": self.memory.voxels,
            "most_brick_bytes": self.memory.most_bricks,
            "available_bytes": self.memory.available,
            "spacing": volume.spacing(),
            "origin": map.translation.to_array(),
            "axes": [map.matrix3.x_axis.to_array(), map.matrix3.y_axis.to_array(), map.matrix3.z_axis.to_array()],
            "left_handed": map.matrix3.determinant() < 0.0,
            "extent": self.corners.map(|corner| corner.to_array()),
            "space": volume.space,
            "unit": volume.length_unit(),
            "up": volume.up_hint.map(|up| up.to_array()),
            "range": [self.range.0, self.range.1],
            "window": volume.window,
            "histogram": { "low": self.bars.low, "high": self.bars.high, "counts": self.bars.counts },
        })
    }

    fn lines(&self) -> Vec<Line> {
        let volume = &self.lattice;
        let ([x, y, z], [dx, dy, dz]) = (volume.dims, volume.spacing().map(short));
        let [low, high] = self.corners;
        let size = high - low;
        let space = volume.space.clone();
        let unit = volume.length_unit().map(|unit| format!(" {unit}"));
        let unit = unit.unwrap_or_default();
        let bars = &self.bars;
        let between_values = |[low, high]: [f64; 2]| format!("{} to {}", short(low), short(high));
        let mut lines = vec![
            line("format", self.format),
            line("size", format!("{x} x {y} x {z}, {} voxels", volume.len())),
            line("type", self.kind.name()),
            line("spacing", format!("{dx} x {dy} x {dz}{unit}")),
            line("extent", format!("{}{unit}", sides(size))),
            line("", between(self.corners)),
            line("axes", orientation(volume)),
            line("space", space.unwrap_or_else(|| "not named".to_owned())),
            line("values", between_values(self.range.into())),
        ];
        let window = volume.window.map(between_values);
        lines.extend(window.map(|ends| line("window", format!("{ends}, of slices"))));
        lines.extend([
            line("memory", self.memory.text()),
            line(
                "histogram",
                format!("{} {} {}", short(bars.low), bars.line(), short(bars.high)),
            ),
        ]);
        lines
    }
}

impl Memory {
    fn text(&self) -> String {
        let human = memory::human;
        let most = self.voxels.saturating_add(self.most_bricks);
        let needed = format!(
            "{} for the voxels, up to {} to draw them",
            human(self.voxels),
            human(most)
        );
        match self.available {
            Some(available) if most > available => {
                format!(
                    "{needed}, of {} available: draw it with --max-memory",
                    human(available)
                )
            }
            Some(available) => format!("{needed}, of {} available", human(available)),
            None => needed,
        }
    }
}

impl Bars {
    fn of(histogram: &Histogram) -> Self {
        let (low, high) = histogram.range();
        let held = histogram.counts();
        let bars = BARS.min(held.len());
        let mut counts = vec![0; bars];
        for (bin, count) in held.iter().enumerate() {
            counts[bin * bars / held.len()] += count;
        }
        Self { low, high, counts }
    }

    /// Bars on a logarithmic scale, because background outnumbers everything else; a space where nothing is.
    fn line(&self) -> String {
        let most = self.counts.iter().copied().max().unwrap_or(0) as f64;
        let bar = |&count: &u64| {
            let share = (count as f64).ln_1p() / most.ln_1p();
            let height = (share * HEIGHTS.len() as f64).ceil() as usize;
            if count == 0 {
                ' '
            } else {
                HEIGHTS[height.clamp(1, HEIGHTS.len()) - 1]
            }
        };
        self.counts.iter().map(bar).collect()
    }
}

/// Where the three axes of the lattice point.
fn orientation(volume: &Lattice) -> String {
    let map = volume.world_from_index.matrix3;
    let axes = [("x", map.x_axis), ("y", map.y_axis), ("z", map.z_axis)];
    let named = axes.map(|(name, axis)| format!("{name} along {}", direction(axis)));
    let hand = if map.determinant() < 0.0 {
        "; left-handed"
    } else {
        ""
    };
    let up = volume
        .up_hint
        .map_or(String::new(), |up| format!("; up is {}", direction(up)));
    format!("{}{hand}{up}", named.join(", "))
}

/// The world axis closest to a direction, and how far it is from it.
fn direction(axis: DVec3) -> String {
    let sides = ["x", "y", "z"];
    let place = (0..3)
        .max_by(|&a, &b| axis[a].abs().total_cmp(&axis[b].abs()))
        .unwrap_or(0);
    let sign = if axis[place] < 0.0 { '-' } else { '+' };
    let tilt_deg = (axis[place].abs() / axis.length())
        .min(1.0)
        .acos()
        .to_degrees();
    let tilt = if tilt_deg < TILT_SHOWN_DEG {
        String::new()
    } else {
        format!(" tilted by {tilt_deg:.1} degrees")
    };
    format!("{sign}{}{tilt}", sides[place])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_name_the_closest_axis_and_the_tilt() {
        assert_eq!(direction(DVec3::new(0.0, -2.0, 0.0)), "-y");
        assert_eq!(
            direction(DVec3::new(0.0, 0.8, -0.6)),
            "+y tilted by 36.9 degrees"
        );
    }

    #[test]
    fn bars_are_logarithmic_and_empty_bins_are_blank() {
        let bars = Bars {
            low: 0.0,
            high: 3.0,
            counts: vec![1_000_000, 0, 1, 999],
        };
        assert_eq!(bars.line(), "█ ▁▄", "log(1e6), nothing, log(2), log(1e3)");
    }
}
