//! Volumes: a directory of Zarr, and each file that looks like a volume. What opens must count its bricks and
//! read, and be a source of tiles, or say why not.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use pollster::block_on;
use vastex_core::PagePos;
use vastex_tiles::TileSource;
use vastex_volume::{
    Brick, BrickLayout, BrickPos, Opened, Volume, VolumeError, VolumeOptions, VolumeRegion, VolumeSource,
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
            let labels = volume.about().labels.clone();
            read_tiles(&Arc::from(volume));
            for name in labels.iter().take(MAX_READ).filter(|_| follows) {
                look_below(&path.join("labels"), name);
            }
        }
        Ok(Opened::Images(list)) => {
            for image in list.images.iter().take(MAX_READ).filter(|_| follows) {
                look_below(path, image);
            }
        }
        Err(error) => check_error(&error),
    }
}

/// A list may name what is anywhere; the reader of a path takes what it is told.
fn look_below(path: &Path, name: &str) {
    if !name.contains("..") && !name.starts_with('/') {
        look(&path.join(name), false);
    }
}

fn check_error(error: &VolumeError) {
    assert!(!error.path.is_empty() && error.to_string().len() > error.path.len() + 2, "{error}");
}

/// Reads a box at the far corner of the first and of the last channel and time, level by level, and bricks.
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
            read_bricks(volume, number, [channel, time])?;
        }
    }
    Ok(())
}

/// Small, so that most lie in several chunks and have neighbours.
const LAYOUT: BrickLayout = BrickLayout { side: 5, border: 1 };

/// Puts the brick at the near corner, one beside it and the one at the far corner together at once. Each must
/// be what a box has in its place, the last voxels of the level beyond its faces.
fn read_bricks(volume: &Volume, level: usize, [channel, time]: [u64; 2]) -> Result<(), VolumeError> {
    let last = volume.about().levels[level].size.map(|side| (side - 1) / u64::from(LAYOUT.side));
    let places = BTreeSet::from([[0; 3], last.map(|n| n.min(1)), last]);
    let wanted: Vec<BrickPos> = places.into_iter().map(|at| BrickPos { level, channel, time, at }).collect();
    let mut found = Vec::new();
    let work = block_on(volume.read_bricks(LAYOUT, &wanted, &mut |pos, brick| found.push((pos, brick))))?;
    found.sort_by_key(|(pos, _)| *pos);
    assert!(found.iter().map(|(pos, _)| pos).eq(&wanted), "every brick that is named is delivered once");
    let all_absent = found.iter().all(|(_, brick)| brick.as_ref().is_ok_and(|brick| brick.is_absent));
    assert!(work.parts > 0 || all_absent || found.iter().any(|(_, brick)| brick.is_err()));
    for (pos, brick) in found {
        check_brick(volume, pos, &brick?)?;
    }
    Ok(())
}

fn check_brick(volume: &Volume, pos: BrickPos, brick: &Brick) -> Result<(), VolumeError> {
    let (about, side) = (volume.about(), u64::from(LAYOUT.side));
    let size = about.levels[pos.level].size;
    // Of what is absent the borders are not said.
    let border = if brick.is_absent { 0 } else { u64::from(LAYOUT.border) };
    let at: [u64; 3] = std::array::from_fn(|axis| (pos.at[axis] * side).saturating_sub(border));
    let end: [u64; 3] = std::array::from_fn(|axis| (pos.at[axis] * side + side + border).min(size[axis]));
    let size = std::array::from_fn(|axis| end[axis] - at[axis]);
    let region = VolumeRegion { level: pos.level, channel: pos.channel, time: pos.time, at, size };
    let values = block_on(volume.read(&region))?;
    let width = about.dtype.bytes();
    if brick.is_absent {
        let is_one = values.chunks_exact(width).all(|value| *value == values[..width]);
        assert!(is_one && brick.values.is_empty(), "{pos:?} is absent, and has values");
        return Ok(());
    }
    let outer = u64::from(LAYOUT.outer());
    // The voxel of the region for the one that is so far along an axis of the brick.
    let within = |axis: usize, n: u64| {
        (pos.at[axis] * side + n).saturating_sub(border).clamp(at[axis], end[axis] - 1) - at[axis]
    };
    assert_eq!(brick.values.len() as u64, outer.pow(3) * width as u64);
    for (n, value) in (0..).zip(brick.values.chunks_exact(width)) {
        let [x, y, z] = [within(0, n % outer), within(1, n / outer % outer), within(2, n / outer / outer)];
        let from = ((z * size[1] + y) * size[0] + x) as usize * width;
        assert_eq!(*value, values[from..from + width], "voxel {n} of {pos:?}");
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
