//! The references of a warp: pictures, depths and cameras read and put together.
//!
//! Takes the typed options, gives the views that the warp starts from, the camera of the first and the distance of the
//! nearest sample.

use std::path::Path;

use anyhow::{Context, Error, Result, anyhow};
use resample_core::narrow::index32;
use resample_core::{Camera, Image, Reuse};
use serde_json::{Value, json};
use warp3d::exposure;
use warp3d::input::cameras::{Distortion, Lens, Pair};
use warp3d::input::{DepthMeaning, Part, Taken, cameras, colour, depth};
use warp3d::memory::ReferenceSize;
use warp3d::multiview;
use warp3d::multiview::SeenDepths;
use warp3d::{Reference, WarpOptions, Warper, input};

use crate::args::{DepthArgs, Warp3dArgs};
use crate::cameras::viewpoint;
use crate::cameras::viewpoint::{Known, TakenWith, Viewpoint};
use crate::output::Format;
use crate::plan::Request;
use crate::process::report::Notes;
use crate::values::IntrinsicsWord;
use crate::values::input_file::HeldPicture;
use crate::{output, plan};
use resample_io::camera_file::{FileCamera, NEAR_FRACTION};

/// The references of a warp and their first camera.
pub(crate) struct WarpScene {
    /// The references, the picture of the command line first.
    pub references: Vec<Reference>,
    /// The camera of the first.
    pub from: FileCamera,
    /// Camera z of the nearest sample, world units.
    pub nearest: f64,
}

/// One picture as it was typed.
struct Typed<'a> {
    colour: &'a str,
    depth: &'a str,
    camera: Option<Viewpoint>,
    /// The picture, where it is no file.
    held: Option<&'a HeldPicture>,
}

impl Typed<'_> {
    /// Size of the picture, px.
    fn size(&self) -> Result<[u32; 2]> {
        Ok(match self.held {
            Some(held) => [held.colour.width, held.colour.height].map(index32),
            None => colour::size(&Part::from_text(self.colour))?,
        })
    }

    /// The bytes that the picture takes.
    fn storage(&self) -> Result<ReferenceSize> {
        if self.held.is_some() {
            return Ok(ReferenceSize::of_floats(self.size()?));
        }
        let colour::Storage {
            size,
            channel_bytes,
            decoder_bytes,
        } = colour::storage(&Part::from_text(self.colour))?;
        Ok(ReferenceSize {
            size,
            channel_bytes,
            decoder_bytes,
        })
    }
}

/// Reads all that is named.
pub(crate) fn read(args: &Warp3dArgs, notes: &mut Notes) -> Result<WarpScene> {
    let typed = typed(args)?;
    let described: Vec<Described> = typed
        .iter()
        .map(|typed| described(typed, args))
        .collect::<Result<_>>()?;
    let mut references = Vec::new();
    for (typed, found) in typed.iter().zip(&described) {
        references.extend(held((typed, found), args.baseline_around(), notes)?);
    }
    match_exposure(args, &typed, &mut references, notes);
    let nearest = nearest(&references);
    for reference in &mut references {
        // The near plane of a reference cuts nothing: its samples are where they are.
        reference.camera.near = reference.camera.near.min(NEAR_FRACTION * nearest);
    }
    Ok(WarpScene {
        references,
        from: described[0].from,
        nearest,
    })
}

