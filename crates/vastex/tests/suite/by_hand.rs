//! What an application asks for by hand: tickets that are awaited, pins, and content that changes on screen.

use std::future::Future;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, AtomicUsize, Ordering};
use std::task::{Context, Poll, Wake, Waker};

use crate::common::{Mapping, Screen, property, settings};
use vastex::{
    AddressMode, AskError, Codec, Description, Geometry, GeometrySpec, LayerFormat, PageId, PagePos,
    PageState, ReadFuture, Region, TextureId, Textures, TicketState, Tile, TileSource, Urgency,
};
use vastex_core::Dims;

const SIZE: [u32; 2] = [1000, 777];

fn around(centre: [f64; 2]) -> Mapping {
    Mapping::new(SIZE, centre, 1.1, 1.0, 0.2)
}

/// Counts how often it is woken.
#[derive(Default)]
struct Alarm(AtomicUsize);

impl Wake for Alarm {
    fn wake(self: Arc<Self>) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }
}

/// A picture of one grey, which can be changed while it is shown.
struct Sheet {
    description: Arc<Description>,
    grey: AtomicU8,
}

impl Sheet {
    fn new(grey: u8) -> Arc<Sheet> {
        let spec = GeometrySpec { page: 32, ..GeometrySpec::image(SIZE[0], SIZE[1]) };
        let description = Description::one_layer(Geometry::new(spec).unwrap(), LayerFormat::Rgba8);
        Arc::new(Sheet { description: Arc::new(description), grey: AtomicU8::new(grey) })
    }
}

impl TileSource for Sheet {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn read(&self, _: PagePos) -> ReadFuture<'_> {
        let bytes = vec![self.grey.load(Ordering::Relaxed); self.description.tile_bytes()].into();
        Box::pin(async move { Ok(Tile { codec: Codec::Raw, bytes }) })
    }
}

fn page(texture: TextureId, x: u32, y: u32) -> PageId {
    PageId::new(texture, Dims::D2, PagePos::new_2d(0, x, y)).unwrap()
}

#[test]
fn a_prefetch_is_awaited_without_a_runtime_and_spares_the_next_view_its_loads() {
    let mut screen = Screen::new(&[property(SIZE, 32, AddressMode::Clamp)], settings());
    let texture = screen.texture(0);
    screen.set_mapping(0, &around([0.2, 0.2]));
    screen.converge();
    let ahead = Region::image(700..1000, 550..777);
    let ticket = screen.textures.prefetch(texture, &ahead, Urgency::default()).unwrap();
    let alarm = Arc::new(Alarm::default());
    let waker = Waker::from(alarm.clone());
    let mut context = Context::from_waker(&waker);
    let mut waiting = pin!(ticket.clone());
    let mut ended = None;
    for _ in 0..200 {
        if let Poll::Ready(progress) = waiting.as_mut().poll(&mut context) {
            ended = Some(progress);
            break;
        }
        assert_eq!(alarm.0.load(Ordering::Relaxed), 0);
        screen.frame().unwrap();
    }
    let ended = ended.unwrap();
    assert_eq!((ended.state, ended.resident), (TicketState::Done, ended.pages));
    assert_eq!(alarm.0.load(Ordering::Relaxed), 1);
    assert!(!screen.textures.release(&ticket), "it has ended");
    let loaded = screen.textures.stats().pager.loaded;
    screen.set_mapping(0, &around([0.85, 0.85]));
    screen.textures.view_cut();
    screen.converge();
    assert_eq!(screen.textures.stats().pager.loaded, loaded, "all was here");
}

#[test]
fn a_pin_stays_until_it_is_released_and_nobody_waits_for_textures_that_are_gone() {
    let mut screen = Screen::new(&[property(SIZE, 32, AddressMode::Clamp)], settings());
    let texture = screen.texture(0);
    let corner = Region::image(0..64, 0..64).on_levels(0..=0);
    let mut pin = screen.textures.pin(texture, &corner).unwrap();
    assert_eq!(pin.progress().state, TicketState::Open);
    screen.set_mapping(0, &around([0.8, 0.8]));
    screen.converge();
    assert_eq!(pin.progress().state, TicketState::Done);
    assert!(matches!(screen.textures.state(page(texture, 0, 0)), PageState::Resident(_)));
    assert!(screen.textures.release(&pin) && !screen.textures.release(&pin));
    let other = TextureId::new(77).unwrap();
    assert!(matches!(screen.textures.pin(other, &corner), Err(AskError::NoTexture(77))));
    // What is released before it is here, whose texture goes, or whose `Textures` do.
    let released = screen.textures.pin(texture, &corner).unwrap();
    pin = screen.textures.pin(texture, &Region::image(500..600, 0..64)).unwrap();
    screen.textures.release(&released);
    assert_eq!(pollster::block_on(released).state, TicketState::Done, "it had been here all the time");
    screen.textures.remove(texture);
    screen.gpu.device.destroy();
    let textures: Textures = screen.textures;
    drop(textures);
    assert_eq!(pollster::block_on(pin).state, TicketState::Released);
}

#[test]
fn content_that_changes_is_shown_in_place_and_is_never_coarser_on_the_way() {
    let sheet = Sheet::new(60);
    let sources: [Arc<dyn TileSource>; 1] = [sheet.clone()];
    let mut screen = Screen::new(&sources, settings());
    let texture = screen.texture(0);
    screen.set_mapping(0, &around([0.5, 0.5]));
    screen.converge();
    let before = screen.textures.stats().pager;
    sheet.grey.store(200, Ordering::Relaxed);
    screen.frame().unwrap();
    assert!(screen.picture().iter().all(|colour| colour[0] == 60), "nobody has said that it changed");
    let concerned = screen.textures.invalidate(texture, &Region::whole());
    assert_eq!(concerned, before.occupied);
    for _ in 0..40 {
        screen.frame().unwrap();
        assert!(screen.picture().iter().all(|colour| colour[0] == 60 || colour[0] == 200));
        assert!(screen.textures.is_converged());
    }
    assert!(screen.picture().iter().all(|colour| colour[0] == 200));
    let after = screen.textures.stats().pager;
    assert_eq!((after.refreshed, after.loaded, after.evicted), (before.occupied.into(), before.loaded, 0));
}

#[test]
fn pins_keep_to_their_share_of_the_pool() {
    let mut settings = settings();
    settings.read_toml("test", "[default_pool]\nsize_mib = 0.5\npin_share = 10", None).unwrap();
    let mut screen = Screen::new(&[property(SIZE, 32, AddressMode::Clamp)], settings);
    let texture = screen.texture(0);
    let slots = screen.textures.stats().pager.slots;
    let refused = screen.textures.pin(texture, &Region::image(0..160, 0..160).on_levels(0..=0)).unwrap_err();
    assert!(matches!(refused, AskError::TooManyPins { most, .. } if most == slots / 10), "{refused}");
    assert!(screen.textures.pin(texture, &Region::image(0..32, 0..32).on_levels(2..=2)).is_ok());
}
