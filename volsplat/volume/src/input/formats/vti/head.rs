//! The XML of an image: where it lies, which array is read, how that array is stored.
//!
//! Takes the XML text and the name of an array, if the caller chose one; gives an [`Image`]. Without a choice it is the
//! array that the file calls its active scalars, else the only one. VTK places the point (i, j, k), counted from where
//! Extent begins to count, at Origin + Direction * Spacing * (i, j, k).

use glam::{DAffine3, DMat3, DVec3};
use roxmltree::{Document, Node};

use crate::input::file::{Fault, excerpt, unsupported};
use crate::volume::{Endian, VoxelType};

/// An image and its chosen array.
pub(crate) struct Image {
    /// Number of values along x, y and z.
    pub(crate) dims: [usize; 3],
    pub(crate) world_from_index: DAffine3,
    /// Name of the array.
    pub(crate) array: String,
    /// Names of all arrays, in the order of the file.
    pub(crate) arrays: Vec<String>,
    pub(crate) voxel_type: VoxelType,
    /// At least 1.
    pub(crate) components: usize,
    pub(crate) endian: Endian,
    /// Bytes of a number in the header in front of binary data: 4 or 8.
    pub(crate) header_bytes: usize,
    pub(crate) packing: Packing,
    /// True if values stand at the centres of cells.
    pub(crate) is_of_cells: bool,
    pub(crate) source: Source,
}

/// How binary data is packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Packing {
    None,
    Zlib,
    Lz4,
}

/// Where the array's data is.
pub(crate) enum Source {
    Inline(Text),
    /// So many bytes (of base64: characters) behind the beginning of the appended data.
    Appended {
        offset: u64,
    },
}

/// Data in the XML.
pub(crate) enum Text {
    Ascii(String),
    Base64(String),
}

/// Where the values of an array stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Centring {
    Points,
    Cells,
}

/// First and last index along x, y and z.
type Extent = [i64; 6];

/// Longest tag that is parsed, bytes: a real one has some hundred. The parser compares each attribute with all others.
const MAX_TAG_BYTES: usize = 1 << 16;

/// Refuses tags of more attributes than any writer gives them.
fn check_tags(xml: &str) -> Result<(), String> {
    let mut tags = xml.split('<').skip(1);
    let is_long = |tag: &str| tag.find('>').unwrap_or(tag.len()) > MAX_TAG_BYTES;
    if tags.any(is_long) {
        return Err(format!(
            "the XML has a tag of more than {MAX_TAG_BYTES} bytes"
        ));
    }
    Ok(())
}

pub(crate) fn parse(xml: &str, array: Option<&str>) -> Result<Image, Fault> {
    check_tags(xml)?;
    let document = Document::parse(xml).map_err(|error| format!("the XML is broken: {error}"))?;
    let root = document.root_element();
    check_kind(root)?;
    let image = child(root, "ImageData")?;
    let piece = only_piece(image)?;
    let (centring, node) = chosen_array(piece, array)?;
    let (dims, world_from_index) = geometry((image, piece), centring)?;
    let source = source(node)?;
    Ok(Image {
        dims,
        world_from_index,
        array: name(node),
        arrays: arrays(piece).iter().map(|(_, node)| name(*node)).collect(),
        voxel_type: voxel_type(node)?,
        components: components(node)?,
        endian: match root.attribute("byte_order") {
            None | Some("LittleEndian") => Endian::Little,
            Some("BigEndian") => Endian::Big,
            Some(other) => return Err(unknown("byte_order", other, "LittleEndian or BigEndian")),
        },
        header_bytes: match root.attribute("header_type") {
            None | Some("UInt32") => 4,
            Some("UInt64") => 8,
            Some(other) => return Err(unknown("header_type", other, "UInt32 or UInt64")),
        },
        packing: packing(root, &source)?,
        is_of_cells: centring == Centring::Cells,
        source,
    })
}

/// Text is never packed, whatever the file says of its compressor.
fn packing(root: Node, source: &Source) -> Result<Packing, Fault> {
    match (source, root.attribute("compressor")) {
        (Source::Inline(Text::Ascii(_)), _) | (_, None | Some("")) => Ok(Packing::None),
        (_, Some("vtkZLibDataCompressor")) => Ok(Packing::Zlib),
        (_, Some("vtkLZ4DataCompressor")) => Ok(Packing::Lz4),
        (_, Some(other)) => {
            let what = excerpt(other);
            Err(unsupported(format!(
                "compressor '{what}': save the file with zlib, with LZ4 or without"
            )))
        }
    }
}

/// The files of the pieces that an index of several files names.
pub(crate) fn pieces(xml: &str) -> Result<Vec<String>, Fault> {
    check_tags(xml)?;
    let document = Document::parse(xml).map_err(|error| format!("the XML is broken: {error}"))?;
    let index = child(document.root_element(), "PImageData")?;
    let all = index.children().filter(|child| child.has_tag_name("Piece"));
    let named = |piece: Node| piece.attribute("Source").map(str::to_owned);
    let names: Option<Vec<String>> = all.map(named).collect();
    let names = names.filter(|names| !names.is_empty());
    Ok(names.ok_or_else(|| "its pieces name no files (Source)".to_owned())?)
}

