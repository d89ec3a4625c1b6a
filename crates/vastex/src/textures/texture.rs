//! One texture, looked at or changed.

use std::sync::Arc;

use vastex_core::{Description, LevelRule, PoolId, Region, SurveyedTexture, TextureNumber};
use vastex_wgpu::Kind;

use super::Textures;
use crate::error::Error;
use crate::ids::{LayerId, TextureId};
use crate::paging::PagedTexture;
use crate::settings::Filter;

/// A texture, to be asked about itself; returned by [`Textures::texture`].
#[derive(Clone, Copy)]
pub struct TextureRef<'a> {
    textures: &'a Textures,
    state: &'a PagedTexture,
    id: TextureId,
}

/// A texture, to be changed; returned by [`Textures::texture_mut`].
pub struct TextureMut<'a> {
    textures: &'a mut Textures,
    id: TextureId,
}

impl Textures {
    /// A texture, to be asked about itself. Fails if it was removed.
    pub fn texture(&self, texture: TextureId) -> Result<TextureRef<'_>, Error> {
        let state = self.paging.texture(texture.number()).filter(|_| self.gpu.has(texture));
        Ok(TextureRef { textures: self, state: state.ok_or(Error::NoTexture(texture))?, id: texture })
    }

    /// A texture, to be changed. Fails if it was removed.
    pub fn texture_mut(&mut self, texture: TextureId) -> Result<TextureMut<'_>, Error> {
        self.number(texture).ok_or(Error::NoTexture(texture))?;
        Ok(TextureMut { textures: self, id: texture })
    }
}

impl<'a> TextureRef<'a> {
    /// The number by which pages, events and statistics name the texture.
    pub fn number(&self) -> TextureNumber {
        self.id.number()
    }

    /// The texture's shape, layers and levels, as its source describes them.
    pub fn description(&self) -> &'a Arc<Description> {
        &self.state.description
    }

    /// The layer of that name, if it has one.
    pub fn layer(&self, name: &str) -> Option<LayerId> {
        let index = self.description().layers.iter().position(|layer| layer.name == name)?;
        Some(LayerId::new(self.id, index))
    }

    /// How the texels of a layer are blended, by its index in [`Description::layers`]: as was asked for when
    /// the texture was added, by [`Settings::filter`](crate::Settings::filter), or, where its values may not
    /// be mixed, not at all. `None` if there is no such layer.
    pub fn filter(&self, layer: usize) -> Option<Filter> {
        Some(self.textures.gpu.sampling_of(LayerId::new(self.id, layer))?.filter)
    }

    /// The kind of a layer, by its index in [`Description::layers`]: how its pool is read, by which filter,
    /// and whether its values are mixed. `None` if there is no such layer.
    ///
    /// Shaders of layers of equal kinds have the same text, and so the same pipelines; the text of a group
    /// follows from the kinds of its members and from which of them share a [pool](TextureRef::pool).
    /// [`Textures::kinds`] gives the whole key of a pipeline cache. A kind stays the same for as long as the
    /// texture is there, unless [`Memory::restore`](crate::Memory::restore) goes to a device that reads the
    /// layer's format in another way.
    ///
    /// ```no_run
    /// # use vastex::{Error, TextureId, Textures};
    /// # fn of(textures: &Textures, ground: TextureId, rock: TextureId) -> Result<(), Error> {
    /// let kind_of = |id| textures.texture(id).map(|texture| texture.kind(0));
    /// if kind_of(ground)? == kind_of(rock)? { /* one pipeline draws both */ }
    /// # Ok(()) }
    /// ```
    pub fn kind(&self, layer: usize) -> Option<Kind> {
        self.textures.gpu.kind_of(LayerId::new(self.id, layer))
    }

    /// How the texture's levels are chosen, within the levels that it has.
    pub fn levels(&self) -> LevelRule {
        self.textures.paging.pager().levels(self.id.number()).unwrap_or_default()
    }

    /// The pool that the texture's tiles are in, as events and statistics name it. Every existing texture has
    /// one.
    pub fn pool(&self) -> Option<PoolId> {
        self.textures.pool_of(self.id.number())
    }

    /// The mip bias in force for the texture, that of its pool, in eighths of a level.
    pub fn bias_eighths(&self) -> u16 {
        self.pool().map_or(0, |pool| self.textures.paging.pager().pool(pool).bias_eighths())
    }

    /// The texture's name for people, if it was given one.
    pub fn name(&self) -> Option<&'a str> {
        self.textures.watch.name(self.id.number())
    }

    /// What a [`survey::Survey`](crate::survey::Survey) needs to know of the texture, with the rule by which
    /// its levels are chosen.
    pub fn surveyed(&self) -> SurveyedTexture<'a> {
        let geometry = &self.state.description.geometry;
        let rule = self.textures.gpu.rule(self.id.number()).unwrap_or_default();
        SurveyedTexture { number: self.id.number(), geometry, rule }
    }
}

impl TextureMut<'_> {
    /// Sets how the levels of the texture are chosen, from the next feedback and picture on: a range of
    /// levels and a bias of its own, before the mip bias of its pool. Both are clamped to the levels that the
    /// texture has and the biases that are allowed. What follows several textures by one walk may heed the
    /// bias of one of them alone, as rays through the channels of a volume do.
    pub fn set_levels(&mut self, rule: LevelRule) {
        let number = self.id.number();
        self.textures.gpu.set_levels(number, rule);
        self.textures.paging.set_levels(number, rule);
    }

    /// Gives the texture a name for people, in place of the one it had.
    pub fn set_name(&mut self, name: impl Into<Arc<str>>) {
        self.textures.watch.set_name(self.id.number(), name.into());
    }

    /// Keeps, or no longer keeps, the texels of a layer (by its index in [`Description::layers`]) of every
    /// tile in the pool in main memory too, decoded, so that the CPU can sample all that is on screen,
    /// whatever the RAM cache has. Applies to tiles that come from now on, so call it when the texture is
    /// added. Costs at most the layer's part of the pool once more, and a copy of each tile that is uploaded.
    /// Returns true if there is such a layer.
    pub fn keep_for_cpu(&mut self, layer: usize, keep: bool) -> bool {
        let layer = LayerId::new(self.id, layer);
        let exists = self.textures.gpu.sampling_of(layer).is_some();
        if exists {
            self.textures.cpu.keep(layer, keep);
        }
        exists
    }

    /// Says that the content of a region has changed in its source: its resident tiles are read again and
    /// replaced in place, the old ones staying on screen until then. Caches drop the region; see
    /// [`TileSource::changed`](crate::TileSource::changed). Returns how many pages of it the pager knew.
    pub fn invalidate(&mut self, region: &Region) -> u32 {
        let number = self.id.number();
        let known = self.textures.paging.invalidate(number, region);
        if let Some(state) = self.textures.paging.texture(number) {
            self.textures.cpu.forget(number, &state.description.geometry, region);
        }
        known
    }
}
