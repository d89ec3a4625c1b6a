//! One source in a window: its texture and those that lie over it, the scene that they are on, and the
//! overlay in the place of the picture, if any. When it is displayed is `display`'s business.

mod blueprint;
mod described;
mod growing;

use std::sync::Arc;

use vastex::{TextureId, Textures, TileSource};

use super::picture_format::{PictureFormat, PictureFormats};
use super::source::{DisplayError, Growth, PreparedSource};
use crate::gpu::Gpu;
use crate::layers::{CompareMode, ImageSizes, ShownLayer};
use crate::overlay::{Overlay, OverlayRenderer};
use crate::panels::FileAbout;
use crate::scene::Scene;
use crate::surface::{
    DescribeError, DisplayOptions, Heights, Relief, SceneDesc, SceneRenderer, shows_large_texels,
};
pub use blueprint::Blueprint;
use described::{Texels, described, shown_layers, texels_of};

/// What the sources of a window are shown with.
#[derive(Clone, Debug)]
pub struct DisplaySettings {
    /// The scene that sources are on.
    pub scene: Scene,
    /// The layers of sources, and how these are shown.
    pub options: DisplayOptions,
    /// What is drawn in the place of the picture, if anything.
    pub overlay: Option<Overlay>,
    /// True if large texels are shown as they are, where no filter is asked for.
    pub may_be_crisp: bool,
    /// True if black and white of layers are nobody's choice, and so those of their values at first.
    pub range_is_free: bool,
}

/// A source that is displayed, or will be, with those that lie over it.
pub struct Displayed {
    texture: TextureId,
    /// What lies over it, the lowest first.
    over: Vec<TextureId>,
    /// Where the tiles of each texture come from.
    sources: Vec<Arc<dyn TileSource>>,
    /// What draws it.
    pub renderer: SceneRenderer,
    /// What is drawn in the place of the picture, if anything.
    pub overlay: Option<OverlayRenderer>,
    /// Name of the source, for the title.
    pub name: String,
    /// Columns and rows of the image.
    pub size: [u32; 2],
    /// The columns and rows that the texture has of the image.
    pub texels: [u32; 2],
    /// What the file of the source says beside its texels.
    pub about: FileAbout,
    /// What the pictures of the window have to be for it.
    pub format: PictureFormat,
    /// The heights of the texture, once a scene has needed them, and by what they were looked for.
    relief: Option<Relief>,
    heights: Heights,
    /// True if one of the sources is a generated planet, and so all of them are drawn in fixed point.
    is_generated: bool,
    /// True if its texels are shown as they are, blended with nothing.
    is_crisp: bool,
    /// Columns and rows of the image of each texture, of which the texture may have fewer.
    images: Vec<[u32; 2]>,
    growth: Growth,
    /// Rows of a growing preview that were there when it was looked at last.
    rows_seen: u32,
}

impl Displayed {
    /// Adds a source to the textures and sets its scene up; as an image where it cannot go on the scene that
    /// is asked for and `may_be_image`. Of what fails nothing stays.
    pub fn new(
        gpu: &Gpu,
        textures: &mut Textures,
        formats: &PictureFormats,
        settings: &DisplaySettings,
        may_be_image: bool,
        (name, source): (&str, PreparedSource),
    ) -> Result<Displayed, DisplayError> {
        let PreparedSource { prepared, tiles, size, about, growth } = source;
        let texture = textures.add(prepared).map_err(|refused| refused.error)?;
        let is_generated = about.is_generated;
        let drawn = ((texture, size), is_generated);
        let mut made = Displayed::of_texture(gpu, textures, formats, settings, drawn);
        if made.is_err() && may_be_image && settings.scene != Scene::Image {
            let settings = DisplaySettings { scene: Scene::Image, ..settings.clone() };
            made = Displayed::of_texture(gpu, textures, formats, &settings, drawn);
        }
        let (renderer, relief, format) = match made {
            Ok(made) => made,
            Err(error) => {
                textures.remove(texture);
                return Err(error);
            }
        };
        textures.texture_mut(texture)?.set_name(name);
        let mut displayed = Displayed {
            texture,
            over: Vec::new(),
            sources: vec![tiles],
            renderer,
            overlay: None,
            name: name.to_owned(),
            size,
            texels: texels_of(textures, texture)?,
            about,
            format,
            relief,
            heights: settings.options.heights.clone(),
            is_generated,
            is_crisp: false,
            images: vec![size],
            growth,
            rows_seen: 0,
        };
        displayed.draw_overlay(gpu, textures, settings.overlay);
        Ok(displayed)
    }

