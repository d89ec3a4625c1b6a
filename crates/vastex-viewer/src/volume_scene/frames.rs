//! How a frame of a volume comes about: what is wanted, which time is seen, and what is drawn.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use vastex::Event;

use super::channels::Channels;
use super::look::{VolumeLook, VolumePane};
use super::picture::PanePicture;
use super::sight::{PaneRect, PaneSight};
use super::{Coming, UnderWay, VolumeScene};
use crate::stage::StageScene;
use crate::volume::VolumeError;

/// Between two pictures of a view that stays, while its bricks come.
const EVERY: Duration = Duration::from_millis(200);
/// How long an old time stays while bricks of the new one are missing, at most.
const LONGEST_WAIT: Duration = Duration::from_secs(20);
/// How long a device is given to draw what views want.
const LONGEST_ANSWER: Duration = Duration::from_secs(1);
/// Between two times that are played, at least.
const PLAY_EVERY: Duration = Duration::from_millis(100);
/// What a clock tells that has told nothing.
const NEVER: u64 = u64::MAX;

/// Which pictures a frame draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumePictures {
    /// None: what is seen is only asked for.
    None,
    /// Pictures that are due, in parts that take no longer than a frame may.
    Parts,
    /// All that are not drawn yet, whole, however long that takes.
    Whole,
}

impl VolumeScene {
    /// Asks for what is missing and draws what is due, for pictures that fill an area of so many pixels.
    /// Submits by itself and never waits, unless the textures go in lock-step. Returns true if anything was
    /// drawn that is to be painted. Fails where the device is lost.
    pub fn frame(&mut self, area: [u32; 2], pictures: VolumePictures) -> Result<bool, VolumeError> {
        let now = (self.clock)();
        if std::mem::replace(&mut self.area, area) != area {
            self.quiet = 0;
        }
        self.draws_parts = pictures == VolumePictures::Parts;
        self.look.tidy();
        self.follow_labels();
        self.look.time = self.look.time.min(self.facts.times.saturating_sub(1));
        self.play_on(now);
        self.follow_time(now);
        let shown = (&self.look, &self.facts);
        self.current.show(&self.gpu, &mut self.textures, shown, None)?;
        if let Some(coming) = &mut self.next
            && coming.channels.is_complete(&self.look)
        {
            coming.channels.show(&self.gpu, &mut self.textures, shown, self.current.renderer())?;
        }
        self.note_look()?;
        // No more is asked of a slow device than it answers.
        match pictures == VolumePictures::Parts && self.is_asking_still(now) {
            true => {
                // With nothing to do the device says what it has done.
                self.gpu.queue.submit([]);
                self.textures.inspect().check_device()?;
            }
            false => {
                self.want(now)?;
                let is_of_ahead = self.ahead.is_loading() && self.has_all();
                self.textures.update()?;
                self.hear_events(is_of_ahead);
            }
        }
        self.take_over(now);
        self.look_ahead();
        match pictures {
            VolumePictures::None => Ok(false),
            pictures => self.draw(now, pictures == VolumePictures::Whole),
        }
    }

    /// The number of a selected label says nothing of other labels than those that it was selected of, unless
    /// it was chosen with them.
    fn follow_labels(&mut self) {
        let Some(nth) = self.look.labels.shown else { return };
        let before = self.looked.as_ref().and_then(|look| look.labels.selected);
        if self.hands.note_labels(nth) != nth && self.look.labels.selected == before {
            self.look.labels.selected = None;
        }
    }

    /// Returns true if what views want has yet to be drawn. A device that answers nothing is asked again.
    fn is_asking_still(&self, now: Duration) -> bool {
        let is_out = |(at, done): &(Duration, Arc<AtomicBool>)| {
            !done.load(Ordering::Acquire) && now.saturating_sub(*at) < LONGEST_ANSWER
        };
        self.asking.as_ref().is_some_and(is_out)
    }

    /// What is seen is perhaps another than in the frame before.
    fn note_look(&mut self) -> Result<(), VolumeError> {
        let panes = self.panes();
        let view = |pane: &PaneRect| {
            let sight = PaneSight::of(&self.look, &self.facts.of, &panes, pane);
            (pane.pane, sight.view(1), pane.size)
        };
        let seen: Vec<_> = panes.iter().map(view).collect();
        let drawn = self.current.renderer().map(|renderer| renderer.desc().clone());
        if self.drawn != drawn {
            (self.drawn, self.look_number) = (drawn, self.look_number + 1);
            self.quiet = 0;
        }
        if self.seen != seen {
            if self.seen.iter().map(|seen| seen.0).ne(seen.iter().map(|seen| seen.0)) {
                self.cut_hidden()?;
            }
            self.seen = seen;
            self.view_number += 1;
            self.quiet = 0;
        }
        if self.looked.as_ref() != Some(&self.look) {
            let before = self.looked.replace(self.look.clone());
            let is_same = before.is_some_and(|look| VolumeLook { time: self.look.time, ..look } == self.look);
            self.view_number += u64::from(!is_same);
        }
        Ok(())
    }

