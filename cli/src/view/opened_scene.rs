//! The scene as it is drawn: read once, then seen from any camera under any options of the page.

use std::path::{MAIN_SEPARATOR, Path, PathBuf};

use anyhow::{Context, Error, Result, bail};
use glam::DVec3;
use resample_core::{Camera, Image, LookAt, Projection, Stop};
use serde_json::{Value, json};
use tempfile::TempDir;

use super::facts;
use super::message::{Exactness, View};
use crate::args::Drawing;
use crate::args::words::content::Application;
use crate::cameras::viewpoint::DEFAULT_FOV_Y_DEG;
use crate::open::Opened;
use crate::open::open_scene::Probed;
use crate::open::volume::OpenVolume;
use crate::output;
use crate::plan::{DEFAULT_SIZE, Purpose};
use crate::process::report;
use crate::process::report::Verbosity;
use crate::values::{BackgroundWord, Size, word};
use crate::view::options_text::{Changes, Files, Words};
use crate::{picture, planner, values};
use resample_core::camera::bands::Window;
use resample_io::camera_file;
use resample_io::camera_file::CameraDefaults;
use texmap::background::Background;
use volsplat::transfer::{ColourEncoding, FileLook};

/// Most pixels of a picture that the page may ask for: those of a screen of 3840x2160.
const MAX_PIXELS: u64 = 3840 * 2160;

/// A scene that is looked at.
pub(crate) struct OpenedScene {
    words: Words,
    opened: Opened,
    /// Holds the transfer function of the page, which is read from there like any other.
    folder: TempDir,
    /// The camera of the command line.
    first_camera: Camera,
    /// The options under which the scene stands ready; none while it is made ready, so that an end halfway is noticed.
    ready: Option<Ready>,
    /// The command with the page's options.
    drawing: Drawing,
    /// The picture that was typed as the background; the page can only choose colours.
    backdrop: Option<Background>,
}

/// The settings of the last frame.
#[derive(Clone, Debug, PartialEq)]
struct Ready {
    changes: Changes,
    transfer: Option<Value>,
    labels: Option<Value>,
    exactness: Exactness,
    step: usize,
    /// The camera, where the setting depends on it.
    planned_for: Option<Camera>,
}

impl Ready {
    /// True if the last frame has the look of the view, at any exactness.
    fn has_look_of(&self, view: &View) -> bool {
        (&self.changes, &self.transfer, &self.labels, self.step)
            == (&view.changes, &view.transfer, &view.labels, view.step)
    }
}

impl OpenedScene {
    /// Reads the files.
    pub(crate) fn open(words: Words, verbosity: Verbosity) -> Result<Self> {
        let drawing = words.first_drawing()?;
        let opened = Opened::read(drawing.clone(), Purpose::Change, verbosity)?;
        let backdrop = match background_word(&drawing) {
            Some(BackgroundWord::File(path)) => Some(Background::read(path)?),
            _ => None,
        };
        let first_camera = *opened.cameras().first().context("no camera")?;
        Ok(Self {
            words,
            opened,
            folder: tempfile::tempdir()?,
            first_camera,
            ready: Some(Ready {
                changes: Changes::new(),
                transfer: None,
                labels: None,
                exactness: Exactness::Default,
                step: 0,
                planned_for: None,
            }),
            drawing,
            backdrop,
        })
    }

    /// The facts that the page needs before it requests a picture.
    pub(crate) fn facts(&mut self) -> Result<Value> {
        let start = self.start()?;
        let typed = self.words.first_drawing()?;
        let volume = match self.opened.volume() {
            Some(open) => facts::volume(open),
            None => Value::Null,
        };
        Ok(json!({
            "type": "scene",
            "application": self.words.application.name(),
            "title": self.title(),
            "start": start,
            "options": facts::options(&self.drawing)?,
            "volume": volume,
            "surfaces": facts::surfaces(&typed),
            "unit": self.unit(),
            "session": self.words.page_of_session(),
            "backdrop": crate::view::encode::BACKDROP,
        }))
    }

