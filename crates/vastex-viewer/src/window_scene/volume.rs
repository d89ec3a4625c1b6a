//! A volume in the place of surfaces: when a frame of it is due, its title, and what the host has read for
//! it.

use std::ffi::OsString;
use std::sync::Arc;
use std::time::Duration;

use egui::TextureId;
use glam::DVec2;
use vastex::Settings;
use vastex::diagnostics::FrameStats;

use crate::beside::{Beside, CUT, TILES, Tuned, VOLUME, Wake};
use crate::gpu::Gpu;
use crate::hud::HudChange;
use crate::input::InputEvent;
use crate::panels::{PanelPainter, VolumePanel, VolumeValues, ray_cut_text};
use crate::surface_scene::{PictureFormat, PictureFormats};
use crate::title::TitleParts;
use crate::view_text::{VolumeFlight, VolumeViewError, VolumeViewText};
use crate::volume::VolumeError;
use crate::volume_scene::{
    PointAnswer, VolumeFacts, VolumeHeard, VolumeLook, VolumePane, VolumePictures, VolumeScene,
};

/// Between two frames that are shown while bricks are asked for and nothing else changes, and between two
/// that are not shown.
const EVERY: Duration = Duration::from_millis(250);
const REST: Duration = Duration::from_millis(2);

/// A volume that is to be shown.
pub struct VolumeToShow {
    /// Name of the volume, for people.
    pub name: String,
    /// What is known of the volume.
    pub facts: VolumeFacts,
    /// How the volume is shown at first.
    pub look: VolumeLook,
    /// The settings of the textures that are made for it, but for what a person chose of budgets.
    pub settings: Settings,
    /// What the volume says of itself: a name and a value each.
    pub rows: Arc<[(String, String)]>,
    /// What else the volume's file can be opened as, each with its path.
    pub images: Vec<(String, OsString)>,
}

/// A volume as a window shows it.
pub struct ShownVolume {
    pub(super) name: String,
    /// The volume and its pictures, apart from what stands beside them. A frame is due for what is changed of
    /// its look; for what else a host changes by this that lies over the pictures, or in the panels, it calls
    /// [`ShownVolume::refresh`].
    pub scene: VolumeScene,
    pub(super) panel: VolumePanel,
    pub(super) rows: Arc<[(String, String)]>,
    pub(super) images: Vec<(String, OsString)>,
    /// Of each channel that was read, which values it has at the time that was read first.
    pub(super) values: Vec<Option<VolumeValues>>,
    /// What the pictures are known by to what draws the panels, and of which pictures and of whom.
    pub(super) names: Vec<(VolumePane, TextureId)>,
    of: Option<(u64, u64)>,
    format: PictureFormat,
    /// Width and height of the window's pictures.
    size: [u32; 2],
    /// Where the pictures of the volume lie in them, in pixels: the corner and the size.
    pub(super) area: ([f64; 2], [u32; 2]),
    /// True if what lies over the pictures is another than in the last frame.
    pub(super) is_stale: bool,
    /// When a frame was shown last, of which size, and whether the last one was not, since nothing of it
    /// would have been another.
    shown: Option<(Duration, [u32; 2])>,
    rests: bool,
    /// True if a path moves it.
    is_led: bool,
    /// True if the host makes levels, of which it is to be asked now and then.
    is_being_made: bool,
    /// What was said of rays that are cut, while they are, and how often notes had been forgotten then.
    cut: (Option<String>, u64),
    /// Why the last frame could draw nothing: each one fails alike until another thing is shown.
    fault: Option<String>,
}

impl ShownVolume {
    /// A volume of which nothing is read yet, in pictures of a window of so many pixels, of these formats.
    /// What stands beside it knows the clock, and what a person chose of budgets.
    pub fn new(
        (gpu, beside): (&Gpu, &Beside),
        shown: VolumeToShow,
        (formats, size): (&PictureFormats, [u32; 2]),
    ) -> Result<ShownVolume, vastex::Error> {
        let VolumeToShow { name, facts, look, settings, rows, images } = shown;
        let settings = beside.chosen.budgeted_for_volume(settings);
        let mut scene = VolumeScene::new(gpu, facts, settings, beside.clock())?;
        scene.look = look;
        Ok(ShownVolume {
            name,
            scene,
            panel: VolumePanel::default(),
            rows,
            images,
            values: Vec::new(),
            names: Vec::new(),
            of: None,
            format: format_of(formats),
            size,
            area: ([0.0; 2], size),
            is_stale: true,
            shown: None,
            rests: false,
            is_led: false,
            is_being_made: false,
            cut: (None, beside.times_forgotten()),
            fault: None,
        })
    }

