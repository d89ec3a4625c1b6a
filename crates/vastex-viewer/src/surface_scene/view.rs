//! What a window shows, as a text.

use vastex::Filter;

use super::SurfaceScene;
use crate::camera::Pose;
use crate::view_text::ViewText;

impl SurfaceScene {
    /// What a camera at a pose shows, as a text; `None` if nothing is displayed.
    pub fn view_text(&self, pose: Pose) -> Option<String> {
        let displayed = self.display.displayed()?;
        let mut options = self.settings.options.clone();
        // How texels are blended is said of each layer.
        let filter = self.textures.inspect().settings().filter;
        let planet = &mut options.planet;
        let layers = options.layers.iter_mut().chain(&mut planet.night).chain(&mut planet.clouds);
        for layer in layers.filter(|layer| layer.filter.is_none() && filter != Filter::default()) {
            layer.filter = Some(filter);
        }
        let (scene, overlay) = (self.settings.scene, self.settings.overlay);
        let count = displayed.textures().len();
        Some(ViewText::of(pose, scene, &options, overlay, count).to_text(displayed.size))
    }
}
