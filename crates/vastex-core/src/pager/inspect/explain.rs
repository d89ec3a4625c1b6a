//! Why a pixel shows what it shows: what was wanted there, what is there, what stands between the two, and
//! since when.
//!
//! For people and tools. Everything is read off the state that the pager has anyway, so nothing is recorded
//! for it and a frame costs what it would; what a page went through before it was last evicted is not
//! remembered beyond a second.

use std::fmt;

use crate::pager::Pager;
use crate::pager::pool::PoolPager;
use crate::residency::PageState;
use crate::table::pool::PoolId;
use crate::texture::page::{Dims, PageId};
use crate::wanted::feedback::{Need, WantedPage};

/// What keeps a page from being in a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wait {
    /// The page is not asked for: no feedback of the last jitter cycle has named it, and nothing asked for it
    /// explicitly.
    Feedback,
    /// The page is asked for after so many others, as loads that are under way end or as bytes in flight
    /// allow.
    Request {
        /// Pages that are asked for before this one.
        before: u32,
    },
    /// The page would find no slot: all are taken by what is in view, and the mip bias may not act.
    Slot,
    /// The loader has the page.
    Loader,
    /// Another page has the same content, and its tile is under way for both.
    Representative {
        /// The page that is loaded for both.
        page: PageId,
        /// What that page is of: an image or a volume.
        dims: Dims,
    },
    /// The page's tile is in main memory, and so many others are uploaded before it, as the upload budget
    /// allows.
    Upload {
        /// Tiles that are uploaded before this one.
        before: u32,
    },
    /// The source could not give the page, which is tried again in this frame.
    Retry {
        /// The frame in which the page is tried again.
        at: u64,
    },
}

/// Something that has happened to a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Step {
    /// The page lost its slot.
    Evicted,
    /// From then on the page was wanted in every frame.
    Wanted,
    /// The loader was asked for the page.
    Asked,
    /// The page's tile came into its slot.
    Settled,
}

/// Why a pixel shows what it shows: the page that was wanted there, the page that is shown, what stands
/// between the two, and since when. It is read from the pager's state, so frames cost no more for it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Explanation {
    /// The pool.
    pub pool: PoolId,
    /// The frame of which this is true.
    pub frame: u64,
    /// What the texture is: an image or a volume.
    pub dims: Dims,
    /// What is wanted at mip bias 0, and how far into its level, in eighths.
    pub wanted: WantedPage,
    /// The pool's mip bias, in eighths of a level.
    pub bias_eighths: u16,
    /// The page that is wanted at that bias, or the ancestor that stands for it if it has no tile.
    pub at_bias: PageId,
    /// What is shown there: the finest resident page that covers it, as sharp as that at most.
    pub shown: PageId,
    /// The state of the page that is wanted at the bias.
    pub state: PageState,
    /// What the page waits for, if it is not in a slot.
    pub wait: Option<Wait>,
    /// Loads of the page that failed in a row.
    pub failures: u32,
    /// True if the page's content has changed, so that what is shown is out of date until its new tile is
    /// here.
    pub is_stale: bool,
    /// Pages in the page's slot, itself included; 0 if it is in none.
    pub in_slot: u32,
    /// What has happened to the page, the latest last, each with its frame.
    pub history: Vec<(u64, Step)>,
}

impl PoolPager {
    /// Why a pixel that wants this shows what it shows; `None` if there is no such page. Costs a visit of
    /// every missing page.
    pub fn explain(&self, wanted: WantedPage) -> Option<Explanation> {
        if !self.textures.contains(wanted.page) {
            return None;
        }
        let dims = self.textures.geometry(wanted.page.texture())?.dims();
        let residency = &self.residency;
        let bias_eighths = self.bias_eighths();
        let level = Need::new(wanted.page.level(), wanted.eighth).level_at(bias_eighths);
        let line = || std::iter::once(wanted.page).chain(self.textures.ancestors(wanted.page));
        let at_bias = line().find(|page| page.level() >= level || self.textures.is_tail(*page))?;
        let at_bias = self.textures.present_page(at_bias);
        let mut covers = std::iter::once(at_bias).chain(self.textures.ancestors(at_bias));
        let is_here = |page: &PageId| residency.slot_of(*page).is_some();
        let shown = covers.find(is_here)?;
        let in_slot = residency.pages_in_slot_of(at_bias);
        Some(Explanation {
            pool: self.pool(),
            frame: residency.frame(),
            dims,
            wanted,
            bias_eighths,
            at_bias,
            shown,
            state: self.state(at_bias),
            wait: self.wait_of(at_bias),
            failures: residency.history(at_bias).failures,
            is_stale: residency.refreshes().pages().any(|page| page == at_bias),
            in_slot,
            history: self.history_of(at_bias),
        })
    }