    fn of_texture(
        gpu: &Gpu,
        textures: &mut Textures,
        formats: &PictureFormats,
        settings: &DisplaySettings,
        ((texture, size), is_generated): ((TextureId, [u32; 2]), bool),
    ) -> Result<(SceneRenderer, Option<Relief>, PictureFormat), DisplayError> {
        let mut relief = None;
        let how = Texels { is_generated, ..Texels::default() };
        let images = ImageSizes::from_iter([(texture, size)]);
        let drawn = described(settings, how, textures, (&[texture], &images), &mut relief)?;
        let format = formats.for_layers(&drawn.layers);
        let renderer = SceneRenderer::new(gpu, textures, drawn, format.drawn_format())?;
        Ok((renderer, relief, format))
    }

    /// Puts the texture on something else. It may not go there: a terrain needs heights.
    pub fn put_on(
        &mut self,
        gpu: &Gpu,
        textures: &mut Textures,
        settings: &DisplaySettings,
    ) -> Result<(), DisplayError> {
        let shown = self.textures();
        // Large texels are those of an image: elsewhere the next frame would make all of it anew, blended.
        let is_crisp = self.is_crisp && settings.scene == Scene::Image;
        let heights = &settings.options.heights;
        let mut relief = self.relief.clone().filter(|_| self.heights == *heights);
        let how = Texels { is_crisp, ..self.how() };
        let drawn = described(settings, how, textures, (&shown, &self.image_sizes()), &mut relief)?;
        let layers = drawn.layers.clone();
        let renderer = SceneRenderer::new(gpu, textures, drawn, self.format.drawn_format());
        let mut renderer = renderer.inspect_err(|_| layers.remove(textures))?;
        renderer.set_view(self.renderer.view());
        (self.is_crisp, self.relief, self.heights) = (is_crisp, relief, heights.clone());
        let before = std::mem::replace(&mut self.renderer, renderer);
        before.layers().clone().remove(textures);
        self.draw_overlay(gpu, textures, settings.overlay);
        Ok(())
    }

    /// Displays other layers of the texture, or the same ones otherwise. Where the same layers differ in
    /// colours, visibility or opacity alone, nothing is compiled; but a single opaque layer has pipelines of
    /// its own.
    pub fn show_layers(
        &mut self,
        gpu: &Gpu,
        textures: &mut Textures,
        settings: &DisplaySettings,
    ) -> Result<(), DisplayError> {
        let asked = shown_layers(&settings.options, self.is_crisp, textures, &self.textures())?;
        let parts = settings.options.planet_layers(self.renderer.scene(), textures, &self.textures());
        let parts = parts.map_err(DescribeError::from)?;
        let asked: Vec<ShownLayer> = asked.into_iter().chain(parts.night).chain(parts.clouds).collect();
        let mut layers = self.renderer.layers().clone();
        let is_single =
            |layers: &[ShownLayer]| matches!(layers, [layer] if layer.is_visible && layer.opacity >= 1.0);
        let shown: Vec<ShownLayer> = layers.iter().copied().collect();
        let is_alike = |(shown, asked): (&ShownLayer, &ShownLayer)| {
            let is_same = (shown.layer, shown.filter) == (asked.layer, asked.filter);
            is_same && shown.color_map.shares_pipelines(&asked.color_map)
        };
        let (scene, images) = (self.renderer.scene(), self.image_sizes());
        let lie_by_texel = settings.options.lie_by_texel(scene, textures, (&asked, &images));
        let is_same_list = lie_by_texel == layers.is_by_texel()
            && shown.len() == asked.len()
            && shown.iter().zip(&asked).all(is_alike);
        if !is_same_list || is_single(&shown) != is_single(&asked) {
            return self.put_on(gpu, textures, settings);
        }
        for (n, shown) in asked.into_iter().enumerate() {
            layers.set(textures, n, shown).map_err(DescribeError::from)?;
        }
        let before = self.renderer.layer();
        self.renderer.set_layers(&gpu.queue, textures, &layers);
        if self.renderer.layer() != before {
            self.draw_overlay(gpu, textures, settings.overlay);
        }
        Ok(())
    }

