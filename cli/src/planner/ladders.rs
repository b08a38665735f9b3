//! What the planner may choose between: for each application its ways of drawing, and the ladders of each way.
//!
//! A ladder is climbed from cheap to exact: its rungs lose less and cost more. Ways differ in kind and are each climbed. A
//! setting is nothing but words of the command line. What was typed is kept: its ladder is left out, and the exact
//! setting has it too.

use crate::args::{Command, VolsplatArgs};
use crate::order;
use crate::words;

/// An option and its values, from cheap to exact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ladder {
    pub(super) option: &'static str,
    pub(super) rungs: &'static [&'static str],
    /// What each rung usually costs, of the last one: the trade of the scenes in `docs/results`, rounded up. It only tells
    /// whether a try is worth its cost.
    pub(super) costs: &'static [f64],
}

/// A way of drawing: words that choose it, and what can be climbed in it, one or two ladders.
#[derive(Clone, Debug)]
pub(super) struct Way {
    pub(super) words: Vec<String>,
    pub(super) ladders: Vec<Ladder>,
    /// What it usually costs on its last rungs, of the exact setting, from the same figures.
    pub(super) cost: f64,
}

impl Way {
    /// What a setting usually costs, of the exact one.
    pub(super) fn cost(&self, rungs: [usize; 2]) -> f64 {
        self.ladders
            .iter()
            .zip(rungs)
            .fold(self.cost, |cost, (ladder, rung)| cost * ladder.costs[rung])
    }
}

/// What may be chosen for one command.
#[derive(Clone, Debug)]
pub(super) struct Family {
    pub(super) ways: Vec<Way>,
    /// The most exact setting.
    pub(super) exact: Vec<String>,
    /// The cheapest setting, for a coarse look.
    pub(super) coarse: Vec<String>,
    /// Where a coarse look must be cheap, it shows every so many pixels only: the cheapest setting of a mesh takes an eighth
    /// of the exact one's time.
    pub(super) coarse_step: u32,
    /// Most pictures of a sequence that are looked at coarsely, for the one with the most unrest. A coarse warp takes a tenth
    /// of an exact one: six of 64 pictures are a hundredth of the run.
    pub(super) coarse_looks: usize,
    /// Options whose value is a proven bound on what they change; each gets a share of the error that is allowed.
    pub(super) proven: Vec<&'static str>,
}

const SLAB: Ladder = Ladder {
    option: "--slab",
    rungs: &["2", "1", "0.5", "0.25", "0.125"],
    costs: &[0.09, 0.16, 0.28, 0.53, 1.0],
};
const SHEET_SUBPIXEL: Ladder = Ladder {
    option: "--subpixel",
    rungs: &["1", "2", "4", "8"],
    costs: &[0.11, 0.2, 0.43, 1.0],
};
const MESH_SUBPIXEL: Ladder = Ladder {
    option: "--subpixel",
    rungs: &["1", "2", "4", "8"],
    costs: &[0.1, 0.25, 0.5, 1.0],
};
const SUBPIXELS: Ladder = Ladder {
    option: "--subpixels",
    rungs: &["1", "2", "4", "8"],
    costs: &[0.7, 0.7, 0.75, 1.0],
};
const FOOTPRINT: Ladder = Ladder {
    option: "--footprint",
    rungs: &["affine-approx", "affine", "table", "exact"],
    costs: &[1.0, 1.0, 1.1, 1.0],
};

/// Pairs of name and value of the exact settings. A transmittance of 1e-5 is a four-hundredth of a step of an 8-bit
/// picture; 0 would take many times as long.
const EXACT_SHEETS: &[&str] = &[
    "--slab",
    "0.125",
    "--subpixel",
    "8",
    "--min-transmittance",
    LEAST_TRANSMITTANCE,
];
const EXACT_SAMPLES: &[&str] = &[
    "--footprint",
    "exact",
    "--min-transmittance",
    LEAST_TRANSMITTANCE,
];
const EXACT_MESH: &[&str] = &["--method", "hybrid", "--subpixel", "8"];
const EXACT_WARP: &[&str] = &["--method", "hybrid", "--subpixels", "8"];

/// The transmittance of the exact settings.
pub(super) const LEAST_TRANSMITTANCE: &str = "0.00001";

/// Look-ups and forward methods of meshes, each with its cost over that of the hybrid on the same rung.
const MESH_METHODS: [(&str, f64); 6] = [
    ("backward-nearest", 0.9),
    ("backward-bilinear", 0.9),
    ("backward-trilinear", 0.9),
    ("backward-ewa", 1.4),
    ("point", 2.2),
    ("hybrid", 1.0),
];

/// Methods of warping that have no sub-pixels, each with its cost over that of the exact setting; the hybrid has.
const PLAIN_WARPS: [(&str, f64); 3] = [("nearest", 0.1), ("points", 0.5), ("splats", 1.2)];

