//! The format of a file, detected by its content and never by its name.
//!
//! Takes a path, reads its first bytes, and compares them with what each format must begin with. What is known but not
//! read here, such as glTF, is named too, so that the message can say more than "unknown".

use std::io::Read;
use std::path::{Path, PathBuf};

use crate::Error;
use crate::input::decode::stored;
use crate::input::formats::density::{cube, mrc};
use crate::input::formats::numpy::{npy, npz};
use crate::input::formats::plain::{amira, gipl};
use crate::input::formats::{
    dicom, hdf5, meta_image, mgh, nifti, nrrd, picture_slices, tiff_stack, vti, vtk, zarr,
};
use crate::input::{cannot_read, open, slices};

/// The formats that are detected by their content. A headerless file has no format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// NRRD, attached or detached.
    Nrrd,
    /// MetaImage, `.mha` or `.mhd`.
    MetaImage,
    /// NIfTI, one file or a pair.
    Nifti,
    /// An array of NumPy, `.npy`.
    Npy,
    /// VTK ImageData in XML, `.vti`.
    Vti,
    /// Grey TIFF pictures: a file of many pages, or a folder of slices.
    Tiff,
    /// DICOM pictures: a file, or a folder of slices.
    Dicom,
    /// A legacy file of VTK, `.vtk`.
    Vtk,
    /// FreeSurfer's volume, `.mgh` or packed `.mgz`.
    Mgh,
    /// A map of a microscope or a crystal, MRC or CCP4, `.mrc`, `.map`.
    Mrc,
    /// Slices in PNG or JPEG pictures: a folder.
    Pictures,
    /// OME-Zarr or a plain Zarr array: a folder.
    Zarr,
    /// Arrays in groups: HDF5 and NetCDF-4, Imaris, MINC 2, MATLAB 7.3.
    Hdf5,
    /// Classic NetCDF, MINC 1 among it.
    NetCdf,
    /// Several arrays of NumPy, `.npz`.
    Npz,
    /// A density or orbitals of quantum chemistry, Gaussian's `.cube`.
    Cube,
    /// A regular grid of Amira or Avizo, `.am`.
    Amira,
    /// GIPL, `.gipl`.
    Gipl,
}

impl Format {
    /// The usual name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nrrd => "NRRD",
            Self::MetaImage => "MetaImage",
            Self::Nifti => "NIfTI",
            Self::Npy => "NumPy array",
            Self::Vti => "VTK ImageData",
            Self::Tiff => "TIFF stack",
            Self::Dicom => "DICOM",
            Self::Vtk => "legacy VTK",
            Self::Mgh => "FreeSurfer MGH",
            Self::Mrc => "MRC map",
            Self::Pictures => "pictures",
            Self::Zarr => "OME-Zarr",
            Self::Hdf5 => "HDF5",
            Self::NetCdf => "NetCDF",
            Self::Npz => "NumPy archive",
            Self::Cube => "Gaussian cube",
            Self::Amira => "Amira grid",
            Self::Gipl => "GIPL",
        }
    }
}

