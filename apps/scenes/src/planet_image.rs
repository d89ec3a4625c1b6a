//! The image of a whole planet that a generated one is made of, out of a texture that has it.

use half::f16;
use vastex::source::{DecodeError, PlanetImage, ReadError, decode_layer};
use vastex::{Dims, Layer, LayerFormat, PagePos, TileSource};
use vastex_viewer::layers::{ColorMap, Nodata, StoredScale};

/// Texels round the equator at most: of a larger texture a coarser level is taken.
const MOST: u32 = 4096;
/// The share of values at each end that black and white of floats leave out, as in the viewer's first range.
const LEFT_OUT: f64 = 0.005;
/// Floats beyond this are fill, such as the largest of 32 bits, whether or not the file says so.
const FILL: f32 = 1e37;

/// Why a texture gives no image of a planet.
#[derive(Debug, thiserror::Error)]
pub enum PlanetImageError {
    /// It is a volume.
    #[error("a planet is made of an image, and this is a volume; name an image of the whole planet")]
    Volume,
    /// A tile could not be had.
    #[error(transparent)]
    Tile(#[from] ReadError),
    /// A tile is damaged.
    #[error(transparent)]
    Damaged(#[from] DecodeError),
}

/// The first layer at the finest level with 4096 texels or fewer round the equator, in the colours in which
/// the viewer shows it: a single channel is grey, 0 black and 1 white. Where floats of a single channel go
/// beyond that, as heights in metres do, black and white are what half a percent of them lie below and above.
/// What is infinite, or so large that it stands for no data, counts for neither. Blocks are decoded. Reads
/// each tile of the level once, and takes 4 bytes of memory a texel besides those of the layer's texels, of
/// floats 8.
pub fn planet_image(source: &dyn TileSource) -> Result<PlanetImage, PlanetImageError> {
    let description = source.description();
    let (geometry, layer) = (&description.geometry, &description.layers[0]);
    if geometry.dims() != Dims::D2 {
        return Err(PlanetImageError::Volume);
    }
    let fits = |level: &u8| geometry.level(*level).size[0] <= MOST;
    let level = (0..=geometry.coarsest()).find(fits).unwrap_or(geometry.coarsest());
    let [width, height, _] = geometry.level(level).size;
    let bytes = layer.format.texel_bytes();
    let mut texels = vec![0; width as usize * height as usize * bytes];
    let (page, layer_width) = (geometry.page(), description.layer_tile(layer)[0] as usize);
    let pages: Vec<PagePos> = match level < geometry.tail().first_level() {
        true => geometry.pages_of_level(level).collect(),
        false => vec![geometry.tail_pos()],
    };
    for pos in pages {
        let tile = pollster::block_on(source.read(pos))?.decode(description)?;
        let tile = decode_layer(description, 0, &tile);
        let (first, size, inner) = match geometry.is_tail(pos) {
            true => ([0, 0], [width, height], geometry.tile_texel_from_tail_texel(level, [0; 3])),
            false => {
                let first = [pos.x * page[0], pos.y * page[1]];
                let size = [page[0].min(width - first[0]), page[1].min(height - first[1])];
                (first, size, geometry.tile_texel_from_page_texel([0; 3]))
            }
        };
        for y in 0..size[1] {
            let row = ((inner[1] + y) / layer.scale) as usize * layer_width;
            let to = (first[1] + y) as usize * width as usize + first[0] as usize;
            let to = &mut texels[to * bytes..][..size[0] as usize * bytes];
            for (x, to) in (inner[0]..).zip(to.chunks_exact_mut(bytes)) {
                let from = row + (x / layer.scale) as usize;
                to.copy_from_slice(&tile[from * bytes..][..bytes]);
            }
        }
    }
    Ok(PlanetImage { size: [width, height], texels: colors(layer, &texels) })
}

/// Texels of a layer, blocks decoded, as colours.
fn colors(layer: &Layer, texels: &[u8]) -> Vec<[u8; 4]> {
    let format = layer.format.decoded();
    let nodata = Nodata::OfLayer.of(layer);
    if nodata == Nodata::None && matches!(format, LayerFormat::Rgba8 | LayerFormat::Rgba8Srgb) {
        return texels.as_chunks().0.to_vec();
    }
    let scale = StoredScale::new(format);
    let nodata = match nodata {
        Nodata::None if scale.most().is_none() => Nodata::NotANumber,
        nodata => nodata.map(|value| scale.sampled(value).into()),
    };
    let map = |range| ColorMap::new(layer, range).with_nodata(nodata);
    let values = || texels.chunks_exact(format.texel_bytes()).map(|texel| sampled(format, scale, texel));
    let range = matches!(format, LayerFormat::R16Float | LayerFormat::R32Float).then(|| {
        let map = map(None);
        let known = values().filter_map(|value| map.values_of(value)).map(|[value, ..]| value);
        let [low, high] = usual(known.filter(|value| value.abs() < FILL).collect());
        [low.min(0.0), high.max(1.0)]
    });
    let map = map(range);
    values().map(|value| map.pixel_from_value(value, 1.0)).collect()
}

/// The values that [`LEFT_OUT`] of all lie below and above; 0 and 1 of none.
fn usual(mut values: Vec<f32>) -> [f32; 2] {
    let Some(last) = values.len().checked_sub(1) else { return [0.0, 1.0] };
    [LEFT_OUT, 1.0 - LEFT_OUT].map(|share| {
        let place = ((share * last as f64).round() as usize).min(last);
        *values.select_nth_unstable_by(place, f32::total_cmp).1
    })
}

/// What shaders sample of a texel.
fn sampled(format: LayerFormat, scale: StoredScale, texel: &[u8]) -> [f32; 4] {
    let words = || texel.as_chunks().0.iter();
    let stored: Vec<f64> = match format {
        LayerFormat::R16 | LayerFormat::Rgba16 => {
            words().map(|&word| u16::from_le_bytes(word).into()).collect()
        }
        LayerFormat::R16Float | LayerFormat::Rgba16Float => {
            words().map(|&word| f16::from_le_bytes(word).into()).collect()
        }
        LayerFormat::R32Float => {
            texel.as_chunks().0.iter().map(|&word| f32::from_le_bytes(word).into()).collect()
        }
        _ => texel.iter().map(|&byte| byte.into()).collect(),
    };
    let mut value = [0.0, 0.0, 0.0, 1.0];
    for (channel, (to, stored)) in value.iter_mut().zip(stored).enumerate() {
        *to = if channel == 3 { scale.of_alpha() } else { scale }.sampled(stored);
    }
    value
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use vastex::{ImageOptions, ImageSource};
    use vastex_build::{BlockSource, Quality};

    const SIZE: [u32; 2] = [600, 300];

    /// An image whose texels get lighter from the left to the right.
    fn slope(format: LayerFormat, texel: impl Fn(f64) -> Vec<u8>) -> ImageSource {
        let at = |n: u32| texel((f64::from(n % SIZE[0]) + 0.5) / f64::from(SIZE[0]));
        let pixels: Vec<u8> = (0..SIZE[0] * SIZE[1]).flat_map(at).collect();
        ImageSource::new(format, SIZE, pixels, &ImageOptions::default()).unwrap()
    }

    /// The image has the slope's colours, to `within` of 255: those of a share of the way from left to right.
    #[track_caller]
    fn check(source: &dyn TileSource, color: impl Fn(f64) -> [f64; 3], within: f64) {
        let image = planet_image(source).unwrap();
        assert_eq!((image.size, image.texels.len()), (SIZE, 600 * 300));
        let format = source.description().layers[0].format;
        for (n, texel) in (0u32..).zip(&image.texels) {
            let at = (f64::from(n % SIZE[0]) + 0.5) / f64::from(SIZE[0]);
            let expected = color(at);
            let is_near = (0..3).all(|c| (f64::from(texel[c]) - 255.0 * expected[c]).abs() <= within);
            assert!(is_near && texel[3] >= 250, "{format:?}: texel {n} is {texel:?}, not {expected:?}");
        }
    }

    fn bytes(share: f64) -> u8 {
        (share * 255.0).round() as u8
    }

    fn words(share: f64) -> [u8; 2] {
        ((share * 65535.0).round() as u16).to_le_bytes()
    }

    #[test]
    fn whatever_the_first_layer_is_its_colours_are_the_planets() {
        use LayerFormat::*;
        let rgb = |share: f64| [share, 1.0 - share, 0.25];
        let rgba = |share: f64| [share, 1.0 - share, 0.25, 1.0];
        for format in [Rgba8, Rgba8Srgb] {
            check(&slope(format, |share| rgba(share).map(bytes).to_vec()), rgb, 0.51);
        }
        check(&slope(Rgba16, |share| rgba(share).map(words).concat()), rgb, 0.51);
        let half = |value: f64| f16::from_f64(value).to_le_bytes();
        check(&slope(Rgba16Float, |share| rgba(share).map(half).concat()), rgb, 0.6);
        let grey = |share| [share; 3];
        check(&slope(R8, |share| vec![bytes(share)]), grey, 0.51);
        check(&slope(R16, |share| words(share).to_vec()), grey, 0.51);
        // Metres from the deepest sea to the highest mountain, and half of them unknown.
        let metres = |share: f64| (share * 20_000.0 - 11_000.0) as f32;
        let of_metres = |share: f64| [((share - 0.005) / 0.99).clamp(0.0, 1.0); 3];
        check(&slope(R32Float, |share| metres(share).to_le_bytes().to_vec()), of_metres, 1.5);
        check(&slope(R16Float, |share| half(share * 0.5).to_vec()), |share| [0.5 * share; 3], 0.6);
        // Grey with alpha is seen over what is behind it.
        check(&slope(Rg8, |share| vec![bytes(share), 255]), grey, 0.51);
    }

    #[test]
    fn layers_in_blocks_are_decoded() {
        use LayerFormat::*;
        let plain = slope(Rgba8Srgb, |share| [share, share, share, 1.0].map(bytes).to_vec());
        let plain: Arc<dyn TileSource> = Arc::new(plain);
        for format in [Bc1Srgb, Bc3Srgb, Bc7Srgb] {
            check(&BlockSource::new(plain.clone(), &[format], Quality::Normal).unwrap(), |at| [at; 3], 9.0);
        }
        let grey = Arc::new(slope(R8, |share| vec![bytes(share)]));
        check(&BlockSource::new(grey, &[Bc4], Quality::Normal).unwrap(), |at| [at; 3], 3.0);
    }

    #[test]
    fn what_is_unknown_is_dark_and_stretches_nothing() {
        let known = |share: f64| if share < 0.5 { f32::NAN } else { (share * 8000.0) as f32 };
        let source = slope(LayerFormat::R32Float, |share| known(share).to_le_bytes().to_vec());
        let image = planet_image(&source).unwrap();
        let [unknown, middle, last] = [10, 450, 599].map(|n| image.texels[n]);
        assert!(unknown[..3].iter().all(|&value| value < 40), "{unknown:?}");
        assert!((188..=194).contains(&middle[0]) && last[0] >= 254, "{middle:?} {last:?}");
    }

    #[test]
    fn infinite_texels_and_fill_that_no_file_declares_stretch_nothing() {
        let middle = |source: ImageSource| planet_image(&source).unwrap().texels[300][0];
        let metres = |share: f64, other: f32| if share < 0.01 { other } else { (share * 8000.0) as f32 };
        for other in [f32::INFINITY, f32::NEG_INFINITY, f32::MIN, -3.4e38, 9000.0, -500.0] {
            let of = |share: f64| {
                // Of the last two kinds there are fewer than half a percent.
                let other = if other.abs() < 1e5 && share > 0.004 { 0.0 } else { other };
                metres(share, other).to_le_bytes().to_vec()
            };
            let found = middle(slope(LayerFormat::R32Float, of));
            assert!((124..=132).contains(&found), "{other}: {found}");
        }
        let half = |share: f64| {
            let value = if share > 0.99 { f16::INFINITY } else { f16::from_f64(share * 4.0) };
            value.to_le_bytes().to_vec()
        };
        let found = middle(slope(LayerFormat::R16Float, half));
        assert!((124..=134).contains(&found), "{found}");
        // Of nothing but fill there is a picture all the same.
        let fill = |_| f32::INFINITY.to_le_bytes().to_vec();
        planet_image(&slope(LayerFormat::R32Float, fill)).unwrap();
    }
}