    /// The transfer function that is drawn now; null where there is none.
    pub(crate) fn function(&mut self) -> Value {
        let open = self.opened.volume();
        open.map_or(Value::Null, facts::function)
    }

    /// The name of the file.
    fn title(&self) -> String {
        let path: PathBuf = match &self.drawing {
            Drawing::Volsplat(args) => args.input.path.clone(),
            Drawing::Gaussians(args) => args.input.path.clone(),
            Drawing::Texmap(args) => args.input.path.clone(),
            Drawing::Warp3d(args) => PathBuf::from(&args.colour),
            Drawing::Points(args) => args.input.path.clone(),
        };
        let name = path.file_name().unwrap_or(path.as_os_str());
        name.to_string_lossy().into_owned()
    }

    /// The unit of lengths, where the file's format says it: millimetres of a patient, metres of glTF.
    fn unit(&mut self) -> Option<String> {
        if let Some(open) = self.opened.volume() {
            return open.described().lattice().length_unit();
        }
        let input = match &self.drawing {
            Drawing::Texmap(args) => &args.input,
            Drawing::Gaussians(args) => &args.input,
            Drawing::Volsplat(_) | Drawing::Warp3d(_) | Drawing::Points(_) => return None,
        };
        let extension = input.path.extension()?.to_str()?;
        let is_gltf = ["glb", "gltf"]
            .iter()
            .any(|known| extension.eq_ignore_ascii_case(known));
        is_gltf.then(|| "m".to_owned())
    }

    /// The camera of the command line, as the page turns it: around the middle of the scene.
    fn start(&mut self) -> Result<Value> {
        let camera = self.first_camera;
        let (eye, forward) = (camera.eye_in_world(), camera.forward_in_world());
        let distance = match self.opened.bounds_in_world() {
            Some([low, high]) => (0.5 * (low + high) - eye).dot(forward),
            None => self.usual_depth()?,
        };
        // A camera that looks away from the scene turns around what is right before it.
        let distance = if distance > 0.0 {
            distance
        } else {
            camera.near * 1e3
        };
        let up = -camera.camera_from_world.matrix3.row(1);
        let size = self
            .opened
            .bounds_in_world()
            .map(|[low, high]| (high - low).length());
        let mut start = json!({
            "position": eye.to_array(),
            "target": (eye + distance * forward).to_array(),
            "up": up.to_array(),
            "size": [camera.width, camera.height],
            "scene_size": size.unwrap_or(2.0 * distance),
        });
        match camera.projection {
            Projection::Perspective => {
                let half_angle = (0.5 * f64::from(camera.height) / camera.fy).atan();
                start["fov_y"] = json!(2.0 * half_angle.to_degrees());
            }
            Projection::Orthographic => {
                start["projection"] = json!("orthographic");
                start["height"] = json!(f64::from(camera.height) / camera.fy);
            }
        }
        Ok(start)
    }

    /// The median depth of what the first camera sees, world units.
    fn usual_depth(&mut self) -> Result<f64> {
        let camera = self.first_camera.resized(64, 64)?;
        let image = self.opened.draw(&camera)?.image;
        let mut depths: Vec<f32> = image
            .depth
            .into_iter()
            .flatten()
            .filter(|z| z.is_finite() && *z > 0.0)
            .collect();
        depths.sort_by(f32::total_cmp);
        Ok(depths
            .get(depths.len() / 2)
            .map_or(1.0, |&depth| f64::from(depth)))
    }

    /// The camera of a view, and the text that a camera file holds for it.
    pub(crate) fn camera(&self, view: &View) -> Result<(Camera, String)> {
        let [width, height] = view.size;
        if u64::from(width) * u64::from(height) > MAX_PIXELS {
            bail!("a picture of {width}x{height} is larger than the page shows");
        }
        let text = match self.words.application {
            Application::Depth => self.moved_lens(view)?.to_string(),
            Application::Volume
            | Application::Gaussians
            | Application::Mesh
            | Application::Points => view.camera.to_string(),
        };
        // As the command line reads it from a file, digit for digit.
        let defaults = CameraDefaults {
            size: Some(Size { width, height }),
            look_at_size: DEFAULT_SIZE,
            fov_y_deg: DEFAULT_FOV_Y_DEG,
        };
        let read = camera_file::one_camera(serde_json::from_str(&text)?, &defaults)?;
        let bounds = self.opened.bounds_in_world().unwrap_or([DVec3::ZERO; 2]);
        Ok((read.for_bounds(bounds)?, text))
    }

