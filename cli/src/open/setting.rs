//! Render options of an application, and choices that override single ones.
//!
//! A [`Setting`] holds all options of one application, and which of them are given. A [`Choice`] sets one option;
//! [`Choices`] are the planner's rungs, the rows of `trade` and of `bench`. Words are for people and for other processes;
//! nothing in the program reads them again.

use anyhow::{Result, bail};
use resample_cloud::Blend;
use resample_core::{FootprintMode, KernelShape, SelectMode};
use volsplat::{Cells, Classify, Interpolate, LightGrid, PixelSamples, Subpixels};
use warp3d::args::MethodName;
use warp3d::{Fill, Visibility, WarpArgs};

use crate::args::volume::order;
use crate::args::{Drawing, GaussianRenderArgs, Given, OrderName, PointsRenderArgs, RenderArgs};
use crate::values::{cells_word, word};

/// All options of how one application draws, and which of them are given.
#[derive(Clone, Debug, PartialEq)]
pub enum Setting {
    /// A volume's.
    Volume(Box<Given<RenderArgs>>),
    /// Those of Gaussians.
    Gaussians(Given<GaussianRenderArgs>),
    /// A mesh's.
    Mesh(Given<texmap::RenderOptions>),
    /// Those of a picture with depth.
    Depth(Given<WarpArgs>),
    /// A scan's.
    Points(Given<PointsRenderArgs>),
}

/// One option, set to a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Choice {
    /// An option of a volume.
    Volume(VolumeChoice),
    /// An option of Gaussians.
    Gaussians(GaussianChoice),
    /// An option of a mesh.
    Mesh(MeshChoice),
    /// An option of a picture with depth.
    Depth(DepthChoice),
    /// An option of a scan.
    Points(PointsChoice),
}

/// One option of a volume, set to a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VolumeChoice {
    /// `--order`.
    Order(OrderName),
    /// `--slab`, voxels.
    Slab(f64),
    /// `--subpixels`.
    Subpixels(Subpixels),
    /// `--min-transmittance`.
    MinTransmittance(f32),
    /// `--footprint`.
    Footprint(FootprintMode),
    /// `--kernel`.
    Kernel(KernelShape),
    /// `--select`.
    Select(SelectMode),
    /// `--point-threshold`, px.
    PointThreshold(f32),
    /// `--cells`.
    Cells(Cells),
    /// `--classify`.
    Classify(Classify),
    /// `--interpolate`.
    Interpolate(Interpolate),
    /// `--light-grid`.
    LightGrid(LightGrid),
}

/// One option of Gaussians, set to a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GaussianChoice {
    /// `--slab-error`.
    SlabError(f32),
    /// `--samples`.
    Samples(PixelSamples),
    /// `--min-transmittance`.
    MinTransmittance(f32),
}

/// One option of a mesh, set to a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MeshChoice {
    /// `--method`.
    Method(texmap::Method),
    /// `--subpixels`.
    Subpixels(u32),
}

/// One option of a picture with depth, set to a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepthChoice {
    /// `--method`.
    Method(MethodName),
    /// `--visibility`.
    Visibility(Visibility),
    /// `--subpixels`.
    Subpixels(u32),
    /// `--fill`.
    Fill(Fill),
}

/// One option of a scan, set to a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PointsChoice {
    /// `--blend`.
    Blend(Blend),
    /// `--subpixels`.
    Subpixels(u32),
    /// `--every`.
    Every(u32),
}

/// Options that are set beyond a setting, in the order in which they are written; none twice.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Choices {
    list: Vec<Choice>,
}

impl From<VolumeChoice> for Choice {
    fn from(choice: VolumeChoice) -> Self {
        Self::Volume(choice)
    }
}

impl From<GaussianChoice> for Choice {
    fn from(choice: GaussianChoice) -> Self {
        Self::Gaussians(choice)
    }
}

impl From<MeshChoice> for Choice {
    fn from(choice: MeshChoice) -> Self {
        Self::Mesh(choice)
    }
}

impl From<DepthChoice> for Choice {
    fn from(choice: DepthChoice) -> Self {
        Self::Depth(choice)
    }
}

impl From<PointsChoice> for Choice {
    fn from(choice: PointsChoice) -> Self {
        Self::Points(choice)
    }
}

