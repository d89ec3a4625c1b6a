//! Colour maps: how one value from 0 to 1 becomes a colour, as a display value.
//!
//! Each is linear between its points, the same on the CPU and in shaders, which are told the points of the
//! map that is shown: however many maps there are, the text of shaders is the same.

mod points;

use std::fmt;
use std::str::FromStr;

use points::{POINTS, Points};

/// Four points in each; the last of them are not used.
const WORDS: usize = POINTS.div_ceil(4);

/// The points of a colour map as shaders are told them: `palette` in surface.wgsl, `maps` in volume.wgsl.
pub(crate) type PaletteUniform = [[u32; 4]; WORDS];

/// A colour map, as it is or reversed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Palette {
    map: Map,
    is_reversed: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
enum Map {
    #[default]
    Grey,
    Viridis,
    Magma,
    Inferno,
    Plasma,
    Cividis,
    Turbo,
    Coolwarm,
    Terrain,
}

/// A text names no colour map.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the colour maps are {}; each of them reversed has _r behind its name",
    Palette::ALL.map(Palette::name).join(", ")
)]
pub struct ParsePaletteError;

impl Palette {
    /// From black to white.
    pub const GREY: Palette = Palette::of(Map::Grey);
    /// From dark violet by green to yellow, as evenly as the eye sees.
    pub const VIRIDIS: Palette = Palette::of(Map::Viridis);
    /// From black by violet and red to pale yellow, as evenly as the eye sees.
    pub const MAGMA: Palette = Palette::of(Map::Magma);
    /// From black by red to pale yellow, as evenly as the eye sees.
    pub const INFERNO: Palette = Palette::of(Map::Inferno);
    /// From blue by red to yellow, as evenly as the eye sees.
    pub const PLASMA: Palette = Palette::of(Map::Plasma);
    /// From dark blue by grey to yellow, nearly the same to those who see few colours.
    pub const CIVIDIS: Palette = Palette::of(Map::Cividis);
    /// All colours of the rainbow, without its bands.
    pub const TURBO: Palette = Palette::of(Map::Turbo);
    /// From blue by pale grey in the middle to red: how far values are from the middle of the range.
    pub const COOLWARM: Palette = Palette::of(Map::Coolwarm);
    /// As heights in an atlas: water, coast, green, brown, snow. The coast is at a quarter of the range.
    pub const TERRAIN: Palette = Palette::of(Map::Terrain);

    /// Every map, none of them reversed.
    pub const ALL: [Palette; 9] = [
        Palette::GREY,
        Palette::VIRIDIS,
        Palette::MAGMA,
        Palette::INFERNO,
        Palette::PLASMA,
        Palette::CIVIDIS,
        Palette::TURBO,
        Palette::COOLWARM,
        Palette::TERRAIN,
    ];

    const fn of(map: Map) -> Palette {
        Palette { map, is_reversed: false }
    }

    /// This colour map the other way round: the colour of 1 for 0.
    #[must_use]
    pub const fn reversed(self) -> Palette {
        Palette { is_reversed: !self.is_reversed, ..self }
    }

    /// Returns true if the colour map is another way round than its name without `_r` says.
    pub const fn is_reversed(self) -> bool {
        self.is_reversed
    }

