//! Rows of the table: the drawn value, the true value, the bound of their difference, and the reason for it.

/// The error of a scene that cannot be made.
pub(super) type Result<T, E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

/// One extreme: the drawn value, the true value, and the bound of their difference.
pub struct Row {
    quantity: &'static str,
    extreme: String,
    got: f64,
    truth: f64,
    bound: f64,
    why: &'static str,
}

/// The quantity that rows compare, its bound, and the reason why the bound holds.
#[derive(Clone, Copy)]
pub(super) struct Claim {
    pub(super) quantity: &'static str,
    pub(super) bound: f64,
    pub(super) why: &'static str,
}

impl Claim {
    /// A row of one number.
    pub(super) fn row(&self, extreme: impl Into<String>, [got, truth]: [f64; 2]) -> Row {
        Row {
            quantity: self.quantity,
            extreme: extreme.into(),
            got,
            truth,
            bound: self.bound,
            why: self.why,
        }
    }

    /// A row of many numbers: the pair that is farthest apart.
    pub(super) fn worst(
        &self,
        extreme: impl Into<String>,
        pairs: impl IntoIterator<Item = [f64; 2]>,
    ) -> Row {
        let apart = |[got, truth]: [f64; 2]| {
            let apart = (got - truth).abs();
            // A NaN breaks every bound.
            if apart.is_nan() { f64::INFINITY } else { apart }
        };
        let pairs = pairs.into_iter();
        let worst = pairs.reduce(|a, b| if apart(b) > apart(a) { b } else { a });
        self.row(extreme, worst.unwrap_or([f64::NAN; 2]))
    }

    /// A row of an error that must come before any work: 1 where it comes.
    pub(super) fn refused<T, E>(
        &self,
        extreme: impl Into<String>,
        result: std::result::Result<T, E>,
    ) -> Row {
        self.row(extreme, [f64::from(u8::from(result.is_err())), 1.0])
    }
}

impl Row {
    fn error(&self) -> f64 {
        (self.got - self.truth).abs()
    }

    /// Returns true if the value is within its bound.
    pub fn holds(&self) -> bool {
        self.got == self.truth || self.error() <= self.bound
    }

    /// The row in Markdown.
    pub fn line(&self) -> String {
        let verdict = if self.holds() { "" } else { " **beyond**" };
        format!(
            "| {} | {} | {:.9e} | {:.9e} | {:.1e}{verdict} | {:.0e} | {} |\n",
            self.quantity,
            self.extreme,
            self.got,
            self.truth,
            self.error(),
            self.bound,
            self.why
        )
    }
}
