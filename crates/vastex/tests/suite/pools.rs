//! Several textures at once, in one pool or in several: tile sizes, page sizes and formats side by side.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use crate::common::{Mapping, PICTURE, Screen, property, settings};
use vastex::diagnostics::PageState;
use vastex::{AddressMode, Error, Event, LevelRule, Pace, PoolSettings, Settings, Textures, TileSource};
use vastex_core::{Description, Dims, Geometry, GeometrySpec, LayerFormat, PagePos};
use vastex_tiles::{Codec, PropertySource, ReadFuture, Tile};
use vastex_wgpu::test_device::TestDevice;

const SIZE: [u32; 2] = [1000, 777];

/// The same value everywhere, in a format of one channel.
struct Plain {
    description: Arc<Description>,
    byte: u8,
}

impl Plain {
    fn source(format: LayerFormat, byte: u8) -> Arc<dyn TileSource> {
        let spec = GeometrySpec { page: 32, ..GeometrySpec::image(SIZE[0], SIZE[1]) };
        let description = Description::one_layer(Geometry::new(spec).unwrap(), format);
        Arc::new(Plain { description: Arc::new(description), byte })
    }
}

impl TileSource for Plain {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn read(&self, _: PagePos) -> ReadFuture<'_> {
        let bytes = vec![self.byte; self.description.tile_bytes()].into();
        Box::pin(async move { Ok(Tile { codec: Codec::Raw, bytes }) })
    }
}

/// A place of the texture, seen at level 0.
fn sharp(centre: [f64; 2]) -> Mapping {
    Mapping::new(SIZE, centre, 1.1, 1.0, 0.2)
}

/// The colours in the column of the picture in which the texture is shown.
fn column(screen: &Screen, nth: usize, of: usize) -> Vec<[u8; 4]> {
    let width = PICTURE[0] as usize / of;
    let rows = screen.picture();
    rows.chunks(PICTURE[0] as usize).flat_map(|row| row[nth * width..(nth + 1) * width].to_vec()).collect()
}

/// All but what is at the edge of the column and belongs to the neighbour shows the level.
fn check_level(colours: &[[u8; 4]], level: u8) {
    let shows = |&&colour: &&[u8; 4]| PropertySource::texel_from_color(Dims::D2, colour).0 == level;
    let right = colours.iter().filter(shows).count();
    assert!(right * 100 >= colours.len() * 99, "{right} of {} pixels at level {level}", colours.len());
}

/// Every page that a jitter cycle cannot miss, since it has more pixels than a block, is there.
fn check_resident(screen: &mut Screen) {
    let wanted = screen.feedback_of_every_pixel().pages;
    for wanted in wanted.iter().filter(|wanted| wanted.pixels > 64) {
        assert!(matches!(screen.textures.inspect().state(wanted.page), PageState::Resident(_)), "{wanted:?}");
    }
}

#[test]
fn textures_that_match_share_a_pool_and_both_converge() {
    let sources = [property(SIZE, 32, AddressMode::Clamp), property([777, 1000], 32, AddressMode::Wrap)];
    let mut screen = Screen::new(&sources, settings());
    screen.set_mapping(0, &sharp([0.3, 0.3]));
    screen.set_mapping(1, &Mapping::new([777, 1000], [0.9, 0.5], 2.3, 1.0, 1.0));
    screen.converge();
    assert_eq!(screen.textures.stats().pools.len(), 1);
    check_resident(&mut screen);
    check_level(&column(&screen, 0, 2), 0);
    check_level(&column(&screen, 1, 2), 1);
}

