//! What shaders know of the views that are drawn: the parameters of all of them in one buffer, and where
//! feedback is inline the cells in which main passes report what they want. Shaders name a view by its number
//! here, so that bind groups know of none.

use crate::device::{staged, storage};
use crate::error::GpuError;
use crate::feedback_mode::FeedbackMode;
use crate::mirror::{CELL_BYTES, VIEWS, ViewParams};

/// Cells between the places where views' cells may begin, so that every device can bind them from there on.
const CELLS_APART: u32 = 16;

const _: () = assert!((CELL_BYTES * CELLS_APART as u64).is_multiple_of(256));

/// A view that is no feedback: the picture where it is, levels unchanged, nothing asked.
///
/// What is beyond the last bits of a frame's number starts a cycle of turns anew, once in years.
pub(crate) const NO_VIEW: ViewParams = ViewParams {
    clip_scale: [1.0; 2],
    clip_offset: [0.0; 2],
    level_offset: 0.0,
    frame: 0,
    jitter: [0; 2],
    columns: 0,
    cell: 1,
    reversed_depth: 0,
    first_cell: 0,
    rows: 0,
    answers: 1,
    block: 1,
    gaps: 0,
};

/// The parameters of all views, and their cells. Commands set them, so that each frame has its own, however
/// many are recorded before the first of them is submitted. They outlive targets, so that a resize leaves
/// bind groups as they are, unless feedback is inline and the cells need more room ([`Views::is_moved`]).
#[derive(Debug)]
pub struct Views {
    buffer: wgpu::Buffer,
    /// The parameters of a view that is no feedback.
    no_view: wgpu::Buffer,
    cells: Option<Cells>,
}

#[derive(Debug)]
struct Cells {
    buffer: wgpu::Buffer,
    /// Of each view its first cell and how many it has.
    ranges: [(u32, u32); VIEWS as usize],
    is_moved: bool,
}

impl Views {
    /// Views that there can be.
    pub const MOST: u32 = VIEWS;

    /// Views that are no feedback yet, for shaders of this mode: the picture where it is, levels unchanged.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, mode: FeedbackMode) -> Views {
        let params = [NO_VIEW; VIEWS as usize];
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("vastex views"),
            size: size_of_val(&params) as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        queue.write_buffer(&buffer, 0, bytemuck::cast_slice(&params));
        let bytes = bytemuck::bytes_of(&NO_VIEW);
        let no_view = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("vastex view without feedback"),
            size: bytes.len() as u64,
            usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        queue.write_buffer(&no_view, 0, bytes);
        // One cell, so that there is something to bind; nothing is asked before there is a target.
        let cells = || Cells {
            buffer: storage(device, "vastex cells", CELL_BYTES),
            ranges: [(0, 0); VIEWS as usize],
            is_moved: false,
        };
        Views { buffer, no_view, cells: (mode == FeedbackMode::Inline).then(cells) }
    }

    /// Sets what the commands recorded after this see of a view, until it is set again: commands that are
    /// submitted before or after them, or never, make no difference. A view that there cannot be is left out.
    /// Costs a buffer of 64 bytes, which goes with the commands.
    pub(crate) fn set(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        view: u32,
        params: &ViewParams,
    ) {
        if view >= VIEWS {
            return;
        }
        let first_cell = self.cells.as_ref().map_or(0, |cells| cells.ranges[view as usize].0);
        let params = ViewParams { first_cell, ..*params };
        let bytes = bytemuck::bytes_of(&params);
        // A lost device shows where feedback is read.
        let Some(source) = staged(device, "vastex view", bytes) else { return };
        let place = u64::from(view) * bytes.len() as u64;
        encoder.copy_buffer_to_buffer(&source, 0, &self.buffer, place, bytes.len() as u64);
    }

    /// Ends the feedback of a view: what is drawn by the commands recorded after this sees the picture where
    /// it is and levels unchanged, and asks for nothing, until the view is set again. A view that there
    /// cannot be is left out.
    pub fn end(&self, encoder: &mut wgpu::CommandEncoder, view: u32) {
        if view < VIEWS {
            let size = self.no_view.size();
            encoder.copy_buffer_to_buffer(&self.no_view, 0, &self.buffer, u64::from(view) * size, size);
        }
    }

    /// Gives a view so many cells, with inline feedback. If they do not fit beside those of the other views,
    /// the cells of all views move.
    pub fn fit_cells(
        &mut self,
        device: &wgpu::Device,
        view: u32,
        [columns, rows]: [u32; 2],
    ) -> Result<(), GpuError> {
        let limits = device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / CELL_BYTES;
        let too_large = || GpuError::TargetSize {
            width: columns,
            height: rows,
            max: most.isqrt().try_into().unwrap_or(u32::MAX),
        };
        let count = columns.checked_mul(rows).ok_or_else(too_large)?;
        let Some(cells) = &mut self.cells else { return Ok(()) };
        let Some(range) = cells.ranges.get_mut(view as usize) else { return Ok(()) };
        if count <= range.1 {
            return Ok(());
        }
        let before = std::mem::replace(range, (0, count));
        let mut ranges = cells.ranges;
        let mut end = 0u32;
        for (first, count) in ranges.iter_mut().filter(|range| range.1 > 0) {
            *first = end;
            end = end.saturating_add(count.next_multiple_of(CELLS_APART));
        }
        if u64::from(end) > most {
            cells.ranges[view as usize] = before;
            return Err(too_large());
        }
        cells.ranges = ranges;
        cells.buffer = storage(device, "vastex cells", u64::from(end) * CELL_BYTES);
        cells.is_moved = true;
        Ok(())
    }

    /// Returns true if the cells lie elsewhere since this was asked last: bind groups are then to be made
    /// anew. Before that, those that have the old ones report what nobody reads.
    pub fn is_moved(&mut self) -> bool {
        self.cells.as_mut().is_some_and(|cells| std::mem::take(&mut cells.is_moved))
    }

    /// The cells of one view.
    pub(crate) fn cells_of(&self, view: u32) -> Option<wgpu::BufferBinding<'_>> {
        let cells = self.cells.as_ref()?;
        let &(first, count) = cells.ranges.get(view as usize)?;
        let size = wgpu::BufferSize::new(u64::from(count) * CELL_BYTES);
        Some(wgpu::BufferBinding { buffer: &cells.buffer, offset: u64::from(first) * CELL_BYTES, size })
    }

    pub(crate) fn cells(&self) -> Option<&wgpu::Buffer> {
        Some(&self.cells.as_ref()?.buffer)
    }

    pub(crate) fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }
}
