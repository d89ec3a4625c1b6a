//! Prefetch sets: which pages are wanted where, learnt from recorded traces.
//!
//! The space of the camera ([`CameraPosition`]) is cut into cells, and each has a list of the pages that
//! were wanted while the camera was in it and shortly after, those wanted most first. In use, the list of
//! the camera's cell and of the one that it is heading for is what the view is expected to want, for levels
//! that are walked through again and again, tours, and rooms behind doors, where what comes next does not
//! follow from how the camera moves.
//!
//! docs/traces.md describes the file.

mod codec;
mod learn;

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::record::file::FileError;
use crate::record::trace::CameraPosition;
use crate::texture::geometry::Geometry;
use crate::texture::page::{PageId, TextureNumber};
use crate::wanted::feedback::{Feedback, WantedPage};

pub use learn::{LearnError, LearnSettings};

/// A cell, by its number along each axis.
type Cell = [i32; 3];

/// Which pages are wanted where, learnt from traces: for each cell of the camera's space, the pages that were
/// wanted while the camera was in it and shortly after, those wanted most first. What it says of the camera's
/// cell is a prediction of what the view will want. Its file format stands in docs/traces.md.
#[derive(Clone, Debug, PartialEq)]
pub struct PrefetchSets {
    geometries: Vec<Arc<Geometry>>,
    /// Sides of a cell; 0 along an axis that tells nothing apart.
    sides: CameraPosition,
    /// Frames for which the lists look ahead.
    ahead_frames: u32,
    cells: BTreeMap<Cell, Vec<WantedPage>>,
}

/// Why bytes are no prefetch sets.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SetsError {
    /// The bytes do not begin with the letters of prefetch sets.
    #[error("not prefetch sets: it does not begin with the letters VXSETS; make them with `vastex learn`")]
    NotSets,
    /// The prefetch sets are of a version that is not read.
    #[error("prefetch sets of version {0}, and this program reads versions {old} and {new}; learn them again", old = codec::OLD_SHAPES, new = codec::VERSION)]
    Version(u32),
    /// The prefetch sets are damaged.
    #[error("the prefetch sets are damaged: {0}; copy or learn them again")]
    Damaged(#[from] FileError),
    /// The parts do not fit one another.
    #[error("the prefetch sets are damaged before byte {at}: {what}; copy or learn them again")]
    Content {
        /// Where the part ends, in bytes from the beginning.
        at: usize,
        /// What does not fit.
        what: &'static str,
    },
}

impl PrefetchSets {
    /// The shapes of the textures that they were learnt of, by their numbers there.
    pub fn geometries(&self) -> &[Arc<Geometry>] {
        &self.geometries
    }

    /// Sides of a cell; 0 along an axis that tells nothing apart.
    pub fn sides(&self) -> CameraPosition {
        self.sides
    }

    /// Cells that have a list.
    pub fn cells(&self) -> usize {
        self.cells.len()
    }

    /// Entries of all lists.
    pub fn pages(&self) -> usize {
        self.cells.values().map(Vec::len).sum()
    }

    /// What a camera at `place`, which moves by `step` a frame, is expected to want: the lists of its cell
    /// and of the one where it will be when the lists end. `textures` are the numbers that the textures have
    /// now, in the order in which they were learnt; what has none is left out.
    pub fn expected(
        &self,
        place: CameraPosition,
        step: CameraPosition,
        textures: &[TextureNumber],
    ) -> Feedback {
        let ahead: CameraPosition =
            std::array::from_fn(|axis| place[axis] + step[axis] * self.ahead_frames as f32);
        let mut cells = vec![self.cell(place), self.cell(ahead)];
        cells.dedup();
        let pages = cells.iter().filter_map(|cell| self.cells.get(cell)).flatten();
        let renumbered = |wanted: &WantedPage| {
            let number = usize::from(wanted.page.texture().number());
            let dims = self.geometries.get(number)?.dims();
            let page = PageId::new(*textures.get(number)?, dims, wanted.page.pos(dims)).ok()?;
            Some(WantedPage { page, ..*wanted })
        };
        Feedback::of_pages(0, pages.filter_map(renumbered).collect())
    }

    /// The sets as a file's bytes: about 5 for each page of each cell.
    pub fn to_bytes(&self) -> Vec<u8> {
        codec::encode(self)
    }

    /// The sets that a file's bytes hold. Memory grows with what is read, not with what the bytes claim.
    pub fn from_bytes(bytes: &[u8]) -> Result<PrefetchSets, SetsError> {
        codec::decode(bytes)
    }

    fn cell(&self, place: CameraPosition) -> Cell {
        cell(place, self.sides)
    }
}

/// The cell of a place. What is farther off than numbers go is in the last cell.
fn cell(place: CameraPosition, sides: CameraPosition) -> Cell {
    std::array::from_fn(|axis| if sides[axis] > 0.0 { (place[axis] / sides[axis]).floor() as i32 } else { 0 })
}

#[cfg(test)]
mod tests;
