//! What `vastex replace` is told.

use std::path::PathBuf;

use vastex_build::{LayerImage, LayerInput};

use super::ClapArgs;
use super::build::Encode;
use super::common::{DiskArgs, PrintArgs, ThreadArgs};
use super::layer::parse_layer;

/// What `vastex replace` is told.
#[derive(Debug, ClapArgs)]
#[command(after_help = "\
Examples:
  vastex replace earth.vastex --at 21600,5400 alps.tif
  vastex replace slide.vastex --at 0,0 corner.png --json
  vastex replace ground.vastex --at 4096,512 --layer color=c.png --layer height=h.png

Only the pages that show the region are written, on all levels, at the end of the file; layers that are not named keep every
byte. Images of several layers are of one region: of a layer at half the resolution half the texels. What crosses a wrapping
edge goes on at the other side. Of layers compressed in blocks, those blocks are encoded again that hold a texel that
changes, with what the others beside it decode to. Whoever has the file open goes on reading it as it was. After an error, Ctrl-C or a crash it is as it was before; what was replaced stays in the file until it
is built again.",
mut_arg("durable", |arg| arg.help("Wait until the disk has the new version; a loss of power leaves a whole version in any case")))]
pub(crate) struct ReplaceArgs {
    /// The container to change
    pub(crate) file: PathBuf,
    /// Column and row of the finest level at which the image begins, in texels of the texture
    #[arg(long, value_name = "X,Y", value_parser = parse_at)]
    pub(crate) at: [u32; 2],
    /// The image to put there, in a texture of one layer
    #[arg(required_unless_present = "layers", conflicts_with = "layers")]
    pub(crate) image: Option<PathBuf>,
    /// The image for a layer, instead of IMAGE; once for each layer that changes. FORMAT and FILTER, if they
    /// are given, must be those that the layer has
    #[arg(long = "layer", value_name = "NAME=FILE[:FORMAT[:FILTER]]", value_parser = parse_layer)]
    pub(crate) layers: Vec<LayerInput>,
    /// How well block-compressed layers (bc1 to bc7) are encoded
    #[arg(long, value_enum, default_value_t = Encode::Normal)]
    pub(crate) quality: Encode,
    #[command(flatten)]
    pub(crate) threads: ThreadArgs,
    /// Take JPEG files that are damaged or end early for what can be made of them, with a note, instead of
    /// refusing them
    #[arg(long)]
    pub(crate) tolerant: bool,
    #[command(flatten)]
    pub(crate) disk: DiskArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}

impl ReplaceArgs {
    /// What goes where.
    pub(crate) fn images(&self) -> Vec<LayerImage> {
        let alone = self.image.iter().map(LayerImage::from);
        alone.chain(self.layers.iter().cloned().map(LayerImage::from)).collect()
    }
}

pub(super) fn parse_at(text: &str) -> Result<[u32; 2], String> {
    let at = text.split_once(',').and_then(|(x, y)| Some([x.parse().ok()?, y.parse().ok()?]));
    at.ok_or_else(|| "write column and row in texels from the upper left, as in 512,0".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_a_column_and_a_row() {
        assert_eq!(parse_at("12,0"), Ok([12, 0]));
        for bad in ["", "5", "5,", "-1,5", "1,2,3", "1x2", "4294967296,0"] {
            assert!(parse_at(bad).is_err(), "{bad}");
        }
    }
}
