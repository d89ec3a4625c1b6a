//! From the texels of an image file to those of a layer.
//!
//! | in the file | layer, unless another is asked for |
//! |---|---|
//! | grey of 8 or 16 bits, or a float of 16 or 32 bits | `R8`, `R16`, `R16F`, `R32F`: exact |
//! | grey and alpha, 8 bits | `RG8`, exact |
//! | RGB, RGBA, 8 bits | `RGBA8`, sRGB unless the file says linear: exact; without alpha it is 255 |
//! | any other of 16 bits | `RGBA16`, in linear light |
//! | any other float | `RGBA16F`, to the nearest |
//! | signed whole numbers, which stand for themselves | as floats: 8 bits `R16F`, 16 and 32 bits `R32F` |
//!
//! Any image can become any layer of four channels (grey then stands in all colours), any but grey one of two
//! (the first two channels), and grey alone one of one channel. Numbers are 0 to 1, rounded to the nearest
//! that the layer can hold; of signed ones the whole range of the file's samples becomes 0 to 1 in a layer of
//! whole numbers, so that 16 bits stay exact in `R16`.
//!
//! Formats with sRGB in their name hold stored colours. No format of 16 bits does, so colour that a file
//! holds sRGB-encoded is decoded on its way into one: 16 bits of light are finer than 8 stored ones
//! everywhere, and than 16 stored ones but for the darkest. Formats of 8 bits without sRGB take every value
//! as it is: they are for data.

use half::f16;
use vastex_core::{LayerFormat, NodataValue};

use super::missing::{Missing, number, store};
use super::srgb::{linear_from_srgb, srgb_from_linear};
use super::texel::{is_float, whole};
use crate::image::{ImageHeader, Notice, PixelFormat, Sample};

/// The format that holds an image best.
pub(crate) fn layer_format(header: &ImageHeader) -> LayerFormat {
    match (header.format.channels(), header.format.sample()) {
        (1, Sample::U8) => LayerFormat::R8,
        (1, Sample::U16) => LayerFormat::R16,
        (1, Sample::F16) => LayerFormat::R16Float,
        (1, Sample::F32) => LayerFormat::R32Float,
        (_, Sample::F16 | Sample::F32) => LayerFormat::Rgba16Float,
        (_, Sample::U16) => LayerFormat::Rgba16,
        (2, Sample::U8) => LayerFormat::Rg8,
        _ if header.linear => LayerFormat::Rgba8,
        _ => LayerFormat::Rgba8Srgb,
    }
}

/// The formats that an image can become.
pub(crate) fn possible_formats(image: PixelFormat) -> impl Iterator<Item = LayerFormat> {
    LayerFormat::ALL.into_iter().filter(move |format| is_possible(image, *format))
}

fn is_possible(image: PixelFormat, format: LayerFormat) -> bool {
    match format.channels() {
        1 => image.channels() == 1,
        2 => image.channels() > 1,
        _ => true,
    }
}

/// What is done to the colours, but not to alpha.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Curve {
    None,
    /// From what the file stores to light.
    Decode,
    /// From light to what the layer stores.
    Encode,
}

/// How the rows of an image become those of a layer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Conversion {
    image: PixelFormat,
    /// Not compressed.
    layer: LayerFormat,
    curve: Curve,
    /// The range of numbers that becomes 0 to 1; `None` if it is 0 to 1 already, or the layer holds them
    /// as they are.
    range: Option<[i64; 2]>,
    /// True if the image has alpha and the layer keeps none.
    drops_alpha: bool,
    /// What stands for no data in the image.
    nodata: Option<f32>,
}

impl Conversion {
    /// To the texels from which a layer of `format` is made; `None` if the image has too many channels
    /// for it, or too few. `is_color` false takes numbers that are no colours as they are.
    pub(crate) fn new(header: &ImageHeader, format: LayerFormat, is_color: bool) -> Option<Conversion> {
        is_possible(header.format, format).then(|| Conversion::to(header, format, is_color))
    }

    fn to(header: &ImageHeader, format: LayerFormat, is_color: bool) -> Conversion {
        let (image, layer) = (header.format, format.decoded());
        let is_encoded = !header.linear && !image.sample().is_float();
        let curve = match layer {
            LayerFormat::Rgba8Srgb if !is_encoded => Curve::Encode,
            LayerFormat::Rgba16 | LayerFormat::Rgba16Float if is_encoded && is_color => Curve::Decode,
            _ => Curve::None,
        };
        let keeps_alpha = match format {
            LayerFormat::Bc1 | LayerFormat::Bc1Srgb | LayerFormat::Bc6h => false,
            _ => format.channels() >= usize::from(image.channels()),
        };
        let range = header.range.filter(|_| !is_float(layer));
        let drops_alpha = image.has_alpha() && !keeps_alpha;
        let nodata = header.nodata.map(NodataValue::value);
        Conversion { image, layer, curve, range, drops_alpha, nodata }
    }

