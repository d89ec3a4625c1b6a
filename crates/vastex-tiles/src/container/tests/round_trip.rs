//! What is written is read; identical and constant tiles are stored once; files appear whole or not at all.

use std::io::{self, Cursor, Seek, SeekFrom, Write};

use pollster::block_on;
use proptest::prelude::*;
use vastex_core::{LayerFormat, PagePos};

use crate::testing::textures::{any_description, container_bytes, image, memory, open, texels};
use crate::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_page_reads_as_it_was_written(
        description in any_description(),
        compression in prop::sample::select(vec![Compression::None, Compression::Lz4, Compression::Zstd(1)]),
        seed: u64,
    ) {
        let container = open(container_bytes(&description, compression, seed));
        prop_assert_eq!(&**container.description(), &description);
        for pos in description.geometry.pages() {
            let tile = block_on(container.read(pos)).unwrap();
            prop_assert_eq!(tile.decode(&description).unwrap(), texels(&description, pos, seed));
        }
        let verification = block_on(verify(container.store().clone(), |_, _| {}));
        prop_assert_eq!(verification.faults, []);
        let info = container.info();
        prop_assert_eq!(info.tiles, description.geometry.page_count());
        prop_assert_eq!(info.tiles, info.stored_tiles + info.constant_tiles + info.shared_tiles);
    }
}

#[test]
fn identical_tiles_are_stored_once_and_constant_tiles_in_the_index() {
    let description = image(40, 40, 8, LayerFormat::R8);
    let mut writer = ContainerWriter::new(
        Cursor::new(Vec::new()),
        "memory",
        description.clone(),
        WriterOptions::default(),
    )
    .unwrap();
    let gradient: Vec<u8> = (0..100).collect();
    for pos in description.geometry.pages() {
        let texels = if pos.level == 0 { vec![pos.x as u8 % 2; 100] } else { gradient.clone() };
        writer.write_tile(pos, &texels).unwrap();
    }
    let (out, written) = writer.complete().unwrap();
    let info = open(out.into_inner()).info();
    assert_eq!((info.constant_tiles, info.stored_tiles), (25, 1));
    assert_eq!(info.shared_tiles, info.tiles - 26);
    assert_eq!((written.constant_tiles, written.shared_tiles), (info.constant_tiles, info.shared_tiles));
    assert_eq!((written.tiles, written.bytes), (info.tiles, info.bytes));
}

#[test]
fn coarse_tiles_need_no_read_after_opening() {
    let description = image(300, 300, 8, LayerFormat::R8);
    let bytes = container_bytes(&description, Compression::None, 7);
    let container = open(bytes.clone());
    let coarse = container.header().coarse_offset..container.header().index.extent.offset;
    assert!(coarse.end > coarse.start);
    let tail = container.index().record_of_page(0).unwrap();
    let tail = container.index().record(tail).unwrap();
    assert!(tail.codec == Codec::Constant || coarse.contains(&tail.section.extent.offset));
}

#[test]
fn reads_of_the_file_are_counted_and_a_cache_in_front_saves_them() {
    let description = image(2000, 2000, 64, LayerFormat::R8); // too many bytes to be kept from opening
    let cache = RamCache::new(open(container_bytes(&description, Compression::None, 7)), u64::MAX);
    let tiers = || {
        let mut tiers = Tiers::default();
        cache.add_tiers(&mut tiers);
        tiers
    };
    assert_eq!(tiers(), Tiers::default(), "opening is not counted");
    block_on(cache.read(description.geometry.tail_pos())).unwrap();
    assert_eq!((tiers().store, tiers().ram.misses), (StoreStats::default(), 1), "the tail is at hand");
    let fine: Vec<PagePos> = description.geometry.pages().filter(|pos| pos.level == 0).collect();
    let mut stored = 0;
    for pos in fine.iter().chain(&fine) {
        let tile = block_on(cache.read(*pos)).unwrap();
        stored += if tile.codec == Codec::Constant { 0 } else { tile.bytes.len() as u64 };
    }
    let Tiers { ram, disk, store, chunks } = tiers();
    assert_eq!(chunks, ChunkStats::default());
    assert_eq!(
        (ram.hits, ram.misses, disk),
        (fine.len() as u64, 1 + fine.len() as u64, TierStats::default())
    );
    // Constant tiles are in the index; the others are read once.
    assert_eq!((store.bytes, store.reads), (stored / 2, stored / 2 / description.tile_bytes() as u64));
    assert!(store.reads > 100);
}

#[test]
fn the_file_depends_on_nothing_but_the_tiles() {
    let description = image(100, 70, 16, LayerFormat::Rgba8);
    let write = || container_bytes(&description, Compression::Lz4, 3);
    assert_eq!(write(), write());
}

