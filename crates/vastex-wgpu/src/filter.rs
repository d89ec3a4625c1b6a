//! How texels are blended: the filters, their names, and what shaders are told of them.

use std::fmt;
use std::str::FromStr;

/// How texels are blended.
///
/// Costs are texels blended for each pixel, beside one lookup of the page table for each level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Filter {
    /// The nearest texel of the level `floor(level)`: 1.
    Nearest,
    /// Four texels of the level `floor(level)`: 4.
    Bilinear,
    /// Four texels of each of the two levels around the wanted one: 8.
    #[default]
    Trilinear,
    /// Trilinear taps along the longer axis of what a pixel covers, at the level of its shorter one: 8 to 8
    /// times the taps.
    Anisotropic(MaxTaps),
    /// Trilinear where the picture shrinks the texture; where it enlarges it by a level or more, 4x4 texels
    /// weighted by the cubic of Catmull and Rom, and in between a blend of both: 8 to 20.
    ///
    /// That cubic passes through the texels, so that data stays what it is and nothing is blurred where a
    /// pixel is a texel; beside hard edges it leaves the range of the texels by up to an eighth of their
    /// contrast per axis. Weights are computed in full precision, so that magnified heights have no steps.
    Bicubic,
}

impl Filter {
    /// One filter of each kind, the anisotropic one with up to 8 taps.
    pub const KINDS: [Filter; 5] = [
        Filter::Nearest,
        Filter::Bilinear,
        Filter::Trilinear,
        Filter::Anisotropic(MaxTaps(8)),
        Filter::Bicubic,
    ];

    /// Taps along an axis at most: 1 but for anisotropic filters.
    pub const fn max_taps(self) -> u32 {
        match self {
            Filter::Anisotropic(taps) => taps.0 as u32,
            Filter::Nearest | Filter::Bilinear | Filter::Trilinear | Filter::Bicubic => 1,
        }
    }

    /// `VASTEX_FILTER_*`.
    pub(crate) const fn code(self) -> u32 {
        match self {
            Filter::Nearest => 0,
            Filter::Bilinear => 1,
            Filter::Trilinear => 2,
            Filter::Anisotropic(_) => 3,
            Filter::Bicubic => 4,
        }
    }
}

/// How many taps an anisotropic filter takes at most: 2, 4, 8 or 16.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MaxTaps(u8);

impl MaxTaps {
    /// Every number that there is.
    pub const ALL: [MaxTaps; 4] = [MaxTaps(2), MaxTaps(4), MaxTaps(8), MaxTaps(16)];

    /// So many taps, 2, 4, 8 or 16; `None` for other numbers, since each is a shader text of its own.
    ///
    /// ```
    /// use vastex_wgpu::MaxTaps;
    /// assert_eq!(MaxTaps::new(8).map(MaxTaps::get), Some(8));
    /// assert!([0, 1, 3, 6, 17, 32].into_iter().all(|taps| MaxTaps::new(taps).is_none()));
    /// ```
    pub const fn new(taps: u8) -> Option<MaxTaps> {
        match taps {
            2 | 4 | 8 | 16 => Some(MaxTaps(taps)),
            _ => None,
        }
    }

    /// The number.
    pub const fn get(self) -> u8 {
        self.0
    }
}

const ANISOTROPIC: &str = "anisotropic";

/// The name that [`Filter::from_str`] reads: `anisotropic8`.
impl fmt::Display for Filter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Filter::Nearest => f.write_str("nearest"),
            Filter::Bilinear => f.write_str("bilinear"),
            Filter::Trilinear => f.write_str("trilinear"),
            Filter::Anisotropic(taps) => write!(f, "{ANISOTROPIC}{}", taps.0),
            Filter::Bicubic => f.write_str("bicubic"),
        }
    }
}

/// A name that is none of a filter's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "a filter is one of nearest, bilinear, trilinear, anisotropic2, anisotropic4, anisotropic8, anisotropic16, bicubic"
)]
pub struct UnknownFilter;

impl FromStr for Filter {
    type Err = UnknownFilter;

    /// `nearest`, `bilinear`, `trilinear`, `anisotropic2`, `anisotropic4`, `anisotropic8`, `anisotropic16`,
    /// `bicubic`.
    ///
    /// ```
    /// use vastex_wgpu::Filter;
    /// let filter: Filter = "anisotropic8".parse().unwrap();
    /// assert_eq!((filter.max_taps(), filter.to_string().as_str()), (8, "anisotropic8"));
    /// assert!(["anisotropic", "anisotropic1", "anisotropic5", "anisotropic08", "anisotropic+8", "anisotropic32", "Nearest", ""]
    ///     .into_iter()
    ///     .all(|name| name.parse::<Filter>().is_err()));
    /// ```
    fn from_str(name: &str) -> Result<Filter, UnknownFilter> {
        let plain = [Filter::Nearest, Filter::Bilinear, Filter::Trilinear, Filter::Bicubic];
        plain
            .into_iter()
            .chain(MaxTaps::ALL.map(Filter::Anisotropic))
            .find(|filter| filter.to_string() == name)
            .ok_or(UnknownFilter)
    }
}