impl Choice {
    /// The long name of the option, and the value as it is typed.
    fn name_and_word(&self) -> (&'static str, String) {
        match self {
            Self::Volume(choice) => choice.name_and_word(),
            Self::Gaussians(choice) => choice.name_and_word(),
            Self::Mesh(MeshChoice::Method(method)) => ("method", word(*method)),
            Self::Mesh(MeshChoice::Subpixels(count)) => ("subpixels", count.to_string()),
            Self::Depth(DepthChoice::Method(method)) => ("method", word(*method)),
            Self::Depth(DepthChoice::Visibility(rule)) => ("visibility", word(*rule)),
            Self::Depth(DepthChoice::Subpixels(count)) => ("subpixels", count.to_string()),
            Self::Depth(DepthChoice::Fill(fill)) => ("fill", word(*fill)),
            Self::Points(PointsChoice::Blend(blend)) => ("blend", word(*blend)),
            Self::Points(PointsChoice::Subpixels(count)) => ("subpixels", count.to_string()),
            Self::Points(PointsChoice::Every(count)) => ("every", count.to_string()),
        }
    }
}

impl VolumeChoice {
    fn name_and_word(&self) -> (&'static str, String) {
        match self {
            Self::Order(order) => ("order", word(*order)),
            Self::Slab(voxels) => ("slab", voxels.to_string()),
            Self::Subpixels(Subpixels::Auto) => ("subpixels", "auto".to_owned()),
            Self::Subpixels(Subpixels::Fixed(count)) => ("subpixels", count.to_string()),
            Self::MinTransmittance(least) => ("min-transmittance", least.to_string()),
            Self::Footprint(mode) => ("footprint", word(*mode)),
            Self::Kernel(shape) => ("kernel", word(*shape)),
            Self::Select(mode) => ("select", word(*mode)),
            Self::PointThreshold(radius_px) => ("point-threshold", radius_px.to_string()),
            Self::Cells(cells) => ("cells", cells_word(*cells)),
            Self::Classify(when) => ("classify", word(*when)),
            Self::Interpolate(on) => ("interpolate", word(*on)),
            Self::LightGrid(grid) => ("light-grid", grid.to_string()),
        }
    }

    fn apply(self, args: &mut RenderArgs) {
        match self {
            Self::Order(order) => args.order = Some(order),
            Self::Slab(voxels) => args.field.slab_voxels = voxels,
            Self::Subpixels(subpixels) => args.subpixels = subpixels,
            Self::MinTransmittance(least) => args.min_transmittance = least,
            Self::Footprint(mode) => args.samples.footprint = mode,
            Self::Kernel(shape) => args.samples.kernel = shape,
            Self::Select(mode) => args.samples.select = mode,
            Self::PointThreshold(radius_px) => args.samples.point_threshold_px = radius_px,
            Self::Cells(cells) => args.cells = cells,
            Self::Classify(when) => args.sheets.classify = when,
            Self::Interpolate(on) => args.sheets.interpolate = on,
            Self::LightGrid(grid) => args.light_grid = grid,
        }
    }
}

impl GaussianChoice {
    fn name_and_word(&self) -> (&'static str, String) {
        match self {
            Self::SlabError(error) => ("slab-error", error.to_string()),
            Self::Samples(samples) => ("samples", word(*samples)),
            Self::MinTransmittance(least) => ("min-transmittance", least.to_string()),
        }
    }

    fn apply(self, args: &mut GaussianRenderArgs) {
        match self {
            Self::SlabError(error) => args.slab_error = error,
            Self::Samples(samples) => args.samples = samples,
            Self::MinTransmittance(least) => args.min_transmittance = least,
        }
    }
}

impl MeshChoice {
    fn apply(self, options: &mut texmap::RenderOptions) {
        match self {
            Self::Method(method) => options.method = method,
            Self::Subpixels(count) => options.subpixels = count,
        }
    }
}

impl DepthChoice {
    fn apply(self, args: &mut WarpArgs) {
        match self {
            Self::Method(method) => args.method = method,
            Self::Visibility(rule) => args.visibility = Some(rule),
            Self::Subpixels(count) => args.subpixels = Some(count),
            Self::Fill(fill) => args.fill = fill,
        }
    }
}

impl PointsChoice {
    fn apply(self, args: &mut PointsRenderArgs) {
        match self {
            Self::Blend(blend) => args.blend = blend,
            Self::Subpixels(count) => args.subpixels = count,
            Self::Every(count) => args.every = count,
        }
    }
}

impl Choices {
    /// Choices of different options of one application.
    pub fn of<T: Into<Choice>>(list: impl IntoIterator<Item = T>) -> Self {
        Self {
            list: list.into_iter().map(Into::into).collect(),
        }
    }

    /// These choices, but of options that `other` sets, those of `other`.
    pub fn with(&self, other: &Self) -> Self {
        let name = |choice: &Choice| choice.name_and_word().0;
        let mut list = self.list.clone();
        for &choice in &other.list {
            match list.iter_mut().find(|own| name(own) == name(&choice)) {
                Some(own) => *own = choice,
                None => list.push(choice),
            }
        }
        Self { list }
    }