    /// The lens of the reference at another place: a camera with its focal lengths, zoomed as the page says.
    fn moved_lens(&self, view: &View) -> Result<Value> {
        let number = |value: &Value| value.as_f64().context("the camera is not made of numbers");
        let vector = |key: &str| -> Result<DVec3> {
            let list = view.camera[key].as_array().filter(|list| list.len() == 3);
            let list = list.with_context(|| format!("the camera has no {key}"))?;
            Ok(DVec3::new(
                number(&list[0])?,
                number(&list[1])?,
                number(&list[2])?,
            ))
        };
        let pose = LookAt {
            position: vector("position")?,
            target: vector("target")?,
            up: vector("up")?,
        };
        let [width, height] = view.size;
        let first = self.first_camera;
        let half_angle = 0.5 * number(&view.camera["fov_y"])?.to_radians();
        let zoom = (0.5 * f64::from(first.height) / first.fy) / half_angle.tan();
        // Pixels stay square: the scale is that of the height, and the width shows more or less.
        let scale = f64::from(height) / f64::from(first.height);
        let world = pose.camera_from_world()?;
        Ok(json!({
            "width": width,
            "height": height,
            "fx": first.fx * scale * zoom,
            "fy": first.fy * scale * zoom,
            "cx": 0.5 * f64::from(width) + (first.cx - 0.5 * f64::from(first.width)) * scale * zoom,
            "cy": 0.5 * f64::from(height) + (first.cy - 0.5 * f64::from(first.height)) * scale * zoom,
            "R": world.matrix3.transpose().to_cols_array(),
            "t": world.translation.to_array(),
            "near": first.near,
        }))
    }

    /// Does some work that ends early once `stop` is asked for; `None` where it did.
    pub(crate) fn until<T>(
        &mut self,
        stop: &Stop,
        work: impl FnOnce(&mut Self) -> Result<T>,
    ) -> Result<Option<T>> {
        self.stop_with(stop.clone());
        let done = work(self);
        self.stop_with(Stop::default());
        match done {
            Err(error) if is_stopped(&error) => Ok(None),
            done => done.map(Some),
        }
    }

    fn stop_with(&mut self, stop: Stop) {
        self.opened.stop_with(stop);
    }

    /// Takes the options of a view; true if they are new.
    pub(crate) fn prepare(&mut self, view: &View, exactness: Exactness) -> Result<bool> {
        let planned_for = match exactness.bound() {
            Some(_) => Some(self.camera(view)?.0),
            None => None,
        };
        let ready = Ready {
            changes: view.changes.clone(),
            transfer: view.transfer.clone(),
            labels: view.labels.clone(),
            exactness,
            step: view.step,
            planned_for,
        };
        if self.ready.as_ref() == Some(&ready) {
            return Ok(false);
        }
        self.opened.turn_to(view.step)?;
        let drawing = self.words.drawing(&view.changes, &self.files(view)?)?;
        let typed = drawing.setting();
        let setting = match exactness {
            Exactness::Fast => planner::ends(&typed)?.quick,
            Exactness::Exact => planner::ends(&typed)?.exact,
            Exactness::Default | Exactness::Within64 | Exactness::Within255 => typed.clone(),
        };
        self.ready = None;
        let mut styled = drawing.clone();
        styled.set(setting)?;
        self.opened.restyle(&styled)?;
        if let (Some(bound), Some(camera)) = (exactness.bound(), planned_for) {
            let bound = values::bound(bound).map_err(Error::msg)?;
            let setting = planner::keeping(&mut self.opened, typed, camera, bound)?;
            self.opened.set(&setting)?;
        }
        self.drawing = drawing;
        self.ready = Some(ready);
        Ok(true)
    }

