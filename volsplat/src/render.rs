//! The renderer: a volume prepared once, then one picture per camera.
//!
//! The orders of compositing are whole pipelines of their own ([`crate::look::options::Order`]); what they share is that
//! they fill the tiles of a picture. Every buffer is kept from frame to frame. Chunks and tiles are cut without regard
//! to the number of threads, and each is owned by one task, so the same bytes come out on any number of them.

use glam::DVec3;
use resample_core::clock::StageClock;
use resample_core::composite::surface::SAMPLES_PER_SIDE;
use resample_core::image::Plane;
use resample_core::narrow::index32;
use resample_core::{Camera, Image, Projection, Reuse, Stop, Surface};
use resample_volume::Watch;
use resample_volume::volume::{Described, Lattice};

use crate::bricks::rescale::{Narrowed, Narrowing};
use crate::field::{FieldPipeline, Kept, Layer, layers_refused};
use crate::grid::check_distance;
use crate::large::LargeVolume;
use crate::look::clip::Clip;
use crate::look::options::{Blend, DepthPlane, Order, RenderOptions, Subpixels};
use crate::look::scene::Scene;
use crate::look::transfer::TransferFunction;
use crate::paper::{EverySample, KernelSheets, Painting};
use crate::picture::{TileSlot, picture, refined};
use crate::stats::FrameStats;
use crate::{Error, Volume};

/// Renders one prepared volume, frame after frame.
#[derive(Clone, Debug)]
pub struct Renderer {
    pipeline: Pipeline,
    /// As they were given.
    options: RenderOptions,
    /// From the scalars of the first channel to those that are drawn.
    narrowing: Narrowing,
    bounds_in_world: Option<[DVec3; 2]>,
    smallest_spacing: f64,
    largest_spacing: f64,
    tiles: Vec<TileSlot>,
}

#[derive(Clone, Debug)]
enum Pipeline {
    /// Every sample by itself, or slices of samples.
    Samples(Box<EverySample>),
    Sheets(Box<KernelSheets>),
    Field(Box<FieldPipeline>),
}

/// A picture and what it cost.
#[derive(Clone, Debug)]
pub struct Frame {
    /// The picture.
    pub image: Image,
    /// Counts and times.
    pub stats: FrameStats,
}

impl Renderer {
    /// Prepares `volume` for rendering with `options`.
    pub fn new(
        volume: &Volume,
        transfer: &TransferFunction,
        options: &RenderOptions,
    ) -> Result<Self, Error> {
        Self::with_scene(&Scene::new(volume, transfer), options)
    }

    /// Prepares channels and a mask for rendering with `options`.
    ///
    /// [`Error::Option`] where the options contradict one another or the scene, or where the scene's grids differ.
    pub fn with_scene(scene: &Scene, options: &RenderOptions) -> Result<Self, Error> {
        Self::keeping(scene, options, Kept::Shown)
    }

    /// As [`Renderer::with_scene`], and keeps all of the volumes, so that [`Renderer::update_scene`] is quick whatever is shown
    /// next: for a program in which a person turns the knobs. It takes more memory: of the field of scalars 5 bytes a
    /// voxel of 8 bits, 6 of others, and 6 or 23 more where light or the gradient's opacity have been asked for.
    pub fn for_changes(scene: &Scene, options: &RenderOptions) -> Result<Self, Error> {
        Self::keeping(scene, options, Kept::Whole)
    }

    fn keeping(scene: &Scene, options: &RenderOptions, kept: Kept) -> Result<Self, Error> {
        options.validate()?;
        scene.validate()?;
        let lattice = scene.grid().lattice();
        let narrowed = Narrowed::new(scene, options)?;
        let narrowing = narrowed.narrowings[0];
        let pipeline = Pipeline::new(&narrowed.scene(scene), &narrowing.options(options), kept)?;
        Ok(Self::assembled(pipeline, &lattice, options, narrowing))
    }