    /// Without the options that a setting gives.
    pub fn without(&self, setting: &Setting) -> Self {
        let mut list = self.list.clone();
        list.retain(|choice| !setting.has(choice.name_and_word().0));
        Self { list }
    }

    /// Returns true if one of the choices sets this option.
    pub fn has(&self, name: &str) -> bool {
        self.list
            .iter()
            .any(|choice| choice.name_and_word().0 == name)
    }

    /// As they are typed.
    pub fn words(&self) -> Vec<String> {
        let pairs = self.list.iter().map(Choice::name_and_word);
        pairs
            .flat_map(|(name, word)| [format!("--{name}"), word])
            .collect()
    }

    /// In short, for people: "slab 0.5, subpixels 2".
    pub fn name(&self) -> String {
        let pairs = self.list.iter().map(Choice::name_and_word);
        let names: Vec<String> = pairs.map(|(name, word)| format!("{name} {word}")).collect();
        names.join(", ")
    }
}

impl Setting {
    /// These options with others set.
    ///
    /// # Errors
    /// A choice of another application.
    pub fn with(&self, choices: &Choices) -> Result<Self> {
        let mut setting = self.clone();
        for choice in &choices.list {
            let (name, word) = choice.name_and_word();
            match (&mut setting, *choice) {
                (Self::Volume(own), Choice::Volume(choice)) => {
                    own.set(name, word, |args| choice.apply(args));
                }
                (Self::Gaussians(own), Choice::Gaussians(choice)) => {
                    own.set(name, word, |args| choice.apply(args));
                }
                (Self::Mesh(own), Choice::Mesh(choice)) => {
                    own.set(name, word, |options| choice.apply(options));
                }
                (Self::Depth(own), Choice::Depth(choice)) => {
                    own.set(name, word, |args| choice.apply(args));
                }
                (Self::Points(own), Choice::Points(choice)) => {
                    own.set(name, word, |args| choice.apply(args));
                }
                _ => bail!("--{name} is an option of another application"),
            }
        }
        Ok(setting)
    }

    /// Returns true if the options fit one another.
    pub fn is_legal(&self) -> bool {
        match self {
            Self::Volume(given) => order::order(given).is_ok(),
            // Each option has a range of its own, and they fit one another.
            Self::Gaussians(_) => true,
            Self::Mesh(given) => given.options.validate().is_ok(),
            Self::Depth(given) => given.options.options().is_ok(),
            Self::Points(given) => given.options.is_legal(),
        }
    }

    /// Returns true if both draw the same pictures, as far as that is known without a look at them.
    pub fn draws_like(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Volume(own), Self::Volume(other)) => own.options == other.options,
            (Self::Gaussians(own), Self::Gaussians(other)) => own.options == other.options,
            (Self::Mesh(own), Self::Mesh(other)) => own.options == other.options,
            (Self::Depth(own), Self::Depth(other)) => {
                own.options.options().ok() == other.options.options().ok()
            }
            (Self::Points(own), Self::Points(other)) => own.options == other.options,
            _ => false,
        }
    }

    /// Returns true if an option is given.
    fn has(&self, name: &str) -> bool {
        match self {
            Self::Volume(given) => given.has(name),
            Self::Gaussians(given) => given.has(name),
            Self::Mesh(given) => given.has(name),
            Self::Depth(given) => given.has(name),
            Self::Points(given) => given.has(name),
        }
    }

    /// Name and word of each option that is given, in alphabetical order.
    pub fn given(&self) -> impl Iterator<Item = (&str, &str)> {
        let words = match self {
            Self::Volume(given) => given.words(),
            Self::Gaussians(given) => given.words(),
            Self::Mesh(given) => given.words(),
            Self::Depth(given) => given.words(),
            Self::Points(given) => given.words(),
        };
        words.iter().map(|(name, word)| (&**name, &**word))
    }
}

impl Drawing {
    /// The options of how it draws.
    pub fn setting(&self) -> Setting {
        match self {
            Self::Texmap(args) => Setting::Mesh(args.render.clone()),
            Self::Volsplat(args) => Setting::Volume(Box::new(args.render.clone())),
            Self::Gaussians(args) => Setting::Gaussians(args.render.clone()),
            Self::Warp3d(args) => Setting::Depth(args.render.clone()),
            Self::Points(args) => Setting::Points(args.render.clone()),
        }
    }

