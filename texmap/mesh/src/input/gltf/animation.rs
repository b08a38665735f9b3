//! Animations: where nodes stand and how much morph targets weigh at a moment.
//!
//! Takes the animations as JSON, gives changed transforms and weights. Channels of a node move, turn or scale it, or weigh
//! its morph targets; keys are interpolated by steps, linearly (turns along the shortest arc) or by cubic splines.
//! Source: glTF 2.0, 3.11 and appendix C. Limits: pointers to other properties (KHR_animation_pointer) are left out with
//! a note.

use std::collections::HashMap;

use glam::{DQuat, DVec3, DVec4};
use gltf::json::accessor::{ComponentType, Type};
use serde_json::Value;

use crate::input::files::excerpt;
use crate::input::gltf::accessor::{Integers, NUMBERS, Numbers, Use};
use crate::input::gltf::document::{Transform, list_of, position_of};
use crate::input::options::{Notes, Pose};

/// Transforms of all nodes, and weights of morph targets by node, at a moment.
pub(crate) struct NodePoses {
    pub transforms: Vec<Transform>,
    pub weights: HashMap<usize, Vec<f32>>,
}

impl NodePoses {
    /// The pose of the file.
    pub(crate) fn new(transforms: &[Transform]) -> Self {
        Self {
            transforms: transforms.to_vec(),
            weights: HashMap::new(),
        }
    }
}

const TIMES: Use = Use {
    name: "times",
    shapes: &[Type::Scalar],
    components: &[ComponentType::F32],
    integers: Integers::AsMarked,
};

const VECTORS: Use = Use {
    name: "vectors",
    shapes: &[Type::Vec3],
    components: NUMBERS,
    integers: Integers::AsMarked,
};

const TURNS: Use = Use {
    name: "turns",
    shapes: &[Type::Vec4],
    components: NUMBERS,
    integers: Integers::Fractions,
};

const WEIGHTS: Use = Use {
    name: "weights",
    shapes: &[Type::Scalar],
    components: NUMBERS,
    integers: Integers::Fractions,
};

/// How a sampler goes from key to key.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Interpolation {
    Step,
    Linear,
    CubicSpline,
}

/// Two neighbouring keys, and where between them a moment lies.
struct Moment {
    before: usize,
    after: usize,
    /// From 0 at the first to 1 at the second.
    along: f64,
    /// Time between the two, s.
    step_s: f64,
}

/// Poses `posed` by one of the animations.
pub(crate) fn pose(
    animations: &[Value],
    pose: &Pose,
    numbers: &Numbers,
    posed: &mut NodePoses,
    notes: &mut Notes,
) -> Result<(), String> {
    let index = chosen(animations, pose.animation.as_deref())?;
    let animation = &animations[index];
    for (number, channel) in list(animation, "channels").iter().enumerate() {
        channel_at(animation, channel, pose.time_s, numbers, posed, notes)
            .map_err(|what| format!("animation {index}, channel {number}: {what}"))?;
    }
    Ok(())
}

/// Time of the last key, s; samplers that cannot be read count as nothing.
pub(crate) fn length_s(animation: &Value, numbers: &Numbers) -> f64 {
    let samplers = list(animation, "samplers").iter();
    let last = samplers
        .filter_map(|sampler| Sampler::read(sampler, numbers).ok()?.times.last().copied())
        .map(f64::from);
    last.fold(0.0, f64::max)
}

fn chosen(animations: &[Value], asked: Option<&str>) -> Result<usize, String> {
    let name = |animation| Value::get(animation, "name").and_then(Value::as_str);
    let names: Vec<_> = animations.iter().map(name).collect();
    let index = asked.map_or(Some(0), |word| position_of(&names, word));
    if let Some(index) = index.filter(|&index| index < names.len()) {
        return Ok(index);
    }
    let asked = asked.map_or("a pose".to_owned(), |word| {
        format!("animation '{}'", excerpt(word))
    });
    Err(match names.len() {
        0 => format!("{asked} was asked for, but the file has no animations"),
        _ => format!("{asked} does not exist: the file has {}", list_of(&names)),
    })
}

fn channel_at(
    animation: &Value,
    channel: &Value,
    time_s: f64,
    numbers: &Numbers,
    posed: &mut NodePoses,
    notes: &mut Notes,
) -> Result<(), String> {
    let target = channel.get("target").unwrap_or(&Value::Null);
    let path = target
        .get("path")
        .and_then(Value::as_str)
        .unwrap_or_default();
    if path == "pointer" {
        notes.say("animated properties other than nodes and morph targets stand still".to_owned());
        return Ok(());
    }
    // A channel without a node is for an extension.
    let Some(node) = index(target, "node") else {
        return Ok(());
    };
    let sampler = index(channel, "sampler").and_then(|at| list(animation, "samplers").get(at));
    let sampler = Sampler::read(sampler.ok_or("its sampler does not exist")?, numbers)?;
    let moment = sampler.moment(time_s);
    let transform = posed
        .transforms
        .get_mut(node)
        .ok_or_else(|| format!("node {node} does not exist"))?;
    if path != "weights" {
        // An animated node has no matrix of its own.
        transform.matrix = None;
    }
    match path {
        "translation" => transform.translation = sampler.vector(numbers, &moment)?,
        "scale" => transform.scale = sampler.vector(numbers, &moment)?,
        "rotation" => transform.rotation = sampler.turn(numbers, &moment)?,
        "weights" => {
            posed
                .weights
                .insert(node, sampler.weights(numbers, &moment)?);
        }
        other => return Err(format!("its path '{}' is unknown", excerpt(other))),
    }
    Ok(())
}

