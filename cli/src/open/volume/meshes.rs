//! Meshes and isosurfaces that stand in a volume: implants, electrodes, outlines, bone in its flesh.
//!
//! Each file is read and prepared by texmap once, each isosurface by volsplat, and drawn for each picture at the volume's sub-pixels; volsplat composites it where
//! its rays meet it. Of a translucent surface the nearest side is seen.

use anyhow::{Context, Error, Result, bail};
use glam::DVec3;
use resample_core::{Camera, Surface};
use resample_io::Gate;
use texmap::scene::{AlphaMode, Lighting, Sides};
use texmap::{LoadOptions, Loaded, Shade};
use volsplat::{Light, Order, RenderOptions, Renderer};

use crate::args::SceneArgs;
use crate::open::mesh::corners;
use crate::open::volume::data::Content;
use crate::process::report;
use crate::values::mesh_word::{IsoWord, MeshWord};

/// The meshes of a picture, in the order in which they were typed.
pub(crate) struct Meshes {
    all: Vec<StandingMesh>,
    isosurfaces: Vec<(IsoWord, Renderer)>,
}

struct StandingMesh {
    word: MeshWord,
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
        };
        meshes.follow(content, &args.isosurfaces)?;
        Ok(meshes)
    }

    /// Returns true if nothing stands in the volume.
    pub(crate) fn is_empty(&self) -> bool {
        self.all.is_empty() && self.isosurfaces.is_empty()
    }

    /// Refuses a renderer in which no meshes can stand.
    pub(crate) fn check(&self, renderer: &Renderer, render: &RenderOptions) -> Result<()> {
        if self.is_empty() {
            return Ok(());
        }
        if !matches!(render.order, Order::Field(_)) {
            bail!(
                "--mesh and --with-iso go with the field alone: leave them out, or the options of samples"
            );
        }
        if renderer.reads_file() {
            bail!(
                "--mesh and --with-iso need all visible voxels in memory: raise --max-memory, or leave them out"
            );
        }
        Ok(())
    }

    /// Lights the meshes as the volume is lit now, and takes these isosurfaces of its present look.
    pub(crate) fn follow(&mut self, content: &Content, isosurfaces: &[IsoWord]) -> Result<()> {
        let render = &content.look.options;
        self.isosurfaces.truncate(isosurfaces.len());
        for (place, &word) in isosurfaces.iter().enumerate() {
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
            let options = lit(&mesh.word, render);
            if options != mesh.options {
                mesh.renderer = texmap::Renderer::new(&mesh.scene, &options)?;
                mesh.options = options;
            }
        }
        Ok(())
    }

    /// The box around all of them, in the world.
    pub(crate) fn bounds_in_world(&self) -> Option<[DVec3; 2]> {
        let boxes = self
            .all
            .iter()
            .filter_map(|mesh| mesh.renderer.bounds_in_world());
        boxes.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])
    }

    /// The corners of their triangles, in the world.
    pub(crate) fn corners(&self) -> impl Iterator<Item = DVec3> {
        self.all.iter().flat_map(|mesh| corners(&mesh.scene))
    }

    /// The surfaces that `camera` sees, at the sub-pixels of its picture of the volume.
    pub(crate) fn surfaces(&mut self, volume: &Renderer, camera: &Camera) -> Result<Vec<Surface>> {
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
        let mut surfaces = Vec::new();
        for mesh in &mut self.all {
            let surface = mesh.renderer.surface(camera, subpixels)?;
            surfaces.push(faded(surface, mesh.word.opacity));
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
        let meshes = self.all.iter_mut();
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
        let options = lit(word, render);
        let renderer = texmap::Renderer::new(&scene, &options)?;
        Ok(Self {
            word: word.clone(),
            scene,
            options,
            renderer,
        })
    }
}

/// The light on a mesh: that of the volume, and at the eye what its materials ask for where they keep their colours.
fn lit(word: &MeshWord, render: &RenderOptions) -> texmap::RenderOptions {
    let (shade, light) = match render.light {
        Light::Towards(light) => (Shade::Lambert, Some(light)),
        _ if word.colour.is_some() => (Shade::Headlight, None),
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
        *material = texmap::scene::Material {
            name: std::mem::take(&mut material.name),
            base_colour: [red, green, blue, 1.0],
            alpha: AlphaMode::Opaque,
            sides: Sides::Both,
            lighting: Lighting::Lit,
            ..texmap::scene::Material::default()
        };
    }
}
