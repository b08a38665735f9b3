//! How closely pictures are looked at: how many of them, and how much of each.
//!
//! Takes the cost of the pictures and of their parts under the exact setting, in exact pictures, and gives the closest look
//! that a run can afford: eight pictures in parts, or fewer, or a few as a whole where parts would cost as much. A run
//! that can afford none takes the exact setting at once.

use crate::opened::Parts;

/// A look at some of the pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Look {
    /// Pictures that are looked at.
    pub(super) views: usize,
    /// The part of each that is seen.
    pub(super) part: Part,
}

/// The part of a picture that is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// Windows of this side, px, in this many draws.
    Windows { side_px: u32, draws: usize },
    /// All of it.
    Whole,
}

/// The cost of a window.
#[derive(Clone, Copy, Debug)]
pub(super) struct WindowCost {
    /// Cells of a picture that show something.
    pub(super) cells: usize,
    /// The fixed cost of a window, of a whole picture.
    pub(super) fixed: f64,
}

/// The allowed cost of a look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Effort {
    /// A small share of the exact run.
    Affordable,
    /// As much as it takes.
    Any,
}

/// Share of the exact run that the look under the exact setting may take. The rest of the budget
/// ([`super::budget`]) is left for tries.
const MOST_SHARE: f64 = 0.05;

/// Pictures of a sequence that are looked at: one in four, but at most eight, and at least three where there are many.
pub(super) const MOST_VIEWS: usize = 8;
const LEAST_VIEWS: usize = 3;

/// Share of the covered cells that is looked at in each picture, and most windows as a multiple of the least number.
const CELL_SHARE: f64 = 0.06;
const MOST_WINDOWS: usize = 3;

/// Pictures with more pixels than this may have larger windows.
const LARGE_PX: f64 = 512.0 * 512.0;

/// Windows that cost more of a picture than this are not worth leaving the rest out. A guess.
const WHOLE_ABOVE: f64 = 0.7;

/// The most pictures of a sequence that are looked at.
pub(super) fn most_views(pictures: usize) -> usize {
    if pictures <= 1 {
        1
    } else {
        (pictures / 4).clamp(2, MOST_VIEWS)
    }
}

/// The fewest.
pub(super) fn least_views(pictures: usize) -> usize {
    most_views(pictures).min(LEAST_VIEWS)
}

/// Whether a look might be affordable, as far as sizes tell: the pictures have `pixels` each.
pub(super) fn may_pay(parts: Parts, (pictures, pixels): (usize, f64)) -> bool {
    let affordable = MOST_SHARE * pictures as f64 / least_views(pictures) as f64;
    let windows = match parts {
        Parts::Windows { side_px, least, .. } => {
            least as f64 * f64::from(side_px).powi(2) <= affordable * pixels
        }
        Parts::Whole => false,
    };
    windows || (pictures > 1 && affordable >= 1.0)
}

/// The closest look that `effort` allows; `None` where there is none. Windows have one of `sides`, px, the first that can be
/// afforded.
pub(super) fn closest(
    (parts, sides): (Parts, &[u32]),
    (pictures, effort): (usize, Effort),
    window: impl Fn(u32) -> WindowCost,
) -> Option<Look> {
    let most = most_views(pictures);
    let mut numbers = vec![
        most,
        (most / 2).max(least_views(pictures)),
        least_views(pictures),
    ];
    numbers.dedup();
    numbers.into_iter().find_map(|views| {
        let affordable = match effort {
            Effort::Affordable => MOST_SHARE * pictures as f64 / views as f64,
            Effort::Any => f64::INFINITY,
        };
        let part = match parts {
            Parts::Windows { least, .. } => sides
                .iter()
                .find_map(|&side| windows((side, least), affordable, window(side))),
            Parts::Whole => None,
        };
        // The only picture as a whole would cost what it saves.
        let whole = (affordable >= 1.0).then_some(Part::Whole);
        part.or(whole).map(|part| Look { views, part })
    })
}