    /// To the format that [`layer_format`] gives, as colour.
    pub(crate) fn usual(header: &ImageHeader) -> Conversion {
        Conversion::to(header, layer_format(header), true)
    }

    /// What there is to say of it.
    pub(crate) fn notices(&self) -> impl Iterator<Item = Notice> + use<> {
        let as_light = (self.curve == Curve::Decode).then_some(Notice::StoredAsLight);
        as_light.into_iter().chain(self.range.map(Notice::RangeScaled))
    }

    /// Returns true if rows of the image have transparency that the layer does not keep.
    pub(crate) fn loses_alpha_of(&self, image: &[u8]) -> bool {
        let sample = self.image.sample();
        self.drops_alpha
            && image.chunks_exact(self.image.texel_bytes()).any(|texel| !texel.ends_with(sample.one()))
    }

    /// Tells that floats of 32 bits become ones of 16, by what stands for no data among them, if anything
    /// does; `None` if they do not.
    pub(crate) fn narrows(&self) -> Option<Option<f32>> {
        let is_half = matches!(self.layer, LayerFormat::R16Float | LayerFormat::Rgba16Float);
        (is_half && self.image.sample() == Sample::F32).then_some(self.nodata)
    }

    /// The value by which the layer stores texels of the image that have the number `value`, which stands for
    /// no data; `None` if no sample of the image can be that number.
    pub(crate) fn nodata(&self, value: NodataValue) -> Option<NodataValue> {
        let (value, sample) = (value.value(), self.image.sample());
        let value = match sample {
            Sample::U8 | Sample::U16 => {
                let most = if sample == Sample::U8 { 255.0 } else { 65535.0 };
                Some(value).filter(|value| value.fract() == 0.0 && (0.0..=most).contains(value))
            }
            Sample::F16 | Sample::F32 => match self.range {
                Some([least, most]) => {
                    let is_within = value.fract() == 0.0 && (least as f32..=most as f32).contains(&value);
                    Some(value).filter(|_| is_within)
                }
                // Whole numbers and what is no number have nothing in common.
                None => Some(value),
            },
        }?;
        // The image's own samples of that kind.
        let mut texel = vec![0; self.image.texel_bytes()];
        texel.chunks_exact_mut(sample.bytes()).for_each(|to| store(to, value, sample));
        let mut layer = vec![0; self.layer.texel_bytes()];
        self.row(&mut layer, &texel);
        let sample = Missing::of_layer(self.layer, NodataValue::new(0.0)).sample();
        Some(NodataValue::new(number(&layer[..sample.bytes()], sample)))
    }

    /// The format of the layer, or of the texels from which a compressed one is made.
    pub(crate) fn layer(&self) -> LayerFormat {
        self.layer
    }

    /// Bytes of a texel of the image.
    pub(crate) fn image_texel_bytes(&self) -> usize {
        self.image.texel_bytes()
    }

    /// Turns a row of the image into a row of the layer. Both have the same number of texels.
    pub(crate) fn row(&self, layer: &mut [u8], image: &[u8]) {
        if self.is_copy() {
            return layer.copy_from_slice(image);
        }
        match self.image.sample() {
            Sample::U8 if self.image.channels() == 3 && self.is_eight_bits() => opaque(layer, image),
            Sample::U8 => self.read(layer, image, |[v]: [u8; 1]| f32::from(v) / 255.0),
            Sample::U16 => self.read(layer, image, |v| f32::from(u16::from_le_bytes(v)) / 65535.0),
            Sample::F16 => self.read(layer, image, |v| self.share(f16::from_le_bytes(v).to_f32())),
            Sample::F32 => self.read(layer, image, |v| self.share(f32::from_le_bytes(v))),
        }
    }

    /// Where a number lies in the range that becomes 0 to 1.
    fn share(&self, value: f32) -> f32 {
        match self.range {
            // The difference is exact where the number is.
            Some([least, most]) => (value - least as f32) / (most - least) as f32,
            None => value,
        }
    }

    fn is_copy(&self) -> bool {
        use LayerFormat::*;
        let same_samples = match self.image.sample() {
            Sample::U8 => matches!(self.layer, R8 | Rg8 | Rgba8 | Rgba8Srgb),
            Sample::U16 => matches!(self.layer, R16 | Rgba16),
            Sample::F16 => matches!(self.layer, R16Float | Rgba16Float),
            Sample::F32 => self.layer == R32Float,
        };
        let same_channels = usize::from(self.image.channels()) == self.layer.channels();
        same_samples && same_channels && self.curve == Curve::None
    }

