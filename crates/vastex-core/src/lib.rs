//! The part of Vastex that decides.
//!
//! This crate knows the shape of virtual textures ([`Geometry`]), names their pages ([`PageId`]), keeps the
//! CPU image of the page table ([`TableImage`]) and decides, frame after frame, which pages are loaded, which
//! are evicted and how much coarser the picture has to be for everything to fit ([`Pager`]).
//!
//! It is not responsible for anything that can fail or that takes time: it does no I/O, touches no GPU, reads
//! no clock and starts no thread. The frame index is its time; events go in, decisions come out as values.

mod lab;
mod pager;
mod record;
mod residency;
pub mod shader_constants;
#[cfg(feature = "sim")]
pub mod sim;
mod table;
mod texture;
mod wanted;

pub use lab::policies::Policy;
pub use lab::replay::{PoolSize, Replay, ReplayError, ReplaySettings, replay};
pub use pager::bias::{BiasRule, Integrator};
pub use pager::budget::UploadBucket;
pub use pager::decision::{Request, Upload};
pub use pager::event::{Event, TexturePages};
pub use pager::inspect::explain::{Explanation, Step, Wait};
pub use pager::inspect::telemetry::{History, PoolFrame};
pub use pager::inspect::usage::{PoolUsage, SlotUsage, TextureUsage};
pub use pager::pool::PoolPager;
pub use pager::tickets::{AskError, Progress, Ticket, TicketState, Urgency};
pub use pager::{Budgets, Pager};
pub use record::file::FileError;
pub use record::prefetch_sets::{LearnError, LearnSettings, PrefetchSets, SetsError};
pub use record::trace::{CameraPosition, Trace, TraceError, TraceRecordError};
pub use residency::PageState;
pub use residency::resize::SlotMove;
pub use residency::stats::Stats;
pub use residency::time_to_sharp::TimeToSharp;
pub use table::estimate::PoolEstimate;
pub use table::hashed_table::{HashedBucket, HashedTable, HashedTextureTable};
pub use table::pool::{ArrayLimits, PoolError, PoolId, PoolLayout, Slot};
pub use table::{ChangeRule, PageTable, TableChange, TableEntry, TableImage};
pub use texture::format::{Description, Layer, LayerError, LayerFormat};
pub use texture::geometry::codec::{GeometryBytesError, GeometryParts};
pub use texture::geometry::tail::TailLayout;
pub use texture::geometry::{
    AddressMode, Geometry, GeometryError, GeometrySpec, Level, MAX_LEVELS, MAX_TEXELS, PAGE_TEXELS,
    TexelPositions,
};
pub use texture::level_rule::LevelRule;
pub use texture::nodata::{NodataValue, NodataValueError};
pub use texture::numbering::PageNumbering;
pub use texture::page::{Dims, PageId, PageIdError, PagePos, TextureNumber};
pub use texture::page_contents::PageContents;
pub use texture::page_set::PageSet;
pub use texture::region::Region;
pub use texture::space::{Box3, TexelRun, fold, fold_runs, is_border_color};
pub use texture::voxels::{StoredLevel, VOXEL_FRACTION_BITS, VoxelLevel, VoxelLevels, VoxelLevelsError};
pub use wanted::compact::FeedbackCompactor;
pub use wanted::feedback::{Feedback, Need, WantedPage};
pub use wanted::groups::{GroupError, GroupNumber};
pub use wanted::motion::Motion;
pub use wanted::survey::{
    Camera, FlatSurface, GlobeSurface, LevelImage, Patch, Surface, Survey, SurveySettings, Surveyed,
    SurveyedObject, SurveyedTexture, UvBox,
};
pub use wanted::view::{MAX_VIEWS, ViewError, ViewId};

#[cfg(feature = "checks")]
pub use pager::inspect::checks;
