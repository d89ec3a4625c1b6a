//! What an application may set, with defaults that suit a desktop.

mod file;
mod pools;

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::sync::Arc;
use std::time::Duration;

use vastex_core::{Layer, VoxelLevels};
use vastex_tiles::LoaderSettings;
use vastex_wgpu::VolumeFilters;
pub use vastex_wgpu::{BindingPlace, FeedbackMode, Filter, MaxTaps, TableChoice, UnknownFilter};

pub use file::{Platform, SettingsError};
pub use pools::{PoolRule, PoolSettings, PoolTuning, ScaleGroups};

/// How the loop keeps time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Pace {
    /// Nothing is waited for: feedback and tiles act when they arrive. For anything that a person looks at.
    #[default]
    Realtime,
    /// Equal frames give equal pictures on every machine: the feedback of frame `n` acts in frame `n +
    /// 2`, and a load takes a whole number of frames and is waited for. For tests and for rendering to files;
    /// not in a browser, where nothing may be waited for.
    LockStep {
        /// Frames that a load takes, at least 1.
        latency_frames: u64,
    },
}

/// How tiles get from main memory to the GPU.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UploadMode {
    /// By a belt if that is better: in real time, with Vulkan, Metal and Direct3D 12. In lock-step, where
    /// frames must be the same everywhere, through the queue.
    #[default]
    Best,
    /// Through the queue: `wgpu` makes a buffer for each layer of each tile, in the frame that uploads it.
    Queue,
    /// By a belt: the loader's threads put decoded tiles into mapped memory that the GPU copies from, and a
    /// frame records a copy for each layer. It takes main memory of up to [`Settings::in_flight_bytes`] and a
    /// few frames' uploads. Browsers have none.
    Belt,
}

