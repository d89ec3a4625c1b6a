//! What `vastex crop` is told.

use std::ffi::OsString;
use std::path::PathBuf;
use std::str::FromStr;

use clap::builder::{OsStringValueParser, TypedValueParser};
use vastex_build::CropFormat;

use super::common::PrintArgs;
use super::{CacheArgs, ClapArgs, CommandFactory};

/// What `vastex crop` is told.
#[derive(Debug, ClapArgs)]
#[command(after_help = "\
Examples:
  vastex crop earth.vastex --at 8192,4096 --size 1024x512 -o alps.png
  vastex crop slide.svs --at 1000,2000 --size 4096x4096 --level 2 -o tissue.npy
  vastex crop ground.vastex --layer height --at 0,0 --size 512x512 -o height.tif
  vastex crop cells.zarr --at 100,200,10 --size 64x64x32 --channel 1 --time 5 -o box.npy

Values are those that are stored, exactly: nothing is filtered, converted or interpolated; JPEG is decoded as by libjpeg-turbo,
layers compressed in blocks as GPUs do. Of a TIFF pyramid, level L is the image whose sides are those of level 0 halved L times;
one that the file does not store is refused. Images that are no pyramids have level 0 only, and JPEG and PNG are decoded from the
top down to the region.

Of a volume (docs/volumes.md), --at and --size have three numbers, the output is .npy with an array of shape (z, y, x), and level L
is the L-th that is stored.

OUT.npy is an array of shape (y, x) or (y, x, channel), little-endian. PNG holds 1 to 4 channels of 8 or 16 bits without a
sign, .npy and .tif every kind. Numbers of a palette, grey of 1, 2 and 4 bits and inks (CMYK) stay what they are: pictures of them
have the palette, as many bits and, as .tif, inks, which PNG cannot hold. The output appears when it is whole. Nothing is built for it, but for the image that a planet names,
which --cache keeps.")]
pub(crate) struct CropArgs {
    /// The container, tile directory or image, planet:BITS[:IMAGE], or a volume
    pub(crate) source: PathBuf,
    /// Column and row of the region's upper left texel, in texels of the level; of a volume, x, y and z of
    /// its first voxel
    #[arg(long, value_name = "X,Y[,Z]", value_parser = parse_at, allow_hyphen_values = true)]
    pub(crate) at: CropPlace,
    /// Columns and rows of the region, in texels of the level; of a volume, voxels along x, y and z
    #[arg(long, value_name = "WxH[xD]", value_parser = parse_size)]
    pub(crate) size: CropSize,
    /// The level; 0 is the finest
    #[arg(long, default_value_t = 0, value_name = "L")]
    pub(crate) level: u32,
    /// Name of the layer, of a container [default: the first]
    #[arg(long, value_name = "NAME")]
    pub(crate) layer: Option<String>,
    /// The channel of a volume
    #[arg(long, default_value_t = 0, value_name = "C")]
    pub(crate) channel: u64,
    /// The time of a volume
    #[arg(long, default_value_t = 0, value_name = "T")]
    pub(crate) time: u64,
    /// The file to write: .npy, .png, .tif or .tiff
    #[arg(short, long, value_name = "OUT", value_parser = OsStringValueParser::new().try_map(parse_output))]
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

/// A place in an image, or in a volume. Whether it lies in there, the source knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CropPlace {
    Image([i64; 2]),
    Volume([i64; 3]),
}

/// Texels along the axes of an image, or voxels along those of a volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CropSize {
    Image([u32; 2]),
    Volume([u64; 3]),
}

impl CropArgs {
    /// That place and size are of one kind, and the output fits it.
    pub(super) fn check(&self) -> Result<(), clap::Error> {
        let says = match (self.at, self.size) {
            (CropPlace::Image(_), CropSize::Image(_)) if self.channel > 0 || self.time > 0 => {
                "--channel and --time are of volumes, whose --at and --size have three numbers"
            }
            (CropPlace::Volume(_), CropSize::Volume(_)) if self.output.format != CropFormat::Npy => {
                "a region of a volume is written as an array of NumPy; give the output the ending .npy"
            }
            (CropPlace::Volume(_), CropSize::Volume(_)) if self.layer.is_some() => {
                "a volume has channels and no layers; use --channel"
            }
            (CropPlace::Image(_), CropSize::Image(_)) | (CropPlace::Volume(_), CropSize::Volume(_)) => {
                return Ok(());
            }
            _ => "give --at and --size two numbers each, of an image, or three, of a volume",
        };
        Err(super::Args::command().error(clap::error::ErrorKind::ArgumentConflict, says))
    }
}

fn parse_at(text: &str) -> Result<CropPlace, String> {
    let place = match text.split(',').collect::<Vec<_>>()[..] {
        [x, y] => numbers([x, y]).map(CropPlace::Image),
        [x, y, z] => numbers([x, y, z]).map(CropPlace::Volume),
        _ => None,
    };
    place.ok_or_else(|| "write column and row, as in 512,256, or x, y and z, as in 10,20,30".into())
}

fn parse_size(text: &str) -> Result<CropSize, String> {
    let size = match text.split(['x', 'X']).collect::<Vec<_>>()[..] {
        [x, y] => numbers([x, y]).filter(|sides| !sides.contains(&0)).map(CropSize::Image),
        [x, y, z] => numbers([x, y, z]).filter(|sides| !sides.contains(&0)).map(CropSize::Volume),
        _ => None,
    };
    let says = "write columns and rows in texels, at least one each, as in 512x256, or voxels along x, y and z, as in 64x64x32";
    size.ok_or_else(|| says.into())
}

/// Whole numbers.
fn numbers<T: FromStr + Copy + Default, const N: usize>(words: [&str; N]) -> Option<[T; N]> {
    let mut numbers = [T::default(); N];
    for (number, word) in numbers.iter_mut().zip(words) {
        *number = word.trim().parse().ok()?;
    }
    Some(numbers)
}

fn parse_output(name: OsString) -> Result<Output, String> {
    let path = PathBuf::from(name);
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
        assert_eq!(parse_size("12x7"), Ok(CropSize::Image([12, 7])));
        assert_eq!(parse_size("12x7x3"), Ok(CropSize::Volume([12, 7, 3])));
        assert_eq!(parse_at("0,7"), Ok(CropPlace::Image([0, 7])));
        assert_eq!(parse_at("-1,4294967296"), Ok(CropPlace::Image([-1, 1 << 32])));
        assert_eq!(parse_at("0, 7, -9"), Ok(CropPlace::Volume([0, 7, -9])));
        for bad in ["", "12", "0x4", "4x0", "-1x2", "1x2x0", "1x2x3x4", "4294967296x1"] {
            assert!(parse_size(bad).is_err(), "{bad}");
        }
        for bad in ["", "1", "1,-", "1,2,3,4", "1x2", "-o"] {
            assert!(parse_at(bad).is_err(), "{bad}");
        }
        assert_eq!(parse_output("a/b.TIF".into()).unwrap().format, CropFormat::Tiff);
        for bad in ["a", "a.jpg", ".npy", "a.npy/b"] {
            assert!(parse_output(bad.into()).is_err(), "{bad}");
        }
    }
}
