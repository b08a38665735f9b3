//! The end of every reader: points one after another become the lists of a [`PointCloudFile`]. Lists of another program do too.
//!
//! Input: the number of points that the file says, which of their attributes it has, and the points. Output: those that are
//! kept. Of `total` points `keep` are kept where index * keep mod total < keep: evenly, and exactly so many. A total that is
//! only a bound, such as the number of lines, keeps fewer.

use glam::DVec3;
use resample_core::narrow::{code16, count};

use super::file::{CloudLoadOptions, PointCloudFile, PointLists};
use crate::{GridFate, StationGrid};
use resample_core::Error;

/// Places this far from the origin are kept relative to the first one: an f32 beyond has steps of more than 2^-9 units.
const FAR: f64 = 16_384.0;

/// One point; what the file does not have is 0.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Point {
    pub(super) place: DVec3,
    /// 8 or 16 bits in each channel, as [`Has::colours`] says.
    pub(super) colour: [u16; 3],
    pub(super) intensity: f32,
    pub(super) class: u8,
    pub(super) normal: [f32; 3],
    pub(super) radius: f32,
}

/// How a file writes colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Colours {
    #[default]
    None,
    /// 0 to 255.
    Bits8,
    /// 0 to 65535; or to 255, which some programs write although it is wrong.
    Bits16,
}

/// The attributes of the points of a file.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Has {
    pub(super) colours: Colours,
    pub(super) intensities: bool,
    pub(super) classes: bool,
    pub(super) normals: bool,
    pub(super) radii: bool,
}

impl Has {
    /// Bytes of a point while it is read.
    fn bytes(self) -> u64 {
        let colour = match self.colours {
            Colours::None => 0,
            Colours::Bits8 => 3,
            Colours::Bits16 => 6 + 3,
        };
        let sizes = [
            (self.intensities, 4 + 2),
            (self.classes, 1),
            (self.normals, 12),
            (self.radii, 4),
        ];
        let sum: u64 = sizes.iter().map(|(has, size)| u64::from(*has) * size).sum();
        12 + colour + sum
    }
}

/// Bytes of a cell of a station's grid: its place, the number of its point, and its fate.
pub(super) const CELL_BYTES: u64 = 12 + 4 + 1;

/// The grid of a station while it is read.
#[derive(Default)]
pub(super) struct Station {
    grid: StationGrid,
    /// The number of each cell's point among those that are kept.
    points: Vec<Option<PointNumber>>,
}

/// The number of a point, and 1 more, so that a cell without one takes no more room.
type PointNumber = std::num::NonZeroU32;

impl Station {
    /// A grid of so many columns and rows, to which cells are added column by column.
    pub(super) fn growing(size: [usize; 2]) -> Self {
        let grid = StationGrid {
            size,
            places: Vec::new(),
        };
        let points = Vec::new();
        Self { grid, points }
    }

    /// A grid of empty cells, which are set in any order.
    pub(super) fn empty(size: [usize; 2]) -> Self {
        let cells = size[0] * size[1];
        let places = vec![glam::Vec3::NAN; cells];
        Self {
            grid: StationGrid { size, places },
            points: vec![None; cells],
        }
    }

    /// Adds the next cell of the grid: a place relative to the scanner and the number of its point. A cell without a return has a place that
    /// is not finite, and no point.
    pub(super) fn push(&mut self, place: DVec3, point: Option<usize>) {
        self.grid.places.push(place.as_vec3());
        self.points.push(number(point));
    }

    /// Sets the cell in a column and a row; one outside is passed over.
    pub(super) fn set(&mut self, [column, row]: [usize; 2], place: DVec3, point: Option<usize>) {
        let [columns, rows] = self.grid.size;
        if column < columns && row < rows {
            let cell = column * rows + row;
            self.grid.places[cell] = place.as_vec3();
            self.points[cell] = number(point);
        }
    }
}

