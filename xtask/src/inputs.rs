//! The images that the benchmarks read: the real Earth, and larger ones laid out from mirrored copies of it,
//! so that nothing is enlarged and no seam shows.

use std::path::{Path, PathBuf};

use anyhow::Result;

use crate::shell;

const EARTH: &str = "assets/earth-color-10800x5400.jpg";

/// An image to prepare.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Input {
    /// As it is: 10800x5400.
    Earth,
    /// The same, as the JPEG that it comes in.
    EarthJpeg,
    /// 8192x4096 texels of it, doubled so many times across and down.
    Mirrored { across: u32, down: u32 },
}

impl Input {
    /// Width and height in texels.
    pub(crate) fn size(self) -> [u64; 2] {
        match self {
            Input::Earth | Input::EarthJpeg => [10800, 5400],
            Input::Mirrored { across, down } => [8192 << across, 4096 << down],
        }
    }

    pub(crate) fn name(self) -> String {
        let [width, height] = self.size();
        match self {
            Input::Earth => format!("The real Earth, {width}x{height}"),
            Input::EarthJpeg => format!("The real Earth from JPEG, {width}x{height}"),
            Input::Mirrored { .. } => format!("Mirrored copies of it, {width}x{height}"),
        }
    }

    /// Makes the image in a directory, as an RGB TIFF of strips without compression, unless it is there
    /// already or is to be read as it comes.
    pub(crate) fn make(self, directory: &Path) -> Result<PathBuf> {
        if self == Input::EarthJpeg {
            return Ok(shell::root().join(EARTH));
        }
        let [width, height] = self.size();
        let path = directory.join(format!("earth-{width}x{height}.tif"));
        if path.exists() {
            return Ok(path);
        }
        match self {
            Input::Earth | Input::EarthJpeg => {
                shell::run(shell::command("vips").args(["copy", EARTH]).arg(&path))?;
            }
            Input::Mirrored { across: 0, down: 0 } => {
                let size = ["8192", "--height", "4096", "--size", "force"];
                shell::run(shell::command("vips").args(["thumbnail", EARTH]).arg(&path).args(size))?;
            }
            Input::Mirrored { across, down } if down < across => {
                let half = Input::Mirrored { across: across - 1, down }.make(directory)?;
                mirror(&half, &directory.join("flipped.tif"), &path, "horizontal")?;
            }
            Input::Mirrored { across, down } => {
                let half = Input::Mirrored { across, down: down - 1 }.make(directory)?;
                mirror(&half, &directory.join("flipped.tif"), &path, "vertical")?;
            }
        }
        Ok(path)
    }
}

/// Lays an image and its mirror image side by side.
fn mirror(image: &Path, flipped: &Path, both: &Path, direction: &str) -> Result<()> {
    shell::run(shell::command("vips").arg("flip").arg(image).arg(flipped).arg(direction))?;
    shell::run(shell::command("vips").arg("join").arg(image).arg(flipped).arg(both).arg(direction))?;
    Ok(std::fs::remove_file(flipped)?)
}
