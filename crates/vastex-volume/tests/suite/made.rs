//! Levels that are not stored: beside levels that are made at once of the whole, in memory, in files and in
//! the background.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use pollster::block_on;
use vastex_core::PagePos;
use vastex_tiles::{TileSource, conformance, ends_within};
use vastex_volume::{
    DType, Reduction, Volume, VolumeOptions, VolumeRegion, VolumeSource, levels_of, made_levels_kept,
    makes_levels_at_opening, reduce_into, reduced_size,
};

use crate::fixtures::volume;
use crate::generated::{Level, hash, places, random, write};

/// Longer than any test takes on any machine.
const PATIENCE: Duration = Duration::from_secs(300);

/// All levels from a stored one on, each made of the whole of the one before.
fn made_of(source: &VolumeSource, rule: Reduction) -> Vec<(u8, [usize; 3], Vec<u8>)> {
    let volume: &Volume = source.volume();
    let geometry = &source.description().geometry;
    let dtype: DType = volume.about().dtype;
    let first = source.levels().stored();
    let level = usize::from(source.levels().level(first as u8 - 1).stored.unwrap());
    let size = volume.about().levels[level].size;
    let region = VolumeRegion { level, channel: 0, time: 0, at: [0; 3], size };
    let mut values = block_on(volume.read(&region)).unwrap();
    let mut size = size.map(|side| side as usize);
    let mut levels = Vec::new();
    for n in first..geometry.levels().len() {
        let factor = geometry.level(n as u8).factor.map(|factor| factor as usize);
        let next = reduced_size(size, factor);
        let mut output = vec![0; next.iter().product::<usize>() * dtype.bytes()];
        reduce_into(dtype, rule, &values, size, factor, &mut output).unwrap();
        (values, size) = (output, next);
        levels.push((n as u8, size, values.clone()));
    }
    levels
}

/// Compares every made level with what `made_of` gives, by slices, and a page or the tail by its tile.
fn check(source: &VolumeSource, rule: Reduction) {
    let width = source.volume().about().dtype.bytes();
    for (n, size, values) in made_of(source, rule) {
        let of = source.levels().level(n);
        assert_eq!(of.size.map(|side| side as usize), size, "level {n}");
        let [width_of, height, depth] = size;
        let plane = width_of * height * width;
        for z in [0, depth / 2, depth - 1] {
            let middle = of.world_from_voxel([0.5, 0.5, z as f64 + 0.5]);
            let finest = source.levels().level(0);
            let index = finest.voxel_from_world(middle)[2].min(f64::from(finest.size[2] - 1)) as u32;
            let part = [width_of as u32, height as u32];
            let axis = vastex_volume::SliceAxis::Z;
            let found = block_on(source.slice(n, axis, index, [0, 0], part)).unwrap();
            // The last voxels of a level may reach beyond the volume.
            let expected = (0..depth).map(|z| &values[z * plane..][..plane]);
            assert!(
                expected.clone().nth(z).is_some_and(|expected| expected == found),
                "level {n}, slice {z}"
            );
        }
    }
}

#[test]
fn small_levels_are_made_at_opening() {
    for (rule, levels) in [
        (
            Reduction::Mean,
            [
                Level::new([75, 51, 33], [20, 20, 20], [1.0, 1.0, 2.0]),
                Level::new([25, 17, 33], [25, 17, 8], [3.0, 3.0, 2.0]),
            ],
        ),
        (
            Reduction::Max,
            [
                Level::new([90, 1, 140], [64, 1, 64], [1.0; 3]),
                Level::new([41, 1, 66], [64, 1, 64], [2.2, 1.0, 2.1]),
            ],
        ),
        // Made ones halve x and y alone at first.
        (
            Reduction::Mean,
            [
                Level::new([90, 70, 20], [32, 32, 8], [0.5, 0.5, 7.0]),
                Level::new([45, 35, 20], [45, 35, 4], [1.0, 1.0, 7.0]),
            ],
        ),
    ] {
        let (_directory, volume) = random(&levels, |_, _| true);
        let options = VolumeOptions { brick: 16, reduction: Some(rule), ..VolumeOptions::default() };
        let source = VolumeSource::open(volume, &options).unwrap();
        assert!(!source.has_levels_to_make() && source.faults().is_empty());
        assert!(makes_levels_at_opening(source.volume().about(), source.levels()));
        check(&source, rule);
    }
}