    /// Draws `scene` with `options` from now on: other transfer functions, clip, light, blend, isosurface, and every other
    /// choice. The pictures and [`Renderer::visible_bounds_in_world`] are those of a new renderer.
    ///
    /// The scene's volumes and mask must hold the voxels that this renderer was prepared with. After
    /// [`Renderer::for_changes`] a field of scalars is not prepared again: 256^3 voxels take 5 to 10 ms of CPU, and
    /// up to 90 more when cells are lit for the first time. Labels and the orders of samples are
    /// prepared anew. [`Renderer::non_transparent`] stays that of the last preparation.
    ///
    /// [`Error::Option`] as in [`Renderer::with_scene`]; nothing has changed then.
    pub fn update_scene(&mut self, scene: &Scene, options: &RenderOptions) -> Result<(), Error> {
        options.validate()?;
        scene.validate()?;
        let narrowed = Narrowed::new(scene, options)?;
        let drawn = self.narrowing.options(options);
        let reuse = match &mut self.pipeline {
            Pipeline::Field(p) => p.update_scene(&narrowed.scene(scene), &drawn)?,
            Pipeline::Samples(_) | Pipeline::Sheets(_) => Reuse::NeedsRenderer,
        };
        if reuse == Reuse::NeedsRenderer {
            *self = Self::for_changes(scene, options)?;
            return Ok(());
        }
        self.bounds_in_world = self.pipeline.bounds_in_world();
        self.options = options.clone();
        Ok(())
    }

    /// Prepares a volume that stays in its file. What can be seen of it stays in memory if it fits, and is else read
    /// again for each frame, as far as it is not hidden; the pictures are the same.
    ///
    /// [`Error::Option`] also for an order that needs all voxels in memory; [`Error::Read`] if the file has gone.
    pub fn from_file(
        volume: &LargeVolume,
        transfer: &TransferFunction,
        options: &RenderOptions,
        watch: &mut Watch,
    ) -> Result<Self, Error> {
        options.validate()?;
        let narrowing = volume.narrowing();
        let (drawn, transfer) = (narrowing.options(options), narrowing.transfer(transfer));
        let Some(field) = drawn.field() else {
            return Err(Error::Option(
                "volumes larger than memory support only the field renderer; remove the sample options or raise the memory limit"
                    .to_owned(),
            ));
        };
        let field = FieldPipeline::from_file(volume, &transfer, &drawn, field, watch)?;
        let pipeline = Pipeline::Field(Box::new(field));
        Ok(Self::assembled(
            pipeline,
            &volume.lattice(),
            options,
            narrowing,
        ))
    }

    fn assembled(
        pipeline: Pipeline,
        lattice: &Lattice,
        options: &RenderOptions,
        narrowing: Narrowing,
    ) -> Self {
        Self {
            bounds_in_world: pipeline.bounds_in_world(),
            pipeline,
            options: options.clone(),
            narrowing,
            smallest_spacing: lattice.smallest_spacing(),
            largest_spacing: lattice.spacing().into_iter().fold(0.0, f64::max),
            tiles: Vec::new(),
        }
    }

    /// Voxels that the transfer function leaves visible.
    pub fn non_transparent(&self) -> u64 {
        match &self.pipeline {
            Pipeline::Samples(p) => p.non_transparent,
            Pipeline::Sheets(p) => p.non_transparent,
            Pipeline::Field(p) => p.counts()[0],
        }
    }

    /// Of interpolating kernels, the largest difference between their sum at a voxel and its scalar; else `None`.
    pub fn interpolation_residual(&self) -> Option<f32> {
        match &self.pipeline {
            Pipeline::Sheets(p) => p.residual.map(|r| self.narrowing.in_file(r)),
            Pipeline::Samples(_) | Pipeline::Field(_) => None,
        }
    }

    /// Returns true if each frame reads the volume's file again, because what can be seen of it is larger than the memory.
    pub fn reads_file(&self) -> bool {
        match &self.pipeline {
            Pipeline::Field(p) => p.reads_file(),
            Pipeline::Samples(_) | Pipeline::Sheets(_) => false,
        }
    }

    /// Voxels of the volume.
    pub fn voxels(&self) -> u64 {
        match &self.pipeline {
            Pipeline::Samples(p) => p.voxels,
            Pipeline::Sheets(p) => p.samples.voxels,
            Pipeline::Field(p) => p.counts()[1],
        }
    }

