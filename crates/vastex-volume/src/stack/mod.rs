//! TIFF stacks: pages of one size, which are layers, channels and times as OME-XML or ImageJ's description
//! say, else layers.

mod about;
mod pages;

use std::path::Path;
use std::sync::Arc;

use about::StackAbout;
use pages::Pages;

use crate::chunks::Grid;
use crate::fault::VolumeError;
use crate::flat::{FlatArray, Place};
use crate::volume::{Convention, LevelArray, Volume, VolumeAbout, VolumeLevel};

pub(crate) use pages::is_stack;

/// Opens a stack.
pub(crate) fn open_stack(path: &Path) -> Result<Volume, VolumeError> {
    let mut oddities = Vec::new();
    let pages = Pages::open(path, &mut oddities)?;
    let about = StackAbout::read(pages.description(), pages.count(), &mut oddities);
    let StackAbout { channels, slices, times, order, scale, unit, names } = about;
    let grid = pages.grid(order.shape(times, channels, slices), order);
    let level = VolumeLevel {
        path: String::new(),
        size: grid.size(),
        scale,
        origin: [0.0; 3],
        chunk: grid.chunk_size(),
    };
    let dtype = pages.dtype();
    let channel_info =
        names.into_iter().take(usize::try_from(grid.channels()).unwrap_or(usize::MAX)).collect();
    let about = VolumeAbout {
        path: path.display().to_string(),
        kind: "tiff-stack",
        version: None,
        name: None,
        dtype,
        levels: vec![level],
        channels: grid.channels(),
        channel_info,
        times: grid.times(),
        unit,
        convention: Convention::Corner,
        labels: Vec::new(),
        is_label: false,
        label_colors: Vec::new(),
        value_scale: None,
        downsample: None,
        oddities,
    };
    let level = match pages.one_run(&grid) {
        Some(layout) => {
            let grid = Grid { chunk: layout.chunk(), ..grid };
            LevelArray { dtype, grid, source: Arc::new(FlatArray::new(Place::Plain(path.into()), layout)) }
        }
        None => LevelArray { dtype, source: Arc::new(pages.source(&grid)), grid },
    };
    Ok(Volume::new(about, vec![level]))
}
