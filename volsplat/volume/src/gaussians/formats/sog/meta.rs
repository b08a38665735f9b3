//! The description of a SOG scene: `meta.json`, and tables of what a byte of its pictures stands for.
//!
//! Version 1 says the range of each channel; version 2 has a codebook of 256 numbers instead.

use serde::Deserialize;

use crate::gaussians::formats::sink::{C0, from_logit};
use crate::input::{Fault, unsupported};

/// Largest description that is read, bytes. Three codebooks take 20 kB; this is a guess beyond it.
pub(super) const MAX_BYTES: u64 = 1 << 24;

/// One number for all channels or one for each.
#[derive(Deserialize)]
#[serde(untagged)]
enum Numbers {
    One(f32),
    Each(Vec<f32>),
}

impl Numbers {
    fn channel(&self, channel: usize) -> Option<f32> {
        match self {
            Self::One(number) => Some(*number),
            Self::Each(numbers) => numbers.get(channel).copied(),
        }
    }
}

/// An attribute of all Gaussians.
#[derive(Deserialize)]
pub(super) struct Attribute {
    pub(super) files: Vec<String>,
    mins: Option<Numbers>,
    maxs: Option<Numbers>,
    /// Some programs write the lowest entry as null.
    codebook: Option<Vec<Option<f32>>>,
    shape: Option<Vec<u64>>,
    bands: Option<usize>,
}

/// The description.
#[derive(Deserialize)]
pub(super) struct Meta {
    version: Option<u32>,
    count: Option<u64>,
    #[serde(default)]
    pub(super) antialias: bool,
    pub(super) means: Attribute,
    pub(super) scales: Attribute,
    pub(super) quats: Attribute,
    pub(super) sh0: Attribute,
    #[serde(rename = "shN")]
    pub(super) sh_n: Option<Attribute>,
}

/// The value of each byte, for a channel.
pub(super) type Table = [f32; 256];

impl Meta {
    pub(super) fn read(json: &[u8]) -> Result<Self, Fault> {
        let read: Result<Self, _> = serde_json::from_slice(json);
        let meta = read.map_err(|error| {
            Fault::Invalid(format!("meta.json is no description of Gaussians: {error}"))
        })?;
        match meta.version {
            None | Some(1 | 2) => Ok(meta),
            Some(other) => Err(unsupported(format!(
                "version {other} of SOG: 1 and 2 are read; write it with another version"
            ))),
        }
    }

    /// Number of Gaussians.
    pub(super) fn count(&self) -> Result<u64, Fault> {
        let shape = self.means.shape.as_ref().and_then(|shape| shape.first());
        let none = || Fault::Invalid("meta.json does not say the number of Gaussians".to_owned());
        self.count.or(shape.copied()).ok_or_else(none)
    }

    /// Least and most of the transformed positions along each axis.
    pub(super) fn ranges(&self) -> Result<[[f32; 2]; 3], Fault> {
        let axes = [0, 1, 2].map(|axis| self.means.range("means", axis));
        let [x, y, z] = axes;
        Ok([x?, y?, z?])
    }

    /// Standard deviations.
    pub(super) fn scales(&self) -> Result<[Table; 3], Fault> {
        let logs = self.scales.tables::<3>("scales")?;
        Ok(logs.map(|table| table.map(f32::exp)))
    }

    /// Red, green and blue without harmonics, and opacity.
    pub(super) fn colours(&self) -> Result<[Table; 4], Fault> {
        let rgb = self.sh0.tables::<3>("sh0")?;
        let [r, g, b] = rgb.map(|table| table.map(|constant| 0.5 + C0 * constant));
        let opacity = match self.sh0.codebook {
            Some(_) => std::array::from_fn(|byte| byte as f32 / 255.0),
            None => table(self.sh0.range("sh0", 3)?).map(from_logit),
        };
        Ok([r, g, b, opacity])
    }
}

impl Attribute {
    /// The name of a picture.
    pub(super) fn file(&self, name: &str, number: usize) -> Result<&str, Fault> {
        let none = || {
            let expected = number + 1;
            Fault::Invalid(format!("meta.json: '{name}' has no file {expected}"))
        };
        self.files.get(number).map(String::as_str).ok_or_else(none)
    }

    /// The degree that the description says, where it does.
    pub(super) fn bands(&self) -> Option<usize> {
        self.bands
    }

    /// The value of each byte in each channel.
    pub(super) fn tables<const N: usize>(&self, name: &str) -> Result<[Table; N], Fault> {
        let mut tables = [[0.0; 256]; N];
        for (channel, table) in tables.iter_mut().enumerate() {
            *table = match &self.codebook {
                Some(codebook) => listed(codebook, name)?,
                None => self::table(self.range(name, channel)?),
            };
        }
        Ok(tables)
    }

    fn range(&self, name: &str, channel: usize) -> Result<[f32; 2], Fault> {
        let end = |numbers: &Option<Numbers>| numbers.as_ref()?.channel(channel);
        let missing = || {
            Fault::Invalid(format!(
                "meta.json: '{name}' has no range (mins, maxs) of channel {channel} and no codebook"
            ))
        };
        let range = end(&self.mins).zip(end(&self.maxs));
        range.map(|(least, most)| [least, most]).ok_or_else(missing)
    }
}

fn table([least, most]: [f32; 2]) -> Table {
    std::array::from_fn(|byte| least + (most - least) * (byte as f32 / 255.0))
}

/// A codebook as a table. A missing number takes the next one's value; bytes beyond a short codebook mean nothing.
fn listed(codebook: &[Option<f32>], name: &str) -> Result<Table, Fault> {
    if codebook.is_empty() || codebook.len() > 256 {
        return Err(Fault::Invalid(format!(
            "meta.json: the codebook of '{name}' has {} numbers: expected 256",
            codebook.len()
        )));
    }
    let mut table = [f32::NAN; 256];
    let mut next = f32::NAN;
    for (value, number) in table.iter_mut().zip(codebook).rev() {
        next = number.unwrap_or(next);
        *value = next;
    }
    Ok(table)
}
