//! How a scene is drawn: typed options of which only some are given, and the words that a person would type for them.
//!
//! A setting is the group of options of one application, each of them given or not. Settings are laid over one another
//! (the planner's under what was typed, those of `trade` over it), compared, and written as words: `--name value` for each
//! option that is given. Words are for people and for other processes; nothing in the program reads them again.

use std::collections::BTreeMap;

use anyhow::{Context, Result, bail};
use clap::Args;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use crate::args::{Drawing, RenderArgs, TexmapRenderArgs, WarpArgs};

/// Options of one application, of which only some are given.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Setting {
    /// A volume's.
    Volume(Box<RenderArgs>),
    /// A mesh's.
    Mesh(Box<TexmapRenderArgs>),
    /// Those of a picture with depth.
    Depth(Box<WarpArgs>),
}

impl Setting {
    /// Options of a volume.
    pub(crate) fn volume(set: impl FnOnce(&mut RenderArgs)) -> Self {
        Self::Volume(Box::new(changed(set)))
    }

    /// Options of a mesh.
    pub(crate) fn mesh(set: impl FnOnce(&mut TexmapRenderArgs)) -> Self {
        Self::Mesh(Box::new(changed(set)))
    }

    /// Options of a picture with depth.
    pub(crate) fn depth(set: impl FnOnce(&mut WarpArgs)) -> Self {
        Self::Depth(Box::new(changed(set)))
    }

    /// The options of `other` where it gives them, else its own.
    pub(crate) fn with(&self, other: &Self) -> Result<Self> {
        match (self, other) {
            (Self::Volume(own), Self::Volume(other)) => {
                // Directions and clips are not part of a change.
                let (light, clip) = (own.light, own.clip.clone());
                let mut joined: RenderArgs = joined(own.as_ref(), other.as_ref())?;
                (joined.light, joined.clip) = (light, clip);
                Ok(Self::Volume(Box::new(joined)))
            }
            (Self::Mesh(own), Self::Mesh(other)) => {
                let light = own.light;
                let mut joined: TexmapRenderArgs = joined(own.as_ref(), other.as_ref())?;
                joined.light = light;
                Ok(Self::Mesh(Box::new(joined)))
            }
            (Self::Depth(own), Self::Depth(other)) => {
                Ok(Self::Depth(Box::new(joined(own.as_ref(), other.as_ref())?)))
            }
            _ => bail!(OTHER_APPLICATION),
        }
    }

    /// The options that `other` does not give.
    pub(crate) fn without(&self, other: &Self) -> Result<Self> {
        match (self, other) {
            (Self::Volume(own), Self::Volume(other)) => {
                Ok(Self::Volume(Box::new(rest(own.as_ref(), other.as_ref())?)))
            }
            (Self::Mesh(own), Self::Mesh(other)) => {
                Ok(Self::Mesh(Box::new(rest(own.as_ref(), other.as_ref())?)))
            }
            (Self::Depth(own), Self::Depth(other)) => {
                Ok(Self::Depth(Box::new(rest(own.as_ref(), other.as_ref())?)))
            }
            _ => bail!(OTHER_APPLICATION),
        }
    }

    /// Name and value of each option that is given, in the order of the help.
    pub(crate) fn pairs(&self) -> Result<Vec<(String, String)>> {
        match self {
            Self::Volume(args) => pairs(args.as_ref()),
            Self::Mesh(args) => pairs(args.as_ref()),
            Self::Depth(args) => pairs(args.as_ref()),
        }
    }

    /// As it is typed.
    pub(crate) fn words(&self) -> Result<Vec<String>> {
        let pairs = self.pairs()?.into_iter();
        Ok(pairs
            .flat_map(|(name, value)| [format!("--{name}"), value])
            .collect())
    }

    /// In short, for people: "slab 0.5, subpixel 2".
    pub(crate) fn name(&self) -> Result<String> {
        let pairs = self.pairs()?.into_iter();
        let names: Vec<String> = pairs
            .map(|(name, value)| format!("{name} {value}"))
            .collect();
        Ok(names.join(", "))
    }
}

impl Drawing {
    /// The options that say how it draws.
    pub(crate) fn setting(&self) -> Setting {
        match self {
            Self::Texmap(args) => Setting::Mesh(Box::new(args.render.clone())),
            Self::Volsplat(args) => Setting::Volume(Box::new(args.render.clone())),
            Self::Warp3d(args) => Setting::Depth(Box::new(args.render.clone())),
        }
    }

