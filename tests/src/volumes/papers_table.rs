//! Figure 9 of Yuan, Nguyen, Xu and Chen (2003): splats, points and their mix, beside the paper's own figures.
//!
//! The paper gives counts and times, but neither its transfer functions nor its cameras. A voxel is visible from a
//! threshold on, chosen so that the count of visible voxels is the paper's or next to it. The three views look from
//! one direction: as far away as all voxels are still splats; as near as all are already points; and between them, at
//! the distance where the share of splats is the paper's. The order of compositing is the paper's too.

use glam::DVec3;
use resample_core::{Camera, LookAt};
use volsplat::transfer::{ColourKnot, OpacityKnot};
use volsplat::{
    Described, LoadOptions, RawOptions, RenderOptions, Renderer, TransferFunction, Volume,
    VoxelType, procedural,
};

use crate::data::data_file;

/// A row of the paper's table.
pub struct Row {
    /// The volume's name.
    pub name: &'static str,
    /// Its file in the data folder; `None` for the formula.
    file: Option<&'static str>,
    dims: [usize; 3],
    spacing: [f64; 3],
    /// Least scalar that is visible.
    threshold: f64,
    /// The paper's figures: visible voxels, share of splats in the mixed view, seconds of the three views.
    paper: (u64, f64, [f64; 3]),
}

/// The rows. Engine and Aneurism reach the paper's count exactly, Lobster comes within 0.4 %; the threshold of Skull
/// was never tried, for want of the data.
pub const ROWS: [Row; 5] = [
    Row {
        name: "Engine",
        file: Some("volumes/raw/engine_256x256x128_uint8.raw"),
        dims: [256, 256, 128],
        spacing: [1.0; 3],
        threshold: 71.0,
        paper: (1_160_038, 0.5673, [15.83, 9.76, 1.59]),
    },
    Row {
        name: "Lobster",
        file: Some("volumes/raw/lobster_301x324x56_uint8.raw"),
        dims: [301, 324, 56],
        spacing: [1.0, 1.0, 1.4],
        threshold: 65.0,
        paper: (190_815, 0.4820, [3.18, 1.97, 1.52]),
    },
    Row {
        name: "Aneurism",
        file: Some("volumes/raw/aneurism_256x256x256_uint8.raw"),
        dims: [256; 3],
        spacing: [1.0; 3],
        threshold: 25.0,
        paper: (114_695, 0.7638, [3.78, 3.36, 2.67]),
    },
    Row {
        name: "Skull",
        file: Some("volumes/raw/skull_256x256x256_uint8.raw"),
        dims: [256; 3],
        spacing: [1.0; 3],
        threshold: 40.0,
        paper: (775_985, 0.8874, [10.39, 9.29, 4.87]),
    },
    Row {
        name: "Checker Box",
        file: None,
        dims: [100; 3],
        spacing: [1.0; 3],
        threshold: 1.0,
        paper: (1_000_000, 0.4660, [20.48, 6.72, 2.78]),
    },
];

/// The paper's picture.
const SIZE_PX: u32 = 400;

/// Vertical field of view, degrees. The paper gives none; at 30 every object fits the view that has only splats.
const FOV_Y_DEG: f64 = 30.0;

/// Opacity of a visible voxel. The paper gives none; this one is translucent enough that depth shows.
const OPACITY: f64 = 0.2;

/// From the target to the eye: three faces are seen. The paper gives none.
const TOWARDS_EYE: DVec3 = DVec3::new(0.45, 0.35, 0.82);

/// Halvings of the distance between the outer views: to a tenth of a voxel for any volume of the table.
const HALVINGS: u32 = 12;

/// Figures of a row.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// Visible voxels.
    pub visible: u64,
    /// Share of splats in each view.
    pub splats: [f64; 3],
    /// CPU time of a frame of each view, s.
    pub cpu_s: [f64; 3],
}

impl Row {
    /// A line of the table.
    pub fn line(&self, measured: &Measured) -> String {
        let [x, y, z] = self.dims;
        let (count, share, times) = self.paper;
        let s = measured.cpu_s;
        format!(
            "| {} | {x}x{y}x{z} | {} ({count}) | {:.3} ({}) | {:.3}, {:.2} % ({}, {:.2} %) | {:.3} ({}) |",
            self.name,
            measured.visible,
            s[0],
            times[0],
            s[1],
            100.0 * measured.splats[1],
            times[1],
            100.0 * share,
            s[2],
            times[2]
        )
    }
}

