//! The textures of one device: how they come in, and what an application's pipelines need of them.
//!
//! What happens each frame is `frame`'s business.

use std::sync::Arc;

use bytes::Bytes;
use vastex_core::{
    Budgets, Description, Dims, Event, Feedback, GroupId, Layer, LevelRule, PageId, PageState, Pager,
    PoolError, PoolId, TableChange, TextureId, ViewId,
};
use vastex_tiles::{Clock, Loader, RamCache, SystemClock, Tiers, TileSource};
use vastex_wgpu::{
    BindLayout, FeedbackWay, PageSides, ShaderOptions, TableBuffers, TableChanger, TableChoice, TableKinds,
    group_wgsl, wgsl,
};

use crate::by_hand::OpenTickets;
use crate::cpu_tiles::CpuTiles;
use crate::decoded::{DecodedSource, held_description};
use crate::error::Error;
use crate::fades::FadeState;
use crate::feedback::FeedbackPipelines;
use crate::frame::Undone;
use crate::groups::{GroupState, Sampled};
use crate::inspect::AskedPixels;
use crate::layer::LayerId;
use crate::lock_step::LockStep;
use crate::pools::{PoolState, Shape};
use crate::recorder::{Places, Recorder};
use crate::settings::{Sampling, Settings, TextureSettings};
use crate::stats::Counters;
use crate::tables::MovingTables;
use crate::tail;
use crate::telemetry::Telemetry;
use crate::texture_space::TextureSpacePath;
use crate::uploads::UploadState;
use crate::views::ViewState;
use crate::whole::{WholeSource, whole_description};

/// The virtual textures of a device, and the loop that keeps their pools filled.
///
/// Textures of the same tile size, and formats and resolutions of the layers, share a pool; the others have their own.
pub struct Textures {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) settings: Settings,
    /// How views say what they want, on this device.
    pub(crate) way: FeedbackWay,
    /// The main view, then the others.
    pub(crate) views: Vec<ViewState>,
    /// What the application has said that views want.
    pub(crate) said: Vec<Feedback>,
    pub(crate) changer: TableChanger,
    pub(crate) pipelines: FeedbackPipelines,
    /// By number.
    pub(crate) pools: Vec<PoolState>,
    pub(crate) pager: Pager,
    /// By number; nothing where the texture was removed.
    pub(crate) textures: Vec<Option<TextureState>>,
    pub(crate) groups: Vec<GroupState>,
    pub(crate) loader: Loader,
    pub(crate) lock_step: Option<LockStep>,
    pub(crate) frame: u64,
    /// Whether the device has been polled since the last update.
    pub(crate) is_polled: bool,
    /// That the pager has converged, while some of a view has not been seen.
    pub(crate) converged: Option<Event>,
    pub(crate) undone: Undone,
    pub(crate) moving: MovingTables,
    /// Kept for its memory.
    pub(crate) changes: Vec<TableChange>,
    pub(crate) counters: Counters,
    /// While a trace is recorded.
    pub(crate) recorder: Option<Recorder>,
    pub(crate) places: Places,
    pub(crate) texture_spaces: Vec<TextureSpacePath>,
    pub(crate) tickets: OpenTickets,
    pub(crate) telemetry: Telemetry,
    pub(crate) cpu_tiles: CpuTiles,
    pub(crate) fades: FadeState,
    pub(crate) asked_pixels: AskedPixels,
    pub(crate) uploads: UploadState,
}

pub(crate) struct TextureState {
    /// As its source has it.
    pub(crate) description: Arc<Description>,
    /// What the loader reads from, its caches in front.
    pub(crate) source: Arc<dyn TileSource>,
    /// The tail's tile as the pool holds it, so that there is always an answer, also for another device.
    pub(crate) tail: Bytes,
    pub(crate) table: TableBuffers,
    pub(crate) page_table: TableChoice,
    /// For people.
    pub(crate) name: Option<Arc<str>>,
}

/// The bind groups of each texture and group that there is: `groups[texture]`, `groups[group]`, or `groups[layer]` of a layer
/// that is not the first.
#[derive(Debug, Default)]
pub struct BindGroups(Vec<Vec<wgpu::BindGroup>>);

