//! What a scene asks of its host, and what the host brings: channels and labels at times, values at places.

use glam::DVec3;
use vastex::{Prepared, Region, TextureId};

use super::channels::{Channels, LabelsPlace};
use super::point::{PointAnswer, PointAsked};
use super::{VolumeLook, VolumeScene};

/// What a scene needs of its host.
#[derive(Clone, Debug, PartialEq)]
pub enum VolumeAsked {
    /// A channel at a time, for [`VolumeScene::add`].
    Channel {
        /// Which channel, from 0.
        channel: usize,
        /// Which time, from 0.
        time: u64,
    },
    /// Labels beside the channels at a time, for [`VolumeScene::add_labels`].
    Labels {
        /// Which of [`super::VolumeFacts::labels`].
        nth: usize,
        /// Which time, from 0.
        time: u64,
    },
    /// The values at a place, for [`VolumeScene::report`].
    Point(PointAsked),
    /// The usual ranges of these channels at the time that is seen, for [`VolumeScene::set_range`].
    Ranges(Vec<usize>),
    /// A place that a label lies at, for [`VolumeScene::show_label`].
    Label {
        /// The number of the label.
        label: i128,
        /// Which of [`super::VolumeFacts::labels`].
        nth: usize,
        /// Which time, from 0.
        time: u64,
    },
}

/// What is shown of a set of channels and not asked for yet.
fn asked_of(channels: &mut Channels, look: &VolumeLook) -> impl Iterator<Item = VolumeAsked> + use<> {
    let time = channels.time;
    let labels = channels.ask_labels(look).map(|nth| VolumeAsked::Labels { nth, time });
    let channels = channels.ask(look).into_iter();
    channels.map(move |channel| VolumeAsked::Channel { channel, time }).chain(labels)
}

impl VolumeScene {
    /// What is asked for since the last call: channels that are shown and not there, values at places. What
    /// is seen comes before what will be.
    pub fn take_asked(&mut self) -> Vec<VolumeAsked> {
        let mut asked = Vec::new();
        if self.look.time == self.current.time {
            asked.extend(asked_of(&mut self.current, &self.look));
        }
        if let Some(coming) = &mut self.next {
            asked.extend(asked_of(&mut coming.channels, &self.look));
        }
        // What is seen has the readers to itself.
        if self.next.is_none() && !self.current.waits(&self.look) {
            let look = &self.look;
            asked.extend(self.ahead.channels().flat_map(|channels| asked_of(channels, look)));
        }
        let labels = self.look.labels.shown;
        asked.extend(self.points.ask(self.current.time, labels).map(VolumeAsked::Point));
        asked.append(&mut self.wanted);
        asked
    }

    /// Has the host find the usual ranges of channels.
    pub fn ask_ranges(&mut self, channels: Vec<usize>) {
        self.ask_host(VolumeAsked::Ranges(channels));
    }

    /// Has the host find where a label of a number lies, of the labels that are shown, at the time that is
    /// seen. Asks for nothing where none are shown.
    pub fn ask_label(&mut self, label: i128) {
        let Some(nth) = self.look.labels.shown else { return };
        self.ask_host(VolumeAsked::Label { label, nth, time: self.seen_time() });
    }

    fn ask_host(&mut self, wanted: VolumeAsked) {
        if !self.wanted.contains(&wanted) {
            self.wanted.push(wanted);
        }
    }

    /// The times of which anything is kept: the one that is seen, the one that comes, and those that are read
    /// ahead. A host need read nothing of others any more.
    pub fn times_kept(&self) -> Vec<u64> {
        let coming = self.next.iter().map(|coming| coming.channels.time);
        [self.current.time, self.look.time].into_iter().chain(coming).chain(self.ahead.times()).collect()
    }

    /// Times that are not seen yet and will be without a wait: all that the views want of them is there.
    pub fn times_ready(&self) -> Vec<u64> {
        self.ahead.ready(self.view_number, &self.textures)
    }

    /// Adds a channel that was asked for and has been read. It is shown as chosen, or else in its usual range
    /// of stored values. Returns the channel's texture; `None` if its time is not wanted any more. Fails if
    /// the textures refuse it; then it is left out.
    pub fn add(
        &mut self,
        (channel, time): (usize, u64),
        prepared: Prepared,
        usual: [f64; 2],
    ) -> Result<Option<TextureId>, vastex::Error> {
        if self.channels_at(time).is_none() {
            return Ok(None);
        }
        let texture = match self.textures.add(prepared) {
            Ok(texture) => texture,
            Err(refused) => {
                self.refuse(channel, time);
                return Err(refused.error);
            }
        };
        let before = self.channels_at(time).and_then(|channels| channels.put(channel, texture));
        if let Some(before) = before {
            self.textures.remove(before);
        }
        if let Ok(mut texture) = self.textures.texture_mut(texture) {
            texture.set_name(self.facts.channel_name(channel));
        }
        if let Some(look) = self.look.channels.get_mut(channel)
            && look.range.is_none()
        {
            look.range = Some(usual);
        }
        self.note_change_of(time);
        Ok(Some(texture))
    }

