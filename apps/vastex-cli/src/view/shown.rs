//! One source in the window: its texture, the scene that it is on, and the overlay in the place of the picture, if any.

use anyhow::Result;
use vastex::{TextureId, Textures};
use vastex_scenes::{
    DisplayOptions, Gpu, Layers, Overlay, OverlayRenderer, Relief, Scene, SceneDesc, SceneRenderer,
};

use super::opening::{Arrival, Rows};
use super::surface::{Suit, Surface};

/// What all sources are shown with.
#[derive(Clone, Debug)]
pub(super) struct Showing {
    pub(super) scene: Scene,
    pub(super) options: DisplayOptions,
    pub(super) overlay: Option<Overlay>,
}

/// A source that is shown, or will be.
pub(super) struct Shown {
    pub(super) texture: TextureId,
    pub(super) renderer: SceneRenderer,
    /// What is drawn in the place of the picture, if anything.
    pub(super) overlay: Option<OverlayRenderer>,
    /// Name of the source, for the title.
    pub(super) name: String,
    /// Columns and rows of the image, of which the texture may have fewer.
    pub(super) size: [u32; 2],
    /// What the surface of the window has to be for it.
    pub(super) suit: Suit,
    /// The heights of the texture, once a scene has needed them.
    relief: Option<Relief>,
    rows: Rows,
    /// Rows of a growing picture that were there when it was looked at last.
    rows_seen: u32,
}

impl Shown {
    /// Adds a source to the textures and sets its scene up. Of what fails nothing stays.
    pub(super) fn new(
        gpu: &Gpu,
        textures: &mut Textures,
        surface: &Surface,
        showing: &Showing,
        (name, arrival): (&str, Arrival),
    ) -> Result<Shown> {
        let Arrival { prepared, size, rows } = arrival;
        let texture = textures.add(prepared).map_err(|refused| refused.error)?;
        let made = Shown::of_texture(gpu, textures, surface, showing, texture);
        let (renderer, relief, suit) = match made {
            Ok(made) => made,
            Err(error) => {
                textures.remove(texture);
                return Err(error);
            }
        };
        textures.texture_mut(texture)?.set_name(name);
        let mut shown = Shown {
            texture,
            renderer,
            overlay: None,
            name: name.to_owned(),
            size,
            suit,
            relief,
            rows,
            rows_seen: 0,
        };
        shown.draw_overlay(gpu, textures, showing.overlay);
        Ok(shown)
    }

    fn of_texture(
        gpu: &Gpu,
        textures: &mut Textures,
        surface: &Surface,
        showing: &Showing,
        texture: TextureId,
    ) -> Result<(SceneRenderer, Option<Relief>, Suit)> {
        let mut relief = None;
        let drawn = described(showing, textures, texture, &mut relief)?;
        let suit = surface.suit(&drawn.layers);
        let renderer = SceneRenderer::new(gpu, textures, drawn, suit.drawn_format())?;
        Ok((renderer, relief, suit))
    }

    /// Puts the texture on something else. It may not go there: a terrain needs heights.
    pub(super) fn put_on(&mut self, gpu: &Gpu, textures: &mut Textures, showing: &Showing) -> Result<()> {
        let drawn = described(showing, textures, self.texture, &mut self.relief)?;
        let renderer = SceneRenderer::new(gpu, textures, drawn, self.suit.drawn_format())?;
        let before = std::mem::replace(&mut self.renderer, renderer);
        before.layers().clone().remove(textures);
        self.draw_overlay(gpu, textures, showing.overlay);
        Ok(())
    }

    /// Draws an overlay in the place of the picture, or the picture.
    pub(super) fn draw_overlay(&mut self, gpu: &Gpu, textures: &Textures, overlay: Option<Overlay>) {
        self.overlay = overlay
            .and_then(|overlay| OverlayRenderer::new(&gpu.device, textures, &self.renderer, overlay).ok());
    }

    /// The same on another device, on which the textures are already.
    pub(super) fn restored(
        self,
        gpu: &Gpu,
        textures: &Textures,
        surface: &Surface,
        showing: &Showing,
    ) -> Result<Shown> {
        let Shown { renderer, relief, overlay, .. } = self;
        let is_overlaid = overlay.is_some();
        let drawn = SceneDesc {
            scene: renderer.scene(),
            layers: renderer.layers().clone(),
            relief: relief.clone().filter(|_| renderer.has_relief()),
            tiling: showing.options.tiling,
            always_fixed: showing.options.always_fixed,
        };
        drop((renderer, overlay));
        let suit = surface.suit(&drawn.layers);
        let renderer = SceneRenderer::new(gpu, textures, drawn, suit.drawn_format())?;
        let mut shown = Shown { renderer, relief, suit, overlay: None, ..self };
        shown.draw_overlay(gpu, textures, showing.overlay.filter(|_| is_overlaid));
        Ok(shown)
    }

    /// Has what has come of a growing picture since the last time shown. Says whether anything has.
    pub(super) fn catch_up(&mut self, textures: &mut Textures) -> Result<bool> {
        match &self.rows {
            Rows::All => Ok(false),
            #[cfg(feature = "build")]
            Rows::Growing(picture) => {
                let (region, rows) = (picture.region_since(self.rows_seen), picture.rows());
                if rows == std::mem::replace(&mut self.rows_seen, rows) {
                    return Ok(false);
                }
                textures.texture_mut(self.texture)?.invalidate(&region);
                Ok(true)
            }
        }
    }

    /// Takes the source out of the textures.
    pub(super) fn remove(self, textures: &mut Textures) {
        self.renderer.layers().clone().remove(textures);
        textures.remove(self.texture);
    }
}

/// A scene with what is asked to be shown of a texture. Its heights, if the scene has any, are looked for once.
fn described(
    Showing { scene, options, .. }: &Showing,
    textures: &mut Textures,
    texture: TextureId,
    known: &mut Option<Relief>,
) -> Result<SceneDesc> {
    let scene = *scene;
    let layers = options.layers_of(textures, texture)?;
    if known.is_none() {
        *known = options.relief_of(scene, textures, layers[0].layer)?;
    }
    let relief = known.clone().filter(|_| options.displaces(scene));
    let layers = Layers::new(textures, layers, relief.as_ref().map(Relief::layer))?;
    Ok(SceneDesc { scene, layers, relief, tiling: options.tiling, always_fixed: options.always_fixed })
}
