//! How the texels of a level are made from those of a finer one: a kernel (how far a texel looks, and how it
//! weighs what it sees), a meaning (what the values are), the level that it looks at, and a value of texels
//! without data, if there is one, which are left out.
//!
//! [`LayerFilter`] is the name of such a filter, as a container stores it. [`Filter`] is the same made ready
//! for a format and a factor: either the integer arithmetic of [`quad`] on 2x2 texels, or the general one of
//! [`separable`]. Weights stand in [`kernel`], what is done to values before and after in [`meaning`] and
//! [`mixing`].
//!
//! Where rows come from, and what lies beyond the edges, is the pyramid's business.

mod kernel;
mod meaning;
mod mixing;
mod quad;
mod separable;
#[cfg(target_arch = "x86_64")]
mod wide;

use std::fmt;
use std::str::FromStr;

use vastex_core::{Layer, LayerFormat, NodataValue, TexelPositions};
use vastex_tiles::{filter_without, nodata_of_filter};

pub use kernel::Kernel;
pub(crate) use kernel::Stretched;
use kernel::Weights;
pub use meaning::Meaning;
pub(crate) use meaning::{LEAST_WEIGHT, unit};
pub(crate) use mixing::Mixing;
pub(crate) use quad::Quad;
use separable::Separable;

/// How the levels of one layer are made. Written and read as `KERNEL[-MEANING][@LEVELS][/nodata=VALUE]`:
/// `box-linear`, `kaiser@two`, `box/nodata=-9999`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct LayerFilter {
    /// How many finer texels a texel is made of, and their weights.
    pub kernel: Kernel,
    /// What the values are.
    pub meaning: Meaning,
    /// At which level it looks.
    pub from: LevelsFrom,
    /// The value of texels without data, as the layer stores it, if there is one. Such texels are left out of
    /// mixtures, and are never picked while there is another one.
    pub nodata: Option<NodataValue>,
}

/// From which level the texels of a level are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LevelsFrom {
    /// The next finer one.
    #[default]
    Chain,
    /// The level two finer, by the kernel stretched to a factor of four; level 1 from level 0.
    TwoFiner,
    /// Level 0, by the kernel stretched to the level's scale.
    Finest,
}

impl LevelsFrom {
    /// Every rule.
    pub const ALL: [LevelsFrom; 3] = [LevelsFrom::Chain, LevelsFrom::TwoFiner, LevelsFrom::Finest];

    /// The name in help texts and, but for `chain`, in names of filters.
    pub const fn name(self) -> &'static str {
        match self {
            LevelsFrom::Chain => "chain",
            LevelsFrom::TwoFiner => "two",
            LevelsFrom::Finest => "zero",
        }
    }

    /// The level that `level`, which is not 0, is made from.
    pub(crate) fn source(self, level: u8) -> u8 {
        match self {
            LevelsFrom::Chain => level - 1,
            LevelsFrom::TwoFiner => level.saturating_sub(2),
            LevelsFrom::Finest => 0,
        }
    }
}

/// Why there is no such filter, or why it does not suit.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FilterError {
    /// The name is none.
    #[error(
        "{0:?} names no filter: write one of {kernels}, followed where it is wanted by -linear or -normal, by @two or \
         @zero, and by /nodata=VALUE, as in kaiser-linear",
        kernels = Kernel::ALL.map(Kernel::name).join(", ")
    )]
    Name(String),
    /// The kernel takes values as they are.
    #[error(
        "the filter {0} picks values and does not mix them, so it goes neither with -linear and -normal nor with @two and \
         @zero"
    )]
    Picks(&'static str),
    /// The format holds no vectors.
    #[error(
        "a layer of {0} holds no normals: they need two or more channels that are not sRGB-encoded, as of rg8 or rgba8"
    )]
    Normal(&'static str),
    /// Some layers would keep texel positions and others not.
    #[error("{0} keeps the positions of texels and {1} moves them: all layers of a texture must do the same")]
    Positions(LayerFilter, LayerFilter),
}

impl LayerFilter {
    /// A filter along the chain of levels.
    pub const fn new(kernel: Kernel, meaning: Meaning) -> LayerFilter {
        LayerFilter { kernel, meaning, from: LevelsFrom::Chain, nodata: None }
    }

