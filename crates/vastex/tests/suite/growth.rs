//! A page table that grows where nothing can fill it on the GPU: a little in each frame, coarse levels first.

use vastex::{AddressMode, Dims, Event, FeedbackMode, PoolSettings, Settings, TableChoice, TextureSettings};
use vastex_tiles::PropertySource;

use crate::common::texts::telling;
use crate::common::{Mapping, PICTURE, Screen, add_with, property, settings};

/// 1024 x 1024 pages of level 0: 5.3 MiB of entries.
const SIZE: [u32; 2] = [16384, 16384];
const PAGE: u32 = 16;
const TILE: u64 = 24 * 24 * 4;
const MIB: u64 = 1 << 20;

fn screen(mode: FeedbackMode) -> Screen {
    let pools = PoolSettings::of_bytes(900 * TILE);
    let mut screen =
        Screen::showing(Settings { feedback: Some(mode), pools, ..settings() }, &telling(), |textures| {
            let settings = TextureSettings { page_table: TableChoice::Direct, ..Default::default() };
            add_with(textures, property(SIZE, PAGE, AddressMode::Clamp), settings).unwrap()
        });
    screen.set_mapping(0, &Mapping::new(SIZE, [0.4, 0.6], 0.9, 1.0, 0.3));
    screen
}

/// Frames until nothing is missing; the sum of the levels that the pixels of each show, and the bytes of page
/// tables that each sent.
fn play(screen: &mut Screen) -> Vec<(u32, u64)> {
    let (mut frames, mut most) = (Vec::new(), 0);
    for _ in 0..300 {
        let before = screen.textures.stats().table_bytes_sent;
        let wanted = screen.record_wanted(PICTURE);
        screen.gpu.queue.submit([wanted.finish()]);
        screen.textures.update().unwrap();
        let stats = screen.textures.stats();
        let sent = stats.table_bytes_sent - before;
        most = stats.table_bytes.max(most);
        let level = |colour: &[u8; 4]| u32::from(PropertySource::texel_from_color(Dims::D2, *colour).0);
        frames.push((screen.picture().iter().map(level).sum(), sent));
        while let Some(event) = screen.textures.poll_event() {
            if matches!(event, Event::Converged { .. }) {
                // Where the table lay before counts for as long as it is kept.
                assert!(most > stats.table_bytes, "{most} bytes at most, {} at last", stats.table_bytes);
                return frames;
            }
        }
    }
    panic!("not converged: {:?}", screen.textures.stats());
}

#[test]
fn on_the_floor_a_table_grows_by_a_mebibyte_a_frame_and_the_picture_with_it() {
    let [mut floor, mut control] = [FeedbackMode::Raw, FeedbackMode::Separate].map(screen);
    let frames = play(&mut floor);
    play(&mut control);
    assert!(floor.picture() == control.picture());
    // Of single pages whole rows are sent, beside what it grows by.
    let most = frames.iter().map(|(_, sent)| *sent).max().unwrap();
    assert!(most <= MIB + MIB / 2, "{most} bytes in a frame");
    let large = frames.iter().filter(|(_, sent)| *sent > MIB / 2).count();
    assert!(large >= 5, "{large} frames sent much of 5.3 MiB");
    // It is never coarser than it was, and becomes sharp by more than one step while the table grows.
    assert!(frames.windows(2).all(|pair| pair[1].0 <= pair[0].0), "{frames:?}");
    let mut steps: Vec<u32> = frames.iter().map(|(level, _)| *level).collect();
    steps.dedup();
    // Of pages of which only a corner is in view feedback may know nothing.
    assert!(steps.len() > 3 && steps.last() < Some(&20), "{steps:?}");
}
