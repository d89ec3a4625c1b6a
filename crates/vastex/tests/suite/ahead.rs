//! Frames that are recorded ahead of those that are submitted, while page tables grow, pages leave, pools are
//! resized and textures come and go: every picture shows what is where it looks, and at last all of it.

use std::collections::VecDeque;

use vastex::{FeedbackMode, PoolId, TableChoice, ViewId};

use crate::common::{Mapping, PICTURE, Screen};
use crate::moving::{Case, SIZES, beside, check_counts, columns, flight, wrong_in_all, wrong_pixels};

const POOL: PoolId = PoolId::new(0);
/// Frames that are recorded before the first of them is submitted, at most.
const AHEAD: usize = 2;
const FRAMES: u32 = 66;

/// A frame as it was recorded.
struct Recorded {
    wanted: wgpu::CommandEncoder,
    picture: wgpu::CommandEncoder,
    /// The same picture in commands of its own.
    again: wgpu::CommandEncoder,
    copies: [wgpu::Buffer; 2],
    /// The texture beside, if it is shown.
    other: Option<vastex::TextureId>,
}

fn record(screen: &mut Screen, other: Option<vastex::TextureId>) -> Recorded {
    let wanted = screen.record_wanted(PICTURE);
    screen.textures.update().unwrap();
    let mut picture = screen.record_picture(PICTURE);
    let copy = screen.copy_picture(&mut picture);
    let (again, second) = screen.record_copy();
    Recorded { wanted, picture, again, copies: [copy, second], other }
}

/// In two parts or at once, and the picture twice; where the camera is the queue has been told meanwhile.
fn submit(screen: &Screen, recorded: Recorded, is_in_parts: bool) -> [Vec<[u8; 4]>; 2] {
    let Recorded { wanted, picture, again, copies, .. } = recorded;
    let queue = &screen.gpu.queue;
    if is_in_parts {
        queue.submit([wanted.finish()]);
        queue.submit([picture.finish()]);
        queue.submit([again.finish()]);
    } else {
        queue.submit([wanted.finish(), picture.finish(), again.finish()]);
    }
    copies.map(|copy| screen.read_copy(&copy))
}

/// Of a texture that is gone, pixels show the colour of what nobody knows.
fn check_gone(picture: &[[u8; 4]], frame: u32) {
    let is_unknown = |(n, colour): (u32, &[u8; 4])| {
        !columns(1).contains(&(n % PICTURE[0])) || *colour == [255, 0, 255, 255]
    };
    assert!((0..).zip(picture).all(is_unknown), "frame {frame}");
}

fn recorded_ahead(case: Case) {
    let mut screen = case.screen(70);
    let mut other = Some(screen.texture(1));
    let mut behind = VecDeque::new();
    let mut bind_group = screen.textures.bind_group(screen.texture(0)).unwrap().clone();
    let (mut grown, mut outlived) = (0, 0);
    for frame in 0..FRAMES {
        match frame {
            30 => drop(screen.textures.memory().resize_pool(POOL, case.pool_bytes(110)).unwrap()),
            40 => {
                screen.remove(1);
                other = None;
            }
            46 => {
                screen.replace_with(1, |textures| case.add(textures, 1));
                screen.set_mapping(1, &beside());
                other = Some(screen.texture(1));
            }
            60 => drop(screen.textures.memory().resize_pool(POOL, case.pool_bytes(60)).unwrap()),
            _ => {}
        }
        let mapping: Mapping = flight(frame);
        screen.set_mapping(0, &mapping);
        behind.push_back(record(&mut screen, other));
        let now = screen.textures.bind_group(screen.texture(0)).unwrap().clone();
        grown += u32::from(now != bind_group && !matches!(frame, 30 | 60));
        bind_group = now;
        if behind.len() <= AHEAD {
            continue;
        }
        let recorded = behind.pop_front().unwrap();
        let shows = recorded.other;
        for picture in submit(&screen, recorded, frame % 2 == 0) {
            assert_eq!(wrong_pixels(&picture, 0, &mapping), 0, "{case:?}: frame {frame}");
            match shows {
                Some(texture) if other == Some(texture) => {
                    assert_eq!(wrong_pixels(&picture, 1, &beside()), 0, "{case:?}: frame {frame}, beside");
                }
                Some(_) => {
                    check_gone(&picture, frame);
                    outlived += 1;
                }
                None => {}
            }
        }
    }
    let stats = screen.textures.stats();
    // A hashed table has as much room as its pool's slots need, and stays.
    let is_direct = case.tables == TableChoice::Direct;
    // Inline the first picture has cells, which are bound from then on.
    let others = u32::from(case.mode == FeedbackMode::Inline);
    assert_eq!(grown > others, is_direct, "{case:?}: {grown} growths");
    assert!(stats.pager.evicted > 100, "{case:?}: {stats:?}");
    assert!(outlived > 0, "no picture of what was removed was submitted afterwards");
    drop(behind);
    screen.textures.memory().resize_pool(POOL, case.pool_bytes(400)).unwrap();
    let settled = |screen: &mut Screen| {
        screen.set_mapping(0, &flight(FRAMES));
        screen.textures.view_mut(ViewId::MAIN).unwrap().cut();
        screen.settle(|_| false, |_| {});
        screen.picture()
    };
    let picture = settled(&mut screen);
    assert_eq!(wrong_pixels(&picture, 0, &flight(FRAMES)), 0, "{case:?}");
    check_counts(&screen, &case);
    // A screen takes longer to make than all of its frames.
    if case.mode == FeedbackMode::Separate {
        assert!(picture == settled(&mut case.screen(400)), "{case:?}");
    }
}

