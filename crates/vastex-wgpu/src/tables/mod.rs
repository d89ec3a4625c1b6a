//! The page tables of one pool, in one piece of GPU memory, and the array of records that says where each
//! texture's lie.
//!
//! # What a shader sees
//!
//! | binding | with storage buffers | without ([`FeedbackMode::Raw`]) | module, its functions |
//! |---|---|---|---|
//! | table of a direct pool | `var<storage, read> vastexi_table_POOL: array<u32>` | `texture_2d<u32>`, r32uint | arena_buffer / arena_texture: `vastexi_table_word_POOL(index)`, `vastexi_table_length_POOL()` |
//! | table of a hashed pool | the same | the same | the same, and hashed_pool: `vastexi_hashed_page_POOL(page: vec2<u32>)`, the whole id, low and high half |
//! | records | `texture_2d<u32>`, rgba32uint, one row a number | the same | param: `vastexi_param(number, n)` |
//!
//! Of a direct table a record holds `first_entry` for each level finer than the tail:
//! [`Placement::first_entry`], absolute in the arena, or `0xffffffff` (VASTEXI_NONE) where the level has no
//! entries yet. **The rule of a lookup**: take level `max(wanted, finest)` ([`Placement::finest`]), and the
//! tail where that is not finer. What was recorded with an arena that has moved since sees a shorter one than
//! [`Placement::least_length`], and takes the level of [`Placement::finest_in`] in the place of the finest.
//! The entry is at `first_entry + (page.z * pages.y + page.y) * pages.x + page.x`.
//!
//! A hashed table needs nothing of the record: how many buckets it has, and its seed, follow from its length,
//! so that they change together with it, and nothing of it stands in a uniform. `vastexi_hashed_page_POOL`
//! gives an entry or VASTEXI_NONE; the caller goes up the levels.
//!
//! A number beyond the last row has no record, and a record may be of another id with the same number:
//! shaders take the texture for unknown in both cases, since what they read has another id.
//!
//! # What a frame does
//!
//! ```text
//! tables.add(texture, &geometry, tail_slot)?;          // CPU only: what it needs is recorded by the next `apply`
//! tables.remove(texture);                              // CPU only; set its record to a stale one as well
//! // once per update, for every pool, whether it has changes or not:
//! let applied = tables.apply(&changer, device, queue, encoder, &changes_of_this_pool, &mut resident, &mut budget)?;
//! for texture in applied.placed { params.set(texture, &record(texture, tables.placement(texture))) }
//! let written = params.write(device, encoder)?;        // after all pools
//! queue.submit(..);
//! tables.submitted(); params.submitted();              // for every pool
//! // where `applied.moved` (this pool) or `written.moved` (all pools): bind groups anew, `revision` is another
//! ```
//!
//! Where `submitted` was not called after an `apply` (another step failed, and the commands were dropped) the
//! next one writes everything anew, from what `resident` gives for each texture; nothing is to be remembered
//! outside.
//!
//! Records and tables change in the same submission and are read when commands execute. So what was recorded
//! ahead needs no new bind group when a table grows within its arena, and the range of a removed texture may
//! be used again at once. When an arena, a hash table or the records move to larger memory, what they lay in
//! before takes the same changes for [`RECORDED_AHEAD`] updates, that of the move included.

mod batch;
mod changer;
mod direct;
mod directory;
mod hashed;
mod word_texture;

use std::collections::{BTreeMap, BTreeSet};

use vastex_core::{Geometry, HashedTable, Slot, TableChange, TextureNumber, shader_constants};

pub use self::changer::PoolTableChanger;
use self::direct::DirectTables;
use self::directory::full_entries;
use self::hashed::HashedTables;
use crate::error::GpuError;
use crate::feedback_mode::FeedbackMode;

pub(crate) use self::changer::Before;

/// How many updates may lie between the recording of commands and their submission.
pub const RECORDED_AHEAD: u8 = 2;

/// Where the entries of a texture's direct table lie in its pool's arena.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Placement {
    /// Finest level that has entries; the tail's first where none has. 0 of a hashed table.
    pub finest: u8,
    /// Where to look in an arena that is shorter than [`Placement::least_length`]: entries of an arena, a
    /// power of two, and the finest level from which on all lies in one of that length. The first is for the
    /// longest of the arenas that commands may still see, the second for the shortest, and for whatever is
    /// shorter than the first.
    pub(crate) former: [(u32, u8); FORMER],
    /// Entries of the arena up to the end of the last range.
    end: u32,
    first_entry: [u32; shader_constants::MAX_LEVELS as usize],
}

