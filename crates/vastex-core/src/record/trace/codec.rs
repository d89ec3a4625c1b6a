//! A trace as bytes, and back. docs/traces.md describes them.

use crate::record::file::{self, Reader, put, put_float, put_geometry, put_pages};
use crate::texture::page::TextureNumber;

use super::{CameraPosition, Trace, TraceError};

/// The version written.
pub(super) const VERSION: u32 = 3;
/// The version with shapes of its own in place of those that containers have; still read.
const OLD_SHAPES: u32 = 2;
/// The first version, without places as well; still read.
pub(super) const WITHOUT_PLACES: u32 = 1;

const MAGIC: &file::Magic = b"VXTRACE\0";

pub(super) fn encode(trace: &Trace) -> Vec<u8> {
    let mut bytes = file::begin(MAGIC, VERSION);
    put(&mut bytes, trace.geometries.len() as u64);
    trace.geometries.iter().for_each(|geometry| put_geometry(&mut bytes, geometry));
    put(&mut bytes, trace.frames.len() as u64);
    for (pages, place) in trace.frames.iter().zip(&trace.places) {
        put_pages(&mut bytes, pages);
        bytes.push(u8::from(place.is_some()));
        place.iter().flatten().for_each(|&coordinate| put_float(&mut bytes, coordinate));
    }
    file::seal(bytes)
}

pub(super) fn decode(bytes: &[u8]) -> Result<Trace, TraceError> {
    let (mut reader, version) = Reader::open(bytes, MAGIC)?.ok_or(TraceError::NotATrace)?;
    if !(WITHOUT_PLACES..=VERSION).contains(&version) {
        return Err(TraceError::Version(version));
    }
    reader.unseal()?;
    let mut trace = Trace::new();
    for texture in 0..reader.number("the number of textures", u64::from(TextureNumber::MAX) + 1)? as usize {
        let geometry = match version <= OLD_SHAPES {
            true => reader.old_geometry(texture)?,
            false => reader.geometry(texture)?,
        };
        trace.add_texture(geometry).map_err(|error| TraceError::Content { at: reader.at, error })?;
    }
    for _ in 0..reader.number("the number of frames", u64::MAX)? {
        let pages = reader.pages()?;
        let place = if version == WITHOUT_PLACES { None } else { read_place(&mut reader)? };
        trace.add(pages, place).map_err(|error| TraceError::Content { at: reader.at, error })?;
    }
    reader.end()?;
    Ok(trace)
}

fn read_place(reader: &mut Reader<'_>) -> Result<Option<CameraPosition>, TraceError> {
    if !reader.one_of("whether there is a place", &[false, true])? {
        return Ok(None);
    }
    let mut place = [0.0; 3];
    for coordinate in &mut place {
        *coordinate = reader.float("a coordinate of a place")?;
    }
    Ok(Some(place))
}

#[cfg(test)]
mod tests;
