//! Tiles that fade in: while time stands still nothing on screen changes, whatever comes and goes; when it
//! has passed the picture is what it is without fading, to the bit but for a rounding of anisotropic filters;
//! in between it goes one way.

use std::sync::Arc;
use std::time::Duration;

use crate::common::texts::halves;
use crate::common::{Mapping, SCREEN, Screen, add_with, property, settings};
use vastex::source::{Codec, ReadFuture, Tile};
use vastex::{
    AddressMode, Description, Filter, Geometry, GeometrySpec, LayerFormat, PagePos, PoolId, PoolSettings,
    Region, Settings, TableChoice, TextureSettings, TileSource,
};
use vastex_core::PageContents;

const SIZE: [u32; 2] = [1000, 777];
const TILE: u64 = 40 * 40 * 4;
/// How long a tile takes, and what a frame does where time passes: ten of them.
const FADE: Duration = Duration::from_millis(200);
const STEP: Duration = Duration::from_millis(20);

fn fading() -> Settings {
    Settings { fade: FADE, ..settings() }
}

fn source() -> Arc<dyn TileSource> {
    property(SIZE, 32, AddressMode::Wrap)
}

fn around(at: f64, texels: f64) -> Mapping {
    Mapping::new(SIZE, [at, 0.4], texels, 1.2, 0.2)
}

/// A screen on which time stands still.
fn still(settings: Settings) -> Screen {
    let mut screen = Screen::new(&[source()], settings);
    screen.textures.set_frame_time(Duration::ZERO);
    screen
}

/// Lets so much time pass in the next frame, and none after it.
fn pass(screen: &mut Screen, time: Duration) {
    screen.textures.set_frame_time(time);
    screen.frame().unwrap();
    screen.textures.set_frame_time(Duration::ZERO);
}

/// The same frames with fading and without, so that tiles lie in the same slots.
struct Pair {
    fading: Screen,
    at_once: Screen,
}

impl Pair {
    /// With fading time stands still.
    fn new(settings: Settings) -> Pair {
        let at_once = Screen::new(&[source()], Settings { fade: Duration::ZERO, ..settings.clone() });
        Pair { fading: still(settings), at_once }
    }

    fn look(&mut self, mapping: &Mapping) {
        self.fading.set_mapping(0, mapping);
        self.at_once.set_mapping(0, mapping);
    }

    fn frame(&mut self) {
        self.fading.frame().unwrap();
        self.at_once.frame().unwrap();
    }

    fn converge(&mut self) {
        self.fading.converge();
        self.at_once.converge();
        assert_eq!(self.at_once.textures.stats().fading, 0);
    }

    fn pass(&mut self, time: Duration) {
        pass(&mut self.fading, time);
        self.at_once.frame().unwrap();
    }
}

#[test]
fn a_tile_comes_without_a_change_on_screen_and_ends_as_without_fading() {
    for filter in Filter::KINDS {
        let settings = || Settings { filter, ..fading() };
        let (mut pair, mut empty) = (Pair::new(settings()), still(settings()));
        // Nothing but the tail.
        empty.textures.update().unwrap();
        // A view that moves, so that tiles of all levels come above and below one another.
        for frame in 0..40 {
            let mapping = around(0.2 + 0.01 * f64::from(frame), 1.1 + 0.2 * f64::from(frame % 8));
            pair.look(&mapping);
            pair.frame();
            if frame % 10 == 9 {
                empty.set_mapping(0, &mapping);
                assert!(pair.fading.picture() == empty.picture(), "{filter}: {frame}");
            }
        }
        assert!(pair.fading.textures.stats().fading > 10, "{:?}", pair.fading.textures.stats());
        pair.look(&around(0.3, 1.1));
        empty.set_mapping(0, &around(0.3, 1.1));
        pair.converge();
        assert!(pair.fading.picture() == empty.picture(), "{filter}");
        assert!(pair.fading.picture() != pair.at_once.picture(), "{filter}");
        pair.pass(FADE);
        assert_eq!(pair.fading.textures.stats().fading, 0);
        // Where taps lie along an axis a driver may round otherwise in another program.
        let most_off = u8::from(matches!(filter, Filter::Anisotropic(_)));
        let (ended, at_once) = (pair.fading.picture(), pair.at_once.picture());
        let off = |(a, b): (&[u8; 4], &[u8; 4])| (0..4).map(|c| a[c].abs_diff(b[c])).max().unwrap();
        assert!(ended.iter().zip(&at_once).all(|pair| off(pair) <= most_off), "{filter}");
        let differing = ended.iter().zip(&at_once).filter(|(a, b)| a != b).count();
        assert!(differing * 100 <= ended.len(), "{filter}: {differing} of {}", ended.len());
    }
}

