//! The description as bytes: sections, each with its number and its length, so that later versions can add
//! some.
//!
//! A reader passes over a section that it does not know if the section's number says that it may.

mod nodata;
mod volume;

use vastex_core::{Description, GeometryBytesError, GeometryParts, Layer, LayerFormat, TexelPositions};

use super::layout::{Fields, MAX_PAGES};
use crate::tile::MAX_TILE_BYTES;

pub use nodata::{filter_without, nodata_of_filter};
pub use volume::ContainerVolume;

/// The section that holds levels, pages and borders.
const GEOMETRY: u32 = 1;
/// The section that holds the layers.
const LAYERS: u32 = 2;
/// The section that holds what the first two have no room for. Left out if all of it is as usual.
const MORE: u32 = 3;
/// The section that says that there is a texture for each channel and time of a volume.
const VOLUME: u32 = 4;
/// Set in the number of a section that a reader may pass over.
const OPTIONAL: u32 = 1 << 31;
/// The section with the filter of each layer. A program that only reads can do without it.
const FILTERS: u32 = OPTIONAL | 3;
/// The section with the alignment of tiles. Left out if tiles are not aligned.
const ALIGN: u32 = OPTIONAL | 4;
/// The section that says of each layer if its values may be mixed. Left out if the filters say the same.
const MIXING: u32 = OPTIONAL | 5;
/// The section that says of each layer which value stands for no data. Left out if the filters say the same.
const NODATA: u32 = OPTIONAL | 6;
/// The section with what else is known of the texels, in words. Left out if nothing is.
const ABOUT: u32 = OPTIONAL | 7;
/// The most bytes that it may have.
const MAX_ABOUT_BYTES: usize = 64 << 10;
/// The filters of layers whose values may not be mixed.
const PICKING_FILTERS: [&str; 2] = ["majority", "nearest"];
/// The most layers that a texture may have.
const MAX_LAYERS: u32 = 256;
/// The multiples at which tiles may begin, besides 1.
const ALIGN_BYTES: std::ops::RangeInclusive<u32> = 4 << 10..=64 << 10;
/// The most bytes that the name of a layer or of a filter may have.
const MAX_NAME_BYTES: u32 = 256;

/// Why a description cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum DescriptionFault {
    /// The bytes are none that this version writes.
    #[error("{0}")]
    Damaged(String),
    /// The description needs a newer reader.
    #[error("{0}")]
    Unsupported(String),
}

impl From<String> for DescriptionFault {
    fn from(fault: String) -> DescriptionFault {
        DescriptionFault::Damaged(fault)
    }
}

impl From<GeometryBytesError> for DescriptionFault {
    fn from(error: GeometryBytesError) -> DescriptionFault {
        match error.is_unknown() {
            true => DescriptionFault::Unsupported(error.to_string()),
            false => DescriptionFault::Damaged(error.to_string()),
        }
    }
}

/// What a file says about itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Contents {
    pub(crate) description: Description,
    /// The name of each layer's filter; empty if the file names none.
    pub(crate) filters: Vec<String>,
    /// Every tile in the file begins at a multiple of so many bytes; 1 if the file states no alignment.
    pub(crate) align: u32,
    /// Which volume the textures are of, if they are of one.
    pub(crate) volume: Option<ContainerVolume>,
    /// What else is known of the texels; empty if nothing is.
    pub(crate) about: String,
}

/// A description as bytes that are the same in every run.
#[cfg(not(target_family = "wasm"))]
pub(crate) fn bytes(description: &Description) -> Vec<u8> {
    encode(description, &[], 1, None, "")
}

/// A description as bytes; `filters` has one name for each layer, or none at all.
pub(crate) fn encode(
    description: &Description,
    filters: &[String],
    align: u32,
    volume: Option<&ContainerVolume>,
    about: &str,
) -> Vec<u8> {
    let mut sections =
        vec![(GEOMETRY, description.geometry.shape_bytes()), (LAYERS, layer_bytes(&description.layers))];
    if has_more(description) {
        sections.push((MORE, more_bytes(description)));
    }
    sections.extend(volume.map(|volume| (VOLUME, volume.encode())));
    if !filters.is_empty() {
        sections.push((FILTERS, filter_bytes(filters)));
    }
    if align != 1 {
        sections.push((ALIGN, align.to_le_bytes().into()));
    }
    let mixable: Vec<bool> = description.layers.iter().map(|layer| layer.is_mixable).collect();
    if mixable != mixable_by(filters, mixable.len()) {
        sections.push((MIXING, mixable.into_iter().map(u8::from).collect()));
    }
    sections.extend(nodata::section(description, filters).map(|section| (NODATA, section)));
    if !about.is_empty() {
        sections.push((ABOUT, about.into()));
    }
    let mut bytes = Vec::new();
    for (number, section) in sections {
        bytes.extend(number.to_le_bytes());
        bytes.extend((section.len() as u32).to_le_bytes());
        bytes.extend(section);
    }
    bytes
}

