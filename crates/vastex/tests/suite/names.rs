//! Every type in a public signature can be named from `vastex` alone: what an application writes, stores and matches, without a dependency of
//! its own on the other crates or on `wgpu`.

use std::sync::Arc;

use vastex::{
    Description, Dims, Error, Feedback, Geometry, GeometrySpec, Layer, LayerFormat, Level, PageContents,
    PageId, PageIdError, PagePos, PageSet, RamCache, ReadError, ReadFuture, TailLayout, TextureNumber, Tile,
    TileSource, ViewId, WantedPage,
};

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
    (vastex::FileError, vastex::GeometryBytesError, vastex::LayerError, vastex::PoolError, vastex::Slot),
    (vastex::TraceError, vastex::TraceRecordError, vastex::Container, vastex::Info, vastex::LoadError),
    (vastex::StoreError, Option<Arc<dyn vastex::Store>>, Arc<vastex::RamBudget>),
    (vastex::wgpu::Device, vastex::wgpu::Queue),
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
        Error::Trace(error) => vastex::TraceRecordError::to_string(error),
        Error::TailFailed(error) => vastex::LoadError::to_string(error),
        other => other.to_string(),
    };
    assert!(named(&Error::OtherSettings).contains("prepare it again"));
    assert!(std::mem::size_of::<Mentioned>() > 0);
}
