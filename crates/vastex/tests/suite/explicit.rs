//! What an application asks for by hand: tickets that are awaited, pins, and content that changes on screen.

use std::future::Future;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, AtomicUsize, Ordering};
use std::task::{Context, Poll, Wake, Waker};

use std::time::Duration;

use crate::common::{Mapping, PICTURE, Screen, property, settings};
use vastex::diagnostics::PageState;
use vastex::source::{Codec, ReadFuture, Tile};
use vastex::{
    AddressMode, AskError, Description, Error, Feedback, Geometry, GeometrySpec, LayerFormat, Pace, PageId,
    PagePos, PoolSettings, Region, Settings, TextureId, Textures, TicketState, TileSource, Urgency, ViewId,
    ViewSettings,
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
    PageId::new(texture.number(), Dims::D2, PagePos::new_2d(0, x, y)).unwrap()
}

#[test]
fn a_prefetch_is_awaited_without_a_runtime_and_spares_the_next_view_its_loads() {
    let mut screen = Screen::new(&[property(SIZE, 32, AddressMode::Clamp)], settings());
    let texture = screen.texture(0);
    screen.set_mapping(0, &around([0.2, 0.2]));
    screen.converge();
    let ahead = Region::image(700..1000, 550..777);
    let ticket = screen.textures.ahead().prefetch(texture, &ahead, Urgency::default()).unwrap();
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
    assert!(!screen.textures.ahead().release(&ticket), "it has ended");
    let loaded = screen.textures.stats().pager.loaded;
    screen.set_mapping(0, &around([0.85, 0.85]));
    screen.textures.view_mut(ViewId::MAIN).unwrap().cut();
    screen.converge();
    assert_eq!(screen.textures.stats().pager.loaded, loaded, "all was here");
}