/// Keys of a channel.
struct Sampler {
    times: Vec<f32>,
    output: usize,
    interpolation: Interpolation,
}

impl Sampler {
    fn read(sampler: &Value, numbers: &Numbers) -> Result<Self, String> {
        let interpolation = match sampler.get("interpolation").and_then(Value::as_str) {
            None | Some("LINEAR") => Interpolation::Linear,
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::CubicSpline,
            Some(other) => {
                return Err(format!("the interpolation '{}' is unknown", excerpt(other)));
            }
        };
        let input = index(sampler, "input").ok_or("its sampler has no input")?;
        let times: Vec<f32> = numbers
            .vectors::<1>(input, &TIMES)?
            .into_iter()
            .map(|[time]| time)
            .collect();
        if times.is_empty() || !times.is_sorted_by(|a, b| a < b) {
            return Err("its times do not grow from key to key".into());
        }
        let output = index(sampler, "output").ok_or("its sampler has no output")?;
        Ok(Self {
            times,
            output,
            interpolation,
        })
    }

    fn moment(&self, time_s: f64) -> Moment {
        let last = self.times.len() - 1;
        let after = self
            .times
            .partition_point(|&t| f64::from(t) <= time_s)
            .min(last);
        let before = after.saturating_sub(1);
        let [start, end] = [before, after].map(|key| f64::from(self.times[key]));
        let step_s = end - start;
        let along = if step_s > 0.0 {
            ((time_s - start) / step_s).clamp(0.0, 1.0)
        } else {
            0.0
        };
        Moment {
            before,
            after,
            along,
            step_s,
        }
    }

    /// Values that a key has: with splines also the tangents before and behind it.
    fn per_key(&self) -> usize {
        match self.interpolation {
            Interpolation::Step | Interpolation::Linear => 1,
            Interpolation::CubicSpline => 3,
        }
    }

    /// The value at a moment of keys of `width` values each, component by component.
    fn at<const N: usize>(
        &self,
        values: &[[f32; N]],
        width: usize,
        place: usize,
        moment: &Moment,
    ) -> [f64; N] {
        let per_key = self.per_key();
        let value =
            |key: usize, part: usize| values[(key * per_key + part) * width + place].map(f64::from);
        let t = moment.along;
        let mut sum = [0.0; N];
        let mut add = |weight: f64, value: [f64; N]| {
            for (sum, value) in sum.iter_mut().zip(value) {
                *sum += weight * value;
            }
        };
        match self.interpolation {
            Interpolation::Step => {
                let key = if t < 1.0 { moment.before } else { moment.after };
                add(1.0, value(key, 0));
            }
            Interpolation::Linear => {
                add(1.0 - t, value(moment.before, 0));
                add(t, value(moment.after, 0));
            }
            Interpolation::CubicSpline => {
                // Hermite's basis; a key holds the tangent before it, its value, and the tangent behind it.
                let (t2, t3) = (t * t, t * t * t);
                add(2.0 * t3 - 3.0 * t2 + 1.0, value(moment.before, 1));
                add(moment.step_s * (t3 - 2.0 * t2 + t), value(moment.before, 2));
                add(-2.0 * t3 + 3.0 * t2, value(moment.after, 1));
                add(moment.step_s * (t3 - t2), value(moment.after, 0));
            }
        }
        sum
    }

    fn checked<const N: usize>(
        &self,
        numbers: &Numbers,
        how: &Use,
    ) -> Result<Vec<[f32; N]>, String> {
        let values = numbers.vectors::<N>(self.output, how)?;
        let expected = self.times.len() * self.per_key();
        if values.is_empty() || values.len() % expected != 0 {
            return Err(format!(
                "{} values for {} keys, expected {expected}",
                values.len(),
                self.times.len()
            ));
        }
        Ok(values)
    }

    fn vector(&self, numbers: &Numbers, moment: &Moment) -> Result<DVec3, String> {
        let values = self.checked::<3>(numbers, &VECTORS)?;
        Ok(self.at(&values, 1, 0, moment).into())
    }

    fn turn(&self, numbers: &Numbers, moment: &Moment) -> Result<DQuat, String> {
        let values = self.checked::<4>(numbers, &TURNS)?;
        let quaternion = |values: [f64; 4]| {
            let turn = DVec4::from_array(values).try_normalize();
            DQuat::from_vec4(turn.unwrap_or(DVec4::W))
        };
        if self.interpolation != Interpolation::Linear {
            return Ok(quaternion(self.at(&values, 1, 0, moment)));
        }
        let [before, after] =
            [moment.before, moment.after].map(|key| quaternion(values[key].map(f64::from)));
        // The crate takes the shorter arc.
        Ok(before.slerp(after, moment.along))
    }

    fn weights(&self, numbers: &Numbers, moment: &Moment) -> Result<Vec<f32>, String> {
        let values = self.checked::<1>(numbers, &WEIGHTS)?;
        let targets = values.len() / (self.times.len() * self.per_key());
        let weight = |target: usize| self.at(&values, targets, target, moment)[0] as f32;
        Ok((0..targets).map(weight).collect())
    }
}

fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    let list = value.get(key).and_then(Value::as_array);
    list.map_or(&[], Vec::as_slice)
}

/// An index, which some programs write as `1.0`.
fn index(value: &Value, key: &str) -> Option<usize> {
    let number = value.get(key)?.as_f64()?;
    (number >= 0.0 && number.fract() == 0.0).then_some(number as usize)
}
