//! A volume in a window, apart from any window: three slices and all of it beside each other, with one
//! crosshair and one time.
//!
//! A host hands [`VolumeScene`] input and asks it for frames; the scene has textures, cameras and pictures of
//! its own, and tells the host what it cannot do itself: open a channel at a time, and read the values at a
//! place ([`VolumeAsked`]). What is shown is a [`VolumeLook`], which panels change as they like.
//!
//! A frame never waits and never takes long: while something changes pictures are drawn small, then in parts
//! at their full size. Where nothing changes and everything is there, nothing is drawn.

mod channels;
mod frames;
mod hands;
mod look;
mod picture;
mod point;
mod sight;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64};
use std::time::Duration;

use glam::DVec2;
use vastex::diagnostics::Stats;
use vastex::{Prepared, Preparer, Region, Settings, Textures, ViewId, ViewSettings};

use crate::gpu::Gpu;
use crate::input::InputEvent;
use crate::volume::{VolumeCameraBinding, VolumeDesc, VolumeView, frames_to_ask};

use channels::Channels;
pub use channels::LabelsPlace;
pub use frames::VolumePictures;
pub use hands::{VOLUME_CONTROLS, VolumeHands, VolumeHeard, VolumeRoom};
#[cfg(all(test, feature = "egui"))]
pub(crate) use look::tests::facts as facts_for_tests;
pub use look::{
    ChannelFacts, ChannelLook, ClipLook, LabelsLook, VolumeFacts, VolumeLayout, VolumeLook, VolumeOrbit,
    VolumePane,
};
pub use picture::PICTURE;
use picture::{Key, PanePicture};
pub use point::{PointAsked, PointPlace, PointTold, PointValue, Points};
pub use sight::{PaneRect, PaneSight, pane_rects};

/// What time it is: how long ago the host began.
pub type VolumeClock = Arc<dyn Fn() -> Duration + Send + Sync>;

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
        /// Which of [`VolumeFacts::labels`].
        nth: usize,
        /// Which time, from 0.
        time: u64,
    },
    /// The values at a place, for [`VolumeScene::tell`].
    Point(PointAsked),
    /// The usual ranges of the channels that are shown, for [`VolumeScene::set_range`].
    Ranges(Vec<usize>),
}

/// A volume in a window.
pub struct VolumeScene {
    gpu: Gpu,
    textures: Textures,
    facts: VolumeFacts,
    /// What is shown. May be changed at any time.
    pub look: VolumeLook,
    hands: VolumeHands,
    points: Points,
    /// The views of the panes, by their numbers, and what feedback sees through.
    views: [ViewId; 4],
    cameras: Vec<Option<VolumeCameraBinding>>,
    pictures: [Option<PanePicture>; 4],
    /// A number that changes with each other texture that is to be painted.
    painted: u64,
    /// What is drawn, and what comes after it, at another time.
    current: Channels,
    next: Option<(Channels, Duration)>,
    area: [u32; 2],
    clock: VolumeClock,
    /// What the last frame was told to show.
    looked: Option<VolumeLook>,
    /// What it drew: what of the volume, by a number that changes with it, and from where.
    drawn: Option<VolumeDesc>,
    look_number: u64,
    seen: Vec<(VolumePane, VolumeView, [u32; 2])>,
    /// A number that changes with the bricks that there are, and what is counted of them.
    content: (u64, u64),
    /// Frames in which nothing new came or was seen.
    quiet: u64,
    /// When the last picture was finished, and when the last time was played.
    drawn_at: Duration,
    played_at: Duration,
    is_playing: bool,
    /// What the device is drawing.
    under_way: Option<UnderWay>,
    /// Which renderer the cameras are of.
    cameras_of: (u64, u64),
    /// What the device is asked of what views want: since when, and whether it has answered.
    asking: Option<(Duration, Arc<AtomicBool>)>,
    wants_ranges: bool,
    faults: Vec<String>,
}

/// What the device is drawing: when it began, when it ends, and of which panes, small or not.
type UnderWay = (Duration, Arc<AtomicU64>, Vec<(usize, bool)>);

