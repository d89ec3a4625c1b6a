//! Which sample positions of the jitter cycle a view has shown: a position whose feedback is lost is looked
//! at again before any other.
//!
//! A view has been seen whole when its last feedbacks, as many as there are positions, showed every one of
//! them. Before that nothing is known of some of its pixels, whatever the pager takes for converged.

use std::collections::VecDeque;

/// The sample positions that a view has shown. Where textures take turns over cycles, each turn is a position
/// of its own.
#[derive(Debug, Default)]
pub(super) struct Cycle {
    /// The number of the next pass that repeats none. Its position is what is left of the division by the
    /// cycle's length.
    next: u64,
    /// Passes whose feedback was lost, the oldest first.
    lost: VecDeque<u64>,
    /// Frames whose feedback is to come, each with its pass, in the order in which they were recorded.
    under_way: VecDeque<(u64, u64)>,
    /// Of each position, how many feedbacks had come when it came last; 0 where it has not.
    seen: Vec<u64>,
    come: u64,
    /// The frame in which the view was drawn last, whether there was room for its feedback or not.
    drawn: Option<u64>,
}

impl Cycle {
    /// The pass that is drawn next.
    pub(super) fn pass(&self) -> u64 {
        self.lost.front().copied().unwrap_or(self.next)
    }

    /// The feedback of a pass that [`Cycle::pass`] has given is on its way, as that of a frame. What was lost
    /// meanwhile is drawn after it.
    pub(super) fn record(&mut self, frame: u64, pass: u64) {
        self.lost.retain(|&lost| lost != pass);
        self.next = self.next.max(pass + 1);
        self.under_way.push_back((frame, pass));
        self.drawn = Some(frame);
    }

    /// The view is drawn in a frame, and so many feedbacks are on their way that there is no room for it: a
    /// slow device is no reason to take the view for one that nobody draws.
    pub(super) fn find_no_room(&mut self, frame: u64) {
        self.drawn = Some(frame);
    }

    /// A frame's feedback has come, in a cycle of so many positions.
    pub(super) fn come(&mut self, frame: u64, length: u64) {
        let Some(pass) = self.take(frame) else { return };
        self.fit(length);
        self.come += 1;
        self.seen[(pass % length.max(1)) as usize] = self.come;
    }

    /// A frame's feedback will not come.
    pub(super) fn lose(&mut self, frame: u64) {
        if let Some(pass) = self.take(frame) {
            let place = self.lost.partition_point(|&other| other < pass);
            self.lost.insert(place, pass);
        }
    }

    /// The picture is another one: nothing of it has been seen, and what is under way will not come.
    pub(super) fn begin_anew(&mut self) {
        let under_way: Vec<u64> = self.under_way.iter().map(|(frame, _)| *frame).collect();
        under_way.into_iter().for_each(|frame| self.lose(frame));
        self.seen.fill(0);
        self.come = 0;
    }

    /// Returns true if each of so many positions is among the last feedbacks, as many as there are positions.
    pub(super) fn has_seen_all(&self, length: u64) -> bool {
        let is_recent = |&seen: &u64| seen > 0 && seen + length > self.come;
        self.seen.len() as u64 == length && self.seen.iter().all(is_recent)
    }

    /// Returns true if each of so many positions is among the last feedbacks, as many as these, in a cycle of
    /// a multiple of them: in any of its turns.
    pub(super) fn has_seen_positions(&self, length: u64, positions: u64) -> bool {
        let is_recent = |&seen: &u64| seen > 0 && seen + positions > self.come;
        let places = positions as usize;
        let any = |at: usize| self.seen.iter().skip(at).step_by(places.max(1)).any(is_recent);
        self.seen.len() as u64 == length && places > 0 && (0..places).all(any)
    }

    /// Returns true if the view was drawn in the last frames, so many of them.
    pub(super) fn is_drawn(&self, frame: u64, length: u64) -> bool {
        self.drawn.is_some_and(|drawn| drawn + length >= frame)
    }

    fn take(&mut self, frame: u64) -> Option<u64> {
        let place = self.under_way.iter().position(|&(of, _)| of == frame)?;
        self.under_way.remove(place).map(|(_, pass)| pass)
    }