impl BindGroups {
    /// Those of a texture's layers, or that of a group, by its number.
    pub(crate) fn set(&mut self, number: TextureId, groups: Vec<wgpu::BindGroup>) {
        let number = usize::from(number.number());
        if self.0.len() <= number {
            self.0.resize_with(number + 1, Vec::new);
        }
        self.0[number] = groups;
    }
}

impl std::ops::Index<LayerId> for BindGroups {
    type Output = wgpu::BindGroup;

    fn index(&self, layer: LayerId) -> &wgpu::BindGroup {
        &self.0[usize::from(layer.texture().number())][layer.index()]
    }
}

impl std::ops::Index<GroupId> for BindGroups {
    type Output = wgpu::BindGroup;

    fn index(&self, group: GroupId) -> &wgpu::BindGroup {
        &self.0[usize::from(group.number().number())][0]
    }
}

impl std::ops::Index<Sampled> for BindGroups {
    type Output = wgpu::BindGroup;

    fn index(&self, sampled: Sampled) -> &wgpu::BindGroup {
        match sampled {
            Sampled::Layer(layer) => &self[layer],
            Sampled::Group(group) => &self[group],
        }
    }
}

impl std::ops::Index<TextureId> for BindGroups {
    type Output = wgpu::BindGroup;

    fn index(&self, texture: TextureId) -> &wgpu::BindGroup {
        &self[LayerId::from(texture)]
    }
}

impl Textures {
    /// The format of the target that feedback is drawn into, for the application's feedback pipeline.
    pub const FEEDBACK_FORMAT: wgpu::TextureFormat = vastex_wgpu::FEEDBACK_FORMAT;
    /// The format of the depth buffer of that target.
    pub const FEEDBACK_DEPTH_FORMAT: wgpu::TextureFormat = vastex_wgpu::FEEDBACK_DEPTH_FORMAT;

