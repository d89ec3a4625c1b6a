//! A volume in the window: it takes the place of an image, with the same panel, messages and title beside it
//! (`panels`).

mod panels;

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Error, Result, anyhow};
use egui::TextureId;
use glam::DVec2;
use vastex::Settings;
use vastex_viewer::input::{Action, InputEvent};
use vastex_viewer::panels::{VolumePanel, VolumeValues};
use vastex_viewer::surface_scene::Wake;
use vastex_viewer::title::TitleParts;
use vastex_viewer::volume::VolumeError;
use vastex_viewer::volume_scene::{
    VolumeAsked, VolumeHeard, VolumeLook, VolumePane, VolumePictures, VolumeScene,
};
use vastex_viewer::{VolumeFlight, VolumeViewText};

use super::super::volume_work::{Done, VolumeWork};
use super::Viewer;
use crate::report;
use crate::screenshot::VolumeShot;
use crate::volumes::OpenedVolume;

/// A volume, and what is in the window of it.
pub(super) struct VolumeShown {
    pub(super) name: String,
    pub(super) scene: VolumeScene,
    work: VolumeWork,
    panel: VolumePanel,
    rows: Arc<[(String, String)]>,
    /// Of each channel that was read, which values it has at the time that was read first.
    values: Vec<Option<VolumeValues>>,
    /// What the pictures are known by to what draws the panels, and of which pictures and of whom.
    names: Vec<(VolumePane, TextureId)>,
    of: Option<(u64, u64)>,
    /// Where the pictures lie in the window, in pixels: the corner and the size.
    area: ([f64; 2], [u32; 2]),
    /// True if what lies over the pictures is another than in the last frame.
    is_stale: bool,
    /// When a frame was shown last, of which size, and whether the last one was not, since nothing of it
    /// would have been another.
    shown: Option<(Instant, [u32; 2])>,
    rests: bool,
    /// True if a path moves it.
    is_led: bool,
}

/// Between two frames that are shown while bricks are asked for and nothing else changes, and between two
/// that are not shown.
const EVERY: Duration = Duration::from_millis(250);
const REST: Duration = Duration::from_millis(2);

impl Viewer {
    /// Shows a volume in the place of what is displayed.
    pub(in super::super) fn show_volume(
        &mut self,
        opening: u64,
        (name, opened, look): (&str, OpenedVolume, VolumeLook),
        rows: Arc<[(String, String)]>,
        settings: Settings,
    ) -> Result<()> {
        let settings = self.scene.chosen().budgeted_for_volume(settings);
        let mut scene =
            VolumeScene::new(self.scene.gpu(), opened.facts.clone(), settings, self.clock.clone())?;
        scene.look = look;
        let window = self.window.clone();
        let work = VolumeWork::new(opened, Arc::new(move || window.request_redraw()));
        self.scene.give_way(opening, name);
        let panels = self.surface.formats().straight(wgpu::TextureFormat::Rgba8Unorm);
        self.surface.set_format(&panels);
        self.volume = Some(Box::new(VolumeShown {
            name: name.to_owned(),
            scene,
            work,
            panel: VolumePanel::default(),
            rows,
            values: Vec::new(),
            names: Vec::new(),
            of: None,
            area: ([0.0; 2], self.surface.size()),
            is_stale: true,
            shown: None,
            rests: false,
            is_led: false,
        }));
        Ok(())
    }

    /// What is shown of a volume as a text, if one is.
    pub(in super::super) fn volume_text(&self) -> Option<String> {
        let volume = self.volume.as_ref()?;
        Some(VolumeViewText::of(&volume.scene.look, volume.scene.facts()).to_string())
    }

    /// Shows of a volume what a view says. Says what is in its way, and changes nothing then.
    pub(in super::super) fn show_volume_view(&mut self, view: &VolumeViewText) -> Result<()> {
        let Some(volume) = &mut self.volume else {
            return Err(anyhow!("the view is of a volume, and none is shown; open it first"));
        };
        let facts = volume.scene.facts().clone();
        view.change(&mut volume.scene.look, &facts)?;
        volume.is_stale = true;
        Ok(())
    }

    /// What lies over the pictures of a volume is another.
    pub(super) fn refresh_volume(&mut self) {
        self.volume.iter_mut().for_each(|volume| volume.is_stale = true);
    }

