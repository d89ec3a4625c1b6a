//! Looking into the machine: which textures, pages and pools there are, how each stands, what the feedback
//! pass sees.
//!
//! For people and tools. What shaders can tell of a place is `vastex_inspect`'s business; questions about
//! pixels are `pixels`'.

use vastex_core::{
    BiasRule, Explanation, Feedback, History, PageId, PageState, PoolId, SlotUsage, TextureNumber, WantedPage,
};
use vastex_wgpu::{FeedbackMode, FeedbackScale, FeedbackTarget};

use super::Textures;
use crate::error::Error;
use crate::gpu::{BindGroups, UploadStats};
use crate::ids::TextureId;
use crate::settings::Settings;
use crate::watch::{PoolDump, PoolRecord};

/// The state of textures, pages and pools, for people and tools; returned by [`Textures::inspect`].
#[derive(Clone, Copy)]
pub struct Inspect<'a> {
    textures: &'a Textures,
}

impl Textures {
    /// The state of textures, pages and pools, for people and tools.
    pub fn inspect(&self) -> Inspect<'_> {
        Inspect { textures: self }
    }
}

impl<'a> Inspect<'a> {
    /// The settings.
    pub fn settings(&self) -> &'a Settings {
        &self.textures.settings
    }

    /// How views say what they want: as the settings say, or the best that the device has.
    pub fn feedback_mode(&self) -> FeedbackMode {
        self.textures.gpu.mode()
    }

    /// Frames so far: the number of the frame that the next [`Textures::update`] plays.
    pub fn frame(&self) -> u64 {
        self.textures.paging.frame()
    }

    /// Returns true if, for a whole jitter cycle, no page was newly wanted and none was missing, in any pool.
    pub fn is_converged(&self) -> bool {
        self.textures.paging.pager().is_converged() && self.textures.is_seen_whole()
    }

    /// All textures, in the order of their numbers.
    pub fn textures(&self) -> impl Iterator<Item = TextureId> + use<'a> {
        let textures = self.textures;
        textures.paging.textures().filter_map(|(number, _)| textures.texture_of(number))
    }

    /// The texture that pages, events and statistics name by this number now, if there is one.
    pub fn id_of(&self, number: TextureNumber) -> Option<TextureId> {
        self.textures.texture_of(number)
    }

    /// The state of a page.
    pub fn state(&self, page: PageId) -> PageState {
        self.textures.paging.pager().state(page)
    }

    /// Why a place that wants this page at mip bias 0 shows what it shows; `None` if there is no such page.
    pub fn explain(&self, page: PageId) -> Option<Explanation> {
        self.textures.paging.pager().explain(WantedPage { page, pixels: 1, eighth: 0 })
    }

    /// The pages in view that could not be read so far.
    pub fn failed_pages(&self) -> Vec<PageId> {
        self.textures.paging.pager().failed_pages().collect()
    }

    /// What all views want together, of all textures, at mip bias 0: the pages that their feedbacks of the
    /// last jitter cycles named. With other textures of the same geometry in the place of these
    /// ([`PageId::new`]), it is what [`Ahead::prefetch_view`](crate::Ahead::prefetch_view) is given before
    /// the views turn to those: to the next point in time. Costs a visit of each page.
    pub fn wanted(&self) -> Feedback {
        let pools = self.textures.paging.pager().pools();
        Feedback::of_pages(self.frame(), pools.flat_map(|pool| pool.wanted()).collect())
    }

    /// The newest frame in which a view wanted the tail of a texture: its coarsest levels, which are always
    /// there and so are none of [`Inspect::wanted`]. `None` where none has, or there is no such texture.
    pub fn tail_wanted(&self, texture: TextureId) -> Option<u64> {
        let shown = self.textures.texture(texture).ok()?;
        self.textures.paging.pager().pool(shown.pool()?).tail_wanted(shown.number())
    }

    /// What is in each slot of a texture's pool, that of other textures too; `None` if one is free. Empty
    /// where there is no such texture.
    pub fn slots_beside(&self, texture: TextureId) -> Vec<Option<SlotUsage>> {
        let pool = self.textures.texture(texture).ok().and_then(|texture| texture.pool());
        pool.map_or_else(Vec::new, |pool| self.textures.paging.pager().pool(pool).slots())
    }

    /// How the mip bias of a pool is decided; `None` if the pool never has one, or is not there.
    pub fn bias_rule(&self, pool: PoolId) -> Option<BiasRule> {
        self.textures.paging.pager().pools().find(|pager| pager.pool() == pool)?.bias_rule()
    }

    /// What is in each slot of a pool, `None` of a free slot. Empty if there is no such pool. Costs a
    /// visit of every page that has a state.
    pub fn slots(&self, pool: PoolId) -> Vec<Option<SlotUsage>> {
        let pager = self.textures.paging.pager().pools().find(|pager| pager.pool() == pool);
        pager.map_or_else(Vec::new, |pager| pager.slots())
    }

    /// What is in the pools, by texture and level. Costs a visit of every page that has a state: for people
    /// and tools, not for each frame.
    pub fn pool_usage(&self) -> PoolDump {
        self.textures.dump_pool_usage()
    }

    /// How tiles have got to the GPU so far.
    pub fn upload_stats(&self) -> UploadStats {
        self.textures.gpu.upload_stats()
    }

    /// The feedback of the main view in this frame, drawn once more to be looked at: nothing follows from it.
    /// Its texture holds what the shaders wrote, row by row: page id low, page id high, eighth, flag.
    ///
    /// Submits a pass of its own, so the frame's own feedback must not be in an encoder that is not submitted
    /// yet.
    pub fn feedback_to_look_at(
        &self,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<FeedbackTarget, Error> {
        self.textures.gpu.draw_feedback_to_look_at(
            self.textures.paging.frame(),
            picture,
            FeedbackScale::Reduced,
            draw,
        )
    }

    /// Each pool after each of the last [`Settings::telemetry_frames`](crate::Settings::telemetry_frames)
    /// frames, oldest first.
    pub fn telemetry(&self) -> &'a History<PoolRecord> {
        self.textures.watch.telemetry()
    }

    /// Fails with [`GpuError::DeviceLost`](crate::GpuError::DeviceLost) where the device is lost. The frame
    /// loop says so by itself; this is for frames that do not get as far, as when a window gives no picture.
    /// Costs a buffer of 4 bytes.
    pub fn check_device(&self) -> Result<(), Error> {
        self.textures.gpu.check_device()
    }
}
