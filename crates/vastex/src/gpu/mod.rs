//! What there is on the GPU, and how it changes: pools, page tables, groups, views and their feedback, and
//! the way of tiles into slots.
//!
//! Nothing is decided here, and nothing is read from a source. What a call needs to know of the pager it is
//! given.

mod bind_groups;
mod carry_out;
mod cycle;
mod due_feedback;
mod fades;
mod feedback;
mod feedback_path;
mod groups;
mod host_pass;
mod look;
mod pools;
mod resize;
mod restore;
mod tables;
mod texture_space;
mod textures;
mod uploads;
mod views;

use std::sync::Arc;
use std::time::Duration;

use vastex_core::{
    Description, LevelRule, Pager, PoolId, Slot, TableChange, TextureNumber, ViewId, VoxelLevels,
};
use vastex_wgpu::{
    BindingPlace, FeedbackMode, ParamStore, PoolTableChanger, RECORD_WORDS, Views, VolumeFilters, alive,
    new_sampler,
};

use crate::error::Error;
use crate::settings::{Pace, Sampling, Settings};
pub use bind_groups::BindGroups;
use carry_out::Undone;
use due_feedback::DueFeedback;
pub(crate) use due_feedback::FEEDBACK_FRAMES;
use fades::FadeState;
use feedback_path::FeedbackPipelines;
use groups::GroupState;
pub use host_pass::FeedbackPass;
pub(crate) use pools::{PoolState, Shape};
pub use resize::PoolResize;
use tables::PendingTables;
use texture_space::TextureSpacePath;
use uploads::UploadState;
pub use uploads::UploadStats;
use views::ViewState;

/// Everything on the GPU, and the device that it is on.
pub(crate) struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
    /// How views say what they want, on this device.
    mode: FeedbackMode,
    /// How long a tile takes to fade in.
    fade: Duration,
    /// What ids show that name no texture.
    unknown: [f32; 4],
    /// How volumes are taken to be filtered, where somebody said so.
    filters: Option<VolumeFilters>,
    /// Where applications have room for what their shaders bind.
    binding: BindingPlace,
    reversed_depth: bool,
    pace: Pace,
    /// The main view, then the others.
    views: Vec<ViewState>,
    /// What shaders are told of all views, textures and groups.
    view_params: Views,
    params: ParamStore,
    sampler: wgpu::Sampler,
    bind_groups: BindGroups,
    changer: PoolTableChanger,
    pipelines: FeedbackPipelines,
    /// By number.
    pools: Vec<PoolState>,
    /// By number; `None` if the texture was removed.
    textures: Vec<Option<TextureOnGpu>>,
    /// By number: textures and groups that have had it.
    generations: Vec<u32>,
    groups: Vec<GroupState>,
    /// There in lock-step.
    due: Option<DueFeedback>,
    /// True if the device has been polled since the last update.
    is_polled: bool,
    /// The frame in which a main pass has last moved the cells of all views.
    cells_moved: Option<u64>,
    undone: Undone,
    pending_tables: PendingTables,
    /// Reused between frames to avoid allocating.
    changes: Vec<TableChange>,
    changes_of_pool: Vec<TableChange>,
    texture_spaces: Vec<TextureSpacePath>,
    fades: FadeState,
    uploads: UploadState,
    sent: Sent,
}

/// A texture's part of the GPU's memory beside the pool's.
struct TextureOnGpu {
    pool: PoolId,
    /// As its source has it.
    description: Arc<Description>,
    /// By which shaders know it.
    id: u32,
    tail_slot: Slot,
    /// Where the voxels of a volume lie, where they are not its texels.
    voxels: Option<Arc<VoxelLevels>>,
    /// How its levels are chosen.
    rule: LevelRule,
    /// Of each layer.
    samplings: Vec<Sampling>,
}