#[test]
fn tile_sizes_and_formats_live_side_by_side() {
    let sources = [
        property(SIZE, 32, AddressMode::Clamp),
        property(SIZE, 100, AddressMode::Mirror),
        Plain::source(LayerFormat::R8, 0x40),
        Plain::source(LayerFormat::R16, 0xc0),
        property(SIZE, 32, AddressMode::Clamp),
    ];
    let mut screen = Screen::new(&sources, settings());
    for (nth, centre) in [[0.3, 0.3], [0.6, 0.2], [0.5, 0.5], [0.2, 0.8], [0.7, 0.7]].into_iter().enumerate()
    {
        screen.set_mapping(nth, &sharp(centre));
    }
    screen.converge();
    let numbers: Vec<u16> = (0..5)
        .map(|nth| screen.textures.texture(screen.texture(nth)).unwrap().pool().unwrap().number())
        .collect();
    assert_eq!(numbers, [0, 1, 2, 3, 0], "the last one shares the pool of the first");
    check_resident(&mut screen);
    for nth in [0, 1, 4] {
        check_level(&column(&screen, nth, 5), 0);
    }
    for (nth, value) in [(2, 0x40), (3, 0xc0)] {
        assert!(column(&screen, nth, 5).iter().all(|&colour| colour == [value, 0, 0, 255]));
    }
    let stats = screen.textures.stats();
    assert_eq!(stats.pools.len(), 4);
    assert!(stats.pools.iter().all(|pool| pool.pager.loaded > 0 && pool.pager.missing == 0), "{stats:?}");
    let tiles: Vec<&str> = stats.pools.iter().map(|pool| &*pool.tiles).collect();
    let [rgba8, r8, r16] = [LayerFormat::Rgba8, LayerFormat::R8, LayerFormat::R16].map(LayerFormat::name);
    assert_eq!(tiles[0], format!("40x40 texels of {rgba8}"));
    assert_eq!(tiles[1], format!("108x108 texels of {rgba8}"));
    assert_eq!(tiles[2], format!("40x40 texels of {r8}"));
    assert_eq!(tiles[3], format!("40x40 texels of {r16}"));
    let loaded: u64 = stats.pools.iter().map(|pool| pool.pager.loaded).sum();
    assert_eq!((stats.pager.loaded, stats.pager.tails), (loaded, 5));
    assert_eq!(stats.pool_bytes, stats.pools.iter().map(|pool| pool.bytes).sum::<u64>());
}

#[test]
fn only_the_pool_that_is_too_small_becomes_coarser_and_is_named() {
    // Six tiles of 108x108 texels, many of 40x40.
    let small = Settings { pools: PoolSettings::of_bytes(6 * 108 * 108 * 4), ..settings() };
    let sources = [property(SIZE, 100, AddressMode::Clamp), Plain::source(LayerFormat::R8, 0x40)];
    let mut screen = Screen::new(&sources, small);
    screen.set_mapping(0, &sharp([0.5, 0.5]));
    screen.set_mapping(1, &sharp([0.5, 0.5]));
    let mut named = BTreeSet::new();
    for _ in 0..60 {
        for event in screen.frame().unwrap() {
            if let Event::Oversubscribed { pool, bias_eighths, .. } = event {
                assert!(bias_eighths > 0);
                named.insert(Some(pool));
            }
        }
    }
    let [coarse, fine] = [0, 1].map(|nth| screen.texture(nth));
    assert_eq!(named, BTreeSet::from([screen.textures.texture(coarse).unwrap().pool()]));
    assert!(screen.textures.texture(coarse).unwrap().bias_eighths() > 0);
    assert_eq!(screen.textures.texture(fine).unwrap().bias_eighths(), 0);
    assert_eq!(
        screen.textures.stats().pager.bias_eighths,
        screen.textures.texture(coarse).unwrap().bias_eighths()
    );
}

#[test]
fn each_texture_may_have_its_own_clamp_of_levels_and_bias() {
    let source = || property(SIZE, 32, AddressMode::Clamp);
    let mut screen = Screen::new(&[source(), source(), source(), source()], settings());
    (0..4).for_each(|nth| screen.set_mapping(nth, &sharp([0.4, 0.4])));
    // From level 0.1: nothing, a bias, at least level 2, at most what the texture has.
    let rules = [(0.0, 0, 99), (0.95, 0, 99), (0.0, 2, 5), (9.0, 0, 3)];
    for (nth, (bias, finest, coarsest)) in rules.into_iter().enumerate() {
        let texture = screen.texture(nth);
        screen.textures.texture_mut(texture).unwrap().set_levels(LevelRule { bias, finest, coarsest });
    }
    assert_eq!(
        screen.textures.texture(screen.texture(0)).unwrap().levels(),
        LevelRule { coarsest: 10, ..LevelRule::default() }
    );
    screen.converge();
    let wanted = screen.feedback_of_every_pixel().pages;
    for (nth, level) in [0, 1, 2, 3].into_iter().enumerate() {
        check_level(&column(&screen, nth, 4), level);
        let texture = screen.texture(nth);
        let own = wanted.iter().filter(|wanted| wanted.page.texture() == texture.number());
        assert!(own.clone().count() > 0 && own.clone().all(|wanted| wanted.page.level() == level));
    }
    let gone = screen.texture(3);
    screen.remove(3);
    assert!(matches!(screen.textures.texture_mut(gone), Err(Error::NoTexture(id)) if id == gone));
    assert!(matches!(screen.textures.texture(gone), Err(Error::NoTexture(id)) if id == gone));
}