fn number(point: Option<usize>) -> Option<PointNumber> {
    let next = u32::try_from(point?).ok()?.checked_add(1)?;
    PointNumber::new(next)
}

/// Collects the points of a file.
pub(super) struct Collector {
    has: Has,
    total: u64,
    keep: u64,
    /// Points that came so far.
    index: u64,
    left_out: u64,
    file: PointCloudFile,
    colours: Vec<[u8; 3]>,
    wide_colours: Vec<[u16; 3]>,
    intensities: Vec<f32>,
    classes: Vec<u8>,
    normals: Vec<[f32; 3]>,
    radii: Vec<f32>,
    fates: Vec<GridFate>,
}

impl Collector {
    /// Asks for the memory of so many points, which the caller has held against the file; `beside` bytes are the reader's own.
    pub(super) fn new(
        total: u64,
        has: Has,
        beside: u64,
        options: &CloudLoadOptions,
    ) -> Result<Self, String> {
        let keep = options
            .points
            .map_or(total, |points| total.min(points as u64));
        let bytes = keep.saturating_mul(has.bytes()).saturating_add(beside);
        let asked = options.gate.ask(bytes, &format!("{keep} points"));
        asked.map_err(|what| format!("{what}; --points N keeps N of them"))?;
        let room = |has: bool| if has { count(keep) } else { 0 };
        let mut file = PointCloudFile::default();
        file.positions.reserve_exact(count(keep));
        Ok(Self {
            total,
            keep,
            index: 0,
            left_out: 0,
            file,
            colours: Vec::with_capacity(room(has.colours == Colours::Bits8)),
            wide_colours: Vec::with_capacity(room(has.colours == Colours::Bits16)),
            intensities: Vec::with_capacity(room(has.intensities)),
            classes: Vec::with_capacity(room(has.classes)),
            normals: Vec::with_capacity(room(has.normals)),
            radii: Vec::with_capacity(room(has.radii)),
            fates: Vec::new(),
            has,
        })
    }

    /// Returns true if the next point is kept; one that is not is passed over.
    pub(super) fn wants_next(&mut self) -> bool {
        let place = u128::from(self.index) * u128::from(self.keep);
        let wanted =
            self.index < self.total && place % u128::from(self.total) < u128::from(self.keep);
        self.index += u64::from(!wanted);
        wanted
    }

    /// Takes a point that is wanted; its number, if it has a finite place.
    pub(super) fn take(&mut self, point: &Point) -> Option<usize> {
        self.index += 1;
        if !point.place.is_finite() {
            self.left_out += 1;
            return None;
        }
        if self.file.positions.is_empty() && point.place.abs().max_element() >= FAR {
            self.file.origin_in_world = point.place.round();
        }
        let position = (point.place - self.file.origin_in_world).as_vec3();
        if !position.is_finite() {
            self.left_out += 1;
            return None;
        }
        self.file.positions.push(position.to_array());
        match self.has.colours {
            Colours::None => {}
            Colours::Bits8 => self
                .colours
                .push(point.colour.map(|part| part.min(255) as u8)),
            Colours::Bits16 => self.wide_colours.push(point.colour),
        }
        if self.has.intensities {
            self.intensities.push(point.intensity);
        }
        if self.has.classes {
            self.classes.push(point.class);
        }
        if self.has.normals {
            self.normals.push(point.normal);
        }
        if self.has.radii {
            self.radii.push(point.radius);
        }
        Some(self.file.positions.len() - 1)
    }

    /// Records which points of a station are mixed or crowded by its grid.
    pub(super) fn end_station(&mut self, station: &Station) {
        let fates = station.grid.fates().unwrap_or_default();
        let left = fates.iter().zip(&station.points);
        for (&fate, point) in left.filter(|(fate, _)| **fate != GridFate::Kept) {
            if let Some(point) = point {
                self.fates.resize(self.file.positions.len(), GridFate::Kept);
                self.fates[point.get() as usize - 1] = fate;
            }
        }
    }

