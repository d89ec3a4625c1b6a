//! What `vastex build` is told.

use std::path::PathBuf;

use clap::ValueEnum;
use vastex::{AddressMode, Geometry};
use vastex_build::{Inset, LayerFilter, LayerInput, LevelsFrom, NodataRule, PartOf, Quality};
use vastex_core::{GeometrySpec, LayerFormat, PAGE_TEXELS};

use super::common::{DiskArgs, PrintArgs, ThreadArgs};
use super::inset::{of_layer, parse_inset};
use super::layer::parse_layer;
use super::volume_build::VolumeArgs;
use super::{ClapArgs, named, value_error};

/// What `vastex build` is told.
#[derive(Debug, ClapArgs)]
#[command(after_help = "\
Examples:
  vastex build earth.tif -o earth.vastex --address wrap,clamp
  vastex build slide.png -o slide.vastex --compress zstd --page 256
  vastex build slide.dzi -o slide.vastex
  vastex build scan.svs -o scan.vastex --levels keep
  vastex build heights.png -o heights.vastex --linear off --json
  vastex build earth.tif -o 2.part --shard 2/8
  vastex build huge.tif -o huge.vastex --resume --memory-mib 200
  vastex build slide.tif -o slide.vastex --mask tissue.png
  vastex build earth.tif -o earth.vastex --format bc7-srgb
  vastex build world.tif -o world.vastex --inset rome.png@738816,184320,5 --inset alps.tif@34000,8000,1
  vastex build -o ground.vastex --layer color=c.tif:bc1-srgb --layer normal=n.png:bc5 --layer height=h.png:r16:max
  vastex build head.nii.gz -o head.vastex                      # a volume (docs/volumes.md): OME-Zarr, NIfTI, TIFF stack, raw
  vastex build stack.tif -o stack.zarr --shards 8 --downsample max

The output appears when it is whole; after an error or Ctrl-C nothing is left behind. With --resume, what was built so far
stays beside the output (.NAME.partial, .NAME.journal; with insets .NAME.*.insets), and the same command goes on with it to the same bytes; after a crash,
too, whether or not that build had --resume. Without --resume a build starts anew.

