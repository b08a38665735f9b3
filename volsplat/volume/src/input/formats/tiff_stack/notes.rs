//! The descriptions that ImageJ and OME write into a stack of TIFF pictures: spacing, channels, points in time, and the order of the pages.
//!
//! Takes the text and the tags of the first page, returns [`Notes`]. Source: the OME data model 2016-06 (Pixels, Channel, TiffData); of
//! ImageJ, its file saver's lines `channels=`, `slices=`, `frames=` and its metadata tag, which holds look-up tables and windows.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use roxmltree::{Document, Node};

use crate::input::axes;
use crate::input::axes::{ImageAxes, ImageChannel};
use crate::input::file::{Fault, excerpt, unsupported};

/// The tags of the first page that speak of all pages.
#[derive(Default)]
pub(crate) struct FirstPage {
    /// ImageDescription.
    pub(crate) text: Option<String>,
    /// Pixels per unit of length along x and y.
    pub(crate) resolution: [Option<f64>; 2],
    /// The metadata of ImageJ, and the bytes of each of its entries, the table of contents first.
    pub(crate) image_j: Option<(Vec<u8>, Vec<u32>)>,
}

/// The place of a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    /// 0 is the file itself, others are the names in [`Notes::files`], from 1 on.
    pub(crate) file: usize,
    /// The page in that file.
    pub(crate) page: usize,
}

/// The file whose pages are described.
pub(crate) struct Own<'a> {
    pub(crate) path: &'a Path,
    /// Its UUID, where the description is that of another file.
    pub(crate) uuid: Option<String>,
}

/// The description of the pages of a file.
#[derive(Debug, PartialEq)]
pub(crate) struct Notes {
    /// World distance between voxels along x, y and z: 1 where nothing is known.
    pub(crate) spacing: [f64; 3],
    /// The unit of the spacing.
    pub(crate) unit: Option<String>,
    pub(crate) axes: ImageAxes,
    /// Slices of a channel at a time.
    pub(crate) depth: usize,
    /// The names of further files that hold pages, in the folder of the file.
    pub(crate) files: Vec<String>,
    /// The pages of the slices, z fastest, then the channels, then the times.
    pages: Vec<Place>,
}

/// Most planes of an image in several files, whose number no file's length bounds: 1000 times of 1000 slices. A guess.
const MAX_PLANES: usize = 1 << 20;

/// Most planes that all elements of an image place, which take a second: a forged text may place each plane with each element. A guess.
const MAX_PLACED: usize = 1 << 28;

/// The file that describes a file of OME whose own text only names it.
pub(crate) struct Master {
    /// Its name, in the same folder.
    pub(crate) file: String,
    /// The UUID of the file that names it.
    pub(crate) own_uuid: Option<String>,
}

/// The master file that the first page names, if it names one.
pub(crate) fn master(first: &FirstPage) -> Option<Master> {
    let text = first.text.as_deref()?;
    let is_binary = is_ome(text) && text.contains("BinaryOnly");
    let document = is_binary.then(|| Document::parse(text).ok()).flatten()?;
    let mut nodes = document.descendants();
    let node = nodes.find(|node| node.has_tag_name("BinaryOnly"))?;
    Some(Master {
        file: node.attribute("MetadataFile")?.to_owned(),
        own_uuid: document.root_element().attribute("UUID").map(str::to_owned),
    })
}

fn is_ome(text: &str) -> bool {
    text.trim_start().starts_with('<') && text.contains("<OME")
}

impl Notes {
    /// The notes of a stack of `pages`, whose pixels have `colours` numbers.
    pub(crate) fn of(
        first: &FirstPage,
        own: &Own,
        (pages, colours): (usize, usize),
    ) -> Result<Self, Fault> {
        let text = first.text.as_deref().unwrap_or_default();
        if text.starts_with("ImageJ=") {
            return image_j(first, text, pages, colours);
        }
        if is_ome(text) {
            return ome(text, own, pages, colours);
        }
        Ok(Self::plain([1.0; 3], pages))
    }

    /// One channel at one time.
    pub(crate) fn plain(spacing: [f64; 3], pages: usize) -> Self {
        Self {
            spacing,
            unit: None,
            axes: ImageAxes::default(),
            depth: pages,
            files: Vec::new(),
            pages: (0..pages).map(|page| Place { file: 0, page }).collect(),
        }
    }

    /// The same, if every page is a slice of one channel.
    pub(crate) fn sliced(self, pages: usize) -> Self {
        Self {
            unit: self.unit,
            ..Self::plain(self.spacing, pages)
        }
    }

