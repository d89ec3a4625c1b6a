//! Volumes as sources of tiles: every promise of sources, every voxel of every tile, chunks that are absent
//! or damaged, and how often a chunk is decoded.

use std::sync::Arc;

use pollster::block_on;
use vastex_core::{Dims, LayerFormat, PageId, PagePos, TextureNumber};
use vastex_tiles::{Codec, Loader, ReadError, Tiers, TileSource, conformance};
use vastex_volume::{BINS, Volume, VolumeOptions, VolumeRegion, VolumeSource};

use crate::fixtures::{path, volume};
use crate::generated::{Level, hash, places, random, source};

/// The whole of a stored level, voxel by voxel.
struct Stored {
    values: Vec<u8>,
    size: [u64; 3],
    width: usize,
}

impl Stored {
    fn new(volume: &Volume, level: usize, channel: u64, time: u64) -> Stored {
        let size = volume.about().levels[level].size;
        let region = VolumeRegion { level, channel, time, at: [0; 3], size };
        let values = block_on(volume.read(&region)).unwrap();
        Stored { values, size, width: volume.about().dtype.bytes() }
    }

    /// The nearest voxel to a place.
    fn voxel(&self, at: [i64; 3]) -> &[u8] {
        let [x, y, z] = std::array::from_fn(|axis| at[axis].clamp(0, self.size[axis] as i64 - 1) as u64);
        let place = ((z * self.size[1] + y) * self.size[0] + x) as usize * self.width;
        &self.values[place..place + self.width]
    }
}

/// Looks at every voxel of every page of the stored levels, of values that stand in tiles as they are stored.
fn check_tiles(source: &VolumeSource, channel: u64, time: u64) {
    let geometry = &source.description().geometry;
    let tile = geometry.tile();
    let mut pages = 0;
    for level in 0..geometry.tail().first_level() {
        let voxels = source.levels().level(level);
        let Some(stored) = voxels.stored else { continue };
        let oracle = Stored::new(source.volume(), stored.into(), channel, time);
        for pos in geometry.pages_of_level(level) {
            let texels = block_on(source.read(pos)).unwrap().decode(source.description()).unwrap();
            let first = voxels.first_voxel(pos.coords());
            let wanted = places(tile.map(u64::from));
            for (texel, within) in texels.chunks(oracle.width).zip(wanted) {
                let at = std::array::from_fn(|axis| first[axis] + within[axis] as i64);
                assert_eq!(texel, oracle.voxel(at), "{pos}, voxel {at:?}");
            }
            pages += 1;
        }
    }
    assert!(pages > 0);
}

#[test]
fn fixtures_keep_what_sources_promise() {
    for (name, channel, time) in [
        ("v04-center", 1, 1),
        ("v05-shards", 0, 0),
        ("v3-shards-transposed", 0, 0),
        ("v05-axis-order", 1, 1),
        ("v05-flat", 0, 0),
        ("v2-fortran", 0, 0),
        ("v2-absent", 0, 0),
    ] {
        let volume = Arc::new(volume(&path(&format!("{name}.zip"))));
        let (channel, time) = (channel.min(volume.about().channels - 1), time.min(volume.about().times - 1));
        let options = VolumeOptions { channel, time, brick: 8, ..VolumeOptions::default() };
        let source = VolumeSource::open(volume.clone(), &options).unwrap();
        if source.levels().levels().iter().all(|level| level.is_aligned) {
            assert_eq!(conformance(&source), Ok(()), "{name}");
        }
        // Big enough for pages before the tail, and of values that are not changed by their codes.
        let codes = source.codes();
        if source.description().geometry.tail().first_level() > 0 && codes.is_exact && codes.base == 0.0 {
            check_tiles(&source, channel, time);
        }
    }
}

#[test]
fn halves_conform_and_hold_what_is_stored() {
    let levels = [
        Level::new([75, 50, 33], [20, 20, 20], [1.0, 1.0, 2.5]),
        Level::new([38, 25, 33], [16, 16, 16], [2.0, 2.0, 2.5]),
        Level::new([19, 13, 17], [7, 13, 5], [4.0, 4.0, 5.0]),
    ];
    let (_directory, volume) = random(&levels, |_, _| true);
    let source = source(&volume);
    assert!(source.levels().levels().iter().all(|level| level.is_aligned));
    assert_eq!(source.levels().level(3).size, [10, 7, 9]);
    assert_eq!(conformance(&source), Ok(()));
    check_tiles(&source, 0, 0);
    let states = source.level_states();
    assert_eq!(states.iter().filter(|state| state.is_made).count(), states.len() - 3);
    assert!(
        states.iter().filter_map(|state| state.made).all(|made| made.done == made.total && made.total == 1)
    );
}

