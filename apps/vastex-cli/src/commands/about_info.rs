//! What `vastex info` says of an image besides its texels: their size and place, its colour profile, and what
//! a TIFF file says in words.

use serde::Serialize;
use vastex_build::{GeoPlace, PixelSize, TiffAbout};

/// Columns that names have at most; of longer ones the values stand farther to the right.
const MOST_NAME: usize = 28;

/// What there is to say, by names; one without a name goes on with the one before it.
pub(super) type Rows = Vec<(String, String)>;

/// What `--json` prints of it.
#[derive(Default, Serialize)]
pub(super) struct AboutSummary {
    #[serde(skip_serializing_if = "Option::is_none")]
    pixel_size: Option<Pixel>,
    #[serde(skip_serializing_if = "Option::is_none")]
    place: Option<Place>,
    #[serde(skip_serializing_if = "Option::is_none")]
    magnification: Option<f64>,
    /// As text, which tells what is no number, too.
    #[serde(skip_serializing_if = "Option::is_none")]
    nodata: Option<String>,
    /// The name of the colour profile.
    #[serde(skip_serializing_if = "Option::is_none")]
    profile: Option<String>,
    /// What a TIFF file says in words.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    words: Vec<Word>,
}

/// Width and height of a texel of level 0.
#[derive(Serialize)]
struct Pixel {
    size: [f64; 2],
    unit: String,
}

/// Where the image lies on the Earth.
#[derive(Serialize)]
struct Place {
    /// x = m0 column + m1 row + m2, y = m3 column + m4 row + m5, from corner to corner.
    from_texels: [f64; 6],
    #[serde(skip_serializing_if = "Option::is_none")]
    epsg: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<String>,
}

/// A thing that a file says.
#[derive(Serialize)]
struct Word {
    /// Empty where it goes on with the one before it.
    name: String,
    value: String,
}

impl AboutSummary {
    /// Of what a TIFF file says, and of its colour profile.
    pub(super) fn new(about: &TiffAbout, profile: Option<String>) -> AboutSummary {
        let pixel = |PixelSize { size, unit, .. }: &PixelSize| Pixel { size: *size, unit: unit.clone() };
        let place = |GeoPlace { from_texels, epsg, name, .. }: &GeoPlace| Place {
            from_texels: *from_texels,
            epsg: *epsg,
            name: name.clone(),
        };
        let word = |(name, value): &(String, String)| Word { name: name.clone(), value: value.clone() };
        AboutSummary {
            pixel_size: about.pixel_size.as_ref().map(pixel),
            place: about.place.as_ref().map(place),
            magnification: about.magnification,
            nodata: about.nodata.map(|value| value.to_string().to_lowercase()),
            profile,
            words: about.words.iter().map(word).collect(),
        }
    }

    /// Of an image of another kind, of which only its colour profile is known.
    pub(super) fn of_profile(profile: Option<String>) -> AboutSummary {
        AboutSummary { profile, ..AboutSummary::default() }
    }

    /// What there is to say of an image of so many texels, but for what a file says in words.
    pub(super) fn rows(&self, size: [u32; 2]) -> Rows {
        let mut rows = Rows::new();
        let mut add = |name: &str, value: String| rows.push((name.to_owned(), value));
        if let Some(Pixel { size: [w, h], unit }) = &self.pixel_size {
            add("texel", if w == h { format!("{w} {unit}") } else { format!("{w} x {h} {unit}") });
        }
        if let Some(times) = self.magnification {
            add("magnified", format!("{times} times"));
        }
        if let Some(value) = &self.nodata {
            add(
                "no data",
                format!(
                    "{value}: left out where it is shown, unless by --layer :nodata=off or :nodata-color=RRGGBB"
                ),
            );
        }
        if let Some(Place { from_texels: [a, b, east, d, e, north], epsg, name }) = &self.place {
            let system = [epsg.map(|code| format!("EPSG:{code}")), name.clone()];
            let system: Vec<_> = system.into_iter().flatten().collect();
            add("system", if system.is_empty() { "a system of its own".into() } else { system.join(", ") });
            let [w, h] = size.map(f64::from);
            let far = [a * w + b * h + east, d * w + e * h + north];
            add("place", format!("from {east}, {north} to {}, {}", far[0], far[1]));
        }
        if let Some(profile) = &self.profile {
            add("profile", profile.clone());
        }
        rows
    }

    /// What a file says in words.
    pub(super) fn words(&self) -> impl Iterator<Item = (String, String)> {
        self.words.iter().map(|word| (word.name.clone(), word.value.clone()))
    }
}

/// The rows about what is shown as something else than it is stored.
pub(super) fn converted_rows(conversions: &[String]) -> impl Iterator<Item = (String, String)> {
    conversions.iter().map(|conversion| ("converted".to_owned(), conversion.clone()))
}

/// Rows as a text: names, and beside them values, of which every line begins in the same column.
pub(super) fn text_of(rows: &[(String, String)]) -> String {
    let longest = rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let names = longest.clamp(13, MOST_NAME);
    let line = |(name, value): &(String, String)| {
        let value = value.replace('\n', &format!("\n{:names$}   ", ""));
        format!("  {name:<names$} {value}")
    };
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_of_a_value_begins_in_the_same_column() {
        let row = |name: &str, value: &str| (name.to_owned(), value.to_owned());
        let text = text_of(&[row("size", "1 x 1"), row("description", "a\nb")]);
        assert_eq!(text, "  size          1 x 1\n  description   a\n                b");
        let text = text_of(&[row("size", "1 x 1"), row("ProjectedCitation", "a\nb")]);
        let expected = "  size              1 x 1\n  ProjectedCitation a\n                    b";
        assert_eq!(text, expected);
    }
}