    /// The next time, where times are played and the one before is seen.
    fn play_on(&mut self, now: Duration) {
        let is_seen = self.next.is_none() && self.look.time == self.current.time && self.pictures_are_seen();
        if self.is_playing && is_seen && now.saturating_sub(self.played_at) >= PLAY_EVERY {
            self.look.time = (self.look.time + 1) % self.facts.times.max(1);
            self.played_at = now;
        }
    }

    /// What comes next is of the time that is wanted: as far as it was read ahead, with that.
    fn follow_time(&mut self, now: Duration) {
        let wanted = self.look.time;
        if let Some(late) = self.next.take_if(|coming| coming.channels.time != wanted) {
            late.bricks.iter().for_each(|bricks| bricks.release(&mut self.textures));
            late.channels.remove(&mut self.textures);
        }
        if wanted != self.current.time && self.next.is_none() {
            self.ahead.turn(self.current.time, wanted, self.facts.times);
            let ahead = self.ahead.take(wanted);
            let (channels, bricks) = ahead.unwrap_or_else(|| (Channels::new(wanted, &self.facts), None));
            self.next = Some(Coming { channels, begun: now, bricks });
            self.quiet = 0;
        }
    }

    /// What comes next is shown once it is there at the level that is wanted, or nothing was seen before; at
    /// once where all of its bricks were prefetched.
    fn take_over(&mut self, now: Duration) {
        let Some(coming) = &self.next else { return };
        let nothing_seen = self.current.renderer().is_none();
        let pager = self.textures.stats().pager;
        let is_there = self.is_quiet() && pager.missing == 0;
        let is_late = now.saturating_sub(coming.begun) >= LONGEST_WAIT;
        let is_prefetched = || {
            coming.bricks.as_ref().is_some_and(|bricks| bricks.are_there(self.view_number, &self.textures))
        };
        if coming.channels.is_complete(&self.look)
            && (nothing_seen || is_there || is_late || is_prefetched())
            && let Some(coming) = self.next.take()
        {
            coming.bricks.iter().for_each(|bricks| bricks.release(&mut self.textures));
            if is_there {
                let shown = (&coming.channels, &self.look);
                self.ahead.note_wanted(&self.textures, self.view_number, shown);
            }
            std::mem::replace(&mut self.current, coming.channels).remove(&mut self.textures);
            (self.quiet, self.look_number) = (0, self.look_number + 1);
        }
    }

    /// Has times read that come after the one that is seen, and bricks of them prefetched, where nothing else
    /// is to be done. In a pool that is too small for one time there is no room for another.
    fn look_ahead(&mut self) {
        self.ahead.keep_view(&mut self.textures, self.view_number);
        if self.next.is_some() || self.look.time != self.current.time {
            return;
        }
        let seen = (self.current.time, self.is_playing);
        self.ahead.follow(&mut self.textures, seen, &self.facts);
        let fits = self.textures.stats().pager.bias_eighths == 0;
        if fits && self.has_all() && self.ahead.times().next().is_some() {
            self.ahead.note_wanted(&self.textures, self.view_number, (&self.current, &self.look));
        }
        if fits {
            self.ahead.prefetch(&mut self.textures, self.view_number, &self.look);
        }
    }

    /// What is not seen any more wants nothing.
    fn cut_hidden(&mut self) -> Result<(), VolumeError> {
        let panes = self.panes();
        for pane in VolumePane::ALL {
            if panes.iter().all(|seen| seen.pane != pane) {
                self.textures.view_mut(self.views[pane.number()])?.cut();
            }
        }
        Ok(())
    }

    /// Has every picture say what it wants, until all of that is there; those that have it and rest need not
    /// say so while others have not.
    fn want(&mut self, now: Duration) -> Result<(), VolumeError> {
        if self.has_all() && self.next.is_none() {
            return Ok(());
        }
        let next = self.next.as_ref().and_then(|coming| coming.channels.drawn_by());
        let Some((of, renderer)) = next.or(self.current.drawn_by()) else { return Ok(()) };
        let panes = self.panes();
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let mut drawn = 0;
        for pane in &panes {
            let (nth, view) = (pane.pane.number(), self.views[pane.pane.number()]);
            let sight = PaneSight::of(&self.look, &self.facts.of, &panes, pane);
            let number = self.textures.view(view)?.number();
            // Of another time's renderer it may be bound by another layout.
            self.cameras[nth].take_if(|(other, _)| *other != of);
            let (_, camera) = self.cameras[nth].get_or_insert_with(|| (of, renderer.new_camera(number)));
            renderer.place(camera, &self.gpu.queue, &self.textures, &sight.view(1), pane.size);
            let camera = &*camera;
            let mut seen = self.textures.view_mut(view)?;
            seen.set_bricks_of_a_ray(renderer.bricks_of_a_ray(camera));
            let rests = renderer.rests(camera);
            seen.set_resting(rests);
            let has_all = rests && self.textures.view(view)?.is_converged();
            // The pager waits for none that is not drawn.
            if has_all && !(drawn == 0 && std::ptr::eq(pane, &panes[panes.len() - 1])) {
                continue;
            }
            drawn += 1;
            self.textures.view_mut(view)?.feedback(&mut encoder, pane.size, |pass, groups| {
                if let Some(group) = groups.get(renderer.sampled()) {
                    renderer.draw_wanted(camera, pass, group);
                }
            })?;
        }
        self.gpu.queue.submit([encoder.finish()]);
        let done = Arc::new(AtomicBool::new(false));
        let told = done.clone();
        self.gpu.queue.on_submitted_work_done(move || told.store(true, Ordering::Release));
        self.asking = Some((now, done));
        Ok(())
    }