Of a volume, --page, --border, --compress, --align, --threads, --memory-mib, --tolerant, --durable and the options marked
\"volume\" count; the others are of images. A TIFF file of several pages of one size is a volume; --layer color=FILE takes its
first page as an image.",
mut_arg("threads", |arg| arg.help("Threads that decode, filter and encode [default: one for each core]")))]
pub(crate) struct BuildArgs {
    /// The image, a volume, or a tile directory: of Gaia Sky, of Celestia (or its .ctx), of Deep Zoom (or its
    /// .dzi), of pages
    #[arg(value_name = "IN", required_unless_present = "layers", conflicts_with = "layers")]
    pub(crate) input: Option<PathBuf>,
    /// A layer, instead of IN; once for each. Images have one size, or half or a quarter of the largest;
    /// others are resampled to the nearest of these. FILE may hold colons: only the name of a format at its
    /// end counts, and that of a filter after it (empty for the usual format, as in height=h.png::max)
    #[arg(long = "layer", value_name = "NAME=FILE[:FORMAT[:FILTER]]", value_parser = parse_layer)]
    pub(crate) layers: Vec<LayerInput>,
    /// The format of the one layer: r8, rg8, rgba8, rgba8-srgb, r16, rgba16, r16f, rgba16f, r32f, bc1,
    /// bc1-srgb, bc3, bc3-srgb, bc4, bc5, bc6h, bc7 or bc7-srgb [default: what holds the image]
    #[arg(long, value_name = "FORMAT", value_parser = named(&LayerFormat::ALL, LayerFormat::name), hide_possible_values = true, conflicts_with = "layers")]
    pub(crate) format: Option<LayerFormat>,
    /// How well block-compressed layers (bc1 to bc7) are encoded
    #[arg(long, value_enum, default_value_t = Encode::Normal)]
    pub(crate) quality: Encode,
    /// The container to make; of a volume also OUT.zarr, an OME-Zarr
    #[arg(short, long, value_name = "OUT.vastex")]
    pub(crate) output: PathBuf,
    /// Texels of payload per side of a page; of a volume, voxels per side of a brick, or of a chunk of
    /// OUT.zarr [default: 128; of a volume 64]
    #[arg(long, value_name = "TEXELS", value_parser = page_parser())]
    pub(crate) page: Option<u32>,
    /// Texels of border on each side of a page [default: 4; of a volume 1]
    #[arg(long, value_name = "TEXELS")]
    pub(crate) border: Option<u32>,
    /// How tiles are compressed: none, lz4 or zstd; of OUT.zarr none, zstd or gzip [default: lz4; of OUT.zarr
    /// zstd]
    #[arg(long, value_enum, hide_possible_values = true)]
    pub(crate) compress: Option<Compress>,
    /// Whether colour is filtered in linear light; else as it is stored
    #[arg(long, action = clap::ArgAction::Set, default_value = "on", value_name = "on|off", value_parser = named(&[true, false], on_off))]
    pub(crate) linear: bool,
    /// How coarser levels are made: box, gauss4, sharpen4, kaiser or lanczos; gauss3 or sharpen5, which keep
    /// texel positions; min, max, majority or nearest, which pick. Followed by -linear for colour as light,
    /// weighted by alpha, or by -normal for vectors; as it is, each channel is filtered as it is stored
    /// [default: by the layer's name and format, mostly box-linear or box]
    #[arg(long, value_name = "FILTER")]
    pub(crate) filter: Option<LayerFilter>,
    /// Which level each level is made from: the next finer one; the one two finer, which is slower and truer;
    /// or the finest, level 0, which is slowest and truest
    #[arg(long, default_value = "chain", value_name = "chain|two|zero", value_parser = named(&LevelsFrom::ALL, LevelsFrom::name))]
    pub(crate) levels_from: LevelsFrom,
    /// Which texels are without data, so that coarser levels leave them out: those of the value that the file
    /// names (GDAL_NODATA of TIFF), none (off), or those of a value, as the file's samples are
    #[arg(long, default_value = "file", value_name = "file|off|VALUE", allow_hyphen_values = true)]
    pub(crate) nodata: NodataRule,
    /// Where coarser levels come from: new, all made from level 0; keep, those of IN (a TIFF pyramid or a
    /// tile directory), where missing ones are filtered from finer levels up to three away, else interpolated
    #[arg(long = "levels", action = clap::ArgAction::Set, default_value = "new", value_name = "new|keep", value_parser = named(&[false, true], new_or_keep))]
    pub(crate) keep_levels: bool,
    /// What lies beyond the edges: clamp, wrap, mirror or border:RRGGBB[AA], a colour; for x and y alike, or
    /// one for each
    #[arg(long, default_value = "clamp", value_name = "X[,Y]", value_parser = parse_address)]
    pub(crate) address: Edges,
    /// An image of the same shape, of any size: where it is black or transparent, pages get no tile, and
    /// coarser ones are shown
    #[arg(long, value_name = "FILE")]
    pub(crate) mask: Option<PathBuf>,
    /// Give no tile to pages that are transparent in all layers with alpha
    #[arg(long)]
    pub(crate) drop_transparent: bool,
    /// An image over IN, or over that of the layer NAME, as fine as it (LEVEL 0) or LEVEL levels finer, each
    /// of which doubles the texels; X,Y are the column and row at which it begins, counted in its own texels;
    /// over a wrapping edge it goes on at the other side. Pages of the finer levels are there only where
    /// insets are. Once for each; finer ones lie over coarser ones, later ones over earlier ones
    #[arg(long = "inset", value_name = "[NAME=]IMAGE@X,Y,LEVEL", value_parser = parse_inset, conflicts_with = "shard")]
    pub(crate) insets: Vec<Inset>,
    /// Make only part I of N of the container, for `vastex merge`; each part can be made on a machine of its
    /// own
    #[arg(long, value_name = "I/N", value_parser = parse_shard)]
    pub(crate) shard: Option<PartOf>,
    /// Go on with what an interrupted build of the same input with the same options left beside the output,
    /// if there is any; keep what is written if this one is interrupted
    #[arg(long)]
    pub(crate) resume: bool,
    /// Write the finished file once more, the tiles of each level along a space-filling curve: near in the
    /// image is then near in the file, which slow disks and networks like
    #[arg(long, conflicts_with = "shard")]
    pub(crate) reorder: bool,
    /// Begin every tile at a multiple of so many bytes, for direct I/O: a power of two, 4096 to 65536 or 4K
    /// to 64K
    #[arg(long, value_name = "BYTES", value_parser = parse_align)]
    pub(crate) align: Option<u32>,
    #[command(flatten)]
    pub(crate) threads: ThreadArgs,
    /// Take no more memory than this: buffers become smaller, and what cannot be built so is refused before
    /// it begins [default: 16384]
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..=1 << 40))]
    pub(crate) memory_mib: Option<u64>,
    /// Take JPEG files that are damaged or end early for what can be made of them, with a note, instead of
    /// refusing them
    #[arg(long)]
    pub(crate) tolerant: bool,
    #[command(flatten)]
    pub(crate) volume: VolumeArgs,
    #[command(flatten)]
    pub(crate) disk: DiskArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}

