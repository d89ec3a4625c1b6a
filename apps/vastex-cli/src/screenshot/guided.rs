//! What lies over the picture of an image in the window: lines and values of large texels, a scale, shapes,
//! and a map.

use egui::{Rect, Ui};
use glam::DVec2;
use vastex::Textures;
use vastex_scenes::{Pose, SceneRenderer};
use vastex_viewer::inspect::{self, Thumbnail};
use vastex_viewer::panels::{ImageView, Minimap, Shapes, TexelSize, paint_guides};

/// Pixels a texel from which an image's texels are shown as they are.
pub(crate) const CRISP: f64 = 4.0;

/// An image, and what its guides are taken from.
pub(crate) struct Guided<'a> {
    pub(crate) textures: &'a Textures,
    pub(crate) renderer: &'a SceneRenderer,
    pub(crate) view: &'a ImageView,
    /// How large its texels are in the world, if that is known.
    pub(crate) texel_size: Option<&'a TexelSize>,
    pub(crate) shapes: Option<&'a Shapes>,
    pub(crate) is_settled: bool,
    /// Whether anybody sees it; else there is no map.
    pub(crate) is_seen: bool,
}

impl Guided<'_> {
    /// Paints the guides within `free`, the part of the picture that no panel covers. Gives back where a
    /// person wants the camera.
    pub(crate) fn show(&self, ui: &Ui, free: Rect, minimap: &mut Minimap) -> Option<Pose> {
        let Guided { textures, renderer, view, texel_size, shapes, is_settled, is_seen } = *self;
        let sizes = (view.picture, view.image);
        let layer = |across: f64| renderer.layers().inspected_at(across / f64::from(view.picture[0])).layer;
        let asked = |pixel: DVec2| (renderer, layer(pixel.x));
        let value = |pixel: DVec2| inspect::texel_at(textures, asked(pixel), &view.pose, sizes, pixel);
        paint_guides(ui.painter(), free, view, texel_size, value);
        shapes.into_iter().for_each(|shapes| shapes.paint(ui.painter(), free, view));
        let of_layers = |size| Thumbnail::of_layers(textures, renderer.layers(), view.image, size);
        let take = |size| if is_seen { of_layers(size) } else { None };
        minimap.show(ui.ctx(), free, view, is_settled, take)
    }
}