    /// Changes the kept part of the volume, for the frames that follow. [`Error::Option`] as in [`Renderer::new`].
    pub fn update_clip(&mut self, clip: Clip) -> Result<(), Error> {
        let options = RenderOptions {
            clip,
            ..self.options.clone()
        };
        options.validate()?;
        match &mut self.pipeline {
            Pipeline::Samples(p) => p.update_clip(&options.clip),
            Pipeline::Sheets(p) => p.update_clip(&options.clip),
            Pipeline::Field(p) => p.update_clip(&options.clip),
        }
        self.bounds_in_world = self.pipeline.bounds_in_world();
        self.options = options;
        Ok(())
    }

    /// Changes the transfer function for the frames that follow, where the kept part of the volume holds all that it
    /// shows: the field of one channel of scalars, prepared with a function that shows as much. One prepared
    /// with a mean of several functions ([`TransferFunction::mixed`]) takes each of them. Counts and
    /// [`Renderer::visible_bounds_in_world`] stay those of the function that it was prepared with.
    ///
    /// ```
    /// use volsplat::volume::procedural::blobs;
    /// use volsplat::{ColourMap, Described, RenderOptions, Renderer, Reuse, TransferFunction};
    ///
    /// let volume = blobs(16)?;
    /// let function = TransferFunction::automatic(&volume.histogram(), ColourMap::default());
    /// let mut renderer = Renderer::new(&volume, &function, &RenderOptions::default())?;
    /// let greys = TransferFunction::automatic(&volume.histogram(), ColourMap::greys());
    /// assert_ne!(renderer.update_transfer(&greys), Reuse::NeedsRenderer);
    /// # Ok::<(), volsplat::Error>(())
    /// ```
    pub fn update_transfer(&mut self, transfer: &TransferFunction) -> Reuse {
        match &mut self.pipeline {
            Pipeline::Samples(_) | Pipeline::Sheets(_) => Reuse::NeedsRenderer,
            Pipeline::Field(p) => p.update_transfer(&self.narrowing.transfer(transfer)),
        }
    }

    /// Draws with `options` from now on, if what was prepared serves them too. Else nothing changes.
    /// [`Error::Option`] as in [`Renderer::new`].
    pub fn update(&mut self, options: &RenderOptions) -> Result<Reuse, Error> {
        options.validate()?;
        if !self.options.prepares_like(options) {
            return Ok(Reuse::NeedsRenderer);
        }
        let drawn = self.narrowing.options(options);
        match &mut self.pipeline {
            Pipeline::Samples(p) => p.update(&drawn),
            Pipeline::Sheets(p) => p.update(&drawn),
            Pipeline::Field(p) => p.update(&drawn),
        }
        self.options = options.clone();
        Ok(Reuse::Kept)
    }

    /// Planes beside the colour of the picture that this camera sees, in the order of the list; a pass of its own.
    /// [`Error::Option`] where there are none: [`Layer::Selection`] is of the orders of samples, the others are made of
    /// the field of one channel of scalars in memory, without a mask, gradient opacity or another blend.
    pub fn layers(&mut self, camera: &Camera, wanted: &[Layer]) -> Result<Vec<Plane>, Error> {
        let camera = camera
            .validated()
            .map_err(|e| Error::Option(e.to_string()))?;
        check_distance(&camera, self.bounds_in_world, self.smallest_spacing)?;
        match &self.pipeline {
            _ if wanted.is_empty() => Ok(Vec::new()),
            Pipeline::Field(p) => p.layers(&camera, wanted),
            Pipeline::Sheets(_) => Err(layers_refused()),
            Pipeline::Samples(_) if wanted.iter().any(|layer| *layer != Layer::Selection) => {
                Err(layers_refused())
            }
            Pipeline::Samples(_) => {
                let camera = moved_forward(camera, self.depth_origin(&camera));
                wanted.iter().map(|_| self.selection(&camera)).collect()
            }
        }
    }