    fn is_eight_bits(&self) -> bool {
        matches!(self.layer, LayerFormat::Rgba8 | LayerFormat::Rgba8Srgb) && self.curve == Curve::None
    }

    fn read<const I: usize>(&self, layer: &mut [u8], image: &[u8], load: impl Fn([u8; I]) -> f32) {
        use LayerFormat::*;
        match self.layer {
            R16 | Rgba16 => self.write(layer, image, load, |v| whole(v, 65535.0).to_le_bytes()),
            R16Float | Rgba16Float => self.write(layer, image, load, |v| f16::from_f32(v).to_le_bytes()),
            R32Float => self.write(layer, image, load, f32::to_le_bytes),
            _ => self.write(layer, image, load, |v| [whole(v, 255.0) as u8]),
        }
    }

    fn write<const I: usize, const O: usize>(
        &self,
        layer: &mut [u8],
        image: &[u8],
        load: impl Fn([u8; I]) -> f32,
        store: impl Fn(f32) -> [u8; O],
    ) {
        let channels = self.layer.channels();
        let texels = image.as_chunks::<I>().0.chunks_exact(self.image.channels().into());
        for (to, texel) in layer.as_chunks_mut::<O>().0.chunks_exact_mut(channels).zip(texels) {
            let [x, y, z, w] = match *texel {
                [v] => [load(v), load(v), load(v), 1.0],
                [v, a] if channels == 4 => [load(v), load(v), load(v), load(a)],
                [r, g, b] => [load(r), load(g), load(b), 1.0],
                [r, g, b, a] => [load(r), load(g), load(b), load(a)],
                _ => [texel.first(), texel.last(), None, None].map(|v| v.map_or(0.0, |&v| load(v))),
            };
            let [x, y, z] = match self.curve {
                Curve::None => [x, y, z],
                Curve::Decode => [x, y, z].map(linear_from_srgb),
                Curve::Encode => [x, y, z].map(srgb_from_linear),
            };
            for (to, value) in to.iter_mut().zip([x, y, z, w]) {
                *to = store(value);
            }
        }
    }
}