    /// Draws with these options from now on.
    pub(crate) fn set(&mut self, setting: Setting) -> Result<()> {
        match (self, setting) {
            (Self::Texmap(args), Setting::Mesh(render)) => args.render = *render,
            (Self::Volsplat(args), Setting::Volume(render)) => args.render = *render,
            (Self::Warp3d(args), Setting::Depth(render)) => args.render = *render,
            (drawing, _) => bail!("a setting of another application than {}", drawing.name()),
        }
        Ok(())
    }
}

/// What is said of settings of two applications.
const OTHER_APPLICATION: &str = "a setting belongs to another application";

fn changed<T: Default>(set: impl FnOnce(&mut T)) -> T {
    let mut options = T::default();
    set(&mut options);
    options
}

/// The options that are given, by name.
fn given(options: &impl Serialize) -> Result<Map<String, Value>> {
    // Text keeps a number in single precision as short as it was typed.
    let text = serde_json::to_string(options)?;
    let mut map: Map<String, Value> = serde_json::from_str(&text)?;
    map.retain(|_, value| !value.is_null());
    Ok(map)
}

fn joined<T: Serialize + DeserializeOwned>(own: &T, other: &T) -> Result<T> {
    let mut map = given(own)?;
    map.extend(given(other)?);
    Ok(serde_json::from_value(Value::Object(map))?)
}

fn rest<T: Serialize + DeserializeOwned>(own: &T, other: &T) -> Result<T> {
    let (mut map, other) = (given(own)?, given(other)?);
    map.retain(|name, _| !other.contains_key(name));
    Ok(serde_json::from_value(Value::Object(map))?)
}

fn pairs<T: Args + Serialize>(options: &T) -> Result<Vec<(String, String)>> {
    let given: BTreeMap<String, Value> = given(options)?.into_iter().collect();
    let command = T::augment_args(clap::Command::new("setting"));
    let names = command.get_arguments().filter_map(|arg| arg.get_long());
    names
        .filter_map(|name| given.get_key_value(name))
        .map(|(name, value)| Ok((name.clone(), word(value).with_context(|| name.clone())?)))
        .collect()
}

/// A value as it is typed.
fn word(value: &Value) -> Result<String> {
    match value {
        Value::String(word) => Ok(word.clone()),
        Value::Number(number) => Ok(number.to_string().trim_end_matches(".0").to_owned()),
        Value::Array(values) => {
            let words: Result<Vec<String>> = values.iter().map(word).collect();
            Ok(words?.join(","))
        }
        _ => bail!("{value} cannot be typed"),
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::args::{Cli, Command, OrderArg};

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
            Setting::volume(|args| {
                args.sheets.slab = Some(0.25);
                args.sheets.subpixel = Some(volsplat::Subpixels::Fixed(4));
                args.min_transmittance = Some(0.001);
            }),
            Setting::volume(|args| args.order = Some(OrderArg::EverySample)),
            Setting::mesh(|args| args.subpixel = Some(2)),
            Setting::depth(|args| args.subpixels = Some(8)),
        ] {
            assert_eq!(parsed(&setting), setting);
        }
    }

    #[test]
    fn settings_are_laid_over_one_another() {
        let low = Setting::volume(|args| {
            args.sheets.slab = Some(2.0);
            args.min_transmittance = Some(0.5);
        });
        let high = Setting::volume(|args| args.sheets.slab = Some(1.0));
        assert_eq!(
            low.with(&high).and_then(|s| s.name()).expect("good"),
            "min-transmittance 0.5, slab 1"
        );
        assert_eq!(
            low.without(&high).and_then(|s| s.name()).expect("good"),
            "min-transmittance 0.5"
        );
        let mesh = Setting::mesh(|_| ());
        assert!(low.with(&mesh).is_err(), "another application");
    }

    #[test]
    fn a_drawing_takes_a_setting() {
        let words = ["resample", "texmap", "a.glb", "-o", "a.exr"];
        let Command::Draw(mut drawing) = Cli::try_parse_from(words).expect("good").command else {
            panic!("a command that draws")
        };
        let setting = Setting::mesh(|args| args.subpixel = Some(8));
        drawing.set(setting.clone()).expect("of a mesh");
        assert_eq!(drawing.setting(), setting);
        assert!(matches!(drawing, Drawing::Texmap(_)));
    }
}
