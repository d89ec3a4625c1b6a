//! Units of length: how long each is, so that lengths in one are put in another.

/// Metres of a unit of length, by the names that OME's specifications have and those that people write.
pub(crate) fn metres(unit: &str) -> Option<f64> {
    const UNITS: &[(&str, &[&str], f64)] = &[
        ("angstrom", &["å", "a", "ångström"], 1e-10),
        ("picometer", &["pm", "picometre"], 1e-12),
        ("nanometer", &["nm", "nanometre"], 1e-9),
        ("micrometer", &["um", "µm", "μm", "micron", "microns", "micrometre"], 1e-6),
        ("millimeter", &["mm", "millimetre"], 1e-3),
        ("centimeter", &["cm", "centimetre"], 1e-2),
        ("meter", &["m", "metre"], 1.0),
        ("kilometer", &["km", "kilometre"], 1e3),
        ("inch", &["in"], 0.0254),
        ("foot", &["ft"], 0.3048),
    ];
    let unit = unit.trim().to_lowercase();
    let found = UNITS.iter().find(|(name, others, _)| *name == unit || others.contains(&unit.as_str()));
    found.map(|(_, _, metres)| *metres)
}

/// How many of another unit one of this is; `None` where nobody knows.
pub(crate) fn in_other(unit: &str, other: &str) -> Option<f64> {
    if unit == other {
        return Some(1.0);
    }
    metres(unit).zip(metres(other)).map(|(unit, other)| if unit == other { 1.0 } else { unit / other })
}

/// Lengths along axes, put in one unit.
pub(crate) struct OneUnit {
    /// The unit of the first axis that names one.
    pub(crate) unit: Option<String>,
    /// What lengths along each axis are multiplied by.
    pub(crate) factors: [f64; 3],
    /// What was odd: axes whose units differ.
    pub(crate) oddities: Vec<String>,
}

/// The unit of the first axis that names one, in which lengths along the others are put where both units are
/// known.
pub(crate) fn one_unit(units: &[Option<String>; 3]) -> OneUnit {
    let mut one =
        OneUnit { unit: units.iter().flatten().next().cloned(), factors: [1.0; 3], oddities: vec![] };
    let Some(first) = &one.unit else { return one };
    for (own, factor) in units.iter().zip(&mut one.factors) {
        let Some(own) = own.as_ref().filter(|own| *own != first) else { continue };
        match in_other(own, first) {
            Some(1.0) => {}
            Some(more) => {
                let (own, first) = (short(own), short(first));
                one.oddities
                    .push(format!("axes of space are in {own} and in {first}; all are put in {first}"));
                *factor = more;
            }
            None => one.oddities.push(format!(
                "axes of space are in '{}' and in '{}', which cannot be compared",
                short(own),
                short(first)
            )),
        }
    }
    one
}

/// A unit as it is told: names have no length of their own.
fn short(unit: &str) -> String {
    const MOST: usize = 40;
    match unit.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}...", &unit[..end]),
        None => unit.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_have_a_length() {
        assert_eq!(metres("Micrometer"), Some(1e-6));
        assert_eq!(metres("µm"), metres("um"));
        assert_eq!(metres("parsec"), None);
        assert_eq!((in_other("parsec", "parsec"), in_other("parsec", "m")), (Some(1.0), None));
        assert!(in_other("nm", "micron").is_some_and(|factor| (factor - 1e-3).abs() < 1e-15));
    }

    #[test]
    fn axes_are_put_in_the_unit_of_the_first() {
        let of = |units: [&str; 3]| one_unit(&units.map(|unit| (!unit.is_empty()).then(|| unit.to_owned())));
        let one = of(["nm", "nanometer", "µm"]);
        assert_eq!((one.unit.as_deref(), one.oddities.len()), (Some("nm"), 1));
        assert!((one.factors[2] - 1000.0).abs() < 1e-9 && one.factors[..2] == [1.0; 2], "{:?}", one.factors);
        let one = of(["", "pixel", "mm"]);
        assert_eq!((one.unit.as_deref(), one.factors), (Some("pixel"), [1.0; 3]));
        assert!(one.oddities[0].contains("cannot be compared"), "{:?}", one.oddities);
        assert!(of([""; 3]).unit.is_none() && of(["mm", "", "millimetre"]).oddities.is_empty());
        let long = of(["m", "m", &"x".repeat(500)]);
        assert!(long.oddities[0].len() < 200, "{:?}", long.oddities);
    }
}
