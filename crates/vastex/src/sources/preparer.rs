//! Textures that are read before they are added: the tail, decoded for the device, and of small textures that
//! are kept whole every level.

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use vastex_core::Description;
use vastex_tiles::{Clock, RamBudget, RamCache, SystemClock, TileSource};
use vastex_wgpu::VolumeFilters;

use super::{DecodedSource, WholeSource, held_description, tail, whole_description};
use crate::error::Error;
use crate::settings::{Settings, TextureSettings};

/// Reads what a texture needs before it can be added, on any thread:
/// [`Textures::preparer`](crate::Textures::preparer) makes one.
///
/// A preparer knows the settings and the formats of the device, and holds the device, whose filters are tried
/// when a volume is prepared, but not the textures; with them it shares only the main memory for encoded
/// tiles ([`Settings::ram_cache_bytes`]). Two are `==` if each may add what the other has prepared.
#[derive(Clone, Debug)]
pub struct Preparer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    /// How volumes are taken to be filtered, where somebody said so.
    filters: Option<VolumeFilters>,
    features: wgpu::Features,
    /// Texels per side of the largest texture of the device.
    most_side: u32,
    whole_bytes: u64,
    /// Main memory for encoded tiles, shared with the textures.
    ram: Arc<RamBudget>,
    read_time_out: Duration,
}

/// A texture that has been read as far as [`Textures::add`](crate::Textures::add) needs, so that it need not
/// wait for anything.
///
/// Takes the main memory of one decoded tile, or of all texels of a texture that is kept whole.
pub struct Prepared(Box<Inner>);

struct Inner {
    plan: Plan,
    tail: Bytes,
    preparer: Preparer,
}

/// What is to be read of a texture, and how.
struct Plan {
    /// As the application gave it.
    given: Arc<dyn TileSource>,
    settings: TextureSettings,
    /// As the source has it, or where it is kept whole with all levels in its tail.
    stored: Arc<Description>,
    /// As the device holds it.
    held: Arc<Description>,
    is_whole: bool,
    /// What the loader reads from, caches in front; its tiles are as `held` says.
    source: Arc<dyn TileSource>,
    /// By which it is overdue.
    clock: Arc<dyn Clock>,
}

/// The parts of a texture that is added.
pub(crate) struct PreparedParts {
    pub(crate) settings: TextureSettings,
    pub(crate) stored: Arc<Description>,
    pub(crate) held: Arc<Description>,
    pub(crate) is_whole: bool,
    pub(crate) source: Arc<dyn TileSource>,
    pub(crate) tail: Bytes,
}

impl PartialEq for Preparer {
    fn eq(&self, other: &Preparer) -> bool {
        // Whose main memory it is does not matter: a texture that goes elsewhere is given a cache there.
        let of = |preparer: &Preparer| {
            let &Preparer { features, most_side, whole_bytes, read_time_out, .. } = preparer;
            (features, most_side, whole_bytes, read_time_out)
        };
        let is_alike = self.device == other.device || self.filters() == other.filters();
        of(self) == of(other) && self.filters == other.filters && is_alike
    }
}