    /// A remark for the person who reads the file.
    pub(super) fn note(&mut self, text: String) {
        self.file.notes.push(text);
    }

    /// The file's points.
    pub(super) fn finish(self) -> Result<PointCloudFile, String> {
        let Self {
            has,
            mut file,
            left_out,
            total,
            keep,
            index,
            ..
        } = self;
        if file.positions.is_empty() {
            return Err(match left_out {
                0 => "it holds no points: there is nothing to draw".to_owned(),
                _ => format!(
                    "none of its {left_out} points has a finite place: there is nothing to draw"
                ),
            });
        }
        if keep < total {
            let kept = file.positions.len();
            file.notes.insert(0, kept_note(kept, index));
        }
        if left_out > 0 {
            file.notes.push(format!(
                "{left_out} points without a finite place are left out"
            ));
        }
        if !self.fates.is_empty() {
            let mut fates = self.fates;
            fates.resize(file.positions.len(), GridFate::Kept);
            file.of_grid = Some(fates);
        }
        file.colours = match has.colours {
            Colours::None => None,
            Colours::Bits8 => Some(self.colours),
            Colours::Bits16 => Some(narrowed(&self.wide_colours)),
        };
        file.classes = has.classes.then_some(self.classes);
        file.normals = has.normals.then_some(self.normals);
        file.radii_in_world = has.radii.then_some(self.radii);
        if has.intensities {
            let (stretched, note) = stretched(&self.intensities);
            file.notes.extend(note);
            file.intensities = Some(stretched);
        }
        Ok(file)
    }
}

impl PointCloudFile {
    /// A scan of lists in memory: places are kept relative to an origin and intensities in 16 bits, as those of a file.
    ///
    /// # Errors
    /// [`Error::Input`]: there is no point with a finite place, or a list has another length than that of the places.
    ///
    /// ```
    /// use resample_cloud::input::{PointCloudFile, PointLists};
    ///
    /// let lists = PointLists { places: vec![[5e6, 0.0, 0.25].into()], ..PointLists::default() };
    /// let scan = PointCloudFile::of_lists(&lists)?;
    /// assert_eq!((scan.origin_in_world.x, scan.positions[0]), (5e6, [0.0, 0.0, 0.25]));
    /// # Ok::<(), resample_core::Error>(())
    /// ```
    pub fn of_lists(lists: &PointLists) -> Result<Self, Error> {
        let total = lists.places.len();
        let lengths = [
            ("colours", lists.colours.as_ref().map(Vec::len)),
            ("intensities", lists.intensities.as_ref().map(Vec::len)),
            ("classes", lists.classes.as_ref().map(Vec::len)),
        ];
        for (name, length) in lengths {
            if let Some(length) = length.filter(|length| *length != total) {
                return Err(Error::Input(format!(
                    "{total} places have {length} {name}: expected one for each"
                )));
            }
        }
        let has = Has {
            colours: if lists.colours.is_some() {
                Colours::Bits8
            } else {
                Colours::None
            },
            intensities: lists.intensities.is_some(),
            classes: lists.classes.is_some(),
            ..Has::default()
        };
        let mut collector = Collector::new(total as u64, has, 0, &CloudLoadOptions::default())
            .map_err(Error::Input)?;
        for (row, &place) in lists.places.iter().enumerate() {
            collector.take(&Point {
                place,
                colour: lists
                    .colours
                    .as_ref()
                    .map_or([0; 3], |all| all[row].map(u16::from)),
                intensity: lists.intensities.as_ref().map_or(0.0, |all| all[row]),
                class: lists.classes.as_ref().map_or(0, |all| all[row]),
                ..Point::default()
            });
        }
        collector.finish().map_err(Error::Input)
    }

