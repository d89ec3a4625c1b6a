//! Gaia Sky's directories: `levelN/tx_COLUMN_ROW.jpg`, with or without a border of one texel inside each
//! tile.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use super::quadtree::{Quadtree, level_directories, level_number};
use super::{Source, entries, number};
use crate::image::InputFault;

/// Texels per side of a tile.
const SIDES: std::ops::RangeInclusive<u32> = 4..=1024;

/// Returns true if there are tiles of Gaia Sky in the directory.
pub(super) fn is_here(directory: &Path) -> Result<bool, InputFault> {
    for path in entries(directory)? {
        let is_level = path.file_name().and_then(|name| level_number(name.to_str()?)).is_some();
        if is_level && path.is_dir() && entries(&path)?.iter().any(|path| position(path).is_some()) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Lists the tiles; decodes the two roots to see whether tiles have borders.
pub(super) fn open(directory: &Path) -> Result<Source, InputFault> {
    let (directories, notices) = level_directories(directory)?;
    let mut levels = BTreeMap::new();
    for (level, path) in directories {
        let mut tiles = HashMap::new();
        for path in entries(&path)? {
            let Some(position) = position(&path) else { continue };
            if let Some(other) = tiles.insert(position, path.clone()) {
                let (column, row) = position;
                let why = format!(
                    "has two tiles for column {column}, row {row} of level {level}: {} and {}",
                    other.display(),
                    path.display()
                );
                return Err(InputFault::layout(why, "remove one of them"));
            }
        }
        if !tiles.is_empty() {
            levels.insert(level, tiles);
        }
    }
    let mut tree = Quadtree::new(directory, levels, 0, SIDES)?;
    let texels = tree.texels()?;
    tree.find_border(texels.format)?;
    let (grid, notices) = tree.into_grid(notices);
    Ok(Source { grid, directory: directory.into(), texels, wraps: true, notices })
}

/// Column and row of a file `tx_COLUMN_ROW.ext`; the separators may also be `-`, `.` or a space.
pub(super) fn position(path: &Path) -> Option<(u32, u32)> {
    const SEPARATORS: [char; 4] = ['_', '-', '.', ' '];
    let name = path.file_name()?.to_str()?;
    let (stem, extension) = name.rsplit_once('.')?;
    if !["jpg", "jpeg", "png"].contains(&extension.to_ascii_lowercase().as_str()) {
        return None;
    }
    let numbers = stem.strip_prefix("tx")?.strip_prefix(SEPARATORS)?;
    let (column, row) = numbers.split_once(SEPARATORS)?;
    Some((number(column)?, number(row)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_tiles() {
        for name in
            ["tx_3_12.jpg", "tx-3-12.png", "tx.3.12.jpeg", "tx 3 12.JPG", "tx_03_12.jpg", "a/tx_3-12.png"]
        {
            assert_eq!(position(Path::new(name)), Some((3, 12)), "{name}");
        }
        for name in
            ["tx_3.jpg", "tx_3_12", "tx_3_12.gif", "tx_+3_12.jpg", "ty_3_12.jpg", "tx__3_12.jpg", "tx_3_.jpg"]
        {
            assert_eq!(position(Path::new(name)), None, "{name}");
        }
    }
}