    /// Goes on with another device, whose pictures of the window have these formats.
    pub fn restore(&mut self, gpu: &Gpu, formats: &PictureFormats) -> Result<(), vastex::Error> {
        self.scene.restore(gpu)?;
        (self.of, self.format) = (None, format_of(formats));
        self.is_stale = true;
        Ok(())
    }

    /// Name of the volume, for people.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What the pictures of the window have to be.
    pub(super) fn format(&self) -> &PictureFormat {
        &self.format
    }

    /// The window's pictures have another size.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.is_stale |= size != self.size;
        self.size = size;
    }

    /// What lies over the pictures is another: a frame is due.
    pub fn refresh(&mut self) {
        self.is_stale = true;
    }

    /// What is shown as a text.
    pub fn view_text(&self) -> VolumeViewText {
        VolumeViewText::of(&self.scene.look, self.scene.facts())
    }

    /// Shows what a view says. Says what is in its way, and changes nothing then.
    pub fn show_view(&mut self, view: &VolumeViewText) -> Result<(), VolumeViewError> {
        let facts = self.scene.facts().clone();
        view.change(&mut self.scene.look, &facts)?;
        self.is_stale = true;
        Ok(())
    }

    /// Has a path move the volume before its next frame.
    pub fn lead(&mut self, now: Duration, flight: &mut VolumeFlight) {
        let before = self.scene.look.clone();
        flight.lead(now, &mut self.scene);
        self.is_stale |= self.scene.look != before;
        self.is_led = flight.is_playing();
    }

    /// Which values a channel has, for the panel.
    pub fn set_values(&mut self, channel: usize, values: Option<VolumeValues>) {
        self.values.resize(self.values.len().max(channel + 1), None);
        self.values[channel] = values;
        self.is_stale = true;
    }

    /// What lies at a place that was asked for ([`VolumeScene::report`]): it is seen in the next frame.
    pub fn report(&mut self, answer: PointAnswer) {
        self.scene.report(answer);
        self.is_stale = true;
    }

    /// True from here on if the host makes levels of the volume: frames are due in which it says what has
    /// changed.
    pub fn set_being_made(&mut self, is_being_made: bool) {
        self.is_being_made = is_being_made;
    }

    /// Hears keys and the pointer, in pixels of the window, before whatever else hears them. Returns true if
    /// that was all there is to it; [`ShownVolume::is_stale`] says if a frame is due for it.
    pub fn on_event(&mut self, beside: &Beside, event: InputEvent) -> bool {
        let corner = DVec2::from_array(self.area.0);
        let event = match event {
            // What is over a panel is not over a picture.
            InputEvent::PointerMoved(_) if beside.window.is_over_panel => InputEvent::PointerLeft,
            InputEvent::PointerMoved(pixel) => InputEvent::PointerMoved(pixel - corner),
            InputEvent::Touch { finger, is_down, place } => {
                InputEvent::Touch { finger, is_down, place: place - corner }
            }
            event => event,
        };
        let before = self.scene.look.clone();
        let heard = self.scene.on_event(event);
        let is_moved = self.scene.look != before;
        // What is another's may change what lies over the pictures.
        let is_others = matches!(event, InputEvent::Key { .. } | InputEvent::Shown);
        self.is_stale |= match heard {
            VolumeHeard::Taken => is_moved,
            VolumeHeard::Other => is_others,
            _ => true,
        };
        heard != VolumeHeard::Other
    }

    /// Returns true if a frame is due, since something is to be seen or to be asked for.
    pub fn is_stale(&self) -> bool {
        self.is_stale || self.scene.is_asking()
    }

    /// When the next frame of the pictures is due.
    pub(super) fn next_frame(&self, beside: &Beside) -> Wake {
        match () {
            () if self.rests && !self.is_stale => Wake::After(REST),
            () if self.is_stale || self.is_led || self.scene.is_due() => Wake::Now,
            () if self.scene.share_at_wanted().1.failed > 0 => Wake::SLOWLY,
            () if self.is_being_made => beside.at_rest().no_later(EVERY),
            () => beside.at_rest(),
        }
    }

    /// Asks for what is missing and draws what is due. Returns false if no more is to be seen of it than in
    /// the last frame.
    pub(super) fn begin_frame(
        &mut self,
        beside: &mut Beside,
        panels_are_due: bool,
        painter: &mut PanelPainter,
    ) -> Result<bool, vastex::Error> {
        let mut is_other = std::mem::take(&mut self.is_stale) | beside.take_stale();
        is_other |= beside.hud.is_shown() || beside.has_another_notice() || panels_are_due;
        match self.scene.frame(self.area.1, VolumePictures::Parts) {
            Ok(is_drawn) => {
                is_other |= is_drawn;
                self.fault = None;
            }
            Err(VolumeError::Textures(error)) => return Err(error),
            Err(error) => {
                let said = format!("{}: {error}", self.name);
                if self.fault.as_ref() != Some(&said) {
                    beside.show_error(VOLUME, &said);
                    beside.log(said.clone());
                    self.fault = Some(said);
                }
            }
        }
        is_other |= self.tell_of_cut(beside);
        let now = beside.now();
        let is_due = self.is_led || self.scene.is_due();
        let is_early = |(at, size): (Duration, [u32; 2])| now.saturating_sub(at) < EVERY && size == self.size;
        self.rests = !is_other && is_due && self.shown.is_some_and(is_early);
        if self.rests {
            return Ok(false);
        }
        for fault in self.scene.take_faults() {
            let fault = format!("{}: {fault}", self.name);
            beside.show_error_later(TILES, &fault);
            beside.log(fault);
        }
        self.name_pictures(painter);
        Ok(true)
    }

    /// Says that rays are cut, as long as they are. Returns true if something else is said than before.
    fn tell_of_cut(&mut self, beside: &mut Beside) -> bool {
        let cut = (self.scene.ray_cut().map(|cut| ray_cut_text(&cut)), beside.times_forgotten());
        let is_other = cut != self.cut;
        if is_other {
            beside.forget(CUT);
            cut.0.iter().for_each(|said| beside.show_note(CUT, said));
            self.cut = cut;
        }
        is_other
    }

    /// Makes the pictures known to what draws the panels, where they are others.
    fn name_pictures(&mut self, painter: &mut PanelPainter) {
        let format = self.format.viewed;
        let now = painter.number_of(format).map(|painter| (self.scene.painted(), painter));
        if now.is_some() && self.of == now {
            return;
        }
        let pictures = self.scene.pictures();
        let views: Vec<&wgpu::TextureView> = pictures.iter().map(|(_, view)| view).collect();
        let (names, painter) = painter.show_pictures(self.scene.gpu(), format, &views);
        self.names = pictures.iter().map(|(pane, _)| pane.pane).zip(names).collect();
        self.of = Some((self.scene.painted(), painter));
    }

    /// A frame is on its way, and counts, whether or not the host had anything recorded for it.
    pub(super) fn end_frame(&mut self, beside: &mut Beside) {
        if let Some(since) = beside.count_frame() {
            self.scene.pass_time(since);
        }
        self.shown = Some((beside.now(), self.size));
        if self.scene.is_settled() && self.scene.share_at_wanted().1.failed == 0 {
            beside.forget(TILES);
        }
    }

    /// The title of the window after a frame, if it should change now.
    pub(super) fn title<'a>(&self, beside: &'a mut Beside, stats: &FrameStats) -> Option<&'a str> {
        let parts = TitleParts {
            name: &self.name,
            image: None,
            texel: None,
            overlay: None,
            stats,
            is_settled: self.scene.is_settled(),
            opening: beside.opening.as_ref().map(|(_, share)| *share),
        };
        let now = beside.now();
        beside.title.due(now, &parts)
    }

    /// Changes what a person changed of what the machine does.
    pub(super) fn change(&mut self, beside: &mut Beside, change: &HudChange) {
        // The pools are this volume's alone, and go with it.
        let tuned = Tuned { name: &self.name, textures: self.scene.textures_mut(), keeps_pools: false };
        if beside.tune(tuned, change).is_some() {
            beside.notify("volumes are sampled and asked in one way");
        }
        self.is_stale = true;
    }
}

