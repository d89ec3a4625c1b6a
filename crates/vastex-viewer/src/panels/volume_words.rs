//! Places, lengths and values of a volume in words.

use glam::{DVec2, DVec3};
use vastex::RAY_BRICKS;

use super::lengths::TexelSize;
use crate::volume::{RAY_STEPS, RayCut};
use crate::volume_scene::{PointAnswer, VolumeFacts};

/// The longest step that the panel offers.
pub(super) const LONGEST_STEP: f64 = 2.0;

/// Units of length as OME names them, and as people write them.
const UNITS: [(&str, &str); 9] = [
    ("angstrom", "Å"),
    ("nanometer", "nm"),
    ("micrometer", "µm"),
    ("micron", "µm"),
    ("millimeter", "mm"),
    ("centimeter", "cm"),
    ("meter", "m"),
    ("kilometer", "km"),
    ("picometer", "pm"),
];

/// A unit as people write it.
pub(super) fn unit_symbol(unit: &str) -> &str {
    UNITS.iter().find(|(name, _)| *name == unit).map_or(unit, |(_, symbol)| symbol)
}

/// Lengths of a scene's world in the volume's own units.
pub(super) struct Lengths {
    /// Where there is a unit.
    size: Option<TexelSize>,
    unit_length: f64,
}

impl Lengths {
    pub(super) fn of(facts: &VolumeFacts) -> Lengths {
        let unit = facts.unit.as_deref().map(unit_symbol);
        let size = unit.and_then(|unit| TexelSize::new([facts.unit_length; 2], unit));
        Lengths { size, unit_length: facts.unit_length }
    }

    /// A length in words.
    pub(super) fn told(&self, length: f64) -> String {
        match &self.size {
            Some(size) => size.told(size.length(DVec2::new(length, 0.0))),
            None => number(length * self.unit_length, length * self.unit_length / 1000.0),
        }
    }

    /// The longest round length that is no longer than so much: which, and in words.
    pub(super) fn round(&self, most: f64) -> Option<(f64, String)> {
        match &self.size {
            Some(size) => {
                let all = size.length(DVec2::new(most, 0.0));
                let (length, text) = size.round(all)?;
                Some((most * length / all, text))
            }
            None => {
                let (length, decimals) = crate::figures::round_down(most * self.unit_length)?;
                Some((length / self.unit_length, format!("{length:.decimals$}")))
            }
        }
    }
}

