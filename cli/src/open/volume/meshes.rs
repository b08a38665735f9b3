//! Meshes, isosurfaces and slices that stand in a volume: implants, electrodes, outlines, bone in its flesh, a scan's own grey.
//!
//! Each file and each slice is read and prepared by texmap once, each isosurface by volsplat, and drawn for each picture at the volume's sub-pixels; volsplat composites it where
//! its rays meet it. Of a translucent surface the nearest side is seen.

use anyhow::{Context, Error, Result, bail};
use glam::DVec3;
use resample_core::{Camera, Surface};
use resample_io::Gate;
use texmap::scene::{AlphaMode, Lighting, Material, Sides};
use texmap::{LoadOptions, Loaded, Shade};
use volsplat::{Light, Order, RenderOptions, Renderer};

use crate::args::SceneArgs;
use crate::open::mesh::corners;
use crate::open::volume::data::Content;
use crate::open::volume::slices;
use crate::open::volume::slices::Cut;
use crate::process::report;
use crate::values::mesh_word::{IsoWord, MeshWord, SlicePlace, SliceWord};

/// Pixels of a slice along a voxel's side. Texmap interpolates light, but a slice shall show interpolated values, whose grey is no linear function of light:
/// pixels between the voxels bring both together. A wave that shortens to four voxels, magnified three times, has 25.6 dB with one, 36.9 with two, 43.8
/// with three.
const PIXELS_OF_VOXEL: u32 = 2;

/// The meshes of a picture, in the order in which they were typed.
pub(crate) struct Meshes {
    all: Vec<StandingMesh>,
    isosurfaces: Vec<(IsoWord, Renderer)>,
    slices: Vec<(SliceWord, StandingMesh)>,
}

struct StandingMesh {
    /// The file and its paint; `None` for a slice.
    word: Option<MeshWord>,
    scene: texmap::Scene,
    options: texmap::RenderOptions,
    renderer: texmap::Renderer,
}

impl Meshes {
    /// Reads the files, and prepares the isosurfaces.
    pub(crate) fn read(args: &SceneArgs, content: &Content, gate: &Gate) -> Result<Self> {
        let render = &content.look.options;
        let all = args.meshes.iter();
        let all = all.map(|word| StandingMesh::read(word, render, gate));
        let mut meshes = Self {
            all: all.collect::<Result<_>>()?,
            isosurfaces: Vec::new(),
            slices: Vec::new(),
        };
        meshes.follow(content, args)?;
        Ok(meshes)
    }

    /// Returns true if nothing stands in the volume.
    pub(crate) fn is_empty(&self) -> bool {
        self.all.is_empty() && self.isosurfaces.is_empty() && self.slices.is_empty()
    }

    /// Refuses a renderer in which no meshes can stand.
    pub(crate) fn check(&self, renderer: &Renderer, render: &RenderOptions) -> Result<()> {
        if self.is_empty() {
            return Ok(());
        }
        if !matches!(render.order, Order::Field(_)) {
            bail!(
                "--mesh, --with-iso and --with-slice go with the field alone: leave them out, or the options of samples"
            );
        }
        if renderer.reads_file() {
            bail!(
                "--mesh, --with-iso and --with-slice need all visible voxels in memory: raise --max-memory, or leave them out"
            );
        }
        Ok(())
    }

    /// Lights the meshes as the volume is lit now, and takes the isosurfaces and slices of the arguments in its present look.
    pub(crate) fn follow(&mut self, content: &Content, args: &SceneArgs) -> Result<()> {
        let render = &content.look.options;
        let mut known = std::mem::take(&mut self.slices);
        if !content.shown_channels().is_empty() || !content.labels().is_empty() {
            // Their colours may be others now.
            known.clear();
        }
        for &word in &args.slices {
            let place = known.iter().position(|(known, _)| *known == word);
            let slice = match place {
                Some(place) => known.swap_remove(place),
                None => (
                    word,
                    StandingMesh::slice(&word, content).context("--with-slice")?,
                ),
            };
            self.slices.push(slice);
        }
        self.isosurfaces.truncate(args.isosurfaces.len());
        for (place, &word) in args.isosurfaces.iter().enumerate() {
            match self.isosurfaces.get_mut(place) {
                Some((own, renderer)) => {
                    *own = word;
                    content.change_isosurface(&word, renderer)?;
                }
                None => {
                    let renderer = content.isosurface(&word).context("--with-iso")?;
                    self.isosurfaces.push((word, renderer));
                }
            }
        }
        for mesh in &mut self.all {
            let options = lit(mesh.word.as_ref(), render);
            if options != mesh.options {
                mesh.renderer = texmap::Renderer::new(&mesh.scene, &options)?;
                mesh.options = options;
            }
        }
        Ok(())
    }

    /// Forgets the slices, because the volume has other values now.
    pub(crate) fn forget_slices(&mut self) {
        self.slices.clear();
    }

    /// Meshes and slices.
    fn meshes(&self) -> impl Iterator<Item = &StandingMesh> {
        self.all
            .iter()
            .chain(self.slices.iter().map(|(_, mesh)| mesh))
    }