/// The settings of a [`Textures`](crate::Textures). Every budget is an upper bound that is never exceeded.
///
/// Later versions may have more fields: write `Settings { picture, ..Settings::default() }`.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// GPU memory for tiles, and the rule by which too small a pool makes the picture coarser. Too little
    /// memory never makes the picture wrong; the smallest pool is the tails of its textures and one tile. By
    /// default as much as the picture needs ([`PoolTuning::bytes`]), and a pool that is too small makes the
    /// picture coarser.
    pub pools: PoolSettings,
    /// Width and height of the picture, for pools without a size of their own. A larger picture needs larger
    /// pools. 1920x1080 by default.
    pub picture: [u32; 2],
    /// Bytes copied to the GPU per frame, for all pools together, which get equal parts. With a small budget
    /// a view sharpens later; even one below a tile gets there. 2 MiB by default.
    pub upload_bytes_per_frame: u64,
    /// Bytes of tiles being loaded or waiting for the upload budget, of all pools together; at least one tile
    /// is always allowed. If several textures have pages, none holds so much that others could not begin: a
    /// texture whose loads never end holds at most half. A tile on a belt ([`Settings::uploads`]) counts with
    /// its room there, too. 16 MiB by default.
    pub in_flight_bytes: u64,
    /// How tiles get to the GPU. [`UploadMode::Best`] by default.
    pub uploads: UploadMode,
    /// Main memory for encoded tiles, in bytes of all textures together, so that tiles seen before need not
    /// be read again; 64 MiB by default. If there is no room, the least recently used tile goes, of whichever
    /// texture; of the tiles that the other textures have used in the last jitter cycle
    /// ([`JITTER_CYCLE`](crate::JITTER_CYCLE) frames) no texture displaces more than half, however much it
    /// loads. Textures that are held whole ([`Settings::whole_bytes`]) take nothing of it.
    pub ram_cache_bytes: u64,
    /// Main memory for decoded tiles that [`Cpu::sample`](crate::Cpu::sample) reads, in bytes for all
    /// textures together. Empty as long as nothing is sampled. 16 MiB by default.
    pub cpu_cache_bytes: u64,
    /// Reads of tiles that may be at work at once, decoding included; at least 1, each with a thread. A read
    /// that waits for a network, or blocks its thread for over a quarter of a second, gives its place to
    /// another. Reads whose source says that they block
    /// ([`source::ReadLimit::blocking`](crate::source::ReadLimit::blocking)), as those directly from the disk
    /// do ([`source::Container::open_file_direct`](crate::source::Container::open_file_direct)), take no
    /// place. Without effect in a browser. 2 by default.
    pub loader_threads: usize,
    /// Reads of one texture's source that may be under way at once; at least 1, and at least as many as there
    /// are threads. Sources on one server or disk should share a limit
    /// ([`source::LimitedSource`](crate::source::LimitedSource)), which then counts instead, as does a limit
    /// that a source has itself. 8 by default.
    pub reads_at_once: usize,
    /// How long the read of a tile may take. After that it counts as failed
    /// ([`Event::Failed`](crate::Event::Failed), retried with back-off) and nothing waits for it any more.
    /// Once all reads that a source may have at once are overdue, its reads fail at once, but for one read at
    /// a time that finds out if the source answers again.
    ///
    /// With [`Pace::LockStep`], where every load is waited for, a frame waits up to this long for a source
    /// that does not answer, and shows the pages as failed ones. 30 seconds by default.
    pub read_time_out: Duration,
    /// In a browser, which has no loader threads: how long a frame decodes tiles. It decodes at least one
    /// waiting tile, and so may take one tile longer. Without effect natively. 4 ms by default.
    pub decode_time_per_frame: Duration,
    /// How texels of layers whose values may be mixed are blended. [`TextureSettings::filters`] overrides it
    /// for single layers. [`Filter::Trilinear`] by default.
    pub filter: Filter,
    /// How long a tile takes to fade in from what was on screen before; zero, the default, shows tiles at
    /// once. 100 to 300 ms look well. Unless it is zero, shaders read once more for each lookup, and sample
    /// what lies beneath while a tile fades. [`Textures::set_frame_time`](crate::Textures::set_frame_time)
    /// says how much time passes from frame to frame.
    pub fade: Duration,
    /// How views say what they want; `None`, the default, for the best mode that the device has
    /// ([`FeedbackMode::best`]). A mode that the device lacks is an error, except in a browser, whose
    /// reported limits do not tell all that a device can do.
    pub feedback: Option<FeedbackMode>,
    /// True if nearer is a larger depth in the application's passes: feedback targets are then cleared to 0
    /// instead of 1. False by default.
    pub reversed_depth: bool,
    /// The group and the first binding at which the application's shaders see the textures. By default a
    /// group of its own, number 0.
    pub binding: BindingPlace,
    /// The colour, or the values, that shaders show for an id that names no texture, such as the id of a
    /// removed one. Magenta, `[1, 0, 1, 1]`, by default.
    pub unknown_color: [f32; 4],
    /// How the loop keeps time. [`Pace::Realtime`] by default.
    pub pace: Pace,
    /// True if pages share a load and a slot when their source says that they have the same content
    /// ([`TileSource::contents`](crate::TileSource::contents)). Switch it off only to see what sharing saves.
    /// True by default.
    pub share_contents: bool,
    /// Bytes of GPU memory up to which a texture is held whole, as an ordinary one with all its levels: it
    /// takes no part in paging, asks for nothing and is sharp from the first frame, and shaders sample it
    /// like any other. All of it is read before it is added. Such textures with tiles of one size and the
    /// same formats share a pool, which starts with room for one and doubles when it is full. Sparse textures
    /// are never held whole, and in a browser only those that were [prepared](crate::Preparer). 0, for no
    /// such textures, by default.
    pub whole_bytes: u64,
    /// Which formats the device filters well in volumes; `None`, the default, to find out
    /// ([`VolumeFilters::of`]), for some milliseconds when the first volume is prepared.
    pub volume_filters: Option<VolumeFilters>,
    /// Frames whose telemetry is kept, some 600 bytes for each pool and frame; 0 for none. 256 by default.
    pub telemetry_frames: u64,
}

