//! TIFF stacks: pages of one size, which are layers, channels and times as OME-XML or ImageJ's description
//! say, else layers.

mod about;
mod pages;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use about::StackAbout;
use pages::Pages;

use crate::chunks::Grid;
use crate::fault::VolumeError;
use crate::flat::{FlatArray, Place};
use crate::values::DType;
use crate::volume::{Convention, LevelArray, Volume, VolumeAbout, VolumeChannel, VolumeLevel};

pub(crate) use pages::{are_pictures, is_stack};

/// Opens a stack.
pub(crate) fn open_stack(path: &Path) -> Result<Volume, VolumeError> {
    let mut oddities = Vec::new();
    let pages = Pages::open(path, &mut oddities)?;
    let about = StackAbout::read(pages.description(), pages.count(), pages.tags(), &mut oddities);
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
    let channel_info = match pages.has_colors() {
        true => colors(grid.channels(), dtype),
        false => names.into_iter().take(usize::try_from(grid.channels()).unwrap_or(usize::MAX)).collect(),
    };
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
        root: PathBuf::new(),
        is_label: false,
        label_colors: Vec::new(),
        value_scale: None,
        downsample: None,
        left_out: Vec::new(),
        time_step: None,
        time_unit: None,
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

/// Channels that are the colours of each page, with all that their type can be as their range.
fn colors(channels: u64, dtype: DType) -> Vec<VolumeChannel> {
    let named = [("red", [255, 0, 0]), ("green", [0, 255, 0]), ("blue", [0, 0, 255])];
    let window = dtype.bounds().map(|(least, most)| [least as f64, most as f64]);
    let color = |(name, color): (&str, [u8; 3])| VolumeChannel {
        name: Some(name.into()),
        color: Some(color),
        window,
        is_active: Some(true),
        is_inverted: false,
    };
    let mut all: Vec<VolumeChannel> = named.into_iter().map(color).collect();
    if channels > 3 {
        let (name, is_active) = (Some("alpha".into()), Some(false));
        all.push(VolumeChannel { name, window, is_active, ..VolumeChannel::default() });
    }
    all
}
