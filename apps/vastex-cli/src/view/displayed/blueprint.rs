//! What a source in the window is made of, by which the same is made in other textures.

use std::sync::Arc;

use anyhow::{Context, Result};
use vastex::{TextureId, TextureSettings, Textures, TileSource};
use vastex_scenes::{Gpu, SceneRenderer};
use vastex_viewer::PicturePart;

use super::super::opening::Growth;
use super::super::surface::SurfaceFormat;
use super::{DisplaySettings, Displayed, described};
use crate::open::FileAbout;

/// What a source in the window is made of, and those that lie over it: for the same in other textures.
#[derive(Clone)]
pub(in super::super) struct Blueprint {
    /// The name of each texture, and where its tiles come from.
    sources: Vec<(String, Arc<dyn TileSource>)>,
    name: String,
    size: [u32; 2],
    texels: [u32; 2],
    about: FileAbout,
    format: SurfaceFormat,
    is_crisp: bool,
    is_generated: bool,
    growth: Growth,
    rows_seen: u32,
    view: Option<PicturePart>,
}

impl Blueprint {
    /// What the surface of the window has to be for it.
    pub(in super::super) fn format(&self) -> &SurfaceFormat {
        &self.format
    }
}

#[cfg(test)]
impl Blueprint {
    pub(in super::super) fn for_test(
        sources: Vec<(String, Arc<dyn TileSource>)>,
        size: [u32; 2],
        growth: Growth,
    ) -> Blueprint {
        let (about, format) = (FileAbout::default(), SurfaceFormat::for_test());
        let name = "for a test".to_owned();
        Blueprint {
            sources,
            name,
            size,
            texels: size,
            about,
            format,
            is_crisp: false,
            is_generated: false,
            growth,
            rows_seen: 0,
            view: None,
        }
    }

    pub(in super::super) fn names(&self) -> Vec<&str> {
        self.sources.iter().map(|(name, _)| &**name).collect()
    }
}

impl Displayed {
    /// What it is made of.
    pub(in super::super) fn blueprint(&self, textures: &Textures) -> Blueprint {
        let name_of = |texture: TextureId| {
            let texture = textures.texture(texture).ok();
            texture.and_then(|texture| texture.name()).unwrap_or_default().to_owned()
        };
        Blueprint {
            sources: self.textures().into_iter().map(name_of).zip(self.sources.iter().cloned()).collect(),
            name: self.name.clone(),
            size: self.size,
            texels: self.texels,
            about: self.about.clone(),
            format: self.format.clone(),
            is_crisp: self.is_crisp,
            is_generated: self.is_generated,
            growth: self.growth.clone(),
            rows_seen: self.rows_seen,
            view: self.renderer.view(),
        }
    }

    /// Makes the same in other textures, whose tails are read anew: one tile of each source. Waits for them,
    /// and compiles pipelines; what fails leaves its textures as they are.
    pub(in super::super) fn of_blueprint(
        gpu: &Gpu,
        textures: &mut Textures,
        settings: &DisplaySettings,
        blueprint: Blueprint,
    ) -> Result<Displayed> {
        let Blueprint {
            sources,
            name,
            size,
            texels,
            about,
            format,
            is_crisp,
            is_generated,
            growth,
            rows_seen,
            view,
        } = blueprint;
        let (mut ids, mut tiles) = (Vec::new(), Vec::new());
        for (name, source) in sources {
            let prepared = textures.preparer().read_blocking(source.clone(), TextureSettings::default())?;
            let texture = textures.add(prepared).map_err(|refused| refused.error)?;
            textures.texture_mut(texture)?.set_name(name);
            ids.push(texture);
            tiles.push(source);
        }
        let mut relief = None;
        let drawn = described(settings, (is_crisp, is_generated), textures, &ids, &mut relief)?;
        let mut renderer = SceneRenderer::new(gpu, textures, drawn, format.drawn_format())?;
        renderer.set_view(view);
        let over = ids.split_off(ids.len().min(1));
        let texture = *ids.first().context("nothing is displayed")?;
        let mut made = Displayed {
            texture,
            over,
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
            growth,
            rows_seen,
        };
        made.draw_overlay(gpu, textures, settings.overlay);
        Ok(made)
    }

    /// Returns true if its tiles come from the same sources.
    pub(in super::super) fn is_of(&self, other: &Displayed) -> bool {
        let is_same = |(a, b): (&Arc<dyn TileSource>, &Arc<dyn TileSource>)| Arc::ptr_eq(a, b);
        self.sources.len() == other.sources.len() && self.sources.iter().zip(&other.sources).all(is_same)
    }

    /// Shows what was made with other settings as these say.
    pub(in super::super) fn become_like(
        &mut self,
        gpu: &Gpu,
        textures: &mut Textures,
        before: &DisplaySettings,
        settings: &DisplaySettings,
    ) -> Result<()> {
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
