//! Ranks: where a load belongs in the loader's queue.
//!
//! A rank is the place of a page in the order of loading, within the band of what it is for. A record keeps
//! the class of the rank that the loader was given. The loader gets a new rank at once when the band changes,
//! for better or worse, and within a band when the class of the place improves. The classes are the places 0,
//! 1, 2 to 3, 4 to 7 and so on, so that a load gets another rank a few times at most, however often the order
//! is made anew.

/// Bits of a rank that are the place; those above are the band.
const PLACE_BITS: u32 = 32;

/// What a load is for. Every rank of a band is better than any of the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RankBand {
    /// A page in view that is missing.
    View,
    /// A page in view that is resident, whose content has changed.
    RefreshInView,
    /// What comes after everything in view.
    AfterView,
}

/// The rank of a place in a band.
pub(crate) fn rank_of(band: RankBand, place: usize) -> u64 {
    (band as u64) << PLACE_BITS | place as u64
}

/// A rank, coarsely: its band, and the power of two of its place. A lower one is better.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct RankClass(u8);

impl RankClass {
    pub(crate) const BEST: RankClass = RankClass(0);
    /// Classes of the places of a band.
    const OF_BAND: u8 = 64;

    pub(crate) fn of(rank: u64) -> RankClass {
        let place = rank & ((1 << PLACE_BITS) - 1);
        RankClass((rank >> PLACE_BITS) as u8 * RankClass::OF_BAND + (u64::BITS - place.leading_zeros()) as u8)
    }

    /// Returns true if it is of a page in view that is missing.
    pub(crate) fn is_for_view(self) -> bool {
        self.band() == RankBand::View as u8
    }

    fn band(self) -> u8 {
        self.0 / RankClass::OF_BAND
    }

    /// Returns true if a load of this class is to be ranked anew when its rank would be of the class `now`.
    pub(crate) fn gives_way_to(self, now: RankClass) -> bool {
        now < self || now.band() != self.band()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rank_of_a_band_is_better_than_any_of_the_next_and_so_is_its_class() {
        let bands = [RankBand::View, RankBand::RefreshInView, RankBand::AfterView];
        let places = [0, 1, 2, 3, 4, 1000, u32::MAX as usize];
        let ranks: Vec<u64> =
            bands.iter().flat_map(|&band| places.map(|place| rank_of(band, place))).collect();
        assert!(ranks.is_sorted_by(|a, b| a < b));
        assert!(ranks.is_sorted_by_key(|&rank| RankClass::of(rank)));
        for (a, b) in ranks.chunks(places.len()).zip(ranks.chunks(places.len()).skip(1)) {
            assert!(RankClass::of(a[places.len() - 1]) < RankClass::of(b[0]));
        }
    }

    #[test]
    fn a_load_is_ranked_anew_where_its_band_changes_or_its_place_halves() {
        let class = |band, place| RankClass::of(rank_of(band, place));
        let moves = |from: (RankBand, usize), to: (RankBand, usize)| {
            class(from.0, from.1).gives_way_to(class(to.0, to.1))
        };
        assert!(
            moves((RankBand::AfterView, 0), (RankBand::View, 900))
                && moves((RankBand::View, 0), (RankBand::AfterView, 900))
        );
        assert!(
            moves((RankBand::View, 100), (RankBand::View, 50))
                && moves((RankBand::View, 1), (RankBand::View, 0))
        );
        assert!(!moves((RankBand::View, 100), (RankBand::View, 64)), "not for a few places");
        assert!(
            !moves((RankBand::View, 3), (RankBand::View, 100)),
            "what is better than it should be comes sooner"
        );
        assert!(!moves((RankBand::View, 7), (RankBand::View, 7)));
    }
}