/// For each layer, true if its values may be mixed, as far as filters say.
fn mixable_by(filters: &[String], layers: usize) -> Vec<bool> {
    let is_picking = |name: &str| PICKING_FILTERS.contains(&nodata_of_filter(name).0);
    let picks = |layer: usize| filters.get(layer).is_some_and(|name| is_picking(name));
    (0..layers).map(|layer| !picks(layer)).collect()
}

fn filter_bytes(filters: &[String]) -> Vec<u8> {
    let name_bytes = |name: &String| [&(name.len() as u32).to_le_bytes(), name.as_bytes()].concat();
    filters.iter().flat_map(name_bytes).collect()
}

/// Returns true if texels keep their positions, the tail is aligned unusually, there is a border colour, or a
/// layer has a fraction of the resolution.
fn has_more(description: &Description) -> bool {
    let spec = description.geometry.spec();
    spec.positions != TexelPositions::Centered
        || spec.tail_align != 4
        || description.border_color != [0; 4]
        || description.layers.iter().any(|layer| layer.scale != 1)
}

fn more_bytes(description: &Description) -> Vec<u8> {
    let mut bytes = description.geometry.placement_bytes().to_vec();
    bytes.extend([0; 2]);
    bytes.extend(description.border_color);
    bytes.extend(description.layers.iter().map(|layer| layer.scale as u8));
    bytes
}

fn layer_bytes(layers: &[Layer]) -> Vec<u8> {
    let mut bytes = Vec::from((layers.len() as u32).to_le_bytes());
    for layer in layers {
        bytes.extend(format_number(layer.format).to_le_bytes());
        bytes.extend((layer.name.len() as u32).to_le_bytes());
        bytes.extend(layer.name.as_bytes());
    }
    bytes
}

/// The number of a format in a file.
fn format_number(format: LayerFormat) -> u32 {
    match format {
        LayerFormat::R8 => 1,
        LayerFormat::Rg8 => 2,
        LayerFormat::Rgba8 => 3,
        LayerFormat::Rgba8Srgb => 4,
        LayerFormat::R16 => 5,
        LayerFormat::Rgba16 => 6,
        LayerFormat::R16Float => 7,
        LayerFormat::Rgba16Float => 8,
        LayerFormat::R32Float => 9,
        LayerFormat::Bc1 => 10,
        LayerFormat::Bc1Srgb => 11,
        LayerFormat::Bc3 => 12,
        LayerFormat::Bc3Srgb => 13,
        LayerFormat::Bc4 => 14,
        LayerFormat::Bc5 => 15,
        LayerFormat::Bc6h => 16,
        LayerFormat::Bc7 => 17,
        LayerFormat::Bc7Srgb => 18,
        LayerFormat::R32Uint => 19,
        LayerFormat::Rg32Uint => 20,
    }
}

