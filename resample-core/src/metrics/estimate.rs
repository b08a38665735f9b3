//! From the errors in some windows to the error of whole pictures, with a margin that the spread among windows gives.
//!
//! Root mean square: each draw of a window gives an estimate of the picture's sum of squares (its own sum over its chance);
//! their mean is unbiased, and two standard errors of that mean are added. Of several views the worst counts, and for the
//! pictures between them parts of the worst and of the mean step between neighbouring views are added: an eighth and a
//! half for eight views, more for fewer: small pictures have few edges, and single ones stand out.
//! Largest change: of a volume all pixels are drawn under two settings, and windows stand where these differ most (`largest_by_change`).
//! Of meshes and depth images the maxima of the windows are taken for draws from a Gumbel distribution, the law of maxima of many
//! pixels; its two numbers come from their mean and spread, and the bound is what the maximum over all cells of all pictures
//! exceeds with a chance of one in fifty, twice over: it is the weaker promise of the two.

/// The error that is bounded. Both are of linear, premultiplied red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoundMetric {
    /// Root mean square over the covered pixels of the exact picture.
    Rms,
    /// Largest change of any pixel.
    Max,
}

impl BoundMetric {
    /// As it is typed.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rms => "rms",
            Self::Max => "max",
        }
    }
}

/// Error of a window against the exact setting.
#[derive(Clone, Copy, Debug)]
pub struct WindowError {
    /// Sum of squares over the covered pixels' red, green and blue.
    pub squares: f64,
    /// Largest change of any pixel.
    pub max: f64,
    /// The change between the two settings that decided where windows stand: the largest where they are ranked, else the sum of
    /// squares.
    pub change: Option<f64>,
    /// The chance of the window.
    pub chance: f64,
    /// How often it was drawn.
    pub draws: usize,
}

/// The windows of one view.
#[derive(Clone, Debug)]
pub struct ViewErrors {
    /// Their errors.
    pub windows: Vec<WindowError>,
    /// Pixels of the view that are covered.
    pub covered_px: f64,
    /// Cells from which windows were drawn.
    pub cells: usize,
    /// The mean square of the change of the whole picture to one of more rays, where that was drawn.
    pub mean_square_change: Option<f64>,
    /// The sum of the squared changes between two settings over all cells, where these were compared.
    pub change: Option<f64>,
    /// Where windows are ranked: the largest change in all other cells.
    pub change_behind: Option<f64>,
}

/// Standard errors that are added to a mean. Their number is doubled where there are no more than so many draws, because the
/// spread of a few draws is itself uncertain, as in Student's distribution.
const STANDARD_ERRORS: f64 = 2.0;
const FEW_DRAWS: f64 = 4.0;

/// The most pictures of a sequence that are looked at.
pub const MOST_VIEWS: usize = 8;

/// How many of the steps between views are added to the worst of them, over the number of views, for the pictures between:
/// the fewer views, the longer the way from one to the next. A guess, held to in `docs/results/planner.md`.
const STEPS: f64 = 4.0;

/// Euler's constant: the mean of the standard Gumbel distribution.
const EULER: f64 = 0.577_215_664_901_532_9;

/// Factor on a predicted largest change. Calibrated: edges have longer tails than the law knows, and the largest true
/// change was 1.5 times the predicted one in the scenes that were tried first.
const SAFETY: f64 = 2.0;

/// The same for cells that are ranked by a change of all pixels, and how many windows, over their number, add as much as half of it.
/// Calibrated on random volumes (`docs/results/planner.md`).
const RANKED_SAFETY: f64 = 2.5;
const FEW_WINDOWS: f64 = 4.0;

/// Most that a view's mean square is raised for change that its windows miss: windows without any change tell nothing of an error,
/// and a finite number keeps predictions in order.
const MOST_MISSED: f64 = 1e4;

/// Changes below this part of the full scale say nothing of an error: a hundredth of a step of an 8-bit picture.
const LEAST_CHANGE: f64 = 4e-5;

/// -ln(-ln(1 - 1/50)): where one maximum in fifty lies above.
const ONE_IN_FIFTY: f64 = 3.902;

/// The predicted error of the worst of `pictures` pictures.
pub fn predicted(metric: BoundMetric, views: &[ViewErrors], pictures: usize) -> f64 {
    match metric {
        BoundMetric::Rms => root_mean_square(views, pictures),
        BoundMetric::Max => largest(views, pictures),
    }
}

