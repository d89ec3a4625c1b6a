//! What a source in a window is made of, by which the same is made in other textures.

use std::sync::Arc;

use vastex::{Prepared, TextureId, Textures, TileSource};

use super::described::{Texels, described};
use super::{DisplayError, DisplaySettings, Displayed};
use crate::gpu::Gpu;
use crate::layers::ImageSizes;
use crate::panels::FileAbout;
use crate::picture::PicturePart;
use crate::surface::SceneRenderer;

use super::super::picture_format::PictureFormat;
use super::super::source::Growth;

/// What a source in a window is made of, and those that lie over it: for the same in other textures.
#[derive(Clone)]
pub struct Blueprint {
    /// The name of each texture, and where its tiles come from: of the source, then of those over it.
    first: (String, Arc<dyn TileSource>),
    over: Vec<(String, Arc<dyn TileSource>)>,
    name: String,
    size: [u32; 2],
    texels: [u32; 2],
    about: FileAbout,
    format: PictureFormat,
    is_crisp: bool,
    is_generated: bool,
    images: Vec<[u32; 2]>,
    growth: Growth,
    rows_seen: u32,
    view: Option<PicturePart>,
}

impl Blueprint {
    /// What the pictures of the window have to be for the source.
    pub fn format(&self) -> &PictureFormat {
        &self.format
    }

    /// Where the tiles of each texture come from: of the source, then of those over it, the lowest first.
    pub fn sources(&self) -> impl Iterator<Item = &Arc<dyn TileSource>> {
        std::iter::once(&self.first).chain(&self.over).map(|(_, source)| source)
    }

    /// What the textures are called, in the order of [`Blueprint::sources`].
    pub fn names(&self) -> impl Iterator<Item = &str> {
        std::iter::once(&self.first).chain(&self.over).map(|(name, _)| &**name)
    }
}

impl Displayed {
    /// What the source is made of, and those over it.
    pub fn blueprint(&self, textures: &Textures) -> Blueprint {
        let name_of = |texture: TextureId| {
            let texture = textures.texture(texture).ok();
            texture.and_then(|texture| texture.name()).unwrap_or_default().to_owned()
        };
        let first = (name_of(self.texture), self.sources[0].clone());
        let over = self.over.iter().map(|texture| name_of(*texture));
        Blueprint {
            first,
            over: over.zip(self.sources[1..].iter().cloned()).collect(),
            name: self.name.clone(),
            size: self.size,
            texels: self.texels,
            about: self.about.clone(),
            format: self.format.clone(),
            is_crisp: self.is_crisp,
            is_generated: self.is_generated,
            images: self.images.clone(),
            growth: self.growth.clone(),
            rows_seen: self.rows_seen,
            view: self.renderer.view(),
        }
    }

    /// Makes the same in other textures, of its sources as these were prepared for them, in the order of
    /// [`Blueprint::sources`]. Compiles pipelines; what fails leaves its textures as they are.
    pub fn of_blueprint(
        gpu: &Gpu,
        textures: &mut Textures,
        settings: &DisplaySettings,
        blueprint: Blueprint,
        prepared: impl IntoIterator<Item = Prepared>,
    ) -> Result<Displayed, DisplayError> {
        let mut ids = Vec::new();
        for (name, prepared) in blueprint.names().zip(prepared) {
            let texture = textures.add(prepared).map_err(|refused| refused.error)?;
            textures.texture_mut(texture)?.set_name(name);
            ids.push(texture);
        }
        let Blueprint {
            first,
            over,
            name,
            size,
            texels,
            about,
            format,
            is_crisp,
            is_generated,
            images,
            growth,
            rows_seen,
            view,
        } = blueprint;
        let mut relief = None;
        let how = Texels { is_crisp, is_generated };
        let sizes: ImageSizes = ids.iter().copied().zip(images.iter().copied()).collect();
        let drawn = described(settings, how, textures, (&ids, &sizes), &mut relief)?;
        let mut renderer = SceneRenderer::new(gpu, textures, drawn, format.drawn_format())?;
        renderer.set_view(view);
        let tiles = std::iter::once(first).chain(over).map(|(_, source)| source).collect();
        let texture = ids.remove(0);
        let mut made = Displayed {
            texture,
            over: ids,
            sources: tiles,
            renderer,
            overlay: None,
            name,
            size,
            texels,
            about,
            format,
            relief,
            heights: settings.options.heights.clone(),
            is_crisp,
            is_generated,
            images,
            growth,
            rows_seen,
        };
        made.draw_overlay(gpu, textures, settings.overlay);
        Ok(made)
    }

    /// Returns true if the tiles of both come from the same sources.
    pub fn is_of(&self, other: &Displayed) -> bool {
        let is_same = |(a, b): (&Arc<dyn TileSource>, &Arc<dyn TileSource>)| Arc::ptr_eq(a, b);
        self.sources.len() == other.sources.len() && self.sources.iter().zip(&other.sources).all(is_same)
    }

    /// Shows what was made with settings `before` as other settings say.
    pub fn become_like(
        &mut self,
        gpu: &Gpu,
        textures: &mut Textures,
        before: &DisplaySettings,
        settings: &DisplaySettings,
    ) -> Result<(), DisplayError> {
        let is_elsewhere =
            (before.scene, &before.options.heights) != (settings.scene, &settings.options.heights);
        if is_elsewhere {
            self.put_on(gpu, textures, settings)?;
        } else if before.options != settings.options {
            self.show_layers(gpu, textures, settings)?;
        }
        self.renderer.set_light(settings.options.planet.light);
        if before.overlay != settings.overlay {
            self.draw_overlay(gpu, textures, settings.overlay);
        }
        Ok(())
    }
}
