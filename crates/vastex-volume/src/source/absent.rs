//! Which pages are known to hold the fill value alone, before anything of them is read: those none of whose
//! chunks is stored, the chunks that their borders reach into among them.

use bytes::Bytes;
use vastex_core::{Geometry, PageContents, PageNumbering, VoxelLevel};

use crate::chunks::{Grid, Presence};
use crate::volume::Volume;

/// Keys that are listed for a level, or chunks in indices of shards.
const MOST_KEYS: usize = 1 << 16;
/// Pages of a volume up to which each has a bit and a byte here.
const MOST_PAGES: u64 = 1 << 22;
/// Pages that are marked for a level, those included that were marked before.
const MOST_MARKS: u64 = 1 << 26;

/// One level of what is asked about.
pub(super) struct Asked<'a> {
    /// Its number in the geometry, and its voxels.
    pub(super) number: u8,
    pub(super) level: &'a VoxelLevel,
    /// The stored level that its voxels are made of, and how many of those are one of its own.
    pub(super) stored: usize,
    pub(super) scale: [u64; 3],
}

/// The pages of one content, the fill value; `None` if no page is known to have it. `constant` is a texel of
/// it. What takes more than some ten thousand keys to find out is not found out.
pub(super) async fn contents(
    volume: &Volume,
    geometry: &Geometry,
    levels: &[Asked<'_>],
    (channel, time): (u64, u64),
    constant: Bytes,
) -> Option<PageContents> {
    if geometry.page_count() > MOST_PAGES {
        return None;
    }
    let numbering = PageNumbering::new(geometry);
    let mut is_stored = vec![0_u64; numbering.entries().div_ceil(64) as usize];
    let mut is_known = vec![false; geometry.levels().len()];
    for asked in levels {
        if !numbering.is_finer(asked.number) {
            continue;
        }
        let listed = volume.stored_chunks(asked.stored, MOST_KEYS).await;
        let Presence::These(chunks) = &*listed else { continue };
        let grid = volume.grid(asked.stored);
        let needs = [0, 1, 2].map(|axis| needs(geometry, asked, grid, axis));
        let of_this = chunks.iter().filter(|coords| is_of(grid, coords, channel, time));
        let mut marks = 0_u64;
        for coords in of_this {
            let pages = [0, 1, 2].map(|axis| {
                let at = grid.space()[axis].map_or(0, |axis| coords[axis]);
                let side = grid.chunk_size()[axis];
                let (begin, end) = (at * side, (at + 1) * side);
                let first = needs[axis].partition_point(|(_, last)| *last <= begin);
                let after = needs[axis].partition_point(|(begin, _)| *begin < end);
                first as u32..after.max(first) as u32
            });
            marks = marks.saturating_add(pages.iter().map(|pages| pages.len() as u64).product());
            if marks > MOST_MARKS {
                break;
            }
            let [across, down, _] = geometry.level(asked.number).pages.map(u64::from);
            let begin = numbering.first_entry(asked.number);
            for z in pages[2].clone() {
                for y in pages[1].clone() {
                    let row = begin + (u64::from(z) * down + u64::from(y)) * across;
                    for entry in pages[0].clone().map(|x| row + u64::from(x)) {
                        is_stored[(entry / 64) as usize] |= 1 << (entry % 64);
                    }
                }
            }
        }
        is_known[usize::from(asked.number)] = marks <= MOST_MARKS;
    }
    let is_absent = |pos: vastex_core::PagePos| {
        is_known[usize::from(pos.level)]
            && numbering
                .entry_if_finer(pos)
                .is_some_and(|entry| is_stored[(entry / 64) as usize] & (1 << (entry % 64)) == 0)
    };
    let contents = PageContents::new(geometry, vec![constant], 1, |pos| is_absent(pos).then_some(0));
    (contents.pages() > 0).then_some(contents)
}

/// Whether a chunk has values of a channel and a time. Axes without a meaning are read at 0.
fn is_of(grid: &Grid, coords: &[u64], channel: u64, time: u64) -> bool {
    let wanted = grid.coords([0; 3], channel, time);
    let space = grid.space();
    (0..coords.len()).all(|axis| space.contains(&Some(axis)) || coords[axis] == wanted[axis])
}

/// The stored voxels that pages need along an axis, borders included: the first, and the one past the last.
fn needs(geometry: &Geometry, asked: &Asked<'_>, grid: &Grid, axis: usize) -> Vec<(u64, u64)> {
    let pages = geometry.level(asked.number).pages[axis];
    let (tile, size) = (i64::from(geometry.tile()[axis]), grid.size()[axis]);
    let last = i64::from(asked.level.size[axis]) - 1;
    let need = |page: u32| {
        let mut coords = [0; 3];
        coords[axis] = page;
        let first = asked.level.first_voxel(coords)[axis];
        let (begin, end) = (first.clamp(0, last) as u64, (first + tile - 1).clamp(0, last) as u64 + 1);
        let scale = asked.scale[axis];
        (begin.saturating_mul(scale).min(size - 1), end.saturating_mul(scale).min(size))
    };
    (0..pages).map(need).collect()
}
