//! How the GPU holds a layer: the format of its texture array, and how shaders read it.
//!
//! What a device cannot filter is held as whole numbers or unfiltered floats and blended in the shader, so
//! that values stay exact; what it cannot decompress must come decoded ([`held_format`]).

use vastex_core::{Layer, LayerFormat};

use crate::filters::VolumeFilters;
use crate::kind::Atlas;

/// The format in which a pool on a device with these features holds a layer of `format`: the format itself,
/// or where the device cannot decompress it, that of the [decoded](LayerFormat::decoded) texels.
pub fn held_format(format: LayerFormat, features: wgpu::Features) -> LayerFormat {
    let is_known = !format.is_compressed() || features.contains(wgpu::Features::TEXTURE_COMPRESSION_BC);
    if is_known { format } else { format.decoded() }
}

/// The GPU's format for a layer, and how shaders read it. `None` if the device cannot decompress it.
///
/// Everything that is [`Atlas::Float`] is filtered by the device: 16-bit data and 32-bit floats where that
/// was asked for ([`required_features`](crate::required_features)).
pub fn texture_format(format: LayerFormat, features: wgpu::Features) -> Option<(wgpu::TextureFormat, Atlas)> {
    use LayerFormat::*;
    use wgpu::TextureFormat as Gpu;
    if held_format(format, features) != format {
        return None;
    }
    let has = |feature| features.contains(feature);
    let norm16 = has(wgpu::Features::TEXTURE_FORMAT_16BIT_NORM);
    let filtered = |gpu| (gpu, Atlas::Float);
    Some(match format {
        R8 => filtered(Gpu::R8Unorm),
        Rg8 => filtered(Gpu::Rg8Unorm),
        Rgba8 => filtered(Gpu::Rgba8Unorm),
        Rgba8Srgb => filtered(Gpu::Rgba8UnormSrgb),
        R16 if norm16 => filtered(Gpu::R16Unorm),
        R16 => (Gpu::R16Uint, Atlas::Uint16),
        Rgba16 if norm16 => filtered(Gpu::Rgba16Unorm),
        Rgba16 => (Gpu::Rgba16Uint, Atlas::Uint16Rgba),
        R16Float => filtered(Gpu::R16Float),
        Rgba16Float => filtered(Gpu::Rgba16Float),
        R32Float if has(wgpu::Features::FLOAT32_FILTERABLE) => filtered(Gpu::R32Float),
        R32Float => (Gpu::R32Float, Atlas::Unfiltered),
        Bc1 => filtered(Gpu::Bc1RgbaUnorm),
        Bc1Srgb => filtered(Gpu::Bc1RgbaUnormSrgb),
        Bc3 => filtered(Gpu::Bc3RgbaUnorm),
        Bc3Srgb => filtered(Gpu::Bc3RgbaUnormSrgb),
        Bc4 => filtered(Gpu::Bc4RUnorm),
        Bc5 => filtered(Gpu::Bc5RgUnorm),
        Bc6h => filtered(Gpu::Bc6hRgbUfloat),
        Bc7 => filtered(Gpu::Bc7RgbaUnorm),
        Bc7Srgb => filtered(Gpu::Bc7RgbaUnormSrgb),
        // Of volumes alone; what the first has no channel for is read as 0, so one text reads both.
        R32Uint => (Gpu::R32Uint, Atlas::Whole),
        Rg32Uint => (Gpu::Rg32Uint, Atlas::Whole),
    })
}

/// The format in which a pool of volumes holds a layer of `format`, on a device that filters as `filters`
/// says: the format itself; for 8 bits that the device does not filter well, 16 bits, or 16-bit floats, if it
/// filters those. Layers of other formats are held as they are, and the shader blends them if the device does
/// not do so well.
pub fn held_volume_format(format: LayerFormat, filters: VolumeFilters) -> LayerFormat {
    match format {
        LayerFormat::R8 if filters.r8 => format,
        LayerFormat::R8 if filters.r16 => LayerFormat::R16,
        LayerFormat::R8 if filters.r16f => LayerFormat::R16Float,
        _ => format,
    }
}

/// The GPU's format for a layer of a pool of volumes, and how shaders read it, on a device with these
/// features that filters so: 16 bits as they are, else as two channels of 8, else blended by the shader from
/// eight loads, as everything is that the device does not filter well. `None` as [`texture_format`] says.
pub fn volume_texture_format(
    format: LayerFormat,
    features: wgpu::Features,
    filters: VolumeFilters,
) -> Option<(wgpu::TextureFormat, Atlas)> {
    use wgpu::TextureFormat as Gpu;
    let granted = VolumeFilters::untried(features);
    let by = |is_well| if is_well { Atlas::Float } else { Atlas::Unfiltered };
    Some(match format {
        LayerFormat::R8 => (Gpu::R8Unorm, by(filters.r8)),
        LayerFormat::R16 if filters.r16 && granted.r16 => (Gpu::R16Unorm, Atlas::Float),
        LayerFormat::R16 if filters.high_low => (Gpu::Rg8Unorm, Atlas::HighLow),
        LayerFormat::R16 => (Gpu::R16Uint, Atlas::Uint16),
        LayerFormat::R16Float => (Gpu::R16Float, by(filters.r16f)),
        LayerFormat::R32Float => (Gpu::R32Float, by(filters.r32f && granted.r32f)),
        _ => return texture_format(format, features),
    })
}

