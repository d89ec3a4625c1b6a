//! Which pages are known to hold the fill value alone, before anything of them is read: those none of whose
//! chunks is stored, the chunks that their borders reach into among them.
//!
//! A volume of up to 4 Mi pages has a list of them; of a larger one each page is looked up among the chunks
//! that are stored.

use std::ops::Range;
use std::sync::Arc;

use bytes::Bytes;
use vastex_core::{Geometry, PageContents, PageNumbering, PagePos, VoxelLevel};

use crate::stored::StoredChunks;
use crate::volume::Volume;

/// Pages of a volume up to which each has a bit and a byte here.
const MOST_PAGES: u64 = 1 << 22;
/// Pages that are marked for a level, those included that were marked before.
const MOST_MARKS: u64 = 1 << 26;

/// One level of what is asked about.
pub(super) struct Asked<'a> {
    /// The level's number in the geometry, and its voxels.
    pub(super) number: u8,
    pub(super) level: &'a VoxelLevel,
    /// The stored level that its voxels are made of, and how many of those are one of its own.
    pub(super) stored: usize,
    pub(super) scale: [u64; 3],
}

/// What is known of a level.
struct Known {
    stored: Arc<StoredChunks>,
    level: VoxelLevel,
    pages: [u32; 3],
    tile: [i64; 3],
    /// Voxels of the stored level, and of one of this one.
    size: [u64; 3],
    scale: [u64; 3],
    plane: (u64, u64),
}

impl Known {
    /// The stored voxels that a page needs along an axis, borders included.
    fn need(&self, axis: usize, page: u32) -> Range<u64> {
        let last = i64::from(self.level.size[axis]) - 1;
        let mut coords = [0; 3];
        coords[axis] = page;
        let first = self.level.first_voxel(coords)[axis];
        let (begin, end) =
            (first.clamp(0, last) as u64, (first + self.tile[axis] - 1).clamp(0, last) as u64 + 1);
        let (scale, size) = (self.scale[axis], self.size[axis]);
        begin.saturating_mul(scale).min(size - 1)..end.saturating_mul(scale).min(size)
    }

    fn is_absent(&self, coords: [u32; 3]) -> bool {
        let voxels = [0, 1, 2].map(|axis| self.need(axis, coords[axis]));
        !self.stored.has_any(&self.stored.chunks_of(&voxels), self.plane)
    }

    /// Hands out boxes of pages that need a stored chunk, all of them; false where these come to too many
    /// pages.
    fn each_present(&self, mut found: impl FnMut([Range<u32>; 3])) -> bool {
        let needs =
            [0, 1, 2].map(|axis| (0..self.pages[axis]).map(|page| self.need(axis, page)).collect::<Vec<_>>());
        let mut marks = 0_u64;
        self.stored.each(self.plane, |chunks| {
            let voxels = self.stored.voxels_of(&chunks);
            let pages: [Range<u32>; 3] = std::array::from_fn(|axis| {
                let first = needs[axis].partition_point(|need| need.end <= voxels[axis].start);
                let after = needs[axis].partition_point(|need| need.start < voxels[axis].end);
                first as u32..after.max(first) as u32
            });
            marks = marks.saturating_add(pages.iter().map(|pages| pages.len() as u64).product());
            if marks <= MOST_MARKS {
                found(pages);
            }
            marks <= MOST_MARKS
        })
    }
}

/// The pages of one content, the fill value; `None` if no page is known to have it. `constant` is a texel of
/// it.
pub(super) async fn contents(
    volume: &Volume,
    geometry: &Geometry,
    levels: &[Asked<'_>],
    plane: (u64, u64),
    constant: Bytes,
) -> Option<PageContents> {
    let numbering = PageNumbering::new(geometry);
    let mut known: Vec<Option<Known>> = geometry.levels().iter().map(|_| None).collect();
    for asked in levels.iter().filter(|asked| numbering.is_finer(asked.number)) {
        known[usize::from(asked.number)] = volume.stored_chunks(asked.stored).await.map(|stored| Known {
            stored,
            level: *asked.level,
            pages: geometry.level(asked.number).pages,
            tile: geometry.tile().map(i64::from),
            size: volume.grid(asked.stored).size(),
            scale: asked.scale,
            plane,
        });
    }
    if known.iter().all(Option::is_none) {
        return None;
    }
    if geometry.page_count() <= MOST_PAGES
        && let Some(is_stored) = listed(geometry, &numbering, &known)
    {
        let is_absent = |pos: PagePos| {
            known[usize::from(pos.level)].is_some()
                && numbering
                    .entry_if_finer(pos)
                    .is_some_and(|entry| is_stored[(entry / 64) as usize] & (1 << (entry % 64)) == 0)
        };
        let contents = PageContents::new(geometry, vec![constant], 1, |pos| is_absent(pos).then_some(0));
        return (contents.pages() > 0).then_some(contents);
    }
    let is_absent = move |pos: PagePos| {
        let known = known.get(usize::from(pos.level))?.as_ref()?;
        known.is_absent(pos.coords()).then_some(0)
    };
    Some(PageContents::of_rule(geometry, vec![constant], 1, Arc::new(is_absent)))
}

/// A bit for each page that needs a stored chunk, by its entry; `None` where marking them takes too long.
fn listed(geometry: &Geometry, numbering: &PageNumbering, known: &[Option<Known>]) -> Option<Vec<u64>> {
    let mut is_stored = vec![0_u64; numbering.entries().div_ceil(64) as usize];
    for (number, of_level) in (0_u8..).zip(known) {
        let Some(of_level) = of_level else { continue };
        let [across, down, _] = geometry.level(number).pages.map(u64::from);
        let begin = numbering.first_entry(number);
        let is_whole = of_level.each_present(|pages| {
            for z in pages[2].clone() {
                for y in pages[1].clone() {
                    let row = begin + (u64::from(z) * down + u64::from(y)) * across;
                    for entry in pages[0].clone().map(|x| row + u64::from(x)) {
                        is_stored[(entry / 64) as usize] |= 1 << (entry % 64);
                    }
                }
            }
        });
        if !is_whole {
            return None;
        }
    }
    Some(is_stored)
}