/// The volume of a row; `None` where its file is absent.
fn volume(row: &Row) -> Option<Volume> {
    let Some(file) = row.file else {
        return Some(procedural::checker_box(row.dims[0], 10).expect("a good size"));
    };
    let path = data_file("the paper's table", file)?;
    let options = LoadOptions {
        raw: Some(RawOptions::new(row.dims, VoxelType::U8)),
        spacing: Some(row.spacing),
        ..LoadOptions::default()
    };
    Some(volsplat::load(&path, &options).expect("a raw file"))
}

/// Measures a row with this many frames of each view; `None` where its data is absent.
///
/// # Panics
/// Never: the options are good.
pub fn measured(row: &Row, frames: usize) -> Option<Measured> {
    let volume = volume(row)?;
    let transfer = transfer(row.threshold, &volume);
    let options = RenderOptions::paper();
    let mut renderer = Renderer::new(&volume, &transfer, &options).expect("good options");
    let bounds = renderer
        .visible_bounds_in_world()
        .unwrap_or_else(|| volume.lattice().bounds_in_world());
    let cameras = cameras(row, &volume, &transfer, bounds);
    let mut times = [const { Vec::new() }; 3];
    for _ in 0..frames {
        for (times, camera) in times.iter_mut().zip(&cameras) {
            let frame = renderer.render(camera).expect("a good camera");
            times.push(1e-3 * frame.stats.cpu_ms);
        }
    }
    let mut counter = counting(&volume, &transfer);
    Some(Measured {
        visible: renderer.non_transparent(),
        splats: cameras.map(|camera| splat_share(&mut counter, &camera)),
        cpu_s: times.map(|mut all| {
            all.sort_by(f64::total_cmp);
            all[all.len() / 2]
        }),
    })
}

/// A grey ramp that is visible from the threshold on.
fn transfer(threshold: f64, volume: &Volume) -> TransferFunction {
    let (_, high) = volume.value_range();
    let grey = |value: f64, light: f32| ColourKnot {
        value,
        rgb: [light; 3],
    };
    let colours = vec![grey(threshold, 0.1), grey(high.max(threshold), 1.0)];
    let opacity = |opacity: f64| OpacityKnot {
        value: threshold,
        opacity,
    };
    let opacities = vec![opacity(0.0), opacity(OPACITY)];
    TransferFunction::new(colours, opacities).expect("rising values")
}

/// A renderer that hides nothing, so that every visible voxel is counted.
fn counting(volume: &Volume, transfer: &TransferFunction) -> Renderer {
    let options = RenderOptions {
        min_transmittance: 0.0,
        ..RenderOptions::paper()
    };
    Renderer::new(volume, transfer, &options).expect("good options")
}

/// The share of splats among the samples of a view.
fn splat_share(renderer: &mut Renderer, camera: &Camera) -> f64 {
    let stats = renderer.render(camera).expect("a good camera").stats;
    stats.splats as f64 / (stats.splats + stats.points).max(1) as f64
}

/// The cameras of the three views.
fn cameras(
    row: &Row,
    volume: &Volume,
    transfer: &TransferFunction,
    bounds: [DVec3; 2],
) -> [Camera; 3] {
    let target = 0.5 * (bounds[0] + bounds[1]);
    let direction = TOWARDS_EYE.normalize();
    // Half the extent of the box along the view.
    let depth = 0.5 * (bounds[1] - bounds[0]).dot(direction.abs());
    let at = |distance: f64| {
        let pose = LookAt {
            position: target + distance * direction,
            target,
            up: DVec3::Y,
        };
        Camera::perspective(&pose, FOV_Y_DEG.to_radians(), [SIZE_PX, SIZE_PX]).expect("a good pose")
    };
    // At this camera z, the smallest spacing is one pixel. A voxel more keeps rounding away.
    let spacing = volume.smallest_spacing();
    let one_pixel = at(1.0).fy * spacing;
    let (mut near, mut far) = (
        (one_pixel - depth - spacing).max(spacing),
        one_pixel + depth + spacing,
    );
    let ends = [at(near), at(far)];
    let mut counter = counting(volume, transfer);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (near + far);
        if splat_share(&mut counter, &at(middle)) > row.paper.1 {
            near = middle
        } else {
            far = middle
        }
    }
    [ends[0], at(0.5 * (near + far)), ends[1]]
}
