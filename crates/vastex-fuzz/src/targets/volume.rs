//! Volumes: a directory of Zarr, and each file that looks like a volume. What opens must count its bricks and
//! read, and be a source of tiles, or say why not.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use pollster::block_on;
use vastex_core::PagePos;
use vastex_tiles::TileSource;
use vastex_volume::{
    BrickLayout, BrickPos, Opened, Volume, VolumeError, VolumeOptions, VolumeRegion, VolumeSource,
    VolumeSourceError, is_volume, open,
};

use super::with_directory;
use crate::tree::Tree;

/// Voxels along each side of what is read: chunks may have one each, and a file of their own.
const MAX_SIDE: u64 = 6;
/// Levels, and images of a list, that are read.
const MAX_READ: usize = 4;

/// Opens and reads whatever lies in a tree.
pub(super) fn check(bytes: &[u8]) {
    let tree = Tree::decode(bytes);
    with_directory(&tree, |root, _| {
        look(root, true);
        for (name, _) in tree.files.iter().filter(|(name, _)| !name.contains(['/', '\0'])) {
            let path = root.join(name);
            if path.starts_with(root) && path.is_file() && is_volume(&path) {
                look(&path, true);
            }
        }
    });
}

fn look(path: &Path, follows: bool) {
    match open(path) {
        Ok(Opened::Volume(volume)) => {
            if let Err(error) = read(&volume) {
                check_error(&error);
            }
            read_tiles(&Arc::from(volume));
        }
        Ok(Opened::Images(list)) => {
            for image in list.images.iter().take(MAX_READ).filter(|_| follows) {
                // A list may name what is anywhere; the reader of a path takes what it is told.
                if !image.contains("..") && !image.starts_with('/') {
                    look(&path.join(image), false);
                }
            }
        }
        Err(error) => check_error(&error),
    }
}

fn check_error(error: &VolumeError) {
    assert!(!error.path.is_empty() && error.to_string().len() > error.path.len() + 2, "{error}");
}

/// Reads a box at the far corner of the first and of the last channel and time, level by level.
pub(super) fn read(volume: &Volume) -> Result<(), VolumeError> {
    let count = block_on(volume.count_bricks(false))?;
    assert!(count.absent.is_none_or(|absent| absent <= count.bricks));
    let about = volume.about();
    for (number, level) in about.levels.iter().enumerate().take(MAX_READ) {
        assert!(level.scale.iter().all(|side| side.is_finite() && *side > 0.0), "{:?}", level.scale);
        for (channel, time) in [(0, 0), (about.channels - 1, about.times - 1)] {
            let size = level.size.map(|side| side.min(MAX_SIDE));
            let at = std::array::from_fn(|axis| level.size[axis] - size[axis]);
            let values = block_on(volume.read(&VolumeRegion { level: number, channel, time, at, size }))?;
            assert_eq!(values.len() as u64, size.iter().product::<u64>() * about.dtype.bytes() as u64);
            if number == 0 {
                read_brick(volume, BrickPos { level: number, channel, time, at: [0; 3] })?;
            }
        }
    }
    Ok(())
}

/// Puts a brick together, whose payload must be what a box has in its place.
fn read_brick(volume: &Volume, pos: BrickPos) -> Result<(), VolumeError> {
    const LAYOUT: BrickLayout = BrickLayout { side: 5, border: 1 };
    let (about, mut found) = (volume.about(), None);
    let work = block_on(volume.read_bricks(LAYOUT, &[pos], &mut |_, brick| found = Some(brick)))?;
    let brick = found.expect("every brick that is named is delivered")?;
    assert!(work.parts > 0 || brick.is_absent);
    let (width, outer) = (about.dtype.bytes(), LAYOUT.outer() as usize);
    let size = about.levels[pos.level].size.map(|side| side.min(LAYOUT.side.into()));
    let region = VolumeRegion { level: pos.level, channel: pos.channel, time: pos.time, at: [0; 3], size };
    let values = block_on(volume.read(&region))?;
    let [across, down, _] = size.map(|side| side as usize);
    for (row, values) in values.chunks(across * width).enumerate().filter(|_| !brick.is_absent) {
        let first = ((row / down + 1) * outer + row % down + 1) * outer + 1;
        assert_eq!(brick.values[first * width..][..values.len()], *values, "row {row} of {pos:?}");
    }
    Ok(())
}

/// Chunks of the coarsest level, of which others are made.
const MAX_CHUNKS: u64 = 512;

/// Reads the coarsest tile and one at the far corner, as a source does, and makes the levels that are not
/// stored.
pub(super) fn read_tiles(volume: &Arc<Volume>) {
    let about = volume.about();
    let coarsest = &about.levels[about.levels.len() - 1];
    let chunks = (0..3).map(|axis| coarsest.size[axis].div_ceil(coarsest.chunk[axis]));
    if chunks.fold(1, u64::saturating_mul) > MAX_CHUNKS {
        return;
    }
    let (channel, time) = (about.channels - 1, about.times - 1);
    for labels in [false, true] {
        let options =
            VolumeOptions { channel, time, brick: 8, labels: Some(labels), ..VolumeOptions::default() };
        let source = match VolumeSource::open(volume.clone(), &options) {
            Ok(source) => source,
            Err(VolumeSourceError::Volume(error)) => return check_error(&error),
            Err(error) => return assert!(!error.to_string().is_empty()),
        };
        source.make_levels(&AtomicBool::new(false));
        let geometry = &source.description().geometry;
        let last = PagePos::at(0, geometry.level(0).pages.map(|pages| pages - 1));
        let far = if geometry.tail().first_level() > 0 { last } else { geometry.tail_pos() };
        for pos in [geometry.tail_pos(), far] {
            match block_on(source.read(pos)) {
                Ok(tile) => assert!(tile.decode(source.description()).is_ok(), "{pos}"),
                Err(error) => assert!(!error.to_string().is_empty()),
            }
        }
    }
}
