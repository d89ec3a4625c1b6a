//! A source that a host has read, on its way into the window, and why it may not get there.

use std::sync::Arc;

use vastex::{GpuError, Prepared, TileSource};

use crate::panels::FileAbout;
use crate::surface::DescribeError;

/// A source that can be added to the textures of a window.
pub struct PreparedSource {
    /// What the textures take.
    pub prepared: Prepared,
    /// Where the tiles of the source come from, to be read for other textures too.
    pub tiles: Arc<dyn TileSource>,
    /// Columns and rows of the image, of which the source may have fewer.
    pub size: [u32; 2],
    /// What the file of the source says beside its texels.
    pub about: FileAbout,
    /// How many of its rows the source has.
    pub growth: Growth,
}

/// How many of its rows a source has.
#[derive(Clone)]
pub enum Growth {
    /// Every row is there.
    Whole,
    /// So many, counted from the top, as this says when it is called; more come.
    Rows(Arc<dyn Fn() -> u32 + Send + Sync>),
}

/// A source cannot be displayed, or not so.
#[derive(Debug, thiserror::Error)]
pub enum DisplayError {
    /// The textures or the device refuse it.
    #[error(transparent)]
    Textures(#[from] vastex::Error),
    /// What is asked to be shown of it cannot be.
    #[error(transparent)]
    Described(#[from] DescribeError),
}

impl DisplayError {
    /// Returns true if the device was lost.
    pub fn is_device_lost(&self) -> bool {
        matches!(self, DisplayError::Textures(vastex::Error::Gpu(GpuError::DeviceLost)))
    }
}
