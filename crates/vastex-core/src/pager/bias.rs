//! The mip bias of a pool: how many levels coarser the picture is, so that the working set fits.
//!
//! How large the set is at each bias is known at once (`working_set`); here stands which bias is taken, and
//! when it falls. The rule is chosen with [`BiasRule`]: the solution, or the controller of large engines to
//! measure it against.

use crate::pager::working_set::WorkingSet;
use crate::shader_constants::{MAX_LEVELS, STEPS_PER_LEVEL};

/// How the mip bias of a pool is decided.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum BiasRule {
    /// Solved: up at once to the smallest bias whose working set fits 90 % of the slots, down only when the
    /// finer set fits 80 %, and only after a whole jitter cycle. Each pool has its own.
    #[default]
    Solved,
    /// Hunted, a little each frame, as large engines do it: a baseline. Until the bias is large enough, what
    /// came first is shown sharply and the rest by its ancestors. The largest bias of the pools with this
    /// rule acts on all of them.
    Integrating(Integrator),
}

/// A controller that adds up by how much too many slots are in use. The default is what large engines set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Integrator {
    /// The bias falls while the view takes less than this share of the slots, 0 to 1; 0.95 by default.
    pub lower: f32,
    /// The bias rises while the view takes more than this share, 0 to 1; 0.95 by default. A view takes all
    /// the slots at most, so at 0.95 and a rate of 0.2 it rises by a level in 100 frames.
    pub upper: f32,
    /// Levels a frame, times the share by which a bound is missed; 0.2 by default.
    pub rate: f32,
    /// Where tails take more than this share of the slots, 0 to 1, there is no bias: it would not help. 0.65
    /// by default.
    pub locked: f32,
    /// The largest bias, in levels; at most 32, and 4 by default.
    pub max_levels: f32,
}

/// The share of its slots that views may take of a pool before [`BiasRule::Solved`] makes them coarser, in
/// percent.
const MOST_SHARE: u64 = 90;

impl BiasRule {
    /// Of so many slots those that views may take, tails included, before [`BiasRule::Solved`] makes them
    /// coarser: 90 %, so that what comes into view finds room.
    pub const fn room(slots: u32) -> u32 {
        (slots as u64 * MOST_SHARE / 100) as u32
    }

    /// The least number of slots that have [room](BiasRule::room) for so many tiles; `u32::MAX` where more
    /// were needed.
    pub const fn slots_for(tiles: u64) -> u32 {
        let slots = tiles.saturating_mul(100).div_ceil(MOST_SHARE);
        if slots > u32::MAX as u64 { u32::MAX } else { slots as u32 }
    }
}

impl Default for Integrator {
    fn default() -> Integrator {
        Integrator { lower: 0.95, upper: 0.95, rate: 0.2, locked: 0.65, max_levels: 4.0 }
    }
}

/// Decides the mip bias of a pool, feedback after feedback.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BiasControl(State);

#[derive(Clone, Copy, Debug)]
enum State {
    /// There is never a bias.
    Off,
    Solved(Solved),
    Integrating(Integrating),
}

impl BiasControl {
    /// Without a rule there is never a bias.
    pub(crate) fn new(rule: Option<BiasRule>) -> BiasControl {
        let state = match rule {
            None => State::Off,
            Some(BiasRule::Solved) => State::Solved(Solved::default()),
            Some(BiasRule::Integrating(settings)) => {
                State::Integrating(Integrating { settings, levels: 0.0, shared: 0 })
            }
        };
        BiasControl(state)
    }

    /// The rule that it was made with.
    pub(crate) fn rule(&self) -> Option<BiasRule> {
        match &self.0 {
            State::Off => None,
            State::Solved(_) => Some(BiasRule::Solved),
            State::Integrating(integrating) => Some(BiasRule::Integrating(integrating.settings)),
        }
    }

    /// The bias in force, in eighths of a level.
    pub(crate) fn bias(&self) -> u16 {
        match &self.0 {
            State::Off => 0,
            State::Solved(solved) => solved.bias,
            State::Integrating(integrating) => integrating.eighths().max(integrating.shared),
        }
    }

    /// Returns true if a smaller bias is to follow from the set as it is.
    pub(crate) fn may_fall(&self, set: &WorkingSet, slots: u32, tails: u32) -> bool {
        matches!(&self.0, State::Solved(solved) if solved.roomy(set, slots, tails) < solved.bias)
    }

