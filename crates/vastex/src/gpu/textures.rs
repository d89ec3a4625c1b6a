//! Textures on the GPU: which pool they are in, their page tables, and how shaders see their layers.

use std::sync::Arc;

use bytes::Bytes;
use vastex_core::{
    Description, Geometry, LevelRule, PageId, PageNumbering, PoolId, Slot, TableImage, TextureNumber, Upload,
    VoxelLevels,
};
use vastex_wgpu::{GpuError, Kind, Kinds, PoolTables, TableChoice, TableKind, shader_id, wgsl};

use super::{Gpu, TextureOnGpu};
use crate::error::Error;
use crate::gpu::pools::{PoolShaderOptions, PoolState, Shape};
use crate::ids::{LayerId, Sampled, TextureId};
use crate::settings::Sampling;

impl Gpu {
    /// The kind of page table that a texture gets, once and for all: where a direct one with all its levels
    /// would not fit beside those of its pool it is hashed. Fails where a direct one is asked for that no
    /// pool of the device can hold.
    pub(crate) fn table_kind(&self, held: &Description, choice: TableChoice) -> Result<TableKind, Error> {
        let geometry = &held.geometry;
        let (entries, most) =
            (PoolTables::full_entries(geometry), PoolTables::most_entries(&self.device, self.mode));
        let direct = Shape::of(held, TableKind::Direct);
        let is_full = |pool: &PoolState| {
            pool.shape == direct && pool.tables().is_some_and(|tables| !tables.has_room(geometry))
        };
        match choice {
            TableChoice::Hashed => Ok(TableKind::Hashed),
            TableChoice::BySize if is_large(geometry) || entries > most => Ok(TableKind::Hashed),
            TableChoice::BySize if self.pools.iter().any(is_full) => Ok(TableKind::Hashed),
            TableChoice::Direct if entries > most => {
                Err(GpuError::TableTooLarge { entries, bytes: entries * 4, max: most * 4 }.into())
            }
            TableChoice::BySize | TableChoice::Direct => Ok(TableKind::Direct),
        }
    }

    /// A pool of such textures, whose memory is taken if it was given back.
    pub(crate) fn pool_of_shape(&mut self, shape: &Shape) -> Result<Option<PoolId>, Error> {
        let is_like = |pool: &PoolState| pool.shape == *shape && !pool.is_whole;
        self.taken_back(is_like)
    }

    /// A pool for such textures that are held whole, which may be full.
    pub(crate) fn whole_pool(&mut self, shape: &Shape) -> Result<Option<PoolId>, Error> {
        let is_like = |pool: &PoolState| pool.is_whole && pool.shape == *shape;
        self.taken_back(is_like)
    }

    fn taken_back(&mut self, is_meant: impl Fn(&PoolState) -> bool) -> Result<Option<PoolId>, Error> {
        let found = (0..).zip(&mut self.pools).find(|(_, pool)| is_meant(pool));
        let Some((number, pool)) = found else { return Ok(None) };
        pool.take_back(&self.device, &self.queue)?;
        Ok(Some(PoolId::new(number)))
    }

    /// The pager has given a new pool its number, which is the next.
    pub(crate) fn push_pool(&mut self, pool: PoolState) {
        self.pools.push(pool);
    }

    /// Puts a texture into a pool. Its tail is an upload of the next [`Gpu::carry_out`], from which on
    /// shaders know it.
    pub(crate) fn add_texture(
        &mut self,
        (pool, tail_slot): (PoolId, Slot),
        texture: TextureNumber,
        (description, voxels): (&Arc<Description>, Option<Arc<VoxelLevels>>),
        tail: &Bytes,
        samplings: Vec<Sampling>,
    ) -> Result<(), Error> {
        let state = &mut self.pools[usize::from(pool.number())];
        // What was in the slot before says nothing of what comes.
        state.note_range(tail_slot, tail);
        if let Some(tables) = state.tables_mut() {
            tables.add(texture, &description.geometry, tail_slot)?;
        }
        let (id, number) = (self.next_shader_id(texture), usize::from(texture.number()));
        if self.textures.len() <= number {
            self.textures.resize_with(number + 1, || None);
        }
        let geometry = description.geometry.clone();
        let (description, rule) = (description.clone(), LevelRule::default().within(&geometry));
        let state = TextureOnGpu { pool, description, id, tail_slot, voxels, rule, samplings };
        self.textures[number] = Some(state);
        self.set_record(texture);
        self.bind_texture(texture);
        if let Ok(page) = PageId::new(texture, geometry.dims(), geometry.tail_pos()) {
            // Until then the slot may have what a picture reads.
            let upload = Upload { page, slot: tail_slot, bytes: tail.clone(), evicted: None };
            self.undone.uploads.push((pool, upload));
        }
        Ok(())
    }

    /// Gives the layers of a texture their bind groups.
    pub(super) fn bind_texture(&mut self, texture: TextureNumber) {
        let id = TextureId::new(texture, self.generation(texture));
        let Some(TextureOnGpu { pool, samplings, .. }) = self.texture(texture) else { return };
        let of_layer = |layer| Some((vec![*pool], self.kinds(LayerId::new(id, layer).into())?));
        let layers: Vec<_> = (0..samplings.len()).filter_map(of_layer).collect();
        self.bind(texture, layers);
    }