#[test]
fn a_removed_texture_gives_back_what_it_held_and_the_next_one_takes_its_place() {
    for pace in [settings().pace, Pace::Realtime] {
        let sources = [property(SIZE, 32, AddressMode::Clamp), property(SIZE, 100, AddressMode::Clamp)];
        let mut screen = Screen::new(&sources, Settings { pace, ..settings() });
        (0..2).for_each(|nth| screen.set_mapping(nth, &sharp([0.4, 0.4])));
        // In the middle of loading.
        (0..5).for_each(|_| drop(screen.frame().unwrap()));
        let (gone, before) = (screen.texture(1), screen.textures.stats());
        screen.remove(1);
        assert!(!screen.textures.remove(gone), "there is none any more");
        let after = screen.textures.stats();
        assert_eq!(screen.textures.inspect().textures().collect::<Vec<_>>(), [screen.texture(0)]);
        assert!(after.table_bytes < before.table_bytes, "{after:?}");
        assert_eq!((after.pools[1].bytes, after.pools[1].pager.occupied), (0, 0), "{after:?}");
        assert_eq!(after.pools[0].bytes, before.pools[0].bytes);
        // Feedback that names it is under way, so the next one has another number, and its own tiles.
        screen.replace(1, property(SIZE, 100, AddressMode::Mirror));
        let next = screen.texture(1);
        assert_ne!(next, gone);
        assert_eq!(screen.textures.stats().pools[1].bytes, before.pools[1].bytes);
        screen.set_mapping(1, &sharp([1.3, 1.3]));
        converge_in_either_pace(&mut screen);
        (0..2).for_each(|nth| check_level(&column(&screen, nth, 2), 0));
        check_resident(&mut screen);
        // By now nothing names the old one any more.
        screen.remove(0);
        screen.replace(0, property(SIZE, 100, AddressMode::Wrap));
        let again = screen.texture(0);
        assert_eq!(again.number(), gone.number());
        // Its old owner's id names nothing all the same, on the CPU and in shaders.
        assert!(again != gone && screen.textures.shader_id(gone).is_err());
        assert!(matches!(screen.textures.kinds(gone), Err(Error::NoTexture(id)) if id == gone));
        assert!(
            screen.textures.bind_group(gone).is_err() && screen.textures.bindings().revision(gone).is_err()
        );
        assert_eq!(screen.textures.inspect().id_of(gone.number()), Some(again));
        assert!(!screen.textures.remove(gone) && screen.textures.texture(again).is_ok());
    }
}

#[test]
fn whoever_keeps_a_bind_group_is_told_when_it_is_another() {
    let mut screen = Screen::new(&[property(SIZE, 32, AddressMode::Clamp)], settings());
    let texture = screen.texture(0);
    let pool = screen.textures.texture(texture).unwrap().pool().unwrap();
    let kept = |screen: &Screen| {
        let textures = &screen.textures;
        (textures.bindings().revision(texture).unwrap(), textures.bind_group(texture).unwrap().clone())
    };
    let mut changes = 0;
    for frame in 0..40 {
        let before = kept(&screen);
        screen.set_mapping(0, &Mapping::new(SIZE, [0.5, 0.5], 4.4 - 0.1 * f64::from(frame), 1.0, 0.2));
        let events = screen.frame().unwrap();
        let after = kept(&screen);
        assert_eq!(before.0 == after.0, before.1 == after.1, "frame {frame}");
        assert_eq!(before.0 != after.0, events.contains(&Event::BindGroupsChanged { pool }), "frame {frame}");
        changes += u32::from(before.0 != after.0);
    }
    assert!(changes > 0, "a page table that grows lies elsewhere");
}

#[test]
fn whoever_keeps_the_bind_group_of_a_pool_that_was_empty_is_told_of_the_next() {
    let gpu = TestDevice::new();
    let mut textures = Textures::new(&gpu.device, &gpu.queue, settings()).unwrap();
    let source = || property(SIZE, 32, AddressMode::Clamp);
    let first = textures.add_blocking(source()).unwrap();
    textures.update().unwrap();
    let events =
        |textures: &mut Textures| -> Vec<_> { std::iter::from_fn(|| textures.poll_event()).collect() };
    let (pool, kept) =
        (textures.texture(first).unwrap().pool().unwrap(), textures.bind_group(first).unwrap().clone());
    events(&mut textures);
    assert!(textures.remove(first));
    (0..20).for_each(|_| textures.update().unwrap());
    events(&mut textures);
    let second = textures.add_blocking(source()).unwrap();
    textures.update().unwrap();
    assert_eq!(textures.texture(second).unwrap().pool(), Some(pool));
    assert!(*textures.bind_group(second).unwrap() != kept);
    assert!(events(&mut textures).contains(&Event::BindGroupsChanged { pool }));
}