impl Default for Settings {
    fn default() -> Settings {
        let loader = LoaderSettings::default();
        Settings {
            pools: PoolSettings::default(),
            picture: [1920, 1080],
            upload_bytes_per_frame: 2 << 20,
            in_flight_bytes: 16 << 20,
            uploads: UploadMode::Best,
            ram_cache_bytes: 64 << 20,
            cpu_cache_bytes: 16 << 20,
            loader_threads: loader.threads,
            reads_at_once: loader.reads_at_once,
            read_time_out: loader.time_out,
            decode_time_per_frame: loader.decode_time,
            filter: Filter::Trilinear,
            fade: Duration::ZERO,
            feedback: None,
            reversed_depth: false,
            binding: BindingPlace::default(),
            unknown_color: [1.0, 0.0, 1.0, 1.0],
            pace: Pace::Realtime,
            share_contents: true,
            whole_bytes: 0,
            volume_filters: None,
            telemetry_frames: 256,
        }
    }
}

impl Settings {
    /// Threads, and reads at once, that a settings file or the program's options may ask for.
    #[doc(hidden)]
    pub const READS_AT_ONCE: RangeInclusive<i64> = 1..=4096;
    /// Time-outs of a read that a settings file or the program's options may ask for, in seconds: up to a
    /// day.
    #[doc(hidden)]
    pub const READ_TIME_OUT_S: RangeInclusive<f64> = 0.001..=86_400.0;

    /// The settings that concern the loader.
    pub(crate) fn of_loader(&self) -> LoaderSettings {
        LoaderSettings {
            threads: self.loader_threads,
            reads_at_once: self.reads_at_once,
            time_out: self.read_time_out,
            decode_time: self.decode_time_per_frame,
        }
    }
}

/// What may be set of one texture.
///
/// Later versions may have more fields: write `TextureSettings { filters, ..TextureSettings::default() }`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextureSettings {
    /// The kind of page table that the texture gets. [`TableChoice::BySize`] by default; the other choices
    /// are for measuring one against the other.
    pub page_table: TableChoice,
    /// How the texels of single layers are blended, by the layers' names. Other layers are blended by
    /// [`Settings::filter`], except those whose values may not be mixed
    /// ([`Layer::is_mixable`](crate::Layer::is_mixable)): each pixel shows one of their texels, and their
    /// tiles do not fade in.
    pub filters: BTreeMap<String, Filter>,
    /// For a volume, where the voxels of its levels lie in the world and in its tiles, as the source's author
    /// knows; `None` if they are the texels of the [`Geometry`](crate::Geometry). Without effect on images.
    pub voxels: Option<Arc<VoxelLevels>>,
}

/// How a layer is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sampling {
    /// Nearest where its values are not mixed.
    pub(crate) filter: Filter,
    /// True if its values are mixed, with those of a coarser tile, too.
    pub(crate) is_mixed: bool,
}

impl TextureSettings {
    /// How a layer is sampled where others are by `filter`.
    pub(crate) fn sampling(&self, layer: &Layer, filter: Filter) -> Sampling {
        let asked = self.filters.get(&layer.name).copied();
        // Values that a filter may mix may be mixed with those of a coarser tile, too; nothing blends whole
        // numbers.
        let is_mixed = match asked {
            Some(asked) if asked != Filter::Nearest => !layer.format.is_whole_number(),
            _ => layer.is_mixable,
        };
        Sampling { filter: if is_mixed { asked.unwrap_or(filter) } else { Filter::Nearest }, is_mixed }
    }

    /// The name of a filter's layer that is none of these.
    pub(crate) fn unknown_layer(&self, layers: &[Layer]) -> Option<&str> {
        let is_unknown = |name: &&String| layers.iter().all(|layer| layer.name != **name);
        self.filters.keys().find(is_unknown).map(String::as_str)
    }
}
