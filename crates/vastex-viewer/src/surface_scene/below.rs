//! What lies below the pointer, in the title and as a line at the foot of the picture.

use std::time::Duration;

use glam::DVec2;
use vastex::LayerId;
use vastex::diagnostics::FrameStats;

use super::SurfaceScene;
use super::display::Display;
use super::displayed::Displayed;
use crate::camera::{GroundHeights, Pose};
use crate::inspect::{self, InspectedTexel};
use crate::panels::{StatusPlace, status_text};
use crate::title::{Scale, TitleImage, TitleParts};

/// Between two frames that are drawn for the line alone, at least, and as a multiple of how long a frame
/// takes: a slow device is left time for what else there is to do.
const EVERY: Duration = Duration::from_millis(50);
const SHARE_OF_FRAMES: u32 = 2;

/// The line that was drawn last.
#[derive(Default)]
pub(super) struct Below {
    /// What it said.
    shown: Option<String>,
    /// When that was, and how long the frame took.
    shown_at: Option<Duration>,
    took: Duration,
    /// True if it says something else now.
    is_stale: bool,
}

impl Below {
    /// A frame shows a line.
    pub(super) fn show(&mut self, text: Option<String>, now: Duration) {
        (self.shown, self.shown_at, self.is_stale) = (text, Some(now), false);
    }

    /// The frame is drawn.
    pub(super) fn drawn(&mut self, now: Duration) {
        self.took = self.shown_at.map_or(Duration::ZERO, |begun| now.saturating_sub(begun));
    }

    /// The line would say this now.
    fn note(&mut self, text: Option<&str>) {
        self.is_stale = self.shown.as_deref() != text;
    }

    /// In how long a frame is due for it.
    pub(super) fn due_in(&self, now: Duration) -> Option<Duration> {
        let pause = EVERY.max(self.took * SHARE_OF_FRAMES);
        let since = self.shown_at.map_or(pause, |shown| now.saturating_sub(shown));
        self.is_stale.then(|| pause.saturating_sub(since))
    }
}

impl SurfaceScene {
    /// The pointer is there, in pixels of the view, or not over it: the title and the line at the foot of the
    /// picture say which texel is below it, and its value.
    /// Gives back the title of the window, if it is another.
    pub fn set_pointer(&mut self, pointer: Option<DVec2>, pose: Pose) -> Option<&str> {
        self.note_pointer(pointer);
        if self.panes().count > 1 {
            // The other panes show where it is.
            self.beside.refresh();
        }
        let line = self.line_below(&pose);
        self.below.note(line.as_deref());
        self.title(&self.textures.stats(), pose)
    }

    /// The pointer is there, or not over the view, whatever is shown: what is displayed next is asked there.
    pub(crate) fn note_pointer(&mut self, pointer: Option<DVec2>) {
        self.pointer = pointer;
        let panes = self.panes();
        let pointed = pointer.filter(|_| !self.beside.window.is_over_panel);
        self.beside
            .hud
            .pointer_moved(pointed.map(|pixel| panes.stretched(panes.within(panes.at(pixel), pixel))));
    }

    /// The title of the window after a frame, if it should change now.
    pub fn title(&mut self, stats: &FrameStats, pose: Pose) -> Option<&str> {
        let (displayed, name) = (self.display.displayed(), self.name().to_owned());
        let image = displayed.map(|Displayed { size, texels, renderer, .. }| {
            let scale = pose.magnification(self.size(), *size);
            TitleImage {
                size: *size,
                scene: scale.map_or_else(|| Scale::On(renderer.scene().name()), Scale::Even),
                lack: match &self.display {
                    Display::Source(_) if texels != size => Some("reduced"),
                    // The file could not be read to its end.
                    Display::Preview { .. } if self.beside.opening.is_none() => Some("incomplete"),
                    _ => None,
                },
            }
        });
        let texel = self.texel_below(&pose);
        let parts = TitleParts {
            name: &name,
            image,
            texel: texel.as_ref().map(|(_, texel)| texel),
            overlay: displayed.and_then(|source| Some(source.overlay.as_ref()?.overlay().name())),
            stats,
            is_settled: self.is_settled(stats),
            opening: self.beside.opening.as_ref().map(|(_, share)| *share),
        };
        let now = self.beside.now();
        self.beside.title.due(now, &parts)
    }

    /// Where the pointer is over the picture, as moves are told it: in view heights from the middle.
    pub fn pointed(&self) -> Option<DVec2> {
        let (pointer, panes) = (self.pointer?, self.panes());
        Some(self.view().point(panes.within(panes.at(pointer), pointer)))
    }

    /// Moves a camera with the heights of what is displayed, if it has any.
    pub fn with_heights(&self, moves: impl FnOnce(Option<&mut dyn GroundHeights>)) {
        let renderer = self.display.displayed().map(|source| &source.renderer);
        let mut heights = renderer.and_then(|renderer| renderer.heights(&self.textures, self.size()));
        moves(heights.as_mut().map(|heights| heights as &mut dyn GroundHeights));
    }

    /// The texel below the pointer, of the layer that is seen there, and which one that is.
    fn texel_below(&self, pose: &Pose) -> Option<(LayerId, InspectedTexel)> {
        let pointer = self.pointer?;
        let source = self.display.displayed()?;
        let (picture, panes) = (self.size(), self.panes());
        let pixel = panes.within(panes.at(pointer), pointer);
        let sizes = (picture, source.size);
        let at = |layer| inspect::texel_at(&self.textures, (&source.renderer, layer), pose, sizes, pixel);
        let seen = source.renderer.layers().seen_at(panes.across(pointer));
        seen.map(|shown| shown.layer).find_map(|layer| Some((layer, at(layer)?)))
    }

    /// What the line at the foot of the picture says; `None` if it is hidden, or the picture is no
    /// picture of texels.
    pub(super) fn line_below(&self, pose: &Pose) -> Option<String> {
        let (panel, window) = (&self.beside.panel, &self.beside.window);
        let has_room = panel.values_have_place() || window.fills_screen;
        if !panel.values_are_shown() || !has_room || window.is_over_panel {
            return None;
        }
        let source = self.display.displayed().filter(|source| source.overlay.is_none())?;
        // What a file says of its place is true on whatever it lies.
        let of_globe = || source.renderer.scene().is_round().then_some(StatusPlace::Globe(source.size));
        let place = source.about.map.as_ref().map(StatusPlace::Map).or_else(of_globe);
        let (layer, texel) = self.texel_below(pose)?;
        // What is said of the source's file is not said of others over it.
        let is_of_source = source.textures().first() == Some(&layer.texture());
        let converted = if is_of_source { source.about.converted.as_str() } else { "" };
        Some(status_text(&texel, converted, place))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_changes_is_drawn_soon_and_leaves_a_slow_device_time() {
        let (mut below, begin) = (Below::default(), Duration::from_secs(5));
        let ms = Duration::from_millis;
        assert_eq!(below.due_in(begin), None);
        below.note(Some("a"));
        assert_eq!(below.due_in(begin), Some(Duration::ZERO), "nothing was drawn yet");
        below.show(Some("a".into()), begin);
        below.drawn(begin + ms(5));
        below.note(Some("a"));
        assert_eq!(below.due_in(begin + ms(10)), None, "it is there already");
        below.note(None);
        assert_eq!(below.due_in(begin + ms(10)), Some(ms(40)));
        below.drawn(begin + ms(400));
        assert_eq!(below.due_in(begin + ms(410)), Some(ms(390)), "twice as long as a frame took");
        below.show(None, begin + ms(800));
        assert_eq!(below.due_in(begin + ms(800)), None);
    }
}
