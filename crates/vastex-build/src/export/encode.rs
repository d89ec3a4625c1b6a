//! A tile as an image file.

use mozjpeg::{ColorSpace, Compress};
use png::{BitDepth, ColorType, ScaledFloat};
use vastex_core::LayerFormat;

use super::TileFormat;

/// Quality from which colour is kept at full resolution.
const FULL_COLOR_QUALITY: u8 = 90;

/// How tiles are encoded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Encoder {
    pub(super) format: TileFormat,
    pub(super) layer: LayerFormat,
    /// Of JPEG, 1 to 100.
    pub(super) quality: u8,
}

/// Returns true if a layer's texels can be JPEG, transparency left aside.
pub(super) fn fits_jpeg(layer: LayerFormat) -> bool {
    matches!(layer, LayerFormat::R8 | LayerFormat::Rgba8 | LayerFormat::Rgba8Srgb)
}

/// Returns true if a layer's texels can be PNG: integers of 8 and 16 bits.
pub(super) fn fits_png(layer: LayerFormat) -> bool {
    color_of(layer).is_some()
}

/// The kind of PNG that holds a layer's texels.
fn color_of(layer: LayerFormat) -> Option<(ColorType, BitDepth)> {
    match layer {
        LayerFormat::R8 => Some((ColorType::Grayscale, BitDepth::Eight)),
        LayerFormat::R16 => Some((ColorType::Grayscale, BitDepth::Sixteen)),
        LayerFormat::Rg8 => Some((ColorType::GrayscaleAlpha, BitDepth::Eight)),
        LayerFormat::Rgba8 | LayerFormat::Rgba8Srgb => Some((ColorType::Rgba, BitDepth::Eight)),
        LayerFormat::Rgba16 => Some((ColorType::Rgba, BitDepth::Sixteen)),
        _ => None,
    }
}

impl Encoder {
    /// The ending of a tile's file name.
    pub(super) fn extension(&self) -> &'static str {
        self.format.extension()
    }

    /// The file of a tile, and whether transparency was left out.
    pub(super) fn encode(&self, texels: &[u8], size: [u32; 2]) -> Result<(Vec<u8>, bool), String> {
        let has_alpha = matches!(self.layer, LayerFormat::Rgba8 | LayerFormat::Rgba8Srgb);
        let opaque = !has_alpha || texels.as_chunks::<4>().0.iter().all(|texel| texel[3] == 255);
        let narrowed = has_alpha && (opaque || self.format == TileFormat::Jpeg);
        let rgb: Vec<u8> = match narrowed {
            true => texels.as_chunks::<4>().0.iter().flat_map(|&[r, g, b, _]| [r, g, b]).collect(),
            false => Vec::new(),
        };
        let texels = if narrowed { &rgb } else { texels };
        match self.format {
            TileFormat::Png => {
                self.png(texels, size, narrowed).map(|file| (file, false)).map_err(|e| e.to_string())
            }
            TileFormat::Jpeg => {
                let file = self.jpeg(texels, size, narrowed).map_err(|e| e.to_string())?;
                Ok((file, !opaque))
            }
        }
    }

    fn png(&self, texels: &[u8], size: [u32; 2], is_rgb: bool) -> Result<Vec<u8>, png::EncodingError> {
        let Some((color, depth)) = color_of(self.layer) else {
            return Err(png::EncodingError::IoError(unsupported(self.layer)));
        };
        let color = if is_rgb { ColorType::Rgb } else { color };
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, size[0], size[1]);
        encoder.set_color(color);
        encoder.set_depth(depth);
        encoder.set_compression(png::Compression::Fast);
        if matches!(self.layer, LayerFormat::Rgba8 | LayerFormat::Rgba16) {
            // Says that the colours are linear.
            encoder.set_source_gamma(ScaledFloat::new(1.0));
        }
        let mut writer = encoder.write_header()?;
        if depth == BitDepth::Sixteen {
            let swapped: Vec<u8> =
                texels.as_chunks::<2>().0.iter().flat_map(|&[low, high]| [high, low]).collect();
            writer.write_image_data(&swapped)?;
        } else {
            writer.write_image_data(texels)?;
        }
        writer.finish()?;
        Ok(file)
    }

    fn jpeg(&self, texels: &[u8], size: [u32; 2], is_rgb: bool) -> std::io::Result<Vec<u8>> {
        let space = if is_rgb { ColorSpace::JCS_RGB } else { ColorSpace::JCS_GRAYSCALE };
        let mut compress = Compress::new(space);
        compress.set_fastest_defaults();
        compress.set_size(size[0] as usize, size[1] as usize);
        compress.set_quality(f32::from(self.quality));
        compress.set_optimize_coding(true);
        if is_rgb {
            let chroma = if self.quality < FULL_COLOR_QUALITY { (2, 2) } else { (1, 1) };
            compress.set_chroma_sampling_pixel_sizes(chroma, chroma);
        }
        let mut started = compress.start_compress(Vec::new())?;
        started.write_scanlines(texels)?;
        started.finish()
    }
}

fn unsupported(layer: LayerFormat) -> std::io::Error {
    std::io::Error::other(format!("PNG cannot hold {}", layer.name()))
}

impl TileFormat {
    /// The ending of file names.
    pub const fn extension(self) -> &'static str {
        match self {
            TileFormat::Png => "png",
            TileFormat::Jpeg => "jpg",
        }
    }
}
