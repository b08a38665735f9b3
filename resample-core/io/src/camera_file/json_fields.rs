//! One JSON object, read key by key, so that every complaint names its key.
//!
//! Takes a JSON value that should be an object, gives the values of the keys that are asked for. What nobody asked
//! for is an error at the end: a misspelt optional key must not be silently ignored. Numbers are finite by the
//! grammar of JSON, except for overflow such as 1e999, which the parser refuses.

use glam::DVec3;
use resample_core::Error;
use serde_json::{Map, Value};

type Result<T> = std::result::Result<T, Error>;

/// The keys of an object that have not been asked for yet.
pub struct Fields {
    remaining: Map<String, Value>,
    asked: Vec<&'static str>,
}

impl Fields {
    /// Starts on `value`, which must be an object.
    ///
    /// # Errors
    /// A value of another kind, by its key.
    pub fn new(value: Value) -> Result<Self> {
        match value {
            Value::Object(remaining) => Ok(Self {
                remaining,
                asked: Vec::new(),
            }),
            other => Err(Error::Input(format!(
                "expected an object {{...}}, found {}",
                shortened(&other)
            ))),
        }
    }

    /// Returns true if the object holds `key`.
    pub fn holds(&self, key: &str) -> bool {
        self.remaining.contains_key(key)
    }

    /// A number, if the key is there.
    ///
    /// # Errors
    /// A value of another kind, by its key.
    pub fn number(&mut self, key: &'static str) -> Result<Option<f64>> {
        let Some(value) = self.take(key) else {
            return Ok(None);
        };
        let number = value
            .as_f64()
            .ok_or_else(|| expected(key, "a number", &value))?;
        Ok(Some(number))
    }

    /// A number that must be there.
    ///
    /// # Errors
    /// A value of another kind, by its key.
    pub fn required_number(&mut self, key: &'static str) -> Result<f64> {
        self.number(key)?.ok_or_else(|| missing(key))
    }

    /// A whole number from 0 to 2^32 - 1 that must be there.
    ///
    /// # Errors
    /// A value of another kind, by its key.
    pub fn required_count(&mut self, key: &'static str) -> Result<u32> {
        let value = self.required_value(key)?;
        let count = value.as_u64().and_then(|count| u32::try_from(count).ok());
        count.ok_or_else(|| expected(key, "a whole number", &value))
    }

    /// A list of exactly `N` numbers that must be there.
    ///
    /// # Errors
    /// A value of another kind, by its key.
    pub fn required_numbers<const N: usize>(&mut self, key: &'static str) -> Result<[f64; N]> {
        let value = self.required_value(key)?;
        let numbers: Option<Vec<f64>> = value
            .as_array()
            .and_then(|list| list.iter().map(Value::as_f64).collect());
        let array = numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok());
        array.ok_or_else(|| expected(key, &format!("a list of {N} numbers"), &value))
    }

    /// A list of three numbers that must be there.
    ///
    /// # Errors
    /// A value of another kind, by its key.
    pub fn required_vector(&mut self, key: &'static str) -> Result<DVec3> {
        self.required_numbers::<3>(key).map(DVec3::from_array)
    }

    /// One of `words`, if the key is there.
    ///
    /// # Errors
    /// A value of another kind, by its key.
    pub fn word(
        &mut self,
        key: &'static str,
        words: [&'static str; 2],
    ) -> Result<Option<&'static str>> {
        let Some(value) = self.take(key) else {
            return Ok(None);
        };
        let found = words.into_iter().find(|&word| value.as_str() == Some(word));
        let wanted = || {
            expected(
                key,
                &format!("\"{}\" or \"{}\"", words[0], words[1]),
                &value,
            )
        };
        Ok(Some(found.ok_or_else(wanted)?))
    }

    /// Complains about the first key that nobody asked for.
    ///
    /// # Errors
    /// A value of another kind, by its key.
    pub fn finish(self) -> Result<()> {
        match self.remaining.keys().next() {
            None => Ok(()),
            Some(key) => Err(Error::Input(format!(
                "unknown key \"{key}\", expected some of: {}",
                self.asked.join(", ")
            ))),
        }
    }

    /// A value of any kind that must be there.
    ///
    /// # Errors
    /// A value of another kind, by its key.
    pub fn required_value(&mut self, key: &'static str) -> Result<Value> {
        self.take(key).ok_or_else(|| missing(key))
    }

    /// A list that must be there.
    ///
    /// # Errors
    /// A value of another kind, by its key.
    pub fn required_list(&mut self, key: &'static str) -> Result<Vec<Value>> {
        match self.required_value(key)? {
            Value::Array(list) => Ok(list),
            other => Err(expected(key, "a list", &other)),
        }
    }

    /// A value of any kind, if the key is there.
    pub fn take(&mut self, key: &'static str) -> Option<Value> {
        self.asked.push(key);
        self.remaining.remove(key)
    }
}

fn missing(key: &str) -> Error {
    Error::Input(format!("\"{key}\" is missing"))
}

fn expected(key: &str, what: &str, found: &Value) -> Error {
    Error::Input(format!(
        "\"{key}\": expected {what}, found {}",
        shortened(found)
    ))
}

/// The start of a value, for a message of one line.
fn shortened(value: &Value) -> String {
    // Long enough for a vector of three numbers with all their digits.
    const LONGEST: usize = 60;
    let text = value.to_string();
    match text.char_indices().nth(LONGEST) {
        Some((at, _)) => format!("{}...", &text[..at]),
        None => text,
    }
}