    /// Another id for a number: one that no texture or group had that had the number before.
    pub(super) fn next_shader_id(&mut self, number: TextureNumber) -> u32 {
        let place = usize::from(number.number());
        if self.generations.len() <= place {
            self.generations.resize(place + 1, 0);
        }
        self.generations[place] = self.generations[place].wrapping_add(1);
        shader_id(number, self.generations[place])
    }

    /// Which of the textures and groups that have had a number has it now, or had it last: the first is 1.
    pub(crate) fn generation(&self, number: TextureNumber) -> u32 {
        self.generations.get(usize::from(number.number())).copied().unwrap_or(0)
    }

    /// Returns true if there is a texture.
    pub(crate) fn has(&self, texture: TextureId) -> bool {
        self.texture(texture.number()).is_some() && self.generation(texture.number()) == texture.generation()
    }

    /// Removes a texture that the pager has removed.
    pub(crate) fn remove_texture(
        &mut self,
        texture: TextureNumber,
        pool: PoolId,
        pager: &vastex_core::Pager,
    ) {
        self.forget_texture_space(Some(texture));
        self.forget_undone(texture, pool, pager);
        if let Some(state) = self.textures.get_mut(usize::from(texture.number())) {
            *state = None;
        }
        self.unbind(texture);
        self.forget_record(texture);
        let state = &mut self.pools[usize::from(pool.number())];
        if let Some(tables) = state.tables_mut() {
            tables.remove(texture);
        }
        if pager.pool(pool).stats().tails == 0 {
            state.give_back();
            self.bind_anew(&[pool].into());
        }
    }

    /// Sets how levels are chosen. Returns false if there is no such texture.
    pub(crate) fn set_levels(&mut self, texture: TextureNumber, rule: LevelRule) -> bool {
        let Some(Some(state)) = self.textures.get_mut(usize::from(texture.number())) else { return false };
        state.rule = rule.within(&state.description.geometry);
        self.set_record(texture);
        true
    }

    /// How levels are chosen.
    pub(crate) fn rule(&self, texture: TextureNumber) -> Option<LevelRule> {
        Some(self.texture(texture)?.rule)
    }

    /// The id by which shaders know who has a number; 0 where nobody has it.
    pub(super) fn id_in_shaders(&self, number: TextureNumber) -> u32 {
        self.texture(number).map_or(0, |state| state.id)
    }

    /// What the text of a shader is made for that samples a layer or a group; `None` if there is no such.
    pub(crate) fn kinds(&self, sampled: Sampled) -> Option<Kinds> {
        match sampled {
            Sampled::Layer(layer) => Some(Kinds::of(self.kind_of(layer)?, self.mode, self.seen().fade)),
            Sampled::Group(group) => self.kinds_of_group(group).cloned(),
        }
    }

    /// The ids by which shaders know a layer, or a group and its members; `None` if there is no such.
    pub(crate) fn ids(&self, sampled: Sampled) -> Option<Vec<u32>> {
        match sampled {
            Sampled::Layer(layer) => Some(vec![self.shader_id(layer.texture())?]),
            Sampled::Group(group) => self.ids_of_group(group),
        }
    }

    /// The id by which shaders know a texture; `None` if there is no such.
    pub(crate) fn shader_id(&self, texture: TextureId) -> Option<u32> {
        self.has(texture).then(|| self.id_in_shaders(texture.number()))
    }

    /// The text of a shader.
    pub(crate) fn wgsl(&self, kinds: &Kinds) -> String {
        wgsl(kinds, self.binding)
    }

    /// How a layer is sampled; `None` if there is no such layer.
    pub(crate) fn sampling_of(&self, layer: LayerId) -> Option<Sampling> {
        self.texture(layer.number())
            .filter(|_| self.has(layer.texture()))?
            .samplings
            .get(layer.index())
            .copied()
    }

    /// The shader options shared by all pools.
    pub(crate) fn seen(&self) -> PoolShaderOptions {
        PoolShaderOptions {
            mode: self.mode,
            fade: !self.fade.is_zero(),
            unknown: self.unknown,
            filters: self.filters,
        }
    }

    /// The kind of a layer; `None` if there is no such layer.
    pub(crate) fn kind_of(&self, layer: LayerId) -> Option<Kind> {
        let sampling = self.sampling_of(layer)?;
        let pool = self.pool_of(layer.number())?;
        Some(self.pools[usize::from(pool.number())].kind(layer.index(), sampling))
    }

    pub(super) fn pool_of(&self, texture: TextureNumber) -> Option<PoolId> {
        Some(self.texture(texture)?.pool)
    }
}

/// Returns true if a texture has so many pages that its page table is hashed unless something else is asked
/// for.
fn is_large(geometry: &Geometry) -> bool {
    PageNumbering::new(geometry).entries() > TableImage::MOST_ENTRIES
}