/// Whatever is kept: made levels are put together brick by brick, each of a part of the only chunk.
#[test]
fn a_chunk_beyond_what_is_kept_is_decoded_once_for_all_made_levels() {
    let level = Level::new([200, 180, 160], [200, 180, 160], [1.0; 3]);
    let directory = tempfile::tempdir().unwrap();
    let value = |_: usize, [x, y, z]: [u64; 3], bytes: &mut Vec<u8>| {
        bytes.push((x ^ (y * 3) ^ (z >> 2)) as u8);
    };
    write(directory.path(), "|u1", &[level], value, |_, _| true);
    let volume = Arc::new(volume(directory.path()));
    volume.keep_at_most(1 << 20);
    let source = VolumeSource::open(volume.clone(), &VolumeOptions::default()).unwrap();
    let geometry = &source.description().geometry;
    for pos in geometry.pages().filter(|pos| pos.level > 0).chain([geometry.tail_pos()]) {
        texels(&source, pos);
    }
    let work = volume.chunk_work();
    assert!(work.decoded == 1 && work.shared >= 7, "{work:?}");
    assert_eq!(work.bytes_kept / 200 / 180 / 160, 1, "it is kept");
    check(&source, Reduction::Mean);
    assert_eq!(volume.chunk_work().decoded, 1);
}

#[test]
fn labels_are_made_by_majority() {
    let directory = tempfile::tempdir().unwrap();
    let level = Level::new([40, 30, 20], [16, 16, 16], [1.0; 3]);
    let value = |_: usize, at: [u64; 3], bytes: &mut Vec<u8>| {
        bytes.extend(((hash(&at.map(|at| at / 3)) % 4 * 0x4000_0000_0000) as i64).to_le_bytes());
    };
    write(directory.path(), "<i8", &[level], value, |_, _| true);
    let options = VolumeOptions { brick: 16, labels: Some(true), ..VolumeOptions::default() };
    let source = VolumeSource::open(Arc::new(volume(directory.path())), &options).unwrap();
    assert_eq!(conformance(&source), Ok(()));
    check(&source, Reduction::Majority);
}

/// A volume of one level with more than 64 MiB, most of whose chunks are absent.
const LARGE: Level = Level { size: [336, 400, 520], chunk: [84, 100, 130], scale: [1.0; 3], moved: [0.0; 3] };

pub(crate) fn large(directory: &Path) -> Arc<Volume> {
    let value = |_: usize, [x, y, z]: [u64; 3], bytes: &mut Vec<u8>| {
        bytes.push((x ^ (y * 3) ^ (z >> 2)) as u8);
    };
    write(directory, "|u1", &[LARGE], value, |_, chunk| hash(&chunk).is_multiple_of(3));
    Arc::new(volume(directory))
}

/// Bricks of the finest level that is made of it, without those of which nothing is stored.
fn made_bricks() -> u64 {
    let is_made = |brick: &[u64; 3]| {
        let chunks = |axis: usize| {
            let end = ((brick[axis] + 1) * 128).min(LARGE.size[axis]);
            brick[axis] * 128 / LARGE.chunk[axis]..end.div_ceil(LARGE.chunk[axis])
        };
        let touches = |chunk: &[u64; 3]| (0..3).all(|axis| chunks(axis).contains(&chunk[axis]));
        places([4; 3]).filter(|chunk| hash(chunk).is_multiple_of(3)).any(|chunk| touches(&chunk))
    };
    places([3, 4, 5]).filter(is_made).count() as u64
}

fn open(volume: Arc<Volume>, cache: Option<&Path>) -> VolumeSource {
    let options = VolumeOptions { cache: cache.map(Path::to_owned), ..VolumeOptions::default() };
    VolumeSource::open(volume, &options).unwrap()
}

pub(crate) fn texels(source: &VolumeSource, pos: PagePos) -> Vec<u8> {
    block_on(source.read(pos)).unwrap().decode(source.description()).unwrap().to_vec()
}