    fn wait_of(&self, page: PageId) -> Option<Wait> {
        let residency = &self.residency;
        let before = |is_before: &dyn Fn(&PageId) -> bool| {
            let listed = self.load_order.pages().chain(self.plan.pages());
            listed.take_while(|&other| other != page).filter(is_before).count() as u32
        };
        match residency.state(page) {
            PageState::Resident(_) => None,
            PageState::Absent => Some(Wait::Feedback),
            PageState::Loading => Some(Wait::Loader),
            PageState::Failed { until } => Some(Wait::Retry { at: until }),
            PageState::Ready => {
                Some(Wait::Upload { before: before(&|&other| residency.state(other) == PageState::Ready) })
            }
            PageState::Queued => Some(match self.representative_of(page) {
                Some((page, dims)) => Wait::Representative { page, dims },
                None if !self.load_order.has_room() => Wait::Slot,
                None => Wait::Request {
                    before: before(&|&other| {
                        residency.state(other) == PageState::Queued && residency.may_load(other)
                    }),
                },
            }),
        }
    }

    /// The page that is loaded in the page's place, if that is another one, and of what texture.
    fn representative_of(&self, page: PageId) -> Option<(PageId, Dims)> {
        let representative = self.residency.sharing().representative_of(page)?;
        Some((representative, self.textures.geometry(representative.texture())?.dims()))
    }

    fn history_of(&self, page: PageId) -> Vec<(u64, Step)> {
        let mut steps = Vec::new();
        steps.extend(self.residency.evicted_at(page).map(|frame| (frame, Step::Evicted)));
        if !self.textures.is_tail(page) {
            let history = self.residency.history(page);
            steps.extend(history.wanted_since.map(|frame| (frame, Step::Wanted)));
            steps.extend(history.asked_at.map(|frame| (frame, Step::Asked)));
            steps.extend(history.settled_at.map(|frame| (frame, Step::Settled)));
        }
        steps.sort_unstable();
        steps
    }
}

impl Pager {
    /// Why a pixel that wants this shows what it shows; see [`PoolPager::explain`].
    pub fn explain(&self, wanted: WantedPage) -> Option<Explanation> {
        let pool = self.pool_of(wanted.page.texture())?;
        self.pool(pool).explain(wanted)
    }
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Explanation { dims, wanted, at_bias, shown, bias_eighths, frame, .. } = self;
        let texture = wanted.page.texture().number();
        let level = f64::from(wanted.page.level()) + f64::from(wanted.eighth) / 8.0;
        let (pool, pos) = (self.pool.number(), wanted.page.pos(*dims));
        write!(f, "texture {texture} in pool {pool}: wants level {level} (page {},{}", pos.x, pos.y)?;
        if pos.z != 0 {
            write!(f, ",{}", pos.z)?;
        }
        write!(f, ")")?;
        if at_bias != &wanted.page {
            match bias_eighths {
                0 => write!(f, ", which has no tile; {} stands for it", at_bias.pos(*dims))?,
                _ => {
                    let bias = f64::from(*bias_eighths) / 8.0;
                    write!(f, ", at a mip bias of {bias} {}", at_bias.pos(*dims))?;
                }
            }
        }
        match shown.level() - at_bias.level() {
            0 if at_bias == &wanted.page => write!(f, "\nshown at full sharpness")?,
            0 => write!(f, "\nshown: {}", shown.pos(*dims))?,
            1 => write!(f, "\nshown: {}, a level coarser", shown.pos(*dims))?,
            coarser => write!(f, "\nshown: {}, {coarser} levels coarser", shown.pos(*dims))?,
        }
        write!(f, "\nstate in frame {frame}: {}", self.state_text())?;
        self.history.iter().try_for_each(|(frame, step)| write!(f, "\n  frame {frame}: {step}"))
    }
}

impl Explanation {
    fn state_text(&self) -> String {
        let mut text = match self.wait {
            None => match self.in_slot {
                0 | 1 => "in a slot".into(),
                pages => format!("in a slot, with {} other pages of the same content", pages - 1),
            },
            Some(Wait::Feedback) => "absent: no feedback has named it yet".into(),
            Some(Wait::Request { before }) => {
                format!("queued {}; waiting for its turn to be loaded", ordinal(before))
            }
            Some(Wait::Slot) => "queued; waiting for a slot: all are in view".into(),
            Some(Wait::Loader) => "loading; waiting for the loader".into(),
            Some(Wait::Representative { page, dims }) => {
                format!("queued; waiting for {}, which has the same content", page.pos(dims))
            }
            Some(Wait::Upload { before }) => {
                format!("loaded, {} to upload; waiting for upload budget", ordinal(before))
            }
            Some(Wait::Retry { at }) => format!("failed; it is tried again in frame {at}"),
        };
        if self.failures > 0 {
            text += &format!("; {} failed in a row", count(self.failures, "load"));
        }
        if self.is_stale {
            text += "; its content has changed, and the new tile is on its way";
        }
        text
    }
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Step::Evicted => "lost its slot",
            Step::Wanted => "came into view",
            Step::Asked => "asked for",
            Step::Settled => "in its slot",
        })
    }
}

/// How the one is called that comes after so many.
fn ordinal(before: u32) -> String {
    let nth = u64::from(before) + 1;
    let ending = match (nth % 100, nth % 10) {
        (11..=13, _) => "th",
        (_, 1) => "st",
        (_, 2) => "nd",
        (_, 3) => "rd",
        _ => "th",
    };
    format!("{nth}{ending}")
}

fn count(number: u32, what: &str) -> String {
    if number == 1 { format!("1 {what}") } else { format!("{number} {what}s") }
}