fn unknown(attribute: &str, found: &str, expected: &str) -> Fault {
    Fault::Invalid(format!(
        "{attribute} is '{}': expected {expected}",
        excerpt(found)
    ))
}

fn check_kind(root: Node) -> Result<(), Fault> {
    match (root.tag_name().name(), root.attribute("type")) {
        ("VTKFile", Some("ImageData")) => Ok(()),
        ("VTKFile", kind) => Err(unsupported(format!(
            "VTK data of type '{}': only ImageData is a volume; resample the data to an image first",
            excerpt(kind.unwrap_or_default())
        ))),
        _ => Err(Fault::Invalid(
            "the XML does not begin with the element VTKFile".to_owned(),
        )),
    }
}

fn child<'a>(node: Node<'a, 'a>, name: &str) -> Result<Node<'a, 'a>, String> {
    let found = node.children().find(|child| child.has_tag_name(name));
    found.ok_or_else(|| format!("the element {} has no {name}", node.tag_name().name()))
}

fn only_piece<'a>(image: Node<'a, 'a>) -> Result<Node<'a, 'a>, Fault> {
    let piece = child(image, "Piece")?;
    let count = image
        .children()
        .filter(|child| child.has_tag_name("Piece"))
        .count();
    if count > 1 {
        return Err(unsupported(format!(
            "{count} pieces in one file: save the image as one piece"
        )));
    }
    // A piece of an image in several files is a part of the whole.
    let (whole, own) = (extent(image, "WholeExtent")?, extent(piece, "Extent")?);
    let is_inside = (0..3)
        .all(|axis| own[2 * axis] >= whole[2 * axis] && own[2 * axis + 1] <= whole[2 * axis + 1]);
    if !is_inside {
        return Err(Fault::Invalid(format!(
            "the Extent {own:?} of its piece reaches out of the WholeExtent {whole:?}"
        )));
    }
    Ok(piece)
}

fn extent(node: Node, name: &str) -> Result<Extent, String> {
    let text = node.attribute(name).unwrap_or_default();
    let numbers: Option<Vec<i64>> = text
        .split_ascii_whitespace()
        .map(|word| word.parse().ok())
        .collect();
    let fault = || {
        format!(
            "{name} is '{}': expected six whole numbers such as 0 9 0 9 0 9",
            excerpt(text)
        )
    };
    let extent: Extent = numbers
        .and_then(|numbers| numbers.try_into().ok())
        .ok_or_else(fault)?;
    // VTK holds these in 32 bits; the bound keeps differences from overflowing.
    let is_small = extent.iter().all(|index| i32::try_from(*index).is_ok());
    let is_ordered = extent.chunks(2).all(|axis| axis[0] <= axis[1]);
    if is_small && is_ordered {
        Ok(extent)
    } else {
        Err(fault())
    }
}

/// Sizes and place of the values. Cells are one less than points along an axis, and stand half a step further.
/// Sizes and place of a piece, which may be a part of the whole.
fn geometry(
    (image, piece): (Node, Node),
    centring: Centring,
) -> Result<([usize; 3], DAffine3), String> {
    let extent = extent(piece, "Extent")?;
    let origin = vector(image, "Origin")?.unwrap_or(DVec3::ZERO);
    let spacing = vector(image, "Spacing")?.unwrap_or(DVec3::ONE);
    let axes = direction(image)? * DMat3::from_diagonal(spacing);
    let mut dims = [1; 3];
    let mut first = DVec3::ZERO;
    for axis in 0..3 {
        let [begin, end] = [extent[2 * axis], extent[2 * axis + 1]];
        let steps = (end - begin) as usize;
        let is_between = centring == Centring::Cells && steps > 0;
        dims[axis] = if is_between { steps } else { steps + 1 };
        first[axis] = begin as f64 + if is_between { 0.5 } else { 0.0 };
    }
    Ok((
        dims,
        DAffine3::from_mat3_translation(axes, origin + axes * first),
    ))
}

fn vector(node: Node, name: &str) -> Result<Option<DVec3>, String> {
    match numbers(node, name)? {
        None => Ok(None),
        Some(values) => match values[..] {
            [x, y, z] => Ok(Some(DVec3::new(x, y, z))),
            _ => Err(format!(
                "{name} has {} numbers: expected three",
                values.len()
            )),
        },
    }
}

/// Row by row; the columns are the directions of the axes.
fn direction(image: Node) -> Result<DMat3, String> {
    let Some(values) = numbers(image, "Direction")? else {
        return Ok(DMat3::IDENTITY);
    };
    let count = values.len();
    let rows: [f64; 9] = values
        .try_into()
        .map_err(|_| format!("Direction has {count} numbers: expected nine"))?;
    Ok(DMat3::from_cols_array(&rows).transpose())
}