/// The error of the worst picture that was looked at, without a margin.
pub fn seen(metric: BoundMetric, views: &[ViewErrors]) -> f64 {
    let of_view = |view: &ViewErrors| match metric {
        BoundMetric::Rms => mean_and_deviation(&estimates(view)).0.sqrt(),
        BoundMetric::Max => view.windows.iter().map(|w| w.max).fold(0.0, f64::max),
    };
    views.iter().map(of_view).fold(0.0, f64::max)
}

fn root_mean_square(views: &[ViewErrors], pictures: usize) -> f64 {
    let bounds: Vec<f64> = views
        .iter()
        .filter(|view| view.covered_px > 0.0)
        .map(mean_square)
        .collect();
    let steps: Vec<f64> = bounds
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .collect();
    let step = steps.iter().sum::<f64>() / steps.len().max(1) as f64;
    let worst = bounds.iter().copied().fold(0.0, f64::max);
    let views_per_most = views.len() as f64 / MOST_VIEWS as f64;
    let unseen =
        worst / (MOST_VIEWS as f64 * views_per_most.powi(3)) + STEPS * step / views.len() as f64;
    let between = if views.len() >= pictures { 0.0 } else { unseen };
    (worst + between).sqrt()
}

/// The mean square error of a view, with its margin.
fn mean_square(view: &ViewErrors) -> f64 {
    let estimates = estimates(view);
    let (mean, deviation) = mean_and_deviation(&estimates);
    let draws = estimates.len().max(1) as f64;
    let own = mean + STANDARD_ERRORS * (1.0 + FEW_DRAWS / draws) * deviation / draws.sqrt();
    // Errors of rays stand in a few pixels, at rims and peaks, and often in no window; what more rays change is known of all pixels.
    (own * missed(view)).max(view.mean_square_change.unwrap_or_default())
}

/// How many times the change that the windows hold, by their chances, is in the whole picture; 1 where they hold it all or more.
/// The change of all pixels between two settings is known, and where windows miss it they miss errors too.
fn missed(view: &ViewErrors) -> f64 {
    let Some(all) = view.change.filter(|all| *all > 0.0) else {
        return 1.0;
    };
    let of = |w: &WindowError| w.draws as f64 * w.change.unwrap_or_default() / w.chance;
    let draws: usize = view.windows.iter().map(|w| w.draws).sum();
    let found = view.windows.iter().map(of).sum::<f64>() / draws.max(1) as f64;
    (all / found.max(f64::MIN_POSITIVE)).clamp(1.0, MOST_MISSED)
}

/// Estimates of the mean square of a view, one for each draw.
fn estimates(view: &ViewErrors) -> Vec<f64> {
    let of = |w: &WindowError| w.squares / (w.chance * 3.0 * view.covered_px);
    let windows = view.windows.iter();
    windows
        .flat_map(|w| std::iter::repeat_n(of(w), w.draws))
        .collect()
}

/// The largest error of a view whose windows changed most between two settings: that of the windows, or in the other cells that of the
/// windows in proportion to the change, with a margin. A window that changed less than other cells stands for those like it.
fn largest_by_change(view: &ViewErrors, behind: f64) -> f64 {
    let seen = view.windows.iter().map(|w| w.max).fold(0.0, f64::max);
    let scaled = |w: &WindowError| {
        let change = w.change.unwrap_or_default();
        w.max * behind / change.max(behind).max(LEAST_CHANGE)
    };
    let scaled = view.windows.iter().map(scaled).fold(0.0, f64::max);
    let few = 0.5 * (1.0 + FEW_WINDOWS / view.windows.len().max(1) as f64);
    seen.max(RANKED_SAFETY * few.max(1.0) * scaled)
}

fn largest(views: &[ViewErrors], pictures: usize) -> f64 {
    let ranked: Option<Vec<f64>> = views
        .iter()
        .map(|view| Some(largest_by_change(view, view.change_behind?)))
        .collect();
    if let Some(ranked) = ranked.filter(|ranked| !ranked.is_empty()) {
        let worst = ranked.into_iter().fold(0.0, f64::max);
        return if pictures > views.len() {
            SAFETY * worst
        } else {
            worst
        };
    }
    let maxima: Vec<f64> = views
        .iter()
        .flat_map(|view| view.windows.iter().map(|w| w.max))
        .collect();
    let seen = maxima.iter().copied().fold(0.0, f64::max);
    let (mean, deviation) = mean_and_deviation(&maxima);
    if views.iter().all(|view| view.cells <= view.windows.len()) && pictures <= views.len() {
        // Nothing was left out.
        return seen;
    }
    let scale = deviation * 6.0_f64.sqrt() / std::f64::consts::PI;
    let cells =
        views.iter().map(|view| view.cells).sum::<usize>() as f64 / views.len().max(1) as f64;
    let draws = (cells * pictures as f64).max(1.0);
    let place = mean - EULER * scale;
    SAFETY * seen.max(place + scale * (draws.ln() + ONE_IN_FIFTY))
}