/// Frame by frame, each channel of each pixel goes from what it was to what it will be and never back.
#[test]
fn between_the_two_every_pixel_goes_one_way() {
    let mut pair = Pair::new(Settings { filter: Filter::Bilinear, ..fading() });
    pair.look(&around(0.4, 4.1));
    pair.converge();
    pair.pass(FADE);
    // One level finer.
    pair.look(&around(0.4, 2.1));
    let before = pair.fading.picture();
    pair.converge();
    assert!(pair.fading.picture() == before, "all of it has come, and none of it shows");
    let sharp = pair.at_once.picture();
    let mut pictures = vec![before.clone()];
    for _ in 0..10 {
        pair.pass(STEP);
        pictures.push(pair.fading.picture());
    }
    assert!(pictures[10] == sharp && pictures[9] != sharp);
    let mut between = 0;
    for (was, is) in pictures.iter().zip(&pictures[1..]) {
        for (((first, last), was), is) in before.iter().zip(&sharp).zip(was).zip(is) {
            for channel in 0..4 {
                let [first, last, was, is] = [first, last, was, is].map(|pixel| i32::from(pixel[channel]));
                assert!((is - was) * (last - first).signum() >= 0, "{first} to {last}: {was}, {is}");
                between += usize::from(is != first && is != last);
            }
        }
    }
    assert!(between > 1000, "{between}");
}

#[test]
fn pages_that_come_and_go_in_a_pool_that_is_full_leave_nothing_behind() {
    let pools = PoolSettings::of_bytes(130 * TILE);
    let mut pair = Pair::new(Settings { pools, upload_bytes_per_frame: 3 * TILE, ..fading() });
    for frame in 0..150 {
        pair.look(&around(0.012 * f64::from(frame), 2.2));
        pair.pass(STEP);
    }
    let stats = pair.fading.textures.stats();
    assert!(stats.pager.evicted > 60 && stats.fading > 0, "{stats:?}");
    pair.look(&around(0.5, 2.2));
    pair.converge();
    pair.pass(FADE);
    assert_eq!(pair.fading.textures.stats().pager, pair.at_once.textures.stats().pager);
    assert!(pair.fading.picture() == pair.at_once.picture());
}

/// The picture of a view without fading, when all of it is there, and when nothing but the tail is; with the
/// nearest filter it does not depend on the slots.
fn sharp_and_tail(mapping: &Mapping) -> [Vec<[u8; 4]>; 2] {
    let mut screen = Screen::new(&[source()], settings());
    screen.set_mapping(0, mapping);
    screen.textures.update().unwrap();
    let tail = screen.picture();
    screen.converge();
    [screen.picture(), tail]
}

#[test]
fn either_kind_of_page_table_fades_alike() {
    let mut screens = [TableChoice::Direct, TableChoice::Hashed].map(|page_table| {
        Screen::showing(Settings { filter: Filter::Trilinear, ..fading() }, SCREEN, |textures| {
            add_with(textures, source(), TextureSettings { page_table, ..Default::default() }).unwrap()
        })
    });
    for frame in 0..40 {
        for screen in &mut screens {
            screen.set_mapping(0, &around(0.2 + 0.01 * f64::from(frame), 1.6));
            screen.frame().unwrap();
        }
        assert!(screens[0].picture() == screens[1].picture(), "{frame}");
    }
    assert!(screens[0].textures.stats().fading > 0);
}

#[test]
fn a_pool_that_is_resized_goes_on_where_it_was() {
    let pools = PoolSettings::of_bytes(400 * TILE);
    let mut screen = still(Settings { pools, ..fading() });
    screen.set_mapping(0, &around(0.4, 1.1));
    screen.converge();
    pass(&mut screen, FADE / 2);
    let (picture, fading) = (screen.picture(), screen.textures.stats().fading);
    assert!(fading > 20);
    for tiles in [1700, 300] {
        let resize = screen.textures.memory().resize_pool(PoolId::new(0), tiles * TILE).unwrap();
        assert_ne!(resize.before, resize.bytes);
        assert!(screen.picture() == picture && screen.textures.stats().fading == fading, "{tiles}");
    }
    pass(&mut screen, FADE / 2);
    assert!(screen.picture() == sharp_and_tail(&around(0.4, 1.1))[0]);
}

#[test]
fn after_a_lost_device_tiles_fade_in_from_the_tail() {
    let mapping = around(0.4, 1.1);
    let mut screen = still(fading());
    screen.set_mapping(0, &mapping);
    screen.converge();
    pass(&mut screen, FADE / 2);
    let mut screen = screen.on_another_device();
    screen.set_mapping(0, &mapping);
    let [sharp, tail] = sharp_and_tail(&mapping);
    assert!(screen.textures.stats().fading == 0 && screen.picture() == tail);
    screen.converge();
    assert!(screen.textures.stats().fading > 20 && screen.picture() == tail);
    pass(&mut screen, FADE);
    assert!(screen.picture() == sharp);
}

