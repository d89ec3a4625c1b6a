//! Values as a file stores them, and as shaders sample them.

use vastex::LayerFormat;

use super::{linear_from_srgb, srgb_from_linear};

/// How the values that shaders sample of a format go with those that are stored: whole numbers are sampled as
/// 0 to 1, sRGB-encoded ones as the light that they stand for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StoredScale {
    /// The largest whole number; `None` for floats, which are sampled as they are.
    most: Option<f64>,
    is_srgb: bool,
}

impl StoredScale {
    /// The scale of a format; of a format that is compressed in blocks, that of the format it stands for.
    pub fn new(format: LayerFormat) -> StoredScale {
        use LayerFormat::{R16, R16Float, R32Float, Rgba8Srgb, Rgba16, Rgba16Float};
        let plain = format.decoded();
        let most = match plain {
            R16Float | R32Float | Rgba16Float => None,
            R16 | Rgba16 => Some(65535.0),
            _ => Some(255.0),
        };
        StoredScale { most, is_srgb: plain == Rgba8Srgb }
    }

    /// The largest whole number that can be stored; `None` for floats.
    pub fn most(&self) -> Option<f64> {
        self.most
    }

    /// The stored value of a sampled one that is none of alpha.
    pub fn stored(&self, sampled: f32) -> f64 {
        let encoded = if self.is_srgb { srgb_from_linear(sampled) } else { sampled };
        self.most.map_or(encoded.into(), |most| (f64::from(encoded) * most).round())
    }

    /// The stored value of a sampled alpha.
    pub fn stored_alpha(&self, sampled: f32) -> f64 {
        self.of_alpha().stored(sampled)
    }

    /// That of alpha in the same format.
    #[must_use]
    pub fn of_alpha(self) -> StoredScale {
        StoredScale { is_srgb: false, ..self }
    }

    /// How near to the sampled value of a stored one others count as the same: a millionth of it for floats,
    /// and half a step of whole numbers, so that it does not matter how exactly a device decodes them. Twin
    /// of `scene_nodata_within` in surface.wgsl.
    pub(super) fn within(&self, sampled: f32) -> f32 {
        match self.kind() {
            Self::BYTES => 0.5 / 255.0,
            Self::WORDS => 0.5 / 65535.0,
            // A little less, since a step of light is shorter towards what is dark.
            Self::LIGHT => 0.4 / 255.0 * (2.274_88 * sampled.max(0.0).powf(0.583_333)).max(1.0 / 12.92),
            _ => sampled.abs() * 1e-6,
        }
    }

    /// Which scale it is, for shaders.
    pub(super) fn kind(&self) -> u32 {
        match self.most {
            None => 0,
            Some(_) if self.is_srgb => Self::LIGHT,
            Some(most) if most > 255.0 => Self::WORDS,
            Some(_) => Self::BYTES,
        }
    }

    const BYTES: u32 = 1;
    const WORDS: u32 = 2;
    const LIGHT: u32 = 3;

    /// The sampled value of a stored one that is none of alpha.
    pub fn sampled(&self, stored: f64) -> f32 {
        let encoded = self.most.map_or(stored, |most| stored / most) as f32;
        if self.is_srgb { linear_from_srgb(encoded) } else { encoded }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_stored_comes_back() {
        for (format, most) in
            [(LayerFormat::Rgba8Srgb, 255), (LayerFormat::R8, 255), (LayerFormat::R16, 65535)]
        {
            let scale = StoredScale::new(format);
            assert_eq!(scale.most(), Some(f64::from(most)));
            for stored in (0..=most).map(f64::from) {
                assert_eq!(scale.stored(scale.sampled(stored)), stored, "{format:?}");
            }
        }
        assert_eq!(StoredScale::new(LayerFormat::R32Float).stored(-0.5), -0.5);
        let floats = StoredScale::new(LayerFormat::R32Float);
        assert_eq!([0.0, 1e-9, -2.0].map(|value| floats.within(value)), [0.0, 1e-9 * 1e-6, 2.0 * 1e-6]);
        assert_eq!(StoredScale::new(LayerFormat::Rgba8Srgb).stored_alpha(0.5), 128.0);
    }
}
