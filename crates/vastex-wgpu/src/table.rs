//! Page tables in GPU memory, and the changes that keep them equal to the CPU's image of them.
//!
//! A frame's changes are carried out by two dispatches: every eviction, then every load. Which entries a change
//! touches, and why the order within either half is of no matter, is told in `vastex-core` at [`TableChange`].

use vastex_core::{
    ChangeRule, Geometry, LevelRule, PagePos, Slot, TableChange, TableEntry, TableLayout, TextureId, shared,
};

use crate::bind::buffer;
use crate::device::{alive, compute_pipelines, dispatch_size, storage, uniform};
use crate::error::GpuError;
use crate::mirror::{Change, ChangesHead, TextureParams};
use crate::shader;

/// Entries that a table has from the beginning, where a level has no more.
const FEW_ENTRIES: u64 = 1024;

/// The page table and the parameters of one texture.
#[derive(Debug)]
pub struct TableBuffers {
    geometry: Geometry,
    texture: TextureId,
    tail_slot: Slot,
    rule: LevelRule,
    /// The finest level with entries.
    finest: u8,
    params: wgpu::Buffer,
    entries: wgpu::Buffer,
    changes: Option<ChangeBuffer>,
}

/// Where changes are sent to, and the bind group that sees them; made anew when it is too small.
#[derive(Debug)]
struct ChangeBuffer {
    buffer: wgpu::Buffer,
    bind_group: wgpu::BindGroup,
}

impl TableBuffers {
    /// A table in which every entry leads to the tail, which lies in `tail_slot`, of a texture without a bias of
    /// its own. It has entries for the coarse levels only, some hundreds; before a finer page is loaded it must
    /// [grow](TableBuffers::grow).
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        geometry: &Geometry,
        texture: TextureId,
        tail_slot: Slot,
    ) -> Result<TableBuffers, GpuError> {
        alive(device)?;
        TableBuffers::check(device, geometry)?;
        let finest = coarse_level(geometry);
        let entries = storage(device, "vastex page table", entry_count(geometry, finest) * 4);
        let rule = LevelRule::default().within(geometry);
        let params = TextureParams::new(geometry, texture, tail_slot, &rule, finest);
        let params = uniform(device, queue, "vastex texture", &params);
        let geometry = geometry.clone();
        let table =
            TableBuffers { geometry, texture, tail_slot, rule, finest, params, entries, changes: None };
        table.lead_to_the_tail(queue);
        Ok(table)
    }

    /// Begins anew, with the tail in `tail_slot`, for all commands submitted after this call; returns the bytes sent.
    pub fn reset(&mut self, queue: &wgpu::Queue, tail_slot: Slot) -> u64 {
        self.tail_slot = tail_slot;
        self.send_params(queue);
        self.lead_to_the_tail(queue);
        self.entries.size()
    }

    /// Whether there are entries for the pages of a level.
    pub fn has_level(&self, level: u8) -> bool {
        level >= self.finest
    }

    /// Makes entries for all levels from `level` on, and begins anew as [`TableBuffers::reset`] does: then whatever is resident is to be
    /// told, and bind groups are to be made anew. Costs 4 bytes for each entry, once for each level at most; returns the bytes sent.
    pub fn grow(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, level: u8) -> Result<u64, GpuError> {
        if self.has_level(level) {
            return Ok(0);
        }
        alive(device)?;
        self.finest = level;
        self.entries = storage(device, "vastex page table", entry_count(&self.geometry, level) * 4);
        self.changes = None; // its bind group names the old entries
        Ok(self.reset(queue, self.tail_slot))
    }

    fn lead_to_the_tail(&self, queue: &wgpu::Queue) {
        let tail = TableEntry::new(self.geometry.tail().first_level(), self.tail_slot).to_bits();
        let entries = vec![tail; (self.entries.size() / 4) as usize];
        queue.write_buffer(&self.entries, 0, bytemuck::cast_slice(&entries));
    }

    /// Sets how levels are chosen, as far as the texture has them, for all commands submitted after this call: sampling
    /// and feedback alike.
    pub fn set_rule(&mut self, queue: &wgpu::Queue, rule: LevelRule) {
        self.rule = rule.within(&self.geometry);
        self.send_params(queue);
    }

    fn send_params(&self, queue: &wgpu::Queue) {
        let params = self.texture_params();
        queue.write_buffer(&self.params, 0, bytemuck::bytes_of(&params));
    }

    /// How levels are chosen.
    pub fn rule(&self) -> LevelRule {
        self.rule
    }

    /// Whether the page table of a texture fits this device; the only thing about a texture that [`TableBuffers::new`] refuses.
    pub fn check(device: &wgpu::Device, geometry: &Geometry) -> Result<(), GpuError> {
        let entries = entry_count(geometry, 0);
        let limits = device.limits();
        let (bytes, max) = (entries * 4, limits.max_storage_buffer_binding_size.min(limits.max_buffer_size));
        if bytes > max { Err(GpuError::TableTooLarge { entries, bytes, max }) } else { Ok(()) }
    }

    /// The entries, one `u32` each ([`TableEntry::to_bits`]) in the order of [`TableLayout`]; can be copied from.
    pub fn entries(&self) -> &wgpu::Buffer {
        &self.entries
    }

    /// GPU memory of the table and the parameters; what changes are sent through comes on top.
    pub fn bytes(&self) -> u64 {
        self.entries.size() + self.params.size()
    }

    /// What of its parameters may change.
    pub(crate) fn changeable(&self) -> (LevelRule, Slot, u8) {
        (self.rule, self.tail_slot, self.finest)
    }

    pub(crate) fn texture_params(&self) -> TextureParams {
        TextureParams::new(&self.geometry, self.texture, self.tail_slot, &self.rule, self.finest)
    }

    pub(crate) fn params(&self) -> &wgpu::Buffer {
        &self.params
    }
}