    /// Positions of a shorter cycle are seen where any of those was that fall on them.
    fn fit(&mut self, length: u64) {
        let length = length.max(1) as usize;
        if self.seen.len() != length {
            let before = std::mem::replace(&mut self.seen, vec![0; length]);
            for (position, seen) in before.into_iter().enumerate() {
                let same = &mut self.seen[position % length];
                *same = seen.max(*same);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENGTH: u64 = 16;

    impl Cycle {
        /// Also where the view is not drawn.
        fn is_seen_whole(&self, frame: u64, length: u64) -> bool {
            !self.is_drawn(frame, length) || self.has_seen_all(length)
        }
    }

    /// Records a frame in each step; its feedback comes or is lost `late` frames afterwards, as `is_lost`
    /// says.
    fn play(late: u64, frames: u64, is_lost: impl Fn(u64) -> bool) -> (Cycle, Vec<(u64, bool)>) {
        let (mut cycle, mut passes, mut whole) = (Cycle::default(), Vec::new(), Vec::new());
        for frame in 0..frames {
            passes.push(cycle.pass());
            let pass = cycle.pass();
            cycle.record(frame, pass);
            let Some(due) = frame.checked_sub(late) else { continue };
            match is_lost(due) {
                true => cycle.lose(due),
                false => {
                    cycle.come(due, LENGTH);
                    whole.push((passes[due as usize] % LENGTH, cycle.is_seen_whole(frame, LENGTH)));
                }
            }
        }
        (cycle, whole)
    }

    /// A device that answers late leaves no room for feedback, for longer than a cycle.
    #[test]
    fn a_view_without_room_for_its_feedback_is_not_taken_for_a_hidden_one() {
        let mut cycle = Cycle::default();
        (0..LENGTH).for_each(|frame| cycle.record(frame, frame));
        (0..LENGTH).for_each(|frame| cycle.come(frame, LENGTH));
        assert!(cycle.is_seen_whole(LENGTH, LENGTH));
        cycle.begin_anew();
        for frame in LENGTH..10 * LENGTH {
            cycle.find_no_room(frame);
            assert!(!cycle.is_seen_whole(frame, LENGTH), "frame {frame}");
        }
        assert!(cycle.is_seen_whole(12 * LENGTH, LENGTH), "nobody draws it any more");
    }

    /// It says whole exactly where the last 16 that came showed all of the 16 positions, and does so soon
    /// after the last loss.
    #[test]
    fn it_is_whole_when_every_position_has_come() {
        let patterns: [fn(u64) -> bool; 6] =
            [|_| false, |n| n % 2 == 1, |n| n % 3 != 0, |n| n == 20, |n| (30..40).contains(&n), |n| n < 10];
        for (late, is_lost) in (0..4).flat_map(|late| patterns.map(|is_lost| (late, is_lost))) {
            let (_, came) = play(late, 200, is_lost);
            for end in 0..came.len() {
                let last = &came[(end + 1).saturating_sub(LENGTH as usize)..=end];
                let positions: std::collections::BTreeSet<u64> = last.iter().map(|(at, _)| *at).collect();
                assert_eq!(came[end].1, positions.len() as u64 == LENGTH, "{late} late, the {end}th");
            }
            let whole = came.iter().filter(|(_, whole)| *whole).count();
            assert!(whole > 0, "{late} late: {came:?}");
        }
    }

    #[test]
    fn a_lost_position_is_the_next_to_be_looked_at() {
        let mut cycle = Cycle::default();
        for frame in 0..5 {
            assert_eq!(cycle.pass(), frame);
            let pass = cycle.pass();
            cycle.record(frame, pass);
        }
        for frame in [3, 1] {
            cycle.lose(frame);
        }
        for (frame, pass) in [(5, 1), (6, 3), (7, 5), (8, 6)] {
            assert_eq!(cycle.pass(), pass);
            let pass = cycle.pass();
            cycle.record(frame, pass);
        }
    }

    #[test]
    fn another_picture_is_seen_anew_and_one_that_is_not_drawn_is_not_waited_for() {
        let (mut cycle, _) = play(2, 60, |_| false);
        assert!(cycle.is_seen_whole(60, LENGTH));
        cycle.begin_anew();
        assert!(!cycle.is_seen_whole(60, LENGTH) && cycle.pass() == 58);
        assert!(cycle.is_seen_whole(60 + LENGTH, LENGTH));
        assert!(Cycle::default().is_seen_whole(0, LENGTH));
    }

    #[test]
    fn turns_make_the_cycle_longer() {
        let (mut cycle, _) = play(0, 40, |_| false);
        assert!(!cycle.is_seen_whole(40, 2 * LENGTH));
        for frame in 40..80 {
            let pass = cycle.pass();
            cycle.record(frame, pass);
            cycle.come(frame, 2 * LENGTH);
        }
        assert!(cycle.is_seen_whole(80, 2 * LENGTH));
        let pass = cycle.pass();
        cycle.record(80, pass);
        cycle.come(80, LENGTH);
        assert!(cycle.is_seen_whole(80, LENGTH));
    }

    #[test]
    fn one_turn_shows_every_position() {
        let mut cycle = Cycle::default();
        for frame in 0..40 {
            let is_seen = cycle.has_seen_positions(3 * LENGTH, LENGTH);
            assert_eq!(is_seen, frame >= LENGTH, "{frame}");
            let pass = cycle.pass();
            cycle.record(frame, pass);
            cycle.come(frame, 3 * LENGTH);
        }
        cycle.begin_anew();
        assert!(!cycle.has_seen_positions(3 * LENGTH, LENGTH));
    }
}
