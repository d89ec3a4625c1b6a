//! Small textures, kept whole: a decorator that puts all levels of a small texture into its tail.
//!
//! What is all tail has one tile, which is resident from the beginning and stays: an ordinary texture with
//! its levels beside one another, sampled by the same shaders, without a page table that anybody reads and
//! without a page that anybody asks for.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use vastex_core::{Description, Dims, Geometry, GeometrySpec, Layer, PageContents, PagePos, PageSet, Region};
use vastex_tiles::{
    Clock, Codec, ReadError, ReadFuture, ReadLimit, SourceKey, SystemClock, Tiers, Tile, TileSource,
};
use vastex_wgpu::held_format;

/// The description of the same texture with all levels in its tail, for pages as small as that allows; `None`
/// if the tile would take more than `most_bytes` as a device with these features holds it, or have more than
/// `most_side` texels per side.
pub(crate) fn whole_description(
    stored: &Description,
    features: wgpu::Features,
    most_bytes: u64,
    most_side: u32,
) -> Option<Arc<Description>> {
    let (geometry, spec) = (&stored.geometry, stored.geometry.spec());
    let begins_on_blocks = |layer: &Layer| spec.page.is_multiple_of(unit(layer));
    if spec.dims != Dims::D2 || !stored.layers.iter().all(begins_on_blocks) {
        return None;
    }
    let factors: Vec<[u32; 3]> = geometry.levels()[1..].iter().map(|level| level.factor).collect();
    let [width, height, _] = geometry.size();
    // Tiles are a whole number of blocks of every layer.
    let first = width.max(height).checked_add(2 * spec.border)?.checked_next_multiple_of(spec.tail_align)?;
    let sides = (first..=most_side).step_by(spec.tail_align as usize);
    let described = |side: u32| {
        let spec = GeometrySpec { page: side - 2 * spec.border, ..*spec };
        let geometry = Geometry::with_factors(spec, &factors).ok()?;
        Some(Description { geometry, ..stored.clone() })
    };
    let fits = |whole: &Description| held_bytes(whole, features) <= most_bytes;
    // Pages of twice the size hold all levels in any case.
    let whole =
        sides.map_while(described).take_while(fits).find(|whole| whole.geometry.tail().first_level() == 0)?;
    whole.check().is_ok().then(|| Arc::new(whole))
}

/// Texels of the texture along one block of a layer.
fn unit(layer: &Layer) -> u32 {
    layer.scale * layer.format.block_side()
}

fn held_bytes(description: &Description, features: wgpu::Features) -> u64 {
    let mut held = description.clone();
    held.layers.iter_mut().for_each(|layer| layer.format = held_format(layer.format, features));
    held.tile_bytes() as u64
}

/// How long pages have kept one waiting: a clock that tells the longest time so far without a page, and
/// stands still while they come sooner than that. What is overdue by it has had no page for so long.
pub(crate) struct Progress {
    clock: Arc<dyn Clock>,
    since: Mutex<Since>,
}

struct Since {
    /// When the last page came.
    page: Duration,
    longest: Duration,
}

impl Progress {
    fn new(clock: Arc<dyn Clock>) -> Progress {
        let since = Since { page: clock.now(), longest: Duration::ZERO };
        Progress { clock, since: Mutex::new(since) }
    }

    fn page_came(&self) {
        let now = self.clock.now();
        self.since.lock().unwrap_or_else(PoisonError::into_inner).page = now;
    }
}

impl Clock for Progress {
    fn now(&self) -> Duration {
        let now = self.clock.now();
        let mut since = self.since.lock().unwrap_or_else(PoisonError::into_inner);
        since.longest = since.longest.max(now.saturating_sub(since.page));
        since.longest
    }
}

/// A source with one tile, made of all those of `source`.
pub(crate) struct WholeSource {
    source: Arc<dyn TileSource>,
    whole: Arc<Description>,
    progress: Arc<Progress>,
}

impl WholeSource {
    /// `whole` is what [`whole_description`] made of the source's.
    pub(crate) fn new(source: Arc<dyn TileSource>, whole: Arc<Description>) -> WholeSource {
        let progress = Arc::new(Progress::new(Arc::new(SystemClock::new())));
        WholeSource { source, whole, progress }
    }

    /// The clock for reads of it.
    pub(crate) fn progress(&self) -> &Arc<Progress> {
        &self.progress
    }