/// Entries of a texture's table from a level on. A binding is never empty, so a texture that is all tail has one that nobody reads.
fn entry_count(geometry: &Geometry, finest: u8) -> u64 {
    let layout = TableLayout::new(geometry);
    let finer = if finest < geometry.tail().first_level() { layout.first_entry(finest) } else { 0 };
    (layout.entries() - finer).max(1)
}

/// The finest level that a table begins with: one of few entries.
fn coarse_level(geometry: &Geometry) -> u8 {
    let finer_than_tail = 0..geometry.tail().first_level();
    let few = finer_than_tail.clone().find(|&level| entry_count(geometry, level) <= FEW_ENTRIES);
    few.or(finer_than_tail.last()).unwrap_or(0)
}

/// Carries out changes of page tables; one for all of a device's.
#[derive(Debug)]
pub struct TableChanger {
    layout: wgpu::BindGroupLayout,
    evict: wgpu::ComputePipeline,
    load: wgpu::ComputePipeline,
}

impl TableChanger {
    /// Compiles the shader.
    pub fn new(device: &wgpu::Device) -> TableChanger {
        let bindings = [
            buffer(wgpu::BufferBindingType::Storage { read_only: false }),
            buffer(wgpu::BufferBindingType::Storage { read_only: true }),
            buffer(wgpu::BufferBindingType::Uniform),
        ];
        let text = shader::table_wgsl();
        let (layout, [evict, load]) =
            compute_pipelines(device, "vastex table changes", text, &bindings, ["evict", "load"]);
        TableChanger { layout, evict, load }
    }

    /// Carries out the changes of one texture in one frame, evictions before loads, and returns the bytes sent: 24
    /// for each change and 16 more. Commands recorded later in the encoder see the new table.
    ///
    /// At most once per table and submission: what is sent takes the place of what was sent before.
    pub fn apply(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        table: &mut TableBuffers,
        changes: &[TableChange],
    ) -> Result<u64, GpuError> {
        if changes.is_empty() {
            return Ok(0);
        }
        let batch = Batch::new(&table.geometry, table.finest, changes);
        let bytes = batch.bytes();
        let sent = bytes.len() as u64;
        let room = match table.changes.take() {
            Some(room) if room.buffer.size() >= sent => room,
            _ => {
                alive(device)?;
                self.change_buffer(device, table, sent.next_power_of_two())
            }
        };
        queue.write_buffer(&room.buffer, 0, &bytes);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("vastex table changes"),
            timestamp_writes: None,
        });
        pass.set_bind_group(0, &room.bind_group, &[]);
        for (pipeline, chunks) in
            [(&self.evict, batch.head.eviction_chunks), (&self.load, batch.head.load_chunks)]
        {
            let [x, y] = dispatch_size(chunks);
            pass.set_pipeline(pipeline);
            pass.dispatch_workgroups(x, y, 1);
        }
        table.changes = Some(room);
        Ok(sent)
    }

    fn change_buffer(&self, device: &wgpu::Device, table: &TableBuffers, size: u64) -> ChangeBuffer {
        let buffer = storage(device, "vastex table changes", size);
        let resources =
            [table.entries.as_entire_binding(), buffer.as_entire_binding(), table.params.as_entire_binding()];
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("vastex table changes"),
            layout: &self.layout,
            entries: &entries,
        });
        ChangeBuffer { buffer, bind_group }
    }
}

