//! The order of loading.
//!
//! First what is at most two levels finer than what is on screen, so that a view that has nothing better sharpens step
//! by step; then what is further ahead. Within each, by the pixels that would gain times the levels that they would gain;
//! among equals the coarser page, then the one nearest the centre of what is wanted. It is an order, never a wait:
//! a free loader takes the next best.

use std::cmp::Reverse;

use rustc_hash::FxHashMap;

use crate::page::{PageId, TextureId};
use crate::residency::Residency;
use crate::textures::Textures;
use crate::working_set::WorkingSet;

/// How many levels finer than what is on screen a page may be and still belong to the first group.
const STEP_LEVELS: u8 = 2;

/// Ascending order is the order of loading.
type Rank = (bool, Reverse<u64>, Reverse<u8>, u64, PageId);

/// The centre of what is wanted of each texture, in texels of level 0 weighted by pixels.
struct Centres(FxHashMap<TextureId, [f64; 3]>);

impl Centres {
    fn of(set: &WorkingSet, textures: &Textures) -> Centres {
        let mut sums: FxHashMap<TextureId, ([f64; 3], f64)> = FxHashMap::default();
        for (page, pixels) in set.direct_pages() {
            let Some(middle) = middle_of(page, textures) else { continue };
            let (sum, weight) = sums.entry(page.texture()).or_default();
            let pixels = f64::from(pixels);
            (0..3).for_each(|axis| sum[axis] += middle[axis] * pixels);
            *weight += pixels;
        }
        Centres(
            sums.into_iter()
                .map(|(texture, (sum, weight))| (texture, sum.map(|s| s / weight.max(1.0))))
                .collect(),
        )
    }

    /// Square of the distance from the centre to the page, in texels of level 0.
    fn distance(&self, page: PageId, textures: &Textures) -> u64 {
        let (Some(centre), Some(middle)) = (self.0.get(&page.texture()), middle_of(page, textures)) else {
            return 0;
        };
        (0..3).map(|axis| (middle[axis] - centre[axis]).powi(2)).sum::<f64>() as u64
    }
}

fn middle_of(page: PageId, textures: &Textures) -> Option<[f64; 3]> {
    let (geometry, pos) = textures.pos(page)?;
    let (scale, side, coords) = (geometry.level(pos.level).scale, geometry.page(), pos.coords());
    Some(std::array::from_fn(|a| (f64::from(coords[a]) + 0.5) * f64::from(side[a]) * scale[a] as f64))
}

/// Puts the missing pages of the working set at `bias` into `order`, best first.
pub(crate) fn order_missing(
    set: &WorkingSet,
    bias: u16,
    residency: &Residency,
    textures: &Textures,
    order: &mut Vec<PageId>,
) {
    let centres = Centres::of(set, textures);
    let mut ranked: Vec<Rank> = set
        .pages_at(bias)
        .filter(|&(page, _)| residency.slot_of(page).is_none())
        .map(|(page, node)| {
            let shown = textures.ancestors(page).find(|&a| residency.slot_of(a).is_some());
            let gap = shown.map_or(u8::MAX, |shown| shown.level()) - page.level();
            let gain = u64::from(node.pixels - node.finer.min(node.pixels)) * u64::from(gap);
            (gap > STEP_LEVELS, Reverse(gain), Reverse(page.level()), centres.distance(page, textures), page)
        })
        .collect();
    ranked.sort_unstable();
    order.clear();
    order.extend(ranked.into_iter().map(|(.., page)| page));
}