fn numbers(node: Node, name: &str) -> Result<Option<Vec<f64>>, String> {
    let Some(text) = node.attribute(name) else {
        return Ok(None);
    };
    let values: Option<Vec<f64>> = text
        .split_ascii_whitespace()
        .map(|word| word.parse().ok())
        .collect();
    values
        .map(Some)
        .ok_or_else(|| format!("{name} is '{}': expected numbers", excerpt(text)))
}

/// All arrays of the piece, those at points first, each with its centring.
fn arrays<'a>(piece: Node<'a, 'a>) -> Vec<(Centring, Node<'a, 'a>)> {
    let mut arrays = Vec::new();
    for (name, centring) in [
        ("PointData", Centring::Points),
        ("CellData", Centring::Cells),
    ] {
        let groups = piece.children().filter(|child| child.has_tag_name(name));
        let nodes = groups
            .flat_map(|group| group.children())
            .filter(|node| node.has_tag_name("DataArray"));
        arrays.extend(nodes.map(|node| (centring, node)));
    }
    arrays
}

fn name(node: Node) -> String {
    node.attribute("Name").unwrap_or_default().to_owned()
}

/// The names of all arrays, in the order of the file, and of the one that is read by default.
pub(crate) fn array_names(xml: &str) -> Result<(Vec<String>, Option<String>), Fault> {
    check_tags(xml)?;
    let document = Document::parse(xml).map_err(|error| format!("the XML is broken: {error}"))?;
    check_kind(document.root_element())?;
    let piece = only_piece(child(document.root_element(), "ImageData")?)?;
    let names = arrays(piece).iter().map(|(_, node)| name(*node)).collect();
    let read = chosen_array(piece, None).ok();
    Ok((names, read.map(|(_, node)| name(node))))
}

fn chosen_array<'a>(
    piece: Node<'a, 'a>,
    choice: Option<&str>,
) -> Result<(Centring, Node<'a, 'a>), Fault> {
    let arrays = arrays(piece);
    let named = |name: &str| {
        arrays
            .iter()
            .find(|(_, node)| node.attribute("Name") == Some(name))
            .copied()
    };
    let names: Vec<&str> = arrays
        .iter()
        .filter_map(|(_, node)| node.attribute("Name"))
        .collect();
    if let Some(name) = choice {
        let absent = || {
            Fault::Option(format!(
                "array={name}: no such array; there are: {}",
                names.join(", ")
            ))
        };
        return named(name).ok_or_else(absent);
    }
    let active = |(_, node): &(Centring, Node)| {
        let scalars = node.parent().and_then(|group| group.attribute("Scalars"));
        scalars.is_some() && scalars == node.attribute("Name")
    };
    match (arrays.iter().find(|array| active(array)), &arrays[..]) {
        (Some(array), _) | (None, [array]) => Ok(*array),
        (None, []) => Err(Fault::Invalid("the image has no array".to_owned())),
        (None, _) => {
            let names = names.join(", ");
            Err(Fault::Option(format!(
                "there are several arrays: choose one with array=NAME, of {names}"
            )))
        }
    }
}

fn voxel_type(node: Node) -> Result<VoxelType, Fault> {
    let name = node.attribute("type").unwrap_or_default();
    match name {
        "UInt8" | "Int8" | "UInt16" | "Int16" | "UInt32" | "Int32" | "UInt64" | "Int64"
        | "Float32" | "Float64" => Ok(name.parse().map_err(Fault::Invalid)?),
        _ => Err(unsupported(format!(
            "an array of type '{}': expected numbers, UInt8 to Float64",
            excerpt(name)
        ))),
    }
}

fn components(node: Node) -> Result<usize, String> {
    let text = node.attribute("NumberOfComponents").unwrap_or("1");
    let components = text.trim().parse().ok();
    // More components than this fit no real image, and products with it must not overflow.
    let components = components.filter(|count| (1..=1 << 16).contains(count));
    components.ok_or_else(|| {
        format!(
            "NumberOfComponents is '{}': expected 1 to 65536",
            excerpt(text)
        )
    })
}

fn source(node: Node) -> Result<Source, Fault> {
    let text = || node.text().unwrap_or_default().to_owned();
    match node.attribute("format") {
        Some("appended") => {
            let offset = node.attribute("offset").unwrap_or_default();
            let fault = || {
                format!(
                    "offset is '{}': expected a number of bytes",
                    excerpt(offset)
                )
            };
            Ok(Source::Appended {
                offset: offset.trim().parse().map_err(|_| fault())?,
            })
        }
        Some("binary") => Ok(Source::Inline(Text::Base64(text()))),
        None | Some("ascii") => Ok(Source::Inline(Text::Ascii(text()))),
        Some(other) => Err(unknown("format", other, "ascii, binary or appended")),
    }
}
