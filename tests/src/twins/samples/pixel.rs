//! One pixel of the reference renderer: all samples in order, each over the next.

use glam::DVec2;
use resample_core::OpacityMode;

use super::{Kind, ReferencePixel, Sample, Setup, TILE};

/// The accumulated values of a pixel.
#[derive(Default)]
struct Gathered {
    transmittance: f64,
    rgb: [f64; 3],
    depth: f64,
    swap_cost: f64,
    phase_cost: f64,
    /// Depth, opacity and colour of the splats that the sorting keys cannot tell from the next one.
    recent: Vec<(f64, f64, [f64; 3])>,
}

/// Points of one depth range.
#[derive(Default)]
struct Sheet {
    number: f64,
    added: f64,
    coloured: [f64; 3],
    depth: f64,
}

impl Setup<'_> {
    pub(crate) fn pixel(&self, samples: &[Sample], [x, y]: [usize; 2]) -> ReferencePixel {
        let ray = self.rays.pixel(x, y);
        let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let touches = |s: &Sample| {
            let inside =
                |[first, end]: [usize; 2], at: usize| first <= at / TILE && at / TILE < end;
            inside(s.tiles[0], x) && inside(s.tiles[1], y)
        };
        let quantum = relative_quantum(samples.iter().filter(|s| touches(s)));
        let mut sum = Gathered {
            transmittance: 1.0,
            ..Gathered::default()
        };
        let mut sheet = Sheet::default();
        for sample in samples.iter().filter(|s| touches(s)) {
            let number = match self.slices {
                Some(_) => sample.rank,
                None => (sample.depth / self.sheet_thickness).floor(),
            };
            match sample.kind {
                Kind::Point { mass } => {
                    if number != sheet.number {
                        self.close(&mut sheet, &mut sum);
                        sheet.number = number;
                    }
                    let weight = point_weight(centre, sample.screen);
                    sheet.add(weight * mass, sample);
                    let moved =
                        PHASE_SHIFTS.map(|by| point_weight(centre, sample.screen + by) - weight);
                    let change = moved.iter().fold(0.0f64, |most, w| most.max(w.abs()));
                    sum.phase_cost += sum.transmittance * mass * change;
                }
                Kind::Near | Kind::Splat | Kind::Ewa(_) => {
                    let added = match &sample.kind {
                        Kind::Ewa(ewa) => ewa.value(&self.kernel, centre - sample.screen),
                        _ => self.along_ray(sample, &ray),
                    };
                    let in_slice = self.slices.is_some() && !matches!(sample.kind, Kind::Near);
                    if !in_slice || number != sheet.number {
                        self.close(&mut sheet, &mut sum);
                        sheet.number = number;
                    }
                    if in_slice {
                        sheet.add(added, sample);
                        continue;
                    }
                    sum.over(self.opacity(added), sample.rgb, (sample.depth, quantum));
                }
            }
        }
        self.close(&mut sheet, &mut sum);
        let opacity = 1.0 - sum.transmittance;
        let z_per_depth = 1.0 / ray.world_per_z;
        let depth = if opacity > 0.0 {
            sum.depth / opacity * z_per_depth
        } else {
            f64::INFINITY
        };
        let Gathered {
            transmittance,
            rgb,
            swap_cost,
            phase_cost,
            ..
        } = sum;
        ReferencePixel {
            rgb,
            transmittance,
            depth,
            swap_cost,
            phase_cost,
        }
    }

    fn opacity(&self, added: f64) -> f64 {
        match self.scene.options.opacity {
            OpacityMode::Extinction => -(-added).exp_m1(),
            OpacityMode::Linear => added.min(1.0),
        }
    }

    /// Composites the sheet as one sample of the mean colour and depth, and empties it.
    fn close(&self, sheet: &mut Sheet, sum: &mut Gathered) {
        let full = std::mem::take(sheet);
        sheet.number = full.number;
        if full.added > 0.0 {
            let mean = full.coloured.map(|c| c / full.added);
            sum.over(
                self.opacity(full.added),
                mean,
                (full.depth / full.added, 0.0),
            );
        }
    }
}

impl Sheet {
    fn add(&mut self, added: f64, sample: &Sample) {
        self.added += added;
        self.depth += added * sample.depth;
        for (sum, c) in self.coloured.iter_mut().zip(sample.rgb) {
            *sum += added * c;
        }
    }
}

impl Gathered {
    fn over(&mut self, opacity: f64, rgb: [f64; 3], (depth, quantum): (f64, f64)) {
        self.recent
            .retain(|(before, ..)| depth - before <= quantum * depth);
        for (_, other, colour) in &self.recent {
            let apart = colour
                .iter()
                .zip(rgb)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            // Either order lets one of the two colours through the other's opacity; the transmittance in front is the
            // one before the earlier of them, which is at most this one divided by what the earlier let pass.
            self.swap_cost += self.transmittance / (1.0 - other).max(0.1) * other * opacity * apart;
        }
        let weight = self.transmittance * opacity;
        self.transmittance -= weight;
        for (sum, c) in self.rgb.iter_mut().zip(rgb) {
            *sum += weight * c;
        }
        self.depth += weight * depth;
        if quantum > 0.0 && opacity > 0.0 {
            self.recent.push((depth, opacity, rgb));
        }
    }
}

/// Where a point may stand at most when it is moved to the nearest of 256 positions a pixel along each axis.
const PHASE_SHIFTS: [DVec2; 4] = {
    const FAR: f64 = 1.0 / 512.0;
    [
        DVec2::new(FAR, FAR),
        DVec2::new(FAR, -FAR),
        DVec2::new(-FAR, FAR),
        DVec2::new(-FAR, -FAR),
    ]
};

/// Weight of a point at a pixel: the product of those along the axes.
pub(crate) fn point_weight(pixel_centre: DVec2, point: DVec2) -> f64 {
    let offset = pixel_centre - point;
    axis_weight(offset.x, point.x) * axis_weight(offset.y, point.y)
}

/// Weight of the pixel whose centre is `offset` from a point at `position`: a Gaussian of sigma 1/2 px shifted to reach
/// 0 at 2 px, over the sum of those of all pixels in reach.
fn axis_weight(offset: f64, position: f64) -> f64 {
    let gaussian = |d: f64| ((-2.0 * d * d).exp() - (-8.0f64).exp()).max(0.0);
    let first = (position - 3.5).floor();
    let sum: f64 = (0..8)
        .map(|i| gaussian(first + f64::from(i) + 0.5 - position))
        .sum();
    gaussian(offset) / sum
}

/// Depths that differ by less than this share may be taken in either order: lists of 64 and more are sorted by 16 bits
/// of the range of their f32 depths' bit patterns.
fn relative_quantum<'a>(samples: impl Iterator<Item = &'a Sample>) -> f64 {
    let bits: Vec<u32> = samples
        .filter(|s| !matches!(s.kind, Kind::Near))
        .map(|s| (s.depth as f32).to_bits())
        .collect();
    let (Some(least), Some(most)) = (bits.iter().min(), bits.iter().max()) else {
        return 0.0;
    };
    if bits.len() < 64 {
        // Every bit counts; f32 itself may still round two depths into one, or over one another.
        return f64::from(f32::EPSILON);
    }
    let steps = 1u64 << (32 - (most - least).leading_zeros()).saturating_sub(16);
    // One step of the bit pattern is at most 2^-23 of the depth; both depths may lie at the ends of their step.
    (steps + 4) as f64 * 2f64.powi(-23)
}