/// Makes the exposure of further pictures that of the first, and says so.
fn match_exposure(
    args: &Warp3dArgs,
    typed: &[Typed<'_>],
    references: &mut [Reference],
    notes: &mut Notes,
) {
    // A panorama is several references of one exposure.
    if typed.len() < 2 || typed.len() != references.len() {
        return;
    }
    let gains = exposure::match_exposure(references);
    for (typed, [red, green, blue]) in typed.iter().zip(gains) {
        if [red, green, blue] == [1.0; 3] {
            continue;
        }
        let text = match args.sequence.neighbours {
            0 => format!(
                "its exposure differs from the first picture's: red, green and blue are multiplied by {red:.2}, \
                 {green:.2} and {blue:.2}"
            ),
            _ => "pictures differ in exposure: each one's neighbours are made like it".to_owned(),
        };
        notes.say_of(typed.colour, text);
    }
}

/// The camera of the first picture, without reading its pixels.
pub(crate) fn camera(args: &Warp3dArgs) -> Result<FileCamera> {
    Ok(described(&first(args), args)?.from)
}

/// The sizes of all references, from the headers of their pictures alone: a panorama is six.
pub(crate) fn sizes(args: &Warp3dArgs) -> Result<Vec<ReferenceSize>> {
    let mut sizes = Vec::new();
    for typed in typed(args)? {
        let own = typed.storage()?;
        if typed.camera == Some(Viewpoint::Equirectangular) {
            let faces = input::face_sizes(own.size);
            sizes.extend(faces.into_iter().map(ReferenceSize::of_floats));
        } else if described(&typed, args)?.distortion.is_some() {
            // Colours between those of a file may be any numbers.
            sizes.push(ReferenceSize {
                channel_bytes: 4,
                ..own
            });
        } else {
            sizes.push(own);
        }
    }
    Ok(sizes)
}

/// The files that are read, so that none of them is overwritten.
pub(crate) fn files(args: &Warp3dArgs) -> Vec<std::path::PathBuf> {
    let pictures = [&args.colour, &args.depth].into_iter().chain(
        args.cameras
            .reference
            .chunks(3)
            .flat_map(|words| words.iter().take(2)),
    );
    let of_camera =
        |word: &Option<Viewpoint>| word.as_ref().and_then(Viewpoint::path).map(Path::to_owned);
    let lens = match &args.cameras.intrinsics {
        Some(IntrinsicsWord::File(path)) => Some(path.clone()),
        Some(IntrinsicsWord::Numbers(_)) | None => None,
    };
    let cameras = [
        of_camera(&args.cameras.from),
        of_camera(&args.cameras.to),
        lens,
    ]
    .into_iter()
    .flatten();
    pictures
        .map(|text| Part::from_text(text).path)
        .chain(cameras)
        .collect()
}

/// The lens that was typed, or that of the file that was named, for pictures of `size`.
pub(crate) fn lens(args: &Warp3dArgs, size: [u32; 2]) -> Result<Option<Lens>> {
    match &args.cameras.intrinsics {
        None => Ok(None),
        &Some(IntrinsicsWord::Numbers([fx, fy, cx, cy])) => Ok(Some(Lens {
            fx,
            fy,
            cx,
            cy,
            pixel_centre: args.cameras.pixel_centre,
        })),
        Some(IntrinsicsWord::File(path)) => {
            let (lens, stated) = cameras::read_lens(path)?;
            if let Some([width, height]) = stated.filter(|&stated| stated != size) {
                anyhow::bail!(
                    "{}: the lens is for a picture of {width}x{height} pixels, the picture has {}x{}: scale its \
                     numbers, or the picture",
                    path.display(),
                    size[0],
                    size[1]
                );
            }
            Ok(Some(lens))
        }
    }
}

/// The picture, and then those of each `--reference`.
fn typed(args: &Warp3dArgs) -> Result<Vec<Typed<'_>>> {
    std::iter::once(Ok(first(args)))
        .chain(further(args))
        .collect()
}

fn first(args: &Warp3dArgs) -> Typed<'_> {
    Typed {
        colour: &args.colour,
        depth: &args.depth,
        camera: args.cameras.from.clone(),
        held: args.source.held().and_then(|held| held.0.first()),
    }
}

fn further(args: &Warp3dArgs) -> impl Iterator<Item = Result<Typed<'_>>> {
    let numbered = args.cameras.reference.chunks(3).enumerate();
    numbered.map(|(number, words)| {
        let [colour, depth, camera] = words else {
            anyhow::bail!("--reference needs COLOUR DEPTH CAM")
        };
        let camera =
            viewpoint::parse(camera).map_err(|what| anyhow!("--reference: '{camera}': {what}"))?;
        Ok(Typed {
            colour,
            depth,
            camera: Some(camera),
            held: args.source.held().and_then(|held| held.0.get(number + 1)),
        })
    })
}

/// The facts about a picture before its pixels are read.
struct Described {
    colour: Part,
    depth: Part,
    from: FileCamera,
    distortion: Option<Distortion>,
    meaning: DepthMeaning,
}

fn described(typed: &Typed, args: &Warp3dArgs) -> Result<Described> {
    let colour = Part::from_text(typed.colour);
    let size = typed.size()?;
    let lens = lens(args, size)?;
    let known = Known {
        picture: size,
        size: None,
        lens,
    };
    let with: TakenWith = match (&typed.camera, &lens) {
        (Some(Viewpoint::Equirectangular), _) if args.baseline_around().is_some() => {
            FileCamera::without_near(input::unrolled_camera(size)).into()
        }
        (Some(camera), _) => viewpoint::only_one(camera, &known)?,
        (None, Some(lens)) => viewpoint::at_origin(lens, size)?.into(),
        (None, None) => anyhow::bail!(
            "{}: its camera is missing: give --from CAM (a file, or fov:DEGREES), or --intrinsics",
            typed.colour
        ),
    };
    Ok(Described {
        colour,
        depth: Part::from_text(typed.depth),
        from: with.camera,
        distortion: with.distortion,
        meaning: meaning(&args.meaning, with.pair.as_ref()),
    })
}

