//! Every type in a public signature can be named from `vastex` alone: what an application writes, stores and
//! matches, without a dependency of its own on the other crates or on `wgpu`.

use std::sync::Arc;

use crate::common::property;
use crate::labels::Labelled;
use vastex::source::{PageContents, PageIdError, PageSet, RamCache, ReadError, ReadFuture, TailLayout, Tile};
use vastex::{
    AddressMode, Bytes, Description, Dims, Error, Feedback, FeedbackMode, Geometry, GeometrySpec, Layer,
    LayerFormat, Level, PageId, PagePos, Settings, TextureNumber, Textures, TileSource, ViewId, WantedPage,
};
use vastex_tiles::PropertySource;
use vastex_wgpu::test_device::TestDevice;

/// A source with all that a source may say.
struct Own {
    description: Arc<Description>,
    present: Arc<PageSet>,
    contents: Option<Arc<PageContents>>,
}

impl TileSource for Own {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn present(&self) -> Option<&Arc<PageSet>> {
        Some(&self.present)
    }

    fn contents(&self) -> Option<&Arc<PageContents>> {
        self.contents.as_ref()
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move { Err::<Tile, _>(ReadError::NoSuchTile { pos }) })
    }
}

/// What is mentioned by the errors, tiers and sources that applications match on or hold.
type Mentioned = (
    (
        vastex::source::FileError,
        vastex::source::GeometryBytesError,
        vastex::source::LayerError,
        vastex::PoolError,
        vastex::Slot,
    ),
    (
        vastex::prefetch::TraceError,
        vastex::prefetch::TraceRecordError,
        vastex::source::Container,
        vastex::source::Info,
        vastex::source::LoadError,
    ),
    (vastex::NodataValueError, vastex::source::ContainerVolume, vastex::source::Compression),
    (vastex::source::StoreError, Option<Arc<dyn vastex::source::Store>>, Arc<vastex::source::RamBudget>),
    (vastex::wgpu::Device, vastex::wgpu::Queue, Bytes),
);

#[test]
fn an_application_names_what_it_needs() {
    let geometry = Geometry::new(GeometrySpec::image(1000, 500)).unwrap();
    let (level, tail): (&Level, &TailLayout) = (geometry.level(0), geometry.tail());
    assert!(level.pages[0] > 1 && tail.first_level() > 0);
    let layers = vec![Layer::new("color", LayerFormat::Rgba8Srgb)];
    let description = Arc::new(Description::new(geometry.clone(), layers));
    let present = Arc::new(PageSet::from_pages(&geometry, |_| true));
    let own = RamCache::new(Own { description, present, contents: None }, 1 << 20);
    assert!(own.present().is_some() && own.contents().is_none());

    let texture = TextureNumber::new(0).unwrap();
    let page: Result<PageId, PageIdError> = PageId::new(texture, Dims::D2, PagePos::new_2d(0, 1, 1));
    let wanted = WantedPage { page: page.unwrap(), pixels: 5, eighth: 0 };
    let feedback = Feedback::of_pages(0, vec![wanted]);
    assert_eq!(feedback.view, ViewId::MAIN);

    // What fails has a name, too.
    let named = |error: &Error| match error {
        Error::Pool(error) => vastex::PoolError::to_string(error),
        Error::Trace(error) => vastex::prefetch::TraceRecordError::to_string(error),
        Error::TailFailed { error, .. } => vastex::source::LoadError::to_string(error),
        other => other.to_string(),
    };
    assert!(named(&Error::OtherSettings).contains("prepare it again"));
    assert!(std::mem::size_of::<Mentioned>() > 0);
}

/// Whoever reads the crate's front page finds every function that a shader may call, of images, of volumes
/// and of labels, in every mode of feedback.
#[test]
fn the_front_page_names_every_function_of_shaders() {
    let front = include_str!("../../src/lib.rs");
    let page = front.split("mod cpu;").next().unwrap();
    let spec = GeometrySpec { page: 16, ..GeometrySpec::volume([50, 40, 30]) };
    for feedback in FeedbackMode::ALL {
        let gpu = TestDevice::new();
        let settings = Settings { feedback: Some(feedback), ..Settings::default() };
        let mut textures = Textures::new(&gpu.device, &gpu.queue, settings).unwrap();
        let sources: [(Arc<dyn TileSource>, &str); 3] = [
            (property([100, 100], 16, AddressMode::Clamp), "vastex_sample"),
            (Arc::new(PropertySource::new(Geometry::new(spec).unwrap())), "vastex_brick_sample"),
            (Labelled::new(LayerFormat::R32Uint), "vastex_brick_whole"),
        ];
        for (source, own) in sources {
            let texture = textures.add_blocking(source).unwrap();
            let text = textures.wgsl(&textures.kinds(texture).unwrap());
            let names = text.split("fn ").skip(1).filter_map(|rest| rest.split('(').next());
            let public: Vec<&str> = names.filter(|name| name.starts_with("vastex_")).collect();
            assert!(public.len() > 20 && public.contains(&own), "{public:?}");
            for name in public {
                let is_named =
                    [format!("`{name}`"), format!("`{name}(")].iter().any(|name| page.contains(name));
                assert!(is_named, "{name} is not on the front page");
            }
        }
    }
}