    /// So many of the points, evenly from their order, as a reader keeps them: all where there are no more.
    #[must_use]
    pub fn thinned(&self, points: usize) -> Self {
        let (total, keep) = (self.positions.len() as u128, points as u128);
        if keep >= total {
            return self.clone();
        }
        let is_kept = |index: usize| index as u128 * keep % total < keep;
        let mut notes = self.notes.clone();
        notes.insert(0, kept_note(points, total));
        Self {
            origin_in_world: self.origin_in_world,
            positions: picked(&self.positions, is_kept),
            colours: self.colours.as_ref().map(|all| picked(all, is_kept)),
            intensities: self.intensities.as_ref().map(|all| picked(all, is_kept)),
            classes: self.classes.as_ref().map(|all| picked(all, is_kept)),
            normals: self.normals.as_ref().map(|all| picked(all, is_kept)),
            radii_in_world: self.radii_in_world.as_ref().map(|all| picked(all, is_kept)),
            of_grid: self.of_grid.as_ref().map(|all| picked(all, is_kept)),
            notes,
        }
    }
}

fn picked<T: Copy>(all: &[T], is_kept: impl Fn(usize) -> bool) -> Vec<T> {
    let numbered = all.iter().enumerate();
    numbered
        .filter_map(|(index, value)| is_kept(index).then_some(*value))
        .collect()
}

fn kept_note(kept: usize, total: impl std::fmt::Display) -> String {
    format!("{kept} of its {total} points are kept, evenly from their order")
}

/// The upper 8 of 16 bits; or the lower ones where no colour uses the upper.
fn narrowed(colours: &[[u16; 3]]) -> Vec<[u8; 3]> {
    let is_wide = colours.iter().flatten().any(|part| *part > 255);
    let shift = if is_wide { 8 } else { 0 };
    let narrow = |colour: &[u16; 3]| colour.map(|part| (part >> shift) as u8);
    colours.iter().map(narrow).collect()
}

