//! Volumes: a directory of Zarr, and each file that looks like a volume. What opens must count its bricks and
//! read, or say why not.

use std::path::Path;

use pollster::block_on;
use vastex_volume::{Opened, Volume, VolumeError, VolumeRegion, is_volume, open};

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
        }
    }
    Ok(())
}