    /// Makes a solved bias larger by an eighth, and it does not fall below that until the floor is forgotten.
    /// Returns false where it is not solved, or as large as can be.
    pub(crate) fn raise_floor(&mut self) -> bool {
        let State::Solved(solved) = &mut self.0 else { return false };
        let is_raised = u32::from(solved.bias) < MAX_LEVELS * STEPS_PER_LEVEL;
        let bias = solved.bias + u16::from(is_raised);
        *solved = Solved { bias, floor: bias, ..Solved::default() };
        is_raised
    }

    /// A solved bias may fall as far as the set allows.
    pub(crate) fn forget_floor(&mut self) {
        if let State::Solved(solved) = &mut self.0 {
            solved.floor = 0;
        }
    }

    /// A new working set has begun.
    pub(crate) fn restart(&mut self) {
        if let State::Solved(solved) = &mut self.0 {
            *solved = Solved::default();
        }
    }

    /// Takes the set's sizes into account; returns true if the pool needs a larger bias than before.
    pub(crate) fn update(&mut self, set: &WorkingSet, slots: u32, tails: u32) -> bool {
        let bias = self.bias();
        match &mut self.0 {
            State::Off => false,
            State::Solved(solved) => solved.update(set, slots, tails),
            State::Integrating(integrating) => integrating.update(set.size_at(bias) + tails, slots, tails),
        }
    }

    /// Returns true if the working set is made to fit at once.
    #[cfg(feature = "checks")]
    pub(crate) fn is_solved(&self) -> bool {
        matches!(self.0, State::Solved(_))
    }

    /// What the pool adds to the bias that pools share, in eighths of a level; `None` if it has its own.
    pub(crate) fn shared(&self) -> Option<u16> {
        match &self.0 {
            State::Integrating(integrating) => Some(integrating.eighths()),
            State::Off | State::Solved(_) => None,
        }
    }

    /// The largest of what the pools add, in eighths of a level.
    pub(crate) fn set_shared(&mut self, eighths: u16) {
        if let State::Integrating(integrating) = &mut self.0 {
            integrating.shared = eighths;
        }
    }
}

/// [`BiasRule::Solved`].
#[derive(Clone, Copy, Debug, Default)]
struct Solved {
    bias: u16,
    /// Feedbacks in a row for which a finer set would have fitted 80 %.
    calm: u32,
    /// The largest bias that any of them would have needed.
    calm_bias: u16,
    /// The bias does not fall below this.
    floor: u16,
}

impl Solved {
    fn update(&mut self, set: &WorkingSet, slots: u32, tails: u32) -> bool {
        let needed = set.bias_for(BiasRule::room(slots).saturating_sub(tails));
        if needed > self.bias {
            *self = Solved { bias: needed, floor: self.floor, ..Solved::default() };
            return true;
        }
        let roomy = self.roomy(set, slots, tails);
        if roomy >= self.bias {
            (self.calm, self.calm_bias) = (0, 0);
            return false;
        }
        self.calm += 1;
        self.calm_bias = self.calm_bias.max(roomy);
        if self.calm > set.cycle() {
            *self = Solved { bias: self.calm_bias, floor: self.floor, ..Solved::default() };
        }
        false
    }

    /// The bias to which it falls, if that is smaller, for a set that stays as it is.
    fn roomy(&self, set: &WorkingSet, slots: u32, tails: u32) -> u16 {
        set.bias_for(((u64::from(slots) * 80 / 100) as u32).saturating_sub(tails)).max(self.floor)
    }
}

/// [`BiasRule::Integrating`].
#[derive(Clone, Copy, Debug)]
struct Integrating {
    settings: Integrator,
    /// What has been added up.
    levels: f32,
    /// The bias that pools share, in eighths of a level.
    shared: u16,
}

impl Integrating {
    fn eighths(&self) -> u16 {
        (self.levels * STEPS_PER_LEVEL as f32).round() as u16
    }

