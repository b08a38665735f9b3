//! Readers as functions of bytes: for fuzzing, and for the tests that replay small files.
//!
//! Each function writes the bytes to a file of its own folder, reads that, and forgets the result: a file is good or is
//! refused, and nothing else may happen. `seeds` makes the files from which fuzzing begins.

mod folder;
pub mod seeds;

use resample_core::Error;
use resample_io::receiver::{Receiver, Room};
use resample_io::{Gate, Outside, Part, colour, depth};

use folder::{Folder, with_folder};

/// Memory that data of a file may take, bytes: small, so that many files a second are read.
const BUDGET: u64 = 32 << 20;

/// A reader that is fuzzed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reader {
    /// A volume of any format that is one file.
    Volume,
    /// A Zarr image: a folder of files, packed as `seeds::packed` does it.
    Zarr,
    /// Gaussians of any format; a folder of files is packed as `seeds::packed` does it.
    Gaussians,
    /// A mesh of any format.
    Mesh,
    /// A picture's colours.
    Colour,
    /// A picture's depth.
    Depth,
    /// Cameras of any program, and lenses.
    Cameras,
    /// A transfer function or a table of labels.
    Transfer,
}

impl Reader {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Volume,
        Self::Zarr,
        Self::Gaussians,
        Self::Mesh,
        Self::Colour,
        Self::Depth,
        Self::Cameras,
        Self::Transfer,
    ];

    /// The reader's name, as those of its target and of its folder of found files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Volume => "volume",
            Self::Zarr => "zarr",
            Self::Gaussians => "gaussians",
            Self::Mesh => "mesh",
            Self::Colour => "colour",
            Self::Depth => "depth",
            Self::Cameras => "cameras",
            Self::Transfer => "transfer",
        }
    }

    /// Reads the bytes as a file; the error says why it is refused.
    pub fn read(self, bytes: &[u8]) -> Result<(), String> {
        with_folder(|folder| match self {
            Self::Volume => volume(folder, bytes),
            Self::Zarr => zarr(folder, bytes),
            Self::Gaussians => gaussians(folder, bytes),
            Self::Mesh => mesh(folder, bytes),
            Self::Colour => colours(folder, bytes),
            Self::Depth => depths(folder, bytes),
            Self::Cameras => cameras(folder, bytes),
            Self::Transfer => transfer(folder, bytes),
        })
    }
}

fn gate() -> Gate {
    Gate::new(Outside::Refused, Some(BUDGET))
}

fn volume(folder: &Folder, bytes: &[u8]) -> Result<(), String> {
    let path = folder.write("volume", bytes);
    let options = volsplat::LoadOptions {
        gate: gate(),
        ..Default::default()
    };
    let _ = volsplat::input::peek(&path, &options);
    let volume = volsplat::load(&path, &options)
        .or_else(|_| volsplat::load(&path, &first_component(options)))
        .map_err(said)?;
    let voxels: usize = volume.dims.iter().product();
    assert!(voxels > 0, "a volume has voxels");
    let (low, high) = volume.value_range();
    assert!(low <= high && low.is_finite() && high.is_finite());
    Ok(())
}

/// An error's message: making it must not fail either.
fn said(error: impl std::fmt::Display) -> String {
    error.to_string()
}

fn zarr(folder: &Folder, bytes: &[u8]) -> Result<(), String> {
    let path = folder.unpack("image.zarr", bytes);
    let options = volsplat::LoadOptions {
        gate: gate(),
        ..Default::default()
    };
    let volume = volsplat::load(&path, &options)
        .or_else(|_| volsplat::load(&path, &first_component(options)));
    volume.map(drop).map_err(said)
}

/// The first of several components or channels.
fn first_component(options: volsplat::LoadOptions) -> volsplat::LoadOptions {
    volsplat::LoadOptions {
        component: Some(0),
        ..options
    }
}

fn gaussians(folder: &Folder, bytes: &[u8]) -> Result<(), String> {
    use resample_volume::gaussians::{self, GaussianLoadOptions};
    let path = match bytes.starts_with(folder::MARK) {
        true => folder.unpack("scene", bytes),
        false => folder.write("gaussians", bytes),
    };
    let options = GaussianLoadOptions { gate: gate() };
    let (all, _) = gaussians::load(&path, &options).map_err(said)?;
    assert!(!all.is_empty(), "a file has Gaussians");
    for index in 0..all.len() {
        let one = all.get(index);
        let is_sound = one.centre.is_finite() && one.rotation.is_finite();
        assert!(is_sound && one.scales.is_finite() && one.scales.min_element() >= 0.0);
        assert!((0.0..=1.0).contains(&one.opacity), "{}", one.opacity);
        assert!(all.colour_towards(index, glam::Vec3::X).min_element() >= 0.0);
    }
    Ok(())
}