#[test]
fn frames_are_recorded_ahead_whatever_comes_and_goes() {
    Case::all().for_each(recorded_ahead);
}

/// Places that are far apart, each seen at level 1.
fn place(nth: u32) -> Mapping {
    let [x, y] = [nth % 4, nth / 4].map(f64::from);
    Mapping::new(SIZES[0], [0.15 + 0.22 * x, 0.2 + 0.28 * y], 2.2, 1.0, 0.1)
}

/// In a pool that is full a table grows, and what leaves slots then and thereafter is in view of commands
/// that were recorded before.
fn grows_in_a_full_pool(case: Case) {
    let (tiles, places) = if case.tables == TableChoice::Hashed { (520, 10) } else { (60, 4) };
    let mut screen = case.of_one(tiles);
    let (mut behind, mut moves, mut checked) = (VecDeque::new(), Vec::new(), 0);
    let mut bind_group = screen.textures.bind_group(screen.texture(0)).unwrap().clone();
    for frame in 0..places * 10 + 12 {
        let nth = (frame / 10).min(places - 1);
        // At the last place down to level 0, as a direct table has not been before.
        let looked_at = match frame / 10 {
            tens if tens < places => place(nth),
            _ => Mapping::new(SIZES[0], [0.4, 0.45], 0.9, 1.0, 0.1),
        };
        if frame % 10 == 0 {
            screen.textures.view_mut(ViewId::MAIN).unwrap().cut();
        }
        screen.set_mapping(0, &looked_at);
        behind.push_back(record(&mut screen, None));
        let now = screen.textures.bind_group(screen.texture(0)).unwrap().clone();
        if now != bind_group {
            moves.push(frame);
            bind_group = now;
        }
        if behind.len() <= AHEAD {
            continue;
        }
        let Recorded { wanted, picture, again, copies: [_, copy], .. } = behind.pop_front().unwrap();
        let queue = &screen.gpu.queue;
        queue.submit([wanted.finish(), picture.finish()]);
        // Where the camera was before, some of what was there has left its slot since.
        if moves.last().is_none_or(|moved| frame <= moved + 2) && frame > 20 {
            let before = place((nth + places - 1 - frame % 2) % places);
            screen.set_mapping(0, &before);
            screen.gpu.queue.submit([again.finish()]);
            let wrong = wrong_in_all(&screen.read_copy(&copy), &before);
            assert_eq!(wrong, 0, "{case:?}: frame {frame}, moved in {moves:?}");
            checked += 1;
        }
    }
    let stats = screen.textures.stats();
    // A hashed table has as much room as its pool's slots need, and stays.
    assert_eq!(moves.is_empty(), case.tables == TableChoice::Hashed, "{case:?}: {moves:?}");
    assert!(checked > 2 && stats.pager.evicted > 20, "{case:?}: {stats:?}");
}

#[test]
fn a_table_that_grows_in_a_full_pool_is_followed_by_the_one_before() {
    Case::all().for_each(grows_in_a_full_pool);
}
