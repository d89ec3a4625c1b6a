//! The changes that keep page tables in GPU memory equal to the CPU's image of them.
//!
//! Those of a direct table are carried out by two dispatches: every eviction, then every load. Which entries a change
//! touches, and why the order within either half is of no matter, is told in `vastex-core` at [`TableChange`]. A hashed table
//! changes on the CPU, and one dispatch writes the places that are others now. Tables in textures change on the CPU, too
//! (`table_texture`).

use vastex_core::{ChangeRule, Geometry, HashedTable, PagePos, Slot, TableChange, shader_constants};

use crate::bind::buffer;
use crate::device::{alive, compute_pipelines, dispatch_size, storage};
use crate::error::GpuError;
use crate::mirror::{Change, ChangesHead, Written, WrittenHead};
use crate::shader;
use crate::table::{Kind, TableBuffers};
use crate::way::FeedbackWay;

/// Bytes of a buffer for changes at least.
const LEAST_ROOM: u64 = 1024;

/// Where changes are sent to, and the bind group that sees them; made anew when it is too small.
#[derive(Debug)]
pub(crate) struct ChangeBuffer {
    buffer: wgpu::Buffer,
    bind_group: wgpu::BindGroup,
}

/// What carrying out changes has done.
#[derive(Debug, Default)]
pub struct Applied {
    /// Bytes sent to the GPU.
    pub bytes: u64,
    /// The table as it lay before, if it has moved: its bind groups are then to be made anew. It has these changes already. What was recorded
    /// with the old bind groups stays right for as long as the old table [follows](TableChanger::follow).
    pub before: Option<Box<TableBuffers>>,
}

impl Applied {
    fn sent(bytes: u64) -> Applied {
        Applied { bytes, before: None }
    }
}

/// Carries out changes of page tables; one for all of a device's.
#[derive(Debug)]
pub struct TableChanger {
    /// For tables in buffers.
    pipelines: Option<Pipelines>,
}

#[derive(Debug)]
struct Pipelines {
    layout: wgpu::BindGroupLayout,
    fill: wgpu::ComputePipeline,
    evict: wgpu::ComputePipeline,
    load: wgpu::ComputePipeline,
    write: wgpu::ComputePipeline,
}

impl TableChanger {
    /// Compiles the shader, where the way has one.
    pub fn new(device: &wgpu::Device, way: FeedbackWay) -> TableChanger {
        TableChanger { pipelines: (way != FeedbackWay::Raw).then(|| Pipelines::new(device)) }
    }

    /// Carries out the changes of one texture in one frame, evictions before loads. To a direct table it sends 24 bytes
    /// for each change and 16 more; to a hashed one 16 for each place that is another now and 16 more, or all of it where it has
    /// grown or shrunk; to either in a texture the rows in which something is other. Commands recorded later in the encoder see
    /// the new table, which is one made for the changer's way.
    ///
    /// At most once per table and submission: what is sent takes the place of what was sent before.
    pub fn apply(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        table: &mut TableBuffers,
        changes: &[TableChange],
    ) -> Result<Applied, GpuError> {
        match &self.pipelines {
            _ if changes.is_empty() => Ok(Applied::default()),
            Some(pipelines) => pipelines.apply(device, queue, encoder, table, changes),
            None => table.apply_in_texture(device, queue, encoder, changes),
        }
    }

    /// Makes entries for all levels of a table from `level` on, where it has fewer, after `changes`: it begins anew elsewhere, and is told
    /// what is `resident`. Bind groups are to be made anew.
    ///
    /// Costs 4 bytes of memory for each entry, filled on the GPU. A table in a texture only begins to grow, see
    /// [`TableChanger::go_on`]. Where it fails the table is to begin anew ([`TableChanger::begin_anew`]).
    #[expect(clippy::too_many_arguments, reason = "the device's three, and two lists of changes")]
    pub fn grow(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        table: &mut TableBuffers,
        level: u8,
        changes: &[TableChange],
        resident: &[TableChange],
    ) -> Result<Applied, GpuError> {
        let old = self.apply(device, queue, encoder, table, changes)?;
        if table.has_level(level) {
            return Ok(old);
        }
        if self.pipelines.is_none() {
            table.growth.begin(level);
            return Ok(old);
        }
        let tail_slot = table.tail_slot();
        let filled = self.fill(device, queue, encoder, table, tail_slot, level, resident)?;
        Ok(Applied { bytes: old.bytes + filled.bytes, ..filled })
    }

    /// Sends more of a table in a texture that [is growing](TableBuffers::is_growing), coarse levels first, and takes what it sends from
    /// `budget`, in bytes. A level is looked up when all of it is there; of any other table nothing is to be sent.
    pub fn go_on(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        table: &mut TableBuffers,
        budget: &mut u64,
    ) -> Result<Applied, GpuError> {
        table.grow_in_texture(device, queue, encoder, budget)
    }

