//! OpenEXR images made on the spot.

use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, IntegerBounds, Layer,
    LayerAttributes, LineOrder, SmallVec, Vec2, WritableImage,
};

/// A file of one layer of such columns and rows. With `moved` its data window lies elsewhere than its display
/// window.
pub fn exr_of(
    size: [usize; 2],
    encoding: Encoding,
    channels: Vec<(&str, FlatSamples)>,
    moved: bool,
) -> Vec<u8> {
    let channels: SmallVec<[AnyChannel<FlatSamples>; 4]> =
        channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples)).collect();
    let mut attributes = LayerAttributes::named("");
    attributes.layer_name = None;
    let mut window = (size[0], size[1]);
    if moved {
        attributes.layer_position = Vec2(5, -2);
        window = (100, 90);
    }
    let layer = Layer::new((size[0], size[1]), attributes, encoding, AnyChannels::sort(channels));
    let mut image = Image::from_layer(layer);
    image.attributes.display_window = IntegerBounds::new((0, 0), window);
    let mut out = Cursor::new(Vec::new());
    image.write().to_buffered(&mut out).unwrap();
    out.into_inner()
}

/// Blocks in the order of rows.
pub fn encoding(compression: Compression, blocks: Blocks) -> Encoding {
    Encoding { compression, blocks, line_order: LineOrder::Increasing }
}