    /// No textures yet, on the application's own device. Fails where the device lacks what the settings ask for, and in a browser for
    /// [`crate::Pace::LockStep`].
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, settings: Settings) -> Result<Textures, Error> {
        let lock_step = LockStep::of(settings.pace, cfg!(target_family = "wasm"))?;
        let way = FeedbackWay::choose(settings.feedback, device)?;
        Ok(Textures {
            device: device.clone(),
            queue: queue.clone(),
            way,
            views: vec![ViewState::new(device, queue, ViewId::MAIN, way)],
            said: Vec::new(),
            changer: TableChanger::new(device, way),
            pipelines: FeedbackPipelines::new(device, way),
            pools: Vec::new(),
            pager: Pager::new(Budgets {
                upload_bytes_per_frame: settings.upload_bytes_per_frame,
                in_flight_bytes: settings.in_flight_bytes,
            }),
            textures: Vec::new(),
            groups: Vec::new(),
            loader: Loader::with(settings.of_loader(), Arc::new(SystemClock::new()))?,
            lock_step,
            frame: 0,
            is_polled: false,
            converged: None,
            undone: Undone::default(),
            moving: MovingTables::default(),
            changes: Vec::new(),
            counters: Counters::default(),
            recorder: None,
            places: Places::default(),
            texture_spaces: Vec::new(),
            tickets: OpenTickets::default(),
            telemetry: Telemetry::new(settings.telemetry_frames),
            cpu_tiles: CpuTiles::new(settings.cpu_cache_bytes),
            fades: FadeState::default(),
            asked_pixels: AskedPixels::default(),
            uploads: UploadState::new(device, &settings),
            settings,
        })
    }

    /// Adds a texture: makes a pool if none suits it, and reads the tail, so that there is something to show. It waits for that no longer
    /// than [`Settings::read_time_out`] ([`Error::TailOverdue`]), or than that for each further page of a texture that is held whole
    /// ([`Settings::whole_bytes`]).
    ///
    /// A read that is given up so and blocks its thread keeps that thread, and the source, until it comes back: each further call
    /// for a source that does not answer begins one more, so let some time pass between two.
    ///
    /// Costs one read and the beginning of the page table, which grows to 4 bytes for each page of the levels that are wanted or, of a
    /// texture of more than some millions of pages, to 48 or fewer for each page that is resident. Layers that the device cannot
    /// decompress are decoded when they are loaded, and take as much of the pool as their texels.
    pub fn add(&mut self, source: Arc<dyn TileSource>) -> Result<TextureId, Error> {
        self.add_with(source, TextureSettings::default())
    }

    /// The same with settings of its own.
    #[expect(
        clippy::needless_pass_by_value,
        reason = "settings are handed over, as in every call that takes them"
    )]
    pub fn add_with(
        &mut self,
        source: Arc<dyn TileSource>,
        settings: TextureSettings,
    ) -> Result<TextureId, Error> {
        let description = source.description().clone();
        if description.geometry.dims() == Dims::D3 {
            return Err(Error::Volume);
        }
        let whole = self.whole_of(&*source);
        let is_whole = whole.is_some();
        let (description, source, clock): (_, Arc<dyn TileSource>, Arc<dyn Clock>) = match whole {
            Some(whole) => {
                let source = WholeSource::new(source, whole.clone());
                // All of its pages are one read, which may take as long as pages come.
                let clock = source.progress().clone();
                (whole, Arc::new(source), clock)
            }
            None => {
                let source = RamCache::new(source, self.settings.ram_cache_bytes);
                (description, Arc::new(source), Arc::new(SystemClock::new()))
            }
        };
        if let Some(name) = settings.unknown_layer(&description.layers) {
            let names: Vec<&str> = description.layers.iter().map(|layer| &*layer.name).collect();
            return Err(Error::FilterLayer { name: name.into(), layers: names.join(", ") });
        }
        let held = held_description(&description, self.device.features());
        let source: Arc<dyn TileSource> = match held == description {
            true => source,
            false => Arc::new(DecodedSource::new(source, held.clone())),
        };
        let tail = tail::read(&source, self.settings.read_time_out, &clock)?;
        // Whatever can be refused is refused before anything changes.
        let (device, geometry) = (&self.device, &description.geometry);
        TableBuffers::check(device, geometry, settings.page_table, self.way)?;
        let page_table = settings.page_table.on(device, geometry, self.way);
        if !self.pager.has_free_number() {
            return Err(PoolError::TooManyTextures.into());
        }
        let sampling = |layer: &Layer| settings.sampling(layer, self.settings.filter);
        let shape = Shape::of(&held, page_table.kinds(), sampling);
        let pool = match is_whole {
            true => self.pool_of_one(&description, &held, shape)?,
            false => self.pool_for(&description, &held, &shape)?,
        };
        let source = self.staged(pool, source);
        let texture = self.add_to(pool, &description, &tail, &source, page_table)?;
        self.loader.add_source(texture, source);
        Ok(texture)
    }

    /// How a texture would be held whole, where it is small enough for that.
    fn whole_of(&self, source: &dyn TileSource) -> Option<Arc<Description>> {
        let (most, side) = (self.settings.whole_bytes, self.device.limits().max_texture_dimension_2d);
        // A browser cannot wait for all of it.
        let is_all_there = most > 0 && source.present().is_none() && !cfg!(target_family = "wasm");
        let described = || whole_description(source.description(), self.device.features(), most, side);
        is_all_there.then(described).flatten()
    }

    /// A pool for one texture that is held whole: one that has lost its own, or a new one.
    fn pool_of_one(
        &mut self,
        stored: &Arc<Description>,
        held: &Arc<Description>,
        shape: Shape,
    ) -> Result<PoolId, Error> {
        let is_free = |pool: &PoolState| pool.is_whole && pool.shape == shape && pool.gpu().is_none();
        if let Some((number, pool)) = (0..).zip(&mut self.pools).find(|(_, pool)| is_free(pool)) {
            pool.take_back(&self.device, &self.queue)?;
            return Ok(PoolId::new(number));
        }
        let pool = PoolState::of_one(&self.device, &self.queue, self.seen(), stored, held, shape)?;
        let id = self.pager.add_pool(pool.slots.slots(), pool.slots.tile_bytes, None)?;
        self.pools.push(pool);
        Ok(id)
    }

    /// The pool for textures that the device holds like `held`, a new one where there is none.
    fn pool_for(
        &mut self,
        stored: &Arc<Description>,
        held: &Arc<Description>,
        shape: &Shape,
    ) -> Result<PoolId, Error> {
        let made = (0..).zip(&mut self.pools).find(|(_, pool)| pool.shape == *shape && !pool.is_whole);
        if let Some((number, pool)) = made {
            pool.take_back(&self.device, &self.queue)?;
            return Ok(PoolId::new(number));
        }
        let plan = self.settings.pools.plan(stored, held, self.settings.picture);
        let (pool, is_reduced) =
            PoolState::new(&self.device, &self.queue, self.seen(), plan.bytes, stored, held, shape)?;
        let id = self.pager.add_pool(pool.slots.slots(), pool.slots.tile_bytes, plan.mip_bias)?;
        self.pager.set_pin_share(id, plan.pin_share);
        let (asked, bytes) = (plan.bytes, pool.slots.bytes());
        if is_reduced {
            tracing::warn!(tiles = %pool.tiles, asked, bytes, "the device has no memory for a pool of this size");
            self.pager.report(Event::PoolReduced { pool: id, asked, bytes });
        }
        self.pools.push(pool);
        Ok(id)
    }

    fn add_to(
        &mut self,
        pool: PoolId,
        description: &Arc<Description>,
        tail: &Bytes,
        source: &Arc<dyn TileSource>,
        page_table: TableChoice,
    ) -> Result<TextureId, Error> {
        let contents = if self.settings.share_contents { source.contents().cloned() } else { None };
        let present = source.present().cloned();
        let (texture, slot) = self.pager.add_texture(pool, &description.geometry, present, contents)?;
        let pool = &self.pools[usize::from(pool.number())];
        pool.upload(&self.queue, slot, tail)?;
        let geometry = &description.geometry;
        let table =
            TableBuffers::new(&self.device, &self.queue, geometry, texture, slot, page_table, self.way)?;
        let number = usize::from(texture.number());
        if self.textures.len() <= number {
            self.textures.resize_with(number + 1, || None);
        }
        let (description, source) = (description.clone(), source.clone());
        let tail = tail.clone();
        let state = TextureState { description, table, page_table, source, tail, name: None };
        self.textures[number] = Some(state);
        self.make_bind_groups(texture);
        Ok(texture)
    }

    /// Removes a texture. Says whether there was one.
    ///
    /// Its tiles leave the pool, its loads are called off, and its page table, its RAM cache and, where it was the last of its
    /// pool, the pool's memory are given back, as soon as the GPU and the loader are done with them; groups that it is in are
    /// removed. Pipelines for the pool
    /// stay good. Nothing may be drawn with its bind groups any more, and its id asks for nothing; a texture that is added later
    /// may get the same id, but not before all that could name this one is over.
    pub fn remove(&mut self, texture: TextureId) -> bool {
        let Some(pool) = self.pool_of(texture) else { return false };
        self.remove_groups_of(texture);
        self.forget_texture_space(Some(texture));
        self.cpu_tiles.remove(texture);
        self.pager.remove_texture(texture, self.frame);
        self.forget_undone(texture, pool);
        self.send_cancels();
        self.loader.remove_source(texture);
        let number = usize::from(texture.number());
        if let Some(gone) = self.textures[number].take() {
            let mut tiers = Tiers::default();
            gone.source.add_tiers(&mut tiers);
            self.telemetry.note_gone(pool, tiers);
        }
        self.views.iter_mut().for_each(|view| view.groups.set(texture, Vec::new()));
        if self.pager.pool(pool).stats().pinned == 0 {
            self.pools[usize::from(pool.number())].give_back();
        }
        true
    }

    /// The textures there are.
    pub fn iter(&self) -> impl Iterator<Item = TextureId> + '_ {
        let numbers = (0..=TextureId::MAX).zip(&self.textures).filter(|(_, texture)| texture.is_some());
        numbers.filter_map(|(number, _)| TextureId::new(number))
    }

    /// The WGSL that goes after the application's own shader, whose directives then stay first and whose lines keep their numbers: `vastex_sample(uv)` and its kin, for this layer of all
    /// textures of its pool, as [`vastex_wgpu::wgsl`] says; or `vastex_sample_NAME(uv)` for each member of a group
    /// ([`vastex_wgpu::group_wgsl`]).
    pub fn wgsl(&self, sampled: impl Into<Sampled>) -> String {
        let group = self.settings.bind_group_index;
        match sampled.into() {
            Sampled::Layer(layer) => {
                let layout = self.layout_of(layer);
                let (tables, pages) = self.kinds_of(layer.texture());
                let (atlas, feedback) = (layout.atlas(), layout.way());
                let Sampling { filter, fades } = self.sampling_of(layer);
                let fade = layout.fade() && fades;
                wgsl(&ShaderOptions { group, filter, atlas, feedback, tables, pages, fade })
            }
            Sampled::Group(id) => group_wgsl(group, self.settings.filter, self.way, self.group(id).shape()),
        }
    }

    /// For the application's pipeline layouts, at [`Settings::bind_group_index`].
    pub fn bind_group_layout(&self, sampled: impl Into<Sampled>) -> &wgpu::BindGroupLayout {
        match sampled.into() {
            Sampled::Layer(layer) => self.layout_of(layer).layout(),
            Sampled::Group(group) => self.group(group).layout(),
        }
    }

    /// Everything that the application's shaders need to sample a layer, or a group, in whichever view.
    ///
    /// It is another one after an [update](Textures::update) in which a page table grew, and wherever it is said that bind groups are new:
    /// [`Textures::resize_pool`], [`Textures::set_picture`], [`Textures::restore`] and, where feedback is [inline](FeedbackWay::Inline), a
    /// picture of another size. So ask for it in each frame, after the update, and keep neither it nor a render bundle that names it;
    /// two that are `==` are the same.
    pub fn bind_group(&self, sampled: impl Into<Sampled>) -> &wgpu::BindGroup {
        &self.views[0].groups[sampled.into()]
    }

    /// What is known of a texture.
    #[expect(clippy::expect_used, reason = "an id of another `Textures` is a mistake in the program")]
    pub fn description(&self, texture: TextureId) -> &Arc<Description> {
        let state = self.textures.get(usize::from(texture.number())).and_then(Option::as_ref);
        &state.expect("a texture of this `Textures`").description
    }

    /// The pool of a texture, as events and statistics name it.
    pub fn pool_of(&self, texture: TextureId) -> Option<PoolId> {
        self.pager.pool_of(texture)
    }

    /// The mip bias in force for a texture, that of its pool, in eighths of a level.
    pub fn bias_eighths(&self, texture: TextureId) -> u16 {
        self.pool_of(texture).map_or(0, |pool| self.pager.pool(pool).bias_eighths())
    }

    /// Sets how the levels of a texture are chosen, from the next feedback and picture on: a clamp of levels and a bias of its
    /// own, before the mip bias of its pool. The levels that there are and the bias that can be are the limits. Says
    /// whether there is such a texture.
    pub fn set_levels(&mut self, texture: TextureId, rule: LevelRule) -> bool {
        let Some(Some(state)) = self.textures.get_mut(usize::from(texture.number())) else { return false };
        state.table.set_rule(&self.queue, rule);
        self.pager.set_levels(texture, rule)
    }

    /// How the levels of a texture are chosen, within the levels that it has.
    pub fn levels(&self, texture: TextureId) -> Option<LevelRule> {
        self.pager.levels(texture)
    }

    /// The state of a page.
    pub fn state(&self, page: PageId) -> PageState {
        self.pager.state(page)
    }

    /// How views say what they want: as the settings say, or the best that the device has.
    pub fn feedback_way(&self) -> FeedbackWay {
        self.way
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Which page tables and pages the textures of a pool have, of which this one is.
    pub(crate) fn kinds_of(&self, texture: TextureId) -> (TableKinds, PageSides) {
        let pool = self.pool_of(texture).map(|pool| &self.pools[usize::from(pool.number())]);
        pool.map_or_else(Default::default, |pool| (pool.shape.tables, pool.shape.pages))
    }

    pub(crate) fn layout_of(&self, layer: LayerId) -> &BindLayout {
        self.pool_of_layer(layer).layout(layer.index())
    }

    /// A texture that there is has a pool.
    #[expect(clippy::expect_used, reason = "an id of another `Textures` is a mistake in the program")]
    pub(crate) fn pool_of_layer(&self, layer: LayerId) -> &PoolState {
        let pool = self.pool_of(layer.texture()).expect("a texture of this `Textures`");
        &self.pools[usize::from(pool.number())]
    }
}