/// Arenas that commands may still see beside the one in which the tables lie, as far as a record tells them
/// apart.
const FORMER: usize = 2;

impl Placement {
    /// Stands for the first entry of a level without entries.
    pub const NONE: u32 = u32::MAX;

    /// First entry of a level, absolute in the arena, or [`Placement::NONE`]: of the tail's levels, of those
    /// that have no entries yet, and of hashed tables.
    pub fn first_entry(&self, level: u8) -> u32 {
        self.first_entry.get(usize::from(level)).copied().unwrap_or(Placement::NONE)
    }

    /// Entries of the shortest arena that has those of all levels from the finest on: a power of two.
    pub fn least_length(&self) -> u32 {
        self.end.max(1).next_power_of_two()
    }

    /// The finest level that a shader looks up in an arena of so many entries; the tail's first where it
    /// looks up none.
    pub fn finest_in(&self, length: u32) -> u8 {
        let [(longer, of_longer), (_, of_others)] = self.former;
        match length {
            _ if length >= self.least_length() => self.finest,
            _ if length >= longer => of_longer,
            _ => of_others,
        }
    }

    /// Of what has no direct table. `level` is the first of the tail, to which a lookup leads then; of a
    /// hashed table it says nothing.
    pub(crate) fn without_entries(level: u8) -> Placement {
        let first_entry = [Placement::NONE; shader_constants::MAX_LEVELS as usize];
        Placement { finest: level, former: [(1, level); FORMER], end: 0, first_entry }
    }
}

/// Gives the changes that load what is resident of a texture now, this frame's included
/// ([`vastex_core::PoolPager::resident_changes`]).
pub type Resident<'a> = dyn FnMut(TextureNumber, &mut Vec<TableChange>) + 'a;

/// The page tables of all textures of a pool: all direct, in one arena, or all hashed, as one hash table.
#[derive(Debug)]
pub struct PoolTables {
    kind: Kind,
    /// Since the last [`PoolTables::submitted`] nothing was written that may have been lost.
    is_submitted: bool,
}

#[derive(Debug)]
enum Kind {
    Direct(DirectTables),
    Hashed { tables: HashedTables, textures: BTreeMap<TextureNumber, IsNew>, anew: BTreeSet<TextureNumber> },
}

/// True if nobody has been told of a texture's placement.
type IsNew = bool;

/// What a [`PoolTables::apply`] has done.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PoolApplied {
    /// Bytes sent to the GPU.
    pub bytes: u64,
    /// True if [`PoolTables::binding`] is another: bind groups are to be made anew after the submission.
    pub moved: bool,
    /// Textures whose [`Placement`] may be another: their records are to be set before these commands are
    /// submitted.
    pub placed: Vec<TextureNumber>,
}

impl PoolTables {
    /// Tables with an entry for each page. Costs 4 KiB of GPU memory; on a device without storage buffers 8
    /// KiB.
    pub fn direct(device: &wgpu::Device, mode: FeedbackMode) -> Result<PoolTables, GpuError> {
        Ok(PoolTables { kind: Kind::Direct(DirectTables::new(device, mode)?), is_submitted: true })
    }

    /// Tables of what is resident in a pool of so many slots. Costs 48 bytes of GPU memory for each slot,
    /// rounded up to a power of two of slots; 12 KiB at least.
    pub fn hashed(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        mode: FeedbackMode,
        slots: u32,
    ) -> Result<PoolTables, GpuError> {
        let tables = HashedTables::new(device, queue, mode, slots)?;
        let kind = Kind::Hashed { tables, textures: BTreeMap::new(), anew: BTreeSet::new() };
        Ok(PoolTables { kind, is_submitted: true })
    }

    /// Returns true if the pool's tables are hashed.
    pub fn is_hashed(&self) -> bool {
        matches!(self.kind, Kind::Hashed { .. })
    }

