//! Files changed in place: the new tiles are read, the old ones stay, and a change cut off at any write
//! changes nothing.

use std::io::{self, Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex};

use pollster::block_on;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use vastex_core::{Description, LayerFormat, PagePos};

use crate::container::format::layout::HEADER_BYTES;
use crate::container::write::update::Medium;
use crate::testing::textures::{any_description, container_bytes, image, memory, open, texels};
use crate::*;

/// A file in memory that remembers what it was after every write, and after a part of it.
#[derive(Clone, Default)]
struct Recorder(Arc<Mutex<Recording>>);

#[derive(Default)]
struct Recording {
    bytes: Vec<u8>,
    at: usize,
    states: Vec<Vec<u8>>,
    /// Writes until the disk is full.
    writes_left: Option<usize>,
    /// What was asked of the disk, in order.
    steps: Vec<Step>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Step {
    /// Bytes behind the header.
    Append,
    /// A header copy.
    Header,
    Sync,
}

impl Recorder {
    fn of(bytes: &[u8]) -> Recorder {
        let recorder = Recorder::default();
        recorder.0.lock().unwrap().bytes = bytes.to_vec();
        recorder
    }

    fn bytes(&self) -> Vec<u8> {
        self.0.lock().unwrap().bytes.clone()
    }

    fn update(&self) -> ContainerUpdate {
        self.durable_update(false)
    }

    fn durable_update(&self, durable: bool) -> ContainerUpdate {
        ContainerUpdate::new(Box::new(self.clone()), Arc::new(open(self.bytes())), durable).unwrap()
    }
}

impl Recording {
    fn put(&mut self, at: usize, bytes: &[u8]) {
        self.bytes.resize(self.bytes.len().max(at + bytes.len()), 0);
        self.bytes[at..at + bytes.len()].copy_from_slice(bytes);
        self.states.push(self.bytes.clone());
    }
}

impl Write for Recorder {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut file = self.0.lock().unwrap();
        if let Some(left) = &mut file.writes_left {
            *left = left.checked_sub(1).ok_or(io::ErrorKind::StorageFull)?;
        }
        let at = file.at;
        file.steps.push(if (at as u64) < HEADER_BYTES { Step::Header } else { Step::Append });
        // Short enough to tear a header copy, of which a fifth says something.
        file.put(at, &bytes[..bytes.len() / 8]);
        file.put(at, bytes);
        file.at += bytes.len();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Recorder {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let SeekFrom::Start(at) = to else { return Err(io::ErrorKind::Unsupported.into()) };
        self.0.lock().unwrap().at = at as usize;
        Ok(at)
    }
}

impl Medium for Recorder {
    fn truncate(&mut self, len: u64) -> io::Result<()> {
        self.0.lock().unwrap().bytes.truncate(len as usize);
        Ok(())
    }