    /// The box around all of them, in the world.
    pub(crate) fn bounds_in_world(&self) -> Option<[DVec3; 2]> {
        let boxes = self
            .meshes()
            .filter_map(|mesh| mesh.renderer.bounds_in_world());
        boxes.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])
    }

    /// The corners of their triangles, in the world.
    pub(crate) fn corners(&self) -> impl Iterator<Item = DVec3> {
        self.meshes().flat_map(|mesh| corners(&mesh.scene))
    }

    /// The surfaces in a part of a picture, at the volume's sub-pixels. `camera` sees the part, `whole` the picture.
    pub(crate) fn surfaces(
        &mut self,
        volume: &Renderer,
        camera: &Camera,
        whole: &Camera,
    ) -> Result<Vec<Surface>> {
        if self.is_empty() {
            return Ok(Vec::new());
        }
        let subpixels = volume.subpixels(camera)?;
        let faded = |mut surface: Surface, opacity: f32| {
            if opacity < 1.0 {
                surface.fade(1.0 - opacity);
            }
            surface
        };
        // The cameras differ by the part's first column and row.
        let first = [whole.cx - camera.cx, whole.cy - camera.cy].map(|px| px.round() as usize);
        let window = (first, [camera.width as usize, camera.height as usize]);
        let mut surfaces = Vec::new();
        let slices = self.slices.iter_mut().map(|(_, mesh)| mesh);
        for mesh in self.all.iter_mut().chain(slices) {
            let surface = mesh.renderer.surface_window(whole, window, subpixels)?;
            let opacity = mesh.word.as_ref().map_or(1.0, |word| word.opacity);
            surfaces.push(faded(surface, opacity));
        }
        for (word, renderer) in &mut self.isosurfaces {
            let surface = renderer.surface(camera, subpixels)?;
            surfaces.push(faded(surface, word.opacity));
        }
        Ok(surfaces)
    }

    /// Camera z of the nearest of them in the picture of a camera with one pixel.
    pub(crate) fn depth(&mut self, pixel: &Camera) -> Result<Option<f64>> {
        let mut nearest: Option<f64> = None;
        let slices = self.slices.iter_mut().map(|(_, mesh)| mesh);
        let meshes = self.all.iter_mut().chain(slices);
        let meshes = meshes.map(|mesh| mesh.renderer.surface(pixel, 1).map_err(Error::from));
        let isosurfaces = self.isosurfaces.iter_mut();
        let isosurfaces =
            isosurfaces.map(|(_, renderer)| renderer.surface(pixel, 1).map_err(Error::from));
        for surface in meshes.chain(isosurfaces) {
            let surface = surface?;
            let depth = surface.tile([0, 0]).map(|tile| f64::from(tile.depth[0][0]));
            if let Some(depth) = depth.filter(|depth| depth.is_finite()) {
                nearest = Some(nearest.map_or(depth, |nearest| nearest.min(depth)));
            }
        }
        Ok(nearest)
    }
}

impl StandingMesh {
    fn read(word: &MeshWord, render: &RenderOptions, gate: &Gate) -> Result<Self> {
        let Loaded { mut scene, notes } = match &word.held {
            Some(held) => held.as_ref().clone(),
            None => {
                let load = LoadOptions {
                    gate: gate.clone(),
                    ..LoadOptions::default()
                };
                texmap::load(&word.path, &load).context("--mesh")?
            }
        };
        report::say_notes(&notes);
        if let Some(colour) = word.colour {
            paint(&mut scene, colour);
        }
        Self::new(Some(word.clone()), scene, render)
    }

    fn new(word: Option<MeshWord>, scene: texmap::Scene, render: &RenderOptions) -> Result<Self> {
        let options = lit(word.as_ref(), render);
        let renderer = texmap::Renderer::new(&scene, &options)?;
        Ok(Self {
            word,
            scene,
            options,
            renderer,
        })
    }

    /// A slice: the polygon in which its plane cuts the volume, with the values as its picture.
    fn slice(word: &SliceWord, content: &Content) -> Result<Self> {
        let volume = content.first();
        let lattice = volume.lattice();
        let plane = match word.place {
            SlicePlace::Plane(plane) => (plane.normal, plane.offset),
            SlicePlace::Voxels(axis, index) if index < lattice.dims[axis] => {
                lattice.plane_of(axis, index)
            }
            SlicePlace::Voxels(axis, index) => bail!(
                "{}={index}: the volume has {} voxels there, counted from 0",
                ["x", "y", "z"][axis],
                lattice.dims[axis]
            ),
        };
        let plane = lattice.on_plane(plane, PIXELS_OF_VOXEL);
        let plane = plane.context("the plane lies beside the volume")?;
        let window = word.window.unwrap_or_else(|| volume.slice_window());
        let picture = slices::picture(content, Cut::Grid(&plane.grid), window)?;
        let uvs = plane.corners.iter().map(|&at| plane.uv(at)).collect();
        let scene = texmap::Scene::polygon(&plane.corners, uvs, picture);
        Self::new(None, scene, &content.look.options)
    }
}

/// The light on a mesh: that of the volume, and at the eye what its materials ask for where they keep their colours. A slice is not lit.
fn lit(word: Option<&MeshWord>, render: &RenderOptions) -> texmap::RenderOptions {
    let (shade, light) = match (render.light, word) {
        (_, None) => (Shade::Unlit, None),
        (Light::Towards(light), _) => (Shade::Lambert, Some(light)),
        (_, Some(word)) if word.colour.is_some() => (Shade::Headlight, None),
        _ => (Shade::Auto, None),
    };
    let own = texmap::RenderOptions::default();
    texmap::RenderOptions {
        shade,
        light: light.unwrap_or(own.light),
        simd: render.simd,
        ..own
    }
}

/// Gives every surface one colour, on both sides.
fn paint(scene: &mut texmap::Scene, [red, green, blue]: [f32; 3]) {
    for mesh in &mut scene.meshes {
        mesh.colours.clear();
    }
    for material in &mut scene.materials {
        *material = Material {
            name: std::mem::take(&mut material.name),
            base_colour: [red, green, blue, 1.0],
            alpha: AlphaMode::Opaque,
            sides: Sides::Both,
            lighting: Lighting::Lit,
            ..Material::default()
        };
    }
}