    /// Takes further changes to a table as it lay before ([`Applied::before`]), so that what was recorded with it shows no tile that has left its
    /// slot. `table` must have been given the same changes ever since it moved.
    pub fn follow(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        table: &TableBuffers,
        before: &mut TableBuffers,
        changes: &[TableChange],
    ) -> Result<u64, GpuError> {
        match (&self.pipelines, &mut before.kind) {
            (Some(pipelines), Kind::Direct { .. }) => {
                Ok(pipelines.apply(device, queue, encoder, before, changes)?.bytes)
            }
            (Some(pipelines), Kind::Hashed(hashed)) => {
                hashed.evict(changes);
                pipelines.write(device, queue, encoder, before)
            }
            (None, _) => Ok(before.follow_in_texture(device, encoder, table, changes)),
        }
    }

    /// Lets a table begin anew elsewhere, with the tail in `tail_slot` and what is `resident`, with entries for their levels and those that it
    /// had. Bind groups are to be made anew; what was recorded with the old ones keeps the old table as it is. Returns the bytes sent.
    pub fn begin_anew(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        table: &mut TableBuffers,
        tail_slot: Slot,
        resident: &[TableChange],
    ) -> Result<u64, GpuError> {
        let levels = resident.iter().map(|change| change.page.level());
        let finest = levels.fold(table.finest(), u8::min);
        Ok(self.fill(device, queue, encoder, table, tail_slot, finest, resident)?.bytes)
    }

    #[expect(clippy::too_many_arguments, reason = "as those who call it")]
    fn fill(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        table: &mut TableBuffers,
        tail_slot: Slot,
        finest: u8,
        resident: &[TableChange],
    ) -> Result<Applied, GpuError> {
        let before = table.lie_anew(device, queue, tail_slot, finest)?;
        let filled = match (&self.pipelines, &table.kind) {
            (Some(pipelines), Kind::Direct { .. }) => {
                pipelines.fill(device, encoder, table);
                0
            }
            _ => table.send_all(queue),
        };
        let told = self.apply(device, queue, encoder, table, resident)?;
        Ok(Applied { bytes: filled + told.bytes, before: Some(Box::new(before)) })
    }
}

impl Pipelines {
    fn new(device: &wgpu::Device) -> Pipelines {
        let bindings = [
            buffer(wgpu::BufferBindingType::Storage { read_only: false }),
            buffer(wgpu::BufferBindingType::Storage { read_only: true }),
            buffer(wgpu::BufferBindingType::Uniform),
        ];
        let text = shader::table_wgsl();
        let steps = ["fill", "evict", "load", "write"];
        let (layout, [fill, evict, load, write]) =
            compute_pipelines(device, "vastex table changes", text, &bindings, steps);
        Pipelines { layout, fill, evict, load, write }
    }

    fn apply(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        table: &mut TableBuffers,
        changes: &[TableChange],
    ) -> Result<Applied, GpuError> {
        match &mut table.kind {
            Kind::Direct { finest, .. } => {
                let batch = Batch::new(&table.geometry, *finest, changes);
                let ChangesHead { eviction_chunks, load_chunks, .. } = batch.head;
                let steps = [(&self.evict, eviction_chunks), (&self.load, load_chunks)];
                self.dispatch(device, queue, encoder, table, &batch.bytes(), &steps).map(Applied::sent)
            }
            Kind::Hashed(hashed) => {
                hashed.apply(changes);
                let Some(before) = hashed.take_before() else {
                    return self.write(device, queue, encoder, table).map(Applied::sent);
                };
                let mut before = table.hash_elsewhere(device, queue, before)?;
                let bytes = self.write(device, queue, encoder, &mut before)? + table.send_all(queue);
                Ok(Applied { bytes, before: Some(Box::new(before)) })
            }
        }
    }

    /// Sends the places of a hashed table that are others than what was sent.
    fn write(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        table: &mut TableBuffers,
    ) -> Result<u64, GpuError> {
        let Kind::Hashed(hashed) = &mut table.kind else { return Ok(0) };
        let written = hashed.take_written().unwrap_or_default();
        if written.is_empty() {
            return Ok(0);
        }
        let steps = [(&self.write, (written.len() as u32).div_ceil(shader_constants::WORKGROUP))];
        let bytes = written_places(hashed, &written);
        self.dispatch(device, queue, encoder, table, &bytes, &steps)
    }