    /// The name in words of a command line, without what says that it is reversed.
    pub const fn name(self) -> &'static str {
        match self.map {
            Map::Grey => "grey",
            Map::Viridis => "viridis",
            Map::Magma => "magma",
            Map::Inferno => "inferno",
            Map::Plasma => "plasma",
            Map::Cividis => "cividis",
            Map::Turbo => "turbo",
            Map::Coolwarm => "coolwarm",
            Map::Terrain => "terrain",
        }
    }

    /// Returns true if values are their own shades.
    pub(crate) fn is_plain(self) -> bool {
        self == Palette::GREY
    }

    fn points(self) -> Option<&'static Points> {
        Some(match self.map {
            Map::Grey => return None,
            Map::Viridis => &points::VIRIDIS,
            Map::Magma => &points::MAGMA,
            Map::Inferno => &points::INFERNO,
            Map::Plasma => &points::PLASMA,
            Map::Cividis => &points::CIVIDIS,
            Map::Turbo => &points::TURBO,
            Map::Coolwarm => &points::COOLWARM,
            Map::Terrain => &points::TERRAIN,
        })
    }

    /// The `n`-th point from where the map begins as it is shown: red, green and blue from 0 to 1.
    fn point(self, n: usize) -> [f32; 3] {
        let n = if self.is_reversed { POINTS - 1 - n } else { n };
        match self.points() {
            Some(points) => [16, 8, 0].map(|shift| ((points[n] >> shift) & 255) as f32 / 255.0),
            None => [n as f32 / (POINTS - 1) as f32; 3],
        }
    }

    /// The colour of a value, as display values from 0 to 1.
    pub fn color(self, value: f32) -> [f32; 3] {
        let value = value.clamp(0.0, 1.0);
        if self.points().is_none() {
            return [if self.is_reversed { 1.0 - value } else { value }; 3];
        }
        let at = value * (POINTS - 1) as f32;
        let first = (at as usize).min(POINTS - 2);
        let (low, high, share) = (self.point(first), self.point(first + 1), at - first as f32);
        std::array::from_fn(|channel| low[channel] + (high[channel] - low[channel]) * share)
    }

    /// What shaders are told: red in the lowest bits of each point.
    pub(crate) fn uniform(self) -> PaletteUniform {
        let mut told = [[0; 4]; WORDS];
        for n in 0..POINTS {
            let [red, green, blue] = self.point(n).map(|value| (value * 255.0).round() as u32);
            told[n / 4][n % 4] = red | (green << 8) | (blue << 16) | 0xff00_0000;
        }
        told
    }

    /// What shaders have of maps: the numbers of the points, and how they are looked up.
    pub(crate) fn wgsl() -> String {
        let last = POINTS - 1;
        let numbers = format!("const PALETTE_WORDS: u32 = {WORDS}u;\nconst PALETTE_LAST: u32 = {last}u;\n");
        numbers + include_str!("map.wgsl")
    }
}

/// The colour map's name, with `_r` behind it where it is reversed.
impl fmt::Display for Palette {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        f.write_str(if self.is_reversed { "_r" } else { "" })
    }
}

/// `gray` is `grey`.
impl FromStr for Palette {
    type Err = ParsePaletteError;