#[test]
fn page_tables_grow_when_the_view_comes_near() {
    let mut screen = Screen::new(&[property(SIZE, 32, AddressMode::Clamp)], settings());
    let entries = |levels: std::ops::RangeInclusive<u32>| -> u64 {
        levels.map(|level| u64::from(SIZE[0].div_ceil(32 << level) * SIZE[1].div_ceil(32 << level))).sum()
    };
    screen.set_mapping(0, &Mapping::new(SIZE, [0.5, 0.5], 4.4, 1.0, 0.2));
    screen.frame().unwrap(); // sends the table's beginning
    let before = screen.textures.stats().table_bytes;
    screen.converge();
    check_level(&column(&screen, 0, 1), 2);
    assert_eq!(screen.textures.stats().table_bytes, before, "nothing finer came");
    screen.set_mapping(0, &sharp([0.5, 0.5]));
    screen.converge();
    check_level(&column(&screen, 0, 1), 0);
    check_resident(&mut screen);
    // Each level has room for a power of two of entries, and they lie in one arena, which has doubled.
    let (grown, entries) = (screen.textures.stats().table_bytes - before, 4 * entries(0..=0));
    assert!((entries..=4 * entries).contains(&grown), "{grown} bytes for {entries}");
}

/// In real time frames do not wait for tiles, so the test does.
fn converge_in_either_pace(screen: &mut Screen) {
    let converged = (0..3000).any(|frame| {
        screen.frame().unwrap();
        std::thread::sleep(Duration::from_millis(1));
        frame > 40 && screen.textures.stats().converged
    });
    assert!(converged, "{:?}", screen.textures.stats());
}

#[test]
fn textures_may_come_and_go_all_the_time() {
    let mut screen = Screen::new(
        &[property(SIZE, 32, AddressMode::Clamp), property(SIZE, 32, AddressMode::Wrap)],
        Settings { upload_bytes_per_frame: 20_000, ..settings() },
    );
    (0..2).for_each(|nth| screen.set_mapping(nth, &sharp([0.6, 0.6])));
    let mut numbers = BTreeSet::new();
    for turn in 0..60 {
        let nth = turn % 2;
        screen.remove(nth);
        screen.replace(nth, property(SIZE, 32, AddressMode::Clamp));
        numbers.insert(screen.texture(nth).number());
        (0..turn % 5).for_each(|_| drop(screen.frame().unwrap()));
    }
    assert!(numbers.len() < 20, "numbers are used again: {numbers:?}");
    screen.converge();
    (0..2).for_each(|nth| check_level(&column(&screen, nth, 2), 0));
}

#[test]
fn budgets_are_totals_over_all_pools() {
    let largest = 108 * 108 * 4;
    let limits = Settings { upload_bytes_per_frame: 10_000, in_flight_bytes: 60_000, ..settings() };
    let sources = [
        property(SIZE, 32, AddressMode::Clamp),
        property(SIZE, 100, AddressMode::Clamp),
        Plain::source(LayerFormat::R16, 0xc0),
    ];
    let mut screen = Screen::new(&sources, limits.clone());
    for frame in 1..=60u64 {
        let part = frame as f64 / 60.0;
        (0..3).for_each(|nth| screen.set_mapping(nth, &sharp([part, 0.5 + 0.3 * part])));
        screen.frame().unwrap();
        let stats = screen.textures.stats();
        assert!(stats.pager.in_flight_bytes <= limits.in_flight_bytes, "{stats:?}");
        let bucket = frame * limits.upload_bytes_per_frame + (4 * limits.upload_bytes_per_frame).max(largest);
        assert!(stats.pager.uploaded_bytes <= bucket, "frame {frame}: {stats:?}");
    }
    let pools = screen.textures.stats().pools;
    let bytes = || pools.iter().map(|pool| pool.pager.uploaded_bytes);
    let behind = bytes().max().unwrap() - bytes().min().unwrap();
    assert!(bytes().all(|bytes| bytes > 2 * largest) && behind <= largest, "equal parts: {pools:?}");
}