#[test]
fn pages_may_be_missing_but_the_tail_not() {
    let description = image(40, 40, 8, LayerFormat::R8);
    let begin = || {
        let out = Cursor::new(Vec::new());
        ContainerWriter::new(out, "memory", description.clone(), WriterOptions::default()).unwrap()
    };
    let error = begin().complete().unwrap_err().to_string();
    assert!(error.contains("it has no tail"), "{error}");
    let mut writer = begin();
    writer.write_tile(description.geometry.tail_pos(), &[5; 100]).unwrap();
    let bytes = writer.complete().unwrap().0.into_inner();
    assert_eq!(block_on(verify(memory(bytes.clone()), |_, _| {})).faults, []);
    let container = open(bytes);
    assert_eq!(container.info().tiles, 1);
    for pos in [PagePos::new_2d(0, 0, 0), PagePos::new_2d(0, 99, 0), PagePos::new_2d(31, 0, 0)] {
        assert!(matches!(block_on(container.read(pos)), Err(ReadError::NoSuchTile { pos: p }) if p == pos));
    }
}

#[test]
fn tiles_that_do_not_belong_are_refused() {
    let description = image(40, 40, 8, LayerFormat::R8);
    let out = Cursor::new(Vec::new());
    let mut writer = ContainerWriter::new(out, "memory", description, WriterOptions::default()).unwrap();
    let pos = PagePos::new_2d(0, 1, 1);
    writer.write_tile(pos, &[0; 100]).unwrap();
    let mut refused = |pos, len| writer.write_tile(pos, &vec![0; len]).unwrap_err().to_string();
    assert_eq!(refused(pos, 100), "memory: level 0 page 1,1: the page has a tile already");
    assert!(refused(PagePos::new_2d(0, 1, 2), 99).ends_with("a tile of 99 bytes where 100 are expected"));
    assert!(refused(PagePos::new_2d(0, 5, 0), 100).ends_with("there is no such page"));
}

#[test]
fn a_file_appears_whole_or_not_at_all() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.vastex");
    let names = || std::fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().file_name()).collect::<Vec<_>>();
    let description = image(40, 40, 8, LayerFormat::R8);
    let begin = || ContainerWriter::create(&path, description.clone(), WriterOptions::default()).unwrap();
    let mut writer = begin();
    writer.write_tile(description.geometry.tail_pos(), &[1; 100]).unwrap();
    assert!(!path.exists() && writer.temp_path().exists());
    drop(writer);
    assert_eq!(names().len(), 0);
    assert!(begin().finish().is_err());
    assert_eq!(names().len(), 0);
    let options = WriterOptions { durable: true, ..WriterOptions::default() };
    let mut writer = ContainerWriter::create(&path, description.clone(), options).unwrap();
    writer.write_tile(description.geometry.tail_pos(), &[1; 100]).unwrap();
    let written = writer.finish().unwrap();
    assert_eq!(names(), ["a.vastex"]);
    assert_eq!(Container::open_file(&path).unwrap().info().bytes, written.bytes);
}

#[test]
fn places_that_cannot_be_written_are_refused_at_once() {
    let dir = tempfile::tempdir().unwrap();
    let description = image(40, 40, 8, LayerFormat::R8);
    for path in [dir.path().to_owned(), dir.path().join("none/a.vastex"), "/".into()] {
        let error =
            ContainerWriter::create(&path, description.clone(), WriterOptions::default()).unwrap_err();
        assert!(error.to_string().contains("cannot be written"), "{error}");
    }
}

/// Takes so many bytes and no more, as a full disk does.
#[derive(Debug)]
struct FullDisk(Cursor<Vec<u8>>, usize);

impl Write for FullDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let room = self.1.saturating_sub(self.0.get_ref().len());
        if room == 0 {
            Err(io::ErrorKind::StorageFull.into())
        } else {
            self.0.write(&bytes[..bytes.len().min(room)])
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for FullDisk {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.0.seek(to)
    }
}

#[test]
fn a_full_disk_is_an_error_wherever_it_strikes() {
    let description = image(100, 100, 8, LayerFormat::R8);
    let write = |room| -> Result<Written, WriteError> {
        let out = FullDisk(Cursor::new(Vec::new()), room);
        let mut writer = ContainerWriter::new(out, "disk", description.clone(), WriterOptions::default())?;
        let failed = description
            .geometry
            .pages()
            .find_map(|pos| writer.write_tile(pos, &texels(&description, pos, 1)).err());
        // Whoever goes on after a failure gets no container.
        let finished = writer.complete().map(|(_, written)| written);
        assert!(failed.is_none() || finished.is_err());
        finished
    };
    let whole = write(usize::MAX).unwrap().bytes as usize;
    for room in (0..whole).step_by(997).chain([whole - 1]) {
        assert!(write(room).is_err(), "{room} bytes of {whole}");
    }
}