/// Red, green and blue of 8 bits, without alpha.
fn opaque(layer: &mut [u8], image: &[u8]) {
    let texels = layer.as_chunks_mut::<4>().0;
    // A texel and the byte behind it are a word; behind the last one there is no byte.
    for (to, &word) in texels.iter_mut().zip(image.array_windows().step_by(3)) {
        *to = (u32::from_le_bytes(word) | 0xff << 24).to_le_bytes();
    }
    if let (Some(to), Some(&[r, g, b])) = (texels.last_mut(), image.last_chunk()) {
        *to = [r, g, b, 255];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(format: PixelFormat, linear: bool) -> ImageHeader {
        ImageHeader { linear, ..ImageHeader::new(1, 1, format).unwrap() }
    }

    fn converted(image: PixelFormat, to: LayerFormat, texel: &[u8]) -> Vec<u8> {
        let mut layer = vec![7; to.texel_bytes()];
        Conversion::new(&header(image, false), to, true).unwrap().row(&mut layer, texel);
        layer
    }

    #[test]
    fn sixteen_bits_round_to_the_nearest_eight() {
        for v in 0..=u16::MAX {
            let nearest = (f64::from(v) / 257.0).round() as u8;
            let [a, b] = v.to_le_bytes();
            let texel = converted(PixelFormat::GREY_ALPHA16, LayerFormat::Rg8, &[a, b, 0, 0]);
            assert_eq!(texel, [nearest, 0], "{v}");
        }
    }

    #[test]
    fn whole_numbers_survive_a_wider_layer() {
        for v in 0..=u16::MAX {
            let texel = converted(PixelFormat::GREY16, LayerFormat::R32Float, &v.to_le_bytes());
            let value = f32::from_le_bytes(texel.try_into().unwrap());
            assert_eq!((value * 65535.0).round(), f32::from(v));
        }
        for v in 0..=u8::MAX {
            let texel = converted(PixelFormat::GREY8, LayerFormat::R16, &[v]);
            assert_eq!(texel, (u16::from(v) * 257).to_le_bytes());
        }
    }

    #[test]
    fn colour_without_alpha_is_opaque() {
        assert_eq!(converted(PixelFormat::RGB8, LayerFormat::Rgba8Srgb, &[1, 2, 3]), [1, 2, 3, 255]);
        let (rgb, mut rgba): (Vec<u8>, _) = ((0..3 * 70).collect(), vec![0; 4 * 70]);
        let conversion =
            Conversion::new(&header(PixelFormat::RGB8, false), LayerFormat::Rgba8Srgb, true).unwrap();
        conversion.row(&mut rgba, &rgb);
        let texels = rgb.as_chunks::<3>().0.iter().flat_map(|&[r, g, b]| [r, g, b, 255]);
        assert!(texels.eq(rgba));
        let rgb16 = [0xff, 0xff, 0x80, 0x80, 0x7f, 0x00];
        assert_eq!(converted(PixelFormat::RGB16, LayerFormat::Rgba8Srgb, &rgb16), [255, 128, 0, 255]);
        assert_eq!(converted(PixelFormat::GREY8, LayerFormat::Rgba8, &[9]), [9, 9, 9, 255]);
        assert_eq!(converted(PixelFormat::GREY_ALPHA8, LayerFormat::Rgba8, &[9, 8]), [9, 9, 9, 8]);
    }

    #[test]
    fn normals_keep_their_first_two_channels() {
        assert_eq!(converted(PixelFormat::RGB8, LayerFormat::Bc5, &[1, 2, 3]), [1, 2]);
        assert_eq!(converted(PixelFormat::RGBA8, LayerFormat::Rg8, &[1, 2, 3, 4]), [1, 2]);
    }

    #[test]
    fn stored_colour_becomes_light_where_the_layer_has_16_bits_and_alpha_does_not() {
        let half = 0x8080u16.to_le_bytes();
        let texel = converted(PixelFormat::GREY_ALPHA16, LayerFormat::Rgba16, &[half, half].concat());
        let light = ((f64::from(0x8080) / 65535.0 + 0.055) / 1.055).powf(2.4) * 65535.0;
        assert_eq!(texel[..2], (light.round() as u16).to_le_bytes());
        assert_eq!(texel[6..], half);
        let data = Conversion::new(&header(PixelFormat::RGB16, false), LayerFormat::Rgba16, false).unwrap();
        let mut layer = [0; 8];
        data.row(&mut layer, &[half; 3].concat());
        assert_eq!(layer[..6], [half; 3].concat());
        assert_eq!(data.notices().next(), None);
    }

    #[test]
    fn light_is_stored_as_the_layer_says() {
        let light: Vec<u8> = [0.0f32, 0.2159, 7.0].iter().flat_map(|v| v.to_le_bytes()).collect();
        let image = PixelFormat::new(3, Sample::F32).unwrap();
        assert_eq!(converted(image, LayerFormat::Bc7Srgb, &light), [0, 128, 255, 255]);
        let nan = [f32::NAN; 3].map(f32::to_le_bytes).concat();
        assert_eq!(converted(image, LayerFormat::Rgba8, &nan), [0, 0, 0, 255]);
    }

    #[test]
    fn what_would_lose_a_channel_is_refused() {
        for (image, to) in [
            (PixelFormat::RGB8, LayerFormat::R8),
            (PixelFormat::GREY_ALPHA8, LayerFormat::R16),
            (PixelFormat::GREY8, LayerFormat::Bc5),
        ] {
            assert!(Conversion::new(&header(image, false), to, true).is_none());
            assert!(possible_formats(image).all(|format| format != to));
        }
        assert!(possible_formats(PixelFormat::RGB8).any(|format| format == LayerFormat::Bc6h));
    }

    #[test]
    fn the_usual_format_is_possible_and_exact() {
        for channels in 1..=4 {
            for sample in [Sample::U8, Sample::U16, Sample::F16, Sample::F32] {
                let header = header(PixelFormat::new(channels, sample).unwrap(), false);
                assert!(Conversion::new(&header, layer_format(&header), true).is_some());
            }
        }
    }

    #[test]
    fn signed_numbers_fill_the_range_of_whole_ones_and_stay_themselves_in_floats() {
        let image = PixelFormat::GREY8.with_sample(Sample::F32);
        let header = ImageHeader { range: Some([-32768, 32767]), ..header(image, false) };
        let words = Conversion::new(&header, LayerFormat::R16, false).unwrap();
        let singles = Conversion::new(&header, LayerFormat::R32Float, false).unwrap();
        assert_eq!((words.range, singles.range), (Some([-32768, 32767]), None));
        for v in i16::MIN..=i16::MAX {
            let (number, mut word, mut single) = (f32::from(v).to_le_bytes(), [0; 2], [0; 4]);
            words.row(&mut word, &number);
            singles.row(&mut single, &number);
            assert_eq!(i32::from(u16::from_le_bytes(word)), i32::from(v) + 32768);
            assert_eq!(single, number);
        }
    }
}