/// Mean, and standard deviation of the sample; of fewer than two the deviation is 0.
fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, (squares / (count - 1.0).max(1.0)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window(squares: f64, max: f64, chance: f64) -> WindowError {
        WindowError {
            squares,
            max,
            change: None,
            chance,
            draws: 1,
        }
    }

    #[test]
    fn errors_in_proportion_to_chances_have_no_margin() {
        let windows = vec![window(3.0 * 0.02, 0.1, 0.2), window(3.0 * 0.08, 0.1, 0.8)];
        let view = ViewErrors {
            windows,
            covered_px: 10.0,
            cells: 2,
            mean_square_change: None,
            change: None,
            change_behind: None,
        };
        let found = predicted(BoundMetric::Rms, &[view], 1);
        assert!(
            (found - 0.1).abs() < 1e-12,
            "all estimates agree on 0.01 a pixel: {found}"
        );
    }

    #[test]
    fn pictures_that_were_not_seen_widen_the_bound() {
        let view = ViewErrors {
            windows: vec![window(3.0, 0.1, 1.0)],
            covered_px: 100.0,
            cells: 1,
            mean_square_change: None,
            change: None,
            change_behind: None,
        };
        let of = |views: usize, pictures| {
            predicted(BoundMetric::Rms, &vec![view.clone(); views], pictures)
        };
        assert!((of(3, 3) - 0.1).abs() < 1e-12, "all were seen");
        assert!(
            of(3, 64) > 1.1 * of(3, 3) && of(8, 64) < of(3, 64),
            "the more, the fewer were seen"
        );
    }

    #[test]
    fn no_error_is_predicted_below_the_change_to_more_rays() {
        let view = |change: f64| ViewErrors {
            windows: vec![window(0.3, 0.1, 0.25); 2],
            covered_px: 100.0,
            cells: 100,
            mean_square_change: Some(change),
            change: None,
            change_behind: None,
        };
        let of = |change| predicted(BoundMetric::Rms, &[view(change)], 1);
        assert!((of(0.04) - 0.2).abs() < 1e-12, "more than the windows show");
        assert!(
            (of(1e-6) - 0.004_f64.sqrt()).abs() < 1e-12,
            "0.3 / (0.25 * 300)"
        );
    }

    #[test]
    fn change_that_windows_miss_raises_the_error() {
        let changed = |change: f64| WindowError {
            change: Some(change),
            ..window(0.3, 0.1, 0.25)
        };
        let view = |changes: [f64; 2]| ViewErrors {
            windows: changes.map(changed).to_vec(),
            covered_px: 100.0,
            cells: 100,
            mean_square_change: None,
            change: Some(4.0),
            change_behind: None,
        };
        let of = |changes| predicted(BoundMetric::Rms, &[view(changes)], 1);
        let whole = of([1.0, 1.0]);
        assert!(
            (of([0.5, 0.0]) - 2.0 * whole).abs() < 1e-12,
            "a quarter was found"
        );
        assert_eq!(of([2.0, 3.0]), whole, "more than all is no credit");
    }

    #[test]
    fn what_changed_most_bounds_the_largest_error_of_the_rest() {
        let ranked = |max: f64, change: f64| WindowError {
            change: Some(change),
            ..window(0.3, max, 0.01)
        };
        let view = |behind: f64| ViewErrors {
            windows: vec![ranked(0.10, 0.08), ranked(0.03, 0.05)],
            covered_px: 100.0,
            cells: 100,
            mean_square_change: None,
            change: None,
            change_behind: Some(behind),
        };
        let of = |behind: f64| predicted(BoundMetric::Max, &[view(behind)], 1);
        assert_eq!(of(0.0), 0.10, "nothing changed elsewhere");
        assert_eq!(
            of(0.01),
            0.10,
            "3.75 * 1.25 * 0.01 is less than what was seen"
        );
        assert!((of(0.06) - 0.28125).abs() < 1e-12, "3.75 * 1.25 * 0.06");
        assert!(
            (of(0.5) - 0.375).abs() < 1e-12,
            "no more than 3.75 times what was seen"
        );
    }

    #[test]
    fn spread_widens_the_bound() {
        let even = ViewErrors {
            windows: vec![window(0.3, 0.1, 0.25); 4],
            covered_px: 100.0,
            cells: 100,
            mean_square_change: None,
            change: None,
            change_behind: None,
        };
        let mut uneven = even.clone();
        uneven.windows[0].squares = 0.6;
        uneven.windows[0].max = 0.15;
        uneven.windows[1].squares = 0.0;
        uneven.windows[1].max = 0.05;
        for metric in [BoundMetric::Rms, BoundMetric::Max] {
            let of = |view: &ViewErrors| predicted(metric, std::slice::from_ref(view), 1);
            let (a, b) = (of(&even), of(&uneven));
            assert!(b > 1.1 * a, "{metric:?}: {b} after {a}");
        }
        let (one, many) = (
            predicted(BoundMetric::Max, &[uneven.clone()], 1),
            predicted(BoundMetric::Max, &[uneven], 64),
        );
        assert!(many > one, "more pictures have a larger maximum");
    }

    /// A view of 100 pixels and as many cells, each window with a chance of a quarter.
    fn view(squares: &[f64], maxima: &[f64]) -> ViewErrors {
        let windows = squares.iter().zip(maxima);
        ViewErrors {
            windows: windows.map(|(&s, &max)| window(s, max, 0.25)).collect(),
            covered_px: 100.0,
            cells: 100,
            mean_square_change: None,
            change: None,
            change_behind: None,
        }
    }

    fn near(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-6, "{found}, not {expected}");
    }

    #[test]
    fn margins_are_those_of_the_documentation() {
        let uneven = [view(&[0.6, 0.0, 0.3, 0.3], &[0.15, 0.05, 0.1, 0.1])];
        // Mean squares of 0.008, 0, 0.004 and 0.004, with a deviation of 0.003266. Of four draws the two standard errors of 0.001633 are doubled.
        near(predicted(BoundMetric::Rms, &uneven, 1), 0.102_625);
        near(seen(BoundMetric::Rms, &uneven), 0.004_f64.sqrt());
        // Sixteen draws have 2.5 of theirs: the mean is 0.004, the deviation 0.002921.
        let many = [view(
            &[0.6, 0.0, 0.3, 0.3].repeat(4),
            &[0.15, 0.05, 0.1, 0.1].repeat(4),
        )];
        near(predicted(BoundMetric::Rms, &many, 1), 0.076_327);
        // Gumbel's law with a mean of 0.1 and a deviation of 0.040825: its scale is 0.031831, its place 0.081627.
        near(predicted(BoundMetric::Max, &uneven, 1), 0.704_837);
        near(predicted(BoundMetric::Max, &uneven, 64), 0.969_599);
        near(seen(BoundMetric::Max, &uneven), 0.15);
    }

    #[test]
    fn pictures_between_the_views_add_parts_of_the_worst_and_of_the_steps() {
        let of = |mean_square: f64| view(&[75.0 * mean_square], &[0.1]);
        let rms = |views: &[ViewErrors], pictures| predicted(BoundMetric::Rms, views, pictures);
        // An eighth of the worst for eight views, 512 / 27 of that for three.
        let even = vec![of(0.01); 8];
        near(rms(&even, 64), 0.01125_f64.sqrt());
        near(rms(&even[..3], 64), 0.183_586);
        // Four views: an eighth of the worst times eight, and one mean step.
        let uneven: Vec<ViewErrors> = [0.01, 0.02, 0.01, 0.02].map(of).into();
        near(rms(&uneven, 64), 0.05_f64.sqrt());
        near(rms(&uneven, 4), 0.02_f64.sqrt());
        // Views that show nothing have no error.
        let mut blank = of(0.01);
        blank.covered_px = 0.0;
        near(rms(&[of(0.01), blank], 2), 0.1);
    }

    #[test]
    fn a_largest_error_has_no_margin_where_every_cell_was_looked_at() {
        let mut whole = [view(&[0.3, 0.3], &[0.1, 0.2])];
        whole[0].cells = 2;
        near(predicted(BoundMetric::Max, &whole, 1), 0.2);
        let two = predicted(BoundMetric::Max, &whole, 2);
        assert!(two > 0.4, "another picture was not looked at: {two}");
        whole[0].change_behind = Some(0.0);
        near(predicted(BoundMetric::Max, &whole, 1), 0.2);
        near(predicted(BoundMetric::Max, &whole, 2), 0.4);
    }
}