    /// Writes a file of the page into the folder of this scene, where commands read it.
    pub(crate) fn own_file(&self, name: &str, text: &str) -> Result<PathBuf> {
        let path = self.folder.path().join(name);
        std::fs::write(&path, text)?;
        Ok(path)
    }

    /// A name for a file that is sent to the page.
    pub(crate) fn sent_file(&self, name: &Path) -> Result<PathBuf> {
        let folder = self.folder.path().join("sent");
        output::make_folder(&folder)?;
        Ok(folder.join(name))
    }

    /// The transfer function in the text of a file of ParaView or Slicer.
    pub(crate) fn look(&self, name: &str, text: &str) -> Result<Value> {
        let path = self.own_file("dropped.json", text)?;
        let open = self
            .opened
            .volume()
            .context("only volumes have a transfer function")?;
        let read = FileLook::load(&path, ColourEncoding::Srgb, open.described());
        let look =
            read.with_context(|| format!("{name}: no transfer function of ParaView or Slicer"))?;
        Ok(json!({
            "function": facts::knots(&look.function),
            "shade": look.shading.map(word),
            "opacity_unit": look.opacity_unit,
            "notes": look.notes,
        }))
    }

    /// A slice of the volume as it is now.
    pub(crate) fn slice(&self, axis: usize, index: usize, window: [f64; 2]) -> Result<Image> {
        let open = self.opened.volume().context("only volumes have slices")?;
        open.slice(axis, index, window)
    }

    /// The name of a picture: numbered, where it is one of the steps of a volume over time.
    pub(crate) fn picture_name(&self, name: &str) -> String {
        match (self.steps(), name.rsplit_once('.')) {
            (2.., Some((stem, extension))) => format!("{stem}-%04d.{extension}"),
            _ => name.to_owned(),
        }
    }

    /// The number of steps of a volume over time, or 1.
    fn steps(&self) -> usize {
        self.opened.volume().map_or(1, OpenVolume::steps)
    }

    /// An error as the page shows it: files of the page without the folder, which is nobody's business.
    pub(crate) fn message(&self, error: &Error) -> String {
        let folder = format!("{}{MAIN_SEPARATOR}", self.folder.path().display());
        report::one_line(error).replace(&folder, "")
    }

    /// Writes the edited transfer function and labels to files, where the command reads them.
    fn files(&self, view: &View) -> Result<Files> {
        let file = |name: &str, content: &Option<Value>| -> Result<Option<PathBuf>> {
            let text = content.as_ref().map(Value::to_string);
            text.map(|text| self.own_file(name, &text)).transpose()
        };
        Ok(Files {
            transfer: file("transfer.json", &view.transfer)?,
            labels: file("labels.json", &view.labels)?,
        })
    }

    /// Returns true if a band of a picture costs less than the whole.
    pub(crate) fn has_bands(&self) -> bool {
        self.opened.has_bands()
    }

    /// Draws under the options that were prepared.
    pub(crate) fn draw(&mut self, camera: &Camera) -> Result<Image> {
        picture::check_size(camera)?;
        let image = self.opened.draw(camera)?.image;
        let figure = self.opened.figure();
        Ok(picture::finished(
            image,
            (camera, [0, 0]),
            &self.background(),
            figure.as_ref(),
        ))
    }

    /// A window of a picture, over its background.
    pub(crate) fn draw_window(&mut self, camera: &Camera, window: &Window) -> Result<Image> {
        picture::check_size(camera)?;
        let image = self.opened.draw_window(camera, window)?.image;
        let (figure, place) = (self.opened.figure(), (camera, window.first()));
        Ok(picture::finished(
            image,
            place,
            &self.background(),
            figure.as_ref(),
        ))
    }

