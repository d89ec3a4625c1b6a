//! The images that the benchmarks read: the real Earth, and larger ones laid out from mirrored copies of it, so that
//! nothing is enlarged and no seam shows.

use std::path::{Path, PathBuf};

use anyhow::Result;

use crate::shell;

const EARTH: &str = "assets/earth-color-10800x5400.jpg";

/// An image to prepare.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Input {
    /// As it is: 10800x5400.
    Earth,
    /// 8192x4096 texels of it, doubled so many times along each axis.
    Mirrored { doublings: u32 },
}

impl Input {
    /// Width and height in texels.
    pub(crate) fn size(self) -> [u64; 2] {
        match self {
            Input::Earth => [10800, 5400],
            Input::Mirrored { doublings } => [8192 << doublings, 4096 << doublings],
        }
    }

    pub(crate) fn name(self) -> String {
        let [width, height] = self.size();
        match self {
            Input::Earth => format!("The real Earth, {width}x{height}"),
            Input::Mirrored { .. } => format!("Mirrored copies of it, {width}x{height}"),
        }
    }

    /// Makes the image in a directory, as an RGB TIFF of strips without compression, unless it is there already.
    pub(crate) fn make(self, directory: &Path) -> Result<PathBuf> {
        let [width, height] = self.size();
        let path = directory.join(format!("earth-{width}x{height}.tif"));
        if path.exists() {
            return Ok(path);
        }
        match self {
            Input::Earth => shell::run(shell::command("vips").args(["copy", EARTH]).arg(&path))?,
            Input::Mirrored { doublings: 0 } => {
                let size = ["8192", "--height", "4096", "--size", "force"];
                shell::run(shell::command("vips").args(["thumbnail", EARTH]).arg(&path).args(size))?;
            }
            Input::Mirrored { doublings } => {
                let quarter = Input::Mirrored { doublings: doublings - 1 }.make(directory)?;
                let [flipped, half] = ["flipped.tif", "half.tif"].map(|name| directory.join(name));
                mirror(&quarter, &flipped, &half, "horizontal")?;
                mirror(&half, &flipped, &path, "vertical")?;
                for part in [flipped, half] {
                    std::fs::remove_file(part)?;
                }
            }
        }
        Ok(path)
    }
}

/// Lays an image and its mirror image side by side.
fn mirror(image: &Path, flipped: &Path, both: &Path, direction: &str) -> Result<()> {
    shell::run(shell::command("vips").arg("flip").arg(image).arg(flipped).arg(direction))?;
    shell::run(shell::command("vips").arg("join").arg(image).arg(flipped).arg(both).arg(direction))
}