    /// The texture of the source and those over it, in the order in which [`crate::LayerOptions::texture`]
    /// counts them.
    pub fn textures(&self) -> Vec<TextureId> {
        std::iter::once(self.texture).chain(self.over.iter().copied()).collect()
    }

    /// Lays another source over it, of which `settings` say what is shown. Of what fails nothing stays.
    pub fn lay_over(
        &mut self,
        gpu: &Gpu,
        textures: &mut Textures,
        settings: &DisplaySettings,
        (name, source): (&str, PreparedSource),
    ) -> Result<(), DisplayError> {
        let texture = textures.add(source.prepared).map_err(|refused| refused.error)?;
        textures.texture_mut(texture)?.set_name(name);
        self.over.push(texture);
        self.sources.push(source.tiles);
        self.images.push(source.size);
        let is_fixed_anew = source.about.is_generated && !self.is_generated;
        self.is_generated |= source.about.is_generated;
        let shown = match settings.options.is_of_planet(self.over.len()) || is_fixed_anew {
            true => self.put_on(gpu, textures, settings),
            false => self.show_layers(gpu, textures, settings),
        };
        if shown.is_err() {
            self.over.pop();
            self.sources.pop();
            self.is_generated &= !is_fixed_anew;
            self.images.pop();
            textures.remove(texture);
        }
        shown
    }

    /// Compares the uppermost layer with those beneath it from the next frame on.
    pub fn compare(&mut self, gpu: &Gpu, textures: &Textures, mode: CompareMode) {
        if self.renderer.layers().compare_mode() != mode {
            let mut layers = self.renderer.layers().clone();
            layers.compare(mode);
            self.renderer.set_layers(&gpu.queue, textures, &layers);
        }
    }

    /// Returns true if it matters how the layers are placed that are shown.
    pub fn can_place(&self, textures: &Textures, settings: &DisplaySettings) -> bool {
        let shown: Vec<ShownLayer> = self.renderer.layers().iter().copied().collect();
        settings.options.can_place(self.renderer.scene(), textures, (&shown, &self.image_sizes()))
    }

    fn image_sizes(&self) -> ImageSizes {
        self.textures().into_iter().zip(self.images.iter().copied()).collect()
    }

    /// How its texels are shown.
    fn how(&self) -> Texels {
        let Displayed { is_crisp, is_generated, .. } = *self;
        Texels { is_crisp, is_generated }
    }

    /// Goes with how large an image is seen, in pixels a texel: large texels are shown as they are.
    pub fn follow(
        &mut self,
        gpu: &Gpu,
        textures: &mut Textures,
        settings: &DisplaySettings,
        magnification: Option<f64>,
    ) -> Result<(), DisplayError> {
        let magnification = magnification.filter(|_| settings.may_be_crisp);
        let is_crisp = magnification.is_some_and(|scale| shows_large_texels(scale, self.is_crisp));
        if is_crisp == std::mem::replace(&mut self.is_crisp, is_crisp) {
            return Ok(());
        }
        let scene = self.renderer.scene();
        self.put_on(gpu, textures, &DisplaySettings { scene, ..settings.clone() })
    }

    /// Draws an overlay in the place of the picture, or the picture.
    pub fn draw_overlay(&mut self, gpu: &Gpu, textures: &Textures, overlay: Option<Overlay>) {
        self.overlay = overlay
            .and_then(|overlay| OverlayRenderer::new(&gpu.device, textures, &self.renderer, overlay).ok());
    }

    /// This source on another device, on which the textures are already.
    pub fn restored(
        self,
        gpu: &Gpu,
        textures: &Textures,
        formats: &PictureFormats,
        settings: &DisplaySettings,
    ) -> Result<Displayed, DisplayError> {
        let Displayed { renderer, relief, overlay, .. } = self;
        let is_overlaid = overlay.is_some();
        let drawn = SceneDesc {
            scene: renderer.scene(),
            layers: renderer.layers().clone(),
            relief: relief.clone().filter(|_| renderer.has_relief()),
            tiling: settings.options.tiling,
            always_fixed: settings.options.always_fixed || self.is_generated,
            light: settings.options.planet.light,
        };
        drop((renderer, overlay));
        let format = formats.for_layers(&drawn.layers);
        let renderer = SceneRenderer::new(gpu, textures, drawn, format.drawn_format())?;
        let mut restored = Displayed { renderer, relief, format, overlay: None, ..self };
        restored.draw_overlay(gpu, textures, settings.overlay.filter(|_| is_overlaid));
        Ok(restored)
    }

