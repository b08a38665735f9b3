//! From frames to a lattice: the order of the slices and their common map to the world.
//!
//! Slices are sorted along their normal, or by their instance numbers where they have no positions. The step from one to the
//! next need not be at right angles to the slices: a tilted gantry shifts them, and the sheared map says exactly that. Where steps
//! differ in length (two distances, a missing slice), the slices are resampled (`spacing.rs`). The world is the patient's: x to
//! the left, y to the back, z to the head, millimetres.

use glam::{DAffine3, DMat3, DVec3};

use crate::input::fault::{Fault, unsupported};
use crate::input::formats::dicom::header::{Frame, Picture};
use crate::input::formats::dicom::spacing::Even;

/// One slice: a frame of a file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slice {
    /// Index of the file.
    pub(crate) file: usize,
    /// Index of the frame in the file.
    pub(crate) frame: usize,
    pub(crate) place: Frame,
}

/// Slices in their order, and the map of the lattice that they make.
pub(crate) struct Stack {
    pub(crate) slices: Vec<Slice>,
    pub(crate) world_from_index: DAffine3,
    /// The slices of the lattice, where they are not those that were read.
    pub(crate) even: Option<Even>,
    /// A note on a decision.
    pub(crate) remark: Option<String>,
}

/// Where the first slice lies, and what leads from one to the next.
struct Course {
    origin: DVec3,
    step: DVec3,
    even: Option<Even>,
    remark: Option<String>,
}

impl Course {
    fn of_steps(origin: DVec3, step: DVec3) -> Self {
        Self {
            origin,
            step,
            even: None,
            remark: None,
        }
    }
}

/// Directions of slices of one volume differ by rounding only, in the sixth decimal.
const DIRECTION_TOLERANCE: f64 = 1e-4;

/// By this much, millimetres plus a share of the step, steps between slices may differ. Positions are decimals of a few
/// digits; a scanner that leaves out a slice or changes its distance differs by far more. A guess.
const STEP_TOLERANCE_MM: f64 = 0.01;
const STEP_TOLERANCE_SHARE: f64 = 0.01;

pub(crate) fn stack(pictures: &[Picture]) -> Result<Stack, Fault> {
    let mut slices = Vec::new();
    for (file, picture) in pictures.iter().enumerate() {
        let frames = picture.frames.iter().enumerate();
        slices.extend(frames.map(|(frame, &place)| Slice { file, frame, place }));
    }
    let first = slices
        .first()
        .ok_or_else(|| "there is no slice".to_owned())?
        .place;
    check_directions(&slices, &first)?;
    let [x, y] = first.directions;
    let normal = x
        .cross(y)
        .try_normalize()
        .ok_or_else(|| "ImageOrientationPatient spans no plane".to_owned())?;
    let course = if slices.len() == 1 {
        Course::of_steps(
            first.position.unwrap_or(DVec3::ZERO),
            normal * pictures[0].slice_step,
        )
    } else {
        sorted_course(&mut slices, normal, pictures)?
    };
    let axes = DMat3::from_cols(x * first.spacing[0], y * first.spacing[1], course.step);
    Ok(Stack {
        slices,
        world_from_index: DAffine3::from_mat3_translation(axes, course.origin),
        even: course.even,
        remark: course.remark,
    })
}

fn check_directions(slices: &[Slice], first: &Frame) -> Result<(), Fault> {
    for slice in slices {
        let place = &slice.place;
        let turned = (0..2)
            .any(|i| !((place.directions[i] - first.directions[i]).length() < DIRECTION_TOLERANCE));
        let rescaled = (0..2)
            .any(|i| !((place.spacing[i] / first.spacing[i] - 1.0).abs() < DIRECTION_TOLERANCE));
        if turned || rescaled {
            let what = if turned {
                "is turned against"
            } else {
                "has another pixel spacing than"
            };
            return Err(unsupported(format!(
                "a slice {what} the first one: a series with an overview or of several directions must be split into \
                 folders first"
            )));
        }
    }
    Ok(())
}

