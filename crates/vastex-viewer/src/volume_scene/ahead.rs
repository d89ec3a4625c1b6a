//! Times that are not seen yet and will be, the way that time goes: their channels are read ahead, and of
//! each the bricks are prefetched that the views want of the time that is seen, after everything in view.
//!
//! What becomes of bricks is the pager's business ([`vastex::Ahead::prefetch_view`]). A time whose bricks are
//! all there takes the place of the one before at once.

use vastex::{Feedback, PageId, PagePos, TextureId, Textures, Ticket, Urgency, WantedPage};

use super::channels::{Channels, Part};
use super::look::{VolumeFacts, VolumeLook};

/// Times that are read ahead while times are played, and while somebody goes on by hand.
const PLAYED: u64 = 2;
const BY_HAND: u64 = 1;

/// Which bricks views want, of which part of what is shown, with their pixels.
type Wanted = Vec<(Part, PagePos, u32)>;

/// Times ahead.
#[derive(Debug, Default)]
pub(super) struct TimesAhead {
    /// Which way time went last, 1 or -1; 0 where nobody has gone on in it.
    way: i64,
    times: Vec<TimeAhead>,
    /// What the views of this number want, found out at this time.
    wanted: Option<(u64, u64, Wanted)>,
}

/// A time ahead.
#[derive(Debug)]
struct TimeAhead {
    channels: Channels,
    bricks: Option<BricksAhead>,
}

/// Bricks that were prefetched.
#[derive(Debug)]
pub(super) struct BricksAhead {
    /// The number of the views that want them.
    view: u64,
    pages: Vec<PageId>,
    /// `None` where they were refused, as more than the pool can hold.
    ticket: Option<Ticket>,
}

impl BricksAhead {
    /// Returns true if every brick that the views of this number want is there.
    pub(super) fn are_there(&self, view: u64, textures: &Textures) -> bool {
        let is_there = |page: &PageId| {
            textures.inspect().explain(*page).is_some_and(|explained| explained.shown == explained.at_bias)
        };
        let is_done = self.ticket.as_ref().is_some_and(|ticket| !ticket.is_open());
        self.view == view && is_done && self.pages.iter().all(is_there)
    }

    /// Ends prefetching the bricks; what has come of them stays until its slots are needed.
    pub(super) fn release(&self, textures: &mut Textures) {
        if let Some(ticket) = &self.ticket {
            textures.ahead().release(ticket);
        }
    }
}

impl TimesAhead {
    /// Somebody has gone from one time to another, of so many.
    pub(super) fn turn(&mut self, from: u64, to: u64, times: u64) {
        let times = times.max(1);
        self.way = match () {
            () if from == to => self.way,
            () if (from + 1) % times == to => 1,
            () if (to + 1) % times == from => -1,
            () => (i128::from(to) - i128::from(from)).signum() as i64,
        };
    }

    /// The times that come after one, the nearest first.
    fn after(&self, seen: u64, is_playing: bool, times: u64) -> Vec<u64> {
        let (way, count) = if is_playing { (1, PLAYED) } else { (self.way, BY_HAND) };
        let next = |step: u64| {
            let at = i128::from(seen) + i128::from(way) * i128::from(step);
            let within = (0..i128::from(times)).contains(&at);
            let at = if is_playing { at.rem_euclid(i128::from(times.max(1))) } else { at };
            (within || is_playing).then_some(at as u64).filter(|at| *at != seen)
        };
        let mut after: Vec<u64> = (1..=count).filter(|_| way != 0).filter_map(next).collect();
        after.dedup();
        after
    }

