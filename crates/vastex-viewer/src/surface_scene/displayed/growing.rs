//! A preview whose rows are still coming: which of them are there, and drawn.

use vastex::{Region, Textures};

use super::super::source::{DisplayError, Growth};
use super::Displayed;
use crate::gpu::Gpu;

impl Displayed {
    /// Has the rows drawn that have come of a growing preview since the last time. Returns true if there are
    /// any.
    pub fn catch_up(&mut self, textures: &mut Textures) -> Result<bool, DisplayError> {
        match &self.growth {
            Growth::Whole => Ok(false),
            Growth::Rows(rows) => {
                let rows = rows();
                let seen = std::mem::replace(&mut self.rows_seen, rows);
                if rows > seen {
                    textures.texture_mut(self.texture)?.invalidate(&Region::image(0..u32::MAX, seen..rows));
                }
                Ok(rows > seen)
            }
        }
    }

    /// Has nothing drawn where rows of a growing preview are not there yet, whatever its format: a value of 0
    /// would be seen as one of the image.
    pub fn show_rows(&mut self, gpu: &Gpu, textures: &Textures) {
        let share = self.rows_there();
        let growing = (share < 1.0).then_some((self.texture, share));
        if self.renderer.layers().growing() != growing {
            let mut layers = self.renderer.layers().clone();
            layers.grow(growing);
            self.renderer.set_layers(&gpu.queue, textures, &layers);
        }
    }

    /// Returns true if all rows of the source are there.
    pub fn is_whole(&self) -> bool {
        matches!(self.growth, Growth::Whole)
    }

    /// The share of the source's rows that has been looked at, 0 to 1: all but of a preview that grows.
    pub fn rows_there(&self) -> f64 {
        if self.is_whole() { 1.0 } else { f64::from(self.rows_seen) / f64::from(self.texels[1].max(1)) }
    }
}
