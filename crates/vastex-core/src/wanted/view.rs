//! Views: the main view, and others beside it, as of a mirror, a shadow, a second eye, a second window.
//!
//! Each gives feedback of its own, as often as it is drawn. A view's weight only says how much its pixels
//! count when it is decided what is loaded first. Which views there are is the pager's business.

/// Views that there can be at once, the main view among them.
pub const MAX_VIEWS: usize = 8;

/// Names a view. Numbers are not given twice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ViewId(u32);

impl ViewId {
    /// The main view, which is always there.
    pub const MAIN: ViewId = ViewId(0);

    /// The view that is expected, which is no view yet. Feedback for it is a prediction, which decides what
    /// is loaded early, and never counts as wanted by a view.
    pub const EXPECTED: ViewId = ViewId(u32::MAX);

    /// The view of this number; 0 is the main view.
    pub const fn new(number: u32) -> ViewId {
        ViewId(number)
    }

    /// The view's number.
    pub const fn number(self) -> u32 {
        self.0
    }
}

/// Why a view could not be added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ViewError {
    /// There are as many as there can be.
    #[error(
        "there are {MAX_VIEWS} views already; remove one, or let views that show parts of one scene share one"
    )]
    TooMany,
    /// There is a view of this number.
    #[error("there is a view of the number {0} already; take one that is free")]
    NumberTaken(u32),
}

/// How much a pixel counts, in 65536ths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Weight(u32);

impl Weight {
    pub(crate) const ONE: Weight = Weight(1 << Weight::FRACTION_BITS);
    const FRACTION_BITS: u32 = 16;
    /// A weight is at least one by this, and at most this.
    const MOST: f32 = 256.0;

    /// The nearest weight; of what is no number, that of the main view.
    pub(crate) fn new(weight: f32) -> Weight {
        if weight.is_nan() {
            return Weight::ONE;
        }
        Weight((weight.clamp(1.0 / Weight::MOST, Weight::MOST) * Weight::ONE.0 as f32) as u32)
    }

    /// What so many pixels count: at least one where there is any.
    pub(crate) fn of(self, pixels: u32) -> u32 {
        let weighted = (u64::from(pixels) * u64::from(self.0)) >> Weight::FRACTION_BITS;
        u32::try_from(weighted).unwrap_or(u32::MAX).max(pixels.min(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_weight_is_a_number_whatever_is_given() {
        assert_eq!((Weight::new(1.0), Weight::new(f32::NAN)), (Weight::ONE, Weight::ONE));
        assert_eq!(Weight::new(f32::INFINITY), Weight::new(256.0));
        assert_eq!(Weight::new(-3.0), Weight::new(1.0 / 256.0));
        assert_eq!(Weight::new(0.5).of(7), 3);
        assert_eq!(Weight::new(256.0).of(u32::MAX), u32::MAX);
    }

    proptest! {
        #[test]
        fn no_weight_makes_pixels_nothing_or_turns_them_round(weight in any::<f32>(), few in any::<u32>(), more in any::<u32>()) {
            let weight = Weight::new(weight);
            let (few, more) = (few.min(more), few.max(more));
            prop_assert!(weight.of(few) <= weight.of(more));
            prop_assert_eq!(weight.of(few) == 0, few == 0);
            prop_assert_eq!(Weight::ONE.of(few), few);
        }
    }
}