    /// Draws with these options from now on.
    pub fn set(&mut self, setting: Setting) -> Result<()> {
        match (self, setting) {
            (Self::Texmap(args), Setting::Mesh(render)) => args.render = render,
            (Self::Volsplat(args), Setting::Volume(render)) => args.render = *render,
            (Self::Gaussians(args), Setting::Gaussians(render)) => args.render = render,
            (Self::Warp3d(args), Setting::Depth(render)) => args.render = render,
            (Self::Points(args), Setting::Points(render)) => args.render = render,
            (drawing, _) => bail!("a setting of another application than {}", drawing.name()),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use clap::{Parser, ValueEnum};

    use super::*;
    use crate::args::{Cli, Command};

    /// A command that draws, with further words.
    fn parsed(scene: &[&str], words: Vec<String>) -> Setting {
        let all = ["resample"].iter().chain(scene).chain(&["-o", "a.exr"]);
        let all = all.map(|word| (*word).to_owned()).chain(words);
        match Cli::try_parse_from(all).expect("good words").command {
            Command::Draw(drawing) => drawing.setting(),
            other => panic!("{other:?}"),
        }
    }

    fn check(scene: &[&str], choice: impl Into<Choice>) {
        let choice = Choices::of([choice]);
        let set = parsed(scene, Vec::new()).with(&choice).expect("its own");
        assert_eq!(parsed(scene, choice.words()), set, "{}", choice.name());
    }

    #[test]
    fn the_words_of_every_choice_give_the_same_setting_when_they_are_typed() {
        use VolumeChoice::{
            Cells, Classify, Footprint, Interpolate, Kernel, LightGrid, MinTransmittance, Order,
            PointThreshold, Select, Slab, Subpixels,
        };
        let volume = [
            Order(OrderName::EverySample),
            Slab(0.25),
            Subpixels(volsplat::Subpixels::Fixed(4)),
            Subpixels(volsplat::Subpixels::Auto),
            MinTransmittance(0.001),
            MinTransmittance(1e-5),
            Footprint(FootprintMode::Table),
            Kernel(KernelShape::BSpline),
            Select(SelectMode::Splats),
            PointThreshold(0.5),
            Cells(volsplat::Cells::Mean),
            Cells(volsplat::Cells::SPLIT),
            Cells(volsplat::Cells::Split { error: 1.0 / 64.0 }),
            Classify(volsplat::Classify::value_variants()[1]),
            Interpolate(volsplat::Interpolate::value_variants()[1]),
            LightGrid(volsplat::LightGrid::Every(4)),
        ];
        for choice in volume {
            check(&["volsplat", "a.nrrd"], choice);
        }
        for choice in [
            GaussianChoice::SlabError(0.02),
            GaussianChoice::Samples(PixelSamples::One),
            GaussianChoice::Samples(PixelSamples::Auto),
            GaussianChoice::MinTransmittance(1e-5),
        ] {
            check(&["gaussians", "a.ply"], choice);
        }
        for method in texmap::Method::ALL {
            check(&["texmap", "a.glb"], MeshChoice::Method(method));
        }
        check(&["texmap", "a.glb"], MeshChoice::Subpixels(2));
        for choice in [
            DepthChoice::Method(MethodName::Nearest),
            DepthChoice::Visibility(Visibility::OcclusionOrder),
            DepthChoice::Subpixels(8),
            DepthChoice::Fill(Fill::Background),
        ] {
            check(&["warp3d", "a.png", "a.pfm"], choice);
        }
        for choice in [
            PointsChoice::Blend(Blend::Mean),
            PointsChoice::Subpixels(8),
            PointsChoice::Every(4),
        ] {
            check(&["points", "a.las"], choice);
        }
    }

    #[test]
    fn choices_are_laid_over_one_another() {
        let low = Choices::of([VolumeChoice::Slab(2.0), VolumeChoice::MinTransmittance(0.5)]);
        let high = Choices::of([VolumeChoice::Slab(1.0)]);
        assert_eq!(low.with(&high).name(), "slab 1, min-transmittance 0.5");
        let typed = parsed(&["volsplat", "a.nrrd"], high.words());
        assert_eq!(low.without(&typed).name(), "min-transmittance 0.5");
        let mesh = Choices::of([MeshChoice::Subpixels(2)]);
        assert!(typed.with(&mesh).is_err(), "another application");
    }

    #[test]
    fn a_drawing_takes_a_setting() {
        let words = ["resample", "texmap", "a.glb", "-o", "a.exr"];
        let Command::Draw(mut drawing) = Cli::try_parse_from(words).expect("good").command else {
            panic!("a command that draws")
        };
        let choices = Choices::of([MeshChoice::Subpixels(8)]);
        let setting = drawing.setting().with(&choices).expect("of a mesh");
        drawing.set(setting.clone()).expect("of a mesh");
        assert_eq!(drawing.setting(), setting);
        let given: Vec<(&str, &str)> = setting.given().collect();
        assert_eq!(given, [("subpixels", "8")]);
    }
}