    /// Takes the source out of the textures.
    pub fn remove(self, textures: &mut Textures) {
        self.renderer.layers().clone().remove(textures);
        for texture in self.textures() {
            textures.remove(texture);
        }
    }
}

/// Texels that are shown as they are where they are large, on whatever layers are put, and layers of unlike
/// size that lie where they are told to.
#[cfg(test)]
mod tests {
    use vastex::{Filter, ImageOptions, ImageSource, LayerFormat, Settings, TextureSettings};

    use super::*;
    use crate::layers::Placement;
    use crate::surface::LayerOptions;

    /// Columns and rows of the image.
    const SIZE: [u32; 2] = [64, 32];

    /// An image of heights as a window has it, and what it is shown with.
    fn displayed(gpu: &Gpu) -> (Textures, Displayed, DisplaySettings) {
        use wgpu::TextureFormat::{Rgba8Unorm, Rgba8UnormSrgb};
        let heights: Vec<u8> =
            (0..SIZE[0] * SIZE[1]).flat_map(|texel| (texel as u16 * 31).to_le_bytes()).collect();
        let image = ImageSource::new(LayerFormat::R16, SIZE, heights, &ImageOptions::default()).unwrap();
        let tiles: Arc<dyn TileSource> = Arc::new(image);
        let mut textures = Textures::new(&gpu.device, &gpu.queue, Settings::default()).unwrap();
        let formats = PictureFormats::new(&gpu.adapter, vec![Rgba8UnormSrgb, Rgba8Unorm], Rgba8Unorm);
        let settings = DisplaySettings {
            scene: Scene::Image,
            options: DisplayOptions::default(),
            overlay: None,
            may_be_crisp: true,
            range_is_free: false,
        };
        let source = PreparedSource {
            prepared: textures.preparer().read_blocking(tiles.clone(), TextureSettings::default()).unwrap(),
            tiles,
            size: SIZE,
            about: FileAbout::default(),
            growth: Growth::Whole,
        };
        let source = ("heights", source);
        let displayed = Displayed::new(gpu, &mut textures, &formats, &settings, false, source).unwrap();
        (textures, displayed, settings)
    }

    /// The filters that its layers name.
    fn filters(displayed: &Displayed) -> Vec<Option<Filter>> {
        displayed.renderer.layers().iter().map(|layer| layer.filter).collect()
    }

    const CRISP_TEXELS: [Option<Filter>; 1] = [Some(Filter::Nearest)];

    #[test]
    fn texels_are_crisp_from_four_pixels_on_and_stay_so_a_little_below() {
        let gpu = pollster::block_on(Gpu::headless()).unwrap();
        let (mut textures, mut displayed, settings) = displayed(&gpu);
        for (scale, expected) in [
            (Some(3.9), [None]),
            (Some(4.0), CRISP_TEXELS),
            (Some(3.6), CRISP_TEXELS),
            (Some(3.5), [None]),
            (Some(3.6), [None]),
            (Some(8.0), CRISP_TEXELS),
            // On what is no image there is no such scale.
            (None, [None]),
        ] {
            displayed.follow(&gpu, &mut textures, &settings, scale).unwrap();
            assert_eq!(filters(&displayed), expected, "{scale:?} after what came before");
        }
        let blended = DisplaySettings { may_be_crisp: false, ..settings };
        displayed.follow(&gpu, &mut textures, &blended, Some(8.0)).unwrap();
        assert_eq!(filters(&displayed), [None], "somebody asked for another filter");
    }