    /// The pages of a channel at a time, both of which there are.
    pub(crate) fn slices(&self, channel: usize, time: usize) -> &[Place] {
        let first = (time * self.axes.channels.len() + channel) * self.depth;
        &self.pages[first..first + self.depth]
    }
}

/// Sizes of the axes of a stack beside x and y, and the step from page to page along each.
struct Order {
    /// z, channels, times.
    sizes: [usize; 3],
    /// The axes, the fastest first.
    fastest: [usize; 3],
}

impl Order {
    fn count(&self) -> Option<usize> {
        let [z, channels, times] = self.sizes;
        z.checked_mul(channels)?.checked_mul(times)
    }

    /// The number of a plane in the order of the file.
    fn number(&self, place: [usize; 3]) -> usize {
        let mut number = 0;
        for &axis in self.fastest.iter().rev() {
            number = number * self.sizes[axis] + place[axis];
        }
        number
    }

    /// The numbers of all planes, z fastest, then the channels, then the times.
    fn numbers(&self) -> impl Iterator<Item = usize> {
        let [depth, channels, times] = self.sizes;
        let places = (0..times).flat_map(move |time| {
            (0..channels).flat_map(move |channel| (0..depth).map(move |z| [z, channel, time]))
        });
        places.map(|place| self.number(place))
    }
}

/// How many images ImageJ says that the file holds, if it holds several.
pub(crate) fn images_of_image_j(first: &FirstPage) -> Option<usize> {
    let text = first
        .text
        .as_deref()
        .filter(|text| text.starts_with("ImageJ="))?;
    let count = text.lines().find_map(|line| line.strip_prefix("images="))?;
    count.trim().parse().ok().filter(|&images| images > 1)
}

fn image_j(first: &FirstPage, text: &str, pages: usize, colours: usize) -> Result<Notes, Fault> {
    let value = |key: &str| {
        let found = text
            .lines()
            .filter_map(|line| line.split_once('='))
            .find(|(name, _)| name.trim() == key);
        found.map(|(_, value)| value.trim())
    };
    let count = |key: &str| value(key).and_then(|text| text.parse::<usize>().ok());
    let images = count("images").unwrap_or(1);
    if images > pages {
        return Err(unsupported(format!(
            "ImageJ says {images} images, but the file lists {pages}, and the others do not lie unpacked behind them: \
             save it as BigTIFF, NRRD or as single slices"
        )));
    }
    let mut spacing = [1.0; 3];
    if value("unit").is_some_and(|unit| !unit.is_empty() && unit != "pixel") {
        for (length, per_unit) in spacing.iter_mut().zip(first.resolution) {
            *length = per_unit
                .map(|per_unit| 1.0 / per_unit)
                .filter(is_length)
                .unwrap_or(1.0);
        }
    }
    if let Some(text) = value("spacing") {
        let parsed = text.parse().map(f64::abs).ok().filter(is_length);
        spacing[2] = parsed
            .ok_or_else(|| format!("spacing={}: expected a length above 0", excerpt(text)))?;
    }
    // The colours of a pixel are no channels.
    let channels = match colours {
        1 => count("channels").unwrap_or(1).max(1),
        _ => 1,
    };
    let times = count("frames").unwrap_or(1).max(1);
    let of_all = channels.saturating_mul(times);
    if !pages.is_multiple_of(of_all) {
        return Err(Fault::Invalid(format!(
            "ImageJ says {channels} channel(s) and {times} time(s), but {pages} pages are no multiple of them"
        )));
    }
    let order = Order {
        sizes: [pages / of_all, channels, times],
        fastest: [1, 0, 2],
    };
    let mut known = vec![ImageChannel::default(); channels];
    if let Some((bytes, lengths)) = &first.image_j {
        tell(&mut known, bytes, lengths);
    }
    Ok(Notes {
        spacing,
        unit: value("unit").and_then(axes::unit),
        axes: ImageAxes {
            channels: known,
            times,
        }
        .without_equal_colours(),
        depth: order.sizes[0],
        files: Vec::new(),
        pages: order
            .numbers()
            .map(|page| Place { file: 0, page })
            .collect(),
    })
}

