//! The changes of one frame to the direct tables of a pool, as the GPU reads them: words of 32 bits, laid out
//! as tables/changes.wgsl says.

use vastex_core::{ChangeRule, TableChange, shader_constants};

use super::directory::DirectTable;

/// Words before the fills.
const HEAD: usize = 8;
const FILL: usize = 4;
const CHANGE: usize = 8;
const LEVEL: usize = 7;

/// The changes of one frame to the direct tables of a pool, as the words that the GPU reads.
#[derive(Debug, Default)]
pub(super) struct Batch {
    fills: Vec<[u32; FILL]>,
    evictions: Vec<[u32; CHANGE]>,
    loads: Vec<[u32; CHANGE]>,
    /// What the walk below a page goes by, of the levels of the tables that change.
    levels: Vec<[u32; LEVEL]>,
    /// Workgroups of fills, evictions and loads.
    chunks: [u32; 3],
}

impl Batch {
    pub(super) fn is_empty(&self) -> bool {
        self.chunks == [0; 3]
    }

    /// Workgroups of the fills, the evictions and the loads.
    pub(super) fn chunks(&self) -> [u32; 3] {
        self.chunks
    }

    /// Some entries become `value`.
    pub(super) fn fill(&mut self, first: u32, count: u32, value: u32) {
        self.fills.push([first, count, value, self.chunks[0]]);
        self.chunks[0] += count.div_ceil(shader_constants::WORKGROUP);
    }

    /// Changes of one table, of its levels up to `coarsest`.
    pub(super) fn change(&mut self, table: &DirectTable, changes: &[TableChange], coarsest: u8) {
        let finest = table.finest();
        let Some(top) = changes.iter().map(|change| change.page.level()).max().filter(|&top| top >= finest)
        else {
            return;
        };
        // As if all levels were there; wraps, and is only read with a level added.
        let levels = (self.levels.len() as u32).wrapping_sub(u32::from(finest));
        self.levels.extend((finest..=top).map(|level| level_words(table, level)));
        for change in changes.iter().filter(|change| change.page.level() >= finest) {
            let pos = change.page.pos(table.geometry.dims());
            let up_to = coarsest.min(pos.level);
            let (list, chunks, old) = match change.rule {
                ChangeRule::Naming(old) => (&mut self.evictions, &mut self.chunks[1], old.to_bits()),
                ChangeRule::Coarser => (&mut self.loads, &mut self.chunks[2], 0),
            };
            let walk = u32::from(finest) | u32::from(up_to) << 8 | u32::from(pos.level) << 16;
            list.push([pos.x, pos.y, pos.z, old, change.entry.to_bits(), levels, walk, *chunks]);
            *chunks += entries_below(table, pos.level, up_to).div_ceil(shader_constants::WORKGROUP);
        }
    }

    pub(super) fn words(&self) -> Vec<u32> {
        let changes = HEAD + FILL * self.fills.len();
        let levels = changes + CHANGE * (self.evictions.len() + self.loads.len());
        let counts = [self.fills.len(), self.evictions.len(), self.loads.len(), changes, levels];
        let [fills, evictions, loads, changes, levels] = counts.map(|count| count as u32);
        let [fill_chunks, eviction_chunks, load_chunks] = self.chunks;
        let head = [fills, evictions, loads, fill_chunks, eviction_chunks, load_chunks, changes, levels];
        let lists = [self.evictions.as_flattened(), self.loads.as_flattened(), self.levels.as_flattened()];
        [&head, self.fills.as_flattened(), &lists.concat()].concat()
    }
}

fn level_words(table: &DirectTable, level: u8) -> [u32; LEVEL] {
    let at = table.geometry.level(level);
    let [x, y, z] = at.scale.map(|scale| u32::try_from(scale).unwrap_or(u32::MAX));
    let first = table.first_entry(level).unwrap_or(super::Placement::NONE);
    [x, y, z, first, at.pages[0], at.pages[1], at.pages[2]]
}

/// Entries that the shader walks for a page of `level`: of each level from `up_to` down as many as any page
/// has there.
fn entries_below(table: &DirectTable, level: u8, up_to: u8) -> u32 {
    let page = table.geometry.level(level);
    let below = |at: u8| -> u64 {
        let at = table.geometry.level(at);
        (0..3).map(|a| (page.scale[a] / at.scale[a]).min(u64::from(at.pages[a]))).product()
    };
    (table.finest()..=up_to).map(below).sum::<u64>() as u32
}
