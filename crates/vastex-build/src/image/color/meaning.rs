//! What a profile says: its name, and the curves and primaries, or the table, by which colours are converted.
//!
//! How rows are converted is [`super::managed`]'s business.

use moxcms::{
    Chromaticity, CicpColorPrimaries, CicpProfile, ColorPrimaries, ColorProfile, DataColorSpace,
    MatrixCoefficients, ProfileText, ToneReprCurve, TransferCharacteristics,
};

use super::{Profile, Stored};

/// The encoding gamma of sRGB, times 100,000, as PNG stores it.
const SRGB_GAMMA: u32 = 45_455;
/// What a gamma may differ from that and still mean sRGB's own curve.
const GAMMA_TOLERANCE: u32 = 500;
/// Times 100,000: gammas beyond these are taken for a mistake.
const GAMMAS: std::ops::RangeInclusive<u32> = 10_000..=1_000_000;

/// A profile that can be followed, if the image suits it.
pub(super) struct Meaning {
    pub(super) name: String,
    pub(super) profile: ColorProfile,
}

/// A profile that cannot be followed.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct NoMeaning {
    pub(super) name: String,
    pub(super) why: &'static str,
}

impl Profile {
    /// What it says.
    pub(super) fn meaning(&self) -> Result<Meaning, NoMeaning> {
        match &self.0 {
            Stored::Icc(bytes) => of_icc(bytes),
            Stored::Curve { gamma, chromaticities } => of_curve(*gamma, *chromaticities),
            Stored::CodePoints { primaries, transfer, is_plain } => {
                of_code_points(*primaries, *transfer, *is_plain)
            }
        }
    }
}

fn of_icc(bytes: &[u8]) -> Result<Meaning, NoMeaning> {
    let Ok(profile) = ColorProfile::new_from_slice(bytes) else {
        return Err(NoMeaning { name: "an ICC profile".into(), why: "it is damaged" });
    };
    let name = profile.description.as_ref().and_then(text).unwrap_or_else(|| "an unnamed profile".into());
    let is_hdr = profile.cicp.is_some_and(|cicp| is_high_dynamic_range(cicp.transfer_characteristics));
    match profile.color_space {
        _ if is_hdr => Err(NoMeaning { name, why: "it is for high dynamic range" }),
        DataColorSpace::Rgb | DataColorSpace::Gray => Ok(Meaning { name, profile }),
        DataColorSpace::Cmyk => Err(NoMeaning { name, why: "it is for CMYK" }),
        _ => Err(NoMeaning { name, why: "it is neither for RGB nor for grey" }),
    }
}

fn is_high_dynamic_range(transfer: TransferCharacteristics) -> bool {
    matches!(transfer, TransferCharacteristics::Smpte2084 | TransferCharacteristics::Hlg)
}

/// A text in one line; `None` if it is empty.
fn text(text: &ProfileText) -> Option<String> {
    let found = match text {
        ProfileText::PlainString(text) => text,
        ProfileText::Localizable(texts) => {
            let english = texts.iter().find(|text| text.language == "en");
            &english.or(texts.first())?.value
        }
        ProfileText::Description(text) if text.ascii_string.is_empty() => &text.unicode_string,
        ProfileText::Description(text) => &text.ascii_string,
    };
    let line: String = found.chars().filter(|c| !c.is_control()).take(80).collect();
    let line = line.trim();
    (!line.is_empty()).then(|| line.to_owned())
}

fn of_curve(gamma: Option<u32>, chromaticities: Option<[[u32; 2]; 4]>) -> Result<Meaning, NoMeaning> {
    let name = match (gamma, chromaticities) {
        (Some(gamma), None) => format!("gamma {:.5}", f64::from(gamma) / 1e5),
        (Some(gamma), Some(_)) => format!("gamma {:.5} with its own primaries", f64::from(gamma) / 1e5),
        _ => "its own primaries".into(),
    };
    let no_meaning = |name| NoMeaning { name, why: "its numbers make no sense" };
    let mut profile = ColorProfile::new_srgb();
    profile.cicp = None;
    if let Some(gamma) = gamma.filter(|gamma| gamma.abs_diff(SRGB_GAMMA) > GAMMA_TOLERANCE) {
        if !GAMMAS.contains(&gamma) {
            return Err(no_meaning(name));
        }
        set_curve(&mut profile, &ToneReprCurve::Parametric(vec![1e5 / gamma as f32]));
    }
    if let Some(points) = chromaticities {
        let points = points.map(|point| point.map(|v| f64::from(v) / 1e5));
        if !is_sound(points) {
            return Err(no_meaning(name));
        }
        let [white, red, green, blue] = points.map(|[x, y]| Chromaticity::new(x as f32, y as f32));
        profile.update_rgb_colorimetry(white.to_xyyb(), ColorPrimaries { red, green, blue });
    }
    Ok(Meaning { name, profile })
}

/// Returns true if white, red, green and blue span anything.
fn is_sound([white, red, green, blue]: [[f64; 2]; 4]) -> bool {
    let in_range = |[x, y]: [f64; 2]| (0.0..=1.0).contains(&x) && (1e-3..=1.0).contains(&y);
    let area = (green[0] - red[0]) * (blue[1] - red[1]) - (blue[0] - red[0]) * (green[1] - red[1]);
    // Primaries may lie a little outside what is seen, and blue ones have little y or even none.
    in_range(white) && [red, green, blue].iter().flatten().all(|v| (0.0..=2.0).contains(v)) && {
        [red, green, blue].iter().all(|p| p[1] > 0.0) && area.abs() > 1e-3
    }
}

fn of_code_points(primaries: u8, transfer: u8, is_plain: bool) -> Result<Meaning, NoMeaning> {
    let name = match (primaries, transfer) {
        (9, 16) => "BT.2100 PQ (cICP)".into(),
        (9, 18) => "BT.2100 HLG (cICP)".into(),
        (9, 1 | 6 | 14 | 15) => "BT.2020 (cICP)".into(),
        (1, 1 | 6 | 14 | 15) => "BT.709 (cICP)".into(),
        (12, 13) => "Display P3 (cICP)".into(),
        _ => format!("cICP {primaries}/{transfer}"),
    };
    let known = (CicpColorPrimaries::try_from(primaries), TransferCharacteristics::try_from(transfer));
    let (Ok(color_primaries), Ok(transfer_characteristics)) = known else {
        return Err(NoMeaning { name, why: "its numbers are not known" });
    };
    if is_high_dynamic_range(transfer_characteristics) {
        return Err(NoMeaning { name, why: "it is for high dynamic range" });
    }
    if !is_plain {
        return Err(NoMeaning { name, why: "its samples are not RGB of the full range" });
    }
    let matrix_coefficients = MatrixCoefficients::Identity;
    let cicp =
        CicpProfile { color_primaries, transfer_characteristics, matrix_coefficients, full_range: true };
    let profile = ColorProfile::new_from_cicp(cicp);
    match profile.red_trc {
        Some(_) => Ok(Meaning { name, profile }),
        None => Err(NoMeaning { name, why: "its numbers are not known" }),
    }
}

/// sRGB, or its light.
pub(super) fn srgb(is_linear: bool) -> ColorProfile {
    let mut profile = ColorProfile::new_srgb();
    if is_linear {
        profile.cicp = None;
        set_curve(&mut profile, &ToneReprCurve::Parametric(vec![1.0]));
    }
    profile
}

fn set_curve(profile: &mut ColorProfile, curve: &ToneReprCurve) {
    for channel in [&mut profile.red_trc, &mut profile.green_trc, &mut profile.blue_trc] {
        *channel = Some(curve.clone());
    }
}