    /// What suits a layer of which nothing but its name and its format are known: vectors are averaged as
    /// such, labels are picked, colour is mixed as light (unless `linear` is false) and everything else as it
    /// is.
    ///
    /// A name means something by how it begins: `normal`; `label`, `mask`, `class`, `id`; `height`,
    /// `elevation`, `depth`, `displacement`, `roughness`, `metal`, `occlusion`.
    pub fn for_layer(name: &str, format: LayerFormat, linear: bool) -> LayerFilter {
        let name = name.to_ascii_lowercase();
        let is_any = |words: &[&str]| words.iter().any(|word| name.starts_with(word));
        let is_id = name == "id" || name == "ids" || name.starts_with("id_") || name.starts_with("id-");
        let (kernel, meaning) = if is_any(&["normal"]) && Meaning::Normal.suits(format) {
            (Kernel::Box, Meaning::Normal)
        } else if is_id || is_any(&["label", "mask", "class"]) {
            (Kernel::Majority, Meaning::Stored)
        } else if is_any(&["height", "elevation", "depth", "displacement", "roughness", "metal", "occlusion"])
        {
            (Kernel::Box, Meaning::Stored)
        } else if linear && Meaning::LinearColor.suits(format) {
            (Kernel::Box, Meaning::LinearColor)
        } else {
            (Kernel::Box, Meaning::Stored)
        };
        LayerFilter::new(kernel, meaning)
    }

    /// Returns true if the numbers of a layer that has this filter are colours, as far as the layer's name
    /// and format tell; `None` for the filter that suits both.
    pub(crate) fn is_of_color(filter: Option<LayerFilter>, layer: &Layer) -> bool {
        let usual = LayerFilter::for_layer(&layer.name, layer.format, true);
        usual.meaning == Meaning::LinearColor && filter.is_none_or(|filter| filter.meaning != Meaning::Normal)
    }

    /// The filter as it applies to a format: linear light is nothing special where there is no colour.
    pub fn for_format(self, format: LayerFormat) -> Result<LayerFilter, FilterError> {
        let plain = self.meaning == Meaning::Stored && self.from == LevelsFrom::Chain;
        if self.kernel.picks() && !plain {
            return Err(FilterError::Picks(self.kernel.name()));
        }
        match self.meaning {
            meaning if meaning.suits(format) => Ok(self),
            Meaning::Normal => Err(FilterError::Normal(format.name())),
            _ => Ok(LayerFilter { meaning: Meaning::Stored, ..self }),
        }
    }

    /// Where the filter puts the texels of coarser levels.
    pub fn positions(self) -> TexelPositions {
        if self.kernel.is_odd() { TexelPositions::Kept } else { TexelPositions::Centered }
    }

    /// Where all these filters put the texels of coarser levels, if they agree.
    pub fn common_positions(filters: &[LayerFilter]) -> Result<TexelPositions, FilterError> {
        let odd = filters.iter().find(|filter| filter.kernel.is_odd());
        let even = filters.iter().find(|filter| !filter.kernel.is_odd());
        match (odd, even) {
            (Some(&odd), Some(&even)) => Err(FilterError::Positions(odd, even)),
            (Some(_), None) => Ok(TexelPositions::Kept),
            _ => Ok(TexelPositions::Centered),
        }
    }
}

impl fmt::Display for LayerFilter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut name = format!("{}{}", self.kernel.name(), self.meaning.suffix());
        if self.from != LevelsFrom::Chain {
            name = format!("{name}@{}", self.from.name());
        }
        f.write_str(&filter_without(&name, self.nodata))
    }
}

impl FromStr for LayerFilter {
    type Err = FilterError;

    fn from_str(text: &str) -> Result<LayerFilter, FilterError> {
        let unknown = || FilterError::Name(text.into());
        let (text, nodata) = nodata_of_filter(text);
        let (rest, from) = match text.split_once('@') {
            None => (text, LevelsFrom::Chain),
            Some((rest, name)) => {
                let named = LevelsFrom::ALL[1..].iter().find(|from| from.name() == name);
                (rest, *named.ok_or_else(unknown)?)
            }
        };
        let (kernel, suffix) = rest.split_at(rest.find('-').unwrap_or(rest.len()));
        let kernel = Kernel::ALL.into_iter().find(|k| k.name() == kernel).ok_or_else(unknown)?;
        let meaning = Meaning::ALL.into_iter().find(|m| m.suffix() == suffix).ok_or_else(unknown)?;
        let filter = LayerFilter { kernel, meaning, from, nodata };
        if kernel.picks() && (meaning, from) != (Meaning::Stored, LevelsFrom::Chain) {
            return Err(FilterError::Picks(kernel.name()));
        }
        Ok(filter)
    }
}

/// A filter made ready for a format and a factor.
pub(crate) struct Filter {
    /// Which texels one of the coarser level looks at, along each axis.
    pub(crate) reach: Reach,
    pub(crate) method: Method,
}

/// How a row is made.
pub(crate) enum Method {
    /// From two rows of stored texels, at once.
    Quad(Quad),
    /// Along the rows first, then across them.
    Separable(Separable),
}

