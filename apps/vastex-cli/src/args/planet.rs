//! What `render` and `view` are told of a planet: its files beside the source, and how it is lit.

use std::path::{Path, PathBuf};

use clap::Args;
use vastex_scenes::{DisplayOptions, Heights, LayerOptions, PlanetLight, PlanetOptions, Scene};
use vastex_viewer::Sun;
use vastex_viewer::layers::MOST_LAYERS;

/// The options for a planet.
#[derive(Clone, Debug, Default, Args)]
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
    #[arg(long, value_name = "LON,LAT", allow_hyphen_values = true)]
    pub(crate) sun: Option<Sun>,
    /// How many times as high as it is a planet's relief is made, 0 to 1000
    #[arg(long, value_name = "N", value_parser = |text: &str| number(text, PlanetLight::MOST_EXAGGERATION))]
    pub(crate) exaggeration: Option<f32>,
    /// How dense a planet's air is, the Earth's being 1; 0 for none, 20 at most
    #[arg(long, value_name = "N", value_parser = |text: &str| number(text, PlanetLight::MOST_ATMOSPHERE))]
    pub(crate) atmosphere: Option<f32>,
}

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
                sun: self.sun.map_or(light.sun, Sun::into),
                exaggeration: self.exaggeration.unwrap_or(light.exaggeration),
                atmosphere: self.atmosphere.unwrap_or(light.atmosphere),
                ..light
            },
        }
    }

    /// What does not go together with the scene, and with all that is shown there.
    pub(crate) fn fault(&self, shown: &DisplayOptions, scene: Scene) -> Option<String> {
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
        let PlanetOptions { night, clouds, .. } = &shown.planet;
        let count = shown.layers.len() + night.iter().count() + clouds.iter().count();
        (scene == Scene::Planet && count > MOST_LAYERS).then(|| {
            format!("{count} layers with lights at night and clouds; {MOST_LAYERS} are shown at most")
        })
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
    fn numbers_are_checked() {
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
        let shown = |layers: usize| DisplayOptions {
            layers: vec![LayerOptions::default(); layers],
            planet: night.options(layers, &mut Heights::default()),
            ..DisplayOptions::default()
        };
        assert!(night.fault(&shown(1), Scene::Globe).unwrap().contains("--night is for a planet"));
        assert_eq!(night.fault(&shown(1), Scene::Planet), None);
        assert!(night.fault(&shown(8), Scene::Planet).unwrap().contains("9 layers"));
        let height = PlanetArgs { height: Some("h".into()), ..args() };
        assert_eq!(height.fault(&shown(1), Scene::Terrain), None);
        assert!(height.fault(&shown(1), Scene::Image).unwrap().contains("--height"));
    }
}
