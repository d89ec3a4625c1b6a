//! What `vastex crop` is told.

use std::path::PathBuf;

use vastex_build::{CropFormat, CropRegion};

use super::common::PrintArgs;
use super::replace::parse_at;
use super::{CacheArgs, ClapArgs};

/// What `vastex crop` is told.
#[derive(Debug, ClapArgs)]
#[command(after_help = "\
Examples:
  vastex crop earth.vastex --at 8192,4096 --size 1024x512 -o alps.png
  vastex crop slide.svs --at 1000,2000 --size 4096x4096 --level 2 -o tissue.npy
  vastex crop ground.vastex --layer height --at 0,0 --size 512x512 -o height.tif

Values are those that are stored, exactly: nothing is filtered, converted or interpolated; JPEG is decoded as by libjpeg-turbo,
layers compressed in blocks as GPUs do. Of a TIFF pyramid, level L is the image whose sides are those of level 0 halved L times;
one that the file does not store is refused. Images that are no pyramids have level 0 only, and JPEG and PNG are decoded from the
top down to the region.

OUT.npy is an array of shape (y, x) or (y, x, channel), little-endian. PNG holds 1 to 4 channels of 8 or 16 bits without a
sign, .npy and .tif every kind. The output appears when it is whole. Nothing is built for it, but for the image that a planet names,
which --cache keeps.")]
pub(crate) struct CropArgs {
    /// The container, tile directory or image, or planet:BITS[:IMAGE]
    pub(crate) source: PathBuf,
    /// Column and row of the region's upper left texel, in texels of the level
    #[arg(long, value_name = "X,Y", value_parser = parse_at)]
    pub(crate) at: [u32; 2],
    /// Columns and rows of the region, in texels of the level
    #[arg(long, value_name = "WxH", value_parser = parse_texels)]
    pub(crate) size: [u32; 2],
    /// The level; 0 is the finest
    #[arg(long, default_value_t = 0, value_name = "L")]
    pub(crate) level: u32,
    /// Name of the layer, of a container [default: the first]
    #[arg(long, value_name = "NAME")]
    pub(crate) layer: Option<String>,
    /// The file to write: .npy, .png, .tif or .tiff
    #[arg(short, long, value_name = "OUT", value_parser = parse_output)]
    pub(crate) output: Output,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}

/// A file to write, and its format.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Output {
    pub(crate) path: PathBuf,
    pub(crate) format: CropFormat,
}

impl CropArgs {
    pub(crate) fn region(&self) -> CropRegion {
        CropRegion { at: self.at, size: self.size }
    }
}

fn parse_texels(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once(['x', 'X']).and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    let sides = sides.filter(|sides: &[u32; 2]| sides.iter().all(|side| *side > 0));
    sides.ok_or_else(|| "write columns and rows in texels, at least one each, as in 512x256".into())
}

fn parse_output(text: &str) -> Result<Output, String> {
    let path = PathBuf::from(text);
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    let format = match ending.as_deref() {
        Some("npy") => CropFormat::Npy,
        Some("png") => CropFormat::Png,
        Some("tif" | "tiff") => CropFormat::Tiff,
        _ => return Err("give it the ending .npy, .png or .tif, which says its format".into()),
    };
    Ok(Output { path, format })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_outputs_are_what_they_say() {
        assert_eq!(parse_texels("12x7"), Ok([12, 7]));
        for bad in ["", "12", "0x4", "4x0", "-1x2", "1x2x3", "4294967296x1"] {
            assert!(parse_texels(bad).is_err(), "{bad}");
        }
        assert_eq!(parse_output("a/b.TIF").unwrap().format, CropFormat::Tiff);
        for bad in ["a", "a.jpg", ".npy", "a.npy/b"] {
            assert!(parse_output(bad).is_err(), "{bad}");
        }
    }
}
