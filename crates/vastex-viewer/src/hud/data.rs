//! What the panel is told: plain data, taken from the textures or made up.

use std::collections::BTreeMap;

use egui::TextureId as PictureId;
use vastex::diagnostics::{ExplainedPixel, FrameStats, PoolRecord, PoolStats};
use vastex::{BiasRule, FeedbackMode, Filter, PoolId, Textures};

use super::frame_times::FrameTimes;
use crate::overlay::Overlay;
use crate::stage::PartTime;

/// What the panel shows. By default nothing.
#[derive(Clone, Debug, Default)]
pub struct HudData {
    /// Each pool that has memory, in the order of their numbers.
    pub pools: Vec<HudPool>,
    /// Of all pools together.
    pub stats: FrameStats,
    /// True if a volume is shown. Volumes are sampled and asked in one way, are drawn with no overlay, and
    /// explain no pixel, so that nothing of these is offered. The host's.
    pub is_of_volume: bool,
    /// Bytes that may be copied to the GPU per frame.
    pub upload_bytes_per_frame: u64,
    /// Bytes of tiles that may be on their way.
    pub in_flight_bytes: u64,
    /// How views say what they want, and how else they could on this device.
    pub feedback: FeedbackMode,
    /// How texels are blended; `None` if that follows the magnification. The host's.
    pub filter: Option<Filter>,
    /// What is drawn in the place of the picture, if anything is. The host's.
    pub overlay: Option<Overlay>,
    /// Small pictures of the machine. The host's.
    pub thumbnails: Vec<MachineThumbnail>,
    /// Why a pixel shows what it shows, if one was asked for. The host's.
    pub explained: Option<ExplainedPixel>,
    /// From frame to frame. The host's.
    pub frames: FrameTimes,
    /// What the GPU took for the parts of a frame; `None` if it does not tell. The host's.
    pub gpu_times: Option<Vec<PartTime>>,
}

/// A pool, and what is in it.
#[derive(Clone, Debug)]
pub struct HudPool {
    /// The pool's figures after the last frame.
    pub stats: PoolStats,
    /// After each of the last frames, oldest first.
    pub records: Vec<PoolRecord>,
    /// Frames that the graphs are wide.
    pub frames: u64,
    /// How the pool's mip bias is decided; `None` if there is never one.
    pub rule: Option<BiasRule>,
    /// True if a person chose the pool's size. The host says so.
    pub is_sized_by_hand: bool,
    /// The pool's textures, the one with the most pages first.
    pub textures: Vec<HudTexture>,
}

/// What a pool holds of a texture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HudTexture {
    /// The texture's name, or its number if it has none.
    pub name: String,
    /// The texture's pages whose tiles are in slots.
    pub pages: u32,
    /// The slots of those tiles; one that several textures share counts for the first of them.
    pub slots: u32,
    /// The bytes of those slots.
    pub bytes: u64,
    /// The finest and the coarsest level of those pages.
    pub levels: [u8; 2],
}

/// A small picture of the machine, registered with what draws the panel.
#[derive(Clone, Debug, PartialEq)]
pub struct MachineThumbnail {
    /// The overlay that the picture is of; a click on it shows that in the place of the picture.
    pub overlay: Overlay,
    /// The picture.
    pub picture: PictureId,
    /// The picture's width and height in pixels.
    pub size: [u32; 2],
}

impl HudData {
    /// What the textures say. What only a host knows is as it is by default. Costs a visit of every page that
    /// has a state.
    pub fn of(textures: &Textures) -> HudData {
        let (inspect, stats) = (textures.inspect(), textures.stats());
        let mut records: BTreeMap<PoolId, Vec<PoolRecord>> = BTreeMap::new();
        for record in inspect.telemetry().iter() {
            records.entry(record.pager.pool).or_default().push(*record);
        }
        let usage = inspect.pool_usage();
        let with_memory = stats.pools.iter().filter(|pool| pool.bytes > 0);
        let pools = with_memory.map(|stats| {
            let mut slots: BTreeMap<u16, u32> = BTreeMap::new();
            for slot in inspect.slots(stats.pool).into_iter().flatten() {
                *slots.entry(slot.page.texture().number()).or_default() += 1;
            }
            let used = usage.pools.iter().find(|pool| pool.pool == stats.pool.number());
            let of_texture = |texture: &vastex::diagnostics::DumpedTexture| {
                let held = slots.get(&texture.texture).copied().unwrap_or(0);
                let level = |level: Option<&vastex::diagnostics::LevelPages>| level.map_or(0, |of| of.level);
                HudTexture {
                    name: texture.name.clone().unwrap_or_else(|| format!("texture {}", texture.texture)),
                    pages: texture.pages,
                    slots: held,
                    bytes: u64::from(held) * stats.tile_bytes(),
                    levels: [level(texture.levels.first()), level(texture.levels.last())],
                }
            };
            HudPool {
                stats: stats.clone(),
                records: records.remove(&stats.pool).unwrap_or_default(),
                frames: inspect.telemetry().frames(),
                rule: inspect.bias_rule(stats.pool),
                is_sized_by_hand: false,
                textures: used.map_or_else(Vec::new, |pool| pool.textures.iter().map(of_texture).collect()),
            }
        });
        let settings = inspect.settings();
        HudData {
            pools: pools.collect(),
            upload_bytes_per_frame: settings.upload_bytes_per_frame,
            in_flight_bytes: settings.in_flight_bytes,
            feedback: inspect.feedback_mode(),
            stats,
            ..HudData::default()
        }
    }
}
