//! The bound that a person asked for: an error or a time.

use serde_json::{Value, json};

use super::search::Goal;
use crate::values::Bound;

/// A bound on the error or on the time.
#[derive(Clone, Copy, Debug)]
pub(super) enum Asked {
    /// At most this error.
    Error(Bound),
    /// At most this time, ms.
    Time(f64),
}

impl Asked {
    /// The goal of a search.
    pub(super) fn goal(self) -> Goal {
        match self {
            Self::Error(_) => Goal::LeastCost,
            Self::Time(_) => Goal::LeastError,
        }
    }

    /// The bound as numbers.
    pub(super) fn record(self) -> Value {
        match self {
            Self::Error(bound) => json!({"metric": bound.metric.name(), "bound": bound.value}),
            Self::Time(time_ms) => json!({"metric": "time_ms", "bound": time_ms}),
        }
    }
}
