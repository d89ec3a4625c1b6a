//! The pools in GPU memory: which textures share one, and how pipelines see it.
//!
//! Textures share a pool where their tiles have the same size and their layers the same formats and
//! resolutions, as the device holds them. What is in a pool is decided by its pager.

use std::sync::Arc;

use vastex_core::{Description, Dims, Layer, LayerFormat, PoolLayout, Slot, SlotMove};
#[cfg(not(target_family = "wasm"))]
use vastex_wgpu::BeltTile;
use vastex_wgpu::{
    Atlas, Fades, FeedbackMode, Filter, GpuError, Kind, PageSides, Pool, PoolTables, TableKind,
    VolumeFilters, limits,
};

use crate::error::Error;
use crate::settings::{PoolSettings, Sampling};

/// What the textures of a pool have in common.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Shape {
    tile: [u32; 3],
    /// Format of each layer, and texels of the texture along one of the layer.
    layers: Vec<(LayerFormat, u32)>,
    /// How their page tables lie.
    pub(crate) tables: TableKind,
    /// What shaders know of pages.
    pages: PageSides,
}

impl Shape {
    pub(crate) fn of(description: &Description, tables: TableKind) -> Shape {
        let layer = |layer: &Layer| (layer.format, layer.scale);
        let layers = description.layers.iter().map(layer).collect();
        let pages = PageSides::of(&description.geometry);
        Shape { tile: description.geometry.tile(), layers, tables, pages }
    }
}

impl std::fmt::Display for Shape {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.tile {
            [width, height, 1] => write!(f, "{width}x{height} texels of ")?,
            [width, height, depth] => write!(f, "{width}x{height}x{depth} voxels of ")?,
        }
        for (nth, (format, scale)) in self.layers.iter().enumerate() {
            let separator = if nth == 0 { "" } else { ", " };
            write!(f, "{separator}{}", format.name())?;
            if *scale != 1 {
                write!(f, " at 1/{scale}")?;
            }
        }
        if self.tables == TableKind::Hashed { write!(f, ", many pages") } else { Ok(()) }
    }
}

/// Shader options shared by all pools.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PoolShaderOptions {
    pub(crate) mode: FeedbackMode,
    /// True if tiles fade in.
    pub(crate) fade: bool,
    /// What ids show that name no texture.
    pub(crate) unknown: [f32; 4],
    /// How volumes are taken to be filtered, where somebody said so.
    pub(crate) filters: Option<VolumeFilters>,
}

/// A pool's memory, and its page tables.
pub(crate) struct PoolState {
    /// Where the slots lie, also while the memory is given back.
    pub(crate) slots: PoolLayout,
    pub(crate) shape: Shape,
    /// True if it is for textures that are held whole.
    pub(crate) is_whole: bool,
    /// True if somebody chose its size, so that it does not follow the picture.
    pub(crate) is_sized: bool,
    pub(crate) tiles: Arc<str>,
    /// The first texture, as its source and as the device has it.
    stored: Arc<Description>,
    held: Arc<Description>,
    /// There while there are textures.
    gpu: Option<PoolMemory>,
    /// How each layer is read.
    atlases: Vec<Atlas>,
    seen: PoolShaderOptions,
    /// True if there are textures in it, for which the memory is there but while a device is lost.
    is_used: bool,
}

/// What a pool takes on the GPU.
struct PoolMemory {
    pool: Pool,
    tables: PoolTables,
}

