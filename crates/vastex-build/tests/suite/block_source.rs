//! Pixels in memory, compressed in blocks as they are read, against builds of the same pixels.

use std::sync::Arc;

use pollster::block_on;
use vastex_build::{BlockSource, BlockSourceError, BuildOptions, LayerInput, Quality, build};
use vastex_core::LayerFormat;
use vastex_tiles::{Container, ImageOptions, ImageSource, TileSource, conformance};

use crate::common::texels;

const SIZE: [u32; 2] = [300, 141];

/// A picture in a PNG file of so many channels, built as `format`; and its pixels, in the layer's format
/// without blocks.
fn built(directory: &std::path::Path, channels: usize, format: LayerFormat) -> (Container, Vec<u8>) {
    let pixels = texels(SIZE[0] as usize * SIZE[1] as usize * channels, 3);
    let path = directory.join("a.png");
    let mut encoder = png::Encoder::new(std::fs::File::create(&path).unwrap(), SIZE[0], SIZE[1]);
    encoder.set_color(if channels == 1 { png::ColorType::Grayscale } else { png::ColorType::Rgba });
    encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
    let input = LayerInput { format: Some(format), ..LayerInput::from(path) };
    let output = directory.join("a.vastex");
    build(&[input], &output, &BuildOptions::default(), &()).unwrap();
    (Container::open_file(&output).unwrap(), pixels)
}

#[test]
fn tiles_are_those_that_a_build_makes() {
    use LayerFormat::{Bc1Srgb, Bc3Srgb, Bc4, Bc7Srgb, R8, Rgba8Srgb};
    for (format, plain) in
        [(Bc1Srgb, Rgba8Srgb), (Bc3Srgb, Rgba8Srgb), (Bc7Srgb, Rgba8Srgb), (Bc4, R8), (R8, R8)]
    {
        let directory = tempfile::tempdir().unwrap();
        let channels = if plain == R8 { 1 } else { 4 };
        let (container, pixels) = built(directory.path(), channels, format);
        let image = ImageSource::new(plain, SIZE, pixels, &ImageOptions::default()).unwrap();
        let source = BlockSource::new(Arc::new(image), &[format], Quality::default()).unwrap();
        assert_eq!(source.description(), container.description(), "{format:?}");
        assert_eq!(conformance(&source), Ok(()), "{format:?}");
        for pos in source.description().geometry.pages() {
            let tile = |source: &dyn TileSource| {
                block_on(source.read(pos)).unwrap().decode(source.description()).unwrap()
            };
            assert!(tile(&source) == tile(&container), "{format:?}: {pos}");
        }
    }
}

#[test]
fn what_is_no_such_source_is_refused_with_what_can_be() {
    let image = |page| {
        let options = ImageOptions { page, border: 2, ..ImageOptions::default() };
        let pixels = vec![0; SIZE[0] as usize * SIZE[1] as usize * 4];
        Arc::new(ImageSource::new(LayerFormat::Rgba8, SIZE, pixels, &options).unwrap())
    };
    let error = |page, formats: &[LayerFormat]| {
        BlockSource::new(image(page), formats, Quality::Fast).err().map(|error| error.to_string()).unwrap()
    };
    let said = error(64, &[LayerFormat::Bc7Srgb]);
    assert!(said.contains("rgba8 cannot become bc7-srgb; it can become rgba8, bc1, bc3, bc7"), "{said}");
    let said = error(64, &[]);
    assert!(said.contains("0 formats for 1 layers"), "{said}");
    let said = error(66, &[LayerFormat::Bc1]);
    assert!(said.ends_with("give the source pages and borders of whole blocks"), "{said}");
    let plain = ImageSource::new(LayerFormat::Bc1, SIZE, vec![0; 1 << 20], &ImageOptions::default());
    let said = plain.err().unwrap().to_string();
    assert!(said.contains("BlockSource"), "{said}");
    assert_eq!(
        BlockSource::new(image(64), &[LayerFormat::Bc1; 2], Quality::Fast).err(),
        Some(BlockSourceError::Count { formats: 2, layers: 1 })
    );
}