    /// The share of points in each pixel's opacity.
    fn selection(&mut self, camera: &Camera) -> Result<Plane, Error> {
        let Pipeline::Samples(samples) = &mut self.pipeline else {
            return Err(layers_refused());
        };
        let mut stats = FrameStats::default();
        samples.painting = Painting::Kinds;
        let layout = samples.render(camera, &mut self.tiles, &mut stats);
        samples.painting = samples.own_painting();
        let image = picture(&self.tiles, &layout, DepthPlane::None, &mut stats);
        // Not by the opacity: 1 less a transmittance near 1 has few digits.
        let share =
            |&[points, splats, ..]: &[f32; 4]| points / (points + splats).max(f32::MIN_POSITIVE);
        Ok(Plane {
            name: "selection".into(),
            values: image.rgba.iter().map(share).collect(),
        })
    }

    /// The box, in the world, of the voxels that are drawn and that the clip keeps; `None` if there are none.
    pub fn visible_bounds_in_world(&self) -> Option<[DVec3; 2]> {
        self.bounds_in_world
    }

    /// Renders one frame.
    pub fn render(&mut self, camera: &Camera) -> Result<Frame, Error> {
        self.render_watched(camera, &mut |_| {})
    }

    /// Renders one frame and reports its progress, for volumes that stay in their file.
    pub fn render_watched(&mut self, camera: &Camera, watch: &mut Watch) -> Result<Frame, Error> {
        self.render_until(camera, &Stop::default(), watch)
    }

    /// As [`Renderer::render_watched`]; [`Error::Stopped`] as soon as `stop` is asked for. The field leaves out the tiles that
    /// it has not begun; the orders of samples finish their frame first.
    pub fn render_until(
        &mut self,
        camera: &Camera,
        stop: &Stop,
        watch: &mut Watch,
    ) -> Result<Frame, Error> {
        self.render_among(camera, &[], stop, watch)
    }

    /// Sub-pixels along a pixel's side of a picture from `camera`, for the surfaces of [`Renderer::render_among`].
    /// [`Error::Option`] for the orders of samples, in which no surfaces stand.
    pub fn subpixels(&self, camera: &Camera) -> Result<u32, Error> {
        let camera = camera
            .validated()
            .map_err(|e| Error::Option(e.to_string()))?;
        match &self.pipeline {
            Pipeline::Field(p) => Ok(p
                .fine_camera(&moved_forward(camera, self.depth_origin(&camera)))
                .1),
            Pipeline::Samples(_) | Pipeline::Sheets(_) => Err(surfaces_refused()),
        }
    }

    /// The isosurface that this renderer draws, for [`Renderer::render_among`] of another one: the depth and the colour of `subpixels` along each pixel's side that
    /// `camera` sees. [`Error::Option`] for every other blend.
    pub fn surface(&mut self, camera: &Camera, subpixels: u32) -> Result<Surface, Error> {
        let camera = camera
            .validated()
            .map_err(|e| Error::Option(e.to_string()))?;
        if !matches!(self.options.blend(), Blend::Isosurface(_)) {
            let why = "only an isosurface is a surface for another renderer";
            return Err(Error::Option(why.into()));
        }
        let own = self.options.clone();
        let samples = (SAMPLES_PER_SIDE / subpixels.max(1)).max(1);
        let _kept = self.update(&RenderOptions {
            subpixels: Subpixels::Fixed(samples),
            depth: DepthPlane::Expected,
            ..own.clone()
        })?;
        let fine = refined(&camera, subpixels).0;
        let size = [fine.width, fine.height].map(|side| side as usize);
        let drawn = Surface::in_bands(size, |first, rows| {
            let band = Camera {
                height: index32(rows),
                cy: fine.cy - first as f64,
                ..fine
            };
            Ok(self.render(&band)?.image)
        });
        let _kept = self.update(&own)?;
        drawn
    }