    /// Labels that were asked for were read. Gives back the texture that they are; `None` where that time is
    /// not wanted any more. Fails where the textures refuse them; then they are left out.
    pub fn add_labels(
        &mut self,
        (nth, time): (usize, u64),
        prepared: Prepared,
        place: LabelsPlace,
    ) -> Result<Option<TextureId>, vastex::Error> {
        let Some(channels) = self.channels_at(time) else { return Ok(None) };
        channels.refuse_labels(nth);
        let texture = self.textures.add(prepared).map_err(|refused| refused.error)?;
        if let Ok(mut named) = self.textures.texture_mut(texture) {
            named.set_name(self.facts.labels.get(nth).cloned().unwrap_or_default());
        }
        let before = self.channels_at(time).and_then(|channels| channels.put_labels(nth, texture, place));
        if let Some(before) = before {
            self.textures.remove(before);
        }
        self.note_change_of(time);
        Ok(Some(texture))
    }

    /// Labels that were asked for cannot be read.
    pub fn refuse_labels(&mut self, nth: usize, time: u64) {
        self.channels_at(time).iter_mut().for_each(|channels| channels.refuse_labels(nth));
        self.note_change_of(time);
    }

    /// A channel that was asked for cannot be read: the others are shown without it.
    pub fn refuse(&mut self, channel: usize, time: u64) {
        self.channels_at(time).iter_mut().for_each(|channels| channels.refuse(channel));
        self.note_change_of(time);
    }

    /// A channel, or labels, that were asked for could not be read or added since the device was lost: they
    /// are asked for again.
    pub fn ask_again(&mut self, asked: &VolumeAsked) {
        match *asked {
            VolumeAsked::Channel { channel, time } => {
                self.channels_at(time).iter_mut().for_each(|channels| channels.ask_again(channel));
                self.note_change_of(time);
            }
            VolumeAsked::Labels { nth, time } => {
                self.channels_at(time).iter_mut().for_each(|channels| channels.ask_labels_again(nth));
                self.note_change_of(time);
            }
            _ => {}
        }
    }

    fn channels_at(&mut self, time: u64) -> Option<&mut Channels> {
        match &mut self.next {
            Some(coming) if coming.channels.time == time => Some(&mut coming.channels),
            _ if self.current.time == time => Some(&mut self.current),
            _ => self.ahead.channels_at(time),
        }
    }

    /// What there is of a time has changed; of a time ahead nothing is seen.
    fn note_change_of(&mut self, time: u64) {
        let is_ahead = self.ahead.times().any(|ahead| ahead == time);
        if !is_ahead {
            self.quiet = 0;
        }
    }

    /// Says that parts of what is seen will change soon, by themselves ([`VolumeScene::changed`]): until they
    /// have, what is there is not all of it.
    pub fn expect_changes(&mut self, are_to_come: bool) {
        if are_to_come {
            self.quiet = 0;
        }
    }

    /// Says that the sources of these textures have changed in these regions: they are read again, and the
    /// old bricks stay until then.
    pub fn changed(&mut self, changes: &[(TextureId, Region)]) {
        for (texture, region) in changes {
            // Of a time that is not kept any more there is none.
            if let Ok(mut texture) = self.textures.texture_mut(*texture) {
                texture.invalidate(region);
                self.quiet = 0;
            }
        }
    }

    /// The stored values of a channel that are dark and bright from here on.
    pub fn set_range(&mut self, channel: usize, range: [f64; 2]) {
        if let Some(look) = self.look.channels.get_mut(channel) {
            look.range = Some(range);
        }
    }

    /// A label that was asked for lies at a place, or nowhere: the crosshair and the middle of 3-D go there,
    /// unless other labels are shown by now. Returns false if somebody is to be told that there is no such
    /// label.
    pub fn show_label(&mut self, nth: usize, place: Option<DVec3>) -> bool {
        if self.look.labels.shown != Some(nth) {
            return true;
        }
        let Some(place) = place else { return false };
        self.look.put_cross(&self.facts.of, place);
        self.look.centre = self.look.cross;
        true
    }

    /// What lies at a place that was asked for. After a click in 3-D the crosshair goes there; the label of a
    /// click is selected, or none where there is none, unless other labels are shown by now.
    pub fn report(&mut self, answer: PointAnswer) {
        let heard = self.points.report(answer);
        if let Some(place) = heard.cross {
            self.look.put_cross(&self.facts.of, place);
        }
        if let Some((of, label)) = heard.label
            && of == self.look.labels.shown
        {
            self.look.labels.selected = label;
        }
    }

    /// What lies at a place that was asked for cannot be found out.
    pub fn report_nothing(&mut self, number: u64) {
        self.points.give_up(number);
    }

    /// Returns true if the host is to ask [`VolumeScene::take_asked`], though nothing else is due.
    pub fn is_asking(&self) -> bool {
        self.points.waits() || !self.wanted.is_empty()
    }
}
