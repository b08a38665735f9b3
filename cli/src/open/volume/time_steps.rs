//! A volume that changes over time: the steps that the input names, and one look and one view for all of them.
//!
//! Takes the input as it was typed, gives the steps' files; reads them one after another, keeps their values' ranges, counts and places, and
//! later shows one step at a time. Limits: each step is read into memory as a whole.

use anyhow::{Context, Result, bail};
use volsplat::volume::Steps;

use crate::args::VolsplatArgs;
use crate::open::volume::file::load_options;
use crate::open::volume::scene;
use crate::open::volume::scene::Volumes;
use crate::open::volume::step_values::StepValues;
use crate::output::{FrameNames, kind_of};
use crate::plan::Purpose;
use crate::process::report::{Progress, watch};
use crate::values;
use crate::values::input_file::InputFile;
use crate::values::{FrameRange, LookOf};

/// The steps of a volume over time.
#[derive(Clone)]
pub(crate) struct TimeSteps {
    /// The file of each, in their order; at least one.
    pub(crate) inputs: Vec<InputFile>,
    /// The steps that decide about look and view.
    pub(super) look_of: LookOf,
    /// The step that all pictures show.
    only: Option<usize>,
    /// The step that the content holds.
    shown: usize,
}

impl TimeSteps {
    /// The steps that the input names by a pattern, a list or its points in time; `None` where it names one volume.
    ///
    /// Films, numbered pictures and the viewer take all points in time of a file if the input names none. The viewer then decides the look from the
    /// first, because reading all of them would delay its first picture.
    pub(crate) fn of(args: &VolsplatArgs, purpose: Purpose) -> Result<Option<Self>> {
        if args.source.held().is_some() {
            return Ok(None);
        }
        let input = &args.input;
        let is_viewed = purpose == Purpose::Change || args.only_step.is_some();
        let mut look_of = args.look_of;
        let named = times_of(input)?.map(|(range, others)| steps_of(args, range, &others));
        let mut inputs = named.transpose()?;
        if inputs.is_none() && (is_viewed || is_moving(args)?) {
            inputs = unnamed_times(args)?;
            if inputs.is_some() && is_viewed && look_of == LookOf::All {
                look_of = LookOf::Step(0);
            }
        }
        let inputs = match inputs {
            Some(inputs) => inputs,
            None => {
                let Some(files) = volsplat::input::step_files(&input.path)? else {
                    return Ok(None);
                };
                let step = |path| InputFile {
                    path,
                    part: input.part.clone(),
                };
                files.into_iter().map(step).collect()
            }
        };
        if let LookOf::Step(step) = look_of
            && step >= inputs.len()
        {
            bail!(
                "--look-of {step}: {input} has {} steps, counted from 0",
                inputs.len()
            );
        }
        Ok(Some(Self {
            inputs,
            look_of,
            only: args.only_step,
            shown: 0,
        }))
    }

    /// The step of a picture: as many pictures as steps show one each, others spread over them.
    fn of_picture(&self, number: usize, pictures: usize) -> usize {
        if let Some(step) = self.only {
            return step;
        }
        (number * self.inputs.len() / pictures.max(1)).min(self.inputs.len() - 1)
    }

    /// The step of a picture where it is another one than that which is shown, which it is from now on.
    pub(crate) fn turn_to(&mut self, (number, pictures): (usize, usize)) -> Option<usize> {
        let step = self.of_picture(number, pictures);
        (step != self.shown).then(|| {
            self.shown = step;
            step
        })
    }

    /// The arguments that draw one step alone.
    pub(crate) fn args_of(&self, step: usize, args: &VolsplatArgs) -> VolsplatArgs {
        VolsplatArgs {
            input: self.inputs[step].clone(),
            ..args.clone()
        }
    }

    /// Reads the steps that decide about look and view.
    pub(crate) fn values(
        &self,
        args: &VolsplatArgs,
        first: &Volumes,
        progress: Progress,
    ) -> Result<StepValues> {
        let steps = match self.look_of {
            LookOf::All => 0..self.inputs.len(),
            LookOf::Step(step) => step..step + 1,
        };
        let mut tell = watch("looking at the steps", progress);
        let mut values: Option<StepValues> = None;
        let count = steps.len();
        for (done, step) in steps.enumerate() {
            tell(done as f64 / count as f64);
            let read = match step {
                0 => None,
                _ => Some(scene::load(
                    &self.args_of(step, args),
                    &args.volume.reading.gate(),
                )?),
            };
            let volumes = read.as_ref().unwrap_or(first);
            match &mut values {
                None => values = Some(StepValues(volumes.all().map(Steps::new).collect())),
                Some(values) => values
                    .add(volumes.all())
                    .with_context(|| self.inputs[step].to_string())?,
            }
        }
        values.context("no steps")
    }
}

