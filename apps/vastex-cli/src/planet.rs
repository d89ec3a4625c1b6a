//! `planet:BITS[:IMAGE]`: a generated planet of 2^BITS texels round the equator, in the place of a file.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, anyhow};
use vastex::TileSource;
use vastex::source::{PlanetImage, PlanetSource};
use vastex_scenes::planet_image;

/// Opens the planet that the words after `planet:` say, with the continents of the image that they name,
/// which `open_image` opens. Where they name none, continents are made up.
pub(crate) fn open(
    words: &str,
    open_image: impl FnOnce(&Path) -> Result<Arc<dyn TileSource>>,
) -> Result<Arc<dyn TileSource>> {
    let (bits, image) = words.split_once(':').map_or((words, None), |(bits, image)| (bits, Some(image)));
    let most = PlanetSource::MOST_BITS;
    let usage = || {
        anyhow!(
            "write planet:BITS or planet:BITS:IMAGE, as in planet:31 or planet:31:earth.vastex; BITS is a whole number from 8 to \
             {most}: the planet has 2^BITS texels round the equator"
        )
    };
    let bits: u32 = bits.parse().map_err(|_| usage())?;
    if !(8..=most).contains(&bits) {
        return Err(usage());
    }
    let image = match image {
        None => made_up(),
        Some("") => return Err(usage()),
        Some(file) => {
            let tiles = open_image(Path::new(file)).context(file.to_owned())?;
            planet_image(&*tiles).context(file.to_owned())?
        }
    };
    Ok(Arc::new(PlanetSource::new(image, bits)?))
}

/// Size of the image that is made up.
const SIZE: [u32; 2] = [512, 256];
/// Each wave's turns round a sphere's axes, and its weight: some for continents, finer ones for their coasts.
const WAVES: [([f64; 3], f64); 8] = [
    ([1.7, 2.3, 1.1], 1.0),
    ([-2.9, 1.3, 2.1], 0.8),
    ([3.7, -2.2, 1.9], 0.6),
    ([5.3, 4.1, -3.2], 0.4),
    ([-8.9, 7.7, 6.1], 0.25),
    ([13.1, -11.3, 9.7], 0.18),
    ([-21.7, 19.9, 17.3], 0.12),
    ([37.1, 31.3, -29.9], 0.08),
];
/// Heights, from the deepest sea to the highest mountain, and their colours.
const SHADES: [(f64, [f64; 3]); 6] = [
    (-2.5, [8.0, 20.0, 60.0]),
    (0.15, [24.0, 70.0, 120.0]),
    (0.2, [180.0, 170.0, 120.0]),
    (0.35, [70.0, 110.0, 50.0]),
    (1.1, [110.0, 90.0, 60.0]),
    (2.5, [235.0, 235.0, 240.0]),
];

/// Continents by waves over a sphere, ice at the poles.
fn made_up() -> PlanetImage {
    let texel = |n: u32| {
        let [u, v] = [n % SIZE[0], n / SIZE[0]];
        let longitude = (f64::from(u) + 0.5) / f64::from(SIZE[0]) * std::f64::consts::TAU;
        let latitude = (0.5 - (f64::from(v) + 0.5) / f64::from(SIZE[1])) * std::f64::consts::PI;
        let at = [longitude.cos() * latitude.cos(), longitude.sin() * latitude.cos(), latitude.sin()];
        let wave = |(turns, weight): ([f64; 3], f64)| {
            let along: f64 = turns.iter().zip(at).map(|(turns, at)| turns * at).sum();
            weight * (along + turns[0]).sin()
        };
        let height: f64 = WAVES.into_iter().map(wave).sum();
        shade(height + 3.0 * (latitude.abs() - 1.25).max(0.0) * 4.0)
    };
    PlanetImage { size: SIZE, texels: (0..SIZE[0] * SIZE[1]).map(texel).collect() }
}

fn shade(height: f64) -> [u8; 4] {
    let above = SHADES.iter().position(|(at, _)| *at > height).unwrap_or(SHADES.len() - 1).max(1);
    let ((low, below), (high, above)) = (SHADES[above - 1], SHADES[above]);
    let share = ((height - low) / (high - low)).clamp(0.0, 1.0);
    let channel = |n: usize| (below[n] + (above[n] - below[n]) * share).round() as u8;
    [channel(0), channel(1), channel(2), 255]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn no_file(_: &Path) -> Result<Arc<dyn TileSource>> {
        Err(anyhow!("there is no such file"))
    }

    #[test]
    fn what_is_no_planet_is_told_how_to_write_one() {
        for words in ["", "7", "32", "x", "31:", "-1", "12.5", ":a.vastex"] {
            let error = format!("{:#}", open(words, no_file).err().unwrap());
            assert!(error.contains("planet:31"), "{words}: {error}");
        }
        let error = format!("{:#}", open("12:no-such-file.vastex", no_file).err().unwrap());
        assert!(error.contains("no-such-file.vastex"), "{error}");
        let planet = open("31", no_file).unwrap();
        assert_eq!(planet.description().geometry.size(), [1 << 31, 1 << 30, 1]);
    }

    #[test]
    fn a_planet_without_an_image_has_land_and_sea() {
        let image = made_up();
        let blue = image.texels.iter().filter(|texel| texel[2] > texel[0]).count();
        let share = blue as f64 / image.texels.len() as f64;
        assert!((0.3..0.8).contains(&share), "{share}");
    }
}