#[test]
fn large_levels_are_a_preview_until_they_are_made() {
    let directory = tempfile::tempdir().unwrap();
    let source = open(large(directory.path()), None);
    let tail = source.description().geometry.tail_pos();
    assert!(source.has_levels_to_make());
    let about = source.volume().about();
    let (geometry, levels) = levels_of(about, 64, 1).unwrap();
    assert!(geometry == source.description().geometry && levels == **source.levels());
    assert!(!makes_levels_at_opening(about, &levels));
    let progress = source.level_states().last().unwrap().made.unwrap();
    assert_eq!((progress.done, progress.total), (0, made_bricks()));
    let preview = texels(&source, tail);
    // Each chunk is looked at once for it.
    let stored = places([4; 3]).filter(|chunk| hash(chunk).is_multiple_of(3)).count();
    assert_eq!(source.volume().chunk_work().decoded, stored as u64);
    assert!(preview.iter().any(|value| *value != 3), "what is stored is seen");
    assert!(source.take_changes().is_empty());
    // Told to stop, it does nothing; asked for again, all of it.
    source.make_levels(&AtomicBool::new(true));
    assert!(source.has_levels_to_make());
    source.make_levels(&AtomicBool::new(false));
    assert!(!source.has_levels_to_make());
    let progress = source.level_states().last().unwrap().made.unwrap();
    assert_eq!(progress.done, progress.total);
    let changes = source.take_changes();
    let geometry = &source.description().geometry;
    assert!(changes.iter().any(|region| region.concerns(geometry, tail)), "{changes:?}");
    assert!(source.take_changes().is_empty());
    assert_ne!(texels(&source, tail), preview);
    check(&source, Reduction::Mean);
    assert_eq!(conformance(&source), Ok(()));
}

#[test]
fn levels_in_files_are_there_for_the_next_run() {
    let (directory, cache) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let volume = large(directory.path());
    let source = open(volume, Some(cache.path()));
    source.make_levels(&AtomicBool::new(false));
    let tail = source.description().geometry.tail_pos();
    let made = texels(&source, tail);
    let kept = |cache: &Path| {
        let options = VolumeOptions { cache: Some(cache.to_owned()), ..VolumeOptions::default() };
        let kept = made_levels_kept(source.volume(), &options).unwrap().unwrap();
        (kept.done, kept.total)
    };
    let elsewhere = cache.path().join("elsewhere");
    let all = made_bricks();
    assert_eq!((kept(cache.path()), kept(&elsewhere)), ((all, all), (0, all)));
    assert!(!elsewhere.exists(), "who asks writes nothing");
    let second = open(Arc::new(crate::fixtures::volume(directory.path())), Some(cache.path()));
    assert_eq!(texels(&second, tail), made);
    second.make_levels(&AtomicBool::new(false));
    let progress = second.level_states().last().unwrap().made.unwrap();
    assert_eq!(progress.done, progress.total);
    assert_eq!(second.volume().chunk_work().decoded, 0, "nothing stored is read for it");
    check(&second, Reduction::Mean);
    // Another volume has files of its own.
    let other = tempfile::tempdir().unwrap();
    let third = open(large(other.path()), Some(cache.path()));
    assert!(third.has_levels_to_make());
    third.make_levels(&AtomicBool::new(false));
    assert!(third.volume().chunk_work().decoded > 0);
}

#[test]
fn a_directory_that_is_none_is_a_fault_and_no_end() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("file");
    std::fs::write(&file, b"").unwrap();
    let store = directory.path().join("store");
    std::fs::create_dir(&store).unwrap();
    let source = open(large(&store), Some(&file));
    let faults = source.faults();
    assert!(faults.len() == 1 && faults[0].to_string().contains("file"), "{faults:?}");
    assert!(source.has_levels_to_make());
}

#[test]
fn threads_read_while_levels_are_made() {
    ends_within(PATIENCE, read_while_levels_are_made).unwrap();
}

fn read_while_levels_are_made() {
    let directory = tempfile::tempdir().unwrap();
    let source = open(large(directory.path()), None);
    let stop = AtomicBool::new(false);
    let pages: Vec<PagePos> = source.description().geometry.pages().collect();
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                // Nobody says that it is over where a reader fails.
                let begun = Instant::now();
                while !stop.load(Ordering::Relaxed) && begun.elapsed() < PATIENCE {
                    source.make_levels(&stop);
                    std::thread::yield_now();
                }
            });
        }
        let readers: Vec<_> = (0..3)
            .map(|thread: usize| {
                let (source, pages) = (&source, &pages);
                scope.spawn(move || {
                    for n in (0..pages.len()).step_by(5) {
                        texels(source, pages[(n + thread * 31) % pages.len()]);
                    }
                })
            })
            .collect();
        readers.into_iter().for_each(|reader| reader.join().unwrap());
        while source.has_levels_to_make() {
            std::thread::yield_now();
        }
        stop.store(true, Ordering::Relaxed);
    });
    check(&source, Reduction::Mean);
}
