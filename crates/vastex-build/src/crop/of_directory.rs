//! Regions of a tile directory: the texels of its own tiles.

use std::path::{Path, PathBuf};

use super::CropError;
use super::stored::{Stored, up_to_next};
use crate::image::Number;
use crate::progress::Progress;
use crate::source::DirectorySource;

pub(super) struct OfDirectory {
    path: PathBuf,
    directory: DirectorySource,
    level: u32,
}

impl OfDirectory {
    pub(super) fn new(path: &Path, directory: DirectorySource, level: u32) -> Result<OfDirectory, CropError> {
        let count = directory.level_count();
        if level >= count {
            let there = format!("the directory has levels 0 to {}", count - 1);
            return Err(CropError::Level { level, there });
        }
        Ok(OfDirectory { path: path.into(), directory, level })
    }
}

impl Stored for OfDirectory {
    fn size(&self) -> [u32; 2] {
        self.directory.level_size(self.level)
    }

    fn number(&self) -> Number {
        self.directory.pixel_format().sample().into()
    }

    fn channels(&self) -> u16 {
        self.directory.pixel_format().channels().into()
    }

    fn rows_together(&self, row: u32) -> u32 {
        up_to_next(row, self.directory.cell())
    }

    fn read(
        &mut self,
        first: [u32; 2],
        size: [u32; 2],
        texels: &mut [u8],
        _: &dyn Progress,
    ) -> Result<(), CropError> {
        let found = self.directory.stored_texels(self.level, first, size);
        let found = found.map_err(|fault| CropError::Input { path: self.path.clone(), fault })?;
        texels.copy_from_slice(&found);
        Ok(())
    }
}
