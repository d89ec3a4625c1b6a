//! `vastex.toml`: the settings of pools and of reading, laid over those that there are. [`PoolSettings`] and
//! [`Settings`] say what they mean.
//!
//! Within a file the section of the platform comes after the rest, so it has the last word; of several files
//! the later has.

mod reading;

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use serde::Deserialize;
use toml::Spanned;
use vastex_core::{BiasRule, Integrator, LayerFormat, Pager};

use crate::settings::Settings;
use crate::settings::pools::{PoolRule, PoolSettings, PoolTuning};
use reading::ReadingOfFile;

/// A settings file is no longer than this, in bytes.
const MAX_BYTES: u64 = 1 << 20;
/// The largest size of a pool, in MiB: 1 TiB.
const MAX_MIB: f64 = (1 << 20) as f64;
/// The largest factor of a scale group.
const MAX_FACTOR: f64 = 1024.0;

/// Why a settings file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// The settings file cannot be read.
    #[error("{file}: the settings cannot be read: {}", vastex_tiles::read_advice(.error))]
    Unreadable {
        /// The file.
        file: String,
        /// What the system said.
        error: io::Error,
    },
    /// The settings file says something that is not understood.
    #[error("{file}:{line}: {fault}")]
    Invalid {
        /// The file.
        file: String,
        /// The line, counted from 1.
        line: usize,
        /// What is wrong, and what would be right.
        fault: String,
    },
}

/// What a section `[platform.NAME]` is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Platform {
    /// Linux.
    Linux,
    /// Windows.
    Windows,
    /// macOS.
    Macos,
    /// Android.
    Android,
    /// iOS.
    Ios,
    /// A browser.
    Web,
}

impl Platform {
    /// The platform that this was compiled for, if it has a name.
    pub fn current() -> Option<Platform> {
        let known = [
            ("linux", Platform::Linux),
            ("windows", Platform::Windows),
            ("macos", Platform::Macos),
            ("android", Platform::Android),
            ("ios", Platform::Ios),
        ];
        match cfg!(target_family = "wasm") {
            true => Some(Platform::Web),
            false => known.into_iter().find(|(name, _)| *name == std::env::consts::OS).map(|(_, p)| p),
        }
    }
}

impl Settings {
    /// Applies a settings file to these settings, with its section for this platform.
    pub fn read(&mut self, path: impl AsRef<Path>) -> Result<(), SettingsError> {
        let path = path.as_ref();
        let file = path.display().to_string();
        let text =
            read_text(path).map_err(|error| SettingsError::Unreadable { file: file.clone(), error })?;
        self.read_toml(&file, &text, Platform::current())
    }

    /// Applies the text of a settings file to these settings; errors call it `file`. If it fails, the
    /// settings are as they were.
    pub fn read_toml(
        &mut self,
        file: &str,
        text: &str,
        platform: Option<Platform>,
    ) -> Result<(), SettingsError> {
        for mut section in sections(file, text, platform)? {
            section.reading.take().into_iter().for_each(|reading| reading.lay_over(self));
            self.pools.lay_over(section);
        }
        Ok(())
    }
}

impl PoolSettings {
    fn lay_over(&mut self, section: Section) {
        if let Some(tuning) = section.default_pool {
            self.default_pool = self.default_pool.overridden_by(tuning.into());
        }
        self.rules.extend(section.pool.into_iter().map(PoolRule::from));
        let ScaleGroupsOfFile { first, second, third } = section.scale_groups.unwrap_or_default();
        for (factor, set) in self.scale_groups.0.iter_mut().zip([first, second, third]) {
            *factor = set.map_or(*factor, |Factor(factor)| factor);
        }
    }
}