#[test]
fn levels_by_any_ratio_hold_what_is_stored() {
    for seed in 0..8 {
        let pick = |salt: u64, count: u64| hash(&[seed, salt]) % count;
        let mut levels = vec![Level::new(
            [40 + pick(0, 40), 20 + pick(1, 60), 10 + pick(2, 30)],
            [17, 9, 11],
            [0.5, 0.7, 3.0],
        )];
        for n in 1..3 {
            let finer = levels[n - 1];
            let ratio: [f64; 3] =
                std::array::from_fn(|axis| 1.0 + pick(10 * n as u64 + axis as u64, 240) as f64 / 100.0);
            levels.push(Level {
                size: std::array::from_fn(|axis| ((finer.size[axis] as f64 / ratio[axis]) as u64).max(1)),
                chunk: [8, 16, 5],
                scale: std::array::from_fn(|axis| finer.scale[axis] * ratio[axis]),
                moved: std::array::from_fn(|axis| finer.moved[axis] + pick(50 + axis as u64, 3) as f64 * 0.3),
            });
        }
        let (_directory, volume) = random(&levels, |level, chunk| {
            !hash(&[seed, level as u64, chunk[0] ^ chunk[1]]).is_multiple_of(4)
        });
        let source = source(&volume);
        check_tiles(&source, 0, 0);
        if source.levels().levels().iter().all(|level| level.is_aligned) {
            assert_eq!(conformance(&source), Ok(()));
        }
    }
}

#[test]
fn labels_keep_every_bit() {
    let volume = Arc::new(volume(&path("v04-center.zip/labels/cells")));
    assert!(volume.about().is_label);
    let options = VolumeOptions { brick: 8, ..VolumeOptions::default() };
    let source = VolumeSource::open(volume, &options).unwrap();
    let layer = &source.description().layers[0];
    assert_eq!((layer.format, layer.is_mixable), (LayerFormat::Rg32Uint, false));
    assert_eq!(conformance(&source), Ok(()));
    check_tiles(&source, 0, 0);
    assert_eq!(source.brick_stats(PagePos::at(0, [0; 3])), None);
}

#[test]
fn what_is_no_source_is_refused() {
    let whole = Arc::new(volume(&path("v04-center.zip")));
    for (options, says) in [
        (VolumeOptions { channel: 2, ..VolumeOptions::default() }, "there are channels 0 to 1"),
        (VolumeOptions { time: 9, ..VolumeOptions::default() }, "there are times 0 to 1"),
        (VolumeOptions { brick: 4, ..VolumeOptions::default() }, "page of 4"),
    ] {
        let error = VolumeSource::open(whole.clone(), &options).map(drop).unwrap_err().to_string();
        assert!(error.contains(says) && error.contains("v04-center.zip"), "{error}");
    }
    let floats = Arc::new(volume(&path("v2-absent.zip")));
    let options = VolumeOptions { labels: Some(true), ..VolumeOptions::default() };
    let error = VolumeSource::open(floats, &options).map(drop).unwrap_err().to_string();
    assert!(error.contains("float32"), "{error}");
}

#[test]
fn pages_without_a_stored_chunk_are_known_before_they_are_read() {
    let levels =
        [Level::new([160, 90, 70], [20, 30, 25], [1.0; 3]), Level::new([80, 45, 35], [20, 30, 25], [2.0; 3])];
    let is_stored =
        |level: usize, chunk: [u64; 3]| hash(&[level as u64, chunk[0], chunk[1], chunk[2]]).is_multiple_of(5);
    let (_directory, volume) = random(&levels, is_stored);
    let source = source(&volume);
    let geometry = &source.description().geometry;
    let contents = source.contents().unwrap();
    assert_eq!(contents.constant(0).unwrap()[..], 3_u16.to_le_bytes());
    let mut absent = 0;
    for level in 0..2 {
        for pos in geometry.pages_of_level(level) {
            // By looking at every voxel that the tile has.
            let of = levels[usize::from(level)];
            let has_stored = places([18; 3]).any(|within| {
                let chunk = std::array::from_fn(|axis| {
                    let at = i64::from(pos.coords()[axis]) * 16 - 1 + within[axis] as i64;
                    at.clamp(0, of.size[axis] as i64 - 1) as u64 / of.chunk[axis]
                });
                is_stored(level.into(), chunk)
            });
            assert_eq!(source.is_absent(pos), !has_stored, "{pos}");
            absent += u32::from(!has_stored);
            let before = volume.chunk_work().decoded;
            let tile = block_on(source.read(pos)).unwrap();
            if !has_stored {
                assert_eq!((tile.codec, &tile.bytes[..]), (Codec::Constant, &[3, 0][..]));
                assert_eq!(volume.chunk_work().decoded, before, "{pos}");
            }
        }
    }
    assert!(absent > 10, "{absent}");
    assert!(!source.is_absent(geometry.tail_pos()));
    assert_eq!(conformance(&source), Ok(()));
}