    fn update(&mut self, wanted: u32, slots: u32, tails: u32) -> bool {
        let Integrator { lower, upper, rate, locked, max_levels } = self.settings;
        let share = |pages: u32| pages.min(slots) as f32 / slots.max(1) as f32;
        let (taken, before) = (share(wanted), self.eighths());
        if share(tails) > locked {
            self.levels = 0.0;
        } else if taken > upper {
            self.levels += rate * (taken - upper);
        } else if taken < lower {
            self.levels -= rate * (lower - taken);
        }
        self.levels = self.levels.min(max_levels).clamp(0.0, MAX_LEVELS as f32);
        self.eighths() > before
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::residency::sharing::ContentId;
    use crate::shader_constants::JITTER_CYCLE;
    use crate::texture::geometry::{Geometry, GeometrySpec};
    use crate::texture::page::{Dims, PageId, PagePos, TextureNumber};
    use crate::texture::textures::Textures;
    use crate::wanted::feedback::{Feedback, WantedPage};
    use std::sync::Arc;

    fn textures() -> (Textures, TextureNumber) {
        let geometry = Arc::new(Geometry::new(GeometrySpec::image(8192, 4096)).unwrap());
        let mut textures = Textures::default();
        let id = TextureNumber::new(0).unwrap();
        assert!(textures.add(id, geometry, None));
        (textures, id)
    }

    fn wanted(texture: TextureNumber, x: u32) -> WantedPage {
        let page = PageId::new(texture, Dims::D2, PagePos::new_2d(0, x, 0)).unwrap();
        WantedPage { page, pixels: 1, eighth: 0 }
    }

    #[test]
    fn slots_have_room_for_what_they_are_for_and_one_fewer_has_not() {
        for tiles in (0..3000).chain([74, 139, 3_865_470_000]) {
            let slots = BiasRule::slots_for(tiles);
            assert!(u64::from(BiasRule::room(slots)) >= tiles, "{tiles}");
            assert!(slots == 0 || u64::from(BiasRule::room(slots - 1)) < tiles, "{tiles}");
        }
        assert_eq!([0, 74, u64::MAX].map(BiasRule::slots_for), [0, 83, u32::MAX]);
    }

    #[test]
    fn the_bias_rises_at_once_and_falls_after_a_calm_cycle() {
        let (textures, id) = textures();
        let mut control = BiasControl::new(Some(BiasRule::Solved));
        let row = |n: u32| (0..n).map(|x| wanted(id, x)).collect::<Vec<_>>();
        let mut set = WorkingSet::new();
        set.observe(&Feedback { frame: 0, pages: row(32), ..Feedback::default() }, &textures);
        set.rebuild(|_, record| (record, false), |_| false, |_| ContentId::NONE);
        assert!(control.update(&set, 20, 1));
        let risen = control.bias();
        assert!(risen >= 8 && set.size_at(risen) < 18);
        let mut frames = 0;
        while control.bias() == risen {
            set.observe(&Feedback { frame: 0, pages: row(2), ..Feedback::default() }, &textures);
            set.rebuild(|_, record| (record, false), |_| false, |_| ContentId::NONE);
            assert!(!control.update(&set, 20, 1));
            frames += 1;
        }
        // One cycle until the wide view is forgotten, and one calm one.
        assert_eq!((frames, control.bias()), (2 * JITTER_CYCLE, 0));
    }

    #[test]
    fn the_controller_rises_by_a_level_in_a_hundred_frames_and_no_further_than_it_may() {
        let mut control = Integrating { settings: Integrator::default(), levels: 0.0, shared: 0 };
        let frames_until = |control: &mut Integrating, eighths| {
            (1..1000).find(|_| {
                control.update(5000, 100, 1);
                control.eighths() == eighths
            })
        };
        // Half an eighth before the level is full it is rounded up.
        assert_eq!(frames_until(&mut control, 8), Some(94));
        assert_eq!(frames_until(&mut control, 32), Some(300));
        (0..100).for_each(|_| assert!(!control.update(5000, 100, 1)));
        assert_eq!(control.eighths(), 32);
        control.update(95, 100, 1);
        assert_eq!(control.eighths(), 32, "within its bounds it rests");
        (0..20).for_each(|_| assert!(!control.update(70, 100, 1)));
        assert_eq!(control.eighths(), 24, "a quarter of the slots too few: a level in 20 frames");
        control.update(5000, 100, 66);
        assert_eq!(control.eighths(), 0, "tails cannot be helped");
    }

    #[test]
    fn no_setting_of_the_controller_breaks_it() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 1e30] {
            for nth in 0..5 {
                let mut settings = Integrator::default();
                let Integrator { lower, upper, rate, locked, max_levels } = &mut settings;
                *[lower, upper, rate, locked, max_levels][nth] = bad;
                let mut control = Integrating { settings, levels: 0.0, shared: 0 };
                for wanted in [5000, 10, 0, 5000] {
                    control.update(wanted, 100, 1);
                    assert!(u32::from(control.eighths()) <= MAX_LEVELS * STEPS_PER_LEVEL, "{settings:?}");
                }
            }
        }
    }
}
