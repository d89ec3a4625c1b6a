//! How textures come and go.

use std::sync::Arc;

use vastex_core::{Description, Dims, Event, Layer, PoolId, TextureNumber, VoxelLevels};
use vastex_tiles::TileSource;
use vastex_wgpu::MOST_UNALIGNED_LEVELS;

use super::Textures;
use crate::error::Error;
use crate::gpu::{PoolState, Shape};
use crate::ids::{Sampled, TextureId};
use crate::paging::PagedTexture;
use crate::settings::{Sampling, TextureSettings};
use crate::sources::{Prepared, PreparedParts, Preparer};

/// Why a texture was not added, and what was prepared of it.
#[derive(Debug)]
pub struct AddError {
    /// What failed.
    pub error: Error,
    /// The texture, to be added again or elsewhere.
    pub prepared: Prepared,
}

impl std::fmt::Display for AddError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.error.fmt(f)
    }
}

impl std::error::Error for AddError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.error.source()
    }
}

/// Fails where voxels are not those of this texture, or have no room in a record.
fn check_voxels(settings: &TextureSettings, held: &Description) -> Result<(), Error> {
    let Some(voxels) = &settings.voxels else { return Ok(()) };
    let (levels, of) = (held.geometry.levels().len(), voxels.levels());
    let is_aligned = of.iter().all(|level| level.is_aligned);
    match of.len() == levels && (is_aligned || levels <= MOST_UNALIGNED_LEVELS) {
        true => Ok(()),
        false => Err(Error::Voxels { levels, voxels: of.len(), most: MOST_UNALIGNED_LEVELS }),
    }
}

impl From<AddError> for Error {
    fn from(failed: AddError) -> Error {
        failed.error
    }
}

impl Textures {
    /// A reader of textures for [`Textures::add`], on any thread. It may be made once and kept; a
    /// [`Preparer`] that was made before [`Memory::restore`](crate::Memory::restore) stays usable if both
    /// devices can hold the same.
    pub fn preparer(&self) -> Preparer {
        Preparer::new(self.gpu.device(), self.gpu.queue(), &self.settings, self.paging.ram())
    }

    /// Adds a texture that [`Textures::preparer`] has read: makes a pool if none suits it, and its page
    /// table. Neither reads nor waits.
    ///
    /// The next [`Textures::update`] sends the texture's coarsest levels, together with the page tables of
    /// the textures that make room for it; until then pictures are as they were, and the texture must not be
    /// drawn. If an add fails, nothing has changed, and the error gives back what was prepared: if it was for
    /// other settings ([`Error::OtherSettings`]), prepare it again; if the device is lost, add it after
    /// [`Memory::restore`](crate::Memory::restore). Bind groups may be replaced, as [`Textures::bind_group`]
    /// says.
    ///
    /// Costs the beginning of a page table, which grows to 4 to 8 bytes for each page of the levels that are
    /// wanted. A texture of more than 4 Mi pages has none of its own: such textures share their pool's hash
    /// table, of 48 bytes a slot. Layers that the device cannot decompress are decoded when they are loaded,
    /// and take as much of the pool as their texels.
    pub fn add(&mut self, prepared: Prepared) -> Result<TextureId, AddError> {
        self.add_prepared(&prepared).map_err(|error| AddError { error, prepared })
    }

    /// Adds a volume that [`Textures::preparer`] has read: as [`Textures::add`], for who marches through it
    /// or cuts slices of it, and so would find out in a shader that it has two axes. That is refused here
    /// ([`Error::NoVolume`]). Where voxels are no cubes, or levels do not halve, the texture is prepared with
    /// [`TextureSettings::voxels`] of its source.
    ///
    /// ```no_run
    /// # use std::sync::Arc;
    /// # use vastex::{Error, TextureId, TextureSettings, Textures, TileSource, VoxelLevels};
    /// # fn add(
    /// #     textures: &mut Textures,
    /// #     source: Arc<dyn TileSource>,
    /// #     levels: &Arc<VoxelLevels>,
    /// # ) -> Result<TextureId, Error> {
    /// // With `source`, a `vastex_volume::VolumeSource`, and `levels`, its `VolumeSource::levels`:
    /// let settings = TextureSettings { voxels: Some(levels.clone()), ..TextureSettings::default() };
    /// let prepared = textures.preparer().read_blocking(source, settings)?;
    /// let scan = textures.add_volume(prepared)?;
    /// # Ok(scan) }
    /// ```
    pub fn add_volume(&mut self, prepared: Prepared) -> Result<TextureId, AddError> {
        let geometry = &prepared.description().geometry;
        let [width, height, _] = geometry.size();
        match geometry.dims() {
            Dims::D3 => self.add(prepared),
            Dims::D2 => Err(AddError { error: Error::NoVolume { size: [width, height] }, prepared }),
        }
    }

    /// Prepares and adds a texture at once, for tools and for programs that have nothing to draw meanwhile:
    /// waits for the source, no longer than [`Settings::read_time_out`](crate::Settings::read_time_out)
    /// ([`Error::TailOverdue`]), or than that for each further page of a texture that is held whole
    /// ([`Settings::whole_bytes`](crate::Settings::whole_bytes)). In a browser, where nothing may be waited
    /// for, the source must give the tail without waiting ([`Error::TailPending`]), and no texture is held
    /// whole.
    ///
    /// An overdue read that blocks its thread keeps that thread, and the source, until it comes back: each
    /// further call for a source that does not answer begins one more, so let some time pass between two. For
    /// a texture with settings of its own: [`Preparer::read_blocking`], then [`Textures::add`].
    pub fn add_blocking(&mut self, source: Arc<dyn TileSource>) -> Result<TextureId, Error> {
        let prepared = self.preparer().read_blocking(source, TextureSettings::default())?;
        self.add_prepared(&prepared)
    }