#[test]
fn a_page_of_a_made_level_is_absent_where_all_is_that_it_is_made_of() {
    let (_directory, volume) =
        random(&[Level::new([256, 64, 64], [16, 64, 64], [1.0; 3])], |_, chunk| chunk[0] > 8);
    let source = source(&volume);
    let absent = |pos: &PagePos| source.is_absent(*pos);
    let geometry = &source.description().geometry;
    // Columns of level 1 below 72 are made of absent chunks; pages have 16, and one of border.
    let found: Vec<PagePos> = geometry.pages_of_level(1).filter(absent).collect();
    assert!(found.len() == 4 * 2 * 2 && found.iter().all(|pos| pos.x < 4), "{found:?}");
    for pos in found {
        assert_eq!(block_on(source.read(pos)).unwrap().codec, Codec::Constant);
    }
}

#[test]
fn a_volume_without_absent_chunks_has_none() {
    let (_directory, volume) = random(&[Level::new([40, 40, 40], [20, 20, 20], [1.0; 3])], |_, _| true);
    assert!(source(&volume).contents().is_none());
}

#[test]
fn threads_that_read_a_level_decode_each_chunk_once() {
    let levels = [
        Level::new([120, 100, 80], [33, 27, 19], [1.0; 3]),
        Level::new([60, 50, 40], [30, 30, 30], [2.0; 3]),
    ];
    let (_directory, volume) = random(&levels, |_, _| true);
    let source = source(&volume);
    let chunks =
        levels.map(|level| (0..3).map(|axis| level.size[axis].div_ceil(level.chunk[axis])).product::<u64>());
    // Levels below were made at opening, from the coarsest that is stored.
    assert_eq!(volume.chunk_work().decoded, chunks[1]);
    let pages: Vec<PagePos> = source.description().geometry.pages_of_level(0).collect();
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let (pages, source) = (&pages, &source);
            scope.spawn(move || {
                for n in 0..pages.len() {
                    block_on(source.read(pages[(n + thread * 3) % pages.len()])).unwrap();
                }
            });
        }
    });
    let work = volume.chunk_work();
    assert_eq!((work.decoded - chunks[1], work.failed), (chunks[0], 0));
    assert_eq!(work.bytes_decoded, chunks[0] * 33 * 27 * 19 * 2 + chunks[1] * 30 * 30 * 30 * 2);
    assert!(work.shared > 10 * chunks[0], "{work:?}");
}

#[test]
fn a_damaged_chunk_costs_its_own_tiles_alone() {
    let level = Level::new([60, 60, 60], [20, 20, 20], [1.0; 3]);
    let (directory, volume) = random(&[level], |_, _| true);
    std::fs::write(directory.path().join("0/1.1.1"), b"damaged").unwrap();
    let source = source(&volume);
    let geometry = &source.description().geometry;
    let (mut sound, mut failed) = (0, 0);
    for pos in geometry.pages_of_level(0) {
        let touches = (0..3).all(|axis| {
            let begin = i64::from(pos.coords()[axis]) * 16 - 1;
            begin < 40 && begin + 18 > 20
        });
        match block_on(source.read(pos)) {
            Ok(_) => sound += 1,
            Err(error) => {
                assert!(touches, "{pos}: {error}");
                assert!(matches!(error, ReadError::Damaged { .. }));
                let error = error.to_string();
                assert!(error.contains("0/1.1.1"), "{error}");
                failed += 1;
            }
        }
    }
    assert!(sound > 0 && failed > 0);
    // The coarser levels are there, without it.
    block_on(source.read(geometry.tail_pos())).unwrap();
    let faults = source.faults();
    assert!(faults.len() == 1 && faults[0].to_string().contains("0/1.1.1"), "{faults:?}");
}

