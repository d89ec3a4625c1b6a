//! The textures of one device: how they come in, and what an application's pipelines need of them.
//!
//! What happens each frame is `frame`'s business.

use std::sync::Arc;

use vastex_core::{
    Description, Dims, PageId, PageState, Pager, PagerSettings, PoolLayout, TableChange, TextureId,
};
use vastex_tiles::{Loader, RamCache, Tile, TileSource};
use vastex_wgpu::{
    BindLayout, FeedbackTarget, Pool, Readback, ShaderOptions, TableBuffers, TableChanger, ViewBuffer,
    limits, wgsl,
};

use crate::error::Error;
use crate::lock_step::LockStep;
use crate::settings::{Pace, Settings};
use crate::stats::Counters;

/// The virtual textures that share a pool, and the loop that keeps them filled.
///
/// The first texture decides the shape of the pool: tile size and layer formats.
pub struct Textures {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    settings: Settings,
    pub(crate) view: ViewBuffer,
    pub(crate) feedback: Option<FeedbackPath>,
    pub(crate) changer: TableChanger,
    pub(crate) pool: Option<PoolState>,
    pub(crate) textures: Vec<TextureState>,
    pub(crate) groups: BindGroups,
    pub(crate) loader: Loader,
    pub(crate) lock_step: Option<LockStep>,
    pub(crate) frame: u64,
    pub(crate) changes: Vec<TableChange>,
    pub(crate) counters: Counters,
}

/// The pool and who decides what is in it.
pub(crate) struct PoolState {
    pub(crate) pager: Pager,
    pub(crate) gpu: Pool,
    shape: Arc<Description>,
    layout: BindLayout,
}

pub(crate) struct TextureState {
    pub(crate) description: Arc<Description>,
    pub(crate) table: TableBuffers,
}

/// Where feedback is drawn, and its way back.
pub(crate) struct FeedbackPath {
    pub(crate) target: FeedbackTarget,
    pub(crate) readback: Readback,
}

/// The bind group of each texture: `groups[texture]`.
#[derive(Debug, Default)]
pub struct BindGroups(Vec<wgpu::BindGroup>);

impl std::ops::Index<TextureId> for BindGroups {
    type Output = wgpu::BindGroup;

    fn index(&self, texture: TextureId) -> &wgpu::BindGroup {
        &self.0[usize::from(texture.number())]
    }
}

impl Textures {
    /// The format of the target that feedback is drawn into, for the application's feedback pipeline.
    pub const FEEDBACK_FORMAT: wgpu::TextureFormat = vastex_wgpu::FEEDBACK_FORMAT;
    /// The format of the depth buffer of that target.
    pub const FEEDBACK_DEPTH_FORMAT: wgpu::TextureFormat = vastex_wgpu::FEEDBACK_DEPTH_FORMAT;