    fn add_prepared(&mut self, prepared: &Prepared) -> Result<TextureId, Error> {
        // Whatever can be refused is refused before anything changes.
        if !prepared.is_by(&self.preparer()) {
            return Err(Error::OtherSettings);
        }
        self.gpu.check_device()?;
        let PreparedParts { settings, stored, held, is_whole, source, tail } =
            prepared.parts(self.paging.ram());
        check_voxels(&settings, &held)?;
        let tables = self.gpu.table_kind(&held, settings.page_table)?;
        self.paging.check_free_number()?;
        let sampling = |layer: &Layer| settings.sampling(layer, self.settings.filter);
        let samplings: Vec<Sampling> = held.layers.iter().map(sampling).collect();
        let shape = Shape::of(&held, tables);
        let pool = match is_whole {
            true => self.pool_of_whole(&stored, &held, shape)?,
            false => self.pool_for(&stored, &held, &shape)?,
        };
        let (source, flight_bytes) = self.gpu.staged(pool, source);
        if let Some(bytes) = flight_bytes {
            self.paging.set_flight_bytes(pool, bytes);
        }
        self.add_to(pool, PagedTexture { description: stored, source, tail }, samplings, settings.voxels)
    }

    /// The pool for textures like this that are held whole, with room for one more: twice as much as it had
    /// where it is full.
    fn pool_of_whole(
        &mut self,
        stored: &Arc<Description>,
        held: &Arc<Description>,
        shape: Shape,
    ) -> Result<PoolId, Error> {
        if let Some(pool) = self.gpu.whole_pool(&shape)? {
            let slots = &self.gpu.pools()[usize::from(pool.number())].slots;
            let (count, bytes) = (slots.slots(), slots.bytes());
            if self.paging.pager().pool(pool).stats().tails >= count {
                self.resize_to(pool, 2 * bytes)?;
            }
            return Ok(pool);
        }
        let (device, queue) = (self.gpu.device(), self.gpu.queue());
        let pool = PoolState::of_one(device, queue, self.gpu.seen(), stored, held, shape)?;
        let id = self.paging.add_pool(&pool.slots, None)?;
        self.gpu.push_pool(pool);
        Ok(id)
    }

    /// The pool for textures that the device holds like `held`, a new one where there is none.
    fn pool_for(
        &mut self,
        stored: &Arc<Description>,
        held: &Arc<Description>,
        shape: &Shape,
    ) -> Result<PoolId, Error> {
        if let Some(pool) = self.gpu.pool_of_shape(shape)? {
            return Ok(pool);
        }
        let plan = self.settings.pools.plan(stored, held, self.settings.picture);
        let (device, queue) = (self.gpu.device(), self.gpu.queue());
        let (pool, is_reduced) =
            PoolState::new(device, queue, self.gpu.seen(), plan.bytes, stored, held, shape)?;
        let id = self.paging.add_pool(&pool.slots, plan.mip_bias)?;
        self.paging.set_pin_share(id, plan.pin_share);
        let (asked, bytes) = (plan.bytes, pool.slots.bytes());
        if is_reduced {
            tracing::warn!(tiles = %pool.tiles, asked, bytes, "the device has no memory for a pool of this size");
            self.paging.report(Event::PoolReduced { pool: id, asked, bytes });
        }
        self.gpu.push_pool(pool);
        Ok(id)
    }

    fn add_to(
        &mut self,
        pool: PoolId,
        texture: PagedTexture,
        samplings: Vec<Sampling>,
        voxels: Option<Arc<VoxelLevels>>,
    ) -> Result<TextureId, Error> {
        let (description, tail) = (texture.description.clone(), texture.tail.clone());
        let (texture, slot) = self.paging.add_texture(pool, texture, self.settings.share_contents)?;
        let added = self.gpu.add_texture((pool, slot), texture, (&description, voxels), &tail, samplings);
        if let Err(error) = added {
            self.remove_texture(texture);
            return Err(error);
        }
        self.paging.open_source(texture);
        Ok(TextureId::new(texture, self.gpu.generation(texture)))
    }

    /// Removes a texture, or a group. Returns true if there was one.
    ///
    /// A texture's tiles leave the pool, its loads are cancelled, and its page table, its part of the RAM
    /// cache and, if it was the last of its pool, the pool's memory are freed, as soon as the GPU and the
    /// loader are done with them. Groups that contain it are removed, too ([`Event::GroupRemoved`]); the
    /// members of a removed group stay. Bind groups may be replaced, as [`Textures::bind_group`] says;
    /// pipelines stay valid. Nothing may be recorded from then on with kept bind groups of the texture, and
    /// its id names nothing any more, in shaders neither, whatever is added later.
    pub fn remove(&mut self, sampled: impl Into<Sampled>) -> bool {
        match sampled.into() {
            Sampled::Group(group) => self.gpu.has_group(group) && self.remove_group(group.number()),
            Sampled::Layer(layer) => self.gpu.has(layer.texture()) && self.remove_texture(layer.number()),
        }
    }

    fn remove_texture(&mut self, texture: TextureNumber) -> bool {
        let Some(pool) = self.pool_of(texture) else { return false };
        self.remove_groups_of(texture);
        self.cpu.remove(texture);
        let tiers = self.paging.remove_texture(texture);
        self.watch.note_gone(texture, pool, tiers);
        self.gpu.remove_texture(texture, pool, self.paging.pager());
        true
    }
}