/// True if the output is a film or numbered files, and the camera rests.
fn is_moving(args: &VolsplatArgs) -> Result<bool> {
    if args.sequence.turntable.is_some() || args.sequence.path.is_some() {
        return Ok(false);
    }
    let film = kind_of(&args.output, None, false)?;
    Ok(film.is_some() || FrameNames::from_pattern(&args.output)?.is_some())
}

/// All points in time as steps; `None` if the input names one of them or the file holds only one.
fn unnamed_times(args: &VolsplatArgs) -> Result<Option<Vec<InputFile>>> {
    let input = &args.input;
    let part = input.part.iter().flat_map(|part| part.split(','));
    let others: Vec<String> = part.map(str::to_owned).collect();
    let names_time = others.iter().any(|pair| pair.starts_with("time="));
    if names_time || !input.path.exists() {
        return Ok(None);
    }
    let steps = steps_of(args, None, &others)?;
    Ok((steps.len() > 1).then_some(steps))
}

/// The points in time of a part such as `time=all` or `time=3..9`, and the rest of the part.
fn times_of(input: &InputFile) -> Result<Option<(Option<FrameRange>, Vec<String>)>> {
    let Some(part) = &input.part else {
        return Ok(None);
    };
    let is_time = |pair: &&str| {
        let value = pair.strip_prefix("time=");
        value.is_some_and(|value| value == "all" || value.contains(".."))
    };
    let pairs: Vec<&str> = part.split(',').collect();
    let Some(time) = pairs.iter().find(|pair| is_time(pair)) else {
        return Ok(None);
    };
    let others = pairs.iter().filter(|pair| *pair != time);
    let range = match time.strip_prefix("time=") {
        Some("all") | None => None,
        Some(range) => {
            let parsed = values::frames(range);
            Some(parsed.map_err(|error| anyhow::anyhow!("{input}: {error}"))?)
        }
    };
    let others = others.map(|pair| (*pair).to_owned()).collect();
    Ok(Some((range, others)))
}

/// The points in time of a file as steps of their own.
fn steps_of(
    args: &VolsplatArgs,
    range: Option<FrameRange>,
    others: &[String],
) -> Result<Vec<InputFile>> {
    let input = &args.input;
    let file = InputFile {
        path: input.path.clone(),
        part: (!others.is_empty()).then(|| others.join(",")),
    };
    let options = load_options(&args.volume, &file, &args.volume.reading.gate())?;
    let count = volsplat::input::axes_of(&input.path, &options)?.times;
    let whole = FrameRange {
        first: 0,
        end: None,
    };
    let range = range.unwrap_or(whole);
    let Some(numbers) = range
        .of(count)
        .filter(|_| range.end.is_none_or(|end| end <= count))
    else {
        bail!(
            "{input}: the file holds {count} point(s) in time, counted from 0: expected a part of them"
        );
    };
    let step = |time: usize| InputFile {
        path: input.path.clone(),
        part: Some([others, &[format!("time={time}")]].concat().join(",")),
    };
    Ok(numbers.map(step).collect())
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    #[test]
    fn times_of_a_part_are_all_or_a_range() {
        let of = |part: &str| {
            times_of(&InputFile {
                path: "a.nii".into(),
                part: Some(part.to_owned()),
            })
        };
        assert!(of("time=3,component=1").expect("one").is_none());
        let (range, others) = of("component=1,time=all").expect("all").expect("several");
        assert!(range.is_none() && others == ["component=1"]);
        let (range, others) = of("time=2..5").expect("some").expect("several");
        assert!(range.is_some() && others.is_empty());
        assert!(of("time=2..x").is_err());
    }

    #[test]
    fn pictures_spread_over_the_steps() {
        let steps = TimeSteps {
            inputs: ["a", "b", "c"]
                .map(|name| InputFile::from(PathBuf::from(name)))
                .to_vec(),
            look_of: LookOf::All,
            only: None,
            shown: 0,
        };
        let shown = |pictures| -> Vec<usize> {
            (0..pictures)
                .map(|number| steps.of_picture(number, pictures))
                .collect()
        };
        assert_eq!(shown(3), [0, 1, 2]);
        assert_eq!(shown(6), [0, 0, 1, 1, 2, 2]);
        assert_eq!(shown(1), [0]);
    }
}
