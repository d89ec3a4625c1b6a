//! The mip bias of a pool: how many levels coarser the picture is, so that the working set fits.
//!
//! How large the set is at each bias is known at once (`working_set`); here stands which bias is taken, and when it falls.

use crate::shared::JITTER_CYCLE;
use crate::working_set::WorkingSet;

/// Decides the mip bias of a pool: up at once to the smallest whose set fits 90 % of the slots, down only when the finer
/// set fits 80 %, and only after a whole jitter cycle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BiasControl {
    slots: u32,
    bias: u16,
    /// Feedbacks in a row for which a finer set would have fitted 80 %.
    calm: u32,
    /// The largest bias that any of them would have needed.
    calm_bias: u16,
}

impl BiasControl {
    pub(crate) fn new(slots: u32) -> BiasControl {
        BiasControl { slots, bias: 0, calm: 0, calm_bias: 0 }
    }

    /// The bias in force, in eighths of a level.
    pub(crate) fn bias(&self) -> u16 {
        self.bias
    }

    /// A new working set has begun.
    pub(crate) fn restart(&mut self) {
        (self.bias, self.calm, self.calm_bias) = (0, 0, 0);
    }

    /// Takes the set's sizes into account; says whether the bias rose.
    pub(crate) fn update(&mut self, set: &WorkingSet, pins: u32) -> bool {
        let share = |percent: u64| (u64::from(self.slots) * percent / 100) as u32;
        let needed = set.bias_for(share(90).saturating_sub(pins));
        if needed > self.bias {
            (self.bias, self.calm, self.calm_bias) = (needed, 0, 0);
            return true;
        }
        let roomy = set.bias_for(share(80).saturating_sub(pins));
        if roomy >= self.bias {
            (self.calm, self.calm_bias) = (0, 0);
            return false;
        }
        self.calm += 1;
        self.calm_bias = self.calm_bias.max(roomy);
        if self.calm > JITTER_CYCLE {
            (self.bias, self.calm, self.calm_bias) = (self.calm_bias, 0, 0);
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::feedback::{Feedback, WantedPage};
    use crate::geometry::{Geometry, GeometrySpec};
    use crate::page::{Dims, PageId, PagePos, TextureId};
    use crate::textures::Textures;
    use std::sync::Arc;

    fn textures() -> (Textures, TextureId) {
        let geometry = Arc::new(Geometry::new(GeometrySpec::image(8192, 4096)).unwrap());
        let mut textures = Textures::default();
        let id = TextureId::new(0).unwrap();
        assert!(textures.add(id, geometry, None));
        (textures, id)
    }

    fn wanted(texture: TextureId, x: u32) -> WantedPage {
        let page = PageId::new(texture, Dims::D2, PagePos::new_2d(0, x, 0)).unwrap();
        WantedPage { page, pixels: 1, eighth: 0 }
    }

    #[test]
    fn the_bias_rises_at_once_and_falls_after_a_calm_cycle() {
        let (textures, id) = textures();
        let mut control = BiasControl::new(20);
        let row = |n: u32| (0..n).map(|x| wanted(id, x)).collect::<Vec<_>>();
        let mut set = WorkingSet::new();
        set.observe(&Feedback { frame: 0, pages: row(32), degenerate: 0 }, &textures);
        set.rebuild(&textures, |_| false);
        assert!(control.update(&set, 1));
        let risen = control.bias();
        assert!(risen >= 8 && set.size_at(risen) < 18);
        let mut frames = 0;
        while control.bias() == risen {
            set.observe(&Feedback { frame: 0, pages: row(2), degenerate: 0 }, &textures);
            set.rebuild(&textures, |_| false);
            assert!(!control.update(&set, 1));
            frames += 1;
        }
        // One cycle until the wide view is forgotten, and one calm one.
        assert_eq!((frames, control.bias()), (2 * JITTER_CYCLE, 0));
    }
}
