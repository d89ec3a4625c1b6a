//! Which of two missing pages is loaded first. `load_order` keeps the list that is sorted by it.
//!
//! First comes what is at most two levels finer than what is on screen, so that a view that has nothing
//! better sharpens step by step; then what is further ahead. Within each, by the pixels that would gain times
//! the levels that they would gain; among equals the coarser page, then the one nearest the centre of what is
//! wanted. It is an order, never a wait: a free loader takes the next best.

use rustc_hash::FxHashMap;

use crate::pager::working_set::WorkingSet;
use crate::residency::records::RecordHint;
use crate::texture::page::{PageId, TextureNumber};
use crate::texture::textures::Textures;

/// How many levels finer than what is on screen a page may be and still belong to the first group.
const STEP_LEVELS: u8 = 2;

/// Bits that a gain needs at most: pixels (32) times levels (8).
const GAIN_BITS: u32 = 40;

/// A missing page, and where its record was.
#[derive(Clone, Copy, Debug)]
pub(super) struct Missing {
    pub(super) page: PageId,
    pub(super) record: RecordHint,
}

/// A missing page. Ascending order of `key`, then of the page, is the order of loading.
#[derive(Clone, Copy, Debug)]
struct Ranked {
    /// The group, then the gain, then the level, each the larger first, then the distance: in one number,
    /// since comparing is what sorting does most.
    key: u128,
    page: PageId,
    record: RecordHint,
}

impl Ranked {
    fn key(gap: u8, gain: u64, level: u8, distance: u64) -> u128 {
        let (group, gain) = (u128::from(gap > STEP_LEVELS), u128::from((1 << GAIN_BITS) - 1 - gain));
        let level = u128::from(u8::MAX - level);
        (((group << GAIN_BITS | gain) << u8::BITS) | level) << u64::BITS | u128::from(distance)
    }
}

/// The centre of what is wanted of a texture: the sum of the pages' middles, in texels of level 0, weighted
/// by pixels, and of the weights.
type Centre = ([f64; 3], f64);

/// Works out the order of loading, in memory that it keeps.
#[derive(Debug, Default)]
pub(super) struct Ranking {
    ranked: Vec<Ranked>,
    centres: FxHashMap<TextureNumber, Centre>,
}

impl Ranking {
    /// Puts the missing pages of the working set at `bias` into `order`, best first.
    pub(super) fn order_missing(
        &mut self,
        set: &WorkingSet,
        bias: u16,
        textures: &Textures,
        order: &mut Vec<Missing>,
    ) {
        order.clear();
        self.ranked.clear();
        let mut missing = set.pages_at(bias).filter(|(_, node)| !node.is_resident).peekable();
        if missing.peek().is_none() {
            return;
        }
        self.find_centres(set, textures);
        let Ranking { ranked, centres } = self;
        ranked.extend(missing.map(|(page, node)| {
            let gap = set.shown_above(node, textures) - page.level();
            let gain = u64::from(node.pixels - node.finer.min(node.pixels)) * u64::from(gap);
            let key = Ranked::key(gap, gain, page.level(), distance(centres, page, textures));
            Ranked { key, page, record: node.record }
        }));
        ranked.sort_unstable_by_key(|ranked| (ranked.key, ranked.page));
        order.extend(ranked.iter().map(|&Ranked { page, record, .. }| Missing { page, record }));
    }

    fn find_centres(&mut self, set: &WorkingSet, textures: &Textures) {
        self.centres.clear();
        for (page, pixels) in set.direct_pages() {
            let Some(middle) = middle_of(page, textures) else { continue };
            let (sum, weight) = self.centres.entry(page.texture()).or_default();
            let pixels = f64::from(pixels);
            (0..3).for_each(|axis| sum[axis] += middle[axis] * pixels);
            *weight += pixels;
        }
    }
}

/// Square of the distance from the centre to the page, in texels of level 0.
fn distance(centres: &FxHashMap<TextureNumber, Centre>, page: PageId, textures: &Textures) -> u64 {
    let (Some((sum, weight)), Some(middle)) = (centres.get(&page.texture()), middle_of(page, textures))
    else {
        return 0;
    };
    (0..3).map(|axis| (middle[axis] - sum[axis] / weight.max(1.0)).powi(2)).sum::<f64>() as u64
}

fn middle_of(page: PageId, textures: &Textures) -> Option<[f64; 3]> {
    let (geometry, pos) = textures.pos(page)?;
    let (scale, side, coords) = (geometry.level(pos.level).scale, geometry.page(), pos.coords());
    Some(std::array::from_fn(|a| (f64::from(coords[a]) + 0.5) * f64::from(side[a]) * scale[a] as f64))
}