impl PoolState {
    /// Takes the memory of a pool for textures like `held`, at most `bytes`; where the device has not so
    /// much, half of it, and so on. Returns true if that was so.
    pub(crate) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        seen: PoolShaderOptions,
        bytes: u64,
        stored: &Arc<Description>,
        held: &Arc<Description>,
        shape: &Shape,
    ) -> Result<(PoolState, bool), Error> {
        halved_until_it_fits(bytes, |bytes| {
            PoolState::of_size(device, queue, seen, bytes, stored, held, shape.clone())
        })
    }

    fn of_size(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        seen: PoolShaderOptions,
        bytes: u64,
        stored: &Arc<Description>,
        held: &Arc<Description>,
        shape: Shape,
    ) -> Result<PoolState, Error> {
        let slots = PoolLayout::fit(held, bytes, limits(device))?;
        PoolState::of_layout(device, queue, seen, slots, stored, held, shape)
    }

    /// A pool for textures that are all tail, with room for one.
    pub(crate) fn of_one(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        seen: PoolShaderOptions,
        stored: &Arc<Description>,
        held: &Arc<Description>,
        shape: Shape,
    ) -> Result<PoolState, Error> {
        let (tile, tile_bytes) = (held.geometry.tile(), held.tile_bytes() as u64);
        let slots = PoolLayout { tile, grid: [1; 3], tile_bytes };
        let pool = PoolState::of_layout(device, queue, seen, slots, stored, held, shape)?;
        Ok(PoolState { is_whole: true, ..pool })
    }

    fn of_layout(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        seen: PoolShaderOptions,
        slots: PoolLayout,
        stored: &Arc<Description>,
        held: &Arc<Description>,
        shape: Shape,
    ) -> Result<PoolState, Error> {
        let gpu = memory(device, queue, seen, &slots, held, shape.tables)?;
        let atlases: Vec<Atlas> = (0..gpu.pool.layer_count()).map(|layer| gpu.pool.atlas(layer)).collect();
        let (stored, held) = (stored.clone(), held.clone());
        let tiles = (shape.to_string() + blended(&slots, &atlases)).into();
        tracing::debug!(%tiles, slots = slots.slots(), bytes = slots.bytes(), "a new pool");
        Ok(PoolState {
            slots,
            shape,
            is_whole: false,
            is_sized: false,
            tiles,
            stored,
            held,
            gpu: Some(gpu),
            atlases,
            seen,
            is_used: true,
        })
    }

    /// Where the slots of the same pool would lie if it were as large as `bytes` allow.
    pub(crate) fn fit(&self, device: &wgpu::Device, bytes: u64) -> Result<PoolLayout, Error> {
        Ok(PoolLayout::fit(&self.held, bytes, limits(device))?)
    }

    /// This pool with other slots, empty, for the same pipelines; its memory is taken where this one's
    /// is.
    pub(crate) fn resized(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        slots: PoolLayout,
    ) -> Result<PoolState, Error> {
        let memory = || memory(device, queue, self.seen, &slots, &self.held, self.shape.tables);
        Ok(PoolState {
            slots,
            shape: self.shape.clone(),
            is_whole: self.is_whole,
            is_sized: self.is_sized,
            tiles: self.tiles.clone(),
            stored: self.stored.clone(),
            held: self.held.clone(),
            gpu: self.gpu.is_some().then(memory).transpose()?,
            atlases: self.atlases.clone(),
            seen: self.seen,
            is_used: self.is_used,
        })
    }

    /// Copies the tiles that stay from the pool that this one takes the place of.
    pub(crate) fn copy_from(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        old: &PoolState,
        moves: &[SlotMove],
    ) {
        if let (Some(gpu), Some(old)) = (&mut self.gpu, &old.gpu) {
            gpu.pool.copy_from(encoder, &old.pool, moves);
        }
    }

    /// Bytes that the settings give it for a picture of so many pixels.
    pub(crate) fn planned(&self, settings: &PoolSettings, picture: [u32; 2]) -> u64 {
        settings.plan(&self.stored, &self.held, picture).bytes
    }

    /// This pool on another device, empty.
    pub(crate) fn restore(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        mode: FeedbackMode,
    ) -> Result<(), Error> {
        self.seen.mode = mode;
        self.gpu = None;
        if self.is_used { self.take_back(device, queue) } else { Ok(()) }
    }

    /// Takes the memory anew where it was given back.
    pub(crate) fn take_back(&mut self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<(), Error> {
        self.is_used = true;
        if self.gpu.is_none() {
            let gpu = memory(device, queue, self.seen, &self.slots, &self.held, self.shape.tables)?;
            // Another device may read the same formats in another way.
            self.atlases = (0..gpu.pool.layer_count()).map(|layer| gpu.pool.atlas(layer)).collect();
            self.gpu = Some(gpu);
        }
        Ok(())
    }

    /// Gives the memory back: the last texture was removed.
    pub(crate) fn give_back(&mut self) {
        (self.gpu, self.is_used) = (None, false);
    }

    /// There while there are textures.
    pub(crate) fn gpu(&self) -> Option<&Pool> {
        self.gpu.as_ref().map(|memory| &memory.pool)
    }

    /// The pool's page tables, while there are textures.
    pub(super) fn tables(&self) -> Option<&PoolTables> {
        self.gpu.as_ref().map(|memory| &memory.tables)
    }

    pub(super) fn tables_mut(&mut self) -> Option<&mut PoolTables> {
        self.gpu.as_mut().map(|memory| &mut memory.tables)
    }

    /// How far its tiles have faded in, where they do.
    pub(crate) fn fades_mut(&mut self) -> Option<&mut Fades> {
        self.gpu.as_mut()?.pool.fades_mut()
    }

    /// Bytes held at the moment.
    pub(crate) fn bytes(&self) -> u64 {
        if self.gpu.is_some() { self.slots.bytes() } else { 0 }
    }

    /// Puts a tile into a slot.
    pub(crate) fn upload(&self, queue: &wgpu::Queue, slot: Slot, tile: &[u8]) -> Result<(), Error> {
        if let Some(memory) = &self.gpu {
            memory.pool.upload(queue, slot, tile)?;
        }
        Ok(())
    }

    /// A tile comes into a slot.
    pub(super) fn note_range(&mut self, slot: Slot, tile: &[u8]) {
        if let Some(memory) = &mut self.gpu {
            memory.pool.set_range(slot, tile);
        }
    }

    /// A tile on the belt comes into a slot.
    #[cfg(not(target_family = "wasm"))]
    pub(super) fn note_range_from(&mut self, slot: Slot, tile: &BeltTile) {
        if let Some(memory) = &mut self.gpu {
            memory.pool.set_range_from(slot, tile);
        }
    }

    pub(super) fn send_ranges(&mut self, queue: &wgpu::Queue) {
        if let Some(memory) = &mut self.gpu {
            memory.pool.send_ranges(queue);
        }
    }

    pub(crate) fn set_bias(&mut self, queue: &wgpu::Queue, eighths: u16) {
        if let Some(memory) = &mut self.gpu {
            memory.pool.set_bias(queue, eighths);
        }
    }

    /// How shaders sample the layer with this number, which exists.
    pub(super) fn kind(&self, layer: usize, Sampling { filter, is_mixed }: Sampling) -> Kind {
        let Shape { tables, pages, ref layers, .. } = self.shape;
        let dims = self.held.geometry.dims();
        // Volumes are blended from eight voxels, or not at all: one text for all other filters.
        let (atlas, scale) = (self.atlases[layer], layers[layer].1);
        let filter = match (dims, filter) {
            (Dims::D3, Filter::Nearest) | (Dims::D2, _) => filter,
            (Dims::D3, _) => Filter::Trilinear,
        };
        Kind { dims, tables, pages, layer: layer as u8, atlas, scale, filter, is_mixed }
    }
}