    async fn whole_tile(&self) -> Result<Vec<u8>, ReadError> {
        let (stored, mut whole) = (self.source.description(), vec![0; self.whole.tile_bytes()]);
        for pos in stored.geometry.pages() {
            let damaged = |error: vastex_tiles::DecodeError| ReadError::Damaged {
                pos,
                place: "a texture that is read whole".into(),
                fault: error.to_string(),
            };
            let tile = self.source.read(pos).await?;
            self.progress.page_came();
            let tile = tile.decode(stored).map_err(damaged)?;
            for part in self.parts(pos) {
                (0..stored.layers.len()).for_each(|layer| self.copy(layer, &part, &tile, &mut whole));
            }
        }
        Ok(whole)
    }

    /// What a tile holds: a part of one level, or all of several. Borders are copied with what they border
    /// on.
    fn parts(&self, pos: PagePos) -> Vec<Part> {
        let (from, to) = (&self.source.description().geometry, &self.whole.geometry);
        let boxed = |level: u8| from.level_box_of_tail(level).size;
        if from.is_tail(pos) {
            let all = |level| Part {
                from: from.tail().offset(level),
                to: to.tail().offset(level),
                size: boxed(level),
            };
            return (from.tail().first_level()..=from.coarsest()).map(all).collect();
        }
        let (first, offset) = (from.level_texel_from_page(pos), to.tail().offset(pos.level));
        let (tile, level) = (from.tile(), boxed(pos.level));
        vec![Part {
            from: [0; 3],
            to: std::array::from_fn(|a| offset[a] + first[a] as u32),
            size: std::array::from_fn(|a| tile[a].min(level[a] - first[a] as u32)),
        }]
    }

    /// Copies a part of a layer, row of blocks by row of blocks.
    fn copy(&self, layer: usize, part: &Part, tile: &[u8], whole: &mut [u8]) {
        let stored = self.source.description();
        let (described, from, to) = (
            &stored.layers[layer],
            &tile[stored.layer_range(layer)],
            &mut whole[self.whole.layer_range(layer)],
        );
        let (unit, block) = (unit(described), described.format.block_bytes());
        let blocks = |texels: u32| (texels / unit) as usize;
        let columns = |description: &Description| blocks(description.geometry.tile()[0]);
        let (from_columns, to_columns) = (columns(stored), columns(&self.whole));
        let row = blocks(part.size[0].next_multiple_of(unit)) * block;
        for y in 0..blocks(part.size[1].next_multiple_of(unit)) {
            let at = |columns: usize, first: [u32; 3]| {
                ((blocks(first[1]) + y) * columns + blocks(first[0])) * block
            };
            let (from_at, to_at) = (at(from_columns, part.from), at(to_columns, part.to));
            to[to_at..to_at + row].copy_from_slice(&from[from_at..from_at + row]);
        }
    }
}

/// What is copied from a tile into the whole, in texels of the texture; a box begins on whole blocks of every
/// layer.
struct Part {
    from: [u32; 3],
    to: [u32; 3],
    size: [u32; 3],
}

#[deny(clippy::missing_trait_methods)]
impl TileSource for WholeSource {
    /// Nothing: its tiles are others, so it answers for itself throughout.
    fn behind(&self) -> Option<&dyn TileSource> {
        None
    }

    fn description(&self) -> &Arc<Description> {
        &self.whole
    }

    fn present(&self) -> Option<&Arc<PageSet>> {
        None
    }

    fn contents(&self) -> Option<&Arc<PageContents>> {
        None
    }

    /// Nothing: its tile is made anew in every run.
    fn identity(&self) -> Option<SourceKey> {
        None
    }

    fn read_limit(&self) -> Option<&Arc<ReadLimit>> {
        self.source.read_limit()
    }

    fn blocks(&self) -> bool {
        self.source.blocks()
    }