    /// The volume that is shown, if one is, apart from the window.
    pub(in super::super) fn volume_scene(&mut self) -> Option<&mut VolumeScene> {
        self.volume.as_mut().map(|volume| &mut volume.scene)
    }

    /// Has a path move the volume before its next frame, if one is shown.
    pub(in super::super) fn lead_volume(&mut self, now: Duration, flight: &mut VolumeFlight) {
        if let Some(volume) = &mut self.volume {
            let before = volume.scene.look.clone();
            flight.lead(now, &mut volume.scene);
            volume.is_stale |= volume.scene.look != before;
            volume.is_led = flight.is_playing();
        }
    }

    /// An image is displayed.
    pub(super) fn forget_volume(&mut self) {
        self.volume = None;
    }

    /// Returns true if a volume is shown.
    pub(in super::super) fn shows_volume(&self) -> bool {
        self.volume.is_some()
    }

    /// Returns true if something is asked for that only images have, while a volume is shown.
    pub(in super::super) fn ignores(&self, action: &Action) -> bool {
        use Action::*;
        let is_of_window = matches!(action, Panel | EnterPanel | About | Hud | Keys | FillScreen);
        let is_of_any = matches!(action, Guides | Values | File(_) | Open | Screenshot(_)) || is_of_window;
        let goes_out = matches!(action, CopyView | CopyLink | PasteView | Record | Play);
        let is_other = goes_out || matches!(action, Redraw | Quit) || is_of_any;
        self.shows_volume() && !is_other
    }

    /// Hears keys and the pointer before the window does. Returns true if that was all there is to it.
    pub(in super::super) fn hear_in_volume(&mut self, event: InputEvent) -> bool {
        let Some(volume) = &mut self.volume else { return false };
        let corner = DVec2::from_array(volume.area.0);
        let event = match event {
            InputEvent::PointerMoved(pixel) => InputEvent::PointerMoved(pixel - corner),
            InputEvent::Touch { finger, is_down, place } => {
                InputEvent::Touch { finger, is_down, place: place - corner }
            }
            event => event,
        };
        // What is over a panel is not over a picture.
        let event = match event {
            InputEvent::PointerMoved(_) if self.shell.is_over_panel() => InputEvent::PointerLeft,
            event => event,
        };
        let before = volume.scene.look.clone();
        let heard = volume.scene.on_event(event);
        let is_moved = volume.scene.look != before;
        // What is another's may change what lies over the pictures.
        let is_others = matches!(event, InputEvent::Key { .. } | InputEvent::Shown);
        volume.is_stale |= match heard {
            VolumeHeard::Taken => is_moved,
            VolumeHeard::Other => is_others,
            _ => true,
        };
        if volume.is_stale || volume.scene.is_asking() {
            self.window.request_redraw();
        }
        heard != VolumeHeard::Other
    }

    /// The next frame of a volume.
    pub(super) fn next_frame_of_volume(&self, volume: &VolumeShown) -> Wake {
        let beside = &self.scene.beside;
        let left = beside.title.notice_left(beside.now());
        match () {
            () if volume.rests && !volume.is_stale => Wake::After(REST),
            () if volume.is_stale || volume.is_led || volume.scene.is_due() => Wake::Now,
            () if volume.scene.share_at_wanted().1.failed > 0 => Wake::SLOWLY,
            () if volume.work.is_making() => Wake::After(left.map_or(EVERY, |left| left.min(EVERY))),
            () => left.map_or(Wake::OnEvent, Wake::After),
        }
    }

    /// Draws and shows a frame of a volume, where the window shows any.
    pub(super) fn draw_volume(&mut self) -> Result<()> {
        let Some(mut volume) = self.volume.take() else { return Ok(()) };
        let drawn = self.draw_frame_of_volume(&mut volume);
        self.volume = Some(volume);
        drawn
    }