    /// Entries of the largest arena that a device allows, a power of two: 32 Mi with WebGPU's limits, 4 Mi
    /// with those of WebGL 2.
    pub fn most_entries(device: &wgpu::Device, mode: FeedbackMode) -> u64 {
        DirectTables::most_entries(device, mode)
    }

    /// Entries that a direct table takes in an arena with all of its levels: of each level a power of two, so
    /// up to twice as many as it has pages. 0 where everything is tail.
    pub fn full_entries(geometry: &Geometry) -> u64 {
        full_entries(geometry)
    }

    /// Returns true if a texture's table fits at its full size beside those that are there, at theirs. A
    /// hashed one always does.
    pub fn has_room(&self, geometry: &Geometry) -> bool {
        match &self.kind {
            Kind::Direct(tables) => full_entries(geometry) <= tables.directory.room(),
            Kind::Hashed { .. } => true,
        }
    }

    /// Takes in the table of a texture, in which every entry leads to the tail, which lies in `tail_slot`. A
    /// direct one has entries for coarse levels only, 128 at most. The GPU hears of it with the next
    /// [`PoolTables::apply`].
    ///
    /// Fails, and changes nothing, where there is no [room](PoolTables::has_room).
    pub fn add(
        &mut self,
        texture: TextureNumber,
        geometry: &Geometry,
        tail_slot: Slot,
    ) -> Result<(), GpuError> {
        match &mut self.kind {
            Kind::Direct(DirectTables { directory, .. }) => {
                let (entries, room) = (full_entries(geometry), directory.room());
                match directory.add(texture, geometry, tail_slot) {
                    true => Ok(()),
                    false => Err(GpuError::TableTooLarge { entries, bytes: entries * 4, max: room * 4 }),
                }
            }
            Kind::Hashed { tables, textures, .. } => {
                tables.remove(texture);
                textures.insert(texture, true);
                Ok(())
            }
        }
    }

    /// Forgets a texture; the entries that it had may be another's from the next [`PoolTables::apply`] on. So
    /// its record must be another by then, with which shaders look up nothing. Costs a visit of each bucket
    /// of a hashed table, else nothing to speak of.
    pub fn remove(&mut self, texture: TextureNumber) {
        match &mut self.kind {
            Kind::Direct(tables) => tables.directory.remove(texture),
            Kind::Hashed { tables, textures, anew } => {
                tables.remove(texture);
                textures.remove(&texture);
                anew.remove(&texture);
            }
        }
    }

    /// Lets the table of a texture be written anew by the next [`PoolTables::apply`], with what is resident
    /// by then, and with its tail in `tail_slot`.
    pub fn begin_anew(&mut self, texture: TextureNumber, tail_slot: Slot) {
        match &mut self.kind {
            Kind::Direct(tables) => tables.directory.begin_anew(texture, tail_slot),
            Kind::Hashed { textures, anew, .. } => {
                if let Some(is_new) = textures.get_mut(&texture) {
                    *is_new = true;
                    anew.insert(texture);
                }
            }
        }
    }

    /// Where a texture's entries lie once the commands of the last [`PoolTables::apply`] are done. To be
    /// asked for before [`PoolTables::submitted`] where shaders are to be told: the arenas that are followed
    /// are those of that submission.
    pub fn placement(&self, texture: TextureNumber) -> Placement {
        match &self.kind {
            Kind::Direct(tables) => tables.placement(texture),
            Kind::Hashed { .. } => Placement::without_entries(0),
        }
    }

