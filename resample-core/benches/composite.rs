//! How long it takes to composite one tile, for splats of three sizes and for points, at each level of vector
//! instructions; and for splats of one size, under each rule of the index.
//!
//! Items are primitives of the tile's list, whether or not they cover the whole tile. Opacities are low and the tile
//! never counts as opaque, so every entry is composited.

mod inputs;

use divan::Bencher;
use divan::counter::ItemsCount;
use resample_core::composite::{DepthRule, IndexRule, TileSettings, TileWork, composite_tile};
use resample_core::point::PixelFilter;
use resample_core::simd::SimdLevel;
use resample_core::sort::{depth_key, entry};
use resample_core::table::FootprintProfile;
use resample_core::tile::{POINT_ROWS, Primitive, TILE_PX};
use resample_core::{Kernel, KernelShape, OpacityMode};

/// Entries of the list: about what a tile of a close view holds before it is opaque.
const COUNT: usize = 1024;

/// First pixel of the tile, away from the picture's corner.
const CORNER_PX: [usize; 2] = [160, 160];

fn main() {
    inputs::measure();
}

#[divan::bench(args = SimdLevel::ALL)]
fn points(bencher: Bencher, level: SimdLevel) {
    composite(
        bencher,
        &settings(level, IndexRule::Direct),
        &list(2.0, point),
    );
}

#[divan::bench(args = SimdLevel::ALL)]
fn splats_2_px(bencher: Bencher, level: SimdLevel) {
    composite(
        bencher,
        &settings(level, IndexRule::Direct),
        &list(2.0, splat),
    );
}

#[divan::bench(args = SimdLevel::ALL)]
fn splats_4_px(bencher: Bencher, level: SimdLevel) {
    composite(
        bencher,
        &settings(level, IndexRule::Direct),
        &list(4.0, splat),
    );
}

#[divan::bench(args = SimdLevel::ALL)]
fn splats_16_px(bencher: Bencher, level: SimdLevel) {
    composite(
        bencher,
        &settings(level, IndexRule::Direct),
        &list(16.0, splat),
    );
}

#[divan::bench(args = SimdLevel::ALL)]
fn splats_4_px_cone_corrected(bencher: Bencher, level: SimdLevel) {
    composite(
        bencher,
        &settings(level, IndexRule::ConeCorrected),
        &list(4.0, splat),
    );
}

fn composite(bencher: Bencher, settings: &TileSettings, primitives: &[Primitive]) {
    let entries: Vec<u64> = primitives
        .iter()
        .zip(0..)
        .map(|(p, i)| entry(depth_key(p.depth), i))
        .collect();
    bencher
        .counter(ItemsCount::new(primitives.len()))
        .with_inputs(TileWork::default)
        .bench_local_refs(|tile| {
            composite_tile(settings, tile, CORNER_PX, &entries, &[primitives])
        });
}

fn settings(level: SimdLevel, index: IndexRule) -> TileSettings {
    TileSettings {
        level: level.resolve(),
        profile: FootprintProfile::new(&Kernel::new(KernelShape::Gaussian)),
        filter: PixelFilter::new(),
        opacity: OpacityMode::Extinction,
        index,
        depth: DepthRule::Skip,
        // Ten points a sheet.
        sheet_thickness: 10.0,
        min_transmittance: 0.0,
    }
}

/// Primitives whose footprints of `radius_px` touch the tile, in order of depth, one unit apart.
fn list(radius_px: f64, primitive: fn([f32; 2], f32) -> Primitive) -> Vec<Primitive> {
    let places = inputs::spread(2 * COUNT, -radius_px, TILE_PX as f64 + radius_px);
    let at = |pair: &[f64]| {
        [
            pair[0] as f32 + CORNER_PX[0] as f32,
            pair[1] as f32 + CORNER_PX[1] as f32,
        ]
    };
    let placed = places.chunks(2).zip(0..COUNT);
    placed
        .map(|(pair, i)| Primitive {
            depth: i as f32,
            ..primitive(at(pair), radius_px as f32)
        })
        .collect()
}

fn point([x, y]: [f32; 2], _: f32) -> Primitive {
    Primitive {
        x,
        y,
        strength: 0.01,
        rgb: [0.5, 0.6, 0.7],
        rows: POINT_ROWS,
        ..Primitive::default()
    }
}

fn splat([x, y]: [f32; 2], radius_px: f32) -> Primitive {
    let form = radius_px.powi(-2);
    Primitive {
        x,
        y,
        form: [form, 0.0, form],
        sin2_cone: 1e-3,
        strength: 0.001,
        rgb: [0.5, 0.6, 0.7],
        rows: [(y - radius_px) as u16, (y + radius_px) as u16 + 1],
        ..Primitive::default()
    }
}
