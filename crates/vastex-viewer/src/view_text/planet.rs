//! What a view says of a planet: where the sun stands, how its relief, its air and its lights are seen, and
//! which layers shine on it at night and hide it as clouds.

use std::fmt::{self, Display};
use std::str::FromStr;

use crate::surface::{LayerOptions, PlanetLight, PlanetOptions};

/// Where a planet's sun stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sun {
    /// There is none: all is as light as it can be.
    Off,
    /// Over a longitude of -360 to 360 and a latitude of -90 to 90 degrees.
    Over([f64; 2]),
}

impl From<Sun> for Option<[f64; 2]> {
    fn from(sun: Sun) -> Option<[f64; 2]> {
        match sun {
            Sun::Off => None,
            Sun::Over(place) => Some(place),
        }
    }
}

/// A text says of no sun where it stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("write a longitude from -360 to 360 and a latitude from -90 to 90, as in -40,15, or off")]
pub struct ParseSunError;

impl FromStr for Sun {
    type Err = ParseSunError;

    fn from_str(text: &str) -> Result<Sun, ParseSunError> {
        if text == "off" {
            return Ok(Sun::Off);
        }
        let (longitude, latitude) = text.split_once(',').ok_or(ParseSunError)?;
        let angle = |text: &str, most: f64| {
            let angle = text.trim().parse().ok().filter(|angle: &f64| angle.abs() <= most);
            angle.ok_or(ParseSunError)
        };
        Ok(Sun::Over([angle(longitude, 360.0)?, angle(latitude, 90.0)?]))
    }
}

impl Display for Sun {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Sun::Off => f.write_str("off"),
            Sun::Over([longitude, latitude]) => write!(f, "{longitude},{latitude}"),
        }
    }
}

/// What a view says of a planet; nothing of what is `None`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewPlanet {
    /// Where the planet's sun stands.
    pub sun: Option<Sun>,
    /// By how much mountains are made higher than they are, 0 to [`PlanetLight::MOST_EXAGGERATION`].
    pub exaggeration: Option<f32>,
    /// How dense its air is, 0 to [`PlanetLight::MOST_ATMOSPHERE`].
    pub atmosphere: Option<f32>,
    /// How bright its lights are, 0 to [`PlanetLight::MOST_NIGHT`].
    pub lights: Option<f32>,
    /// The layer that shines where it is night.
    pub night: Option<LayerOptions>,
    /// The planet's clouds.
    pub clouds: Option<LayerOptions>,
}

impl ViewPlanet {
    /// All of a light. Numbers that no text may have become the nearest that one may.
    pub(super) fn lit(light: &PlanetLight) -> ViewPlanet {
        let PlanetLight { sun, exaggeration, atmosphere, night } = light.within();
        ViewPlanet {
            sun: Some(sun.map_or(Sun::Off, Sun::Over)),
            exaggeration: Some(exaggeration),
            atmosphere: Some(atmosphere),
            lights: Some(night),
            night: None,
            clouds: None,
        }
    }

    /// Makes of a planet what is said of it.
    pub(super) fn change(&self, planet: &mut PlanetOptions) {
        let light = &mut planet.light;
        light.sun = self.sun.map_or(light.sun, Sun::into);
        light.exaggeration = self.exaggeration.unwrap_or(light.exaggeration);
        light.atmosphere = self.atmosphere.unwrap_or(light.atmosphere);
        light.night = self.lights.unwrap_or(light.night);
        planet.night = self.night.clone().or(planet.night.take());
        planet.clouds = self.clouds.clone().or(planet.clouds.take());
    }

    /// Gives each part of a text to `add`, by its key.
    pub(super) fn write(&self, add: &mut impl FnMut(&str, &dyn Display)) {
        let ViewPlanet { sun, exaggeration, atmosphere, lights, night, clouds } = self;
        sun.iter().for_each(|sun| add("sun", sun));
        for (key, number) in [("exaggeration", exaggeration), ("atmosphere", atmosphere), ("lights", lights)]
        {
            number.iter().for_each(|number| add(key, number));
        }
        for (key, layer) in [("night", night), ("clouds", clouds)] {
            layer.iter().for_each(|layer| add(key, layer));
        }
    }

    /// Takes in a part of a text that says how a planet is lit.
    pub(super) fn read(&mut self, key: &str, value: &str) -> Result<(), String> {
        let number = |most: f32| match value.parse() {
            Ok(number) if (0.0..=most).contains(&number) => Ok(Some(number)),
            _ => Err(format!("write a number from 0 to {most}")),
        };
        match key {
            "sun" => self.sun = Some(value.parse::<Sun>().map_err(|why| why.to_string())?),
            "exaggeration" => self.exaggeration = number(PlanetLight::MOST_EXAGGERATION)?,
            "atmosphere" => self.atmosphere = number(PlanetLight::MOST_ATMOSPHERE)?,
            _ => self.lights = number(PlanetLight::MOST_NIGHT)?,
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suns_are_checked_and_written_as_they_are_read() {
        assert_eq!("-40, 15.5".parse(), Ok(Sun::Over([-40.0, 15.5])));
        for sun in [Sun::Off, Sun::Over([0.1 + 0.2, -90.0])] {
            assert_eq!(sun.to_string().parse(), Ok(sun));
        }
        for bad in ["", "40", "40,", "nan,0", "0,91", "361,0", "on", "1,2,3"] {
            assert_eq!(bad.parse::<Sun>(), Err(ParseSunError), "{bad}");
        }
    }
}