impl VolumeScene {
    /// A volume of which nothing is read yet, with textures of its own.
    pub fn new(
        gpu: &Gpu,
        facts: VolumeFacts,
        settings: Settings,
        clock: VolumeClock,
    ) -> Result<VolumeScene, vastex::Error> {
        let mut textures = Textures::new(&gpu.device, &gpu.queue, settings)?;
        let mut views = [ViewId::MAIN; 4];
        for view in &mut views[..3] {
            *view = textures.add_view(ViewSettings::default())?;
        }
        let look = VolumeLook::first(&facts);
        let current = Channels::new(look.time, &facts);
        Ok(VolumeScene {
            gpu: gpu.clone(),
            textures,
            look,
            hands: VolumeHands::default(),
            points: Points::default(),
            views,
            cameras: (0..4).map(|_| None).collect(),
            pictures: [const { None }; 4],
            painted: 0,
            current,
            next: None,
            area: [1; 2],
            clock,
            looked: None,
            drawn: None,
            look_number: 0,
            seen: Vec::new(),
            content: (0, 0),
            quiet: 0,
            drawn_at: Duration::ZERO,
            played_at: Duration::ZERO,
            is_playing: false,
            under_way: None,
            cameras_of: (0, 0),
            asking: None,
            wants_ranges: false,
            faults: Vec::new(),
            facts,
        })
    }

    /// What is known of the volume.
    pub fn facts(&self) -> &VolumeFacts {
        &self.facts
    }

    /// The textures of its channels, to be asked about themselves.
    pub fn textures(&self) -> &Textures {
        &self.textures
    }

    /// The same, to be changed: sizes and rules of pools, budgets.
    pub fn textures_mut(&mut self) -> &mut Textures {
        self.quiet = 0;
        &mut self.textures
    }

    /// What reads a channel for [`VolumeScene::add`], on any thread.
    pub fn preparer(&self) -> Preparer {
        self.textures.preparer()
    }

    /// Where the pictures lie.
    pub fn panes(&self) -> Vec<PaneRect> {
        pane_rects(self.look.layout, self.area)
    }

    /// What a picture sees.
    pub fn sight(&self, pane: &PaneRect) -> PaneSight {
        PaneSight::of(&self.look, &self.facts.of, &self.panes(), pane)
    }

    /// The time that is seen: that of the look, or one before it until that one is there.
    pub fn seen_time(&self) -> u64 {
        self.current.time
    }

    /// Whether times are played.
    pub fn is_playing(&self) -> bool {
        self.is_playing
    }

    /// Plays the times one after the other, or ends that.
    pub fn play(&mut self, is_playing: bool) {
        self.is_playing = is_playing && self.facts.times > 1;
    }

    /// What is told of places, the newest.
    pub fn points(&self) -> &Points {
        &self.points
    }

    /// Whether the pointer is over a picture.
    pub fn pointer(&self) -> Option<DVec2> {
        self.hands.pointer()
    }

    /// What of all pixels is at its wanted level, 0 to 1, and how things stand.
    pub fn share_at_wanted(&self) -> (f64, Stats) {
        let stats = self.textures.stats().pager;
        (stats.share_at_wanted(), stats)
    }

    /// Hears what a person does, in pixels of the area of the pictures.
    pub fn on_event(&mut self, event: InputEvent) -> VolumeHeard {
        let panes = self.panes();
        let room = VolumeRoom { facts: &self.facts, panes: &panes };
        let heard = self.hands.on_event(event, &mut self.look, &room);
        match heard {
            VolumeHeard::Click(pane, pixel) => self.ask_at(pane, pixel, true),
            VolumeHeard::Play => self.play(!self.is_playing),
            VolumeHeard::UsualRanges => self.wants_ranges = true,
            VolumeHeard::Taken if matches!(event, InputEvent::PointerMoved(_)) && !self.hands.is_held() => {
                match self.hands.pointed(&panes) {
                    Some((pane, pixel)) if pane.pane.axis().is_some() => self.ask_at(pane.pane, pixel, false),
                    _ => self.points.leave(),
                }
            }
            VolumeHeard::Taken if event == InputEvent::PointerLeft => self.points.leave(),
            _ => {}
        }
        heard
    }

    fn ask_at(&mut self, pane: VolumePane, pixel: DVec2, is_click: bool) {
        let panes = self.panes();
        let Some(rect) = panes.iter().find(|rect| rect.pane == pane) else { return };
        let sight = PaneSight::of(&self.look, &self.facts.of, &panes, rect);
        let [from, toward] = sight.ray(pixel);
        let place = match pane.axis() {
            Some(_) => PointPlace::At(from),
            None => PointPlace::Along { from, toward, pixel: sight.pixel() },
        };
        self.points.want(place, is_click);
    }

