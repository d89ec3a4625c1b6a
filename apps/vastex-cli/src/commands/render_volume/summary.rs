//! What `vastex render` of a volume prints of its run, for people and for scripts.

use std::collections::BTreeMap;

use serde::Serialize;
use vastex::VolumeFilters;
use vastex_volume::{ChunkWork, Volume, VolumeAbout};

use super::Drawing;
use super::watch::Watched;
use crate::commands::compared::Compared;

/// What is said where the finest level that the file names is missing.
pub(super) fn note_of_finest(about: &VolumeAbout) -> Option<String> {
    let left = about.finest_left_out()?;
    let size = about.size().map(|side| side.to_string()).join("x");
    Some(format!(
        "the finest level, '{}', is missing, so the picture is of {size} voxels at most: {}",
        left.path, left.error
    ))
}

/// What `--json` prints. Scripts rely on these names.
#[derive(Serialize)]
pub(super) struct Summary {
    converged: bool,
    frames: u64,
    tiles_loaded: u64,
    tiles_evicted: u64,
    /// Loaded again within 60 frames of their eviction.
    tiles_reloaded: u64,
    bricks_wanted: u32,
    bricks_resident: u32,
    pub(super) bricks_missing: u32,
    bricks_failed: u32,
    pool_slots: u32,
    pool_bytes: u64,
    /// Voxels along a side of a brick: 64, or 32 where the pool is small.
    brick: u32,
    bytes_uploaded: u64,
    /// Bytes that were read for chunks, as they are stored.
    bytes_read: u64,
    chunks_decoded: u64,
    /// Bricks of the finest levels that were made meanwhile; 0 where all are stored or were made at opening.
    levels_made: u64,
    /// Why the finest level that the file names is missing; null where it is there.
    finest_left_out: Option<String>,
    /// Levels.
    pub(super) mip_bias: f64,
    adapter: String,
    /// Which formats the device filters well in volumes: `r8`, `r16`, `rg8` (16 bits in two halves), `r16f`,
    /// `r32f`.
    volume_filters: BTreeMap<&'static str, bool>,
    /// What pools hold, and who blends it.
    pools: Vec<String>,
    /// What `--compare` adds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) compared: Option<Compared>,
    #[serde(flatten)]
    watched: Watched,
}

impl Summary {
    pub(super) fn new(
        drawing: &Drawing<'_>,
        (volume, brick): (&Volume, u32),
        converged: bool,
        watched: Watched,
    ) -> Summary {
        let stats = drawing.textures.stats();
        // Labels are often a volume of their own.
        let others = drawing.maker.volumes().into_iter().filter(|other| !std::ptr::eq(&***other, volume));
        let work: Vec<ChunkWork> =
            others.map(|other| other.chunk_work()).chain([volume.chunk_work()]).collect();
        let pager = &stats.pager;
        let filters = VolumeFilters::of(&drawing.gpu.device, &drawing.gpu.queue);
        Summary {
            converged,
            frames: drawing.frames,
            tiles_loaded: pager.loaded,
            tiles_evicted: pager.evicted,
            tiles_reloaded: pager.reloaded,
            bricks_wanted: pager.wanted,
            bricks_resident: pager.resident,
            bricks_missing: pager.missing,
            bricks_failed: pager.failed,
            pool_slots: pager.slots,
            pool_bytes: stats.pool_bytes,
            brick,
            bytes_uploaded: pager.uploaded_bytes,
            bytes_read: work.iter().map(|work| work.bytes_read).sum(),
            chunks_decoded: work.iter().map(|work| work.decoded).sum(),
            levels_made: drawing.maker.progress().done,
            finest_left_out: volume.about().finest_left_out().map(|left| left.error.to_string()),
            mip_bias: f64::from(pager.bias_eighths) / 8.0,
            adapter: drawing.gpu.adapter_name(),
            volume_filters: filters.named().into_iter().collect(),
            pools: stats.pools.iter().map(|pool| pool.tiles.to_string()).collect(),
            compared: None,
            watched,
        }
    }

    pub(super) fn text(&self) -> String {
        let state = if self.converged { "converged" } else { "not converged" };
        let coarser = match self.mip_bias {
            0.0 => String::new(),
            bias => format!("; the pool is too small, so the picture is {bias} levels coarser"),
        };
        let compared = self.compared.as_ref().map(|compared| format!("\n{}", compared.text()));
        let compared = compared.unwrap_or_default();
        format!(
            "{state} after {} frames on {}\nbricks: {} loaded, {} wanted, {} resident, {} failed; {} chunks decoded{coarser}{compared}{}",
            self.frames,
            self.adapter,
            self.tiles_loaded,
            self.bricks_wanted,
            self.bricks_resident,
            self.bricks_failed,
            self.chunks_decoded,
            self.watched.text()
        )
    }
}
