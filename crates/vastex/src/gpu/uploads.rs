//! The way of tiles into their slots: through the queue, or from a belt that the loader's threads put them on
//! (`vastex_wgpu::Belt`).
//!
//! `vastex_tiles::StagedSource` has each tile put there when it is decoded, and nobody between the loader and
//! the upload knows of it. What finds no room goes through the queue, so nothing waits for the belt.

use std::collections::HashMap;
use std::sync::Arc;
#[cfg(not(target_family = "wasm"))]
use std::sync::{Mutex, PoisonError};

use vastex_core::{PoolId, Upload};
use vastex_tiles::TileSource;
#[cfg(not(target_family = "wasm"))]
use vastex_tiles::{Room, Staged, StagedSource, Staging};
#[cfg(not(target_family = "wasm"))]
use vastex_wgpu::{Belt, BeltLayout, BeltTile};

use super::{Gpu, PoolState};
use crate::error::Error;
use crate::settings::Settings;
#[cfg(not(target_family = "wasm"))]
use crate::settings::{Pace, UploadMode};

/// Bytes of rooms beside those of tiles in flight: of tiles that the GPU is copying, in frames' budgets of
/// uploads, padded.
#[cfg(not(target_family = "wasm"))]
const FRAMES_BEHIND: u64 = 6;

/// Where tiles are put on their way.
#[cfg(not(target_family = "wasm"))]
#[derive(Debug, Default)]
pub(super) struct UploadState {
    staged: Staged,
    /// The belt of the device that there is now, if tiles go by one; what stages tiles has it, too.
    belt: SharedBelt,
}

#[cfg(target_family = "wasm")]
#[derive(Debug, Default)]
pub(super) struct UploadState;

#[cfg(not(target_family = "wasm"))]
#[derive(Clone, Debug, Default)]
struct SharedBelt(Arc<Mutex<Option<Belt>>>);

#[cfg(not(target_family = "wasm"))]
impl SharedBelt {
    fn get(&self) -> Option<Belt> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn set(&self, belt: Option<Belt>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = belt;
    }
}

/// Puts tiles of one shape on the belt.
#[cfg(not(target_family = "wasm"))]
struct ToBelt {
    belt: SharedBelt,
    layout: Arc<BeltLayout>,
}

#[cfg(not(target_family = "wasm"))]
impl Staging for ToBelt {
    fn stage(&self, tile: &[u8]) -> Option<Room> {
        Some(Arc::new(self.belt.get()?.put(&self.layout, tile)?))
    }
}

#[cfg(not(target_family = "wasm"))]
impl UploadState {
    /// For a device.
    pub(super) fn new(device: &wgpu::Device, settings: &Settings) -> UploadState {
        let uploads = UploadState::default();
        uploads.begin_anew(device, settings);
        uploads
    }

    /// On another device: what was put on the old one's belt goes through the queue.
    pub(super) fn begin_anew(&self, device: &wgpu::Device, settings: &Settings) {
        let is_on = match settings.uploads {
            UploadMode::Best => settings.pace == Pace::Realtime && Belt::suits(device),
            UploadMode::Queue => false,
            UploadMode::Belt => true,
        };
        let behind = settings.upload_bytes_per_frame.saturating_mul(FRAMES_BEHIND);
        let limit = settings.in_flight_bytes.saturating_add(behind);
        self.belt.set(is_on.then(|| Belt::new(device, limit)));
    }

    /// The source whose tiles are put on the belt, where there is one, and the bytes that each takes there.
    pub(super) fn staging(
        &self,
        source: Arc<dyn TileSource>,
        layout: &Arc<BeltLayout>,
    ) -> (Arc<dyn TileSource>, u64) {
        if self.belt.get().is_none() {
            return (source, 0);
        }
        let staging = Arc::new(ToBelt { belt: self.belt.clone(), layout: layout.clone() });
        (Arc::new(StagedSource::new(source, staging, self.staged.clone())), layout.bytes())
    }

    /// The tile on the belt that these bytes are, if it is there.
    fn on_belt(&self, tile: &bytes::Bytes) -> Option<Arc<BeltTile>> {
        let tile = self.staged.room_of(tile)?.downcast::<BeltTile>().ok()?;
        let is_ours = self.belt.get().is_some_and(|belt| belt.is(tile.belt()));
        is_ours.then_some(tile)
    }

    /// Tiles that are on a belt now, and what the belt of this device has done.
    pub(super) fn stats(&self) -> UploadStats {
        let belt = self.belt.get();
        let counts = belt.as_ref().map(Belt::counts).unwrap_or_default();
        UploadStats {
            staged: self.staged.tiles(),
            belt_bytes: belt.as_ref().map_or(0, Belt::bytes),
            by_belt: counts.put,
            without_room: counts.refused,
            rooms_made: counts.made,
        }
    }
}

