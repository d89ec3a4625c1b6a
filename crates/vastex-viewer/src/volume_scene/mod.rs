//! A volume in a window, apart from any window: three slices and all of it beside each other, with one
//! crosshair and one time.
//!
//! A host hands [`VolumeScene`] input and asks it for frames; the scene has textures, cameras and pictures of
//! its own, and tells the host what it cannot do itself: open a channel at a time, and read the values at a
//! place ([`VolumeAsked`]). What is shown is a [`VolumeLook`], which panels change as they like.
//!
//! A frame never waits and never takes long: while something changes pictures are drawn small, then in parts
//! at their full size. Where nothing changes and everything is there, nothing is drawn.

mod ahead;
mod channels;
mod cut;
mod frames;
mod hands;
mod host;
mod look;
mod picture;
mod point;
mod portion;
mod sight;
mod still;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64};
use std::time::Duration;

use glam::DVec2;
use vastex::diagnostics::Stats;
use vastex::{Preparer, Settings, Textures, ViewId, ViewSettings};

use crate::gpu::Gpu;
use crate::input::InputEvent;
use crate::stage::Clock;
use crate::volume::{QUIET_FRAMES, VolumeCameraBinding, VolumeDesc, VolumeView};

use ahead::{BricksAhead, TimesAhead};
use channels::Channels;
pub use channels::LabelsPlace;
pub use frames::VolumePictures;
pub use hands::{VOLUME_CONTROLS, VolumeHands, VolumeHeard, VolumeRoom};
pub use host::VolumeAsked;
#[cfg(all(test, feature = "egui"))]
pub(crate) use look::tests::facts as facts_for_tests;
pub use look::{
    ChannelFacts, ChannelLook, ClipLook, LabelsLook, SliceTilt, VolumeFacts, VolumeLayout, VolumeLook,
    VolumeOrbit, VolumePane, cut_of,
};
pub use picture::PICTURE;
use picture::{Key, PanePicture};
use point::Purpose;
pub use point::{PointAnswer, PointAsked, PointPlace, PointValue, Points};
pub use sight::{PaneRect, PaneSight, pane_rects};

/// A volume in a window.
pub struct VolumeScene {
    gpu: Gpu,
    textures: Textures,
    facts: VolumeFacts,
    /// What is shown. May be changed at any time.
    pub look: VolumeLook,
    hands: VolumeHands,
    points: Points,
    /// The views of the panes, by their numbers, and what feedback sees through, with the renderer that each
    /// is of.
    views: [ViewId; 4],
    cameras: [Option<(u64, VolumeCameraBinding)>; 4],
    pictures: [Option<PanePicture>; 4],
    /// A number that changes with each other texture that is to be painted.
    painted: u64,
    /// What is drawn, and what comes after it, at another time.
    current: Channels,
    next: Option<Coming>,
    /// Times that will come after these.
    ahead: TimesAhead,
    area: [u32; 2],
    clock: Clock,
    /// What the last frame was told to show.
    looked: Option<VolumeLook>,
    /// What it drew: what of the volume, by a number that changes with it, and from where.
    drawn: Option<VolumeDesc>,
    look_number: u64,
    /// A number that changes with what views see and how it is shown, whatever the time.
    view_number: u64,
    seen: Vec<(VolumePane, VolumeView, [u32; 2])>,
    /// A number that changes with the bricks that there are, and what is counted of them.
    content: (u64, u64),
    /// Frames in which nothing new came or was seen.
    quiet: u64,
    /// When the last picture was finished, and when the last time was played.
    drawn_at: Duration,
    played_at: Duration,
    is_playing: bool,
    /// True if the last frame drew pictures in parts: only then means of several pictures are made.
    draws_parts: bool,
    /// What the device is drawing.
    under_way: Option<UnderWay>,
    /// What the device is asked of what views want: since when, and whether it has answered.
    asking: Option<(Duration, Arc<AtomicBool>)>,
    /// What was asked for since the host was told last, beside what is shown and places.
    wanted: Vec<VolumeAsked>,
    faults: Vec<String>,
}

/// A time that comes: since when it is wanted, and its bricks, if it was read ahead.
struct Coming {
    channels: Channels,
    begun: Duration,
    bricks: Option<BricksAhead>,
}

/// What the device is drawing.
struct UnderWay {
    begun: Duration,
    /// When it ended, in nanoseconds of the clock, as the device tells it.
    ended: Arc<AtomicU64>,
    /// The panes that it draws pictures of, each with true if that is the small one.
    drawn: Vec<(usize, bool)>,
    /// True if it was not done when it was looked at.
    was_waited_for: bool,
}