    fn draw_frame_of_volume(&mut self, volume: &mut VolumeShown) -> Result<()> {
        let mut is_other = std::mem::take(&mut volume.is_stale) || self.scene.beside.hud.is_shown();
        let beside = &mut self.scene.beside;
        is_other |= beside.take_stale() || beside.title.notice() != beside.shown_notice.as_deref();
        is_other |= self.shell.due_in(Instant::now()).is_some_and(|due| due.is_zero());
        is_other |= self.take_done(volume);
        match volume.scene.frame(volume.area.1, VolumePictures::Parts) {
            Ok(is_drawn) => is_other |= is_drawn,
            Err(VolumeError::Textures(error)) => return Err(error.into()),
            Err(error) => self.scene.beside.tell("volume", &format!("{}: {error}", volume.name)),
        }
        self.begin_what_is_asked(volume);
        let is_early = |(at, size): (Instant, [u32; 2])| at.elapsed() < EVERY && size == self.surface.size();
        let is_due = volume.is_led || volume.scene.is_due();
        volume.rests = !is_other && is_due && volume.shown.is_some_and(is_early);
        if volume.rests {
            return Ok(());
        }
        for fault in volume.scene.take_faults() {
            let fault = format!("{}: {fault}", volume.name);
            report::say(&fault);
            self.scene.beside.messages.add("tiles", fault);
        }
        self.name_pictures(volume);
        self.run_panels_of_volume(volume);
        let frame = self.surface.acquire();
        if !matches!(frame, Ok(Some(_))) {
            volume.scene.textures().inspect().check_device()?; // a lost one is the reason
        }
        let frame = frame?;
        self.scene.beside.window.is_hidden = frame.is_none();
        let Some(frame) = frame else { return Ok(()) };
        if let Some(since) = self.scene.beside.count_frame() {
            volume.scene.pass_time(since);
        }
        let gpu = self.scene.gpu().clone();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        self.surface.clear(&mut encoder, &frame, glam::Vec4::W);
        let over = (&frame.view, self.surface.viewed_format());
        self.shell.painter.paint(&gpu, &mut encoder, over, self.surface.size());
        gpu.queue.submit([encoder.finish()]);
        self.surface.present(frame);
        volume.shown = Some((Instant::now(), self.surface.size()));
        self.frames += 1;
        let (stats, is_settled) = (volume.scene.textures().stats(), volume.scene.is_settled());
        if let Some(times) = &mut self.times {
            times.note_frame(true, is_settled, self.scene.beside.is_busy());
        }
        if is_settled && stats.pager.failed == 0 {
            self.scene.beside.messages.forget("tiles");
        }
        let beside = &mut self.scene.beside;
        let parts = TitleParts {
            name: &volume.name,
            image: None,
            texel: None,
            overlay: None,
            stats: &stats,
            is_settled,
            opening: beside.opening.as_ref().map(|(_, share)| *share),
        };
        let now = beside.now();
        if let Some(title) = beside.title.due(now, &parts) {
            self.window.set_title(title);
        }
        Ok(())
    }

    /// Takes in what threads have read. Returns true if there was anything.
    fn take_done(&mut self, volume: &mut VolumeShown) -> bool {
        volume.work.want_levels(volume.scene.textures(), volume.scene.has_all());
        volume.scene.expect_changes(volume.work.has_early_bricks());
        let (all, changes) = (volume.work.take_done(), volume.work.changes());
        let is_any = !all.is_empty() || !changes.is_empty();
        volume.scene.changed(&changes);
        for done in all {
            let outcome = match done {
                Done::Channel { channel, time, read: Ok(read) } => {
                    match volume.scene.add((channel, time), read.prepared, read.usual) {
                        Ok(Some(texture)) => volume.work.make_levels(texture, read.source),
                        other => other.map(drop).map_err(Into::into),
                    }
                }
                Done::Channel { channel, time, read: Err(error) } => {
                    volume.scene.refuse(channel, time);
                    Err(error)
                }
                Done::Labels { nth, time, read: Ok(read) } => {
                    match volume.scene.add_labels((nth, time), read.prepared, read.place) {
                        Ok(Some(texture)) => volume.work.make_levels(texture, read.source),
                        other => other.map(drop).map_err(Into::into),
                    }
                }
                Done::Labels { nth, time, read: Err(error) } => {
                    volume.scene.refuse_labels(nth, time);
                    Err(error)
                }
                Done::Point(Ok(told), _) => {
                    volume.scene.tell(told);
                    Ok(())
                }
                Done::Point(Err(error), number) => {
                    volume.scene.tell_nothing(number);
                    Err(error)
                }
                Done::Values { channel, values: Ok(values) } => {
                    volume.values.resize(volume.values.len().max(channel + 1), None);
                    volume.values[channel] = values;
                    Ok(())
                }
                Done::Values { values: Err(error), .. } => Err(error),
                // Others are shown by now.
                Done::Label { nth, .. } if volume.scene.look.labels.shown != Some(nth) => Ok(()),
                Done::Label { found: Ok(Some(place)), .. } => {
                    let of = volume.scene.facts().of;
                    volume.scene.look.put_cross(&of, place);
                    volume.scene.look.centre = volume.scene.look.cross;
                    Ok(())
                }
                Done::Label { label, found: Ok(None), .. } => {
                    Err(anyhow!("{}: has no label {label}", volume.name))
                }
                Done::Label { found: Err(error), .. } => Err(error),
                Done::Range { channel, range } => range.map(|range| volume.scene.set_range(channel, range)),
            };
            if let Err(error) = outcome {
                self.tell_of_volume(&error);
            }
        }
        let textures = volume.scene.textures();
        let (times, seen) = (volume.scene.times_kept(), volume.scene.seen_time());
        volume.work.keep(&times, seen, |texture| textures.texture(texture).is_ok());
        volume.work.take_faults().into_iter().for_each(|fault| self.tell_of_volume(&fault.into()));
        is_any
    }