    fn sync(&mut self) -> io::Result<()> {
        self.0.lock().unwrap().steps.push(Step::Sync);
        Ok(())
    }
}

fn faults(bytes: Vec<u8>) -> Vec<Fault> {
    block_on(verify(memory(bytes), |_, _| {})).faults
}

/// The seed of a page's texels after every change listed: which pages, and from then on which seed.
fn seed_of(pos: PagePos, changes: &[(u32, u64)]) -> u64 {
    let number = u32::from(pos.level) * 7 + pos.x * 3 + pos.y * 5 + pos.z;
    changes.iter().rev().find(|(divisor, _)| number.is_multiple_of(*divisor)).map_or(1, |(_, seed)| *seed)
}

fn change(recorder: &Recorder, changes: &[(u32, u64)]) -> Updated {
    carry_out(recorder.update(), changes)
}

fn carry_out(mut update: ContainerUpdate, changes: &[(u32, u64)]) -> Updated {
    let description = Description::clone(update.container().description());
    let (last, seed) = changes[changes.len() - 1];
    for pos in description.geometry.pages().filter(|&pos| seed_of(pos, &[(last, 2)]) == 2) {
        let tile = EncodedTile::new(texels(&description, pos, seed).into(), &description, Compression::Lz4);
        update.replace(pos, tile).unwrap();
    }
    update.commit().unwrap()
}

fn check(bytes: &[u8], changes: &[(u32, u64)]) {
    let container = open(bytes.to_vec());
    for pos in container.description().geometry.pages() {
        let tile = block_on(container.read(pos)).unwrap().decode(container.description()).unwrap();
        assert!(tile == texels(container.description(), pos, seed_of(pos, changes)), "{pos}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, rng_seed: RngSeed::Fixed(5), failure_persistence: None, ..Default::default() })]

    #[test]
    fn every_version_has_the_tiles_that_it_was_given(
        description in any_description(),
        changes in prop::collection::vec((1u32..9, 2u64..100), 1..4),
    ) {
        let recorder = Recorder::of(&container_bytes(&description, Compression::Lz4, 1));
        for n in 1..=changes.len() {
            let before = recorder.bytes();
            let updated = change(&recorder, &changes[..n]);
            let after = recorder.bytes();
            check(&after, &changes[..n]);
            prop_assert_eq!(faults(after.clone()), vec![]);
            prop_assert_eq!(updated.bytes, after.len() as u64);
            prop_assert_eq!(updated.bytes_added, (after.len() - before.len()) as u64);
            prop_assert!(after[1024..before.len()] == before[1024..], "bytes of the version before were changed");
        }
    }
}

#[test]
fn cut_off_at_any_write_a_change_leaves_the_version_before_it() {
    let description = image(150, 90, 16, LayerFormat::Rgba8);
    let recorder = Recorder::of(&container_bytes(&description, Compression::Lz4, 1));
    let changes = [(2, 7), (3, 8), (2, 9)];
    for n in 1..=changes.len() {
        recorder.0.lock().unwrap().states.clear();
        change(&recorder, &changes[..n]);
        let states = recorder.0.lock().unwrap().states.clone();
        let (last, earlier) = states.split_last().unwrap();
        assert!(earlier.len() > 10);
        for state in earlier {
            check(state, &changes[..n - 1]);
        }
        check(last, &changes[..n]);
        // The next change takes away what this one would have left behind.
        let cut_off = Recorder::of(&earlier[earlier.len() / 2]);
        change(&cut_off, &changes[..n]);
        assert!(cut_off.bytes() == *last);
    }
}

/// A header that the disk has before what it names would cost the file with the next loss of power.
#[test]
fn the_disk_has_all_that_is_appended_before_the_header_that_names_it() {
    let description = image(150, 90, 16, LayerFormat::Rgba8);
    let recorder = Recorder::of(&container_bytes(&description, Compression::Lz4, 1));
    type Begin = fn(&Recorder) -> ContainerUpdate;
    let cases: [(Begin, &[Step], &[Step]); 3] = [
        (|recorder| recorder.durable_update(false), &[Step::Sync], &[]),
        (|recorder| recorder.durable_update(true), &[Step::Sync], &[Step::Sync]),
        (|recorder| recorder.update().without_waiting(), &[], &[]),
    ];
    let mut changes = Vec::new();
    for (seed, (begin, before_header, after_header)) in (7..).zip(cases) {
        recorder.0.lock().unwrap().steps.clear();
        changes.push((2, seed));
        carry_out(begin(&recorder), &changes);
        let steps = recorder.0.lock().unwrap().steps.clone();
        let appended = steps.iter().rposition(|step| *step == Step::Append).unwrap();
        assert!(appended > 10 && steps[..appended].iter().all(|step| *step == Step::Append), "{steps:?}");
        assert_eq!(steps[appended + 1..], [before_header, &[Step::Header], after_header].concat());
        check(&recorder.bytes(), &changes);
    }
}

#[test]
fn every_flipped_bit_of_a_changed_file_is_found() {
    let recorder = Recorder::of(&container_bytes(&image(30, 20, 8, LayerFormat::R8), Compression::Lz4, 1));
    change(&recorder, &[(3, 2)]);
    change(&recorder, &[(3, 2), (2, 3)]);
    let changed = recorder.bytes();
    for bit in 0..changed.len() * 8 {
        let mut bytes = changed.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(!faults(bytes).is_empty(), "bit {} of byte {} of {}", bit % 8, bit / 8, changed.len());
    }
}

#[test]
fn a_full_disk_is_an_error_and_leaves_the_file_as_it_was() {
    let before = container_bytes(&image(150, 90, 16, LayerFormat::R8), Compression::Lz4, 1);
    for writes in 0..4 {
        let recorder = Recorder::of(&before);
        recorder.0.lock().unwrap().writes_left = Some(writes);
        let mut update = recorder.update();
        let description = Description::clone(update.container().description());
        let replaced = description.geometry.pages().try_for_each(|pos| {
            let texels = texels(&description, pos, 50 + u64::from(pos.x));
            update.replace(pos, EncodedTile::new(texels.into(), &description, Compression::Lz4))
        });
        let error = replaced.and_then(|()| update.commit().map(drop)).unwrap_err().to_string();
        assert!(error.contains("memory: cannot be written") && error.contains("free space"), "{error}");
        assert!(recorder.bytes() == before);
    }
}

#[test]
fn readers_keep_their_version_and_one_program_changes_at_a_time() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.vastex");
    let description = image(200, 100, 16, LayerFormat::R8);
    std::fs::write(&path, container_bytes(&description, Compression::Lz4, 1)).unwrap();
    let reader = Container::open_file(&path).unwrap();
    let mut update = ContainerUpdate::open(&path, true).unwrap();
    if cfg!(unix) {
        let error = ContainerUpdate::open(&path, false).unwrap_err();
        assert!(matches!(error, UpdateError::Busy { .. }), "{error}");
    }
    for pos in description.geometry.pages() {
        let tile = EncodedTile::new(texels(&description, pos, 2).into(), &description, Compression::Lz4);
        update.replace(pos, tile).unwrap();
    }
    update.commit().unwrap();
    for (container, seed) in [(&reader, 1), (&Container::open_file(&path).unwrap(), 2)] {
        for pos in description.geometry.pages() {
            let tile = block_on(container.read(pos)).unwrap().decode(&description).unwrap();
            assert!(tile == texels(&description, pos, seed));
        }
    }
}

#[test]
fn tiles_that_do_not_belong_are_refused() {
    let description = image(40, 40, 8, LayerFormat::R8);
    let recorder = Recorder::of(&container_bytes(&description, Compression::Lz4, 1));
    let mut update = recorder.update();
    let tile = |len| EncodedTile::new(vec![1; len].into(), &description, Compression::None);
    let mut refused = |pos, len| update.replace(pos, tile(len)).unwrap_err().to_string();
    assert!(refused(PagePos::new_2d(0, 9, 0), 100).contains("no such page"));
    assert!(refused(PagePos::new_2d(0, 1, 0), 99).contains("99 bytes where 100"));
    update.replace(PagePos::new_2d(0, 1, 0), tile(100)).unwrap();
    let error = update.replace(PagePos::new_2d(0, 1, 0), tile(100)).unwrap_err().to_string();
    assert!(error.contains("has a new tile already"), "{error}");
}

#[test]
fn a_change_of_nothing_writes_nothing_and_cuts_off_what_another_left() {
    let before = container_bytes(&image(150, 90, 16, LayerFormat::R8), Compression::Lz4, 1);
    let recorder = Recorder::of(&[&before[..], &[7; 1000]].concat());
    let updated = recorder.update().commit().unwrap();
    assert_eq!((updated.tiles, updated.bytes_added, updated.bytes), (0, 0, before.len() as u64));
    assert!(recorder.bytes() == before);
}

#[test]
fn what_an_interrupted_change_left_is_no_fault_and_hides_none() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.vastex");
    let whole = container_bytes(&image(30, 20, 8, LayerFormat::R8), Compression::Lz4, 1);
    let verified = |bytes: &[u8]| {
        std::fs::write(&path, [bytes, &[7; 1000]].concat()).unwrap();
        verify_file(&path, |_, _| {}).unwrap()
    };
    let found = verified(&whole);
    assert_eq!((&found.faults[..], found.leftover_bytes, found.being_changed), (&[][..], 1000, false));
    for at in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (at % 8);
        assert!(!verified(&bytes).faults.is_empty(), "byte {at} of {}", whole.len());
    }
}