/// Reads a picture into memory: one reference, or the faces of a panorama. With a baseline, a panorama is unrolled for two eyes.
fn held(
    (typed, found): (&Typed, &Described),
    baseline: Option<f64>,
    notes: &mut Notes,
) -> Result<Vec<Reference>> {
    let (picture, stored) = match typed.held {
        Some(held) => (held.colour.clone(), held.depth.clone()),
        None => (colour::read(&found.colour)?, depth::read(&found.depth)?),
    };
    let meaning = found.meaning.with_range_of(&stored);
    if typed.camera == Some(Viewpoint::Equirectangular) {
        let file = &found.depth.path;
        return Ok(match baseline {
            Some(baseline) => vec![input::unrolled(
                &picture, &stored, &meaning, file, baseline,
            )?],
            None => input::panorama(&picture, &stored, &meaning, file)?,
        });
    }
    let taken = Taken {
        camera: found.from.with_any_near(),
        distortion: found.distortion,
    };
    let size = [picture.width, picture.height].map(index32);
    let fits = [taken.camera.width, taken.camera.height] == size;
    let reference = input::reference(picture, &stored, taken, &meaning, &found.depth.path);
    let reference = match reference {
        // Such a camera is a fault of the picture; all other errors name the depth themselves.
        Err(error) if !fits => return Err(Error::from(error).context(typed.colour.to_owned())),
        reference => reference?,
    };
    let width = reference.camera.width as usize;
    let note = meaning.note(stored.stored, &reference.depth, width);
    if let Some(note) = note {
        notes.say_of(typed.depth, note);
    }
    Ok(vec![reference])
}

/// The meaning of a depth file's numbers.
pub(crate) fn meaning(args: &DepthArgs, pair: Option<&Pair>) -> DepthMeaning {
    DepthMeaning {
        kind: args.kind(),
        scale: args.depth_scale,
        invalid: args.invalid,
        baseline: args.baseline.or(pair.map(|pair| pair.baseline)),
        doffs: args.doffs.or(pair.map(|pair| pair.doffs)).unwrap_or(0.0),
        near_far: args.near.zip(args.far).map(|(near, far)| [near, far]),
        range: args.relative_range,
    }
}

/// Samples with a depth.
pub(crate) fn known(references: &[Reference]) -> u64 {
    let known = |r: &Reference| r.depth.iter().filter(|z| !z.is_nan()).count() as u64;
    references.iter().map(known).sum()
}

/// Camera z of the sample that is nearest to the camera that saw it, world units.
pub(crate) fn nearest(references: &[Reference]) -> f64 {
    let nearest = references.iter().map(Reference::nearest);
    f64::from(nearest.fold(f32::INFINITY, f32::min))
}

/// The depths at which `camera` sees the samples of the first reference.
pub(crate) fn seen_depths(references: &[Reference], camera: &Camera) -> Option<SeenDepths> {
    let first = references.first()?;
    let step = multiview::depth_step(&first.camera);
    let samples = first.depth.iter().copied().enumerate().step_by(step);
    multiview::seen_depths(&first.camera, samples, camera)
}

/// Warps with these options from now on.
pub(crate) fn update(warper: &mut Warper, options: &WarpOptions) -> Result<()> {
    if warper.update(options)? == Reuse::NeedsRenderer {
        *warper = Warper::new(warper.references(), options)?;
    }
    Ok(())
}

/// Options and files of the warp, for the stats file.
pub(crate) fn record(
    args: &Warp3dArgs,
    options: &WarpOptions,
    request: &Request,
    format: Format,
    convergence: f64,
) -> Value {
    let meaning = &args.meaning;
    let mut record = json!({
        "colour": args.colour,
        "depth": args.depth,
        "from": args.cameras.from.as_ref().map(ToString::to_string),
        "to": args.cameras.to.as_ref().map(ToString::to_string),
        "depth_kind": meaning.kind(),
        "depth_scale": meaning.depth_scale,
        "near": meaning.near,
        "far": meaning.far,
        "relative_range": meaning.relative_range,
        "invalid": meaning.invalid,
        "baseline": meaning.baseline,
        "steady": args.sequence.steady,
        "doffs": meaning.doffs,
        "stereo": args.views.stereo,
        "convergence": convergence.is_finite().then_some(convergence),
        "picture": plan::picture_record(request, format),
    });
    if let (Value::Object(record), Value::Object(options)) = (&mut record, json!(options)) {
        record.extend(options);
    }
    record
}

/// Writes the planes beside the picture.
pub(crate) fn write_planes(args: &Warp3dArgs, image: &Image) -> Result<()> {
    let plane = |name: &str| {
        image
            .planes
            .iter()
            .find(|plane| plane.name == name)
            .map(|plane| &plane.values)
    };
    if let Some(path) = &args.filled {
        let seen = image
            .rgba
            .iter()
            .map(|pixel| 1.0 - pixel[3].clamp(0.0, 1.0));
        let mask: Vec<f32> = match plane("filled") {
            Some(filled) => seen
                .zip(filled)
                .map(|(hole, &filled)| hole.max(filled))
                .collect(),
            None => seen.collect(),
        };
        write_plane(path, image, &mask)?;
    }
    if let Some(path) = &args.confidence {
        let confidence = plane("confidence")
            .context("this layout of views has no confidence: leave --confidence out")?;
        write_plane(path, image, confidence)?;
    }
    Ok(())
}

/// Writes a plane of a picture's size, in the format of its name.
fn write_plane(path: &Path, image: &Image, values: &[f32]) -> Result<()> {
    let format = output::format_of(path, None)?;
    output::write_grey(path, format, [image.width, image.height], values)?;
    Ok(())
}