    /// Records what keeps the tables true: the changes of all textures of the pool in a frame, in the order
    /// in which they were decided, so that those of a texture are in sequence. Commands recorded later in the
    /// encoder see the new tables.
    ///
    /// A table to which a page of a finer level comes than it has grows by itself: its new entries are filled
    /// on the GPU, and are told what is `resident`; on a device without storage buffers they are sent, by and
    /// by, coarse levels first, no more in a frame than `budget` bytes of all pools, from which they are
    /// taken, and are looked up level by level.
    ///
    /// To be called once per submission, with or without changes, and [`PoolTables::submitted`] after that.
    /// Of a direct table it sends 32 bytes for each change, 28 for each level of each texture that changes
    /// and 32 more, whatever a change covers; of a hashed one 16 for each bucket that is another now, or all
    /// of it where it has grown; of either in a texture the pieces of 64 words in which something is other.
    #[expect(clippy::too_many_arguments, reason = "the device's three, and what a frame brings")]
    pub fn apply(
        &mut self,
        changer: &PoolTableChanger,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        changes: &[TableChange],
        resident: &mut Resident<'_>,
        budget: &mut u64,
    ) -> Result<PoolApplied, GpuError> {
        let is_anew = !std::mem::replace(&mut self.is_submitted, false);
        let mut changes = changes.to_vec();
        // A stable order: what was decided of one texture stays in sequence.
        changes.sort_by_key(|change| change.page.texture());
        match &mut self.kind {
            Kind::Direct(tables) => {
                tables.apply(changer, device, queue, encoder, &changes, resident, budget, is_anew)
            }
            Kind::Hashed { tables, textures, anew } => {
                if is_anew {
                    tables.forget_all();
                    anew.extend(textures.keys());
                    textures.values_mut().for_each(|is_new| *is_new = true);
                }
                changes.retain(|change| !anew.contains(&change.page.texture()));
                for texture in std::mem::take(anew) {
                    let mut loads = Vec::new();
                    resident(texture, &mut loads);
                    tables.begin_anew(texture, &loads);
                }
                let bytes = tables.apply(changer, device, queue, encoder, &changes, is_anew)?;
                let placed =
                    textures.iter_mut().filter_map(|(&of, is_new)| std::mem::take(is_new).then_some(of));
                Ok(PoolApplied { bytes, moved: tables.is_moved(), placed: placed.collect() })
            }
        }
    }

    /// The commands of the last [`PoolTables::apply`] were submitted.
    pub fn submitted(&mut self) {
        if !self.is_submitted {
            self.submitted_between();
            match &mut self.kind {
                Kind::Direct(tables) => tables.count_update(),
                Kind::Hashed { tables, .. } => tables.count_update(),
            }
        }
    }

    /// The commands of the last [`PoolTables::apply`] were submitted between two updates, which none of those
    /// counts that may lie between the recording of commands and their submission.
    pub fn submitted_between(&mut self) {
        self.is_submitted = true;
        match &mut self.kind {
            Kind::Direct(tables) => tables.submitted(),
            Kind::Hashed { tables, .. } => tables.submitted(),
        }
    }

    /// Nothing of what was decided since the last submission has come: the next [`PoolTables::apply`] begins
    /// anew with what is resident.
    pub fn lost(&mut self) {
        self.is_submitted = false;
    }

    /// Returns true if no levels are left that are still to be sent, a part in each frame.
    pub fn is_settled(&self) -> bool {
        match &self.kind {
            Kind::Direct(tables) => tables.is_settled(),
            Kind::Hashed { .. } => true,
        }
    }

    /// What shaders bind. Another after an [`PoolTables::apply`] that says so.
    pub fn binding(&self) -> wgpu::BindingResource<'_> {
        match &self.kind {
            Kind::Direct(tables) => tables.binding(),
            Kind::Hashed { tables, .. } => tables.binding(),
        }
    }

    /// The buffer of [`PoolTables::binding`], if it is one. Can be copied from.
    pub fn buffer(&self) -> Option<&wgpu::Buffer> {
        match &self.kind {
            Kind::Direct(tables) => tables.buffer(),
            Kind::Hashed { tables, .. } => tables.buffer(),
        }
    }

    /// The texture of [`PoolTables::binding`], if it is one. Can be copied from.
    pub fn texture(&self) -> Option<&wgpu::Texture> {
        match &self.kind {
            Kind::Direct(tables) => tables.texture(),
            Kind::Hashed { tables, .. } => tables.texture(),
        }
    }

    /// The hash table that the GPU has a copy of, where tables are hashed.
    pub fn hash_table(&self) -> Option<&HashedTable> {
        match &self.kind {
            Kind::Direct(_) => None,
            Kind::Hashed { tables, .. } => Some(tables.table()),
        }
    }

    /// GPU memory in bytes of the tables, and of the old ones while commands recorded before may read them;
    /// buffers for changes come on top.
    pub fn bytes(&self) -> u64 {
        match &self.kind {
            Kind::Direct(tables) => tables.bytes(),
            Kind::Hashed { tables, .. } => tables.bytes(),
        }
    }
}