#[test]
fn a_pin_stays_until_it_is_released_and_nobody_waits_for_textures_that_are_gone() {
    let mut screen = Screen::new(&[property(SIZE, 32, AddressMode::Clamp)], settings());
    let texture = screen.texture(0);
    let corner = Region::image(0..64, 0..64).on_levels(0..=0);
    let mut pin = screen.textures.ahead().pin(texture, &corner).unwrap();
    assert_eq!(pin.progress().state, TicketState::Open);
    screen.set_mapping(0, &around([0.8, 0.8]));
    screen.converge();
    assert_eq!(pin.progress().state, TicketState::Done);
    assert!(matches!(screen.textures.inspect().state(page(texture, 0, 0)), PageState::Resident(_)));
    assert!(screen.textures.ahead().release(&pin) && !screen.textures.ahead().release(&pin));
    let gone = screen.textures.add_blocking(Sheet::new(9)).unwrap();
    screen.textures.remove(gone);
    assert!(matches!(screen.textures.ahead().pin(gone, &corner), Err(AskError::NoTexture(1))));
    // What is released before it is here, whose texture goes, or whose `Textures` do.
    let released = screen.textures.ahead().pin(texture, &corner).unwrap();
    pin = screen.textures.ahead().pin(texture, &Region::image(500..600, 0..64)).unwrap();
    screen.textures.ahead().release(&released);
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
    let concerned = screen.textures.texture_mut(texture).unwrap().invalidate(&Region::whole());
    assert_eq!(concerned, before.occupied);
    for _ in 0..40 {
        screen.frame().unwrap();
        assert!(screen.picture().iter().all(|colour| colour[0] == 60 || colour[0] == 200));
        assert!(screen.textures.inspect().is_converged());
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
    let refused =
        screen.textures.ahead().pin(texture, &Region::image(0..160, 0..160).on_levels(0..=0)).unwrap_err();
    assert!(matches!(refused, AskError::TooManyPins { most, .. } if most == slots / 10), "{refused}");
    assert!(screen.textures.ahead().pin(texture, &Region::image(0..32, 0..32).on_levels(2..=2)).is_ok());
}

/// Far from the first, and of both textures.
fn elsewhere(screen: &mut Screen) {
    (0..2).for_each(|nth| screen.set_mapping(nth, &around([0.8, 0.75])));
}

fn two_textures(settings: Settings) -> Screen {
    let sources = [32, 64].map(|page| property(SIZE, page, AddressMode::Clamp));
    let mut screen = Screen::new(&sources, settings);
    (0..2).for_each(|nth| screen.set_mapping(nth, &around([0.2, 0.2])));
    screen
}

#[test]
fn a_view_that_was_prefetched_is_sharp_at_the_cut() {
    let mut screen = two_textures(settings());
    elsewhere(&mut screen);
    let ahead = screen.feedback_of_every_pixel();
    assert!(ahead.pages.len() > 10, "{}", ahead.pages.len());
    (0..2).for_each(|nth| screen.set_mapping(nth, &around([0.2, 0.2])));
    screen.converge();
    let ticket = screen.textures.ahead().prefetch_view(&ahead, Urgency::default()).unwrap();
    assert!(ticket.is_open() && ticket.progress().resident < ticket.progress().pages);
    for _ in 0..200 {
        if !ticket.is_open() {
            break;
        }
        screen.frame().unwrap();
    }
    let ended = ticket.progress();
    assert_eq!((ended.state, ended.resident), (TicketState::Done, ended.pages));
    assert!(ended.pages as usize >= ahead.pages.len());
    assert_eq!(pollster::block_on(ticket), ended, "it has ended, so nothing is waited for");
    let loaded = screen.textures.stats().pager.loaded;
    elsewhere(&mut screen);
    screen.textures.view_mut(ViewId::MAIN).unwrap().cut();
    let at_the_cut = screen.picture();
    screen.converge();
    assert!(at_the_cut == screen.picture(), "it was as sharp in the first frame");
    assert_eq!(screen.textures.stats().pager.loaded, loaded);
}

#[test]
fn a_view_beyond_the_pool_is_refused_whole() {
    const TILE_BYTES: u64 = 72 * 72 * 4;
    let mut screen = two_textures(Settings { pools: PoolSettings::of_bytes(12 * TILE_BYTES), ..settings() });
    let wanted = screen.feedback_of_every_pixel();
    let error = screen.textures.ahead().prefetch_view(&wanted, Urgency::default()).unwrap_err();
    assert!(matches!(error, AskError::TooManyPages { pages, slots } if pages > u64::from(slots)), "{error}");
    screen.textures.update().unwrap();
    assert_eq!(screen.textures.stats().pager.in_flight, 0, "nothing was asked for");
    let nothing = screen.textures.ahead().prefetch_view(&Feedback::default(), Urgency::default()).unwrap();
    assert_eq!(pollster::block_on(nothing).state, TicketState::Done);
}

#[test]
fn a_ticket_is_finished_without_frames() {
    for pace in [Pace::Realtime, Pace::LockStep { latency_frames: 3 }] {
        let mut screen = two_textures(Settings { pace, ..settings() });
        let region = Region::image(500..600, 500..600).on_levels(0..=0);
        let texture = screen.texture(0);
        let ticket = screen.textures.ahead().prefetch(texture, &region, Urgency::default()).unwrap();
        let ended = screen.textures.finish(&ticket, Duration::from_secs(240)).unwrap();
        assert_eq!((ended.state, ended.resident), (TicketState::Done, ended.pages), "{pace:?}");
        assert!(matches!(
            screen.textures.inspect().state(page(screen.texture(0), 17, 17)),
            PageState::Resident(_)
        ));
        // What never comes is waited for no longer than was said.
        let ticket =
            screen.textures.ahead().prefetch(texture, &Region::whole().on_levels(1..=1), Urgency::default());
        let ended = screen.textures.finish(&ticket.unwrap(), Duration::ZERO).unwrap();
        assert_eq!(ended.state, TicketState::Open);
    }
}

/// The camera's view moves all the time, so that the whole never converges; the one beside it does, and says
/// so.
#[test]
fn one_view_converges_while_another_moves() {
    let mut screen = two_textures(settings());
    let beside = screen.textures.add_view(ViewSettings::default()).unwrap();
    let waiting = screen.textures.view_mut(beside).unwrap().converged();
    assert!(matches!(screen.textures.view_mut(ViewId::new(77)), Err(Error::NoView(_))));
    screen.set_mapping(1, &around([0.8, 0.75]));
    let mut frames = 0;
    while !waiting.has_ended() {
        assert!(frames < 200 && !screen.textures.view(beside).unwrap().is_converged(), "{frames}");
        screen.set_mapping(0, &around([0.1 + 0.05 * f64::from(frames % 16), 0.3]));
        screen.frame_of(&[(ViewId::MAIN, PICTURE, 0..1), (beside, PICTURE, 1..2)]).unwrap();
        frames += 1;
    }
    assert!(frames > 16, "it was looked at for a jitter cycle: {frames}");
    assert!(
        screen.textures.view(beside).unwrap().is_converged() && !screen.textures.inspect().is_converged()
    );
    assert!(pollster::block_on(waiting));
    // A jump is known before it is drawn.
    screen.textures.view_mut(beside).unwrap().cut();
    assert!(!screen.textures.view(beside).unwrap().is_converged());
    let [lost, dropped] = [(); 2].map(|()| screen.textures.view_mut(beside).unwrap().converged());
    screen.textures.view_mut(beside).unwrap().remove();
    screen.frame_of(&[(ViewId::MAIN, PICTURE, 0..1)]).unwrap();
    assert!(!pollster::block_on(lost));
    drop(screen);
    assert!(!pollster::block_on(dropped));
}
