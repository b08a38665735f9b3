//! How a scene is drawn: typed options of which only some are given, and the words that a person would type for them.
//!
//! A setting is the group of options of one application, each of them given or not. Settings are laid over one another
//! (the planner's under the typed one, those of `trade` over it), compared, and written as words: `--name value` for each
//! option that is given. Words are for people and for other processes; nothing in the program reads them again.

use anyhow::{Result, bail};
use warp3d::WarpArgs;

use crate::args::{Drawing, Given, RenderArgs};

/// Options of one application, of which some are given.
#[derive(Clone, Debug)]
pub enum Setting {
    /// A volume's.
    Volume(Box<Given<RenderArgs>>),
    /// A mesh's.
    Mesh(Given<texmap::RenderOptions>),
    /// Those of a picture with depth.
    Depth(Given<WarpArgs>),
}

impl PartialEq for Setting {
    /// Settings are alike where the words are.
    fn eq(&self, other: &Self) -> bool {
        let words = |setting: &Self| setting.words().ok();
        std::mem::discriminant(self) == std::mem::discriminant(other) && words(self) == words(other)
    }
}

impl Setting {
    /// A change of a volume's options; `names` are those that it sets.
    pub fn volume(names: &[&str], set: impl FnOnce(&mut RenderArgs)) -> Self {
        Self::Volume(Box::new(Given::of(names, set)))
    }

    /// A change of a mesh's options.
    pub fn mesh(names: &[&str], set: impl FnOnce(&mut texmap::RenderOptions)) -> Self {
        Self::Mesh(Given::of(names, set))
    }

    /// A change of the options of a picture with depth.
    pub fn depth(names: &[&str], set: impl FnOnce(&mut WarpArgs)) -> Self {
        Self::Depth(Given::of(names, set))
    }

    /// The options of `other` where it gives them, else its own.
    pub fn with(&self, other: &Self) -> Result<Self> {
        Ok(match (self, other) {
            (Self::Volume(own), Self::Volume(other)) => Self::Volume(Box::new(own.with(other)?)),
            (Self::Mesh(own), Self::Mesh(other)) => Self::Mesh(own.with(other)?),
            (Self::Depth(own), Self::Depth(other)) => Self::Depth(own.with(other)?),
            _ => bail!("a setting of another application"),
        })
    }

    /// Without the options that `other` gives.
    pub fn without(&self, other: &Self) -> Self {
        match (self, other) {
            (Self::Volume(own), Self::Volume(other)) => Self::Volume(Box::new(own.without(other))),
            (Self::Mesh(own), Self::Mesh(other)) => Self::Mesh(own.without(other)),
            (Self::Depth(own), Self::Depth(other)) => Self::Depth(own.without(other)),
            _ => self.clone(),
        }
    }

    /// Returns true if the options fit one another.
    pub fn is_legal(&self) -> bool {
        match self {
            Self::Volume(given) => crate::args::volume::order::order(given).is_ok(),
            Self::Mesh(given) => given.options.validate().is_ok(),
            Self::Depth(given) => given.options.options().is_ok(),
        }
    }

    /// Returns true if both draw the same pictures, as far as that is known without a look at them.
    pub fn draws_like(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Mesh(own), Self::Mesh(other)) => own.options == other.options,
            (Self::Depth(own), Self::Depth(other)) => {
                own.options.options().ok() == other.options.options().ok()
            }
            _ => self == other,
        }
    }

    /// Name and word of each option that is given, in the order of the help.
    pub fn pairs(&self) -> Result<Vec<(String, String)>> {
        match self {
            Self::Volume(given) => given.pairs(),
            Self::Mesh(given) => given.pairs(),
            Self::Depth(given) => given.pairs(),
        }
    }

    /// As it is typed.
    pub fn words(&self) -> Result<Vec<String>> {
        let pairs = self.pairs()?.into_iter();
        Ok(pairs
            .flat_map(|(name, value)| [format!("--{name}"), value])
            .collect())
    }

    /// In short, for people: "slab 0.5, subpixels 2".
    pub fn name(&self) -> Result<String> {
        let pairs = self.pairs()?.into_iter();
        let names: Vec<String> = pairs
            .map(|(name, value)| format!("{name} {value}"))
            .collect();
        Ok(names.join(", "))
    }
}

impl Drawing {
    /// The options that say how it draws.
    pub fn setting(&self) -> Setting {
        match self {
            Self::Texmap(args) => Setting::Mesh(args.render.clone()),
            Self::Volsplat(args) => Setting::Volume(Box::new(args.render.clone())),
            Self::Warp3d(args) => Setting::Depth(args.render.clone()),
        }
    }

    /// Draws with these options from now on.
    pub fn set(&mut self, setting: Setting) -> Result<()> {
        match (self, setting) {
            (Self::Texmap(args), Setting::Mesh(render)) => args.render = render,
            (Self::Volsplat(args), Setting::Volume(render)) => args.render = *render,
            (Self::Warp3d(args), Setting::Depth(render)) => args.render = render,
            (drawing, _) => bail!("a setting of another application than {}", drawing.name()),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::args::{Cli, Command, OrderName};

    fn parsed(setting: &Setting) -> Setting {
        let scene: &[&str] = match setting {
            Setting::Volume(_) => &["volsplat", "a.nrrd"],
            Setting::Mesh(_) => &["texmap", "a.glb"],
            Setting::Depth(_) => &["warp3d", "a.png", "a.pfm"],
        };
        let words = setting.words().expect("words");
        let all = ["resample"].iter().chain(scene).chain(&["-o", "a.exr"]);
        let all = all.map(|word| (*word).to_owned()).chain(words);
        match Cli::try_parse_from(all).expect("good words").command {
            Command::Draw(drawing) => drawing.setting(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn words_give_the_same_setting_when_they_are_typed() {
        for setting in [
            Setting::volume(&["slab", "subpixels", "min-transmittance"], |args| {
                args.field.slab_voxels = 0.25;
                args.subpixels = volsplat::Subpixels::Fixed(4);
                args.min_transmittance = 0.001;
            }),
            Setting::volume(&["order"], |args| args.order = Some(OrderName::EverySample)),
            Setting::mesh(&["subpixels"], |args| args.subpixels = 2),
            Setting::depth(&["subpixels"], |args| args.subpixels = Some(8)),
        ] {
            assert_eq!(parsed(&setting), setting);
        }
    }

    #[test]
    fn settings_are_laid_over_one_another() {
        let low = Setting::volume(&["slab", "min-transmittance"], |args| {
            args.field.slab_voxels = 2.0;
            args.min_transmittance = 0.5;
        });
        let high = Setting::volume(&["slab"], |args| args.field.slab_voxels = 1.0);
        assert_eq!(
            low.with(&high).and_then(|s| s.name()).expect("good"),
            "slab 1, min-transmittance 0.5"
        );
        assert_eq!(
            low.without(&high).name().expect("good"),
            "min-transmittance 0.5"
        );
        let mesh = Setting::mesh(&[], |_| ());
        assert!(low.with(&mesh).is_err(), "another application");
    }

    #[test]
    fn a_drawing_takes_a_setting() {
        let words = ["resample", "texmap", "a.glb", "-o", "a.exr"];
        let Command::Draw(mut drawing) = Cli::try_parse_from(words).expect("good").command else {
            panic!("a command that draws")
        };
        let setting = Setting::mesh(&["subpixels"], |args| args.subpixels = 8);
        drawing.set(setting.clone()).expect("of a mesh");
        assert_eq!(drawing.setting(), setting);
        assert!(matches!(drawing, Drawing::Texmap(_)));
    }
}