    /// No textures yet, on the application's own device.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, settings: Settings) -> Result<Textures, Error> {
        let lock_step = match settings.pace {
            Pace::Realtime => None,
            Pace::LockStep { latency_frames } => Some(LockStep::new(latency_frames)),
        };
        Ok(Textures {
            device: device.clone(),
            queue: queue.clone(),
            view: ViewBuffer::new(device, queue),
            feedback: None,
            changer: TableChanger::new(device),
            pool: None,
            textures: Vec::new(),
            groups: BindGroups::default(),
            loader: new_loader(settings.loader_threads)?,
            lock_step,
            frame: 0,
            changes: Vec::new(),
            counters: Counters::default(),
            settings,
        })
    }

    /// Adds a texture: makes the pool if it is the first, and reads the tail, so that there is something to show.
    ///
    /// Costs one read and the texture's page table, 4 bytes a page.
    pub fn add(&mut self, source: Arc<dyn TileSource>) -> Result<TextureId, Error> {
        let description = source.description().clone();
        if description.geometry.dims() == Dims::D3 {
            return Err(Error::Volume);
        }
        let tail = read_tail(&*source)?.decode(&description)?;
        // Whatever can be refused is refused before anything changes.
        TableBuffers::check(&self.device, &description.geometry)?;
        let mut pool = match self.pool.take() {
            Some(pool) => pool,
            None => PoolState::new(&self.device, &self.queue, &self.settings, &description)?,
        };
        let added = pool.check_shape(&description).and_then(|()| self.add_to(&mut pool, &*source, &tail));
        if added.is_ok() || !self.textures.is_empty() {
            self.pool = Some(pool);
        }
        let texture = added?;
        self.loader.add_source(texture, Arc::new(RamCache::new(source, self.settings.ram_cache_bytes)));
        Ok(texture)
    }

    fn add_to(
        &mut self,
        pool: &mut PoolState,
        source: &dyn TileSource,
        tail: &[u8],
    ) -> Result<TextureId, Error> {
        let description = source.description();
        let (texture, slot) = pool.pager.add_texture(&description.geometry, source.present().cloned())?;
        pool.gpu.upload(&self.queue, slot, tail)?;
        let table = TableBuffers::new(&self.device, &self.queue, &description.geometry, texture, slot, 0.0)?;
        self.groups.0.push(pool.layout.bind_group(&self.device, &table, &pool.gpu, &self.view));
        self.textures.push(TextureState { description: description.clone(), table });
        Ok(texture)
    }

    /// The WGSL that goes before the application's own shader: `vastex_sample(uv)` and its kin, for textures of this
    /// one's pool. See [`vastex_wgpu::wgsl`].
    pub fn wgsl(&self, texture: TextureId) -> String {
        wgsl(&ShaderOptions {
            group: self.settings.bind_group_index,
            filter: self.settings.filter,
            atlas: self.pool_of(texture).layout.atlas(),
        })
    }

    /// For the application's pipeline layouts, at [`Settings::bind_group_index`].
    pub fn bind_group_layout(&self, texture: TextureId) -> &wgpu::BindGroupLayout {
        self.pool_of(texture).layout.layout()
    }

    /// Everything that the application's shaders need to sample a texture.
    pub fn bind_group(&self, texture: TextureId) -> &wgpu::BindGroup {
        &self.groups[texture]
    }

    /// What is known of a texture.
    pub fn description(&self, texture: TextureId) -> &Arc<Description> {
        &self.textures[usize::from(texture.number())].description
    }

    /// The state of a page.
    pub fn state(&self, page: PageId) -> PageState {
        self.pool.as_ref().map_or(PageState::Absent, |pool| pool.pager.state(page))
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Textures are never removed, so an id that was given out has a pool.
    #[expect(clippy::expect_used, reason = "an id of another `Textures` is a mistake in the program")]
    fn pool_of(&self, _texture: TextureId) -> &PoolState {
        self.pool.as_ref().expect("a texture of this `Textures`")
    }
}

impl PoolState {
    fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        settings: &Settings,
        shape: &Arc<Description>,
    ) -> Result<PoolState, Error> {
        let layout = PoolLayout::fit(shape, settings.pool_bytes, limits(device))?;
        let formats: Vec<_> = shape.layers.iter().map(|layer| layer.format).collect();
        let gpu = Pool::new(device, queue, &layout, &formats)?;
        let pager = Pager::new(PagerSettings {
            slots: layout.slots(),
            tile_bytes: layout.tile_bytes,
            upload_bytes_per_frame: settings.upload_bytes_per_frame,
            in_flight_bytes: settings.in_flight_bytes,
            mip_bias: true,
        });
        Ok(PoolState { pager, layout: BindLayout::new(device, gpu.atlas()), gpu, shape: shape.clone() })
    }

    fn check_shape(&self, found: &Description) -> Result<(), Error> {
        let shape =
            |d: &Description| (d.geometry.tile(), d.layers.iter().map(|l| l.format).collect::<Vec<_>>());
        if shape(found) == shape(&self.shape) {
            return Ok(());
        }
        let text = |d: &Description| {
            let ([width, height, _], formats) = shape(d);
            format!(
                "{width}x{height} texels of {}",
                formats.iter().map(|f| f.name()).collect::<Vec<_>>().join(", ")
            )
        };
        Err(Error::PoolMismatch { found: text(found), pool: text(&self.shape) })
    }
}

#[cfg(not(target_family = "wasm"))]
fn new_loader(threads: usize) -> Result<Loader, Error> {
    Ok(Loader::new(threads)?)
}

#[cfg(target_family = "wasm")]
fn new_loader(threads: usize) -> Result<Loader, Error> {
    Ok(Loader::new(threads)?)
}

#[cfg(not(target_family = "wasm"))]
fn read_tail(source: &dyn TileSource) -> Result<Tile, Error> {
    Ok(pollster::block_on(source.read(source.description().geometry.tail_pos()))?)
}

/// A browser cannot wait, so the tail must be at hand, as it is for a container once that is open.
#[cfg(target_family = "wasm")]
fn read_tail(source: &dyn TileSource) -> Result<Tile, Error> {
    let mut read = source.read(source.description().geometry.tail_pos());
    match read.as_mut().poll(&mut std::task::Context::from_waker(std::task::Waker::noop())) {
        std::task::Poll::Ready(tile) => Ok(tile?),
        std::task::Poll::Pending => Err(Error::TailPending),
    }
}