    /// As [`Renderer::render_until`], with `surfaces` of other renderers inside the volume, in any order: each ray sees them where it
    /// meets them, and the volume behind them as far as their alpha is below 1. They are those of `camera` with
    /// [`Renderer::subpixels`] times as many pixels along each side. Maxima, minima and averages are those of the
    /// samples before the first surface of more than half alpha, and lie over the surfaces as light: dark values cover nothing.
    ///
    /// [`Error::Option`] also for a surface of another size, for orders of samples, and where a frame reads the volume's file.
    pub fn render_among(
        &mut self,
        camera: &Camera,
        surfaces: &[Surface],
        stop: &Stop,
        watch: &mut Watch,
    ) -> Result<Frame, Error> {
        let camera = camera
            .validated()
            .map_err(|e| Error::Option(e.to_string()))?;
        check_distance(&camera, self.bounds_in_world, self.smallest_spacing)?;
        let depth_origin = self.depth_origin(&camera);
        let camera = moved_forward(camera, depth_origin);
        let mut stats = FrameStats::default();
        let whole = StageClock::start();
        let layout = match &mut self.pipeline {
            Pipeline::Samples(_) | Pipeline::Sheets(_) if !surfaces.is_empty() => {
                return Err(surfaces_refused());
            }
            Pipeline::Samples(p) => p.render(&camera, &mut self.tiles, &mut stats),
            Pipeline::Sheets(p) => p.render(&camera, &mut self.tiles, &mut stats),
            Pipeline::Field(p) => {
                let surfaces = (surfaces, depth_origin);
                p.render(
                    &camera,
                    &mut self.tiles,
                    &mut stats,
                    surfaces,
                    (watch, stop),
                )?
            }
        };
        if stop.is_asked() {
            return Err(Error::Stopped);
        }
        let mut image = picture(&self.tiles, &layout, self.options.depth, &mut stats);
        image
            .depth
            .iter_mut()
            .flatten()
            .for_each(|depth| *depth += depth_origin as f32);
        let whole = whole.stop();
        (stats.wall_ms, stats.cpu_ms) = (whole.wall_ms, whole.cpu_ms);
        Ok(Frame { image, stats })
    }

    /// Camera z at which the depths of parallel rays begin: before every sample that is seen, and a whole number of
    /// sheets, so that sheets stay where they are. Depths are then small and not negative, as sorting wants them,
    /// wherever the image plane lies. 0 in perspective, where depth counts from the eye.
    fn depth_origin(&self, camera: &Camera) -> f64 {
        let Some([low, high]) = self
            .bounds_in_world
            .filter(|_| camera.projection == Projection::Orthographic)
        else {
            return 0.0;
        };
        let forward = camera.forward_in_world();
        let nearest_corner = DVec3::select(forward.cmpge(DVec3::ZERO), low, high);
        let nearest = forward.dot(nearest_corner) + camera.camera_from_world.translation.z;
        // A kernel begins before its voxel: a trilinear one by a spacing along each axis at most, a radial one, on the
        // volume's continuation, by two and two more.
        let (sheet_voxels, reach) = match &self.options.order {
            Order::Field(field) => (field.slab_voxels, 3.0),
            Order::Samples(samples) => match samples.sheets() {
                Some(sheets) => (sheets.slab_voxels, 12.0),
                None => (samples.sheet_voxels, 0.0),
            },
        };
        let reach = reach * self.largest_spacing;
        let start = (nearest - reach).max(camera.near);
        let thickness = sheet_voxels * self.smallest_spacing;
        let origin = (start / thickness).floor() * thickness;
        // Sheets too thin to be counted overflow the quotient.
        if origin.is_finite() { origin } else { start }
    }
}

impl Pipeline {
    fn new(scene: &Scene, options: &RenderOptions, kept: Kept) -> Result<Self, Error> {
        Ok(match &options.order {
            Order::Field(field) => {
                Self::Field(Box::new(FieldPipeline::new(scene, options, field, kept)?))
            }
            Order::Samples(samples) if samples.sheets().is_some() => {
                Self::Sheets(Box::new(KernelSheets::new(scene, options, samples)?))
            }
            Order::Samples(samples) => {
                Self::Samples(Box::new(EverySample::new(scene, options, samples)?))
            }
        })
    }

    fn bounds_in_world(&self) -> Option<[DVec3; 2]> {
        match self {
            Self::Samples(p) => p.bounds_in_world(),
            Self::Sheets(p) => p.bounds_in_world(),
            Self::Field(p) => p.bounds_in_world(),
        }
    }
}

fn surfaces_refused() -> Error {
    let why = "surfaces stand in the field only: leave out the surfaces, or the options of samples";
    Error::Option(why.into())
}

/// The camera with its image plane moved along the view by this camera z; the near plane stays where it is.
fn moved_forward(mut camera: Camera, by: f64) -> Camera {
    camera.camera_from_world.translation.z -= by;
    camera.near -= by;
    camera
}