    #[test]
    fn layers_that_are_put_on_something_else_are_crisp_on_images_alone() {
        let gpu = pollster::block_on(Gpu::headless()).unwrap();
        let (mut textures, mut displayed, settings) = displayed(&gpu);
        let on = |scene| DisplaySettings { scene, ..settings.clone() };
        displayed.follow(&gpu, &mut textures, &settings, Some(8.0)).unwrap();
        // What else is shown on the image is crisp at once.
        let mut twice = on(Scene::Image);
        twice.options.layers = vec![LayerOptions::default(), LayerOptions::default()];
        displayed.show_layers(&gpu, &mut textures, &twice).unwrap();
        assert_eq!(filters(&displayed), [Some(Filter::Nearest); 2]);
        displayed.put_on(&gpu, &mut textures, &twice).unwrap();
        assert_eq!(filters(&displayed), [Some(Filter::Nearest); 2], "it lies where it lay");
        // A terrain of heights that are nowhere cannot be had: all stays as it was.
        let mut without = on(Scene::Terrain);
        without.options.heights.layer = Some("nothing".to_owned());
        assert!(displayed.put_on(&gpu, &mut textures, &without).is_err());
        assert!(displayed.is_crisp && displayed.renderer.scene() == Scene::Image);
        assert_eq!(displayed.heights, settings.options.heights);
        assert_eq!(filters(&displayed), [Some(Filter::Nearest); 2]);
        // Off the image texels are blended from the first frame on, and stay so on the way back.
        for scene in [Scene::Globe, Scene::Terrain] {
            displayed.put_on(&gpu, &mut textures, &on(scene)).unwrap();
            assert_eq!((filters(&displayed), displayed.is_crisp), (vec![None], false), "{scene:?}");
            displayed.follow(&gpu, &mut textures, &on(scene), None).unwrap();
            displayed.put_on(&gpu, &mut textures, &settings).unwrap();
            assert_eq!(filters(&displayed), [None], "back from {scene:?}");
            displayed.follow(&gpu, &mut textures, &settings, Some(8.0)).unwrap();
            assert_eq!(filters(&displayed), CRISP_TEXELS);
        }
    }

    #[test]
    fn layers_of_unlike_size_lie_texel_upon_texel_where_they_are_told_to() {
        let gpu = pollster::block_on(Gpu::headless()).unwrap();
        // Texels are those of the image, also where there is a coarser level of it alone.
        for (size, spread) in [([16, 16], SIZE), ([32, 32], [32, 16]), ([31, 32], [32, 16]), (SIZE, [16, 16])]
        {
            let is_unlike = size != SIZE;
            let (mut textures, mut displayed, settings) = displayed(&gpu);
            assert!(!displayed.can_place(&textures, &settings), "there is one image");
            let image =
                ImageSource::new(LayerFormat::R16, [16, 16], vec![7; 512], &ImageOptions::default()).unwrap();
            let tiles: Arc<dyn TileSource> = Arc::new(image);
            let over = PreparedSource {
                prepared: textures
                    .preparer()
                    .read_blocking(tiles.clone(), TextureSettings::default())
                    .unwrap(),
                tiles,
                size,
                about: FileAbout::default(),
                growth: Growth::Whole,
            };
            displayed.lay_over(&gpu, &mut textures, &settings, ("over", over)).unwrap();
            assert_eq!(displayed.can_place(&textures, &settings), is_unlike);
            assert!(!displayed.renderer.layers().is_by_texel());
            let mut by_texel = settings.clone();
            by_texel.options.placement = Placement::ByTexel;
            displayed.show_layers(&gpu, &mut textures, &by_texel).unwrap();
            assert_eq!(displayed.renderer.layers().is_by_texel(), is_unlike);
            let over = displayed.over[0].into();
            let found = displayed.renderer.layers().spread_over(over, [16, 16]);
            assert_eq!(found.to_array(), spread.map(f64::from), "{size:?}");
            displayed
                .put_on(&gpu, &mut textures, &DisplaySettings { scene: Scene::Globe, ..by_texel.clone() })
                .unwrap();
            assert!(!displayed.renderer.layers().is_by_texel(), "a globe is covered by each image");
            displayed.put_on(&gpu, &mut textures, &by_texel).unwrap();
            assert_eq!(displayed.renderer.layers().is_by_texel(), is_unlike);
            displayed.show_layers(&gpu, &mut textures, &settings).unwrap();
            assert!(!displayed.renderer.layers().is_by_texel());
        }
    }
}