/// What a text says, of all platforms and then of this one.
fn sections(file: &str, text: &str, platform: Option<Platform>) -> Result<Vec<Section>, SettingsError> {
    let parsed = Contents::parse(text).map_err(|(at, fault)| SettingsError::Invalid {
        file: file.into(),
        line: text.as_bytes().iter().take(at).filter(|&&byte| byte == b'\n').count() + 1,
        fault,
    })?;
    let Contents { pool, default_pool, scale_groups, reading, platform: platforms } = parsed;
    let own = platforms.into_iter().filter(|(name, _)| Some(*name) == platform);
    let of_all = Section { pool, default_pool, scale_groups, reading };
    Ok([of_all].into_iter().chain(own.map(|(_, section)| section)).collect())
}

fn read_text(path: &Path) -> io::Result<String> {
    // Looked at before it is opened: opening a pipe would wait for a writer.
    let found = std::fs::metadata(path)?;
    if !found.is_file() {
        let what = if found.is_dir() { "it is a directory" } else { "it is a device or a pipe" };
        return Err(io::Error::other(format!("{what}; name a file")));
    }
    let mut text = String::new();
    let read = File::open(path)?.take(MAX_BYTES + 1).read_to_string(&mut text)?;
    match read as u64 > MAX_BYTES {
        true => Err(io::Error::new(io::ErrorKind::FileTooLarge, "it has over 1 MiB; is it the right file?")),
        false => Ok(text),
    }
}

/// A file as it is written.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Contents {
    pool: Vec<RuleOfFile>,
    default_pool: Option<TuningOfFile>,
    scale_groups: Option<ScaleGroupsOfFile>,
    reading: Option<ReadingOfFile>,
    platform: std::collections::BTreeMap<Platform, Section>,
}