    /// The times that are kept.
    pub(super) fn times(&self) -> impl Iterator<Item = u64> + '_ {
        self.times.iter().map(|ahead| ahead.channels.time)
    }

    /// Times whose bricks are all there, for the views of this number.
    pub(super) fn ready(&self, view: u64, textures: &Textures) -> Vec<u64> {
        let is_ready =
            |ahead: &&TimeAhead| ahead.bricks.as_ref().is_some_and(|bricks| bricks.are_there(view, textures));
        self.times.iter().filter(is_ready).map(|ahead| ahead.channels.time).collect()
    }

    /// The channels of a time.
    pub(super) fn channels_at(&mut self, time: u64) -> Option<&mut Channels> {
        self.times.iter_mut().map(|ahead| &mut ahead.channels).find(|channels| channels.time == time)
    }

    /// The channels of all times, the nearest first.
    pub(super) fn channels(&mut self) -> impl Iterator<Item = &mut Channels> {
        self.times.iter_mut().map(|ahead| &mut ahead.channels)
    }

    /// A time comes: what was read of it, and its bricks, are no more ahead.
    pub(super) fn take(&mut self, time: u64) -> Option<(Channels, Option<BricksAhead>)> {
        let nth = self.times.iter().position(|ahead| ahead.channels.time == time)?;
        let TimeAhead { channels, bricks } = self.times.remove(nth);
        Some((channels, bricks))
    }

    /// Forgets all of it: no time is ahead.
    pub(super) fn clear(&mut self, textures: &mut Textures) {
        self.wanted = None;
        self.times.drain(..).for_each(|ahead| ahead.remove(textures));
    }

    /// Has the times ahead that come after the one that is seen. Those that do not any more are forgotten.
    pub(super) fn follow(
        &mut self,
        textures: &mut Textures,
        (seen, is_playing): (u64, bool),
        facts: &VolumeFacts,
    ) {
        let after = self.after(seen, is_playing, facts.times);
        let mut kept = Vec::new();
        for ahead in self.times.drain(..) {
            match after.contains(&ahead.channels.time) {
                true => kept.push(ahead),
                false => ahead.remove(textures),
            }
        }
        for time in &after {
            if kept.iter().all(|ahead| ahead.channels.time != *time) {
                kept.push(TimeAhead { channels: Channels::new(*time, facts), bricks: None });
            }
        }
        kept.sort_by_key(|ahead| after.iter().position(|time| *time == ahead.channels.time));
        self.times = kept;
    }

    /// Views of this number are seen: what others wanted is not prefetched any more.
    pub(super) fn keep_view(&mut self, textures: &mut Textures, view: u64) {
        self.wanted.take_if(|(of, ..)| *of != view);
        for ahead in &mut self.times {
            if let Some(bricks) = ahead.bricks.take_if(|bricks| bricks.view != view) {
                bricks.release(textures);
            }
        }
    }

    /// All that the views of this number want of a time is known and there: the same is wanted of others.
    pub(super) fn note_wanted(
        &mut self,
        textures: &Textures,
        view: u64,
        (current, look): (&Channels, &VolumeLook),
    ) {
        if self.wanted.as_ref().is_some_and(|(of, at, _)| (*of, *at) == (view, current.time)) {
            return;
        }
        let numbers: Vec<_> = current
            .parts(look)
            .filter_map(|(part, texture)| {
                let texture = textures.texture(texture).ok()?;
                Some((texture.number(), part, texture.description().geometry.dims()))
            })
            .collect();
        let place = |wanted: &WantedPage| {
            let of = numbers.iter().find(|(number, ..)| *number == wanted.page.texture())?;
            Some((of.1, wanted.page.pos(of.2), wanted.pixels))
        };
        let wanted = textures.inspect().wanted().pages.iter().filter_map(place).collect();
        self.wanted = Some((view, current.time, wanted));
    }

    /// Asks for the bricks of times that are read, as the views of this number want them.
    pub(super) fn prefetch(&mut self, textures: &mut Textures, view: u64, look: &VolumeLook) {
        let Some((_, _, wanted)) = self.wanted.as_ref().filter(|(of, ..)| *of == view) else { return };
        for (nth, ahead) in self.times.iter_mut().enumerate() {
            if ahead.bricks.is_some() || !ahead.channels.is_complete(look) {
                continue;
            }
            let parts: Vec<(Part, TextureId)> = ahead.channels.parts(look).collect();
            let page = |(part, pos, pixels): &(Part, PagePos, u32)| {
                let (_, texture) = parts.iter().find(|(other, _)| other == part)?;
                let texture = textures.texture(*texture).ok()?;
                let dims = texture.description().geometry.dims();
                let page = PageId::new(texture.number(), dims, *pos).ok()?;
                Some(WantedPage { page, pixels: *pixels, eighth: 0 })
            };
            let pages: Vec<WantedPage> = wanted.iter().filter_map(page).collect();
            let feedback = Feedback::of_pages(textures.inspect().frame(), pages);
            // The nearest time first.
            let urgency = Urgency { priority: -(nth as i32), ..Urgency::default() };
            let ticket = textures.ahead().prefetch_view(&feedback, urgency).ok();
            let pages = feedback.pages.iter().map(|wanted| wanted.page).collect();
            ahead.bricks = Some(BricksAhead { view, pages, ticket });
        }
    }

    /// Returns true if bricks are on their way.
    pub(super) fn is_loading(&self) -> bool {
        let tickets = self.times.iter().filter_map(|ahead| ahead.bricks.as_ref()?.ticket.as_ref());
        tickets.into_iter().any(Ticket::is_open)
    }
}

impl TimeAhead {
    fn remove(self, textures: &mut Textures) {
        self.bricks.iter().for_each(|bricks| bricks.release(textures));
        self.channels.remove(textures);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_come_the_way_that_time_goes() {
        let mut ahead = TimesAhead::default();
        assert_eq!(ahead.after(3, false, 9), [0; 0], "nobody has gone on in time");
        assert_eq!(ahead.after(7, true, 9), [8, 0], "played round and round");
        assert_eq!(ahead.after(0, true, 2), [1]);
        assert_eq!(ahead.after(0, true, 1), [0; 0]);
        ahead.turn(3, 4, 9);
        assert_eq!((ahead.after(4, false, 9), ahead.after(8, false, 9)), (vec![5], vec![]));
        ahead.turn(4, 3, 9);
        assert_eq!((ahead.after(3, false, 9), ahead.after(0, false, 9)), (vec![2], vec![]));
        ahead.turn(3, 7, 9);
        assert_eq!(ahead.after(7, false, 9), [8]);
        ahead.turn(8, 0, 9);
        assert_eq!(ahead.after(0, false, 9), [1], "from the last to the first");
    }
}