/// Sorts the slices along the normal and says how they follow one another.
fn sorted_course(
    slices: &mut [Slice],
    normal: DVec3,
    pictures: &[Picture],
) -> Result<Course, Fault> {
    let held = slices
        .iter()
        .filter(|slice| slice.place.position.is_some())
        .count();
    match held {
        // The frames of one file are in order.
        0 if pictures.len() == 1 => {
            let step = normal * pictures[0].slice_step;
            return Ok(Course::of_steps(DVec3::ZERO, step));
        }
        0 => return numbered_course(slices, normal, pictures),
        held if held < slices.len() => {
            let (all, without) = (slices.len(), slices.len() - held);
            return Err(Fault::Invalid(format!(
                "{without} of {all} slices have no ImagePositionPatient"
            )));
        }
        _ => {}
    }
    let at = |slice: &Slice| slice.place.position.unwrap_or_default();
    slices.sort_by(|a, b| at(a).dot(normal).total_cmp(&at(b).dot(normal)));
    let positions: Vec<DVec3> = slices.iter().map(at).collect();
    let steps: Vec<DVec3> = positions.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let span = positions[positions.len() - 1] - positions[0];
    course_of(&steps, span, normal).map(|course| Course {
        origin: positions[0],
        ..course
    })
}

/// Slices without positions, by their instance numbers.
fn numbered_course(
    slices: &mut [Slice],
    normal: DVec3,
    pictures: &[Picture],
) -> Result<Course, Fault> {
    let number = |slice: &Slice| pictures[slice.file].instance;
    slices.sort_by(|a, b| {
        number(a)
            .unwrap_or(0.0)
            .total_cmp(&number(b).unwrap_or(0.0))
    });
    let is_told = slices.iter().all(|slice| number(slice).is_some())
        && slices
            .windows(2)
            .all(|pair| pair[0].file == pair[1].file || number(&pair[0]) < number(&pair[1]));
    if !is_told {
        return Err(unsupported(
            "the slices have neither an ImagePositionPatient nor instance numbers of their own, so their order is not known: \
             convert them to another format",
        ));
    }
    let step = pictures[slices[0].file].slice_step;
    Ok(Course {
        remark: Some(format!(
            "the slices have no positions: they are in the order of their instance numbers, {step} mm apart"
        )),
        ..Course::of_steps(DVec3::ZERO, normal * step)
    })
}

/// How slices with these steps follow one another.
fn course_of(steps: &[DVec3], span: DVec3, normal: DVec3) -> Result<Course, Fault> {
    let mean = span / steps.len() as f64;
    let tolerance = STEP_TOLERANCE_MM + STEP_TOLERANCE_SHARE * mean.length();
    if let Some(index) = steps
        .iter()
        .position(|step| !(step.dot(normal) > 0.1 * tolerance))
    {
        return Err(unsupported(format!(
            "slices {index} and {} lie at the same place: the series holds several times or kinds of picture; put one \
             of each place into a folder of its own",
            index + 1
        )));
    }
    if steps
        .iter()
        .all(|step| (*step - mean).length() <= tolerance)
    {
        return Ok(Course::of_steps(DVec3::ZERO, mean));
    }
    let runs = runs(steps, tolerance);
    // One shear for all: each step is a share of the whole.
    let heights: Vec<f64> = steps.iter().map(|step| step.dot(normal)).collect();
    let along = span / span.dot(normal);
    let is_straight = steps
        .iter()
        .zip(&heights)
        .all(|(step, height)| (*step - *height * along).length() <= tolerance);
    let even = is_straight.then(|| Even::new(&heights)).flatten();
    let Some(even) = even else {
        return Err(unsupported(format!(
            "the slices are not evenly spaced: {runs}; put evenly spaced ones into a folder of their own"
        )));
    };
    let step = even.step * along;
    Ok(Course {
        remark: Some(format!(
            "the slices are not evenly spaced: {runs}; they were resampled to {} slices {:.2} mm apart",
            even.len(),
            step.length()
        )),
        even: Some(even),
        ..Course::of_steps(DVec3::ZERO, step)
    })
}

/// Most runs that a message lists.
const MAX_RUNS: usize = 6;

/// The slices, counted along the normal, at each distance.
fn runs(steps: &[DVec3], tolerance: f64) -> String {
    let mut runs: Vec<String> = Vec::new();
    let mut begin = 0;
    while begin < steps.len() && runs.len() < MAX_RUNS {
        let same = |step: &&DVec3| (**step - steps[begin]).length() <= tolerance;
        let end = begin + steps[begin..].iter().take_while(same).count();
        runs.push(format!(
            "{begin} to {end} are {:.2} mm apart",
            steps[begin].length()
        ));
        begin = end;
    }
    let more = if begin < steps.len() {
        ", and so on"
    } else {
        ""
    };
    format!("slices {}{more}", runs.join(", "))
}