/// Reads a description and checks that this crate can handle the texture.
pub(crate) fn decode(bytes: &[u8]) -> Result<Contents, DescriptionFault> {
    let (mut geometry, mut layers, mut more, mut last) = (None, None, None, None);
    let (mut filters, mut align, mut mixing, mut nodata) = (Vec::new(), 1, None, None);
    let (mut volume, mut about) = (None, String::new());
    let mut fields = Fields::new(bytes);
    while !fields.is_empty() {
        let (number, len) = (fields.u32()?, fields.u32()?);
        let section = fields.bytes(len as usize)?;
        if last.is_some_and(|last| number <= last) {
            return Err(format!("section {number} stands after section {}", last.unwrap_or(0)).into());
        }
        last = Some(number);
        match number {
            GEOMETRY => geometry = Some(GeometryParts::from_shape(section)?),
            LAYERS => layers = Some(decode_layers(section)?),
            MORE => more = Some(decode_more(section)?),
            VOLUME => volume = Some(ContainerVolume::decode(section)?),
            FILTERS => filters = decode_filters(section)?,
            ALIGN => align = decode_align(section)?,
            MIXING => mixing = Some(decode_mixing(section)?),
            NODATA => nodata = Some(nodata::decode(section)?),
            ABOUT => about = decode_about(section)?,
            _ if number & OPTIONAL != 0 => {}
            _ => {
                return Err(DescriptionFault::Unsupported(format!(
                    "section {number} of the description is not known"
                )));
            }
        }
    }
    match (geometry, layers) {
        (Some(geometry), Some(layers)) => {
            let mut description = describe(geometry, layers, more)?;
            check_filters(&description, &filters)?;
            let mixable = mixing.unwrap_or_else(|| mixable_by(&filters, description.layers.len()));
            let (said, layers) = (mixable.len(), description.layers.len());
            if said != layers {
                return Err(format!("of {said} layers it says whether they may be mixed, of {layers}").into());
            }
            description.layers.iter_mut().zip(mixable).for_each(|(layer, is)| layer.is_mixable = is);
            // Some formats are never mixed, so that this must be known.
            check(&description)?;
            volume.as_ref().map_or(Ok(()), |volume| volume.check(&description))?;
            let nodata = nodata.unwrap_or_else(|| nodata::by_filters(&filters, layers));
            if nodata.len() != layers {
                let said = nodata.len();
                return Err(
                    format!("it says of {said} layers which value stands for no data, of {layers}").into()
                );
            }
            description.layers.iter_mut().zip(nodata).for_each(|(layer, nodata)| layer.nodata = nodata);
            Ok(Contents { description, filters, align, volume, about })
        }
        _ => Err("the geometry or the layers are missing".to_string().into()),
    }
}

/// Joins what the sections say.
fn describe(
    mut shape: GeometryParts,
    mut layers: Vec<Layer>,
    more: Option<More>,
) -> Result<Description, DescriptionFault> {
    let mut border_color = [0; 4];
    if let Some(more) = more {
        if more.scales.len() != layers.len() {
            return Err(format!("the scales of {} layers, of {}", more.scales.len(), layers.len()).into());
        }
        shape.set_placement(more.placement)?;
        border_color = more.border_color;
        layers.iter_mut().zip(more.scales).for_each(|(layer, scale)| layer.scale = scale);
    }
    let geometry = shape.geometry().map_err(|e| e.to_string())?;
    let description = Description { border_color, ..Description::new(geometry, layers) };
    Ok(description)
}

/// The section [`MORE`], decoded.
struct More {
    /// Read by [`GeometryParts::set_placement`].
    placement: [u8; 2],
    border_color: [u8; 4],
    scales: Vec<u32>,
}

fn decode_more(section: &[u8]) -> Result<More, DescriptionFault> {
    let mut fields = Fields::new(section);
    let placement = [fields.u8()?, fields.u8()?];
    if [fields.u8()?, fields.u8()?] != [0; 2] {
        return Err("bytes that must be zero are not".to_string().into());
    }
    let border_color = [fields.u8()?, fields.u8()?, fields.u8()?, fields.u8()?];
    let mut scales = Vec::new();
    while !fields.is_empty() {
        scales.push(u32::from(fields.u8()?));
    }
    Ok(More { placement, border_color, scales })
}

fn decode_layers(section: &[u8]) -> Result<Vec<Layer>, DescriptionFault> {
    let mut fields = Fields::new(section);
    let count = fields.u32()?;
    let mut layers = Vec::new();
    for _ in 0..count {
        let (number, len) = (fields.u32()?, fields.u32()?);
        let name =
            std::str::from_utf8(fields.bytes(len as usize)?).map_err(|e| format!("a layer's name: {e}"))?;
        let mut known = LayerFormat::ALL.into_iter().chain(LayerFormat::WHOLE_NUMBERS);
        let format = known.find(|&format| format_number(format) == number).ok_or_else(|| {
            DescriptionFault::Unsupported(format!("format {number} of layer {name:?} is not known"))
        })?;
        layers.push(Layer::new(name, format));
    }
    if !fields.is_empty() {
        return Err("the layers are too long".to_string().into());
    }
    Ok(layers)
}