#[test]
fn what_is_known_of_a_brick_is_that_of_its_voxels() {
    let levels =
        [Level::new([50, 41, 33], [20, 20, 20], [1.0; 3]), Level::new([20, 16, 13], [20, 20, 20], [2.5; 3])];
    let (_directory, volume) = random(&levels, |_, _| true);
    let source = source(&volume);
    let oracle = Stored::new(&volume, 0, 0, 0);
    for pos in source.description().geometry.pages_of_level(0) {
        assert_eq!(source.brick_stats(pos), None);
        block_on(source.read(pos)).unwrap();
        let stats = source.brick_stats(pos).unwrap();
        let voxels = places([16; 3]).map(|within| {
            std::array::from_fn::<i64, 3, _>(|axis| i64::from(pos.coords()[axis]) * 16 + within[axis] as i64)
        });
        let inside = voxels.filter(|at| (0..3).all(|axis| at[axis] < oracle.size[axis] as i64));
        let value = |at: &[i64; 3]| u16::from_le_bytes(oracle.voxel(*at).try_into().unwrap());
        let places: Vec<[i64; 3]> = inside.collect();
        let (least, most) =
            (places.iter().map(value).min().unwrap(), places.iter().map(value).max().unwrap());
        assert_eq!((stats.least, stats.most), (least.into(), most.into()));
        assert_eq!(stats.count as usize, places.len());
        let mut histogram = [0; BINS];
        for at in places.iter().filter(|at| at[1] % 4 == 0 && at[2] % 4 == 0) {
            let bin = u64::from(value(at) - least) * BINS as u64 / u64::from((most - least).max(1));
            histogram[bin.min(BINS as u64 - 1) as usize] += 1;
        }
        assert_eq!(stats.histogram, histogram);
    }
}

#[test]
fn a_loader_brings_every_page_and_says_which_it_cannot() {
    let levels =
        [Level::new([70, 60, 50], [20, 20, 20], [1.0; 3]), Level::new([35, 30, 25], [20, 20, 20], [2.0; 3])];
    let (directory, volume) = random(&levels, |_, _| true);
    std::fs::write(directory.path().join("0/0.0.3"), b"damaged").unwrap();
    let source = Arc::new(source(&volume));
    let geometry = &source.description().geometry;
    let texture = TextureNumber::new(5).unwrap();
    let mut loader = Loader::new(4).unwrap();
    loader.add_source(texture, source.clone());
    for (rank, pos) in geometry.pages().enumerate() {
        loader.request(PageId::new(texture, Dims::D3, pos).unwrap(), rank as u64);
    }
    let (mut sound, mut failed) = (0, 0);
    while let Some(loaded) = loader.wait() {
        let pos = loaded.page.pos(Dims::D3);
        match loaded.result {
            Ok(texels) => {
                let tile = block_on(source.read(pos)).unwrap();
                assert_eq!(texels, tile.decode(source.description()).unwrap());
                sound += 1;
            }
            Err(error) => {
                assert!(pos.level == 0 && error.to_string().contains("0/0.0.3"), "{pos}: {error}");
                failed += 1;
            }
        }
    }
    assert_eq!(sound + failed, geometry.page_count());
    assert_eq!(failed, 2 * 2 * 2);
}

#[test]
fn sources_of_one_volume_tell_each_read_once() {
    let volume = Arc::new(volume(&path("v04-center.zip")));
    let sources = [0, 1].map(|channel| {
        let options = VolumeOptions { channel, brick: 8, ..VolumeOptions::default() };
        VolumeSource::open(volume.clone(), &options).unwrap()
    });
    let mut told = Tiers::default();
    for _ in 0..2 {
        for source in &sources {
            for pos in source.description().geometry.pages() {
                block_on(source.read(pos)).unwrap();
            }
        }
        told = Tiers::default();
        sources.iter().for_each(|source| source.add_tiers(&mut told));
    }
    let work = volume.chunk_work();
    assert!(work.decoded > 18 && work.bytes_read > 0 && work.bytes_read < work.bytes_decoded * 2, "{work:?}");
    assert_eq!((told.store.reads, told.store.bytes), (work.decoded, work.bytes_read));
    let chunks = told.chunks;
    assert_eq!((chunks.decoded, chunks.bytes_decoded), (work.decoded, work.bytes_decoded));
    assert_eq!((chunks.shared, chunks.bytes), (work.shared, work.bytes_kept));
    assert!(chunks.shared > 0 && chunks.bytes > chunks.bytes_decoded / 2, "{chunks:?}");
    // Where the one that tells what is kept is gone, another does.
    let [first, second] = sources;
    drop(first);
    let mut told = Tiers::default();
    second.add_tiers(&mut told);
    assert_eq!(told.chunks.bytes, work.bytes_kept);
}