impl VolumeScene {
    /// A volume of which nothing is read yet, with textures of its own.
    pub fn new(
        gpu: &Gpu,
        facts: VolumeFacts,
        settings: Settings,
        clock: Clock,
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
            cameras: [const { None }; 4],
            pictures: [const { None }; 4],
            painted: 0,
            current,
            next: None,
            ahead: TimesAhead::default(),
            area: [1; 2],
            clock,
            looked: None,
            drawn: None,
            look_number: 0,
            view_number: 0,
            seen: Vec::new(),
            content: (0, 0),
            quiet: 0,
            drawn_at: Duration::ZERO,
            played_at: Duration::ZERO,
            is_playing: false,
            draws_parts: false,
            under_way: None,
            asking: None,
            wanted: Vec::new(),
            faults: Vec::new(),
            facts,
        })
    }

    /// The device that draws.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// What is known of the volume.
    pub fn facts(&self) -> &VolumeFacts {
        &self.facts
    }

    /// The textures of its channels, to be asked about themselves.
    pub fn textures(&self) -> &Textures {
        &self.textures
    }

    /// The textures of the scene's channels, to be changed: sizes and rules of pools, budgets.
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

    /// The time that is seen: the one chosen, or an earlier one until the chosen one has been read.
    pub fn seen_time(&self) -> u64 {
        self.current.time
    }

    /// Returns true if times are played.
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

    /// Where the pointer is in the area, in pixels; `None` if it is not over it.
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
            VolumeHeard::Click(pane, pixel) => self.ask_at(pane, pixel, Purpose::Click),
            VolumeHeard::Select(pane, pixel) => self.ask_at(pane, pixel, Purpose::Select),
            VolumeHeard::Play => self.play(!self.is_playing),
            VolumeHeard::UsualRanges => self.ask_ranges(self.look.shown().collect()),
            VolumeHeard::Taken if matches!(event, InputEvent::PointerMoved(_)) && !self.hands.is_held() => {
                match self.hands.pointed(&panes) {
                    Some((pane, pixel)) if pane.pane.axis().is_some() => {
                        self.ask_at(pane.pane, pixel, Purpose::Below);
                    }
                    _ => self.points.leave(),
                }
            }
            VolumeHeard::Taken if event == InputEvent::PointerLeft => self.points.leave(),
            _ => {}
        }
        heard
    }

    fn ask_at(&mut self, pane: VolumePane, pixel: DVec2, purpose: Purpose) {
        let panes = self.panes();
        let Some(rect) = panes.iter().find(|rect| rect.pane == pane) else { return };
        let sight = PaneSight::of(&self.look, &self.facts.of, &panes, rect);
        let [from, toward] = sight.ray(pixel);
        let place = match pane.axis() {
            Some(_) => PointPlace::At(from),
            None => PointPlace::Along { from, toward, pixel: sight.pixel() },
        };
        self.points.want(place, purpose);
    }

    /// So much time has passed since the last frame.
    pub fn pass_time(&mut self, time: Duration) {
        self.textures.set_frame_time(time.min(Duration::from_millis(250)));
    }

    /// What went wrong since the last call, each with the path of the file.
    pub fn take_faults(&mut self) -> Vec<String> {
        std::mem::take(&mut self.faults)
    }

    /// Returns true if the pictures stay as they are: everything that is seen is there and drawn.
    pub fn is_settled(&self) -> bool {
        let is_drawn = self.looked.as_ref() == Some(&self.look) && self.pictures_are_drawn();
        is_drawn && self.has_all() && self.next.is_none() && self.look.time == self.current.time
    }

    /// Returns true if a frame is due by itself.
    pub fn is_due(&self) -> bool {
        let is_played = self.is_playing || self.ahead.is_loading();
        !self.is_settled() || is_played || self.under_way.is_some() || self.goes_on()
    }

    /// Returns true if every brick that is seen was asked for, and is there or cannot be read.
    pub fn has_all(&self) -> bool {
        let waits = self.current.waits(&self.look);
        !waits && (self.current.renderer().is_none() || self.is_quiet())
    }

    /// Returns true if every pixel has found every brick that its ray meets.
    fn is_quiet(&self) -> bool {
        self.quiet >= QUIET_FRAMES && self.textures.inspect().is_converged()
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

    /// Returns true if pictures of what is to be seen are there, however old their bricks: enough to go on in
    /// time.
    fn pictures_are_seen(&self) -> bool {
        let panes = self.panes();
        panes.iter().all(|pane| {
            let key = self.key(&PaneSight::of(&self.look, &self.facts.of, &panes, pane));
            let picture = self.pictures[pane.pane.number()].as_ref();
            self.current.renderer().is_none() || picture.is_some_and(|picture| picture.is_of_view(&key))
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
        if let Some(coming) = &mut self.next {
            coming.channels.forget_device(&mut self.textures);
        }
        self.ahead.clear(&mut self.textures);
        (self.cameras, self.pictures) = ([const { None }; 4], [const { None }; 4]);
        self.asking = None;
        (self.under_way, self.looked, self.drawn, self.quiet) = (None, None, None, 0);
        self.painted += 1;
        Ok(())
    }
}
