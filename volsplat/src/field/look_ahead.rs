//! Reads the tables of a brick while another is drawn, so that the cache has them when its samples are taken.
//!
//! A brick's tables are a few kilobytes that no tile has read for long. Lit pictures of the Engine took 0.85 of the time with
//! this, unlit ones 0.92 to 0.97 (2026-11-23, Zen 5).

use std::hint::black_box;

use crate::bricks::cells::{CELL_ROWS, CellBrick, VERTEX_SIDE};
use crate::bricks::gradients::Gradients;
use crate::bricks::scalars::Scalars;
use crate::field::setup::settings::{FieldSettings, Rule};

/// Bytes of a line of the cache, on all machines that have vectors which we use.
const LINE_BYTES: usize = 64;

/// Reads one number of each line, of bricks that are drawn by samples in cells. Statistics pass over most bricks unread, and
/// cutting shells into segments takes much longer than waiting for tables.
pub(crate) fn touch(settings: &FieldSettings, brick: &CellBrick) {
    if settings.walks_rays() {
        return;
    }
    let is_lit = match settings.rule() {
        Rule::Over => false,
        Rule::Shaded => true,
        Rule::Mixed | Rule::Statistic => return,
    };
    let [least, greatest] = brick.bounds.range();
    let layers = usize::from(least[2])..usize::from(greatest[2]) + 1;
    let vertices = layers.start * LAYER..layers.end * LAYER;
    let mut read = 0;
    match &brick.scalars {
        Scalars::Bytes(faces) => {
            let faces = &faces[layers.start * CELL_ROWS..layers.end * CELL_ROWS];
            for line in faces.chunks(LINE_BYTES / size_of::<u32>()) {
                read ^= line[0];
            }
        }
        Scalars::Numbers(table) => {
            for line in table[vertices.clone()].chunks(LINE_BYTES / size_of::<f32>()) {
                read ^= line[0].to_bits();
            }
        }
    }
    match brick.gradients.as_ref().filter(|_| is_lit) {
        Some(Gradients::Vectors(table)) => {
            for line in table[vertices].chunks(LINE_BYTES / size_of::<[f32; 4]>()) {
                read ^= line[0][0].to_bits();
            }
        }
        Some(Gradients::Differences(table)) => {
            for line in table[vertices].chunks(LINE_BYTES / size_of::<u32>()) {
                read ^= line[0];
            }
        }
        None => {}
    }
    black_box(read);
}

/// Vertices of a layer of a brick.
const LAYER: usize = VERTEX_SIDE * VERTEX_SIDE;