    /// What is asked for since the last call: channels that are shown and not there, values at places.
    pub fn take_asked(&mut self) -> Vec<VolumeAsked> {
        let channel = |time: u64| move |channel| VolumeAsked::Channel { channel, time };
        let mut asked = Vec::new();
        if self.look.time == self.current.time {
            let time = self.current.time;
            asked.extend(self.current.ask(&self.look).into_iter().map(channel(time)));
            let labels = self.current.ask_labels(&self.look);
            asked.extend(labels.map(|nth| VolumeAsked::Labels { nth, time }));
        }
        if let Some((next, _)) = &mut self.next {
            let time = next.time;
            asked.extend(next.ask(&self.look).into_iter().map(channel(time)));
            asked.extend(next.ask_labels(&self.look).map(|nth| VolumeAsked::Labels { nth, time }));
        }
        asked.extend(self.points.ask(self.current.time).map(VolumeAsked::Point));
        if std::mem::take(&mut self.wants_ranges) {
            asked.push(VolumeAsked::Ranges(self.look.shown().collect()));
        }
        asked
    }

    /// A channel that was asked for was read. It is shown as it was chosen, in the usual range of stored
    /// values where none was. Fails where the textures refuse it; then it is left out.
    pub fn add(
        &mut self,
        (channel, time): (usize, u64),
        prepared: Prepared,
        usual: [f64; 2],
    ) -> Result<(), vastex::Error> {
        let channels = match &mut self.next {
            Some((next, _)) if next.time == time => next,
            _ if self.current.time == time => &mut self.current,
            // Another time is wanted by now.
            _ => return Ok(()),
        };
        let texture = match self.textures.add(prepared) {
            Ok(texture) => texture,
            Err(refused) => {
                channels.refuse(channel);
                return Err(refused.error);
            }
        };
        let before = channels.put(channel, texture);
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
        self.quiet = 0;
        Ok(())
    }

    /// Labels that were asked for were read. Fails where the textures refuse them; then they are left out.
    pub fn add_labels(
        &mut self,
        (nth, time): (usize, u64),
        prepared: Prepared,
        place: LabelsPlace,
    ) -> Result<(), vastex::Error> {
        let Some(channels) = self.channels_at(time) else { return Ok(()) };
        channels.refuse_labels(nth);
        let texture = self.textures.add(prepared).map_err(|refused| refused.error)?;
        if let Ok(mut named) = self.textures.texture_mut(texture) {
            named.set_name(self.facts.labels.get(nth).cloned().unwrap_or_default());
        }
        let before = self.channels_at(time).and_then(|channels| channels.put_labels(nth, texture, place));
        if let Some(before) = before {
            self.textures.remove(before);
        }
        self.quiet = 0;
        Ok(())
    }

    /// Labels that were asked for cannot be had.
    pub fn refuse_labels(&mut self, nth: usize, time: u64) {
        self.channels_at(time).iter_mut().for_each(|channels| channels.refuse_labels(nth));
        self.quiet = 0;
    }

    fn channels_at(&mut self, time: u64) -> Option<&mut Channels> {
        match &mut self.next {
            Some((next, _)) if next.time == time => Some(next),
            _ => Some(&mut self.current).filter(|current| current.time == time),
        }
    }

    /// A channel that was asked for cannot be had: the others are shown without it.
    pub fn refuse(&mut self, channel: usize, time: u64) {
        match &mut self.next {
            Some((next, _)) if next.time == time => next.refuse(channel),
            _ if self.current.time == time => self.current.refuse(channel),
            _ => {}
        }
        self.quiet = 0;
    }

    /// What a channel at a time was read from has changed in these regions: they are read again, and what is
    /// there of them stays until then.
    pub fn changed(&mut self, (channel, time): (usize, u64), regions: &[Region]) {
        let sets = [Some(&self.current), self.next.as_ref().map(|(next, _)| next)];
        let set = sets.into_iter().flatten().find(|set| set.time == time);
        let Some(texture) = set.and_then(|set| set.texture(channel)) else { return };
        if let Ok(mut texture) = self.textures.texture_mut(texture) {
            for region in regions {
                texture.invalidate(region);
            }
        }
        self.quiet = 0;
    }