    fn add_tiers(&self, tiers: &mut Tiers) {
        self.source.add_tiers(tiers);
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            match self.whole.geometry.is_tail(pos) {
                true => Ok(Tile { codec: Codec::Raw, bytes: self.whole_tile().await?.into() }),
                false => Err(ReadError::NoSuchTile { pos }),
            }
        })
    }

    /// Nothing: whoever adds a texture keeps its tail, which is all of this one.
    fn at_hand(&self, _pos: PagePos) -> Option<Tile> {
        None
    }

    fn changed(&self, region: &Region) {
        self.source.changed(region);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastex_core::{AddressMode, LayerFormat};
    use vastex_tiles::PropertySource;

    fn source(size: [u32; 2], page: u32, border: u32, mode: AddressMode) -> Arc<dyn TileSource> {
        let address = [mode; 3];
        let spec = GeometrySpec { page, border, address, ..GeometrySpec::image(size[0], size[1]) };
        Arc::new(PropertySource::new(Geometry::new(spec).unwrap()))
    }

    fn whole(source: &Arc<dyn TileSource>, most_bytes: u64) -> Option<Arc<Description>> {
        whole_description(source.description(), wgpu::Features::empty(), most_bytes, 4096)
    }

    /// A generated source makes its tail as it would make any: the whole of one must be the same, borders
    /// included.
    #[test]
    fn the_whole_is_the_tail_that_the_source_would_have_made() {
        let modes = [AddressMode::Clamp, AddressMode::Wrap, AddressMode::Mirror, AddressMode::Border];
        for (mode, [width, height, page, border]) in
            modes.into_iter().zip([[300, 200, 32, 4], [77, 310, 40, 2], [128, 128, 64, 8], [500, 9, 16, 1]])
        {
            let source = source([width, height], page, border, mode);
            let described = whole(&source, 16 << 20).unwrap();
            assert_eq!(described.geometry.tail().first_level(), 0);
            let expected = PropertySource::new(described.geometry.clone());
            let tail = described.geometry.tail_pos();
            let made = pollster::block_on(WholeSource::new(source, described.clone()).read(tail)).unwrap();
            let expected = pollster::block_on(expected.read(tail)).unwrap().decode(&described).unwrap();
            let made = made.decode(&described).unwrap();
            // What lies between the levels nobody looks at.
            let columns = described.geometry.tile()[0] as usize;
            for level in 0..=described.geometry.coarsest() {
                let (first, size) = (
                    described.geometry.tail().offset(level),
                    described.geometry.level_box_of_tail(level).size,
                );
                for y in first[1]..first[1] + size[1] {
                    let begin = (y as usize * columns + first[0] as usize) * 4;
                    let row = begin..begin + size[0] as usize * 4;
                    assert!(made[row.clone()] == expected[row], "{mode:?}: level {level}, row {y}");
                }
            }
        }
    }

    #[derive(Default)]
    struct Hand(Mutex<Duration>);

    impl Clock for Hand {
        fn now(&self) -> Duration {
            *self.0.lock().unwrap()
        }
    }

    #[test]
    fn no_time_passes_while_pages_come_as_fast_as_before() {
        let hand = Arc::new(Hand::default());
        let progress = Progress::new(hand.clone());
        let after = |seconds| {
            *hand.0.lock().unwrap() += Duration::from_secs(seconds);
            progress.now().as_secs()
        };
        assert_eq!(after(3), 3);
        for _ in 0..10 {
            progress.page_came();
            assert_eq!([after(1), after(1), after(1)], [3; 3]);
        }
        assert_eq!([after(4), after(5)], [7, 12]);
        progress.page_came();
        assert_eq!([after(11), after(2)], [12, 13]);
    }

    #[test]
    fn what_does_not_fit_stays_as_it_is() {
        let small = source([300, 200], 32, 4, AddressMode::Clamp);
        let bytes = whole(&small, 16 << 20).unwrap().tile_bytes() as u64;
        assert!(whole(&small, bytes).is_some() && whole(&small, bytes - 1).is_none());
        assert!(whole(&small, 0).is_none());
        let huge = source([1 << 30, 1 << 30], 128, 4, AddressMode::Clamp);
        assert!(whole(&huge, 1 << 40).is_none());
        let description = small.description();
        assert!(whole_description(description, wgpu::Features::empty(), 16 << 20, 256).is_none());
    }

    #[test]
    fn a_compressed_layer_is_copied_block_by_block() {
        let layers = [Layer::new("color", LayerFormat::Bc1), Layer::new("normal", LayerFormat::Bc5)];
        let tail_align = Description::tail_align(&layers);
        let spec = GeometrySpec { page: 64, tail_align, ..GeometrySpec::image(200, 150) };
        let stored = Description::new(Geometry::new(spec).unwrap(), layers.to_vec());
        let whole = whole_description(&stored, wgpu::Features::empty(), 4 << 20, 4096).unwrap();
        assert!(whole.check().is_ok());
        let decoded = whole.geometry.tile_texels() * (4 + 2);
        assert!(whole_description(&stored, wgpu::Features::empty(), decoded, 4096).is_some());
        assert!(whole_description(&stored, wgpu::Features::empty(), decoded - 1, 4096).is_none());
    }
}
