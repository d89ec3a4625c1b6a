//! What lies over the picture: how it is divided where layers are side by side, which pane the pointer
//! belongs to, what stands over each pane, and shapes of another file.

use std::sync::Arc;

use glam::DVec2;

use super::SurfaceScene;
use crate::camera::Pose;
use crate::input::InputEvent;
use crate::inspect;
use crate::layers::CompareMode;
use crate::panels::{Panes, Shapes, free_in_panes};
use crate::picture::PicturePart;

impl SurfaceScene {
    /// How the picture is divided.
    pub(super) fn panes(&self) -> Panes {
        let alone = || Panes::sharing(1, self.size[0], [0.0; 2]);
        self.display.displayed().map_or_else(alone, |source| source.renderer.panes_in(self.size))
    }

    /// Width and height of what a camera sees in pixels: of a pane, where layers are side by side.
    pub fn size(&self) -> [u32; 2] {
        [self.panes().width, self.size[1]]
    }

    /// The corners of the part of what a camera sees that no panel covers, in pixels from the top left.
    pub(super) fn free(&self) -> [DVec2; 2] {
        let [width, height] = self.size;
        let whole = [DVec2::ZERO, DVec2::new(width.into(), height.into())];
        free_in_panes(&self.panes(), height, self.beside.panel.free.unwrap_or(whole))
    }

    /// What part the picture, or a pane of it, is of what a camera sees.
    pub fn view(&self) -> PicturePart {
        let size = self.size();
        let displayed = self.display.displayed();
        displayed.map_or(PicturePart::all(size), |source| source.renderer.view_in(size))
    }

    /// Has panes share what no panel covers, and cameras with perspective look at its middle, from here on.
    pub(super) fn look_beside_panels(&mut self) {
        let before = (self.panes(), self.view());
        let room = self.beside.panel.free.map(|[first, last]| PicturePart {
            whole: self.size,
            at: [first.x as i64, 0],
            size: [(last.x - first.x).max(0.0) as u32, self.size[1]],
        });
        self.display.each_mut().for_each(|source| source.renderer.set_room(room));
        let view = PicturePart::around(self.size(), self.free());
        self.display.each_mut().for_each(|source| source.renderer.set_view(Some(view)));
        if (self.panes(), self.view()) != before {
            self.wake();
        }
    }

    /// The pose in which all of the image is seen beside what covers the picture; `None` before there is one.
    pub fn fitted(&self) -> Option<Pose> {
        (!self.is_empty()).then(|| Pose::fitted(self.size(), self.image_size(), self.free()))
    }

    /// A pixel of the picture as the camera sees it. Where a button or a finger is down, it belongs to the
    /// pane in which that went down; else to the one below it.
    fn in_pane(&mut self, pixel: DVec2) -> DVec2 {
        let panes = self.panes();
        if !self.pane_is_held {
            self.pane = panes.at(pixel);
        }
        panes.within(self.pane.min(panes.count - 1), pixel)
    }

    /// An event of the picture as one of the pane that it belongs to.
    pub fn event_in_pane(&mut self, event: InputEvent) -> InputEvent {
        match event {
            InputEvent::PointerMoved(pixel) => InputEvent::PointerMoved(self.in_pane(pixel)),
            InputEvent::Touch { finger, is_down, place } => {
                let place = self.in_pane(place);
                self.pane_is_held = is_down;
                InputEvent::Touch { finger, is_down, place }
            }
            InputEvent::Button { is_pressed, .. } => {
                self.pane_is_held = is_pressed;
                event
            }
            InputEvent::FocusLost | InputEvent::PointerLeft => {
                self.pane_is_held = false;
                event
            }
            event => event,
        }
    }

    /// Puts the layers that are seen side by side, or over one another again.
    pub fn put_beside(&mut self) {
        let is_beside = self.settings.options.compare_mode == CompareMode::Beside;
        let mode = if is_beside { CompareMode::Off } else { CompareMode::Beside };
        if !self.can_compare() {
            self.beside.notify("one layer is shown; lay a file over it in the panel (M), or with --over");
            return;
        }
        self.settings.options.compare_mode = mode;
        self.beside.notify(if is_beside { "over one another" } else { "side by side" });
        self.jumped();
    }

    /// Shapes lie over the source of an opening, by its number, from the next frame on.
    pub fn lay_shapes(&mut self, opening: u64, shapes: Arc<Shapes>) {
        self.shapes = Some((opening, shapes));
        self.wake();
    }

    /// What stands over each pane: the name of its layer, and its value below the pointer.
    pub(super) fn pane_titles(&self, panes: &Panes, pose: &Pose) -> Vec<String> {
        let Some(source) = self.display.displayed().filter(|_| panes.count > 1) else { return Vec::new() };
        let pointed = self.pointer.map(|pixel| panes.within(panes.at(pixel), pixel));
        let sizes = ([panes.width, self.size[1]], source.size);
        let title = |layer: vastex::LayerId| {
            let texture = self.textures.texture(layer.texture()).ok()?;
            let layers = &texture.description().layers;
            let mut title = texture.name().unwrap_or_default().to_owned();
            if layers.len() > 1 {
                title = format!("{title}: {}", layers.get(layer.index())?.name);
            }
            let texel = inspect::texel_at(&self.textures, (&source.renderer, layer), pose, sizes, pointed?);
            Some(texel.map_or_else(|| title.clone(), |texel| format!("{title} – {texel}")))
        };
        let name = |layer: vastex::LayerId| {
            let texture = self.textures.texture(layer.texture()).ok();
            texture.and_then(|texture| texture.name().map(str::to_owned)).unwrap_or_default()
        };
        let shown = source.renderer.layers().in_panes();
        shown.map(|shown| title(shown.layer).unwrap_or_else(|| name(shown.layer))).collect()
    }

    fn can_compare(&self) -> bool {
        self.display.displayed().is_some_and(|source| source.renderer.layers().can_compare())
    }
}