/// Pictures in which panels are drawn straight, and the pictures of a volume with them.
fn format_of(formats: &PictureFormats) -> PictureFormat {
    formats.straight(wgpu::TextureFormat::Rgba8Unorm)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;
    use crate::hud::Chosen;
    use crate::volume_scene::facts_for_tests;

    #[test]
    fn a_frame_counts_where_it_ends_whether_or_not_anything_was_recorded_for_it() {
        let gpu = pollster::block_on(Gpu::headless()).unwrap();
        let time = Arc::new(AtomicU64::new(1000));
        let told = time.clone();
        let clock = Arc::new(move || Duration::from_millis(told.load(Ordering::Relaxed)));
        let mut beside = Beside::new(Chosen::default(), clock);
        let facts = facts_for_tests();
        let (name, look, rows) = ("cells.zarr".to_owned(), VolumeLook::first(&facts), Arc::from([]));
        let (settings, images) = (Settings::default(), Vec::new());
        let shown = VolumeToShow { name, facts, look, settings, rows, images };
        let format = wgpu::TextureFormat::Rgba8Unorm;
        let formats = PictureFormats::new(&gpu.adapter, vec![format], format);
        let mut volume = ShownVolume::new((&gpu, &beside), shown, (&formats, [64, 48])).unwrap();
        volume.end_frame(&mut beside);
        time.fetch_add(16, Ordering::Relaxed);
        assert_eq!(beside.count_frame(), Some(Duration::from_millis(16)));
    }
}