/// Tells channels what ImageJ's metadata knows: the brightest colour of a look-up table, and the window.
///
/// The table of contents has a mark and then, of each kind of entry, its name and number; the marks of a file whose bytes come with the
/// smallest first read backwards. Entries that do not fit are passed over, because pictures do without them.
fn tell(channels: &mut [ImageChannel], bytes: &[u8], lengths: &[u32]) {
    let Some((contents, mut rest)) = lengths
        .first()
        .and_then(|&length| bytes.split_at_checked(length as usize))
    else {
        return;
    };
    let is_little = contents.starts_with(b"JIJI");
    let word = |bytes: &[u8]| match (bytes.first_chunk(), is_little) {
        (Some(&word), true) => u32::from_le_bytes(word),
        (Some(&word), false) => u32::from_be_bytes(word),
        (None, _) => 0,
    };
    let mut lengths = lengths[1..].iter();
    for kind in contents.get(4..).unwrap_or_default().chunks_exact(8) {
        let (name, count) = (word(kind).to_be_bytes(), word(&kind[4..]) as usize);
        for (number, &length) in lengths.by_ref().take(count).enumerate() {
            let Some((entry, behind)) = rest.split_at_checked(length as usize) else {
                return;
            };
            rest = behind;
            match &name {
                // 256 of red, of green and of blue.
                b"luts" if entry.len() == 768 => {
                    if let Some(channel) = channels.get_mut(number) {
                        channel.rgb = Some([entry[255], entry[511], entry[767]]);
                    }
                }
                b"rang" => {
                    for (channel, ends) in channels.iter_mut().zip(entry.chunks_exact(16)) {
                        let end = |at: usize| match (ends[at..].first_chunk(), is_little) {
                            (Some(&number), true) => Some(f64::from_le_bytes(number)),
                            (Some(&number), false) => Some(f64::from_be_bytes(number)),
                            (None, _) => None,
                        };
                        channel.window = axes::window(end(0), end(8));
                    }
                }
                _ => {}
            }
        }
    }
}

fn ome(text: &str, own: &Own, pages: usize, colours: usize) -> Result<Notes, Fault> {
    let document = Document::parse(text)
        .map_err(|error| format!("the OME description is broken XML: {error}"))?;
    let Some(pixels) = document
        .descendants()
        .find(|node| node.has_tag_name("Pixels"))
    else {
        return Ok(Notes::plain([1.0; 3], pages));
    };
    let length = |name: &str| {
        let parsed = pixels.attribute(name).and_then(|text| text.parse().ok());
        parsed.filter(is_length).unwrap_or(1.0)
    };
    let spacing = ["PhysicalSizeX", "PhysicalSizeY", "PhysicalSizeZ"].map(length);
    let size = |name: &str| whole(pixels, name).unwrap_or(1).max(1);
    // The colours of a pixel count among the channels.
    let channels = (size("SizeC") / colours).max(1);
    let fastest = match pixels.attribute("DimensionOrder") {
        Some("XYCZT") => [1, 0, 2],
        Some("XYCTZ") => [1, 2, 0],
        Some("XYZTC") => [0, 2, 1],
        Some("XYTCZ") => [2, 1, 0],
        Some("XYTZC") => [2, 0, 1],
        _ => [0, 1, 2],
    };
    let mut order = Order {
        sizes: [size("SizeZ"), channels, size("SizeT")],
        fastest,
    };
    if order.sizes[1..] == [1, 1] {
        // Files that call all pages one axis, or tell nothing.
        order.sizes[0] = pages;
    }
    let [depth, channels, times] = order.sizes;
    let uuid = own.uuid.as_deref();
    let uuid = uuid.or(document.root_element().attribute("UUID"));
    let blocks = Blocks::of(pixels, own.path, uuid)?;
    let most = match blocks.files.is_empty() {
        true => pages,
        false => MAX_PLANES,
    };
    if order.count().is_none_or(|count| count > most) {
        return Err(unsupported(format!(
            "the OME description names {depth} slices of {channels} channel(s) at {times} time(s), but the file has \
             {pages} pages, and the description does not say where the others are: save them all as one file"
        )));
    }
    let known = pixels
        .children()
        .filter(|node| node.has_tag_name("Channel"))
        .map(channel)
        .chain(std::iter::repeat(ImageChannel::default()));
    let axes_beside = ImageAxes {
        channels: known.take(channels).collect(),
        times,
    };
    // Micrometres, where the unit is left out.
    let unit = pixels.attribute("PhysicalSizeXUnit").or(Some("µm"));
    Ok(Notes {
        spacing,
        unit: unit
            .filter(|_| pixels.attribute("PhysicalSizeX").is_some())
            .and_then(axes::unit),
        axes: axes_beside.without_equal_colours(),
        depth,
        pages: blocks.pages(&order, pages)?,
        files: blocks.files.into_iter().map(str::to_owned).collect(),
    })
}

