//! How prefetch sets are learnt: what was wanted in a cell and shortly after, visit by visit.

use std::collections::BTreeMap;

use rustc_hash::FxHashMap;

use super::{Cell, PrefetchSets, cell};
use crate::record::trace::{CameraPosition, Trace};
use crate::texture::page::PageId;
use crate::wanted::feedback::WantedPage;

/// Frames that a camera takes through a cell, where nothing else is said.
const FRAMES_PER_CELL: f32 = 8.0;

/// How sets are learnt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearnSettings {
    /// Sides of a cell, 0 along an axis that tells nothing apart; where nothing is said, along each axis as
    /// far as the camera moves in 8 frames, jumps aside.
    pub sides: Option<CameraPosition>,
    /// Frames after the camera has left a cell whose pages belong to the cell.
    pub ahead_frames: u32,
    /// Pages of a cell at most; those wanted over the most pixels stay.
    pub max_pages: usize,
}

impl Default for LearnSettings {
    /// 16 frames ahead, 1024 pages.
    fn default() -> LearnSettings {
        LearnSettings { sides: None, ahead_frames: 16, max_pages: 1024 }
    }
}

/// Why nothing could be learnt.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LearnError {
    /// No frame of any trace says where the camera was.
    #[error("no frame of the traces says where the camera was; record them again")]
    NoPlaces,
    /// The traces are of different textures.
    #[error("trace {trace} is of other textures than the first; learn from traces of the same textures")]
    OtherTextures {
        /// The trace, counted from 1.
        trace: usize,
    },
    /// A side is no length.
    #[error("a cell's side of {0}; it must be 0 or above")]
    Side(f32),
}

impl PrefetchSets {
    /// Learns from traces of the same textures. Frames that do not say where the camera was only end a visit
    /// of a cell.
    ///
    /// Costs a look-up of each page of each frame, and one more for each of those within `ahead_frames` of a
    /// visit's end.
    pub fn learn(traces: &[Trace], settings: &LearnSettings) -> Result<PrefetchSets, LearnError> {
        let Some(first) = traces.first() else { return Err(LearnError::NoPlaces) };
        if let Some(other) = traces.iter().position(|trace| trace.geometries() != first.geometries()) {
            return Err(LearnError::OtherTextures { trace: other + 1 });
        }
        if !traces.iter().flat_map(Trace::camera_positions).any(Option::is_some) {
            return Err(LearnError::NoPlaces);
        }
        let sides = settings.sides.unwrap_or_else(|| usual_sides(traces));
        if let Some(&side) = sides.iter().find(|side| !(side.is_finite() && **side >= 0.0)) {
            return Err(LearnError::Side(side));
        }
        let mut tallies: BTreeMap<Cell, Tally> = BTreeMap::new();
        for trace in traces {
            for (cell, frames) in visits(trace, sides, settings.ahead_frames as usize) {
                tallies.entry(cell).or_default().add(&trace.frames()[frames]);
            }
        }
        let cells = tallies.into_iter().map(|(cell, tally)| (cell, tally.finish(settings.max_pages)));
        Ok(PrefetchSets {
            geometries: first.geometries().to_vec(),
            sides,
            ahead_frames: settings.ahead_frames,
            cells: cells.collect(),
        })
    }
}

/// The visits of cells, with their frames and those that follow.
fn visits(trace: &Trace, sides: CameraPosition, ahead: usize) -> Vec<(Cell, std::ops::Range<usize>)> {
    let all = trace.camera_positions().len();
    let cells: Vec<Option<Cell>> =
        trace.camera_positions().iter().map(|place| place.map(|place| cell(place, sides))).collect();
    let mut start = 0;
    let runs = cells.chunk_by(|a, b| a == b).map(|run| {
        let frames = start..start + run.len();
        start = frames.end;
        (run[0], frames.start..frames.end.saturating_add(ahead).min(all))
    });
    runs.filter_map(|(cell, frames)| Some((cell?, frames))).collect()
}

/// Along each axis as far as the camera moves in [`FRAMES_PER_CELL`] frames; the median, since jumps say
/// nothing.
fn usual_sides(traces: &[Trace]) -> CameraPosition {
    std::array::from_fn(|axis| {
        let pairs = traces.iter().flat_map(|trace| trace.camera_positions().windows(2));
        let moved = pairs.filter_map(|pair| Some((pair[0]?[axis] - pair[1]?[axis]).abs()));
        let mut moved: Vec<f32> = moved.filter(|moved| *moved > 0.0 && moved.is_finite()).collect();
        moved.sort_unstable_by(f32::total_cmp);
        let median = moved.get(moved.len() / 2).copied().unwrap_or(0.0);
        let side = median * FRAMES_PER_CELL;
        if side.is_normal() { side } else { 0.0 }
    })
}

/// What was wanted in the visits of one cell.
#[derive(Debug, Default)]
struct Tally {
    frames: u64,
    /// Pixels and the sharpest need of each page.
    pages: FxHashMap<PageId, (u64, u8)>,
}

impl Tally {
    fn add(&mut self, frames: &[Vec<WantedPage>]) {
        self.frames += frames.len() as u64;
        for wanted in frames.iter().flatten() {
            let (pixels, eighth) = self.pages.entry(wanted.page).or_insert((0, wanted.eighth));
            *pixels += u64::from(wanted.pixels);
            *eighth = wanted.eighth.min(*eighth);
        }
    }

    /// The pages over the most pixels, with their pixels in a frame on average; in order of page ids.
    fn finish(self, max_pages: usize) -> Vec<WantedPage> {
        let mut most: Vec<_> = self.pages.into_iter().collect();
        most.sort_unstable_by_key(|&(page, (pixels, _))| (std::cmp::Reverse(pixels), page));
        most.truncate(max_pages);
        let average = |pixels: u64| u32::try_from(pixels.div_ceil(self.frames.max(1))).unwrap_or(u32::MAX);
        let mut pages: Vec<WantedPage> = most
            .into_iter()
            .map(|(page, (pixels, eighth))| WantedPage { page, pixels: average(pixels).max(1), eighth })
            .collect();
        pages.sort_unstable();
        pages
    }
}