#[test]
fn a_texture_that_is_held_whole_is_there_at_once() {
    let mapping = around(0.4, 1.1);
    let mut screen = still(Settings { whole_bytes: 64 << 20, ..fading() });
    screen.set_mapping(0, &mapping);
    screen.frame().unwrap();
    assert!(screen.picture() == sharp_and_tail(&mapping)[0]);
    assert_eq!(screen.textures.stats().fading, 0);
}

#[test]
fn content_that_changes_takes_the_place_of_what_was_there_at_once() {
    let mut screen = still(fading());
    screen.set_mapping(0, &around(0.4, 1.1));
    screen.converge();
    pass(&mut screen, FADE);
    let picture = screen.picture();
    assert!(screen.textures.texture_mut(screen.texture(0)).unwrap().invalidate(&Region::whole()) > 20);
    for _ in 0..40 {
        screen.frame().unwrap();
        assert_eq!(screen.textures.stats().fading, 0);
    }
    assert!(screen.textures.stats().pager.refreshed > 20 && screen.picture() == picture);
}

#[test]
fn the_members_of_a_group_fade_as_they_do_alone() {
    let mapping = around(0.4, 1.1);
    let settings = || Settings { filter: Filter::Trilinear, ..fading() };
    let mut group = Screen::showing(settings(), &halves(), |textures| {
        let [first, second] =
            [source(), property(SIZE, 64, AddressMode::Wrap)].map(|s| textures.add_blocking(s).unwrap());
        textures.add_group([("first", first), ("second", second), ("again", second)]).unwrap()
    });
    group.textures.set_frame_time(Duration::ZERO);
    group.set_mapping(0, &mapping);
    let tails = group.picture();
    group.converge();
    assert!(group.picture() == tails && group.textures.stats().fading > 20);
    pass(&mut group, FADE / 2);
    let half = group.picture();
    let mut alone = still(settings());
    alone.set_mapping(0, &mapping);
    alone.converge();
    pass(&mut alone, FADE / 2);
    let left = |picture: &[[u8; 4]]| -> Vec<[u8; 4]> {
        picture.chunks(160).flat_map(|row| row[..80].to_vec()).collect()
    };
    assert!(left(&half) == left(&alone.picture()) && half != tails);
}

/// A texture of which every level has one colour, so that all its pages have the same content.
struct Plain {
    description: Arc<Description>,
    contents: Arc<PageContents>,
}

impl Plain {
    fn new() -> Arc<Plain> {
        let spec = GeometrySpec { page: 32, ..GeometrySpec::image(SIZE[0], SIZE[1]) };
        let description = Description::one_layer(Geometry::new(spec).unwrap(), LayerFormat::Rgba8);
        let level = |pos: PagePos| Some(u32::from(pos.level));
        let contents = PageContents::new(&description.geometry, Vec::new(), 16, level);
        Arc::new(Plain { description: Arc::new(description), contents: Arc::new(contents) })
    }
}

impl TileSource for Plain {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn contents(&self) -> Option<&Arc<PageContents>> {
        Some(&self.contents)
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        let bytes = vec![40 * pos.level; self.description.tile_bytes()].into();
        Box::pin(async move { Ok(Tile { codec: Codec::Raw, bytes }) })
    }
}

#[test]
fn a_page_whose_content_is_there_already_is_there_at_once_and_leaves_the_others_alone() {
    let mut screen = Screen::new(&[Plain::new()], fading());
    screen.textures.set_frame_time(Duration::ZERO);
    screen.set_mapping(0, &around(0.2, 1.1));
    screen.converge();
    let stats = screen.textures.stats();
    let loaded = stats.pager.loaded;
    assert!(stats.fading as u64 == loaded && stats.pager.shared > 2 * loaded, "{stats:?}");
    pass(&mut screen, FADE);
    let picture = screen.picture();
    // Other pages, one of which then gets a slot of its own.
    screen.set_mapping(0, &around(0.7, 1.1));
    let check = |screen: &mut Screen| {
        for _ in 0..40 {
            screen.frame().unwrap();
            assert_eq!(screen.textures.stats().fading, 0);
        }
        // A page that a pixel or two see may not have been asked for.
        let others = screen.picture().iter().zip(&picture).filter(|(a, b)| a != b).count();
        assert!(others < 10, "{others} pixels: {:?}", screen.textures.stats());
    };
    check(&mut screen);
    assert_eq!(screen.textures.stats().pager.loaded, loaded);
    assert!(
        screen
            .textures
            .texture_mut(screen.texture(0))
            .unwrap()
            .invalidate(&Region::image(700..701, 300..301))
            > 0
    );
    check(&mut screen);
    assert!(screen.textures.stats().pager.refreshed > 0);
}