    fn tell_of_volume(&mut self, error: &Error) {
        let said = report::message(error);
        report::say(&said);
        self.scene.beside.messages.add("volume", said);
    }

    fn begin_what_is_asked(&mut self, volume: &mut VolumeShown) {
        for asked in volume.scene.take_asked() {
            let begun = match &asked {
                &VolumeAsked::Channel { channel, time } => {
                    volume.work.read((channel, time), volume.scene.preparer())
                }
                &VolumeAsked::Labels { nth, time } => {
                    volume.work.read_labels((nth, time), volume.scene.preparer())
                }
                VolumeAsked::Point(asked) => volume.work.ask(*asked, &volume.scene.look),
                VolumeAsked::Ranges(channels) => volume.work.find_ranges(channels, volume.scene.seen_time()),
            };
            if let Err(error) = begun {
                // Nobody waits for what is not read.
                match asked {
                    VolumeAsked::Channel { channel, time } => volume.scene.refuse(channel, time),
                    VolumeAsked::Labels { nth, time } => volume.scene.refuse_labels(nth, time),
                    VolumeAsked::Point(asked) => volume.scene.tell_nothing(asked.number),
                    VolumeAsked::Ranges(_) => {}
                }
                self.scene.beside.messages.add("volume", report::message(&error));
            }
        }
    }

    /// Makes the pictures known to what draws the panels, where they are others.
    fn name_pictures(&mut self, volume: &mut VolumeShown) {
        let format = self.surface.viewed_format();
        let now = self.shell.painter.number_of(format).map(|painter| (volume.scene.painted(), painter));
        if now.is_some() && volume.of == now {
            return;
        }
        let pictures = volume.scene.pictures();
        let views: Vec<&wgpu::TextureView> = pictures.iter().map(|(_, view)| view).collect();
        let (names, painter) = self.shell.painter.show_pictures(self.scene.gpu(), format, &views);
        volume.names = pictures.iter().map(|(pane, _)| pane.pane).zip(names).collect();
        volume.of = Some((volume.scene.painted(), painter));
    }

    /// What a picture shows of the volume, so many times as large as the window; `None` without one.
    pub(in super::super) fn volume_shot(&self, times: u32) -> Option<VolumeShot> {
        let volume = self.volume.as_ref()?;
        Some(VolumeShot {
            source: volume.work.path().to_owned(),
            look: Some(volume.scene.look.clone()),
            size: self.surface.size().map(|side| side.saturating_mul(times)),
            pixels_per_point: self.window.scale_factor() as f32 * times as f32,
            has_guides: self.scene.beside.panel.guides_are_shown(),
            has_hud: self.scene.beside.hud.is_shown(),
        })
    }

    /// Goes on with another device.
    pub(super) fn restore_volume(&mut self) -> Result<()> {
        if let Some(volume) = &mut self.volume {
            volume.scene.restore(self.scene.gpu()).map_err(|error| anyhow!("{}: {error}", volume.name))?;
            volume.of = None;
        }
        Ok(())
    }
}
