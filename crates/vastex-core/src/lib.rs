//! The part of Vastex that decides.
//!
//! This crate knows the shape of virtual textures ([`Geometry`]), names their pages ([`PageId`]), keeps the CPU
//! image of the page table ([`TableImage`]) and decides, frame after frame, which pages are loaded, which are
//! evicted and how much coarser the picture has to be for everything to fit ([`Pager`]).
//!
//! It is not responsible for anything that can fail or that takes time: it does no I/O, touches no GPU, reads no
//! clock and starts no thread. The frame index is its time; events go in, decisions come out as values.

mod bias;
mod budget;
mod by_hand;
#[cfg(feature = "checks")]
pub mod checks;
mod compact;
mod decision;
mod estimate;
mod event;
mod expectation;
mod explain;
mod failures;
mod feedback;
mod file;
mod flight;
mod format;
mod geometry;
mod groups;
mod hashed_table;
mod level_rule;
mod motion;
mod numbers;
mod order;
mod page;
mod page_contents;
mod page_map;
mod page_set;
mod pager;
mod pagers;
mod policy;
mod pool;
mod prefetch_sets;
mod ranks;
mod records;
mod recovery;
mod refresh;
mod region;
mod replay;
mod residency;
mod resize;
pub mod shared;
mod sharing;
#[cfg(feature = "sim")]
pub mod sim;
mod slots;
mod space;
mod stats;
mod survey;
mod table;
mod tail;
mod telemetry;
mod textures;
mod tickets;
mod trace;
mod usage;
mod victims;
mod views;
mod working_set;

pub use bias::{BiasRule, Integrator};
pub use budget::{PagerSettings, UploadBucket};
pub use compact::FeedbackCompactor;
pub use decision::{Request, Upload};
pub use estimate::PoolEstimate;
pub use event::{Event, TexturePages};
pub use explain::{Explanation, Step, Wait};
pub use feedback::{Feedback, Need, WantedPage};
pub use file::FileError;
pub use format::{Description, Layer, LayerError, LayerFormat};
pub use geometry::{
    AddressMode, Geometry, GeometryError, GeometrySpec, Level, MAX_LEVELS, MAX_TEXELS, PAGE_TEXELS,
    TexelPositions,
};
pub use groups::{GroupError, GroupId};
pub use hashed_table::{HashedPlace, HashedTable};
pub use level_rule::LevelRule;
pub use motion::Motion;
pub use page::{Dims, PageId, PageIdError, PagePos, TextureId};
pub use page_contents::PageContents;
pub use page_set::PageSet;
pub use pager::Pager;
pub use pagers::{Budgets, Pagers};
pub use policy::Policy;
pub use pool::{ArrayLimits, PoolError, PoolId, PoolLayout, Slot, SlotPlace};
pub use prefetch_sets::{LearnError, LearnSettings, PrefetchSets, SetsError};
pub use region::Region;
pub use replay::{PoolSize, Replay, ReplayError, ReplaySettings, replay};
pub use residency::PageState;
pub use resize::SlotMove;
pub use space::{Box3, fold, is_border_color};
pub use stats::Stats;
pub use survey::{
    Camera, FlatSurface, GlobeSurface, LevelImage, Patch, Surface, Survey, SurveySettings, Surveyed,
    SurveyedObject, SurveyedTexture, UvBox,
};
pub use table::{ChangeRule, PageTable, TableChange, TableEntry, TableImage, TableLayout};
pub use tail::TailLayout;
pub use telemetry::{History, PoolFrame, TimeToSharp};
pub use tickets::{AskError, Progress, Ticket, TicketState, Urgency};
pub use trace::{Place, Trace, TraceError, TraceRecordError};
pub use usage::{PoolUsage, SlotUsage, TextureUsage};
pub use views::{MAX_VIEWS, ViewError, ViewId};