    /// Takes in what has come and what went wrong; perhaps only bricks of times ahead have come, of which
    /// nothing is seen.
    fn hear_events(&mut self, is_of_ahead: bool) {
        while let Some(event) = self.textures.poll_event() {
            if let Event::Failed { why, .. } = event {
                self.faults.push(format!("{why}; a coarser brick is shown instead"));
            }
        }
        let pager = self.textures.stats().pager;
        let come = pager.loaded + pager.evicted + pager.refreshed + pager.shared;
        if is_of_ahead && pager.missing == 0 {
            self.content.1 = come;
            return;
        }
        let is_quiet = come == self.content.1 && pager.missing == 0 && pager.in_flight == 0;
        self.quiet = if is_quiet { self.quiet.saturating_add(1) } else { 0 };
        if come != self.content.1 {
            self.content = (self.content.0 + 1, come);
        }
    }

    fn draw(&mut self, now: Duration, is_whole_asked: bool) -> Result<bool, VolumeError> {
        let before = self.painted;
        if let Some(under_way) = self.under_way.take() {
            let nanos = under_way.ended.load(Ordering::Acquire);
            if nanos == NEVER && !is_whole_asked {
                self.under_way = Some(UnderWay { was_waited_for: true, ..under_way });
                return Ok(false);
            }
            let took = Duration::from_nanos(nanos).saturating_sub(under_way.begun).as_secs_f64();
            let took = took / under_way.drawn.len().max(1) as f64;
            for (nth, was_small) in under_way.drawn {
                if let Some(picture) = self.pictures[nth].as_mut().filter(|_| nanos != NEVER) {
                    let seconds = took * if nth == 3 { 1.0 } else { 0.999 };
                    picture.took(seconds, was_small, under_way.was_waited_for);
                }
            }
            self.drawn_at = now;
        }
        let panes = self.panes();
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let (mut drawn, mut is_seen) = (Vec::new(), false);
        let may_go_on = !is_whole_asked && self.is_resting();
        for pane in &panes {
            let sight = PaneSight::of(&self.look, &self.facts.of, &panes, pane);
            let key = self.key(&sight);
            let (has_all, is_early) = (self.has_all(), now.saturating_sub(self.drawn_at) < EVERY);
            let nth = pane.pane.number();
            let Some((of, renderer)) = self.current.drawn_by() else {
                if let Some(picture) = &mut self.pictures[nth] {
                    picture.resize(&self.gpu, pane.size);
                    picture.clear(&mut encoder, key);
                    self.painted += 1;
                }
                continue;
            };
            let picture = self.pictures[nth].get_or_insert_with(|| {
                self.painted += 1;
                PanePicture::new(&self.gpu, (of, renderer.new_camera(0)), pane.size)
            });
            picture.see_through(of, || renderer.new_camera(0));
            let before = picture.seen().clone();
            picture.resize(&self.gpu, pane.size);
            // Where only bricks have come there is time.
            if is_early && !has_all && picture.is_of_view(&key) && !is_whole_asked {
                continue;
            }
            let with = (renderer, &self.textures);
            let was = picture.draw(&self.gpu, &mut encoder, with, (&sight, key), is_whole_asked);
            is_seen |= was.is_some();
            drawn.extend(was.map(|was_small| (nth, was_small)));
            if was.is_none() && may_go_on {
                let went_on = picture.go_on(&mut encoder, with, (&sight, key));
                is_seen |= went_on == Some(true);
                drawn.extend(went_on.map(|_| (nth, false)));
            }
            if *picture.seen() != before {
                self.painted += 1;
            }
        }
        self.gpu.queue.submit([encoder.finish()]);
        is_seen |= self.painted != before;
        if !drawn.is_empty() {
            let (ended, clock) = (Arc::new(AtomicU64::new(NEVER)), self.clock.clone());
            let told = ended.clone();
            self.gpu.queue.on_submitted_work_done(move || {
                told.store(u64::try_from(clock().as_nanos()).unwrap_or(NEVER - 1), Ordering::Release);
            });
            self.under_way = Some(UnderWay { begun: now, ended, drawn, was_waited_for: false });
        }
        Ok(is_seen)
    }
}
