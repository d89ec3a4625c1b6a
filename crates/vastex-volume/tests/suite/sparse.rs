//! Levels that are made of little: of sparse volumes only what is stored, of large ones only what is wanted.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use pollster::block_on;
use vastex_core::PagePos;
use vastex_tiles::{Codec, TileSource};
use vastex_volume::{DType, Reduction, SliceAxis, Volume, VolumeOptions, VolumeSource, reduce_into};

use crate::fixtures::volume;
use crate::generated::{Level, hash, places, write};
use crate::made::{large, texels};

/// The values of a chunk of 64 voxels a side.
fn chunk() -> Vec<u8> {
    (0..64_u64.pow(3)).map(|n| 100 + (hash(&[n]) % 90) as u8).collect()
}

/// A volume of one level in chunks of 64 voxels a side, of which those at these places are stored.
fn sparse(directory: &Path, side: u64, stored: &[[u64; 3]]) -> Arc<Volume> {
    write(directory, "|u1", &[Level::new([side; 3], [64; 3], [1.0; 3])], |_, _, _| (), |_, _| false);
    for [x, y, z] in stored {
        std::fs::write(directory.join(format!("0/{z}.{y}.{x}")), chunk()).unwrap();
    }
    Arc::new(volume(directory))
}

/// The pages around a voxel of level 0, one of each level that is finer than the tail.
fn pages_around(source: &VolumeSource, voxel: [f64; 3]) -> Vec<PagePos> {
    let geometry = &source.description().geometry;
    let (levels, finest) = (source.levels(), source.levels().level(0));
    let page_of = |level: u8| {
        let at = levels.level(level).voxel_from_world(finest.world_from_voxel(voxel));
        PagePos::at(level, at.map(|at| (at / 64.0) as u32))
    };
    (0..geometry.tail().first_level()).map(page_of).collect()
}

#[test]
fn one_chunk_in_a_huge_level_is_all_that_is_read() {
    for (side, at) in [(4000, [17, 40, 3]), (8000, [100, 0, 124]), (100_000, [1500, 777, 3])] {
        let directory = tempfile::tempdir().unwrap();
        let volume = sparse(directory.path(), side, &[at]);
        let source = VolumeSource::open(volume.clone(), &VolumeOptions::default()).unwrap();
        let geometry = &source.description().geometry;
        let made = source.level_states().last().unwrap().made.unwrap();
        assert_eq!((made.total, source.has_levels_to_make()), (1, false), "nothing waits for a thread");
        let tail = block_on(source.read(geometry.tail_pos())).unwrap();
        // In the largest the chunk is less than half a step of a mean of the fill value.
        assert_eq!(tail.codec == Codec::Constant, side == 100_000);
        let work = volume.chunk_work();
        assert_eq!((work.decoded, work.absent, source.has_levels_to_make()), (1, 0, false), "{work:?}");
        let middle = at.map(|at| at as f64 * 64.0 + 32.0);
        for pos in pages_around(&source, middle) {
            assert!(!source.is_absent(pos), "{pos}");
            let mut far = pos.coords();
            far[1] = (far[1] + geometry.level(pos.level).pages[1] / 2) % geometry.level(pos.level).pages[1];
            let far = PagePos::at(pos.level, far);
            if far.y.abs_diff(pos.y) > 1 {
                assert!(source.is_absent(far), "{far}");
                assert_eq!(block_on(source.read(far)).unwrap().codec, Codec::Constant);
            }
        }
        // Level 6 has one voxel of the chunk.
        let (mut values, mut width) = (chunk(), 64);
        while width > 1 {
            let mut half = vec![0; (width / 2_usize).pow(3)];
            reduce_into(DType::U8, Reduction::Mean, &values, [width; 3], [2; 3], &mut half).unwrap();
            (values, width) = (half, width / 2);
        }
        let [x, y, z] = at.map(|at| at as u32);
        let slice = block_on(source.slice(6, SliceAxis::Z, z * 64 + 32, [x - 1, y], [3, 1])).unwrap();
        assert_eq!(slice, [3, values[0], 3]);
        let work = volume.chunk_work();
        assert_eq!((work.decoded, work.failed), (1, 0), "{work:?}");
    }
}

#[test]
fn an_empty_level_of_any_size_is_the_fill_value() {
    let directory = tempfile::tempdir().unwrap();
    let volume = sparse(directory.path(), 100_000, &[]);
    let options = VolumeOptions { makes_all: false, ..VolumeOptions::default() };
    for options in [VolumeOptions::default(), options] {
        let source = VolumeSource::open(volume.clone(), &options).unwrap();
        let tail = block_on(source.read(source.description().geometry.tail_pos())).unwrap();
        assert_eq!((tail.codec, &tail.bytes[..]), (Codec::Constant, &[3][..]));
        assert!(pages_around(&source, [5e4; 3]).into_iter().all(|pos| source.is_absent(pos)));
        let tail = source.description().geometry.tail_pos();
        assert!(!source.want(tail) && !source.has_levels_to_make());
        assert_eq!(source.level_states().last().unwrap().made.unwrap().total, 0);
    }
    assert_eq!(volume.chunk_work(), Default::default(), "nothing is looked for");
}

#[test]
fn what_nobody_wants_is_not_made() {
    let directory = tempfile::tempdir().unwrap();
    let volume = large(directory.path());
    let options = VolumeOptions { makes_all: false, ..VolumeOptions::default() };
    let source = VolumeSource::open(volume.clone(), &options).unwrap();
    let (geometry, decoded) = (&source.description().geometry, || volume.chunk_work().decoded);
    let tail = geometry.tail_pos();
    assert!(source.may_lack_levels() && source.waits_for_want() && !source.has_levels_to_make());
    let preview = texels(&source, tail);
    assert!(decoded() <= 8 && !source.has_levels_to_make(), "a preview of an eighth is enough");
    let all = places([4; 3]).filter(|at| hash(at).is_multiple_of(3)).count() as u64;
    // A coarser brick of what is in view is a preview, too.
    let pos = PagePos::at(1, [0, 1, 1]);
    let (before, coarse) = (decoded(), texels(&source, pos));
    assert!(decoded() == before && !source.has_levels_to_make() && source.take_changes().is_empty());
    // Wanted, it is made when it is read again, of what lies below it and beside.
    assert!(source.want(pos) && !source.want(pos) && !source.has_levels_to_make());
    assert!(source.take_changes().iter().any(|region| region.concerns(geometry, pos)));
    let made = texels(&source, pos);
    assert!(made != coarse && decoded() > before && decoded() < all, "{} of {all}", decoded());
    source.make_levels(&AtomicBool::new(false));
    assert!(source.take_changes().is_empty() && texels(&source, tail) == preview);
    // The tail is made of all.
    assert!(source.want(tail) && !source.want(tail) && source.has_levels_to_make());
    source.make_levels(&AtomicBool::new(false));
    assert!(source.take_changes().iter().any(|region| region.concerns(geometry, tail)));
    assert_ne!(texels(&source, tail), preview);
    assert_eq!((decoded(), texels(&source, pos) == made), (all, true));
    let whole = VolumeSource::open(volume, &VolumeOptions::default()).unwrap();
    assert!(!whole.waits_for_want() && !whole.want(tail));
    whole.make_levels(&AtomicBool::new(false));
    assert_eq!((texels(&source, tail), made), (texels(&whole, tail), texels(&whole, pos)));
}