impl Preparer {
    pub(crate) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        settings: &Settings,
        ram: &Arc<RamBudget>,
    ) -> Preparer {
        // Of the features only these decide what a tile is on the device.
        let features = device.features() & wgpu::Features::TEXTURE_COMPRESSION_BC;
        let most_side = device.limits().max_texture_dimension_2d;
        let &Settings { whole_bytes, read_time_out, volume_filters: filters, .. } = settings;
        let (device, queue, ram) = (device.clone(), queue.clone(), ram.clone());
        Preparer { device, queue, filters, features, most_side, whole_bytes, ram, read_time_out }
    }

    fn filters(&self) -> VolumeFilters {
        self.filters.unwrap_or_else(|| VolumeFilters::of(&self.device, &self.queue))
    }

    /// Reads and decodes what [`Textures::add`](crate::Textures::add) needs of a texture: its coarsest
    /// levels, one tile; of one that is kept whole ([`Settings::whole_bytes`]) all of its tiles, one after
    /// the other.
    ///
    /// All work is done where the future is polled: on a thread of the application's (`pollster::block_on`
    /// does that), by its executor, or in a browser by the page's. The source is read and the tile decoded
    /// there, so a source with blocking reads, as of files, blocks that thread, which should not be the one
    /// that draws. There is no time-out; to give up, drop the future. Nothing else has to be called
    /// meanwhile, neither [`Textures::update`](crate::Textures::update) nor any other method.
    ///
    /// Fails if a filter is set for a layer that the texture lacks, and if the tile cannot be read or
    /// decoded.
    ///
    /// ```no_run
    /// # use std::sync::mpsc::{Receiver, channel};
    /// # use vastex::{Error, Prepared, Textures};
    /// # fn load(textures: &Textures) -> Result<Receiver<Result<Prepared, Error>>, Error> {
    /// let (preparer, source) = (textures.preparer(), vastex::open("earth.vastex")?);
    /// let (done, arrived) = channel();
    /// std::thread::spawn(move || done.send(pollster::block_on(preparer.read(source))));
    /// // ... in a frame after that, once it has arrived: textures.add(arrived.try_recv()??)?
    /// # Ok(arrived) }
    /// ```
    pub async fn read(&self, source: Arc<dyn TileSource>) -> Result<Prepared, Error> {
        self.read_with(source, TextureSettings::default()).await
    }

    /// Reads and prepares a texture as [`Preparer::read`] does, with settings of its own.
    pub async fn read_with(
        &self,
        source: Arc<dyn TileSource>,
        settings: TextureSettings,
    ) -> Result<Prepared, Error> {
        let plan = self.plan(source, settings, true)?;
        let tail = tail::read(&plan.source).await?;
        Ok(Prepared(Box::new(Inner { plan, tail, preparer: self.clone() })))
    }

    /// As [`Preparer::read_with`], without a future: waits for as long as reads may take, and in a browser
    /// not at all.
    pub fn read_blocking(
        &self,
        source: Arc<dyn TileSource>,
        settings: TextureSettings,
    ) -> Result<Prepared, Error> {
        // A browser cannot wait for all of a texture.
        let plan = self.plan(source, settings, !cfg!(target_family = "wasm"))?;
        let tail = tail::read_blocking(&plan.source, self.read_time_out, &plan.clock)?;
        Ok(Prepared(Box::new(Inner { plan, tail, preparer: self.clone() })))
    }

    fn plan(
        &self,
        given: Arc<dyn TileSource>,
        settings: TextureSettings,
        may_be_whole: bool,
    ) -> Result<Plan, Error> {
        let stored = given.description().clone();
        if let Some(name) = settings.unknown_layer(&stored.layers) {
            let names: Vec<&str> = stored.layers.iter().map(|layer| &*layer.name).collect();
            return Err(Error::FilterLayer { name: name.into(), layers: names.join(", ") });
        }
        let whole = if may_be_whole { self.whole_of(&*given) } else { None };
        let is_whole = whole.is_some();
        let (stored, source, clock): (_, Arc<dyn TileSource>, Arc<dyn Clock>) = match whole {
            Some(whole) => {
                let source = WholeSource::new(given.clone(), whole.clone());
                // All of its pages are one read, which may take as long as pages come.
                let clock = source.progress().clone();
                (whole, Arc::new(source), clock)
            }
            None => (stored, cached(&given, &self.ram), Arc::new(SystemClock::new())),
        };
        let held = held_description(&stored, self.features, || self.filters());
        let source = as_held(source, &stored, &held);
        // The first call may visit each page.
        let _ = source.contents();
        Ok(Plan { given, settings, stored, held, is_whole, source, clock })
    }

    /// How a texture would be held whole, where it is small enough for that.
    fn whole_of(&self, source: &dyn TileSource) -> Option<Arc<Description>> {
        let most = self.whole_bytes;
        let is_all_there = most > 0 && source.present().is_none();
        let described = || whole_description(source.description(), self.features, most, self.most_side);
        is_all_there.then(described).flatten()
    }
}

impl Prepared {
    /// The texture as its source describes it.
    pub fn description(&self) -> &Arc<Description> {
        self.0.plan.given.description()
    }

    /// The source that was read, to be prepared again for other textures.
    pub fn into_source(self) -> Arc<dyn TileSource> {
        self.0.plan.given
    }

    /// Returns true if it was prepared as this one prepares.
    pub(crate) fn is_by(&self, preparer: &Preparer) -> bool {
        self.0.preparer == *preparer
    }

    /// What an add needs, its encoded tiles kept within `ram`; shared, so that one that fails can give the
    /// whole back.
    pub(crate) fn parts(&self, ram: &Arc<RamBudget>) -> PreparedParts {
        let Plan { given, settings, stored, held, is_whole, source, .. } = &self.0.plan;
        let source = match *is_whole || Arc::ptr_eq(&self.0.preparer.ram, ram) {
            true => source.clone(),
            // Prepared by other textures with the same settings.
            false => as_held(cached(given, ram), stored, held),
        };
        PreparedParts {
            settings: settings.clone(),
            stored: stored.clone(),
            held: held.clone(),
            is_whole: *is_whole,
            source,
            tail: self.0.tail.clone(),
        }
    }
}

/// A source whose encoded tiles are kept within a budget.
fn cached(given: &Arc<dyn TileSource>, ram: &Arc<RamBudget>) -> Arc<dyn TileSource> {
    Arc::new(RamCache::within(given.clone(), ram.clone()))
}

/// A source whose tiles are as the device holds them.
fn as_held(
    source: Arc<dyn TileSource>,
    stored: &Arc<Description>,
    held: &Arc<Description>,
) -> Arc<dyn TileSource> {
    match held == stored {
        true => source,
        false => Arc::new(DecodedSource::new(source, held.clone())),
    }
}

impl std::fmt::Debug for Prepared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (size, is_whole) = (self.description().geometry.size(), self.0.plan.is_whole);
        f.debug_struct("Prepared").field("size", &size).field("is_whole", &is_whole).finish_non_exhaustive()
    }
}
