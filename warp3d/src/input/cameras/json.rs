//! Values inside JSON of any shape, each complaint with the name of its key.

use serde_json::Value;

/// The value that a text holds.
pub(super) fn value(text: &str) -> Result<Value, String> {
    serde_json::from_str(text).map_err(|error| format!("not valid JSON: {error}"))
}

/// A number under a key.
pub(super) fn number(object: &Value, key: &str) -> Result<Option<f64>, String> {
    match object.get(key) {
        None | Some(Value::Null) => Ok(None),
        Some(value) => value
            .as_f64()
            .map(Some)
            .ok_or_else(|| format!("\"{key}\": expected a number, found {}", short(value))),
    }
}

/// A number that must be there.
pub(super) fn required(object: &Value, key: &str) -> Result<f64, String> {
    number(object, key)?.ok_or_else(|| format!("\"{key}\" is missing"))
}

/// A whole number of pixels; some writers store it as 640.0.
pub(super) fn side(object: &Value, key: &str) -> Result<Option<u32>, String> {
    let Some(px) = number(object, key)? else {
        return Ok(None);
    };
    let whole = px >= 1.0 && px <= f64::from(u32::MAX) && px.fract() == 0.0;
    if whole {
        Ok(Some(px as u32))
    } else {
        Err(format!(
            "\"{key}\" is {px}: expected a whole number of pixels"
        ))
    }
}

/// Exactly `N` numbers under a key; lists inside the list are joined, as rows of a matrix are.
pub(super) fn numbers<const N: usize>(object: &Value, key: &str) -> Result<[f64; N], String> {
    let value = object
        .get(key)
        .ok_or_else(|| format!("\"{key}\" is missing"))?;
    let mut found = Vec::new();
    for entry in value.as_array().into_iter().flatten() {
        match entry.as_array() {
            Some(row) => found.extend(row.iter().map(Value::as_f64)),
            None => found.push(entry.as_f64()),
        }
    }
    let found: Option<Vec<f64>> = found.into_iter().collect();
    let array = found.and_then(|found| <[f64; N]>::try_from(found).ok());
    array.ok_or_else(|| {
        format!(
            "\"{key}\": expected a list of {N} numbers, found {}",
            short(value)
        )
    })
}

/// The start of a value, for a message.
fn short(value: &Value) -> String {
    value.to_string().chars().take(60).collect()
}
