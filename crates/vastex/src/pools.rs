//! The pools in GPU memory: which textures share one, and how pipelines see it.
//!
//! Textures share a pool where their tiles have the same size and their layers the same formats and resolutions, as the
//! device holds them. What is in a pool is decided by its pager.

use std::sync::Arc;

use vastex_core::{Description, Layer, LayerFormat, PoolId, PoolLayout, Stats};
use vastex_wgpu::{Atlas, BindLayout, Pool, limits};

use crate::error::Error;

/// What the textures of a pool have in common.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Shape {
    tile: [u32; 3],
    /// Format of each layer, and texels of the texture along one of the layer.
    layers: Vec<(LayerFormat, u32)>,
}

impl Shape {
    pub(crate) fn of(description: &Description) -> Shape {
        let layer = |layer: &Layer| (layer.format, layer.scale);
        Shape { tile: description.geometry.tile(), layers: description.layers.iter().map(layer).collect() }
    }
}

impl std::fmt::Display for Shape {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [width, height, _] = self.tile;
        write!(f, "{width}x{height} texels of ")?;
        for (nth, (format, scale)) in self.layers.iter().enumerate() {
            let separator = if nth == 0 { "" } else { ", " };
            write!(f, "{separator}{}", format.name())?;
            if *scale != 1 {
                write!(f, " at 1/{scale}")?;
            }
        }
        Ok(())
    }
}

/// How a pool stands after a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct PoolStats {
    /// The pool, as events name it.
    pub pool: PoolId,
    /// Its tiles, for people: size in texels, formats of the layers.
    pub tiles: Arc<str>,
    /// Its bytes in GPU memory.
    pub bytes: u64,
    /// Of its pager: slots, the working set, loads and evictions.
    pub pager: Stats,
}

/// A pool's memory, and the layouts of what is bound of it.
pub(crate) struct PoolState {
    pub(crate) gpu: Pool,
    pub(crate) shape: Shape,
    pub(crate) tiles: Arc<str>,
    /// One for each way in which layers are read.
    layouts: Vec<BindLayout>,
}

impl PoolState {
    /// Takes the memory of a pool for textures like `held`, at most `bytes`.
    pub(crate) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        bytes: u64,
        held: &Description,
    ) -> Result<PoolState, Error> {
        let layout = PoolLayout::fit(held, bytes, limits(device))?;
        let gpu = Pool::new(device, queue, &layout, &held.layers)?;
        let is_used = |atlas: &Atlas| (0..gpu.layer_count()).any(|layer| gpu.atlas(layer) == *atlas);
        let layouts = Atlas::ALL.into_iter().filter(is_used).map(|atlas| BindLayout::new(device, atlas));
        let (layouts, shape) = (layouts.collect(), Shape::of(held));
        let tiles = shape.to_string().into();
        tracing::debug!(%tiles, slots = layout.slots(), bytes = layout.bytes(), "a new pool");
        Ok(PoolState { gpu, shape, tiles, layouts })
    }

    /// How the layer with this number is seen by shaders.
    pub(crate) fn layout(&self, layer: usize) -> &BindLayout {
        let atlas = self.gpu.atlas(layer);
        // There is one for each way in which layers are read.
        self.layouts.iter().find(|layout| layout.atlas() == atlas).unwrap_or(&self.layouts[0])
    }
}
