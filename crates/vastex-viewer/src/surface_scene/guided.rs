//! What lies over the picture of an image in a window: lines and values of large texels, a scale, shapes,
//! and a map.

use egui::{Rect, Ui};
use glam::DVec2;
use vastex::Textures;

use crate::camera::Pose;
use crate::inspect::{self, Thumbnail};
use crate::panels::{ImageView, Minimap, Shapes, TexelSize, paint_guides};
use crate::surface::SceneRenderer;

/// An image, and what its guides are taken from. Where layers are side by side, `view` is that of the first
/// pane.
pub struct Guided<'a> {
    /// The textures.
    pub textures: &'a Textures,
    /// What draws the image.
    pub renderer: &'a SceneRenderer,
    /// What is seen of it.
    pub view: &'a ImageView,
    /// How large the texels are in the world, if that is known.
    pub texel_size: Option<&'a TexelSize>,
    /// Shapes that lie over it.
    pub shapes: Option<&'a Shapes>,
    /// True if the picture stays as it is.
    pub is_settled: bool,
    /// True if anybody sees it; else there is no map.
    pub is_seen: bool,
}

impl Guided<'_> {
    /// Paints the guides of a pane within `free`, the part of it that no panel covers. Gives back where a
    /// person wants the camera.
    pub fn show(&self, ui: &Ui, pane: u32, free: Rect, minimap: &mut Minimap) -> Option<Pose> {
        let Guided { textures, renderer, view, texel_size, shapes, is_settled, is_seen } = *self;
        let (layers, sizes) = (renderer.layers(), (view.picture, view.image));
        let view = ImageView { left: view.left + pane * view.picture[0], ..*view };
        // A share of a pane's width, counted from the first pane on.
        let across = |pixel: DVec2| f64::from(pane) + pixel.x / f64::from(view.picture[0].max(1));
        let value = |pixel: DVec2| {
            let at = |layer| inspect::texel_at(textures, (renderer, layer), &view.pose, sizes, pixel);
            layers.seen_at(across(pixel)).find_map(|shown| at(shown.layer))
        };
        paint_guides(ui.painter(), free, &view, texel_size, value);
        shapes.into_iter().for_each(|shapes| shapes.paint(ui.painter(), free, &view));
        let of_layers = |size| match layers.panes() {
            1 => Thumbnail::of_layers(textures, layers, view.image, size),
            _ => Thumbnail::of_shown(
                textures,
                (layers, layers.in_panes().nth(pane as usize).into_iter()),
                view.image,
                size,
            ),
        };
        let take = |size| if is_seen { of_layers(size) } else { None };
        minimap.show(ui.ctx(), free, &view, is_settled, take)
    }
}