    /// The point under a place of a view, px; null where that is nothing.
    pub(crate) fn probe(&mut self, view: &View, at: [f64; 2]) -> Result<Value> {
        // A thumbnail may have been the last frame.
        if !(self.ready.as_ref()).is_some_and(|ready| ready.has_look_of(view)) {
            self.prepare(view, Exactness::Fast)?;
        }
        let (camera, _) = self.camera(view)?;
        let inside = |place: f64, side: u32| place.floor().clamp(0.0, f64::from(side) - 1.0);
        let (x, y) = (inside(at[0], camera.width), inside(at[1], camera.height));
        let pixel = Camera {
            width: 1,
            height: 1,
            cx: camera.cx - x,
            cy: camera.cy - y,
            ..camera
        };
        Ok(match self.opened.probe(&pixel)? {
            None => Value::Null,
            Some(Probed { world, voxel: None }) => json!({ "world": world.to_array() }),
            Some(Probed {
                world,
                voxel: Some((voxel, value)),
            }) => json!({ "world": world.to_array(), "voxel": voxel, "value": value }),
        })
    }

    fn background(&self) -> Background {
        match background_word(&self.drawing) {
            Some(BackgroundWord::Colour(colour)) => Background::Colour(*colour),
            Some(BackgroundWord::File(_)) => {
                self.backdrop.clone().unwrap_or(Background::Transparent)
            }
            Some(BackgroundWord::Transparent) | None => Background::Transparent,
        }
    }

    /// The words of the command that repeats a view, without its camera, its size and its name.
    pub(crate) fn line(&self, view: &View, files: &Files) -> Result<Vec<String>> {
        let mut words = self.words.line(&view.changes, files)?;
        words.extend(self.rest(view)?);
        if self.steps() > 1 {
            words.push(format!("--frames={}..{}", view.step, view.step + 1));
            words.extend(self.opened.volume().and_then(OpenVolume::look_word));
        }
        Ok(words)
    }

    /// The options of a resting picture beyond those that were typed.
    fn rest(&self, view: &View) -> Result<Vec<String>> {
        Ok(match view.exactness {
            Exactness::Fast | Exactness::Default => Vec::new(),
            Exactness::Within64 | Exactness::Within255 => {
                let bound = view.exactness.bound().into_iter().map(str::to_owned);
                [vec!["--max-error".to_owned()], bound.collect()].concat()
            }
            Exactness::Exact => planner::ends(&self.drawing.setting())?.exact_words,
        })
    }

    /// The option that takes a camera file.
    pub(crate) fn camera_option(&self) -> &'static str {
        match self.words.application {
            Application::Depth => "--to",
            Application::Volume
            | Application::Gaussians
            | Application::Mesh
            | Application::Points => "--camera",
        }
    }

    /// The whole command, to be run from its beginning.
    pub(crate) fn whole(&self, view: &View) -> Result<Drawing> {
        let mut drawing = self.words.drawing(&view.changes, &self.files(view)?)?;
        if let Drawing::Volsplat(args) = &mut drawing
            && self.steps() > 1
        {
            args.only_step = Some(view.step);
        }
        if view.exactness == Exactness::Exact {
            drawing.set(planner::ends(&drawing.setting())?.exact)?;
        }
        if let Some(bound) = view.exactness.bound() {
            drawing.ask_mut().max_error = Some(values::bound(bound).map_err(Error::msg)?);
        }
        Ok(drawing)
    }
}

/// Returns true if an error says that a frame was stopped.
fn is_stopped(error: &Error) -> bool {
    let stopped = error.downcast_ref::<volsplat::Error>();
    matches!(stopped, Some(volsplat::Error::Stopped))
}

/// The background that a command asks for.
fn background_word(drawing: &Drawing) -> Option<&BackgroundWord> {
    let picture = match drawing {
        Drawing::Volsplat(args) => &args.picture,
        Drawing::Gaussians(args) => &args.picture,
        Drawing::Texmap(args) => &args.picture,
        Drawing::Warp3d(args) => &args.picture,
        Drawing::Points(args) => &args.picture,
    };
    picture.background.as_ref()
}