fn decode_filters(section: &[u8]) -> Result<Vec<String>, DescriptionFault> {
    let mut fields = Fields::new(section);
    let mut filters = Vec::new();
    while !fields.is_empty() {
        let len = fields.u32()?;
        let name = std::str::from_utf8(fields.bytes(len as usize)?);
        filters.push(name.map_err(|e| format!("a filter's name: {e}"))?.to_string());
    }
    Ok(filters)
}

/// Fails unless there is a filter for each layer, or none at all.
pub(crate) fn check_filters(description: &Description, filters: &[String]) -> Result<(), String> {
    let (layers, named) = (description.layers.len(), filters.len());
    if named != 0 && named != layers {
        return Err(format!("{named} filters for {layers} layers: name one for each, or none"));
    }
    match filters.iter().find(|name| name.len() > MAX_NAME_BYTES as usize) {
        Some(name) => {
            Err(format!("a filter's name of {} bytes: at most {MAX_NAME_BYTES} are allowed", name.len()))
        }
        None => Ok(()),
    }
}

fn decode_mixing(section: &[u8]) -> Result<Vec<bool>, DescriptionFault> {
    let decoded = |byte: &u8| match byte {
        0 | 1 => Ok(*byte == 1),
        other => {
            Err(format!("whether a layer may be mixed is said by {other}, which is neither 0 nor 1").into())
        }
    };
    section.iter().map(decoded).collect()
}

fn decode_about(section: &[u8]) -> Result<String, DescriptionFault> {
    let about = std::str::from_utf8(section).map_err(|error| format!("what it says of texels: {error}"))?;
    check_about(about)?;
    Ok(about.to_owned())
}

/// Fails if there is more to say of texels than a container keeps.
pub(crate) fn check_about(about: &str) -> Result<(), String> {
    match about.len() > MAX_ABOUT_BYTES {
        true => Err(format!("{} bytes about the texels: at most {MAX_ABOUT_BYTES} are allowed", about.len())),
        false => Ok(()),
    }
}

fn decode_align(section: &[u8]) -> Result<u32, DescriptionFault> {
    let bytes = section.try_into().map_err(|_| format!("an alignment of {} bytes", section.len()))?;
    let align = u32::from_le_bytes(bytes);
    // 1 is said by saying nothing.
    let check = if align == 1 { Err("an alignment of 1 byte".into()) } else { check_align(align) };
    Ok(check.map(|()| align)?)
}

/// Fails unless `align` is 1, for no alignment, or one that disks ask for in direct reads.
pub(crate) fn check_align(align: u32) -> Result<(), String> {
    if align == 1 || (align.is_power_of_two() && ALIGN_BYTES.contains(&align)) {
        return Ok(());
    }
    let (least, most) = (ALIGN_BYTES.start(), ALIGN_BYTES.end());
    Err(format!(
        "tiles cannot begin at multiples of {align} bytes: use a power of two from {least} to {most}, or 1"
    ))
}

/// Fails if a texture is valid but larger than a container can hold; the message says what to change.
pub(crate) fn check(description: &Description) -> Result<(), String> {
    let layers = &description.layers;
    if layers.is_empty() || layers.len() > MAX_LAYERS as usize {
        return Err(format!("{} layers: a container has 1 to {MAX_LAYERS}", layers.len()));
    }
    if let Some(layer) = layers.iter().find(|layer| layer.name.len() > MAX_NAME_BYTES as usize) {
        return Err(format!(
            "a layer's name of {} bytes: at most {MAX_NAME_BYTES} are allowed",
            layer.name.len()
        ));
    }
    description.check().map_err(|e| e.to_string())?;
    let tile_bytes = layers.iter().fold(0u64, |sum, layer| {
        let bytes = description.layer_blocks(layer).saturating_mul(layer.format.block_bytes() as u64);
        sum.saturating_add(bytes)
    });
    if tile_bytes > MAX_TILE_BYTES {
        return Err(format!(
            "tiles of {tile_bytes} bytes: at most {MAX_TILE_BYTES} are allowed; use smaller pages"
        ));
    }
    let levels = description.geometry.levels().iter();
    let pages = levels.fold(0u64, |sum, level| {
        sum.saturating_add(level.pages.iter().fold(1, |product, &n| product.saturating_mul(u64::from(n))))
    });
    if pages > MAX_PAGES {
        return Err(format!("{pages} pages: at most {MAX_PAGES} are allowed; use larger pages"));
    }
    Ok(())
}

#[cfg(test)]
#[cfg(feature = "write")]
mod tests;