#[cfg(target_family = "wasm")]
impl UploadState {
    pub(super) fn new(_device: &wgpu::Device, _settings: &Settings) -> UploadState {
        UploadState
    }

    pub(super) fn begin_anew(&self, _device: &wgpu::Device, _settings: &Settings) {}

    pub(super) fn stats(&self) -> UploadStats {
        UploadStats::default()
    }
}

/// How tiles have got to the GPU so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UploadStats {
    /// Tiles that lie on the belt at the moment.
    pub staged: usize,
    /// Bytes of main memory that the belt has, filled or not.
    pub belt_bytes: u64,
    /// Tiles that were put on the belt of this device.
    pub by_belt: u64,
    /// Tiles for which there was no room there, so that they go through the queue.
    pub without_room: u64,
    /// Rooms that the belt has made: as many as were filled at once, and no more.
    pub rooms_made: u64,
}

/// A tile that a frame's commands copy from, to be kept until they are submitted. In a browser there is none.
#[cfg(not(target_family = "wasm"))]
pub(super) type Copied = Arc<BeltTile>;
#[cfg(target_family = "wasm")]
pub(super) type Copied = std::convert::Infallible;

impl Gpu {
    /// Another belt, where tiles go by one, as large as the budgets need.
    pub(crate) fn set_budgets(&self, settings: &Settings) {
        self.uploads.begin_anew(&self.device, settings);
    }

    /// Puts the tiles that were taken into their slots: by commands those that lie on the belt, through the
    /// queue, and so before these commands, the others. Of several for one slot the last.
    pub(super) fn copy_tiles(&self, encoder: &mut wgpu::CommandEncoder) -> Result<Vec<Copied>, Error> {
        let uploads = &self.undone.uploads;
        let numbered = || uploads.iter().enumerate();
        let last: HashMap<_, _> =
            numbered().map(|(nth, (pool, upload))| ((*pool, upload.slot), nth)).collect();
        let mut copied = Vec::new();
        for (nth, (pool, upload)) in numbered() {
            if last.get(&(*pool, upload.slot)) != Some(&nth) {
                continue;
            }
            let pool = &self.pools[usize::from(pool.number())];
            match self.copy_from_belt(encoder, pool, upload)? {
                Some(tile) => copied.push(tile),
                None => pool.upload(&self.queue, upload.slot, &upload.bytes)?,
            }
        }
        Ok(copied)
    }

    /// Takes note of the least and the greatest value of a tile that comes into a slot, if it is of a volume.
    pub(super) fn note_range(&mut self, pool: PoolId, upload: &Upload) {
        let Some(pool) = self.pools.get_mut(usize::from(pool.number())) else { return };
        #[cfg(not(target_family = "wasm"))]
        if let Some(tile) = self.uploads.on_belt(&upload.bytes) {
            return pool.note_range_from(upload.slot, &tile);
        }
        pool.note_range(upload.slot, &upload.bytes);
    }

    /// Records the copy of a tile that lies on the belt.
    #[cfg(not(target_family = "wasm"))]
    fn copy_from_belt(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pool: &PoolState,
        upload: &Upload,
    ) -> Result<Option<Copied>, Error> {
        let (Some(tile), Some(gpu)) = (self.uploads.on_belt(&upload.bytes), pool.gpu()) else {
            return Ok(None);
        };
        gpu.upload_from(encoder, upload.slot, &tile)?;
        Ok(Some(tile))
    }

    #[cfg(target_family = "wasm")]
    fn copy_from_belt(
        &self,
        _encoder: &mut wgpu::CommandEncoder,
        _pool: &PoolState,
        _upload: &Upload,
    ) -> Result<Option<Copied>, Error> {
        Ok(None)
    }

    /// The source of a texture of a pool as the loader reads it, and the bytes that each of its tiles takes
    /// on its way.
    #[cfg(not(target_family = "wasm"))]
    pub(crate) fn staged(
        &self,
        pool: PoolId,
        source: Arc<dyn TileSource>,
    ) -> (Arc<dyn TileSource>, Option<u64>) {
        let Some(gpu) = self.pools[usize::from(pool.number())].gpu() else { return (source, None) };
        let (source, room_bytes) = self.uploads.staging(source, gpu.belt_layout());
        (source, Some(gpu.layout().tile_bytes + room_bytes))
    }

    #[cfg(target_family = "wasm")]
    pub(crate) fn staged(
        &self,
        _pool: PoolId,
        source: Arc<dyn TileSource>,
    ) -> (Arc<dyn TileSource>, Option<u64>) {
        (source, None)
    }
}