fn mesh(folder: &Folder, bytes: &[u8]) -> Result<(), String> {
    // A material file and a picture lie beside it, with the same bytes.
    folder.write("m.mtl", bytes);
    folder.write("m.png", bytes);
    let path = folder.write("model", bytes);
    let options = texmap::LoadOptions {
        gate: gate(),
        ..Default::default()
    };
    let _ = texmap::load(&path, &options);
    // Of the bytes of a mesh no picture can be made.
    let options = texmap::LoadOptions {
        unreadable: texmap::input::Unreadable::Noted,
        ..options
    };
    let loaded = texmap::load(&path, &options).map_err(said)?;
    // In the midst of its animation, where it has one.
    let posed = texmap::LoadOptions {
        pose: Some(texmap::Pose {
            time_s: 0.5,
            animation: None,
        }),
        ..options
    };
    let _ = texmap::load(&path, &posed);
    let triangles = loaded.scene.meshes.iter().map(|mesh| mesh.triangles.len());
    assert!(triangles.sum::<usize>() > 0, "a scene has triangles");
    Ok(())
}

/// Forgets the numbers.
struct Sink;

impl Receiver for Sink {
    fn begin(&mut self, size: [usize; 2]) -> Result<(), Error> {
        // Larger pictures are read in the same way, only longer.
        if size[0].saturating_mul(size[1]) > 1 << 20 {
            return Err(Error::Input("large enough".to_owned()));
        }
        Ok(())
    }

    fn put(&mut self, _: [usize; 2], values: &[f32]) -> Result<(), Error> {
        assert!(!values.is_empty(), "a piece holds numbers");
        Ok(())
    }
}

fn colours(folder: &Folder, bytes: &[u8]) -> Result<(), String> {
    let part = part(folder, bytes);
    let layer = Part {
        name: Some("layer".to_owned()),
        ..part.clone()
    };
    let _ = colour::size(&part);
    colour::decode(&part, Room(BUDGET), &mut Sink)
        .or_else(|_| colour::decode(&layer, Room(BUDGET), &mut Sink))
        .map(drop)
        .map_err(said)
}

fn depths(folder: &Folder, bytes: &[u8]) -> Result<(), String> {
    let part = part(folder, bytes);
    depth::decode(&part, Room(BUDGET), &mut Sink)
        .map(drop)
        .map_err(said)
}

fn part(folder: &Folder, bytes: &[u8]) -> Part {
    Part {
        path: folder.write("picture", bytes),
        name: None,
    }
}

fn cameras(folder: &Folder, bytes: &[u8]) -> Result<(), String> {
    use resample_core::camera::PixelCentre;
    use warp3d::input::cameras::{Hints, Lens, read, read_lens};
    let mut good = None;
    // The name tells a model of COLMAP, the content all others.
    for name in ["cameras.bin", "images.txt", "poses.txt"] {
        let path = folder.write(name, bytes);
        let hints = Hints {
            size: Some([64, 48]),
            lens: Some(Lens {
                fx: 50.0,
                fy: 50.0,
                cx: 32.0,
                cy: 24.0,
                pixel_centre: PixelCentre::Half,
            }),
        };
        match read(&path, &hints).map_err(said) {
            Ok(Some(set)) => {
                assert!(!set.entries.is_empty(), "a set has cameras");
                good = Some(Ok(()));
            }
            Ok(None) => {}
            Err(why) => good = good.or(Some(Err(why))),
        }
        folder.remove(name);
    }
    let lens = read_lens(&folder.write("lens.json", bytes));
    lens.map(drop)
        .map_err(said)
        .or(good.unwrap_or_else(|| Err("no cameras".to_owned())))
}

fn transfer(folder: &Folder, bytes: &[u8]) -> Result<(), String> {
    use volsplat::transfer::ColourEncoding;
    let path = folder.write("table", bytes);
    let volume = volsplat::Volume::new(
        [2, 2, 2],
        volsplat::volume::Voxels::U8((0..8).collect()),
        glam::DAffine3::IDENTITY,
    )
    .expect("a volume of eight voxels");
    let table = volsplat::LabelTable::load(&path).map(drop).map_err(said);
    for encoding in [ColourEncoding::Linear, ColourEncoding::Srgb] {
        match volsplat::transfer::FileLook::load(&path, encoding, &volume).map_err(said) {
            Ok(look) => {
                let opacity = look.function.opacity(3.0);
                assert!((0.0..=1.0).contains(&opacity), "opacity {opacity}");
            }
            Err(why) => return table.map_err(|other| format!("{why}; {other}")),
        }
    }
    Ok(())
}