fn memory(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    seen: PoolShaderOptions,
    slots: &PoolLayout,
    held: &Description,
    tables: TableKind,
) -> Result<PoolMemory, GpuError> {
    let mut pool = Pool::filtered(device, queue, slots, &held.layers, seen.filters)?;
    pool.set_unknown(queue, seen.unknown);
    let pool = if seen.fade { pool.with_fades(device) } else { pool };
    let tables = match tables {
        TableKind::Direct => PoolTables::direct(device, seen.mode)?,
        TableKind::Hashed => PoolTables::hashed(device, queue, seen.mode, slots.slots())?,
    };
    Ok(PoolMemory { pool, tables })
}

/// Said of pools of volumes that the device does not simply filter.
fn blended(slots: &PoolLayout, atlases: &[Atlas]) -> &'static str {
    let has = |wanted: &[Atlas]| slots.is_solid() && atlases.iter().any(|atlas| wanted.contains(atlas));
    if has(&[Atlas::Unfiltered, Atlas::Uint16, Atlas::Uint16Rgba]) {
        ", blended by the shader"
    } else if has(&[Atlas::HighLow]) {
        ", filtered in two halves"
    } else {
        ""
    }
}

/// Makes a pool of `bytes` bytes, or where the device has no memory for that the next that fits of a half, a
/// quarter, and so on. Returns true if it is less than was asked for; where none fits, the first error
/// stands.
fn halved_until_it_fits<T>(
    bytes: u64,
    mut make: impl FnMut(u64) -> Result<T, Error>,
) -> Result<(T, bool), Error> {
    let mut first = None;
    for halvings in 0..u64::BITS {
        match make(bytes >> halvings) {
            Ok(made) => return Ok((made, halvings > 0)),
            Err(error @ Error::Gpu(GpuError::OutOfMemory { .. })) => first = first.or(Some(error)),
            Err(error) => return Err(first.unwrap_or(error)),
        }
    }
    Err(first.unwrap_or(Error::Gpu(GpuError::OutOfMemory { bytes })))
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastex_core::PoolError;

    /// A device with memory for `free` bytes, and pools that need at least 100.
    fn make(free: u64) -> impl FnMut(u64) -> Result<u64, Error> {
        move |bytes| match bytes {
            ..100 => Err(Error::Pool(PoolError::TooManyPools)),
            _ if bytes > free => Err(Error::Gpu(GpuError::OutOfMemory { bytes })),
            _ => Ok(bytes),
        }
    }

    #[test]
    fn a_pool_is_halved_until_the_device_has_the_memory() {
        assert_eq!(halved_until_it_fits(1600, make(1600)).unwrap(), (1600, false));
        assert_eq!(halved_until_it_fits(1600, make(1599)).unwrap(), (800, true));
        assert_eq!(halved_until_it_fits(1600, make(100)).unwrap(), (100, true));
    }

    #[test]
    fn where_none_fits_it_says_what_was_asked_for() {
        let error = halved_until_it_fits(1600, make(99)).unwrap_err();
        assert!(matches!(error, Error::Gpu(GpuError::OutOfMemory { bytes: 1600 })), "{error}");
        let error = halved_until_it_fits(50, make(1600)).unwrap_err();
        assert!(matches!(error, Error::Pool(PoolError::TooManyPools)), "too small from the start: {error}");
    }
}