/// What may be chosen for a command, given the words that were typed.
pub(super) fn family(command: &Command, typed: &[String]) -> Family {
    let family = match command {
        Command::Texmap(_) => mesh(),
        Command::Warp3d(_) => warp(),
        Command::Volsplat(args) if draws_sheets(args) => Family {
            ways: vec![way(&[], &[SLAB, SHEET_SUBPIXEL], 1.0)],
            exact: owned(EXACT_SHEETS),
            coarse: owned(&["--slab", "2", "--subpixel", "1"]),
            coarse_step: 1,
            coarse_looks: 24,
            proven: vec!["--min-transmittance"],
        },
        _ => Family {
            ways: vec![way(&[], &[FOOTPRINT], 1.0)],
            exact: owned(EXACT_SAMPLES),
            coarse: owned(&["--footprint", "affine-approx"]),
            // It costs as much as the exact setting.
            coarse_step: 4,
            coarse_looks: 24,
            proven: vec!["--min-transmittance"],
        },
    };
    family.without(typed)
}

/// Whether a volume is drawn in image sheets.
fn draws_sheets(args: &VolsplatArgs) -> bool {
    // Contradicting options are refused when the volume is opened.
    matches!(
        order::order(&args.render),
        Ok(None | Some(order::Order::ImageSheets))
    )
}

fn mesh() -> Family {
    let of = |(method, cost): (&str, f64)| way(&["--method", method], &[MESH_SUBPIXEL], cost);
    Family {
        ways: MESH_METHODS.map(of).to_vec(),
        exact: owned(EXACT_MESH),
        coarse: owned(&["--method", "backward-nearest", "--subpixel", "1"]),
        coarse_step: 4,
        coarse_looks: 24,
        proven: Vec::new(),
    }
}

fn warp() -> Family {
    let plain = PLAIN_WARPS
        .iter()
        .map(|&(method, cost)| way(&["--method", method], &[], cost));
    let hybrid = way(&["--method", "hybrid"], &[SUBPIXELS], 1.0);
    Family {
        ways: plain.chain([hybrid]).collect(),
        exact: owned(EXACT_WARP),
        coarse: owned(&["--method", "nearest"]),
        coarse_step: 1,
        coarse_looks: 6,
        proven: Vec::new(),
    }
}

impl Family {
    /// Without the options that were typed.
    fn without(mut self, typed: &[String]) -> Self {
        let free = |words: &[String]| -> Vec<String> {
            let pairs = words.chunks(2).filter(|pair| !words::has(typed, &pair[0]));
            pairs.flatten().cloned().collect()
        };
        self.exact = free(&self.exact);
        self.coarse = free(&self.coarse);
        self.proven.retain(|option| !words::has(typed, option));
        let mut ways: Vec<Way> = Vec::new();
        for mut way in self.ways {
            way.words = free(&way.words);
            way.ladders
                .retain(|ladder| !words::has(typed, ladder.option));
            // A method that was typed makes all ways one; the last of them has all ladders.
            ways.retain(|other| other.words != way.words);
            ways.push(way);
        }
        self.ways = ways;
        self
    }
}

/// The name of the kind of work that a command does: pictures of one name take times of one model.
pub(super) fn path(command: &Command) -> String {
    match command {
        Command::Volsplat(args) => {
            let order = order::order(&args.render)
                .ok()
                .flatten()
                .unwrap_or(order::Order::ImageSheets);
            let subpixels = match args.render.sheets.subpixel {
                Some(volsplat::Subpixels::Fixed(n)) => n.to_string(),
                _ => "auto".into(),
            };
            format!("volsplat {} {subpixels}", crate::choices::ORDER.name(order))
        }
        Command::Texmap(args) => {
            format!(
                "texmap {} {}",
                crate::choices::name(args.render.method),
                args.render.subpixels
            )
        }
        Command::Warp3d(args) => {
            format!(
                "warp3d {} {}",
                crate::choices::name(args.warp.method),
                args.warp.subpixels.unwrap_or(4)
            )
        }
        _ => String::new(),
    }
}

fn way(words: &[&str], ladders: &[Ladder], cost: f64) -> Way {
    Way {
        words: owned(words),
        ladders: ladders.to_vec(),
        cost,
    }
}

pub(super) fn owned(words: &[&str]) -> Vec<String> {
    words.iter().map(|&word| word.to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Family {
        let words: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
        family(&words::parsed(&words).expect("good words").command, &words)
    }

    #[test]
    fn what_was_typed_is_no_choice() {
        let free = of("volsplat a.nrrd -o b.png");
        assert_eq!(
            (free.ways.len(), free.ways[0].ladders.len()),
            (1, 2),
            "slabs and sub-pixels"
        );
        let fixed = of("volsplat a.nrrd -o b.png --slab 1");
        assert_eq!(fixed.ways[0].ladders.len(), 1, "sub-pixels alone");
        assert!(
            !words::has(&fixed.exact, "--slab"),
            "the exact setting keeps what was typed"
        );
        assert_eq!(fixed.proven, ["--min-transmittance"]);
        let one = of("texmap a.glb -o b.png --method hybrid");
        assert_eq!(one.ways.len(), 1, "one method is one way");
        assert_eq!(of("texmap a.glb -o b.png").ways.len(), MESH_METHODS.len());
        let samples = of("volsplat a.nrrd -o b.png --order every-sample");
        assert_eq!(
            samples.ways[0].ladders[0].option, "--footprint",
            "each order has its own ladders"
        );
    }
}