/// Totals of what went between the GPU and main memory.
#[derive(Clone, Copy, Debug, Default)]
struct Sent {
    table_bytes: u64,
    /// By feedback paths that are gone.
    feedback_bytes: u64,
}

impl Gpu {
    /// Nothing yet but the main view. Fails where the device lacks what the settings ask for.
    pub(crate) fn new(device: &wgpu::Device, queue: &wgpu::Queue, settings: &Settings) -> Result<Gpu, Error> {
        settings.binding.check(&device.limits())?;
        let mode = FeedbackMode::choose(settings.feedback, device)?;
        let mut gpu = Gpu {
            device: device.clone(),
            queue: queue.clone(),
            mode,
            fade: settings.fade,
            unknown: settings.unknown_color,
            filters: settings.volume_filters,
            binding: settings.binding,
            reversed_depth: settings.reversed_depth,
            pace: settings.pace,
            views: vec![ViewState::new(ViewId::MAIN, views::MAIN)],
            view_params: Views::new(device, queue, mode),
            params: ParamStore::new(device, RECORD_WORDS)?,
            sampler: new_sampler(device),
            bind_groups: BindGroups::default(),
            changer: PoolTableChanger::new(device, mode),
            pipelines: FeedbackPipelines::new(device, mode),
            pools: Vec::new(),
            textures: Vec::new(),
            generations: Vec::new(),
            groups: Vec::new(),
            due: (settings.pace != Pace::Realtime).then(DueFeedback::default),
            is_polled: false,
            cells_moved: None,
            undone: Undone::default(),
            pending_tables: PendingTables::default(),
            changes: Vec::new(),
            changes_of_pool: Vec::new(),
            texture_spaces: Vec::new(),
            fades: FadeState::default(),
            uploads: UploadState::new(device, settings),
            sent: Sent::default(),
        };
        gpu.fit_main_view(settings.picture);
        Ok(gpu)
    }

    pub(crate) fn device(&self) -> &wgpu::Device {
        &self.device
    }

    pub(crate) fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    pub(crate) fn mode(&self) -> FeedbackMode {
        self.mode
    }

    pub(crate) fn check_device(&self) -> Result<(), Error> {
        Ok(alive(&self.device)?)
    }

    /// All pools, in the order of their numbers.
    pub(crate) fn pools(&self) -> &[PoolState] {
        &self.pools
    }

    /// Bytes of all page tables. Where they lie elsewhere since a short while that is twice: for commands
    /// that were recorded before, what was there counts, too.
    pub(crate) fn table_bytes(&self) -> u64 {
        let tables = self.pools.iter().filter_map(|pool| pool.tables()).map(vastex_wgpu::PoolTables::bytes);
        tables.sum::<u64>()
    }

    /// Bytes of page-table changes sent so far.
    pub(crate) fn table_bytes_sent(&self) -> u64 {
        self.sent.table_bytes
    }

    /// Bytes of feedback brought back so far.
    pub(crate) fn feedback_bytes_read(&self) -> u64 {
        self.sent.feedback_bytes + self.views.iter().map(ViewState::bytes_read).sum::<u64>()
    }

    pub(crate) fn upload_stats(&self) -> UploadStats {
        self.uploads.stats()
    }

    fn texture(&self, texture: TextureNumber) -> Option<&TextureOnGpu> {
        self.textures.get(usize::from(texture.number()))?.as_ref()
    }

    /// The textures that there are, in the order of their numbers.
    fn texture_ids(&self) -> Vec<TextureNumber> {
        let numbers = (0..=TextureNumber::MAX).zip(&self.textures).filter(|(_, texture)| texture.is_some());
        numbers.filter_map(|(number, _)| TextureNumber::new(number)).collect()
    }
}

/// The pager's slot of a texture's tail.
fn tail_slot(pager: &Pager, texture: TextureNumber) -> Option<vastex_core::Slot> {
    pager.pool(pager.pool_of(texture)?).tail_slot(texture)
}
