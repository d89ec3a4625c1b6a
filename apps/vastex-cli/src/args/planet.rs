//! What `render` and `view` are told of a planet: its files beside the source, and how it is lit.

use std::path::{Path, PathBuf};

use clap::Args;
use vastex_scenes::{Heights, LayerOptions, PlanetLight, PlanetOptions, Scene};
use vastex_viewer::layers::MOST_LAYERS;

/// The options for a planet.
#[derive(Debug, Args)]
pub(crate) struct PlanetArgs {
    /// Heights in a file of their own, which may be whatever a source may be: on a planet, a globe or a
    /// terrain
    #[arg(long, value_name = "FILE")]
    pub(crate) height: Option<PathBuf>,
    /// What shines on a planet where it is night
    #[arg(long, value_name = "FILE")]
    pub(crate) night: Option<PathBuf>,
    /// The clouds of a planet: the lighter, and the more opaque if it has alpha, the more they hide
    #[arg(long, value_name = "FILE")]
    pub(crate) clouds: Option<PathBuf>,
    /// Longitude and latitude in degrees over which a planet's sun stands; off: all of it is as light as it
    /// can be
    #[arg(long, value_name = "LON,LAT", value_parser = parse_sun, allow_hyphen_values = true)]
    pub(crate) sun: Option<Sun>,
    /// How many times as high as it is a planet's relief is made, 0 to 1000
    #[arg(long, value_name = "N", value_parser = |text: &str| number(text, 1000.0))]
    pub(crate) exaggeration: Option<f32>,
    /// How dense a planet's air is, the Earth's being 1; 0 for none, 20 at most
    #[arg(long, value_name = "N", value_parser = |text: &str| number(text, 20.0))]
    pub(crate) atmosphere: Option<f32>,
}

/// Where a sun stands, if there is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sun(Option<[f64; 2]>);

impl PlanetArgs {
    /// The files, in the order in which they are opened.
    pub(crate) fn files(&self) -> impl Iterator<Item = &Path> {
        [&self.height, &self.night, &self.clouds].into_iter().flatten().map(PathBuf::as_path)
    }

    /// In the words of the scenes: the first of the files is the texture of this number. Heights are told
    /// which of them they are of.
    pub(crate) fn options(&self, first: usize, heights: &mut Heights) -> PlanetOptions {
        let mut texture = first..;
        let mut next = |file: &Option<PathBuf>| file.as_ref().and_then(|_| texture.next());
        heights.texture = next(&self.height);
        let layer = |texture| LayerOptions { texture, ..LayerOptions::default() };
        let light = PlanetLight::default();
        PlanetOptions {
            night: next(&self.night).map(layer),
            clouds: next(&self.clouds).map(layer),
            light: PlanetLight {
                sun: self.sun.map_or(light.sun, |Sun(sun)| sun),
                exaggeration: self.exaggeration.unwrap_or(light.exaggeration),
                atmosphere: self.atmosphere.unwrap_or(light.atmosphere),
                ..light
            },
        }
    }

    /// What does not go together with the scene, on which so many layers lie over one another.
    pub(crate) fn fault(&self, layers: usize, scene: Scene) -> Option<String> {
        let is_told = [
            ("--night", self.night.is_some()),
            ("--clouds", self.clouds.is_some()),
            ("--sun", self.sun.is_some()),
            ("--exaggeration", self.exaggeration.is_some()),
            ("--atmosphere", self.atmosphere.is_some()),
        ];
        if let Some((option, _)) = is_told.iter().find(|(_, is_told)| *is_told && scene != Scene::Planet) {
            return Some(format!("{option} is for a planet; leave it out, or put the image --on planet"));
        }
        if self.height.is_some() && matches!(scene, Scene::Image | Scene::Plane) {
            return Some(
                "--height displaces a planet, a globe or a terrain; leave it out, or put the image --on one of these"
                    .into(),
            );
        }
        let count = layers + self.night.iter().count() + self.clouds.iter().count();
        (count > MOST_LAYERS).then(|| {
            format!("{count} layers with those of --night and --clouds; {MOST_LAYERS} are shown at most")
        })
    }
}

/// A longitude and a latitude, or `off`.
fn parse_sun(text: &str) -> Result<Sun, String> {
    if text == "off" {
        return Ok(Sun(None));
    }
    let place = text.split_once(',').and_then(|(longitude, latitude)| {
        Some([longitude.trim().parse().ok()?, latitude.trim().parse().ok()?])
    });
    match place {
        Some([longitude, latitude]) if f64::abs(longitude) <= 360.0 && f64::abs(latitude) <= 90.0 => {
            Ok(Sun(Some([longitude, latitude])))
        }
        _ => {
            Err("write a longitude from -360 to 360 and a latitude from -90 to 90, as in -40,15, or off"
                .into())
        }
    }
}

/// A number from 0 to a limit.
fn number(text: &str, most: f32) -> Result<f32, String> {
    match text.parse() {
        Ok(number) if (0.0..=most).contains(&number) => Ok(number),
        _ => Err(format!("write a number from 0 to {most}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn args() -> PlanetArgs {
        PlanetArgs {
            height: None,
            night: None,
            clouds: None,
            sun: None,
            exaggeration: None,
            atmosphere: None,
        }
    }

    #[test]
    fn suns_and_numbers_are_checked() {
        assert_eq!(parse_sun("-40, 15.5"), Ok(Sun(Some([-40.0, 15.5]))));
        assert_eq!(parse_sun("off"), Ok(Sun(None)));
        for bad in ["", "40", "40,", "nan,0", "0,91", "361,0", "on", "1,2,3"] {
            assert!(parse_sun(bad).is_err(), "{bad}");
        }
        assert_eq!(number("20", 20.0), Ok(20.0));
        for bad in ["", "-1", "21", "nan", "inf"] {
            assert!(number(bad, 20.0).is_err(), "{bad}");
        }
    }

    #[test]
    fn files_are_numbered_as_they_are_opened() {
        let file = |name: &str| Some(PathBuf::from(name));
        let told = PlanetArgs { height: file("h"), clouds: file("c"), ..args() };
        let mut heights = Heights::default();
        let options = told.options(3, &mut heights);
        assert_eq!((heights.texture, options.night), (Some(3), None));
        assert_eq!(options.clouds.map(|layer| layer.texture), Some(4));
        assert_eq!(told.files().collect::<Vec<_>>(), [Path::new("h"), Path::new("c")]);
    }

    #[test]
    fn what_is_of_a_planet_goes_on_a_planet() {
        let night = PlanetArgs { night: Some("n".into()), ..args() };
        assert!(night.fault(1, Scene::Globe).unwrap().contains("--night is for a planet"));
        assert_eq!(night.fault(1, Scene::Planet), None);
        assert!(night.fault(8, Scene::Planet).unwrap().contains("9 layers"));
        let height = PlanetArgs { height: Some("h".into()), ..args() };
        assert_eq!(height.fault(1, Scene::Terrain), None);
        assert!(height.fault(1, Scene::Image).unwrap().contains("--height"));
    }
}
