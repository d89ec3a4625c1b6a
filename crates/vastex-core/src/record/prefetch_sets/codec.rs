//! Prefetch sets as bytes, and back. docs/traces.md describes them.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Cell, PrefetchSets, SetsError};
use crate::record::file::{self, Reader, put, put_float, put_geometry, put_pages};
use crate::texture::geometry::Geometry;
use crate::texture::page::TextureNumber;
use crate::wanted::feedback::WantedPage;

/// The version written.
pub(super) const VERSION: u32 = 2;
/// The first version, with shapes of its own in place of those that containers have; still read.
pub(super) const OLD_SHAPES: u32 = 1;

const MAGIC: &file::Magic = b"VXSETS\0\0";

pub(super) fn encode(sets: &PrefetchSets) -> Vec<u8> {
    let mut bytes = file::begin(MAGIC, VERSION);
    put(&mut bytes, sets.geometries.len() as u64);
    sets.geometries.iter().for_each(|geometry| put_geometry(&mut bytes, geometry));
    sets.sides.iter().for_each(|&side| put_float(&mut bytes, side));
    put(&mut bytes, u64::from(sets.ahead_frames));
    put(&mut bytes, sets.cells.len() as u64);
    for (cell, pages) in &sets.cells {
        cell.iter().for_each(|&number| put(&mut bytes, u64::from(zigzag(number))));
        put_pages(&mut bytes, pages);
    }
    file::seal(bytes)
}

pub(super) fn decode(bytes: &[u8]) -> Result<PrefetchSets, SetsError> {
    let (mut reader, version) = Reader::open(bytes, MAGIC)?.ok_or(SetsError::NotSets)?;
    if ![VERSION, OLD_SHAPES].contains(&version) {
        return Err(SetsError::Version(version));
    }
    reader.unseal()?;
    let mut geometries = Vec::new();
    for texture in 0..reader.number("the number of textures", u64::from(TextureNumber::MAX) + 1)? as usize {
        geometries.push(Arc::new(match version {
            OLD_SHAPES => reader.old_geometry(texture)?,
            _ => reader.geometry(texture)?,
        }));
    }
    let mut sides = [0.0; 3];
    for side in &mut sides {
        *side = reader.float("the side of a cell")?;
    }
    if sides.iter().any(|side| *side < 0.0) {
        return Err(SetsError::Content { at: reader.at, what: "a cell's side is below 0" });
    }
    let ahead_frames = reader.number("the frames that the lists look ahead", u64::from(u32::MAX))? as u32;
    let mut cells = BTreeMap::new();
    for _ in 0..reader.number("the number of cells", u64::MAX)? {
        let cell = read_cell(&mut reader)?;
        let pages = reader.pages()?;
        let content = |what| SetsError::Content { at: reader.at, what };
        if !pages.iter().all(|wanted| exists(&geometries, wanted)) {
            return Err(content("a page is none of the textures"));
        }
        if cells.last_key_value().is_some_and(|(last, _)| *last >= cell) {
            return Err(content("a cell is out of order; cells ascend and stand there once"));
        }
        cells.insert(cell, pages);
    }
    reader.end()?;
    Ok(PrefetchSets { geometries, sides, ahead_frames, cells })
}

fn read_cell(reader: &mut Reader<'_>) -> Result<Cell, SetsError> {
    let mut cell = [0; 3];
    for number in &mut cell {
        *number = from_zigzag(reader.number("the number of a cell", u64::from(u32::MAX))? as u32);
    }
    Ok(cell)
}

fn exists(geometries: &[Arc<Geometry>], wanted: &WantedPage) -> bool {
    let geometry = geometries.get(usize::from(wanted.page.texture().number()));
    geometry.is_some_and(|geometry| geometry.contains(wanted.page.pos(geometry.dims())))
}

/// Small numbers of either sign as small ones: 0, -1, 1, -2 ...
fn zigzag(number: i32) -> u32 {
    ((number << 1) ^ (number >> 31)) as u32
}

fn from_zigzag(code: u32) -> i32 {
    (code >> 1) as i32 ^ -((code & 1) as i32)
}