/// How tiles are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Compress {
    /// Not at all
    None,
    /// Fast to decode
    Lz4,
    /// Smaller
    Zstd,
    /// Of OME-Zarr, for programs that read nothing else
    Gzip,
}

/// What lies beyond the edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Edges {
    /// In x and in y.
    pub(crate) modes: [AddressMode; 2],
    /// The border colour.
    pub(crate) color: [u8; 4],
}

/// How well block-compressed layers are encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Encode {
    /// The fastest
    Fast,
    /// Half as fast in bc7, and 0.9 dB better
    Normal,
    /// A twentieth as fast in bc7, and 1.7 dB better; bc1 and bc3 at 1 megatexel a second and core, and 1.1
    /// dB better
    Best,
}

impl From<Encode> for Quality {
    fn from(encode: Encode) -> Quality {
        match encode {
            Encode::Fast => Quality::Fast,
            Encode::Normal => Quality::Normal,
            Encode::Best => Quality::Best,
        }
    }
}

impl BuildArgs {
    /// What is built: the layers, or the image as the one layer.
    pub(crate) fn inputs(&self) -> Vec<LayerInput> {
        let image = self.input.as_ref().map(|path| LayerInput { format: self.format, ..path.into() });
        image.into_iter().chain(self.layers.iter().cloned()).collect()
    }

    /// The images that lie over those of the layers.
    pub(crate) fn insets(&self) -> Vec<Inset> {
        match self.layers.is_empty() {
            true => self.insets.clone(),
            false => self.insets.iter().map(of_layer).collect(),
        }
    }

    /// Texels of payload per side of an image's page.
    pub(crate) fn image_page(&self) -> u32 {
        self.page.unwrap_or(128)
    }

    /// Texels of border on each side of an image's page.
    pub(crate) fn image_border(&self) -> u32 {
        self.border.unwrap_or(4)
    }

    /// The border must suit the page.
    pub(super) fn check(&self) -> Result<(), clap::Error> {
        let border = self.image_border();
        let spec = GeometrySpec { page: self.image_page(), border, ..GeometrySpec::image(1, 1) };
        Geometry::new(spec)
            .map(drop)
            .map_err(|error| value_error(&format!("'{border}' for '--border <TEXELS>': {error}")))
    }
}

fn page_parser() -> clap::builder::RangedI64ValueParser<u32> {
    let (low, high) = (*PAGE_TEXELS.start(), *PAGE_TEXELS.end());
    clap::value_parser!(u32).range(i64::from(low)..=i64::from(high))
}

fn new_or_keep(keeps: bool) -> &'static str {
    if keeps { "keep" } else { "new" }
}

fn on_off(on: bool) -> &'static str {
    if on { "on" } else { "off" }
}