/// A number with as many digits as tell apart what is so much apart.
fn number(value: f64, apart: f64) -> String {
    let digits = (1.0 - apart.abs().max(1e-12).log10()).ceil().clamp(0.0, 9.0) as usize;
    let text = format!("{value:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// By what rule coarser levels were made, or are made where the file lacks them, if maxima are dimmer there.
/// Nothing is said of a volume of labels, which has none.
pub(super) fn dimmer_text(facts: &VolumeFacts) -> Option<String> {
    if facts.channels.is_empty() {
        return None;
    }
    let dims = |rule: &&str| *rule != "max";
    let stored = facts.downsample.as_deref().filter(dims).map(|rule| ("coarser levels were made", rule));
    let made =
        facts.made_by.as_deref().filter(dims).map(|rule| ("levels that the file lacks are made", rule));
    stored.or(made).map(|(what, rule)| format!("{what} by {rule}: maxima are dimmer there"))
}

/// What is said where rays meet more than is taken.
pub fn ray_cut_text(cut: &RayCut) -> String {
    let (too_many, fewer) = ("have more samples than are taken", "show fewer channels, or no labels");
    let (what, remedy) = match cut {
        RayCut::Bricks(_) => (format!("meet more than {RAY_BRICKS} bricks"), "zoom out".to_owned()),
        RayCut::Labels(_) => {
            ("pass more voxels of labels than a processor takes".to_owned(), "hide the labels".to_owned())
        }
        RayCut::Samples(_, Some(step)) if *step <= LONGEST_STEP => {
            (too_many.to_owned(), format!("choose a longer step, of {step} or more"))
        }
        RayCut::Samples(_, Some(step)) if RAY_STEPS.contains(step) => {
            (too_many.to_owned(), format!("{fewer}, give --step {step} or more"))
        }
        RayCut::Samples(..) => (too_many.to_owned(), fewer.to_owned()),
    };
    format!("Rays may {what}: what lies behind is not seen; {remedy}, or look along a shorter side")
}

/// A place of the scene's world in the file's own system.
pub(super) fn place_text(facts: &VolumeFacts, place: DVec3) -> String {
    let at = |axis: usize| {
        let apart = facts.of.voxel[axis] * facts.unit_length;
        number(facts.origin[axis] + place[axis] * facts.unit_length, apart)
    };
    let unit = facts.unit.as_deref().map_or(String::new(), |unit| format!(" {}", unit_symbol(unit)));
    format!("{}, {}, {}{unit}", at(0), at(1), at(2))
}

/// What lies at a place, name by name.
pub(super) fn point_rows(facts: &VolumeFacts, told: &PointAnswer) -> Vec<(String, String)> {
    let value = |value: &crate::volume_scene::PointValue| {
        (facts.channel_name(value.channel), format!("{}  level {}", value.value, value.level))
    };
    let mut rows: Vec<(String, String)> = told.values.iter().map(value).collect();
    rows.extend(told.label.map(|label| ("label".to_owned(), label.to_string())));
    let [x, y, z] = told.voxel;
    rows.push(("voxel".to_owned(), format!("{x}, {y}, {z}")));
    rows.extend(told.place.map(|place| ("place".to_owned(), place_text(facts, place))));
    rows
}

/// What a point answered, in a line: its voxel, values and label.
pub fn volume_status_text(facts: &VolumeFacts, told: &PointAnswer) -> String {
    let [x, y, z] = told.voxel;
    let mut said = format!("{x}, {y}, {z}");
    if let Some(place) = told.place {
        said += &format!("   {}", place_text(facts, place));
    }
    let is_one = facts.channels.len() == 1;
    for value in &told.values {
        match is_one {
            true => said += &format!("   {}", value.value),
            false => said += &format!("   {} {}", facts.channel_name(value.channel), value.value),
        }
    }
    said.extend(told.label.map(|label| format!("   label {label}")));
    let mut levels: Vec<u8> = told.values.iter().map(|value| value.level).collect();
    levels.dedup();
    if let [level] = levels[..] {
        said += &format!("   level {level}");
    }
    said
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume_scene::{PointValue, facts_for_tests};

    #[test]
    fn the_rule_that_dims_maxima_is_told_also_of_levels_that_are_made() {
        let text = |downsample: Option<&str>, made_by: Option<&str>| {
            let [downsample, made_by] = [downsample, made_by].map(|rule| rule.map(str::to_owned));
            dimmer_text(&VolumeFacts { downsample, made_by, ..facts_for_tests() })
        };
        assert_eq!(text(None, None), None);
        assert_eq!(text(Some("max"), Some("max")), None);
        assert!(
            text(Some("gaussian"), Some("mean")).unwrap().starts_with("coarser levels were made by gaussian")
        );
        let of_made = text(None, Some("mean")).unwrap();
        assert!(of_made.starts_with("levels that the file lacks are made by mean"), "{of_made}");
        assert_eq!(text(Some("max"), Some("mean")), Some(of_made));
        let of_labels =
            VolumeFacts { channels: Vec::new(), made_by: Some("majority".to_owned()), ..facts_for_tests() };
        assert_eq!(dimmer_text(&of_labels), None);
    }

    #[test]
    fn rays_that_are_cut_are_told_with_what_helps() {
        for (cut, parts) in [
            (RayCut::Bricks(5000.0), ["more than 4096 bricks", "zoom out"]),
            (RayCut::Labels([9.0, 8.0]), ["voxels of labels", "hide the labels"]),
            (RayCut::Samples([9.0, 8.0], Some(2.0)), ["more samples", "a longer step, of 2 or more"]),
            (RayCut::Samples([9.0, 8.0], Some(2.01)), ["fewer channels", "--step 2.01 or more"]),
            (RayCut::Samples([9.0, 8.0], Some(100.01)), ["fewer channels", "or no labels, or look"]),
            (RayCut::Samples([9.0, 0.0], None), ["more samples", "fewer channels"]),
        ] {
            let text = ray_cut_text(&cut);
            assert!(parts.iter().all(|part| text.contains(part)), "{text}");
        }
    }

    #[test]
    fn places_and_lengths_are_in_the_units_of_the_volume() {
        let facts = facts_for_tests();
        assert_eq!(place_text(&facts, DVec3::new(1.25, 0.5, 3.0)), "102.5, 1, 2 µm");
        let lengths = Lengths::of(&facts);
        assert_eq!(lengths.told(10.0), "20 µm");
        let (length, text) = lengths.round(3.0).unwrap();
        assert!((length - 2.5).abs() < 1e-9 && text == "5 µm", "{length} {text}");
        let none = VolumeFacts { unit: None, unit_length: 1.0, ..facts };
        assert_eq!(place_text(&none, DVec3::new(1.25, 0.5, 3.0)), "101.25, 0.5, -1");
        assert_eq!(Lengths::of(&none).round(37.0), Some((20.0, "20".into())));
        assert_eq!(Lengths::of(&none).told(37.5), "37.5");
    }

    #[test]
    fn a_line_says_place_values_and_level() {
        let facts = facts_for_tests();
        let values = vec![
            PointValue { channel: 0, value: "12".into(), level: 0 },
            PointValue { channel: 2, value: "7".into(), level: 0 },
        ];
        let place = Some(DVec3::new(0.125, 0.125, 0.5));
        let told = PointAnswer { number: 1, place, voxel: [0; 3], values, label: Some(3) };
        assert_eq!(
            volume_status_text(&facts, &told),
            "0, 0, 0   100.25, 0.25, -3 µm   nuclei 12   channel 2 7   label 3   level 0"
        );
    }
}