    fn from_str(text: &str) -> Result<Palette, ParsePaletteError> {
        let (name, is_reversed) = text.strip_suffix("_r").map_or((text, false), |name| (name, true));
        let name = if name == "gray" { "grey" } else { name };
        let found = Palette::ALL.into_iter().find(|palette| palette.name() == name);
        found.map(|palette| Palette { is_reversed, ..palette }).ok_or(ParsePaletteError)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The number of a colour of 256, and its red, green and blue.
    type Colour = (u8, [u8; 3]);

    /// Colours of the published maps.
    #[rustfmt::skip]
    const PUBLISHED: [(Palette, [Colour; 11]); 8] = [
        (Palette::VIRIDIS, [(0, [68, 1, 84]), (13, [72, 20, 103]), (51, [65, 68, 135]), (77, [52, 96, 141]), (102, [42, 120, 142]), (128, [33, 145, 140]), (154, [35, 169, 131]), (179, [68, 191, 112]), (211, [139, 214, 70]), (240, [216, 226, 25]), (255, [253, 231, 37])]),
        (Palette::MAGMA, [(0, [0, 0, 4]), (13, [7, 6, 28]), (51, [59, 15, 112]), (77, [101, 26, 128]), (102, [140, 41, 129]), (128, [183, 55, 121]), (154, [223, 74, 104]), (179, [247, 112, 92]), (211, [254, 172, 118]), (240, [253, 226, 163]), (255, [252, 253, 191])]),
        (Palette::INFERNO, [(0, [0, 0, 4]), (13, [8, 5, 29]), (51, [66, 10, 104]), (77, [108, 24, 110]), (102, [147, 38, 103]), (128, [188, 55, 84]), (154, [222, 82, 56]), (179, [243, 120, 25]), (211, [252, 178, 22]), (240, [242, 234, 105]), (255, [252, 255, 164])]),
        (Palette::PLASMA, [(0, [13, 8, 135]), (13, [44, 5, 148]), (51, [106, 0, 168]), (77, [145, 14, 163]), (102, [177, 42, 144]), (128, [204, 71, 120]), (154, [226, 101, 97]), (179, [242, 132, 75]), (211, [253, 177, 48]), (240, [248, 223, 37]), (255, [240, 249, 33])]),
        (Palette::CIVIDIS, [(0, [0, 34, 78]), (13, [0, 44, 100]), (51, [53, 69, 108]), (77, [80, 87, 108]), (102, [102, 105, 112]), (128, [125, 124, 120]), (154, [149, 143, 119]), (179, [174, 163, 113]), (211, [208, 190, 98]), (240, [240, 216, 70]), (255, [254, 232, 56])]),
        (Palette::TURBO, [(0, [48, 18, 59]), (13, [62, 56, 145]), (51, [62, 155, 254]), (77, [24, 215, 202]), (102, [70, 248, 132]), (128, [164, 252, 60]), (154, [227, 219, 56]), (179, [254, 164, 49]), (211, [231, 73, 12]), (240, [169, 22, 1]), (255, [122, 4, 3])]),
        (Palette::COOLWARM, [(0, [59, 76, 192]), (13, [74, 99, 211]), (51, [123, 159, 249]), (77, [159, 191, 255]), (102, [192, 212, 245]), (128, [221, 220, 220]), (154, [242, 202, 181]), (179, [247, 172, 142]), (211, [233, 120, 94]), (240, [202, 59, 55]), (255, [180, 4, 38])]),
        (Palette::TERRAIN, [(0, [51, 51, 153]), (13, [34, 86, 188]), (51, [0, 179, 178]), (77, [53, 215, 113]), (102, [153, 235, 133]), (128, [254, 254, 152]), (154, [202, 187, 124]), (179, [152, 123, 97]), (211, [167, 142, 137]), (240, [225, 217, 215]), (255, [255, 255, 255])]),
    ];

    #[test]
    fn colours_are_those_that_were_published() {
        for (palette, colours) in PUBLISHED {
            for (n, expected) in colours {
                let value = f32::from(n) / 255.0;
                for found in [palette.color(value), palette.reversed().color(1.0 - value)] {
                    let off =
                        (0..3).map(|channel| (found[channel] * 255.0 - f32::from(expected[channel])).abs());
                    let worst = off.fold(0.0, f32::max);
                    assert!(worst < 2.0, "{palette} at {n}: {found:?} for {expected:?}");
                }
            }
        }
        assert_eq!(Palette::GREY.color(0.25), [0.25; 3]);
        assert_eq!(Palette::GREY.reversed().color(0.25), [0.75; 3]);
    }

    #[test]
    fn maps_that_are_even_become_lighter_all_the_way() {
        let brightness = |[r, g, b]: [f32; 3]| 0.21 * r + 0.72 * g + 0.07 * b;
        for palette in Palette::ALL {
            if [Palette::TURBO, Palette::COOLWARM, Palette::TERRAIN].contains(&palette) {
                continue;
            }
            let shades: Vec<f32> = (0..=64).map(|n| brightness(palette.color(n as f32 / 64.0))).collect();
            assert!(shades.is_sorted_by(|a, b| *b > a - 0.005), "{palette}: {shades:?}");
            assert!(shades[0] < 0.16 && shades[64] > 0.7, "{palette}: {shades:?}");
        }
    }

    #[test]
    fn a_name_is_its_map() {
        for palette in Palette::ALL.into_iter().flat_map(|palette| [palette, palette.reversed()]) {
            assert_eq!(palette.to_string().parse(), Ok(palette));
        }
        assert_eq!("gray_r".parse(), Ok(Palette::GREY.reversed()));
        let error = "jet".parse::<Palette>().unwrap_err().to_string();
        assert!(error.starts_with("the colour maps are grey, viridis, magma, inferno"), "{error}");
        assert!("viridis_r_r".parse::<Palette>().is_err());
    }

    #[test]
    fn shaders_are_told_the_same_points() {
        let told = Palette::TURBO.reversed().uniform();
        let first = told[0][0].to_le_bytes();
        assert_eq!(first, [122, 4, 3, 255]);
        assert_eq!(told[WORDS - 1][0].to_le_bytes(), [48, 18, 59, 255]);
    }
}