/// The format of a content.
pub(crate) enum Detected {
    /// A format, and the files that hold it: one, or the slices in their order.
    Known(Format, Vec<PathBuf>),
    /// A format that is not read here: its name and what to do.
    NotRead(&'static str),
    Nothing,
}

/// Enough for every mark below: the latest one, of XML behind a comment, has no fixed place. A guess.
const HEAD_BYTES: u64 = 4096;

const MICROSCOPE: &str = "a microscope's own file (CZI, ND2, OIB or another): save it as OME-TIFF with Fiji, or as OME-Zarr with bioformats2raw";

const XDMF: &str = "an XDMF file, which describes arrays in other files: give the HDF5 file beside it, with #array=NAME";

/// Marks of formats that people may hand in and that are not read here, with what to do.
const NOT_READ: [(&[u8], &str); 14] = [
    (b"glTF", "a mesh (glTF): the command texmap draws it"),
    (b"ply\n", "a mesh (PLY): the command texmap draws it"),
    (
        b"PK\x03\x04",
        "a ZIP archive: unpack it and give one file of it",
    ),
    (
        b"\x89PNG\r\n\x1a\n",
        "one PNG picture: the slices of a volume are named by their folder, or by a pattern such as 'slices/*.png'",
    ),
    (
        b"\xff\xd8\xff",
        "one JPEG picture: the slices of a volume are named by their folder, or by a pattern such as 'slices/*.jpg'",
    ),
    (b"BZh", "a bzip2 file: unpack it first"),
    (
        b" BDV",
        "an OpenVDB file, a sparse grid: in Python, copyToArray of openvdb makes an array of it, which fr.volsplat draws",
    ),
    (
        b"MATLAB 5.0",
        "a file of MATLAB before 7.3: save it with save(NAME, '-v7.3')",
    ),
    (b"ZISRAWFILE", MICROSCOPE),
    (b"\xda\xce\xbe\x0a", MICROSCOPE),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", MICROSCOPE),
    (
        b"# AVS",
        "an AVS field: give the file of its numbers with --dims, --type and --skip",
    ),
    (b"<?xml version=\"1.0\" ?>\n<!DOCTYPE Xdmf", XDMF),
    (b"<Xdmf", XDMF),
];

const NO_SLICES: &str =
    "a folder without slices (DICOM, TIFF, PNG or JPEG files): name a file in it";
const GZIP: &str = "a gzip file that holds no volume that is read so: unpack it first";
const ANALYZE: &str =
    "an ANALYZE 7.5 header, which does not say which side is left: convert it to NIfTI";

/// The format of the file, the folder of slices or the pattern (`slices/img*.tif`) at `path`.
///
/// `None` where nothing marks one, as in a headerless file. Errors: [`Error::Read`], and [`Error::Invalid`] for a pattern
/// that no file fits.
pub fn format_of(path: &Path) -> Result<Option<Format>, Error> {
    let header = nifti::header_beside(path);
    Ok(match detect(header.as_deref().unwrap_or(path))? {
        Detected::Known(format, _) => Some(format),
        Detected::NotRead(_) | Detected::Nothing => None,
    })
}

/// The files of a volume that changes over time, in their order: those of a numbered pattern (`t%04d.npy`), of a list (`.txt`, a name a line),
/// or of a pattern with `*` or `?` whose files hold a volume each. `None` for one volume, slices among them.
///
/// # Errors
/// [`Error::Read`], and [`Error::Invalid`] for a pattern that no file fits.
pub fn step_files(path: &Path) -> Result<Option<Vec<PathBuf>>, Error> {
    if path.is_dir() {
        return Ok(None);
    }
    let word = path.to_string_lossy();
    let files =
        resample_io::listed::files_of(&word).map_err(|error| Error::Option(error.to_string()))?;
    // A text that names no file is no list.
    let is_list = path.extension().is_some_and(|ending| ending == "txt");
    let names_files = |files: &Vec<String>| files.iter().any(|file| Path::new(file).exists());
    if let Some(files) = files.filter(|files| !is_list || names_files(files)) {
        return Ok(Some(files.into_iter().map(PathBuf::from).collect()));
    }
    let Some(files) = slices::paths(path)? else {
        return Ok(None);
    };
    // Slices of one volume have a pattern, too.
    match detect(path)? {
        Detected::Known(..) => Ok(None),
        Detected::NotRead(_) | Detected::Nothing => Ok(Some(files)),
    }
}

pub(crate) fn detect(path: &Path) -> Result<Detected, Error> {
    if zarr::begins(path) {
        return Ok(Detected::Known(Format::Zarr, vec![path.to_owned()]));
    }
    let Some(paths) = slices::paths(path)? else {
        return detect_file(path);
    };
    let mut slices =
        [Format::Dicom, Format::Tiff, Format::Pictures].map(|format| (format, Vec::new()));
    for path in paths {
        let head = head_of(&path)?;
        let format = known(&head).or(picture_slices::begins(&head).then_some(Format::Pictures));
        // Folders also hold notes, previews and indices.
        if let Some((_, files)) = slices.iter_mut().find(|(of, _)| Some(*of) == format) {
            files.push(path);
        }
    }
    let found = slices.into_iter().find(|(_, files)| !files.is_empty());
    match found {
        Some((format, files)) => Ok(Detected::Known(format, files)),
        None if path.is_dir() => detect_below(path),
        None => Ok(Detected::NotRead(NO_SLICES)),
    }
}

/// Scans in the folders of a folder, as on a disc of a hospital.
fn detect_below(folder: &Path) -> Result<Detected, Error> {
    let mut files = Vec::new();
    for path in slices::below(folder)? {
        if known(&head_of(&path)?) == Some(Format::Dicom) {
            files.push(path);
        }
    }
    Ok(if files.is_empty() {
        Detected::NotRead(NO_SLICES)
    } else {
        Detected::Known(Format::Dicom, files)
    })
}

fn detect_file(path: &Path) -> Result<Detected, Error> {
    let head = head_of(path)?;
    let known = |format| Detected::Known(format, vec![path.to_owned()]);
    if let Some(format) = self::known(&head) {
        return Ok(known(format));
    }
    if dicom::is_index(&head) {
        let folder = path
            .parent()
            .filter(|folder| !folder.as_os_str().is_empty());
        return detect_below(folder.unwrap_or(Path::new(".")));
    }
    if head.starts_with(stored::GZIP_MAGIC) {
        let head = unpacked(&head);
        return Ok(if nifti::is_nifti(&head) {
            known(Format::Nifti)
        } else if mgh::begins(&head) {
            known(Format::Mgh)
        } else if mrc::begins(&head) {
            known(Format::Mrc)
        } else if gipl::begins(&head) {
            known(Format::Gipl)
        } else {
            Detected::NotRead(GZIP)
        });
    }
    if nifti::is_analyze(&head) {
        return Ok(Detected::NotRead(ANALYZE));
    }
    let not_read = NOT_READ.iter().find(|(mark, _)| head.starts_with(mark));
    Ok(not_read.map_or(Detected::Nothing, |(_, advice)| Detected::NotRead(advice)))
}

fn head_of(path: &Path) -> Result<Vec<u8>, Error> {
    let mut head = Vec::new();
    open(path)?
        .take(HEAD_BYTES)
        .read_to_end(&mut head)
        .map_err(|source| cannot_read(path, source))?;
    Ok(head)
}

/// The first bytes of an unpacked gzip file, as far as a header goes.
fn unpacked(head: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let stream = flate2::bufread::MultiGzDecoder::new(head).take(nifti::MAX_HEADER_BYTES);
    // The packed bytes are cut off, so an error at their end means nothing; what came before it counts.
    let _ = { stream }.read_to_end(&mut bytes);
    bytes
}

fn known(head: &[u8]) -> Option<Format> {
    match head {
        // The files that it lists are read instead.
        _ if dicom::is_index(head) => None,
        // Its first 128 bytes are free, and some files have the mark of TIFF there to be both.
        _ if dicom::begins(head) => Some(Format::Dicom),
        _ if head.starts_with(nrrd::MAGIC) => Some(Format::Nrrd),
        _ if nifti::is_nifti(head) => Some(Format::Nifti),
        _ if head.starts_with(npy::MAGIC) => Some(Format::Npy),
        _ if tiff_stack::begins(head) => Some(Format::Tiff),
        _ if vti::begins(head) => Some(Format::Vti),
        _ if head.starts_with(vtk::MAGIC) => Some(Format::Vtk),
        _ if meta_image::begins(head) => Some(Format::MetaImage),
        _ if mrc::begins(head) => Some(Format::Mrc),
        _ if mgh::begins(head) => Some(Format::Mgh),
        _ if hdf5::begins_classic(head) => Some(Format::NetCdf),
        _ if hdf5::begins(head) => Some(Format::Hdf5),
        _ if npz::begins(head) => Some(Format::Npz),
        _ if amira::begins(head) => Some(Format::Amira),
        _ if gipl::begins(head) => Some(Format::Gipl),
        _ if cube::begins(head) => Some(Format::Cube),
        _ => None,
    }
}
