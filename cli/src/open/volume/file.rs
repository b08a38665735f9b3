//! How a volume file is read: the options that were typed, and the part of the file.
//!
//! A part is a list of `KEY=VALUE`: `scan.dcm#series=1.2.840`, `a.vti#array=pressure`, `a.zarr#level=2,component=1`.

use anyhow::{Context, Result, bail};
use resample_io::Gate;
use volsplat::LoadOptions;
use volsplat::input::RawOptions;
use volsplat::volume::NanPolicy;

use crate::args::VolumeArgs;
use crate::values::input_file::InputFile;

/// How a file is read.
pub(crate) fn load_options(
    args: &VolumeArgs,
    file: &InputFile,
    gate: &Gate,
) -> Result<LoadOptions> {
    // The command line accepts --dims and --type together or not at all.
    let raw = args
        .dims
        .zip(args.voxel_type)
        .map(|(dims, voxel_type)| RawOptions {
            endian: args.endian.unwrap_or_default(),
            skip_bytes: args.skip.unwrap_or(0),
            ..RawOptions::new(dims, voxel_type)
        });
    let whole = LoadOptions {
        raw,
        spacing: args.spacing,
        origin: args.origin,
        nan: args.nan_as.map_or(NanPolicy::Refuse, NanPolicy::Replace),
        rescale: args.rescale_values,
        gate: gate.clone(),
        ..LoadOptions::default()
    };
    with_part(whole, file)
}

/// The options with the part of a file in place of their own.
pub(crate) fn with_part(mut options: LoadOptions, file: &InputFile) -> Result<LoadOptions> {
    for pair in file.part.iter().flat_map(|part| part.split(',')) {
        let named = || format!("{}#{pair}", file.path.display());
        let Some((key, value)) = pair.split_once('=') else {
            bail!("{}: {EXPECTED}", named());
        };
        let number = || {
            let number = value.parse::<usize>().ok();
            number.with_context(|| format!("{}: expected a whole number from 0 on", named()))
        };
        match key {
            "series" => options.series = Some(value.to_owned()),
            "array" => options.array = Some(value.to_owned()),
            "component" => options.component = Some(number()?),
            "level" => options.level = Some(number()?),
            "time" => options.time = Some(number()?),
            _ => bail!("{}: {EXPECTED}", named()),
        }
    }
    Ok(options)
}

/// The keys of a part.
const EXPECTED: &str = "expected series=UID (DICOM), array=NAME (VTK), component=N, time=N (NIfTI, MGH, OME-Zarr) or level=N (OME-Zarr) behind the #";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_lists_of_keys_and_values() {
        let read = |part: &str| {
            let file = InputFile {
                path: "a.zarr".into(),
                part: Some(part.to_owned()),
            };
            load_options(&VolumeArgs::default(), &file, &Gate::default())
        };
        let options = read("level=2,component=1").expect("good");
        assert_eq!((options.level, options.component), (Some(2), Some(1)));
        let array = read("array=a b").expect("good").array;
        assert_eq!(array.as_deref(), Some("a b"));
        for (bad, said) in [
            ("level", "a.zarr#level: expected series=UID"),
            ("level=x", "a.zarr#level=x: expected a whole number"),
            ("size=1", "component=N"),
        ] {
            let error = read(bad).expect_err("not a part").to_string();
            assert!(error.contains(said), "{error}");
        }
    }
}