#[cfg(unix)]
#[test]
fn while_a_file_is_changed_the_version_before_is_verified() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.vastex");
    let description = image(2000, 1500, 128, LayerFormat::R8);
    std::fs::write(&path, container_bytes(&description, Compression::Lz4, 1)).unwrap();
    let mut update = ContainerUpdate::open(&path, false).unwrap();
    for pos in description.geometry.pages() {
        let tile = EncodedTile::new(texels(&description, pos, 2).into(), &description, Compression::Lz4);
        update.replace(pos, tile).unwrap();
    }
    let found = verify_file(&path, |_, _| {}).unwrap();
    assert!(found.being_changed && found.leftover_bytes > 0 && found.faults.is_empty(), "{found:?}");
    // Met in the middle of the write that ends the change.
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, [&whole[..530], &[9; 20], &whole[550..]].concat()).unwrap();
    assert_eq!(verify_file(&path, |_, _| {}).unwrap().faults, []);
    update.commit().unwrap();
    let found = verify_file(&path, |_, _| {}).unwrap();
    assert!(!found.being_changed && found.leftover_bytes == 0 && found.faults.is_empty(), "{found:?}");
    // And no change begins while the file is verified.
    let mut refusal = None;
    verify_file(&path, |_, _| refusal = ContainerUpdate::open(&path, false).err()).unwrap();
    assert!(matches!(refusal, Some(UpdateError::Busy { .. })), "{refusal:?}");
}

/// As on a file system without locks.
#[test]
fn of_two_changes_at_once_the_second_is_refused_and_cuts_nothing() {
    let description = image(150, 90, 16, LayerFormat::Rgba8);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("c.vastex");
    std::fs::write(&path, container_bytes(&description, Compression::Lz4, 1)).unwrap();
    let begin = || {
        let file = std::fs::OpenOptions::new().read(true).write(true).open(&path).unwrap();
        ContainerUpdate::new(Box::new(file), Arc::new(Container::open_file(&path).unwrap()), false).unwrap()
    };
    let give = |update: &mut ContainerUpdate, seed: u64| {
        let pos = PagePos::new_2d(0, 1, 1);
        let tile = EncodedTile::new(texels(&description, pos, seed).into(), &description, Compression::Lz4);
        update.replace(pos, tile)
    };
    let (mut first, mut second, third) = (begin(), begin(), begin());
    give(&mut first, 2).unwrap();
    first.commit().unwrap();
    let after = std::fs::read(&path).unwrap();
    let refused = give(&mut second, 3).and_then(|()| second.commit().map(drop)).unwrap_err();
    assert!(
        matches!(refused, UpdateError::Busy { .. } | UpdateError::Write(WriteError::InUse { .. })),
        "{refused}"
    );
    drop(third);
    assert!(std::fs::read(&path).unwrap() == after);
    assert_eq!(faults(after), []);
}