    /// Lets every entry of a table lead to the tail.
    fn fill(&self, device: &wgpu::Device, encoder: &mut wgpu::CommandEncoder, table: &mut TableBuffers) {
        let entries = (table.kind.bytes(&table.geometry) / 4) as u32;
        let room = table.changes.take().unwrap_or_else(|| self.change_buffer(device, table, LEAST_ROOM));
        let [x, y] = dispatch_size(entries.div_ceil(shader_constants::WORKGROUP));
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("vastex page table"),
            timestamp_writes: None,
        });
        pass.set_bind_group(0, &room.bind_group, &[]);
        pass.set_pipeline(&self.fill);
        pass.dispatch_workgroups(x, y, 1);
        table.changes = Some(room);
    }

    /// Sends a batch, runs over its parts in turn, each of so many workgroups, and says how many bytes it has.
    fn dispatch(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        table: &mut TableBuffers,
        bytes: &[u8],
        steps: &[(&wgpu::ComputePipeline, u32)],
    ) -> Result<u64, GpuError> {
        let sent = bytes.len() as u64;
        let room = match table.changes.take() {
            Some(room) if room.buffer.size() >= sent => room,
            _ => {
                alive(device)?;
                self.change_buffer(device, table, sent.next_power_of_two().max(LEAST_ROOM))
            }
        };
        queue.write_buffer(&room.buffer, 0, bytes);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("vastex table changes"),
            timestamp_writes: None,
        });
        pass.set_bind_group(0, &room.bind_group, &[]);
        for (pipeline, chunks) in steps {
            let [x, y] = dispatch_size(*chunks);
            pass.set_pipeline(pipeline);
            pass.dispatch_workgroups(x, y, 1);
        }
        table.changes = Some(room);
        Ok(sent)
    }

    fn change_buffer(&self, device: &wgpu::Device, table: &TableBuffers, size: u64) -> ChangeBuffer {
        let buffer = storage(device, "vastex table changes", size);
        let resources = [table.binding(), buffer.as_entire_binding(), table.params().as_entire_binding()];
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

/// The places of a hashed table that are others now, as the shader reads them.
fn written_places(table: &HashedTable, written: &[u32]) -> Vec<u8> {
    let head = WrittenHead { count: written.len() as u32, ..WrittenHead::default() };
    let record = |&place: &u32| {
        let [page_low, page_high, entry] = table.buckets()[place as usize].words();
        Written { place, page_low, page_high, entry }
    };
    let records: Vec<Written> = written.iter().map(record).collect();
    [bytemuck::bytes_of(&head), bytemuck::cast_slice(&records)].concat()
}

/// The changes of one frame to a direct table, as the shader reads them.
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
                chunks += entries_below(geometry, pos.level, finest).div_ceil(shader_constants::WORKGROUP);
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

    /// 200 frames of a path, each looked at after its changes.
    fn play(path: Path, slots: u32, mut look: impl FnMut(&World)) {
        let mut world = World::new(Knobs { slots, ..Knobs::new(path, 1) }).unwrap();
        let mut moved = 0;
        for _ in 0..200 {
            world.step().unwrap();
            look(&world);
            moved += world.table_changes().len();
        }
        assert!(moved > 50, "{path:?}: {moved} pages came and went");
    }

    fn geometry(path: Path) -> Geometry {
        Geometry::new(Knobs::new(path, 1).spec).unwrap()
    }

    /// At most twice the changed entries' own bytes and 64 for each page loaded or evicted, whichever way the camera goes.
    #[test]
    fn what_is_sent_is_in_proportion_to_what_changes() {
        for path in Path::ALL {
            play(path, 250, |world| {
                let changes = world.table_changes();
                let sent = Batch::new(&geometry(path), 0, changes).bytes().len() as u64;
                let (entries, pages) = (4 * world.entries_changed, changes.len() as u64);
                assert!(
                    pages == 0 || sent <= (2 * entries + 64 * pages).min(40 * pages),
                    "{path:?}: {sent} bytes for {entries} of entries and {pages} pages"
                );
            });
        }
    }

    /// The same of a hashed table, whose own places are what changes; all of them where it grows.
    #[test]
    fn what_is_sent_to_a_hashed_table_is_in_proportion_too() {
        for path in Path::ALL {
            let mut table = HashedTable::new(&geometry(path), Slot::new(0));
            table.take_written();
            let mut grown = 0;
            play(path, 900, |world| {
                let before: Vec<_> = table.buckets().to_vec();
                table.apply(world.table_changes());
                let Some(written) = table.take_written() else {
                    grown += 1;
                    return;
                };
                let changed = before.iter().zip(table.buckets()).filter(|(a, b)| a != b).count();
                let (sent, pages) = (written_places(&table, &written).len(), world.table_changes().len());
                assert!(
                    pages == 0 || sent <= 2 * 12 * changed + 64 * pages,
                    "{path:?}: {sent} bytes for {changed} places and {pages} pages"
                );
            });
            assert!(grown <= 2, "{path:?}: {grown} sizes");
        }
    }
}
