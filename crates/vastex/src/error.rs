//! What can go wrong, by what the application can do about it.

use std::time::Duration;

use crate::ids::{GroupId, TextureId};
use vastex_core::{GroupError, PagePos, PoolError, PoolId, TraceRecordError, ViewError, ViewId};
use vastex_tiles::{ContainerError, DecodeError, LoadError, ReadError};
use vastex_wgpu::GpuError;

/// Why a call failed. A tile that cannot be read is no error but an [`Event`](crate::Event).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file is no container, or a damaged one.
    #[error(transparent)]
    Container(#[from] ContainerError),
    /// The coarsest levels of a texture could not be read, so there would be nothing to show.
    #[error("the tail of the texture of {}x{} texels cannot be read, so it cannot be shown: {error}", size[0], size[1])]
    TailUnreadable {
        /// Width and height of the texture.
        size: [u32; 2],
        /// What the source said.
        error: ReadError,
    },
    /// The coarsest levels of a texture could not be decoded.
    #[error(
        "the tail of the texture of {}x{} texels cannot be decoded, so it cannot be shown: {error}; rebuild the file, or copy it anew",
        size[0], size[1]
    )]
    TailDamaged {
        /// Width and height of the texture.
        size: [u32; 2],
        /// What the decoder said.
        error: DecodeError,
    },
    /// The coarsest levels of a texture have not come in the time that reads may take.
    #[error(
        "the source of {}x{} texels has not given its tail within {time_out:?}, so the texture cannot be shown; check the disk or \
         the network that its tiles come from, or let reads take longer (`Settings::read_time_out`)",
        size[0], size[1]
    )]
    TailOverdue {
        /// Width and height of the texture.
        size: [u32; 2],
        /// How long the tail was waited for; of a texture that is held whole, since its last page.
        time_out: Duration,
    },
    /// Reading the coarsest levels of a texture ended in an unexpected way.
    #[error("the tail of the texture of {}x{} texels cannot be read, so it cannot be shown: {error}", size[0], size[1])]
    TailFailed {
        /// Width and height of the texture.
        size: [u32; 2],
        /// What the loader said.
        error: LoadError,
    },
    /// A tile could not be read.
    #[error(transparent)]
    Tile(ReadError),
    /// A tile could not be decoded.
    #[error("{pos}: {error}; rebuild the file, or copy it anew")]
    TileDamaged {
        /// The page.
        pos: PagePos,
        /// What the decoder said.
        error: DecodeError,
    },
    /// The coarsest levels of a texture cannot be read without waiting, in a browser;
    /// [`Textures::preparer`](crate::Textures::preparer) reads them.
    #[error("the tail is not at hand; read it with `Textures::preparer`, then add it")]
    TailPending,
    /// The texture was prepared for other settings, or for a device that can hold other formats or sizes.
    #[error(
        "the texture was prepared for other settings or another kind of device; prepare it again with `Textures::preparer` of the textures \
         that it is added to"
    )]
    OtherSettings,
    /// The texture has too many pages for all of them to be listed.
    #[error(
        "a texture of {pages} pages is not sampled whole on the CPU, {most} is the most; `Cpu::sample` answers from what is resident"
    )]
    TooManyPages {
        /// Pages of the texture.
        pages: u64,
        /// How many there may be.
        most: u64,
    },
    /// The pool is too small for its textures, or the device too small for a tile.
    #[error(transparent)]
    Pool(#[from] PoolError),
    /// Lock-step waits for the GPU, which a browser does not let a page do.
    #[error(
        "frames cannot be played in lock-step in a browser, where nothing may be waited for; set `pace` to `Pace::Realtime`"
    )]
    LockStepInBrowser,
    /// A prefetch or a pin was refused.
    #[error(transparent)]
    Ask(#[from] vastex_core::AskError),
    /// There is no such texture.
    #[error("there is no texture {} of this id; it was removed, or is one of other `Textures`", .0.number().number())]
    NoTexture(TextureId),
    /// There is no such group.
    #[error("there is no group {} of this id; it or one of its members was removed, or it is one of other `Textures`", .0.number().number().number())]
    NoGroup(GroupId),
    /// There is no such pool.
    #[error("there is no pool {}; ids of pools are in the statistics and events of the same textures", .0.number())]
    NoPool(PoolId),
    /// There is no such view.
    #[error("there is no view {}; it was removed, or is one of other textures", .0.number())]
    NoView(ViewId),
    /// The feedback pass that was begun before was not ended. What it has drawn is discarded, so that the
    /// next may begin.
    #[error(
        "the feedback pass of view {} that was begun in frame {frame} was not ended; call `ViewMut::end_feedback` behind each pass that \
         `ViewMut::begin_feedback` was called for",
        view.number()
    )]
    FeedbackNotEnded {
        /// The view.
        view: ViewId,
        /// The frame.
        frame: u64,
    },
    /// A view says twice in one frame what it wants.
    #[error(
        "the feedback of view {} in frame {frame} is drawn already; draw all that the view shows in one pass, drop the encoder of what is not \
         to be submitted, or call `Textures::update` between two frames",
        view.number()
    )]
    FeedbackTwice {
        /// The view.
        view: ViewId,
        /// The frame.
        frame: u64,
    },
    /// There is no feedback pass to be ended.
    #[error("no feedback pass of view {} was begun; call `ViewMut::begin_feedback` before the pass", .0.number())]
    FeedbackNotBegun(ViewId),
    /// The view could not be added.
    #[error(transparent)]
    View(#[from] ViewError),
    /// The system gives no threads to load tiles with.
    #[error("the system gives no threads to load tiles with: {0}")]
    Threads(#[from] std::io::Error),
    /// The trace could not be recorded to its end.
    #[error("the trace ends early: {0}")]
    Trace(#[from] TraceRecordError),
    /// A filter is set for a layer that the texture does not have.
    #[error("there is no layer {name:?} to set a filter for; the texture has {layers}")]
    FilterLayer {
        /// The name.
        name: String,
        /// The names that there are.
        layers: String,
    },
    /// A texture was added as a volume and has two axes.
    #[error("a texture of {}x{} texels has two axes and is no volume; add it by `Textures::add`", size[0], size[1])]
    NoVolume {
        /// Width and height of the texture.
        size: [u32; 2],
    },
    /// What was said of a volume's voxels does not fit the volume.
    #[error(
        "the voxels of {voxels} levels do not fit a volume of {levels} (of levels whose voxels are not cut as bricks are there may be {most}); take both from one source"
    )]
    Voxels {
        /// Levels of the volume.
        levels: usize,
        /// Levels for which the places of voxels are given.
        voxels: usize,
        /// The most levels that a volume may have whose voxels do not lie as its texels do.
        most: usize,
    },
    /// The textures cannot be a group.
    #[error(transparent)]
    Group(#[from] GroupError),
    /// The GPU failed. After [`GpuError::DeviceLost`], make a new device and call
    /// [`Memory::restore`](crate::Memory::restore).
    #[error(transparent)]
    Gpu(#[from] GpuError),
}