    /// The stored values of a channel that are dark and bright from here on.
    pub fn set_range(&mut self, channel: usize, range: [f64; 2]) {
        if let Some(look) = self.look.channels.get_mut(channel) {
            look.range = Some(range);
        }
    }

    /// What lies at a place that was asked for. After a click in 3-D the crosshair goes there.
    pub fn tell(&mut self, told: PointTold) {
        if let Some(place) = self.points.tell(told) {
            self.look.put_cross(&self.facts.of, place);
        }
    }

    /// What lies at a place that was asked for cannot be found out.
    pub fn tell_nothing(&mut self, number: u64) {
        self.points.give_up(number);
    }

    /// Whether the host is to ask [`VolumeScene::take_asked`], though nothing else is due.
    pub fn is_asking(&self) -> bool {
        self.points.waits() || self.wants_ranges
    }

    /// So much time has passed since the last frame.
    pub fn pass_time(&mut self, time: Duration) {
        self.textures.set_frame_time(time.min(Duration::from_millis(250)));
    }

    /// What went wrong since the last call, with the path of what it was.
    pub fn take_faults(&mut self) -> Vec<String> {
        std::mem::take(&mut self.faults)
    }

    /// Whether the pictures stay as they are: everything that is seen is there and drawn.
    pub fn is_settled(&self) -> bool {
        let is_drawn = self.looked.as_ref() == Some(&self.look) && self.pictures_are_drawn();
        is_drawn && self.has_all() && self.next.is_none() && self.look.time == self.current.time
    }

    /// Whether a frame is due by itself.
    pub fn is_due(&self) -> bool {
        !self.is_settled() || self.is_playing || self.under_way.is_some()
    }

    /// Whether every brick that is seen was asked for, and is there or cannot be had.
    pub fn has_all(&self) -> bool {
        let waits = self.current.waits(&self.look);
        !waits && (self.current.renderer().is_none() || self.quiet >= self.quiet_frames())
    }

    /// Frames after which every pixel has asked for every brick that its ray meets.
    fn quiet_frames(&self) -> u64 {
        let Some(renderer) = self.current.renderer() else { return 0 };
        let panes = self.panes();
        let bricks = panes.iter().map(|pane| {
            let view = PaneSight::of(&self.look, &self.facts.of, &panes, pane).view(1);
            renderer.desc().bricks_of_a_ray(&view, self.facts.brick, pane.size)
        });
        frames_to_ask(bricks.max().unwrap_or(1)) + 4
    }

    fn key(&self, sight: &PaneSight) -> Key {
        Key { view: sight.view(1), look: self.look_number, content: self.content.0 }
    }

    fn pictures_are_drawn(&self) -> bool {
        let panes = self.panes();
        panes.iter().all(|pane| {
            let key = self.key(&PaneSight::of(&self.look, &self.facts.of, &panes, pane));
            let picture = self.pictures[pane.pane.number()].as_ref();
            self.current.renderer().is_none() || picture.is_some_and(|picture| picture.is_of(&key))
        })
    }

    /// The pictures that are to be painted, each over the whole of its pane; those that are not there yet are
    /// left out.
    pub fn pictures(&self) -> Vec<(PaneRect, wgpu::TextureView)> {
        let panes = self.panes().into_iter();
        let seen = panes.filter_map(|pane| {
            let picture = self.pictures[pane.pane.number()].as_ref()?;
            Some((pane, picture.seen().create_view(&Default::default())))
        });
        seen.collect()
    }

    /// A number: where it changes, [`VolumeScene::pictures`] gives other textures.
    pub fn painted(&self) -> u64 {
        self.painted
    }

    /// Goes on with another device after this one's was lost. What was read stays.
    pub fn restore(&mut self, gpu: &Gpu) -> Result<(), vastex::Error> {
        self.textures.memory().restore(&gpu.device, &gpu.queue)?;
        self.gpu = gpu.clone();
        self.current.forget_device(&mut self.textures);
        if let Some((next, _)) = &mut self.next {
            next.forget_device(&mut self.textures);
        }
        self.cameras.iter_mut().for_each(|camera| *camera = None);
        (self.pictures, self.asking) = ([const { None }; 4], None);
        (self.under_way, self.looked, self.drawn, self.quiet) = (None, None, None, 0);
        self.painted += 1;
        Ok(())
    }
}