/// Intensities in 16 bits. Whole numbers within the range stay as they are; others are stretched to it, with a note.
fn stretched(intensities: &[f32]) -> (Vec<u16>, Option<String>) {
    let finite = || {
        intensities
            .iter()
            .copied()
            .filter(|value| value.is_finite())
    };
    let (least, most) = finite().fold((f32::MAX, f32::MIN), |(least, most), value| {
        (least.min(value), most.max(value))
    });
    let is_whole = finite().all(|value| value.fract() == 0.0 && (0.0..=65_535.0).contains(&value));
    // A scan of 0 and 1 alone, or of halves of 1, has its full range there.
    if is_whole && most > 1.0 || least > most {
        return (
            intensities
                .iter()
                .map(|value| code16(f64::from(*value)))
                .collect(),
            None,
        );
    }
    let (least, most) = if least >= 0.0 && most <= 1.0 {
        (0.0, 1.0)
    } else {
        (least, most)
    };
    let scale = if most > least {
        65_535.0 / (most - least)
    } else {
        0.0
    };
    let code = |value: &f32| code16(f64::from((value - least) * scale));
    let note = format!("its intensities from {least} to {most} are stretched to 16 bits");
    (intensities.iter().map(code).collect(), Some(note))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Takes the next point, if it is wanted.
    fn push(collector: &mut Collector, point: &Point) {
        if collector.wants_next() {
            collector.take(point);
        }
    }

    fn kept(total: u64, keep: usize) -> Vec<f32> {
        let options = CloudLoadOptions {
            points: Some(keep),
            ..CloudLoadOptions::default()
        };
        let mut collector = Collector::new(total, Has::default(), 0, &options).expect("room");
        for index in 0..total {
            let place = DVec3::new(index as f64, 0.0, 0.0);
            push(
                &mut collector,
                &Point {
                    place,
                    ..Point::default()
                },
            );
        }
        let file = collector.finish().expect("points");
        file.positions.iter().map(|[x, ..]| *x).collect()
    }

    #[test]
    fn points_are_thinned_evenly_and_exactly() {
        assert_eq!(kept(10, 5), [0.0, 2.0, 4.0, 6.0, 8.0]);
        assert_eq!(kept(10, 20).len(), 10);
        for keep in [1, 3, 7, 99, 100] {
            let kept = kept(100, keep);
            assert_eq!(kept.len(), keep);
            let steps = kept.windows(2).map(|pair| pair[1] - pair[0]);
            let even = 100.0 / keep as f32;
            assert!(steps.into_iter().all(|step| (step - even).abs() < 1.0));
        }
    }

    #[test]
    fn lists_become_a_scan_that_is_thinned_like_a_file() {
        let lists = PointLists {
            places: (0..10)
                .map(|x| DVec3::new(f64::from(x), 0.0, 0.0))
                .collect(),
            intensities: Some((0..10u8).map(|x| f32::from(x) / 9.0).collect()),
            classes: Some((0..10).collect()),
            ..PointLists::default()
        };
        let scan = PointCloudFile::of_lists(&lists).expect("points");
        assert_eq!(scan.intensities.as_ref().expect("there")[9], 65_535);
        let thin = scan.thinned(5);
        assert_eq!(thin.classes, Some(vec![0, 2, 4, 6, 8]));
        assert_eq!(thin.positions[4], [8.0, 0.0, 0.0]);
        assert!(thin.notes[0].contains("5 of its 10"), "{:?}", thin.notes);
        assert_eq!(scan.thinned(11), scan);
        let short = PointLists {
            colours: Some(vec![[0; 3]; 9]),
            ..lists
        };
        let why = PointCloudFile::of_lists(&short).expect_err("short");
        assert!(
            why.to_string().contains("10 places have 9 colours"),
            "{why}"
        );
        assert!(PointCloudFile::of_lists(&PointLists::default()).is_err());
    }

    #[test]
    fn far_places_keep_their_fraction() {
        let options = CloudLoadOptions::default();
        let mut collector = Collector::new(2, Has::default(), 0, &options).expect("room");
        for x in [500_000.25, 500_001.0] {
            let place = DVec3::new(x, 0.0, 5e6);
            push(
                &mut collector,
                &Point {
                    place,
                    ..Point::default()
                },
            );
        }
        let file = collector.finish().expect("points");
        assert_eq!(file.origin_in_world, DVec3::new(500_000.0, 0.0, 5e6));
        assert_eq!(file.positions, [[0.25, 0.0, 0.0], [1.0, 0.0, 0.0]]);
    }

    #[test]
    fn colours_and_intensities_fit_their_bits() {
        assert_eq!(narrowed(&[[0xff00, 0x1234, 7]]), [[255, 0x12, 0]]);
        assert_eq!(narrowed(&[[255, 18, 7]]), [[255, 18, 7]], "8 bits in 16");
        assert_eq!(stretched(&[0.0, 300.0]), (vec![0, 300], None));
        assert_eq!(stretched(&[0.0, 0.5]).0, [0, 32_768]);
        assert_eq!(stretched(&[-2048.0, 2047.0, f32::NAN]).0, [0, 65_535, 0]);
        assert_eq!(stretched(&[-3.0, -3.0]).0, [0, 0]);
    }

    #[test]
    fn memory_is_asked_for_before_points_come() {
        let gate = resample_io::Gate::new(resample_io::Outside::Refused, Some(1000));
        let options = |points| CloudLoadOptions {
            gate: gate.clone(),
            points,
        };
        let refused = Collector::new(1 << 40, Has::default(), 0, &options(None)).err();
        let why = refused.expect("too many");
        assert!(
            why.contains("1099511627776 points take 13194.1 GB") && why.contains("--points"),
            "{why}"
        );
        assert!(Collector::new(1 << 40, Has::default(), 0, &options(Some(50))).is_ok());
    }
}