fn parse_shard(text: &str) -> Result<PartOf, String> {
    let numbers =
        text.split_once('/').and_then(|(part, parts)| Some((part.parse().ok()?, parts.parse().ok()?)));
    let shard = numbers.and_then(|(part, parts)| PartOf::new(part, parts));
    shard.ok_or_else(|| "write the part and how many there are, as in 2/8".into())
}

fn parse_align(text: &str) -> Result<u32, String> {
    let (digits, unit) = match text.strip_suffix(['K', 'k']) {
        Some(digits) => (digits, 1024),
        None => (text, 1),
    };
    let align = digits.parse::<u32>().ok().and_then(|number| number.checked_mul(unit));
    align
        .filter(|align| align.is_power_of_two() && (4096..=65_536).contains(align))
        .ok_or_else(|| "write a power of two from 4K to 64K".into())
}

/// One address mode for both axes, or one for each.
fn parse_address(text: &str) -> Result<Edges, String> {
    let mode = |name: &str| match name {
        "clamp" => Ok((AddressMode::Clamp, None)),
        "wrap" => Ok((AddressMode::Wrap, None)),
        "mirror" => Ok((AddressMode::Mirror, None)),
        _ => match name.strip_prefix("border:").map(parse_color) {
            Some(Some(color)) => Ok((AddressMode::Border, Some(color))),
            Some(None) => {
                Err(format!("'{name}' has no colour of 6 or 8 hexadecimal digits; write border:RRGGBB[AA]"))
            }
            None => Err(format!(
                "'{name}' is none of clamp, wrap, mirror and border:RRGGBB[AA]; write one, or two as in wrap,clamp"
            )),
        },
    };
    let (x, y) = text.split_once(',').unwrap_or((text, text));
    let ((x, of_x), (y, of_y)) = (mode(x)?, mode(y)?);
    match (of_x, of_y) {
        (Some(x), Some(y)) if x != y => {
            Err("a texture has one border colour; write the same for x and y".into())
        }
        _ => Ok(Edges { modes: [x, y], color: of_x.or(of_y).unwrap_or_default() }),
    }
}

/// Red, green, blue and, if it is there, alpha, in two hexadecimal digits each.
fn parse_color(digits: &str) -> Option<[u8; 4]> {
    if ![6, 8].contains(&digits.len()) || !digits.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return None;
    }
    let byte =
        |n: usize| digits.get(2 * n..2 * n + 2).map_or(Some(255), |pair| u8::from_str_radix(pair, 16).ok());
    Some([byte(0)?, byte(1)?, byte(2)?, byte(3)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_counted_from_one() {
        assert_eq!(parse_shard("2/8").ok(), PartOf::new(2, 8));
        for bad in ["", "1", "0/3", "4/3", "1/0", "-1/2", "1/2/3", "a/b"] {
            assert!(parse_shard(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn alignments_are_those_of_disks() {
        assert_eq!((parse_align("4K"), parse_align("65536")), (Ok(4096), Ok(65_536)));
        for bad in ["", "K", "1", "2K", "6K", "128K", "4M", "-4K", "4194304K", "99999999999"] {
            assert!(parse_align(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn one_address_mode_serves_both_axes() {
        use vastex::AddressMode::{Border, Clamp, Mirror, Wrap};
        let edges = |modes, color| Ok(Edges { modes, color });
        assert_eq!(parse_address("wrap"), edges([Wrap, Wrap], [0; 4]));
        assert_eq!(parse_address("mirror,clamp"), edges([Mirror, Clamp], [0; 4]));
        assert_eq!(parse_address("wrap,border:ff8000"), edges([Wrap, Border], [255, 128, 0, 255]));
        assert_eq!(parse_address("border:01020304"), edges([Border, Border], [1, 2, 3, 4]));
        for bad in [
            "",
            "wrap,",
            ",wrap",
            "round",
            "wrap,clamp,wrap",
            "border",
            "border:",
            "border:12345",
            "border:+1+2+3",
            "border:000000,border:000001",
            "border:ää1",
        ] {
            assert!(parse_address(bad).is_err(), "{bad}");
        }
    }
}