/// The changes of one frame as the shader reads them.
struct Batch {
    head: ChangesHead,
    changes: Vec<Change>,
}

impl Batch {
    fn new(geometry: &Geometry, finest: u8, changes: &[TableChange]) -> Batch {
        let mut sorted = Vec::with_capacity(changes.len());
        let mut half = |is_half: fn(&ChangeRule) -> bool| {
            let (first, mut chunks) = (sorted.len(), 0);
            for change in changes.iter().filter(|change| is_half(&change.rule)) {
                let pos = change.page.pos(geometry.dims());
                sorted.push(record(change, pos, chunks));
                chunks += entries_below(geometry, pos.level, finest).div_ceil(shared::WORKGROUP);
            }
            ((sorted.len() - first) as u32, chunks)
        };
        let (evictions, eviction_chunks) = half(|rule| matches!(rule, ChangeRule::Naming(_)));
        let (loads, load_chunks) = half(|rule| matches!(rule, ChangeRule::Coarser));
        Batch { head: ChangesHead { evictions, loads, eviction_chunks, load_chunks }, changes: sorted }
    }

    fn bytes(&self) -> Vec<u8> {
        [bytemuck::bytes_of(&self.head), bytemuck::cast_slice(&self.changes)].concat()
    }
}

fn record(change: &TableChange, pos: PagePos, first_chunk: u32) -> Change {
    let old = match change.rule {
        ChangeRule::Naming(old) => old.to_bits(),
        ChangeRule::Coarser => 0,
    };
    Change { x: pos.x, y: pos.y, z: pos.z, old, entry: change.entry.to_bits(), first_chunk }
}

/// Entries that the shader walks for a page of `level`: the page's own, and of each finer level as many as any page
/// has there, from the level `finest` on. Never more than the table has.
fn entries_below(geometry: &Geometry, level: u8, finest: u8) -> u32 {
    let page = geometry.level(level);
    let boxes = geometry.levels().get(usize::from(finest)..=usize::from(level)).unwrap_or_default().iter();
    boxes
        .map(|at| {
            (0..3).map(|a| (page.scale[a] / at.scale[a]).min(u64::from(at.pages[a]))).product::<u64>() as u32
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastex_core::sim::{Knobs, Path, World};

    /// At most twice the changed entries' own bytes and 64 for each page loaded or evicted, whichever way the camera goes.
    #[test]
    fn what_is_sent_is_in_proportion_to_what_changes() {
        for path in Path::ALL {
            let knobs = Knobs { slots: 250, ..Knobs::new(path, 1) };
            let geometry = Geometry::new(knobs.spec).unwrap();
            let mut world = World::new(knobs).unwrap();
            let mut moved = 0;
            for _ in 0..200 {
                world.step().unwrap();
                let changes = world.table_changes();
                if changes.is_empty() {
                    continue;
                }
                let sent = Batch::new(&geometry, 0, changes).bytes().len() as u64;
                let (entries, pages) = (4 * world.entries_changed, changes.len() as u64);
                assert!(
                    sent <= 2 * entries + 64 * pages,
                    "{path:?}: {sent} bytes for {entries} of entries and {pages} pages"
                );
                assert!(sent <= 40 * pages, "{path:?}: {sent} bytes for {pages} pages");
                moved += pages;
            }
            assert!(moved > 50, "{path:?}: {moved} pages came and went");
        }
    }
}
