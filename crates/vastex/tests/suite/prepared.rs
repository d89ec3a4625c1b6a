//! Textures that are read before they are added: what is read when and by whom, what an add changes, and what
//! is refused.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::common::{Mapping, Screen, property, settings};
use vastex::source::ReadFuture;
use vastex::{
    AddressMode, Description, Error, Geometry, GeometrySpec, GpuError, PagePos, PoolSettings, Prepared,
    Preparer, Settings, TextureSettings, Textures, TileSource,
};
use vastex_tiles::{PropertySource, ends_within};
use vastex_wgpu::test_device::TestDevice;

const SIZE: [u32; 2] = [1000, 777];
const PAGE: u32 = 32;

/// A source that counts its reads.
struct Counted(Arc<dyn TileSource>, AtomicUsize);

impl Counted {
    fn new() -> Arc<Counted> {
        Arc::new(Counted(property(SIZE, PAGE, AddressMode::Clamp), AtomicUsize::new(0)))
    }

    fn reads(&self) -> usize {
        self.1.load(Ordering::SeqCst)
    }
}

impl TileSource for Counted {
    fn description(&self) -> &Arc<Description> {
        self.0.description()
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        self.1.fetch_add(1, Ordering::SeqCst);
        self.0.read(pos)
    }
}

fn textures(settings: Settings) -> (TestDevice, Textures) {
    let gpu = TestDevice::new();
    let textures = Textures::new(&gpu.device, &gpu.queue, settings).unwrap();
    (gpu, textures)
}

/// On a thread of its own, as an application would.
fn read(preparer: &Preparer, source: Arc<dyn TileSource>) -> Prepared {
    let preparer = preparer.clone();
    let patience = std::time::Duration::from_secs(300);
    ends_within(patience, move || pollster::block_on(preparer.read(source))).unwrap().unwrap()
}

#[test]
fn what_an_add_needs_has_been_read_before_it() {
    for whole_bytes in [0, 64 << 20] {
        let (_gpu, mut textures) = textures(Settings { whole_bytes, ..settings() });
        let source = Counted::new();
        let prepared = read(&textures.preparer(), source.clone());
        let reads = source.reads();
        let pages = source.description().geometry.page_count() as usize;
        assert_eq!(reads, if whole_bytes == 0 { 1 } else { pages });
        let texture = textures.add(prepared).unwrap();
        textures.update().unwrap();
        assert_eq!(source.reads(), reads, "the add has read");
        assert_eq!(textures.inspect().textures().collect::<Vec<_>>(), [texture]);
    }
}

#[test]
fn it_may_be_read_anywhere() {
    fn is<T: Clone + Send + Sync>() {}
    fn is_send<T: Send>(_: &T) {}
    is::<Preparer>();
    let (_gpu, textures) = textures(settings());
    let preparer = textures.preparer();
    is_send(&preparer.read(Counted::new()));
    is_send(&read(&preparer, Counted::new()));
}

/// The tails of the textures that come go where tiles in view are.
#[test]
fn a_picture_between_add_and_update_is_as_it_was() {
    const TILE_BYTES: u64 = 40 * 40 * 4;
    let settings = Settings { pools: PoolSettings::of_bytes(16 * TILE_BYTES), ..settings() };
    let mut screen = Screen::new(&[property(SIZE, PAGE, AddressMode::Clamp)], settings);
    screen.set_mapping(0, &Mapping::new(SIZE, [0.5, 0.5], 1.1, 1.0, 0.2));
    screen.converge();
    let pages = |screen: &Screen| screen.textures.inspect().pool_usage().pools[0].textures[0].pages;
    let mut made_room = 0;
    for _ in 0..12 {
        let (before, pages_before) = (screen.picture(), pages(&screen));
        let prepared = read(&screen.textures.preparer(), Counted::new());
        let added = screen.textures.add(prepared);
        assert!(screen.picture() == before, "the add has changed a picture");
        if added.is_err() {
            break;
        }
        made_room += u32::from(pages(&screen) < pages_before);
        screen.frame().unwrap();
    }
    assert!(
        screen.textures.inspect().textures().count() > 4 && made_room > 2,
        "a tile made room for {made_room}"
    );
}

#[test]
fn what_was_prepared_for_others_is_given_back() {
    let (_gpu, of_pages) = textures(settings());
    let (_other, mut of_wholes) = textures(Settings { whole_bytes: 64 << 20, ..settings() });
    let source = Counted::new();
    let refused = of_wholes.add(read(&of_pages.preparer(), source.clone())).unwrap_err();
    assert!(matches!(refused.error, Error::OtherSettings), "{refused}");
    assert!(refused.to_string().contains("Textures::preparer"), "{refused}");
    assert_eq!(of_wholes.inspect().textures().count(), 0);
    let given_back = refused.prepared.into_source();
    of_wholes.add(read(&of_wholes.preparer(), given_back)).unwrap();
}

#[test]
fn what_has_two_axes_is_no_volume_and_is_given_back() {
    let (_gpu, mut textures) = textures(settings());
    let refused = textures.add_volume(read(&textures.preparer(), Counted::new())).unwrap_err();
    assert!(matches!(refused.error, Error::NoVolume { size: SIZE }), "{refused}");
    assert!(refused.to_string().contains("1000x777") && refused.to_string().contains("Textures::add"));
    assert_eq!(textures.inspect().textures().count(), 0);
    textures.add(refused.prepared).unwrap();
    let spec = GeometrySpec { page: 16, ..GeometrySpec::volume([50, 40, 30]) };
    let source = PropertySource::new(Geometry::new(spec).unwrap());
    let volume = textures.add_volume(read(&textures.preparer(), Arc::new(source))).unwrap();
    assert!(textures.inspect().textures().any(|texture| texture == volume));
}

#[test]
fn a_lost_device_gives_it_back_and_another_takes_it() {
    let (gpu, mut textures) = textures(settings());
    let source = Counted::new();
    let prepared = read(&textures.preparer(), source.clone());
    gpu.device.destroy();
    let refused = textures.add(prepared).unwrap_err();
    assert!(matches!(refused.error, Error::Gpu(GpuError::DeviceLost)), "{refused}");
    let gpu = TestDevice::new();
    textures.memory().restore(&gpu.device, &gpu.queue).unwrap();
    textures.add(refused.prepared).unwrap();
    textures.update().unwrap();
    assert_eq!(source.reads(), 1, "it was not read again");
}

#[test]
fn what_cannot_be_added_is_refused_before_anything_is_read() {
    let (_gpu, textures) = textures(settings());
    let filters = [("height".to_owned(), vastex::Filter::Nearest)].into();
    let (source, asked) = (Counted::new(), TextureSettings { filters, ..Default::default() });
    let refused = pollster::block_on(textures.preparer().read_with(source.clone(), asked)).unwrap_err();
    assert!(matches!(&refused, Error::FilterLayer { name, .. } if name == "height"), "{refused}");
    assert_eq!(source.reads(), 0);
}