/// The sides of windows that may be taken, px: large pictures may have larger ones, whose counts spread less.
pub(super) fn sides(parts: Parts, pixels: f64) -> Vec<u32> {
    match parts {
        Parts::Windows { side_px, .. } if pixels > LARGE_PX => vec![2 * side_px, side_px],
        Parts::Windows { side_px, .. } => vec![side_px],
        Parts::Whole => Vec::new(),
    }
}

fn windows((side_px, least): (u32, usize), affordable: f64, cost: WindowCost) -> Option<Part> {
    let each = 1.0 / cost.cells.max(1) as f64 + cost.fixed;
    let wanted = ((CELL_SHARE * cost.cells as f64) as usize).clamp(least, MOST_WINDOWS * least);
    let draws = wanted.min((affordable / each) as usize);
    (draws >= least && draws as f64 * each <= WHOLE_ABOVE)
        .then_some(Part::Windows { side_px, draws })
}

/// Numbers below `len`, evenly spaced.
pub(super) fn places(len: usize, count: usize) -> Vec<usize> {
    (0..count)
        .map(|k| (2 * k + 1) * len / (2 * count))
        .collect()
}

/// Puts a place into a list, instead of the nearest one.
pub(super) fn include(list: &mut [usize], place: usize) {
    if let Some(nearest) = list.iter_mut().min_by_key(|other| other.abs_diff(place)) {
        *nearest = place;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PARTS: Parts = Parts::Windows {
        side_px: 32,
        least: 6,
        guard_px: 0,
    };

    fn look(pictures: usize, cells: usize, fixed: f64) -> Option<Look> {
        closest((PARTS, &[32]), (pictures, Effort::Affordable), |_| {
            WindowCost { cells, fixed }
        })
    }

    #[test]
    fn large_pictures_are_seen_in_windows_and_small_ones_as_a_whole() {
        let windows = |draws| Part::Windows { side_px: 32, draws };
        assert_eq!(
            look(64, 500, 0.001),
            Some(Look {
                views: 8,
                part: windows(18)
            }),
            "as many as are wanted"
        );
        assert_eq!(
            look(1, 160, 0.001),
            Some(Look {
                views: 1,
                part: windows(6)
            }),
            "a share of one picture"
        );
        assert_eq!(
            look(64, 9, 0.05),
            Some(Look {
                views: 3,
                part: Part::Whole
            }),
            "six of nine cells cost more"
        );
        assert_eq!(
            look(400, 9, 0.05),
            Some(Look {
                views: 8,
                part: Part::Whole
            }),
            "a long run"
        );
    }

    #[test]
    fn large_windows_are_taken_where_they_can_be_afforded() {
        let side = |cells: [usize; 2]| {
            let window = |side| WindowCost {
                cells: cells[usize::from(side == 32)],
                fixed: 0.0,
            };
            closest((PARTS, &sides(PARTS, 1e6)), (1, Effort::Affordable), window)
                .map(|look| look.part)
        };
        assert_eq!(
            side([300, 1200]),
            Some(Part::Windows {
                side_px: 64,
                draws: 15
            })
        );
        assert_eq!(
            side([100, 400]),
            Some(Part::Windows {
                side_px: 32,
                draws: 18
            }),
            "six large ones cost more"
        );
    }

    #[test]
    fn what_costs_too_much_is_left() {
        assert_eq!(look(1, 40, 0.001), None, "six of forty cells");
        assert_eq!(look(8, 20, 0.02), None, "and no picture as a whole");
        assert!(!may_pay(PARTS, (1, 256.0 * 256.0)) && may_pay(PARTS, (1, 512.0 * 512.0)));
        assert!(!may_pay(Parts::Whole, (1, 1e9)) && may_pay(Parts::Whole, (64, 1e4)));
        let any = closest((PARTS, &[32]), (1, Effort::Any), |_| WindowCost {
            cells: 40,
            fixed: 0.0,
        });
        assert_eq!(
            any,
            Some(Look {
                views: 1,
                part: Part::Windows {
                    side_px: 32,
                    draws: 6
                }
            })
        );
    }

    #[test]
    fn the_nearest_place_gives_way() {
        let mut list = places(8, 3);
        assert_eq!(list, [1, 4, 6]);
        include(&mut list, 5);
        assert_eq!(list, [1, 5, 6]);
    }
}