impl Filter {
    /// For texels of a format (one that is not compressed), each made from `factor` times `factor` and what
    /// lies around.
    pub(crate) fn new(filter: LayerFilter, format: LayerFormat, factor: u32) -> Filter {
        let weights = filter.kernel.weights(factor);
        let reach = Reach { factor, first: weights.first, count: weights.each.len() as u32 };
        let method = match Quad::new(filter, format).filter(|_| factor == 2) {
            Some(quad) => Method::Quad(quad),
            None => Method::Separable(Separable::new(filter, format, factor, &weights)),
        };
        Filter { reach, method }
    }

    /// A row of the coarser level, from the rows that it is made of, each of which holds all texels that it
    /// is made of.
    pub(crate) fn row(&self, coarse: &mut [u8], rows: &[&[u8]]) {
        match &self.method {
            Method::Quad(quad) => {
                if let [upper, lower] = rows {
                    quad.row(coarse, upper, lower);
                }
            }
            Method::Separable(separable) => {
                let texels = coarse.len() / separable.texel_bytes();
                let lines: Vec<_> = rows.iter().map(|row| separable.along(row, texels)).collect();
                separable.across(lines.iter().map(Vec::as_slice), coarse);
            }
        }
    }
}

/// Which texels along an axis one of the coarser level is made of: `count` of them, from `factor` times its
/// index plus `first` on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Reach {
    pub(crate) factor: u32,
    pub(crate) first: i64,
    pub(crate) count: u32,
}

impl Reach {
    /// The texels that one of the coarser level is made of; some may lie beyond the edges.
    pub(crate) fn of(self, coarse: u32) -> std::ops::Range<i64> {
        let first = i64::from(self.factor) * i64::from(coarse) + self.first;
        first..first + i64::from(self.count)
    }

    /// The texels that a run of the coarser level is made of. The run is not empty.
    pub(crate) fn of_run(self, coarse: &std::ops::Range<u32>) -> std::ops::Range<i64> {
        self.of(coarse.start).start..self.of(coarse.end - 1).end
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        for kernel in Kernel::ALL {
            for meaning in Meaning::ALL {
                for from in LevelsFrom::ALL {
                    let filter = LayerFilter { kernel, meaning, from, nodata: None };
                    let plain = meaning == Meaning::Stored && from == LevelsFrom::Chain;
                    let read = filter.to_string().parse::<LayerFilter>();
                    assert_eq!(read.is_ok(), plain || !kernel.picks(), "{filter}");
                    assert!(read.is_err() || read == Ok(filter));
                }
            }
        }
        for bad in [
            "",
            "boxy",
            "box-",
            "box-light",
            "box@chain",
            "box@",
            "-linear",
            "min-linear",
            "max@two",
            "min@zero",
            "box/nodata=",
            "box/nodata=x",
            "/nodata=1",
        ] {
            assert!(bad.parse::<LayerFilter>().is_err(), "{bad}");
        }
        assert_eq!(LayerFilter::default().to_string(), "box");
        for name in ["box-linear@two/nodata=-9999", "majority/nodata=0", "gauss3/nodata=nan"] {
            assert_eq!(name.parse::<LayerFilter>().unwrap().to_string(), name);
        }
    }

    #[test]
    fn layers_get_the_filter_of_their_meaning() {
        use LayerFormat::{R8, R16, Rg8, Rgba8, Rgba8Srgb, Rgba16Float};
        for (name, format, expected) in [
            ("color", Rgba8Srgb, "box-linear"),
            ("color", Rgba16Float, "box-linear"),
            ("Normals", Rgba8, "box-normal"),
            ("normal", Rg8, "box-normal"),
            ("normal", Rgba8Srgb, "box-linear"),
            ("landmask", R8, "box"),
            ("mask", R8, "majority"),
            ("id", R16, "majority"),
            ("idle", R16, "box"),
            ("height", R16, "box"),
            ("color", R8, "box"),
        ] {
            assert_eq!(LayerFilter::for_layer(name, format, true).to_string(), expected, "{name} {format:?}");
        }
        assert_eq!(LayerFilter::for_layer("color", Rgba8Srgb, false).to_string(), "box");
    }

    #[test]
    fn a_filter_must_suit_its_format() {
        let suited = |name: &str, format| name.parse::<LayerFilter>().unwrap().for_format(format);
        assert_eq!(suited("kaiser-linear", LayerFormat::R8), Ok("kaiser".parse().unwrap()));
        assert_eq!(suited("box-normal", LayerFormat::R16), Err(FilterError::Normal("r16")));
        assert_eq!(suited("box-normal", LayerFormat::Rgba8Srgb), Err(FilterError::Normal("rgba8-srgb")));
        let (gauss3, gauss4) = ("gauss3".parse().unwrap(), "gauss4".parse().unwrap());
        assert_eq!(LayerFilter::common_positions(&[gauss3]), Ok(TexelPositions::Kept));
        assert!(LayerFilter::common_positions(&[gauss4, gauss3]).is_err());
    }
}
