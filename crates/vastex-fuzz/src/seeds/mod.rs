//! Sound inputs to start from, small and made here: containers, parts, images and tile directories of every
//! kind that is read.
//!
//! The modules `images`, `jpeg` and `tiffs` make by hand what the encoders do not write.

mod containers;
mod images;
mod jpeg;
mod tiffs;
mod trees;
mod volume_files;
mod volumes;

pub(crate) use containers::{containers, exports, parts};
pub(crate) use images::{images, profiles};
pub(crate) use trees::{celestia, deep_zoom, gaia_sky, mosaics, prototype, raws};
pub(crate) use volumes::volumes;

use vastex_build::BuildOptions;

use crate::rng::Rng;

/// Texels of most images here.
const SIZE: [u32; 2] = [20, 14];

fn small_build() -> BuildOptions {
    BuildOptions { page: 8, border: 1, threads: 1, ..BuildOptions::default() }
}

/// Bytes of a smooth picture with a little grain, whose rows have so many.
fn grainy(row_bytes: usize, len: usize) -> Vec<u8> {
    let mut rng = Rng::new(2);
    (0..len).map(|n| (n % row_bytes * 3 + n / row_bytes * 2) as u8 ^ (rng.next() % 4) as u8).collect()
}