/// What a file says of all platforms, or of one.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Section {
    pool: Vec<RuleOfFile>,
    default_pool: Option<TuningOfFile>,
    scale_groups: Option<ScaleGroupsOfFile>,
    reading: Option<ReadingOfFile>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct RuleOfFile {
    formats: Option<Formats>,
    tile_min: Option<u32>,
    tile_max: Option<Spanned<u32>>,
    size_mib: Option<SizeMib>,
    allow_size_scale: Option<bool>,
    scale_group: Option<ScaleGroup>,
    residency_mip_bias: Option<bool>,
    mip_bias_rule: Option<RuleName>,
    pin_share: Option<PinShare>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct TuningOfFile {
    size_mib: Option<SizeMib>,
    allow_size_scale: Option<bool>,
    scale_group: Option<ScaleGroup>,
    residency_mip_bias: Option<bool>,
    mip_bias_rule: Option<RuleName>,
    pin_share: Option<PinShare>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct ScaleGroupsOfFile {
    #[serde(rename = "0")]
    first: Option<Factor>,
    #[serde(rename = "1")]
    second: Option<Factor>,
    #[serde(rename = "2")]
    third: Option<Factor>,
}

impl Contents {
    /// Where something is wrong, the byte at which it stands, and what is.
    fn parse(text: &str) -> Result<Contents, (usize, String)> {
        let contents: Contents = toml::from_str(text).map_err(|error| {
            let at = error.span().map_or(0, |span| span.start);
            (at, error.message().trim().replace('\n', "; "))
        })?;
        let sections = contents.platform.values().flat_map(|section| &section.pool);
        for rule in contents.pool.iter().chain(sections) {
            if let (Some(min), Some(max)) = (rule.tile_min, &rule.tile_max)
                && min > *max.get_ref()
            {
                let fault = format!(
                    "tile_max {} is below tile_min {min}; no tile suits, so make it larger",
                    max.get_ref()
                );
                return Err((max.span().start, fault));
            }
        }
        Ok(contents)
    }
}

impl From<RuleOfFile> for PoolRule {
    fn from(rule: RuleOfFile) -> PoolRule {
        let tuning = TuningOfFile {
            size_mib: rule.size_mib,
            allow_size_scale: rule.allow_size_scale,
            scale_group: rule.scale_group,
            residency_mip_bias: rule.residency_mip_bias,
            mip_bias_rule: rule.mip_bias_rule,
            pin_share: rule.pin_share,
        };
        PoolRule {
            formats: rule.formats.map(|Formats(formats)| formats),
            tile_min: rule.tile_min,
            tile_max: rule.tile_max.map(Spanned::into_inner),
            tuning: tuning.into(),
        }
    }
}

impl From<TuningOfFile> for PoolTuning {
    fn from(tuning: TuningOfFile) -> PoolTuning {
        PoolTuning {
            bytes: tuning.size_mib.map(|SizeMib(bytes)| bytes),
            allow_size_scale: tuning.allow_size_scale,
            scale_group: tuning.scale_group.map(|ScaleGroup(group)| group),
            residency_mip_bias: tuning.residency_mip_bias,
            mip_bias_rule: tuning.mip_bias_rule.map(BiasRule::from),
            pin_share: tuning.pin_share.map(|PinShare(percent)| percent),
        }
    }
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum RuleName {
    Solved,
    Integrating,
}

impl From<RuleName> for BiasRule {
    fn from(name: RuleName) -> BiasRule {
        match name {
            RuleName::Solved => BiasRule::Solved,
            RuleName::Integrating => BiasRule::Integrating(Integrator::default()),
        }
    }
}

#[derive(Debug, Deserialize)]
#[serde(try_from = "Vec<String>")]
struct Formats(Vec<LayerFormat>);

impl TryFrom<Vec<String>> for Formats {
    type Error = String;

    fn try_from(names: Vec<String>) -> Result<Formats, String> {
        let known = || LayerFormat::ALL.map(LayerFormat::name).join(", ");
        if names.is_empty() {
            return Err(format!(
                "a pool has one layer at least; leave formats out, or name some of {}",
                known()
            ));
        }
        let format = |name: &String| {
            LayerFormat::named(name)
                .ok_or_else(|| format!("there is no format {name:?}; the formats are {}", known()))
        };
        Ok(Formats(names.iter().map(format).collect::<Result<_, _>>()?))
    }
}

/// In bytes.
#[derive(Debug, Deserialize)]
#[serde(try_from = "f64")]
struct SizeMib(u64);

impl TryFrom<f64> for SizeMib {
    type Error = String;

    fn try_from(mib: f64) -> Result<SizeMib, String> {
        match mib > 0.0 && mib <= MAX_MIB {
            true => Ok(SizeMib((mib * f64::from(1 << 20)) as u64)),
            false => Err(format!("size_mib is {mib}; give it more than 0 and at most {MAX_MIB}")),
        }
    }
}

#[derive(Debug, Deserialize)]
#[serde(try_from = "i64")]
struct ScaleGroup(u8);

impl TryFrom<i64> for ScaleGroup {
    type Error = String;

    fn try_from(group: i64) -> Result<ScaleGroup, String> {
        match group {
            0..=2 => Ok(ScaleGroup(group as u8)),
            _ => Err(format!("there is no scale group {group}; there are 0, 1 and 2")),
        }
    }
}

/// In percent.
#[derive(Debug, Deserialize)]
#[serde(try_from = "i64")]
struct PinShare(u32);

impl TryFrom<i64> for PinShare {
    type Error = String;

    fn try_from(percent: i64) -> Result<PinShare, String> {
        let most = Pager::MOST_PINS;
        match u32::try_from(percent).ok().filter(|&percent| percent <= most) {
            Some(percent) => Ok(PinShare(percent)),
            None => Err(format!("a pin_share of {percent} percent; give it 0 to {most}")),
        }
    }
}

#[derive(Debug, Deserialize)]
#[serde(try_from = "f64")]
struct Factor(f64);

impl TryFrom<f64> for Factor {
    type Error = String;

    fn try_from(factor: f64) -> Result<Factor, String> {
        match factor > 0.0 && factor <= MAX_FACTOR {
            true => Ok(Factor(factor)),
            false => Err(format!("a scale of {factor}; give it more than 0 and at most {MAX_FACTOR}")),
        }
    }
}