/// The channel of an element.
fn channel(node: Node) -> ImageChannel {
    let named = node.attribute("Name").or(node.attribute("Fluor"));
    let name = named.map(str::trim).filter(|name| !name.is_empty());
    // A signed number of 32 bits: red, green, blue and alpha, a byte each.
    let rgba = node
        .attribute("Color")
        .and_then(|text| text.parse::<i32>().ok());
    ImageChannel {
        name: name.map(str::to_owned),
        rgb: rgba.map(|rgba| {
            let [red, green, blue, _] = rgba.to_be_bytes();
            [red, green, blue]
        }),
        ..ImageChannel::default()
    }
}

/// The elements that say which planes lie in which pages.
struct Blocks<'a> {
    /// Each with the number of its file.
    listed: Vec<(Node<'a, 'a>, usize)>,
    /// The names of further files.
    files: Vec<&'a str>,
}

impl<'a> Blocks<'a> {
    /// The elements of `pixels`, as the file at `path` with this UUID sees them.
    fn of(pixels: Node<'a, 'a>, path: &Path, uuid: Option<&str>) -> Result<Self, Fault> {
        let blocks = pixels
            .children()
            .filter(|node| node.has_tag_name("TiffData"));
        let marked = |block: Node<'a, 'a>| {
            let mark = block.children().find(|node| node.has_tag_name("UUID"));
            (block, mark)
        };
        let blocks: Vec<_> = blocks.map(marked).collect();
        let marks: BTreeSet<_> = blocks
            .iter()
            .filter_map(|(_, mark)| mark.as_ref()?.text())
            .collect();
        // One mark alone may be that of the file itself, which does not tell its own.
        let is_alone = marks.len() <= 1 && uuid.is_none();
        let mut files: Vec<&str> = Vec::new();
        let mut numbers: BTreeMap<&str, usize> = BTreeMap::new();
        let mut listed = Vec::new();
        for (block, mark) in blocks {
            let name = mark.and_then(|mark| mark.attribute("FileName"));
            let is_named = name.is_some_and(|name| path.file_name() == Some(name.as_ref()));
            let is_marked = mark.is_none_or(|mark| mark.text() == uuid);
            let file = match name {
                _ if is_alone || is_named || is_marked => 0,
                None if marks.len() == 1 => 0,
                None => {
                    return Err(unsupported(format!(
                        "its planes lie in {} files without names: save them all as one file",
                        marks.len()
                    )));
                }
                Some(name) => *numbers.entry(name).or_insert_with(|| {
                    files.push(name);
                    files.len()
                }),
            };
            listed.push((block, file));
        }
        Ok(Self { listed, files })
    }

    /// The pages of all planes, z fastest, then the channels, then the times.
    fn pages(&self, order: &Order, pages: usize) -> Result<Vec<Place>, Fault> {
        // Without elements, the pages follow the order of the dimensions.
        let mut placed = 0;
        let mut page_of: Vec<Option<Place>> = vec![None; order.count().unwrap_or(0)];
        for &(block, file) in &self.listed {
            let first = |name: &str| whole(block, name).unwrap_or(0);
            let place = [first("FirstZ"), first("FirstC"), first("FirstT")];
            if place.iter().zip(order.sizes).any(|(&at, size)| at >= size) {
                return Err(Fault::Invalid(format!(
                    "TiffData places pages from z {}, channel {} and time {} on, which the image does not have",
                    place[0], place[1], place[2]
                )));
            }
            let page = first("IFD");
            let planes = match (whole(block, "PlaneCount"), block.attribute("IFD")) {
                (Some(count), _) => count,
                (None, Some(_)) => 1,
                (None, None) => pages,
            };
            let targets = page_of.iter_mut().skip(order.number(place)).take(planes);
            placed += targets.len();
            if placed > MAX_PLACED {
                return Err(Fault::Invalid(
                    "TiffData places the same planes again and again".to_owned(),
                ));
            }
            for (number, target) in targets.enumerate() {
                let page = page.saturating_add(number);
                *target = Some(Place { file, page });
            }
        }
        if self.listed.is_empty() {
            let own = |page| Some(Place { file: 0, page });
            page_of = (0..page_of.len()).map(own).collect();
        }
        let page = |number: usize| match page_of.get(number) {
            Some(&Some(place)) if place.file > 0 || place.page < pages => Ok(place),
            _ => Err(Fault::Invalid(format!(
                "plane {number} of the OME description has no page in this file"
            ))),
        };
        order.numbers().map(page).collect()
    }
}

fn whole(node: Node, name: &str) -> Option<usize> {
    node.attribute(name)?.parse().ok()
}

fn is_length(length: &f64) -> bool {
    *length > 0.0 && length.is_finite()
}