/// Size in the layer's texels of what takes `texels` of the texture's; `None` if that is no whole number of
/// blocks.
///
/// What is one texel deep, as tiles of images are, is so in each layer. No block is deeper than a texel.
pub(crate) fn layer_texels(layer: &Layer, texels: [u32; 3]) -> Option<[u32; 3]> {
    let ([width, height, depth], unit) = (texels, layer.scale * layer.format.block_side());
    let is_deep = depth > 1;
    let is_whole = unit != 0
        && [width, height].iter().all(|n| n.is_multiple_of(unit))
        && !(is_deep && layer.format.is_compressed())
        && (!is_deep || depth.is_multiple_of(layer.scale));
    let depth = if is_deep { depth / layer.scale.max(1) } else { depth };
    is_whole.then(|| [width / layer.scale, height / layer.scale, depth])
}

/// Rows and bytes of a row of a layer's part of a tile, in blocks, and how many of the rows make an image;
/// `texels` are the layer's.
pub(crate) fn block_rows(format: LayerFormat, texels: [u32; 3]) -> BlockRows {
    let [across, rows] = [texels[0], texels[1]].map(|n| n / format.block_side());
    BlockRows {
        rows: rows * texels[2],
        row_bytes: across * format.block_bytes() as u32,
        rows_per_image: rows,
    }
}

/// How the bytes of a layer lie in a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BlockRows {
    /// Rows of blocks, of all images.
    pub(crate) rows: u32,
    /// Bytes of a row.
    pub(crate) row_bytes: u32,
    /// Rows of blocks of one image; a tile of a volume has as many images as it is deep.
    pub(crate) rows_per_image: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volumes_go_down_the_ladder_until_a_format_is_filtered_well() {
        use LayerFormat::{R8, R16, R16Float, R32Float};
        use wgpu::TextureFormat as Gpu;
        let all = VolumeFilters { r8: true, r16: true, high_low: true, r16f: true, r32f: true };
        let none = VolumeFilters { r8: false, r16: false, high_low: false, r16f: false, r32f: false };
        let no_r8 = VolumeFilters { r8: false, ..all };
        let floats = VolumeFilters { r16f: true, ..none };
        let features = wgpu::Features::all();
        for (filters, format, held, gpu, atlas) in [
            (all, R8, R8, Gpu::R8Unorm, Atlas::Float),
            (no_r8, R8, R16, Gpu::R16Unorm, Atlas::Float),
            (floats, R8, R16Float, Gpu::R16Float, Atlas::Float),
            (none, R8, R8, Gpu::R8Unorm, Atlas::Unfiltered),
            (all, R16, R16, Gpu::R16Unorm, Atlas::Float),
            (VolumeFilters { r16: false, ..all }, R16, R16, Gpu::Rg8Unorm, Atlas::HighLow),
            (floats, R16, R16, Gpu::R16Uint, Atlas::Uint16),
            (none, R16Float, R16Float, Gpu::R16Float, Atlas::Unfiltered),
            (all, R32Float, R32Float, Gpu::R32Float, Atlas::Float),
            (none, R32Float, R32Float, Gpu::R32Float, Atlas::Unfiltered),
        ] {
            assert_eq!(held_volume_format(format, filters), held, "{filters:?}");
            assert_eq!(volume_texture_format(held, features, filters), Some((gpu, atlas)), "{filters:?}");
        }
        // What a device does not have is not chosen, whatever is said of its filters.
        let found = volume_texture_format(R16, wgpu::Features::empty(), all);
        assert_eq!(found, Some((Gpu::Rg8Unorm, Atlas::HighLow)));
        let found = volume_texture_format(R32Float, wgpu::Features::empty(), all);
        assert_eq!(found, Some((Gpu::R32Float, Atlas::Unfiltered)));
        for format in LayerFormat::WHOLE_NUMBERS {
            assert_eq!(volume_texture_format(format, features, none), texture_format(format, features));
        }
    }

    #[test]
    fn every_device_has_a_format_for_what_it_holds() {
        for features in [wgpu::Features::empty(), wgpu::Features::all()] {
            for format in LayerFormat::ALL.into_iter().chain(LayerFormat::WHOLE_NUMBERS) {
                let held = held_format(format, features);
                let (gpu, atlas) = texture_format(held, features).unwrap();
                assert_eq!(gpu.block_copy_size(None), Some(held.block_bytes() as u32), "{held:?}");
                assert_eq!(gpu.is_srgb(), format.is_srgb());
                assert!(atlas == Atlas::Float || features.is_empty() || format.is_whole_number());
                assert_eq!(atlas == Atlas::Whole, format.is_whole_number());
            }
        }
    }
}
