//! Direct page tables in textures, where no compute shader fills them, grow piece by piece.

use vastex_core::{
    ChangeRule, Geometry, GeometrySpec, PageId, PageNumbering, PagePos, Slot, TableChange, TableEntry,
    TableImage,
};
use vastex_wgpu::{FeedbackWay, TableBuffers, TableChanger, TableChoice};

use crate::common::{GPU, NUMBER, Random};
use crate::tables::words;

const MIB: u64 = 1 << 20;
/// What changes of single pages send, by rows, beside what a table grows by.
const CHANGES: u64 = 512 << 10;
const TAIL: Slot = Slot::new(70_000);

struct Growing {
    geometry: Geometry,
    changer: TableChanger,
    table: TableBuffers,
    /// What it must say.
    image: TableImage,
    /// As it lay before.
    before: Option<Box<TableBuffers>>,
    loaded: u32,
}

impl Growing {
    /// Of so many texels a side, in pages of 8.
    fn new(side: u32) -> Growing {
        let geometry = Geometry::new(GeometrySpec { page: 8, ..GeometrySpec::image(side, side) }).unwrap();
        let (device, queue, way) = (&GPU.device, &GPU.queue, FeedbackWay::Raw);
        let table =
            TableBuffers::new(device, queue, &geometry, NUMBER, TAIL, TableChoice::Direct, way).unwrap();
        let image = TableImage::new(&geometry, TAIL);
        let changer = TableChanger::new(device, way);
        Growing { geometry, changer, table, image, before: None, loaded: 0 }
    }

    /// A page of a level comes that was not there.
    fn load(&mut self, level: u8) -> TableChange {
        self.loaded += 1;
        let [width, height, _] = self.geometry.level(level).pages;
        let mut random = Random(u64::from(self.loaded));
        let [x, y] = [width, height].map(|pages| random.below(pages as usize) as u32);
        let entry = TableEntry::new(level, Slot::new(self.loaded));
        let page = PageId::new(NUMBER, self.geometry.dims(), PagePos::new_2d(level, x, y)).unwrap();
        TableChange { page, rule: ChangeRule::Coarser, entry }
    }

    /// A frame with such a load, and so many bytes of what the table grows by; how many it sent.
    fn frame(&mut self, level: u8, mut budget: u64) -> u64 {
        let change = self.load(level);
        self.image.apply(&self.geometry, &change);
        let (device, queue) = (&GPU.device, &GPU.queue);
        let mut encoder = device.create_command_encoder(&Default::default());
        let Growing { changer, table, before, .. } = self;
        let applied = changer.grow(device, queue, &mut encoder, table, level, &[change], &[]).unwrap();
        assert!(applied.before.is_none(), "it lies where it lay until there is more of it elsewhere");
        if let Some(before) = before {
            changer.follow(device, queue, &mut encoder, table, before, &[change]).unwrap();
        }
        let grown = changer.go_on(device, queue, &mut encoder, table, &mut budget).unwrap();
        if grown.before.is_some() {
            *before = grown.before;
        }
        queue.submit([encoder.finish()]);
        applied.bytes + grown.bytes
    }

    /// Whether a table with room for the levels from `begin` on says what it must of those from `filled` on.
    fn is_right(&self, table: &TableBuffers, begin: u8, filled: u8) -> bool {
        let layout = PageNumbering::new(&self.geometry);
        let [begin, filled] = [begin, filled].map(|level| layout.first_entry(level) as usize);
        let found = words(table);
        let expected = self.image.entries()[filled..].iter().map(|entry| entry.to_bits());
        found[filled - begin..].iter().copied().take(expected.len()).eq(expected)
    }
}

#[test]
fn a_table_grows_by_a_mebibyte_a_frame_and_each_level_is_right_as_soon_as_it_is_looked_up() {
    let mut world = Growing::new(8192);
    let begins = world.table.finest();
    let sent: u64 = (0..4).map(|_| world.frame(begins, MIB)).sum();
    assert!(sent < MIB);
    assert!(!world.table.is_growing() && world.is_right(&world.table, begins, begins));
    let mut levels = vec![begins];
    for frame in 0.. {
        let sent = world.frame(if frame % 3 == 0 { 0 } else { begins }, MIB);
        assert!(sent <= MIB + CHANGES, "frame {frame}: {sent} bytes");
        let level = world.table.finest();
        assert!(level <= levels[levels.len() - 1], "no level goes again");
        levels.push(level);
        match &world.before {
            None => assert!(world.is_right(&world.table, begins, level), "frame {frame}"),
            Some(before) => {
                assert!(world.is_right(&world.table, 0, level), "frame {frame}: from level {level} on");
                assert!(world.is_right(before, begins, begins), "frame {frame}: as it lay before");
            }
        }
        if !world.table.is_growing() {
            break;
        }
        assert!(frame < 20, "{levels:?}");
    }
    levels.dedup();
    // 5.3 MiB: the fourth part of that without level 0, and so on.
    assert!(levels.len() > 3 && levels.ends_with(&[1, 0]), "coarse levels come first: {levels:?}");
}

#[test]
fn a_level_that_comes_while_a_table_grows_is_grown_to_afterwards() {
    let mut world = Growing::new(2048);
    assert!(world.table.finest() > 2);
    world.frame(2, 4096);
    assert!(world.table.is_growing() && world.table.has_level(2) && !world.table.has_level(1));
    let mut levels = Vec::new();
    while world.table.is_growing() || levels.is_empty() {
        world.frame(0, 8192);
        levels.push(world.table.finest());
        assert!(levels.len() < 80, "{levels:?}");
    }
    levels.dedup();
    assert!(levels.ends_with(&[2, 1, 0]), "{levels:?}");
    assert!(world.is_right(&world.table, 0, 0));
}

/// Growing by 4 Mi entries takes as many frames as mebibytes, and few more.
#[test]
fn the_largest_table_is_there_after_as_many_frames_as_mebibytes() {
    let mut world = Growing::new(16384);
    let (mut frames, mut sent) = (0, 0);
    while world.table.is_growing() || frames == 0 {
        let bytes = world.frame(0, MIB);
        assert!(bytes <= MIB + CHANGES, "{bytes} bytes");
        (frames, sent) = (frames + 1, sent + bytes);
    }
    let bytes = 4 * PageNumbering::new(&world.geometry).entries();
    assert!(sent >= bytes && frames <= bytes.div_ceil(MIB) + 1, "{frames} frames, {sent} bytes of {bytes}");
}
