//! TIFF pyramids of other programs, opened where they lie, and regions of whatever can be opened.

mod conversions;
mod cropping;
mod fixtures;
mod hostile;
mod kept_levels;
mod kinds;
mod stored_as;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use vastex_build::{CropFormat, CropRegion, CropSource, TiffSource, crop};
use vastex_tiles::TileSource;

/// A file of `assets/tiff`.
pub(crate) fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/tiff").join(name)
}

/// All of a level, as NumPy's array without its header.
pub(crate) fn whole(mut source: CropSource) -> Vec<u8> {
    let region = CropRegion { at: [0, 0], size: source.size() };
    let mut bytes = Vec::new();
    crop(&mut source, region, CropFormat::Npy, &mut bytes, &()).unwrap();
    let header = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    assert!(header.is_multiple_of(64) && bytes[header - 1] == b'\n');
    bytes.split_off(header)
}

/// What a level of the file stores.
pub(crate) fn stored(path: &Path, level: u32) -> Vec<u8> {
    whole(CropSource::open(path, level).unwrap())
}

/// What is shown of a level, with its size.
pub(crate) fn shown(tiles: Arc<dyn TileSource>, level: u32) -> ([u32; 2], Vec<u8>) {
    let source = CropSource::of_tiles(tiles, None, level).unwrap();
    (source.size(), whole(source))
}

pub(crate) fn open(path: &Path) -> Arc<TiffSource> {
    Arc::new(TiffSource::open(path).unwrap())
}
